"""Six-node triangles: patch, bending, a ring under pressure, stability, energy, joints, contact, refusals."""

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.pre.mesh.quadratic import quadratic
from tests.blocks.support import JOINT, ROCK, joined, model, near, rectangle, shaken

E, NU = ROCK["young"], ROCK["poisson_ratio"]
COHESIVE = "classic_intrinsic_cohesive_interface"


def parts(mesh: Mesh) -> Mesh:
    """The same points and elements as linear triangles."""
    return Mesh.of(mesh.points, mesh.cells)


def patch() -> Mesh:
    return quadratic(shaken(rectangle(2, 2, 1.0, 1.0), 0.2)).mesh


def static(mesh: Mesh, **options) -> Blocks:
    sim = model(mesh)
    sim.option(**{"dynamic": False, "collision": False, "large_strain": False, **options})
    return sim


def hold(sim: Blocks, axis: int, at: float = 0.0) -> None:
    where = np.flatnonzero(np.abs(sim.mesh.points[:, axis] - at) < 1e-9)
    sim.velocity_condition(where, **{"vx" if axis == 0 else "vy": 0.0})


def moved(sim: Blocks) -> np.ndarray:
    """(np, 2) displacements of the points [m]."""
    nodes = equilibrium.all_nodes(sim)
    out = np.zeros_like(sim.mesh.points)
    out[nodes.point] = nodes.x - sim.mesh.points[nodes.point]
    return out


@pytest.mark.parametrize("plane_stress", [False, True])
@pytest.mark.parametrize("large", [False, True])
def test_uniform_strain_is_exact(large, plane_stress):
    mesh = patch()
    sim = static(mesh, large_strain=large, plane_stress=plane_stress)
    strain = np.array([[1e-3, 4e-4], [2e-4, -5e-4]])
    edges = mesh.edges()
    for point in np.unique(edges.points[~edges.inner]):
        vx, vy = strain @ mesh.points[point]
        sim.velocity_condition([point], vx=vx, vy=vy)
    equilibrium.solve_elastic(sim)
    assert np.abs(moved(sim) - mesh.points @ strain.T).max() < 1e-12
    stress, energy = sim.local.stresses()
    assert np.abs(stress - stress[0]).max() < 1e-10 * np.abs(stress[0]).max()
    if large:
        return
    shear, trace = E / (2.0 * (1.0 + NU)), 5e-4
    lame = 2.0 * shear * NU / (1.0 - NU) if plane_stress else 2.0 * shear * NU / (1.0 - 2.0 * NU)
    exact = lame * trace + 2.0 * shear * 1e-3, lame * trace - 2.0 * shear * 5e-4, shear * 6e-4
    assert stress[0, :3] == pytest.approx(exact, rel=1e-10)
    assert stress[0, 3] == pytest.approx(0.0 if plane_stress else lame * trace, rel=1e-10)
    work = 0.5 * (exact[0] * 1e-3 - exact[1] * 5e-4 + exact[2] * 6e-4)
    assert energy.sum() == pytest.approx(work, rel=1e-10)


def test_uniform_tractions_and_weight_are_those_of_quadratic_displacements():
    """Stress is uniform to rounding up to a loaded side; under its weight a column has the stress of its depth."""
    sim = static(patch())
    hold(sim, 0)
    hold(sim, 1)
    sim.stress_condition(near(sim.mesh, 0, 1.0), normal=-1e6)
    equilibrium.solve_elastic(sim)
    stress, _ = sim.local.stresses()
    assert np.abs(stress - stress[0]).max() < 1e-10 * 1e6
    sim = static(quadratic(rectangle(1, 3, 1.0, 3.0)).mesh)
    sim.gravity(0.0, -1e4)
    for axis, at in ((0, 0.0), (0, 1.0), (1, 0.0)):
        hold(sim, axis, at)
    equilibrium.solve_elastic(sim)
    depth = 3.0 - sim.mesh.points[sim.mesh.cells[sim.number, :3]].mean(axis=1)[:, 1]
    assert sim.local.stresses()[0][:, 1] == pytest.approx(-ROCK["density"] * 1e4 * depth, rel=1e-9)


@pytest.mark.parametrize("plane_stress", [False, True])
def test_a_beam_bends_with_one_through_its_height(plane_stress):
    """Timoshenko's deflection; linear triangles of the same points are far too stiff."""
    long, load = 10.0, 1e4
    found = []
    for mesh in (whole := quadratic(rectangle(10, 1, long, 1.0)).mesh, parts(whole)):
        sim = static(mesh, plane_stress=plane_stress)
        hold(sim, 0)
        sim.velocity_condition([np.argmin(np.hypot(*(mesh.points - (0.0, 0.5)).T))], vy=0.0)
        sim.stress_condition(near(mesh, 0, long), xy=load)
        equilibrium.solve_elastic(sim)
        tip = np.abs(mesh.points[:, 0] - long) < 1e-9
        found.append(moved(sim)[tip, 1].mean())
    young, shear = E if plane_stress else E / (1.0 - NU * NU), E / (2.0 * (1.0 + NU))
    exact = load * (long**3 / (3.0 * young / 12.0) + long / (5.0 / 6.0 * shear))
    assert found[0] == pytest.approx(exact, rel=0.01)
    assert found[1] < 0.7 * exact


