"""Estimate of the number of particles from the script alone, accurate to some per cent.

GEN is followed by the kinetics of random sequential insertion. What falls is taken as a flat bed between its outermost
sides, of known density, that gets wider or narrower with the wall that moves; DEL takes its share of it. Rows, single
particles and files are counted exactly.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands import section_area
from hpcdem.core import selection as sel
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.io.dat import is_frame, read_dat
from hpcdem.lang.zdem.statement import Statement, find

JAMMED = 0.547
"""Fraction of the area covered by equal disks when no further disk fits (Feder 1980, J. Theor. Biol. 87, 237)."""
SETTLED = {"hertz": 0.95, "linear": 0.90}
"""Area of the disks over the area of a bed settled under its weight. Hertz particles overlap by much: published bed of
the ZDEM manual, 0.943 to 0.956; linear: a bed of 250 000 disks of 0.1 to 0.3 mm."""
FAILURES = 1000
"""Consecutive failed attempts after which GEN stops, unless SET gentry gives a number per requested particle."""

MAKERS = ("RESTORE", "LOAD", "BALL", "GLINE", "GEN", "CLUMP", "SECTION")

Rectangle = tuple[float, float, float, float]
"""x1, x2, y1, y2 [m]."""


@dataclass
class Layer:
    """Particles made together: how many, the area of their disks [m2], where they are."""

    n: float
    disks: float
    place: Rectangle

    def lose(self, share: float) -> None:
        self.n *= 1.0 - share
        self.disks *= 1.0 - share


@dataclass
class Estimate:
    """made: particles by index of the statement that makes them; before: particles at each CYC and IMPLE, by index;
    most: largest number at once. None is unknown. rough: indices whose number is an estimate; certain: no number of
    `before` is one."""

    made: dict[int, int | None] = field(default_factory=dict)
    before: dict[int, int | None] = field(default_factory=dict)
    most: int | None = 0
    rough: set[int] = field(default_factory=set)
    certain: bool = True


def estimate(statements: Sequence[Statement], directory: Path, restored: Mapping[str, Any] | None = None) -> Estimate:
    """Follow the statements of a script. Reads the file that LOAD names, if it is there.

    restored: what the file of RESTORE holds: "x", "y", "radius" of its particles (n,) [m].
    """
    follower = _Follower(directory, restored, kind_of(statements))
    for index, statement in enumerate(statements):
        follower.take(index, statement)
    return follower.result


def kind_of(statements: Sequence[Statement]) -> str:
    """ "hertz" if any particles of the script are, else "linear"."""
    return "hertz" if any("hertz" in s.arguments or "shear" in s.arguments for s in statements) else "linear"


class _Follower:
    """The model as estimated: a settled bed, layers that still fall, and particles that never move."""

    def __init__(self, directory: Path, restored: Mapping[str, Any] | None, kind: str) -> None:
        self.directory, self.restored = directory, restored
        self.density = SETTLED[kind]
        self.bed: Layer | None = None
        self.falling: list[Layer] = []
        self.standing: int | None = 0
        self.gentry = 0.0
        self.walls: dict[int, tuple[float, float]] = {}
        self.result = Estimate()

    # ---- who is there

    def count(self) -> int | None:
        layers = self.falling + ([self.bed] if self.bed else [])
        return None if self.standing is None else self.standing + round(sum(layer.n for layer in layers))

    def extents(self) -> dict[str, float]:
        places = [layer.place for layer in (*self.falling, *([self.bed] if self.bed else []))]
        if not places:
            return {}
        left, right, bottom, top = zip(*places)
        return {"left": min(left), "right": max(right), "bottom": min(bottom), "top": max(top)}

    def take(self, index: int, s: Statement) -> None:
        made: int | None = None
        match s.command:
            case "RESTORE":
                made = self._file(self.restored)
            case "LOAD":
                made = self._file(_rows(s, self.directory))
            case "BALL":
                made = self._stand(1)
            case "GLINE":
                (x1, y1), (x2, y2) = s.get("p1"), s.get("p2")
                spacing = 2.0 * s.get("rad") * s.get("cratio", 1.0)
                made = self._stand(math.floor(math.hypot(x2 - x1, y2 - y1) / spacing + 1e-9) + 1)
            case "GEN":
                made = self._gen(index, s)
            case "CLUMP" | "SECTION":
                made = self._clumps(s) if s.command == "CLUMP" else self._section(index, s)
            case "DEL":
                self._delete(s.selection)
            case "SET":
                self.gentry = s.get("gentry", self.gentry)
            case "WALL":
                self._wall(s)
            case "CYC" | "IMPLE":
                self._step(index, s)
        if s.command in MAKERS:
            self.result.made[index] = made
        here, most = self.count(), self.result.most
        self.result.most = None if here is None or most is None else max(most, here)

    def _step(self, index: int, s: Statement) -> None:
        self._settle()
        self.result.before[index] = self.count()
        if s.command == "IMPLE":
            self._move(s)

    def _wall(self, s: Statement) -> None:
        """Middle of a wall and its velocity along x."""
        name = s.get("id")
        if s.get("delete"):
            self.walls.pop(name, None)
        if s.get("nodes"):
            self.walls[name] = sum(x for x, _ in s.get("nodes")) / 2.0, 0.0
        if name in self.walls:
            self.walls[name] = self.walls[name][0], s.get("xv", self.walls[name][1])

    def _stand(self, n: int) -> int:
        if self.standing is not None:
            self.standing += n
        return n

    def _file(self, table: Mapping[str, Any] | None) -> int | None:
        if table is None:
            self.standing = None
            return None
        x, y, r = (list(map(float, table[name])) for name in ("x", "y", "radius"))
        if not x:
            return 0
        place = (min(a - c for a, c in zip(x, r)), max(a + c for a, c in zip(x, r)),
                 min(b - c for b, c in zip(y, r)), max(b + c for b, c in zip(y, r)))  # fmt: skip
        self.bed = Layer(len(x), sum(math.pi * c * c for c in r), place)
        return len(x)

    def _clumps(self, s: Statement) -> int | None:
        """Discs of a clump file, which fall; particles that are joined are there already."""
        if s.get("file") is None:
            return 0
        table = _discs(s, self.directory)
        if table is None:
            self.standing = None
            return None
        x, y, r = table
        place = min(x) - max(r), max(x) + max(r), min(y) - max(r), max(y) + max(r)
        self.falling.append(Layer(len(x), sum(math.pi * c * c for c in r), place))
        return len(x)

    def _section(self, index: int, s: Statement) -> int | None:
        """Discs of the porosity in the polygons, if the file is there."""
        if not s.get("rad"):
            return 0
        area = _area_of_section(s, self.directory)
        if area is None:
            self.standing = None
            return None
        covered, place = area
        n = covered * (1.0 - s.get("porosity", 0.2)) / (math.pi * float(np.mean(np.square(s.get("rad")))))
        self.result.rough.add(index)
        self.result.certain = False
        self.falling.append(Layer(n, covered * (1.0 - s.get("porosity", 0.2)), place))
        return round(n)

    # ---- GEN

    def _gen(self, index: int, s: Statement) -> int | None:
        try:
            (x1, x2), (y1, y2) = (tuple(sel.number(v, self.extents()) for v in s.get(axis)) for axis in ("x", "y"))
        except CommandError:
            self.result.rough.add(index)
            return self._stand(s.get("num")) if "num" in s.arguments else None
        radii = s.get("rad")
        if "grid" in s.arguments:
            side = 2.0 * max(radii)
            n: float = math.floor((x2 - x1) / side + 1e-9) * math.floor((y2 - y1) / side + 1e-9)
            n, disks = max(n, 0), max(n, 0) * sum(math.pi * r * r for r in radii) / len(radii)
        else:
            free = self._free((x1, x2, y1, y2))
            n, disks = insertion(s.get("num"), self.gentry, radii, max(free, 0.0), max((x2 - x1) * (y2 - y1), 0.0))
            if n < s.get("num") or free < (x2 - x1) * (y2 - y1):
                self.result.rough.add(index)
                self.result.certain = False
        self.falling.append(Layer(n, disks, (x1, x2, y1, y2)))
        return round(n)

    def _free(self, place: Rectangle) -> float:
        """Area of a rectangle that no layer takes [m2]."""
        area = (place[1] - place[0]) * (place[3] - place[2])
        for layer in (*self.falling, *([self.bed] if self.bed else [])):
            area -= _common(place, layer.place)
        return area

    # ---- what falls, what is taken away

    def _settle(self) -> None:
        """Add all falling particles to the bed."""
        if not self.falling:
            return
        if self.bed is None:
            first = self.falling.pop(0)
            self.bed = Layer(first.n, first.disks, first.place)
        x1, x2, y1, _ = self.bed.place
        for layer in self.falling:
            self.bed.n += layer.n
            self.bed.disks += layer.disks
            x1, x2, y1 = min(x1, layer.place[0]), max(x2, layer.place[1]), min(y1, layer.place[2])
        self.falling.clear()
        self._lay(x1, x2, y1)

    def _lay(self, x1: float, x2: float, y1: float) -> None:
        assert self.bed is not None
        self.bed.place = (x1, x2, y1, y1 + self.bed.disks / (max(x2 - x1, 1e-30) * self.density))

    def _move(self, s: Statement) -> None:
        """A wall at one side of the bed takes this side along."""
        x, speed = self.walls.get(s.get("id"), (math.nan, 0.0))
        distance = math.copysign(abs(s.get("xmove", 0.0)), speed)
        if self.bed is None or not speed or not math.isfinite(x):
            return
        x1, x2, y1, _ = self.bed.place
        near = 0.1 * (x2 - x1)
        x1, x2 = (x1 + distance if abs(x - x1) <= near else x1), (x2 + distance if abs(x - x2) <= near else x2)
        self.walls[s.get("id")] = x + distance, speed
        if x2 > x1:
            self._lay(x1, x2, y1)

    def _delete(self, where: sel.Selection | None) -> None:
        """Rectangles take their share; other selections are not followed."""
        if where is None:
            self.bed, self.standing = None, 0 if self.standing is not None else None
            self.falling.clear()
            return
        try:
            cut = _rectangle(where.resolve(self.extents()))
        except CommandError:
            return
        if cut is None:
            self.result.certain = False
            return
        for layer in (*self.falling, *([self.bed] if self.bed else [])):
            whole = _common(layer.place, layer.place)
            layer.lose(_common(layer.place, cut) / whole if whole > 0.0 else 0.0)
            if layer.n:
                self.result.certain = False
        if self.bed is not None and cut[0] <= self.bed.place[0] and cut[1] >= self.bed.place[1]:
            x1, x2, y1, y2 = self.bed.place
            self.bed.place = (x1, x2, y1, min(y2, max(cut[2], y1))) if cut[3] >= y2 else self.bed.place


def insertion(num: int, gentry: float, radii: Sequence[float], free: float, rectangle: float) -> tuple[float, float]:
    """Particles that GEN makes and the area of their disks [m2], of `num` requested; free: area [m2] without particles
    in the rectangle (area [m2]). gentry: attempts per particle; 0: until FAILURES in a row are to be expected.

    An attempt finds room with probability (1-x)^3 (1 + 0.812 x + 0.4258 x^2 + 0.0716 x^3), x = cover / JAMMED (Schaaf
    and Talbot 1989, J. Chem. Phys. 91, 4401, equal disks); for a disk of radius r among others to the power of the mean
    of (r + r')^2 over that of (2 r')^2, since it must stay clear of a circle of radius r + r' around each.
    """
    if free <= 0.0 or rectangle <= 0.0:
        return 0.0, 0.0
    weights = Counter(radii)
    placed = dict.fromkeys(weights, 0.0)
    mean = sum(math.pi * r * r for r in radii) / len(radii)
    # Only attempts in the free part can succeed; `all_at` is how many of them there are, in layers of disks.
    last = max(gentry * num, num) / rectangle * mean if gentry > 0.0 else math.inf
    t, total, ends = 0.0, 0.0, 0.0  # ends: number of rows of failures that are to be expected so far
    while t < last and total < num and t < 1e4 and ends < 0.56:  # exp(-Euler)
        dt = min(0.02 + 0.02 * t, last - t)
        cover = sum(n * math.pi * r * r for r, n in placed.items()) / free
        crowd = placed if total > 0.0 else weights
        size = sum(crowd.values())
        r1, r2 = (sum(n * r**k for r, n in crowd.items()) / size for k in (1, 2))
        x = min(cover / JAMMED, 1.0)
        p = (1.0 - x) ** 3 * (1.0 + 0.812 * x + 0.4258 * x**2 + 0.0716 * x**3)
        if p <= 1e-12:
            break
        luck = {r: w / len(radii) * p ** ((r * r + 2.0 * r * r1 + r2) / (4.0 * r2)) for r, w in weights.items()}
        for r in weights:
            placed[r] += dt * free / mean * luck[r]
        if gentry <= 0.0:
            share = sum(luck.values()) * free / rectangle
            ends += dt * rectangle / mean * share * (1.0 - share) ** FAILURES
        total = sum(placed.values())
        t += dt
    if total > num:
        placed = {r: n * num / total for r, n in placed.items()}
    return min(total, num), sum(n * math.pi * r * r for r, n in placed.items())


def _common(a: Rectangle, b: Rectangle) -> float:
    """Area that two rectangles share."""
    width, height = min(a[1], b[1]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[2], b[2])
    return width * height if width > 0.0 and height > 0.0 else 0.0


def _rectangle(where: sel.Selection) -> Rectangle | None:
    """The rectangle of a RANGE of x and y terms; None for any other."""
    terms = where.terms if isinstance(where, sel.Chain) else (where,)
    if isinstance(where, sel.Chain) and "or" in where.joins:
        return None
    bounds = {"x": [-math.inf, math.inf], "y": [-math.inf, math.inf]}
    for term in terms:
        if not isinstance(term, sel.Interval):
            return None
        low, high = bounds[term.axis]
        bounds[term.axis] = [max(low, float(term.low)), min(high, float(term.high))]  # type: ignore[arg-type]
    return (*bounds["x"], *bounds["y"])  # type: ignore[return-value]


def _area_of_section(s: Statement, directory: Path) -> tuple[float, Rectangle] | None:
    """Area of the polygons of a section [m2] and the rectangle about them; None without a readable file."""
    path = find(directory, s.get("file"))
    legend = find(directory, s.get("legend")) if s.get("legend") else None
    words = {name: s.get(name) for name in ("scale", "origin", "to", "line", "attribute", "only") if s.get(name)}
    try:
        return section_area.of_polygons(path or s.get("file"), legend=legend, **words)
    except HpcdemError:
        return None


def _discs(s: Statement, directory: Path) -> tuple[list[float], list[float], list[float]] | None:
    """Centres of the clump, and radius, of every disc that CLUMP would make; None if the file cannot be read."""
    path = find(directory, s.get("file"))
    if path is None:
        return None
    out: tuple[list[float], list[float], list[float]] = [], [], []
    scale, at = s.get("scale", 1.0), (0.0, 0.0)
    c, sn = (scale * f(s.get("angle", 0.0)) for f in (math.cos, math.sin))
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                words = line.split("#")[0].split()
                if words[:1] == ["clump"]:
                    x, y = float(words[1]), float(words[2])
                    at = x * c - y * sn + s.get("x", 0.0), x * sn + y * c + s.get("y", 0.0)
                elif len(words) == 3 and words[0] != "hpcdem":
                    for column, value in zip(out, (*at, float(words[2]) * scale)):
                        column.append(value)
    except (OSError, ValueError, IndexError):
        return None
    return out if out[0] else None


def _rows(s: Statement, directory: Path) -> Mapping[str, Any] | None:
    """The particles that LOAD would take; None if they cannot be read."""
    path = find(directory, s.get("file"))
    if path is None:
        return None
    table: dict[str, list[float]] = {"x": [], "y": [], "radius": []}
    scale = s.get("scale", 1.0)
    try:
        if is_frame(path):
            found = read_dat(path, ("particles",)).tables["particles"].columns
            keep = np.ones(len(found["x"]), bool)
            for name in ("x", "y"):
                low, high = s.get(name) or (-math.inf, math.inf)
                keep &= (found[name] >= low) & (found[name] < high)
            return {name: found[name][keep] for name in table}
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                words = line.split("#")[0].split()
                if not words:
                    continue
                x, y, r = map(float, words[:3])
                bounds = ((s.get("x"), x), (s.get("y"), y))
                if all(pair is None or pair[0] <= value < pair[1] for pair, value in bounds):
                    for name, value in zip(table, (x, y, r)):
                        table[name].append(value * scale)
    except (OSError, ValueError, TypeError, KeyError, HpcdemError):
        return None
    return table
