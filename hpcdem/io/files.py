"""Files that are either whole or not there: written under a temporary name, flushed to the disk, then renamed.

All functions that take a communicator are collective. Only rank 0 touches the folder; what goes wrong there is
raised on every rank, in one sentence that names file and cause, and whatever stood under the name before is left
as it was. Data of other ranks comes to rank 0 in bounded pieces.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

import numpy as np

from hpcdem.errors import EXIT_USAGE, HpcdemError, UsageError
from hpcdem.io.textnum import TextTable

_T = TypeVar("_T")

PIECE = 4 << 20
"""Most bytes sent to rank 0 in one message."""

AHEAD = 64 << 20
"""Most bytes of text a rank keeps ready for rank 0."""

_TAG = 7301
_CAUSES = {
    errno.ENOSPC: "no space left on the disk",
    errno.EDQUOT: "the disk quota is used up",
    errno.EROFS: "the file system is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.ENOENT: "the folder does not exist",
    errno.ENOTDIR: "a part of the path is not a folder",
    errno.EISDIR: "a folder has this name",
    errno.EFBIG: "the file would be larger than is allowed here",
    errno.EIO: "the disk reports an input/output error",
}


def explain(path: str | os.PathLike, error: BaseException, doing: str = "write") -> str:
    """One sentence: what could not be done to which file, and why. Reads the errno inside HDF5's long messages too."""
    number = error.errno if isinstance(error, OSError) else None
    if number is None and (found := re.search(r"errno = (\d+)", str(error))):
        number = int(found[1])
    if number in _CAUSES:
        cause = _CAUSES[number]
    elif number is not None and 0 < number < 200:
        cause = os.strerror(number)
    else:
        cause = str(error).strip() or type(error).__name__
    return f"cannot {doing} {os.fspath(path)}: {cause}"


class Alone:
    """The little that is asked of a communicator here, for one process that writes a file of its own."""

    rank, size = 0, 1

    def agree(self, error: str | None) -> None:
        if error is not None:
            raise HpcdemError(error)


@contextmanager
def atomic_path(path: str | os.PathLike, comm: Any = Alone()) -> Iterator[str]:  # noqa: B008
    """Collective. Hands out ``path.tmp``; when the body is done on all ranks, that file takes the name `path`.

    An OSError or HpcdemError on any rank removes the temporary file and raises HpcdemError on all ranks. The body
    must not leave other ranks waiting in an exchange: raise only after the last one (see `RootWriter`).
    """
    path = os.fspath(path)
    temporary = path + ".tmp"
    error: str | None = None
    try:
        yield temporary
    except OSError as failure:
        error = explain(path, failure)
    except HpcdemError as failure:
        error = str(failure)
    except BaseException:
        if comm.rank == 0:
            _remove(temporary)
        raise
    try:
        comm.agree(error)
        if comm.rank == 0:
            try:
                _to_disk(temporary)
                os.replace(temporary, path)
                _folder_to_disk(path)
            except OSError as failure:
                error = explain(path, failure)
        comm.agree(error)
    except HpcdemError:
        if comm.rank == 0:
            _remove(temporary)
        raise


