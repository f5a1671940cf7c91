"""Walls as the loop sees them: sides, ends, joints, deep penetration, motion, the BOX."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.commands.dem import cycles, history, particles, properties, walls
from hpcdem.commands.dem import settings as settings_of
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import BOX_IDS
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.kernels import walls as kernels
from hpcdem.physics.dem.simulation import Watcher
from hpcdem.physics.dem.walls import Walls
from hpcdem.runtime.progress import Log
from tests.support import at_wall, carry, force, model, only, position, steps, value, velocity

R, K = 1.0, 1e6
"""Radius [m], stiffness of particle and wall in series [N/m]."""


def test_walls_of_older_checkpoints():
    """They lack the way since the lists were built, and which walls are those of BOX: these had ids from -1 to -4."""
    given = {"id": [-2, 7], "p1": [[0.0, 1.0]] * 2, "p2": [[1.0, 2.0]] * 2, "v": [[3.0, 0.0]] * 2, "color": [0, 1]}
    found = Walls()
    found.take_columns({**given, **{key: [1.0, 2.0] for key in ("kn", "ks", "fric")}, "one_sided": [True, False]})
    assert found.travel.tolist() == [[0.0, 0.0]] * 2 and found.v[:, 0].tolist() == [3.0, 3.0]
    assert found.id[1] == 7 and found.id[0] in BOX_IDS.values() and (found.side > 0).tolist() == [True, False]


def held(folder, x: float, y: float, *segments, wallside: str = "both", fric: float = 0.0):
    """A held ball and walls 0, 1, ... of the linear law."""
    sim = model(folder, wallside=wallside)
    particles.ball(sim, 0, x, y, R)
    properties.prop(sim, kn=2.0 * K, ks=2.0 * K, fric=1.0)
    properties.fix(sim, ("x", "y", "spin"))
    for number, nodes in enumerate(segments):
        walls.wall(sim, number, nodes, kn=2.0 * K, ks=2.0 * K, fric=fric)
    steps(sim, 1)
    return sim


def put(sim, x: float, y: float, n: int = 1) -> None:
    """Carry the ball to a place in n equal steps, or as many as its radius asks for."""
    dx, dy = np.array([x, y]) - position(sim)
    carry(sim, 0, x=dx, y=dy, n=max(n, math.ceil(math.hypot(dx, dy) / (0.3 * R))))


# ---- geometry ----------------------------------------------------------------------------------------------------


coordinate = st.floats(-50.0, 50.0)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(coordinate, coordinate, coordinate, coordinate, coordinate, coordinate)
def test_closest_point(x1, y1, x2, y2, x, y):
    """No point of the segment is nearer; the signed distance is positive to the left of P1 -> P2."""
    p1, p2, p = np.array([x1, y1]), np.array([x2, y2]), np.array([x, y])
    length = math.dist(p1, p2)
    if length < 1e-3:
        return
    wall = np.array([x1, y1, x2, y2, 0.0, 0.0, 0.0, 0.0])
    where, h, qx, qy = kernels.closest(wall, x, y)
    found = math.dist((qx, qy), p)
    share = np.clip((p - p1) @ (p2 - p1) / length**2, 0.0, 1.0)
    assert found == pytest.approx(np.hypot(*(p1 + share * (p2 - p1) - p)), abs=1e-9)
    assert min(np.hypot(*(p1 + s * (p2 - p1) - p)) for s in np.linspace(0.0, 1.0, 11)) >= found - 1e-9
    cross = (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)
    assert h == pytest.approx(cross / length, abs=1e-9)
    if where == kernels.FACE:
        assert found == pytest.approx(abs(h), abs=1e-9)
    else:
        assert (qx, qy) == ((x1, y1) if where == kernels.END1 else (x2, y2))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("angle", [0.0, 40.0, 90.0, 200.0])
def test_a_face_pushes_to_the_side_of_the_centre(tmp_path, angle, side):
    t = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    n = np.array([-t[1], t[0]])
    sim = held(tmp_path, *(side * 0.9 * n), (tuple(-4.0 * t), tuple(5.0 * t)))
    assert force(sim)[:2] == pytest.approx(side * 0.1 * K * n, abs=1e-6)
    assert diagnostics.wall_forces(sim)[0] == pytest.approx(-side * 0.1 * K * n, abs=1e-6), "and the wall back"
    contact = at_wall(sim)
    assert (contact.x, contact.y) == pytest.approx(tuple(-side * 0.05 * n), abs=1e-12), "R - U/2 from the centre"


@pytest.mark.parametrize("around", [10.0, 45.0, 90.0, 135.0, 170.0])
def test_an_end_is_a_point_obstacle(tmp_path, around):
    """Beyond P2 = (3, 0) of a wall along x: n from end to centre, U = R - |x - P2|. Angles from the direction of
    the wall."""
    n = np.array([math.cos(math.radians(around)), math.sin(math.radians(around))])
    sim = held(tmp_path, *(np.array([3.0, 0.0]) + 0.8 * n), ((-3.0, 0.0), (3.0, 0.0)))
    if around < 90.0:
        assert force(sim)[:2] == pytest.approx(0.2 * K * n, rel=1e-9, abs=1e-6)
    else:  # above the segment: its face
        assert force(sim)[:2] == pytest.approx([0.0, (1.0 - 0.8 * n[1]) * K], rel=1e-9, abs=1e-6)


def test_the_force_is_continuous_around_an_end(tmp_path):
    """Along the face, over the end and back below, at a constant distance from the segment: constant push."""
    sim = held(tmp_path, 0.0, 0.9, ((-3.0, 0.0), (3.0, 0.0)))
    half = 0.9 * math.pi
    for s in np.linspace(0.0, 6.0 + half, 101):
        a = min(max(s - 3.0, 0.0) / 0.9, math.pi)
        along = s if s < 3.0 else 6.0 + half - s if s > 3.0 + half else 3.0
        put(sim, along + 0.9 * math.sin(a), 0.9 * math.cos(a))
        assert math.hypot(*force(sim)[:2]) == pytest.approx(0.1 * K, rel=1e-9)


def test_round_the_end_to_the_other_side(tmp_path):
    """A ball that rolls over the tip of an upright wall is pushed to the new side, not back through the wall."""
    sim = held(tmp_path, -0.97, 9.5, ((0.0, 0.0), (0.0, 10.0)))
    assert force(sim)[0] == pytest.approx(-0.03 * K, rel=1e-9)
    for a in np.linspace(math.pi, 0.0, 201):
        put(sim, 0.97 * math.cos(a), 10.0 + 0.97 * math.sin(a))
    put(sim, 0.97, 9.5)
    assert force(sim)[:2] == pytest.approx([0.03 * K, 0.0], rel=1e-9)


# ---- joints ------------------------------------------------------------------------------------------------------


JOINED = {
    "ends meet": (((-5.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (5.0, 0.0))),
    "starts meet": (((0.0, 0.0), (-5.0, 0.0)), ((0.0, 0.0), (5.0, 0.0))),
    "one begins inside the other": (((-5.0, 0.0), (0.2, 0.0)), ((0.0, 0.0), (5.0, 0.0))),
    "a dead end from below": (((-5.0, 0.0), (5.0, 0.0)), ((0.0, -3.0), (0.0, 0.0))),
}


@pytest.mark.parametrize("which", [k for k in JOINED if "inside" not in k])
def test_a_floor_of_two_pieces_is_a_floor(tmp_path, which):
    """No double push and no sideways push near the joint, nor at it."""
    sim = held(tmp_path, -1.0, 0.95, *JOINED[which])
    for x in (-0.5, -0.3, -0.1, -1e-3, 0.0, 1e-3, 0.05, 0.2, 0.4):
        put(sim, x, 0.95)
        assert force(sim)[:2] == pytest.approx([0.0, 0.05 * K], abs=1e-6), f"x = {x}"


def dragged(folder, *segments, x: float = -0.02, far: float = 0.04, n: int = 400, energy: int = 0):
    """A ball that is pressed on walls with 0.05 K and carried along x past x = 0: sum of the forces along x that the
    walls have felt, after each step. Sliding would begin after 0.5 * 0.05 of way."""
    sim = held(folder, x, 0.95, *segments, fric=0.5)
    if energy:
        settings_of.set_option(sim, "energy", energy)
        cycles.cycle(sim, 0)
    found = []
    sim.watchers.append(Watcher(1, lambda: found.append(float(diagnostics.wall_forces(sim)[:, 0].sum()))))
    properties.prop(sim, xv=far / n / sim.clock.dt)
    cycles.cycle(sim, n)
    return sim, np.array(found)


@pytest.mark.parametrize("which", [k for k in JOINED if "inside" not in k])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_friction_continues_from_wall_to_wall(tmp_path, which, way):
    """The shear force that has built up on one piece of a floor is that of the next one."""
    one, whole = dragged(tmp_path / "one", ((-5.0, 0.0), (5.0, 0.0)), x=-0.02 * way, far=0.04 * way)
    two, pieces = dragged(tmp_path / "two", *JOINED[which], x=-0.02 * way, far=0.04 * way)
    assert abs(whole[-1]) == pytest.approx(0.5 * 0.05 * K, rel=1e-9), "it slides at the end"
    assert pieces == pytest.approx(whole, rel=1e-9)
    assert two.lists.slot_fs.sum() == pytest.approx(one.lists.slot_fs.sum(), rel=1e-12)


@pytest.mark.parametrize("turn", [-20.0, -0.5, 0.5, 3.0])
def test_friction_continues_round_a_bend(tmp_path, turn):
    """Pieces at a small angle, as of a circle: the ball goes on at a constant distance, round the end or into the
    corner; the shear force never falls below what it was when it came to the bend, until the ball slides."""
    a = math.radians(turn)
    along = np.array([math.cos(a), math.sin(a)])
    left = np.array([-along[1], along[0]])
    sim, before = dragged(tmp_path, ((-5.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), tuple(5.0 * along)), x=-0.08, far=0.022)
    corner = -0.95 * math.tan(0.5 * a) if turn > 0.0 else 0.0
    path = [np.array([x, 0.95]) for x in np.linspace(-0.058, corner, 20)]
    path += [0.95 * np.array([math.sin(-b), math.cos(b)]) for b in np.linspace(0.0, a, 40)[1:] if turn < 0.0]
    path += [0.95 * left + s * along for s in np.linspace(-corner, -corner + 0.06, 40)[1:]]
    for place in path:
        put(sim, *place)
        assert abs(sim.lists.slot_fs).sum() > 0.99 * abs(before[-1])
    assert np.count_nonzero(sim.lists.slot_fs) == 1


def test_the_energy_account_follows_shear_forces_from_wall_to_wall(tmp_path):
    """Nothing is booked where a ball comes to the next piece: work of the motion is stored, then lost by friction."""
    sim, _ = dragged(tmp_path, *JOINED["ends meet"], energy=10**6)
    one, _ = dragged(tmp_path / "one", ((-5.0, 0.0), (5.0, 0.0)), energy=10**6)
    pieces, whole = sim.energy.evaluate(sim), one.energy.evaluate(one)
    assert pieces.loss_friction == pytest.approx(whole.loss_friction, rel=1e-9) and pieces.loss_friction > 0.0
    assert pieces.elastic_shear == pytest.approx(whole.elastic_shear, rel=1e-9)
    assert abs(pieces.loss_opened) + abs(pieces.loss_stiffness) < 1e-9 * whole.loss_friction
    assert abs(pieces.closing) < 1e-9 * whole.loss_friction


def test_overlapping_pieces_are_two_walls(tmp_path):
    """Where two segments lie on each other both push; their ends do not."""
    sim = held(tmp_path, -1.0, 0.95, *JOINED["one begins inside the other"])
    for x, times in ((-0.1, 1.0), (0.1, 2.0), (0.3, 1.0)):
        put(sim, x, 0.95)
        assert force(sim)[:2] == pytest.approx([0.0, times * 0.05 * K], abs=1e-6)


def test_an_outward_corner_pushes_once(tmp_path):
    """Two walls meet in a ridge at the origin; a ball beyond both ends meets one point, not two."""
    sim = held(tmp_path, 0.0, 0.9, ((-5.0, -5.0), (0.0, 0.0)), ((0.0, 0.0), (5.0, -5.0)))
    assert force(sim)[:2] == pytest.approx([0.0, 0.1 * K], abs=1e-6)
    n = np.array([math.sin(0.3), math.cos(0.3)])
    put(sim, *(0.9 * n))
    assert force(sim)[:2] == pytest.approx(0.1 * K * n, abs=1e-6)
    put(sim, *(0.9 * np.array([math.sqrt(0.5), math.sqrt(0.5)]) + np.array([0.1, -0.1])))  # over the right face
    assert force(sim)[:2] == pytest.approx(0.1 * K * np.array([math.sqrt(0.5), math.sqrt(0.5)]), abs=1e-6)


def test_an_inward_corner_pushes_twice(tmp_path):
    """In the corner of floor and side wall both faces act, their common end does not."""
    sim = held(tmp_path, 0.9, 0.8, ((0.0, 5.0), (0.0, 0.0)), ((0.0, 0.0), (5.0, 0.0)))
    assert force(sim)[:2] == pytest.approx([0.1 * K, 0.2 * K], abs=1e-6)
    assert len(diagnostics.wall_rows(sim)[0]) == 2


def test_a_gap_between_two_pieces_has_ends(tmp_path):
    """Ends that do not touch another wall act: the ball sinks into the gap, held by both."""
    sim = held(tmp_path, 0.0, 0.8, ((-5.0, 0.0), (-0.3, 0.0)), ((0.3, 0.0), (5.0, 0.0)))
    d = math.hypot(0.3, 0.8)
    assert force(sim)[:2] == pytest.approx([0.0, 2.0 * (1.0 - d) * K * 0.8 / d], rel=1e-9, abs=1e-6)


def test_a_step_between_two_pieces_has_a_corner(tmp_path):
    """The right piece lies 0.5 m lower: its neighbour's end acts on a ball beside it."""
    sim = held(tmp_path, 0.8, 0.45, ((-5.0, 0.0), (0.0, 0.0)), ((0.0, -0.5), (5.0, -0.5)))
    d = math.hypot(0.8, 0.45)
    end = (1.0 - d) * K * np.array([0.8, 0.45]) / d
    assert force(sim)[:2] == pytest.approx(end + [0.0, 0.05 * K], rel=1e-9)


