"""What can be said of a script without running it."""

from __future__ import annotations

import warnings
from collections import Counter

from hpcdem.commands.fdem.packages import EXTRA, NEEDED
from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc import source
from hpcdem.lang.pcdc.kinds import Pending, TableName
from hpcdem.lang.pcdc.source import Source
from hpcdem.lang.pcdc.statement import Statement
from hpcdem.physics.fdem.tables import Drawn, Over


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
        except (RecursionError, MemoryError):
            raise source.too_deep(script, lambda text: compile(text, file, "exec")) from None
    return script


def packages(script: Source) -> None:
    """ScriptError at the first line whose package is not here, with all others that are missing: before kernels are
    compiled for it."""
    missing = missing_packages(script)
    if missing:
        raise next(iter(missing.values())).error(_in_one(list(missing)))


def missing_packages(script: Source) -> dict[str, Statement]:
    """What is said of each package that is not here, with the first statement that needs it."""
    missing: dict[str, Statement] = {}
    for statement in script.statements:
        needs, file = NEEDED.get(statement.command.name), statement.arguments.get("file")
        for load in (
            needs(file if isinstance(file, str) else "") if needs is not None else ()
        ):  # it may be an expression
            try:
                load()
            except HpcdemError as error:
                missing.setdefault(str(error), statement)
    return missing


def _in_one(messages: list[str]) -> str:
    """Several of them, the command that helps said once."""
    command = f": {EXTRA}"
    alike = [text for text in messages if text.endswith(command)]
    whole = "; ".join(text.removesuffix(command) for text in alike) + (command if alike else "")
    return "; ".join(filter(None, [whole, *(text for text in messages if text not in alike)]))


def summary(text: str, file: str) -> str:
    """What hpcdem --check says: how many commands of which kind, and names that are used but made nowhere."""
    script = read(text, file)
    counts = Counter(statement.command.name for statement in script.statements)
    lines = [f"{file}: {len(script.statements)} commands read, nothing was run"]
    lines += [f"  {number:4d} {name}" for name, number in sorted(counts.items())]
    lines += [f"warning: {text}" for text in _loose_names(script)]
    if missing := missing_packages(script):
        lines.append(f"warning: line {next(iter(missing.values())).line}: {_in_one(list(missing))}")
    return "\n".join(lines)


def _loose_names(script: Source) -> list[str]:
    """Geometry layers, tables and fields that are named but made nowhere. Where names are expressions nothing is
    said."""
    made: dict[str, set[str]] = {"geometry layer": set(), "table": set(), "field": set()}
    used: list[tuple[int, str, str]] = []
    for statement in script.statements:
        name, given = statement.command.name, statement.arguments
        if name in ("model restore", "mesh import"):
            return []
        if name == "mesh structured" or name == "mesh equilateral":
            made["geometry layer"] |= {"left", "right", "bottom", "top"}
        kind = {"table create": "table", "field create": "field"}.get(name, "geometry layer")
        if "as-layer" in given or kind != "geometry layer":
            new = given.get("as-layer", given.get("name"))
            if isinstance(new, Pending):
                return []
            made[kind].add(new)
        for word in ("from-layer", "layer", "inside"):
            if isinstance(given.get(word), str):
                used.append((statement.line, "geometry layer", given[word]))
        for term, value in statement.range or ():
            if term == "geometry" and isinstance(value, str):
                used.append((statement.line, "geometry layer", value))
        for value in (*given.values(), *given.get("properties", {}).values()):
            match value:
                case TableName(of) | Over(of, _) if isinstance(of, str):
                    used.append((statement.line, "table", of))
                case Drawn(of):
                    used.append((statement.line, "field", of))
    return [f"line {line}: no line makes the {kind} '{name}'" for line, kind, name in used if name not in made[kind]]
