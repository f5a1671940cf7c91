"""Liners as a load on blocks: what is known of them, and their step (physics/fdem/structures.py)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.connectivity import corner_counts, face_points
from hpcdem.physics.fdem.groups import LINER_ELEMENT, LINER_NODE
from hpcdem.physics.fdem.local import ALPHA
from hpcdem.physics.fdem.structures import FREE, MARGIN, REMOVED, Columns, Number, Structure, empty
from hpcdem.physics.liners import kernels, layout
from hpcdem.physics.liners.properties import LINER

ROTARY = 1.0 / 78.0
"""Rotational inertia of half a beam over m L^2, m: its mass; the diagonal of the consistent mass matrix, scaled so that
the translations have all of it (Hinton, Rock and Zienkiewicz 1976)."""


@dataclass(frozen=True)
class Condition:
    """What is prescribed at nodes of liners: whether x, y and the rotation are led (structures.VELOCITY), at which
    velocity [m/s, rad/s]; forces [N/m] and moment [N m/m]."""

    does_x: int = FREE
    at_x: Number = 0.0
    does_y: int = FREE
    at_y: Number = 0.0
    does_turn: int = FREE
    at_turn: Number = 0.0
    force_x: Number = 0.0
    force_y: Number = 0.0
    moment: Number = 0.0


QUANTITIES: dict[str, dict[str, tuple[str, str]]] = {
    LINER_NODE: {
        "position_x": ("m", "position in x"),
        "position_y": ("m", "position in y"),
        "displacement_x": ("m", "displacement in x since it was installed"),
        "displacement_y": ("m", "displacement in y since it was installed"),
        "velocity_x": ("m/s", "velocity in x"),
        "velocity_y": ("m/s", "velocity in y"),
        "rotation": ("rad", "rotation since it was installed"),
        "spin": ("rad/s", "rate of rotation"),
        "reaction_x": ("N/m", "force in x by which conditions act"),
        "reaction_y": ("N/m", "force in y by which conditions act"),
        "reaction_moment": ("N m/m", "moment by which conditions act"),
        "distance": ("m", "distance along the liner from its first node, as installed"),
    },
    LINER_ELEMENT: {
        "axial_force": ("N/m", "axial force, tension positive"),
        "shear_force": ("N/m", "change of the moment along the element"),
        "moment_first": ("N m/m", "moment at its first node, positive with tension on the side away from the rock"),
        "moment_last": ("N m/m", "the same at its last node"),
        "axial_strain": ("1", "lengthening since it was installed, over its length"),
        "plastic_strain": ("1", "plastic part of it"),
        "plastic_rotation": ("rad", "larger plastic rotation of its ends, without sign"),
        "liner_state": ("1", "yields in tension 1, in compression 2, in bending 4; has yielded 8; deleted 32"),
        "bond_pressure": ("Pa", "pressure between rock and liner, tension negative"),
        "bond_shear": ("Pa", "shear stress of the bond on the liner, along it"),
        "gap": ("m", "opening between rock and liner, the larger of both ends; below 0: pressed together"),
        "slip": ("m", "slip of the liner on the rock, the larger of both ends"),
        "bond_state": ("1", "of one of its ends: slips 1, has slipped 2, has parted 4, is open 8"),
        "host": ("1", "element that it is bound to, -1: none"),
    },
}
"""What can be asked of nodes and elements of liners: unit and meaning."""

_NODES: Columns = {
    "liner": (np.int64, 0), "condition": (np.int64, 0), "arc": (np.float64, 0), "turn": (np.float64, 0),
    "spin": (np.float64, 0), "x": (np.float64, 2), "v": (np.float64, 2), "origin": (np.float64, 2),
    "reaction": (np.float64, 3),
}  # fmt: skip
"""Columns of the nodes. liner: which chain; arc: distance along it [m]; turn, spin: rotation and its rate."""
_ELEMENTS: Columns = {
    "row": (np.int64, 0), "state": (np.int64, 0), "ends": (np.int64, 2), "face": (np.int64, 0), "host": (np.int64, 0),
    "length": (np.float64, 0), "angle": (np.float64, 0), "form": (np.float64, 3), "force": (np.float64, 3),
    "plastic": (np.float64, 3), "point": (np.float64, 4), "gap": (np.float64, 2), "slip": (np.float64, 2),
    "pressure": (np.float64, 2), "shear": (np.float64, 2), "bond_state": (np.int64, 2),
}  # fmt: skip
"""Columns of the elements. row: of the properties, 0: none yet; face: it was put on; host: element of this face, -1: it
is gone; length, angle: as installed; form, force, plastic: see kernels.bend; point: where the rock is at both ends [m];
the rest: the bond at both ends, see kernels.bond."""


class Liners(Structure):
    """All liners of a model of blocks, see `Structure`: an element for each free face of the rock they are on."""

    name: ClassVar[str] = "liners"
    kernel_kind: ClassVar[str] = "liners"
    word: ClassVar[str] = "liner"
    parts: ClassVar[tuple[str, str]] = (LINER_ELEMENT, LINER_NODE)
    quantities = QUANTITIES
    of_nodes: ClassVar[Columns] = _NODES
    of_elements: ClassVar[Columns] = _ELEMENTS
    model = LINER
    condition_type: ClassVar[type] = Condition
    flows: ClassVar[int] = kernels.WORK

    def ends(self) -> np.ndarray:
        """(m, 2) nodes of each element. Not collective."""
        return self.elements["ends"]

    # ---- what is said ----------------------------------------------------------------------------------------------

    def create(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Put a liner on free faces (k,) of the rock, where they are now, without any force in it; returns the numbers
        of its nodes and elements. Where faces or liners of before meet at a point of the mesh they are joined."""
        blocks, faces = self.blocks, np.unique(faces)
        self._check(faces)
        cells = blocks.the_mesh().cells
        e, k = np.divmod(faces, 4)
        corner = 4 * e[:, None] + np.column_stack([k, (k + 1) % corner_counts(cells[e])])
        at = diagnostics.corner_values(blocks, "position")
        speed = diagnostics.corner_values(blocks, "velocity")
        points = face_points(cells, faces)
        order, goes_on, old, parted = layout.chained(points, at[corner], self._open_ends(), self.nodes["x"])
        faces, points, corner, m = faces[order], points[order], corner[order], len(faces)
        ends = self._numbered(goes_on, old, layout.closing(points, goes_on))
        n = int(ends.max()) + 1 - len(self)
        beams, new = empty(_ELEMENTS, m), empty(_NODES, n)
        sums, count = np.zeros((n, 4)), np.zeros(n)
        for side in (0, 1):
            mine = ends[:, side] >= len(self)
            row = ends[mine, side] - len(self)
            np.add.at(sums, row, np.concatenate([at[corner[mine, side]], speed[corner[mine, side]]], axis=1))
            np.add.at(count, row, 1.0)
        mean = sums / count[:, None]
        new["x"][:], new["origin"][:], new["v"][:] = mean[:, :2], mean[:, :2], mean[:, 2:]
        x = np.concatenate([self.nodes["x"], new["x"]])
        turn = np.concatenate([self.nodes["turn"], new["turn"]])
        way = x[ends[:, 1]] - x[ends[:, 0]]
        length = np.hypot(way[:, 0], way[:, 1])
        beams["ends"][:], beams["face"][:], beams["host"][:] = ends, faces, faces // 4
        beams["length"][:], beams["angle"][:] = length, [math.atan2(y, x) for x, y in way.tolist()]
        beams["form"][:] = np.column_stack([length, turn[ends]])
        beams["point"][:] = at[corner].reshape(-1, 4)
        chain = int(self.nodes["liner"].max(initial=-1)) + np.cumsum(~goes_on)
        arc = 0.0
        for i in range(m):
            arc = arc if goes_on[i] else 0.0
            for side in (0, 1):
                row = ends[i, side] - len(self)
                if row >= 0 and (side or not goes_on[i]) and not (side and row == ends[0, 0] - len(self)):
                    new["liner"][row], new["arc"][row] = chain[i], arc + side * length[i]
            arc += length[i]
        first = ends[~goes_on, 0] - len(self)
        new["arc"][first[first >= 0]] = 0.0  # also of closed ones
        numbers = np.arange(len(self), len(self) + n), len(self.elements["row"]) + np.arange(m)
        blocks.before_change()
        self.nodes = {name: np.concatenate([before, new[name]]) for name, before in self.nodes.items()}
        self.elements = {name: np.concatenate([before, beams[name]]) for name, before in self.elements.items()}
        self._arrange()
        blocks.changed()
        if blocks.log is not None and parted:
            blocks.log.info(
                f"{parted} points of the mesh part the liner: the rock is open there, or more than two faces meet"
            )
        return numbers

    def _check(self, faces: np.ndarray) -> None:
        """CommandError unless these faces are free and bear no liner yet."""
        blocks = self.blocks
        partner = blocks.partner[faces]
        beside = (partner >= 0) & blocks.alive[partner // 4]
        if beside.any():
            raise CommandError(
                f"face {faces[beside][0]} is not free, an element lies beside it ({int(beside.sum())} in all): a liner "
                "goes on free faces, range boundary chooses them"
            )
        taken = np.isin(faces, self.elements["face"][self.alive(LINER_ELEMENT) & (self.elements["host"] >= 0)])
        if taken.any():
            raise CommandError(f"face {faces[taken][0]} has a liner already ({int(taken.sum())} in all)")

    def _open_ends(self) -> dict[int, tuple[list[int], list[int]]]:
        """By point of the mesh, the nodes at which a liner ends and those at which one begins, that have no neighbour
        on the other side."""
        beams = self.elements
        there = np.flatnonzero(self.alive(LINER_ELEMENT) & (beams["host"] >= 0))
        points, ends = face_points(self.blocks.the_mesh().cells, beams["face"][there]), beams["ends"]
        in_use = ends[self.alive(LINER_ELEMENT)]
        found: dict[int, tuple[list[int], list[int]]] = {}
        for side in (1, 0):
            alone = ~np.isin(ends[there, side], in_use[:, 1 - side])
            for point, node in zip(points[alone, side].tolist(), ends[there[alone], side].tolist(), strict=True):
                found.setdefault(point, ([], []))[1 - side].append(node)
        return found

    def _numbered(self, goes_on: np.ndarray, old: list[tuple[int, int]], closed: list[tuple[int, int]]) -> np.ndarray:
        """(m, 2) nodes of new elements in the order of their chains; old: ends that have a node already; closed: first
        and last element of chains that come back to their beginning."""
        known, last = dict(old), {last: first for first, last in closed}
        ends, following = np.empty((len(goes_on), 2), np.int64), len(self)
        for i, on in enumerate(goes_on.tolist()):
            for side in (0, 1):
                if side == 0 and on:
                    ends[i, 0] = ends[i - 1, 1]
                elif 2 * i + side in known:
                    ends[i, side] = known[2 * i + side]
                elif side == 1 and i in last and 2 * last[i] not in known:
                    ends[i, 1] = ends[last[i], 0]
                else:
                    ends[i, side] = following
                    following += 1
        return ends

    def assign(self, elements: np.ndarray, given: Mapping[str, float]) -> None:
        """Give elements (k,) properties. Those that have some take the new ones: what they carry stays."""
        values = LINER.complete(given)
        blocks, beams = self.blocks, self.elements
        blocks.before_change()
        stored = self._stored() if self._account is not None else 0.0
        self._take_properties(elements, values)
        area = 0.5 * beams["length"][elements, None]  # of half an element
        beams["gap"][elements] = -beams["pressure"][elements] / (values["normal_stiffness"] * area)
        if values["shear_stiffness"] == 0.0:
            beams["shear"][elements] = 0.0
        self._arrange()
        if self._account is not None:
            self.commands += self._stored() - stored
        blocks.changed()

    def stop(self) -> None:
        """Velocities become zero. Not collective."""
        super().stop()
        self.nodes["spin"][:] = 0.0

    # ---- what is asked -----------------------------------------------------------------------------------------------

    def _value(self, kind: str, name: str) -> np.ndarray:
        return self._node_value(name) if kind == LINER_NODE else self._element_value(name)

    def _node_value(self, name: str) -> np.ndarray:
        nodes = self.nodes
        stem, _, axis = name.rpartition("_")
        c = ("x", "y", "moment").index(axis) if stem else 0
        match stem:
            case "position":
                return nodes["x"][:, c].copy()
            case "displacement":
                return nodes["x"][:, c] - nodes["origin"][:, c]
            case "velocity":
                return nodes["v"][:, c].copy()
            case "reaction":
                return nodes["reaction"][:, c].copy()
        return nodes[{"distance": "arc", "rotation": "turn"}.get(name, name)].copy()

    def _element_value(self, name: str) -> np.ndarray:
        beams = self.elements
        n, first, last = beams["force"].T
        half = 0.5 * beams["length"][:, None]
        match name:
            case "axial_force":
                return n.copy()
            case "shear_force":
                return (first + last) / beams["form"][:, 0]
            case "moment_first":
                return -first
            case "moment_last":
                return last.copy()
            case "axial_strain":
                return (beams["form"][:, 0] - beams["length"]) / beams["length"]
            case "plastic_strain":
                return beams["plastic"][:, 0] / beams["length"]
            case "plastic_rotation":
                return np.abs(beams["plastic"][:, 1:]).max(axis=1)
            case "liner_state":
                return beams["state"].copy()
            case "bond_pressure" | "bond_shear":
                return (beams[name.removeprefix("bond_")] / half).mean(axis=1)
            case "gap":
                return beams["gap"].max(axis=1)
            case "slip":
                at = np.abs(beams["slip"]).argmax(axis=1)
                return beams["slip"][np.arange(len(at)), at]
            case "bond_state":
                return beams["bond_state"][:, 0] | beams["bond_state"][:, 1]
        return beams["host"].copy()

    def columns(self) -> dict[str, dict[str, np.ndarray]]:
        """What frames hold: "nodes" with the number of their liner, "elements" with both nodes. Not collective."""
        found = super().columns()
        first, last = self.elements["ends"].T
        return {
            "nodes": {"liner": self.nodes["liner"].copy(), **found["nodes"]},
            "elements": {"first_node": first.copy(), "last_node": last.copy(), **found["elements"]},
        }

    def energies(self) -> dict[str, float]:
        """Energy of the liners [J/m] since the account began: stored in beams and bond and as motion, and at_start;
        lost in beams (yield) and in the bond (slip, parting), work_on_rock, work_of_conditions, work_of_gravity,
        commands; closing: what does not add up, relative: that over the largest. Not collective."""
        work = self.work.tolist()
        found = {
            "stored": self._stored(), "at_start": self._stored_at_start, "lost_in_beams": work[kernels.IN_BEAMS],
            "lost_in_bond": work[kernels.IN_BOND], "work_on_rock": work[kernels.ON_ROCK],
            "work_of_conditions": work[kernels.BY_CONDITIONS], "work_of_gravity": work[kernels.BY_GRAVITY],
            "commands": self.commands,
        }  # fmt: skip
        given = found["work_of_conditions"] + found["work_of_gravity"] + self.commands
        taken = found["work_on_rock"] + found["lost_in_beams"] + found["lost_in_bond"]
        return closed(found, found["stored"] - self._stored_at_start + taken - given)

    def _stored(self) -> float:
        parts = [kernels.stored(self.elements["force"], self._element_table)]
        for force, column in (("pressure", kernels.ACROSS), ("shear", kernels.ALONG)):
            k = self._point_table[:, column]
            f = self.elements[force].reshape(-1)
            parts.append(np.divide(f**2, 2.0 * k, out=np.zeros(len(k)), where=k > 0.0))
        if self._dynamic:
            self._set_masses()
            parts.append(self._kinetic())
        return math.fsum(np.concatenate(parts).tolist())

    def _kinetic(self) -> np.ndarray:
        """m v- v+ / 2 of the velocities before and after this moment (energy.py), of what is led m v- v- / 2."""
        nodes, table, dt = self.nodes, self._node_table, self.blocks.clock.dt
        v = np.column_stack([nodes["v"], nodes["spin"]])
        mass = table[:, [kernels.MASS, kernels.MASS, kernels.INERTIA]]
        kick = np.divide(dt * self._total, mass, out=np.zeros_like(v), where=(mass > 0.0) & ~self._led())
        return (0.5 * mass * v * (v + kick)).sum(axis=1)

    def _led(self) -> np.ndarray:
        """(n, 3) bool: prescribed velocities of nodes."""
        rows = [(one.does_x, one.does_y, one.does_turn) for one in self.conditions]
        return (np.array(rows) != FREE)[self.nodes["condition"]]

    # ---- tables of the kernels -------------------------------------------------------------------------------------

    def _arrange(self) -> None:
        nodes, beams = self.nodes, self.elements
        n, m = len(nodes["x"]), len(beams["row"])
        there = self.alive(LINER_ELEMENT)
        self._bound = np.repeat((beams["host"] >= 0) & there, 2)
        k = beams["face"] % 4
        after = np.zeros_like(k)
        if m:
            after = (k + 1) % corner_counts(self.blocks.the_mesh().cells[beams["face"] // 4])
        self._corner = np.column_stack([k, after]).reshape(-1)
        self._along, self._tangent, self._mean = np.zeros((m, 2)), np.zeros((2 * m, 2)), np.zeros((n, 2))
        self._total, self._on_rock = np.zeros((n, 3)), np.zeros((2 * m, 2))
        self._step, self._rock = np.zeros((n, 2)), np.zeros((2 * m, 2))
        length, poisson = beams["length"], self._column("poisson_ratio")
        held = 0.0 if self.blocks.options.plane_stress else poisson**2
        young = np.where(there, self._column("young") / (1.0 - held), 0.0)
        area, inertia, rho = self._column("area"), self._column("inertia"), self._column("density")
        table = np.zeros((m, 5))
        table[:, kernels.AXIAL], table[:, kernels.BENDING] = young * area / length, young * inertia / length
        table[:, kernels.TENSION] = self._column("tensile_strength") * area
        table[:, kernels.COMPRESSION] = self._column("compressive_strength") * area
        table[:, kernels.PLASTIC_MOMENT] = self._column("plastic_moment", math.inf)
        self._element_table = table
        half = np.repeat(0.5 * length, 2)
        bond = np.zeros((2 * m, 5))
        for column, name in (
            (kernels.ACROSS, "normal_stiffness"), (kernels.ALONG, "shear_stiffness"),
            (kernels.BOND_TENSION, "bond_tensile_strength"), (kernels.COHESION, "bond_cohesion"),
        ):  # fmt: skip
            bond[:, column] = np.where(self._bound, np.repeat(self._column(name), 2) * half, 0.0)
        bond[:, kernels.FRICTION] = np.repeat(np.tan(np.radians(self._column("bond_friction"))), 2)
        self._point_table = bond
        mass = np.where(there, 0.5 * rho * area * length, 0.0)
        turning = 2.0 * ROTARY * mass * length**2 + np.where(there, 0.5 * rho * inertia * length, 0.0)
        shear = table[:, kernels.BENDING] / np.where(length > 0.0, length, 1.0) ** 2
        self._true_mass, self._true_inertia, self._stiffness, self._turning = (np.zeros(n) for _ in range(4))
        for side in (0, 1):
            at = beams["ends"][:, side]
            spring = np.maximum(bond[side::2, kernels.ACROSS], bond[side::2, kernels.ALONG])
            for out, part in (
                (self._true_mass, mass), (self._true_inertia, turning),
                (self._stiffness, table[:, kernels.AXIAL] + 18.0 * shear + spring),
                (self._turning, 9.0 * table[:, kernels.BENDING]),
            ):  # fmt: skip
                np.add.at(out, at, part)
        self._node_table = np.zeros((n, 4))
        self._node_table[:, kernels.MASS], self._node_table[:, kernels.INERTIA] = self._true_mass, self._true_inertia
        self._prepared_for = None
        self._mine, self._rows = np.empty(0, np.int64), np.empty(0, np.int64)
        for e, (a, b) in enumerate(beams["ends"].tolist()):
            way = nodes["x"][b] - nodes["x"][a]
            self._along[e] = way / math.sqrt(way[0] * way[0] + way[1] * way[1])
        if n:
            kernels.tangents(beams["ends"], self._along, beams["state"], self._mean, self._tangent)
            self._find_forces()

    def _set_masses(self) -> None:
        """Masses and rotational inertias for this time step: 2 k / m bounds omega^2. With rotations measured as
        displacements over the length of a beam, the rows of its stiffness add up to 2 E A / L, 36 E I / L^3, and for
        rotations 18 E I / L, by Gershgorin; the bond adds twice its stiffness. In dynamic runs both are raised where
        the step would not be stable, in static ones fictitious."""
        o, dt = self.blocks.options, self.blocks.clock.dt
        if self._prepared_for == (dt, o.dynamic, o.safety):
            return
        known, self._prepared_for = self._prepared_for is not None, (dt, o.dynamic, o.safety)
        before, table = self._kinetic().sum(), self._node_table
        if not o.dynamic:
            table[:, kernels.MASS] = 0.5 * MARGIN * (1.0 + ALPHA) * self._stiffness
            table[:, kernels.INERTIA] = 0.5 * MARGIN * (1.0 + ALPHA) * self._turning
            return
        least = 0.5 * (dt / o.safety) ** 2
        mass = np.maximum(self._true_mass, least * self._stiffness)
        table[:, kernels.MASS], table[:, kernels.INERTIA] = mass, np.maximum(self._true_inertia, least * self._turning)
        if known and self._account is not None:
            self.commands += float(self._kinetic().sum() - before)
        raised = table[:, kernels.INERTIA] > self._true_inertia
        self._tell_of_mass(
            mass, self._true_mass, f", and raises the rotational inertia of {int(raised.sum())}" if raised.any() else ""
        )

    def _find_forces(self) -> None:
        beams, time, o = self.elements, self.blocks.time_now(), self.blocks.options
        self._node_table[:, kernels.WEIGHT_X] = self._true_mass * o.gx
        self._node_table[:, kernels.WEIGHT_Y] = self._true_mass * o.gy
        kernels.node_forces(
            beams["ends"], self._along, self._tangent, beams["form"], beams["force"], beams["state"],
            beams["pressure"].reshape(-1), beams["shear"].reshape(-1), self._node_table,
            self._conditions_at(time, time), self._total, self._on_rock,
        )  # fmt: skip

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

    def _held_here(self) -> tuple[np.ndarray, np.ndarray]:
        blocks = self.blocks
        host = np.repeat(self.elements["host"], 2)
        row = np.where(self._bound, blocks.where[host], -1)
        at = np.flatnonzero((row >= blocks.owned.start) & (row < blocks.owned.stop))
        return at, row[at]

    def add_to(self, applied: np.ndarray) -> None:
        """Forces on the rock at the present positions, in the order of elements [N/m]."""
        kernels.add(self._mine, self._rows, self._corner, self._on_rock, applied)

    def follow(self) -> None:
        """The rock has moved: move the nodes over the same step, and find the new forces."""
        blocks, nodes, beams = self.blocks, self.nodes, self.elements
        clock = blocks.clock
        with blocks.timers("force"):
            self._set_masses()
            seen = np.zeros_like(self._on_rock)
            kernels.host_points(self._mine, self._rows, self._corner, blocks.x, seen)
        if blocks.comm.size > 1:
            with blocks.timers("reduce"):
                blocks.comm.sum_into(seen.view(np.int64))  # one rank has each row, the others zero: exact
        with blocks.timers("force"):
            static = not blocks.options.dynamic
            time = self._time_before()
            conditions = self._conditions_at(time, time if static else clock.time - 0.5 * clock.dt)
            work = self.work if self._account is not None and not static else np.zeros(kernels.WORK)
            before, point = self._on_rock.copy(), beams["point"].reshape(-1, 2)
            self._rock[:] = np.where(self._bound[:, None], seen - point, 0.0)
            point[self._bound] = seen[self._bound]
            kernels.move(
                nodes["x"], nodes["v"], nodes["turn"], nodes["spin"], self._total, conditions, self._node_table,
                clock.dt, ALPHA if static else 0.0, nodes["reaction"], self._step, work,
            )  # fmt: skip
            gap, slip, pressure, shear, bond_state = (
                beams[name].reshape(-1) for name in ("gap", "slip", "pressure", "shear", "bond_state")
            )
            kernels.bond(
                beams["ends"], self._tangent, beams["state"], self._bound, self._point_table, self._step, self._rock,
                gap, slip, pressure, shear, bond_state, work,
            )  # fmt: skip
            kernels.bend(
                beams["ends"], nodes["x"], nodes["turn"], self._element_table, beams["angle"], self._along,
                beams["form"], beams["force"], beams["plastic"], beams["state"], work,
            )  # fmt: skip
            kernels.tangents(beams["ends"], self._along, beams["state"], self._mean, self._tangent)
            self._find_forces()
            kernels.work_on_rock(before, self._on_rock, self._rock, work)

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Unbalanced and contributing forces [N/m] at all nodes that move by themselves, moments over the length of the
        elements, on the first rank. Not collective."""
        if self.blocks.comm.rank > 0 or not len(self):
            return np.empty(0), np.empty(0)
        beams, length = self.elements, np.zeros(len(self))
        np.maximum.at(length, beams["ends"].reshape(-1), np.repeat(beams["length"], 2))
        unbalanced = np.abs(self._total) / np.column_stack([np.ones((len(self), 2)), length])
        moment = np.abs(beams["force"][:, 1:]) / beams["length"][:, None]
        parts = [2.0 * np.abs(beams["force"][:, 0]), 2.0 * np.abs(self._element_value("shear_force")), moment]
        parts += [np.abs(beams["pressure"]), np.abs(beams["shear"]), np.abs(self._node_table[:, kernels.WEIGHT_X :])]
        return unbalanced[~self._led()], np.concatenate([part.reshape(-1) for part in parts])

    def elements_removed(self, elements: np.ndarray) -> None:
        """Liners on faces of these elements of the rock are free of them from now on."""
        beams = self.elements
        lost = np.isin(beams["host"], elements)
        if not lost.any():
            return
        stored = self._stored() if self._account is not None else 0.0
        self._unbind(lost)
        self._arrange()
        if self._account is not None:
            self.commands += self._stored() - stored
        if self.blocks.log is not None:
            self.blocks.log.info(f"{int(lost.sum())} elements of liners are free of the rock: it was taken out")

    def _unbind(self, elements: np.ndarray) -> None:
        """No rock holds these elements any more."""
        beams = self.elements
        beams["host"][elements] = -1
        for name in ("pressure", "shear"):
            beams[name][elements] = 0.0
        beams["bond_state"][elements] &= ~(kernels.SLIPS | kernels.OPEN)

    def _let_go(self, elements: np.ndarray) -> None:
        self._unbind(elements)
        beams = self.elements
        beams["force"][elements] = 0.0
        gone = beams["state"] & REMOVED > 0
        gone[elements] = True
        lost = np.ones(len(self), bool)
        lost[beams["ends"][~gone].reshape(-1)] = False
        for name in ("condition", "v", "spin", "reaction"):
            self.nodes[name][lost] = 0
