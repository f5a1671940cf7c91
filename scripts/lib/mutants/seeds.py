"""Where a source can be changed, and the choice of some of all changes.

| kind | change |
|---|---|
| sign | `a + b` ↔ `a - b`, `-a` → `a`, `+=` ↔ `-=` |
| factor | `a * b` ↔ `a / b` |
| comparison | `<` ↔ `<=`, `>` ↔ `>=`, `==` ↔ `!=`, `and` ↔ `or` |
| constant | a number n → n + 1, a float x → 1.5 x (0.0 → 1.0) |
| index | `a[0]` → `a[1]`, `a[i]` → `a[i - 1]` |
| statement | an assignment of a part, `+=` or a call → `pass` |
| arguments | the first two arguments of a call change places |
"""

from __future__ import annotations

import ast
import hashlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

KINDS = ("sign", "factor", "comparison", "constant", "index", "statement", "arguments")
_SIGN = {ast.Add: "-", ast.Sub: "+"}
_FACTOR = {ast.Mult: "/", ast.Div: "*"}
_COMPARE = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "=="}


@dataclass(frozen=True)
class Mutant:
    """One change. start, end: characters of the file's text that are replaced by `after`; function: qualified name of
    the innermost function; whole: text of its first line; count: which one it is of several that read alike."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    before: str
    after: str
    function: str
    whole: str
    count: int = 0

    @property
    def name(self) -> str:
        """What it is known by in the records: no line number, so that edits elsewhere in the file do not matter."""
        number = f" #{self.count + 1}" if self.count else ""
        return f"{self.file}::{self.function} {self.kind} {self.before!r} -> {self.after!r} in {self.whole!r}{number}"

    def applied(self, text: str) -> str:
        """The changed source. ValueError where the text is not the one that it was made for."""
        if text[self.start : self.end] != self.before:
            raise ValueError(f"{self.file} has changed since the mutant was chosen")
        return text[: self.start] + self.after + text[self.end :]


def of_source(file: str, text: str) -> list[Mutant]:
    """All changes of a file, in the order of the text."""
    lines = text.splitlines(keepends=True)
    begins = [0]
    for line in lines:
        begins.append(begins[-1] + len(line))

    def at(line: int, column: int) -> int:
        return begins[line - 1] + len(lines[line - 1].encode()[:column].decode())

    def span(node: ast.AST) -> tuple[int, int]:
        return at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]

    found = []
    tree = ast.parse(text)
    for function, name in _functions(tree, ""):
        for kind, line, start, end, after in _changes(function, text, span):
            found.append(Mutant(file, line, kind, start, end, text[start:end], after, name, lines[line - 1].strip()))
    alike: Counter[str] = Counter()
    numbered = []
    for mutant in sorted(set(found), key=lambda m: (m.start, m.end, m.kind, m.after)):
        numbered.append(replace(mutant, count=alike[mutant.name]))
        alike[mutant.name] += 1
    return numbered


def _functions(node: ast.AST, prefix: str) -> Iterator[tuple[ast.FunctionDef, str]]:
    """All functions below a node with their qualified names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef):
            yield child, prefix + child.name
            yield from _functions(child, f"{prefix}{child.name}.<locals>.")
        else:
            yield from _functions(child, f"{prefix}{child.name}." if isinstance(child, ast.ClassDef) else prefix)


