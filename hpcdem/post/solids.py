"""Pictures of bodies in space: their surface as it is now, coloured by how far it has moved. Serial."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.io.axes import CM
from hpcdem.physics.fdem import tetrahedra

if TYPE_CHECKING:
    from hpcdem.io.vtkhdf_mesh import MeshState

EYE = np.array([1.0, -1.7, 0.9])
"""Direction from which a body is seen."""
LIGHT = np.array([0.4, -1.0, 1.3])
MOST_EDGES = 20_000
"""Surfaces of more triangles are drawn without the lines between them."""
COLOURS = "viridis"
UNITS = ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))


def surface(state: MeshState) -> np.ndarray:
    """(n, 3) rows of points of the faces that lie on no other element's face, outwards."""
    shared = tetrahedra.faces_of(state.of_points["node"][state.cells].astype(np.int64))
    faces = shared.faces[~shared.inner, 0]
    return tetrahedra.face_points(state.cells, faces)


def _frame() -> np.ndarray:
    """(3, 3): right, up and towards the eye, by rows."""
    out = EYE / np.linalg.norm(EYE)
    right = np.cross([0.0, 0.0, 1.0], out)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(out, right), out])


def draw(state: MeshState, width: float, font: float) -> Any:
    """A matplotlib Figure, width [cm], letters of `font` points: the surface, seen from the front, above and the right;
    far things are not smaller."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    turn = _frame()
    faces = surface(state)
    corner = state.points[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    front = np.flatnonzero(normal @ turn[2] > 0.0)
    seen = corner[front] @ turn.T
    order = np.argsort(seen[:, :, 2].mean(axis=1), kind="stable")  # what is near is drawn last
    front, seen = front[order], seen[order]

    way = np.linalg.norm(state.of_points["displacement"][faces[front]], axis=2).mean(axis=1)
    most = float(np.linalg.norm(state.of_points["displacement"], axis=1).max(initial=0.0))
    unit, name = next(((u, n) for u, n in UNITS if most >= u), UNITS[-1])
    norm = Normalize(0.0, max(most / unit, 1e-300))
    light = LIGHT / np.linalg.norm(LIGHT)
    shade = 0.55 + 0.45 * np.clip(normal[front] @ light, 0.0, 1.0)
    colours = colormaps[COLOURS](norm(way / unit))
    colours[:, :3] *= shade[:, None]

    low, high = seen[:, :, :2].reshape(-1, 2).min(axis=0), seen[:, :, :2].reshape(-1, 2).max(axis=0)
    span = float((high - low).max())
    room = 0.78 * width
    scale = room / max(high[0] - low[0], 0.6 * (high[1] - low[1]))
    tall = (high[1] - low[1]) * scale + 2.4
    figure = Figure(figsize=(width * CM, tall * CM))
    axes = figure.add_axes((0.01, 0.35 / tall, 0.8, 1.0 - 1.4 / tall))
    lines = {"edgecolors": (0.0, 0.0, 0.0, 0.25), "linewidths": 0.2} if len(front) <= MOST_EDGES else {
        "edgecolors": "face", "linewidths": 0.1
    }  # fmt: skip
    axes.add_collection(PolyCollection(seen[:, :, :2], facecolors=colours, **lines))
    axes.set_xlim(low[0] - 0.03 * span, high[0] + 0.03 * span)
    axes.set_ylim(low[1] - 0.03 * span, high[1] + 0.03 * span)
    axes.set_aspect("equal")
    axes.set_axis_off()
    _axes_of_space(figure, turn, font, width, tall)
    bar = figure.add_axes((0.86, 0.25, 0.022, 0.5))
    made = figure.colorbar(ScalarMappable(norm, COLOURS), cax=bar)
    made.set_label(f"displacement [{name}]", fontsize=font)
    bar.tick_params(labelsize=font)
    size = " × ".join(f"{s:.3g}" for s in np.ptp(state.points, axis=0))
    said = f"step {state.step}, {state.time:.6g} s · {size} m · {len(state.cells)} tetrahedra"
    figure.text(0.02, 1.0 - 0.65 / tall, said, fontsize=font)
    return figure


def _axes_of_space(figure: Any, turn: np.ndarray, font: float, width: float, tall: float) -> None:
    """Arrows of x, y and z in the lower left corner."""
    axes = figure.add_axes((0.01, 0.1 / tall, 2.6 / width, 2.6 / tall))
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.3, 1.3)
    axes.set_aspect("equal")
    axes.set_axis_off()
    for k, name in enumerate("xyz"):
        x, y = turn[:2, k]
        axes.annotate("", (x, y), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "lw": 0.9, "shrinkA": 0, "shrinkB": 0})
        axes.text(1.2 * x, 1.2 * y, name, fontsize=font, ha="center", va="center")
