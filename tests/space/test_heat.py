"""Heat in tetrahedra and hexahedra: the arithmetic, conditions, contacts, cracks, thermal stress in each law."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np
import pytest

from hpcdem.commands.fdem.project import joined
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.fdem.tetrahedra import FACES
from hpcdem.physics.heat import kernels_space, reference
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from tests.heat import exact
from tests.heat.support import GRANITE, temperatures, until
from tests.space.support import ROCK, body, box, faces_on, hexes, nodes_on

DENSITY = 2500.0
DIFFUSIVITY = GRANITE["conductivity"] / (DENSITY * GRANITE["capacity"])
YOUNG, POISSON, ALPHA = ROCK["young"], ROCK["poisson_ratio"], 1e-5
INTERFACE = "classic_intrinsic_cohesive_interface"
JOINT = {"friction": 30.0, "cohesion": 2e7, "tensile_strength": 1e7, "gf1": 50.0, "gf2": 200.0, "penalty_normal": 5e12}


def standing(mesh: Mesh, **changes_: float) -> tuple[Blocks, Heat]:
    """A body that does not move, through which heat flows."""
    sim = body(mesh, density=DENSITY)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, **changes_})
    sim.parts(mechanical=False)
    return sim, heat


BOTH = pytest.mark.parametrize("of", [box, hexes])


def put(heat: Heat, values: np.ndarray) -> None:
    """Every node has its temperature."""
    for node, value in enumerate(values.tolist()):
        heat.initial(np.array([node]), value)


def test_conduction_is_what_the_plain_loop_does() -> None:
    """Anisotropic tetrahedra of any shape: planes with a strike of 35 and a dip of 50 degrees."""
    mesh = box((3, 2, 2), (1.2, 0.8, 0.9), shaken=0.2)
    sim, heat = standing(mesh, conductivity_across=0.7, conductivity_angle=35.0, conductivity_dip=50.0)
    sim.heat_clock(dt=100.0)
    start = np.random.default_rng(4).uniform(0.0, 100.0, len(mesh.points))
    put(heat, start)
    heat.prescribe(np.array([3, 9]), 50.0)
    strike, dip = math.radians(35.0), math.radians(50.0)
    normal = np.array([-math.sin(strike) * math.sin(dip), math.cos(strike) * math.sin(dip), math.cos(dip)])
    k = 2.5 * np.eye(3) + (0.7 - 2.5) * np.outer(normal, normal)
    many = len(mesh.cells)
    wanted = reference.sub_step(
        mesh.points, mesh.cells, np.tile(k, (many, 1, 1)), np.full(many, DENSITY * 1000.0), start, 100.0,
        {3: 50.0, 9: 50.0},
    )  # fmt: skip
    sim.step()
    assert temperatures(sim) == pytest.approx(wanted, rel=1e-12)
    assert np.abs(wanted - start).max() > 0.5


def test_conduction_in_hexahedra_is_the_mean_of_that_in_both_overlays() -> None:
    """Of any shape, beside tetrahedra of the plain loop."""
    one, other = hexes((3, 2, 2), (1.2, 0.8, 0.9), shaken=0.2), box((2, 1, 1), (0.4, 0.3, 0.3))
    mesh = joined(one, Mesh.of(other.points + (2.0, 0.0, 0.0), other.cells))
    sim, heat = standing(mesh, conductivity_across=0.7, conductivity_angle=35.0, conductivity_dip=50.0)
    sim.heat_clock(dt=100.0)
    start = np.random.default_rng(4).uniform(0.0, 100.0, len(mesh.points))
    put(heat, start)
    heat.prescribe(np.array([3, 9]), 50.0)
    parts = mesh.hexes[:, :8][:, OVERLAYS].reshape(-1, 4)
    every = np.concatenate([parts, mesh.cells[mesh.macro_of() < 0]])
    half = np.append(np.full(len(parts), 0.5), np.ones(len(every) - len(parts)))
    strike, dip = math.radians(35.0), math.radians(50.0)
    normal = np.array([-math.sin(strike) * math.sin(dip), math.cos(strike) * math.sin(dip), math.cos(dip)])
    k = 2.5 * np.eye(3) + (0.7 - 2.5) * np.outer(normal, normal)
    wanted = reference.sub_step(
        mesh.points, every, half[:, None, None] * k, half * DENSITY * 1000.0, start, 100.0, {3: 50.0, 9: 50.0}
    )
    sim.step()
    assert temperatures(sim) == pytest.approx(wanted, rel=1e-12)
    assert np.abs(wanted - start).max() > 0.5


def test_upright_planes_are_those_of_two_dimensions() -> None:
    """With the dip of 90 degrees that is not said; along z heat flows as along the planes."""
    for angle, wanted in ((0.0, (2.5, 0.7, 2.5)), (90.0, (0.7, 2.5, 2.5))):
        sim, heat = standing(box((1, 1, 1), (1.0, 1.0, 1.0)), conductivity_across=0.7, conductivity_angle=angle)
        sim.close_model()
        found = heat._conductivities(heat.row[:1])[0]
        assert found[[0, 1, 3]] == pytest.approx(wanted, rel=1e-14) and np.abs(found[[2, 4, 5]]).max() < 1e-15


@BOTH
def test_a_linear_field_stays(of: Any) -> None:
    mesh = of((4, 3, 3), (1.0, 0.8, 0.9), shaken=0.2)
    sim, heat = standing(mesh)
    wanted = 20.0 + mesh.points @ (30.0, -10.0, 25.0)
    put(heat, wanted)
    for node in np.unique(np.concatenate([nodes_on(mesh, side) for side in mesh.layers])).tolist():
        heat.prescribe(np.array([node]), float(wanted[node]))
    for _ in range(20):
        sim.step()
    assert np.abs(temperatures(sim) - wanted).max() < 1e-11


def partly_hexes(cells: tuple[int, int, int], size: tuple[float, float, float], shaken: float = 0.0) -> Mesh:
    """Hexahedra below, tetrahedra on them."""
    made = hexes(cells, size, shaken)
    low = hexes(cells, size).points[made.hexes[:, :8]].mean(axis=1)[:, 2] < 0.5 * size[2]
    return Mesh.of(made.points, made.cells, layers=made.layers, macros=made.hexes[low])


def test_hexahedra_beside_tetrahedra() -> None:
    """Tetrahedra have one of both ways to cut the sides between: a linear field is one within 4 %. Steps of nine
    tenths of the stability limit that is told are stable, those above the largest eigenvalue's are not."""
    mesh = partly_hexes((3, 3, 4), (1.0, 0.8, 0.9), shaken=0.2)
    assert 0 < len(mesh.hexes) * 6 < len(mesh.cells)
    sim, heat = standing(mesh)
    heat.prescribe(nodes_on(mesh, "bottom"), 0.0)
    heat.prescribe(nodes_on(mesh, "top"), 90.0)
    run = Implicit(sim)
    run.steady()
    run.close()
    before = temperatures(sim)
    assert np.abs(before - 100.0 * mesh.points[:, 2]).max() < 3.6
    sim.step()
    assert np.abs(temperatures(sim) - before).max() < 1e-9
    sim, heat = standing(mesh)
    limit = heat_limit(sim, heat)
    assert 1.0 <= limit / heat.limit() < 1.5
    rough = np.random.default_rng(2).uniform(-1.0, 1.0, len(mesh.points))
    put(heat, rough)
    sim.heat_clock(dt=0.9 * heat.limit())
    for _ in range(200):
        sim.step()
    assert np.abs(temperatures(sim)).max() < 0.5
    put(heat, rough)
    sim.heat_clock(dt=1.1 * limit)
    for _ in range(200):
        sim.step()
    assert np.abs(temperatures(sim)).max() > 10.0


