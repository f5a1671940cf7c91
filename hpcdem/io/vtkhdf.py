"""Frames as VTKHDF PolyData 2.0, opened by ParaView and pyvista as they are, and read back here bit for bit.

Points are the particles in order of gid (z = 0) with every particle field as point data; `velocity` and `force` are
3-vectors, `radius` scales glyphs. Cells are one vertex per particle, then one line per contact, then one per bond;
cell data of the vertices is NaN, -1 for ids and 0 for flags. What has no place in PolyData (walls, wall contacts,
settings, group names) is in the group /hpcdem of the same file.

Format: VTK File Formats, section VTKHDF, https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import Any, cast

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import h5
from hpcdem.io.behind import Deliveries
from hpcdem.io.frame import Frame, Table
from hpcdem.io.slabs import find_rows

PARTICLE, CONTACT, BOND = 0, 1, 2
"""Values of the cell data `link`."""

_VECTORS = {"velocity": ("vx", "vy"), "force": ("fx", "fy")}
_LINK_NAMES = {"x": "contact_x", "y": "contact_y"}
_FILL_INT = {"id1": -1, "id2": -1}


def write_vtkhdf(path: str | os.PathLike, frame: Frame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: write the frame to `path` (usually ``*.vtkhdf``).

    Needs the tables particles (with gid, x, y), contacts and bonds (with id1, id2) as slabs in order, wall_contacts
    in any order of slabs; all further columns are written as they are. The content does not depend on the number
    of ranks. Raises HpcdemError on all ranks; `later`: see `h5.writing`.
    """
    particles, contacts, bonds = (frame.tables[t] for t in ("particles", "contacts", "bonds"))
    gid = particles.columns["gid"]
    links = []
    missing = 0
    for table in (contacts, bonds):
        ends = [find_rows(comm, [gid], [table.columns[k]]) for k in ("id1", "id2")]
        missing += sum(int((e < 0).sum()) for e in ends)
        links.append(np.stack(ends, axis=1))
    comm.agree(f"cannot write {os.fspath(path)}: a contact refers to a missing particle" if missing else None)
    pairs = ("id1", "id2")
    bonded = find_rows(comm, [bonds.columns[k] for k in pairs], [contacts.columns[k] for k in pairs]) >= 0

    n, n_contacts, n_bonds = particles.total, contacts.total, bonds.total
    with h5.writing(path, comm, later) as out:
        out.group("VTKHDF", {"Version": np.array([2, 0], dtype=np.int64), "Type": np.bytes_("PolyData")})
        out.whole("VTKHDF/NumberOfPoints", np.array([n], dtype=np.int64))
        out.slabs("VTKHDF/Points", _vector(particles.columns["x"], particles.columns["y"]), particles.offset, n)

        vertices = np.arange(particles.offset, particles.offset + len(particles), dtype=np.int64)
        _topology(out, "Vertices", [(vertices[:, None], particles.offset)], 1, n)
        _topology(
            out, "Lines", [(links[0], contacts.offset), (links[1], n_contacts + bonds.offset)], 2, n_contacts + n_bonds
        )
        for name in ("Polygons", "Strips"):
            _topology(out, name, [], 0, 0)

        out.group("VTKHDF/PointData")
        for name, values in _point_data(particles.columns).items():
            out.slabs(f"VTKHDF/PointData/{name}", values, particles.offset, n)
        out.group("VTKHDF/CellData")
        starts = particles.offset, n + contacts.offset, n + n_contacts + bonds.offset
        for name, parts in _cell_data(particles, contacts, bonds, bonded).items():
            out.parts(f"VTKHDF/CellData/{name}", list(zip(parts, starts)), n + n_contacts + n_bonds)
        out.group("VTKHDF/FieldData")
        out.whole("VTKHDF/FieldData/TimeValue", np.array([frame.time]))
        out.whole("VTKHDF/FieldData/step", np.array([frame.step], dtype=np.int64))

        numbers = {"format": 1, "step": frame.step, "time": float(frame.time), "dt": float(frame.dt)}
        columns = {f"{name}_columns": " ".join(_kept(frame.tables[name])) for name in ("contacts", "bonds")}
        out.group("hpcdem", numbers | {"contacts": n_contacts, "bonds": n_bonds} | _ascii(columns))
        out.group("hpcdem/settings", _ascii(frame.settings))
        names = [name.encode() for name in frame.group_names]
        out.whole("hpcdem/group_names", np.array(names, dtype=f"S{max([1, *map(len, names)])}"))
        out.group("hpcdem/walls")
        for name, values in frame.walls.items():
            out.whole(f"hpcdem/walls/{name}", values)
        out.group("hpcdem/wall_contacts")
        table = frame.tables["wall_contacts"]
        for name, values in _kept(table).items():
            out.slabs(f"hpcdem/wall_contacts/{name}", values, table.offset, table.total)


