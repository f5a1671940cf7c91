"""Contact of two triangles by potentials: balance, the specified values, a quadrature of its own, no work in a loop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem.kernels import contact

UPPER = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, math.sqrt(3.0) / 2.0]])
LOWER = np.array([[0.0, 0.0], [0.5, -math.sqrt(3.0) / 2.0], [1.0, 0.0]])


def forces(
    a, b, penalty=1.0, shear=0.0, friction=0.0, va=None, vb=None, dt=1.0, history=None, half=0.0, damp=None, dashpot=0.0
):
    """Forces (n, 6, 2) on the corners of triangles a, then b, (n, 3, 2) each."""
    a, b = (np.asarray(t, float).reshape(-1, 3, 2) for t in (a, b))
    n = len(a)
    x, v = np.zeros((2 * n + 1, 8)), np.zeros((2 * n + 2, 6))
    x[:n, :6], x[n : 2 * n, :6] = a.reshape(n, 6), b.reshape(n, 6)
    for rows, speed in ((slice(0, n), va), (slice(n, 2 * n), vb)):
        if speed is not None:
            v[rows] = np.broadcast_to(speed, (n, 3, 2)).reshape(n, 6)
    table = np.tile([penalty, shear, friction, 0.0], (n + 4, 1))
    table.view(np.int64)[:, contact.CODE] = int(half) + contact.ALL_EDGES
    history = np.zeros((n + 4, 6)) if history is None else history
    dampers, largest = np.zeros((0, contact.DAMPER)), np.zeros((0, 12))
    if damp is not None:
        dampers, largest = np.tile([damp[0], *damp[:2], dashpot], (n + 4, 1)), damp[2]
    touching, out = np.zeros(n, np.uint8), np.zeros((n, 12))
    contact.forces(
        1, np.arange(n), np.arange(n, 2 * n), 8 * np.arange(2 * n), 6 * np.arange(2 * n), x, v, table, history, dampers,
        largest, np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros((0, contact.CHOICE)), touching, out, dt,
    )  # fmt: skip
    return (out * touching[:, None]).reshape(n, 6, 2)


def random_triangles(n: int, rng) -> np.ndarray:
    t = rng.uniform(-1.0, 1.0, (n, 3, 2))
    u, w = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    clockwise = u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0] < 0.0
    t[clockwise] = t[clockwise][:, ::-1]
    return t


def potential(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """3 min lambda_k of points (m, 2), 0 outside."""
    (x1, y1), (x2, y2), (x3, y3) = target
    matrix = np.array([[x1, x2, x3], [y1, y2, y3], [1.0, 1.0, 1.0]])
    lam = np.linalg.solve(matrix, np.column_stack([points, np.ones(len(points))]).T)
    return 3.0 * np.maximum(lam.min(axis=0), 0.0)


def by_quadrature(a: np.ndarray, b: np.ndarray, samples: int = 40001) -> np.ndarray:
    """Total force on a: every edge of a takes -n phi_b ds, every edge of b gives back n phi_a ds."""
    t = (np.arange(samples) + 0.5) / samples
    total = np.zeros(2)
    for contactor, target, sign in ((a, b, 1.0), (b, a, -1.0)):
        for m in range(3):
            p, q = contactor[m], contactor[(m + 1) % 3]
            phi = potential(p + t[:, None] * (q - p), target).mean()
            total -= sign * phi * np.array([q[1] - p[1], p[0] - q[0]])
    return total


def test_forces_and_moments_balance():
    """500 random pairs: both sums are zero to rounding."""
    rng = np.random.default_rng(5)
    a, b = random_triangles(500, rng), random_triangles(500, rng)
    f = forces(a, b, shear=1.0, friction=0.5, va=rng.normal(size=(500, 3, 2)), vb=rng.normal(size=(500, 3, 2)))
    x = np.concatenate([a, b], axis=1)
    assert (np.abs(f).max(axis=(1, 2)) > 0.0).sum() > 250
    assert np.abs(f.sum(axis=1)).max() < 1e-12
    assert np.abs((x[..., 0] * f[..., 1] - x[..., 1] * f[..., 0]).sum(axis=1)).max() < 1e-12


def test_edge_integrals_agree_with_a_quadrature():
    rng = np.random.default_rng(6)
    a, b = random_triangles(40, rng), random_triangles(40, rng)
    f = forces(a, b)[:, :3].sum(axis=1)
    for k in range(len(a)):
        assert f[k] == pytest.approx(by_quadrature(a[k], b[k]), abs=1e-6)


def test_flat_contact_of_equilateral_triangles_has_the_specified_values():
    """P = 1, overlap 0.01: 0.0676320 in all, node shares .0336208, .0336208, .0003905; the formula for an endless edge,
    3 P d (1 / h + 1 / h) L = 0.0692820, is 2.4 % more (ends)."""
    f = forces(UPPER - [0.0, 0.01], LOWER)[0]
    assert f[:3, 1] == pytest.approx([0.0336208, 0.0336208, 0.0003905], abs=5e-8)
    assert f[:3, 1].sum() == pytest.approx(0.0676320, abs=5e-8)
    assert f[:3, 1].sum() == pytest.approx(6.0 * 0.01 / (math.sqrt(3.0) / 2.0), rel=0.025)
    assert np.abs(f[:, 0]).max() < 1e-15


def work_around(body, targets, half: float = 0.0) -> tuple[float, float]:
    """Work on `body` along a closed loop of translations through the targets, and the sum of its absolute values.

    A polygon of 20 000 sides, three Gauss points on each: exact but for the sides with a kink of the force.
    """
    sides = 20000
    angle = 2.0 * math.pi * np.arange(sides + 1) / sides
    way = np.column_stack([1.5 * np.cos(angle), 0.9 * np.sin(angle) - 0.9])
    step = np.diff(way, axis=0)
    done = np.zeros(sides)
    for at, weight in ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18)):
        place = body + (way[:-1] + at * step)[:, None]
        f = sum(forces(place, np.tile(t, (sides, 1, 1)), half=half)[:, :3].sum(axis=1) for t in targets)
        done += weight * (f * step).sum(axis=1)
    return float(done.sum()), float(np.abs(done).sum())


def test_a_rigid_trip_through_a_triangle_does_no_work():
    """The force comes from a potential: a closed loop gives back what it took, below 1e-9 of P."""
    net, gross = work_around(UPPER, [LOWER])
    assert gross > 0.02 and abs(net) < 1e-9


def test_a_rigid_trip_through_a_quad_does_no_work():
    """The same through both halves of a quad that is no parallelogram."""
    a, b, c, d = np.array([0.0, -1.0]), np.array([1.0, -1.0]), np.array([1.1, 0.1]), np.array([-0.1, 0.0])
    net, gross = work_around(UPPER, [np.array([a, b, c]), np.array([c, d, a])], half=2.0)
    assert gross > 0.02 and abs(net) < 1e-9


def test_halves_of_a_quad_act_like_one_body():
    """A triangle deep in a quad feels nothing of its diagonal: the potential goes on there."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    inside = 0.2 * (UPPER - UPPER.mean(axis=0)) + [0.5, 0.5]
    halves = [square[[0, 1, 2]], square[[2, 3, 0]]]
    f = sum(forces(inside, t, half=2.0)[0, :3].sum(axis=0) for t in halves)
    other = sum(forces(inside, t, half=2.0)[0, :3].sum(axis=0) for t in (square[[1, 2, 3]], square[[3, 0, 1]]))
    assert np.abs(f).max() < 0.2 and np.abs(other).max() < 0.2  # no wall in the middle: that would be about 1


