"""HDF5 files that many ranks write together: one dataset per column, one slab of it per rank.

With an h5py that has MPI, and a core for each rank, all ranks write their slabs collectively; otherwise the slabs pass
through rank 0, one rank after the other, in bounded pieces. Layout and content are the same either way.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

# Locks fail or block on many network file systems, and a finished file may be looked at while the run goes on.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

import h5py
import numpy as np

from hpcdem.errors import HpcdemError
from hpcdem.io.files import arrays_to_root, atomic_path, explain

_FAILURES = (OSError, RuntimeError, ValueError)


def has_mpi(comm: Any) -> bool:
    """Whether this h5py can write through `comm` in parallel, and should: on a crowded host every collective write
    waits for its turn on a core, and rank 0 alone is quicker."""
    return comm.mpi is not None and comm.size > 1 and not comm.crowded and bool(h5py.get_config().mpi)


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

    def claim(self) -> None:
        """Get disk space for the whole file, holes included."""
        if self._size:
            self._do(lambda: os.posix_fallocate(self._file.fileno(), 0, self._size))

    def close(self) -> None:
        self._do(self._file.close)


class Writer:
    """An HDF5 file being written by all ranks of `comm`. Every method is collective and takes the same names, types
    and totals on all ranks. Errors are kept back until `close`, so that no rank waits for another.

    Rank 0 makes groups, attributes and the empty datasets alone; `close` fills them, so `rows` handed in must not
    change until then. With MPI in h5py rank 0 first claims the disk space, and all ranks open the file and write
    together: a full disk or quota is noticed before many ranks are inside HDF5, where a failed write ends in a
    crash or a hang.
    """

    def __init__(self, path: str, temporary: str, comm: Any) -> None:
        self._path, self._temporary, self.comm = path, temporary, comm
        self._parallel = has_mpi(comm)
        self._waiting: list[tuple[str, np.ndarray, int]] = []
        self._error: str | None = None
        self._file: Any = None
        self._below: _Patient | None = None
        if comm.rank == 0:
            self._try(self._open)

    def _open(self) -> None:
        self._below = _Patient(self._temporary)
        self._file = h5py.File(self._below, "w")

    def _try(self, action: Callable[[], Any]) -> None:
        if self._error is None and (self._below is None or self._below.error is None):
            try:
                action()
            except _FAILURES as failure:
                self._error = explain(self._path, failure)

    def group(self, name: str, attributes: Mapping[str, Any] | None = None) -> None:
        """Make a group and give it attributes."""

        def make() -> None:
            made = self._file.require_group(name)
            for key, value in (attributes or {}).items():
                made.attrs[key] = value

        if self.comm.rank == 0:
            self._try(make)

    def _dataset(self, name: str, shape: tuple[int, ...], dtype: np.dtype) -> None:
        how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        how.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        how.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        self._file.create_dataset(name, shape=shape, dtype=dtype, dcpl=how)

    def whole(self, name: str, values: Any) -> None:
        """A small dataset that is the same on all ranks; rank 0 writes it."""
        values = np.asarray(values)
        if self.comm.rank == 0:
            self._try(lambda: self._dataset(name, values.shape, values.dtype))
            if values.size:
                self._try(lambda: self._file[name].__setitem__(..., values))

    def slabs(self, name: str, rows: np.ndarray, offset: int, total: int) -> None:
        """A dataset of `total` rows, of which this rank holds ``rows`` from `offset` on."""
        self.parts(name, [(rows, offset)], total)

    def parts(self, name: str, parts: list[tuple[np.ndarray, int]], total: int) -> None:
        """A dataset put together of several distributed arrays: this rank's rows of each, and where they start."""
        first = parts[0][0]
        if self.comm.rank == 0:
            self._try(lambda: self._dataset(name, (total, *first.shape[1:]), first.dtype))
        self._waiting += [(name, rows, offset) for rows, offset in parts]

    def close(self) -> None:
        """Write what is still to be written and close the file. Raises HpcdemError where that failed."""
        if not self._parallel:
            self._write_through_root()
        self.abandon(claim=self._parallel)
        if self._parallel and not self.comm.any(self._error is not None):
            self._write_together()
        if self._error is not None:
            raise HpcdemError(self._error)

    def abandon(self, claim: bool = False) -> None:
        """Close rank 0's file as it is; not collective. claim: first get disk space for all of it."""
        if self._file is not None:
            try:
                self._file.close()
            except _FAILURES as failure:
                self._error = self._error or explain(self._path, failure)
            self._file = None
        if self._below is not None:
            if claim:
                self._below.claim()
            self._below.close()
            if self._below.error is not None:
                self._error = explain(self._path, self._below.error)
            self._below = None

    def _write_through_root(self) -> None:
        for k, at, piece in arrays_to_root(self.comm, [(rows, offset) for _, rows, offset in self._waiting]):
            self._try(lambda: _write_rows(self._file[self._waiting[k][0]], piece, at))  # noqa: B023

    def _write_together(self) -> None:
        how = h5py.h5p.create(h5py.h5p.DATASET_XFER)
        how.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
        try:
            with h5py.File(self._temporary, "r+", driver="mpio", comm=self.comm.mpi) as file:
                for name, rows, offset in self._waiting:
                    if file[name].size:
                        _write_rows(file[name], rows, offset, how)
        except _FAILURES as failure:
            self._error = explain(self._path, failure)


def _write_rows(made: Any, rows: np.ndarray, offset: int, how: Any = None) -> None:
    """Write rows from `offset` on, with the transfer properties `how`.

    By hand, since h5py leaves a rank without rows out of a collective call, and the others then wait for it.
    """
    space = made.id.get_space()
    if len(rows):
        memory = h5py.h5s.create_simple(rows.shape)
        space.select_hyperslab((offset,) + (0,) * (rows.ndim - 1), rows.shape)
    else:
        memory = h5py.h5s.create_simple((1,) * rows.ndim)
        memory.select_none()
        space.select_none()
    made.id.write(memory, space, np.ascontiguousarray(rows), dxpl=how)


@contextmanager
def writing(path: str | os.PathLike, comm: Any) -> Iterator[Writer]:
    """Collective: a Writer whose file appears whole under `path`, or not at all. Raises HpcdemError on all ranks."""
    with atomic_path(path, comm) as temporary:
        writer = Writer(os.fspath(path), temporary, comm)
        try:
            yield writer
        except BaseException:
            writer.abandon()
            raise
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