def heat_limit(sim: Blocks, heat: Heat) -> float:
    """2 over the largest eigenvalue of all that conducts over its capacity [s]."""
    sim.close_model()
    run = Implicit(sim)
    n = len(heat.at.leads)
    k, c = np.zeros((n, n)), np.zeros(n)
    for piece in run._pieces(math.inf):
        ends = piece.node
        for m in range(len(ends)):
            k[np.ix_(ends[m], ends[m])] += piece.stiffness[m, ::2, ::2]
    np.add.at(c, heat.at.number[4 * sim.number[:, None] + np.arange(4)], heat._corner_capacity)
    root = 1.0 / np.sqrt(c)
    return 2.0 / float(np.linalg.eigvalsh(root[:, None] * k * root)[-1])


@BOTH
def test_a_slab_follows_its_series_with_order_two(of: Any) -> None:
    time, errors = 0.15 / DIFFUSIVITY, []
    for n in (8, 16, 32):
        mesh = of((n, 1, 1), (1.0, 1.0 / n, 1.0 / n))
        sim, heat = standing(mesh)
        heat.prescribe(nodes_on(mesh, "left"), 100.0)
        until(sim, time)
        wanted = 100.0 * exact.slab(mesh.points[:, 0], time, 1.0, DIFFUSIVITY)
        errors.append(float(np.abs(temperatures(sim) - wanted).max()) / 100.0)
        assert heat.account()["relative"] < 1e-12
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert errors[-1] < 1e-3 and (orders > 1.8).all(), (errors, orders)


