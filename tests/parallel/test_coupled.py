"""A block shatters in a bed of discs: the same bits of both on any number of ranks and threads, and across a restart on
other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel.test_blocks import THREADS, same

WORKER = Path(__file__).resolve().parent.parent / "coupled" / "worker.py"
STEPS = 1200
SLOW = pytest.mark.slow


@pytest.fixture(scope="module", params=["shatter", pytest.param("flight", marks=SLOW)])
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    from tests.conftest import Launcher

    folder = tmp_path_factory.mktemp(request.param)
    run = Launcher().python(1, WORKER, request.param, 1, STEPS, "alone.npz", 701, "middle.sav", cwd=folder)
    assert run.returncode == 0, run.stderr[-2000:]
    return request.param, folder


def test_much_happens(alone):
    with np.load(alone[1] / "alone.npz") as found:
        assert found["broken"][2] > 40
        most, late, *_ = found["about"]
        assert most > 10 and late == 0
        assert np.abs(found["contact_fs"]).max() > 1.0
        assert found["energy_lost"] > 10.0 and found["energy_relative"] < 1e-4


@pytest.mark.mpi
@pytest.mark.parametrize(
    "ranks, threads",
    [(3, 1), pytest.param(2, 1, marks=SLOW), pytest.param(4, 1, marks=SLOW), pytest.param(1, 2, marks=SLOW),
     pytest.param(2, 2, marks=SLOW)],
)  # fmt: skip
def test_ranks_and_threads_do_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    out = f"r{ranks}t{threads}.npz"
    run = launch.python(ranks, WORKER, kind, threads, STEPS, out, cwd=folder, env=THREADS)
    assert run.returncode == 0, run.stderr[-2000:]
    same(folder / "alone.npz", folder / out)
    if ranks > 1:
        with np.load(folder / out) as found:
            assert found["about"][4] > 0  # ranks that sent forces to others


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(2, 1), pytest.param(1, 1, marks=SLOW), pytest.param(4, 1, marks=SLOW)])
def test_a_restart_does_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    out = f"again{ranks}{threads}.npz"
    run = launch.python(ranks, WORKER, kind, threads, STEPS, out, "resume", "middle.sav", cwd=folder, env=THREADS)
    assert run.returncode == 0, run.stderr[-2000:]
    same(folder / "alone.npz", folder / out)
