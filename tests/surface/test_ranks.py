"""Surface processes give the same files on any number of ranks and threads, and continue from a checkpoint."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hpcdem.io.frames import list_frames, read_frame
from tests.parallel.test_growing_model import run_text
from tests.property.workers import Resident
from tests.short_push import assert_same_files, contents

LAW = "density 2.2e3 shear 2.9e9 poiss 0.2 damp 0.4 fric 0.4 hertz"
MODEL = f"""\
START
SET disk off
BOX left 0.0 right 5000.0 bottom 0.0 height 4000.0
WALL id 0 nodes (0.0, 50.0) (4900.0, 50.0)
WALL id 1 nodes (50.0, 3500.0) (50.0, 50.0)
WALL id 2 nodes (4900.0, 50.0) (4900.0, 3500.0)
GEN num 700 rad discrete 50.0 70.0 x (50.0, 4900.0) y (50.0, 1600.0) group bed
PROP density 2.5e3 fric 0.0 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8
SET energy 100
CYC 300
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3
WALL id 1 fric 0.3 xv 12.0
SURFACE id 1 interval 25 diffuse 1e4 slope 25 rad discrete 40 50 {LAW} group growth episode 200 colors red|blue
SURFACE id 2 interval 50 x 2000.0 {{right}} deposit 20.0 below 1250.0 compact 0.5 800.0 rad discrete 40 {LAW} group fill
SET save 325 print 300
CYC 300
"""
REST = f"""\
CYC 300
SURFACE id 2 interval 40 x 2500.0 {{right}} deposit 30.0 below 1250.0 compact 0.5 600.0 rad discrete 40 {LAW} group fill
SURFACE id 3 interval 40 erode 9.0 above 1250.0 only bed|fill
SURFACE id 1 off
CYC 200
EXP end.dat group
STOP
"""


@pytest.fixture(scope="module")
def one(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model on one rank."""
    return run_text(resident, MODEL + REST, tmp_path_factory.mktemp("surface") / "one", 1)


def test_the_model_does_all_that_it_is_for(one: Path) -> None:
    """Growth strata of several episodes, discs that settle when the checkpoint is written, erosion, and deposition."""
    frame = read_frame(list_frames(one / "data")[-1].path, ("particles",))
    numbers = frame.tables["particles"].columns["group"]
    counts = {name: int((numbers == k).sum()) for k, name in enumerate(frame.group_names)}
    assert counts["growth1"] > 3 and counts["growth2"] > 0 and counts["fill"] > 40, counts
    rows = [line.split(",") for line in (one / "data" / "surface.csv").read_text().splitlines()]
    last = {row[2]: dict(zip(rows[0], row)) for row in rows[1:]}
    assert int(last["1"]["discs_eroded"]) > 3 and int(last["3"]["discs_eroded"]) > 0
    assert float(last["2"]["compacted"]) > 0.0
    assert any(row[0] == "650" and int(row[11]) > 0 for row in rows[1:])


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_ranks(one: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    assert_same_files(one, run_text(resident, MODEL + REST, tmp_path / "more", ranks))


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_a_restart_in_the_middle_of_a_process(one: Path, resident: Resident, tmp_path: Path, ranks: int) -> None:
    """The checkpoint is from the middle of an episode and of a CYC, with discs that are still settling."""
    (tmp_path / "again").mkdir()
    shutil.copy(one / "data" / "0000000650.sav", tmp_path / "again" / "0000000650.sav")
    again = run_text(resident, "RES 0000000650.sav\n" + REST.replace("CYC 300", "CYC 250"), tmp_path / "again", ranks)
    assert (again / "end.dat").read_bytes() == (one / "end.dat").read_bytes()
    frames = [sorted((folder / "data").glob("*.vtkhdf"))[-1] for folder in (one, again)]
    left, right = map(contents, frames)
    assert frames[0].name == frames[1].name and left.keys() == right.keys()
    assert not [k for k in left if left[k].tobytes() != right[k].tobytes()]
    tails = [(folder / "data" / "surface.csv").read_text().splitlines()[-12:] for folder in (one, again)]
    assert tails[0] == tails[1]
