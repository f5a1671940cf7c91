"""The measures themselves on beds whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.post.measure import cracks, faults, layers, tracks, triangles, walls, wedge
from hpcdem.post.measure.grains import Grains, columns_of, driving_wall
from hpcdem.post.measure.surface import surface
from tests.published import breaks
from tests.unit.measured import R, lattice, ramp

FLAT = {0: ((-9e4, 0.0), (9e4, 0.0))}


def made(x: np.ndarray, y: np.ndarray, gid: np.ndarray | None = None, **more: object) -> Grains:
    """Grains of radius R, colours in layers of 1 km."""
    n = len(x)
    gid = np.arange(n) if gid is None else gid
    columns = gid, x, y, np.full(n, R), (y // 1000.0).astype(int), np.full(n, "rock", dtype=object)
    return Grains(0, *columns, {}, **more)  # type: ignore[arg-type]


# --- wedge -------------------------------------------------------------------------------------------------------


def test_the_slope_of_a_triangle_is_exact() -> None:
    """Surface points on a straight line, then flat ground: slope, crest and toe to the last digit."""
    x = np.arange(0.0, 20001.0, 100.0)
    y = np.maximum(4000.0 - 0.25 * x, 1000.0)
    found = wedge.wedge(x, y)
    assert found.slope == pytest.approx(np.degrees(np.arctan(0.25)), rel=1e-12)
    assert found.crest == (0.0, 4000.0) and found.toe == (12000.0, 1000.0)


@pytest.mark.parametrize("dip", [0.0, 3.0])
def test_shape_of_a_bed_on_a_floor(dip: float) -> None:
    """A wedge of 10 degrees over a floor that falls by `dip` to the back, by the floor's wall and, without it, by the
    lowest grains."""
    x, y = lattice(20000.0, 9000.0)
    floor = lambda x: np.tan(np.radians(dip)) * (x - 20000.0)  # noqa: E731
    top = np.maximum(4500.0 - np.tan(np.radians(10.0)) * x, 1500.0)
    keep = y < top - floor(x)
    x, y = x[keep], (y + floor(x))[keep]
    r = np.full(len(x), R)
    line = {0: ((0.0, float(floor(0.0))), (20000.0, 0.0)), 1: ((0.0, 9000.0), (0.0, 0.0))}
    for under in (line, {1: line[1]}):
        shape = wedge.shape(x, y, r, under, 200.0, 0.0)
        assert shape.wedge.slope == pytest.approx(10.0, abs=0.6)
        assert shape.base == pytest.approx(dip, abs=1e-9 if under is line else 0.1)
        assert shape.taper == shape.wedge.slope + shape.base
        assert shape.height == pytest.approx(4500.0 - floor(0.0), abs=4.0 * R)
        assert shape.width == pytest.approx(3000.0 / np.tan(np.radians(10.0)), abs=600.0)


def test_flat_or_empty_ground_is_no_wedge() -> None:
    x, y = lattice(10000.0, 2000.0)
    with pytest.raises(ValueError, match="flat"):
        wedge.shape(x, y, np.full(len(x), R), FLAT, 200.0)
    with pytest.raises(ValueError, match="no particles"):
        wedge.shape(x[:0], y[:0], y[:0], FLAT, 200.0)


@pytest.mark.parametrize("seed", range(5))
def test_the_rough_top_of_a_level_pile_is_no_wedge(seed: int) -> None:
    """Grains piled by chance, with hollows and heaps of several diameters: crest and toe were anywhere."""
    rng = np.random.default_rng(seed)
    x = np.arange(R, 20000.0, 2.0 * R)
    top = 3000.0 + 6.0 * R * rng.uniform(-1.0, 1.0, len(x)) + 2.0 * R * np.sin(x / 1500.0)
    x, y = np.tile(x, 2), np.concatenate([np.full(len(x), R), top])
    with pytest.raises(ValueError, match=r"the surface is flat: (behind the toe|it falls by)"):
        wedge.shape(x, y, np.full(len(x), R), FLAT, 200.0)


def test_width_of_columns_is_a_round_number_of_about_three_radii() -> None:
    assert [columns_of(np.array([r])) for r in (80.0, 50.0, 0.3, 2.0)] == pytest.approx([250.0, 200.0, 1.0, 5.0])


def test_driving_wall_is_the_one_that_goes_farthest() -> None:
    first = {-1: ((0.0, 0.0), (0.0, 1.0)), 1: ((0.0, 0.0), (0.0, 1.0)), 2: ((9.0, 0.0), (9.0, 1.0))}
    assert driving_wall(first, first) is None
    assert driving_wall(first, {**first, -1: ((5.0, 0.0), (5.0, 1.0)), 2: ((8.0, 0.0), (8.0, 1.0))}) == 2
    assert driving_wall(first, {2: first[2]}) is None
    bent = {**first, 2: ((0.0, 0.0), (0.5, 0.0))}  # the first segment of a base that bends
    assert driving_wall(first, bent) is None


def test_the_floor_follows_a_wall_that_bends() -> None:
    """Grains on a parabola of twenty segments; without these, the straight line through their lowest points."""
    rng = np.random.default_rng(1)
    nodes = np.linspace(0.0, 100.0, 21)
    sag = -8.0 * nodes / 50.0 * (2.0 - nodes / 50.0)
    walls = {k: ((nodes[k], sag[k]), (nodes[k + 1], sag[k + 1])) for k in range(20)}
    x, r = rng.uniform(0.0, 100.0, 4000), np.full(4000, 0.5)
    y = np.interp(x, nodes, sag) + 0.5 + rng.uniform(0.0, 20.0, 4000)
    at = np.linspace(2.0, 98.0, 50)
    assert wedge.floor(x, y, r, walls, 1.5, at) == pytest.approx(np.interp(at, nodes, sag), abs=0.05)
    assert np.abs(wedge.floor(x, y, r, {}, 1.5, at) - np.interp(at, nodes, sag)).max() > 2.0
    above = walls | {30: ((-1.0, 45.0), (101.0, 45.0))}
    assert wedge.floor(x, y - np.interp(x, nodes, sag) + 45.0, r, above, 1.5, at) == pytest.approx(45.0)


# --- faults ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("dip", "slip", "mirror"), [(30.0, 500.0, 1), (30.0, 500.0, -1), (45.0, -300.0, 1)])
def test_dip_vergence_and_sense_of_a_fault(dip: float, slip: float, mirror: int) -> None:
    """A thrust to the right, one to the left, a normal fault; the field lies where the later frame is."""
    x, y = lattice(16000.0, 3500.0)
    dx, dy = ramp(x, y, 6000.0, dip, slip)
    a, b = made(mirror * x, y), made(mirror * (x + dx), y + dy)
    px, py, field = faults.between(a, b, 200.0)  # type: ignore[misc]
    (band,) = faults.bands(px, py, field, 0.2, 1500.0)
    assert band.dip == pytest.approx(mirror * dip, abs=3.0)
    assert band.vergence == (mirror if slip > 0.0 else -mirror)
    assert band.reverse is (slip > 0.0)
    assert band.length == pytest.approx(3500.0 / np.sin(np.radians(dip)), rel=0.15)
    assert band.mean == pytest.approx(band.shear / band.area) and band.mean > 0.2
    (x1, y1), (x2, y2) = band.ends
    assert np.hypot(x2 - x1, y2 - y1) == pytest.approx(band.length)
    # The plane goes through it.
    assert mirror * band.centre[0] == pytest.approx(6000.0 + band.centre[1] / np.tan(np.radians(dip)), abs=400.0)


def test_a_sheared_block() -> None:
    """Simple shear by 0.8 between two heights, to the left: one band, flat, with the strain of the formula; the place
    is that after the motion."""
    x, y = lattice(12000.0, 4000.0)
    moved = -0.8 * (np.clip(y, 1500.0, 2500.0) - 1500.0)
    px, py, field = faults.between(made(x, y), made(x + moved, y), 200.0)  # type: ignore[misc]
    (band,) = faults.bands(px, py, field, 0.2, 1500.0)
    assert band.vergence == -1 and band.dip == pytest.approx(0.0, abs=1.0)
    assert band.centre[1] == pytest.approx(2000.0, abs=50.0)
    assert band.centre[0] == pytest.approx(6000.0 - 0.8 * 500.0, abs=100.0)
    inner = np.abs(field[(np.abs(py - 2000.0) < 250.0)][:, 20:30])
    assert inner == pytest.approx(np.sqrt(0.8**4 / 16.0 + 0.8**2 / 4.0), rel=1e-9)


def test_faults_that_meet_are_taken_apart() -> None:
    """A fault of 30 degrees with a steep branch of the same sense: two bands; a tenth of the field above the threshold
    elsewhere is none."""
    x, y = np.arange(0.0, 12000.0, 200.0), np.arange(0.0, 5000.0, 200.0)
    gx, gy = np.meshgrid(x, y)
    t = np.tan(np.radians(30.0))
    main = np.abs(gy - t * (gx - 2000.0)) * np.cos(np.radians(30.0)) < 260.0
    branch = (np.abs(gx - 6000.0 - 0.2 * (gy - 2300.0)) < 260.0) & (gy > 2300.0)
    found = faults.bands(x, y, np.where(main | branch, 1.0, 0.1), 0.5, 1200.0)
    assert [b.vergence for b in found] == [1, 1]
    assert sorted(b.dip for b in found) == pytest.approx([30.0, np.degrees(np.arctan(5.0))], abs=4.0)
    # Along the bottom 1 km nothing counts.
    low = faults.bands(x, y, np.where(main | branch, 1.0, 0.1), 0.5, 1200.0, 1000.0)
    assert min(min(b.ends)[1] for b in low) > 500.0
    assert faults.bands(x, y, np.full(gx.shape, np.nan), 0.5, 1200.0) == []


def test_frames_with_nothing_in_common_have_no_strain() -> None:
    x, y = lattice(2000.0, 1000.0)
    assert faults.between(made(x, y), made(x, y, np.arange(len(x)) + 9999), 200.0) is None
    assert faults.between(made(x[:2], y[:2]), made(x[:2], y[:2]), 200.0) is None
    assert faults.between(made(x[:5], 0.0 * y[:5]), made(x[:5], 0.0 * y[:5]), 200.0) is None


# --- layers and tracks -------------------------------------------------------------------------------------------


def test_areas_of_known_layers() -> None:
    """A lattice fills its rectangle; discs are pi r2; the layers' envelopes add up to the section's."""
    x, y = lattice(20000.0, 4000.0, disturbed=0.0)
    found = layers.areas(made(x, y))
    whole = found["all", ""]
    width, height = np.ptp(x) + 2.0 * R, np.ptp(y) + 2.0 * R
    assert whole.envelope == pytest.approx(width * height, rel=2e-3)
    assert whole.discs == pytest.approx(len(x) * np.pi * R**2) and whole.grains == len(x)
    parts = [found["color", str(k)] for k in range(4)]
    assert sum(p.envelope for p in parts) == pytest.approx(whole.envelope, rel=1e-12)
    # Inside, a lattice has the porosity of a hexagonal packing; 1 km of it has 1 km times the width.
    assert parts[1].porosity == pytest.approx(1.0 - np.pi / np.sqrt(12.0), abs=3e-3)  # the sides are jagged
    rows = len(np.unique(y[(y >= 1000.0) & (y < 2000.0)].round()))
    assert parts[1].envelope == pytest.approx(rows * np.sqrt(3.0) * R * width, rel=5e-3)
    assert found["group", "rock"] == whole


def test_shares_of_lonely_grains_are_their_discs() -> None:
    far = np.array([0.0, 1e6, 2e6, 3e6])
    assert triangles.shares(far, far**2, np.full(4, 2.0), 8.0) == pytest.approx(np.full(4, 4.0 * np.pi))
    assert len(triangles.shares(far[:0], far[:0], far[:0], 0.0)) == 0


def test_nearest_particles_and_spread_points() -> None:
    x, y = lattice(8000.0, 3000.0)
    g = made(x, y, np.arange(len(x)) * 3)
    k = np.argmin(np.hypot(x - 4000.0, y - 1500.0))
    assert tracks.nearest(g, np.array([[4000.0, 1500.0]])).tolist() == [3 * k]
    assert len(tracks.nearest(g, np.array([[4000.0, 1500.0], [100.0, 100.0]]), 7)) == 14
    points = tracks.spread(g, 8, 3)
    assert len(points) == 24 and np.ptp(points[:, 0]) == pytest.approx(7000.0, abs=150.0)


# --- walls and cracks --------------------------------------------------------------------------------------------


def test_work_is_the_integral_of_the_force_over_the_path() -> None:
    """A spring pushed in by s: work k s^2 / 2, exact by the trapezoidal rule; force across the way does no work."""
    s = np.linspace(0.0, 300.0, 31)
    curve = walls.Curve(np.arange(31), 0.1 * np.arange(31), np.stack([s, 0.0 * s], 1), np.stack([-4.0 * s, 7.0 + s], 1))
    assert curve.work[-1] == pytest.approx(4.0 * 300.0**2 / 2.0, rel=1e-12)
    assert curve.path_length.tolist() == pytest.approx(s.tolist()) and curve.work[0] == 0.0
    back = walls.Curve(curve.step, curve.time, curve.place[::-1], curve.force[::-1])
    assert back.work[-1] == pytest.approx(-curve.work[-1]) and back.path_length[-1] == pytest.approx(300.0)


def test_broken_made_and_lost_bonds() -> None:
    """Of five bonds one breaks open, one breaks and still touches, two go with particle 9, one holds; one is new."""
    x = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    gid = np.array([1, 3, 5, 7, 9])
    before = made(x, 0.0 * x, gid, bonds=np.array([[1, 3], [3, 5], [5, 7], [7, 9], [1, 9]]))
    after = made(x[:4], 0.0 * x[:4], gid[:4], bonds=np.array([[1, 3], [1, 7]]), contacts=np.array([[7, 5], [1, 3]]))
    change = cracks.change(before, after)
    assert change.broken.tolist() == [[3, 5], [5, 7]] and change.parted.tolist() == [True, False]
    assert change.place.tolist() == [[15.0, 0.0], [25.0, 0.0]]
    assert change.made.tolist() == [[1, 7]] and change.lost == 2
    damage = cracks.Damage(np.array([1, 3, 5, 7, 9]))
    damage.add(before.bonds, np.zeros((0, 2), np.int64))
    damage.add(change.made, change.broken)
    had, broke, share = damage.of(np.array([5, 1, 4, 7]))
    assert had.tolist() == [2, 3, 0, 3] and broke.tolist() == [2, 0, 0, 1]
    assert share[:2].tolist() == [1.0, 0.0] and np.isnan(share[2]) and share[3] == pytest.approx(1.0 / 3.0)


def test_breaks_and_surface_come_from_the_same_package() -> None:
    x, y = lattice(24000.0, 4000.0)
    dx, dy = ramp(x, y, 8000.0, 30.0, 600.0)
    layer = np.abs(y - 2000.0) < 250.0
    (cut,) = breaks.breaks(x[layer], dx[layer], dy[layer], 400.0, 200.0, 0.2)
    assert cut.slip == pytest.approx(600.0, rel=0.01) and cut.dip == pytest.approx(30.0, abs=0.5)
    xs, ys = surface(x + dx, y + dy, 200.0)
    assert len(xs) == len(ys) and np.all(np.diff(np.floor(xs / 200.0)) >= 1)
