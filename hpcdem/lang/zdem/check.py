"""``hpcdem --check script``: reports what a script would do, without running it.

Particle numbers, file sizes and times are estimates, meant for choosing a machine and a disk.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.core.outputs import OUTPUTS
from hpcdem.lang.zdem import plan
from hpcdem.lang.zdem.estimate import estimate, kind_of
from hpcdem.lang.zdem.execute import refuse_lost_files
from hpcdem.lang.zdem.parser import Script
from hpcdem.lang.zdem.plan import Run
from hpcdem.lang.zdem.rules import recorded
from hpcdem.lang.zdem.statement import Statement, find
from hpcdem.runtime import launch, speed
from hpcdem.runtime.progress import rate


@dataclass(frozen=True)
class Outputs:
    """Files of one kind: how many (pairs of files count once), and how many bytes together; None where unknown. rough:
    there may be a few more, as it is unknown at which step a CYC starts."""

    files: int | None
    size: int | None
    rough: bool


@dataclass(frozen=True)
class Report:
    """Facts known before the run; None stands for unknown.

    runs: the CYC and IMPLE commands; made: particles that each statement makes, by index; rough: indices of `made` that
    are estimates; particles: most at once; work: particle-steps; certain: neither is an estimate; folder: of the
    results; outputs: files at intervals, by kind; named: (name, what it is) of all other files; rate: particle-steps/s
    per core, `measured` here or assumed; unexecuted: (line, words) that would be refused; notes: what else the reader
    should know.
    """

    script: Script
    runs: tuple[Run, ...]
    steps: int | None
    made: Mapping[int, int | None]
    rough: frozenset[int]
    particles: int | None
    work: int | None
    certain: bool
    folder: str
    outputs: Mapping[str, Outputs]
    named: tuple[tuple[str, str], ...]
    rate: float
    measured: bool
    unexecuted: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]

    def seconds(self, cores: int) -> float | None:
        """Time that the steps would take on so many cores [s], if the strips share the work evenly."""
        return None if self.work is None else self.work / (self.rate * cores)


def examine(script: Script, outdir: Path | None = None) -> Report:
    """Look through a script; reads the file that LOAD or RESTORE names, if it is there, and the rate of the last run.

    outdir: folder of the results, if the script does not name one.
    """
    statements = script.statements
    restored = _restored(script)
    runs = tuple(plan.follow(statements, **(restored["plan"] if restored else {})))
    guess = estimate(statements, script.directory, restored["particles"] if restored else None)
    per_core, measured = speed.recall(kind_of(statements))
    return Report(
        script=script,
        runs=runs,
        steps=_sum(run.steps for run in runs),
        made=guess.made,
        rough=frozenset(guess.rough),
        particles=guess.most,
        work=_sum(_product(run.steps, guess.before[run.index]) for run in runs),
        certain=guess.certain,
        folder=_folder(statements, outdir),
        outputs={kind: _outputs(kind, runs, guess.before) for kind in OUTPUTS},
        named=tuple(_named(statements, runs, outdir)),
        rate=per_core,
        measured=measured,
        unexecuted=tuple((s.line, word) for s in statements for word in s.unexecuted),
        notes=tuple(_notes(script, runs, restored is not None, outdir)),
    )


def _restored(script: Script) -> dict[str, Any] | None:
    """Read the part of the file of RESTORE that is known before a run, if it exists and is complete: "plan": time step
    and walls, "particles"."""
    for statement in script.statements[:2]:
        path = find(script.directory, statement.get("file")) if statement.command == "RESTORE" else None
        if path is None:
            continue
        from hpcdem.io import checkpoint

        try:
            state, tables = checkpoint.read(path)
            walls = dict(zip(state["walls"]["id"], map(tuple, state["walls"]["v"])))
            return {"plan": {"dt": state["settings"]["dt"] or None, "walls": walls}, "particles": tables["particles"]}
        except (HpcdemError, KeyError, TypeError):
            return None  # told when the script is run
    return None


# ---- output files --------------------------------------------------------------------------------------------------


def _outputs(kind: str, runs: Sequence[Run], populations: Mapping[int, int | None]) -> Outputs:
    files = [run.files(kind) for run in runs]
    sizes = [_product(n, populations[run.index]) for n, run in zip(files, runs)]
    return Outputs(_sum(files), _product(_sum(sizes), OUTPUTS[kind].size), any(run.rough(kind) for run in runs))


def _named(statements: Sequence[Statement], runs: Sequence[Run], outdir: Path | None) -> list[tuple[str, str]]:
    """Files that are written once, or grow."""
    found = []
    for s in statements:
        if s.command in ("EXP", "SAV"):
            found.append((s.get("file"), f"line {s.line}: {'particles' if s.command == 'EXP' else 'restart file'}"))
    data = _folder(statements, outdir)
    if runs:
        found.append((f"{data}/walls.csv", "forces on the walls, a row each per stepbar"))
        found.append((f"{data}/all_<last step>.jpg", "picture of the last frame"))
    for s in statements:
        if s.command == "HIST":
            for name in (f"hist_id_{s.get('id')}.dat", f"hist_{s.get('id')}.csv"):
                found.append((f"{data}/{name}", f"line {s.line}: {recorded(s)}"))
        elif s.command == "SET" and s.get("energy", 0) > 0:
            found.append((f"{data}/energy.csv", f"line {s.line}: the energy budget"))
        elif s.command == "PLOT":
            for kind in ("txt", "png"):
                name = f"{data}/hist_{s.get('y')}_vs_{s.get('x')}.{kind}"
                found.append((name, f"line {s.line}: history against history"))
    return found


def _folder(statements: Sequence[Statement], outdir: Path | None = None) -> str:
    """The folder of the results, as the user would write it."""
    named = next((s.get("outdir") for s in reversed(statements) if s.get("outdir")), None)
    return str(named or outdir or "data")


# ---- words ---------------------------------------------------------------------------------------------------------


def _notes(script: Script, runs: Sequence[Run], restored: bool, outdir: Path | None) -> list[str]:
    notes = [f"line {s.line}: {warning}" for s in script.statements for warning in s.warnings]
    for index, statement in enumerate(script.statements):
        reads = statement.command == "CLUMP" or (index < 2 and statement.command in ("RESTORE", "LOAD"))
        if not reads or statement.get("file") is None:
            continue
        if find(script.directory, statement.get("file")) is None:
            notes.append(
                f"line {statement.line}: file {statement.get('file')} not found in the folder of the script or in data"
            )
        elif statement.command == "RESTORE" and not restored:
            notes.append(f"line {statement.line}: {statement.get('file')} cannot be read")
    try:
        refuse_lost_files(script, outdir)
    except ScriptError as error:
        notes.append(f"line {error.line}: {error.message}; the script would be rejected")
    if any(run.steps is None for run in runs):
        notes.append("the script must contain SET DT and the velocity of the wall to estimate the steps of IMPLE")
    if script.statements[-1].command != "STOP":
        notes.append("no STOP found; the script ends with its last line")
    return notes


def summary(script: Script, outdir: Path | None = None) -> str:
    """The report of a script as text."""
    from rich.console import Console

    # Wide enough for any line: tables must not be cut when the text goes to a file.
    console = Console(file=io.StringIO(), width=120, force_terminal=False, color_system=None)
    print_report(examine(script, outdir), console)
    return console.file.getvalue().rstrip("\n")  # type: ignore[attr-defined]


def print_report(report: Report, console: Any = None) -> None:
    """Print a report on a rich console (default: standard output)."""
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = console if console is not None else Console(highlight=False)
    steps = {run.index: run.steps for run in report.runs}
    commands = Table("line", "command", "steps", "particles made", box=SIMPLE, title=escape(report.script.file))
    for column in (0, 2, 3):
        commands.columns[column].justify = "right"
    for index, statement in enumerate(report.script.statements):
        commands.add_row(
            str(statement.line),
            escape(statement.text),
            _count(steps[index]) if index in steps else "",
            _estimated(report.made[index], index not in report.rough) if index in report.made else "",
        )
    console.print(commands)
    totals = Table(box=SIMPLE, show_header=False)
    totals.add_row("steps", _count(report.steps))
    totals.add_row("particles, most at once", _estimated(report.particles, report.certain))
    totals.add_row("particle-steps", _estimated(report.work, report.certain))
    totals.add_row("time", escape(_time(report)))
    console.print(totals)
    files = Table("files", "number", "size", box=SIMPLE)
    for kind, outputs in report.outputs.items():
        if outputs.files != 0 or outputs.rough:
            about = "about " if outputs.rough and outputs.files is not None else ""
            size = f"about {_size(outputs.size)}" if outputs.size else ""
            for name in OUTPUTS[kind].files:
                files.add_row(escape(f"{report.folder}/{name}"), f"{about}{_count(outputs.files)}", size)
                size = "(both)" if size else ""
    for name, what in report.named:
        files.add_row(escape(name), "1", escape(what))
    if files.row_count:
        console.print(files)
    for note in report.notes:
        console.print(escape(f"note: {note}"))
    for line, word in report.unexecuted:
        console.print(escape(f"line {line}: {word} is not supported yet; the script would be rejected"))


def _time(report: Report) -> str:
    """``about 2 min on 2 cores, 4 min on 1 (at 11M particle-steps/s per core, as measured in the last run here)``."""
    cores = launch.cores()
    one, all_of_them = report.seconds(1), report.seconds(cores)
    if one is None or all_of_them is None:
        return "unknown"
    text = f"about {_spoken(one)} on 1 core" if cores == 1 else (
        f"about {_spoken(all_of_them)} on {cores} cores, {_spoken(one)} on 1"
    )  # fmt: skip
    source = "measured in the last run here" if report.measured else "assumed, as no run was measured here yet"
    return f"{text} (at {rate(report.rate)} particle-steps/s per core, {source})"


def _spoken(seconds: float) -> str:
    """Format a time with two digits at most: ``under 1 s``, ``46 s``, ``2.5 min``, ``14 h``, ``3 days``."""
    for unit, size, upto in (("s", 1.0, 100.0), ("min", 60.0, 100.0), ("h", 3600.0, 48.0), ("days", 86400.0, 1e5)):
        if seconds < upto * size:
            number = seconds / size
            return "under 1 s" if unit == "s" and number < 1.0 else f"{number:.2g} {unit}"
    return "centuries"


def _count(n: int | None) -> str:
    return "unknown" if n is None else f"{n:,}".replace(",", " ")


def _estimated(n: int | None, certain: bool) -> str:
    if n is None or certain or n == 0:
        return _count(n)
    digits = 10 ** max(len(str(n)) - 3, 0)
    return f"about {_count(round(n / digits) * digits)}"


def _size(n: int) -> str:
    power = min((len(str(n)) - 1) // 3, 4)
    return f"{n / 1000**power:.3g} {('B', 'kB', 'MB', 'GB', 'TB')[power]}"


# ---- arithmetic in which None is unknown ---------------------------------------------------------------------------


def _sum(numbers: Iterable[int | None]) -> int | None:
    total = 0
    for n in numbers:
        if n is None:
            return None
        total += n
    return total


def _product(a: int | None, b: int | None) -> int | None:
    return 0 if a == 0 or b == 0 else None if a is None or b is None else a * b
