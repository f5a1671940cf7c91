"""HIST, PLOT, DRAW: what to follow over time."""

from __future__ import annotations

from hpcdem.errors import CommandError
from hpcdem.output import HISTORIES
from hpcdem.simulation import Simulation

DRAW_INTERVAL = 1000
"""Steps between pictures where DRAW does not say."""


def hist(sim: Simulation, id: int, interval: int, what: str) -> None:
    """HIST: append `what` to hist_<id>.dat every `interval` steps."""
    if what not in HISTORIES:
        raise CommandError(f"HIST cannot follow {what}; it knows {', '.join(HISTORIES)}")
    if interval <= 0:
        raise CommandError(f"HIST INTERVAL must be positive, got {interval}")
    sim.history_wishes[id] = (interval, what)


def plot_hist(sim: Simulation, y: int, x: int) -> None:
    """PLOT: at STOP write history y against history x."""
    sim.plots.append((y, x))


def draw(sim: Simulation, interval: int | None, what: list[str]) -> None:
    """DRAW: `draw_<step>.jpg` every `interval` steps (in an IMPLE from its start), if the run was started with --draw.

    what: bfill ball wall bondc cforce bang bid mesh, by default filled particles and walls.

    Scripts draw far more often than pictures are looked at, so without --draw it is noted in the log only.
    """
    if interval is not None and interval <= 0:
        raise CommandError(f"DRAW INTERVAL must be positive, got {interval}")
    words = tuple(what) or ("bfill", "wall")
    # ZDEM draws particles as circles unless they are to be filled.
    sim.drawing = (interval or DRAW_INTERVAL, words if "bfill" in words else ("ball", *words))
    if not sim.draws and sim.log is not None:
        sim.log.info("DRAW: no pictures without the option --draw; zdem2jpg draws the frames of a finished run")
