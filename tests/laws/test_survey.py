"""What a look at all discs says, against closed forms of one, two and three of them."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, particles, properties, settings, walls
from hpcdem.core.cells import COLUMN
from hpcdem.core.fields import RADIUS, VX, VY, WIDTH, X, Y
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.kernels import fast, laws, slips
from hpcdem.physics.dem.kernels.histories import Histories
from hpcdem.physics.dem.simulation import Simulation
from tests.support import body, model, only

KN, KS = 2e6, 3e6


def pair(folder: Path, gravity: tuple[float, float] = (0.0, 0.0), overlap: float = 0.1, **fixed: Any) -> Simulation:
    """Discs of radius 1 and 0.5 m side by side, which overlap."""
    sim = model(folder, disk="on", gravity=gravity)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    particles.ball(sim, 1, 1.5 - overlap, 0.0, 0.5)
    properties.prop(sim, density=1000.0, kn=KN, ks=KS, fric=0.5)
    for name, gid in fixed.items():
        properties.fix(sim, (name,), only(gid))
    cycles.prepare(sim)
    sim.step()
    return sim


def test_kinetic_energy_of_motion_and_of_spin(tmp_path: Path) -> None:
    sim = pair(tmp_path)
    p = sim.particles
    p["vx"][:], p["vy"][:], p["spin"][:] = (3.0, -1.0), (4.0, 2.0), (5.0, -7.0)
    expected = 0.0
    for gid, v2, w in ((0, 25.0, 5.0), (1, 5.0, 7.0)):
        m, inertia = body(sim, gid)
        assert inertia == pytest.approx(0.5 * m * (1.0, 0.5)[gid] ** 2)
        expected += 0.5 * m * v2 + 0.5 * inertia * w * w
    assert diagnostics.kinetic_energy(sim) == pytest.approx(expected, rel=1e-14)
    assert diagnostics.survey(sim).kinetic == diagnostics.kinetic_energy(sim)


def test_the_unbalanced_force_is_that_of_free_directions(tmp_path: Path) -> None:
    """The force of the one contact stands for the mean; weights count, but not along what is fixed."""
    (tmp_path / "a").mkdir()
    sim = pair(tmp_path / "a")
    seen = diagnostics.survey(sim)
    assert seen.unbalanced == pytest.approx(1.0, rel=1e-12) and (seen.particles, seen.contacts) == (2, 1)
    assert seen.deepest == pytest.approx(0.1 / 0.5, rel=1e-2)
    assert seen.critical_dt == pytest.approx(0.8 * math.sqrt(body(sim, 1)[0] / max(KN, KS) * 2.0), rel=1e-6)
    (tmp_path / "b").mkdir()
    sim = pair(tmp_path / "b", gravity=(30.0, -9.8), x=0, y=1)
    (fn,) = np.abs(sim.lists.owned_forces()[:1, 0])
    weights = [body(sim, gid)[0] for gid in (0, 1)]
    free = max(9.8 * weights[0], fn + 30.0 * weights[1])  # y of the first, x of the second
    assert diagnostics.survey(sim).unbalanced == pytest.approx(free / fn, rel=1e-6)
    for gid in (0, 1):
        properties.fix(sim, ("x", "y"), only(gid))
    assert diagnostics.survey(sim).unbalanced == 0.0 and diagnostics.survey(sim).critical_dt == math.inf


def test_a_bond_is_as_stiff_as_its_length_makes_it(tmp_path: Path) -> None:
    """E A / L, L from centre to centre, of an open bond that is stiffer than the contact."""
    sim = pair(tmp_path, overlap=-1e-4)
    bonds.bond(sim, ebmod=1e9, gbmod=1e8, tstrength=1e9, sstrength=1e9, tolerate=1e-3)
    cycles.prepare(sim)
    sim.step()
    area = laws.pair_geometry(1.5, 0.0, 1.0, 0.5)[4]
    expected = 0.8 * math.sqrt(body(sim, 1)[0] / (1e9 * area / 1.5))
    assert diagnostics.survey(sim).critical_dt == pytest.approx(expected, rel=1e-3)


def test_what_breaks_a_contact_bond_is_the_force_that_was_given(tmp_path: Path) -> None:
    """Of an elastic bond it is the strength times 2 Rt."""
    sim = pair(tmp_path, overlap=-1e-4)
    for given, area in (
        ({"n_bond": 7.0, "s_bond": 5.0}, 1.0),
        ({"ebmod": 1e9, "tstrength": 7.0, "sstrength": 5.0}, 4.0 / 3.0),
    ):
        bonds.bond(sim, tolerate=1e-3, **given)
        cycles.prepare(sim)
        columns = diagnostics.frame(sim).tables["bonds"].columns
        assert columns["law_tension"] == pytest.approx([7.0 * area], rel=1e-3)
        assert columns["law_shear"] == pytest.approx([5.0 * area], rel=1e-3)


def test_the_highest_frequency_of_a_pair(tmp_path: Path) -> None:
    """Shear and turning of both: k_s (1 / m + a^2 / I) of each, two springs in series. A third one is far away."""
    sim = pair(tmp_path)
    particles.ball(sim, 2, 9.0, 9.0, 0.5)
    properties.prop(sim, only(2), density=1000.0, kn=KN, ks=KS)
    cycles.prepare(sim)
    sim.step()
    arms = [1.0 - 0.05, 0.5 - 0.05]
    freedom = sum(1.0 / m + a * a / i for a, (m, i) in zip(arms, (body(sim, 0), body(sim, 1)), strict=True))
    assert diagnostics.highest_frequency(sim) == pytest.approx(math.sqrt(0.5 * KS * freedom), rel=1e-3)


def test_discs_in_one_place_have_a_normal() -> None:
    assert laws.pair_geometry(0.0, 0.0, 1.0, 0.5)[:4] == (0.0, 1.0, 0.0, 1.5)


def test_who_crosses_a_wall_that_is_not_steep() -> None:
    hot, out = np.zeros((1, 8)), np.zeros(1, np.int8)
    hot[0, [X, Y]] = 1.0, 0.8
    none, ends, still = np.zeros(1, np.int64), np.array([[0.0, 0.0, 2.0, 1.0]]), np.zeros((1, 2))
    slips._through_walls(none, none, hot, np.array([[1.0, 0.6]]), ends, still, 0, out)
    assert out[0] == 0
    slips._through_walls(none, none, hot, np.array([[1.0, 0.2]]), ends, still, 0, out)
    assert out[0] == slips.WALL


@pytest.mark.parametrize("broken", [(0, np.inf), (2, np.inf), (3, np.nan)])
def test_a_fast_disc_that_is_not_finite_is_reported(broken: tuple[int, float]) -> None:
    """Its place or its speed alone is enough."""
    hot, out = np.zeros((1, 8)), np.zeros(4)
    hot[0, 2:5] = 1.0
    look = (0, np.zeros((1, 2)), np.array([0]), np.array([5.0]), np.array([True]), 0.1, 0.0, (-9.0, 9.0, -9.0, 9.0))
    fast.survey(hot, *look, out)
    assert out[fast.FAST_BROKEN] == 0.0
    hot[0, {0: X, 2: VX, 3: VY}[broken[0]]] = broken[1]
    fast.survey(hot, *look, out)
    assert out[fast.FAST_BROKEN] == 1.0


def test_no_memory_has_a_beginning_for_each_particle_and_an_end() -> None:
    assert Histories.empty(3).ptr.tolist() == [0, 0, 0, 0] and len(Histories.empty(3).rows) == 0


@pytest.mark.parametrize(("mu", "turn"), [(0.0, 0.0), (0.0, 0.7), (0.5, 0.7), (0.5, 0.0)])
def test_the_highest_frequency_of_a_disc_on_a_wall(tmp_path: Path, mu: float, turn: float) -> None:
    """The wall lies, or is turned by 40 degrees. Along the normal k_n / m, along the wall k_s (1 / m + a^2 / I) with
    friction; two springs in series each."""
    sim = model(tmp_path, disk="on")
    c, s = math.cos(turn), math.sin(turn)
    particles.ball(sim, 0, -0.48 * s, 0.48 * c, 0.5)
    properties.prop(sim, density=1000.0, kn=KN, ks=KS, fric=mu)
    walls.wall(sim, 1, ((-3.0 * c, -3.0 * s), (3.0 * c, 3.0 * s)), kn=KN, ks=KS, fric=mu)
    settings.set_option(sim, "dt", 1e-9)
    cycles.prepare(sim)
    sim.step()
    m, inertia = body(sim)
    arm = 0.5 - 0.5 * 0.02
    normal, shear = 0.5 * KN / m, 0.5 * KS * (1.0 / m + arm * arm / inertia)
    expected = shear if mu else normal
    assert diagnostics.highest_frequency(sim) == pytest.approx(math.sqrt(expected), rel=1e-3)


def test_a_point_that_crosses_a_segment() -> None:
    """Against exact arithmetic, in the frame of the segment, which moves along; and a still point that a turning
    segment runs over, or does not reach."""
    crosses = getattr(slips._crosses, "py_func", slips._crosses)
    rng = np.random.default_rng(3)
    seen = 0
    for _ in range(300):
        p, q, point, way, gone = rng.uniform(-1.0, 1.0, (5, 2))
        before = point - gone + way  # where the point was, seen from the segment as it is now
        edge, a, b = ([Fraction(float(v)) for v in values] for values in (q - p, before - p, point - p))

        def side(v: list[Fraction], edge: list[Fraction] = edge) -> Fraction:
            return edge[0] * v[1] - edge[1] * v[0]

        expected = False
        if side(a) * side(b) < 0:
            part = side(a) / (side(a) - side(b))
            at = [s + part * (e - s) for s, e in zip(a, b, strict=True)]
            expected = 0 <= at[0] * edge[0] + at[1] * edge[1] <= edge[0] ** 2 + edge[1] ** 2
        assert crosses(*p, *q, *point, tuple(way), tuple(way), tuple(gone)) == expected
        seen += expected
    assert 20 < seen < 200
    still, turned = (0.0, 0.0), (1.0, -1.0)  # the far end has come from (0, 1) to (1, 0), the near one stays at (0, 0)
    for x, y, expected in ((0.5, 0.2, True), (1.2, 0.2, False), (0.5, -0.2, False)):
        assert crosses(0.0, 0.0, 1.0, 0.0, x, y, still, turned, still) == expected, (x, y)


def test_pairs_of_fast_discs_are_those_that_trying_all_finds() -> None:
    """Each once, also of two fast ones; members of one clump are no pair."""
    rng = np.random.default_rng(3)
    n = 60
    x, y = rng.uniform(0.0, 8.0, (2, n))
    cell = x.astype(np.int64) * COLUMN + y.astype(np.int64)
    order = np.argsort(cell, kind="stable")
    hot, cell = np.zeros((n, WIDTH)), cell[order]
    hot[:, X], hot[:, Y], hot[:, RADIUS] = x[order], y[order], rng.uniform(0.05, 0.2, n)
    rows, clump = np.arange(2, n, 5), rng.integers(-1, 4, n)
    reach = np.full(n, 0.1)
    reach[rows] = rng.uniform(0.2, 0.7, len(rows))
    expected = []
    for i in range(n):
        for j in range(i + 1, n):
            near = math.dist(hot[i, :2], hot[j, :2]) <= hot[i, RADIUS] + hot[j, RADIUS] + reach[i] + reach[j]
            if near and (i in rows or j in rows) and not 0 <= clump[i] == clump[j]:
                expected.append((i << 32) + j)
    found = fast.pairs(hot, cell, rows, reach[rows], 0.1, 2, clump)
    assert found.tolist() == expected
    both = [pair for pair in expected if pair >> 32 in rows and pair % (1 << 32) in rows]
    assert both and len(expected) > 2 * len(both)
    assert len(fast.pairs(hot, cell, rows, reach[rows], 0.1, 2, np.empty(0, np.int64))) > len(expected)
