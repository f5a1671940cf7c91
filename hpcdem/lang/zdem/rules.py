"""Rules for the words of one line and for the order of commands."""

from __future__ import annotations

import os.path
from collections.abc import Callable, Sequence
from typing import Any

from hpcdem.core import limits
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.section_files import KNOWN, is_section
from hpcdem.core.selection import has_expressions
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.statement import Statement

BEGINNINGS = "START, RESTORE or LOAD"
BOND_MODEL_1 = ("ebmod", "gbmod", "tstrength", "sstrength")
BOND_MODEL_2 = ("n_bond", "s_bond")
BOND_KEYS = (*BOND_MODEL_1, *BOND_MODEL_2, "tolerate", "rext", "rubber", "conserving", "moment")

_HIST = next(command for command in t.COMMANDS if command.name == "HIST")
RECORDED = tuple(option.name for option in _HIST.options if option.name not in ("id", "interval", "wall"))
"""Quantities that HIST records."""


def check_statement(statement: Statement) -> None:
    """ScriptError if the words of the line do not fit together."""
    rule = _RULES.get(statement.command)
    if rule is not None:
        rule(statement)


def check_place(statement: Statement, before: Sequence[Statement]) -> None:
    """ScriptError if the command may not stand here; `before` are the statements above it."""
    begins = statement.command in ("START", "RESTORE", "LOAD")
    if not before and not begins:
        raise ScriptError(
            statement.file, statement.line, f"the first command is {statement.command}; it must be {BEGINNINGS}"
        )
    # START followed at once by LOAD or RESTORE loses nothing; anything else would throw a model away unnoticed.
    after_start = len(before) == 1 and before[0].command == "START" and statement.command != "START"
    if before and begins and not after_start:
        raise statement.error("begins a new calculation and must be the first command of a script")


def _wall(s: Statement) -> None:
    if len(s.arguments) == 1:
        raise s.error("nothing to do; give nodes, kn, ks, fric, color, xv, yv or delete")
    if "delete" in s.arguments and len(s.arguments) > 2:
        raise s.error("delete accepts only the id")
    nodes = s.get("nodes")
    if nodes is not None and nodes[0] == nodes[1]:
        x, y = nodes[0]
        raise s.error(f"the wall has no length, both nodes are ({x}, {y})")
    if nodes is not None:
        _within(s, limits.check_nodes, *nodes)


def _box(s: Statement) -> None:
    left, right, bottom = s.get("left"), s.get("right"), s.get("bottom")
    if right <= left:
        raise s.error(f"right, {right}, must be above left, {left}")
    _within(s, limits.check_nodes, (left, bottom), (right, bottom), "the BOX")
    _within(s, limits.check_nodes, (left, bottom), (left, bottom + s.get("height")), "the BOX")


def _periodic(s: Statement) -> None:
    if "x" not in s.arguments and "xv" not in s.arguments:
        raise s.error("give x, the left and the right side, or xv, a velocity of the right side")
    if "x" in s.arguments and not has_expressions(s.get("x")):
        left, right = s.get("x")
        if not left < right:
            raise s.error(f"the left side, {left}, must be below the right side, {right}")
        _within(s, limits.check_nodes, (left, 0.0), (right, 0.0), "PERIODIC")


def _ball(s: Statement) -> None:
    _within(s, limits.check_circle, s.get("x"), s.get("y"), s.get("rad"))


def _gen(s: Statement) -> None:
    if ("num" in s.arguments) == ("grid" in s.arguments):
        raise s.error("give either num <int> or grid")
    if "idmin" in s.arguments and "grid" not in s.arguments:
        raise s.error("idmin belongs to GEN grid")
    if not has_expressions((s.get("x"), s.get("y"))):
        _within(s, limits.check_rectangle, s.get("rad"), s.get("x"), s.get("y"), "grid" in s.arguments)


def _gline(s: Statement) -> None:
    if s.get("p1") == s.get("p2"):
        raise s.error("p1 and p2 are the same point; BALL makes a single particle")
    _within(s, limits.check_row, s.get("p1"), s.get("p2"), s.get("rad"), s.get("cratio", 1.0))


def _section(s: Statement) -> None:
    weak = [name for name in (*BOND_MODEL_1, *BOND_MODEL_2) if name in s.arguments]
    acts = [name for name in ("rad", "cut") if name in s.arguments] + weak[:1]
    if len(acts) > 1:
        raise s.error(f"{acts[0]} and {acts[1]} exclude each other; use a line for each")
    if weak and weak[-1] in BOND_MODEL_2 and weak[0] in BOND_MODEL_1:
        raise s.error(f"{weak[0]} and {weak[-1]} belong to different bond models; a bond is of one model")
    if "porosity" in s.arguments and "rad" not in s.arguments:
        raise s.error("porosity applies to filled polygons only: give rad")
    if "rad" in s.arguments and s.selection is not None:
        raise s.error("RANGE selects existing particles, rad makes new ones; select polygons by only")
    if not is_section(s.get("file")):
        raise s.error(f"{s.get('file')}: unknown ending of a section; known: {KNOWN}")


def _surface(s: Statement) -> None:
    _within(s, limits.check_surface, s.arguments)
    for name in s.get("colors", ()):
        if name.lower() not in t.COLORS:
            raise s.error(f"colors: expected {', '.join(t.COLORS)}, got {name}")


