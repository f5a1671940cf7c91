"""Penalty study: what joints of penalty P take from the stiffness of a body."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, ROCK, model, rectangle
from tests.cases.penalty import exact

E, NU = ROCK["young"], ROCK["poisson_ratio"]
STRESS = 1e-5 * E


def lattice(kind: str, n: int = 4) -> Mesh:
    """A patch of n x n cells of 1 cm, n even. Its two corners at the left belong to one element each."""
    d = 0.01
    if kind == "squares":
        return rectangle(n, n, n * d, n * d, kind="quad")
    if kind == "both":
        grid = rectangle(n, n, n * d, n * d, kind="quad")
        middle = len(grid.points) + np.arange(len(grid.cells))
        points = np.concatenate([grid.points, grid.centroids()])
        cells = [(c[k], c[(k + 1) % 4], m, -1) for c, m in zip(grid.cells, middle) for k in range(4)]
        ends = [{0, int(middle[0])}, {n, int(middle[n - 1])}]
        single = [next(k for k, c in enumerate(cells) if end <= set(c)) for end in ends]
        return Mesh.of(points, [c for k, c in enumerate(cells) if k not in single])
    rows, points = [], []
    for j in range(n + 1):
        count = n + 1 - j % 2
        rows.append(len(points) + np.arange(count))
        points += [(d * (i + 0.5 * (j % 2)), d * np.sqrt(0.75) * j) for i in range(count)]
    cells = []
    for j, (low, top) in enumerate(pairwise(rows)):
        if j % 2 == 0:
            cells += [(low[i], low[i + 1], top[i], -1) for i in range(n)]
            cells += [(low[i + 1], top[i + 1], top[i], -1) for i in range(n - 1)]
        else:
            cells += [(low[i], top[i + 1], top[i], -1) for i in range(n)]
            cells += [(low[i], low[i + 1], top[i + 1], -1) for i in range(n - 1)]
    return Mesh.of(np.array(points), cells)


def pulled(mesh: Mesh, penalty: float, sense: float = 1.0) -> Blocks:
    """At rest under uniaxial stress along y, far below the strength."""
    sim = model(mesh)
    sim.option(dynamic=False, collision=False, large_strain=False)
    properties = {
        **JOINT, "friction": 0.0, "tensile_strength": 1e4 * STRESS, "cohesion": 1e4 * STRESS, "gf1": 1e9, "gf2": 1e9,
        "penalty_normal": penalty, "penalty_shear": penalty, "penalty_overlay": penalty,
    }  # fmt: skip
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", properties)
    edges = mesh.edges()
    sim.stress_condition(edges.faces[~edges.inner, 0], yy=sense * STRESS)
    # Held against moving and turning, which takes no force, at two corners that belong to one element.
    left = np.flatnonzero(mesh.points[:, 0] == 0.0)
    corners = left[np.argsort(mesh.points[left, 1])][[0, -1]]
    assert (np.bincount(mesh.cells[mesh.cells >= 0])[corners] == 1).all()
    sim.velocity_condition(corners[:1], vx=0.0, vy=0.0)
    sim.velocity_condition(corners[1:], vx=0.0)
    assert convergence.solve(sim, ratio=1e-6, cycles=200000).reason == "ratio"
    return sim


def strains(sim: Blocks) -> tuple[float, float]:
    """Mean strain along y and along x, from the motion of elements of one shape and place in the lattice; the motion of
    these is affine."""
    mesh = sim.mesh
    x, y = mesh.centroids().T
    u, v = diagnostics.values(sim, "element_displacement_x"), diagnostics.values(sim, "element_displacement_y")
    real = (mesh.cells >= 0)[:, :, None]
    corners = np.where(real, mesh.points[mesh.cells] - mesh.centroids()[:, None, :], 0.0)
    shapes = np.unique(
        np.round(np.sort(corners[:, :, 0] + 1.7 * corners[:, :, 1], axis=1), 6), axis=0, return_inverse=True
    )
    along, across = [], []
    for shape in range(len(shapes[0])):
        of = np.flatnonzero(shapes[1].reshape(-1) == shape)
        matrix = np.column_stack([np.ones(len(of)), x[of], y[of]])
        for values, column, out in ((u, 1, across), (v, 2, along)):
            found, *_ = np.linalg.lstsq(matrix, values[of], rcond=None)
            assert np.abs(matrix @ found - values[of]).max() < 1e-3 * np.abs(values).max(), "affine"
            out.append(found[column])
    return float(np.mean(along)), float(np.mean(across))


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", exact.FACTORS)
@pytest.mark.parametrize(
    ("times", "sense"), [(1.0, 1.0), (10.0, 1.0), (10.0, -1.0), pytest.param(100.0, 1.0, marks=pytest.mark.slow)]
)
def test_stiffness_of_a_jointed_body(kind, times, sense):
    """1e-3: the law bends by stress / (4 strength) = 2.5e-5, strains are up to 3e-5, the balance is to 1e-6."""
    sim = pulled(lattice(kind), times * E, sense)
    along, across = strains(sim)
    assert sense * STRESS / along == pytest.approx(exact.stiffness(E, NU, times * E, kind), rel=1e-3)
    slack = (1.0 + exact.FACTORS[kind]) * STRESS / E
    assert across == pytest.approx(sense * exact.lateral(E, NU) * STRESS, abs=1e-3 * slack)


def test_values_of_the_formula_worked_out_by_hand():
    """E = 1, nu = 0.25: E' = 1.0666667; squares, P = E: 1.0666667/2.0666667; equilateral, P = 10 E: /1.1847521."""
    assert exact.stiffness(1.0, 0.25, 1.0, "squares") == pytest.approx(0.51612903)
    assert exact.stiffness(1.0, 0.25, 10.0, "equilateral") == pytest.approx(0.90032903, rel=1e-6)
    assert exact.stiffness(1.0, 0.25, 100.0, "both") == pytest.approx(1.0444, rel=1e-4)