# ---- sides -------------------------------------------------------------------------------------------------------


def test_deep_penetration_keeps_its_side(tmp_path):
    """Pressed through a two-sided wall to four radii beyond it and back: the push stays on the side where contact
    began, through many rebuilds of the lists."""
    sim = held(tmp_path, 0.0, 0.95, ((-5.0, 0.0), (5.0, 0.0)))
    before = sim.rebuilds
    for y in (0.5, 0.0, -0.5, -1.0, -2.0, -4.0, -1.5, 0.3, 0.6, 0.99):
        put(sim, 0.0, y, n=40)
        assert force(sim)[:2] == pytest.approx([0.0, (1.0 - y) * K], rel=1e-9, abs=1e-5), f"y = {y}"
        sim.rebuild()  # besides those that the way asks for: few, as the ball has a reach of its own
    assert sim.rebuilds > before + 10
    put(sim, 0.0, 1.01, n=5)
    assert at_wall(sim) is None and not force(sim).any()
    put(sim, 0.0, 5.0, n=50)
    put(sim, 9.0, 5.0, n=50)
    put(sim, 9.0, -5.0, n=50)
    put(sim, 0.0, -5.0, n=50)
    put(sim, 0.0, -0.9, n=50)
    assert force(sim)[1] == pytest.approx(-0.1 * K, rel=1e-9), "a new contact from below"


