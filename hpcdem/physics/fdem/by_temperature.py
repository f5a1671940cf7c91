"""Moduli and strengths that follow tables over temperature, or over another field of elements (physics/fields.py): of
elements by the mean of their corners, of joints by that of their two ends (which both sides have alike).

A row of properties holds the largest value of such a table, and by it go masses, time steps and contact: they hold for
all temperatures. Kernels read what is made of it here, each time temperatures have changed. Young's modulus is carried
by both Lame constants alike (Poisson's ratio stays); stress is that of the strain by the present modulus, also the part
that was set as initial stress, at the temperature at which the element is free of thermal stress.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.properties import Rows, temperature_table

if TYPE_CHECKING:
    from hpcdem.physics.fdem.mesh import Mesh
    from hpcdem.physics.fdem.state import State

Of = Callable[[str], np.ndarray]
TEMPERATURE, UNSTRESSED = "temperature", "unstressed"
"""Columns of elements, see physics/heat/model.py."""


def means(sim: State, name: str = TEMPERATURE) -> np.ndarray:
    """(n_own,) mean temperatures [K], or values of the field with this name, of the owned elements, parts of a
    hexahedron have that of all of it; the model is closed."""
    mesh, t = sim.the_mesh(), sim.cold[name]
    found = of_corners(mesh, sim.number[sim.owned], t)
    if len(mesh.hexes):
        hexes = sim.hex_rows()
        found[hexes.rows] = hexes.means(t)[:, None]
    return found


def of_corners(mesh: Mesh, number: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Means (n,) of these elements (n,) with temperatures t (n, 3 or 4) of their corners."""
    total = (t[:, 0] + t[:, 1]) + t[:, 2]
    if t.shape[1] == 3:
        return total / 3.0
    return np.where(mesh.cells[number, 3] >= 0, (total + t[:, 3]) / 4.0, total / 3.0)


def values(sim: State, rows: Rows, name: str, row: np.ndarray, t: Of) -> np.ndarray:
    """A property (n,) of objects with these rows (n,) at temperatures t("temperature") (n,) [K], or values of other
    fields."""
    found, number = rows.column(name)[row], rows.column(temperature_table(name))[row].astype(np.int64)
    for one in np.unique(number[number > 0]).tolist():
        at = number == one
        table = sim.followed[one - 1]
        found[at] = table.at(t(table.over or TEMPERATURE)[at])
    return found


def followed(sim: State, rows: Rows, row: np.ndarray, at: np.ndarray) -> Iterator[tuple[str, int]]:
    """Fields over which tables of objects are, of which those `at` (n,) bool with these rows (n,) follow some, and the
    first of these."""
    for name in ("young", "cohesion", "tensile", "tensile_strength", "gf1", "gf2"):
        number = rows.column(temperature_table(name))[row].astype(np.int64) * at
        for one in np.unique(number[number > 0]).tolist():
            yield sim.followed[one - 1].over or TEMPERATURE, int(np.flatnonzero(number == one)[0])


def unstressed(sim: State) -> Of:
    """Values of a field at which elements (n_own,) are free of the stress that it brings, by its name."""
    return lambda name: sim.cold[UNSTRESSED if name == TEMPERATURE else f"{name}_{UNSTRESSED}"][:, 0]


def part_of_young(sim: State, row: np.ndarray | None = None, t: Of | None = None) -> np.ndarray | None:
    """Young's modulus (n_own,) of owned elements over the largest that their table has; None: no table. row (n_own,):
    their rows if they had others; t: their temperatures, see `values`, if not those of now."""
    rows = sim.element_rows
    if not rows.column(temperature_table("young")).any():
        return None
    row = sim.element_row[sim.number[sim.owned]] if row is None else row
    if not rows.column(temperature_table("young"))[row].any():
        return None
    return values(sim, rows, "young", row, partial(means, sim) if t is None else t) / np.maximum(
        rows.column("young")[row], 1e-300
    )
