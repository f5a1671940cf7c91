"""Cases of rings with heat, `hpcdem case thermal-ring|cracking-ring`, against the closed form that their scripts draw
(9.13; Timoshenko & Goodier 1970, 151: plane strain)."""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import CrackingRing, ThermalRing
from tests.cases.ready import results


def test_temperature_and_stress_in_a_ring(resident, tmp_path):
    """9.13: 0.5 % in temperature, 2 % of 48.7 MPa in stress."""
    done = results(resident, tmp_path, ThermalRing())
    print(vars(done))
    assert done.inside == pytest.approx(-48.733e6, rel=1e-4) and done.outside == pytest.approx(17.933e6, rel=1e-4)
    assert done.error < 0.005 and done.radial < 0.02 and done.tangential < 0.02
    assert done.account < 1e-9 and len(done.profile) > 10
    for r, temperature, _, _ in done.profile:
        assert temperature == pytest.approx(100.0 * math.log(0.5 / r) / math.log(5.0), abs=2.0)
    assert (tmp_path / "data" / "thermal-ring.png").stat().st_size > 5000


@pytest.mark.slow
def test_a_ring_cracks_by_heat(resident, tmp_path):
    """7.6.10: the rim cracks first, at 11.2 K within 15 %."""
    done = results(resident, tmp_path, CrackingRing())
    print(vars(done))
    assert done.exact == pytest.approx(11.15, rel=1e-3) and done.first == pytest.approx(11.2, rel=0.15)
    assert done.radius > 0.45 and done.broken > 5
    assert all(count == 0.0 for warmer, count in done.curve if warmer < done.first)
