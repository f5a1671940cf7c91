"""Measuring all frames of a folder: frames are shared over the ranks, tables and figures written by rank 0."""

from __future__ import annotations

import csv
import io
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.fields import sides_of_box
from hpcdem.io.agreed import atomic_path, on_first
from hpcdem.io.disk import explain
from hpcdem.io.frames import FrameFile, left_out, list_frames
from hpcdem.io.vtkhdf_mesh import MeshState
from hpcdem.post import fluid
from hpcdem.post.measure import block_figures, blocks, bodies, cracks, emission, fault_history, figures, kinds
from hpcdem.post.measure import walls as curves
from hpcdem.post.measure.fault_history import History
from hpcdem.post.measure.grains import Grains
from hpcdem.post.measure.kinds import Done, Sheet
from hpcdem.post.measure.scene import BLOCK_KINDS, KINDS, SOLID_KINDS, Plan, Request, Scene, make_plan, read_grains

_T = TypeVar("_T")


@dataclass(frozen=True)
class Kind:
    """Functions of one measurement. part: measures one frame; sheets and figure: use all parts; previous: part needs
    the preceding frame."""

    part: Callable[[Scene], Any]
    sheets: Callable[..., list[Sheet]]
    figure: Callable[..., Any]
    previous: bool = False


FRAMES = {
    "surface": Kind(kinds.surface_part, kinds.surface_sheets, figures.surface),
    "wedge": Kind(kinds.wedge_part, kinds.wedge_sheets, figures.wedge),
    "faults": Kind(kinds.faults_part, kinds.faults_sheets, figures.faults, previous=True),
    "tracks": Kind(kinds.tracks_part, kinds.tracks_sheets, figures.tracks),
    "layers": Kind(kinds.layers_part, kinds.layers_sheets, figures.layers),
    "cracks": Kind(kinds.cracks_part, kinds.cracks_sheets, figures.damage, previous=True),
}


def run(comm: Comm, log: Any, request: Request, without: Sequence[str] = ()) -> list[Path]:
    """Measure a folder and return the files written (on rank 0). Without `what`: everything the folder allows, minus
    `without`; otherwise exactly what is requested. Raises HpcdemError on all ranks. Collective.
    """
    began = time.monotonic()
    what = [kind for kind in KINDS if kind in request.what or (not request.what and kind not in without)]
    of_blocks = on_first(comm, lambda: _of_blocks(request))
    if of_blocks and not on_first(comm, lambda: bool(list_frames(request.folder))):
        what = [kind for kind in what if kind in request.what and kind not in BLOCK_KINDS]
    of_frames = [kind for kind in what if kind in FRAMES]
    if request.over_time and "faults" not in what:
        raise UsageError("--over-time requires faults: `hpcdem measure DIR faults --over-time`")
    written: list[Path] = []
    if of_frames:
        plan, final = on_first(comm, lambda: make_plan(request, of_frames))
        if plan.period:
            _refuse_periodic(request)
            what, of_frames = ([kind for kind in some if kind != "wedge"] for some in (what, of_frames))
        on_first(comm, lambda: _report(log, plan, final, of_frames))
        parts = _measure(comm, log, plan, of_frames)
        history = _follow(comm, log, plan, parts["faults"]) if request.over_time and "faults" in what else None
    on_first(comm, lambda: request.target.mkdir(parents=True, exist_ok=True))
    for kind in what:
        if kind == "wallforce":
            work = lambda: _wallforce(request)  # noqa: E731
        else:
            work = lambda: _write(kind, parts[kind], plan, final, history)  # noqa: B023, E731
        files, problem = on_first(comm, lambda: _tried(work, bool(request.what)))  # noqa: B023
        if problem is not None:
            log.info(f"skipped: {problem}")
        elif files:
            log.info(f"{kind}: {', '.join(path.name for path in files)}")
        if kind == "wedge" and files:
            on_first(comm, lambda: _report_no_wedge(log, parts["wedge"]))
        written += files
    written += _blocks(comm, log, request, of_blocks) if of_blocks else []
    log.info(f"{request.target}: {len(written)} files in {time.monotonic() - began:.1f} s")
    return written


