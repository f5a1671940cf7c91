"""Volumes, mean stress and strain of groups and of a box in frames of tetrahedra, and displacements of surfaces.

Means are weighted by volume in the mesh. Strain is that of Green and Lagrange, E = (F' F - 1) / 2, from the place of
the corners in the mesh (where they are less what they have moved): rotations do not count, and where it is small it is
the usual one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import UsageError
from hpcdem.io.vtkhdf_mesh import MeshState
from hpcdem.physics.fdem import tetrahedra
from hpcdem.post.measure.kinds import NAN, Sheet
from hpcdem.post.measure.scene import Request
from hpcdem.post.view.moment import neighbours

COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
_ROWS, _COLUMNS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
HEAD = ("step", "time[s]")


@dataclass(frozen=True)
class Region:
    """Some elements of a frame: set and name of their group ("" for all of them and for the box); how many; volume in
    the mesh and now [m3]; low, high (3,): the box around them now [m]; stress, strain (6,): means, see COMPONENTS,
    tension and longer positive [Pa]."""

    set_name: str
    name: str
    elements: int
    volume: float
    now: float
    low: np.ndarray
    high: np.ndarray
    stress: np.ndarray
    strain: np.ndarray


def homes(state: MeshState) -> np.ndarray:
    """(k, 3) places of the points in the mesh [m]."""
    return state.points - state.of_points["displacement"]


def strains(state: MeshState) -> np.ndarray:
    """(ne, 6) strain of each element, see COMPONENTS."""
    before, now = (tetrahedra.sides(points, state.cells) for points in (homes(state), state.points))
    f = np.linalg.solve(before, now)  # the transposed gradient of the deformation
    e = 0.5 * (f @ np.swapaxes(f, 1, 2) - np.eye(3))
    return e[:, _ROWS, _COLUMNS]


def regions(state: MeshState, request: Request, wanted: np.ndarray) -> list[Region]:
    """Measure regions: all elements that are wanted (ne,); each group among them; and those whose middle in the mesh
    lies in the box."""
    stress = np.column_stack([state.of_elements[f"stress_{c}"] for c in COMPONENTS])
    strain = strains(state)
    mesh = tetrahedra.volumes(homes(state), state.cells)
    now = tetrahedra.volumes(state.points, state.cells)

    def region(set_name: str, name: str, rows: np.ndarray) -> Region:
        corners = state.points[state.cells[rows]].reshape(-1, 3)
        weight = mesh[rows] / mesh[rows].sum()
        return Region(
            set_name, name, len(rows), float(mesh[rows].sum()), float(now[rows].sum()), corners.min(axis=0),
            corners.max(axis=0), weight @ stress[rows], weight @ strain[rows],
        )  # fmt: skip

    found = [region("", "all", np.flatnonzero(wanted))] if wanted.any() else []
    for column, names in state.group_names.items():
        for k, name in enumerate(names):
            rows = np.flatnonzero(wanted & (state.of_elements[column] == k))
            if len(rows):
                found.append(region(column.removeprefix("group_"), name, rows))
    if request.box is not None:
        low, high = np.array(request.box[:3]), np.array(request.box[3:])
        middle = homes(state)[state.cells].mean(axis=1)
        rows = np.flatnonzero(wanted & ((low <= middle) & (middle <= high)).all(axis=1))
        if not len(rows):
            raise UsageError("--box: no measured element has its centre in the box")
        found.append(region("", "box", rows))
    return found


@dataclass(frozen=True)
class Surface:
    """The surface of a frame, that of cracks included: node (n,) of the mesh, each once for every way it has moved;
    home, moved (n, 3) [m]."""

    node: np.ndarray
    home: np.ndarray
    moved: np.ndarray

    @property
    def length(self) -> np.ndarray:
        """(n,) how far [m]."""
        return np.linalg.norm(self.moved, axis=1)


def surface(state: MeshState, wanted: np.ndarray) -> Surface:
    """The outer faces of the elements that are wanted (ne,)."""
    faces = np.flatnonzero((neighbours(state) < 0) & np.repeat(wanted, 4))
    points = np.unique(tetrahedra.face_points(state.cells, faces))
    moved = state.of_points["displacement"][points]
    node = state.of_points["node"][points].astype(np.int64)
    _, first = np.unique(np.column_stack([node.astype(float), moved]), axis=0, return_index=True)
    return Surface(node[first], homes(state)[points[first]], moved[first])


# --- tables ------------------------------------------------------------------------------------------------------


def regions_sheets(parts: Sequence[Any]) -> list[Sheet]:
    axes = tuple(f"{axis}{end}[m]" for end in ("min", "max") for axis in "xyz")
    head = (
        *HEAD, "set", "group", "elements", "volume[m3]", "volume_change", *axes, "mean_stress[Pa]",
        *(f"stress_{c}[Pa]" for c in COMPONENTS), *(f"strain_{c}" for c in COMPONENTS),
    )  # fmt: skip

    def rows() -> Iterable[Sequence[Any]]:
        for one in parts:
            for r in one.regions:
                yield (
                    one.step, one.time, r.set_name, r.name, r.elements, r.volume, r.now / r.volume - 1.0,
                    *r.low.tolist(), *r.high.tolist(), float(r.stress[:3].mean()), *r.stress.tolist(),
                    *r.strain.tolist(),
                )  # fmt: skip

    return [Sheet("regions", head, rows())]


def displacement_sheets(parts: Sequence[Any]) -> list[Sheet]:
    """Make the tables of displacement: over time, and each point of the surface in the last frame."""
    places = tuple(f"{axis}[m]" for axis in "xyz")
    ends = tuple(f"{axis}_{end}[m]" for axis in ("ux", "uy", "uz") for end in ("least", "most"))

    def rows() -> Iterable[Sequence[Any]]:
        for one in parts:
            s = one.surface
            most = int(np.argmax(s.length)) if len(s.node) else -1
            if most < 0:
                yield one.step, one.time, 0, *(NAN,) * (4 + len(ends))
                continue
            both = np.column_stack([s.moved.min(axis=0), s.moved.max(axis=0)]).reshape(-1)
            yield one.step, one.time, len(s.node), float(s.length[most]), *s.home[most].tolist(), *both.tolist()

    last = parts[-1].surface
    columns = (last.node, *last.home.T, *last.moved.T, last.length)
    each = zip(*(c.tolist() for c in columns), strict=True)
    return [
        Sheet("displacement", (*HEAD, "points", "largest[m]", *places, *ends), rows()),
        Sheet("displacement_last", ("node", *places, "ux[m]", "uy[m]", "uz[m]", "length[m]"), each),
    ]
