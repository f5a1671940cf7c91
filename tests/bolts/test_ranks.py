"""Bolts that are pulled apart, excavated, installed in mid-run: the same bits on any number of ranks, and across a
restart on other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.bolts import kernels
from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent / "worker.py"
STEPS, MIDDLE = 1400, 1101
"""The checkpoint is written after rupture, excavation, and the change to motion."""


@pytest.fixture(scope="module", params=["breaking", "relaxing"])
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, workers.alone(WORKER, request.param, STEPS, MIDDLE, folder)


def test_much_happens(alone):
    kind, folder = alone
    with np.load(folder / "alone.npz") as found:
        bars, grout, host = found["element_state"], found["node_bond_state"], found["node_host"]
        assert (host < 0).sum() >= 3 and (grout & kernels.SLIPPED).sum() > 10
        assert np.abs(found["element_force"]).max() > 100.0
        if kind == "breaking":
            assert (bars & kernels.RUPTURED).any() and (bars & kernels.WAS_IN_TENSION).sum() > 10
            assert not (bars & kernels.RUPTURED).all() and found["counts"][2] > 20
            assert found["energy_relative"] < 0.01 and found["bolts_relative"] < 0.01
            assert found["bolts_lost_in_bars"] > 1.0 and found["bolts_lost_in_grout"] > 1.0
            assert found["bolts_work_on_rock"] == found["energy_work_bolts"] > 50.0


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
