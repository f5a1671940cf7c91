"""Looking at a model of blocks without touching it: quantities by number, forces, contacts, events, balance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.blocks.budget import Budget
from hpcdem.blocks.local import Evaluation
from hpcdem.blocks.scene import Numbers
from hpcdem.blocks.simulation import Core
from hpcdem.errors import CommandError
from hpcdem.model.blocks import connectivity
from hpcdem.physics.exact_sum import exact_sum
from hpcdem.physics.fdem import elements
from hpcdem.physics.fdem.joints import BROKEN, INTACT, NONE, YIELDED


@dataclass(frozen=True)
class Quantity:
    """One quantity that can be asked for by number: what it belongs to (element, node, joint), unit, meaning; framed:
    it stands in frames."""

    on: str
    unit: str
    doc: str
    framed: bool = True


def _pair(name: str, on: str, unit: str, doc: str) -> dict[str, Quantity]:
    return {f"{name}_{axis}": Quantity(on, unit, f"{doc} in {axis}") for axis in "xy"}


QUANTITIES: dict[str, Quantity] = {
    **{f"stress_{c}": Quantity("element", "Pa", f"stress {c}, tension positive") for c in ("xx", "yy", "xy", "zz")},
    "stress_max": Quantity("element", "Pa", "larger principal stress in the plane (more tensile)"),
    "stress_min": Quantity("element", "Pa", "smaller principal stress in the plane (more compressive)"),
    "kinetic_energy": Quantity("element", "J/m", "kinetic energy"),
    "strain_energy": Quantity("element", "J/m", "elastic energy"),
    "area": Quantity("element", "m2", "area in the mesh"),
    "element_model": Quantity("element", "1", "row of the table of element models"),
    **_pair("position", "node", "m", "position"),
    **_pair("displacement", "node", "m", "displacement"),
    **_pair("velocity", "node", "m/s", "velocity"),
    **_pair("reaction", "node", "N/m", "force by which conditions act on the node"),
    **_pair("unbalanced", "node", "N/m", "sum of all forces on the node, conditions included"),
    "state": Quantity("joint", "1", "0 free, 1 intact, 2 behind its peak, 3 broken"),
    "mode": Quantity("joint", "1", "how it broke, from 1 (opened) to 2 (slid); 0 if it is not broken"),
    "damage": Quantity("joint", "1", "largest damage of its points, 0 to 1"),
    "opening": Quantity("joint", "m", "mean opening"),
    "slip": Quantity("joint", "m", "mean slip"),
    "normal_stress": Quantity("joint", "Pa", "mean normal stress, tension positive"),
    "shear_stress": Quantity("joint", "Pa", "mean shear stress"),
    "normal_stress_largest": Quantity("joint", "Pa", "largest normal stress of its three points, tension positive"),
    "shear_stress_largest": Quantity("joint", "Pa", "largest shear stress of its three points, without sign"),
    **{
        f"{name}_stress_{point}": Quantity("joint", "Pa", f"{name} stress at the {point} of its three points", False)
        for name in ("normal", "shear")
        for point in ("first", "middle", "last")
    },
    "length": Quantity("joint", "m", "length in the mesh"),
}
"""Names that `Blocks.values`, `Blocks.total` and frames know. With `element_` or `joint_` before they are means of
corners. The points of a joint go from the first corner of the face that it is numbered by to the last; the laws are
evaluated there."""

for _on, _names in (("element", ("position", "displacement", "velocity")), ("joint", ("position",))):
    for _name in _names:
        for _axis in "xy":
            QUANTITIES[f"{_on}_{_name}_{_axis}"] = Quantity(
                _on, QUANTITIES[f"{_name}_{_axis}"].unit, f"mean {_name}", False
            )

_MEANS = ("opening", "slip", "normal_stress", "shear_stress")
_AT_POINTS = tuple(f"{name}_stress_{point}" for name in ("normal", "shear") for point in ("first", "middle", "last"))


class Looking(Core):
    """Verbs of `Blocks` that only look."""

    def evaluate(self) -> Evaluation:
        """Forces at the present positions; leaves everything as it is. Collective."""
        self.close_model()
        return self.local.evaluation()

    # ---- quantities ------------------------------------------------------------------------------------------------

    def values(self, name: str, numbers: Numbers = None) -> np.ndarray:
        """A quantity of `QUANTITIES` for these elements, nodes or joints (None: all, in ascending order), on all ranks.

        A node shows what the lowest of its corners has; forces are those of all its corners. NaN for what is not there
        (null elements, edges without joint). Collective."""
        on = self._quantity(name).on
        asked = self._numbers_on(on, numbers)
        size = {"element": len(self.alive), "node": len(self.the_mesh().points), "joint": len(self.partner)}[on]
        place = np.full(size, -1, np.int64)
        place[asked] = np.arange(len(asked))
        out = np.full(len(asked), np.nan)
        if name.startswith(("reaction", "unbalanced")):
            rows = self._corner_forces(name)
            rows = rows[place[rows[:, 0].astype(np.int64)] >= 0]
            rows = np.concatenate(self.comm.allgather(rows)) if self.comm.size > 1 else rows
            rows = rows[np.argsort(rows[:, 1], kind="stable")]
            out[:] = 0.0
            np.add.at(out, place[rows[:, 0].astype(np.int64)], rows[:, 2])
            return out
        columns = self.owned_values(on, [name])
        mine = place[columns["number"]] >= 0
        pairs = np.column_stack([columns["number"][mine].astype(float), columns[name][mine]])
        for rows in self.comm.allgather(pairs) if self.comm.size > 1 else [pairs]:
            out[place[rows[:, 0].astype(np.int64)]] = rows[:, 1]
        return out

    def total(self, name: str, numbers: Numbers = None) -> float:
        """Exact sum of a quantity over elements, joints, or all corners of nodes (reaction_x: the whole support).
        Collective."""
        on = self._quantity(name).on
        asked = self._numbers_on(on, numbers)
        flags = np.zeros(max(len(self.partner), len(self.the_mesh().points)), bool)
        flags[asked] = True
        if name.startswith(("reaction", "unbalanced")):
            rows = self._corner_forces(name)
            return exact_sum(rows[flags[rows[:, 0].astype(np.int64)], 2], self.comm)
        columns = self.owned_values(on, [name])
        values = columns[name][flags[columns["number"]]]
        return exact_sum(values[~np.isnan(values)], self.comm)

    def _quantity(self, name: str) -> Quantity:
        if name not in QUANTITIES:
            raise CommandError(f"there is no quantity {name}; there are {', '.join(QUANTITIES)}")
        return QUANTITIES[name]

    def _numbers_on(self, on: str, numbers: Numbers) -> np.ndarray:
        if on == "node":
            return self.numbers_of_nodes(numbers)
        if numbers is not None:
            asked = np.asarray(numbers, np.int64).reshape(-1)
            there = len(self.alive) if on == "element" else len(self.partner)
            bad = asked[(asked < 0) | (asked >= there)]
            if len(bad):
                raise CommandError(f"there is no {on} {bad[0]}")
            return asked
        if on == "element":
            return np.arange(len(self.alive))
        return np.flatnonzero(self.partner > np.arange(len(self.partner)))

    def owned_values(self, on: str, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Columns of this rank's elements, nodes (by their lowest corner) or joints (by their lower face), with their
        "number"; every number that is there is on one rank. on = "corner": position, displacement and velocity of every
        corner by itself, by element * 4 + k. For files (io.slabs.to_slabs). Collective."""
        self.close_model()
        for name in names:
            belongs = self._quantity(name).on
            if belongs != on and not (on == "corner" and name.startswith(("position", "displacement", "velocity"))):
                raise CommandError(f"{name} belongs to a {belongs}, not to a {on}")
        kinds = {
            "element": self._element_columns, "node": self._node_columns, "joint": self._joint_columns,
            "corner": self._corner_columns,
        }  # fmt: skip
        made = kinds[on](names)
        return {"number": made["number"], **{name: made[name] for name in names}}

    def _element_columns(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        mesh, own, local = self.the_mesh(), self.owned, self.local
        number, x, v = self.number[own], self.x[own], self.v[own]
        cells = mesh.cells[number]
        real = cells >= 0
        n = real.sum(axis=1)
        columns: dict[str, np.ndarray] = {"number": number.copy()}
        wanted = set(names)
        if wanted & {"stress_xx", "stress_yy", "stress_xy", "stress_zz", "stress_max", "stress_min", "strain_energy"}:
            stress, energy = local.stresses()
            for k, c in enumerate(("xx", "yy", "xy", "zz")):
                columns[f"stress_{c}"] = stress[:, k].copy()
            mean, half = 0.5 * (stress[:, 0] + stress[:, 1]), 0.5 * (stress[:, 0] - stress[:, 1])
            radius = np.hypot(half, stress[:, 2])
            columns["stress_max"], columns["stress_min"] = mean + radius, mean - radius
            columns["strain_energy"] = energy
        for axis, along in enumerate("xy"):
            for name, rows in (("position", x), ("velocity", v)):
                if f"element_{name}_{along}" in wanted:
                    columns[f"element_{name}_{along}"] = _mean(_corners(rows, real)[:, :, axis], real, n)
            if f"element_displacement_{along}" in wanted:
                way = _corners(x, real)[:, :, axis] - self.homes().reshape(-1, 4, 2)[:, :, axis]
                columns[f"element_displacement_{along}"] = _mean(way, real, n)
        if "kinetic_energy" in wanted:
            v2 = (_corners(v, real) ** 2).sum(axis=2)
            columns["kinetic_energy"] = 0.5 * np.where(real, local.mass[own] * v2, 0.0).sum(axis=1)
        columns["area"] = self.areas[number]
        columns["element_model"] = self.element_row[number].astype(float)
        return columns

    def _node_columns(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        own = self.owned
        lead = self.lead_corners()
        row = np.where(lead >= 0, self.where[lead // 4], -1)
        points = np.flatnonzero((row >= own.start) & (row < own.stop))
        row, k = row[points], lead[points] % 4
        columns: dict[str, np.ndarray] = {"number": points}
        homes = self.homes().reshape(-1, 4, 2)
        for c, axis in enumerate("xy"):
            columns[f"position_{axis}"] = self.x[row, 2 * k + c]
            columns[f"velocity_{axis}"] = self.v[row, 2 * k + c]
            columns[f"displacement_{axis}"] = self.x[row, 2 * k + c] - homes[row - own.start, k, c]
        for name in names:
            if name.startswith(("reaction", "unbalanced")):
                columns[name] = self._whole_point(name, points)
        return columns

    def _corner_columns(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        own = self.owned
        number = self.number[own]
        real = self.the_mesh().cells[number] >= 0
        i, k = np.nonzero(real)
        columns: dict[str, np.ndarray] = {"number": 4 * number[i] + k}
        place, speed, homes = _corners(self.x[own], real), _corners(self.v[own], real), self.homes().reshape(-1, 4, 2)
        for c, axis in enumerate("xy"):
            columns[f"position_{axis}"] = place[i, k, c]
            columns[f"displacement_{axis}"] = place[i, k, c] - homes[i, k, c]
            columns[f"velocity_{axis}"] = speed[i, k, c]
        return columns

    def _whole_point(self, name: str, points: np.ndarray) -> np.ndarray:
        """Force of all corners at these points, in the order of corners. Collective."""
        rows = self._corner_forces(name)
        rows = np.concatenate(self.comm.allgather(rows)) if self.comm.size > 1 else rows
        rows = rows[np.argsort(rows[:, 1], kind="stable")]
        out = np.zeros(len(self.the_mesh().points))
        np.add.at(out, rows[:, 0].astype(np.int64), rows[:, 2])
        return out[points]

    def _corner_forces(self, name: str) -> np.ndarray:
        """Rows (point, corner, force) of nodes that this rank reports: each node once, by the owner of its lowest
        corner. Collective."""
        seen, local, own, mesh = self.evaluate(), self.local, self.owned, self.the_mesh()
        axis = 0 if name.endswith("x") else 1
        lead = local.first_corners()
        row = self.where[lead // 4]
        mine = (row >= own.start) & (row < own.stop)
        lead = lead[mine]
        value = seen.outside[mine, axis]
        if name.startswith("unbalanced"):
            value = value + seen.felt[mine, axis]
            i, k = np.nonzero(local.alone())
            number = self.number[own][i]
            lead = np.concatenate([lead, 4 * number + k])
            value = np.concatenate([value, seen.force[own][i, 2 * k + axis]])
        point = mesh.cells[lead // 4, lead % 4]
        return np.column_stack([point.astype(float), lead.astype(float), value])

    def lead_corners(self) -> np.ndarray:
        """(np,) lowest corner (element * 4 + k) of elements that are there at each point, -1: none. Not collective."""
        cells = self.the_mesh().cells
        corner = np.arange(cells.size).reshape(cells.shape)
        use = (cells >= 0) & self.alive[:, None]
        out = np.full(len(self.the_mesh().points), -1, np.int64)
        out[cells[use][::-1]] = corner[use][::-1]
        return out

    def _joint_columns(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        mesh, own = self.the_mesh(), self.owned
        number = self.number[own]
        faces = (4 * number[:, None] + np.arange(4)).reshape(-1)
        lower = faces[(self.partner[faces] > faces) & (self.joint_row[faces] > 0)]
        local = self.local
        slot = local.slot_of(lower)
        columns: dict[str, np.ndarray] = {"number": lower}
        state = local.slot_state[slot].astype(float)
        memory = local.slot_memory[slot]
        broken = self.broken[lower] > 0
        state[broken] = BROKEN
        columns["state"] = state
        modes = dict((row[0], row[1]) for row in self.event_rows)
        columns["mode"] = np.array([modes.get(int(f), 0.0) for f in lower]) if broken.any() else np.zeros(len(lower))
        waiting = local.slot_state[slot] == BROKEN
        columns["mode"][waiting] = memory[waiting, 9]
        columns["damage"] = np.where(broken, 1.0, memory[:, 6:9].max(axis=1) if len(lower) else 0.0)
        held = np.flatnonzero(local.slot_state[slot] != NONE)
        if set(_MEANS) & set(names):
            seen = np.full((len(lower), len(_MEANS)), np.nan)
            seen[held] = local.joint_means(slot[held])
            columns |= {name: seen[:, k].copy() for k, name in enumerate(_MEANS)}
        if {*_AT_POINTS, "normal_stress_largest", "shear_stress_largest"} & set(names):
            seen = np.full((len(lower), len(_AT_POINTS)), np.nan)
            seen[held] = local.joint_points(slot[held])
            columns |= {name: seen[:, k].copy() for k, name in enumerate(_AT_POINTS)}
            columns["normal_stress_largest"] = seen[:, :3].max(axis=1)
            columns["shear_stress_largest"] = np.abs(seen[:, 3:]).max(axis=1)
        ends = connectivity.face_points(mesh.cells, lower)
        way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
        columns["length"] = np.hypot(way[:, 0], way[:, 1])
        if {"joint_position_x", "joint_position_y"} & set(names):
            row, k = self.where[lower // 4], lower % 4
            after = np.where(k + 1 < np.where(mesh.cells[lower // 4, 3] >= 0, 4, 3), k + 1, 0)
            for c, axis in enumerate("xy"):
                columns[f"joint_position_{axis}"] = 0.5 * (self.x[row, 2 * k + c] + self.x[row, 2 * after + c])
        return columns

    def homes(self) -> np.ndarray:
        """Where displacement is zero: (n_own, 8) corners [m], in the order of the owned elements. Not collective."""
        if "home" in self.cold:
            return self.cold["home"]
        mesh = self.the_mesh()
        cells = mesh.cells[self.number[self.owned]]
        return np.where((cells >= 0)[:, :, None], mesh.points[cells], 0.0).reshape(-1, 8)

    # ---- contacts, events, balance ---------------------------------------------------------------------------------

    def contacts(self) -> dict[str, np.ndarray]:
        """Touching pairs of this rank: element_1 < element_2, force_x, force_y [N/m] on element_1, x, y: middle of both
        [m]. Every pair is on one rank, the owner of element_1. Collective."""
        seen = self.evaluate()
        pairs, own = self.local.pairs, self.owned
        out = seen.pair_force
        at = np.flatnonzero(seen.touching)
        row = pairs.row[pairs.first[at]]
        at = at[(row >= own.start) & (row < own.stop)]
        first, second = pairs.first[at], pairs.second[at]
        columns = {
            "element_1": pairs.element[first],
            "element_2": pairs.element[second],
            "body_1": pairs.number[first],
            "body_2": pairs.number[second],
            "force_x": out[at, 0:6:2].sum(axis=1),
            "force_y": out[at, 1:6:2].sum(axis=1),
        }
        flat = self.x.reshape(-1)
        for c, axis in enumerate("xy"):
            ends = [flat[pairs.x_place[body] + 2 * k + c] for body in (first, second) for k in range(3)]
            columns[axis] = np.mean(ends, axis=0) if len(at) else np.empty(0)
        return columns

    def events(self) -> dict[str, np.ndarray]:
        """Joints broken so far, in order: joint, step, x, y of its middle in the mesh [m], mode (1 opened, 2 slid;
        between: mixed), length [m], kinetic energy [J/m] of the two elements. Equal on all ranks. Collective."""
        mesh = self.the_mesh()
        rows = [*self.event_rows, *(self.waiting_events() if self.closed else [])]
        joint = np.array([row[0] for row in rows], np.int64)
        ends = connectivity.face_points(mesh.cells, joint)
        a, b = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
        return {
            "joint": joint,
            "step": np.array([row[2] for row in rows], np.int64),
            "time": np.array([row[4] for row in rows]),
            "x": 0.5 * (a + b)[:, 0],
            "y": 0.5 * (a + b)[:, 1],
            "mode": np.array([row[1] for row in rows]),
            "length": np.hypot(*(b - a).T),
            "kinetic": np.array([row[3] for row in rows]),
        }

    def joint_counts(self) -> tuple[int, int, int]:
        """Joints that are intact, have passed their peak, are broken. Collective."""
        self.close_model()
        state, face = self.local.slot_state, self.local.slot_face
        lower = self.partner[face] > face
        counts = np.array([(state[lower] == kind).sum() for kind in (INTACT, YIELDED, BROKEN)], np.int64)
        intact, yielded, broken = self.comm.sum_into(counts).tolist()
        return intact, yielded, broken + int(self.broken.sum())

    def unbalanced_ratio(self) -> float:
        """Sum of |unbalanced| over sum of |contributing| forces at the nodes, of the present positions. Collective."""
        seen, local, own = self.evaluate(), self.local, self.owned
        lead = local.first_corners()
        row = self.where[lead // 4]
        mine = (row >= own.start) & (row < own.stop)
        felt, outside = seen.felt[mine], seen.outside[mine]
        i, k = np.nonzero(local.alone())
        alone = np.concatenate([seen.force[own][i, 2 * k], seen.force[own][i, 2 * k + 1]])
        unbalanced = np.concatenate([np.abs(felt[:, :2] + outside).reshape(-1), np.abs(alone)])
        total = exact_sum(self.contributing(seen), self.comm)
        return exact_sum(unbalanced, self.comm) / total if total != 0.0 else 0.0

    def contributing(self, seen: Evaluation) -> np.ndarray:
        """Sizes of the components of all forces on this rank's nodes [N/m]: stress, joints, contact and gravity on each
        corner, and what is applied from outside. Not collective."""
        local, own = self.local, self.owned
        lead = local.first_corners()
        row = self.where[lead // 4]
        felt = seen.felt[(row >= own.start) & (row < own.stop)]
        pushed = np.zeros((self.n_own, elements.FORCE))
        pushed[local.pairs.rows - self.n_left] = seen.pushed[: len(local.pairs.rows)]
        pull = local.true_mass[own][:, :, None] * np.array([self.options.gx, self.options.gy])
        pull = np.where(self.the_mesh().cells[self.number[own]][:, :, None] >= 0, pull, 0.0).reshape(-1, elements.FORCE)
        stress = seen.force[own] - seen.of_joints[own] - pushed - pull
        parts = (stress, seen.of_joints[own], pushed, pull, felt[:, 2:])
        return np.concatenate([np.abs(part).reshape(-1) for part in parts])

    def critical_time_step(self) -> float:
        """Stability limit of the model as it is, times the safety factor [s]; infinite in static mode. Collective."""
        self.close_model()
        return self.local.critical_time_step()

    def added_mass(self) -> float:
        """Mass that mass scaling has added, over the true mass. Collective."""
        self.close_model()
        own, local = self.owned, self.local
        if not self.options.dynamic:
            return 0.0
        true = exact_sum(local.true_mass[own], self.comm)
        return exact_sum(local.mass[own] - local.true_mass[own], self.comm) / true

    # ---- energy ----------------------------------------------------------------------------------------------------

    def account_energy(self, on: bool = True) -> None:
        """Keep the energy budget from now on. In dynamic mode only. Collective."""
        if on and not self.options.dynamic:
            raise CommandError("the energy budget is kept in dynamic mode: masses of the static mode are fictitious")
        self.open_model()
        self.cold.pop("work", None)
        self.budget = Budget() if on else None

    def energies(self) -> dict[str, float]:
        """The energy budget [J/m] since `account_energy`; CommandError without it. Collective.

        Stored now: kinetic, strain, joints (what they give back). Since the start: joints_lost (fracture and friction
        in joints), contact (stored or lost there), viscous_lost, work_gravity, work_outside (loads and conditions),
        work_discs (particles that touch), commands (change of what is stored by commands). closing: change of
        what is stored + lost - work - commands; relative: that over the largest of all.
        """
        if self.budget is None:
            raise CommandError("no energy budget is kept: ask for it before the steps that shall be in it")
        self.close_model()
        return self.budget.reading(self)


def _corners(rows: np.ndarray, real: np.ndarray) -> np.ndarray:
    """(n, 4, 2) corners of rows of x or v, zero for the fourth of a triangle."""
    out = np.zeros((len(rows), 4, 2))
    count = 3 if rows.shape[1] < 12 else 4
    out[:, :count] = rows[:, : 2 * count].reshape(len(rows), count, 2)
    return np.where(real[:, :, None], out, 0.0)


def _mean(values: np.ndarray, real: np.ndarray, n: np.ndarray) -> np.ndarray:
    return np.where(real[:, : values.shape[1]], values, 0.0).sum(axis=1) / n
