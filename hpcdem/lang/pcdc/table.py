"""Every command, model and keyword of the PCDC language, in one table.

Parsing, abbreviations, candidates in messages, completion in the console and the page docs/pcdc_reference.md are all
made from the rows below; a new keyword is one new row. Properties of elements, faces and joints are declared with the
models of the simulation (physics/fdem/properties.py) and only get their spelling here. Words are in the manual's
notation (`keywords`).

`manual` marks what the manual itself prints; the other commands are hpcdem's, since the manual refers to an online
help for them. Spellings of the manual that are slips stand first where scripts may use them, the right ones beside
them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from hpcdem.commands.fdem.recorded import UNITS as UNITS_OF
from hpcdem.core.picture_words import COLOURS, OBJECTS
from hpcdem.core.units import CHOICES as UNITS
from hpcdem.lang.pcdc.keywords import Keyword
from hpcdem.lang.pcdc.kinds import (
    BOOL,
    CHOSEN,
    CORNER,
    COUNT,
    DIMENSIONS,
    EYE,
    FILE,
    FIRST_ID,
    FLOAT,
    FREEDOM,
    LAST_ID,
    LEVEL,
    NOT_NEGATIVE,
    OPTIONAL_BOOL,
    OPTIONAL_FLOAT,
    OPTIONAL_VECTOR,
    PAIRS,
    PART,
    PLACES,
    POINTS,
    POSITIVE,
    SECOND_POSITIVE,
    SECTION,
    SPLIT,
    STRING,
    STRINGS,
    TABLED,
    TABLED_STEP,
    THIRD_COUNT,
    THIRD_POSITIVE,
    VECTOR,
    VECTORS,
    ZERO_OR_MORE,
    Kind,
    choice,
    limited,
    varied,
)  # fmt: skip
from hpcdem.physics.bolts.properties import BOLT as BOLT_PROPERTIES
from hpcdem.physics.fdem import properties
from hpcdem.physics.fdem.groups import JOINT
from hpcdem.physics.fields import kinds
from hpcdem.physics.flow.properties import POROUS as POROUS_PROPERTIES
from hpcdem.physics.heat.properties import FLUID_HEAT as FLUID_HEAT_PROPERTIES
from hpcdem.physics.heat.properties import ISO_HEAT as HEAT_PROPERTIES
from hpcdem.physics.liners.properties import LINER as LINER_PROPERTIES
from hpcdem.physics.proppant.properties import MEDIUM as MEDIUM_PROPERTIES
from hpcdem.physics.proppant.properties import PROPPANT as PROPPANT_PROPERTIES

SHORT = {
    **{f"{word}-{axis}": f"{word[0]}{axis}" for word in ("velocity", "acceleration", "force") for axis in "xyz"},
    **{f"stress-{part}": part for part in ("xx", "yy", "zz", "xy", "xz", "yz", "normal")},
}
"""Words of the language with shorter names in programs and functions."""
BOTH, PLANE, SPACE = (2, 3), (2,), (3,)
"""Dimensions of space in which a word exists."""


@dataclass(frozen=True)
class Option:
    """A keyword with its values.

    notation and also: see `Keyword`; values: their kinds, in order; more: keywords that may follow right after the
    values and belong to this one; only: where a term of RANGE makes sense (objects), () for everywhere; dims:
    dimensions of space in which it is there; refused: why it is, and what to write instead.
    """

    notation: str
    values: tuple[Kind, ...]
    doc: str = ""
    unit: str = ""
    default: str = ""
    required: bool = False
    repeated: bool = False
    more: tuple[Option, ...] = ()
    also: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    dims: tuple[int, ...] = BOTH
    refused: str = ""

    @cached_property
    def keyword(self) -> Keyword:
        return Keyword(self.notation, self.also)

    @property
    def name(self) -> str:
        """Key of the value in a statement."""
        return self.keyword.name


@dataclass(frozen=True)
class Model:
    """A constitutive model or boundary condition with its properties. number: of the manual's table; leading: values
    that precede; one_of: sets of properties of which one must be complete; any_of: at least one property must be
    given; of: the model of the simulation; dims: dimensions of space in which it is there; does, fixed: as of commands;
    by_time: tables of time may stand for numbers, and no functions of place; ranged: the objects that it belongs to, if
    they are not those of the command; of_field: the field (physics/fields.py) whose it is."""

    notation: str
    number: str
    doc: str
    options: tuple[Option, ...] = ()
    one_of: tuple[tuple[str, ...], ...] = ()
    any_of: bool = False
    also: tuple[str, ...] = ()
    of: properties.Model | None = None
    leading: tuple[Option, ...] = ()
    dims: tuple[int, ...] = PLANE
    does: str = ""
    fixed: tuple[tuple[str, Any], ...] = ()
    by_time: bool = False
    ranged: str = ""
    of_field: str = ""

    @cached_property
    def keyword(self) -> Keyword:
        return Keyword(self.notation, self.also)


@dataclass(frozen=True)
class Command:
    """notation: its words; leading: values (and words instead of values) that precede; models: one of them is
    named after the words; ranged: the objects that RANGE chooses among, "" if it takes none; needs_option: at least one
    option must be given; properties: the word ``property`` may stand before the options; manual: printed there; dims:
    as of models; also: other words for all of the notation, of the online help; idle: why it has no effect here;
    refused: why it is, and what to write instead; does: its function, as "module.name" of `hpcdem.commands.fdem`, which
    has arguments of the names of its options, or the name of a converter in bindings.py; of commands with models that
    is given by the model; fixed: more arguments of the function."""

    notation: str
    doc: str
    example: tuple[str, ...] = ()
    leading: tuple[Option, ...] = ()
    options: tuple[Option, ...] = ()
    models: tuple[Model, ...] = ()
    ranged: str = ""
    needs_option: bool = False
    properties: bool = False
    manual: bool = False
    dims: tuple[int, ...] = PLANE
    also: tuple[str, ...] = ()
    idle: str = ""
    refused: str = ""
    does: str = ""
    fixed: tuple[tuple[str, Any], ...] = ()

    @cached_property
    def words(self) -> tuple[Keyword, ...]:
        return _keywords(self.notation)

    @cached_property
    def spellings(self) -> tuple[Spelling, ...]:
        """The words of the command and its alternative names."""
        return (Spelling(self, self.words), *(Spelling(self, _keywords(words), own=False) for words in self.also))

    @cached_property
    def name(self) -> str:
        """The words of the command in full."""
        return " ".join(word.name for word in self.words)


@dataclass(frozen=True)
class Level:
    """A word that a command may continue with."""

    keyword: Keyword


@dataclass(frozen=True)
class Spelling:
    """Words that name a command; own: those that it is called by here."""

    command: Command
    words: tuple[Keyword, ...]
    own: bool = True


_SPELLINGS = {
    "c-m{odel}": ("c{onstitutive}-m{odel}",), "init{ial}": ("init{ialize}",), "r{emove}": ("r{move}",),
    "p{lot}-f{requency}": ("p{lot}-f{renquency}",),
}  # fmt: skip
"""Alternative spellings of words of commands."""


def _keywords(notation: str) -> tuple[Keyword, ...]:
    return tuple(Keyword(word, _SPELLINGS.get(word, ())) for word in notation.split())


def distinct(spellings: Iterable[Spelling], depth: int) -> list[Level]:
    """The words at this place of the commands, each once."""
    return [
        Level(word)
        for word in dict.fromkeys(spelling.words[depth] for spelling in spellings if len(spelling.words) > depth)
    ]


@dataclass(frozen=True)
class Table:
    """All rows of a language."""

    commands: tuple[Command, ...]
    range_terms: tuple[Option, ...] = field(default=())

    @cached_property
    def spellings(self) -> tuple[Spelling, ...]:
        """Return all words that name commands."""
        return tuple(spelling for command in self.commands for spelling in command.spellings)

    @cached_property
    def _levels(self) -> dict[tuple[str, ...], tuple[list[Level], list[Spelling]]]:
        return {}

    def level(self, begun: tuple[str, ...]) -> tuple[list[Level], list[Spelling]]:
        """Words that may follow on these notations, and all words of commands that begin with them."""
        if begun not in self._levels:
            spellings = [
                spelling
                for spelling in self.spellings
                if tuple(w.notation for w in spelling.words[: len(begun)]) == begun
            ]
            self._levels[begun] = distinct(spellings, len(begun)), spellings
        return self._levels[begun]

    def command(self, name: str) -> Command:
        """The row of a command by its words in full."""
        return next(c for c in self.commands if c.name == name)


PROPERTY = Option("prop{erty}", ())
RANGE = Option("ran{ge}", ())
SET = Option("s{et}", (STRING,), "the set of the group", default="'default'")

# ---- models of solids (tables 1 to 3, 12) --------------------------------------------------------------------------


def declared(
    model: properties.Model, *notations: str, also: Mapping[str, tuple[str, ...]] | None = None, uniform: bool = False
) -> tuple[Option, ...]:
    """Make one option for each property of a model, with its limits, unit, text and default.

    notations: of those that may be shortened, in the order of the page, others follow by their names; also: see
    `Option`; uniform: neither a table nor a field can stand for a number.
    """
    names = [Keyword(notation).name for notation in notations]
    more = [name for p in model.properties if (name := p.name.replace("_", "-")) not in names and not p.internal]
    options = []
    for notation, name in zip((*notations, *more), (*names, *more)):
        one = model.property(name.replace("-", "_"))
        default = one.otherwise or ("" if one.default is None else f"{one.default:g}")
        kind = limited(one.low, one.high, one.low_itself, one.unit)
        kind = kind if uniform else varied(kind, one.softens, one.temperature_dependent)
        required = not (default or one.optional)
        options.append(
            Option(notation, (kind,), one.doc, one.unit, default, required, also=(also or {}).get(name, ()),
                   dims=one.dims)
        )  # fmt: skip
    return tuple(options)


_ELASTIC = declared(
    properties.MECH_ISO_ELASTIC, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "s{hear}", "b{ulk}", "d{amp}-f{actor}",
    "fri{ction}", "pen{alty}", "d{amp}-b",
)  # fmt: skip
_DENSITY, _YOUNG, _POISSON, _SHEAR, _BULK, _DAMP = _ELASTIC[:6]
_PAIRS = (("young", "poisson-ratio"), ("shear", "bulk"))

ISO_ELASTIC = Model(
    "mech{anical}-iso-e{lastic}", "1", "Isotropic, linear elastic, for large rotations.",
    _ELASTIC, one_of=_PAIRS, of=properties.MECH_ISO_ELASTIC, dims=BOTH, does="assignments.element_model",
)  # fmt: skip
NULL = Model(
    "null", "", "Removes (excavates) elements; adjacent faces become free. Assigning another model to them reinstates "
    "them as new, stress-free material at the present position of the void, connected to its neighbours without joints "
    "until face-joint c-model assigns some.",
    (Option("relax", (POSITIVE,), "the forces of the removed elements decrease to 0 over this time (static runs: "
                                  "number of steps)",
            "s", "at once"),), dims=BOTH, does="assignments.null",
)  # fmt: skip
MOHR_COULOMB = Model(
    "mech{anical}-m{ohr}-c{oulomb}", "2",
    "Elastic up to the Mohr–Coulomb or tensile strength, then plastic, for large rotations.",
    declared(
        properties.MECH_MOHR_COULOMB, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "s{hear}", "b{ulk}", "fri{ction}",
        "coh{esion}", "ten{sile}", "di{lation}", "d{amp}-f{actor}", "pen{alty}", "d{amp}-b",
    ),
    one_of=_PAIRS, of=properties.MECH_MOHR_COULOMB, dims=BOTH, does="assignments.element_model",
)  # fmt: skip
_FUNCTION = Option("function", (FILE,), "'file.py:function', in the folder of the script; plain text", required=True)
_LAW = Option("law", (FILE,), "'file.py:law': the file, in the folder of the script, and the name of the law in it; "
                              "plain text",
              required=True)  # fmt: skip
_PARAMETER = Option(
    "par{ameter}",
    (STRING, varied(FLOAT)),
    "a property that the law declares, by its name, and its value",
    repeated=True,
)
USER = Model(
    "user", "", "A user law in a Python file, see docs/user_laws.md.",
    (*declared(properties.USER, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "s{hear}", "b{ulk}", "d{amp}-f{actor}",
               "fri{ction}", "pen{alty}"), _PARAMETER),
    one_of=_PAIRS, of=properties.USER, leading=(_LAW,), dims=BOTH, does="assignments.user_model",
)  # fmt: skip
BURGERS = Model(
    "mech{anical}-bur{gers}", "3",
    "Burgers creep: elastic in volume, creeping in shear while model creep is on, for large rotations. An initial "
    "strain of the Kelvin unit belongs to an initial stress.",
    declared(
        properties.MECH_BURGERS, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "b{ulk}", "k{elvin}-s{hear}",
        "k{elvin}-v{iscosity}", "m{axwell}-s{hear}", "m{axwell}-v{iscosity}", "k{elvin}-s{train}-xx",
        "k{elvin}-s{train}-yy", "k{elvin}-s{train}-xy", "k{elvin}-s{train}-zz", "k{elvin}-s{train}-xz",
        "k{elvin}-s{train}-yz", "d{amp}-f{actor}", "fri{ction}",
    ),
    one_of=(("young", "poisson-ratio"), ("bulk", "maxwell-shear")), of=properties.MECH_BURGERS, dims=BOTH,
    does="assignments.element_model",
)  # fmt: skip
_COEFFICIENTS = {
    "transfer-coeficient": ("t{ransfer}-c{oefficient}", "t{ransfer}-c{oefficent}"),
    "expansion-coeficient": ("e{xpansion}-c{oefficient}",),
}  # fmt: skip
ISO_HEAT = Model(
    "therm{al}-iso-h{eat}", "12",
    "Heat conduction and thermal expansion, in addition to the mechanical model. If one element has this model, all "
    "elements need it. Heat is conducted across intact joints; broken joints transfer heat where their surfaces are in "
    "contact, with a transfer coefficient. Elements are free of thermal stress at the present temperatures. "
    "Temperatures may be in °C or K.",
    declared(HEAT_PROPERTIES, "con{ductivity}", "cap{acity}", "t{ransfer}-c{oeficient}", "e{xpansion}-c{oeficient}",
             "conductivity-a{cross}", "conductivity-ang{le}", also=_COEFFICIENTS),
    of=HEAT_PROPERTIES, dims=BOTH, does="heat.model",
)  # fmt: skip
FIELD_MODELS = {
    one.name: Model(one.word, "", f"Diffusion of {one.doc}, in addition to the mechanical model. If one element has "
                    "this model, all elements need it. It crosses joints until they break. Elements are free of the "
                    "stress that it causes at the present values.", declared(one.model), of=one.model, dims=BOTH,
            does="fields.model", of_field=one.name)
    for one in kinds().values()
}  # fmt: skip
"""Models of fields that diffuse in elements (physics/fields.py), by their names, as the next ones."""
FIELDS_AT_NODES = {
    one.name: Model(one.on_nodes, "", f"The {one.name} of nodes; times of tables are those of the field.",
                    (Option(one.name, (TABLED,), one.doc, one.unit, required=True),), dims=BOTH,
            does="node_field", of_field=one.name, by_time=True)
    for one in kinds().values()
}  # fmt: skip
FIELDS_AT_FACES = {
    one.name: Model(
        one.on_faces, "", f"The flow of {one.name} through surfaces; without it surfaces are impermeable. Times of "
        "tables are those of the field.",
        (Option("flux", (TABLED,), "inflow per area", one.flux),
         Option("transfer", (NOT_NEGATIVE,), "flow to the environment per difference in value", one.transfer,
                "the coefficient of the elements"),
         Option("environment", (TABLED,), "value of the environment", one.unit)), any_of=True, dims=BOTH,
                 does="fields.face_condition", of_field=one.name, by_time=True)
    for one in kinds().values()
}  # fmt: skip

# ---- boundary conditions of nodes and faces (tables 4 to 7, 11, 14 to 16, 18) --------------------------------------

VELOCITY = Model(
    "mech{anical}-vel{ocity}-b{oundary}-c{ondition}", "4",
    "Velocity or acceleration of nodes. Components that are not given stay free; an acceleration begins at the present "
    "velocity.",
    (Option("v{elocity}-x", (TABLED,), "velocity along x", "m/s"),
     Option("v{elocity}-y", (TABLED,), "velocity along y", "m/s"),
     Option("v{elocity}-z", (TABLED,), "velocity along z", "m/s", dims=SPACE),
     Option("a{cceleration}-x", (TABLED,), "acceleration along x", "m/s2"),
     Option("a{cceleration}-y", (TABLED,), "acceleration along y", "m/s2"),
     Option("a{cceleration}-z", (TABLED,), "acceleration along z", "m/s2", dims=SPACE)),
    any_of=True, dims=BOTH, does="assignments.velocity",
)  # fmt: skip
FORCE = Model(
    "mech{anical}-f{orce}-b{oundary}-c{ondition}", "5", "Force on each node.",
    (Option("f{orce}-x", (TABLED,), "force along x", "N"), Option("f{orce}-y", (TABLED,), "force along y", "N"),
     Option("f{orce}-z", (TABLED,), "force along z", "N", dims=SPACE)),
    any_of=True, dims=BOTH, does="assignments.force",
)  # fmt: skip
MOVE = Model(
    "mech{anical}-m{ove}-b{oundary}-c{onstraint}", "7",
    "Constrains nodes. Constraints accumulate and combine with prescribed velocities: two directions fix a node; one "
    "direction and a velocity define its motion along the line. Contradictions are rejected.",
    (Option("t{ype}", (FREEDOM, OPTIONAL_VECTOR),
            "0 free (removes constraints), 1 fixed, 2 moves along the vector only, 3 (in three dimensions) across it "
            "only (types 0 and 1 accept a vector and ignore it)", required=True),), dims=BOTH,
    also=("mech{anical}-m{ove}-c{onstrain}",), does="assignments.move",
)  # fmt: skip
STRESS = Model(
    "m{echanical}-s{tress}-b{oundary}-c{ondition}", "6",
    "Traction on surfaces: stress times the present normal. Tension is positive. Where it is not 0, it is the total "
    "traction: water pressure on the face is not added.",
    (Option("s{tress}-x{x}", (TABLED,), "stress xx", "Pa", also=("x{x}",)),
     Option("s{tress}-y{y}", (TABLED,), "stress yy", "Pa", also=("y{y}",)),
     Option("s{tress}-z{z}", (TABLED,), "stress zz", "Pa", dims=SPACE, also=("z{z}",)),
     *(Option(f"s{{tress}}-{c}", (TABLED,), f"stress {c}", "Pa", dims=SPACE if "z" in c else BOTH, also=(c,))
       for c in ("xy", "xz", "yz")),
     Option("s{tress}-n{ormal}", (TABLED,), "stress along the normal, which turns with the surface; negative is "
            "pressure", "Pa", also=("n{ormal}",)),
     Option("d{ip}", (TABLED,), "shear stress along the surface, counter-clockwise about the body", "Pa", dims=PLANE),
     Option("q{uiet}", (BOOL,), "dashpots rho c_p and rho c_s, through which waves leave in dynamic runs; a stress "
            "given with it enters as a wave of half its size"),
     Option("inc{oming}-x", (TABLED,), "velocity along x of a plane wave that enters through quiet faces", "m/s"),
     Option("inc{oming}-y", (TABLED,), "velocity along y of the plane wave", "m/s"),
     Option("inc{oming}-z", (TABLED,), "velocity along z of the plane wave", "m/s", dims=SPACE)),
    any_of=True, dims=BOTH, also=("mech{anical}-s{tress}-b{oundary}-c{ondition}",), does="assignments.stress",
)  # fmt: skip
ABSORB = Model(
    "mech{anical}-abs{orb}-b{oundary}-c{ondition}", "", "Surfaces through which waves leave, as m-s-b-c quiet on.",
    (Option("n{ormal}", (TABLED,), "stress along the normal, which enters as a wave of half its size", "Pa"),
     Option("d{ip}", (TABLED,), "stress along the surface, counter-clockwise about the body, which enters as a wave of "
                                "half its size", "Pa", dims=PLANE)),
    dims=BOTH, does="assignments.stress", fixed=(("quiet", True),),
)  # fmt: skip
FLOW_CONDITION = Model(
    "hydra{ulic}-c{onstant}-f{low}-b{oundary}", "11",
    "Fluid at nodes, one of the three at each; times of tables are those of flow. With a range, pressure and "
    "flow-surface load the free faces whose nodes all lie in it with water pressure, with or without channels there. "
    "Without a range they apply to the fluid in joints only.",
    (Option("p{ressure}", (TABLED,), "pressure, not negative", "Pa"),
     Option("f{low}-s{urface}", (LEVEL,), "water level at the nodes, measured against gravity, or a point of the water "
            "surface: hydrostatic pressure below it; above it water can leave (seepage)", "m",
            also=("f{luid}-s{urface}",)),
     Option("f{low}-r{ate}", (TABLED,), "inflow volume at each node; negative: outflow, limited to the available "
            "fluid; in space m3/s", "m2/s")),
    any_of=True, dims=BOTH,
    also=("hydr{aulic}-c{onstant}-f{low}-b{oundary}", "hydra{ulic}-c{onstant}-f{luid}-b{oundary}"),
    does="flow.condition",
)  # fmt: skip
FREE_FIELD = Model(
    "free-f{ield}", "", "Free-field boundary on vertical sides: a column with the elements of the side and the base "
    "motion of the model (velocity or quiet faces) moves next to each side, which gets its stress and dashpots on the "
    "difference of both motions. The present forces keep the nodes of the side in equilibrium, so remove the "
    "conditions of the static stage.", (), does="assignments.free_field",
)  # fmt: skip
TEMPERATURE = Model(
    "therm{al}-s{olid}-b{oundary}-c{ondition}", "14", "Temperature of nodes; times of tables are those of heat.",
    (Option("t{emperature}", (TABLED,), "temperature", "K", required=True, also=("t{mperature}",)),), dims=BOTH,
    also=("therm{al}-n{ode}-b{oundary}-c{ondition}",), does="heat.condition", by_time=True,
)  # fmt: skip
FLUID_TEMPERATURE = Model(
    "therm{al}-f{low}-b{oundary}-c{ondition}", "15", "Temperature of the fluid at flow nodes, for example of injected "
    "fluid; times of tables are those of heat.",
    (Option("t{emperature}", (TABLED,), "temperature", "K", required=True, also=("t{mperature}",)),), dims=BOTH,
    also=("therm{al}-c{avity}-b{oundary}-c{ondition}",), does="heat.fluid_condition", by_time=True,
)  # fmt: skip
PROPPANT_CONDITION = Model(
    "hydra{ulic}-p{roppant}-b{oundary}", "18", "Proppant inflow at flow nodes, also of wells; give one of the two. "
    "Times of tables are those of flow; a packed node accepts none.",
    (Option("p{roppant}-v{olumetric}-c{oncentration}", (TABLED,), "concentration of the slurry that conditions and "
            "wells supply: volume of grains over volume of slurry", "1"),
     Option("p{roppant}-v{olumetric}-f{low}-r{ate}", (TABLED,), "volume of grains that enters each node, added to its "
            "slurry; in space m3/s", "m2/s")),
    any_of=True, dims=BOTH, does="flow.proppant_condition", by_time=True,
)  # fmt: skip
CONST_HEAT = Model(
    "therm{al}-c{onst}-h{eat}", "16",
    "Heat through surfaces, which are adiabatic without it; inner faces follow it once they are free. Times of tables "
    "are those of heat.",
    (Option("h{eat}-f{lux}", (TABLED,), "heat inflow per area", "W/m2"),
     Option("t{ransfer}-c{oeficient}", (NOT_NEGATIVE,), "heat transfer to the environment", "W/(m2 K)",
            "the coefficient of the elements",
            also=(*_COEFFICIENTS["transfer-coeficient"], "h{eat}-t{ransfer}-c{oefficent}")),
     Option("e{nvironment}-t{emperature}", (TABLED,), "temperature of the environment", "K")), any_of=True, dims=BOTH,
     does="heat.face_condition", by_time=True,
)  # fmt: skip

# ---- contact and joints (tables 8, 9, 10, 13, 17) ------------------------------------------------------------------

CONTACT = Model(
    "c{ontact}-m{ohr}-c{oulomb}", "8",
    "Contact of surfaces: potential of the overlap, Coulomb friction. The smaller value of two surfaces applies.",
    declared(properties.CONTACT_MOHR_COULOMB, "f{riction}", "p{enalty}-n{ormal}", "p{enalty}-s{hear}", "d{amping}-t",
             "d{amping}-b", "d{amping}-r{atio}", also={"penalty-normal": ("n{ormal}-s{tiffness}",),
                                                       "penalty-shear": ("s{hear}-s{tiffness}",)})
    + (Option("c{ohesion}", (NOT_NEGATIVE,), "no effect: contacts have no cohesion", "Pa", "0", refused=
              "contacts have friction but no cohesion; "
              "joints have cohesion until they break: face-joint c-model c-i-c-i cohesion"),),
    of=properties.CONTACT_MOHR_COULOMB, dims=BOTH, does="assignments.face_model",
)  # fmt: skip
COHESIVE = Model(
    "c{lassic}-i{ntrinsic}-c{ohesive}-i{nterface}", "9",
    "Cohesive joints between elements: intact up to their strength, then they soften and break, and are contacts "
    "afterwards.",
    (*declared(properties.COHESIVE, "f{riction}", "c{ohesion}", "t{ensile}-s{trength}", "gf1", "gf2",
               "p{enalty}-o{verlay}", "p{enalty}-n{ormal}", "p{enalty}-s{hear}",
               also={"penalty-overlay": ("p{enalty}-o{verlap}",)}),
     Option("np", (POINTS,), "integration points", "1", "3")),
    of=properties.COHESIVE, dims=BOTH, does="assignments.joint_model",
)  # fmt: skip
COULOMB_JOINT = Model(
    "j{oint}-m{ohr}-c{oulomb}", "",
    "Pre-existing joints, as springs: sigma = normal-stiffness opening, tau = shear-stiffness slip, at most cohesion - "
    "sigma tan friction. They slide, open and close and never break. A point that opens beyond its tensile strength "
    "loses that strength and its cohesion.",
    declared(properties.COULOMB_JOINT, "n{ormal}-s{tiffness}", "s{hear}-s{tiffness}", "f{riction}", "c{ohesion}",
             "t{ensile}-s{trength}", "dil{ation}", "dil{ation}-l{imit}"),
    of=properties.COULOMB_JOINT, dims=BOTH, does="assignments.joint_model",
)  # fmt: skip
BARTON_BANDIS = Model(
    "j{oint}-b{arton}-b{andis}", "",
    "Pre-existing rough joints: closure v under the pressure normal-stiffness v / (1 - v / closure-maximum), from the "
    "pressure jcs on along the tangent; shear strength by the angle residual-friction + m jrc log10(jcs / pressure), "
    "at most 70 degrees, m: roughness that is mobilised or worn, by the path over joint-size / 500 (jrc / "
    "joint-size)^0.33; dilation by dilation-part of the part with m. They slide, open and close and never break.",
    declared(properties.BARTON_BANDIS, "n{ormal}-s{tiffness}", "s{hear}-s{tiffness}", "c{losure}-m{aximum}",
             "r{esidual}-f{riction}", "jrc", "jcs", "j{oint}-s{ize}", "dil{ation}-p{art}"),
    of=properties.BARTON_BANDIS, dims=BOTH, does="assignments.joint_model",
)  # fmt: skip
_APERTURES = {
    "aperature-initial": ("a{perture}-i{nitial}",), "aperature-maximum": ("a{perture}-max{imum}",),
    "aperature-minumum": ("a{perature}-min{imum}", "a{perture}-min{imum}", "a{perture}-min{umum}"),
}  # fmt: skip
_POROUS = tuple(
    replace(o, values=(BOOL,), unit="", default="off") if o.name in ("leak-off", "turbulence") else o for o in declared(
        POROUS_PROPERTIES, "f{luid}-den{sity}", "f{luid}-b{ulk}", "vis{cosity}", "a{perature}-i{nitial}",
        "a{perature}-min{umum}", "a{perature}-max{imum}", "leak-off", "m{atrix}-p{ore}-p{ressure}",
        "m{atrix}-p{ermeability}", "m{atrix}-p{orosity}-c{ompressibility}", "m{atrix}-p{orosity}", "sh{ear}-d{ilation}",
        "sh{ear}-d{ilation}-l{imit}",
        also={**_APERTURES, "matrix-porosity-compressibility": ("m{atrix}-p{orosity}-c{ompressiblity}",)},
    )
)  # fmt: skip
POROUS = Model(
    "hydr{aulic}-p{orous}-m{edium}", "10",
    "Fluid in joints: each is a channel between its two nodes, broken or not, of the aperture aperature-initial plus "
    "its mean opening, within the limits. It acts in addition to the mechanical model of the joint. If the model is "
    "assigned again, excess fluid is removed, and new volume is dry. In space channels are the triangles of the "
    "joints.",
    _POROUS, of=POROUS_PROPERTIES, dims=BOTH, does="flow.model", ranged=JOINT,
)  # fmt: skip
FLUID_HEAT = Model(
    "t{hermal}-f{luid}", "13",
    "Heat in the fluid of joints with a hydraulic model, in addition to heat in the elements. If one channel has this "
    "model, all channels need it. Fluid starts at the temperature of the adjacent rock; inflow has the temperature of "
    "its node.",
    tuple(replace(o, values=(BOOL,), unit="", default="off") if o.name == "second-order" else o for o in declared(
        FLUID_HEAT_PROPERTIES, "con{ductivity}", "cap{acity}", "t{ransfer}-c{oeficient}", "sec{ond}-o{rder}",
        also={"transfer-coeficient": (*_COEFFICIENTS["transfer-coeficient"],
                                      "c{onvective}-h{eat}-t{ransfer}-c{oefficient}"),
              "capacity": ("h{eat}-cap{acity}",)})),
    of=FLUID_HEAT_PROPERTIES, dims=BOTH, also=("f{luid}-t{hermal}",), does="heat.fluid_model", ranged=JOINT,
)  # fmt: skip
_GRAINS = tuple(
    replace(o, values=(BOOL,), unit="", default="off") if o.name == "proppant-stokes" else o for o in declared(
        PROPPANT_PROPERTIES, "p{roppant}-den{sity}", "p{roppant}-s{ize}", "p{roppant}-s{ize}-f{actor}",
        "a{perature}-f{actor}", "p{roppant}-c{oncentration}-l{imit}", "p{roppant}-m{odulus}", "vis{cosity}-p{ower}",
        "p{roppant}-sto{kes}", also={"aperature-factor": ("a{perture}-f{actor}",)}, uniform=True,
    )
)  # fmt: skip
GRAINS = Model(
    "",
    "17",
    "",  # p-s is the penalty of shear where cohesive models are changed too
    tuple(replace(o, notation="prop{pant}-s{ize}") if o.name == "proppant-size" else o for o in _GRAINS),
    of=PROPPANT_PROPERTIES,
    dims=BOTH,
)
PROPPANT = Model(
    "hydr{aulic}-p{orous}-p{roppant}-m{edium}", "17",
    "Fluid in joints that carries proppant, one kind in all channels. Grains move with the slurry, increase its "
    "density and viscosity, settle, and bridge where the channel is narrow. A node that is filled to the limit is a "
    "pack: fluid passes it, grains do not, and it carries the load of the walls.",
    (*_POROUS, *_GRAINS), of=MEDIUM_PROPERTIES, dims=BOTH, does="flow.with_proppant", ranged=JOINT,
)  # fmt: skip

# ---- bolts (tables 19 to 21) ---------------------------------------------------------------------------------------

BOLT = Model(
    "mech{anical}-e{lastic}-p{lastic}", "19",
    "Bars with an axial force only, elastic and perfectly plastic, in grout that slips at its strength. Forces and "
    "stiffness are those of one bolt; the model divides them by the spacing. The strength of the grout per length is "
    "the smaller of pi (diameter + 2 grout-thickness) (cohesion-rock-grout - sigma tan friction-rock-grout) and pi "
    "diameter (cohesion-grout-bolt - sigma tan friction-grout-bolt), sigma: stress across the bar in the rock if it is "
    "pressure, in space the mean in all directions across. If the model is assigned again, the force in the bar "
    "changes only by the difference of the pretension. In space each bolt is a single bolt: spacing is 1.",
    declared(
        BOLT_PROPERTIES, "den{sity}", "y{oung}", "d{iameter}", "t{ensile}-y{ield}-f{orce}",
        "c{ompressive}-y{ield}-f{orce}", "t{ension}-f{ailure}-s{train}", "s{hear}-s{tiffness}-r{ock}-b{olt}",
        "g{rout}-t{hickness}", "c{ohesion}-r{ock}-g{rout}", "c{ohesion}-g{rout}-b{olt}", "f{riction}-r{ock}-g{rout}",
        "f{riction}-g{rout}-b{olt}", "spac{ing}", "pre{tension}-f{orce}", "d{amp}-f{actor}", uniform=True,
    ),
    of=BOLT_PROPERTIES, dims=BOTH, does="supports.assign",
)  # fmt: skip
BOLT_VELOCITY = Model(
    "b{olt}-n{ode}-c{onstrain}", "20", "Velocity or acceleration of nodes of bolts. Other components stay free: along "
    "the bar nodes follow its forces, across it the rock.", VELOCITY.options, any_of=True, dims=BOTH,
    also=("s{upport}-n{ode}-c{onstrain}",), does="bolts.velocity",
)  # fmt: skip
BOLT_FORCE = Model(
    "b{olt}-n{ode}-f{orce}-b{oundary}-c{ondition}", "21", "Force on each node of one bolt; the rock carries the "
    "component across the bar.", FORCE.options, any_of=True, dims=BOTH,
    also=("b{olt}-n{ode}-f{orce}-b{oundary}-c{onditio}", "s{upport}-n{ode}-f{orce}-b{oundary}-c{onditio}"),
    does="bolts.force",
)  # fmt: skip

# ---- liners, beyond the manual -------------------------------------------------------------------------------------

LINER = Model(
    "beam", "",
    "In the plane beams in plane strain, per metre of thickness, elastic and perfectly plastic. Either a shell with a "
    "thickness, or steel sets by area and inertia over their spacing, with poisson-ratio 0. The axial force stays "
    "between the strengths times the area, the moment below 4 plastic-moment (Nt - N) (N + Nc) / (Nt + Nc)^2: the "
    "limit of a fully plastic rectangular section. In space flat shells with a thickness, whose forces and moments "
    "have these limits in their principal directions. The bond to the rock is elastic, slips at bond-cohesion + "
    "pressure tan(bond-friction), and parts for good above bond-tensile-strength. If the model is assigned again, the "
    "forces in elements stay.",
    declared(
        LINER_PROPERTIES, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "th{ickness}", "area", "inertia",
        "t{ensile}-s{trength}", "c{ompressive}-s{trength}", "pl{astic}-m{oment}", "n{ormal}-s{tiffness}",
        "s{hear}-s{tiffness}", "b{ond}-t{ensile}-s{trength}", "b{ond}-c{ohesion}", "b{ond}-f{riction}", uniform=True,
    ),
    of=LINER_PROPERTIES, dims=BOTH, also=("sh{ell}",), does="supports.assign",
)  # fmt: skip
LINER_VELOCITY = Model(
    "l{iner}-n{ode}-c{onstrain}", "", "Velocity of nodes of liners. Components that are not given stay free.",
    (Option("v{elocity}-x", (TABLED,), "velocity along x", "m/s"),
     Option("v{elocity}-y", (TABLED,), "velocity along y", "m/s"),
     Option("v{elocity}-z", (TABLED,), "velocity along z", "m/s", dims=SPACE),
     Option("spin", (TABLED,), "rate of rotation, counter-clockwise", "rad/s", dims=PLANE),
     *(Option(f"spin-{axis}", (TABLED,), f"rate of rotation about {axis}", "rad/s", dims=SPACE) for axis in "xyz")),
    any_of=True, dims=BOTH, does="liners.velocity",
)  # fmt: skip
LINER_FORCE = Model(
    "l{iner}-n{ode}-f{orce}-b{oundary}-c{ondition}", "", "Force and moment on each node of a liner, in the plane per "
    "metre of thickness.",
    (Option("f{orce}-x", (TABLED,), "force along x", "N/m"), Option("f{orce}-y", (TABLED,), "force along y", "N/m"),
     Option("f{orce}-z", (TABLED,), "force along z", "N", dims=SPACE),
     Option("m{oment}", (TABLED,), "moment, counter-clockwise", "N m/m", dims=PLANE),
     *(Option(f"m{{oment}}-{axis}", (TABLED,), f"moment about {axis}", "N m", dims=SPACE) for axis in "xyz")),
    any_of=True, dims=BOTH, does="liners.force",
)  # fmt: skip

# ---- RANGE ---------------------------------------------------------------------------------------------------------

_FACES = ("element-face", "face-joint", "node")
RANGE_TERMS = (
    Option("group", (STRING,), "members of the group", more=(SET,)),
    Option("set", (STRING,), "members of any group of the set"),
    Option("id", (ZERO_OR_MORE, LAST_ID), "the number, or from first to last; numbers begin at 0, as in the output"),
    Option("x", (FLOAT, OPTIONAL_FLOAT), "x from ... to ..., or at one number, in the mesh", "m"),
    Option("y", (FLOAT, OPTIONAL_FLOAT), "y from ... to ..., or at one number, in the mesh", "m"),
    Option("z", (FLOAT, OPTIONAL_FLOAT), "z from ... to ..., or at one number, in the mesh", "m", dims=SPACE),
    Option("a{rea}", (NOT_NEGATIVE, NOT_NEGATIVE), "elements with an area, in space faces, from ... to ...", "m2",
           only=("element", "element-face")),
    Option("not", (), "negates the next term"),
    Option("in-c{ircle}", (OPTIONAL_VECTOR, OPTIONAL_FLOAT), "all its points lie in the circle (in space the sphere) "
           "of this centre and radius; elements: their centre; positions in the mesh", "m",
           more=(Option("c{enter}", (VECTOR,), "the centre", "m"), Option("rad{ius}", (POSITIVE,), "the radius", "m"))),
    Option("geom{etry}", (STRING,), "lies on the lines (in three dimensions the surfaces) of the geometry layer; "
           "elements: their centre is inside it; positions in the mesh", only=("element", *_FACES)),
    Option("geom{etry}-a{long}", (STRING,), "lies along the lines (in space the surfaces) of the layer: within a "
           "distance of them and at an angle to them; elements and nodes by the distance only; positions in the mesh",
           only=("element", *_FACES),
           more=(Option("dis{tance}-offset", (NOT_NEGATIVE,), "largest distance of its points", "m", "0"),
                 Option("ang{le}-offset", (NOT_NEGATIVE,), "largest angle", "degrees", "0"))),
    Option("geom{etry}-d{istance}", (STRING,), "all its points are near the lines (in space the surfaces) of the "
           "layer; elements: their centre; positions in the mesh", only=("element", *_FACES),
           more=(Option("within", (NOT_NEGATIVE,), "largest distance", "m", "0"),)),
    Option("geom{etry}-l{ocation}", (STRING,), "a ray from its centre crosses the lines of the layer count times, or "
           "an even number of times more; count 1 selects what is inside; positions in the mesh",
           only=("element", *_FACES), dims=PLANE,
           more=(Option("ray-dir{ection}", (VECTOR,), "direction of the ray", "", "(1,0)"),
                 Option("count", (ZERO_OR_MORE,), "number of crossings", "1", "1"))),
    Option("pres{ent}", (), "x, y and geometry (of elements) use present positions"),
    Option("use-hidden", (BOOL,), "also selects hidden elements and their nodes, faces and joints", default="off"),
    Option("boundary", (), "lies on a surface of the model", only=("element-face", "node")),
    Option("face-of", (STRING,), "faces, joints or nodes of the elements of the group; joints: both elements are in "
           "the group; nodes: at joints and cracks those on the side of the group", more=(SET,), only=_FACES),
    Option("e{lement}", (FIRST_ID, LAST_ID), "faces or nodes of the element, or of the elements from first to last; "
           "without a number, of any element", only=("element", "element-face", "node")),
    Option("between", (STRING, STRING), "joints with an element of each of the two groups", more=(SET,),
           only=("face-joint",)),
    Option("crack", (), "joints on a crack of the mesh", only=("face-joint",)),
)  # fmt: skip

# ---- commands ------------------------------------------------------------------------------------------------------

_GROUP = Option("group", (STRING,), "the group that the new elements are in", "", "'default'", more=(SET,))
_LAYER = Option("a{s}-l{ayer}", (STRING,), "name of the layer; a layer may hold several shapes", default="'default'")
_SOME_LAYERS = Option("l{ayer}", (STRINGS,), "names of layers", "", "all")
_NAME = Option("name", (STRING,), "name", required=True)
RECORDED = {
    {JOINT: "joint"}.get(kind, kind): {name.replace("_", "-"): unit for name, unit in of.items()}
    for kind, of in UNITS_OF.items()
}
"""Quantities that a history can record, with units."""
_RECORDED = choice(*dict.fromkeys(name for of in RECORDED.values() for name in of))
_EVERY = Option("ev{ery}", (COUNT,), "steps between two records", "", "1")


def _leading(name: str, kind: Kind, doc: str, unit: str = "", required: bool = True) -> Option:
    return Option(name, (kind,), doc, unit, required=required)


def _removed(*conditions: Model) -> tuple[Option, ...]:
    """Make the options that select conditions to remove; without any, all are removed."""
    return tuple(Option(one.notation, (), "only this condition", also=one.also, dims=one.dims) for one in conditions)


def _group_command(kind: str, notation: str, also: str = "") -> Command:
    return Command(
        f"{notation} g{{roup}}", f"Assigns {kind}s to a group; each is in at most one group of a set, and leaves its "
        "previous group.", (f"pcdc {kind} group 'top' set 'bc' range y 9.9 10.1",),
        (_leading("group", STRING, "name of the group"),), (SET,), ranged=kind, dims=BOTH,
        also=(f"{also} g{{roup}}",) if also else (), does="assignments.group",
    )  # fmt: skip


def _list_command(kind: str, notation: str) -> Command:
    return Command(
        f"{notation} l{{ist}} sum{{mary}}", f"Reports the number of {kind}s by model and group in the log.",
        (f"pcdc {kind} list summary range x 0 5",), ranged=kind, dims=BOTH, also=(f"{notation} l{{ist}}",),
        does="summary.listed",
    )  # fmt: skip


def _properties(model: Model) -> tuple[Option, ...]:
    """The properties of a model, all optional, for commands that change some."""
    return tuple(
        Option(o.notation, o.values, o.doc, o.unit, also=o.also, dims=tuple(d for d in o.dims if d in model.dims),
               refused=o.refused)
        for o in model.options if o.name != "np"
    )  # fmt: skip


_OF_JOINTS = tuple(
    {o.name: o for model in (BARTON_BANDIS, COULOMB_JOINT, COHESIVE) for o in _properties(model)}.values()
)
_FRICTION = next(o.values for o in MOHR_COULOMB.options if o.name == "friction")
_OF_SOLIDS = (
    *(replace(o, doc=f"{o.doc}; the internal one of {MOHR_COULOMB.keyword.name}", values=_FRICTION)
      if o.name == "friction" else o for o in _properties(ISO_ELASTIC)),
    *(o for o in _properties(MOHR_COULOMB) if o.name not in {one.name for one in ISO_ELASTIC.options}),
    *(o for o in _properties(BURGERS) if o.name not in {one.name for one in ISO_ELASTIC.options}),
    *_properties(ISO_HEAT),
    *(option for one in FIELD_MODELS.values() for option in _properties(one)),
    _PARAMETER,
)  # fmt: skip

_PARTS = (
    ("m{echanical}", "the blocks"), ("t{hermal}", "heat"), ("h{ydraulic}", "fluid"),
    ("p{roppant}-t{ransport}", "proppant, which follows that of the fluid"),
)  # fmt: skip
_STEPS = (
    Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "time step", "s"),
    Option("c{ycle}-n{umber}", (COUNT,), "steps in a cycle"),
)  # fmt: skip
_CLOCKS = (
    Option("s{tart}-t{ime}", (FLOAT,), "time from which model run-time counts", "s"),
    Option("c{urrent}-t{ime}", (FLOAT,), "present time of the clock", "s"),
    Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "time step", "s"),
)  # fmt: skip
_WINDOW = "hpcdem view shows a run while it steps, at its own pace"

_MODEL = (
    Command("mod{el} new", "Starts a new model; only Python variables are kept.",
            ("pcdc model new", "pcdc model new dim 3"),
            options=(Option("dim", (DIMENSIONS,), "dimensions of space; some commands are not available in three, see "
                            "the end of the reference", "", "2"),), manual=True, dims=BOTH, does="settings.new"),
    Command("mod{el} sav{e}", "Writes the complete state to a file: mesh, models, motion, cracks, histories, and "
            "Python variables and functions whose names begin with m_.", ("pcdc model save 'test.sav'",),
            (_leading("file", FILE, "name of the file, in the folder of the script"),), manual=True, dims=BOTH,
            does="checkpoints.save"),
    Command("mod{el} rest{ore}", "Loads the state of a file with its m_ variables and functions.",
            ("pcdc model restore 'test.sav'",), (_leading("file", FILE, "name of the file"),), manual=True, dims=BOTH,
            does="restore"),
    Command("mod{el} g{ravity}", "Sets gravity from now on.", ("pcdc model gravity (0,-9.81)",),
            (_leading("gravity", VECTOR, "acceleration", "m/s2"),), dims=BOTH, does="settings.gravity"),
    Command("mod{el} units", "Declares the units of all following values. Unlikely values give a warning, once per "
            "property, with the factor that may be missing; histories and charts show the units. No value is "
            "changed.", ("pcdc model units SI", "pcdc model units mm-MPa-s"),
            (_leading("system", choice(*UNITS), ", ".join(UNITS.values())),), dims=BOTH, does="settings.units"),
    Command("mod{el} opt{ion}", "Sets options of the calculation.",
            ("pcdc model option dynamic off", "pcdc model option collision on"),
            options=(
                Option("dyn{amic}", (BOOL,), "true motion in time; off: static, towards equilibrium", default="on"),
                Option("col{lision}", (OPTIONAL_BOOL,), "contact of surfaces", default="on"),
                Option("ecda", (BOOL,), "on: intact joints are not contacts; off is not available and is "
                       "rejected", default="on"),
                Option("cr{eep}", (BOOL,), "as model creep", default="off"),
                Option("over{lap}", (choice("refuse", "relax", "keep"),), "bodies that overlap before the first step: "
                       "reject them, with their positions; separate them in a static stage; or start with the overlap",
                       default="refuse"),
                Option("deep-o{verlap}", (choice("warn", "stop"),), "bodies that overlap by more than a tenth of an "
                       "altitude of an element during the run: report where, or end the run", default="warn"),
                Option("pot{ential}", (choice("distance", "munjiza"),), "potential of contact: distance to the nearest "
                       "face of an element over the typical altitude in its body, or four times the smallest "
                       "barycentric coordinate", default="distance", dims=SPACE),
                Option("mech{anical}", (BOOL,), "motion of blocks; off: blocks are fixed while fluid or heat flows",
                       default="on"),
                Option("large-s{train}", (BOOL,), "rotations of elements are included", default="on"),
                Option("en{ergy}", (BOOL,), "keep the energy budget from here on, in dynamic runs: `pcdc.energies`, "
                       "histories of the model, a table at the end", default="off"),
                Option("hyd{raulic}", (BOOL,), "flow in joints with a hydraulic model; off: pressures are frozen and "
                       "keep loading the blocks", default="on"),
                Option("one-way", (BOOL,), "fluid follows the blocks but does not load them", default="off"),
                Option("therm{al}", (BOOL,), "heat flow in elements with a thermal model; off: temperatures and "
                       "thermal stress are frozen", default="on"),
                Option("prop{pant}", (BOOL,), "motion of grains in channels that carry proppant; off: grains are "
                       "fixed", default="on", also=("p{roppant}-t{ransport}",))),
            needs_option=True, manual=True, dims=BOTH, also=("mod{el}",), does="option"),
    Command("mod{el} t{ime}-s{tep}", "The time step of dynamic runs. In static runs a step is one unit of time. "
            "Without this command it is estimated at the first step and after each change of the model. The last of "
            "value, mass-scaling and auto on applies and replaces the others.",
            ("pcdc model time-step auto off", "pcdc model time-step 1e-7", "pcdc model time-step value 0",
             "pcdc model time-step table 'dt'", "pcdc model time-step auto update-frequency 20"),
            (_leading("value", TABLED_STEP, "same as value", "s", False),),
            (
                Option("value", (TABLED_STEP,), "the time step; 0: estimated automatically; a table over time is "
                       "evaluated every 100 steps", "s"),
                Option("auto", (OPTIONAL_BOOL,), "on: estimated again every 100 steps; off: at the first step and "
                       "after changes of the model only; a value stays", default="off"),
                Option("u{pdate}-f{requency}", (COUNT,), "with auto: steps after which it is estimated again",
                       default="100"),
                Option("safe{ty}", (PART,), "part of the stability limit that estimates and mass-scaling use",
                       "1", "0.8"),
                Option("mass-s{caling}", (NOT_NEGATIVE,), "mass is added to nodes as this time step requires; 0: none, "
                       "and the step is estimated again", "s"),
                Option("hyd{raulic}", (NOT_NEGATIVE,), "sub-step of flow, which then has its own clock; 0: the "
                       "sub-steps of a cycle cover the time of the steps of the blocks or, without motion, are half of "
                       "the stable sub-step",
                       "s", "0"),
                Option("therm{al}", (NOT_NEGATIVE,), "sub-step of heat, which then has its own clock; 0: the sub-steps "
                       "of a cycle cover the time of the steps of the blocks or, without motion, are 0.9 of the stable "
                       "sub-step", "s",
                       "0")),
            needs_option=True, manual=True, dims=BOTH, does="settings.time_step"),
    Command("mod{el} step", "Executes a number of steps.", ("pcdc model step 1000",),
            (_leading("steps", ZERO_OR_MORE, "number of steps"),), dims=BOTH, does="steps.step"),
    Command("mod{el} sol{ve}", "Steps until the first of ratio, cycles, time and run-time is reached. Without any of "
            "them: ratio 1e-5 or 10 000 cycles, with a warning if the cycles end it. With elastic: static equilibrium "
            "by Newton's method, for elastic or yielding blocks whose joints are not past their peak and whose "
            "surfaces are not in contact. A run that does not converge to its ratio (window, limit) ends the script "
            "with exit code 3 and names the body that slides away; `pcdc.solved['reason']` is the reason why a run "
            "ended.",
            ("pcdc model solve ratio 1e-6", "pcdc model solve time 0.05", "pcdc model solve elastic time 1e6",
             "pcdc model solve elastic steps 10", "pcdc model solve hydraulic time 5 dt 0.01",
             "pcdc model solve hydraulic steady", "pcdc model solve hydraulic auto time 3600",
             "pcdc model solve thermal time 3e7 dt 1e5", "pcdc model solve thermal steady",
             "pcdc model solve ratio 1e-6 limit 200000 on-failure continue"),
            options=(Option("r{atio}", (POSITIVE,), "unbalanced forces over all forces of the nodes; with elastic: "
                            "1e-8, or less as far as rounding allows", "1"),
                     Option("c{ycles}", (COUNT,), "steps; with elastic: units of time (1) for which prescribed "
                            "velocities act"),
                     Option("t{ime}", (POSITIVE,), "simulated time; in static runs creep time, with each creep step "
                            "solved to its ratio (1e-5), or directly with elastic", "s"),
                     Option("r{un}-t{ime}", (POSITIVE,), "as model run-time, for this command alone", "s"),
                     Option("win{dow}", (ZERO_OR_MORE,), "with a ratio: the run fails if the least ratio has not "
                            "decreased by a tenth in this number of steps, nor in as many steps as the progress so far "
                            "took; 0: never", default="static runs: ten times the steps in which a wave crosses the "
                            "model and returns, at least 20 000; dynamic runs, and with cycles or time: 0"),
                     Option("lim{it}", (ZERO_OR_MORE,), "with a ratio: the run fails after this number of steps; 0: "
                                                        "never",
                            default="static runs 1 000 000, dynamic runs 10 000 000; with time: 0"),
                     Option("on-f{ailure}", (choice("stop", "continue"),), "stop: with exit code 3; continue: with a "
                            "warning, the script can check pcdc.solved", default="stop"),
                     Option("ela{stic}", (), "directly, without steps"),
                     Option("hyd{raulic}", (), "flow by implicit steps, backward Euler, for a time or until it is "
                            "steady; in static runs blocks are in equilibrium at the end of each step, and joints may "
                            "pass their peak and break; with mechanical off, flow alone"),
                     Option("therm{al}", (), "heat by implicit steps, backward Euler, for a time or directly to its "
                            "steady state; in static runs blocks are in equilibrium at the end of each step, and "
                            "joints may pass their peak and break; with mechanical off, heat alone"),
                     Option("dt", (POSITIVE,), "with hydraulic or thermal: longest time step; steps of flow are "
                            "shorter when joints break or a step does not converge", "s", "a hundredth of the time"),
                     Option("auto", (), "with hydraulic and time: uses explicit steps, as without the word hydraulic, "
                            "if their estimated cost is lower or implicit steps are not possible; the log reports both "
                            "estimates"),
                     Option("stea{dy}", (), "with hydraulic or thermal: until outflow equals inflow; no time passes"),
                     Option("solver", (choice("auto", "direct", "petsc"),), "with elastic, hydraulic or thermal: SciPy "
                            "on one rank, identical results on any number of ranks; PETSc on all ranks; auto: PETSc, "
                            "if available, from 400 000 unknowns, in space from 20 000", default="auto"),
                     Option("ste{ps}", (COUNT,), "with elastic: number of equal load increments, in each of which "
                            "elements yield once; an increment that does not converge is "
                            "halved", "", "1")), dims=BOTH, does="solve"),
    Command("mod{el} r{un}-t{ime}", "Maximum simulated time of each following model solve, counted from its start or "
            "from the start-time of model reset; without another criterion model solve runs for this time. No time "
            "passes in static runs without creep.", ("pcdc model run-time 0.1", "pcdc model run-time 0"),
            (_leading("time", NOT_NEGATIVE, "0: no limit", "s"),), dims=BOTH, does="clocks.run_time"),
    Command("mod{el} s{olve}-c{heck}", "Steps between two checks of the ratio in model solve.",
            ("pcdc model solve-check 10",), (_leading("steps", COUNT, "default: 50 in static runs, 100 in dynamic "
                                                      "runs"),), dims=BOTH, does="clocks.solve_check"),
    Command("mod{el} c{ycle}-o{ption}", "Time step and number of steps of each part in a cycle of a coupled "
            "calculation: those of the blocks as model time-step value and model sub-step mechanical, those of fluid "
            "and heat as model time-step and model sub-step with these words. Proppant moves with the fluid, in its "
            "steps.", ("pcdc model cycle-option mechanical cycle-number 20 hydraulic time-step 0.5 cycle-number 4",),
            options=tuple(Option(word, (), f"time step and steps per cycle of {what}", more=_STEPS)
                          for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.cycle_option"),
    Command("mod{el} reset", "Sets the clocks of the parts. Tables of conditions, stages of wells and leak-off use "
            "them.", ("pcdc model reset mechanical current-time 0", "pcdc model reset hydraulic current-time 0 "
                      "time-step 0.5"),
            options=tuple(Option(word, (), f"clock of {what}", more=_CLOCKS) for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.reset"),
    Command("mod{el} query", "Reports the present time and the time step of a part in the log.",
            ("pcdc model query mechanical time",),
            options=tuple(Option(word, (), f"clock of {what}",
                                 more=(Option("t{ime}", (), "the present time", required=True),))
                          for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.query"),
    Command("mod{el} pl{ane}-strain", "Plane strain: no strain across the plane. This is the default of models in two "
            "dimensions; the command revokes model plane-stress.", ("pcdc model plane-strain",),
            does="settings.option", fixed=(("plane_stress", False),)),
    Command("mod{el} pl{ane}-stress", "Plane stress: a plate of unit thickness with stress-free faces; the stress "
            "across the plane is 0 in elastic, yielding and creeping elements, also with heat. Must precede element "
            "initial and the first step. A user law must return 0 for the out-of-plane stress.",
            ("pcdc model plane-stress",), does="settings.option", fixed=(("plane_stress", True),)),
    Command("mod{el} p{lot}-f{requency}", "Steps between two pictures of the window.", ("pcdc model p-f 10",),
            (_leading("steps", COUNT, "steps"),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} r{ender}-i{nterval}", "Interval between two pictures of the window.",
            ("pcdc model render-interval 10",),
            (_leading("steps", COUNT, "steps"),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} r{ender}-a{uto}", "Draws the window automatically.", ("pcdc model render-auto",),
            (_leading("on", BOOL, "whether the window is drawn", required=False),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} c{ollision}-d{etect}", "Selects the contact search.", ("pcdc model collision-detect bvh",),
            options=tuple(Option(word, (), doc) for word, doc in (
                ("bvh", "tree of bounding boxes"), ("sap", "sorting along an axis"), ("unif{orm}", "grid of cells"),
                ("unform", "grid of cells, as uniform"), ("b{roken}-j{oint}-p{air}", "pairs of broken faces"))),
            needs_option=True, dims=BOTH, idle="hpcdem has a single search, which finds every contact in time"),
    Command("mod{el} c{ollision}-c{ompute}", "Selects how contact forces are computed.",
            ("pcdc model collision-compute accurate",),
            options=(Option("accurate", (), "integral over the overlap"), Option("iterate", (), "iteration")),
            needs_option=True, dims=BOTH, idle="the force of a contact is always computed over its complete overlap"),
    Command("mod{el} sub-s{tep}", "Steps of the parts of a coupled calculation.",
            ("pcdc model sub-step mechanical 10 hydraulic 5", "pcdc model sub-step mechanical 100 thermal 1"),
            options=(Option("mech{anical}", (COUNT,), "steps of the blocks between two cycles of flow, and of heat",
                            default="1"),
                     Option("therm{al}", (ZERO_OR_MORE,),
                            "sub-steps of a cycle of heat; 0: as many as stability requires; if heat is slow, without "
                                 "fluid and frictional heat, moving blocks have a cycle of heat every ten steps",
                            default="0"),
                     Option("hyd{raulic}", (ZERO_OR_MORE,), "sub-steps of a cycle of flow; 0: as many as stability "
                            "requires",
                            default="0")),
            needs_option=True, dims=BOTH, does="flow.sub_step"),
    Command("mod{el} fi{eld}", "The clock of a field that diffuses in elements, as of moisture.",
            ("pcdc model field moisture time-step 3600", "pcdc model field moisture flows off"),
            (_leading("field", choice(*kinds()), "name of the field"),),
            options=(Option("fl{ows}", (BOOL,), "off: values and the stress that they cause are frozen",
                            default="on"),
                     Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "sub-step of the field, which then has its own clock; 0: "
                            "the sub-steps of a cycle cover the time of the steps of the blocks or, without motion, "
                            "are 0.9 of the stable sub-step", "s", "0"),
                     Option("s{ub}-s{teps}", (ZERO_OR_MORE,), "sub-steps in a cycle; 0: as many as stability requires",
                            default="0"),
                     Option("c{urrent}-t{ime}", (FLOAT,), "present time of its clock", "s")),
            needs_option=True, dims=BOTH, does="fields.clock"),
    Command("mod{el} ray{leigh}", "Rayleigh damping of elements in dynamic runs, in addition to their damp-factor: "
            "alpha times the mass, beta times the stiffness. The damping ratio of a vibration is alpha / (4 pi f) + pi "
            "beta f.",
            ("pcdc model rayleigh 0.05 frequency 12", "pcdc model rayleigh 0.02 frequency 5 part stiffness",
             "pcdc model rayleigh 0"),
            (_leading("ratio", NOT_NEGATIVE, "part of the critical damping at the frequency; 0: no Rayleigh "
                                             "damping", "1"),),
            (Option("freq{uency}", (POSITIVE,), "frequency at which this ratio applies; with both parts the ratio is "
                                                "least there", "Hz"),
             Option("part", (choice("both", "mass", "stiffness"),), "both parts, or one of them", default="both")),
                    dims=BOTH, does="settings.rayleigh"),
    Command("mod{el} creep", "Switches creep of elements of mech-burgers on or off. In dynamic runs creep time passes "
            "with the time of the model. In static runs model solve time advances it in creep steps, each of which "
            "ends in equilibrium; `every` of histories and frames then counts creep steps.",
            ("pcdc model creep on dt 3600", "pcdc model creep on dt 100 change 0.05 greatest 86400",
             "pcdc model creep off"),
            (_leading("on", BOOL, "whether elements creep"),),
            (Option("dt", (POSITIVE,), "creep step of static runs; with change the first one", "s"),
             Option("cha{nge}", (PART,), "the creep step is adapted to this change of stress: the largest change of "
                    "the deviators of elements and of their Kelvin dashpots in a creep step, over the largest "
                    "deviator; the step at most halves or doubles each time", "1", "dt stays"),
             Option("least", (POSITIVE,), "with change: shortest creep step", "s", "dt / 100"),
             Option("great{est}", (POSITIVE,), "with change: longest creep step", "s", "100 dt")), dims=BOTH,
            does="settings.creep"),
)  # fmt: skip

_LENGTHS = (
    Option("spr{ead}", (NOT_NEGATIVE,), "lognormal: standard deviation", "m"),
    Option("least", (NOT_NEGATIVE,), "lower bound", "m", "0"),
    Option("great{est}", (POSITIVE,), "upper bound", "m", "none"),
)

_PLACEMENT = (
    Option("origin", (VECTOR,), "point of the section, in its units, that is moved to `to`", "", "(0,0)", dims=PLANE),
    Option("to", (VECTOR,), "position of the origin in the model", "m", "(0,0)", dims=PLANE),
    Option("line", (VECTOR, VECTOR), "two points of a map with heights, in its units: x is the distance along their "
           "line, y the height", dims=PLANE),
)  # fmt: skip

_GEOMETRY = (
    Command("geom{etry} c{reate} p{olyline}", "Straight lines from point to point.",
            ("pcdc geometry create polyline ([i],0) (0,[i]) as-layer ['line'+ str(i)]",),
            (_leading("points", VECTORS, "the points; or a list of vectors", "m"),), (_LAYER,), manual=True,
            does="shape"),
    Command("geom{etry} c{reate} polyg{on}", "A closed line; in three dimensions the plane surface inside it.",
            ("pcdc geometry create polygon (0,0) (4,0) (2,3) as-layer 'block'",),
            (_leading("points", PLACES, "the corners", "m"),), (_LAYER,), dims=BOTH,
            also=("geom{etry} c{reate} p{olyline}-c{lose}",), does="shape"),
    Command("geom{etry} c{reate} rec{tangle}", "A rectangle along the axes.",
            ("pcdc geometry create rectangle (0,0) (10,5) as-layer 'box'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the opposite corner", "m")),
            (_LAYER,), does="shape"),
    Command("geom{etry} c{reate} cir{cle}", "A circle; with segment-length a polygon of equal sides. In three "
            "dimensions the surface of a disc.",
            ("pcdc geometry create circle (0,0) 1 as-layer 'hole'",
             "pcdc geometry create circle center (0,0) radius 1 segment-length 0.1 as-layer 'hole'"),
            (_leading("centre", VECTOR, "centre", "m", False), _leading("radius", POSITIVE, "radius", "m", False)),
            (Option("c{enter}", (VECTOR,), "centre", "m"), Option("r{adius}", (POSITIVE,), "radius", "m"),
             Option("s{egment}-l{ength}", (POSITIVE,), "approximate length of the sides of a polygon", "m",
                    "a true circle", dims=PLANE),
             Option("n{ormal}", (VECTOR,), "normal of the disc, of any length", "", "(0,0,1)", dims=SPACE), _LAYER),
            dims=BOTH, does="shape"),
    Command("geom{etry} c{reate} arc", "A part of a circle, counter-clockwise.",
            ("pcdc geometry create arc (0,0) 1 0 90 as-layer 'arch'",),
            (_leading("centre", VECTOR, "centre", "m"), _leading("radius", POSITIVE, "radius", "m"),
             _leading("begin", FLOAT, "first angle", "degrees"), _leading("end", FLOAT, "last angle", "degrees")),
            (_LAYER,), does="shape"),
    Command("geom{etry} c{reate} poi{nt}", "Single points, which become points of the mesh.",
            ("pcdc geometry create point (1,1) as-layer 'gauge'",),
            (_leading("points", VECTORS, "the points", "m"),), (_LAYER,), does="shape"),
    Command("geom{etry} c{reate} frac{tures}", "A set of fractures with given statistics, as straight lines, in three "
            "dimensions discs; for mesh create crack, or mesh intersect.",
            ("pcdc geometry create fractures orientation fisher 30 spread 20 length exponential 2 p21 1.5 inside 'out' "
             "seed 7 as-layer 'set1'",),
            options=(
                Option("ori{entation}", (choice("fixed", "uniform", "normal", "fisher"), FLOAT),
                       "distribution and mean of the angle to x, counter-clockwise; in three dimensions fixed or "
                       "fisher, and the dip", "degrees", required=True,
                       more=(Option("spr{ead}", (NOT_NEGATIVE,), "uniform: half width; normal: standard deviation "
                                    "[degrees]; fisher: kappa", default="0"),
                             Option("tow{ards}", (FLOAT,), "dip direction, clockwise from y as seen from above",
                                    "degrees", "0", dims=SPACE))),
                Option("len{gth}", (choice("fixed", "exponential", "lognormal", "power"), FLOAT),
                       "distribution of the length, and its value: the length, the mean, the mean, the exponent", "m",
                       required=True, more=_LENGTHS, dims=PLANE),
                Option("rad{ius}", (choice("fixed", "exponential", "lognormal", "power"), FLOAT),
                       "distribution of the radius of discs, and its value: the radius, the mean, the mean, the "
                       "exponent", "m", required=True, more=_LENGTHS, dims=SPACE),
                Option("p10", (POSITIVE,), "density: fractures per length of a scan line", "1/m"),
                Option("p20", (POSITIVE,), "density: fractures per area", "1/m2", dims=PLANE),
                Option("p21", (POSITIVE,), "density: length of fractures per area", "1/m", dims=PLANE),
                Option("p30", (POSITIVE,), "density: fractures per volume", "1/m3", dims=SPACE),
                Option("p32", (POSITIVE,), "density: area of fractures per volume", "1/m", dims=SPACE),
                Option("scan-l{ine}", (FLOAT,), "direction of the line of p10", "degrees", "0", dims=PLANE),
                Option("scan-dir{ection}", (VECTOR,), "direction of the line of p10", "", "(0,0,1)", dims=SPACE),
                Option("reached", (), "meets p20, p21, p30 or p32 as closely as a whole number of fractures can, not "
                                      "on average"),
                Option("ends-at", (NOT_NEGATIVE,), "share of the intersections with earlier fractures at which a "
                                                   "fracture ends",
                       "1", "0", dims=PLANE),
                Option("ins{ide}", (STRING,), "the layer that bounds them", required=True),
                Option("hole", (STRING,), "no fractures inside this layer", repeated=True, dims=PLANE),
                Option("shortest", (NOT_NEGATIVE,), "shorter pieces at the boundary are omitted", "m", "0", dims=PLANE),
                Option("seed", (ZERO_OR_MORE,), "seed of the random numbers: each seed gives another "
                                                "network", required=True), _LAYER), dims=BOTH,
            does="fractures"),
    Command("geom{etry} c{reate} box", "A box along the axes.",
            ("pcdc geometry create box (0,0,0) (10,5,4) as-layer 'rock'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the opposite corner", "m")),
            (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} sph{ere}", "A sphere.", ("pcdc geometry create sphere (0,0,0) 1 as-layer 'cavity'",),
            (_leading("centre", VECTOR, "centre", "m"), _leading("radius", POSITIVE, "radius", "m")),
            (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} cyl{inder}", "A round cylinder.",
            ("pcdc geometry create cylinder (0,0,0) (0,0,0.1) 0.025 as-layer 'core'",),
            (_leading("first", VECTOR, "middle of one end", "m"),
             _leading("second", VECTOR, "middle of the other end", "m"),
             _leading("radius", POSITIVE, "radius", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} con{e}", "A round cone, or a part of one.",
            ("pcdc geometry create cone (0,0,0) (0,0,1) 0.5 0.2 as-layer 'tip'",),
            (_leading("first", VECTOR, "middle of one end", "m"),
             _leading("second", VECTOR, "middle of the other end", "m"),
             _leading("radius", NOT_NEGATIVE, "radius at the first end", "m"),
             _leading("other", NOT_NEGATIVE, "radius at the other end", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} disc", "The surface of a round disc: meshes are cut along it.",
            ("pcdc geometry create disc (0,0,0) (0,0,1) 2 as-layer 'crack'",),
            (_leading("centre", VECTOR, "centre", "m"), _leading("normal", VECTOR, "normal of any length"),
             _leading("radius", POSITIVE, "radius", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} plane", "A plane without end.",
            ("pcdc geometry create plane (0,0,1) (0,0.2,1) as-layer 'fault'",),
            (_leading("point", VECTOR, "a point of the plane", "m"),
             _leading("normal", VECTOR, "normal of any length")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} ext{rude}", "Bodies made by extruding the polygons of a layer along a vector.",
            ("pcdc geometry create extrude layer 'profile' along (0,10,0) as-layer 'slope'",),
            options=(Option("layer", (STRING,), "layer of the polygons", required=True),
                     Option("along", (VECTOR,), "the vector of extrusion", "m", required=True), _LAYER), dims=SPACE,
            does="geometry.extrude"),
    Command("geom{etry} c{reate} rev{olve}", "Bodies made by revolving the polygons of a layer about an axis in their "
            "plane.", ("pcdc geometry create revolve layer 'profile' axis (0,0,1) as-layer 'ring'",),
            options=(Option("layer", (STRING,), "layer of the polygons", required=True),
                     Option("axis", (VECTOR,), "direction of the axis", required=True),
                     Option("about", (VECTOR,), "a point of the axis", "m", "(0,0,0)"),
                     Option("angle", (POSITIVE,), "angle of revolution, right-handed, up to 360", "degrees", "360"),
                     _LAYER), dims=SPACE, does="geometry.revolve"),
    Command("geom{etry} imp{ort}", "Lines of a DXF file, or polygons and lines of a section: GeoJSON, shapefile, SVG, "
            "DXF, or an image with a legend (docs/sections.md); in three dimensions the solids of a STEP or BREP file, "
            "or what the triangles of an STL or DXF file (3DFACE) enclose.",
            ("pcdc geometry import 'slope.dxf' as-layer 'slope'",
             "pcdc geometry import 'wedge.geojson' named as-layer 'outline'",
             "pcdc geometry import 'wedge.png' legend 'wedge.txt' scale 12.5 simplify 25 named as-layer 'outline'"),
            (_leading("file", FILE, "name of the file"),),
            (_LAYER, Option("dxf-l{ayer}", (STRING,), "only this layer of the file", "", "all"),
             Option("scale", (POSITIVE,), "metres per unit of the file", "m", "the unit given in STEP, DXF and .prj "
                                                                               "files, else 1"),
             Option("named", (), "each name in the section becomes a layer, and as-layer the outline of all its "
                                 "polygons", dims=PLANE),
             *_PLACEMENT,
             Option("legend", (FILE,), "legend of an image: a file with lines of colour and name", dims=PLANE),
             Option("attribute", (STRING,), "attribute whose value is the name (GeoJSON, shapefiles)", "",
                    "name, layer, unit, formation, label or id", dims=PLANE),
             Option("simplify", (POSITIVE,), "omits points of boundaries where triangles of less than half the square "
                                             "of this length disappear", "m", "off", dims=PLANE)),
            dims=BOTH, does="geometry.import_file"),
    Command("geom{etry} transf{orm}", "Moves, turns or scales a layer.",
            ("pcdc geometry transform 'hole' rotate 30 about (0,0) move (1,0)",),
            (_leading("layer", STRING, "name of the layer"),),
            (Option("scale", (POSITIVE,), "scale factor, applied first"),
             Option("rot{ate}", (FLOAT,), "angle of rotation, applied after the scale, counter-clockwise; in three "
                                          "dimensions right-handed about the axis", "degrees"),
             Option("axis", (VECTOR,), "axis of rotation", "", "(0,0,1)", dims=SPACE),
             Option("about", (VECTOR,), "centre of scaling and rotation", "m", "the origin"),
             Option("move", (VECTOR,), "translation, applied last", "m")),
            needs_option=True, dims=BOTH, does="geometry.transform"),
    Command("geom{etry} s{cale}", "Multiplies the coordinates of layers, of all without layer; a negative factor "
            "mirrors. Round shapes need factors of equal size.",
            ("pcdc geometry scale (2,1) layer 'hole' 'slope'",),
            (_leading("factors", VECTOR, "factors along the axes, not 0"),), (_SOME_LAYERS,), dims=BOTH,
            does="geometry.scale"),
    Command("geom{etry} t{ranslate}", "Moves layers; without layer all of them.",
            ("pcdc geometry translate (10,0) layer 'hole' 'slope'",),
            (_leading("vector", VECTOR, "translation of all points", "m"),), (_SOME_LAYERS,), dims=BOTH,
            does="geometry.translate"),
    Command("geom{etry} exp{ort}", "Writes layers to a DXF, GeoJSON or CSV file under their names: in metres, or in "
            "the coordinates from which geometry import with these options makes those of the model.",
            ("pcdc geometry export 'hole' 'slope' file 'plan.dxf'",
             "pcdc geometry export 'fault' file 'fault.geojson' origin (512300,0) to (0,100)"),
            (_leading("layers", STRINGS, "names of the layers"),),
            (Option("f{ile}", (FILE,), "name of the file, in the folder of the results", required=True),
             Option("scale", (POSITIVE,), "metres per unit of the file", "m", "1"), *_PLACEMENT),
            does="geometry.export"),
    Command("geom{etry} d{elete}", "Forgets layers.", ("pcdc geometry delete 'hole'", "pcdc geometry delete 'a' 'b'"),
            (_leading("layers", STRINGS, "names of the layers"),), dims=BOTH, does="geometry.delete"),
)  # fmt: skip

_MESH = (
    Command("mesh cr{eate}", "Meshes the inside of a layer with Gmsh. Several meshes make several bodies of one model, "
            "which may touch each other.",
            ("pcdc mesh create from-layer 'out' size 0.5 refine-layer 'hole' size 0.05 hole 'hole' group 'rock'",),
            options=(
                Option("from-l{ayer}", (STRING,), "layer with the outline of the mesh", required=True),
                Option("size", (POSITIVE,), "length of edges", "m", required=True),
                Option("ref{ine}-l{ayer}", (STRING,), "smaller elements near this layer",
                       repeated=True,
                       more=(Option("size", (POSITIVE,), "length of edges there", "m", required=True),
                             Option("dist{ance}", (POSITIVE,), "distance over which the size grows to that of the "
                                                               "rest", "m",
                                    "ten times the size"))),
                Option("hole", (STRING,), "the inside of this layer stays empty", repeated=True),
                Option("reg{ion}", (STRING,), "the elements inside this layer become a group", repeated=True,
                       more=(Option("group", (STRING,), "name of the group", default="the name of the layer"),)),
                Option("emb{ed}", (STRING,), "lines that become edges of the mesh; in three dimensions surfaces, which "
                       "become faces", repeated=True),
                Option("crack", (STRING,), "lines that become edges with an initial crack; in three dimensions "
                       "surfaces", repeated=True),
                Option("bodies", (), "each body of the layer becomes a group, named as in its file, else by the layer "
                       "and its number", dims=SPACE),
                Option("type", (choice("tri", "quad"),), "triangles or quads", default="tri", dims=PLANE),
                Option("irr{egular}", (), "triangles without a pattern, since cracks follow rows of equilateral "
                                          "triangles", dims=PLANE),
                Option("smooth", (), "moves inner points to the centre of their neighbours, so that joints on all "
                       "edges carry a uniform stress equally; for triangles", dims=PLANE), _GROUP), dims=BOTH,
            does="meshes.create"),
    Command("mesh str{uctured}", "A regular mesh of a rectangle.",
            ("pcdc mesh structured (0,0) (10,5) cells 40 20 type tri diagonal both group 'base'",
             "pcdc mesh structured (0,0,0) (10,5,5) cells 20 10 10 type hex"),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the opposite corner", "m")),
            (Option("cells", (COUNT, COUNT, THIRD_COUNT), "number of cells along x and y, in three dimensions "
                    "also z", required=True),
             Option("split", (SPLIT,), "tetrahedra of each box: 5, mirrored from box to box, 6 about "
                    "a diagonal, or 12 about a point in the middle", default="6", dims=SPACE),
             Option("type", (choice("tri", "quad", "tet", "hex"),), "triangles or quads, in three dimensions "
                    "tetrahedra or hexahedra", default="tri, tet"),
             Option("diag{onal}", (choice("right", "left", "alternate", "both"),), "direction of the diagonals; "
                    "alternate: it changes from rectangle to rectangle; both: two in each rectangle",
                    default="alternate", dims=PLANE),
             Option("ratio", (POSITIVE, POSITIVE, THIRD_POSITIVE), "ratio of the size of each rectangle or box to "
                    "the previous one, along x and y (and z)", "1", "1 1"), _GROUP), dims=BOTH,
            does="meshes.grid"),
    Command("mesh equi{lateral}", "Nearly equilateral triangles in a rectangle.",
            ("pcdc mesh equilateral (0,0) (10,5) size 0.25 group 'base'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the opposite corner", "m")),
            (Option("size", (POSITIVE,), "length of edges", "m", required=True), _GROUP), does="meshes.equilateral"),
    Command("mod{el} add node", "Adds nodes for elements that follow, before the first model or condition is assigned. "
            "Their numbers follow those of the mesh.", ("pcdc model add node (0,0) (1,0) (0,1)",),
            (_leading("points", PLACES, "positions of the nodes", "m"),), dims=BOTH, does="meshes.add_nodes"),
    Command("mod{el} add element", "Adds an element by the numbers of its nodes.", ("pcdc model add element 0 1 2",),
            (Option("corners", (ZERO_OR_MORE, ZERO_OR_MORE, ZERO_OR_MORE, LAST_ID), "numbers of three or four "
                    "nodes, in three dimensions of four", required=True),), dims=BOTH, does="meshes.add_element"),
    Command("mod{el} scale", "Multiplies the coordinates of all points of the mesh, before the first model or "
            "condition is assigned.", ("pcdc model scale (1,2)",),
            (_leading("factors", VECTOR, "factors along the axes, above 0"),),
            dims=BOTH, does="meshes.scale"),
    Command("mod{el} tran{slate}", "Moves all points of the mesh, before the first model or condition is "
            "assigned.", ("pcdc model translate (10,0)",),
            (_leading("vector", VECTOR, "translation of all points", "m"),), dims=BOTH, does="meshes.translate"),
    Command("mesh imp{ort}", "A mesh of another program, for example .msh or .inp; its physical groups and sets of "
            "elements, nodes and faces become groups.",
            ("pcdc mesh import 'rock.msh'",), (_leading("file", FILE, "name of the file"),),
            (Option("group", (STRING,), "a group for all elements, in addition to those of the file",
                    more=(SET,)),
             Option("merge", (NOT_NEGATIVE,), "points nearer than this are merged", "m", "0"),
             Option("scale", (POSITIVE,), "metres per unit of the file", "m", "1")), dims=BOTH,
            also=("mod{el} imp{ort} gmsh", "mod{el} imp{ort} abaqus"), does="meshes.import_file"),
    Command("mesh int{ersect}", "Turns the joints on a layer into cracks: the edges of the mesh that lie on it.",
            ("pcdc mesh intersect layer 'fault'",),
            options=(Option("layer", (STRING,), "layer whose lines are edges of the mesh, or whose surfaces "
                            "are faces", required=True),
                     Option("follow", (), "for lines that are not edges: uses the edges that follow them "
                            "best, or the faces between elements on either side")), dims=BOTH, does="meshes.intersect"),
    Command("mesh glue", "Connects separately meshed bodies where their faces coincide; the faces become joints like "
            "those inside a body. Elements are cut at hanging nodes. With a range only faces of its elements are "
            "glued, to any others.",
            ("pcdc mesh glue", "pcdc mesh glue tolerance 1e-4 between 'lining' 'rock' set 'domain'"),
            options=(Option("tol{erance}", (POSITIVE,), "points nearer than this are merged", "m",
                            "a thousandth of the shortest edge"),
                     Option("betw{een}", (STRING, STRING), "only faces between the elements of these two groups",
                            more=(SET,))), ranged="element", dims=BOTH, also=("e{lement} glue",), does="meshes.glue"),
    Command("mesh quad{ratic}", "Turns each triangle of the mesh into an elastic six-node triangle with quadratic "
            "displacements: one over the height of a beam is enough for bending. It is stored as four connected "
            "elements; joints, contact and loads act on the halves of its sides. The mesh must have triangles only; "
            "must precede the first model or condition.", ("pcdc mesh quadratic",), does="meshes.six_nodes"),
    Command("mesh qual{ity}", "Reports the quality of the mesh: angles, sizes.", ("pcdc mesh quality",), dims=BOTH,
            does="meshes.report_quality"),
)  # fmt: skip

# ---- meshes in the words of the online commands -------------------------------------------------------------------

_SIZE = Option("m{esh}-s{ize}", (POSITIVE,), "length of edges there", "m", "the largest of the others")
_BOUNDARY = Option(
    "is-b{oundary}", (), "the piece bounds the mesh: elements outside it are removed", "", "the first piece"
)
_ARRAY = Option("a{rray}", (VECTORS,), "points; or a list of vectors", "m")
_LAYERS = Option("l{ayer}", (STRINGS,), "layers of geometry")
_ELEMENT_CREATE = (
    Command("e{lement} create b{rick}", "A regular mesh of a parallelogram, in three dimensions of a parallelepiped, "
            "by a corner and the ends of its edges there.",
            ("pcdc element create brick p0 (0,0) p1 (30,0) p2 (4,12) n 30 12 ratio 1 1.1 triangle off",
             "pcdc element create brick p0 (0,0,0) p1 (6,0,0) p2 (0,4,0) p3 (0,0,5) n 6 4 5 triangle off"),
            options=(Option("p0", (VECTOR,), "corner at which the edges begin", "m", required=True),
                     Option("p1", (VECTOR,), "end of the first edge", "m", required=True),
                     Option("p2", (VECTOR,), "end of the second edge", "m", required=True),
                     Option("p3", (VECTOR,), "end of the third edge", "m", required=True, dims=SPACE),
                     Option("n", (COUNT, COUNT, THIRD_COUNT), "elements along each edge", required=True),
                     Option("r{atio}", (POSITIVE, POSITIVE, THIRD_POSITIVE), "ratio of the size of an element to the "
                            "previous one, along each edge", "1", "1 1"),
                     Option("tri{angle}", (BOOL,), "triangles, or tetrahedra; off: quads, or hexahedra", default="on",
                            also=("tet{ra}",)), _GROUP), dims=BOTH, does="meshes.brick"),
    Command("e{lement} create geo{metry}", "Triangles inside closed lines, by Gmsh, with a mesh size for each piece. "
            "Other pieces inside become edges and points of the mesh.",
            ("pcdc element create geometry layer 'out' m-s 1.5 is-boundary layer 'fault' m-s 0.5 circle center (4,3) "
             "radius 1 m-s 0.25",),
            options=(
                Option("layer", (STRINGS,), "layers of geometry", repeated=True, more=(_SIZE, _BOUNDARY)),
                Option("cir{cle}", (), "a circle", repeated=True,
                       more=(Option("c{enter}", (VECTOR,), "centre", "m", required=True),
                             Option("r{adius}", (POSITIVE,), "radius", "m", required=True), _SIZE, _BOUNDARY)),
                Option("arc", (), "an arc, counter-clockwise", repeated=True,
                       more=(Option("c{enter}", (VECTOR,), "centre", "m", required=True),
                             Option("s{tart}-p{oint}", (VECTOR,), "start of the arc", "m", required=True),
                             Option("e{nd}-p{oint}", (VECTOR,), "end of the arc", "m", required=True), _SIZE,
                             _BOUNDARY)), _GROUP), needs_option=True, does="patch"),
    Command("e{lement} create geo{metry}-p{atch}", "Triangles inside closed lines, by Gmsh, that follow other lines "
            "and points inside.",
            ("pcdc element create geometry-patch b-c-p array (0,0) (9,0) (9,6) (0,6) m-s 1 c-polyline layer 'fault' "
             "m-s 0.4 c-point array (2,2) m-s 0.2 g-m-s 1.5",),
            options=(
                Option("b{oundary}-c{lose}-p{olyline}", (), "bounds the mesh", required=True, repeated=True,
                       more=(_ARRAY, _LAYERS, _SIZE)),
                Option("c{onstrain}-poly{line}", (), "lines that become edges", repeated=True,
                       more=(_ARRAY, _LAYERS, _SIZE)),
                Option("c{onstrain}-p{oint}", (), "points of the mesh", repeated=True, more=(_ARRAY, _LAYERS, _SIZE)),
                Option("g{lobal}-m{esh}-s{ize}", (POSITIVE,), "mesh size away from the lines and points, and for "
                       "those without a size", "m",
                       "the largest of the pieces"),
                Option("t{olerance}", (NOT_NEGATIVE,), "points nearer than this are merged", "m", "1e-4"), _GROUP),
            does="patch"),
    Command("e{lement} create geo{metry}-b{oundary}", "Triangles inside a closed line, by Gmsh, with inner lines that "
            "are holes or filled.",
            ("pcdc element create geometry-boundary boundary (0,0) (9,0) (9,6) (0,6) m-s 1 inner-boundary (3,2) (5,2) "
             "(4,4) m-s 0.4 inner-boundary (6,2) (8,2) (7,3) m-s 0.5 filled on",),
            options=(
                Option("b{oundary}", (VECTORS,), "corners of the outline; or a list of vectors", "m", required=True,
                       more=(_SIZE,)),
                Option("i{nner}-b{oundary}", (VECTORS,), "corners of a line in it", "m", repeated=True,
                       more=(_SIZE, Option("filled", (BOOL,), "elements inside; off: a hole", default="off"))),
                _GROUP), does="patch"),
    Command("e{lement} create h{ollow}-cir{cle}", "Triangles in a ring, by Gmsh.",
            ("pcdc element create hollow-circle center (0,0) radius 4 m-s 0.8 inner-radius 1 m-s 0.2",),
            options=(Option("c{enter}", (VECTOR,), "centre of both circles", "m", required=True),
                     Option("r{adius}", (POSITIVE,), "outer radius", "m", required=True, more=(_SIZE,)),
                     Option("i{nner}-r{adius}", (POSITIVE,), "radius of the hole", "m", required=True, more=(_SIZE,)),
                     _GROUP), does="patch"),
)  # fmt: skip

_DRAWN = tuple(name for name in OBJECTS if name != "faults")
"""Objects of the present model; faults are measured in frames."""
_OBJECTS = (
    _group_command("element", "e{lement}"),
    Command("e{lement} delete", "Deletes elements. Before the first model or condition is assigned, they leave the "
            "mesh and the others are renumbered; later they are excavated, as by element c-model null.",
            ("pcdc element delete range x 2 4 y 0 1",), ranged="element", dims=BOTH, does="meshes.delete"),
    Command("e{lement} from", "A mesh of another program.", ("pcdc element from",), dims=BOTH,
            refused="a mesh of another program is read by mesh import 'file' (model import gmsh or abaqus)"),
    Command("e{lement} dens{ify}", "Halves quads until they are short enough, before the first model or condition is "
            "assigned. Neighbours are divided too, so that no side has more than one hanging node; quads with a "
            "hanging node become triangles.",
            ("pcdc element densify pattern 1 1 maximum-length 0.5 0.5 range x 2 4 y 0 1",),
            options=(Option("p{attern}", (CHOSEN, CHOSEN), "1: halved along x, along y; 0: not", "", "1 1"),
                     Option("m{aximum}-l{ength}", (POSITIVE, SECOND_POSITIVE), "greatest length of sides along x and "
                            "y; one number applies to both", "m", required=True)), ranged="element",
            does="meshes.densify"),
    Command("e{lement} hide", "Hides elements from pictures and, without use-hidden, from ranges; off: shows them. "
            "They are still computed.",
            ("pcdc element hide range group 'cover'", "pcdc element hide off"),
            (_leading("hidden", BOOL, "whether the elements are hidden", required=False),), ranged="element", dims=BOTH,
            does="settings.hide"),
    _list_command("element", "e{lement}"),
    Command("e{lement} col{lision}", "Contact detection for these elements; off: others pass through them.",
            ("pcdc element collision off range group 'cover'",),
            (_leading("on", BOOL, "whether contact is detected"),), ranged="element", dims=BOTH,
            does="settings.collision"),
    Command("e{lement} w{ater}", "Water pressure on the surface of the model: depth below a water line times density "
            "and gravity, on all free faces of these elements below the line, also on parts of faces, as they move. "
            "The line runs from left to right; there is no water beyond its ends. The last command replaces "
            "earlier ones.",
            ("pcdc element water surface 'lake' density 1000", "pcdc element water surface 'lake' density 0"),
            options=(Option("s{urface}", (STRING,), "layer of the water line, in three dimensions of planes and "
                            "polygons", required=True),
                     Option("d{ensity}", (NOT_NEGATIVE,), "density of the water; 0: removes the water", "kg/m3",
                            required=True)), ranged="element", dims=BOTH, does="assignments.water"),
    Command("e{lement} c-m{odel}", "Assigns a constitutive model and its properties to elements. Fluid models apply to "
            "the joints around the elements.",
            ("pcdc element c-model mech-iso-elastic property density 2500 young 50e9 poisson-ratio 0.25",
             "pcdc element c-model null range group 'excav_1' set 'domain'",
             "pcdc element c-model mech-m-c property density 2500 young 50e9 poisson-ratio 0.25 friction 30 tensile "
             "1e5 cohesion table 'c_of_strain' over plastic-strain",
             "pcdc element c-model mech-iso-elastic property density 2600 poisson-ratio 0.25 young table 'E_of_T' over "
             "temperature",
             "pcdc element c-model therm-iso-h property conductivity 2.7 capacity 900 expansion-coeficient 1e-5",
             "pcdc element c-model user 'clay.py:clay' property density 2000 young 1e9 poisson-ratio 0.3 parameter "
             "'limit' 2e5"),
            models=(ISO_ELASTIC, NULL, MOHR_COULOMB, USER, BURGERS, ISO_HEAT, POROUS, PROPPANT, FLUID_HEAT,
                    *FIELD_MODELS.values()),
            ranged="element", manual=True,
            dims=BOTH),
    Command("e{lement} law", "Reads, checks and compiles a law of a Python file without assigning it to elements, for "
            "a script that begins with model restore. A checkpoint does not name files to execute.",
            ("pcdc element law 'clay.py:clay'",), (_LAW,), dims=BOTH, does="assignments.load_law"),
    Command("e{lement} prop{erty}", "Changes properties; the others stay.",
            ("pcdc element property young 10e9 range group 'excav_1' set 'domain'",
             "pcdc element property conductivity 3.5 range group 'salt'",
             "pcdc element property young table 'E_of_depth' over y density field 'density'"),
            options=_OF_SOLIDS, ranged="element", needs_option=True, dims=BOTH, does="heat.element_property"),
    Command("e{lement} init{ial}", "Initial stress, tension positive. Omitted components are 0, except stress-zz in "
            "the plane: Poisson's ratio times xx + yy in plane strain, 0 in plane stress. It is stored as a strain by "
            "the present moduli and is rescaled if these change later. A stress beyond the strength of the element is "
            "reported in the log.",
            ("pcdc element initial stress-xx -5e6 stress-yy -10e6",
             "pcdc element initial stress-yy 0 gradient (0,25e3)"),
            options=tuple(
                Option(f"s{{tress}}-{c}", (FLOAT,), f"stress {c}", "Pa", also=(f"s{{stress}}-{c}",),
                       more=(Option("g{radient}", (VECTOR,), "gradient, which is multiplied by the position and "
                                                             "added", "Pa/m"),))
                for c in ("xx", "yy", "xy", "zz")) + tuple(
                Option(f"s{{tress}}-{c}", (FLOAT,), f"stress {c}", "Pa", dims=SPACE, also=(f"s{{stress}}-{c}",),
                       more=(Option("g{radient}", (VECTOR,), "gradient, which is multiplied by the position and "
                                                             "added", "Pa/m"),))
                for c in ("xz", "yz")), ranged="element", needs_option=True, dims=BOTH, does="initial_stress"),
    Command("e{lement} res{et} state", "Resets the plastic state of elements; plastic strain starts at 0 again. "
            "Stresses stay. Elastic elements have no such state, and the log reports that nothing changed.",
            ("pcdc element reset state",), ranged="element", manual=True, dims=BOTH, does="settings.reset_elements"),
    Command("e{lement} res{et} k{elvin}-s{train}", "Sets the strain of the Kelvin units of creeping elements to 0. "
            "Stresses and displacements stay.", ("pcdc element reset kelvin-strain",), ranged="element",
            dims=BOTH, does="settings.reset_kelvin_strain"),
    _group_command("element-face", "e{lement}-f{ace}"),
    _list_command("element-face", "e{lement}-f{ace}"),
    Command("e{lement}-f{ace} c-m{odel}", "The contact model of surfaces.",
            ("pcdc element-face c-model contact-m-c property pen-shear 5e11 pen-normal 5e11 friction 30",),
            models=(CONTACT,), ranged="element-face", manual=True, dims=BOTH),
    Command("e{lement}-f{ace} prop{erty}", "Changes properties of contact models; the others stay.",
            ("pcdc element-face property friction 20 range geometry 'fault'",), options=_properties(CONTACT),
            ranged="element-face", needs_option=True, dims=BOTH, does="assignments.face_property"),
    Command("e{lement}-f{ace} b{oundary}", "A boundary condition of surfaces.",
            ("pcdc element-face boundary m-s-b-c stress-normal table 'blast' range geometry 'hole'",
             "pcdc element-face boundary m-s-b-c quiet on incoming-x table 'wave' range boundary y 0 0",
             "pcdc element-face boundary free-field range boundary x 0 0",
             "pcdc element-face boundary therm-c-h transfer-coeficient 25 environment-temperature 10 range boundary"),
            models=(STRESS, ABSORB, FREE_FIELD, CONST_HEAT, *FIELDS_AT_FACES.values()), ranged="element-face",
            dims=BOTH, also=("e{lement}-f{ace} b{oundary} a{pply}", "e{lement}-f{ace} a{pply}")),
    Command("e{lement}-f{ace} b{oundary} r{emove}", "Removes boundary conditions of surfaces.",
            ("pcdc element-face boundary remove range geometry 'hole'",
             "pcdc element-face boundary remove therm-c-h range geometry 'hole'"),
            options=_removed(STRESS, CONST_HEAT, *FIELDS_AT_FACES.values()), ranged="element-face", dims=BOTH,
            also=("e{lement}-f{ace} r{emove}",), does="free_faces"),
    _group_command("face-joint", "f{ace}-j{oint}"),
    _list_command("face-joint", "f{ace}-j{oint}"),
    Command("f{ace}-j{oint} c-m{odel}", "The model of the joints between elements. Joints without a model never break.",
            ("pcdc face-joint c-model c-i-c-i property friction 30 cohesion 10e6 tensile-strength 2e6 gf1 20 gf2 200",
             "pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2.2e9 viscosity 1e-6 "
             "aperature-initial 1e-5 aperature-minumum 1e-6 aperature-maximum 1e-3"),
            models=(COHESIVE, COULOMB_JOINT, BARTON_BANDIS, POROUS, PROPPANT, FLUID_HEAT), ranged="face-joint",
            dims=BOTH),
    Command("f{ace}-j{oint} prop{erty}", "Changes properties of joints that have a model; the others stay.",
            ("pcdc face-joint property tensile-strength 1e6 range geometry 'fault'",
             "pcdc face-joint property tensile-strength field 'strength' cohesion field 'strength'",
             "pcdc face-joint property aperature-initial field 'aperture' shear-dilation 5 range geometry 'fault'"),
            options=(*_OF_JOINTS, *_properties(POROUS), *_properties(FLUID_HEAT), *_properties(GRAINS)),
            ranged="face-joint", needs_option=True, dims=BOTH, does="flow.joint_property"),
    Command("f{ace}-j{oint} res{et} state", "Resets the damage of joints that are not broken. Sliding joints regain "
            "their tensile strength and cohesion but keep their slip.",
            ("pcdc face-joint reset state",), ranged="face-joint", dims=BOTH, does="settings.reset_joints"),
    _group_command("node", "n{ode}"),
    Command("n{ode} bou{ndary}", "A boundary condition of nodes.",
            ("pcdc node boundary mech-vel-b-c velocity-y -0.05 range group 'platen' set 'bc'",
             "pcdc node boundary mech-vel-b-c velocity-x function 'pump.py:wave' range x 0 0",
             "pcdc node boundary mech-m-b-c type 1 (0,0) range id 1",
             "pcdc node boundary hydra-c-f-b pressure 1e6 range group 'hole'",
             "pcdc node boundary therm-s-b-c temperature table 'heating' range geometry 'hole'",
             "pcdc node boundary therm-f-b-c temperature 20 range group 'well'"),
            models=(VELOCITY, FORCE, MOVE, FLOW_CONDITION, PROPPANT_CONDITION, TEMPERATURE, FLUID_TEMPERATURE,
                    *FIELDS_AT_NODES.values()),
            ranged="node", dims=BOTH, also=("n{ode} bou{ndary} a{pply}", "n{ode} a{pply}")),
    Command("n{ode} mech{anical}-d{amp}", "Local damping of nodes: a force against the motion, of this part of the "
            "size of the unbalanced force. Default: 0 in dynamic runs, 0.8 in static runs. It divides the stable time "
            "step by the root of 1 + damping.",
            ("pcdc node mechanical-damp local 0.3 range y 0 2",),
            options=(Option("l{ocal}", (limited(0.0, 1.0, True),), "fraction of the unbalanced force, from 0 to 1", "1",
                             required=True),),
            ranged="node", dims=BOTH, does="assignments.damp"),
    Command("n{ode} func{tion}", "Reads, checks and compiles a function of position and time in a Python file without "
            "assigning it to a condition, for a script that begins with model restore.",
            ("pcdc node function 'pump.py:wave'",), (_FUNCTION,), dims=BOTH, does="assignments.load_function"),
    Command("n{ode} bou{ndary} r{emove}", "Removes boundary conditions of nodes.",
            ("pcdc node boundary remove range group 'platen' set 'bc'",
             "pcdc node boundary remove mech-vel-b-c range group 'platen' set 'bc'"),
            options=_removed(VELOCITY, FORCE, MOVE, FLOW_CONDITION, PROPPANT_CONDITION, TEMPERATURE, FLUID_TEMPERATURE,
                             *FIELDS_AT_NODES.values()),
            ranged="node", dims=BOTH, also=("n{ode} rem{ove}",), does="free_nodes"),
    Command("n{ode} init{ial}", "Sets the present velocity or temperature of nodes.",
            ("pcdc node initial velocity (1,0) range group 'block'", "pcdc node initial temperature 20"),
            options=(Option("vel{ocity}", (VECTOR,), "velocity", "m/s"),
                     *(Option(f"vel{{ocity}}-{axis}", (FLOAT,), f"velocity along {axis}; the other components stay",
                              "m/s", dims=SPACE if axis == "z" else BOTH) for axis in "xyz"),
                     *(Option(f"f{{orce}}-{axis}", (FLOAT,), f"force along {axis} on each node from now on, as the "
                              "force condition", "N", dims=SPACE if axis == "z" else BOTH) for axis in "xyz"),
                     Option("temp{erature}", (FLOAT,), "temperature, also of the fluid at the nodes; initially 0. "
                            "Elements around the nodes are free of thermal stress at this temperature", "K"),
                     *(Option(one.name, (FLOAT,), f"{one.doc}; initially 0. Elements around the nodes are then free of "
                              "its stress", one.unit) for one in kinds().values())), ranged="node",
            needs_option=True, dims=BOTH, does="initial_nodes"),
    Command("n{ode} therm{al}-init{ialize}", "Sets the present temperature of nodes, as node initial temperature.",
            ("pcdc node thermal-initialize temperature 15 range x 0 1",),
            options=(Option("t{emperature}", (FLOAT,), "temperature, also of the fluid at the "
                                                       "nodes", "K", required=True),),
            ranged="node", dims=BOTH, does="heat.initial"),
    Command("n{ode} hydr{aulic}-init{ialize}", "Sets the present fluid of flow nodes and its temperature.",
            ("pcdc node hydraulic-initialize flow-node-saturation 0.5",),
            options=(Option("f{low}-n{ode}-s{aturation}", (limited(0.0, 1.0, True),), "filled part of the "
                            "volume", "1", also=("f{luid}-c{avity}-s{aturation}",)),
                     Option("f{low}-n{ode}-t{emperature}", (FLOAT,), "temperature of the fluid alone", "K",
                            also=("f{luid}-c{avity}-t{emperature}",))),
            ranged="node", needs_option=True, dims=BOTH, does="initial_fluid"),
    Command("n{ode} hist{ory}", "A history of the temperature of a node, or of the mean of several nodes.",
            ("pcdc node history 'gauge' thermal temperature range id 3",), (_NAME,),
            options=(Option("therm{al}", (), "a quantity of heat", required=True,
                            more=(Option("temp{erature}", (), "temperature", required=True),)), _EVERY),
            ranged="node", dims=BOTH, does="node_history"),
    Command("n{ode} re{set} vel{ocity}", "Sets all velocities to 0.", ("pcdc node reset velocity",), manual=True,
    dims=BOTH, does="settings.reset_velocity"),
    Command("n{ode} re{set} dis{placement}", "Sets all displacements to 0.", ("pcdc node reset displacement",),
            manual=True, dims=BOTH, does="settings.reset_displacement"),
    Command("flow-n{ode} init{ial}", "Sets the present fluid of the flow nodes (nodes at which a channel ends) among "
            "these nodes; channels are initially dry.", ("pcdc flow-node initial saturation 1",
                                               "pcdc flow-node initial pressure 1e6 range x 0 1"),
            options=(Option("p{ressure}", (NOT_NEGATIVE,), "filled, at this pressure", "Pa"),
                     Option("sat{uration}", (limited(0.0, 1.0, True),), "filled part of the volume", "1"),
                     Option("conc{entration}", (NOT_NEGATIVE,), "concentration of proppant in the present fluid", "1")),
            ranged="node", needs_option=True, dims=BOTH, does="flow.initial"),
    Command("well cr{eate}", "Makes a well of the flow nodes of a range: one connected volume, whose pressure is that "
            "at its highest node. Stages control it; without a stage it is shut in. Its water loads the free faces "
            "whose nodes all lie in the range.",
            ("pcdc well create 'injection' range geometry 'hole'",), (_NAME,), ranged="node", dims=BOTH,
            does="flow.well"),
    Command("well st{age}", "Appends a stage to a well; a stage without time that has begun ends now. After the last "
            "stage the well is shut in. Times of tables are those of flow.",
            ("pcdc well stage 'injection' rate 1e-4 time 60 limit 8e6", "pcdc well stage 'injection' shut-in time 600",
             "pcdc well stage 'injection' pressure table 'bottom-hole'"),
            (_NAME,),
            options=(Option("ra{te}", (TABLED,), "injected volume; negative: produced, limited to the available fluid; "
                            "in space m3/s", "m2/s"),
                     Option("pr{essure}", (TABLED,), "prescribed pressure", "Pa"),
                     Option("sh{ut}-in", (), "no flow in or out"),
                     Option("time", (POSITIVE,), "duration, in time of flow", "s", "no end"),
                     Option("lim{it}", (NOT_NEGATIVE,), "with rate: pressure above which the rate is reduced", "Pa",
                            "none")), dims=BOTH, does="stage"),
    Command("bolt cr{eate} p{olyline}", "Installs a rock bolt along these points at their present positions, at any "
            "stage of a run. It is divided at the edges of elements, or as given. Nodes follow the rock across the bar "
            "and are coupled along it by grout; under the plate in all directions. Where the rock is removed they are "
            "free. Bolts have no weight and no stiffness in bending.",
            ("pcdc bolt create polyline (0,2) (0,5) length 0.1 grout 0.5 3 plate group 'roof'",
             "pcdc bolt create polyline [points]"),
            (_leading("points", PLACES, "the points, from the head on; or a list of vectors", "m"),),
            (Option("seg{ments}", (COUNT,), "elements of each straight part"),
             Option("len{gth}", (POSITIVE,), "greatest length of an element", "m",
                    "to the edges of the elements of the mesh"),
             Option("grout", (NOT_NEGATIVE, POSITIVE), "start and end of the grout along the bolt; the rest is "
                    "free", "m", "all of it"),
             Option("plate", (), "fixes the first node to the rock by a face plate"),
             Option("group", (STRING,), "the group of its elements and nodes", "", "none",
                    more=(SET,))), dims=BOTH, does="bolts.create"),
    Command("bolt c-m{odel}", "Assigns properties to elements of bolts, from now on.",
            ("pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 tensile-yield-force 250e3 "
             "shear-stiffness-rock-bolt 1e9 grout-thickness 0.0125 cohesion-rock-grout 1.5e6 cohesion-grout-bolt 2e6 "
             "spacing 1.5 pretension-force 50e3 range group 'roof'",),
            models=(BOLT,), ranged="bolt-element", dims=BOTH,
            also=("b{olt}-e{lement} c-m{odel}", "s{upport}-e{lement} c-m{odel}")),
    Command("b{olt}-e{lement} c{reate}", "Installs rock bolts between two points, as bolt create polyline: each part "
            "of the line inside the rock becomes a bolt. With a range only in these elements.",
            ("pcdc bolt-element create (0,2) (0,5) mesh-size 0.25",),
            (_leading("first", VECTOR, "head of the bolt", "m"), _leading("second", VECTOR, "end of the bolt", "m")),
            (Option("m{esh}-s{ize}", (POSITIVE,), "greatest length of its elements", "m", "0.2"),
             Option("group", (STRING,), "the group of its elements and nodes", "", "none",
                    more=(SET,))), ranged="element", dims=BOTH, also=("s{upport}-e{lement} c{reate}",),
            does="bolts.between"),
    _group_command("bolt-element", "b{olt}-e{lement}", "s{upport}-e{lement}"),
    _group_command("bolt-node", "b{olt}-n{ode}", "s{upport}-n{ode}"),
    Command("b{olt}-n{ode} bou{ndary}", "Prescribes conditions at nodes of bolts.",
            ("pcdc bolt-node boundary b-n-c velocity-y -1e-3 range id 0",
             "pcdc bolt-node boundary b-n-f-b-c force-y -50e3 range group 'heads'"),
            models=(BOLT_VELOCITY, BOLT_FORCE), ranged="bolt-node", dims=BOTH,
            also=("b{olt}-n{ode} bou{ndary} a{pply}", "b{olt}-n{ode} a{pply}",
                  "s{upport}-n{ode} bou{ndary}", "s{upport}-n{ode} bou{ndary} a{pply}", "s{upport}-n{ode} a{pply}")),
    Command("b{olt}-n{ode} bou{ndary} r{emove}", "Removes these conditions.",
            ("pcdc bolt-node boundary remove range group 'heads'",
             "pcdc bolt-node boundary remove b-n-f-b-c range group 'heads'"),
            options=_removed(BOLT_VELOCITY, BOLT_FORCE), ranged="bolt-node", dims=BOTH,
            also=("b{olt}-n{ode} r{emove}", "s{upport}-n{ode} bou{ndary} r{emove}", "s{upport}-n{ode} r{emove}"),
            does="free_bolt_nodes"),
    Command("bolt del{ete}", "Removes elements of bolts with their part of the grout at once; without RANGE all of "
            "them. The numbers of the others stay.",
            ("pcdc bolt delete range group 'roof'",), ranged="bolt-element", dims=BOTH, does="supports.delete"),
    Command("liner cr{eate}",
            "Installs a stress-free liner on the selected free faces at their present positions, at any stage of a "
            "run. A face gets one beam, in space one triangle; liners that share a point, in space an edge, of the "
            "mesh are connected, also around a closed opening. Liners have weight but no contact: the rock of their "
            "faces loads them.",
            ("pcdc liner create group 'shotcrete' range geometry 'tunnel'", "pcdc liner create range boundary y 2 3"),
            options=(Option("group", (STRING,), "the group of its elements and nodes", "", "none",
                            more=(SET,)),), ranged="element-face", dims=BOTH, does="liners.create"),
    Command("liner c-m{odel}", "Assigns properties to elements of liners, from now on.",
            ("pcdc liner c-model beam property density 2400 young 20e9 poisson-ratio 0.2 thickness 0.2 "
             "tensile-strength 2e6 compressive-strength 25e6 normal-stiffness 1e10 shear-stiffness 1e10 "
             "bond-tensile-strength 0.5e6 bond-cohesion 1e6 bond-friction 35 range group 'shotcrete'",),
            models=(LINER,), ranged="liner-element", dims=BOTH),
    Command("liner del{ete}", "Removes elements of liners at once; without RANGE all of them. The numbers of the "
            "others stay.", ("pcdc liner delete range group 'shotcrete'",), ranged="liner-element",
            dims=BOTH, does="supports.delete"),
    _group_command("liner-element", "liner-e{lement}"),
    _group_command("liner-node", "liner-n{ode}"),
    Command("liner-n{ode} bou{ndary}", "Prescribes conditions at nodes of liners.",
            ("pcdc liner-node boundary l-n-c velocity-x 0 velocity-y 0 spin 0 range group 'footing'",
             "pcdc liner-node boundary l-n-f-b-c force-y -50e3 moment 1e3 range id 3"),
            models=(LINER_VELOCITY, LINER_FORCE), ranged="liner-node", dims=BOTH),
    Command("liner-n{ode} bou{ndary} rem{ove}", "Removes these conditions.",
            ("pcdc liner-node boundary remove range group 'footing'",), ranged="liner-node", dims=BOTH,
            does="supports.remove_conditions"),
)  # fmt: skip

_RECORDS = (
    Command("tab{le} cr{eate}", "Creates a function of time, or, for properties, of x or y; linear between points, "
            "constant before and after.",
            ("pcdc table create 'blast' values (0,0) (5e-5,-60e6) (2e-4,0)",
             "pcdc table create 'blast' values [points]",
             "pcdc table create 'E_of_depth' values (-500,60e9) (0,20e9)",
             "pcdc table create 'c_of_strain' values (0,2e6) (0.01,2e5)"),
            (_NAME,), (Option("val{ues}", (VECTORS,), "(time or coordinate, value), the first ascending", "s or m",
                              required=True),), dims=BOTH, does="assignments.table"),
    Command("tab{le}", "Creates a table from pairs of numbers. With relative-time its times count from the moment when "
            "a condition starts to use it.",
            ("pcdc table 'ramp' data 0 0, 0.1 2e6, 1 2e6", "pcdc table 'ramp' data 0 0 0.1 2e6 type relative-time"),
            (_NAME,), (Option("d{ata}", (PAIRS,), "pairs of time and value", "s"),
                       Option("t{ype}", (), "origin of the times of the table",
                              more=(Option("r{elative}-t{ime}", (), "the moment when a condition starts to use it"),
                                    Option("a{bsolute}-t{ime}", (), "the beginning of the model")))),
            needs_option=True, dims=BOTH, does="table"),
    Command("tab{le} del{ete}", "Deletes a table.", ("pcdc table delete 'blast'",), (_NAME,), dims=BOTH,
            does="assignments.remove_table"),
    Command("field cr{eate}", "Creates a random field: properties that differ between elements, faces or joints. "
            "Properties that use one field are fully correlated; another seed gives an independent field. Assigned "
            "values stay when the field is changed or deleted.",
            ("pcdc field create 'strength' weibull 5e6 4 seed 7",
             "pcdc field create 'E' lognormal 40e9 8e9 seed 3 correlation 0.02 least 10e9"),
            (_NAME,),
            (Option("wei{bull}", (POSITIVE, POSITIVE), "scale (63 % of the values are below it) and shape"),
             Option("norm{al}", (FLOAT, NOT_NEGATIVE), "mean and standard deviation"),
             Option("logn{ormal}", (POSITIVE, NOT_NEGATIVE), "mean and standard deviation of the values themselves"),
             Option("seed", (ZERO_OR_MORE,), "seed of the random numbers: each seed gives another "
                                             "field", required=True),
             Option("corr{elation}", (POSITIVE,), "correlation length; the field depends on positions, not on the "
                    "mesh", "m", "objects are independent",
                    more=(Option("cov{ariance}", (choice("exponential", "gaussian"),), "exp(-r/L), or exp(-(r/L)2), "
                                 "which is smooth", "", "exponential"),)),
             Option("least", (FLOAT,), "lower bound of the distribution", "", "none"),
             Option("great{est}", (FLOAT,), "upper bound of the distribution", "", "none")), dims=BOTH,
            does="random_field"),
    Command("field del{ete}", "Deletes a random field; assigned values stay.",
            ("pcdc field delete 'strength'",), (_NAME,), dims=BOTH, does="assignments.remove_field"),
    Command("his{tory} cr{eate}", "Records a number during the run: of one object, of those of a range or, without "
            "one, of all (sum, mean, minimum or maximum), or of the model.",
            ("pcdc history create 'load' node value reaction-y sum every 100 range group 'platen' set 'bc'",
             "pcdc history create 'gauge' element nearest (5,0) value stress-yy",
             "pcdc history create 'worst' element value stress-yy minimum every 10",
             "pcdc history create 'cracks' model value broken-joints every 100",
             "pcdc history create 'pump' well value pressure well 'injection' every 10"),
            (_NAME, _leading("object", choice(*RECORDED), "kind of the object")),
            (Option("id", (ZERO_OR_MORE,), "number of the object"),
             Option("near{est}", (VECTOR,), "the object nearest to this point", "m"),
             Option("val{ue}", (_RECORDED,), "the recorded value, see below", required=True), _EVERY,
             Option("var{iable}", (STRING,), "with law-state: the state variable of user laws"),
             Option("well", (STRING,), "name of the well, with object well"),
             *(Option(how, (), f"{what} of the values of the objects in range, or of all objects")
               for how, what in (("sum", "sum"), ("mean", "mean"), ("min{imum}", "minimum"),
                                 ("max{imum}", "maximum")))),
            ranged="any", dims=BOTH, does="history"),
    Command("his{tory} del{ete}", "Stops a history; its file stays.", ("pcdc history delete 'load'",), (_NAME,),
    dims=BOTH, does="histories.delete"),
    Command("his{tory} exp{ort}", "Writes all histories, or some, side by side as CSV.",
            ("pcdc history export 'curves.csv'",), (_leading("file", FILE, "name of the file"),),
            (Option("name{s}", (STRINGS,), "names of the histories to export", default="all"),), dims=BOTH,
            does="histories.export"),
    Command("chart cr{eate}", "A diagram.", ("pcdc chart create 'ucs' x-label 'strain' y-label 'stress [[MPa]]'",),
            (_NAME,), (Option("tit{le}", (STRING,), "title of the diagram"),
                       Option("x-l{abel}", (STRING,), "label of the x axis"),
                       Option("y-l{abel}", (STRING,), "label of the y axis")), dims=BOTH, does="charts.create"),
    Command("chart add", "A curve of two histories, or of points.",
            ("pcdc chart add 'ucs' x 'shortening' scale-x -0.01 y 'load' scale-y 2e-8 label 'sample'",
             "pcdc chart add 'ucs' values [curve] label 'exact' style points",
             "pcdc chart add 'crack' profile aperture scale-y 1e3 label 'after 10 s' range geometry 'fault'"),
            (_NAME,),
            (Option("x", (STRING,), "history along x; without it the time", default="time"),
             Option("y", (STRING,), "history along y"),
             Option("scale-x", (FLOAT,), "factor on the values", default="1"),
             Option("scale-y", (FLOAT,), "factor on the values", default="1"),
             Option("val{ues}", (VECTORS,), "points (x,y)"),
             Option("prof{ile}",
                    (choice("pressure", "saturation", "aperture", "flow-rate", "velocity", "temperature",
                            "concentration"),),
                    "present values of the fluid along the line of the joints of the range, over the distance [m] from "
                    "its left end", dims=PLANE),
             Option("lab{el}", (STRING,), "name of the curve in the legend"),
             Option("style", (choice("line", "points"),), "how it is drawn", default="line")), ranged="face-joint",
                    dims=BOTH, does="charts.add"),
    Command("chart exp{ort}", "Writes a diagram as CSV and as a figure of the same name.",
            ("pcdc chart export 'ucs' 'ucs.png'", "pcdc chart export 'ucs' 'ucs.png' cracks",
            "pcdc chart export 'slope' 'slope.png' plastic", "pcdc chart export 'crack' 'crack.png' fluid aperture"),
            (_NAME, _leading("file", FILE, "name of the figure: .png, .pdf or .svg")),
            (Option("crack{s}", (), "adds the present model, with its cracks by mode"),
             Option("plas{tic}", (), "adds the present model with contours of plastic shear strain"),
             Option("temp{erature}", (), "adds the present model with contours of temperature, and cracks"),
             Option("fl{uid}", (choice("pressure", "saturation", "aperture", "velocity", "concentration"),),
                    "adds the present model with channels coloured by this value")), dims=BOTH,
            does="charts.export"),
    Command("output vtk", "Writes frames for ParaView: now, and with every at an interval of steps.",
            ("pcdc output vtk 'blast' every 1000", "pcdc output vtk 'last'"),
            (_leading("file", FILE, "first part of the names of the files, in the folder of the results"),),
            (Option("ev{ery}", (COUNT,), "steps between two frames", "", "once, now"),
             Option("off", (), "stops the frames of this name")), dims=BOTH, also=("mod{el} exp{ort} vtk",),
            does="frames.vtk"),
    Command("output image", "Draws the present model, `<name>_<step>.png`, with any field of frames.",
            ("pcdc output image 'stress' field 'stress-yy' limits -2e6 0 colours blue-red",
             "pcdc output image 'roof.pdf' object elements field 'displacement' deformed 100 range group 'roof'",
             "pcdc output image 'flow' view 'flow.mv' title 'step {step}'"),
            (_leading("file", FILE, "first part of the name, in the folder of the results; the ending .pdf, .svg or "
                                    ".png selects the format"),),
            (Option("view", (FILE,), "view file *.mv of hpcdem view or hpcdem draw", "",
                    "everything"),
             Option("field", (STRING,), "field of the colours; hpcdem draw --list lists the fields of a frame"),
             Option("object", (choice(*_DRAWN),), "objects to which the field and the options below apply", "",
                    "the first that have the field"),
             Option("limits", (FLOAT, FLOAT), "values of the first and the last colour", "",
                    "the 1 % and 99 % quantiles of the shown values"),
             Option("full", (), "instead of limits: minimum and maximum of the shown values"),
             Option("log", (), "logarithmic colours"),
             Option("colours", (choice(*COLOURS),), "colour map of the field", default="viridis"),
             Option("opacity", (FLOAT,), "from 0 to 1", default="1"), Option("edges", (), "outlines of elements"),
             Option("size", (POSITIVE,), "factor on widths of lines", default="1"),
             Option("vectors", (STRING,), "arrows: displacement or velocity"),
             Option("arrows", (POSITIVE,), "factor on the length of the arrows", default="1"),
             Option("filter", (STRING,), "only objects that satisfy this condition, for example 'stress_yy < -1e6 and "
                                         "x > 2'"),
             Option("deformed", (FLOAT,), "factor on displacements", default="1"),
             Option("camera", (CORNER, CORNER), "lower left and upper right corner of the picture, in space along it "
                    "and up it", "m", "the model"),
             Option("eye", (EYE,), "position of the viewer: along an axis, from the right, the front and above (iso), "
                    "or in a direction", "", "'iso'", dims=SPACE),
             Option("section", (SECTION,), "a cutting plane: 'x=1.5' removes the part towards the eye, 'x<1.5' and "
                    "'x>1.5' keep one side, 'px,py,pz,nx,ny,nz' gives a point and the normal into the removed "
                    "part", "", "whole", dims=SPACE),
             Option("title", (STRING,), "title of the picture; {step} and {time} are filled in")),
            ranged="any", dims=BOTH,
            does="pictures.image"),
)  # fmt: skip

_ONLINE = (
    Command("dev{ice} l{ist}", "Reports the ranks, threads and cores of the run in the log.",
            ("pcdc device list",), dims=BOTH, does="clocks.devices"),
    Command("dev{ice} s{witch}-t{o}", "Another device.", ("pcdc device switch-to 'GPU 0'",),
            (_leading("name", STRING, "name of the device"),), dims=BOTH,
            idle="a run uses the ranks and threads given at its start (mpirun -n, -j)"),
    Command("v{iew}", "Selects what is shown.", ("pcdc view 'stress' target element name 'stress-yy'",), (_NAME,),
            options=(Option("t{arget}", (), "kind of the objects", more=tuple(
                Option(word, (), doc, more=(Option("n{ame}", (STRING,), "the field"),)) for word, doc in (
                    ("e{lement}", "elements"), ("f{ace}-j{oint}", "joints"), ("geo{metry}", "layers"),
                    ("b{olt}", "bolts"), ("f{low}-c{hannel}", "channels")))),
                     Option("u{pdate}", (), "draws the view again")),
            needs_option=True, dims=BOTH,
            idle="hpcdem view shows any field of a run while it steps; output image draws one into a file"),
    Command("b{oundary}-m{odel}", "Conditions in C# code.", ("pcdc boundary-model create s-b-c name 'a' code 'b'",),
            dims=BOTH, refused="C# code is not supported. Write a stress or velocity that depends on position and time "
            "as a Python function: element-face boundary m-s-b-c stress-normal function 'file.py:name', node boundary "
            "mech-vel-b-c velocity-x function 'file.py:name'"),
)  # fmt: skip

INSTEAD = {
    "geometry create polyline": "geometry create polygon, disc and plane",
    "geometry create rectangle": "geometry create box, and polygon for a flat one",
    "geometry create arc": "geometry create cylinder, cone and revolve",
    "geometry create point": "mesh create size and refine-layer",
    "geometry export": "output vtk for the mesh and its faces",
    "segment-length": "geometry create polygon with the corners of the circle",
    "mesh equilateral": "mesh structured type tet or hex, and mesh create",
    "element create geometry": "geometry create, and mesh create from-layer",
    "element create geometry-patch": "mesh create from-layer with embed and refine-layer",
    "element create geometry-boundary": "mesh create from-layer with hole",
    "element create hollow-circle": "mesh create from-layer with hole, of two cylinders",
    "element densify": "mesh create with refine-layer, before the mesh is made",
    "length": "radius",
    "p20": "p30",
    "p21": "p32",
    "geometry-along": "geometry-distance",
    "dip": "stress-xy, stress-xz and stress-yz",
    "profile": "history create of flow nodes, and output vtk",
    "cracks": "output image, and output vtk with the joints",
    "plastic": "output image of the field plastic_shear_strain",
    "temperature": "output image of the field temperature",
    "free-field": "quiet on at the sides, with the stress of the static stage",
}  # fmt: skip
"""Words that replace those of two dimensions in three dimensions."""

COMMANDS = (*_MODEL, *_GEOMETRY, *_MESH, *_ELEMENT_CREATE, *_OBJECTS, *_RECORDS, *_ONLINE)
PCDC = Table(COMMANDS, RANGE_TERMS)
