"""Conduction, exchange and accounts of heat in blocks that stand still."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.field import kernels
from hpcdem.physics.field.diffusing import SAFETY
from hpcdem.physics.heat import reference
from hpcdem.physics.heat.model import Heat
from hpcdem.pre.mesh import structured
from tests.blocks.models import COHESIVE
from tests.blocks.support import JOINT, ROCK, model, rectangle, shaken
from tests.flow.support import at, inner
from tests.heat import exact
from tests.heat.support import DIFFUSIVITY, GRANITE, faces_at, standing, temperatures, until


def test_kernels_do_what_the_plain_loop_does() -> None:
    """Anisotropic triangles of any shape."""
    mesh = shaken(rectangle(5, 4, 1.0, 0.8), 0.2)
    sim, heat = standing(mesh, conductivity_across=0.7, conductivity_angle=35.0)
    sim.heat_clock(dt=100.0)
    rng = np.random.default_rng(4)
    start = rng.uniform(0.0, 100.0, len(mesh.points))
    for node, value in enumerate(start.tolist()):
        heat.initial(np.array([node]), value)
    heat.prescribe(np.array([3, 9]), 50.0)
    c, s = math.cos(math.radians(35.0)), math.sin(math.radians(35.0))
    turn = np.array([[c, -s], [s, c]])
    k = np.tile(turn @ np.diag([2.5, 0.7]) @ turn.T, (len(mesh.cells), 1, 1))
    volume = np.full(len(mesh.cells), ROCK["density"] * 1000.0)
    wanted = reference.sub_step(mesh.points, mesh.cells[:, :3], k, volume, start, 100.0, {3: 50.0, 9: 50.0})
    sim.step()
    assert temperatures(sim) == pytest.approx(wanted, rel=1e-12)
    assert np.abs(wanted - start).max() > 1.0


@pytest.mark.parametrize("kind", ["tri", "quad", "mixed"])
def test_a_linear_field_stays(kind: str) -> None:
    """Patch test: nothing is stored anywhere inside."""
    mesh = shaken(rectangle(5, 4, 1.0, 0.8, kind=kind), 0.2)
    sim, heat = standing(mesh)
    x = mesh.points
    wanted = 20.0 + 30.0 * x[:, 0] - 10.0 * x[:, 1]
    for node, value in enumerate(wanted.tolist()):
        heat.initial(np.array([node]), value)
    edge = np.flatnonzero((x[:, 0] == 0.0) | (x[:, 0] == 1.0) | (x[:, 1] == 0.0) | (np.abs(x[:, 1] - 0.8) < 1e-12))
    for node in edge.tolist():
        heat.prescribe(np.array([node]), float(wanted[node]))
    for _ in range(20):
        sim.step()
    assert np.abs(temperatures(sim) - wanted).max() < 1e-11


@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_a_slab_follows_its_series_with_order_two(kind: str) -> None:
    """One face takes 100 K: 0.1 % with 32 elements, and a quarter of the error with twice as many."""
    time, errors = 0.15 / DIFFUSIVITY, []
    for n in (8, 16, 32):
        mesh = rectangle(n, 1, 1.0, 1.0 / n, kind=kind)
        sim, heat = standing(mesh)
        heat.initial(None, 300.0)
        heat.prescribe(at(sim, x=0.0), 400.0)
        until(sim, time)
        wanted = 300.0 + 100.0 * exact.slab(mesh.points[:, 0], time, 1.0, DIFFUSIVITY)
        errors.append(float(np.abs(temperatures(sim) - wanted).max()) / 100.0)
        assert heat.account()["relative"] < 1e-12
    assert errors[-1] < 1e-3
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (orders > 1.8).all(), orders


def test_a_cylinder_follows_its_series() -> None:
    """Its surface takes 100 K: 0.1 %. A square mesh that is mapped to a disc."""
    n = 40
    line = np.linspace(-1.0, 1.0, n + 1)
    mesh = structured.rectangle(line, line, "tri", "both")
    p = mesh.points
    largest, length = np.abs(p).max(axis=1), np.hypot(*p.T)
    mesh.points[:] = p * (largest / np.where(length > 0.0, length, 1.0))[:, None]
    sim, heat = standing(mesh)
    r, time = np.hypot(*mesh.points.T), 0.1 / DIFFUSIVITY
    heat.prescribe(np.flatnonzero(r > 1.0 - 1e-9), 100.0)
    until(sim, time)
    assert np.abs(temperatures(sim) - 100.0 * exact.cylinder(r, time, 1.0, DIFFUSIVITY)).max() < 0.1


def test_transfer_to_an_environment_follows_its_series() -> None:
    """Biot number 2, with the coefficient of the elements, and with one of the faces."""
    time = 0.3 / DIFFUSIVITY
    for own in (True, False):
        mesh = rectangle(40, 1, 1.0, 1.0 / 40)
        h = 2.0 * GRANITE["conductivity"]
        sim, heat = standing(mesh, transfer_coeficient=h if own else 77.0)
        heat.initial(None, 80.0)
        heat.expose(faces_at(mesh, 1.0), environment=20.0, **({} if own else {"transfer": h}))
        until(sim, time)
        wanted = 20.0 + 60.0 * exact.convective_slab(mesh.points[:, 0], time, 1.0, DIFFUSIVITY, 2.0)
        assert np.abs(temperatures(sim) - wanted).max() < 0.06
        found = heat.account()
        assert found["relative"] < 1e-12 and found["given"] < 0.0


def test_an_environment_follows_its_table() -> None:
    """A thin block that conducts well in air that gets warmer by a K/s: a (t - (1 - exp(-k t)) / k), k = h / (rho c
    times the thickness)."""
    mesh = rectangle(2, 1, 0.02, 0.01)
    sim, heat = standing(mesh, conductivity=400.0)
    k = 50.0 / (float(sim.element_rows.column("density")[1]) * GRANITE["capacity"] * 0.02)
    sim.table("air", [(0.0, 0.0), (1e4, 100.0)])
    heat.expose(faces_at(mesh, 0.02), environment="air", transfer=50.0)
    time = 1.5 / k
    until(sim, time)
    assert temperatures(sim) == pytest.approx(0.01 * (time - (1.0 - math.exp(-k * time)) / k), rel=5e-3)
    assert heat.account()["relative"] < 1e-12


def test_a_flux_is_what_is_given() -> None:
    """12 W/m2 through 0.1 m for 1000 s, and a table of it."""
    mesh = rectangle(10, 1, 1.0, 0.1)
    sim, heat = standing(mesh)
    sim.table("sun", [(0.0, 0.0), (1000.0, 24.0)])
    heat.expose(faces_at(mesh, 1.0), flux=12.0)
    sim.heat_clock(dt=1.0)
    for _ in range(1000):
        sim.step()
    assert heat.account()["given"] == pytest.approx(1200.0, rel=1e-12) == heat.account()["stored"]
    heat.expose(faces_at(mesh, 1.0), flux="sun")
    with pytest.raises(CommandError, match="is used by a boundary condition"):
        sim.remove_table("sun")
    heat.time = 0.0
    for _ in range(1000):
        sim.step()
    assert heat.account()["given"] == pytest.approx(1200.0 + 0.1 * 24.0 * 499.5, rel=1e-12)
    heat.remove_face_conditions(None)
    before = heat.account()["given"]
    sim.step()
    assert heat.account()["given"] == before


def test_prescribed_temperatures_follow_tables() -> None:
    mesh = rectangle(4, 1, 1.0, 0.25)
    sim, heat = standing(mesh)
    sim.table("ramp", [(0.0, 10.0), (100.0, 30.0)])
    heat.prescribe(at(sim, x=0.0), "ramp")
    sim.heat_clock(dt=10.0)
    for _ in range(5):
        sim.step()
    assert temperatures(sim)[at(sim, x=0.0)] == pytest.approx(20.0, rel=1e-12)
    with pytest.raises(CommandError, match="is used by a boundary condition"):
        sim.remove_table("ramp")
    heat.remove_conditions(None)
    sim.remove_table("ramp")
    held = temperatures(sim)[at(sim, x=0.0)]
    sim.step()
    assert (temperatures(sim)[at(sim, x=0.0)] < held).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [("conductivity", 5.0), ("capacity", 500.0), ("conductivity_across", 1.0), ("conductivity_angle", 30.0)],
)
def test_each_property_alone_changes_the_heat(name: str, value: float) -> None:
    def warmed(**changed: float) -> np.ndarray:
        sim, heat = standing(rectangle(6, 4, 1.5, 1.0), **{"conductivity_across": 2.0, **changed})
        heat.prescribe(np.array([0]), 100.0)
        sim.heat_clock(dt=1000.0)
        for _ in range(10):
            sim.step()
        return temperatures(sim)

    assert np.abs(warmed() - warmed(**{name: value})).max() > 0.05


def test_heat_stops_at_cracks_and_goes_through_joints() -> None:
    """A joint that holds conducts as if it were not there; each side of a crack has its own temperature."""
    mesh = rectangle(8, 2, 2.0, 0.5)
    ends = []
    for jointed, cracked in ((False, False), (True, False), (True, True)):
        sim, heat = standing(mesh)
        middle = [j for j in inner(mesh) if np.allclose(_line(mesh, j)[:, 0], 1.0)]
        if jointed:
            sim.joint_model(None, COHESIVE, {**JOINT, "penalty_normal": 1e11})
        if cracked:
            changes.crack(sim, np.array(middle))
        heat.prescribe(at(sim, x=0.0), 100.0)
        sim.heat_clock(dt=2000.0)
        for _ in range(200):
            sim.step()
        ends.append(temperatures(sim)[at(sim, x=2.0)])
        if cracked:
            corner = diagnostics.corners_of_field(sim, "temperature")
            here = np.flatnonzero(at_points(sim, 1.0))
            values = corner.reshape(-1)[here]
            assert values.min() == 0.0 and values.max() > 10.0
        assert heat.account()["relative"] < 1e-12
    assert np.array_equal(ends[0], ends[1]) and ends[0].min() > 1.0
    assert (ends[2] == 0.0).all()


def _line(mesh, joint: int) -> np.ndarray:
    e, k = joint // 4, joint % 4
    n = 4 if mesh.cells[e, 3] >= 0 else 3
    return mesh.points[mesh.cells[e, [k, (k + 1) % n]]]


def at_points(sim: Blocks, x: float) -> np.ndarray:
    """(4 n_own,) bool: corners of owned elements with this x in the mesh."""
    cells = sim.mesh.cells[sim.number[sim.owned]]
    return ((cells >= 0) & (np.abs(sim.mesh.points[cells][:, :, 0] - x) < 1e-9)).reshape(-1)


def test_what_is_removed_takes_its_heat() -> None:
    mesh = rectangle(8, 2, 2.0, 0.5)
    sim, heat = standing(mesh)
    heat.initial(None, 20.0)
    heat.prescribe(at(sim, x=0.0), 100.0)
    sim.heat_clock(dt=1000.0)
    for _ in range(50):
        sim.step()
    before = heat.account()
    changes.null(sim, np.flatnonzero(mesh.centroids()[:, 0] > 1.5))
    after = heat.account()
    assert after["removed"] == pytest.approx(0.25 * before["commands"], rel=0.01)
    assert after["stored"] == pytest.approx(before["stored"] - after["removed"], rel=1e-14)
    for _ in range(50):
        sim.step()
    assert heat.account()["relative"] < 1e-13 and heat.account()["given"] > after["given"]


def test_changes_of_the_capacity_are_booked_as_those_of_commands() -> None:
    mesh = rectangle(4, 2, 1.0, 0.5)
    sim, heat = standing(mesh)
    heat.initial(None, 20.0)
    heat.adjust(np.arange(4), {"capacity": 2000.0})
    found = heat.account()
    area = mesh.areas()
    assert found["stored"] == pytest.approx(20.0 * ROCK["density"] * 1000.0 * (area.sum() + area[:4].sum()), rel=1e-13)
    assert found["commands"] == pytest.approx(found["stored"], rel=1e-14) and found["relative"] < 1e-14


def test_the_time_step_is_that_of_the_smallest_element() -> None:
    """0.9 C / K of the tightest node, and what a larger one does."""
    mesh = rectangle(10, 1, 1.0, 0.1, kind="quad")
    sim, heat = standing(mesh)
    sim.close_model()
    # Nodes of a corner: half of the diagonals of overlays of two right triangles, 2 k / 2 against rho C h^2 / 4.
    assert heat.limit() == pytest.approx(0.1**2 / (4.0 * DIFFUSIVITY), rel=1e-12)
    assert heat.dt == pytest.approx(SAFETY * heat.limit()) == sim.clock.dt
    heat.initial(np.array([5]), 50.0)
    sim.heat_clock(dt=4.0 * heat.limit())
    with pytest.raises(Exception, match=r"temperature of element .* is not finite"):
        for _ in range(3000):
            sim.step()


def test_a_cycle_takes_the_assigned_sub_steps() -> None:
    """Beside motion a cycle lasts as long as the steps that blocks moved."""
    mesh = rectangle(4, 2, 1.0, 0.5)
    times = {}
    for said in ({}, {"steps": 3}, {"dt": 7.0}, {"dt": 7.0, "steps": 3}):
        sim = model(mesh)
        heat = Heat.of(sim)
        heat.assign(None, GRANITE)
        sim.heat_clock(**said)
        sim.flow_clock(every=2)
        for _ in range(4):
            sim.step()
        times[tuple(said)] = heat.time, heat.sub_steps, heat.cycles, sim.clock.time
    assert times[()][:3] == pytest.approx((times[()][3], 1, 2))
    assert times["steps",][:3] == pytest.approx((times[()][3], 3, 2))
    assert times["dt",][:3] == (14.0, 1, 2) and times["dt", "steps"][:3] == (42.0, 3, 2)
    sim.parts(thermal=False)
    sim.step()
    sim.step()
    assert heat.time == 42.0


def test_heat_continues_after_a_checkpoint(tmp_path) -> None:
    """Bit by bit, with all that was said."""
    mesh = shaken(rectangle(6, 4, 1.2, 0.8, kind="mixed"), 0.2)
    sim, heat = standing(mesh, transfer_coeficient=9.0)
    sim.table("ramp", [(0.0, 10.0), (1e5, 90.0)])
    heat.initial(np.array([4, 5]), 33.0)
    heat.prescribe(at(sim, x=0.0), "ramp")
    heat.expose(faces_at(mesh, 1.2), environment="ramp", flux=3.0)
    for _ in range(10):
        sim.step()
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for one in (sim, other):
        for _ in range(10):
            one.step()
    assert np.array_equal(temperatures(sim), temperatures(other))
    assert heat.account() == Heat.of(other).account() and heat.time == Heat.of(other).time


def test_what_makes_no_sense_is_refused() -> None:
    sim = model(rectangle(2, 2, 1.0, 1.0))
    heat = Heat.of(sim)
    with pytest.raises(CommandError, match="no heat yet"):
        heat.initial(None, 1.0)
    with pytest.raises(CommandError, match="needs capacity"):
        heat.assign(None, {"conductivity": 1.0})
    with pytest.raises(CommandError, match="conductivity must be > 0"):
        heat.assign(None, {"conductivity": 0.0, "capacity": 1.0})
    heat.assign(np.arange(3), GRANITE)
    with pytest.raises(CommandError, match=r"element 3 at .* has no thermal model"):
        sim.step()
    with pytest.raises(CommandError, match="element 3 has no thermal model whose properties"):
        heat.adjust(np.array([2, 3]), {"capacity": 1.0})
    heat.assign(None, GRANITE)
    with pytest.raises(CommandError, match="must be finite"):
        heat.initial(None, math.inf)
    with pytest.raises(CommandError, match="no table 'no'"):
        heat.prescribe(None, "no")
    with pytest.raises(CommandError, match="must be finite"):
        heat.prescribe(None, math.nan)
    with pytest.raises(CommandError, match="needs environment-temperature"):
        heat.expose(None, transfer=3.0)
    with pytest.raises(CommandError, match="needs a transfer coefficient: face 0"):
        heat.expose(None, environment=3.0)
    with pytest.raises(CommandError, match="must not be negative"):
        heat.expose(None, environment=3.0, transfer=-1.0)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match="static runs need model time-step thermal"):
        sim.step()
    sim.parts(thermal=False)
    sim.step()
    sim.option(dynamic=True)
    sim.parts(mechanical=False)
    with pytest.raises(CommandError, match="neither fluid nor heat flows"):
        sim.step()
    bare = model(rectangle(2, 2, 1.0, 1.0))
    bare.heat_clock(dt=1.0)
    with pytest.raises(CommandError, match="time-step of heat is set, but no element has a thermal model"):
        bare.step()


def test_what_faces_bring_and_what_nodes_become() -> None:
    """Flux and transfer at the corners of two faces; a free node, a held one, and accounts of this rank's corners."""
    t, q, given = np.array([10.0, 20.0, 30.0, 40.0, 10.0]), np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.zeros(3)
    table = np.array([[5.0, 0.0, 0.0], [0.0, 2.0, 100.0]])
    corner, half = np.array([[0, 1], [2, 3]]), np.array([0.5, 0.25])
    kernels.through_faces(corner, half, np.array([0, 1]), table, 1, 4, t, q, 0.1, given)
    heat = np.array([2.5, 2.5, 0.25 * 2.0 * 70.0, 0.25 * 2.0 * 60.0, 0.0])
    assert q == pytest.approx(np.array([1.0, 2.0, 3.0, 4.0, 5.0]) + heat, rel=1e-15)
    assert given == pytest.approx(0.1 * heat[1:4], rel=1e-15)

    q, given = np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.zeros(3)
    begin, around = np.array([0, 2, 4, 5]), np.array([0, 4, 2, 1, 3])
    kernels.warm(2, begin, around, np.array([2.0, 4.0, 8.0]), np.array([-1, 1, 0]), table[:, 2], 1, 4, 0.5, q, t, given)
    assert t == pytest.approx([10.0 + 0.5 * 6.0 / 2.0, 100.0, 100.0, 0.0, 11.5], rel=1e-15)
    assert given == pytest.approx([0.0, 4.0 * 70.0 - 0.5 * 5.0, 8.0 * -40.0 - 0.5 * 4.0], rel=1e-15)


def test_corners_of_a_node_become_one() -> None:
    """By their capacities, or equally where there are none; what is equal keeps its bits."""
    t, weight = np.array([10.0, 20.0, 0.1, 0.1, 0.1, 3.0, 5.0]), np.array([1.0, 3.0, 0.3, 0.7, 0.9, 0.0, 0.0])
    begin, corner = np.array([0, 2, 5, 7]), np.arange(7)
    kernels.unite(begin, corner, weight, t)
    assert t.tolist() == [17.5, 17.5, 0.1, 0.1, 0.1, 4.0, 4.0]
    out = np.zeros(3)
    kernels.sums(begin, corner[::-1].copy(), t, out)
    assert out == pytest.approx([8.0, 0.3, 35.0])


def test_the_stress_of_what_is_warm_and_cannot_grow() -> None:
    t, out = np.array([[10.0, 20.0, 30.0, 99.0], [10.0, 20.0, 30.0, 100.0]]), np.zeros(2)
    kernels.eigenstress(np.array([False, True]), t, np.array([2.0, 3.0]), np.array([5.0, 4.0]), out)
    assert out.tolist() == [2.0 * (5.0 - 20.0), 3.0 * (4.0 - 40.0)]
