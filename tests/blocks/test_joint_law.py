"""The cohesive law: areas under its curves are the fracture energies, peaks are the strengths (specified values)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from hpcdem.physics.fdem.kernels import joints, laws
from hpcdem.physics.fdem.local import joint_tables
from hpcdem.physics.fdem.properties import COHESIVE, Rows

H = 2e-3
VALUES = {
    "friction": 30.0, "cohesion": 10e6, "tensile_strength": 2e6, "gf1": 50.0, "gf2": 500.0, "penalty_normal": 3e11,
}  # fmt: skip


def edge(*args) -> tuple[float, float, float, float, int]:
    """`joints.yielded_edge` with rows instead of tables: corners, law, beyond, history (12,), state."""
    *corners, table, beyond, history, state = args
    return joints.yielded_edge(*corners, table[None], beyond[None], 0, history[None], 0, state)


def law(**changes: float) -> tuple[np.ndarray, np.ndarray]:
    rows = Rows()
    row = rows.row(COHESIVE, COHESIVE.complete({**VALUES, **changes}))
    table, beyond = joint_tables(rows)
    return table[row], beyond[row]


def pull(path: np.ndarray, **changes: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Drive a joint of length H from (0, 0) to (H, 0) along (opening, slip) (n, 2); the normal points down, so the
    other side moves down to open. Returns mean normal stress, shear stress, state."""
    table, beyond = law(**changes)
    history, state = np.zeros(joints.HISTORY), joints.INTACT
    out = np.empty((len(path), 3))
    for i, (o, s) in enumerate(path.tolist()):
        # This side's edge runs from a = (0, 0) to b = (H, 0); p of the other side faces b, q faces a.
        corners = (0.0, 0.0, H, 0.0, H + s, -o, s, -o)
        if state == joints.INTACT and joints.past_peak(*corners, table) < 0.0:
            state = joints.YIELDED
        fax, fay, fbx, fby, after = edge(*corners, table, beyond, history, state)
        if state == joints.INTACT:
            history[:] = 0.0
        else:
            state = after
        out[i] = -(fay + fby) / H, (fax + fbx) / H, state
    return out.T


def area_under(y: np.ndarray, x: np.ndarray) -> float:
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def test_softening_has_the_specified_values():
    """f(1/4), f(1/2), f(3/4) as specified, f(0) = 1, f(1) = 0, and its integral."""
    for d, value in ((0.0, 1.0), (0.25, 0.587842), (0.5, 0.304138), (0.75, 0.150054), (1.0, 0.0)):
        assert laws.softening(d) == pytest.approx(value, abs=5e-7)
    assert quad(laws.softening, 0.0, 1.0, epsabs=1e-12)[0] == pytest.approx(laws.SOFTENING_AREA, abs=1e-10)


def test_mode_1_area_is_the_fracture_energy():
    """Peak T at o_p = 2 h T / P = 2.6667e-8 m; area beyond it G_f1, before it (2/3) o_p T: in all 50.035556 J/m2."""
    o_p, o_t = 2.0 * H * 2e6 / 3e11, 50.0 / (laws.SOFTENING_AREA * 2e6)
    assert o_p == pytest.approx(2.6667e-8, rel=1e-4) and o_t == pytest.approx(6.47153e-5, rel=1e-5)
    o = np.concatenate([np.linspace(0.0, o_p, 2001), o_p + np.linspace(0.0, o_t, 20001)[1:], [o_p + 1.001 * o_t]])
    sigma, _, state = pull(np.column_stack([o, 0.0 * o]))
    assert sigma.max() == pytest.approx(2e6, rel=1e-6)
    before, total = area_under(sigma[:2001], o[:2001]), area_under(sigma, o)
    assert before == pytest.approx(2.0 / 3.0 * o_p * 2e6, rel=1e-5)
    assert total - before == pytest.approx(50.0, rel=1e-3)
    assert total == pytest.approx(50.035556, rel=1e-3)
    assert state[-1] == joints.BROKEN and state[1999] == joints.INTACT and sigma[-1] == 0.0


