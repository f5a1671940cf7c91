"""Whatever happens to a run: it ends within seconds, says why once, and its last checkpoint restarts exactly.

The undisturbed run is the measure: after any accident and `--resume`, on another rank count too, the last frame is
the same to the last byte.
"""

from __future__ import annotations

import os
import shutil
import signal
import time
from pathlib import Path

import pytest

from tests.faults.conftest import LAST_FRAME, PILE

SECONDS = 20.0
"""Longest time from an accident to the end of the job."""


def checkpoints(folder) -> list[str]:
    return sorted(p.name for p in folder.glob("*.sav"))


def finish(launch, n, script, undisturbed, *options):
    """Resume on n ranks and compare the end."""
    done = launch(n, script, "--resume", "--no-figure", *options, cwd=script.parent)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "going on from" in done.stdout
    folder = script.parent / (options[1] if options else "data")
    assert (folder / LAST_FRAME).read_bytes() == undisturbed
    return done


def end_of(process):
    """Output and exit code of a job that has been given its reason to end."""
    began = time.monotonic()
    out, err = process.communicate(timeout=SECONDS + 10)
    assert time.monotonic() - began < SECONDS
    return process.returncode, out, err


# -- accidents -----------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_one_rank_is_killed(launch, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), 120, "the first checkpoint")
    os.kill(rank_process(script.parent, 1), signal.SIGKILL)
    code, *_ = end_of(job)
    assert code != 0
    finish(launch, 1, script, undisturbed)


@pytest.mark.mpi
def test_all_ranks_are_killed_while_they_write(launch, script, undisturbed, wait_until, rank_process):
    """A temporary file may stay behind; it is neither taken for a checkpoint nor in the way."""
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), 120, "the first checkpoint")
    for rank in (0, 1):
        os.kill(rank_process(script.parent, rank), signal.SIGKILL)
    code, *_ = end_of(job)
    assert code != 0
    (data / "0000014999.sav.tmp").write_bytes(b"half a file")
    finish(launch, 2, script, undisturbed)


@pytest.mark.parametrize("n", [1, pytest.param(3, marks=pytest.mark.mpi)])
def test_a_bad_word_on_line_17(launch, script, n):
    script.write_text(PILE.replace("IMPLE wall", "IMPEL wall"))
    done = launch(n, script.name, cwd=script.parent, timeout=60)
    assert done.returncode == 2
    assert done.stderr.count("pile.py:17:") == 1 and "IMPEL" in done.stderr
    assert not (script.parent / "data").exists()


@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_the_disk_is_full(launch, script, undisturbed, small_disk, n):
    disk = small_disk("1m")
    done = launch(n, script, "--no-figure", "--outdir", disk, cwd=script.parent, timeout=120)
    assert done.returncode == 1
    assert done.stderr.count("no space left on the disk") == 1 and "Traceback" not in done.stderr
    assert checkpoints(disk) and not list(disk.glob("*.tmp"))
    small_disk("64m")
    finish(launch, n, script, undisturbed, "--outdir", disk)


@pytest.mark.parametrize("n", [1, pytest.param(3, marks=pytest.mark.mpi)])
def test_the_output_folder_cannot_be_made(launch, script, n):
    (script.parent / "data").write_text("a file has the name of the folder")
    done = launch(n, script, cwd=script.parent, timeout=120)
    assert done.returncode == 1
    assert done.stderr.count("cannot make the folder") == 1 and "Traceback" not in done.stderr


@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_particles_run_away(launch, script, n):
    script.write_text(PILE.replace("SET dt 0.04", "SET dt 0.4"))
    done = launch(n, script, "--no-figure", cwd=script.parent, timeout=120)
    assert done.returncode == 1
    assert "over half its radius per step" in done.stderr or "not finite" in done.stderr
    assert "particle " in done.stderr and " at (" in done.stderr
    assert done.stderr.count("hpcdem: step") == 1
    frames = sorted((script.parent / "data").glob("all_*.dat"))
    assert len(frames) > 1, "the state that made no sense is there to be looked at"


@pytest.mark.mpi
def test_more_ranks_than_fit(launch, script):
    text = PILE.replace("5000.0", "900.0").replace("right 5500.0", "right 1000.0").replace("left -500.0", "left -10.0")
    script.write_text(text)
    done = launch(8, script, cwd=script.parent, timeout=120)
    assert done.returncode == 2
    assert done.stderr.count("8 ranks are too many") == 1 and "ranks fit" in done.stderr