def ring(n: int) -> Mesh:
    """A quarter of a ring from r = 1 to 2; nodes between stand where half sides enclose the area of the arc."""
    flat = rectangle(n, 2 * n, 1.0, 0.5 * math.pi)
    r, turn = 1.0 + flat.points[:, 0], flat.points[:, 1]
    before = Mesh.of(np.column_stack([r * np.cos(turn), r * np.sin(turn)]), flat.cells)
    mesh = quadratic(before).mesh
    ends = before.edges().points
    arc = np.flatnonzero(np.abs(r[ends[:, 0]] - r[ends[:, 1]]) < 1e-9)
    points, between = mesh.points.copy(), len(before.points) + arc
    size = np.hypot(*points[between].T)
    points[between] *= (1.0 + 4.0 / 3.0 * (r[ends[arc, 0]] / size - 1.0))[:, None]
    return Mesh.of(points, mesh.cells, macros=mesh.macros)


def test_a_ring_under_pressure_converges_faster_than_with_linear_triangles():
    p, rates, last = 1e6, [], []
    for linear in (False, True):
        errors = []
        for n in (2, 4):
            sim = static(parts(ring(n)) if linear else ring(n))
            hold(sim, 0)
            hold(sim, 1)
            edges, at = sim.mesh.edges(), sim.mesh.points
            middle = at[edges.points].mean(axis=1)
            inside = ~edges.inner & (np.hypot(*middle.T) < 1.1) & (middle.min(axis=1) > 1e-9)
            sim.stress_condition(edges.faces[inside].max(axis=1), normal=-p)
            equilibrium.solve_elastic(sim)
            r = np.hypot(*at.T)
            exact = (1.0 + NU) / E * p / 3.0 * ((1.0 - 2.0 * NU) * r + 4.0 / r)
            corners = np.unique(ring(n).macros[:, :3])
            out = (moved(sim) * at).sum(axis=1) / r - exact
            errors.append(math.sqrt((out[corners] ** 2).mean()) / exact.max())
        rates.append(math.log2(errors[0] / errors[1]))
        last.append(errors[1])
    assert rates[0] > rates[1] + 0.5 and last[0] < 0.5 * last[1]


def test_the_time_step_is_below_the_limit_and_near_to_it():
    sim = model(patch())
    sim.option(collision=False)
    sim.close_model()
    nodes = len(sim.member_begin) - 1
    k, m = np.zeros((2 * nodes, 2 * nodes)), np.zeros(nodes)
    for one in equilibrium.of_elements(sim):
        for of, at in zip(one.stiffness, one.node):
            place = (2 * at[:, None] + np.arange(2)).ravel()
            k[np.ix_(place, place)] += of
    np.add.at(m, sim.node[sim.number, :3], sim.local.true_mass[:, :3])
    assert m.sum() == pytest.approx(ROCK["density"], rel=1e-12)
    scale = 1.0 / np.sqrt(np.repeat(m, 2))
    omega2 = np.linalg.eigvalsh(k * scale[:, None] * scale)
    assert np.abs(omega2[:3]).max() < 1e-12 * omega2[-1] < omega2[3]  # three movements of a rigid body, no others
    limit = sim.local.masses.critical_time_step() / sim.safety() * math.sqrt(omega2[-1]) / 2.0
    assert 0.7 < limit <= 1.0 + 1e-12


@pytest.mark.parametrize(("plane_stress", "damping"), [(False, 0.0), (True, 0.0), (False, 0.3)])
def test_the_account_of_energy_closes(plane_stress, damping):
    sim = Blocks()
    sim.take_mesh(patch())
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": damping})
    sim.option(collision=False, large_strain=False, plane_stress=plane_stress)
    sim.gravity(1.0, -9.0)
    sim.initial_stress(None, xx=1e5, yy=2e5, xy=1e4)
    if damping:
        sim.rayleigh(0.01, 2000.0)
    hold(sim, 0)
    diagnostics.account_energy(sim)
    changes.set_velocity(sim, [2, 5], 0.1, -3.0)
    convergence.advance(sim, 150)
    found = diagnostics.energies(sim)
    assert found["relative"] < 1e-9 and found["strain"] != 0.0
    assert (found["viscous_lost"] > 0.2 * found["strain"]) == (damping > 0.0)


def test_relaxation_comes_to_the_static_solution():
    found = []
    for at_once in (True, False):
        sim = static(patch(), large_strain=True)
        hold(sim, 0)
        hold(sim, 1)
        sim.stress_condition(near(sim.mesh, 0, 1.0), xx=-1e6, xy=4e5)
        if at_once:
            equilibrium.solve_elastic(sim)
        else:
            convergence.advance(sim, 1500)
        found.append(moved(sim))
    assert np.abs(found[0] - found[1]).max() < 1e-9 * np.abs(found[0]).max()


