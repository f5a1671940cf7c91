"""Frames of blocks as VTKHDF UnstructuredGrid 2.0, opened by ParaView and pyvista as they are.

Points are the corners of the elements, element by element (in the plane z = 0): where joints open, corners that began
as one point part. Cells are the elements in the order of their numbers (VTK_TRIANGLE, VTK_QUAD, in space VTK_TETRA),
then the joints: their lower face, VTK_LINE, in space VTK_TRIANGLE. The cell data `cell` distinguishes them; what one of
them does not have is NaN, or -1 for whole numbers.

Format: VTK File Formats, section VTKHDF, https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import h5
from hpcdem.io.behind import Deliveries
from hpcdem.io.frame import Table
from hpcdem.io.slabs import find_rows

ELEMENT, JOINT = 0, 1
"""Values of the cell data `cell`."""
CORNERS = {2: ("first", "last"), 3: ("first", "second", "last")}
"""Columns of joints with their corners, by dimensions of space."""
_LINE, _TRIANGLE, _QUAD, _TETRA = 3, 5, 9, 10
SUPPORTS = ("bolts", "liners")
"""Groups of a file with tables of their nodes and elements."""
CONTACTS, NODE_CONDITIONS, FACE_CONDITIONS, FLOW_NODES = "contacts", "node-conditions", "face-conditions", "flow-nodes"
"""Tables of further objects, one group of a file each, see hpcdem.commands.fdem.frame_tables."""
TABLES = (CONTACTS, NODE_CONDITIONS, FACE_CONDITIONS, FLOW_NODES)
Supports = Mapping[str, Mapping[str, Mapping[str, np.ndarray]]]


@dataclass
class MeshFrame:
    """One output time of a model of blocks, as slabs in ascending order of "number".

    corners: number (element * 4 + k), x, y and further columns; elements: number, corners (how many) and further
    columns; joints: number, their `CORNERS` and further columns. group_names: by name of an integer
    column of the elements what its values stand for. supports: by name ("bolts", "liners") columns of their "nodes"
    and "elements", equal on all ranks. tables: of `TABLES`, by name. units: that the model declared, "" SI.
    """

    step: int
    time: float
    dt: float
    corners: Table
    elements: Table
    joints: Table
    group_names: Mapping[str, list[str]]
    supports: Supports = field(default_factory=dict)
    tables: Mapping[str, Table] = field(default_factory=dict)
    units: str = ""


@dataclass
class MeshState:
    """A whole frame, to be drawn or measured.

    points (n, 2), in space (n, 3): corners [m]; cells (ne, 4): rows of points, -1 in the fourth column of triangles;
    joints (nj, 2), in space (nj, 3): rows of points of their corners; of_points, of_elements, of_joints: columns by
    name, vectors as points;
    group_names, supports and units as in `MeshFrame`; tables: columns of `TABLES`, vectors as points.
    """

    step: int
    time: float
    dt: float
    points: np.ndarray
    cells: np.ndarray
    joints: np.ndarray
    of_points: Mapping[str, np.ndarray]
    of_elements: Mapping[str, np.ndarray]
    of_joints: Mapping[str, np.ndarray]
    group_names: Mapping[str, list[str]]
    supports: Supports = field(default_factory=dict)
    tables: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    units: str = ""


def whole(frame: MeshFrame, comm: Comm) -> MeshState | None:
    """Collective: the frame with all rows on rank 0, None elsewhere."""
    further = frame.tables.values()
    parts = comm.gather([table.columns for table in (frame.corners, frame.elements, frame.joints, *further)])
    if parts is None:
        return None
    corners, elements, joints, *others = (
        {c: np.concatenate([p[k][c] for p in parts]) for c in parts[0][k]} for k in range(len(parts[0]))
    )
    number = corners["number"]
    points = np.stack([corners[c] for c in "xyz" if c in corners], axis=1)
    of_joints = CORNERS[points.shape[1]]
    ends = np.stack([np.searchsorted(number, joints[k]) for k in of_joints], axis=1)
    return MeshState(
        frame.step, frame.time, frame.dt, points,
        _cells(elements["corners"]), ends, _flat({k: v for k, v in corners.items() if k not in ("x", "y", "z")}),
        {k: v for k, v in elements.items() if k != "corners"},
        {k: v for k, v in joints.items() if k not in of_joints}, frame.group_names, frame.supports,
        dict(zip(frame.tables, map(_flat, others), strict=True)), frame.units,
    )  # fmt: skip


def _cells(sizes: np.ndarray) -> np.ndarray:
    """(ne, 4) rows of points of elements whose corners are consecutive."""
    first = np.cumsum(sizes) - sizes
    cells: np.ndarray = first[:, None] + np.arange(4)
    cells[sizes < 4, 3] = -1
    return cells


def _flat(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Vectors with as many components as there are dimensions of space."""
    dim = 3 if any(name.endswith("_z") for name in columns) else 2
    return {k: v[:, :dim] if v.ndim == 2 else v for k, v in _packed(columns).items()}


