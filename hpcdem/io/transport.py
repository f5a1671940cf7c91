"""Transfer of bytes to rank 0 in blocks of bounded size, from one rank after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.io.rootfile import RootFile
from hpcdem.io.textnum import TextTable

PIECE = 4 << 20
"""Most bytes sent to rank 0 in one message."""

AHEAD = 64 << 20
"""Most bytes a rank keeps ready for rank 0, and most bytes of blocks that are kept for the next file."""

_TAG = 7301

Section = bytes | TextTable
"""A part of a text file."""


class _Buffers:
    """Memory in blocks of PIECE bytes that is kept for the next file: new memory costs more than what is written into
    it. Safe to use from several threads, as lists are."""

    def __init__(self) -> None:
        self._free: list[np.ndarray] = []

    def take(self) -> np.ndarray:
        """A block (PIECE,) u1; what it holds is anything."""
        try:
            return self._free.pop()
        except IndexError:
            return np.empty(PIECE, dtype=np.uint8)

    def give_back(self, block: np.ndarray) -> None:
        """Nobody needs its contents any more."""
        if len(self._free) < AHEAD // PIECE:
            self._free.append(block)


_buffers = _Buffers()

Block = tuple[np.ndarray, int]
"""A block of `_buffers` and the number of bytes that count."""


def rows_in_blocks(arrays: Sequence[np.ndarray]) -> Iterator[Block]:
    """The bytes of arrays, one array after the other, in blocks that are full but for the last."""
    block, n = _buffers.take(), 0
    for array in arrays:
        left = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
        while len(left):
            part = min(len(left), PIECE - n)
            block[n : n + part] = left[:part]
            left, n = left[part:], n + part
            if n == PIECE:
                yield block, n
                block, n = _buffers.take(), 0
    yield block, n


def text_in_blocks(sections: Sequence[Section]) -> Iterator[Block]:
    """The text of sections in sequence, in blocks that end where a row of a table does."""
    block, n = _buffers.take(), 0
    for section in sections:
        done, rows, width = 0, *size_of(section)
        while done < rows:
            part = min(rows - done, (PIECE - n) // width)
            if part == 0:
                if n == 0:
                    raise ValueError(f"a row of {width} bytes is too long")
                yield block, n
                block, n = _buffers.take(), 0
                continue
            part_of_block = block[n : n + part * width]
            if isinstance(section, bytes):
                part_of_block[:] = np.frombuffer(section, dtype=np.uint8)[done : done + part]
            else:
                section.write_rows(done, part, part_of_block)
            done, n = done + part, n + part * width
    yield block, n


def size_of(section: Section) -> tuple[int, int]:
    """Rows and bytes per row."""
    return (len(section), 1) if isinstance(section, bytes) else (section.rows, section.width)


def to_root(comm: Comm, blocks: Iterator[Block]) -> Iterator[tuple[int, np.ndarray]]:
    """Collective generator, to be run to its end on every rank: on rank 0, yields (rank, bytes) for the blocks of rank
    1, 2, ... one rank after the other, each valid until it is handed to `used`.

    Other ranks make up to AHEAD bytes of blocks before their turn comes, while rank 0 is busy with its own.
    """
    count = np.zeros(1, dtype=np.int64)
    if comm.rank > 0:
        ahead, size = [], 0
        for block in blocks:
            ahead.append(block)
            size += PIECE
            if size >= AHEAD:
                break
        comm.mpi.Recv(count, source=0, tag=_TAG)  # rank 0 is ready for this rank
        for data, n in chain(ahead, blocks):
            if n:
                comm.mpi.Send(np.array([n], dtype=np.int64), dest=0, tag=_TAG)
                comm.mpi.Send(data[:n], dest=0, tag=_TAG)
            used(data)
        comm.mpi.Send(np.zeros(1, dtype=np.int64), dest=0, tag=_TAG)
        return
    for rank in range(1, comm.size):
        comm.mpi.Send(count, dest=rank, tag=_TAG)
        while True:
            comm.mpi.Recv(count, source=rank, tag=_TAG)
            if count[0] == 0:
                break
            data = _buffers.take()
            comm.mpi.Recv(data[: int(count[0])], source=rank, tag=_TAG)
            yield rank, data[: int(count[0])]


def used(data: np.ndarray) -> None:
    """Give back the memory of a block or of a piece of it that starts where the block does."""
    _buffers.give_back(data if data.base is None else data.base)


class Places:
    """Places of consecutive bytes of one rank in a file: runs (part of the file, place in it, bytes)."""

    def __init__(self, runs: Iterable[tuple[str, int, int]]) -> None:
        self._runs = [run for run in runs if run[2]]
        self._next = self._taken = 0

    def write(self, file: RootFile, data: np.ndarray, done: Callable[[], None]) -> None:
        """Put the next bytes where they belong; then call `done`."""
        if not len(data):
            done()
        while len(data):
            part, at, size = self._runs[self._next]
            n = min(size - self._taken, len(data))
            piece, data = data[:n], data[n:]
            file.write(at + self._taken, piece, None if len(data) else done, part)
            self._taken += n
            if self._taken == size:
                self._next, self._taken = self._next + 1, 0
