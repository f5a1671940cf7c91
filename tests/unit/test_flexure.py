"""The plate on a fluid alone, compared with closed forms of Turcotte & Schubert, Geodynamics, ch. 3, and Hetenyi."""

import math

import numpy as np
import pytest

from hpcdem.physics.dem.flexure import CLAMPED, FREE, INFINITE, Plate, parameter, rigidity_of

D, K = 1e22, 3300.0 * 9.81
ALPHA = parameter(D, K)
V = 3e12


def plate(first=-6.0, last=6.0, n=480, left=INFINITE, right=INFINITE):
    return Plate(np.linspace(first * ALPHA, last * ALPHA, n + 1), D, K, left, right)


def line_load(one, at=0.0, force=V):
    loads = one.loads(np.array([at]), np.array([force]))
    return loads, one.solve(loads)


def test_rigidity_and_parameter():
    assert rigidity_of(70e9, 0.25, 25e3) == pytest.approx(9.72e22, rel=1e-3)
    assert parameter(1e23, 3300.0 * 9.8) ** 4 == pytest.approx(4e23 / (3300.0 * 9.8))


@pytest.mark.parametrize("ends", [INFINITE, FREE, CLAMPED])
def test_line_load_on_an_infinite_plate(ends):
    """w = w0 exp(-x/alpha) (cos x/alpha + sin x/alpha), w0 = V alpha^3 / (8 D); far ends of any kind do not matter."""
    one = plate(-12.0, 12.0, 960, ends, ends)
    loads, shape = line_load(one)
    w0, s = V * ALPHA**3 / (8.0 * D), np.abs(one.x) / ALPHA
    np.testing.assert_allclose(shape[:, 0], w0 * np.exp(-s) * (np.cos(s) + np.sin(s)), atol=2e-5 * w0)
    moment = V * ALPHA / 4.0 * np.exp(-s) * (np.cos(s) - np.sin(s))
    np.testing.assert_allclose(one.moment(shape, loads), moment, atol=1e-4 * V * ALPHA)
    bulge = int(np.argmin(shape[:, 0]))
    assert abs(abs(one.x[bulge]) - math.pi * ALPHA) <= ALPHA / 40.0
    assert shape[bulge, 0] == pytest.approx(-0.0432 * w0, rel=2e-3)


def test_infinite_ends_are_exact_near_the_load():
    short, long = plate(-0.5, 0.5, 40), plate(-10.0, 10.0, 800)
    expected, found = line_load(long)[1][380:421], line_load(short)[1]
    assert (np.abs(found - expected) <= 1e-6 * np.abs(expected).max(axis=0)).all()


@pytest.mark.parametrize("mirrored", [False, True])
def test_broken_plate(mirrored):
    """Each half of a plate that is broken under V carries V / 2 on its free end: w0 = V alpha^3 / (4 D), the forebulge
    is at 3 pi / 4 alpha and 0.0670 w0 high."""
    one = plate(-8.0, 0.0, 640, INFINITE, FREE) if mirrored else plate(0.0, 8.0, 640, FREE, INFINITE)
    loads, shape = line_load(one, force=V / 2.0)
    w0, s = V * ALPHA**3 / (4.0 * D), np.abs(one.x) / ALPHA
    np.testing.assert_allclose(shape[:, 0], w0 * np.exp(-s) * np.cos(s), atol=2e-5 * w0)
    bulge = int(np.argmin(shape[:, 0]))
    assert abs(abs(one.x[bulge]) - 0.75 * math.pi * ALPHA) <= ALPHA / 40.0
    assert shape[bulge, 0] == pytest.approx(-0.0670 * w0, rel=2e-3)
    assert one.moment(shape, loads)[-1 if mirrored else 0] == pytest.approx(0.0, abs=1e-5 * V * ALPHA)


