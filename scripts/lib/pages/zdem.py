"""The reference page of the ZDEM language, made from the table."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.lang.zdem.table import COLORS, FLAG, SOURCES, ZDEM, Choice, Command, Option, Row, Table
from scripts.lib.pages.markdown import escaped, first_sentence, overview, wrapped

_TOP = """\
# ZDEM commands

This page is generated from the table in `hpcdem/lang/zdem/table.py` by `./scripts/pages`; do not edit it.

## Rules of scripts

- One command per line. Upper and lower case are equivalent, except in file names.
- `( ) = ,` and blanks are separators: `fric=0.3`, `fric 0.3` and `(fric, 0.3)` are equivalent.
- `# ! ;` begin a comment; comments may be in any text encoding, everything else is UTF-8.
- Whole numbers may be written `100000.0`.
- Commands may be shortened to three letters or more; in the headings below the optional letters are in brackets.
  Keywords may be shortened to two letters or more, if no other keyword of the command begins with the same letters. An
  unknown word whose first three letters are those of a single keyword (`gravtiy`) is interpreted as that keyword, with
  a warning.
- The first command is START, RESTORE or LOAD. Lines after STOP are ignored.
- A separate line `friction = 0.3` defines a parameter; later lines use it as `{friction}` instead of a number
  ([Sweeps](sweep.md)). ZDEM itself does not support parameters. A parameter must not have the name of a command. A
  parameter that is never used is an error.
- hpcdem checks the complete script before anything runs. If a line is wrong, it reports the first one with its number
  and runs nothing.
- Units are SI. File names are relative to the folder of the script.
"""

_RANGE = """\
## RANGE

RANGE is written at the end of the line and limits a command to some particles; without it the command applies to all.
Terms are joined by `and` and `or`, from left to right with equal precedence. `x (a b) y (c d)` is one term, a
rectangle: `group sed or x (6 8) y (0 2)` selects the group and all particles in the rectangle. Other terms without a
word between them are joined by `and`.
A particle is selected by the position of its centre. Because a particle is in one group only, adjacent group terms
joined by `and` select the particles of all these groups.
"""

_VARIABLES = """\
### Variables

In RANGE, and in `x` and `y` of GEN, a number may be an expression of `{left} {right} {bottom} {top}`: the extents
min(x - r), max(x + r), min(y - r), max(y + r) of the particles that are not fixed in both x and y, at the moment of the
command. Operators are `+ - * /`; no blanks inside, no parentheses. Example: `DEL RANGE y {top}-1000.0, {top}`.
"""


def page(table: Table = ZDEM) -> str:
    """The whole page, in Markdown."""
    said = {command.name: first_sentence(command.doc) for command in table.commands}
    parts = [_TOP, overview("Commands", "| command | effect |", said)]
    parts += [_command(command) for command in table.commands]
    parts += [_RANGE, _options(table.range_terms), "", _VARIABLES, _colors()]
    return "\n".join(parts).rstrip("\n") + "\n"


def _command(command: Command) -> str:
    lines = [f"## {command.name}", "", f"`{_shortened(command)}` {_remarks(command)}", "", command.doc, "", "```"]
    lines += [*_syntax(command), "```", ""]
    if command.same_as:
        return "\n".join(lines)
    values = [option for option in command.leading if option.kind is not FLAG]
    if values or command.options:
        lines += [_options(command.options, values), ""]
    lines += ["Example:" if len(command.example) == 1 else "Examples:", "", "```", *command.example, "```", ""]
    return "\n".join(lines)


def _syntax(command: Command) -> list[str]:
    """One line: fixed words and values, then the keywords (in brackets where they may be left out)."""
    words = [command.name]
    for option in command.leading:
        word = option.name if option.kind is FLAG else option.kind.pattern
        words.append(word if option.required else f"[{word}]")
    if command.same_as:
        words.append(f"... (as {command.same_as})")
    else:
        for option in command.options:
            word = f"{option.name} {_pattern(option)}".strip()
            words.append(word if option.required else f"[{word}]")
    if command.ranged and not command.same_as:
        words.append("[RANGE ...]")
    return wrapped(words)


def _options(options: Sequence[Option], values: Sequence[Option] = ()) -> str:
    """A table of values that stand alone, and of keywords."""
    rows = ["| keyword | value | unit | default | meaning | from |", "|---|---|---|---|---|---|"]
    for option in [*values, *options]:
        cells = [
            f"`{_shortened(option)}`" if option not in values else "",
            f"`{_pattern(option)}`" if option.kind is not FLAG else "",
            option.unit,
            "required" if option.required else f"`{option.default}`" if option.default else "",
            option.doc + _also(option) + ("" if option.executed else " (**not supported yet**)"),
            option.source,
        ]
        rows.append("| " + " | ".join(escaped(cell) for cell in cells) + " |")
    return "\n".join(rows)


def _pattern(option: Option) -> str:
    return option.kind.pattern if not isinstance(option.kind, Choice) else f"<{option.kind.pattern}>"


def _shortened(row: Row) -> str:
    """``DEN[SITY]``: what may be left out in brackets."""
    full = row.longest or row.name
    if isinstance(row, Command):
        full = full.upper()
    return full if len(full) <= 3 else f"{full[:3]}[{full[3:]}]"


def _remarks(row: Row) -> str:
    state = "" if row.executed else "; **not supported yet**"
    return f"(from: {SOURCES[row.source]}{_also(row)}{state})"


def _also(row: Row) -> str:
    return f"; also accepted: {', '.join(f'`{word}`' for word in row.also)}" if row.also else ""


def _colors() -> str:
    rows = ["## Colours", "", "By number or name:", "", "| number | name |", "|---|---|"]
    rows += [f"| {number} | {name} |" for name, number in COLORS.items()]
    sources = ["", "## Sources", "", "The last column of the tables gives the source of a keyword:", ""]
    sources += [f"- {tag}: {text}" for tag, text in SOURCES.items()]
    return "\n".join(rows + sources)
