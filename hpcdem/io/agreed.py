"""Files that are either whole or not there, and work of rank 0 whose result or error all ranks get.

All functions that take a communicator are collective. Only rank 0 touches the folder; what goes wrong there is raised
on every rank, in one sentence that names file and cause, and whatever stood under the name before is left as it was.
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


def on_first(comm: Comm, action: Callable[[], _T]) -> _T:
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
    return cast(_T, result)


def make_folder(path: str | os.PathLike, comm: Comm) -> None:
    """Collective: the folder exists afterwards on all ranks. Raises HpcdemError."""
    error = None
    if comm.rank == 0:
        try:
            os.makedirs(path, exist_ok=True)
        except OSError as failure:
            error = explain(path, failure, "make the folder")
    comm.agree(error)
