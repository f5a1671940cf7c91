"""Pieces of the halo on a few pretended ranks: copies of rows, borders, neighbours. Quick enough for mutants."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import UsageError
from hpcdem.decomp import balance, strips
from hpcdem.halo.copies import Copies, moved
from hpcdem.halo.migrate import Trail
from hpcdem.halo.ownership import Ownership
from tests.parallel.test_many_ranks import flow, state
from tests.pretended import Pretended, Ranks

TOTAL = 12


def numbers_of(rank: int) -> np.ndarray:
    """Numbers that one of three ranks owns: 0, 3, 6, 9 and so on."""
    return np.arange(rank, TOTAL, 3)


def test_copies_are_the_present_rows_of_their_owners() -> None:
    """Every rank has copies of two rows of each other rank, in the order of the owners; refreshed twice."""

    def copy(comm: Pretended) -> list[list[list[float]]]:
        mine = numbers_of(comm.rank)
        others = [rank for rank in range(3) if rank != comm.rank]
        wanted = np.concatenate([numbers_of(rank)[[1, 3]] for rank in others])
        table = np.zeros((len(mine) + len(wanted), 2))
        copies = Copies(comm, mine, wanted, np.repeat(others, 2), table)
        seen = []
        for factor in (1.0, 2.0):
            table[: len(mine)] = factor * np.stack([mine, mine**2], axis=1)
            copies.refresh()
            seen.append(table[len(mine) :].tolist())
            assert (table[: len(mine), 0] == factor * mine).all(), "nobody writes into the rows of an owner"
        copies.close()
        assert copies.requests == []
        return [wanted.tolist(), *seen]

    for wanted, once, twice in Ranks(3).run(copy):
        assert once == [[float(k), float(k * k)] for k in wanted]
        assert twice == [[2.0 * k, 2.0 * k * k] for k in wanted]


def test_what_is_known_of_particles_follows_them() -> None:
    """3 went from rank 0 to rank 1 and on to rank 2, and 4 to rank 1; of 9, deleted, the row is dropped."""
    ways = [{3: 1, 4: 1}, {3: 2}, {}]

    def follow(comm: Pretended) -> list[list[float]]:
        trail = Trail()
        trail.begin()
        for gid, owner in ways[comm.rank].items():
            trail.note(np.array([gid]), np.array([owner]))
        mine = np.array([[1], [4], [3]][comm.rank])
        gid = np.array([1, 3, 4, 9] if comm.rank == 0 else [], np.int64)
        return np.column_stack(trail.follow(comm, mine, gid, 0.5 * gid)).tolist()

    assert Ranks(3).run(follow) == [[[1.0, 0.5]], [[4.0, 2.0]], [[3.0, 1.5]]]


def test_rows_go_over_to_new_owners() -> None:
    """From thirds in turn to thirds in a row; number 5 was nobody's; copies are asked from who owns them now."""

    def move(comm: Pretended) -> tuple[list, list]:
        had = numbers_of(comm.rank)
        had = had[had != 5]
        mine = np.arange(4 * comm.rank, 4 * comm.rank + 4)[::-1].copy()
        wanted = np.array([11, 0, 5, 4])
        rows, owners = moved(comm, TOTAL, had, np.stack([had + 0.5, -had], axis=1), mine, wanted)
        return rows.tolist(), owners.tolist()

    for rank, (rows, owners) in enumerate(Ranks(3).run(move)):
        mine = range(4 * rank + 3, 4 * rank - 1, -1)
        assert rows == [[0.0, 0.0] if k == 5 else [k + 0.5, -float(k)] for k in mine]
        assert owners == [2, 0, 1, 1]


def borders(program: Callable[[Ownership, Pretended], None]) -> list[list[int]]:
    """Borders of three ranks, each with ten particles in each of four columns of its own, after `program`."""

    def renew(comm: Pretended) -> list[int]:
        owned = Ownership(comm, balance_on=True)
        owned.renew(np.repeat(np.arange(4 * comm.rank, 4 * comm.rank + 4), 10), 1.0, 0, 0.0, None)
        assert owned.borders.tolist() == strips.cut(np.full(12, 10.0), 0, 3).tolist() and not owned.wanted
        program(owned, comm)
        return owned.borders.tolist()

    found = Ranks(3).run(renew)
    assert found[0] == found[1] == found[2], "the same on all ranks"
    return found[0]


def columns(owned: Ownership, comm: Pretended) -> np.ndarray:
    """The ten particles in each column that this rank owns now."""
    first, last = owned.borders[comm.rank], owned.borders[comm.rank + 1]
    return np.repeat(np.arange(max(first, 0), min(last, 12)), 10)


def test_borders_stay_with_equal_cells_and_follow_their_side() -> None:
    """Cells of half the side: every column is two."""
    assert borders(lambda owned, comm: owned.renew(columns(owned, comm), 1.0, 1, 0.0, None))[1:3] == [4, 8]
    assert borders(lambda owned, comm: owned.renew(2 * columns(owned, comm), 0.5, 1, 0.0, None))[1:3] == [8, 16]


def test_a_column_at_least_without_anybody() -> None:
    """A model that has lost all its particles goes on."""

    def lose(owned: Ownership, comm: Pretended) -> None:
        owned.wanted = True
        owned.renew(np.zeros(0, np.int64), 1.0, 5, 0.0, None)
        assert owned.borders.tolist() == strips.cut(np.zeros(1), 0, 3).tolist()

    borders(lose)


def test_borders_follow_the_measured_time() -> None:
    """Rank 0 was busy for three times as long as the others: its columns count as three. Not before some steps have
    passed, and not where costs say that all is even."""

    def late(owned: Ownership, comm: Pretended) -> None:
        busy = 3.0 if comm.rank == 0 else 1.0
        before = owned.borders.tolist()
        owned.renew(columns(owned, comm), 1.0, balance.PATIENCE - 1, busy, None)
        assert owned.borders.tolist() == before
        owned.renew(columns(owned, comm), 1.0, balance.PATIENCE, busy, None)
        weights = np.repeat([30.0, 10.0, 10.0], 4)
        assert owned.borders.tolist() == strips.cut(weights, 0, 3).tolist() != before

    borders(late)


def test_more_ranks_than_columns_are_refused_at_the_start_only() -> None:
    def first(comm: Pretended) -> str:
        with pytest.raises(UsageError) as error:
            Ownership(comm, balance_on=True).renew(np.array([0, 1]), 2.0, 0, 0.0, None)
        Ownership(comm, balance_on=True).renew(np.array([0, 1]), 2.0, 7, 0.0, None)  # goes on after a restart
        Ownership(comm, balance_on=True).renew(np.array([0, 1]), 2.0, 0, 0.0, (0.0, 6.5))  # there is room for more
        return str(error.value)

    assert all("width in columns of 2 m" in text and "is 2, so at most 2" in text for text in Ranks(3).run(first))


def test_three_ranks_come_to_the_same_bits_quickly() -> None:
    """A lattice of 3 x 8 x 6 discs that drifts, some steps past a rebuild."""

    def run(comm: object) -> dict:
        sim = flow(comm, 3)
        sim.particles["vx"][:] = 60.0
        for _ in range(12):
            sim.step()
        assert sim.rebuilds > 1
        return state(sim)

    together = {gid: row for part in Ranks(3).run(run) for gid, row in part.items()}
    assert together == run(SerialComm())
