"""SET."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from hpcdem.commands import units
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import hint
from hpcdem.core.outputs import OUTPUTS
from hpcdem.physics.dem.kernels.mass import SPHERES
from hpcdem.physics.dem.simulation import Simulation

INTERVALS = ("stepbar", "energy", *OUTPUTS)
POSITIVE = ("dt", "frac", "gentry", "thickness")
CHOICES = {"disk": tuple(SPHERES), "wallside": ("left", "both")}


def set_option(sim: Simulation, name: str, value: Any) -> None:
    """Set one option of model.settings.Settings; SI units, intervals in steps (0 or less: off)."""
    s = sim.settings
    if name == "gravity":
        s.gx, s.gy = map(float, value)
    elif name in CHOICES:
        if value not in CHOICES[name]:
            raise CommandError(f"SET {name}: expected {' or '.join(CHOICES[name])}, got {value}")
        setattr(s, name, value)
    elif name in POSITIVE:
        if not (math.isfinite(value) and value > 0.0):
            raise CommandError(f"SET {name} must be positive, got {value:g}")
        setattr(s, name, float(value))
        if name == "dt":
            s.frac = 0.0
        elif name == "frac":
            s.dt = 0.0
    elif name in INTERVALS:
        if name == "energy" and value > 0 and (law := sim.own_laws.unaccounted()):
            raise CommandError(f"SET energy: what the law {law} stores is not known: pair_law(energy=) says it")
        setattr(s, name, max(int(value), 0))
        if name == "stepbar" and sim.log is not None:
            sim.log.set_interval(explicit=s.stepbar > 0)
        if name == "energy" and s.energy == 0:
            sim.energy = None
    elif name == "lsm":
        if value < 0.0:
            raise CommandError(f"SET damp lsm must not be negative, got {value:g}")
        s.lsm = float(value)
    elif name == "restitution":
        if not 0.0 < value <= 1.0:
            raise CommandError(f"SET restitution must be above 0 and not above 1, got {value:g}")
        s.restitution = float(value)
    elif name == "seed":
        if value < 0:
            raise CommandError(f"SET seed must not be negative, got {value}")
        s.seed = int(value)
    elif name == "units":
        s.units = units.declared(s.units, value, sim.log, late=bool(len(sim.walls) or sim.count(len(sim.particles))))
    elif name == "outdir":
        sim.outdir, sim.folder_made = Path(value), False
    else:
        known = ("gravity", *CHOICES, *POSITIVE, *INTERVALS, "lsm", "restitution", "seed", "units", "outdir")
        raise CommandError(f"SET has no option {name}{hint(name, known)}; there are {', '.join(known)}")
    sim.tables_changed()
