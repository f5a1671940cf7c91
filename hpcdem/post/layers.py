"""Drawing layers of a frame by keyword, on top of one another, in axes whose data unit is the metre. Frames are
complete (all rows on this rank); particles are in the order of ids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.fields import sides_of_box
from hpcdem.io import colours
from hpcdem.io.axes import view
from hpcdem.io.frame import Frame

if TYPE_CHECKING:
    from hpcdem.post.view.model import Layer as ViewLayer
    from hpcdem.post.view.scene import Painted

MOST_LABELS = 5000
"""Largest number of ids in one picture; more are illegible, and take minutes."""
TENSION, COMPRESSION, INK = "#c81e1e", "#1e3cb4", "#202020"
BALL = 3.0
"""Radius of the ball that is rolled over the particles to find their surface, in median radii."""


@dataclass(frozen=True)
class Appearance:
    """Appearance of particles. palette (10, 3): colours by number; line: width of walls and of the surface in points;
    of_field: field that colours particles instead of their numbers.
    """

    palette: np.ndarray = field(default_factory=lambda: colours.RGB)
    line: float = 1.0
    of_field: ViewLayer | None = None


USUAL = Appearance()


def balls(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw filled discs of true size in the colours of the manual."""
    _discs(frame, ax, appearance, 0.0)


