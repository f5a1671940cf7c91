"""Splits a ``pcdc`` line into words, numbers, texts, vectors and Python expressions in square brackets."""

from __future__ import annotations

import ast
import math
import re
from dataclasses import dataclass
from itertools import groupby
from typing import NoReturn

QUOTES = "'\""
_OPENING = {"[": "]", "(": ")", "{": "}"}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9]*(-[A-Za-z0-9]+)*")
_ANYTHING = re.compile(r"""[^\s#'"\[\](),]+""")
_PLAIN = {quote: re.compile(rf"[^\[\]{quote}]+") for quote in QUOTES}
_SIGN = re.compile(r"[-+](?=\[)")
_FULL_WIDTH = dict(zip("（），［］＃“”‘’－．", "(),[]#\"\"''-."))
LONGEST_INTEGER = 18
"""Largest number of digits of a whole number."""


def short(text: str, longest: int = 60) -> str:
    """A text that fits into a message."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


class LexicalError(ValueError):
    """Text that is no token; the message states what was read and what was expected."""


@dataclass(frozen=True)
class Word:
    """Word that may be a keyword."""

    text: str

    def __str__(self) -> str:
        return f"'{short(self.text)}'"


@dataclass(frozen=True)
class Number:
    """A number as written."""

    text: str
    value: int | float

    def __str__(self) -> str:
        return f"'{short(self.text)}'"


@dataclass(frozen=True)
class Escape:
    """A Python expression; sign: -1 where a minus stands before the bracket."""

    code: str
    sign: int = 1

    def __str__(self) -> str:
        return f"'{'-' if self.sign < 0 else ''}[{short(self.code)}]'"


@dataclass(frozen=True)
class Text:
    """A text in quotes: pieces of it and expressions between them."""

    parts: tuple[str | Escape, ...]

    def __str__(self) -> str:
        inside = "".join(p if isinstance(p, str) else f"[{p.code}]" for p in self.parts)
        return f"'{short(inside)}'"

    @property
    def plain(self) -> str | None:
        """The text, if there is no expression in it."""
        return "".join(self.parts) if all(isinstance(p, str) for p in self.parts) else None  # type: ignore[arg-type]


@dataclass(frozen=True)
class Vector:
    """Components in round brackets; bare: between commas alone."""

    items: tuple[Number | Escape, ...]
    bare: bool = False

    def __str__(self) -> str:
        inside = short(",".join(str(item).strip("'") for item in self.items))
        return f"'{inside}'" if self.bare else f"'({inside})'"


Token = Word | Number | Escape | Text | Vector


def tokens(line: str) -> list[Token]:
    """The tokens of a line, from after the word ``pcdc`` up to a comment. LexicalError for what is none."""
    found: list[Token] = []
    at = 0
    while (at := _skip_blanks(line, at)) < len(line) and line[at] != "#":
        token, at = _token(line, at)
        comma = _skip_blanks(line, at)
        if line[comma : comma + 1] == "," and not isinstance(token, Word):
            token, at = _listed(line, token, comma)
        found.append(token)
        if at < len(line) and not line[at].isspace() and line[at] not in "#(" + QUOTES * (line[at - 1] == ","):
            _fail_after(line, at, token)
    return found


def _listed(line: str, token: Token, at: int) -> tuple[Token, int]:
    """Extend a token by the values after the comma at `at`: numbers and expressions become components of a vector,
    other tokens become items of a list."""
    items = [token]
    while line[at : at + 1] == ",":
        after = _skip_blanks(line, at + 1)
        if after >= len(line) or line[after] in ",#":
            raise LexicalError(f"read ',' after {items[-1]}, expected one more value after it")
        if not isinstance(token, (Number, Escape)):
            return token, at + 1
        item, end = _token(line, after)
        if not isinstance(item, (Number, Escape)):
            raise LexicalError(f"read {item} in a vector, expected a number or an expression of Python in [ ]")
        items.append(item)
        at = _skip_blanks(line, end)
    return Vector(tuple(items), bare=True), end  # type: ignore[arg-type]


def _token(line: str, at: int) -> tuple[Token, int]:
    char = line[at]
    if char in QUOTES:
        return _text(line, at)
    if char == "[":
        code, end = expression(line, at)
        return Escape(code), end
    if char == "(":
        return _vector(line, at)
    if _SIGN.match(line, at):
        code, end = expression(line, at + 1)
        return Escape(code, -1 if char == "-" else 1), end
    piece = _ANYTHING.match(line, at)
    if piece is None:
        raise LexicalError(f"read '{char}', expected a keyword or a value")
    text = piece[0]
    if _NUMBER.fullmatch(text):
        return _number(text), piece.end()
    if _WORD.fullmatch(text):
        return Word(text), piece.end()
    _fail(text)


def _number(text: str) -> Number:
    if re.fullmatch(r"[-+]?\d+", text):
        if len(text.lstrip("+-0")) > LONGEST_INTEGER:
            raise LexicalError(f"read '{text[:30]}...', expected a number of fewer digits")
        return Number(text, int(text))
    value = float(text)
    if not math.isfinite(value):
        raise LexicalError(f"read '{text[:40]}', expected a number; this one is too large")
    return Number(text, value)


def _vector(line: str, at: int) -> tuple[Vector, int]:
    """Read a vector from its opening bracket."""
    start, items = at, []
    at += 1
    while True:
        at = _skip_blanks(line, at)
        if at < len(line) and line[at] in "(" + QUOTES:
            raise LexicalError(f"read '{line[at]}' in a vector, expected a number or an expression of Python in [ ]")
        if at >= len(line) or line[at] == "#":
            raise LexicalError(f"the vector '{line[start:].strip()[:40]}' does not end: ')' is missing")
        item, at = _token(line, at)
        if not isinstance(item, (Number, Escape)):
            raise LexicalError(
                f"read {item} in a vector, expected a number; put variables and expressions of Python in [ ]"
            )
        items.append(item)
        at = _skip_blanks(line, at)
        if line[at : at + 1] == ")":
            return Vector(tuple(items)), at + 1
        if line[at : at + 1] != ",":
            rest = line[at : at + 20].strip()
            if not rest or rest[0] == "#":
                raise LexicalError(f"the vector '{short(line[start:at].strip())}' does not end: ')' is missing")
            raise LexicalError(f"read '{rest}' in a vector, expected ',' or ')': {short(line[start:at].strip())}")
        at += 1


def _text(line: str, at: int) -> tuple[Text, int]:
    """Read a text from its opening quote. ``[[`` and ``]]`` stand for brackets, ``[...]`` for an expression."""
    quote, start = line[at], at
    parts: list[str | Escape] = []
    at += 1
    while at < len(line):
        char = line[at]
        if char == quote:
            return Text(_joined(parts)), at + 1
        if line[at : at + 2] in ("[[", "]]"):
            parts.append(char)
            at += 2
        elif char == "[":
            try:
                code, at = expression(line, at)
            except LexicalError as error:
                raise LexicalError(f"{error}; in a text write [[ for a bracket") from None
            parts.append(Escape(code))
        else:
            plain = _PLAIN[quote].match(line, at)
            parts.append(plain[0] if plain else char)
            at = plain.end() if plain else at + 1
    raise LexicalError(f"the text {line[start:].strip()[:40]} does not end: {quote} is missing")


def _joined(parts: list[str | Escape]) -> tuple[str | Escape, ...]:
    """Neighbouring pieces of text as one."""
    found: list[str | Escape] = []
    for is_text, run in groupby(parts, key=lambda part: isinstance(part, str)):
        pieces = list(run)
        found += ["".join(map(str, pieces))] if is_text else pieces
    return tuple(found)


def expression(line: str, at: int) -> tuple[str, int]:
    """The Python expression between the bracket at `at` and the one that closes it, and where the line continues."""
    end = closing(line, at)
    if end is None:
        raise LexicalError(f"'{line[at:].strip()[:40]}' does not end: ']' is missing")
    code = line[at + 1 : end].strip()
    if not code:
        raise LexicalError("read '[]', expected a Python expression between the brackets")
    try:
        ast.parse(f"({code})", mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = getattr(error, "msg", None) or str(error) or type(error).__name__
        raise LexicalError(f"'[{code[:60]}]' is not an expression of Python: {why}") from None
    return code, end + 1


def closing(line: str, at: int) -> int | None:
    """Place of the bracket that closes the one at `at`; brackets in Python texts do not count. None if
    missing."""
    open_ones: list[str] = []
    while at < len(line):
        char = line[at]
        if char in QUOTES:
            end = end_of_string(line, at)
            if end is None:
                return None
            at = end
            continue
        if char in _OPENING:
            open_ones.append(_OPENING[char])
        elif open_ones and char == open_ones[-1]:
            open_ones.pop()
            if not open_ones:
                return at
        elif char in ")]}":
            return None
        at += 1
    return None


def end_of_string(line: str, at: int) -> int | None:
    """Place after the Python text that begins with the quote at `at`; None if it does not end on this line."""
    quote = line[at]
    at += 1
    while at < len(line):
        if line[at] == "\\":
            at += 1
        elif line[at] == quote:
            return at + 1
        at += 1
    return None


def _skip_blanks(line: str, at: int) -> int:
    while at < len(line) and line[at].isspace():
        at += 1
    return at


def _fail(text: str) -> NoReturn:
    shown = text[:40]
    for char in text:
        if char in _FULL_WIDTH:
            raise LexicalError(f"read '{shown}': '{char}' is a full-width sign, expected '{_FULL_WIDTH[char]}'")
    if "_" in text or re.search(r"[A-Za-z0-9.)\]][-+*/%][A-Za-z0-9.(\[]|\*\*|[=<>]", text) or "." in text:
        raise LexicalError(f"read '{shown}'; put variables and expressions of Python in square brackets: [{shown}]")
    raise LexicalError(
        f"read '{shown}', expected a keyword, a number, a text in quotes, a vector (x,y) or [expression]"
    )


def _fail_after(line: str, at: int, token: Token) -> NoReturn:
    rest = line[at : at + 20].split()[0]
    if isinstance(token, Escape) or rest[:1] in "[*/+-":
        raise LexicalError(
            f"read '{rest}' directly after {token}: put the whole expression in brackets, or insert a blank"
        )
    raise LexicalError(f"read '{rest}' directly after {token}: insert a blank")
