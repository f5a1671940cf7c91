"""Stress and strain of all frames of a folder: `hpcdem -s DIR` writes DIR/ss/data/<frame>.out, .npz and .vtkhdf.

Frames are shared over the ranks in rounds, one frame per rank: each rank reads its frame, gets the positions of the
frame before from its neighbour, and fits dF between the two; F then passes from frame to frame; at the end of the round
every rank writes its own. Where there are fewer frames than ranks, rank 0 goes through the frames, and the columns of
the grids are shared. The files have the same bytes either way.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import on_first
from hpcdem.io.disk import explain
from hpcdem.io.frame import Frame
from hpcdem.io.frames import FrameFile, left_out, list_frames, read_frame
from hpcdem.post import grid as grids
from hpcdem.post import section_files, strain, stress
from hpcdem.post.section import MEAN, PAGE, Section, write_section
from hpcdem.post.surface import bed, held_fast, surface

QUIET_SECONDS = 2.0
"""Shortest time between two lines of progress [s]."""
INSIDE, AROUND = 2, 3
"""Radii of `solid_fraction`, in spacings."""
STRESS_REACH = 1.5
"""Particles nearer to a node than this many SIZE count in its stress: as smooth as the manual's figures."""
SPREAD = 0.8
"""Standard deviation of the means of volumetric strain in units of SIZE. For SIZE = 1.5 diameters half of the amplitude
remains at waves of 4.3 SIZE, where volumes by strain and by the area of each particle agree (docs/stress_strain.md)."""
SUFFIXES = (".out", ".npz", ".vtkhdf")
_T = TypeVar("_T")


@dataclass(frozen=True)
class Options:
    """folder: with the frames; size: spacing of the grid [m]; left_wall, right_wall: ids of walls beyond which
    particles are ignored; xmove, ymove [m]: added to all coordinates; addball, delball: whether particles may be
    added or deleted between frames; increment: strain since the frame before instead of since the first one; smooth:
    strain fitted around the nodes of the grid and averaged, instead of by the nearest neighbours of each particle;
    volume: how the volumetric strain is made, of section.VOLUMES, MEAN by default; groups: names of those whose
    particles count, all by default."""

    folder: Path
    size: float = 200.0
    left_wall: int | None = None
    right_wall: int | None = None
    xmove: float = 0.0
    ymove: float = 0.0
    addball: bool = False
    delball: bool = False
    increment: bool = False
    smooth: bool = False
    volume: str | None = None
    groups: tuple[str, ...] = ()


def run(comm: Comm, log: Any, options: Options) -> Path:
    """Collective: the folder with the results. Results of an earlier call stay until the new ones are complete.
    Raises HpcdemError (on all ranks) for frames that cannot be read or do not fit together."""
    if not (np.isfinite(options.size) and options.size > 0.0):
        raise UsageError(f"-g {options.size:g}: the spacing of the grid must be larger than 0")
    if options.smooth and options.volume not in (None, MEAN):
        raise UsageError(f"--volume {options.volume} cannot be combined with --smooth, which averages on its grid")
    began = time.monotonic()
    frames = on_first(comm, lambda: _frames(options.folder, log))
    results = options.folder / "ss" / "data"
    fresh = results.with_name("data.tmp")
    on_first(comm, lambda: _make_fresh(fresh))
    many = "1 frame" if len(frames) == 1 else f"{len(frames)} frames"
    ranks = f", {comm.size} ranks share {'the frames' if len(frames) >= comm.size else 'each frame'}"
    spacing = on_first(comm, lambda: _spacing(frames[0], options, log))
    log.info(
        f"stress and strain of {many} in {options.folder}, stress over {options.size:g} m, "
        f"nodes every {spacing:g} m{ranks * (comm.size > 1)}"
    )
    if len(frames) == 1:
        log.warn(
            f"{frames[0].path.name} is the only frame: its strain is zero, because there is no other frame to "
            "compare with"
        )
    try:
        if len(frames) >= comm.size:
            _rounds(comm, log, frames, options, _Output(fresh, spacing), grids.sums)
        else:
            _together(comm, log, frames, options, _Output(fresh, spacing))
        on_first(comm, lambda: _replace(fresh, results, [f.path.stem for f in frames]))
    except HpcdemError:
        if comm.rank == 0:
            shutil.rmtree(fresh, ignore_errors=True)
        raise
    seconds = time.monotonic() - began
    log.info(f"{results}: {many} in {seconds:.1f} s, {len(frames) / max(seconds, 1e-9):.3g} frames/s")
    return results


