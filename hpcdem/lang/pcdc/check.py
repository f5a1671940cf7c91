"""Check of a script by `hpcdem --check`, without running it."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterator
from typing import Any

from hpcdem.commands.fdem.packages import EXTRA, NEEDED
from hpcdem.commands.fdem.values import DEFAULT_LAYER
from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc import source
from hpcdem.lang.pcdc.kinds import Pending, TableName
from hpcdem.lang.pcdc.source import Source
from hpcdem.lang.pcdc.statement import Statement
from hpcdem.lang.pcdc.trial import HEAT, MODELS, OF_FIELDS
from hpcdem.physics.fdem import footprint
from hpcdem.physics.fdem.tables import TEMPERATURE, Drawn, Over


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
    for statement, what, surely in _not_of_six_nodes(script):
        if surely:
            raise statement.error(what)
    return script


def _not_of_six_nodes(script: Source) -> Iterator[tuple[Statement, str, bool]]:
    """Lines that give elements what six-node triangles cannot have, behind `mesh quadratic`; whether they surely do: to
    all elements, and neither line stands in a loop, a choice or a function."""
    made: Statement | None = None
    for statement in script.statements:
        match statement.command.name:
            case "model new" | "model restore":
                made = None
            case "mesh quadratic":
                made = statement
            case "element c-model" | "element property" if made is not None:
                given = statement.arguments.get("properties", statement.arguments)
                model = MODELS.get(statement.arguments.get("model", ""))
                law = "" if model is None or model in (HEAT, *OF_FIELDS) else model.name
                follow = [
                    name for name, value in given.items() if isinstance(value, Over) and value.axis >= TEMPERATURE
                ]
                from hpcdem.physics.fdem.elements.kind import SIX_NODE_TRIANGLE  # with numba: a second

                only = SIX_NODE_TRIANGLE.only(law, follow)
                if only:
                    at_the_margin = all(not script.lines[one.line - 1][:1].isspace() for one in (made, statement))
                    what = f"line {made.line}, mesh quadratic, makes {SIX_NODE_TRIANGLE.plural}, which can have {only}"
                    yield statement, what, statement.range is None and at_the_margin


def packages(script: Source) -> None:
    """ScriptError at the first line whose package is not here, with all others that are missing: before kernels are
    compiled for it."""
    missing = missing_packages(script)
    if missing:
        raise next(iter(missing.values())).error(_in_one(list(missing)))


def missing_packages(script: Source) -> dict[str, Statement]:
    """Report each missing package, with the first statement that needs it."""
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
    """The report of hpcdem --check: number of commands of each kind, and names that are used but never made."""
    script = read(text, file)
    counts = Counter(statement.command.name for statement in script.statements)
    lines = [f"{file}: {len(script.statements)} commands read, nothing was executed"]
    lines += [f"  {number:4d} {name}" for name, number in sorted(counts.items())]
    lines += [f"warning: {text}" for text in _loose_names(script)]
    lines += [f"warning: line {one.line}: {what}" for one, what, _ in _not_of_six_nodes(script)]
    if missing := missing_packages(script):
        lines.append(f"warning: line {next(iter(missing.values())).line}: {_in_one(list(missing))}")
    return "\n".join(lines)


def memory(text: str, file: str, ranks: int, here: int, free: float | None) -> str:
    """A line about the memory that the largest model of a script will take on these ranks, as far as it tells the sizes
    of its meshes; "" if it tells none. here: ranks per node; free [B]: of a node, None: not known. HpcdemError if the
    model cannot fit."""
    models, other = [(0, 2, False)], 0
    for statement in read(text, file).statements:
        if statement.command.name == "model new":
            models.append((0, 2, False))
        if statement.command.name == "face-joint c-model":
            models[-1] = *models[-1][:2], True
        elements = _elements(statement)
        other = other or statement.line * (elements < 0)
        if elements > 0:
            cells = statement.arguments.get("cells", statement.arguments.get("n"))
            models[-1] = models[-1][0] + elements, len(cells), models[-1][2]
    count, dim, joints = max(models)
    if not count:
        return ""
    one, mega = footprint.expected(count, dim, ranks, here, joints), 1e-6
    text = (
        f"memory: {count} elements on {ranks} rank{'s' * (ranks > 1)} take about {one.rank * mega:.0f} MB per rank, at "
        f"most {one.most * mega:.0f} MB, and {one.shared * mega:.0f} MB shared by the ranks of a node: on one node "
        f"{one.node * mega:.0f} MB at most"
    )
    if other:
        text += f" (without the mesh of line {other}, whose size is not known before it is made)"
    if free is None:
        return text
    if one.node > free:
        raise HpcdemError(
            f"{text}. It does not fit: {free * mega:.0f} MB are free here. Use fewer elements, or more nodes with "
            "fewer ranks each"
        )
    return f"{text}, of {free * mega:.0f} MB that are free"


_MAKES_MESHES = ("mesh create", "mesh import", "mesh equilateral", "mesh patch", "model restore", "element create")


def _elements(statement: Statement) -> int:
    """Number of elements that a line makes; -1 if unknown."""
    name, given = statement.command.name, statement.arguments
    cells = {"mesh structured": given.get("cells"), "element create brick": given.get("n")}.get(name)
    if cells is None:
        return -1 if name.startswith(_MAKES_MESHES) else 0
    if not isinstance(cells, tuple) or not all(isinstance(one, int) for one in cells):
        return -1
    per = {2: 2, 3: given.get("split", 6)}[len(cells)]
    if given.get("type") in ("quad", "hex") or given.get("triangle") is False:
        per = {2: 1, 3: 6}[len(cells)]  # six elements store a hexahedron
    return math.prod(cells) * per if isinstance(per, int) else -1


def _loose_names(script: Source) -> list[str]:
    """Geometry layers, tables and fields that are named but made nowhere. Where names are expressions nothing is
    reported."""
    made: dict[str, set[str]] = {"geometry layer": set(), "table": set(), "field": set()}
    used: list[tuple[int, str, str]] = []
    for statement in script.statements:
        name, given = statement.command.name, statement.arguments
        if name == "model restore" or (name.split()[1:2] == ["import"] and name != "geometry import"):
            return []
        if name in ("mesh structured", "mesh equilateral", "element create brick"):
            made["geometry layer"] |= {"left", "right", "bottom", "top"}
        kind = {"table create": "table", "table": "table", "field create": "field"}.get(name, "geometry layer")
        if name.startswith("geometry ") and "as-layer" not in given:
            made[kind].add(DEFAULT_LAYER)
        if "as-layer" in given or (kind != "geometry layer" and (name != "table" or "data" in given)):
            new = given.get("as-layer", given.get("name"))
            if isinstance(new, Pending):
                return []
            made[kind].add(new)
        layers = [given.get(word) for word in ("from-layer", "layer", "inside", "surface", "layers")]
        layers += [value for term, value in statement.range or () if term.startswith("geometry")]
        used += [(statement.line, "geometry layer", layer) for layer in _names(layers)]
        for value in (*given.values(), *given.get("properties", {}).values()):
            match value:
                case TableName(of) | Over(of, _) if isinstance(of, str):
                    used.append((statement.line, "table", of))
                case Drawn(of):
                    used.append((statement.line, "field", of))
    found = [(line, f"{kind} '{name}'") for line, kind, name in used if name not in made[kind]]
    return [f"line {line}: no line creates the {what}" for line, what in sorted(found + _loose_groups(script))]


def _names(value: Any) -> Iterator[str]:
    """Texts in what follows a keyword, not those of words behind it."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, list):
        for one in value:
            yield from _names(one)
    elif isinstance(value, dict):
        yield from _names(value.get("value"))


