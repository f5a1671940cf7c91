"""Bolts in pictures of blocks: the bars, and the axial force along them as areas beside them."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.units import with_prefix
from hpcdem.io.vtkhdf_mesh import MeshState

BAR, TENSION, COMPRESSION = "#202020", "#2f7fb5", "#d0562a"
HEIGHT = 0.12
"""Height of the area at the largest force, over the length of the longest bolt."""
BROKEN = 16
"""Bit of the state of an element."""


def areas(state: MeshState) -> tuple[np.ndarray, np.ndarray]:
    """Return the areas that show axial force along bolt elements: corners (m, 4, 2) [m], with a width proportional to
    the force, and the forces (m,) [N].
    """
    nodes, elements = state.supports["bolts"]["nodes"], state.supports["bolts"]["elements"]
    at = np.column_stack([nodes["position_x"], nodes["position_y"]])
    first, force = elements["first_node"], elements["axial_force"]
    a, b = at[first], at[first + 1]
    along = b - a
    across = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(along[:, 0], along[:, 1])[:, None]
    out = (
        HEIGHT
        * float(nodes["distance"].max())
        * (force / max(float(np.abs(force).max(initial=0.0)), 1e-300))[:, None]
        * across
    )
    return np.stack([a, b, b + out, a + out], axis=1), force


def draw(axes: Any, state: MeshState) -> list[Any]:
    """Draw the bolts of a frame; return the entries of a legend, none without bolts."""
    if "bolts" not in state.supports:
        return []
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    corners, force = areas(state)
    handles: list[Any] = []
    for rows, shade, word in ((force > 0.0, TENSION, "tension"), (force < 0.0, COMPRESSION, "compression")):
        if rows.any():
            axes.add_collection(
                PolyCollection(corners[rows], facecolors=shade, edgecolors="none", alpha=0.75, zorder=4), autolim=False
            )
            handles.append(
                Patch(color=shade, label=f"{word} up to {with_prefix(np.abs(force[rows]).max(), 'N', 3, state.units)}")
            )
    axes.add_collection(LineCollection(corners[:, :2], colors=BAR, linewidths=0.9, zorder=5), autolim=False)
    broken = state.supports["bolts"]["elements"]["bolt_state"].astype(np.int64) & BROKEN > 0
    if broken.any():
        middle = corners[broken, :2].mean(axis=1)
        axes.plot(middle[:, 0], middle[:, 1], "x", color=COMPRESSION, markersize=4.0, zorder=6)
        handles.append(Line2D([], [], color=COMPRESSION, marker="x", linestyle="", markersize=4.0, label="broken bolt"))
    return handles or [Line2D([], [], color=BAR, linewidth=0.9, label="bolts without force")]
