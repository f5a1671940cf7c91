"""SURFACE: diffusion, slope limit, erosion and deposition at the surface of the particles while a run steps.

Heights are mean heights of columns, of the line along which a ball rolls over the particles that rest on others.
Processes change heights (numerics/landscape.py); each column keeps the area that they demand and that whole discs have
not met yet. Discs go from the top of the columns and are laid into hollows of the surface, as many as bring the sum
over all columns within the area of one disc. All ranks compute this from the same particles, gathered in the order of
their ids.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from hpcdem.commands.dem import output
from hpcdem.commands.dem.particles import add
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_X, FIX_Y
from hpcdem.core.limits import check_surface
from hpcdem.core.material import Material, checked
from hpcdem.core.nearest import hint
from hpcdem.core.picture_words import NUMBERS
from hpcdem.numerics import landscape
from hpcdem.numerics.rng import uniforms
from hpcdem.physics.dem import rolling
from hpcdem.physics.dem.kernels.mass import SPHERES, volume
from hpcdem.physics.dem.kernels.motion import MASS
from hpcdem.physics.dem.land import Land, carried_over, smallest_unit
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.post.surface import surface as rolled
from hpcdem.pre.deposit import is_steep, resting, top

GROUP = "growth"
COLORS = (2, 8, 1, 9)
"""Colours of episodes, in turn: yellow, gb, green, violet."""
POROSITY = 0.15
BALL = 2.0
"""Radius of the rolling ball over the largest radius of the particles."""
WIDE = 4.0
"""Default width of columns over the largest radius."""
SAMPLES = 8
"""Number of points of the surface line per column."""
DEEP = 14.0
"""Depth below the surface, in largest radii, down to which particles matter."""
CALM, LIGHT = 0.05, 0.5
"""Limits for a disc at rest: speed in excess of that of the pushing walls, over the speed after a fall of one radius;
acceleration over gravity."""


def surface(
    sim: Simulation,
    id: int,
    interval: int | None = None,
    x: tuple[float, float] | None = None,
    spacing: float | None = None,
    diffuse: float | None = None,
    slope: float | None = None,
    erode: float | None = None,
    above: float | None = None,
    deposit: float | None = None,
    below: float | None = None,
    rise: float | None = None,
    years: float | None = None,
    only: Sequence[str] | str = (),
    rad: Sequence[float] | float | None = None,
    porosity: float | None = None,
    compact: tuple[float, float] | None = None,
    group: str | None = None,
    episode: int | None = None,
    colors: Sequence[str] | str = (),
    off: bool = False,
    hertz: bool = False,
    **properties: Unpack[Material],
) -> None:
    """SURFACE: switch a surface process on or off; it acts at steps that are multiples of the interval.

    Parameters
    ----------
    id : id of the process; a second command with this id replaces its settings, its balance continues, and so do its
        episodes if group and episode are unchanged.
    interval : steps between two applications.
    x : range in which it acts, (least, greatest) [m] (default: the extent of the particles).
    spacing : width of the columns [m] (default: four times the largest radius).
    diffuse : coefficient of diffusion of the heights [m2/s].
    slope : largest stable angle of the surface [deg]; steeper parts slide down.
    erode, above : rate of erosion [m/s], and the level down to which it acts [m]; a level alone acts at once.
    deposit, below : rate of deposition [m/s], and the level up to which it acts [m]; a level alone: each application
        deposits a layer as thick as a column is wide, until the level is reached.
    rise : upward velocity of the levels, from the command on [m/s].
    years : years represented by a second of model time; diffuse, erode, deposit and rise are then per year.
    only : groups whose discs may be eroded; other groups protect what lies below them (default: all).
    rad : radii of deposited discs, drawn at random; a repeated one is more likely [m].
    porosity : porosity of eroded and deposited material: bulk area = area of discs / (1 - porosity) (default: 0.15).
    compact : compaction of the deposit: porosity at the surface, and depth at which it has decreased by a factor e [m];
        discs shrink during burial and keep their mass.
    group : group of the deposited discs (default: growth).
    episode : number of steps after which a new group begins: growth1, growth2, ...
    colors : names of the colours of these groups, in turn.
    off : bool: end the process.
    hertz : bool: contacts of Hertz and Mindlin, defined by shear [Pa] and poiss.
    properties : properties of the deposit, as in PROP.
    """
    radii = () if rad is None else tuple(float(r) for r in np.atleast_1d(np.asarray(rad, np.float64)))
    optional = {
        "interval": interval, "x": x, "spacing": spacing, "diffuse": diffuse, "slope": slope, "erode": erode,
        "above": above, "deposit": deposit, "below": below, "rise": rise, "years": years, "only": only, "rad": radii,
        "porosity": porosity, "compact": compact, "group": group, "episode": episode, "colors": colors, "off": off,
        "hertz": hertz,
    }  # fmt: skip
    material = checked(properties)
    given = {name: value for name, value in optional.items() if _is_given(value)} | material
    check_surface({"id": id, **given})
    if id < 0:
        raise CommandError(f"id must not be negative, got {id}")
    if off:
        if id not in sim.lands:
            raise CommandError(
                f"there is no process {id} of SURFACE; active: {', '.join(map(str, sim.lands)) or 'none'}"
            )
        report_one(sim, id)
        del sim.lands[id]
        return
    p = sim.particles
    radius = min([-float(sim.comm.max_into(np.array([-p["radius"].min(initial=math.inf)]))[0]), *radii])
    if not math.isfinite(radius):
        raise CommandError("there are no particles yet, and no radii (rad) of a deposit")
    largest = max(float(sim.comm.max_into(np.array([p["radius"].max(initial=0.0)]))[0]), *radii, 0.0)
    wide = WIDE * largest if spacing is None else float(spacing)
    if wide < 2.0 * largest:
        raise CommandError(f"spacing {wide:g} m is less than a largest particle, {2.0 * largest:g} m")
    if x is not None and not x[1] - x[0] >= wide:
        raise CommandError(f"x from {x[0]:g} to {x[1]:g} m is narrower than a column, {wide:g} m")
    box = sim.walls.box()
    if spacing is None and box is not None and wide > box[1] - box[0]:
        raise CommandError(
            f"a column of {WIDE:g} times the largest radius, {wide:g} m, is wider than BOX, "
            f"{box[0]:g} to {box[1]:g} m; check the radii, or give spacing"
        )
    for name, level in (("above", above), ("below", below)):
        _refuse_deep(sim, name, level)
    names = _groups(sim, (only,) if isinstance(only, str) else only)
    row = sim.materials.row(**material, **({"hertz": 1.0} if hertz else {})) if radii else 0
    rolling.begin(sim, material if radii else {})
    rate = 1.0 if years is None else float(years)

    def per_second(value: float | None) -> float | None:
        return None if value is None else float(value) * rate

    land = Land(
        every=int(interval or 0), x=None if x is None else (float(x[0]), float(x[1])), spacing=wide,
        diffuse=per_second(diffuse), slope=None if slope is None else math.tan(math.radians(slope)),
        erode=per_second(erode), above=above, deposit=per_second(deposit), below=below, rise=per_second(rise) or 0.0,
        only=names, rad=radii, porosity=POROSITY if porosity is None else float(porosity),
        group=(group or GROUP).lower(), episode=int(episode or 0),
        colors=_colors((colors,) if isinstance(colors, str) else colors), material=row, begun=sim.clock.step,
        last=sim.clock.time, since=sim.clock.time, stream=sim.streams, unit=smallest_unit(radius),
        compact=None if compact is None else (float(compact[0]), float(compact[1])),
    )  # fmt: skip
    _refuse_contradictions(sim, id, land)
    if id in sim.lands:
        _refuse_other_porosity(id, land, sim.lands[id])
        land = land.after(sim.lands[id])
    else:
        sim.streams += 1
    sim.lands[id] = land
    sim.lands = dict(sorted(sim.lands.items()))
    sim.tables_changed()


def _is_given(value: object) -> bool:
    """Return whether an option has a value; 0 is one."""
    return not (value is None or value is False or (isinstance(value, (str, Sequence)) and not len(value)))


def _refuse_deep(sim: Simulation, name: str, level: float | None) -> None:
    """CommandError for a level that no surface can have. Collective."""
    p = sim.particles
    low = -float(sim.comm.max_into(np.array([(p["radius"] - p["y"]).max(initial=-math.inf)]))[0])
    low = min([low, *sim.walls.p1[sim.walls.side == 0, 1], *sim.walls.p2[sim.walls.side == 0, 1]])
    if level is not None and math.isfinite(low) and not level > low:
        raise CommandError(f"{name} {level:g} m is not above the base of the model, {low:g} m")


def _groups(sim: Simulation, only: Sequence[str]) -> tuple[str, ...]:
    known = [name.lower() for name in sim.groups]
    for name in only:
        if name.lower() not in known:
            raise CommandError(f"only: no particle has ever been in group {name}{hint(name, known)}")
    return tuple(name.lower() for name in only)


def _colors(colors: Sequence[str]) -> tuple[int, ...]:
    for name in colors:
        if name.lower() not in NUMBERS:
            raise CommandError(f"colors: expected {', '.join(NUMBERS)}, got {name}{hint(name, NUMBERS)}")
    return tuple(NUMBERS[name.lower()] for name in colors) or COLORS


def _refuse_contradictions(sim: Simulation, id: int, land: Land) -> None:
    """Raise CommandError if one process deposits what another one erodes."""
    for other, active in sim.lands.items():
        apart = land.x is not None and active.x is not None and (land.x[1] <= active.x[0] or active.x[1] <= land.x[0])
        for one, two in ((land, active), (active, land)):
            lowers, raises = one.erode or one.above is not None, two.deposit or two.below is not None
            above = -math.inf if one.above is None else one.above
            below = math.inf if two.below is None else two.below
            if other != id and not apart and lowers and raises and below > above:
                raise CommandError(
                    f"SURFACE {id} and {other} would erode and deposit at the same heights and positions; the level of "
                    "erosion must not be below that of deposition"
                )


def _refuse_other_porosity(id: int, land: Land, earlier: Land) -> None:
    """CommandError where the buried discs of a process would need another porosity than they were deposited with."""
    if land.compact and earlier.compact and earlier.made and land.compact[0] != earlier.compact[0]:
        raise CommandError(
            f"SURFACE {id}: its deposits have porosity {earlier.compact[0]:g} at the surface (compact), which cannot "
            f"become {land.compact[0]:g}; end it with off, or use another id for the new deposits"
        )


def check(sim: Simulation) -> None:
    """Raise CommandError if the processes cannot act in this model. Collective."""
    if not sim.lands:
        return
    first = min(sim.lands)
    if sim.clumps or sim.settings.period:
        what = "clumps" if sim.clumps else "periodic sides (PERIODIC)"
        raise CommandError(f"SURFACE {first} does not support {what}")
    if sim.coupled:
        raise CommandError(f"SURFACE {first} does not support particles that are coupled to blocks")
    if not sim.settings.gy < 0.0:
        raise CommandError(f"SURFACE {first} needs gravity along -y: a deposit must come to rest (SET gravity)")


# ---- what there is ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Near:
    """Particles near the surface, in the order of their ids, on all ranks: id, group, row of material; circle: x, y, r;
    ground: they rest on others and are not fixed; held: they are fixed along x and y."""

    ids: np.ndarray
    circle: np.ndarray
    ground: np.ndarray
    held: np.ndarray


def near_surface(sim: Simulation) -> _Near:
    """Return the particles near the surface. Collective. The model is closed."""
    p, settling = sim.particles, [gid for land in sim.lands.values() for gid, _, _ in land.settling]
    largest = float(sim.comm.max_into(np.array([p["radius"].max(initial=0.0)]))[0])
    held = (p["fix"] & (FIX_X | FIX_Y)) == FIX_X | FIX_Y
    carried = sim.lists.owned_forces()[:, :2].any(axis=1)  # exactly 0 in flight
    ground = carried & ~held & ~np.isin(p["gid"], settling)
    place = np.floor(p["x"] / (2.0 * largest)).astype(np.int64)
    upper = p["y"] + p["radius"]
    order = np.argsort(place[ground], kind="stable")
    columns, begin = np.unique(place[ground][order], return_index=True)
    highest = np.maximum.reduceat(upper[ground][order], begin) if len(columns) else np.empty(0)
    parts = sim.comm.allgather((columns, highest))
    every = np.concatenate([columns for columns, _ in parts])
    columns, of = np.unique(every, return_inverse=True)
    tops = np.full(len(columns), -np.inf)
    np.maximum.at(tops, of.reshape(-1), np.concatenate([highest for _, highest in parts]))
    at = np.searchsorted(columns, place).clip(max=max(len(columns) - 1, 0))
    there = columns[at] == place if len(columns) else np.zeros(len(place), bool)
    limit = np.where(there, tops[at] if len(columns) else 0.0, -np.inf) - DEEP * largest
    near = upper > limit
    mine = (
        np.column_stack([p["gid"], p["group"], p["material"], ground, held])[near].astype(np.int64),
        np.column_stack([p["x"], p["y"], p["radius"]])[near],
    )
    parts = sim.comm.allgather(mine)
    ids, circle = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    order = np.argsort(ids[:, 0])
    ids, circle = ids[order], circle[order]
    return _Near(ids[:, :3], circle, ids[:, 3] != 0, ids[:, 4] != 0)


def _barriers(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Walls (n, 4) that carry discs or keep them inside, without the lid of BOX; right and left ends (m, 2) of the
    steep ones."""
    w = sim.walls
    ends = np.hstack([w.p1, w.p2])[[w.side_of(k) != "top" for k in range(len(w))]].reshape(-1, 4)
    steep = np.array([is_steep(*one) for one in ends], bool)
    return ends, np.column_stack([ends[steep][:, ::2].min(axis=1), ends[steep][:, ::2].max(axis=1)])


