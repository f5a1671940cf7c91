"""Tables: piecewise linear functions of model time, of a coordinate, of plastic strain or of temperature, constant
beyond their ends; what may stand for the number of a property."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fields import FIELDS


@dataclass(frozen=True)
class Table:
    """times (n,) f8 [s], strictly ascending, or coordinates [m], plastic strains, temperatures [K], values of another
    field; values (n,) f8. over: name of that other field."""

    times: np.ndarray
    values: np.ndarray
    over: str = ""

    @staticmethod
    def of(pairs: Iterable[tuple[float, float]], name: str = "table") -> Table:
        """A table from (time, value) pairs; CommandError unless finite, in ascending order, at least one."""
        try:
            rows = np.array(list(pairs), np.float64).reshape(-1, 2)
        except (TypeError, ValueError):
            raise CommandError(f"table '{name}': expected pairs (time, value)") from None
        if not len(rows):
            raise CommandError(f"table '{name}' has no pairs (time, value)")
        bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
        if len(bad):
            raise CommandError(f"table '{name}': pair {bad[0] + 1}, {tuple(rows[bad[0]].tolist())}, is not finite")
        late = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)
        if len(late):
            t, after = rows[late[0] : late[0] + 2, 0]
            raise CommandError(f"table '{name}': times must ascend, but {after:g} follows {t:g} (pair {late[0] + 2})")
        return Table(rows[:, 0].copy(), rows[:, 1].copy())

    def __call__(self, time: float) -> float:
        """Value at a time [s]."""
        return float(np.interp(time, self.times, self.values))

    def changes_after(self, time: float) -> bool:
        """Return whether a later value differs from the value at this time [s]."""
        return bool((self.values[self.times > time] != self(time)).any())

    def at(self, coordinates: np.ndarray) -> np.ndarray:
        """Values (n,) at coordinates (n,) [m]."""
        return np.interp(coordinates, self.times, self.values)

    def pairs(self) -> list[list[float]]:
        """(time, value) pairs as JSON values."""
        return np.column_stack([self.times, self.values]).tolist()


AXES = ("x", "y", "z", "plastic-strain", "temperature", *FIELDS)
"""Arguments of tables of properties: a coordinate, or a quantity that changes in the object."""
PLASTIC_STRAIN, TEMPERATURE = 3, 4
"""Indices in AXES; from TEMPERATURE on they are fields of elements."""


@dataclass(frozen=True)
class Over:
    """A property that follows a table over one of `AXES` (its number), the first three coordinates in the mesh."""

    table: str
    axis: int


@dataclass(frozen=True)
class Drawn:
    """A property that is a random field, by its name."""

    field: str


Value = float | Over | Drawn | np.ndarray
"""Value of a property: one number for all objects, or a rule, or one for each of the objects that are given (n,)."""
