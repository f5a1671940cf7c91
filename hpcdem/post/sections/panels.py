"""One panel: one thing of one section, drawn into matplotlib axes whose data unit is the metre.

A field becomes a picture of true colours, painted where there are particles: values are interpolated linearly between
the nodes, strains of the nearest particle taken as they are, then coloured. Nothing is transparent, since PostScript
cannot be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from hpcdem.core.errors import HpcdemError
from hpcdem.core.fields import sides_of_box
from hpcdem.io.frame import Frame, Table
from hpcdem.post import layers
from hpcdem.post.cpt import ColourTable
from hpcdem.post.section import MEAN as MEAN_VOLUME
from hpcdem.post.section import Section

INK = "#000000"
LINE = 0.5
"""Width of surface, walls and bars [points]."""
BAND, SMOOTH_BAND, SHADE = 2.0, 1.0, 0.45
"""Shading of strained bands: where |distortional strain| is larger (SMOOTH_BAND: where it is a mean over the grid), a
stress is painted in this part of its brightness: strained bands show as dark ones. 2 is the second invariant 4 of the
manual's pages."""
FIELD_PIXELS = 1000
"""Approximate number of pixels of a field across a panel; at most FINEST per cell."""
FINEST = 8
BALL = 3.0
"""Radius in median radii of a ball: where it does not fit between the particles there is material, as under the surface
line."""
VECTOR_DISCS, DISC_PIXELS = 30000, 2400
"""Number of particles above which they become a bitmap in a vector picture; width of the bitmap in pixels."""


@dataclass(frozen=True)
class Kind:
    """Quantity of a panel. key: field of the section; unit: of the colour bar, one is `scale` SI units; squared:
    whether the square is drawn, with the sign of the field."""

    key: str
    title: str
    unit: str = ""
    scale: float = 1.0
    strain: bool = False
    squared: bool = False

    @property
    def heading(self) -> str:
        """Title with its unit."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    def shown(self, values: np.ndarray) -> np.ndarray:
        """Convert values of the field to those drawn, in `unit`."""
        return (values * np.abs(values) if self.squared else values) / self.scale


DEFORMATION = Kind("deformation", "Deformation")
VOLUMETRIC = Kind("volumetric", "Volumetric strain", "%", strain=True)
PAGE_VOLUME = Kind("volumetric", "det(1 + ∂u/∂x) − 1", "", 100.0, strain=True)
"""Volumetric strain as drawn on the manual's pages, with their colours."""
DISTORTIONAL = Kind("distortional", "Distortional strain J\N{SUBSCRIPT TWO}", strain=True, squared=True)
"""The second invariant of the deviator, as the manual's pages draw it; the field is its root."""
ROOT = Kind("distortional", "Distortional strain \N{SQUARE ROOT}J\N{SUBSCRIPT TWO}", strain=True)
MEAN = Kind("mean", "Mean stress", "MPa", 1e6)
_DIFFERENCE = (
    "\N{GREEK SMALL LETTER SIGMA}\N{SUBSCRIPT ONE} \N{MINUS SIGN} \N{GREEK SMALL LETTER SIGMA}\N{SUBSCRIPT THREE}"
)
SHEAR = Kind("shear", f"Shear stress {_DIFFERENCE}", "MPa", 0.5e6)
"""Maximum shear stress as drawn on the manual's pages; the field is half of it."""
HALF_SHEAR = Kind("shear", f"Maximum shear stress ({_DIFFERENCE})/2", "MPa", 1e6)
KINDS = (DEFORMATION, VOLUMETRIC, DISTORTIONAL, MEAN, SHEAR)
"""Kinds of panels from top to bottom."""


def draw(section: Section, kind: Kind, ax: Any, table: ColourTable | None) -> None:
    """Draw one kind; the limits of the axes are set already. table: colours of its values, in its unit."""
    if kind == DEFORMATION:
        draw_particles(section, ax)
    else:
        assert table is not None
        draw_field(section, kind, ax, table)
    draw_outline(section, ax)


