"""Brazilian test: elastic stress in the middle, and the way the disc splits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cases.brazilian import exact
from tests.cases.cracking import study

TENSILE, DIAMETER = 5e6, 0.05
AS_PUBLISHED = {"transits": 36.5}
"""Each platen moves at 0.05 m/s: 0.5e-3 c_p / transits, c_p = 3651 m/s. Everything else is the default."""


def test_formulas_at_places_worked_out_by_hand():
    assert np.allclose(exact.stress(np.array(0.0), np.array(0.0)), (1.0, -3.0))
    # On the diameter across the load s_x falls as ((1 - x2) / (1 + x2))2, to nothing at the rim.
    x = np.array([0.2, 0.5, 1.0])
    assert np.allclose(exact.stress(x, 0 * x)[0], ((1 - x**2) / (1 + x**2)) ** 2)
    # The sum of forces across a cut along that diameter is P: the integral of -s_y over D is pi D / 2 in these units.
    x = (np.arange(20000) + 0.5) / 10000 - 1
    assert -exact.stress(x, 0 * x)[1].mean() * 2 == pytest.approx(np.pi, rel=1e-6)
    assert exact.mean_in_the_middle(1e-4) == pytest.approx((1.0, -3.0), rel=1e-6)


@pytest.mark.slow
def test_elastic_disc(launch, tmp_path):
    """Stress in the middle with the closed form, averaged over the same circle."""
    found = study(launch, tmp_path, "brazilian", 3600, joints=False, most_strain=1e-3, **AS_PUBLISHED)
    stress = [found.result["centre_x"], found.result["centre_y"]]
    assert stress == pytest.approx(exact.mean_in_the_middle(0.1), rel=0.01)
    assert stress == pytest.approx([1.0, -3.0], rel=0.03)
    assert found.result["energy_error"] < 0.01 and not len(found.broken()[0])


@pytest.mark.slow
def test_disc_splits(launch, tmp_path):
    """One crack along the loaded diameter, opened nearly everywhere; the strength is that of the joints."""
    found = study(launch, tmp_path, "brazilian", 7200, **AS_PUBLISHED)
    ends, mode = found.broken()
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    assert length[mode < 4 / 3].sum() > 0.7 * length.sum()  # mode I dominates,
    middle = ends.mean(axis=1)
    inside = np.abs(middle[:, 1]) < 0.35 * DIAMETER  # away from the wedges under the platens
    assert np.abs(middle[inside, 0]).max() < 0.1 * DIAMETER  # along the diameter:
    levels = np.linspace(-0.35, 0.35, 36) * DIAMETER
    low, high = ends[:, :, 1].min(axis=1), ends[:, :, 1].max(axis=1)
    cut = [((low <= y) & (y <= high)).any() for y in levels]
    assert np.mean(cut) > 0.8  # nearly everywhere along it.
    assert found.result["strength"] == pytest.approx(TENSILE, rel=0.2)
    assert found.curve[-1, 1] < 0.5 * found.result["strength"] * 1.1
    assert found.result["energy_error"] < 0.01


@pytest.mark.slow
def test_a_disc_in_space_splits_along_a_plane_of_faces(launch, tmp_path):
    """With faces along the loaded diameter it has the strength of the joints, within 25 %; a rough path is stronger."""
    found = {}
    for guided in (True, False):
        given = {"dim": 3, "size": 0.006, "transits": 12, "penalty_overlay": 10, "guided": guided}
        found[guided] = study(launch, tmp_path / str(guided), "brazilian", 3600, **given).result
        assert found[guided]["energy_error"] < 0.01
    assert found[True]["strength"] == pytest.approx(TENSILE, rel=0.25)
    assert found[False]["strength"] > 1.3 * found[True]["strength"]
