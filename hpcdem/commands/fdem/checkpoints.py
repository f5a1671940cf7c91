"""model save and restore: the simulation, and what the script has prepared for it, in one file."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands.fdem import coupling, frames
from hpcdem.commands.fdem.histories import flush
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.records import Chart, Curve, History
from hpcdem.core.errors import CommandError, UsageError
from hpcdem.engine.checkpoint import take_newest
from hpcdem.physics.fdem.groups import Groups
from hpcdem.physics.flow import coupled
from hpcdem.physics.user_files import UnknownLaw
from hpcdem.pre.mesh import solids
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.runtime import run_folder

FORMAT = 1
"""Version of the data saved beside the simulation."""


SUFFIX = ".sav"


def named(path: str) -> str:
    """Return the file name; `SUFFIX` is appended to a name without an extension."""
    return path if Path(path).suffix else path + SUFFIX


def save(project: Project, file: str) -> None:
    """Write the complete state to a file in the folder of the script; `SUFFIX` is appended to a name without an
    extension. Collective.
    """
    _write(project, project.to_write(project.path(named(file))), {"names": project.names()})


def write_checkpoint(project: Project, automatic: bool = False) -> Path:
    """Write the complete state, with the position in the script, to `<step>.sav` in the output folder and return its
    path. Surplus checkpoints are removed. Collective.
    """
    path = project.folder() / run_folder.checkpoint_name(project.step, automatic)
    try:
        names = project.names()
    except CommandError as error:  # nobody requested it here, so it must not end the run
        names = {}
        if project.log is not None:
            project.log.warn_once("names", f"{error}; checkpoints of this run contain no m_ names")
    place = project.place()
    journal = place.get("journal") if place is not None else None
    beside = None if project.coupled is None else project.coupled.particles
    particles = {"particles": None} if beside is None else {"particles": beside.number, "edited": beside.edited}
    run = {**(place or {}), "progress": project.progress, **particles}
    more = {"run": run, "position": len(journal or ())}
    _write(project, path, {"names": names, **more})
    run_folder.retire(path.parent, project.comm, project.step, project.keep)
    return path


def _write(project: Project, path: Path, more: dict[str, Any]) -> None:
    if project.mesh is not None:
        project.ready(use=False)
    frames.settle(project)
    coupling.save(project, path, {"project": _state(project), **more})


def found(project: Project, path: str) -> str:
    """Return the name of an existing file: as given, or with the extension that `save` appends. Collective."""
    there = project.comm.bcast(project.path(path).exists() if project.comm.rank == 0 else None)
    return path if there else named(path)


def restore(project: Project, path: str) -> dict[str, Any]:
    """Load the state of a file. Return the names (of variables and functions) that were saved with it. Collective.

    Raises CommandError if the file does not exist or is not a checkpoint of blocks; the model is then unchanged.
    """
    project.refuse_inside("model restore")
    flush(project)
    file = project.to_read(found(project, path))
    names = dict(_restored(project, file).get("names") or {})
    coupled.leave(project.blocks)
    project.restored = file, project.step
    return names


def take_up(project: Project, before: float = math.inf) -> list[Any] | None:
    """Load the newest complete checkpoint of this script in the output folder. Return its journal (lang.pcdc.journal),
    None without a checkpoint. Collective.

    before: load the checkpoint at this model time [s] or the last one before it; UsageError if missing. A damaged file
    is reported in the log and the previous one is tried. UsageError if the script cannot be resumed from the
    checkpoint.
    """
    found = _newest(project, before)
    if found is None:
        return None
    path, run = found
    journal = run.get("journal") if isinstance(run, dict) else None
    if not isinstance(run, dict) or not isinstance(journal, list):
        raise UsageError(
            f"{path} does not record the path of the script, so --resume cannot use it. Start another script with pcdc "
            f"model restore '{path}'"
        )
    project.progress, project.resumed = run.get("progress"), True
    project.asleep, project.calls_lost = run.get("particles"), "particles" not in run
    return journal


def restore_newest(project: Project, before: float = math.inf) -> bool:
    """Load the newest checkpoint for a Python program, which is not executed again. Return False without a checkpoint.
    Raises CommandError if a script wrote it. `steps.resume` then finishes the interrupted command. Collective.
    """
    found = _newest(project, before)
    if found is None:
        return False
    path, run = found
    if not isinstance(run, dict) or "script" in run:
        raise CommandError(f"{path} was written by a PCDC script; resume it with hpcdem SCRIPT --resume")
    project.progress, project.resumed = run.get("progress"), True
    return True


def _newest(project: Project, before: float) -> tuple[Path, Any] | None:
    """Take the state of the newest whole checkpoint; its path, and what it says of the run that wrote it."""

    def take(path: Path) -> dict[str, Any]:
        try:
            return _restored(project, path, begins=True)
        except CommandError:
            project.clear()
            raise

    try:
        taken = take_newest([project.outdir], project.blocks, before, take, UnknownLaw)
    except UnknownLaw as error:
        raise UsageError(str(error)) from None
    return None if taken is None else (taken[0], taken[1].get("run"))


def _restored(project: Project, path: Path, begins: bool = False) -> dict[str, Any]:
    """Take the state of a file; returns what was saved with it. begins: the script has still to run."""
    extra = coupling.restore(project, path, begins)
    state = extra.get("project")
    if not isinstance(state, dict) or state.get("format", 0) > FORMAT:
        raise CommandError(f"{path} was not saved by this language, or by a later version of it")
    try:
        _take(project, state)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as problem:
        raise CommandError(f"{path} is damaged: {problem!r}") from None
    project.progress = None
    return extra


def _state(project: Project) -> dict[str, Any]:
    """The state of a project apart from the simulation, as JSON values."""
    return {
        "format": FORMAT,
        "dim": project.dim,
        "layers": {name: values.tolist() for name, values in project.layers.tables().items()},
        "solids": {name: solids.state(project.layers[name]) for name in project.layers} if project.dim == 3 else {},
        "groups": {kind: groups.state() for kind, groups in project.groups.items()},
        "null": np.flatnonzero(~project.alive).tolist(),
        "hidden": np.flatnonzero(project.hidden).tolist(),
        "histories": {name: asdict(history) for name, history in project.histories.items()},
        "charts": {name: asdict(chart) for name, chart in project.charts.items()},
        "frames": project.frames,
        "framed": project.framed,
        "dynamic": project.dynamic,
        "adapts": project.adapts,
        "clocks": {
            "run_time": project.run_time,
            "began": project.began,
            "look": project.check_every,
            "step_table": project.step_table,
            "relative": sorted(project.relative),
        },
        "in_use": project.in_use,
        "networks": project.networks,
        "units": project.units,
        "solved": {name: None if value != value else value for name, value in project.solved.items()},
    }


def _take(project: Project, state: dict[str, Any]) -> None:
    tables = {name: np.array(values) for name, values in state["layers"].items()}
    tables["layer_names"] = np.array(state["layers"]["layer_names"], dtype=object)
    for name in ("points", "bulges"):
        tables[name] = tables[name].astype(np.float64)
    tables["points"] = tables["points"].reshape(-1, 2)
    layers = Layers.from_tables(tables)
    for name, of in state.get("solids", {}).items():
        layers.add(name, *solids.restored(of))
    groups = {kind: Groups.restored(kind, of) for kind, of in state["groups"].items()}
    histories = {name: _history(given) for name, given in state["histories"].items()}
    charts = {
        name: Chart(given["title"], given["x_label"], given["y_label"], [_curve(curve) for curve in given["curves"]])
        for name, given in state["charts"].items()
    }
    mesh = project.blocks.mesh
    alive = np.ones(0 if mesh is None else len(mesh.cells), bool)
    alive[np.array(state["null"], np.int64)] = False
    project.layers, project.mesh, project.alive = layers, mesh, alive
    project.hidden = np.zeros(len(alive), bool)
    project.hidden[np.array(state.get("hidden", ()), np.int64)] = True
    project.dim = int(state.get("dim", 2))
    project.groups.update(groups)
    project.histories, project.charts, project.frames = histories, charts, dict(state["frames"])
    project.framed, project.cracks_filed = dict(state["framed"]), None
    project.networks, project.units = int(state["networks"]), str(state.get("units", ""))
    solved = state.get("solved", {})  # versions before did not keep it
    project.solved = {name: math.nan if value is None else value for name, value in solved.items()}
    project.adapts = bool(state["adapts"])
    clocks = state.get("clocks", {})
    project.run_time, project.check_every = float(clocks.get("run_time", 0.0)), int(clocks.get("look", 0))
    project.began = {name: float(time) for name, time in clocks.get("began", {}).items()}
    project.step_table, project.relative = str(clocks.get("step_table", "")), set(clocks.get("relative", ()))
    project.dynamic, project.in_use, project.taken = bool(state["dynamic"]), bool(state["in_use"]), mesh is not None


def _history(given: dict[str, Any]) -> History:
    rows = [(int(step), float(time), float(value)) for step, time, value in given["rows"]]
    return History(**{**given, "rows": rows, "filed": 0})  # its file begins again, with all that was recorded


def _curve(given: dict[str, Any]) -> Curve:
    return Curve(**{**given, "points": [(float(x), float(y)) for x, y in given["points"]]})
