"""model step and model solve: the loop over steps, and what is due between them."""

from __future__ import annotations

import math
import time as clocks
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.commands.fdem import checkpoints, coupling, cracks, frames, histories
from hpcdem.commands.fdem import clocks as clocks_of
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError, EquilibriumError, PhysicsError
from hpcdem.core.units import counted, with_prefix
from hpcdem.engine.due import after, answer
from hpcdem.io.behind import under_way
from hpcdem.physics.fdem import convergence, creep, diagnostics, equilibrium, notices, overlaps
from hpcdem.physics.fdem.convergence import RATIO, Watch
from hpcdem.physics.flow import costs
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.runtime.progress import duration, rate
from hpcdem.runtime.stop_requests import STOP

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

CHECK_STATIC, CHECK_DYNAMIC = 50, 100
"""Interval of evaluations of the ratio, counted from the beginning of the command, without model solve-check
[steps]."""
CYCLES = 10_000
"""Largest number of steps of a model solve without a criterion, if RATIO is not reached before."""
STRIDE = 100
"""Longest interval of checks of the model time, as the time step may change [steps]."""
CONTINUE = "continue"
"""Value of on_failure with which a script continues after a run that failed to converge; by default it stops."""
FAILED = ("no progress", "limit")
"""Reasons of `blocks.Watch`; "runaway": a body moved too fast to continue."""
STEADY_STEP = 1.0
"""First step towards steady flow [s]."""
QUIET_SECONDS = 10.0
"""Shortest time between two lines of the log [s]."""


def step(project: Project, steps: int) -> None:
    """Take so many steps."""
    _run(project, f"step {steps}", steps, None, None, command=("step", {"steps": steps}))


def resume(project: Project) -> None:
    """Finish the command interrupted by the checkpoint that was just loaded (checkpoints.restore_newest)."""
    command = (project.progress or {}).get("command")
    if command is None:
        raise CommandError("the checkpoint does not record the command in which it was written")
    name, given = command
    of: dict[str, Callable[..., None]] = {
        "step": step, "solve": solve, "solve elastic": solve_elastic, "solve hydraulic": solve_hydraulic,
        "solve thermal": solve_thermal,
    }  # fmt: skip
    of[name](project, **given)


def solve(
    project: Project,
    ratio: float | None = None,
    cycles: int | None = None,
    time: float | None = None,
    window: int | None = None,
    limit: int | None = None,
    on_failure: str = "stop",
    run_time: float | None = None,
) -> None:
    """Step until the first of these: the unbalanced forces reach the ratio, the number of cycles is reached, or the
    time [s] has passed. run_time: as `clocks.run_time`, for this call. Without any of them: until the ratio is RATIO
    and, without a convergence check (window, limit, on_failure), for CYCLES at most.

    window, limit [steps]: when a run towards a ratio has failed, see `convergence.watch`; it ends the script with an
    EquilibriumError or, with on_failure CONTINUE, logs a warning. project.solved holds the outcome.
    """
    bare = (ratio, cycles, time) == (None, None, None)
    if run_time is not None and not _time_passes(project):
        raise CommandError("run-time: in static runs without creep no time passes; cycles or ratio end them")
    if project.run_time and not _time_passes(project) and project.log is not None:
        project.log.warn_once(
            "run-time",
            f"model run-time {project.run_time:g} s cannot end a static run: no time passes there without creep",
        )
    if (run := run_time or project.run_time) and _time_passes(project):
        left = _left(project, run)
        if left <= 0.0 and project.progress is None:
            _warn_no_time(project, run)
            return
        time, bare = left if time is None else min(time, left), False
    command = "solve", {"ratio": ratio, "cycles": cycles, "time": time, "window": window, "limit": limit,
                        "on_failure": on_failure}  # fmt: skip
    words = [f"{name} {value:g}" for name, value in (("ratio", ratio), ("cycles", cycles), ("time", time)) if value]
    if bare:
        watched = (window, limit, on_failure) != (None, None, "stop")
        ratio, cycles = RATIO, None if watched else CYCLES
        words = [f"ratio {ratio:g}"] + [f"cycles {CYCLES}"] * (not watched)
    if time is not None and not project.dynamic:
        _check_creep(project, time, cycles)
    if ratio is not None and not project.blocks.options.mechanical:
        raise CommandError("without mechanics no unbalanced forces exist: use model solve with cycles or time")
    first = project.step if project.progress is None else project.progress["first"]
    text = ""
    try:
        reason, found, watch = _run(project, "solve " + " ".join(words), cycles, ratio, time, window, limit, command)
        if reason in FAILED:
            text = _no_equilibrium(project, watch, reason, ratio or RATIO, found)
    except EquilibriumError as error:
        reason, found, text = "runaway", math.nan, f"no equilibrium: {error}; {_what_moves(project)}"
    project.solved = {"reason": reason, "ratio": found, "steps": project.step - first}
    _warn_of_end(project, reason, found, bare)
    if text and on_failure != CONTINUE:
        raise EquilibriumError(text)
    if text and project.log is not None:
        project.log.warn(text)


