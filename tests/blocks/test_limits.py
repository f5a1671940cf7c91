"""Small pieces of the kernels of blocks by themselves, against closed forms and numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem.kernels import contact, detect, joint_law, limits, space, strength, tets

RNG = np.random.default_rng(7)


@pytest.mark.parametrize(
    ("element", "mass", "spring", "dashpot", "drag", "eta", "expected"),
    [
        (0.0, 4.0, 50.0, 0.0, 0.0, 0.0, 2.0 / 5.0),  # a spring counts twice
        (36.0, 4.0, 32.0, 0.0, 0.0, 0.0, 2.0 / 5.0),  # added mass: a quarter of the element's 36, and 16
        (0.0, 4.0, 50.0, 12.0, 0.0, 0.0, 0.4 * (math.sqrt(1.36) - 0.6)),  # c / (m omega) = 0.6
        (0.0, 4.0, 50.0, 0.0, 24.0, 0.0, 0.4 * (math.sqrt(1.36) - 0.6)),  # drag on the true mass, halved
        (100.0, 4.0, 0.0, 0.0, 0.0, 3.0, 0.4 * (math.sqrt(1.0 + 2.25) - 1.5)),  # 3 * 25 / (2 * 5 * 5)
    ],
)
def test_the_time_step_of_a_corner(
    element: float, mass: float, spring: float, dashpot: float, drag: float, eta: float, expected: float
) -> None:
    found = limits.corner_step(element, 1.0, mass, spring, dashpot, drag, eta, 5.0)
    assert found == pytest.approx(expected, rel=1e-14)


def test_nothing_that_holds_a_corner_sets_no_limit() -> None:
    assert limits.corner_step(0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 5.0) == math.inf


def gradients(inverse: np.ndarray) -> np.ndarray:
    """Of the three shape functions (3, 2)."""
    return np.concatenate([[-inverse.sum(axis=0)], inverse])


def test_gradients_and_rows_of_the_stiffness_of_a_triangle() -> None:
    """B^T C B by numpy; area, lambda and mu apart from each other."""
    for _ in range(5):
        inverse, (lam, mu, area) = RNG.normal(size=(2, 2)), RNG.uniform(0.5, 3.0, 3)
        g = gradients(inverse)
        assert limits.gradients2(*inverse.ravel()) == pytest.approx((g**2).sum(), rel=1e-13)
        b = np.zeros((3, 6))
        b[0, 0::2], b[1, 1::2], b[2, 0::2], b[2, 1::2] = g[:, 0], g[:, 1], g[:, 1], g[:, 0]
        c = np.array([[lam + 2.0 * mu, lam, 0.0], [lam, lam + 2.0 * mu, 0.0], [0.0, 0.0, mu]])
        rows = np.abs(area * b.T @ c @ b).sum(axis=1).reshape(3, 2)
        out = np.full(3, 0.25)
        limits._row_sums(*inverse.ravel(), lam, mu, area, out)
        assert out == pytest.approx(rows.max(axis=1) + 0.25, rel=1e-13)


def test_strength_between_the_points_of_a_table() -> None:
    """The second of two tables, at its points, between them and beyond its ends; and where there is none."""
    points = np.array([[0.0, 9.0], [1.0, 8.0], [0.0, 4.0], [0.1, 2.0], [0.4, 3.5]])
    begin = np.array([0, 2, 5])
    for strain in (-1.0, 0.0, 0.05, 0.1, 0.2, 0.4, 7.0):
        expected = np.interp(strain, points[2:, 0], points[2:, 1])
        assert strength._at(strain, 2, 77.0, begin, points) == pytest.approx(expected, rel=1e-14)
    assert strength._at(0.5, 1, 77.0, begin, points) == 8.5 and strength._at(0.5, 0, 77.0, begin, points) == 77.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_left_of_a_joint_beyond_its_peak(side: float) -> None:
    """Half of the strength is left. Below the largest slip so far (1 cm) the line through the origin, beyond it all of
    the limit; without a peak in shear the parabola up to it. Closed: friction of the pressure besides."""
    h, tensile, cohesion, overlay, tan_phi, half_shear = 2.0, 3e6, 4e6, 1e9, 0.5, 1.0 / 2e9

    def point(o: float, s: float, s_u: float, o_u: float = 0.0) -> tuple[float, float]:
        return joint_law.softened_point(
            o, side * s, h, 1.0 / h, 0.0, tensile, overlay, tan_phi, cohesion, half_shear, o_u, s_u, 0.5
        )

    peak = joint_law.slip_at_peak(0.0, h, 1.0 / h, overlay, tan_phi, cohesion, half_shear)
    assert point(0.0, 0.0025, 0.01)[1] == pytest.approx(side * 0.25 * 0.5 * cohesion)
    assert point(0.0, 0.02, 0.01)[1] == pytest.approx(side * 0.5 * cohesion)
    assert point(0.0, 0.25 * peak, 0.0)[1] == pytest.approx(side * (0.25 * 1.75) * 0.5 * cohesion)
    sigma, tau = point(-1e-3, 0.02, 0.01)
    assert sigma == pytest.approx(-overlay * 0.5e-3) and tau == pytest.approx(side * (0.5 * cohesion - sigma * tan_phi))
    sigma, tau = point(0.001, 0.02, 0.01, 0.004)
    assert sigma == pytest.approx(0.25 * 0.5 * tensile) and tau == pytest.approx(side * (0.5 * cohesion - 0.5 * sigma))


def test_boxes_of_triangles_and_of_their_free_edges() -> None:
    x = RNG.normal(size=(4, 3, 2))
    free = np.array([0, 0b001, 0b110, 0b100])
    box, around = np.empty((4, 4)), np.empty((4, 4))
    detect.boxes(np.arange(0, 24, 6), free, x, 0.2, box, around)
    assert box == pytest.approx(np.concatenate([x.min(axis=1) - 0.1, x.max(axis=1) + 0.1], axis=1))
    edges = [[], [0, 1], [1, 2, 0], [2, 0]]  # corners on free edges; edge k goes from corner k to the next
    assert around[0].tolist() == [math.inf, math.inf, -math.inf, -math.inf]
    for i in range(1, 4):
        corners = x[i, edges[i]]
        assert around[i] == pytest.approx([*corners.min(axis=0) - 0.1, *corners.max(axis=0) + 0.1])


def test_how_deep_edges_are_in_triangles() -> None:
    """The lower left corner of the second triangle is in the first one, whose hypotenuse is nearest; all of its edges
    count, or that opposite the corner, which is outside, or none."""
    x = np.array([[0.0, 0.0, 4.0, 0.0, 0.0, 4.0], [1.5, 1.5, 9.0, 1.5, 1.5, 9.0]])
    depth = np.empty((1, 3))

    def deepest(free: int) -> float:
        contact.depths(np.array([0]), np.array([1]), np.array([0, free]), np.array([0, 6]), x, depth)
        return depth[0, 0]

    assert deepest(0b111) == pytest.approx(1.0 / math.sqrt(2.0)) and depth[0, 1:] == pytest.approx([1.5, 1.5])
    assert deepest(0b010) == 0.0 and deepest(0b000) == 0.0
    x[1] = [1.0, 3.5, 1.0, -1.0, 3.5, -1.0]  # its first edge stands in the first triangle, a quarter from the left side
    assert deepest(0b001) == pytest.approx(1.0, rel=1e-12)


def test_one_over_the_volume_of_a_tetrahedron() -> None:
    sides = RNG.normal(size=(3, 3))
    assert tets.per_volume(*np.linalg.inv(sides).ravel()) == pytest.approx(6.0 / np.linalg.det(sides), rel=1e-12)


def test_middles_of_tetrahedra() -> None:
    """Of four corners in rows of four numbers; how far the farthest corner is from its middle."""
    x = RNG.normal(size=(5, 16))
    corners = x.reshape(5, 4, 4)[:, :, :3]
    out = np.empty((5, 3))
    far = space.middles(x, out)
    assert out == pytest.approx(corners.mean(axis=1), rel=1e-13)
    assert far == pytest.approx(np.linalg.norm(corners - out[:, None], axis=2).max(), rel=1e-13)