@BOTH
def test_transfer_and_flux_through_faces(of: Any) -> None:
    """Biot number 2 against the series; 12 W/m2 through 0.02 m2 by a table that rises to twice of it."""
    time, mesh = 0.3 / DIFFUSIVITY, of((40, 1, 1), (1.0, 0.025, 0.025))
    h = 2.0 * GRANITE["conductivity"]
    sim, heat = standing(mesh, transfer_coeficient=h)
    heat.initial(None, 80.0)
    heat.expose(faces_on(mesh, "right"), environment=20.0)
    until(sim, time)
    wanted = 20.0 + 60.0 * exact.convective_slab(mesh.points[:, 0], time, 1.0, DIFFUSIVITY, 2.0)
    assert np.abs(temperatures(sim) - wanted).max() < 0.06
    assert heat.account()["relative"] < 1e-12
    mesh = of((4, 2, 2), (1.0, 0.2, 0.1))
    sim, heat = standing(mesh)
    sim.table("sun", [(0.0, 0.0), (1000.0, 24.0)])
    heat.expose(faces_on(mesh, "right"), flux="sun")
    sim.heat_clock(dt=10.0)
    for _ in range(100):
        sim.step()
    assert heat.account()["given"] == pytest.approx(0.02 * 24.0 * 0.495 * 1000.0, rel=1e-12)
    assert heat.account()["stored"] == pytest.approx(heat.account()["given"], rel=1e-12)


@BOTH
def test_an_implicit_step_is_backward_euler_and_steady_states_are_found_at_once(of: Any) -> None:
    mesh = of((6, 2, 2), (1.2, 0.4, 0.5), shaken=0.2)
    sim, heat = standing(mesh, conductivity_across=1.0, conductivity_dip=30.0)
    sim.table("ramp", [(0.0, 10.0), (1e6, 90.0)])
    left = nodes_on(mesh, "left")
    heat.prescribe(left, "ramp")
    heat.expose(faces_on(mesh, "right"), environment=40.0, transfer=7.0, flux=12.0)
    sim.close_model()
    run = Implicit(sim)
    for _ in range(3):
        before = temperatures(sim)
        run.advance(1e5)
        after = temperatures(sim)
    sim.heat_clock(dt=1e-3)  # an explicit step shows the inflow
    sim.step()
    rate = (temperatures(sim) - after) / 1e-3
    free = np.setdiff1d(np.arange(len(mesh.points)), left)
    assert (after - before)[free] / 1e5 == pytest.approx(rate[free], rel=1e-4)
    assert run.factors == 1 and heat.account()["relative"] < 1e-12
    heat.adjust(None, {"conductivity_across": 2.5})
    heat.prescribe(left, 100.0)
    heat.expose(faces_on(mesh, "right"), flux=0.0, transfer=2.5 / 1.2)  # as much resistance as 1.2 m of rock
    run.steady()
    run.close()
    assert temperatures(sim) == pytest.approx(100.0 - 30.0 * mesh.points[:, 0] / 1.2, rel=1e-9)


