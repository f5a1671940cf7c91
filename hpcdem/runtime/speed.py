"""Speed of this machine: the rate of the last run here, stored with the compiled kernels.

The rate is in particle-steps per second and core. It depends on the model (contacts, bonds, output), so it is kept for
Hertz and linear particles apart, and good for "minutes or days", not for more.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from contextlib import suppress
from pathlib import Path

from hpcdem.runtime.kept import cache_base

DEFAULT = 10e6
"""Rate of one core when no run has been measured [particle-steps/s]."""
KINDS = ("hertz", "linear")
SHORTEST = 5.0
"""Runs of fewer seconds tell nothing [s]."""
SMALLEST = 2e8
"""Nor do runs of fewer particle-steps: in a small model it is not the particles that take the time."""


def _file() -> Path:
    return cache_base() / "speed.json"


def _known() -> dict[str, float]:
    """Read the stored rates; empty without a file or plausible values."""
    try:
        found = json.loads(_file().read_text(encoding="utf-8"))
        return {kind: float(found[kind]) for kind in KINDS if kind in found and _sensible(float(found[kind]))}
    except (OSError, ValueError, TypeError, KeyError):
        return {}


def _sensible(rate: float) -> bool:
    return math.isfinite(rate) and rate > 0.0


def remember(rate: float, kind: str) -> None:
    """Keep the rate of a run [particle-steps/s per core] of "hertz" or "linear" particles.

    Silent where it cannot be written: a run is not spoilt by this.
    """
    if kind not in KINDS or not _sensible(rate):
        return
    with suppress(OSError):
        path = _file()
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix="speed-")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                json.dump({**_known(), kind: rate}, file)
            os.replace(name, path)
        except OSError:
            with suppress(OSError):
                os.remove(name)


def remember_run(particle_steps: int, seconds: float, cores: int, kind: str) -> None:
    """Keep the rate of a finished run, if it was long enough: all its particle-steps, its wall time, and the cores that
    its ranks and threads had."""
    if seconds >= SHORTEST and particle_steps >= SMALLEST:
        remember(particle_steps / seconds / max(cores, 1), kind)


def recall(kind: str) -> tuple[float, bool]:
    """The rate of the last run of this kind, else of the other kind, and True; DEFAULT and False if there was none."""
    known = _known()
    for name in (kind, *KINDS):
        if name in known:
            return known[name], True
    return DEFAULT, False