def _range(land: Land, ground: np.ndarray, barriers: np.ndarray) -> tuple[float, float] | None:
    """Return where the process acts [m]: as far as the ground (n, 3) reaches without an empty column, or the range
    given between the steep walls around it."""
    ends = None
    if len(ground):
        inside = ground if land.x is None else ground[(ground[:, 0] >= land.x[0]) & (ground[:, 0] <= land.x[1])]
        columns, counts = np.unique(np.floor(inside[:, 0] / land.spacing).astype(np.int64), return_counts=True)
        pieces = np.split(np.arange(len(columns)), np.flatnonzero(np.diff(columns) > 1) + 1)
        if len(columns):
            piece = max(pieces, key=lambda some: int(counts[some].sum()))
            of = np.floor(inside[:, 0] / land.spacing).astype(np.int64)
            some = inside[(of >= columns[piece[0]]) & (of <= columns[piece[-1]])]
            ends = float((some[:, 0] - some[:, 2]).min()), float((some[:, 0] + some[:, 2]).max())
    if land.x is None:
        return ends
    middle = 0.5 * (sum(ends) if ends is not None else sum(land.x))
    left = max([land.x[0], *(float(b) for _, b in barriers if b <= middle)])
    right = min([land.x[1], *(float(a) for a, _ in barriers if a >= middle)])
    return (left, right) if right - left > land.spacing else None


