"""SAV and RES: the whole state to a file and back, bit for bit, on any number of ranks."""

from __future__ import annotations

from pathlib import Path

from hpcdem.physics.dem import saved_state
from hpcdem.physics.dem.simulation import Simulation


def save(sim: Simulation, file: Path | str) -> None:
    """SAV: write the state to a checkpoint of this name."""
    saved_state.save(sim, file)


def restore(sim: Simulation, file: Path | str) -> None:
    """RES: load a checkpoint written by SAV; the script continues with its next line."""
    saved_state.restore(sim, file)
    sim.restored = Path(file), sim.clock.step
    if sim.energy is not None and sim.energy.running:
        sim.energy.pause(sim)  # the CYC in which the file was written is not taken up
