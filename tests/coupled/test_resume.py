"""A script of particles and blocks that was stopped goes on as if it had not been stopped, on any number of ranks,
though it asked the particles for its way."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from tests.pcdc.test_whole import tables
from tests.property.workers import Resident

SCRIPT = Path(__file__).parent / "fall.sc"
APART = ("run.json", "progress.json", ".lock", "stop", "peep")
"""Files that tell of the run, not of the model."""


def start(resident, folder: Path, ranks: int, *words: str):
    folder.mkdir(exist_ok=True)
    shutil.copy(SCRIPT, folder)
    return resident(ranks, SCRIPT.name, "--no-figure", *words, cwd=folder)


def said(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("turn")]


def stopped(resident, folder: Path, ranks: int) -> list[str]:
    """A run that is sent SIGTERM in the sixth of its eight turns; what its script said."""
    folder.mkdir()
    (folder / "stop").touch()
    done = start(resident, folder, ranks)
    assert done.returncode == 85 and "resume with --resume" in done.stderr, done.stderr
    (folder / "stop").unlink()
    return said(done.stdout)


@pytest.fixture(scope="module")
def straight(resident: Resident, tmp_path_factory) -> tuple[Path, list[str]]:
    """The run that was not stopped, and what its script said."""
    folder = tmp_path_factory.mktemp("fall") / "one"
    done = start(resident, folder, 1)
    assert done.returncode == 0, done.stderr
    lines = said(done.stdout)
    assert len(lines) == 10 and " 40 steps" in lines[0] and " 60 steps" in lines[-2] and "discs are gone" in lines[2]
    return folder, lines


@pytest.fixture(scope="module")
def halted(resident: Resident, tmp_path_factory) -> tuple[Path, list[str]]:
    """The run that was stopped, on one rank, and what its script said."""
    folder = tmp_path_factory.mktemp("fall") / "halted"
    return folder, stopped(resident, folder, 1)


def assert_alike(one: Path, other: Path) -> None:
    """The same files with the same content, but for checkpoints on request."""
    names = {path.relative_to(one) for path in one.rglob("*") if path.is_file() and path.name not in APART}
    assert {path.relative_to(other) for path in other.rglob("*.*") if path.suffix != ".sav"} >= {
        name for name in names if name.suffix != ".sav"
    }
    for name in sorted(names):
        if name.suffix in (".vtkhdf", ".sav"):
            if name.parts[0] != "data" or name.suffix != ".sav":  # these tell how long they took
                assert tables(other / name) == tables(one / name), name
        else:
            assert (other / name).read_bytes() == (one / name).read_bytes(), name


@pytest.mark.mpi
@pytest.mark.parametrize(
    "before, after",
    [(1, 2), *(pytest.param(*ranks, marks=pytest.mark.slow) for ranks in ((1, 3), (3, 1), (2, 4)))],
)
def test_it_continues_on_other_ranks(resident, straight, tmp_path, before, after):
    folder, lines = straight
    first = stopped(resident, tmp_path / "a", before)
    assert 0 < len(first) < len(lines)
    again = start(resident, tmp_path / "a", after, "--resume")
    assert again.returncode == 0, again.stderr
    assert first + said(again.stdout) == lines
    assert_alike(folder, tmp_path / "a")


def test_all_that_particles_write_is_there(straight):
    """Of a run of both: frames in all formats, the state before the first step and after commands of the script, series
    and what PLOT makes of them, rows of walls, checkpoints; and of the blocks as alone."""
    folder, _ = straight
    sand = {path.name for path in (folder / "sand").iterdir()}
    last = 630

    def steps(pattern: str) -> list[int]:
        found = sorted((folder / "sand").glob(pattern))
        return [int(path.name.split("_")[1].split(".")[0]) for path in found]

    for pattern, every in (("all_*[0-9].vtkhdf", 100), ("all_*[0-9].dat", 100), ("all_*.vtk", 170), ("all_*.ps", 150)):
        assert steps(pattern) == [k for k in range(201, last) if k % every == 0], pattern
    assert steps("wall_*.vtk") == steps("all_*.vtk")
    assert steps("all_*_ini.vtkhdf") == [0, 200, 360]  # of CYC, the first of both, the one after prop and delete
    assert {"walls.csv", "energy.csv", "hist_1.csv", "hist_id_2.dat", "hist_1_vs_2.txt"} <= sand
    for name, every in (("hist_1.csv", 25), ("hist_2.csv", 25)):
        rows = np.loadtxt(folder / "sand" / name, delimiter=",", skiprows=1)
        assert rows[:, 0].tolist() == [k for k in range(201, last + 1) if k % every == 0], name
    walls = np.genfromtxt(folder / "sand" / "walls.csv", delimiter=",", names=True)
    # Every 40 steps from the beginning of a command on, and at its end; one ends early.
    rows = [200, 240, 280, 300, 340, 360, 400, 420, 450, 490, 510, 550, 570, 610, 630]
    assert walls["step"].tolist() == [step for step in rows for _ in range(4)]
    assert sorted(path.name for path in (folder / "data").glob("*.sav")) == [
        f"{k - 200:010d}.sav" for k in range(201, last + 1) if k % 70 == 0
    ]


CHANGES = {
    "before couple": ("sand.gen_grid([0.04]", "sand.gen_grid([0.039]", "gen_grid"),
    "set": ("dt=2e-5, seed=2", "dt=2e-5, seed=3", "seed"),
    "couple": ("hpcdem.couple(sand)", "hpcdem.couple(sand, friction=0.3)", "couple"),
    "couple dt": ("hpcdem.couple(sand)", "hpcdem.couple(sand, dt=2e-5)", "couple"),
    "between": ("sand.prop(damp=0.0)", "sand.prop(damp=0.1)", "damp"),
    "within": ("fric=0.1 * len(called)", "fric=0.2 * len(called)", "fric"),
    "every": ("sand.every(30", "sand.every(31", "every"),
    "question": ("sand.gather('y').max()", "sand.gather('x').max()", "gather"),
    "left out": ("sand.hist(2, 25, 'contacts')\n", "", "plot"),
    "folder": ("outdir='sand'", "outdir='other'", "Simulation"),
}
"""What is changed in the script, into what, and a word of the line at which that is found."""


@pytest.mark.parametrize("change", [pytest.param(c, marks=() if k % 3 == 2 else pytest.mark.slow)
                                    for k, c in enumerate(CHANGES)])  # fmt: skip
def test_a_changed_call_is_refused_at_its_line(resident, halted, tmp_path, change):
    """Nothing that is there is written again."""
    old, new, word = CHANGES[change]
    folder = tmp_path / "a"
    shutil.copytree(halted[0], folder)
    text = (folder / SCRIPT.name).read_text()
    assert text.count(old) == 1
    text = text.replace(old, new)
    (folder / SCRIPT.name).write_text(text)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name not in APART}
    done = resident(1, SCRIPT.name, "--no-figure", "--resume", cwd=folder)
    assert done.returncode == 2, done.stdout + done.stderr
    line = next(k for k, row in enumerate(text.splitlines(), 1) if word in row and (new.strip() in row or not new))
    assert f"fall.sc:{line}: " in done.stderr and "another call, or other values, were" in done.stderr
    assert {path: path.read_bytes() for path in before} == before


@pytest.mark.mpi
def test_what_one_of_several_ranks_saw_cannot_be_asked_again(resident, tmp_path):
    """A clear end at that line, no wrong values; the first run says beforehand that it will be so. What a rank saw that
    was alone can."""
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "peep").touch()
        (folder / "stop").touch()
        done = start(resident, folder, ranks)
        assert done.returncode == 85
        assert done.stdout.count("--resume cannot execute this line; use gather") == ranks - 1
        (folder / "stop").unlink()
        again = start(resident, folder, 3 - ranks, "--resume")
        if ranks == 1:
            assert again.returncode == 0, again.stdout + again.stderr
            continue
        assert again.returncode == 2, again.stdout + again.stderr
        line = 1 + SCRIPT.read_text().splitlines().index("        peep = sand['x']")
        assert f"fall.sc:{line}: ['x']: the checkpoint does not record the particles of a single rank" in again.stderr
        assert "Use gather(...)" in again.stderr


OLD = """\
import hpcdem, os, signal
sand = hpcdem.Simulation(outdir='sand')
sand.set(disk='on', gravity=(0.0, -9.81), dt=2e-5, print=50)
sand.box(0.0, 1.0, 0.0, 1.5, kn=2e6, ks=1e6, fric=0.3)
sand.gen_grid([0.04], x=(0.0, 1.0), y=(0.0, 0.16))
sand.prop(density=2000.0, kn=2e6, ks=1e6, fric=0.4)
sand.cycle(20)
pcdc mesh structured (0.2,0.161) (0.8,0.361) cells 3 1
pcdc element c-model mech-iso-e property density 2600 young 1e8 poisson-r 0.25
pcdc node initial velocity (0.3,-3)
both = hpcdem.couple(sand)
for turn in range(3):
    if turn == 1 and os.path.exists('stop'):
        os.kill(os.getpid(), signal.SIGTERM)
    pcdc model step [60 if both.force()[1] > 0.0 else 50]
    sand.prop(fric=0.3)
