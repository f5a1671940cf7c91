"""`hpcdem case proppant-closure`: volume and stress after closure against the closed form."""

from __future__ import annotations

import pytest

from hpcdem.cases import ProppantClosure
from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem.simulation import Blocks
from tests.pcdc.fake import Bench


@pytest.mark.parametrize(("modulus", "concentration"), [(100e6, 0.2), pytest.param(20e6, 0.1, marks=pytest.mark.slow)])
def test_a_fracture_closes_on_its_grains(tmp_path, modulus: float, concentration: float) -> None:
    """E = 20 GPa, under 10 MPa, 12 MPa in the slurry, 5 MPa in the rock: s = (K + 5 - 10) / (12 - 10 + K limit / c) of
    the volume is left, and the pack bears what the fluid has given up, less the 2 s MPa by which the rock is open."""
    pytest.importorskip("gmsh")
    case = ProppantClosure(size=0.5, modulus=modulus, concentration=concentration, steps=40, time=1200.0)
    found = Bench(tmp_path, blocks=Blocks(SerialComm()))(case.script())
    wanted = (modulus - 5e6) / (2e6 + modulus * 0.6 / concentration)
    assert found["exact_left"] == pytest.approx(wanted, rel=1e-3)
    assert found["left"] == pytest.approx(wanted, rel=0.02)
    assert found["opened"] == pytest.approx(4.0 * 2e6 * 5.0 * (1.0 - 0.25**2) / 20e9, rel=0.12)
    time, volume, pressure, pack = found["curve"][-1]
    assert time == 1200.0 and volume == found["left"] and pressure == pytest.approx(5e6, rel=1e-3)
    assert pack == pytest.approx(5e6 + 2e6 * wanted, rel=0.1)
    assert found["lost"] < 1e-12
