"""A slope with benches: balance after every stage, displacements on finer meshes, triangles against quads."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hpcdem.cases import Slope
from tests.cases.ready import results


@pytest.mark.parametrize("elements", ["tri", pytest.param("quad", marks=pytest.mark.slow)])
def test_every_stage_is_in_balance(resident, tmp_path, elements):
    """The bottom carries the weight of what is left, the sides hold each other: to 1e-4, ten times the ratio of all
    unbalanced to all forces times their number over the weight. What is taken out is known from the polygons."""
    case = Slope(elements=elements, benches=2, size=1.2, coarse=2.5)
    done = results(resident, tmp_path, case)
    assert done.ratio < 1e-5 and len(done.stages) == 2
    run = case.bench_height / np.tan(np.radians(case.face))
    right = 2 * run + case.bench_width + case.before
    whole = (case.behind + right) * (2 * case.bench_height + case.below)
    for k, _, _, _, _, weight, carried in done.stages:
        whole -= case.bench_height * (right - (k - 1) * (run + case.bench_width) - 0.5 * run)
        assert weight == pytest.approx(whole * case.density * case.gravity, rel=1e-9)
        assert carried == pytest.approx(weight, rel=1e-4)
    assert abs(done.aside) < 1e-4 * done.weight
    floors = [stage[3] for stage in done.stages]
    assert 0.0 < floors[0] < floors[1]
    assert done.crest_x < 0.0 < done.crest_y


@pytest.mark.slow
def test_finer_meshes_and_quads_agree(resident, tmp_path):
    """Displacements of three meshes: the differences fall, and the last is below 2 % of the heave of the floor; quads
    give the same to 2 %. (Corners at the toes hold the order below two: the stress is singular there.)"""
    sizes = (1.0, 0.5, 0.25)
    runs = [results(resident, tmp_path / str(size), Slope(size=size, coarse=3 * size)) for size in sizes]
    found = [np.array(done.stages)[:, 1:4] for done in runs]
    scale = np.abs(found[-1]).max()
    first, second = (np.abs(a - b).max() / scale for a, b in pairwise(found))
    print("differences", first, second)
    assert second < 0.7 * first and second < 0.02
    quads = results(resident, tmp_path / "quads", Slope(elements="quad", size=0.5, coarse=1.5))
    assert np.array(quads.stages)[:, 1:4] == pytest.approx(found[-1], abs=0.02 * scale)


@pytest.mark.slow
def test_a_strong_jointed_slope_is_stable(resident, tmp_path):
    """Two benches of 2.5 m at 90 degrees; height of a vertical cut that stands by itself: about 4 c tan(45 + phi/2) /
    (rho g) (Terzaghi), 16.9 m for 60 kPa and 30 degrees."""
    common = {
        "joints": True,
        "benches": 2,
        "face": 90.0,
        "size": 0.6,
        "coarse": 2.0,
        "before": 6.0,
        "behind": 6.0,
        "below": 5.0,
    }
    strong = results(resident, tmp_path / "strong", Slope(**common))
    assert strong.tension + strong.mixed + strong.shear == 0
    assert strong.energy_error < 0.01
