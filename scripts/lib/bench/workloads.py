"""What is computed: one granular bed, its laws, and how it is laid out. Numbers and names only; SI units."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
from dataclasses import dataclass
from pathlib import Path

RECIPE = 3
"""Raise it when bed.py makes other beds from the same numbers."""


@dataclass(frozen=True)
class Material:
    """Spheres in a plane and the walls around them.

    radius: mean [m], radii uniform within radius (1 +- spread); density [kg/m^3]; shear [Pa] and poiss: Hertz-Mindlin;
    kn, ks [N/m]: springs of a particle in the linear workload; damp: local damping; speed [m/s]: the pushing wall.
    """

    radius: float = 50.0
    spread: float = 0.2
    density: float = 2500.0
    shear: float = 2.9e9
    poiss: float = 0.2
    fric: float = 0.3
    damp: float = 0.4
    gravity: float = 9.8
    dt: float = 0.02
    kn: float = 8e10
    ks: float = 5e10
    speed: float = 5.0

    @property
    def kn_hertz(self) -> float:
        """Kn [Pa] of Fn = Kn sqrt(Reff U) U: 4 G / (3 (1 - nu)), the form of LAMMPS."""
        return 4.0 * self.shear / (3.0 * (1.0 - self.poiss))

    @property
    def kt_hertz(self) -> float:
        """Kt [Pa] of ks = Kt sqrt(Reff U): 4 G / (2 - nu)."""
        return 4.0 * self.shear / (2.0 - self.poiss)

    @property
    def young(self) -> float:
        """E = 2 G (1 + nu) [Pa]."""
        return 2.0 * self.shear * (1.0 + self.poiss)

    @property
    def damping_ratio(self) -> float:
        """Of an oscillator with local damping alpha: alpha / pi, for codes that have contact damping only."""
        return self.damp / math.pi

    @property
    def restitution(self) -> float:
        """Of an impact with this damping ratio D: exp(-pi D / sqrt(1 - D^2))."""
        d = self.damping_ratio
        return math.exp(-math.pi * d / math.sqrt(1.0 - d * d))

    @property
    def gamma(self) -> float:
        """gamma_n [1/(s m)] of LAMMPS' Hertz damping sqrt(Reff U) meff gamma_n vn with this damping ratio, for two mean
        particles at an overlap of 3 % of the diameter."""
        reff, meff = 0.5 * self.radius, 2.0 / 3.0 * math.pi * self.radius**3 * self.density
        root = math.sqrt(reff * 0.06 * self.radius)
        return 2.0 * self.damping_ratio * math.sqrt(1.5 * self.kn_hertz / (root * meff))

    @property
    def gamma_linear(self) -> float:
        """gamma_n [1/s] of LAMMPS' linear damping meff gamma_n vn with this damping ratio, for two mean particles."""
        meff = 2.0 / 3.0 * math.pi * self.radius**3 * self.density
        return 2.0 * self.damping_ratio * math.sqrt(0.5 * self.kn / meff)


MATERIAL = Material()


@dataclass(frozen=True)
class Bed:
    """A settled bed: `copies` of a unit of so many particles side by side; law: hertz, linear or bonded."""

    unit: int = 12500
    copies: int = 1
    law: str = "hertz"

    @property
    def particles(self) -> int:
        """Of all copies."""
        return self.unit * self.copies

    @property
    def rows(self) -> int:
        """Particles on top of each other: one to five, at most 50."""
        return max(4, min(50, round(math.sqrt(self.unit / 5.0))))

    @property
    def unit_length(self) -> float:
        """Between the walls of the unit [m]."""
        return 2.0 * MATERIAL.radius * self.unit / self.rows

    @property
    def length(self) -> float:
        """Between the side walls [m]."""
        return self.unit_length * self.copies

    @property
    def height(self) -> float:
        """Of the side walls [m]."""
        return 4.0 * MATERIAL.radius * self.rows

    @property
    def parent(self) -> Bed | None:
        """The bed it is made from."""
        if self.law != "hertz":
            return dataclasses.replace(self, law="hertz")
        return Bed(self.unit) if self.copies > 1 else None

    @property
    def name(self) -> str:
        """Unique for its parameters, those of the material and the recipe: the name of its files in the cache."""
        key = json.dumps([RECIPE, dataclasses.asdict(MATERIAL), dataclasses.asdict(self)], sort_keys=True)
        return f"{self.law}-{self.particles}-{hashlib.sha256(key.encode()).hexdigest()[:12]}"


@dataclass(frozen=True)
class Workload:
    """A bed, whether its left wall pushes, whether there are particles much faster than all others, and whether a law
    of the user takes the place of the built-in one."""

    name: str
    bed: Bed
    pushed: bool = False
    about: str = ""
    strays: bool = False
    own: bool = False


def workloads(unit: int = 12500) -> dict[str, Workload]:
    """All workloads by name; another `unit` makes all of them smaller or larger."""
    rows = (
        Workload("bed-12k", Bed(unit), about="dense Hertz bed at rest"),
        Workload("push-12k", Bed(unit), True, "the same, pushed by its left wall"),
        Workload("stray-12k", Bed(unit), about="at rest; a disc falls below it, some roll on it", strays=True),
        Workload("bed-100k", Bed(unit, 8), about="eight units side by side, at rest"),
        Workload("push-100k", Bed(unit, 8), True, "the same, pushed by its left wall"),
        Workload("linear-100k", Bed(unit, 8, "linear"), about="linear springs, at rest"),
        Workload("own-100k", Bed(unit, 8, "linear"), about="the same with the law in a file of the user", own=True),
        Workload("bonded-100k", Bed(unit, 8, "bonded"), about="Hertz, elastic bonds between all that touch, at rest"),
        Workload("bed-1m", Bed(unit, 80), about="eighty units, at rest"),
    )
    return {w.name: w for w in rows}


PEER_WORKLOADS = ("bed-12k", "push-12k", "bed-100k", "push-100k", "linear-100k")
"""Those that other codes compute as well, each those of the laws it has here."""


def cache_folder() -> Path:
    """Where beds are kept."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "hpcdem-bench"


FARTHEST = 0.05
"""Longest way of the pushing wall over the length of the bed: a longer push would end with another bed."""


def steps_for(bed: Bed, pushed: bool, seconds: float, rate: float) -> int:
    """Steps that take about `seconds` at `rate` particle-steps/s, at least 20, two significant digits."""
    steps = max(20.0, seconds * rate / bed.particles)
    if pushed:
        steps = min(steps, FARTHEST * bed.length / (MATERIAL.speed * MATERIAL.dt))
    unit = 10.0 ** (math.floor(math.log10(steps)) - 1)
    return int(steps / unit) * int(unit) if unit >= 1.0 else int(steps)


WARM = 300
"""Steps before the clock is started."""
LARGE = 500_000
"""Beds from here on are warmed up by a third of that."""


def warm_for(bed: Bed, steps: int) -> int:
    """Steps of warm-up before so many measured steps, not more than those."""
    return max(5, min(WARM if bed.particles < LARGE else WARM // 3, steps))
