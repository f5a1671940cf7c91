"""The creep test of `hpcdem case creep` against the closed form that its script draws: that of Burgers in plane strain,
derived in tests/blocks/test_creep.py from its elastic one; here once more at two times, by hand.

K 16.667, G 10, G_K 5 GPa, eta_M 1e16, eta_K 1e14 Pa s, 10 MPa: at once (1 - nu^2) / E, 0.0375 %; in the end the
volume gives nothing more, so the rate goes to that of an incompressible rock, load / (4 eta_M).
"""

from __future__ import annotations

import pytest

from hpcdem.cases import Creep
from tests.cases.ready import results


@pytest.mark.slow  # quick: tests/blocks/test_creep.py
def test_against_the_closed_form(resident, tmp_path):
    done = results(resident, tmp_path, Creep(size=0.025))
    print(done.strain, done.exact, done.error, done.steps)
    assert done.at_once == pytest.approx(10e6 * (1.0 - 0.25**2) / 25e9, rel=1e-4)
    assert done.error < 2e-3 and done.strain == pytest.approx(done.exact, rel=2e-3)
    assert 20 < done.steps < 200 and done.curve[-1][0] == 1e5


@pytest.mark.slow  # quick: the one above, tests/blocks/test_creep.py
def test_a_finer_change_is_more_exact_and_the_last_rate_is_known(resident, tmp_path):
    errors = []
    for change in (0.1, 0.02):
        done = results(resident, tmp_path / str(change), Creep(size=0.025, change=change, time=2e6))
        (t0, e0), (t1, e1) = done.curve[-5], done.curve[-1]
        assert (e1 - e0) / (t1 - t0) == pytest.approx(10e6 / 4e16, rel=0.01)
        errors.append(done.error)
    assert errors[1] < errors[0] < 1e-2
