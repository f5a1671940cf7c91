"""Costs of explicit and implicit steps of flow: estimates for one core that do not depend on the machine or the number
of ranks (a choice by measured times could not be repeated).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hpcdem.physics.flow.model import Flow

SUB_STEP, CHANNEL = 15e-6, 11e-9
"""Wall time of a sub-step of flow [s], and per channel of it."""
STEP, ELEMENT = 20e-6, 70e-9
"""Wall time of a step of blocks [s], and per element of it, with its joints."""
ITERATION, UNKNOWN = 5e-3, 14e-6
"""Wall time of an iteration of Newton's method [s], and per unknown of it: forces, matrix, factors."""
FORCES, DENSE = 4e-6, 3.3e-11
"""Wall time with condensed elements [s]: per unknown for forces and elimination, and per cube of the number of unknowns
that remain."""
ITERATIONS = 5
"""Number of iterations of an implicit step that the estimate assumes."""
LONG = 1800.0
"""Estimated wall time [s] of an explicit run above which a warning is issued."""


@dataclass(frozen=True)
class Cost:
    """steps of dt [s] of flow, cycles of blocks that go with them (0: they are at rest), seconds on one core."""

    steps: float
    dt: float
    cycles: float
    seconds: float

    def __str__(self) -> str:
        return f"{self.steps:.3g} steps of {self.dt:.3g} s, about {_length(self.seconds)}"


def _length(seconds: float) -> str:
    for unit, name in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * unit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds:.2g} s"


def explicit(flow: Flow, time: float) -> Cost | str:
    """Estimate the cost of flow time [s] by sub-steps as set, or as stable now (fractures that open need shorter ones).
    Returns the reason if that is impossible. The model is closed. Collective."""
    o, blocks = flow.blocks.options, flow.blocks
    if not o.mechanical and not o.dynamic:
        return "without mechanics the time of flow advances in dynamic runs only"
    if o.mechanical and not o.dynamic:
        if o.flow_dt == 0.0:
            return "static runs need model time-step hydraulic, which is not set"
        stable = 2.0 * flow.limit()
        if o.flow_dt > time:
            return f"sub-steps of {o.flow_dt:.3g} s are longer than the time"
        if o.flow_dt > stable:
            return f"model time-step hydraulic is {o.flow_dt:.3g} s, above the stability limit {stable:.3g} s"
        steps, dt = cycles(flow, time) * max(1, o.flow_steps) / o.flow_every, o.flow_dt
        of_blocks = float(cycles(flow, time))
    else:
        dt = flow.dt
        if dt > time:
            return f"sub-steps of {dt:.3g} s are longer than the time"
        steps, of_blocks = time / dt, time / blocks.clock.dt if o.mechanical else 0.0
    seconds = steps * (SUB_STEP + CHANNEL * len(flow.network.channels))
    seconds += of_blocks * (STEP + ELEMENT * len(blocks.the_mesh().cells))
    return Cost(steps, dt, of_blocks, seconds)


def cycles(flow: Flow, time: float) -> int:
    """Steps of a static run in which so much flow time [s] passes. Not collective."""
    o = flow.blocks.options
    return o.flow_every * math.ceil(time / (max(1, o.flow_steps) * o.flow_dt) * (1.0 - 1e-12))


def implicit(time: float, dt: float, unknowns: int, kept: int) -> Cost:
    """Estimate the cost of flow time [s] by steps of at most dt [s], without additional ones for joints that break in
    sequence. kept: unknowns left by condensation, 0: without it."""
    steps = math.ceil(time / dt * (1.0 - 1e-12))
    iteration = ITERATION + (FORCES * unknowns + DENSE * kept**3 if kept else UNKNOWN * unknowns)
    return Cost(steps, time / steps, 0.0, steps * ITERATIONS * iteration)