def _warn_of_end(project: Project, reason: str, found: float, bare: bool) -> None:
    """Warn about an end that may be unintended. bare: the command gave no target."""
    if project.log is None:
        return
    if reason == "ratio" and not project.dynamic:
        for name in project.blocks.changing_tables():
            project.log.warn(
                f"{_where(project)}converged although table '{name}' of a condition still changes with each static "
                "step. Use model solve cycles or model step to reach its end"
            )
    if bare and reason == "cycles":
        project.log.warn(
            f"{_where(project)}model solve without a criterion ended after {CYCLES} cycles at ratio {found:.3g}: use "
            f"model solve ratio {RATIO:g} to reach equilibrium"
        )


def _time_passes(project: Project) -> bool:
    return project.dynamic or project.blocks.creep.on


def _left(project: Project, run: float) -> float:
    """Time [s] until the end of a run-time, of the parts that were given a start the one that is first."""
    return min((begin + run - clocks_of.time(project, part) for part, begin in project.began.items()), default=run)


def _warn_no_time(project: Project, run: float) -> None:
    project.solved = {"reason": "time", "ratio": math.nan, "steps": 0}
    if project.log is not None:
        begins = " and ".join(f"{begin:g} s" for begin in project.began.values())
        project.log.warn(f"{_where(project)}run-time {run:g} s, counted from {begins}, has passed: no step is executed")


def solve_elastic(
    project: Project, cycles: int = 1, ratio: float | None = None, solver: str = "auto", time: float | None = None,
    steps: int | None = None,
) -> None:  # fmt: skip
    """Find static equilibrium directly, see `equilibrium.solve_elastic`, and write the histories and frames that are
    due. time: creep time [s] to pass; each creep step is solved directly.
    """
    project.refuse_inside("model solve elastic")
    coupling.refuse(project, "model solve elastic")
    if not project.blocks.options.mechanical:
        raise CommandError("model solve elastic moves the blocks: use model option mechanical on first")
    blocks = project.ready()
    given: dict[str, Any] = {name: value for name, value in (("ratio", ratio), ("steps", steps)) if value is not None}
    if time is not None:
        _creep_at_once(project, time, solver, given)
        return
    began = clocks.monotonic()
    found = equilibrium.solve_elastic(blocks, cycles=cycles, solver=solver, **given)
    project.solved = {"reason": "ratio", "ratio": found.ratio, "steps": cycles}
    if project.log is not None:
        parts = f" in {found.increments} increments" if found.increments > 1 else ""
        project.log.info(
            f"{_where(project)}solve elastic: unbalanced force ratio {found.ratio:.3g} after {found.iterations} "
            f"iterations{parts}; {found.unknowns} unknowns, solver {found.solver}, "
            f"{duration(clocks.monotonic() - began)}"
        )
    _write_due(project)
    histories.flush(project)
    frames.settle(project)


