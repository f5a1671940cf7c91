"""Models of elements, faces and joints: which properties they have, in which units, and what values they can take.
Languages and their reference pages take units, limits, words and defaults from here.

Names are Python's (``poisson_ratio``); languages put their own spelling on top. A model is given a dictionary of
values and hands back a complete one, or a CommandError that names the property.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.limits import LARGEST

ELEMENT, FACE, JOINT = "element", "element-face", "face-joint"


@dataclass(frozen=True)
class Property:
    """A number of a model. default: None if it must be given (or follows from others, as `Model.derive` states)."""

    name: str
    unit: str
    doc: str
    default: float | None = None
    low: float = 0.0
    high: float = math.inf
    low_itself: bool = True
    """Whether the lowest value itself is allowed."""
    optional: bool = False
    """Whether it may be omitted without a default value: it then follows from several others."""
    softens: bool = False
    """Whether it may follow a table over plastic strain."""
    temperature_dependent: bool = False
    """Whether it may follow a table over temperature."""
    internal: bool = False
    """Whether it is set by the program, and cannot be given by name."""
    otherwise: str = ""
    """What counts where it is left out, if that is no number; commands see to what does not follow from others."""
    dims: tuple[int, ...] = (2, 3)
    """Dimensions of space in which it exists."""
    follows: str = ""
    """Property from which it takes its value where it is omitted; it changes with that one as long as both are
    equal."""

    def check(self, value: float) -> float:
        """The value as a float; CommandError if it cannot be."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise CommandError(f"{self.name} must be a number, got {value!r}") from None
        inside = self.low <= number if self.low_itself else self.low < number
        if math.isnan(number) or not (inside and number <= self.high):
            sign = ">=" if self.low_itself else ">"
            upper = f" and <= {self.high:g}" if math.isfinite(self.high) else ""
            raise CommandError(f"{self.name} must be {sign} {self.low:g}{upper} ({self.unit}), got {number:g}")
        if abs(number) > LARGEST and not (math.isinf(number) and self.default == math.inf):
            most = "finite" if math.isinf(number) else f"at most {LARGEST:g} ({self.unit})"
            raise CommandError(f"{self.name} must be {most}, got {number:g}")
        return number


