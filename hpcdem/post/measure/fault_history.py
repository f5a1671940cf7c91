"""Faults as objects: bands of strain with an identity through the frames, and the slip across them.

1. `track`: bands of successive frames that hold the same particles are one fault. It is born with its first band, grows
   with later ones, is inactive in frames without one, and merges into another when that one's band covers it.
2. `plane`: the fault is the straight line through its particles as they were in the frame before its birth, the
   *reference*; beside it, at both sides, are the particles whose motion is compared.
3. `measure`: the displacement since the reference is fitted at each side by an affine map, u = u0 + H (X - P), around
   points P of the line. The slip is the difference u0(hanging wall) - u0(footwall) along the line as it lies now. No
   increments are summed: the slip depends on neither the number of frames nor their distance, and is exact where the
   sides are rigid or strain homogeneously.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import Delaunay, QhullError

from hpcdem.post.measure.faults import Band, axis_of
from hpcdem.post.measure.grains import Grains

SHARE, COVERED = 0.25, 0.5
"""A band belongs to a fault if they share this part of the particles of the smaller one; a fault without a band of its
own that shares COVERED of its particles with the band of another one has merged into that."""
TURN = 30.0
"""Difference of dip [degrees] above which a band belongs to another fault than the last one."""
RECENT = 3
"""Number of active frames whose particles define where a fault is."""
LEAST = 2
"""Smallest number of frames in which a fault has bands, where there are as many frames."""
ALONG, BESIDE = 2.5, 4.0
"""Window on each side of a point of the line, in cells: half its length, and its width from the edge of the band on."""
FEWEST = 6
"""Smallest number of particles of a fit."""
STEEP = 80.0
"""Dip [degrees] above which a fault has no hanging wall."""
STRAIGHT = 1.0
"""Largest standard deviation of the points of a horizon about their line, in cells."""


@dataclass(frozen=True)
class Seen:
    """A band of a frame and the ids of the particles in it."""

    band: Band
    ids: np.ndarray


@dataclass
class Fault:
    """A fault. Frames are counted from the first one; seen: its bands by frame; merged: into which number and in which
    frame."""

    number: int
    vergence: int
    seen: dict[int, list[Seen]] = field(default_factory=dict)
    merged: tuple[int, int] | None = None

    @property
    def born(self) -> int:
        """The first frame with a band."""
        return min(self.seen)

    @property
    def last(self) -> int:
        """The last frame with a band."""
        return max(self.seen)

    def ids(self, frames: Sequence[int]) -> np.ndarray:
        """Ids of the particles in its bands of these frames."""
        found = [one.ids for k in frames for one in self.seen.get(k, ())]
        return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)

    @property
    def recent(self) -> np.ndarray:
        """Ids of the particles in its last bands."""
        return self.ids(sorted(self.seen)[-RECENT:])

    @property
    def dip(self) -> float:
        """Return the dip of the longest of the last bands [degrees]."""
        return max(self.seen[self.last], key=lambda one: one.band.length).band.dip


def members(band: Band, g: Grains, cell: float) -> np.ndarray:
    """Ids of the particles in a band: nearer to its line than half of its width, at least half a cell."""
    (x1, y1), (x2, y2) = band.ends
    ex, ey = (x2 - x1) / band.length, (y2 - y1) / band.length
    along, across = (g.x - x1) * ex + (g.y - y1) * ey, (g.y - y1) * ex - (g.x - x1) * ey
    half = max(band.area / band.length, cell) / 2.0
    return g.gid[(along >= 0.0) & (along <= band.length) & (np.abs(across) <= half)]


# --- identity ----------------------------------------------------------------------------------------------------


def track(frames: Sequence[Sequence[Seen]]) -> tuple[list[Fault], int]:
    """Faults in the order of their birth, and how many bands were left out because they were seen in fewer than LEAST
    frames. frames: bands of each frame."""
    faults: list[Fault] = []
    for k, bands in enumerate(frames):
        _join(faults, k, bands)
    least = min(LEAST, sum(1 for bands in frames if bands))
    kept = [f for f in faults if len(f.seen) >= least]
    kept.sort(key=lambda f: (f.born, -sum(one.band.length for one in f.seen[f.born]), f.number))
    number = {f.number: k for k, f in enumerate(kept, 1)}
    for f in kept:
        f.number = number[f.number]
        # The one it merged into has bands in this frame and in an earlier one.
        f.merged = None if f.merged is None else (number[f.merged[0]], f.merged[1])
    return kept, sum(len(f.seen) for f in faults) - sum(len(f.seen) for f in kept)


def _join(faults: list[Fault], k: int, bands: Sequence[Seen]) -> None:
    """Give the bands of frame k to faults, or make new ones of them."""
    alive = [(f, f.recent, f.dip) for f in faults if f.merged is None]
    pairs = []
    for n, (f, recent, dip) in enumerate(alive):
        for b, one in enumerate(bands):
            if one.band.vergence != f.vergence or _turn(dip, one.band.dip) > TURN or not len(one.ids):
                continue
            common = len(np.intersect1d(one.ids, recent, assume_unique=True))
            if common >= SHARE * min(len(one.ids), len(recent)):
                pairs.append((-common, n, b, common / len(recent)))
    owner: dict[int, int] = {}
    for _, n, b, _ in sorted(pairs):
        owner.setdefault(b, n)
    for b, one in enumerate(bands):
        if b in owner:
            alive[owner[b]][0].seen.setdefault(k, []).append(one)
        elif len(one.ids):
            faults.append(Fault(len(faults), one.band.vergence, {k: [one]}))
    for _, n, b, share in sorted(pairs):
        f = alive[n][0]
        if k not in f.seen and share >= COVERED and f.merged is None:
            f.merged = alive[owner[b]][0].number, k


def _turn(a: float, b: float) -> float:
    """Angle between two dips in degrees."""
    return abs((a - b + 90.0) % 180.0 - 90.0)


# --- where it was ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Plane:
    """A fault in its reference frame. centre; along, normal: unit vectors up the dip and into the hanging wall; window
    [m]: half the length along the line of that of a point; s (m,): points on the line, distances from the centre [m];
    reach: over which of them it extended by each frame; gid, place (n, 2), side (n,): particles beside it, +1 in the
    hanging wall, -1 in the footwall; horizons: names, and where on the line each is [m]."""

    centre: np.ndarray
    along: np.ndarray
    normal: np.ndarray
    window: float
    s: np.ndarray
    reach: dict[int, tuple[float, float]]
    gid: np.ndarray
    place: np.ndarray
    side: np.ndarray
    horizons: dict[str, float]


def plane(fault: Fault, reference: Grains, cell: float, names: np.ndarray) -> Plane | None:
    """The fault in the frame before its birth; None if fewer than three of its particles were there. names (n,): of the
    layers of the particles of that frame."""
    active = sorted(fault.seen)
    first = np.isin(reference.gid, fault.ids(active[:RECENT]))
    if first.sum() < 3:
        return None
    places = np.column_stack([reference.x, reference.y])
    centre, along = axis_of(places[first], np.ones(int(first.sum())))
    along = -along if along[1] < 0.0 or (along[1] == 0.0 and along[0] < 0.0) else along
    normal = np.array([-along[1], along[0]])
    normal = -normal if normal[1] < 0.0 or (normal[1] == 0.0 and normal[0] < 0.0) else normal
    where, across = (places - centre) @ along, (places - centre) @ normal
    half = max(float(np.median([s.band.area / s.band.length for seen in fault.seen.values() for s in seen])), cell) / 2
    half += float(np.mean(reference.r))
    reach: dict[int, tuple[float, float]] = {}
    low, high = np.inf, -np.inf
    for k in active:
        mine = where[np.isin(reference.gid, fault.ids([k])) & (np.abs(across) <= 2.0 * half)]
        if len(mine):
            low, high = min(low, float(mine.min())), max(high, float(mine.max()))
        reach[k] = low, high
    if not high > low:
        return None
    count = max(round((high - low) / cell), 1)
    s = low + (np.arange(count) + 0.5) * (high - low) / count
    window = ALONG * cell
    near = (np.abs(across) <= half + BESIDE * cell) & (where >= low - window) & (where <= high + window)
    side = np.where(across > half, 1, np.where(across < -half, -1, 0))
    beside = near & (side != 0) & ~reference.fixed
    found = _horizons(reference, names, near, centre, along, cell)
    horizons = {name: at for name, at in found.items() if low <= at <= high}
    return Plane(centre, along, normal, window, s, reach, reference.gid[beside], places[beside], side[beside], horizons)


def _horizons(
    g: Grains, names: np.ndarray, near: np.ndarray, centre: np.ndarray, along: np.ndarray, cell: float
) -> dict[str, float]:
    """Locate the intersections of horizons with the line: "UPPER over LOWER" of two layers, and the distance from the
    centre. A horizon is the line through the midpoints between neighbours of the two layers; horizons with scattered
    midpoints are omitted."""
    rows = np.flatnonzero(near)
    points = np.column_stack([g.x, g.y])[rows]
    try:
        corners = Delaunay(points).simplices
    except (QhullError, ValueError):  # too few, or all on one line
        return {}
    edges = np.unique(np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1),
                      axis=0)  # fmt: skip
    a, b = edges.T
    short = np.hypot(*(points[a] - points[b]).T) <= 3.0 * float(np.max(g.r[rows]))
    label = names[rows]
    a, b = (k[short & (label[a] != label[b])] for k in (a, b))
    a, b = np.where(points[a, 1] > points[b, 1], a, b), np.where(points[a, 1] > points[b, 1], b, a)
    found = {}
    pairs = np.array([f"{u} over {v}" for u, v in zip(label[a], label[b])], dtype=object)
    for name in sorted({*pairs.tolist()}):
        middle = 0.5 * (points[a[pairs == name]] + points[b[pairs == name]])
        if len(middle) < FEWEST:
            continue
        at, direction = axis_of(middle, np.ones(len(middle)))
        normal = np.array([-direction[1], direction[0]])
        if np.std((middle - at) @ normal) > STRAIGHT * cell or abs(along @ normal) < 0.1:
            continue
        found[name] = float((at - centre) @ normal / (along @ normal))
    return found


# --- what it did -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Profile:
    """A fault in a frame, at the points (m,) of its line that it has reached: s [m] along the line in the reference
    frame; places x, y [m] of the footwall now; slip [m], positive where the hanging wall went up; throw and heave
    [m], its vertical and its horizontal component, positive for a thrust; opening [m] across it. dip [degrees] of the
    line now, positive down to the left. horizons: x, y, slip, throw, heave by name."""

    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    slip: np.ndarray
    throw: np.ndarray
    heave: np.ndarray
    opening: np.ndarray
    dip: float
    horizons: dict[str, tuple[float, ...]]

    @property
    def best(self) -> int | None:
        """The point with most slip, of the median of three neighbours since tips have few particles; None where it
        cannot be measured anywhere."""
        known = np.flatnonzero(np.isfinite(self.slip))
        if not len(known):
            return None
        size = np.abs(self.slip[known])
        threes = [np.clip(np.arange(k - 1, k + 2), 0, len(size) - 1) for k in range(len(size))]
        middle = [three[np.argsort(size[three], kind="stable")[1]] for three in threes]
        return int(known[max(middle, key=lambda k: float(size[k]))])

    @property
    def mean(self) -> float:
        """Mean slip along the line [m]."""
        known = self.slip[np.isfinite(self.slip)]
        return float(known.mean()) if len(known) else float("nan")

    def slid(self, vergence: int) -> float:
        """Return the relative displacement of both sides in this sense of shear, the median along the line [m]; steep
        lines have either sense."""
        known = self.slip[np.isfinite(self.slip)]
        middle = float(np.median(known)) if len(known) else 0.0
        return abs(middle) if abs(self.dip) > STEEP else middle * vergence * (1.0 if self.dip >= 0.0 else -1.0)


@dataclass(frozen=True)
class History:
    """Faults over time. faults: by their number; profiles: by number and frame; brief: bands left out because they were
    seen in one frame only; still: faults left out because their sides did not slide by a mean radius."""

    faults: list[Fault]
    profiles: dict[int, dict[int, Profile]]
    brief: int = 0
    still: int = 0

    def curve(self, fault: Fault) -> tuple[np.ndarray, np.ndarray]:
        """Frames from the reference on, and the size of the largest slip in each [m]."""
        rows = [
            (k, abs(float(p.slip[p.best])))
            for k, p in sorted(self.profiles[fault.number].items())
            if p.best is not None
        ]
        frames, slip = zip((fault.born - 1, 0.0), *rows)
        return np.array(frames, np.int64), np.array(slip)

    def active(self, fault: Fault, frame: int, steps: Sequence[int]) -> bool:
        """Return whether the fault has a band in the frame; two frames of one step are one state."""
        return frame in fault.seen or (frame > 0 and steps[frame] == steps[frame - 1] and frame - 1 in fault.seen)


def history(faults: Sequence[Fault], profiles: dict[int, dict[int, Profile]], brief: int, least: float) -> History:
    """The faults whose sides have slid by `least` [m] in any frame, and those into which one of them merged, with new
    numbers."""
    kept = {f.number for f in faults if any(p.slid(f.vergence) >= least for p in profiles.get(f.number, {}).values())}
    for f in faults:  # into an older or a younger one
        target = f
        while target.number in kept and target.merged is not None:
            kept.add(target.merged[0])
            target = next(g for g in faults if g.number == target.merged[0])
    number = {old: k for k, old in enumerate(sorted(kept), 1)}
    chosen = [f for f in faults if f.number in kept]
    found = {number[f.number]: profiles.get(f.number, {}) for f in chosen}
    for f in chosen:
        f.number = number[f.number]
        f.merged = None if f.merged is None else (number[f.merged[0]], f.merged[1])
    return History(chosen, found, brief, len(faults) - len(chosen))


def measure(p: Plane, now: Grains, frame: int) -> Profile:
    """The fault in a frame, from its birth on."""
    low, high = p.reach[max(k for k in p.reach if k <= frame)]
    spacing = float(p.s[1] - p.s[0]) if len(p.s) > 1 else high - low
    s = p.s[(p.s >= low - 0.5 * spacing) & (p.s <= high + 0.5 * spacing)]
    at = np.searchsorted(now.gid, p.gid)
    there = (at < len(now.gid)) & (now.gid[np.minimum(at, len(now.gid) - 1)] == p.gid)
    moved = np.column_stack([now.x, now.y])[at[there]] - p.place[there]
    place, side = p.place[there], p.side[there]
    asked = np.concatenate([s, [*p.horizons.values()]])
    foot, gradient = _sides(p, place[side < 0], moved[side < 0], asked)
    hanging, _ = _sides(p, place[side > 0], moved[side > 0], asked)
    tangent = p.along + np.einsum("mij,j->mi", gradient, p.along)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    jump = hanging - foot
    slip = (jump * tangent).sum(axis=1)
    upward = np.sign(p.along[0] * p.normal[1] - p.along[1] * p.normal[0])
    opening = upward * (jump[:, 1] * tangent[:, 0] - jump[:, 0] * tangent[:, 1])
    throw, heave = jump[:, 1], jump[:, 0] * np.where(tangent[:, 0] >= 0.0, 1.0, -1.0)
    points = p.centre + asked[:, None] * p.along + foot
    n = len(s)
    mean = np.nanmean(tangent[:n], axis=0) if np.isfinite(tangent[:n]).any() else np.full(2, np.nan)
    dip = float(np.degrees(np.arctan2(mean[1], mean[0])))
    dip = dip - 180.0 if dip > 90.0 else dip + 180.0 if dip <= -90.0 else dip
    rows = zip(*points[n:].T.tolist(), slip[n:].tolist(), throw[n:].tolist(), heave[n:].tolist())
    inside = (asked[n:] >= low) & (asked[n:] <= high)
    horizons = {name: row for name, row, reached in zip(p.horizons, rows, inside) if reached and np.isfinite(row[2])}
    x, y = points[:n].T
    return Profile(s, x, y, slip[:n], throw[:n], heave[:n], opening[:n], dip, horizons)


def _sides(p: Plane, place: np.ndarray, moved: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (m, 2) and its gradient (m, 2, 2) at points of the line by the particles of one side; NaN where
    there are too few, or all on a line."""
    value, gradient = np.full((len(s), 2), np.nan), np.full((len(s), 2, 2), np.nan)
    where = (place - p.centre) @ p.along
    for k, at in enumerate(s):
        some = np.abs(where - at) <= p.window
        if some.sum() < FEWEST:
            continue
        d = (place[some] - p.centre - at * p.along) / p.window
        found, _, rank, _ = np.linalg.lstsq(np.column_stack([np.ones(len(d)), d]), moved[some], rcond=1e-3)
        if rank == 3:
            value[k], gradient[k] = found[0], found[1:].T / p.window
    return value, gradient
