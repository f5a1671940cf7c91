"""V3, V4: linear impact of two balls."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties
from tests.cases.linear_impact import exact
from tests.support import body, crossing, model, only, value, watch

ETA = 3e8


def impact(folder, dt: float, eta: float, seconds: float = 0.4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], way of ball 2 since it touched [m], its velocity [m/s]."""
    sim = model(folder, dt=dt, disk="hex", lsm=eta)
    particles.ball(sim, 1, 0.0, 0.0, exact.RADIUS)
    particles.ball(sim, 2, 0.0, 2.0 * exact.RADIUS, exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, kn=exact.KN)
    properties.prop(sim, only(2), yv=-exact.V0)
    properties.fix(sim, ("x", "y", "spin"), only(1))
    properties.fix(sim, ("spin",), only(2))
    n = round(seconds / dt)
    seen = watch(sim, n, lambda sim: (value(sim, "y", 2) - 2.0 * exact.RADIUS, value(sim, "vy", 2)))
    assert body(sim, 2)[0] == pytest.approx(2.16506e7, rel=2e-6)
    return np.arange(n + 1) * dt, seen[:, 0], seen[:, 1]


def test_v3_undamped(tmp_path):
    t, x, v = impact(tmp_path, 1e-3, 0.0)
    assert crossing(t, x) == pytest.approx(0.197108, rel=0.01)
    assert -x.min() == pytest.approx(6.2741e-3, rel=0.01)
    assert v[-1] == pytest.approx(0.1, rel=0.005)
    expected = exact.Exact(0.0)
    assert exact.W == pytest.approx(15.93845, rel=1e-6)
    assert (expected.contact_time, expected.deepest) == pytest.approx((0.197108, 6.2741e-3), rel=1e-5)


def test_v4_lattice_solid_damping(tmp_path):
    """The figures are those of the continuous law; the program comes to 1 % of all of them at dt = 1e-4 (see the
    next test for dt = 1e-3)."""
    t, x, v = impact(tmp_path, 1e-4, ETA)
    expected = exact.Exact(ETA)
    ends = crossing(t, x)
    k = round(ends / 1e-4)
    assert expected.wd == pytest.approx(14.35389, rel=1e-6)
    assert (ends, expected.contact_time) == pytest.approx((0.218867, 0.218867), rel=0.01)
    assert (-x.min(), expected.deepest) == pytest.approx((3.6521e-3, 3.6521e-3), rel=0.01)
    assert (t[x.argmin()], expected.deepest_at) == pytest.approx((0.078105, 0.078105), rel=0.01)
    assert (v[k], expected.exit_speed) == pytest.approx((0.021951, 0.021951), rel=0.01)
    assert (x[-1], expected.way(0.4)) == pytest.approx((1.45542e-3, 1.45542e-3), rel=0.01)
    limit = x[-1] + v[-1] / (2.0 * expected.b)  # x + v m / eta stays what it is once the balls are apart
    assert limit == pytest.approx(1.58418e-3, rel=0.01)


@pytest.mark.parametrize("eta", [0.0, ETA])
def test_every_step_is_that_of_the_scheme(tmp_path, eta):
    dt = 1e-3
    t, x, _ = impact(tmp_path, dt, eta, 0.25)
    touching = np.arange(int(np.flatnonzero(x[1:] > 0.0)[0]) + 2)
    assert x[touching] == pytest.approx(exact.by_steps(touching, eta, dt), abs=1e-11 * exact.V0)


@pytest.mark.parametrize(("eta", "order"), [(0.0, 2), (ETA, 1)])
def test_order_of_accuracy(tmp_path, eta, order):
    """Largest overlap, from a parabola through the three lowest points, at dt and dt / 4."""
    errors = []
    for dt in (2e-3, 5e-4):
        _, x, _ = impact(tmp_path, dt, eta, 0.13)
        k = x.argmin()
        left, middle, right = x[k - 1 : k + 2]
        lowest = middle - (left - right) ** 2 / (8.0 * (left - 2.0 * middle + right))
        errors.append(abs(-lowest - exact.Exact(eta).deepest))
    assert np.log(errors[0] / errors[1]) / np.log(4.0) == pytest.approx(order, abs=0.1)
