"""Contents of a frame as kinds of objects with fields. Columns are read when they are needed, and only these."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.core.fields import unit_in
from hpcdem.core.units import label
from hpcdem.io.frame import Columns, Frame, Table, part
from hpcdem.io.frames import list_frames, read_frame
from hpcdem.io.vtkhdf_mesh import CONTACTS, CORNERS, FACE_CONDITIONS, MeshState, is_mesh_frame, read_mesh_frame
from hpcdem.post import fluid, liners
from hpcdem.post.view import tracks

DISCS, POLYGONS, LINES = "discs", "polygons", "lines"
SOLIDS, FACES, RODS = "solids", "faces", "rods"
"""Names of the shapes in space."""
SPOTS, BALLS = "spots", "balls"
"""Names of the shapes of points, in the plane and in space."""
INSIDE = ("clumps", "contacts", "bonds", "joints", "channels", "face-conditions", "flow-nodes", "node-conditions",
          "faults")  # fmt: skip
"""Objects that lie between others."""
OF_CHANNELS = (
    "aperture", "fluid_pressure", "saturation", "flow_rate", "fluid_velocity", "fluid_temperature",
    "proppant_concentration", "pack_pressure",
)  # fmt: skip
"""Columns of joints that exist where there are channels."""
UNITS = {
    "Pa": ("stress", "pressure", "suction", "ebmod", "gbmod", "tstrength", "sstrength"),
    "m": ("x", "y", "radius", "displacement", "opening", "slip", "length", "aperture", "overlap", "position",
          "distance", "throw", "heave"),
    "m/s": ("velocity", "vx", "vy", "incoming"), "m/s2": ("acceleration",),
    "N/m": ("contact_force", "nodal_force", "membrane", "transverse"),
    "N m/m": ("bending",), "1/m": ("curvature",),
    "W/m2": ("heat_flux",), "W/(m2 K)": ("transfer_coefficient",),
    "rad/s": ("spin",), "rad": ("angle", "rotation"), "s": ("time",),
    "N": ("force", "fx", "fy", "fn", "fs"), "N m": ("torque", "moment"), "K": ("temperature",), "kg": ("mass",),
    "kg/m3": ("density",), "J/m": ("energy", "work"), "m2": ("area",), "m3": ("volume",),
    "m2/s": ("flow_rate", "inflow"),
}  # fmt: skip
"""Units by the word, or the end of the word, that says what a field is."""
OF_LENGTHS = ("flow_rate", "membrane", "transverse", "bending")
"""Beginnings of the names of fields that are per metre in space too: of a channel, of a shell."""

KEPT = 40e6
"""Memory [B] of the columns of one kind of object that are kept: those of the colours on show, and a few more."""
CHUNK = 1 << 16
"""Rows processed at a time."""
PARTS = {
    "x", "y", "z", "xx", "yy", "xy", "zz", "xz", "yz", "max", "middle", "min", "mean", "mises", "largest",
    "smallest", "first", "last", "shear",
}  # fmt: skip
"""Ends of the names of fields that do not change the unit."""


_Reader = Callable[[slice], np.ndarray]
"""Function that returns the values of some rows."""


def unit_of(name: str, dim: int = 2) -> str:
    """The unit of a field of a frame, "" for numbers without one, and for those that are not known here."""
    if dim == 3 and not name.startswith(OF_LENGTHS):
        return unit_in(unit_of(name), dim)
    words = name.split("_")
    while len(words) > 1 and words[-1] in PARTS:
        words.pop()
    stem = "_".join(words)
    ends = ((unit, word) for unit, known in UNITS.items() for word in known)
    found = [(len(word), unit) for unit, word in ends if stem == word or stem.endswith(f"_{word}")]
    return max(found)[1] if found else ""


@dataclass
class Objects:
    """All objects of a kind. shape: discs (centres (n, 2), radii (n,)), polygons (points (k, 2), cells (n, 4), with -1
    in the fourth column of triangles), lines (ends (n, 2, 2)) or spots (places (n, 2)); in space tetrahedra (points
    (k, 3), cells (n, 4), the face (4 n,) that each of their faces lies on, or -1), faces (points (k, 3), cells (n, 4)
    as polygons), rods (ends (n, 2, 3)) or balls (places (n, 3)), read when it is needed; fields: (n,) by name;
    vectors: (n, 2), in space (n, 3), by name; names: of the values of an integer field; number: the field by which the
    program numbers them; slow: fields that take a pass over other tables."""

    kind: str
    count: int
    read: Callable[[], tuple[np.ndarray, ...]]
    fields: Mapping[str, np.ndarray]
    vectors: Mapping[str, np.ndarray] = field(default_factory=dict)
    names: Mapping[str, list[str]] = field(default_factory=dict)
    number: str = "number"
    slow: Collection[str] = ()

    @property
    def dim(self) -> int:
        """Dimensions of space."""
        return 3 if self.kind in (SOLIDS, FACES, RODS, BALLS) else 2

    def centres(self) -> np.ndarray:
        """(n, 2), in space (n, 3) [m]."""
        shape = self.read()
        if self.kind in (DISCS, SPOTS, BALLS):
            return shape[0]
        return shape[0].mean(axis=1) if self.kind in (LINES, RODS) else middles(*shape[:2])

    def centre(self, row: int) -> np.ndarray:
        """(2,), in space (3,) [m]: of one object."""
        shape = self.read()
        if self.kind in (DISCS, SPOTS, BALLS):
            return shape[0][row]
        if self.kind in (LINES, RODS):
            return shape[0][row].mean(axis=0)
        corners = shape[1][row]
        return shape[0][corners[corners >= 0]].mean(axis=0)

    def value(self, name: str, row: int) -> Any:
        """Return the value of a field or vector of one object."""
        return part(self.fields if name in self.fields else self.vectors, name, slice(row, row + 1))[0]

    def values(self, name: str, label: str) -> np.ndarray:
        """(n,) a field, the length of a vector (velocity), or a component (velocity_x). HpcdemError that names what
        there is."""
        if name in self.fields:
            return self.fields[name]
        if name in self.vectors:
            return lengths(self.vectors[name])
        stem, axis = self.component(name)
        if stem:
            return np.asarray(self.vectors[stem])[:, axis]
        raise self.lack(name, label)

    def component(self, name: str) -> tuple[str, int]:
        """The vector of which this is a component, "" if it is none, and which."""
        stem, _, axis = name.rpartition("_")
        there = stem in self.vectors and axis in tuple("xyz"[: self.dim])
        return (stem, "xyz".index(axis)) if there else ("", 0)

    def lack(self, name: str, label: str) -> HpcdemError:
        """The message about a missing field."""
        return HpcdemError(f"{label} have no field {name} in this frame; known: {', '.join(self.known())}")

    def has(self, name: str) -> bool:
        """Return whether there is a field, a vector or a component of this name."""
        return name in self.fields or name in self.vectors or bool(self.component(name)[0])

    def filled(self, name: str) -> bool:
        """Return whether it has a value somewhere."""
        if name not in self.fields:
            return self.has(name)
        return any(there(part(self.fields, name, slice(first, first + CHUNK))) for first in range(0, self.count, CHUNK))

    def known(self) -> list[str]:
        """Names of fields that have a value somewhere, of vectors (their lengths) and of their components."""
        return [*(name for name in self.fields if self.filled(name)), *self.of_vectors()]

    def of_vectors(self) -> list[str]:
        """Names of vectors, each with its components, but those that are fields too."""
        axes = "xyz"[: self.dim]
        every = (name for vector in self.vectors for name in (vector, *(f"{vector}_{axis}" for axis in axes)))
        return [name for name in every if name not in self.fields]

    def waiting(self) -> set[str]:
        """Slow fields that were not used yet."""
        return {name for name in self.slow if isinstance(self.fields, Columns) and not self.fields.was_read(name)}


def middles(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(n, 2), in space (n, 3) means of the corners of cells (n, 4)."""
    last = np.where(cells[:, 3] >= 0, cells[:, 3], cells[:, 0])
    total = points[cells[:, 0]] + points[cells[:, 1]] + points[cells[:, 2]]
    quads = cells[:, 3] >= 0
    return (total + np.where(quads[:, None], points[last], 0.0)) / np.where(quads, 4.0, 3.0)[:, None]