@pytest.mark.parametrize("of, jointed", [(box, False), (box, True), (hexes, False), (hexes, True)])
def test_blocks_are_in_equilibrium_at_the_end_of_implicit_steps(of: Any, jointed: bool) -> None:
    """Between walls along x, free across: stress follows the temperature; joints are 100 E stiff."""
    mesh = of((4, 2, 2), (1.2, 0.8, 0.9))
    sim = body(mesh, dynamic=False)
    if jointed:
        sim.joint_model(None, INTERFACE, {**JOINT, "penalty_normal": 100.0 * YOUNG})
    for axis, low in (("x", "left"), ("y", "front"), ("z", "bottom")):
        sim.velocity_condition(nodes_on(mesh, low), **{f"v{axis}": 0.0})
    sim.velocity_condition(nodes_on(mesh, "right"), vx=0.0)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    sim.table("warming", [(0.0, 0.0), (1e6, 50.0)])
    heat.prescribe(None, "warming")
    run = Implicit(sim)
    for k in range(2):
        run.advance(5e5)
        wanted = -YOUNG * ALPHA * 25.0 * (k + 1)
        found = diagnostics.values(sim, "stress_xx")
        assert found == pytest.approx(wanted, rel=0.05 if jointed else 1e-3), k
        assert np.abs(diagnostics.values(sim, "stress_yy")).max() < (0.05 if jointed else 1e-3) * abs(wanted)
        assert diagnostics.unbalanced_ratio(sim) < 1e-6
    run.close()


def test_kernel_of_touching_faces() -> None:
    """Triangles in any position: heat at each corner for temperatures of one corner alone is h times the integral of
    its shape function over what they see of each other, found by sampling."""
    rng = np.random.default_rng(3)
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, -1.0]])
    cells = np.array([[0, 1, 2, 3]])
    face = int(np.flatnonzero(~(np.sort(Mesh.of(place, cells).face_points(np.arange(4)), axis=1) == 3).any(axis=1))[0])
    u, v = (part.reshape(-1) for part in np.meshgrid((np.arange(700) + 0.5) / 700, (np.arange(700) + 0.5) / 700))
    inside = u + v < 1.0
    seen = 0
    for _ in range(12):
        other = place * (1.0, 1.0, -1.0) + rng.uniform(-0.3, 0.3, (4, 3)) * (1.0, 1.0, 0.03)
        meshes = Mesh.of(place, cells), Mesh.of(other, cells[:, [1, 0, 2, 3]])
        x, faces = np.zeros((2, 16)), []
        corners = []
        for i, mesh in enumerate(meshes):
            x[i].reshape(4, 4)[:, :3] = mesh.points[mesh.cells[0]]
            faces += [f for f in range(4) if 3 not in mesh.face_points(np.array([f]))[0]]
            corners.append(mesh.points[mesh.face_points(np.array([faces[-1]]))[0]])
        assert face == faces[0]
        args = (
            meshes[0].face_corners(np.array(faces[:1])),
            4 + meshes[1].face_corners(np.array(faces[1:])),
            np.ones(1),
            x,
            np.array([2.0, 2.0]),
            4e-3,
            0.2,
        )
        nothing = np.empty((0, 6), np.int64), np.empty((0, 6)), np.empty(0)
        many = kernels_space.touching(*args, *nothing)
        corner, weight, pass_on = np.zeros((many, 6), np.int64), np.zeros((many, 6)), np.zeros(many)
        assert kernels_space.touching(*args, corner, weight, pass_on) == many
        assert (pass_on > 0.0).all() and (weight[:, :3] > -1e-12).all() and (weight[:, 3:] < 1e-12).all()
        (a, b, c), (d, e, f) = corners
        normal = np.cross(b - a, c - a)
        double = np.linalg.norm(normal)
        points = a + u[inside, None] * (b - a) + v[inside, None] * (c - a)
        solved = np.linalg.solve(np.column_stack([e - d, f - d, -normal / double]), (points - d).T).T
        there = (solved[:, :2] >= 0.0).all(axis=1) & (solved[:, :2].sum(axis=1) <= 1.0)
        there &= (solved[:, 2] <= 4e-3) & (solved[:, 2] >= -0.2)
        parts = np.column_stack([1.0 - u[inside] - v[inside], u[inside], v[inside]])[there]
        of_other = np.column_stack([1.0 - solved[:, :2].sum(axis=1), solved[:, :2]])[there]
        wanted = 2.0 * double / 700**2 * np.concatenate([parts.sum(axis=0), -of_other.sum(axis=0)])
        assert pass_on @ weight == pytest.approx(wanted, abs=2e-3)
        seen += bool(many)
    assert seen > 8


