"""Frames as VTKHDF: exact on the way back, readable by VTK, the same from any number of ranks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.vtkhdf import BOND, CONTACT, PARTICLE, read_vtkhdf, write_vtkhdf
from tests.unit.io_synthetic import assert_same, make_frame

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("n", [1, 2, 500])
def test_every_number_comes_back(tmp_path: Path, n: int) -> None:
    frame = make_frame(n)
    write_vtkhdf(tmp_path / "a.vtkhdf", frame, SerialComm())
    assert_same(read_vtkhdf(tmp_path / "a.vtkhdf"), frame)


def test_a_frame_without_walls_contacts_or_box(tmp_path: Path) -> None:
    frame = make_frame(3)
    for table in ("contacts", "bonds", "wall_contacts"):
        frame.tables[table].columns = {k: v[:0] for k, v in frame.tables[table].columns.items()}
        frame.tables[table].total = 0
    frame.walls = {k: v[:0] for k, v in frame.walls.items()}
    frame.settings = {"left": np.nan, "disk": "hex"}
    frame.group_names = []
    write_vtkhdf(tmp_path / "a.vtkhdf", frame, SerialComm())
    assert_same(read_vtkhdf(tmp_path / "a.vtkhdf"), frame)


def test_a_part_can_be_read_alone(tmp_path: Path) -> None:
    frame = make_frame(50)
    write_vtkhdf(tmp_path / "a.vtkhdf", frame, SerialComm())
    part = read_vtkhdf(tmp_path / "a.vtkhdf", ("particles",))
    assert part.tables["particles"].columns.keys() == frame.tables["particles"].columns.keys()
    assert len(part.tables["bonds"]) == 0


def test_vtk_reads_it(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    frame = make_frame(200)
    path = tmp_path / "all_0000046000.vtkhdf"
    write_vtkhdf(path, frame, SerialComm())
    mesh = pyvista.read(path)
    particles, contacts, bonds = (frame.tables[k].columns for k in ("particles", "contacts", "bonds"))
    assert (mesh.n_points, mesh.n_verts, mesh.n_lines) == (200, 200, len(contacts["id1"]) + len(bonds["id1"]))
    np.testing.assert_array_equal(mesh.points[:, 0], particles["x"])
    np.testing.assert_array_equal(mesh.point_data["radius"], particles["radius"])
    np.testing.assert_array_equal(mesh.point_data["velocity"][:, 1], particles["vy"])
    assert mesh.point_data["velocity"].shape == (200, 3)
    assert set(mesh.point_data.keys()) == (set(particles) - {"x", "y", "vx", "vy", "fx", "fy"}) | {"velocity", "force"}
    np.testing.assert_array_equal(mesh.field_data["TimeValue"], [frame.time])

    # Lines join the particles that their ids name.
    links = np.concatenate([np.stack([t["id1"], t["id2"]], axis=1) for t in (contacts, bonds)])
    np.testing.assert_array_equal(particles["gid"][mesh.lines.reshape(-1, 3)[:, 1:]], links)
    kinds = [PARTICLE] * 200 + [CONTACT] * len(contacts["id1"]) + [BOND] * len(bonds["id1"])
    np.testing.assert_array_equal(mesh.cell_data["link"], kinds)
    bonded = {(a, b) for a, b in zip(bonds["id1"], bonds["id2"])}
    expected = [(a, b) in bonded for a, b in zip(contacts["id1"], contacts["id2"])]
    assert 0 < sum(expected) < len(expected)
    np.testing.assert_array_equal(mesh.cell_data["bonded"], [0] * 200 + expected + [1] * len(bonded))
    assert np.isnan(mesh.cell_data["fn"][:200]).all()
    assert (mesh.cell_data["id1"][:200] == -1).all()
    np.testing.assert_array_equal(mesh.cell_data["fn"][200:], np.concatenate([contacts["fn"], bonds["fn"]]))
    np.testing.assert_array_equal(mesh.cell_data["kind"][-len(bonded) :], bonds["kind"])
    # The radius scales glyphs.
    discs = mesh.glyph(geom=pyvista.Disc(inner=0.0, outer=1.0), scale="radius", orient=False, factor=1.0)
    assert abs(discs.bounds[1] - (particles["x"] + particles["radius"]).max()) < 1.0


def test_it_opens_in_the_reader_that_paraview_uses(tmp_path: Path) -> None:
    reader_module = pytest.importorskip("vtkmodules.vtkIOHDF")
    write_vtkhdf(tmp_path / "a.vtkhdf", make_frame(20), SerialComm())
    reader = reader_module.vtkHDFReader()
    assert reader.CanReadFile(str(tmp_path / "a.vtkhdf"))
    reader.SetFileName(str(tmp_path / "a.vtkhdf"))
    reader.Update()
    assert reader.GetOutput().GetNumberOfPoints() == 20


def test_a_contact_of_no_particle_is_an_error(tmp_path: Path) -> None:
    frame = make_frame(20)
    frame.tables["contacts"].columns["id2"][-1] = 10**9
    with pytest.raises(HpcdemError, match="refers to a missing particle"):
        write_vtkhdf(tmp_path / "a.vtkhdf", frame, SerialComm())
    assert list(tmp_path.iterdir()) == []


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(HpcdemError, match="there is no such file"):
        read_vtkhdf(tmp_path / "none.vtkhdf")
    (tmp_path / "text.vtkhdf").write_text("text")
    with pytest.raises(HpcdemError, match="cannot read"):
        read_vtkhdf(tmp_path / "text.vtkhdf")
    h5py.File(tmp_path / "other.vtkhdf", "w").close()
    with pytest.raises(HpcdemError, match="not a frame written by hpcdem"):
        read_vtkhdf(tmp_path / "other.vtkhdf")


def contents(path: Path) -> dict[str, Any]:
    """Every dataset and attribute of a file by its path."""
    found: dict[str, Any] = {}

    def take(name: str, item: Any) -> None:
        found.update({f"{name}@{k}": np.asarray(v).tobytes() for k, v in item.attrs.items()})
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, item.dtype.str, item[...].tobytes())

    with h5py.File(path) as file:
        file.visititems(take)
    return found


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from mpi4py import MPI
from hpcdem.halo.comm import MpiComm
from hpcdem.io import files
from hpcdem.io.vtkhdf import write_vtkhdf
from tests.unit.io_synthetic import make_frame

files.PIECE = 1000
comm = MpiComm(MPI.COMM_WORLD)
for n in (1, 500):
    write_vtkhdf(f"{n}.vtkhdf", make_frame(n, comm), comm)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 3])
def test_any_number_of_ranks_writes_the_same_file(launch: Any, tmp_path: Path, ranks: int) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    done = launch.python(ranks, "program.py", ROOT, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    for n in (1, 500):
        write_vtkhdf(tmp_path / "serial.vtkhdf", make_frame(n), SerialComm())
        assert contents(tmp_path / f"{n}.vtkhdf") == contents(tmp_path / "serial.vtkhdf")
        assert_same(read_vtkhdf(tmp_path / f"{n}.vtkhdf"), make_frame(n))
