"""Execute a script: run its Python, and call a function of `hpcdem.commands.fdem` for each command.

The Python of a script runs on every rank; its commands are collective. Before executing a command the ranks compare
what they received, so that a rank that takes another branch is detected immediately.
"""

from __future__ import annotations

import io
import linecache
import math
import os.path
import random
import sys
import traceback
import zlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import FrameType
from typing import Any

import numpy as np

from hpcdem.commands import fdem
from hpcdem.core.errors import (
    CommandError,
    EquilibriumError,
    HpcdemError,
    ScriptError,
    StoppedWithCheckpoint,
    UsageError,
)
from hpcdem.lang.pcdc import names, source
from hpcdem.lang.pcdc.bindings import PASSED_OVER, Call, carry_out, where
from hpcdem.lang.pcdc.journal import COMMAND, MOST, NAMES, Journal, described
from hpcdem.lang.pcdc.kinds import FunctionName
from hpcdem.lang.pcdc.source import CALL, Source
from hpcdem.lang.pcdc.statement import Statement, shown
from hpcdem.lang.pcdc.trial import hyphened
from hpcdem.lang.pcdc.vector import Vector
from hpcdem.lang.pcdc.views import Model
from hpcdem.runtime.progress import write

READ = -1
"""Used instead of the number of a command when a script queries values of the model."""
SEED = 0
"""Seed of the random numbers of Python and numpy, equal on all ranks."""


