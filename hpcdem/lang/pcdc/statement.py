"""One parsed command of a script."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc import rules
from hpcdem.lang.pcdc.kinds import Pending
from hpcdem.lang.pcdc.table import Command


@dataclass(frozen=True)
class Statement:
    """command: row of the table; arguments: values by name, in the order written, some of them `Pending`; range: terms
    (name, value) of RANGE in the order written, None without one; text: the line as written, in one piece, without
    superfluous blanks; expressions: Python code of the values in square brackets.
    """

    file: str
    line: int
    command: Command
    arguments: Mapping[str, Any] = field(default_factory=dict)
    range: tuple[tuple[str, Any], ...] | None = None
    text: str = ""
    expressions: tuple[str, ...] = ()
    last_line: int = 0

    def error(self, message: str) -> ScriptError:
        """An error that names this line and shows it."""
        return ScriptError(self.file, self.line, f"{shown(self.text)}: {message}")

    def resolve(self, values: tuple[Any, ...]) -> tuple[dict[str, Any], tuple[tuple[str, Any], ...] | None]:
        """Arguments and range with the values of the expressions put in. ScriptError if one of them is of the wrong
        kind, or if they do not go together."""
        try:
            arguments = {name: resolved(value, values) for name, value in self.arguments.items()}
            terms = None if self.range is None else tuple((name, resolved(v, values)) for name, v in self.range)
            if self.expressions:
                rules.check(self.command, arguments, terms)
        except ValueError as error:
            raise self.error(str(error)) from None
        return arguments, terms


LONGEST_TEXT = 200
"""Largest number of characters of a line in a message."""


def shown(text: str) -> str:
    """A line as messages show it."""
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 3] + "..."


def resolved(value: Any, values: tuple[Any, ...]) -> Any:
    """`value` with everything pending in it made."""
    if isinstance(value, Pending):
        return value.make(values)
    if isinstance(value, tuple):
        return tuple(resolved(item, values) for item in value)
    if isinstance(value, list):
        return [resolved(item, values) for item in value]
    if isinstance(value, dict):
        return {name: resolved(item, values) for name, item in value.items()}
    return value
