"""Shells on bodies, and on none: sheets of triangles whose rock was taken out."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.liners import kernels_space, shells
from hpcdem.physics.liners.model import Liners
from tests.liners.support import SHOTCRETE
from tests.space.support import body


def bodies(points: np.ndarray, triangles: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """A tetrahedron below each triangle, which is counter-clockwise from above, and one far away; the faces above, in
    the order of triangles."""
    corner = points[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    below = corner.mean(axis=1) - normal / np.sqrt(np.linalg.norm(normal, axis=1))[:, None]
    far = 1e3 + np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    n, m = len(points), len(triangles)
    cells = np.column_stack([triangles[:, [0, 2, 1]], n + np.arange(m)])
    mesh = Mesh.of(np.concatenate([points, below, far]), [*cells.tolist(), list(range(n + m, n + m + 4))])
    rows = mesh.edges()
    found = rows.faces[mesh.find_edges(rows, triangles), 0]
    return mesh, found


def sheet(
    points: np.ndarray, triangles: np.ndarray, dynamic: bool = False, **properties: float
) -> tuple[Blocks, Liners]:
    """Nothing holds it; its elements are those of the triangles, its nodes numbered as the points are met in them."""
    mesh, faces = bodies(np.asarray(points, np.float64), np.asarray(triangles))
    sim = body(mesh, dynamic)
    sim.move_constraint(None, 1)
    liners = Liners.of(sim)
    _, elements = liners.create(faces)
    liners.assign(elements, {**SHOTCRETE, **properties})
    changes.null(sim, faces // 4)
    return sim, liners


def grid(nx: int, ny: int, lx: float, ly: float, shaken: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a rectangle in z = 0; shaken: inner points are moved by up to so much of a cell."""
    x, y = np.meshgrid(np.linspace(0.0, lx, nx + 1), np.linspace(0.0, ly, ny + 1), indexing="ij")
    points = np.column_stack([x.reshape(-1), y.reshape(-1), np.zeros(x.size)])
    inner = (points[:, 0] > 0.0) & (points[:, 0] < lx) & (points[:, 1] > 0.0) & (points[:, 1] < ly)
    step = np.random.default_rng(4).uniform(-shaken, shaken, (int(inner.sum()), 2))
    points[inner, :2] += step * [lx / nx, ly / ny]
    at = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    a, b, c, d = (part.reshape(-1) for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def ring(around: int, radius: float, width: float, layers: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A tube about the y axis, its triangles seen from inside."""
    points, triangles = grid(around, layers, 1.0, width)
    angle = 2.0 * math.pi * points[:, 0]
    points = np.column_stack([radius * np.cos(angle), points[:, 1], radius * np.sin(angle)])
    closed = np.arange(len(points))
    closed[-(layers + 1) :] = np.arange(layers + 1)  # the last points are the first
    return points[: -(layers + 1)], closed[triangles]


def sphere(times: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """An octahedron whose triangles were divided into four so many times, seen from outside."""
    points = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
    triangles = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    for _ in range(times):
        sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        some, of = np.unique(sides, axis=0, return_inverse=True)
        middle = points[some].mean(axis=1)
        d, e, f = (len(points) + of.reshape(-1, 3)).T
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1)[:, None]])
        a, b, c = triangles.T
        triangles = np.concatenate([np.column_stack(t) for t in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))])
    return radius * points, triangles


def stiffness(liners: Liners) -> np.ndarray:
    """(6 n, 6 n) of all nodes, of the elements as they lie: x, y, z and the rotations about them [N/m, N m]."""
    kind, ends = liners.kind, liners.elements["ends"]
    assert isinstance(kind, shells.Shells)
    each = shells.stiffnesses(kind.table, liners.elements["rest"], kind.curve)
    out = np.zeros((6 * len(liners), 6 * len(liners)))
    for e, nodes in enumerate(ends):
        turn = np.kron(np.eye(6), kind.frame[e])
        at = (6 * nodes[:, None] + np.arange(6)).reshape(-1)
        out[np.ix_(at, at)] += turn.T @ each[e] @ turn
    return out


def at_rest(liners: Liners, forces: np.ndarray, held: np.ndarray, weak: bool = False) -> np.ndarray:
    """Displacements and rotations (n, 6) under forces and moments (n, 6) where held (n, 6) bool are 0; they are done,
    so that the elements have their forces. weak: by the least of them, where a body may move as a whole."""
    free, moved = ~held.reshape(-1), np.zeros(forces.size)
    k, f = stiffness(liners)[np.ix_(free, free)], forces.reshape(-1)[free]
    moved[free] = np.linalg.lstsq(k, f, rcond=1e-12)[0] if weak else np.linalg.solve(k, f)
    done(liners, moved.reshape(-1, 6))
    return moved.reshape(-1, 6)


def done(liners: Liners, moved: np.ndarray) -> np.ndarray:
    """Move and turn the nodes by (n, 6); returns the work of what flowed."""
    nodes, kind, work = liners.nodes, liners.kind, np.zeros(5)
    nodes["x"] += moved[:, :3]
    for posture, turn in zip(nodes["posture"], moved[:, 3:], strict=True):
        kernels_space.turned(posture, turn, 1.0)
    kind.bend(work)
    kind.frames(liners._frame)
    liners._find_forces()
    return work


def pressed(liners: Liners, pressure: float) -> np.ndarray:
    """(n, 6) nodal forces of a pressure on the side away from the rock [Pa]."""
    ends, x, out = liners.elements["ends"], liners.nodes["x"], np.zeros((len(liners), 6))
    corner = x[ends]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    for k in range(3):
        np.add.at(out[:, :3], ends[:, k], -pressure * normal / 6.0)
    return out
