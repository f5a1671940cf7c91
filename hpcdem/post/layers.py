"""What can be drawn of a frame, each thing by its word in the DRAW command: layers over one another in axes whose data
unit is the metre. Frames are whole (all rows on this rank); particles are in the order of ids."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.io import colours
from hpcdem.io.frame import Frame

MOST_LABELS = 5000
"""More ids than this in one picture are a grey mush, and take minutes."""
TENSION, COMPRESSION, INK = "#c81e1e", "#1e3cb4", "#202020"


def balls(frame: Frame, ax: Any) -> None:
    """Discs of true size in the manual's colours."""
    _discs(frame, ax, filled=True)


def outlines(frame: Frame, ax: Any) -> None:
    """Circles of true size in the manual's colours."""
    _discs(frame, ax, filled=False)


def _discs(frame: Frame, ax: Any, filled: bool) -> None:
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path as Outline
    from matplotlib.transforms import Affine2D, AffineDeltaTransform

    columns = frame.tables["particles"].columns
    if not len(frame.tables["particles"]):
        return
    places = np.stack([columns["x"], columns["y"]], axis=1)
    shades = colours.RGB[colours.numbers(columns["color"])]
    # One shape per radius (to three digits) drawn at many places: quick, and small as PDF and SVG.
    radii, kind = np.unique([float(f"{r:.3g}") for r in columns["radius"]], return_inverse=True)
    for k, radius in enumerate(radii):
        chosen = np.flatnonzero(kind == k)
        discs = PathCollection(
            [Outline.unit_circle()],
            offsets=places[chosen],
            offset_transform=ax.transData,
            facecolors=shades[chosen] if filled else "none",
            edgecolors="none" if filled else shades[chosen],
            linewidths=0 if filled else 0.3,
        )
        discs.set_transform(Affine2D().scale(radius) + AffineDeltaTransform(ax.transData))
        ax.add_collection(discs, autolim=False)


def walls(frame: Frame, ax: Any) -> None:
    """Walls and BOX in their colours."""
    if len(frame.walls["id"]):
        shades = colours.RGB[colours.numbers(frame.walls["color"])]
        _lines(ax, frame.walls["p1"], frame.walls["p2"], shades, 1.0)


def bonds(frame: Frame, ax: Any) -> None:
    """Bonds from centre to centre: red in tension, blue in compression, dark without force."""
    table = frame.tables["bonds"].columns
    places, (first, second) = _ends(frame, "bonds")
    shades = np.where(table["fn"] < 0.0, TENSION, np.where(table["fn"] > 0.0, COMPRESSION, INK))
    _lines(ax, places[first], places[second], shades, 0.35)


def forces(frame: Frame, ax: Any) -> None:
    """Contact forces from centre to centre; the thickest line is the largest force that only one in 200 exceeds."""
    table = frame.tables["contacts"].columns
    places, (first, second) = _ends(frame, "contacts")
    size = np.hypot(table["fx"], table["fy"])
    if len(size) and size.max() > 0.0:
        width = 2.0 * np.minimum(size / np.quantile(size, 0.995), 1.0)
        shown = width > 0.02
        _lines(ax, places[first[shown]], places[second[shown]], INK, width[shown])


def ids(frame: Frame, ax: Any) -> None:
    """The id in each particle; left out where there are too many to be read."""
    columns = frame.tables["particles"].columns
    if len(columns["gid"]) > MOST_LABELS:
        return
    for x, y, gid in zip(columns["x"], columns["y"], columns["gid"], strict=True):
        ax.text(x, y, str(gid), fontsize=2.0, ha="center", va="center", clip_on=True)


def rotations(frame: Frame, ax: Any) -> None:
    """A radius in each particle, horizontal when it was made."""
    c = frame.tables["particles"].columns
    centre = np.stack([c["x"], c["y"]], axis=1)
    rim = centre + np.stack([c["radius"] * np.cos(c["angle"]), c["radius"] * np.sin(c["angle"])], axis=1)
    _lines(ax, centre, rim, INK, 0.3)


def mesh(frame: Frame, ax: Any) -> None:
    """A square grid of twice the largest diameter, about the cells in which neighbours are looked for."""
    radius = frame.tables["particles"].columns["radius"]
    if not len(radius):
        return
    side = 4.0 * float(radius.max())
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    x, y = (np.arange(np.ceil(a / side), np.floor(b / side) + 1) * side for a, b in ((left, right), (bottom, top)))
    low = np.concatenate([np.stack([x, np.full_like(x, bottom)], 1), np.stack([np.full_like(y, left), y], 1)])
    high = np.concatenate([np.stack([x, np.full_like(x, top)], 1), np.stack([np.full_like(y, right), y], 1)])
    _lines(ax, low, high, "#9a9a9a", 0.2)


LAYERS: dict[str, Callable[[Frame, Any], None]] = {
    "mesh": mesh,
    "ball": outlines,
    "bfill": balls,
    "bang": rotations,
    "bondc": bonds,
    "cforce": forces,
    "bid": ids,
    "wall": walls,
}
"""Layers by word, in the order in which they lie over one another."""


def _ends(frame: Frame, table: str) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Centres (n, 2) and the rows of both particles of each pair."""
    c, pairs = frame.tables["particles"].columns, frame.tables[table].columns
    return np.stack([c["x"], c["y"]], axis=1), (
        np.searchsorted(c["gid"], pairs["id1"]),
        np.searchsorted(c["gid"], pairs["id2"]),
    )


def _lines(ax: Any, begin: np.ndarray, end: np.ndarray, shades: Any, widths: Any) -> None:
    from matplotlib.collections import LineCollection

    segments = np.stack([begin, end], axis=1)
    ax.add_collection(LineCollection(list(segments), colors=shades, linewidths=widths, capstyle="round"), autolim=False)
