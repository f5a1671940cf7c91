"""Inventory of a file of a run and a check that it is complete: facts about checkpoints and frames for `hpcdem
info`."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io import checkpoint
from hpcdem.io.frames import read_frame
from hpcdem.io.vtkhdf_mesh import is_mesh_frame, read_mesh_frame

Facts = dict[str, Any]
"""JSON values by name; always "kind", "whole" (bool) and "why" (what is wrong)."""


def of_file(path: Path) -> Facts:
    """Return facts about a file; invalid contents raise no error."""
    facts: Facts = {"kind": "unknown file", "whole": False, "why": ""}
    try:
        status = path.stat()
        facts |= {"written": _when(status.st_mtime), "bytes": status.st_size}
        if path.suffix == ".tmp":
            facts |= {"kind": "unfinished file", "why": "its run ended during writing; the file can be deleted"}
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
    facts: Facts = {"whole": True, "version": checkpoint.version_of(path)}
    try:
        kind = state.get("kind")
        if kind is None:
            facts |= _of_particles(state, tables)
        elif kind in (checkpoint.BLOCKS, checkpoint.BOTH):
            facts |= _of_blocks(state, tables)
            if kind == checkpoint.BOTH:
                facts |= _beside_blocks(state["particles"], tables)
        else:
            raise HpcdemError(f"{path} is a checkpoint of the unknown kind '{kind}'")
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        raise HpcdemError(f"{path} is damaged: {problem!r}") from None
    return facts


def _of_particles(state: dict[str, Any], tables: dict[str, dict[str, np.ndarray]]) -> Facts:
    clock, progress = state["clock"], state["progress"]
    facts: Facts = {
        **_moment(clock), "particles": len(tables["particles"]["gid"]), "pairs": len(tables["pairs"]["gid"]),
        "bonds": int(np.count_nonzero(tables["pairs"]["bond"])), "walls": len(state["walls"]["id"]),
        "groups": list(state["groups"]), "script": str(state["script"]), "position": state["position"],
    }  # fmt: skip
    if progress is not None:
        done, all_of_it = clock["step"] - progress["first"], progress["last"] - progress["first"]
        facts["inside"] = f"{progress['name']}, {done} of {all_of_it} steps done"
    return facts


def _of_blocks(state: dict[str, Any], tables: dict[str, dict[str, np.ndarray]]) -> Facts:
    """Collect the facts of a checkpoint of blocks, saved by a PCDC script or a Python program."""
    clock, extra = state["clock"], state["extra"]
    project, run = extra.get("project"), extra.get("run") or {}
    facts: Facts = _moment(clock)
    if "mesh_cells" in tables:
        faces = tables["faces"]
        facts["elements"] = int(tables["elements"]["alive"].sum())
        facts["nodes"] = len(tables["mesh_points"]["x"])
        facts["joints"] = int(((faces["joint_row"] > 0) & (faces["partner"] > np.arange(len(faces["open"])))).sum())
        facts["broken"] = int((faces["broken"] > 0).sum())
    if project is not None:
        facts["groups"] = {kind: {name: list(of) for name, of in sets.items()} for kind, sets in _groups(project)}
        facts["histories"] = list(project["histories"])
    facts["names"] = [name for part in (extra.get("names") or {}).values() for name in part]
    if run.get("at"):
        facts["at"] = str(run["at"])
    if run.get("progress"):
        facts["inside"] = f"a run, {clock['step'] - run['progress']['first']} steps done"
    return facts


def _beside_blocks(state: dict[str, Any], tables: dict[str, dict[str, np.ndarray]]) -> Facts:
    """The particles of a checkpoint of both, which have steps and groups of their own."""
    prefix = checkpoint.OF_PARTICLES
    own = {name.removeprefix(prefix): table for name, table in tables.items() if name.startswith(prefix)}
    facts = _of_particles(state, own)
    moment = {name: facts[name] for name in ("step", "time", "dt")}
    return {
        **{name: facts[name] for name in ("particles", "pairs", "bonds", "walls")},
        "disc_face_contacts": len(tables[checkpoint.LINKS]["gid"]), "particles_at": moment,
        "particle_groups": facts["groups"],
    }  # fmt: skip


def _moment(clock: dict[str, Any]) -> Facts:
    return {"step": int(clock["step"]), "time": float(clock["time"]), "dt": float(clock["dt"])}


def _groups(project: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [(kind, sets) for kind, sets in project["groups"].items() if sets]


def _frame(path: Path) -> Facts:
    if path.suffix == ".vtkhdf" and is_mesh_frame(path):
        state = read_mesh_frame(path, solid=True)
        return {
            "kind": "frame of blocks", "whole": True, "step": state.step, "time": state.time, "dt": state.dt,
            "elements": len(state.cells), "joints": len(state.joints),
            "broken": int((state.of_joints.get("state", np.empty(0)) == 3.0).sum()),
            "groups": {name.removeprefix("group_"): list(names) for name, names in state.group_names.items()},
        }  # fmt: skip
    frame = read_frame(path)
    return {
        "whole": True, "step": frame.step, "time": frame.time, "dt": frame.dt,
        "particles": len(frame.tables["particles"]), "contacts": len(frame.tables["contacts"]),
        "bonds": len(frame.tables["bonds"]), "walls": len(frame.walls.get("id", ())), "groups": frame.group_names,
    }  # fmt: skip


def _when(seconds: float) -> str:
    return datetime.fromtimestamp(seconds).astimezone().isoformat(timespec="seconds")
