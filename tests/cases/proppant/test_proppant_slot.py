"""`hpcdem case proppant-slot` against Kynch's solution, as its script computes it, and numbers by hand (9.15)."""

from __future__ import annotations

import pytest

from hpcdem.cases import ProppantSlot
from tests.cases.ready import results


@pytest.mark.slow  # quick: tests/proppant
def test_a_slurry_settles_as_kynch_says(resident, tmp_path):
    done = results(resident, tmp_path, ProppantSlot())
    print({name: value for name, value in vars(done).items() if name != "profiles"})
    assert done.exact_front == pytest.approx(done.speed * 0.8**5.65, rel=1e-9)
    assert done.front == pytest.approx(done.exact_front, rel=0.01)
    assert done.bed == pytest.approx(done.exact_bed, rel=0.05)
    assert done.error < 0.04 and done.lost < 1e-12
    assert done.pack == pytest.approx(1.0 / 3.0, abs=0.005) and done.exact_pack == pytest.approx(1.0 / 3.0)
    assert (tmp_path / "data" / "proppant-slot.png").stat().st_size > 5000


@pytest.mark.slow  # quick: tests/proppant
def test_sand_in_water(resident, tmp_path):
    """0.45 mm, 2550 kg/m3, 7 %: between the laws of Ferguson and Church for natural and smooth grains; the pack takes
    up what the front leaves, c (front + bed) = limit bed."""
    sand = {"grain_size": 4.5e-4, "grain_density": 2550.0, "viscosity": 1e-3, "concentration": 0.07}
    errors = []
    for size in (0.02, 0.01):
        done = results(resident, tmp_path / str(size), ProppantSlot(**sand, size=size))
        print({name: value for name, value in vars(done).items() if name != "profiles"})
        assert 0.0613 < done.speed < 0.0802
        assert done.front == pytest.approx(done.exact_front, rel=0.01)
        assert done.bed == pytest.approx(done.exact_bed, rel=0.01)
        assert 0.07 * (done.exact_front + done.exact_bed) == pytest.approx(0.6 * done.exact_bed, rel=1e-3)
        assert done.pack == pytest.approx(0.07 / 0.6, abs=size) and done.lost < 1e-12
        errors.append(done.error)
    assert errors[1] < 0.7 * errors[0]
