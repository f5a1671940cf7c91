"""Blocks that break, slide, fly about and are excavated: the same bits on any number of ranks and threads, and across a
restart on other ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel import workers
from tests.parallel.workers import equal, same

WORKER = Path(__file__).resolve().parent.parent / "blocks" / "worker.py"
STEPS = 1500
SLOW = pytest.mark.slow


@pytest.fixture(
    scope="module",
    params=["impact", pytest.param("mixed", marks=SLOW), "flight", "yielding", pytest.param("opening", marks=SLOW)],
)
def alone(request, tmp_path_factory):
    """The run on one rank with one thread, with a checkpoint from the middle of it."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, workers.alone(WORKER, request.param, STEPS, 701, folder)


def test_much_happens(alone):
    kind, folder = alone
    with np.load(folder / "alone.npz") as found:
        intact, yielded, broken = found["counts"]
        assert broken > 20 and yielded > 5
        assert found["about"][0] > 5  # rebuilds
        assert found["about"][2] > 50  # contact pairs
        assert (np.diff(found["event_step"]) >= 0).all()
        assert found["energy_relative"] < 0.01
        if kind == "yielding":
            assert found["energy_plastic_lost"] > 0.05 * found["energy_joints_lost"] > 0.0
            assert (found["plastic_state"] > 0).sum() > 20 and (found["plastic_state"] == 0).sum() > 3
        if kind == "opening":
            assert np.isnan(found["stress_xx"]).sum() > 5  # elements that were taken out


@pytest.mark.mpi
@pytest.mark.parametrize(
    "ranks, threads",
    [
        pytest.param(2, 1, marks=SLOW),
        (3, 1),
        (4, 1),
        pytest.param(1, 2, marks=SLOW),
        pytest.param(1, 3, marks=SLOW),
        pytest.param(2, 2, marks=SLOW),
    ],
)
def test_ranks_and_threads_do_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    out = equal(launch, WORKER, kind, STEPS, folder, ranks, threads)
    if kind in ("flight", "yielding") and ranks > 1:
        with np.load(out) as found:
            assert found["about"][3] > 10  # elements that came from another rank


@pytest.mark.mpi
@pytest.mark.parametrize(
    "ranks, threads",
    [pytest.param(1, 1, marks=SLOW), (2, 1), pytest.param(3, 1, marks=SLOW), pytest.param(4, 1, marks=SLOW), (1, 2)],
)
def test_a_restart_does_not_change_a_bit(alone, launch, ranks, threads):
    kind, folder = alone
    equal(launch, WORKER, kind, STEPS, folder, ranks, threads, "resume", "middle.sav")


@pytest.mark.mpi
def test_a_checkpoint_of_three_ranks_goes_on_with_one(alone, launch):
    """The way back: what three ranks write one rank reads, at the same place."""
    kind, folder = alone
    run = launch.python(3, WORKER, kind, 1, 702, "part.npz", 701, "three.sav", cwd=folder)
    assert run.returncode == 0, run.stderr[-2000:]
    run = launch.python(1, WORKER, kind, 1, STEPS, "from_three.npz", "resume", "three.sav", cwd=folder)
    assert run.returncode == 0, run.stderr[-2000:]
    same(folder / "alone.npz", folder / "from_three.npz")


@pytest.mark.mpi
def test_borders_follow_broken_zones(launch, tmp_path):
    """A long bed of which the left third is shattered: cut again, both ranks have equal cost, not number."""
    run = launch.python(2, WORKER, "borders", 1, 0, "none.npz", cwd=tmp_path)
    assert run.returncode == 0, run.stderr[-2000:]
    rows = sorted(line.split() for line in run.stdout.splitlines() if line.startswith("borders"))
    (_, _, left, left_cost), (_, _, right, right_cost) = rows
    assert int(left) < 0.7 * int(right)
    assert abs(float(left_cost) / float(right_cost) - 1.0) < 0.25  # whole columns change hands
