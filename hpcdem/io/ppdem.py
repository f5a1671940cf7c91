"""Grain files of PPDEM, the polyarc program: text, metres and degrees.

The first line holds the number of grains and a whole number whose meaning is not documented (1 in the files there
are). Then, as a stream of words whose line ends mean nothing, one grain after the other:

    n  x1 y1 ... xn yn  a1 ... an             n arcs: their first ends anticlockwise, their central angles ("sample")
    n  x1 y1 ... xn yn  r1 ... rn  a1 ... an  the same with the roundness of each edge before the angles ("full")
    1  x y  d d                               a circle: centre, twice the diameter
    x y  d d                                  the same without the 1, in a file of circles only ("plain")

"sample" is what the one sample of such a file has, "full" what the list of fields in the manual of the pre-processor
asks for. In the sample the angles are 5 times the edges' angles about the centre, in radians; the factor between
degrees and the numbers of a file is therefore a parameter.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.io.agreed import atomic_path
from hpcdem.io.disk import explain

LAYOUTS = ("sample", "full", "plain")
MOST_ARCS = 64
LARGEST = 1 << 31
"""Largest file that is read [bytes]."""


@dataclass(frozen=True)
class PpdemGrains:
    """n grains with m rows in all.

    start (n + 1,) i8: rows of a grain. x, y, theta (m,) f8 [m, rad]: first end and central angle of an arc; a circle
    has one row, its centre and 2 pi. diameter (n,) f8 [m]: of circles; 0 for the others. roundness (m,) f8 or None:
    the column of the "full" layout. group: the second number of the first line.
    """

    start: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    diameter: np.ndarray
    roundness: np.ndarray | None = None
    group: int = 1

    def __len__(self) -> int:
        return len(self.start) - 1


def circles(x: np.ndarray, y: np.ndarray, diameter: np.ndarray) -> PpdemGrains:
    """Grains that are circles; (n,) f8 [m] each."""
    n = len(x)
    return PpdemGrains(np.arange(n + 1), x, y, np.full(n, 2.0 * math.pi), diameter)


def write_ppdem(
    path: str | os.PathLike, grains: PpdemGrains, layout: str = "sample", angle_factor: float = 1.0
) -> None:
    """Write a file, one grain per line, 12 significant digits, complete or not at all.

    layout: "sample", "full" (needs `roundness`; circles have none) or "plain" (circles only); circles stand behind a 1
    except in "plain". angle_factor: numbers in the file per degree. Raises HpcdemError.
    """
    is_circle = grains.diameter > 0.0
    if layout not in LAYOUTS:
        raise HpcdemError(f"cannot write {os.fspath(path)}: layout '{layout}', expected one of {', '.join(LAYOUTS)}")
    if layout == "plain" and not is_circle.all():
        raise HpcdemError(f"cannot write {os.fspath(path)}: the layout 'plain' supports circles only")
    if layout == "full" and grains.roundness is None and not is_circle.all():
        raise HpcdemError(f"cannot write {os.fspath(path)}: the layout 'full' needs the roundness of the edges")
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", newline="\n") as file:
        file.write(f"{len(grains)} {grains.group}\n")
        file.writelines(_lines(grains, layout, angle_factor, is_circle))


def _lines(g: PpdemGrains, layout: str, factor: float, is_circle: np.ndarray) -> Iterator[str]:
    angle = np.degrees(g.theta) * factor
    for k, (a, b) in enumerate(zip(g.start[:-1].tolist(), g.start[1:].tolist())):
        if is_circle[k]:
            d = g.diameter[k]
            head = "" if layout == "plain" else "1 "
            yield f"{head}{g.x[a]:.12g} {g.y[a]:.12g} {d:.12g} {d:.12g}\n"
            continue
        words = [str(b - a)]
        for i in range(a, b):
            words += (f"{g.x[i]:.12g}", f"{g.y[i]:.12g}")
        if layout == "full":
            words += (f"{v:.12g}" for v in g.roundness[a:b])  # type: ignore[index]
        words += (f"{v:.12g}" for v in angle[a:b])
        yield " ".join(words) + "\n"


def read_ppdem(path: str | os.PathLike, layout: str | None = None, angle_factor: float = 1.0) -> PpdemGrains:
    """Read a file. layout None: the first of `LAYOUTS` that uses up all words of the file.

    Raises ScriptError (`file:line: what was read, what was expected`) or HpcdemError if it cannot be read at all.
    """
    name = os.fspath(path)
    try:
        if os.path.getsize(path) > LARGEST:
            raise HpcdemError(f"{name}: larger than {LARGEST >> 30} GiB, expected a file of grains")
        with open(path, "rb") as file:
            data = file.read()
    except OSError as problem:
        raise HpcdemError(explain(path, problem, "read")) from None
    values = _values(name, data)
    if len(values) < 2:
        raise ScriptError(name, 1, "contains no grains, expected the number of grains and a 1")
    count = values[0]
    if not (count >= 1.0 and count == math.floor(count)):
        raise ScriptError(name, _line(data, 0), f"read {count:g}, expected the number of grains")
    if values[1] != math.floor(values[1]) or abs(values[1]) > 1e9:
        raise ScriptError(name, _line(data, 1), f"read {values[1]:g}, expected a whole number after that of the grains")
    n, group = int(count), int(values[1])
    if n * 4 > len(values):
        raise ScriptError(name, _line(data, 0), f"{n} grains announced, but only {len(values) - 2} numbers follow")
    if layout == "plain" or (layout is None and len(values) - 2 == 4 * n):
        return _plain(name, data, values, n, group)
    first: ScriptError | None = None
    for trial in ("sample", "full") if layout is None else (layout,):
        try:
            at = _places(name, data, values, n, 3 if trial == "sample" else 4)
            return _taken_apart(name, data, values, at, group, trial == "full", angle_factor)
        except ScriptError as problem:
            first = first or problem
    assert first is not None
    raise first


def _values(name: str, data: bytes) -> np.ndarray:
    words = data.split()
    try:
        if b"_" in data:
            raise ValueError
        values = np.array(words, dtype="S").astype(np.float64) if words else np.zeros(0)
    except (ValueError, UnicodeDecodeError):
        for k, word in enumerate(words):
            if not re.fullmatch(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", word):
                shown = "".join(c if c.isprintable() else " " for c in word[:40].decode("utf-8", errors="replace"))
                raise ScriptError(name, _line(data, k), f"read '{shown}', expected a number") from None
        raise ScriptError(name, 1, "contains text that is not a number") from None
    wrong = np.flatnonzero(~np.isfinite(values) | (np.abs(values) > 1e30))
    if len(wrong):
        k = int(wrong[0])
        raise ScriptError(name, _line(data, k), f"read {values[k]:g}, expected a number of ordinary size")
    return values


def _line(data: bytes, word: int) -> int:
    """The line of a word, the first being 0; the last line for words that are not there."""
    for k, found in enumerate(re.finditer(rb"\S+", data)):
        if k == word:
            return data.count(b"\n", 0, found.start()) + 1
    return max(data.rstrip().count(b"\n") + 1, 1)


def _plain(name: str, data: bytes, values: np.ndarray, n: int, group: int) -> PpdemGrains:
    if len(values) - 2 != 4 * n:
        raise ScriptError(
            name, _line(data, 2 + 4 * n), f"{len(values) - 2} numbers for {n} circles, expected {4 * n}: x y d d each"
        )
    rows = values[2:].reshape(n, 4)
    for k in np.flatnonzero((rows[:, 2] <= 0.0) | (rows[:, 3] != rows[:, 2]))[:1]:
        raise ScriptError(name, _line(data, 2 + 4 * int(k)), _no_circle(*rows[k, 2:]))
    x, y, d = rows[:, :3].T
    made = circles(x.copy(), y.copy(), d.copy())
    return PpdemGrains(made.start, made.x, made.y, made.theta, made.diameter, None, group)


def _no_circle(a: float, b: float) -> str:
    return f"read {a:g} and {b:g}, expected the diameter of a circle, above 0, twice"


def _places(name: str, data: bytes, values: np.ndarray, n: int, per_arc: int) -> np.ndarray:
    """(n,) i8: where each grain's number of arcs stands among the words."""
    at = np.empty(n, np.int64)
    here, total, numbers = 2, len(values), values.tolist()
    for k in range(n):
        if here >= total:
            raise ScriptError(name, _line(data, total), f"ends after {k} grains, expected {n}")
        arcs = numbers[here]
        if not (1.0 <= arcs <= MOST_ARCS and arcs == int(arcs)) or arcs == 2.0:
            raise ScriptError(
                name,
                _line(data, here),
                f"grain {k + 1}: read {arcs:.12g}, expected its number of arcs (1 for a circle)",
            )
        at[k] = here
        here += 5 if arcs == 1.0 else 1 + per_arc * int(arcs)
    if here != total:
        text = f"ends within grain {n}" if here > total else f"continues after {n} grains, expected the end"
        raise ScriptError(name, _line(data, min(here, total)), text)
    return at


