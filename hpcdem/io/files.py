"""Files that are either whole or not there: written under a temporary name, flushed to the disk, then renamed.

All functions that take a communicator are collective. Only rank 0 touches the folder; what goes wrong there is
raised on every rank, in one sentence that names file and cause, and whatever stood under the name before is left
as it was. Data of other ranks comes to rank 0 in bounded pieces.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from hpcdem.errors import EXIT_USAGE, HpcdemError, UsageError
from hpcdem.io.behind import Deliveries
from hpcdem.io.disk import explain as explain
from hpcdem.io.disk import publish, remove
from hpcdem.io.rootfile import root_file
from hpcdem.io.transport import Places, Section, size_of, text_in_blocks, to_root, used

_T = TypeVar("_T")


class Alone:
    """The little that is asked of a communicator here, for one process that writes a file of its own."""

    rank, size, mpi = 0, 1, None

    def gather(self, value: _T) -> list[_T]:
        return [value]

    def agree(self, error: str | None) -> None:
        if error is not None:
            raise HpcdemError(error)


@contextmanager
def atomic_path(path: str | os.PathLike, comm: Any = Alone()) -> Iterator[str]:  # noqa: B008
    """Collective. Hands out ``path.tmp``; when the body is done on all ranks, that file takes the name `path`.

    An OSError or HpcdemError on any rank removes the temporary file and raises HpcdemError on all ranks. The body
    must not leave other ranks waiting in an exchange: raise only after the last one (see `RootFile`).
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
            remove(temporary)
        raise
    try:
        comm.agree(error)
        if comm.rank == 0:
            try:
                publish(temporary, path)
            except OSError as failure:
                error = explain(path, failure)
        comm.agree(error)
    except HpcdemError:
        if comm.rank == 0:
            remove(temporary)
        raise


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


def write_sections(
    path: str | os.PathLike,
    comm: Any,
    build: Callable[[], Sequence[Section]],
    later: Deliveries | None = None,
) -> None:
    """Collective: write a file of sections, each either bytes (rank 0's are taken) or a table in slabs by rank.

    `build` is called on every rank and must return the same kinds of section in the same order everywhere; it may
    be collective. The bytes of the file do not depend on the rank count. Raises HpcdemError on all ranks; with `later`
    the file is on its way afterwards, and whoever settles the deliveries hears of the disk.
    """
    sections: Sequence[Section] = ()
    error = None
    try:
        sections = build()
    except (HpcdemError, ValueError) as failure:
        error = f"cannot write {os.fspath(path)}: {failure}"
    comm.agree(error)
    mine = sections if comm.rank == 0 else [s for s in sections if not isinstance(s, bytes)]
    with root_file(path, comm, later) as file:
        places = _places(comm, sections)
        if file is not None:
            for data, n in text_in_blocks(mine):
                places[0].write(file, data[:n], lambda data=data: used(data))  # type: ignore[misc]
        for rank, piece in to_root(comm, text_in_blocks(mine)):
            assert file is not None
            places[rank].write(file, piece, lambda piece=piece: used(piece))  # type: ignore[misc]


def _places(comm: Any, sections: Sequence[Section]) -> list[Places]:
    """Where the text of each rank goes; on rank 0 only. Collective."""
    sizes = [rows * width for rows, width in map(size_of, sections)]
    of_ranks = [sizes] if comm.size == 1 else comm.gather(sizes)
    if of_ranks is None:
        return []
    runs: list[list[tuple[str, int, int]]] = [[] for _ in of_ranks]
    at = 0
    for k, section in enumerate(sections):
        for rank, own in enumerate(of_ranks[:1] if isinstance(section, bytes) else of_ranks):
            runs[rank].append(("", at, own[k]))
            at += own[k]
    return [Places(r) for r in runs]
