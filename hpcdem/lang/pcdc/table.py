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
from hpcdem.core.looks import COLOURS, OBJECTS
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
"""Words of the language that programs and functions have shorter."""
BOTH, PLANE, SPACE = (2, 3), (2,), (3,)
"""Dimensions of space in which a word is there."""


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
        """The key of its value in a statement."""
        return self.keyword.name


@dataclass(frozen=True)
class Model:
    """A constitutive model or boundary condition with its properties. number: of the manual's table; leading: values
    that come first; one_of: sets of properties of which one must be complete; any_of: at least one property must be
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
    """notation: its words; leading: values (and words in the place of values) that come first; models: one of them is
    named after the words; ranged: the objects that RANGE chooses among, "" if it takes none; needs_option: at least one
    option must be given; properties: the word ``property`` may stand before the options; manual: printed there; dims:
    as of models; also: other words for all of the notation, of the online help; idle: why it has no effect here;
    refused: why it is, and what to write instead; does: its function, as "module.name" of `hpcdem.commands.fdem`, which
    has arguments of the names of its options, or the name of a converter in bindings.py; of commands with models that
    is said by the model; fixed: more arguments of the function."""

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
    def ways(self) -> tuple[Way, ...]:
        """Its words, and others that name it."""
        return (Way(self, self.words), *(Way(self, _keywords(words), own=False) for words in self.also))

    @cached_property
    def name(self) -> str:
        """Its words in full."""
        return " ".join(word.name for word in self.words)


@dataclass(frozen=True)
class Level:
    """A word that a command may go on with."""

    keyword: Keyword


@dataclass(frozen=True)
class Way:
    """Words that name a command; own: those that it is called by here."""

    command: Command
    words: tuple[Keyword, ...]
    own: bool = True


_SPELLINGS = {
    "c-m{odel}": ("c{onstitutive}-m{odel}",), "init{ial}": ("init{ialize}",), "r{emove}": ("r{move}",),
    "p{lot}-f{requency}": ("p{lot}-f{renquency}",),
}  # fmt: skip
"""Words of commands that may be written otherwise, too."""


def _keywords(notation: str) -> tuple[Keyword, ...]:
    return tuple(Keyword(word, _SPELLINGS.get(word, ())) for word in notation.split())


def distinct(ways: Iterable[Way], depth: int) -> list[Level]:
    """The words at this place of the commands, each once."""
    return [Level(word) for word in dict.fromkeys(way.words[depth] for way in ways if len(way.words) > depth)]


@dataclass(frozen=True)
class Table:
    """All rows of a language."""

    commands: tuple[Command, ...]
    range_terms: tuple[Option, ...] = field(default=())

    @cached_property
    def ways(self) -> tuple[Way, ...]:
        """All words that name commands."""
        return tuple(way for command in self.commands for way in command.ways)

    @cached_property
    def _levels(self) -> dict[tuple[str, ...], tuple[list[Level], list[Way]]]:
        return {}

    def level(self, begun: tuple[str, ...]) -> tuple[list[Level], list[Way]]:
        """Words that may follow on these notations, and all words of commands that begin with them."""
        if begun not in self._levels:
            ways = [way for way in self.ways if tuple(w.notation for w in way.words[: len(begun)]) == begun]
            self._levels[begun] = distinct(ways, len(begun)), ways
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
    """One option for each property of a model, with its limits, unit, text and default.

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
        kind = kind if uniform else varied(kind, one.softens, one.warms)
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
    "null", "", "The elements are taken out: excavated. Faces beside them become free. Another model in a range that "
    "names them brings them back, as new material where the void is then, free of stress; they hang together with what "
    "lies around them, without joints, until face-joint c-model gives them some.",
    (Option("relax", (POSITIVE,), "what they did to the others dies down over this time (static runs: so many steps)",
            "s", "at once"),), dims=BOTH, does="assignments.null",
)  # fmt: skip
MOHR_COULOMB = Model(
    "mech{anical}-m{ohr}-c{oulomb}", "2",
    "Elastic up to the strength of Mohr and Coulomb, or in tension, then plastic, for large rotations.",
    declared(
        properties.MECH_MOHR_COULOMB, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "s{hear}", "b{ulk}", "fri{ction}",
        "coh{esion}", "ten{sile}", "di{lation}", "d{amp}-f{actor}", "pen{alty}", "d{amp}-b",
    ),
    one_of=_PAIRS, of=properties.MECH_MOHR_COULOMB, dims=BOTH, does="assignments.element_model",
)  # fmt: skip
_FUNCTION = Option("function", (FILE,), "'file.py:function', beside the script; plain text", required=True)
_LAW = Option("law", (FILE,), "'file.py:law': the file, beside the script, and the name of the law in it; plain text",
              required=True)  # fmt: skip
