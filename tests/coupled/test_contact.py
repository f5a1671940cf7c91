"""One disc and one body against closed forms."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.commands.dem import properties
from hpcdem.core.fields import RADIUS, WIDTH, X, Y
from hpcdem.numerics.exact_sum import as_integer
from hpcdem.physics.coupling.links import Link
from hpcdem.physics.coupling.model import law_table
from hpcdem.physics.coupling.work import Work
from hpcdem.physics.dem.budget import EMPTIED
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from tests.blocks.support import JOINT, joined, rectangle, shaken
from tests.coupled.support import ROCK, STIFF, body, discs, momentum, of_disc, together

R = 0.1
MASS = 2500.0 * math.pi * R * R
G = 9.81


def test_momentum_of_an_oblique_hit(tmp_path):
    """A spinning disc hits a free elastic body off its centre: momentum and its moment stay, to rounding."""
    both = together(discs([(0.93, 0.6 + R + 1e-4, R)], tmp_path, dt=5e-6), body(shaken(rectangle(6, 3, 1.2, 0.6), 0.2)))
    properties.prop(both.particles, xv=1.0, yv=-2.0, spin=3.0)
    both.prepare()
    before = momentum(both)
    touched = 0
    for _ in range(20):
        both.advance(100)
        touched += len(both.contacts()["id"]) > 0
        assert np.abs(momentum(both) - before).max() <= 1e-12 * np.abs(before).max()
    assert 10 < touched < 20 and of_disc(both, "vy") > 1.0
    assert abs(of_disc(both, "spin") - 3.0) > 1.0  # the friction turned it


def test_momentum_of_a_hit_on_a_corner_of_quads(tmp_path):
    both = together(discs([(-0.03, 0.65, R)], tmp_path, dt=5e-6), body(rectangle(4, 2, 1.2, 0.6, kind="quad")))
    properties.prop(both.particles, xv=0.5, yv=-1.0)
    both.prepare()
    before = momentum(both)
    both.advance(100)
    found = both.contacts()
    assert list(found["face"]) == sorted(found["face"]) and len(found["face"]) == 2
    assert found["x"] == pytest.approx(0.0, abs=1e-3) and found["y"] == pytest.approx(0.6, abs=1e-3)
    both.advance(900)
    assert np.abs(momentum(both) - before).max() <= 1e-12 * np.abs(before).max()


def test_rebound_of_a_linear_disc(tmp_path):
    """Against a held body it is the half sine of the spring kn: U_max = v sqrt(m/k), t_c = pi sqrt(m/k), v' = -v."""
    v, k, dt = 1.0, 1e7, 2e-6
    both = together(discs([(0.55, 0.6 + R, R)], tmp_path, dt=dt), body(rectangle(6, 3, 1.2, 0.6), fixed=True))
    properties.prop(both.particles, yv=-v)
    deepest, steps = 0.0, 0
    while steps == 0 or len(both.contacts()["id"]):
        both.advance(1)
        deepest = max(deepest, *both.contacts()["overlap"], 0.0)
        steps += 1
    assert deepest == pytest.approx(v * math.sqrt(MASS / k), rel=1e-5)
    assert steps * dt == pytest.approx(math.pi * math.sqrt(MASS / k), abs=3 * dt)
    assert of_disc(both, "vy") == pytest.approx(v, rel=1e-6) and of_disc(both, "vx") == 0.0


def test_rebound_of_a_hertz_disc(tmp_path):
    """F = 4/3 E* sqrt(R) U^1.5 with both moduli: U_max = (15 m v^2 / (16 E* sqrt(R)))^(2/5) (Johnson 1985, 11.14)."""
    v, g, nu, dt = 0.5, 3e8, 0.2, 5e-6
    sim = discs([(0.55, 0.6 + R, R)], tmp_path, dt=dt)
    properties.prop(sim, shear=g, poiss=nu, hertz=True, yv=-v)
    both = together(sim, body(rectangle(6, 3, 1.2, 0.6), fixed=True))
    modulus = 1.0 / ((1.0 - nu**2) / (2.0 * g * (1.0 + nu)) + (1.0 - 0.25**2) / 1e9)
    deepest = 0.0
    for _ in range(4000):
        both.advance(1)
        if not len(both.contacts()["id"]) and deepest:
            break
        deepest = max(deepest, *both.contacts()["overlap"], 0.0)
    assert deepest == pytest.approx((15.0 * MASS * v * v / (16.0 * modulus * math.sqrt(R))) ** 0.4, rel=1e-4)
    assert of_disc(both, "vy") == pytest.approx(v, rel=1e-5)


