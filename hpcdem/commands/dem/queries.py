"""Quantities of particles that a program can query."""

from __future__ import annotations

import numpy as np

from hpcdem.commands.dem import output
from hpcdem.physics.dem import diagnostics, mean_stress
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import total


def extents(sim: Simulation) -> dict[str, float]:
    """Return {left, right, bottom, top} of the particles that are not fixed in both x and y [m]."""
    return sim.extents()


def wall_force(sim: Simulation, id: int) -> tuple[float, float]:
    """Return the force on a wall (x, y) [N], summed exactly."""
    parts = sim.walls.parts(id)
    sim.close_model()
    x, y = total(diagnostics.wall_forces(sim), parts)
    return float(x), float(y)


def wall_forces(sim: Simulation) -> dict[int, tuple[float, float]]:
    """Return the force on every wall (x, y) [N] by id, with one pass over the contacts."""
    sim.close_model()
    force = diagnostics.wall_forces(sim)
    of = {id: total(force, parts) for id, parts in sim.walls.polylines().items()}
    return {id: (float(x), float(y)) for id, (x, y) in of.items()}


def kinetic_energy(sim: Simulation) -> float:
    """Return the kinetic energy, the sum of (m v^2 + I w^2) / 2 [J], summed exactly."""
    sim.close_model()
    return diagnostics.kinetic_energy(sim)


def unbalanced(sim: Simulation) -> float:
    """Return the largest unbalanced force of a free particle over the mean contact force; small at equilibrium."""
    sim.close_model()
    return output.unbalanced(sim)


def stress(sim: Simulation, y: tuple[float, float] | None = None) -> dict[str, float]:
    """Return the mean stress between periodic boundaries, {sxx, syy, sxy} [Pa], positive in compression; sxy is the
    force in x across horizontal lines.

    Parameters
    ----------
    y : heights, (lower, upper) [m] (default: those of BOX).
    """
    sim.close_model()
    return {name: mean_stress.mean(sim, name, y) for name in mean_stress.COMPONENTS}


def clumps(sim: Simulation) -> dict[str, np.ndarray]:
    """Return the clumps of the whole model on every rank, in the order of ids: id (that of the first member), x y [m],
    vx vy [m/s], spin [rad/s], angle [rad], area, mass, inertia, members (their number).
    """
    sim.close_model()
    return diagnostics.clumps(sim)
