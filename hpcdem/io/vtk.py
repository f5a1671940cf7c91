"""`SET vtk`: frames as legacy VTK files, ASCII PolyData: particles in one file, walls in a second one.

Format: VTK File Formats, simple legacy formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.io.behind import Deliveries
from hpcdem.io.files import write_sections
from hpcdem.io.frame import Frame
from hpcdem.io.textnum import INT, Column, TextTable, sci
from hpcdem.io.transport import Section

_WHOLE = 21  # characters that hold any int64 and a blank


def write_vtk(path: str | os.PathLike, frame: Frame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: the particles in `path`, usually ``all_<step>.vtk``, and the walls in ``wall_<step>.vtk`` beside it.

    Particles are points and vertices with scalars radius, id, color, group (number) and vectors velocity. The same
    bytes for any number of ranks. Raises HpcdemError on all ranks.
    """

    def sections() -> list[Section]:
        table = frame.tables["particles"]
        n, columns = table.total, table.columns
        rows = table.offset + np.arange(len(table))
        result: list[Section] = [_head("particles", frame, n)]
        result += [_vectors(columns["x"], columns["y"], digits=13), f"VERTICES {n} {2 * n}\n".encode()]
        result += [TextTable([(Column("size", INT, 2), np.ones_like(rows)), (Column("row", INT, _WHOLE), rows)])]
        result += [f"POINT_DATA {n}\n".encode()]
        result += [_scalars("radius", "double"), TextTable([(sci("radius"), columns["radius"])])]
        for name, column, kind in (("id", "gid", "long"), ("color", "color", "int"), ("group", "group", "int")):
            result += [_scalars(name, kind), TextTable([(Column(name, INT, _WHOLE), columns[column])])]
        return [*result, b"VECTORS velocity double\n", _vectors(columns["vx"], columns["vy"])]

    write_sections(path, comm, sections, later)
    name = Path(path).name
    write_wall_vtk(Path(path).with_name("wall_" + name.removeprefix("all_")), frame, comm, later)


def write_wall_vtk(path: str | os.PathLike, frame: Frame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: the walls as lines, with cell scalars id, color and vectors velocity, force.

    Raises HpcdemError on all ranks.
    """

    def sections() -> list[Section]:
        walls, n = frame.walls, len(frame.walls["id"])
        mine = slice(0, n if comm.rank == 0 else 0)  # the same on all ranks: rank 0 writes it
        ends = np.stack([walls["p1"], walls["p2"]], axis=1)[mine].reshape(-1, 2)
        first = 2 * np.arange(n)[mine]
        line = [(Column(name, INT, _WHOLE), v) for name, v in (("a", first), ("b", first + 1))]
        result: list[Section] = [_head("walls", frame, 2 * n), _vectors(ends[:, 0], ends[:, 1], digits=13)]
        result += [
            f"LINES {n} {3 * n}\n".encode(),
            TextTable([(Column("size", INT, 2), np.full_like(first, 2)), *line]),
        ]
        result += [f"CELL_DATA {n}\n".encode()]
        for name, kind in (("id", "long"), ("color", "int")):
            result += [_scalars(name, kind), TextTable([(Column(name, INT, _WHOLE), walls[name][mine])])]
        for name, column in (("velocity", "v"), ("force", "force")):
            values = walls[column][mine]
            result += [f"VECTORS {name} double\n".encode(), _vectors(values[:, 0], values[:, 1])]
        return result

    write_sections(path, comm, sections, later)


def _head(what: str, frame: Frame, points: int) -> bytes:
    lines = ["# vtk DataFile Version 3.0", f"hpcdem {what}, step {frame.step}", "ASCII", "DATASET POLYDATA"]
    return "\n".join([*lines, f"POINTS {points} double\n"]).encode()


def _scalars(name: str, kind: str) -> bytes:
    return f"SCALARS {name} {kind} 1\nLOOKUP_TABLE default\n".encode()


def _vectors(x: np.ndarray, y: np.ndarray, digits: int = 9) -> TextTable:
    flat = Column("z", INT, 2), np.zeros(len(x), dtype=np.int64)
    return TextTable([(sci("x", digits), x), (sci("y", digits), y), flat])
