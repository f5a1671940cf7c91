"""Rock bolts as a load on blocks: what is known of them, and their step (physics/fdem/structures.py)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts import kernels, layout
from hpcdem.physics.bolts.properties import BOLT
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.groups import BOLT_ELEMENT, BOLT_NODE
from hpcdem.physics.fdem.structures import REMOVED, Columns, Number, Structure, empty

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Condition:
    """Prescribed motion and force of nodes of bolts: does_x, does_y, does_z (kernels.FREE, VELOCITY, ACCELERATION) with
    its value; the force [N] on one bolt. See kernels.DOES for the order."""

    does_x: int = kernels.FREE
    at_x: Number = 0.0
    does_y: int = kernels.FREE
    at_y: Number = 0.0
    does_z: int = kernels.FREE
    at_z: Number = 0.0
    force_x: Number = 0.0
    force_y: Number = 0.0
    force_z: Number = 0.0


NODE_QUANTITIES: dict[str, tuple[str, str]] = {
    **{f"position_{axis}": ("m", f"position in {axis}") for axis in "xyz"},
    **{f"displacement_{axis}": ("m", f"displacement in {axis} since it was installed") for axis in "xyz"},
    **{f"velocity_{axis}": ("m/s", f"velocity in {axis}") for axis in "xyz"},
    "bond_force": ("N/m", "force of the grout per length of one bolt, towards its last point"),
    "slip": ("m", "slip of the bar in the grout, towards its last point"),
    "bond_state": ("1", "slipping 1, has slipped 2"),
    **{f"reaction_{axis}": ("N", f"force in {axis} by which conditions act on one bolt") for axis in "xyz"},
    "host": ("1", "element that holds the node, -1: none"),
    "distance": ("m", "distance from the first point along the bolt, as installed"),
}
ELEMENT_QUANTITIES: dict[str, tuple[str, str]] = {
    "axial_force": ("N", "axial force of one bolt, tension positive"),
    "axial_strain": ("1", "lengthening since it was installed, over its length"),
    "plastic_strain": ("1", "plastic part of it"),
    "bolt_state": ("1", "yielding in tension 1, in compression 2; has yielded before 4, 8; broken 16; deleted 32"),
}
QUANTITIES = {BOLT_NODE: NODE_QUANTITIES, BOLT_ELEMENT: ELEMENT_QUANTITIES}
"""Quantities of nodes and elements of bolts that can be queried: unit and meaning."""

_NODES: Columns = {
    "bar": (np.int64, 0), "host": (np.int64, 0), "plate": (np.int64, 0), "condition": (np.int64, 0),
    "bond_state": (np.int64, 0), "arc": (np.float64, 0), "bond": (np.float64, 0), "slip": (np.float64, 0),
    "x": (np.float64, 2), "v": (np.float64, 2), "origin": (np.float64, 2), "point": (np.float64, 2),
    "tangent": (np.float64, 2), "reaction": (np.float64, 2), "grout": (np.float64, 2), "weight": (np.float64, 4),
}  # fmt: skip
"""Columns of the nodes, by type and width in the plane. bar: which bolt; condition: row; arc: distance along the bolt
[m]; bond: force of the grout [N/m]; point: where the rock is [m]; tangent: unit vector along the bolt; grout: length in
grout of the halves of the elements before and after the node [m]; weight: of the corners of the host."""
_VECTORS = ("x", "v", "origin", "point", "tangent", "reaction")
_ELEMENTS: Columns = {
    "row": (np.int64, 0), "state": (np.int64, 0), "length": (np.float64, 0), "force": (np.float64, 0),
    "plastic": (np.float64, 0),
}  # fmt: skip
"""Columns of the elements. row: of the properties, 0: none yet; length: as installed [m]; force: axial [N/m]; plastic:
elongation [m]."""


class Bolts(Structure):
    """All bolts of a model of blocks, see `Structure`; the elements of a bolt lie between nodes that follow each
    other."""

    name: ClassVar[str] = "bolts"
    kernel_kind: ClassVar[str] = "bolts"
    of_both: ClassVar[bool] = True
    word: ClassVar[str] = "bolt"
    parts: ClassVar[tuple[str, str]] = (BOLT_ELEMENT, BOLT_NODE)
    quantities = QUANTITIES
    of_nodes: ClassVar[Columns] = _NODES
    of_elements: ClassVar[Columns] = _ELEMENTS
    model = BOLT
    held = "nodes"
    at_rest: ClassVar[Mapping[str, int]] = {"host": -1, "plate": 0, "weight": 0, "condition": 0, "v": 0, "reaction": 0}
    condition_type: ClassVar[type] = Condition
    flows = ("work_on_rock", "lost_in_bars", "lost_in_grout", "lost_by_dashpots", "work_of_conditions")

    def ends(self) -> np.ndarray:
        """(m, 2) nodes of each element. Not collective."""
        return np.column_stack([self.first, self.first + 1])

    @classmethod
    def node_columns(cls, dim: int) -> Columns:
        return {**cls.of_nodes, **{name: (np.float64, dim) for name in _VECTORS}}

    # ---- what is given --------------------------------------------------------------------------------------------

    def create(
        self,
        points: Sequence[Sequence[float]],
        segments: int | None = None,
        length: float | None = None,
        grout: tuple[float, float] | None = None,
        plate: bool = False,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Install a bolt along these points [m], as things are now; returns the numbers of its nodes and elements.

        segments: of each straight part; length: of an element at most [m]; else nodes are at the edges of elements.
        grout: from where to where along the bolt there is grout [m]. plate: the first node is tied to the rock.
        """
        blocks, dim = self.blocks, self.blocks.dim
        line = layout.checked(points, dim)
        if segments is not None and length is not None:
            raise CommandError("segments and length cannot be combined: both define the division of a bolt")
        if (segments is not None and segments < 1) or (length is not None and not 0.0 < length < math.inf):
            raise CommandError("a bolt needs at least one segment, of a length above 0")
        total = float(layout.lengths(np.diff(line, axis=0)).sum())
        begin, end = (0.0, total) if grout is None else grout
        if not 0.0 <= begin < end or begin >= total:
            raise CommandError(f"grout must start at 0 or more and end farther on the bolt of {total:g} m, got "
                               f"{begin:g} to {end:g}")  # fmt: skip
        cells = blocks.the_mesh().cells
        corners = diagnostics.corner_values(blocks, "position").reshape(-1, 4, dim)
        x = layout.split(line, corners, np.where(blocks.alive[:, None], cells, -1), blocks.mean_edge, segments, length)
        host, weight = layout.hosts(x, corners, cells, blocks.alive)
        held = np.flatnonzero(host >= 0)
        if not len(held):
            raise CommandError("no node of the bolt lies in an element")
        if plate and host[0] < 0:  # in front of the face: tied to the element in which the bolt begins
            e = int(host[held[0]])
            host[0], weight[0] = e, layout.coordinates(x[0], corners[e], bool(cells[e, 3] >= 0))
        n, span = len(x), layout.lengths(np.diff(x, axis=0))
        arc = np.concatenate([[0.0], np.cumsum(span)])
        middle = 0.5 * (arc[:-1] + arc[1:])

        def within(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return np.maximum(np.minimum(b, end) - np.maximum(a, begin), 0.0)

        new = empty(self.node_columns(dim), n)
        new["bar"][:] = self.nodes["bar"].max(initial=-1) + 1
        new["host"][:], new["weight"][:], new["arc"][:], new["plate"][0] = host, weight, arc, plate
        new["x"][:], new["origin"][:], new["point"][:] = x, x, x
        new["grout"][1:, 0], new["grout"][:-1, 1] = within(middle, arc[1:]), within(arc[:-1], middle)
        seen = np.zeros((n, dim + 1))
        kernels.host_points(held, held, weight, np.ascontiguousarray(corners[host].reshape(-1, 4 * dim)), dim, seen)
        new["point"][held] = seen[held, :dim]
        speed = diagnostics.corner_values(blocks, "velocity").reshape(-1, 4, dim)
        new["v"][held] = _at(weight[held], cells[host[held]], speed[host[held]])
        bars = empty(_ELEMENTS, n - 1)
        bars["length"][:] = span
        numbers = self._add(new, bars)
        free = int((host < 0).sum())
        if blocks.log is not None and free:
            blocks.log.info(f"{free} of the {n} nodes of the bolt lie outside the mesh and are not grouted")
        return numbers

    def assign(self, elements: np.ndarray, given: Mapping[str, float]) -> None:
        """Give elements (k,) properties. Those that have some take the new ones: the force they carry stays, but for
        the difference of the pretension."""
        values = BOLT.complete(given)
        if self.blocks.dim == 3 and values["spacing"] != 1.0:
            raise CommandError(
                f"bolts in three dimensions are single bolts: spacing must be 1, got {values['spacing']:g}"
            )
        self._check_spacing(elements, values["spacing"])
        blocks, bars = self.blocks, self.elements
        blocks.before_change()
        before = self._column("pretension_force")[elements]
        with self._booked():
            self._take_properties(elements, values)
            whole = elements[bars["state"][elements] & kernels.RUPTURED == 0]
            more = (values["pretension_force"] - before) / values["spacing"]
            bars["force"][whole] += more[bars["state"][elements] & kernels.RUPTURED == 0]
        blocks.changed()

    def _check_spacing(self, elements: np.ndarray, spacing: float) -> None:
        """Check that a bolt keeps its spacing, by which its forces are divided."""
        bar, first = self.nodes["bar"], self.first
        known = self.elements["row"] > 0
        others = known & np.isin(bar[first], bar[first[elements]]) & (self._column("spacing") != spacing)
        others[elements] &= known[elements]
        if others.any():
            e = int(np.flatnonzero(others)[0])
            raise CommandError(
                f"bolt-element {e} has the spacing {self._column('spacing')[e]:g} m: the spacing of a bolt is uniform "
                f"and fixed, got {spacing:g}"
            )

    # ---- what is queried -------------------------------------------------------------------------------------------

    def _node_value(self, name: str) -> np.ndarray:
        nodes = self.nodes
        if (found := self._vector(name)) is not None:
            return found * self._node_spacing if name.startswith("reaction") else found
        if name == "bond_force":
            length = nodes["grout"].sum(axis=1)
            force = nodes["bond"] * self._node_spacing
            return np.divide(force, length, out=np.zeros(len(force)), where=length > 0.0)
        return nodes[{"distance": "arc"}.get(name, name)].copy()

    def _element_value(self, name: str) -> np.ndarray:
        bars = self.elements
        match name:
            case "axial_force":
                return bars["force"] * self._column("spacing", 1.0)
            case "axial_strain":
                return (self._length - bars["length"]) / bars["length"]
            case "plastic_strain":
                return bars["plastic"] / bars["length"]
        return bars["state"].copy()

    def columns(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns of frames: "nodes" with the number of their bolt, "elements" with their first node. Not
        collective."""
        found = super().columns()
        return {
            "nodes": {"bolt": self.nodes["bar"].copy(), **found["nodes"]},
            "elements": {"first_node": self.first.copy(), **found["elements"]},
        }

    def _stored(self) -> float:
        bars, nodes = self.elements, self.nodes
        soft, grout = self._element_table[:, kernels.STIFFNESS], self._node_table[:, kernels.GROUT]
        parts = [
            np.divide(bars["force"] ** 2, 2.0 * soft, out=np.zeros(len(soft)), where=soft > 0.0),
            np.divide(nodes["bond"] ** 2, 2.0 * grout, out=np.zeros(len(grout)), where=grout > 0.0),
        ]
        if self._dynamic:
            self._set_masses()
            parts.append(self._kinetic(self.blocks.clock.dt))
        return math.fsum(np.concatenate(parts).tolist())

    def _kinetic(self, dt: float) -> np.ndarray:
        nodes, mass = self.nodes, self._node_table[:, kernels.MASS]
        w = (nodes["v"] * self._tangent).sum(axis=1)
        own = (nodes["plate"] == 0) | ~self.hosted
        return np.where(own, 0.5 * mass * w * self._next_speeds(dt), 0.0)

    def _next_speeds(self, dt: float) -> np.ndarray:
        """(n,) speed along the bar after this moment; of nodes with a prescribed motion the present one."""
        nodes, table = self.nodes, self._node_table
        mass = table[:, kernels.MASS]
        w = (nodes["v"] * self._tangent).sum(axis=1)
        f = (self._total * self._tangent).sum(axis=1) + nodes["bond"]
        drag = 0.5 * table[:, kernels.DRAG] * dt
        return np.divide((mass - drag) * w + dt * f, mass + drag, out=w.copy(), where=~self._led() & (mass > 0.0))

    def _half_step(self, dt: float) -> np.ndarray:
        out, nodes, time = np.zeros(kernels.WORK), self.nodes, self.blocks.time_now()
        if self._dynamic:
            given = self._conditions_at(time, time)
            w = (nodes["v"] * self._tangent).sum(axis=1)
            own = (nodes["plate"] == 0) | ~self.hosted
            drag = np.where(own, 0.5 * self._node_table[:, kernels.DRAG] * (w + self._next_speeds(dt)), 0.0)
            held = (nodes["bond"] - drag)[:, None] * self._tangent + self._total
            axes = np.arange(self.blocks.dim)
            force = given[:, kernels.FORCE + axes]
            force -= np.where(given[:, kernels.DOES + 2 * axes] != kernels.FREE, held, 0.0)
            out[kernels.BY_CONDITIONS] = 0.5 * dt * math.fsum((force * nodes["v"]).reshape(-1).tolist())
            out[kernels.IN_DASHPOTS] = 0.5 * dt * math.fsum((drag * w).tolist())
        return out

    def _led(self) -> np.ndarray:
        """(n,) bool: nodes with a prescribed velocity or acceleration."""
        return self._does().any(axis=1)

    # ---- tables of the kernels -------------------------------------------------------------------------------------

    def _arrange(self) -> None:
        """Compute everything that depends on columns, properties and hosts."""
        nodes, bars = self.nodes, self.elements
        n, m, dim = len(nodes["bar"]), len(bars["row"]), self.blocks.dim
        self.first = kernels.first_nodes(nodes["bar"])
        first = self.first
        self.hosted = nodes["host"] >= 0
        there = bars["state"] & REMOVED == 0
        parted = np.ones(n, bool)
        parted[first[there] + 1] = False
        dead = ~self.alive(BOLT_NODE)
        self._carrier, self._share = layout.carriers(np.cumsum(parted), nodes["arc"], nodes["host"])
        self._along, self._tangent = np.zeros((m, dim)), nodes["tangent"]
        self._total, self._on_rock = np.zeros((n, dim)), np.zeros((n, dim))
        self._step, self._rock = np.zeros((n, dim)), np.zeros((n, dim))
        self._length = np.array([kernels.apart(nodes["x"][i], nodes["x"][i + 1]) for i in first.tolist()])
        spacing, diameter = self._column("spacing", 1.0), self._column("diameter")
        area = 0.25 * math.pi * diameter**2
        young, rho = self._column("young"), self._column("density")
        table = np.zeros((m, 5))
        table[:, kernels.STIFFNESS] = young * area / (bars["length"] * spacing)
        table[:, kernels.LENGTH] = bars["length"]
        table[:, kernels.TENSION] = self._column("tensile_yield_force") / spacing
        table[:, kernels.COMPRESSION] = self._column("compressive_yield_force") / spacing
        table[:, kernels.FAILURE] = self._column("tension_failure_strain", math.inf)
        self._element_table = table
        mass = 0.5 * rho * area * bars["length"] / spacing
        drag = 0.5 * self._column("damp_factor") * 2.0 * area * np.sqrt(young * rho) / spacing
        outside, inside = diameter + 2.0 * self._column("grout_thickness"), diameter
        tan_rock, tan_bolt = (np.tan(np.radians(self._column(f"friction_{at}"))) for at in ("rock_grout", "grout_bolt"))
        of_grout = (
            (kernels.GROUT, self._column("shear_stiffness_rock_bolt")),
            (kernels.ROCK_COHESION, math.pi * outside * self._column("cohesion_rock_grout")),
            (kernels.ROCK_FRICTION, math.pi * outside * tan_rock),
            (kernels.BOLT_COHESION, math.pi * inside * self._column("cohesion_grout_bolt")),
            (kernels.BOLT_FRICTION, math.pi * inside * tan_bolt),
        )
        nodal = np.zeros((n, 7))
        self._node_spacing, self._stiffness = np.ones(n), np.zeros(n)
        for side, at in ((1, first), (0, first + 1)):  # the element after the node, and that before it
            nodal[at, kernels.MASS] += np.where(there | dead[at], mass, 0.0)
            nodal[at, kernels.DRAG] += np.where(there | dead[at], drag, 0.0)
            for column, per_length in of_grout:
                nodal[at, column] += per_length * nodes["grout"][at, side] / spacing
            self._node_spacing[at] = spacing
            self._stiffness[at] += np.where(there | dead[at], table[:, kernels.STIFFNESS], 0.0)
        self._node_table, self._true_mass = nodal, nodal[:, kernels.MASS].copy()
        self._slides_with_friction = bool(
            (nodal[self.hosted][:, [kernels.ROCK_FRICTION, kernels.BOLT_FRICTION]] > 0.0).any()
        )
        self._prepared_for = None
        self._mine, self._rows = np.empty(0, np.int64), np.empty(0, np.int64)
        if n:
            kernels.directions(first, nodes["x"], bars["state"], self._along, self._tangent)
            self._find_forces()

    def _weigh(self, factor: float, true: float) -> tuple[np.ndarray, str]:
        """Along the bar, with the stiffness of the elements on both sides and of the grout."""
        k = self._stiffness + self._node_table[:, kernels.GROUT]
        self._node_table[:, kernels.MASS] = np.maximum(true * self._true_mass, factor * k)
        return self._node_table[:, kernels.MASS], ", along them"

    def _conditions_at(self, time: float, middle: float) -> np.ndarray:
        table = super()._conditions_at(time, middle)
        table[:, kernels.FORCE :] /= self._node_spacing[:, None]
        return table

    def _find_forces(self) -> None:
        """Forces on nodes and rock, of the present positions and moment."""
        nodes, time = self.nodes, self.blocks.time_now()
        kernels.node_forces(
            self.first, self._along, self._tangent, self.elements["force"], nodes["bond"], nodes["plate"], self.hosted,
            self._carrier, self._share, self._conditions_at(time, time), self._total, self._on_rock,
        )  # fmt: skip

    # ---- called by the blocks ----------------------------------------------------------------------------------------

    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: corners of the owned elements that hold nodes."""
        out = np.zeros((blocks.n_own, 4), bool)
        at, rows = self._held_here()
        np.logical_or.at(out, rows - blocks.n_left, self.nodes["weight"][at] != 0.0)
        return out

    def springs(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) stiffness [N/m per m] that grout and plates bring to these corners."""
        out = np.zeros((blocks.n_own, 4))
        at, rows = self._held_here()
        k = self._node_table[:, kernels.GROUT] + np.where(self.nodes["plate"] > 0, self._stiffness, 0.0)
        np.add.at(out, rows - blocks.n_left, k[at, None] * np.abs(self.nodes["weight"][at]))
        return out

    def _hosts(self) -> np.ndarray:
        return self.nodes["host"]

    def add_to(self, applied: np.ndarray) -> None:
        """Forces on the rock at the present positions, in the order of nodes [N/m]."""
        kernels.add(self._mine, self._rows, self.nodes["weight"], self._on_rock, self.blocks.stride, applied)

    def _move(self, seen: np.ndarray, conditions: np.ndarray, alpha: float, work: np.ndarray) -> None:
        nodes, bars = self.nodes, self.elements
        point, normal = np.ascontiguousarray(seen[:, :-1]), np.ascontiguousarray(seen[:, -1])
        kernels.move(
            self.first, nodes["x"], nodes["v"], point, nodes["point"], self._tangent, self._total, nodes["bond"],
            nodes["plate"], self.hosted, self._carrier, self._share, conditions, self._node_table,
            self.blocks.clock.dt, alpha, nodes["reaction"], self._step, self._rock, work,
        )  # fmt: skip
        nodes["point"][self.hosted] = point[self.hosted]
        kernels.stretch(
            self.first, nodes["x"], self._element_table, self._length, bars["force"], bars["state"], bars["plastic"],
            work,
        )  # fmt: skip
        kernels.hold(
            self._tangent, self._step, self._rock, self.hosted, self._node_table, normal, nodes["bond"],
            nodes["slip"], nodes["bond_state"], work,
        )  # fmt: skip
        kernels.directions(self.first, nodes["x"], bars["state"], self._along, self._tangent)

    def _seen(self) -> np.ndarray:
        """(n, d + 1) of the nodes whose host is owned here: where the rock is [m], and its stress across the bar
        [Pa]."""
        blocks, seen = self.blocks, np.zeros((len(self), self.blocks.dim + 1))
        kernels.host_points(self._mine, self._rows, self.nodes["weight"], blocks.x, blocks.stride, seen)
        if self._slides_with_friction and len(self._mine):
            rows, place = np.unique(self._rows, return_inverse=True)
            stress, _ = blocks.local.stresses(rows - blocks.n_left, energies=False, flow=False)
            across = np.empty(len(self._mine))
            kernels.across(stress[place.reshape(-1)], self._tangent[self._mine], across)
            seen[self._mine, -1] = across
        return seen

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Unbalanced and contributing forces along the bars [N/m] of all nodes that move by themselves, on the first
        rank. Not collective."""
        if self.blocks.comm.rank > 0:
            return np.empty(0), np.empty(0)
        nodes = self.nodes
        free = ~self._led() & ~((nodes["plate"] > 0) & self.hosted)
        f = (self._total * self._tangent).sum(axis=1) + nodes["bond"]
        return np.abs(f[free]), np.concatenate([2.0 * np.abs(self.elements["force"]), np.abs(nodes["bond"])])

    def _unbind(self, lost: np.ndarray) -> None:
        """Plates fall off."""
        nodes = self.nodes
        nodes["host"][lost], nodes["plate"][lost], nodes["weight"][lost] = -1, 0, 0.0
        nodes["bond"][lost], nodes["bond_state"][lost] = 0.0, nodes["bond_state"][lost] & ~kernels.SLIPS

    def _let_go(self, elements: np.ndarray) -> None:
        """Release elements: half of the grout of each node is lost with each of its elements, and with it its part of
        the force."""
        nodes, bars, first = self.nodes, self.elements, self.first[elements]
        before = nodes["grout"].sum(axis=1)
        nodes["grout"][first, 1] = nodes["grout"][first + 1, 0] = 0.0
        left = nodes["grout"].sum(axis=1)
        nodes["bond"] *= np.divide(left, before, out=np.ones(len(left)), where=before > 0.0)
        bars["state"][elements] |= kernels.RUPTURED
        bars["force"][elements] = 0.0


def _at(weight: np.ndarray, cells: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (k, 4, d) of the corners of elements (k, 4) at points in them."""
    return (weight[:, :, None] * np.where(cells[:, :, None] >= 0, values, 0.0)).sum(axis=1)
