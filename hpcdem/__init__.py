"""hpcdem: discrete elements for rock and sand, on any number of ranks.

::

    import hpcdem

    sim = hpcdem.Simulation()
    sim.gen(2000, rad=[60.0, 80.0], x=(0.0, 20e3), y=(0.0, 10e3), group="sand")
    sim.cycle(5000)

See `hpcdem.Simulation` and docs/python.md. Names are loaded when they are first used: the environment has to be
settled before numpy, numba and MPI come in.
"""

from __future__ import annotations

import importlib
from typing import Any

_NAMES = {
    "Simulation": "hpcdem.api",
    "couple": "hpcdem.api",
    "frames": "hpcdem.api",
    "Sweep": "hpcdem.sweep",
    "element_law": "hpcdem.physics.fdem.user_laws",
    "Property": "hpcdem.physics.fdem.properties",
    "StateVariable": "hpcdem.physics.user_files",
    "pair_law": "hpcdem.physics.dem.user_laws",
    "PairProperty": "hpcdem.physics.dem.user_laws",
    "HpcdemError": "hpcdem.core.errors",
    "version": "hpcdem.runtime.launch",
}
__all__ = list(_NAMES)


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        return getattr(importlib.import_module(_NAMES[name]), name)
    raise AttributeError(f"module 'hpcdem' has no attribute '{name}'; it has {', '.join(_NAMES)}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_NAMES])