# -- requests ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["SIGTERM", "SIGUSR1", "SIGINT"])
def test_a_signal_saves_and_stops(launch, script, undisturbed, wait_until, name):
    data = script.parent / "data"
    job = launch.start(1, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), 120, "the first checkpoint")
    job.send_signal(getattr(signal, name))
    code, out, err = end_of(job)
    assert code == 85, err
    assert "--resume" in err and ("Ctrl-C" if name == "SIGINT" else name) in err
    assert "steps/s" in out.splitlines()[-1]
    finish(launch, 1, script, undisturbed)


@pytest.mark.mpi
def test_a_signal_to_one_rank_stops_all(launch, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), 120, "the first checkpoint")
    before = checkpoints(data)
    os.kill(rank_process(script.parent, 1), signal.SIGTERM)
    code, _, err = end_of(job)
    assert code == 85, err
    assert err.count("go on with --resume") == 1
    assert len(checkpoints(data)) > len(before) or int(checkpoints(data)[-1][:10]) % 1000 == 0
    finish(launch, 2, script, undisturbed)


@pytest.mark.mpi
def test_a_signal_to_the_launcher_reaches_the_ranks(launch, script, undisturbed, wait_until):
    data = script.parent / "data"
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: checkpoints(data), 120, "the first checkpoint")
    # Open MPI's mpiexec answers SIGTERM by killing the ranks, MPICH's dies of SIGUSR2; both pass on SIGUSR1.
    job.send_signal(signal.SIGUSR1)
    code, _, err = end_of(job)
    assert code == 85, err
    finish(launch, 2, script, undisturbed)


@pytest.mark.mpi
def test_sigusr2_saves_and_goes_on(launch, script, undisturbed, wait_until, rank_process):
    data = script.parent / "data"
    script.write_text(PILE.replace(" save 1000", "").replace(" save 20.0", ""))
    job = launch.start(2, script, "--no-figure", cwd=script.parent)
    wait_until(lambda: list(data.glob("all_*_ini.dat")), 120, "the first frame")
    os.kill(rank_process(script.parent, 1), signal.SIGUSR2)
    out, err = job.communicate(timeout=120)
    assert job.returncode == 0, err
    assert out.count("written on request") == 1 and len(checkpoints(data)) == 1
    assert (data / LAST_FRAME).read_bytes() == undisturbed


@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_a_chain_of_jobs_with_a_time_limit(launch, script, undisturbed, n):
    """As a queue would run it: always the same command line, until it says that it is done."""
    codes = []
    while not codes or (codes[-1] == 85 and len(codes) < 30):
        done = launch(n, script, "--resume", "--time-limit", "00:00:03", "--no-figure", cwd=script.parent, timeout=120)
        codes.append(done.returncode)
    assert codes[-1] == 0 and set(codes) <= {0, 85}, done.stderr
    assert (script.parent / "data" / LAST_FRAME).read_bytes() == undisturbed


# -- checkpoints that are no good ------------------------------------------------------------------------------------


@pytest.fixture
def stopped(stopped_run, script):
    """The folder of a run that was stopped between its third and fourth checkpoint; a copy, to be spoiled."""
    return Path(shutil.copytree(stopped_run, script.parent / "data"))  # keeps the times of the files


@pytest.mark.parametrize("damage", ["cut", "changed", "empty", "foreign"])
def test_a_damaged_checkpoint_is_passed_over(launch, script, undisturbed, stopped, damage):
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
    done = finish(launch, 1, script, undisturbed)
    assert done.stdout.count("warning:") >= 1 and newest.name in done.stdout
    assert f"going on from {newest}" not in done.stdout


def test_a_script_changed_in_what_was_done_is_refused(launch, script, stopped):
    script.write_text(PILE.replace("fric 0.1 shear", "fric 0.2 shear"))
    done = launch(1, script.name, "--resume", cwd=script.parent, timeout=120)
    assert done.returncode == 2
    assert "pile.py:9:" in done.stderr and "must not be changed" in done.stderr


def test_resume_without_a_checkpoint_begins_at_the_beginning(launch, script, undisturbed):
    done = launch(1, script, "--resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0 and "starting at the beginning" in done.stdout
    assert (script.parent / "data" / LAST_FRAME).read_bytes() == undisturbed


def test_resume_finds_the_folder_that_the_script_names(launch, script, undisturbed):
    script.write_text(PILE.replace("SET dt", "SET outdir results\nSET dt"))
    done = launch(1, script, "--time-limit", "00:00:01", "--no-figure", cwd=script.parent)
    assert done.returncode == 85
    done = launch(1, script, "--resume", "--no-figure", cwd=script.parent)
    assert done.returncode == 0 and "going on from" in done.stdout
    assert (script.parent / "results" / LAST_FRAME).read_bytes() == undisturbed
    assert not (script.parent / "data").exists()