def test_mode_2_area_under_pressure_is_the_fracture_energy():
    """At sigma = -5 MPa the shear stress falls from c + 5 tan(30) to 5 tan(30) MPa; what lies above that is G_f2."""
    pressed = 5e6 * H / 3e11
    tau_p = 10e6 + 5e6 * math.tan(math.radians(30.0))
    s_p, s_t = 2.0 * H * tau_p / 3e11, 500.0 / (laws.SOFTENING_AREA * 10e6)
    s = np.concatenate([np.linspace(0.0, s_p, 2001), s_p + np.linspace(0.0, s_t, 20001)[1:]])
    sigma, tau, state = pull(np.column_stack([0.0 * s - pressed, s]))
    assert sigma == pytest.approx(-5e6, rel=1e-9)
    assert tau.max() == pytest.approx(tau_p, rel=1e-6)
    above = tau[2000:] - 5e6 * math.tan(math.radians(30.0))
    assert area_under(above, s[2000:]) == pytest.approx(500.0, rel=1e-3)
    assert tau[-1] == pytest.approx(5e6 * math.tan(math.radians(30.0)), rel=1e-6)  # friction stays


@pytest.mark.parametrize("back", [0.0, 0.5])
def test_unloading_follows_the_line_through_the_origin(back):
    o_t = 50.0 / (laws.SOFTENING_AREA * 2e6)
    there = np.linspace(0.0, 0.3 * o_t, 3001)
    turn = np.linspace(there[-1], back * there[-1], 50)
    again = np.concatenate([there, turn, turn[::-1]])
    sigma, _, _ = pull(np.column_stack([again, 0.0 * again]))
    at_peak = sigma[3000]
    assert sigma[3001:] == pytest.approx(at_peak * again[3001:] / there[-1], rel=1e-9, abs=1e-3)


def test_damage_of_proportional_loading_does_not_depend_on_the_way_there():
    """D = sqrt(((o - o_p) / o_t)^2 + ((|s| - s_p) / s_t)^2) at the end, in one stride or in a thousand."""
    ends = np.array([1e-5, 2e-5])
    results = [pull(np.linspace(0.0, 1.0, n)[:, None] * ends)[0][-1] for n in (11, 1001)]
    o_p, s_p = 2.0 * H * 2e6 / 3e11, 2.0 * H * 10e6 / 3e11
    o_t, s_t = 50.0 / (laws.SOFTENING_AREA * 2e6), 500.0 / (laws.SOFTENING_AREA * 10e6)
    d = math.hypot((ends[0] - o_p) / o_t, (ends[1] - s_p) / s_t)
    assert results == pytest.approx([2e6 * laws.softening(d)] * 2, rel=1e-9)


def test_the_mode_is_that_of_the_parts_of_damage():
    for ends, mode in (((1e-4, 0.0), 1.0), ((0.0, 2e-4), 2.0)):
        table, beyond = law()
        history = np.zeros(joints.HISTORY)
        state = joints.YIELDED
        for t in np.linspace(0.0, 1.0, 1000):
            o, s = t * ends[0], t * ends[1]
            *_, state = edge(0.0, 0.0, H, 0.0, H + s, -o, s, -o, table, beyond, history, state)
        assert state == joints.BROKEN and history[joints.MODE] == mode


def test_both_sides_get_opposite_forces_bit_for_bit():
    """Random positions of two edges: the partner's forces are the same numbers with the other sign."""
    table, beyond = law()
    rng = np.random.default_rng(3)
    for state in (joints.INTACT, joints.YIELDED):
        for _ in range(300):
            a, b = rng.normal(size=2), rng.normal(size=2)
            q, p = a + 1e-6 * rng.normal(size=2), b + 1e-6 * rng.normal(size=2)
            mine = np.abs(rng.normal(size=12)) * 1e-6
            mine[6:9] = rng.uniform(0.0, 0.9, 3)
            mine[9:] = 0.0
            hers = mine.copy()
            for first in (0, 3, 6):
                hers[first : first + 3] = mine[first : first + 3][::-1]
            if state == joints.INTACT:
                mine, hers = np.zeros(12), np.zeros(12)
            here = edge(*a, *b, *p, *q, table, beyond, mine, state)
            there = edge(*p, *q, *a, *b, table, beyond, hers, state)
            assert here[0:2] == (-there[2], -there[3]) and here[2:4] == (-there[0], -there[1])
            assert joints.past_peak(*a, *b, *p, *q, table) == joints.past_peak(*p, *q, *a, *b, table)
            for first in (0, 3, 6):
                assert (mine[first : first + 3] == hers[first : first + 3][::-1]).all()