def is_mesh_frame(path: str | os.PathLike) -> bool:
    """Return whether a file is a frame of blocks; False for what cannot be read, too."""
    try:
        with h5.reading(path) as file:
            return bytes(file["VTKHDF"].attrs["Type"]) == b"UnstructuredGrid" and "hpcdem" in file
    except (HpcdemError, KeyError, TypeError, AttributeError, OSError, RuntimeError, ValueError):
        return False


def read_mesh_frame(path: str | os.PathLike, lazily: bool = False, solid: bool = False) -> MeshState:
    """A frame that `write_mesh_frame` wrote. lazily: columns are read on use; solid: whether it may be
    one in three dimensions. Serial. HpcdemError if it is missing, foreign or damaged."""
    with h5.reading(path) as file:
        try:
            top, about = file["VTKHDF"], file["hpcdem"].attrs
            types, kind = top["Types"][...], top["CellData/cell"][...]
            elements, joints = kind == ELEMENT, kind == JOINT
            n = int(elements.sum())
            sizes = np.where(types[:n] == _TRIANGLE, 3, 4)
            dim = 3 if (types[:n] == _TETRA).any() else 2
            if dim == 3 and not solid:
                raise NotImplementedError
            points = top["Points"][:, :dim]
            ends = top["Connectivity"][int(sizes.sum()) :].reshape(-1, dim)
            whole = elements[:n].all() and len(ends) == joints.sum() and int(sizes.sum()) == len(points)
            if not whole or (len(ends) and not 0 <= ends.min() <= ends.max() < len(points)):
                raise ValueError("cells and points do not match")
            tables: list[Mapping[str, np.ndarray]] = []
            for group, rows in (("PointData", slice(None)), ("CellData", slice(0, n)), ("CellData", slice(n, None))):
                places = {
                    k: (f"VTKHDF/{group}/{k}", (rows, slice(0, dim)) if v.ndim == 2 else rows)
                    for k, v in top[group].items()
                }
                tables.append(
                    h5.columns(path, places) if lazily else {k: file[at][of] for k, (at, of) in places.items()}
                )
            others: dict[str, Mapping[str, np.ndarray]] = {}
            for word in (word for word in TABLES if word in file):
                of = {k: (slice(None), slice(0, dim)) if v.ndim == 2 else slice(None) for k, v in file[word].items()}
                if lazily:
                    others[word] = h5.columns(path, {k: (f"{word}/{k}", rows) for k, rows in of.items()})
                else:
                    others[word] = {k: file[word][k][rows] for k, rows in of.items()}
            names = {name: [one.decode() for one in values[...]] for name, values in file["hpcdem"].items()}
            supports = {
                word: {kind: {name: values[...] for name, values in of.items()} for kind, of in file[word].items()}
                for word in SUPPORTS
                if word in file
            }
            of_points, of_elements, of_joints = tables
            return MeshState(
                int(about["step"]), float(about["time"]), float(about["dt"]), points, _cells(sizes), ends, of_points,
                of_elements, of_joints, names, supports, others, bytes(about.get("units", b"")).decode(),
            )  # fmt: skip
        except NotImplementedError:
            raise HpcdemError(f"{os.fspath(path)} is a frame in three dimensions, expected two") from None
        except (KeyError, TypeError, AttributeError, OSError, RuntimeError, ValueError) as problem:
            raise HpcdemError(f"{os.fspath(path)} is not a frame of blocks, or is damaged: {problem}") from None