_GROUPED = {"element": "element", "node": "node", "element-face": "face", "face-joint": "joint"}
"""Kinds of objects whose groups are all defined by the script, and their names in messages."""


def _groups_of(statement: Statement) -> Iterator[tuple[str, Any, Any]]:
    """Kind, name and set of the groups that a line makes; None where they come from the bodies or regions of a mesh."""
    words, given = statement.command.name.split(), statement.arguments
    if words[-1] == "group" and words[0] in _GROUPED:
        yield words[0], given["group"], given.get("set", "default")
    elif words[0] in ("mesh", "element") and words[1] in ("create", "structured", "equilateral"):
        if "region" in given or "bodies" in given:
            yield "element", None, None
        group = given.get("group", {"value": "default"})
        yield "element", group["value"], group.get("set", "default")


def _loose_groups(script: Source) -> list[tuple[int, str]]:
    """Groups and sets that a range names and no line makes, with the line. Nothing is reported of a kind of which
    groups have names that are expressions, or come from the bodies or regions of a mesh."""
    made: dict[str, set[tuple[str, str]]] = {kind: set() for kind in _GROUPED}
    unknown: set[str] = set()
    for kind, name, set_name in (group for statement in script.statements for group in _groups_of(statement)):
        if isinstance(name, str) and isinstance(set_name, str):
            made[kind].add((name, set_name))
        else:
            unknown.add(kind)
    found = []
    for statement in script.statements:
        ranged = statement.command.ranged
        if ranged == "any":
            shown = str(statement.arguments.get("object"))
            ranged = {"joint": "face-joint"}.get(shown, shown)
        for term, value in statement.range or ():
            kind = ranged if term in ("group", "set") else "element" if term in ("face-of", "between") else ""
            if kind not in made or kind in unknown:
                continue
            if term == "set":
                if isinstance(value, str) and value not in {set_name for _, set_name in made[kind]}:
                    found.append((statement.line, f"set '{value}' of {_GROUPED[kind]}s"))
                continue
            names = value["value"] if term == "between" else (value["value"],)
            set_name = value.get("set", "default")
            for name in names:
                if isinstance(name, str) and isinstance(set_name, str) and (name, set_name) not in made[kind]:
                    found.append((statement.line, f"group '{name}' of {_GROUPED[kind]}s in set '{set_name}'"))
    return found
