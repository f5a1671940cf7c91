"""64 pretended ranks: the same bits as one, and what a rank does does not grow with their number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties, running, settings
from hpcdem.halo.comm import SerialComm
from hpcdem.halo.migrate import Migration
from hpcdem.physics.dem.simulation import Simulation
from tests.pretended import Pretended, Ranks

PER_RANK, ROWS, STEPS = 8, 6, 120
"""Discs of one rank along x and y, steps."""


def flow(comm: Any, size: int) -> Simulation:
    """Discs on a lattice, as many for each of `size` ranks, that touch and drift to the right, ready to step."""
    sim = Simulation(comm, outdir=".", balance_on=False)
    settings.set_option(sim, "dt", 1e-3)
    settings.set_option(sim, "disk", "on")
    particles.gen_grid(sim, [0.5], (0.0, float(PER_RANK * size)), (0.0, float(ROWS)))
    properties.prop(sim, density=1000.0, kn=1e6, ks=1e6, fric=0.3)
    properties.prop(sim, xv=10.0)
    p = sim.particles
    p["vy"][:] = 0.5 * np.sin(p["x"])
    running.prepare(sim)
    return sim


def state(sim: Simulation) -> dict[int, tuple[float, ...]]:
    p = sim.particles
    columns = (p[name].tolist() for name in ("gid", "x", "y", "vx", "vy", "spin"))
    return {gid: tuple(row) for gid, *row in zip(*columns)}


def steps(comm: Any, size: int) -> tuple[dict, Any, int]:
    """State at the end, what was counted, rebuilds."""
    sim = flow(comm, size)
    sim.step()
    before = sim.rebuilds
    if isinstance(comm, Pretended):
        comm.watch()
    for _ in range(STEPS):
        sim.step()
    counts = dict(comm.counts) if isinstance(comm, Pretended) else {}
    return state(sim), counts, sim.rebuilds - before


@pytest.fixture(scope="module")
def on_64() -> list[tuple[dict, dict, int]]:
    return Ranks(64).run(lambda comm: steps(comm, 64))


def test_64_ranks_come_to_the_same_bits(on_64: list[tuple[dict, dict, int]]) -> None:
    alone, _, rebuilds = steps(SerialComm(), 64)
    together = {gid: row for part, *_ in on_64 for gid, row in part.items()}
    assert together == alone and len(alone) == sum(len(part) for part, *_ in on_64) == 64 * PER_RANK * ROWS
    assert rebuilds == on_64[0][2] > 3
    assert {gid // ROWS // PER_RANK for gid in on_64[30][0]} != {30}, "nobody went over to another rank"


def test_what_a_rank_does_does_not_grow_with_their_number(on_64: list[tuple[dict, dict, int]]) -> None:
    """Calls of functions, messages, reductions of the steps and rebuilds of a rank in the middle, where all have the
    same neighbourhood (but for where cells begin); and nothing is made that has a place for every rank."""
    on_8 = Ranks(8).run(lambda comm: steps(comm, 8))
    few, many = on_8[4][1], on_64[36][1]
    assert many["messages"] > STEPS and many["calls"] > STEPS
    assert many.keys() == few.keys() == {"messages", "calls", "reductions"}
    assert many["reductions"] == few["reductions"]
    assert many["messages"] <= few["messages"] + 2 and many["calls"] <= 1.01 * few["calls"]


@pytest.mark.parametrize("size", [8, 64])
def test_a_border_that_jumps_sends_far_and_costs_its_messages_only(size: int) -> None:
    """Everybody's first particle goes to the rank three further, the second to the neighbour, the third stays."""

    def move(comm: Pretended) -> tuple[list[float], dict]:
        rows = np.array([[10.0 * comm.rank + k] for k in range(3)])
        leave = np.array([0, 1])
        comm.watch()
        migration = Migration(comm, 3, leave, np.array([(comm.rank + 3) % size, (comm.rank + 1) % size]))
        arrived, counts, entries = migration.exchange(rows[migration.leave], np.array([1, 1]), rows[migration.leave])
        assert counts.tolist() == [1, 1] and (entries == arrived).all()
        return [*rows[migration.stay(), 0], *arrived[:, 0]], dict(comm.counts)

    for rank, (mine, counts) in enumerate(Ranks(size).run(move)):
        sources = sorted([(rank - 3) % size, (rank - 1) % size])
        expected = [10.0 * s + (0.0 if (s + 3) % size == rank else 1.0) for s in sources]
        assert mine == [10.0 * rank + 2.0, *expected]
        assert counts["messages"] == 2 and "lists" not in counts