def _report(log: Any, plan: Plan, final: Grains, what: Sequence[str]) -> None:
    first, last = plan.frames[0], plan.frames[-1]
    count = "1 frame" if first is last else f"{len(plan.frames)} frames, {first.path.stem} to {last.path.stem}"
    row = f"{len(plan.row)} particles fixed along x and y push" if len(plan.row) else "no wall moves along x"
    if plan.period:
        row = f"periodic sides, {plan.period:g} m apart at first and {final.period:g} m at last"
    wall = row if plan.wall is None else f"wall {plan.wall} moves"
    hint = "; --from 0 includes the frames before it moves" if plan.request.first is None and first.step > 0 else ""
    log.info(f"{count}; {wall}{hint}; columns of {plan.cell:g} m")
    held, of_bed = int(final.fixed.sum()), [kind for kind in ("surface", "wedge", "tracks") if kind in what]
    if held and of_bed and held < len(final):
        log.info(
            f"{held} particles fixed along x and y (rows that represent walls) are ignored for {', '.join(of_bed)}"
        )
    if others := left_out(plan.request.folder):
        log.warn(others)


def _refuse_periodic(request: Request) -> None:
    """HpcdemError for measurements that a model with periodic sides does not have."""
    why = "the sides of this model are periodic (PERIODIC)"
    if "wedge" in request.what:
        raise HpcdemError(f"wedge: {why}: nothing pushes, and there is no toe; measure surface")
    if request.over_time:
        raise HpcdemError(f"faults --over-time: {why}, and faults are not followed across them; measure faults")


def _report_no_wedge(log: Any, done: Done) -> None:
    """A line about the frames without a wedge."""
    flat = kinds.without_wedge(done)
    if flat:
        (first, reason), (last, _) = flat[0], flat[-1]
        at = f"at step {first.step}" if len(flat) == 1 else f"in {len(flat)} frames, steps {first.step} to {last.step}"
        of = "" if len(flat) == 1 else f"; at step {first.step}"
        log.info(f"wedge: no wedge yet {at}{of}: {reason}; see the column `note` of wedge.csv for each frame")


def _tried(work: Callable[[], list[Path]], must: bool) -> tuple[list[Path], str | None]:
    """Return the written files, or why nothing was written; if `must`, raise the failure."""
    try:
        return work(), None
    except _NothingThere as failure:
        if must:
            raise
        return [], str(failure)


class _NothingThere(HpcdemError):
    """The folder does not hold what a measurement needs."""


# --- frames ----------------------------------------------------------------------------------------------------


def _measure(comm: Comm, log: Any, plan: Plan, what: Sequence[str]) -> dict[str, Done]:
    """Collective: the parts of all frames by measurement, on rank 0 (empty elsewhere).

    Each rank takes a stretch of consecutive frames, and reads the frame before it where that is needed.
    """
    n = len(plan.frames)
    first, last = n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size
    pairs = any(FRAMES[kind].previous for kind in what) and not ("cracks" not in what and plan.sections)
    tables = ("bonds", "contacts") if "cracks" in what else ()
    mine: list[tuple[Any, dict[str, Any]]] = []
    error = None
    reported = time.monotonic()
    try:
        before = _read(plan.frames[first - 1], plan, tables) if pairs and 0 < first < last else None
        for k in range(first, last):
            now = _read(plan.frames[k], plan, tables)
            scene = Scene(plan.frames[k], k, now, before, plan)
            parts = {kind: FRAMES[kind].part(scene) for kind in what}
            mine.append((scene.stamp, parts))
            if "faults" in what:
                _one_field([row[1] for row in mine])
            before = now if pairs else None
            if time.monotonic() - reported > 5.0:
                reported = time.monotonic()
                log.info(f"{plan.frames[k].path.name}: {k - first + 1} of {last - first} frames read")
    except HpcdemError as failure:
        error = str(failure)
    except OSError as failure:
        error = explain(failure.filename or plan.request.folder, failure, "read")
    comm.agree(error)
    gathered = comm.gather(mine) or []
    rows = [row for part in gathered for row in part]
    return {kind: [(stamp, parts[kind]) for stamp, parts in rows] for kind in what} if rows else {k: [] for k in what}


def _read(file: FrameFile, plan: Plan, tables: tuple[str, ...]) -> Grains:
    return read_grains(file, plan.request, tables)


