"""Mean stress of a model with periodic sides, between two heights.

    s_ij = -1/V sum over contacts and bonds of F_i l_j w,  V = length * (y1 - y0) * SET thickness

F is the force on one partner, l the vector from its centre to that of the other one (past the sides where they touch
there), or to the contact with a wall; w is the part of l between the heights (Love-Weber). That is the mean over the
heights of the force across horizontal lines, over their length: in equilibrium syy at y is the weight of what lies
above, and the load on it. Sums are exact, so that the values do not depend on ranks and threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import X, Y
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.dem import diagnostics, periodic

COMPONENTS = {"sxx": (X, X), "syy": (Y, Y), "sxy": (X, Y)}
"""Direction of the force and direction of the normal of the plane, by component."""


def heights(sim: Any, y: tuple[float, float] | None = None) -> tuple[float, float]:
    """Return the heights [m], by default those of BOX. CommandError if the sides are not periodic, or there is no
    BOX."""
    if not sim.settings.period:
        raise CommandError("the mean stress needs periodic sides (PERIODIC), which bound the area of the mean")
    box = sim.walls.box()
    if y is None and box is None:
        raise CommandError("the mean stress needs a range of y, or BOX")
    low, high = box[2:] if y is None else y
    if not low < high:
        raise CommandError(f"the mean stress needs two heights, the lower one first, got {low:g} and {high:g}")
    return float(low), float(high)


def mean(sim: Any, name: str, y: tuple[float, float] | None = None) -> float:
    """Return sxx, syy or sxy (force in x across horizontal lines) [Pa], positive in compression. The model is closed.
    Collective."""
    low, high = heights(sim, y)
    force, branch, bottom = _branches(sim)
    ends = np.sort(np.stack([bottom, bottom + branch[:, 1]]), axis=0)
    within = np.clip(ends[1], low, high) - np.clip(ends[0], low, high)
    span = ends[1] - ends[0]
    level = (ends[0] >= low) & (ends[0] < high)
    part = np.divide(within, span, out=level.astype(float), where=span > 0.0)
    i, j = COMPONENTS[name]
    total = exact_sum(force[:, i] * branch[:, j] * part, sim.comm)
    return -total / (sim.settings.period * (high - low) * sim.settings.thickness)


def _branches(sim: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return forces (n, 2) [N], vectors (n, 2) [m] and y of their first ends (n,) [m], each contact once."""
    period, hot = sim.settings.period, sim.particles.hot
    out, ids = diagnostics.contact_rows(sim)
    first, second = (diagnostics.storage_rows(sim, ids[:, k]) for k in (0, 1))
    wall_out, wall_ids = diagnostics.wall_rows(sim)
    lone = diagnostics.storage_rows(sim, wall_ids[:, 0])
    force = np.concatenate([out, wall_out])[:, [diagnostics.FORCE_X, diagnostics.FORCE_Y]]
    at = wall_out[:, [diagnostics.AT_X, diagnostics.AT_Y]]
    # An image may be found in place of a partner: back between the sides, where its position is exact.
    x = periodic.inside(sim, hot[:, X])[0]
    branch = np.concatenate([
        np.column_stack([x[second] - x[first], hot[second, Y] - hot[first, Y]]),
        np.column_stack([at[:, 0] - hot[lone, X], at[:, 1] - hot[lone, Y]]),
    ])  # fmt: skip
    branch[:, X] -= period * np.rint(branch[:, X] / period)
    return force, branch, hot[np.concatenate([first, lone]), Y]
