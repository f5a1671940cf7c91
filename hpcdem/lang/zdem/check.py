"""``hpcdem --check script``: what a script would do, told without doing it.

Particle numbers and file sizes are estimates made from the script alone, meant for choosing a machine and a disk.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hpcdem.lang.zdem import plan
from hpcdem.lang.zdem.execute import find
from hpcdem.lang.zdem.parser import Script
from hpcdem.lang.zdem.plan import Run
from hpcdem.lang.zdem.statement import Statement
from hpcdem.selection import has_expressions

JAMMED = 0.547
"""Share of the area that random insertion without overlap can cover (jamming of random sequential adsorption of disks;
Feder 1980, J. Theor. Biol. 87, 237)."""

BYTES_PER_PARTICLE: Mapping[str, int] = {"print": 2300, "ps": 40, "vtk": 190, "save": 260}
"""Size of one output per particle, measured on a settled and bonded bed of 1255 particles (about 2.5 contacts each);
"print" is the .dat and the .vtkhdf together."""

LABELS = {
    "print": "frames (.dat and .vtkhdf)",
    "ps": "pictures (.ps)",
    "vtk": ".vtk files",
    "save": "restart files (.sav)",
}


@dataclass(frozen=True)
class Outputs:
    """Files of one kind: how many, and how many bytes together; None where unknown."""

    files: int | None
    size: int | None


@dataclass(frozen=True)
class Report:
    """What can be said beforehand; None stands for unknown.

    runs: the CYC and IMPLE commands; made: particles that each statement makes at most, by index; particles: most that
    can be there at once, deletions not counted; work: particle-steps at most; unexecuted: (line, words) that would be
    refused; notes: what else the reader should know.
    """

    script: Script
    runs: tuple[Run, ...]
    steps: int | None
    made: Mapping[int, int | None]
    particles: int | None
    work: int | None
    outputs: Mapping[str, Outputs]
    unexecuted: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]


def examine(script: Script) -> Report:
    """Look through a script; reads the file that LOAD names, if it is there, and nothing else."""
    statements = script.statements
    runs = tuple(plan.follow(statements))
    made = {index: n for index, s in enumerate(statements) if (n := _made(s, script.directory)) != 0}
    populations = [_sum(n for index, n in made.items() if index < run.index) for run in runs]
    return Report(
        script=script,
        runs=runs,
        steps=_sum(run.steps for run in runs),
        made=made,
        particles=_sum(made.values()),
        work=_sum(_product(run.steps, n) for run, n in zip(runs, populations)),
        outputs={kind: _outputs(kind, statements, runs, populations) for kind in plan.OUTPUTS},
        unexecuted=tuple((s.line, word) for s in statements for word in s.unexecuted),
        notes=tuple(_notes(script, runs)),
    )


# ---- particles -----------------------------------------------------------------------------------------------------


def _made(statement: Statement, directory: Path) -> int | None:
    """Particles that a statement makes at most."""
    match statement.command:
        case "RESTORE":
            return None
        case "LOAD":
            return _rows(find(directory, statement.get("file")))
        case "BALL":
            return 1
        case "GLINE":
            (x1, y1), (x2, y2) = statement.get("p1"), statement.get("p2")
            spacing = 2.0 * statement.get("rad") * statement.get("cratio", 1.0)
            return _whole(_over(math.hypot(x2 - x1, y2 - y1), spacing) + 1e-9, 1)
        case "GEN":
            return _generated(statement)
    return 0


def _generated(statement: Statement) -> int | None:
    if has_expressions((statement.get("x"), statement.get("y"))):
        return statement.get("num")
    (x1, x2), (y1, y2) = statement.get("x"), statement.get("y")
    radii = statement.get("rad")
    if "grid" in statement.arguments:
        side = 2.0 * max(radii)
        columns, rows = _whole(_over(x2 - x1, side) + 1e-9), _whole(_over(y2 - y1, side) + 1e-9)
        return _product(columns, rows)
    disk = math.pi * sum(r * r for r in radii) / len(radii)
    fits = _whole(_over(JAMMED * (x2 - x1) * (y2 - y1), disk), 1)
    return statement.get("num") if fits is None else min(statement.get("num"), fits)


def _rows(path: str | None) -> int | None:
    if path is None:
        return None
    try:
        with open(path, "rb") as file:
            return sum(1 for line in file if line.strip())
    except OSError:
        return None


# ---- output files --------------------------------------------------------------------------------------------------


def _outputs(
    kind: str, statements: Sequence[Statement], runs: Sequence[Run], populations: Sequence[int | None]
) -> Outputs:
    files = [_files(kind, run, statements[run.index].command) for run in runs]
    size = _sum(_product(_product(n, here), BYTES_PER_PARTICLE[kind]) for n, here in zip(files, populations))
    named = sum(s.command == "SAV" for s in statements) if kind == "save" else 0
    return Outputs(_sum([*files, named]), size)


def _files(kind: str, run: Run, command: str) -> int | None:
    """Files of one kind that a CYC or IMPLE writes; frames with the one at its start and, for IMPLE, at its end."""
    every, steps = run.every[kind], run.steps
    extra = 1 if kind == "print" else 0
    if every == 0:
        last = 1 if kind == "print" and command == "IMPLE" else 0
        return extra + last
    if every is None or steps is None:
        return None
    if command == "IMPLE":
        last = 1 if kind == "print" and steps % every else 0
        return extra + steps // every + last
    # CYC counts from step 0; after RESTORE the start may be unknown, then this is right to one file.
    start = run.start or 0
    return extra + (start + steps) // every - start // every


# ---- words ---------------------------------------------------------------------------------------------------------


def _notes(script: Script, runs: Sequence[Run]) -> list[str]:
    notes = []
    first = script.statements[0]
    if first.command == "RESTORE":
        notes.append("particles, walls and settings of the restart file are not looked at")
    for statement in script.statements[:2]:
        name = statement.get("file")
        if statement.command in ("RESTORE", "LOAD") and find(script.directory, name) is None:
            notes.append(f"line {statement.line}: there is no file {name} beside the script, nor in data")
    if any(run.steps is None for run in runs):
        notes.append("steps of IMPLE are known when both SET DT and the velocity of the wall stand in the script")
    if any(s.command == "DEL" for s in script.statements):
        notes.append("particles are counted without the deletions of DEL")
    if script.statements[-1].command != "STOP":
        notes.append("there is no STOP; the script ends with its last line")
    return notes


def summary(script: Script) -> str:
    """The report of a script as text."""
    from rich.console import Console

    # Wide enough for any line: tables must not be cut when the text goes to a file.
    console = Console(file=io.StringIO(), width=120, force_terminal=False, color_system=None)
    print_report(examine(script), console)
    return console.file.getvalue().rstrip("\n")  # type: ignore[attr-defined]


def print_report(report: Report, console=None) -> None:
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
            _at_most(report.made[index]) if index in report.made else "",
        )
    console.print(commands)
    totals = Table(box=SIMPLE, show_header=False)
    totals.add_row("steps", _count(report.steps))
    totals.add_row("particles", _at_most(report.particles))
    totals.add_row("particle-steps", _at_most(report.work))
    for kind, outputs in report.outputs.items():
        size = f", about {_size(outputs.size)}" if outputs.size else ""
        totals.add_row(LABELS[kind], _count(outputs.files) + size)
    console.print(totals)
    for note in report.notes:
        console.print(escape(f"note: {note}"))
    for line, word in report.unexecuted:
        console.print(escape(f"line {line}: {word} is not carried out yet; the script would be refused"))


def _count(n: int | None) -> str:
    return "unknown" if n is None else f"{n:,}".replace(",", " ")


def _at_most(n: int | None) -> str:
    return "unknown" if n is None else f"at most {_count(n)}"


def _size(n: int) -> str:
    power = min((len(str(n)) - 1) // 3, 4)
    return f"{n / 1000**power:.3g} {('B', 'kB', 'MB', 'GB', 'TB')[power]}"


# ---- arithmetic in which None is unknown ---------------------------------------------------------------------------


def _sum(numbers) -> int | None:
    total = 0
    for n in numbers:
        if n is None:
            return None
        total += n
    return total


def _product(a: int | None, b: int | None) -> int | None:
    return 0 if a == 0 or b == 0 else None if a is None or b is None else a * b


def _over(a: float, b: float) -> float:
    return a / b if b > 0.0 else math.inf


def _whole(value: float, more: int = 0) -> int | None:
    """Rounded down, plus `more`; None if it is beyond all sense."""
    return math.floor(value) + more if value < 1e15 else None
