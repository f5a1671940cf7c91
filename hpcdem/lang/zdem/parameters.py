"""Parameters of a ZDEM script: ``friction = 0.3`` on a line of its own, and ``{friction}`` where a number stands.

ZDEM itself does not know them. Lines that were commands before stay commands: a name that stands for one is none for
a parameter.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from hpcdem.core.errors import ScriptError
from hpcdem.core.selection import VARIABLES
from hpcdem.lang.zdem import lexer
from hpcdem.lang.zdem.lexer import Line, Token
from hpcdem.lang.zdem.table import Table

_ASSIGNMENT = re.compile(r"[A-Za-z_]\w*\s*=\s*[^\s=(),]+", re.ASCII)
_USE = re.compile(r"\{([A-Za-z_]\w*)\}", re.ASCII)


@dataclass(frozen=True)
class Parameter:
    """A number with a name. token: the number as written in the script."""

    name: str
    token: Token


class Parameters:
    """The parameters of a script, and which of them are used."""

    def __init__(self, file: str, table: Table) -> None:
        self.file, self.table = file, table
        self.known: dict[str, Parameter] = {}
        self.used: set[str] = set()

    def take(self, line: Line) -> bool:
        """Store the parameter if the line is an assignment, and return whether it is. Raises ScriptError for an invalid
        parameter."""
        if _ASSIGNMENT.fullmatch(line.text) is None or len(line.tokens) != 2:
            return False
        name, value = line.tokens[0].word, line.tokens[1]
        if self.table.command(name) is not None or lexer.number(value) is None:
            return False
        if name in VARIABLES:
            raise ScriptError(self.file, line.number, f"'{name}' is an extent of the model and cannot name a parameter")
        if name in self.known:
            first = self.known[name].token.line
            raise ScriptError(self.file, line.number, f"the parameter {name} is set a second time, after line {first}")
        self.known[name] = Parameter(name, value)
        return True

    def put_in(self, line: Line) -> Line:
        """The line with numbers in place of ``{names}``; other braces stay."""

        def number(match: re.Match[str]) -> str:
            name = match[1].lower()
            if name not in self.known:
                return match[0]
            self.used.add(name)
            return self.known[name].token.text

        return replace(line, tokens=tuple(replace(t, text=_USE.sub(number, t.text)) for t in line.tokens))

    def check(self) -> None:
        """ScriptError for a parameter that nothing uses."""
        for name, parameter in self.known.items():
            if name not in self.used:
                raise ScriptError(
                    self.file, parameter.token.line,
                    f"parameter {name} is never used; write {{{name}}} instead of the number",
                )  # fmt: skip
