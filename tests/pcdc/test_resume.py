"""A script that was stopped goes on where it was, on any number of ranks, as if it had not been stopped."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.pcdc.test_whole import SCRIPTS, tables
from tests.property.workers import Resident


def start(resident, folder: Path, ranks: int = 1, *words: str):
    """The script in a folder of its own."""
    folder.mkdir(exist_ok=True)
    shutil.copy(SCRIPTS / "loop.sc", folder)
    return resident(ranks, "loop.sc", *words, cwd=folder, timeout=1200)


@pytest.fixture(scope="module")
def straight(resident: Resident, tmp_path_factory) -> tuple[Path, list[str]]:
    """The run that was not stopped, and what its script said."""
    folder = tmp_path_factory.mktemp("loop") / "one"
    done = start(resident, folder)
    assert done.returncode == 0, done.stderr
    assert "element-steps/s" in done.stdout and "closing error" in done.stdout
    return folder, said(done.stdout)


def said(text: str) -> list[str]:
    """What the script printed."""
    return [line for line in text.splitlines() if line.startswith(("step ", "last ")) and "|" not in line]


def stopped(resident, folder: Path, ranks: int = 1) -> list[str]:
    """A run that stops itself in the fourth turn of its loop; what its script said."""
    folder.mkdir()
    (folder / "stop").touch()
    done = start(resident, folder, ranks)
    assert done.returncode == 85 and "resume with --resume" in done.stderr, done.stderr
    (folder / "stop").unlink()
    (path,) = (folder / "data").glob("*.sav")
    assert 450 < int(path.stem) < 600
    assert json.loads((folder / "data" / "run.json").read_text())["state"] == "stopped"
    return said(done.stdout)


def check_equal(one: Path, other: Path) -> None:
    assert tables(one / "end.sav") == tables(other / "end.sav")
    files = sorted(path.name for path in (one / "data").iterdir() if path.suffix in (".csv", ".vtkhdf"))
    assert len(files) >= 8
    assert files == sorted(path.name for path in (other / "data").iterdir() if path.suffix in (".csv", ".vtkhdf"))
    for name in files:
        if name.endswith(".csv"):
            assert (one / "data" / name).read_bytes() == (other / "data" / name).read_bytes(), name
        else:
            assert tables(one / "data" / name) == tables(other / "data" / name), name


def test_it_continues_as_if_nothing_had_happened(resident, straight, tmp_path):
    folder, lines = straight
    before = stopped(resident, tmp_path / "a")
    again = start(resident, tmp_path / "a", 1, "--resume")
    assert again.returncode == 0, again.stderr
    assert before + said(again.stdout) == lines  # no line twice: what was printed before is not printed again
    check_equal(folder, tmp_path / "a")
    assert "nothing to resume" in resident(1, "resume", "data", cwd=tmp_path / "a").stdout


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize(("before", "after"), [(1, 2), (2, 3), (3, 1)])
def test_on_another_number_of_ranks(resident, straight, tmp_path, before, after):
    folder, lines = straight
    first = stopped(resident, tmp_path / "a", before)
    again = resident(after, "resume", "data", cwd=tmp_path / "a", timeout=1200)
    assert again.returncode == 0, again.stderr
    assert first + said(again.stdout) == lines
    check_equal(folder, tmp_path / "a")


def test_a_changed_script_is_refused_and_a_damaged_checkpoint_passed_over(resident, tmp_path):
    folder = tmp_path / "a"
    stopped(resident, folder)
    script = folder / "loop.sc"
    text = script.read_text()
    script.write_text(text.replace("model step 150", "model step 140"))
    done = resident(1, "loop.sc", "--resume", cwd=folder)
    assert done.returncode == 2 and "loop.sc:19: pcdc model step 140: another line, or other values" in done.stderr
    script.unlink()
    done = resident(1, "resume", "data", cwd=folder)
    assert done.returncode == 2 and "PCDC scripts are never executed from a checkpoint" in done.stderr
    script.write_text(text)
    (path,) = (folder / "data").glob("*.sav")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    done = resident(1, "loop.sc", "--resume", "--time-limit", "0:00:00.001", cwd=folder)
    assert "is damaged" in done.stdout and "starting at the beginning" in done.stdout


def test_without_a_checkpoint_it_starts_at_the_beginning(resident, straight, tmp_path):
    done = start(resident, tmp_path / "a", 1, "--resume", "--no-figure")
    assert done.returncode == 0 and "starting at the beginning" in done.stdout and said(done.stdout) == straight[1]


def test_a_time_limit_stops_it(launch, resident, straight, tmp_path):
    folder, lines = straight
    done = start(resident, tmp_path / "a", 1, "--time-limit", "0.001")
    assert done.returncode == 85 and "by the time limit" in done.stderr, done.stderr
    told = launch(1, "info", "data", *(str(p) for p in (tmp_path / "a" / "data").glob("*.sav")), cwd=tmp_path / "a")
    assert told.returncode == 0, told.stdout
    # Joints of 8 x 2 squares: 8 along, 7 x 2 across, 16 diagonals.
    facts = {line.split()[0]: line.split(maxsplit=1)[1] for line in told.stdout.splitlines() if line.startswith("  ")}
    assert facts["elements"] == "32" and facts["joints"] == "38" and facts["broken"] == "0"
    assert facts["at"] == "line 19: pcdc model step 150" and facts["histories"] == "load; kinetic"
    assert facts["names"] == "m_L; m_v" and "hpcdem resume data" in told.stdout
    again = start(resident, tmp_path / "a", 1, "--resume", "--no-figure")
    assert again.returncode == 0 and said(done.stdout) + said(again.stdout) == lines
    check_equal(folder, tmp_path / "a")


def test_checkpoints_that_nobody_asked_for(resident, straight, tmp_path):
    folder, _ = straight
    done = start(resident, tmp_path / "a", 1, "--autosave", "0.001", "--no-figure")
    assert done.returncode == 0 and "written automatically" in done.stdout
    assert 1 <= len(list((tmp_path / "a" / "data").glob("auto_*.sav"))) <= 2
    check_equal(folder, tmp_path / "a")
    (tmp_path / "a" / "end.sav").unlink()
    again = start(resident, tmp_path / "a", 1, "--resume", "--no-figure")
    assert again.returncode == 0 and "resuming from" in again.stdout
    check_equal(folder, tmp_path / "a")


def test_what_is_for_particles_only_is_refused(resident, tmp_path):
    done = start(resident, tmp_path / "a", 1, "--check-reproducible", "10")
    assert done.returncode == 2 and "--check-reproducible supports models of particles only" in done.stderr
    assert not (tmp_path / "a" / "data").exists()


def test_two_runs_do_not_write_into_one_folder(launch, tmp_path):
    from hpcdem.io.lock import FolderLock

    (tmp_path / "a" / "data").mkdir(parents=True)
    lock = FolderLock(tmp_path / "a" / "data", {"script": "other.sc", "host": "here", "pid": 1, "began": "now"})
    try:
        done = start(launch, tmp_path / "a")
        assert done.returncode == 2 and "another run is writing into data: other.sc" in done.stderr
    finally:
        lock.release()
    assert [path.name for path in (tmp_path / "a" / "data").iterdir() if path.suffix] == []


CATCHES = """\
import os, signal
pcdc mesh structured (0,0) (2,1) cells 4 2
pcdc element c-model mech-iso-e property density 2500 young 5e9 poisson-r 0.25
pcdc node initial velocity (1,0)
if os.path.exists('stop'):
    os.kill(os.getpid(), signal.SIGTERM)
