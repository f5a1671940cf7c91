"""A tunnel in rock that yields, with bolts and without.

Salencon (1969), see tests/cases/plastic_hole: with N = (1 + sin phi) / (1 - sin phi) and q = 2 c sqrt(N) rock under the
equal stress P yields around a hole of radius a up to R = a [2 (P (N - 1) + q) / ((N + 1) q)]^(1 / (N - 1)).
"""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import Support
from tests.cases.ready import results

COARSE = {"size": 0.5, "coarse": 5.0, "reach": 7.0, "stages": 2000}


@pytest.mark.slow  # quick: bolts by themselves, tests/bolts
def test_bolts_hold(resident, tmp_path):
    """With them less of the rock yields, and it comes in less."""
    usual = results(resident, tmp_path / "usual", Support(**COARSE))
    assert 0.0 < usual.at_support < usual.convergence and usual.plastic_radius > 3.5
    assert 0.0 < usual.axial_force <= 250e3 and usual.yielded > 0 and usual.broken == 0
    none = results(resident, tmp_path / "none", Support(bolts=0, **COARSE))
    assert none.axial_force == none.yielded == none.slipped == 0
    assert none.at_support == usual.at_support and none.convergence > 1.05 * usual.convergence
    assert none.plastic_radius > usual.plastic_radius


@pytest.mark.slow
@pytest.mark.parametrize("yields", [False, True])
def test_a_slice_in_space_is_plane_strain(resident, tmp_path, yields):
    """One ring of bolts in a slice as wide as their spacing, beside bolts that are spread along the tunnel: closure,
    crown and zone that yields within 4 %; the largest force of a bolt, which scatters with the mesh, within 6 %."""
    rock = {"size": 0.5, "coarse": 5.0, "reach": 7.0, "stages": 2000 if yields else 500}
    if not yields:
        rock |= {"cohesion": 20e6, "tensile_strength": 20e6}
    plane = results(resident, tmp_path / "plane", Support(elements="tri", **rock))
    space = results(resident, tmp_path / "space", Support(dim=3, **rock))
    for name in ("convergence", "at_support", "crown", "plastic_radius"):
        assert getattr(space, name) == pytest.approx(getattr(plane, name), rel=0.04)
    assert space.axial_force == pytest.approx(plane.axial_force, rel=0.06)
    assert (space.yielded > 10) == (plane.yielded > 10) == yields


@pytest.mark.slow  # bolts by themselves: tests/bolts
def test_every_option_of_the_bolts(resident, tmp_path):
    """Each of these alone changes what the tunnel does, in the way that it should."""
    usual = results(resident, tmp_path / "usual", Support(**COARSE))
    none = results(resident, tmp_path / "none", Support(bolts=0, **COARSE))
    late = results(resident, tmp_path / "late", Support(release=0.95, **COARSE))
    assert late.at_support > 1.5 * usual.at_support and usual.convergence < late.convergence <= none.convergence
    weak = results(resident, tmp_path / "weak", Support(bond_cohesion=2e5, **COARSE))
    assert weak.slipped > usual.slipped and weak.axial_force < usual.axial_force
    strong = results(resident, tmp_path / "strong", Support(bolt_yield=1e9, plates=False, **COARSE))
    assert strong.yielded == 0 and strong.axial_force > 250e3


@pytest.mark.slow  # liners by themselves: tests/liners
def test_a_shell_holds(resident, tmp_path):
    """Each of its options alone changes what the tunnel does, in the way that it should."""
    given = {**COARSE, "bolts": 0}
    none = results(resident, tmp_path / "none", Support(**given))
    assert none.thrust == none.moment == none.hinges == 0
    usual = results(resident, tmp_path / "usual", Support(liner=0.3, **given))
    assert usual.at_support == none.at_support < usual.convergence < 0.9 * none.convergence
    assert usual.plastic_radius < none.plastic_radius and usual.thrust < -1e6 and usual.moment > 0.0
    # Thin rings: what the rock presses them by is what they give in, u = p R^2 / (E A), within the plastic limit.
    thin = results(resident, tmp_path / "thin", Support(liner=0.1, **given))
    assert thin.convergence > usual.convergence and abs(thin.thrust) <= 25e6 * 0.1 * (1.0 + 1e-9) and thin.hinges > 0
    for change in ({"liner_young": 5e9}, {"liner_poisson": 0.4}, {"liner_strength": 8e6}, {"liner_bond": 1e9}):
        other = results(resident, tmp_path / next(iter(change)), Support(liner=0.3, **given, **change))
        assert other != usual
        if "liner_young" in change or "liner_strength" in change:
            assert other.convergence > usual.convergence
    bent = {**given, "liner": 0.6, "stress_xx": -3e6}  # much moment for its thrust
    for tension, yields in ((2e6, False), (0.0, True)):
        done = results(resident, tmp_path / f"{tension:g}", Support(liner_tension=tension, **bent))
        assert (done.hinges > 0) == yields and done.moment > 0.5e6


def without_bolts(resident, folder, **given):
    """Radius of the plastic zone over that of Salencon; with a tensile strength that does not count."""
    case = Support(bolts=0, tensile_strength=1e9, dilation=30.0, reach=14.0, stages=40000, **given)
    n = 3.0
    q = 2.0 * case.cohesion * math.sqrt(n)
    exact = case.radius * (2.0 * (10e6 * (n - 1.0) + q) / ((n + 1.0) * q)) ** (1.0 / (n - 1.0))
    return results(resident, folder, case).plastic_radius / exact


@pytest.mark.slow
def test_plastic_radius(resident, tmp_path):
    assert without_bolts(resident, tmp_path, elements="quad", size=0.15) == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_plastic_radius_in_triangles(resident, tmp_path):
    """Irregular triangles of constant strain are too stiff where rock flows (Nagtegaal, Parks & Rice 1974): the zone
    comes out smaller, by less in a finer mesh. Pairs of triangles with one volume, quads, do not have this."""
    coarse, fine = (without_bolts(resident, tmp_path / f"{h:g}", elements="tri", size=h) for h in (0.3, 0.15))
    assert coarse < fine < 1.0 and fine == pytest.approx(1.0, abs=0.03) and 1.0 - fine < 0.6 * (1.0 - coarse)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.ranks
def test_the_same_on_two_ranks(resident, tmp_path):
    assert results(resident, tmp_path / "2", Support(**COARSE), ranks=2) == results(
        resident, tmp_path / "1", Support(**COARSE)
    )
