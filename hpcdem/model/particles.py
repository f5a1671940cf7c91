"""The particle store of one rank.

Storage rows are ``[left ghosts | owned | right ghosts]``; ghosts have a hot row only. Every named property is a view of
the owned rows, so ``particles["vx"][:] = 0`` acts on the model.
"""

from __future__ import annotations

import numpy as np

from hpcdem import fields
from hpcdem.fields import FIELDS, HOT, WIDTH


class Particles:
    """hot (n_left + n_own + n_right, 8) f8 and cold (n_own, 8) f8 rows; columns as in `fields`."""

    def __init__(self, hot: np.ndarray | None = None, cold: np.ndarray | None = None) -> None:
        self.set_owned(np.zeros((0, WIDTH)) if hot is None else hot, np.zeros((0, WIDTH)) if cold is None else cold)

    def set_owned(self, hot: np.ndarray, cold: np.ndarray) -> None:
        """Replace everything by these owned rows; no ghosts."""
        self.place(hot, cold, 0)

    def place(self, hot: np.ndarray, cold: np.ndarray, n_left: int) -> None:
        """Take storage with ghosts: owned rows are hot[n_left : n_left + len(cold)]."""
        self.hot, self.cold, self.n_left, self.n_own = hot, cold, n_left, len(cold)
        self.ihot, self.icold = hot.view(np.int64), cold.view(np.int64)

    @property
    def owned(self) -> slice:
        """Rows of `hot` that this rank owns."""
        return slice(self.n_left, self.n_left + self.n_own)

    def __getitem__(self, name: str) -> np.ndarray:
        """View (n_own,) of a field by name."""
        field = FIELDS[name]
        if field.row == HOT:
            rows = self.hot if field.dtype is np.float64 else self.ihot
            return rows[self.owned, field.column]
        return (self.cold if field.dtype is np.float64 else self.icold)[:, field.column]

    def __len__(self) -> int:
        return self.n_own

    def append(self, **columns: np.ndarray | float | int) -> None:
        """Add owned particles without ghosts in place; columns by field name, missing ones are zero."""
        n = len(np.atleast_1d(columns["x"]))
        hot, cold = np.zeros((n, WIDTH)), np.zeros((n, WIDTH))
        new = Particles(hot, cold)
        for name, values in columns.items():
            new[name][:] = values
        self.set_owned(np.concatenate([self.hot[self.owned], hot]), np.concatenate([self.cold, cold]))

    def keep(self, which: np.ndarray) -> None:
        """Keep only these owned particles (mask or indices, in that order); ghosts are dropped."""
        self.set_owned(self.hot[self.owned][which], self.cold[which])

    def positions(self) -> np.ndarray:
        """Copy (n_own, 2) of the centres [m]."""
        return self.hot[self.owned, fields.X : fields.Y + 1].copy()