class Interpreter:
    """Runs scripts and single lines in one namespace, on a project (hpcdem.commands.fdem).

    namespace: the global names of the script. journal: of a script that runs, None in a
    conversation.
    """

    def __init__(self, project: Any) -> None:
        self.project: Any = project
        self.sources: dict[str, Source] = {}
        self.statements: list[Statement] = []
        self.journal: Journal | None = None
        self._own_names: dict[str, Any] = {
            "__name__": "__main__", "__builtins__": __builtins__, "math": math, "Vector": Vector, "print": self._print,
            "pcdc": Model(project, self.query), CALL: self._carry_out,
        }  # fmt: skip
        self.namespace = dict(self._own_names)
        self._included_at: int | None = None
        project.names = self._names
        project.place = self._place_in_script

    # ---- scripts and lines ---------------------------------------------------------------------------------------

    def read(self, text: str, file: str) -> Source:
        """Read a script; ScriptError at its first wrong line."""
        return source.read(text, file, len(self.statements), dim=self._dim())

    def _dim(self) -> int:
        return int(getattr(self.project, "dim", 2))

    def run(self, script: Source, past: Sequence[list[Any]] = ()) -> None:
        """Run a script that was read last, to its end. ScriptError names the line of a command, HpcdemError that of the
        Python around it.

        past: the journal of a checkpoint that the project was restored from; the script is brought back to the command
        in which it was written, and resumes there. UsageError if that is not possible.
        """
        self.journal = Journal(self._warn_of_lost_journal)
        self.journal.keeps_calls = not (past and getattr(self.project, "calls_lost", False))
        if past:
            self.journal.replay(list(past))
        random.seed(SEED)
        np.random.seed(SEED)  # noqa: NPY002 - what scripts use
        self.namespace["__file__"] = script.file
        self.project.inputs[os.path.realpath(script.file)] = "the script that runs"
        self._execute(script, "exec")

    def load_laws(self, script: Source) -> None:
        """Read, check and compile the laws and functions that commands of a script name, before it runs or continues.
        ScriptError."""
        for statement in script.statements:
            given = statement.arguments
            functions = [v.name for v in given.get("properties", {}).values() if isinstance(v, FunctionName)]
            functions += [given["function"]] if "function" in given else []
            try:
                if "law" in given:
                    fdem.assignments.load_law(self.project, given["law"])
                for name in functions:
                    fdem.assignments.load_function(self.project, name)
            except CommandError as error:
                raise statement.error(str(error)) from None

    def line(self, script: Source) -> None:
        """Execute a typed line and show the value of an expression."""
        self._execute(script, "single")

    def lines(self, script: Source) -> None:
        """Execute several typed statements without showing their values."""
        self._execute(script, "exec")

    def include(self, text: str, file: str, names: dict[str, Any]) -> None:
        """Carry out a text from within a script or program, with variables of its own: those in `names`, which holds
        all of them afterwards. The log, checkpoints and --resume know it by the line of the script that called.

        file: as messages show it. ScriptError names the line of the text, and that of the script.
        """
        script = source.read(text, file, len(self.statements), dim=self._dim())
        for name, value in self._own_names.items():
            names.setdefault(name, value)
        around = self._included_at
        self._included_at = around if around is not None else self._caller()[1]
        try:
            self._execute(script, "exec", names)
        finally:
            self._included_at = around

    def _caller(self) -> tuple[str, int]:
        """File and line of the script that is being carried out; "the program", 0 in a Python program."""
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_code.co_filename not in self.sources:
            frame = frame.f_back
        return (frame.f_code.co_filename, frame.f_lineno) if frame is not None else ("the program", 0)

    def _execute(self, script: Source, mode: str, names: dict[str, Any] | None = None) -> None:
        assert script.first == len(self.statements)
        self.sources[script.file] = script
        self.statements += script.statements
        linecache.cache[script.file] = len(script.python), None, [line + "\n" for line in script.lines], script.file
        try:
            exec(compile(script.python, script.file, mode), self.namespace if names is None else names)
        except (SystemExit, KeyboardInterrupt, StoppedWithCheckpoint):
            raise
        except BaseException as error:
            if isinstance(error, HpcdemError) and not isinstance(error, CommandError):
                raise
            if not isinstance(error, (HpcdemError, RecursionError, MemoryError)) and self._in_a_command(error):
                raise  # not the script's fault: the whole traceback is reported
            raise self._explained(error, script) from None
        if self.journal is not None and self.journal.failure is not None:
            raise self.journal.failure

    def _explained(self, error: BaseException, script: Source) -> HpcdemError:
        """An error of Python: of an expression in a command with the line of it, any other with its traceback through
        the script.
        """
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename in self.sources]
        if frames:
            last = frames[-1]
            statement = self.sources[last.filename].statement_at(last.lineno or 0)
            calls = _calls([(f.filename, f.lineno or 0) for f in frames[:-1]])
            if isinstance(error, CommandError):
                text = self.sources[last.filename].line(last.lineno or 0)
                return ScriptError(last.filename, last.lineno or 0, f"{shown(text)}: {hyphened(str(error))}{calls}")
            if statement is not None:
                return statement.error(f"{type(error).__name__}: {error}{calls}")
            if isinstance(error, (RecursionError, MemoryError)):
                line = last.lineno or 0
                why = f"{type(error).__name__}: {error}".rstrip(": ")
                return HpcdemError(f"{last.filename}:{line}: {shown(script.line(line).strip())}: {why}{calls}")
        trace = error.__traceback__
        while trace is not None and trace.tb_frame.f_code.co_filename not in self.sources:
            trace = trace.tb_next
        text = "".join(traceback.format_exception(type(error), error, trace or error.__traceback__)).rstrip()
        return HpcdemError(f"{script.file} ended with an error\n{text}")

    def _in_a_command(self, error: BaseException) -> bool:
        """Did it happen while a command was carried out, not in the Python of the script, which the command may have
        called?"""
        trace, inside = error.__traceback__, False
        while trace is not None:
            code = trace.tb_frame.f_code
            inside = (inside or code is Interpreter._carry_out.__code__) and code.co_filename not in self.sources
            trace = trace.tb_next
        return inside

    def _refuse_after_stop(self) -> None:
        """The script has caught what ended the run: raise it again."""
        if (stop := self.project.blocks.stop) is not None:
            stop.refuse()

    # ---- one command ---------------------------------------------------------------------------------------------

    def _carry_out(self, index: int, *values: Any) -> None:
        """The function by which the Python text of a script executes a command."""
        self._refuse_after_stop()
        statement = self.statements[index]
        try:
            arguments, terms = statement.resolve(values)
        except ScriptError as error:
            self._agree(index, repr(error))
            raise self._with_calls(error) from None
        text = repr((arguments, terms))
        asked = self._agree(index, text)
        self.project.line = statement.line if self._included_at is None else self._included_at
        if self._passed_over(statement, arguments, text):
            return
        if asked and self.journal is not None:
            fdem.steps.stop_here(self.project, asked)
        try:
            carry_out(Call(self.project, statement.command, arguments, where(terms), self.restore_names))
        except HpcdemError as error:
            known = self._with_line(error, statement)
            if self.journal is not None:
                self.journal.note_error(known)
            if known is error:
                raise
            raise known from error

    def _with_line(self, error: HpcdemError, statement: Statement) -> HpcdemError:
        """An error of a command, with the line."""
        if isinstance(error, (CommandError, ScriptError)):
            return self._with_calls(error if isinstance(error, ScriptError) else statement.error(hyphened(str(error))))
        if isinstance(error, EquilibriumError):
            return EquilibriumError(str(self._with_calls(statement.error(str(error)))))
        if type(error) is HpcdemError:
            # A file that could not be written: the line is not wrong, the exit code is that of a run that failed.
            return HpcdemError(str(self._with_calls(statement.error(str(error)))))
        return error

    # ---- continuing from a checkpoint ------------------------------------------------------------------------------

    def _passed_over(self, statement: Statement, arguments: Mapping[str, Any], text: str) -> bool:
        """Record a command, or, during the replay of a script, skip it if it was executed before the checkpoint."""
        journal = self.journal
        if journal is None:
            return False
        checksum = zlib.crc32(f"{statement.command.name} {text}".encode("utf-8", "backslashreplace"))
        if not journal.replays:
            journal.note(COMMAND, checksum)
            return False
        try:
            if journal.meet(checksum):
                return False
            given = journal.names()
        except UsageError as error:
            raise self._diverged(error, f"{statement.file}:{statement.line}: {shown(statement.text)}") from None
        if given is not None:
            self._take_names(given, arguments["file"])
        note = PASSED_OVER.get(statement.command.name)
        if note is not None:
            note(self.project, arguments["file"])
        return True

    def _warn_of_lost_journal(self) -> None:
        if self.project.log is not None:
            self.project.log.warn_once(
                "journal",
                f"the script has read more than {MOST >> 20} MiB of values, so --resume no longer works beyond this "
                "point. Checkpoints can still be loaded with pcdc model restore",
            )

    @property
    def replays(self) -> bool:
        """True while the script is replayed up to a checkpoint."""
        return self.journal is not None and self.journal.replays

    @property
    def keeps(self) -> bool:
        """A journal is kept: --resume will run this script again."""
        return self.journal is not None and not self.journal.lost

    def query(self, make: Callable[[], Any], together: str = "") -> Any:
        """Answer a query of the script about the model. together: the query, if all ranks must make it at the same
        time."""
        journal = self.journal

        def ask() -> Any:
            if together and self.project.comm.size > 1:
                file, line = self._caller()
                self._agree(READ, f"{file}:{line}: {together}")
            return make()

        return ask() if journal is None else self._placed(lambda: journal.query(ask))

    def ask(
        self, key: tuple[Any, ...], make: Callable[[], Any], again: Callable[[], Any] | None = None,
        fails_again: bool = False,
    ) -> Any:  # fmt: skip
        """A method of particles with these arguments, see Journal.ask."""
        journal = self.journal
        if journal is None:
            return make()
        return self._placed(lambda: journal.ask(_checksum(key), make, again, fails_again))

    def ask_alone(self, key: tuple[Any, ...], make: Callable[[], Any], again: bool) -> Any:
        """Query particles of this rank only, see Journal.ask_alone."""
        journal, alone = self.journal, self.project.comm.size == 1
        if journal is None:
            return make()
        return self._placed(lambda: journal.ask_alone(_checksum(key), make, again, alone))

    def function(self, call: Callable[[], object]) -> Callable[[], object]:
        """Wrap a function so that the journal records what it does during a command."""
        journal = self.journal
        if journal is None or not journal.keeps_calls:
            return call
        journal.functions.append(call)
        return partial(journal.call, len(journal.functions) - 1)

    @property
    def keeps_calls(self) -> bool:
        """The journal knows the methods of particles that were called."""
        return self.journal is None or self.journal.keeps_calls

    def _placed(self, make: Callable[[], Any]) -> Any:
        """Return the result of `make`; if the script takes another branch there, raise with its line."""
        self._refuse_after_stop()
        try:
            return make()
        except UsageError as error:
            file, line = self._caller()
            raise self._diverged(error, f"{file}:{line}" if line else "the script") from None

    def _diverged(self, error: UsageError, place: str) -> UsageError:
        """The error with its line, the first time that it is met."""
        if (
            self.journal is not None
            and error is self.journal.failure
            and not str(error).startswith(tuple(self.sources))
        ):
            self.journal.failure = error = UsageError(f"{place}: {error}")
        return error

    def _place_in_script(self) -> dict[str, Any] | None:
        """The position in the script that a checkpoint stores, so that `run` can resume; None in a console."""
        if self.journal is None:
            return None
        source = next(iter(self.sources.values()))
        line = self.project.line
        return {
            "script": "\n".join(source.lines), "journal": None if self.journal.lost else self.journal.entries,
            "at": f"line {line}: {source.line(line)}",
        }  # fmt: skip

    def _agree(self, index: int, words: str) -> int:
        """Collective: all ranks are at this command, or READ, with these values, or all raise ScriptError. Returns what
        was requested from outside a while ago (runtime.stop_requests), the same on all ranks."""
        comm, stop = self.project.comm, self.project.blocks.stop
        asked = stop.overdue_request() if stop is not None else 0
        if comm.size == 1:
            return asked
        mark = (index << 32) | zlib.crc32(words.encode("utf-8", "backslashreplace"))
        found = comm.max_into(np.array([mark, -mark, asked], np.int64))
        if found[0] == -found[1]:
            return int(found[2])
        everyone = comm.allgather((index, words))
        other = next(rank for rank, one in enumerate(everyone) if one != everyone[0])
        if everyone[other][0] != everyone[0][0]:
            places = " and ".join(self._place(*everyone[rank]) for rank in (0, other))
            why = f"rank 0 and rank {other} are at different commands ({places})"
        else:
            shown = _difference(everyone[0][1], everyone[other][1])
            why = f"its values differ between rank 0 and rank {other}: {shown}"
        why += "; all ranks must execute the same commands with the same values"
        for at, text in everyone:
            if at == READ:
                place, _, question = text.partition(": ")
                raise ScriptError(place.rpartition(":")[0], int(place.rpartition(":")[2]), f"{question}: {why}")
        raise self.statements[min(i for i, _ in everyone)].error(why)

    def _place(self, index: int, text: str) -> str:
        if index == READ:
            return text.partition(": ")[0]
        if index >= len(self.statements):
            return "the end of the script"
        return f"{self.statements[index].file}:{self.statements[index].line}"

    def at_the_end(self) -> None:
        """Collective: the script is done on all ranks, or ScriptError on all of them."""
        if self.statements:
            self._agree(len(self.statements), "")

    def _with_calls(self, error: ScriptError) -> ScriptError:
        """The error with the calls that led to its line, if it is in a function."""
        places: list[tuple[str, int]] = []
        frame: FrameType | None = sys._getframe(1)
        while frame is not None:
            if frame.f_code.co_filename in self.sources:
                places.append((frame.f_code.co_filename, frame.f_lineno))
            frame = frame.f_back
        return ScriptError(error.file, error.line, error.message + _calls(places[:0:-1]))

    # ---- names ---------------------------------------------------------------------------------------------------

    def _names(self) -> dict[str, Any]:
        """The names of the script that a checkpoint stores."""
        found, left_out = names.collected(self.namespace, self.sources)
        for why in left_out:
            if self.project.log is not None:
                self.project.log.warn_once(why, why)
        return found

    def restore_names(self, given: Mapping[str, Any], file: str) -> None:
        """Put the variables and functions of a checkpoint into the namespace."""
        if self.journal is not None:
            self.journal.note(NAMES, dict(given))
        self._take_names(given, file)

    def _take_names(self, given: Mapping[str, Any], file: str) -> None:
        variables = names.restored_variables(given)
        functions = names.restored_functions(given)
        scripts: list[Source] = []
        first = len(self.statements)
        for name, text in functions.items():
            script = source.read(text, f"{file}:{name}", first, dim=None)
            first += len(script.statements)
            names.plain_def(name, script)
            scripts.append(script)
        for script in scripts:
            self._execute(script, "exec")
        self.namespace.update(variables)

    # ---- the log -------------------------------------------------------------------------------------------------

    def _print(self, *values: Any, file: Any = None, **how: Any) -> None:
        """Replace print of the script: only rank 0 prints."""
        if file is not None and file is not sys.stdout:
            print(*values, file=file, **how)
        elif self.project.comm.rank == 0 and not (self.journal is not None and self.journal.replays):
            text = io.StringIO()
            print(*values, **how, file=text)
            write(sys.stdout, text.getvalue())


def _checksum(key: tuple[Any, ...]) -> int:
    return zlib.crc32(described(key).encode("utf-8", "backslashreplace"))


def _calls(places: list[tuple[str, int]]) -> str:
    """`, called from lines 30, 44`: the outermost call last."""
    if not places:
        return ""
    numbers = [str(line) for _, line in reversed(places)]
    shown = numbers if len(numbers) <= 6 else [*numbers[:3], "...", *numbers[-2:]]
    return f" (called from line{'s' * (len(numbers) > 1)} {', '.join(shown)})"


def _difference(one: str, other: str) -> str:
    """The two texts from a little before the first place where they differ."""
    at = next((i for i, (a, b) in enumerate(zip(one, other)) if a != b), min(len(one), len(other)))
    first = max(at - 20, 0)
    return f"...{one[first : at + 30]}... and ...{other[first : at + 30]}..."
