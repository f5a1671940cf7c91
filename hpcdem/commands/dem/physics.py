"""Physics on particles beside their motion."""

from __future__ import annotations

from hpcdem.core.errors import CommandError
from hpcdem.physics.dem import saved_state
from hpcdem.physics.dem.simulation import Simulation


def add(sim: Simulation, name: str, **parameters: float) -> None:
    """Physics on the particles beside their motion, from the next step on. There is "diffusion": heat through
    contacts; conductance of each [W/K], capacity [J/(kg K)]; fields temperature [K], heat_source [W], heat_given
    [J]; HIST follows heat and heat_given [J], which are columns of energy.csv."""
    saved_state.add_physics(sim, name, parameters)


def check_time_step(sim: Simulation) -> None:
    """CommandError if the time step is too large for the physics of the model; it is closed. Collective."""
    for physics in sim.physics:
        limit = physics.stable_time_step(sim)
        if sim.clock.dt > limit:
            raise CommandError(
                f"the time step {sim.clock.dt:g} s is beyond the stability limit of {physics.name}, {limit:g} s"
            )