def lengths(vectors: np.ndarray) -> np.ndarray:
    """(n,) of vectors (n, 2) or (n, 3)."""
    return np.hypot(*vectors.T) if vectors.shape[1] == 2 else np.sqrt((vectors**2).sum(axis=1))


def there(values: np.ndarray) -> bool:
    """Return whether a column says anything: what an object does not have is NaN, or -1 in whole numbers."""
    if not len(values) or values.dtype.kind != "f":
        return values.dtype.kind != "f" and bool(len(values)) and bool((values != -1).any())
    return bool(np.isfinite(values[0])) or bool(np.isfinite(values).any())


@dataclass
class Moment:
    """A frame. displacement: (k, dim) [m] of the points of the elements, None where the frame has none; dim: dimensions
    of space; units: that the model declared, "" SI."""

    step: int
    time: float
    objects: dict[str, Objects]
    displacement: Callable[[], np.ndarray] | None = None
    dim: int = 2
    units: str = ""

    def unit_of(self, name: str) -> str:
        """The unit of a field, as the model calls it."""
        return label(self.units, unit_of(name, self.dim))

    def of(self, name: str) -> Objects:
        """The objects of a kind. HpcdemError that names what there is."""
        if name not in self.objects:
            raise HpcdemError(f"this frame has no {name}; it has {', '.join(self.objects) or 'no objects'}")
        return self.objects[name]

    def extent(
        self, turn: np.ndarray | None = None, shifted: np.ndarray | None = None
    ) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of what is there [m]; turn (3, 3): right, up and towards the eye, in space; shifted
        (k, dim): by which the points of elements are moved for the picture [m]."""
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        for name, objects in self.objects.items():
            if not objects.count or name in INSIDE:
                continue
            shape = objects.read()
            for first in range(0, len(shape[0]), CHUNK):
                some = slice(first, first + CHUNK)
                at = shape[0][some] if shifted is None or name != "elements" else shape[0][some] + shifted[some]
                at = at.reshape(-1, 2) if turn is None else at.reshape(-1, 3) @ turn[:2].T
                at = np.where(np.isfinite(at), at, np.nan)
                around = shape[1][some, None] if objects.kind == DISCS else 0.0
                low = np.fmin(low, np.fmin.reduce(at - around, axis=0))
                high = np.fmax(high, np.fmax.reduce(at + around, axis=0))
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            return 0.0, 1.0, 0.0, 1.0
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def read_moment(path: str | os.PathLike) -> Moment:
    """The frame in a file of hpcdem, of particles or of blocks. HpcdemError if it is none, or damaged."""
    from hpcdem.io.vtkhdf import read_vtkhdf

    path = Path(path)
    if path.suffix == ".vtkhdf" and is_mesh_frame(path):
        return _with_faults(of_blocks(read_mesh_frame(path, lazily=True, solid=True)), path)
    frame = read_vtkhdf(path, lazily=True) if path.suffix == ".vtkhdf" else read_frame(path)
    return _with_faults(_with_origin(of_particles(frame), path), path)


def _with_faults(moment: Moment, path: Path) -> Moment:
    """Return the moment with the faults that were measured in this frame."""
    ends, fields = tracks.faults(path, moment.step) if moment.dim == 2 else (np.zeros((0, 2, 2)), {})
    if len(ends):
        names = {"fault": [f"fault {k}" for k in range(int(fields["fault"].max()) + 1)]}
        moment.objects["faults"] = Objects(LINES, len(ends), lambda: (ends,), fields, names=names, number="fault")
    return moment


# ---- particles -------------------------------------------------------------------------------------------------------


def _with_origin(moment: Moment, path: Path) -> Moment:
    """Add the displacement of discs since the last frame of the folder before this one that was written as a command
    began (`_ini`); NaN of those that were not there yet."""
    try:
        begun = [file.path for file in list_frames(path.parent) if file.ini and file.step < moment.step]
    except HpcdemError:  # a single frame
        begun = []
    if not begun or not path.name.startswith("all_"):
        return moment
    discs = moment.objects["particles"]

    def displacement(rows: slice) -> np.ndarray:
        begun_frame = read_frame(begun[-1], ("particles",))
        table = begun_frame.tables["particles"].columns
        gid, known = part(discs.fields, "gid", rows), np.asarray(table["gid"])
        place = np.minimum(np.searchsorted(known, gid), max(len(known) - 1, 0))
        found = np.full((len(gid), 2), np.nan)
        there = known[place] == gid if len(known) else np.zeros(len(gid), bool)
        for axis, name in enumerate("xy"):
            now = part(discs.fields, name, rows)
            found[there, axis] = now[there] - np.asarray(table[name])[place[there]]
        if "laps" in table:  # periodic sides
            laps = part(discs.fields, "laps", rows)[there] - np.asarray(table["laps"])[place[there]]
            found[there, 0] += laps * float(begun_frame.settings["period"])
        return found

    readers: dict[str, _Reader] = {name: partial(part, discs.vectors, name) for name in discs.vectors}
    discs.vectors = Columns(readers | {"displacement": displacement}, KEPT)
    return moment


def _walls(walls: Mapping[str, Any]) -> Objects:
    ends = np.stack([np.asarray(walls[k], float).reshape(-1, 2) for k in ("p1", "p2")], axis=1)
    flat = {name: np.asarray(values) for name, values in walls.items() if np.asarray(values).ndim == 1}
    both = {"velocity": "v", "force": "force"}
    across = {name: np.asarray(walls[k]) for name, k in both.items() if k in walls}
    return Objects(LINES, len(ends), lambda: (ends,), flat, across, number="id")


class _Particles:
    """Columns of a whole frame of particles, each made once."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame
        self.tables: dict[str, Mapping[str, np.ndarray]] = {name: one.columns for name, one in frame.tables.items()}
        self.rows = self.tables["particles"]

    def pair(self, name: str, a: str, b: str) -> _Reader:
        """Two columns of a table beside each other."""
        table = self.tables[name]
        return lambda rows: np.stack([part(table, a, rows), part(table, b, rows)], axis=1)

    @cached_property
    def centres(self) -> np.ndarray:
        return self.pair("particles", "x", "y")(slice(None))

    @cached_property
    def stresses(self) -> dict[str, np.ndarray]:
        return _stresses(self.frame)

    def stress(self, name: str, rows: slice) -> np.ndarray:
        return self.stresses[name][rows]

    def kinetic_energy(self, rows: slice) -> np.ndarray:
        mass, vx, vy = (part(self.rows, name, rows) for name in ("mass", "vx", "vy"))
        return 0.5 * mass * (vx**2 + vy**2)

    @cached_property
    def _ends(self) -> dict[str, np.ndarray]:
        return {}

    def ends(self, name: str) -> tuple[np.ndarray]:
        """Centres of both particles of contacts or bonds (n, 2, 2)."""
        if name not in self._ends:
            ids, every = part(self.rows, "gid", slice(None)), self.pair(name, "id1", "id2")(slice(None))
            ends = self.centres[np.minimum(np.searchsorted(ids, every), len(ids) - 1)]
            apart = ends[:, 1, 0] - ends[:, 0, 0]
            ends[:, 1, 0] += self.frame.shortest(apart) - apart
            self._ends[name] = ends
        return (self._ends[name],)

    def lines(self, name: str) -> Objects:
        """Contacts or bonds."""
        table = self.tables[name]
        pulls = {"force": self.pair(name, "fx", "fy")} if "fx" in table else {}
        columns = Columns({column: partial(part, table, column) for column in table}, KEPT)
        total = self.frame.tables[name].total
        return Objects(LINES, total, partial(self.ends, name), columns, Columns(pulls, KEPT), number="")

    def discs(self) -> Objects:
        p = self.rows
        more: dict[str, _Reader] = {name: partial(part, p, name) for name in p}
        if "angle" in p:
            more["rotation"] = partial(part, p, "angle")
        if "mass" in p and "vx" in p:
            more["kinetic_energy"] = self.kinetic_energy
        if "fx" in self.tables["contacts"]:
            more |= {name: partial(self.stress, name) for name in STRESSES}
        both = {"velocity": ("vx", "vy"), "force": ("fx", "fy")}
        vectors = {name: self.pair("particles", a, b) for name, (a, b) in both.items() if a in p}
        return Objects(
            DISCS, self.frame.tables["particles"].total, lambda: (self.centres, p["radius"]), Columns(more, KEPT),
            Columns(vectors, KEPT), {"group": self.frame.group_names}, "gid", STRESSES,
        )  # fmt: skip


