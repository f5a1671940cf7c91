"""Files that several ranks write and read together: the bytes of one rank, the numbers of the whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import transport
from hpcdem.io.dat import read_dat, write_dat
from hpcdem.io.disk import publish
from hpcdem.io.files import write_sections
from hpcdem.io.ps import write_ps
from hpcdem.io.vtk import write_wall_vtk
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import write_mesh_frame
from tests.pretended import Pretended, Ranks
from tests.unit.io_synthetic import make_frame
from tests.unit.test_io_vtkhdf_mesh import made_frame


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages to rank 0 of 4 KiB; a rank keeps two of them ready."""
    monkeypatch.setattr(transport, "PIECE", 4096)
    monkeypatch.setattr(transport, "AHEAD", 8192)
    monkeypatch.setattr(transport, "_buffers", transport._Buffers())


def _frame(write: Callable[..., None]) -> Callable[[Path, Any], None]:
    return lambda path, comm: write(path, make_frame(60, comm), comm)


@pytest.mark.parametrize(
    "write",
    [_frame(write_dat), _frame(write_vtkhdf), _frame(write_wall_vtk), _frame(write_ps),
     lambda path, comm: write_mesh_frame(path, made_frame(comm), comm)],
    ids=["dat", "vtkhdf", "vtk", "ps", "mesh"],
)  # fmt: skip
def test_three_ranks_write_the_file_of_one(tmp_path: Path, small_pieces: None, write: Callable[..., None]) -> None:
    write(tmp_path / "one", SerialComm())
    (tmp_path / "n").mkdir()
    Ranks(3).run(lambda comm: write(tmp_path / "n" / "one", comm))
    assert (tmp_path / "n" / "one").read_bytes() == (tmp_path / "one").read_bytes() != b""
    assert [path.name for path in (tmp_path / "n").iterdir()] == ["one"], "nothing temporary is left"


def test_cells_of_a_mesh_begin_with_zero_and_are_counted_once(tmp_path: Path) -> None:
    write_mesh_frame(tmp_path / "a.vtkhdf", made_frame(SerialComm()), SerialComm())
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        assert file["VTKHDF/Offsets"][:].tolist() == [0, 3, 7, 10, 12, 14]


def test_pieces_come_rank_by_rank_and_whole(small_pieces: None) -> None:
    """Five and a half pieces of rank 1, of which two are made ahead, none of rank 2, one of rank 3."""
    sizes = [0, 5 * 4096 + 2048, 0, 100]

    def send(comm: Pretended) -> list[tuple[int, bytes]]:
        mine = np.arange(sizes[comm.rank]).astype(np.uint8) + np.uint8(comm.rank)
        blocks = transport.rows_in_blocks([mine[:1000], mine[1000:]])
        return [(rank, piece.tobytes()) for rank, piece in transport.to_root(comm, blocks)]

    pieces, *others = Ranks(4).run(send)
    assert others == [[]] * 3 and [rank for rank, _ in pieces] == [1] * 6 + [3]
    assert [len(piece) for _, piece in pieces] == [4096] * 5 + [2048, 100]
    for rank in range(1, 4):
        whole = np.frombuffer(b"".join(piece for r, piece in pieces if r == rank), np.uint8)
        assert (whole == np.arange(sizes[rank]).astype(np.uint8) + np.uint8(rank)).all()


def test_words_that_all_ranks_have_are_written_once(tmp_path: Path) -> None:
    Ranks(3).run(lambda comm: write_sections(tmp_path / "a", comm, lambda: [b"head\n", b"tail\n"]))
    assert (tmp_path / "a").read_text() == "head\ntail\n"


def test_an_error_of_one_rank_is_an_error_of_all(tmp_path: Path) -> None:
    def build(comm: Pretended) -> list[bytes]:
        if comm.rank == 2:
            raise ValueError("no such column")
        return []

    def write(comm: Pretended) -> str:
        with pytest.raises(HpcdemError) as error:
            write_sections(tmp_path / "a", comm, lambda: build(comm))
        return str(error.value)

    assert Ranks(3).run(write) == [f"cannot write {tmp_path / 'a'}: no such column"] * 3
    assert not any(tmp_path.iterdir())


def test_ranks_read_what_one_reads(tmp_path: Path) -> None:
    """Groups are numbered alike on all ranks, in the order of the whole table; columns that are nearly always zero are
    there on all of them."""
    frame = make_frame(60)
    columns = frame.tables["particles"].columns
    for name in ("push_x", "push_y"):
        columns[name][:] = 0.0
        columns[name][-1] = 2.5
    columns["group"][:] = np.repeat([3, 1, 2], 20)
    write_dat(tmp_path / "a.dat", frame, SerialComm())
    whole = read_dat(tmp_path / "a.dat")
    parts = Ranks(3).run(lambda comm: read_dat(tmp_path / "a.dat", comm=comm))
    assert {tuple(part.group_names) for part in parts} == {tuple(whole.group_names)}
    for name, table in whole.tables.items():
        of_ranks = [part.tables[name] for part in parts]
        assert sum(len(one) for one in of_ranks) == table.total
        for column, values in table.columns.items():
            found = np.concatenate([one.columns[column] for one in of_ranks if len(one) or name == "particles"])
            np.testing.assert_array_equal(found, values, err_msg=f"{name} {column}")


def test_a_file_and_its_name_are_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The data before the name, and then the folder, in which the name stands."""
    order = []
    monkeypatch.setattr("os.fsync", lambda handle: order.append(Path(f"/proc/self/fd/{handle}").readlink().name))
    (tmp_path / "a.tmp").write_text("x")
    publish(str(tmp_path / "a.tmp"), str(tmp_path / "a"))
    assert order == ["a.tmp", tmp_path.name] and (tmp_path / "a").read_text() == "x"