# --- files and folders -----------------------------------------------------------------------------------------


def _frames(folder: Path, log: Any) -> list[FrameFile]:
    frames = list_frames(folder)
    if others := left_out(folder):
        log.warn(others)
    if not frames:
        raise HpcdemError(f"{folder} contains no frames (all_<step>.vtkhdf or all_<step>.dat)")
    return frames


class _Output(NamedTuple):
    """Folder of the results and spacing of their nodes [m]."""

    folder: Path
    spacing: float


def _spacing(first: FrameFile, options: Options, log: Any) -> float:
    """SIZE, or the largest whole part of it that is no longer than the mean diameter of the bed in the first frame, so
    that each particle has a node of its own. Reports the particles that are ignored."""
    p = read_frame(first.path, ["particles"], periodic=False).tables["particles"].columns
    known = np.isfinite(p["x"] + p["y"] + p["radius"])
    x, y, radius = (p[name][known] for name in ("x", "y", "radius"))
    if not len(radius) or not np.mean(radius) > 0.0:
        return options.size
    fixed = held_fast(p, len(known))[known]
    chosen = bed(x, y, radius, fixed)
    if not chosen.all():
        log.info(
            f"{first.path.name}: {(fixed & ~chosen).sum()} particles fixed along x and y (rows that represent walls) "
            f"and {(~fixed & ~chosen).sum()} detached ones are ignored in strain, stress and surface"
        )
    if options.smooth:
        return options.size
    return options.size / max(1.0, float(np.ceil(options.size / (2.0 * np.mean(radius[chosen])) - 1e-9)))


def _make_fresh(folder: Path) -> None:
    """An empty folder, whatever an interrupted call has left there."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)


def _replace(fresh: Path, results: Path, names: list[str]) -> None:
    """Replace the old files by the new ones; files of other names stay."""
    os.makedirs(results, exist_ok=True)
    ours = {name + suffix for name in names for suffix in SUFFIXES}
    for old in results.iterdir():
        if old.name not in ours and old.suffix in SUFFIXES and old.name.startswith("all_"):
            old.unlink()
    for name in sorted(ours):
        os.replace(fresh / name, results / name)
    fresh.rmdir()


def _each(comm: Comm, action: Callable[[], _T]) -> _T:
    """Collective: each rank's own result; if one fails, all do."""
    result, error = _tried(action)
    comm.agree(error)
    return result  # type: ignore[return-value]


def _tried(action: Callable[[], _T]) -> tuple[_T | None, str | None]:
    try:
        return action(), None
    except HpcdemError as failure:
        return None, str(failure)
    except OSError as failure:
        return None, explain(failure.filename or "the results", failure)


# --- one frame -------------------------------------------------------------------------------------------------


@dataclass
class Snapshot:
    """Data of a frame: particles (in the order of ids) and walls, after --xmove and --ymove.

    inside: not beyond --leftwallid or --rightwallid, and of the requested groups; moments (n, 4): V s [N m]; volume
    (n,); thickness [m]; held (n,): in contact with anything; fixed (n,): along x and y.
    """

    name: str
    step: int
    time: float
    gid: np.ndarray
    x: np.ndarray
    y: np.ndarray
    radius: np.ndarray
    color: np.ndarray
    inside: np.ndarray
    moments: np.ndarray
    volume: np.ndarray
    thickness: float
    held: np.ndarray
    fixed: np.ndarray
    walls: dict[str, np.ndarray]


