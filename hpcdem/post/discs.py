"""Discs of true size as a matplotlib artist."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import Collection, PathCollection
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D, AffineDeltaTransform


class Discs(Collection):
    """n discs in axes of equal aspect; line: width of circles in points, 0 for filled discs.

    places (n, 2) and radius (n,) in data units; shades (m, 3): colours; kind (n,): the colour of each disc.
    """

    def __init__(
        self, places: np.ndarray, radius: np.ndarray, shades: np.ndarray, kind: np.ndarray, line: float = 0.0
    ) -> None:
        super().__init__()
        self.set_in_layout(False)  # it has no outline that a layout could ask for
        self.places, self.radius, self.shades, self.kind, self.line = places, radius, shades, kind, line

    def draw(self, renderer: Any) -> None:
        """Draw into the axes: one shape per radius (to three digits) at many places, which makes small files."""
        if not self.get_visible() or len(self.radius) == 0:
            return
        ax: Any = self.axes
        radii, size = np.unique([float(f"{r:.3g}") for r in self.radius], return_inverse=True)
        for k, radius in enumerate(radii):
            chosen = np.flatnonzero(size == k)
            shades = self.shades[self.kind[chosen]]
            curves = PathCollection(
                [Outline.unit_circle()], offsets=self.places[chosen], offset_transform=ax.transData,
                facecolors="none" if self.line else shades, edgecolors=shades if self.line else "none",
                linewidths=self.line,
            )  # fmt: skip
            curves.set_transform(Affine2D().scale(radius) + AffineDeltaTransform(ax.transData))
            curves.set_figure(ax.get_figure())
            curves.axes = ax
            curves.set_clip_path(ax.patch)
            curves.set_alpha(self.get_alpha())
            curves.draw(renderer)