def test_a_one_sided_wall_expels_to_its_left(tmp_path):
    """SET wallside left: contact if -R < h < R, the push always to the left of P1 -> P2; beyond R on the right
    nothing."""
    for y, push in ((0.9, 0.1), (0.2, 0.8), (-0.4, 1.4), (-0.99, 1.99), (-1.01, 0.0), (1.01, 0.0)):
        sim = held(tmp_path, 0.0, y, ((-5.0, 0.0), (5.0, 0.0)), wallside="left")
        assert force(sim)[:2] == pytest.approx([0.0, push * K], rel=1e-9, abs=1e-6)
    sim = held(tmp_path, 0.0, 0.9, ((5.0, 0.0), (-5.0, 0.0)), wallside="left")
    assert force(sim)[1] == pytest.approx(-1.9 * K, rel=1e-9), "the other way round, left is below"


def test_wallside_belongs_to_walls_made_after_it(tmp_path):
    """Two-sided is the default."""
    sim = held(tmp_path, 0.0, -0.9, ((-5.0, 0.0), (5.0, 0.0)))
    assert force(sim)[1] == pytest.approx(-0.1 * K, rel=1e-9)


# ---- moving, replaced, soft walls --------------------------------------------------------------------------------


def test_a_moving_wall_drags_and_pushes(tmp_path):
    """P += v dt; the shear of the contact takes the wall's velocity, the overlap its way."""
    sim = held(tmp_path, 0.0, 1.0, ((-5.0, 0.0), (5.0, 0.0)), fric=1.0)
    walls.wall(sim, 0, xv=0.5, yv=2.0)
    steps(sim, 10)
    assert sim.walls.p1[0] == pytest.approx([-4.995, 0.02]) and sim.walls.p2[0] == pytest.approx([5.005, 0.02])
    assert force(sim)[:2] == pytest.approx([0.005 * K, 0.02 * K], rel=1e-9)
    assert force(sim)[2] == pytest.approx(0.005 * K * (1.0 - 0.01), rel=1e-2)
    walls.wall(sim, 0, xv=0.0, yv=0.0)
    steps(sim, 5)
    assert force(sim)[:2] == pytest.approx([0.005 * K, 0.02 * K], rel=1e-9)