def solve_hydraulic(
    project: Project, time: float | None = None, dt: float | None = None, steady: bool = False, solver: str = "auto",
    auto: bool = False,
) -> None:  # fmt: skip
    """Compute flow by implicit steps, see `coupled.Coupled`: for a flow time [s], with blocks in static equilibrium if
    they move, or until it is steady. dt: longest time step [s] (default: a hundredth of the time); auto: use explicit
    steps, as model solve and model step, where they cost less.
    """
    project.refuse_inside("model solve hydraulic")
    coupling.refuse(project, "model solve hydraulic")
    if steady == (time is not None):
        raise CommandError("flow is solved for a time or until it is steady: give either time or steady")
    if auto and time is None:
        raise CommandError("auto needs a time: steady flow is computed by implicit steps")
    blocks = project.ready()
    flow = Flow.there(blocks)
    if auto and flow is not None and time is not None and _explicit_is_cheaper(project, flow, time, dt, solver):
        _flow_by_steps(project, flow, time)
        return
    first, began = project.step, clocks.monotonic()
    run = Coupled(blocks, dt or (STEADY_STEP if time is None else 0.01 * time), solver)
    if time is None:
        with run:
            run.steady()
        _write_due(project)
    else:
        assert flow is not None
        if project.progress is None:
            command = "solve hydraulic", {"time": time, "dt": dt, "solver": solver}
            project.progress = {"first": project.step, "flow": flow.time + time, "command": command}
        first = project.progress["first"]
        try:
            project.stepping = "solve hydraulic"
            frames.write_due(project)
            _flow_on(project, run, flow, project.progress["flow"])
        finally:
            under_way.wait()
            project.progress, project.stepping = None, ""
    count = run.count
    project.solved = {"reason": "steady" if steady else "time", "ratio": math.nan, "steps": project.step - first}
    if project.log is not None:
        project.log.info(
            f"{_where(project)}solve hydraulic: {counted(count.steps, 'implicit step')}"
            f"{f' ({count.cut} repeated with half the time step)' * bool(count.cut)}, "
            f"{counted(count.iterations, 'iteration')}; {count.unknowns} unknowns, solver {count.solver}, "
            f"{duration(clocks.monotonic() - began)}"
        )
    histories.flush(project)
    cracks.flush(project)  # joints that broke became free faces at the end
    frames.settle(project)


def solve_thermal(
    project: Project, time: float | None = None, dt: float | None = None, steady: bool = False, solver: str = "auto"
) -> None:
    """Compute heat by implicit steps, see `implicit.Implicit`: for a heat time [s], with blocks in static equilibrium
    if they move, or the steady state directly. dt: longest time step [s] (default: a hundredth of the time).
    """
    project.refuse_inside("model solve thermal")
    coupling.refuse(project, "model solve thermal")
    if steady == (time is not None):
        raise CommandError("heat is solved for a time or until it is steady: give either time or steady")
    if steady and dt is not None:
        raise CommandError("dt needs time: the steady state of heat is computed directly")
    if dt is not None and not dt > 0.0:
        raise CommandError(f"the time step must be positive, got {dt:g}")
    blocks = project.ready()
    began, first = clocks.monotonic(), project.step
    run = Implicit(blocks, solver)
    try:
        if time is None:
            run.steady()
            _write_due(project)
        else:
            if project.progress is None:
                count = max(1, math.ceil(time / (dt or 0.01 * time) - 1e-9))
                command = "solve thermal", {"time": time, "dt": dt, "solver": solver}
                project.progress = {"first": first, "left": count, "dt": time / count, "command": command}
            first = project.progress["first"]
            project.stepping = "solve thermal"
            frames.write_due(project)
            while project.progress["left"] > 0:
                _heat_on(project, run, project.progress)
    finally:
        run.close()
        under_way.wait()
        project.progress, project.stepping = None, ""
    project.solved = {"reason": "steady" if steady else "time", "ratio": math.nan, "steps": project.step - first}
    if project.log is not None:
        name = "" if run.solver is None else f", solver {run.solver.name}"
        project.log.info(
            f"{_where(project)}solve thermal: {counted(run.steps, 'implicit step')}, "
            f"{counted(run.factors, 'factorization')}; {run.unknowns} unknowns{name}, "
            f"{duration(clocks.monotonic() - began)}"
        )
    histories.flush(project)
    frames.settle(project)


def _heat_on(project: Project, run: Implicit, progress: dict[str, Any]) -> None:
    """An implicit step of heat, and what is due then; a checkpoint, if one is requested."""
    run.advance(progress["dt"])
    progress["left"] -= 1
    _write_due(project)
    if progress["left"] > 0:
        _answer_requests(project)


