"""The measurements of measure.py on beds whose answers are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.published import measure
from tests.published.conftest import program

R = 50.0


def bed(width: float, height: float, top=None) -> tuple[np.ndarray, np.ndarray]:
    """Grains on a hexagonal lattice, slightly disturbed; `top(x)` cuts the bed."""
    rng = np.random.default_rng(7)
    rows = int(height / (np.sqrt(3.0) * R))
    y = R + np.sqrt(3.0) * R * np.arange(rows)
    x = np.arange(R, width, 2.0 * R)
    x, y = (x[None, :] + R * (np.arange(rows) % 2)[:, None]).ravel(), np.repeat(y, len(x))
    x, y = x + rng.uniform(-5.0, 5.0, len(x)), y + rng.uniform(-5.0, 5.0, len(y))
    keep = (x < width) & (y < (top(x) if top else np.inf))
    return x[keep], y[keep]


@pytest.mark.parametrize("slope", [8.0, 16.0, 24.0])
def test_wedge_on_a_bed(slope: float) -> None:
    """A plateau, a slope down to a flat bed: crest height, toe and slope come back."""
    fall = 2500.0 / np.tan(np.radians(slope))
    x, y = bed(30000.0, 6000.0, lambda x: np.clip(5500.0 - (x - 3000.0) * np.tan(np.radians(slope)), 3000.0, 5500.0))
    found = measure.wedge(*measure.surface(x, y, 200.0))
    assert found.slope == pytest.approx(slope, abs=0.5)
    assert found.toe[0] == pytest.approx(3000.0 + fall, abs=200.0 + 2.0 * R / np.tan(np.radians(slope)))
    assert found.toe[1] == pytest.approx(3000.0, abs=2.0 * R)
    assert found.crest[1] == pytest.approx(5500.0, abs=2.0 * R)


def test_a_surface_rising_all_the_way_is_no_wedge() -> None:
    with pytest.raises(ValueError, match="is its far end"):
        measure.wedge(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]))


def test_surface_takes_the_highest_grain_of_a_column() -> None:
    xs, ys = measure.surface(np.array([10.0, 20.0, 250.0, 720.0]), np.array([5.0, 7.0, 3.0, 1.0]), 200.0)
    assert xs.tolist() == [20.0, 250.0, 720.0] and ys.tolist() == [7.0, 3.0, 1.0]


def test_front_uplift_thickness_and_peaks() -> None:
    x, y = bed(20000.0, 3000.0)
    before = measure.surface(x, y, 200.0)
    lifted = y + np.where(x < 8000.0, 400.0, 0.0)
    after = measure.surface(x, lifted, 200.0)
    assert measure.front(*after, np.median(after[1]), 200.0) == pytest.approx(8000.0, abs=200.0)
    rise = measure.uplift(before, after, np.array([4000.0, 15000.0, 99000.0]))
    assert rise[:2] == pytest.approx([400.0, 0.0], abs=1e-6) and np.isnan(rise[2])
    layer = (y > 1000.0) & (y < 2000.0)
    assert measure.thickness(x[layer], y[layer], np.full(layer.sum(), R), 200.0) == pytest.approx(1000.0, abs=2.0 * R)
    wave = np.arange(0.0, 28001.0, 100.0)
    highs = measure.peaks(wave, 300.0 * np.cos(2.0 * np.pi * (wave - 3500.0) / 7000.0), 1000.0, 100.0)
    assert highs == pytest.approx([3500.0, 10500.0, 17500.0, 24500.0], abs=200.0)


def test_strain_of_known_motions() -> None:
    """Turning by 40 degrees is no strain; simple shear g gives sqrt(g^4/16 + g^2/4) with the sign of its sense."""
    x, y = bed(6000.0, 3000.0)
    a = np.radians(40.0)
    turned = measure.strain(
        x, y, x * (np.cos(a) - 1) - y * np.sin(a), x * np.sin(a) + y * (np.cos(a) - 1), 400.0, 400.0
    )
    inside = turned.area > 0.0
    assert np.abs(turned.distortion[inside]).max() < 1e-9
    assert turned.area.sum() == pytest.approx(5900.0 * (y.max() - y.min()), rel=0.03)
    for g in (0.7, -0.7):
        sheared = measure.strain(x, y, g * y, 0.0 * y, 400.0, 400.0).distortion[inside]
        assert sheared == pytest.approx(np.sign(g) * np.sqrt(g**4 / 16.0 + g**2 / 4.0), rel=1e-9)
        assert measure.strain(x, y, g * y, 0.0 * y, 400.0, 400.0).rate[inside] == pytest.approx(g, rel=1e-9)


def ramp(x: np.ndarray, y: np.ndarray, foot: float, dip: float, slip: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of everything left of a plane that rises from (foot, 0) to the right, by `slip` up the plane."""
    a = np.radians(dip)
    above = (y - np.tan(a) * (x - foot)) > 0.0
    return np.where(above, slip * np.cos(a), 0.0), np.where(above, slip * np.sin(a), 0.0)


