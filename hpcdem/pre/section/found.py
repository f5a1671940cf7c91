"""Shapes that a reader has gathered from a file, and entities that it has skipped."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.mesh.geometry import Curve
from hpcdem.pre.section.shapes import Placement, Shape, made_curve

NAMES = ("name", "layer", "unit", "formation", "label", "id")
"""Attributes that name a shape: the first of them that a shape has counts; upper and lower case are the same."""
MOST_POINTS = 5_000_000


class Found:
    """Shapes in the plane of the section and the unit of the file. metres: of that unit, None where the file names
    none; unit: about it, in words; low, high: ranges of the first two coordinates of maps; dropped: number of things
    left out, by (kind, layer)."""

    def __init__(self, path: Path, placement: Placement, attribute: str | None = None) -> None:
        self.path, self.placement, self.attribute = path, placement, attribute
        self.shapes: list[Shape] = []
        self.dropped: Counter[tuple[str, str]] = Counter()
        self.notes: list[str] = []
        self.warnings: list[str] = []
        self.metres: float | None = None
        self.unit = "the file defines no unit"
        self.axes = "y upwards"
        self.beside = 0.0
        self.points = 0
        self.low, self.high = np.full(2, np.inf), np.full(2, -np.inf)

    def refuse(self, message: str) -> HpcdemError:
        """An error that names the file."""
        return HpcdemError(f"{self.path}: {message}")

    def name(self, attributes: Mapping[str, Any], where: str) -> str:
        """The name of a shape by its attributes."""
        by_word = {str(key).lower(): value for key, value in attributes.items() if value not in (None, "")}
        if self.attribute is not None:
            if self.attribute.lower() not in by_word:
                known = ", ".join(map(str, attributes)) or "none"
                raise self.refuse(f"{where} has no attribute '{self.attribute}' (it has {known})")
            return str(by_word[self.attribute.lower()])
        return next((str(by_word[word]) for word in NAMES if word in by_word), "unnamed")

    def add(
        self, rings: Sequence[np.ndarray], polygon: bool, name: str, where: str,
        attributes: Mapping[str, Any] | None = None,
    ) -> None:  # fmt: skip
        """A polygon of rings, (n, 2 or 3) points in the file of which the first need not be repeated, or a line."""
        curves = []
        try:
            for points in rings:
                self._count(len(points))
                if not np.isfinite(points).all():
                    raise CommandError(f"{where}: a coordinate is not a finite number")
                self.low = np.minimum(self.low, points[:, :2].min(axis=0))
                self.high = np.maximum(self.high, points[:, :2].max(axis=0))
                if self.placement.line is not None and points.shape[1] == 3:
                    self.beside = max(self.beside, self.placement.beside(points))
                flat = self.placement.in_plane(points, where)
                if len(flat) > 1 and (flat[0] == flat[-1]).all():
                    flat, closed = flat[:-1], True
                else:
                    closed = polygon
                    if polygon and len(flat) > 2:
                        self._unclosed(flat, name, where)
                curves.append(made_curve(flat, closed, where))
        except CommandError as error:
            raise self.refuse(str(error)) from None
        self.shapes.append(Shape(name, tuple(curves), polygon, dict(attributes or {}), where))

    def add_curve(self, curve: Curve, name: str, where: str) -> None:
        """A curve in the plane of the section; a closed one is a polygon."""
        self._count(len(curve.points))
        self.shapes.append(Shape(name, (curve,), curve.closed, {}, where))

    def _unclosed(self, points: np.ndarray, name: str, where: str) -> None:
        (x, y), gap = points[-1], math.dist(points[0], points[-1])
        self.warnings.append(
            f"{where}: a ring of '{name}' is not closed: it ends at ({x:g}, {y:g}) in the file, {gap:g} from its start "
            "(units of the file); a straight side closes it"
        )

    def drop(self, kind: str, layer: str = "") -> None:
        """Count something that is left out."""
        self.dropped[kind, layer] += 1

    def _count(self, points: int) -> None:
        self.points += points
        if self.points > MOST_POINTS:
            raise self.refuse(f"more than {MOST_POINTS} points; simplify the drawing first")

    def left_out(self) -> str:
        """Describe the skipped entities by count, kind and layer."""
        return ", ".join(
            f"{count} {kind}{f' of {layer!r}' if layer else ''}" for (kind, layer), count in self.dropped.items()
        )
