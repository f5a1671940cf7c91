"""Elements that yield after Mohr and Coulomb: closed forms of one way of loading, what they remember, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, reference
from hpcdem.physics.fdem.elements import flow
from hpcdem.physics.fdem.kernels import elements, plastic_quads, plasticity
from hpcdem.physics.fdem.kernels.elements import PARTS
from hpcdem.physics.fdem.kernels.plasticity import SHEAR_NOW
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from tests.blocks.support import ROCK, joined, jointed, model, near, rectangle, shaken

MOHR_COULOMB = "mech_mohr_coulomb"
SOIL = {
    "density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "dilation": 10.0, "cohesion": 3.45e6,
    "tensile": 1e6,
}  # fmt: skip
N, M = (math.tan(math.pi / 4.0 + 0.5 * math.radians(SOIL[name])) ** 2 for name in ("friction", "dilation"))
K = 2.0 * SOIL["cohesion"] * math.sqrt(N)
A, B = SOIL["bulk"] + 4.0 / 3.0 * SOIL["shear"], SOIL["bulk"] - 2.0 / 3.0 * SOIL["shear"]
STRESSES = ("stress_xx", "stress_yy", "stress_xy", "stress_zz")


@pytest.fixture(params=["cross", "mixed", "quad"])
def kind(request):
    """Of mesh: triangles, both, quads."""
    return request.param


def soil(kind: str = "cross", **other: float) -> Blocks:
    """A square metre at rest."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(3, 3, 1.0, 1.0, kind=kind), 0.2))
    changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, **other})
    sim.option(dynamic=False, collision=False)
    return sim


def deform(sim: Blocks, gradient: np.ndarray) -> None:
    """All nodes go to their places in the mesh times this deformation gradient (2, 2), and elements flow there once."""
    x = sim.mesh.points @ np.asarray(gradient).T
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.open_model()
    corners = 4 if sim.wide else 3
    sim.x[:, : 2 * corners] = x[sim.mesh.cells[sim.number, :corners]].reshape(-1, 2 * corners)
    changes.repeat(sim, sim.x)
    sim.step()


def stresses(sim: Blocks) -> np.ndarray:
    return np.column_stack([diagnostics.values(sim, name) for name in STRESSES])


def compressed(sim: Blocks, strain: float, parts: int = 20, sign: float = -1.0) -> None:
    """Uniaxial strain along y, in equal parts."""
    for k in range(1, parts + 1):
        deform(sim, np.diag([1.0, 1.0 + sign * strain * k / parts]))


@pytest.mark.some_of_each
@pytest.mark.parametrize("pressure", [0.0, 2e6])
def test_strength_of_a_pressed_plate(kind, pressure):
    """Between two plates without friction, sides under pressure: 2 c sqrt(N) + N p, whatever the mesh (shaken)."""
    sim = soil(kind)
    sim.option(large_strain=False)
    x, y = sim.mesh.points.T
    sides = np.concatenate([near(sim.mesh, 0, 0.0), near(sim.mesh, 0, 1.0)])
    if pressure:
        sim.stress_condition(sides, normal=-pressure)
        sim.initial_stress(None, xx=-pressure, yy=-pressure, zz=-pressure)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero((y < 1e-9) & (x < 1e-9)), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 1.0 - 1e-9), vy=-2e-6)
    convergence.advance(sim, 3000)
    assert -diagnostics.total(sim, "reaction_y", np.flatnonzero(y > 1.0 - 1e-9)) == pytest.approx(
        K + N * pressure, rel=2.5e-3
    )
    assert (diagnostics.values(sim, "plastic_state") == SHEAR_NOW).all()


def test_before_it_yields_it_is_the_elastic_element(kind):
    """The same bits, in motion, with joints beside it."""
    ends = []
    for strong in (False, True):
        sim = model(shaken(rectangle(6, 4, 0.6, 0.4, kind=kind), 0.2))
        if strong:
            law = {**ROCK, "friction": 30.0, "dilation": 5.0, "cohesion": 1e12, "tensile": 1e12}
            changes.element_model(sim, None, MOHR_COULOMB, law)
        jointed(sim)
        sim.option(collision=False)
        sim.initial_stress(None, yy=-1e6)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 0.3), 2.0, 1.0)
        convergence.advance(sim, 300)
        ends.append(
            np.concatenate(
                [diagnostics.values(sim, name) for name in ("position_x", "velocity_y", *STRESSES, "damage")]
            )
        )
    assert np.array_equal(*ends, equal_nan=True)


