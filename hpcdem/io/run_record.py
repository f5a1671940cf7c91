"""run.json: what a run says about itself in the folder that it writes into.

| key | |
|---|---|
| `script`, `language`, `arguments` | what was started: absolute path, "zdem", "pcdc" or "python", further words |
| `version`, `ranks`, `threads`, `began` | by what, on how many, when (UTC) |
| `state`, `step` | "running", "stopped" (with a checkpoint), "failed", "done"; step at that moment |
| `older` | checkpoints and frames that another run had left: name -> [bytes, time of change in ns] |
| `since` | the step at which it took up what another run had left, whose frames belong to it up to there; else -1 |
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path

from hpcdem.core.errors import HpcdemError
from hpcdem.io.disk import explain

RECORD = "run.json"
PROGRESS = "progress.json"
"""File next to the record during a run: `step`, `command`, last `line` of the log, `speed` [steps/s], completed `part`
of the command and remaining seconds `left`, `script_part` and `script_left` of the whole script; null: unknown."""
_FRAME = re.compile(r".+_(\d{10,})(_ini)?\.(vtkhdf|dat)")


@dataclass
class Record:
    """Contents of run.json."""

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
    since: int = -1


def read(folder: Path) -> Record | None:
    """Content of run.json of a folder, or None. HpcdemError if it cannot be read."""
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


def is_older(path: Path, record: Record | None) -> bool:
    """Return whether a file was there before the run began, and has not been written again since."""
    if record is None or path.name not in record.older:
        return False
    return _signature(path) == record.older[path.name]


def is_earlier_frame(path: Path, record: Record | None) -> bool:
    """Return whether a frame is of a run before the one that wrote run.json. In a copy of a folder times of change say
    nothing; frames from beyond the end of the run are known there by their names."""
    found = _FRAME.fullmatch(path.name)
    if record is None or found is None or path.name not in record.older:
        return False
    step = int(found[1])
    if (step, found[2] is not None) <= (record.since, False):
        return False
    return is_older(path, record) or (record.state != "running" and step > record.step)


def step_of_frame(name: str) -> int | None:
    """The step in the name of a frame; None of other files."""
    found = _FRAME.fullmatch(name)
    return int(found[1]) if found is not None else None


def left_behind(folder: Path) -> dict[str, list[int]]:
    """The checkpoints and frames in a folder."""
    names = sorted(path.name for path in folder.iterdir() if path.suffix == ".sav" or _FRAME.fullmatch(path.name))
    return {name: _signature(folder / name) for name in names}


def _signature(path: Path) -> list[int]:
    try:
        status = path.stat()
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns]