def _heights(land: Land, near: _Near, sides: np.ndarray, walls: np.ndarray, largest: float) -> np.ndarray:
    """Mean heights (n,) [m] of the columns between these sides, NaN where nothing carries a disc."""
    ground, n = near.circle[near.ground], len(sides) - 1
    line = rolled(ground[:, 0], ground[:, 1], ground[:, 2], BALL * largest, land.spacing / SAMPLES)
    line = line[np.isfinite(line[:, 1])]
    column = np.searchsorted(sides, line[:, 0], side="right") - 1
    inside = (column >= 0) & (column < n)
    number = np.bincount(column[inside], minlength=n)
    total = np.bincount(column[inside], line[inside, 1], minlength=n)
    height = np.divide(total, number, out=np.full(n, np.nan), where=number > 0)
    bare = np.isnan(height)
    if bare.any():
        middle = 0.5 * (sides[:-1] + sides[1:])[bare]
        floor = top(middle, largest, near.circle[near.held], walls) - largest
        height[bare] = np.where(np.isfinite(floor), floor, np.nan)
    return height


# ---- one application -------------------------------------------------------------------------------------------------


def act(sim: Simulation, ident: int) -> None:
    """Apply a process for the time since its last application. Leaves the model open if particles were added or
    removed. Collective.
    """
    sim.close_model()
    land = sim.lands[ident]
    for other in sim.lands.values():
        _count_settled(sim, other)
    elapsed, land.last = sim.clock.time - land.last, sim.clock.time
    near = near_surface(sim)
    walls, barriers = _barriers(sim)
    ends = _range(land, near.circle[near.ground], barriers)
    idle = "there is no ground" if ends is None else _apply(sim, land, near, walls, ends, elapsed)
    if idle and sim.log is not None:
        between = "" if land.x is None else f" between x = {land.x[0]:g} and {land.x[1]:g} m"
        sim.log.warn_once(f"surface {ident} {idle}", f"step {sim.clock.step}: SURFACE {ident}: {idle}{between}")
    _write(sim, ident)


