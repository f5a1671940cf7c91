"""The energy budget in space: against closed forms, and where bodies break."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import DENSITY, LAME, SHEAR, body, box, hexes, nodes_on
from tests.space.test_contact import on_a_plate, way

INTERFACE = "classic_intrinsic_cohesive_interface"


def run(sim: Blocks, until: float) -> dict[str, float]:
    """Step to this time; the budget then."""
    while sim.clock.time < until:
        sim.step()
    return diagnostics.energies(sim)


@pytest.mark.some_of_each
@pytest.mark.parametrize("mesh", [box((40, 1, 1), (4.0, 0.1, 0.1), 12), hexes((40, 1, 1), (4.0, 0.1, 0.1))])
@pytest.mark.parametrize("damped", [False, True])
def test_a_bar_that_is_hit(mesh, damped: bool) -> None:
    """Its end moves from now on with V: behind the wave, which runs with c, are the velocity V and the stress rho c V.
    So rho c A V^2 t was done, half of it is stored and half moves; damping takes its part of either."""
    sim = body(mesh, damp_factor=0.1 if damped else 0.0)
    sim.velocity_condition(None, vy=0.0, vz=0.0)
    sim.velocity_condition(nodes_on(mesh, "left"), vx=0.02)
    diagnostics.account_energy(sim)
    found = run(sim, 5e-4)
    speed = np.sqrt((LAME + 2.0 * SHEAR) / DENSITY)
    given = DENSITY * speed * 0.01 * 0.02**2 * sim.clock.time
    assert found["work_outside"] == pytest.approx(given, rel=0.02)
    assert found["relative"] < 2e-3
    half = 0.5 * given - 0.5 * found["viscous_lost"]
    assert found["kinetic"] == pytest.approx(half, rel=0.04) and found["strain"] == pytest.approx(half, rel=0.04)
    assert (found["viscous_lost"] > 0.02 * given) == damped
    if not damped:
        assert abs(found["viscous_lost"]) < 1e-9 * given
    assert found["joints_lost"] == found["contact"] == found["work_gravity"] == found["commands"] == 0.0


def test_what_gravity_drag_and_commands_do() -> None:
    """A body that falls with a drag a: m g s and m a v v dt; a command gives it m w^2 / 2 more."""
    sim = body(box((2, 2, 2), (0.2, 0.2, 0.2)))
    sim.gravity(2.0, -3.0, -9.0)
    sim._set(mass_damping=40.0)
    diagnostics.account_energy(sim)
    changes.set_velocity(sim, None, 0.0, 0.0, 0.0)
    found = run(sim, 0.01)
    m, g2, t, a = DENSITY * 0.008, 94.0, sim.clock.time, 40.0
    way = g2 / a * (t - (1.0 - np.exp(-a * t)) / a)
    assert found["work_gravity"] == pytest.approx(m * way, rel=2e-3)
    assert found["viscous_lost"] == pytest.approx(m * (way - 0.5 * g2 * ((1.0 - np.exp(-a * t)) / a) ** 2), rel=5e-3)
    assert found["relative"] < 1e-9
    changes.set_velocity(sim, None, 3.0, 0.0, 4.0)
    sim.step()
    assert diagnostics.energies(sim)["commands"] == pytest.approx(0.5 * m * 25.0 - found["kinetic"], rel=2e-3)


@pytest.mark.parametrize("mode", ["I", "II", "III"])
def test_a_crack_takes_its_area_times_the_energy_of_fracture(mode: str) -> None:
    """Two halves are parted, or slide over each other one way or the other: G and what is taken before the peak, 2/3 T
    o_p with o_p = 2 h T / P, or the same of the cohesion, per area."""
    side, tensile, cohesion, penalty, gf1, gf2 = 0.02, 3e6, 6e6, 4e11, 8.0, 20.0
    mesh = box((1, 1, 2), (side, side, 2.0 * side))
    sim = body(mesh, damp_factor=0.2)
    edges = mesh.edges()
    inner = edges.faces[edges.inner, 0]
    between = inner[np.abs(mesh.points[mesh.face_points(inner)][:, :, 2] - side).max(axis=1) < 1e-9]
    assert len(between) == 2
    law = {
        "friction": 30.0, "cohesion": cohesion, "tensile_strength": tensile, "gf1": gf1, "gf2": gf2,
        "penalty_normal": penalty,
    }  # fmt: skip
    sim.joint_model(between, INTERFACE, law)
    axis = {"I": "z", "II": "x", "III": "y"}[mode]
    sim.velocity_condition(None, **{f"v{other}": 0.0 for other in "xyz" if other != axis})
    sim.velocity_condition(nodes_on(mesh, "bottom"), **{f"v{axis}": 0.0})
    sim.table("pull", [(0.0, 0.0), (2e-5, 0.1)])
    sim.velocity_condition(nodes_on(mesh, "top"), **{f"v{axis}": "pull"})
    diagnostics.account_energy(sim)
    found: dict[str, float] = {}
    for _ in range(100):
        found = run(sim, sim.clock.time + 5e-6)
        assert found["relative"] < 2e-3
        if diagnostics.joint_counts(sim)[2] == 2:
            break
    assert diagnostics.joint_counts(sim)[2] == 2
    strength, energy = (tensile, gf1) if mode == "I" else (cohesion, gf2)
    h = side / np.sqrt(2.0)
    exact = side**2 * (energy + 2.0 / 3.0 * strength * 2.0 * h * strength / penalty)
    assert found["joints_lost"] == pytest.approx(exact, rel=0.01)


def test_friction_takes_what_a_block_loses_on_a_slope() -> None:
    """Down 30 degrees with a friction of 20: m g s sin(30) was given, friction took tan(20) cos(30) of m g s, the rest
    moves."""
    sim, block = on_a_plate(box((2, 2, 1), (0.3, 0.3, 0.1)), (0.21, 0.11, 0.2), friction=20.0)
    a, m = np.radians(30.0), DENSITY * 0.009
    sim.gravity(9.81 * np.sin(a), 0.0, -9.81 * np.cos(a))
    diagnostics.account_energy(sim)
    found = run(sim, 0.25)
    s = way(sim, block)[0]
    assert s > 0.05
    assert found["work_gravity"] == pytest.approx(m * 9.81 * s * np.sin(a), rel=2e-3)
    assert found["contact"] == pytest.approx(m * 9.81 * s * np.cos(a) * np.tan(np.radians(20.0)), rel=0.01)
    assert found["kinetic"] == pytest.approx(found["work_gravity"] - found["contact"], rel=0.01)
    assert found["relative"] < 1e-3
