"""What several conditions come to at one node, and what contradicts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.kernels import nodes, space
from hpcdem.physics.fdem.node_conditions import Contradiction, NodeCondition, acting, bound
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import ROCK, jointed, model, rectangle
from tests.space.support import box

V, A = nodes.VELOCITY, nodes.ACCELERATION
ALONG, ACROSS, FIXED = nodes.ALONG, space.ACROSS, nodes.FIXED
E = np.eye(3).tolist()


@pytest.mark.parametrize(
    ("one", "other", "both"),
    [
        ((ALONG, (1.0, 0.0)), (ALONG, (0.0, 1.0)), (FIXED,)),
        ((ALONG, (0.6, 0.8)), (ALONG, (-0.6, -0.8)), (ALONG, (0.6, 0.8))),
        ((FIXED, (0.0, 0.0)), (ALONG, (0.0, 1.0)), (FIXED,)),
        ((ACROSS, E[0]), (ACROSS, E[1]), (ALONG, (0.0, 0.0, 1.0))),
        ((ACROSS, E[0]), (ACROSS, E[0]), (ACROSS, E[0])),
        ((ACROSS, E[0]), (ALONG, E[1]), (ALONG, E[1])),
        ((ACROSS, (0.6, 0.8, 0.0)), (ALONG, E[1]), (FIXED,)),
        ((ALONG, E[0]), (ALONG, E[2]), (FIXED,)),
    ],
)
def test_constraints_meet_in_what_they_leave(one, other, both):
    for first, second in ((one, other), (other, one)):
        kind, direction = bound(first[0], tuple(first[1]), second[0], tuple(second[1]), len(one[1]))
        assert kind == both[0]
        if kind != FIXED:
            assert abs(np.dot(direction, both[1])) == pytest.approx(1.0)


def moves(**given) -> NodeCondition:
    said = {f"does_{name[-1]}": V for name in given if name.startswith("at")}
    return NodeCondition(**{**said, **given})


@pytest.mark.parametrize(
    ("one", "speed"),
    [
        (moves(at_x=3.0, constraint=ALONG, direction=(0.6, 0.8)), (3.0, 4.0)),
        (moves(at_x=3.0, at_y=4.0, constraint=ALONG, direction=(0.6, 0.8)), (3.0, 4.0)),
        (moves(at_x=0.0, constraint=ALONG, direction=(0.6, 0.8)), (0.0, 0.0)),
        (moves(at_x="table", constraint=ALONG, direction=(1.0, 0.0)), ("table", 0.0)),
        (moves(at_y=4.0, constraint=ACROSS, direction=(0.0, 0.8, 0.6)), (None, 4.0, -4.0 * 0.8 / 0.6)),
        (
            moves(at_y=4.0, at_z=-4.0 * 0.8 / 0.6, constraint=ACROSS, direction=(0.0, 0.8, 0.6)),
            (None, 4.0, -4.0 * 0.8 / 0.6),
        ),
        (moves(at_x=2.0, constraint=ACROSS, direction=(0.0, 0.0, 1.0)), (2.0, None, 0.0)),
    ],
)
def test_a_velocity_beside_a_constraint(one, speed):
    found = acting(one, len(speed))
    assert found.constraint == nodes.UNBOUND
    for axis, value in zip("xyz", speed):
        assert getattr(found, f"does_{axis}") == (nodes.FREE if value is None else V)
        assert value is None or getattr(found, f"at_{axis}") == (
            value if isinstance(value, str) else pytest.approx(value)
        )


def test_a_component_of_a_plane_that_stays_leaves_a_line():
    found = acting(moves(at_y=0.0, constraint=ACROSS, direction=(0.6, 0.64, 0.48)), 3)
    assert found.constraint == ALONG and found.does_y == nodes.FREE
    assert found.direction[1] == 0.0 and np.dot(found.direction, (0.6, 0.64, 0.48)) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("one", "told"),
    [
        (moves(at_x=0.1, constraint=FIXED), r"held \(type 1\) and velocity-x 0.1"),
        (moves(at_y="table", constraint=FIXED), r"held \(type 1\) and velocity-y 'table'"),
        (moves(at_x=1.0, constraint=ALONG, direction=(0.0, 1.0)), r"direction \(0, 1\) \(type 2\) and velocity-x 1"),
        (moves(at_x=3.0, at_y=5.0, constraint=ALONG, direction=(0.6, 0.8)), "velocity-x 3 and velocity-y 5"),
        (moves(at_x="table", constraint=ALONG, direction=(0.6, 0.8)), "numbers of one kind"),
        (moves(at_x=3.0, at_y=4.0, does_y=A, constraint=ALONG, direction=(0.6, 0.8)), "acceleration-y 4"),
        (
            moves(at_z=1.0, constraint=ACROSS, direction=(0.0, 0.0, 1.0)),
            r"across \(0, 0, 1\) \(type 3\) and velocity-z 1",
        ),
        (moves(at_y=1.0, at_z=1.0, constraint=ACROSS, direction=(0.0, 0.8, 0.6)), "velocity-y 1 and velocity-z 1"),
        (
            moves(at_x=1.0, constraint=ACROSS, direction=(0.6, 0.64, 0.48)),
            "prescribe the value 0 or a second component",
        ),
    ],
)
def test_what_contradicts(one, told):
    with pytest.raises(Contradiction, match=told):
        acting(one, len(one.direction) if one.constraint != FIXED else 2)


def on_rollers(how: str, sim: Blocks, x: np.ndarray, y: np.ndarray) -> Blocks:
    """A block of 1 m under its weight between rollers on a base that is held."""
    sides = np.flatnonzero((x < 1e-9) | (x > 1.0 - 1e-9))
    dim = sim.dim
    up = (0.0, 1.0) if dim == 2 else (0.0, 1.0, 0.0)
    if how == "velocity":
        sim.velocity_condition(sides, vx=0.0)
    elif dim == 3:
        sim.move_constraint(sides, 3, (1.0, 0.0, 0.0))
    else:
        sim.move_constraint(sides, 2, up)
    sim.move_constraint(np.flatnonzero(y < 1e-9), 1)
    if how == "twice":
        sim.move_constraint(sides, *((3, (1.0, 0.0, 0.0)) if dim == 3 else (2, up)))
    sim.gravity(0.0, -10.0)
    sim.option(dynamic=False)
    return sim


@pytest.mark.parametrize("shape", ["cross", "quad", "tets"])
def test_a_corner_between_base_and_roller_stays(shape):
    """Rollers as velocities or as constraints, before and after the base: the same, and the corner does not sink."""
    found = []
    for how in ("velocity", "constraint", "twice"):
        mesh = box((2, 2, 2), (1.0, 1.0, 1.0), 5) if shape == "tets" else rectangle(4, 4, 1.0, 1.0, kind=shape)
        sim = model(mesh) if shape != "tets" else Blocks()
        if shape == "tets":
            sim.take_mesh(mesh)
            changes.element_model(sim, None, "mech_iso_elastic", ROCK)
            z = mesh.points[:, 2]
            sim.velocity_condition(np.flatnonzero((z < 1e-9) | (z > 1.0 - 1e-9)), vz=0.0)
        x, y = mesh.points[:, 0], mesh.points[:, 1]
        on_rollers(how, sim, x, y)
        equilibrium.solve_elastic(sim)
        direction = diagnostics.values(sim, "displacement_y")
        assert (direction[y < 1e-9] == 0.0).all() and direction.min() < -1e-8
        assert diagnostics.total(sim, "reaction_y") == pytest.approx(ROCK["density"] * 10.0, rel=1e-9)
        found.append((direction, diagnostics.values(sim, "reaction_x")))
    for direction, reaction in found[1:]:
        assert direction == pytest.approx(found[0][0], abs=1e-18) and reaction == pytest.approx(found[0][1], abs=1e-6)


def test_refused_by_name_and_nothing_is_changed(tmp_path):
    sim = model(rectangle(2, 2, 1.0, 1.0))
    sim.move_constraint([0, 1], 1)
    before = saved_state.state_of(sim, {})["scene"]["conditions"], sim.corner_row.tolist()
    with pytest.raises(
        CommandError, match=r"at node 0 at \(0, 0\): held \(type 1\) and velocity-x 0.1\. Remove one of them"
    ):
        sim.velocity_condition([0, 5], vx=0.1)
    assert (saved_state.state_of(sim, {})["scene"]["conditions"], sim.corner_row.tolist()) == before
    sim.move_constraint([0], 0)
    sim.velocity_condition([0, 5], vx=0.1)
    with pytest.raises(CommandError, match=r"velocity-x 0.1"):
        sim.move_constraint(None, 1)


def test_a_prescribed_motion_along_a_line_has_its_reaction():
    """A node that is led along an axis is pushed by what the rest of the model pulls with."""
    results = []
    for constraint in (False, True):
        sim = model(rectangle(2, 2, 1.0, 1.0))
        y = sim.the_mesh().points[:, 1]
        top = np.flatnonzero(y > 1.0 - 1e-9)
        sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
        sim.velocity_condition(top, vy=1e-6, **({} if constraint else {"vx": 0.0}))
        if constraint:
            sim.move_constraint(top, 2, (0.0, 1.0))
        sim.option(dynamic=False)
        equilibrium.solve_elastic(sim)
        results.append([diagnostics.total(sim, f"reaction_{axis}", top) for axis in "xy"])
    assert results[0] == pytest.approx(results[1]) and results[0][1] > 1e3


def test_files_of_versions_in_which_constraints_came_first():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    state = sim.definition_state()
    turn = (math.cos(0.5), math.sin(0.5))
    said = [{}, {"constraint": FIXED, "does_x": V, "at_x": 1.0}, {"constraint": ALONG, "way": turn, "does_x": V,
            "at_x": 1.0, "does_y": V, "at_y": 0.0}]  # fmt: skip
    old = [{k: v for k, v in {**state["conditions"][0], **one}.items() if not k.startswith(("side", "part", "older"))}
           for one in said]  # fmt: skip
    del state["sided"]
    sim.take_definition_state({**state, "conditions": old})
    _, held, led = sim.acting()
    assert held.constraint == FIXED and held.does_x == nodes.FREE
    assert (led.at_x, led.at_y) == pytest.approx((turn[0] ** 2, turn[0] * turn[1])) and led.constraint == nodes.UNBOUND


def test_a_file_with_conditions_by_points_continues():
    """Of versions in which both sides of a joint had one condition: the same steps as the model that wrote it."""

    def made() -> Blocks:
        sim = jointed(model(rectangle(3, 2, 1.0, 1.0, kind="mixed")))
        y = sim.the_mesh().points[:, 1]
        sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
        sim.velocity_condition(np.flatnonzero(np.abs(y - 0.5) < 1e-9), vx=0.1)
        sim.force_condition(np.flatnonzero(y > 1.0 - 1e-9), fy=-1e4)
        convergence.advance(sim, 5)
        return sim

    sim = made()
    state = saved_state.state_of(sim, {})
    tables = {name: dict(table.columns) for name, table in saved_state.tables(sim).items()}
    row, cells = tables["faces"].pop("corner_row"), sim.the_mesh().cells.reshape(-1)
    points = np.zeros(len(sim.the_mesh().points), np.int64)
    points[cells[cells >= 0]] = row[cells >= 0]
    tables["points"] = {"point_row": points}
    del state["scene"]["sided"]
    other = Blocks()
    saved_state.put(other, state, tables)
    for one in (sim, other):
        convergence.advance(one, 5)
    for name in ("position_y", "velocity_x", "reaction_x"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name))
    assert not other.sided and np.array_equal(sim.corner_row[cells >= 0], other.corner_row[cells >= 0])


def test_what_each_condition_makes_of_a_velocity():
    """Closed forms of nodes of one corner, and of one with two corners that are both stored twice, once at 0."""
    begin, corner = np.array([0, 2, 3, 4, 5, 6]), 2 * np.arange(6)
    place, again = np.array([2, 4, 6, 8, 10, 12]), np.array([14, 0, -1, -1, -1, -1])
    v = np.full(16, np.nan)
    v[place], v[place + 1] = 3.0, -2.0
    force, applied = np.arange(1.0, 13.0), np.zeros(12)
    applied[:2] = 0.5, 0.25
    kick, share, alpha = np.array([0.1, 0.2, 0.2, 0.2, 0.2]), np.array([1.0, 1.0, 1.0, 1.0, 0.5]), 0.5
    table = np.zeros((5, nodes.CONDITION))
    table[:, nodes.DAMP] = -1.0
    table[1, [nodes.DOES_X, nodes.AT_X]] = V, 7.0
    table[2, [nodes.DOES_Y, nodes.AT_Y, nodes.DAMP]] = A, 4.0, 0.0
    table[3, nodes.CONSTRAINT] = FIXED
    table[4, [nodes.CONSTRAINT, nodes.DIRECTION_X, nodes.DIRECTION_Y, nodes.FORCE_X]] = ALONG, 0.6, 0.8, 10.0
    outside, felt = np.zeros((5, 2)), np.zeros((5, 4))
    nodes.move(
        1, begin, corner, place, again, kick, np.arange(5), share, table, True, force, applied, v, alpha, outside, felt
    )
    x, y = v[place[begin[:-1]]], v[place[begin[:-1]] + 1]
    f = np.array([[4.5, 6.25], [5.0, 6.0], [7.0, 8.0], [9.0, 10.0], [16.0, 12.0]])
    assert (felt[:, :2] == f).all() and felt[:, 2:].tolist() == [[0.5, 0.25], *[[0.0, 0.0]] * 3, [5.0, 0.0]]
    along = (3.0 * 0.6 - 2.0 * 0.8) + 0.2 * (16.0 * 0.6 + 12.0 * 0.8) * (1.0 - alpha)
    assert x == pytest.approx([3.0 + 0.1 * 0.5 * 4.5, 7.0, 3.0 + 0.2 * 7.0, 0.0, 0.6 * along], rel=1e-14)
    assert y == pytest.approx([-2.0 + 0.1 * 1.5 * 6.25, -2.0 + 0.2 * 9.0, 2.0, 0.0, 0.8 * along], rel=1e-14)
    for second in (4, 14, 0):
        assert v[second : second + 2].tolist() == v[2:4].tolist()
    across = 12.0 * 0.6 - 16.0 * 0.8
    expected = [[0.0, 0.0], [4.0 / 0.2 - 5.0, 0.0], [0.0, 4.0 / 0.2 - 8.0], [-3.0 / 0.2 - 9.0, 2.0 / 0.2 - 10.0]]
    assert outside == pytest.approx(np.array([*expected, [across * 0.8, -across * 0.6]]), rel=1e-13)


def test_what_each_condition_makes_of_a_velocity_in_space():
    """Closed forms: free, with two corners; velocity, acceleration and nodal force; fixed; along and across a vector,
    damped and not."""
    begin, corner = np.array([0, 2, 3, 4, 5, 6, 7]), 4 * np.arange(7, dtype=np.int32)
    before, alpha, k = np.array([3.0, -2.0, 1.0]), 0.5, 0.2
    v, force, applied = np.zeros((3, 7, 4))
    v[:, :3], force[:, :3] = before, [(at + 1.0, -at - 2.0, 3.0) for at in corner]
    applied[0, :3] = 0.5, 0.25, 0.125
    table, condition = np.zeros((6, space.CONDITION)), np.arange(6)
    table[:, space.NODE_DAMP] = -1.0
    table[1, [space.DOES, space.AT, space.DOES + 2, space.AT + 2]] = V, 7.0, A, 4.0
    table[1, [space.FORCE, space.FORCE + 1, space.FORCE + 2]] = 10.0, 20.0, 30.0
    table[2, space.CONSTRAINT] = FIXED
    direction = np.array([0.6, 0.0, 0.8])
    for row, kind in ((3, ALONG), (4, ACROSS), (5, ALONG)):
        table[row, space.CONSTRAINT], table[row, space.WAY : space.WAY + 3] = kind, direction
    table[5, space.NODE_DAMP] = 0.0
    outside, felt, share = np.full((6, 3), np.nan), np.zeros((6, 6)), np.full(6, 0.5)
    args = begin, corner, begin, corner, np.full(6, k), condition, share, table, True, force, applied, v, alpha
    space.move(2, *args, outside, felt)
    f = np.array(
        [[6.5, -7.75, 6.125], [14.0, 0.0, 18.0], *((4.0 * n + 1.0, -4.0 * n - 2.0, 3.0) for n in (3, 4, 5, 6))]
    )
    assert felt[:, :3] == pytest.approx(f, rel=1e-15)
    assert felt[:2, 3:].tolist() == [[0.5, 0.25, 0.125], [5.0, 10.0, 15.0]] and (felt[2:, 3:] == 0.0).all()

    def damped(force, velocity):
        return force - alpha * abs(force) * math.copysign(1.0, velocity)

    now = v[:, :3]
    free = [b + k * damped(a, b) for a, b in zip(f[0], before)]
    assert now[0] == pytest.approx(free, rel=1e-14) and (now[0] == now[1]).all()
    assert now[2] == pytest.approx([7.0, -2.0, 5.0], rel=1e-14)
    assert outside[1] == pytest.approx([4.0 / k - 14.0, 0.0, 4.0 / k - 18.0], rel=1e-13)
    assert (now[3] == 0.0).all() and outside[2] == pytest.approx(-before / k - f[2], rel=1e-14)
    speed, pull = before @ direction, f[3] @ direction
    assert now[4] == pytest.approx((speed + k * damped(pull, speed)) * direction, rel=1e-13)
    assert outside[3] == pytest.approx(-(f[3] - pull * direction), rel=1e-13)
    pull = f[4] @ direction
    w = np.array([b + k * damped(a, b) for a, b in zip(f[4] - pull * direction, before)])
    assert now[5] == pytest.approx(w - (w @ direction) * direction, rel=1e-13, abs=1e-15)
    assert outside[4] == pytest.approx(-pull * direction, rel=1e-13)
    assert now[6] == pytest.approx((before + k * f[5]) @ direction * direction, rel=1e-13)
