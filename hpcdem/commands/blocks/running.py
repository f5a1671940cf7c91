"""model step and model solve: the loop over steps, and what is due between them."""

from __future__ import annotations

import math
import time as clocks
from pathlib import Path
from typing import TYPE_CHECKING

from hpcdem.commands.blocks import coupling, frames, histories, saving
from hpcdem.commands.blocks.project import Project
from hpcdem.errors import CommandError, PhysicsError, StoppedWithCheckpoint
from hpcdem.io.behind import under_way
from hpcdem.runtime.progress import duration, rate

if TYPE_CHECKING:
    from hpcdem.blocks import Blocks

RATIO = 1e-5
"""Unbalanced over all forces at which a static run is in equilibrium, if nothing else is asked for."""
LOOK_STATIC, LOOK_DYNAMIC = 50, 100
"""Steps between two looks at the ratio, counted from the beginning of the command."""
STRIDE = 100
"""Steps at most between two looks at the model time, as the time step may change."""
QUIET_SECONDS = 10.0
"""Between two lines of the log."""


def step(project: Project, steps: int) -> None:
    """So many steps."""
    _run(project, f"step {steps}", steps, None, None)


def solve(project: Project, ratio: float | None = None, cycles: int | None = None, time: float | None = None) -> None:
    """Steps until the unbalanced forces are so small, so many are done, or so much time [s] has passed: whatever comes
    first. Without any of them: until the ratio is RATIO."""
    words = [f"{name} {value:g}" for name, value in (("ratio", ratio), ("cycles", cycles), ("time", time)) if value]
    if ratio is None and cycles is None and time is None:
        ratio = RATIO
        words = [f"ratio {ratio:g}"]
    if time is not None and not project.dynamic:
        raise CommandError("time does not pass in static runs: use ratio or cycles")
    _run(project, "solve " + " ".join(words), cycles, ratio, time)


def solve_elastic(project: Project, cycles: int = 1, ratio: float | None = None, solver: str = "auto") -> None:
    """Static equilibrium at once, see `Blocks.solve_elastic`; the histories and frames that are due then."""
    blocks = project.ready()
    began = clocks.monotonic()
    given = {} if ratio is None else {"ratio": ratio}
    found = blocks.solve_elastic(cycles=cycles, solver=solver, **given)
    if project.log is not None:
        where = f"line {project.line}: " if project.line else ""
        project.log.info(
            f"{where}solve elastic: ratio {found.ratio:.3g} after {found.iterations} iterations, "
            f"{found.unknowns} unknowns, {found.solver}, {duration(clocks.monotonic() - began)}"
        )
    histories.record(project)
    frames.write_due(project)
    histories.flush(project)
    frames.settle(project)


def _run(project: Project, name: str, steps: int | None, ratio: float | None, time: float | None) -> None:
    coupling.take_up(project)
    clock = project.ready().clock
    if project.progress is None:
        project.progress = {"first": clock.step, "end": None if time is None else clock.time + time}
    first, end = project.progress["first"], project.progress["end"]  # from before a checkpoint, if it goes on from one
    try:
        _advance(project, name, first, math.inf if steps is None else first + steps, math.inf if end is None else end,
                 ratio)  # fmt: skip
        frames.settle(project)
    finally:
        under_way.wait()  # the way out after an error, too
        project.progress = None


def _advance(project: Project, name: str, first: int, last: float, end: float, ratio: float | None) -> None:
    """To step `last` or model time `end` [s], whatever comes first."""
    blocks, clock = project.blocks, project.blocks.clock
    look = LOOK_DYNAMIC if project.dynamic else LOOK_STATIC
    report = _Report(project, name, last)
    frames.write_due(project)
    while clock.step < last and clock.time < end - 0.5 * clock.dt:
        due = min(last, _after(clock.step, STRIDE, first))
        due = min([due, *(_after(clock.step, every, 0) for every in _intervals(project))])
        if ratio is not None:
            due = min(due, _after(clock.step, look, first))
        try:
            request = coupling.advance(project, int(min(due - clock.step, _within(project, end))))
        except PhysicsError:
            histories.flush(project)
            frames.write_last(project)
            raise
        histories.record(project)
        frames.write_due(project)
        here = (clock.step - first) % look == 0
        reached = ratio is not None and here and blocks.unbalanced_ratio() <= ratio
        report.tell(blocks)
        if reached:  # a request is answered by the next command: nothing is left to do in this one
            break
        if request:
            _answer(project, request)
    histories.flush(project)
    report.finish(blocks)


