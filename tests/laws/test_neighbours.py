"""The pair list against a search of all pairs; what contacts remember, out of old lists and into new ones."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core import cells
from hpcdem.core.comm import SerialComm
from hpcdem.core.fields import GID, RADIUS, WIDTH, X, Y
from hpcdem.decomp import strips
from hpcdem.halo.migrate import Migration
from hpcdem.physics.dem.kernels import neighbours, walls
from hpcdem.physics.dem.kernels.fast import Fast
from hpcdem.physics.dem.kernels.histories import Histories

SKIN = 0.15
WALLS = np.zeros((5, 8))
"""Floor, left side, an inclined one, one of half a cell, one far away."""
WALLS[:, :4] = [[0, 0, 20, 0], [0, -1, 0, 30], [3, 12, 17, 3], [8.1, 6.1, 8.3, 6.2], [0, 90, 20, 95]]


class Model:
    """Discs of unequal size at random places, sorted, of which columns first : last are owned and those beside them
    are ghosts; some pairs and walls are remembered, some pairs are bonded."""

    def __init__(
        self,
        seed: int,
        n: int = 400,
        ranks_columns: tuple[int, int] = (-99, 99),
        bonds: bool = False,
        fast_ones: bool = False,
    ) -> None:
        random = np.random.default_rng(seed)
        hot = np.zeros((n, WIDTH))
        hot[:, X], hot[:, Y] = random.uniform(0, 20, n), random.uniform(0, 15, n)
        hot[:, RADIUS] = random.uniform(0.2, 0.6, n)
        hot.view(np.int64)[:, GID] = random.permutation(3 * n)[:n]
        self.largest = float(hot[:, RADIUS].max())
        self.side = 2 * self.largest + SKIN
        cell = cells.keys(hot, self.side)
        order = strips.global_order(cell, hot.view(np.int64)[:, GID].copy())
        hot, cell = hot[order], cell[order]
        column = cells.columns(cell)
        first, last = ranks_columns
        self.fast, self.columns = Fast.none(), 1
        if fast_ones:
            gid = np.sort(random.permutation(hot.view(np.int64)[:, GID])[:9])
            self.fast = Fast(gid, random.uniform(0.1, 2.2, 9), np.zeros(9, bool))
            self.columns = int(np.ceil(2.0 * (self.largest + self.fast.reach.max()) / self.side))
        shown = (column >= first - self.columns) & (column < last + self.columns)
        self.hot, self.cell, column = hot[shown].copy(), cell[shown].copy(), column[shown]
        self.n_left, self.n_own = int((column < first).sum()), int(((column >= first) & (column < last)).sum())
        self.gid = self.hot.view(np.int64)[:, GID]
        self.owned = range(self.n_left, self.n_left + self.n_own)
        self.reach = self.side if bonds else 0.0
        self.memory = {}  # (gid, gid or -1 - wall) -> (fs, extra, bond)
        dx, dy = (self.hot[:, c, None] - self.hot[None, :, c] for c in (X, Y))
        self.d2 = dx * dx + dy * dy
        self.limit = (self.hot[:, RADIUS, None] + self.hot[None, :, RADIUS] + SKIN) ** 2
        self.own_reach = np.full(len(self.gid), 0.5 * SKIN)
        for i, j in self.all_pairs(self.side if bonds else 0.0):
            if random.random() < 0.6:
                bond = int(random.integers(0, 3)) if bonds else 0
                if bond or self.d2[i, j] <= self.limit[i, j]:
                    self.remember(i, j, (random.normal(), random.random(), bond))
        for i in self.owned:
            for w in range(len(WALLS) - 1):
                if random.random() < 0.05:
                    self.memory[self.gid[i], -1 - w] = (random.normal(), 1.0, 0)
        if fast_ones:
            rows, at = self.fast.among(self.gid)
            self.own_reach[rows] = self.fast.reach[at]
            both = self.hot[:, RADIUS] + self.own_reach
            self.limit = np.maximum(self.limit, (both[:, None] + both) ** 2)

    def remember(self, i: int, j: int, values: tuple) -> None:
        self.memory[self.gid[i], self.gid[j]] = self.memory[self.gid[j], self.gid[i]] = values

    def all_pairs(self, bond_reach: float) -> list[tuple[int, int]]:
        """Pairs that touch an owned particle, near or within the reach of a bond, in the order of the list."""
        near = (self.d2 <= self.limit) | (self.d2 <= bond_reach**2)
        return [
            (i, j) for i, j in zip(*np.nonzero(np.triu(near, 1))) if i in self.owned or j in self.owned
        ]  # fmt: skip

    def histories(self, shuffled: np.ndarray) -> Histories:
        """Of the owned particles; that of the c-th stands at shuffled[c]."""
        entries: list[list] = [[] for _ in self.owned]
        for (gid, partner), values in sorted(self.memory.items(), key=lambda item: item[0][1] < 0):
            row = int(np.flatnonzero(self.gid == gid)[0])
            if row in self.owned:
                entries[shuffled[row - self.n_left]].append((partner, *values))
        ptr = np.cumsum([0] + [len(e) for e in entries])
        partner, fs, extra, bond = np.array([row for e in entries for row in e]).reshape(-1, 4).T
        return Histories.of_columns(ptr, partner, fs, extra, bond)

    def build(self, n_blocks: int, seed: int = 0) -> neighbours.ContactLists:
        where = np.random.default_rng(seed).permutation(self.n_own)
        return neighbours.build(
            self.hot, self.cell, self.n_left, self.n_own, self.histories(where), where, WALLS, self.side, self.largest,
            SKIN, self.reach, n_blocks, None, self.fast, self.columns,
        )  # fmt: skip

    def expected(self) -> list[tuple]:
        """(row, partner, fs, bond, u_made) of all slots."""
        out = []
        for i, j in self.all_pairs(self.reach):
            fs, extra, bond = self.memory.get((self.gid[i], self.gid[j]), (0.0, 0.0, 0))
            if bond or self.d2[i, j] <= self.limit[i, j]:
                out.append((i, j, fs, bond, extra))
        return out


def slots(lists: neighbours.ContactLists, t: int) -> list[tuple]:
    """(row, partner, fs, bond, u_made) of block t; row pointers and rows must agree."""
    b, out = lists.blocks, []
    for i in range(b.lo[t], b.cut[t + 1]):
        for k in range(lists.ptr[b.poff[t] + i - b.lo[t]], lists.ptr[b.poff[t] + i - b.lo[t] + 1]):
            assert lists.row[k] == i
            out.append((i, lists.partner[k], lists.fs[k], lists.bond[k], lists.u_made[k]))
    return out


MODELS = [
    pytest.param(seed, columns, bonds, id=f"{seed}-{name}-{'bonds' if bonds else 'contacts'}")
    for seed in (1, 2)
    for name, columns in (("whole", (-99, 99)), ("strip", (4, 9)), ("column", (6, 7)), ("nothing", (40, 50)))
    for bonds in (False, True)
]


@pytest.mark.some_of_each
@pytest.mark.parametrize("fast_ones", [False, True])
@pytest.mark.parametrize("n_blocks", [1, 2, 5])
@pytest.mark.parametrize(("seed", "columns", "bonds"), MODELS)
def test_the_list_holds_the_pairs_that_a_search_of_all_finds(seed, columns, bonds, n_blocks, fast_ones):
    """Order, memory and bonds too; of several blocks each has the pairs that touch its own particles. With some that
    have a reach of their own, over several columns."""
    model = Model(seed, ranks_columns=columns, bonds=bonds, fast_ones=fast_ones)
    lists = model.build(n_blocks)
    expected = model.expected()
    for t in range(n_blocks):
        a, b = lists.blocks.cut[t], lists.blocks.cut[t + 1]
        assert slots(lists, t) == [s for s in expected if a <= s[0] < b or (s[0] < a <= s[1] < b)]
    bonded = [(i, j) for i, j, _, bond, _ in expected if bond]
    own_first = [pair for pair in bonded if pair[0] >= model.n_left]
    assert lists.bonds_placed == len(own_first)
    assert lists.longest_bond2() == max((model.d2[pair] for pair in bonded), default=0.0)


@pytest.mark.some_of_each
@pytest.mark.parametrize("fast_ones", [False, True])
@pytest.mark.parametrize(("seed", "columns", "bonds"), MODELS)
def test_wall_slots_are_those_near_or_remembered(seed, columns, bonds, fast_ones):
    model = Model(seed, ranks_columns=columns, bonds=bonds, fast_ones=fast_ones)
    lists = model.build(3)
    expected = []
    for i in model.owned:
        x, y, r = model.hot[i, X], model.hot[i, Y], model.hot[i, RADIUS]
        for w, wall in enumerate(WALLS):
            _, _, qx, qy = walls.closest(wall, x, y)
            known = model.memory.get((model.gid[i], -1 - w))
            far = r + max(SKIN, 0.5 * SKIN + model.own_reach[i])
            if known or (x - qx) ** 2 + (y - qy) ** 2 <= far**2:
                expected.append((i, w, *(known[:2] if known else (0.0, 0.0))))
    assert list(zip(lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side)) == expected
    assert lists.wptr.tolist() == np.searchsorted(lists.slot_row, lists.blocks.cut).tolist()


@pytest.mark.some_of_each
@pytest.mark.parametrize("n_blocks", [1, 3])
@pytest.mark.parametrize(("seed", "columns", "bonds"), MODELS)
def test_what_is_put_in_comes_out(seed, columns, bonds, n_blocks):
    """Everything that is not nothing, walls after pairs; the overlap at bonding only where there is a bond."""
    model = Model(seed, ranks_columns=columns, bonds=bonds)
    hist = model.build(n_blocks).histories(model.hot.view(np.int64))
    shown = {(i, j) for i, j, *_ in model.expected()}
    for c, i in enumerate(model.owned):
        rows = slice(hist.ptr[c], hist.ptr[c + 1])
        found = list(zip(hist.partner[rows], hist.fs[rows], hist.extra[rows], hist.bond[rows]))
        partners = [j for j in range(len(model.gid)) if (min(i, j), max(i, j)) in shown]
        names = [model.gid[j] for j in partners] + [-1 - w for w in range(len(WALLS))]
        put_in = [(name, *model.memory[model.gid[i], name]) for name in names if (model.gid[i], name) in model.memory]
        expected = [(name, fs, extra if bond or name < 0 else 0.0, bond) for name, fs, extra, bond in put_in]
        assert sorted(found) == sorted(expected)
        assert [partner < 0 for partner, *_ in found] == sorted(partner < 0 for partner, *_ in found)


def test_more_neighbours_than_foreseen():
    """A heap of discs in one place: more pairs than the first guess has room for, more contacts than usual."""
    hot = np.zeros((40, WIDTH))
    hot[:, RADIUS] = 1.0
    hot.view(np.int64)[:, GID] = np.arange(40)
    cell = cells.keys(hot, 3.0)
    pairs = [(i, j) for i in range(40) for j in range(40) if i != j]
    ptr = 39 * np.arange(41)
    partner = np.array([j for _, j in pairs])
    fs = np.array([1.0 + min(pair) + 100.0 * max(pair) for pair in pairs])
    hist = Histories.of_columns(ptr, partner, fs, np.zeros(len(fs)), np.zeros(len(fs), np.int64))
    lists = neighbours.build(hot, cell, 0, 40, hist, np.arange(40), np.zeros((0, 8)), 3.0, 1.0, 1.0, 0.0, 1)
    assert lists.n_pairs == 780
    assert slots(lists, 0) == [(i, j, 1.0 + i + 100.0 * j, 0, 0.0) for i in range(40) for j in range(i + 1, 40)]


def test_walls_beyond_all_cells_and_particles_without_a_place():
    """Nothing that is not a number is near a wall; others are, beyond the outermost cells too."""
    hot = np.zeros((6, WIDTH))
    hot[:, RADIUS] = 1.0
    hot[:, X], hot[:, Y] = (0.0, np.nan, 5e9, np.inf, 5e9, 7e4), (0.5, 0.0, 0.5, 0.0, 5e9, 7e4 - 1.0)
    long = np.zeros((3, 8))
    long[:, :4] = [[-1e10, 0, 1e10, 0], [-1e10, -1e10, 1e10, 1e10], [0, 7e9, 1e10, 7e9]]
    cell = cells.keys(hot, 3.0)
    order = strips.global_order(cell, np.arange(6))
    assert cells.column(cell[2]) == cells.FARTHEST < 5e9 / 3.0
    lists = neighbours.build(
        hot[order], cell[order], 0, 6, Histories.empty(6), np.arange(6), long, 3.0, 1.0, 1.0, 0.0, 1
    )  # fmt: skip
    seen = {(int(order[i]), int(w)) for i, w in zip(lists.slot_row, lists.slot_wall)}
    assert seen == {(0, 0), (0, 1), (2, 0), (4, 1), (5, 1)}


def test_gauge():
    hot = np.zeros((5, WIDTH))
    hot[:, RADIUS], hot[:, X] = (9.0, 1.0, 3.0, 2.0, 9.0), (99.0, 0.0, 1.0, 2.0, 99.0)
    assert neighbours.gauge(hot, 1, 3, (0.0, 2.0, 0.0, 0.0)) == (3.0, 0.0)
    assert neighbours.gauge(hot, 1, 3, (0.0, 1.9, 0.0, 0.0)) == (3.0, 1.0)
    hot[2, Y] = np.nan
    assert neighbours.gauge(hot, 1, 3, (0.0, 2.0, -1.0, 1.0)) == (3.0, 1.0)
    assert neighbours.gauge(hot, 1, 0, (0.0, 2.0, 0.0, 0.0)) == (0.0, 0.0)


# ---- histories ---------------------------------------------------------------------------------------------------


def entries(hist: Histories) -> list[list[float]]:
    return [hist.fs[hist.ptr[c] : hist.ptr[c + 1]].tolist() for c in range(len(hist.ptr) - 1)]


def of(*lists: list[float]) -> Histories:
    fs = np.array([value for one in lists for value in one], dtype=float)
    whole = fs.astype(np.int64)
    return Histories.of_columns(np.cumsum([0] + [len(one) for one in lists]), 10 * whole, fs, 0.5 * fs, whole % 3)


def test_histories_are_taken_joined_and_thinned_out():
    hist = of([1.0, 2.0], [], [3.0], [4.0, 5.0, 6.0])
    assert entries(hist.take(np.array([3, 1, 0]))) == [[4.0, 5.0, 6.0], [], [1.0, 2.0]]
    assert entries(hist.take(np.array([], np.int64))) == []
    other = of([7.0], [8.0, 9.0])
    assert entries(hist.joined(other.counts(), other.rows)) == [*entries(hist), [7.0], [8.0, 9.0]]
    assert entries(hist.extended(2)) == [*entries(hist), [], []]
    assert entries(hist.keep(hist.partner != 50)) == [[1.0, 2.0], [], [3.0], [4.0, 6.0]]
    assert hist.bonded() == sum(value % 3 != 0 for value in range(1, 7))
    taken = hist.take(np.array([3]))
    assert taken.partner.tolist() == [40, 50, 60] and taken.extra.tolist() == [2.0, 2.5, 3.0]


# ---- migration ---------------------------------------------------------------------------------------------------


class Post(SerialComm):
    """Ranks one after the other: what they send is kept, and handed out in a second round."""

    def __init__(self, size: int) -> None:
        self.size, self.sent = size, {}

    def exchange(self, parcels):
        self.sent.setdefault(self.rank, parcels)
        return {source: sent[self.rank] for source, sent in sorted(self.sent.items()) if self.rank in sent}


def test_particles_and_histories_arrive_in_the_order_of_ranks():
    comm = Post(3)
    rows = {rank: np.arange(8.0).reshape(4, 2) + 100 * rank for rank in range(3)}
    counts = np.array([1, 0, 2, 1])
    memory = {rank: np.array([[0.0], [2.0], [2.5], [3.0]]) + 100 * rank for rank in range(3)}
    owners = {0: np.array([1, 2, 0, 1]), 1: np.array([1, 1, 1, 1]), 2: np.array([1, 1, 0, 2])}
    for _ in range(2):
        arrived = {}
        for rank in range(3):
            comm.rank = rank
            leave = np.flatnonzero(owners[rank] != rank)
            migration = Migration(comm, 4, leave, owners[rank][leave])
            hist = Histories(np.concatenate(([0], np.cumsum(counts))), np.repeat(memory[rank], 4, axis=1))
            gone = hist.take(migration.leave)
            arrived[rank] = migration.exchange(rows[rank][migration.leave], gone.counts(), gone.rows)
            assert migration.stay().tolist() == np.flatnonzero(owners[rank] == rank).tolist()
    assert [a[0][:, 0].tolist() for a in arrived.values()] == [[204.0], [0.0, 6.0, 200.0, 202.0], [2.0]]
    assert [a[1].tolist() for a in arrived.values()] == [[2], [1, 1, 1, 0], [0]]
    assert [a[2][:, 0].tolist() for a in arrived.values()] == [[202.0, 202.5], [0.0, 3.0, 200.0], []]
