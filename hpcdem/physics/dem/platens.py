"""Stress and strain between platens: what HIST gstress, gstrain, xstress, ystress, xstrain and ystrain follow.

A platen is a wall, or the particles of a group. Stress is force over width and SET thickness, strain (D0 - D) / D0 of
the distance D of two middles. Both are positive in compression and shortening. The words are those of published scripts
and of the description of a reader (GitHub: ZDEM_Plot_Damage_Evolution_And_Crack_Thresholds); that the width is the
platen's own is a decision. Sums are exact, so the numbers do not depend on ranks and threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Group
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.dem import diagnostics, loops
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import total

AXES = "xy"


@dataclass(frozen=True)
class OfParts:
    """begin(sim, what): checks the parts; of a strain axis and distance now. value(sim, what, id of the history)."""

    unit: str
    begin: Callable[[Simulation, str], tuple[int, float] | None]
    value: Callable[[Simulation, str, int], float]


def _parts(what: str) -> list[str]:
    """The names in ``gstrain group a|b``."""
    words = what.split(maxsplit=2)
    if len(words) < 3:
        raise CommandError(f"HIST {what}: expected for example 'gstress group top' or 'ystrain wall 0|3'")
    return words[2].split("|")


# ---- groups ----------------------------------------------------------------------------------------------------------


def _members(sim: Simulation, name: str) -> np.ndarray:
    """Flags (n_own,) of the particles of a group."""
    return Group(name).mask({"group": sim.particles["group"], "group_names": sim.groups})


def _mean_place(sim: Simulation, which: np.ndarray) -> np.ndarray:
    """Mean of the centres (2,) [m]; NaN for nobody. Collective."""
    n, p = sim.count(int(which.sum())), sim.particles
    return np.array([exact_sum(p[axis][which], sim.comm) for axis in AXES]) / (n if n else math.nan)


def _some(sim: Simulation, name: str) -> np.ndarray:
    which = _members(sim, name)
    if not sim.count(int(which.sum())):
        raise CommandError(f"HIST: no particle is in group {name}")
    return which


def _begin_group_stress(sim: Simulation, what: str) -> None:
    _some(sim, _parts(what)[0])


def group_stress(sim: Simulation, what: str, _: int) -> float:
    """Force of all others on the particles of a group along its axis, over its width across and SET thickness [Pa].

    The axis is that in which the group is thinner. Positive where the force points away from the other particles; NaN
    while the group is empty. Collective.
    """
    p, which = sim.particles, _members(sim, _parts(what)[0])
    centres, r = np.stack([p["x"], p["y"]], axis=1)[which], p["radius"][which, None]
    ends = np.full((2, 2), -np.inf)
    if len(centres):
        ends[:] = (r - centres).max(axis=0), (centres + r).max(axis=0)
    sim.comm.max_into(ends)
    span = ends.sum(axis=0)
    axis = 1 if span[0] >= span[1] else 0
    force = (sim.lists.owned_forces()[:, :2] - loops.pressed(sim))[which, axis]
    away = _mean_place(sim, which)[axis] - _mean_place(sim, ~which)[axis]
    total = exact_sum(np.ascontiguousarray(force), sim.comm)
    if not np.isfinite(span).all():
        return math.nan
    return total * (-1.0 if away < 0.0 else 1.0) / (float(span[1 - axis]) * sim.settings.thickness)


def _begin_group_strain(sim: Simulation, what: str) -> tuple[int, float]:
    first, second = (_mean_place(sim, _some(sim, name)) for name in _parts(what))
    return _longest("groups", what, np.abs(first - second))


def _longest(kind: str, what: str, apart: np.ndarray, axis: int | None = None) -> tuple[int, float]:
    axis = int(np.argmax(apart)) if axis is None else axis
    if not apart[axis] > 0.0:
        raise CommandError(f"HIST {what}: the {kind} are not apart in {AXES[axis]}")
    return axis, float(apart[axis])


def _strain(distance: np.ndarray, origin: tuple[int, float]) -> float:
    axis, before = origin
    return (before - float(distance[axis])) / before


def group_strain(sim: Simulation, what: str, ident: int) -> float:
    """(D0 - D) / D0 of the mean places of two groups; NaN while one is empty. Collective."""
    first, second = (_mean_place(sim, _members(sim, name)) for name in _parts(what))
    return _strain(np.abs(first - second), sim.history_origins[ident])


# ---- walls -----------------------------------------------------------------------------------------------------------


def _ends(sim: Simulation, name: str) -> np.ndarray:
    return sim.walls.ends(sim.walls.parts(int(name)))


def _middle(sim: Simulation, name: str) -> np.ndarray:
    first, last = _ends(sim, name)
    return np.asarray(0.5 * (first + last))


def _wall_width(sim: Simulation, what: str) -> float:
    """Extent of the wall across the axis of ``xstress wall 3`` [m]; that between periodic sides."""
    name, across = _parts(what)[0], 1 - AXES.index(what[0])
    if across == 0 and sim.walls.around[sim.walls.row(int(name))]:
        return float(sim.settings.period)
    first, last = _ends(sim, name)[:, across]
    return abs(float(first - last))


def _begin_wall_stress(sim: Simulation, what: str) -> None:
    if not _wall_width(sim, what) > 0.0:
        raise CommandError(f"HIST {what}: the wall has no width across {what[0]}")


def wall_stress(sim: Simulation, what: str, _: int) -> float:
    """Force of the particles on a wall in x or y, over its width across and SET thickness [Pa]; positive where it
    points away from the particles. Collective."""
    name, axis = _parts(what)[0], AXES.index(what[0])
    force = float(total(diagnostics.wall_forces(sim), sim.walls.parts(int(name)))[axis])
    away = _middle(sim, name)[axis] - _mean_place(sim, np.ones(len(sim.particles), bool))[axis]
    return force * (-1.0 if away < 0.0 else 1.0) / (_wall_width(sim, what) * sim.settings.thickness or math.nan)


def _walls_apart(sim: Simulation, what: str) -> np.ndarray:
    first, second = (_middle(sim, name) for name in _parts(what))
    return np.abs(first - second)


def _begin_wall_strain(sim: Simulation, what: str) -> tuple[int, float]:
    return _longest("walls", what, _walls_apart(sim, what), AXES.index(what[0]))


def wall_strain(sim: Simulation, what: str, ident: int) -> float:
    """(D0 - D) / D0 of the middles of two walls in x or y."""
    return _strain(_walls_apart(sim, what), sim.history_origins[ident])


_WALL_STRESS = OfParts("Pa", _begin_wall_stress, wall_stress)
_WALL_STRAIN = OfParts("1", _begin_wall_strain, wall_strain)
OF_PARTS = {
    "gstress": OfParts("Pa", _begin_group_stress, group_stress),
    "gstrain": OfParts("1", _begin_group_strain, group_strain),
    "xstress": _WALL_STRESS,
    "ystress": _WALL_STRESS,
    "xstrain": _WALL_STRAIN,
    "ystrain": _WALL_STRAIN,
}
"""Quantities of groups and walls that HIST can record, by the first word."""
