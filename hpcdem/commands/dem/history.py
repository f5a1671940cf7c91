"""HIST, PLOT, DRAW: what to follow over time."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.commands.dem.output import followed
from hpcdem.core.errors import CommandError
from hpcdem.physics.dem import mean_stress
from hpcdem.physics.dem.platens import OF_PARTS
from hpcdem.physics.dem.simulation import Simulation

DRAW_INTERVAL = 1000
"""Default interval of DRAW [steps]."""


def hist(sim: Simulation, id: int, interval: int, what: str) -> None:
    """HIST: record a quantity every `interval` steps in hist_id_<id>.dat and hist_<id>.csv: kinetic, step, time,
    unbalanced, contacts, bonds, energy, deflection, period, sxx, syy or sxy, or "gstress group a", "gstrain group a|b",
    "xstress wall 3", "ystrain wall 0|3". Strains are zero at this command.
    """
    if interval <= 0:
        raise CommandError(f"HIST INTERVAL must be positive, got {interval}")
    if what == "energy" and (law := sim.own_laws.unaccounted()):
        raise CommandError(f"energy: the stored energy of the law {law} is not known: define it with pair_law(energy=)")
    if what == "deflection" and not sim.bases:
        raise CommandError("deflection: no base bends yet; give FLEXURE first")
    if what == "period" and not sim.settings.period:
        raise CommandError("period: the sides are not periodic yet; give PERIODIC first")
    if what in mean_stress.COMPONENTS:
        mean_stress.heights(sim)
    sim.history_origins.pop(id, None)
    name = what.split()[0] if what.split() else ""
    if name in OF_PARTS:
        origin = OF_PARTS[name].begin(sim, what)
        if origin is not None:
            sim.history_origins[id] = origin
    elif what not in followed(sim):
        raise CommandError(f"HIST cannot follow {what}; it supports {', '.join((*followed(sim), *OF_PARTS))}")
    sim.history_requests[id] = (interval, what)


def plot_hist(sim: Simulation, y: int, x: int) -> None:
    """PLOT: at `finish`, write history y against history x."""
    sim.plots.append((y, x))


def draw(sim: Simulation, interval: int | None, what: list[str], off: Sequence[str] = ()) -> None:
    """DRAW: write `draw_<step>.jpg` every `interval` steps (in an IMPLE from its start), if the run was started with
    --draw.

    what: bfill bline ball wall bondc cforce bang bid mesh (default: filled particles and walls); off: words of this
    list to omit.

    Scripts request far more figures than are viewed; without --draw the command only adds a line to the log.
    """
    if interval is not None and interval <= 0:
        raise CommandError(f"DRAW INTERVAL must be positive, got {interval}")
    words = [*(what or ("bfill", "wall"))]
    # ZDEM draws particles as circles unless they are to be filled.
    if "bline" in words or ("bfill" not in words and "bline" not in off):
        words.append("ball")
    sim.drawing = (interval or DRAW_INTERVAL, tuple(word for word in words if word not in (*off, "bline")))
    if not sim.draws and sim.log is not None:
        sim.log.info("DRAW: no pictures without the option --draw; zdem2jpg draws the frames of a finished run")