@pytest.mark.parametrize("large", [False, True])
def test_flow_of_quads_as_the_plain_loop(large):
    """Random quads flow once: the triangles of each return for themselves, then the two of an overlay share their
    volume; forces and mean stresses follow."""
    sim = soil("quad", dilation=20.0)
    stress0 = np.array([[-3e6, 1e6], [1e6, -5e6]])
    sim.option(large_strain=large)
    sim.initial_stress(None, xx=-3e6, yy=-5e6, xy=1e6, zz=-2e6)
    sim.close_model()
    rng = np.random.default_rng(5)
    rock = reference.MohrCoulomb(
        SOIL["bulk"], SOIL["shear"], math.radians(30.0), math.radians(20.0), SOIL["cohesion"], SOIL["tensile"]
    )
    areas, several = sim.mesh.areas(), 0
    for _ in range(5):
        at = sim.mesh.points + 2e-3 * rng.normal(size=sim.mesh.points.shape)
        sim.x[:, :8] = at[sim.mesh.cells[sim.number]].reshape(-1, 8)
        changes.repeat(sim, sim.x)
        force, found = sim.evaluate().force, stresses(sim)
        for r, e in enumerate(sim.number):
            mesh, x = sim.mesh.points[sim.mesh.cells[e]], at[sim.mesh.cells[e]]
            parts = reference.yielded_quad(mesh, x, stress0, -2e6, rock, not large)
            want, mean = np.zeros((4, 2)), np.zeros(4)
            for k, (d, s, bits) in zip(PARTS, parts):
                turned = d.rotation @ s[:2, :2] @ d.rotation.T
                want[k] -= 0.5 * d.area * d.gradients @ turned
                area = 0.5 * float(np.linalg.det(mesh[k][1:] - mesh[k][0]))
                mean += 0.5 * area / areas[e] * np.array([turned[0, 0], turned[1, 1], turned[0, 1], s[2, 2]])
                several += bits
            assert force[r].reshape(4, 2) == pytest.approx(want, abs=1e-6 * np.abs(want).max())
            assert found[e] == pytest.approx(mean, abs=1e-6 * np.abs(mean).max())
    assert several > 60


