"""Rows of other ranks of which a rank holds no copies, but knows the owners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.core.comm import Comm


@dataclass
class Beyond:
    """number (m,), owner (m,): rows of other ranks, and their owners; sends: owned rows that are such rows of other
    ranks."""

    comm: Comm
    number: np.ndarray
    owner: np.ndarray
    sends: dict[int, np.ndarray]

    @staticmethod
    def nobody(comm: Comm) -> Beyond:
        """Make one without any rows."""
        return Beyond(comm, np.empty(0, np.int64), np.empty(0, np.int64), {})

    @staticmethod
    def of(comm: Comm, number: np.ndarray, sends: dict[int, np.ndarray]) -> Beyond:
        """Make one from the numbers (n,) of owned rows, and which of these other ranks know of. Collective."""
        found = Beyond.nobody(comm)
        found.sends = {p: rows for p, rows in sends.items() if len(rows)}
        parts = found.fetched(number)
        found.number = np.concatenate([found.number, *parts.values()])
        found.owner = np.repeat(np.array(list(parts), np.int64), [len(part) for part in parts.values()])
        return found

    def fetched(self, rows: np.ndarray) -> dict[int, np.ndarray]:
        """Return by ranks what their owners have in these rows (n, ...), 8 bytes a value. Collective."""
        shape = rows.shape[1:]
        parcels = {p: rows[of].reshape(-1).view(np.int64) for p, of in self.sends.items()}
        return {p: came.view(rows.dtype).reshape(-1, *shape) for p, came in self.comm.exchange(parcels).items()}

    def owners(self, number: np.ndarray) -> np.ndarray:
        """Return the owners of rows (n,), -1 of others."""
        order = np.argsort(self.number)
        known = np.append(self.number[order], -1)
        at = np.searchsorted(known[:-1], number)
        return np.where(known[at] == number, np.append(self.owner[order], -1)[at], -1)
