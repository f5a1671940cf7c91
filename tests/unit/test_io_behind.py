"""Files that are written while the run goes on: in order, with bounded memory, and no error is lost."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.behind import Deliveries
from hpcdem.io.dat import write_dat
from hpcdem.io.files import write_sections
from hpcdem.io.rootfile import RootFile
from hpcdem.io.textnum import TextTable, sci
from hpcdem.io.vtkhdf import write_vtkhdf
from tests.unit.io_synthetic import make_frame

COMM = SerialComm()


class Gate:
    """A task that waits until it is let through."""

    def __init__(self, later: Deliveries) -> None:
        self.open = threading.Event()
        later.put(self._wait)
        later.go()

    def _wait(self) -> None:
        assert self.open.wait(60)


def test_a_file_has_its_name_when_it_is_settled(tmp_path: Path) -> None:
    later = Deliveries()
    gate = Gate(later)
    write_sections(tmp_path / "a.txt", COMM, lambda: [b"head\n", TextTable([(sci("x", 3), np.ones(2))])], later)
    assert os.listdir(tmp_path) == []
    gate.open.set()
    later.settle(COMM)
    assert (tmp_path / "a.txt").read_text() == "head\n   1.00e+00\n   1.00e+00\n"
    assert os.listdir(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("write", [write_dat, write_vtkhdf])
def test_the_bytes_are_those_of_a_file_written_at_once(tmp_path: Path, write) -> None:
    frame, later = make_frame(2000, COMM), Deliveries()
    now, then, entrusted = (tmp_path / folder / "file" for folder in ("now", "later", "entrusted"))  # it tells its name
    for path in (now, then, entrusted):
        path.parent.mkdir()
    write(now, frame, COMM)
    write(then, frame, COMM, later)
    later.entrust(lambda: write(entrusted, frame, COMM))
    later.settle(COMM)
    content = now.read_bytes()
    same = [
        path.read_bytes() == content for path in (then, entrusted)
    ]  # a difference of megabytes takes minutes to show
    assert same == [True, True]


def test_an_error_is_raised_once_by_poll_or_settle(tmp_path: Path) -> None:
    later = Deliveries()
    write_sections(tmp_path / "no" / "a.txt", COMM, lambda: [b"x"], later)
    write_sections(tmp_path / "b.txt", COMM, lambda: [b"x"], later)
    later.wait()
    with pytest.raises(HpcdemError, match=r"^cannot write .*a\.txt: the folder does not exist$"):
        later.poll(COMM)
    with pytest.raises(HpcdemError, match="the folder does not exist"):
        later.settle(COMM)
    later.poll(COMM)
    later.settle(COMM)
    assert os.listdir(tmp_path) == ["b.txt"], "the next file is written all the same"


def test_looking_waits_for_no_disk(tmp_path: Path) -> None:
    later = Deliveries()
    gate = Gate(later)
    write_sections(tmp_path / "no" / "a.txt", COMM, lambda: [b"x"], later)
    later.go()
    later.poll(COMM)  # nothing is known yet
    gate.open.set()
    with pytest.raises(HpcdemError):
        later.settle(COMM)


def test_an_error_of_entrusted_work_is_raised() -> None:
    later = Deliveries()

    def fail() -> None:
        raise HpcdemError("cannot write it: no")

    later.entrust(fail)
    with pytest.raises(HpcdemError, match="cannot write it: no"):
        later.settle(COMM)


def test_a_mistake_of_ours_is_not_swallowed() -> None:
    later = Deliveries()
    later.expect(None)
    later.put(lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        later.settle(COMM)


def test_no_more_waits_than_the_limit() -> None:
    later = Deliveries(limit=100)
    gate, done = Gate(later), []
    later.put(lambda: done.append(1), 1000)  # larger than the limit: goes when nothing else waits
    blocked = threading.Thread(target=lambda: later.put(lambda: done.append(2), 1))
    blocked.start()
    blocked.join(0.2)
    assert blocked.is_alive() and done == []
    gate.open.set()
    blocked.join(60)
    later.wait()
    assert done == [1, 2]


def test_pieces_may_come_in_any_order(tmp_path: Path) -> None:
    data = np.random.default_rng(1).integers(0, 256, 50_000).astype(np.uint8)
    cuts = np.unique(np.random.default_rng(2).integers(0, len(data), 2000))
    pieces = list(zip([0, *cuts], np.split(data, cuts)))
    file = RootFile(tmp_path / "a")
    written: list[int] = []
    for at, piece in [*pieces[1::2], *pieces[0::2][::-1]]:
        file.write(int(at), piece, lambda at=at: written.append(at))
    file.publish()
    assert file.error is None
    assert (tmp_path / "a").read_bytes() == data.tobytes()
    assert sorted(written) == [at for at, _ in pieces]
