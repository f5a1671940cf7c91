"""Which elements of other ranks a rank holds: ghosts, with positions and velocities, and those *beyond* them, which
have nodes in common with owned elements and nothing else. Of the latter it has forces at these nodes (node_set.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.halo.beyond import Beyond
from hpcdem.halo.exchange import Sends
from hpcdem.physics.fdem.kernels import detect_space, tets
from hpcdem.physics.fdem.pairs_space import Surface

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def _alike(sim: State) -> bool:
    """Return whether no elements are set apart: on one rank, and in strips of the plane, whose ghosts are few."""
    return sim.dim == 2 or sim.comm.size == 1


def inner(sim: State, number: np.ndarray) -> np.ndarray:
    """Return which of the elements (n,) meet others only where they share corners, bool: no corner of them is on the
    surface, where they can touch other bodies, or at a face with a joint. Collective."""
    if _alike(sim):
        return np.zeros(len(number), bool)
    out = np.ones(len(number), bool)
    if sim.options.collision:
        out &= Surface.of(sim).first[number] < 0
    if sim.joint_row.any():
        out &= ~sim.per_node(lambda: _points_of_joints(sim))[sim.the_mesh().cells[number]].any(axis=1)
    return out


def _points_of_joints(sim: State) -> np.ndarray:
    """Return which points of the mesh (np,) are corners of faces with joints, bool."""
    mesh = sim.the_mesh()
    out = np.zeros(len(mesh.points), bool)
    out[mesh.face_points(np.flatnonzero(sim.joint_row > 0))] = True
    return out


def boxes(sim: State, order: np.ndarray, inside: np.ndarray) -> np.ndarray | None:
    """Boxes (n, 6) [m] of the elements in this order, in the plane None: those of elements that one rank must hold
    overlap. Middles lie in boxes, so boxes of partners of a joint are not farther apart than these. inside: see
    `inner`."""
    if _alike(sim):
        return None
    out, mesh = np.empty((len(order), 6)), sim.the_mesh()
    for some, margin in ((np.flatnonzero(inside), sim.linked_within), (np.flatnonzero(~inside), sim.apart_within)):
        part = np.empty((len(some), 6))
        detect_space.boxes(tets.ROW * order[some, None] + tets.STRIDE * np.arange(4), sim.x, margin, part)
        out[some] = part
    if len(mesh.macros):  # all parts of one go together
        of = mesh.macro_of()[sim.number[order]]
        some = np.flatnonzero(of >= 0)
        which = np.unique(of[some], return_inverse=True)[1]
        whole = np.full((len(some), 6), np.inf)
        out[:, 3:] *= -1.0
        np.minimum.at(whole, which, out[some])
        out[some] = whole[which]
        out[:, 3:] *= -1.0
    return out


def owners(sim: State, number: np.ndarray) -> np.ndarray:
    """Return the ranks (n,) of elements that are owned, ghosts or beyond, -1 of others; the model is closed."""
    row = sim.where[number]
    return np.where(row >= 0, np.append(sim.halo.owners(), -1)[row], sim.beyond.owners(number))


def set_apart(sim: State, number: np.ndarray, inside: np.ndarray, sends: Sends) -> tuple[Beyond, Sends]:
    """Distinguish elements beyond from ghosts. number (n,): of owned elements, in the order of the storage; inside: see
    `inner`; sends: those that other ranks need. Returns which are beyond, and those that become ghosts. Collective."""
    if _alike(sim) or sim.surface_loads or len(sim.the_mesh().macros):
        return Beyond.nobody(sim.comm), sends  # other physics need positions of all
    rows = {p: np.arange(of.start, of.stop) if isinstance(of, slice) else of for p, of in sends.items()}
    found = Beyond.of(sim.comm, number, {p: of[inside[of]] for p, of in rows.items()})
    return found, {p: of[~inside[of]] for p, of in rows.items()}
