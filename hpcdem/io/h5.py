"""HDF5 files that many ranks write together: one dataset per column, one slab of it per rank.

With an h5py that has MPI, and a core for each rank, all ranks write their slabs collectively; otherwise the slabs pass
through rank 0, one rank after the other, in bounded pieces. Both give the same layout and content.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

# Locks fail or block on many network file systems, and a finished file may be read during the run.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

import h5py
import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path
from hpcdem.io.behind import Deliveries
from hpcdem.io.disk import explain
from hpcdem.io.frame import Columns
from hpcdem.io.rootfile import Description, RootFile, root_file
from hpcdem.io.transport import Places, rows_in_blocks, to_root, used

_FAILURES = (OSError, RuntimeError, ValueError)


def has_mpi(comm: Comm) -> bool:
    """Return whether this h5py can write through `comm` in parallel, and should: on a crowded host every collective
    write waits for its turn on a core, and rank 0 alone is quicker."""
    return comm.mpi is not None and comm.size > 1 and not comm.crowded and bool(h5py.get_config().mpi)


class _Sketch:
    """A binary file for HDF5 that remembers what is written, by place, and touches no disk.

    HDF5 writes only the description of its datasets here; their rows take the short way into the file. It would not be
    trusted with the disk anyway: when that is full it keeps what it could not write, tries again when objects are
    freed, and ends the process.
    """

    def __init__(self) -> None:
        self.pieces: list[tuple[int, bytes]] = []
        self.size = self._at = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.size}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def write(self, data: Any) -> int:
        self.pieces.append((self._at, bytes(data)))
        self._at += len(data)
        self.size = max(self.size, self._at)
        return len(data)

    def readinto(self, buffer: Any) -> int:
        view = memoryview(buffer).cast("B")
        first, last = self._at, self._at + len(view)
        view[:] = bytes(len(view))
        for at, data in self.pieces:
            a, b = max(first, at), min(last, at + len(data))
            if a < b:
                view[a - first : b - first] = data[a - at : b - at]
        self._at = last
        return len(view)

    def read(self, size: int) -> bytes:
        data = bytearray(size)
        self.readinto(data)
        return bytes(data)

    def truncate(self, size: int | None = None) -> int:
        self.size = self._at if size is None else size
        return self.size

    def flush(self) -> None:
        """Nothing is held back."""

    def extents(self) -> list[tuple[int, bytearray]]:
        """Return the written bytes as separate pieces (place, bytes); where writes overlap, the last one counts."""
        ends: list[list[int]] = []
        for first, last in sorted((at, at + len(data)) for at, data in self.pieces):
            if ends and first <= ends[-1][1]:
                ends[-1][1] = max(ends[-1][1], last)
            else:
                ends.append([first, last])
        starts = [first for first, _ in ends]
        made = [(first, bytearray(last - first)) for first, last in ends]
        for at, data in self.pieces:
            first, target = made[bisect_right(starts, at) - 1]
            target[at - first : at - first + len(data)] = data
        return made


class _Description:
    """Groups, attributes and empty datasets of a file. Datasets are made by hand, as h5py takes ten times longer."""

    def __init__(self) -> None:
        self._sketch = _Sketch()
        self._starts: dict[str, int] = {}
        self._kinds: dict[np.dtype, Any] = {}
        self._file = h5py.File(self._sketch, "w")
        self._groups: dict[str, Any] = {"": self._file}
        self._how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        self._how.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        self._how.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        self._how.set_obj_track_times(False)

    def group(self, name: str, attributes: Mapping[str, Any]) -> None:
        if name not in self._groups:
            self._groups[name] = self._file.create_group(name)
        for word, value in attributes.items():
            self._groups[name].attrs[word] = value

    def dataset(self, name: str, shape: tuple[int, ...], dtype: np.dtype) -> None:
        parent, _, last = name.rpartition("/")
        if dtype not in self._kinds:
            self._kinds[dtype] = h5py.h5t.py_create(dtype, logical=1)
        space = h5py.h5s.create_simple(shape)
        made = h5py.h5d.create(self._groups[parent].id, last.encode(), self._kinds[dtype], space, self._how)
        self._starts[name] = made.get_offset() or 0

    def finish(self) -> Description:
        """Return the places of the rows of each dataset, the description as pieces of the file, and the size of the
        file."""
        self._file.close()
        return self._starts, self._sketch.extents(), self._sketch.size


class Writer:
    """An HDF5 file being written by all ranks of `comm`. Every method is collective and takes the same names, types
    and totals on all ranks. Errors are kept back, in `file` or until `close`, so that no rank waits for another.

    Rank 0 describes groups, attributes and datasets alone; `close` writes that and the rows, so `rows` handed in must
    not change until then, nor later if the file is one that is written behind the back of the run. With MPI in h5py
    rank 0 first claims the disk space, and all ranks open the file and write together: a full disk or quota is noticed
    before many ranks are inside HDF5, where a failed write ends in a crash or a hang.

    file: rank 0's, None on other ranks; with MPI in h5py it must be one that is written at once.
    """

    def __init__(self, path: str | os.PathLike, temporary: str, comm: Comm, file: RootFile | None) -> None:
        self.comm, self._file = comm, file
        self._path, self._temporary = os.fspath(path), temporary
        self._steps: list[Callable[[_Description], None]] = []
        self._waiting: list[tuple[str, np.ndarray, int]] = []

    def group(self, name: str, attributes: Mapping[str, Any] | None = None) -> None:
        """Make a group and give it attributes."""
        self._steps.append(lambda made: made.group(name.strip("/"), attributes or {}))

    def _dataset(self, name: str, shape: tuple[int, ...], dtype: np.dtype) -> None:
        self._steps.append(lambda made: made.dataset(name, shape, dtype))

    def whole(self, name: str, values: Any) -> None:
        """A small dataset that is the same on all ranks; rank 0 writes it."""
        values = np.array(values, order="C", ndmin=1)
        self._dataset(name, values.shape, values.dtype)
        if self._file is not None and values.size:
            self._file.write(0, values, part=name)

    def slabs(self, name: str, rows: np.ndarray, offset: int, total: int) -> None:
        """A dataset of `total` rows, of which this rank holds ``rows`` from `offset` on."""
        self.parts(name, [(rows, offset)], total)

    def parts(self, name: str, parts: list[tuple[np.ndarray, int]], total: int) -> None:
        """A dataset put together of several distributed arrays: this rank's rows of each, and where they start."""
        first = parts[0][0]
        self._dataset(name, (total, *first.shape[1:]), first.dtype)
        self._waiting += [(name, np.ascontiguousarray(rows), offset) for rows, offset in parts]

    def close(self) -> None:
        """Write it all. Raises HpcdemError where the file is known to have failed."""
        file, together = self._file, has_mpi(self.comm)
        if file is not None:
            file.describe(self._describe)
        if not together:
            self._write_through_root()
        elif file is not None:
            file.claim()
        if file is not None:
            file.close()
        error = file.error if file is not None else None
        if together and not self.comm.any(error is not None):
            error = self._write_together()
        if error is not None:
            raise HpcdemError(error)

    def _describe(self) -> Description:
        made = _Description()
        for step in self._steps:
            step(made)
        return made.finish()

    def abandon(self) -> None:
        """Let go of what is half made; not collective."""
        if self._file is not None:
            self._file.abandon()

    def _write_through_root(self) -> None:
        """Each rank's rows, one array after the other; rank 0 knows where they belong."""
        table = self.comm.gather([(offset, len(rows)) for _, rows, offset in self._waiting])
        if self._file is not None:
            for name, rows, offset in self._waiting:
                if len(rows):
                    self._file.write(offset * _row_size(rows), rows, part=name)
        places = [] if table is None else [Places(self._runs(of_rank)) for of_rank in table]
        for rank, piece in to_root(self.comm, rows_in_blocks([rows for _, rows, _ in self._waiting])):
            assert self._file is not None
            places[rank].write(self._file, piece, lambda piece=piece: used(piece))  # type: ignore[misc]

    def _runs(self, slabs: list[tuple[int, int]]) -> Iterator[tuple[str, int, int]]:
        for (name, rows, _), (offset, n) in zip(self._waiting, slabs):
            yield name, offset * _row_size(rows), n * _row_size(rows)

    def _write_together(self) -> str | None:
        how = h5py.h5p.create(h5py.h5p.DATASET_XFER)
        how.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)
        try:
            with h5py.File(self._temporary, "r+", driver="mpio", comm=self.comm.mpi) as file:
                for name, rows, offset in self._waiting:
                    if file[name].size:
                        _write_rows(file[name], rows, offset, how)
        except _FAILURES as failure:
            return explain(self._path, failure)
        return None