def read_snapshot(path: Path, options: Options) -> Snapshot:
    """Read a frame. Raises HpcdemError."""
    frame = read_frame(path, periodic=False)
    p = frame.tables["particles"].columns
    if not len(frame.tables["particles"]):
        raise HpcdemError(f"{path} has no particles: remove it from the folder")
    bad = ~np.isfinite(p["x"] + p["y"] + p["radius"])
    if bad.any():
        raise HpcdemError(f"{path}: the position of particle {p['gid'][bad][0]} is not a number")
    fixed = held_fast(p, len(p["x"]))
    try:
        moments, held = stress.moments(frame)
        chosen = bed(p["x"], p["y"], p["radius"], fixed)
        volume, thickness = stress.volume_rule(frame, chosen)
    except HpcdemError as error:
        raise HpcdemError(f"{path}: {error}") from None
    move = np.array([options.xmove, options.ymove])
    x, y, walls = p["x"] + move[0], p["y"] + move[1], frame.walls
    radius = p["radius"][chosen]
    diameter = 2.0 * float(np.mean(radius))
    extent = max(np.ptp(x[chosen]), np.ptp(y[chosen])) + 2.0 * float(np.max(radius))
    if not diameter <= options.size <= extent:
        what = (
            f"smaller than a particle ({diameter:.4g} m across)" if options.size < diameter else "larger than the model"
        )
        raise UsageError(f"-g {options.size:g}: {what} in {path}, {extent:.4g} m wide: choose a spacing in between")
    inside = np.ones(len(x), dtype=bool)
    for wall, sign in ((options.left_wall, 1.0), (options.right_wall, -1.0)):
        if wall is not None:
            row = np.flatnonzero(walls["id"] == wall)
            if not len(row):
                ids = ", ".join(map(str, walls["id"])) or "none"
                raise HpcdemError(f"{path} has no wall {wall}; its walls: {ids}")
            middle = 0.5 * (walls["p1"][row[0], 0] + walls["p2"][row[0], 0]) + move[0]
            inside &= sign * (x - middle) >= 0.0
    if not inside.any():
        raise HpcdemError(f"{path}: no particle lies between the walls given with --leftwallid and --rightwallid")
    if options.groups:
        inside &= _of_groups(frame, path, options.groups)
        if not inside.any():
            raise HpcdemError(f"{path}: no particle of the groups {', '.join(options.groups)} lies between the walls")
    return Snapshot(
        path.stem, frame.step, frame.time, p["gid"], x, y, p["radius"], p.get("color", np.zeros(len(x), np.int32)),
        inside, moments, volume, thickness, held, fixed,
        {"id": walls["id"], "p1": walls["p1"] + move, "p2": walls["p2"] + move, "color": walls["color"]},
    )  # fmt: skip


def _of_groups(frame: Frame, path: Path, groups: tuple[str, ...]) -> np.ndarray:
    """(n,): the particles of these groups. Raises HpcdemError for groups that the frame does not know."""
    names = [*frame.group_names]
    if unknown := [name for name in groups if name not in names]:
        known = ", ".join(names) or "none"
        raise HpcdemError(f"{path} has no group {unknown[0]}; its groups: {known}")
    column = frame.tables["particles"].columns.get("group", np.full(len(frame.tables["particles"]), -1))
    return np.isin(column, [names.index(name) for name in groups])


# --- two frames ------------------------------------------------------------------------------------------------


class Earlier:
    """The frame before, as it comes from the rank that read it: all particles by id, which of them are inside, and
    which of those are free to move."""

    def __init__(self, name: str, packed: np.ndarray) -> None:
        """packed: see `packed`."""
        self.name = name
        gid, self.x, self.y, self.radius = (np.ascontiguousarray(c) for c in packed[:, :4].T)
        self.gid, self.inside, self.free = gid.view(np.int64), packed[:, 4] > 0.0, packed[:, 4] > 1.0


def packed(s: Snapshot) -> np.ndarray:
    """(n, 5): gid (its bits), x, y, radius, and 0 outside, 1 fixed inside, 2 free inside."""
    state = np.where(s.inside, np.where(s.fixed, 1.0, 2.0), 0.0)
    return np.stack([s.gid.astype(np.int64).view(np.float64), s.x, s.y, s.radius, state], axis=1)


class Link(NamedTuple):
    """From a frame to the next: rows (n,) of the later frame's particles among those of the earlier one, -1 for new
    ones; dF (m, 4) of the earlier one's and how far they moved (m, 2) [m]; in both frames only those inside count.
    Fixed ones do not deform, and are in no fit."""

    rows: np.ndarray
    df: np.ndarray
    moved: np.ndarray


