"""Measurements, each in two halves: what is taken from a frame (on the rank that reads it), and the table that the
parts of all frames make (on rank 0)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.post.measure import cracks, fault_history, faults, layers, wedge
from hpcdem.post.measure.grains import Grains, Walls
from hpcdem.post.measure.images import extended
from hpcdem.post.measure.scene import Plan, Scene, Stamp
from hpcdem.post.measure.surface import surface
from hpcdem.post.section import read_section

Done = list[tuple[Stamp, Any]]
"""The parts of all frames, in the order of time; None for a frame of which there is nothing to say."""
NAN = float("nan")
TOTAL, STEP = 0.5, 0.2
"""Thresholds of strain for faults: of the strain since the first section, and of the strain from frame to frame."""
TIMES_MEAN, LEAST_STEP = 3.0, 0.005
"""Threshold for faults over time: this multiple of the mean |strain| of the frame, and at least this strain."""
SHORTEST, SKIN = 6.0, 2.0
"""Shortest band, and the distance from the base and the wall within which strain is attributed to these, in cells."""


@dataclass(frozen=True)
class Sheet:
    """A table to be written: name of the file, words of the header, rows."""

    name: str
    head: Sequence[str]
    rows: Iterable[Sequence[Any]]


# --- surface and wedge -----------------------------------------------------------------------------------------


def surface_part(scene: Scene) -> tuple[np.ndarray, np.ndarray] | None:
    """Surface points of the frame."""
    bed = scene.bed
    return surface(bed.x, bed.y, scene.plan.cell) if len(bed) else None


def surface_sheets(done: Done, plan: Plan) -> list[Sheet]:
    rows = ((*stamp.row, x, y) for stamp, part in done if part for x, y in zip(*part))
    return [Sheet("surface", (*Stamp.HEAD, "x[m]", "height[m]"), rows)]


def wedge_part(scene: Scene) -> wedge.Shape | str:
    """Shape of the wedge in front of the wall, or the reason why it is missing; x is mirrored if the wall pushes to
    the left."""
    bed, plan = scene.bed, scene.plan
    sign = plan.forward
    walls = {i: ((sign * a[0], a[1]), (sign * b[0], b[1])) for i, (a, b) in bed.walls.items()}
    face = plan.face(scene.all)
    back = sign * face if np.isfinite(face) else None
    try:
        return wedge.shape(sign * bed.x, bed.y, bed.r, walls, plan.cell, back)
    except ValueError as reason:
        return str(reason)


WEDGE_HEAD = (
    "shortening[m]", "crest_x[m]", "crest_y[m]", "toe_x[m]", "toe_y[m]", "height[m]", "width[m]", "surface_slope[deg]",
    "base_slope[deg]", "taper[deg]",
)  # fmt: skip


def wedge_rows(done: Done, plan: Plan) -> np.ndarray:
    """Return an array (frames, columns of WEDGE_HEAD); NaN without a wedge."""

    def row(stamp: Stamp, s: wedge.Shape | str) -> list[float]:
        if isinstance(s, str):
            return [stamp.shortening] + [NAN] * (len(WEDGE_HEAD) - 1)
        (cx, cy), (tx, ty) = s.wedge.crest, s.wedge.toe
        sign = plan.forward
        return [stamp.shortening, sign * cx, cy, sign * tx, ty, s.height, s.width, s.wedge.slope, s.base, s.taper]

    return np.array([row(stamp, part) for stamp, part in done])


def wedge_sheets(done: Done, plan: Plan) -> list[Sheet]:
    rows = (
        (*stamp.row, *numbers, f"no wedge yet: {part}" if isinstance(part, str) else "")
        for (stamp, part), numbers in zip(done, wedge_rows(done, plan).tolist())
    )
    return [Sheet("wedge", (*Stamp.HEAD, *WEDGE_HEAD, "note"), rows)]


def without_wedge(done: Done) -> list[tuple[Stamp, str]]:
    """The frames that have no wedge, and why."""
    return [(stamp, part) for stamp, part in done if isinstance(part, str)]


# --- faults ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Faults:
    """Bands of a frame, and for faults over time the ids of their particles; the field they were picked in, and the
    particles to draw below, for the last frame."""

    bands: list[faults.Band]
    total: bool
    threshold: float
    ids: tuple[np.ndarray, ...] = ()
    x: np.ndarray | None = None
    y: np.ndarray | None = None
    strain: np.ndarray | None = None
    grains: Grains | None = None


def faults_part(scene: Scene) -> Faults | None:
    """Bands in the section of the frame where the folder has sections, else in the strain since the frame before."""
    plan, now = scene.plan, scene.all
    total = bool(plan.sections)
    if total:
        if scene.file.path.stem not in plan.sections:
            return None
        request = plan.request
        section = read_section(request.folder / "ss" / "data" / f"{scene.file.path.stem}.npz")
        p, move = section.particles, np.array([request.xmove, request.ymove])
        x, y, field = section.mean_strain()
        x, y = x + move[0], y + move[1]
        ends = zip(section.walls["id"], section.walls["p1"] + move, section.walls["p2"] + move)
        walls: Walls = {int(i): (tuple(a.tolist()), tuple(b.tolist())) for i, a, b in ends}
        rows = p["x"] + move[0], p["y"] + move[1], p["radius"], p["color"]
        now = Grains(now.step, p["gid"], *rows, np.full(len(p["gid"]), "", object), walls)
    else:
        before, after = scene.before, now
        if before is not None and now.period:
            before, after = extended(before, now)
        found = None if before is None else faults.between(before, after, plan.cell)
        if found is None:
            return None
        x, y, field = found
        now = after
    request = plan.request
    cell = float(x[1] - x[0]) if len(x) > 1 else plan.cell
    threshold = request.strain if request.strain is not None else TOTAL if total else STEP
    if request.over_time and request.strain is None:
        threshold = max(TIMES_MEAN * float(np.nanmean(np.abs(field))), LEAST_STEP)
    skin = request.skin if request.skin is not None else SKIN * cell
    shortest = request.length if request.length is not None else SHORTEST * cell
    low = wedge.floor(now.x, now.y, now.r, now.walls, cell, x) + skin
    if np.isfinite(face := plan.face(now)):
        low = np.where(plan.forward * (x - face) < skin, np.inf, low)
    picked = faults.bands(x, y, field, threshold, shortest, low[None, :])
    if now.period:  # each once, whole beyond the side if it crosses one
        right = now.side + now.period
        picked = [band for band in picked if now.side <= band.centre[0] < right]
        field, now = np.where((x >= now.side) & (x < right), field, NAN), scene.all
    ids = tuple(fault_history.members(band, now, cell) for band in picked) if request.over_time else ()
    return Faults(picked, total, threshold, ids, x, y, np.where(y[:, None] >= low, field, NAN), now)


def drawn(parts: Sequence[Faults | None]) -> Faults | None:
    """Choose the part to draw: the last with a band, otherwise the last, of those that still have their field."""
    some = [part for part in parts if part is not None and part.strain is not None]
    return next((part for part in reversed(some) if part.bands), some[-1] if some else None)


def without_fields(part: Faults) -> Faults:
    """The bands alone, to send over."""
    return Faults(part.bands, part.total, part.threshold, part.ids)


FAULT_HEAD = (
    "fault", "x[m]", "y[m]", "length[m]", "dip[deg]", "dips_to", "vergence", "sense", "mean_strain", "area[m2]",
    "x1[m]", "y1[m]", "x2[m]", "y2[m]", "strain_since",
)  # fmt: skip


def faults_sheets(done: Done, plan: Plan) -> list[Sheet]:
    def rows() -> Iterable[Sequence[Any]]:
        for stamp, part in done:
            for k, b in enumerate(part.bands if part else (), 1):
                yield (
                    *stamp.row, k, *b.centre, b.length, abs(b.dip), "left" if b.dip > 0.0 else "right",
                    "right" if b.vergence > 0 else "left", "reverse" if b.reverse else "normal", b.mean, b.area,
                    *b.ends[0], *b.ends[1], "first section" if part.total else "frame before",
                )  # fmt: skip

    return [Sheet("faults", (*Stamp.HEAD, *FAULT_HEAD), rows())]


HISTORY_HEAD = (
    "fault", "state", "x[m]", "y[m]", "length[m]", "dip[deg]", "dips_to", "vergence", "sense", "slip[m]",
    "mean_slip[m]", "throw[m]", "heave[m]", "opening[m]", "slip_rate[m/s]", "slip_per_shortening", "band_length[m]",
    "x1[m]", "y1[m]", "x2[m]", "y2[m]",
)  # fmt: skip
SUMMARY_HEAD = (
    "fault", "born_step", "born_time[s]", "born_shortening[m]", "last_active_step", "last_active_shortening[m]",
    "frames_active", "end", "vergence", "sense", "x[m]", "y[m]", "dip_at_birth[deg]", "dip[deg]", "length[m]",
    "slip[m]", "mean_slip[m]", "throw[m]", "heave[m]", "opening[m]", "largest_slip_rate[m/s]", "share_of_shortening",
)  # fmt: skip


def layer_names(g: Grains, plan: Plan) -> np.ndarray:
    """Return the layer of each particle (n,): its colour, or its group if all particles have one colour."""
    if len(np.unique(g.color)) > 1:
        return np.array([plan.request.color(c) for c in g.color.tolist()], dtype=object)
    return g.group


def _words(slip: float, dip: float) -> tuple[str, str, str]:
    """Return the side to which a fault dips, the direction of the hanging wall, and the sense of slip."""
    senses = ("left", "right")
    return senses[dip <= 0.0], senses[slip * dip > 0.0], "reverse" if slip > 0.0 else "normal"


def history_sheets(stamps: Sequence[Stamp], found: fault_history.History) -> list[Sheet]:
    """Make the tables of faults: all faults together in each frame; each fault in each frame, each fault, slip along
    them, offset of horizons."""
    steps = [stamp.step for stamp in stamps]
    rows, summary, along, offsets = [], [], [], []
    for f in found.faults:
        before, fastest = (f.born - 1, 0.0), NAN
        last: tuple[Any, ...] | None = None
        active = [k for k in range(len(stamps)) if found.active(f, k, steps)]
        for k, p in sorted(found.profiles[f.number].items()):
            stamp, j = stamps[k], p.best
            offsets += [(*stamp.row, stamp.shortening, f.number, name, *row) for name, row in p.horizons.items()]
            if j is None:
                continue
            one = [float(getattr(p, name)[j]) for name in ("slip", "throw", "heave", "opening")]
            slip, gap = one[0] - before[1], stamp.time - stamps[before[0]].time
            shortened = stamp.shortening - stamps[before[0]].shortening
            rate = slip / gap if gap > 0.0 else NAN
            fastest = float(np.nanmax([fastest, abs(rate)])) if np.isfinite([fastest, rate]).any() else NAN
            known = np.flatnonzero(np.isfinite(p.x))
            ends = [float(v[m]) for m in known[[0, -1]] for v in (p.x, p.y)]
            spacing = float(p.s[1] - p.s[0]) if len(p.s) > 1 else 0.0
            length = float(np.hypot(ends[2] - ends[0], ends[3] - ends[1])) + spacing
            bands = sum(s.band.length for s in f.seen.get(k, ()))
            middle = float(np.mean(ends[::2])), float(np.mean(ends[1::2]))
            last = (*_words(one[0], p.dip)[1:], *middle, abs(p.dip), length, one[0], p.mean, *one[1:])
            rows.append((
                *stamp.row, stamp.shortening, f.number, "active" if k in active else "inactive", *middle, length,
                abs(p.dip), *_words(one[0], p.dip), one[0], p.mean, *one[1:], rate,
                slip / shortened if abs(shortened) > 0.0 else NAN, bands if k in active else 0.0, *ends,
            ))  # fmt: skip
            before = (k, one[0]) if gap > 0.0 else before
            known = np.isfinite(p.slip)
            along += [
                (*stamp.row, stamp.shortening, f.number, *map(float, row))
                for row in zip(*(v[known] for v in (p.s, p.x, p.y, p.slip, p.throw, p.heave, p.opening)))
            ]
        if last is None:
            continue
        since, until = stamps[f.born - 1], stamps[max(found.profiles[f.number])]
        shortened = until.shortening - since.shortening
        merged = f.merged is not None
        end = f"merged into {f.merged[0]}" if f.merged else "active" if active[-1] == len(stamps) - 1 else "inactive"
        if not merged and max(found.profiles[f.number]) < len(stamps) - 1:
            end = "removed"
        born, latest = stamps[f.born], stamps[active[-1]]
        first = max(f.seen[f.born], key=lambda s: s.band.length).band
        summary.append((
            f.number, born.step, born.time, born.shortening, latest.step, latest.shortening, len(f.seen), end,
            *last[:4], abs(first.dip), *last[4:], fastest, last[-2] / shortened if abs(shortened) > 0.0 else NAN,
        ))  # fmt: skip
    rows.sort(key=lambda row: (row[0], row[1], row[4]))
    head = (*Stamp.HEAD, "shortening[m]")
    heaves = np.zeros((len(found.faults), len(stamps)))
    slips = np.zeros_like(heaves)
    for f, heave, slip in zip(found.faults, heaves, slips):
        for k, p in sorted(found.profiles[f.number].items()):  # a fault that merged keeps what it had
            if p.best is not None:
                heave[k:], slip[k:] = p.heave[p.best], abs(p.slip[p.best])
    total = (
        (
            *stamp.row, stamp.shortening, sum(f.born <= k for f in found.faults),
            sum(found.active(f, k, steps) for f in found.faults), float(slips[:, k].sum()),
            float(slips[:, k].max(initial=0.0)), float(heaves[:, k].sum()),
            float(heaves[:, k].sum()) / stamp.shortening if abs(stamp.shortening) > 0.0 else NAN,
        )
        for k, stamp in enumerate(stamps)
    )  # fmt: skip
    return [
        Sheet("faults_total", (*head, "faults", "active", "slip[m]", "largest_slip[m]", "heave[m]",
                               "share_of_shortening"), total),
        Sheet("faults", (*head, *HISTORY_HEAD), rows),
        Sheet("faults_summary", SUMMARY_HEAD, summary),
        Sheet("faults_along", (*head, "fault", "s[m]", "x[m]", "y[m]", "slip[m]", "throw[m]", "heave[m]",
                               "opening[m]"), along),
        Sheet("faults_horizons", (*head, "fault", "horizon", "x[m]", "y[m]", "slip[m]", "throw[m]", "heave[m]"),
              offsets),
    ]  # fmt: skip


# --- tracks and layers -----------------------------------------------------------------------------------------


def tracks_part(scene: Scene) -> np.ndarray:
    """Return id, x, y of the followed particles (n, 3); x is continuous across periodic sides."""
    g = scene.all
    rows = np.flatnonzero(np.isin(g.gid, scene.plan.followed))
    return np.stack([g.gid[rows], g.x[rows] + g.period * g.laps[rows], g.y[rows]], axis=1)


def paths(done: Done) -> dict[int, np.ndarray]:
    """(m, 3) by id: number of the frame, x, y."""
    table = np.array([[row[0], k, row[1], row[2]] for k, (_, part) in enumerate(done) for row in part])
    table = table.reshape(-1, 4)
    return {int(i): table[table[:, 0] == i][:, 1:] for i in np.unique(table[:, 0])}


def tracks_sheets(done: Done, plan: Plan) -> list[Sheet]:
    found = paths(done)
    missing = sorted({*plan.followed.tolist()} - {*found})
    if missing:
        raise HpcdemError(f"tracks: no frame has particle {', '.join(map(str, missing[:10]))}")
    start = {i: path[0] for i, path in found.items()}
    rows = (
        (*stamp.row, int(i), x, y, x - start[int(i)][1], y - start[int(i)][2])
        for stamp, part in done
        for i, x, y in part.tolist()
    )
    return [Sheet("tracks", (*Stamp.HEAD, "id", "x[m]", "y[m]", "dx[m]", "dy[m]"), rows)]


def layers_part(scene: Scene) -> dict[tuple[str, str], layers.Area]:
    return layers.areas(scene.grains)


@dataclass(frozen=True)
class Layer:
    """One colour or group over time; all (frames,), areas in m2. Changes: relative to the first frame that has it."""

    kind: str
    name: str
    grains: np.ndarray
    discs: np.ndarray
    envelope: np.ndarray

    def change(self, areas: np.ndarray) -> np.ndarray:
        """Relative change of `discs` or `envelope`; NaN before there was any."""
        some = np.flatnonzero(areas > 0.0)
        if not len(some):
            return np.full(len(areas), NAN)
        change = areas / areas[some[0]] - 1.0
        change[: some[0]] = NAN
        return change


def layer_series(done: Done) -> list[Layer]:
    keys = sorted(
        {key for _, part in done for key in part}, key=lambda k: ("all color group".split().index(k[0]), k[1])
    )
    none = layers.Area(0, 0.0, 0.0)
    result = []
    for key in keys:
        a = [part.get(key, none) for _, part in done]
        columns = (np.array([getattr(one, name) for one in a]) for name in ("grains", "discs", "envelope"))
        result.append(Layer(*key, *columns))
    return result


def layers_sheets(done: Done, plan: Plan) -> list[Sheet]:
    def rows() -> Iterable[Sequence[Any]]:
        for layer in layer_series(done):
            name = plan.request.color(layer.name) if layer.kind == "color" else layer.name
            changes = layer.change(layer.discs), layer.change(layer.envelope)
            for k, (stamp, _) in enumerate(done):
                discs, envelope = float(layer.discs[k]), float(layer.envelope[k])
                pores = 1.0 - discs / envelope if envelope > 0.0 else NAN
                numbers = int(layer.grains[k]), discs, envelope, pores, float(changes[0][k]), float(changes[1][k])
                yield *stamp.row, layer.kind, name, *numbers

    head = ("kind", "name", "particles", "particle_area[m2]", "envelope_area[m2]", "porosity", "particle_change",
            "envelope_change")  # fmt: skip
    return [Sheet("layers", (*Stamp.HEAD, *head), rows())]


# --- cracks ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cracks:
    """Bonds of a frame; what changed since the frame before (all bonds of the first frame are new); ids of the
    requested particles."""

    bonds: int
    change: cracks.Change
    gid: np.ndarray


def cracks_part(scene: Scene) -> Cracks:
    now, before = scene.all, scene.before
    if before is None:
        before = replace(now.take(np.zeros(0, np.int64)), bonds=now.bonds[:0])
    change = cracks.change(before, now)
    gid = scene.grains.gid
    if len(gid) < len(now):  # both ends must be requested
        broken, made = (np.isin(pairs, gid).all(axis=1) for pairs in (change.broken, change.made))
        change = cracks.Change(
            change.broken[broken], change.place[broken], change.parted[broken], change.made[made], change.lost
        )
    bonds = int(np.isin(now.bonds, gid).all(axis=1).sum())
    return Cracks(bonds, change, gid)


@dataclass(frozen=True)
class Cracking:
    """Over time (frames,): bonds held, made, broken, parted, and lost with deleted particles so far; share of the
    bonded particles with damage from each of LEVELS on (frames, levels); and the damage at the end."""

    bonds: np.ndarray
    made: np.ndarray
    broken: np.ndarray
    parted: np.ndarray
    lost: np.ndarray
    beyond: np.ndarray
    damage: cracks.Damage


def cracking(done: Done) -> Cracking:
    damage = cracks.Damage(np.concatenate([part.change.made.ravel() for _, part in done]))
    beyond = []
    for _, part in done:
        damage.add(part.change.made, part.change.broken)
        values = damage.of(part.gid)[2]
        values = values[np.isfinite(values)]
        beyond.append([float(np.mean(values >= level)) if len(values) else NAN for level in cracks.LEVELS])
    parts = [part for _, part in done]
    made, broken, parted, lost = (
        np.cumsum([count(p.change) for p in parts])
        for count in (lambda c: len(c.made), lambda c: len(c.broken), lambda c: c.parted.sum(), lambda c: c.lost)
    )
    return Cracking(np.array([p.bonds for p in parts]), made, broken, parted, lost, np.array(beyond), damage)


def cracks_sheets(done: Done, plan: Plan, final: Grains) -> list[Sheet]:
    c = cracking(done)
    if not c.made[-1]:
        raise HpcdemError(f"cracks: no frame in {plan.request.folder} has bonds")
    levels = [f"particles_from_{level:g}" for level in cracks.LEVELS]
    head = (*Stamp.HEAD, "bonds", "made", "broken", "parted", "touching", "deleted", "broken_share", *levels)
    table = (
        (
            *stamp.row, int(c.bonds[k]), int(c.made[k]), int(c.broken[k]), int(c.parted[k]),
            int(c.broken[k] - c.parted[k]), int(c.lost[k]), float(c.broken[k] / c.made[k]) if c.made[k] else NAN,
            *c.beyond[k].tolist(),
        )
        for k, (stamp, _) in enumerate(done)
    )  # fmt: skip
    broken = (
        (*stamp.row, *pair, *place, int(apart))
        for stamp, part in done
        for pair, place, apart in zip(
            part.change.broken.tolist(), part.change.place.tolist(), part.change.parted.tolist()
        )
    )
    had, broke, share = c.damage.of(final.gid)
    some = np.flatnonzero(had > 0)
    particles = (
        (int(final.gid[k]), float(final.x[k]), float(final.y[k]), int(had[k]), int(broke[k]), float(share[k]))
        for k in some
    )
    sheets = [
        Sheet("cracks", head, table),
        Sheet("cracks_bonds", (*Stamp.HEAD, "id1", "id2", "x[m]", "y[m]", "parted"), broken),
        Sheet("cracks_particles", ("id", "x[m]", "y[m]", "bonds", "broken", "damage"), particles),
    ]
    if plan.request.log is not None:
        sheets.append(Sheet("cracks_log", ("step", "tension", "shear"), cracks.read_log(plan.request.log).tolist()))
    return sheets