@pytest.mark.parametrize(
    "upper, others, expected",
    [(None, None, 0.5), (10.0, None, 10.0), (None, 10.0, 0.5), (40.0, 10.0, 0.5), ("joint", None, 10.0)],
)
def test_friction_of_the_face_that_is_touched(tmp_path, upper, others, expected):
    """A disc (0.5) pushed along a held body: mu F_n, or the smaller friction of the face it lies on: of its contact
    model, or of the joint it was. What other faces of the element have does not count."""
    mesh = rectangle(6, 1, 1.2, 0.6, kind="quad")
    rock = body(mesh, fixed=True)
    edges = mesh.edges()
    high = mesh.points[edges.points][:, :, 1].min(axis=1) > 0.59
    top, rest = edges.faces[high][:, 0], edges.faces[~high].reshape(-1)
    if upper == "joint":
        mesh = rectangle(6, 2, 1.2, 1.2, kind="quad")
        rock = body(mesh, fixed=True)
        edges = mesh.edges()
        joints = edges.faces[(np.abs(mesh.points[edges.points][:, :, 1] - 0.6) < 1e-9).all(axis=1)][:, 0]
        rock.joint_model(joints, "classic_intrinsic_cohesive_interface", {**JOINT, "friction": 10.0})
        changes.null(rock, np.flatnonzero(mesh.centroids()[:, 1] > 0.6))
    for faces, angle in ((top, upper), (rest[rest >= 0], others)):
        if isinstance(angle, float):
            rock.face_model(faces, "contact_mohr_coulomb", {"friction": angle, "penalty_normal": 1e10})
    both = together(discs([(0.31, 0.6 + R - 1e-5, R)], tmp_path, dt=5e-6), rock)
    properties.prop(both.particles, xv=1.0)
    both.advance(40)
    found = both.contacts()
    mu = expected if expected < 1.0 else math.tan(math.radians(expected))
    assert len(found["fn"]) == 1 and abs(found["fs"][0] / found["fn"][0]) == pytest.approx(mu, rel=1e-9)


def test_disc_at_rest(tmp_path):
    """U = m g / k on an elastic body that stands on its base, which carries both weights."""
    blocks = body(rectangle(3, 2, 0.6, 0.4), {**ROCK, "damp_factor": 0.5}, gravity=G)
    base = np.flatnonzero(blocks.mesh.points[:, 1] < 1e-9)
    blocks.velocity_condition(base, vx=0.0, vy=0.0)
    sim = discs([(0.31, 0.4 + R, R)], tmp_path, gravity=(0.0, -G))
    properties.prop(sim, damp=0.7)
    both = together(sim, blocks)
    both.advance(15000)
    found = both.contacts()
    assert found["overlap"].sum() / len(found["id"]) == pytest.approx(MASS * G / 1e7, rel=1e-4)
    assert both.force_on_blocks()[1] == pytest.approx(-MASS * G, rel=1e-4)
    held = diagnostics.total(blocks, "reaction_y", base)
    assert held == pytest.approx((MASS + 2500.0 * 0.24) * G, rel=1e-3)


@pytest.mark.parametrize("friction, mu", [(None, 0.5), (0.2, 0.2)])
def test_sliding(tmp_path, friction, mu):
    """A disc that cannot turn slides over 20 faces: F_t = -mu N and m (g + dv_y/dt) = N at any moment, so the change
    of v_x is -mu (g t + change of v_y), however it bounces."""
    dt, v = 1e-5, 1.0
    sim = discs([(0.3, 0.4 + R - MASS * G / 1e7, R)], tmp_path, dt=dt, gravity=(0.0, -G))
    properties.prop(sim, xv=v)
    properties.fix(sim, ("spin",))
    both = together(sim, body(rectangle(20, 2, 2.0, 0.4), fixed=True), friction=friction)
    both.advance(2)  # friction is built up from nothing
    both.advance(100)
    vx, vy = of_disc(both, "vx"), of_disc(both, "vy")
    both.advance(5000)
    fall = G * 5000 * dt + of_disc(both, "vy") - vy
    assert of_disc(both, "vx") - vx == pytest.approx(-mu * fall, rel=1e-9)
    assert fall == pytest.approx(G * 5000 * dt, rel=1e-3)