GAP = 1e-5


def two_boxes(of: Any = box, **changes_: float) -> tuple[Blocks, Heat, Mesh]:
    """One above the other, ten micrometres apart, faces do not match."""
    low, high = of((2, 2, 2), (1.0, 1.0, 1.0)), box((3, 3, 2), (1.0, 1.0, 1.0), split=5)
    mesh = joined(low, Mesh.of(high.points + (0.0, 0.0, 1.0 + GAP), high.cells))
    sim, heat = standing(mesh, **changes_)
    sim.option(collision=True)
    return sim, heat, mesh


@BOTH
def test_bodies_that_touch_pass_heat_on(of: Any) -> None:
    """Resistances in series: 1 m, 1 / h of contact, 1 m; explicit steps keep the account."""
    h = 4.0
    sim, heat, mesh = two_boxes(of, transfer_coeficient=h)
    below = np.arange(len(mesh.points)) < 27
    z = mesh.points[:, 2] - np.where(below, 0.0, GAP)
    top = np.flatnonzero(np.abs(z - 2.0) < 1e-9)
    heat.prescribe(np.flatnonzero(z == 0.0), 0.0)
    heat.prescribe(top, 100.0)
    run = Implicit(sim)
    run.steady()
    run.close()
    flow = 100.0 / (2.0 / GRANITE["conductivity"] + 1.0 / h)
    wanted = np.where(below, flow * z / 2.5, 100.0 - flow * (2.0 - z) / 2.5)
    assert temperatures(sim) == pytest.approx(wanted, abs=1e-9)
    heat.prescribe(top, 20.0)
    for _ in range(30):
        sim.step()
    assert heat.account()["relative"] < 1e-12
    apart, other, _ = two_boxes(transfer_coeficient=0.0)
    other.prescribe(np.flatnonzero(z == 0.0), 0.0)
    with pytest.raises(CommandError, match="no steady state"):
        Implicit(apart).steady()


@BOTH
def test_heat_crosses_joints_until_they_break(of: Any) -> None:
    mesh = of((4, 1, 1), (2.0, 0.5, 0.5))
    sim, heat = standing(mesh)
    joints = sim.numbers_of_joints(None)
    sim.joint_model(joints, INTERFACE, JOINT)
    heat.prescribe(nodes_on(mesh, "left"), 100.0)
    heat.prescribe(nodes_on(mesh, "right"), 0.0)
    run = Implicit(sim)
    run.steady()
    wanted = 100.0 - 50.0 * mesh.points[:, 0]
    assert temperatures(sim) == pytest.approx(wanted, abs=1e-9)
    middle = joints[np.abs(mesh.points[mesh.face_points(joints)][:, :, 0] - 1.0).max(axis=1) < 1e-9]
    changes.crack(sim, middle)
    run.steady()
    run.close()
    t, x = temperatures(sim), mesh.points[:, 0]
    assert t[x < 0.9] == pytest.approx(100.0, abs=1e-9) and np.abs(t[x > 1.1]).max() < 1e-9
    heat.adjust(None, {"transfer_coeficient": 5.0})
    sim.option(collision=True)
    run = Implicit(sim)
    run.steady()
    run.close()
    flow = 100.0 / (2.0 / 2.5 + 1.0 / 5.0)
    assert temperatures(sim)[x < 0.9] == pytest.approx((100.0 - flow * x / 2.5)[x < 0.9], abs=1e-9)


