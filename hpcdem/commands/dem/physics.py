"""Physics on particles beside their motion."""

from __future__ import annotations

from hpcdem.core.errors import CommandError
from hpcdem.physics.dem import saved_state
from hpcdem.physics.dem.simulation import Simulation


def add(sim: Simulation, name: str, **parameters: float) -> None:
    """Add physics to the particles, effective from the next step. "diffusion": heat conduction through contacts, with
    conductance of each contact [W/K] and capacity [J/(kg K)]; fields temperature [K], heat_source [W], heat_given [J];
    HIST can record heat and heat_given [J], which are also columns of energy.csv.
    """
    saved_state.add_physics(sim, name, parameters)


def check_time_step(sim: Simulation) -> None:
    """Raise CommandError if the time step exceeds the stability limit of the added physics. The model must be closed.
    Collective.
    """
    for physics in sim.physics:
        limit = physics.stable_time_step(sim)
        if sim.clock.dt > limit:
            raise CommandError(
                f"the time step {sim.clock.dt:g} s is beyond the stability limit of {physics.name}, {limit:g} s"
            )
