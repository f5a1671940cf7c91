"""Units that a user says to work in: their names on what is written, and which values are plausible in them.

Equations hold in any consistent system; nothing here changes a value. A system is known by the sizes of its units of
length, mass and time; ranges of plausible values are declared in SI, one row of KINDS per kind.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from hpcdem.core.errors import CommandError


@dataclass(frozen=True)
class System:
    """length [m], mass [kg] and time [s]: sizes of its units; names: what stands for the symbols of SI."""

    name: str
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    names: Mapping[str, str] = field(default_factory=dict)

    def label(self, unit: str) -> str:
        """A unit of SI ("N/m", "W/(m K)") as it is called here."""
        return re.sub(r"[A-Za-z]+", lambda found: self.names.get(found[0], found[0]), unit)

    def size(self, powers: tuple[int, int, int]) -> float:
        """The unit with these powers of length, mass and time, in SI."""
        length, mass, time = powers
        return self.length**length * self.mass**mass * self.time**time


SI = System("si")
SYSTEMS = {
    system.name: system
    for system in (
        SI,
        System("mm-mpa-s", 1e-3, 1e3, 1.0, {"m": "mm", "kg": "t", "Pa": "MPa", "J": "mJ", "W": "mW"}),
        System("km-mpa-s", 1e3, 1e9, 1.0, {"m": "km", "kg": "Mt", "Pa": "MPa", "N": "TN", "J": "PJ", "W": "PW"}),
    )
}
"""By the names that scripts use. The mass is the one that makes the stress MPa: 1 t / (mm s2), 1 Mt / (km s2)."""
CHOICES = {"si": "SI", "mm-mpa-s": "mm-MPa-s", "km-mpa-s": "km-MPa-s"}
"""The same names as people write them."""


@dataclass(frozen=True)
class Kind:
    """A kind of quantity. unit: in SI; powers: of length, mass, time; low, high: magnitudes in SI beyond which a value
    is asked about (0 never is); usual: in SI, which of several units that could be meant is the likeliest; meant:
    units that values are often left in, with their sizes in SI; names: of properties that it is for, () for all of
    this unit that no other row names."""

    name: str
    unit: str
    powers: tuple[int, int, int]
    low: float
    high: float
    usual: float = 1.0
    meant: tuple[tuple[str, float], ...] = ()
    names: tuple[str, ...] = ()


_STRESS, _LENGTH = (-1, 1, -2), (1, 0, 0)
_PASCALS = (("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("GPa", 1e9))
_METRES = (("m", 1.0), ("mm", 1e-3), ("km", 1e3))
_MODULI = ("young", "shear", "bulk", "maxwell_shear", "kelvin_shear", "ebmod", "gbmod")
KINDS = (
    Kind("density", "kg/m3", (-3, 1, 0), 50.0, 25e3, 2.5e3,
         (("kg/m3", 1.0), ("g/cm3", 1e3), ("t/mm3", 1e12))),
    Kind("modulus", "Pa", _STRESS, 1e6, 1e13, 1e10, _PASCALS, _MODULI),
    Kind("stress or strength", "Pa", _STRESS, 50.0, 1e11, 1e7, _PASCALS),
    Kind("radius", "m", _LENGTH, 1e-7, 1e4, 10.0, _METRES, ("rad",)),
    Kind("length", "m", _LENGTH, 1e-10, 2e6, 1e2, _METRES),
    Kind("acceleration", "m/s2", (1, 0, -2), 0.1, 5e3, 9.81, (("m/s2", 1.0), ("mm/s2", 1e-3), ("km/s2", 1e3))),
    Kind("velocity", "m/s", (1, 0, -1), 1e-14, 2e4, 1.0, (("m/s", 1.0), ("mm/s", 1e-3), ("km/s", 1e3))),
    Kind("stiffness or energy of an area", "N/m", (0, 1, -2), 1e-3, 1e16, 1e6, (("N/m", 1.0), ("N/mm", 1e3))),
    Kind("viscosity", "Pa s", (-1, 1, -1), 1e-6, 1e26, 1.0, (("Pa s", 1.0), ("MPa s", 1e6))),
    Kind("conductivity of heat", "W/(m K)", (1, 1, -3), 1e-3, 5e3, 3.0, (("W/(m K)", 1.0), ("mW/(m K)", 1e-3))),
    Kind("heat capacity", "J/(kg K)", (2, 0, -2), 50.0, 2e4, 1e3, (("J/(kg K)", 1.0), ("kJ/(kg K)", 1e3))),
    Kind("thermal expansion", "1/K", (0, 0, 0), 1e-9, 1e-2, 1e-5, (("1/K", 1.0), ("1e-6/K", 1e-6))),
)  # fmt: skip
"""Ranges of magnitudes: from snow to gold for density; from gels to diamond for moduli; 50 Pa is the
cohesion of sand; accelerations from a hundredth of the earth's to 500 times it (centrifuges); radii from clay to 10 km;
lengths up to a plate of the crust."""
_ALSO = {"kg/m3 or kg/m2": "kg/m3"}


def system(name: str) -> System:
    """The system of this name, upper or lower case. CommandError lists those there are."""
    if not isinstance(name, str) or name.lower() not in SYSTEMS:
        raise CommandError(f"units: expected one of {', '.join(CHOICES.values())}, got {name}")
    return SYSTEMS[name.lower()]


def label(name: str, unit: str) -> str:
    """What a unit of SI is called by a model that declared these units, "" none."""
    return SYSTEMS[name].label(unit) if name else unit


def kind_of(name: str, unit: str) -> Kind | None:
    """The kind of a property, None if nothing is declared of it."""
    unit, name = _ALSO.get(unit, unit), name.replace("-", "_")
    rows = [kind for kind in KINDS if kind.unit == unit and (name in kind.names or not kind.names)]
    return min(rows, key=lambda kind: not kind.names, default=None)


def doubt(where: System, name: str, unit: str, value: float) -> str:
    """What is to be said of a value of a property given in these units, "" if it is plausible.

    Of the units that would make it plausible that of SI counts first, then the one that brings it nearest to what is
    usual.
    """
    kind = kind_of(name, unit)
    if kind is None or value == 0.0 or not math.isfinite(value):
        return ""
    own = where.size(kind.powers)
    if kind.low <= abs(value) * own <= kind.high:
        return ""
    said = f"{name} {value:g} {where.label(kind.unit)} is an unlikely {kind.name}"
    fits = [(size != 1.0, abs(math.log(abs(value) * size / kind.usual)), called, size) for called, size in kind.meant
            if kind.low <= abs(value) * size <= kind.high]  # fmt: skip
    if not fits:
        low, high = kind.low / own, kind.high / own
        return f"{said}: {low:.3g} to {high:.3g} was expected; it is used as it is"
    *_, called, size = min(fits)
    factor = size / own
    return f"{said}: looks like {called}; x {factor:g} makes it {value * factor:g}; it is used as it is"
