"""Cracks and fragments in frames of blocks, and the table of broken joints: tables of `hpcdem measure`.

Damage index: length of the joints times their damage (0 before the peak, 1 broken, between as softening has gone) over
the length of all joints. P21: length of broken joints per area (Dershowitz & Herda 1992, Proc. 33rd US Symp. Rock
Mech., 323-330). Both by the lengths and areas of the mesh.

Fragments are connected components of elements: two are connected where they share an edge that is no joint, or a joint
that holds. Size of a fragment: diameter of the circle of its area; passing: part of the area in fragments up to a size.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.fields import unit_in
from hpcdem.io.frames import FrameFile, list_mesh_frames
from hpcdem.io.vtkhdf_mesh import MeshState, read_mesh_frame
from hpcdem.numerics.clusters import united
from hpcdem.physics.fdem import tetrahedra
from hpcdem.physics.fdem.mesh import sizes
from hpcdem.post.blocks import BROKEN, FREE, YIELDED
from hpcdem.post.fluid import WET
from hpcdem.post.measure import bodies, emission
from hpcdem.post.measure.bodies import Region, Surface
from hpcdem.post.measure.emission import BIN, MODES, Curve, Events, Fit
from hpcdem.post.measure.kinds import NAN, Sheet
from hpcdem.post.measure.scene import Request
from hpcdem.post.view.moment import faces_of_joints, neighbours

INTACT = 1.0
SHARES = 0.2, 0.5, 0.8
"""Fractions of the area for which the passing size is reported."""
HEAD = ("step", "time[s]")
MEASURES = {2: ("length", "area"), 3: ("joint_area", "volume")}
"""Columns of frames with the sizes of joints and of elements, by dimension of space."""


@dataclass(frozen=True)
class Pieces:
    """Fragments of a frame, the largest first: fragment of each requested element (n,), -1: not requested;
    area [m2], in space volume [m3], elements in it (m,) each; at (m, dim): their middles [m]."""

    of: np.ndarray
    area: np.ndarray
    elements: np.ndarray
    at: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """(m,) diameters of circles of these areas, or of spheres of these volumes [m]."""
        if self.at.shape[1] == 3:
            return np.cbrt(6.0 * self.area / math.pi)
        return np.sqrt(4.0 * self.area / math.pi)

    def passing(self) -> tuple[np.ndarray, np.ndarray]:
        """Sizes in ascending order [m], and the part of the area in fragments up to each."""
        area = self.area[::-1]
        return self.size[::-1], np.cumsum(area) / max(float(area.sum()), 1e-300)

    def characteristic(self) -> list[float]:
        """The sizes [m] at which SHARES of the area are in smaller fragments or in this one."""
        size, passing = self.passing()
        return [float(size[min(int(np.searchsorted(passing, share - 1e-12)), len(size) - 1)]) for share in SHARES]


@dataclass(frozen=True)
class Cracks:
    """Joints of a frame: numbers in all, past their strength, broken by MODES (3,); lengths of all, of those, of
    these [m], in space areas [m2]; damage index; area of the elements [m2], in space volume [m3]; kinetic energy of the
    broken ones when they broke [J/m], in space [J]."""

    joints: int
    yielded: int
    broken: np.ndarray
    size: float
    yielded_size: float
    broken_size: np.ndarray
    damage: float
    body: float
    energy: float


@dataclass(frozen=True)
class Fluid:
    """Fluid in the channels of a frame: how many there are, how many are wet (saturation from one half on); lengths of
    wet ones, and of wet ones whose joint is broken or was open from the beginning [m], in space areas [m2]; volume of
    fluid as it is [m3/m], in space [m3]; largest pressure [Pa], aperture [m] and velocity [m/s]."""

    channels: int
    wet: int
    size: float
    open_size: float
    volume: float
    pressure: float
    aperture: float
    velocity: float


@dataclass(frozen=True)
class Part:
    """Measurements of one frame: joints (always in the plane); regions and surface in space."""

    step: int
    time: float
    cracks: Cracks | None
    pieces: Pieces | None
    fluid: Fluid | None
    regions: list[Region] | None = None
    surface: Surface | None = None


def frames(request: Request) -> list[FrameFile]:
    """The requested frames of blocks. Raises HpcdemError if the folder cannot be read."""
    first, last = request.first or 0, request.last
    return [f for f in list_mesh_frames(request.folder) if f.step >= first and (last is None or f.step <= last)]


def read(file: FrameFile, request: Request) -> MeshState:
    """A frame, moved as requested."""
    state = read_mesh_frame(file.path, solid=True)
    state.points = state.points + np.array([request.xmove, request.ymove, 0.0])[: state.points.shape[1]]
    return state


def dim_of(file: FrameFile) -> int:
    """Dimensions of space of a frame."""
    return read_mesh_frame(file.path, lazily=True, solid=True).points.shape[1]


def part(state: MeshState, request: Request, what: Sequence[str]) -> Part:
    """Joints, and fragments if requested, of a frame."""
    wanted = chosen(state, request)
    pieces = fragments(state, wanted) if "fragments" in what else None
    fluid = fluid_of(state, wanted) if "fluid" in what else None
    if state.points.shape[1] == 3:
        found = bodies.regions(state, request, wanted) if "regions" in what else None
        moved = bodies.surface(state, wanted) if "displacement" in what else None
        of_joints = cracks(state, wanted) if "cracks" in what else None
        return Part(state.step, state.time, of_joints, pieces, fluid, found, moved)
    return Part(state.step, state.time, cracks(state, wanted), pieces, fluid)


def chosen(state: MeshState, request: Request) -> np.ndarray:
    """(ne,) elements of the requested groups. UsageError if no set has one of them."""
    keep = np.zeros(len(state.cells), bool)
    if not request.groups:
        return ~keep
    known: list[str] = []
    for column, names in state.group_names.items():
        known += names
        rows = [k for k, name in enumerate(names) if name in request.groups]
        keep |= np.isin(state.of_elements[column], rows)
    if not set(request.groups) & set(known):
        raise UsageError(f"no element of group {', '.join(request.groups)}; known: {', '.join(known) or 'none'}")
    return keep


def cracks(state: MeshState, wanted: np.ndarray) -> Cracks:
    """Joints between elements that are wanted (ne,)."""
    j, (size, body) = state.of_joints, MEASURES[state.points.shape[1]]
    keep = _between(state, wanted) & (j["state"] != FREE)
    now, length, damage = j["state"][keep], j[size][keep], np.nan_to_num(j["damage"][keep])
    broken = now == BROKEN
    kind = np.searchsorted(emission.LIMITS, j["mode"][keep][broken], side="right")
    energy = np.nan_to_num(j.get("break_energy", np.zeros(len(keep)))[keep][broken])
    total = float(length.sum())
    return Cracks(
        len(now), int((now == YIELDED).sum()), np.bincount(kind, minlength=len(MODES)), total,
        float(length[now == YIELDED].sum()), np.bincount(kind, length[broken], len(MODES)),
        float((length * damage).sum()) / total if total > 0.0 else 0.0, float(state.of_elements[body][wanted].sum()),
        math.fsum(energy),
    )  # fmt: skip


def _between(state: MeshState, wanted: np.ndarray) -> np.ndarray:
    """(nj,) joints between elements that are wanted (ne,)."""
    if wanted.all():
        return np.ones(len(state.joints), bool)
    lower, upper = sides(state)
    there = np.append(wanted, True)  # the last: removed elements
    return there[lower] & there[upper]


def channels(state: MeshState, wanted: np.ndarray) -> np.ndarray:
    """Rows of the joints that are channels between elements that are wanted (ne,)."""
    aperture = state.of_joints.get("aperture", np.full(len(state.joints), np.nan))
    return np.flatnonzero(np.isfinite(aperture) & _between(state, wanted))


def fluid_of(state: MeshState, wanted: np.ndarray) -> Fluid:
    """Measure the fluid in the channels between the `wanted` elements (ne,)."""
    rows = channels(state, wanted)
    if not len(rows):
        return Fluid(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    j = {name: values[rows] for name, values in state.of_joints.items()}
    size = _sizes(state, rows)
    wet = j["saturation"] >= WET
    gone = wet & ((j["state"] == BROKEN) | (j["state"] == FREE))
    volume = math.fsum((j["saturation"] * j["aperture"] * size).tolist())
    return Fluid(
        len(rows), int(wet.sum()), math.fsum(size[wet].tolist()), math.fsum(size[gone].tolist()), volume,
        float(j["fluid_pressure"].max()), float(j["aperture"].max()), float(np.abs(j["fluid_velocity"]).max()),
    )  # fmt: skip


def _sizes(state: MeshState, rows: np.ndarray) -> np.ndarray:
    """(n,) lengths of channels as they are [m], in space areas [m2]."""
    return sizes(state.points[state.joints[rows, : state.points.shape[1]]])


def _pairs(state: MeshState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inner edges: rows of the two elements (m,), that with the lower number first, and number of its face."""
    if "node" not in state.of_points:
        raise HpcdemError(
            f"step {state.step}: this frame is of an earlier version and does not record neighbouring elements: run "
            "the model again"
        )
    node, cells = state.of_points["node"], state.cells
    count = np.where(cells[:, 3] >= 0, 4, 3)
    element = np.repeat(np.arange(len(cells)), count)
    edge = np.concatenate([np.arange(n) for n in (3, 4)])[np.where(count == 3, 0, 3).repeat(count) + _within(count)]
    a, b = (node[cells[element, k]] for k in (edge, (edge + 1) % count[element]))
    face = 4 * state.of_elements["number"][element].astype(np.int64) + edge
    order = np.lexsort((face, np.maximum(a, b), np.minimum(a, b)))
    low, high = np.minimum(a, b)[order], np.maximum(a, b)[order]
    same = np.flatnonzero((low[1:] == low[:-1]) & (high[1:] == high[:-1]))
    return element[order[same]], element[order[same + 1]], face[order[same]]


