"""Converts the words of a ``pcdc`` line to a statement. The grammar comes from `table`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from hpcdem.core.errors import ScriptError
from hpcdem.core.nearest import hint
from hpcdem.lang.pcdc import kinds, lexer, rules, trial
from hpcdem.lang.pcdc.keywords import Keyword, Row, beginning, matching
from hpcdem.lang.pcdc.kinds import Pending
from hpcdem.lang.pcdc.lexer import Escape, Token, Vector, Word
from hpcdem.lang.pcdc.statement import Statement, resolved, shown
from hpcdem.lang.pcdc.table import INSTEAD, PROPERTY, RANGE, Command, Level, Model, Option, Spelling, Table
from hpcdem.physics.fdem.tables import AXES, Drawn, Over


def parse(
    words: str, file: str, line: int, text: str, table: Table, last_line: int = 0, dim: int | None = 2
) -> Statement:
    """The statement of a line; words: what follows ``pcdc``; text: the line as messages show it; dim: dimensions of the
    model that it is for, None: not known. ScriptError."""
    try:
        return _Line(words, table, dim).statement(file, line, text, last_line or line)
    except ValueError as error:
        raise ScriptError(file, line, f"{shown(text)}: {error}") from None


def expected(words: str, table: Table) -> Sequence[Any]:
    """Rows of the keywords that may follow on the words of a begun line; none where a value is due, or after an
    error."""
    line: _Line | None = None
    try:
        line = _Line(words, table, None)
        line.statement("", 0, "", 0)
    except ValueError:
        pass
    return line.wanted if line is not None and line.at >= len(line.tokens) else ()


class Refused(ValueError):
    """A word that is known and refused, with what to do instead."""


def trace(words: str, table: Table, dim: int | None) -> tuple[Command, Spelling, list[str]]:
    """The command of a line, the words that named it, and all words of the line in full. ValueError; Refused."""
    line = _Line(words, table, dim)
    return line.statement("", 0, "", 0).command, line.spelling, line.trail


class _Line:
    """Reads one line, word by word, against the table. Errors are ValueErrors. wanted: the rows of keywords
    that may stand where the line ends."""

    def __init__(self, words: str, table: Table, dim: int | None) -> None:
        self.tokens = lexer.tokens(words)
        self.table = table
        self.dim = dim
        self.at = 0
        self.expressions = kinds.Expressions()
        self.context = "pcdc"
        self.wanted: Sequence[Any] = ()
        self.spelling = Spelling(table.commands[0], ())
        self.trail: list[str] = []
        """Keywords that were read, in full."""
        self.rows: Sequence[Option] = ()
        """Keywords of the command."""

    # ---- words

    def peek(self) -> Token | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def next(self, expected: str) -> Token:
        token = self.peek()
        if token is None:
            raise ValueError(f"the line ends where {expected} is expected; end a continued line with \\")
        self.at += 1
        return token

    def take(self, rows: Sequence[Row]) -> Row | None:
        """The row that the next word means, and past it; None if it means none of them."""
        token = self.peek()
        if token is None:
            self.wanted = [*self.wanted, *rows]
        if not isinstance(token, Word):
            return None
        found = matching(token.text, rows)
        if len(found) > 1:
            names = ", ".join(f"'{row.keyword}'" for row in found)
            raise ValueError(f"{token} is ambiguous after '{self.context}': it may mean {names}")
        if not found:
            return None
        self.at += 1
        self.trail.append(found[0].keyword.name)
        if refused := getattr(found[0], "refused", ""):
            raise Refused(f"{token} is rejected after '{self.context}': {refused}")
        return found[0]

    def unknown(self, token: Token, rows: Sequence[Row]) -> NoReturn:
        """Candidates: words that begin like it (too few letters), else similar ones, else all there are."""
        names = [row.keyword.name for row in rows]
        if not names:
            raise ValueError(f"read {token}, expected the end of the line")
        if not isinstance(token, Word):
            raise ValueError(f"read {token}, expected a keyword after '{self.context}': {_joined(names)}")
        short = beginning(token.text, rows)
        if short:
            least = _joined(f"{row.keyword.name} (at least '{row.keyword.shortest()}')" for row in short)
            raise ValueError(f"{token} is too short after '{self.context}'; it may mean {least}")
        near = hint(token.text, names)
        raise ValueError(f"read {token} after '{self.context}', expected one of {_joined(names)}{near}")

    # ---- the statement

    def statement(self, file: str, line: int, text: str, last_line: int) -> Statement:
        command = self.command()
        arguments: dict[str, Any] = {}
        for leading in command.leading:
            self.leading(leading, arguments)
        options: Sequence[Option] = command.options
        if command.models:
            model = self.model(command)
            arguments["model"] = model.keyword.name
            for leading in model.leading:
                self.leading(leading, arguments)
            self.take([PROPERTY])
            given: dict[str, Any] = {}
            terms = self.options(command, model.options, given)
            self.require(model.options, given)
            self.complete(model, given)
            arguments["properties"] = given
        else:
            if command.properties:
                self.take([PROPERTY])
            terms = self.options(command, options, arguments)
            self.require(options, arguments)
            if command.needs_option and not any(option.name in arguments for option in options):
                raise ValueError(f"'{self.context}' needs at least one of {_joined(o.name for o in options)}")
            rules.check(command, arguments, terms)
        trial.check(command, arguments, terms)
        return Statement(file, line, command, arguments, terms, text, tuple(self.expressions.codes), last_line)

    def command(self) -> Command:
        """The words of a command, one after the other."""
        begun: tuple[str, ...] = ()
        while True:
            level, spellings = self.table.level(begun)
            depth = len(begun)
            ended = next((spelling for spelling in spellings if len(spelling.words) == depth), None)
            found = self.take(level)
            if found is None:
                if ended is not None and (ended.own or not self._is_unknown(ended.command)):
                    return self._allowed(ended)
                token = self.next("a command: " + _joined(row.keyword.name for row in level))
                self.unknown(token, level)
            begun = (*begun, found.keyword.notation)
            self.context = f"{self.context} {found.keyword}" if depth else found.keyword.name
            _, spellings = self.table.level(begun)
            if len(spellings) == 1 and len(spellings[0].words) == len(begun):
                return self._allowed(spellings[0])

    def _is_unknown(self, command: Command) -> bool:
        """Return whether the next word cannot continue this command when its last word is omitted."""
        token = self.peek()
        rows: tuple[Any, ...] = (*command.options, *command.models)
        return token is None or (isinstance(token, Word) and not matching(token.text, rows))

    def _allowed(self, spelling: Spelling) -> Command:
        command, self.spelling = spelling.command, spelling
        self.refuse_elsewhere(command.name, command.dims)
        if command.refused:
            raise Refused(f"'{self.context}' is rejected: {command.refused}")
        return command

    def refuse_elsewhere(self, word: object, dims: Sequence[int]) -> None:
        """ValueError for a word that is not there in the dimensions of this model."""
        if self.dim is not None and self.dim not in dims:
            numbers = {2: "two", 3: "three"}
            instead = f"; in three dimensions use {INSTEAD[str(word)]}" if str(word) in INSTEAD else " in this version"
            advice = "; model new dim 3 makes a model of three" if self.dim == 2 else instead
            raise Refused(f"'{word}' is for {numbers[dims[0]]} dimensions{advice}")

    def leading(self, option: Option, arguments: dict[str, Any]) -> None:
        if not option.required and self.peek() is None:
            return
        token, kind = self.peek(), option.values[0]
        if not option.required and isinstance(token, Word) and token.text.lower() not in kind.words:
            if not (kind.tabled and matching(token.text, [_TABLE])):
                return
        arguments[option.name] = self.values(option)

    def model(self, command: Command) -> Model:
        found = self.take(command.models)
        if found is None:
            token = self.next("the name of a model: " + _joined(m.keyword.name for m in command.models))
            if isinstance(token, Word):
                for other in self.table.commands:
                    for model in matching(token.text, other.models):
                        raise ValueError(
                            f"{token} ({model.keyword}) belongs to pcdc {other.name}, not to '{self.context}', which "
                            f"has {_joined(m.keyword.name for m in command.models)}"
                        )
            self.unknown(token, command.models)
        self.context = f"{self.context} {found.keyword}"
        self.refuse_elsewhere(found.keyword, found.dims)
        return found

    def options(
        self, command: Command, options: Sequence[Option], arguments: dict[str, Any]
    ) -> tuple[tuple[str, Any], ...] | None:
        """Keywords in any order, then RANGE."""
        rows = self.rows = [*options, RANGE] if command.ranged else options
        while (token := self.peek()) is not None:
            option = self.take(rows)
            if option is RANGE:
                return self.range(command)
            if option is None:
                self._no_keyword(token, command, options)
            value = self.values(option)
            if option.repeated:
                arguments.setdefault(option.name, []).append(value)
            elif option.name in arguments:
                raise ValueError(f"'{option.keyword}' is given twice")
            else:
                arguments[option.name] = value
        self.wanted = [*self.wanted, *rows]
        return None

    def _no_keyword(self, token: Token, command: Command, options: Sequence[Option]) -> NoReturn:
        if isinstance(token, Word) and matching(token.text, [RANGE]) and not command.ranged:
            raise ValueError(f"'{self.context}' does not accept a range")
        self.unknown(token, [*options, RANGE] if command.ranged else options)

    def require(self, options: Sequence[Option], given: dict[str, Any]) -> None:
        missing = [
            option.keyword.notation for option in options if option.required and option.name not in given
            and (self.dim in option.dims if self.dim else len(option.dims) > 1)
        ]  # fmt: skip
        if missing:
            raise ValueError(f"'{self.context}' lacks {_joined(missing)}")

    def complete(self, model: Model, given: dict[str, Any]) -> None:
        """Check that one of the alternative sets of properties, or any property at all, is given."""
        if model.any_of and not given:
            raise ValueError(f"'{self.context}' needs at least one of {_joined(o.name for o in model.options)}")
        if model.one_of and not any(all(name in given for name in names) for names in model.one_of):
            sets = " or ".join(" and ".join(names) for names in model.one_of)
            raise ValueError(f"'{self.context}' needs {sets}")

    # ---- values

    def values(self, option: Option) -> Any:
        """Read what follows a keyword: one value, a tuple of several, or a dict if keywords of its own may follow, each
        once; a second occurrence belongs to the command."""
        self.refuse_elsewhere(option.keyword, option.dims)
        read = []
        for kind in option.values:
            if self.dim not in (None, *kind.dims):
                continue
            if (kind.optional or (self.dim is None and len(kind.dims) == 1)) and not self._may_be(kind):
                break
            read.append(self.one(kinds.fitting(kind, self.dim), option))
        value = read[0] if len(option.values) == 1 and read else tuple(read) if option.values else True
        if not option.more:
            return value
        given = {"value": value}
        outer, self.context = self.context, f"{self.context} {option.keyword}"
        while (inner := self.take(option.more)) is not None:
            if inner.name in given:
                if any(row.keyword == inner.keyword for row in self.rows):
                    self.at -= 1
                    self.trail.pop()
                    break
                raise ValueError(f"'{inner.keyword}' is given twice after '{option.keyword}'")
            given[inner.name] = self.values(inner)
        self.require(option.more, given)
        self.context = outer
        return given

    def _may_be(self, kind: kinds.Kind) -> bool:
        """Return whether a value, or a word that represents one, follows."""
        token = self.peek()
        return self._value_follows() or (isinstance(token, Word) and token.text.lower() in kind.words)

    def _spread(self, kind: kinds.Kind) -> None:
        """Numbers between commas are a vector only where one is expected."""
        at = self.at
        while at < len(self.tokens) and not isinstance(token := self.tokens[at], Word):
            if isinstance(token, Vector) and token.bare:
                self.tokens[at : at + 1] = token.items
            at += 1
            if not kind.many:
                return

    def one(self, kind: kinds.Kind, option: Option) -> Any:
        what = f"'{option.keyword}'"
        if "<v>" not in kind.pattern and kind.pattern.startswith(("<f>", "<i>", "[<f>", "[<i>")):
            self._spread(kind)
        if self.peek() is None:
            self.wanted = [Level(Keyword(word)) for word in kind.words]
        if kind.many:
            token = self.peek()
            if isinstance(token, Escape) and not self._value_follows(1):
                self.at += 1
                return kinds.read_list(kind, token, what, self.expressions)
            found = []
            while self._value_follows():
                found.append(kinds.read_value(kind, self.next(""), what, self.expressions))
            if not found:
                token = self.next(f"{kind.meaning} for {what}")
                raise ValueError(f"read {token}, expected {kind.meaning} for {what}")
            return found
        token = self.next(f"{kind.meaning} for {what}")
        if kind.varied and isinstance(token, Word) and matching(token.text, [_TABLE, _FIELD]):
            return self._varied(token, kind)
        if kind.tabled and isinstance(token, Word) and matching(token.text, [_TABLE]):
            name = kinds.read_value(
                kinds.STRING, self.next("the name of a table in quotes"), "'table'", self.expressions
            )
            return _later(kinds.TableName, name)
        if "function" in kind.pattern and isinstance(token, Word) and matching(token.text, [_FUNCTION]):
            name = kinds.read_value(
                kinds.FILE, self.next("the name of a function in quotes"), "'function'", self.expressions
            )
            if isinstance(name, Pending):
                raise ValueError("the file of a function is plain text: it is read and checked before the script runs")
            return kinds.FunctionName(name)
        if isinstance(token, Word) and token.text.lower() in kind.words:
            self.trail.append(token.text.lower())
        return kinds.read_value(kind, token, what, self.expressions)

    def _varied(self, token: Word, kind: kinds.Kind) -> Any:
        """Read what follows ``table`` or ``field`` in place of a number."""
        if matching(token.text, [_FIELD]):
            return _later(Drawn, self.one(kinds.STRING, _FIELD))
        name = self.one(kinds.STRING, _TABLE)
        axes = [axis for axis in kind.axes if axis != "z" or self.dim != 2]
        if self.take([_OVER]) is None:
            over = " or ".join(f"'over {axis}'" for axis in axes)
            word = self.next(over)
            raise ValueError(f"read {word}, expected {over} after the name of the table")
        axis = self.one(kinds.choice(*axes), _OVER)
        return _later(lambda name, axis: Over(name, AXES.index(axis)), name, axis)

    def _value_follows(self, ahead: int = 0) -> bool:
        at = self.at + ahead
        return at < len(self.tokens) and not isinstance(self.tokens[at], Word)

    # ---- RANGE

    def range(self, command: Command) -> tuple[tuple[str, Any], ...]:
        rows = [term for term in self.table.range_terms if not term.only or command.ranged in (*term.only, "any")]
        outer, self.context = self.context, f"{self.context} range"
        terms: list[tuple[str, Any]] = []
        while (token := self.peek()) is not None:
            term = self.take(rows)
            if term is None:
                self.unknown(token, rows)
            terms.append((term.name, self.values(term)))
        self.wanted = [*self.wanted, *rows]
        if not terms:
            self.next("a term: " + _joined(row.keyword.name for row in rows))
        self.context = outer
        return tuple(terms)


_FUNCTION = Option("func{tion}", ())
_TABLE, _FIELD, _OVER = Option("tab{le}", ()), Option("field", ()), Option("over", ())


def _later(make: Callable[..., Any], *given: Any) -> Any:
    """make(*given), when all is known of them."""
    if not any(isinstance(value, Pending) for value in given):
        return make(*given)
    return Pending(lambda values: make(*(resolved(value, values) for value in given)))


def _joined(names: Any) -> str:
    return ", ".join(names)