_PARAMETER = Option(
    "par{ameter}",
    (STRING, varied(FLOAT)),
    "a property that the law declares, by its name, and its value",
    repeated=True,
)
USER = Model(
    "user", "", "A law in a Python file of the user, see docs/user_laws.md.",
    (*declared(properties.USER, "den{sity}", "y{oung}", "p{oisson}-r{atio}", "s{hear}", "b{ulk}", "d{amp}-f{actor}",
               "fri{ction}", "pen{alty}"), _PARAMETER),
    one_of=_PAIRS, of=properties.USER, leading=(_LAW,), dims=BOTH, does="assignments.user_model",
)  # fmt: skip
BURGERS = Model(
    "mech{anical}-bur{gers}", "3",
    "Elastic in its volume, creeping in its shape after Burgers while model creep is on, for large rotations. Strain "
    "of the Kelvin unit goes with a stress that was there before.",
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
    "Heat conduction and thermal expansion. It acts beside the mechanical model of the elements, all of which need it "
    "where one has it. Heat crosses joints until they break, and from then on passes from surface to surface where "
    "they touch, with a transfer coefficient. At the temperatures of this moment elements are free of thermal stress. "
    "Temperatures are those of any scale of degrees.",
    declared(HEAT_PROPERTIES, "con{ductivity}", "cap{acity}", "t{ransfer}-c{oeficient}", "e{xpansion}-c{oeficient}",
             "conductivity-a{cross}", "conductivity-ang{le}", also=_COEFFICIENTS),
    of=HEAT_PROPERTIES, dims=BOTH, does="heat.model",
)  # fmt: skip
FIELD_MODELS = {
    one.name: Model(one.word, "", f"Diffusion of {one.doc}, beside the mechanical model of the elements, all of which "
                    "need it where one has it. It crosses joints until they break. At the values of this moment "
                    "elements are free of the stress that it brings.", declared(one.model), of=one.model, dims=BOTH,
            does="fields.model", of_field=one.name)
    for one in kinds().values()
}  # fmt: skip
"""Of fields that diffuse in elements (physics/fields.py), by their names, as the next ones."""
FIELDS_AT_NODES = {
    one.name: Model(one.on_nodes, "", f"The {one.name} of nodes; times of tables are those of the field.",
                    (Option(one.name, (TABLED,), one.doc, one.unit, required=True),), dims=BOTH,
            does="node_field", of_field=one.name, by_time=True)
    for one in kinds().values()
}  # fmt: skip
FIELDS_AT_FACES = {
    one.name: Model(
        one.on_faces, "", f"The flow of {one.name} through surfaces, which let nothing through without it. Times of "
        "tables are those of the field.",
        (Option("flux", (TABLED,), "what comes in", one.flux),
         Option("transfer", (NOT_NEGATIVE,), "what goes to the environment, over the difference to it", one.transfer,
                "that of the elements"),
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
    "Freedom of nodes. A constraint holds beside those that a node has already, and beside prescribed velocities: two "
    "directions hold it, a direction and a velocity say how fast it goes along. What contradicts is refused.",
    (Option("t{ype}", (FREEDOM, OPTIONAL_VECTOR),
            "0 free (takes constraints back), 1 held, 2 moves along the vector only, 3 (in three dimensions) across it "
            "only (type 0 and 1 take a vector and do not use it)", required=True),), dims=BOTH,
    also=("mech{anical}-m{ove}-c{onstrain}",), does="assignments.move",
)  # fmt: skip
STRESS = Model(
    "m{echanical}-s{tress}-b{oundary}-c{ondition}", "6",
    "Traction on surfaces: stress times the present normal. Tension is positive. Where it is not 0 it is the total: "
    "water before the face does not push besides.",
    (Option("s{tress}-x{x}", (TABLED,), "stress xx", "Pa", also=("x{x}",)),
     Option("s{tress}-y{y}", (TABLED,), "stress yy", "Pa", also=("y{y}",)),
     Option("s{tress}-z{z}", (TABLED,), "stress zz", "Pa", dims=SPACE, also=("z{z}",)),
     *(Option(f"s{{tress}}-{c}", (TABLED,), f"stress {c}", "Pa", dims=SPACE if "z" in c else BOTH, also=(c,))
       for c in ("xy", "xz", "yz")),
     Option("s{tress}-n{ormal}", (TABLED,), "stress along the normal, which turns with the surface; negative is "
            "pressure", "Pa", also=("n{ormal}",)),
     Option("d{ip}", (TABLED,), "shear stress along the surface, counter-clockwise about the body", "Pa", dims=PLANE),
     Option("q{uiet}", (BOOL,), "dashpots rho c_p and rho c_s, through which waves leave in dynamic runs; a stress "
            "given beside it enters as a wave of half its size"),
     Option("inc{oming}-x", (TABLED,), "velocity along x of a plane wave that comes in through quiet faces", "m/s"),
     Option("inc{oming}-y", (TABLED,), "the same along y", "m/s"),
     Option("inc{oming}-z", (TABLED,), "the same along z", "m/s", dims=SPACE)),
    any_of=True, dims=BOTH, also=("mech{anical}-s{tress}-b{oundary}-c{ondition}",), does="assignments.stress",
)  # fmt: skip
ABSORB = Model(
    "mech{anical}-abs{orb}-b{oundary}-c{ondition}", "", "Surfaces through which waves leave, as m-s-b-c quiet on.",
    (Option("n{ormal}", (TABLED,), "stress along the normal, which enters as a wave of half its size", "Pa"),
     Option("d{ip}", (TABLED,), "the same along the surface, counter-clockwise about the body", "Pa", dims=PLANE)),
    dims=BOTH, does="assignments.stress", fixed=(("quiet", True),),
)  # fmt: skip
FLOW_CONDITION = Model(
    "hydra{ulic}-c{onstant}-f{low}-b{oundary}", "11",
    "Fluid at nodes, one of the three at each; times of tables are those of flow. With a range, pressure and "
    "flow-surface wet the free faces whose nodes all lie in it: water stands before them and pushes on them, whether "
    "channels end there or not. Without a range they apply to the fluid in joints only.",
    (Option("p{ressure}", (TABLED,), "pressure, not negative", "Pa"),
     Option("f{low}-s{urface}", (LEVEL,), "level of water that stands at the nodes, against gravity, or a point of "
            "its surface: hydrostatic pressure below it; above it water can leave (seepage)", "m",
            also=("f{luid}-s{urface}",)),
     Option("f{low}-r{ate}", (TABLED,), "volume that comes in at each node; negative: is taken out, as far as there is "
            "fluid; in space m3/s", "m2/s")),
    any_of=True, dims=BOTH,
    also=("hydr{aulic}-c{onstant}-f{low}-b{oundary}", "hydra{ulic}-c{onstant}-f{luid}-b{oundary}"),
    does="flow.condition",
)  # fmt: skip
FREE_FIELD = Model(
    "free-f{ield}", "", "Vertical sides beyond which the ground goes on: a column with the elements of the side and "
    "the base of the model there, velocity or quiet faces, moves beside each, and the side has its stress and dashpots "
    "that see the difference of both motions. The nodes of the side are held by the forces that they have now, so the "
    "conditions of the static stage can go.", (), does="assignments.free_field",
)  # fmt: skip
TEMPERATURE = Model(
    "therm{al}-s{olid}-b{oundary}-c{ondition}", "14", "Temperature of nodes; times of tables are those of heat.",
    (Option("t{emperature}", (TABLED,), "temperature", "K", required=True, also=("t{mperature}",)),), dims=BOTH,
    also=("therm{al}-n{ode}-b{oundary}-c{ondition}",), does="heat.condition", by_time=True,
)  # fmt: skip
FLUID_TEMPERATURE = Model(
    "therm{al}-f{low}-b{oundary}-c{ondition}", "15", "Temperature of the fluid at flow nodes, as of what is injected "
    "there; times of tables are those of heat.",
    (Option("t{emperature}", (TABLED,), "temperature", "K", required=True, also=("t{mperature}",)),), dims=BOTH,
    also=("therm{al}-c{avity}-b{oundary}-c{ondition}",), does="heat.fluid_condition", by_time=True,
)  # fmt: skip
PROPPANT_CONDITION = Model(
    "hydra{ulic}-p{roppant}-b{oundary}", "18", "Proppant that comes in at flow nodes, of wells too, one of these; "
    "times of tables are those of flow. A node that is packed takes none.",
    (Option("p{roppant}-v{olumetric}-c{oncentration}", (TABLED,), "concentration of the slurry that conditions and "
            "wells bring: volume of grains over that of the slurry", "1"),
     Option("p{roppant}-v{olumetric}-f{low}-r{ate}", (TABLED,), "volume of grains that comes in at each node, in the "
            "slurry that is there; in space m3/s", "m2/s")),
    any_of=True, dims=BOTH, does="flow.proppant_condition", by_time=True,
)  # fmt: skip
CONST_HEAT = Model(
    "therm{al}-c{onst}-h{eat}", "16",
    "Heat through surfaces, which are adiabatic without it; faces that are inside begin with it when they are free. "
    "Times of tables are those of heat.",
    (Option("h{eat}-f{lux}", (TABLED,), "heat that comes in", "W/m2"),
     Option("t{ransfer}-c{oeficient}", (NOT_NEGATIVE,), "heat transfer to the environment", "W/(m2 K)",
            "that of the elements",
            also=(*_COEFFICIENTS["transfer-coeficient"], "h{eat}-t{ransfer}-c{oefficent}")),
     Option("e{nvironment}-t{emperature}", (TABLED,), "temperature of the environment", "K")), any_of=True, dims=BOTH,
     does="heat.face_condition", by_time=True,
)  # fmt: skip

# ---- contact and joints (tables 8, 9, 10, 13, 17) ------------------------------------------------------------------

CONTACT = Model(
    "c{ontact}-m{ohr}-c{oulomb}", "8",
    "Contact of surfaces: potential of the overlap, Coulomb friction. Of two surfaces the smaller value counts.",
    declared(properties.CONTACT_MOHR_COULOMB, "f{riction}", "p{enalty}-n{ormal}", "p{enalty}-s{hear}", "d{amping}-t",
             "d{amping}-b", "d{amping}-r{atio}", also={"penalty-normal": ("n{ormal}-s{tiffness}",),
                                                       "penalty-shear": ("s{hear}-s{tiffness}",)})
    + (Option("c{ohesion}", (NOT_NEGATIVE,), "surfaces that touch have none", "Pa", "0", refused="surfaces that touch "
              "have friction and no cohesion; joints have it until they break: face-joint c-model c-i-c-i cohesion"),),
    of=properties.CONTACT_MOHR_COULOMB, dims=BOTH, does="assignments.face_model",
)  # fmt: skip
COHESIVE = Model(
    "c{lassic}-i{ntrinsic}-c{ohesive}-i{nterface}", "9",
    "Cohesive joints between elements: they hold up to their strength, soften, break, and are contacts from then on.",
    (*declared(properties.COHESIVE, "f{riction}", "c{ohesion}", "t{ensile}-s{trength}", "gf1", "gf2",
               "p{enalty}-o{verlay}", "p{enalty}-n{ormal}", "p{enalty}-s{hear}",
               also={"penalty-overlay": ("p{enalty}-o{verlap}",)}),
     Option("np", (POINTS,), "integration points", "1", "3")),
    of=properties.COHESIVE, dims=BOTH, does="assignments.joint_model",
)  # fmt: skip
COULOMB_JOINT = Model(
    "j{oint}-m{ohr}-c{oulomb}", "",
    "Joints that were there before, as springs: sigma = normal-stiffness opening, tau = shear-stiffness slip, at most "
    "cohesion - sigma tan friction. They slide, open and close and never break. A point that opens against its tensile "
    "strength loses that and its cohesion.",
    declared(properties.COULOMB_JOINT, "n{ormal}-s{tiffness}", "s{hear}-s{tiffness}", "f{riction}", "c{ohesion}",
             "t{ensile}-s{trength}", "dil{ation}", "dil{ation}-l{imit}"),
    of=properties.COULOMB_JOINT, dims=BOTH, does="assignments.joint_model",
)  # fmt: skip
BARTON_BANDIS = Model(
    "j{oint}-b{arton}-b{andis}", "",
    "Rough joints that were there before: closure v under the pressure normal-stiffness v / (1 - v / closure-maximum), "
    "from the pressure jcs on along the tangent; shear strength by the angle residual-friction + m jrc "
    "log10(jcs / pressure), at most 70 degrees, m: roughness that is mobilised or worn, by the path over "
    "joint-size / 500 (jrc / joint-size)^0.33; dilation by dilation-part of the part with m. They slide, open and "
    "close and never break.",
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
    "its mean opening, within the limits. It acts beside the mechanical model of the joint. Given again, fluid that "
    "has no room any more is gone, and new room is dry. In space channels are the triangles of the joints.",
    _POROUS, of=POROUS_PROPERTIES, dims=BOTH, does="flow.model", ranged=JOINT,
)  # fmt: skip
FLUID_HEAT = Model(
    "t{hermal}-f{luid}", "13",
    "Heat in the fluid of joints with a hydraulic model, all of which need it where one has it, beside heat in the "
    "elements. Fluid that has none yet has the temperature of the rock beside it. What comes in has the temperature of "
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
    "Fluid in joints that carries proppant, one kind in all channels. Grains move with the slurry, make it heavier and "
    "more viscous, settle, and bridge where it is narrow. A node that is filled to the limit is a pack: no grains pass "
    "it, fluid does, and the walls lean on it.",
    (*_POROUS, *_GRAINS), of=MEDIUM_PROPERTIES, dims=BOTH, does="flow.with_proppant", ranged=JOINT,
)  # fmt: skip

# ---- bolts (tables 19 to 21) ---------------------------------------------------------------------------------------

BOLT = Model(
    "mech{anical}-e{lastic}-p{lastic}", "19",
    "Bars with one force along them, elastic and perfectly plastic, in grout that slips at its strength. Forces and "
    "stiffness are those of one bolt; the model divides them by the spacing. The strength of the grout per length is "
    "the smaller of pi (diameter + 2 grout-thickness) (cohesion-rock-grout - sigma tan friction-rock-grout) and pi "
    "diameter (cohesion-grout-bolt - sigma tan friction-grout-bolt), sigma: stress across the bar in the rock if it is "
    "pressure, in space the mean in all directions across. Given again, the force in the bar stays, but for the "
    "difference of the pretension. In space each bolt is there by itself: spacing is 1.",
    declared(
        BOLT_PROPERTIES, "den{sity}", "y{oung}", "d{iameter}", "t{ensile}-y{ield}-f{orce}",
        "c{ompressive}-y{ield}-f{orce}", "t{ension}-f{ailure}-s{train}", "s{hear}-s{tiffness}-r{ock}-b{olt}",
        "g{rout}-t{hickness}", "c{ohesion}-r{ock}-g{rout}", "c{ohesion}-g{rout}-b{olt}", "f{riction}-r{ock}-g{rout}",
        "f{riction}-g{rout}-b{olt}", "spac{ing}", "pre{tension}-f{orce}", "d{amp}-f{actor}", uniform=True,
    ),
    of=BOLT_PROPERTIES, dims=BOTH, does="supports.assign",
)  # fmt: skip
BOLT_VELOCITY = Model(
    "b{olt}-n{ode}-c{onstrain}", "20", "Velocity or acceleration of nodes of bolts. Components that are not given stay "
    "free: along the bar by its forces, across it with the rock.", VELOCITY.options, any_of=True, dims=BOTH,
    also=("s{upport}-n{ode}-c{onstrain}",), does="bolts.velocity",
)  # fmt: skip
BOLT_FORCE = Model(
    "b{olt}-n{ode}-f{orce}-b{oundary}-c{ondition}", "21", "Force on each node of one bolt; across the bar the rock "
    "takes it.", FORCE.options, any_of=True, dims=BOTH,
    also=("b{olt}-n{ode}-f{orce}-b{oundary}-c{onditio}", "s{upport}-n{ode}-f{orce}-b{oundary}-c{onditio}"),
    does="bolts.force",
)  # fmt: skip

# ---- liners, beyond the manual -------------------------------------------------------------------------------------

LINER = Model(
    "beam", "",
    "In the plane beams in plane strain, of a metre of its thickness, elastic and perfectly plastic. Either a shell of "
    "a thickness, or steel sets by area and inertia over their spacing, with poisson-ratio 0. The axial force is held "
    "between the strengths times the area, the moment below 4 plastic-moment (Nt - N) (N + Nc) / (Nt + Nc)^2: what a "
    "rectangle bears that is plastic all over. In space flat shells of a thickness, whose forces and moments are held "
    "so in their principal directions. The bond to the rock is elastic, slips at bond-cohesion + pressure "
    "tan(bond-friction), and parts for good above bond-tensile-strength. Given again, what elements carry stays.",
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
    "l{iner}-n{ode}-f{orce}-b{oundary}-c{ondition}", "", "Force and moment on each node of a liner, in the plane "
    "of a metre of thickness.",
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
    Option("not", (), "the term that follows does not hold"),
    Option("in-c{ircle}", (OPTIONAL_VECTOR, OPTIONAL_FLOAT), "all its points lie in the circle, in space the sphere, "
           "about a centre and of a radius; elements: their centre; in the mesh", "m",
           more=(Option("c{enter}", (VECTOR,), "the centre", "m"), Option("rad{ius}", (POSITIVE,), "the radius", "m"))),
    Option("geom{etry}", (STRING,), "lies on the lines, in three dimensions on the surfaces, of the geometry layer; "
           "elements: their centre is inside of it; in the mesh", only=("element", *_FACES)),
    Option("geom{etry}-a{long}", (STRING,), "lies along the lines, in space the surfaces, of the layer: within a "
           "distance of them and at an angle to them; elements and nodes by the distance; in the mesh",
           only=("element", *_FACES),
           more=(Option("dis{tance}-offset", (NOT_NEGATIVE,), "distance of its points at most", "m", "0"),
                 Option("ang{le}-offset", (NOT_NEGATIVE,), "angle at most", "degrees", "0"))),
    Option("geom{etry}-d{istance}", (STRING,), "all its points are near the lines, in space the surfaces, of the "
           "layer; elements: their centre; in the mesh", only=("element", *_FACES),
           more=(Option("within", (NOT_NEGATIVE,), "distance at most", "m", "0"),)),
    Option("geom{etry}-l{ocation}", (STRING,), "a ray from its middle crosses the lines of the layer an odd or an "
           "even number of times, as count is, and at least so often: with 1 what is inside; in the mesh",
           only=("element", *_FACES), dims=PLANE,
           more=(Option("ray-dir{ection}", (VECTOR,), "of the ray", "", "(1,0)"),
                 Option("count", (ZERO_OR_MORE,), "crossings", "1", "1"))),
    Option("pres{ent}", (), "x, y and geometry (of elements) look at where things are at this moment"),
    Option("use-hidden", (BOOL,), "elements that are hidden, and what belongs to them, are chosen too", default="off"),
    Option("boundary", (), "lies on a surface of the model", only=("element-face", "node")),
    Option("face-of", (STRING,), "faces, joints or nodes of the elements of the group; joints: both elements are in "
           "it; nodes: where elements may part, on their side", more=(SET,), only=_FACES),
    Option("e{lement}", (FIRST_ID, LAST_ID), "faces or nodes of the element, or of those from first to last; without "
           "a number of any", only=("element", "element-face", "node")),
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
"""What a history can follow, and its unit."""
_RECORDED = choice(*dict.fromkeys(name for of in RECORDED.values() for name in of))
_EVERY = Option("ev{ery}", (COUNT,), "steps between two records", "", "1")


def _leading(name: str, kind: Kind, doc: str, unit: str = "", required: bool = True) -> Option:
    return Option(name, (kind,), doc, unit, required=required)


def _removed(*conditions: Model) -> tuple[Option, ...]:
    """Which conditions are taken back; none that is named: all."""
    return tuple(Option(one.notation, (), "only this condition", also=one.also, dims=one.dims) for one in conditions)


def _group_command(kind: str, notation: str, also: str = "") -> Command:
    return Command(
        f"{notation} g{{roup}}", f"Puts {kind}s into a group; each is in one group of a set at most, and leaves the "
        "one it was in.", (f"pcdc {kind} group 'top' set 'bc' range y 9.9 10.1",),
        (_leading("group", STRING, "name of the group"),), (SET,), ranged=kind, dims=BOTH,
        also=(f"{also} g{{roup}}",) if also else (), does="assignments.group",
    )  # fmt: skip


def _list_command(kind: str, notation: str) -> Command:
    return Command(
        f"{notation} l{{ist}} sum{{mary}}", f"Says in the log how many {kind}s there are, by model and group.",
        (f"pcdc {kind} list summary range x 0 5",), ranged=kind, dims=BOTH, also=(f"{notation} l{{ist}}",),
        does="summary.listed",
    )  # fmt: skip


def _properties(model: Model) -> tuple[Option, ...]:
    """Those of a model, none of them compulsory, for commands that change some."""
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
    ("p{roppant}-t{ransport}", "proppant, which has the clock of the fluid"),
)  # fmt: skip
_STEPS = (
    Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "time step", "s"),
    Option("c{ycle}-n{umber}", (COUNT,), "steps in a cycle"),
)  # fmt: skip
_CLOCKS = (
    Option("s{tart}-t{ime}", (FLOAT,), "time from which model run-time counts", "s"),
    Option("c{urrent}-t{ime}", (FLOAT,), "what the clock shows now", "s"),
    Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "time step", "s"),
)  # fmt: skip
_WINDOW = "hpcdem view shows a run while it steps, at its own pace"

