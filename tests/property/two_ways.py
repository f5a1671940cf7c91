"""Random models, each said in two ways that mean the same: in one command or two, of a group or of numbers, in one run
or several, across a save, in other units. The end must be the same to the last bit.

A model is drawn from a seed; a way is a name, and a set of names turns the plain script of a seed into another one.
Units are changed by powers of two, which changes no digit of any number.
"""

from __future__ import annotations

import io
import json
import random
import re
import sys
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem import session
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.free_field import FreeField
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.liners.model import Liners
from hpcdem.runtime.progress import Log
from hpcdem.runtime.stop_requests import StopRequests
from hpcdem.session import Session

BLOCKS, PARTICLES, COUPLED = "blocks", "particles", "coupled"
KINDS = (BLOCKS, PARTICLES, COUPLED)

WAYS = {
    "split": "each run in two",
    "solve": "model solve cycles in place of model step",
    "time": "model solve time in place of model step",
    "restore": "saved and restored in the middle",
    "again": "something said once more, as it is, in the middle",
    "order": "independent commands in another order",
    "records": "histories, frames and an account of energy, which only look",
    "ranges": "of all as a range of numbers, a place or a group",
    "properties": "properties in two commands",
    "joints": "properties of joints in two commands",
    "tables": "a constant condition as a table",
    "surfaces": "the contact of faces said of the faces, in halves",
    "within": "what particles are told between two runs, a function tells them in the middle of one",
    "language": "lines of the ZDEM language in place of methods",
    "functions": "a function is called at some steps, and looks",
    "agreed": "the time step said at hpcdem.couple, or of the blocks",
    "mass": "another unit of mass",
    "length": "another unit of length",
    "seconds": "another unit of time",
}
"""What the two scripts differ in."""
OF = {
    BLOCKS: {"split", "solve", "time", "restore", "again", "order", "records", "ranges", "properties", "joints",
             "tables", "surfaces", "mass", "length", "seconds"},
    PARTICLES: {"split", "restore", "again", "order", "records", "ranges", "properties", "language", "functions",
                "within", "mass", "length", "seconds"},
    COUPLED: set(WAYS) - {"tables"},
}  # fmt: skip
"""Those that there are for a kind of model."""


@dataclass
class Units:
    """What a number of the plain script is in the units of this one; per metre of thickness."""

    m: float = 1.0
    l: float = 1.0  # noqa: E741
    t: float = 1.0

    def length(self, x: float) -> float:
        return x * self.l

    def time(self, x: float) -> float:
        return x * self.t

    def speed(self, x: float) -> float:
        return x * self.l / self.t

    def gravity(self, x: float) -> float:
        return x * self.l / self.t**2

    def density(self, x: float) -> float:
        return x * self.m / self.l**2

    def stress(self, x: float) -> float:
        """Also the stiffness of a contact between discs."""
        return x * self.m / self.t**2

    def toughness(self, x: float) -> float:
        """Energy per area, and forces per metre of thickness."""
        return x * self.m * self.l / self.t**2

    def force(self, x: float) -> float:
        """Of one bolt, whose spacing is a length."""
        return x * self.m * self.l**2 / self.t**2


