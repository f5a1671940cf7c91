"""Migration: particles go to the rank that owns their column, and their contact histories go with them."""

from __future__ import annotations

from typing import Any

import numpy as np


def migrate(comm: Any, owner: np.ndarray, *tables: np.ndarray) -> list[np.ndarray]:
    """Hand row i of each table (n, ...) to rank owner[i]; returns this rank's new rows of each table, in no fixed order
    (but the same order in all). Collective."""
    if comm.size == 1:
        return list(tables)
    order = np.argsort(owner, kind="stable")
    cuts = np.searchsorted(owner[order], np.arange(1, comm.size))
    return [np.concatenate(comm.alltoallv(np.split(table[order], cuts))) for table in tables]


def migrate_ragged(comm: Any, owner: np.ndarray, counts: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for rows of which particle i has counts[i] (CSR order), in the order `migrate` uses."""
    if comm.size == 1:
        return counts, rows
    return (
        migrate(comm, owner, counts)[0],
        migrate(comm, np.repeat(owner, counts), rows)[0],
    )
