"""The folder that a run writes into: who is writing there, and what `hpcdem resume` and `hpcdem info` must know of it.

`run.json` is written when the first file is, and again at the end:

| key | |
|---|---|
| `script`, `language`, `arguments` | what was started: absolute path, "zdem", "pcdc" or "python", further words |
| `version`, `ranks`, `threads`, `began` | by what, on how many, when (UTC) |
| `state`, `step` | "running", "stopped" (with a checkpoint), "failed", "done"; step at that moment |
| `older` | checkpoints that another run had left: name -> [bytes, time of change in ns] |

A run that was killed still says "running", but holds no lock.

Functions that take a communicator are collective; rank 0 alone touches the disk.
"""

from __future__ import annotations

import json
import os
import re
import socket
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hpcdem.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path, on_first
from hpcdem.io.disk import explain
from hpcdem.io.lock import FolderLock, Taken, holder_of

RECORD = "run.json"

_NUMBERED = re.compile(r"(auto_)?(\d{10,})\.sav")

_held: dict[Path, FolderLock] = {}
"""Locks of this process. One program may make several simulations that write into one folder."""


@dataclass(frozen=True)
class Job:
    """What was started. script: path as given, "" for a Python session; language: "zdem", "pcdc", "python" or ""."""

    script: str = ""
    language: str = ""
    arguments: tuple[str, ...] = ()
    threads: int = 1

    def about(self) -> dict[str, Any]:
        """Who is writing, for those who find the folder locked."""
        return {"host": socket.gethostname(), "pid": os.getpid(), "script": self.script, "began": _now()}


@dataclass
class Record:
    """What run.json says."""

    script: str = ""
    language: str = ""
    arguments: list[str] = field(default_factory=list)
    version: str = ""
    ranks: int = 1
    threads: int = 1
    began: str = ""
    state: str = "running"
    step: int = 0
    older: dict[str, list[int]] = field(default_factory=dict)


def claim(folder: Path, comm: Any, job: Job) -> bool:
    """Lock a folder that is there; nothing happens to one that is not. Returns False if its file system has no locks.
    UsageError on all ranks if another run writes into it."""
    return on_first(comm, lambda: _claim(folder, job) if folder.is_dir() else True)


def enter(folder: Path, comm: Any, job: Job, version: str, resumed: bool) -> bool:
    """Make the folder, lock it, and write run.json; a resumed run keeps what it says of older checkpoints. Returns
    False if its file system has no locks. UsageError if another run writes into it, HpcdemError if it cannot be
    made."""

    def work() -> bool:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as failure:
            raise HpcdemError(explain(folder, failure, "make the folder")) from None
        works = _claim(folder, job)
        before = read(folder) if resumed else None
        older = before.older if before is not None else {} if resumed else _checkpoints(folder)
        script = str(Path(job.script).resolve()) if job.script else ""
        record = Record(
            script, job.language, list(job.arguments), version, comm.size, job.threads, _now(), "running", 0, older
        )
        _write(folder, record)
        return works

    return on_first(comm, work)


def leave(folder: Path, comm: Any, state: str, step: int) -> None:
    """Note in run.json how the run ended. Not collective; a disk that refuses it is no reason to fail once more."""
    if comm.rank > 0:
        return
    try:
        record = read(folder)
        if record is not None:
            record.state, record.step = state, step
            _write(folder, record)
    except (HpcdemError, OSError):
        pass


def checkpoint_name(step: int, automatic: bool = False) -> str:
    """File name of the checkpoint of a step; automatic: of one that nobody asked for."""
    return f"{'auto_' if automatic else ''}{step:010d}.sav"


def retire(folder: Path, comm: Any, step: int, keep: int) -> None:
    """After the checkpoint of `step`: remove all but the last `keep` numbered ones of this run (0: none is removed),
    all but the last two automatic ones, and automatic ones from before the last numbered one. Not collective.

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
        gone = [path for at, path in extra if at <= last] + [path for at, path in extra if at > last][:-2]
        for path in gone + ([path for _, path in regular[:-keep]] if keep > 0 else []):
            path.unlink()
    except (HpcdemError, OSError):
        pass


def release_all() -> None:
    """Give back all locks of this process. Not collective."""
    while _held:
        _held.popitem()[1].release()


def read(folder: Path) -> Record | None:
    """What run.json of a folder says; None if there is none. HpcdemError if it cannot be read."""
    path = folder / RECORD
    try:
        given = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(given, dict):
            raise ValueError("no table of names and values")
        known = Record()
        return Record(**{name: type(value)(given[name]) for name, value in vars(known).items() if name in given})
    except FileNotFoundError:
        return None
    except OSError as failure:
        raise HpcdemError(explain(path, failure, "read")) from None
    except (TypeError, ValueError, AttributeError) as problem:
        raise HpcdemError(f"{path} is damaged: {problem}") from None


def running(folder: Path) -> dict[str, Any] | None:
    """Who writes into a folder at this moment, as far as it is known; None if nobody does."""
    return holder_of(folder)


def is_older(path: Path, record: Record | None) -> bool:
    """Whether a checkpoint was there before the run began, and was not written anew since."""
    if record is None or path.name not in record.older:
        return False
    return _signature(path) == record.older[path.name]


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
        f"{holder.get('began', '?')}. Wait for its end, or choose another folder with --outdir"
    )


def _checkpoints(folder: Path) -> dict[str, list[int]]:
    return {path.name: _signature(path) for path in sorted(folder.glob("*.sav"))}


def _signature(path: Path) -> list[int]:
    try:
        status = path.stat()
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns]


def _write(folder: Path, record: Record) -> None:
    path = folder / RECORD
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        json.dump(vars(record), file, indent=1)
        file.write("\n")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
