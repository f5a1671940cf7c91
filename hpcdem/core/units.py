"""Units that a model declares: their names in output, and plausible ranges of values in them.

Equations hold in any consistent system of units; nothing here changes a value. A system is defined by the sizes of its
units of length, mass and time. Plausible ranges are declared in SI, one row of KINDS per kind of quantity.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from hpcdem.core.errors import CommandError


@dataclass(frozen=True)
class System:
    """length [m], mass [kg] and time [s]: sizes of its units; names: symbols that replace those of SI."""

    name: str
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    names: Mapping[str, str] = field(default_factory=dict)

    def label(self, unit: str) -> str:
        """A unit of SI ("N/m", "W/(m K)") by its name here."""
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
"""Names of units as printed."""


@dataclass(frozen=True)
class Kind:
    """A kind of quantity. unit: in SI; powers: of length, mass, time; low, high: magnitudes in SI outside which a value
    is questioned (0 never is); usual: typical value in SI, which decides between several units that could be meant;
    meant: units in which values are often left by mistake, with their sizes in SI; names: properties of this kind, ()
    for all of this unit that no other row names."""

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
    """Return the system of this name, in upper or lower case. CommandError lists the known ones."""
    if not isinstance(name, str) or name.lower() not in SYSTEMS:
        raise CommandError(f"units: expected one of {', '.join(CHOICES.values())}, got {name}")
    return SYSTEMS[name.lower()]


def label(name: str, unit: str) -> str:
    """Return the name of a unit of SI in a model that declared these units ("" for none)."""
    return SYSTEMS[name].label(unit) if name else unit


def declared(name: str) -> str:
    """The units that a model declared, "" for those of SI, which frames have unless they say otherwise."""
    return "" if name == SI.name else name


def kind_of(name: str, unit: str) -> Kind | None:
    """Return the kind of a property, None if no kind is declared for it."""
    unit, name = _ALSO.get(unit, unit), name.replace("-", "_")
    rows = [kind for kind in KINDS if kind.unit == unit and (name in kind.names or not kind.names)]
    return min(rows, key=lambda kind: not kind.names, default=None)


def doubt(where: System, name: str, unit: str, value: float) -> str:
    """Return a warning about a value of a property given in these units, "" if it is plausible.

    Of the units that would make it plausible, SI is suggested first, then the unit that brings it nearest to the usual
    value.
    """
    kind = kind_of(name, unit)
    if kind is None or value == 0.0 or not math.isfinite(value):
        return ""
    own = where.size(kind.powers)
    if kind.low <= abs(value) * own <= kind.high:
        return ""
    text = f"{name} {value:g} {where.label(kind.unit)} is an unlikely {kind.name}"
    fits = [(size != 1.0, abs(math.log(abs(value) * size / kind.usual)), called, size) for called, size in kind.meant
            if kind.low <= abs(value) * size <= kind.high]  # fmt: skip
    if not fits:
        low, high = kind.low / own, kind.high / own
        return f"{text}: expected {low:.3g} to {high:.3g}; used unchanged"
    *_, called, size = min(fits)
    factor = size / own
    return f"{text}: looks like {called}; x {factor:g} makes it {value * factor:g}; used unchanged"


# -- prefixes: a value in the unit that people would use for its size ----------------------------------------------

_WHOLE = tuple(("kMGTPE"[n], 1e3 ** (n + 1)) for n in range(6))
_PARTS = (("n", 1e-9), ("µ", 1e-6), ("m", 1e-3))


def _prefixed(unit: str, parts: int = 0, whole: int = 6) -> tuple[tuple[float, str], ...]:
    """Sizes and names of a unit with its last `parts` small and its first `whole` large prefixes, smallest first."""
    small = _PARTS[len(_PARTS) - parts :]
    return tuple((size, prefix + unit) for prefix, size in (*small, ("", 1.0), *_WHOLE[:whole]))


_LADDERS: dict[str, tuple[tuple[float, str], ...]] = {
    "Pa": _prefixed("Pa", 0, 3),
    "N": _prefixed("N", 1),
    "J": _prefixed("J", 2),
    "W": _prefixed("W", 1),
    "Hz": _prefixed("Hz", 1, 3),
    "m": ((1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m"), (1e3, "km")),
    "m2": ((1e-6, "mm2"), (1.0, "m2"), (1e6, "km2")),
    "m3": ((1e-9, "mm3"), (1.0, "m3"), (1e9, "km3")),
    "s": ((1e-9, "ns"), (1e-6, "µs"), (1e-3, "ms"), (1.0, "s"), (3600.0, "h"), (86400.0, "days"),
          (365.25 * 86400.0, "years")),
    "kg": ((1e-6, "mg"), (1e-3, "g"), (1.0, "kg"), (1e3, "t"), (1e6, "kt"), (1e9, "Mt")),
    "m3/s": ((1e-6, "mL/s"), (1e-3, "L/s"), (1.0, "m3/s")),
    "m2/s": ((1e-6, "mm2/s"), (1.0, "m2/s")),
    "%": ((0.01, "%"),),
}  # fmt: skip
"""Units written with prefixes. In a compound ("N/m", "Pa s") the first factor has the prefix."""
_PLAIN = ("kg/m3", "kg/m2", "m/s2", "s/m")
"""Compound units written without prefixes."""


def ladder(unit: str) -> Sequence[tuple[float, str]]:
    """Sizes in SI, and names, of the multiples in which a unit of SI is written, smallest first; the unit alone if
    without any."""
    if unit in _LADDERS:
        return _LADDERS[unit]
    head = re.match(r"[A-Za-z]+(?=[ /])", unit)
    if head is None or head[0] not in _LADDERS or unit in _PLAIN:
        return ((1.0, unit),)
    return tuple((size, name + unit[head.end() :]) for size, name in _LADDERS[head[0]])


def scale(largest: float, unit: str, digits: int = 4) -> tuple[float, str]:
    """Choose the customary unit of a value of this magnitude.

    Parameters
    ----------
    largest : float
        The value, or the largest of those that are written in one unit, in `unit`.
    unit : str
        Of SI: "Pa", "m", "N/m", "m3/s" ...
    digits : int
        To which the value will be rounded: 999.99 Pa is 1 kPa.

    Returns
    -------
    size : float
        By which values are divided.
    name : str
        Of the unit: 2.5e6 of "Pa" gives 1e6 and "MPa".
    """
    steps = ladder(unit)
    magnitude = abs(float(f"{largest:.{digits}g}"))
    if magnitude == 0.0 or not math.isfinite(magnitude):
        return 1.0, unit
    fits = [step for step in steps if magnitude >= step[0]]
    return fits[-1] if fits else steps[0]


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
COLDEST = 173.0
"""Lowest plausible temperature of rock [K]; lower values indicate a script in °C."""


def on_bar(low: float, high: float, unit: str) -> tuple[float, str]:
    """Size and printed name of the unit for a colour bar or an axis from `low` to `high` [SI], such that the numbers at
    its ticks are neither long nor small. A quantity whose unit has no prefixes gets a power of ten."""
    largest = max(abs(low), abs(high))
    size, name = scale(largest, unit)
    part = largest / size
    if 1e-290 < part < 1e290 and not 1e-3 <= part < 1e5:
        power = 3 * math.floor(math.log10(part) / 3.0)
        size, name = size * 10.0**power, f"10{str(power).translate(_RAISED)} {name}".rstrip()
    return size, "°C" if name == "K" and low < COLDEST else printed(name)


def stamped(title: str, step: int, time: float) -> str:
    """A title with {step}, and {time} [s]; "{time} s" has the prefix that suits it, as 250 µs or 3.2 years."""
    title = title.replace("{step}", str(step)).replace("{time} s", with_prefix(time, "s", 6))
    return title.replace("{time}", f"{time:.6g}")


def printed(unit: str) -> str:
    """A unit as printed: m², kg/m³."""
    return re.sub(r"(?<=[A-Za-z])\d+", lambda found: found[0].translate(_RAISED), unit)


def power_of_ten(value: float) -> str:
    """A number at a tick of logarithms: 0.01, 200, 10⁻⁶, 2·10⁸."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:g}"
    head, _, power = f"{value:e}".partition("e")
    factor = f"{float(head):g}"
    return ("" if factor == "1" else f"{factor}·") + f"10{str(int(power)).translate(_RAISED)}"


def in_one_unit(values: Iterable[float], unit: str, system: str = "") -> tuple[float, str]:
    """`scale` of the largest of some values; system: units that the model declared, whose values stay as they are."""
    if system not in ("", SI.name):
        return 1.0, label(system, unit)
    return scale(max((abs(value) for value in values), default=0.0), unit)


def with_prefix(value: float, unit: str, digits: int = 4, system: str = "") -> str:
    """A value as people write it: ``2.5 MPa``, ``12 mm``, ``3.17 years``.

    Parameters
    ----------
    value : float
        In `unit`, or in the unit of the same name of `system`.
    unit : str
        Of SI, "" for a bare number.
    digits : int
        Significant digits.
    system : str
        Units that the model declared (`SYSTEMS`), "" none. In units other than SI values are written as they are.
    """
    size, name = scale(value, unit, digits) if system in ("", SI.name) else in_one_unit((), unit, system)
    return f"{value / size + 0.0:.{digits}g} {name}".rstrip()


def counted(count: int, word: str) -> str:
    """``1 step``, ``20 steps``."""
    return f"{count} {word}{'s' * (count != 1)}"
