"""Output during a run: plain lines in a log file, a bar on a terminal, a table at the end.

Only rank 0 prints; on all other ranks the same calls do nothing, so callers never ask for the rank. What only
another rank knows has to be brought to rank 0 first.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shlex
import shutil
import sys
import textwrap
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from hpcdem.core import chinese
from hpcdem.core.timers import Summary, Timers
from hpcdem.core.units import counted, in_one_unit, with_prefix
from hpcdem.io.run_record import PROGRESS
from hpcdem.runtime.notebook import NotebookBar, in_notebook

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm


QUIET_SECONDS = 10.0
"""A log file gets at most one progress line in this time, unless the script sets the interval itself."""
FOLDED_AFTER = 3
"""Number of warnings differing only in numbers that are written individually."""
_NUMBERS = re.compile(r"(?<![A-Za-z_])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
NOTE_SECONDS = 1.0
"""Time between two notes in the folder of the results, and before the first one."""


@dataclass(frozen=True)
class StepStatus:
    """The model at one step, global values, SI units.

    unbalanced_ratio: largest unbalanced force of a particle over the mean contact force. broken_tension and
    broken_shear count bonds since the start of the script. walls: (id, fx, fy), the force of the particles on each
    wall. units: those that the model declared (core.units.SYSTEMS), "" none.
    """

    step: int
    time: float
    dt: float
    dt_critical: float
    kinetic: float
    unbalanced_ratio: float
    particles: int
    contacts: int
    bonds: int
    broken_tension: int = 0
    broken_shear: int = 0
    walls: Sequence[tuple[int, float, float]] = field(default_factory=tuple)
    units: str = ""


def duration(seconds: float) -> str:
    """``1:02:03``, ``2:03`` or ``2 s``; ``--`` for what is not known."""
    if not 0.0 <= seconds < 1e8:
        return "--"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, s = divmod(whole, 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"


def rate(number: float) -> str:
    """A number per second with three digits: ``812``, ``20400``, ``48.2 million``."""
    if number >= 1e5:
        size, word = (1e9, "billion") if number >= 0.9995e9 else (1e6, "million")
        return f"{number / size:.3g} {word}"
    return f"{float(f'{number:.3g}'):.10g}"


def folded(text: str, width: int) -> str:
    """Lines that are too long for a terminal, broken between words; tables and paths stay as they are."""
    lines = []
    for line in text.split("\n"):
        if len(line) < width or not line.strip():
            lines.append(line)
        else:
            lines += textwrap.wrap(
                line, max(width - 1, 20), subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
            )
    return "\n".join(lines)


@dataclass
class Command:
    """A running CYC or IMPLE: name, script line, steps to do (0: not known), the step at which it began here, and how
    many steps of it an earlier run did. beside: others tell of its beginning and end."""

    name: str
    line: int
    steps: int
    first_step: int | None = None
    before: int = 0
    beside: bool = False


_missing: dict[int, int] = {}
"""Lines that found no room, by the descriptor of their stream."""


def write(stream: TextIO, text: str) -> None:
    """Text on a stream, in one piece, as launchers pass on pieces. The run matters more than a closed pipe, a lost
    terminal or a full disk under the log: lines that do not fit are counted, and the count is reported when there is
    space again."""
    try:
        missing = _missing and _missing.get(stream.fileno(), 0)
        if missing:
            stream.write(f"warning: {missing} lines are missing: no space left on the disk\n")
        stream.write(text)
        stream.flush()
        _missing.clear()
    except OSError as failure:
        handle, nowhere = stream.fileno(), os.open(os.devnull, os.O_WRONLY)
        there = os.dup(handle)
        os.dup2(nowhere, handle)
        stream.flush()  # what it still holds
        if failure.errno in (errno.ENOSPC, errno.EDQUOT):
            os.dup2(there, handle)
            _missing[handle] = _missing.get(handle, 0) + text.count("\n")
        os.close(nowhere)
        os.close(there)


class Log:
    """The log of a run.

    rank: only 0 prints. stream: where to; a bar is drawn when it is a terminal. now: a clock [s], for tests.
    """

    def __init__(self, rank: int = 0, stream: TextIO | None = None, now: Any = time.monotonic) -> None:
        self._speaks = rank == 0
        self._stream = stream if stream is not None else sys.stdout
        self._now = now
        # Open MPI gives its processes a terminal of their own, wherever their output goes in the end.
        self._terminal = self._speaks and self._stream.isatty() and "OMPI_COMM_WORLD_SIZE" not in os.environ
        self._notebook = self._speaks and stream is None and in_notebook()
        self._bar: Bar | NotebookBar | None = None
        self._warned: set[str] = set()
        self._warnings: dict[str, int] = {}
        self.folds = True
        """Whether repeated warnings are counted instead of written; off while a user types commands."""
        self._script_steps = 0
        self._script_done = self._script_first = 0
        self._script_began = now()
        self._command: Command | None = None
        self._window: tuple[int, float] | None = None  # step and time of the last line
        self._last_line = -QUIET_SECONDS
        self.every_interval = False
        self.place: Path | None = None
        """Folder of the results, if any: `at` reports the progress of the run there."""
        self._text = ""
        self._noted: tuple[str, int, int, float] | None = None
        self._note_due = 0.0

    # -- lines -----------------------------------------------------------------------------------------------

    def info(self, text: str) -> None:
        """A line on stdout."""
        if self._speaks:
            self._print(text)

    def warn(self, text: str) -> None:
        """A line that starts with ``warning:``. Of those that differ in numbers alone the first three are written, then
        the tenth, the hundredth ... with their count; `close` logs their total number.
        """
        kind = _NUMBERS.sub("#", text)
        count = self._warnings[kind] = self._warnings.get(kind, 0) + 1
        if not self.folds or count <= FOLDED_AFTER:
            self.info(f"warning: {text}")
        elif math.log10(count).is_integer():
            self.info(f"warning ({count} times so far): {text}")

    def close(self) -> None:
        """Tell how often warnings came that were not all written."""
        for kind, count in self._warnings.items():
            if self.folds and count > FOLDED_AFTER:
                self.info(f"warning: {count} in total like this one: {kind[:100]}{'...' * (len(kind) > 100)}")
        self._warnings.clear()

    def results(self, folder: Path) -> None:
        """Report where the results are and how to view them: the last line of a run."""
        where = shlex.quote(str(folder))
        self.info(f"results: {folder}; `hpcdem view {where}` shows them, `hpcdem measure {where}` measures them")

    def warn_once(self, key: str, text: str) -> None:
        """A warning, the first time that `key` comes by."""
        if key not in self._warned:
            self._warned.add(key)
            self.warn(text)

    def has_warned(self, key: str) -> bool:
        """Return whether `warn_once` has been called with this key; meaningful on rank 0 only."""
        return key in self._warned

    def _print(self, text: str) -> None:
        self._text = text
        text = chinese.logged(text, self._stream.encoding)
        if self._terminal:
            text = folded(text, shutil.get_terminal_size().columns)
        if self._bar is not None:
            self._bar.print(text)
        else:
            write(self._stream, f"{text}\n")

    # -- progress --------------------------------------------------------------------------------------------

    def script_started(self, name: str, steps: int, done: int = 0) -> None:
        """Number of steps of the script (0: unknown), of which `done` were done by an earlier run."""
        self._script_steps = steps
        self._script_done = self._script_first = done
        self._script_began = self._now()

    def set_interval(self, explicit: bool) -> None:
        """Set after SET stepbar: the user wants a line per interval, however short."""
        self.every_interval = explicit

    def command_started(
        self, name: str, line: int, steps: int, step: int | None = None, before: int = 0, beside: bool = False
    ) -> None:
        """A CYC or IMPLE with `steps` steps to do (0: not known) begins at this line of the script (0: no script).

        step: the step number now; by default that of the first call of `step`. before: steps of the command that an
        earlier run did. beside: of particles that are stepped with blocks, which tell of beginning and end.
        """
        self._command = Command(name, line, steps, step, before, beside)
        self._window = None if step is None else (step, self._now())
        if not self._speaks or beside:
            return
        where = f"line {line}: " if line else ""
        whole, left = steps + before, f", {steps} left" if before else ""
        self._print(f"{where}{name}, {whole} step{'s' * (whole != 1)}{left}")
        if self._terminal:
            self._bar = Bar(self._stream, name, whole, self._script_steps, self._script_done)
        elif self._notebook:
            self._bar = NotebookBar(name, whole, self._script_steps, self._script_done)

    def wants(self, step: int) -> bool:
        """Move the bar to this step; True if a line is due, so that a StepStatus must be made (ask rank 0)."""
        command = self._command
        if not self._speaks or command is None:
            return False
        if command.first_step is None or self._window is None:
            return True
        done = step - command.first_step
        began, ends = command.first_step - command.before, command.first_step + command.steps
        self.at(step, command.name, began, ends, command.before)
        if self._bar is not None:
            self._bar.update(command.before + done, self._script_done + done)
        due = self.every_interval or self._now() - self._last_line >= QUIET_SECONDS
        due = due or (done >= command.steps and not command.beside)
        return due and step > self._window[0]

    def at(self, step: int, name: str, first: int, last: float, before: int = 0) -> None:
        """A command is at this step; it began at `first` and ends at `last` (inf: not known); before: steps of it that
        an earlier run did. For those who look at the folder of the results, now and then (io/run_record.py: PROGRESS);
        a disk that refuses it does not matter."""
        now = self._now()
        if not self._speaks or self.place is None:
            return
        if self._noted is None or self._noted[:2] != (name, first):
            self._noted, self._note_due = (name, first, step, now), now + NOTE_SECONDS
        if now < self._note_due:
            return
        self._note_due = now + NOTE_SECONDS
        *_, since, began = self._noted
        speed, known = (step - since) / max(now - began, 1e-9), math.isfinite(last) and last > first
        record = {
            "step": step, "command": name, "line": self._text.strip().rpartition("\n")[2], "speed": speed,
            "part": (step - first) / (last - first) if known else None,
            "left": (last - step) / speed if known and speed > 0.0 else None,
        }  # fmt: skip
        if self._script_steps:
            done = self._script_done + step - first - before
            record |= {"script_part": done / self._script_steps, "script_left": max(self._script_left(done), 0.0)}
        try:
            beside = self.place / f"{PROGRESS}.tmp"
            beside.write_text(json.dumps(record), encoding="utf-8")
            beside.replace(self.place / PROGRESS)
        except OSError:
            pass

    def step(self, status: StepStatus) -> None:
        """The model after a step; printed if a line is due."""
        command = self._command
        if not self._speaks or command is None:
            return
        now = self._now()
        if command.first_step is None or self._window is None:
            command.first_step, self._window = status.step, (status.step, now)
        if not self.wants(status.step):
            return
        last_step, last_time = self._window
        speed = (status.step - last_step) / max(now - last_time, 1e-9)
        self._last_line, self._window = now, (status.step, now)
        self._print(self.line(status, status.step - command.first_step, speed))

    def line(self, status: StepStatus, done: int, speed: float) -> str:
        """The progress line: `done` steps of the command, `speed` [steps/s] since the last line."""
        command = self._command
        assert command is not None
        total, script_done = self._script_steps, self._script_done + done
        left = (command.steps - done) / speed if speed > 0 else -1.0
        parts = [
            f"step {status.step}",
            f"{command.name} {percent(command.before + done, command.before + command.steps)}",
        ]
        if total:
            parts.append(f"script {percent(script_done, total)}")
        parts.append(f"{rate(speed)} steps/s")
        if done < command.steps:
            parts.append(f"left {duration(left)}")
            if total:
                parts[-1] += f", script {duration(self._script_left(script_done))}"
        known = 0.0 < status.dt_critical < math.inf
        critical = f" ({status.dt / status.dt_critical:.2f} of the critical one)" if known else ""

        def shown(value: float, unit: str, digits: int = 4) -> str:
            return with_prefix(value, unit, digits, status.units)

        parts.append(f"time {shown(status.time, 's', 6)}, time step {shown(status.dt, 's')}{critical}")
        parts.append(
            f"kinetic energy {shown(status.kinetic, 'J')}, unbalanced force {status.unbalanced_ratio:.3g} of the mean "
            "contact force"
        )
        parts.append(f"{status.particles} particles, {status.contacts} contacts, {bonds(status)}")
        if status.walls:
            forces = (f"{i} ({shown(fx, 'N')}, {shown(fy, 'N')})" for i, fx, fy in status.walls)
            parts.append(f"forces on walls: {', '.join(forces)}")
        return " | ".join(parts)

    def _script_left(self, done: int) -> float:
        """Seconds left for the script, at the mean speed since its start: steps of early and late commands differ."""
        spent, here = self._now() - self._script_began, done - self._script_first
        return (self._script_steps - done) * spent / here if here > 0 else -1.0

    def command_finished(self) -> None:
        """The command is done, or left by an error."""
        if self._command is not None:
            self._script_done += self._command.steps
            self._command = None
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    # -- the end ---------------------------------------------------------------------------------------------

    def stages(self, timers: Timers, comm: Comm, body: str = "particle") -> Summary:
        """Collective: the table of stages. body: what the timers count, "particle" or "element"."""
        summary = timers.merge(comm)
        if not self._speaks:
            return summary
        self.command_finished()
        self.table("", HEADINGS, stage_rows(summary))
        self._print(closing_line(summary, body))
        return summary

    def stages_of_both(self, particles: Timers, blocks: Timers, comm: Comm) -> None:
        """Collective: the table of stages of particles and blocks in one run."""
        parts = {"particles": particles, "blocks": blocks}
        whole, *each = (timers.merge(comm) for timers in (Timers.joined(parts, BETWEEN), *parts.values()))
        if not self._speaks:
            return
        self.command_finished()
        self.table("", HEADINGS, stage_rows(whole))
        of_particles, of_blocks = each
        line = (
            f"{of_particles.steps} steps of particles and {of_blocks.steps} of blocks in {duration(whole.wall)} | "
            f"{rate(of_particles.particle_steps / whole.wall)} particle-steps/s | "
            f"{rate(of_blocks.particle_steps / whole.wall)} element-steps/s"
        )
        self._print(line + (f" | imbalance of {whole.ranks} ranks {whole.imbalance:.2f}" if whole.ranks > 1 else ""))

    def account(self, title: str, quantity: str, unit: str, values: Mapping[str, float], system: str = "") -> None:
        """A table of values in one unit, with the prefix of the largest; system: units that the model declared."""
        size, name = in_one_unit(values.values(), unit, system)
        self.table(title, (quantity, name), [(words, f"{value / size:.6g}") for words, value in values.items()])

    def table(self, title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A table, drawn on a terminal, aligned text in a file; the first column to the left, the others to the
        right."""
        if not self._speaks:
            return
        if self._terminal:
            print_table(title, headings, rows, self._stream)
        else:
            self._print((f"{title}\n" if title else "") + aligned(headings, rows))


