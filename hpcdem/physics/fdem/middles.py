"""Centres of elements, which determine their order and their owners."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.physics.fdem import build
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.state import State


def middles(sim: State) -> tuple[np.ndarray, float]:
    """Means of the corners of the elements held here (n, 2), in space (n, 3) [m], and the largest distance of a
    corner from it."""
    middle = np.empty((len(sim.number), sim.dim))
    mesh = sim.the_mesh()
    if sim.dim == 3:
        radius = space.middles(sim.x, middle)
    else:
        radius = build.middles(sim.x, mesh.cells, sim.number, middle)
    return middle, max(radius, _gather_macros(sim, middle)) if len(mesh.macros) else radius


def _gather_macros(sim: State, middle: np.ndarray) -> float:
    """Parts of a macro-element get one middle (n, dim), the mean of theirs, so that they go together. Returns the
    largest distance of their corners from it. Collective."""
    mesh = sim.the_mesh()
    of, parts_of_one, dim = mesh.macro_of()[sim.number], mesh.macro.stored, sim.dim
    mine = np.flatnonzero(of >= 0)
    parts = [(sim.number[mine], middle[mine])]
    if sim.comm.size > 1:
        whole = np.bincount(of[mine], minlength=len(mesh.macros))[of[mine]] == parts_of_one
        if sim.comm.any(not whole.all()):
            parts = sim.comm.allgather((sim.number[mine], middle[mine]))
    number, middles = (np.concatenate([part[k] for part in parts]) for k in range(2))
    number, first = np.unique(number, return_index=True)
    means = middles[first].reshape(-1, parts_of_one, dim).mean(axis=1)
    middle[mine] = means[np.searchsorted(number[::parts_of_one], mesh.macros[of[mine], -1])]
    corners = sim.x[mine].reshape(-1, sim.x.shape[1] // sim.stride, sim.stride)[:, : dim + 1, :dim]
    offset = corners - middle[mine][:, None]
    return math.sqrt(float((offset * offset).sum(axis=2).max(initial=0.0)))
