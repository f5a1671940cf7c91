"""Cohesion decides how far apart thrusts are and how far they slip, not the taper.

Published (abstract of Morgan 2015, J. Geophys. Res. 120:3870): wedges of all cohesions have the same mean taper;
spacing and offset of thrusts grow with cohesion; forethrusts take most of the shortening. Here: tensile strength 0, 1e7
and 2e7 Pa, cohesion twice that, detachment friction 0.2, bed of 30 x 3 km pushed by 9 km. Wedges of so few grains are
individuals: asserted are trends of sums over a whole layer and of means over time, averaged over two beds.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tests.published import measure
from tests.published.conftest import Series
from tests.published.test_detachment_series import share_back

TENSION = (0.0, 1e7, 2e7)
SEEDS = (31, 32)
Runs = dict[float, list[list[measure.Grains]]]


@pytest.fixture(scope="module")
def runs(push: Series) -> Runs:
    cases = list(product(TENSION, SEEDS))
    asked = push([dict(seed=seed, detachment=0.2, tension=t, way=9000.0, speed=4.0) for t, seed in cases])
    return {tension: [frames for (t, _), frames in zip(cases, asked) if t == tension] for tension in TENSION}


def marker(first: measure.Grains, later: measure.Grains) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places and displacements of the grains of the middle of the bed."""
    a, b = measure.common(first, later)
    middle = np.abs(a.y - 1800.0) < 400.0
    return a.x[middle], (b.x - a.x)[middle], (b.y - a.y)[middle]


def taper(frames: list[measure.Grains]) -> float:
    """Mean over the second half of the shortening of the slope by the rule of measure.py [degrees]."""
    late = [f for f in frames if f.walls[1][0][0] > 4500.0]
    return float(np.mean([measure.wedge(*measure.surface(f.x, f.y + f.r, 200.0)).slope for f in late]))


def offset_and_length(frames: list[measure.Grains]) -> tuple[float, float]:
    """Mean offset: heave between neighbouring pieces of 300 m, weighted with itself [m]. Deformed length: of as many
    pieces as would share the shortening evenly [m]."""
    joints = measure.heaves(*marker(frames[0], frames[-1])[:2], 300.0)
    return float((joints**2).sum() / joints.sum()), float(300.0 * joints.sum() ** 2 / (joints**2).sum())


def first_thrust(frames: list[measure.Grains]) -> float:
    """Place of the first forethrust of at least 500 m of slip along the undeformed bed, at its birth [m]."""
    for frame in frames[1:]:
        for cut in measure.breaks(*marker(frames[0], frame), 300.0, 500.0, 0.3):
            if cut.vergence > 0:
                return cut.at
    raise AssertionError("no forethrust in the whole run")


@pytest.mark.slow
def test_mean_taper_is_the_same(runs: Runs) -> None:
    found = {tension: [taper(frames) for frames in pair] for tension, pair in runs.items()}
    print("taper", found)
    mean = {tension: np.mean(pair) for tension, pair in found.items()}
    assert abs(mean[2e7] - mean[1e7]) < 4.0
    assert max(mean.values()) - min(mean.values()) < 7.0
    assert all(8.0 < value < 22.0 for value in mean.values())


@pytest.mark.slow
def test_offset_grows_and_deformation_concentrates_with_cohesion(runs: Runs) -> None:
    found = {tension: [offset_and_length(frames) for frames in pair] for tension, pair in runs.items()}
    print("offset and length", found)
    (none, length), (_, middle), (most, short) = (np.mean(found[tension], axis=0) for tension in TENSION)
    assert most > 1.4 * none
    assert short < middle < length and short < 0.7 * length


@pytest.mark.slow
def test_first_thrust_is_farther_from_the_wall_with_cohesion(runs: Runs) -> None:
    found = {tension: [first_thrust(frames) for frames in pair] for tension, pair in runs.items()}
    print("first thrust", found)
    assert np.mean(found[2e7]) > 1.1 * np.mean(found[0.0])


@pytest.mark.slow
def test_forethrusts_take_most_of_the_shortening(runs: Runs) -> None:
    found = {tension: [share_back(frames) for frames in pair] for tension, pair in runs.items()}
    print("backward share of shear", found)
    assert all(back < 0.42 for pair in found.values() for back in pair)