def bonds(status: StepStatus) -> str:
    """Bonds and what became of the others."""
    text = f"{status.bonds} bonds"
    if status.broken_tension or status.broken_shear:
        text += f" ({status.broken_tension} broken in tension, {status.broken_shear} in shear)"
    return text


def percent(done: int, total: int) -> str:
    """``37.5%``."""
    return f"{100.0 * done / total:.1f}%" if total else "--"


# -- stages ----------------------------------------------------------------------------------------------------

BETWEEN = {
    "couple": "between: contact", "search": "between: search", "exchange": "between: exchange", "kernels": "kernels",
}  # fmt: skip
"""Stages that belong to neither particles nor blocks, whose timers count them, by name in the table of both."""
HEADINGS = ("stage", "mean s", "max s", "max/mean", "%", "calls")


def stage_rows(summary: Summary) -> list[tuple[str, ...]]:
    """The table of stages as text, longest stage first; the last row is the rest of the wall time."""
    rows: list[tuple[str, ...]] = []
    for s in sorted(summary.stages, key=lambda s: -s.mean):
        share = 100.0 * s.mean / summary.wall if summary.wall > 0 else 0.0
        spread = f"{s.largest / s.mean:.2f}" if s.mean > 0 else "--"
        rows.append((s.name, f"{s.mean:.2f}", f"{s.largest:.2f}", spread, f"{share:.1f}", str(s.calls)))
    rest = max(summary.wall - sum(s.mean for s in summary.stages), 0.0)
    share = 100.0 * rest / summary.wall if summary.wall > 0 else 0.0
    rows.append(("other", f"{rest:.2f}", "", "", f"{share:.1f}", ""))
    return rows


