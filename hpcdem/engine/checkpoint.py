"""Save the state of a model to a file and restore it: the part that all physics share."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.engine.model import Model
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.runtime.checkpoints import go_back_to, newest_first, none_before

Contents = tuple[Mapping[str, Any], Mapping[str, Table]]


def save(model: Model, path: Path | str, contents: Callable[[], Contents]) -> None:
    """Write the result of contents(): the state as JSON values, and tables. The model is only read, so a run that saves
    continues exactly like one that does not. Collective."""
    began = time.perf_counter()
    with model.timers("checkpoint"):
        checkpoint.write(path, *contents(), model.comm)
    if model.stop is not None:
        model.stop.saved(time.perf_counter() - began)


def read(
    comm: Comm, path: Path | str, kind: str | None, what: str, whole: Callable[[str], bool] = lambda table: False
) -> tuple[dict[str, Any], checkpoint.Tables]:
    """Read the state and the tables of a checkpoint of this kind, see `io.checkpoint.read`. what: its name in messages.
    Raises CommandError if the file is missing, damaged or of another program. Collective."""
    try:
        state, tables = checkpoint.read(path, comm, whole)
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None
    if state.get("kind") != kind:
        raise CommandError(f"{path} is a checkpoint, but not one of {what}")
    return state, tables


def take_newest(
    folders: list[Path], model: Model, before: float, take: Callable[[Path], dict[str, Any]], fatal: type[CommandError]
) -> tuple[Path, dict[str, Any]] | None:
    """Restore the newest complete checkpoint among the .sav files of some folders.

    Returns its path and the result of take(path), or None if the folders contain no checkpoint. before: model time [s];
    the last checkpoint at or before it is used, and its absence raises UsageError. Collective.

    The newest checkpoint is the one farthest in the script, then the one of the latest step, because clocks may be
    wrong. Checkpoints that an earlier run left in a folder do not count. A file that take refuses (CommandError, unless
    fatal) is named in the log, and the previous one is tried.
    """
    comm, log = model.comm, model.log
    found, damaged = newest_first(folders, before) if comm.rank == 0 else ([], [])
    for text in damaged if log is not None else []:
        log.warn(f"{text}; ignored")
    for path in comm.bcast(found):
        try:
            taken = take(path)
        except fatal:
            raise
        except CommandError as error:
            if log is not None:
                log.warn(f"{error}; trying the checkpoint before it")
            continue
        if log is not None:
            log.info(f"resuming from {path}, step {model.clock.step}")
        if before < math.inf:
            go_back_to(path, folders, comm)
        return path, taken
    if before < math.inf:
        raise none_before(before, folders)
    if log is not None:
        log.info(f"no checkpoint in {' or '.join(map(str, folders))}: starting at the beginning")
    return None
