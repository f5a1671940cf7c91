"""ZDEM commands as they are typed, on one rank: a script that grows line by line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hpcdem.lang.zdem import execute
from hpcdem.lang.zdem.parser import parse_text

PROMPT = "zdem> "
WELCOME = (
    "ZDEM commands, one per line; the first is START, RESTORE or LOAD; STOP ends a model, Ctrl-D the console.\n"
    "Commands: docs/zdem_reference.md"
)
TYPED = "console"
"""Name of the input in messages."""


class Conversation:
    """make: an empty model; finish: called with a model that has come to its end. text: what was carried out of the
    present model so far; sim: the model, None before its first command."""

    def __init__(self, make: Callable[[], Any], finish: Callable[[Any], None]) -> None:
        self.make, self.finish = make, finish
        self.text, self.done = "", 0
        self.sim: Any = None

    def carry_out(self, text: str, name: str = "") -> bool:
        """Carry out lines; name: of a script, which begins a model of its own. Whether there was a command in them.

        HpcdemError at the first line that is wrong or fails: those before it stay.
        """
        if name:
            self._leave()
        whole = f"{self.text}{text}\n"
        script = parse_text(whole, name or TYPED, whole=False)
        new = script.statements[self.done :]
        execute.refuse_unexecuted(new)
        if not new:
            self.text = whole
            return False
        if self.sim is None:
            self.sim = self.make()
        interpreter = execute.Interpreter(script)
        interpreter.refuse_lost_files(self.sim)
        interpreter.load_laws(self.sim)
        self.sim.script = script.text
        for index, statement in enumerate(new, self.done):
            try:
                interpreter.carry_out(self.sim, index)
            except BaseException:
                self.text = "".join(line + "\n" for line in whole.split("\n")[: statement.line - 1])
                raise
            self.done = index + 1
        self.text = whole
        if new[-1].command == "STOP":
            self._leave()
        return True

    def show(self) -> Path | None:
        """Write the present state for pages to read. Return its path, None without a model."""
        from hpcdem.commands import present  # brings kernels with it

        return None if self.sim is None else present.particles(self.sim)

    def _leave(self) -> None:
        """The end of a model."""
        if self.sim is not None:
            self.finish(self.sim)
        self.sim, self.text, self.done = None, "", 0
