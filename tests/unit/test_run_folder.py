"""The folder of a run: its lock, run.json, which checkpoints count and which are removed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.lock import FolderLock, Taken, holder_of
from hpcdem.runtime import run_folder
from hpcdem.runtime.run_folder import Job, Retention

STEPS = range(100, 1401, 100)
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


def test_a_lock_is_released(tmp_path):
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
    run_folder.retire(tmp_path, COMM, 4000, Retention(2))
    assert names(tmp_path) == ["0000003000.sav", "0000004000.sav", "0000009000.sav", "mine.sav"]
    run_folder.retire(tmp_path, COMM, 4000, Retention())
    assert len(names(tmp_path)) == 4


@pytest.mark.parametrize(
    ("keep", "stay"),
    [
        (Retention(1), [1400]),
        (Retention(2), [1300, 1400]),
        (Retention(1, steps=500), [500, 1000, 1400]),
        (Retention(1, steps=350), [300, 700, 1000, 1400]),
        (Retention(1, period=0.2), [*range(200, 801, 200), *range(900, 1401, 100)]),  # 0.2 s are 100 steps from 800 on
        (Retention(1, period=0.7), [700, 1100, 1400]),
        (Retention(1, times=(0.25, 0.9)), [200, 800, 1400]),
        (Retention(1, times=(99.0,)), [1400]),
        (Retention(1, 500, 0.7, (0.25,)), [200, 500, 700, 1000, 1100, 1400]),
    ],
)
def test_old_ones_are_spared_by_step_and_by_time(tmp_path, monkeypatch, keep, stay):
    """A checkpoint each 100 steps, 1 ms a step, from step 800 on 2 ms. What stays does not depend on what is removed
    first: after each one in turn, or all at once."""
    time = {step: sum(1e-3 for _ in range(step)) + sum(1e-3 for _ in range(max(step - 800, 0))) for step in STEPS}
    monkeypatch.setattr(run_folder, "_time_of", lambda path, stamp: time[int(path.stem)])
    all_at_once = tmp_path / "once"
    for folder in (tmp_path, all_at_once):
        folder.mkdir(exist_ok=True)
        enter(folder)
        for step in STEPS:
            touch(folder, f"{step:010d}.sav")
            if folder == tmp_path or step == STEPS[-1]:
                run_folder.retire(folder, COMM, step, keep)
        assert [int(name.split(".")[0]) for name in names(folder)] == stay


def test_automatic_ones_are_spared_as_well(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "_time_of", lambda path, stamp: 1e-3 * int(path.stem.removeprefix("auto_")))
    enter(tmp_path)
    touch(tmp_path, *(f"auto_{step:010d}.sav" for step in (100, 250, 400, 500)), "0000000300.sav")
    run_folder.retire(tmp_path, COMM, 500, Retention(times=(0.26,)))
    assert names(tmp_path) == ["0000000300.sav", *(f"auto_{step:010d}.sav" for step in (250, 400, 500))]
    run_folder.retire(tmp_path, COMM, 500, Retention(1, period=0.3))
    assert names(tmp_path) == ["0000000300.sav", *(f"auto_{step:010d}.sav" for step in (400, 500))]


def test_going_back_sets_aside_what_came_later(tmp_path):
    """Later checkpoints and frames count no more, unless they are written again."""
    enter(tmp_path)
    touch(tmp_path, *(f"{step:010d}.sav" for step in (100, 200, 300)))
    touch(tmp_path, *(f"all_{step:010d}.dat" for step in (150, 200, 250)))
    run_folder.set_aside(tmp_path, [tmp_path / "0000000300.sav"], 200)
    record = run_folder.read(tmp_path)
    assert record is not None and sorted(record.older) == ["0000000300.sav", "all_0000000250.dat"]
    assert run_folder.is_older(tmp_path / "0000000300.sav", record)
    (tmp_path / "0000000300.sav").write_bytes(b"again")
    assert not run_folder.is_older(tmp_path / "0000000300.sav", record)


def test_two_automatic_ones_are_kept_until_a_numbered_one_follows(tmp_path):
    enter(tmp_path)
    touch(tmp_path, *(f"auto_{step:010d}.sav" for step in (100, 200, 300)))
    run_folder.retire(tmp_path, COMM, 300, Retention())
    assert names(tmp_path) == ["auto_0000000200.sav", "auto_0000000300.sav"]
    touch(tmp_path, "0000000250.sav")
    run_folder.retire(tmp_path, COMM, 300, Retention())
    assert names(tmp_path) == ["0000000250.sav", "auto_0000000300.sav"]


def test_what_cannot_be_removed_stays(tmp_path):
    enter(tmp_path)
    (tmp_path / "0000000001.sav").mkdir()
    touch(tmp_path, "0000000002.sav")
    run_folder.retire(tmp_path, COMM, 2, Retention(1))
    assert (tmp_path / "0000000002.sav").exists()


@pytest.mark.parametrize("name", ["file", "file/below", "file/far/below", "link", "link/below"])
def test_what_cannot_become_a_folder_is_refused(tmp_path, name):
    (tmp_path / "file").write_text("a result of mine")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(UsageError, match=rf"cannot make the folder .*{name} for the results: .*(a file|a broken link)"):
        run_folder.claim(tmp_path / name, COMM, JOB)
    assert (tmp_path / "file").read_text() == "a result of mine" and not (tmp_path / "nowhere").exists()
    assert run_folder.claim(tmp_path / "new" / "below", COMM, JOB)


def test_waiting_for_nobody(tmp_path, other_run):
    """A refusal comes while the other run is there."""
    with pytest.raises(UsageError):
        enter(tmp_path)
    assert other_run.poll() is None
