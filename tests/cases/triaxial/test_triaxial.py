"""A cube in space under pressure p: its strength rises by N p, N = tan^2(45 degrees + phi/2)."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.cases import Triaxial
from tests.cases.ready import results

COARSE = {"size": 0.007, "transits": 10.0, "stop": 0.95, "most_strain": 0.0035}


@pytest.mark.slow
def test_strength_over_confinement(resident, tmp_path):
    """Joints of all directions: at most 2 c sqrt(N) + N p, and above 0.6 of that; from pressure to pressure the slope
    is N within 15 %. Energy adds up."""
    pressures, found = (0.0, 5e6, 10e6), []
    for p in pressures:
        case = Triaxial(least=p, middle=p, **COARSE)
        got = results(resident, tmp_path / f"{p:g}", case)
        assert 0.6 * got.criterion < got.peak <= 1.02 * got.criterion
        assert got.shear > got.tension and got.energy_error < 0.01
        found.append(got.peak)
    assert np.polyfit(pressures, found, 1)[0] == pytest.approx(3.0, rel=0.15)