def draw_particles(section: Section, ax: Any) -> None:
    """Discs of true size in the manual's colours; very many as a bitmap, also in a vector picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    frame = Frame(section.step, section.time, 0.0, {}, {}, {"particles": Table(section.particles)})
    if len(section.particles["x"]) <= VECTOR_DISCS:
        layers.balls(frame, ax)
        return
    (left, right), (bottom, top) = limits = ax.get_xlim(), ax.get_ylim()
    size = DISC_PIXELS, round(DISC_PIXELS * (top - bottom) / (right - left))
    canvas = FigureCanvasAgg(Figure(figsize=size, dpi=1))
    inner = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=limits[0], ylim=limits[1], frame_on=False)
    layers.balls(frame, inner)
    inner.set_axis_off()
    canvas.draw()
    _paint(ax, np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255.0, (left, right, bottom, top))


def _paint(ax: Any, picture: np.ndarray, extent: tuple[float, float, float, float]) -> None:
    ax.imshow(picture, origin="lower", extent=extent, interpolation="none", zorder=1.0, aspect=ax.get_aspect())


def draw_field(section: Section, kind: Kind, ax: Any, table: ColourTable) -> None:
    """A field in the colours of a table; stresses with the strained bands laid over."""
    left, right = ax.get_xlim()
    pixels = Pixels.over(section, right - left)
    if pixels is None:
        return
    strain = 1 if section.smooth else 0
    sharp = kind.strain and not (kind.key == VOLUMETRIC.key and section.volume == MEAN_VOLUME)
    shades = table.colours(kind.shown(pixels.values(section.fields[kind.key], strain if sharp else 1)))
    if not kind.strain:
        bands = np.abs(pixels.values(section.fields[DISTORTIONAL.key], strain))
        shades[bands > (SMOOTH_BAND if section.smooth else BAND)] *= SHADE
    painted = np.isfinite(shades[..., :1]) & pixels.material[..., None]
    _paint(ax, np.where(painted, shades, 1.0), pixels.extent)


def draw_outline(section: Section, ax: Any) -> None:
    """The line over the top, and the walls."""
    if len(section.surface):
        ax.plot(*np.transpose(section.surface), color=INK, linewidth=LINE, zorder=3.0, solid_joinstyle="round")
    if len(section.walls.get("id", ())):
        own = ~np.isin(section.walls["id"], [*sides_of_box(section.walls["id"])])
        _segments(ax, section.walls["p1"][own], section.walls["p2"][own], LINE)


def _segments(ax: Any, begin: np.ndarray, end: np.ndarray, width: float) -> Any:
    from matplotlib.collections import LineCollection

    lines = LineCollection(list(np.stack([begin, end], axis=1)), colors=INK, linewidths=width, zorder=3.0)
    return ax.add_collection(lines, autolim=False)


# -- fields as pictures -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pixels:
    """A bitmap over the particles of a section. rows, columns: middles of the pixels in units of nodes; material: where
    there are particles (rows, columns); extent: left, right, bottom, top [m]."""

    rows: np.ndarray
    columns: np.ndarray
    material: np.ndarray
    extent: tuple[float, float, float, float]

    @classmethod
    def over(cls, section: Section, width: float) -> Pixels | None:
        """Paint for a panel that is `width` [m] wide; None without particles."""
        p = {name: section.particles[name][section.bed] for name in ("x", "y", "radius")}
        if not len(p["x"]):
            return None
        fine = int(np.clip(round(FIELD_PIXELS * section.size / width), 1, FINEST))
        side = section.size / fine
        ball = BALL * float(np.median(p["radius"]))
        margin = ball + float(p["radius"].max()) + 2.0 * side
        low = np.floor((np.array([p["x"].min(), p["y"].min()]) - margin) / side).astype(int)
        high = np.ceil((np.array([p["x"].max(), p["y"].max()]) + margin) / side).astype(int)
        # Which particle is nearest, from the pixels that hold one; of several in a pixel the last one counts.
        holder = np.full(tuple(high - low)[::-1], -1)
        column, row = (np.floor(p[k] / side).astype(int) - at for k, at in zip("xy", low))
        holder[row, column] = np.arange(len(p["x"]))
        distance, nearest = ndimage.distance_transform_edt(holder < 0, sampling=side, return_indices=True)
        near = distance <= p["radius"][holder[tuple(nearest)]] + ball
        material = ndimage.distance_transform_edt(near, sampling=side) > ball
        x, y = (side * (np.arange(a, b) + 0.5) for a, b in zip(low, high))
        extent = (side * low[0], side * high[0], side * low[1], side * high[1])
        return cls((y - section.y[0]) / section.size, (x - section.x[0]) / section.size, material, extent)

    def values(self, field: np.ndarray, order: int = 1) -> np.ndarray:
        """A field (ny, nx) at the pixels: linear between nodes, or with order 0 that of the nearest node; the nearest
        node's value up to one and a half cells from where there is one, NaN farther off."""
        empty = ~np.isfinite(field)
        if empty.all():
            return np.full(self.material.shape, np.nan)
        distance, nearest = ndimage.distance_transform_edt(empty, return_indices=True)
        places = np.meshgrid(self.rows, self.columns, indexing="ij")
        result = ndimage.map_coordinates(field[tuple(nearest)], places, order=order, mode="nearest")
        return np.where(ndimage.map_coordinates(distance, places, order=1, mode="nearest") <= 1.5, result, np.nan)