def _apply(
    sim: Simulation, land: Land, near: _Near, walls: np.ndarray, ends: tuple[float, float], elapsed: float
) -> str:
    """Return what keeps the process from acting, "" for nothing."""
    first, sides = landscape.edges(*ends, land.spacing)
    width, n = np.diff(sides), len(sides) - 1
    largest = float(max(near.circle[:, 2].max(initial=0.0), *land.rad, 0.0))
    column = np.clip(np.searchsorted(sides, near.circle[:, 0], side="right") - 1, 0, n - 1)
    inside = (near.circle[:, 0] >= sides[0]) & (near.circle[:, 0] <= sides[-1])
    stacks = _stacks(sim, land, near, column, inside, n)
    area = [land.of_disc(r) for r in near.circle[:, 2].tolist()]
    there = np.array([sum(area[k] for k in stack) for stack in stacks], np.int64)
    owed = carried_over(land.owed, first, n)
    height = _heights(land, near, sides, walls, largest)
    measured = height
    unmet, waiting = _unmet(sim, land, sides, dict(zip(near.ids[inside, 0].tolist(), column[inside].tolist())))
    height = height + (owed * land.unit + unmet) / width
    demanded = _demand(land, height, width, np.maximum(there + owed, 0), elapsed)
    owed += demanded
    land.asked += int(demanded.sum())
    gone = _eroded(area, owed, stacks, waiting) if land.erodes else []
    rows, full = _deposited(sim, land, near, walls, owed, sides, gone)
    land.owed = {first + k: int(v) for k, v in enumerate(owed.tolist()) if v}
    if gone:
        density = sim.materials.rows["density"][near.ids[gone, 2]]
        masses = density * volume(near.circle[gone, 2], sim.settings.disk)
        for k, mass in zip(gone, masses.tolist(), strict=True):
            _book(land.eroded, area[k], mass)
        sim.open_model()
        sim.remove(np.isin(sim.particles["gid"], near.ids[gone, 0]))
    if len(rows):
        step = sim.clock.step
        land.made.append((sim.next_gid, sim.next_gid + len(rows)))
        for k, (_, _, r) in enumerate(rows):
            land.settling.append((sim.next_gid + k, land.of_disc(r), r))
        add(sim, np.array(rows), sim.group_number(land.group_at(step)), land.color_at(step), material=land.material)
    if land.compact is not None:
        _compacted(sim, land, measured, sides)
    if np.isnan(measured).all():
        return "there is no ground"
    if full:
        return "no disc of the deposit finds a place in some columns; what they lack is carried"
    if n == 1 and (land.diffuse or land.slope):
        return f"one column (spacing {land.spacing:g} m) covers everything, so diffuse and slope move nothing"
    return ""


