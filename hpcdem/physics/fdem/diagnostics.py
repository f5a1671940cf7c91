"""Quantities of a model of blocks that can be queried: quantities by number, forces, contacts, events, equilibrium.
Nothing here changes the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import unit_in
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import breaks, by_temperature, connectivity, floors, overlaps, sides, user_laws
from hpcdem.physics.fdem.assignments import COMPONENTS
from hpcdem.physics.fdem.budget import Budget
from hpcdem.physics.fdem.kernels import plasticity, tets
from hpcdem.physics.fdem.kernels.joint_law import BARTON_BANDIS, DAMAGE, PATH
from hpcdem.physics.fdem.kernels.joints import BROKEN, INTACT, NONE, YIELDED
from hpcdem.physics.fdem.local import Evaluation, Local
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.probes import ForceProbe, Probe
from hpcdem.physics.fdem.properties import MECH_BURGERS, MECH_ISO_ELASTIC, MECH_MOHR_COULOMB, OF_JOINTS
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.state import Crack
from hpcdem.physics.fdem.topology import Numbers
from hpcdem.physics.fields import FIELDS, kinds


@dataclass(frozen=True)
class Quantity:
    """A quantity that can be queried by number: kind of object (element, node, joint), unit, meaning; framed: frames
    contain it; dims: dimensions of models that have it. Units are those of two dimensions, see `unit_of`."""

    on: str
    unit: str
    doc: str
    framed: bool = True
    dims: tuple[int, ...] = (2,)


BOTH = (2, 3)
DIFFUSING = ("temperature", *FIELDS)
"""Fields of elements with values at their corners: columns of `State.cold`."""


def unit_of(sim: Blocks, name: str) -> str:
    """The unit of a quantity in this model."""
    unit = quantity(sim, name).unit
    return unit_in(unit, sim.dim)


def _vector(name: str, on: str, unit: str, doc: str, framed: bool = True) -> dict[str, Quantity]:
    return {
        f"{name}_{axis}": Quantity(on, unit, f"{doc} in {axis}", framed, (3,) if axis == "z" else BOTH)
        for axis in "xyz"
    }


LENGTHS = {"displacement": "m", "velocity": "m/s"}
"""Vectors of nodes whose magnitudes are quantities too, with their units."""

QUANTITIES: dict[str, Quantity] = {
    **{
        f"stress_{c}": Quantity(
            "element", "Pa", f"stress {c}, tension positive", dims=BOTH if c in COMPONENTS[2] else (3,)
        )
        for c in COMPONENTS[3]
    },
    "stress_max": Quantity(
        "element", "Pa", "largest principal stress (most tensile), in the plane the larger of the two in it", dims=BOTH
    ),
    "stress_min": Quantity(
        "element",
        "Pa",
        "smallest principal stress (most compressive), in the plane the smaller of the two in it",
        dims=BOTH,
    ),
    "kinetic_energy": Quantity("element", "J/m", "kinetic energy", dims=BOTH),
    "strain_energy": Quantity("element", "J/m", "elastic energy", dims=BOTH),
    "mean_temperature": Quantity(
        "element", "K", "mean temperature of its corners; NaN without a thermal model", dims=BOTH
    ),
    **{
        f"mean_{one.name}": Quantity(
            "element", one.unit, f"mean of its corners: {one.doc}; NaN without a model of it", dims=BOTH
        )
        for one in kinds().values()
    },
    **{
        name: Quantity("element", unit, f"{doc}; NaN without a model of it", dims=BOTH)
        for one in kinds().values()
        for name, (unit, doc) in one.derived.items()
    },
    "area": Quantity("element", "m2", "area in the mesh"),
    "volume": Quantity("element", "m3", "volume in the mesh", dims=(3,)),
    "element_model": Quantity("element", "1", "row of the table of element models", dims=BOTH),
    "plastic_state": Quantity(
        "element", "1", "yielding in shear 1, in tension 2; has yielded before in shear 4, in tension 8", dims=BOTH
    ),
    "plastic_shear_strain": Quantity(
        "element", "1", "accumulated plastic shear strain, sqrt(e : e / 2) of the deviator", dims=BOTH
    ),
    "plastic_volume_strain": Quantity("element", "1", "volume of the plastic strain", dims=BOTH),
    "plastic_work": Quantity("element", "J/m", "work of plastic flow", dims=BOTH),
    **{
        f"creep_strain_{c}": Quantity(
            "element", "1", f"creep strain {c}, without volume", dims=BOTH if c in ("xx", "yy", "xy") else (3,)
        )
        for c in COMPONENTS[3]
    },
    **{
        f"kelvin_strain_{c}": Quantity(
            "element", "1", f"strain {c} of the Kelvin unit", dims=BOTH if c in ("xx", "yy", "xy") else (3,)
        )
        for c in COMPONENTS[3]
    },
    "creep_work": Quantity("element", "J/m", "work dissipated in the dashpots of creep", dims=BOTH),
    **_vector("position", "node", "m", "position"),
    **_vector("displacement", "node", "m", "displacement"),
    **_vector("velocity", "node", "m/s", "velocity"),
    **{name: Quantity("node", unit, f"length of the {name}", False, BOTH) for name, unit in LENGTHS.items()},
    **_vector("reaction", "node", "N/m", "force of conditions on the node", False),
    **_vector("unbalanced", "node", "N/m", "sum of all forces on the node, conditions included", False),
    "temperature": Quantity("node", "K", "temperature; NaN without a thermal model", dims=BOTH),
    **{
        one.name: Quantity("node", one.unit, f"{one.doc}; NaN without a model of it", dims=BOTH)
        for one in kinds().values()
    },
    "state": Quantity("joint", "1", "0 free, 1 intact, 2 past its peak, 3 broken", dims=BOTH),
    "mode": Quantity(
        "joint", "1", "mode of failure, from 1 (opening) to 2 (sliding); 0 if it is not broken", dims=BOTH
    ),
    "break_time": Quantity("joint", "s", "model time at which it broke; NaN if it is not broken", dims=BOTH),
    "break_energy": Quantity(
        "joint", "J/m", "kinetic energy of its two elements when it broke; NaN if it is not", dims=BOTH
    ),
    "damage": Quantity("joint", "1", "largest damage of its points, 0 to 1", dims=BOTH),
    "opening": Quantity("joint", "m", "mean opening, of broken joints and cracks too", dims=BOTH),
    "slip": Quantity("joint", "m", "mean slip, in space its size, of broken joints and cracks too", dims=BOTH),
    "normal_stress": Quantity("joint", "Pa", "mean normal stress, tension positive", dims=BOTH),
    "shear_stress": Quantity("joint", "Pa", "mean shear stress, in space its size", dims=BOTH),
    "normal_stress_largest": Quantity(
        "joint", "Pa", "largest normal stress of its three points, tension positive", dims=BOTH
    ),
    "shear_stress_largest": Quantity(
        "joint", "Pa", "largest shear stress of its three points, without sign", dims=BOTH
    ),
    **{
        f"{name}_stress_{point}": Quantity(
            "joint", "Pa", f"{name} stress at the {point} of its three points", False, BOTH
        )
        for name in ("normal", "shear")
        for point in ("first", "middle", "last")
    },
    "length": Quantity("joint", "m", "length in the mesh"),
    "joint_area": Quantity("joint", "m2", "area in the mesh", dims=(3,)),
}
"""Names that `values`, `total` and frames know. With `element_` or `joint_` before they are means of
corners. The points of a joint go from the first corner of the face that it is numbered by to the last, in space they
lie near its three corners; the laws are evaluated there."""

for _on, _names in (("element", ("position", "displacement", "velocity")), ("joint", ("position",))):
    for _name in _names:
        for _axis in "xyz":
            _of = QUANTITIES[f"{_name}_{_axis}"]
            QUANTITIES[f"{_on}_{_name}_{_axis}"] = Quantity(_on, _of.unit, f"mean {_name}", False, _of.dims)

_STRENGTH = {"cohesion": "element_cohesion", "tensile": "element_tensile", "dilation": "element_dilation"}
PROPERTIES = {
    "element": {
        _STRENGTH.get(p.name, p.name): p.name
        for m in (MECH_ISO_ELASTIC, MECH_MOHR_COULOMB, MECH_BURGERS)
        for p in m.properties
        if not p.name.startswith("kelvin_strain") and not p.internal  # that strain at a time is a quantity
    },
    "joint": {{"friction": "joint_friction"}.get(p.name, p.name): p.name for p in OF_JOINTS.properties},
}
"""Properties of elements and joints, by their names as quantities. Frames contain them if they differ between
objects."""
for _on, _models in (("element", (MECH_ISO_ELASTIC, MECH_MOHR_COULOMB, MECH_BURGERS)), ("joint", (OF_JOINTS,))):
    for _quantity, _name in PROPERTIES[_on].items():
        _model = next(m for m in _models if m.has(_name))
        QUANTITIES[_quantity] = Quantity(
            _on, _model.property(_name).unit, _model.property(_name).doc, False,
            BOTH,
        )  # fmt: skip

JOINT_SIZE = {2: "length", 3: "joint_area"}
"""Name of the quantity that is the size of a joint, by dimension."""
_MEANS = ("opening", "slip", "normal_stress", "shear_stress")
_AT_POINTS = tuple(f"{name}_stress_{point}" for name in ("normal", "shear") for point in ("first", "middle", "last"))


def probe(sim: Blocks, name: str, numbers: Numbers = None) -> Probe:
    """A quantity of these elements, nodes or joints (None: all), to be requested again and again. CommandError if
    there is no such quantity or number. Collective."""
    on = quantity(sim, name).on
    some = numbers_on(sim, on, numbers)
    if name.startswith(("reaction", "unbalanced")):
        return ForceProbe(sim, name, some)
    return _ColumnProbe(sim, name, on, some)


def values(sim: Blocks, name: str, numbers: Numbers = None) -> np.ndarray:
    """A quantity of `QUANTITIES` for these elements, nodes or joints (None: all, in ascending order), on all ranks.

    A point shows what the lowest of its corners has, a side what its corner has (of several at a point the lowest);
    forces are those of all its corners. One value for each point. NaN for what is not there
    (null elements, edges without joint). Collective."""
    return probe(sim, name, numbers).values()


def total(sim: Blocks, name: str, numbers: Numbers = None) -> float:
    """Exact sum of a quantity over elements, joints, or all corners of nodes (reaction_x: the whole support).
    Collective."""
    return probe(sim, name, numbers).total()


def quantity(sim: Blocks, name: str) -> Quantity:
    """The quantity of this name. CommandError if missing. Not collective."""
    if name not in QUANTITIES and name in user_laws.quantities(sim):
        return Quantity("element", user_laws.unit(name), "state variable of a user law")
    there = [one for one, about in QUANTITIES.items() if sim.dim in about.dims]
    if name not in there:
        plane = f" in {'two' if sim.dim == 2 else 'three'} dimensions" if name in QUANTITIES else ""
        raise CommandError(f"there is no quantity {name}{plane}; available: {', '.join(there)}")
    return QUANTITIES[name]


def numbers_on(sim: Blocks, on: str, numbers: Numbers) -> np.ndarray:
    """Checked numbers of elements, nodes (or their sides, sides.py) or joints; None: all. Collective."""
    sizes = {"element": len(sim.alive), "node": len(sim.the_mesh().points), "joint": len(sim.partner)}
    if numbers is not None:
        asked = np.asarray(numbers, np.int64).reshape(-1)
        there = sizes[on]
        if on == "node" and sides.are_there(asked):
            sim.numbers_of_nodes(asked[asked >= sides.SIDE])
            there = sides.SIDE + sizes["joint"]
        bad = asked[(asked < 0) | (asked >= there)]
        if len(bad):
            raise CommandError(f"there is no {on} {bad[0]}")
        return asked
    if on == "joint":
        return np.flatnonzero(sim.partner > np.arange(len(sim.partner)))
    return np.arange(sizes[on])


def owned_values(sim: Blocks, on: str, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Columns of this rank's elements, nodes (by their lowest corner) or joints (by their lower face), with their
    "number"; every number that is there is on one rank. on = "corner": position, displacement and velocity of every
    corner by itself, by element * 4 + k. For files (io.slabs.to_slabs). Collective."""
    sim.close_model()
    for name in names:
        belongs = quantity(sim, name).on
        of_corners = ("position", "displacement", "velocity", *DIFFUSING)
        if belongs != on and not (on == "corner" and name.startswith(of_corners)):
            raise CommandError(f"{name} belongs to a {belongs}, not to a {on}")
    made = _corner_columns(sim) if on == "corner" else columns_of(sim, on, names)
    return {"number": made["number"], **{name: made[name] for name in names}}


