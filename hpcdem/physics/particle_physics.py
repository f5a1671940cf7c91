"""Physics on particles and their contacts beside their motion, and which there are.

A model takes them by name (`Simulation.add_physics`). Their fields are columns of the particles: they get ghosts,
travel with the particles, and stand in checkpoints, frames and the Python interface. Their diagnostics can be followed
by HIST, their energies stand in energy.csv. physics/diffusion is the worked example.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from hpcdem.physics.dem.simulation import Simulation


class ParticlePhysics(Protocol):
    """fields: unit, meaning and initial value by name; energies: the diagnostics [J] that are columns of energy.csv."""

    name: ClassVar[str]
    fields: ClassVar[Mapping[str, tuple[str, str, float]]]
    energies: ClassVar[tuple[str, ...]]

    def parameters(self) -> dict[str, float]:
        """What it was made with, for checkpoints."""

    def diagnostics(self) -> Mapping[str, tuple[str, Callable[[Simulation], float]]]:
        """What HIST can follow: unit and function of the simulation (collective) by name."""

    def prepare(self, sim: Simulation) -> None:
        """Lists, masses or settings are others. Collective."""

    def stable_time_step(self, sim: Simulation) -> float:
        """The largest time step [s] it can bear with the present contacts. The model is closed. Collective."""

    def advance(self, sim: Simulation) -> None:
        """One step, after the forces at the new positions; ghosts have the values of its beginning. Not collective."""

    @staticmethod
    def warm_up(threads: int) -> None:
        """Call every kernel once."""


def _diffusion() -> type[ParticlePhysics]:
    from hpcdem.physics.diffusion.model import Diffusion

    return Diffusion


PHYSICS: Mapping[str, Callable[[], type[ParticlePhysics]]] = {"diffusion": _diffusion}
"""How to get each class: its import brings kernels, which must wait for their cache folder."""