def of_particles(frame: Frame) -> Moment:
    """A whole frame of particles."""
    of = _Particles(frame)
    p, objects = of.rows, {"particles": of.discs()}
    if "clump" in p and len(some := np.flatnonzero(part(p, "clump", slice(None)) >= 0)):
        objects["clumps"] = _clumps(p, some, lambda: (of.centres[some], p["radius"][some]))
    if len(frame.walls.get("id", ())):
        objects["walls"] = _walls(frame.walls)
    objects |= {name: of.lines(name) for name in ("contacts", "bonds") if frame.tables[name].total}
    return Moment(frame.step, frame.time, objects, units=str(frame.settings.get("units", "")))


def _clumps(
    p: Mapping[str, np.ndarray], some: np.ndarray, read: Callable[[], tuple[np.ndarray, ...]]
) -> Objects:  # fmt: skip
    """The members of clumps, each known by its clump; members: how many there are of it."""

    def members(rows: slice) -> np.ndarray:
        _, of, count = np.unique(p["clump"][some], return_inverse=True, return_counts=True)
        return count[of][rows]

    def column(name: str, rows: slice) -> np.ndarray:
        return part(p, name, slice(None))[some[rows]]

    fields: dict[str, _Reader] = {name: partial(column, name) for name in p} | {"members": members}
    vectors = {name: both for name, both in {"velocity": ("vx", "vy"), "force": ("fx", "fy")}.items() if both[0] in p}
    pairs = {
        name: partial(lambda both, rows: np.stack([column(one, rows) for one in both], axis=1), both)
        for name, both in vectors.items()
    }
    return Objects(DISCS, len(some), read, Columns(fields, KEPT), Columns(pairs, KEPT), number="clump")


