"""The particle store of one rank.

Storage rows are ``[left ghosts | owned | right ghosts]``; ghosts have a hot row only. Every named property is a view of
the owned rows, so ``particles["vx"][:] = 0`` acts on the model.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hpcdem.core import fields
from hpcdem.core.fields import FIELDS, HOT, MORE, WIDTH, Field


class Particles:
    """hot (n_left + n_own + n_right, 8) f8 and cold (n_own, 8) f8 rows; columns as in `fields`. rigid: the rows of
    clumps, as many as of `hot`, 12 f8 each; None while there are no clumps in the whole model. more: the columns of
    `extra`, fields that physics bring, as many rows as of `hot`."""

    def __init__(self, hot: np.ndarray | None = None, cold: np.ndarray | None = None) -> None:
        self.extra: dict[str, Field] = {}
        self.set_owned(np.zeros((0, WIDTH)) if hot is None else hot, np.zeros((0, WIDTH)) if cold is None else cold)

    def set_owned(
        self, hot: np.ndarray, cold: np.ndarray, rigid: np.ndarray | None = None, more: np.ndarray | None = None
    ) -> None:
        """Replace everything by these owned rows; no ghosts."""
        self.place(hot, cold, 0, rigid, more)

    def place(
        self,
        hot: np.ndarray,
        cold: np.ndarray,
        n_left: int,
        rigid: np.ndarray | None = None,
        more: np.ndarray | None = None,
    ) -> None:
        """Take storage with ghosts: owned rows are hot[n_left : n_left + len(cold)], and so in `rigid` and `more`.
        Without `more` the fields of physics have their initial values."""
        self.hot, self.cold, self.n_left, self.n_own = hot, cold, n_left, len(cold)
        self.ihot, self.icold = hot.view(np.int64), cold.view(np.int64)
        self.rigid = rigid
        self.more = self._initial(len(hot)) if more is None else more

    def _initial(self, n: int) -> np.ndarray:
        return np.tile([field.initial for field in self.extra.values()], (n, 1)).reshape(n, len(self.extra))

    def extend(self, more: Mapping[str, tuple[str, str, float]]) -> None:
        """Take fields of physics: unit, meaning, initial value by name; without ghosts in place."""
        old = self.more[self.owned]
        for name, (unit, text, initial) in more.items():
            self.extra[name] = Field(MORE, len(self.extra), np.float64, unit, text, initial)
        rows = self._initial(self.n_own)
        rows[:, : old.shape[1]] = old
        self.more = rows

    @property
    def owned(self) -> slice:
        """Rows of `hot` that this rank owns."""
        return slice(self.n_left, self.n_left + self.n_own)

    def __getitem__(self, name: str) -> np.ndarray:
        """View (n_own,) of a field by name."""
        if name in self.extra:
            return self.more[self.owned, self.extra[name].column]
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
        new = Particles()
        new.extra = self.extra
        new.set_owned(hot, cold)
        for name, values in columns.items():
            new[name][:] = values
        rigid = None if self.rigid is None else np.concatenate([self.rigid[self.owned], free_rows(n)])
        self.set_owned(
            np.concatenate([self.hot[self.owned], hot]), np.concatenate([self.cold, cold]), rigid,
            np.concatenate([self.more[self.owned], new.more]),
        )  # fmt: skip

    def keep(self, which: np.ndarray) -> None:
        """Keep only these owned particles (mask or indices, in that order); ghosts are dropped."""
        rigid = None if self.rigid is None else self.rigid[self.owned][which]
        self.set_owned(self.hot[self.owned][which], self.cold[which], rigid, self.more[self.owned][which])

    @property
    def clump(self) -> np.ndarray:
        """The clump (n_own,) i8 of each owned particle, -1 for free ones."""
        if self.rigid is None:
            return np.full(self.n_own, fields.FREE)
        return self.rigid.view(np.int64)[self.owned, fields.CLUMP]

    def positions(self) -> np.ndarray:
        """Copy (n_own, 2) of the centres [m]."""
        return self.hot[self.owned, fields.X : fields.Y + 1].copy()


def free_rows(n: int) -> np.ndarray:
    """Rows of clumps (n, 12) of particles that belong to none."""
    rows = np.zeros((n, fields.CLUMP_WIDTH))
    rows.view(np.int64)[:, fields.CLUMP] = fields.FREE
    return rows
