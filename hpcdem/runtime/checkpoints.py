"""Checkpoints from which a run can resume."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io import checkpoint
from hpcdem.io.agreed import on_first
from hpcdem.runtime import run_folder

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm


def newest_first(folders: list[Path], before: float = math.inf) -> tuple[list[Path], list[str]]:
    """The checkpoints of the runs that wrote last into some folders, the newest first, and what is wrong with those of
    which not even the state can be read; before: only those of this time of the model [s] and earlier ones. Tables are
    not checked. Not collective."""
    ranked, damaged = _ranked(folders)
    latest = before + run_folder.ROUNDING * abs(before)
    return [path for _, time, path in ranked if time <= latest], damaged


def go_back_to(path: Path, folders: list[Path], comm: Comm) -> None:
    """The run resumes from this checkpoint: later ones in the folders, and frames that came after it, do not count
    any more. Collective."""

    def work() -> None:
        ranked = [(place, found) for place, _, found in _ranked(folders)[0]]
        chosen = next(place for place, found in ranked if found == path)
        later = {found for place, found in ranked if place > chosen}
        for folder in dict.fromkeys([path.parent, *(found.parent for found in later)]):
            run_folder.set_aside(folder, later, chosen[1] if folder == path.parent else -1)

    on_first(comm, work)


def none_before(before: float, folders: list[Path]) -> UsageError:
    """Return the error if no complete checkpoint is early enough."""
    return UsageError(
        f"no complete checkpoint in {' or '.join(map(str, folders))} at or before {before:g} s of model time (hpcdem "
        "info FILE.sav shows the time of each)"
    )


def _ranked(folders: list[Path]) -> tuple[list[tuple[tuple[int, int, int], float, Path]], list[str]]:
    """Place in the script, step and time of change; time of the model [s]; path: the newest first."""
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
                time = float(state["clock"]["time"])
            except (HpcdemError, OSError, KeyError, TypeError, ValueError, AttributeError) as error:
                text = str(error) if isinstance(error, HpcdemError) else f"{path} is damaged: {error!r}"
                damaged.append(text)
            else:
                ranked.append((place, time, path))
    return sorted(ranked, reverse=True), damaged


def _position(state: dict[str, Any]) -> int:
    """Return the number of script commands executed. Checkpoints of blocks store it in `extra`."""
    return int((state.get("extra") or state).get("position") or 0)