@pytest.mark.parametrize("dip", [25.0, 40.0])
def test_one_thrust(dip: float) -> None:
    x, y = bed(24000.0, 4000.0)
    dx, dy = ramp(x, y, 8000.0, dip, 600.0)
    field = measure.strain(x, y, dx, dy, 200.0, 400.0)
    (band,) = measure.bands(field.x, field.y, field.rate, 0.5, 2000.0)
    assert band.vergence == 1
    assert band.dip == pytest.approx(dip, abs=3.0)
    assert band.length == pytest.approx(4000.0 / np.sin(np.radians(dip)), rel=0.12)
    # Slip times length is the shear of the band, whatever the cells.
    assert band.shear == pytest.approx(600.0 * (y.max() - y.min()) / np.sin(np.radians(dip)), rel=0.1)

    layer = np.abs(y - 2000.0) < 250.0
    (cut,) = measure.breaks(x[layer], dx[layer], dy[layer], 400.0, 200.0, 0.2)
    assert cut.vergence == 1
    assert cut.at == pytest.approx(8000.0 + 2000.0 / np.tan(np.radians(dip)), abs=600.0)
    assert cut.slip == pytest.approx(600.0, rel=0.01)
    assert cut.dip == pytest.approx(dip, abs=0.5)
    assert measure.advance(x[layer], dx[layer], 400.0, 50.0) == pytest.approx(cut.at, abs=1000.0)


def test_pop_up_has_both_vergences_and_folds_are_no_thrusts() -> None:
    x, y = bed(24000.0, 4000.0)
    ax, ay = ramp(x, y, 13000.0, 30.0, 500.0)
    # The backthrust: everything right of a plane rising to the left from (10000, 0) goes left and up.
    bx, by = ramp(-x, y, -10000.0, 30.0, 500.0)
    dx, dy = ax - bx, ay + by
    field = measure.strain(x, y, dx, dy, 200.0, 400.0)
    found = measure.bands(field.x, field.y, field.rate, 0.5, 2000.0)
    assert [band.vergence for band in found] == [-1, 1]
    assert [band.dip for band in found] == pytest.approx([-30.0, 30.0], abs=3.0)
    layer = np.abs(y - 1500.0) < 250.0
    cuts = measure.breaks(x[layer], dx[layer], dy[layer], 400.0, 200.0, 0.2)
    assert [cut.vergence for cut in cuts] == [-1, 1]

    limb = np.clip(x - 10000.0, 0.0, 4000.0)
    a = np.radians(35.0)
    fold = measure.breaks(x[layer], (limb * (np.cos(a) - 1.0))[layer], (limb * np.sin(a))[layer], 400.0, 200.0)
    assert fold == []


def test_heaves_and_parts_of_shear() -> None:
    """A forethrust of 600 m through a bed: the heave between the pieces is its own, shear is forward only, mirrored
    backward only."""
    x, y = bed(24000.0, 4000.0)
    dx, dy = ramp(x, y, 8000.0, 30.0, 600.0)
    layer = np.abs(y - 2000.0) < 250.0
    assert measure.heaves(x[layer], dx[layer], 400.0).sum() == pytest.approx(600.0 * np.cos(np.radians(30.0)), rel=1e-9)

    def frame(x: np.ndarray, y: np.ndarray) -> measure.Grains:
        n = np.arange(len(x))
        return measure.Grains(0, n, x, y, np.full(len(x), R), n, n, {})

    fore, back = measure.shear(frame(x, y), frame(x + dx, y + dy), 250.0, 400.0, 0.0, 0.0)
    assert back < 0.02 * fore
    assert fore == pytest.approx(600.0 * (y.max() - y.min()) / np.sin(np.radians(30.0)), rel=0.1)
    mirrored = measure.shear(frame(-x, y), frame(-x - dx, y + dy), 250.0, 400.0, 0.0, -np.inf)
    assert mirrored == pytest.approx((back, fore), rel=0.05, abs=1e4)


def test_frames_are_read_in_the_order_of_ids(tmp_path: Path) -> None:
    """What measure reads is what the program wrote: a row of three particles, one of them deleted in between."""
    text = """START
BOX left 0.0 right 1000.0 bottom 0.0 height 1000.0
WALL id 1 nodes (10.0, 900.0) (10.0, 0.0) xv 2.0
BALL id 5 x 300.0 y 100.0 rad 10.0 group a
BALL id 3 x 500.0 y 100.0 rad 20.0 group b color red
BALL id 9 x 700.0 y 100.0 rad 30.0 group a
PROP density 1000.0 kn 1e6 ks 1e6 yv 1.0
SET dt 0.01 print 100
CYC 100
DEL range x 450.0 550.0
CYC 100
STOP
"""
    first, last = measure.series(program(tmp_path, "row", text))
    assert first.gid.tolist() == [3, 5, 9] and last.gid.tolist() == [5, 9]
    assert first.r.tolist() == [20.0, 10.0, 30.0] and first.group.tolist() == ["b", "a", "a"]
    a, b = measure.common(first, last)
    assert a.gid.tolist() == [5, 9] and (b.y - a.y) == pytest.approx([1.0, 1.0], rel=1e-9)
    assert last.walls[1][0] == pytest.approx((14.0, 900.0))
    assert first.color[0] == 3
