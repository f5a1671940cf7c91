"""Strain of known displacements: exact for affine ones, zero for rotations, not a number where nothing is known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.post import grid as grids
from hpcdem.post import strain

SIZE = 200.0


def cloud(n: int = 3000, x0: float = 38000.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places far from the origin, where rounding is coarse."""
    rng = np.random.default_rng(3)
    return x0 + rng.uniform(0.0, 6000.0, n), rng.uniform(0.0, 3000.0, n), rng.choice([60.0, 80.0], n)


@pytest.fixture(params=["nearest", "grid"], autouse=True)
def method(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways to fit; `increment` stands for the one that is tested."""
    if request.param == "nearest":
        monkeypatch.setattr(strain, "increment", lambda size, x, y, _, u, v: strain.nearest(size, x, y, u, v))
    return request.param


def follow(maps: list[np.ndarray]) -> np.ndarray:
    """F (n, 4) of the cloud after one map after another about a point of their own; each map (2, 2)."""
    x, y, radius = cloud()
    f = np.tile(strain.IDENTITY, (len(x), 1))
    centre = np.array([41000.0, 2000.0])
    for a in maps:
        new = (np.stack([x, y], axis=1) - centre) @ a.T + centre + np.array([123.0, -45.0])
        df = strain.increment(SIZE, x, y, radius, new[:, 0] - x, new[:, 1] - y)
        f, (x, y) = strain.times(df, f), new.T
    return f


def rotation(angle: float) -> np.ndarray:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def test_affine_displacements_are_found_exactly() -> None:
    first, second = np.array([[1.07, 0.21], [-0.13, 0.88]]), np.array([[0.9, -0.4], [0.3, 1.2]])
    f = follow([first, second])
    np.testing.assert_allclose(f, np.tile((second @ first).ravel(), (len(f), 1)), atol=3e-12)
    e = 0.5 * ((second @ first).T @ (second @ first) - np.eye(2))
    deviator = e - 0.5 * np.trace(e) * np.eye(2)
    j2 = 0.5 * np.sum(deviator * deviator)
    assert strain.volumetric(f) == pytest.approx(100.0 * (np.linalg.det(second @ first) - 1.0), abs=1e-9)
    assert np.abs(strain.distortional(f)) == pytest.approx(math.sqrt(j2), abs=1e-11)


@pytest.mark.parametrize("degrees", [[0.01], [37.0], [90.0], [180.0], [-120.0, 77.0], [25.0] * 12])
def test_a_rigid_rotation_is_no_strain(degrees: list[float]) -> None:
    f = follow([rotation(math.radians(d)) for d in degrees])
    np.testing.assert_allclose(f, np.tile(rotation(math.radians(sum(degrees))).ravel(), (len(f), 1)), atol=1e-11)
    assert np.abs(strain.volumetric(f)).max() < 1e-8  # per cent
    assert np.abs(strain.distortional(f)).max() < 1e-11


def test_rest_is_exactly_zero() -> None:
    x, y, radius = cloud()
    f = strain.increment(SIZE, x, y, radius, np.zeros_like(x), np.zeros_like(x))
    assert not strain.volumetric(f).any() and not strain.distortional(f).any()


@pytest.mark.parametrize(("gamma", "expected"), [(3.73, 3.95), (-3.73, -3.95), (0.1, 0.0500625)])
def test_simple_shear(gamma: float, expected: float) -> None:
    """Top to the right is clockwise and positive; no change of area; ed = sqrt(gamma^4/16 + gamma^2/4)."""
    f = follow([np.array([[1.0, gamma / 4.0], [0.0, 1.0]])] * 4)
    exact = math.copysign(math.sqrt(gamma**4 / 16.0 + gamma**2 / 4.0), gamma)
    assert exact == pytest.approx(expected, rel=1e-3)
    assert strain.distortional(f) == pytest.approx(exact, rel=1e-10)
    assert np.abs(strain.volumetric(f)).max() < 1e-8


def test_shear_of_a_turned_body_is_the_same() -> None:
    """Lagrangian strain does not see what the body does afterwards."""
    shear = np.array([[1.0, 0.5], [0.0, 1.0]])
    f, turned = follow([shear]), follow([shear, rotation(0.3)])
    assert np.abs(strain.distortional(turned)) == pytest.approx(np.abs(strain.distortional(f)), rel=1e-10)


def test_pure_dilatation() -> None:
    f = follow([1.1 * np.eye(2)])
    assert strain.volumetric(f) == pytest.approx(21.0, rel=1e-11)
    assert np.abs(strain.distortional(f)).max() < 1e-11
    assert strain.volumetric(follow([0.5 * np.eye(2)])) == pytest.approx(-75.0, rel=1e-11)


def test_pure_shear_without_rotation_counts_as_positive() -> None:
    f = np.array([[1.2, 0.0, 0.0, 1.0 / 1.2]])
    assert strain.distortional(f)[0] == pytest.approx(0.25 * (1.2**2 - 1.2**-2))


def test_what_too_few_particles_do_is_not_known() -> None:
    """One, two, and three on a line: NaN, never zero; a fourth beside the line makes it known."""
    for n in (1, 2, 3):
        x, y = 100.0 + 40.0 * np.arange(n), 100.0 + 30.0 * np.arange(n)
        assert np.isnan(strain.increment(SIZE, x, y, np.full(n, 10.0), 0.1 * x, 0.0 * y)).all()
    x, y = np.array([100.0, 140.0, 180.0, 140.0]), np.array([100.0, 130.0, 160.0, 90.0])
    f = strain.increment(SIZE, x, y, np.full(4, 10.0), 0.1 * x, 0.0 * y)
    np.testing.assert_allclose(f, np.tile([1.1, 0.0, 0.0, 1.0], (4, 1)), atol=1e-12)
    assert strain.increment(SIZE, *[np.zeros(0)] * 5).shape == (0, 4)


def test_a_fault_is_as_wide_as_two_particles() -> None:
    """Hexagonal discs 140 m across, the upper ones slide by 70 m: seen by the nearest neighbours, only the rows beside
    the plane have sheared, by what six neighbours can tell; a grid of 200 m smears it over several times as much."""
    d, slip = 140.0, 70.0
    row, column = np.meshgrid(np.arange(40), np.arange(60), indexing="ij")
    x, y = ((column + 0.5 * (row % 2)) * d).ravel(), (row * d * math.sqrt(0.75)).ravel()
    upper = y > 19.5 * d * math.sqrt(0.75)
    u = np.where(upper, slip, 0.0)
    middle = np.abs(x - x.mean()) < 15.0 * d
    seen = {}
    for name, df in (
        ("nearest", strain.nearest(SIZE, x, y, u, 0.0 * u)),
        ("grid", grids.between(g := grids.cover(SIZE, x, y, np.full(len(x), 0.5 * d)),
                               strain.gradient(g, x, y, u, 0.0 * u), x, y) + strain.IDENTITY),
    ):  # fmt: skip
        profile = np.array([np.mean(df[(row.ravel() == k) & middle, 1]) for k in range(40)])
        seen[name] = profile
        step = d * math.sqrt(0.75)
        assert profile.sum() * step == pytest.approx(slip, rel=0.35)  # what is smeared is not lost
    # four of six neighbours are a row above or below: H_xy = 2 slip rows / (4 rows^2) of the row's height
    assert seen["nearest"].max() == pytest.approx(slip / (2.0 * d * math.sqrt(0.75)), rel=1e-9)
    assert (np.abs(seen["nearest"]) > 1e-9).sum() == 2
    assert (np.abs(seen["grid"]) > 0.1 * seen["grid"].max()).sum() > 4
    assert seen["grid"].max() < 0.8 * seen["nearest"].max()


def test_neighbours_that_mix_are_no_deformation() -> None:
    """No dF has det <= 0: more neighbours are asked, and where they do not help it is not known."""
    rng = np.random.default_rng(5)
    x, y, radius = cloud(2000)
    df = strain.increment(SIZE, x, y, radius, rng.normal(0.0, 150.0, len(x)), rng.normal(0.0, 150.0, len(x)))
    known = np.isfinite(df).all(axis=1)
    assert 0.2 < known.mean() < 1.0 and np.isnan(df[~known]).all()
    assert strain.volumetric(df[known]).min() > -100.0


def test_a_slope_of_displacements_is_followed() -> None:
    """Second order: the gradient of a quadratic displacement, away from the edges, to the order of the spacing."""
    x, y, radius = cloud(20000)
    s = x - 41000.0
    f = strain.increment(SIZE, x, y, radius, 1e-5 * s * s, 0.0 * y)
    inner = (np.abs(s) < 2000.0) & (np.abs(y - 1500.0) < 800.0)
    assert np.abs(f[inner, 0] - 1.0 - 2e-5 * s[inner]).max() < 2e-5 * 100.0  # half a spacing
    assert np.abs(np.mean(f[inner, 0] - 1.0 - 2e-5 * s[inner])) < 2e-5 * 5.0


def test_between_nodes() -> None:
    grid = grids.Grid(2.0, 4, 3, column=-1, row=5)
    assert grid.x.tolist() == [-2.0, 0.0, 2.0, 4.0] and grid.y.tolist() == [10.0, 12.0, 14.0]
    gx, gy = np.meshgrid(grid.x, grid.y)
    table = np.stack([3.0 * gx - gy, gx * gy], axis=2)
    x, y = np.array([-1.3, 0.0, 3.9, 4.0]), np.array([10.1, 13.0, 13.9, 14.0])
    found = grids.between(grid, table, x, y)
    np.testing.assert_allclose(found, np.stack([3.0 * x - y, x * y], axis=1), atol=1e-12)
    table[1, 1] = np.nan  # one corner unknown: the others stand in
    found = grids.between(grid, np.where(np.isnan(table), np.nan, 7.0), x, y)
    np.testing.assert_allclose(found, 7.0, rtol=1e-15)
    assert np.isnan(grids.between(grid, np.full((3, 4, 1), np.nan), x, y)).all()


def test_sums_against_a_plain_loop() -> None:
    x, y, radius = cloud(800)
    grid = grids.cover(SIZE, x, y, radius)
    assert grid.x[0] <= (x - radius).min() and grid.x[-1] >= (x + radius).max() and (grid.x % SIZE == 0.0).all()
    for reach in (1.0, 1.5):
        found = grids.sums(grid, x, y, {"u": radius}, reach, moments=True)
        for j in range(0, grid.ny, 3):
            for i in range(0, grid.nx, 4):
                dx, dy = (x - grid.x[i]) / SIZE, (y - grid.y[j]) / SIZE
                near = np.hypot(dx, dy) < reach
                assert found["number"][j, i] == near.sum()
                assert found["u y"][j, i] == pytest.approx((radius * dy)[near].sum(), abs=1e-9)
                assert found["xy"][j, i] == pytest.approx((dx * dy)[near].sum(), abs=1e-12)


def test_shared_columns_have_the_same_bits() -> None:
    x, y, radius = cloud(5000)
    grid = grids.cover(SIZE, x, y, radius)
    whole = grids.sums(grid, x, y, {"u": np.sin(x)}, 1.5, moments=True)
    cuts = [0, 1, 7, 7, 20, grid.nx]
    parts = [grids.sums(grid, x, y, {"u": np.sin(x)}, 1.5, moments=True, columns=(a, b)) for a, b in pairwise(cuts)]
    for name, values in whole.items():
        np.testing.assert_array_equal(np.concatenate([p[name] for p in parts], axis=1), values)


def test_a_grid_beyond_all_measure_is_refused() -> None:
    with pytest.raises(HpcdemError, match="choose a larger one with -g"):
        grids.cover(0.1, np.array([0.0, 1e9]), np.array([0.0, 1e4]), np.ones(2))


def test_a_mean_volume_keeps_what_the_formula_says() -> None:
    """A uniform change exactly, also at the edges; of a wave of length L the part exp(-2 (pi s / L)^2)."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0.0, 8000.0, 60000), rng.uniform(0.0, 2000.0, 60000)
    grid = grids.cover(100.0, x, y, np.full(len(x), 50.0))
    weight = rng.uniform(1.0, 3.0, len(x))
    flat = strain.mean_volume(grid, x, y, weight, np.full(len(x), -3.0), 160.0)
    assert flat[np.isfinite(flat)] == pytest.approx(-3.0, rel=1e-12) and np.isfinite(flat).mean() > 0.9
    for length in (800.0, 1600.0):
        wave = strain.mean_volume(grid, x, y, weight, 5.0 * np.sin(2.0 * np.pi * x / length), 160.0)
        inner = wave[5:-5, 10:-10]
        phase = np.sin(2.0 * np.pi * grid.x / length)[None, 10:-10] + 0.0 * inner
        kept = float((inner * phase).sum() / (phase * phase).sum()) / 5.0
        assert kept == pytest.approx(np.exp(-2.0 * (np.pi * 160.0 / length) ** 2), abs=0.03)


@pytest.mark.parametrize("degrees", [25.0, -60.0])
def test_what_the_pages_call_volumetric_strain_grows_by_rotation(degrees: float) -> None:
    """A rigid rotation by a: 4 (1 - cos a), 37 % for 25 degrees; its volumetric strain is zero."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0.0, 1000.0, (2, 300))
    a = np.radians(degrees)
    u = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ [x, y] - [x, y]
    found = strain.page_volume(1e6, x + u[0], y + u[1], *u)
    assert found == pytest.approx(400.0 * (1.0 - np.cos(a)), rel=1e-9)
    assert strain.volumetric(strain.nearest(1e6, x, y, *u)) == pytest.approx(0.0, abs=1e-9)
