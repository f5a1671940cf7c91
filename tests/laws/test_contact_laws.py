"""The scalar contact laws: one formula, one test. Written out a second time, in the form in which the sources print
them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.physics.dem.kernels import laws

quick = settings(max_examples=80, deadline=None, derandomize=True)

stiffness = st.floats(1.0, 1e13)
modulus = st.floats(1e3, 1e12)
poisson = st.floats(-0.9, 0.5)
radius = st.floats(1e-4, 1e3)
share = st.floats(1e-9, 0.5)
mu = st.floats(0.0, 2.0)
real = st.floats(-1e15, 1e15)


def is_plain_zero(x: float) -> bool:
    """0.0, not -0.0."""
    return x == 0.0 and not np.signbit(x)


@quick
@given(stiffness, stiffness)
def test_springs_in_series(ka, kb):
    assert laws.series_stiffness(ka, kb) == pytest.approx(1.0 / (1.0 / ka + 1.0 / kb), rel=1e-12)
    assert laws.series_stiffness(ka, kb) == laws.series_stiffness(kb, ka)


def test_springs_in_series_published_values():
    """11e9 with 11e9 gives 5.5e9 (Li et al. 2018), 1.5e4 with 1.5e4 7.5e3 (Li et al. 2021); a spring that is
    missing carries nothing."""
    assert laws.series_stiffness(11e9, 11e9) == 5.5e9
    assert laws.series_stiffness(1.5e4, 1.5e4) == 7.5e3
    assert laws.series_stiffness(0.0, 1e9) == laws.series_stiffness(1e9, 0.0) == laws.series_stiffness(0.0, 0.0) == 0.0


@quick
@given(stiffness, stiffness, st.floats(0.0, 10.0))
def test_linear_contact(kn, ks, u):
    assert laws.contact(laws.LINEAR, kn, ks, 1.0, u) == (kn * u, ks)
    assert laws.tangent_normal_stiffness(laws.LINEAR, kn, 1.0, u) == kn


@quick
@given(modulus, poisson, radius, radius, share)
def test_hertz_force(g, nu, ra, rb, part):
    """Fn = 2 G sqrt(2 Rt) / (3 (1 - nu)) U^(3/2), Rt = 2 Ra Rb / (Ra + Rb)."""
    rt = 2.0 * ra * rb / (ra + rb)
    u = part * min(ra, rb)
    fn, _ = laws.contact(laws.HERTZ, laws.hertz_normal_factor(g, nu), 0.0, 2.0 * rt, u)
    assert fn == pytest.approx(2.0 * g * math.sqrt(2.0 * rt) / (3.0 * (1.0 - nu)) * u**1.5, rel=1e-12)


@quick
@given(modulus, poisson, radius, radius, share)
def test_mindlin_stiffness_without_the_cube_root(g, nu, ra, rb, part):
    """ks = 2 (3 G^2 (1 - nu) Rt Fn)^(1/3) / (2 - nu) with Fn of Hertz is 2 G sqrt(2 Rt U) / (2 - nu): the cube root of
    3 G^2 (1 - nu) Rt Fn = 3 G^2 (1 - nu) Rt 2 G sqrt(2 Rt) U^(3/2) / (3 (1 - nu)) = G^3 (2 Rt U)^(3/2)."""
    rt = 2.0 * ra * rb / (ra + rb)
    u = part * min(ra, rb)
    a, b = laws.hertz_normal_factor(g, nu), laws.mindlin_shear_factor(g, nu)
    fn, ks = laws.contact(laws.HERTZ, a, b, 2.0 * rt, u)
    assert ks == pytest.approx(2.0 * (3.0 * g**2 * (1.0 - nu) * rt * fn) ** (1.0 / 3.0) / (2.0 - nu), rel=1e-12)
    # Ratio of the tangents: 2 (1 - nu) / (2 - nu), Mindlin 1949.
    tangent = laws.tangent_normal_stiffness(laws.HERTZ, a, 2.0 * rt, u)
    assert ks / tangent == pytest.approx(2.0 * (1.0 - nu) / (2.0 - nu), rel=1e-12)


def test_hertz_example():
    """R = 60 m, G = 2.9 GPa, nu = 0.2: K = 2.6473e10 N/m^1.5, at U = 1 m ks / tangent = 0.8889."""
    a, b = laws.hertz_normal_factor(2.9e9, 0.2), laws.mindlin_shear_factor(2.9e9, 0.2)
    fn, ks = laws.contact(laws.HERTZ, a, b, 120.0, 1.0)
    assert fn == pytest.approx(2.6473e10, rel=2e-5)
    assert ks / (1.5 * fn) == pytest.approx(0.8889, abs=5e-5)


@quick
@given(st.floats(1e-6, 1.0), radius)
def test_tangent_is_the_derivative(part, r):
    """Central difference of the force; its error is of second order in the step, here (1e-4)^2 / 24 relative."""
    a, u = 1e9, part * r
    h = 1e-4 * u
    force = [laws.contact(laws.HERTZ, a, 0.0, 2.0 * r, x)[0] for x in (u - h, u + h)]
    slope = (force[1] - force[0]) / (2.0 * h)
    assert laws.tangent_normal_stiffness(laws.HERTZ, a, 2.0 * r, u) == pytest.approx(slope, rel=1e-7)


def test_touching_is_no_force():
    """d = Ra + Rb exactly: force, and for Hertz stiffness too, are zero."""
    assert laws.contact(laws.HERTZ, 1e9, 1e9, 1.0, 0.0) == (0.0, 0.0)
    assert laws.contact(laws.LINEAR, 1e9, 7.0, 1.0, 0.0) == (0.0, 7.0)


@quick
@given(real, st.floats(0.0, 1e15))
def test_coulomb(fs, limit):
    cut = laws.coulomb(fs, limit)
    assert cut == min(max(fs, -limit), limit) and abs(cut) <= limit
    if cut == 0.0:
        assert is_plain_zero(cut)


@pytest.mark.parametrize("fs", [0.0, -0.0, 5.0, -5.0, 5e-324, -5e-324])
def test_coulomb_leaves_no_negative_zero(fs):
    """An empty history must be all zero bits, whatever sign the last motion had."""
    assert is_plain_zero(laws.coulomb(fs, 0.0))
    assert is_plain_zero(laws.coulomb(-0.0, 1.0))
    assert laws.coulomb(fs, 10.0) == fs


@quick
@given(real, st.floats(-1e3, 1e3), st.floats(0.0, 0.99))
def test_local_damping(force, velocity, alpha):
    """F - alpha |F| sgn(v), sgn(0) = +1: motion with the force is slowed by (1 - alpha), against it by (1 + alpha)."""
    sign = -1.0 if velocity < 0.0 else 1.0
    out = laws.damped(force, velocity, alpha)
    assert out == pytest.approx(force - alpha * abs(force) * sign, rel=1e-15)
    if force != 0.0 and velocity != 0.0:
        factor = 1.0 - alpha if (force > 0.0) == (velocity > 0.0) else 1.0 + alpha
        assert out == pytest.approx(force * factor, rel=1e-12)


def test_local_damping_at_rest():
    """Falling from rest: 1 + alpha in the first step, seen in published states of ZDEM; upward 1 - alpha."""
    assert laws.damped(-10.0, 0.0, 0.4) == -14.0 and laws.damped(-10.0, -0.0, 0.4) == -14.0
    assert laws.damped(10.0, 0.0, 0.4) == 6.0


@quick
@given(modulus, poisson, radius, share, mu)
def test_compiled_and_plain_laws_agree(g, nu, r, part, friction):
    """`.py_func` is the same arithmetic without the compiler."""
    u = part * r
    a, b = laws.hertz_normal_factor(g, nu), laws.mindlin_shear_factor(g, nu)
    assert (a, b) == (laws.hertz_normal_factor.py_func(g, nu), laws.mindlin_shear_factor.py_func(g, nu))
    fn, ks = laws.contact(laws.HERTZ, a, b, 2.0 * r, u)
    assert (fn, ks) == laws.contact.py_func(laws.HERTZ, a, b, 2.0 * r, u)
    assert laws.coulomb(ks * u, friction * fn) == laws.coulomb.py_func(ks * u, friction * fn)
