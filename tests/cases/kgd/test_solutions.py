"""Closed forms of the plane hydraulic fracture against values found independently, and against each other."""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import kgd_solutions as kgd
from hpcdem.physics.fdem.kernels.joint_law import SOFTENING_AREA, softening
from tests.cases.kgd import forms

YOUNG = 30e9 / (1.0 - 0.25**2)
UNIT = 1e6**2 / YOUNG
"""Fracture energy of K_Ic = 1 MPa m^1/2."""


@pytest.mark.parametrize("time, want", [(1.0, (0.93404, 68.158e-6, 0.58377e6)), (10.0, (4.3354, 146.84e-6, 0.27096e6))])
def test_toughness_alone(time, want):
    found = kgd.tough(YOUNG, UNIT, 1e-4, time)
    assert (found.length, found.opening, found.pressure) == pytest.approx(want, rel=2e-5)
    assert 0.5 * math.pi * found.opening * found.length == pytest.approx(1e-4 * time, rel=1e-12)


@pytest.mark.parametrize(
    "energy, viscosity, want", [(100.0, 1e-4, (-1.07, 1.47, 3.60)), (UNIT, 1e-6, (-0.11, 0.15, 0.37))]
)
def test_a_little_viscosity(energy, viscosity, want):
    """Corrections in %; the volume stays that of the fluid."""
    base = kgd.tough(YOUNG, energy, 1e-4, 3.0)
    found = kgd.slightly_viscous(YOUNG, energy, viscosity, 1e-4, 3.0)
    changes = [100.0 * (getattr(found, name) / getattr(base, name) - 1.0) for name in ("length", "opening", "pressure")]
    assert changes == pytest.approx(want, abs=0.006)


def test_viscosity_alone():
    """Against values made with the rounded constants 0.616 and 1.13, and the volume within what the shape can be."""
    one, five = (kgd.viscous(YOUNG, 0.1, 1e-3, time) for time in (1.0, 5.0))
    assert (one.length, one.opening) == pytest.approx((1.065, 0.654e-3), rel=5e-3)
    assert (five.length, five.opening) == pytest.approx((3.113, 1.118e-3), rel=5e-3)
    assert one.pressure / five.pressure == pytest.approx(5.0 ** (1.0 / 3.0))
    for time, found in ((1.0, one), (5.0, five)):  # a wing is fuller than a triangle and less full than a rectangle
        assert 1.0 < 1e-3 * time / (found.opening * found.length) < 2.0


def test_times_and_lengths():
    assert forms.lag_time(YOUNG, 0.1, 5e6) == pytest.approx(9.83, rel=1e-3)
    assert forms.lag_time(YOUNG, 0.1, 50e6) == pytest.approx(9.83e-3, rel=1e-3)
    assert forms.process_length(YOUNG, 100.0, 5e6) == pytest.approx(0.128, rel=1e-9)
    assert kgd.resolution(YOUNG, 100.0, 5e6, 1e6, 0.02) == pytest.approx(0.225, rel=1e-9)
    assert forms.false_energy(0.02, 5e6, 3e12) == pytest.approx(2.0 / 3.0 * 5e6 * 2.0 * 0.02 * 5e6 / 3e12)
    assert kgd.toughness(YOUNG, UNIT) == pytest.approx(1e6)
    assert 100.0 / (SOFTENING_AREA * 5e6) == pytest.approx(51.772e-6, rel=1e-5)
    assert (softening(0.1), softening(0.2)) == pytest.approx((0.878317, 0.678411), abs=1e-6)


def test_all_leaks_away():
    """Sum of what leaves both walls of both wings, each point since the tip passed it, is what comes."""
    rate, leak, time, n = 1e-4, 2e-5, 100.0, 200_000
    length = forms.leaking_length(rate, leak, time)
    away = 0.0
    for k in range(n):
        x = (k + 0.5) / n
        away += 4.0 * leak / math.sqrt(time * (1.0 - x * x)) * length / n
    assert away == pytest.approx(rate, rel=2e-3)
