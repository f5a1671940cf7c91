"""`hpcdem console`: commands and Python, line by line, on one rank."""

from __future__ import annotations

import ast
import codeop
from collections.abc import Callable
from pathlib import Path

from hpcdem.core.errors import HpcdemError, ScriptError, StoppedWithCheckpoint
from hpcdem.lang.completion import completion
from hpcdem.lang.pcdc import source
from hpcdem.lang.pcdc.complete import candidates
from hpcdem.lang.pcdc.execute import Interpreter

PROMPT, MORE = "pcdc> ", "  ... "
WELCOME = (
    "Lines that begin with 'pcdc' are commands, all others are Python; Tab completes, exit() or Ctrl-D ends.\n"
    "Commands: docs/pcdc_reference.md"
)


class Console:
    """A conversation. ask: gives the next line for a prompt, EOFError at the end; say: shows a text; begin: called
    before what was typed is carried out."""

    def __init__(
        self,
        interpreter: Interpreter,
        ask: Callable[[str], str] = input,
        say: Callable[[str], None] = print,
        begin: Callable[[], None] = lambda: None,
    ) -> None:
        self.interpreter, self.ask, self.say, self.begin = interpreter, ask, say, begin
        self.count = 0

    def run(self) -> None:
        """Read and execute commands until the end of input or exit(). Errors are reported, and the console
        continues."""
        self.say(WELCOME)
        with completion(_words, self.interpreter.namespace):
            while True:
                try:
                    text = self._block()
                except EOFError:
                    self.say("")
                    return
                except KeyboardInterrupt:
                    self.say("\n(interrupted; exit() or Ctrl-D ends)")
                    continue
                if text.strip() and not self._carried_out(text):
                    return

    def _block(self) -> str:
        """Lines that belong together: a statement of Python is whole when Python says so."""
        lines = [self.ask(PROMPT)]
        while not is_whole("\n".join(lines)):
            lines.append(self.ask(MORE))
        return "\n".join(lines)

    def carry_out(self, text: str, name: str = "") -> bool:
        """Carry out a statement, whose value is shown, or several; name: of a script. Whether there was a command in
        it. HpcdemError, SystemExit."""
        self.count += 1
        script = self.interpreter.read(text, name or f"console {self.count}")
        self.interpreter.load_laws(script)
        if not name and _statements(script.python) <= 1:
            self.interpreter.line(script)
        else:
            self.interpreter.lines(script)
        return bool(script.statements)

    def show(self) -> Path | None:
        """Write the present state for pages to read. Return its path, None without a model."""
        from hpcdem.commands import present  # brings kernels with it

        return present.blocks(self.interpreter.project)

    def _carried_out(self, text: str) -> bool:
        """False if it was the end."""
        self.begin()
        try:
            self.carry_out(text)
        except SystemExit:
            return False
        except (HpcdemError, StoppedWithCheckpoint) as error:
            self.say(str(error))
        except KeyboardInterrupt:
            self.say("interrupted")
        return True


def is_whole(text: str) -> bool:
    """Return whether a text can be executed, or is incomplete: a block continues until an empty line."""
    last = text.split("\n")[-1].rstrip()
    if last.lstrip().startswith("pcdc") and last.endswith("\\"):
        return False
    try:
        python = source.read(text, "console", dim=None).python[:-1]  # as typed: an empty line ends a block
    except ScriptError:
        return _broken_is_whole(text)
    try:
        # A block that could continue ends with an empty line, as in Python's own console.
        return codeop.compile_command(python, "console", "single") is not None
    except (SyntaxError, ValueError, OverflowError):
        return True


def _broken_is_whole(text: str) -> bool:
    """A text that cannot be read may only lack its end: `for i in range(3):`."""
    stand_in = "\n".join(
        line[: len(line) - len(line.lstrip())] + "pass" if line.lstrip().startswith("pcdc ") else line
        for line in text.split("\n")
    )
    try:
        return codeop.compile_command(stand_in, "console", "single") is not None
    except (SyntaxError, ValueError, OverflowError):
        return True


def _statements(python: str) -> int:
    """Count the Python statements of a text; 1 if it cannot be parsed."""
    try:
        return len(ast.parse(python).body)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return 1


def _words(line: str) -> list[str] | None:
    """Words that may continue an unfinished command; None for Python."""
    return candidates(line) if line.lstrip().startswith("pcdc ") else None
