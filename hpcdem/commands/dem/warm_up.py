"""A tiny run that calls every kernel once, so that they are compiled before anyone waits for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties, settings, walls
from hpcdem.core.comm import SerialComm
from hpcdem.core.selection import Ids
from hpcdem.numerics.exact_sum import BINS_SHAPE
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.simulation import Simulation


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    sim = _model(threads)
    sim.particles["x"][0] += 0.1  # much faster than all others
    sim.rebuild()
    sim.check_soon()
    sim.step()
    bonds.bond(sim, Ids(0, 3), ebmod=1.0, gbmod=1.0, tstrength=1e9, sstrength=1e9)
    bonds.break_bonds(sim, Ids(0, 1))
    settings.set_option(sim, "frac", 0.1)
    cycles.prepare(sim)
    walls.wall(sim, 0, xv=0.1)
    cycles.prepare(sim)
    sim.rebuild()
    sim.step()
    diagnostics.highest_frequency(sim)
    diagnostics.frame(sim)
    diagnostics.critical_dt(sim)
    laws.tangent_normal_stiffness(1.0, 1.0, 1.0, 1.0)  # SET frac where nothing touches


def with_energy(threads: int = 1) -> None:
    """Compile the kernels of the energy budget."""
    sim = _model(threads)
    sim.energy = Budget()
    sim.energy.begin(sim)
    walls.wall(sim, 0, xv=0.1)
    bonds.bond(sim, Ids(0, 3), ebmod=1.0, gbmod=1.0, tstrength=1e9, sstrength=1e9)
    cycles.prepare(sim)
    sim.rebuild()
    sim.step()
    sim.energy.evaluate(sim)


def with_clumps(threads: int = 1) -> None:
    """Compile the kernels of clumps."""
    sim = _model(threads)
    clumps.join(sim, Ids(4, 6))
    cycles.prepare(sim)
    sim.step()
    diagnostics.highest_frequency(sim)
    diagnostics.frame(sim)
    diagnostics.critical_dt(sim)


def with_restitution(threads: int = 1) -> None:
    """Compile the kernels of the dashpots of SET restitution."""
    sim = _model(threads)
    settings.set_option(sim, "restitution", 0.5)
    cycles.prepare(sim)
    sim.step()
    sim.dashpots.fastest(sim)


def with_rolling(threads: int = 1) -> None:
    """Compile the kernels of rolling resistance."""
    sim = _model(threads)
    properties.prop(sim, rfric=0.1)
    cycles.prepare(sim)
    sim.step()
    diagnostics.highest_frequency(sim)
    assert sim.rolling is not None
    for book in (sim.rolling.book_lost, sim.rolling.book_stored):
        book(sim, np.zeros(BINS_SHAPE, np.int64), np.zeros(BINS_SHAPE, np.int64))


def _model(threads: int) -> Simulation:
    """Particles of all kinds between walls, after a step."""
    sim = Simulation(SerialComm(), threads=threads, outdir=Path("."))
    particles.start(sim)
    settings.set_option(sim, "dt", 1e-4)
    walls.box(sim, -10.0, 10.0, -10.0, 20.0)
    walls.wall(sim, 0, ((-5.0, 0.0), (5.0, 0.0)), fric=0.3)
    particles.gen_grid(sim, [0.5], (-2.0, 2.0), (-0.1, 2.0))
    particles.gen(sim, 2, [0.5], (3.0, 6.0), (1.0, 6.0))
    particles.gline(sim, (6.5, 1.0), (8.5, 1.0), 0.5)
    properties.prop(sim, density=1.0, shear=1e3, poiss=0.2, hertz=True)
    cycles.prepare(sim)
    sim.step()
    return sim
