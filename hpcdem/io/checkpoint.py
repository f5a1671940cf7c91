"""`.sav` files: HDF5, in the order of ids, free of ranks and threads.

Layout: attributes `format`, `version`, `state` (JSON: everything that is not a table) on the root; one group per table,
one dataset per column. The root attribute `sums` (JSON) holds a checksum of each dataset, and `crc` the CRC-32 of
`state` and `sums`; they are compared after writing, before the file gets its name, and again on reading. Behind the
HDF5 part is a seal (`io/seal.py`), which is checked first.

A file of an earlier version of this layout is read by all later programs; one of a later version is refused.

| version | since then |
|---|---|
| 1 | checksums of datasets: sum of their 64-bit words |
| 2 | `crc` |
| 3 | each word is mixed with its place before it is added up, so that rows that changed places are noticed too |
| 4 | the seal; tables `clumps` and `clump_members`, where there are clumps |
| 5 | ids 100 to 103 and a column `side` of BOX; pressures of materials, `rubber`; fast particles, rows of GLINE |
"""

from __future__ import annotations

import json
import math
import os
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io import seal
from hpcdem.io.agreed import on_first
from hpcdem.io.frame import Table
from hpcdem.io.h5 import reading, writing_to
from hpcdem.io.parts import read_parts, share

FORMAT = "hpcdem checkpoint"
VERSION = 9

BLOCKS, BOTH = "blocks", "coupled"
"""Values of `kind` in the state: a model of blocks, one of particles and blocks; a model of particles has none."""
OF_PARTICLES, LINKS = "discs_", "disc_contacts"
"""Prefix of the names of the particles' tables in a file of both models; table of the contacts between them."""

_PART = 1 << 18
"""Number of words mixed at a time."""
_ALL_BITS = (1 << 64) - 1


def word_sum(values: np.ndarray, first: int = 0) -> int:
    """Sum of the 64-bit words of an array modulo 2^64, whatever their order: the checksum of versions 1 and 2. first:
    as of `placed_sum`, but of no effect."""
    return int(np.add.reduce(_words(values), dtype=np.uint64))


