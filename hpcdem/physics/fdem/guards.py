"""Stops a run when elements move too far or turn inside out, and names them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hpcdem.core.errors import EquilibriumError, PhysicsError
from hpcdem.physics.fdem import connectivity, user_functions, user_laws
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.state import State


def stop_on_runaway(sim: State, broken: bool, inverted: bool) -> None:
    """Name the elements that cannot be right, and stop on all ranks: raises PhysicsError. Collective."""
    x, v, number = sim.x[sim.owned], sim.v[sim.owned], sim.number[sim.owned]
    with np.errstate(invalid="ignore", over="ignore"):
        bad = ~(_whole_speed(sim, v) * sim.clock.dt <= 0.5 * sim.mean_edge) | ~_upright(sim, x, number)
    rows = np.flatnonzero(bad)[np.argsort(number[bad])][:10]
    dim = sim.dim
    mine = [(int(number[i]), x[i, :dim].tolist(), v[i, :dim].tolist()) for i in rows]
    named = sorted(row for part in sim.comm.allgather(mine) for row in part)[:10]
    total = int(sim.comm.sum_into(np.array([bad.sum()], np.int64))[0])
    what = "a number is not finite" if broken else (
        "an element is inverted" if inverted else "an element moves over half an edge per step"
    )  # fmt: skip
    text = "\n".join(f"  element {e} at {_vector(at)}, velocity {_vector(speed)}" for e, at, speed in named)
    if not sim.options.dynamic and not broken and not inverted:
        e, at, speed = named[0]
        raise EquilibriumError(
            f"step {sim.clock.step}: {total} elements move over half an edge per static step, such as element {e} "
            f"at {_vector(at)} by {_vector(speed)}"
        )
    guess = f"the time step {sim.clock.dt:g} s is probably too large, or loads are"
    if broken and (titles := _of_users(sim)):
        guess += f"; or it comes from {', '.join(titles)}"
    raise PhysicsError(f"step {sim.clock.step}: {what} ({total} elements); {guess}\n{text}")


def _of_users(sim: State) -> list[str]:
    """Laws and functions of the user that act. Not collective."""
    rows = [sim.conditions[k] for k in np.unique(sim.corner_row)] + [sim.loads[k] for k in np.unique(sim.load_row)]
    functions = [one.title for row in rows for one in user_functions.used(row).values()]
    return sorted({*functions, *(law.title for law in user_laws.in_use(sim))})


def _whole_speed(sim: State, v: np.ndarray) -> np.ndarray:
    """Largest speed of a corner of elements [m/s]; the fourth corner of quads is not used."""
    corners = v[:, :6].reshape(len(v), 3, 2) if sim.dim == 2 else v.reshape(len(v), 4, 4)
    return np.sqrt((corners * corners).sum(axis=2)).max(axis=1)


def _upright(sim: State, x: np.ndarray, number: np.ndarray) -> np.ndarray:
    """(n,) bool: elements whose corners are finite and run the right way."""
    if sim.dim == 3:
        return np.array([space.volume(row) > 0.0 for row in x], bool)
    good = np.isfinite(x[:, :6]).all(axis=1) & (_turn(x, 0, 2, 4) > 0.0)
    if sim.wide:
        quads = connectivity.corner_counts(sim.the_mesh().cells[number]) == 4
        good &= ~quads | (_turn(x, 0, 4, 6) > 0.0)
    return good


def _vector(given: Sequence[float]) -> str:
    return f"({', '.join(f'{c:g}' for c in given)})"


def _turn(x: np.ndarray, a: int, b: int, c: int) -> np.ndarray:
    """Twice the area (n,) of the triangles whose corners begin in these columns."""
    ux, uy, wx, wy = x[:, b] - x[:, a], x[:, b + 1] - x[:, a + 1], x[:, c] - x[:, a], x[:, c + 1] - x[:, a + 1]
    return ux * wy - uy * wx
