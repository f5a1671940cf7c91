"""Simple solids in space: what geometry layers hold in three dimensions. Ranges ask how far a point is from their
surface, Gmsh is told them as they are (fill.py)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """Along the axes, between two corners [m]."""

    first: Point
    second: Point

    def check(self) -> None:
        """CommandError if it has no volume."""
        if any(a == b for a, b in zip(self.first, self.second)):
            raise CommandError(f"a box needs two corners that differ in x, y and z, got {self.first} and {self.second}")

    def bounds(self) -> np.ndarray:
        """(2, 3) least and greatest coordinates [m]."""
        return np.sort(np.array([self.first, self.second], np.float64), axis=0)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance of points (n, 3) from the surface [m], negative inside."""
        low, high = self.bounds()
        over = np.abs(points - 0.5 * (low + high)) - 0.5 * (high - low)
        outside = np.maximum(over, 0.0)
        return np.sqrt((outside * outside).sum(axis=1)) + np.minimum(over.max(axis=1), 0.0)


@dataclass(frozen=True)
class Sphere:
    """About a centre [m]."""

    centre: Point
    radius: float

    def check(self) -> None:
        """CommandError if it has no volume."""
        if not self.radius > 0.0:
            raise CommandError(f"a sphere needs a radius above 0, got {self.radius:g}")

    def bounds(self) -> np.ndarray:
        """(2, 3) least and greatest coordinates [m]."""
        return np.array(self.centre) + self.radius * np.array([[-1.0], [1.0]])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance of points (n, 3) from the surface [m], negative inside."""
        way = points - np.array(self.centre)
        return np.sqrt((way * way).sum(axis=1)) - self.radius


@dataclass(frozen=True)
class Cylinder:
    """A round one, between the middles of its ends [m]."""

    first: Point
    second: Point
    radius: float

    def check(self) -> None:
        """CommandError if it has no volume."""
        if not self.radius > 0.0 or self.first == self.second:
            raise CommandError("a cylinder needs two ends that are apart, and a radius above 0")

    def bounds(self) -> np.ndarray:
        """(2, 3) least and greatest coordinates [m]."""
        ends = np.array([self.first, self.second], np.float64)
        axis = ends[1] - ends[0]
        across = self.radius * np.sqrt(np.maximum(1.0 - axis * axis / (axis @ axis), 0.0))
        return np.array([ends.min(axis=0) - across, ends.max(axis=0) + across])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) distance of points (n, 3) from the surface [m], negative inside."""
        a, b = np.array(self.first), np.array(self.second)
        length = float(np.linalg.norm(b - a))
        way, axis = points - a, (b - a) / length
        along = way @ axis
        across = np.sqrt(np.maximum(((way - along[:, None] * axis) ** 2).sum(axis=1), 0.0)) - self.radius
        beyond = np.maximum(-along, along - length)
        outside = np.sqrt(np.maximum(across, 0.0) ** 2 + np.maximum(beyond, 0.0) ** 2)
        return outside + np.minimum(np.maximum(across, beyond), 0.0)


Solid = Box | Sphere | Cylinder
KINDS: dict[str, Any] = {"box": Box, "sphere": Sphere, "cylinder": Cylinder}


def made(kind: str, *values: Any) -> Solid:
    """A checked solid of this kind. CommandError if it has no volume."""
    solid: Solid = KINDS[kind](*(tuple(map(float, v)) if isinstance(v, (tuple, list)) else float(v) for v in values))
    solid.check()
    return solid


def on_surface(solid: Solid, points: np.ndarray, slack: float) -> np.ndarray:
    """(n,) bool: all of the points (n, k, 3) of each object lie on the surface, within `slack` [m]; of a face on one
    smooth part of it: a flat side, an end or the mantle."""
    near = (np.abs(solid.distance(points.reshape(-1, 3))) <= slack).reshape(points.shape[:2])
    on = near.all(axis=1)
    if points.shape[1] == 1 or isinstance(solid, Sphere):
        return on
    parts = np.zeros_like(on)
    for part in _parts(solid, points.reshape(-1, 3)):
        parts |= (np.abs(part).reshape(points.shape[:2]) <= slack).all(axis=1)
    return on & parts


def _parts(solid: Box | Cylinder, points: np.ndarray) -> list[np.ndarray]:
    """Distance (n,) of points (n, 3) from each smooth part of the surface, thought of without end [m]."""
    if isinstance(solid, Box):
        return [points[:, axis] - bound for one in solid.bounds() for axis, bound in enumerate(one)]
    a, b = np.array(solid.first), np.array(solid.second)
    axis = (b - a) / np.linalg.norm(b - a)
    along = (points - a) @ axis
    across = np.sqrt(np.maximum((((points - a) - along[:, None] * axis) ** 2).sum(axis=1), 0.0))
    return [along, (points - b) @ axis, across - solid.radius]


def state(solids: list[Solid]) -> list[list[Any]]:
    """As JSON values."""
    names = {of: name for name, of in KINDS.items()}
    return [[names[type(one)], list(asdict(one).values())] for one in solids]


def restored(given: list[list[Any]]) -> list[Solid]:
    """Inverse of `state`."""
    return [made(kind, *values) for kind, values in given]