def _explicit_is_cheaper(project: Project, flow: Flow, time: float, dt: float | None, solver: str) -> bool:
    """Choose explicit steps for flow time [s] if they cost less or implicit steps are refused, and log the choice. A
    command that resumes from a checkpoint keeps its choice. Collective."""
    if project.progress is not None:
        return bool(project.progress["command"][0] != "solve hydraulic")
    blocks, refused = project.blocks, None
    blocks.close_model()
    stepped = costs.explicit(flow, time)
    try:
        at_once: costs.Cost | str = Coupled(blocks, dt or 0.01 * time, solver).cost(time)
    except CommandError as error:
        refused, at_once = error, str(error)
    if refused is not None and isinstance(stepped, str):
        raise refused
    wanted = refused is not None or (
        isinstance(stepped, costs.Cost) and isinstance(at_once, costs.Cost) and stepped.seconds < at_once.seconds
    )
    if project.log is not None:
        project.log.info(
            f"{_where(project)}solve hydraulic auto: {'explicit' if wanted else 'implicit'} steps; "
            f"explicit: {stepped}; implicit: {at_once}"
        )
    return wanted


def _flow_by_steps(project: Project, flow: Flow, time: float) -> None:
    """Advance the flow by so much flow time [s] with explicit steps."""
    o = project.blocks.options
    if o.mechanical and not o.dynamic:
        step(project, costs.cycles(flow, time))
    else:
        solve(project, time=time)


def _report_thin(project: Project, steps: int | None, time: float | None) -> None:
    """A word on the fluid before a run of so many steps, or of so much time [s], that will take long. Collective."""
    blocks, log = project.blocks, project.log
    flow, o = Flow.there(blocks), blocks.options
    if flow is None or not o.hydraulic or not len(flow.network.channels):
        return
    if o.mechanical and not o.dynamic:
        time = None if steps is None else steps * max(1, o.flow_steps) * o.flow_dt / o.flow_every
    elif time is None and steps is not None:
        time = steps * blocks.clock.dt
    if not time:
        return
    cost = costs.explicit(flow, time)
    if log is not None and isinstance(cost, costs.Cost) and cost.seconds > costs.LONG:
        what = "stiff fluid in thin fractures" if o.flow_dt == 0.0 else "set by model time-step hydraulic"
        log.warn(
            f"{_where(project)}flow by explicit sub-steps, {what}: {cost} on one core; model solve hydraulic uses "
            "implicit steps"
        )


def _flow_on(project: Project, run: Coupled, flow: Flow, end: float) -> None:
    """Implicit steps to this flow time [s]. Checkpoints that are requested are written between two of them, inside of
    the run: nothing is different after one."""
    reported, last = clocks.monotonic(), end * (1.0 - 1e-12)
    if flow.time >= last:
        return
    with run:
        while flow.time < last:
            run.advance(end)
            _write_due(project)
            if project.log is not None and clocks.monotonic() - reported > QUIET_SECONDS:
                reported = clocks.monotonic()
                shown = partial(with_prefix, unit="s")
                now, whole = shown(flow.time, digits=6), shown(end, digits=6)
                project.log.info(f"flow time {now} of {whole}, time step {shown(flow.implicit_dt)}")
            if flow.time < last:
                _answer_requests(project)


def _where(project: Project) -> str:
    return f"line {project.line}: " if project.line else ""


def _write_due(project: Project) -> None:
    """Write what is due at this step."""
    histories.record(project)
    cracks.record(project)
    frames.write_due(project)


def _check_creep(project: Project, time: float, cycles: int | None = None) -> None:
    """CommandError if the model cannot creep for this time [s] in a static run."""
    coupling.refuse(project, "model solve time in a static run")
    if cycles is not None:
        raise CommandError(
            "time and cycles cannot be combined in static runs: time passes in creep steps, not in cycles"
        )
    creep.check(project.ready(), time)


def _creep_at_once(project: Project, time: float, solver: str, given: dict[str, Any]) -> None:
    """Advance creep by so much creep time [s]; each creep step solves linear equations."""
    if project.dynamic:
        raise CommandError("elastic with time is for static runs: use model option dynamic off first")
    _check_creep(project, time)
    blocks = project.blocks
    if project.progress is None:
        blocks.drop_creep_step()
        command = "solve elastic", {"time": time, "solver": solver, **given}
        project.progress = {"first": project.step, "creep": blocks.creep.time + time, "command": command}
    first, end = project.progress["first"], project.progress["creep"]
    try:
        project.stepping = "solve elastic"
        if blocks.creep.passed == 0.0:
            frames.write_due(project)
        while blocks.creep.time < end:
            if blocks.creep.passed == 0.0:
                creep.begin(blocks, end)
            try:
                found = equilibrium.solve_elastic(blocks, solver=solver, **given)
            except CommandError:
                blocks.drop_creep_step()
                raise
            creep.finish(blocks, end)
            _write_due(project)
            if blocks.creep.time < end:
                _answer_requests(project)
        project.solved = {"reason": "time", "ratio": found.ratio, "steps": project.step - first}
        _report_creep(project)
        histories.flush(project)
        frames.settle(project)
    finally:
        under_way.wait()
        project.progress, project.stepping = None, ""