def write_mesh_frame(path: str | os.PathLike, frame: MeshFrame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: write the frame to `path` (usually ``*.vtkhdf``). The content does not depend on the number of ranks.
    Raises HpcdemError on all ranks; `later`: see `h5.writing`."""
    corners, elements, joints = frame.corners, frame.elements, frame.joints
    keys, dim = [corners.columns["number"]], 3 if "z" in corners.columns else 2
    ends = np.stack([find_rows(comm, keys, [joints.columns[k]]) for k in CORNERS[dim]], axis=1)
    lost = "a joint refers to a missing corner" if len(ends) and ends.min() < 0 else None
    comm.agree(f"cannot write {os.fspath(path)}: {lost}" if lost else None)
    sizes = elements.columns["corners"]
    first = comm.exscan(int(sizes.sum()))
    n, n_joints, n_corners = elements.total, joints.total, corners.total
    with h5.writing(path, comm, later) as out:
        out.group("VTKHDF", {"Version": np.array([2, 0], np.int64), "Type": np.bytes_("UnstructuredGrid")})
        for name, number in (
            ("NumberOfPoints", n_corners),
            ("NumberOfCells", n + n_joints),
            ("NumberOfConnectivityIds", n_corners + dim * n_joints),
        ):
            out.whole(f"VTKHDF/{name}", np.array([number], np.int64))
        columns = corners.columns
        out.slabs("VTKHDF/Points", _vector(*(columns[c] for c in "xyz" if c in columns)), corners.offset, n_corners)
        # Corners lie in the order of elements, so the elements simply count them up.
        counted = np.arange(first, first + int(sizes.sum()), dtype=np.int64)
        out.parts(
            "VTKHDF/Connectivity",
            [(counted, first), (ends.reshape(-1), n_corners + dim * joints.offset)],
            n_corners + dim * n_joints,
        )
        zero = np.zeros(int(comm.rank == 0), np.int64)
        lines = n_corners + dim * np.arange(joints.offset + 1, joints.offset + 1 + len(joints), dtype=np.int64)
        out.parts(
            "VTKHDF/Offsets",
            [(zero, 0), (first + np.cumsum(sizes), 1 + elements.offset), (lines, 1 + n + joints.offset)],
            1 + n + n_joints,
        )
        starts = elements.offset, n + joints.offset
        four, of_joints = (_TETRA, _TRIANGLE) if dim == 3 else (_QUAD, _LINE)
        types = np.where(sizes == 4, four, _TRIANGLE).astype(np.uint8), np.full(len(joints), of_joints, np.uint8)
        out.parts("VTKHDF/Types", list(zip(types, starts, strict=True)), n + n_joints)
        out.group("VTKHDF/PointData")
        for name, values in _packed({k: v for k, v in columns.items() if k not in ("x", "y", "z")}).items():
            out.slabs(f"VTKHDF/PointData/{name}", values, corners.offset, n_corners)
        out.group("VTKHDF/CellData")
        for name, parts in _cell_data(elements, joints).items():
            out.parts(f"VTKHDF/CellData/{name}", list(zip(parts, starts, strict=True)), n + n_joints)
        out.group("VTKHDF/FieldData")
        out.whole("VTKHDF/FieldData/TimeValue", np.array([frame.time]))
        out.whole("VTKHDF/FieldData/step", np.array([frame.step], np.int64))
        about = {"format": 1, "step": frame.step, "time": float(frame.time), "dt": float(frame.dt)}
        out.group("hpcdem", about | ({"units": np.bytes_(frame.units)} if frame.units else {}))
        for word, tables in frame.supports.items():
            out.group(word)
            for kind, of in tables.items():
                out.group(f"{word}/{kind}")
                for name, values in of.items():
                    out.whole(f"{word}/{kind}/{name}", values)
        for word, further in frame.tables.items():
            out.group(word)
            for name, values in _packed(further.columns).items():
                out.slabs(f"{word}/{name}", values, further.offset, further.total)
        for name, names in frame.group_names.items():
            encoded = [one.encode() for one in names]
            out.whole(f"hpcdem/{name}", np.array(encoded, dtype=f"S{max([1, *map(len, encoded)])}"))


def _vector(x: np.ndarray, y: np.ndarray, z: np.ndarray | None = None) -> np.ndarray:
    """(n, 3), in the plane with z = 0."""
    return np.stack([x, y, np.zeros(len(x)) if z is None else z], axis=1)


def _packed(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns with the components `name_x`, `name_y` and `name_z` of vectors put together."""
    found: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        stem, _, part = name.rpartition("_")
        if part in ("x", "y", "z") and f"{stem}_x" in columns and f"{stem}_y" in columns:
            found[stem] = _vector(columns[f"{stem}_x"], columns[f"{stem}_y"], columns.get(f"{stem}_z"))
        else:
            found[name] = values
    return found


def _cell_data(elements: Table, joints: Table) -> dict[str, list[np.ndarray]]:
    """Name -> this rank's values on elements and joints."""
    tables = [
        {k: v for k, v in elements.columns.items() if k != "corners"},
        {k: v for k, v in joints.columns.items() if k not in CORNERS[3]},
    ]
    sizes = len(elements), len(joints)
    data: dict[str, list[np.ndarray]] = {
        "cell": [np.full(size, kind, np.int8) for size, kind in zip(sizes, (ELEMENT, JOINT), strict=True)]
    }
    for name in dict.fromkeys((*tables[0], *tables[1])):
        dtype = next(t[name].dtype for t in tables if name in t)
        fill = np.nan if dtype.kind == "f" else -1
        data[name] = [
            table.get(name, np.full(size, fill, dtype)).astype(dtype) for table, size in zip(tables, sizes, strict=True)
        ]
    return data
