"""SET."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hpcdem.commands import units
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import hint
from hpcdem.core.outputs import OUTPUTS
from hpcdem.physics.dem.kernels.mass import SPHERES
from hpcdem.physics.dem.simulation import Simulation

INTERVALS = ("stepbar", "energy", *OUTPUTS)
NUMBERS: dict[str, tuple[type, Callable[[Any], bool], str]] = {
    **{
        name: (float, lambda value: math.isfinite(value) and value > 0.0, f"{name} must be positive")
        for name in ("dt", "frac", "gentry", "thickness")
    },
    "lsm": (float, lambda value: not value < 0.0, "damp lsm must not be negative"),
    "restitution": (float, lambda value: 0.0 < value <= 1.0, "restitution must be above 0 and not above 1"),
    "seed": (int, lambda value: not value < 0, "seed must not be negative"),
}
"""Type of each number, its condition, and the text of the message if it is not fulfilled."""
STEPS = {"dt": "frac", "frac": "dt"}
"""Settings that exclude each other: both define the time step."""
CHOICES = {"disk": tuple(SPHERES), "wallside": ("left", "both"), "rolling": ("a", "c")}


def set_option(sim: Simulation, name: str, value: Any) -> None:
    """Set one option of model.settings.Settings, in SI units; intervals in steps (0 or less: off)."""
    s = sim.settings
    if name in NUMBERS:
        kind, holds, wanted = NUMBERS[name]
        if not holds(value):
            raise CommandError(f"SET {wanted}, got {value if isinstance(value, int) else format(value, 'g')}")
        setattr(s, name, kind(value))
        if name in STEPS:  # the last of the two that is set holds
            setattr(s, STEPS[name], 0.0)
    elif name in CHOICES:
        if value not in CHOICES[name]:
            raise CommandError(f"SET {name}: expected {' or '.join(CHOICES[name])}, got {value}")
        setattr(s, name, value)
    elif name in INTERVALS:
        _set_interval(sim, name, value)
    elif name == "gravity":
        s.gx, s.gy = map(float, value)
    elif name == "units":
        s.units = units.declared(s.units, value, sim.log, late=bool(len(sim.walls) or sim.count(len(sim.particles))))
    elif name == "outdir":
        sim.outdir, sim.folder_made = Path(value), False
    else:
        known = ("gravity", *CHOICES, *NUMBERS, *INTERVALS, "units", "outdir")
        raise CommandError(f"SET has no option {name}{hint(name, known)}; available: {', '.join(known)}")
    sim.tables_changed()


def _set_interval(sim: Simulation, name: str, value: float) -> None:
    """Steps between two outputs, 0 or less: none."""
    s = sim.settings
    if name == "energy" and value > 0 and (law := sim.own_laws.unaccounted()):
        raise CommandError(
            f"SET energy: the stored energy of the law {law} is not known: define it with pair_law(energy=)"
        )
    setattr(s, name, max(int(value), 0))
    if name == "stepbar" and sim.log is not None:
        sim.log.set_interval(explicit=s.stepbar > 0)
    if name == "energy" and s.energy == 0:
        sim.energy = None
