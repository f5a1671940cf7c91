"""The kinds of fault: each module enters its own into the table."""

from faults.kind import KINDS, Kind
from faults.kinds import checkpoints, clock, disk, kill, signals, slurm, together

__all__ = ["KINDS", "Kind", "checkpoints", "clock", "disk", "kill", "signals", "slurm", "together"]
