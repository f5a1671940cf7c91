"""What can be said of a script without running it."""

from __future__ import annotations

import warnings
from collections import Counter

from hpcdem.errors import ScriptError
from hpcdem.lang.pcdc import source
from hpcdem.lang.pcdc.source import Source
from hpcdem.lang.pcdc.statement import Pending


def read(text: str, file: str) -> Source:
    """The script, read and compiled; ScriptError at its first wrong line."""
    script = source.read(text, file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            compile(script.python, file, "exec")
        except SyntaxError as error:  # what only the compiler finds, such as a return outside of a function
            line = error.lineno or 1
            raise ScriptError(file, line, f"{script.line(line)}: this is not correct Python: {error.msg}") from None
    return script


def summary(text: str, file: str) -> str:
    """What hpcdem --check says: how many commands of which kind, and names that are used but made nowhere."""
    script = read(text, file)
    counts = Counter(statement.command.name for statement in script.statements)
    lines = [f"{file}: {len(script.statements)} commands read, nothing was run"]
    lines += [f"  {number:4d} {name}" for name, number in sorted(counts.items())]
    lines += [f"warning: {text}" for text in _loose_names(script)]
    return "\n".join(lines)


def _loose_names(script: Source) -> list[str]:
    """Geometry layers and tables that are named but made nowhere. Where names are expressions nothing is said."""
    made: dict[str, set[str]] = {"geometry layer": set(), "table": set()}
    used: list[tuple[int, str, str]] = []
    for statement in script.statements:
        name, given = statement.command.name, statement.arguments
        if name in ("model restore", "mesh import"):
            return []
        if name == "mesh structured" or name == "mesh equilateral":
            made["geometry layer"] |= {"left", "right", "bottom", "top"}
        if "as-layer" in given or name == "table create":
            new = given.get("as-layer", given.get("name"))
            if isinstance(new, Pending):
                return []
            made["table" if name == "table create" else "geometry layer"].add(new)
        for word in ("from-layer", "layer", "inside"):
            if isinstance(given.get(word), str):
                used.append((statement.line, "geometry layer", given[word]))
        for term, value in statement.range or ():
            if term == "geometry" and isinstance(value, str):
                used.append((statement.line, "geometry layer", value))
        for value in given.get("properties", {}).values():
            if hasattr(value, "name") and isinstance(value.name, str):
                used.append((statement.line, "table", value.name))
    return [f"line {line}: no line makes the {kind} '{name}'" for line, kind, name in used if name not in made[kind]]