STRONG = {**ROCK, "friction": 30.0, "cohesion": 1e12, "tensile": 1e12}
LAWS = {
    "elastic": ("mech_iso_elastic", ROCK), "strong": ("mech_mohr_coulomb", STRONG),
    "creeping": ("mech_burgers", {**ROCK, "maxwell_viscosity": 1e15}),
}  # fmt: skip


def heated(law: str, held: str, warmer: float = 50.0, dynamic: bool = False, of: Any = box) -> tuple[Blocks, Mesh]:
    """A block on rollers, warmed all over while it stands still; held: axes along which its other ends are held too."""
    name, values = LAWS[law]
    mesh = of((3, 2, 2), (1.2, 0.8, 0.9), shaken=0.2)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, name, values)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    heat.initial(None, 15.0)
    sim.option(collision=False)
    for axis, low, high in (("x", "left", "right"), ("y", "front", "back"), ("z", "bottom", "top")):
        sim.velocity_condition(nodes_on(mesh, low), **{f"v{axis}": 0.0})
        if axis in held:
            sim.velocity_condition(nodes_on(mesh, high), **{f"v{axis}": 0.0})
    heat.prescribe(None, 15.0 + warmer)
    sim.heat_clock(dt=1.0)
    sim.parts(mechanical=False)
    sim.step()
    sim.parts(mechanical=True, thermal=False)
    sim.option(dynamic=dynamic)
    return sim, mesh


@pytest.mark.some_of_each
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("of, held", [*((box, held) for held in ("", "x", "xy", "xyz")), (hexes, ""), (hexes, "x")])
def test_thermal_stress(law: str, of: Any, held: str) -> None:
    """Free: alpha T, no stress. Held along one axis -E alpha T, two -E alpha T / (1 - nu), three ... / (1 - 2 nu)."""
    sim, mesh = heated(law, held, of=of)
    convergence.solve(sim, ratio=1e-7)
    level = -YOUNG * ALPHA * 50.0
    wanted = {"": 0.0, "x": level, "xy": level / (1.0 - POISSON), "xyz": level / (1.0 - 2.0 * POISSON)}[held]
    for axis in "xyz":
        found = diagnostics.values(sim, f"stress_{axis}{axis}")
        assert found == pytest.approx(wanted if axis in held else 0.0, rel=3e-3, abs=2e-3 * abs(level)), axis
    if not held:
        move = diagnostics.values(sim, "displacement_x", nodes_on(mesh, "right"))
        assert move == pytest.approx(1.2 * ALPHA * 50.0, rel=2e-3)


@pytest.mark.parametrize("of, held", [(hexes, ""), (hexes, "x"), (hexes, "xyz"), (partly_hexes, "")])
def test_thermal_stress_of_hexahedra_at_once(of: Any, held: str) -> None:
    """By the static solve: nothing without walls, -E alpha T between two of them."""
    sim, _ = heated("elastic", held, of=of)
    equilibrium.solve_elastic(sim)
    level = -YOUNG * ALPHA * 50.0
    wanted = {"": 0.0, "x": level, "xyz": level / (1.0 - 2.0 * POISSON)}[held]
    for axis in "xyz":
        found = diagnostics.values(sim, f"stress_{axis}{axis}")
        assert found == pytest.approx(wanted if axis in held else 0.0, rel=1e-10, abs=1e-10 * abs(level)), axis


@BOTH
def test_thermal_stress_makes_rock_yield(of: Any) -> None:
    """Tresca between walls: held along x and y, free along z, the difference is twice the cohesion. It is warmed bit
    by bit: relaxation swings, and what has flowed by that does not come back."""
    LAWS["soft"] = "mech_mohr_coulomb", {**ROCK, "friction": 0.0, "cohesion": 5e6, "tensile": 1e12}
    try:
        sim, _ = heated("soft", "xy", warmer=0.0, of=of)
    finally:
        del LAWS["soft"]
    heat = Heat.of(sim)
    for warmer in range(2, 42, 2):
        heat.prescribe(None, 15.0 + warmer)
        sim.option(dynamic=True)
        sim.parts(mechanical=False, thermal=True)
        sim.step()
        sim.parts(mechanical=True, thermal=False)
        sim.option(dynamic=False)
        convergence.solve(sim, ratio=1e-4)
    xx, zz = (diagnostics.values(sim, f"stress_{axis}") for axis in ("xx", "zz"))
    assert (zz - xx < 1e7 * 1.001).all() and zz - xx == pytest.approx(1e7, rel=0.05)
    assert (diagnostics.values(sim, "plastic_shear_strain") > 1e-4).all()


