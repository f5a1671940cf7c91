"""Arithmetic of clumps, against rotations and sums written with numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.fields import ANGLE, FIX, FIX_SPIN, FIX_X, MATERIAL, RADIUS, SPIN, VX, VY, WIDTH, X, Y
from hpcdem.physics.dem.kernels import rigid
from hpcdem.physics.dem.kernels.motion import ALPHA, CLUMPED, INERTIA, KICK_SPIN, KICK_X, KICK_Y, MASS

START = np.array([0, 2, 5])
ROW = np.array([0, 3, 2, 4, 5])
"""Two clumps of two and three discs in a storage of a left ghost, four owned rows and a right ghost."""
N_LEFT, N_OWN = 1, 4
OFFSET = np.array([[0.3, -0.2], [-0.4, 0.1], [0.5, 0.5], [-0.6, 0.2], [0.1, -0.7]])


def turned(angle: float, d: np.ndarray) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return d @ np.array([[c, s], [-s, c]])


def test_members_go_where_their_clump_is() -> None:
    """x = c + R(a) d, v = v + w z x R(a - w dt / 2) d; ghosts are placed by their owners."""
    bhot, bcold, dt = np.zeros((2, WIDTH)), np.zeros((2, WIDTH)), 0.1
    bhot[:, X], bhot[:, Y], bhot[:, VX], bhot[:, VY], bhot[:, SPIN] = (
        (1.0, 5.0),
        (2.0, 6.0),
        (3.0, -1.0),
        (0.5, 2.0),
        (4.0, -3.0),
    )
    bcold[:, ANGLE] = 0.7, -1.2
    hot, cold, arm = np.full((6, WIDTH), np.nan), np.full((N_OWN, WIDTH), np.nan), np.zeros((5, 2))
    rigid.place(1, bhot, bcold, START, ROW, OFFSET, arm, hot, cold, N_LEFT, N_OWN, dt)
    for b in range(2):
        members = slice(START[b], START[b + 1])
        a, w = bcold[b, ANGLE], bhot[b, SPIN]
        assert arm[members] == pytest.approx(turned(a, OFFSET[members]), rel=1e-14)
        half = turned(a - 0.5 * w * dt, OFFSET[members])
        for row, at, lever in zip(ROW[members], arm[members], half, strict=True):
            if N_LEFT <= row < N_LEFT + N_OWN:
                assert hot[row, [X, Y]] == pytest.approx(bhot[b, [X, Y]] + at, rel=1e-14)
                v = bhot[b, VX] - w * lever[1], bhot[b, VY] + w * lever[0]
                assert hot[row, [VX, VY]] == pytest.approx(v, rel=1e-13)
                assert (hot[row, SPIN], cold[row - N_LEFT, ANGLE]) == (w, a)
    assert np.isnan(hot[[0, 1, 5]]).all() and np.isnan(cold[0]).all(), "ghosts, and who is no member"
    again = np.zeros((5, 2))
    rigid.turn(bcold, START, OFFSET, again)
    assert (again == arm).all()


def test_forces_on_members_and_on_ghosts_are_those_on_clumps() -> None:
    rng = np.random.default_rng(2)
    arm, force, far, out = rng.normal(size=(5, 2)), rng.normal(size=(9, 4)), rng.normal(size=(6, 4)), np.zeros((2, 4))
    source = np.array([-1 - 0, 7, 2, 0, -1 - 5])
    rigid.sum_forces(2, START, source, arm, force, far, out)
    of = np.array([far[0], force[7], force[2], force[0], far[5]])[:, :3]
    of[:, 2] += arm[:, 0] * of[:, 1] - arm[:, 1] * of[:, 0]
    assert out[:, :3] == pytest.approx(np.array([of[:2].sum(axis=0), of[2:].sum(axis=0)]), rel=1e-13)


def test_masses_of_clumps_and_shares_of_their_members() -> None:
    """By the area of the discs; what is fixed cannot be kicked, and no member by itself."""
    hot, cold = np.zeros((6, WIDTH)), np.zeros((N_OWN, WIDTH))
    ihot, icold = hot.view(np.int64), cold.view(np.int64)
    hot[:, RADIUS] = 0.5, 0.4, 0.3, 0.2, 0.6, 0.7
    ihot[:, MATERIAL] = 0, 0, 1, 0, 1, 1
    icold[3 - N_LEFT, FIX], icold[2 - N_LEFT, FIX] = FIX_SPIN, FIX_X
    density, damp, dt = np.array([2000.0, 3000.0]), np.array([0.1, 0.7]), 0.01
    area, moment, speaker = np.array([1.5, 2.5]), np.array([0.2, 0.4]), np.array([3, 2])
    bcold, bbody, body = np.zeros((2, WIDTH)), np.full((2, 8), np.nan), np.full((N_OWN, 8), np.nan)
    rigid.fill(
        hot, ihot, icold, N_LEFT, N_OWN, density, damp, dt, START, ROW, speaker, area, moment, bcold, bbody, body
    )
    m, inertia = density * area, density * moment
    assert bcold.view(np.int64)[:, FIX].tolist() == [FIX_SPIN, FIX_X]
    assert (bbody[:, MASS] == m).all() and (bbody[:, INERTIA] == inertia).all() and (bbody[:, ALPHA] == damp).all()
    assert (bbody[:, CLUMPED] == 0.0).all()
    assert bbody[:, KICK_X].tolist() == [dt / m[0], 0.0] and bbody[:, KICK_Y] == pytest.approx(dt / m, rel=1e-15)
    assert bbody[:, KICK_SPIN].tolist() == [0.0, dt / inertia[1]]
    for row, b, others in ((3, 0, (0, 3)), (2, 1, (2, 4, 5)), (4, 1, (2, 4, 5))):
        share = m[b] * hot[row, RADIUS] ** 2 / (hot[list(others), RADIUS] ** 2).sum()
        mine = body[row - N_LEFT]
        assert mine[[MASS, INERTIA]] == pytest.approx([share, 0.5 * share * hot[row, RADIUS] ** 2], rel=1e-14)
        assert mine[[ALPHA, CLUMPED]].tolist() == [damp[b], 1.0] and (mine[[KICK_X, KICK_Y, KICK_SPIN]] == 0.0).all()
    assert np.isnan(body[0]).all()
