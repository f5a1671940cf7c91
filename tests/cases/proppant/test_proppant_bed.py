"""`hpcdem case proppant-bed`: the account of its grains, and the bed of a published test."""

from __future__ import annotations

import pytest

from hpcdem.cases import ProppantBed
from tests.cases.ready import results

COARSE = {"size": 0.0762, "layer": 0.01905, "time": 6.0, "steps": 60}


@pytest.mark.slow  # quick: tests/proppant
def test_grains_come_in_and_settle(resident, tmp_path):
    """Of a coarse mesh: what came is there or left, and lies at the bottom; the speed of a grain is that of its law."""
    done = results(resident, tmp_path, ProppantBed(**COARSE))
    print(vars(done))
    assert done.lost < 1e-12 and done.fed == pytest.approx(0.07 * 3.785e-4 * 6.0 / 0.62 / 2.8317e-3, rel=1e-3)
    assert done.speed == pytest.approx(0.0669, rel=1e-3)
    assert 0.0 < done.bed[-1][1] < done.fed and done.bed[-1][2] < 0.1
    assert (tmp_path / "data" / "proppant-bed.png").stat().st_size > 5000


@pytest.mark.slow  # quick: tests/proppant
def test_a_slot_of_the_laboratory(resident, tmp_path):
    """Chun et al. 2020, d 0.45 mm, 2550 kg/m3, c 0.07: the bed of the simulation that agrees with theirs."""
    done = results(resident, tmp_path, ProppantBed())
    print(vars(done))
    assert done.difference < 0.03 and done.settled > 0.8 and done.lost < 1e-11
    slopes = (done.bed[-1][1] - done.bed[9][1]) / 20.0, (0.430 - 0.131) / 20.0
    assert slopes[0] == pytest.approx(slopes[1], rel=0.05)
    assert 0.05 < done.bed[9][3] < 0.2  # 0.074 in the test: slurry that is seen as thick
