"""A wet crack between two blocks, in the plane and in space, which calls every kernel of flow once."""

from __future__ import annotations

from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.fdem.warm_up import rock, two
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow

WATER = {
    "fluid_density": 1000.0, "fluid_bulk": 1e6, "viscosity": 1e-6, "aperature_initial": 1e-4, "aperature_minumum": 1e-5,
    "turbulence": 1.0,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    _flow(2, threads)


def in_space(threads: int = 1) -> None:
    """Call the kernels of flow between two tetrahedra."""
    _flow(3, threads)


def _flow(dim: int, threads: int) -> None:
    sim = rock(two(dim), threads)
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    flow.prescribe(None, kernels.PRESSURE, 1.0)
    sim.step()
    flow.values(CHANNEL, "flow_rate")