STRESSES = ("stress_xx", "stress_yy", "stress_xy", "stress", "stress_deviator")
"""Stresses of particles, from the forces on them, compression positive: components, mean (s1 + s2) / 2, (s1 - s2) /
2."""


def _unread(columns: Any) -> Any:
    """Columns that are read anew at each use, without a cache."""
    return Columns({name: partial(part, columns, name) for name in columns})


def _stresses(frame: Frame) -> dict[str, np.ndarray]:
    """The stress of each particle [Pa], see hpcdem.post.stress."""
    from hpcdem.post.stress import moments, principal, volume_rule

    tables = {name: Table(_unread(table.columns), table.offset, table.total) for name, table in frame.tables.items()}
    frame = replace(frame, tables=tables)
    of_volume = moments(frame)[0] / volume_rule(frame)[0][:, None]
    xx, yy, xy = of_volume[:, 0], of_volume[:, 3], 0.5 * (of_volume[:, 1] + of_volume[:, 2])
    mean, deviator, _ = principal(xx, xy, yy)
    return dict(zip(STRESSES, (xx, yy, xy, mean, deviator), strict=True))


# ---- blocks ----------------------------------------------------------------------------------------------------------


def of_blocks(state: MeshState) -> Moment:
    """A frame of blocks."""
    cells, count, dim = state.cells, len(state.joints), state.points.shape[1]

    def mean(name: str, rows: slice) -> np.ndarray:
        """(n, ...) of what the corners of each of these elements have, which are consecutive."""
        some = cells[rows]
        first = int(some[0, 0]) if len(some) else 0
        values = part(state.of_points, name, slice(first, int(some[-1].max()) + 1 if len(some) else 0))
        total = values[some[:, 0] - first] + values[some[:, 1] - first] + values[some[:, 2] - first]
        quads = np.flatnonzero(some[:, 3] >= 0)
        total[quads] = 0.75 * (total[quads] + values[some[quads, 3] - first])
        return total / 3.0

    of_corners = [name for name in state.of_points if name not in ("number", "node")]
    flat = [name for name in of_corners if name not in VECTORS]
    fields: dict[str, _Reader] = {
        name: partial(part, state.of_elements, name) for name in state.of_elements if name != "cell"
    }
    fields |= {name: partial(mean, name) for name in flat}
    fields |= _of_stress(state.of_elements, dim)
    vectors = {name: partial(mean, name) for name in of_corners if name in VECTORS}
    beside = Columns({"partner": lambda rows: neighbours(state)[rows]})
    objects = {
        "elements": Objects(
            SOLIDS if dim == 3 else POLYGONS, len(cells),
            lambda: (state.points, cells, beside["partner"]) if dim == 3 else (state.points, cells),
            Columns(fields, KEPT), Columns(vectors, KEPT), state.group_names,
        )
    }  # fmt: skip

    def channel(name: str, which: np.ndarray, rows: slice) -> np.ndarray:
        some = which[rows]
        first = int(some[0]) if len(some) else 0
        return part(state.of_joints, name, slice(first, int(some[-1]) + 1 if len(some) else 0))[some - first]

    def of_joints(names: list[str]) -> Columns:
        return Columns({name: partial(part, state.of_joints, name) for name in names}, KEPT)

    wet = [name for name in OF_CHANNELS if name in state.of_joints]
    rest = [name for name in state.of_joints if name not in (*wet, "cell") and not name.startswith("group_")]
    if count and dim == 3:
        objects["joints"] = Objects(FACES, count, lambda: (state.points, _faces(state)), of_joints(rest + wet))
    elif count:
        objects["joints"] = Objects(LINES, count, lambda: (state.points[state.joints],), of_joints(rest))
    if "aperture" in wet and dim == 2 and fluid.there(state):
        rows = np.flatnonzero(np.isfinite(state.of_joints["aperture"]))
        both = [*wet, *(name for name in ("number", "length") if name in rest)]
        objects["channels"] = Objects(
            LINES, len(rows), lambda: (state.points[state.joints[rows]],),
            Columns({name: partial(channel, name, rows) for name in both}, KEPT),
        )  # fmt: skip
    for name, tables in state.supports.items():
        objects[name] = _supports(name, tables)
    for name, table in state.tables.items():
        objects[name] = _further(state, name, table)
    displacement = (lambda: state.of_points["displacement"]) if "displacement" in state.of_points else None
    return Moment(state.step, state.time, objects, displacement, dim, state.units)


