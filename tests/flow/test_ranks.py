"""Fluid that tears a block apart, and water that seeps: the same bits on any number of ranks, and across a restart on
other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent / "worker.py"
STEPS, MIDDLE = 1100, 703
"""The checkpoint is written after excavation and a change of channels."""


@pytest.fixture(scope="module", params=["bursting", "pumped", "seeping"])
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, workers.alone(WORKER, request.param, STEPS, MIDDLE, folder)


def test_much_happens(alone):
    kind, folder = alone
    with np.load(folder / "alone.npz") as found:
        wet = found["flow-node_saturation"]
        assert (wet == 1.0).sum() > 10 and ((wet > 0.0) & (wet < 1.0)).sum() > 5
        assert found["flow-node_pressure"].max() > 1e3
        assert found["account_relative"] < 1e-11 and found["account_stored"] > 0.0
        if kind == "pumped":
            print({name: float(found[name]) for name in found if name.startswith("well")}, found["clock"])
            assert found["well_long_stage"] == 3.0 and found["well_short_stage"] == 2.0
            assert found["well_long_injected"] > 0.0 and found["well_short_rate"] < 0.0
        if kind != "seeping":
            assert found["counts"][2] > 20 and found["account_leaked"] > 0.0 and found["account_removed"] > 0.0
            assert np.ptp(found["flow-channel_aperture"]) > 1e-3


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
