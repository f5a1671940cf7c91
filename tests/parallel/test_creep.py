"""Elements that creep, at rest and in motion, beside joints that break: the same bits on any number of ranks and
threads, and across a restart in the middle of a creep step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent.parent / "blocks" / "worker.py"
STEPS = 1400
KIND = "creeping"


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    folder = tmp_path_factory.mktemp(KIND)
    workers.alone(WORKER, KIND, STEPS, 701, folder)
    return folder


def test_much_happens(alone):
    with np.load(alone / "alone.npz") as found:
        intact, _, broken = found["counts"]
        assert broken > 10 and intact > 10
        steps, times = found["event_step"], found["event_time"]
        in_creep = (steps > 200) & (steps < 1000)
        assert in_creep.sum() > 5 and len(set(times[in_creep])) > 2  # at several creep times
        assert np.abs(found["creep_strain_xx"]).max() > 1e-6
        assert (found["creep_work"] > 0.0).sum() > 50
        assert found["energy_creep_lost"] > 0.0 and found["energy_relative"] < 0.01


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(2, 1), (4, 1), (1, 2)])
def test_ranks_and_threads_do_not_change_a_bit(alone, launch, ranks, threads):
    equal(launch, WORKER, KIND, STEPS, alone, ranks, threads)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(1, 1), (2, 1)])
def test_a_restart_in_mid_creep_does_not_change_a_bit(alone, launch, ranks, threads):
    equal(launch, WORKER, KIND, STEPS, alone, ranks, threads, "resume", "middle.sav")
