"""Patch tests: a linear displacement at the surface gives the same strain in every element, whatever the mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics
from tests.blocks.support import EVERY_KIND, ROCK, jointed, model, rectangle, shaken

LAMBDA, MU = 20e9, 20e9  # E = 50 GPa, nu = 0.25
STRAIN = np.array([[2e-4, 1e-4], [1e-4, -3e-4]])


def boundary(mesh) -> np.ndarray:
    edges = mesh.edges()
    return np.unique(edges.points[~edges.inner])


def prescribe(sim, gradient: np.ndarray, steps: int = 100) -> None:
    """Move the surface by gradient @ X in so many steps, then hold it."""
    sim.option(dynamic=False, collision=False)
    outside = boundary(sim.mesh)
    way = sim.mesh.points[outside] @ gradient.T / steps
    for node, (vx, vy) in zip(outside, way.tolist()):
        sim.velocity_condition(np.array([node]), vx=vx, vy=vy)
    convergence.advance(sim, steps)
    sim.velocity_condition(outside, vx=0.0, vy=0.0)


@EVERY_KIND
def test_linear_displacement_gives_uniform_stress(kind):
    """sigma = lambda tr(e) + 2 mu e with e = U - 1 of F = 1 + gradient, to 1e-10 of E."""
    sim = model(shaken(rectangle(5, 4, 1.0, 0.8, kind=kind), 0.25))
    prescribe(sim, STRAIN)
    convergence.advance(sim, 2000)
    assert diagnostics.unbalanced_ratio(sim) < 1e-10
    expected = LAMBDA * np.trace(STRAIN) * np.eye(2) + 2.0 * MU * STRAIN
    for name, (i, j) in {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}.items():
        assert diagnostics.values(sim, f"stress_{name}") == pytest.approx(expected[i, j], abs=1e-10 * ROCK["young"])
    assert diagnostics.values(sim, "stress_zz") == pytest.approx(LAMBDA * np.trace(STRAIN), abs=1e-10 * ROCK["young"])
    for axis, column in (("x", 0), ("y", 1)):
        linear = sim.mesh.points @ STRAIN.T[:, column]
        assert diagnostics.values(sim, f"displacement_{axis}") == pytest.approx(
            linear, abs=1e-10 * np.abs(linear).max()
        )


@EVERY_KIND
def test_rigid_rotation_leaves_no_stress(kind):
    """A free body turned by 360 degrees in 36 turns: stress below 1e-9 E throughout."""
    sim = model(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
    jointed(sim)
    sim.close_model()
    for step in range(1, 37):
        angle = math.radians(10.0 * step)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        sim.open_model()
        home = diagnostics.homes(sim).reshape(-1, 4, 2) @ turn.T + np.array([3.0, -2.0])
        columns = 4 if sim.wide else 3
        sim.x[:, : 2 * columns] = home[:, :columns].reshape(len(home), -1)
        changes.repeat(sim, sim.x)
        for name in ("xx", "yy", "xy", "zz"):
            assert np.abs(diagnostics.values(sim, f"stress_{name}")).max() < 1e-9 * ROCK["young"]
        assert np.abs(diagnostics.values(sim, "normal_stress")).max() < 1e-9 * ROCK["young"]


def test_joints_in_series_soften_the_patch():
    """Uniaxial strain of a column of squares with joints of penalty P: M_eff = M / (1 + M / (P n h / L))."""
    n, height = 8, 0.8
    mesh = rectangle(1, n, 0.1, height, kind="quad")
    sim = model(mesh)
    p = 10.0 * ROCK["young"]
    jointed(sim, penalty_normal=p, tensile_strength=1e12, cohesion=1e12, gf1=1e9, gf2=1e9)
    sim.option(dynamic=False, collision=False)
    y = mesh.points[:, 1]
    top, bottom = np.flatnonzero(y > height - 1e-9), np.flatnonzero(y < 1e-9)
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(bottom, vy=0.0)
    sim.velocity_condition(top, vy=-1e-6)
    convergence.advance(sim, 100)
    sim.velocity_condition(top, vy=0.0)
    assert convergence.solve(sim, ratio=1e-8, cycles=50000).reason == "ratio"
    m = LAMBDA + 2.0 * MU
    # n - 1 joints of length h = 0.1 and stiffness P / h in series with the column.
    effective = m / (1.0 + m * (n - 1) * 0.1 / (p * height))
    strain = -1e-4 / height
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(effective * strain, rel=1e-6)
    assert diagnostics.total(sim, "reaction_y", top) == pytest.approx(effective * strain * 0.1, rel=1e-6)
