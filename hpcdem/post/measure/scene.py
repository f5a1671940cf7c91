"""The request, what holds for all frames of a folder, and what is known of one frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.frames import FrameFile, list_mesh_frames
from hpcdem.post.measure import tracks
from hpcdem.post.measure.grains import (
    Grains,
    columns_of,
    driving_wall,
    face_of_row,
    gone,
    grains,
    in_time,
    middle,
    pushing_row,
    walls_of,
    when_it_moves,
)
from hpcdem.post.surface import bed

KINDS = ("surface", "wedge", "faults", "wallforce", "tracks", "layers", "cracks")
"""Measurements of particles, by words of the command line."""
BLOCK_KINDS = ("cracks", "fragments", "emission", "fluid")
"""Measurements of blocks."""
SOLID_KINDS = ("regions", "displacement", "cracks", "fragments", "emission", "fluid")
"""Measurements of blocks in space."""


@dataclass(frozen=True)
class Request:
    """A request for measurements. Lengths in m.

    what: names of KINDS, empty: all that the folder allows; walls: ids, the pushing wall first; groups, colors:
    restrict to these particles; first, last: steps (default: from the last frame before the wall moves to the last
    frame); xmove, ymove: offset of all coordinates; width: of columns and cells; formats: of figures; strain, length,
    skin: threshold, shortest band and height above the base for faults; increment: strain from frame to frame even if
    there are sections; over_time: follow faults through the frames by the strain from frame to frame; ids, points,
    number: particles to follow; log: of the run; history: name of the history drawn with the emission, none: no
    history; bins: of its rate; completeness: magnitude Mc; released: energies since the peak of the joints; joule: J
    per unit of energy in the files; box: least x, y, z, then greatest x, y, z [m].
    """

    folder: Path
    what: tuple[str, ...] = ()
    output: Path | None = None
    walls: tuple[int, ...] = ()
    groups: tuple[str, ...] = ()
    colors: tuple[int, ...] = ()
    first: int | None = None
    last: int | None = None
    xmove: float = 0.0
    ymove: float = 0.0
    width: float | None = None
    formats: tuple[str, ...] = ("png",)
    strain: float | None = None
    length: float | None = None
    skin: float | None = None
    increment: bool = False
    over_time: bool = False
    ids: tuple[int, ...] = ()
    points: tuple[tuple[float, float], ...] = ()
    number: int = 1
    log: Path | None = None
    history: str | None = None
    bins: int = 100
    completeness: float | None = None
    released: bool = False
    joule: float = 1.0
    box: tuple[float, ...] | None = None
    color_names: dict[int, str] = field(default_factory=dict)

    @property
    def target(self) -> Path:
        """The folder for the results."""
        return self.folder / "measure" if self.output is None else self.output

    def color(self, number: int | str) -> str:
        """Name of a colour."""
        return self.color_names.get(int(number), str(number))

    def chosen(self, g: Grains) -> np.ndarray:
        """Return flags (n,) of the particles with the requested groups and colours."""
        keep = np.ones(len(g), bool)
        if self.groups:
            keep &= np.isin(g.group.astype(str), self.groups)
        if self.colors:
            keep &= np.isin(g.color, self.colors)
        return keep


@dataclass(frozen=True)
class Plan:
    """Settings for all frames: frames in order of time, those with sections, width of columns [m], the pushing wall or
    the ids of the pushing row of particles, its direction +1 or -1, its position in the first frame [m], ids of
    particles to follow, and distance of periodic sides in the first frame [m], 0 of other models.
    """

    request: Request
    frames: list[FrameFile]
    sections: frozenset[str]
    cell: float
    wall: int | None
    row: np.ndarray
    forward: int
    start: float
    followed: np.ndarray
    period: float = 0.0

    def face(self, g: Grains) -> float:
        """Return x of the face of the pushing wall or row [m]; NaN without one."""
        if self.wall is not None:
            return float(middle(g.walls, self.wall)[0])
        return face_of_row(g, self.row, self.forward) if len(self.row) else float("nan")

    def shortening(self, g: Grains) -> float:
        """Return the displacement of what pushes, or the approach of periodic sides [m]; NaN without both."""
        if self.period:
            return self.period - g.period
        return self.forward * (self.face(g) - self.start)


def make_plan(request: Request, what: Sequence[str]) -> tuple[Plan, Grains]:
    """Return the plan, and the last frame with particles. Raises HpcdemError."""
    frames = in_time(request.folder, request.first or 0, request.last)
    if not frames and set(what) == {"faults"}:  # the estimator needs no more than points that keep their numbers
        low, high = request.first or 0, np.inf if request.last is None else request.last
        frames = [f for f in list_mesh_frames(request.folder) if low <= f.step <= high]
    if not frames:
        between = (f" from step {request.first}" if request.first else "") + (
            f" to step {request.last}" if request.last is not None else ""
        )
        raise HpcdemError(f"{request.folder} contains no frames (all_<step>.vtkhdf or all_<step>.dat){between}")
    wall, row, frames = _pusher(request, frames)
    if request.first is None and (wall is not None or len(row)):
        begin = _place(frames[0], request, wall, row)
        frames = frames[when_it_moves(frames, lambda file: abs(_place(file, request, wall, row) - begin) > 0.0) :]
    first = _with_particles(request, frames)
    last = _with_particles(request, frames[::-1])
    forward = -1 if _place(frames[0], request, wall, row) > float(np.mean(first.x)) else 1
    start = _place(frames[0], request, wall, row, forward)
    cell = columns_of(first.r) if request.width is None else request.width
    folder = request.folder / "ss" / "data"
    sections = (
        frozenset() if request.increment or request.over_time else frozenset(p.stem for p in folder.glob("all_*.npz"))
    )
    followed = _followed(request, first, last) if "tracks" in what else np.zeros(0, np.int64)
    return Plan(request, frames, sections, cell, wall, row, forward, start, followed, first.period), last


def _pusher(request: Request, frames: list[FrameFile]) -> tuple[int | None, np.ndarray, list[FrameFile]]:
    """The wall that pushes, or the ids of the row of particles that does: whichever went farther along x; the frames
    from the first one on that has it."""
    none = np.zeros(0, np.int64)
    first, last = walls_of(frames[0].path), walls_of(frames[-1].path)
    if request.walls:
        wall = request.walls[0]
        if wall not in first:
            ids = ", ".join(map(str, sorted(first))) or "none"
            raise UsageError(f"--wall {wall}: unknown wall in {frames[0].path.name}; its walls: {ids}")
        return wall, none, frames
    moving = driving_wall(first, last)
    end = read_grains(frames[-1], request)
    if end.fixed.any():
        for k, file in enumerate(frames):
            begin = read_grains(file, request)
            if not begin.fixed.any():
                continue
            row = pushing_row(begin, end)
            path_length = abs(face_of_row(end, row, 1) - face_of_row(begin, row, 1)) if len(row) else 0.0
            if path_length > 0.0 and (moving is None or path_length > gone(first, last, moving)):
                return None, row, frames[k:]
            break
    return moving, none, frames


def _place(file: FrameFile, request: Request, wall: int | None, row: np.ndarray, forward: int = 1) -> float:
    """x [m] of the face of what pushes in a frame; NaN without it."""
    if wall is not None:
        return float(middle(walls_of(file.path), wall)[0]) + request.xmove
    return face_of_row(read_grains(file, request), row, forward) if len(row) else float("nan")


def _with_particles(request: Request, frames: Sequence[FrameFile]) -> Grains:
    """The first of these frames that has requested particles."""
    groups: set[str] = set()
    colors: set[int] = set()
    for file in frames:
        g = read_grains(file, request)
        if request.chosen(g).any():
            return g.take(request.chosen(g))
        groups |= {*g.group.tolist()}
        colors |= {*np.unique(g.color).tolist()}
    if not colors:
        raise HpcdemError(f"no frame in {request.folder} has particles")
    raise UsageError(
        f"no particle in {request.folder} has the requested groups and colours; groups: "
        f"{', '.join(sorted(filter(None, groups))) or 'none'}; colours: "
        f"{', '.join(map(request.color, sorted(colors)))}"
    )


def read_grains(file: FrameFile, request: Request, tables: tuple[str, ...] = ()) -> Grains:
    """A frame, moved as requested."""
    return grains(file.path, file.ini, tables).moved(request.xmove, request.ymove)


def _followed(request: Request, first: Grains, last: Grains) -> np.ndarray:
    """Ids of the particles to follow: those named; else the nearest to points in the first frame; else all of the
    groups and colours; else some spread over the bed."""
    if request.ids:
        return np.unique(np.array(request.ids, np.int64))
    if request.points:
        return tracks.nearest(first, np.array(request.points), request.number)
    if request.groups or request.colors:
        return first.gid
    return tracks.nearest(first, tracks.spread(bed_of(first)))


def bed_of(g: Grains) -> Grains:
    """The grains of the bed, see `surface.bed`."""
    return g.take(bed(g.x, g.y, g.r, g.fixed))


@dataclass
class Scene:
    """One frame: all its particles, and the requested ones; the previous frame; its number and the common settings."""

    file: FrameFile
    number: int
    all: Grains
    before: Grains | None
    plan: Plan

    @cached_property
    def grains(self) -> Grains:
        """The requested particles."""
        return self.all.take(self.plan.request.chosen(self.all))

    @cached_property
    def bed(self) -> Grains:
        """The requested particles without detached pieces and fixed particles."""
        return bed_of(self.grains)

    @property
    def stamp(self) -> Stamp:
        """Return the time of the frame."""
        return Stamp(self.all.step, self.all.ini, self.all.time, self.plan.shortening(self.all))


@dataclass(frozen=True)
class Stamp:
    """Time of a frame: step, whether before the first step of a command, time [s], shortening [m]."""

    step: int
    ini: bool
    time: float
    shortening: float

    HEAD = ("step", "ini", "time[s]")

    @property
    def row(self) -> tuple[int, int, float]:
        """The first columns of every table."""
        return self.step, int(self.ini), self.time

    @property
    def label(self) -> str:
        """Name for a figure."""
        return f"step {self.step}"
