"""A crack full of slurry between two blocks, in the plane and in space, which calls every kernel of proppant once."""

from __future__ import annotations

from hpcdem.physics.fdem.warm_up import rock, two
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.warm_up import WATER
from hpcdem.physics.proppant.assignments import CONCENTRATION
from hpcdem.physics.proppant.model import Proppant

SAND = {
    "proppant_density": 2650.0, "proppant_size": 1e-5, "proppant_concentration_limit": 0.6, "proppant_modulus": 1e6,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    _settles(2, threads)


def in_space(threads: int = 1) -> None:
    """Call the kernels of proppant between two tetrahedra."""
    _settles(3, threads)


def _settles(dim: int, threads: int) -> None:
    sim = rock(two(dim), threads)
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    flow.fill(None, saturation=1.0)
    flow.prescribe(None, kernels.PRESSURE, 1.0)
    proppant = Proppant.of(sim)
    proppant.assign(None, SAND)
    proppant.prescribe(None, CONCENTRATION, 0.1)
    proppant.fill(None, 0.1)
    sim.step()
