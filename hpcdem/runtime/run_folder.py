"""The folder that a run writes into: who is writing there, and what `hpcdem resume` and `hpcdem info` must know of it.

What `run.json` holds is in `io/run_record.py`; it is written when the first file is, and again at the end. A
run that was killed still says "running", but holds no lock.

Functions that take a communicator are collective; rank 0 alone touches the disk.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path, on_first
from hpcdem.io.disk import explain
from hpcdem.io.lock import FolderLock, Taken, holder_of
from hpcdem.io.run_record import PROGRESS, RECORD, Record, is_older, left_behind, read, step_of_frame

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm


PRESENT = "now"
"""Folder below the results: the present state of a model to which commands are typed (commands/present.py)."""
_NUMBERED = re.compile(r"(auto_)?(\d{10,})\.sav")

ROUNDING = 1e-9
"""Relative tolerance of times, which are sums of steps."""

_held: dict[Path, FolderLock] = {}
"""Locks of this process. One program may make several simulations that write into one folder."""

_entered: set[Path] = set()
"""Folders for which this process has written run.json: what is there now is its own."""


@dataclass(frozen=True)
class Job:
    """Program that was started. script: path as given, "" for a Python session; language: "zdem", "pcdc", "python" or
    ""."""

    script: str = ""
    language: str = ""
    arguments: tuple[str, ...] = ()
    threads: int = 1

    def about(self) -> dict[str, Any]:
        """Describe the writing process for others that find the folder locked."""
        return {"host": socket.gethostname(), "pid": os.getpid(), "script": self.script, "began": _now()}


def claim(folder: Path, comm: Comm, job: Job) -> bool:
    """Lock a folder that is there; nothing happens to one that is not. Returns False if its file system has no locks.
    UsageError on all ranks if another run writes into it, or if it cannot become a folder."""

    refuse_file(folder, comm)
    return on_first(comm, lambda: _claim(folder, job) if folder.is_dir() else True)


def refuse_file(folder: Path, comm: Comm) -> None:
    """Collective: UsageError if something that is no folder stands where a folder of results, or one above it, would be
    made."""

    def inspect() -> None:
        there = next((place for place in (folder, *folder.absolute().parents) if os.path.lexists(place)), None)
        if there is not None and not there.is_dir():
            kind = "a broken link" if there.is_symlink() and not there.exists() else "a file"
            raise UsageError(
                f"cannot make the folder {folder} for the results: {there} is {kind}. Choose another with --outdir"
            )

    on_first(comm, inspect)


def enter(
    folder: Path, comm: Comm, job: Job, version: str, resumed: bool, restored: tuple[Path, int] | None = None
) -> bool:
    """Make the folder, lock it, and write run.json; a resumed run keeps what it says of older files. restored: the
    checkpoint that the script began with, and its step; if it is one of this folder, the frames up to there belong to
    the run. Returns False if the file system has no locks. UsageError if another run writes into the folder,
    HpcdemError if it cannot be made."""

    def work() -> bool:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as failure:
            raise HpcdemError(explain(folder, failure, "make the folder")) from None
        works = _claim(folder, job)
        (folder / PROGRESS).unlink(missing_ok=True)
        again = folder.resolve() in _entered  # several models of one program, or particles and blocks of one run
        before = read(folder) if resumed or again else None
        _entered.add(folder.resolve())
        older = before.older if before is not None else {} if resumed else left_behind(folder)
        since = before.since if before is not None else _history(folder, restored)
        script = str(Path(job.script).resolve()) if job.script else ""
        record = Record(
            script,
            job.language,
            list(job.arguments),
            version,
            comm.size,
            job.threads,
            _now(),
            "running",
            0,
            older,
            since,
        )
        _write(folder, record)
        return works

    return on_first(comm, work)


def leave(folder: Path, comm: Comm, state: str, step: int) -> None:
    """Note in run.json how the run ended. Not collective; a disk that refuses it is no reason to fail once more."""
    if comm.rank > 0:
        return
    try:
        (folder / PROGRESS).unlink(missing_ok=True)
        record = read(folder)
        if record is not None:
            record.state, record.step = state, step
            _write(folder, record)
    except (HpcdemError, OSError):
        pass


def checkpoint_name(step: int, automatic: bool = False) -> str:
    """File name of the checkpoint of a step; automatic: written without a request."""
    return f"{'auto_' if automatic else ''}{step:010d}.sav"


@dataclass(frozen=True)
class Retention:
    """Rules for checkpoints to keep: the last numbered ones (0: all), the last two automatic ones; and of all older
    ones the last at or before each multiple of `steps` steps and of `period` [s], and at or before each of `times` [s]
    (0, (): none). Times are the model's."""

    last: int = 0
    steps: int = 0
    period: float = 0.0
    times: tuple[float, ...] = ()

    def spares(self, path: Path, following: Path) -> bool:
        """Return whether an old checkpoint is kept; following: the next existing one."""
        if self.steps and _step_of(following) > math.ceil(_step_of(path) / self.steps) * self.steps:
            return True
        if not self.period and not self.times:
            return False
        time, later = (_time_of(one, one.stat().st_mtime_ns) for one in (path, following))
        marks = list(self.times)
        if self.period:
            marks.append(math.ceil(time / self.period * (1.0 - ROUNDING)) * self.period)
        return any(time <= mark * (1.0 + ROUNDING) < later for mark in marks)