def test_a_wall_that_comes_from_afar_is_not_missed(tmp_path):
    """It crosses 40 m of empty space before it meets the ball."""
    sim = held(tmp_path, 0.0, 1.0, ((-5.0, -40.0), (5.0, -40.0)))
    walls.wall(sim, 0, yv=100.0)
    steps(sim, 399)
    assert at_wall(sim) is None
    steps(sim, 2)
    assert force(sim)[1] == pytest.approx(0.1 * K, rel=1e-6)


def test_friction_and_stiffness_can_be_changed_and_nodes_replaced(tmp_path):
    sim = held(tmp_path, 0.0, 0.9, ((-5.0, 0.0), (5.0, 0.0)), fric=1.0)
    properties.prop(sim, xv=-1.0)
    steps(sim, 20)
    assert at_wall(sim).fs == pytest.approx(0.02 * K, rel=1e-9)
    walls.wall(sim, 0, fric=0.1)
    steps(sim, 1)
    assert at_wall(sim).fs == pytest.approx(0.1 * 0.1 * K, rel=1e-9)
    walls.wall(sim, 0, kn=6.0 * K)
    steps(sim, 1)
    assert at_wall(sim).fn == pytest.approx(0.1 * 1.5 * K, rel=1e-9)
    properties.prop(sim, xv=0.0)
    walls.wall(sim, 0, ((-5.0, -0.05), (5.0, -0.05)), kn=2.0 * K)
    steps(sim, 1)
    assert at_wall(sim).fn == pytest.approx(0.05 * K, rel=1e-9) and at_wall(sim).fs == 0.0, "a new wall, no memory"