def aligned(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in aligned plain text."""
    table = [headings, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(headings))]
    lines = []
    for first, *others in table:
        cells = [first.ljust(widths[0]), *(c.rjust(w) for c, w in zip(others, widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def closing_line(summary: Summary, body: str = "particle") -> str:
    """Totals: wall time, steps, rates, imbalance."""
    wall = max(summary.wall, 1e-9)
    parts = [
        f"{counted(summary.steps, 'step')} in {duration(summary.wall)}",
        f"{rate(summary.steps / wall)} steps/s",
        f"{rate(summary.particle_steps / wall)} {body}-steps/s",
    ]
    if summary.ranks > 1:
        parts.append(f"imbalance of {summary.ranks} ranks {summary.imbalance:.2f}")
    return " | ".join(parts)


# -- terminal --------------------------------------------------------------------------------------------------


def print_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], stream: TextIO) -> None:
    """The table, drawn."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title or None)
    for i, name in enumerate(headings):
        table.add_column(name, justify="right" if i else "left")
    for row in rows:
        table.add_row(*row)
    Console(file=stream).print(table)


class Bar:
    """Two bars at the foot of a terminal, the command's and the script's; lines scroll above them."""

    REDRAW = 0.2

    def __init__(self, stream: TextIO, name: str, steps: int, script_steps: int, script_done: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        # No thread of its own (auto_refresh): a thread would take time from the step loop at odd moments.
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=Console(file=stream),
            auto_refresh=False,
            transient=True,
        )
        self._command = self._progress.add_task(name, total=steps)
        whole = chinese.logged("script")
        self._script = (
            self._progress.add_task(whole, total=script_steps, completed=script_done) if script_steps else None
        )
        self._drawn = 0.0
        self._progress.start()

    def update(self, done: int, script_done: int) -> None:
        """Move the bars; redrawn a few times a second."""
        self._progress.update(self._command, completed=done)
        if self._script is not None:
            self._progress.update(self._script, completed=script_done)
        if time.monotonic() - self._drawn > self.REDRAW:
            self._progress.refresh()
            self._drawn = time.monotonic()

    def print(self, text: str) -> None:
        """A line above the bars."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def close(self) -> None:
        """Take the bars away."""
        self._progress.stop()
