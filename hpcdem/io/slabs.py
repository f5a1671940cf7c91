"""From rows anywhere to slabs in one global order.

Strips hand particles about, files must not show it: every table is written in ascending order of its keys, each
rank holding one contiguous slab. No rank ever holds more than its own rows and its own slab.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.io.frame import Table

_BINS_PER_RANK = 64
_SMALL_GID = 1 << 31


def to_slabs(comm: Any, key_columns: Sequence[str], columns: dict[str, np.ndarray]) -> Table:
    """Collective: this rank's slab of the table whose rows are all ranks' rows in ascending order of the keys.

    key_columns: one or two int64 columns, e.g. ("gid",) or ("id1", "id2"); every key must occur once among all
    ranks. columns: name -> 1-d array, same names and dtypes on all ranks, any order of rows, any number of them.
    Slabs are of nearly equal size (cut where the first key changes), and put one after the other they are the same
    for any number of ranks. Raises HpcdemError on all ranks if a key occurs twice.
    """
    rows = _packed(columns)
    keys = np.asarray(columns[key_columns[0]], dtype=np.int64)
    if comm.size > 1:
        rows = _redistributed(comm, keys, rows)
    table = {name: np.ascontiguousarray(rows[name]) for name in columns}
    order = np.lexsort([table[k] for k in reversed(key_columns)])
    if not _is_identity(order):
        table = {name: values[order] for name, values in table.items()}

    same = np.ones(max(0, len(rows) - 1), dtype=bool)
    for k in key_columns:
        same &= table[k][1:] == table[k][:-1]
    error = None
    if same.any():
        at = int(np.flatnonzero(same)[0])
        error = f"the key {', '.join(f'{k} = {table[k][at]}' for k in key_columns)} occurs twice in a table"
    comm.agree(error)
    n = len(rows)
    total = np.array([n], dtype=np.int64)
    return Table(table, offset=comm.exscan(n), total=int(comm.sum_into(total)[0]))


def _is_identity(order: np.ndarray) -> bool:
    return bool((order == np.arange(len(order))).all())


def _packed(columns: dict[str, np.ndarray]) -> np.ndarray:
    """The columns as one array of records, so that one exchange carries whole rows."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    n = len(next(iter(arrays.values())))
    rows = np.empty(n, dtype=[(name, values.dtype) for name, values in arrays.items()])
    for name, values in arrays.items():
        if values.shape != (n,):
            raise ValueError(f"column {name} has the shape {values.shape}, not ({n},)")
        rows[name] = values
    return rows


def _redistributed(comm: Any, keys: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The rows of all ranks whose key lies in this rank's key range."""
    target = _targets(comm, keys)
    order = np.argsort(target, kind="stable")
    cuts = np.searchsorted(target[order], np.arange(1, comm.size))
    # As plain bytes: MPI need not know what a record is.
    flat = rows[order].view(np.uint8).reshape(len(rows), rows.dtype.itemsize)
    received = np.concatenate(comm.alltoallv(np.split(flat, cuts)))
    return np.ascontiguousarray(received).reshape(-1).view(rows.dtype)


def _targets(comm: Any, keys: np.ndarray) -> np.ndarray:
    """The rank that gets each key: ranges of keys, chosen from a histogram over all ranks so that they hold about
    equally many rows."""
    info = np.iinfo(np.int64)
    low = np.array([keys.min() if len(keys) else info.max], dtype=np.int64)
    high = np.array([keys.max() if len(keys) else info.min], dtype=np.int64)
    a, b = int(comm.min_into(low)[0]), int(comm.max_into(high)[0])
    if a > b:
        return np.zeros(0, dtype=np.int64)
    bins = min(_BINS_PER_RANK * comm.size, b - a + 1)
    width = -(-(b - a + 1) // bins)
    index = (keys - a) // width
    counts = comm.sum_into(np.bincount(index, minlength=bins).astype(np.int64))
    before = np.cumsum(counts) - counts
    owner = before * comm.size // max(1, int(counts.sum()))
    return owner[index]


def find_rows(comm: Any, keys: Sequence[np.ndarray], wanted: Sequence[np.ndarray]) -> np.ndarray:
    """Collective: the global row of each wanted key in a table held in slabs, -1 where there is no such row.

    keys: this rank's slab of one or two key columns, ascending over all ranks; wanted: as many columns of the keys
    asked for, in any order. Every rank asks only the rank that would hold the row.
    """
    large = any(len(k) and not (-_SMALL_GID <= np.min(k) and np.max(k) < _SMALL_GID) for k in (*keys, *wanted))
    comm.agree(f"ids beyond {_SMALL_GID} cannot be looked up in pairs" if large and len(keys) > 1 else None)
    mine, asked = _combined(keys), _combined(wanted)
    n = len(mine)
    offset = comm.exscan(n)
    if comm.size == 1:
        return _local_rows(mine, asked, offset)
    # First key of every slab; an empty slab starts where the next one does.
    starts = np.full(comm.size, np.iinfo(np.int64).max, dtype=np.int64)
    if n:
        starts[comm.rank] = mine[0]
    starts = np.minimum.accumulate(comm.min_into(starts)[::-1])[::-1]
    holds = comm.max_into(np.where(np.arange(comm.size) == comm.rank, n, 0).astype(np.int64)) > 0
    ranks = np.flatnonzero(holds)
    if len(ranks) == 0:
        return np.full(len(asked), -1, dtype=np.int64)
    target = ranks[np.maximum(np.searchsorted(starts[ranks], asked, side="right") - 1, 0)]
    order = np.argsort(target, kind="stable")
    cuts = np.searchsorted(target[order], np.arange(1, comm.size))
    questions = comm.alltoallv(np.split(asked[order], cuts))
    answers = comm.alltoallv([_local_rows(mine, q, offset) for q in questions])
    found = np.empty(len(asked), dtype=np.int64)
    found[order] = np.concatenate(answers)
    return found


def _combined(keys: Sequence[np.ndarray]) -> np.ndarray:
    """One int64 per row that sorts like the key."""
    arrays = [np.asarray(k, dtype=np.int64) for k in keys]
    if len(arrays) == 1:
        return arrays[0]
    return arrays[0] * (2 * _SMALL_GID) + (arrays[1] + _SMALL_GID)


def _local_rows(mine: np.ndarray, asked: np.ndarray, offset: int) -> np.ndarray:
    if len(mine) == 0:
        return np.full(len(asked), -1, dtype=np.int64)
    at = np.minimum(np.searchsorted(mine, asked), len(mine) - 1)
    return np.where(mine[at] == asked, at + offset, -1)
