"""The kernel of contact in space: against the plain reference, values computed elsewhere, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem.kernels import contact_space as contact
from hpcdem.physics.fdem.reference_contact import pair_forces, tetrahedra_forces, touch
from hpcdem.physics.fdem.tetrahedra import FACES

ROOT3 = np.sqrt(3.0)
T1 = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, ROOT3 / 2, 0.0], [0.5, ROOT3 / 6, np.sqrt(2.0 / 3.0)]])
T2 = (
    np.array([[0.1, 0.2, -0.15], [1.0, 0.3, 0.1], [0.2, 0.9, 0.05], [0.3, 0.25, 0.9]]),
    np.array([[0.0, 0.0, 0.1], [0.2, 1.0, 0.0], [1.1, 0.1, -0.05], [0.3, 0.4, -0.8]]),
)


def run(
    one: np.ndarray, other: np.ndarray, speeds: tuple[np.ndarray, np.ndarray] | None = None, length: float = 0.0,
    law: tuple[float, ...] = (1.0, 1.0, 0.0), history: np.ndarray | None = None, dt: float = 0.1, threads: int = 1,
    damping: tuple[float, float, float] = (np.inf, 1.0, 0.0),
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Forces (n, 8, 3) on the corners of pairs of tetrahedra (n, 4, 3), all faces contactors, and histories (8 n, 5),
    which are changed."""
    n = len(one)
    x, v = np.zeros((2 * n, 4, 4)), np.zeros((2 * n, 4, 4))
    x[0::2, :, :3], x[1::2, :, :3] = one, other
    if speeds is not None:
        v[0::2, :, :3], v[1::2, :, :3] = speeds
    face = np.arange(8 * n)
    corner = 16 * (face // 4)[:, None] + 4 * FACES[face % 4]
    history = np.zeros((8 * n, contact.MEMORY)) if history is None else history
    second = (face // 4) ^ 1
    rows = np.arange(2 * n)
    entries = np.r_[8 * face + face % 4, 8 * face + 4]
    entries = entries[np.lexsort((entries, np.r_[face // 4, second]))]
    pushed = np.full((2 * n, 16), np.nan)
    kernel = contact.forces.py_func if threads > 1 else contact.forces
    kernel(
        threads, 16 * rows, np.zeros((2 * n, 6)), face, second, corner, np.full(2 * n, length), x.reshape(2 * n, 16),
        v.reshape(2 * n, 16), np.tile([*law, *damping], (8 * n, 1)), np.empty(0, np.int64), np.zeros(1, np.int64),
        np.zeros((0, contact.CHOICE)), history, np.ones(8 * n, np.uint8), np.zeros((8 * n, contact.FORCES)), dt,
        8 * np.arange(2 * n + 1), entries, pushed,
    )  # fmt: skip
    assert not pushed.reshape(-1, 4)[:, 3].any()
    return pushed.reshape(n, 8, 4)[:, :, :3], history


def random_pairs(n: int, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra (n, 4, 3) of any shape, turned outwards, near each other."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(2):
        x = rng.uniform(0.0, 1.0, (n, 4, 3))
        flip = np.linalg.det(x[:, 1:] - x[:, :1]) < 0.0
        x[flip] = x[flip][:, [0, 2, 1, 3]]
        found.append(x)
    return found[0], found[1]


def test_a_tetrahedron_in_its_mirror_image() -> None:
    """Values known beforehand for P = 1: a regular tetrahedron of side 1, moved down by 0.01."""
    below = (T1 * [1.0, 1.0, -1.0])[[0, 2, 1, 3]]
    force, _ = run((T1 - [0.0, 0.0, 0.01])[None], below[None])
    assert force[0, :4, 2].sum() == pytest.approx(0.0398214048, abs=1e-10)
    shares = np.sort(force[0, :4, 2])
    assert np.allclose(shares, [0.000243855, 0.013192516, 0.013192516, 0.013192516], rtol=0.0, atol=1e-9)


def test_two_tetrahedra_anyhow() -> None:
    """Values known beforehand, in the numbering of their making (corners turned, if need be)."""
    one, other = T2
    flipped = [np.linalg.det(x[1:] - x[0]) < 0.0 for x in T2]
    one, other = (x[[0, 2, 1, 3]] if flip else x for x, flip in zip(T2, flipped))
    force, _ = run(one[None], other[None])
    assert np.allclose(force[0, :4].sum(axis=0), [-7.4452e-4, 6.10217e-3, 6.096325e-2], rtol=0.0, atol=1e-8)
    z = force[0, :4, 2][[0, 2, 1, 3]] if flipped[0] else force[0, :4, 2]
    assert np.allclose(z, [0.033445242, 0.011670447, 0.013934480, 0.001913086], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("length", [0.0, 0.4])
def test_forces_are_those_of_the_plain_reference(length: float) -> None:
    """Of 300 pairs of any shape: the same on each corner; sums of forces and of moments vanish to rounding."""
    one, other = random_pairs(300)
    force, _ = run(one, other, length=length)
    several, _ = run(one, other, length=length, threads=3)
    assert np.array_equal(force, several)
    size = np.abs(force).sum(axis=(1, 2))
    assert (size > 0.0).sum() > 150
    for i in range(100):
        exact = tetrahedra_forces(one[i], other[i], length, 1.0)
        assert np.abs(force[i] - exact).max() < 1e-13 * max(1.0, np.abs(exact).max())
    x = np.concatenate([one, other], axis=1)
    assert np.abs(force.sum(axis=1)).max() < 1e-15 * size.max()
    assert np.abs(np.cross(x, force).sum(axis=1)).max() < 1e-15 * size.max()


@pytest.mark.parametrize("length", [0.0, 0.4])
def test_friction_is_that_of_the_plain_reference(length: float) -> None:
    """Two steps of pairs that move: the remembered force turns with the face, grows with the way, and slips."""
    one, other = random_pairs(60, 8)
    rng = np.random.default_rng(2)
    speeds = rng.uniform(-0.2, 0.2, (60, 4, 3)), rng.uniform(-0.2, 0.2, (60, 4, 3))
    law, history = (1.0, 0.7, 0.4), None
    known = np.zeros((60, 2, 4, 3))
    slips = sticks = 0
    for _ in range(2):
        force, history = run(one, other, speeds, length, law, history, dt=0.05)
        for i in range(60):
            exact = np.zeros((8, 3))
            for s, (own, target) in enumerate(((one[i], other[i]), (other[i], one[i]))):
                for k, c in enumerate(FACES):
                    both = (speeds[s][i][c], speeds[1 - s][i])
                    before = known[i, s, k].copy()
                    found, known[i, s, k] = pair_forces(own[c], target, both, length, law, before, 0.05)
                    exact[4 * s + c] += found[:3]
                    exact[4 * (1 - s) : 4 * (1 - s) + 4] += found[3:]
                    touched = touch(own[c], target, length, 1.0)
                    if touched is not None:
                        slides = np.linalg.norm(known[i, s, k]) > 0.4 * touched.normal * (1.0 - 1e-9)
                        slips, sticks = slips + slides, sticks + (not slides)
            assert np.abs(force[i] - exact).max() < 1e-13
            assert np.abs(history.reshape(60, 2, 4, -1)[i, :, :, :3] - known[i]).max() < 1e-13
        one = one + 0.05 * speeds[0]
        other = other + 0.05 * speeds[1]
    assert slips > 20 and sticks > 20


@pytest.mark.parametrize("length", [0.0, 0.4])
def test_a_closed_path_costs_nothing(length: float) -> None:
    """The work along an ellipse through another tetrahedron falls with the square of the step and is all but nothing
    beside what goes in and comes out."""
    one, other = T2
    one, other = (x[[0, 2, 1, 3]] if np.linalg.det(x[1:] - x[0]) < 0.0 else x for x in T2)
    left = []
    for n in (100, 400):
        angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
        place = np.column_stack([0.3 * np.cos(angle), 0.2 * np.sin(angle), 0.25 * np.sin(angle) - 0.1])
        way = 2.0 * np.pi / n * np.column_stack([-0.3 * np.sin(angle), 0.2 * np.cos(angle), 0.25 * np.cos(angle)])
        force, _ = run(one + place[:, None, :], np.repeat(other[None], n, axis=0), length=length)
        work = (force[:, :4].sum(axis=1) * way).sum(axis=1)
        left.append(abs(work.sum()) / np.abs(work).sum())
    assert left[1] < 2e-5 and left[1] < 0.2 * left[0]


def flat(depth: float) -> tuple[np.ndarray, np.ndarray]:
    """A small face pushed by `depth` into the large side of another tetrahedron, far from its edges."""
    big = np.array([[-9.0, -9.0, 0.0], [0.0, 12.0, 0.0], [9.0, -9.0, 0.0], [0.0, -3.0, -6.0]])
    assert np.linalg.det(big[1:] - big[0]) > 0.0
    small = np.array([[0.0, 0.0, -depth], [0.0, 1.0, -depth], [1.0, 0.0, -depth], [0.3, 0.3, 1.0]])
    small = small[[0, 2, 1, 3]]
    return small, big


def test_pressure_of_a_flat_overlap() -> None:
    """P d / h of the distance, 4 P d / H of Munjiza's potential (H the altitude of the target), times the area, on the
    face that is inside."""
    small, big = flat(0.01)
    for length, pressure in ((2.0, 0.01 / 2.0), (0.0, 4.0 * 0.01 / 6.0)):
        found = [touch(small[c], big, length, 3.0) for c in FACES]
        exact = max(one.normal for one in found if one is not None)
        assert exact == pytest.approx(3.0 * pressure * 0.5, rel=1e-12)
        force, _ = run(small[None], big[None], length=length, law=(3.0, 1.0, 0.0))
        # Both are contactors: P d (1 / h_1 + 1 / h_2), less what the rims of the small one lose.
        other = exact if length else 3.0 * 4.0 * 0.01 / 1.01 * 0.5
        assert 0.95 * (exact + other) < force[0, :4, 2].sum() < exact + other


def test_damping_of_the_normal_force() -> None:
    """The largest stress T while surfaces approach, (o / o_max)^b while they part; a dashpot does not pull."""
    rows = np.zeros((1, contact.MEMORY))

    def bottom(depth: float, damping: tuple[float, float, float], vz: float = 0.0) -> float:
        """Upward force on the lowest face alone, per its area."""
        small, big = flat(depth)
        x = np.zeros((2, 4, 4))
        x[0, :, :3], x[1, :, :3] = small, big
        v = np.zeros((2, 4, 4))
        v[0, :, 2] = vz
        k = next(k for k, c in enumerate(FACES) if np.ptp(small[c][:, 2]) == 0.0)
        out, touching = np.zeros((1, contact.FORCES)), np.ones(1, np.uint8)
        contact.forces(
            1, np.array([0, 16]), np.zeros((2, 6)), np.array([0]), np.array([1]), 4 * FACES[k : k + 1],
            np.ones(2), x.reshape(2, 16), v.reshape(2, 16), np.array([[1.0, 1.0, 0.0, *damping]]),
            np.empty(0, np.int64), np.zeros(1, np.int64), np.zeros((0, contact.CHOICE)), rows, touching, out,
            0.1, np.zeros(1, np.int64), np.empty(0, np.int64), np.zeros((0, 16)),
        )  # fmt: skip
        return float(out[0, 2:9:3].sum()) / 0.5

    soft = (0.02, 2.0, 0.0)
    assert bottom(0.01, soft) == pytest.approx(0.01)
    assert bottom(0.03, soft) == pytest.approx(0.02)
    assert bottom(0.024, soft) == pytest.approx(0.02 * 0.8**2)
    assert bottom(0.003, soft) == pytest.approx(0.02 * 0.1**2)
    assert bottom(-0.1, soft) == 0.0 and not rows.any()  # apart: all is forgotten
    dashpot = (np.inf, 1.0, 0.5)
    assert bottom(0.01, dashpot, -0.1) == pytest.approx(0.01 + 0.05)
    assert bottom(0.01, dashpot, 0.01) == pytest.approx(0.01 - 0.005)
    assert bottom(0.01, dashpot, 1.0) == 0.0
