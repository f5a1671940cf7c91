"""A warm crack between two blocks, which calls every kernel of heat once."""

from __future__ import annotations

import numpy as np

from hpcdem.halo.comm import SerialComm
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.warm_up import ROCK
from hpcdem.physics.heat.model import Heat

GRANITE = {"conductivity": 2.7, "capacity": 1000.0, "expansion_coeficient": 1e-5}


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    sim = Blocks(SerialComm(), threads)
    sim.take_mesh(Mesh.of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], [(0, 1, 2, -1), (0, 2, 3, -1)]))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(np.array([0]), 20.0)
    heat.expose(None, flux=1.0)
    sim.step()