def pulled(mesh: Mesh, stress: float) -> Blocks:
    """Two blocks one above the other, a joint between them, pulled apart."""
    sim = static(mesh)
    sim.joint_model(np.unique(near(mesh, 1, 1.0, inner=True).reshape(-1, 2).min(axis=1)), COHESIVE, JOINT)
    hold(sim, 0)
    hold(sim, 1)
    sim.stress_condition(near(mesh, 1, 2.0), normal=stress)
    equilibrium.solve_elastic(sim)
    return sim


def test_a_joint_between_them_has_its_strength():
    mesh = quadratic(rectangle(2, 4, 1.0, 2.0)).mesh
    strength = JOINT["tensile_strength"]
    sim = pulled(mesh, 0.999 * strength)
    slots = np.flatnonzero(sim.local.slot_state[: sim.local.slots])
    assert len(slots) == 8
    assert sim.local.joint_points(slots)[:, :3] == pytest.approx(0.999 * strength, rel=1e-9)
    for one in (mesh, parts(mesh)):
        with pytest.raises(CommandError, match="4 joints would pass their peak"):
            pulled(one, 1.001 * strength)


def test_friction_in_contact_is_that_of_linear_triangles():
    """A block slides on a plate under inclined gravity with g (sin - tan(friction) cos)."""
    found = []
    both = quadratic(joined(rectangle(2, 1, 0.4, 0.2), rectangle(3, 1, 0.8, 0.2, x0=-0.2, y0=-0.2))).mesh
    for mesh in (both, parts(both)):
        sim = Blocks()
        sim.take_mesh(mesh)
        soft = {**ROCK, "young": 1e7, "friction": 20.0, "damp_factor": 1.0}
        changes.element_model(sim, None, "mech_iso_elastic", soft)
        block = np.unique(mesh.cells[:16, :3])
        rest = np.setdiff1d(np.arange(len(mesh.points)), block)
        sim.velocity_condition(rest, vx=0.0, vy=0.0)
        sim.gravity(6.0, -8.0)
        convergence.advance(sim, round(0.05 / sim_dt(sim)))
        v0, t0 = diagnostics.values(sim, "velocity_x")[block].mean(), sim.clock.time
        convergence.advance(sim, round(0.05 / sim_dt(sim)))
        found.append((diagnostics.values(sim, "velocity_x")[block].mean() - v0) / (sim.clock.time - t0))
    assert found[0] == pytest.approx(6.0 - 8.0 * math.tan(math.radians(20.0)), rel=0.02)
    assert found[0] == pytest.approx(found[1], rel=0.02)


def sim_dt(sim: Blocks) -> float:
    sim.close_model()
    return sim.clock.dt


def test_a_geostatic_column_stays_at_rest():
    """Initial stress is linear over the depth, and so is what a six-node triangle bears of it at its Gauss points."""
    mesh, rho, g = quadratic(rectangle(2, 4, 2.0, 4.0)).mesh, ROCK["density"], 9.81
    sim = static(mesh, large_strain=True)
    for axis, at in ((0, 0.0), (0, 2.0), (1, 0.0)):
        hold(sim, axis, at)
    sim.gravity(0.0, -g)
    slope = {"xx": 0.5 * rho * g, "yy": rho * g, "zz": 0.5 * rho * g}
    top = {name: -4.0 * value for name, value in slope.items()}
    sim.initial_stress(None, **top, gradient={name: (0.0, value) for name, value in slope.items()})
    equilibrium.solve_elastic(sim)
    assert np.abs(moved(sim)).max() < 1e-19
    depth = 4.0 - mesh.points[mesh.cells[sim.number[sim.owned], :3]].mean(axis=1)[:, 1]
    assert sim.local.stresses()[0][:, 1] == pytest.approx(-rho * g * depth, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "properties", "why"),
    [
        ("mech_mohr_coulomb", {"cohesion": 1e6, "friction": 30.0}, "element c-model mech-iso-elastic only"),
        ("mech_burgers", {"maxwell_viscosity": 1e12}, "element c-model mech-iso-elastic only"),
        ("mech_iso_elastic", {"young": Over("t", TEMPERATURE)}, "a number for young only"),
    ],
)
def test_what_they_cannot_have_is_refused_when_it_is_assigned(law, properties, why):
    sim = Blocks()
    sim.take_mesh(patch())
    sim.table("t", [(0.0, 1e9), (100.0, 2e9)])
    with pytest.raises(CommandError, match=f"six-node triangle of elements 0 to 3 can have {why}"):
        changes.element_model(sim, None, law, {**ROCK, **properties})
    assert not sim.element_row.any()
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    if law == "mech_iso_elastic":
        with pytest.raises(CommandError, match=why):
            sim.element_property([0, 1, 2, 3], properties)


def test_parts_of_several_materials_are_refused_before_the_first_step():
    sim = Blocks()
    sim.take_mesh(patch())
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": np.linspace(1e9, 2e9, len(sim.mesh.cells))})
    with pytest.raises(CommandError, match="elements 0 to 3 has several materials"):
        sim.close_model()
