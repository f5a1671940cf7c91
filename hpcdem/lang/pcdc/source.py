"""A script of Python with ``pcdc`` lines becomes Python: each command a call, line by line.

``pcdc geometry create polyline ([i],0) (0,[i])`` is parsed and then stands in the Python text as ``__pcdc__(7, (i),
(i),)``: the number of the statement, and the expressions in square brackets, which Python itself evaluates where they
stand, in loops and functions as anywhere else. Lines keep their numbers.
"""

from __future__ import annotations

import ast
import bisect
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field

from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc import lexer, parser
from hpcdem.lang.pcdc.statement import Statement, shown
from hpcdem.lang.pcdc.table import PCDC, Table

CALL = "__pcdc__"
"""Name of the call of a command in the Python text."""

_COMMAND = re.compile(r"([ \t\f]*)pcdc(?![\w.([])(.*)", re.DOTALL)
_TRIPLE = ('"""', "'''")


@dataclass
class Source:
    """A script that was read. file: as messages show it; lines: as written; python: what is run; statements: the
    commands by line; first: number of the first statement, as the Python text has it."""

    file: str
    lines: list[str]
    python: str
    statements: list[Statement] = field(default_factory=list)
    first: int = 0

    def line(self, number: int) -> str:
        """The text of a line, counted from 1."""
        return self.lines[number - 1].strip() if 0 < number <= len(self.lines) else ""

    def statement_at(self, number: int) -> Statement | None:
        """Return the command on this line."""
        return next((s for s in self.statements if s.line <= number <= s.last_line), None)


def decode(source: bytes, file: str) -> str:
    """The text of a script: UTF-8, or what editors on Chinese systems write. ScriptError for what is neither."""
    for mark in (b"\xff\xfe", b"\xfe\xff"):
        if source.startswith(mark):
            raise ScriptError(file, 1, "the file is UTF-16 text; save it as UTF-8")
    for encoding in ("utf-8-sig", "gb18030"):
        try:
            text = source.decode(encoding)
            break
        except UnicodeDecodeError as error:
            line = source.count(b"\n", 0, error.start) + 1
    else:
        raise ScriptError(file, line, "the file is neither UTF-8 text nor GB 18030; save it as UTF-8")
    if "\0" in text:
        raise ScriptError(
            file, text.count("\n", 0, text.index("\0")) + 1, "there is a zero byte; this is not a text file"
        )
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read(text: str, file: str = "script", first: int = 0, table: Table = PCDC, dim: int | None = 2) -> Source:
    """Read all of a script and parse its commands; ScriptError at the first line that is wrong, command or Python.

    first: number of the first statement, where several sources share one list of them; dim: dimensions of the model
    that is there at the beginning, None: not known. Lines are read for the model of the last `model new` above them.
    """
    lines = text.split("\n")
    found = Source(file, lines, "", [], first)
    python = list(lines)
    state = _PythonText()
    number = 0
    while number < len(lines):
        match = _COMMAND.fullmatch(lines[number]) if state.at_statement else None
        if match is None:
            state.feed(lines[number])
            number += 1
            continue
        last, words = _logical(lines, number, match[2])
        shown = " ".join(f"pcdc{words}".split())
        if words.lstrip().startswith("="):
            raise ScriptError(
                file, number + 1, f"{lines[number].strip()}: 'pcdc' is reserved and cannot name a variable"
            )
        statement = parser.parse(words, file, number + 1, shown, table, last + 1, dim)
        dim = _dimensions(statement, dim)
        index = first + len(found.statements)
        found.statements.append(statement)
        values = "".join(f"({code}), " for code in statement.expressions)
        python[number] = f"{match[1]}{CALL}({index}, {values})"
        python[number + 1 : last + 1] = [""] * (last - number)
        number = last + 1
    found.python = "\n".join(python) + "\n"
    _check_python(found)
    return found


