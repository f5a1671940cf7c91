"""FLEXURE on any number of ranks and threads, and resumed on another number: every file is the same, byte by byte."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files

SCRIPT = """\
START
SET disk on
BOX left 0.0 right 100.0 bottom -10.0 height 60.0 kn 1e7
WALL id 1 nodes (60.0, 0.0) (0.0, 0.0) kn=1e7 ks=1e7 fric 0.3
GLINE p1 (60.5 -0.5) p2 (100.0 -0.5) rad 0.5 kn=1e7 ks=1e7 fric 0.3 group base
FIX x y spin RANGE group base
GEN grid rad discrete 0.8 0.9 1.0 x (5.0, 95.0) y (0.0, 8.0) group sand
PROP density 2.5e3 kn 1e7 ks 1e7 fric 0.3 damp 0.4
SET gravity 0.0 -10.0 dt 0.003
SET save 170
SET stepbar 50
FLEXURE wall id 1 rigidity 7.5e8 contrast 3e4 left broken interval 80 speed 0.5
FLEXURE rigidity 7.5e8 contrast 3e4 x (0.0 200.0) compensated interval 60 relax 1.0 RANGE group base
HIST id 1 interval 30 deflection
CYC 250
GEN num 60 rad discrete 0.8 x (70.0, 95.0) y (12.0, 40.0) group rain
PROP density 5e3 kn 1e7 ks 1e7 fric 0.3 damp 0.4 yv -3.0 RANGE group rain
CYC 450
STOP
"""


def bend(resident: Resident, folder: Path, ranks: int, *options: str, resume: bool = False) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "bend.py").write_text(SCRIPT)
    done = resident(ranks, "bend.py", "--no-figure", *options, *(["--resume"] if resume else []), cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def reference(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bend") / "one"
    bend(resident, folder, 1)
    return folder


def test_both_bases_bend(reference: Path) -> None:
    rows = [line.split(",") for line in (reference / "data" / "flexure.csv").read_text().splitlines()[1:]]
    for name in ("wall 1", "row 0"):
        assert max(abs(float(row[4])) for row in rows if row[2] == name) > 0.003


@pytest.mark.mpi
@pytest.mark.parametrize("case", layouts(("3 ranks",)))
def test_same_files_however_it_is_run(reference: Path, resident: Resident, tmp_path: Path, case: str) -> None:
    ranks, options = LAYOUTS[case]
    bend(resident, tmp_path / "other", ranks, *options)
    assert_same_files(reference, tmp_path / "other")


@pytest.mark.mpi
def test_resumed_run_equals_the_uninterrupted_one(reference: Path, resident: Resident, tmp_path: Path) -> None:
    """From a checkpoint within an interval of both bases, on two ranks."""
    folder = tmp_path / "resumed"
    shutil.copytree(reference, folder)
    for path in sorted((folder / "data").glob("*.sav"))[1:]:
        path.unlink()
    bend(resident, folder, 2, resume=True)
    assert_same_files(reference, folder)