@dataclass
class Writer:
    """Makes the script of a seed. ways: see WAYS; wide: so many times as wide, for several ranks."""

    kind: str
    seed: int
    ways: frozenset[str]
    wide: int = 1
    units: Units = field(default_factory=Units)

    def __post_init__(self) -> None:
        of = self.rng("units")
        self.units = Units(
            4.0 ** of.choice((-3, -1, 2, 5)) if "mass" in self.ways else 1.0,
            4.0 ** of.choice((-2, -1, 1, 3)) if "length" in self.ways else 1.0,
            2.0 ** of.choice((-5, -1, 1, 3)) if "seconds" in self.ways else 1.0,
        )
        self.model = random.Random(f"{self.seed} {self.kind}")
        self.lines: list[str] = []
        self.steps = 0

    def rng(self, way: str) -> random.Random:
        """For what only this way needs."""
        return random.Random(f"{self.seed} {way}")

    def has(self, way: str) -> bool:
        return way in self.ways

    def text(self) -> str:
        """The script."""
        self.lines = ["import hpcdem"]
        if self.kind != BLOCKS:
            self.particles()
        if self.kind != PARTICLES:
            self.blocks()
        if self.kind == COUPLED:
            self.couple()
        self.runs()
        return "\n".join(self.lines) + "\n"

    def add(self, *lines: str) -> None:
        self.lines += lines

    def shuffled(self, groups: Sequence[Sequence[str]]) -> None:
        """Lines whose groups may stand in any order."""
        groups = list(groups)
        if self.has("order"):
            self.rng(f"order {len(self.lines)}").shuffle(groups)
        for lines in groups:
            self.add(*lines)

    def where(self, kind: str) -> str:
        """Nothing, or a range in which all are."""
        if not self.has("ranges"):
            return ""
        group = "range group 'whole' set 'sets'" if kind == "element" else "range id 0 1000000"
        far = self.units.length(1e3)
        return " " + self.rng(f"ranges {kind}").choice((group, "range id 0 1000000", f"range x {-far!r} {far!r}"))

    # ---- particles -----------------------------------------------------------------------------------------------

    def particles(self) -> None:
        u, draw = self.units, self.model
        self.radius = draw.choice((0.03125, 0.04, 0.05))
        self.friction = draw.choice((0.0, 0.2, 0.5))
        self.stiffness = draw.choice((1e6, 2e6))
        self.disc_density = draw.choice((2000.0, 2500.0))
        self.damp = draw.choice((0.0, 0.3))
        self.dt = 2.0**-16 if self.kind == COUPLED else draw.choice((2.0**-16, 2.0**-15))
        self.gravity = draw.choice((0.0, -9.81))
        bonded, hertz = draw.random() < 0.4, draw.random() < 0.25
        if hertz and self.kind == COUPLED:
            u.l = 1.0  # sphere and element, which is of one metre of thickness, are not of the same dimension
        moving = draw.choice((0.0, 0.0, 0.5))
        self.follows = draw.random() < 0.5
        say = self._said
        self.add("sand = hpcdem.Simulation(outdir='data/sand')")
        options = [
            say("set", gravity=(0.0, u.gravity(self.gravity))), say("set", disk="on"), say("set", seed=7),
            say("set", lsm=draw.choice((0.0, 5.0)) * u.m / u.t),
        ]  # fmt: skip
        if not self.has("agreed"):
            options.append(say("set", dt=u.time(self.dt)))
        self.shuffled([[line] for line in options])
        kn = u.stress(2e6)

        def size(x: float) -> str:
            return repr(u.length(x))

        self.add(
            f"sand.box({size(-0.2)}, {size(self.wide + 0.2)}, {size(-0.2)}, {size(2.0)}, kn={kn!r}, ks={kn!r}, "
            "fric=0.1)",
            f"sand.wall(1, (({size(-0.125)}, 0.0), ({size(self.wide + 0.125)}, 0.0)), kn={kn!r}, ks={kn!r}, fric=0.3)",
            f"sand.wall(1, yv={u.speed(moving)!r})",
            f"sand.gen_grid([{size(self.radius)}], x=(0.0, {size(float(self.wide))}), y=(0.0, {size(0.3)}), "
            "group='bed')",
        )
        if self.kind == PARTICLES:
            self.add(f"sand.gen(6, rad=[{size(self.radius * 0.75)}], x=(0.0, {size(1.0)}), y=({size(0.35)}, "
                     f"{size(0.5)}), group='loose')")  # fmt: skip
        keys = {
            "density": u.density(self.disc_density), "kn": u.stress(self.stiffness),
            "ks": u.stress(0.5 * self.stiffness), "fric": self.friction, "damp": self.damp,
            "yv": u.speed(-1.0 if self.kind == PARTICLES else 0.0), "xv": u.speed(0.25),
        }  # fmt: skip
        if hertz:  # the law of a sphere: a modulus of another dimension
            keys |= {"shear": u.stress(2e7) / u.l, "poiss": 0.25, "hertz": True}
            del keys["kn"], keys["ks"]
        self.hertz = hertz
        where = {}
        if self.has("ranges"):
            where = {"where": self.rng("where").choice(("group bed or group loose", "id 0 100000"))}
        if self.has("properties"):
            names = list(keys)
            self.rng("properties").shuffle(names)
            cut = self.rng("properties").randint(1, len(names) - 1)
            parts = [{n: keys[n] for n in names[:cut]}, {n: keys[n] for n in names[cut:]}]
        else:
            parts = [keys]
        for part in parts:
            self.add(say("prop", **part, **where))
        if self.follows:
            self.add("sand.hist(8, 4, 'kinetic')", "sand.hist(9, 6, 'unbalanced')")
        if bonded and not hertz:
            strength = u.stress(1e6)
            self.add(say("bond", ebmod=u.stress(1e7), gbmod=u.stress(1e7), tstrength=strength, sstrength=strength))
        if self.has("records"):
            every = self.rng("records").choice((1, 7))
            self.add(
                f"sand.set(print=11, energy={every}, vtk=17, stepbar={every})", "sand.hist(1, 5, 'kinetic')",
                "sand.hist(2, 3, 'contacts')",
            )  # fmt: skip
        if self.has("functions"):
            every = self.rng("functions").randint(2, 9)
            self.add(f"sand.every({every}, lambda s: (s.count, s.contacts(), s.extents()) and None)")

    def _said(self, command: str, **values: Any) -> str:
        """A method, or the line of the ZDEM language that is the same."""
        if self.has("language") and command in ("set", "prop"):
            text = self._zdem(command, values)
            if text is not None:
                return f"sand.command({text!r})"
        inside = ", ".join(f"{name}={value!r}" for name, value in values.items())
        return f"sand.{command}({inside})"

    @staticmethod
    def _zdem(command: str, values: dict[str, Any]) -> str | None:
        values = dict(values)
        where = values.pop("where", None)
        if values.pop("hertz", False):
            values["hertz"] = ""
        if command == "set" and "lsm" in values:
            return f"SET damp lsm {values['lsm']!r}"

        def shown(value: Any) -> str:
            if isinstance(value, tuple):
                return " ".join(map(repr, value))
            return value if isinstance(value, str) else repr(value)

        words = [f"{name} {shown(value)}" for name, value in values.items()]
        return f"{command.upper()} {' '.join(words)}" + (f" RANGE {where}" if where else "")

    # ---- blocks --------------------------------------------------------------------------------------------------

    def blocks(self) -> None:
        u, draw = self.units, self.model
        base = 0.0
        if self.kind == COUPLED:  # half a millimetre above the bed
            base = 2.0 * self.radius * int(0.3 / (2.0 * self.radius) + 1e-9) + 0.0005
        self.low, self.high = base, base + 0.25
        self.jointed = draw.random() < 0.7
        self.rock = {
            "density": u.density(2600.0), "young": u.stress(draw.choice((1e8, 4e8))),
            "poisson-ratio": draw.choice((0.2, 0.25)), "friction": draw.choice((0.0, 30.0)),
            "damp-factor": draw.choice((0.0, 0.1)), "penalty": u.stress(draw.choice((1e9, 2e9))),
        }  # fmt: skip
        weak = 0.125 if self.kind == COUPLED else 1.0
        self.joint = {
            "cohesion": u.stress(6e4 * weak), "tensile-strength": u.stress(2e4 * weak), "gf1": u.toughness(0.05 * weak),
            "gf2": u.toughness(0.2 * weak), "friction": 35.0, "penalty-normal": u.stress(2e9),
            "penalty-shear": u.stress(1.25e9), "penalty-overlay": u.stress(3e9),
        }  # fmt: skip
        self.static = self.kind == BLOCKS and draw.random() < 0.25
        if self.kind != COUPLED:
            self.dt = 2.0**-17
            self.gravity = draw.choice((0.0, -9.81))
        self.collision = draw.random() < 0.85
        large = draw.random() < 0.8
        self.add("pcdc model new")
        options = [
            [f"pcdc model gravity (0,{u.gravity(self.gravity)!r})"],
            [f"pcdc model option collision {'on' if self.collision else 'off'}"],
            [f"pcdc model option large-strain {'on' if large else 'off'}"],
        ]
        self.fixed_dt = self.kind == BLOCKS and draw.random() < 0.6
        if self.fixed_dt:
            options.append([f"pcdc model time-step value {u.time(self.dt)!r}"])
        self.shuffled(options)
        nx, ny = draw.choice(((3, 2), (4, 2), (2, 2)))
        kind = draw.choice(("tri", "tri", "quad"))
        x0, x1 = u.length(0.25), u.length(0.25 + 0.5 * self.wide)
        low, high = u.length(self.low), u.length(self.high)
        self.add(f"pcdc mesh structured ({x0!r},{low!r}) ({x1!r},{high!r}) cells {nx * self.wide} {ny} type {kind} "
                 "group 'whole' set 'sets'")  # fmt: skip
        second = draw.random() < 0.5
        if second:
            gap = draw.choice((0.001, 0.0005))
            self.add(f"pcdc mesh structured ({u.length(0.3)!r},{u.length(self.high + gap)!r}) "
                     f"({u.length(0.5 * self.wide + 0.2)!r},{u.length(self.high + gap + 0.2)!r}) cells "
                     f"{2 * self.wide} 1 type {kind} group 'whole' set 'sets'")  # fmt: skip
        self.creeps = self.kind == BLOCKS and self.rng("creep").random() < 0.3
        self.yields = not self.creeps and self.rng("plastic").random() < 0.4
        self.bolted = self.rng("bolts").random() < 0.35
        self._element_model()
        if self.jointed:
            self._joint_model()
        if self.bolted:
            self._bolts()
        if self.rng("liners").random() < 0.3:
            self._liners()
        if self.kind == BLOCKS and not self.creeps and self.rng("fluid").random() < 0.35:
            self._fluid()
        if self.kind == BLOCKS and self.rng("heat").random() < 0.3:
            self._heat()
        if self.kind == BLOCKS and not self.static and self.rng("rayleigh").random() < 0.2:
            self.add(f"pcdc model rayleigh 0.05 frequency {1.0 / u.time(1.0 / 512.0)!r}")
        if draw.random() < 0.5:
            self._surfaces()
        vy = u.speed(draw.choice((-2.0, -4.0)))
        states = [[f"pcdc node initial velocity ({u.speed(0.25)!r},{vy!r}){self.where('node')}"]]
        if self.kind == BLOCKS:
            line = u.length(self.low + 0.001)
            value = u.speed(draw.choice((0.0, 0.5)) * (not self.static))
            if self.has("tables"):
                far = u.time(100.0)
                states.append([f"pcdc table create 'pull' values (0,{value!r}) ({far!r},{value!r})"])
                value_text = "table 'pull'"
            else:
                value_text = repr(value)
            states.append([
                f"pcdc node boundary mech-vel-b-c property velocity-x 0 velocity-y {value_text} range y "
                f"{-u.length(1.0)!r} {line!r}"
            ])  # fmt: skip
        if self.kind == BLOCKS:
            load = u.stress(draw.choice((0.0, -2e4)))
            if draw.random() < 0.3:
                above, far = u.length(self.high - 1.0 / 2048.0), u.length(10.0)
                states.append([
                    f"pcdc element-face boundary mech-stress-b-c property stress-y {load!r} range y {above!r} {far!r}"
                ])  # fmt: skip
            if draw.random() < 0.3:
                s = u.stress(-5e4)
                states.append([f"pcdc element initial stress-xx {s!r} stress-yy {s!r}"])
        for lines in states:
            self.add(*lines)
        if self.kind == BLOCKS and not self.static:
            if self.rng("quiet").random() < 0.25:
                self._quiet()
            if self.rng("sides").random() < 0.2:
                self.add(f"pcdc element-face boundary free-field range boundary x {x0!r} {x0!r}")
        if draw.random() < 0.5:
            self.add(
                "pcdc history create 'v' node value velocity-y id 1 every 2",
                "pcdc history create 'y' model value yielded-joints every 5",
            )
        if self.has("records"):
            self.shuffled([
                ["pcdc history create 'a' node value velocity-y id 0 every 3"],
                ["pcdc history create 'b' model value broken-joints every 7"],
                ["pcdc output vtk 'frames' every 13"],
                ["pcdc element group 'some' set 'others' range id 0 3"],
            ])  # fmt: skip
            if self.rng("account").random() < 0.7:
                self.add("pcdc model option energy on")

    def _assign(self, line: str, values: dict[str, float], where: str, way: str, least: int, then: str) -> None:
        """A model with its properties, in one command, or the first in one and others changed by a second."""
        names = list(values)
        if self.has(way):
            rng = self.rng(way)
            late = rng.sample(names, rng.randint(1, len(names)))
            first = {n: values[n] * (0.5 if n in late else 1.0) for n in names if n not in late or n in names[:least]}
            self.add(f"{line} property {_words(first)}{where}")
            self.add(f"{then} {_words({n: values[n] for n in late})}{where}")
        else:
            self.add(f"{line} property {_words(values)}{where}")

    def _element_model(self) -> None:
        if self.creeps:
            u, rock = self.units, {name: value for name, value in self.rock.items() if name != "penalty"}
            rock |= {
                "maxwell-viscosity": u.time(u.stress(1e5)), "kelvin-shear": u.stress(1e8),
                "kelvin-viscosity": u.time(u.stress(5e4)),
            }  # fmt: skip
            self._assign("pcdc element c-model mech-bur", rock, self.where("element"), "properties", 3,
                         "pcdc element property")  # fmt: skip
            self.add("pcdc model creep on")
            return
        model = "mech-iso-e"
        if self.yields:
            u, rng, model = self.units, self.rng("strength"), "mech-m-c"
            friction = rng.choice((0.0, 25.0))
            self.rock = {name: self.rock[name] for name in ("density", "young", "poisson-ratio")} | {
                "cohesion": u.stress(rng.choice((5e3, 2e4))), "tensile": u.stress(1e4), "friction": friction,
                "dilation": min(rng.choice((0.0, 10.0)), friction), "damp-factor": self.rock["damp-factor"],
            }  # fmt: skip
        self._assign(f"pcdc element c-model {model}", self.rock, self.where("element"), "properties",
                     6 if self.yields else 3, "pcdc element property")  # fmt: skip

    def _joint_model(self) -> None:
        self._assign("pcdc face-joint c-model c-i-c-i", self.joint, self.where("joint"), "joints", 4,
                     "pcdc face-joint property")  # fmt: skip

    def _bolts(self) -> None:
        """One or two across the lower body, weak enough to slip and to yield; one of them may be tightened."""
        u, rng = self.units, self.rng("bars")
        values = {
            "density": u.density(7850.0), "young": u.stress(rng.choice((1e9, 1e10))), "diameter": u.length(0.02),
            "tensile-yield-force": u.force(rng.choice((50.0, 400.0))), "spacing": u.length(rng.choice((0.5, 1.0))),
            "shear-stiffness-rock-bolt": u.stress(1e8), "grout-thickness": u.length(0.005),
            "cohesion-rock-grout": u.stress(rng.choice((1e3, 1e4))), "cohesion-grout-bolt": u.stress(1e4),
            "friction-rock-grout": rng.choice((0.0, 20.0)), "pretension-force": u.force(rng.choice((0.0, 10.0))),
        }  # fmt: skip
        height = self.high - self.low
        for k in range(rng.choice((1, 2))):
            x0, y0 = u.length(0.28 + 0.1 * k), u.length(self.low + 0.1 * height)
            x1, y1 = u.length(0.65), u.length(self.low + (0.9 - 0.5 * k) * height)
            ending = " plate" if rng.random() < 0.4 else f" segments {rng.choice((3, 7))}" if rng.random() < 0.5 else ""
            self.add(f"pcdc bolt create polyline ({x0!r},{y0!r}) ({x1!r},{y1!r}){ending}")
        where = " range id 0 1000000" if self.has("ranges") else ""
        if self.has("properties"):  # the same again, and one of them twice
            self.add(f"pcdc bolt c-model mech-e-p property {_words(values | {'young': 2.0 * values['young']})}{where}")
        self.add(f"pcdc bolt c-model mech-e-p property {_words(values)}{where}")

    def _liners(self) -> None:
        """On the top of the lower body, weak enough to yield, to slip and to part."""
        u, rng = self.units, self.rng("beams")
        values = {
            "density": u.density(2400.0), "young": u.stress(rng.choice((1e8, 1e9))), "thickness": u.length(0.02),
            "poisson-ratio": 0.25, "tensile-strength": u.stress(rng.choice((1e4, 1e6))),
            "compressive-strength": u.stress(1e6), "normal-stiffness": u.stress(1e9) / u.length(1.0),
            "shear-stiffness": u.stress(rng.choice((0.0, 1e9))) / u.length(1.0), "bond-friction": 20.0,
            "bond-tensile-strength": u.stress(1e3), "bond-cohesion": u.stress(1e3),
        }  # fmt: skip
        y = u.length(self.high)
        self.add(f"pcdc liner create range boundary y {y!r} {y!r}")
        where = " range id 0 1000000" if self.has("ranges") else ""
        if self.has("properties"):
            self.add(f"pcdc liner c-model beam property {_words(values | {'young': 2.0 * values['young']})}{where}")
        self.add(f"pcdc liner c-model beam property {_words(values)}{where}")

    def _fluid(self) -> None:
        """In all joints or those of the lower body: a well pumps, is shut in and draws; a pressure on the left."""
        u, rng = self.units, self.rng("water")
        values = {
            "fluid-density": u.density(1000.0), "fluid-bulk": u.stress(rng.choice((1e5, 1e6))),
            "viscosity": 1e-6 * u.l**2 / u.t, "aperature-initial": u.length(rng.choice((1e-4, 3e-4))),
            "aperature-minumum": u.length(2e-5), "aperature-maximum": u.length(2e-3),
            "shear-dilation": rng.choice((0.0, 10.0)),
        }  # fmt: skip
        if self.static:
            self.add(f"pcdc model time-step hydraulic {u.time(2.0**-18)!r}")
        where = "" if rng.random() < 0.5 else f" range y 0 {u.length(self.high)!r}"
        self._assign("pcdc face-joint c-model hydr-p-m", values, where or self.where("joint"), "joints", 5,
                     "pcdc face-joint property")  # fmt: skip
        if rng.random() < 0.5:
            self.add(f"pcdc model sub-step mechanical {rng.choice((1, 3))}")
        self.add(f"pcdc flow-node initial pressure {u.stress(2e3)!r}")
        left = u.length(0.3)
        self.add(f"pcdc node boundary hydra-c-f-b pressure {self._steady('held', u.stress(5e3))} range x 0 {left!r}")
        right = f"range x {u.length(0.4)!r} {u.length(0.6)!r} y 0 {u.length(self.high)!r}"
        rate, limit = rng.choice((1e-3, 0.1)) * u.l**2 / u.t, u.stress(2e4)
        self.add(
            f"pcdc well create 'pump' {right}",
            f"pcdc well stage 'pump' rate {self._steady('pumped', rate)} limit {limit!r} time {u.time(3.3e-4)!r}",
            f"pcdc well stage 'pump' shut-in time {u.time(1e-4)!r}",
            f"pcdc well stage 'pump' rate {-rate!r}",
        )

    def _heat(self) -> None:
        """The floor is warm, faces on the left lie in warm air; heat has a clock that runs ahead, or that of a step."""
        u, rng = self.units, self.rng("rocks")
        slow = self.static or rng.random() < 0.7
        power = u.stress(1.0) * u.speed(1.0)  # W/m2
        values = {
            "conductivity": 2.5 * power * u.l, "capacity": 1000.0 * (u.l / u.t) ** 2,
            "expansion-coeficient": rng.choice((0.0, 1e-5)), "transfer-coeficient": 50.0 * power,
        }  # fmt: skip
        if not slow:
            values["conductivity"] *= 2.0**20
        self._assign("pcdc element c-model therm-iso-h", values, self.where("element"), "properties", 2,
                     "pcdc element property")  # fmt: skip
        self.add("pcdc node initial temperature 20")
        if slow:
            self.add(f"pcdc model time-step thermal {u.time(128.0)!r}")
        line, left = u.length(self.low + 0.001), u.length(0.3)
        self.add(
            f"pcdc node boundary therm-s-b-c temperature {self._steady('warm', 60.0)} range y {-u.length(1.0)!r} "
            f"{line!r}",
            f"pcdc element-face boundary therm-c-h transfer-coeficient {25.0 * power!r} environment-temperature "
            f"{self._steady('air', 90.0)} range x 0 {left!r}",
        )

    def _steady(self, name: str, value: float) -> str:
        """A number, or a table of it."""
        if not self.has("tables"):
            return repr(value)
        self.add(f"pcdc table create '{name}' values (0,{value!r}) ({self.units.time(100.0)!r},{value!r})")
        return f"table '{name}'"

    def _quiet(self) -> None:
        """The top of the lower body, through which a wave may come in."""
        u, rng = self.units, self.rng("wave")
        range_ = f"range boundary y {u.length(self.high)!r} {u.length(self.high)!r}"
        wave = f" incoming-x {self._steady('wave', u.speed(rng.choice((0.0, 0.25))))}"
        self.add(f"pcdc element-face boundary mech-stress-b-c property quiet on{wave} {range_}")

    def _surfaces(self) -> None:
        u = self.units
        values = {"friction": 20.0, "penalty-normal": u.stress(1.5e9), "penalty-shear": u.stress(1.5e9)}
        if self.has("surfaces"):
            n = 4 * self.rng("surfaces").randint(1, 3)
            halves = [f" range id 0 {n - 1}", f" range id {n} 1000000"]
            self.rng("surfaces").shuffle(halves)
        else:
            halves = [""]
        for where in halves:
            self.add(f"pcdc element-face c-model contact-mohr-c property {_words(values)}{where}")

    def couple(self) -> None:
        u = self.units
        limit = self.model.choice((None, 0.25, 0.8))
        values = {} if limit is None else {"friction": limit}
        if self.has("agreed"):
            if self.rng("agreed").random() < 0.5:
                values["dt"] = u.time(self.dt)
            else:
                self.add(f"pcdc model time-step value {u.time(self.dt)!r}")
        inside = "".join(f", {name}={value!r}" for name, value in values.items())
        self.add(f"both = hpcdem.couple(sand{inside})")

    # ---- runs ----------------------------------------------------------------------------------------------------

    def runs(self) -> None:
        draw = self.model
        if self.kind != PARTICLES and getattr(self, "static", False):
            self.add("pcdc model option dynamic off")
            self.run(draw.randint(20, 60), static=True)
            self.add("pcdc model option dynamic on")
        events = [self._event() for _ in range(draw.randint(0, 2))]
        if len(events) == 2 and events[0] == events[1]:  # an element is taken out once
            events.pop()
        most = 150 if self.kind == COUPLED else 90
        # Events at odd steps: histories record at even ones, and a function comes before them, a command after.
        parts = [(2 * draw.randint(10, most // 2) + (not k), event) for k, event in enumerate([*events, []])]
        while parts:
            steps, event = parts.pop(0)
            if self.has("within") and event and all("sand" in line for line in event):
                more, then = parts.pop(0)
                number = len(self.lines)
                self.add(
                    f"due{number} = sand.steps + {steps}", f"def act{number}(s):", f"    if s.steps == due{number}:"
                )
                self.add(*(f"        {line}" for line in event))
                self.add(f"call{number} = sand.every(1, act{number})")
                self.run(steps + more)
                self.add(f"call{number}.cancel()", *then)
                continue
            self.run(steps)
            self.add(*event)

    def _event(self) -> list[str]:
        """What commands of the script change between two runs."""
        u, draw = self.units, self.model
        of_particles = [
            ["sand.prop(fric=0.4)"], [f"sand.prop(density={u.density(2200.0)!r})"], ["sand.delete('id 3 5')"],
            ["sand.prop(damp=0.1)"], [f"sand.prop(where='id 0 9', yv={u.speed(0.5)!r})"],
            [f"sand.wall(1, yv={u.speed(-0.25)!r})"],
            [f"sand.ball({u.length(0.9)!r}, {u.length(1.0)!r}, {u.length(0.03125)!r})",
             f"sand.prop(where='id 0 1000000', density={u.density(self.disc_density)!r}, "
             f"kn={u.stress(self.stiffness)!r}, ks={u.stress(0.5 * self.stiffness)!r})"
             if not self.hertz else "sand.delete('id 12 40000')"],
            ["sand['spin'] = 0.0"], ["sand.fix('x', where='id 0 4')"],
        ] if self.kind != BLOCKS else []  # fmt: skip
        of_blocks = [
            ["pcdc element property friction 15"], [f"pcdc model gravity ({u.gravity(0.5)!r},{u.gravity(-5.0)!r})"],
            ["pcdc element c-model null range id 2 2"], ["pcdc node reset displacement"],
            [f"pcdc element property young {u.stress(2e8)!r}"], ["pcdc node reset velocity"],
            [f"pcdc node initial velocity ({u.speed(-0.5)!r},{u.speed(-1.0)!r}) range x 0 {u.length(0.5)!r}"],
        ] if self.kind != PARTICLES else []  # fmt: skip
        return draw.choice([*of_particles, *of_blocks])

    def run(self, steps: int, static: bool = False) -> None:
        rng = self.rng(f"run {len(self.lines)}")
        parts = [steps]
        if self.has("split") or self.has("restore") or self.has("again"):
            cut = rng.randint(1, steps - 1)
            parts = [cut, steps - cut]
        for k, part in enumerate(parts):
            if k and self.has("restore"):
                self._restore(len(self.lines))
            if k and self.has("again"):
                self.add(*self._again(rng))
            self._steps(part, static, rng)

    def _steps(self, steps: int, static: bool, rng: random.Random) -> None:
        if self.kind == PARTICLES:
            self.add(f"sand.cycle({steps})")
        elif self.has("time") and not static and (self.kind == COUPLED or self.fixed_dt):
            self.add(f"pcdc model solve time {self.units.time(steps * self.dt)!r}")
        elif self.has("solve"):
            self.add(f"pcdc model solve cycles {steps}")
        else:
            self.add(f"pcdc model step {steps}")

    def _restore(self, number: int) -> None:
        if self.kind == PARTICLES:
            self.add(f"sand.save('m{number}.sav')", f"sand.restore('m{number}.sav')")
        else:
            self.add(f"pcdc model save 'm{number}.sav'", f"pcdc model restore 'm{number}.sav'")

    def _again(self, rng: random.Random) -> list[str]:
        """What says nothing new. A command makes the blocks look at once for joints that broke, and estimate their time
        step again: nothing is said again where that can be seen."""
        if self.kind != PARTICLES and (self.jointed or not (self.fixed_dt or self.kind == COUPLED)):
            return []
        of_particles = [
            "sand.prop()", "sand.set(seed=7)", "sand.set(disk='on')", "sand.fix('x', where='id 900 999')",
        ] if self.kind != BLOCKS else []  # fmt: skip
        of_blocks = [
            "pcdc model option dynamic on" if not getattr(self, "static", False) else "pcdc element group 'x'",
            f"pcdc model option collision {'on' if self.collision else 'off'}",
            f"pcdc element property density {self.rock['density']!r}",
            f"pcdc element property poisson-ratio {self.rock['poisson-ratio']!r}",
            "pcdc node group 'corner' range id 0 0",
        ] if self.kind != PARTICLES else []  # fmt: skip
        return [rng.choice([*of_particles, *of_blocks])]


def _words(values: dict[str, float]) -> str:
    return " ".join(f"{name} {value!r}" for name, value in values.items())


# ---- carrying out ----------------------------------------------------------------------------------------------------


def carry_out(text: str, folder: Path, comm: Any = None, autosave: float | None = None) -> tuple[Session, str]:
    """Run a script in this process, with automatic checkpoints so many seconds apart; its session, still open, and what
    went wrong ("" if nothing did). Collective."""
    comm = comm or SerialComm()
    folder.mkdir(parents=True, exist_ok=True)
    said = io.StringIO()
    one = Session(comm, Log(comm.rank, said), StopRequests(None, None, autosave), directory=folder, figure=False)
    one.ready |= {"", "blocks", "coupled"}
    session.enter(one)
    project = one.project()
    interpreter = one.interpreter = Interpreter(project)
    try:
        interpreter.run(interpreter.read(text, "model.sc"))
    except HpcdemError as error:
        return one, re.sub(r"model\.sc:\d+: ", "", f"{type(error).__name__}: {error}")
    return one, ""


def end(one: Session, units: Units) -> dict[str, np.ndarray]:
    """The state of all there is, in the plain units, and what histories tell of the way there, if the units are these.
    Collective."""
    u, found = units, {}

    def whole(values: np.ndarray) -> np.ndarray:
        return np.concatenate(one.comm.allgather(np.array(values)))

    for sim in one.unfinished:
        p = sim.particles
        order = np.argsort(whole(p["gid"]))
        scales = {"x": u.l, "y": u.l, "vx": u.l / u.t, "vy": u.l / u.t, "spin": 1.0 / u.t, "angle": 1.0, "radius": u.l,
                  "fx": u.m * u.l / u.t**2, "fy": u.m * u.l / u.t**2}  # fmt: skip
        if sim.closed:
            force = whole(sim.lists.owned_forces())
            found["disc fx"], found["disc fy"] = (force[order, k] / scales["fx"] for k in (0, 1))
        for name, scale in scales.items():
            if name not in ("fx", "fy"):
                found[f"disc {name}"] = whole(p[name])[order] / scale
        found["gid"] = whole(p["gid"])[order].astype(float)
        for path in sorted(sim.outdir.glob("hist_[89].csv")) if u == Units() else []:
            found[path.name] = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
        found["steps"] = np.array([sim.clock.step, sim.clock.time / u.t])
        found["bonds"] = np.array([sim.bonds_left()], float)
    for project in one.projects:
        if project.mesh is None:
            continue
        blocks = project.blocks
        scales = {"position_x": u.l, "position_y": u.l, "velocity_x": u.l / u.t, "velocity_y": u.l / u.t,
                  "stress_xx": u.m / u.t**2, "stress_xy": u.m / u.t**2, "stress_yy": u.m / u.t**2}  # fmt: skip
        for name, scale in scales.items():
            found[name] = diagnostics.values(blocks, name) / scale
        if diagnostics.joint_counts(blocks) != (0, 0, 0):
            found["opening"] = diagnostics.values(blocks, "opening") / u.l
            found["damage"] = diagnostics.values(blocks, "damage")
        if blocks.creep.on:
            found["creep"] = diagnostics.values(blocks, "creep_strain_xy")
            found["creep time"] = np.array([blocks.creep.time / u.t])
        if blocks.yielding().any():
            found["plastic"] = diagnostics.values(blocks, "plastic_shear_strain")
        if blocks.quiet_faces().any():
            found["quiet"] = blocks.quiet_faces().astype(float)
        side = FreeField.there(blocks)
        if side is not None:
            found["side"], found["side v"] = side.nodes["u"] / u.l, side.nodes["v"] * u.t / u.l
        bolts = Bolts.there(blocks)
        if bolts is not None:
            found["axial force"] = bolts.values("bolt-element", "axial_force") / u.force(1.0)
            found["slip"] = bolts.values("bolt-node", "slip") / u.l
        liners = Liners.there(blocks)
        if liners is not None:
            found["thrust"] = liners.values("liner-element", "axial_force") / u.toughness(1.0)
            found["rotation"] = liners.values("liner-node", "rotation")
        flow = Flow.there(blocks)
        if flow is not None:
            found["pressure"] = flow.values("flow-node", "pressure") / u.stress(1.0)
            found["fluid"] = flow.values("flow-node", "fluid") / u.l**2
            found["aperture"] = flow.values("flow-channel", "aperture") / u.l
            found["injected"] = np.array([flow.well_value("pump", "injected") / u.l**2])
            found["flow time"] = np.array([flow.time / u.t])
        heat = Heat.there(blocks)
        if heat is not None:
            found["temperature"] = diagnostics.values(blocks, "temperature")
            found["heat time"] = np.array([heat.time / u.t])
        found["block steps"] = np.array([blocks.clock.step, blocks.clock.time / u.t])
        found["joints"] = np.array(diagnostics.joint_counts(blocks), float)
        for name in ("v", "y") if u == Units() else ():
            if name in project.histories:
                found[f"history {name}"] = np.array(project.histories[name].rows)
        if project.coupled is not None:
            contacts = project.coupled.contacts()
            for name, scale in (("id", 1.0), ("face", 1.0), ("overlap", u.l), ("fn", u.m * u.l / u.t**2),
                                ("fs", u.m * u.l / u.t**2)):  # fmt: skip
                found[f"contact {name}"] = contacts[name] / scale
    return found


def leave(one: Session) -> None:
    """End it as a failure does: nothing is drawn."""
    with suppress(HpcdemError):
        one.close(HpcdemError("the end of a test"))
    session.enter(None)


def run(
    kind: str, seed: int, ways: Sequence[str], folder: Path, comm: Any = None, wide: int = 1
) -> tuple[str, dict[str, np.ndarray], str]:
    """Script, end and error of a model said in these ways. Collective."""
    writer = Writer(kind, seed, frozenset(ways), wide)
    text = writer.text()
    one, error = carry_out(text, folder, comm)
    try:
        return text, {} if error else end(one, writer.units), error
    finally:
        leave(one)


def difference(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> str:
    """In what two ends differ; "" if in nothing."""
    odd = []
    for name in sorted(one.keys() | other.keys()):
        a, b = one.get(name), other.get(name)
        if name.startswith("hist") and (a is None or b is None):
            continue  # of other units
        if a is None or b is None or a.shape != b.shape:
            odd.append(f"{name}: {None if a is None else a.shape} and {None if b is None else b.shape}")
        elif not np.array_equal(a, b, equal_nan=True):
            scale = max(float(np.nanmax(np.abs(a), initial=0.0)), 1e-300)
            odd.append(f"{name}: by {float(np.nanmax(np.abs(a - b))) / scale:.2g} of the largest")
    return "; ".join(odd)


def chosen_ways(kind: str, seed: int) -> list[str]:
    """Two to four ways that a model of this seed is said in besides the plain one."""
    rng = random.Random(f"{seed} choice")
    return rng.sample(sorted(OF[kind]), rng.randint(2, 4))


def digests(kind: str, first: int, last: int, folder: Path, comm: Any = None) -> dict[int, list[str]]:
    """Of the ends of these seeds, said in the ways that belong to them and four times as wide: error, and a checksum by
    name. Collective."""
    found = {}
    for seed in range(first, last):
        _, state, error = run(kind, seed, chosen_ways(kind, seed), folder / str(seed), comm, wide=4)
        sums = [f"{name} {zlib.crc32(values.tobytes())}" for name, values in sorted(state.items())]
        found[seed] = [error, *sums]
    return found


def main() -> None:
    """`mpiexec -n N python two_ways.py KIND FIRST LAST FOLDER`: digests as JSON, on any number of ranks."""
    from hpcdem.runtime import launch, shutdown

    kind, first, last, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
    launch.prepare_environment(1)
    comm = launch.start_mpi()
    found = digests(kind, first, last, folder, comm)
    if comm.rank == 0:
        (folder / "digests.json").write_text(json.dumps(found))
    shutdown.leave(shutdown.ExitStatus(rank=comm.rank))


if __name__ == "__main__":
    main()
