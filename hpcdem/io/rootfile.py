"""A file that one rank writes in pieces, at once or behind the back of the run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.io.behind import Deliveries
from hpcdem.io.disk import explain, publish, remove

MOST_WAITING = 64 << 20
"""Bytes of pieces collected before they are written."""

_Piece = tuple[str, int, memoryview]  # part of the file, place in it, bytes
Description = tuple[dict[str, int], list[tuple[int, bytearray]], int]
"""Starts of the named parts of a file, pieces (place, bytes) that are no rows of them, size of the file."""
_MOST_PIECES = 512  # of one call; systems allow 1024


class RootFile:
    """A file that rank 0 makes under a temporary name. Its first error is kept in `error`, in one sentence; after that
    nothing is written, so that data of other ranks can still be received and no rank is left waiting.

    Pieces are collected, put in order, and written many at a time. With `later`, that is done behind the back of the
    caller: data handed in must not change.

    starts: where named parts of the file begin; size: its length, if given by `describe`.
    """

    def __init__(self, path: str | os.PathLike, later: Deliveries | None = None, temporary: str = "") -> None:
        self.path = os.fspath(path)
        self.temporary = temporary or self.path + ".tmp"
        self.error: str | None = None
        self._later, self._handle = later, -1
        self._pieces: list[_Piece] = []
        self._done: list[Callable[[], None]] = []
        self._waiting = 0
        self.starts = {"": 0}
        self.size = 0
        self._make: Callable[[], Description] | None = None
        self._do(self._open)

    def describe(self, make: Callable[[], Description]) -> None:
        """`make` returns the content of the file; it is called when the first pieces are written."""
        self._make = make

    def _describe(self, make: Callable[[], Description]) -> list[_Piece]:
        try:
            starts, pieces, self.size = make()
        except (RuntimeError, ValueError) as failure:  # as HDF5 calls its errors
            self.error = explain(self.path, failure)
            return []
        self.starts.update(starts)
        os.ftruncate(self._handle, self.size)
        return [("", at, memoryview(data)) for at, data in pieces]

    def write(self, at: int, data: Any, done: Callable[[], None] | None = None, part: str = "") -> None:
        """Put the bytes of an array or bytes into the file, `at` bytes after the start of a named part; `done` is
        called when they are written, or after an error. No two pieces may overlap."""
        piece = memoryview(data.reshape(-1).view(np.uint8).data if isinstance(data, np.ndarray) else data)
        self._pieces.append((part, at, piece))
        self._waiting += len(piece)
        if done is not None:
            self._done.append(done)
        if self._waiting >= MOST_WAITING:
            self._flush()

    def claim(self) -> None:
        """Get disk space for the size given by `describe`, holes included."""
        self._flush()
        self._do(lambda: os.posix_fallocate(self._handle, 0, self.size) if self.size else None)

    def close(self) -> None:
        """Write what is left and close it; it keeps its temporary name."""
        self._flush()
        self._always(self._close)

    def publish(self) -> None:
        """Close it and give it its name; after an error remove it."""
        self.close()
        self._do(lambda: publish(self.temporary, self.path))
        self._always(self._remove_if_broken)

    def abandon(self) -> None:
        """Close and remove it."""
        self._pieces.clear()
        self._always(self._close)
        self._always(lambda: remove(self.temporary))

    def _flush(self) -> None:
        pieces, done, size, make = self._pieces, self._done, self._waiting, self._make
        self._pieces, self._done, self._waiting, self._make = [], [], 0, None

        def write() -> None:
            described = self._describe(make) if make is not None else []
            if self.error is None:
                _write_pieces(self._handle, [*described, *pieces], self.starts)

        def finish() -> None:
            self._try(write)
            pieces.clear()
            for call in done:
                call()

        if pieces or done or make is not None:
            self._always(finish, size)

    def _do(self, action: Callable[[], None]) -> None:
        self._always(lambda: self._try(action))

    def _always(self, action: Callable[[], None], size: int = 0) -> None:
        if self._later is None:
            action()
        else:
            self._later.put(action, size)

    def _try(self, action: Callable[[], None]) -> None:
        if self.error is None:
            try:
                action()
            except OSError as failure:
                self.error = explain(self.path, failure)

    def _open(self) -> None:
        self._handle = os.open(self.temporary, os.O_RDWR | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0), 0o666)

    def _close(self) -> None:
        handle, self._handle = self._handle, -1
        if handle >= 0:
            try:
                os.close(handle)
            except OSError as failure:
                self.error = self.error or explain(self.path, failure)

    def _remove_if_broken(self) -> None:
        if self.error is not None:
            remove(self.temporary)


def _write_pieces(handle: int, pieces: list[_Piece], starts: dict[str, int]) -> None:
    """Pieces in any order: those that follow each other go in one call."""
    run: list[memoryview] = []
    begin = end = 0
    for at, piece in sorted(((starts[part] + at, piece) for part, at, piece in pieces), key=lambda p: p[0]):
        if run and (at != end or len(run) == _MOST_PIECES):
            _write_run(handle, run, begin)
            run = []
        if not run:
            begin = at
        run.append(piece)
        end = at + len(piece)
    if run:
        _write_run(handle, run, begin)


def _write_run(handle: int, run: list[memoryview], at: int) -> None:
    written = os.pwritev(handle, run, at)
    for piece in run:  # a nearly full disk takes a part, and says why at the next call
        left = piece[min(written, len(piece)) :]
        written -= len(piece) - len(left)
        at += len(piece) - len(left)
        while left:
            n = os.pwrite(handle, left, at)
            left, at = left[n:], at + n


@contextmanager
def root_file(path: str | os.PathLike, comm: Comm, later: Deliveries | None = None) -> Iterator[RootFile | None]:
    """Collective: rank 0's file, None on other ranks; it gets its name after the body, or is removed if that raises.

    Raises HpcdemError on all ranks if it cannot be written; with `later`, whoever settles the deliveries does.
    """
    file = RootFile(path, later) if comm.rank == 0 else None
    try:
        yield file
    except BaseException:
        if file is not None:
            file.abandon()
        raise
    if file is not None:
        file.publish()
    if later is None:
        comm.agree(file.error if file is not None else None)
    else:
        later.expect(file)