def placed_sum(values: np.ndarray, first: int = 0) -> int:
    """Sum modulo 2^64 of the 64-bit words of an array, each mixed with its place: the sums of slabs add up to that of
    the dataset, in any order.

    first: row of the dataset at which `values` begin. The mixing is a multiplication by an odd number between two
    shifts, as in the finalisers of MurmurHash3 and SplitMix64 (Appleby 2011; Steele et al. 2014).
    """
    words = _words(values)
    start = first * (words.size // max(len(values), 1))
    total = 0
    with np.errstate(over="ignore"):
        for at in range(0, words.size, _PART):
            part = words[at : at + _PART]
            place = np.arange(start + at + 1, start + at + 1 + len(part), dtype=np.uint64)
            mixed = part ^ (place * np.uint64(0x9E3779B97F4A7C15))
            mixed ^= mixed >> np.uint64(32)
            mixed *= np.uint64(0xD6E8FEB86659FD93)
            mixed ^= mixed >> np.uint64(32)
            total += int(np.add.reduce(mixed, dtype=np.uint64))
    return total & _ALL_BITS


def _words(values: np.ndarray) -> np.ndarray:
    wide = np.ascontiguousarray(values)
    wide = wide if wide.dtype.itemsize == 8 else wide.astype(np.int64)
    return wide.reshape(-1).view(np.uint64)


def _crc(state: str, sums: str) -> int:
    return zlib.crc32(sums.encode("utf-8", "surrogateescape"), zlib.crc32(state.encode("utf-8", "surrogateescape")))


def write(path: str | os.PathLike, state: Mapping[str, Any], tables: Mapping[str, Table], comm: Comm) -> None:
    """Collective. Writes to a temporary name, reads it back, then renames. HpcdemError on all ranks if anything
    fails."""

    def read_back(temporary: str) -> None:
        try:
            _seal(temporary, list(columns))
            _verify(temporary)
        except HpcdemError as failure:
            raise HpcdemError(f"checkpoint {os.fspath(path)} could not be read back after writing: {failure}") from None

    columns = {
        f"{name}/{c}": placed_sum(values, table.offset)
        for name, table in tables.items()
        for c, values in table.columns.items()
    }
    parts = np.array(list(columns.values()), dtype=np.uint64)
    sums = dict(zip(columns, comm.sum_into(parts).tolist()))  # integers without sign go round, as they should
    with writing_to(path, comm, read_back) as writer:
        for table_name, table in tables.items():
            writer.group(table_name)
            for name, values in table.columns.items():
                writer.slabs(f"{table_name}/{name}", values, table.offset, table.total)
        texts = {"state": json.dumps(state), "sums": json.dumps(sums)}
        writer.group("/", {"format": FORMAT, "version": VERSION, **texts, "crc": _crc(**texts)})


Tables = dict[str, dict[str, np.ndarray]]
"""Columns by name, by the name of the table."""


def read(
    path: str | os.PathLike,
    comm: Comm = SerialComm(),  # noqa: B008
    whole: Callable[[str], bool] = lambda table: False,
) -> tuple[dict[str, Any], Tables]:
    """Collective: the state of a checkpoint, on all ranks, and of every table this rank's rows. HpcdemError on all
    ranks says what is wrong with the file.

    The rows of a table are shared out in slabs of nearly equal size, in the order of the file. whole: whether all ranks
    get all rows of the table of this name (one copy per node of the machine). No rank reads more than it keeps, and
    every row is checked by somebody.
    """
    state, columns, check = on_first(comm, lambda: _contents(path))
    places = []
    for full, column in columns.items():
        n = column.shape[0]
        places.append((0, n if comm.rank == 0 else 0) if whole(full.split("/")[0]) else share(n, comm))
    raw = read_parts(comm, path, [column.part(*place) for column, place in zip(columns.values(), places)])
    found = [column.values(rows) for column, rows in zip(columns.values(), raw)]
    sums = np.array([check(values, first) for values, (first, _) in zip(found, places)], dtype=np.uint64)
    _compare(path, columns, comm.sum_into(sums).tolist())
    tables: Tables = {}
    for full, values in zip(columns, found):
        table, name = full.split("/")
        tables.setdefault(table, {})[name] = _of_all(comm, values) if whole(table) else values
    return state, tables


def _of_all(comm: Comm, values: np.ndarray) -> np.ndarray:
    """Share the values that rank 0 has read, with one copy per node of the machine."""
    return comm.per_node(lambda: values, once=True)


def _verify(path: str | os.PathLike) -> None:
    """HpcdemError if the file is not what it says; a piece at a time."""
    _, columns, check = _contents(path)
    sums = []
    for column in columns.values():
        n = column.shape[0]
        step = max(1, 8 * _PART // max(column.row, 1))
        pieces = [(at, min(at + step, n)) for at in range(0, n, step)]
        found = [check(column.values(read_parts(SerialComm(), path, [column.part(*p)])[0]), p[0]) for p in pieces]
        sums.append(sum(found) & _ALL_BITS)
    _compare(path, columns, sums)


def _compare(path: str | os.PathLike, columns: Mapping[str, _Column], sums: Sequence[int]) -> None:
    for (full, column), found in zip(columns.items(), sums):
        if found != column.sum:
            raise HpcdemError(f"{os.fspath(path)} is damaged: checksum of {full} is wrong")


@dataclass(frozen=True)
class _Column:
    """Location of a dataset in the file: first byte of its contiguous rows; shape; type; checksum."""

    first: int
    shape: tuple[int, ...]
    dtype: np.dtype
    sum: int

    @property
    def row(self) -> int:
        """Bytes of a row."""
        return self.dtype.itemsize * math.prod(self.shape[1:])

    def part(self, begin: int, end: int) -> tuple[int, int]:
        """The bytes of these rows."""
        return self.first + begin * self.row, self.first + end * self.row

    def values(self, rows: np.ndarray) -> np.ndarray:
        """Rows from their bytes."""
        return rows.view(self.dtype).reshape(-1, *self.shape[1:])


def _contents(path: str | os.PathLike) -> tuple[dict[str, Any], dict[str, _Column], Callable[..., int]]:
    """State, places of the datasets, and the function of their checksums; on this process alone."""
    with _opened(path) as (file, state, sums, check):
        size = os.path.getsize(path)
        columns = {}
        for full, expected in sums.items():
            data = file[full]
            table, name = full.split("/")
            first = data.id.get_offset()
            if not (table and name and data.shape and data.dtype.kind in "biuf"):
                raise HpcdemError(f"{os.fspath(path)} is damaged: {full} is not a numeric column")
            if data.nbytes > size:  # a size that is wrong must not be asked of the memory
                raise HpcdemError(f"{os.fspath(path)} is damaged: {full} would be larger than the file")
            if first is None and data.nbytes:
                raise HpcdemError(f"{os.fspath(path)} is damaged: the rows of {full} are not contiguous")
            columns[full] = _Column(first or 0, data.shape, data.dtype, expected)
        return state, columns, check


def read_state(path: str | os.PathLike) -> dict[str, Any]:
    """State alone: quick, whatever the size of the tables, which are not checked. HpcdemError as for `read`."""
    with _opened(path) as (_, state, _, _):
        return state


def version_of(path: str | os.PathLike) -> int:
    """Version of the layout. HpcdemError if it is no checkpoint."""
    with _opened(path) as (file, *_):
        return int(file.attrs["version"])


def _seal(path: str | os.PathLike, names: Sequence[str]) -> None:
    """Put a seal on a finished file with these datasets."""
    with reading(path) as file:
        rows = [(file[name].id.get_offset() or 0, int(file[name].nbytes)) for name in names]
    seal.put(path, rows)


HDF5 = b"\x89HDF\r\n\x1a\n"


def _refuse_other_formats(path: str | os.PathLike) -> None:
    """HpcdemError for a file that is not HDF5 at all; a .sav of ZDEM most likely."""
    try:
        with open(path, "rb") as file:
            start = file.read(len(HDF5))
    except OSError:
        return  # `reading` says why
    if start != HDF5:
        raise HpcdemError(
            f"{os.fspath(path)} is not an hpcdem checkpoint. Only ZDEM reads its own .sav files: use LOAD with a "
            "frame all_<step>.dat of that run (particles with velocities and properties, walls, bonds if present) or "
            "with a file of EXP (x y r), or write the .sav with hpcdem"
        )


@contextmanager
def _opened(path: str | os.PathLike) -> Iterator[tuple[Any, dict[str, Any], dict[str, int], Callable]]:
    """The open file, its state, the checksums of its datasets, and the function that makes them."""
    try:
        sealed = seal.check(path)
    except seal.Broken as problem:
        raise HpcdemError(f"{os.fspath(path)} is damaged: {problem}") from None
    except OSError:
        sealed = False  # `reading` says why it cannot be opened
    _refuse_other_formats(path)
    with reading(path) as file:
        try:
            if file.attrs.get("format") != FORMAT:
                raise HpcdemError(f"{os.fspath(path)} is not an hpcdem checkpoint")
            version = int(file.attrs["version"])
            if version > VERSION:
                raise HpcdemError(
                    f"{os.fspath(path)} has checkpoint version {version}, this program reads up to {VERSION}"
                )
            if version > 3 and not sealed:
                raise HpcdemError(f"{os.fspath(path)} is damaged: its seal is missing")
            texts = {name: str(file.attrs[name]) for name in ("state", "sums")}
            if version > 1 and int(file.attrs["crc"]) != _crc(**texts):
                raise HpcdemError(f"{os.fspath(path)} is damaged: checksum of its state is wrong")
            state, sums = json.loads(texts["state"]), json.loads(texts["sums"])
            yield file, state, sums, word_sum if version < 3 else placed_sum
        except (AttributeError, KeyError, OSError, TypeError, ValueError, RuntimeError) as problem:
            raise HpcdemError(f"{os.fspath(path)} is damaged: {problem}") from None