def test_wall_stiffness_counts_for_linear_particles_only(tmp_path):
    """kn = 0 makes a wall invisible for linear particles; Hertz ones bring their own moduli."""
    sim = model(tmp_path)
    particles.ball(sim, 0, 0.0, 0.9, R)
    particles.ball(sim, 1, 3.0, 0.9, R)
    properties.prop(sim, only(0), kn=2.0 * K)
    properties.prop(sim, only(1), shear=1e6, poiss=0.25, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    walls.wall(sim, 0, ((-5.0, 0.0), (5.0, 0.0)))
    steps(sim, 1)
    assert force(sim, 0)[1] == 0.0
    assert force(sim, 1)[1] == pytest.approx(2.0 * 1e6 * math.sqrt(2.0) / (3.0 * 0.75) * 0.1**1.5, rel=1e-9)


def test_wall_forces_are_sums(tmp_path):
    sim = held(tmp_path, 0.0, 0.9, ((-50.0, 0.0), (50.0, 0.0)), ((0.0, 2.0), (0.0, 9.0)))
    for gid in range(1, 8):
        particles.ball(sim, gid, 3.0 * gid, 0.9, R)
    properties.prop(sim, kn=2.0 * K, ks=2.0 * K)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)
    assert diagnostics.wall_forces(sim) == pytest.approx(np.array([[0.0, -0.8 * K], [0.0, 0.0]]), rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"id": -1, "nodes": ((0.0, 0.0), (1.0, 0.0))}, "must not be negative"),
        ({"id": 1, "nodes": ((2.0, 3.0), (2.0, 3.0))}, "zero length"),
        ({"id": 1, "fric": 0.3}, "no wall with id 1"),
        ({"id": 1, "nodes": ((0.0, 0.0), (1.0, 0.0)), "kn": -1.0}, "kn must not be negative"),
    ],
)
def test_walls_that_make_no_sense(tmp_path, given, message):
    with pytest.raises(CommandError, match=message):
        walls.wall(model(tmp_path), **given)


