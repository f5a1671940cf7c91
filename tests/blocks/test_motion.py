"""Bodies in motion and at rest against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, ROCK, joined, jointed, model, rectangle, shaken

E, NU, RHO = ROCK["young"], ROCK["poisson_ratio"], ROCK["density"]
LAMBDA, MU = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 * (1.0 + NU))


def crossing(t: np.ndarray, values: np.ndarray, level: float) -> float:
    """First time at which `values` passes `level`, by linear interpolation."""
    k = int(np.flatnonzero(values >= level)[0])
    return float(t[k - 1] + (level - values[k - 1]) * (t[k] - t[k - 1]) / (values[k] - values[k - 1]))


def test_a_free_body_keeps_its_momentum_and_its_energy():
    """Random velocities, no damping, joints before their peak: momenta to rounding, energy to 1e-3 (leap-frog)."""
    sim = jointed(model(shaken(rectangle(5, 5, 0.5, 0.5), 0.2)), tensile_strength=1e9, cohesion=1e9)
    sim.close_model()
    rng = np.random.default_rng(2)
    sim.v[:] = 0.01 * rng.normal(size=sim.v.shape)
    diagnostics.account_energy(sim)
    sim.step()

    def momenta():
        order = np.argsort(sim.number[sim.owned])
        m = sim.local.true_mass[sim.owned][order][:, :3, None]
        x, v = (rows[sim.owned][order][:, :6].reshape(-1, 3, 2) for rows in (sim.x, sim.v))
        # Velocities are half a step behind: the moment of momentum is taken about the place half a step back.
        x = x - 0.5 * sim.clock.dt * v
        return (m * v).sum(axis=(0, 1)), float((m[..., 0] * (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0])).sum())

    before, turn = momenta()
    convergence.advance(sim, 2000)
    after, turned = momenta()
    assert after == pytest.approx(before, abs=1e-11 * RHO * 0.01)
    assert turned == pytest.approx(turn, abs=1e-6 * RHO * 0.01)
    found = diagnostics.energies(sim)
    assert found["relative"] < 1e-3
    assert found["joints_lost"] == pytest.approx(0.0, abs=2e-3 * found["kinetic"])


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_a_free_fall_is_exact(kind):
    """x_n = g dt^2 n (n + 1) / 2 of the symplectic scheme started at rest, for every corner."""
    sim = model(rectangle(2, 2, 1.0, 1.0, kind=kind))
    sim.gravity(0.0, -10.0)
    sim.time_step(value=1e-5)
    convergence.advance(sim, 200)
    assert diagnostics.values(sim, "displacement_y") == pytest.approx(-10.0 * 1e-10 * 200 * 201 / 2, rel=1e-9)
    assert diagnostics.values(sim, "displacement_x") == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("jointed_too", [False, True])
def test_the_estimated_time_step_is_stable_and_twice_it_is_not(jointed_too):
    """Random velocities: energy stays with dt = 1.0 of the limit, and grows without bound above it (4 times)."""

    def largest_speed(part: float) -> float:
        sim = model(shaken(rectangle(5, 5, 0.5, 0.5), 0.25))
        if jointed_too:
            jointed(sim, tensile_strength=1e9, cohesion=1e9, gf1=1e9, gf2=1e9)
        sim.option(collision=False)
        sim.time_step(safety=1.0)
        sim.step()
        sim.time_step(value=part * sim.clock.dt)
        sim.close_model()
        sim.v[:] = 1e-3 * np.random.default_rng(4).normal(size=sim.v.shape)
        changes.set_velocity(sim, [0], 0.0, 0.0)  # corners of one node get one velocity again
        for node in range(len(sim.mesh.points)):
            if not jointed_too:
                changes.set_velocity(sim, [node], 1e-3 * math.sin(7.0 * node), 1e-3 * math.cos(3.0 * node))
        try:
            convergence.advance(sim, 1500)
        except Exception:
            return math.inf
        return float(np.abs(sim.v).max())

    assert largest_speed(1.0) < 0.05
    assert largest_speed(4.0) > 1.0


def test_a_box_under_gravity_rests_with_the_stresses_of_uniaxial_strain():
    """20 m x 10 m on rollers: sigma_yy = -rho g depth, sigma_xx = nu / (1 - nu) sigma_yy, to 0.5 % of the largest."""
    sim = Blocks()
    mesh = rectangle(20, 10, 20.0, 10.0, kind="quad")
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e9, "poisson_ratio": 0.3})
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 20.0 - 1e-9)), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.gravity(0.0, -9.81)
    sim.option(dynamic=False, collision=False)
    assert convergence.solve(sim, ratio=1e-6, cycles=20000).reason == "ratio"
    depth = 10.0 - mesh.centroids()[:, 1]
    scale = RHO * 9.81 * 10.0
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-RHO * 9.81 * depth, abs=0.005 * scale)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(-RHO * 9.81 * depth * 0.3 / 0.7, abs=0.005 * scale)
    assert diagnostics.total(sim, "reaction_y") == pytest.approx(RHO * 9.81 * 200.0, rel=2e-5)
    # Taking out the upper half leaves the lower one with half the weight.
    changes.null(sim, np.flatnonzero(mesh.centroids()[:, 1] > 5.0), relax=200)
    assert convergence.solve(sim, ratio=1e-6, cycles=20000).reason == "ratio"
    assert diagnostics.total(sim, "reaction_y") == pytest.approx(RHO * 9.81 * 100.0, rel=1e-4)
    low = np.flatnonzero(mesh.centroids()[:, 1] < 5.0)
    assert diagnostics.values(sim, "stress_yy", low) == pytest.approx(
        -RHO * 9.81 * (depth[low] - 5.0), abs=0.005 * scale
    )
    assert np.isnan(diagnostics.values(sim, "stress_yy")[mesh.centroids()[:, 1] > 5.0]).all()


@pytest.mark.slow
@pytest.mark.parametrize("penalty, low, high", [(None, 0.99, 1.01), (100.0, 0.98, 1.005), (10.0, 0.925, 0.965)])
def test_a_plane_wave_has_the_speed_of_p_waves(penalty, low, high):
    """Strip of 4 m x 0.1 m, smooth pressure pulse at one end, arrival at half height between x = 1 and 3 m:
    c_p = sqrt((lambda + 2 mu) / rho) = 4714.0 m/s; joints in series make it slower, M_eff = M / (1 + M / P)."""
    c_p = math.sqrt((LAMBDA + 2.0 * MU) / RHO)
    assert c_p == pytest.approx(4714.0, abs=0.1)
    # Joints of quads lie across the wave; those on diagonals of triangles would add to them.
    mesh = rectangle(200, 5, 4.0, 0.1, kind="cross" if penalty is None else "quad")
    sim = model(mesh)
    if penalty is not None:
        jointed(sim, penalty_normal=penalty * E, tensile_strength=1e9, cohesion=1e9)
    sim.option(collision=False)
    x, y = mesh.points.T
    sim.velocity_condition(None, vy=0.0)
    width = 1e-4
    t = np.linspace(0.0, width, 41)
    sim.table("pulse", list(zip(t, -1e5 * np.sin(math.pi * t / width) ** 2)))
    left = mesh.edges()
    ends = mesh.points[left.points].mean(axis=1)
    sim.stress_condition(left.faces[np.flatnonzero(ends[:, 0] < 1e-9), 0], normal="pulse")
    marks = [int(np.argmin((x - at) ** 2 + (y - 0.04) ** 2)) for at in (1.0, 3.0)]
    times, seen = [], []
    while sim.clock.time < 9.5e-4:
        convergence.advance(sim, 5)
        times.append(sim.clock.time)
        seen.append(diagnostics.values(sim, "velocity_x", marks))
    seen = np.array(seen)
    arrivals = [crossing(np.array(times), seen[:, k], 0.5 * seen[:, k].max()) for k in range(2)]
    speed = (x[marks[1]] - x[marks[0]]) / (arrivals[1] - arrivals[0])
    assert low < speed / c_p < high, speed / c_p


def slider(v0: float, friction: float) -> tuple[Blocks, np.ndarray]:
    """A block of 1 m x 0.5 m on a fixed base of 6 m x 0.5 m, settled under gravity, then pushed."""
    block = rectangle(10, 5, 1.0, 0.5, x0=0.5, y0=1e-6)
    base = rectangle(60, 5, 6.0, 0.5, x0=0.0, y0=-0.5)
    mesh = joined(block, base)
    sim = Blocks()
    sim.take_mesh(mesh)
    soft = {"density": 2700.0, "young": 1e9, "poisson_ratio": 0.25, "damp_factor": 1.0}
    changes.element_model(sim, None, "mech_iso_elastic", soft)
    sim.face_model(None, "contact_mohr_coulomb", {"friction": friction, "penalty_normal": 1e10})
    n = len(block.points)
    sim.velocity_condition(np.arange(n, len(mesh.points)), vx=0.0, vy=0.0)
    sim.gravity(0.0, -9.81)
    convergence.advance(sim, 4000)
    changes.set_velocity(sim, np.arange(n), vx=v0)
    return sim, np.arange(len(block.cells))


@pytest.mark.slow
@pytest.mark.parametrize("v0, tolerance", [(1.0, 0.04), (2.0, 0.02), (3.0, 0.02), (4.0, 0.02), (5.0, 0.02)])
def test_a_block_slides_as_far_as_friction_lets_it(v0, tolerance):
    """d = v0^2 / (2 g tan(phi)), phi = 30 degrees: 0.08828, 0.35312, 0.79452, 1.41248, 2.20700 m."""
    sim, block = slider(v0, 30.0)
    start = diagnostics.values(sim, "element_position_x", block).mean()
    while np.abs(diagnostics.values(sim, "element_velocity_x", block).mean()) > 1e-3 * v0:
        convergence.advance(sim, 500)
    way = diagnostics.values(sim, "element_position_x", block).mean() - start
    assert way == pytest.approx(v0**2 / (2.0 * 9.81 * math.tan(math.radians(30.0))), rel=tolerance)


@pytest.mark.slow
def test_without_friction_a_block_keeps_its_speed():
    sim, block = slider(2.0, 0.0)
    convergence.advance(sim, 5000)
    assert diagnostics.values(sim, "element_velocity_x", block).mean() == pytest.approx(2.0, rel=1e-3)


def test_bars_that_collide_exchange_their_velocities():
    """Two equal bars, no damping, head on with 2 and 0 m/s: after the contact 0 and 2 (momentum and energy to 2 %), and
    contact lasts about 2 L / c of the bar."""
    a, b = rectangle(10, 1, 1.0, 0.1), rectangle(10, 1, 1.0, 0.1, x0=1.0005)
    sim = model(joined(a, b))
    sim.element_property(None, {"penalty": 5.0 * E})
    changes.set_velocity(sim, np.arange(len(a.points)), vx=2.0)
    diagnostics.account_energy(sim)
    sim.step()
    n = len(a.cells)
    start = diagnostics.energies(sim)
    first, last = None, None
    for _ in range(400):
        convergence.advance(sim, 10)
        touching = len(diagnostics.contacts(sim)["x"]) > 0
        if touching and first is None:
            first = sim.clock.time
        if touching:
            last = sim.clock.time
        if first is not None and not touching and sim.clock.time > last + 2e-4:
            break
    one, two = (diagnostics.values(sim, "element_velocity_x", np.arange(k * n, (k + 1) * n)).mean() for k in (0, 1))
    assert one + two == pytest.approx(2.0, abs=1e-9)
    assert two == pytest.approx(2.0, rel=0.05) and abs(one) < 0.1
    plane_stress_bar = math.sqrt(E / (1.0 - NU**2) / RHO)
    assert last - first == pytest.approx(2.0 / plane_stress_bar, rel=0.15)
    found = diagnostics.energies(sim)
    assert found["relative"] < 0.01
    assert abs(found["contact"]) < 0.01 * start["kinetic"]


def test_null_elements_leave_free_faces_and_joints():
    sim = jointed(model(rectangle(3, 3, 0.3, 0.3)))
    changes.null(sim, [8, 9])
    sim.step()
    faces = [f for e in (8, 9) for f in 4 * e + np.arange(3) if sim.partner[f] >= 0]
    assert all(sim.open[sim.partner[f]] for f in faces)
    assert diagnostics.joint_counts(sim)[0] == sum(
        1 for f in np.flatnonzero(sim.partner > np.arange(len(sim.partner))) if not sim.open[f]
    )
    assert len(sim.number) == len(sim.mesh.cells) - 2


def test_conditions_act_in_their_order():
    """Velocity before acceleration before force; with a constraint along a vector only; acceleration integrates."""
    sim = model(rectangle(1, 1, 1.0, 1.0, kind="quad"))
    sim.time_step(value=1e-5)
    sim.velocity_condition(None, vx=1.0, ay=100.0)
    sim.force_condition(None, fx=1e9, fy=1e9)
    convergence.advance(sim, 10)
    assert diagnostics.values(sim, "velocity_x") == pytest.approx(1.0, abs=1e-15)
    assert diagnostics.values(sim, "velocity_y") == pytest.approx(100.0 * 1e-5 * 10, rel=1e-12)
    with pytest.raises(CommandError, match="velocity-x 1 and acceleration-y 100: along an oblique line"):
        sim.move_constraint(None, 2, (1.0, 1.0))
    sim.remove_conditions(None)
    sim.velocity_condition(None, vx=1.0)
    sim.move_constraint(None, 2, (1.0, 1.0))
    sim.step()
    assert diagnostics.values(sim, "velocity_y") == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(CommandError, match=r"node 0 at \(0, 0\): held \(type 1\) and velocity-x 1"):
        sim.move_constraint([0], 1)
    sim.remove_conditions([0])
    sim.move_constraint([0], 1)
    sim.step()
    assert diagnostics.values(sim, "velocity_x", [0])[0] == 0.0


def test_pressure_follows_the_surface_and_its_table():
    """A free square under pressure on all sides that grows linearly: sigma = -p in every element, small oscillations
    damped."""
    mesh = rectangle(3, 3, 0.3, 0.3)
    sim = model(mesh)
    sim.element_property(None, {"damp_factor": 1.0})
    edges = mesh.edges()
    sim.table("p", [(0.0, 0.0), (1e-3, -1e6)])
    sim.stress_condition(edges.faces[~edges.inner, 0], normal="p")
    while sim.clock.time < 2e-3:
        convergence.advance(sim, 200)
    for name in ("stress_xx", "stress_yy"):
        assert diagnostics.values(sim, name) == pytest.approx(-1e6, rel=1e-3)
    assert diagnostics.values(sim, "stress_xy") == pytest.approx(0.0, abs=1e3)
    assert JOINT["gf1"] > 0.0


def test_mass_scaling_reaches_the_time_step_and_reports_the_mass():
    sim = model(rectangle(4, 4, 1.0, 1.0))
    sim.option(collision=False)
    sim.step()
    stable = sim.clock.dt
    assert diagnostics.added_mass(sim) == 0.0
    sim.time_step(mass_scaling=2.0 * stable)
    sim.step()
    assert sim.clock.dt == 2.0 * stable
    assert diagnostics.added_mass(sim) == pytest.approx(3.0, rel=0.05)  # dt ~ sqrt(m) in a regular mesh
