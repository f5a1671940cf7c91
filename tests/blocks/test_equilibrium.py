"""The static solve: the state to which relaxation goes, closed forms, what follows on it, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, linear, saved_state
from hpcdem.physics.fdem import equilibrium as equilibrium_
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, JOINT, ROCK, joined, jointed, model, rectangle, shaken
from tests.blocks.test_patch import LAMBDA, MU, STRAIN, boundary
from tests.blocks.test_static import leaning

STRESSES = ("stress_xx", "stress_yy", "stress_xy")
QUIET = {"dynamic": False, "collision": False}


def farthest(one: Blocks, other: Blocks, names=(*STRESSES, "displacement_x", "displacement_y")) -> float:
    """Largest difference of two models over the largest value, over these quantities."""
    pairs = [(diagnostics.values(one, name), diagnostics.values(other, name)) for name in names]
    return max(float(np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(b))) for a, b in pairs)


def state(sim: Blocks) -> list[np.ndarray]:
    """All that moves."""
    sim.close_model()
    order = np.argsort(sim.number)
    return [sim.number[order], sim.x[order], sim.v[order]]


def on_floor(mesh: Mesh, **options) -> Blocks:
    """A body in static mode without contact, held at its lowest points."""
    sim = model(mesh)
    y = mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < y.min() + 1e-9), vx=0.0, vy=0.0)
    sim.option(**{**QUIET, **options})
    return sim


# ---- the tangent ---------------------------------------------------------------------------------------------------


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize("large, within", [(False, 1e-7), (True, 2e-3)])
def test_the_matrix_is_the_derivative_of_the_forces(kind, large, within):
    """By central differences along random ways, from a state of strains of 1e-4 under an initial stress of 1e-4 E: with
    small strains forces are linear and only their rounding is left; with large ones terms of the order of the strain
    are left out."""
    rng = np.random.default_rng(3)
    sim = model(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
    jointed(sim, penalty_normal=500e9, tensile_strength=1e9, cohesion=1e9, friction=0.0, penalty_overlay=700e9)
    sim.initial_stress(None, xx=5e6, yy=-3e6, xy=2e6)
    sim.option(**QUIET, large_strain=large)
    sim.close_model()
    nodes = equilibrium_.all_nodes(sim)
    x = nodes.x + rng.uniform(-2e-5, 2e-5, nodes.x.shape)
    unknowns = equilibrium_.unknowns_of(sim, nodes, 1)
    equilibrium_.place_corners(sim, x)
    pieces, past = equilibrium_.tangent(sim)
    assert past == 0
    product = np.zeros((*nodes.x.shape, 3))
    ways = rng.uniform(-1.0, 1.0, (*nodes.x.shape, 3))
    for one in pieces:
        local = ways[one.node].reshape(*one.stiffness.shape[:2], 3)
        np.add.at(product, one.node, (one.stiffness @ local).reshape(*one.node.shape, 2, 3))
    for k in range(3):
        ahead, _, _ = equilibrium_.unbalanced(sim, nodes, unknowns, x + 1e-8 * ways[:, :, k])
        behind, _, _ = equilibrium_.unbalanced(sim, nodes, unknowns, x - 1e-8 * ways[:, :, k])
        slope = (behind - ahead) / 2e-8
        # Joints: the turn of the mid-line, of the order of stress over stiffness, is left out in both cases.
        assert np.abs(product[:, :, k] - slope).max() < max(within, 1e-3) * np.abs(slope).max()


@pytest.mark.parametrize("opening, slip", [(2e-6, 1e-6), (-3e-6, 4e-6), (-3e-6, -4e-6), (5e-6, -2e-6), (1e-6, 0.0)])
def test_the_matrix_of_a_joint_is_the_derivative_of_its_law(opening, slip):
    """Two squares that do not deform, one moved against the other: K against differences of the joint's forces, with
    friction, which makes it unsymmetric. h turns and grows with the movement: strains are 1e-5."""
    mesh = rectangle(2, 1, 2.0, 1.0, kind="quad")
    sim = model(mesh)
    jointed(sim, penalty_overlay=900e9, penalty_shear=300e9)
    sim.option(**QUIET)
    sim.close_model()
    nodes = equilibrium_.all_nodes(sim)
    unknowns = equilibrium_.unknowns_of(sim, nodes, 1)
    right = nodes.lead // 4 == 1
    x = nodes.x + right[:, None] * np.array([opening, slip])
    equilibrium_.place_corners(sim, x)
    (_, _, joint), past = equilibrium_.tangent(sim)
    assert past == 0
    k = np.zeros((16, 16))
    at = (2 * joint.node[0][:, None] + np.arange(2)).reshape(-1)
    k[np.ix_(at, at)] = joint.stiffness[0]
    for axis in range(2):
        way = np.zeros(nodes.x.shape)
        way[right, axis] = 1.0
        forces = [equilibrium_.unbalanced(sim, nodes, unknowns, x + sign * 1e-9 * way)[0] for sign in (1.0, -1.0)]
        slope = (forces[1] - forces[0]) / 2e-9
        assert np.abs(k @ way.reshape(-1) - slope.reshape(-1)).max() < 1e-4 * np.abs(k).max()


# ---- the same as relaxation ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "kind, with_joints, large",
    [("cross", False, True), ("quad", False, False), ("mixed", False, True), ("mixed", True, True)],
)
def test_the_same_as_relaxation(kind, with_joints, large):
    """A body on rollers under its weight and tractions, pressed and sheared: stresses and displacements to 1e-6."""
    sim, slow = leaning(kind, with_joints), leaning(kind, with_joints)
    sim.option(dynamic=False, large_strain=large)
    found = equilibrium_.solve_elastic(sim)
    assert found.ratio < 1e-9 and found.iterations <= 5 and found.factors <= 2 and found.solver.startswith("direct")
    assert diagnostics.unbalanced_ratio(sim) == pytest.approx(found.ratio, rel=1e-6)
    assert sim.clock.step == 1 and sim.clock.time == 0.0
    slow.option(dynamic=False, large_strain=large)
    assert convergence.solve(slow, ratio=3e-9, cycles=50000).reason == "ratio"
    assert farthest(sim, slow) < 1e-6
    if with_joints:
        assert farthest(sim, slow, ("opening", "slip", "normal_stress", "shear_stress")) < 1e-5


def test_a_beam_that_bends_far():
    """Tip of a cantilever moved by a fifth of its length: rotations of 0.3, follower loads, the same as relaxation."""

    def beam() -> Blocks:
        mesh = rectangle(20, 2, 1.0, 0.1, kind="quad")
        sim = model(mesh)
        sim.element_property(None, {"young": 1e6})
        x = mesh.points[:, 0]
        sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0, vy=0.0)
        edges = mesh.edges()
        top = (mesh.points[edges.points][:, :, 1] > 0.1 - 1e-9).all(axis=1)
        sim.stress_condition(edges.faces[top, 0], normal=-150.0)
        sim.option(**QUIET)
        return sim

    sim, slow = beam(), beam()
    found = equilibrium_.solve_elastic(sim, ratio=1e-9)
    assert found.iterations <= 15
    assert 0.15 < -diagnostics.values(sim, "displacement_y").min() < 0.4
    assert convergence.solve(slow, ratio=1e-9, cycles=100000).reason == "ratio"
    assert farthest(sim, slow) < 1e-6


def test_what_was_removed_and_left_forces_behind():
    """The forces left behind have died down in equilibrium: the state is that of a model without these elements."""
    sim, gone = leaning("mixed", True), leaning("mixed", True)
    hole = np.flatnonzero(np.hypot(*(sim.mesh.centroids() - [0.4, 0.3]).T) < 0.12)
    for one in (sim, gone):
        one.option(dynamic=False)
    equilibrium_.solve_elastic(sim)
    changes.null(sim, hole, relax=1000)
    equilibrium_.solve_elastic(sim)
    assert not sim.relaxations
    changes.null(gone, hole)
    equilibrium_.solve_elastic(gone)
    assert farthest(sim, gone) < 1e-8
    convergence.advance(sim, 200)
    assert diagnostics.unbalanced_ratio(sim) < 1e-8


# ---- closed forms --------------------------------------------------------------------------------------------------


@EVERY_KIND
def test_patch(kind):
    """A linear displacement of the surface, prescribed in one go and in units of time: uniform stress to 1e-10 E."""
    sim = model(shaken(rectangle(5, 4, 1.0, 0.8, kind=kind), 0.25))
    sim.option(**QUIET)
    outside = boundary(sim.mesh)
    for node, (vx, vy) in zip(outside, (sim.mesh.points[outside] @ STRAIN.T / 7.0).tolist()):
        sim.velocity_condition([node], vx=vx, vy=vy)
    equilibrium_.solve_elastic(sim, cycles=7)
    assert sim.clock.step == 7
    expected = LAMBDA * np.trace(STRAIN) * np.eye(2) + 2.0 * MU * STRAIN
    for name, (i, j) in {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)}.items():
        assert diagnostics.values(sim, f"stress_{name}") == pytest.approx(expected[i, j], abs=1e-10 * ROCK["young"])
    for axis, column in (("x", 0), ("y", 1)):
        linear = sim.mesh.points @ STRAIN.T[:, column]
        assert diagnostics.values(sim, f"displacement_{axis}") == pytest.approx(
            linear, abs=1e-10 * np.abs(linear).max()
        )
    # Forces by which the surface is moved are those of the stress: sum over the right side is sigma n L.
    right = np.flatnonzero(sim.mesh.points[:, 0] > 1.0 - 1e-9)
    middle = right[(sim.mesh.points[right, 1] > 1e-9) & (sim.mesh.points[right, 1] < 0.8 - 1e-9)]
    assert diagnostics.total(sim, "reaction_x", middle) == pytest.approx(expected[0, 0] * 0.6, rel=2e-3)


def test_rollers_on_an_oblique_plane():
    """A bar between two planes at 30 degrees, all turned: uniaxial strain along the bar. sigma = (lambda + 2 mu) e."""
    turn = math.radians(30.0)
    along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    flat = rectangle(6, 3, 1.2, 0.6, kind="mixed")
    mesh = Mesh.of(flat.points @ np.array([along, across]), flat.cells)
    sim = model(mesh)
    sim.option(**QUIET, large_strain=False)
    x, y = flat.points.T
    sides, ends = (y < 1e-9) | (y > 0.6 - 1e-9), (x < 1e-9) | (x > 1.2 - 1e-9)
    sim.move_constraint(np.flatnonzero(sides & ~ends), 2, tuple(along))
    sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0, vy=0.0)
    # A component prescribed and the constraint: the motion along the line that has this component.
    moved = np.flatnonzero(x > 1.2 - 1e-9)
    sim.velocity_condition(moved, vx=float(1e-5 * along[0]))
    sim.move_constraint(moved, 2, tuple(along))
    with pytest.raises(CommandError, match=rf"node {moved[0]} at \(.*type 2\) and velocity-x .* and velocity-y 1"):
        sim.velocity_condition(moved, vy=1.0)
    equilibrium_.solve_elastic(sim)
    stress = (LAMBDA + 2.0 * MU) * 1e-5 / 1.2
    found = [diagnostics.values(sim, name) for name in STRESSES]
    tensor = np.array([[found[0], found[2]], [found[2], found[1]]])
    assert np.einsum("i,ijn,j->n", along, tensor, along) == pytest.approx(stress, rel=1e-8)
    assert np.einsum("i,ijn,j->n", across, tensor, across) == pytest.approx(
        stress * LAMBDA / (LAMBDA + 2 * MU), rel=1e-8
    )
    assert diagnostics.values(sim, "velocity_x", moved) == pytest.approx(1e-5 * along[0])


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_weight_on_rollers(kind):
    """sigma_yy = -rho g depth, sigma_xx = nu / (1 - nu) sigma_yy at the centroids of elements, to 0.5 % of the largest,
    in a box of 20 x 10 m, nu = 0.3. Elements have one stress: it is exact where their forces meet those of gravity, so
    the reaction of the floor is the weight to rounding. (Where triangles and quads alternate gravity falls unevenly on
    the nodes: 0.6 % at this size.)"""
    mesh = rectangle(40, 20, 20.0, 10.0, kind=kind)
    sim = model(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {"density": 2500.0, "young": 1e9, "poisson_ratio": 0.3})
    x, y = mesh.points.T
    floor = np.flatnonzero(y < 1e-9)
    sim.velocity_condition(floor, vy=0.0)
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 20.0 - 1e-9)), vx=0.0)
    sim.gravity(0.0, -9.81)
    sim.option(**QUIET)
    equilibrium_.solve_elastic(sim)
    vertical = -2500.0 * 9.81 * (10.0 - mesh.centroids()[:, 1])
    largest = 2500.0 * 9.81 * 10.0
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(vertical, abs=0.005 * largest)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(0.3 / 0.7 * vertical, abs=0.005 * largest)
    assert np.abs(diagnostics.values(sim, "stress_xy")).max() < 0.005 * largest
    assert diagnostics.total(sim, "reaction_y", floor) == pytest.approx(largest * 20.0, rel=1e-9)


def test_joints_open_by_their_parabola():
    """A column of squares pulled at its end by t < T: every joint opens by o = o_p (1 - sqrt(1 - t / T)), from
    t = T (2 r - r^2) with o_p = 2 h T / P, and the column between strains by t / (lambda + 2 mu)."""
    n, height, pull = 8, 0.8, 1.6e6
    mesh = rectangle(1, n, 0.1, height, kind="quad")
    sim = jointed(model(mesh))
    sim.option(**QUIET, large_strain=False)
    y = mesh.points[:, 1]
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    edges = mesh.edges()
    top = (mesh.points[edges.points][:, :, 1] > height - 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[top, 0], yy=pull)
    equilibrium_.solve_elastic(sim)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(pull, rel=1e-9)
    t, p = JOINT["tensile_strength"], JOINT["penalty_normal"]
    opening = 2.0 * 0.1 * t / p * (1.0 - math.sqrt(1.0 - pull / t))
    assert diagnostics.values(sim, "opening") == pytest.approx(opening, rel=1e-6)
    end = np.flatnonzero(y > height - 1e-9)
    assert diagnostics.values(sim, "displacement_y", end) == pytest.approx(
        height * pull / (LAMBDA + 2 * MU) + (n - 1) * opening, rel=1e-6
    )
    assert diagnostics.joint_counts(sim) == (n - 1, 0, 0)


def test_initial_stress_that_is_in_balance_moves_nothing():
    """The stress of the weight, given beforehand by its gradient: displacements are zero."""
    mesh = rectangle(8, 8, 8.0, 8.0, kind="quad")
    sim = model(mesh)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 8.0 - 1e-9)), vx=0.0)
    sim.gravity(0.0, -10.0)
    sim.option(**QUIET)
    weight = ROCK["density"] * 10.0
    free = model(mesh)  # the same without initial stress
    for one in (free,):
        one.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
        one.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 8.0 - 1e-9)), vx=0.0)
        one.gravity(0.0, -10.0)
        one.option(**QUIET)
    sim.initial_stress(None, yy=-8.0 * weight, gradient={"yy": (0.0, weight)})
    for one in (sim, free):
        equilibrium_.solve_elastic(one)
    assert (
        np.abs(diagnostics.values(sim, "displacement_y")).max()
        < 1e-9 * np.abs(diagnostics.values(free, "displacement_y")).max()
    )


@pytest.mark.parametrize("powers", [6, 9, 12])
def test_soft_rock_under_stiff_rock(powers):
    """Moduli that differ by many powers of ten, in series: uniaxial strain by sigma / (lambda + 2 mu) of each half. At
    1e12 the last bit of a position in the stiff half is as much as the load: that is said."""
    mesh = rectangle(3, 6, 0.3, 0.6, kind="cross")
    sim = model(mesh)
    soft = np.flatnonzero(mesh.centroids()[:, 1] < 0.3)
    hard = np.setdiff1d(np.arange(len(mesh.cells)), soft)
    sim.element_property(soft, {"young": 1e3})
    sim.element_property(hard, {"young": 1e3 * 10.0**powers})
    y = mesh.points[:, 1]
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    edges = mesh.edges()
    top = (mesh.points[edges.points][:, :, 1] > 0.6 - 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[top, 0], yy=-0.1)
    sim.option(**QUIET, large_strain=False)
    if powers == 12:
        refused(sim, "did not converge: .* rounding of positions .* too many orders of magnitude")
        return
    equilibrium_.solve_elastic(sim)
    m = 1e3 * 0.75 / (1.25 * 0.5)
    assert diagnostics.values(sim, "stress_yy", soft) == pytest.approx(-0.1, rel=1e-4)
    assert diagnostics.values(sim, "displacement_y", np.flatnonzero(y > 0.3 - 1e-9)) == pytest.approx(
        -0.1 / m * 0.3, rel=1e-4
    )


def test_far_from_the_origin():
    """Coordinates of a map: the balance that is reached is what rounding allows, the same stress comes out and the log
    says so."""
    found = []
    for shift in (0.0, 5e6):
        mesh = rectangle(6, 4, 6.0, 4.0, x0=shift, kind="quad")
        sim = on_floor(mesh)
        sim.gravity(0.0, -9.81)
        lines: list[str] = []
        sim.log = type("Log", (), {"info": lambda self, text, lines=lines: lines.append(text)})()
        found.append((equilibrium_.solve_elastic(sim).ratio, diagnostics.values(sim, "stress_yy"), lines))
    (near, exact, quiet), (far, rounded, told) = found
    assert near < 1e-8 < far < 1e-3 and not quiet and "smaller than the rounding of positions" in told[-1]
    assert rounded == pytest.approx(exact, abs=1e-2 * np.abs(exact).max())


# ---- what follows --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind, with_joints", [("cross", False), ("quad", False), ("mixed", True)])
def test_motion_that_continues_from_there_is_none(kind, with_joints):
    """Loads stay and motion begins: what moves is rounding, 1e-12 of the elastic energy, and stresses stay. With
    contact armed, too."""
    sim = leaning(kind, with_joints)
    sim.option(dynamic=False, collision=True)
    equilibrium_.solve_elastic(sim)
    before = [diagnostics.values(sim, name) for name in STRESSES]
    sim.option(dynamic=True)
    convergence.advance(sim, 300)
    assert diagnostics.total(sim, "kinetic_energy") < 1e-12 * diagnostics.total(sim, "strain_energy")
    for name, values in zip(STRESSES, before):
        assert diagnostics.values(sim, name) == pytest.approx(values, abs=1e-7 * np.abs(values).max())
    assert sim.clock.time > 0.0


def test_in_dynamic_mode_time_is_at_rest_and_the_budget_calls_it_a_command():
    sim = leaning("cross")
    diagnostics.account_energy(sim)
    sim.step()
    time = sim.clock.time
    equilibrium_.solve_elastic(sim)
    assert sim.clock.time == time > 0.0 and np.abs(diagnostics.values(sim, "velocity_x")).max() == 0.0
    convergence.advance(sim, 50)
    energies = diagnostics.energies(sim)
    assert energies["commands"] == pytest.approx(diagnostics.total(sim, "strain_energy"), rel=1e-2)
    assert abs(energies["closing"]) < 1e-9 * energies["commands"]


def test_a_stage_is_like_any_other(tmp_path):
    """Solve, save, solve on: the same bits as without the file."""

    def begin() -> Blocks:
        sim = leaning("mixed", True)
        sim.option(dynamic=False)
        equilibrium_.solve_elastic(sim)
        return sim

    def go_on(sim: Blocks) -> list[np.ndarray]:
        changes.null(sim, np.flatnonzero(np.hypot(*(sim.mesh.centroids() - [0.4, 0.3]).T) < 0.12))
        equilibrium_.solve_elastic(sim)
        convergence.advance(sim, 20)
        return state(sim)

    sim = begin()
    saved_state.save(sim, tmp_path / "middle.sav")
    straight = go_on(begin())
    again = Blocks()
    saved_state.restore(again, tmp_path / "middle.sav")
    for a, b in zip(straight, go_on(again)):
        assert np.array_equal(a, b)


# ---- what is refused -----------------------------------------------------------------------------------------------


def refused(sim: Blocks, told: str, **how) -> None:
    """The solve says why not, and the model is as it was."""
    before, relaxations, step = state(sim), list(sim.relaxations), sim.clock.step
    with pytest.raises(CommandError, match=told):
        equilibrium_.solve_elastic(sim, **how)
    for a, b in zip(before, state(sim)):
        assert np.array_equal(a, b)
    assert sim.relaxations == relaxations and sim.clock.step == step


def test_bodies_that_can_move():
    low, high = rectangle(4, 2, 1.0, 0.5), rectangle(2, 2, 0.5, 0.5, x0=3.0, y0=2.0)
    sim = on_floor(joined(low, high))
    sim.gravity(0.0, -9.81)
    refused(sim, r"body of 8 elements around \(3.25, 2.25\), with element 16, can move in x in y and turn: fix it")
    ends = np.flatnonzero((sim.mesh.points[:, 0] > 2.9) & (sim.mesh.points[:, 1] < 2.0 + 1e-9))
    sim.velocity_condition(ends, vy=0.0)
    refused(sim, r"with element 16, can move in x: fix it")
    sim.remove_conditions(ends)
    sim.move_constraint(ends[:1], 1)
    refused(sim, r"with element 16, can move about some point")
    sim.move_constraint(ends[1:2], 2, (1.0, 0.0))
    assert equilibrium_.solve_elastic(sim).ratio < 1e-8


def test_parts_between_open_joints_are_bodies_of_their_own():
    sim = on_floor(rectangle(2, 4, 0.5, 1.0, kind="quad"))
    jointed(sim)
    y = np.abs(diagnostics.values(sim, "joint_position_y") - 0.5) < 1e-9
    changes.crack(sim, sim.numbers_of_joints(None)[y])
    refused(sim, "body of 4 elements .* and 0|body of 4 elements around")


def test_conditions_without_equilibrium():
    sim = on_floor(rectangle(2, 2, 1.0, 1.0))
    top = np.flatnonzero(sim.mesh.points[:, 1] > 1.0 - 1e-9)
    sim.velocity_condition(top, ax=1.0)
    refused(sim, f"node {top[0]} has a prescribed acceleration")
    sim.velocity_condition(top, vx=1e-6)
    sim.option(dynamic=True)
    refused(sim, f"node {top[0]} moves at a prescribed velocity: there is no equilibrium in dynamic mode")
    sim.option(dynamic=False)
    equilibrium_.solve_elastic(sim)
    for how in ({"cycles": 0}, {"ratio": 0.0}, {"ratio": math.nan}, {"solver": "cg"}):
        refused(sim, "must be positive, solver one of auto, direct, petsc", **how)


def test_joints_that_would_pass_their_peak():
    sim = on_floor(rectangle(3, 6, 0.5, 1.0))
    jointed(sim, tensile_strength=1e5, cohesion=2e5)
    top = np.flatnonzero(sim.mesh.points[:, 1] > 1.0 - 1e-9)
    sim.velocity_condition(top, vy=1e-5)
    refused(sim, r"\d+ joints would pass their peak: .*[Uu]se relaxation")
    sim.velocity_condition(top, vy=1e-7)
    equilibrium_.solve_elastic(sim)
    convergence.advance(sim, 40)
    assert diagnostics.joint_counts(sim)[1] > 0
    refused(sim, r"\d+ joints are past their peak already")


def test_surfaces_that_touch():
    base, block = rectangle(4, 2, 1.0, 0.5), rectangle(2, 2, 0.4, 0.4, x0=0.3, y0=0.5 - 1e-6)
    sim = model(joined(base, block))
    outer = np.flatnonzero((sim.mesh.points[:, 1] < 1e-9) | (sim.mesh.points[:, 1] > 0.9 - 1e-5))
    sim.velocity_condition(outer, vx=0.0, vy=0.0)
    sim.option(dynamic=False)
    refused(sim, r"\d+ pairs of surfaces are in contact, the first of elements \d+ and \d+: .*relaxation")
    sim.option(collision=False)
    sim.gravity(0.0, -9.81)
    equilibrium_.solve_elastic(sim)


@pytest.mark.parametrize("speed, touches", [(-1e-5, True), (1e-5, False)])
def test_a_crack_that_closes(speed, touches):
    """Two halves with a crack along half of the line between them: pulled apart it opens, pressed its faces touch."""
    mesh = rectangle(6, 6, 1.0, 1.0)
    edges = mesh.edges()
    ends = mesh.points[edges.points]
    on = edges.inner & (np.abs(ends[:, :, 1] - 0.5) < 1e-9).all(axis=1) & (ends[:, :, 0] < 0.5 + 1e-9).all(axis=1)
    sim = model(Mesh.of(mesh.points, mesh.cells, cracks=edges.points[on]))
    y = mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 1.0 - 1e-9), vx=0.0, vy=speed)
    sim.option(dynamic=False)
    if touches:
        refused(sim, r"\d+ pairs of surfaces are in contact in the equilibrium")
        return
    equilibrium_.solve_elastic(sim)
    slow = model(sim.mesh)
    slow.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    slow.velocity_condition(np.flatnonzero(y > 1.0 - 1e-9), vx=0.0, vy=speed)
    slow.option(dynamic=False)
    convergence.advance(slow, 1)
    slow.velocity_condition(np.flatnonzero(y > 1.0 - 1e-9), vy=0.0)
    convergence.solve(slow, ratio=1e-9, cycles=20000)
    assert farthest(sim, slow) < 1e-6


def test_loads_that_turn_elements_inside_out():
    sim = on_floor(rectangle(2, 2, 1.0, 1.0))
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] > 1.0 - 1e-9), vx=0.0, vy=-1.5)
    refused(sim, "did not converge|inverted|singular")


def test_without_petsc(monkeypatch):
    class Log:
        lines: list[str] = []

        def warn_once(self, key, text):
            self.lines.append(text)

        def info(self, text):
            self.lines.append(text)

    monkeypatch.setattr(equilibrium, "petsc_there", lambda: False)
    sim = leaning("cross")
    sim.option(dynamic=False)
    refused(sim, "petsc4py is not installed.*use solver direct", solver="petsc")
    monkeypatch.setattr(equilibrium, "MANY", 10)
    sim.log = Log()
    assert equilibrium_.solve_elastic(sim).solver.startswith("direct")
    assert "are solved on one rank, as petsc4py is missing" in sim.log.lines[0]


@pytest.mark.petsc
@pytest.mark.parametrize("mumps", [True, False])
def test_petsc_gives_the_same(monkeypatch, mumps):
    """With and without MUMPS, to 1e-9 of the largest."""
    if not mumps:
        monkeypatch.setattr(linear, "_mumps_there", lambda petsc: False)
    sim, other = leaning("mixed", True), leaning("mixed", True)
    for one in (sim, other):
        one.option(dynamic=False)
    equilibrium_.solve_elastic(sim)
    found = equilibrium_.solve_elastic(other, solver="petsc")
    assert found.solver == ("PETSc (MUMPS)" if mumps else "PETSc (GMRES, multigrid)")
    assert farthest(other, sim) < 1e-9
    assert linear.petsc_there()
