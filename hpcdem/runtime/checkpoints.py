"""Which checkpoints a run can go on from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hpcdem.core.errors import HpcdemError
from hpcdem.io import checkpoint
from hpcdem.runtime import run_folder


def newest_first(folders: list[Path]) -> tuple[list[Path], list[str]]:
    """The checkpoints of the runs that wrote last into some folders, the newest first, and what is wrong with those of
    which not even the state can be read. Tables are not looked at. Not collective."""
    ranked, damaged = [], []
    for folder in dict.fromkeys(path.resolve() for path in folders):
        try:
            record = run_folder.read(folder)
        except HpcdemError as error:
            record = None
            damaged.append(str(error))
        for path in sorted(folder.glob("*.sav")):
            if run_folder.is_older(path, record):
                continue
            try:
                state = checkpoint.read_state(path)
                place = _position(state), int(state["clock"]["step"]), path.stat().st_mtime_ns
            except (HpcdemError, OSError, KeyError, TypeError, ValueError, AttributeError) as error:
                text = str(error) if isinstance(error, HpcdemError) else f"{path} is damaged: {error!r}"
                damaged.append(text)
            else:
                ranked.append((place, path))
    return [path for _, path in sorted(ranked, reverse=True)], damaged


def _position(state: dict[str, Any]) -> int:
    """How far in its script: commands done. Of blocks it is in `extra`, what their simulation saves for others."""
    return int((state.get("extra") or state).get("position") or 0)
