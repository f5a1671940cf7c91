"""What is in a file of a run, and whether it is whole: facts about checkpoints and frames, for `hpcdem info`."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.errors import HpcdemError
from hpcdem.io import checkpoint
from hpcdem.io.frames import read_frame

Facts = dict[str, Any]
"""JSON values by name; always "kind", "whole" (bool) and "why" (what is wrong)."""


def of_file(path: Path) -> Facts:
    """Facts about one file; nothing is raised for what is in it."""
    facts: Facts = {"kind": "unknown file", "whole": False, "why": ""}
    try:
        status = path.stat()
        facts |= {"written": _when(status.st_mtime), "bytes": status.st_size}
        if path.suffix == ".tmp":
            facts |= {"kind": "unfinished file", "why": "a run was ended while it wrote it; it may be deleted"}
        elif path.suffix == ".sav":
            facts["kind"] = "checkpoint"
            facts |= _checkpoint(path)
        elif path.suffix in (".vtkhdf", ".dat"):
            facts["kind"] = "frame"
            facts |= _frame(path)
        else:
            facts["why"] = "neither a checkpoint (.sav) nor a frame (.vtkhdf, .dat)"
    except OSError as failure:
        facts["why"] = f"cannot be read: {failure.strerror}"
    except HpcdemError as failure:
        facts["why"] = str(failure)
    return facts


def _checkpoint(path: Path) -> Facts:
    state, tables = checkpoint.read(path)
    try:
        clock, progress = state["clock"], state["progress"]
        facts: Facts = {
            "whole": True, "version": checkpoint.version_of(path), "step": int(clock["step"]),
            "time": float(clock["time"]), "dt": float(clock["dt"]),
            "particles": len(tables["particles"]["gid"]), "pairs": len(tables["pairs"]["gid"]),
            "bonds": int(np.count_nonzero(tables["pairs"]["bond"])), "walls": len(state["walls"]["id"]),
            "groups": list(state["groups"]), "script": str(state["script"]), "position": state["position"],
        }  # fmt: skip
        if progress is not None:
            done, all_of_it = clock["step"] - progress["first"], progress["last"] - progress["first"]
            facts["inside"] = f"{progress['name']}, {done} of {all_of_it} steps done"
    except (KeyError, TypeError, ValueError) as problem:
        raise HpcdemError(f"{path} is damaged: {problem!r}") from None
    return facts


def _frame(path: Path) -> Facts:
    frame = read_frame(path)
    return {
        "whole": True, "step": frame.step, "time": frame.time, "dt": frame.dt,
        "particles": len(frame.tables["particles"]), "contacts": len(frame.tables["contacts"]),
        "bonds": len(frame.tables["bonds"]), "walls": len(frame.walls.get("id", ())), "groups": frame.group_names,
    }  # fmt: skip


def _when(seconds: float) -> str:
    return datetime.fromtimestamp(seconds).astimezone().isoformat(timespec="seconds")
