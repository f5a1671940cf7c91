"""The energy budget and the fingerprints of states: the same on any number of ranks and threads and across a restart,
and a state that was changed is found."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from tests.property.workers import Resident
from tests.short_push import SHORT_PUSH, contents

STEPS = 100
CHANGES = """\
DEL range id 20 30
PROP xv 3.0 range id 0 10
PROP shear 2.9e5 yv 200.0 range y {top}-100.0, {top}
BOX left 0.0 right 4200.0 bottom 0.0 height 2700.0
CYC 60
STOP"""
SCRIPT = (
    SHORT_PUSH.format(steps=STEPS)
    .replace("SET DT 5e-2", "SET energy 25 damp lsm 1e6\nHIST id 1 interval 50 energy\nSET DT 5e-2")
    .replace("CYC 400", "CYC 100")
    .replace("save 100", "save 70")
    .replace("STOP", CHANGES)
)


def states(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("state ")]


def run(resident: Resident, folder: Path, ranks: int, *options: object, code: int = 0, script: str = SCRIPT) -> str:
    """The log of the model in a folder."""
    folder.mkdir(exist_ok=True)
    (folder / "model.py").write_text(script)
    done = resident(ranks, "model.py", "--no-figure", "--check-reproducible", 20, *options, cwd=folder)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def one(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and log of the run on one rank and one thread."""
    folder = tmp_path_factory.mktemp("energy") / "one"
    log = run(resident, folder, 1)
    (folder / "log.txt").write_text(log)
    return folder, log


def test_the_log_reports(one: tuple[Path, str]) -> None:
    folder, log = one
    assert [int(line.split()[1].rstrip(":")) for line in states(log)] == list(range(20, 261, 20))
    assert len(set(states(log))) == len(states(log))
    assert "energy budget" in log and "closing error" in log
    assert "particles in total left the BOX and were deleted" in log and "velocity (" in log
    rows = list(csv.DictReader((folder / "data/energy.csv").read_text().splitlines()))
    assert len(rows) == 1 + 260 // 25
    assert float(rows[-1]["box"]) < 0.0 < float(rows[-1]["commands"]) and float(rows[-1]["work_walls"]) != 0.0
    assert abs(float(rows[-1]["relative"])) < 2e-3, "dt is large"


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("ranks", "threads"),
    [
        (2, 1),
        pytest.param(4, 1, marks=pytest.mark.slow),
        pytest.param(1, 3, marks=pytest.mark.slow),
        pytest.param(2, 2, marks=pytest.mark.slow),
    ],
)
def test_the_same_on_any_ranks_and_threads(
    one: tuple[Path, str], resident: Resident, tmp_path: Path, ranks: int, threads: int
) -> None:
    folder, log = one
    other = run(resident, tmp_path / "other", ranks, "-j", threads, "--against", folder / "log.txt")
    assert states(other) == states(log) and "13 states agree with" in other
    for name in ("energy.csv", "hist_1.csv", "hist_id_1.dat"):
        assert (tmp_path / "other/data" / name).read_bytes() == (folder / "data" / name).read_bytes()


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_the_same_across_a_restart(one: tuple[Path, str], resident: Resident, tmp_path: Path, ranks: int) -> None:
    """From the checkpoint in the middle of a CYC; the account is in it, whole."""
    folder, log = one
    resumed = tmp_path / "resumed"
    shutil.copytree(folder, resumed)
    saves = sorted((resumed / "data").glob("*.sav"))
    assert '"accounts"' in str(contents(saves[0])["@state"])
    for path in saves[1:]:
        path.unlink()
    again = run(resident, resumed, ranks, "--resume", "--against", folder / "log.txt")
    assert states(again) == [line for line in states(log) if int(line.split()[1].rstrip(":")) > 140]
    assert (resumed / "data/energy.csv").read_bytes() == (folder / "data/energy.csv").read_bytes()


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_a_changed_state_is_found_at_its_step(
    one: tuple[Path, str], resident: Resident, tmp_path: Path, ranks: int
) -> None:
    """Friction changed at step 100: particles that touch the wall with friction feel it within the next 20 steps."""
    folder, log = one
    script = SCRIPT.replace("tstrength 2e7 sstrength 4e7 fric 0.3", "tstrength 2e7 sstrength 4e7 fric 0.30000001")
    script = script.replace("WALL id 1 xv 2.0", "WALL id 1 xv 2.0000001")
    other = run(resident, tmp_path / "other", ranks, "--against", folder / "log.txt", code=1, script=script)
    assert "step 120 is the first that differs" in other
    assert states(other) == [line for line in states(log)[:5]] + states(other)[5:] and len(states(other)) == 6


def test_options_that_do_not_fit(resident: Resident, tmp_path: Path) -> None:
    (tmp_path / "model.py").write_text("START\nSTOP\n")
    for words, said in (
        (("--against", "log.txt"), "--against LOG needs --check-reproducible N"),
        (("--check-reproducible", "20", "--against", "log.txt"), "cannot read it"),
        (("--check-reproducible", "0"), "--check-reproducible"),
    ):
        done = resident(1, "model.py", *words, cwd=tmp_path)
        assert done.returncode == 2 and said in done.stderr + done.stdout