def retire(folder: Path, comm: Comm, step: int, keep: Retention) -> None:
    """Remove, after the checkpoint of `step`, those of this run that are too many, numbered ones before the last
    `keep.last`, automatic ones before the last two and from before the last numbered one, but for those that `keep`
    spares. Not collective.

    Files of other runs, and of later steps, stay. What cannot be removed stays as well.
    """
    if comm.rank > 0:
        return
    try:
        record = read(folder)
        found = [(match, path) for path in folder.glob("*.sav") if (match := _NUMBERED.fullmatch(path.name))]
        mine = sorted(
            (int(match[2]), path, bool(match[1]))
            for match, path in found
            if int(match[2]) <= step and not is_older(path, record)
        )
        regular = [(at, path) for at, path, automatic in mine if not automatic]
        extra = [(at, path) for at, path, automatic in mine if automatic]
        last = regular[-1][0] if regular else -1
        old = [path for at, path in extra if at <= last] + [path for at, path in extra if at > last][:-2]
        old += [path for _, path in regular[: -keep.last]] if keep.last else []
        following = {path: after for (_, path, _), (_, after, _) in pairwise(mine)}
        for path in [path for path in old if not keep.spares(path, following[path])]:
            path.unlink()
    except (HpcdemError, OSError):
        pass


def set_aside(folder: Path, later: Collection[Path], step: int) -> None:
    """The run resumes from a checkpoint of `step`, which is not its newest: note in run.json that these later ones, and
    frames of later steps, are of a run before this one. Not collective."""
    record = read(folder)
    if record is None:
        return
    for name, signature in left_behind(folder).items():
        frame = step_of_frame(name)
        if folder / name in later or (frame is not None and frame > step):
            record.older[name] = signature
    _write(folder, record)


def _step_of(path: Path) -> int:
    """Return the step of a numbered checkpoint."""
    return int(path.stem.removeprefix("auto_"))


@cache
def _time_of(path: Path, stamp: int) -> float:
    """Model time [s] of a checkpoint of this run; read once. stamp: of the file, another one is read again."""
    from hpcdem.io import checkpoint  # not before the environment of HDF5 is settled

    return float(checkpoint.read_state(path)["clock"]["time"])


def release_all() -> None:
    """Give back all locks of this process. Not collective."""
    _entered.clear()
    while _held:
        _held.popitem()[1].release()


def running(folder: Path) -> dict[str, Any] | None:
    """The run that writes into a folder at this moment, as far as known, or None."""
    return holder_of(folder)


def _history(folder: Path, restored: tuple[Path, int] | None) -> int:
    """The step up to which the frames in a folder lead to a checkpoint that was restored: -1, unless the checkpoint
    lies there, or a copy of it."""
    if restored is None:
        return -1
    path, step = restored
    try:
        known = folder / path.name
        return step if known.samefile(path) or known.stat().st_size == path.stat().st_size else -1
    except OSError:
        return -1


def _claim(folder: Path, job: Job) -> bool:
    place = folder.resolve()
    if place not in _held:
        try:
            _held[place] = FolderLock(folder, job.about())
        except Taken as taken:
            raise UsageError(_refusal(folder, taken.holder)) from None
    return _held[place].works


def _refusal(folder: Path, holder: dict[str, Any]) -> str:
    script, host, pid = (holder.get(name, "?") for name in ("script", "host", "pid"))
    return (
        f"another run is writing into {folder}: {script or 'a Python program'}, process {pid} on {host}, since "
        f"{holder.get('began', '?')}. Wait until it ends, or choose another folder with --outdir"
    )


def _write(folder: Path, record: Record) -> None:
    path = folder / RECORD
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        json.dump(vars(record), file, indent=1)
        file.write("\n")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
