"""Choosing objects by an expression such as `stress_xx < -1e6 and hypot(x, y) < 2`.

The text is taken apart by Python's own parser and computed here, piece by piece, from a list of what is allowed:
comparisons, and, or, not, + - * /, a few functions, numbers and names of fields. Nothing in it is executed. It may
begin with a RANGE of the languages: `range x 0 2 group 'roof' and stress_xx < 0`. Lines before it may give names to
what it is made of: `r = hypot(x, y)`.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections import ChainMap
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError

LONGEST = 400
"""Largest number of characters of an expression."""
DEEPEST = 40
"""Largest depth to which parentheses, functions and operators are nested."""
FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, np.abs), "sqrt": (1, np.sqrt), "log10": (1, np.log10), "hypot": (2, np.hypot),
    "min": (2, np.minimum), "max": (2, np.maximum), "isnan": (1, np.isnan),
}  # fmt: skip
"""Number of arguments of each function, and the function."""
GROUP = "group"
"""`group(NAME)`, or `group(NAME, SET)`: whether an object is in a group. Names may be quoted."""
_GIVEN = re.compile(r"\s*[A-Za-z_]\w*\s*=(?!=)")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_WORDS = re.compile(r"'[^']*'|\"[^\"]*\"|[^\s(),]+")
_ARITHMETIC = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
_COMPARISONS = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
Groups = Callable[[str, str], np.ndarray]


def chosen(text: str, count: int, fields: Mapping[str, np.ndarray], groups: Groups) -> np.ndarray:
    """(count,) bool: which objects the expression holds for. fields: values (count,) by name, read when they are
    needed; groups: the members (count,) of a group, by its name and that of its set ("" any). HpcdemError with the
    text for what is not understood."""
    *lines, last = _lines(text)
    own: dict[str, Any] = {}
    evaluation = _Evaluation(text, ChainMap(own, fields), groups)  # type: ignore[arg-type]
    for line in lines:
        name, _, right = line.partition("=")
        own[name.strip()] = evaluation.value(parsed(right), 0)
    found = evaluation.value(parsed(last), 0)
    if not (isinstance(found, (np.ndarray, np.bool_, bool)) and np.asarray(found).dtype == bool):
        raise refusal(text, "expected a comparison, such as x > 1")
    return np.broadcast_to(found, (count,)).copy()


def amount(text: str, fields: Mapping[str, np.ndarray], source: str) -> Any:
    """The value of an expression of numbers and fields, a number or one per object. source: what the user wrote, for
    HpcdemError."""
    try:
        return _Evaluation(text, fields, lambda *_: np.zeros(0, bool))._amount(parsed(text), 0)
    except HpcdemError as error:
        raise HpcdemError(f"'{source[:60]}': {str(error).partition(': ')[2].replace('a filter', 'it')}") from None


def _lines(text: str) -> list[str]:
    """Lines `name = ...`, and the expression behind them, which may span lines. HpcdemError."""
    rest = [line for line in text.split("\n") if line.strip()]
    lines = []
    while len(rest) > 1 and _GIVEN.match(rest[0]):
        lines.append(rest.pop(0))
    if len(text) > LONGEST:
        raise HpcdemError(f"filter: {len(text)} characters, at most {LONGEST} allowed")
    if any(map(_GIVEN.match, rest)):
        raise refusal(text, "expected names first and a comparison such as r < 3 at the end")
    return [*lines, " ".join(rest)]


def parsed(text: str) -> ast.expr:
    """The expression as a tree. HpcdemError for what is none, or too long."""
    if len(text) > LONGEST:
        raise HpcdemError(f"filter: {len(text)} characters, at most {LONGEST} allowed")
    try:
        return ast.parse(_without_range(text.strip()), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise refusal(text, "expected an expression such as stress_xx < -1e6 and x > 0") from None


def _without_range(text: str) -> str:
    """The filter text with the words of RANGE as an expression: all of them must hold."""
    if not re.match(r"range\b", text, re.IGNORECASE):
        return text
    return _Range(text).expression()


class _Range:
    """The words of a RANGE, read in sequence."""

    def __init__(self, text: str) -> None:
        self.text, self.words = text, _WORDS.findall(text)[1:]

    def expression(self) -> str:
        """Return all terms as one expression."""
        found: list[str] = []
        negated = False
        while self.words:
            word = self._taken("a word").lower()
            if word == "and" and found:
                rest = re.search(r"\band\b(.*)$", self.text, re.IGNORECASE | re.DOTALL)
                assert rest is not None
                return f"{' and '.join(found)} and ({rest[1].strip()})"
            if word == "not" and not negated:
                negated = True
                continue
            term = self._term(word)
            found.append(f"not ({term})" if negated else term)
            negated = False
        if negated:
            raise refusal(self.text, "expected a term after not")
        if not found:
            raise refusal(self.text, "expected x, y, z, id, group or set after range")
        return " and ".join(found)

    def _term(self, word: str) -> str:
        """Return the expression of this word and the words that belong to it."""
        if word in ("x", "y", "z", "id"):
            low = self._taken("a number")
            return f"{low} <= {word} <= {self._number(whole=word == 'id') or low}"
        if word in ("in-circle", "in-c"):
            return self._circle()
        if word == GROUP:
            of = self._name()
            if self.words[:1] == ["set"]:
                self.words.pop(0)
                of += f", {self._name()}"
            return f"{GROUP}({of})"
        if word == "set":
            return f"group_{self._taken('a name').strip(chr(39))} >= 0"
        advice = ""
        if word.startswith("geom"):
            advice = "; frames have no layers: element group 'name' range geometry-... first, and then group 'name'"
        known = "x, y, z, in-circle, not, id, group, set"
        raise refusal(
            self.text, f"'{word[:30]}' is not a range word for frames; known: {known}{advice}"
        )  # fmt: skip

    def _circle(self) -> str:
        numbers = [self._taken("a centre and a radius") for _ in range(3)]
        while number := self._number():
            numbers.append(number)
        *centre, radius = numbers
        if len(numbers) > 4:
            raise refusal(self.text, "in-circle needs a centre and a radius")
        square = " + ".join(f"(({axis}) - ({at})) * (({axis}) - ({at}))" for axis, at in zip("xyz", centre))
        return f"{square} <= ({radius}) * ({radius})"

    def _taken(self, what: str) -> str:
        if not self.words:
            raise refusal(self.text, f"expected {what} at the end of the range")
        return self.words.pop(0)

    def _name(self) -> str:
        return repr(self._taken("a name").strip("'\""))

    def _number(self, whole: bool = False) -> str:
        """The next word if it is a number, else none."""
        there = self.words and (self.words[0].isdigit() if whole else _NUMBER.fullmatch(self.words[0]))
        return self.words.pop(0) if there else ""


def refusal(text: str, why: str) -> HpcdemError:
    """The message about an expression."""
    return HpcdemError(f"filter '{text[:60]}': {why}")


class _Evaluation:
    def __init__(self, text: str, fields: Mapping[str, np.ndarray], groups: Groups) -> None:
        self.text, self.fields, self.groups = text, fields, groups

    def value(self, node: ast.expr, depth: int) -> Any:
        """A number, or an array of a value per object."""
        if depth > DEEPEST:
            raise refusal(self.text, f"more than {DEEPEST} nested levels")
        deeper = depth + 1
        with np.errstate(all="ignore"):
            match node:
                case ast.Constant(value=bool()):
                    pass
                case ast.Constant(value=int() | float() as number):
                    return self._number(number)
                case ast.Name(id=name):
                    return self._field(name)
                case ast.BoolOp(op=op, values=parts):
                    combined = np.logical_and if isinstance(op, ast.And) else np.logical_or
                    found = self._truth(parts[0], deeper)
                    for part in parts[1:]:
                        found = combined(found, self._truth(part, deeper))
                    return found
                case ast.UnaryOp(op=ast.Not(), operand=operand):
                    return np.logical_not(self._truth(operand, deeper))
                case ast.UnaryOp(op=ast.USub(), operand=operand):
                    return -self._amount(operand, deeper)
                case ast.BinOp(op=op, left=left, right=right) if type(op) in _ARITHMETIC:
                    return _ARITHMETIC[type(op)](
                        np.asarray(self._amount(left, deeper)), np.asarray(self._amount(right, deeper))
                    )
                case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARISONS for op in ops):
                    return self._compared(left, ops, others, deeper)
                case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                    return self._called(name, arguments, deeper)
        raise refusal(self.text, f"'{ast.unparse(node)[:30]}' is not allowed in a filter")

    def _number(self, number: float) -> float:
        try:
            value = float(number)
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise refusal(self.text, "a number is too large")
        return value

    def _amount(self, node: ast.expr, depth: int) -> Any:
        found = self.value(node, depth)
        if np.asarray(found).dtype == bool:
            raise refusal(self.text, f"'{ast.unparse(node)[:30]}' is true or false, expected a number")
        return found

    def _truth(self, node: ast.expr, depth: int) -> Any:
        found = self.value(node, depth)
        if np.asarray(found).dtype != bool:
            raise refusal(self.text, f"'{ast.unparse(node)[:30]}' is a number, expected a comparison")
        return found

    def _compared(self, left: ast.expr, ops: list[ast.cmpop], others: list[ast.expr], depth: int) -> Any:
        before, result = self._amount(left, depth), np.True_
        for op, node in zip(ops, others, strict=True):
            after = self._amount(node, depth)
            result = np.logical_and(result, _COMPARISONS[type(op)](np.asarray(before), np.asarray(after)))
            before = after
        return result

    def _called(self, name: str, arguments: list[ast.expr], depth: int) -> Any:
        if name == GROUP:
            words = [
                node.id if isinstance(node, ast.Name) else str(node.value)
                for node in arguments
                if isinstance(node, ast.Name) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
            ]
            if len(words) != len(arguments) or len(words) not in (1, 2):
                raise refusal(self.text, "expected names in group(NAME) or group(NAME, SET)")
            return self.groups(words[0], words[1] if len(words) == 2 else "")
        if name not in FUNCTIONS:
            raise refusal(self.text, f"unknown function {name}; known: {', '.join([*FUNCTIONS, GROUP])}")
        count, function = FUNCTIONS[name]
        if len(arguments) != count:
            raise refusal(self.text, f"{name} needs {count} value{'s' * (count > 1)}, not {len(arguments)}")
        return function(*(self._amount(node, depth) for node in arguments))

    def _field(self, name: str) -> np.ndarray:
        try:
            return self.fields[name]
        except KeyError:
            known = ", ".join(self.fields)
            raise refusal(self.text, f"unknown field {name}; known: {known}") from None