def link(earlier: Earlier, now: Snapshot, options: Options, sums: strain.Sums = grids.sums) -> Link:
    """Compare two frames. Raises HpcdemError when particles were added or deleted without leave."""
    at = np.minimum(np.searchsorted(earlier.gid, now.gid), len(earlier.gid) - 1)
    there = earlier.gid[at] == now.gid
    added, deleted = int((~there).sum()), len(earlier.gid) - int(there.sum())
    for number, leave, option, what in (
        (added, options.addball, "--addball", "added"),
        (deleted, options.delball, "--delball", "deleted"),
    ):
        if number and not leave:
            raise HpcdemError(
                f"{number} particle{'s were' if number > 1 else ' was'} {what} between {earlier.name} and "
                f"{now.name}: use {option}, or remove unrelated frames from the folder"
            )
    both = there & now.inside
    both[both] = earlier.inside[at[both]]
    df = np.full((len(earlier.gid), 4), np.nan)
    df[at[both]] = strain.IDENTITY
    free = both & ~now.fixed
    free[free] = earlier.free[at[free]]
    row = at[free]
    x, y = earlier.x[row], earlier.y[row]
    u, v = now.x[free] - x, now.y[free] - y
    if options.smooth:
        df[row] = strain.increment(options.size, x, y, earlier.radius[row], u, v, sums)
    else:
        df[row] = strain.nearest(options.size, x, y, u, v)
    moved = np.zeros((len(earlier.gid), 2))
    moved[at[both]] = np.stack([now.x[both] - earlier.x[at[both]], now.y[both] - earlier.y[at[both]]], axis=1)
    place = np.cumsum(earlier.inside) - 1
    return Link(np.where(both, place[at], -1)[now.inside], df[earlier.inside], moved[earlier.inside])


def carried(link: Link, f_earlier: np.ndarray | None) -> np.ndarray:
    """(n, 6): F of the later frame's particles, identity for new ones, and their displacement [m]; those of the pair
    alone without `f_earlier`."""
    old = link.rows >= 0
    f = np.tile(NOTHING, (len(old), 1))
    k = link.rows[old]
    f[old, :4] = link.df[k] if f_earlier is None else strain.times(link.df[k], f_earlier[k, :4])
    f[old, 4:] = link.moved[k] if f_earlier is None else link.moved[k] + f_earlier[k, 4:]
    return f


NOTHING = np.append(strain.IDENTITY, [0.0, 0.0])
"""F and displacement at the beginning."""


# --- the section -----------------------------------------------------------------------------------------------