def _report_creep(project: Project) -> None:
    clock = project.blocks.creep
    if project.log is not None:
        project.log.info(f"{_where(project)}creep time {clock.time:.6g} s after {clock.steps} creep steps")


def _creep(
    project: Project, name: str, ratio: float, window: int | None, limit: int | None
) -> tuple[str, float, Watch]:
    """Creep steps up to the creep time of project.progress, each to this ratio; see `_run`."""
    blocks, progress = project.blocks, project.progress
    assert progress is not None
    clock, end = blocks.creep, progress["creep"]
    ended = "time", math.nan, Watch(0, 0, blocks.clock.step)
    if clock.passed == 0.0:
        frames.write_due(project)
    while clock.time < end:
        if clock.passed == 0.0:
            creep.begin(blocks, end)
            for word in ("ended", "done"):
                progress.pop(word, None)
            watch = convergence.watch(blocks, window, limit)
            progress.update(begun=blocks.clock.step, watch=asdict(watch))
        ended = _advance(project, name, progress["begun"], math.inf, math.inf, ratio)
        if ended[0] != "ratio":
            blocks.drop_creep_step()
            return ended
        creep.finish(blocks, end)
        _write_due(project)
    _report_creep(project)
    histories.flush(project)
    cracks.flush(project)
    return "time", ended[1], ended[2]


def _run(
    project: Project, name: str, steps: int | None, ratio: float | None, time: float | None,
    window: int | None = None, limit: int | None = None, command: tuple[str, dict[str, Any]] | None = None,
) -> tuple[str, float, Watch]:  # fmt: skip
    """Step, and write what is due. Returns why it ended, "ratio", "cycles", "time", "function" (one of the particles
    wanted it to) or one of FAILED, the last ratio that was checked (NaN: none), and who looked. command: what
    `resume` is to call to finish it."""
    project.refuse_inside(f"model {name}")
    coupling.take_up(project)
    clock = project.ready().clock
    if project.progress is None:
        _follow_step_table(project)
    _settle_time_step(project)
    creeps, log = time is not None and not project.dynamic, project.log
    if time is not None and not creeps and project.progress is None and time <= 0.5 * clock.dt and log is not None:
        log.warn(f"{time:g} s is less than half a time step ({clock.dt:.4g} s): no step is executed")
    if project.progress is None:
        project.blocks.drop_creep_step()
        _report_thin(project, steps, time)
        end = None if time is None or creeps else clock.time + time
        project.progress = {"first": clock.step, "end": end, "command": command}
        if time is not None and creeps:
            project.progress["creep"] = project.blocks.creep.time + time
        elif ratio is not None:
            ends = steps is not None or time is not None
            notices.warn_of_flow(project.blocks)
            project.progress["watch"] = asdict(convergence.watch(project.blocks, window, limit, ends))
    first, end = project.progress["first"], project.progress["end"]  # from before a checkpoint, if it resumes from one
    alone = steps if ratio is None and time is None else None  # the number of steps, if it is known
    try:
        with coupling.stepping(project, name, alone):
            project.stepping = name
            if creeps:
                ended = _creep(project, name, ratio or RATIO, window, limit)
            else:
                ended = _advance(project, name, first, math.inf if steps is None else first + steps,
                                 math.inf if end is None else end, ratio)  # fmt: skip
        frames.settle(project)
        return ended
    finally:
        under_way.wait()  # the way out after an error, too
        project.progress, project.stepping = None, ""


