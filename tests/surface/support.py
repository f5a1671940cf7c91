"""A basin between two walls, and what its surface is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands.dem import surface, walls
from hpcdem.numerics import landscape
from hpcdem.physics.dem.land import carried_over
from hpcdem.physics.dem.simulation import Simulation
from tests.support import model

SAND: dict[str, Any] = {"rad": [0.8, 1.0], "density": 1.0, "kn": 1e5, "ks": 1e5, "fric": 0.5, "damp": 0.4}
LARGEST = 1.0


def basin(folder: Path, width: float) -> Simulation:
    """A floor of this width [m] between two walls, under gravity, without particles."""
    sim = model(folder, dt=2e-3, gravity=(0.0, -10.0))
    of = {"kn": 1e5, "ks": 1e5, "fric": 0.5}
    walls.wall(sim, 0, ((0.0, 0.0), (width, 0.0)), **of)
    for ident, x in ((1, 0.0), (2, width)):
        walls.wall(sim, ident, ((x, 0.0), (x, 60.0)), **of)
    return sim


def heights(sim: Simulation, ident: int, width: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sides (n + 1,) of the columns of a process, their heights (n,) of the discs, and those with what it still owes
    and with discs that settle [m]."""
    land = sim.lands[ident]
    near = surface.near_surface(sim)
    first, sides = landscape.edges(0.0, width, land.spacing)
    h = surface._heights(land, near, sides, surface._barriers(sim)[0], LARGEST)
    owed = carried_over(land.owed, first, len(h))
    return sides, h, h + owed * land.unit / np.diff(sides)


def assert_adds_up(sim: Simulation, ident: int) -> None:
    """The balance is exact, and what is carried is less than a disc."""
    land = sim.lands[ident]
    settling = sum(area for _, area, _ in land.settling)
    owed = sum(land.owed.values())
    assert land.asked == land.deposited[0] + settling + land.lost[0] - land.eroded[0] + owed
    assert abs(owed) <= land.of_disc(LARGEST)
