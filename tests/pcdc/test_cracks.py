"""cracks.csv, what frames tell of broken joints, and histories: the same on any number of ranks and after a restart."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.fdem.cracks import columns
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from tests.pcdc.test_whole import SCRIPTS, tables
from tests.property.workers import Resident


def start(resident, folder: Path, ranks: int, *words: str):
    folder.mkdir(exist_ok=True)
    shutil.copy(SCRIPTS / "cracks.sc", folder)
    return resident(ranks, "cracks.sc", "--no-figure", *words, cwd=folder, timeout=1200)


def equal(one: Path, other: Path) -> None:
    """The same files with the same content."""
    names = sorted(p.name for p in (one / "data").iterdir() if p.suffix in (".csv", ".vtkhdf"))
    assert names == sorted(p.name for p in (other / "data").iterdir() if p.suffix in (".csv", ".vtkhdf"))
    assert len(names) == 7 + 5
    for name in names:
        if name.endswith(".csv"):
            assert (one / "data" / name).read_bytes() == (other / "data" / name).read_bytes(), name
        else:
            assert tables(one / "data" / name) == tables(other / "data" / name), name


@pytest.fixture(scope="module")
def alone(resident: Resident, tmp_path_factory) -> Path:
    """The run on one rank, in a folder in which another run left its table."""
    folder = tmp_path_factory.mktemp("cracks") / "one"
    (folder / "data").mkdir(parents=True)
    (folder / "data" / "cracks.csv").write_text("step,time [s]\n999999,1\n")
    done = start(resident, folder, 1)
    assert done.returncode == 0, done.stderr
    return folder


def rows(folder: Path) -> dict[str, np.ndarray]:
    with open(folder / "data" / "cracks.csv", newline="", encoding="utf-8") as file:
        head, *lines = list(csv.reader(file))
    assert head == list(columns(2).values())
    return dict(zip(head, np.array(lines, float).T))


def test_the_table_says_what_the_last_frame_shows(alone):
    table = rows(alone)
    assert len(table["step"]) > 15 and (np.diff(table["step"]) >= 0).all() and table["step"].max() < 800
    frame = read_mesh_frame(sorted((alone / "data").glob("plate_*.vtkhdf"))[-1])
    j = frame.of_joints
    broken = j["state"] == 3
    assert frame.step == 800
    shown = {int(n): values for n, *values in zip(*(j[name][broken] for name in ("number", "break_time", "mode",
             "break_energy", "length")))}  # fmt: skip
    names = ("joint", "time [s]", "mode", "kinetic_energy [J/m]", "length [m]")
    told = {int(n): values for n, *values in zip(*(table[name] for name in names))}
    gone = {n for n in told if n not in shown}  # beside the element that was taken out
    assert len(gone) <= 4 and {n: v for n, v in told.items() if n not in gone} == shown
    assert np.isnan(j["break_time"][~broken]).all() and np.isnan(j["break_energy"][~broken]).all()


def test_corners_tell_their_nodes(alone):
    """Corners of one node lay at one place in the mesh."""
    frame = read_mesh_frame(alone / "data" / "plate_0000000200.vtkhdf")
    home = frame.points - frame.of_points["displacement"]
    order = np.argsort(frame.of_points["node"], kind="stable")
    node, home = frame.of_points["node"][order], home[order]
    same = node[1:] == node[:-1]
    assert np.abs(np.diff(home, axis=0)[same]).max() < 1e-12
    assert len(np.unique(node)) == 17 * 9


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_on_several_ranks(resident, alone, tmp_path, ranks):
    done = start(resident, tmp_path / "a", ranks)
    assert done.returncode == 0, done.stderr
    equal(alone, tmp_path / "a")


@pytest.mark.mpi
@pytest.mark.parametrize(("before", "after"), [(2, 1), pytest.param(1, 4, marks=pytest.mark.slow)])
def test_stopped_and_resumed(resident, alone, tmp_path, before, after):
    """What the stopped run wrote after its checkpoint is cut off, and nothing is missing or there twice."""
    folder = tmp_path / "a"
    folder.mkdir()
    (folder / "stop").touch()
    done = start(resident, folder, before)
    assert done.returncode == 85, done.stderr
    (folder / "stop").unlink()
    table = folder / "data" / "cracks.csv"
    known = table.read_bytes()
    assert (alone / "data" / "cracks.csv").read_bytes().startswith(known) and len(known.splitlines()) > 4
    table.write_bytes(known + b"790,1.0,3,0.0,0.0,1.0,0.1,1.0,780,1.0\n79")
    again = start(resident, folder, after, "--resume")
    assert again.returncode == 0, again.stderr
    equal(alone, folder)
