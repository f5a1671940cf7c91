"""Blocks that deform, crack and collide: the combined finite-discrete element method.

`Blocks` is the simulation. The method can be read in `simulation.py`: state, step, rebuild. What a model is made of is
in `definition.py`, the tables of the kernels are made in `local.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcdem.physics.fdem import saved_state
from hpcdem.physics.fdem.convergence import Moving, Solved, Watch
from hpcdem.physics.fdem.diagnostics import QUANTITIES, Quantity
from hpcdem.physics.fdem.equilibrium import Balanced, Equilibrium

__all__ = ["Balanced", "Blocks", "Moving", "QUANTITIES", "Quantity", "Solved", "Watch"]


class Blocks(Equilibrium):
    """One model of blocks on one communicator. Every method is collective unless it says otherwise.

    Numbers are those of the mesh, from 0, and know no ranks: elements are rows of `mesh.cells`, nodes are rows of
    `mesh.points`, faces are element * 4 + local edge, joints have the number of their lower face. Arguments called
    elements, nodes, faces, joints take an array of numbers, or None for all. What is said of a node holds for all
    corners of elements at that point, and stays with them when joints break.

    CommandError for values that make no sense, equal on all ranks.
    """

    def save(self, path: Path | str, extra: Mapping[str, Any] | None = None) -> None:
        """Write the whole state, and `extra` (JSON values) with it. Reads only."""
        saved_state.save(self, path, extra or {})

    def restore(self, path: Path | str) -> dict[str, Any]:
        """Take the state of a file, on any number of ranks and threads; returns `extra`. CommandError if the file is
        missing, foreign or damaged; the simulation is then as it was."""
        return saved_state.restore(self, path)
