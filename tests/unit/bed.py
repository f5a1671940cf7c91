"""A small settled bed of spheres and a push into it, run once for all tests that need true contacts."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from hpcdem.commands.dem import bonds, particles, properties, walls
from hpcdem.core.selection import Interval
from hpcdem.io.frame import Frame
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation
from tests import support

G, WIDTH = 9.8, 6000.0


def settled(fric: float = 0.0) -> Simulation:
    """6 km x some 2.7 km between three walls, at rest."""
    sim = support.model(Path("unused"), dt=5e-2, disk="off", gravity=(0.0, -G))
    walls.wall(sim, 0, ((0.0, 0.0), (WIDTH, 0.0)))
    walls.wall(sim, 1, ((0.0, 6000.0), (0.0, 0.0)))
    walls.wall(sim, 2, ((WIDTH, 0.0), (WIDTH, 6000.0)))
    particles.gen(sim, 10000, [60.0, 80.0], (0.0, WIDTH), (0.0, 6000.0))
    properties.prop(sim, density=2.5e3, fric=fric, shear=2.9e9, poiss=0.2, damp=0.4, hertz=True)
    support.steps(sim, 3000)
    return sim


@cache
def resting() -> Frame:
    """The bed long at rest."""
    return diagnostics.frame(support.steps(settled(), 2000))


@cache
def pushed() -> tuple[Frame, ...]:
    """Bonded, cut and pushed from the left: four frames; particles are deleted before the third, added before the
    fourth. Some bonds are open."""
    sim = settled(fric=0.3)
    bonds.bond(sim, ebmod=2e8, gbmod=2e8, tstrength=2e7, sstrength=4e7)
    walls.wall(sim, 1, xv=2.0)
    frames = [diagnostics.frame(sim)]
    support.steps(sim, 2000)
    frames.append(diagnostics.frame(sim))
    particles.delete(sim, Interval("y", float(np.max(sim.particles["y"])) - 150.0, 99000.0))
    support.steps(sim, 1000)
    frames.append(diagnostics.frame(sim))
    particles.gen(sim, 20, [60.0, 80.0], (2500.0, 5000.0), (4000.0, 6000.0))
    properties.prop(sim, Interval("y", 4000.0, 99000.0), density=2.5e3, shear=2.9e9, poiss=0.2, damp=0.4, hertz=True)
    support.steps(sim, 500)
    frames.append(diagnostics.frame(sim))
    return tuple(frames)
