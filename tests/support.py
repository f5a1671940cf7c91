"""Short words for tests that drive the real loop from Python."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcdem.commands.dem import cycles, properties, settings
from hpcdem.core.selection import Ids
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation


def model(folder: Path, dt: float = 1e-3, **options: Any) -> Simulation:
    """An empty model that writes into `folder`; options as in SET: disk="off", gravity=(0.0, -9.8), lsm=..."""
    sim = Simulation(outdir=folder)
    settings.set_option(sim, "dt", dt)
    for name, value in options.items():
        settings.set_option(sim, name, value)
    return sim


def only(gid: int) -> Ids:
    """RANGE of one particle."""
    return Ids(gid, gid)


def value(sim: Simulation, name: str, gid: int = 0) -> float:
    """A field of one particle (rows change places when lists are rebuilt)."""
    return float(sim.particles[name][sim.particles["gid"] == gid][0])


def position(sim: Simulation, gid: int = 0) -> np.ndarray:
    """Centre (2,) [m]."""
    return np.array([value(sim, "x", gid), value(sim, "y", gid)])


def velocity(sim: Simulation, gid: int = 0) -> np.ndarray:
    """Velocity (2,) at the last half step [m/s]."""
    return np.array([value(sim, "vx", gid), value(sim, "vy", gid)])


def force(sim: Simulation, gid: int = 0) -> np.ndarray:
    """Sum of contact forces and torque (3,) [N, N m]."""
    return sim.lists.owned_forces()[sim.particles["gid"] == gid][0]


def body(sim: Simulation, gid: int = 0) -> tuple[float, float]:
    """Mass [kg] and moment of inertia [kg m^2]."""
    mass, inertia = sim.body[sim.particles["gid"] == gid][0, :2]
    return float(mass), float(inertia)


class Contact(NamedTuple):
    """One contact as the program reports it: forces on the lower id (or on the particle at a wall), place, overlap."""

    fn: float
    fs: float
    fx: float
    fy: float
    x: float
    y: float
    overlap: float
    stiffness: float


def pair(sim: Simulation, a: int = 0, b: int = 1) -> Contact | None:
    """The contact or bond of two particles, or None."""
    out, ids = diagnostics.contact_rows(sim)
    rows = np.flatnonzero((ids[:, 0] == a) & (ids[:, 1] == b))
    return Contact(*map(float, out[rows[0]])) if len(rows) else None


def at_wall(sim: Simulation, gid: int = 0, wall: int = 0) -> Contact | None:
    """The contact of a particle with a wall (by its id), or None."""
    out, ids = diagnostics.wall_rows(sim)
    rows = np.flatnonzero((ids[:, 0] == gid) & (ids[:, 1] == sim.walls.row(wall)))
    return Contact(*map(float, out[rows[0]])) if len(rows) else None


def steps(sim: Simulation, n: int) -> Simulation:
    """n steps of the loop, without files."""
    cycles.prepare(sim)
    for _ in range(n):
        sim.step()
    return sim


def watch(sim: Simulation, n: int, look: Callable[[Simulation], Any]) -> np.ndarray:
    """(n + 1, ...) what `look` sees before the first and after each of n steps."""
    cycles.prepare(sim)
    seen = [look(sim)]
    for _ in range(n):
        sim.step()
        seen.append(look(sim))
    return np.array(seen)


def carry(sim: Simulation, gid: int, x: float = 0.0, y: float = 0.0, angle: float = 0.0, n: int = 100) -> None:
    """Move a fixed particle by (x, y) [m] and turn it by `angle` [rad] in n equal steps, then hold it."""
    t = n * sim.settings.dt
    properties.prop(sim, only(gid), xv=x / t, yv=y / t, spin=angle / t)
    steps(sim, n)
    properties.prop(sim, only(gid), xv=0.0, yv=0.0, spin=0.0)


def held_for_a_step(sim: Simulation) -> None:
    """One step in which nothing moves, so that contact forces are in place when the particles are let go: a new
    particle's first step sees none."""
    dofs = ("x", "y", "spin")
    properties.fix(sim, dofs)
    steps(sim, 1)
    properties.free(sim, dofs)


def crossing(t: np.ndarray, values: np.ndarray, level: float = 0.0) -> float:
    """First time at which `values` passes `level` after having left it, by linear interpolation."""
    side = np.sign(values - level)
    first = np.flatnonzero(side)[0]
    k = first + np.flatnonzero(side[first:] != side[first])[0]
    return float(t[k - 1] + (level - values[k - 1]) * (t[k] - t[k - 1]) / (values[k] - values[k - 1]))
