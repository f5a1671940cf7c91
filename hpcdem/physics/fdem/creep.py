"""Creep steps of static runs, and the switch of creep. In dynamic runs elements creep by each time step.

A creep step: the stress of the present positions is what it begins with (`begin`); the model is brought into balance,
by relaxation or at once, with elements that creep for dt at their new positions (kernels/creep.py); then they remember
it (`finish`). It ends at the balance that is requested, so the stress at its end is as good as that.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.kernels import creep as kernels
from hpcdem.physics.fdem.kernels import elements
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.properties import KELVIN_STRAIN
from hpcdem.physics.fdem.structures import Structure
from hpcdem.physics.fdem.topology import finite

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

RANGE = 100.0
"""Factor of the bounds of adaptive creep steps: the given step over this, and times this, unless other bounds are
given."""
FASTEST = 2.0
"""Largest ratio of a creep step to the one before."""
FULL = 1.0 - 1e-9
"""Fraction of the remaining time from which on a creep step is extended to the end."""
PER_STEP = ", which in static runs acts per step and not in creep time: use a dynamic run"


def switch(
    sim: Blocks,
    on: bool,
    dt: float | None = None,
    change: float | None = None,
    least: float | None = None,
    greatest: float | None = None,
) -> None:
    """Elements creep from now on, or no more; the time that they have crept is kept. Collective.

    dt: creep step of static runs [s]. change: the creep step follows the change of stress: the largest change of the
    deviator in an element, or in the dashpot of its Kelvin unit, in a creep step, over the largest deviator of all,
    shall be about this; then dt is the first step, least and greatest are its bounds (dt / 100, 100 dt). A step in
    which more changed is not repeated: the next one is up to FASTEST times as short."""
    given = {"dt": dt, "change": change, "least": least, "greatest": greatest}
    numbers = {name: float(finite(name, [value])[0]) for name, value in given.items() if value is not None}
    if not on and numbers:
        raise CommandError(f"creep off does not accept {next(iter(numbers))}")
    for name, value in numbers.items():
        if value <= 0.0:
            raise CommandError(f"{name} of creep must be positive, got {value:g}")
    follows = [name for name in ("change", "least", "greatest") if name in numbers]
    if follows and "dt" not in numbers:
        raise CommandError(f"{follows[0]} of creep needs dt, the first creep step")
    if follows and "change" not in numbers:
        raise CommandError(
            f"{follows[0]} of creep limits a creep step that is adapted to the change of stress: add change"
        )
    if numbers.get("change", 0.0) >= 1.0:
        raise CommandError(f"change of creep is a fraction of the largest stress, below 1, got {numbers['change']:g}")
    step = numbers.get("dt", 0.0)
    low, high = numbers.get("least", step / RANGE), numbers.get("greatest", RANGE * step)
    if not low <= step <= high:
        raise CommandError(f"dt of creep, {step:g} s, must lie between least, {low:g} s, and greatest, {high:g} s")
    sim.before_change()
    sim.drop_creep_step()
    if not follows:
        low = high = 0.0
    sim.creep = replace(sim.creep, on=on, dt=step, change=numbers.get("change", 0.0), least=low, greatest=high)
    sim.changed(stiffness=False)


def check(sim: Blocks, time: float) -> None:
    """CommandError if the model cannot creep for this time [s] in a static run."""
    if not sim.creep.on:
        raise CommandError("time does not pass in static runs: use ratio or cycles; or model creep on")
    if not sim.creeping().any():
        raise CommandError("no element can creep: assign element c-model mech-burgers first")
    if sim.creep.dt == 0.0:
        raise CommandError("static runs need the length of a creep step: model creep on dt")
    if not time > 0.0:
        raise CommandError(f"time must be positive, got {time}")
    cells = sim.the_mesh().cells.reshape(-1)
    of = np.where(np.repeat(sim.alive, 4) & (cells >= 0), sim.corner_row, 0)
    for row in np.unique(of).tolist():
        one = sim.acting()[row]
        for axis in "xyz"[: sim.dim]:
            does, at = getattr(one, f"does_{axis}"), getattr(one, f"at_{axis}")
            if does != moving.FREE and at != 0.0 and one.constraint != moving.FIXED:
                point = int(cells[of == row].min())
                raise CommandError(f"node {point} has a prescribed motion in {axis}{PER_STEP}")
    for load in sim.surface_loads:
        if isinstance(load, Structure) and (node := load.driven()) is not None:
            raise CommandError(f"{load.parts[1]} {node} has a prescribed motion{PER_STEP}")


def begin(sim: Blocks, end: float) -> None:
    """A creep step begins, which goes to the creep time `end` [s] at most. Collective."""
    clock = sim.creep
    sim.close_model()
    sim.local.creeping.keep()
    left = end - clock.time
    clock.passed = left if left * FULL <= clock.dt else clock.dt
    _warn_of_long_step(sim)


def finish(sim: Blocks, end: float) -> None:
    """The model is in balance: the creep step is done, and elements remember it. Collective."""
    sim.close_model()
    clock, local = sim.creep, sim.local
    if sim.comm.any(bool(local.tally[:, elements.NEW_BROKEN].any())):
        sim._renew_lists()  # joints that broke did so in this creep step
    before = sim.cold["creep"].copy()
    local.creeping.keep()
    whole = end - clock.time <= clock.passed
    done, clock.time = clock.passed, end if whole else clock.time + clock.passed
    clock.passed = 0.0
    clock.steps += 1
    if clock.change > 0.0:
        found = _change(sim, before) * clock.dt / done
        best = clock.change / found if found > 0.0 else math.inf
        clock.dt = min(max(clock.dt * min(max(best, 1.0 / FASTEST), FASTEST), clock.least), clock.greatest)


def _change(sim: Blocks, before: np.ndarray) -> float:
    """Largest change of the deviator of an element, and of that in the dashpot of its Kelvin unit, in the creep step
    that is done, over the largest deviator of all. Equal on all ranks. Collective."""
    local, after = sim.local, sim.cold["creep"]
    found = np.zeros(2)
    n = len(KELVIN_STRAIN[sim.dim])
    stress, kelvin = list(kernels.BEFORE[:n]), list(kernels.IN_KELVIN[:n])
    for (old, law), (new, _) in zip(local.creeping.memory(before), local.creeping.memory(after)):
        if not len(law):
            continue
        table = local.creeping.table[law]
        stress_change = new[:, stress] - old[:, stress]
        unit = table[:, kernels.PER_KELVIN, None] > 0.0
        rest = np.where(
            unit, stress_change - 2.0 * table[:, kernels.KELVIN, None] * (new[:, kelvin] - old[:, kelvin]), 0.0
        )
        found[0] = max(found[0], _size(stress_change).max(), _size(rest).max())
        found[1] = max(found[1], _size(new[:, stress]).max(), _size(old[:, stress]).max())
    change, largest = sim.comm.max_into(found).tolist()
    return change / largest if largest > 0.0 else 0.0


def _size(s: np.ndarray) -> np.ndarray:
    """sqrt(s : s) of deviators (n, 3) 11, 22, 12, in space (n, 5) with 13, 23."""
    return np.sqrt(s[:, 0] ** 2 + s[:, 1] ** 2 + (s[:, 0] + s[:, 1]) ** 2 + 2.0 * (s[:, 2:] ** 2).sum(axis=1))


def _warn_of_long_step(sim: Blocks) -> None:
    """A line in the log about Kelvin units that a creep step takes beyond their rest."""
    if sim.log is None:
        return
    table = sim.local.creeping.table[np.unique(sim.element_row[sim.creeping()])]
    longest = 2.0 / float((table[:, kernels.KELVIN] * table[:, kernels.PER_KELVIN]).max(initial=1e-300))
    if sim.creep.passed > longest:
        sim.log.warn_once(
            "long creep step",
            f"the creep step {sim.creep.passed:g} s is above 2 eta_K / G_K = {longest:g} s: strains of Kelvin units "
            "oscillate about equilibrium. Use a shorter creep step",
        )
