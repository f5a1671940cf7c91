"""Liners as a load on blocks: what is known of them, and their step (physics/fdem/structures.py)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.groups import LINER_ELEMENT, LINER_NODE
from hpcdem.physics.fdem.structures import FREE, Columns, Number, Structure, empty
from hpcdem.physics.liners import kernels
from hpcdem.physics.liners.beams import Beams
from hpcdem.physics.liners.elements import Elements
from hpcdem.physics.liners.properties import LINER
from hpcdem.physics.liners.shells import Shells

KINDS: dict[int, type[Elements]] = {2: Beams, 3: Shells}
"""Elements of liners, by dimensions of space."""


@dataclass(frozen=True)
class Condition:
    """Condition of nodes of liners: whether x, y, z and rotations about them (turn: about z, in the plane the only one)
    are led (structures.VELOCITY), at which velocity [m/s, rad/s]; forces [N] and moments [N m], in the plane per metre.
    See kernels.DOES for the order."""

    does_x: int = FREE
    at_x: Number = 0.0
    does_y: int = FREE
    at_y: Number = 0.0
    does_z: int = FREE
    at_z: Number = 0.0
    does_turn_x: int = FREE
    at_turn_x: Number = 0.0
    does_turn_y: int = FREE
    at_turn_y: Number = 0.0
    does_turn: int = FREE
    at_turn: Number = 0.0
    force_x: Number = 0.0
    force_y: Number = 0.0
    force_z: Number = 0.0
    moment_x: Number = 0.0
    moment_y: Number = 0.0
    moment: Number = 0.0


QUANTITIES: dict[str, dict[str, tuple[str, str]]] = {
    kind: {name: about for of in KINDS.values() for name, about in of.quantities[kind].items()}
    for kind in (LINER_NODE, LINER_ELEMENT)
}
for _kind, _known in QUANTITIES.items():
    for _name, (_unit, _doc) in _known.items():
        if _name not in Beams.quantities[_kind]:
            _known[_name] = _unit, f"in space: {_doc}"
        elif _name not in Shells.quantities[_kind]:
            _known[_name] = _unit, f"in the plane: {_doc}"
"""Quantities of nodes and elements of liners that can be queried, in the plane or in space: unit in the plane, and
meaning."""


class Liners(Structure):
    """All liners of a model of blocks, see `Structure`: an element for each free face of the rock they are on."""

    kind: Elements

    name: ClassVar[str] = "liners"
    kernel_kind: ClassVar[str] = "liners"
    word: ClassVar[str] = "liner"
    parts: ClassVar[tuple[str, str]] = (LINER_ELEMENT, LINER_NODE)
    quantities = QUANTITIES
    model = LINER
    held = "elements"
    at_rest: ClassVar[Mapping[str, int]] = {"condition": 0, "v": 0, "spin": 0, "reaction": 0}
    condition_type: ClassVar[type] = Condition
    flows = ("work_on_rock", "lost_in_beams", "lost_in_bond", "work_of_conditions", "work_of_gravity")

    @classmethod
    def node_columns(cls, dim: int) -> Columns:
        return KINDS[dim].of_nodes

    @classmethod
    def element_columns(cls, dim: int) -> Columns:
        return KINDS[dim].of_elements

    def ends(self) -> np.ndarray:
        """(m, 2), in space (m, 3) nodes of each element. Not collective."""
        return self.elements["ends"]

    def _known(self, kind: str) -> list[str]:
        return list(KINDS[self.blocks.dim].quantities[kind])

    # ---- what is given ----------------------------------------------------------------------------------------------

    def create(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Put a liner on free faces (k,) of the rock, where they are now, without any force in it; returns the numbers
        of its nodes and elements. Where faces or liners of before meet at a point of the mesh they are joined."""
        blocks, faces = self.blocks, np.unique(faces)
        self._check(faces)
        mesh, dim = blocks.the_mesh(), blocks.dim
        at = diagnostics.corner_values(blocks, "position")
        speed = diagnostics.corner_values(blocks, "velocity")
        laid = self.kind.lay(faces, mesh.face_points(faces), at[mesh.face_corners(faces)])
        faces, ends = faces[laid.order], laid.ends
        corner, m, n = mesh.face_corners(faces), len(faces), max(int(ends.max()) + 1 - len(self), 0)
        elements, new = empty(self.element_columns(dim), m), empty(self.node_columns(dim), n)
        sums, count = np.zeros((n, 2 * dim)), np.zeros(n)
        for side in range(ends.shape[1]):
            mine = ends[:, side] >= len(self)
            row = ends[mine, side] - len(self)
            np.add.at(sums, row, np.concatenate([at[corner[mine, side]], speed[corner[mine, side]]], axis=1))
            np.add.at(count, row, 1.0)
        mean = sums / count[:, None]
        new["x"][:], new["origin"][:], new["v"][:] = mean[:, :dim], mean[:, :dim], mean[:, dim:]
        elements["ends"][:], elements["face"][:], elements["host"][:] = ends, faces, faces // 4
        elements["point"][:] = at[corner].reshape(m, -1)
        self.kind.begin(laid, new, elements)
        numbers = self._add(new, elements)
        if blocks.log is not None and laid.parted:
            blocks.log.info(
                f"{laid.parted} {self.kind.parted_at} of the mesh divide the liner: the rock is open there, or more "
                "than two faces meet"
            )
        return numbers

    def _check(self, faces: np.ndarray) -> None:
        """Raise CommandError unless these faces are free and have no liner yet."""
        blocks = self.blocks
        partner = blocks.partner[faces]
        beside = (partner >= 0) & blocks.alive[partner // 4]
        if beside.any():
            raise CommandError(
                f"face {faces[beside][0]} is not free ({int(beside.sum())} in all): liners need free faces, select "
                "them with range boundary"
            )
        taken = np.isin(faces, self.elements["face"][self.alive(LINER_ELEMENT) & (self.elements["host"] >= 0)])
        if taken.any():
            raise CommandError(f"face {faces[taken][0]} has a liner already ({int(taken.sum())} in all)")

    def assign(self, elements: np.ndarray, given: Mapping[str, float]) -> None:
        """Give elements (k,) properties. Those that have some take the new ones: what they carry stays."""
        blocks, beams = self.blocks, self.elements
        for name in given:
            if LINER.has(name) and blocks.dim not in LINER.property(name).dims:
                raise CommandError(f"in space a liner is a shell with a thickness: it has no {name}")
        values = LINER.complete(given)
        blocks.before_change()
        with self._booked():
            self._take_properties(elements, values)
            area = self.kind.areas(elements)[:, None]
            beams["gap"][elements] = -beams["pressure"][elements] / (values["normal_stiffness"] * area)
            if values["shear_stiffness"] == 0.0:
                beams["shear"][elements] = 0.0
        blocks.changed()

    def stop(self) -> None:
        """Velocities become zero. Not collective."""
        super().stop()
        self.nodes["spin"][:] = 0.0

    # ---- queries -----------------------------------------------------------------------------------------------------

    def _node_value(self, name: str) -> np.ndarray:
        stem, _, axis = name.rpartition("_")
        if stem == "reaction_moment":
            return self.nodes["reaction"][:, self.blocks.dim + "xyz".find(axis)].copy()
        found = self._vector(name)  # also reaction_moment of the plane: the last one
        return self.kind.node_value(name) if found is None else found

    def _element_value(self, name: str) -> np.ndarray:
        beams = self.elements
        area = self.kind.areas(np.arange(len(beams["row"])))[:, None]
        match name:
            case "liner_state":
                return beams["state"].copy()
            case "bond_pressure":
                return (beams["pressure"] / area).mean(axis=1)
            case "bond_shear":
                return _sizes(beams["shear"], self.blocks.dim, area).mean(axis=1)
            case "gap":
                return beams["gap"].max(axis=1)
            case "slip":
                found = _sizes(beams["slip"], self.blocks.dim)
                at = np.abs(found).argmax(axis=1)
                return found[np.arange(len(at)), at]
            case "bond_state":
                return np.bitwise_or.reduce(beams["bond_state"], axis=1)
            case "host":
                return beams["host"].copy()
        return self.kind.element_value(name)

    def columns(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns of frames: "nodes" with the number of their liner, "elements" with their nodes. Not collective."""
        found = super().columns()
        return {
            "nodes": {"liner": self.nodes["liner"].copy(), **found["nodes"]},
            "elements": {**self.kind.ends_by_name(), **found["elements"]},
        }

    def _half_step(self, dt: float) -> np.ndarray:
        out, dim, nodes, time = np.zeros(kernels.WORK), self.blocks.dim, self.nodes, self.blocks.time_now()
        if self._dynamic:
            force = self._conditions_at(time, time)[:, kernels.FORCE + self.kind.parts]
            force = np.where(self._led(), force - self._total, force)
            path = 0.5 * dt * np.column_stack([nodes["v"], nodes["spin"]])
            weight = self._node_table[:, kernels.WEIGHT : kernels.WEIGHT + dim]
            out[kernels.BY_CONDITIONS] = math.fsum((force * path).reshape(-1).tolist())
            out[kernels.BY_GRAVITY] = math.fsum((weight * path[:, :dim]).reshape(-1).tolist())
        return out

    def _stored(self) -> float:
        parts = [self.kind.stored()]
        for force, column in (("pressure", kernels.ACROSS), ("shear", kernels.ALONG)):
            k = self._point_table[:, column]
            squares = (self.elements[force].reshape(len(k), -1) ** 2).sum(axis=1)
            parts.append(np.divide(squares, 2.0 * k, out=np.zeros(len(k)), where=k > 0.0))
        if self._dynamic:
            self._set_masses()
            parts.append(self._kinetic(self.blocks.clock.dt))
        return math.fsum(np.concatenate(parts).tolist())

    def _kinetic(self, dt: float) -> np.ndarray:
        nodes, table = self.nodes, self._node_table
        v = np.column_stack([nodes["v"], nodes["spin"]])
        turns = [kernels.INERTIA] * (v.shape[1] - self.blocks.dim)
        mass = table[:, [*[kernels.MASS] * self.blocks.dim, *turns]]
        kick = np.divide(dt * self._total, mass, out=np.zeros_like(v), where=(mass > 0.0) & ~self._led())
        return (0.5 * mass * v * (v + kick)).sum(axis=1)

    def _led(self) -> np.ndarray:
        """(n, components of nodes) bool: prescribed velocities."""
        return self._does()[:, self.kind.parts]

    # ---- tables of the kernels -------------------------------------------------------------------------------------

    def _arrange(self) -> None:
        beams, dim = self.elements, self.blocks.dim
        self.kind = KINDS[dim](self)
        n, m, k = len(self), len(beams["row"]), self.kind.corners
        there = self.alive(LINER_ELEMENT)
        self._bound = np.repeat((beams["host"] >= 0) & there, k)
        self._corner = (
            self.blocks.the_mesh().face_corners(beams["face"]).reshape(-1) % 4 if m else np.empty(0, np.int64)
        )
        self._frame, self._on_rock = np.zeros((k * m, dim, dim)), np.zeros((k * m, dim))
        self._total, self._step = np.zeros((n, len(self.kind.parts))), np.zeros((n, dim))
        self._rock = np.zeros((k * m, dim))
        mass, turning, stiff, turns = self.kind.arrange()
        area = np.repeat(self.kind.areas(np.arange(m)), k)
        bond = np.zeros((k * m, 5))
        for column, name in (
            (kernels.ACROSS, "normal_stiffness"), (kernels.ALONG, "shear_stiffness"),
            (kernels.BOND_TENSION, "bond_tensile_strength"), (kernels.COHESION, "bond_cohesion"),
        ):  # fmt: skip
            bond[:, column] = np.where(self._bound, np.repeat(self._column(name), k) * area, 0.0)
        bond[:, kernels.FRICTION] = np.repeat(np.tan(np.radians(self._column("bond_friction"))), k)
        self._point_table = bond
        self._true_mass, self._true_inertia, self._stiffness, self._turning = (np.zeros(n) for _ in range(4))
        for side in range(k):
            spring = np.maximum(bond[side::k, kernels.ACROSS], bond[side::k, kernels.ALONG])
            for out, part in (
                (self._true_mass, mass), (self._true_inertia, turning), (self._stiffness, stiff[:, side] + spring),
                (self._turning, turns[:, side]),
            ):  # fmt: skip
                np.add.at(out, beams["ends"][:, side], part)
        self._node_table = np.zeros((n, kernels.WEIGHT + 3))
        self._node_table[:, kernels.MASS], self._node_table[:, kernels.INERTIA] = self._true_mass, self._true_inertia
        self._prepared_for = None
        self._mine, self._rows = np.empty(0, np.int64), np.empty(0, np.int64)
        if n:
            self.kind.frames(self._frame)
            self._find_forces()

    def _weigh(self, factor: float, true: float) -> tuple[np.ndarray, str]:
        """Rotational inertias too, with the rows of the stiffness of elements by Gershgorin (`Elements.arrange`) and
        twice that of the bond."""
        table = self._node_table
        table[:, kernels.MASS] = np.maximum(true * self._true_mass, factor * self._stiffness)
        table[:, kernels.INERTIA] = np.maximum(true * self._true_inertia, factor * self._turning)
        raised = table[:, kernels.INERTIA] > self._true_inertia
        more = f", and raises the rotational inertia of {int(raised.sum())}" if raised.any() else ""
        return table[:, kernels.MASS], more

    def _find_forces(self) -> None:
        time, o = self.blocks.time_now(), self.blocks.options
        self._node_table[:, kernels.WEIGHT :] = self._true_mass[:, None] * np.array([o.gx, o.gy, o.gz])
        kernels.given(
            self._conditions_at(time, time), self._node_table, self.kind.parts, self.blocks.dim, self._total,
            self._on_rock,
        )  # fmt: skip
        self.kind.push(self._frame, self._total, self._on_rock)

    # ---- called by the blocks ----------------------------------------------------------------------------------------

    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: corners of the owned elements that a liner is bound to."""
        out = np.zeros((blocks.n_own, 4), bool)
        at, rows = self._held_here()
        out[rows - blocks.n_left, self._corner[at]] = True
        return out

    def springs(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) stiffness [N/m per m] that the bond brings to these corners."""
        out = np.zeros((blocks.n_own, 4))
        at, rows = self._held_here()
        k = self._point_table[at]
        stiff = np.maximum(k[:, kernels.ACROSS], k[:, kernels.ALONG])
        np.add.at(out, (rows - blocks.n_left, self._corner[at]), stiff)
        return out

    def _hosts(self) -> np.ndarray:
        return np.where(self._bound, np.repeat(self.elements["host"], self.kind.corners), -1)

    def add_to(self, applied: np.ndarray) -> None:
        """Forces on the rock at the present positions, in the order of elements [N/m]."""
        kernels.add(self._mine, self._rows, self._corner, self._on_rock, self.blocks.stride, applied)

    def _seen(self) -> np.ndarray:
        """Return the position of the rock at each point [m]."""
        seen = np.zeros_like(self._on_rock)
        kernels.host_points(self._mine, self._rows, self._corner, self.blocks.x, self.blocks.stride, seen)
        return seen

    def _move(self, seen: np.ndarray, conditions: np.ndarray, alpha: float, work: np.ndarray) -> None:
        nodes, beams, dt = self.nodes, self.elements, self.blocks.clock.dt
        point = beams["point"].reshape(seen.shape)
        self._rock[:] = np.where(self._bound[:, None], seen - point, 0.0)
        point[self._bound] = seen[self._bound]
        kernels.move(
            nodes["x"], nodes["v"], nodes["spin"].reshape(len(self), -1), self.kind.parts, self._total, conditions,
            self._node_table, dt, alpha, nodes["reaction"], self._step, work,
        )  # fmt: skip
        self.kind.turn(dt)
        gap, pressure, bond_state = (beams[name].reshape(-1) for name in ("gap", "pressure", "bond_state"))
        slip, shear = (beams[name].reshape(len(gap), -1) for name in ("slip", "shear"))
        kernels.bond(
            beams["ends"], self._frame, beams["state"], self._bound, self._point_table, self._step, self._rock, gap,
            slip, pressure, shear, bond_state, work,
        )  # fmt: skip
        self.kind.bend(work)
        self.kind.frames(self._frame)

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Unbalanced and contributing forces [N/m] at all nodes that move by themselves, moments over the length of the
        elements, on the first rank. Not collective."""
        if self.blocks.comm.rank > 0 or not len(self):
            return np.empty(0), np.empty(0)
        beams, size = self.elements, self.kind.largest_at_nodes(self.kind.sizes())
        unbalanced = np.abs(self._total)
        unbalanced[:, self.blocks.dim :] /= size[:, None]
        parts = [*self.kind.contributing(), *(np.abs(beams[name]) for name in ("pressure", "shear"))]
        parts.append(np.abs(self._node_table[:, kernels.WEIGHT : kernels.WEIGHT + self.blocks.dim]))
        return unbalanced[~self._led()], np.concatenate([part.reshape(-1) for part in parts])

    def _unbind(self, lost: np.ndarray) -> None:
        beams = self.elements
        beams["host"][lost] = -1
        for name in ("pressure", "shear"):
            beams[name][lost] = 0.0
        beams["bond_state"][lost] &= ~(kernels.SLIPS | kernels.OPEN)

    def _let_go(self, elements: np.ndarray) -> None:
        self._unbind(elements)
        self.elements["force"][elements] = 0.0


def _sizes(vectors: np.ndarray, dim: int, over: np.ndarray | float = 1.0) -> np.ndarray:
    """(m, k) of k vectors along the rock each, over some areas: in the plane with their sign, in space the length."""
    along = vectors.reshape(len(vectors), -1, dim - 1) / np.asarray(over)[..., None]
    return along[..., 0] if dim == 2 else np.sqrt((along**2).sum(axis=2))
