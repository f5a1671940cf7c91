"""Parse lines into statements. The whole script is read and checked before anything runs.

What may be written comes from `table`; this module knows only how the kinds of values are read. Rules that tie
several words or several lines together are in `rules` and `plan`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from hpcdem.core import selection as sel
from hpcdem.core.errors import ScriptError, UsageError
from hpcdem.core.nearest import hint
from hpcdem.lang.zdem import lexer, plan, rules
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.lexer import Line, Token
from hpcdem.lang.zdem.parameters import Parameter, Parameters
from hpcdem.lang.zdem.statement import Statement

LONGEST_NAME = 255
"""Largest number of bytes in a file name, on all supported systems."""


@dataclass(frozen=True)
class Script:
    """A script that was read and found correct. file: as in messages; statements: up to STOP, which is among them;
    text: all of it, as it was read; parameters: by their names."""

    file: str
    statements: tuple[Statement, ...]
    text: str = ""
    parameters: dict[str, Parameter] = field(default_factory=dict)

    @property
    def directory(self) -> Path:
        """Folder of the script, to which file names in it are relative."""
        return Path(self.file).parent


def read_script(path: str | Path, table: t.Table = t.ZDEM) -> Script:
    """Read and check a script file; UsageError if it cannot be opened, ScriptError at the first wrong line."""
    try:
        source = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise UsageError(f"cannot read the script {path}: {getattr(error, 'strerror', None) or error}") from None
    return parse_text(source, str(path), table)


def parse_text(source: bytes | str, file: str = "script", table: t.Table = t.ZDEM, whole: bool = True) -> Script:
    """Read and check the text of a script; ScriptError at the first wrong line. `file` is the name messages show;
    whole: nothing follows, so there must be a command and a use for each parameter."""
    if isinstance(source, str):
        source = source.encode("utf-8", errors="surrogatepass")
    statements: list[Statement] = []
    parameters = Parameters(file, table)
    for line in lexer.read_lines(source, file):
        if parameters.take(line):
            continue
        before = statements[-1] if statements else None
        statement = _LineParser(parameters.put_in(line), file, table, before).statement()
        rules.check_statement(statement)
        rules.check_place(statement, statements)
        statements.append(statement)
        if statement.command == "STOP":
            break
    if whole:
        if not statements:
            raise ScriptError(file, 1, f"there is no command in the script; the first must be {rules.BEGINNINGS}")
        parameters.check()
    plan.follow(statements)
    return Script(file, tuple(statements), source.decode("utf-8", errors="replace"), parameters.known)


class _LineParser:
    """Reads one line, word by word, against the table."""

    def __init__(self, line: Line, file: str, table: t.Table, before: Statement | None = None) -> None:
        self.line, self.file, self.table, self.before = line, file, table, before
        self.at = 0
        self.words: tuple[t.Option, ...] = ()
        self.unexecuted: list[str] = []
        self.warnings: list[str] = []
        self.context = line.tokens[0].text

    # ---- words

    def peek(self) -> Token | None:
        return self.line.tokens[self.at] if self.at < len(self.line.tokens) else None

    def next(self, expected: str) -> Token:
        token = self.peek()
        if token is None:
            self.fail(f"{self.context}: the line ends where {expected} is expected; a command is one line")
        self.at += 1
        return token

    def fail(self, message: str) -> NoReturn:
        raise ScriptError(self.file, self.line.number, message)

    def unexpected(self, token: Token, expected: str, hint: str = "") -> NoReturn:
        if lexer.is_part(token):
            hint += lexer.BLANKS
        self.fail(f"{self.context}: read {token}, expected {expected}{hint}")

    def row(self, token: Token, rows: Sequence[t.AnyRow]) -> t.AnyRow | None:
        """The row a word stands for; where it is only guessed by its first letters, with a warning."""
        row, guessed = t.find(token.word, rows)
        if row is not None and guessed:
            self.warnings.append(f"{self.context}: '{token.text}' is interpreted as {row.name}, which begins like it")
        return row

    def note(self, row: t.Row, what: str) -> None:
        if not row.executed:
            self.unexecuted.append(what)

    # ---- the statement

    def statement(self) -> Statement:
        command = self.command()
        arguments: dict[str, Any] = {}
        self.leading(command, arguments)
        selection = self.options(command, arguments)
        missing = [option.name for option in command.options if option.required and option.key not in arguments]
        if missing:
            self.fail(f"{command.name}: {t.joined(missing)} missing; {_syntax_hint(command)}")
        name = command.same_as or command.name
        return Statement(
            self.file, self.line.number, name, arguments, selection, self.line.text, tuple(self.unexecuted),
            tuple(self.warnings),
        )  # fmt: skip

    def command(self) -> t.Command:
        token = self.next("a command")
        command = self.table.command(token.word)
        if command is not None:
            self.context = command.name
            self.note(command, command.name)
            return command
        if self.table.range_row.accepts(token.word):
            self.fail(f"RANGE is not a command; put it at the end of the line of another command{self.rest(token)}")
        if lexer.number(token) is not None:
            self.fail(f"read {token}, expected a command; every line begins with a command{self.rest(token)}")
        if not token.text.isascii():
            self.fail(f"read {token}, expected a command; a comment begins with #, ! or ;")
        rest = self.rest(token)
        if rest:
            self.fail(f"read {token}, expected a command{rest}")
        near = self.table.hint(token.word)
        known = "" if near else "; commands are " + t.joined(c.name for c in self.table.commands)
        self.fail(f"read {token}, expected a command{near}{known}")

    def rest(self, token: Token) -> str:
        """Return a hint if the line may be the second half of the one before it: lines that a PDF broke in two are
        copied like this. Empty otherwise."""
        command = None if self.before is None else self.table.command(self.before.command.lower())
        if command is None or self.before is None:
            return ""
        rows = [*command.options, *((self.table.range_row, *self.table.range_terms) if command.ranged else ())]
        continues = lexer.number(token) is not None or any(row.accepts(token.word) for row in rows)
        return f"; it may be the rest of line {self.before.line}: {lexer.JOIN}" if continues else ""

    def leading(self, command: t.Command, arguments: dict[str, Any]) -> None:
        """Fixed words and values that follow the command itself. Words are left out of the arguments."""
        for option in command.leading:
            self.note(option, f"{command.name} {option.name}")
            if option.kind is not t.FLAG:
                arguments[option.key] = self.value(option)
                continue
            token = self.peek()
            if token is not None and option.accepts(token.word):
                self.at += 1
            elif option.required:
                self.unexpected(self.next(f"'{option.name}'"), f"'{option.name}'")

    def options(self, command: t.Command, arguments: dict[str, Any]) -> sel.Selection | None:
        """Keywords in any order, then RANGE; returns the selection."""
        self.words = command.options
        while (token := self.peek()) is not None:
            self.at += 1
            if t.find(token.word, command.options)[0] is None and self.table.range_row.accepts(token.word):
                if not command.ranged:
                    self.unexpected(token, f"a keyword: {command.name} does not accept RANGE")
                return self.selection()
            option = self.row(token, command.options) or self.switched_off(token, command)
            if option is None:
                self.unknown(token, command)
            if option.key in arguments:
                self.fail(f"{command.name}: {option.name} is given twice (column {token.column})")
            self.note(option, f"{command.name} {option.name}")
            arguments[option.key] = self.value(option) if not option.switch else token.text[0] != "-"
        return None

    def switched_off(self, token: Token, command: t.Command) -> t.Option | None:
        """The option of a word such as ``-bline``."""
        option = command.option(token.word[1:]) if token.text[0] == "-" else None
        return option if option is not None and option.switch else None

    def unknown(self, token: Token, command: t.Command) -> NoReturn:
        words = command.words
        if not words:
            self.unexpected(token, "the end of the line")
        if lexer.number(token) is not None:
            self.unexpected(token, "a keyword before this number: " + t.joined(words))
        near = hint(token.word, [*words, *(option.full for option in command.options)])
        if not near and self.table.command(token.word) is not None and len(token.text) > 3:
            near = "; a new command begins a new line"
        self.unexpected(token, f"a keyword: {t.joined(words)}", near)

    # ---- RANGE

    def selection(self) -> sel.Selection:
        self.context = f"{self.context} RANGE"
        terms: list[sel.Selection] = []
        joins: list[str] = []
        join = ""
        names = t.joined(row.name for row in self.table.range_terms)
        while (token := self.peek()) is not None:
            self.at += 1
            row = self.row(token, self.table.range_terms)
            if row is None:
                self.no_term(token, names)
            self.note(row, f"RANGE {row.name}")
            if row.key in ("and", "or"):
                if join or not terms:
                    self.unexpected(token, "a term such as x (a b) or group name before it")
                join = row.key
                continue
            if terms:
                joins.append(join)
            terms.append(self.term(row))
            join = ""
        if not terms or join:
            self.next(f"a term ({names})")
        return sel.chain(terms, joins)

    def no_term(self, token: Token, names: str) -> NoReturn:
        if lexer.number(token) is not None:
            self.unexpected(token, f"one of {names}; is there a number too many?")
        near = hint(token.word, [row.name for row in self.table.range_terms])
        self.unexpected(token, f"one of {names} (RANGE must be last)", near)

    def term(self, row: t.Option) -> sel.Selection:
        value = self.value(row)
        match row.key:
            case "x" | "y":
                return sel.Interval(row.key, *value)
            case "p4":
                return sel.Polygon(value)
            case "ellipse":
                return sel.Ellipse(*value)
            case "group":
                return sel.Group(value)
        return sel.Ids(*value)

    # ---- values, by kind

    def value(self, option: t.Option) -> Any:
        return _READERS[type(option.kind)](self, option.kind, option.name)

    def number(self, kind: t.Number, name: str) -> float | int:
        token = self.next(f"{kind.meaning} for {name}")
        value = self.plain_number(token, f"{kind.meaning} for {name}")
        if kind.integer:
            whole = lexer.whole(value)
            if whole is None:
                self.unexpected(token, f"{kind.meaning} for {name}")
            value = whole
        below = value <= kind.low if kind.above else value < kind.low
        if below or value > kind.high or (value == 0 and not kind.zero):
            self.unexpected(token, f"{kind.meaning} for {name}")
        return value

    def plain_number(self, token: Token, expected: str) -> float:
        if lexer.is_expression(token):
            self.unexpected(token, f"{expected}; use variables in RANGE and in x and y of GEN only")
        value = lexer.number(token)
        if value is None:
            self.unexpected(token, expected)
        if abs(value) == float("inf"):
            self.unexpected(token, f"{expected}; this one is too large")
        return value

    def variable(self, expected: str) -> sel.Value:
        """A number or an expression."""
        token = self.next(expected)
        value = lexer.expression(token, self.file) if lexer.is_expression(token) else self.plain_number(token, expected)
        after = self.peek()
        if after is not None and lexer.is_part(after):
            self.unexpected(after, f"no sign after {token}")
        return value

    def flag(self, kind: t.Flag, name: str) -> bool:
        return True

    def optional(self, kind: t.Optional, name: str) -> float:
        token = self.peek()
        if token is None or lexer.number(token) is None:
            return kind.absent
        return self.number(t.Number(kind.pattern, kind.meaning, low=0.0), name)

    def point(self, kind: t.Kind, name: str) -> tuple[float, float]:
        first, second = f"{kind.meaning} for {name}", f"a second number for {name}: {kind.meaning}"
        x = self.plain_number(self.next(first), first)
        return x, self.plain_number(self.next(second), second)

    def segment(self, kind: t.Segment, name: str) -> tuple[tuple[float, float], tuple[float, float]]:
        return self.point(kind, name), self.point(kind, name)

    def interval(self, kind: t.Interval, name: str) -> tuple[sel.Value, sel.Value]:
        low = self.variable(f"the lower bound of {name}")
        signed = self.peek()
        high = self.variable(f"the upper bound of {name}")
        if isinstance(low, sel.Expression) and signed is not None and signed.text[0] in "+-":
            self.warnings.append(
                f"{self.context}: {low} and '{signed.text}' are interpreted as two bounds of {name}{lexer.BLANKS}"
            )
        if not sel.has_expressions((low, high)) and low > high:  # type: ignore[operator]
            self.fail(f"{self.context}: the lower bound of {name}, {low}, is above the upper bound, {high}")
        return low, high

    def corners(self, kind: t.Corners, name: str) -> tuple[tuple[sel.Value, sel.Value], ...]:
        numbers = [self.variable(f"number {i + 1} of the 8 numbers of {name}") for i in range(8)]
        return tuple(zip(numbers[0::2], numbers[1::2]))

    def ellipse(self, kind: t.EllipseShape, name: str) -> tuple[sel.Value, ...]:
        shape = tuple(self.variable(f"{what} of {name}") for what in ("x0", "y0", "half axis a", "half axis b"))
        for axis in shape[2:]:
            if not isinstance(axis, sel.Expression) and axis < 0.0:
                self.fail(f"{self.context}: a half axis of {name} is {axis}, it must not be below 0")
        return shape

    def id_range(self, kind: t.IdRange, name: str) -> tuple[int, int]:
        first = int(self.number(t.INDEX, name))
        token = self.peek()
        last = first if token is None or lexer.number(token) is None else int(self.number(t.INDEX, name))
        if last < first:
            self.fail(f"{self.context}: the first id, {first}, is above the last, {last}")
        return first, last

    def radii(self, kind: t.Radii, name: str) -> tuple[float, ...]:
        token = self.next("the word 'discrete'")
        if not _word("discrete", token):
            self.unexpected(token, f"the word 'discrete' after {name}", hint(token.word, ["discrete"]))
        radii = [float(self.number(t.POSITIVE, name))]
        while (token_ := self.peek()) is not None and lexer.number(token_) is not None:
            radii.append(float(self.number(t.POSITIVE, name)))
        return tuple(radii)

    def viscosity(self, kind: t.Viscosity, name: str) -> float:
        token = self.next("the word 'lsm'")
        if token.word != "lsm":
            self.unexpected(token, f"the word 'lsm' after {name} (local damping is set with PROP damp)")
        return float(self.number(t.NOT_NEGATIVE, f"{name} lsm"))

    def color(self, kind: t.Color, name: str) -> int:
        token = self.next(kind.meaning)
        if token.word in t.COLORS:
            return t.COLORS[token.word]
        value = lexer.number(token)
        whole = lexer.whole(value) if value is not None else None
        if whole is None or whole not in t.COLORS.values():
            self.unexpected(token, kind.meaning, hint(token.word, t.COLORS))
        return whole

    def name(self, kind: t.Name, name: str) -> str:
        token = self.next(kind.meaning)
        if token.word in ("range", "and", "or"):
            self.unexpected(token, kind.meaning)
        return token.word

    def file_name(self, kind: t.File, name: str) -> str:
        token = self.next(kind.meaning)
        if self.table.range_row.full == token.word:
            self.unexpected(token, kind.meaning)
        longest = max(len(part.encode()) for part in token.text.split("/"))
        if longest > LONGEST_NAME:
            self.unexpected(
                token, f"{kind.meaning}; this one is {longest} bytes long, at most {LONGEST_NAME} are possible"
            )
        return token.text

    def values(self, kind: t.Values, name: str) -> dict[str, float]:
        found: dict[str, float] = {}
        while True:
            token = self.next(f"{kind.meaning} for {name}")
            if not token.text.isidentifier():
                self.unexpected(token, f"{kind.meaning} for {name}")
            if token.text in found:
                self.fail(f"{self.context}: {name} {token.text} is given twice")
            what = f"a number for {name} {token.text}"
            found[token.text] = self.plain_number(self.next(what), what)
            after = self.line.tokens[self.at : self.at + 2]
            if len(after) < 2 or lexer.number(after[1]) is None or any(row.named(after[0].word) for row in self.words):
                return found

    def names(self, kind: t.Names, name: str) -> tuple[str, ...]:
        return tuple(piece.text for piece in self.either(kind, name, None))

    def either(self, kind: t.Kind, name: str, number: int | None) -> list[Token]:
        """Parse `number` words (None: any number) separated by |, with or without blanks; the tokens contain the words
        alone."""
        pieces: list[Token] = []
        bars = 0
        while True:
            token = self.next(f"{kind.meaning} for {name}")
            pieces += [Token(word, token.line, token.column) for word in token.text.split("|") if word]
            bars += token.text.count("|")
            after = self.peek()
            if len(pieces) > bars and (after is None or not after.text.startswith("|")):
                break
        if number not in (None, len(pieces)) or bars != len(pieces) - 1:
            self.unexpected(token, f"{kind.meaning} for {name}")
        return pieces

    def groups(self, kind: t.Groups, name: str) -> tuple[str, ...]:
        token = self.peek()
        if token is not None and token.word == "group":
            self.at += 1
        return tuple(piece.word for piece in self.either(kind, name, kind.number))

    def laws(self, kind: t.Laws, name: str) -> tuple[str, ...]:
        return tuple(piece.text for piece in self.either(kind, name, 2))

    def wall_ids(self, kind: t.WallIds, name: str) -> tuple[int, ...]:
        token = self.peek()
        if kind.optional and (token is None or not (token.word in ("wall", "id") or lexer.number(token) is not None)):
            return ()
        for word in ("wall", "id"):
            token = self.peek()
            if token is not None and token.word == word:
                self.at += 1
        ids = []
        for piece in self.either(kind, name, kind.number):
            value = lexer.number(piece)
            whole = lexer.whole(value) if value is not None else None
            if whole is None or whole < 0:
                self.unexpected(piece, f"{kind.meaning} for {name}")
            ids.append(whole)
        return tuple(ids)

    def choice(self, kind: t.Choice, name: str) -> str:
        token = self.next(f"{kind.meaning} for {name}")
        values = dict(kind.choices)
        if token.word not in values:
            self.unexpected(token, f"{kind.meaning} for {name}", hint(token.word, values))
        return values[token.word]


_READERS: dict[type, Callable[[_LineParser, Any, str], Any]] = {
    t.Flag: _LineParser.flag,
    t.Number: _LineParser.number,
    t.Optional: _LineParser.optional,
    t.Point: _LineParser.point,
    t.Segment: _LineParser.segment,
    t.Interval: _LineParser.interval,
    t.Corners: _LineParser.corners,
    t.EllipseShape: _LineParser.ellipse,
    t.IdRange: _LineParser.id_range,
    t.Radii: _LineParser.radii,
    t.Viscosity: _LineParser.viscosity,
    t.Color: _LineParser.color,
    t.Name: _LineParser.name,
    t.File: _LineParser.file_name,
    t.Values: _LineParser.values,
    t.Choice: _LineParser.choice,
    t.Names: _LineParser.names,
    t.Groups: _LineParser.groups,
    t.Laws: _LineParser.laws,
    t.WallIds: _LineParser.wall_ids,
}


def _word(full: str, token: Token) -> bool:
    return len(token.word) >= 3 and full.startswith(token.word)


def _syntax_hint(command: t.Command) -> str:
    return f"for example: {command.example[0]}"
