"""Dashpots of contacts, rolling resistance, a wall that is deleted: the same bits on any number of ranks and threads,
and across a restart."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files, contents

SHOWER = """\
START
BOX left 0 right 60 bottom 0 height 20 kn 1e7 ks 1e7 fric 0.3
WALL id 5 nodes (1, 20) (1, 0) kn 1e7 ks 1e7 xv 2.0
WALL id 7 nodes (20, 1) (30, 3) kn 1e7 ks 1e7 fric 0.3
WALL id 6 nodes (59, 0) (59, 20) kn 1e7 ks 1e7 fric 0.3
GEN num 700 rad discrete 0.3 0.4 0.5 x (2 58) y (0 18) group sand
PROP density 2500 kn 1e7 ks 8e6 fric 0.4 yv -9.0
SET DT 2e-4 GRAVITY 0 -9.8 print 600 save 400 restitution 0.45
CYC 700
PROP ebmod 1e7 gbmod 1e7 tstrength 1e4 sstrength 1e4 RANGE x (0 30)
FIX x RANGE x (40 45)
SET restitution 0.8
WALL id 7 delete
CYC 500
STOP
"""


ROLLING = SHOWER.replace("restitution 0.45", "energy 200").replace("fric 0.4 yv", "fric 0.4 rfric 0.3 rdamp 0.2 yv")
ROLLING = ROLLING.replace("sstrength 1e4", "sstrength 1e4 moment")
SCRIPTS = {"dashpots": SHOWER, "rolling": ROLLING.replace("SET restitution 0.8", "PROP rfric 0.1 RANGE x (0 20)")}


def run(resident: Resident, folder: Path, what: str, ranks: int, *options: str) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "shower.py").write_text(SCRIPTS[what])
    done = resident(ranks, "shower.py", "--no-figure", *options, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module", params=SCRIPTS)
def alone(
    request: pytest.FixtureRequest, resident: Resident, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path]:
    """What runs, and the folder of a run on one rank."""
    folder = tmp_path_factory.mktemp("shower") / "one"
    run(resident, folder, request.param, 1)
    return request.param, folder


@pytest.mark.mpi
@pytest.mark.parametrize("layout", layouts(quick=("2 ranks",)))
def test_ranks_and_threads_do_not_change_a_bit(
    resident: Resident, alone: tuple[str, Path], tmp_path: Path, layout: str
) -> None:
    (what, folder), (ranks, options) = alone, LAYOUTS[layout]
    run(resident, tmp_path, what, ranks, *options)
    assert_same_files(folder / "data", tmp_path / "data")


@pytest.mark.mpi
@pytest.mark.parametrize("step", [400, pytest.param(800, marks=pytest.mark.slow)])
def test_a_restart_does_not_change_a_bit(
    resident: Resident, alone: tuple[str, Path], tmp_path: Path, step: int
) -> None:
    what, folder = alone
    shutil.copytree(folder, tmp_path / "run")
    data = tmp_path / "run" / "data"
    for path in data.glob("*.sav"):
        if int(path.stem) > step:
            path.unlink()
    run(resident, tmp_path / "run", what, 2, "--resume")
    assert_same_files(folder / "data", data)
    kept = contents(data / "0000000800.sav")
    assert len(kept["pairs/fs"]) > 50
    if what == "rolling":
        assert (kept["pairs/memory1"] != 0.0).sum() > 50 and (kept["wall_contacts/memory1"] != 0.0).sum() > 5
