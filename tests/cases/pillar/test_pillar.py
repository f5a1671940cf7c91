"""A pillar between rooms.

Tributary area: rock above a pillar of width w and a room of width o rests on the pillar alone, sigma_p = sigma_v
(w + o) / w. Of an endless row that is the balance of forces; beside wide rock the pillar takes less. A slender pillar
that does not soften bears 2 c tan(45 + phi / 2), as roof and floor hold its ends only.
"""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import Pillar
from tests.cases.ready import results

COARSE = {"size": 0.5, "coarse": 1.0, "openings": 2, "transits": 20.0}


@pytest.mark.slow  # quick: yielding, tests/blocks
def test_tributary_area(resident, tmp_path):
    """An endless row has the stress of its tributary area; of two rooms the abutments carry a part."""
    row = results(resident, tmp_path / "row", Pillar(**COARSE))
    for opening, width, mean, tributary, ratio in row.stages:
        assert tributary == pytest.approx(10e6 * (width + opening) / width) and ratio <= 1e-6
        assert mean == pytest.approx(tributary, rel=1e-3)
    assert [stage[:2] for stage in row.stages] == [[2.0, 6.0], [4.0, 4.0]]
    assert row.strength > 20e6 and row.factor == row.strength / row.stages[-1][2] and row.residual < 0.6 * row.strength
    assert row.strength == max(stress for _, stress in row.curve) and row.tension == row.shear == 0
    # Edges yield first: at the strength the middle bears more than the mean, after the excavation all bear alike.
    dug, weakest = ([s for _, s in profile] for profile in row.profiles[-2:])
    assert max(dug) < 1.1 * min(dug) and max(weakest) > 1.5 * min(weakest)
    two = results(resident, tmp_path / "two", Pillar(row=False, most_strain=0.001, **COARSE))
    for mean, tributary in (stage[2:4] for stage in two.stages):
        assert 0.9 * tributary < mean < 0.995 * tributary


@pytest.mark.slow
def test_what_makes_it_weaker(resident, tmp_path):
    """Each of these alone changes the strength, in the way that it should."""
    usual = results(resident, tmp_path / "usual", Pillar(**COARSE)).strength
    for change in ({"cohesion": 7e6}, {"friction": 30.0}, {"softening": 0.003}, {"residual_cohesion": 0.1},
                   {"width": 3.0, "opening": 3.0}):  # fmt: skip
        assert results(resident, tmp_path / next(iter(change)), Pillar(**{**COARSE, **change})).strength < 0.99 * usual
    assert results(resident, tmp_path / "dilation", Pillar(dilation=0.0, **COARSE)).strength != usual
    held = results(resident, tmp_path / "height", Pillar(**COARSE, height=3.0)).strength
    assert held > 1.02 * usual
    early = results(resident, tmp_path / "stop", Pillar(stop=0.9, **COARSE))
    assert early.strength == usual and early.residual > 0.6 * usual
    weak = Pillar(cohesion=3e6, **COARSE)
    with pytest.raises(AssertionError, match="the pillar does not bear stage 2, rooms of 4 m"):
        results(resident, tmp_path / "falls", weak)


@pytest.mark.slow
def test_a_slender_pillar_has_the_strength_of_its_rock(resident, tmp_path):
    case = Pillar(width=1.0, opening=1.0, size=0.2, openings=2, residual_cohesion=1.0, most_strain=0.003)
    done = results(resident, tmp_path, case)
    rock = 2.0 * case.cohesion * math.tan(math.radians(45.0 + 0.5 * case.friction))
    print(done.strength / rock)
    assert done.strength == pytest.approx(rock, rel=0.03)
    assert done.residual == done.strength  # perfectly plastic: it goes on


@pytest.mark.slow
def test_the_documented_pillars(resident, tmp_path):
    """docs/cases.md: with the default mesh, yielding and with joints."""
    yields = results(resident, tmp_path / "yields", Pillar())
    print(yields.strength, yields.empirical)
    assert yields.strength == pytest.approx(35.1e6, rel=0.01) and yields.empirical == pytest.approx(29.5e6, rel=0.002)
    cracks = results(resident, tmp_path / "cracks", Pillar(joints=True, quads=False))
    print(cracks.strength, cracks.tension, cracks.mixed, cracks.shear, cracks.energy_error)
    assert cracks.strength == pytest.approx(29.7e6, rel=0.02)
    assert cracks.tension > 50 and cracks.shear > 50 and abs(cracks.energy_error) < 1e-3
    assert cracks.stages[-1][2] == pytest.approx(20e6, rel=0.02)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.ranks
def test_the_same_on_two_ranks(resident, tmp_path):
    assert results(resident, tmp_path / "2", Pillar(**COARSE), ranks=2) == results(
        resident, tmp_path / "1", Pillar(**COARSE)
    )