_MODEL = (
    Command("mod{el} new", "A new model: nothing of the one before is kept, except variables of Python.",
            ("pcdc model new", "pcdc model new dim 3"),
            options=(Option("dim", (DIMENSIONS,), "dimensions of space; in three not everything is there, see "
                            "the end of the reference", "", "2"),), manual=True, dims=BOTH, does="settings.new"),
    Command("mod{el} sav{e}", "The whole state to a file: mesh, models, motion, cracks, histories; and the variables "
            "and functions of Python whose names begin with m_.", ("pcdc model save 'test.sav'",),
            (_leading("file", FILE, "name of the file, beside the script"),), manual=True, dims=BOTH,
            does="checkpoints.save"),
    Command("mod{el} rest{ore}", "The state of a file, and its m_ variables and functions.",
            ("pcdc model restore 'test.sav'",), (_leading("file", FILE, "name of the file"),), manual=True, dims=BOTH,
            does="restore"),
    Command("mod{el} g{ravity}", "Gravity from now on.", ("pcdc model gravity (0,-9.81)",),
            (_leading("gravity", VECTOR, "acceleration", "m/s2"),), dims=BOTH, does="settings.gravity"),
    Command("mod{el} units", "The units of all values that follow: those that are unlikely in them are warned of, once "
            "per property and with the factor that looks missing; histories and charts are labelled with them. No "
            "value is changed.", ("pcdc model units SI", "pcdc model units mm-MPa-s"),
            (_leading("system", choice(*UNITS), ", ".join(UNITS.values())),), dims=BOTH, does="settings.units"),
    Command("mod{el} opt{ion}", "Switches of the calculation.",
            ("pcdc model option dynamic off", "pcdc model option collision on"),
            options=(
                Option("dyn{amic}", (BOOL,), "true motion in time; off: static, towards equilibrium", default="on"),
                Option("col{lision}", (OPTIONAL_BOOL,), "contact of surfaces", default="on"),
                Option("ecda", (BOOL,), "on: joints that are whole are no contacts besides; nothing else is there, so "
                       "off is refused", default="on"),
                Option("cr{eep}", (BOOL,), "as model creep", default="off"),
                Option("over{lap}", (choice("refuse", "relax", "keep"),), "of bodies that overlap before the first "
                       "step: refuse it, with the places; let a static stage move them apart; or start as they are",
                       default="refuse"),
                Option("deep-o{verlap}", (choice("warn", "stop"),), "of bodies that come to overlap by more than a "
                       "tenth of an altitude of an element: say where, or end the run there", default="warn"),
                Option("pot{ential}", (choice("distance", "munjiza"),), "what contact presses with: the distance to "
                       "the nearest side of an element over the usual altitude in its body, or four times the smallest "
                       "of its barycentric coordinates", default="distance", dims=SPACE),
                Option("mech{anical}", (BOOL,), "motion of blocks; off: they stand still while fluid or heat flows",
                       default="on"),
                Option("large-s{train}", (BOOL,), "rotations of elements are taken into account", default="on"),
                Option("en{ergy}", (BOOL,), "keep the energy budget from here on, in dynamic runs: `pcdc.energies`, "
                       "histories of the model, a table at the end", default="off"),
                Option("hyd{raulic}", (BOOL,), "flow of fluid in joints that have a hydraulic model; off: pressures "
                       "stay as they are and go on pushing, so that blocks come to rest at them", default="on"),
                Option("one-way", (BOOL,), "fluid follows the blocks, but does not push on them", default="off"),
                Option("therm{al}", (BOOL,), "heat flows in elements that have a thermal model; off: temperatures, and "
                       "the stress that they bring, stay as they are", default="on"),
                Option("prop{pant}", (BOOL,), "grains move in the fluid of channels that carry them; off: they stay "
                       "where they are", default="on", also=("p{roppant}-t{ransport}",))),
            needs_option=True, manual=True, dims=BOTH, also=("mod{el}",), does="option"),
    Command("mod{el} t{ime}-s{tep}", "The time step of dynamic runs. In static runs a step is one unit of time. "
            "Without this command it is estimated at the first step and after each change of the model. Of value, "
            "mass-scaling and auto on the one said last holds and ends the others.",
            ("pcdc model time-step auto off", "pcdc model time-step 1e-7", "pcdc model time-step value 0",
             "pcdc model time-step table 'dt'", "pcdc model time-step auto update-frequency 20"),
            (_leading("value", TABLED_STEP, "as the word value", "s", False),),
            (
                Option("value", (TABLED_STEP,), "the time step itself; 0: estimated again; a table over the time is "
                       "looked at every 100 steps", "s"),
                Option("auto", (OPTIONAL_BOOL,), "on: estimated again every 100 steps; off: at the first step and "
                       "after changes of the model only; a value stays", default="off"),
                Option("u{pdate}-f{requency}", (COUNT,), "with auto: steps after which it is estimated again",
                       default="100"),
                Option("safe{ty}", (PART,), "part of the stability limit that is taken, by estimates and mass-scaling",
                       "1", "0.8"),
                Option("mass-s{caling}", (NOT_NEGATIVE,), "nodes get as much mass as this time step needs; 0: none, "
                       "and the step is estimated again", "s"),
                Option("hyd{raulic}", (NOT_NEGATIVE,), "sub-step of flow, which then has a clock of its own; 0: those "
                       "of a cycle take the time of the steps of the blocks, or without motion half of what is stable",
                       "s", "0"),
                Option("therm{al}", (NOT_NEGATIVE,), "sub-step of heat, which then has a clock of its own; 0: those of "
                       "a cycle take the time of the steps of the blocks, or without motion 0.9 of what is stable", "s",
                       "0")),
            needs_option=True, manual=True, dims=BOTH, does="settings.time_step"),
    Command("mod{el} step", "So many steps.", ("pcdc model step 1000",),
            (_leading("steps", ZERO_OR_MORE, "number of steps"),), dims=BOTH, does="steps.step"),
    Command("mod{el} sol{ve}", "Steps until the first of ratio, cycles, time and run-time is reached. Without any of "
            "them it is ratio 1e-5 or 10 000 cycles; a warning says if it was the cycles. With elastic: "
            "straight to static equilibrium by Newton's method, for blocks that are elastic or yield, whose joints "
            "stay before their peak and whose surfaces do not touch. A run towards a ratio that gets nowhere (window, "
            "limit) ends the script with exit code 3 and names the body that slides away; `pcdc.solved['reason']` says "
            "how a run ended.",
            ("pcdc model solve ratio 1e-6", "pcdc model solve time 0.05", "pcdc model solve elastic time 1e6",
             "pcdc model solve elastic steps 10", "pcdc model solve hydraulic time 5 dt 0.01",
             "pcdc model solve hydraulic steady", "pcdc model solve hydraulic auto time 3600",
             "pcdc model solve thermal time 3e7 dt 1e5", "pcdc model solve thermal steady",
             "pcdc model solve ratio 1e-6 limit 200000 on-failure continue"),
            options=(Option("r{atio}", (POSITIVE,), "unbalanced over all forces of the nodes; with elastic: 1e-8, and "
                            "as far below as rounding allows", "1"),
                     Option("c{ycles}", (COUNT,), "steps; with elastic: units of time (1) for which prescribed "
                            "velocities act"),
                     Option("t{ime}", (POSITIVE,), "time that passes; in static runs creep time, each creep step to "
                            "its ratio (1e-5), or with elastic at once", "s"),
                     Option("r{un}-t{ime}", (POSITIVE,), "as model run-time, for this command alone", "s"),
                     Option("win{dow}", (ZERO_OR_MORE,), "towards a ratio: it has failed when the least ratio has not "
                            "fallen by a tenth in so many steps, nor in as many as the progress so far took; 0: "
                            "never", default="static runs: ten times as many as a wave takes there and back, at least "
                            "20 000; dynamic ones, and beside cycles or time: 0"),
                     Option("lim{it}", (ZERO_OR_MORE,), "towards a ratio: it has failed after so many steps; 0: never",
                            default="static runs 1 000 000, dynamic ones 10 000 000; beside time: 0"),
                     Option("on-f{ailure}", (choice("stop", "continue"),), "stop: with exit code 3; continue: with a "
                            "warning, the script looks at pcdc.solved", default="stop"),
                     Option("ela{stic}", (), "at once, without steps"),
                     Option("hyd{raulic}", (), "flow by implicit steps, backward Euler, for so much time or until it "
                            "is steady; in static runs blocks are in equilibrium at the end of each step, and joints "
                            "may pass their peak and break; with mechanical off, flow alone"),
                     Option("therm{al}", (), "heat by implicit steps, backward Euler, for so much time or to its "
                            "steady state at once; in static runs blocks are in equilibrium at the end of each step, "
                            "and joints may pass their peak and break; with mechanical off, heat alone"),
                     Option("dt", (POSITIVE,), "with hydraulic or thermal: longest time step; those of flow are "
                            "shorter where joints break or no balance is found", "s", "a hundredth of the time"),
                     Option("auto", (), "with hydraulic and time: by explicit steps, as without the word hydraulic, "
                            "where an estimate says that these cost less, or where implicit ones are refused; the log "
                            "has both estimates"),
                     Option("stea{dy}", (), "with hydraulic or thermal: until as much flows out as in; no time "
                            "passes"),
                     Option("solver", (choice("auto", "direct", "petsc"),), "with elastic, hydraulic or thermal: "
                            "SciPy on one rank, the same bits on any number of ranks; PETSc on all; auto: PETSc, if "
                            "it is there, from 400 000 unknowns on, in space from 20 000", default="auto"),
                     Option("ste{ps}", (COUNT,), "with elastic: what is new in the loads is brought on in so many "
                            "equal increments, in each of which elements flow once; one that finds no balance is "
                            "halved", "", "1")), dims=BOTH, does="solve"),
    Command("mod{el} r{un}-t{ime}", "The time that model solve takes at most from now on, from its beginning or from "
            "the start-time of model reset; without another aim each model solve goes on for it. In static runs "
            "without creep no time passes.", ("pcdc model run-time 0.1", "pcdc model run-time 0"),
            (_leading("time", NOT_NEGATIVE, "0: no end any more", "s"),), dims=BOTH, does="clocks.run_time"),
    Command("mod{el} s{olve}-c{heck}", "Steps between two looks at the ratio in model solve.",
            ("pcdc model solve-check 10",), (_leading("steps", COUNT, "in static runs 50, in dynamic ones 100 without "
                                                      "this command"),), dims=BOTH, does="clocks.solve_check"),
    Command("mod{el} c{ycle}-o{ption}", "Time step and number of steps of each part in a cycle of a coupled "
            "calculation: those of the blocks as model time-step value and model sub-step mechanical, those of fluid "
            "and heat as model time-step and model sub-step with these words. Proppant moves with the fluid, in its "
            "steps.", ("pcdc model cycle-option mechanical cycle-number 20 hydraulic time-step 0.5 cycle-number 4",),
            options=tuple(Option(word, (), f"of {what}", more=_STEPS) for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.cycle_option"),
    Command("mod{el} reset", "Sets the clocks of the parts. Tables of conditions, stages of wells and leak-off go by "
            "them.", ("pcdc model reset mechanical current-time 0", "pcdc model reset hydraulic current-time 0 "
                      "time-step 0.5"),
            options=tuple(Option(word, (), f"of {what}", more=_CLOCKS) for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.reset"),
    Command("mod{el} query", "Says in the log what time a part has come to, and its time step.",
            ("pcdc model query mechanical time",),
            options=tuple(Option(word, (), f"of {what}", more=(Option("t{ime}", (), "its clock", required=True),))
                          for word, what in _PARTS),
            needs_option=True, dims=BOTH, does="clocks.query"),
    Command("mod{el} pl{ane}-strain", "Nothing moves across the plane. Models of the plane are in plane strain unless "
            "model plane-stress says otherwise; it takes that back.", ("pcdc model plane-strain",),
            does="settings.option", fixed=(("plane_stress", False),)),
    Command("mod{el} pl{ane}-stress", "The model is a plate of a metre of thickness whose two faces bear nothing: the "
            "stress across the plane is 0, in elements that are elastic, yield or creep, and with heat. It comes "
            "before element initial and before the first step. A law of the user must give 0 for that stress itself.",
            ("pcdc model plane-stress",), does="settings.option", fixed=(("plane_stress", True),)),
    Command("mod{el} p{lot}-f{requency}", "Steps between two pictures of the window.", ("pcdc model p-f 10",),
            (_leading("steps", COUNT, "steps"),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} r{ender}-i{nterval}", "The same.", ("pcdc model render-interval 10",),
            (_leading("steps", COUNT, "steps"),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} r{ender}-a{uto}", "The same by itself.", ("pcdc model render-auto",),
            (_leading("on", BOOL, "whether it is", required=False),), dims=BOTH, idle=_WINDOW),
    Command("mod{el} c{ollision}-d{etect}", "How contacts are searched.", ("pcdc model collision-detect bvh",),
            options=tuple(Option(word, (), doc) for word, doc in (
                ("bvh", "by a tree of boxes"), ("sap", "along an axis"), ("unif{orm}", "by cells"),
                ("unform", "by cells, too"), ("b{roken}-j{oint}-p{air}", "between broken faces"))),
            needs_option=True, dims=BOTH, idle="there is one search, which finds every contact in time"),
    Command("mod{el} c{ollision}-c{ompute}", "How the force of a contact is computed.",
            ("pcdc model collision-compute accurate",),
            options=(Option("accurate", (), "over the overlap"), Option("iterate", (), "step by step")),
            needs_option=True, dims=BOTH, idle="the force of a contact is always that over its whole overlap"),
    Command("mod{el} sub-s{tep}", "Steps of the parts of a coupled calculation.",
            ("pcdc model sub-step mechanical 10 hydraulic 5", "pcdc model sub-step mechanical 100 thermal 1"),
            options=(Option("mech{anical}", (COUNT,), "steps of the blocks between two cycles of flow, and of heat",
                            default="1"),
                     Option("therm{al}", (ZERO_OR_MORE,),
                            "sub-steps of a cycle of heat; 0: as many as are stable, and where heat is that slow, "
                            "without fluid or friction, a cycle every ten steps of blocks in motion",
                            default="0"),
                     Option("hyd{raulic}", (ZERO_OR_MORE,), "sub-steps of a cycle of flow; 0: as many as are stable",
                            default="0")),
            needs_option=True, dims=BOTH, does="flow.sub_step"),
    Command("mod{el} fi{eld}", "The clock of a field that diffuses in elements, as of moisture.",
            ("pcdc model field moisture time-step 3600", "pcdc model field moisture flows off"),
            (_leading("field", choice(*kinds()), "its name"),),
            options=(Option("fl{ows}", (BOOL,), "off: values, and the stress that they bring, stay as they are",
                            default="on"),
                     Option("t{ime}-s{tep}", (NOT_NEGATIVE,), "sub-step of the field, which then has a clock of its "
                            "own; 0: those of a cycle take the time of the steps of the blocks, or without motion 0.9 "
                            "of what is stable", "s", "0"),
                     Option("s{ub}-s{teps}", (ZERO_OR_MORE,), "in a cycle; 0: as many as are stable", default="0"),
                     Option("c{urrent}-t{ime}", (FLOAT,), "what its clock shows now", "s")),
            needs_option=True, dims=BOTH, does="fields.clock"),
    Command("mod{el} ray{leigh}", "Rayleigh damping of elements in dynamic runs, beside that of their damp-factor: "
            "alpha times the mass, beta times the stiffness. The damping ratio of a vibration is alpha / (4 pi f) + "
            "pi beta f.",
            ("pcdc model rayleigh 0.05 frequency 12", "pcdc model rayleigh 0.02 frequency 5 part stiffness",
             "pcdc model rayleigh 0"),
            (_leading("ratio", NOT_NEGATIVE, "part of the critical damping at the frequency; 0: none any more", "1"),),
            (Option("freq{uency}", (POSITIVE,), "where the ratio is this; with both parts it is least there", "Hz"),
             Option("part", (choice("both", "mass", "stiffness"),), "both, or one of them alone", default="both")),
                    dims=BOTH, does="settings.rayleigh"),
    Command("mod{el} creep", "Elements of mech-burgers creep from now on, or no more. In dynamic runs creep time "
            "passes with the time of the model. In static runs model solve time makes it pass, in creep steps, each of "
            "which ends in balance; `every` of histories and frames then counts creep steps.",
            ("pcdc model creep on dt 3600", "pcdc model creep on dt 100 change 0.05 greatest 86400",
             "pcdc model creep off"),
            (_leading("on", BOOL, "whether they creep"),),
            (Option("dt", (POSITIVE,), "creep step of static runs; with change the first one", "s"),
             Option("cha{nge}", (PART,), "the creep step follows this change of stress: the largest of the deviators "
                    "of elements and of their Kelvin dashpots in a creep step, over the largest deviator of all; from "
                    "one to the next it halves or doubles at most", "1", "dt stays"),
             Option("least", (POSITIVE,), "with change: shortest creep step", "s", "dt / 100"),
             Option("great{est}", (POSITIVE,), "with change: longest creep step", "s", "100 dt")), dims=BOTH,
            does="settings.creep"),
)  # fmt: skip

_LENGTHS = (
    Option("spr{ead}", (NOT_NEGATIVE,), "lognormal: standard deviation", "m"),
    Option("least", (NOT_NEGATIVE,), "no shorter ones", "m", "0"),
    Option("great{est}", (POSITIVE,), "no longer ones", "m", "none"),
)

_GEOMETRY = (
    Command("geom{etry} c{reate} p{olyline}", "Straight lines from point to point.",
            ("pcdc geometry create polyline ([i],0) (0,[i]) as-layer ['line'+ str(i)]",),
            (_leading("points", VECTORS, "the points; or a list of vectors", "m"),), (_LAYER,), manual=True,
            does="shape"),
    Command("geom{etry} c{reate} polyg{on}", "A closed line; in three dimensions the flat surface within.",
            ("pcdc geometry create polygon (0,0) (4,0) (2,3) as-layer 'block'",),
            (_leading("points", PLACES, "the corners", "m"),), (_LAYER,), dims=BOTH,
            also=("geom{etry} c{reate} p{olyline}-c{lose}",), does="shape"),
    Command("geom{etry} c{reate} rec{tangle}", "A rectangle along the axes.",
            ("pcdc geometry create rectangle (0,0) (10,5) as-layer 'box'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the corner across", "m")),
            (_LAYER,), does="shape"),
    Command("geom{etry} c{reate} cir{cle}", "A circle; with segment-length a polygon of equal sides. In three "
            "dimensions the surface of a disc.",
            ("pcdc geometry create circle (0,0) 1 as-layer 'hole'",
             "pcdc geometry create circle center (0,0) radius 1 segment-length 0.1 as-layer 'hole'"),
            (_leading("centre", VECTOR, "centre", "m", False), _leading("radius", POSITIVE, "radius", "m", False)),
            (Option("c{enter}", (VECTOR,), "centre", "m"), Option("r{adius}", (POSITIVE,), "radius", "m"),
             Option("s{egment}-l{ength}", (POSITIVE,), "of its sides, about", "m", "a true circle",
                    dims=PLANE),
             Option("n{ormal}", (VECTOR,), "of the disc, of any length", "", "(0,0,1)", dims=SPACE), _LAYER),
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
                       "the same of the radius of discs", "m", required=True, more=_LENGTHS, dims=SPACE),
                Option("p10", (POSITIVE,), "density: fractures per length of a scan line", "1/m"),
                Option("p20", (POSITIVE,), "density: fractures per area", "1/m2", dims=PLANE),
                Option("p21", (POSITIVE,), "density: length of fractures per area", "1/m", dims=PLANE),
                Option("p30", (POSITIVE,), "density: fractures per volume", "1/m3", dims=SPACE),
                Option("p32", (POSITIVE,), "density: area of fractures per volume", "1/m", dims=SPACE),
                Option("scan-l{ine}", (FLOAT,), "direction of the line of p10", "degrees", "0", dims=PLANE),
                Option("scan-dir{ection}", (VECTOR,), "direction of the line of p10", "", "(0,0,1)", dims=SPACE),
                Option("reached", (), "p20 or p21, p30 or p32 is met as nearly as whole ones can, not in the mean"),
                Option("ends-at", (NOT_NEGATIVE,), "share of the crossings with earlier fractures at which one ends",
                       "1", "0", dims=PLANE),
                Option("ins{ide}", (STRING,), "the layer that bounds them", required=True),
                Option("hole", (STRING,), "none inside of this layer", repeated=True, dims=PLANE),
                Option("shortest", (NOT_NEGATIVE,), "shorter pieces at the rim are left out", "m", "0", dims=PLANE),
                Option("seed", (ZERO_OR_MORE,), "another seed, another network", required=True), _LAYER), dims=BOTH,
            does="fractures"),
    Command("geom{etry} c{reate} box", "A box along the axes.",
            ("pcdc geometry create box (0,0,0) (10,5,4) as-layer 'rock'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the corner across", "m")),
            (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} sph{ere}", "A sphere.", ("pcdc geometry create sphere (0,0,0) 1 as-layer 'cavity'",),
            (_leading("centre", VECTOR, "centre", "m"), _leading("radius", POSITIVE, "radius", "m")),
            (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} cyl{inder}", "A round cylinder.",
            ("pcdc geometry create cylinder (0,0,0) (0,0,0.1) 0.025 as-layer 'core'",),
            (_leading("first", VECTOR, "middle of one end", "m"), _leading("second", VECTOR, "of the other", "m"),
             _leading("radius", POSITIVE, "radius", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} con{e}", "A round cone, or a part of one.",
            ("pcdc geometry create cone (0,0,0) (0,0,1) 0.5 0.2 as-layer 'tip'",),
            (_leading("first", VECTOR, "middle of one end", "m"), _leading("second", VECTOR, "of the other", "m"),
             _leading("radius", NOT_NEGATIVE, "radius at the first end", "m"),
             _leading("other", NOT_NEGATIVE, "radius at the other", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} disc", "The surface of a round disc: meshes are cut along it.",
            ("pcdc geometry create disc (0,0,0) (0,0,1) 2 as-layer 'crack'",),
            (_leading("centre", VECTOR, "centre", "m"), _leading("normal", VECTOR, "normal of any length"),
             _leading("radius", POSITIVE, "radius", "m")), (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} plane", "A plane without end.",
            ("pcdc geometry create plane (0,0,1) (0,0.2,1) as-layer 'fault'",),
            (_leading("point", VECTOR, "a point of it", "m"), _leading("normal", VECTOR, "normal of any length")),
            (_LAYER,), dims=SPACE, does="shape"),
    Command("geom{etry} c{reate} ext{rude}", "The bodies that the polygons of a layer become, drawn along a way.",
            ("pcdc geometry create extrude layer 'profile' along (0,10,0) as-layer 'slope'",),
            options=(Option("layer", (STRING,), "of polygons", required=True),
                     Option("along", (VECTOR,), "the way", "m", required=True), _LAYER), dims=SPACE,
            does="geometry.extrude"),
    Command("geom{etry} c{reate} rev{olve}", "The bodies that the polygons of a layer become, turned about an axis in "
            "their plane.", ("pcdc geometry create revolve layer 'profile' axis (0,0,1) as-layer 'ring'",),
            options=(Option("layer", (STRING,), "of polygons", required=True),
                     Option("axis", (VECTOR,), "direction of the axis", required=True),
                     Option("about", (VECTOR,), "a point of it", "m", "(0,0,0)"),
                     Option("angle", (POSITIVE,), "right-handed, up to 360", "degrees", "360"), _LAYER), dims=SPACE,
            does="geometry.revolve"),
    Command("geom{etry} imp{ort}", "Lines of a DXF file; in three dimensions the solids of a STEP or BREP file, or "
            "what the triangles of an STL or DXF file (3DFACE) enclose.",
            ("pcdc geometry import 'slope.dxf' as-layer 'slope'",),
            (_leading("file", FILE, "name of the file"),),
            (_LAYER, Option("dxf-l{ayer}", (STRING,), "only this layer of the file", "", "all"),
             Option("scale", (POSITIVE,), "metres in a unit of the file", "m", "as STEP and DXF files say, else 1")),
            dims=BOTH, does="geometry.import_file"),
    Command("geom{etry} transf{orm}", "Moves, turns or scales a layer.",
            ("pcdc geometry transform 'hole' rotate 30 about (0,0) move (1,0)",),
            (_leading("layer", STRING, "name of the layer"),),
            (Option("scale", (POSITIVE,), "done first"),
             Option("rot{ate}", (FLOAT,), "then, counter-clockwise; in three dimensions right-handed about an axis",
                    "degrees"),
             Option("axis", (VECTOR,), "about which it is turned", "", "(0,0,1)", dims=SPACE),
             Option("about", (VECTOR,), "centre of both", "m", "the origin"), Option("move", (VECTOR,), "last", "m")),
            needs_option=True, dims=BOTH, does="geometry.transform"),
    Command("geom{etry} s{cale}", "Multiplies the coordinates of layers, of all without layer; a negative factor "
            "mirrors. What is round takes one size of factor only.",
            ("pcdc geometry scale (2,1) layer 'hole' 'slope'",),
            (_leading("factors", VECTOR, "along the axes, not 0"),), (_SOME_LAYERS,), dims=BOTH, does="geometry.scale"),
    Command("geom{etry} t{ranslate}", "Moves layers, all without layer.",
            ("pcdc geometry translate (10,0) layer 'hole' 'slope'",),
            (_leading("way", VECTOR, "where to", "m"),), (_SOME_LAYERS,), dims=BOTH, does="geometry.translate"),
    Command("geom{etry} exp{ort}", "Writes layers to a DXF file, in metres, each as a layer of its name.",
            ("pcdc geometry export 'hole' 'slope' file 'plan.dxf'",),
            (_leading("layers", STRINGS, "names of the layers"),),
            (Option("f{ile}", (FILE,), "name of the file, in the folder of the results", required=True),),
            does="geometry.export"),
    Command("geom{etry} d{elete}", "Forgets layers.", ("pcdc geometry delete 'hole'", "pcdc geometry delete 'a' 'b'"),
            (_leading("layers", STRINGS, "names of the layers"),), dims=BOTH, does="geometry.delete"),
)  # fmt: skip

_MESH = (
    Command("mesh cr{eate}", "Meshes the inside of a layer with Gmsh. Several meshes make several bodies of one model, "
            "which may touch each other.",
            ("pcdc mesh create from-layer 'out' size 0.5 refine-layer 'hole' size 0.05 hole 'hole' group 'rock'",),
            options=(
                Option("from-l{ayer}", (STRING,), "its outline", required=True),
                Option("size", (POSITIVE,), "length of edges", "m", required=True),
                Option("ref{ine}-l{ayer}", (STRING,), "smaller elements near this layer",
                       repeated=True,
                       more=(Option("size", (POSITIVE,), "length of edges there", "m", required=True),
                             Option("dist{ance}", (POSITIVE,), "over which the size grows to that of the rest", "m",
                                    "ten times the size"))),
                Option("hole", (STRING,), "what is inside of this layer stays empty", repeated=True),
                Option("reg{ion}", (STRING,), "what is inside of this layer is a group of its own", repeated=True,
                       more=(Option("group", (STRING,), "its name", default="the name of the layer"),)),
                Option("emb{ed}", (STRING,), "lines that become edges of the mesh; in three dimensions surfaces, which "
                       "become faces", repeated=True),
                Option("crack", (STRING,), "lines that become edges with a crack from the beginning; in three "
                       "dimensions surfaces", repeated=True),
                Option("bodies", (), "each body of the layer is a group of its own: by its name in its file, else by "
                       "the layer and its number", dims=SPACE),
                Option("type", (choice("tri", "quad"),), "triangles or quads", default="tri", dims=PLANE),
                Option("irr{egular}", (), "triangles in no pattern: rows of equilateral ones lead cracks", dims=PLANE),
                Option("smooth", (), "inner points lie in the middle of their neighbours, so that joints on all "
                       "edges share a uniform stress evenly; for triangles", dims=PLANE), _GROUP), dims=BOTH,
            does="meshes.create"),
    Command("mesh str{uctured}", "A regular mesh of a rectangle.",
            ("pcdc mesh structured (0,0) (10,5) cells 40 20 type tri diagonal both group 'base'",
             "pcdc mesh structured (0,0,0) (10,5,5) cells 20 10 10 type hex"),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the corner across", "m")),
            (Option("cells", (COUNT, COUNT, THIRD_COUNT), "along x and y, in three dimensions z", required=True),
             Option("split", (SPLIT,), "tetrahedra of each box: 5, mirrored from box to box, 6 about "
                    "a diagonal, or 12 about a point in the middle", default="6", dims=SPACE),
             Option("type", (choice("tri", "quad", "tet", "hex"),), "triangles or quads, in three dimensions "
                    "tetrahedra or hexahedra", default="tri, tet"),
             Option("diag{onal}", (choice("right", "left", "alternate", "both"),), "of the triangles; alternating, or "
                    "both of each rectangle", default="alternate", dims=PLANE),
             Option("ratio", (POSITIVE, POSITIVE, THIRD_POSITIVE), "along x and y (and z): each rectangle or box is so "
                    "many times as large as the one before", "1", "1 1"), _GROUP), dims=BOTH,
            does="meshes.grid"),
    Command("mesh equi{lateral}", "Nearly equilateral triangles in a rectangle.",
            ("pcdc mesh equilateral (0,0) (10,5) size 0.25 group 'base'",),
            (_leading("first", VECTOR, "a corner", "m"), _leading("second", VECTOR, "the corner across", "m")),
            (Option("size", (POSITIVE,), "length of edges", "m", required=True), _GROUP), does="meshes.equilateral"),
    Command("mod{el} add node", "More nodes, for elements that are added next, before the first model or condition is "
            "assigned. Their numbers follow those of the mesh.", ("pcdc model add node (0,0) (1,0) (0,1)",),
            (_leading("points", PLACES, "the nodes", "m"),), dims=BOTH, does="meshes.add_nodes"),
    Command("mod{el} add element", "One more element, by the numbers of its nodes.", ("pcdc model add element 0 1 2",),
            (Option("corners", (ZERO_OR_MORE, ZERO_OR_MORE, ZERO_OR_MORE, LAST_ID), "three or four, in three "
                    "dimensions four", required=True),), dims=BOTH, does="meshes.add_element"),
    Command("mod{el} scale", "Coordinates of all points of the mesh are multiplied, before the first model or "
            "condition is assigned.", ("pcdc model scale (1,2)",),
            (_leading("factors", VECTOR, "along the axes, above 0"),),
            dims=BOTH, does="meshes.scale"),
    Command("mod{el} tran{slate}", "All points of the mesh are moved, before the first model or condition is "
            "assigned.", ("pcdc model translate (10,0)",), (_leading("way", VECTOR, "where to", "m"),), dims=BOTH,
            does="meshes.translate"),
    Command("mesh imp{ort}", "A mesh of another program, for example .msh or .inp; its physical groups and sets of "
            "elements, nodes and faces become groups.",
            ("pcdc mesh import 'rock.msh'",), (_leading("file", FILE, "name of the file"),),
            (Option("group", (STRING,), "a group that all elements are put into, besides those of the file",
                    more=(SET,)),
             Option("merge", (NOT_NEGATIVE,), "points nearer than this are one", "m", "0"),
             Option("scale", (POSITIVE,), "metres in a unit of the file", "m", "1")), dims=BOTH,
            also=("mod{el} imp{ort} gmsh", "mod{el} imp{ort} abaqus"), does="meshes.import_file"),
    Command("mesh int{ersect}", "Joints on a layer become cracks: the edges of the mesh that lie on it.",
            ("pcdc mesh intersect layer 'fault'",),
            options=(Option("layer", (STRING,), "its lines are edges of the mesh, its surfaces faces", required=True),
                     Option("follow", (), "they are not: the edges that follow them best are taken, the faces between "
                            "elements on either side")), dims=BOTH, does="meshes.intersect"),
    Command("mesh glue", "Bodies that were meshed separately hang together where their faces lie on each other: these "
            "become joints, as inside of a body. Elements are cut where points of others lie on their sides. With a "
            "range only faces of its elements are glued, to any others.",
            ("pcdc mesh glue", "pcdc mesh glue tolerance 1e-4 between 'lining' 'rock' set 'domain'"),
            options=(Option("tol{erance}", (POSITIVE,), "points nearer than this are one", "m",
                            "a thousandth of the shortest edge"),
                     Option("betw{een}", (STRING, STRING), "only faces between the elements of these two groups",
                            more=(SET,))), ranged="element", dims=BOTH, also=("e{lement} glue",), does="meshes.glue"),
    Command("mesh quad{ratic}", "Each triangle of the mesh becomes a six-node triangle, in which displacements are "
            "quadratic: a beam bends with one of them through its height. It is stored as four elements, which go "
            "together; joints, contact and loads act on the halves of its sides. Elastic. The mesh has triangles only; "
            "comes before the first model or condition.", ("pcdc mesh quadratic",), does="meshes.six_nodes"),
    Command("mesh qual{ity}", "Says how good the mesh is: angles, sizes.", ("pcdc mesh quality",), dims=BOTH,
            does="meshes.tell_quality"),
)  # fmt: skip

# ---- meshes in the words of the online commands -------------------------------------------------------------------

_SIZE = Option("m{esh}-s{ize}", (POSITIVE,), "length of edges there", "m", "the largest of the others")
_BOUNDARY = Option("is-b{oundary}", (), "it bounds the mesh: what is outside is cut off", "", "the first piece does")
_ARRAY = Option("a{rray}", (VECTORS,), "points; or a list of vectors", "m")
_LAYERS = Option("l{ayer}", (STRINGS,), "layers of geometry")
_ELEMENT_CREATE = (
    Command("e{lement} create b{rick}", "A regular mesh of a parallelogram, in three dimensions of a parallelepiped, "
            "by a corner and the ends of its edges there.",
            ("pcdc element create brick p0 (0,0) p1 (30,0) p2 (4,12) n 30 12 ratio 1 1.1 triangle off",
             "pcdc element create brick p0 (0,0,0) p1 (6,0,0) p2 (0,4,0) p3 (0,0,5) n 6 4 5 triangle off"),
            options=(Option("p0", (VECTOR,), "the corner", "m", required=True),
                     Option("p1", (VECTOR,), "end of its first edge", "m", required=True),
                     Option("p2", (VECTOR,), "of the second", "m", required=True),
                     Option("p3", (VECTOR,), "of the third", "m", required=True, dims=SPACE),
                     Option("n", (COUNT, COUNT, THIRD_COUNT), "elements along each edge", required=True),
                     Option("r{atio}", (POSITIVE, POSITIVE, THIRD_POSITIVE), "along each edge an element is so many "
                            "times as large as the one before", "1", "1 1"),
                     Option("tri{angle}", (BOOL,), "triangles, or tetrahedra; off: quads, or hexahedra", default="on",
                            also=("tet{ra}",)), _GROUP), dims=BOTH, does="meshes.brick"),
    Command("e{lement} create geo{metry}", "Triangles in the inside of closed lines, by Gmsh, with a mesh size for "
            "each piece. Other pieces become edges and points of the mesh, as far as they lie inside.",
            ("pcdc element create geometry layer 'out' m-s 1.5 is-boundary layer 'fault' m-s 0.5 circle center (4,3) "
             "radius 1 m-s 0.25",),
            options=(
                Option("layer", (STRINGS,), "layers of geometry", repeated=True, more=(_SIZE, _BOUNDARY)),
                Option("cir{cle}", (), "a circle", repeated=True,
                       more=(Option("c{enter}", (VECTOR,), "its centre", "m", required=True),
                             Option("r{adius}", (POSITIVE,), "its radius", "m", required=True), _SIZE, _BOUNDARY)),
                Option("arc", (), "an arc, counter-clockwise", repeated=True,
                       more=(Option("c{enter}", (VECTOR,), "its centre", "m", required=True),
                             Option("s{tart}-p{oint}", (VECTOR,), "where it begins", "m", required=True),
                             Option("e{nd}-p{oint}", (VECTOR,), "where it ends", "m", required=True), _SIZE,
                             _BOUNDARY)), _GROUP), needs_option=True, does="patch"),
    Command("e{lement} create geo{metry}-p{atch}", "Triangles in the inside of closed lines, by Gmsh, that follow "
            "other lines and points as far as these lie inside.",
            ("pcdc element create geometry-patch b-c-p array (0,0) (9,0) (9,6) (0,6) m-s 1 c-polyline layer 'fault' "
             "m-s 0.4 c-point array (2,2) m-s 0.2 g-m-s 1.5",),
            options=(
                Option("b{oundary}-c{lose}-p{olyline}", (), "bounds the mesh", required=True, repeated=True,
                       more=(_ARRAY, _LAYERS, _SIZE)),
                Option("c{onstrain}-poly{line}", (), "lines that become edges", repeated=True,
                       more=(_ARRAY, _LAYERS, _SIZE)),
                Option("c{onstrain}-p{oint}", (), "points of the mesh", repeated=True, more=(_ARRAY, _LAYERS, _SIZE)),
                Option("g{lobal}-m{esh}-s{ize}", (POSITIVE,), "of pieces without one, and away from them", "m",
                       "the largest of the pieces"),
                Option("t{olerance}", (NOT_NEGATIVE,), "points nearer than this are one", "m", "1e-4"), _GROUP),
            does="patch"),
    Command("e{lement} create geo{metry}-b{oundary}", "Triangles in the inside of a closed line, by Gmsh, with others "
            "in it that are holes, or filled.",
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

_OBJECTS = (
    _group_command("element", "e{lement}"),
    Command("e{lement} delete", "Elements are gone. Before the first model or condition is assigned the mesh is "
            "without them, and numbers of others close up; later they are taken out, as by element c-model null.",
            ("pcdc element delete range x 2 4 y 0 1",), ranged="element", dims=BOTH, does="meshes.delete"),
    Command("e{lement} from", "Elements of another program.", ("pcdc element from",), dims=BOTH,
            refused="a mesh of another program is read by mesh import 'file' (model import gmsh or abaqus)"),
    Command("e{lement} dens{ify}", "Quads are halved until they are short enough, before the first model or condition "
            "is assigned. Neighbours follow, so that no side has more than one point on it; quads with such a point "
            "become triangles.",
            ("pcdc element densify pattern 1 1 maximum-length 0.5 0.5 range x 2 4 y 0 1",),
            options=(Option("p{attern}", (CHOSEN, CHOSEN), "1: halved along x, along y; 0: not", "", "1 1"),
                     Option("m{aximum}-l{ength}", (POSITIVE, SECOND_POSITIVE), "of sides along x and y; one number for "
                            "both", "m", required=True)), ranged="element", does="meshes.densify"),
    Command("e{lement} hide", "Elements are hidden from pictures and, where use-hidden is not said, from ranges; off: "
            "seen again. They go on being computed.",
            ("pcdc element hide range group 'cover'", "pcdc element hide off"),
            (_leading("hidden", BOOL, "whether they are", required=False),), ranged="element", dims=BOTH,
            does="settings.hide"),
    _list_command("element", "e{lement}"),
    Command("e{lement} col{lision}", "Whether contact of these elements is looked for; off: others pass through them.",
            ("pcdc element collision off range group 'cover'",),
            (_leading("on", BOOL, "whether they touch others"),), ranged="element", dims=BOTH,
            does="settings.collision"),
    Command("e{lement} w{ater}", "Water stands before the surface of the model: its pressure, the depth below a water "
            "line times density and gravity, pushes on all free faces of these elements that lie below the line, on "
            "parts of faces too, wherever they move. Where the line, which goes from left to right, does not reach "
            "there is no water. Said again: it takes the place of what was.",
            ("pcdc element water surface 'lake' density 1000", "pcdc element water surface 'lake' density 0"),
            options=(Option("s{urface}", (STRING,), "layer of the water line, in three dimensions of planes and "
                            "polygons", required=True),
                     Option("d{ensity}", (NOT_NEGATIVE,), "of the water; 0: there is none any more", "kg/m3",
                            required=True)), ranged="element", dims=BOTH, does="assignments.water"),
    Command("e{lement} c-m{odel}", "The constitutive model of elements, with its properties. Models of fluid "
            "are those of the joints around the elements.",
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
    Command("e{lement} law", "Reads, checks and compiles a law of a Python file without giving it to elements: for a "
            "script that begins with model restore. A checkpoint does not name files that are executed.",
            ("pcdc element law 'clay.py:clay'",), (_LAW,), dims=BOTH, does="assignments.load_law"),
    Command("e{lement} prop{erty}", "Changes properties; the others stay.",
            ("pcdc element property young 10e9 range group 'excav_1' set 'domain'",
             "pcdc element property conductivity 3.5 range group 'salt'",
             "pcdc element property young table 'E_of_depth' over y density field 'density'"),
            options=_OF_SOLIDS, ranged="element", needs_option=True, dims=BOTH, does="heat.element_property"),
    Command("e{lement} init{ial}", "Stress that is there from the beginning. Tension is positive. Components that are "
            "not given are zero; in the plane stress-zz is then that of plane strain, Poisson's ratio times xx + yy, "
            "in plane stress 0. It is that of a strain, by the moduli of this moment: where these are lowered later, "
            "it goes down with them. A stress beyond the strength of the element is reported in the log.",
            ("pcdc element initial stress-xx -5e6 stress-yy -10e6",
             "pcdc element initial stress-yy 0 gradient (0,25e3)"),
            options=tuple(
                Option(f"s{{tress}}-{c}", (FLOAT,), f"stress {c}", "Pa", also=(f"s{{stress}}-{c}",),
                       more=(Option("g{radient}", (VECTOR,), "is added: its product with the position", "Pa/m"),))
                for c in ("xx", "yy", "xy", "zz")) + tuple(
                Option(f"s{{tress}}-{c}", (FLOAT,), f"stress {c}", "Pa", dims=SPACE, also=(f"s{{stress}}-{c}",),
                       more=(Option("g{radient}", (VECTOR,), "is added: its product with the position", "Pa/m"),))
                for c in ("xz", "yz")), ranged="element", needs_option=True, dims=BOTH, does="initial_stress"),
    Command("e{lement} res{et} state", "The plastic state of elements is forgotten. Elastic elements have none: the "
            "log says that nothing was changed. Stresses stay; plastic strain is counted from here on.",
            ("pcdc element reset state",), ranged="element", manual=True, dims=BOTH, does="settings.reset_elements"),
    Command("e{lement} res{et} k{elvin}-s{train}", "The Kelvin units of elements that creep are without strain from "
            "here on. Stresses and displacements stay.", ("pcdc element reset kelvin-strain",), ranged="element",
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
    Command("e{lement}-f{ace} b{oundary} r{emove}", "Takes boundary conditions of surfaces back.",
            ("pcdc element-face boundary remove range geometry 'hole'",
             "pcdc element-face boundary remove therm-c-h range geometry 'hole'"),
            options=_removed(STRESS, CONST_HEAT, *FIELDS_AT_FACES.values()), ranged="element-face", dims=BOTH,
            also=("e{lement}-f{ace} r{emove}",), does="free_faces"),
    _group_command("face-joint", "f{ace}-j{oint}"),
    _list_command("face-joint", "f{ace}-j{oint}"),
    Command("f{ace}-j{oint} c-m{odel}", "The model of the joints between elements. Joints without one hold for ever.",
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
    Command("f{ace}-j{oint} res{et} state", "Damage of joints that are not broken is forgotten. Those "
            "that slide forget that they are torn, not what has slid.",
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
    Command("n{ode} mech{anical}-d{amp}", "Local damping of nodes: what drives one is less by this part of its size "
            "against its motion, in dynamic runs (without it there is none) and in static ones (0.8). The stable time "
            "step is shorter by the root of 1 + damping.",
            ("pcdc node mechanical-damp local 0.3 range y 0 2",),
            options=(Option("l{ocal}", (limited(0.0, 1.0, True),), "part, from 0 to 1", "1", required=True),),
            ranged="node", dims=BOTH, does="assignments.damp"),
    Command("n{ode} func{tion}", "Reads, checks and compiles a function of place and time in a Python file, without "
            "giving it to a condition: for a script that begins with model restore.",
            ("pcdc node function 'pump.py:wave'",), (_FUNCTION,), dims=BOTH, does="assignments.load_function"),
    Command("n{ode} bou{ndary} r{emove}", "Takes boundary conditions of nodes back.",
            ("pcdc node boundary remove range group 'platen' set 'bc'",
             "pcdc node boundary remove mech-vel-b-c range group 'platen' set 'bc'"),
            options=_removed(VELOCITY, FORCE, MOVE, FLOW_CONDITION, PROPPANT_CONDITION, TEMPERATURE, FLUID_TEMPERATURE,
                             *FIELDS_AT_NODES.values()),
            ranged="node", dims=BOTH, also=("n{ode} rem{ove}",), does="free_nodes"),
    Command("n{ode} init{ial}", "The velocity or temperature of nodes now.",
            ("pcdc node initial velocity (1,0) range group 'block'", "pcdc node initial temperature 20"),
            options=(Option("vel{ocity}", (VECTOR,), "velocity", "m/s"),
                     *(Option(f"vel{{ocity}}-{axis}", (FLOAT,), f"velocity along {axis}; the other components stay",
                              "m/s", dims=SPACE if axis == "z" else BOTH) for axis in "xyz"),
                     *(Option(f"f{{orce}}-{axis}", (FLOAT,), f"force along {axis} on each node from now on, as the "
                              "force condition", "N", dims=SPACE if axis == "z" else BOTH) for axis in "xyz"),
                     Option("temp{erature}", (FLOAT,), "temperature, of the fluid at them too; before, it is 0. "
                            "Elements around the nodes are free of thermal stress then", "K"),
                     *(Option(one.name, (FLOAT,), f"{one.doc}; before, it is 0. Elements around the nodes are free of "
                              "the stress that it brings then", one.unit) for one in kinds().values())), ranged="node",
            needs_option=True, dims=BOTH, does="initial_nodes"),
    Command("n{ode} therm{al}-init{ialize}", "The temperature of nodes now, as node initial temperature.",
            ("pcdc node thermal-initialize temperature 15 range x 0 1",),
            options=(Option("t{emperature}", (FLOAT,), "temperature, of the fluid at them too", "K", required=True),),
            ranged="node", dims=BOTH, does="heat.initial"),
    Command("n{ode} hydr{aulic}-init{ialize}", "Fluid that flow nodes hold now, and its temperature.",
            ("pcdc node hydraulic-initialize flow-node-saturation 0.5",),
            options=(Option("f{low}-n{ode}-s{aturation}", (limited(0.0, 1.0, True),), "part of the room that is "
                            "filled", "1", also=("f{luid}-c{avity}-s{aturation}",)),
                     Option("f{low}-n{ode}-t{emperature}", (FLOAT,), "of the fluid alone", "K",
                            also=("f{luid}-c{avity}-t{emperature}",))),
            ranged="node", needs_option=True, dims=BOTH, does="initial_fluid"),
    Command("n{ode} hist{ory}", "A history of the temperature of a node, of several their mean.",
            ("pcdc node history 'gauge' thermal temperature range id 3",), (_NAME,),
            options=(Option("therm{al}", (), "of heat", required=True,
                            more=(Option("temp{erature}", (), "temperature", required=True),)), _EVERY),
            ranged="node", dims=BOTH, does="node_history"),
    Command("n{ode} re{set} vel{ocity}", "All velocities become zero.", ("pcdc node reset velocity",), manual=True,
    dims=BOTH, does="settings.reset_velocity"),
    Command("n{ode} re{set} dis{placement}", "Displacements are counted from here.", ("pcdc node reset displacement",),
            manual=True, dims=BOTH, does="settings.reset_displacement"),
    Command("flow-n{ode} init{ial}", "Fluid that the flow nodes (nodes at which a channel ends) among these nodes hold "
            "now; before, channels are dry.", ("pcdc flow-node initial saturation 1",
                                               "pcdc flow-node initial pressure 1e6 range x 0 1"),
            options=(Option("p{ressure}", (NOT_NEGATIVE,), "filled, at this pressure", "Pa"),
                     Option("sat{uration}", (limited(0.0, 1.0, True),), "part of the room that is filled", "1"),
                     Option("conc{entration}", (NOT_NEGATIVE,), "of proppant in the fluid that is there", "1")),
            ranged="node", needs_option=True, dims=BOTH, does="flow.initial"),
    Command("well cr{eate}", "Flow nodes of a range are a well: one room, whose pressure is that at its highest node. "
            "Stages say what it does; without one it is shut in. Its water pushes on free faces whose nodes all lie in "
            "the range.",
            ("pcdc well create 'injection' range geometry 'hole'",), (_NAME,), ranged="node", dims=BOTH,
            does="flow.well"),
    Command("well st{age}", "One more stage of a well, after those that it has; one without time that has begun ends "
            "now. After the last the well is shut in. Times of tables are those of flow.",
            ("pcdc well stage 'injection' rate 1e-4 time 60 limit 8e6", "pcdc well stage 'injection' shut-in time 600",
             "pcdc well stage 'injection' pressure table 'bottom-hole'"),
            (_NAME,),
            options=(Option("ra{te}", (TABLED,), "volume that is pumped in; negative: drawn, as far as there is fluid; "
                            "in space m3/s", "m2/s"),
                     Option("pr{essure}", (TABLED,), "pressure that is held", "Pa"),
                     Option("sh{ut}-in", (), "nothing comes in or out"),
                     Option("time", (POSITIVE,), "time of flow that it takes", "s", "no end"),
                     Option("lim{it}", (NOT_NEGATIVE,), "with rate: pressure above which less is pumped in", "Pa",
                            "none")), dims=BOTH, does="stage"),
    Command("bolt cr{eate} p{olyline}", "Installs a rock bolt along these points, as things are now: at any stage of "
            "a run. It is divided at the edges of elements, or as said. Nodes go with the rock across the bar, and are "
            "tied to it along the bar by grout, under the plate altogether; where the rock is taken out they are free. "
            "Bolts have no weight and no stiffness in bending.",
            ("pcdc bolt create polyline (0,2) (0,5) length 0.1 grout 0.5 3 plate group 'roof'",
             "pcdc bolt create polyline [points]"),
            (_leading("points", PLACES, "the points, from the head on; or a list of vectors", "m"),),
            (Option("seg{ments}", (COUNT,), "elements of each straight part"),
             Option("len{gth}", (POSITIVE,), "of an element, at most", "m", "to the edges of the elements of the mesh"),
             Option("grout", (NOT_NEGATIVE, POSITIVE), "from where to where along the bolt there is grout; without "
                    "the rest is free", "m", "all of it"),
             Option("plate", (), "the first node is tied to the rock: a face plate"),
             Option("group", (STRING,), "the group that its elements and nodes are put into", "", "none",
                    more=(SET,))), dims=BOTH, does="bolts.create"),
    Command("bolt c-m{odel}", "The properties of elements of bolts, which act from then on.",
            ("pcdc bolt c-model mech-e-p property density 7850 young 200e9 diameter 0.025 tensile-yield-force 250e3 "
             "shear-stiffness-rock-bolt 1e9 grout-thickness 0.0125 cohesion-rock-grout 1.5e6 cohesion-grout-bolt 2e6 "
             "spacing 1.5 pretension-force 50e3 range group 'roof'",),
            models=(BOLT,), ranged="bolt-element", dims=BOTH,
            also=("b{olt}-e{lement} c-m{odel}", "s{upport}-e{lement} c-m{odel}")),
    Command("b{olt}-e{lement} c{reate}", "Installs a rock bolt from a point to another, as bolt create polyline, in "
            "the parts of the way that lie in the rock: each is a bolt. With a range only in these elements.",
            ("pcdc bolt-element create (0,2) (0,5) mesh-size 0.25",),
            (_leading("first", VECTOR, "head", "m"), _leading("second", VECTOR, "end", "m")),
            (Option("m{esh}-s{ize}", (POSITIVE,), "length of its elements, at most", "m", "0.2"),
             Option("group", (STRING,), "the group that its elements and nodes are put into", "", "none",
                    more=(SET,))), ranged="element", dims=BOTH, also=("s{upport}-e{lement} c{reate}",),
            does="bolts.between"),
    _group_command("bolt-element", "b{olt}-e{lement}", "s{upport}-e{lement}"),
    _group_command("bolt-node", "b{olt}-n{ode}", "s{upport}-n{ode}"),
    Command("b{olt}-n{ode} bou{ndary}", "What is prescribed at nodes of bolts.",
            ("pcdc bolt-node boundary b-n-c velocity-y -1e-3 range id 0",
             "pcdc bolt-node boundary b-n-f-b-c force-y -50e3 range group 'heads'"),
            models=(BOLT_VELOCITY, BOLT_FORCE), ranged="bolt-node", dims=BOTH,
            also=("b{olt}-n{ode} bou{ndary} a{pply}", "b{olt}-n{ode} a{pply}",
                  "s{upport}-n{ode} bou{ndary}", "s{upport}-n{ode} bou{ndary} a{pply}", "s{upport}-n{ode} a{pply}")),
    Command("b{olt}-n{ode} bou{ndary} r{emove}", "Takes it back.",
            ("pcdc bolt-node boundary remove range group 'heads'",
             "pcdc bolt-node boundary remove b-n-f-b-c range group 'heads'"),
            options=_removed(BOLT_VELOCITY, BOLT_FORCE), ranged="bolt-node", dims=BOTH,
            also=("b{olt}-n{ode} r{emove}", "s{upport}-n{ode} bou{ndary} r{emove}", "s{upport}-n{ode} r{emove}"),
            does="free_bolt_nodes"),
    Command("bolt del{ete}", "Takes elements of bolts out at once, with their part of the grout. Their numbers go with "
            "them, those of the others stay; without RANGE all of them.",
            ("pcdc bolt delete range group 'roof'",), ranged="bolt-element", dims=BOTH, does="supports.delete"),
    Command("liner cr{eate}",
            "Puts a liner on the free faces that the range chooses, as things are now: at any stage of a run, "
            "without force in it. A face has one beam, in space a triangle; where faces or liners meet at a point, in "
            "space along an edge, of the mesh they are joined, also around a closed opening. Liners have weight, and "
            "no contact of their own: what pushes "
            "them is the rock of their faces.",
            ("pcdc liner create group 'shotcrete' range geometry 'tunnel'", "pcdc liner create range boundary y 2 3"),
            options=(Option("group", (STRING,), "the group that its elements and nodes are put into", "", "none",
                            more=(SET,)),), ranged="element-face", dims=BOTH, does="liners.create"),
    Command("liner c-m{odel}", "The properties of elements of liners, which act from then on.",
            ("pcdc liner c-model beam property density 2400 young 20e9 poisson-ratio 0.2 thickness 0.2 "
             "tensile-strength 2e6 compressive-strength 25e6 normal-stiffness 1e10 shear-stiffness 1e10 "
             "bond-tensile-strength 0.5e6 bond-cohesion 1e6 bond-friction 35 range group 'shotcrete'",),
            models=(LINER,), ranged="liner-element", dims=BOTH),
    Command("liner del{ete}", "Takes elements of liners out at once. Their numbers go with them, those of the others "
            "stay; without RANGE all of them.", ("pcdc liner delete range group 'shotcrete'",), ranged="liner-element",
            dims=BOTH, does="supports.delete"),
    _group_command("liner-element", "liner-e{lement}"),
    _group_command("liner-node", "liner-n{ode}"),
    Command("liner-n{ode} bou{ndary}", "What is prescribed at nodes of liners.",
            ("pcdc liner-node boundary l-n-c velocity-x 0 velocity-y 0 spin 0 range group 'footing'",
             "pcdc liner-node boundary l-n-f-b-c force-y -50e3 moment 1e3 range id 3"),
            models=(LINER_VELOCITY, LINER_FORCE), ranged="liner-node", dims=BOTH),
    Command("liner-n{ode} bou{ndary} rem{ove}", "Takes it back.",
            ("pcdc liner-node boundary remove range group 'footing'",), ranged="liner-node", dims=BOTH,
            does="supports.remove_conditions"),
)  # fmt: skip

_RECORDS = (
    Command("tab{le} cr{eate}", "A function of time, or for properties of x or y; linear from point to point, constant "
            "before and after.",
            ("pcdc table create 'blast' values (0,0) (5e-5,-60e6) (2e-4,0)",
             "pcdc table create 'blast' values [points]",
             "pcdc table create 'E_of_depth' values (-500,60e9) (0,20e9)",
             "pcdc table create 'c_of_strain' values (0,2e6) (0.01,2e5)"),
            (_NAME,), (Option("val{ues}", (VECTORS,), "(time or coordinate, value), the first ascending", "s or m",
                              required=True),), dims=BOTH, does="assignments.table"),
    Command("tab{le}", "The same in pairs of numbers. With relative-time the table begins when a condition takes it: "
            "its times count from that moment.",
            ("pcdc table 'ramp' data 0 0, 0.1 2e6, 1 2e6", "pcdc table 'ramp' data 0 0 0.1 2e6 type relative-time"),
            (_NAME,), (Option("d{ata}", (PAIRS,), "time and value, in turn", "s"),
                       Option("t{ype}", (), "what its times count from",
                              more=(Option("r{elative}-t{ime}", (), "the moment at which a condition takes it"),
                                    Option("a{bsolute}-t{ime}", (), "the beginning of the model")))),
            needs_option=True, dims=BOTH, does="table"),
    Command("tab{le} del{ete}", "Forgets a table.", ("pcdc table delete 'blast'",), (_NAME,), dims=BOTH,
            does="assignments.remove_table"),
    Command("field cr{eate}", "A random field: properties that differ from element to element, face to face, joint to "
            "joint. Where several properties take the same field they are drawn together; another seed is another, "
            "independent field. What was drawn stays, whatever becomes of the field.",
            ("pcdc field create 'strength' weibull 5e6 4 seed 7",
             "pcdc field create 'E' lognormal 40e9 8e9 seed 3 correlation 0.02 least 10e9"),
            (_NAME,),
            (Option("wei{bull}", (POSITIVE, POSITIVE), "scale (63 % of the values are below it) and shape"),
             Option("norm{al}", (FLOAT, NOT_NEGATIVE), "mean and standard deviation"),
             Option("logn{ormal}", (POSITIVE, NOT_NEGATIVE), "mean and standard deviation of the values themselves"),
             Option("seed", (ZERO_OR_MORE,), "another seed, another field", required=True),
             Option("corr{elation}", (POSITIVE,), "over this length neighbours are alike: the field is one of places, "
                    "the same in any mesh", "m", "each object by itself",
                    more=(Option("cov{ariance}", (choice("exponential", "gaussian"),), "exp(-r/L), or exp(-(r/L)2), "
                                 "which is smooth", "", "exponential"),)),
             Option("least", (FLOAT,), "the distribution is cut below", "", "none"),
             Option("great{est}", (FLOAT,), "the distribution is cut above", "", "none")), dims=BOTH,
            does="random_field"),
    Command("field del{ete}", "Forgets a random field; what was drawn from it stays.",
            ("pcdc field delete 'strength'",), (_NAME,), dims=BOTH, does="assignments.remove_field"),
    Command("his{tory} cr{eate}", "Records a number during the run: of one object, of those of a range or, without "
            "one, of all (sum, mean, minimum or maximum), or of the model.",
            ("pcdc history create 'load' node value reaction-y sum every 100 range group 'platen' set 'bc'",
             "pcdc history create 'gauge' element nearest (5,0) value stress-yy",
             "pcdc history create 'worst' element value stress-yy minimum every 10",
             "pcdc history create 'cracks' model value broken-joints every 100",
             "pcdc history create 'pump' well value pressure well 'injection' every 10"),
            (_NAME, _leading("object", choice(*RECORDED), "what it is a number of")),
            (Option("id", (ZERO_OR_MORE,), "the object of this number"),
             Option("near{est}", (VECTOR,), "the object nearest to this point", "m"),
             Option("val{ue}", (_RECORDED,), "what is recorded, see below", required=True), _EVERY,
             Option("var{iable}", (STRING,), "with law-state: which state variable of laws of the user"),
             Option("well", (STRING,), "with object well: its name"),
             *(Option(how, (), "of the objects of range, or of all")
               for how in ("sum", "mean", "min{imum}", "max{imum}"))),
            ranged="any", dims=BOTH, does="history"),
    Command("his{tory} del{ete}", "Stops a history; its file stays.", ("pcdc history delete 'load'",), (_NAME,),
    dims=BOTH, does="histories.delete"),
    Command("his{tory} exp{ort}", "Writes all histories, or some, side by side as CSV.",
            ("pcdc history export 'curves.csv'",), (_leading("file", FILE, "name of the file"),),
            (Option("name{s}", (STRINGS,), "only these", default="all"),), dims=BOTH, does="histories.export"),
    Command("chart cr{eate}", "A diagram.", ("pcdc chart create 'ucs' x-label 'strain' y-label 'stress [[MPa]]'",),
            (_NAME,), (Option("tit{le}", (STRING,), "over the diagram"), Option("x-l{abel}", (STRING,), "of the axis"),
                       Option("y-l{abel}", (STRING,), "of the axis")), dims=BOTH, does="charts.create"),
    Command("chart add", "A curve of two histories, or of points.",
            ("pcdc chart add 'ucs' x 'shortening' scale-x -0.01 y 'load' scale-y 2e-8 label 'sample'",
             "pcdc chart add 'ucs' values [curve] label 'exact' style points",
             "pcdc chart add 'crack' profile aperture scale-y 1e3 label 'after 10 s' range geometry 'fault'"),
            (_NAME,),
            (Option("x", (STRING,), "history along x; without it the time", default="time"),
             Option("y", (STRING,), "history along y"), Option("scale-x", (FLOAT,), "factor", default="1"),
             Option("scale-y", (FLOAT,), "factor", default="1"), Option("val{ues}", (VECTORS,), "points (x,y)"),
             Option("prof{ile}",
                    (choice("pressure", "saturation", "aperture", "flow-rate", "velocity", "temperature",
                            "concentration"),),
                    "of the fluid as it is now, along the line that the joints of the range make, over the distance "
                    "[m] from its left end", dims=PLANE),
             Option("lab{el}", (STRING,), "in the legend"),
             Option("style", (choice("line", "points"),), "how it is drawn", default="line")), ranged="face-joint",
                    dims=BOTH, does="charts.add"),
    Command("chart exp{ort}", "Writes a diagram as CSV and as a figure of the same name.",
            ("pcdc chart export 'ucs' 'ucs.png'", "pcdc chart export 'ucs' 'ucs.png' cracks",
            "pcdc chart export 'slope' 'slope.png' plastic", "pcdc chart export 'crack' 'crack.png' fluid aperture"),
            (_NAME, _leading("file", FILE, "name of the figure: .png, .pdf or .svg")),
            (Option("crack{s}", (), "beside it the model as it is now, with its cracks by the way they broke"),
             Option("plas{tic}", (), "beside it the model as it is now, with contours of plastic shear strain"),
             Option("temp{erature}", (), "beside it the model as it is now, with contours of temperature, and cracks"),
             Option("fl{uid}", (choice("pressure", "saturation", "aperture", "velocity", "concentration"),),
                    "beside it the model as it is now, its channels coloured by that")), dims=BOTH,
            does="charts.export"),
    Command("output vtk", "Frames for ParaView: now, and every so many steps.",
            ("pcdc output vtk 'blast' every 1000", "pcdc output vtk 'last'"),
            (_leading("file", FILE, "first part of the names of the files, in the folder of the results"),),
            (Option("ev{ery}", (COUNT,), "steps between two frames", "", "once, now"),
             Option("off", (), "no more frames of this name")), dims=BOTH, also=("mod{el} exp{ort} vtk",),
            does="frames.vtk"),
    Command("output image", "A picture of the model as it is now, `<name>_<step>.png`, of any field that frames have.",
            ("pcdc output image 'stress' field 'stress-yy' limits -2e6 0 colours blue-red",
             "pcdc output image 'roof.pdf' object elements field 'displacement' deformed 100 range group 'roof'",
             "pcdc output image 'flow' view 'flow.mv' title 'step {step}'"),
            (_leading("file", FILE, "first part of the name, in the folder of the results; .pdf, .svg or .png at its "
                                    "end says what is drawn"),),
            (Option("view", (FILE,), "what is shown, as a file *.mv says, of hpcdem view or hpcdem draw", "",
                    "everything"),
             Option("field", (STRING,), "what colours objects; hpcdem draw --list names the fields of a frame"),
             Option("object", (choice(*OBJECTS),), "of which objects the field and the options below are", "",
                    "the first that have the field"),
             Option("limits", (FLOAT, FLOAT), "values of the first and the last colour", "",
                    "those that 1 % of what is shown is below or above"),
             Option("full", (), "in the place of limits: the least and the greatest value of what is shown"),
             Option("log", (), "colours by the logarithm"),
             Option("colours", (choice(*COLOURS),), "of the field", default="viridis"),
             Option("opacity", (FLOAT,), "from 0 to 1", default="1"), Option("edges", (), "outlines of elements"),
             Option("size", (POSITIVE,), "factor on widths of lines", default="1"),
             Option("vectors", (STRING,), "arrows: displacement or velocity"),
             Option("arrows", (POSITIVE,), "factor on their length", default="1"),
             Option("filter", (STRING,), "only objects for which this holds, as 'stress_yy < -1e6 and x > 2'"),
             Option("deformed", (FLOAT,), "factor on displacements", default="1"),
             Option("camera", (CORNER, CORNER), "lower left and upper right corner of the picture, in space along it "
                    "and up it", "m", "the model"),
             Option("eye", (EYE,), "from where a body is seen: along an axis, from the right, the front and above "
                    "(iso), or from a direction", "", "'iso'", dims=SPACE),
             Option("section", (SECTION,), "a plane that cuts it: 'x=1.5' takes the part towards the eye away, 'x<1.5' "
                    "and 'x>1.5' say what stays, 'px,py,pz,nx,ny,nz' gives a point and the normal into what is taken "
                    "away", "", "whole", dims=SPACE),
             Option("title", (STRING,), "over the picture; {step} and {time} are filled in")), ranged="any", dims=BOTH,
            does="pictures.image"),
)  # fmt: skip

_ONLINE = (
    Command("dev{ice} l{ist}", "Says in the log what the run computes with: ranks, threads, cores.",
            ("pcdc device list",), dims=BOTH, does="clocks.devices"),
    Command("dev{ice} s{witch}-t{o}", "Another device.", ("pcdc device switch-to 'GPU 0'",),
            (_leading("name", STRING, "its name"),), dims=BOTH,
            idle="a run computes with the ranks and threads that it was started with (mpirun -n, -j)"),
    Command("v{iew}", "What a window shows.", ("pcdc view 'stress' target element name 'stress-yy'",), (_NAME,),
            options=(Option("t{arget}", (), "of what", more=tuple(
                Option(word, (), doc, more=(Option("n{ame}", (STRING,), "the field"),)) for word, doc in (
                    ("e{lement}", "elements"), ("f{ace}-j{oint}", "joints"), ("geo{metry}", "layers"),
                    ("b{olt}", "bolts"), ("f{low}-c{hannel}", "channels")))),
                     Option("u{pdate}", (), "draws it again")),
            needs_option=True, dims=BOTH,
            idle="hpcdem view shows any field of a run while it steps; output image draws one into a file"),
    Command("b{oundary}-m{odel}", "Conditions in code of C#.", ("pcdc boundary-model create s-b-c name 'a' code 'b'",),
            dims=BOTH, refused="no code of C# is run. A stress or velocity that depends on place and time is a "
            "function in Python: element-face boundary m-s-b-c stress-normal function 'file.py:name', "
            "node boundary mech-vel-b-c velocity-x function 'file.py:name'"),
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
"""What there is in three dimensions in place of words for two."""

COMMANDS = (*_MODEL, *_GEOMETRY, *_MESH, *_ELEMENT_CREATE, *_OBJECTS, *_RECORDS, *_ONLINE)
PCDC = Table(COMMANDS, RANGE_TERMS)
