"""Checkpoint files: checksums that know places, versions, and what is said of damaged files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import checkpoint, seal
from hpcdem.io.frame import Table
from tests.tables import each

STATE = {"clock": {"step": 12, "time": 0.1}, "script": "START\n", "position": 3}


def tables(n: int = 1000) -> dict[str, Table]:
    rng = np.random.default_rng(1)
    columns = {"gid": np.arange(n), "x": rng.normal(size=n), "fix": rng.integers(0, 7, n).astype(np.int32)}
    return {"particles": Table(columns, 0, n), "pairs": Table({"gid": np.empty(0, np.int64)}, 0, 0)}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "0000000012.sav"
    checkpoint.write(path, STATE, tables(), SerialComm())
    return path


@contextmanager
def resealed(path: Path) -> Iterator[h5py.File]:
    """The file, to be changed, and sealed again then, as if it had been written so."""
    with h5py.File(path, "r+") as opened:
        yield opened
        names = list(json.loads(opened.attrs["sums"]))
    checkpoint._seal(path, names)


def test_it_comes_back(file):
    state, found = checkpoint.read(file)
    assert state == STATE == checkpoint.read_state(file)
    for name, values in tables()["particles"].columns.items():
        assert np.array_equal(found["particles"][name], values)


def test_rows_of_several_numbers_come_back_and_are_checked(tmp_path):
    """Rows are found by their bytes; one bit in the last of them is noticed."""
    values = np.random.default_rng(4).normal(size=(50, 3))
    checkpoint.write(tmp_path / "a.sav", STATE, {"places": Table({"x": values}, 0, 50)}, SerialComm())
    assert np.array_equal(checkpoint.read(tmp_path / "a.sav")[1]["places"]["x"], values)
    with h5py.File(tmp_path / "a.sav") as opened:
        at = opened["places/x"].id.get_offset() + opened["places/x"].nbytes - 1
    whole = bytearray((tmp_path / "a.sav").read_bytes())
    whole[at] ^= 1
    (tmp_path / "a.sav").write_bytes(whole)
    with pytest.raises(HpcdemError, match="checksum of places/x is wrong"):
        checkpoint.read(tmp_path / "a.sav")


@pytest.mark.parametrize("dtype", [np.float64, np.int64, np.int32])
def test_checksums_of_slabs_add_up(dtype):
    values = np.random.default_rng(2).integers(-(2**31), 2**31 - 1, (1001, 3)).astype(dtype)
    whole = checkpoint.placed_sum(values)
    cuts = [0, 1, 400, 400, 1001]
    parts = [checkpoint.placed_sum(values[a:b], a) for a, b in pairwise(cuts)]
    assert sum(parts) % 2**64 == whole


def test_long_arrays_are_summed_in_parts(monkeypatch):
    values = np.random.default_rng(3).normal(size=1000)
    whole = checkpoint.placed_sum(values)
    monkeypatch.setattr(checkpoint, "_PART", 7)
    assert checkpoint.placed_sum(values) == whole


def test_rows_that_changed_places_are_noticed(file):
    """The sum of words, as earlier versions had it, does not see them."""
    with resealed(file) as opened:
        x = opened["particles/x"][...]
        before = checkpoint.word_sum(x)
        x[[3, 4]] = x[[4, 3]]
        opened["particles/x"][...] = x
    assert checkpoint.word_sum(x) == before
    with pytest.raises(HpcdemError, match="checksum of particles/x is wrong"):
        checkpoint.read(file)


@pytest.mark.parametrize("bit", range(0, 64, 7))
def test_one_bit_is_noticed(file, bit):
    with resealed(file) as opened:
        gid = opened["particles/gid"][...]
        gid.view(np.uint64)[500] ^= np.uint64(1 << bit)
        opened["particles/gid"][...] = gid
    with pytest.raises(HpcdemError, match="checksum of particles/gid is wrong"):
        checkpoint.read(file)


def test_a_changed_state_is_noticed(file):
    with resealed(file) as opened:
        opened.attrs["state"] = json.dumps(STATE | {"position": 4})
    for look in (checkpoint.read, checkpoint.read_state):
        with pytest.raises(HpcdemError, match="checksum of its state is wrong"):
            look(file)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_earlier_versions_are_read(file, version):
    """As programs of that time wrote them: no seal, before version 3 sums of words, and before version 2 no crc."""
    old = {1: checkpoint.word_sum, 2: checkpoint.word_sum, 3: checkpoint.placed_sum}
    with h5py.File(file, "r+") as opened:  # which takes the seal off
        sums = json.loads(opened.attrs["sums"])
        text = json.dumps({name: old[version](opened[name][...]) for name in sums})
        opened.attrs["sums"], opened.attrs["version"] = text, version
        opened.attrs["crc"] = checkpoint._crc(opened.attrs["state"], text)
        if version == 1:
            del opened.attrs["crc"]
    assert checkpoint.read(file)[0] == STATE and checkpoint.version_of(file) == version
    with h5py.File(file, "r+") as opened:
        opened["particles/x"][0] = 7.0
    with pytest.raises(HpcdemError, match="checksum of particles/x is wrong"):
        checkpoint.read(file)


def test_a_later_version_is_refused(file):
    with h5py.File(file, "r+") as opened:
        opened.attrs["version"] = checkpoint.VERSION + 1
    with pytest.raises(HpcdemError, match=f"version {checkpoint.VERSION + 1}, this program reads up to"):
        checkpoint.read_state(file)


@pytest.mark.parametrize("length", [0, 1, 8, 100, 1000, 5000])
def test_a_cut_file_is_damaged(file, length):
    file.write_bytes(file.read_bytes()[:length])
    with pytest.raises(HpcdemError):
        checkpoint.read(file)


def test_what_describes_the_rows_is_under_seal(file):
    """One bit of any byte outside the rows: HDF5 is not asked to read it. The last eight bytes say that there is a
    seal; without them it is missing."""
    whole = file.read_bytes()
    assert seal.check(file)
    with h5py.File(file) as opened:
        rows = [(column.id.get_offset(), column.nbytes) for column in opened["particles"].values()]
    rng = np.random.default_rng(4)
    for at in rng.permutation(len(whole))[:500].tolist():
        if any(first <= at < first + size for first, size in rows):
            continue
        file.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << int(rng.integers(8)))]) + whole[at + 1 :])
        if at >= len(whole) - 8:
            assert not seal.check(file)
        else:
            with pytest.raises(seal.Broken):
                seal.check(file)
        with pytest.raises(HpcdemError, match=r"is damaged: (checksum of its description is wrong|its seal is)"):
            checkpoint.read(file)


@each(
    "text",
    [b"", b"{}", b"[]", b"nonsense", b'{"length": 3, "rows": []}', b'{"length": 3, "rows": [[2, 9], [1, 1]]}',
     b'{"length": 3, "rows": [[0, 1e400]]}', b'{"length": 3, "rows": [["a"]]}', b'{"length": 3, "rows": [[-5, 1]]}'],
)  # fmt: skip
@each("count", [None, 0, 2**64 - 1])
def test_a_seal_that_makes_no_sense_is_broken(tmp_path, text, count):
    path = tmp_path / "x"
    path.write_bytes(b"abc" + text + seal._END.pack(len(text) if count is None else count, 7, seal.MARK))
    with pytest.raises(seal.Broken):
        seal.check(path)


def test_files_without_a_seal(tmp_path):
    path = tmp_path / "x"
    for text in (b"", b"abc", bytes(100)):
        path.write_bytes(text)
        assert not seal.check(path)
    seal.put(path, [(10, 5), (40, 60), (20, 0)])
    assert seal.check(path)