def _within(count: np.ndarray) -> np.ndarray:
    """0, 1, ... for each of the stretches of these lengths, one after the other."""
    return np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)


def sides(state: MeshState) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the elements on both sides of each joint (nj,), the lower first; -1: removed."""
    if state.points.shape[1] == 3:
        lower = faces_of_joints(state)
        other = tetrahedra.face_partners(state.of_points["node"][state.cells].astype(np.int64))[lower]
        return lower // 4, np.where(other >= 0, other // 4, -1)
    first, second, face = _pairs(state)
    number = state.of_joints["number"].astype(np.int64)
    lower = np.searchsorted(state.of_elements["number"], number // 4)
    order = np.argsort(face)
    at = np.minimum(np.searchsorted(face[order], number), max(len(face) - 1, 0))
    found = face[order][at] == number if len(face) else np.zeros(len(number), bool)
    return lower, np.where(found, second[order][at] if len(face) else -1, -1)


def fragments(state: MeshState, wanted: np.ndarray) -> Pieces:
    """The fragments of the elements that are wanted (ne,)."""
    if state.points.shape[1] == 3:
        beside = neighbours(state)
        face = np.flatnonzero(beside > np.arange(len(beside)))
        first, second = face // 4, beside[face] // 4
        tied, area = wanted[first] & wanted[second], state.of_elements["volume"]
    else:
        first, second, face = _pairs(state)
        holds = (state.of_joints["state"] == INTACT) | (state.of_joints["state"] == YIELDED)
        gone = state.of_joints["number"][~holds].astype(np.int64)
        tied, area = ~np.isin(face, gone) & wanted[first] & wanted[second], state.of_elements["area"]
    n = len(state.cells)
    rows = np.flatnonzero(wanted)
    lowest, of = np.unique(united(n, first[tied], second[tied])[rows], return_inverse=True)
    areas, count = np.bincount(of, area[rows]), np.bincount(of)
    order = np.lexsort((lowest, -areas))  # equal ones by their lowest element
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    of = place[of]
    middle = _middles(state)[rows]
    at = np.column_stack([np.bincount(of, area[rows] * along) / areas[order] for along in middle.T])
    whole = np.full(n, -1)
    whole[rows] = of
    return Pieces(whole, areas[order], count[order], at)


def _middles(state: MeshState) -> np.ndarray:
    """(ne, dim) means of the corners."""
    real = state.cells >= 0
    corners = np.where(real[:, :, None], state.points[state.cells], 0.0)
    return corners.sum(axis=1) / real.sum(axis=1)[:, None]


# --- tables ------------------------------------------------------------------------------------------------------


def orientation(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Dip and dip direction [degrees] of triangles (n, 3, 3): z is up, directions run clockwise from y, as from north,
    to x. Level ones have the direction 0."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal *= np.where(normal[:, 2] < 0.0, -1.0, 1.0)[:, None]
    flat = np.hypot(normal[:, 0], normal[:, 1])
    direction = np.degrees(np.arctan2(normal[:, 0], normal[:, 1])) % 360.0
    return np.degrees(np.arctan2(flat, normal[:, 2])), np.where(flat > 1e-12 * np.abs(normal[:, 2]), direction, 0.0)


def parted(state: MeshState, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure the opening and the slip of joints in space (rows), (n,) [m], as means of their three corners; NaN if one
    side was removed."""
    lower, node = faces_of_joints(state)[rows], state.of_points["node"].astype(np.int64)
    upper = tetrahedra.face_partners(node[state.cells])[lower]
    mine, other = (tetrahedra.face_points(state.cells, faces) for faces in (lower, np.maximum(upper, 0)))
    a, b = (np.take_along_axis(one, np.argsort(node[one], axis=1), axis=1) for one in (mine, other))
    apart = (state.points[b] - state.points[a]).mean(axis=1)
    corners = state.points[mine]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    across = (apart * normal).sum(axis=1)
    along = np.linalg.norm(apart - across[:, None] * normal, axis=1)
    return np.where(upper >= 0, across, NAN), np.where(upper >= 0, along, NAN)


