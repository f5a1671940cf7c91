"""Cases of water in jointed rock, `hpcdem case radial-flow|dam-seepage|dam-uplift|fault-injection`, against the closed
forms that their scripts draw (9.11; Harr 1962, Groundwater and Seepage: conformal mapping of a layer with a curtain;
Coulomb), on coarse meshes, and slow ones on those of docs/cases.md."""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import DamSeepage, DamUplift, FaultInjection, RadialFlow
from tests.cases.ready import results


def test_pressure_around_a_hole(resident, tmp_path):
    done = results(resident, tmp_path, RadialFlow(size=0.4))
    print(vars(done))
    assert done.error < 0.02 and done.inflow == pytest.approx(done.outflow, rel=1e-6)
    assert done.permeability == pytest.approx(math.sqrt(3.0) * 1e-15 / (12.0 * 0.4), rel=0.06)
    for r, found, exact in done.profile:
        assert exact == pytest.approx(10e6 - 9e6 * math.log(r) / math.log(5.0), rel=1e-12)
        assert found == pytest.approx(exact, abs=0.02 * 9e6)
    assert done.account < 1e-10
    assert (tmp_path / "data" / "radial-flow.png").stat().st_size > 5000


@pytest.mark.slow
def test_pressure_around_a_hole_in_the_documented_mesh(resident, tmp_path):
    done = results(resident, tmp_path, RadialFlow())
    assert done.error < 0.01 and done.imbalance < 1e-6


@pytest.mark.slow
def test_levels_in_a_dam(resident, tmp_path):
    """9.11 in the documented mesh: levels within 4 % of Dupuit's up to x = 12 m, discharge within 3 % of Charny's."""
    done = results(resident, tmp_path, DamSeepage())
    print(vars(done))
    assert done.level_error < 0.04 and done.discharge == pytest.approx(done.exact, rel=0.03)
    assert done.exact == pytest.approx(1.5 * math.sqrt(3.0) * 1e-15 / 6.0 * 9.81e6, rel=1e-9)
    assert (tmp_path / "data" / "dam-seepage.png").stat().st_size > 5000


@pytest.mark.slow  # quick: levels in a dam, tests/flow
def test_uplift_with_curtain_and_drain(resident, tmp_path):
    """Without, the pressure is antisymmetric about the middle: as much as on the line. A curtain takes a third of it
    away, a drain more."""
    found = [
        results(resident, tmp_path / name, DamUplift(size=4.0, aside=32.0, **given))
        for name, given in (("bare", {}), ("curtain", {"curtain": 16.0}), ("drain", {"curtain": 16.0, "drain": 8.0}))
    ]
    bare, curtain, drain = found
    for one in found:
        print(vars(one))
        assert one.imbalance < 1e-6 and one.account < 1e-10
    assert bare.exact == pytest.approx(bare.linear, rel=1e-3) and bare.uplift == pytest.approx(bare.exact, rel=0.03)
    assert bare.error < 0.06 and bare.discharge == pytest.approx(bare.exact_discharge, rel=0.08)
    assert curtain.uplift == pytest.approx(curtain.exact, rel=0.05) and curtain.uplift < 0.8 * bare.uplift
    assert curtain.discharge < 0.85 * bare.discharge
    assert drain.uplift < 0.6 * curtain.uplift and drain.drained > 0.0
    assert drain.discharge < curtain.discharge
    assert bare.safety < curtain.safety < drain.safety


@pytest.mark.slow
def test_uplift_in_the_documented_mesh(resident, tmp_path):
    bare = results(resident, tmp_path / "bare", DamUplift())
    assert bare.uplift == pytest.approx(bare.exact, rel=0.01) and bare.error < 0.03
    assert bare.discharge == pytest.approx(bare.exact_discharge, rel=0.04)
    curtain = results(resident, tmp_path / "curtain", DamUplift(curtain=16.0))
    assert curtain.uplift == pytest.approx(curtain.exact, rel=0.02) and curtain.error < 0.02
    assert curtain.discharge == pytest.approx(curtain.exact_discharge, rel=0.04)


@pytest.mark.slow
def test_a_fault_slips_when_coulomb_says_so(resident, tmp_path):
    done = results(resident, tmp_path, FaultInjection(size=4.0, coarse=40.0, duration=40.0, shut_in=4.0, steps=8000))
    print({name: value for name, value in vars(done).items() if name != "curve"})
    assert done.normal == pytest.approx(12.5e6) and done.shear == pytest.approx(10e6 * math.sqrt(3.0) / 4.0)
    assert done.exact_onset == pytest.approx(12.5e6 - (done.shear - 1e3) / math.tan(math.radians(35.0)))
    assert done.onset == pytest.approx(done.exact_onset, rel=0.06)
    assert done.slip == pytest.approx(done.exact_slip, rel=0.2)
    assert done.injected > 0.0 and done.account < 1e-10


@pytest.mark.slow
def test_a_fault_that_does_not_slip_says_so(resident, tmp_path):
    done = results(
        resident, tmp_path, FaultInjection(size=4.0, coarse=40.0, duration=2.0, shut_in=0.5, steps=1000),
        more="more['onset'] = more['seconds'] = None\n",
    )  # fmt: skip
    assert done.onset is None and done.exact_slip == 0.0 and done.slip < 1e-4


@pytest.mark.slow
def test_a_fault_slips_in_the_documented_mesh(resident, tmp_path):
    done = results(resident, tmp_path, FaultInjection())
    assert done.onset == pytest.approx(done.exact_onset, rel=0.03)
    assert done.slip == pytest.approx(done.exact_slip, rel=0.1)


def test_faults_that_cannot_be(resident):
    from hpcdem.core.errors import ScriptError

    with pytest.raises(ScriptError, match="slips without fluid"):
        FaultInjection(friction=15.0)
    with pytest.raises(ScriptError, match=r"limit is 1.3e\+07, expected more than"):
        FaultInjection(limit=13e6)