def _within(project: Project, end: float) -> float:
    """Steps to the moment nearest to a model time, at least one; `dt` is known from the first step on only. Near the
    end one at a time if it may change on the way: where the run ends must not depend on where it was interrupted."""
    clock = project.blocks.clock
    if not math.isfinite(end):
        return math.inf
    steps = max(1, math.ceil((end - clock.time) / clock.dt - 0.5)) if clock.dt > 0.0 else 1
    return 1 if project.adapts and steps <= 2 * STRIDE else steps


def _intervals(project: Project) -> list[int]:
    return [history.every for history in project.histories.values()] + list(project.frames.values())


def _after(step: int, every: int, origin: int) -> int:
    """The first step after this one that is a multiple of `every` from the origin on."""
    return origin + ((step - origin) // every + 1) * every


def _answer(project: Project, request: int) -> None:
    """A signal or the time limit asked for a checkpoint, perhaps for the end."""
    stop, log, step = project.blocks.stop, project.log, project.step
    what = stop.decide(request)
    if what == "none":
        return
    histories.flush(project)
    path = saving.write_checkpoint(project, automatic=what == "auto")
    if what == "stop":
        raise StoppedWithCheckpoint(
            f"stopped at step {step} by {stop.reason}; checkpoint {path} written, go on with {_onwards(project, path)}"
        )
    if log is not None:
        why = "as the last one was long ago" if what == "auto" else "on request"
        log.info(f"step {step}: checkpoint {path} written {why}")


def _onwards(project: Project, path: Path) -> str:
    place = project.place()
    return "--resume" if place is not None and place["journal"] is not None else f"pcdc model restore '{path}'"


class _Report:
    """What the log says of a run: a line at its beginning, one every QUIET_SECONDS, one at its end. Of a line of the
    script that runs again and again, as in a loop, it speaks every QUIET_SECONDS only."""

    def __init__(self, project: Project, name: str, last: float) -> None:
        self.project, self.last = project, last
        self.began = self.told = clocks.monotonic()
        self.began_step = self.told_step = project.step
        before = project.told.get(project.line)
        self.speaks = project.comm.bcast(before is None or self.began - before >= QUIET_SECONDS)
        where = f"line {project.line}: " if project.line else ""
        if project.log is not None and self.speaks:
            project.told[project.line] = self.began
            project.log.info(f"{where}{name}")

    def tell(self, blocks: Blocks) -> None:
        """Collective: the line, if one is due."""
        now = clocks.monotonic()
        if self.project.log is None or not self.project.comm.bcast(now - self.told >= QUIET_SECONDS):
            return
        done = blocks.clock.step - self.told_step
        speed = done / max(now - self.told, 1e-9)
        left = f" | left {duration((self.last - blocks.clock.step) / speed)}" if self.last < math.inf and speed else ""
        under_way.look(self.project.comm)
        elements = int(self.project.alive.sum())
        self.project.log.info(
            f"{self._state(blocks)} | {rate(speed)} steps/s, {rate(speed * elements)} element-steps/s{left}"
        )
        self.told, self.told_step, self.speaks = now, blocks.clock.step, True

    def _state(self, blocks: Blocks) -> str:
        clock = blocks.clock
        intact, yielded, broken = blocks.joint_counts()
        joints = f" | joints: {yielded} yielded, {broken} broken" if intact + yielded + broken else ""
        time = f" | t {clock.time:.6g} s, dt {clock.dt:.4g} s" if self.project.dynamic else ""
        return f"step {clock.step}{time} | ratio {blocks.unbalanced_ratio():.3g}{joints}"

    def finish(self, blocks: Blocks) -> None:
        """Collective: how it ended."""
        if self.project.log is None or not self.speaks:
            return
        state, steps = self._state(blocks), blocks.clock.step - self.began_step
        spent = clocks.monotonic() - self.began
        speed = steps * int(self.project.alive.sum()) / max(spent, 1e-9)
        self.project.log.info(f"{state} | {steps} steps in {duration(spent)}, {rate(speed)} element-steps/s")