def _one_field(parts: list[dict[str, Any]]) -> None:
    """Discard the fields of all frames but the one that is drawn."""
    drawn = kinds.drawn([part["faults"] for part in parts])
    for part in parts:
        if part["faults"] is not None and part["faults"] is not drawn:
            part["faults"] = kinds.without_fields(part["faults"])


def _follow(comm: Comm, log: Any, plan: Plan, done: Done) -> History | None:
    """Collective: faults through the frames, on rank 0 (None elsewhere). Ranks share the faults to place them in their
    reference frames, then stretches of frames to measure them."""

    def tracked() -> tuple[list[fault_history.Fault], int]:
        bands = [zip(part.bands, part.ids) if part else () for _, part in done]
        return fault_history.track([[fault_history.Seen(*pair) for pair in pairs] for pairs in bands])

    faults, brief = on_first(comm, tracked)

    def placed() -> dict[int, fault_history.Plane]:
        found: dict[int, fault_history.Plane] = {}
        for f in faults[comm.rank :: comm.size]:
            reference = _read(plan.frames[f.born - 1], plan, ())
            p = fault_history.plane(f, reference, plan.cell, kinds.layer_names(reference, plan))
            found |= {} if p is None else {f.number: p}
        return found

    planes = {number: p for part in comm.allgather(_each(comm, placed)) for number, p in part.items()}

    def measured() -> list[tuple[int, int, fault_history.Profile]]:
        found, n = [], len(plan.frames)
        for k in range(n * comm.rank // comm.size, n * (comm.rank + 1) // comm.size):
            alive = [f for f in faults if f.number in planes and f.born <= k and (f.merged is None or k < f.merged[1])]
            if alive:
                now = _read(plan.frames[k], plan, ())
                found += [(f.number, k, fault_history.measure(planes[f.number], now, k)) for f in alive]
        return found

    parts = comm.gather(_each(comm, measured))
    if parts is None:
        return None
    profiles: dict[int, dict[int, fault_history.Profile]] = {}
    for number, k, profile in (row for part in parts for row in part):
        if profile.best is not None:
            profiles.setdefault(number, {})[k] = profile
    first = _read(plan.frames[0], plan, ())
    history = fault_history.history(faults, profiles, brief, float(np.mean(first.r)))
    log.info(
        f"faults over time: {len(history.faults)} faults; ignored: {history.brief} bands seen in one frame only, "
        f"{history.still} bands whose sides slid by less than a mean radius"
    )
    return history


def _each(comm: Comm, work: Callable[[], _T]) -> _T:
    """Collective: each rank's own result; the HpcdemError of one is raised on all."""
    result, error = None, None
    try:
        result = work()
    except HpcdemError as failure:
        error = str(failure)
    except OSError as failure:
        error = explain(failure.filename or "a frame", failure, "read")
    comm.agree(error)
    return result  # type: ignore[return-value]


# --- blocks ----------------------------------------------------------------------------------------------------


def _of_blocks(request: Request) -> list[str]:
    """The requested measurements that are possible for blocks in the folder. Raises HpcdemError where a word requires
    blocks that are missing."""
    frames = blocks.frames(request)
    solid = bool(frames) and blocks.dim_of(frames[-1]) == 3
    if request.box is not None and not solid:
        raise UsageError("--box: supported only for blocks in three dimensions")
    if frames:
        others = {*BLOCK_KINDS, *SOLID_KINDS} - {*(SOLID_KINDS if solid else BLOCK_KINDS)} - {*KINDS}
        for kind in request.what:
            if kind in others:
                raise HpcdemError(f"{kind} is for {'two' if solid else 'three'} dimensions; {frames[-1].path.name} has "
                                  f"{'three' if solid else 'two'}")  # fmt: skip
    if solid:
        if request.colors and not list_frames(request.folder):
            raise UsageError("--colors: blocks have groups, no colours")
        if request.box is not None and request.what and "regions" not in request.what:
            raise UsageError("--box requires regions")
        last = blocks.read(frames[-1], request)
        missing = [] if fluid.there(last) else ["fluid"]
        missing += [] if len(last.joints) else ["cracks", "emission"]
        return [kind for kind in SOLID_KINDS if kind in request.what or not (request.what or kind in missing)]
    there = dict.fromkeys(("cracks", "fragments", "fluid"), bool(frames))
    there |= dict.fromkeys(("regions", "displacement"), False)
    if frames and "fluid" not in request.what:
        there["fluid"] = fluid.there(blocks.read(frames[-1], request))
    there["emission"] = bool(frames) or (request.folder / emission.TABLE).is_file()
    for kind in request.what:
        if kind in (*BLOCK_KINDS, *SOLID_KINDS) and kind not in KINDS and not there[kind]:
            raise HpcdemError(f"{kind}: {request.folder} contains no frames of blocks of these steps")
    if any(there.values()) and request.colors and not list_frames(request.folder):
        raise UsageError("--colors: blocks have groups, no colours")
    return [kind for kind in BLOCK_KINDS if there[kind] and (kind in request.what or not request.what)]


def _blocks(comm: Comm, log: Any, request: Request, what: Sequence[str]) -> list[Path]:
    """Collective: the requested measurements of blocks."""
    files = on_first(comm, lambda: blocks.frames(request))
    if files:
        on_first(comm, lambda: blocks.chosen(blocks.read(files[0], request), request))  # are there such groups?
        first, last = files[0].path.stem, files[-1].path.stem
        log.info(
            f"{len(files)} frames of blocks, {first} to {last}" if len(files) > 1 else f"1 frame of blocks, {first}"
        )
        others = on_first(comm, lambda: "" if list_frames(request.folder) else left_out(request.folder))
        if others:
            log.warn(others)
    n = len(files) if set(what) - {"emission"} else 0  # events are in a table, or in the last frame
    mine, error = [], None
    try:
        for file in files[n * comm.rank // comm.size : n * (comm.rank + 1) // comm.size]:
            mine.append(blocks.part(blocks.read(file, request), request, what))
    except HpcdemError as failure:
        error = str(failure)
    comm.agree(error)
    parts = [one for part in comm.gather(mine) or [] for one in part]
    written: list[Path] = []
    for kind in what:
        work = lambda: _write_blocks(kind, request, files, parts)  # noqa: B023, E731
        paths, problem = on_first(comm, lambda: _tried(work, bool(request.what)))  # noqa: B023
        if problem is not None:
            log.info(f"skipped: {problem}")
        elif paths:
            log.info(f"{kind}: {', '.join(path.name for path in paths)}")
        written += paths
    return written


def _write_blocks(kind: str, request: Request, files: list[FrameFile], parts: list[blocks.Part]) -> list[Path]:
    """Tables and figure of one measurement of blocks."""
    name = "cracks_joints" if kind == "cracks" else kind
    if kind == "emission":
        if not len(blocks.events_of(request, files)):
            raise _NothingThere(f"emission: no joint broke in {request.folder}")
        found = blocks.emitted(request, files)
        sheets = blocks.emission_sheets(found)
        draw = lambda: block_figures.emitted(found)  # noqa: E731
    elif kind == "regions":
        if not any(part.regions for part in parts):
            raise _NothingThere(f"regions: {request.folder} has none of the requested elements")
        sheets = bodies.regions_sheets(parts)
        draw = lambda: block_figures.regions(parts)  # noqa: E731
    elif kind == "displacement":
        if not any(part.surface is not None and len(part.surface.node) for part in parts):
            raise _NothingThere(f"displacement: {request.folder} has none of the requested elements")
        sheets = bodies.displacement_sheets(parts)
        draw = lambda: block_figures.displacement(parts)  # noqa: E731
    elif kind == "fluid":
        if not any(part.fluid is not None and part.fluid.channels for part in parts):
            raise _NothingThere(f"fluid: the blocks in {request.folder} have no channels")
        last = blocks.read(files[-1], request)
        sheets = blocks.fluid_sheets(parts, last, blocks.chosen(last, request))
        draw = lambda: block_figures.fluid(parts, last)  # noqa: E731
    else:
        of_last = parts[-1].cracks
        if kind == "cracks" and (of_last is None or not of_last.joints):
            raise _NothingThere(f"cracks: the blocks in {request.folder} have no joints")
        state = blocks.read(files[-1], request)
        wanted = blocks.chosen(state, request)
        sheets = blocks.cracks_sheets(parts, state, wanted) if kind == "cracks" else blocks.fragments_sheets(parts)
        draw = lambda: _draw_blocks(kind, request, files, parts, state, wanted)  # noqa: E731
    paths = [write_sheet(request.target, sheet) for sheet in sheets]
    if request.formats:
        figure = draw()
        paths += [figures.save(figure, request.target / f"{name}.{suffix}") for suffix in request.formats]
    return paths


def _draw_blocks(
    kind: str, request: Request, files: list[FrameFile], parts: list[blocks.Part], state: MeshState, wanted: np.ndarray
) -> Any:
    if kind == "fragments":
        return block_figures.fragments(parts, state)
    events = blocks.events_of(request, files) if (request.folder / emission.TABLE).is_file() else None
    if state.points.shape[1] == 3:
        return block_figures.cracks_in_space(parts, state, blocks.broken_joints(state, wanted), events)
    return block_figures.cracks(parts, state, events)


# --- files -----------------------------------------------------------------------------------------------------


def _write(kind: str, done: Done, plan: Plan, final: Grains, history: History | None) -> list[Path]:
    """Table and figure of one measurement."""
    request, recipe = plan.request, FRAMES[kind]
    _refuse(kind, done, plan)
    if kind == "faults" and history is not None:
        stamps = [stamp for stamp, _ in done]
        files = [write_sheet(request.target, sheet) for sheet in kinds.history_sheets(stamps, history)]
        for suffix in request.formats:
            figure = figures.faults_over_time(stamps, history, final)
            files.append(figures.save(figure, request.target / f"faults.{suffix}"))
        return files
    more = (final,) if kind == "cracks" else ()
    files = [write_sheet(request.target, sheet) for sheet in recipe.sheets(done, plan, *more)]
    to_draw = kind != "wedge" or len(kinds.without_wedge(done)) < len(done)
    if request.formats and to_draw:
        log = (cracks.read_log(request.log),) if kind == "cracks" and request.log is not None else ()
        figure = recipe.figure(done, plan, final, *log)
        files += [figures.save(figure, request.target / f"{kind}.{suffix}") for suffix in request.formats]
    return files


def _refuse(kind: str, done: Done, plan: Plan) -> None:
    """Raise where there is nothing to measure."""
    where = plan.request.folder
    some = [part for _, part in done if part is not None and (kind != "tracks" or len(part))]
    if kind == "faults" and not some:
        names = "the sections in ss/data belong to other frames: use --increment to compare the frames"
        raise _NothingThere(f"faults: {names if plan.sections else f'{where} has only one frame, and no sections'}")
    if kind == "cracks" and not any(len(part.change.made) for part in some):
        raise _NothingThere(f"cracks: no frame in {where} has bonds")


def _wallforce(request: Request) -> list[Path]:
    path = request.folder / "walls.csv"
    if not path.exists():
        raise _NothingThere(f"wallforce: {path} not found")
    found = curves.read_walls(path, request.first, request.last)
    if not found:
        raise _NothingThere(f"wallforce: {path} has no rows of these steps")
    missing = [wall for wall in request.walls if wall not in found]
    if missing:
        raise UsageError(f"--wall {missing[0]}: not in {path}; available: {', '.join(map(str, sorted(found)))}")
    driver = curves.driver(found)
    asked = request.walls or tuple(wall for wall in found if wall not in sides_of_box(found)) or tuple(found)
    chosen = {wall: found[wall] for wall in asked}
    head = ("step", "time[s]", "wall", "dx[m]", "dy[m]", "path[m]", "fx[N]", "fy[N]", "work[J]")
    rows = (
        (*row[:2], wall, *row[2:])
        for wall, c in sorted(chosen.items())
        for row in zip(c.step.tolist(), c.time.tolist(), *c.moved.T.tolist(), c.path_length.tolist(),
                       *c.force.T.tolist(), c.work.tolist())
    )  # fmt: skip
    files = [write_sheet(request.target, Sheet("wallforce", head, rows))]
    if request.formats:
        figure = figures.wallforce(chosen, None if driver is None else found[driver], f"wall {driver}")
        files += [figures.save(figure, request.target / f"wallforce.{suffix}") for suffix in request.formats]
    return files


def write_sheet(folder: Path, sheet: Sheet) -> Path:
    """Write a table as CSV, atomically; numbers with ten digits, empty if missing."""
    path = folder / f"{sheet.name}.csv"
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(sheet.head)
    writer.writerows([_word(value) for value in row] for row in sheet.rows)
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write(text.getvalue())
    return path


def _word(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"{value + 0.0:.10g}" if math.isfinite(value) else ""
    return str(int(value))
