"""Carries out the text of a case in the session of this process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hpcdem import session
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc.execute import Interpreter


class Carrier:
    """Executes the text of a case, in the running script or in the model of a Python program.

    file: what messages call the text; outdir: a folder for a model of its own; CommandError in a PCDC script. names:
    the variables of the text. Collective.
    """

    def __init__(self, file: str, outdir: Path | str | None = None) -> None:
        self.session = session.current()
        self.file = file
        if outdir is not None:
            running = self.session.interpreter
            if running is not None and running.journal is not None:
                raise CommandError("outdir applies to Python programs: a PCDC script uses the option --outdir")
            folder = self.session.directory / outdir
            project = self.session.project(folder)
            project.directory = folder
            self.interpreter = Interpreter(project)
        else:
            if self.session.interpreter is None:
                self.session.interpreter = Interpreter(self.session.project())
            self.interpreter = self.session.interpreter
        self.names: dict[str, Any] = {}

    def carry_out(self, text: str) -> None:
        """Execute the text. Raises ScriptError with the line of the text, and of the script around it. Collective."""
        self.interpreter.include(text, self.file, self.names)

    def close(self) -> None:
        """End a model created for the case. Collective."""
        self.session.leave(self.interpreter.project)
