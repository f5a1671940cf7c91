"""A warm crack between two blocks, in the plane and in space, which calls every kernel of heat once."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.warm_up import rock, two
from hpcdem.physics.heat import friction, kernels, kernels_space
from hpcdem.physics.heat.model import Heat

GRANITE = {"conductivity": 2.7, "capacity": 1000.0, "expansion_coeficient": 1e-5, "transfer_coeficient": 5.0}


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    sim = _heated(2, threads)
    pairs, one = np.array([0]), np.ones(2)
    friction.friction_heat(
        pairs, pairs + 1, np.zeros(2, np.int64), np.arange(2), np.zeros(2, bool), sim.x, sim.v,
        np.zeros((1, 6)), one, one, 1.0, np.zeros((2, 3)),
    )  # fmt: skip
    _fluid()


def in_space(threads: int = 1) -> None:
    """Call the kernels of heat between two tetrahedra."""
    _heated(3, threads)
    pairs, one = np.zeros(1, np.int64), np.ones(1)
    kernels_space.friction_heat(
        pairs, pairs, pairs, pairs, pairs, np.zeros(1, np.uint8), np.zeros((1, 16)), np.zeros((1, 21)),
        np.zeros((1, 5)), one, one, 1.0, np.zeros((1, 4)),
    )  # fmt: skip


def _heated(dim: int, threads: int) -> Blocks:
    sim = rock(two(dim), threads)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(np.array([0]), 20.0)
    heat.expose(None, flux=1.0)
    changes.crack(sim, np.flatnonzero(sim.joint_exists()))
    sim.step()
    return sim


def _fluid() -> None:
    """Call the kernels of one channel between two nodes, without those of the flow."""
    begin, channel, side = np.array([0, 1, 2]), np.zeros(2, np.int64), np.array([-1.0, 1.0])
    ends, walls, held = np.array([[0, 1]]), np.zeros((1, 4), np.int64), np.full(2, -1)
    one, two, state = np.ones(1), np.ones(2), np.ones((2, kernels.FLUID_STATE))
    face, out, wall_heat = np.empty(1), np.empty(2), np.zeros((1, 4))
    kernels.upstream(begin, channel, side, ends, one, one, held, state[:2], state)
    kernels.rises(begin, channel, side, ends, one, walls, one, one, held, 1.0, state[:2], state)
    kernels.faces(ends, one, one, True, 1.0, state, face)
    kernels.carry(
        1.0, begin, channel, side, ends, one, face, one, walls, one, one, held, one, two, two, two, 1.0, state, out, out
    )
    kernels.to_walls(1.0, ends, walls, one, one, state, wall_heat)
    kernels.from_walls(walls, wall_heat, one)