def _of_stress(given: Mapping[str, np.ndarray], dim: int) -> dict[str, _Reader]:
    """Compute further stresses of elements (tension positive), where they are all there: mean, von Mises, and in space
    the middle principal stress."""
    shears = ("xy", "xz", "yz") if dim == 3 else ("xy",)
    if not {f"stress_{c}" for c in ("xx", "yy", "zz", *shears)} <= given.keys():
        return {}

    def stress(component: str, rows: slice) -> np.ndarray:
        return part(given, f"stress_{component}", rows)

    def mean(rows: slice) -> np.ndarray:
        return (stress("xx", rows) + stress("yy", rows) + stress("zz", rows)) / 3.0

    def mises(rows: slice) -> np.ndarray:
        middle = mean(rows)
        total = 0.5 * sum((stress(c, rows) - middle) ** 2 for c in ("xx", "yy", "zz"))
        return np.sqrt(3.0 * (total + sum(stress(c, rows) ** 2 for c in shears)))

    found: dict[str, _Reader] = {"stress_mean": mean, "stress_mises": mises}
    if dim == 3:
        found["stress_middle"] = lambda rows: 3.0 * mean(rows) - stress("max", rows) - stress("min", rows)
    return found


def neighbours(state: MeshState) -> np.ndarray:
    """(4 n,) the face of a tetrahedron on which each of their faces lies, -1: none, or one across a crack."""
    from hpcdem.physics.fdem import tetrahedra
    from hpcdem.post.blocks import BROKEN, FREE

    if "node" not in state.of_points:
        raise HpcdemError("this frame does not record neighbouring elements")
    partner = tetrahedra.face_partners(state.of_points["node"][state.cells].astype(np.int64))
    if len(state.joints):
        now = state.of_joints["state"]
        lower = faces_of_joints(state)[(now == BROKEN) | (now == FREE)]
        across = partner[lower]
        partner[lower] = partner[across[across >= 0]] = -1
    return partner


