"""Sort rows of all ranks into slabs of one global order.

Strips hand particles about, files must not show it: every table is written in ascending order of its keys, each
rank holding one contiguous slab. No rank ever holds more than its own rows and its own slab.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numba import njit

from hpcdem.core.comm import Comm
from hpcdem.io.frame import Table

_BINS_PER_RANK = 64
_SMALL_GID = 1 << 31


def to_slabs(
    comm: Comm, key_columns: Sequence[str], columns: dict[str, np.ndarray], chosen: np.ndarray | None = None
) -> Table:
    """Collective: this rank's slab of the table whose rows are all ranks' rows in ascending order of the keys.

    key_columns: one or two int64 columns, e.g. ("gid",) or ("id1", "id2"); every key must occur once among all
    ranks. columns: name -> 1-d array, same names and dtypes on all ranks, any order of rows, any number of them.
    chosen: take only these rows (indices). Slabs are of nearly equal size (cut where the first key changes), and put
    one after the other they are the same for any number of ranks; they are copies. Raises HpcdemError on all ranks if a
    key occurs twice.
    """
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    n = len(next(iter(arrays.values())))
    for name, values in arrays.items():
        if values.shape != (n,):
            raise ValueError(f"column {name} has the shape {values.shape}, not ({n},)")
    if comm.size > 1:
        arrays, chosen = _redistributed(comm, key_columns[0], arrays, chosen), None
    keys = [arrays[k].astype(np.int64) if chosen is None else arrays[k][chosen] for k in key_columns]
    order = order_of(keys)
    keys = [k[order] for k in keys]
    if chosen is not None:
        order = chosen[order]
    table = {name: _taken(values, order) for name, values in arrays.items()}

    same = np.ones(max(0, len(order) - 1), dtype=bool)
    for key in keys:
        same &= key[1:] == key[:-1]
    error = None
    if same.any():
        at = int(np.flatnonzero(same)[0])
        error = f"the key {', '.join(f'{k} = {table[k][at]}' for k in key_columns)} occurs twice in a table"
    comm.agree(error)
    n = len(order)
    total = np.array([n], dtype=np.int64)
    return Table(table, offset=comm.exscan(n), total=int(comm.sum_into(total)[0]))


def _taken(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """values[rows]; a column of a wide table is made compact first, if that is worth it: jumps are then shorter."""
    taken: np.ndarray = (np.ascontiguousarray(values) if 2 * len(rows) > len(values) else values)[rows]
    return taken


_DIGIT = 11  # bits: their counters fit the first-level cache


@njit(cache=True, nogil=True, error_model="numpy")
def _sort_by_digit(keys, low, shift, order, out):
    """One pass of a radix sort: `order` by one digit of keys - low, rows of equal digits as they were, into `out`."""
    mask = np.uint64((1 << _DIGIT) - 1)
    places = np.zeros((1 << _DIGIT) + 1, np.int64)
    for key in keys:
        places[(np.uint64(key - low) >> np.uint64(shift) & mask) + np.uint64(1)] += 1
    for d in range(1 << _DIGIT):
        places[d + 1] += places[d]
    for row in order:
        d = np.uint64(keys[row] - low) >> np.uint64(shift) & mask
        out[places[d]] = row
        places[d] += 1


def order_of(keys: Sequence[np.ndarray]) -> np.ndarray:
    """The rows (n,) i8 in ascending order of int64 keys, the first one leading; equal ones keep their order."""
    n = len(keys[0])
    order, other = np.arange(n), np.empty(n, np.int64)
    for key in reversed(keys):
        if n:
            key = np.ascontiguousarray(key, dtype=np.int64)
            low, high = int(key.min()), int(key.max())
            for shift in range(0, (high - low).bit_length(), _DIGIT):
                _sort_by_digit(key, low, shift, order, other)
                order, other = other, order
    return order


def _redistributed(
    comm: Comm, key: str, arrays: dict[str, np.ndarray], chosen: np.ndarray | None
) -> dict[str, np.ndarray]:
    """The rows of all ranks whose key lies in this rank's key range."""
    arrays = {
        name: np.ascontiguousarray(values) if chosen is None else _taken(values, chosen)
        for name, values in arrays.items()
    }
    target = _targets(comm, np.asarray(arrays[key], dtype=np.int64))
    return dict(zip(arrays, comm.to_ranks(target, *arrays.values())[1:]))