def _changes(function: ast.FunctionDef, text: str, span) -> Iterator[tuple[str, int, int, int, str]]:  # type: ignore[no-untyped-def]
    """(kind, line, start, end, replacement), in functions only: tables at the top of a module are data."""
    for node in (inner for statement in function.body for inner in _code(statement)):
        if isinstance(node, ast.BinOp):
            after = (_SIGN | _FACTOR).get(type(node.op))
            if after and not isinstance(node.left, ast.JoinedStr) and not _is_text(node.left):
                start, end = span(node.left)[1], span(node.right)[0]
                gap = text[start:end]
                sign = next((c for c in gap if c in "+-*/"), None)
                if sign:
                    place = start + gap.index(sign)
                    kind = "sign" if type(node.op) in _SIGN else "factor"
                    yield kind, node.lineno, place, place + 1, after
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            start, end = span(node)
            yield "sign", node.lineno, start, end, f"({text[slice(*span(node.operand))]})"
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
            start, end = span(node.left)[1], span(node.comparators[0])[0]
            if "(" not in text[start:end] and ")" not in text[start:end]:
                yield "comparison", node.lineno, start, end, f" {_COMPARE[type(node.ops[0])]} "
        elif isinstance(node, ast.BoolOp) and len(node.values) == 2:
            start, end = span(node.values[0])[1], span(node.values[1])[0]
            word, other = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
            if word in text[start:end]:
                yield "comparison", node.lineno, start, end, text[start:end].replace(word, other, 1)
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            start, end = span(node)
            value = node.value + 1 if isinstance(node.value, int) else 1.5 * node.value or 1.0
            yield "constant", node.lineno, start, end, repr(value)
        elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name):
            start, end = span(node.slice)
            yield "index", node.lineno, start, end, f"{node.slice.id} - 1"
        elif isinstance(node, ast.AugAssign):
            start, end = span(node)
            yield "statement", node.lineno, start, end, "pass"
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Subscript | ast.Attribute):
            start, end = span(node)
            yield "statement", node.lineno, start, end, "pass"
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            start, end = span(node)
            yield "statement", node.lineno, start, end, "pass"
        if isinstance(node, ast.Call) and len(node.args) > 1 and not isinstance(node.args[1], ast.Starred):
            (a, b), (c, d) = span(node.args[0]), span(node.args[1])
            if text[a:b] != text[c:d]:
                yield "arguments", node.lineno, a, d, text[c:d] + text[b:c] + text[a:b]


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """What is carried out: neither annotations nor the inside of f-strings and of errors' messages; functions in
    functions are walked on their own."""
    if isinstance(node, ast.FunctionDef | ast.JoinedStr | ast.Raise | ast.Assert):
        return
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _code(child)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def choose(root: Path, places: list[str], count: int, seed: int) -> list[Mutant]:
    """`count` changes of the sources below `places`, as evenly over the modules as they have some, in a random order.

    The same seed and sources give the same choice. Each change has its place in the order by its own name, so edits
    of a file hardly move those of the rest of it, and the first ones of a longer choice are a shorter one.
    """

    def drawn(name: str) -> bytes:
        return hashlib.sha256(f"{seed} {name}".encode()).digest()

    pools, texts = {}, {}
    for place in places:
        base = root / place
        for path in sorted(base.rglob("*.py") if base.is_dir() else [base]):
            name = path.relative_to(root).as_posix()
            texts[name] = path.read_text(encoding="utf-8")
            mutants = of_source(name, texts[name])
            pools[name] = _varied(sorted(mutants, key=lambda m: drawn(m.name)))
    chosen: list[Mutant] = []
    names = sorted(pools, key=drawn)
    while len(chosen) < count and any(pools.values()):
        for name in names:
            while pools[name] and len(chosen) < count:
                mutant = pools[name].pop(0)
                if compiles(mutant, texts[name]):
                    chosen.append(mutant)
                    break
    return chosen


def compiles(mutant: Mutant, text: str) -> bool:
    """Whether the changed file is still Python."""
    try:
        compile(mutant.applied(text), mutant.file, "exec")
    except SyntaxError:
        return False
    return True


def _varied(mutants: list[Mutant]) -> list[Mutant]:
    """The same, kinds in turn: constants and signs would be most of them."""
    by_kind = {kind: [m for m in mutants if m.kind == kind] for kind in KINDS}
    order = sorted(KINDS, key=lambda kind: mutants.index(by_kind[kind][0]) if by_kind[kind] else len(mutants))
    found: list[Mutant] = []
    while any(by_kind.values()):
        for kind in order:
            if by_kind[kind]:
                found.append(by_kind[kind].pop(0))
    return found
