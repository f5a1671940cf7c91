"""A bolt in two blocks, which calls every kernel of bolts once."""

from __future__ import annotations

from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem.warm_up import rock, two

STEEL = {
    "density": 7850.0, "young": 200e9, "diameter": 0.025, "shear_stiffness_rock_bolt": 1e8, "grout_thickness": 0.01,
    "cohesion_rock_grout": 1e5, "cohesion_grout_bolt": 1e5, "friction_rock_grout": 30.0,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    sim = rock(two(2), threads)
    bolts = Bolts.of(sim)
    _, elements = bolts.create([(0.1, 0.2), (0.9, 0.8)], segments=3)
    bolts.assign(elements, STEEL)
    sim.step()
