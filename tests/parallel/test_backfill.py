"""Elements that come back: the same bits on any number of ranks and threads, and across a restart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent.parent / "blocks" / "worker.py"
STEPS, KIND = 1100, "backfill"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The run on one rank, with a checkpoint from between the fillings."""
    made = tmp_path_factory.mktemp(KIND)
    workers.alone(WORKER, KIND, STEPS, 701, made)
    return made


def test_the_fill_is_there_and_carries(folder):
    with np.load(folder / "alone.npz") as found:
        stress = found["stress_xx"]
        assert np.isnan(stress).sum() == 3 and found["energy_relative"] < 1e-3
        assert found["energy_commands"] != 0.0 and np.nanmax(np.abs(stress)) > 1e5


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(2, 1), (4, 1), pytest.param(2, 2, marks=pytest.mark.slow)])
def test_ranks_and_threads_do_not_change_a_bit(folder, launch, ranks, threads):
    equal(launch, WORKER, KIND, STEPS, folder, ranks, threads)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_restart_does_not_change_a_bit(folder, launch, ranks):
    equal(launch, WORKER, KIND, STEPS, folder, ranks, 1, "resume", "middle.sav")
