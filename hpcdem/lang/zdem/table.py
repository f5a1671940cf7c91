"""Every command, keyword and option of the ZDEM language, in one table.

Parsing, abbreviations, error messages, ``hpcdem --check`` and the page docs/zdem_reference.md are all made from the
rows below; a new option is one new row. A row says how the option is written, its unit and default, what it does, where
it is known from, and whether the solver carries it out (a script that uses a row with ``executed=False`` is refused by
name before anything runs).

Sources: R command reference of the ZDEM manual 2.x, S only in the manual's scripts or change log, W scripts on the
author's web site, X our extension.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from hpcdem.core.material import PROPERTIES
from hpcdem.core.nearest import hint
from hpcdem.core.outputs import OUTPUTS
from hpcdem.core.picture_words import NUMBERS as COLORS
from hpcdem.core.units import CHOICES as UNITS

SOURCES = {
    "R": "command reference of the manual",
    "S": "scripts or change log of the manual",
    "W": "scripts on the author's web site",
    "P": "scripts, frames and readers in public repositories",
    "X": "extension of hpcdem",
}

# ---- kinds of values: how many words, of which sort ----------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """pattern: as syntax lines show it; meaning: as "expected ..." messages say it."""

    pattern: str
    meaning: str


@dataclass(frozen=True)
class Flag(Kind):
    """The keyword alone."""


@dataclass(frozen=True)
class Number(Kind):
    """One number within [low, high]; `above` excludes low itself; `zero` False excludes 0."""

    integer: bool = False
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    zero: bool = True


@dataclass(frozen=True)
class Optional(Kind):
    """A positive number that may be left out; then `absent` counts."""

    absent: float = 0.0


@dataclass(frozen=True)
class Point(Kind):
    """Two numbers."""


@dataclass(frozen=True)
class Segment(Kind):
    """Two points that differ."""


@dataclass(frozen=True)
class Interval(Kind):
    """Lower and upper bound, numbers or expressions."""


@dataclass(frozen=True)
class Corners(Kind):
    """Four points, numbers or expressions."""


@dataclass(frozen=True)
class EllipseShape(Kind):
    """Centre and half axes, numbers or expressions."""


@dataclass(frozen=True)
class IdRange(Kind):
    """One id, or first and last."""


@dataclass(frozen=True)
class Radii(Kind):
    """The word ``discrete`` and at least one radius."""


@dataclass(frozen=True)
class Viscosity(Kind):
    """The word ``lsm`` and a number."""


@dataclass(frozen=True)
class Color(Kind):
    """A name of COLORS or its number."""


@dataclass(frozen=True)
class Name(Kind):
    """A group name; kept in lower case."""


@dataclass(frozen=True)
class File(Kind):
    """A file name; case is kept."""


@dataclass(frozen=True)
class Names(Kind):
    """Any number of names with | between them."""


@dataclass(frozen=True)
class Values(Kind):
    """Names, each with a number behind it; case is kept."""


@dataclass(frozen=True)
class Groups(Kind):
    """The word ``group``, which may be left out, and as many names as `number`, with | between them."""

    number: int = 1


@dataclass(frozen=True)
class Laws(Kind):
    """Two laws with | between them; case is kept."""


@dataclass(frozen=True)
class WallIds(Kind):
    """The words ``wall`` and ``id``, which may be left out, and as many ids as `number`, with | between them; nothing
    at all where `optional`."""

    number: int = 1
    optional: bool = False


@dataclass(frozen=True)
class Choice(Kind):
    """One of the words of `choices`, each with the value it stands for."""

    choices: tuple[tuple[str, str], ...] = ()


FLAG = Flag("", "the word alone")
FLOAT = Number("<float>", "a number")
POSITIVE = Number("<float>", "a number above 0", low=0.0, above=True)
NOT_NEGATIVE = Number("<float>", "a number not below 0", low=0.0)
DISTANCE = Number("<float>", "a distance other than 0", zero=False)
RATIO = Number("<float>", "a number above 0, at most 1", low=0.0, high=1.0, above=True)
INT = Number("<int>", "a whole number", integer=True)
COUNT = Number("<int>", "a whole number above 0", integer=True, low=1)
ASKED = Number("<int>", "a whole number from 1 to 1e9", integer=True, low=1, high=1e9)
INDEX = Number("<int>", "a whole number not below 0", integer=True, low=0)
TOLERANCE = Optional("[<float>]", "a number not below 0, or nothing", absent=1e-6)
POINT = Point("(<float> <float>)", "two numbers (x y)")
SEGMENT = Segment("(<float> <float>) (<float> <float>)", "two points (x1 y1) (x2 y2)")
INTERVAL = Interval("(<float> <float>)", "a lower and an upper bound")
CORNERS = Corners("(<float> <float>) x 4", "four points (x y)")
ELLIPSE = EllipseShape("(<float> <float>) <float> <float>", "a centre (x y) and two half axes")
IDS = IdRange("<int> [<int>]", "an id, or the first and the last id")
RADII = Radii("discrete <float> ...", "the word 'discrete' and one or more radii")
LSM = Viscosity("lsm <float>", "the word 'lsm' and a number not below 0")
COLOR = Color("<colour>", "a colour: " + ", ".join(f"{name} ({n})" for name, n in COLORS.items()))
NAME = Name("<name>", "a group name")
OF_GROUP = Groups("[group] <name>", "a group name")
OF_GROUPS = Groups("[group] <name>|<name>", "two group names with | between them", number=2)
OF_WALL = WallIds("[wall] [id] <int>", "the id of a wall")
THIS_WALL = WallIds("[[wall] [id] <int>]", "the id of a wall", optional=True)
OF_WALLS = WallIds("[wall] [id] <int>|<int>", "the ids of two walls with | between them", number=2)
FILE = File("<file>", "a file name")
LAW = File("<file.py:function>", "'file.py:function', or linear")
OF_LAWS = Laws("<law>|<law>", "two laws with | between them, 'file.py:function', linear or hertz")
NAMES = Names("<name>|<name>...", "names with | between them, blanks in them as _")
VALUES = Values("<name> <float> ...", "names with a number each")


# ---- rows ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Row:
    """Common base of commands and options.

    name: as the manual writes it; longest: the longest spelling of which an abbreviation may be the beginning
    (default: the name itself); also: other accepted spellings, misprints of the manual among them.
    """

    name: str
    doc: str
    longest: str = ""
    also: tuple[str, ...] = ()
    executed: bool = True
    source: str = "R"

    def accepts(self, word: str) -> bool:
        """Return whether this (lower-case) word stands for the row. Names of up to three letters only match exactly,
        longer ones by any beginning of at least three letters."""
        full = self.full
        return word == full or word in self.also or (len(full) > 3 and len(word) >= 3 and full.startswith(word))

    def named(self, word: str) -> bool:
        """Return whether this (lower-case) word is one of the full spellings."""
        return word in (self.name.lower(), self.full, *self.also)

    @property
    def full(self) -> str:
        """Longest spelling, lower case."""
        return (self.longest or self.name).lower()

    @property
    def stem(self) -> str:
        """Shortest accepted spelling, lower case."""
        return self.full[:3]


@dataclass(frozen=True)
class Option(Row):
    """A keyword and the value behind it. unit and default are for the reader; switch: a - before it switches it off."""

    kind: Kind = FLAG
    unit: str = ""
    default: str = ""
    required: bool = False
    switch: bool = False

    @property
    def key(self) -> str:
        """Name among the arguments of a statement."""
        return self.name.lower()


AnyRow = TypeVar("AnyRow", bound=Row)


def find(word: str, rows: Sequence[AnyRow]) -> tuple[AnyRow | None, bool]:
    """The row of a command or of RANGE that a (lower-case) word stands for, and whether it is only guessed.

    That is the row of this name; the only one that begins with the word, of two letters or more; else the only one of
    more than three letters that has its first three, which is how ZDEM tells words apart (published scripts with
    `gravtiy` run there).
    """
    named = [row for row in rows if row.named(word)]
    if named:
        return named[0], False
    begins = [row for row in rows if len(word) >= 2 and row.full.startswith(word)]
    if begins:
        return (begins[0], False) if len(begins) == 1 else (None, False)
    alike = [row for row in rows if len(word) > 3 and len(row.full) > 3 and row.stem == word[:3]]
    return (alike[0], True) if len(alike) == 1 else (None, False)


@dataclass(frozen=True)
class Command(Row):
    """A command: fixed words and values first (`leading`, in this order), then `options` in any order, then RANGE.

    same_as: the command this is another name of. example: lines that parse; the reference page shows them. does: its
    function, as "module.name" of `hpcdem.commands.dem`, which has arguments of the names of its options; "": execute.py
    converts them.
    """

    leading: tuple[Option, ...] = ()
    options: tuple[Option, ...] = ()
    ranged: bool = False
    same_as: str = ""
    example: tuple[str, ...] = ()
    does: str = ""

    def option(self, word: str) -> Option | None:
        """The option a (lower-case) word stands for."""
        return find(word, self.options)[0]

    @property
    def words(self) -> list[str]:
        """Keywords that may follow, for messages."""
        return [option.name for option in self.options] + (["RANGE"] if self.ranged else [])


@dataclass(frozen=True)
class Table:
    """All commands, and the terms of RANGE."""

    commands: tuple[Command, ...]
    range_terms: tuple[Option, ...]
    range_row: Row = field(default_factory=lambda: Row("RANGE", "limits a command to the selected particles"))

    def command(self, word: str) -> Command | None:
        """The command a (lower-case) word stands for."""
        return next((command for command in self.commands if command.accepts(word)), None)

    def hint(self, word: str) -> str:
        """The nearest command."""
        return hint(word, [name for c in self.commands for name in (c.name, c.full.upper())])


def joined(words: Iterable[str]) -> str:
    """Words of a list, as messages show them."""
    return ", ".join(words)


# Options that several commands share.


def _id(doc: str, required: bool = True) -> Option:
    return Option("id", doc, kind=INDEX, required=required)


_COLOR = Option("color", "colour, by name or number", also=("colour",), kind=COLOR, default="lg")
_GROUP = Option("group", "group of the particles", kind=NAME, default="***")
_KN = Option("kn", "normal stiffness", kind=NOT_NEGATIVE, unit="N/m", default="0")
_KS = Option("ks", "shear stiffness", kind=NOT_NEGATIVE, unit="N/m", default="0")
_FRIC = Option("fric", "friction coefficient", longest="friction", kind=NOT_NEGATIVE, default="0")
_RAD = Option("rad", "radius", also=("r",), kind=POSITIVE, unit="m", required=True)
_RADII = Option(
    "rad", "radii drawn at random, a repeated one more often", also=("r",), kind=RADII, unit="m", required=True
)
_BOX_X = Option("x", "left and right side of the rectangle", kind=INTERVAL, unit="m", required=True)
_BOX_Y = Option("y", "lower and upper side of the rectangle", kind=INTERVAL, unit="m", required=True)

_PROPERTIES = (
    *(
        Option(name, one.text, unit=one.unit, longest=one.longest, default=one.default, source=one.source,
               kind=Number("<float>", one.range, low=one.low, high=one.high, above=one.above))
        for name, one in PROPERTIES.items()
    ),
    Option("hertz", "assigns the Hertz-Mindlin contact to the particles; a later kn or ks without it revokes it"),
    Option("law", "pairs of these particles follow a user law in a Python file (docs/user_laws.md); linear: a built-in "
           "law again", kind=LAW, source="X"),
    Option("between", "assigns this law to pairs of discs with these two laws, not to particles",
           kind=OF_LAWS, source="X"),
    Option("parameter", "properties that this law declares", kind=VALUES, source="X"),
    Option("xv", "velocity in x", kind=FLOAT, unit="m/s"),
    Option("yv", "velocity in y", kind=FLOAT, unit="m/s"),
    Option("spin", "angular velocity, anticlockwise", kind=FLOAT, unit="rad/s"),
    Option("color", "colour, by name or number", also=("colour", "coloe"), kind=COLOR, source="S"),
    Option("group", "moves the particles to this group; a particle is in one group", kind=NAME, source="S"),
    Option("ebmod", "model 1 bond: Young's modulus", kind=NOT_NEGATIVE, unit="Pa"),
    Option("gbmod", "model 1 bond: shear modulus", also=("gbmmod",), kind=NOT_NEGATIVE, unit="Pa"),
    Option("tstrength", "model 1 bond: tensile strength", kind=NOT_NEGATIVE, unit="Pa"),
    Option("sstrength", "model 1 bond: cohesion", kind=NOT_NEGATIVE, unit="Pa"),
    Option("rubber", "marks the bonds as those of a membrane: stored and written, without effect on the motion",
           source="P"),
    Option("conserving", "the bonds keep one shear stiffness, closed or open, so that opening and closing create no "
           "energy (docs/physics.md, Bonds)", source="X"),
    Option("moment", "model 1 bond: resists relative rotation, and breaks in tension by the stress at its outer fibre",
           source="X"),
    Option("n_bond", "model 2 bond: tensile strength", kind=NOT_NEGATIVE, unit="N"),
    Option("s_bond", "model 2 bond: shear strength", kind=NOT_NEGATIVE, unit="N"),
    Option("tolerate", "largest bonded gap, up to 10 times the largest radius; the word alone keeps the default",
           kind=TOLERANCE, unit="m",
           default="1e-6"),
    Option("rext", "factor on the radii in the search for bonds, see cratio of GLINE", kind=POSITIVE, default="1"),
)  # fmt: skip

_PROP_DOC = (
    "Sets properties, velocities, colour and group of particles. With a bond key (ebmod gbmod tstrength sstrength, or "
    "n_bond s_bond) it also bonds all pairs of selected particles with distance <= (Ra + Rb) rext + tolerate "
    "immediately; existing bonds get the new values. Without a bond key tolerate and rext have no effect."
)

_DEGREES = (Option("x", "motion in x"), Option("y", "motion in y"), Option("spin", "rotation"))


def _interval(name: str, doc: str, source: str = "R") -> Option:
    return Option(name, doc, kind=INT, unit="steps", default="off", source=source)


_SETTINGS = (
    Option("dt", "time step; the last of DT and frac applies", kind=POSITIVE, unit="s"),
    Option("gravity", "gravity in x and y", kind=POINT, unit="m/s2", default="0 0"),
    Option(
        "disk",
        "volume for the mass: on pi r^2, off (or 0) 4/3 pi r^3, hex 2 sqrt(3) r^2",
        kind=Choice("on|off|hex", "on, off (or 0), or hex",
                    (("on", "on"), ("off", "off"), ("hex", "hex"), ("0", "off"), ("1", "on"))),
        default="on",
    ),
    Option("frac", "time step over sqrt(smallest mass / largest pair stiffness)", kind=POSITIVE, source="S"),
    Option("damp", "lattice-solid damping, force -v times this", kind=LSM, unit="N s/m", default="lsm 0", source="S"),
    Option("restitution", "coefficient of restitution of unbonded discs, with each other and with walls; 1: no "
           "loss", kind=RATIO, default="1", source="X"),
    Option("rolling", "type of rolling resistance (PROP rfric): a, a torque of constant size against rolling; c, an "
           "elastic-plastic spring and a dashpot", kind=Choice("a|c", "a or c", (("a", "a"), ("c", "c"))),
           default="c", source="X"),
    _interval("stepbar", "steps between two lines of progress"),
    *(_interval(name, f"{one.what} at this interval of steps", one.sources[0]) for name, one in OUTPUTS.items()),
    _interval("energy", "steps between two rows of energy.csv, with the energy budget at the end", source="X"),
    Option("thickness", "thickness of the model, for the force of PROP xp, yp and the stresses of HIST",
           kind=POSITIVE, unit="m", default="1", source="X"),
    Option("seed", "seed of the random numbers of GEN", kind=INDEX, default="5", source="X"),
    Option("wallside", "sides of walls that act: left of P1->P2 (ZDEM up to 2.0) or both",
           kind=Choice("left|both", "left or both", (("left", "left"), ("both", "both"))), default="both", source="X"),
    Option("gentry", "attempts of GEN per requested particle; not set: GEN stops after 1000 consecutive failures",
           kind=POSITIVE, source="X"),
    Option("outdir", "folder of the results", kind=FILE, default="data", source="X"),
    Option("units", "declares the units of all following values: unlikely values give a warning, histories and curves "
           "show the units; no value is changed",
           kind=Choice("|".join(UNITS.values()), ", ".join(UNITS.values()), tuple((name, name) for name in UNITS)),
           source="X"),
)  # fmt: skip

_PLATE_END = Choice(
    "infinite|free|broken|clamped|fixed", "infinite, free (or broken), or clamped (or fixed)",
    tuple((name, name) for name in ("infinite", "free", "broken", "clamped", "fixed")),
)  # fmt: skip

COMMANDS = (
    # ---- beginning and end
    Command("START", "Begins a new calculation: no particles, no walls, step 0.", example=("START",),
            does="particles.start"),
    Command(
        "RESTORE",
        "Resumes from a checkpoint of hpcdem, searched for in the script's folder, then in its ./data.",
        leading=(Option("file", "restart file", kind=FILE, required=True),),
        example=("RES 0000046000.sav",),
        does="checkpoints.restore",
    ),
    Command(
        "LOAD",
        "Begins a new calculation with the particles of a text file of columns x y r [group], or with the complete "
        "contents of a frame all_<step>.dat of ZDEM or hpcdem: particles with velocities and properties, walls, bonds, "
        "step, time step and gravity. Bounds that select no particle are an error.",
        leading=(Option("file", "file of particles", kind=FILE, required=True),),
        options=(
            Option("scale", "factor on x, y and r", kind=POSITIVE, default="1"),
            Option("x", "only particles of the file within these bounds, before scaling", kind=INTERVAL, unit="m"),
            Option("y", "only particles of the file within these bounds, before scaling", kind=INTERVAL, unit="m"),
        ),
        example=("LOAD init_xyr.dat", "LOAD init_xyr.dat scale 0.1 x 1000.0 2000.0 y 2000.0 4000.0",
                 "LOAD all_0000046000.dat"),
        does="particles.load",
    ),
    Command("STOP", "Ends the run; ignores all following lines.", source="S", example=("STOP",), does="cycles.stop"),
    # ---- walls
    Command(
        "BOX",
        "The region of the model: four walls that act inwards; particles that leave it are deleted.",
        source="S",
        options=(
            Option("left", "x of the left wall", kind=FLOAT, unit="m", required=True, source="S"),
            Option("right", "x of the right wall", kind=FLOAT, unit="m", required=True, source="S"),
            Option("bottom", "y of the lower wall", kind=FLOAT, unit="m", required=True, source="S"),
            Option("height", "height above bottom", kind=POSITIVE, unit="m", required=True, source="S"),
            replace(_KN, doc="normal stiffness, linear contacts only", source="S"),
            replace(_KS, doc="shear stiffness, linear contacts only", source="S"),
            replace(_FRIC, source="S"),
        ),
        example=("BOX left 0.0 right 41000.0 bottom 0.0 height 11000.0 kn=0e10 ks=0e10 fric 0.0",),
        does="walls.box",
    ),
    Command(
        "WALL",
        "With nodes: creates a wall, or replaces the wall of this id. Without nodes: changes the given properties, or "
        "deletes the wall. "
        "Both sides act, with the same properties, unless SET wallside left was given before; stiffnesses are for "
        "linear contacts only.",
        options=(
            _id("number of the wall"),
            Option("nodes", "end points P1 and P2", kind=SEGMENT, unit="m"),
            _KN,
            _KS,
            _FRIC,
            _COLOR,
            Option("xv", "velocity in x", kind=FLOAT, unit="m/s", default="0"),
            Option("yv", "velocity in y", kind=FLOAT, unit="m/s", default="0"),
            Option("delete", "deletes the wall and its contacts", source="X"),
        ),
        example=("WALL ID 1, NODES ( 10.0 , 10000.0 ) ( 10.0 , 10.0 ), kn=0e10 ks=0e10 fric 0.0 COLOR blue",
                 "WALL id 1 xv 2.0", "WALL id 1 delete"),
        does="walls.wall",
    ),
    Command(
        "FLEXURE",
        "A base that bends under its load like an elastic plate on a fluid (flexural isostasy): the plate is in "
        "equilibrium with its load and a restoring pressure contrast g w, w being the deflection. The base is a "
        "horizontal wall, which becomes a polyline, or a horizontal row of particles fixed in x and y, selected by "
        "RANGE. The load is the mean of the contact forces in an interval of steps. Writes flexure.csv with the rows "
        "of walls.csv: deflection, equilibrium, load and bending moment along the plate (docs/flexure.md).",
        source="X",
        options=(
            Option("wall", "the wall", kind=OF_WALL, source="X"),
            Option("rigidity", "flexural rigidity D", kind=POSITIVE, unit="N m", source="X"),
            Option("young", "Young's modulus of the plate, instead of rigidity", kind=POSITIVE, unit="Pa", source="X"),
            Option("poisson", "Poisson's ratio of the plate, with young",
                   kind=Number("<float>", "a number not below 0, below 0.5", low=0.0, high=0.4999), default="0.25",
                   source="X"),
            Option("te", "elastic thickness of the plate, with young", kind=POSITIVE, unit="m", source="X"),
            Option("contrast", "density of the fluid minus that of what fills the deflection besides the particles",
                   kind=POSITIVE, unit="kg/m3", source="X"),
            Option("x", "left and right end of the plate", kind=INTERVAL, unit="m", default="those of the base",
                   source="X"),
            Option("left", "left end of the plate: continues without load, free, or clamped", kind=_PLATE_END,
                   default="infinite", source="X"),
            Option("right", "right end of the plate", kind=_PLATE_END, default="infinite", source="X"),
            Option("load", "constant line load on the plate: x and size, downwards", kind=POINT, unit="m, N/m",
                   source="X"),
            Option("compensated", "the mean load of the first interval is in equilibrium with the horizontal base",
                   source="X"),
            Option("interval", "steps between two solutions of the plate", kind=COUNT, unit="steps", default="1000",
                   source="X"),
            Option("relax", "share of the distance to equilibrium that the base moves in an interval", kind=RATIO,
                   default="0.5", source="X"),
            Option("speed", "largest speed of the base", kind=POSITIVE, unit="m/s",
                   default="1e-3 of the largest radius in a step", source="X"),
            Option("segments", "segments of the base", kind=COUNT,
                   default="20 per flexural parameter, at least 50", source="X"),
            Option("off", "ends the coupling; the base keeps its present shape", source="X"),
        ),
        ranged=True,
        example=(
            "FLEXURE wall id 5 rigidity 1e22 contrast 3300.0 right broken compensated",
            "FLEXURE young 7e10 poisson 0.25 te 8e3 contrast 2300.0 x (-2e5, 3e5) interval 500 RANGE group base",
            "FLEXURE wall id 5 off",
        ),
    ),
    Command(
        "PERIODIC",
        "Periodic sides: particles that leave through the left side enter through the right one and touch across them. "
        "BOX must precede it and loses its left and right wall. Horizontal walls that span both sides continue without "
        "an end; other walls must keep their distance from the sides. Frames contain positions between the sides and "
        "the crossings (laps). Not with clumps, FLEXURE, SURFACE or coupled blocks.",
        source="X",
        options=(
            Option("x", "left and right side; omit it if the sides are periodic already", kind=INTERVAL, unit="m",
                   source="X"),
            Option("xv", "velocity of the right side relative to the left one, negative to shorten; 0 ends it. "
                   "Particles that are not fixed along x get the velocities of a homogeneous strain", kind=FLOAT,
                   unit="m/s", source="X"),
        ),
        example=("PERIODIC x (0.0, 20.0)", "PERIODIC xv -0.5"),
        does="walls.periodic",
    ),
    # ---- particles
    Command(
        "BALL",
        "Creates one particle.",
        options=(
            _id("number of the particle"),
            Option("x", "centre", kind=FLOAT, unit="m", required=True),
            Option("y", "centre", kind=FLOAT, unit="m", required=True),
            _RAD,
            _COLOR,
            _GROUP,
        ),
        example=("BALL ID=0 X=2.0 Y=0.5 RAD=0.5 COLOR=blue",),
        does="particles.ball",
    ),
    Command(
        "GEN",
        "Fills a rectangle with particles. num: at random without overlap, until this number is placed or no more fit "
        "in (1000 consecutive failures, or SET gentry). grid: on a square lattice with a spacing of twice the largest "
        "radius. The sides of the rectangle may be expressions. A rectangle too narrow for a particle is an error; if "
        "not all particles fit, the log reports the number placed.",
        longest="generate",
        options=(
            Option("num", "requested number of particles", kind=ASKED),
            Option("grid", "one particle on every node of a lattice", source="S"),
            Option("idmin", "first id of a lattice", kind=INDEX, default="next free id", source="S"),
            _RADII,
            _BOX_X,
            _BOX_Y,
            _COLOR,
            _GROUP,
        ),
        example=(
            "GEN NUM 20000, rad discrete 60.0 80.0, x (1000.0, 61000.0), y (1000.0, 13000.0), COLOR black GROUP sand",
            "GEN NUM 1e5 rad discrete 60.0 80.0, x ({left}, {right}), y ({top}-1000.0, {top}), COLOR red GROUP sed1",
            "GEN grid idmin 0 rad discrete 0.1e-3 0.1e-3 0.2e-3, x (5e-3, 605e-3), y (5e-3, 155e-3)",
        ),
    ),
    Command(
        "GLINE",
        "Creates a row of equal particles from p1 towards p2, with a spacing of 2 rad cratio, the first at p1.",
        options=(
            Option("p1", "first centre", kind=POINT, unit="m", required=True),
            Option("p2", "end of the row", kind=POINT, unit="m", required=True),
            _RAD,
            Option("cratio", "distance between neighbours over the sum of their radii", kind=RATIO, default="1"),
            _KN,
            _KS,
            _FRIC,
            _COLOR,
            _GROUP,
        ),
        example=("GLINE P1 ( 2.0 10.0 ) P2 ( 40.0 10.0 ), RAD=0.5 kn=4.14e3 ks=4.14e3 fric=0.55 GROUP=bom CRATIO=0.8",),
        does="particles.gline",
    ),
    Command(
        "CLUMP",
        "Creates rigid bodies made of discs. With file: adds the clumps of a file (docs/files.md), searched for as by "
        "LOAD; the file is scaled, rotated about its origin and moved by (x y); mass and inertia are density times "
        "area and polar second moment of area in the file. Without file: the selected particles become one clump, with "
        "the sums of their areas and moments. RANGE selects complete clumps by their centre, also in DEL, PROP and "
        "FIX; PROP xv yv spin act on the centre, and BOX deletes clumps whose centre leaves it. Clumps need SET disk "
        "on.",
        source="X",
        options=(
            Option("file", "clump file", kind=FILE, source="X"),
            Option("x", "new position of the origin of the file", kind=FLOAT, unit="m", default="0", source="X"),
            Option("y", "new position of the origin of the file", kind=FLOAT, unit="m", default="0", source="X"),
            Option("angle", "rotation of the file, anticlockwise", kind=FLOAT, unit="rad", default="0", source="X"),
            Option("scale", "factor on all lengths of the file", kind=POSITIVE, default="1", source="X"),
            replace(_COLOR, default="lg; joined particles keep theirs", source="X"),
            replace(_GROUP, default="***; joined particles keep theirs", source="X"),
        ),
        ranged=True,
        example=(
            "CLUMP file gravel.clumps x 10.0 y 4.0 color yellow group gravel",
            "CLUMP group boulder RANGE id 10 14",
        ),
    ),
    Command(
        "SECTION",
        "Uses the polygons or lines of a section: GeoJSON, shapefile, SVG, DXF, or an image with a legend "
        "(docs/sections.md). Particles with their centres in a polygon get its name as group (lower case, blanks as _) "
        "and its attributes density, fric, kn, ks, shear, poiss, damp, hertz, color; later polygons of the file cover "
        "earlier ones. With rad, fills the polygons with new particles instead. With cut, removes the bonds that cross "
        "a line; with bond properties (as of PROP), changes them. The log reports unit, areas, overlaps, gaps and "
        "ignored objects.",
        source="X",
        leading=(Option("file", "section file", kind=FILE, required=True, source="X"),),
        options=(
            Option("scale", "metres per unit of the file", kind=POSITIVE, unit="m", default="the unit of the file, "
                   "else 1", source="X"),
            Option("origin", "point of the file, in its units, that is moved to `to`", kind=POINT, default="0 0",
                   source="X"),
            Option("to", "position of the origin in the model", kind=POINT, unit="m", default="0 0", source="X"),
            Option("line", "two points of a map with heights, in its units: x is the distance along their line, y the "
                   "height", kind=SEGMENT, source="X"),
            Option("legend", "legend of an image: a file with lines of colour and name", kind=FILE, source="X"),
            Option("attribute", "attribute whose value is the name (GeoJSON, shapefiles)", kind=FILE,
                   default="name, layer, unit, formation, label or id", source="X"),
            Option("only", "names of the polygons and lines that are used", kind=NAMES, default="all", source="X"),
            Option("rad", "radii drawn at random, a repeated one more often", kind=RADII, unit="m", source="X"),
            Option("porosity", "porosity of the filled polygons, by area", kind=RATIO, default="0.2", source="X"),
            Option("cut", "removes the bonds that cross a line", source="X"),
            *(replace(option, required=False, source="X") for option in _PROPERTIES if option.name in (
                "ebmod", "gbmod", "tstrength", "sstrength", "n_bond", "s_bond")),
        ),
        ranged=True,
        example=(
            "SECTION wedge.geojson rad discrete 60.0 80.0",
            "SECTION wedge.svg scale 25.0 only sand|shale RANGE y 0.0 3000.0",
            "SECTION faults.shp origin (512300.0 3481200.0) cut",
            "SECTION wedge.dxf only f1 tstrength 1e5 sstrength 2e5",
            "SECTION wedge.png scale 12.5 legend wedge.txt",
        ),
        does="sections.section",
    ),
    Command(
        "SURFACE",
        "Switches a surface process on; it acts at steps that are multiples of the interval (docs/surface.md). Eroded "
        "discs are removed from the top of the columns, deposited ones are laid into hollows of the surface; what is "
        "less than a disc is carried to the next application. The balance is in the log and in surface.csv. Needs SET "
        "gravity along -y; does not support clumps.",
        source="X",
        options=tuple(replace(option, source="X") for option in (
            _id("number of the process; a second command with it replaces its settings, its balance continues"),
            Option("interval", "steps between two applications", kind=COUNT, unit="steps"),
            Option("x", "range in which it acts, also on a bare floor, up to the next steep walls", kind=INTERVAL,
                   unit="m", default="as far as the particles reach"),
            Option("spacing", "width of the columns", kind=POSITIVE, unit="m", default="4 times the largest radius"),
            Option("diffuse", "coefficient of diffusion of the heights", kind=POSITIVE, unit="m2/s", default="off"),
            Option("slope", "largest angle of the surface; what is steeper slides down", kind=POSITIVE, unit="deg",
                   default="off"),
            Option("erode", "rate of erosion", kind=POSITIVE, unit="m/s", default="at once, with above"),
            Option("above", "level down to which it erodes", kind=FLOAT, unit="m", default="no level"),
            Option("deposit", "rate of deposition", kind=POSITIVE, unit="m/s",
                   default="with below, one spacing per application"),
            Option("below", "level up to which it deposits", kind=FLOAT, unit="m", default="no level"),
            Option("rise", "velocity of the levels, upwards, from the command on", kind=FLOAT, unit="m/s", default="0"),
            Option("years", "years that a second of the model stands for; diffuse, erode, deposit and rise are then "
                   "per year", kind=POSITIVE),
            Option("only", "groups of which discs may be eroded; others protect what is under them", kind=NAMES,
                   default="all"),
            replace(_RADII, required=False, doc="radii of the deposit, drawn at random, a repeated one more often"),
            Option("porosity", "porosity of eroded and deposited rock: bulk area = area of discs / (1 - porosity)",
                   kind=NOT_NEGATIVE, default="0.15"),
            Option("compact", "compaction of the deposit: its porosity at the surface, and the depth in m at which it "
                   "has decreased to 1/e of that; discs shrink as they are buried and keep their mass", kind=POINT,
                   default="off"),
            Option("group", "group of the deposit", kind=NAME, default="growth"),
            Option("episode", "steps after which a new group begins: growth1, growth2, ...", kind=COUNT, unit="steps",
                   default="one group"),
            Option("colors", "colours of these groups in turn", also=("colours",), kind=NAMES,
                   default="yellow|gb|green|violet"),
            *(option for option in _PROPERTIES if option.name in (*PROPERTIES, "hertz")),
            Option("off", "ends the process"),
        )),
        example=(
            "SURFACE id 1 interval 500 diffuse 2.0 slope 30.0 rad discrete 45.0 60.0 density 2300.0 shear 2.9e9 "
            "poiss 0.2 damp 0.4 fric 0.3 hertz group growth episode 10000 colors yellow|gb",
            "SURFACE id 2 interval 500 erode 0.05 above 2900.0 only sand|cover",
            "SURFACE id 3 interval 500 deposit 1e-3 below 2300.0 years 300.0 x (3000.0 18000.0) rad discrete 45.0 "
            "density 2300.0 kn 1e8 ks 1e8 fric 0.3",
            "SURFACE id 1 off",
        ),
        does="surface.surface",
    ),
    Command(
        "DEL",
        "Deletes particles with their contacts and bonds.",
        longest="delete",
        ranged=True,
        example=("DEL RANGE y {top}-1000.0, {top}",),
        does="particles.delete",
    ),
    Command(
        "TWIN",
        "Moves one free particle by 1e-5 of its radius; the number determines which particle, and the direction. Twin "
        "0 is the undisturbed model. Twins show how much results depend on chance (hpcdem sweep --twins).",
        source="X",
        leading=(Option("number", "number of the twin", kind=INDEX, required=True, source="X"),),
        ranged=True,
        example=("TWIN 3", "TWIN 3 RANGE group rock"),
        does="particles.twin",
    ),
    Command(
        "EXP",
        "Writes x y r of particles to a text file that LOAD reads. Its folder must exist before the run begins.",
        longest="export",
        leading=(Option("file", "file of particles", kind=FILE, required=True),),
        options=(Option("group", "the group as a fourth column"),),
        ranged=True,
        example=("EXP init_xyr.dat GROUP RANGE y 1000.0 2000.0",),
        does="particles.export",
    ),
    # ---- properties
    Command(
        "PROP",
        _PROP_DOC,
        options=_PROPERTIES,
        ranged=True,
        example=(
            "PROP density 2.5e3, fric 0.0, shear 2.9e9, poiss 0.2, damp 0.4, hertz",
            "PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7 fric 0.3 RANGE x (1.0 10.0) y (1.0 10.0)",
            "PROP tolerate rext 0.4 n_bond 1e4 s_bond 1e4 RANGE group base",
            "PROP kn 1e7 ks 1e7 fric 0.5 law sticky.py:sticky parameter pull 2e3",
            "PROP law glue.py:glue between sticky.py:sticky|linear parameter pull 50.0",
        ),
    ),
    Command("INIT", "Another name of PROP.", options=_PROPERTIES, ranged=True, same_as="PROP",
            example=("INI xv 2.0 RANGE group base",)),
    Command(
        "BOND",
        "Breaks the bonds between selected particles.",
        leading=(Option("break", "the only action of BOND", required=True),),
        ranged=True,
        example=("BOND break RANGE y 1.0 10.0",),
        does="bonds.break_bonds",
    ),
    Command(
        "FIX",
        "Prescribes the present velocity of the selected particles in these degrees of freedom, independent of forces.",
        options=_DEGREES,
        ranged=True,
        example=("FIX y spin RANGE group base",),
    ),
    Command("FREE", "Revokes FIX.", options=_DEGREES, ranged=True, example=("FREE x RANGE group base",)),
    # ---- settings
    Command(
        "SET",
        "Settings; several on one line. Intervals of 0 or less switch that output off.",
        options=_SETTINGS,
        example=("SET DT 5e-2, GRAVITY 0.0, -9.8", "SET disk off", "SET print 1000 ps 5000", "SET damp lsm 0.04",
                 "SET units SI"),
    ),
    # ---- running
    Command(
        "CYC",
        "Executes a number of steps. Writes a frame all_<step>_ini first.",
        longest="cycle",
        leading=(Option("steps", "steps", kind=INDEX, required=True),),
        example=("CYC 5000",),
        does="cycles.cycle",
    ),
    Command(
        "IMPLE",
        "Executes steps until a wall has moved the distance at its velocity: nint(distance / (|velocity| dt)) steps. "
        "Writes a frame all_<step>_ini first and one at the end; the intervals of SET are inactive meanwhile.",
        also=("implie",),
        leading=(Option("wall", "the only object that can be moved", required=True),),
        options=(
            _id("number of the wall"),
            Option("xmove", "distance in x", kind=DISTANCE, unit="m"),
            Option("ymove", "distance in y", kind=DISTANCE, unit="m", source="X"),
            *(Option(name, f"{one.what} at this interval of wall displacement", kind=NOT_NEGATIVE, unit="m",
                     default="off", source=one.sources[1]) for name, one in OUTPUTS.items()),
        ),
        example=("IMPLE wall id 1 xmove 10000.0 save 2000.0 print 1000.0 ps 1000.0 vtk 1000.0",),
    ),
    Command(
        "SAV",
        "Writes a checkpoint of this name in the folder of the script. Its folder must exist before the run begins.",
        longest="save",
        source="S",
        leading=(Option("file", "restart file", kind=FILE, required=True, source="S"),),
        example=("SAV initxyr.sav",),
        does="checkpoints.save",
    ),
    # ---- histories and pictures
    Command(
        "HIST",
        "Records a number at an interval of steps in data/hist_id_<id>.dat (step, value: the layout of ZDEM's readers) "
        "and data/hist_<id>.csv (with the time). Stresses and strains are positive in compression and shortening.",
        source="S",
        longest="history",
        options=(
            Option("id", "number of the history", kind=INDEX, required=True, source="S"),
            Option("interval", "steps between two records", kind=COUNT, unit="steps", required=True, source="S"),
            Option("kinetic", "record the kinetic energy", source="S"),
            Option("step", "record the number of the step", source="S"),
            Option("energy", "record the kinetic and elastic energy", source="X"),
            Option("time", "record the time", source="X"),
            Option("unbalanced", "record the unbalanced force over the mean contact force", source="X"),
            Option("deflection", "record the largest deflection of the bases of FLEXURE", source="X"),
            Option("period", "record the distance between periodic sides", source="X"),
            Option("contacts", "record the number of closed contacts", source="X"),
            Option("bonds", "record the number of bonds", source="X"),
            *(Option(name, f"record the mean stress {text} between periodic sides and the floor and lid of BOX [Pa]",
                     source="X")
              for name, text in (("sxx", "in x"), ("syy", "in y"), ("sxy", "in x across horizontal lines"))),
            Option("gstress", "record the axial stress [Pa] on an end wall made of the particles of a group: force of "
                   "all others on it, over its width and SET thickness; the axis is across the row", kind=OF_GROUP,
                   source="P"),
            Option("gstrain", "record (D0 - D) / D0, D the distance of the mean positions of two groups along the axis "
                   "in which they are farther apart, D0 that at the HIST command", kind=OF_GROUPS, source="P"),
            Option("wall", "the wall of xstress, ystress", kind=OF_WALL, source="P"),
            Option("xstress", "record the force in x of the particles on a wall, over its height and SET thickness "
                   "[Pa]", kind=THIS_WALL, source="P"),
            Option("ystress", "record the force in y of the particles on a wall, over its width and SET thickness "
                   "[Pa]", kind=THIS_WALL, source="P"),
            Option("xstrain", "record (D0 - D) / D0, D the distance of the middles of two walls in x", kind=OF_WALLS,
                   source="P"),
            Option("ystrain", "record (D0 - D) / D0, D the distance of the middles of two walls in y", kind=OF_WALLS,
                   source="P"),
        ),
        example=("HIST ID 1 INTERVAL 1000 , kinetic", "HIST ID 2 INTERVAL 1000 , step",
                 "HIST ID 3 INTERVAL 10 , gstress group top_wall",
                 "HIST ID 4 INTERVAL 10 , gstrain group top_wall|bom_wall",
                 "HIST ID 5 INTERVAL 10 , wall id 3 ystress", "HIST ID 6 INTERVAL 10 , ystrain wall 0|3"),
    ),
    Command(
        "PLOT",
        "Writes and draws one history over another at the end of the run: hist_<y>_vs_<x>.txt and .png.",
        source="S",
        leading=(
            Option("hist", "only histories can be plotted; the word is optional", source="S"),
            Option("x", "history on the x axis", kind=INDEX, required=True, source="S"),
            Option("y", "history on the y axis", kind=INDEX, required=True, source="S"),
        ),
        example=("PLOT hist 2 1",),
        does="history.plot_hist",
    ),
    Command(
        "DRAW",
        "Draws pictures during the run, draw_<step>.jpg, if the run was started with --draw; otherwise the log "
        "mentions them. A word with - before it switches an item off.",
        source="S",
        options=(
            Option("interval", "steps between two drawings", kind=COUNT, unit="steps", source="S"),
            Option("bfill", "particles filled, not as circles", switch=True, source="S"),
            Option("bline", "outlines of particles", switch=True, source="P"),
            Option("wall", "walls", switch=True, source="S"),
            *(Option(name, doc, switch=True, source="W") for name, doc in (
                ("bondc", "bonds"), ("bid", "ids"), ("bang", "rotations"), ("mesh", "search cells"),
                ("cforce", "contact forces"))),
        ),
        example=("DRAW INTERVAL 200, bfill wall", "DRAW INTERVAL 100 -bline bfill bondc wall"),
    ),
    Command(
        "LOG",
        "Accepted, without effect: the log goes to standard output; redirect it to keep it.",
        source="P",
        leading=(Option("state", "", kind=Choice("on|off", "on or off", (("on", "on"), ("off", "off"))), required=True,
                        source="P"),),
        example=("LOG on",),
    ),
    Command("PAUSE", "Accepted, without effect: runs are not interactive.", source="P", example=("PAUSE",)),
)  # fmt: skip

RANGE_TERMS = (
    Option("x", "centres with a <= x < b", kind=INTERVAL, unit="m"),
    Option("y", "centres with a <= y < b", kind=INTERVAL, unit="m"),
    Option("P4", "centres inside a quadrilateral, corners in order (even-odd rule)", kind=CORNERS, unit="m"),
    Option("ellipse", "centres with (x-x0)^2/a^2 + (y-y0)^2/b^2 <= 1", kind=ELLIPSE, unit="m"),
    Option("group", "particles of a group", kind=NAME),
    Option("id", "particles with first <= id <= last", kind=IDS, source="S"),
    Option("and", "both; also where two terms follow each other without a word"),
    Option("or", "either"),
)

ZDEM = Table(COMMANDS, RANGE_TERMS)
