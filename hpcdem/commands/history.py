"""HIST, PLOT, DRAW: what to follow over time."""

from __future__ import annotations

from hpcdem.errors import CommandError
from hpcdem.output import HISTORIES
from hpcdem.simulation import Simulation


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


def draw(sim: Simulation, interval: int, what: list[str]) -> None:
    """DRAW: screen drawing of ZDEM; noted in the log only."""
    if sim.log is not None:
        sim.log.info("DRAW is not needed here: frames are drawn from the files by zdem2jpg")
