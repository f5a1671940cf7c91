"""Whatever happens to a run: it ends within seconds, says why once, and its last checkpoint restarts exactly.

The undisturbed run is the measure: after any accident and `--resume`, on another rank count too, the last frame is
the same to the last byte.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import time
from pathlib import Path

import pytest

from hpcdem.io.lock import holder_of
from tests.conftest import PATIENCE, until
from tests.faults.conftest import LAST_FRAME, PILE

SLOW = pytest.mark.slow
AT_ONCE = "0.001"
"""A time limit [s] that is over before the first step."""


def checkpoints(folder) -> list[str]:
    return sorted(p.name for p in folder.glob("*.sav"))


def finish(resident, n, script, undisturbed, *options):
    """Resume on n ranks and compare the end; once the lock is free, as threads of a killed rank may outlive launcher
    and rank for a moment."""
    until(lambda: holder_of(script.parent / "data") is None, "the lock of the folder")
    done = resident(n, script, "--resume", "--no-figure", *options, cwd=script.parent)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "resuming from" in done.stdout
    folder = script.parent / (options[1] if options else "data")
    assert (folder / LAST_FRAME).read_bytes() == undisturbed
    return done


def end_of(process):
    """Output and exit code of a job that has been given its reason to end."""
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err


# -- accidents -----------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_one_rank_is_killed(launch, resident, script, undisturbed, wait_until, rank_process):
    """A temporary file may stay behind; it is neither taken for a checkpoint nor in the way."""
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    os.kill(rank_process(script.parent, 1), signal.SIGKILL)
    code, *_ = end_of(job)
    assert code != 0
    (data / "0000005999.sav.tmp").write_bytes(b"half a file")
    finish(resident, 1, script, undisturbed)


@SLOW
@pytest.mark.mpi
def test_all_ranks_are_killed_while_they_write(launch, resident, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    for rank in (0, 1):
        os.kill(rank_process(script.parent, rank), signal.SIGKILL)
    code, *_ = end_of(job)
    assert code != 0
    (data / "0000005999.sav.tmp").write_bytes(b"half a file")
    finish(resident, 2, script, undisturbed)


@pytest.mark.parametrize("n", [1, pytest.param(3, marks=pytest.mark.mpi)])
def test_a_bad_word_on_line_17(resident, script, n):
    script.write_text(PILE.replace("IMPLE wall", "IMPEL wall"))
    done = resident(n, script.name, cwd=script.parent)
    assert done.returncode == 2
    assert done.stderr.count("pile.py:17:") == 1 and "IMPEL" in done.stderr
    assert not (script.parent / "data").exists()


@pytest.mark.parametrize("n", [pytest.param(1, marks=SLOW), pytest.param(2, marks=pytest.mark.mpi)])
def test_the_disk_is_full(resident, script, undisturbed, small_disk, n):
    disk = small_disk("1m")
    done = resident(n, script, "--no-figure", "--outdir", disk, cwd=script.parent, timeout=120)
    assert done.returncode == 1
    assert done.stderr.count("no space left on the disk") == 1 and "Traceback" not in done.stderr
    assert checkpoints(disk) and not list(disk.glob("*.tmp"))
    small_disk("64m")
    finish(resident, n, script, undisturbed, "--outdir", disk)


@pytest.mark.parametrize("n", [1, pytest.param(3, marks=pytest.mark.mpi)])
def test_the_output_folder_cannot_be_made(resident, script, n):
    """Which is told before anything runs, with --check too."""
    (script.parent / "data").write_text("a file has the name of the folder")
    for more in ([], ["--check"] * (n == 1)):
        done = resident(n, script, *more, cwd=script.parent)
        assert done.returncode == 2 and "step" not in done.stdout
        assert done.stderr.count("cannot make the folder") == 1 and "Traceback" not in done.stderr


@pytest.mark.parametrize("n", [pytest.param(1, marks=SLOW), pytest.param(2, marks=pytest.mark.mpi)])
def test_particles_run_away(resident, script, n):
    script.write_text(PILE.replace("SET dt 0.04", "SET dt 0.4"))
    done = resident(n, script, "--no-figure", cwd=script.parent, timeout=120)
    assert done.returncode == 1
    assert "over half its radius per step" in done.stderr or "not finite" in done.stderr
    assert "particle " in done.stderr and " at (" in done.stderr
    assert done.stderr.count("hpcdem: step") == 1
    frames = sorted((script.parent / "data").glob("all_*.dat"))
    assert len(frames) > 1, "the state that made no sense is there to be looked at"


@SLOW
@pytest.mark.mpi
def test_more_ranks_than_fit(resident, script):
    text = PILE.replace("5000.0", "900.0").replace("right 5500.0", "right 1000.0").replace("left -500.0", "left -10.0")
    script.write_text(text)
    done = resident(8, script, cwd=script.parent, timeout=120)
    assert done.returncode == 2
    assert done.stderr.count("8 ranks are too many") == 1 and "ranks fit" in done.stderr


# -- requests ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["SIGTERM", *(pytest.param(name, marks=SLOW) for name in ("SIGUSR1", "SIGINT"))])
def test_a_signal_saves_and_stops(launch, resident, script, undisturbed, wait_until, name):
    data = script.parent / "data"
    job = launch.start(1, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    job.send_signal(getattr(signal, name))
    code, out, err = end_of(job)
    assert code == 85, err
    assert "--resume" in err and ("Ctrl-C" if name == "SIGINT" else name) in err
    assert "steps/s" in out.splitlines()[-1]
    finish(resident, 1, script, undisturbed)


@pytest.mark.mpi
def test_a_signal_to_one_rank_stops_all(launch, resident, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    before = checkpoints(data)
    os.kill(rank_process(script.parent, 1), signal.SIGTERM)
    code, _, err = end_of(job)
    assert code == 85, err
    assert err.count("resume with --resume") == 1
    assert len(checkpoints(data)) > len(before) or int(checkpoints(data)[-1][:10]) % 400 == 0
    finish(resident, 1, script, undisturbed)


@SLOW
@pytest.mark.mpi
def test_a_signal_to_the_launcher_reaches_the_ranks(launch, resident, script, undisturbed, wait_until):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    # Open MPI's mpiexec answers SIGTERM by killing the ranks, MPICH's dies of SIGUSR2; both pass on SIGUSR1.
    job.send_signal(signal.SIGUSR1)
    code, _, err = end_of(job)
    assert code == 85, err
    finish(resident, 2, script, undisturbed)


@pytest.mark.mpi
def test_sigusr2_saves_and_continues(launch, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    script.write_text(PILE.replace(" save 400", "").replace(" save 8.0", ""))
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: list(data.glob("all_*_ini.dat")), "the first frame")
    os.kill(rank_process(script.parent, 1), signal.SIGUSR2)
    out, err = job.communicate(timeout=120)
    assert job.returncode == 0, err
    assert out.count("written on request") == 1 and len(checkpoints(data)) == 1
    assert (data / LAST_FRAME).read_bytes() == undisturbed


@SLOW  # quick, of one process: tests/unit/test_runtime_watchdog.py
@pytest.mark.mpi
def test_a_second_sigterm_ends_ranks_that_hang(launch, resident, script, undisturbed, wait_until, rank_process):
    """Rank 1 has stopped for good; rank 0 waits for it inside MPI, where no handler of Python runs."""
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    waiting = rank_process(script.parent, 0)
    os.kill(rank_process(script.parent, 1), signal.SIGSTOP)
    time.sleep(0.5)
    os.kill(waiting, signal.SIGTERM)
    time.sleep(2.5)
    assert job.poll() is None
    os.kill(waiting, signal.SIGTERM)
    code, _, err = end_of(job)
    assert code not in (0, 85)
    assert "SIGTERM" in err and "ended without saving" in err and "Traceback" not in err
    finish(resident, 1, script, undisturbed)


@SLOW
@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_a_chain_of_jobs_with_a_time_limit(resident, script, undisturbed, n):
    """As a queue would run it: always the same command line, until it says that it is done."""
    codes = []
    while not codes or (codes[-1] == 85 and len(codes) < 30):
        limit = AT_ONCE if len(codes) < 2 else f"00:00:{3 + len(codes) // 4:02}"  # the start alone may take 3 s
        done = resident(n, script, "--resume", "--time-limit", limit, "--no-figure", cwd=script.parent, timeout=120)
        codes.append(done.returncode)
    assert codes[-1] == 0 and codes[:2] == [85, 85] and set(codes) == {0, 85}, done.stderr
    assert (script.parent / "data" / LAST_FRAME).read_bytes() == undisturbed


# -- checkpoints that are no good ------------------------------------------------------------------------------------


@pytest.fixture
def stopped(stopped_run, script):
    """The folder of a run that was stopped between its third and fourth checkpoint; a copy, to be spoiled."""
    return Path(shutil.copytree(stopped_run, script.parent / "data"))  # keeps the times of the files


@pytest.mark.parametrize("damage", ["changed", *(pytest.param(one, marks=SLOW) for one in ("cut", "empty", "foreign"))])
def test_a_damaged_checkpoint_is_passed_over(resident, script, undisturbed, stopped, damage):
    newest = max(stopped.glob("*.sav"), key=lambda p: p.stat().st_mtime_ns)
    whole = newest.read_bytes()
    middle = len(whole) // 2
    newest.write_bytes(
        {
            "cut": whole[:middle],
            "changed": whole[:middle] + bytes(b ^ 0xFF for b in whole[middle : middle + 4000]) + whole[middle + 4000 :],
            "empty": b"",
            "foreign": b"no checkpoint at all",
        }[damage]
    )
    done = finish(resident, 1, script, undisturbed)
    assert done.stdout.count("warning:") >= 1 and newest.name in done.stdout
    assert f"resuming from {newest}" not in done.stdout


def test_a_script_changed_in_what_was_done_is_refused(resident, script, stopped):
    script.write_text(PILE.replace("fric 0.1 shear", "fric 0.2 shear"))
    done = resident(1, script.name, "--resume", cwd=script.parent, timeout=120)
    assert done.returncode == 2
    assert "pile.py:9:" in done.stderr and "must not be changed" in done.stderr


def test_resume_without_a_checkpoint_begins_at_the_beginning(resident, script, undisturbed):
    done = resident(1, script, "--resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0 and "starting at the beginning" in done.stdout
    assert (script.parent / "data" / LAST_FRAME).read_bytes() == undisturbed


def test_resume_finds_the_folder_that_the_script_names(resident, script, undisturbed):
    script.write_text(PILE.replace("SET dt", "SET outdir results\nSET dt"))
    done = resident(1, script, "--time-limit", AT_ONCE, "--no-figure", cwd=script.parent)
    assert done.returncode == 85
    done = resident(1, script, "--resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0 and "resuming from" in done.stdout
    assert (script.parent / "results" / LAST_FRAME).read_bytes() == undisturbed
    assert not (script.parent / "data").exists()


# -- hpcdem resume ---------------------------------------------------------------------------------------------------


def taken_up(resident, n, folder, undisturbed, *arguments, cwd):
    done = resident(n, "resume", *arguments, "--no-figure", cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (folder / LAST_FRAME).read_bytes() == undisturbed
    return done


@pytest.mark.parametrize("n", [pytest.param(1, marks=SLOW), pytest.param(2, marks=pytest.mark.mpi)])
def test_resume_needs_no_script(resident, script, undisturbed, n, tmp_path_factory):
    """Called from elsewhere, with the folder alone; done, it says so."""
    done = resident(1, script, "--time-limit", AT_ONCE, "--no-figure", cwd=script.parent)
    assert done.returncode == 85
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    data = script.parent / "data"
    assert "resuming from" in taken_up(resident, n, data, undisturbed, data, cwd=elsewhere).stdout
    again = resident(1, "resume", data, cwd=elsewhere)
    assert again.returncode == 0 and "the run is complete" in again.stdout


def test_resume_takes_the_script_out_of_the_checkpoint(resident, script, undisturbed):
    assert resident(1, script, "--time-limit", AT_ONCE, "--no-figure", cwd=script.parent).returncode == 85
    script.unlink()
    taken_up(resident, 1, script.parent / "data", undisturbed, cwd=script.parent)


def test_a_script_out_of_a_checkpoint_writes_nowhere_else(resident, script, tmp_path):
    victim = tmp_path.parent / "victim.dat"
    script.write_text(PILE.replace("STOP", f"EXP {victim}\nSTOP"))
    assert resident(1, script, "--time-limit", AT_ONCE, "--no-figure", cwd=script.parent).returncode == 85
    script.unlink()
    done = resident(1, "resume", cwd=script.parent)
    assert done.returncode == 2 and "is outside" in done.stderr and "victim.dat" in done.stderr
    assert not victim.exists()


def test_a_moved_folder_continues(resident, script, undisturbed, tmp_path_factory):
    assert resident(1, script, "--time-limit", AT_ONCE, "--no-figure", cwd=script.parent).returncode == 85
    elsewhere = tmp_path_factory.mktemp("moved")
    shutil.move(script.parent / "data", elsewhere / "data")
    shutil.move(script, elsewhere / script.name)
    taken_up(resident, 1, elsewhere / "data", undisturbed, cwd=elsewhere)


def test_nothing_to_resume(resident, tmp_path):
    done = resident(1, "resume", cwd=tmp_path)
    assert done.returncode == 2 and "nothing to resume" in done.stderr
    done = resident(1, "resume", tmp_path / "nowhere", cwd=tmp_path)
    assert done.returncode == 2 and "folder not found" in done.stderr


def test_two_runs_in_one_folder(launch, script, undisturbed, wait_until):
    """The second is refused and touches nothing; the first does not notice."""
    data = script.parent / "data"
    job = launch.start(1, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), "the first checkpoint")
    os.kill(job.pid, signal.SIGSTOP)  # or it might be done before the other has begun
    second = launch(1, script, "--no-figure", cwd=script.parent)
    os.kill(job.pid, signal.SIGCONT)
    assert second.returncode == 2
    assert second.stderr.count("another run is writing into") == 1 and "pile.py" in second.stderr
    out, err = job.communicate(timeout=120)
    assert job.returncode == 0, err
    assert (data / LAST_FRAME).read_bytes() == undisturbed
    assert not (data / ".lock").exists()


def test_an_old_run_in_the_folder_is_not_gone_on_with(launch, script, undisturbed, stopped):
    """A changed script is begun again in the folder of an earlier run, which had come farther, and is killed."""
    early = PILE.replace("save 400", "save 200")
    script.write_text(early)
    job = launch.start(1, script, "--no-figure", cwd=script.parent)
    until((stopped / "0000000200.sav").exists, "the first checkpoint")
    job.kill()
    job.wait()
    done = launch(1, "resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0, done.stderr
    assert (stopped / LAST_FRAME).read_bytes() == undisturbed


@SLOW
def test_checkpoints_are_rotated(resident, script, undisturbed):
    done = resident(1, script, "--keep", "2", "--no-figure", cwd=script.parent)
    assert done.returncode == 0, done.stderr
    data = script.parent / "data"
    assert len(checkpoints(data)) == 2 and checkpoints(data)[-1] == "0000006000.sav"
    assert (data / LAST_FRAME).read_bytes() == undisturbed


def test_old_checkpoints_are_spared_by_the_time_of_the_model(resident, script, undisturbed):
    """0.04 s a step, a checkpoint each 400: at or before 40, 80, ... s lie 32, 80, 112, 160 s, ..."""
    done = resident(1, script, "--keep", "1", "--keep-every", "40", "--no-figure", cwd=script.parent)
    assert done.returncode == 0, done.stderr
    data = script.parent / "data"
    assert [int(name[:10]) for name in checkpoints(data)] == [800, 2000, 2800, 4000, 4800, 6000]
    assert (data / LAST_FRAME).read_bytes() == undisturbed


def test_a_run_continues_from_the_last_checkpoint_before_a_time(resident, script, undisturbed, stopped):
    """32.4 s are step 810. Later checkpoints of the run that was given up are passed over from then on."""
    assert resident(1, script, "--before", "32.4", cwd=script.parent).stderr.count("add --resume") == 1
    none = resident(1, script, "--resume", "--before", "15.9", "--no-figure", cwd=script.parent)
    assert none.returncode == 2 and "at or before 15.9 s of model time" in none.stderr
    cut = resident(1, "resume", "--before", "32.4", "--time-limit", "0.001", "--no-figure", cwd=script.parent)
    assert cut.returncode == 85 and "resuming from" in cut.stdout and "0000000800.sav" in cut.stdout, cut.stderr
    done = resident(1, "resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0, done.stderr
    step = int(re.search(r"resuming from .*, step (\d+)", done.stdout)[1])
    assert 800 <= step < 1200 and (stopped / LAST_FRAME).read_bytes() == undisturbed


def test_a_checkpoint_that_nobody_asked_for(resident, script, undisturbed):
    script.write_text(PILE.replace(" save 400", "").replace(" save 8.0", ""))
    done = resident(1, script, "--autosave", "0.1", "--no-figure", cwd=script.parent)
    assert done.returncode == 0, done.stderr
    data = script.parent / "data"
    written = done.stdout.count("written automatically")  # one alone where writing it took a tenth of a second
    assert written >= 1
    assert len(checkpoints(data)) == min(written, 2) and all(name.startswith("auto_") for name in checkpoints(data))
    assert (data / LAST_FRAME).read_bytes() == undisturbed


def test_info_lists_the_contents(launch, script, stopped):
    newest = max(stopped.glob("*.sav"))
    done = launch(1, "info", newest, cwd=script.parent)
    assert done.returncode == 0 and "checkpoint, complete" in done.stdout and "CYC" in done.stdout
    done = launch(1, "info", stopped, cwd=script.parent)
    assert done.returncode == 0 and "state        stopped" in done.stdout and "hpcdem resume" in done.stdout
    whole = newest.read_bytes()
    newest.write_bytes(whole[: len(whole) // 2])
    done = launch(1, "info", newest, stopped, cwd=script.parent)
    assert done.returncode == 1 and done.stdout.count("INCOMPLETE") == 2