def test_friction_grows_with_slip_and_stops_at_the_cone():
    """F_s = P_s l v dt per step up to tan(phi) F_n, against the motion."""
    a = UPPER - [0.0, 0.01]
    history = np.zeros((5, 6))
    rest = forces(a, LOWER)[0, :3].sum(axis=0)
    seen = []
    for _ in range(120):
        f = forces(a, LOWER, shear=1.0, friction=0.5, va=[[2e-4, 0.0]] * 3, history=history)[0]
        seen.append(f[:3].sum(axis=0))
    along = np.array(seen)[:, 0]
    assert along[0] < 0.0 and (np.diff(along) <= 1e-15).all()
    assert along[-1] == pytest.approx(-0.5 * rest[1], rel=0.03)  # small edges lie across
    back = forces(a, LOWER, shear=1.0, friction=0.5, va=[[-2e-4, 0.0]] * 3, history=history)[0, :3].sum(axis=0)
    assert back[0] > along[-1]


def test_apart_or_only_touching_there_is_no_force():
    for shift in (0.0, 1e-9, 1.0):
        history = np.ones((5, 6))
        assert (forces(UPPER + [0.0, shift], LOWER, friction=1.0, history=history) == 0.0).all()


def test_damped_contact_loses_energy_during_unloading():
    """sigma = min(sigma_try, T) in; min(sigma_try, T (o / o_max)^b) out."""
    depth = np.concatenate([np.linspace(0.0, 0.02, 40), np.linspace(0.02, 0.0, 40)[1:]])
    largest = np.zeros((5, 12))
    plain = np.array([forces(UPPER - [0.0, d], LOWER)[0, :3, 1].sum() for d in depth])
    top = 0.4 * plain.max()
    damped = [forces(UPPER - [0.0, d], LOWER, damp=(top, 2.0, largest))[0, :3, 1].sum() for d in depth]
    damped = np.array(damped)
    assert damped[:10] == pytest.approx(plain[:10], rel=1e-6) or damped[5] <= plain[5]
    assert damped.max() < 1.1 * 2.0 * top  # both edges limited
    assert (damped[41:-1] < damped[38:0:-1][: len(damped[41:-1])] + 1e-15).all()
    assert (damped <= plain + 1e-15).all()


def test_a_dashpot_pushes_against_approach_and_never_pulls():
    """c v on the length inside, for either contactor; while they part it takes away, down to nothing."""
    c, speed = 3.0, 1e-4
    a = UPPER - [0.0, 0.01]
    plain = forces(a, LOWER)[0]
    damp = (math.inf, 1.0, np.zeros((5, 12)))
    for v in (speed, -speed):
        found = forces(a, LOWER, va=[[0.0, -v]] * 3, damp=damp, dashpot=c)[0]
        more = (found - plain)[:3, 1].sum()
        # Both flat edges lie 0.01 inside a triangle of base 1 and height 0.866: 1 - 2 * 0.01 / sqrt(3) of them.
        assert more == pytest.approx(2.0 * c * v * (1.0 - 0.02 / math.sqrt(3.0)), rel=0.03)
        assert found.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    away = forces(a, LOWER, va=[[0.0, 1e3]] * 3, damp=damp, dashpot=c)[0]
    assert away[:3, 1].sum() == pytest.approx(0.0, abs=0.01 * plain[:3, 1].sum())  # what is at the corners
