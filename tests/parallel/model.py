"""A model that must come to the same bits on any number of ranks and threads, and across restarts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.halo.comm import MpiComm
from hpcdem.physics.fdem import convergence, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.runtime import kept

kept.install()  # else each worker and each of its ranks compiles every kernel for itself

Found = dict[str, np.ndarray]
"""What became of a model: all that may not depend on ranks, and `about`, which may."""


def communicator() -> Any:
    from mpi4py import MPI

    return MpiComm(MPI.COMM_WORLD) if MPI.COMM_WORLD.Get_size() > 1 else SerialComm()


def nothing(sim: Any) -> None:
    """No commands."""


@dataclass(frozen=True)
class Model:
    """Blocks. make: puts them into an empty simulation; result: what became of them (collective), with the notes that
    were taken on the way; much: asserts that much has happened to them, of the result; meanwhile: commands before every
    step; prepare: commands before they are made or restored; balance: borders follow the load; come: at least so many
    elements come from another rank, of `about`; slow: a model of the slow tests. A checkpoint is written before step
    `middle`."""

    make: Callable[[Any], None]
    result: Callable[[Any, dict[str, Any]], Found]
    much: Callable[[Found], None]
    meanwhile: Callable[[Any], None] = nothing
    prepare: Callable[[Any], None] = nothing
    balance: bool = True
    steps: int = 1500
    middle: int = 701
    come: int = 0
    slow: bool = False

    def empty(self, threads: int) -> Any:
        """An empty simulation on all ranks."""
        sim = Blocks(communicator(), threads, balance_on=self.balance)
        self.prepare(sim)
        return sim

    def begin(self, threads: int) -> Any:
        """The model at step 0."""
        sim = self.empty(threads)
        self.make(sim)
        return sim

    def save(self, sim: Any, path: Path) -> None:
        """Write a checkpoint."""
        saved_state.save(sim, path)

    def resume(self, threads: int, path: Path) -> Any:
        """The model as it was saved."""
        sim = self.empty(threads)
        saved_state.restore(sim, path)
        return sim

    def step(self, sim: Any) -> int:
        """Steps that are done."""
        return sim.clock.step

    def advance(self, sim: Any, notes: dict[str, Any]) -> None:
        """Do a step, and take notes."""
        convergence.advance(sim, 1)
        if "first" not in notes:
            notes["first"] = set(sim.number[sim.owned].tolist())

    def release(self, sim: Any) -> None:
        """The end of it."""
        sim.release()


def run(model: Model, threads: int, save: Path | None, resume: Path | None) -> Found:
    """From step 0 or from a checkpoint to the end, with a checkpoint from the middle of it. Collective."""
    sim = model.begin(threads) if resume is None else model.resume(threads, resume)
    notes: dict[str, Any] = {}
    while model.step(sim) < model.steps:
        if save is not None and model.step(sim) == model.middle:
            model.save(sim, save)
        model.meanwhile(sim)
        model.advance(sim, notes)
    found = model.result(sim, notes)
    model.release(sim)
    return found
