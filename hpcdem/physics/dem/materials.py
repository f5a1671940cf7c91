"""Material and bond type tables.

Particles and bonds carry a row number; the tables are the same on every rank. A command that changes properties of
some particles makes, for each row in use among them, the changed row, and the particles move over to it.
"""

from __future__ import annotations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.material import PROPERTIES

OWN = tuple(f"own{k}" for k in range(8))
"""Columns for the properties that a user law declares, in their order."""
MOST_LAWS = 64
"""Largest number of user laws in a model."""
_FIRST = ("density", "fric", "shear", "poiss", "damp", "kn", "ks", "hertz", "xp", "yp", "law", *OWN)
MATERIAL = np.dtype([(name, "f8") for name in (*_FIRST, *(name for name in PROPERTIES if name not in _FIRST))])
"""Properties of `core.material`; 1 for the Hertz-Mindlin law; number of the user law (user_laws.py), and its
properties. New columns are at the end: older checkpoints have the first ones, in this order."""

BOND_TYPE = np.dtype(
    [
        ("kind", "f8"), ("ebmod", "f8"), ("gbmod", "f8"), ("tstrength", "f8"), ("sstrength", "f8"), ("rubber", "f8"),
        ("conserving", "f8"), ("moment", "f8"),
    ]
)  # fmt: skip
"""Kind (laws.ELASTIC_BOND, laws.CONTACT_BOND), moduli [Pa], strengths [Pa; N for contact bonds], 1 for bonds of a
membrane (a mark, without mechanics), 1 for those with one shear stiffness, touching or open,
1 for those that carry a moment. New columns are at the end. Row 0: no bond."""

MOST_ROWS = 4096


class PropertyTable:
    """Rows of one of the two dtypes; a row number never changes its meaning."""

    def __init__(self, dtype: np.dtype, rows: np.ndarray | None = None) -> None:
        self.rows = np.zeros(1, dtype) if rows is None else rows

    def __len__(self) -> int:
        return len(self.rows)

    def describe(self, row: int) -> str:
        """A row in words: its columns other than 0, ``density 2500, kn 1e+07``."""
        values = zip(self.rows.dtype.names or (), self.rows[row].tolist())
        return ", ".join(f"{name} {value:g}" for name, value in values if value) or "no properties"

    def as_floats(self) -> np.ndarray:
        """The table as (n, columns) f8 for the kernels."""
        return self.rows.view(np.float64).reshape(len(self.rows), -1).copy()

    def take_floats(self, rows: np.ndarray) -> None:
        """Inverse of `as_floats`; columns that a table of an earlier version does not have are 0."""
        taken = np.zeros(len(rows), self.rows.dtype)
        for name, column in zip(self.rows.dtype.names or (), rows.T):
            taken[name] = column
        self.rows = taken

    def row(self, **values: float) -> int:
        """Number of the row with these values (others zero), made if need be."""
        wanted = np.zeros(1, self.rows.dtype)
        for name, value in values.items():
            wanted[name] = value
        return self._find_or_add(wanted)

    def changed(self, used: np.ndarray, **values: float) -> np.ndarray:
        """Row numbers (n,) i8 after setting `values`: entry m is the row that replaces row m. Only rows flagged in
        `used` (n,) bool get a changed copy, the others map to themselves; all ranks must pass the same flags."""
        mapping = np.arange(len(self.rows))
        for m in np.flatnonzero(used):
            wanted = self.rows[m : m + 1].copy()
            for name, value in values.items():
                wanted[name] = value
            mapping[m] = self._find_or_add(wanted)
        return mapping

    def _find_or_add(self, wanted: np.ndarray) -> int:
        same = np.flatnonzero(self.rows == wanted)
        if len(same):
            return int(same[0])
        if len(self.rows) >= MOST_ROWS:
            raise CommandError(f"more than {MOST_ROWS} different sets of properties; use fewer distinct values")
        self.rows = np.concatenate([self.rows, wanted])
        return len(self.rows) - 1
