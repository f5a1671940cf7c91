"""Cases of heat in the water of fractures, `hpcdem case lauwerier|doublet`, against the closed forms that their scripts
draw (9.14: Lauwerier 1955; Gringarten & Sauty 1975, without caprock), and against numbers of other sources."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from hpcdem.cases import Doublet, Lauwerier
from tests.cases.ready import results


@pytest.mark.slow  # quick: tests/heat
def test_water_cools_a_fracture(resident, tmp_path):
    """9.14: within 2 % of the difference of temperature, water and rock; values of the water printed there."""
    done = results(resident, tmp_path, Lauwerier())
    print(vars(done))
    assert done.error < 0.02 and done.rock_error < 0.02 and done.account < 1e-9
    printed = {50.0: (0.6618, 0.2740, 0.0286, 0.0010), 150.0: (0.8006, 0.5278, 0.2066, 0.0581)}
    wanted = [value for days in printed.values() for value in days]
    assert [exact for *_, exact in done.water] == pytest.approx(wanted, abs=2e-3)
    assert [found for _, _, found, _ in done.water] == pytest.approx(wanted, abs=0.02)
    assert [found for *_, found, _ in done.rock] == pytest.approx([exact for *_, exact in done.rock], abs=0.02)
    assert (tmp_path / "data" / "lauwerier.png").stat().st_size > 5000


@pytest.mark.slow  # quick: the one above, tests/heat
def test_conduction_along_the_fracture_is_not_in_the_closed_form(resident, tmp_path):
    """Rock that conducts in all directions alike lies farther from it, the front is smeared ahead; still within 2 %."""
    coarse = {"size": 1.0, "coarse": 8.0, "steps": 60}
    across = results(resident, tmp_path / "across", Lauwerier(**coarse))
    alike = results(resident, tmp_path / "alike", Lauwerier(**coarse, along=1.0))
    print(across.error, alike.error)
    assert across.error < 0.02 and alike.error < 0.03 and alike.error > 1.2 * across.error


@pytest.mark.slow  # quick: the first one, tests/heat
def test_cold_comes_through_between_two_wells(resident, tmp_path):
    """Coarse; half the rate takes twice as long."""
    coarse = {"size": 8.0, "steps": 80}
    done = results(resident, tmp_path / "all", Doublet(**coarse))
    half = results(resident, tmp_path / "half", Doublet(**coarse, rate=2e-4, duration=4.0))
    for one in (done, half):
        print({name: value for name, value in vars(one).items() if name != "curve"})
        assert one.account < 1e-9 and one.error < 0.08
        assert one.quarter == pytest.approx(one.exact_quarter, rel=0.2)
        came = [part for _, part, _ in one.curve]
        assert 0.0 <= min(came) < 1e-3 and all(b >= a - 1e-12 for a, b in pairwise(came)) and came[-1] < 1.0
    assert half.breakthrough == pytest.approx(2.0 * done.breakthrough, rel=1e-12)
    assert half.quarter == pytest.approx(2.0 * done.quarter, rel=0.05)
    assert (tmp_path / "all" / "data" / "doublet.png").stat().st_size > 5000


@pytest.mark.slow
def test_breakthrough_of_the_documented_doublet(resident, tmp_path):
    """27 000 triangles. The front is at pi D2 (whole capacity) / (3 rho C Q) of Gringarten and Sauty."""
    done = results(resident, tmp_path, Doublet())
    print({name: value for name, value in vars(done).items() if name != "curve"})
    assert done.elements > 20000 and done.account < 1e-9
    cells = 2.0 / (math.sqrt(3.0) * 3.2**2)
    whole = 2700.0 * 1000.0 + 3.0 * cells * 3.2 * 2e-4 * 4.2e6
    assert done.breakthrough == pytest.approx(math.pi * 100.0**2 * whole / (3.0 * 4.2e6 * 4e-4), rel=0.08)
    assert done.error < 0.03 and done.quarter == pytest.approx(done.exact_quarter, rel=0.08)
