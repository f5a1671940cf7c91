"""A liner on two blocks, which calls every kernel of liners once."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem.warm_up import rock, two
from hpcdem.physics.liners.model import Liners

SHOTCRETE = {
    "density": 2400.0, "young": 20e9, "thickness": 0.1, "tensile_strength": 2e6, "compressive_strength": 30e6,
    "normal_stiffness": 1e10, "shear_stiffness": 1e10, "bond_tensile_strength": 1e6, "bond_cohesion": 1e6,
    "bond_friction": 30.0,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    _step(2, threads)


def in_space(threads: int = 1) -> None:
    """Call the kernels of liners in a model in space. Writes nothing."""
    _step(3, threads)


def _step(dim: int, threads: int) -> None:
    sim = rock(two(dim), threads)
    liners = Liners.of(sim)
    _, elements = liners.create(np.array([0, 1]))
    liners.assign(elements, SHOTCRETE)
    sim.step()
