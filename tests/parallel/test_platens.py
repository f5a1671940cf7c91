"""Pressures on side walls of particles, stress and strain of platens, marked bonds, loaded frames: the same
files on any number of ranks and threads, and across a restart."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident

BIAXIAL = """
START
SET disk on dt 1e-3 print 100 stepbar 50 thickness 2.0 seed 3
GLINE p1 (0.0 -0.5) p2 (24.0 -0.5) rad 0.5 group bom_wall
GLINE p1 (0.0 30.5) p2 (24.0 30.5) rad 0.5 group top_wall
GLINE p1 (-0.5 0.5) p2 (-0.5 29.5) rad 0.5 group lef_wall
GLINE p1 (24.5 0.5) p2 (24.5 29.5) rad 0.5 group rig_wall
WALL id 0 nodes (-2.0 -0.95) (26.0 -0.95) kn 1e5
WALL id 3 nodes (-2.0 31.5) (26.0 31.5) kn 1e5
GEN num 300 rad discrete 0.45 0.6 x (0.0 24.0) y (0.0 30.0) group rock
PROP density 2e3 kn 1e5 ks 1e5 damp 0.5 fric 0.3
PROP ebmod 1e5 gbmod 1e5 tstrength 1e9 sstrength 1e9 rubber tolerate 0.01 RANGE group lef_wall
PROP ebmod 1e5 gbmod 1e5 tstrength 1e9 sstrength 1e9 rubber tolerate 0.01 RANGE group rig_wall
FIX x y spin RANGE group top_wall or group bom_wall or group lef_wall or group rig_wall
HIST id 1 interval 10 , gstress group top_wall
HIST id 2 interval 10 , gstrain group top_wall|bom_wall
HIST id 3 interval 10 , gstrain group lef_wall|rig_wall
HIST id 4 interval 10 , wall id 0 ystress
HIST id 5 interval 10 , ystrain wall 0|3
INI xp 500.0 RANGE group lef_wall
INI xp -500.0 RANGE group rig_wall
FREE x RANGE group lef_wall or group rig_wall
INI yv -2.0 RANGE group top_wall
WALL id 3 yv -2.0
SET save 150
CYC 300
EXP end.dat
"""
LOADED = "LOAD start/all_0000000200.dat\nSET print 50 stepbar 50\nCYC 100\nEXP loaded.dat\n"


def outputs(folder: Path) -> dict[str, bytes]:
    """What a run has written, but for what says how it was started."""
    found = [*(folder / "data").glob("*.*"), *folder.glob("*.dat")]
    return {path.name: path.read_bytes() for path in found if path.suffix in (".dat", ".csv", ".vtkhdf")}


@pytest.fixture(scope="module")
def one(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("platens")
    (folder / "script.py").write_text(BIAXIAL)
    done = resident(1, "script.py", "--no-figure", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_the_specimen_is_pressed(one: Path) -> None:
    """The platens meet resistance, the sides come inwards under their pressure."""
    last = {k: float((one / f"data/hist_{k}.csv").read_text().splitlines()[-1].split(",")[2]) for k in range(1, 6)}
    assert last[1] > 0.0 and last[4] > 0.0 and last[3] > 0.0
    assert last[2] == pytest.approx(0.6 / 31.0, rel=1e-9) and last[5] == pytest.approx(0.6 / 32.45, rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("ranks", "threads"),
    [pytest.param(2, 1, marks=pytest.mark.slow), (3, 1), pytest.param(1, 2, marks=pytest.mark.slow)],
)
def test_the_same_on_any_ranks_and_threads(
    one: Path, resident: Resident, tmp_path: Path, ranks: int, threads: int
) -> None:
    shutil.copy(one / "script.py", tmp_path)
    done = resident(ranks, "-j", threads, "script.py", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert outputs(tmp_path) == outputs(one)


@pytest.mark.mpi
def test_the_same_across_a_restart(one: Path, resident: Resident, tmp_path: Path) -> None:
    shutil.copytree(one, tmp_path / "again")
    folder = tmp_path / "again"
    for path in folder.glob("data/0000000300.sav"):
        path.unlink()
    done = resident(2, "script.py", "--resume", "--no-figure", cwd=folder)
    assert done.returncode == 0 and "CYC, 300 steps, 150 left" in done.stdout, done.stdout + done.stderr
    assert outputs(folder) == outputs(one)


@pytest.mark.mpi
def test_a_loaded_frame_continues_alike(one: Path, resident: Resident, tmp_path: Path) -> None:
    written = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        (folder / "start").mkdir(parents=True)
        shutil.copy(one / "data/all_0000000200.dat", folder / "start")
        (folder / "script.py").write_text(LOADED)
        done = resident(ranks, "script.py", "--no-figure", cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        written.append(outputs(folder))
    assert written[0] == written[1] and "all_0000000300.vtkhdf" in written[0]
