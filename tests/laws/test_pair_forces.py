"""The force loop against the laws taken pair by pair, and against itself cut into other blocks.

The loop works on a hundred pairs at a time in lanes; the reference (physics/dem/reference.py) is the plain sum over
all pairs of the list.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numba import njit

from hpcdem.commands.dem import bonds, cycles, particles, properties
from hpcdem.core.fields import MATERIAL
from hpcdem.core.selection import Interval
from hpcdem.numerics import lanes
from hpcdem.numerics.lanes import U
from hpcdem.physics.dem import reference
from hpcdem.physics.dem.simulation import Simulation
from tests import support

BONDS = {
    "none": (), "elastic": ("left",), "contact": ("right",), "both": ("left", "right"), "conserving": ("top", "right"),
}  # fmt: skip
HALVES = {"left": Interval("x", -9.0, 15.0), "right": Interval("x", 15.0, 99.0), "top": Interval("x", -9.0, 15.0)}
STRENGTHS = {
    "left": {"ebmod": 1e6, "gbmod": 1e6, "tstrength": 4e4, "sstrength": 5e4},
    "right": {"n_bond": 2e3, "s_bond": 4e4},
    "top": {"ebmod": 1e6, "gbmod": 3e6, "tstrength": 4e4, "sstrength": 5e4, "conserving": True},
}


def heap(folder: Path, law: str, bonded: str, threads: int = 1) -> Simulation:
    """Some thousand pairs that touch, nearly touch, are stretched, slide and turn; two materials, random histories."""
    sim = support.model(folder, dt=1e-3, disk="off", seed=4)
    sim.threads = threads
    particles.gen_grid(sim, [0.6], (0.6, 30.0), (0.6, 30.0))
    modulus = {"hertz": True, "shear": 1e6, "poiss": 0.25} if law == "hertz" else {"kn": 1e6, "ks": 7e5}
    properties.prop(sim, density=2000.0, damp=0.2, fric=0.3, **modulus)
    properties.prop(sim, Interval("x", 0.0, 20.0), fric=0.1)
    for half in BONDS[bonded]:
        bonds.bond(sim, HALVES[half], tolerate=0.1, **STRENGTHS[half])
    sim.open_model()
    p, rng = sim.particles, np.random.default_rng(7)
    for name, size in (("x", 0.035), ("y", 0.035), ("vx", 1.0), ("vy", 1.0), ("spin", 2.0)):
        p[name][:] += size * rng.uniform(-1.7, 1.7, len(p))[p["gid"]]
    cycles.prepare(sim)
    shear = 3e4 * rng.standard_normal((len(p), len(p)))
    gid, lists = p["gid"], sim.lists
    for t in range(lists.n_blocks):
        for k in slots(sim, t):
            lists.fs[k] = shear[tuple(sorted((gid[lists.row[k]], gid[lists.partner[k]])))]
    return sim


def slots(sim: Simulation, t: int) -> range:
    """Slots of a block."""
    lists, (cut, lo, _, poff, _) = sim.lists, sim.lists.blocks
    return range(lists.ptr[poff[t]], lists.ptr[poff[t] + max(cut[t + 1] - lo[t], 0)])


@pytest.mark.some_of_each
@pytest.mark.parametrize("bonded", BONDS)
@pytest.mark.parametrize("law", ["hertz", "linear"])
def test_against_the_laws_pair_by_pair(tmp_path: Path, law: str, bonded: str) -> None:
    """Same forces, histories, bonds and breaks to rounding; there is something of every kind to be seen."""
    sim = heap(tmp_path, law, bonded)
    lists, p, n_mat = sim.lists, sim.particles, len(sim.materials)
    used = np.array(slots(sim, 0))
    pairs = np.column_stack([lists.row[used], lists.partner[used]])
    force, fs, bond, broken = reference.pair_forces(
        p.hot, p.ihot[:, MATERIAL], pairs, lists.fs[used], lists.bond[used], lists.u_made[used],
        sim.pair_laws.reshape(n_mat, n_mat, 4), sim.bond_laws, True, sim.settings.dt,
    )  # fmt: skip
    assert len(used) > 5 * lanes.CAPACITY
    sim._forces()
    scale = np.abs(force).max()
    assert lists.owned_forces() == pytest.approx(force, rel=1e-11, abs=1e-12 * scale)
    assert lists.fs[used] == pytest.approx(fs, rel=1e-10, abs=1e-12 * scale)
    assert np.array_equal(lists.bond[used], bond)
    assert list(sim.uncollected_breaks()) == broken
    if bonded != "none":
        assert min(broken) > 0 and (bond > 0).sum() > 50
        d = lists.row[used], lists.partner[used]
        d2 = ((sim.particles.hot[d[0], :2] - sim.particles.hot[d[1], :2]) ** 2).sum(axis=1)
        was_bonded = (heap(tmp_path, law, bonded).lists.bond[used]) > 0
        assert lists.longest_bond2() == pytest.approx(d2[was_bonded].max(), rel=1e-14)


@pytest.mark.parametrize("bonded", BONDS)
def test_blocks_change_no_bit(tmp_path: Path, bonded: str) -> None:
    """Forces of one block equal those of 2, 3 and 7, although pairs are bundled differently."""
    one = heap(tmp_path, "hertz", bonded)
    one._forces()
    for blocks in (2, 3, 7):
        sim = heap(tmp_path, "hertz", bonded, threads=blocks)
        for t in range(blocks):
            sim_forces(sim, t)
        assert sim.lists.owned_forces().tobytes() == one.lists.owned_forces().tobytes()
        assert np.array_equal(sim.uncollected_breaks(), one.uncollected_breaks())


def sim_forces(sim: Simulation, t: int) -> None:
    """Forces of one block on this thread (tests need no second core)."""
    from hpcdem.physics.dem.kernels import pair_forces

    pair_forces._block(t, *sim._pair_args)


def test_empty_and_tiny_lists(tmp_path: Path) -> None:
    """No pair, one pair, and as many as one more than a group."""
    for count in (1, 2, 3, 6):
        sim = support.model(tmp_path, dt=1e-3, disk="off")
        for gid in range(count):
            particles.ball(sim, gid, 0.9 * gid, 0.0, 0.5)
        properties.prop(sim, density=1.0, kn=1e3, ks=1e3)
        support.steps(sim, 1)
        fx = sim.lists.owned_forces()[np.argsort(sim.particles["gid"]), 0]
        expected = np.zeros(count)
        if count > 1:
            expected[0], expected[-1] = -50.0, 50.0  # kn / 2 times the overlap 0.1; the others are held from both sides
        assert fx == pytest.approx(expected, abs=1e-9)


# ---- lanes -----------------------------------------------------------------------------------------------------------


@njit
def masks(a, b, out):
    for e in range(len(a)):
        out[e] = lanes.as_number(lanes.no_farther(a[e], b[e]))


def test_the_comparison_without_a_jump() -> None:
    """-1 where a <= b, 0 elsewhere; not-a-number is farther than anything."""
    special = np.array([0.0, 5e-324, 1e-300, 1.0, np.nextafter(1.0, 2.0), 1e300, np.inf])
    a, b = (v.ravel() for v in np.meshgrid(special, special))
    out = np.empty(len(a), np.int64)
    masks(a, b, out)
    assert np.array_equal(out, np.where(a <= b, -1, 0))
    masks(np.array([np.nan]), np.array([1e300]), out)
    assert out[0] == 0


@njit
def turn(table, out, j, i):
    lanes.differences(out, U(8), table, (j[0], j[1], j[2], j[3]), (i[0], i[1], i[2], i[3]))
    lanes.four_columns(out, U(4 * lanes.CAPACITY), table, (j[0], j[1], j[2], j[3]))
    lanes.two_columns(out, U(8 * lanes.CAPACITY), table, (i[0], i[1], i[2], i[3]))


def test_rows_become_lanes() -> None:
    """Four rows, side by side in lanes, and nothing else is written."""
    table = np.random.default_rng(1).random((9, 8))
    j, i = np.array([8, 0, 3, 5]), np.array([1, 1, 2, 7])
    out = np.full(10 * lanes.CAPACITY, -7.0)
    turn(table.reshape(-1), out, (8 * j).astype(np.uint64), (8 * i).astype(np.uint64))
    out = out.reshape(10, lanes.CAPACITY)
    assert np.array_equal(out[:4, 8:12], (table[j] - table[i])[:, :4].T)
    assert np.array_equal(out[4:8, :4], table[j, :4].T)
    assert np.array_equal(out[8:, :4], table[i, :2].T)
    assert (out != -7.0).sum() == 16 + 16 + 8


@njit
def give(force, i, j, values):
    lanes.add_in_turn(force, (i[0], i[1], i[2], i[3]), (j[0], j[1], j[2], j[3]), values, U(0))


def test_additions_keep_their_order() -> None:
    """Rows that occur again and again get their terms one after the other, as written."""
    rng = np.random.default_rng(2)
    values = rng.standard_normal((4, lanes.CAPACITY)) * 10.0 ** rng.integers(-8, 8, (4, lanes.CAPACITY))
    i, j = np.array([0, 0, 1, 0]), np.array([1, 1, 0, 2])
    force, expected = np.ones((3, 4)), np.ones((3, 4))
    give(force.reshape(-1), (4 * i).astype(np.uint64), (4 * j).astype(np.uint64), values.reshape(-1))
    for e in range(4):
        a, b, c, d = values[:, e]
        expected[i[e]] += a, b, c, 0.0
        expected[j[e]] += -a, -b, d, 0.0
    assert force.tobytes() == expected.tobytes()