def _dimensions(statement: Statement, before: int | None) -> int | None:
    """Dimensions of the model after a command; None: unknown."""
    if statement.command.name == "model restore":
        return None
    if statement.command.name != "model new":
        return before
    given = statement.arguments.get("dim", 2)
    return given if isinstance(given, int) else None


def _logical(lines: list[str], number: int, words: str) -> tuple[int, str]:
    """The words of a command and the number of its last line: a backslash, or three dots, at the end of a line
    continues with the next."""
    while (end := _continued(words)) is not None and number + 1 < len(lines):
        number += 1
        words = words[:end] + " " + lines[number]
    return number, words


def _continued(words: str) -> int | None:
    """Place of the backslash, or the three dots, that end the line, if they stand outside of texts and comments."""
    at, last = 0, len(words.rstrip())
    while at < last:
        char = words[at]
        if char == "#":
            return None
        if char in lexer.QUOTES:
            end = words.find(char, at + 1)
            if end < 0:
                return None
            at = end
        elif last - at in (1, 3) and words[at:last] in ("\\", "..."):
            return at
        at += 1
    return None


class _PythonText:
    """Follows Python from line to line, as far as is needed to know where a statement may begin: not inside a text of
    several lines, nor inside brackets, nor after a backslash."""

    def __init__(self) -> None:
        self._quote = ""
        self._depth = 0
        self._continued = False

    @property
    def at_statement(self) -> bool:
        return not (self._quote or self._depth or self._continued)

    def feed(self, line: str) -> None:
        """The next line of Python."""
        at = 0
        self._continued = False
        while at < len(line):
            if self._quote:
                at = self._after_quote(line, at)
                continue
            char = line[at]
            if char == "#":
                return
            if char in lexer.QUOTES:
                if line[at : at + 3] in _TRIPLE:
                    self._quote, at = line[at : at + 3], at + 3
                    continue
                end = lexer.end_of_string(line, at)
                if end is None:
                    # A text that continues after a backslash, or an error that Python will report.
                    self._continued = line.endswith("\\")
                    return
                at = end
                continue
            if char in "([{":
                self._depth += 1
            elif char in ")]}":
                self._depth = max(self._depth - 1, 0)
            elif char == "\\" and at == len(line) - 1:
                self._continued = True
            at += 1

    def _after_quote(self, line: str, at: int) -> int:
        while at < len(line):
            if line[at] == "\\":
                at += 2
            elif line.startswith(self._quote, at):
                at += len(self._quote)
                self._quote = ""
                return at
            else:
                at += 1
        return at


def _check_python(source: Source) -> None:
    """ScriptError where the Python of a script is wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            ast.parse(source.python, source.file)
        except SyntaxError as error:
            line = min(error.lineno or 1, len(source.lines))
            text = source.line(line)
            raise ScriptError(source.file, line, f"{shown(text)}: {_python_error(error, text)}") from None
        except (RecursionError, MemoryError):
            raise too_deep(source) from None
        except ValueError as error:
            raise ScriptError(source.file, 1, f"this cannot be read as Python: {error}") from None


def too_deep(source: Source, reads: Callable[[str], object] = ast.parse) -> ScriptError:
    """The error for Python that is nested too deeply for `reads`, with the first such line, which Python itself does
    not report.
    """

    def fails(count: int) -> bool:
        try:
            reads("\n".join(source.python.split("\n")[:count]) + "\n")
        except (RecursionError, MemoryError):
            return True
        except (SyntaxError, ValueError):
            pass
        return False

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        line = bisect.bisect_left(range(len(source.lines)), True, 1, key=fails)
    return ScriptError(source.file, line, f"{shown(source.line(line).strip())}: this is nested too deeply for Python")


def _python_error(error: SyntaxError, text: str) -> str:
    if re.search(r"[:;]\s*pcdc\s", text):
        return "a command needs its own line, with 'pcdc' as its first word"
    return f"this is not correct Python: {error.msg}"