def make_section(
    s: Snapshot, f: np.ndarray, size: float, spacing: float = 0.0, smooth: bool = True, sums: strain.Sums = grids.sums,
    volume: str = MEAN,
) -> Section:  # fmt: skip
    """Grid fields and particle columns of a frame; f (n, 6): F and displacement of the particles inside.

    Means are taken around nodes `size` apart [m]. With `smooth` these are the nodes of the section; otherwise its nodes
    are `spacing` apart (a whole part of `size`), the stress is linear between the others, and strains are those of
    the nearest particle; the volumetric one, with MEAN, is the mean of what lies around.
    """
    k = np.flatnonzero(s.inside)
    pseudo = s.moments[k] / s.volume[k, None]
    particles = {
        "gid": s.gid[k], "x": s.x[k], "y": s.y[k], "radius": s.radius[k], "color": s.color[k],
        "pxx": pseudo[:, 0], "pxy": 0.5 * (pseudo[:, 1] + pseudo[:, 2]), "pyy": pseudo[:, 3],
        "fxx": f[:, 0], "fxy": f[:, 1], "fyx": f[:, 2], "fyy": f[:, 3],
        "volumetric": strain.volumetric(f[:, :4]), "distortional": strain.distortional(f[:, :4]), "fixed": s.fixed[k],
    }  # fmt: skip
    chosen = bed(*(particles[name] for name in ("x", "y", "radius", "fixed")))
    x, y, radius, ev, ed = (particles[name][chosen] for name in ("x", "y", "radius", "volumetric", "distortional"))
    m, held = s.moments[k[chosen]], s.held[k[chosen]]
    grid = grids.cover(size, x, y, radius)
    known = np.isfinite(ev)
    columns = {
        "area": np.pi * radius * radius, "sxx": m[:, 0], "sxy": 0.5 * (m[:, 1] + m[:, 2]), "syy": m[:, 3],
    }  # fmt: skip
    total = sums(grid, x, y, columns, STRESS_REACH)
    solid = solid_fraction(grid, sums(grid, x, y, {"area": columns["area"]}, 1.0), x, y, radius)
    with np.errstate(invalid="ignore", divide="ignore"):
        extent = total["area"] / solid * s.thickness
        tensor = np.stack([total[name] / extent for name in ("sxx", "sxy", "syy")], axis=2)
    fields = {}
    if smooth:
        values = {"known": known.astype(float), "volumetric": ev, "distortional": ed}
        near = sums(grid, x, y, {name: np.where(known, v, 0.0) for name, v in values.items()}, 1.0)
        material = (near["number"] > 0) & grids.touched(grid, x, y, radius)
        with np.errstate(invalid="ignore", divide="ignore"):
            for name in ("volumetric", "distortional"):
                fields[name] = near[name] / near["known"]
    else:
        grid, coarse = grids.cover(spacing, x, y, radius), grid
        nodes = [axis.ravel() for axis in np.meshgrid(grid.x, grid.y)]
        tensor = grids.between(coarse, tensor, *nodes).reshape(grid.ny, grid.nx, 3)
        material = grids.touched(grid, x, y, radius)
        some = np.flatnonzero(known)
        at = cKDTree(np.stack([x[some], y[some]], axis=1)).query(np.stack(nodes, axis=1)) if len(some) else None
        if volume == PAGE:
            u = f[chosen, 4:]
            ev = strain.page_volume(size, x, y, *u.T)
        for name, v in (("volumetric", ev), ("distortional", ed)):
            fields[name] = np.full((grid.ny, grid.nx), np.nan)
            if at is not None:
                close = at[0] < size
                fields[name].flat[close] = v[some[at[1][close]]]
                if name == "volumetric" and volume == MEAN:
                    area = np.pi * radius[some] ** 2
                    mean = strain.mean_volume(grid, x[some], y[some], area, v[some], SPREAD * size)
                    fields[name].flat[close] = mean.flat[close]
    fields = {name: np.where(material, values, np.nan) for name, values in fields.items()}
    sxx, sxy, syy = (np.where(material, tensor[..., c], np.nan) for c in (0, 1, 2))
    mean, shear, angle = stress.principal(sxx, sxy, syy)
    fields |= {"mean": mean, "shear": shear, "sxx": sxx, "sxy": sxy, "syy": syy, "direction": angle}
    top = held if held.any() else slice(None)
    line = surface(x[top], y[top], radius[top], size, 0.1 * size)
    return Section(
        s.name, s.step, s.time, grid.size, grid.x, grid.y, fields, particles, line, s.walls, smooth, size,
        MEAN if smooth else volume,
    )  # fmt: skip


def solid_fraction(
    grid: grids.Grid, total: dict[str, np.ndarray], x: np.ndarray, y: np.ndarray, radius: np.ndarray
) -> np.ndarray:
    """(ny, nx): area of discs per area of the section around each node, without the share of empty space outside.

    The mean over the nodes at most AROUND spacings away that lie INSIDE spacings from any empty place; the mean over
    all of these if none is near; over all that discs reach where the model is thin everywhere.
    """
    inner = _in_both_directions(np.logical_and, total["number"] > 0, INSIDE)
    if not inner.any():
        fine = grids.cover(2.0 * float(np.mean(radius)), x, y, radius)
        reached = float(grids.touched(fine, x, y, radius).sum()) * fine.size**2
        return np.full(inner.shape, float(np.sum(np.pi * radius**2)) / reached)
    area = np.where(inner, total["area"], 0.0)
    count = _in_both_directions(np.add, inner.astype(float), AROUND)
    with np.errstate(invalid="ignore", divide="ignore"):
        near = np.where(count > 0.0, _in_both_directions(np.add, area, AROUND) / count, area.sum() / inner.sum())
    return near / (np.pi * grid.size**2)


def _in_both_directions(combine: np.ufunc, values: np.ndarray, reach: int) -> np.ndarray:
    """Combine each value with those up to `reach` places away in both directions; zero outside."""
    for axis in (0, 1):
        padded = np.pad(values, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)])
        result = np.take(padded, range(values.shape[axis]), axis)
        for k in range(1, 2 * reach + 1):
            result = combine(result, np.take(padded, range(k, k + values.shape[axis]), axis))
        values = result
    return values


