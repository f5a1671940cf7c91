"""HDF5 files that many ranks write together: one dataset per column, one slab of it per rank.

With an h5py that has MPI, all ranks write their slabs collectively; otherwise the slabs pass through rank 0 one at
a time in bounded pieces. Layout and content are the same either way.
"""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

# Locks fail or block on many network file systems, and a finished file may be looked at while the run goes on.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

import h5py
import numpy as np

from hpcdem.errors import HpcdemError
from hpcdem.io.files import atomic_path, explain, stream_to_root

_FAILURES = (OSError, RuntimeError, ValueError)


def has_mpi(comm: Any) -> bool:
    """Whether this h5py can write through `comm` in parallel."""
    return comm.mpi is not None and comm.size > 1 and bool(h5py.get_config().mpi)


class _Patient:
    """A binary file that keeps its first error to itself and pretends all is well.

    HDF5 cannot be trusted with a full disk: it keeps the data it could not write, tries again when objects are freed,
    and ends the process. So it is told nothing, and what was written is thrown away afterwards.
    """

    def __init__(self, path: str) -> None:
        self.error: OSError | None = None
        self._at = self._size = 0
        self._file = open(path, "w+b", buffering=0)

    def _do(self, action: Callable[[], Any]) -> Any:
        if self.error is None:
            try:
                return action()
            except OSError as failure:
                self.error = failure
        return None

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def write(self, data: Any) -> int:
        left, at, size = memoryview(data).cast("B"), self._at, len(data)
        while left and self.error is None:
            left = left[self._do(lambda: os.pwrite(self._file.fileno(), left, at)) or 0 :]  # noqa: B023
            at = self._at + size - len(left)
        self._at += size
        self._size = max(self._size, self._at)
        return size

    def readinto(self, buffer: Any) -> int:
        view = memoryview(buffer).cast("B")
        view[:] = bytes(len(view))
        self._do(lambda: os.preadv(self._file.fileno(), [view], self._at))
        self._at += len(view)
        return len(view)

    def read(self, size: int) -> bytes:
        data = bytearray(size)
        self.readinto(data)
        return bytes(data)

    def truncate(self, size: int | None = None) -> int:
        self._size = self._at if size is None else size
        self._do(lambda: os.ftruncate(self._file.fileno(), self._size))
        return self._size

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        self._do(self._file.close)