def faces_of_joints(state: MeshState) -> np.ndarray:
    """(nj,) the faces that joints are numbered by, as place of the element * 4 + k."""
    number = state.of_joints["number"].astype(np.int64)
    return 4 * np.searchsorted(state.of_elements["number"], number // 4) + number % 4


def _faces(state: MeshState) -> np.ndarray:
    """(nj, 4) rows of points of joints in space."""
    from hpcdem.physics.fdem import tetrahedra

    three = tetrahedra.face_points(state.cells, faces_of_joints(state))
    return np.column_stack([three, np.full(len(three), -1)])


def _further(state: MeshState, name: str, table: Mapping[str, np.ndarray]) -> Objects:
    """Contacts as lines between the middles of both elements, conditions of faces on these, others as points."""
    dim = state.points.shape[1]
    places = ("position", *CORNERS[3])
    vectors = {k: partial(part, table, k) for k in table if k not in places and part(table, k, slice(0, 1)).ndim == 2}
    flat = {k: partial(part, table, k) for k in table if k not in (*places, *vectors)}
    size = len(part(table, next(iter(flat)), slice(None)))

    def between() -> tuple[np.ndarray, ...]:
        ends = np.stack([table["element_1"], table["element_2"]], axis=1).reshape(-1)
        rows = np.searchsorted(part(state.of_elements, "number", slice(None)), ends)
        return (middles(state.points, state.cells[rows]).reshape(-1, 2, dim),)

    def on_faces() -> tuple[np.ndarray, ...]:
        corners = np.stack([table[k] for k in CORNERS[dim]], axis=1)
        rows = np.searchsorted(part(state.of_points, "number", slice(None)), corners)
        return (state.points[rows],) if dim == 2 else (state.points, np.column_stack([rows, np.full(len(rows), -1)]))

    def at() -> tuple[np.ndarray, ...]:
        return (table["position"],)

    kinds = {CONTACTS: (LINES, RODS, between), FACE_CONDITIONS: (LINES, FACES, on_faces)}
    plane, space, read = kinds.get(name, (SPOTS, BALLS, at))
    number = "" if name == CONTACTS else "number"
    return Objects(space if dim == 3 else plane, size, read, Columns(flat, KEPT), Columns(vectors, KEPT), number=number)


VECTORS = ("displacement", "velocity")
"""Vectors of corners."""


def _supports(name: str, tables: Mapping[str, Mapping[str, np.ndarray]]) -> Objects:
    """The elements of bolts, or of liners without those that were deleted."""
    nodes, elements = tables["nodes"], tables["elements"]
    at = np.column_stack([nodes[f"position_{axis}"] for axis in "xyz" if f"position_{axis}" in nodes])
    first = elements["first_node"]
    rows = np.arange(len(first))
    if name == "liners":
        rows = np.flatnonzero(elements["liner_state"].astype(np.int64) & liners.DELETED == 0)
    between = [elements["second_node"]] if "second_node" in elements else []
    nodes_of = np.column_stack([first, *between, elements.get("last_node", first + 1)])[rows].astype(np.int64)
    ends = at[nodes_of]
    kind = RODS if at.shape[1] == 3 else LINES
    shape: tuple[np.ndarray, ...] = (ends,)
    if between:  # triangles
        kind, shape = FACES, (at, np.column_stack([nodes_of, np.full(len(rows), -1)]))
    vectors = {}
    for stem in VECTORS:
        parts = [nodes[f"{stem}_{axis}"] for axis in "xyz"[: at.shape[1]] if f"{stem}_{axis}" in nodes]
        if parts:
            vectors[stem] = np.column_stack(parts)[nodes_of].mean(axis=1)
    return Objects(kind, len(rows), lambda: shape, {k: v[rows] for k, v in elements.items()}, vectors)
