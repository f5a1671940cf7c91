"""Limits below which forces count as rounding errors of a model at rest.

A body that nobody loads is in balance, though the forces of its nodes, all of them rounding, are not. Loads are nothing
if they would strain the softest rock by less than `NOTHING` in the mean; then balance is what positions rounded to the
last bit allow. Where there is more than that a balance is a part of the forces, whatever it is made of.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.numerics.exact_sum import exact_sum

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

NOTHING = 1e-9
"""Strain below which loads are neglected: it corresponds to 50 Pa in hard rock."""


def nothing(sim: Blocks) -> float:
    """Sum of the forces below which a model is unloaded [N/m], in space [N]: E strain times the mean edge, in space
    its square, for each element, E that of the softest: what is nothing to stiff rock may be much to soft rock. Equal
    on all ranks. Not collective."""
    count = np.bincount(sim.element_row[sim.alive])
    young = np.array(sim.element_rows.column("young"))[: len(count)][count > 0]
    least = float(young[young > 0.0].min(initial=np.inf))
    return NOTHING * least * int(count.sum()) * sim.mean_edge ** (sim.dim - 1) if least < np.inf else 0.0


def rounding(sim: Blocks) -> float:
    """Sum of the forces [N/m], in space [N], that positions rounded to the last bit make: sum_j |K_ij| |x| epsilon.
    The model is closed. Collective."""
    own, dim = sim.owned, sim.dim
    x = np.abs(sim.x[own].reshape(sim.n_own, -1)[:, : 4 * sim.stride if dim == 3 or sim.wide else 6])
    largest = float(sim.comm.max_into(np.array([x.max(initial=0.0)]))[0])
    each = sim.local.masses.row_sums()[own] * (dim * max(largest, sim.mean_edge))
    return exact_sum(each.reshape(-1), sim.comm) * float(np.finfo(np.float64).eps)


def ratio(sim: Blocks, unbalanced: float, total: float) -> float:
    """Unbalanced forces over all forces; 0 if only rounding remains. Collective."""
    if total == 0.0 or not math.isfinite(total):
        return 0.0 if total == 0.0 else math.inf
    at_rest = total < nothing(sim) and unbalanced <= rounding(sim)
    return 0.0 if at_rest else unbalanced / total