try:
    pcdc model step 400
except CLAUSE:
    print('caught')
QUESTION
pcdc model save 'end.sav'
pcdc model new
pcdc mesh structured (0,0) (1,1) cells 2 2
pcdc element c-model mech-iso-e property density 2500 young 5e9 poisson-r 0.25
pcdc model step 300
"""


@pytest.mark.parametrize("clause", ["Exception", "BaseException", "the end", "exit"])
def test_a_script_cannot_catch_the_stop(resident, tmp_path, clause):
    """`except Exception` lets it pass; what catches more meets it again at the next command or question, or at the end
    of the script. Nothing is written after the checkpoint, from which the run goes on."""
    question = {"Exception": "", "BaseException": "print(pcdc.time)", "exit": "raise SystemExit(0)"}.get(clause, "")
    script = CATCHES.replace("CLAUSE", clause if clause == "Exception" else "BaseException")
    script = script.replace("QUESTION", "if os.path.exists('stop'):\n    " + (question or "pass"))
    if clause == "the end":
        script = script[: script.index("pcdc model save")] + "print('over')\n"
    (tmp_path / "a.sc").write_text(script)
    (tmp_path / "stop").touch()
    done = resident(1, "a.sc", "--no-figure", cwd=tmp_path)
    assert done.returncode == 85 and "resume with --resume" in done.stderr, done.stdout + done.stderr
    assert ("caught" in done.stdout) == (clause != "Exception") and ("over" in done.stdout) == (clause == "the end")
    (path,) = (tmp_path / "data").glob("*.sav")
    assert 0 < int(path.stem) < 400 and not (tmp_path / "end.sav").exists()
    assert json.loads((tmp_path / "data" / "run.json").read_text())["state"] == "stopped"
    (tmp_path / "stop").unlink()
    again = resident(1, "a.sc", "--no-figure", "--resume", cwd=tmp_path)
    assert again.returncode == 0 and "caught" not in again.stdout, again.stderr
