"""Time in a model of blocks: how long a run takes, the clocks of blocks, fluid and heat, and how far they step."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcdem.commands.fdem import flow, settings
from hpcdem.commands.fdem.needed import needed
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant

MECHANICAL, THERMAL, HYDRAULIC, PROPPANT = PARTS = "mechanical", "thermal", "hydraulic", "proppant_transport"
"""Parts with a clock; proppant shares that of the fluid."""


def run_time(project: Project, time: float) -> None:
    """Set the longest time that model solve may take from now on [s]; 0: no limit."""
    if time < 0.0:
        raise CommandError(f"a run-time must not be negative, got {time:g}")
    project.run_time = time


def solve_check(project: Project, steps: int) -> None:
    """Set the number of steps between two evaluations of the ratio."""
    if steps < 1:
        raise CommandError(f"solve-check: a whole number above 0 is needed, got {steps}")
    project.check_every = steps


def cycle_option(project: Project, **parts: Mapping[str, Any]) -> None:
    """Set time_step [s] and cycle_number of each part in a cycle, see `PARTS`."""
    for part in (HYDRAULIC, PROPPANT):
        other = parts.get(HYDRAULIC if part == PROPPANT else PROPPANT, {})
        for name, value in parts.get(part, {}).items():
            if other.get(name, value) != value:
                raise CommandError(
                    f"proppant uses the steps of the fluid: {name} is {parts[HYDRAULIC][name]:g} for hydraulic and "
                    f"{parts[PROPPANT][name]:g} for proppant-transport"
                )
    for part, given in parts.items():
        if "time_step" in given:
            _time_step(project, part, given["time_step"])
        if "cycle_number" in given:
            word = HYDRAULIC if part == PROPPANT else part
            flow.sub_step(project, **{word: given["cycle_number"]})


def _time_step(project: Project, part: str, value: float) -> None:
    word: dict[str, Any] = {{MECHANICAL: "value", THERMAL: THERMAL}.get(part, HYDRAULIC): value}
    settings.time_step(project, **word)


def reset(project: Project, **parts: Mapping[str, Any]) -> None:
    """Set start_time, from which run-time counts, current_time and time_step [s] of parts, see `PARTS`. Collective."""
    project.refuse_inside("model reset")
    for part, given in parts.items():
        if "current_time" in given:
            _set_clock(project, part, given["current_time"])
        if "time_step" in given:
            _time_step(project, part, given["time_step"])
        if "start_time" in given:
            if part != MECHANICAL:
                _physics(project, part)
            project.began[part] = given["start_time"]


def _set_clock(project: Project, part: str, time: float) -> None:
    if not np.isfinite(time):
        raise CommandError(f"a time must be finite, got {time}")
    blocks = project.ready()
    if part == MECHANICAL:
        blocks.before_change()
        blocks.clock.time = time
        blocks.changed(stiffness=False)
        return
    if (grains := Proppant.there(blocks)) is not None and part != THERMAL:
        grains.time = time
    _physics(project, part).set_clock(time)


def _physics(project: Project, part: str) -> Any:
    """Return the physics whose clock is meant. Raises CommandError if the model lacks it."""
    if part == PROPPANT:
        needed(project, Proppant, use=False)
    return needed(project, Heat if part == THERMAL else Flow, use=False)


def time(project: Project, part: str) -> float:
    """Return the time of a part [s]; in static runs, that of blocks is creep time. Raises CommandError if the part has
    no clock of its own."""
    blocks = project.blocks
    if part == MECHANICAL:
        return float(blocks.clock.time if project.dynamic else blocks.creep.time)
    own = blocks.options.heat_dt if part == THERMAL else blocks.options.flow_dt
    if own > 0.0:
        word = part.replace("_", "-")
        raise CommandError(
            f"run-time uses the clock of the blocks, but {word} has its own time step ({own:g} s): synchronise it with "
            f"model reset {word} time-step 0"
        )
    return float(_physics(project, part).time)


def query(project: Project, **parts: Mapping[str, Any]) -> None:
    """Log the present time and the time step of these parts. Collective."""
    for part in parts:
        of = project.blocks.clock if part == MECHANICAL else _physics(project, part)
        step = f", time step {of.dt:.6g} s" if of.dt else ""
        if project.log is not None:
            project.log.info(f"{part.replace('_', '-')} time {of.time:.9g} s{step}")


def devices(project: Project) -> None:
    """Log the number of ranks and threads of the run. Collective."""
    ranks, threads = project.comm.size, project.blocks.threads
    if project.log is not None:
        project.log.info(
            f"{ranks} rank{'s' * (ranks > 1)} of {threads} thread{'s' * (threads > 1)} each; this host has "
            f"{os.cpu_count()} processors"
        )
