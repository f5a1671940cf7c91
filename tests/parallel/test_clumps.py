"""Rigid clumps: the same files on any number of ranks and threads, and across a restart on another number.

Rods seven discs long and other bodies fall among free discs, are pushed across borders, bonded, joined, deleted, and
leave the BOX; clumps that lie across a border are computed by both ranks.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.clumped import write_lattice
from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files, contents

SCRIPT = """\
START
BOX left 0.0 right 420.0 bottom 0.0 height 300.0
WALL id 0 nodes (0.0, 5.0) (360.0, 5.0) kn 2e7 ks 1e7 fric 0.3
WALL id 1 nodes (5.0, 290.0) (5.0, 5.0) kn 2e7 ks 1e7 fric 0.3
CLUMP file bodies.clumps x 20.0 y 10.0 color blue group rock
GEN num 300 rad discrete 2.0 3.0 x (10.0, 350.0) y (6.0, 200.0) group sand
PROP density 2e3 kn 2e7 ks 1e7 fric 0.4 damp 0.2
SET dt 5e-3 gravity 0.0 -9.8
SET print 300
SET save 350
SET energy 100
SET damp lsm 10.0
HIST id 1 interval 50 kinetic
HIST id 2 interval 50 energy
CYC 600
CLUMP group boulder color red RANGE group sand and x 100.0 112.0 and y 5.0 20.0
PROP n_bond 1e7 s_bond 1e7 RANGE x 150.0 260.0
PROP spin 0.5 xv 3.0 RANGE group rock and y {top}-60.0 {top}
WALL id 1 xv 10.0
CYC 500
DEL RANGE x 0.0 60.0
FIX spin RANGE x 200.0 240.0
CLUMP file bodies.clumps x 30.0 y 150.0 scale 0.5 angle 0.7 group rain
PROP density 2.2e3 kn 2e7 ks 1e7 fric 0.2 RANGE group rain
CYC 500
FREE spin
BOND break RANGE x 150.0 200.0
IMPLE wall id 1 xmove 15.0 print 5.0 save 5.0
STOP
"""


def run(resident: Resident, folder: Path, ranks: int, *options: str, resume: bool = False) -> None:
    """Run the model in a folder."""
    folder.mkdir(exist_ok=True)
    write_lattice(folder / "bodies.clumps", 3.0, 10, 6)
    script = folder / "clumps.py"
    script.write_text(SCRIPT)
    done = resident(ranks, script, "--no-figure", *options, *(["--resume"] if resume else []), cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def reference(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run on one rank and one thread."""
    folder = tmp_path_factory.mktemp("clumps") / "one"
    run(resident, folder, 1)
    return folder


def test_the_model_is_worth_comparing(reference: Path) -> None:
    """Some clumps were deleted, some left the BOX, particles were joined, clumps are wider than two discs' columns."""
    state = contents(sorted((reference / "data").glob("*.sav"))[-1])
    text = str(state["@state"])
    assert int(text.split('"lost": ')[1].split(",")[0]) > 5
    assert '"clumps": {"number": ' in text
    number = int(text.split('"clumps": {"number": ')[1].split(",")[0])
    assert number == len(state["clumps/id"]) < 121
    assert len(state["clump_members/gid"]) == state["clumps/members"].sum()
    ids = set(state["clumps/id"].tolist())
    lattice_discs = 60 // 5 * (7 + 3 + 5 + 2 + 1)
    assert any(lattice_discs <= i < lattice_discs + 300 for i in ids), "the joined clump is there"
    sides = re.findall(r'"side": ([0-9.e+-]+)', text)  # of cells, and of periodic sides
    assert max(map(float, sides)) > 3.0 * 7.2  # columns as wide as the rods


@pytest.mark.mpi
@pytest.mark.parametrize("case", layouts(("3 ranks",)))
def test_same_files_however_it_is_run(reference: Path, resident: Resident, tmp_path: Path, case: str) -> None:
    ranks, options = LAYOUTS[case]
    run(resident, tmp_path / "other", ranks, *options)
    assert_same_files(reference, tmp_path / "other")


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("checkpoint", "ranks"),
    [
        pytest.param("first", 3, marks=pytest.mark.slow),
        pytest.param("middle", 1, marks=pytest.mark.slow),  # test_models resumes clumps on other ranks
        pytest.param("last", 4, marks=pytest.mark.slow),
    ],
)
def test_resumed_run_equals_the_uninterrupted_one(
    reference: Path, resident: Resident, tmp_path: Path, ranks: int, checkpoint: str
) -> None:
    saves = sorted((reference / "data").glob("*.sav"))
    start = {"first": 0, "middle": len(saves) // 2, "last": len(saves) - 2}[checkpoint]
    folder = tmp_path / "resumed"
    shutil.copytree(reference, folder)
    for path in saves[start + 1 :]:
        (folder / "data" / path.name).unlink()
    run(resident, folder, ranks, resume=True)
    assert_same_files(reference, folder)