@BOTH
def test_stress_and_stored_energy_of_a_held_block(of: Any) -> None:
    """-3 K alpha T at once, before anything moves, and (3 K alpha T)^2 V / 2 K; from the temperature of `initial` on;
    the coefficient alone changes it."""
    sim, mesh = heated("elastic", "xyz", of=of)
    heat, bulk = Heat.of(sim), YOUNG / (3.0 * (1.0 - 2.0 * POISSON))
    hot = diagnostics.values(sim, "stress_zz")
    assert hot == pytest.approx(-3.0 * bulk * ALPHA * 50.0, rel=1e-12)
    stored = diagnostics.total(sim, "strain_energy")
    assert stored == pytest.approx((3.0 * bulk * ALPHA * 50.0) ** 2 / (2.0 * bulk) * 1.2 * 0.8 * 0.9, rel=1e-12)
    heat.adjust(None, {"expansion_coeficient": 2.0 * ALPHA})
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(2.0 * hot, rel=1e-12)
    heat.initial(nodes_on(mesh, "left"), 65.0)
    beside = np.isin(mesh.cells, nodes_on(mesh, "left")).any(axis=1)
    beside[mesh.hexes[:, 8:] + np.arange(6)] = np.isin(mesh.hexes[:, :8], nodes_on(mesh, "left")).any(axis=1)[:, None]
    found = diagnostics.values(sim, "stress_yy")
    assert np.abs(found[beside]).max() < 1e-4 and found[~beside] == pytest.approx(2.0 * hot[~beside], rel=1e-12)


WARM = [("young", (40e9, 60e9), "rock"), ("cohesion", (1e5, 3e5), "soil"), ("tensile", (2e4, 1e5), "soil")]


@pytest.mark.parametrize(
    ("shape", "name", "at", "of"),
    [*((shape, *one) for shape in (box, hexes) for one in WARM), (box, "tensile_strength", (1e5, 3e5), "joint"),
     (box, "gf1", (1.0, 5.0), "joint"), (hexes, "tensile_strength", (1e5, 3e5), "joint")],
)  # fmt: skip
def test_properties_by_temperature(shape: Any, name: str, at: tuple[float, float], of: str) -> None:
    """At the temperature between two points of the table: every bit of the run with the constant of that temperature,
    and others than with the table's ends."""

    def run(value: float | Over) -> np.ndarray:
        mesh = shape((4, 2, 2), (1.0, 0.5, 0.5), shaken=0.1)
        sim = Blocks()
        sim.take_mesh(mesh)
        sim.table("by_heat", [(0.0, at[0]), (400.0, at[1])])
        if of == "soil":
            values = {**ROCK, "friction": 20.0, "cohesion": 2e5, "tensile": 5e4 if name == "tensile" else 1e6}
            changes.element_model(sim, None, "mech_mohr_coulomb", {**values, name: value})
        else:
            changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, **({name: value} if of == "rock" else {})})
        if of == "joint":
            law = {**JOINT, "tensile_strength": 2e5, "cohesion": 1e6, "gf1": 2.0, "gf2": 10.0, name: value}
            sim.joint_model(None, INTERFACE, law)
        heat = Heat.of(sim)
        heat.assign(None, GRANITE)
        heat.initial(None, 100.0)
        sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
        sim.velocity_condition(nodes_on(mesh, "right"), vx=0.5, vy=0.0, vz=0.1)
        sim.time_step(value=2e-6)
        for _ in range(120):
            sim.step()
        return np.concatenate([diagnostics.values(sim, f"velocity_{axis}") for axis in "xyz"])

    there = at[0] + 0.25 * (at[1] - at[0])
    found = run(Over("by_heat", TEMPERATURE))
    exactly = run(there)
    if name in ("young", "cohesion"):  # moduli are those of the largest times a part, yield surfaces are computed again
        assert found == pytest.approx(exactly, rel=1e-9, abs=1e-12)
    else:
        assert np.array_equal(found, exactly)
    assert np.abs(found - run(at[1])).max() > 1e-6


