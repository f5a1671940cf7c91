"""Liners in pictures of blocks: the beams, and along them axial force and moment as areas."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.units import with_prefix
from hpcdem.io.vtkhdf_mesh import MeshState

BEAM, FORCE, MOMENT = "#202020", "#7a5195", "#1f7a4d"
HEIGHT = 0.14
"""Height of an area at the largest value, over the extent of the liners."""
DELETED = 32
"""Bit of the state of an element."""


def areas(state: MeshState, first: str, last: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the areas that show a quantity along liner elements: corners (m, 4, 2) [m], with widths proportional to
    the values at both ends, positive away from the rock, and these values (m, 2); first, last: names of the quantities.
    """
    nodes, elements = state.supports["liners"]["nodes"], state.supports["liners"]["elements"]
    there = elements["liner_state"].astype(np.int64) & DELETED == 0
    at = np.column_stack([nodes["position_x"], nodes["position_y"]])
    a, b = at[elements["first_node"][there]], at[elements["last_node"][there]]
    values = np.column_stack([elements[first], elements[last]])[there]
    across = np.column_stack([b[:, 1] - a[:, 1], a[:, 0] - b[:, 0]])
    out = np.zeros((2, len(at), 2))  # at each node the mean of both elements, so that areas fit together
    for end in ("first_node", "last_node"):
        np.add.at(out[0], elements[end][there], across / np.hypot(across[:, 0], across[:, 1])[:, None])
    norm = np.hypot(out[0, :, 0], out[0, :, 1])
    out = np.divide(out[0], norm[:, None], out=out[1], where=norm[:, None] > 0.0)
    if not len(a):
        return np.empty((0, 4, 2)), values
    size = float(np.ptp(np.concatenate([a, b]), axis=0).max())
    far = HEIGHT * size * values / max(float(np.abs(values).max(initial=0.0)), 1e-300)
    return np.stack(
        [a, b, b + far[:, 1:] * out[elements["last_node"][there]], a + far[:, :1] * out[elements["first_node"][there]]],
        axis=1,
    ), values


def draw(axes: Any, state: MeshState) -> list[Any]:
    """Draw the liners of a frame: axial force away from the rock, whatever its sign, moment on the side in tension.
    Return the entries of a legend, none without liners.
    """
    if "liners" not in state.supports:
        return []
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    corners, force = areas(state, "axial_force", "axial_force")
    if not len(corners):
        return []
    beams = corners[:, :2]
    mirrored = np.where((force < 0.0)[:, [0]][:, :, None], 2.0 * corners[:, [0, 1, 1, 0]] - corners, corners)
    axes.add_collection(
        PolyCollection(mirrored, facecolors=FORCE, edgecolors="none", alpha=0.35, zorder=4), autolim=False
    )
    of_moment, moment = areas(state, "moment_first", "moment_last")
    if moment.any():
        axes.add_collection(LineCollection(of_moment[:, 2:], colors=MOMENT, linewidths=1.1, zorder=6), autolim=False)
    axes.add_collection(LineCollection(beams, colors=BEAM, linewidths=1.8, zorder=5), autolim=False)
    handles: list[Any] = []
    if force.any():
        most = float(force.reshape(-1)[np.abs(force).argmax()])
        handles.append(Patch(color=FORCE, alpha=0.35, label=f"N up to {with_prefix(most, 'N/m', 3, state.units)}"))
    if moment.any():
        largest = with_prefix(float(np.abs(moment).max()), "N m/m", 3, state.units)
        handles.append(Line2D([], [], color=MOMENT, linewidth=1.1, label=f"M up to {largest}"))
    return handles or [Line2D([], [], color=BEAM, linewidth=1.8, label="liner without force")]
