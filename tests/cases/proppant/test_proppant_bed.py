"""`hpcdem case proppant-bed`: the account of its grains, and the bed of a published test."""

from __future__ import annotations

import pytest

from hpcdem.cases import ProppantBed
from tests.cases.ready import results


@pytest.mark.slow  # quick: tests/proppant
def test_a_slot_of_the_laboratory(resident, tmp_path):
    """Chun et al. 2020, d 0.45 mm, 2550 kg/m3, c 0.07: the bed of the simulation that agrees with theirs."""
    done = results(resident, tmp_path, ProppantBed())
    print(vars(done))
    assert done.difference < 0.03 and done.settled > 0.8 and done.lost < 1e-11
    assert done.fed == pytest.approx(0.07 * 3.785e-4 * 30.0 / 0.62 / 2.8317e-3, rel=1e-3) and done.bed[-1][1] < done.fed
    assert done.speed == pytest.approx(0.0669, rel=1e-3)  # of a grain, by its law
    assert (tmp_path / "data" / "proppant-bed.png").stat().st_size > 5000
    slopes = (done.bed[-1][1] - done.bed[9][1]) / 20.0, (0.430 - 0.131) / 20.0
    assert slopes[0] == pytest.approx(slopes[1], rel=0.05)
    assert 0.05 < done.bed[9][3] < 0.2  # 0.074 in the test: slurry that is seen as thick
