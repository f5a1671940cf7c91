"""Case of a ring with heat, `hpcdem case thermal-ring`, against the closed form that its script draws
(9.13; Timoshenko & Goodier 1970, 151: plane strain)."""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import ThermalRing
from tests.cases.ready import results


def test_temperature_and_stress_in_a_ring(launch, tmp_path):
    """9.13: 0.5 % in temperature, 2 % of 48.7 MPa in stress."""
    done = results(launch, tmp_path, ThermalRing())
    print(vars(done))
    assert done.inside == pytest.approx(-48.733e6, rel=1e-4) and done.outside == pytest.approx(17.933e6, rel=1e-4)
    assert done.error < 0.005 and done.radial < 0.02 and done.tangential < 0.02
    assert done.account < 1e-9 and len(done.profile) > 10
    for r, temperature, _, _ in done.profile:
        assert temperature == pytest.approx(100.0 * math.log(0.5 / r) / math.log(5.0), abs=2.0)
    assert (tmp_path / "data" / "thermal-ring.png").stat().st_size > 5000
