"""The static mode: dynamic relaxation to the same state as motion with damping, with contact, holes and quads."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, ROCK, joined, jointed, model, rectangle, shaken

RHO = ROCK["density"]


def leaning(kind: str, with_joints: bool = False) -> Blocks:
    """A bed on rollers, one side loaded on its upper half, under its own weight."""
    mesh = shaken(rectangle(8, 6, 0.8, 0.6, kind=kind), 0.2)
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9, "damp_factor": 0.5})
    if with_joints:
        jointed(sim, penalty_normal=1e11, tensile_strength=1e9, cohesion=1e9)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0)
    edges = mesh.edges()
    ends = mesh.points[edges.points]
    right = (ends[:, :, 0] > 0.8 - 1e-9).all(axis=1) & (ends[:, :, 1] > 0.3 - 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[right, 0], xx=-1e5, xy=2e4)
    sim.gravity(0.0, -9.81)
    sim.option(collision=False)
    return sim


@pytest.mark.parametrize("kind, with_joints", [("cross", False), ("quad", False), ("mixed", True)])
def test_at_rest_and_after_motion_stresses_agree(kind, with_joints):
    """To 0.5 % of the largest stress, as specified for elastic bodies."""
    sim = leaning(kind, with_joints)
    sim.option(dynamic=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=50000).reason == "ratio"
    rest = {name: diagnostics.values(sim, name) for name in ("stress_xx", "stress_yy", "stress_xy")}
    moved = leaning(kind, with_joints)
    while moved.clock.time < 0.05:
        convergence.advance(moved, 500)
    assert diagnostics.unbalanced_ratio(moved) < 1e-4
    scale = max(np.abs(values).max() for values in rest.values())
    for name, values in rest.items():
        assert diagnostics.values(moved, name) == pytest.approx(values, abs=0.005 * scale)


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", ["cross", "quad"])
@pytest.mark.parametrize("with_joints", [False, True])
def test_a_block_rests_on_a_slope(kind, with_joints):
    """20 degrees, friction 30 degrees: the base carries the whole weight, both components, and nothing slides; cells of
    the base are half as high as those of the block."""
    base = rectangle(8, 2, 1.6, 0.2, x0=-0.3, y0=-0.2, kind=kind)
    block = rectangle(5, 3, 1.0, 0.6, kind=kind)
    mesh = joined(block, base)
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9})
    edges = mesh.edges()
    if with_joints:
        inner = edges.faces[edges.inner][:, 0]
        sim.joint_model(inner[inner < 4 * len(block.cells)], "classic_intrinsic_cohesive_interface",
                        {**JOINT, "penalty_normal": 1e10})  # fmt: skip
    sim.face_model(None, "contact_mohr_coulomb", {"friction": 30.0, "penalty_normal": 1e10})
    own = np.arange(len(mesh.points)) >= len(block.points)
    held = np.flatnonzero(own & (mesh.points[:, 1] < -0.2 + 1e-9))
    sim.velocity_condition(held, vx=0.0, vy=0.0)
    slope = math.radians(20.0)
    sim.gravity(9.81 * math.sin(slope), -9.81 * math.cos(slope))
    sim.option(dynamic=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=20000).reason == "ratio"
    weight = RHO * 9.81 * (0.6 + 0.32)
    assert diagnostics.total(sim, "reaction_x", held) == pytest.approx(-weight * math.sin(slope), rel=1e-4)
    assert diagnostics.total(sim, "reaction_y", held) == pytest.approx(weight * math.cos(slope), rel=1e-4)
    assert np.abs(diagnostics.values(sim, "displacement_x")).max() < 1e-4


def test_rollers_on_an_oblique_line_do_not_resist():
    """Local damping acts on the force along the line, not on what the line carries: a body on a plane of 30 degrees
    that leans against another one comes to rest, in the state of the static solve; both carry its weight."""
    turn = math.radians(30.0)
    along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    flat = rectangle(4, 3, 0.8, 0.6)
    mesh = Mesh.of(flat.points @ np.array([along, across]), flat.cells)
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9})
    x, y = flat.points.T
    low = np.flatnonzero((y < 1e-9) & (x > 1e-9))
    sim.move_constraint(low, 2, tuple(along))
    sim.move_constraint(np.flatnonzero((x < 1e-9) & (y > 1e-9)), 2, tuple(across))
    sim.move_constraint(np.flatnonzero((x < 1e-9) & (y < 1e-9)), 1)
    sim.gravity(0.0, -9.81)
    sim.option(dynamic=False, collision=False)
    assert convergence.solve(sim, ratio=1e-9, cycles=20000).reason == "ratio"
    weight = RHO * 9.81 * 0.48
    corner = np.flatnonzero((x < 1e-9) & (y < 1e-9))
    carried = np.array([diagnostics.total(sim, f"reaction_{c}", np.union1d(low, corner)) for c in "xy"])
    assert carried[1] + diagnostics.total(sim, "reaction_y", np.flatnonzero((x < 1e-9) & (y > 1e-9))) == pytest.approx(
        weight, rel=1e-8
    )
    other = model(mesh)
    other.element_property(None, {"young": 1e9})
    other.move_constraint(low, 2, tuple(along))
    other.move_constraint(np.flatnonzero((x < 1e-9) & (y > 1e-9)), 2, tuple(across))
    other.move_constraint(corner, 1)
    other.gravity(0.0, -9.81)
    other.option(dynamic=False, collision=False)
    equilibrium.solve_elastic(other)
    for name in ("stress_xx", "stress_yy", "stress_xy"):
        expected = diagnostics.values(other, name)
        assert diagnostics.values(sim, name) == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert diagnostics.unbalanced_ratio(sim) < 1e-9


@pytest.mark.slow
def test_what_is_removed_is_released_slowly():
    """With `relax` the balance is kept at first and lost bit by bit; in the end all forces are gone."""
    sim = leaning("mixed", True)
    sim.option(dynamic=False)
    convergence.solve(sim, ratio=1e-7, cycles=50000)
    before = diagnostics.values(sim, "stress_yy")
    hole = np.flatnonzero(np.hypot(*(sim.mesh.centroids() - [0.4, 0.3]).T) < 0.12)
    changes.null(sim, hole, relax=1000)
    assert diagnostics.unbalanced_ratio(sim) < 1e-6  # the forces left behind stand for the elements
    convergence.advance(sim, 1)
    assert diagnostics.values(sim, "stress_yy")[~np.isin(np.arange(len(before)), hole)] == pytest.approx(
        np.delete(before, hole), abs=1e-3 * np.abs(before).max()
    )
    convergence.advance(sim, 1000)
    assert convergence.solve(sim, ratio=1e-6, cycles=50000).reason == "ratio"
    gone = leaning("mixed", True)
    gone.option(dynamic=False)
    changes.null(gone, hole)
    assert diagnostics.unbalanced_ratio(gone) > 1e-3
    convergence.solve(gone, ratio=1e-6, cycles=50000)
    rest = np.setdiff1d(np.arange(len(before)), hole)
    for name in ("stress_xx", "stress_yy", "stress_xy"):
        assert diagnostics.values(sim, name, rest) == pytest.approx(
            diagnostics.values(gone, name, rest), abs=2e-3 * np.abs(before).max()
        )


def test_mixed_discretisation_lets_quads_bend():
    """Hourglass u_x = +-a of a unit square: volume changes of both triangles of an overlay cancel, so the energy is
    that of their distortion, e = (-a, a, a): 2 mu (a^2 + a^2 + 2 a^2) / 2 = 4 mu a^2, whatever lambda is. Two triangles
    alone store lambda (2 a)^2 / 2 + mu (4 a^2 + 2 a^2) instead."""
    for nu in (0.0, 0.3, 0.49):
        for kind in ("quad", "cross"):
            sim = model(rectangle(1, 1, 1.0, 1.0, kind=kind))
            changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "poisson_ratio": nu})
            sim.option(dynamic=False, collision=False, large_strain=False)
            a = 1e-6
            for node, sign in zip(range(4), (1.0, -1.0, -1.0, 1.0)):  # (0, 0), (0, 1), (1, 0), (1, 1)
                sim.velocity_condition([node], vx=sign * a, vy=0.0)
            sim.step()
            mu = ROCK["young"] / (2.0 * (1.0 + nu))
            lame = 2.0 * mu * nu / (1.0 - 2.0 * nu)
            plain = 0.5 * lame * (2.0 * a) ** 2 + mu * (4.0 * a * a + 2.0 * a * a)
            expected = 4.0 * mu * a * a if kind == "quad" else plain
            assert diagnostics.total(sim, "strain_energy") == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_cantilever_of_quads_approaches_the_beam():
    """Load at the end, plane strain: w = P L^3 (1 - nu^2) / (3 E I) + 1.2 P L / (G A). Linear shape functions are too
    stiff; what is missing falls with the square of the size."""
    length, height, load = 1.0, 0.1, 1e3
    modulus, shear = ROCK["young"] / (1.0 - 0.25**2), ROCK["young"] / 2.5
    beam = load * length**3 / (3.0 * modulus * height**3 / 12.0) + 1.2 * load * length / (shear * height)
    missing = []
    for n in (2, 4):
        mesh = rectangle(10 * n, n, length, height, kind="quad")
        sim = model(mesh)
        x = mesh.points[:, 0]
        sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0, vy=0.0)
        end = np.flatnonzero(x > length - 1e-9)
        for node in end:
            outer = mesh.points[node, 1] < 1e-9 or mesh.points[node, 1] > height - 1e-9
            sim.force_condition([node], fy=-load / (n * (2 if outer else 1)))
        sim.option(dynamic=False, collision=False)
        assert convergence.solve(sim, ratio=1e-6, cycles=100000).reason == "ratio"
        missing.append(1.0 + float(diagnostics.values(sim, "displacement_y", end).mean()) / beam)
    assert 0.0 < missing[1] < 0.1 and missing[0] / missing[1] == pytest.approx(4.0, rel=0.25)
