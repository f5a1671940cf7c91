"""A block shatters in a bed of discs: the same bits of both on any number of ranks and threads, and across a restart on
other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal

WORKER = Path(__file__).resolve().parent.parent / "coupled" / "worker.py"
STEPS = 1200
SLOW = pytest.mark.slow


@pytest.fixture(scope="module", params=["shatter", pytest.param("flight", marks=SLOW)])
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, workers.alone(WORKER, request.param, STEPS, 701, folder)


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
    out = equal(launch, WORKER, kind, STEPS, folder, ranks, threads)
    if ranks > 1:
        with np.load(out) as found:
            assert found["about"][4] > 0  # ranks that sent forces to others


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(2, 1), pytest.param(1, 1, marks=SLOW), pytest.param(4, 1, marks=SLOW)])
def test_a_restart_does_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    equal(launch, WORKER, kind, STEPS, folder, ranks, threads, "resume", "middle.sav")


@pytest.fixture(scope="module")
def yielding(tmp_path_factory):
    """Blocks of weak soil flow and fall apart on the discs, on one rank."""
    folder = workers.alone(WORKER, "yield", STEPS, 701, tmp_path_factory.mktemp("yield"))
    with np.load(folder / "alone.npz") as found:
        flowed = found["plastic_shear_strain"]
        assert (flowed > 1e-3).sum() > 10 and found["about"][0] > 10 and found["broken"][2] > 0
        assert found["blocks_plastic_lost"] > 0.0 and found["energy_relative"] < 1e-3
    return folder


@pytest.mark.mpi
@pytest.mark.parametrize("ranks, threads", [(3, 1), pytest.param(2, 2, marks=SLOW), pytest.param(4, 1, marks=SLOW)])
def test_blocks_that_yield_are_the_same_on_any_ranks(yielding, launch, ranks, threads):
    equal(launch, WORKER, "yield", STEPS, yielding, ranks, threads)


@pytest.mark.mpi
def test_blocks_that_yield_go_on_from_the_middle(yielding, launch):
    equal(launch, WORKER, "yield", STEPS, yielding, 2, 1, "resume", "middle.sav")


@pytest.fixture(scope="module")
def hit_by_clumps(tmp_path_factory):
    """Rigid bodies of discs hit a jointed block, on one rank."""
    folder = workers.alone(WORKER, "clumps", STEPS, 601, tmp_path_factory.mktemp("clumps"))
    with np.load(folder / "alone.npz") as found:
        of_clumps = np.flatnonzero(found["discs"][:, 0] >= found["clump_id"].min())
        assert len(found["clump_id"]) == 4 and len(of_clumps) > 8
        assert np.ptp(found["clump_spin"]) > 1.0 and found["clump_vy"].max() > -8.0  # they were braked, and turned
        assert found["about"][1] == 0
    return folder


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(2, marks=SLOW), pytest.param(4, marks=SLOW)])
def test_clumps_on_other_ranks(hit_by_clumps, launch, ranks):
    equal(launch, WORKER, "clumps", STEPS, hit_by_clumps, ranks, 1)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(1, marks=SLOW)])
def test_clumps_after_a_restart(hit_by_clumps, launch, ranks):
    equal(launch, WORKER, "clumps", STEPS, hit_by_clumps, ranks, 1, "resume", "middle.sav")