def _targets(comm: Comm, keys: np.ndarray) -> np.ndarray:
    """The rank that gets each key: ranges of keys, chosen from a histogram over all ranks so that they hold about
    equally many rows."""
    info = np.iinfo(np.int64)
    ends = np.array([~keys.min(), keys.max()] if len(keys) else [info.min, info.min], dtype=np.int64)
    comm.max_into(ends)  # ~k = -k - 1: the least key, without an overflow
    a, b = ~int(ends[0]), int(ends[1])
    if a > b:
        return np.zeros(0, dtype=np.int64)
    bins = min(_BINS_PER_RANK * comm.size, b - a + 1)
    width = -(-(b - a + 1) // bins)
    index = (keys - a) // width
    counts = comm.sum_into(np.bincount(index, minlength=bins).astype(np.int64))
    before = np.cumsum(counts) - counts
    owner = before * comm.size // max(1, int(counts.sum()))
    found: np.ndarray = owner[index]
    return found


def by_ranges(comm: Comm, key: str, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Collective: the rows of all ranks in ascending order of an int64 column. Rows of equal keys come to one rank, in
    the order of ranks; tables with the same keys are cut in the same places."""
    if comm.size > 1:
        columns = _redistributed(comm, key, columns, None)
    order = order_of([columns[key]])
    return {name: values[order] for name, values in columns.items()}


def find_rows(comm: Comm, keys: Sequence[np.ndarray], wanted: Sequence[np.ndarray]) -> np.ndarray:
    """Collective: the global row of each wanted key in a table held in slabs, -1 where there is no such row.

    keys: this rank's slab of one or two key columns, ascending over all ranks; wanted: as many columns of the keys
    requested, in any order. Every rank queries only the rank that would hold the row.
    """
    large = any(len(k) and not (-_SMALL_GID <= np.min(k) and np.max(k) < _SMALL_GID) for k in (*keys, *wanted))
    comm.agree(f"ids beyond {_SMALL_GID} cannot be looked up in pairs" if large and len(keys) > 1 else None)
    mine, asked = _combined(keys), _combined(wanted)
    if comm.size == 1:
        return _local_rows(mine, asked, 0)
    offset = comm.exscan(len(mine))
    return ask(comm, holders(comm, mine, asked), asked, lambda q: _local_rows(mine, q, offset))


def holders(comm: Comm, mine: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Collective: the rank whose slab has, or would have, each wanted key (m,) i8; its own where there are no rows.

    mine (n,) i8: this rank's slab of the keys, ascending over all ranks.
    """
    # First key of every slab; an empty slab starts where the next one does.
    starts = np.full(comm.size, np.iinfo(np.int64).max, dtype=np.int64)
    if len(mine):
        starts[comm.rank] = mine[0]
    comm.min_into(starts)
    ranks = np.flatnonzero(comm.max_into(np.where(np.arange(comm.size) == comm.rank, len(mine), 0)) > 0)
    if not len(ranks):
        return np.full(len(wanted), comm.rank)
    found: np.ndarray = ranks[np.maximum(np.searchsorted(starts[ranks], wanted, side="right") - 1, 0)]
    return found


def ask(
    comm: Comm, target: np.ndarray, questions: np.ndarray, answer: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Collective: the answers (n, ...) of the ranks `target` (n,) i8 to these questions (n,), row by row; `answer` is
    the answers of this rank."""
    sources, asked = comm.to_ranks(target, questions)
    _, answers = comm.to_ranks(sources, answer(asked))
    found = np.empty_like(answers)
    found[np.argsort(target, kind="stable")] = answers
    return found


def _combined(keys: Sequence[np.ndarray]) -> np.ndarray:
    """One int64 per row that sorts like the key."""
    arrays = [np.asarray(k, dtype=np.int64) for k in keys]
    if len(arrays) == 1:
        return arrays[0]
    return arrays[0] * (2 * _SMALL_GID) + (arrays[1] + _SMALL_GID)


def _local_rows(mine: np.ndarray, asked: np.ndarray, offset: int) -> np.ndarray:
    n = len(mine)
    if n == 0:
        return np.full(len(asked), -1, dtype=np.int64)
    first, span = int(mine[0]), int(mine[-1]) - int(mine[0]) + 1
    if span <= 4 * n + 1024:  # as good as all numbers from the first on: a table of them is quicker than a search
        rows = np.full(span + 2, -1, dtype=np.int64)
        rows[mine - (first - 1)] = np.arange(offset, offset + n)
        found: np.ndarray = rows[np.clip(asked, first - 1, first + span) - (first - 1)]
        return found
    at = np.minimum(np.searchsorted(mine, asked), len(mine) - 1)
    return np.where(mine[at] == asked, at + offset, -1)
