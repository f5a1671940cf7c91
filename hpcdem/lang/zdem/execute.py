"""Carries out a script: hands every statement to a function of `hpcdem.commands`.

The commands ignore lines and files; an error of theirs leaves here with the file and line of the statement.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hpcdem.commands import dem, units
from hpcdem.core.errors import CommandError, HpcdemError, ScriptError, UsageError
from hpcdem.core.selection import Selection, has_expressions, number
from hpcdem.lang.zdem.parser import Script, parse_text
from hpcdem.lang.zdem.rules import BOND_KEYS, BOND_MODEL_1, BOND_MODEL_2, recorded
from hpcdem.lang.zdem.statement import Statement, find
from hpcdem.lang.zdem.table import ZDEM


def refuse_unexecuted(statements: Sequence[Statement]) -> None:
    """ScriptError at the first line that requests something the solver does not support, before anything runs."""
    for statement in statements:
        if statement.unexecuted:
            raise ScriptError(
                statement.file, statement.line, f"hpcdem does not support {', '.join(statement.unexecuted)} yet"
            )


def report_warnings(script: Script, sim: Any) -> None:
    """Log the places where the parser read something other than written."""
    if getattr(sim, "log", None) is not None:
        for statement in script.statements:
            for warning in statement.warnings:
                sim.log.warn(f"{statement.file}:{statement.line}: {warning}")


def refuse_lost_files(script: Script, outdir: Path | None = None) -> None:
    """ScriptError at the first EXP or SAV that could not write its file, or would write it over the script or a file
    that the script reads, long before the run comes to it; looks at the disk.

    outdir: folder of the results where the script does not name one; it and what lies in it need not exist yet.
    """
    results = [script.directory, script.directory / "data" if outdir is None else outdir]
    read = _files_read(script)
    for statement in script.statements:
        if statement.get("outdir"):
            folder = script.directory / statement.get("outdir")
            results.append(folder)
            if folder.exists() and not folder.is_dir():
                raise statement.error(f"outdir {statement.get('outdir')} is not a folder")
        if statement.command not in ("EXP", "SAV"):
            continue
        path = script.directory / statement.get("file")
        if path.is_dir():
            raise statement.error(f"{statement.get('file')} is a folder, expected a file name")
        if os.path.realpath(path) in read:
            what = read[os.path.realpath(path)]
            raise statement.error(f"{statement.get('file')} would overwrite {what}; choose another name")
        if not path.parent.is_dir() and os.path.normpath(path.parent) not in map(os.path.normpath, results):
            raise statement.error(f"folder {path.parent} for {path.name} not found; create it first")


def _files_read(script: Script) -> dict[str, str]:
    """The script, and files that its statements read unless an earlier one has written them: by their real paths, in
    words."""
    read, written = {os.path.realpath(script.file): "the script that runs"}, set()
    for statement in script.statements:
        name = statement.get("file")
        if not name:
            continue
        if statement.command in ("EXP", "SAV"):
            written.add(os.path.realpath(script.directory / name))
            continue
        path = find(script.directory, name)
        if path is not None and os.path.realpath(path) not in written:
            read.setdefault(os.path.realpath(path), f"the file that line {statement.line} reads")
    return read


def refuse_escapes(script: Script, folder: Path) -> None:
    """ScriptError at the first file name that leads out of the folder of the script and that of the results. For
    scripts that came with a checkpoint: whoever continues with a run of others did not write them."""
    allowed = [path.resolve() for path in (script.directory, folder)]
    for statement in script.statements:
        if statement.get("law"):
            raise statement.error(
                "user laws are never executed from a checkpoint; give the script: hpcdem SCRIPT --resume"
            )
        for word in ("file", "outdir", "legend"):
            name = statement.get(word)
            if name and not any((script.directory / name).resolve().is_relative_to(root) for root in allowed):
                raise statement.error(
                    f"{name} is outside {script.directory}; a script from a checkpoint cannot access it. Give the "
                    "script: hpcdem SCRIPT --resume"
                )


class Interpreter:
    """Runs a script on a simulation.

    `sim` is handed to the commands. What a checkpoint and the log must know is set here: ``sim.script`` (the text),
    ``sim.position`` (index of the statement being carried out) and ``sim.line`` (its line). Asked are only
    ``sim.extents()`` and, where there are ranks, ``sim.comm``.
    """

    def __init__(self, script: Script) -> None:
        self.script = script

    def run(self, sim: Any, start_at: int = 0, resume: int | None = None, saved_script: str = "") -> None:
        """Carry out the statements from index `start_at` to the end, or continue after a checkpoint.

        resume: ``position`` of the checkpoint that `sim` was restored from. A CYC or IMPLE at that place is taken
        up where it was interrupted; anything else there was done before the checkpoint was written.
        saved_script: text of the script that wrote it; UsageError if the two differ in what was done so far.
        """
        refuse_unexecuted(self.script.statements)
        self.refuse_lost_files(sim)
        self.load_laws(sim)
        report_warnings(self.script, sim)
        sim.script = self.script.text
        if resume is not None:
            if saved_script:
                check_same_beginning(self.script, saved_script, resume)
            self._take_up(sim, resume)
            start_at = resume + 1
        for index in range(start_at, len(self.script.statements)):
            self.carry_out(sim, index)
        if self.script.statements[-1].command != "STOP":
            dem.cycles.stop(sim)

    def load_laws(self, sim: Any) -> None:
        """Read, check and compile the user laws that lines name, before the first one is carried out."""
        for statement in self.script.statements:
            law = statement.get("law")
            if law and law != dem.properties.LINEAR:
                self._guarded(statement, partial(dem.properties.load_law, sim, law, self.script.directory))

    def refuse_lost_files(self, sim: Any) -> None:
        """The function of this name; rank 0 looks, so that all ranks agree."""
        comm, error = getattr(sim, "comm", None), None
        if comm is None or comm.rank == 0:
            try:
                refuse_lost_files(self.script, getattr(sim, "outdir", None))
            except ScriptError as found:
                error = found.file, found.line, found.message
        error = comm.bcast(error) if comm is not None else error
        if error is not None:
            raise ScriptError(*error)

    def _take_up(self, sim: Any, index: int) -> None:
        if not 0 <= index < len(self.script.statements):
            raise UsageError(
                f"the checkpoint was written at statement {index + 1} of its script, {self.script.file} has only "
                f"{len(self.script.statements)}; it is a different script"
            )
        statement = self.script.statements[index]
        sim.position, sim.line = index, statement.line
        if statement.command in ("CYC", "IMPLE"):
            self._guarded(statement, lambda: dem.cycles.resume(sim))

    def carry_out(self, sim: Any, index: int) -> None:
        statement = self.script.statements[index]
        sim.position, sim.line = index, statement.line
        self._guarded(statement, lambda: self._command(_Call(self, sim, statement)))

    @staticmethod
    def _command(call: _Call) -> None:
        if call.row.does:
            _by_name(call, call.row.does)
        else:
            _CONVERTERS[call.statement.command](call)
        check_units(call.sim, call.statement.command, call.arguments)

    @staticmethod
    def _guarded(statement: Statement, work: Callable[[], object]) -> None:
        try:
            work()
        except CommandError as error:
            raise statement.error(str(error)) from error
        except HpcdemError as error:
            if type(error) is not HpcdemError:
                raise
            # A file that could not be written: the line is not wrong, the exit code is that of a run that failed.
            raise HpcdemError(str(statement.error(str(error)))) from error


def check_units(sim: Any, command: str, given: Mapping[str, Any]) -> None:
    """Warn of arguments of a command of the table that are unlikely in the units declared."""
    row = ZDEM.command(command.lower())
    settings = getattr(sim, "settings", None)
    if row is not None and settings is not None and settings.units:
        of = {option.key: option.unit for option in (*row.leading, *row.options) if option.unit}
        units.check(settings.units, sim.log, ((name, of[name], given[name]) for name in of if name in given))


def check_same_beginning(script: Script, saved_text: str, position: int) -> None:
    """UsageError unless the script that wrote a checkpoint says the same as `script` up to index `position`; comments
    and blanks do not count, and what comes after may have been changed."""
    saved = parse_text(saved_text, f"{script.file} (as it was when the checkpoint was written)").statements
    for index, statement in enumerate(script.statements[: position + 1]):
        before = saved[index] if index < len(saved) else None
        if before is None or before.same_as(statement):
            continue
        raise UsageError(
            f"{script.file}:{statement.line}: '{statement.text}' was '{before.text}' when the checkpoint was written; "
            "executed lines must not be changed"
        )


class _Call:
    """Arguments of one statement for its command: arguments with expressions resolved and complete file names."""

    def __init__(self, interpreter: Interpreter, sim: Any, statement: Statement) -> None:
        self.sim, self.statement = sim, statement
        self.row = next(row for row in ZDEM.commands if row.name == statement.command)
        self.directory = interpreter.script.directory
        self.arguments = dict(statement.arguments)
        self.where: Selection | None = statement.selection
        if has_expressions(self.where) or has_expressions(tuple(self.arguments.values())):
            self._resolve(sim.extents())

    def _resolve(self, extents: dict[str, float]) -> None:
        if self.where is not None:
            self.where = self.where.resolve(extents)
        for name, value in self.arguments.items():
            if has_expressions(value):
                self.arguments[name] = tuple(number(bound, extents) for bound in value)

    def given(self, *names: str) -> dict[str, Any]:
        """Return those of these arguments that the line contains, as keyword arguments; all if no name is given."""
        return {name: value for name, value in self.arguments.items() if not names or name in names}

    def path(self) -> str:
        """The file of the line, beside the script unless it has a folder of its own from the root."""
        return str(self.directory / self.arguments["file"])

    def existing(self, word: str = "file") -> str:
        """Find a file to read: next to the script, then in ./data below it. Rank 0 searches, so that all ranks
        agree.
        """
        comm = getattr(self.sim, "comm", None)
        found = find(self.directory, self.arguments[word]) if comm is None or comm.rank == 0 else None
        found = comm.bcast(found) if comm is not None else found
        if found is None:
            name = self.arguments[word]
            raise CommandError(f"there is no file {self.directory / name}, nor {self.directory / 'data' / name}")
        return found


# ---- commands --------------------------------------------------------------------------------------------------------


def _by_name(call: _Call, does: str) -> None:
    """Call the function that the row of the table names, with the arguments of the line under their names."""
    given = call.given()
    if "file" in given:
        given["file"] = call.path() if call.statement.command in ("EXP", "SAV") else call.existing()
    if "legend" in given:
        given["legend"] = call.existing("legend")
    if call.row.ranged:
        given["where"] = call.where
    module, _, name = does.partition(".")
    getattr(getattr(dem, module), name)(call.sim, **given)


def _gen(call: _Call) -> None:
    grid = call.arguments.pop("grid", False)
    _by_name(call, "particles.gen_grid" if grid else "particles.gen")


def _clump(call: _Call) -> None:
    if "file" in call.arguments:
        dem.clumps.clump(call.sim, call.existing(), **call.given("x", "y", "angle", "scale", "color", "group"))
    else:
        dem.clumps.join(call.sim, call.where, **call.given())


def _flexure(call: _Call) -> None:
    given = call.given()
    wall = given.pop("wall", (None,))[0]
    dem.flexure.flexure(call.sim, wall, call.where, **given)


def _prop(call: _Call) -> None:
    properties = {name: value for name, value in call.given().items() if name not in BOND_KEYS}
    if call.given(*BOND_MODEL_1, *BOND_MODEL_2):
        # Bonds are made with the new properties, but before the particles leave the group that RANGE may name.
        group = {"group": properties.pop("group")} if "group" in properties else {}
        if properties:
            _set_properties(call, properties)
        dem.bonds.bond(call.sim, call.where, **call.given(*BOND_KEYS))
        properties = group
    if properties:
        _set_properties(call, properties)


def _set_properties(call: _Call, properties: dict[str, Any]) -> None:
    """User laws lie beside the script."""
    if "law" in properties:
        properties = {**properties, "folder": call.directory}
    dem.properties.prop(call.sim, call.where, **properties)


def _set(call: _Call) -> None:
    for name, value in call.arguments.items():
        if name == "damp":
            name = "lsm"
        elif name == "outdir":
            value = str(call.directory / value)
        dem.settings.set_option(call.sim, name, value)


def _imple(call: _Call) -> None:
    arguments = call.given()
    dem.cycles.imple(call.sim, arguments.pop("id"), **arguments)


def _draw(call: _Call) -> None:
    words = {name: on for name, on in call.arguments.items() if name != "interval"}
    what, off = ([name for name, on in words.items() if on is wanted] for wanted in (True, False))
    dem.history.draw(call.sim, call.arguments.get("interval"), what, off)


def _log(call: _Call, text: str) -> None:
    """A line in the log for a command without effect."""
    if getattr(call.sim, "log", None) is not None:
        call.sim.log.info(f"line {call.sim.line}: {call.statement.command}: {text}")


_CONVERTERS: dict[str, Callable[[_Call], None]] = {
    "GEN": _gen,
    "CLUMP": _clump,
    "FLEXURE": _flexure,
    "PROP": _prop,
    "FIX": lambda call: dem.properties.fix(call.sim, tuple(call.arguments), where=call.where),
    "FREE": lambda call: dem.properties.free(call.sim, tuple(call.arguments), where=call.where),
    "SET": _set,
    "IMPLE": _imple,
    "HIST": lambda call: dem.history.hist(call.sim, **call.given("id", "interval"), what=recorded(call.statement)),
    "DRAW": _draw,
    "LOG": lambda call: _log(call, "the log goes to standard output: the command has no effect"),
    "PAUSE": lambda call: _log(call, "runs are not interactive, so it has no effect"),
}
"""Converters of commands whose row names no function."""