def broken_joints(state: MeshState, wanted: np.ndarray) -> np.ndarray:
    """Rows of the joints between elements that are wanted (ne,) that are broken."""
    return np.flatnonzero((state.of_joints["state"] == BROKEN) & _between(state, wanted))


def _each_crack(state: MeshState, wanted: np.ndarray) -> Sheet:
    """The broken joints of a frame in space, one by one."""
    rows, j = broken_joints(state, wanted), state.of_joints
    corners = state.points[state.joints[rows, :3]]
    there = {name: column for name, column in OF_CRACKS.items() if column in j}
    columns = (
        j["number"][rows].astype(np.int64), *corners.mean(axis=1).T, j[MEASURES[3][0]][rows], *orientation(corners),
        *parted(state, rows), *(j[column][rows] for column in there.values()),
    )  # fmt: skip
    head = (
        "joint", *(f"{c}[m]" for c in "xyz"), "area[m2]", "dip[deg]", "dip_direction[deg]", "opening[m]", "slip[m]",
        *there,
    )  # fmt: skip
    return Sheet("cracks_last", head, zip(*(c.tolist() for c in columns), strict=True))


OF_CRACKS = {"mode": "mode", "aperture[m]": "aperture", "time[s]": "break_time"}
"""Columns of broken joints, and their names in frames; apertures exist where there is fluid."""


