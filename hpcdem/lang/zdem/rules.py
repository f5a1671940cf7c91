"""What must hold between the words of one line, and where a command may stand."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hpcdem.errors import ScriptError
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.statement import Statement
from hpcdem.selection import has_expressions

BEGINNINGS = "START, RESTORE or LOAD"
BOND_MODEL_1 = ("ebmod", "gbmod", "tstrength", "sstrength")
BOND_MODEL_2 = ("n_bond", "s_bond")
BOND_KEYS = (*BOND_MODEL_1, *BOND_MODEL_2, "tolerate", "rext")


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
            statement.file,
            statement.line,
            f"the first command is {statement.command}; it must be {BEGINNINGS}",
        )
    # START followed at once by LOAD or RESTORE loses nothing; anything else would throw a model away unnoticed.
    after_start = len(before) == 1 and before[0].command == "START" and statement.command != "START"
    if before and begins and not after_start:
        raise statement.error("begins a new calculation, so it can only be the first command of a script")


def _wall(s: Statement) -> None:
    if len(s.arguments) == 1:
        raise s.error("nothing to do; give nodes, kn, ks, fric, color, xv or yv")
    nodes = s.get("nodes")
    if nodes is not None and nodes[0] == nodes[1]:
        x, y = nodes[0]
        raise s.error(f"the wall has no length, both nodes are ({x}, {y})")


def _box(s: Statement) -> None:
    if s.get("right") <= s.get("left"):
        raise s.error(f"right, {s.get('right')}, must be above left, {s.get('left')}")


def _gen(s: Statement) -> None:
    if ("num" in s.arguments) == ("grid" in s.arguments):
        raise s.error("give either num <int> or grid")
    if "idmin" in s.arguments and "grid" not in s.arguments:
        raise s.error("idmin belongs to GEN grid")
    for axis in ("x", "y"):
        low, high = s.get(axis)
        if has_expressions((low, high)):
            continue
        if high - low < 2.0 * min(s.get("rad")):
            raise s.error(f"the rectangle is {high - low:g} m in {axis}, too narrow for a particle")


def _gline(s: Statement) -> None:
    if s.get("p1") == s.get("p2"):
        raise s.error("p1 and p2 are the same point")


def _prop(s: Statement) -> None:
    if not s.arguments:
        raise s.error("nothing to set before RANGE" if s.selection else "nothing to set")
    first = [key for key in BOND_MODEL_1 if key in s.arguments]
    second = [key for key in BOND_MODEL_2 if key in s.arguments]
    if first and second:
        raise s.error(f"{first[0]} and {second[0]} belong to different bond models; a bond is of one model")


def _degrees(s: Statement) -> None:
    if not s.arguments:
        raise s.error("say which of x, y, spin")


def _set(s: Statement) -> None:
    if not s.arguments:
        raise s.error("say what to set: " + t.joined(option.name for option in _SET.options))


def _imple(s: Statement) -> None:
    if ("xmove" in s.arguments) == ("ymove" in s.arguments):
        raise s.error("give one distance: xmove or ymove")


def _hist(s: Statement) -> None:
    if ("kinetic" in s.arguments) == ("step" in s.arguments):
        raise s.error("say what to record: kinetic or step")


_SET = next(command for command in t.COMMANDS if command.name == "SET")

_RULES: dict[str, Callable[[Statement], None]] = {
    "WALL": _wall,
    "BOX": _box,
    "GEN": _gen,
    "GLINE": _gline,
    "PROP": _prop,
    "FIX": _degrees,
    "FREE": _degrees,
    "SET": _set,
    "IMPLE": _imple,
    "HIST": _hist,
}