def _flexure(s: Statement) -> None:
    if ("wall" in s.arguments) == (s.selection is not None):
        raise s.error("give either a wall, or the particles of a row by RANGE")
    if "off" in s.arguments:
        others = s.arguments.keys() - {"off", "wall"}
        if others:
            raise s.error(f"off accepts only the base, not {min(others)}")
        return
    of_plate = [name for name in ("young", "te", "poisson") if name in s.arguments]
    if "rigidity" in s.arguments and of_plate:
        raise s.error(f"rigidity and {of_plate[0]} exclude each other; give rigidity, or young, poisson and te")
    if "rigidity" not in s.arguments and not {"young", "te"} <= s.arguments.keys():
        raise s.error("give the flexural rigidity: rigidity, or young and te")
    if "contrast" not in s.arguments:
        raise s.error("give contrast, the difference of densities that restores the plate")


def _clump(s: Statement) -> None:
    placing = [name for name in ("x", "y", "angle", "scale") if name in s.arguments]
    if "file" in s.arguments and s.selection is not None:
        raise s.error("RANGE selects existing particles, a file adds new ones; give one of them")
    if "file" not in s.arguments and placing:
        raise s.error(f"{placing[0]} belongs to CLUMP file")
    if "file" not in s.arguments and s.selection is None:
        raise s.error("give a file, or select the particles of one clump by RANGE")


def _prop(s: Statement) -> None:
    if not s.arguments:
        raise s.error("nothing to set before RANGE" if s.selection else "nothing to set")
    if "between" in s.arguments:
        strange = [key for key in s.arguments if key not in ("law", "between", "parameter")]
        if "law" not in s.arguments or strange or s.selection:
            raise s.error(
                "between assigns the law of all pairs of discs with these two laws; it accepts only law and parameter"
                + (f", not {strange[0]}" if strange else ", no RANGE" if s.selection else "")
            )
    first = [key for key in BOND_MODEL_1 if key in s.arguments]
    second = [key for key in BOND_MODEL_2 if key in s.arguments]
    for word, does in (("rubber", "marks"), ("conserving", "applies to"), ("moment", "applies to")):
        if word in s.arguments and not first and not second:
            raise s.error(f"{word} {does} the bonds of the same line; give their strengths with it")
    if "moment" in s.arguments and not s.get("ebmod"):
        raise s.error("moment: the bending stiffness follows from ebmod; assign ebmod above 0 with it")
    if first and second:
        raise s.error(f"{first[0]} and {second[0]} belong to different bond models; a bond is of one model")


def _degrees(s: Statement) -> None:
    if not s.arguments:
        raise s.error("give one or more of x, y, spin")


def _set(s: Statement) -> None:
    if not s.arguments:
        raise s.error("give what to set: " + t.joined(option.name for option in _SET.options))
    if "outdir" in s.arguments and _is_script(s, s.get("outdir")):
        raise s.error(f"outdir {s.get('outdir')} is the script itself")


def _imple(s: Statement) -> None:
    if ("xmove" in s.arguments) == ("ymove" in s.arguments):
        raise s.error("give one distance: xmove or ymove")


def _hist(s: Statement) -> None:
    if sum(name in s.arguments for name in RECORDED) != 1:
        raise s.error(f"give what to record: {', '.join(RECORDED[:-1])} or {RECORDED[-1]}")
    stresses = [name for name in ("xstress", "ystress") if name in s.arguments]
    if "wall" in s.arguments and not stresses:
        raise s.error("wall applies to xstress and ystress; strains need two walls: ystrain wall 0|3")
    for stress in stresses:
        if len((*s.get("wall", ()), *s.get(stress))) != 1:
            raise s.error(f"give the wall once: wall id 3 {stress}")
    for strain in ("gstrain", "xstrain", "ystrain"):
        both = s.get(strain)
        if both is not None and both[0] == both[1]:
            raise s.error(f"{strain} needs two different ones, both are {both[0]}")


def recorded(s: Statement) -> str:
    """Return the quantity of a HIST line in the words of `commands.history.hist`: ``kinetic``, ``gstrain group a|b``,
    ``ystress wall 3``."""
    name = next(name for name in RECORDED if name in s.arguments)
    if s.arguments[name] is True:
        return name
    of = s.get(name) or s.get("wall")
    return f"{name} {'group' if name[0] == 'g' else 'wall'} {'|'.join(map(str, of))}"


def _output(s: Statement) -> None:
    name = s.get("file")
    if _is_script(s, name):
        raise s.error(f"{name} is the script itself, and would be overwritten")
    if name.endswith(("/", os.sep)) or os.path.basename(name) in (".", ".."):
        raise s.error(f"{name} is a folder, expected a file name")


def _is_script(s: Statement, name: str) -> bool:
    return os.path.normpath(os.path.join(os.path.dirname(s.file), name)) == os.path.normpath(s.file)


def _within(s: Statement, check: Callable[..., None], *values: Any) -> None:
    try:
        check(*values)
    except CommandError as error:
        raise s.error(str(error)) from None


_SET = next(command for command in t.COMMANDS if command.name == "SET")

_RULES: dict[str, Callable[[Statement], None]] = {
    "WALL": _wall,
    "BOX": _box,
    "PERIODIC": _periodic,
    "BALL": _ball,
    "EXP": _output,
    "SAV": _output,
    "GEN": _gen,
    "GLINE": _gline,
    "CLUMP": _clump,
    "FLEXURE": _flexure,
    "SECTION": _section,
    "SURFACE": _surface,
    "PROP": _prop,
    "FIX": _degrees,
    "FREE": _degrees,
    "SET": _set,
    "IMPLE": _imple,
    "HIST": _hist,
}