SIZES = {2: ("length[m]", "p21"), 3: ("area[m2]", "p32")}
"""Names of the size of joints and of their density, by dimensions of space."""


def cracks_sheets(parts: Sequence[Part], state: MeshState, wanted: np.ndarray) -> list[Sheet]:
    """Make the tables of cracks: over time; in space also each broken joint of a frame, the last one."""
    dim = state.points.shape[1]
    size, density = SIZES[dim]
    head = (
        *HEAD, "joints", "yielded", *MODES, "broken", size, f"yielded_{size}", *(f"{name}_{size}" for name in MODES),
        f"broken_{size}", "damage", f"{density}[1/m]", f"kinetic_energy[{unit_in('J/m', dim)}]",
    )  # fmt: skip

    def rows() -> Iterable[Sequence[Any]]:
        for one in parts:
            c = one.cracks
            assert c is not None
            broken = float(c.broken_size.sum())
            yield (
                one.step, one.time, c.joints, c.yielded, *c.broken.tolist(), int(c.broken.sum()), c.size,
                c.yielded_size, *c.broken_size.tolist(), broken, c.damage, broken / c.body if c.body else NAN,
                c.energy,
            )  # fmt: skip

    return [Sheet("cracks_joints", head, rows()), *([_each_crack(state, wanted)] if dim == 3 else [])]


