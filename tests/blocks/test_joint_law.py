"""The cohesive law: areas under its curves are the fracture energies, peaks are the strengths (specified values)."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy

from hpcdem.numerics.lanes import CAPACITY, U
from hpcdem.physics.fdem.joints import tables as joint_tables
from hpcdem.physics.fdem.kernels import elements, joint_law, joints, softening
from hpcdem.physics.fdem.properties import COHESIVE, Rows

H = 2e-3
VALUES = {
    "friction": 30.0, "cohesion": 10e6, "tensile_strength": 2e6, "gf1": 50.0, "gf2": 500.0, "penalty_normal": 3e11,
}  # fmt: skip


def edge(*args) -> tuple[float, float, float, float, int]:
    """Forces and state of a joint behind its peak, as the step computes them: corners, law, beyond, history, state."""
    *corners, table, beyond, history, state = args
    forces, states = edges(np.array([corners]), table, beyond, history[None], np.array([state], np.uint8))
    return (*forces[0].tolist(), int(states[0]))


def edges(corners, table, beyond, histories, states) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, 4) and states of joints between the corners (n, 8), which remember more."""
    n = len(corners)
    lanes, slot, own = softening.lanes_and_lists()
    slot[:n], own[:n] = np.arange(n), 8 * np.arange(n)
    kind, flat = np.zeros(n, np.int32), histories.reshape(-1)
    partner = (8 * np.arange(n) + 4).astype(np.int32)
    before = states.copy()
    broken = softening.yielded_edges(
        n, slot, own, corners.reshape(-1), partner, kind, states, table, beyond, flat, lanes
    )  # fmt: skip
    assert sorted(own[:broken]) == np.flatnonzero(states != before).tolist()
    lines = lanes.reshape(softening.LANES, CAPACITY)[softening.FAX // U(CAPACITY) :, :n]
    return lines[:4].T.copy(), states


def intact_edge(*args) -> tuple[float, float, float, float, float]:
    """Forces of a joint before its peak, and how much is left to it, as the step computes them: corners, law."""
    *corners, table = args
    lanes = np.zeros(elements.LANES * CAPACITY)
    firsts = (elements.X1, elements.Y1, elements.X2, elements.Y2, elements.PX, elements.PY, elements.QX, elements.QY)
    lanes[list(firsts)] = corners
    lanes[[int(elements.KOP) + k * CAPACITY for k in range(8)]] = table
    elements._edge_loop_0(1, lanes)
    out = [lanes[int(elements.A0) + k * CAPACITY] for k in range(4)]
    return (*out, lanes[elements.LEFT0])


def law(**changes: float) -> tuple[np.ndarray, np.ndarray]:
    rows = Rows()
    row = rows.row(COHESIVE, COHESIVE.complete({**VALUES, **changes}))
    table, beyond = joint_tables(rows)
    return table[row], beyond[row]


def pull(path: np.ndarray, **changes: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Drive a joint of length H from (0, 0) to (H, 0) along (opening, slip) (n, 2); the normal points down, so the
    other side moves down to open. Returns mean normal stress, shear stress, state."""
    table, beyond = law(**changes)
    history, state = np.zeros(joint_law.HISTORY), joints.INTACT
    out = np.empty((len(path), 3))
    for i, (o, s) in enumerate(path.tolist()):
        # This side's edge runs from a = (0, 0) to b = (H, 0); p of the other side faces b, q faces a.
        corners = (0.0, 0.0, H, 0.0, H + s, -o, s, -o)
        if state == joints.INTACT:
            fax, fay, fbx, fby, left = intact_edge(*corners, table)
            state = joints.YIELDED if left < 0.0 else joints.INTACT
        if state != joints.INTACT:
            fax, fay, fbx, fby, state = edge(*corners, table, beyond, history, state)
        out[i] = -(fay + fby) / H, (fax + fbx) / H, state
    return out.T


def area_under(y: np.ndarray, x: np.ndarray) -> float:
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def test_softening_has_the_specified_values():
    """f(1/4), f(1/2), f(3/4) as specified, f(0) = 1, f(1) = 0, and its integral."""
    for d, value in ((0.0, 1.0), (0.25, 0.587842), (0.5, 0.304138), (0.75, 0.150054), (1.0, 0.0)):
        assert joint_law.softening(d) == pytest.approx(value, abs=5e-7)
    assert scipy.integrate.quad(joint_law.softening, 0.0, 1.0, epsabs=1e-12)[0] == pytest.approx(
        joint_law.SOFTENING_AREA, abs=1e-10
    )


def test_mode_1_area_is_the_fracture_energy():
    """Peak T at o_p = 2 h T / P = 2.6667e-8 m; area beyond it G_f1, before it (2/3) o_p T: in all 50.035556 J/m2."""
    o_p, o_t = 2.0 * H * 2e6 / 3e11, 50.0 / (joint_law.SOFTENING_AREA * 2e6)
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
    s_p, s_t = 2.0 * H * tau_p / 3e11, 500.0 / (joint_law.SOFTENING_AREA * 10e6)
    s = np.concatenate([np.linspace(0.0, s_p, 2001), s_p + np.linspace(0.0, s_t, 20001)[1:]])
    sigma, tau, state = pull(np.column_stack([0.0 * s - pressed, s]))
    assert sigma == pytest.approx(-5e6, rel=1e-9)
    assert tau.max() == pytest.approx(tau_p, rel=1e-6)
    above = tau[2000:] - 5e6 * math.tan(math.radians(30.0))
    assert area_under(above, s[2000:]) == pytest.approx(500.0, rel=1e-3)
    assert tau[-1] == pytest.approx(5e6 * math.tan(math.radians(30.0)), rel=1e-6)  # friction stays


@pytest.mark.parametrize("back", [0.0, 0.5])
def test_unloading_follows_the_line_through_the_origin(back):
    o_t = 50.0 / (joint_law.SOFTENING_AREA * 2e6)
    there = np.linspace(0.0, 0.3 * o_t, 3001)
    turn = np.linspace(there[-1], back * there[-1], 50)
    again = np.concatenate([there, turn, turn[::-1]])
    sigma, _, _ = pull(np.column_stack([again, 0.0 * again]))
    at_peak = sigma[3000]
    assert sigma[3001:] == pytest.approx(at_peak * again[3001:] / there[-1], rel=1e-9, abs=1e-3)


def test_damage_of_proportional_loading_does_not_depend_on_the_path():
    """D = sqrt(((o - o_p) / o_t)^2 + ((|s| - s_p) / s_t)^2) at the end, in one stride or in a thousand."""
    ends = np.array([1e-5, 2e-5])
    results = [pull(np.linspace(0.0, 1.0, n)[:, None] * ends)[0][-1] for n in (11, 1001)]
    o_p, s_p = 2.0 * H * 2e6 / 3e11, 2.0 * H * 10e6 / 3e11
    o_t, s_t = 50.0 / (joint_law.SOFTENING_AREA * 2e6), 500.0 / (joint_law.SOFTENING_AREA * 10e6)
    d = math.hypot((ends[0] - o_p) / o_t, (ends[1] - s_p) / s_t)
    assert results == pytest.approx([2e6 * joint_law.softening(d)] * 2, rel=1e-9)


def test_the_mode_is_that_of_the_parts_of_damage():
    for ends, mode in (((1e-4, 0.0), 1.0), ((0.0, 2e-4), 2.0)):
        table, beyond = law()
        history = np.zeros(joint_law.HISTORY)
        state = joints.YIELDED
        for t in np.linspace(0.0, 1.0, 1000):
            o, s = t * ends[0], t * ends[1]
            *_, state = edge(0.0, 0.0, H, 0.0, H + s, -o, s, -o, table, beyond, history, state)
        assert state == joints.BROKEN and history[joint_law.MODE] == mode


def random_joints(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 8) and histories of joints that open or overlap, and slip, about as far as they have been; the one
    before the last has never yielded, the last breaks."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, n, 2))
    widths = 10.0 ** rng.uniform(-8.0, -4.0, (2, n, 1))
    q, p = a + widths[0] * rng.normal(size=(n, 2)), b + widths[1] * rng.normal(size=(n, 2))
    histories = np.zeros((n, joint_law.HISTORY))
    histories[:, :6] = np.abs(rng.normal(size=(n, 6))) * np.repeat(widths[..., 0].T, 3, axis=1)
    histories[rng.random((n, joint_law.HISTORY)) < 0.3] = 0.0
    histories[:, 6:9] = np.clip(rng.uniform(-0.3, 0.9, (n, 3)), 0.0, 1.0)
    histories[:, joint_law.PEAK_STEP] = 17.0
    histories[-2, :9], q[-2:], p[-2:] = 0.0, a[-2:], b[-2:]
    normal = (b[-1] - a[-1])[::-1] * (1.0, -1.0) / np.hypot(*(b[-1] - a[-1]))
    q[-1] += 1e-3 * normal
    p[-1] += 1e-3 * normal
    return np.column_stack([a, b, p, q]), histories


def test_both_sides_get_opposite_forces_bit_for_bit():
    """Random positions of two edges: the partner's forces are the same numbers with the other sign."""
    table, beyond = law()
    corners, here = random_joints(150, 3)
    there = here.copy()
    for first in (0, 3, 6):
        there[:, first : first + 3] = here[:, first : first + 3][:, ::-1]
    states = np.full((2, len(here)), joints.YIELDED, np.uint8)
    mine, _ = edges(corners, table, beyond, here, states[0])
    theirs, _ = edges(corners[:, [4, 5, 6, 7, 0, 1, 2, 3]].copy(), table, beyond, there, states[1])
    assert (
        (mine[:, :2] == -theirs[:, 2:]).all() and (mine[:, 2:] == -theirs[:, :2]).all() and mine.any(axis=1).sum() > 100
    )
    assert (states[0] == states[1]).all() and states[0, -1] == joints.BROKEN
    for first in (0, 3, 6):
        assert (here[:, first : first + 3] == there[:, first : first + 3][:, ::-1]).all()
    assert (here[:, 9:] == there[:, 9:]).all()
    for one in corners:
        mine, theirs = intact_edge(*one, table), intact_edge(*one[4:], *one[:4], table)
        assert mine[:2] == (-theirs[2], -theirs[3]) and mine[2:4] == (-theirs[0], -theirs[1]) and mine[4] == theirs[4]


@pytest.mark.parametrize("n", [2, 3, 4, 41, 200])
def test_the_place_in_the_lanes_changes_no_bit(n):
    """Joints together and one by one; and what is looked at afterwards (`joints.points_now`) is what the step had."""
    table, beyond = law()
    corners, together = random_joints(n, n)
    single, before = together.copy(), together.copy()
    states = np.full(n, joints.YIELDED, np.uint8)
    forces, states = edges(corners, table, beyond, together, states)
    for i in range(n):
        *found, state = edge(*corners[i], table, beyond, single[i], joints.YIELDED)
        assert found == forces[i].tolist() and state == states[i]
        assert joints.end_forces(*joints.points_now(*corners[i], table, beyond, before[i])) == tuple(found)
    assert (single == together).all() and (together[:, joint_law.PEAK_STEP] == 17.0).all()
    assert (together[:, :9] >= before[:, :9]).all() and (together[:, :9] > before[:, :9]).any()
    assert states[-2] == joints.YIELDED and states[-1] == joints.BROKEN and together[-1, joint_law.MODE] == 1.0