def _advance(
    project: Project, name: str, first: int, last: float, end: float, ratio: float | None
) -> tuple[str, float, Watch]:
    """Step to step `last` or model time `end` [s], whichever is first; see `_run`."""
    blocks, clock, progress = project.blocks, project.blocks.clock, project.progress
    assert progress is not None
    # A checkpoint of a version that did not watch has none.
    watch = Watch(**progress["watch"]) if progress.get("watch") else Watch(0, 0, first)
    reason, found = progress.get("ended", ["", math.nan])
    check = project.check_every or (CHECK_DYNAMIC if project.dynamic else CHECK_STATIC)
    report, creeps = _Report(project, name, last), "creep" in progress
    if not creeps:
        frames.write_due(project)
    while clock.step < last and clock.time < end - 0.5 * clock.dt and not progress.get("done"):
        due = min(last, after(clock.step, STRIDE, first), coupling.next_checkpoint(project))
        if not creeps:  # else after the creep step
            due = min([due, *(after(clock.step, every) for every in _intervals(project))])
        if histories.wait(project):
            due = clock.step + 1
        if ratio is not None:
            due = min(due, after(clock.step, check, first))
        request = _to(project, int(min(due - clock.step, _within(project, end))))
        if (clock.step - first) % STRIDE == 0:
            _follow_step_table(project)
        _settle_time_step(project)
        more = not request and clock.step < last and clock.time < end - 0.5 * clock.dt
        if not creeps:
            histories.record(project, more)
            frames.write_due(project)
        cracks.record(project)
        if ratio is not None and ((clock.step - first) % check == 0 or clock.step == last):
            found = diagnostics.unbalanced_ratio(blocks)
            reason = "ratio" if found <= ratio else watch.failed(clock.step, found, diagnostics.joint_counts(blocks)[2])
            done = progress.get("done", False) or bool(reason)
            progress.update(watch=asdict(watch), done=done, ended=[reason, found])
        report.log_progress(blocks)
        if coupling.checkpoint_is_due(project):
            histories.flush(project)
            cracks.flush(project)
            checkpoints.write_checkpoint(project)
        if reason:  # a request is answered by the next command: nothing is left to do in this one
            break
        if request:
            _answer(project, request)
    histories.flush(project)
    cracks.flush(project)
    report.finish(blocks)
    over = "cycles" if clock.step >= last else "function" if progress.get("done") else "time"
    return reason or over, found, watch


def _to(project: Project, steps: int) -> int:
    """Take so many steps; return the request of a function, if any. Records are written before an error is raised."""
    try:
        return coupling.advance(project, steps)
    except (EquilibriumError, PhysicsError):
        histories.flush(project)
        cracks.flush(project)
        frames.write_last(project)
        raise


def _no_equilibrium(project: Project, watch: Watch, reason: str, ratio: float, found: float) -> str:
    """Describe a run that failed to converge, with the body that slides away. Collective."""
    step = project.step
    why = {
        "limit": f"after {step - watch.began} steps, the limit",
        "no progress": f"for {step - watch.progress} steps the ratio has not decreased by a tenth",
    }[reason]
    return (
        f"no equilibrium: {why}; the ratio is {found:.3g}, the least was {watch.least:.3g}, required {ratio:g}; "
        f"{_what_moves(project)}"
    )


def _what_moves(project: Project) -> str:
    """Describe the body that slides away, or state that none does. Collective."""
    body = convergence.sliding_body(project.blocks)
    if body is None:
        return "no body slides away: joints may still yield, loads may change, or rounding limits the ratio"
    return (
        f"{body} {'m/s' if project.dynamic else 'm per step'}: fix it, or allow more steps until it is at rest (window)"
    )


def _follow_step_table(project: Project) -> None:
    """The time step becomes what its table says, if it follows one."""
    if not project.step_table or not project.dynamic:
        return
    wanted = project.blocks.tables[project.step_table](project.blocks.clock.time)
    if wanted != project.blocks.options.dt:
        project.blocks.time_step(value=wanted)


def _settle_time_step(project: Project) -> None:
    """Give the clock the time step of the model as it is now: how many steps a time takes follows from it. Coupled
    blocks have the one that was settled with the particles."""
    if project.coupled is None:
        project.blocks.close_model()


def _within(project: Project, end: float) -> float:
    """Steps to the moment nearest to a model time, at least one. Near the end one at a time if dt may change on the
    way: where the run ends must not depend on where it was interrupted."""
    clock = project.blocks.clock
    if not math.isfinite(end):
        return math.inf
    steps = max(1, math.ceil((end - clock.time) / clock.dt - 0.5))
    return 1 if project.adapts and steps <= 2 * STRIDE else steps