def run_along(tmp_path, mesh, steps=6000):
    """A disc that is thrown forward with a spin, along the upper side of a held body at y = 0.4, at every 50th step."""
    sim = discs([(0.15, 0.4 + R - MASS * G / 1e7, R)], tmp_path, dt=2e-5, gravity=(0.0, -G))
    properties.prop(sim, xv=6.0, spin=-20.0)
    both = together(sim, body(mesh, fixed=True))
    seen = []
    for _ in range(steps // 50):
        both.advance(50)
        fn, fs = both.contacts()["fn"].sum(), both.contacts()["fs"].sum()
        seen.append([of_disc(both, name) for name in ("x", "y", "vx", "spin")] + [fn, fs])
    return np.array(seen)


def test_no_bump_between_faces(tmp_path):
    """Along 37 faces as along one: also in the steps in which it passes from one to the next."""
    one = run_along(tmp_path, rectangle(1, 1, 3.0, 0.4))
    many = run_along(tmp_path, rectangle(37, 1, 3.0, 0.4, kind="mixed"))
    assert one[-1, 0] > 0.8 and np.ptp(one[:, 3]) > 5.0  # it slid first, then it rolled
    scale = np.abs(one).max(axis=0)
    assert np.abs(many - one).max(axis=0) == pytest.approx(0.0, abs=1e-9 * scale.max())
    assert (np.abs(many - one) / scale).max() < 1e-9


@pytest.mark.slow
def test_no_bump_between_jointed_elements(tmp_path):
    """Corners of neighbours are nodes of their own there, yet the surface is one."""
    mesh = rectangle(15, 1, 1.5, 0.4)

    def force(jointed):
        sim = discs([(0.3, 0.4 + R - MASS * G / 1e7, R)], tmp_path, dt=2e-6, gravity=(0.0, -G))
        properties.prop(sim, xv=3.0, fric=0.0)
        blocks = body(mesh, {**STIFF, "damp_factor": 0.3})
        if jointed:
            blocks.joint_model(None, "classic_intrinsic_cohesive_interface", {**JOINT, "penalty_normal": 5e12})
        low = np.flatnonzero(mesh.points[:, 1] < 1e-9)
        blocks.velocity_condition(low, vx=0.0, vy=0.0)
        both = together(sim, blocks)
        seen = []
        for _ in range(100):
            both.advance(300)
            seen.append(both.contacts()["fn"].sum())
        return np.array(seen)

    plain, tied = force(False), force(True)
    assert plain[20:] == pytest.approx(MASS * G, rel=0.02)
    assert tied[20:] == pytest.approx(MASS * G, rel=0.03)


def test_one_contact_at_a_convex_corner_and_two_in_a_groove(tmp_path):
    """At a corner the force is that of one spring; a groove of 90 degrees carries a disc with two."""
    k, u = 1e7, 1e-4
    s = math.sqrt(0.5)
    both = together(
        discs([(0.6 + (R - u) * s, 0.4 + (R - u) * s, R)], tmp_path, dt=1e-6),
        body(rectangle(3, 2, 0.6, 0.4), fixed=True),
    )
    both.advance(1)
    found = both.contacts()
    assert len(found["id"]) == 2 and found["fn"].sum() == pytest.approx(k * u, rel=1e-6)
    assert both.force_on_blocks() == pytest.approx((-k * u * s, -k * u * s), rel=1e-6)

    groove = Mesh.of([(0, 0), (1, 0), (1, 0.5), (0.5, 0), (0, 0.5)], [(0, 3, 4, -1), (3, 1, 2, -1)])
    both = together(discs([(0.5, (R - u) / s, R)], tmp_path, dt=1e-6), body(groove, fixed=True))
    both.advance(1)
    found = both.contacts()
    assert len(found["id"]) == 2 and found["overlap"] == pytest.approx(u, rel=1e-6)
    assert found["fn"] == pytest.approx(k * u, rel=1e-6)


def test_disc_between_two_flush_blocks(tmp_path):
    """Over the gap between two bodies of one height it has the force of one contact, not of two (or four)."""
    k, u = 1e7, 1e-4
    mesh = joined(rectangle(2, 1, 0.4, 0.4), rectangle(2, 1, 0.4, 0.4, x0=0.4 + 1e-7))
    both = together(discs([(0.4 + 0.5e-7, 0.4 + R - u, R)], tmp_path, dt=1e-6), body(mesh, fixed=True))
    both.advance(1)
    assert both.contacts()["fn"].sum() == pytest.approx(k * u, rel=1e-4)
    assert both.force_on_blocks()[1] == pytest.approx(-k * u, rel=1e-4)


def test_energy_across_the_contact(tmp_path):
    """Without friction what one side loses the other gets; the account of both closes."""
    blocks = body(rectangle(6, 3, 1.2, 0.6), ROCK)
    diagnostics.account_energy(blocks)
    sim = discs([(0.55, 0.6 + R, R)], tmp_path, dt=2e-6)
    properties.prop(sim, yv=-2.0, fric=0.0)
    both = together(sim, blocks)
    from hpcdem.physics.dem.budget import Budget

    sim.energy = Budget()
    sim.energy.begin(sim)
    both.advance(400)
    middle = both.energies()
    assert middle["stored"] > 10.0 and abs(middle["lost"]) < 1e-4 * middle["stored"]
    both.advance(6000)
    found = both.energies()
    assert found["stored"] == 0.0 and found["work_on_blocks"] > 1.0
    assert abs(found["lost"]) < 1e-4 * found["work_on_blocks"]
    assert found["relative"] < 1e-6
    gone = 0.5 * MASS * (2.0**2 - of_disc(both, "vx") ** 2 - of_disc(both, "vy") ** 2)
    assert -found["work_on_particles"] == pytest.approx(gone, rel=1e-9)


def test_hertz_law_of_a_disc_at_rock_of_another_material() -> None:
    """1/E* and 1/G* written out; linear discs have their own springs; of two frictions the smaller one counts."""
    disc = {"fric": 0.5, "hertz": True, "poiss": 0.2, "shear": 3e8, "kn": 1e7, "ks": 2e7}
    table = law_table(
        np.array([0.0, 5e9]), np.array([0.0, 0.3]), [disc, {**disc, "hertz": False}], np.array([0.4, 0.9])
    )
    plain, rough = table.reshape(2, 2, 2, 4)
    star = 1.0 / (0.8 / 6e8 + 0.7 / 1e10)
    shear = 1.0 / (1.8 / 3e8 + 1.7 / 5e9)
    # F = 4/3 E* sqrt(R) U^1.5 and ks = 8 G* sqrt(R U) by sqrt(4 R U), twice the root of R U.
    assert rough[1, 0] == pytest.approx([laws.HERTZ, 4.0 / 3.0 * star / 2.0, 8.0 * shear / 2.0, 0.5], rel=1e-14)
    assert rough[1, 1].tolist() == [laws.LINEAR, 1e7, 2e7, 0.5] and (rough[0] == 0.0).all()
    assert plain[1, :, 3].tolist() == [0.4, 0.4] and (plain[..., :3] == rough[..., :3]).all()


def test_faces_are_sent_to_the_ranks_whose_discs_they_may_meet() -> None:
    """Boxes of the discs of three ranks in a row; faces by their boxes, to each that they reach into."""
    boxes = np.array([[0.0, 3.0, -1.0, 1.0], [2.0, 6.0, 0.0, 2.0], [8.0, 9.0, 0.0, 1.0]])

    def most(box: np.ndarray) -> None:
        box[[0, 2]] = boxes[[0, 2]] * [-1.0, 1.0, -1.0, 1.0]

    hot = np.zeros((2, WIDTH))
    hot[:, X], hot[:, Y], hot[:, RADIUS] = (2.6, 5.6), (0.6, 1.4), 0.5
    link = SimpleNamespace(
        comm=SimpleNamespace(size=3, rank=1, max_into=most), margin=0.1, _rows=np.arange(2),
        particles=SimpleNamespace(particles=SimpleNamespace(hot=hot)),
    )  # fmt: skip
    low = np.array([[0.5, 0.5], [2.5, 0.5], [2.5, 1.5], [6.5, 0.5], [8.5, -3.0], [5.0, 0.5]])
    high = low + np.array([[0.1, 0.1]] * 5 + [[4.0, 0.1]])
    row, rank = Link._reached(link, low, high)
    assert list(zip(row.tolist(), rank.tolist())) == [(0, 0), (1, 0), (1, 1), (2, 1), (5, 1), (5, 2)]


def test_bins_of_work_are_emptied_before_they_are_full() -> None:
    """Into the sums of both sides, each once; sums are those of all ranks."""
    told: list[tuple[str, int]] = []
    both = SimpleNamespace(
        particles=SimpleNamespace(energy=SimpleNamespace(add_from_blocks=lambda value: told.append(("discs", value)))),
        blocks=SimpleNamespace(
            budget=SimpleNamespace(start={}, add_from_discs=lambda value: told.append(("faces", value)))
        ),
        comm=SimpleNamespace(rank=0, allgather=lambda mine: [mine, (3, 50)]),
    )
    work = Work(both)
    work._bins[0, 0, 1023], work._bins[1, 0, 1000] = 5, -7  # 5 and -7 units of some powers of two
    one, other = as_integer(work._bins[0]), as_integer(work._bins[1])
    for _ in range(EMPTIED - 1):
        work.step_done()
    assert not told
    work.step_done()
    assert told == [("discs", one), ("faces", other)] and not work._bins.any()
    work.empty()
    assert len(told) == 2 and work._sums() == [one + 3, other + 50]
