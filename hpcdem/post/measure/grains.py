"""The particles of a frame as measurements see them: plain columns in the order of ids."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.core.fields import sides_of_box
from hpcdem.io.frame import Frame, Table
from hpcdem.io.frames import FrameFile, list_frames, read_frame
from hpcdem.io.vtkhdf_mesh import is_mesh_frame, read_mesh_frame
from hpcdem.post.surface import held_fast

Walls = dict[int, tuple[tuple[float, float], tuple[float, float]]]
_COLUMNS = ("gid", "x", "y", "r", "color", "group", "fixed", "laps")


def _no_pairs() -> np.ndarray:
    return np.zeros((0, 2), np.int64)


@dataclass(frozen=True)
class Grains:
    """The particles of a frame in the order of ids, and its walls (id: ((x1, y1), (x2, y2)), BOX -1 to -4).

    gid, x, y, r [m], color, group (names): (n,) each; bonds, contacts: (m, 2) ids of the pairs, where they were read;
    time [s]; ini: the state before the first step of a command; fixed (n,): held along x and y, as rows of
    particles are that stand for walls; side, period: x of the left periodic side and the distance of the sides [m], 0
    of other models; laps (n,): crossings of these sides to the right.
    """

    step: int
    gid: np.ndarray
    x: np.ndarray
    y: np.ndarray
    r: np.ndarray
    color: np.ndarray
    group: np.ndarray
    walls: Walls
    time: float = float("nan")
    ini: bool = False
    bonds: np.ndarray = field(default_factory=_no_pairs)
    contacts: np.ndarray = field(default_factory=_no_pairs)
    fixed: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    side: float = 0.0
    period: float = 0.0
    laps: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if len(self.fixed) != len(self.gid):
            object.__setattr__(self, "fixed", np.zeros(len(self.gid), bool))
        if len(self.laps) != len(self.gid):
            object.__setattr__(self, "laps", np.zeros(len(self.gid)))

    @staticmethod
    def columns() -> tuple[str, ...]:
        """Names of the columns of particles."""
        return _COLUMNS

    def __len__(self) -> int:
        return len(self.gid)

    def take(self, keep: np.ndarray) -> Grains:
        """The grains chosen by a mask or by rows; pairs stay."""
        return replace(self, **{name: getattr(self, name)[keep] for name in _COLUMNS})

    def moved(self, x: float, y: float) -> Grains:
        """Return everything moved by (x, y) [m]."""
        walls = {i: ((a[0] + x, a[1] + y), (b[0] + x, b[1] + y)) for i, (a, b) in self.walls.items()}
        return replace(self, x=self.x + x, y=self.y + y, side=self.side + x, walls=walls)

    def drawn(self, walls: int = 5) -> Frame:
        """A frame that holds what pictures need, walls in this colour; without the sides of the BOX."""
        columns = {"gid": self.gid, "x": self.x, "y": self.y, "radius": self.r, "color": self.color}
        shown = {i: ends for i, ends in self.walls.items() if i not in sides_of_box(self.walls)}
        ends = np.array([*shown.values()], dtype=float).reshape(-1, 2, 2)
        table = {"id": np.array([*shown], np.int64), "p1": ends[:, 0], "p2": ends[:, 1]}
        table["color"] = np.full(len(shown), walls, np.int32)
        return Frame(self.step, self.time, 0.0, {}, table, {"particles": Table(columns, 0, len(self))})


def grains(path: Path, ini: bool = False, tables: tuple[str, ...] = ()) -> Grains:
    """The grains of one frame file. tables: "bonds" and "contacts", where wanted. Raises HpcdemError."""
    if path.suffix == ".vtkhdf" and is_mesh_frame(path):
        return elements(path)
    frame = read_frame(path, ["particles", *tables])
    p = frame.tables["particles"].columns
    none = np.zeros(0)
    gid = np.asarray(p.get("gid", none), dtype=np.int64)
    order = np.argsort(gid, kind="stable")
    x, y, r = (np.asarray(p.get(name, none), dtype=float)[order] for name in ("x", "y", "radius"))
    bad = ~np.isfinite(x + y + r)
    if bad.any():
        raise HpcdemError(f"{path}: the position of particle {gid[order][bad][0]} is not a number")
    color = np.asarray(p.get("color", np.zeros(len(gid))), dtype=np.int64)[order]
    names = np.array([*frame.group_names, ""], dtype=object)
    row = np.asarray(p.get("group", np.full(len(gid), -1)), dtype=np.int64)[order]
    group = names[np.where((row >= 0) & (row < len(names)), row, len(names) - 1)]
    fixed = held_fast(p, len(gid))[order]
    bonds, contacts = (_pairs(frame, name) if name in tables else _no_pairs() for name in ("bonds", "contacts"))
    found = Grains(
        frame.step, gid[order], x, y, r, color, group, _walls(frame), frame.time, ini, bonds, contacts, fixed
    )
    if not (period := float(frame.settings.get("period", 0.0))):
        return found
    if "laps" not in p:
        raise HpcdemError(
            f"{path}: the sides of this model are periodic (PERIODIC), and this file does not contain the crossings of "
            "the particles (laps); measure frames *.vtkhdf"
        )
    return replace(found, side=float(frame.settings["left"]), period=period, laps=np.asarray(p["laps"], float)[order])


def elements(path: Path) -> Grains:
    """The elements of a frame of blocks as grains: at their centroids, with the radius of a disc of their area, the
    colour by the number of their group. Raises HpcdemError in space."""
    state = read_mesh_frame(path, solid=True)
    if state.points.shape[1] == 3:
        raise HpcdemError(f"faults: supports blocks in two dimensions only; {path.name} has three")
    order = np.argsort(state.of_elements["number"], kind="stable")
    cells = state.cells[order]
    corners = np.where(cells >= 0, cells, cells[:, [0]])
    weight = (cells >= 0)[..., None] / (cells >= 0).sum(axis=1)[:, None, None]
    x, y = (state.points[corners, :2] * weight).sum(axis=1).T
    column, names = next(iter(state.group_names.items()), ("", []))
    row = state.of_elements[column][order].astype(np.int64) if column else np.full(len(order), -1)
    group = np.array([*names, ""], dtype=object)[np.where(row >= 0, row, len(names))]
    radius = np.sqrt(state.of_elements["area"][order] / np.pi)
    gid = state.of_elements["number"][order].astype(np.int64)
    return Grains(state.step, gid, x, y, radius, np.maximum(row, 0) % 10, group, {}, state.time)


def _walls(frame: Frame) -> Walls:
    none = np.zeros((0, 2))
    ends = zip(frame.walls.get("id", none), frame.walls.get("p1", none), frame.walls.get("p2", none))
    return {int(i): (tuple(a.tolist()), tuple(b.tolist())) for i, a, b in ends}


def walls_of(path: Path) -> Walls:
    """The walls of a frame file alone. Raises HpcdemError."""
    if path.suffix == ".vtkhdf" and is_mesh_frame(path):
        return {}
    return _walls(read_frame(path, ()))


def _pairs(frame: Frame, name: str) -> np.ndarray:
    columns = frame.tables[name].columns if name in frame.tables else {}
    if "id1" not in columns:
        return _no_pairs()
    return np.stack([columns["id1"], columns["id2"]], axis=1).astype(np.int64)


def in_time(folder: Path, first: int = 0, last: int | None = None) -> list[FrameFile]:
    """The frames of a folder from step `first` to `last` in the order in which they were written.

    At one step the last frame of a command comes before the `_ini` frame of the next: in between the script may have
    added and deleted particles.
    """
    return [f for f in list_frames(folder) if f.step >= first and (last is None or f.step <= last)]


def common(a: Grains, b: Grains) -> tuple[Grains, Grains]:
    """The grains that both frames hold, in the same order."""
    _, ia, ib = np.intersect1d(a.gid, b.gid, assume_unique=True, return_indices=True)
    return a.take(ia), b.take(ib)


def middle(walls: Walls, wall: int) -> np.ndarray:
    """(2,): middle of a wall [m], else NaN."""
    return np.mean(walls[wall], axis=0) if wall in walls else np.full(2, np.nan)


def gone(first: Walls, last: Walls, wall: int) -> float:
    """Return the displacement of the midpoint of a wall along x [m]; 0 if a frame lacks the wall."""
    return abs(float(middle(last, wall)[0] - middle(first, wall)[0])) if wall in first and wall in last else 0.0


def driving_wall(first: Walls, last: Walls) -> int | None:
    """Id of the wall whose middle went farthest along x, None where none went. Walls that bend (FLEXURE) become
    shorter: they do not push."""
    rigid = [i for i in first if i in last and math.isclose(math.dist(*first[i]), math.dist(*last[i]), rel_tol=1e-6)]
    paths = {i: gone(first, last, i) for i in rigid if i not in sides_of_box(first)}
    wall = max(paths, key=lambda i: paths[i], default=None)
    return wall if wall is not None and paths[wall] > 0.0 else None


def pushing_row(first: Grains, last: Grains) -> np.ndarray:
    """Ids of the row of particles that pushes: of those fixed along x and y in both frames, which went equally far
    along x and stand higher than wide, those that went farthest; none: no such row moves."""
    a, b = common(first.take(first.fixed), last.take(last.fixed))
    moved = b.x - a.x
    far = float(np.abs(moved).max(initial=0.0))
    best = np.zeros(0, np.int64)
    if far > 0.0:
        order = np.argsort(moved, kind="stable")
        rows = np.split(order, np.flatnonzero(np.diff(moved[order]) > 1e-3 * far) + 1)
        upright = [row for row in rows if np.ptp(b.y[row]) > np.ptp(b.x[row]) and abs(moved[row]).min() > 1e-3 * far]
        best = b.gid[max(upright, key=lambda row: float(np.abs(moved[row]).min()), default=best)]
    return best


def face_of_row(g: Grains, row: np.ndarray, forward: int) -> float:
    """x [m] of the face of a row of particles (ids) towards +x or -x: the median over its height; NaN without it."""
    some = np.isin(g.gid, row)
    if not some.any():
        return float("nan")
    x, y, r = forward * g.x[some] + g.r[some], g.y[some], g.r[some]
    high = np.floor(y / (2.0 * float(r.max()))).astype(np.int64)
    edges = [float(x[high == k].max()) for k in np.unique(high)]
    return forward * float(np.median(edges))


def when_it_moves(frames: Sequence[FrameFile], moved: Callable[[FrameFile], bool]) -> int:
    """Number of the last frame before something leaves its place; 0 if it never does. Raises HpcdemError."""
    low, high = 0, len(frames)  # at rest, gone
    while high - low > 1:
        k = (low + high) // 2
        low, high = (low, k) if moved(frames[k]) else (k, high)
    return low if high < len(frames) else 0


def columns_of(r: np.ndarray) -> float:
    """Width of columns and cells [m] that suits grains of these radii: about three radii, a round number."""
    wanted = 3.0 * float(np.max(r))
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((m * power for m in (1.0, 2.0, 2.5, 5.0, 10.0)), key=lambda c: abs(np.log(c / wanted))))