class Writer:
    """An HDF5 file being written by all ranks of `comm`. Every method is collective and takes the same names, types
    and totals on all ranks. Errors are kept back until `close`, so that no rank waits for another."""

    def __init__(self, path: str, temporary: str, comm: Any, expected: int = 0) -> None:
        self._path, self.comm = path, comm
        self._parallel = has_mpi(comm)
        self._error: str | None = None
        self._file: Any = None
        self._below: _Patient | None = None
        if self._parallel:
            # Ask for the space, and for the file, in a plain way first: with many ranks inside HDF5 it is too late.
            if comm.rank == 0:
                self._try(lambda: _claim(temporary, expected))
            comm.agree(self._error)
            self._try(lambda: self._open(temporary, driver="mpio", comm=comm.mpi))
        elif comm.rank == 0:
            self._try(lambda: self._open_below(temporary))

    def _open(self, target: Any, **driver: Any) -> None:
        self._file = h5py.File(target, "w", **driver)

    def _open_below(self, temporary: str) -> None:
        self._below = _Patient(temporary)
        self._open(self._below)

    def _try(self, action: Any) -> None:
        if self._error is None:
            try:
                action()
            except _FAILURES as failure:
                self._error = explain(self._path, failure)

    def _stopped(self) -> bool:
        """Collective where the file is: in parallel, one rank's failure must keep all from the next collective call."""
        if self._parallel:
            return self.comm.any(self._error is not None)
        return self._file is None or self._error is not None or (self._below is not None and bool(self._below.error))

    def group(self, name: str, attributes: Mapping[str, Any] | None = None) -> None:
        """Make a group and give it attributes."""
        if self._stopped():
            return

        def make() -> None:
            made = self._file.require_group(name)
            for key, value in (attributes or {}).items():
                made.attrs[key] = value

        self._try(make)

    def whole(self, name: str, values: Any) -> None:
        """A small dataset that is the same on all ranks; rank 0 writes it."""
        values = np.asarray(values)
        if self._stopped():
            return

        def make() -> None:
            made = self._file.create_dataset(name, shape=values.shape, dtype=values.dtype)
            if self.comm.rank == 0 and values.size:
                made[...] = values

        self._try(make)

    def slabs(self, name: str, rows: np.ndarray, offset: int, total: int) -> None:
        """A dataset of `total` rows, of which this rank holds ``rows`` from `offset` on."""
        self.parts(name, [(rows, offset)], total)

    def parts(self, name: str, parts: list[tuple[np.ndarray, int]], total: int) -> None:
        """A dataset put together of several distributed arrays: this rank's rows of each, and where they start."""
        first = parts[0][0]
        shape = (total, *first.shape[1:])
        made: Any = None

        def make() -> None:
            nonlocal made
            made = self._file.create_dataset(name, shape=shape, dtype=first.dtype)

        if not self._stopped():
            self._try(make)
        for rows, offset in parts:
            if self._parallel:
                if not self._stopped() and total:
                    self._try(lambda: self._write_collectively(made, rows, offset))  # noqa: B023
            else:
                self._write_through_root(made, rows, offset)

    @staticmethod
    def _write_collectively(made: Any, rows: np.ndarray, offset: int) -> None:
        # By hand, since h5py leaves a rank without rows out of the collective call, and the others then wait for it.
        space = made.id.get_space()
        if len(rows):
            memory = h5py.h5s.create_simple(rows.shape)
            space.select_hyperslab((offset,) + (0,) * (rows.ndim - 1), rows.shape)
        else:
            memory = h5py.h5s.create_simple((1,) * rows.ndim)
            memory.select_none()
            space.select_none()
        how = h5py.h5p.create(h5py.h5p.DATASET_XFER)
        how.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
        made.id.write(memory, space, np.ascontiguousarray(rows), dxpl=how)

    def _write_through_root(self, made: Any, rows: np.ndarray, offset: int) -> None:
        # Slabs follow each other by rank, so rank 0 only counts on.
        for piece in stream_to_root(self.comm, np.ascontiguousarray(rows)):
            if not self._stopped():
                self._try(lambda: made.__setitem__(slice(offset, offset + len(piece)), piece))  # noqa: B023
            offset += len(piece)

    def close(self) -> None:
        """Close the file. Raises HpcdemError where something failed on this rank."""
        if self._file is not None:
            self._try(self._file.close)
            self._file = None
        if self._below is not None:
            self._below.close()
            if self._below.error is not None:
                self._error = explain(self._path, self._below.error)
        if self._error is not None:
            raise HpcdemError(self._error)


def _claim(path: str, size: int) -> None:
    """Make an empty file. Raises OSError if `size` bytes are more than fit on the disk or are allowed in a file."""
    open(path, "wb").close()
    space = os.statvfs(path)
    if size > space.f_bavail * space.f_frsize:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    if limit != resource.RLIM_INFINITY and size > limit:
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))


@contextmanager
def writing(path: str | os.PathLike, comm: Any, expected: int = 0) -> Iterator[Writer]:
    """Collective: a Writer whose file appears whole under `path`, or not at all. Raises HpcdemError on all ranks.

    expected: about how many bytes this rank will write, so that a full disk can be told beforehand.
    """
    with atomic_path(path, comm) as temporary:
        total = int(comm.sum_into(np.array([expected], dtype=np.int64))[0])
        writer = Writer(os.fspath(path), temporary, comm, total)
        try:
            yield writer
        finally:
            writer.close()


@contextmanager
def reading(path: str | os.PathLike) -> Iterator[Any]:
    """The file opened for reading by this process alone. Raises HpcdemError if it is no readable HDF5 file."""
    try:
        file = h5py.File(path, "r")
    except OSError as failure:
        if not os.path.exists(path):
            raise HpcdemError(f"cannot read {os.fspath(path)}: there is no such file") from None
        raise HpcdemError(explain(path, failure, "read")) from None
    with file:
        yield file
