"""Discs of true size as a matplotlib artist: painted pixel by pixel into bitmaps, drawn as curves in PDF and SVG."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D, AffineDeltaTransform

from hpcdem.post import raster


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
        """Draw into the axes."""
        if not self.get_visible() or len(self.radius) == 0:
            return
        if isinstance(renderer, RendererAgg):
            self._paint(renderer)
        else:
            for curves in self._curves():
                curves.draw(renderer)

    def _paint(self, renderer: RendererAgg) -> None:
        ax: Any = self.axes
        box = ax.bbox
        left, bottom = int(np.floor(box.x0)), int(np.floor(box.y0))
        width, height = int(np.ceil(box.x1)) - left, int(np.ceil(box.y1)) - bottom
        (a, _, c), (_, e, f), _ = ax.transData.get_matrix()
        picture = raster.discs(
            a * self.places[:, 0] + (c - left), e * self.places[:, 1] + (f - bottom), a * self.radius, self.shades,
            self.kind, width, height, renderer.points_to_pixels(self.line),
        )  # fmt: skip
        if self.get_alpha() is not None:
            picture[:, :, 3] = np.rint(picture[:, :, 3] * float(self.get_alpha()))
        context = renderer.new_gc()
        context.set_clip_rectangle(box)
        renderer.draw_image(context, left, bottom, picture)
        context.restore()

    def _curves(self) -> list[PathCollection]:
        # One shape per radius (to three digits) at many places: small files.
        ax: Any = self.axes
        radii, size = np.unique([float(f"{r:.3g}") for r in self.radius], return_inverse=True)
        result = []
        for k, radius in enumerate(radii):
            chosen = np.flatnonzero(size == k)
            shades = self.shades[self.kind[chosen]]
            curves = PathCollection(
                [Outline.unit_circle()],
                offsets=self.places[chosen],
                offset_transform=ax.transData,
                facecolors="none" if self.line else shades,
                edgecolors=shades if self.line else "none",
                linewidths=self.line,
            )
            curves.set_transform(Affine2D().scale(radius) + AffineDeltaTransform(ax.transData))
            curves.set_figure(ax.get_figure())
            curves.axes = ax
            curves.set_clip_path(ax.patch)
            curves.set_alpha(self.get_alpha())
            result.append(curves)
        return result