def fragments_sheets(parts: Sequence[Part]) -> list[Sheet]:
    last = parts[-1].pieces
    assert last is not None
    amount = "area[m2]" if last.at.shape[1] == 2 else "volume[m3]"
    head = (
        *HEAD, "fragments", "single_elements", amount, "largest_share",
        *(f"size_{100 * share:.0f}[m]" for share in SHARES),
    )  # fmt: skip

    def rows() -> Iterable[Sequence[Any]]:
        for one in parts:
            p = one.pieces
            assert p is not None
            total = float(p.area.sum())
            yield (
                one.step, one.time, len(p.area), int((p.elements == 1).sum()), total, float(p.area[0]) / total,
                *p.characteristic(),
            )  # fmt: skip

    passing = last.passing()[1][::-1]
    columns = (last.elements, last.area, last.size, passing, *last.at.T)
    each = ((k, *row) for k, row in enumerate(zip(*(c.tolist() for c in columns), strict=True), 1))
    names = (
        "fragment",
        "elements",
        amount,
        "size[m]",
        "passing",
        *(f"{axis}[m]" for axis in "xyz"[: last.at.shape[1]]),
    )
    return [Sheet("fragments", head, rows()), Sheet("fragments_last", names, each)]


OF_CHANNELS = {
    "state": "state", "pressure[Pa]": "fluid_pressure", "saturation": "saturation", "aperture[m]": "aperture",
    "flow_rate[m2/s]": "flow_rate", "velocity[m/s]": "fluid_velocity", "temperature[K]": "fluid_temperature",
    "concentration": "proppant_concentration", "pack_pressure[Pa]": "pack_pressure",
}  # fmt: skip
"""Columns of channels, and their names in frames; the last ones exist where there is further physics."""


def fluid_sheets(parts: Sequence[Part], state: MeshState, wanted: np.ndarray) -> list[Sheet]:
    """Make the tables of fluid: over time, and each channel of a frame, the last one."""
    dim = state.points.shape[1]
    size, volume = SIZES[dim][0], {2: "volume[m3/m]", 3: "volume[m3]"}[dim]
    most = "pressure[Pa]", "aperture[m]", "velocity[m/s]"
    head = *HEAD, "channels", "wet", f"wet_{size}", f"open_wet_{size}", volume, *most
    some = [(one, one.fluid) for one in parts if one.fluid is not None]
    rows = ((one.step, one.time, *astuple(fluid)) for one, fluid in some)
    at = channels(state, wanted)
    j, middle = state.of_joints, state.points[state.joints[at, :dim]].mean(axis=1)
    there = {name: column for name, column in OF_CHANNELS.items() if column in j}
    columns = (j["number"][at].astype(np.int64), *middle.T, _sizes(state, at), *(j[c][at] for c in there.values()))
    each = zip(*(c.tolist() for c in columns), strict=True)
    of_each = "joint", *(f"{axis}[m]" for axis in "xyz"[:dim]), size, *there
    return [Sheet("fluid", head, rows), Sheet("fluid_last", of_each, each)]


@dataclass(frozen=True)
class Emission:
    """Joints that broke, their energies [J] and magnitudes, the fit, rates (rows of `emission.rates`), whether these
    are over time (else over steps), and the history that is drawn with them."""

    events: Events
    energy: np.ndarray
    magnitude: np.ndarray
    fit: Fit
    rates: np.ndarray
    timed: bool
    history: Curve | None

    @property
    def at(self) -> np.ndarray:
        """(n,) when they were: time [s], or step."""
        return self.events.time if self.timed else self.events.step.astype(float)


