"""Files that are either complete or absent, and work of rank 0 whose result or error all ranks receive.

All functions that take a communicator are collective. Only rank 0 uses the folder. An error there is raised on every
rank, in one sentence that names file and cause, and an earlier file of that name is kept.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar, cast

from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import EXIT_USAGE, HpcdemError, UsageError
from hpcdem.io.disk import explain, publish, remove

_T = TypeVar("_T")


@contextmanager
def atomic_path(path: str | os.PathLike, comm: Comm = SerialComm()) -> Iterator[str]:  # noqa: B008
    """Provide ``path.tmp``; when all ranks have left the body, that file gets the name `path`. Collective.

    An OSError or HpcdemError on any rank removes the temporary file and raises HpcdemError on all ranks. The body must
    not leave other ranks waiting in an exchange: raise only after the last one (see `RootFile`).
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


def on_first(comm: Comm, action: Callable[[], _T]) -> _T:
    """Call `action` on rank 0 and return its result, or raise its HpcdemError or OSError, on all ranks. Collective."""
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
    return cast(_T, result)


def make_folder(path: str | os.PathLike, comm: Comm) -> None:
    """Create the folder unless it exists; afterwards all ranks see it. Raises HpcdemError. Collective."""
    error = None
    if comm.rank == 0:
        try:
            os.makedirs(path, exist_ok=True)
        except OSError as failure:
            error = explain(path, failure, "make the folder")
    comm.agree(error)