def _kept(table: Table) -> dict[str, np.ndarray]:
    """The columns without those that follow from others and are for the text of ZDEM's frames."""
    return {name: values for name, values in table.columns.items() if not name.startswith("law_")}


def _ascii(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Strings as fixed-length ones: the only kind that parallel HDF5 writes."""
    return {k: np.bytes_(v.encode()) if isinstance(v, str) else v for k, v in attributes.items()}


def _vector(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 3) with z = 0."""
    return np.stack([x, y, np.zeros(len(x))], axis=1)


def _topology(out: h5.Writer, name: str, parts: list[tuple[np.ndarray, int]], size: int, total: int) -> None:
    """The four datasets of a kind of cell; parts: connectivity (cells, size) and the cell each part starts at."""
    out.group(f"VTKHDF/{name}")
    out.whole(f"VTKHDF/{name}/NumberOfCells", np.array([total], dtype=np.int64))
    out.whole(f"VTKHDF/{name}/NumberOfConnectivityIds", np.array([size * total], dtype=np.int64))
    if not parts:
        out.whole(f"VTKHDF/{name}/Connectivity", np.zeros(0, dtype=np.int64))
        out.whole(f"VTKHDF/{name}/Offsets", np.zeros(1, dtype=np.int64))
        return
    out.parts(f"VTKHDF/{name}/Connectivity", [(cells.reshape(-1), size * a) for cells, a in parts], size * total)
    # Where each cell ends, after a zero.
    ends = [(size * np.arange(a + 1, a + 1 + len(cells), dtype=np.int64), a + 1) for cells, a in parts]
    zero = np.zeros(int(out.comm.rank == 0), dtype=np.int64)
    out.parts(f"VTKHDF/{name}/Offsets", [(zero, 0), *ends], total + 1)


def _point_data(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays by name: all columns but x and y, with the components of vectors put together."""
    packed = {part for name, parts in _VECTORS.items() if all(p in columns for p in parts) for part in parts}
    arrays = {name: values for name, values in columns.items() if name not in packed | {"x", "y"}}
    for name, (a, b) in _VECTORS.items():
        if a in packed:
            arrays[name] = _vector(columns[a], columns[b])
    return arrays


def _cell_data(particles: Table, contacts: Table, bonds: Table, bonded: np.ndarray) -> dict[str, list[np.ndarray]]:
    """Name -> this rank's values on vertices, contacts and bonds."""
    sizes = len(particles), len(contacts), len(bonds)
    data: dict[str, list[np.ndarray]] = {
        "link": [np.full(size, kind, dtype=np.int8) for size, kind in zip(sizes, (PARTICLE, CONTACT, BOND))],
        "bonded": [np.zeros(sizes[0], np.int8), bonded.astype(np.int8), np.ones(sizes[2], np.int8)],
    }
    for name in dict.fromkeys((*_kept(contacts), *_kept(bonds))):
        dtype = next(t.columns[name].dtype for t in (contacts, bonds) if name in t.columns)
        fill = np.nan if dtype.kind == "f" else _FILL_INT.get(name, 0)
        data[_LINK_NAMES.get(name, name)] = [np.full(sizes[0], fill, dtype=dtype)] + [
            table.columns.get(name, np.full(size, fill, dtype=dtype))
            for table, size in zip((contacts, bonds), sizes[1:])
        ]
    if "fx" in data and "fy" in data:
        data["force"] = [_vector(x, y) for x, y in zip(data.pop("fx"), data.pop("fy"))]
    return data


def read_vtkhdf(path: str | os.PathLike, tables: Collection[str] | None = None, lazily: bool = False) -> Frame:
    """The frame in a file of `write_vtkhdf`, every number as it was. Serial.

    tables: names of the tables to read (all by default); the others come back empty. lazily: columns are read when they
    are requested. Raises HpcdemError.
    """
    with h5.reading(path) as file:
        if "hpcdem" not in file or "VTKHDF" not in file:
            raise HpcdemError(f"cannot read {os.fspath(path)}: it is not a frame written by hpcdem")
        head = file["hpcdem"]
        settings = {k: v.decode() if isinstance(v, bytes) else float(v) for k, v in head["settings"].attrs.items()}
        frame = Frame(
            step=int(head.attrs["step"]),
            time=float(head.attrs["time"]),
            dt=float(head.attrs["dt"]),
            settings=settings,
            walls={name: values[...] for name, values in head["walls"].items()},
            tables={},
            group_names=[name.decode() for name in head["group_names"][...]],
        )
        wanted = {"particles", "contacts", "bonds", "wall_contacts"} if tables is None else set(tables)
        n, n_contacts, n_bonds = len(file["VTKHDF/Points"]), int(head.attrs["contacts"]), int(head.attrs["bonds"])
        links = file["VTKHDF/CellData"]
        places = {
            "particles": (n, _of_particles(file["VTKHDF/PointData"])),
            "contacts": (n_contacts, _of_links(links, n, n_contacts, head.attrs["contacts_columns"])),
            "bonds": (n_bonds, _of_links(links, n + n_contacts, n_bonds, head.attrs["bonds_columns"])),
            "wall_contacts": (
                max((len(values) for values in head["wall_contacts"].values()), default=0),
                {name: (f"hpcdem/wall_contacts/{name}", slice(None)) for name in head["wall_contacts"]},
            ),
        }
        for name, (size, columns) in places.items():
            if name not in wanted:
                frame.tables[name] = Table({}, 0, 0)
            elif lazily:
                frame.tables[name] = Table(cast("dict[str, np.ndarray]", h5.columns(path, columns)), 0, size)
            else:
                frame.tables[name] = Table({k: file[place][rows] for k, (place, rows) in columns.items()}, 0, size)
    return frame


def _of_particles(group: Any) -> dict[str, tuple[str, Any]]:
    """Dataset and rows of each column."""
    columns: dict[str, tuple[str, Any]] = {axis: ("VTKHDF/Points", (slice(None), k)) for k, axis in enumerate("xy")}
    for name in group:
        place = f"VTKHDF/PointData/{name}"
        if name in _VECTORS:
            columns |= {part: (place, (slice(None), k)) for k, part in enumerate(_VECTORS[name])}
        else:
            columns[name] = (place, slice(None))
    return columns


def _of_links(group: Any, first: int, size: int, names: bytes) -> dict[str, tuple[str, Any]]:
    """Dataset and rows of each column of contacts or bonds."""
    rows = slice(first, first + size)
    force = dict(zip(("fx", "fy"), (0, 1))) if "force" in group else {}
    return {
        name: ("VTKHDF/CellData/force", (rows, force[name])) if name in force
        else (f"VTKHDF/CellData/{_LINK_NAMES.get(name, name)}", rows)
        for name in names.decode().split()
    }  # fmt: skip
