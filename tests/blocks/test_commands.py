"""Commands that look at a model or change it between steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.diagnostics import QUANTITIES
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import ROCK, joined, jointed, model, rectangle, shaken
from tests.pcdc.fake import Noted


def pulled(steps: int = 0) -> Blocks:
    """A column of quads torn apart at once in the middle."""
    sim = jointed(model(rectangle(2, 6, 0.2, 0.6, kind="quad")), gf1=1.0, gf2=10.0)
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 0.6 - 1e-9), vx=0.0, vy=1.0)
    convergence.advance(sim, steps)
    return sim


def test_a_reset_forgets_damage_and_leaves_broken_joints_broken():
    """Yielded joints are whole again, without history, and yield again by more of the same; broken ones, and a crack
    that was there from the beginning, stay open: faces, events, forces. A brittle column is torn beside a tough one."""
    column = {"nx": 2, "ny": 6, "width": 0.2, "height": 0.6, "kind": "quad"}
    sim = jointed(model(joined(rectangle(**column), rectangle(**column, x0=1.0))), gf1=500.0, gf2=5000.0)
    joints, y = sim.numbers_of_joints(None), sim.mesh.points[:, 1]
    left = joints[sim.mesh.points[sim.mesh.cells[joints // 4, 0], 0] < 0.5]
    sim.joint_property(left, {"gf1": 1.0, "gf2": 10.0})
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 0.6 - 1e-9), vx=0.0, vy=1.0)
    while not (diagnostics.joint_counts(sim)[1] and diagnostics.joint_counts(sim)[2]):
        convergence.advance(sim, 1)
    changes.crack(sim, sim.numbers_of_joints(None)[:1])
    _, yielded, broken = diagnostics.joint_counts(sim)
    damage, events = diagnostics.values(sim, "damage"), diagnostics.events(sim)["joint"]
    assert ((damage > 0.0) & (damage < 1.0)).any() and len(events) == broken
    changes.reset_joint_state(sim)
    after = diagnostics.values(sim, "damage")
    assert diagnostics.joint_counts(sim)[1:] == (0, broken) and np.array_equal(diagnostics.events(sim)["joint"], events)
    assert (
        np.array_equal(after == 1.0, diagnostics.values(sim, "state") == 3.0)
        and not ((after > 0.0) & (after < 1.0)).any()
    )
    free = ~sim.closed_faces()[events]
    assert free.all() and not sim.closed_faces()[sim.numbers_of_joints(None)[0]]
    convergence.advance(sim, 40)
    assert diagnostics.joint_counts(sim)[1] > 0 and diagnostics.joint_counts(sim)[2] >= broken


def test_velocities_and_displacements_are_reset_where_they_are_asked_for():
    sim = pulled(100)
    some = np.arange(6)
    before = diagnostics.values(sim, "velocity_y")
    assert np.abs(before).max() > 0.0
    changes.reset_velocity(sim, some)
    after = diagnostics.values(sim, "velocity_y")
    assert (after[some] == 0.0).all() and np.array_equal(after[6:], before[6:])
    place, stress = diagnostics.values(sim, "position_y"), diagnostics.values(sim, "stress_yy")
    changes.reset_displacement(sim, some)
    assert (diagnostics.values(sim, "displacement_y", some) == 0.0).all()
    assert np.abs(diagnostics.values(sim, "displacement_y")).max() > 0.0
    assert np.array_equal(diagnostics.values(sim, "position_y"), place) and np.array_equal(
        diagnostics.values(sim, "stress_yy"), stress
    )


def test_tractions_can_be_taken_back():
    """A plate at rest under pressure flies off when it is taken from one side only."""
    mesh = rectangle(2, 2, 0.2, 0.2)
    sim = model(mesh)
    edges = mesh.edges()
    ends = mesh.points[edges.points]
    outer = ~edges.inner
    sim.stress_condition(edges.faces[outer, 0], normal=-1e6)
    sim.option(dynamic=False)
    convergence.solve(sim, ratio=1e-8, cycles=5000)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(-1e6, rel=1e-6)
    left = edges.faces[outer & (ends[:, :, 0] < 1e-9).all(axis=1), 0]
    sim.remove_stress_conditions(left)
    sim.option(dynamic=True)
    convergence.advance(sim, 200)
    speed = (
        diagnostics.values(sim, "element_velocity_x") * ROCK["density"] * diagnostics.values(sim, "area")
    ).sum() / (ROCK["density"] * 0.04)
    assert speed == pytest.approx(-1e6 * 0.2 / (ROCK["density"] * 0.04) * sim.clock.time, rel=0.02)


def test_quantities_have_the_values_they_say():
    """Every name answers, on the right kind; totals are sums of values; principal stresses follow from components."""
    sim = pulled(250)
    for name, quantity in QUANTITIES.items():
        if sim.dim not in quantity.dims:
            with pytest.raises(CommandError, match=f"no quantity {name} in two dimensions"):
                diagnostics.values(sim, name)
            continue
        values = diagnostics.values(sim, name)
        size = {"element": len(sim.mesh.cells), "node": len(sim.mesh.points)}.get(quantity.on)
        assert size is None or len(values) == size, name
        rows = diagnostics.owned_values(sim, quantity.on, [name])
        assert len(rows["number"]) == len(rows[name]), name
        if not name.startswith(("reaction", "unbalanced")):
            assert diagnostics.total(sim, name) == pytest.approx(
                math.fsum(values[~np.isnan(values)]), rel=1e-12, abs=1e-300
            ), name
    xx, yy, xy = (diagnostics.values(sim, f"stress_{c}") for c in ("xx", "yy", "xy"))
    both = np.array([np.linalg.eigvalsh([[a, c], [c, b]]) for a, b, c in zip(xx, yy, xy)])
    assert diagnostics.values(sim, "stress_min") == pytest.approx(both[:, 0], abs=1e-6 * np.abs(both).max())
    assert diagnostics.values(sim, "stress_max") == pytest.approx(both[:, 1], abs=1e-6 * np.abs(both).max())
    corners = diagnostics.owned_values(sim, "corner", ["position_x", "displacement_y", "velocity_y"])
    order = np.argsort(corners["number"])
    assert np.array_equal(corners["number"][order], np.arange(4 * len(sim.mesh.cells)))


def test_contacts_say_who_presses_whom():
    """A block that lies on another: forces on the lower one add up to the weight, at the joint between them."""
    lower, upper = rectangle(2, 2, 0.2, 0.2), rectangle(2, 1, 0.2, 0.1, y0=0.2 + 1e-7)
    sim = model(joined(lower, upper))
    sim.element_property(None, {"young": 1e8})
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] < 1e-9), vx=0.0, vy=0.0)
    sim.gravity(0.0, -10.0)
    sim.option(dynamic=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=20000).reason == "ratio"
    found = diagnostics.contacts(sim)
    n = len(lower.cells)
    assert (found["element_1"] < n).all() and (found["element_2"] >= n).all()
    assert found["force_y"].sum() == pytest.approx(-ROCK["density"] * 10.0 * 0.02, rel=1e-4)
    assert np.abs(found["y"] - 0.2).max() < 0.1 and found["force_x"].sum() == pytest.approx(0.0, abs=1e-2)


def test_what_is_removed_in_motion_is_released_slowly():
    """A loaded plate loses its middle: at once it rings, over several periods it does not."""
    swings = []
    for relax in (0.0, 2e-3):
        mesh = shaken(rectangle(9, 9, 0.9, 0.9, kind="mixed"), 0.15)
        sim = jointed(model(mesh), penalty_normal=5e12, tensile_strength=1e9, cohesion=1e9, gf1=1e6, gf2=1e6)
        sim.element_property(None, {"damp_factor": 0.02})
        x, y = mesh.points.T
        sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 0.9 - 1e-9)), vx=0.0)
        sim.velocity_condition(np.flatnonzero((y < 1e-9) | (y > 0.9 - 1e-9)), vy=0.0)
        sim.initial_stress(None, xx=-1e7, yy=-5e6)
        sim.option(collision=False, dynamic=False)
        convergence.solve(sim, ratio=1e-6, cycles=20000)
        sim.option(dynamic=True)
        changes.null(sim, np.flatnonzero(np.hypot(*(mesh.centroids() - 0.45).T) < 0.2), relax=relax)
        fastest = 0.0
        while sim.clock.time < 2.5e-3:
            convergence.advance(sim, 40)
            fastest = max(fastest, float(np.nanmax(np.abs(diagnostics.values(sim, "velocity_x")))))
        swings.append(fastest)
    assert swings[0] > 0.05 and swings[1] < 0.2 * swings[0]


def test_small_and_large_strain_differ_by_the_rotation():
    """A square turned by 30 degrees: no stress with rotations of any size, the strain of the linear theory without."""
    turn = math.radians(30.0)
    for large in (True, False):
        sim = model(rectangle(1, 1, 1.0, 1.0))
        sim.option(large_strain=large, collision=False, dynamic=False)
        sim.open_model()
        matrix = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        sim.x[:, :6] = (diagnostics.homes(sim).reshape(-1, 4, 2)[:, :3] @ matrix.T).reshape(-1, 6)
        changes.repeat(sim, sim.x)
        strain = math.cos(turn) - 1.0
        lame = mu = 20e9
        expected = 0.0 if large else 2.0 * lame * strain + 2.0 * mu * strain
        assert diagnostics.values(sim, "stress_xx") == pytest.approx(expected, abs=1.0)
        assert diagnostics.values(sim, "stress_xy") == pytest.approx(0.0, abs=1.0)


def test_resetting_elements_changes_nothing_in_an_elastic_model_and_says_so():
    log = Noted()
    sim = pulled(50)
    sim.log = log
    before = diagnostics.values(sim, "stress_yy")
    changes.reset_state(sim)
    assert np.array_equal(diagnostics.values(sim, "stress_yy"), before)
    assert diagnostics.critical_time_step(sim) == pytest.approx(sim.clock.dt)
    assert "with state variables (mech_iso_elastic)" in log.lines[-1]