def _taken_apart(
    name: str, data: bytes, values: np.ndarray, at: np.ndarray, group: int, full: bool, factor: float
) -> PpdemGrains:
    arcs = values[at].astype(np.int64)
    start = np.concatenate([[0], np.cumsum(arcs)])
    owner = np.repeat(np.arange(len(at)), arcs)
    i = np.arange(start[-1]) - start[owner]
    x, y = values[at[owner] + 1 + 2 * i], values[at[owner] + 2 + 2 * i]
    is_circle = arcs == 1
    diameter = np.where(is_circle, values[at + 3], 0.0)
    for k in np.flatnonzero(is_circle)[:]:
        if not (values[at[k] + 3] > 0.0 and values[at[k] + 3] == values[at[k] + 4]):
            raise ScriptError(name, _line(data, int(at[k]) + 3), _no_circle(*values[at[k] + 3 : at[k] + 5]))
    shape = ~is_circle[owner]
    roundness = None
    if full and shape.any():
        roundness = np.where(shape, values[np.where(shape, at[owner] + 1 + 2 * arcs[owner] + i, 0)], 1.0)
    place = np.where(shape, at[owner] + 1 + (3 if full else 2) * arcs[owner] + i, 0)
    degrees = np.where(shape, values[place] / factor, 360.0)
    for k in np.flatnonzero(shape & ~((degrees >= 0.0) & (degrees < 360.0)))[:1]:
        raise ScriptError(
            name, _line(data, int(place[k])), f"read {values[place[k]]:g}, expected the central angle of an arc, 0 to "
            f"below {360.0 * factor:g}"
        )  # fmt: skip
    following = np.arange(1, len(x) + 1)
    following[start[1:] - 1] = start[:-1]
    # Twice the area of the polygon of the ends, about the first of them.
    fx, fy = x - x[start[:-1]][owner], y - y[start[:-1]][owner]
    twice = np.add.reduceat(fx * fy[following] - fx[following] * fy, start[:-1])
    for k in np.flatnonzero(~is_circle & ~(twice > 0.0))[:1]:
        raise ScriptError(
            name, _line(data, int(at[k])), f"grain {k + 1}: its end points are not in anticlockwise order"
        )  # fmt: skip
    return PpdemGrains(start, x, y, np.radians(degrees), diameter, roundness, group)