@pytest.mark.parametrize("wavelengths", [2.0, 6.0, 20.0])
def test_periodic_load(wavelengths):
    """q = q0 sin(2 pi x / lambda): w = q0 / (k + D (2 pi / lambda)^4), in the middle of many waves."""
    length = wavelengths * ALPHA
    one = Plate(np.linspace(0.0, 24.0 * length, 2401), D, K, FREE, FREE)
    middle = 0.5 * (one.x[1:] + one.x[:-1])
    x = (middle[:, None] + 0.5 * np.diff(one.x)[:, None] * np.array([-1.0, 1.0]) / math.sqrt(3.0)).ravel()
    q = 1e6 * np.sin(2.0 * math.pi * x / length)
    shape = one.solve(one.loads(x, q * np.repeat(np.diff(one.x), 2) / 2.0))
    inside = slice(1000, 1401)
    expected = 1e6 / (K + D * (2.0 * math.pi / length) ** 4) * np.sin(2.0 * math.pi * one.x / length)
    np.testing.assert_allclose(shape[inside, 0], expected[inside], atol=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("width", [0.3, 2.0, 9.0])
def test_uniform_load_over_a_width(width):
    """Hetenyi: under a load from -a to b, w = q / (2 k) (2 - exp(-a') cos a' - exp(-b') cos b'), a' = a / alpha."""
    one = plate(-12.0, 12.0, 961)
    q, half = 2e7, 0.5 * width * ALPHA
    shape = one.solve(one.uniform(-half, half, q))

    def part(distance):
        s = np.abs(distance) / ALPHA
        return np.sign(distance) * (1.0 - np.exp(-s) * np.cos(s))

    expected = q / (2.0 * K) * (part(one.x + half) - part(one.x - half))
    np.testing.assert_allclose(shape[:, 0], expected, atol=1e-5 * np.abs(expected).max())


def test_the_fluid_carries_the_load():
    for left, right in ((INFINITE, INFINITE), (FREE, INFINITE), (FREE, FREE)):
        one = plate(-0.4, 1.1, 37, left, right)
        loads = one.uniform(-0.3 * ALPHA, 0.5 * ALPHA, 1e7) + one.loads(np.array([0.71]) * ALPHA, np.array([V]))
        force = 0.8 * ALPHA * 1e7 + V
        assert loads[:, [0, 2]].sum() == pytest.approx(force)
        assert one.buoyancy(one.solve(loads)) == pytest.approx(force, rel=1e-7)


def test_a_load_of_the_whole_plate_is_that_of_airy():
    one = plate(0.0, 3.0, 50, FREE, FREE)
    loads = one.uniform(one.x[0], one.x[-1], 1e7)
    np.testing.assert_allclose(one.solve(loads)[:, 0], 1e7 / K)
    np.testing.assert_allclose(one.pressure(loads), 1e7)


def test_clamped_ends_keep_their_place():
    shape = line_load(plate(-1.0, 2.0, 60, CLAMPED, CLAMPED), 0.4 * ALPHA)[1]
    assert (shape[[0, -1]] == 0.0).all()
    assert (shape[1:-1, 0] > 0.0).all()


def test_nodes_at_any_distance():
    fine = plate(-3.0, 3.0, 600)
    uneven = Plate(np.unique(np.concatenate([fine.x[::50], fine.x[200:400:3]])), D, K, INFINITE, INFINITE)
    expected = fine.deflection(line_load(fine, 0.2 * ALPHA)[1], uneven.x)
    found = line_load(uneven, 0.2 * ALPHA)[1]
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-3 * expected.max())
    middle = 0.5 * (uneven.x[1:] + uneven.x[:-1])
    expected = fine.deflection(line_load(fine, 0.2 * ALPHA)[1], middle)
    np.testing.assert_allclose(uneven.deflection(found, middle), expected, atol=1e-3 * expected.max())


def test_loads_beyond_an_end_act_on_it():
    one = plate(0.0, 1.0, 10, FREE, FREE)
    beyond, at_end = (one.loads(np.array([x]), np.array([V])) for x in (2.0 * ALPHA, ALPHA))
    assert (beyond == at_end).all()
    assert at_end[-1].tolist() == [0.0, 0.0, V, 0.0]
