"""Physics on particles and their contacts beside their motion: which there are.

A model takes them by name (`Simulation.add_physics`); what it asks of them is `ParticlePhysics` in
physics/dem/simulation.py. Their fields are columns of the particles: they get ghosts, travel with the particles, and
stand in checkpoints, frames and the Python interface. Their diagnostics can be followed by HIST, their energies stand
in energy.csv. physics/diffusion is the worked example.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcdem.physics.dem.simulation import ParticlePhysics


def _diffusion() -> type[ParticlePhysics]:
    from hpcdem.physics.diffusion.model import Diffusion

    return Diffusion


PHYSICS: Mapping[str, Callable[[], type[ParticlePhysics]]] = {"diffusion": _diffusion}
"""Loaders of each class: its import loads numba and kernels, which takes a second."""
