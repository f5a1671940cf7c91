"""A wet crack between two blocks, in the plane and in space, which calls every kernel of flow once."""

from __future__ import annotations

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.warm_up import ROCK
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow

WATER = {
    "fluid_density": 1000.0, "fluid_bulk": 1e6, "viscosity": 1e-6, "aperature_initial": 1e-4, "aperature_minumum": 1e-5,
    "turbulence": 1.0,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    _flow(Mesh.of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], [(0, 1, 2, -1), (0, 2, 3, -1)]), threads)


def in_space(threads: int = 1) -> None:
    """The same between two tetrahedra."""
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)]
    _flow(Mesh.of(points, [(0, 1, 2, 3), (1, 4, 2, 3)]), threads)


def _flow(mesh: Mesh, threads: int) -> None:
    sim = Blocks(SerialComm(), threads)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    flow.prescribe(None, kernels.PRESSURE, 1.0)
    sim.step()
    flow.values(CHANNEL, "flow_rate")
