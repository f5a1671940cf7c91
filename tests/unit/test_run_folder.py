"""The folder of a run: its lock, run.json, which checkpoints count and which are removed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.halo.comm import SerialComm
from hpcdem.io.lock import FolderLock, Taken, holder_of
from hpcdem.runtime import run_folder
from hpcdem.runtime.run_folder import Job

COMM = SerialComm()
JOB = Job("push.py", "zdem")
HOLD = """
import sys, time
from pathlib import Path
from hpcdem.io.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]), {"pid": 1, "host": "desk", "script": "other.py"})
print("held", flush=True)
time.sleep(60)
"""


@pytest.fixture(autouse=True)
def free():
    yield
    run_folder.release_all()


@pytest.fixture
def other_run(tmp_path):
    """A process that holds the lock of tmp_path."""
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        yield process
        process.kill()


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).write_bytes(b"")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*.sav"))


def enter(folder: Path, resumed: bool = False) -> None:
    assert run_folder.enter(folder, COMM, JOB, "1.0", resumed)


# -- lock ----------------------------------------------------------------------------------------------------------


def test_a_second_run_is_refused_and_told_by_whom(tmp_path, other_run):
    with pytest.raises(UsageError, match=r"another run is writing into .*other\.py, process 1 on desk"):
        run_folder.claim(tmp_path, COMM, JOB)
    assert not (tmp_path / "run.json").exists()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_dead_run_leaves_no_lock(tmp_path, other_run, number):
    other_run.send_signal(number)
    other_run.wait()
    assert (tmp_path / ".lock").exists(), "the file stays, and means nothing"
    assert holder_of(tmp_path) is None
    assert run_folder.claim(tmp_path, COMM, JOB)


def test_one_program_may_write_twice_into_a_folder(tmp_path):
    enter(tmp_path)
    enter(tmp_path)


def test_a_lock_is_given_back(tmp_path):
    lock = FolderLock(tmp_path, {"pid": 2})
    assert holder_of(tmp_path) == {"pid": 2}
    with pytest.raises(Taken):
        FolderLock(tmp_path, {})
    lock.release()
    assert not (tmp_path / ".lock").exists() and holder_of(tmp_path) is None
    FolderLock(tmp_path, {}).release()


def test_the_lock_file_may_vanish_under_a_run(tmp_path):
    """Somebody deletes it: the next run makes a new one; the old holder does not remove that."""
    first = FolderLock(tmp_path, {"pid": 1})
    os.unlink(tmp_path / ".lock")
    second = FolderLock(tmp_path, {"pid": 2})
    first.release()
    assert holder_of(tmp_path) == {"pid": 2}
    second.release()


def test_a_link_is_not_followed(tmp_path):
    (tmp_path / "precious").write_text("text")
    (tmp_path / ".lock").symlink_to(tmp_path / "precious")
    with pytest.raises(OSError):
        FolderLock(tmp_path, {})
    assert (tmp_path / "precious").read_text() == "text"


def test_a_folder_that_is_not_there_is_free(tmp_path):
    assert run_folder.claim(tmp_path / "data", COMM, JOB) and not (tmp_path / "data").exists()


# -- run.json ------------------------------------------------------------------------------------------------------


def test_the_record_comes_back(tmp_path):
    enter(tmp_path)
    run_folder.leave(tmp_path, COMM, "stopped", 700)
    record = run_folder.read(tmp_path)
    assert record is not None
    assert (record.script, record.language, record.ranks) == (str(Path("push.py").resolve()), "zdem", 1)
    assert (record.state, record.step, record.version) == ("stopped", 700, "1.0")


@pytest.mark.parametrize("text", ["", "{", "[]", '{"step": "x"}', '{"older": 3}', "null"])
def test_a_damaged_record_is_named(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(HpcdemError, match=r"run\.json is damaged"):
        run_folder.read(tmp_path)


def test_what_is_not_known_is_passed_over(tmp_path):
    (tmp_path / "run.json").write_text(json.dumps({"script": "a.py", "colour": "red"}))
    record = run_folder.read(tmp_path)
    assert record is not None and record.script == "a.py"


def test_checkpoints_of_an_earlier_run_do_not_count(tmp_path):
    touch(tmp_path, "0000005000.sav", "0000006000.sav")
    enter(tmp_path)
    record = run_folder.read(tmp_path)
    assert run_folder.is_older(tmp_path / "0000005000.sav", record)
    (tmp_path / "0000005000.sav").write_bytes(b"written again")
    assert not run_folder.is_older(tmp_path / "0000005000.sav", record)
    assert not run_folder.is_older(tmp_path / "0000001000.sav", record)


def test_a_resumed_run_knows_the_same_older_files(tmp_path):
    touch(tmp_path, "0000005000.sav")
    enter(tmp_path)
    before = run_folder.read(tmp_path)
    touch(tmp_path, "0000001000.sav")
    enter(tmp_path, resumed=True)
    after = run_folder.read(tmp_path)
    assert before is not None and after is not None and after.older == before.older


# -- rotation ------------------------------------------------------------------------------------------------------


def test_the_last_few_are_kept(tmp_path):
    touch(tmp_path, "0000009000.sav")
    enter(tmp_path)
    touch(tmp_path, *(f"{step:010d}.sav" for step in (1000, 2000, 3000, 4000)), "mine.sav", "0000000500.sav.tmp")
    run_folder.retire(tmp_path, COMM, 4000, keep=2)
    assert names(tmp_path) == ["0000003000.sav", "0000004000.sav", "0000009000.sav", "mine.sav"]
    run_folder.retire(tmp_path, COMM, 4000, keep=0)
    assert len(names(tmp_path)) == 4


def test_two_automatic_ones_are_kept_until_a_numbered_one_follows(tmp_path):
    enter(tmp_path)
    touch(tmp_path, *(f"auto_{step:010d}.sav" for step in (100, 200, 300)))
    run_folder.retire(tmp_path, COMM, 300, keep=0)
    assert names(tmp_path) == ["auto_0000000200.sav", "auto_0000000300.sav"]
    touch(tmp_path, "0000000250.sav")
    run_folder.retire(tmp_path, COMM, 300, keep=0)
    assert names(tmp_path) == ["0000000250.sav", "auto_0000000300.sav"]


def test_what_cannot_be_removed_stays(tmp_path):
    enter(tmp_path)
    (tmp_path / "0000000001.sav").mkdir()
    touch(tmp_path, "0000000002.sav")
    run_folder.retire(tmp_path, COMM, 2, keep=1)
    assert (tmp_path / "0000000002.sav").exists()


def test_waiting_for_nobody(tmp_path, other_run):
    """A refusal comes at once."""
    began = time.monotonic()
    with pytest.raises(UsageError):
        enter(tmp_path)
    assert time.monotonic() - began < 1.0