# --- all frames ------------------------------------------------------------------------------------------------


def _rounds(
    comm: Comm, log: Any, frames: list[FrameFile], options: Options, output: _Output, sums: strain.Sums
) -> None:
    """Collective over `comm`: one frame per rank and round."""
    last = _Last()
    began = reported = time.monotonic()
    for first in range(0, len(frames), comm.size):
        last = _round(comm, frames, first, last, options, output, sums)
        done, now = min(first + comm.size, len(frames)), time.monotonic()
        if now - reported >= QUIET_SECONDS or done == len(frames):
            name, speed = frames[done - 1].path.name, done / max(now - began, 1e-9)
            log.info(f"{done} of {len(frames)} frames, to {name}, {speed:.3g} frames/s")
            reported = now


class _Last(NamedTuple):
    """Data of the last frame of a round, kept by rank 0: particles as `packed`, and deformation gradient F."""

    packed: np.ndarray = np.zeros((0, 5))
    f: np.ndarray = np.zeros((0, 6))


def _round(
    comm: Comm, frames: list[FrameFile], first: int, last: _Last, options: Options, output: _Output, sums: strain.Sums
) -> _Last:
    mine = first + comm.rank
    file = frames[mine] if mine < len(frames) else None
    now = _each(comm, lambda: read_snapshot(file.path, options) if file else None)
    arrived = _to_next(comm, packed(now) if now else last.packed[:0])
    before = Earlier(frames[mine - 1].path.stem, last.packed if comm.rank == 0 else arrived) if now and mine else None
    found = _each(comm, lambda: link(before, now, options, sums) if before and now else None)

    # F goes from rank to rank, and from the last one to rank 0, where the next round begins.
    f, f_before = np.zeros((0, 6)), last.f
    for turn in range(comm.size):
        if comm.rank == turn and now:
            f = carried(found, None if options.increment else f_before) if found else _none(now)
        passed = _to_next(comm, f if comm.rank == turn else f[:0])
        f_before = passed if len(passed) else f_before

    def result() -> None:
        if now:
            how = options.volume or MEAN
            section = make_section(now, f, options.size, output.spacing, options.smooth, sums, how)
            _write(section, options, frames[0], output.folder)

    _each(comm, result)
    return _Last(arrived, f_before)


def _none(now: Snapshot) -> np.ndarray:
    """F before anything has happened."""
    return np.tile(NOTHING, (int(now.inside.sum()), 1))


def _to_next(comm: Comm, rows: np.ndarray) -> np.ndarray:
    """Collective: every rank's rows (n, k) go to the next rank, the last one's to rank 0; what came from the one
    before."""
    _, arrived = comm.to_ranks(np.full(len(rows), (comm.rank + 1) % comm.size), rows)
    return arrived


def _write(section: Section, options: Options, first: FrameFile, folder: Path) -> None:
    since = "the frame before" if options.increment else first.path.stem
    section_files.write_out(folder / f"{section.name}.out", section, since)
    section_files.write_grid(folder / f"{section.name}.vtkhdf", section)
    write_section(section, folder / f"{section.name}.npz")


def _together(comm: Comm, log: Any, frames: list[FrameFile], options: Options, output: _Output) -> None:
    """Collective: rank 0 goes through the frames, all ranks sum their columns of the grids."""
    error = None
    if comm.rank == 0:

        def shared(grid: grids.Grid, *what: Any, **how: Any) -> dict[str, np.ndarray]:
            comm.bcast((grid, what, how))
            parts = comm.gather(_my_columns(comm, grid, what, how)) or []
            return {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}

        try:
            _, error = _tried(lambda: _rounds(SerialComm(), log, frames, options, output, shared))
        finally:
            with suppress(HpcdemError):
                comm.bcast(None)
    else:
        while (task := comm.bcast(None)) is not None:
            comm.gather(_my_columns(comm, *task))
    comm.agree(error)


def _my_columns(comm: Comm, grid: grids.Grid, what: tuple, how: dict) -> dict[str, np.ndarray]:
    how = {**how, "columns": (grid.nx * comm.rank // comm.size, grid.nx * (comm.rank + 1) // comm.size)}
    return grids.sums(grid, *what, **how)
