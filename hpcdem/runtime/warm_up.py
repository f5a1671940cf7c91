"""Calls every kernel once that particles, blocks and files share."""

from __future__ import annotations

import numpy as np

from hpcdem.core import cells, memory
from hpcdem.halo import ownership
from hpcdem.io import slabs, textnum
from hpcdem.numerics import exact_sum, lanes, rng

__all__ = ["lanes", "warm_up"]


def warm_up(threads: int = 1) -> None:
    """Call them as runs with this many threads per rank do. Writes nothing."""
    cell = cells.keys(np.zeros((2, 2)), 1.0)
    ids = np.array([2, 1])
    ownership.warm_up(cell, ids)
    slabs.order_of([ids])
    memory.take_rows(np.zeros((1, 1)), np.zeros(1, np.int64), np.empty((1, 1)), threads)
    exact_sum.partial_bins(np.zeros(1))
    rng.uniform(0, 0, 0)
    textnum.warm_up()
