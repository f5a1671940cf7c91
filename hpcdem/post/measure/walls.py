"""Force curves of walls from `walls.csv`."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.core.fields import sides_of_box
from hpcdem.io.disk import explain

HEADER = "step,time,wall,x1,y1,x2,y2,fx,fy"


@dataclass(frozen=True)
class Curve:
    """Record of one wall, a row per time.

    step, time [s]; place (n, 2): of its middle [m]; force (n, 2): of the particles on it [N].
    """

    step: np.ndarray
    time: np.ndarray
    place: np.ndarray
    force: np.ndarray

    def since(self, step: int) -> Curve:
        """The rows from a step on."""
        kept = self.step >= step
        return Curve(self.step[kept], self.time[kept], self.place[kept], self.force[kept])

    @property
    def moved(self) -> np.ndarray:
        """(n, 2): displacement of the middle since the first row [m]."""
        return self.place - self.place[0]

    @property
    def path_length(self) -> np.ndarray:
        """(n,): length of the path of the middle since the first row [m]."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.place, axis=0).T))])

    @property
    def work(self) -> np.ndarray:
        """(n,): work done by the wall on the particles so far [J]: minus the integral of the force over the path,
        by the trapezoidal rule."""
        mean = (self.force[1:] + self.force[:-1]) / 2.0
        return np.concatenate([[0.0], -np.cumsum((mean * np.diff(self.place, axis=0)).sum(axis=1))])


def read_walls(path: str | os.PathLike, first: int | None = None, last: int | None = None) -> dict[int, Curve]:
    """Return the curve of each wall between two steps, by id; first None: from the last row before any wall moves.
    Raises HpcdemError.
    """
    try:
        with open(path, encoding="utf-8") as file:
            if file.readline().strip() != HEADER:
                raise HpcdemError(f"{os.fspath(path)} is not a walls.csv of hpcdem: its first line is not '{HEADER}'")
            lines = [line for line in file if line.strip()]
    except OSError as failure:
        raise HpcdemError(explain(path, failure, "read")) from None
    if lines and not lines[-1].endswith("\n"):
        lines.pop()  # a run is still writing it, or was interrupted
    try:
        rows = np.array([[float(word) for word in line.split(",")] for line in lines]).reshape(len(lines), 9)
    except ValueError:
        raise HpcdemError(f"{os.fspath(path)}: expected nine numbers in each row") from None
    rows = rows[(rows[:, 0] >= (first or 0)) & (rows[:, 0] <= (np.inf if last is None else last))]
    curves = {}
    for wall in np.unique(rows[:, 2]):
        some = rows[rows[:, 2] == wall]
        ends = some[:, 3:7].reshape(-1, 2, 2)
        curves[int(wall)] = Curve(some[:, 0].astype(np.int64), some[:, 1], ends.mean(axis=1), some[:, 7:9])
    mover = driver(curves) if first is None else None
    if mover is not None:
        curve = curves[mover]
        began = curve.step[np.flatnonzero(curve.path_length == 0.0)[-1]]
        curves = {wall: curve.since(int(began)) for wall, curve in curves.items()}
    return curves


def driver(curves: dict[int, Curve]) -> int | None:
    """Return the wall with the longest path, None if none moved."""
    paths = {wall: float(curve.path_length[-1]) for wall, curve in curves.items() if wall not in sides_of_box(curves)}
    best = max(paths, key=lambda w: paths[w], default=None)
    return best if best is not None and paths[best] > 0.0 else None
