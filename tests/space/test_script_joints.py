"""Joints of tetrahedra in a script: what is written while they break, and what comes back from a checkpoint."""

from __future__ import annotations

import csv
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from tests.conftest import run
from tests.property.workers import Resident

SCRIPT = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (0.4,0.2,0.2) cells 4 2 2
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 2e6 gf1 1 gf2 4 penalty-normal 5e11
pcdc face-joint group 'weak' range x 0.1 0.1
pcdc face-joint property tensile-strength 1e6 range group 'weak'
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0.1 range x 0.4 0.4
pcdc model option energy on
pcdc history create 'lost' model value joint-loss every 50
pcdc history create 'broken' model value broken-joints every 50
pcdc history create 'open' joint value opening maximum every 50 range group 'weak'
pcdc output vtk 'bar' every 500
pcdc model step 500
pcdc model save 'half.sav'
pcdc model step 500
"""


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of one rank."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "bar.sc").write_text(SCRIPT, encoding="utf-8")
    done = resident(1, "bar.sc", cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "said.txt").write_text(done.stdout, encoding="utf-8")
    return folder


def test_it_breaks_where_it_is_weak(alone: Path) -> None:
    with (alone / "data" / "cracks.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows and list(rows[0])[3:8] == ["x [m]", "y [m]", "z [m]", "mode", "joint_area [m2]"]
    assert np.allclose([float(row["x [m]"]) for row in rows], 0.1)
    assert sum(float(row["joint_area [m2]"]) for row in rows) == pytest.approx(0.04)
    broken = np.loadtxt(alone / "data" / "history_broken.csv", delimiter=",", skiprows=1)
    assert broken[0, 2] == 0 and broken[-1, 2] == len(rows) == 8
    opened = np.loadtxt(alone / "data" / "history_open.csv", delimiter=",", skiprows=1)
    assert opened[0, 2] > 0.0


def test_cracks_are_measured(alone: Path, tmp_path: Path) -> None:
    """The bar is parted at x = 0.1: poles along x, all in tension; its free end has gone at most as far as it was
    pulled. Without the table that the run writes the last frame knows the events."""
    shutil.copytree(alone / "data", tmp_path / "data")
    found = []
    for _ in range(2):
        done = run([sys.executable, "-m", "hpcdem", "measure", "data", "cracks", "emission"], cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        with (tmp_path / "data" / "measure" / "emission_events.csv").open(encoding="utf-8") as file:
            found.append(sorted((row["joint"], row["z[m]"], row["area[m2]"]) for row in csv.DictReader(file)))
        (tmp_path / "data" / "cracks.csv").unlink(missing_ok=True)
    assert found[0] == found[1] and len(found[0]) == 8
    with (tmp_path / "data" / "measure" / "cracks_last.csv").open(encoding="utf-8") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert sum(row["area[m2]"] for row in rows) == pytest.approx(0.04) and len(rows) == 8
    state = read_mesh_frame(max((tmp_path / "data").glob("bar_*.vtkhdf")), solid=True)
    for row in rows:
        assert row["dip[deg]"] == pytest.approx(90.0, abs=0.1) and row["mode"] < 4.0 / 3.0
        assert min(abs(row["dip_direction[deg]"] - way) for way in (90.0, 270.0)) < 0.1
        assert 0.0 < row["opening[m]"] < 0.1 * state.time and row["slip[m]"] < 0.1 * row["opening[m]"]


def test_what_joints_took_is_reported_in_joules(alone: Path) -> None:
    """At least gf1 of the area that broke."""
    path = alone / "data" / "history_lost.csv"
    assert "[J]" in path.read_text(encoding="utf-8").splitlines()[0]
    lost = np.loadtxt(path, delimiter=",", skiprows=1)
    assert 0.0 <= lost[0, 2] < 1e-3 and 0.04 < lost[-1, 2] < 0.1
    log = (alone / "said.txt").read_text(encoding="utf-8")
    closing = re.search(r"energy: closing error (\S+) of the largest flow", log)
    assert closing and float(closing[1]) < 0.01


def test_frames_have_joints_as_triangles(alone: Path) -> None:
    state = read_mesh_frame(alone / "data" / "bar_0000001000.vtkhdf", solid=True)
    assert state.joints.shape == (4 * 96 // 2 - 40, 3)  # two sides to a joint; 80 triangles on the surface
    gone = state.of_joints["state"] == 3
    assert gone.sum() == 8 and np.allclose(state.of_joints["joint_area"][gone], 0.005)
    corners = state.of_points["node"][state.joints[gone]].astype(int)
    x = state.points - state.of_points["displacement"]
    assert np.allclose(x[state.joints[gone]][:, :, 0], 0.1) and len(np.unique(corners)) == 9
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(alone / "data" / "bar_0000001000.vtkhdf")
    assert set(np.unique(grid.celltypes)) == {5, 10} and grid.n_cells == 96 + len(state.joints)


@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_ranks_and_a_restart_come_to_the_same(
    alone: Path, resident: Resident, tmp_path: Path, ranks: int, needs_parallel_hdf5: None
) -> None:
    """The second half from the checkpoint on several ranks: frames and cracks byte for byte."""
    shutil.copy(alone / "half.sav", tmp_path)
    (tmp_path / "go.sc").write_text("pcdc model restore 'half.sav'\npcdc model step 500\n", encoding="utf-8")
    done = resident(ranks, "go.sc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    name = "bar_0000001000.vtkhdf"
    one, other = (read_mesh_frame(folder / "data" / name, solid=True) for folder in (alone, tmp_path))
    assert (one.points == other.points).all()
    for first, second in ((one.of_joints, other.of_joints), (one.of_elements, other.of_elements)):
        assert set(first) == set(second)
        for column in first:
            assert np.array_equal(first[column], second[column], equal_nan=True), column
    assert (alone / "data" / "cracks.csv").read_bytes() == (tmp_path / "data" / "cracks.csv").read_bytes()
