"""A block falls into a bed of discs: the balance of momentum of all there is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import particles, walls
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.fdem import changes
from tests.blocks.support import rectangle, shaken
from tests.coupled.support import body, discs, momentum, together

G, DT, RADIUS, WIDTH = 9.81, 5e-5, 0.03, 1.8


def forces_of_walls(sim):
    """Force of all walls on the discs (2,) [N]."""
    out, _ = diagnostics.wall_rows(sim)
    return out[:, 2:4].sum(axis=0)


@pytest.mark.parametrize("steps", [1500, pytest.param(8000, marks=pytest.mark.slow)])
def test_balance_of_momentum(tmp_path, steps):
    """From half step to half step momentum changes by dt times gravity and the forces of the walls, and nothing else:
    to rounding."""
    sim = discs([], tmp_path, dt=DT, gravity=(0.0, -G), seed=5)
    walls.box(sim, 0.0, WIDTH, 0.0, 2.0, kn=1e6, ks=5e5, fric=0.3)
    particles.gen_grid(sim, [RADIUS], (0.0, WIDTH), (0.0, 0.7))
    from hpcdem.commands.dem import properties

    properties.prop(sim, density=2500.0, kn=2e6, ks=1e6, fric=0.4)
    count = len(sim.particles)
    assert count > 300
    blocks = body(shaken(rectangle(5, 3, 0.5, 0.3, x0=0.62, y0=0.665), 0.1), gravity=G)
    changes.set_velocity(blocks, None, vx=1.0, vy=-3.0)
    both = together(sim, blocks)
    both.prepare()
    weight = -G * (count * 2500.0 * math.pi * RADIUS**2 + 2500.0 * 0.15)
    start = momentum(both)[:2]
    pushed = np.zeros((steps, 2))
    most = 0
    for step in range(steps):
        pushed[step] = forces_of_walls(sim)  # those that act in the coming step
        both.advance(1)
        most = max(most, int(both.link.slot_on.sum()))
    pushed[0] = 0.0  # forces begin at the end of the first step
    given = [DT * math.fsum(pushed[:, 0]), DT * math.fsum(pushed[:, 1]) + steps * DT * weight]
    changed = momentum(both)[:2] - start
    scale = np.abs(pushed).sum() * DT + steps * DT * abs(weight)
    assert np.abs(changed - given).max() < 1e-12 * scale
    assert most >= 6 and np.abs(pushed).sum(axis=0).min() > 0.0