def columns_of(sim: Blocks, on: str, names: Sequence[str], at: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Columns of some of this rank's elements (at: the how-manieth of the owned ones), nodes (points) or joints
    (lower faces); at None: of all. With their "number", and perhaps more than was requested. Collective, but for
    single nodes and elements."""
    made = {"element": _element_columns, "node": _node_columns, "joint": _joint_columns}
    return made[on](sim, names, at)


def rows_of(sim: Blocks, on: str, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Select the numbers (n,) that this rank has, and their rows for `columns_of`. Not collective."""
    own = sim.owned
    if on == "node":
        lead = leads_of(sim, numbers)
        row = np.where(lead >= 0, sim.where[lead // 4], -1)
    elif on == "joint":
        row = sim.where[numbers // 4]
        row = np.where(sim.joint_exists()[numbers] & ((sim.joint_row[numbers] > 0) | sim.open[numbers]), row, -1)
    else:
        row = sim.where[numbers]
    mine = np.flatnonzero((row >= own.start) & (row < own.stop))
    return mine, row[mine] - own.start if on == "element" else numbers[mine]


def leads_of(sim: Blocks, numbers: np.ndarray) -> np.ndarray:
    """The lowest corner of elements that are there (n,) at each of these points, -1: none; of a side its corner. Not
    collective."""
    side = numbers >= sides.SIDE
    return np.where(side, numbers - sides.SIDE, sim.local.leads[np.where(side, 0, numbers)])


def one_each(sim: Blocks, numbers: np.ndarray) -> np.ndarray:
    """Select one number for each point of these nodes, ascending by point; of several sides, the lowest that is
    present. Not collective."""
    if not sides.are_there(numbers):
        return numbers
    cells = sim.the_mesh().cells.reshape(-1)
    numbers = np.sort(sides.present(cells, numbers, sim.alive))
    side = numbers >= sides.SIDE
    point = np.where(side, cells[np.where(side, numbers - sides.SIDE, 0)], numbers)
    return numbers[np.unique(point, return_index=True)[1]]


def _element_columns(sim: Blocks, names: Sequence[str], at: np.ndarray | None = None) -> dict[str, np.ndarray]:
    mesh, own, local = sim.the_mesh(), sim.owned, sim.local
    some = slice(None) if at is None else at
    number = sim.number[own][some]
    columns: dict[str, np.ndarray] = {"number": number.copy()}
    wanted = set(names)
    if any(name.startswith("stress_") for name in wanted) or "strain_energy" in wanted:
        stress, energy = local.stresses(at, "strain_energy" in wanted)
        for k, c in enumerate(COMPONENTS[sim.dim]):
            columns[f"stress_{c}"] = stress[:, k].copy()
        columns["stress_max"], columns["stress_min"] = _principal(stress)
        columns["strain_energy"] = energy
    if any(name.startswith(("element_", "kinetic")) for name in wanted):
        x, v, real = sim.x[own][some], sim.v[own][some], mesh.cells[number] >= 0
        n = real.sum(axis=1)
        for axis, along in enumerate("xyz"[: sim.dim]):
            for name, rows in (("position", x), ("velocity", v)):
                if f"element_{name}_{along}" in wanted:
                    columns[f"element_{name}_{along}"] = _mean(_corners(rows, real)[:, :, axis], real, n)
            if f"element_displacement_{along}" in wanted:
                gravity = _corners(x, real)[:, :, axis] - home_corners(sim, at)[:, :, axis]
                columns[f"element_displacement_{along}"] = _mean(gravity, real, n)
        if "kinetic_energy" in wanted:
            v2 = (_corners(v, real) ** 2).sum(axis=2)
            columns["kinetic_energy"] = 0.5 * np.where(real, local.masses.of_motion[own][some] * v2, 0.0).sum(axis=1)
    for field in (field for field in DIFFUSING if f"mean_{field}" in wanted):
        if len(mesh.hexes) and field in sim.cold:
            columns[f"mean_{field}"] = by_temperature.means(sim, field)[some]
        else:
            t, n = corners_of_field(sim, field)[some], connectivity.corner_counts(mesh.cells[number])
            columns[f"mean_{field}"] = _mean(t, np.arange(4) < n[:, None], n)
    for kind in kinds().values():
        found = next((load for load in sim.surface_loads if load.name == kind.name), None)
        for name in wanted & kind.derived.keys():
            columns[name] = np.full(len(number), np.nan) if found is None else getattr(found, name)()[some]
    if any(name.startswith("plastic") for name in wanted):
        columns |= _plastic_columns(sim, some)
    if any(name.startswith(("creep", "kelvin_strain")) for name in wanted):
        columns |= _creep_columns(sim, some)
    if of_laws := [name for name in wanted if name.startswith(user_laws.OF_LAW)]:
        memory = local.laws.states()
        columns |= {name: user_laws.values(sim, name, memory)[some] for name in of_laws}
    for name in wanted & PROPERTIES["element"].keys():
        columns[name] = sim.element_rows.column(PROPERTIES["element"][name])[sim.element_row[number]]
    columns["area" if sim.dim == 2 else "volume"] = sim.areas[number]
    columns["element_model"] = sim.element_row[number].astype(float)
    return columns


def _plastic_columns(sim: Blocks, some: slice | np.ndarray) -> dict[str, np.ndarray]:
    """Plastic state of elements; zero if an element never had a model that yields. An element yields now if it did in
    the last step or does at the present positions."""
    if "plastic" in sim.cold:
        memory = sim.local.yielding.columns(some)
    else:
        memory = np.zeros((sim.n_own, plasticity.MEMORY))[some]
    state = np.zeros(len(memory))
    for column, now, past in (
        (plasticity.IN_SHEAR, plasticity.SHEAR_NOW, plasticity.SHEAR_PAST),
        (plasticity.IN_TENSION, plasticity.TENSION_NOW, plasticity.TENSION_PAST),
    ):
        last = memory[:, column]
        state += np.where(last == 0.0, 0, np.where(last >= sim.clock.step, now, past))
    return {
        "plastic_state": state,
        "plastic_shear_strain": memory[:, plasticity.SHEAR].copy(),
        "plastic_volume_strain": memory[:, plasticity.VOLUME].copy(),
        "plastic_work": memory[:, plasticity.WORK].copy(),
    }


def _creep_columns(sim: Blocks, some: slice | np.ndarray) -> dict[str, np.ndarray]:
    """Creep state of elements at the present positions; zero if an element never had a model that creeps."""
    components = COMPONENTS[3] if sim.dim == 3 else ("xx", "yy", "xy")
    strains, lost = np.zeros((sim.n_own, 2 * len(components))), np.zeros(sim.n_own)
    if "creep" in sim.cold:
        strains, lost = sim.local.creeping.strains(), sim.local.creeping.lost()
    names = [f"{name}_{c}" for name in ("creep_strain", "kelvin_strain") for c in components]
    return {**dict(zip(names, strains[some].T.copy())), "creep_work": lost[some].copy()}


def _node_columns(sim: Blocks, names: Sequence[str], at: np.ndarray | None = None) -> dict[str, np.ndarray]:
    own = sim.owned
    points = rows_of(sim, "node", np.arange(len(sim.local.leads)))[1] if at is None else at
    lead = leads_of(sim, points)
    row, k = sim.where[lead // 4], lead % 4
    points = sim.the_mesh().cells.reshape(-1)[lead]
    columns: dict[str, np.ndarray] = {"number": points}
    home = sim.cold.get("home")
    stride = sim.local.stride
    for name in names:
        kind, _, axis = name.rpartition("_")
        c = "xyz".find(axis)
        if name in LENGTHS:
            parts = [f"{name}_{axis}" for axis in "xyz"[: sim.dim]]
            found = _node_columns(sim, parts, at)
            columns[name] = np.sqrt(sum(found[part] ** 2 for part in parts))
        elif name.startswith(("reaction", "unbalanced")):
            columns[name] = _whole_point(sim, name, points)
        elif name in DIFFUSING:
            columns[name] = corners_of_field(sim, name)[row - own.start, k]
        elif kind == "velocity":
            columns[name] = sim.v[row, stride * k + c]
        else:
            columns[name] = sim.x[row, stride * k + c]
            if kind == "displacement":
                before = sim.the_mesh().points[points, c] if home is None else home[row - own.start, stride * k + c]
                columns[name] -= before
    return columns


def _corner_columns(sim: Blocks) -> dict[str, np.ndarray]:
    own = sim.owned
    number = sim.number[own]
    real = sim.the_mesh().cells[number] >= 0
    i, k = np.nonzero(real)
    columns: dict[str, np.ndarray] = {"number": 4 * number[i] + k}
    place, speed, home = _corners(sim.x[own], real), _corners(sim.v[own], real), home_corners(sim)
    for c, axis in enumerate("xyz"[: sim.dim]):
        columns[f"position_{axis}"] = place[i, k, c]
        columns[f"displacement_{axis}"] = place[i, k, c] - home[i, k, c]
        columns[f"velocity_{axis}"] = speed[i, k, c]
    columns |= {name: corners_of_field(sim, name)[i, k] for name in DIFFUSING}
    return columns


def corners_of_field(sim: Blocks, name: str) -> np.ndarray:
    """(n_own, 4) temperatures, or values of another field of DIFFUSING, at the corners of the owned elements, NaN where
    there is no model of it. Not collective."""
    known, out = sim.cold.get(name), np.full((sim.n_own, 4), np.nan)
    if known is not None:
        out[:, : known.shape[1]] = known
    return out


def corner_values(sim: Blocks, name: str, corners: np.ndarray | None = None) -> np.ndarray:
    """(4 ne, 2), in space (4 ne, 3), position [m], displacement [m] or velocity [m/s] of every corner (element * 4 +
    k), on all ranks; NaN where missing. corners: only these, NaN for the others. Collective."""
    names = [f"{name}_{axis}" for axis in "xyz"[: sim.dim]]
    columns = owned_values(sim, "corner", names)
    rows = np.column_stack([columns["number"].astype(float), *(columns[one] for one in names)])
    if corners is not None:
        rows = rows[np.isin(columns["number"], corners)]
    out = np.full((len(sim.partner), sim.dim), np.nan)
    for part in sim.comm.allgather(rows) if sim.comm.size > 1 else [rows]:
        out[part[:, 0].astype(np.int64)] = part[:, 1:]
    return out


def _whole_point(sim: Blocks, name: str, points: np.ndarray) -> np.ndarray:
    """Force of all corners at these points, in the order of corners. Collective."""
    every = np.arange(len(sim.the_mesh().points))
    return probe(sim, name, every).values()[points]


def _joint_columns(sim: Blocks, names: Sequence[str], at: np.ndarray | None = None) -> dict[str, np.ndarray]:
    mesh, local = sim.the_mesh(), sim.local
    wanted = set(names)
    lower = local.lower_faces if at is None else at
    columns: dict[str, np.ndarray] = {"number": lower}
    slot = local.slot_of(lower)
    now = local.slot_state[slot]
    broken = sim.broken[lower] > 0
    path = local.slot_history[slot, PATH : PATH + 3].max(axis=1) if len(slot) else np.empty(0)
    torn = local.slot_history[slot, DAMAGE : DAMAGE + 3].max(axis=1) if len(slot) else np.empty(0)
    state = np.where(now > BROKEN, np.where(path > 0.0, YIELDED, INTACT), now)
    columns["state"] = np.where(broken, float(BROKEN), state)
    if wanted & {"mode", "break_time", "break_energy"}:
        columns |= _last_events(sim, lower, broken | (now == BROKEN))
    if "damage" in wanted:
        columns["damage"] = np.where(broken, 1.0, np.where(now == BROKEN + BARTON_BANDIS, 0.0, torn))
    held = np.flatnonzero(now != NONE)
    if set(_MEANS) & wanted:
        seen = np.full((len(lower), len(_MEANS)), np.nan)
        seen[held] = local.joint_means(slot[held])
        free = np.flatnonzero(sim.open[lower] & (now == NONE))
        if {"opening", "slip"} & wanted:
            seen[free, :2] = _gaps(sim, lower[free])
        columns |= {name: seen[:, k].copy() for k, name in enumerate(_MEANS)}
    if {*_AT_POINTS, "normal_stress_largest", "shear_stress_largest"} & wanted:
        seen = np.full((len(lower), len(_AT_POINTS)), np.nan)
        seen[held] = local.joint_points(slot[held])
        columns |= {name: seen[:, k].copy() for k, name in enumerate(_AT_POINTS)}
        columns["normal_stress_largest"] = seen[:, :3].max(axis=1)
        columns["shear_stress_largest"] = np.abs(seen[:, 3:]).max(axis=1)
    for name in PROPERTIES["joint"].keys() & wanted:
        columns[name] = sim.joint_rows.column(PROPERTIES["joint"][name])[sim.joint_row[lower]]
    if JOINT_SIZE[sim.dim] in wanted:
        columns[JOINT_SIZE[sim.dim]] = mesh.face_sizes(lower)
    places = {f"joint_position_{axis}": c for c, axis in enumerate("xyz"[: sim.dim])}
    if places.keys() & wanted:
        corners = mesh.face_corners(lower)
        row = sim.where[corners // 4]
        for name, c in places.items():
            columns[name] = sim.x[row, sim.stride * (corners % 4) + c].mean(axis=1)
    bare = sim.joint_row[lower] == 0
    for name in columns.keys() - {"number", "opening", "slip", *places} if bare.any() else ():
        columns[name] = np.where(bare, np.nan, columns[name])
    return columns


def _gaps(sim: Blocks, lower: np.ndarray) -> np.ndarray:
    """Mean opening and slip (n, 2) [m] of edges of which the faces are not connected, as joints have them
    (`joints.openings`, in space `joints_space.faces_now`): between the corners of one point. Collective."""
    mesh, flat = sim.the_mesh(), sim.the_mesh().cells.reshape(-1)
    mine, over = mesh.face_corners(lower), mesh.face_corners(sim.partner[lower])
    opposite = np.argmax(flat[mine][:, :, None] == flat[over][:, None, :], axis=2)
    here = _places_of(sim, mine)
    there = _places_of(sim, np.take_along_axis(over, opposite, axis=1))
    u, middle = (there - here).mean(axis=1), 0.5 * (here + there)
    t = middle[:, 1] - middle[:, 0]
    if sim.dim == 2:
        h = np.hypot(*t.T)
        return (
            np.column_stack([u[:, 0] * t[:, 1] - u[:, 1] * t[:, 0], u[:, 0] * t[:, 0] + u[:, 1] * t[:, 1]]) / h[:, None]
        )
    n = np.cross(t, middle[:, 2] - middle[:, 0])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    opening = (u * n).sum(axis=1)
    return np.column_stack([opening, np.linalg.norm(u - opening[:, None] * n, axis=1)])


def _places_of(sim: Blocks, corners: np.ndarray) -> np.ndarray:
    """Present positions of these corners (element * 4 + k) of present elements, one more axis: dim [m]; also of other
    ranks. Collective."""
    row, dim = sim.where[corners // 4], sim.dim
    at = sim.stride * (corners % 4)[..., None] + np.arange(dim)
    found = sim.x[row[..., None], at]
    lost = np.unique(corners[row < 0])
    if sim.comm.any(bool(len(lost))):
        asked = np.unique(np.concatenate(sim.comm.allgather(lost)))
        row = sim.where[asked // 4]
        mine = (row >= sim.owned.start) & (row < sim.owned.stop)
        known = sim.x[row[mine][:, None], sim.stride * (asked[mine] % 4)[:, None] + np.arange(dim)]
        places = np.empty((len(asked), dim))
        for number, values in sim.comm.allgather((asked[mine], known)):
            places[np.searchsorted(asked, number)] = values
        away = sim.where[corners // 4] < 0
        found[away] = places[np.searchsorted(asked, corners[away])]
    return found


def _last_events(sim: Blocks, lower: np.ndarray, broken: np.ndarray) -> dict[str, np.ndarray]:
    """Return mode, time and kinetic energy of the events in which these joints broke; `broken`: those that are.
    Collective."""
    rows = crack_rows(sim)
    last = np.full(len(sim.partner), -1, np.int64)
    last[[row.joint for row in rows]] = np.arange(len(rows))
    event = np.where(broken, last[lower], -1)
    table = np.array([(row.mode, row.time, row.kinetic) for row in rows] + [(0.0, np.nan, np.nan)])
    return dict(zip(("mode", "break_time", "break_energy"), table[event].T.copy()))


def homes(sim: Blocks, at: np.ndarray | None = None) -> np.ndarray:
    """Positions of zero displacement: (n_own, 8), in space (n_own, 16), corners [m], in the order of the owned
    elements; or of some of them. Not collective."""
    some = slice(None) if at is None else at
    if "home" in sim.cold:
        return sim.cold["home"][some]
    mesh = sim.the_mesh()
    cells = mesh.cells[sim.number[sim.owned][some]]
    found = np.where((cells >= 0)[:, :, None], mesh.points[cells], 0.0)
    return np.pad(found, ((0, 0), (0, 0), (0, sim.stride - sim.dim))).reshape(len(cells), 4 * sim.stride)


def home_corners(sim: Blocks, at: np.ndarray | None = None) -> np.ndarray:
    """The positions of `homes` by corners, (n_own, 4, 2) or (n_own, 4, 3)."""
    found = homes(sim, at)
    return found.reshape(len(found), 4, sim.stride)[:, :, : sim.dim]


def _principal(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest and smallest principal stress (n,) of stresses (n, 4): in the plane, or (n, 6)."""
    if stress.shape[1] == 4:
        mean, half = 0.5 * (stress[:, 0] + stress[:, 1]), 0.5 * (stress[:, 0] - stress[:, 1])
        radius = np.hypot(half, stress[:, 2])
        return mean + radius, mean - radius
    found, good = np.full((len(stress), 3), np.nan), np.isfinite(stress).all(axis=1)  # not all are in a last frame
    found[good], _ = principal(stress[good][:, [0, 2, 4, 2, 1, 5, 4, 5, 3]].reshape(-1, 3, 3))
    return found[:, 2].copy(), found[:, 0].copy()


# ---- contacts, events, balance ---------------------------------------------------------------------------------


def contacts(sim: Blocks) -> dict[str, np.ndarray]:
    """Touching pairs of this rank: element_1 < element_2, force_x, force_y [N/m] on element_1, x, y: middle of both
    [m]. Every pair is on one rank, the owner of element_1. In space element_1 has the face that touches, `face`, with
    force_z and z. Collective."""
    seen = sim.evaluate()
    if sim.dim == 3:
        return _contacts_in_space(sim, seen)
    pairs, own = sim.local.pairs, sim.owned
    out = seen.pair_force
    at = np.flatnonzero(seen.touching)
    row = pairs.row[pairs.first[at]]
    at = at[(row >= own.start) & (row < own.stop)]
    at, force = pairs.by_pairs(at, out[at])
    first, second = pairs.first[at], pairs.second[at]
    columns = {
        "element_1": pairs.element[first],
        "element_2": pairs.element[second],
        "body_1": pairs.number[first],
        "body_2": pairs.number[second],
        "force_x": force[:, 0:6:2].sum(axis=1),
        "force_y": force[:, 1:6:2].sum(axis=1),
    }
    flat = sim.x.reshape(-1)
    for c, axis in enumerate("xy"):
        ends = [flat[pairs.x_place[body] + 2 * k + c] for body in (first, second) for k in range(3)]
        columns[axis] = np.mean(ends, axis=0) if len(at) else np.empty(0)
    return columns


def _contacts_in_space(sim: Blocks, seen: Evaluation) -> dict[str, np.ndarray]:
    pairs: Any = sim.local.pairs
    own, at = sim.owned, np.flatnonzero(seen.touching)
    row = pairs.face_row[pairs.first[at]]
    at = at[(row >= own.start) & (row < own.stop)]
    first, second = pairs.first[at], pairs.second[at]
    force = seen.pair_force[at, :9].reshape(-1, 3, 3).sum(axis=1)
    flat = sim.x.reshape(-1)
    columns = {
        "element_1": pairs.face[first] // 4, "element_2": pairs.element[second], "face": pairs.face[first],
    }  # fmt: skip
    for c, axis in enumerate("xyz"):
        columns[f"force_{axis}"] = force[:, c].copy()
        columns[axis] = flat[pairs.corner[first] + c].mean(axis=1)
    return columns


def crack_rows(sim: Blocks) -> list[Crack]:
    """Joints broken so far, in order. Collective."""
    return [*sim.event_rows, *(breaks.waiting(sim) if sim.closed else [])]


def events(sim: Blocks) -> dict[str, np.ndarray]:
    """Joints broken so far, in order: joint, step, time [s], x, y of its middle in the mesh [m], mode (1 opened, 2
    slid; between: mixed), length [m], kinetic energy [J/m] of the two elements; peak_step, peak_kinetic: when it
    passed its strength. In space also z, and joint_area [m2] in place of length. Equal on all ranks. Collective."""
    return described(sim, crack_rows(sim))


def described(sim: Blocks, cracks: Sequence[Crack]) -> dict[str, np.ndarray]:
    """Columns of joints that broke, see `events`. Not collective."""
    mesh = sim.the_mesh()
    table = np.array(cracks, np.float64).reshape(-1, len(Crack._fields))
    found = {name: table[:, k].copy() for k, name in enumerate(Crack._fields)}
    for name in ("joint", "step", "peak_step"):
        found[name] = found[name].astype(np.int64)
    middles = mesh.points[mesh.face_points(found["joint"])].mean(axis=1)
    found |= {axis: middles[:, c].copy() for c, axis in enumerate("xyz"[: mesh.dim])}
    found[JOINT_SIZE[mesh.dim]] = mesh.face_sizes(found["joint"])
    return found


def joint_counts(sim: Blocks) -> tuple[int, int, int]:
    """Joints that are intact, have passed their peak, are broken. Collective."""
    sim.close_model()
    state = sim.local.slot_state[sim.local.lower_slots]
    state = np.where(state > BROKEN, INTACT, state)
    counts = np.bincount(state, minlength=BROKEN + 1)[[INTACT, YIELDED, BROKEN]].astype(np.int64)
    intact, yielded, broken = sim.comm.sum_into(counts).tolist()
    return intact, yielded, broken + int((sim.broken[sim.local.edges] == 1).sum())


def unbalanced_ratio(sim: Blocks) -> float:
    """Sum of |unbalanced| over sum of |contributing| forces at the nodes, of the present positions; 0 if missing
    but by rounding, see floors.py. Collective."""
    seen, local, own = sim.evaluate(), sim.local, sim.owned
    felt, outside = seen.felt[local.nodes.mine], seen.outside[local.nodes.mine]
    alone = seen.force[own].reshape(sim.n_own, 4, sim.stride)[local.nodes.alone].reshape(-1)
    of_loads = sim.surface_loads.balance()[0]
    unbalanced = np.concatenate([np.abs(felt[:, : sim.dim] + outside).reshape(-1), np.abs(alone), *of_loads])
    total = exact_sum(contributing(sim, seen), sim.comm)
    return floors.ratio(sim, exact_sum(unbalanced, sim.comm), total)


def contributing(sim: Blocks, seen: Evaluation) -> np.ndarray:
    """Sizes of the components of all forces on this rank's nodes [N/m]: stress, joints, contact and gravity on each
    corner, and what is applied from outside. Not collective."""
    local, own = sim.local, sim.owned
    felt = seen.felt[local.nodes.mine]
    stress = seen.force[own] - seen.of_joints[own]
    parts = [stress, seen.of_joints[own], felt[:, sim.dim :]]
    if len(local.pairs.rows):
        pushed = seen.pushed[: len(local.pairs.rows)]
        stress[local.pairs.rows - sim.n_left] -= pushed
        parts.append(pushed)
    o = sim.options
    if o.gx or o.gy or o.gz:
        gravity = np.array([o.gx, o.gy] if sim.dim == 2 else [o.gx, o.gy, o.gz, 0.0])
        pull = local.true_mass[own][:, :, None] * gravity
        real = sim.the_mesh().cells[sim.number[own]][:, :, None] >= 0
        pull = np.where(real, pull, 0.0).reshape(-1, local.force_width)
        stress -= pull
        parts.append(pull)
    return np.concatenate([np.abs(part).reshape(-1) for part in (*parts, *sim.surface_loads.balance()[1])])


def deep_overlaps(sim: Blocks) -> int:
    """Pairs of elements that overlap too deep now, if any ever did, see overlaps.py. Collective."""
    sim.close_model()
    return overlaps.count(sim, sim.local) if sim.rebuild_state.deep else 0


def critical_time_step(sim: Blocks) -> float:
    """Stability limit of the model as it is, times the safety factor [s]; infinite in static mode. Collective."""
    sim.close_model()
    return sim.local.masses.critical_time_step()


def added_mass(sim: Blocks) -> float:
    """Mass that mass scaling has added, over the true mass. Collective."""
    sim.close_model()
    return sim.local.masses.added() if sim.options.dynamic else 0.0


# ---- energy ----------------------------------------------------------------------------------------------------


def account_energy(sim: Blocks, on: bool = True) -> None:
    """Keep the energy budget from now on. In dynamic mode only. Collective."""
    if on and not sim.options.dynamic:
        raise CommandError("the energy budget needs dynamic mode: masses of the static mode are fictitious")
    if on and (laws := user_laws.in_use(sim)):
        raise CommandError(
            f"the energy budget does not support the law {laws[0].title} of {user_laws.some(sim)}, whose stored and "
            "lost energy is not known"
        )
    if on and sim.most_damped():
        raise CommandError("the energy budget does not support local damping of nodes (node mechanical-damp)")
    sim.open_model()
    sim.cold.pop("work", None)
    sim.budget = Budget() if on else None


def energies(sim: Blocks) -> dict[str, float]:
    """The energy budget [J/m], in space [J], since `account_energy`; CommandError without it. Collective.

    Stored now: kinetic, strain, joints (what they give back). Since the start: joints_lost (fracture and friction
    in joints), contact (stored or lost there), viscous_lost, plastic_lost, creep_lost, work_gravity, work_outside
    (loads and conditions), work_discs (particles that touch), work_bolts, work_liners, commands (change of what is
    stored by commands). closing: change of what is stored + lost - work - commands; relative: that over the largest
    of all.
    """
    if sim.budget is None:
        raise CommandError("no energy budget: switch it on before the steps that it should include")
    sim.close_model()
    budget = sim.budget
    return sim._once("budget", lambda: budget.reading(sim))


class _ColumnProbe(Probe):
    """A quantity that is a column of elements, nodes or joints."""

    def __init__(self, sim: Blocks, name: str, on: str, numbers: np.ndarray) -> None:
        super().__init__(sim, numbers)
        self.name, self.on = name, on
        self._rows = np.empty(0, np.int64)

    def _find(self) -> None:
        numbers = one_each(self.sim, self.numbers) if self.on == "node" else self.numbers
        self._at, self._rows = rows_of(self.sim, self.on, numbers)
        self._n = len(numbers)

    def _mine(self, seen: Evaluation | Local | None) -> np.ndarray:
        return columns_of(self.sim, self.on, [self.name], self._rows)[self.name]


def _corners(rows: np.ndarray, real: np.ndarray) -> np.ndarray:
    """(n, 4, 2) corners of rows of x or v, zero for the fourth of a triangle; in space (n, 4, 3)."""
    if rows.shape[1] == tets.ROW:
        return rows.reshape(len(rows), 4, tets.STRIDE)[:, :, :3]
    out = np.zeros((len(rows), 4, 2))
    count = 3 if rows.shape[1] < 12 else 4
    out[:, :count] = rows[:, : 2 * count].reshape(len(rows), count, 2)
    return np.where(real[:, :, None], out, 0.0)


def _mean(values: np.ndarray, real: np.ndarray, n: np.ndarray) -> np.ndarray:
    return np.where(real[:, : values.shape[1]], values, 0.0).sum(axis=1) / n