# ---- the BOX -----------------------------------------------------------------------------------------------------


def boxed(folder, kn: float = 2.0 * K):
    """A BOX from (-10, -5) to (10, 5) without particles, and its log."""
    sim = model(folder)
    said = io.StringIO()
    sim.log = Log(stream=said)
    walls.box(sim, -10.0, 10.0, -5.0, 10.0, kn=kn, ks=kn)
    return sim, said


@pytest.mark.parametrize(
    ("place", "push"),
    [((-9.2, 0.0), (0.2, 0.0)), ((9.2, 0.0), (-0.2, 0.0)), ((0.0, -4.3), (0.0, 0.3)), ((9.2, 4.3), (-0.2, -0.3))],
)
def test_the_box_pushes_inward(tmp_path, place, push):
    sim, _ = boxed(tmp_path)
    particles.ball(sim, 0, *place, R)
    properties.prop(sim, kn=2.0 * K)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)
    assert force(sim)[:2] == pytest.approx(np.array(push) * K, rel=1e-9, abs=1e-6)


def test_particles_that_leave_the_box_are_deleted(tmp_path):
    """Walls of no stiffness let linear particles through; ids and places stand in the log; the others stay."""
    sim, said = boxed(tmp_path, kn=0.0)
    particles.ball(sim, 3, 8.0, 2.0, R)
    particles.ball(sim, 5, 0.0, 0.0, R)
    particles.ball(sim, 8, 0.0, -3.0, R)
    properties.prop(sim, density=1.0, kn=2.0 * K)
    properties.prop(sim, only(3), xv=50.0)
    properties.prop(sim, only(8), yv=-30.0)
    steps(sim, 200)
    assert sim.particles["gid"].tolist() == [5] and value(sim, "x", 5) == 0.0
    places = {gid: (float(x), float(y)) for gid, x, y in re.findall(r"left the BOX .*: (\d+) at \((\S+), (\S+)\)",
                                                                     said.getvalue())}  # fmt: skip
    assert places.keys() == {"3", "8"} and 10.0 < places["3"][0] < 12.0 and -7.0 < places["8"][1] < -5.0


