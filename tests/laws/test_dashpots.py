"""Dashpots of contacts, against c = f beta sqrt(m S) written out: of discs, of a ghost, of a wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.fields import MATERIAL, RADIUS, VX, VY, WIDTH, X, Y
from hpcdem.physics.dem.kernels import dashpots, laws
from hpcdem.physics.dem.kernels.contacts import MODEL, A, B

BETA = 0.3
KN, HERTZ = 4e5, 3e6
"""Stiffness of contacts with discs 0 and 1 [N/m]; factor of Hertz' law of the others [Pa]."""


def factor(model: int, two_rt: float, u: float, inverse_mass: float) -> float:
    """c [N s/m]."""
    secant = KN if model == laws.LINEAR else HERTZ * math.sqrt(two_rt * u)
    return (2.0 if model == laws.LINEAR else math.sqrt(5.0)) * BETA * math.sqrt(secant / inverse_mass)


def test_forces_of_dashpots() -> None:
    """A row of discs along 3-4-5: a ghost, three owned ones, the last one fixed along x; the third and the last are
    bonded; a pair is apart; and a wall below the second."""
    hot = np.zeros((4, WIDTH))
    ihot = hot.view(np.int64)
    along = np.array([0.0, 1.8, 3.7, 5.5])
    hot[:, X], hot[:, Y], hot[:, RADIUS] = 0.6 * along, 0.8 * along, 1.0
    hot[:, VX], hot[:, VY] = (1.0, -2.0, 3.0, 0.5), (0.5, 0.25, -1.0, 2.0)
    ihot[:, MATERIAL] = 0, 0, 1, 1
    mobility = np.array([[0.5, 0.5], [0.25, 0.25], [0.125, 0.125], [0.0, 0.2]])
    pairs, table = np.zeros((4, 4)), np.zeros((2, 4))
    for rows in (pairs, table):
        rows[:, MODEL], rows[:, A], rows[:, B] = laws.LINEAR, KN, 1.0
    pairs[3, [MODEL, A]] = laws.HERTZ, HERTZ
    ptr, partner, bond = np.array([0, 2, 3, 4, 4]), np.array([1, 2, 2, 3]), np.array([0, 0, 0, 0])
    cut, lo, zero = np.array([1, 4]), np.array([0]), np.array([0])
    walls = np.array([[10.0, 0.7, -10.0, 0.7, 0.5, 1.5, 0.0]])
    slots = (np.array([1]), np.array([0]), np.array([0.0]))

    def forces() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        force, rates, on_walls = np.zeros((4, 4)), np.zeros(4), np.full((1, 2), 9.0)
        dashpots.forces(
            1, hot, ihot, cut, lo, zero, zero, ptr, partner, bond, pairs, np.array([0, 1]), walls, *slots, table, 2,
            mobility, BETA, force, rates, on_walls,
        )  # fmt: skip
        return force, rates, on_walls

    n = np.array([0.6, 0.8])
    expected, rates = np.zeros((4, 2)), np.zeros(4)
    for i, j, model in ((0, 1, laws.LINEAR), (1, 2, laws.LINEAR), (2, 3, laws.HERTZ)):
        of_i, of_j = (n * n * mobility[[i, j]]).sum(axis=1)
        c = factor(model, 2.0, 2.0 - (along[j] - along[i]), of_i + of_j)
        push = -c * n @ (hot[j, VX : VY + 1] - hot[i, VX : VY + 1]) * n
        expected[i] -= push
        expected[j] += push
        rates[i] += c * of_i
        rates[j] += c * of_j
    height = hot[1, Y] - 0.7
    c = factor(laws.LINEAR, 2.0, 1.0 - height, 0.25)
    on_wall = c * (hot[1, VY] - 1.5)
    expected[1, 1] -= on_wall
    rates[1] += c * 0.25
    expected[0] = rates[0] = 0.0  # the ghost is its owner's
    force, found, on_walls = forces()
    assert force[:, :2] == pytest.approx(expected, rel=1e-12, abs=1e-9) and (force[:, 2:] == 0.0).all()
    assert found == pytest.approx(rates, rel=1e-12)
    assert on_walls == pytest.approx(np.array([[0.0, -on_wall]]), rel=1e-12, abs=1e-9)

    bond[3] = 1  # bonds know the spring only
    walls[0, [1, 3]] = -5.0  # a wall that is out of reach
    force, found, on_walls = forces()
    assert (force[3] == 0.0).all() and found[3] == 0.0 and (on_walls == 0.0).all()
    assert found[1] == pytest.approx(rates[1] - c * 0.25)


def test_who_keeps_his_velocity_needs_no_dashpot() -> None:
    law = np.array([laws.LINEAR, KN, 1.0, 0.0])
    assert dashpots.coefficient(law, 1.0, 0.1, 0.0, BETA) == 0.0 == dashpots.coefficient(law, 1.0, 0.0, 1.0, BETA)
    assert dashpots.coefficient(law, 1.0, 0.1, 0.25, BETA) == pytest.approx(2.0 * BETA * math.sqrt(4.0 * KN), rel=1e-14)
