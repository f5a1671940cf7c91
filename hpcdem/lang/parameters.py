"""The parameters of a script of any kind: numbers, words and truth values that its own text sets by name.

In Python, and in PCDC scripts, a parameter is an assignment at the top level of a literal: ``friction = 0.3``. In a
ZDEM script it is ``friction = 0.3`` on a line of its own (`zdem.parameters`), and ``SET seed 20`` sets ``seed``. Every
ZDEM script with steps has the parameter ``twin``: of its line ``TWIN 3``, or of one inserted before the first steps.
A script with other values is another text: the literal is replaced where it stands.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from hpcdem.core.errors import ScriptError, UsageError
from hpcdem.core.nearest import hint
from hpcdem.lang import detect
from hpcdem.lang.pcdc import source as pcdc
from hpcdem.lang.zdem import lexer, parser

Value = bool | int | float | str
_ENDS = re.compile(rb"(\r\n|\n|\r)")
_OWN_NAMES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef, ast.comprehension)


@dataclass(frozen=True)
class Parameter:
    """A parameter that a script assigns. line: counted from 1; begin, end: of the literal in the bytes of its line
    (UTF-8); form: what a value is written as."""

    name: str
    value: Value
    line: int
    begin: int
    end: int
    form: str = "{}"


@dataclass(frozen=True)
class Adjustable:
    """A script whose parameters are known. kind: as `detect.kind`; text: in UTF-8; refused: why a name is none."""

    file: str
    kind: str
    text: bytes
    parameters: dict[str, Parameter]
    refused: dict[str, str]

    def value(self, name: str, word: str) -> Value:
        """A value as given in words, of the kind that the script has for this name. UsageError if there is no such
        parameter, or if the word is of another kind."""
        own = self.parameter(name).value
        if isinstance(own, str):
            return word
        if isinstance(own, bool):
            if word.lower() in ("true", "false"):
                return word.lower() == "true"
            raise UsageError(f"{name}={word}: {self.file} has {own} there, true or false are expected")
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise UsageError(f"{name}={word}: {self.file} has the number {own} there, a number is expected")
        return int(number) if number.is_integer() and (isinstance(own, int) or "." not in word) else number

    def parameter(self, name: str) -> Parameter:
        """UsageError, with what there is, for a name that the script does not set."""
        if name in self.parameters:
            return self.parameters[name]
        if name in self.refused:
            raise UsageError(f"{name}: {self.refused[name]}")
        known = ", ".join(self.parameters) or "none"
        raise UsageError(
            f"{name}: {self.file} has no such parameter{hint(name, list(self.parameters))}; available: {known}. Add a "
            f"line {name} = NUMBER to create one"
        )

    def with_values(self, values: Mapping[str, Value]) -> bytes:
        """The text with these values. ScriptError if it is no correct script then."""
        pieces = _ENDS.split(self.text)
        for name in sorted(values, key=lambda name: (self.parameter(name).line, self.parameter(name).begin))[::-1]:
            at = self.parameter(name)
            line = pieces[2 * (at.line - 1)]
            word = at.form.format(values[name] if self.kind == "zdem" else repr(values[name]))
            pieces[2 * (at.line - 1)] = line[: at.begin] + word.encode() + line[at.end :]
        text = b"".join(pieces)
        if self.kind == "zdem":
            parser.parse_text(text, self.file)
        return text


def read(source: bytes, file: str) -> Adjustable:
    """The parameters of a script. ScriptError if it is not correct."""
    kind = detect.kind(source, file)
    text = source.removeprefix(b"\xef\xbb\xbf")
    if kind == "zdem":
        script = parser.parse_text(text, file)
        return Adjustable(file, kind, text, {one.name: one for one in _of_zdem(script, text)}, {})
    if kind == "pcdc":
        text = pcdc.decode(source, file).encode()
        python = pcdc.read(text.decode(), file).python
    else:
        try:
            python = text.decode()
        except UnicodeDecodeError as error:
            line = text.count(b"\n", 0, error.start) + 1
            raise ScriptError(file, line, "the file is not UTF-8 text") from None
    return Adjustable(file, kind, text, *_of_python(ast.parse(python, file), file))


def _of_zdem(script: parser.Script, text: bytes) -> Iterator[Parameter]:
    """Numbers with names, and the seed."""
    for name, parameter in script.parameters.items():
        value = float(parameter.token.text)
        whole = lexer.whole(value) if "." not in parameter.token.text else None
        yield _at(text, parameter.token, name, value if whole is None else whole)
    seeds = [s for s in script.statements if s.command == "SET" and "seed" in s.arguments]
    if len(seeds) == 1 and "seed" not in script.parameters:
        line = next(line for line in lexer.read_lines(text, script.file) if line.number == seeds[0].line)
        words = [token.word for token in line.tokens]
        found = next((k for k in range(1, len(words)) if len(words[k]) >= 3 and "seed".startswith(words[k])), None)
        if found is not None and lexer.number(line.tokens[found + 1]) is not None:
            yield _at(text, line.tokens[found + 1], "seed", seeds[0].get("seed"))
    yield from _twin(script, text)


def _twin(script: parser.Script, text: bytes) -> Iterator[Parameter]:
    """The number of the only TWIN; without one, a line for it before the first steps."""
    twins = [s.line for s in script.statements if s.command == "TWIN"]
    steps = [s.line for s in script.statements if s.command in ("CYC", "IMPLE")]
    if len(twins) > 1 or not (twins or steps):
        return
    line = next(line for line in lexer.read_lines(text, script.file) if line.number == (twins or steps)[0])
    if not twins:
        yield Parameter("twin", 0, line.number, 0, 0, "TWIN {}\n")
    elif lexer.number(line.tokens[1]) is not None:
        yield _at(text, line.tokens[1], "twin", int(line.tokens[1].text))


def _at(text: bytes, token: lexer.Token, name: str, value: Value) -> Parameter:
    """Position of a word, in bytes."""
    line = _ENDS.split(text)[2 * (token.line - 1)]
    code = lexer.COMMENT.split(line, maxsplit=1)[0].decode()
    begin = len(code[: token.column - 1].encode())
    return Parameter(name, value, token.line, begin, begin + len(token.text.encode()))


def _of_python(tree: ast.Module, file: str) -> tuple[dict[str, Parameter], dict[str, str]]:
    """Literals at the top level that are set once and read somewhere; and why others are no parameters."""
    found: dict[str, Parameter] = {}
    refused: dict[str, str] = {}
    stored = [node.id for node in _at_top(tree) if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)]
    globals_ = {name for node in ast.walk(tree) if isinstance(node, ast.Global) for name in node.names}
    loaded = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            target: ast.expr = statement.targets[0]
            value: ast.expr | None = statement.value
        elif isinstance(statement, ast.AnnAssign):
            target, value = statement.target, statement.value
        else:
            continue
        if not isinstance(target, ast.Name) or value is None:
            continue
        name, literal = target.id, _literal(value)
        if literal is None or value.end_col_offset is None or value.end_lineno != value.lineno:
            refused[name] = f"{file}:{target.lineno} does not set it to a number, a word, True or False"
        elif stored.count(name) > 1 or name in globals_:
            refused[name] = (
                f"{file} sets it more than once, first in line {target.lineno}, so a value may have no effect"
            )
        elif name not in loaded:
            refused[name] = f"{file}:{target.lineno} sets it but never uses it"
        else:
            found[name] = Parameter(name, literal, value.lineno, value.col_offset, value.end_col_offset)
    return {name: one for name, one in found.items() if name not in refused}, refused


def _at_top(node: ast.AST) -> Iterator[ast.AST]:
    """Yield all nodes whose names belong to the module."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, _OWN_NAMES):
            yield child
            yield from _at_top(child)


def _literal(node: ast.expr) -> Value | None:
    """The value of a literal; None for anything else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        value = _literal(node.operand)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return -value if isinstance(node.op, ast.USub) else value
        return None
    if isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float, str)):
        return node.value
    return None