@pytest.mark.parametrize("large", [False, True])
def test_the_loop_over_quads_that_yield_is_flow_and_then_forces(large):
    """Bit for bit: quads that flow within the loop over their forces, and the flow of all of them before the loop over
    elastic quads; in one part and in seven; where some flow, many or all do, and strength follows a table."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(13, 12, 2.0, 2.0, kind="quad"), 0.2))
    sim.table("soft", [(0.0, 3e6), (1e-3, 1e5)])
    changes.element_model(sim, None, MOHR_COULOMB, {**SOIL, "damp_factor": 0.1})
    changes.element_model(sim, np.arange(50), MOHR_COULOMB, {**SOIL, "cohesion": Over("soft", PLASTIC_STRAIN)})
    changes.element_model(sim, np.arange(100, 120), "mech_iso_elastic", ROCK)
    sim.option(collision=False, large_strain=large)
    sim.close_model()
    local, rng, several = sim.local, np.random.default_rng(3), set()
    place = sim.mesh.points[sim.mesh.cells[sim.number]].reshape(-1, 8)
    for size, width in ((1e-6, 2.0), (1e-2, 0.5), (1e-2, 2.0)):
        shift = np.where(sim.mesh.points[:, :1] <= width, size, 1e-6)
        at = sim.mesh.points + shift * rng.normal(size=sim.mesh.points.shape)
        sim.x[:, :8] = at[sim.mesh.cells[sim.number]].reshape(-1, 8)
        changes.repeat(sim, sim.x)
        sim.v[:, :8] = 0.1 * np.sin(9.0 * place)
        changes.repeat(sim, sim.v)
        found = []
        for parts in (0, 1, 7):  # 0: flow, then forces
            state, of = local.yielding.state(), local.solids.blocks[1]
            memory, s0, table, history = (part.copy() for part in (state[0], of.s0, *state[2:]))
            soft = local.yielding.strength._replace(history=history)
            args = list(local._quad_args)
            args[0], args[6] = max(parts, 1), of.flat(s0)
            out = [np.zeros((len(sim.number), elements.FORCE)) for _ in range(2)]
            args += [*out, True, 1.0, -9.81, 0.5, 1e-6, 3, np.zeros((7, elements.TALLY), np.int64)]
            own = sim.n_left, of.flat(of.initial), of.law
            if parts:
                plastic_quads.yielding.one(args[0], soft, *args[1:], *own, memory, table)
            else:
                flow.flows(
                    1, of.tables, of.count, of.flowing, of.initial, of.law, soft, not large, 3, memory, s0, table
                )
                elements.quads(*args)
            found.append([*out, memory, s0, table, history])
        assert all((a == b).all() for one in found[1:] for a, b in zip(found[0], one))
        flows = (found[0][2].reshape(-1, 4, plasticity.MEMORY)[:, :, plasticity.SHEAR] > 0.0).any(axis=1).mean()
        several.add(0 if flows == 0.0 else (1 if flows < 0.4 else 2))
        assert (history > 0.0).any() or flows < 0.4
    assert several == {0, 1, 2}


def test_a_turn_changes_nothing(kind):
    """A body that has yielded is turned by 90 degrees and 30 more: stresses turn with it, nothing flows."""
    sim = soil(kind)
    sheared = np.array([[1.002, 0.008], [0.0, 0.996]])
    for k in range(1, 11):
        deform(sim, np.eye(2) + (sheared - np.eye(2)) * k / 10)
    before, strain = stresses(sim), diagnostics.values(sim, "plastic_shear_strain")
    assert (strain > 1e-4).all()
    for degrees in (90.0, 120.0):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turn = np.array([[c, -s], [s, c]])
        deform(sim, turn @ sheared)
        for old, new in zip(before, stresses(sim)):
            planar = turn @ np.array([[old[0], old[2]], [old[2], old[1]]]) @ turn.T
            assert [new[0], new[1], new[2], new[3]] == pytest.approx(
                [planar[0, 0], planar[1, 1], planar[0, 1], old[3]], abs=1e-3
            )
        assert diagnostics.values(sim, "plastic_shear_strain") == pytest.approx(strain, abs=1e-12)


@pytest.mark.parametrize("name", ["bulk", "shear", "friction", "dilation", "cohesion", "tensile"])
def test_every_property_counts(kind, name):
    """Of an element that goes to the line where both surfaces meet."""
    ends = []
    for part in (1.0, 0.9):
        sim = soil(kind, **{name: part * SOIL[name]})
        deform(sim, np.diag([1.003, 0.999]))
        changes.reset_velocity(sim)
        deform(sim, np.diag([1.003, 0.99]))
        ends.append(stresses(sim))
    assert not np.array_equal(*ends)


def test_viscosity_and_density_count():
    ends = []
    for other in ({}, {"damp_factor": 0.5}, {"density": 2500.0}):
        sim = soil(**other)
        sim.option(dynamic=True)
        sim.time_step(1e-6)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 0.5), -5.0, 0.0)
        convergence.advance(sim, 50)
        ends.append(diagnostics.values(sim, "position_x"))
    assert not np.array_equal(ends[0], ends[1]) and not np.array_equal(ends[0], ends[2])


def test_friction_of_its_surfaces_is_its_own():
    """A block slides down a slope that is as steep as its friction or not."""
    paths = []
    for friction in (20.0, 50.0):
        lower, upper = rectangle(8, 1, 0.8, 0.1), rectangle(2, 1, 0.2, 0.1, x0=0.05, y0=0.1 + 1e-7)
        sim = Blocks()
        sim.take_mesh(joined(lower, upper))
        rock = {**SOIL, "friction": friction, "dilation": 0.0, "cohesion": 1e9, "tensile": 1e9, "damp_factor": 0.1}
        changes.element_model(sim, None, MOHR_COULOMB, rock)
        sim.velocity_condition(np.arange(len(lower.points)), vx=0.0, vy=0.0)
        sim.gravity(*(9.81 * np.array([math.sin(math.radians(35.0)), -math.cos(math.radians(35.0))])))
        sim.time_step(mass_scaling=2e-5)
        convergence.advance(sim, 1500)
        paths.append(diagnostics.values(sim, "displacement_x").max())
    assert paths[0] > 5.0 * paths[1]


def test_new_material_has_not_yielded(kind):
    """An element that comes back is without plastic strain."""
    sim = soil(kind)
    compressed(sim, 0.01)
    changes.null(sim, [0])
    changes.element_model(sim, [0], MOHR_COULOMB, SOIL)
    assert (
        diagnostics.values(sim, "plastic_shear_strain")[0] == 0.0 < diagnostics.values(sim, "plastic_shear_strain")[1]
    )
    assert diagnostics.values(sim, "plastic_work")[0] == 0.0 < diagnostics.values(sim, "plastic_work")[1]


def test_triangles_that_were_saved_before_quads_could_yield():
    """They have nine columns beside quads, and go on as they were."""
    ends = []
    for old in (False, True):
        sim = soil("mixed")
        triangles = np.flatnonzero(sim.mesh.cells[:, 3] < 0)
        quads = np.flatnonzero(sim.mesh.cells[:, 3] >= 0)
        elastic = {name: SOIL[name] for name in ("density", "bulk", "shear")}
        changes.element_model(sim, quads, "mech_iso_elastic", elastic)
        deform(sim, np.diag([1.0, 0.99]))
        sim.open_model()
        if old:
            sim.cold["plastic"] = sim.cold["plastic"][:, :9].copy()
        deform(sim, np.diag([1.0, 0.985]))
        ends.append(np.column_stack([stresses(sim), diagnostics.values(sim, "plastic_work")]))
        assert (diagnostics.values(sim, "plastic_state")[triangles] == SHEAR_NOW).all()
    assert np.array_equal(*ends)


def test_refusals():
    sim = model(rectangle(2, 2, 1.0, 1.0, kind="mixed"))
    one = int(np.flatnonzero(sim.mesh.cells[:, 3] >= 0)[0])
    changes.element_model(sim, [one], MOHR_COULOMB, SOIL)
    with pytest.raises(CommandError, match="dilation must not be above friction"):
        sim.element_property([one], {"dilation": 40.0})
    with pytest.raises(CommandError, match="needs two of young"):
        changes.element_model(sim, [one], MOHR_COULOMB, {k: v for k, v in SOIL.items() if k != "shear"})
    with pytest.raises(CommandError, match="has no property cohesion"):
        sim.element_property(None, {"cohesion": 1e6})