def test_a_box_that_holds(tmp_path):
    """Twelve balls fly about in it for many reflections; none is lost, and the energy is what it was."""
    sim, said = boxed(tmp_path)
    random = np.random.default_rng(2)
    for gid in range(12):
        particles.ball(sim, gid, -8.25 + 3.0 * (gid % 6), -2.5 + 4.0 * (gid // 6), R)
        properties.prop(sim, only(gid), xv=random.uniform(-5, 5), yv=random.uniform(-5, 5))
    properties.prop(sim, density=1000.0, kn=2.0 * K)
    steps(sim, 1)
    before = diagnostics.kinetic_energy(sim)
    steps(sim, 5000)
    assert len(sim.particles) == 12 and "BOX" not in said.getvalue()
    p = sim.particles
    potential = 0.0
    for rows in (diagnostics.contact_rows(sim)[0], diagnostics.wall_rows(sim)[0]):
        potential += (0.5 * rows[:, diagnostics.FN] * rows[:, diagnostics.OVERLAP]).sum()
    assert diagnostics.kinetic_energy(sim) + potential == pytest.approx(before, rel=0.02)
    assert (np.abs(p["x"]) < 10.0).all() and (np.abs(p["y"]) < 5.0).all()
    assert not p["spin"].any() and velocity(sim, 0).any()


def test_an_empty_box_is_an_error(tmp_path):
    with pytest.raises(CommandError, match="BOX is empty"):
        walls.box(model(tmp_path), 0.0, 0.0, 0.0, 1.0)


def test_a_wall_that_is_deleted(tmp_path):
    """The ball loses the force of the wall, keeps that of the wall made after it with its shear force, and nothing
    acts when all are gone."""
    far, floor, side = ((-5.0, 5.0), (5.0, 5.0)), ((-5.0, 0.0), (5.0, 0.0)), ((0.9, -5.0), (0.9, 5.0))
    sim = held(tmp_path, 0.0, 0.9, far, floor, side, fric=1.0)
    carry(sim, 0, x=0.01, n=50)
    before = at_wall(sim, 0, 2), at_wall(sim, 0, 1)
    assert before[0].fn == pytest.approx(0.11 * K) and before[1].fs != 0.0
    walls.wall(sim, 0, delete=True)
    assert sim.walls.id.tolist() == [1, 2]
    steps(sim, 1)
    assert (at_wall(sim, 0, 2), at_wall(sim, 0, 1)) == before
    walls.wall(sim, 1, delete=True)
    steps(sim, 1)
    assert force(sim)[:2] == pytest.approx((-0.11 * K, 0.0)) and at_wall(sim, 0, 2) == before[0]
    walls.wall(sim, 2, delete=True)
    steps(sim, 1)
    assert not force(sim).any()
    with pytest.raises(CommandError, match="no wall with id 2"):
        walls.wall(sim, 2, delete=True)


def test_walls_that_cannot_be_deleted(tmp_path):
    sim = held(tmp_path, 0.0, 0.9, ((-5.0, 0.0), (5.0, 0.0)))
    walls.box(sim, -9.0, 9.0, -9.0, 20.0)
    history.hist(sim, 3, 10, "ystress wall 0")
    for name, message in ((0, "wall 0 cannot be deleted: HIST 3 records its"), (100, "a side of BOX, which cannot")):
        with pytest.raises(CommandError, match=message):
            walls.wall(sim, name, delete=True)
    with pytest.raises(CommandError, match="delete accepts only the id"):
        walls.wall(sim, 0, fric=0.1, delete=True)