@dataclass(frozen=True)
class Model:
    """A model for elements, faces or joints. derive: computes further properties from the given values, which are
    numbers or arrays; raises CommandError if that is impossible."""

    name: str
    on: str
    doc: str
    properties: tuple[Property, ...]
    derive: Callable[[dict[str, Any]], None] = lambda values: None
    called: Mapping[str, str] = field(default_factory=dict)
    """Its own names of properties that other models call otherwise."""
    dims: tuple[int, ...] = (2, 3)

    def has(self, name: str) -> bool:
        """Return whether it has a property of this name."""
        return any(one.name == name for one in self.properties)

    def property(self, name: str) -> Property:
        """The property of this name; CommandError listing those there are."""
        for one in self.properties:
            if one.name == name:
                return one
        known = ", ".join(p.name for p in self.properties if not p.internal)
        raise CommandError(f"model {self.name} has no property {name}; it has {known}")

    def _follow(self, values: dict[str, Any]) -> None:
        for one in self.properties:
            if one.follows:
                values.setdefault(one.name, values[one.follows])

    def changed(self, before: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
        """Values of which some are new, the others as before, or equal to a new one that they follow."""
        values = {**before, **new}
        for one in self.properties:
            if one.follows in new and one.name in before and one.name not in new:
                value = before[one.name]
                values[one.name] = np.where(value == before[one.follows], new[one.follows], value)
        return values

    def complete(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return all values of the model, checked, in the order of `properties`.

        CommandError for an unknown name, a value out of range, or a compulsory property that is missing.
        """
        values = {name: self.property(name).check(value) for name, value in given.items()}
        for one in self.properties:
            if one.name not in values and one.default is not None:
                values[one.name] = one.default
            elif one.name not in values and not one.optional:
                raise CommandError(f"model {self.name} needs {one.name} ({one.unit}: {one.doc})")
        self._follow(values)
        self.derive(values)
        return {one.name: float(values[one.name]) for one in self.properties}

    def complete_each(self, given: Mapping[str, float | np.ndarray], n: int) -> np.ndarray | None:
        """Complete n objects at once, values being numbers or arrays (n,): (n, properties), or None if `complete`
        rejects one of them."""
        values: dict[str, Any] = {}
        for name, value in given.items():
            one, each = self.property(name), np.broadcast_to(np.asarray(value, np.float64), (n,))
            inside = (one.low <= each if one.low_itself else one.low < each) & (each <= one.high)
            if not (inside & ((np.abs(each) <= LARGEST) | (np.isinf(each) & (one.default == math.inf)))).all():
                return None
            values[name] = each
        for one in self.properties:
            if one.name not in values and one.default is not None:
                values[one.name] = np.full(n, one.default)
            elif one.name not in values and not one.optional:
                return None
        self._follow(values)
        try:
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                self.derive(values)
        except CommandError:
            return None
        return np.column_stack([values[one.name] for one in self.properties])


MODULI = ("young", "poisson_ratio", "shear", "bulk")


def _elastic(values: dict[str, Any]) -> None:
    """Complete the four moduli from two of them."""
    given = [name for name in MODULI if name in values]
    if len(given) != 2:
        got = f"got {', '.join(given)}" if given else "got none"
        raise CommandError(
            f"an elastic model needs two of young, poisson_ratio, shear, bulk (Pa; usually young and poisson_ratio), "
            f"{got}"
        )
    young, poisson, shear, bulk = (values.get(name, math.nan) for name in MODULI)
    if given == ["young", "poisson_ratio"]:
        shear, bulk = young / (2.0 * (1.0 + poisson)), young / (3.0 * (1.0 - 2.0 * poisson))
    elif given == ["young", "shear"]:
        poisson = young / (2.0 * shear) - 1.0
        with np.errstate(divide="ignore"):
            bulk = young * shear / np.asarray(3.0 * (3.0 * shear - young))
    elif given == ["young", "bulk"]:
        poisson, shear = 0.5 - young / (6.0 * bulk), 3.0 * bulk * young / (9.0 * bulk - young)
    elif given == ["poisson_ratio", "shear"]:
        young = 2.0 * shear * (1.0 + poisson)
        bulk = young / (3.0 * (1.0 - 2.0 * poisson))
    elif given == ["poisson_ratio", "bulk"]:
        young = 3.0 * bulk * (1.0 - 2.0 * poisson)
        shear = young / (2.0 * (1.0 + poisson))
    else:
        young = 9.0 * bulk * shear / (3.0 * bulk + shear)
        poisson = young / (2.0 * shear) - 1.0
    good = (-1.0 < poisson) & (poisson < 0.5) & (young > 0.0) & np.isfinite(bulk)
    if not np.all(good):
        wrong = np.asarray(poisson)[~np.asarray(good)].flat[0] if np.ndim(poisson) else poisson
        raise CommandError(f"the moduli give Poisson's ratio {wrong:g}, which must lie between -1 and 0.5")
    values.update(young=young, poisson_ratio=poisson, shear=shear, bulk=bulk)


def _friction(doc: str, softens: bool = False) -> Property:
    return Property("friction", "degrees", doc, 0.0, high=89.0, softens=softens)


SOFTENS = ("cohesion", "friction", "dilation", "tensile")
"""Properties that may follow a table over plastic strain. The number of the table is their `softening_table`, 0:
none."""


def softening_table(name: str) -> str:
    """The internal property that holds the number of a property's table over plastic strain."""
    return f"{name}_table"


def temperature_table(name: str) -> str:
    """Name of the property that holds the table of a property over temperature."""
    return f"{name}_by_temperature"


def softening_rows(rows: Rows) -> np.ndarray:
    """(rows,) bool: models that yield with a strength that follows a table, over plastic strain or temperature."""
    names = (*map(softening_table, SOFTENS), temperature_table("cohesion"), temperature_table("tensile"))
    yields = np.array([rows.name(row) == MECH_MOHR_COULOMB.name for row in range(len(rows))])
    return yields & np.any([rows.column(name) > 0.0 for name in names], axis=0)


def _temperature_tables(*properties: Property) -> tuple[Property, ...]:
    """Make the internal property that names the table over temperature, for each property that can follow one."""
    return tuple(
        Property(temperature_table(one.name), "", f"table of {one.name} over temperature", 0.0, internal=True)
        for one in properties if one.temperature_dependent
    )  # fmt: skip


def _strength(values: dict[str, Any]) -> None:
    """Complete the four moduli and check that dilation is at most friction, or flow would give energy."""
    _elastic(values)
    _no_more_dilation(values)


def _agree(values: dict[str, Any]) -> bool:
    """Return whether E and Poisson's ratio are those of the bulk and Maxwell shear modulus beside them, but for
    rounding."""
    one = {"shear": values["maxwell_shear"], "bulk": values["bulk"]}
    _elastic(one)
    near = (np.isclose(one[name], values[name], rtol=1e-9, atol=1e-9) for name in ("young", "poisson_ratio"))
    return all(bool(np.all(each)) for each in near)


def _burgers(values: dict[str, Any]) -> None:
    """Complete the four moduli from Young's modulus and Poisson's ratio, of which a bulk or Maxwell shear modulus that
    is given takes the place of what they give, or from two of the four."""
    _kelvin_zz(values)
    own = ("young", "poisson_ratio", "maxwell_shear", "bulk")
    given = [name for name in own if name in values]
    if len(given) < 2:
        raise CommandError(f"a creeping model needs two of {', '.join(own)} (Pa), got {', '.join(given) or 'none'}")
    if len(given) == 4 and _agree(values):
        return
    if "maxwell_shear" in values:
        values["shear"] = values.pop("maxwell_shear")
    moduli = {name: values[name] for name in MODULI if name in values}
    if len(moduli) > 2 and {"young", "poisson_ratio"} <= moduli.keys():
        first = {name: values[name] for name in ("young", "poisson_ratio")}
        _elastic(first)
        moduli = {name: values.get(name, first[name]) for name in ("shear", "bulk")}
    _elastic(moduli)
    values.update(moduli)
    values["maxwell_shear"] = values.pop("shear")


_SOLID = (
    Property("density", "kg/m3", "density", low_itself=False),
    Property("young", "Pa", "Young's modulus E", optional=True, low_itself=False),
    Property("poisson_ratio", "1", "Poisson's ratio", optional=True, low=-1.0, high=0.4999, low_itself=False),
    Property("shear", "Pa", "shear modulus; with the bulk modulus it replaces E and Poisson's ratio",
             optional=True, low_itself=False),
    Property("bulk", "Pa", "bulk modulus; with the shear modulus it replaces E and Poisson's ratio",
             optional=True, low_itself=False),
    Property("damp_factor", "1", "viscous damping, part of the critical 2 L sqrt(rho E); without effect in static "
             "runs", 0.0),
)  # fmt: skip

_SOLID_BY_TEMPERATURE = tuple(replace(one, temperature_dependent=one.name == "young") for one in _SOLID)
_ELASTIC = (
    _friction("friction angle of its surfaces where they have no contact model"),
    Property("penalty", "Pa", "contact penalty of its surfaces where they have no contact model; 0: that of its "
             "joints, or 10 E", 0.0),
)  # fmt: skip

_DAMP_B = Property("damp_b", "1", "exponent of the overlap of its surfaces while they separate, where they have no "
                   "contact model; above 1 contacts lose energy", 1.0, low=1.0)  # fmt: skip

MECH_ISO_ELASTIC = Model(
    "mech_iso_elastic",
    ELEMENT,
    "isotropic, elastic, large rotations",
    (*_SOLID_BY_TEMPERATURE, *_ELASTIC, *_temperature_tables(*_SOLID_BY_TEMPERATURE), _DAMP_B),
    _elastic,
)

_STRENGTH_BY_TEMPERATURE = (
    Property("cohesion", "Pa", "cohesion", 0.0, softens=True, temperature_dependent=True),
    Property(
        "tensile",
        "Pa",
        "tensile strength; limited to cohesion / tan(friction)",
        0.0,
        softens=True,
        temperature_dependent=True,
    ),
)
MECH_MOHR_COULOMB = Model(
    "mech_mohr_coulomb",
    ELEMENT,
    "elastic up to the Mohr-Coulomb or tensile strength, then plastic",
    (
        *_SOLID_BY_TEMPERATURE,
        _friction("internal friction angle; also that of its surfaces where they have no contact model", softens=True),
        *_STRENGTH_BY_TEMPERATURE,
        Property("dilation", "degrees", "dilation angle, at most the friction angle", 0.0, high=89.0, softens=True),
        *(Property(softening_table(name), "", f"table of {name} over plastic strain", 0.0, internal=True)
          for name in SOFTENS),
        *_temperature_tables(*_SOLID_BY_TEMPERATURE, *_STRENGTH_BY_TEMPERATURE),
        _ELASTIC[1],
        _DAMP_B,
    ),
    _strength,
)  # fmt: skip

USER = Model(
    "user",
    ELEMENT,
    "a user law, in a Python file: properties of its elements in addition to those that the law declares",
    (*_SOLID, *_ELASTIC),
    _elastic,
)  # fmt: skip


def _kelvin_zz(values: dict[str, Any]) -> None:
    """The strain of a Kelvin unit has no volume: zz is -xx - yy, also where it is assigned."""
    xx, yy = (np.asarray(values[name]) for name in ("kelvin_strain_xx", "kelvin_strain_yy"))
    zz = np.asarray(values.setdefault("kelvin_strain_zz", 0.0 - xx - yy))
    wrong = np.abs(xx + yy + zz) > 1e-9 * np.maximum(np.maximum(np.abs(xx), np.abs(yy)), np.abs(zz))
    if np.any(wrong):
        one, other, third = (float(np.broadcast_to(v, wrong.shape)[wrong].flat[0]) for v in (xx, yy, zz))
        raise CommandError(
            f"kelvin_strain_zz must be -xx - yy = {-one - other:g}, as that strain has no volume, got {third:g}"
        )


KELVIN_STRAIN = {
    2: ("kelvin_strain_xx", "kelvin_strain_yy", "kelvin_strain_xy"),
    3: ("kelvin_strain_xx", "kelvin_strain_yy", "kelvin_strain_xy", "kelvin_strain_xz", "kelvin_strain_yz"),
}
"""Components that a command assigns, in the plane and in space; zz follows from them."""
MECH_BURGERS = Model(
    "mech_burgers",
    ELEMENT,
    "elastic in its volume, creeping in its shape after Burgers",
    (
        *(one for one in _SOLID if one.name not in ("shear", "bulk")),
        Property("bulk", "Pa", "bulk modulus, instead of the one that E and Poisson's ratio give", optional=True,
                 low_itself=False),
        Property("maxwell_shear", "Pa", "shear modulus of the Maxwell unit, instead of the one that E and "
                 "Poisson's ratio give", optional=True, low_itself=False),
        Property("maxwell_viscosity", "Pa s", "viscosity of the Maxwell unit; 0: no dashpot", 0.0),
        Property("kelvin_shear", "Pa", "shear modulus of the Kelvin unit; 0: no Kelvin unit", 0.0),
        Property("kelvin_viscosity", "Pa s", "viscosity of the Kelvin unit; 0: no Kelvin unit", 0.0),
        *(Property(name, "1", f"strain {name[-2:]} of the Kelvin unit at that moment; its zz is -xx - yy", 0.0,
                   low=-math.inf)
          for name in KELVIN_STRAIN[2]),
        _friction("friction angle of its surfaces where they have no contact model"),
        Property("kelvin_strain_zz", "1", "strain zz of the Kelvin unit at that time; assign all three",
                 low=-math.inf, optional=True, otherwise="-xx - yy", dims=(3,)),
        *(Property(name, "1", f"strain {name[-2:]} of the Kelvin unit at that moment", 0.0, low=-math.inf, dims=(3,))
          for name in KELVIN_STRAIN[3][3:]),
    ),
    _burgers,
    {"shear": "maxwell_shear"},
)  # fmt: skip

SOLID = Model(
    "of elements",
    ELEMENT,
    "properties of elements of any model",
    tuple({p.name: p for m in (MECH_BURGERS, MECH_MOHR_COULOMB, MECH_ISO_ELASTIC) for p in m.properties}.values()),
)

CONTACT_MOHR_COULOMB = Model(
    "contact_mohr_coulomb",
    FACE,
    "penalty contact with Coulomb friction",
    (
        _friction("friction angle"),
        Property("penalty_normal", "Pa", "normal penalty; 10 to 100 E is usual", otherwise="10 E", low_itself=False),
        Property("penalty_shear", "Pa", "shear penalty", optional=True, follows="penalty_normal",
                 otherwise="the normal penalty"),
        Property("damping_t", "Pa", "largest normal stress while surfaces approach; contacts that reach it lose energy",
                 math.inf, otherwise="never", low_itself=False),
        Property("damping_b", "1", "exponent of the overlap while surfaces separate; above 1 contacts lose energy", 1.0,
                 low=1.0),
        Property("damping_ratio", "1", "normal dashpot, part of the critical damping of two elements; the larger value "
                 "of two surfaces applies; without effect in static runs", 0.0),
    ),
)  # fmt: skip

_JOINT_BY_TEMPERATURE = (
    Property("cohesion", "Pa", "cohesion; 0: friction alone", temperature_dependent=True),
    Property("tensile_strength", "Pa", "tensile strength; 0: none", temperature_dependent=True),
    Property("gf1", "N/m", "fracture energy, mode I", temperature_dependent=True),
    Property("gf2", "N/m", "fracture energy, mode II", temperature_dependent=True),
)
COHESIVE = Model(
    "classic_intrinsic_cohesive_interface",
    JOINT,
    "cohesive zone that breaks in tension, in shear, or both",
    (
        _friction("friction angle"),
        *_JOINT_BY_TEMPERATURE,
        Property("penalty_normal", "Pa", "penalty of opening", otherwise="10 E", low_itself=False),
        Property("penalty_overlay", "Pa", "penalty of a closed joint", optional=True, follows="penalty_normal",
                 otherwise="the penalty of opening", low_itself=False),
        Property("penalty_shear", "Pa", "penalty of shear", optional=True, follows="penalty_normal",
                 otherwise="the penalty of opening", low_itself=False),
        *_temperature_tables(*_JOINT_BY_TEMPERATURE),
    ),
    lambda values: _cohesive(values),
)  # fmt: skip


def _cohesive(values: dict[str, Any]) -> None:
    for strength, energy in (("tensile_strength", "gf1"), ("cohesion", "gf2")):
        lost = (np.asarray(values[strength]) > 0.0) & (np.asarray(values[energy]) <= 0.0)
        if lost.any():
            where = float(np.asarray(values[strength])[lost].flat[0])
            raise CommandError(f"{energy} must be > 0 (N/m) where {strength} is {where:g} Pa, got 0")


_STIFFNESS = (
    Property("normal_stiffness", "Pa/m", "normal stiffness; for Barton–Bandis joints at zero stress", low_itself=False),
    Property("shear_stiffness", "Pa/m", "shear stiffness", low_itself=False),
)
COULOMB_JOINT = Model(
    "joint_mohr_coulomb",
    JOINT,
    "pre-existing joint: springs, Coulomb friction",
    (
        *_STIFFNESS,
        _friction("friction angle"),
        Property("cohesion", "Pa", "cohesion; 0 at a point that has failed in tension", 0.0),
        Property("tensile_strength", "Pa", "tensile strength; 0 at a point that has failed in tension", 0.0),
        Property("dilation", "degrees", "dilation angle, at most the friction angle", 0.0, high=89.0),
        Property("dilation_limit", "m", "sliding distance up to which it dilates", math.inf, otherwise="no end"),
    ),
    lambda values: _no_more_dilation(values),
)  # fmt: skip
BARTON_BANDIS = Model(
    "joint_barton_bandis",
    JOINT,
    "pre-existing rough joint after Barton and Bandis",
    (
        *_STIFFNESS,
        Property("closure_maximum", "m", "largest closure V_m", low_itself=False),
        Property("residual_friction", "degrees", "residual friction angle", high=70.0),
        Property("jrc", "1", "joint roughness coefficient JRC", high=20.0),
        Property("jcs", "Pa", "strength of the walls JCS", low_itself=False),
        Property("joint_size", "m", "length of joint for which JRC and JCS are given", 0.1, low_itself=False),
        Property("dilation_part", "1", "part of the mobilised roughness angle by which the joint dilates; 0: no "
                 "dilation", 0.5,
                 high=1.0),
    ),
    called={"friction": "residual_friction"},
)  # fmt: skip
OF_JOINTS = Model(
    "of joints",
    JOINT,
    "properties of joints of any model",
    tuple({p.name: p for m in (BARTON_BANDIS, COULOMB_JOINT, COHESIVE) for p in m.properties}.values()),
)


def _no_more_dilation(values: dict[str, Any]) -> None:
    dilation, friction = np.broadcast_arrays(values["dilation"], values["friction"])
    if np.any(dilation > friction):
        one, other = (float(v[dilation > friction].flat[0]) for v in (dilation, friction))
        raise CommandError(f"dilation must not be above friction ({other:g} degrees), got {one:g}")


MODELS = {
    model.name: model
    for model in (
        MECH_ISO_ELASTIC,
        MECH_MOHR_COULOMB,
        MECH_BURGERS,
        CONTACT_MOHR_COULOMB,
        COHESIVE,
        COULOMB_JOINT,
        BARTON_BANDIS,
    )
}


def model(name: str, on: str) -> Model:
    """The model of this name for elements, faces or joints; CommandError listing those there are."""
    found = MODELS.get(name)
    if found is None or found.on != on:
        known = ", ".join(m.name for m in MODELS.values() if m.on == on and type(m) is Model)
        raise CommandError(f"there is no model {name} for an {on}; available: {known}")
    return found


class Rows:
    """Sets of property values in use, each once: what elements, faces and joints hold is a row number.

    Row 0 means no model. A row never changes its meaning, so equal assignments in equal order give equal numbers on
    all ranks.
    """

    def __init__(self) -> None:
        self.rows: list[tuple[str, tuple[float, ...]]] = [("", ())]
        self._found: dict[tuple[str, tuple[float, ...]], int] = {self.rows[0]: 0}
        self._columns: dict[tuple[str, float], np.ndarray] = {}

    def __len__(self) -> int:
        return len(self.rows)

    def row(self, of: Model, values: Mapping[str, float]) -> int:
        """Number of the row with these complete values."""
        return int(self.numbers(of, np.array([[values[p.name] for p in of.properties]]))[0])

    def numbers(self, of: Model, values: np.ndarray) -> np.ndarray:
        """Rows (n,) with these complete values (n, properties)."""
        out = np.empty(len(values), np.int32)
        for i, one in enumerate(zip(*values.T.tolist()) if len(values) else ()):
            key = of.name, one
            row = self._found.get(key)
            if row is None:
                row = self._found[key] = len(self.rows)
                self.rows.append(key)
            out[i] = row
        return out

    def values(self, row: int) -> dict[str, float]:
        """The values of a row by name; empty for row 0."""
        name, numbers = self.rows[row]
        return dict(zip((p.name for p in MODELS[name].properties), numbers)) if name else {}

    def name(self, row: int) -> str:
        """The name of its model, "" for row 0."""
        return self.rows[row][0]

    def column(self, name: str, default: float = 0.0) -> np.ndarray:
        """Values of a property in all rows (rows,), read-only; `default` for rows without it."""
        known = self._columns.get((name, default), np.empty(0))
        if len(known) < len(self.rows):
            called = {m.name: m.called.get(name, name) for m in MODELS.values()}
            place = {
                m.name: [p.name for p in m.properties].index(called[m.name])
                for m in MODELS.values() if m.has(called[m.name])
            }  # fmt: skip
            new = [numbers[place[of]] if of in place else default for of, numbers in self.rows[len(known) :]]
            known = np.concatenate([known, new])
            known.flags.writeable = False
            self._columns[name, default] = known
        return known

    def state(self) -> list:
        """The rows as JSON values."""
        return [[name, list(numbers)] for name, numbers in self.rows]

    @staticmethod
    def restored(state: list) -> Rows:
        """Inverse of `state`."""
        made = Rows()
        for name, numbers in state[1:]:  # properties that are new since then have their defaults
            new = [one.default or 0.0 for one in MODELS[name].properties[len(numbers) :]]
            made.rows.append((name, (*numbers, *new)))
        made._found = {key: k for k, key in enumerate(made.rows)}
        return made