def _row_size(rows: np.ndarray) -> int:
    """Bytes per row."""
    return rows.itemsize * math.prod(rows.shape[1:])


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
def writing(path: str | os.PathLike, comm: Comm, later: Deliveries | None = None) -> Iterator[Writer]:
    """Collective: a Writer whose file appears whole under `path`, or not at all. Raises HpcdemError on all ranks; with
    `later` the file may be written in the background, and settling the deliveries raises errors of the disk.
    """
    if has_mpi(comm):
        with writing_to(path, comm) as writer:
            yield writer
        return
    error = None
    with root_file(path, comm, later) as file:
        writer = Writer(path, "", comm, file)
        try:
            yield writer
        except BaseException:
            writer.abandon()
            raise
        try:
            writer.close()
        except HpcdemError as failure:
            error = str(failure)
        comm.agree(error)


@contextmanager
def writing_to(path: str | os.PathLike, comm: Comm, check: Callable[[str], None] | None = None) -> Iterator[Writer]:
    """Collective: a Writer that finishes its file at the end of the block. check: called on rank 0 with the finished
    file's temporary name; its HpcdemError keeps the file from getting its name."""
    with atomic_path(path, comm) as temporary:
        writer = Writer(path, temporary, comm, RootFile(path, temporary=temporary) if comm.rank == 0 else None)
        try:
            yield writer
        except BaseException:
            writer.abandon()
            raise
        writer.close()
        if check is not None and comm.rank == 0:
            check(temporary)


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


def columns(path: str | os.PathLike, places: Mapping[str, tuple[str, Any]]) -> Columns:
    """Columns of a file by name, read on use. places: dataset and rows of each."""

    def reader(place: str, whole: Any) -> Callable[[slice], np.ndarray]:
        def read(rows: slice) -> np.ndarray:
            with reading(path) as file:
                try:
                    first, *others = whole if isinstance(whole, tuple) else (whole,)
                    every = range(*first.indices(len(file[place])))[rows]
                    found: np.ndarray = file[place][(slice(every.start, every.stop), *others)]
                    return found
                except (KeyError, OSError, ValueError, RuntimeError) as problem:
                    raise HpcdemError(f"cannot read {os.fspath(path)}: {place}: {problem}") from None

        return read

    return Columns({name: reader(*place) for name, place in places.items()})