def _unmet(sim: Simulation, land: Land, sides: np.ndarray, places: dict[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Area (n,) [m2] in each column that discs have not met yet: what other processes owe, and discs that settle; and
    flags (n,) of columns in which discs of other processes settle. places: column of each particle by id."""
    unmet, waiting = np.zeros(len(sides) - 1), np.zeros(len(sides) - 1, bool)
    for other in sim.lands.values():
        for gid, area, _ in other.settling:
            if gid in places:
                unmet[places[gid]] += area * other.unit
                waiting[places[gid]] |= other is not land
        for k, area in other.owed.items() if other is not land else ():
            x = (k + 0.5) * other.spacing
            if sides[0] <= x < sides[-1]:
                unmet[int(np.searchsorted(sides, x, side="right")) - 1] += area * other.unit
    return unmet, waiting


def _book(entry: list[float], area: int, mass: float) -> None:
    """Add one disc to area, number and mass."""
    entry[0] += area
    entry[1] += 1
    entry[2] += mass


def _demand(land: Land, height: np.ndarray, width: np.ndarray, available: np.ndarray, elapsed: float) -> np.ndarray:
    """Change of area (n,) i8 that the processes want, in units; available (n,) i8: what can be eroded."""
    demanded = np.zeros(len(height), np.int64)
    risen = land.rise * (land.last - land.since)
    if land.erode is not None or land.above is not None:
        most = math.inf if land.erode is None else land.erode * elapsed
        lost = landscape.lowered(height, most, -math.inf if land.above is None else land.above + risen)
        with np.errstate(invalid="ignore"):
            lost = np.maximum(lost * width / land.unit, -available.astype(np.float64))
        demanded += np.rint(lost).astype(np.int64)
    if land.deposit is not None or land.below is not None:
        most = land.spacing if land.deposit is None else land.deposit * elapsed  # at once: in layers
        gain = landscape.raised(height, most, math.inf if land.below is None else land.below + risen)
        demanded += np.rint(gain * width / land.unit).astype(np.int64)
    height = height + demanded * land.unit / width
    passed = np.zeros(max(len(height) - 1, 0))
    if land.diffuse is not None:
        passed = landscape.diffused(height, width, land.diffuse * elapsed)
        height = landscape.moved(height, width, passed)
    if land.slope is not None:
        # Of single columns, slopes are those of grains, which would slide for ever.
        smooth = landscape.moved(height, width, landscape.diffused(height, width, land.spacing**2))
        passed = passed + landscape.avalanches(smooth, width, land.slope)
    left = np.maximum(available + np.minimum(demanded, 0), 0) * land.unit
    passed = np.rint(landscape.limited(passed, left) / land.unit).astype(np.int64)
    return demanded + landscape.change(passed)


def _stacks(
    sim: Simulation, land: Land, near: _Near, column: np.ndarray, inside: np.ndarray, n: int
) -> list[list[int]]:
    """Rows of the ground that can be eroded from each column, the lowest first: down to one of another group."""
    names = [name.lower() for name in sim.groups]
    may = np.array([not land.only or name in land.only for name in names])[near.ids[:, 1]]
    stacks: list[list[int]] = [[] for _ in range(n)]
    covered = np.zeros(n, bool)
    rows = np.flatnonzero(near.ground & inside)
    upper = near.circle[rows, 1] + near.circle[rows, 2]
    for k in rows[np.lexsort((near.ids[rows, 0], -upper))].tolist():
        c = int(column[k])
        covered[c] |= not may[k]
        if not covered[c]:
            stacks[c].append(k)
    return [stack[::-1] for stack in stacks]


def _eroded(area: list[int], owed: np.ndarray, stacks: list[list[int]], waiting: np.ndarray) -> list[int]:
    """Rows of the discs that go, from the tops of columns; `owed` and the stacks follow. Columns with discs of
    other processes that settle (waiting) keep theirs, because without support these would never come to rest, unless
    the sum demands a disc."""
    gone: list[int] = []
    total = int(owed.sum())
    upper = np.array([area[stack[-1]] if stack else 0 for stack in stacks], np.int64)
    while True:
        may = (upper > 0) & (owed < 0)
        due = may & ~waiting & ((owed <= -upper) | (total <= -upper))
        due = due if due.any() else may & (total <= -upper)
        if not due.any():
            return gone
        c = int(np.argmin(np.where(due, owed, 1)))
        gone.append(stacks[c].pop())
        owed[c] += upper[c]
        total += int(upper[c])
        upper[c] = area[stacks[c][-1]] if stacks[c] else 0


def _deposited(
    sim: Simulation,
    land: Land,
    near: _Near,
    walls: np.ndarray,
    owed: np.ndarray,
    sides: np.ndarray,
    gone: list[int],
) -> tuple[list[tuple[float, float, float]], bool]:
    """x, y, r of new discs in hollows of the surface, and whether a column lacks one that finds no place; `owed`
    follows."""
    rows: list[tuple[float, float, float]] = []
    if not land.deposits:
        return rows, False
    discs = np.delete(near.circle, gone, axis=0)
    total, blocked = int(owed.sum()), np.zeros(len(owed), bool)
    while True:
        draw = float(uniforms(sim.settings.seed, land.stream, np.array([land.drawn]))[0])
        r = land.rad[min(int(draw * len(land.rad)), len(land.rad) - 1)]
        area = land.of_disc(r)
        due = ~blocked & (owed > 0) & ((owed >= area) | (total >= area))
        if not due.any():
            return rows, bool(blocked.any())
        c = int(np.argmax(np.where(due, owed, -1)))
        place = resting(float(sides[c]), float(sides[c + 1]), r, discs, walls)
        if place is None:
            blocked[c] = True
            continue
        rows.append((*place, r))
        discs = np.concatenate([discs, [rows[-1]]])
        land.drawn += 1
        owed[c] -= area
        total -= area


def _compacted(sim: Simulation, land: Land, height: np.ndarray, sides: np.ndarray) -> None:
    """Let the discs of the deposit shrink by one step where they are buried deeply enough. Collective."""
    assert land.compact is not None
    porosity, scale = land.compact
    p, n = sim.particles, len(height)
    gid = p["gid"]
    made = np.array(land.made, np.int64).reshape(-1, 2)
    at = np.searchsorted(made[:, 0], gid, side="right") - 1
    mine = np.flatnonzero((at >= 0) & (gid < (made[at, 1] if len(made) else 0)))
    mine = mine[~np.isin(gid[mine], [one for one, _, _ in land.settling])]
    column = np.clip(np.searchsorted(sides, p["x"][mine], side="right") - 1, 0, n - 1)
    wanted = landscape.compaction(np.nan_to_num(height[column] - p["y"][mine]), scale)
    level = np.array([land.levels.get(one, 0) for one in gid[mine].tolist()], np.int64)
    deeper = wanted > level
    mine, level = mine[deeper], level[deeper]
    power = 3.0 if SPHERES[sim.settings.disk] else 2.0
    parts = sim.comm.allgather((gid[mine], level, p["radius"][mine]))
    every = {one: (k, r) for part in parts for one, k, r in zip(*(column.tolist() for column in part))}
    ratios = {k: landscape.shrinkage(k + 1, porosity) / landscape.shrinkage(k, porosity) for k, _ in every.values()}
    for one in sorted(every):
        k, r = every[one]
        land.levels[one] = k + 1
        land.compacted += land.of_disc(r) - land.of_disc(r * ratios[k])
    if not every:
        return
    sim.open_model()
    material = p["material"][mine]
    for k in sorted(ratios):
        some = level == k
        p["radius"][mine[some]] *= ratios[k]
        for row in np.flatnonzero(sim.used(material[some], sim.materials)).tolist():
            density = float(sim.materials.rows["density"][row]) / ratios[k] ** power
            mapping = sim.materials.changed(np.arange(len(sim.materials)) == row, density=density)
            p["material"][mine[some & (material == row)]] = mapping[row]
    sim.tables_changed()


def _count_settled(sim: Simulation, land: Land) -> None:
    """Book the discs that are at rest now. Collective."""
    if not land.settling:
        return
    p, s = sim.particles, sim.settings
    mine = np.flatnonzero(np.isin(p["gid"], [gid for gid, _, _ in land.settling]))
    held = (p["fix"] & (FIX_X | FIX_Y)) == FIX_X | FIX_Y
    speed = np.hypot(p["vx"], p["vy"])
    push = max(sim.walls.fastest(), float(sim.comm.max_into(np.array([speed[held].max(initial=0.0)]))[0]))
    gravity = math.hypot(s.gx, s.gy)
    calm = speed[mine] <= push + CALM * np.sqrt(2.0 * gravity * p["radius"][mine])
    pull = sim.lists.owned_forces()[mine, :2] / sim.body[mine, MASS : MASS + 1] + (s.gx, s.gy)
    calm &= np.hypot(pull[:, 0], pull[:, 1]) <= LIGHT * gravity
    density = sim.materials.rows["density"]
    found: dict[int, tuple[bool, float]] = {}
    states = zip(calm.tolist(), density[p["material"][mine]].tolist())
    for part in sim.comm.allgather(dict(zip(p["gid"][mine].tolist(), states))):
        found.update(part)
    left = []
    for gid, area, r in land.settling:
        at_rest, of_disc = found.get(gid, (True, float(density[land.material])))
        if not at_rest:
            left.append((gid, area, r))
            continue
        mass = of_disc * float(volume(np.array([r]), s.disk)[0])
        _book(land.deposited if gid in found else land.lost, area, mass)
    land.settling = left


# ---- the balance -----------------------------------------------------------------------------------------------------

COLUMNS = (
    "step,time,surface,eroded,deposited,settling,lost,carried,compacted,discs_eroded,discs_deposited,discs_settling,mass_eroded,"
    "mass_deposited"
)


def balance(sim: Simulation, id: int) -> dict[str, float]:
    """Return the mass and area balance of a process of SURFACE.

    Returns
    -------
    dict : bulk areas [m2]: eroded; deposited (discs at rest); settling (discs not yet at rest); lost (deleted before
        they came to rest); carried (demand smaller than a disc, not yet met; negative: erosion); demanded (sum
        requested by the processes: deposited + settling + lost - eroded + carried); compacted (lost as discs of the
        deposit shrink, part of the deposited area). Numbers: discs_eroded, discs_deposited, discs_settling. Masses
        [kg]: mass_eroded, mass_deposited.
    """
    if id not in sim.lands:
        raise CommandError(f"there is no process {id} of SURFACE; active: {', '.join(map(str, sim.lands)) or 'none'}")
    land = sim.lands[id]
    areas = {
        "eroded": land.eroded[0], "deposited": land.deposited[0], "settling": sum(area for _, area, _ in land.settling),
        "lost": land.lost[0], "carried": sum(land.owed.values()), "demanded": land.asked,
        "compacted": land.compacted,
    }  # fmt: skip
    return {
        **{name: value * land.unit for name, value in areas.items()},
        "discs_eroded": land.eroded[1], "discs_deposited": land.deposited[1], "discs_settling": len(land.settling),
        "mass_eroded": land.eroded[2], "mass_deposited": land.deposited[2],
    }  # fmt: skip


def _write(sim: Simulation, ident: int) -> None:
    """A row of surface.csv. Collective."""
    seen = balance(sim, ident)
    del seen["demanded"]
    numbers = [sim.clock.time, ident, *seen.values()]
    output.append(sim, "surface.csv", COLUMNS, [",".join([str(sim.clock.step), *(repr(v) for v in numbers)])])


def report(sim: Simulation) -> None:
    """Report the balance of all processes, at the end of a CYC or IMPLE."""
    for ident in sim.lands:
        report_one(sim, ident)


def report_one(sim: Simulation, ident: int) -> None:
    """Report the balance of one process in the log."""
    if sim.log is None:
        return
    seen = balance(sim, ident)
    net = seen["deposited"] + seen["settling"] + seen["lost"] - seen["eroded"]
    lost = f"; deleted before they were at rest: {seen['lost']:.4g} m2" if seen["lost"] else ""
    compacted = f"; compacted by {seen['compacted']:.4g} m2" if seen["compacted"] else ""
    sim.log.info(
        f"SURFACE {ident}: eroded {seen['eroded']:.6g} m2 ({seen['discs_eroded']} discs, {seen['mass_eroded']:.4g} kg)"
        f", deposited {seen['deposited']:.6g} m2 ({seen['discs_deposited']} discs, {seen['mass_deposited']:.4g} kg)"
        f", settling {seen['settling']:.4g} m2 ({seen['discs_settling']} discs); net {net:.6g} m2, demanded "
        f"{seen['demanded']:.6g} m2, carried {seen['carried']:.3g} m2{lost}{compacted}"
    )