def _to_disk(path: str) -> None:
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _folder_to_disk(path: str) -> None:
    """Make the new name itself durable; not every file system can, and the file is good without."""
    with suppress(OSError):
        handle = os.open(os.path.dirname(path) or ".", os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _remove(path: str) -> None:
    with suppress(OSError):
        os.remove(path)


def on_first(comm: Any, action: Callable[[], _T]) -> _T:
    """Collective: what `action` gives on rank 0, on all ranks; its HpcdemError or OSError too."""
    result, error = None, None
    if comm.rank == 0:
        try:
            result = action()
        except HpcdemError as failure:
            error = str(failure), failure.exit_code
        except OSError as failure:
            error = explain(failure.filename or "the results", failure), HpcdemError.exit_code
    result, error = comm.bcast((result, error))
    if error is not None:
        raise (UsageError if error[1] == EXIT_USAGE else HpcdemError)(error[0])
    return result  # type: ignore[return-value]


def make_folder(path: str | os.PathLike, comm: Any) -> None:
    """Collective: the folder exists afterwards on all ranks. Raises HpcdemError."""
    error = None
    if comm.rank == 0:
        try:
            os.makedirs(path, exist_ok=True)
        except OSError as failure:
            error = explain(path, failure, "make the folder")
    comm.agree(error)


def stream_to_root(comm: Any, rows: np.ndarray | TextTable) -> Iterator[np.ndarray]:
    """Collective generator, to be run to its end on every rank: yields pieces on rank 0 only.

    Rank 0's own rows come first, then those of rank 1, 2, ... one rank at a time, in pieces of at most about PIECE
    bytes, each valid until the next is asked for. `rows`: an array (same dtype and trailing shape on all ranks) or
    a TextTable, whose text is made piece by piece.
    """
    if comm.rank > 0:
        comm.mpi.Recv(np.empty(1, dtype=np.int64), source=0, tag=_TAG)  # rank 0 is ready for this rank
        for piece in _pieces(rows):
            comm.mpi.Send(np.array([len(piece)], dtype=np.int64), dest=0, tag=_TAG)
            comm.mpi.Send(_bytes_of(piece), dest=0, tag=_TAG)
        comm.mpi.Send(np.zeros(1, dtype=np.int64), dest=0, tag=_TAG)
        return
    yield from _pieces(rows)
    count = np.empty(1, dtype=np.int64)
    tail, dtype = ((), np.dtype(np.uint8)) if isinstance(rows, TextTable) else (rows.shape[1:], rows.dtype)
    for rank in range(1, comm.size):
        comm.mpi.Send(count, dest=rank, tag=_TAG)
        while True:
            comm.mpi.Recv(count, source=rank, tag=_TAG)
            if count[0] == 0:
                break
            piece = np.empty((int(count[0]), *tail), dtype=dtype)
            comm.mpi.Recv(_bytes_of(piece), source=rank, tag=_TAG)
            yield piece


def arrays_to_root(comm: Any, parts: Sequence[tuple[np.ndarray, int]]) -> Iterator[tuple[int, int, np.ndarray]]:
    """Collective generator, to be run to its end on every rank: brings pieces of distributed arrays to rank 0.

    parts: this rank's rows of each array, and the global row they start at; same number, dtypes and trailing shapes
    on all ranks. Yields, on rank 0 only, (number of the array, global row, rows): first those of rank 0, then of
    rank 1, ... in pieces of at most about PIECE bytes.
    """
    table = np.array([(offset, len(rows)) for rows, offset in parts], dtype=np.int64).reshape(-1, 2)
    if comm.rank > 0:
        comm.mpi.Recv(np.empty(1, dtype=np.int64), source=0, tag=_TAG)  # rank 0 is ready for this rank
        comm.mpi.Send(table, dest=0, tag=_TAG)
        for rows, _ in parts:
            for piece in _pieces(rows):
                comm.mpi.Send(_bytes_of(piece), dest=0, tag=_TAG)
        return
    for rank in range(comm.size):
        if rank:
            comm.mpi.Send(np.zeros(1, dtype=np.int64), dest=rank, tag=_TAG)
            comm.mpi.Recv(table, source=rank, tag=_TAG)
        for k, (mine, _) in enumerate(parts):
            at, end = int(table[k, 0]), int(table[k].sum())
            for piece in _pieces(mine) if rank == 0 else _received(comm, rank, mine, end - at):
                yield k, at, piece
                at += len(piece)


def _received(comm: Any, rank: int, like: np.ndarray, n: int) -> Iterator[np.ndarray]:
    """n rows of the kind of `like`, cut as the sender cuts them."""
    step = _rows_of_a_piece(like)
    for a in range(0, n, step):
        piece = np.empty((min(step, n - a), *like.shape[1:]), dtype=like.dtype)
        comm.mpi.Recv(_bytes_of(piece), source=rank, tag=_TAG)
        yield piece


def _rows_of_a_piece(rows: np.ndarray) -> int:
    return max(1, PIECE // max(1, rows.itemsize * int(np.prod(rows.shape[1:]))))


def _pieces(rows: np.ndarray | TextTable) -> Iterator[np.ndarray]:
    if isinstance(rows, TextTable):
        yield from rows.blocks()
        return
    step = _rows_of_a_piece(rows)
    for a in range(0, len(rows), step):
        yield np.ascontiguousarray(rows[a : a + step])


def _bytes_of(array: np.ndarray) -> np.ndarray:
    return array.reshape(-1).view(np.uint8)


Section = bytes | TextTable


def write_sections(path: str | os.PathLike, comm: Any, build: Callable[[], Sequence[Section]]) -> None:
    """Collective: write a file of sections, each either bytes (rank 0's are taken) or a table in slabs by rank.

    `build` is called on every rank and must return the same kinds of section in the same order everywhere; it may
    be collective. The bytes of the file do not depend on the rank count. Raises HpcdemError on all ranks.
    """
    with atomic_path(path, comm) as temporary:
        writer = RootWriter(path, temporary, comm)
        sections: Sequence[Section] = ()
        error = None
        try:
            sections = build()
        except (HpcdemError, ValueError) as failure:
            error = f"cannot write {os.fspath(path)}: {failure}"
        try:
            comm.agree(error)
            for section in sections if comm.rank == 0 else _made_ahead(sections):
                if isinstance(section, bytes):
                    writer.write(section)
                else:
                    for piece in stream_to_root(comm, section):
                        writer.write(piece)
        finally:
            writer.close()


_scratch = np.empty(0, dtype=np.uint8)


def _made_ahead(sections: Sequence[Section]) -> list[bytes | TextTable | np.ndarray]:
    """The sections with tables turned into text while rank 0 is still busy with its own, up to AHEAD bytes of it.

    The text stands in memory that is kept for the next file, and is valid until then.
    """
    global _scratch
    result: list[bytes | TextTable | np.ndarray] = []
    sizes = [s.rows * s.width if isinstance(s, TextTable) else 0 for s in sections]
    needed = min(sum(sizes), AHEAD)
    if len(_scratch) < needed:
        _scratch = np.empty(needed, dtype=np.uint8)
    at = 0
    for section, size in zip(sections, sizes):
        if not isinstance(section, TextTable) or at + size > needed:
            result.append(section)
            continue
        start = at
        for block in section.blocks():
            _scratch[at : at + len(block)] = block
            at += len(block)
        result.append(_scratch[start:at])
    return result


class RootWriter:
    """Rank 0's file; nothing on other ranks. Keeps the first error back until `close`, so that data sent by other
    ranks is still received and no rank is left waiting."""

    def __init__(self, path: str | os.PathLike, temporary: str, comm: Any) -> None:
        self._error: OSError | None = None
        self._file: Any = None
        if comm.rank == 0:
            try:
                self._file = open(temporary, "wb", buffering=1 << 20)
            except OSError as failure:
                self._error = failure

    def write(self, data: bytes | np.ndarray) -> None:
        """Append."""
        if self._file is None or self._error is not None:
            return
        try:
            self._file.write(data)
        except OSError as failure:
            self._error = failure

    def close(self) -> None:
        """Close the file. Raises the first OSError there was."""
        if self._file is not None:
            try:
                self._file.close()
            except OSError as failure:
                self._error = self._error or failure
            self._file = None
        if self._error is not None:
            raise self._error