# -- largest principal stress -------------------------------------------------------------------------------------


def stress_bars(section: Section, square: float, scale: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Bars along the largest principal stress s1 of squares: ends (n, 2), (n, 2) [m] and the largest s1 [Pa].

    The stress is averaged over the nodes in squares of side `square` [m], where nodes fill half of one or more. A bar
    is centred on its square; its length is scale * square * s1 / max(s1). Squares without compression have none.
    Raises HpcdemError for squares smaller than the spacing of the nodes.
    """
    size, nothing = section.size, np.zeros((0, 2))
    if square < size:
        raise HpcdemError(f"--gridsize {square:g}: smaller than the grid of stress and strain, {size:g} m")
    parts = [section.fields[k] for k in ("sxx", "sxy", "syy")]
    known = np.isfinite(parts).all(axis=0)
    if not known.any():
        return nothing, nothing, 0.0
    # A node stands for the square of side `size` about it; squares of all frames fall on each other.
    x, y = np.meshgrid(section.x, section.y)
    origin = np.array([section.x[0] % size, section.y[0] % size]) - 0.5 * size
    squares = np.floor((np.stack([x[known], y[known]], axis=1) - origin) / square + 1e-9)
    places, which, count = np.unique(squares, axis=0, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    sxx, sxy, syy = (np.bincount(which, part[known]) / count for part in parts)
    s1 = 0.5 * (sxx + syy) + np.hypot(0.5 * (sxx - syy), sxy)
    chosen = (count >= 0.5 * (square / size) ** 2) & (s1 > 0.0)
    if not chosen.any():
        return nothing, nothing, 0.0
    angle = 0.5 * np.arctan2(2.0 * sxy, sxx - syy)[chosen]
    most = float(s1[chosen].max())
    half = (0.5 * scale * square / most * s1[chosen])[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    middle = (places[chosen] + 0.5) * square + origin
    return middle - half, middle + half, most


def draw_stress_bars(section: Section, ax: Any, square: float, scale: float) -> str:
    """Draw the bars of `stress_bars`; returns what the caption must say of them."""
    begin, end, most = stress_bars(section, square, scale)
    if not len(begin):
        return ""
    _segments(ax, begin, end, LINE)
    return f"longest bar: $\\sigma_1$ = {most / 1e6:.3g} MPa"
