"""Pictures of meshes: elements coloured by group, edges, cracks coloured by set."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.mesh import Mesh

GROUP_COLOURS = ("#dfe6e9", "#f6d7a7", "#c7ddb5", "#b8d4e8", "#e3c6dc", "#d9cfc1", "#f2e3a0", "#c9c9e3")
EDGE_COLOUR = "#5f6b73"
CRACK_COLOURS = ("#b2182b", "#2166ac", "#1b7837", "#762a83", "#b35806", "#01665e")


def draw(
    axes: Any,
    mesh: Mesh,
    set_name: str | None = None,
    edge_width: float | None = None,
    crack_width: float = 1.6,
    set_names: dict[int, str] | None = None,
    legend: bool = True,
) -> None:
    """Draw a mesh into axes of matplotlib, to scale.

    Elements are coloured by the groups of `set_name` (None: the first set); the width of edges [pt] follows from how
    large elements come out on paper; `set_names` names fracture sets in the legend.
    """
    if set_name is None:
        set_name = next(iter(mesh.groups), None)
    groups = mesh.groups.get(set_name, {}) if set_name is not None else {}
    colour = np.full(len(mesh.cells), GROUP_COLOURS[0], object)
    for k, rows in enumerate(groups.values()):
        colour[rows] = GROUP_COLOURS[k % len(GROUP_COLOURS)]
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    if edge_width is None:
        box = axes.get_position().transformed(axes.figure.transFigure)
        points_per_metre = 72.0 / axes.figure.dpi * min(box.width, box.height) / max(float((high - low).max()), 1e-300)
        edge_width = float(np.clip(0.05 * np.sqrt(np.median(mesh.areas())) * points_per_metre, 0.1, 0.7))
    counts = corner_counts(mesh.cells)
    for n in (3, 4):
        rows = np.flatnonzero(counts == n)
        axes.add_collection(
            PolyCollection(
                mesh.points[mesh.cells[rows, :n]],
                facecolors=list(colour[rows]),
                edgecolors="face",  # else the background shines through between neighbours
                linewidths=0.3,
            )
        )
    # Each edge once: drawn by both elements it would look doubled.
    lines = mesh.points[mesh.edges().points]
    axes.add_collection(LineCollection(list(lines), colors=EDGE_COLOUR, linewidths=edge_width, snap=False))
    handles: list[Any] = [
        Patch(facecolor=GROUP_COLOURS[k % len(GROUP_COLOURS)], edgecolor=EDGE_COLOUR, label=name)
        for k, name in enumerate(groups)
    ]
    for k, number in enumerate(np.unique(mesh.crack_sets)):
        lines = mesh.points[mesh.cracks[mesh.crack_sets == number]]
        tint = CRACK_COLOURS[k % len(CRACK_COLOURS)]
        axes.add_collection(LineCollection(list(lines), colors=tint, linewidths=crack_width, capstyle="round"))
        name = (set_names or {}).get(int(number), f"fracture set {number}")
        handles.append(Line2D([], [], color=tint, linewidth=crack_width, label=name))
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    if legend and handles:
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, borderaxespad=0.0)
