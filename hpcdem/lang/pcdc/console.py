"""`hpcdem console`: commands and Python, line by line, on one rank."""

from __future__ import annotations

import codeop
import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from hpcdem.core.errors import HpcdemError, ScriptError
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
        """Until the end of input or exit(). What goes wrong is told, and the conversation goes on."""
        self.say(WELCOME)
        with completion(self.interpreter):
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
        while not self._is_whole("\n".join(lines)):
            lines.append(self.ask(MORE))
        return "\n".join(lines)

    def _is_whole(self, text: str) -> bool:
        last = text.split("\n")[-1].rstrip()
        if last.lstrip().startswith("pcdc") and last.endswith("\\"):
            return False
        try:
            python = source.read(text, "console", dim=None).python[:-1]  # as typed: an empty line ends a block
        except ScriptError:
            return self._broken_is_whole(text)
        try:
            # A block that could go on ends with an empty line, as in Python's own console.
            return codeop.compile_command(python, "console", "single") is not None
        except (SyntaxError, ValueError, OverflowError):
            return True

    @staticmethod
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

    def _carried_out(self, text: str) -> bool:
        """False if it was the end."""
        self.count += 1
        self.begin()
        try:
            script = self.interpreter.read(text, f"console {self.count}")
            self.interpreter.line(script)
        except SystemExit:
            return False
        except HpcdemError as error:
            self.say(str(error))
        except KeyboardInterrupt:
            self.say("interrupted")
        return True


@contextlib.contextmanager
def completion(interpreter: Interpreter) -> Iterator[None]:
    """Tab completes words of commands, and names of Python, where there is a terminal that can."""
    try:
        import readline
        import rlcompleter
    except ImportError:
        yield
        return
    names = rlcompleter.Completer(interpreter.namespace)
    found: list[str] = []

    def complete(text: str, state: int) -> str | None:
        nonlocal found
        line = readline.get_line_buffer()[: readline.get_endidx()]
        if not line.lstrip().startswith("pcdc "):
            return names.complete(text, state)
        if state == 0:
            found = candidates(line)
        return found[state] + " " if state < len(found) else None

    before: Any = readline.get_completer(), readline.get_completer_delims()
    readline.set_completer(complete)
    readline.set_completer_delims(" \t\n()[]{},=+*/'\"")
    readline.parse_and_bind("tab: complete")
    try:
        yield
    finally:
        readline.set_completer(before[0])
        readline.set_completer_delims(before[1])
