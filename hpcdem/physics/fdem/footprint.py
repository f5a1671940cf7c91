"""Memory that a model of blocks takes, foretold from what was measured (docs/scaling.md, "Memory of blocks")."""

from __future__ import annotations

from typing import NamedTuple

EMPTY = 140e6
"""Memory of a rank without a model, with its kernels and libraries [B]."""
OWN = {2: 650.0, 3: 660.0}
"""Memory of an owned element, by dimensions [B], in space without joints."""
OF_JOINTS = 140.0
"""Additional memory of an element in space with joints before their peak [B]."""
GHOST = {False: 320.0, True: 470.0}
"""What ranks in space have beyond their even share, per ghost of `ghosts`, without and with joints [B]: ghosts, forces
of other ranks, contacts on both sides and their exchange; in the plane these are few."""
LAYER = 1.75
"""Thickness of the ghosts around a piece of the curve, in sides of a cube of six tetrahedra."""
NODE = {2: 205.0, 3: 230.0}
"""Memory of a node of the machine per element [B]: mesh, connectivity, the definition of the model."""
REBUILDING = {2: 2.3, 3: 1.3}
"""Factor of the memory of a rank while its storage is renewed, by dimension: old and new arrays exist at once."""
MAKING = 330.0
"""Memory of the first rank of a node per element, while the mesh and its connectivity are made [B]."""


class Footprint(NamedTuple):
    """Bytes: of a rank while it steps, and at most; shared by the ranks of the node; of the node in all, at most."""

    rank: float
    most: float
    shared: float
    node: float


def ghosts(elements: float, ranks: int) -> float:
    """Estimate the ghosts of a rank with so many elements in space: a layer around a cube, where it does not end at the
    surface of the body, a cube of the cubes of all ranks."""
    side = (elements / 6.0) ** (1.0 / 3.0)
    return elements * ((1.0 + 2.0 * LAYER / side) ** 3 - 1.0) * (1.0 - ranks ** (-1.0 / 3.0))


def expected(elements: int, dim: int, ranks: int, here: int, joints: bool = False) -> Footprint:
    """Estimate the memory of a model of so many elements, evenly distributed over so many ranks, `here` of them on a
    node; joints: it has joints."""
    each = elements / ranks
    own, shared = each * OWN[dim], elements * NODE[dim]
    if dim == 3:
        own += each * OF_JOINTS * joints + GHOST[joints] * ghosts(each, ranks)
    again = REBUILDING[dim] * own
    most = max(here * again, elements * MAKING)
    return Footprint(EMPTY + own, EMPTY + again, shared, here * EMPTY + shared + most)
