"""Friction of the detachment decides the style of a fold-and-thrust belt.

Published (Li et al., abstract of the 2017 CGU meeting, shown on the author's pages; 60 x 6 km, tensile strength 1e7 Pa,
cohesion 2e7 Pa, 10 km of shortening): friction 0.2 and 0.3 give imbricate forethrusts packed near the wall, 0.0 and 0.1
fore- and backthrusts in pairs (pop-ups) that reach farther; strain on the detachment runs 5 to 10 km ahead of the
deformation of the surface. Here the bed is half as long and half as thick and is pushed half as far, with the same
material: style and order are compared, not lengths. Which thrust forms next is chaotic: the share of backthrusts in one
bed on a frictionless detachment lies between 0.24 and 0.46, so styles are compared over five beds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from tests.published import measure
from tests.published.conftest import Series

FRICTION = (0.0, 0.1, 0.2, 0.3)
BEDS = (31, 32, 33, 34, 35)
"""Seeds."""


@dataclass(frozen=True)
class Belt:
    """What is measured of one run at its end."""

    reach: float
    ahead: float
    taper: float
    back: float
    thrusts: list[measure.Break]


def belt(frames: list[measure.Grains]) -> Belt:
    """Reach of the surface's deformation from the wall; lead of the detachment over it; taper [degrees], highest
    rise over that reach; share of backthrusting in all shear above the detachment; thrusts through the middle
    of the bed."""
    first, last = frames[0], frames[-1]
    wall = last.walls[1][0][0]
    level = float(np.median(measure.surface(first.x, first.y + first.r, 200.0)[1]))
    surface = measure.surface(last.x, last.y + last.r, 200.0)
    front = measure.front(*surface, level, 250.0)

    a, b = measure.common(first, last)
    dx, dy = b.x - a.x, b.y - a.y
    weak = a.y < 400.0
    moved = measure.advance(a.x[weak], dx[weak], 400.0, 100.0)
    marker = np.abs(a.y - 1800.0) < 200.0
    thrusts = measure.breaks(a.x[marker], dx[marker], dy[marker], 300.0, 200.0, 0.3)
    taper = np.degrees(np.arctan2(surface[1].max() - level, front - wall))
    return Belt(front - wall, moved - front, float(taper), share_back(frames), thrusts)


def share_back(frames: list[measure.Grains]) -> float:
    """Backward part of the shear strain summed over cells, frame by frame; the detachment and 1 km at the wall, which
    drags grains down, left out."""
    fore, back = np.sum(
        [measure.shear(a, b, 250.0, 400.0, low=500.0, past=b.walls[1][0][0] + 1000.0) for a, b in pairwise(frames)],
        axis=0,
    )
    return float(back / (fore + back))


@pytest.fixture(scope="module")
def belts(push: Series) -> dict[float, Belt]:
    runs = push([_run(31, mu) for mu in FRICTION])
    return {mu: belt(frames) for mu, frames in zip(FRICTION, runs)}


@pytest.fixture(scope="module")
def styles(push: Series) -> dict[float, list[Belt]]:
    """Of all beds, on the weakest and on the strong detachments."""
    found = {}
    for mu in (0.0, 0.2, 0.3):
        found[mu] = [belt(frames) for frames in push([_run(seed, mu) for seed in BEDS])]
    return found


def _run(seed: int, mu: float) -> dict[str, float]:
    return dict(seed=seed, detachment=mu, tension=1e7, way=5000.0, speed=2.5)


@pytest.mark.slow
def test_a_weak_detachment_spreads_the_deformation(belts: dict[float, Belt]) -> None:
    reach = {mu: b.reach for mu, b in belts.items()}
    print(belts)
    assert reach[0.0] > 1.3 * max(reach[0.2], reach[0.3])
    assert (reach[0.0] + reach[0.1]) > 1.25 * (reach[0.2] + reach[0.3])
    # Packed near the wall: within four and a half thicknesses of the bed.
    assert max(reach[0.2], reach[0.3]) < 13500.0 < reach[0.0]


@pytest.mark.slow
def test_pop_ups_on_a_weak_detachment_forethrusts_on_a_strong_one(
    belts: dict[float, Belt], styles: dict[float, list[Belt]]
) -> None:
    """Both vergences alike on the weak one: in the mean over the beds its share of backthrusting is larger by at least
    twice the standard error."""

    def slip(beds: list[Belt], vergence: int) -> float:
        return sum(t.slip for b in beds for t in b.thrusts if t.vergence == vergence)

    back = {mu: np.array([b.back for b in beds]) for mu, beds in styles.items()}
    print(back)
    weak = styles[0.0]
    assert slip(weak, 1) < 1.5 * slip(weak, -1)
    assert all({t.vergence for t in b.thrusts if t.slip > 300.0} == {1, -1} for b in weak)
    for mu in (0.2, 0.3):
        strong = styles[mu]
        error = np.sqrt((back[0.0].var(ddof=1) + back[mu].var(ddof=1)) / len(BEDS))
        assert back[0.0].mean() > back[mu].mean() + 2.0 * error and back[0.0].mean() > 1.3 * back[mu].mean()
        assert back[mu].max() < 0.35
        assert slip(strong, 1) > 1.5 * slip(strong, -1)
        assert all(max(b.thrusts, key=lambda t: t.slip).vergence == 1 for b in strong)
    assert belts[0.1].back > min(belts[0.2].back, belts[0.3].back)


@pytest.mark.slow
def test_taper_grows_with_the_friction_of_the_detachment(belts: dict[float, Belt]) -> None:
    taper = [belts[mu].taper for mu in FRICTION]
    assert taper[0] < 9.0
    assert taper[0] + 3.0 < min(taper[2:])
    assert all(9.0 < t < 27.0 for t in taper[2:])


@pytest.mark.slow
def test_the_detachment_runs_ahead_of_the_surface(belts: dict[float, Belt]) -> None:
    """5 to 10 km ahead in the published bed of twice the thickness."""
    for mu in (0.1, 0.2, 0.3):
        assert 2000.0 < belts[mu].ahead < 15000.0, f"friction {mu}"
    assert belts[0.1].ahead > belts[0.3].ahead
