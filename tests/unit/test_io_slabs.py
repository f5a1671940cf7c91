"""Rows anywhere become slabs in one order; the order does not know the number of ranks."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.slabs import find_rows, order_of, to_slabs

ROOT = Path(__file__).resolve().parents[2]


def test_rows_are_sorted_by_one_key() -> None:
    columns = {
        "gid": np.array([5, -2, 9, 3]),
        "x": np.array([0.5, -0.2, 0.9, 0.3]),
        "fix": np.array([5, 2, 9, 3], "u1"),
    }
    table = to_slabs(SerialComm(), ("gid",), columns)
    assert (table.offset, table.total) == (0, 4)
    np.testing.assert_array_equal(table.columns["gid"], [-2, 3, 5, 9])
    np.testing.assert_array_equal(table.columns["x"], [-0.2, 0.3, 0.5, 0.9])
    np.testing.assert_array_equal(table.columns["fix"], np.array([2, 3, 5, 9], "u1"))
    assert table.columns["fix"].dtype == np.uint8


def test_rows_are_sorted_by_two_keys() -> None:
    columns = {"id1": np.array([2, 1, 2, 1]), "id2": np.array([3, 9, 2, 4]), "fn": np.array([23.0, 19.0, 22.0, 14.0])}
    table = to_slabs(SerialComm(), ("id1", "id2"), columns)
    np.testing.assert_array_equal(table.columns["fn"], [14.0, 19.0, 22.0, 23.0])


def test_chosen_rows_are_sorted() -> None:
    columns = {"gid": np.array([5, -2, 9, 3, 2**62]), "x": np.array([0.5, -0.2, 0.9, 0.3, 0.0])}
    table = to_slabs(SerialComm(), ("gid",), columns, np.array([4, 2, 3]))
    assert (table.offset, table.total) == (0, 3)
    np.testing.assert_array_equal(table.columns["gid"], [3, 9, 2**62])
    np.testing.assert_array_equal(table.columns["x"], [0.3, 0.9, 0.0])


def test_tables_are_copies() -> None:
    columns = {"gid": np.arange(3), "x": np.arange(3.0)}
    table = to_slabs(SerialComm(), ("gid",), columns)
    columns["x"][:] = 7.0
    np.testing.assert_array_equal(table.columns["x"], [0.0, 1.0, 2.0])


@pytest.mark.parametrize("spread", [1, 1000, 2**40, 2**63 - 1])
def test_order_is_that_of_lexsort(spread: int) -> None:
    rng = np.random.default_rng(5)
    keys = [rng.integers(-spread, spread, 3000, endpoint=True) for _ in range(2)]
    np.testing.assert_array_equal(order_of(keys), np.lexsort(keys[::-1]))
    np.testing.assert_array_equal(order_of(keys[:1]), np.argsort(keys[0], kind="stable"))


def test_no_rows() -> None:
    table = to_slabs(SerialComm(), ("gid",), {"gid": np.zeros(0, np.int64), "x": np.zeros(0)})
    assert (len(table), table.total) == (0, 0)


def test_a_key_twice_is_an_error() -> None:
    with pytest.raises(HpcdemError, match=r"the key id1 = 1, id2 = 4 occurs twice"):
        to_slabs(SerialComm(), ("id1", "id2"), {"id1": np.array([1, 1, 1]), "id2": np.array([4, 5, 4])})


def test_rows_are_found() -> None:
    gid = np.array([1, 4, 6])
    np.testing.assert_array_equal(find_rows(SerialComm(), [gid], [np.array([6, 5, 1, 0, 7])]), [2, -1, 0, -1, -1])
    pairs = [np.array([1, 1, 3]), np.array([2, 5, 4])]
    wanted = [np.array([1, 3, 1]), np.array([5, 5, 2])]
    np.testing.assert_array_equal(find_rows(SerialComm(), pairs, wanted), [1, -1, 0])
    with pytest.raises(HpcdemError, match="cannot be looked up"):
        find_rows(SerialComm(), [np.array([2**40]), np.array([1])], [np.array([1]), np.array([1])])


PROGRAM = """
import sys
import numpy as np
from mpi4py import MPI
from hpcdem.core.errors import HpcdemError
from hpcdem.halo.comm import MpiComm
from hpcdem.io.slabs import find_rows, to_slabs
from hpcdem.runtime import kept

kept.install()
comm = MpiComm(MPI.COMM_WORLD)
for case, n in enumerate([0, 1, 2, 7, 1000, 20000]):
    rng = np.random.default_rng(case)
    gid = np.sort(rng.choice(10 * n + 1, n, replace=False)) if case != 4 else np.arange(n) ** 3  # sparse or skewed
    other = rng.integers(-5, 5, n)
    columns = {"id1": gid // 4, "id2": gid, "x": rng.normal(size=n), "k": rng.integers(0, 9, n).astype("u1")}
    owner = rng.integers(0, comm.size + 2, n) % comm.size  # uneven
    mine = rng.permutation(n)
    mine = mine[owner[mine] == comm.rank]
    table = to_slabs(comm, ("id1", "id2"), {name: v[mine] for name, v in columns.items()})
    assert table.total == n and table.offset == comm.exscan(len(table))
    for name, v in columns.items():
        assert table.columns[name].dtype == v.dtype
        np.testing.assert_array_equal(table.columns[name], v[table.offset : table.offset + len(table)])
    largest = comm.max_into(np.array([len(table)]))[0]
    assert case == 4 or largest <= n / comm.size * 1.1 + 8, (largest, n)
    wanted = rng.permutation(10 * n + 1)[: 50 + comm.rank]
    expected = {int(g): row for row, g in enumerate(gid)}
    np.testing.assert_array_equal(
        find_rows(comm, [table.columns["id2"]], [wanted]), [expected.get(int(w), -1) for w in wanted]
    )
    np.testing.assert_array_equal(
        find_rows(comm, [table.columns["id1"], table.columns["id2"]], [wanted // 4, wanted]),
        [expected.get(int(w), -1) for w in wanted],
    )
try:
    to_slabs(comm, ("gid",), {"gid": np.array([comm.rank // 2])})
except HpcdemError as error:
    assert str(error) == "the key gid = 0 occurs twice in a table", error
else:
    raise SystemExit("no error")
print("good\\n", end="", flush=True)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_slabs_follow_each_other_by_rank(launch: Any, tmp_path: Path, ranks: int) -> None:
    program = tmp_path / "program.py"
    program.write_text(f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n" + textwrap.dedent(PROGRAM))
    done = launch.python(ranks, program, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("good") == ranks
