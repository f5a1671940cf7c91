"""The same bits on any number of ranks and threads, with moving borders and without, and across a restart.

The model does everything that could spoil the order: particles fall, bonds break, the wall pushes them across borders,
some are eroded away, others rain down in mid-run.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files, contents

BUSY = """\
START
SET disk off
BOX left 0.0 right 7000.0 bottom 0.0 height 4000.0
WALL id 0 nodes (0.0, 50.0) (6500.0, 50.0)
WALL id 1 nodes (50.0, 3900.0) (50.0, 50.0)
WALL id 2 nodes (6500.0, 50.0) (6500.0, 1400.0)
GEN num 3000 rad discrete 50.0 70.0 x (50.0, 6500.0) y (50.0, 3000.0) group bed
PROP density 2.5e3 fric 0.0 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8
SET print 400
SET save 500
HIST id 1 interval 100 kinetic
CYC 500
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3
WALL id 0 fric 0.3
WALL id 1 fric 0.3 xv 8.0
IMPLE wall id 1 xmove 160.0 save 64.0 print 80.0
DEL range y {top}-300.0 {top}
GEN num 200 rad discrete 50.0 60.0 x (1500.0, 6000.0) y (1800.0, 3600.0) color red group rain
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group rain
CYC 700
PROP n_bond 1e11 s_bond 1e11 range group rain
BOND break range x 0.0 1500.0
IMPLE wall id 1 xmove 80.0 save 32.0
STOP
"""


def busy(resident: Resident, folder: Path, ranks: int, *options: str, resume: bool = False) -> None:
    """Run the model in a folder."""
    folder.mkdir(exist_ok=True)
    script = folder / "busy.py"
    script.write_text(BUSY)
    done = resident(ranks, script, "--no-figure", *options, *(["--resume"] if resume else []), cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def reference(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run on one rank and one thread."""
    folder = tmp_path_factory.mktemp("busy") / "one"
    busy(resident, folder, 1)
    return folder


def test_the_model_is_busy(reference: Path) -> None:
    """The run is worth comparing: bonds broke both ways, particles came and went."""
    last = sorted((reference / "data").glob("*.sav"))[-1]
    state = contents(last)
    text = str(state["@state"])
    tension, shear = (int(n) for n in text.split('"breaks": [')[1].split("]")[0].split(","))
    assert tension > 20 and shear > 20
    assert len(state["particles/gid"]) < int(text.split('"next_gid": ')[1].split(",")[0])
    assert (state["particles/birth"] > 0).any()


@pytest.mark.mpi
@pytest.mark.parametrize("case", layouts(("3 ranks, borders stay",)))
def test_same_files_however_it_is_run(reference: Path, resident: Resident, tmp_path: Path, case: str) -> None:
    ranks, options = LAYOUTS[case]
    busy(resident, tmp_path / "other", ranks, *options)
    assert_same_files(reference, tmp_path / "other")


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("checkpoint", "ranks"),
    [
        ("first", 2),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (("middle", 1), ("middle", 3), ("last", 2))),
    ],
)
def test_resumed_run_equals_the_uninterrupted_one(
    reference: Path, resident: Resident, tmp_path: Path, ranks: int, checkpoint: str
) -> None:
    """A run that was killed some time after a checkpoint, and goes on from there with another number of ranks: every
    file, time series too, is as if nothing had happened."""
    saves = sorted((reference / "data").glob("*.sav"))
    start = {"first": 0, "middle": len(saves) // 2, "last": len(saves) - 2}[checkpoint]
    folder = tmp_path / "resumed"
    shutil.copytree(reference, folder)
    for path in saves[start + 1 :]:
        (folder / "data" / path.name).unlink()
    busy(resident, folder, ranks, resume=True)
    assert_same_files(reference, folder)