def events_of(request: Request, files: Sequence[FrameFile]) -> Events:
    """Gather all joints that broke: of the table that the run wrote; else those that are broken in the last frame."""
    path = request.folder / emission.TABLE
    if path.is_file():
        found = emission.read_events(path)
    else:
        found = _in_frame(read_mesh_frame(files[-1].path, solid=True))
    keep = (found.step >= (request.first or 0)) & (request.last is None or found.step <= (request.last or 0))
    if request.groups and not files:
        raise UsageError(f"--groups: {request.folder} has no frames of blocks, which record the groups of elements")
    if request.groups:
        state = read_mesh_frame(files[0].path, solid=True)
        keep &= np.isin(found.joint // 4, state.of_elements["number"][chosen(state, request)])
    found = found.take(keep)
    found.x[:] += request.xmove
    found.y[:] += request.ymove
    return found


def _in_frame(state: MeshState) -> Events:
    j = state.of_joints
    if "break_time" not in j:
        raise HpcdemError(
            f"step {state.step}: this frame is of an earlier version and does not record when joints broke: run the "
            "model again"
        )
    rows = np.flatnonzero(j["state"] == BROKEN)
    rows = rows[np.lexsort((j["number"][rows], j["break_time"][rows]))]
    # Places in the mesh: those of the corners less what they have moved.
    dim = state.points.shape[1]
    x, y, *z = (state.points - state.of_points["displacement"])[state.joints[rows, :dim]].mean(axis=1).T
    unknown = np.full(len(rows), np.nan)
    return Events(
        np.full(len(rows), state.step), j["break_time"][rows], j["number"][rows].astype(np.int64), x, y,
        j["mode"][rows], j[MEASURES[dim][0]][rows], j["break_energy"][rows], unknown, z[0] if z else np.zeros(0),
    )  # fmt: skip


def emitted(request: Request, files: Sequence[FrameFile]) -> Emission:
    """Statistics of the joints that broke. HpcdemError without any, or if the requested history is missing."""
    events = events_of(request, files)
    if not len(events):
        raise HpcdemError(f"emission: no joint broke in {request.folder}")
    energy = request.joule * (events.released() if request.released else events.kinetic)
    if request.released and np.isnan(energy).all():
        raise HpcdemError(
            f"--energy released: {request.folder} has no {emission.TABLE}, and frames do not record the released energy"
        )
    magnitude = emission.magnitudes(energy)
    timed = bool(np.ptp(events.time) > 0.0)
    history = None if request.history == "none" else emission.load_history(request.folder, request.history)
    at = events.time if timed else events.step.astype(float)
    ends = [at.min(), at.max()]
    if history is not None and len(history.step):
        keep = (history.step >= (request.first or 0)) & (request.last is None or history.step <= (request.last or 0))
        other = (history.time if timed else history.step)[keep]
        ends += [other.min(), other.max()] if len(other) else []
    low, high = float(min(ends)), float(max(ends))
    span = (low, high) if high > low else (low - 0.5, low + 0.5)
    table = emission.rates(at, events.kinds(), energy, span, request.bins)
    return Emission(events, energy, magnitude, emission.fit(magnitude, request.completeness), table, timed, history)


def emission_sheets(found: Emission) -> list[Sheet]:
    e = found.events
    columns = (
        e.step, e.time, e.joint, *e.places.values(), e.mode, e.size, found.energy, found.magnitude,
    )  # fmt: skip
    each = zip(*(c.tolist() for c in columns), strict=True)
    unit = "[s]" if found.timed else "[step]"
    head = (f"from{unit}", f"to{unit}", *MODES, "events", "cumulative", "energy[J]", "cumulative_energy[J]")
    counts = found.rates[:, 2:5].sum(axis=1)
    rows = (
        (*row[:2], *(int(n) for n in row[2:5]), int(n), int(total), *row[5:])
        for row, n, total in zip(found.rates.tolist(), counts, np.cumsum(counts), strict=True)
    )
    size = "length[m]" if len(e.places) == 2 else "area[m2]"
    names = ("step", "time[s]", "joint", *(f"{c}[m]" for c in e.places), "mode", size, "energy[J]", "magnitude")
    edges, number, above = emission.frequencies(found.magnitude)
    f = found.fit
    return [
        Sheet("emission", head, rows),
        Sheet("emission_events", names, each),
        Sheet("emission_magnitudes", ("from", "to", "events", "events_from"),
              zip(edges.tolist(), (edges + BIN).tolist(), number.tolist(), above.tolist(), strict=True)),
        Sheet("emission_b", ("b", "standard_error", "a", "completeness", "events"),
              [(f.b, f.error, f.a, f.completeness, f.number)]),
    ]  # fmt: skip
