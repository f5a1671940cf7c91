"""Liners that are torn apart, excavated, put on and deleted in mid-run: the same bits on any number of ranks, and
across a restart on other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.liners import kernels
from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent / "worker.py"
STEPS, MIDDLE = 1400, 1101
"""The checkpoint is written after excavation and deletion, and the change to motion."""


@pytest.fixture(scope="module", params=["breaking", "relaxing"])
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, workers.alone(WORKER, request.param, STEPS, MIDDLE, folder)


def test_much_happens(alone):
    kind, folder = alone
    with np.load(folder / "alone.npz") as found:
        bond = found["element_bond_state"]
        assert (found["element_host"] < 0).sum() >= 3
        assert (bond & kernels.SLIPPED > 0).sum() > 5 and (bond & kernels.PARTED > 0).sum() > 2
        assert np.abs(found["element_force"]).max(axis=0).min() > 0.1
        assert (found["element_state"] & kernels.HAS_YIELDED > 0).any()
        if kind == "breaking":
            assert found["counts"][2] > 20
            assert found["energy_relative"] < 0.01 and found["liners_relative"] < 0.01
            assert found["liners_lost_in_beams"] > 1.0 and found["liners_lost_in_bond"] > 0.1
            assert found["liners_work_on_rock"] == found["energy_work_liners"] != 0.0


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [pytest.param(2, 1, marks=pytest.mark.slow), (4, 1), (1, 2)])
def test_ranks_and_threads_do_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    equal(launch, WORKER, kind, STEPS, folder, ranks, threads)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_it_goes_on_from_a_checkpoint_on_any_ranks(alone, launch, ranks):
    kind, folder = alone
    equal(launch, WORKER, kind, STEPS, folder, ranks, 1, "resume", "middle.sav")
