"""Memory that a model of blocks takes, foretold from what was measured (docs/scaling.md, "Memory of blocks")."""

from __future__ import annotations

from typing import NamedTuple

EMPTY = 140e6
"""Memory of a rank without a model, with its kernels and libraries [B]."""
OWN = {2: 650.0, 3: 1200.0}
"""Memory of all ranks together per element, by dimensions [B], with joints before their peak or without."""
NODE = {2: 205.0, 3: 230.0}
"""Memory of a node of the machine per element [B]: mesh, connectivity, the definition of the model."""
REBUILDING = 2.3
"""A rank takes so many times its own memory while storage is made again: old and new tables are there at once."""
MAKING = 800.0
"""Memory of the first rank of a node per element, while the mesh and its connectivity are made [B]."""


class Footprint(NamedTuple):
    """Bytes: of a rank while it steps, and at most; shared by the ranks of the node; of the node in all, at most."""

    rank: float
    most: float
    shared: float
    node: float


def expected(elements: int, dim: int, ranks: int, here: int) -> Footprint:
    """Estimate the memory of a model of so many elements, evenly distributed over so many ranks, `here` of them on a
    node."""
    own, shared = elements * OWN[dim] / ranks, elements * NODE[dim]
    most = max(here * REBUILDING * own, elements * MAKING)
    return Footprint(EMPTY + own, EMPTY + REBUILDING * own, shared, here * EMPTY + shared + most)
