"""Bodies of tetrahedra for the tests."""

from __future__ import annotations

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.kernels.elements import TALLY
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.pre.mesh import structured_space

ROCK = {"density": 2700.0, "young": 50e9, "poisson_ratio": 0.25}
DENSITY = ROCK["density"]
LAME = SHEAR = 20e9
"""Its moduli [Pa]."""


def box(cells: tuple[int, int, int], size: tuple[float, float, float], split: int = 6, shaken: float = 0.0) -> Mesh:
    """From the origin; shaken: inner points are moved by up to so much of a cell."""
    made = structured_space.box(tuple(np.linspace(0.0, s, n + 1) for s, n in zip(size, cells)), split)
    if not shaken:
        return made
    points, step = made.points.copy(), np.array(size) / cells
    inner = ((points > 0.0) & (points < np.array(size))).all(axis=1)
    points[inner] += np.random.default_rng(7).uniform(-shaken, shaken, (int(inner.sum()), 3)) * step
    return Mesh.of(points, made.cells, made.groups, made.layers)


def hexes(cells: tuple[int, int, int], size: tuple[float, float, float], shaken: float = 0.0) -> Mesh:
    """The same of hexahedra."""
    made = structured_space.hexes(tuple(np.linspace(0.0, s, n + 1) for s, n in zip(size, cells)))
    if not shaken:
        return made
    points, step = made.points.copy(), np.array(size) / cells
    inner = ((points > 0.0) & (points < np.array(size))).all(axis=1)
    points[inner] += np.random.default_rng(7).uniform(-shaken, shaken, (int(inner.sum()), 3)) * step
    return Mesh.of(points, made.cells, made.groups, made.layers, macros=made.hexes)


def body(mesh: Mesh, dynamic: bool = True, **properties: float) -> Blocks:
    """An elastic one on one rank."""
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, **properties})
    sim.option(collision=False, dynamic=dynamic)
    return sim


def faces_on(mesh: Mesh, side: str) -> np.ndarray:
    """Numbers of the faces on a layer of the mesh."""
    edges = mesh.edges()
    return edges.faces[mesh.find_edges(edges, mesh.layers[side]), 0]


def nodes_on(mesh: Mesh, side: str) -> np.ndarray:
    """Numbers of its points."""
    return np.unique(mesh.layers[side])


def without_joints(threads: int) -> tuple:
    """The arguments of `tets.forces` about joints, where there are none."""
    ints, rows = np.zeros(0, np.int32), np.zeros((0, HISTORY))
    return (
        False, np.zeros(0), np.zeros((0, 3), np.int32), ints, ints, np.zeros(0, np.uint8), rows, ints, ints,
        np.zeros((1, 8)), np.zeros((1, 4)), False, np.zeros((1, 16)), 0, np.zeros((threads, TALLY), np.int64),
    )  # fmt: skip
