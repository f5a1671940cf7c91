"""The walls, known to every rank: segments with a velocity, the four sides of the BOX, and polylines that bend."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import BOX_IDS

OLD_SIDES = ("left", "right", "bottom", "top")
"""The walls with ids -1 to -4 in checkpoints without the column `side`."""

_SIDES = f"{min(BOX_IDS.values())} to {max(BOX_IDS.values())}"


class Walls:
    """Columns by name: id (n,) i8; p1, p2, v (n, 2) f8; kn, ks, fric (n,) f8; color (n,) i8; one_sided (n,) bool;
    side (n,) i8: 0, or 1 to 4 for the walls of BOX in the order of BOX_IDS; whole (n,) i8: the wall that a segment is a
    part of, its own id for others; bend (n, 2) f8: velocities in y of P1 and P2 besides v [m/s]; around (n,) bool:
    continues past the periodic sides, without an end.

    Contact histories refer to walls by their rows, which change only when an earlier wall is removed.
    """

    def __init__(self) -> None:
        self.id = np.empty(0, np.int64)
        self.p1, self.p2, self.v = np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2))
        self.kn, self.ks, self.fric = np.empty(0), np.empty(0), np.empty(0)
        self.color = np.empty(0, np.int64)
        self.one_sided = np.empty(0, bool)
        self.side = np.empty(0, np.int64)
        self.around = np.empty(0, bool)
        self.far = (0.0, 0.0)
        """x of the ends of walls without an end [m]: past those of all particles."""
        self.travel = np.empty((0, 2))
        """Path of each wall since the contact lists were built [m]."""
        self.whole = np.empty(0, np.int64)
        self.bend, self.bent = np.empty((0, 2)), np.empty((0, 2))
        """bent: path of P1 and P2 in y besides `travel` [m]."""

    COLUMNS = ("id", "p1", "p2", "v", "kn", "ks", "fric", "color", "one_sided", "side", "travel", "whole", "bend",
               "bent", "around")  # fmt: skip

    def __len__(self) -> int:
        return len(self.id)

    def find(self, wall_id: int) -> int | None:
        """Row of the wall with this id, or None."""
        at = np.flatnonzero(self.id == wall_id)
        return int(at[0]) if len(at) else None

    def row(self, wall_id: int) -> int:
        """Row of the wall with this id; CommandError if missing."""
        at = self.find(wall_id)
        if at is None:
            known = ", ".join(map(str, self.id[(self.side == 0) & (self.whole == self.id)])) or "none"
            raise CommandError(f"there is no wall with id {wall_id} (walls so far: {known})")
        return at

    def parts(self, wall_id: int) -> np.ndarray:
        """Rows of the segments of a wall from its P1 to its P2, usually one; CommandError if missing."""
        first = self.row(wall_id)
        if self.whole[first] != wall_id:
            others = self.id[(self.whole == self.whole[first]) & (self.whole != self.id)]
            raise CommandError(
                f"wall {wall_id} is a segment of wall {self.whole[first]}, which FLEXURE divided: its segments have "
                f"the ids {others.min()} to {others.max()}; choose another id for a new wall"
            )
        return np.flatnonzero(self.whole == wall_id)

    def polylines(self) -> dict[int, np.ndarray]:
        """Rows of the segments of each wall by its id, in output order."""
        order = self.in_output_order()
        return {int(self.id[row]): self.parts(int(self.id[row])) for row in order if self.whole[row] == self.id[row]}

    def ends(self, rows: np.ndarray) -> np.ndarray:
        """First and last point (2, 2) of the wall with these segments [m]."""
        return np.stack([self.p1[rows[0]], self.p2[rows[-1]]])

    def split(self, row: int, x: np.ndarray) -> np.ndarray:
        """Cut a wall at x (k,), ascending or descending from P1 to P2; returns the rows of its segments (k + 1,), which
        have its properties and, but for the first, new ids."""
        ends = np.concatenate([[self.p1[row, 0]], x, [self.p2[row, 0]]])
        share = (ends - ends[0]) / (ends[-1] - ends[0])
        y = self.p1[row, 1] + share * (self.p2[row, 1] - self.p1[row, 1])
        rows = np.concatenate([[row], len(self) + np.arange(len(x))])
        new_ids = max(int(self.id.max()), *BOX_IDS.values()) + 1 + np.arange(len(x))
        for name in self.COLUMNS:
            column = getattr(self, name)
            setattr(self, name, np.concatenate([column, np.repeat(column[row : row + 1], len(x), axis=0)]))
        self.id[rows[1:]], self.whole[rows] = new_ids, self.id[row]
        places = np.column_stack([ends, y])
        self.p1[rows], self.p2[rows] = places[:-1], places[1:]
        return rows

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
        self.whole[at] = wall_id
        return at

    def remove(self, row: int) -> None:
        """Take a wall out of the table."""
        for name in self.COLUMNS:
            setattr(self, name, np.delete(getattr(self, name), row, axis=0))

    def put_side(self, side: str, p1: tuple[float, float], p2: tuple[float, float]) -> int:
        """Make a wall of BOX, or give it new end points and default properties; returns its row. CommandError where its
        id is taken."""
        at, wanted = self.of_side(side), BOX_IDS[side]
        if at is None and self.find(wanted) is not None:
            raise CommandError(
                f"BOX creates the walls {_SIDES}, and wall {wanted} exists already; choose another id for it"
            )
        at = self.put(wanted if at is None else int(self.id[at]), p1, p2, one_sided=True)
        self.side[at] = 1 + list(BOX_IDS).index(side)
        return at

    def side_of(self, row: int) -> str:
        """The side of BOX that a wall is, "" for others."""
        return ["", *BOX_IDS][int(self.side[row])]

    def of_side(self, side: str) -> int | None:
        """Row of a wall of BOX, or None."""
        at = np.flatnonzero(self.side == 1 + list(BOX_IDS).index(side))
        return int(at[0]) if len(at) else None

    def ids_of_earlier_versions(self) -> np.ndarray:
        """The ids (n,), those of BOX as they were: fingerprints of states stay comparable."""
        ids = self.id.copy()
        for number, side in enumerate(OLD_SIDES, 1):
            ids[self.side == 1 + list(BOX_IDS).index(side)] = -number
        return ids

    def take_columns(self, columns: dict[str, list]) -> None:
        """Replace all walls by those in lists by name. In those of earlier versions BOX has the ids -1 to -4: it gets
        its present ones unless another wall has them."""
        n = len(columns["id"])
        for name in self.COLUMNS:
            like = getattr(self, name)
            values = columns.get(name, np.zeros((n, *like.shape[1:])))
            setattr(self, name, np.array(values, dtype=like.dtype).reshape(n, *like.shape[1:]))
        if "side" not in columns:
            free = not np.isin(self.id, list(BOX_IDS.values())).any()
            for number, side in enumerate(OLD_SIDES, 1):
                at = self.id == -number
                self.side[at] = 1 + list(BOX_IDS).index(side)
                self.id[at] = BOX_IDS[side] if free else -number
        if "whole" not in columns:
            self.whole = self.id.copy()

    def table(self) -> np.ndarray:
        """(n, 8) f8 for the kernels, see physics.dem.walls."""
        out = np.zeros((len(self), 8))
        out[:, 4:6], out[:, 6] = self.v, self.one_sided
        self.put_ends(out)
        if self.bend.any():
            out[:, 5] += 0.5 * self.bend.sum(axis=1)  # the velocity of the middle
        return out

    def put_ends(self, table: np.ndarray) -> None:
        """Put the present end points into a table for the kernels."""
        table[:, 0:2], table[:, 2:4] = self.p1, self.p2
        if self.far[0] < self.far[1] and self.around.any():  # periodic sides
            onwards = self.p2[self.around, 0] > self.p1[self.around, 0]
            table[self.around, 0], table[self.around, 2] = (
                np.where(onwards, self.far[0], self.far[1]),
                np.where(onwards, self.far[1], self.far[0]),
            )

    def move(self, dt: float) -> None:
        """P += v dt."""
        step = self.v * dt
        self.p1 += step
        self.p2 += step
        self.travel += step
        if self.bend.any():
            step = self.bend * dt
            self.p1[:, 1] += step[:, 0]
            self.p2[:, 1] += step[:, 1]
            self.bent += step

    @property
    def moves(self) -> bool:
        """Return whether a wall has a velocity."""
        return bool(self.v.any() or self.bend.any())

    def paths(self) -> np.ndarray:
        """Path of the middle of each wall since the lists were built (n, 2) [m]."""
        paths = self.travel.copy()
        paths[:, 1] += 0.5 * self.bent.sum(axis=1)
        return paths

    def list_built(self) -> None:
        """Begin to count the paths of walls at the present positions."""
        self.travel[:], self.bent[:] = 0.0, 0.0

    def at_last_list(self) -> tuple[np.ndarray, np.ndarray]:
        """P1 and P2 (n, 2) when the lists were built [m]."""
        p1, p2 = self.p1 - self.travel, self.p2 - self.travel
        p1[:, 1] -= self.bent[:, 0]
        p2[:, 1] -= self.bent[:, 1]
        return p1, p2

    def longest_travel(self) -> float:
        """Longest path of any wall since the lists were built [m]."""
        return _longest(self.travel, self.bent)

    def fastest(self) -> float:
        """Speed of the fastest wall [m/s]."""
        return _longest(self.v, self.bend)

    def box(self) -> tuple[float, float, float, float] | None:
        """(left, right, bottom, top) of the BOX, or None. Where its left and right side are periodic it has none there:
        they are infinite."""
        left, right, bottom, top = (self.of_side(side) for side in OLD_SIDES)
        if bottom is None or top is None:
            return None
        if left is None or right is None:
            return -math.inf, math.inf, self.p1[bottom, 1], self.p1[top, 1]
        return self.p1[left, 0], self.p1[right, 0], self.p1[bottom, 1], self.p1[top, 1]

    def in_output_order(self) -> np.ndarray:
        """Rows with the BOX first (in the order of BOX_IDS), then by making."""
        sides = np.flatnonzero(self.side)
        return np.concatenate([sides[np.argsort(self.side[sides])], np.flatnonzero(self.side == 0)])


def total(force: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sum of the forces (n, 2) on the segments of one wall; that of a single one is unchanged."""
    return force[rows[0]] if len(rows) == 1 else np.array([math.fsum(axis) for axis in force[rows].T])


def _longest(of_all: np.ndarray, in_y: np.ndarray) -> float:
    """Length of the longest of vectors (n, 2), lengthened by the larger one of two numbers each (n, 2)."""
    return float((np.hypot(of_all[:, 0], of_all[:, 1]) + np.abs(in_y).max(axis=1)).max()) if len(of_all) else 0.0