pcdc model save 'end.sav'
"""


def test_a_checkpoint_without_calls(resident, tmp_path):
    """As earlier versions wrote it, which kept what a script asked, but not what it called: what stands before the two
    were coupled is done again."""
    for name in ("straight", "a"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "old.sc").write_text(OLD)
    (tmp_path / "a" / "stop").touch()
    assert resident(1, "old.sc", "--no-figure", cwd=tmp_path / "straight").returncode == 0
    assert resident(1, "old.sc", "--no-figure", cwd=tmp_path / "a").returncode == 85
    (tmp_path / "a" / "stop").unlink()
    (path,) = (tmp_path / "a" / "data").glob("*.sav")
    state, tables_there = checkpoint.read(path)
    run = state["extra"]["run"]
    del run["particles"]
    kept, coupled, asked = [], False, False
    for entry in run["journal"]:
        drop = entry[0] == "ask" or (asked and not coupled)
        # The first answer after all commands that make the blocks is that of couple.
        coupled = coupled or (asked and sum(one[0] == "command" for one in kept) == 3)
        kept += [] if drop else [entry]
        asked = entry[0] == "ask"
    assert coupled and kept[-1][0] == "command" and sum(one[0] == "look" for one in kept) == 3
    run["journal"] = kept
    slabs = {name: Table(columns, 0, len(next(iter(columns.values())))) for name, columns in tables_there.items()}
    checkpoint.write(path, state, slabs, SerialComm())
    again = resident(1, "old.sc", "--no-figure", "--resume", cwd=tmp_path / "a")
    assert again.returncode == 0, again.stderr
    assert again.stdout.count("CYC, 20 steps") == 1
    assert tables(tmp_path / "a" / "end.sav") == tables(tmp_path / "straight" / "end.sav")


SOON = """\
import hpcdem, os, signal, time
sand = hpcdem.Simulation(outdir='sand')
sand.set(disk='on', gravity=(0.0, -9.81), dt=2e-5, print=20)
sand.box(0.0, 1.0, 0.0, 1.5, kn=2e6, ks=1e6, fric=0.3)
sand.gen_grid([0.04], x=(0.0, 1.0), y=(0.0, 0.16))
sand.prop(density=2000.0, kn=2e6, ks=1e6, fric=0.4)
pcdc mesh structured (0.2,0.161) (0.8,0.361) cells 3 1
pcdc element c-model mech-iso-e property density 2600 young 1e8 poisson-r 0.25
pcdc output vtk 'block' every 20
both = hpcdem.couple(sand)
if os.path.exists('stop'):
    os.kill(os.getpid(), signal.SIGTERM)
pcdc node initial velocity (0.3,-3)
if os.path.exists('stop'):
    time.sleep(1.05)
pcdc model step 50
pcdc model save 'end.sav'
"""


def test_a_stop_before_the_first_step(resident, tmp_path):
    """Between two commands, before discs and blocks are stepped: the state before the first step is written once."""
    for name in ("straight", "a"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "soon.sc").write_text(SOON)
    assert resident(1, "soon.sc", "--no-figure", cwd=tmp_path / "straight").returncode == 0
    assert {"all_0000000000_ini.vtkhdf", "all_0000000000_ini.dat"} <= {
        path.name for path in (tmp_path / "straight" / "sand").iterdir()
    }
    (tmp_path / "a" / "stop").touch()
    done = resident(1, "soon.sc", "--no-figure", cwd=tmp_path / "a")
    assert done.returncode == 85 and "stopped at step 0" in done.stderr
    (tmp_path / "a" / "stop").unlink()
    again = resident(1, "soon.sc", "--no-figure", "--resume", cwd=tmp_path / "a")
    assert again.returncode == 0, again.stderr
    assert_alike(tmp_path / "straight", tmp_path / "a")
