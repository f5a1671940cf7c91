"""Made on the first rank and sent to the others: that meshes are equal to the last bit need not be hoped for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, HpcdemError

T = TypeVar("T")


def made_once(comm: Comm, make: Callable[[], T]) -> T:
    """The result of `make()`, called on rank 0 only. Collective; an error of it is raised on all ranks.

    comm: a communicator of `hpcdem.halo.comm`.
    """
    made, error, wrong_use = None, None, False
    if comm.rank == 0:
        try:
            made = make()
        except HpcdemError as why:
            error, wrong_use = str(why), why.exit_code == CommandError.exit_code
    made, error, wrong_use = comm.bcast((made, error, wrong_use))
    if error is not None:
        raise (CommandError if wrong_use else HpcdemError)(error)
    return made
