"""Arguments of functions that users write, out of lanes, and what they return, into lanes (lanes.py).

A function is called by its own names, in its own order. numba does not support dictionaries of functions, so kernels
are put together here, one small one per name; compilers see through all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numba import njit

from hpcdem.numerics.lanes import lane


def arguments(names: Sequence[str], given: Sequence[str], places: Mapping[str, np.uint64]) -> Any:
    """A kernel (lanes, e, values) that returns the arguments of a function at place e of the lanes, in their order.

    given: names of what is in the tuple `values`; places: lanes of all other names.
    """
    if not names:

        @njit(error_model="numpy")
        def nothing(lanes, e, values):
            return ()

        return nothing
    before, name = arguments(names[:-1], given, places), names[-1]
    if name in given:
        k = given.index(name)

        @njit(error_model="numpy")
        def with_value(lanes, e, values):
            return (*before(lanes, e, values), values[k])

        return with_value
    at = places[name]

    @njit(error_model="numpy")
    def with_lane(lanes, e, values):
        return (*before(lanes, e, values), lanes[at + e])

    return with_lane


def storing(count: int, first: int, lane_of_first: int) -> Any:
    """A kernel (lanes, e, found) that puts `count` values of a tuple, from place `first` on, into lanes."""
    if not count:

        @njit(error_model="numpy")
        def nothing(lanes, e, found):
            return

        return nothing
    before, k, at = storing(count - 1, first, lane_of_first), first + count - 1, lane(lane_of_first + count - 1)

    @njit(error_model="numpy")
    def store(lanes, e, found):
        before(lanes, e, found)
        lanes[at + e] = found[k]

    return store
