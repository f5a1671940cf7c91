"""Heat conduction through the contacts of discs, explicit in time: each contact that touches has the conductance H
[W/K], each particle the capacity c m. Faces of blocks and walls let no heat through."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.diffusion.kernels import inflow

if TYPE_CHECKING:
    from hpcdem.physics.dem.simulation import Simulation


@dataclass
class Diffusion:
    """conductance of a contact [W/K] and capacity [J/(kg K)]."""

    conductance: float
    capacity: float

    name: ClassVar[str] = "diffusion"
    fields: ClassVar[Mapping[str, tuple[str, str, float]]] = {
        "temperature": ("K", "temperature", 0.0),
        "heat_source": ("W", "heat supplied to the particle", 0.0),
        "heat_given": ("J", "heat supplied by its source", 0.0),
    }
    energies: ClassVar[tuple[str, ...]] = ("heat", "heat_given")

    def __post_init__(self) -> None:
        for name, value in self.parameters().items():
            if not (isinstance(value, (int, float)) and 0.0 < value < math.inf):
                raise CommandError(f"diffusion: {name} must be a positive number, got {value!r}")

    def parameters(self) -> dict[str, float]:
        """Return the parameters of the constructor."""
        return asdict(self)

    def diagnostics(self) -> dict[str, tuple[str, Callable[[Simulation], float]]]:
        """Heat of all particles, c m T, and what sources have given."""
        return {"heat": ("J", self.heat), "heat_given": ("J", self.heat_given)}

    def heat(self, sim: Simulation) -> float:
        """Sum of c m T [J]. Collective."""
        return exact_sum(self.capacity * sim.body[:, 0] * sim.particles["temperature"], sim.comm)

    def heat_given(self, sim: Simulation) -> float:
        """Sum the heat supplied by sources [J]. Collective."""
        return exact_sum(sim.particles["heat_given"].copy(), sim.comm)

    def prepare(self, sim: Simulation) -> None:
        """CommandError if there are clumps, whose discs have no contacts with each other, or particles without mass."""
        if sim.clumps:
            raise CommandError("diffusion: heat inside clumps is not supported; use a model without clumps")
        light = sim.count(int((sim.body[:, 0] <= 0.0).sum()))
        if light:
            raise CommandError(f"diffusion: {light} particles have no mass, so they can hold no heat (PROP density)")

    def _inflow(self, sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
        """Compute the inflow of the owned particles: heat from neighbours (n,) [W], and number of neighbours."""
        p = sim.particles
        flow, links = np.zeros(len(p.hot)), np.zeros(len(p.hot), np.int64)
        temperature = p.more[:, p.extra["temperature"].column].copy()
        for piece in sim.lists.pieces():
            inflow(p.hot, *piece, temperature, self.conductance, flow, links)
        return flow[p.owned], links[p.owned]

    def stable_time_step(self, sim: Simulation) -> float:
        """min c m / (n H) over the particles and their n contacts: no eigenvalue goes beyond 2 n H / (c m)."""
        links = self._inflow(sim)[1]
        rate = (links * self.conductance / (self.capacity * sim.body[:, 0])).max(initial=0.0)
        rate = float(sim.comm.max_into(np.array([rate]))[0])
        return 1.0 / rate if rate > 0.0 else math.inf

    def advance(self, sim: Simulation) -> None:
        """Forward Euler."""
        p, dt = sim.particles, sim.clock.dt
        flow, _ = self._inflow(sim)
        given = p["heat_source"] * dt
        p["temperature"][:] += (flow * dt + given) / (self.capacity * sim.body[:, 0])
        p["heat_given"][:] += given

    @staticmethod
    def warm_up(threads: int) -> None:
        """Call the kernels with two touching discs."""
        from hpcdem.core.comm import SerialComm
        from hpcdem.physics.dem.simulation import Simulation

        sim = Simulation(SerialComm(), threads, Path("."))
        sim.add_physics(Diffusion(1.0, 1.0))
        row = sim.materials.row(density=1.0, kn=1.0)
        sim.particles.append(x=np.array([0.0, 1.0]), y=0.0, radius=0.5, material=np.full(2, row), gid=np.arange(2))
        sim.hist = sim.hist.extended(2)
        sim.clock.dt = 1e-3
        sim.close_model()
        sim.step()
