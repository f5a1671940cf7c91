"""The scalar bond laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.laws import BREAKS_IN_SHEAR, BREAKS_IN_TENSION, CONTACT_BOND, ELASTIC_BOND, HOLDS

quick = settings(max_examples=80, deadline=None, derandomize=True)
positive = st.floats(1e-3, 1e12)
radius = st.floats(1e-3, 1e3)
area = st.floats(1e-6, 1e6)
force = st.floats(-1e12, 1e12)
mu = st.floats(0.0, 2.0)


@quick
@given(radius, radius)
def test_area(ra, rb):
    """pi Rt^2 between spheres, 2 Rt x 1 m between disks, Rt = 2 Ra Rb / (Ra + Rb)."""
    rt = 2.0 * ra * rb / (ra + rb)
    assert laws.bond_area(2.0 * rt, True) == pytest.approx(math.pi * rt**2, rel=1e-12)
    assert laws.bond_area(2.0 * rt, False) == 2.0 * rt


@quick
@given(positive, positive, area, radius, st.floats(-10.0, 0.0))
def test_elastic_bond(e, g, a, length, u):
    fn, ks = laws.elastic_bond(e, g, a, length, u)
    assert fn == pytest.approx(e * a / length * u, rel=1e-12, abs=0.0) and fn <= 0.0
    assert ks == pytest.approx(g * a / length, rel=1e-12)


def test_elastic_bond_example():
    """R = 60 m, E = 200 MPa: 1.88496e10 N/m."""
    fn, _ = laws.elastic_bond(2e8, 0.0, laws.bond_area(120.0, True), 120.0, -1.0)
    assert -fn == pytest.approx(1.88496e10, rel=3e-6)


@quick
@given(positive, positive, radius, st.floats(1e-3, 0.3), st.floats(-10.0, 0.0))
def test_contact_bond(kn, ks, r, part, u):
    """Linear: the springs themselves. Hertz: the tangents of the moment of bonding."""
    assert laws.contact_bond(laws.LINEAR, kn, ks, 2.0 * r, part * r, u) == (kn * u, ks)
    fn, k_shear = laws.contact_bond(laws.HERTZ, kn, ks, 2.0 * r, part * r, u)
    assert fn == pytest.approx(laws.tangent_normal_stiffness(laws.HERTZ, kn, 2.0 * r, part * r) * u, rel=1e-12, abs=0.0)
    assert k_shear == laws.contact(laws.HERTZ, kn, ks, 2.0 * r, part * r)[1]


# ---- failure envelopes -------------------------------------------------------------------------------------------


@quick
@given(force, force, positive, positive, mu, area)
def test_envelope_of_the_elastic_bond(fn, fs, tensile, shear, friction, a):
    """-Fn <= T A and |Fs| <= C A + mu max(Fn, 0); tension is looked at first."""
    limit = shear * a + friction * max(fn, 0.0)
    expected = BREAKS_IN_TENSION if -fn > tensile * a else BREAKS_IN_SHEAR if abs(fs) > limit else HOLDS
    assert laws.bond_failure(ELASTIC_BOND, fn, fs, tensile, shear, friction, a) == expected


@quick
@given(force, force, positive, positive, mu, area)
def test_envelope_of_the_contact_bond(fn, fs, tensile, shear, friction, a):
    """-Fn <= N and |Fs| <= S: a rectangle, neither friction nor area play a part."""
    expected = BREAKS_IN_TENSION if -fn > tensile else BREAKS_IN_SHEAR if abs(fs) > shear else HOLDS
    assert laws.bond_failure(CONTACT_BOND, fn, fs, tensile, shear, friction, a) == expected


@quick
@given(positive, positive, mu, st.floats(0.0, 1e12), st.booleans())
def test_the_border_itself_holds(tensile, shear, friction, pressed, to_the_left):
    """One rounding step beyond it breaks."""
    sign = -1.0 if to_the_left else 1.0
    for kind, limit in ((ELASTIC_BOND, shear + friction * pressed), (CONTACT_BOND, shear)):
        args = (tensile, shear, friction, 1.0)
        assert laws.bond_failure(kind, -tensile, 0.0, *args) == HOLDS
        assert laws.bond_failure(kind, -np.nextafter(tensile, np.inf), 0.0, *args) == BREAKS_IN_TENSION
        assert laws.bond_failure(kind, pressed, sign * limit, *args) == HOLDS
        assert laws.bond_failure(kind, pressed, sign * np.nextafter(limit, np.inf), *args) == BREAKS_IN_SHEAR


@quick
@given(force, force, positive, positive, mu, area, st.sampled_from([ELASTIC_BOND, CONTACT_BOND]))
def test_failure_does_not_depend_on_the_sense_of_shear(fn, fs, tensile, shear, friction, a, kind):
    args = (tensile, shear, friction, a)
    assert laws.bond_failure(kind, fn, fs, *args) == laws.bond_failure(kind, fn, -fs, *args)


@quick
@given(force, force, positive, positive, mu, area, st.floats(1.0, 100.0))
def test_a_stronger_bond_does_not_break_earlier(fn, fs, tensile, shear, friction, a, factor):
    if laws.bond_failure(ELASTIC_BOND, fn, fs, tensile, shear, friction, a) == HOLDS:
        assert laws.bond_failure(ELASTIC_BOND, fn, fs, factor * tensile, factor * shear, friction, a) == HOLDS


@pytest.mark.parametrize("kind", [ELASTIC_BOND, CONTACT_BOND])
def test_a_bond_without_strength(kind):
    """Strengths that were not given are zero: it holds as long as nothing pulls and friction carries the shear."""
    assert laws.bond_failure(kind, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0) == HOLDS
    assert laws.bond_failure(kind, -1e-300, 0.0, 0.0, 0.0, 0.3, 1.0) == BREAKS_IN_TENSION
    carried = HOLDS if kind == ELASTIC_BOND else BREAKS_IN_SHEAR
    assert laws.bond_failure(kind, 10.0, 2.9, 0.0, 0.0, 0.3, 1.0) == carried
    assert laws.bond_failure(kind, 10.0, 3.1, 0.0, 0.0, 0.3, 1.0) == BREAKS_IN_SHEAR


@quick
@given(positive, positive, st.floats(0.0, 1.0))
def test_tension_comes_before_shear(tensile, shear, friction):
    """Both limits passed: counted as a tensile break."""
    args = (tensile, shear, friction, 1.0)
    assert laws.bond_failure(ELASTIC_BOND, -1.1 * tensile, 1.1 * shear, *args) == BREAKS_IN_TENSION


# ---- the state of a pair ---------------------------------------------------------------------------------------------

E, G, TWO_RT, LENGTH, U_MADE = 2e8, 8e7, 0.9, 1.8, 3e-3


def state(model: int, kind: int, u: float, spheres: bool = True) -> tuple[float, float, float, float]:
    return laws.pair_state(kind, model, 5e7, 3e7, E, G, TWO_RT, LENGTH, spheres, U_MADE, u)


@pytest.mark.parametrize("model", [laws.LINEAR, laws.HERTZ])
@pytest.mark.parametrize("kind", [0, ELASTIC_BOND, CONTACT_BOND])
def test_a_pair_that_touches_has_the_state_of_its_contact(model, kind):
    """Bonded or not, also at no overlap."""
    for u in (0.0, 1e-6, 0.01):
        fn, ks, kn, energy = state(model, kind, u)
        assert (fn, ks) == laws.contact(model, 5e7, 3e7, TWO_RT, u)
        assert kn == laws.tangent_normal_stiffness(model, 5e7, TWO_RT, u)
        assert energy == laws.normal_energy(model, fn, u)


@pytest.mark.parametrize("model", [laws.LINEAR, laws.HERTZ])
def test_a_pair_that_is_apart_has_the_state_of_its_bond(model):
    u = -0.02
    assert state(model, 0, u) == (0.0, 0.0, 0.0, 0.0)
    for spheres in (True, False):
        area = laws.bond_area(TWO_RT, spheres)
        assert state(model, ELASTIC_BOND, u, spheres)[:2] == laws.elastic_bond(E, G, area, LENGTH, u)
    assert state(model, CONTACT_BOND, u)[:2] == laws.contact_bond(model, 5e7, 3e7, TWO_RT, U_MADE, u)


@pytest.mark.parametrize("model", [laws.LINEAR, laws.HERTZ])
@pytest.mark.parametrize("kind", [ELASTIC_BOND, CONTACT_BOND])
def test_a_conserving_bond_has_one_shear_stiffness(model, kind):
    """That of the bond, touching or open; all else is as it was."""
    own = state(model, kind, -0.02)[1]
    for u in (-0.02, -1e-6, 0.0, 0.01):
        fn, ks, kn, energy = laws.pair_state(kind, model, 5e7, 3e7, E, -G, TWO_RT, LENGTH, True, U_MADE, u)
        assert ks == own and (fn, kn, energy) == tuple(np.array(state(model, kind, u))[[0, 2, 3]])


@pytest.mark.parametrize("model", [laws.LINEAR, laws.HERTZ])
@pytest.mark.parametrize("kind, u", [(0, 0.01), (ELASTIC_BOND, -0.02), (CONTACT_BOND, -0.02), (CONTACT_BOND, 0.01)])
def test_stiffness_and_energy_belong_to_the_force(model, kind, u):
    """kn = dFn/dU, Fn = dE/dU, by central differences."""
    h = 1e-5
    (low, _, _, less), (high, _, _, more) = state(model, kind, u - h), state(model, kind, u + h)
    fn, _, kn, _ = state(model, kind, u)
    assert (high - low) / (2.0 * h) == pytest.approx(kn, rel=1e-6)
    assert (more - less) / (2.0 * h) == pytest.approx(fn, rel=1e-6)


def test_the_geometry_of_a_pair():
    """Normal, overlap and 2 Rt of a 3-4-5 triangle; two discs in one place are pushed apart along x."""
    assert laws.pair_geometry(3.0, -4.0, 2.0, 4.0) == pytest.approx((25.0, 0.6, -0.8, 1.0, 16.0 / 3.0))
    assert laws.pair_geometry(0.0, 0.0, 1.0, 1.0) == (0.0, 1.0, 0.0, 2.0, 2.0)
