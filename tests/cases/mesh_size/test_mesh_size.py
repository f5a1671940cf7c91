"""Mesh-size study, elastic part: errors of displacement and stress on four meshes. (The part with cracks is with the
beam.)"""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence, diagnostics
from tests.blocks.support import ROCK, Blocks, Mesh, model, rectangle
from tests.cases.mesh_size import exact

E, NU = ROCK["young"], ROCK["poisson_ratio"]


def quarter(n: int, kind: str) -> Mesh:
    """A quarter of the ring, n elements around, rows that grow with the radius."""
    rows = max(2, round(n * np.log(exact.B / exact.A) / (0.5 * np.pi)))
    flat = rectangle(rows, n, 1.0, 1.0, kind=kind)
    r = exact.A * (exact.B / exact.A) ** flat.points[:, 0]
    t = 0.5 * np.pi * flat.points[:, 1]
    return Mesh.of(np.column_stack([r * np.cos(t), r * np.sin(t)]), flat.cells)


def solved(n: int, kind: str) -> Blocks:
    mesh = quarter(n, kind)
    sim = model(mesh)
    sim.option(dynamic=False, collision=False, large_strain=False)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(np.abs(x) < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(np.abs(y) < 1e-9), vy=0.0)
    edges = mesh.edges()
    inside = (np.hypot(*mesh.points[edges.points].transpose(2, 0, 1)) < exact.A + 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[inside & ~edges.inner, 0], normal=-exact.P)
    assert convergence.solve(sim, ratio=1e-7, cycles=100000).reason == "ratio"
    return sim


def errors(n: int, kind: str) -> tuple[float, float]:
    """Error of the displacement of nodes and of the stress of elements, mean squares over the largest exact value."""
    sim = solved(n, kind)
    mesh = sim.mesh
    x, y = mesh.points.T
    r = np.hypot(x, y)
    u = (diagnostics.values(sim, "displacement_x") * x + diagnostics.values(sim, "displacement_y") * y) / r
    wanted = exact.moved(r, E, NU)
    moved = np.sqrt(np.mean((u - wanted) ** 2)) / wanted.max()
    cx, cy = mesh.centroids().T
    t, radius = np.arctan2(cy, cx), np.hypot(cx, cy)
    s_r, s_t = exact.stress(radius)
    xx, yy, area = (
        diagnostics.values(sim, "stress_xx"),
        diagnostics.values(sim, "stress_yy"),
        diagnostics.values(sim, "area"),
    )
    found = (
        xx * np.cos(t) ** 2 + yy * np.sin(t) ** 2 + 2.0 * diagnostics.values(sim, "stress_xy") * np.sin(t) * np.cos(t)
    )
    stress = np.sqrt(np.average((found - s_r) ** 2 + (xx + yy - found - s_t) ** 2, weights=area)) / (2 * exact.P)
    return float(moved), float(stress)


@pytest.mark.parametrize("kind", ["cross", pytest.param("quad", marks=pytest.mark.slow)])
def test_order_of_convergence(kind):
    """Slopes of log(error) over log(size) between 8 and 32 elements: 2 for displacements, at least 1 for stresses."""
    found = np.log([errors(n, kind) for n in (8, 16, 32)])
    orders = -np.polyfit(np.log([8, 16, 32]), found, 1)[0]
    print(kind, np.exp(found), orders)
    assert orders[0] == pytest.approx(2.0, abs=0.25)
    assert orders[1] > 0.9