def outlines(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw circles of true size in the colours of the manual."""
    _discs(frame, ax, appearance, 0.3)


def _discs(frame: Frame, ax: Any, appearance: Appearance, line: float) -> None:
    from hpcdem.post.discs import Discs

    columns = frame.tables["particles"].columns
    if not len(frame.tables["particles"]):
        return
    places = np.stack([columns["x"], columns["y"]], axis=1)
    shades, kind = appearance.palette, colours.numbers(columns["color"])
    if (found := coloured(frame, appearance)) is not None:
        shades, kind = found.shades, found.kind
    ax.add_collection(Discs(places, columns["radius"], shades, kind, line), autolim=False)


def coloured(frame: Frame, appearance: Appearance) -> Painted | None:
    """Return the colours of particles by a field, None without one."""
    if appearance.of_field is None:
        return None
    from hpcdem.post.view.moment import of_particles
    from hpcdem.post.view.scene import painted

    return painted(of_particles(frame), appearance.of_field, view(frame))


def walls(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw walls in their colours, and the sides of the BOX that are not the frame of the picture."""
    p1, p2 = (np.asarray(frame.walls[p], dtype=float).reshape(-1, 2) for p in ("p1", "p2"))
    shown = np.ones(len(p1), bool)
    for axis, limits in enumerate((ax.get_xlim(), ax.get_ylim())):
        for limit in limits:
            near = 1e-6 * (limits[1] - limits[0])
            on_edge = (np.abs(p1[:, axis] - limit) < near) & (np.abs(p2[:, axis] - limit) < near)
            shown &= ~(on_edge & np.isin(frame.walls["id"], [*sides_of_box(frame.walls["id"])]))
    if shown.any():
        shades = appearance.palette[colours.numbers(frame.walls["color"])]
        _lines(ax, p1[shown], p2[shown], shades[shown], appearance.line)


def surface(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw the surface line of the model, ignoring detached particles and particles that represent walls."""
    from hpcdem.post import surface as tops

    columns = frame.tables["particles"].columns
    if not len(frame.tables["particles"]):
        return
    x, y, radius = (np.asarray(columns[name], dtype=float) for name in ("x", "y", "radius"))
    kept = np.isfinite(x) & np.isfinite(y) & (radius > 0.0)
    kept[kept] = tops.bed(x[kept], y[kept], radius[kept], tops.held_fast(columns, len(x))[kept])
    if not kept.any():
        return
    x, y, radius = x[kept], y[kept], radius[kept]
    usual = float(np.median(radius))
    # Fine enough to follow the discs, unless they are spread over an odd size of land.
    spacing = max(0.2 * usual, float(np.ptp(x)) / 100_000)
    line = tops.surface(x, y, radius, max(BALL * usual, 2.0 * spacing), spacing)
    _polylines(ax, [line], INK, 0.75 * appearance.line)


def bonds(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw bonds from centre to centre: red in tension, blue in compression, dark without force."""
    table = frame.tables["bonds"].columns
    places, (first, second) = _ends(frame, "bonds")
    shades = np.where(table["fn"] < 0.0, TENSION, np.where(table["fn"] > 0.0, COMPRESSION, INK))
    _lines(ax, places[first], places[second], shades, 0.35)


def bond_states(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw all contacts from centre to centre: black not bonded, red bonded in tension, blue bonded in compression."""
    bonded = frame.tables["bonds"].columns
    places, (first, second) = _ends(frame, "contacts")
    pairs = np.stack([first, second], axis=1)
    glued = np.stack(_ends(frame, "bonds")[1], axis=1)
    size = max(len(places), 1)
    free = ~np.isin(pairs[:, 0] * size + pairs[:, 1], glued[:, 0] * size + glued[:, 1])
    width = 0.5 * appearance.line
    pulled = bonded.get("fn", np.zeros(0)) < 0.0
    for chosen, shade in ((pairs[free], "black"), (glued[~pulled], COMPRESSION), (glued[pulled], TENSION)):
        _lines(ax, places[chosen[:, 0]], places[chosen[:, 1]], shade, width)


def forces(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw contact forces from centre to centre; the thickest line is the force that only one in 200 exceeds."""
    table = frame.tables["contacts"].columns
    places, (first, second) = _ends(frame, "contacts")
    size = np.hypot(table["fx"], table["fy"])
    if len(size) and size.max() > 0.0:
        width = 2.0 * np.minimum(size / np.quantile(size, 0.995), 1.0)
        shown = width > 0.02
        _lines(ax, places[first[shown]], places[second[shown]], INK, width[shown])


def ids(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw the id in each particle; omitted if there are too many to read."""
    columns = frame.tables["particles"].columns
    if len(columns["gid"]) > MOST_LABELS:
        return
    for x, y, gid in zip(columns["x"], columns["y"], columns["gid"], strict=True):
        ax.text(x, y, str(gid), fontsize=2.0, ha="center", va="center", clip_on=True)


def rotations(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw a radius in each particle that was horizontal when the particle was created."""
    c = frame.tables["particles"].columns
    centre = np.stack([c["x"], c["y"]], axis=1)
    rim = centre + np.stack([c["radius"] * np.cos(c["angle"]), c["radius"] * np.sin(c["angle"])], axis=1)
    _lines(ax, centre, rim, INK, 0.3)


def mesh(frame: Frame, ax: Any, appearance: Appearance = USUAL) -> None:
    """Draw a square grid of twice the largest diameter, approximately the cells of the neighbour search."""
    radius = frame.tables["particles"].columns["radius"]
    if not len(radius):
        return
    side = 4.0 * float(radius.max())
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    x, y = (np.arange(np.ceil(a / side), np.floor(b / side) + 1) * side for a, b in ((left, right), (bottom, top)))
    low = np.concatenate([np.stack([x, np.full_like(x, bottom)], 1), np.stack([np.full_like(y, left), y], 1)])
    high = np.concatenate([np.stack([x, np.full_like(x, top)], 1), np.stack([np.full_like(y, right), y], 1)])
    _lines(ax, low, high, "#9a9a9a", 0.2)


LAYERS: dict[str, Callable[..., None]] = {
    "mesh": mesh,
    "ball": outlines,
    "bfill": balls,
    "bang": rotations,
    "bondc": bonds,
    "bondplot": bond_states,
    "cforce": forces,
    "bid": ids,
    "surface": surface,
    "wall": walls,
}
"""Layers by word (those of DRAW and of zdem2jpg), in the order in which they lie over one another; each is called with
frame, axes and Look."""


def _ends(frame: Frame, table: str) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Centres (n, 2) and the rows of both particles of each pair."""
    c, pairs = frame.tables["particles"].columns, frame.tables[table].columns
    none = np.zeros(0, np.int64)  # a file without such a section
    return np.stack([c["x"], c["y"]], axis=1), (
        np.searchsorted(c["gid"], pairs.get("id1", none)),
        np.searchsorted(c["gid"], pairs.get("id2", none)),
    )


def _lines(ax: Any, begin: np.ndarray, end: np.ndarray, shades: Any, widths: Any) -> None:
    _polylines(ax, np.stack([begin, end], axis=1), shades, widths)


def _polylines(ax: Any, lines: Any, shades: Any, widths: Any) -> None:
    from matplotlib.collections import LineCollection

    ax.add_collection(LineCollection(lines, colors=shades, linewidths=widths, capstyle="round"), autolim=False)
