"""A tiny run of both that calls every kernel of their contacts once."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.warm_up import ROCK


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    blocks = Blocks(SerialComm(), threads)
    blocks.take_mesh(Mesh.of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], [(0, 1, 2, 3)]))
    changes.element_model(blocks, None, "mech_iso_elastic", ROCK)
    sim = Simulation(SerialComm(), threads, Path("."))
    sim.settings.dt = sim.clock.dt = 1e-6
    sim.settings.disk = "on"
    row = sim.materials.row(density=1.0, kn=1e3, ks=1e3, fric=0.5)
    sim.particles.append(
        x=np.array([0.5, 0.2]), y=np.array([1.09, 1.09]), radius=0.1, material=np.full(2, row), gid=np.arange(2)
    )
    sim.hist = sim.hist.extended(2)
    sim.next_gid = 2
    both = Coupled(sim, blocks)
    both.settle_time_step()
    both.advance(2)
    sim.energy = Budget()
    sim.energy.begin(sim)
    both.advance(2)
    both.energies()
    both.contacts()