@pytest.mark.some_of_each
@BOTH
@pytest.mark.parametrize("law", ["elastic", "creeping", "soft"])
def test_a_restart_knows_heat_and_its_stress(law: str, of: Any, tmp_path) -> None:
    LAWS["soft"] = "mech_mohr_coulomb", {**ROCK, "friction": 0.0, "cohesion": 5e6, "tensile": 1e12}
    try:
        sim, mesh = heated(law, "x", dynamic=True, of=of)
    finally:
        del LAWS["soft"]
    sim.parts(thermal=True)
    sim.table("pulse", [(0.0, 15.0), (2e-5, 215.0), (1.0, 215.0)])
    sim.heat_clock(dt=0.0)
    Heat.of(sim).prescribe(nodes_on(mesh, "left"), "pulse")
    if law == "creeping":
        creep.switch(sim, True)
    for _ in range(20):
        sim.step()
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for k in range(30):
        sim.step()
        if k == 10:
            sim.rebuild()
        other.step()
    for name in ("stress_xx", "stress_yz", "velocity_z", "temperature", "mean_temperature"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name)), name
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() > 1e5


class Log:
    """What is said."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def warn_once(self, _: str, text: str) -> None:
        self.said.append(text)

    def info(self, text: str) -> None:
        logging.info(text)


def test_obtuse_tetrahedra_are_reported() -> None:
    """Boxes of six tetrahedra have none; a flat one has, and its heat flows to the warmer corner."""
    for points, some in (
        (box((2, 2, 2), (1.0, 1.0, 1.0)).points, False),
        (np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.6, 0.1]]), True),
    ):
        mesh = box((2, 2, 2), (1.0, 1.0, 1.0)) if not some else Mesh.of(points, np.array([[0, 1, 2, 3]]))
        sim, heat = standing(mesh)
        log = Log()
        sim.log = log
        put(heat, np.arange(len(mesh.points)) * 0.0)
        sim.heat_clock(dt=1.0)
        if some:
            heat.initial(np.array([3]), 100.0)
        sim.step()
        assert any("obtuse" in text for text in log.said) == some
        assert (temperatures(sim).min() < -1e-6) == some


def test_friction_of_a_pair_heats_both_walls() -> None:
    """Force of friction times speed of sliding, shared by effusivities and by the parts that corners take; no heat of
    what does not touch or has no friction."""
    rng = np.random.default_rng(3)
    mine, theirs, push = np.array([0.5, 0.3, 0.2]), np.array([0.4, 0.3, 0.2, 0.1]), np.array([1.0, -2.0, 5.0])
    force = np.zeros((3, 21))
    force[:] = np.concatenate([np.outer(mine, push).reshape(-1), -np.outer(theirs, push).reshape(-1)])
    history, touching = np.zeros((3, 5)), np.array([0, 1, 1])
    history[[0, 2], :3] = 7.0, 3.0, -2.0
    v, effusivity, part = rng.normal(size=(3, 16)), np.array([9.0, 2.0, 1.0]), np.array([9.0, 0.5, 0.25])
    out, dt = np.zeros((3, 4)), 0.1
    first, second, face, face_row, row = np.zeros(3, int), np.zeros(3, int), np.array([6]), np.array([2]), np.array([1])
    kernels_space.friction_heat(
        first, second, face, face_row, row, touching, v, force, history, effusivity, part, dt, out
    )
    corners = list(FACES[2])
    speed = mine @ v[2].reshape(4, 4)[corners, :3] - theirs @ v[1].reshape(4, 4)[:, :3]
    heat = -dt * history[2, :3] @ speed
    expected = np.zeros((3, 4))
    expected[2, corners] = mine * (0.25 * heat / 3.0)
    expected[1] = theirs * (0.5 * heat * 2.0 / 3.0)
    assert out == pytest.approx(expected, rel=1e-12) and abs(heat) > 0.01
