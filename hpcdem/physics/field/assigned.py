"""Properties and conditions by rows of a table, and numbers that may follow tables over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.tables import Table

T = TypeVar("T")
Number = float | str
"""A number, or the name of a table over the time of the physics that follows it."""


def with_rows(
    rows: list[tuple[float, ...]], row: np.ndarray, at: np.ndarray, values: np.ndarray
) -> tuple[list[tuple[float, ...]], np.ndarray]:
    """Extended rows, and row (n,), from 1, of objects of which those at `at` (m,) have these values, (m, k) or
    (1, k) for all."""
    rows, row = list(rows), row.copy()
    known = {one: k for k, one in enumerate(rows, 1)}
    sets, which = np.unique(values, axis=0, return_inverse=True)
    for one in map(tuple, sets.tolist()):
        if one not in known:
            rows.append(one)
            known[one] = len(rows)
    row[at] = np.array([known[tuple(one)] for one in sets.tolist()], np.int32)[which.reshape(-1)]
    return rows, row


def refuse_different(
    rows: list[tuple[float, ...]], row: np.ndarray, names: Sequence[str], alike: Sequence[str], why: str
) -> None:  # fmt: skip
    """CommandError if objects with rows differ in a property that is to be alike, of all these names of columns."""
    used = sorted(set(np.unique(row[row > 0]).tolist()))
    for name in alike:
        values = sorted({rows[r - 1][names.index(name)] for r in used})
        if len(values) > 1:
            raise CommandError(f"{why}, but {name} is {values[0]:g} and {values[1]:g}")


def checked(tables: Mapping[str, Table], value: Number, what: str) -> np.ndarray:
    """The values (n,) that a number or a table takes; CommandError unless they are finite."""
    if isinstance(value, str):
        if value not in tables:
            known = ", ".join(f"'{name}'" for name in tables) or "none so far"
            raise CommandError(f"there is no table '{value}'; available: {known}")
        values = tables[value].values
    else:
        values = np.array([value], np.float64)
    if not np.isfinite(values).all():
        raise CommandError(f"{what} must be finite, got {value}")
    return values


def now(tables: Mapping[str, Table], value: Number, time: float) -> float:
    """Evaluate a value at this time [s]; 0 for a deleted table, which no object follows any more."""
    if not isinstance(value, str):
        return value
    return tables[value](time) if value in tables else 0.0


def row_of(rows: list[T], wanted: T, first: int = 0) -> int:
    """Return the row of a condition among these from `first` on; append it if it is new."""
    if wanted not in rows[first:]:
        rows.append(wanted)
    return first + rows[first:].index(wanted)


def in_use(rows: Sequence[T], row: np.ndarray, first: int = 0) -> list[T]:
    """Return the conditions from `first` on that occur in the rows (n,) of objects."""
    return [rows[k] for k in np.unique(row).tolist() if k >= first]


def numbered(row: np.ndarray) -> dict[str, np.ndarray]:
    """Objects that have a row, as columns of a checkpoint."""
    at = np.flatnonzero(row)
    return {"number": at, "row": row[at].astype(np.int64)}


def put_back(row: np.ndarray, columns: Mapping[str, np.ndarray]) -> None:
    """Inverse."""
    row[columns["number"]] = columns["row"]
