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


@pytest.fixture(scope="module")
def hit_by_clumps(tmp_path_factory):
    """Rigid bodies of discs hit a jointed block, on one rank."""
    from tests.conftest import Launcher

    folder = tmp_path_factory.mktemp("clumps")
    run = Launcher().python(1, WORKER, "clumps", 1, STEPS, "alone.npz", 601, "middle.sav", cwd=folder)
    assert run.returncode == 0, run.stderr[-2000:]
    with np.load(folder / "alone.npz") as found:
        of_clumps = np.flatnonzero(found["discs"][:, 0] >= found["clump_id"].min())
        assert len(found["clump_id"]) == 4 and len(of_clumps) > 8
        assert np.ptp(found["clump_spin"]) > 1.0 and found["clump_vy"].max() > -8.0  # they were braked, and turned
        assert found["about"][1] == 0
    return folder


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(2, marks=SLOW), pytest.param(4, marks=SLOW)])
def test_clumps_on_other_ranks(hit_by_clumps, launch, ranks):
    out = f"r{ranks}.npz"
    run = launch.python(ranks, WORKER, "clumps", 1, STEPS, out, cwd=hit_by_clumps, env=THREADS)
    assert run.returncode == 0, run.stderr[-2000:]
    same(hit_by_clumps / "alone.npz", hit_by_clumps / out)


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(1, marks=SLOW)])
def test_clumps_after_a_restart(hit_by_clumps, launch, ranks):
    out = f"again{ranks}.npz"
    more = "resume", "middle.sav"
    run = launch.python(ranks, WORKER, "clumps", 1, STEPS, out, *more, cwd=hit_by_clumps, env=THREADS)
    assert run.returncode == 0, run.stderr[-2000:]
    same(hit_by_clumps / "alone.npz", hit_by_clumps / out)
