"""Frames of blocks as VTKHDF: readable by VTK, the same from any number of ranks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.frame import Table
from hpcdem.io.vtkhdf_mesh import MeshFrame, write_mesh_frame
from tests.conftest import ROOT

NUMBERS = np.array([0, 1, 2, 4, 5, 6, 7, 12, 13, 14])
"""Corners of triangle 0, quad 1 and triangle 3; element 2 was taken out."""
XY = np.array([(0, 0), (1, 0), (0, 1), (1, 0), (2, 0), (2, 1), (1, 1), (2, 0), (3, 0), (2, 1)], float)


def made_frame(comm: Any) -> MeshFrame:
    """Two triangles, a quad and two joints (along the second edge of element 0 and of element 1), in slabs."""

    def slab(columns: dict[str, np.ndarray]) -> Table:
        n = len(next(iter(columns.values())))
        cuts = [n * rank // comm.size for rank in range(comm.size + 1)]
        a, b = cuts[comm.rank], cuts[comm.rank + 1]
        return Table({name: values[a:b] for name, values in columns.items()}, a, n)

    corners = slab({"number": NUMBERS, "x": XY[:, 0], "y": XY[:, 1], "velocity_x": np.arange(10.0),
                    "velocity_y": -np.arange(10.0), "mass": np.ones(10)})  # fmt: skip
    stress = np.array([1.0, 2.0, 3.0])
    elements = slab({"number": np.array([0, 1, 3]), "corners": np.array([3, 4, 3]), "stress_xx": stress,
                     "group_domain": np.array([0, 1, -1], np.int32)})  # fmt: skip
    joints = slab({"number": np.array([1, 5]), "first": np.array([1, 5]), "last": np.array([2, 6]),
                   "state": np.array([0, 2], np.int32), "opening": np.array([0.0, 1e-5])})  # fmt: skip
    return MeshFrame(7, 0.5, 0.1, corners, elements, joints, {"group_domain": ["rock", "岩"]})


def test_vtk_reads_it(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = tmp_path / "a.vtkhdf"
    write_mesh_frame(path, made_frame(SerialComm()), SerialComm())
    mesh = pyvista.read(path)
    assert mesh.n_points == 10 and mesh.celltypes.tolist() == [5, 9, 5, 3, 3]
    assert mesh.points[:, :2].tolist() == XY.tolist() and not mesh.points[:, 2].any()
    assert [mesh.get_cell(k).point_ids for k in range(5)] == [[0, 1, 2], [3, 4, 5, 6], [7, 8, 9], [1, 2], [4, 5]]
    areas = mesh.compute_cell_sizes(length=False, volume=False)["Area"]
    assert areas.tolist() == [0.5, 1.0, 0.5, 0.0, 0.0]
    assert mesh.cell_data["cell"].tolist() == [0, 0, 0, 1, 1] and mesh.cell_data["number"].tolist() == [0, 1, 3, 1, 5]
    assert mesh.cell_data["state"].tolist() == [-1, -1, -1, 0, 2]
    assert mesh.cell_data["stress_xx"][:3].tolist() == [1, 2, 3] and np.isnan(mesh.cell_data["stress_xx"][3:]).all()
    assert mesh.cell_data["group_domain"].tolist() == [0, 1, -1, -1, -1]
    assert mesh.point_data["velocity"].tolist() == [[k, -k, 0.0] for k in range(10)]
    assert mesh.point_data["mass"].tolist() == [1.0] * 10 and "velocity_x" not in mesh.point_data
    with h5py.File(path) as file:
        assert file["VTKHDF/FieldData/TimeValue"][0] == 0.5 and file["hpcdem"].attrs["step"] == 7
        assert [name.decode() for name in file["hpcdem/group_domain"]] == ["rock", "岩"]


def test_a_model_without_joints(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    frame = made_frame(SerialComm())
    frame.joints = Table({name: values[:0] for name, values in frame.joints.columns.items()}, 0, 0)
    write_mesh_frame(tmp_path / "a.vtkhdf", frame, SerialComm())
    assert pyvista.read(tmp_path / "a.vtkhdf").celltypes.tolist() == [5, 9, 5]


def test_a_joint_without_its_corner_is_refused(tmp_path):
    frame = made_frame(SerialComm())
    frame.joints.columns["last"] = np.array([2, 8])
    with pytest.raises(HpcdemError, match="a joint refers to a missing corner"):
        write_mesh_frame(tmp_path / "a.vtkhdf", frame, SerialComm())
    assert list(tmp_path.iterdir()) == []


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from mpi4py import MPI
from hpcdem.halo.comm import MpiComm
from hpcdem.io.vtkhdf_mesh import write_mesh_frame
from tests.unit.test_io_vtkhdf_mesh import made_frame
comm = MpiComm(MPI.COMM_WORLD)
write_mesh_frame("many.vtkhdf", made_frame(comm), comm)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_any_number_of_ranks_writes_the_same(launch: Any, tmp_path: Path, ranks: int) -> None:
    write_mesh_frame(tmp_path / "one.vtkhdf", made_frame(SerialComm()), SerialComm())
    (tmp_path / "program.py").write_text(PROGRAM)
    done = launch.python(ranks, "program.py", ROOT, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "one.vtkhdf") as one, h5py.File(tmp_path / "many.vtkhdf") as many:
        found: list[str] = []
        one.visititems(lambda name, node: found.append(name) if isinstance(node, h5py.Dataset) else None)
        assert len(found) > 15
        for name in found:
            a, b = one[name][...], many[name][...]
            assert a.dtype == b.dtype and a.tobytes() == b.tobytes(), name
