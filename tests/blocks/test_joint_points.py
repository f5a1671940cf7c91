"""Stress at the points of a joint: closed forms of joints that are bent, sheared, past their peak; and what it takes
for a uniform stress to be uniform on all of them."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.kernels import joint_law
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.pre.mesh.triangulate import MeshSettings, Region, triangulate
from tests.blocks.support import JOINT, ROCK, jointed, model, rectangle
from tests.conftest import absent

H, T, P, OVERLAY = 0.1, JOINT["tensile_strength"], JOINT["penalty_normal"], 700e9
O_P = 2.0 * H * T / P
AT = np.array([-0.5, 0.0, 0.5]) * math.sqrt(0.6)  # of the length, from the middle (Gauss)
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
POINTS = [f"normal_stress_{point}" for point in ("first", "middle", "last")]


def two_squares(opening: float, slip: float, turn: float) -> Blocks:
    """One joint of length H along x, between a square below and one above that has been moved and turned about the
    middle of the joint: opening + turn x, x from the middle. The joint is numbered by the top of the lower square,
    which runs to the left."""
    sim = jointed(model(rectangle(1, 2, H, 2 * H, x0=-0.5 * H, kind="quad")), penalty_overlay=OVERLAY)
    sim.close_model()
    sim.open_model()
    at = diagnostics.homes(sim).reshape(-1, 4, 2)
    upper = at[:, :, 1].mean(axis=1) > H
    centre = np.array([0.0, H])
    around = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    at[upper] = (at[upper] - centre) @ around.T + centre + [slip, opening]
    sim.x[:, :8] = at.reshape(-1, 8)
    changes.repeat(sim, sim.x)
    return sim


@pytest.mark.parametrize("mean, turn", [(0.5, 0.5), (0.3, -0.6), (0.9, 0.1), (-0.5, 0.4), (0.0, 1.2)])
def test_a_bent_joint(mean, turn):
    """Opening o = mean + turn x/H (in o_p): T (2r - r2) where it opens, P_overlay o/H where it closes; the mean is that
    of the rule (5, 8, 5)/18, not the stress in the middle."""
    sim = two_squares(mean * O_P, 0.0, turn * O_P / H)
    r = mean + turn * AT[::-1]  # the first corner of the face is on the right, where x is largest
    expected = np.where(r > 0.0, T * (2.0 * r - r * r), OVERLAY * r * O_P / H)
    found = np.array([diagnostics.values(sim, name)[0] for name in POINTS])
    assert found == pytest.approx(expected, rel=2e-4, abs=T * 1e-5)
    assert diagnostics.values(sim, "normal_stress")[0] == pytest.approx(float(WEIGHTS @ found), rel=1e-9, abs=1e-3)
    assert diagnostics.values(sim, "normal_stress_largest")[0] == found.max()
    if mean == 0.5:
        # r = 0.5 (1 +- sqrt(0.6)/2) = 0.6936, 0.3064: 0.9061 T, 0.7500 T, 0.5189 T; mean 0.7292 T
        assert found / T == pytest.approx([0.9061, 0.75, 0.5189], abs=3e-4)
        assert diagnostics.values(sim, "normal_stress")[0] / T == pytest.approx(0.7292, abs=3e-4)


def test_a_bent_joint_past_its_peak():
    """One point at 1.5 o_p has lost 1 - f(D), D = 0.5 o_p / o_t, the others are before their peak. Looking does not
    change what the joint remembers."""
    turn = 0.7 / -float(AT[0])
    sim = two_squares(0.8 * O_P, 0.0, turn * O_P / H)  # r = 1.5, 0.8, 0.1
    o_t = JOINT["gf1"] / (joint_law.SOFTENING_AREA * T)
    expected = [T * joint_law.softening(0.5 * O_P / o_t), 0.96 * T, 0.19 * T]
    before = sim.local.slot_history.copy() if sim.closed else None
    for _ in range(2):
        assert [diagnostics.values(sim, name)[0] for name in POINTS] == pytest.approx(expected, rel=2e-4)
    assert diagnostics.values(sim, "normal_stress_largest")[0] == diagnostics.values(sim, "normal_stress_first")[0]
    assert diagnostics.values(sim, "damage")[0] == 0.0 and diagnostics.values(sim, "state")[0] == 1
    assert before is None or np.array_equal(before, sim.local.slot_history)


@pytest.mark.parametrize("part", [0.4, -0.7])
def test_a_sheared_joint(part):
    """tau = c (2q - q2) at all points, with the sign of the slip of the upper side along the face that the joint is
    numbered by (which runs to the left); the largest has none."""
    c = JOINT["cohesion"]
    s_p = 2.0 * H * c / P
    sim = two_squares(0.0, part * s_p, 0.0)
    tau = c * (2.0 * abs(part) - part * part)
    for name in ("shear_stress", "shear_stress_first", "shear_stress_middle", "shear_stress_last"):
        assert diagnostics.values(sim, name)[0] == pytest.approx(-math.copysign(tau, part), rel=2e-4)
    assert diagnostics.values(sim, "shear_stress_largest")[0] == pytest.approx(tau, rel=2e-4)
    assert abs(diagnostics.values(sim, "normal_stress_largest")[0]) < 1e-3 * T


def test_where_there_is_no_joint():
    """An edge without a joint has no stress; a quantity of joints is none of elements or nodes."""
    sim = model(rectangle(2, 1, 0.2, 0.1, kind="quad"))
    for name in (*POINTS, "normal_stress_largest", "shear_stress_largest"):
        assert np.isnan(diagnostics.values(sim, name)).all()
    with pytest.raises(CommandError, match="there is no quantity normal_stress_greatest"):
        diagnostics.values(sim, "normal_stress_greatest")
    with pytest.raises(CommandError, match="normal_stress_largest belongs to a joint, not to a element"):
        diagnostics.owned_values(sim, "element", ["normal_stress_largest"])


# ---- a uniform stress ----------------------------------------------------------------------------------------------


def pulled(mesh: Mesh, penalty: float) -> tuple[np.ndarray, np.ndarray]:
    """Uniaxial stress of 1 MPa along y on the ends of a rectangle, joints far below their peak: normal stress at the
    points (n, 3) of the joints over that of the uniform state, cos2 of their inclination; their levels y."""
    sim = jointed(model(mesh), tensile_strength=1e12, cohesion=1e12, gf1=1e9, gf2=1e9, penalty_normal=penalty)
    edges = mesh.edges()
    outside = edges.faces[~edges.inner, 0]
    y = mesh.points[edges.points[~edges.inner], 1].mean(axis=1)
    for side in (y.min(), y.max()):
        sim.stress_condition(outside[np.abs(y - side) < 1e-9], yy=1e6)
    sim.option(dynamic=False, collision=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=20_000).reason == "ratio"
    inner = edges.points[edges.inner]
    way = mesh.points[inner[:, 1]] - mesh.points[inner[:, 0]]
    found = np.column_stack([diagnostics.values(sim, name) for name in POINTS]) / 1e6
    return found - (way[:, 0] ** 2 / (way**2).sum(axis=1))[:, None], mesh.points[inner, 1].mean(axis=1)


def bar(smooth: bool) -> Mesh:
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")
    layers = Layers()
    layers.add("o", geometry.rectangle((0.0, 0.0), (0.01, 0.02)))
    return triangulate(layers, MeshSettings([Region("o")], 0.0015, irregular=True, smooth=smooth)).mesh


@pytest.mark.parametrize("penalty", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_a_uniform_stress_is_uniform_on_the_joints_of_a_smooth_mesh(penalty):
    """Every point of every joint has sigma cos2: a closed form for a mesh without any pattern, whatever the penalty."""
    off, _ = pulled(bar(True), penalty * ROCK["young"])
    assert np.abs(off).max() < 2e-4  # balance 1e-6, strain 2e-5


def test_in_another_mesh_it_is_not_and_a_stiffer_joint_does_not_help():
    """Jumps around a point add to nothing, so sum(h t) = 0 there: where the edges do not add to nothing, no penalty
    makes the stress uniform."""
    soft, stiff = (pulled(bar(False), k * ROCK["young"])[0] for k in (10.0, 100.0))
    assert np.abs(soft).max() > 0.15 and np.abs(stiff).max() > 0.15
    assert np.sqrt((stiff**2).mean()) > 0.7 * np.sqrt((soft**2).mean()) > 0.02
