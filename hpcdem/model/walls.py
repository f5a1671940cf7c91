"""The walls, known to every rank: segments with a velocity, and the four sides of the BOX."""

from __future__ import annotations

import numpy as np

from hpcdem.errors import CommandError

BOX_IDS = {"left": -1, "right": -2, "bottom": -3, "top": -4}


class Walls:
    """Columns by name: id (n,) i8; p1, p2, v (n, 2) f8; kn, ks, fric (n,) f8; color (n,) i8; one_sided (n,) bool.

    A wall keeps its place in the table for good (contact histories refer to it).
    """

    def __init__(self) -> None:
        self.id = np.empty(0, np.int64)
        self.p1, self.p2, self.v = np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2))
        self.kn, self.ks, self.fric = np.empty(0), np.empty(0), np.empty(0)
        self.color = np.empty(0, np.int64)
        self.one_sided = np.empty(0, bool)
        self.travel = np.empty((0, 2))
        """Way of each wall since the contact lists were built [m]."""

    COLUMNS = ("id", "p1", "p2", "v", "kn", "ks", "fric", "color", "one_sided", "travel")

    def __len__(self) -> int:
        return len(self.id)

    def find(self, wall_id: int) -> int | None:
        """Row of the wall with this id, or None."""
        at = np.flatnonzero(self.id == wall_id)
        return int(at[0]) if len(at) else None

    def row(self, wall_id: int) -> int:
        """Row of the wall with this id; CommandError if there is none."""
        at = self.find(wall_id)
        if at is None:
            known = ", ".join(str(i) for i in self.id if i >= 0) or "none"
            raise CommandError(f"there is no wall with id {wall_id} (walls so far: {known})")
        return at

    def put(self, wall_id: int, p1: tuple[float, float], p2: tuple[float, float], one_sided: bool = False) -> int:
        """Make a wall, or give an existing id new end points and default properties; returns its row."""
        if tuple(p1) == tuple(p2):
            raise CommandError(f"wall {wall_id} has zero length: both nodes are ({p1[0]:g}, {p1[1]:g})")
        at = self.find(wall_id)
        if at is None:
            at = len(self)
            for name in self.COLUMNS:
                column = getattr(self, name)
                setattr(self, name, np.concatenate([column, np.zeros((1, *column.shape[1:]), column.dtype)]))
        for name in self.COLUMNS:
            getattr(self, name)[at] = 0
        self.id[at], self.p1[at], self.p2[at], self.one_sided[at] = wall_id, p1, p2, one_sided
        return at

    def table(self) -> np.ndarray:
        """(n, 8) f8 for the kernels, see physics.dem.walls."""
        out = np.zeros((len(self), 8))
        out[:, 0:2], out[:, 2:4], out[:, 4:6], out[:, 6] = self.p1, self.p2, self.v, self.one_sided
        return out

    def move(self, dt: float) -> None:
        """P += v dt."""
        step = self.v * dt
        self.p1 += step
        self.p2 += step
        self.travel += step

    def longest_travel(self) -> float:
        """Largest way of any wall since the lists were built [m]."""
        return float(np.hypot(self.travel[:, 0], self.travel[:, 1]).max()) if len(self) else 0.0

    def box(self) -> tuple[float, float, float, float] | None:
        """(left, right, bottom, top) of the BOX, or None."""
        if self.find(BOX_IDS["left"]) is None:
            return None
        bottom, top = self.row(BOX_IDS["bottom"]), self.row(BOX_IDS["top"])
        left, right = self.row(BOX_IDS["left"]), self.row(BOX_IDS["right"])
        return self.p1[left, 0], self.p1[right, 0], self.p1[bottom, 1], self.p1[top, 1]

    def in_output_order(self) -> np.ndarray:
        """Rows with the BOX first (left, right, bottom, top), then by making."""
        sides = np.flatnonzero(self.id < 0)
        return np.concatenate([sides[np.argsort(-self.id[sides])], np.flatnonzero(self.id >= 0)])
