"""Split the bytes of a script into words with line and column, and convert words to numbers and expressions.

The rules (manual, preface): upper and lower case are the same; ``( ) = ,`` and blanks only separate; ``# ! ;`` start
a comment that runs to the end of the line, in any text encoding. One command per line.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from hpcdem.core.errors import ScriptError
from hpcdem.core.nearest import hint
from hpcdem.core.selection import VARIABLES, Expression

SEPARATORS = "()=,"
COMMENT = re.compile(rb"[#!;]")
LINE_END = re.compile(rb"\r\n|\n|\r")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
LINE_BREAK_MARKS = "↵→↪↩⏎➔⮐"
"""Marks at the ends and beginnings of lines that were too long for a page of the manual."""
JOIN = "a command is one line, so join the two parts"
LARGEST_WHOLE = 2**53
"""Largest whole number that a C double represents exactly; ZDEM reads numbers as doubles."""


@dataclass(frozen=True)
class Token:
    """One word of a line: its text and position (lines and columns count from 1)."""

    text: str
    line: int
    column: int

    @property
    def word(self) -> str:
        """The word for comparisons: case does not count."""
        return self.text.lower()

    def __str__(self) -> str:
        """The word and its place, as messages show it."""
        text = self.text if len(self.text) <= 40 else self.text[:37] + "..."
        return f"'{text}' at column {self.column}"


@dataclass(frozen=True)
class Line:
    """The words of one line that holds any, and the line as written without its comment."""

    number: int
    text: str
    tokens: tuple[Token, ...]


def read_lines(source: bytes, file: str) -> Iterator[Line]:
    """The lines of a script that hold words, one by one, so that nothing after STOP need be readable."""
    if source.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise ScriptError(file, 1, "the file is UTF-16 text; save it as UTF-8")
    source = source.removeprefix(b"\xef\xbb\xbf")
    for number, raw in enumerate(LINE_END.split(source), start=1):
        # Cutting the comment off before decoding lets comments be in any encoding: in GBK, Big5 and Shift-JIS
        # the second byte of a character is never one of # ! ;
        code = COMMENT.split(raw, maxsplit=1)[0]
        text = _decode(code, file, number)
        tokens = tuple(_words(text, file, number))
        if tokens:
            yield Line(number, text.strip(), tokens)


def _decode(code: bytes, file: str, number: int) -> str:
    try:
        return code.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ScriptError(
            file,
            number,
            f"byte 0x{code[error.start]:02X} at column {error.start + 1} is not UTF-8 text; "
            "other encodings (GBK for example) are accepted in comments only",
        ) from None


def _words(text: str, file: str, number: int) -> Iterator[Token]:
    start = None
    for at, char in enumerate(text + " "):
        if char in SEPARATORS or char.isspace():
            if start is not None:
                yield Token(text[start:at], number, start + 1)
            start = None
            continue
        _refuse(char, file, number, at + 1)
        if start is None:
            start = at


def _refuse(char: str, file: str, number: int, column: int) -> None:
    """Characters that no word may hold; most come from an input method or from copying out of a document."""
    if char.isascii() and char.isprintable():
        if char in "\"'":
            raise ScriptError(file, number, f"read {char} at column {column}; names are written without quotes")
        return
    if char in LINE_BREAK_MARKS:
        raise ScriptError(file, number, f"read '{char}' at column {column}, the mark of a line broken by a PDF; {JOIN}")
    plain = unicodedata.normalize("NFKC", char)
    if "\uff01" <= char <= "\uff5e" or char == "\u2212":
        plain = "-" if char == "\u2212" else plain
        raise ScriptError(file, number, f"read a wide '{char}' at column {column}; type an ordinary '{plain}'")
    if not char.isprintable():
        raise ScriptError(file, number, f"read the control character U+{ord(char):04X} at column {column}")


def number(token: Token) -> float | None:
    """The value of a C decimal number ("2.5e3", ".5", "-9.8", "1."), or None if the word is something else."""
    return float(token.text) if NUMBER.fullmatch(token.text) else None


def whole(value: float) -> int | None:
    """A whole number, also from "100000.0"; None if the value is not within 1e-9 of one, or too large to be exact."""
    if abs(value) > LARGEST_WHOLE or abs(value - round(value)) > 1e-9:
        return None
    return round(value)


# ---- expressions: {top}-1000.0 -------------------------------------------------------------------------------------

_PIECE = re.compile(r"(?P<number>(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)|(?P<name>\{[^{}]*\})|(?P<sign>[-+*/])", re.ASCII)
BLANKS = "; blanks are not allowed in an expression: write {top}-1000.0"
_RANK = {"+": 1, "-": 1, "*": 2, "/": 2}


def is_expression(token: Token) -> bool:
    """Words with a brace are expressions of the extents of the model."""
    return "{" in token.text or "}" in token.text


def is_part(token: Token) -> bool:
    """Words that can only be a piece of an expression that blanks have cut: ``-``, ``*2``."""
    return token.text[0] in "*/" or token.text in ("+", "-")


def expression(token: Token, file: str) -> Expression:
    """``operand (operator operand)*`` with operand = [sign] number | [sign] {name}; * and / bind tighter than + and -.

    Parentheses cannot occur, they are separators of the language.
    """

    def fail(expected: str) -> ScriptError:
        return ScriptError(file, token.line, f"read {token}: {expected}")

    program: list[float | str] = []
    waiting: list[str] = []
    sign, operand_next, at = 1.0, True, 0
    signed = False
    while at < len(token.text):
        piece = _PIECE.match(token.text, at)
        if piece is None:
            raise fail(f"'{token.text[at : at + 20]}' is no part of an expression such as {{top}}-1000.0")
        at = piece.end()
        if piece["sign"] and operand_next:
            if piece["sign"] in "*/" or signed:
                raise fail(f"a number or one of {_names()} is missing before '{piece['sign']}'")
            sign, signed = (-1.0 if piece["sign"] == "-" else 1.0), True
        elif piece["sign"]:
            while waiting and _RANK[waiting[-1]] >= _RANK[piece["sign"]]:
                program.append(waiting.pop())
            waiting.append(piece["sign"])
            operand_next = True
        elif not operand_next:
            raise fail("an operator + - * / is missing")
        else:
            program += _operand(piece, sign, fail)
            sign, signed, operand_next = 1.0, False, False
    if operand_next:
        raise fail(f"a number or one of {_names()} is missing at the end{BLANKS}")
    return Expression(token.text.lower(), (*program, *reversed(waiting)))


def _operand(piece: re.Match[str], sign: float, fail: Callable[[str], ScriptError]) -> list[float | str]:
    if piece["number"]:
        value = sign * float(piece["number"])
        if abs(value) == float("inf"):
            raise fail("a number is too large")
        return [value]
    name = piece["name"][1:-1].lower()
    if name not in VARIABLES:
        raise fail(f"{{{name[:20]}}} is unknown{hint(name, VARIABLES)}; known are {_names()}")
    return [name] if sign > 0 else [-1.0, name, "*"]


def _names() -> str:
    return " ".join(f"{{{name}}}" for name in VARIABLES)
