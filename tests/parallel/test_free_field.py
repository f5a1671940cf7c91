"""An earthquake between free-field sides: the same bits on any number of ranks and threads, and across a restart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent.parent / "blocks" / "worker.py"
STEPS = 700
KIND = "shaking"


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    folder = tmp_path_factory.mktemp(KIND)
    workers.alone(WORKER, KIND, STEPS, 401, folder)
    return folder


def test_much_happens(alone):
    with np.load(alone / "alone.npz") as found:
        assert np.hypot(found["velocity_x"], found["velocity_y"]).max() > 0.1
        assert found["counts"][1] + found["counts"][2] > 5  # joints behind their peak
        assert found["energy_work_outside"] > 0.0 and found["energy_relative"] < 0.01


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(2, 1), (4, 1), (1, 2)])
def test_ranks_and_threads_do_not_change_a_bit(alone, launch, ranks, threads):
    equal(launch, WORKER, KIND, STEPS, alone, ranks, threads)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(1, 1), (2, 1)])
def test_a_restart_does_not_change_a_bit(alone, launch, ranks, threads):
    equal(launch, WORKER, KIND, STEPS, alone, ranks, threads, "resume", "middle.sav")
