"""One command of a script, as read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hpcdem.core.errors import ScriptError
from hpcdem.core.selection import Selection


@dataclass(frozen=True)
class Statement:
    """A command with its arguments, each read, checked and in SI units.

    command: its full name as in the table ("PROP" also for INI); arguments: value by lower-case option name, in the
    order written; selection: the RANGE, None for all particles; text: the line as written; unexecuted: words of the
    line that the solver does not carry out yet; warnings: what was read otherwise than it is written.
    """

    file: str
    line: int
    command: str
    arguments: dict[str, Any] = field(default_factory=dict)
    selection: Selection | None = None
    text: str = ""
    unexecuted: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def get(self, name: str, default: Any = None) -> Any:
        """An argument, or the default if it was not given."""
        return self.arguments.get(name, default)

    def same_as(self, other: Statement) -> bool:
        """Do both say the same, wherever they stand?"""
        return (self.command, self.arguments, self.selection) == (other.command, other.arguments, other.selection)

    def error(self, message: str) -> ScriptError:
        """An error that names this line."""
        return ScriptError(self.file, self.line, f"{self.command}: {message}")


def find(directory: Path, name: str) -> str | None:
    """Find an input file in `directory`, or in the folder data below it; None if it is in neither."""
    for path in (directory / name, directory / "data" / name):
        try:
            if path.is_file():
                return str(path)
        except (OSError, ValueError):  # a name the system cannot have
            continue
    return None
