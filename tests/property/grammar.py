"""Random small models in the language of ZDEM, made to run: 20 to 150 particles, some hundred steps, no lasting peace.

Lengths are radii, speeds are hundredths of a radius per step, and the time step is a share of the critical one, so that
whatever is drawn can be computed; what goes wrong then is a mistake put in on purpose (`MISTAKES`), one per script.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

MARK = "# model: "
"""Begins the line of a stored script that holds what is not in its commands, as JSON."""
POINTS, BODIES, END = "points.dat", "bodies.clumps", "end.sav"
DENSITY = 2500.0


@dataclass(frozen=True)
class Model:
    """A script: its lines, the files it reads, and the line before which it may be cut in two."""

    lines: tuple[str, ...]
    cut: int | None = None
    files: dict[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """As ZDEM reads it, and `read` too."""
        head = MARK + json.dumps({"cut": self.cut, "files": self.files}) if self.cut or self.files else MARK + "{}"
        return "\n".join([head, *self.lines]) + "\n"

    @classmethod
    def read(cls, text: str) -> Model:
        """From a script that was stored."""
        head, *lines = text.splitlines()
        more = json.loads(head.removeprefix(MARK)) if head.startswith(MARK) else {}
        return cls(tuple(lines if head.startswith(MARK) else [head, *lines]), more.get("cut"), more.get("files", {}))

    def write(self, folder: Path, name: str = "model.py") -> Path:
        """Into a folder, with the files it reads."""
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in self.files.items():
            (folder / file).write_text(content)
        (folder / name).write_text(self.text)
        return folder / name

    def halves(self) -> tuple[Model, Model]:
        """The same calculation as two scripts: the first ends with a checkpoint, the second begins with it."""
        assert self.cut is not None
        before, after = self.lines[: self.cut], self.lines[self.cut :]
        outdir = [line for line in before if re.match(r"(?i)set\s+outdir", line)][-1:]
        return (
            Model((*before, "SAV middle.sav"), None, self.files),
            Model(("RES middle.sav", *outdir, *after), None, self.files),
        )


def number(value: float) -> str:
    """Seven digits; long enough to be no round number."""
    return f"{value:.7g}"


def point(x: float, y: float) -> str:
    """(x, y)"""
    return f"({number(x)}, {number(y)})"


class Maker:
    """Writes a script line by line, with what must be known of the lines before."""

    def __init__(self, draw: Callable[[st.SearchStrategy[Any]], Any]) -> None:
        self.draw = draw
        self.lines: list[str] = []
        self.files: dict[str, str] = {}
        self.r = self.pick(1.0, 70.0, 1e-3)
        self.width, self.height = self.r * self.whole(16, 40), self.r * self.whole(8, 16)
        self.left, self.bottom = (self.r * k for k in self.pick((0.0, 0.0), (-50.0, 30.0), (-13.0, -7.5)))
        self.hertz, self.disk = self.chance(50), self.pick("on", "off", "hex")
        self.stiffness = self.pick(1e6, 3e8)
        smallest = 0.8 * self.r
        volume = {"on": math.pi * smallest**2, "off": 4 / 3 * math.pi * smallest**3, "hex": 12**0.5 * smallest**2}
        self.share = self.pick(0.1, 0.2, 0.3)
        self.dt = self.share * math.sqrt(DENSITY * volume[self.disk] / self.stiffness)
        self.speed = 0.01 * self.r / self.dt
        self.groups = ["bed"]
        self.balls = 0
        self.walls: dict[int, float] = {}
        self.processes: set[int] = set()
        self.saves = 0
        self.accounts = self.pressed = self.rebounds = False
        self.around = self.strained = self.bends = self.settles = self.pulls = self.drags = False

    # ---- drawing

    def pick(self, *choices: Any) -> Any:
        """One of these; the first is the simplest."""
        return self.draw(st.sampled_from(choices))

    def whole(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return self.draw(st.integers(low, high))

    def chance(self, percent: int) -> bool:
        """True so often; False is the simplest."""
        return self.draw(st.integers(0, 99)) >= 100 - percent

    def between(self, low: float, high: float) -> float:
        """A number in 64ths of the interval."""
        return low + (high - low) * self.whole(0, 64) / 64

    def x(self, low: float = 0.0, high: float = 1.0) -> float:
        """Somewhere in the width."""
        return self.left + self.width * self.between(low, high)

    def y(self, low: float = 0.0, high: float = 1.0) -> float:
        """Somewhere in the height."""
        return self.bottom + self.height * self.between(low, high)

    def velocity(self) -> float:
        """A hundredth of a radius per step, more or less, either way."""
        return self.speed * self.pick(0.5, -0.5, 1.3, -1.0)

    def add(self, *words: str) -> None:
        """A line."""
        self.lines.append(" ".join(word for word in words if word))

    def perhaps(self, percent: int, *words: str) -> str:
        """The words, or nothing."""
        return " ".join(words) if self.chance(percent) else ""

    def color(self) -> str:
        return self.perhaps(30, "color", self.pick("red", "lg", "7"))

    def group(self, name: str) -> str:
        if name not in self.groups:
            self.groups.append(name)
        return f"group {name}"

    def radii(self) -> str:
        mixed = f"{number(0.8 * self.r)} {number(self.r)} {number(1.2 * self.r)}"
        return "rad discrete " + self.pick(number(self.r), mixed, f"{number(0.8 * self.r)} {number(self.r)}")

    def springs(self) -> str:
        """kn and ks of walls and rows."""
        return f"kn={number(self.stiffness)} ks={number(self.stiffness * self.pick(0.5, 1.0, 0.0))}"

    def material(self) -> str:
        """All that particles need: stiffness counts for an overlap of a hundredth of the radius."""
        loss = f"fric {self.pick('0.0', '0.3', '0.7')} damp {self.pick('0.0', '0.1', '0.5')}"
        if self.hertz:
            shear = self.stiffness / (0.2 * self.r)
            return f"density {DENSITY:g} shear {number(shear)} poiss {self.pick('0.2', '0.0', '0.33')} hertz {loss}"
        return f"density {DENSITY:g} {self.springs()} {loss}"

    # ---- RANGE

    def range(self) -> str:
        """RANGE and one to three terms."""
        terms = [self.term()]
        for _ in range(self.pick(0, 0, 0, 1, 2)):
            terms += [self.pick("and", "or", ""), self.term()]
        return " ".join(["RANGE", *(term for term in terms if term)])

    def term(self) -> str:
        r = self.r
        match self.pick("x", "y", "top", "group", "id", "sides", "P4", "ellipse", "half"):
            case "x":
                low, high = sorted((self.x(), self.x()))
                return f"x {number(low)} {number(high)}"
            case "y":
                low, high = sorted((self.y(), self.y()))
                return f"y {number(low)} {number(high)}"
            case "top":
                return f"y {{top}}-{number(r * self.whole(1, 6))} {{top}}"
            case "sides":
                return f"x {{left}} {{left}}+{number(r * self.whole(2, 9))}"
            case "half":
                return "x {left}/2+{right}/2 {right}*1.0" if self.left >= 0.0 else "y {bottom} {bottom}-{left}"
            case "group":
                return f"group {self.pick(*self.groups)}"
            case "id":
                first = self.whole(0, 40)
                return f"id {first}" if self.chance(30) else f"id {first} {first + self.whole(0, 30)}"
            case "P4":
                x0, y0, x1, y1 = self.x(0, 0.4), self.y(0, 0.4), self.x(0.6, 1), self.y(0.6, 1)
                return f"P4 {point(x0, y0)} {point(x1, y0 + r)} {point(x1, y1)} {point(x0 - r, y1)}"
            case _:
                axes = f"{number(r * self.whole(2, 9))} {number(r * self.whole(2, 9))}"
                return f"ellipse {point(self.x(), self.y())} {axes}"

    # ---- the beginning

    def beginning(self) -> None:
        if self.chance(15):
            self.load()
        else:
            self.add("START")
        if self.chance(20):
            self.add("SET outdir", self.pick("results", "data/inner"))
        self.add("SET disk", self.disk)
        pull = self.pick(2e-5, 2e-4, 0.0) * self.r / self.dt**2
        self.pulls = pull > 0.0
        self.add("SET gravity", number(pull * self.pick(0.0, 0.5, -1.0)), number(-pull))
        if self.chance(25):
            self.add(f"SET frac {self.share}")
        else:
            drag = self.perhaps(20, f"damp lsm {number(self.drag())}")
            self.drags = bool(drag)
            self.add("SET dt", number(self.dt), drag)
        more = [
            self.perhaps(20, f"seed {self.whole(0, 99)}"), self.perhaps(15, "wallside", self.pick("left", "both")),
            self.perhaps(15, f"gentry {self.pick('3', '0.5', '40')}"), self.perhaps(15, f"stepbar {self.whole(7, 90)}"),
            self.perhaps(10, "thickness 3.0"), self.perhaps(10, "units", self.pick("SI", "mm-MPa-s")),
            self.perhaps(15, "restitution 0.7") if self.disk != "on" else "",  # there are no clumps then
            self.perhaps(15, "rolling", self.pick("c", "a")),
        ]  # fmt: skip
        if any(more):
            self.add("SET", *more)
        self.rebounds = any(word.startswith("restitution") for word in more)
        self.intervals()
        self.enclosure()
        for ident, what in ((1, "kinetic"), (2, "step"), (3, "energy")):
            if self.chance(40 if ident < 3 else 15):
                self.add(f"HIST id {ident} interval {self.whole(5, 40)}, {what}")
        if self.chance(50):
            what = self.pick("time", "unbalanced", "contacts", "bonds")
            self.add(f"HIST id 9 interval {self.whole(5, 40)}, {what}")
        if all(any(line.startswith(f"HIST id {n}") for line in self.lines) for n in (1, 2)):
            self.add("PLOT hist 2 1")

    def drag(self) -> float:
        """A viscosity that stops the lightest particle in a few hundred steps [N s/m]."""
        return 0.005 * self.dt * self.stiffness / self.share**2

    def intervals(self) -> None:
        """Outputs, not too many of them. The account of energy does not go with pressures, nor with dashpots."""
        for name, percent in (("print", 40), ("save", 20), ("vtk", 15), ("ps", 15), ("energy", 20)):
            if self.chance(percent) and not (
                name == "energy" and (self.pressed or self.rebounds or self.strained or self.bends)
            ):
                self.add("SET", name, str(self.pick(50, 70, 130, 0)))
                self.accounts |= name == "energy"

    def enclosure(self) -> None:
        r, fric = self.r, self.pick("0.0", "0.4")
        self.around = self.chance(20)
        boxed = self.chance(75)
        if boxed:
            self.add(
                f"BOX left {number(self.left - 2 * r)} right {number(self.left + self.width + 2 * r)}",
                f"bottom {number(self.bottom - 2 * r)} height {number(3 * self.height)}",
                self.springs() if self.chance(60) else "", self.perhaps(50, f"fric {fric}"),
            )  # fmt: skip
        if self.around:
            sides = self.left - 2 * r, self.left + self.width + 2 * r
            self.add("PERIODIC x", point(*sides))
            if boxed and self.chance(80):
                self.add(f"HIST id 8 interval {self.whole(5, 40)}, {self.pick('sxx', 'syy', 'sxy', 'period')}")
            if self.chance(60):
                self.wall(0, (sides[0], self.bottom), (sides[1], self.bottom), fric)
            return
        right, top = self.left + self.width, self.bottom + 2 * self.height
        corners = {
            0: ((self.left, self.bottom), (right, self.bottom)),
            1: ((self.left, top), (self.left, self.bottom)),
            2: ((right, self.bottom), (right, top)),
        }
        for ident, (p1, p2) in corners.items():
            if self.chance(85):
                self.wall(ident, p1, p2, fric)

    def wall(self, ident: int, p1: tuple[float, float], p2: tuple[float, float], fric: str) -> None:
        self.add(f"WALL id {ident} nodes {point(*p1)} {point(*p2)}, {self.springs()} fric {fric}", self.color())
        self.walls[ident] = 0.0

    # ---- who is there

    def load(self) -> None:
        """LOAD a lattice with a hole or two."""
        step = 2.05 * self.r
        rows = []
        for k in range(self.whole(20, 60)):
            column, row = k % 12, k // 12
            if not self.chance(5):
                x, y = self.left + (column + 0.5) * step, self.bottom + (row + 0.5) * step
                rows.append(f"{number(x)} {number(y)} {number(self.r)}" + self.perhaps(30, " bed"))
        self.files[POINTS] = "\n".join(rows) + "\n"
        limits = f"x {number(self.left)} {number(self.left + self.width)}" if self.chance(30) else ""
        high = f"y {number(self.bottom)} {number(self.bottom + self.height)}" if self.chance(30) else ""
        if self.chance(20):
            self.add("START")
        self.add("LOAD", POINTS, self.perhaps(50, "scale 1.0"), limits, high)

    def populate(self) -> None:
        """One to three kinds of particles, then what they are made of."""
        kinds = ["gen", "grid", "row", "ball", *(["clumps"] if self.may_clump else [])]
        for kind in self.draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=3)):
            getattr(self, f"make_{kind}")()
        self.add(self.pick("PROP", "INIT"), self.material())
        if self.chance(30):
            self.add("PROP", self.material(), self.range())

    @property
    def may_clump(self) -> bool:
        """Whether the model can have clumps."""
        return self.disk == "on" and not (self.around or self.settles)

    def make_gen(self) -> None:
        low, high = self.left, self.left + self.width
        if self.around and self.chance(50):
            low, high = low - 2 * self.r, high + 2 * self.r  # across the sides
        bottom, top = self.bottom, self.bottom + self.height * self.pick(0.7, 0.4, 1.0)
        self.add(
            f"GEN num {self.whole(5, 110)}, {self.radii()}, x {point(low, high)}, y {point(bottom, top)}",
            self.color(), self.perhaps(70, "group bed"),
        )  # fmt: skip

    def make_grid(self) -> None:
        x0, y0 = self.x(0.0, 0.3), self.y(0.0, 0.3)
        x1, y1 = x0 + 2.4 * self.r * self.whole(2, 9), y0 + 2.4 * self.r * self.whole(2, 6)
        if self.around:
            x1 = min(x1, self.left + self.width)
        first = not any(re.match(r"(?i)gen|gli|bal|loa", line) for line in self.lines)
        self.add(
            "GEN grid", f"idmin {self.whole(0, 500)}" if first and self.chance(20) else "", self.radii(),
            f"x {point(x0, x1)} y {point(y0, y1)}", self.color(), self.group(self.pick("bed", "grid")),
        )  # fmt: skip

    def make_row(self) -> None:
        """A row that touches; sometimes it is a floor that nothing can move."""
        y, x0 = self.y(-0.05, 0.9), self.x(0.0, 0.4)
        name = self.pick("row", "base")
        self.add(
            f"GLINE p1 {point(x0, y)} p2 {point(x0 + self.r * self.whole(4, 9 if self.around else 24), y)}",
            f"rad {number(self.r)}",
            f"cratio {self.pick('1', '0.98', '0.9')}", self.springs(), self.perhaps(50, "fric 0.2"), self.color(),
            self.group(name),
        )  # fmt: skip
        if self.chance(50):
            self.add("FIX", self.pick("x y spin", "y", "x spin"), f"RANGE group {name}")

    def make_ball(self) -> None:
        ident = 100_000 + self.balls
        self.balls += 1
        self.add(
            f"BALL id={ident} x={number(self.x(0.05, 0.95))} y={number(self.y(1.05, 1.6))} rad={number(self.r)}",
            self.color(), self.perhaps(50, self.group("ball")),
        )  # fmt: skip

    def make_clumps(self) -> None:
        """Rods and triangles above all others, in a group of their own; discs only, as clumps want it."""
        r, lines = self.r, ["hpcdem clumps 1"]
        for k in range(self.whole(1, 4)):
            discs = [(1.3 * r * i, 0.0, self.pick(1.0, 0.8) * r) for i in range(self.whole(1, 5))]
            if self.chance(40):
                discs.append((0.0, 1.2 * r, 0.9 * r))
            area = math.pi * sum(d[2] ** 2 for d in discs)
            x, y = (sum(math.pi * d[2] ** 2 * d[axis] for d in discs) / area for axis in (0, 1))
            discs = [(dx - x, dy - y, dr) for dx, dy, dr in discs]
            inertia = sum(math.pi * d[2] ** 2 * (d[0] ** 2 + d[1] ** 2 + 0.5 * d[2] ** 2) for d in discs)
            turn = self.between(0.0, 6.0)
            lines.append(f"clump {number(8 * r * k)} 0 {number(turn)} {number(area)} {number(inertia)} {len(discs)}")
            lines += [" ".join(map(number, disc)) for disc in discs]
        self.files[BODIES] = "\n".join(lines) + "\n"
        where = f"x {number(self.x(0.1, 0.5))} y {number(self.y(1.2, 1.6))}"
        self.add(
            "CLUMP file", BODIES, where, self.perhaps(50, f"angle {number(self.between(-0.3, 0.3))}"),
            self.perhaps(50, "scale 0.8"), self.color(), self.group("rock"),
        )  # fmt: skip

    # ---- what happens to them

    def do_clumps(self) -> None:
        if self.may_clump and BODIES not in self.files:
            self.make_clumps()
            self.add("PROP", self.material(), "RANGE group rock")

    def do_join(self) -> None:
        """A few particles of neighbouring ids become one."""
        if self.may_clump:
            first = self.whole(0, 40)
            self.add(
                "CLUMP", self.perhaps(30, "color red"), self.perhaps(30, self.group("rock")),
                f"RANGE id {first} {first + self.whole(1, 4)}",
            )  # fmt: skip

    def do_rain(self) -> None:
        """More particles on top of all others."""
        name = f"rain{len(self.lines)}"
        low, high = sorted((self.x(0.0, 0.3), self.x(0.6, 1.0)))
        above = f"({{top}}, {{top}}+{number(self.r * self.whole(3, 8))})"
        self.add(f"GEN num {self.whole(2, 25)} {self.radii()} x {point(low, high)} y {above}", self.group(name))
        self.add("PROP", self.material(), f"RANGE group {name}")

    def do_ball(self) -> None:
        self.make_ball()
        self.add("PROP", self.material(), f"RANGE id {100_000 + self.balls - 1}")
        if self.chance(50):
            self.add(f"TWIN {self.whole(0, 9)} RANGE id {100_000 + self.balls - 1}")

    def do_row(self) -> None:
        self.make_row()
        self.add("PROP", self.material(), "RANGE group row or group base" if self.chance(50) else "")

    def do_delete(self) -> None:
        self.add("DEL", self.range())

    def do_bond(self) -> None:
        """Strengths from those that break at once to those that never do."""
        force = self.stiffness * self.r * self.pick(1.0, 1e-2, 1e-3, 1e-4)
        reach = self.pick("", f"tolerate {number(0.1 * self.r)}", "rext 1.05", "tolerate", "rext 0.97 tolerate 1e-9")
        if self.chance(60):
            area = math.pi * self.r**2 if self.disk == "off" else 2.0 * self.r
            modulus = self.stiffness * 2.0 * self.r / area * self.pick(0.2, 1.0)
            keys = f"ebmod {number(modulus)} gbmod {number(modulus * self.pick(0.5, 1.0))}"
            keys += f" tstrength {number(force / area)} sstrength {number(2 * force / area)}"
        else:
            keys = f"n_bond {number(force)} s_bond {number(force * self.pick(1, 3))}"
        keys += self.perhaps(15, " rubber") + self.perhaps(25, " conserving")
        if "ebmod" in keys and self.disk != "on":  # there are no clumps then
            keys += self.perhaps(30, " moment")
        self.add("PROP", keys, reach, self.perhaps(30, "fric 0.5"), self.perhaps(70, self.range()))

    def do_break(self) -> None:
        self.add("BOND break", self.perhaps(80, self.range()))

    def do_prop(self) -> None:
        keys = [
            self.perhaps(50, f"xv {number(self.velocity())}"), self.perhaps(40, f"yv {number(self.velocity())}"),
            self.perhaps(30, f"spin {number(self.velocity() / self.r)}"), self.perhaps(40, "fric 0.45"),
            self.perhaps(20, "damp 0.2"), self.perhaps(30, f"color {self.pick('blue', '3')}"),
            self.perhaps(30, self.group(self.pick("chosen", "bed"))),
        ]  # fmt: skip
        if self.disk != "on":  # there are no clumps then
            keys += [self.perhaps(20, "rfric 0.2"), self.perhaps(20, "rdamp 0.3")]
        if not self.accounts:
            push = number(1e-3 * self.stiffness)
            keys += [self.perhaps(25, f"xp {push}"), self.perhaps(30, f"yp -{push}")]
            self.pressed |= any(key.startswith(("xp", "yp")) for key in keys)
        self.add("PROP", *(keys if any(keys) else ["color black"]), self.range())

    def do_platens(self) -> None:
        """Two short rows, and the stress and strain between them and between walls."""
        names = [f"{place}{len(self.lines)}" for place in ("low", "high")]
        for name, y in zip(names, (self.y(0.2, 0.4), self.y(1.4, 1.6)), strict=True):
            x = self.x(0.3, 0.5)
            self.add(f"GLINE p1 {point(x, y)} p2 {point(x + 6 * self.r, y)} rad {number(self.r)}", self.springs(),
                     self.group(name))  # fmt: skip
        self.add("PROP", self.material(), f"RANGE group {names[0]} or group {names[1]}")
        wishes = [f"gstress group {names[0]}", f"gstrain group {'|'.join(names)}"]
        for ident, axis in ((0, "y"), (1, "x"), (2, "x")):
            wishes += [f"wall id {ident} {axis}stress"] * (ident in self.walls)
        wishes += ["xstrain wall 1|2"] * (1 in self.walls and 2 in self.walls)
        wishes += ["ystrain wall 0|1"] * (0 in self.walls and 1 in self.walls)
        for ident in range(4, 4 + self.whole(2, 4)):
            self.add(f"HIST id {ident} interval {self.whole(5, 40)}, {self.pick(*wishes)}")

    def do_log(self) -> None:
        self.add(self.pick("LOG on", "LOG off", "PAUSE"))

    def do_fix(self) -> None:
        self.add(self.pick("FIX", "FREE"), self.pick("x y spin", "y", "spin", "x y"), self.range())

    def do_move_a_wall(self) -> None:
        moving = sorted(self.walls)
        if not moving:
            return
        ident, speed = self.pick(*moving), self.velocity()
        axis = "yv" if ident == 0 else "xv"
        self.walls[ident] = speed
        self.add(f"WALL id {ident} {axis} {number(speed)}", self.perhaps(20, "fric 0.1"))

    def do_delete_a_wall(self) -> None:
        free = [
            ident
            for ident in sorted(self.walls)
            if not any(
                f"wall id {ident} " in line or "strain wall" in line for line in self.lines if line.startswith("HIST")
            )
        ]
        if free:
            ident = self.pick(*free)
            del self.walls[ident]
            self.add(f"WALL id {ident} delete")

    def do_new_wall(self) -> None:
        """A paddle inside, or the floor once more."""
        if 0 in self.walls and self.chance(40) and not self.around:
            ident, p1, p2 = 0, (self.left, self.bottom), (self.left + self.width, self.bottom)
        else:
            ident, x, y = 5, self.x(0.2, 0.4 if self.around else 0.8), self.y(0.5, 1.2)
            p1, p2 = (x, y), (x + self.r * self.whole(2, 6), y + self.r * self.whole(-2, 2))
        self.wall(ident, p1, p2, self.pick("0.0", "0.3"))

    def do_set(self) -> None:
        choice = self.pick("dt", "gravity", "drag", "intervals", "wallside")
        if choice == "dt":
            self.add("SET dt", number(self.dt * self.pick(0.7, 1.1)))
        elif choice == "gravity":
            pull = 1e-4 * self.r / self.dt**2
            self.add("SET gravity", point(pull * self.between(-1.0, 1.0), -pull))
        elif choice == "drag" and self.strained:
            pass
        elif choice == "drag":
            self.drags = True
            self.add("SET damp lsm", self.pick(number(self.drag()), "0.0"))
        elif choice == "wallside":
            self.add("SET wallside", self.pick("left", "both"))
        else:
            self.intervals()

    def do_strain(self) -> None:
        """Periodic sides begin to move, move at another rate, or stop."""
        if self.around and not (self.accounts or self.drags):
            self.strained = True
            self.add("PERIODIC xv", number(self.pick(self.velocity(), self.velocity(), 0.0)))

    def do_surface(self) -> None:
        """A process at the surface; the same id again continues it."""
        if not self.pulls or self.around or any(line.startswith("CLUMP") for line in self.lines):
            return
        ident = self.pick(1, 1, 2)
        if ident in self.processes and self.chance(20):
            self.add(f"SURFACE id {ident} off")
            self.processes.discard(ident)
            return
        self.processes.add(ident)
        self.settles = True
        r, dt = self.r, self.dt
        deeds = [
            self.perhaps(50, f"diffuse {number(r * r / dt * self.pick(0.05, 0.5))}"), self.perhaps(40, "slope 25"),
            self.perhaps(40, f"erode {number(r / dt * 0.02)} above {number(self.y(0.5, 0.8))}"),
            self.perhaps(50, f"deposit {number(r / dt * 0.05)} below {number(self.y(0.3, 0.5))}"),
        ]  # fmt: skip
        if not any(deeds):
            deeds = [f"below {number(self.y(0.4, 0.8))}"]
        makes = [deed for deed in deeds if deed and not deed.startswith("erode")]
        self.add(
            f"SURFACE id {ident} interval {self.whole(5, 40)}", *deeds,
            self.perhaps(30, f"x {point(self.left, self.x(0.6, 0.9))}"),
            f"rad discrete {number(r)} {number(0.8 * r)} {self.material()}" if makes else "",
            self.perhaps(30, "episode 30") if makes else "",
            self.perhaps(20, f"compact 0.5 {number(5 * r)}") if makes else "",
        )  # fmt: skip

    def do_flexure(self) -> None:
        """The floor bends on an elastic plate; nothing else moves it then."""
        if not self.pulls or self.around or self.accounts or self.bends or 0 not in self.walls or self.walls[0]:
            return
        self.bends = True
        del self.walls[0]
        r, weight = self.r, 2500.0 * self.pick(2.0, 20.0)
        rigidity = weight * 2e-4 * r / self.dt**2 * (self.pick(4, 10) * r) ** 4
        self.add(
            f"FLEXURE wall id 0 rigidity {number(rigidity)} contrast {number(weight)}",
            f"interval {self.whole(4, 30)}", self.perhaps(40, "left broken"), self.perhaps(30, "right clamped"),
            self.perhaps(50, "compensated"), self.perhaps(30, f"segments {self.whole(3, 12)}"),
        )  # fmt: skip
        if self.chance(50):
            self.add(f"HIST id 7 interval {self.whole(5, 40)}, deflection")

    def do_export(self) -> None:
        self.add(f"EXP part{len(self.lines)}.dat", self.perhaps(50, "group"), self.perhaps(60, self.range()))

    def do_save(self) -> None:
        self.saves += 1
        self.add(f"SAV kept{self.saves}.sav")

    def do_draw(self) -> None:
        self.add("DRAW", self.perhaps(60, "interval 40"), self.pick("bfill wall", "bondc bid bang", "mesh cforce", "",
                                                                     "-bline bfill", "bline"))  # fmt: skip

    def run(self) -> None:
        """CYC, or IMPLE if a wall moves."""
        moving = [(ident, speed) for ident, speed in sorted(self.walls.items()) if speed]
        if moving and self.chance(50):
            ident, speed = self.pick(*moving)
            way = self.whole(10, 90) * abs(speed) * self.dt
            kinds = [
                self.perhaps(35, f"{kind} {number(way * self.pick(0.4, 0.3))}")
                for kind in ("print", "save", "vtk", "ps")
            ]
            sign = math.copysign(1.0, speed) * self.pick(1.0, 1.0, -1.0)
            axis = "ymove" if ident == 0 else "xmove"
            self.add(f"IMPLE wall id {ident} {axis} {number(sign * way)}", *kinds)
        else:
            self.add(f"CYC {self.pick(self.whole(10, 90), self.whole(10, 90), 0, 1)}")


EVENTS = (
    "rain", "delete", "bond", "bond", "prop", "move_a_wall", "delete_a_wall", "break", "fix", "set", "new_wall",
    "row", "ball", "export", "save", "draw", "clumps", "join", "platens", "log", "strain", "surface", "surface",
    "flexure",
)  # fmt: skip


@st.composite
def good_models(draw: Any) -> Model:
    """A model in which nothing is wrong on purpose."""
    return _good(Maker(draw))


def _good(maker: Maker) -> Model:
    maker.beginning()
    start = len(maker.lines)
    maker.populate()
    if maker.chance(60):
        maker.do_bond()
    for chance, event in ((50, "strain"), (15, "surface"), (15, "flexure")):
        if maker.chance(chance):
            getattr(maker, f"do_{event}")()
    if maker.chance(40):
        maker.do_move_a_wall()
    maker.run()
    events = st.lists(st.sampled_from(EVENTS), max_size=4)
    for stage in maker.draw(st.lists(events, min_size=0, max_size=4)):
        for event in stage:
            getattr(maker, f"do_{event}")()
        maker.run()
    maker.add("SAV", END)
    if maker.chance(50):
        maker.add("STOP")
    cut = maker.whole(start, len(maker.lines) - 1) if maker.chance(40) else None
    return Model(tuple(maker.lines), cut, maker.files)


# ---- what people do wrong --------------------------------------------------------------------------------------------


def _place(maker: Maker) -> int:
    """Where a line may be put in: before one of those that run, mostly."""
    runs = [k for k, line in enumerate(maker.lines) if line.startswith(("CYC", "IMPLE"))]
    return maker.pick(*runs) if runs and maker.chance(80) else maker.whole(1, len(maker.lines))


def _inserted(*lines: str) -> Callable[[Maker], None]:
    def mistake(maker: Maker) -> None:
        at = _place(maker)
        maker.lines[at:at] = [line.format(**_sizes(maker)) for line in lines]

    return mistake


def _sizes(maker: Maker) -> dict[str, str]:
    values = {
        "dt": 60.0 * maker.dt, "fast": 200.0 * maker.speed, "far": 40.0 * maker.r, "r": maker.r, "kn": maker.stiffness,
        "x": maker.left + 0.5 * maker.width, "y": maker.bottom + 0.3 * maker.height,
    }  # fmt: skip
    return {name: number(value) for name, value in values.items()}


def _a_word(maker: Maker) -> None:
    at = maker.whole(0, len(maker.lines) - 1)
    words = maker.lines[at].split(" ")
    k = maker.pick(*(k for k, word in enumerate(words) if re.search("[a-zA-Z]", word)))
    words[k] = maker.pick(words[k] + "x", words[k][::-1], "foo")
    maker.lines[at] = " ".join(words)


def _a_number(maker: Maker) -> None:
    with_numbers = [k for k, line in enumerate(maker.lines) if re.search(r"\s[-\d(]", line)]
    at = maker.pick(*with_numbers)
    words = maker.lines[at].split(" ")
    k = maker.pick(*(k for k, word in enumerate(words) if re.match(r"[-\d(]", word)))
    maker.lines[at] = " ".join(words[:k] + words[k + 1 :])


def _without_a_line(maker: Maker) -> None:
    del maker.lines[maker.whole(0, len(maker.lines) - 1)]


def _a_line_twice(maker: Maker) -> None:
    at = maker.whole(0, len(maker.lines) - 1)
    maker.lines.insert(maker.whole(at, len(maker.lines)), maker.lines[at])


def _two_lines_swapped(maker: Maker) -> None:
    at = maker.whole(0, len(maker.lines) - 2)
    maker.lines[at : at + 2] = maker.lines[at + 1], maker.lines[at]


MISTAKES: dict[str, Callable[[Maker], None]] = {
    "unknown word": _a_word,
    "missing number": _a_number,
    "line left out": _without_a_line,
    "line twice": _a_line_twice,
    "lines swapped": _two_lines_swapped,
    "time step far too large": _inserted("SET dt {dt}"),
    "far too fast": _inserted("PROP yv {fast}"),
    "nobody left": _inserted("DEL"),
    "nobody left to measure": _inserted("DEL", "DEL RANGE y {{top}}-{r} {{top}}"),
    "bonds without contact": _inserted("DEL RANGE id 1 100000", "PROP n_bond 1e9 s_bond 1e9"),
    "bonds too far": _inserted("PROP n_bond 1e9 tolerate {far}"),
    "two laws": _inserted("PROP shear 1e9 poiss 0.2 hertz RANGE id 0 6", "PROP kn {kn} ks {kn} RANGE id 7 20"),
    "wall twice": _inserted("WALL id 1 nodes ({x}, {y}) ({far}, {far})", "WALL id 1 nodes ({x}, {y}) ({far}, {far})"),
    "wall without a way": _inserted("WALL id 1 xv 0.0", "IMPLE wall id 1 xmove {r}"),
    "one upon the other": _inserted(
        "BALL id 7000 x {x} y {y} rad {r}", "BALL id 7001 x {x} y {y} rad {r}",
        "PROP density 2500 kn {kn} ks {kn} RANGE id 7000 7001",
    ),
    "same id": _inserted("BALL id 7000 x {x} y {y} rad {r}", "BALL id 7000 x {x} y {far} rad {r}"),
    "no density": _inserted("BALL id 7000 x {x} y {y} rad {r}"),
    "no folder": _inserted("SAV nowhere/there.sav"),
    "clumps of spheres": _inserted("SET disk off", "CLUMP RANGE id 0 3"),
    "nobody to join": _inserted("CLUMP RANGE id 900000"),
    "no file": lambda maker: maker.lines.__setitem__(0, "LOAD missing.dat"),
    "no room": _inserted("GEN num 5 rad discrete {far} x (0 {r}) y (0 {r})"),
    "expression without a value": _inserted("DEL RANGE y {{top}}/0 {{top}}"),
}  # fmt: skip


@st.composite
def models(draw: Any) -> Model:
    """A model, in three of ten cases with one mistake."""
    maker = Maker(draw)
    model = _good(maker)
    if not maker.chance(30):
        return model
    MISTAKES[maker.pick(*MISTAKES)](maker)
    return Model(tuple(maker.lines), None, maker.files)


def same_but_noisy(draw: Any, lines: Sequence[str]) -> bytes:
    """The same commands as people may write them: case, blanks, separators, comments in any encoding, line ends."""
    out = []
    for line in lines:
        words = line.split(" ")
        if not re.match(r"(?i)sav|exp|res|loa|set outdir|clump file", line):  # file names keep their case
            change = draw(st.sampled_from([str.lower, str.upper, str.title]))
            words = [change(word) for word in words]
        gap = draw(st.sampled_from([" ", "  ", "\t", " , ", " = ", "\u3000"]))
        comment = draw(st.sampled_from([b"", b" # why", b"; !", b" !\xb3\xc1\xbb\xfd"]))
        out += [gap.join(words).encode() + comment, *draw(st.sampled_from([[], [b""], [b"  # \xff\xfe only a note"]]))]
    return draw(st.sampled_from([b"", b"\xef\xbb\xbf"])) + draw(st.sampled_from([b"\n", b"\r\n", b"\r"])).join(out)