def _intervals(project: Project) -> list[int]:
    return [history.every for history in project.histories.values()] + list(project.frames.values())


def stop_here(project: Project, request: int) -> None:
    """Stop between two commands if a signal or the time limit requested the end and no stepping command has responded.
    Collective; the request is the same on all ranks.
    """
    if request >= STOP:
        _answer(project, request)


def _answer_requests(project: Project) -> None:
    """Between two implicit steps: what was requested from outside, a checkpoint, perhaps the end. Collective."""
    if (stop := project.blocks.stop) is not None:
        _answer(project, int(project.comm.max_into(np.array([stop.local_request()], np.int64))[0]))


def _answer(project: Project, request: int) -> None:
    """A signal or the time limit requested a checkpoint, perhaps for the end."""

    def save(automatic: bool) -> Path:
        histories.flush(project)
        cracks.flush(project)
        return checkpoints.write_checkpoint(project, automatic=automatic)

    answer(project.blocks, request, save, partial(_onwards, project))


def _onwards(project: Project, path: Path) -> str:
    place = project.place()
    if place is not None and place["journal"] is not None:
        return "--resume"
    return project.resume_advice or f"pcdc model restore '{path}'"


class _Report:
    """Log of a run: a line at its beginning, one every QUIET_SECONDS, one at its end. A line of the script that runs
    repeatedly, as in a loop, reports every QUIET_SECONDS only."""

    def __init__(self, project: Project, name: str, last: float) -> None:
        self.project, self.name, self.last = project, name, last
        self.first = project.step if project.progress is None else project.progress["first"]
        self.began = self.logged_at = clocks.monotonic()
        self.began_step = self.reported_step = project.step
        before = project.logged_at.get(project.line)
        self.speaks = project.comm.bcast(before is None or self.began - before >= QUIET_SECONDS)
        where = f"line {project.line}: " if project.line else ""
        if project.log is not None and self.speaks:
            project.logged_at[project.line] = self.began
            project.log.info(f"{where}{name}")

    def log_progress(self, blocks: Blocks) -> None:
        """Collective: the line, if one is due."""
        now = clocks.monotonic()
        if self.project.log is not None:
            self.project.log.at(blocks.clock.step, self.name, self.first, self.last)
        if self.project.log is None or not self.project.comm.bcast(now - self.logged_at >= QUIET_SECONDS):
            return
        done = blocks.clock.step - self.reported_step
        speed = done / max(now - self.logged_at, 1e-9)
        left = f" | left {duration((self.last - blocks.clock.step) / speed)}" if self.last < math.inf and speed else ""
        under_way.poll(self.project.comm)
        elements = int(self.project.alive.sum())
        self.project.log.info(
            f"{self._state(blocks)} | {rate(speed)} steps/s, {rate(speed * elements)} element-steps/s{left}"
        )
        self.logged_at, self.reported_step, self.speaks = now, blocks.clock.step, True

    def _state(self, blocks: Blocks) -> str:
        clock = blocks.clock
        intact, yielded, broken = diagnostics.joint_counts(blocks)
        joints = f" | joints: {yielded} yielded, {broken} broken" if intact + yielded + broken else ""
        if deep := diagnostics.deep_overlaps(blocks):
            joints += f" | {deep} overlaps beyond {overlaps.DEEP:g} of an altitude"
        shown = partial(with_prefix, unit="s")
        time = f" | time {shown(clock.time, digits=6)}, time step {shown(clock.dt)}" if self.project.dynamic else ""
        if blocks.creep.on:
            time += f" | creep time {shown(blocks.creep.time, digits=6)}"
        if not blocks.options.mechanical:
            return f"step {clock.step}{time}{joints}"
        return f"step {clock.step}{time} | unbalanced force ratio {diagnostics.unbalanced_ratio(blocks):.3g}{joints}"

    def finish(self, blocks: Blocks) -> None:
        """Collective: how it ended."""
        if self.project.log is None or not self.speaks:
            return
        state, steps = self._state(blocks), blocks.clock.step - self.began_step
        spent = clocks.monotonic() - self.began
        speed = steps * int(self.project.alive.sum()) / max(spent, 1e-9)
        self.project.log.info(f"{state} | {counted(steps, 'step')} in {duration(spent)}, {rate(speed)} element-steps/s")
