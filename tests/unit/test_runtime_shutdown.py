"""All ranks end together: one message, one exit code, never a hang."""

from __future__ import annotations

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, StoppedWithCheckpoint
from hpcdem.runtime import shutdown


def outcome(error: BaseException | None) -> int:
    def work() -> None:
        if error is not None:
            raise error

    return shutdown.run_together(SerialComm(), work).code


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (None, 0, ""),
        (CommandError("no such group"), 2, "hpcdem: no such group\n"),
        (StoppedWithCheckpoint("saved"), 85, "hpcdem: saved\n"),
        (KeyboardInterrupt(), 130, "hpcdem: interrupted; nothing was saved\n"),
        (SystemExit(None), 0, ""),
        (SystemExit(7), 7, ""),
        (SystemExit("script says no"), 1, "script says no\n"),
    ],
)
def test_one_rank(capsys, error, code, text):
    assert outcome(error) == code
    assert capsys.readouterr().err == text


def test_an_error_of_ours_shows_its_traceback(capsys):
    assert outcome(ZeroDivisionError("oops")) == 1
    err = capsys.readouterr().err
    assert err.startswith("Traceback") and err.endswith("ZeroDivisionError: oops\n")


PROGRAM = """
import sys, time
import numpy as np
from hpcdem.core.errors import *
from hpcdem.runtime import launch, shutdown

comm = launch.start_mpi()

def work():
    {work}

shutdown.leave(shutdown.run_together(comm, work))
"""


def run(launch, tmp_path, work: str, n: int = 3):
    """Run `work` on n ranks; the job must end within seconds."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(work=work))
    return launch.python(n, program)


@pytest.mark.slow
@pytest.mark.mpi
def test_a_good_end(launch, tmp_path):
    done = run(launch, tmp_path, "comm.barrier(); time.sleep(0.3 * comm.rank)")
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.mpi
@pytest.mark.petsc
def test_a_good_end_with_petsc(launch, tmp_path):
    """It ends before MPI does."""
    done = run(launch, tmp_path, "from hpcdem.physics.fdem import linear; assert linear.petsc_there()", 2)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.mpi
def test_an_error_of_all_ranks_is_printed_once(launch, tmp_path):
    done = run(launch, tmp_path, "raise ScriptError('push.py', 17, 'GENN: unknown command')")
    assert done.returncode == 2
    assert done.stderr.count("hpcdem: push.py:17: GENN: unknown command") == 1
    assert "rank" not in done.stderr.replace("BAD TERMINATION", "").split("\n")[0]


@pytest.mark.slow
@pytest.mark.mpi
def test_ranks_that_come_late_still_end_as_one(launch, tmp_path):
    done = run(launch, tmp_path, "time.sleep(0.3 * comm.rank); comm.agree('disk is full')")
    assert done.returncode == 1
    assert done.stderr.count("disk is full") == 1


@pytest.mark.mpi
def test_one_rank_fails_while_the_others_wait_for_it(launch, tmp_path):
    work = "comm.rank == 1 and (_ for _ in ()).throw(PhysicsError('particle 7 is lost')); comm.barrier()"
    done = run(launch, tmp_path, work)
    assert done.returncode == 1
    assert done.stderr.count("rank 1 of 3: hpcdem: particle 7 is lost") == 1


@pytest.mark.slow
@pytest.mark.mpi
def test_the_exit_code_of_the_error_survives_the_abort(launch, tmp_path):
    work = "comm.rank == 2 and (_ for _ in ()).throw(CommandError('no')); comm.barrier()"
    assert run(launch, tmp_path, work).returncode == 2


@pytest.mark.slow
@pytest.mark.mpi
def test_one_traceback_when_several_ranks_fail(launch, tmp_path):
    done = run(launch, tmp_path, "comm.rank and [].pop(); comm.barrier()")
    assert done.returncode == 1
    assert done.stderr.count("Traceback") == 1
    assert "rank 1 of 3: Traceback" in done.stderr and "IndexError" in done.stderr


@pytest.mark.mpi
def test_a_rank_that_is_done_still_hears_of_the_error(launch, tmp_path):
    """Rank 0 draws the figure at the end while the others are through."""
    done = run(launch, tmp_path, "comm.rank == 0 and (time.sleep(1.5), 1 / 0)")
    assert done.returncode == 1
    assert done.stderr.count("rank 0 of 3: Traceback") == 1


@pytest.mark.slow
@pytest.mark.mpi
def test_a_rank_that_leaves_the_program_does_not_leave_the_others(launch, tmp_path):
    assert run(launch, tmp_path, "comm.rank == 1 and sys.exit(9); comm.barrier()").returncode == 9


@pytest.mark.slow
@pytest.mark.mpi
def test_checkpoint_code(launch, tmp_path):
    done = run(launch, tmp_path, "raise StoppedWithCheckpoint('saved all.sav')")
    assert done.returncode == 85 and done.stderr.count("saved all.sav") == 1


@pytest.mark.mpi
def test_an_error_with_a_pending_message(launch, tmp_path):
    """A receive that nobody will answer must not keep MPI from ending."""
    work = "comm.mpi.Irecv(np.empty(8), source=(comm.rank + 1) % comm.size); raise CommandError('stop here')"
    done = run(launch, tmp_path, work)
    assert done.returncode == 2 and done.stderr.count("stop here") == 1
