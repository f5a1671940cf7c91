"""Clump files: rigid bodies made of discs, as text.

    hpcdem clumps 1
    # a body: centroid [m], angle [rad], area [m2] and polar second moment of area [m4] of its true shape, discs
    clump x y angle area inertia n
    dx dy r

The n lines behind `clump` are its discs: centres from the centroid in the frame of the body at angle 0, radii [m].
Discs may overlap; area and inertia are those of the shape they stand for. `#` begins a comment, blank lines are
skipped. Numbers are written with 17 digits, so that they are read back bit for bit.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path
from hpcdem.io.disk import explain

HEADER = "hpcdem clumps 1"
MOST_DISCS = 10**6
"""Largest number of discs in one body; more are refused as a mistake."""
FARTHEST = 100.0
"""Farthest point of a disc from the centroid in radii of gyration: a rod has 1.7, a disc 1.4."""
BODY = "clump x y angle area inertia n"
WIDEST = 2.0
"""Radius of gyration over the farthest point of the discs: a hoop has 1, and discs may omit some of the shape."""


@dataclass
class Clumps:
    """n bodies: x, y (n,) [m], angle (n,) [rad], area (n,) [m2], inertia (n,) [m4] f8; the discs of body k are
    start[k] : start[k + 1] of dx, dy, r f8 [m], in the frame of the body. start (n + 1,) i8."""

    x: np.ndarray
    y: np.ndarray
    angle: np.ndarray
    area: np.ndarray
    inertia: np.ndarray
    start: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    r: np.ndarray

    def __len__(self) -> int:
        return len(self.x)


def read_clumps(path: str | os.PathLike) -> Clumps:
    """The bodies of a clump file. Raises HpcdemError, ``file:line: what was read, what was expected``.

    Refused are bodies that cannot be: no disc, a radius, area or inertia that is not positive, a disc farther away than
    FARTHEST radii of gyration sqrt(inertia / area), a radius of gyration above WIDEST times the farthest point of the
    discs, a disc or a body given twice.
    """
    name = os.fspath(path)
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return _Reader(name).read(enumerate(file, 1))
    except OSError as problem:
        raise HpcdemError(explain(name, problem, "read")) from None


class _Reader:
    def __init__(self, name: str) -> None:
        self.name = name
        self.number, self.line = 0, ""

    def read(self, lines: Iterator[tuple[int, str]]) -> Clumps:
        rows = self._rows(lines)
        head = next(rows, None)
        if head is None:
            raise HpcdemError(f"{self.name}: is empty, expected a first line '{HEADER}'")
        if head != HEADER.split():
            self._refuse(f"'{HEADER}'")
        bodies: list[list[float]] = []
        discs: list[list[float]] = []
        start = [0]
        places: dict[tuple[float, float], int] = {}
        for words in rows:
            if words[0] != "clump":
                full = f", because the previous clump has all its {bodies[-1][5]:g} discs" if bodies else ""
                self._refuse(f"'{BODY}'{full}")
            body = self._numbers(words[1:], 6, f"'{BODY}'")
            self._check_body(body)
            place, begins = (body[0], body[1]), self.number
            if place in places:
                self._refuse(f"a position different from that of the clump in line {places[place]}")
            places[place] = begins
            mine: set[tuple[float, ...]] = set()
            for k in range(int(body[5])):
                row = next(rows, None)
                if row is None or row[0] == "clump":
                    found = "the file ends" if row is None else f"read '{self._shown()}'"
                    where = begins if row is None else self.number
                    raise HpcdemError(
                        f"{self.name}:{where}: {found} after {k} discs, expected the {int(body[5])} discs of the clump "
                        f"in line {begins}"
                    )
                disc = self._numbers(row, 3, "'dx dy r' of a disc")
                self._check_disc(disc, body, mine)
                discs.append(disc)
            self._check_size(body, discs[start[-1] :], begins)
            bodies.append(body)
            start.append(len(discs))
        if not bodies:
            raise HpcdemError(f"{self.name}: contains no clumps, expected lines '{BODY}'")
        table, rims = np.array(bodies), np.array(discs)
        x, y, angle, area, inertia = (table[:, k].copy() for k in range(5))
        dx, dy, r = (rims[:, k].copy() for k in range(3))
        return Clumps(x, y, angle, area, inertia, np.array(start, np.int64), dx, dy, r)

    def _rows(self, lines: Iterator[tuple[int, str]]) -> Iterator[list[str]]:
        """Words of the lines that say something."""
        for self.number, self.line in lines:
            words = self.line.lstrip("\ufeff").split("#")[0].split()
            if words:
                yield words

    def _check_body(self, body: list[float]) -> None:
        _, _, _, area, inertia, n = body
        if not area > 0.0:
            self._refuse("an area above 0")
        if not inertia > 0.0:
            self._refuse("an inertia above 0")
        if n != math.floor(n) or not 1 <= n <= MOST_DISCS:
            self._refuse(f"a number of discs from 1 to {MOST_DISCS}")

    def _check_disc(self, disc: list[float], body: list[float], mine: set[tuple[float, ...]]) -> None:
        dx, dy, r = disc
        if not r > 0.0:
            self._refuse("a radius above 0")
        gyration = math.sqrt(body[4] / body[3])
        if math.hypot(dx, dy) + r > FARTHEST * gyration:
            self._refuse(
                f"a disc within {FARTHEST:g} radii of gyration of the clump ({gyration:g} m) from its centroid"
            )
        if tuple(disc) in mine:
            self._refuse("a disc that this clump does not already contain")
        mine.add(tuple(disc))

    def _check_size(self, body: list[float], discs: list[list[float]], line: int) -> None:
        gyration = math.sqrt(body[4] / body[3])
        farthest = max(math.hypot(dx, dy) + r for dx, dy, r in discs)
        if gyration > WIDEST * farthest:
            raise HpcdemError(
                f"{self.name}:{line}: read inertia {body[4]:g} and area {body[3]:g}, a radius of gyration of "
                f"{gyration:g} m, expected at most {WIDEST:g} times the farthest point of its discs, {farthest:g} m"
            )

    def _numbers(self, words: list[str], n: int, expected: str) -> list[float]:
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) != n or "_" in "".join(words) or not all(map(math.isfinite, numbers)):
            self._refuse(f"{expected}, {n} numbers")
        return numbers

    def _shown(self) -> str:
        return "".join(c if c.isprintable() else " " for c in self.line.strip()[:60])

    def _refuse(self, expected: str) -> NoReturn:
        raise HpcdemError(f"{self.name}:{self.number}: read '{self._shown()}', expected {expected}")


def write_clumps(path: str | os.PathLike, clumps: Clumps) -> None:
    """Write a clump file that `read_clumps` reads back bit for bit. Raises HpcdemError if it cannot be written."""
    c = clumps
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write(HEADER + "\n")
        for k in range(len(c)):
            first, end = int(c.start[k]), int(c.start[k + 1])
            numbers = " ".join(_text(v[k]) for v in (c.x, c.y, c.angle, c.area, c.inertia))
            rows = (f"{_text(c.dx[i])} {_text(c.dy[i])} {_text(c.r[i])}\n" for i in range(first, end))
            file.write(f"clump {numbers} {end - first}\n" + "".join(rows))


def _text(value: float) -> str:
    return f"{value:.17g}"
