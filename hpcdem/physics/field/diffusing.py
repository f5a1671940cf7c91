"""A field that diffuses in the elements of blocks: what is assigned and prescribed, its clock and its step.

Properties and conditions are known to all ranks by the numbers of the mesh. Values belong to corners of elements and
travel with them, as positions do (columns of `State.cold`); corners that hang together through faces that are not
broken are one node of the field and carry equal copies. Where joints break corners part with the value that they have:
each side of a crack has its own. Every holder of a node adds what flows to all its corners in the order of elements, so
the bits depend on neither ranks nor threads.

A field is a subclass that says what it is called, its properties, capacity and conductivity. Heat (physics/heat) and
moisture (physics/moisture) are two.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial, reduce
from operator import sub
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.units import counted, with_prefix
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import build, by_temperature, hexahedra, user_laws
from hpcdem.physics.fdem.kernels.elements import FORCE
from hpcdem.physics.fdem.mesh import sizes as sizes_of
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned, kernels, kernels_space
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.hexes import Hexes, conductances, with_other_cuts
from hpcdem.physics.field.model import Assigned, Field, Tables

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

SAFETY = 0.9
"""Part of the stability limit that an estimated sub-step may be."""
LOOK = 100
"""Cycles after which it is looked whether it has blown up."""
MANY = 100_000
"""Sub-steps in a cycle that are too many to be meant."""
SPREAD = 0.1
"""By how much of the mean edge corners of one node may be apart, in joints that open."""


@dataclass(frozen=True)
class FaceCondition:
    """Of faces: flux into the element [W/m2]; environment: temperature around it [K], None: none; transfer: heat
    transfer coefficient to it [W/(m2 K)], None: that of the element. Of other fields what corresponds to them."""

    flux: Number = 0.0
    transfer: float | None = None
    environment: Number | None = None


class Diffusing(Assigned, Field):
    """A field of a model of blocks.

    row (ne,): of the table of properties, by element, 0: none; held (np,): row of the prescribed values, 0: none;
    face (4 ne,): row of the conditions of faces. t (n, w): values at the corners of all elements held here.
    """

    quantity: ClassVar[str]
    """What it is a field of, and the column of elements with its values at their corners."""
    unstressed: ClassVar[str]
    """Column of elements: the mean value at which one is free of the stress that the field brings."""
    word: ClassVar[str]
    """What commands call its part of the calculation."""
    several: ClassVar[str] = "values"
    low_to_high: ClassVar[str] = "lower to the higher"
    otherwise: ClassVar[str] = ""
    """What else helps where a time step is too long."""
    expansion: ClassVar[str] = ""
    """Property: linear expansion with it; none: it brings no stress."""
    kept: ClassVar[tuple[str, ...]] = ("switched_on", "own_steps", "own_dt")
    """Attributes that checkpoints hold besides."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        mesh = blocks.the_mesh()
        self.given, self.capacities = f"{self.name}_given", f"{self.name}_capacity"
        """Columns of elements, of corners: what conditions gave, and capacity."""
        self.held = np.zeros(len(mesh.points), np.int32)
        self.face = np.zeros(mesh.cells.size, np.int32)
        self.prescribed: list[Number] = [0.0]
        self.faces: list[FaceCondition] = [FaceCondition()]
        self.accounts = dict.fromkeys(("given", "commands", "removed"), 0.0)
        """What conditions gave to elements that are gone, what commands brought, and what is gone with elements."""
        self._start_clock(blocks.clock.time)
        self.switched_on, self.own_steps, self.own_dt = True, 0, 0.0
        self.t = np.empty((0, 3))
        self._stale = True
        self._checked = False
        self._expands: bool | None = None
        self._stiffness_of: np.ndarray | None = None
        self._stiffness, self._quad = np.empty(0), np.empty(0, bool)
        self._found_for: tuple[float, ...] = ()
        self._told = 0.0
        self._told_obtuse = False
        self._limit = math.inf

    @property
    def set_step(self) -> str:
        """The command that sets the length of its sub-steps."""
        return f"model field {self.name} time-step"

    @property
    def switch_off(self) -> str:
        """The command by which it stays as it is."""
        return f"model field {self.name} flows off"

    @property
    def stays(self) -> bool:
        return True

    # ---- what a field says of itself -----------------------------------------------------------------------------

    @abstractmethod
    def _capacities(self) -> np.ndarray:
        """By rows (rows + 1,), per mass of the elements."""

    @abstractmethod
    def _conductivities(self, elements: np.ndarray) -> np.ndarray:
        """Of elements (n,): xx, yy, xy (n, 3), in space xx, yy, xy, zz, xz, yz (n, 6)."""

    @property
    def _transfers(self) -> np.ndarray:
        """Transfer coefficients (ne,) of the elements."""
        return np.zeros(len(self.row))

    @property
    def on(self) -> bool:
        """It flows. Not collective."""
        return self.switched_on and bool(self.rows)

    @property
    def keeps_time(self) -> bool:
        return self.on

    def find_contacts(self) -> None:
        """Where it crosses from surface to surface now; the model is closed. Not collective."""

    # ---- what is assigned and prescribed -------------------------------------------------------------------------

    def assign(self, numbers: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Elements (None: all) have this model; at the values that they have now they are free of the stress that it
        brings."""
        at = self._numbers(numbers)
        super().assign(at, given)
        self._take_unstressed(at)

    def _assigned(self) -> None:
        self._expands = None
        self._make_columns()

    def _make_columns(self) -> None:
        """The columns of elements; the model is open."""
        cold, n = self.blocks.cold, len(self.blocks.number)
        if self.quantity not in cold:
            for name in (self.quantity, self.given, self.capacities):
                cold[name] = np.zeros((n, self.blocks.corners))
            cold[self.unstressed] = np.zeros((n, 1))

    def clock(self, on: bool | None = None, steps: int | None = None, dt: float | None = None) -> None:
        """Whether it flows; sub-steps of a cycle, 0: as many as are needed; their length [s], 0: by the clock of the
        blocks."""
        if (steps is not None and steps < 0) or (dt is not None and not 0.0 <= dt < math.inf):
            raise CommandError(f"sub-steps of {self.name} and their length must not be negative")
        with self.changing():
            self.switched_on = self.switched_on if on is None else on
            self.own_steps = self.own_steps if steps is None else steps
            self.own_dt = self.own_dt if dt is None else dt

    def _take_unstressed(self, elements: np.ndarray) -> None:
        """These elements, and hexahedra that they are parts of, are free of thermal stress as they are; the model is
        open. Collective."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        number, t = blocks.number, blocks.cold[self.quantity]
        found = by_temperature.of_corners(mesh, number, t)
        chosen = np.isin(number, elements)
        if len(mesh.hexes):
            of = mesh.macro_of()
            some = np.zeros(len(mesh.hexes) + 1, bool)  # the last one: of no hexahedron
            some[of[elements]] = True
            some[-1] = False
            mine = np.flatnonzero(some[of[number]])
            found[mine] = self._means_of_parts(number[mine], t[mine])
            chosen[mine] = True
        blocks.cold[self.unstressed][chosen, 0] = found[chosen]

    def _means_of_parts(self, number: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Means (n,) of the hexahedra that these elements are parts of, which may be shared out among ranks, as
        `hexahedra.Rows` has them; t (n, 4): temperatures of their corners. Collective."""
        mesh, comm = self.blocks.the_mesh(), self.blocks.comm
        which, at = np.unique(mesh.macro_of()[number], return_inverse=True)
        hexes = mesh.hexes[which]
        _, parts = hexahedra.corner_parts(mesh.points, mesh.cells, hexes)
        own = (parts[at, number - hexes[at, 8]] * t).sum(axis=1)
        pieces = [(number, own)] if comm.size == 1 else comm.allgather((number, own))
        every, first = np.unique(np.concatenate([piece[0] for piece in pieces]), return_index=True)
        means = np.concatenate([piece[1] for piece in pieces])[first].reshape(-1, hexahedra.PARTS).sum(axis=1)
        return means[np.searchsorted(every[:: hexahedra.PARTS], hexes[at, 8])]

    def initial(self, nodes: np.ndarray | None, value: float) -> None:
        """Nodes (None: all) have this value now; elements around them are free of the stress that the field brings."""
        blocks = self.blocks
        self._check_values(np.array([value]), f"a {self.quantity}")
        at = blocks.numbers_of_nodes(nodes)
        self._need_model()
        blocks.before_change()
        before = self._content()
        chosen = np.zeros(len(blocks.the_mesh().points) + 1, bool)  # the last one is for the fourth corner of triangles
        chosen[at] = True
        t, cells = blocks.cold[self.quantity], blocks.the_mesh().cells
        corners = chosen[cells[blocks.number, : t.shape[1]]]
        t[corners] = value
        self.accounts["commands"] += self._content() - before
        self._take_unstressed(np.flatnonzero(chosen[cells].any(axis=1)))
        blocks.changed(stiffness=False)

    def _check_values(self, values: np.ndarray, what: str) -> None:
        """CommandError for values (n,) that it cannot have."""
        if not np.isfinite(values).all():
            raise CommandError(f"{what} must be finite, got {values[~np.isfinite(values)][0]}")

    def prescribe(self, nodes: np.ndarray | None, value: Number) -> None:
        """Nodes (None: all) have this value from now on, a number or a table over the time of the field."""
        at = self.blocks.numbers_of_nodes(nodes)
        self._need_model()
        row = self._row_of(value)
        with self.changing():
            self.held[at] = row

    def _row_of(self, value: Number) -> int:
        """Of this prescribed value."""
        what = f"the {self.quantity} of a node"
        self._check_values(assigned.checked(self.blocks.tables, value, what), what)
        return assigned.row_of(self.prescribed, value, 1)

    def remove_conditions(self, nodes: np.ndarray | None) -> None:
        """Nodes (None: all) are no longer held."""
        self._unset(self.held, nodes)

    def expose(self, faces: np.ndarray | None, **changes: Any) -> None:
        """Faces (None: all) have these conditions, fields of `FaceCondition`; the others of theirs stay."""
        at = self.blocks.numbers_of_faces(faces)
        self._need_model()
        for name, value in changes.items():
            if value is not None:
                assigned.checked(self.blocks.tables, value, f"{name} of a face")
        if changes.get("transfer") is not None and changes["transfer"] < 0.0:
            raise CommandError(f"a transfer coefficient must not be negative, got {changes['transfer']:g}")
        for row in np.unique(self.face[at]).tolist():
            wanted = replace(self.faces[row], **changes)
            if wanted.transfer is not None and wanted.environment is None:
                raise CommandError(f"a transfer coefficient of faces goes with environment-{self.quantity}")
            if wanted.environment is not None and wanted.transfer is None:
                mine = at[self.face[at] == row]
                h = self._transfers[mine // 4]
                if (h == 0.0).any():
                    raise CommandError(
                        f"environment-{self.quantity} needs a transfer coefficient: face {mine[h == 0.0][0]} has none, "
                        "nor has its element"
                    )
        with self.changing():
            self.blocks._change_rows(self.faces, self.face, at, changes)

    def remove_face_conditions(self, faces: np.ndarray | None) -> None:
        """Nothing passes through faces (None: all)."""
        self._unset(self.face, faces)

    def _need_model(self) -> None:
        if not self.rows:
            raise CommandError(f"there is no {self.name} yet: {self.command} comes first")

    @property
    def command(self) -> str:
        """The one that gives elements the model."""
        return f"element c-model {self.model.name.replace('_', '-')}"

    def uses_table(self, name: str) -> bool:
        """Whether a node or a face follows this table. Not collective."""
        of_faces = (asdict(one).values() for one in assigned.in_use(self.faces, self.face))
        held = assigned.in_use(self.prescribed, self._all_held(), 1)
        return name in held or any(name in of_face for of_face in of_faces)

    def _all_held(self) -> np.ndarray:
        """Rows of all that is prescribed."""
        return self.held

    def _content(self) -> float:
        """What is in all elements, above the zero of the scale, by the capacities of their columns."""
        cold = self.blocks.cold
        return exact_sum((cold[self.capacities] * cold[self.quantity]).reshape(-1), self.blocks.comm)

    def account(self) -> dict[str, float]:
        """What there was since there is a model: given by conditions, brought by commands (initial values, changes of
        capacity), stored in elements, above the zero of the scale, removed with elements; closing: what does not add
        up, relative: that over the largest."""
        self.blocks.close_model()
        found = {"given": self._sum(self._booked(), self.accounts["given"]), "commands": self.accounts["commands"],
                 "stored": self._content(), **self._stored_besides(), "removed": self.accounts["removed"]}  # fmt: skip
        less = reduce(sub, list(found.values())[2:], found["given"] + found["commands"])
        return closed(found, less)

    def _booked(self) -> np.ndarray:
        """What conditions gave, on this rank."""
        return self.blocks.cold[self.given].reshape(-1)

    def _stored_besides(self) -> dict[str, float]:
        """Where else some is."""
        return {}

    def means(self) -> np.ndarray:
        """(n_own,) of the corners of elements; the model is closed. Not collective."""
        return by_temperature.means(self.blocks, self.quantity)

    def eigenstress(self, blocks: Any) -> np.ndarray | None:
        if not self.expands or self.quantity not in blocks.cold:
            return None
        if self._stiffness_of is not blocks.number:  # whatever changes it makes storage of its own
            number = blocks.number[blocks.owned]
            of = moduli(blocks.element_rows, blocks.options.plane_stress)
            bulk = of.bulk[blocks.element_row[number]]
            self._stiffness = len(of.normal) * bulk * self.column(self.expansion)[self.row[number]]
            self._quad, self._stiffness_of = blocks.the_mesh().cells[number, 3] >= 0, blocks.number
        out = np.empty(blocks.n_own)
        kernels.thermal_stress(
            self._quad, blocks.cold[self.quantity], self._stiffness, blocks.cold[self.unstressed].reshape(-1), out
        )  # fmt: skip
        if len(blocks.the_mesh().hexes):
            hexes = blocks.hex_rows()
            at, mean = hexes.rows, hexes.means(blocks.cold[self.quantity])
            out[at] = self._stiffness[at] * (blocks.cold[self.unstressed][at, 0] - mean[:, None])
        part = by_temperature.part_of_young(blocks)
        return out if part is None else out * part

    @property
    def expands(self) -> bool:
        """Elements get stress from it. Not collective."""
        if not self.expansion:
            return False
        if self._expands is None:
            self._expands = bool(self.column(self.expansion)[self.row[self.blocks.alive]].any())
        return self._expands

    def corners(self, blocks: Any) -> np.ndarray:
        return np.zeros((blocks.n_own, 4), bool)

    def add_to(self, applied: np.ndarray) -> None:
        """Its stress is in the elements."""

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Elements around a node of the field."""
        cells, stride = blocks.the_mesh().cells[blocks.number], blocks.stride
        far = np.zeros(1)
        for k in range(4):
            there = cells[:, k] >= 0
            if there.any():
                way = blocks.x[there, stride * k : stride * k + blocks.dim] - middle[there]
                far[0] = max(far[0], float((way * way).sum(axis=1).max()))
        return 2.0 * math.sqrt(float(blocks.comm.max_into(far)[0])) + SPREAD * float(blocks.mean_edge)

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners, or something was said."""
        blocks, halo = self.blocks, self.blocks.halo
        self._make_columns()
        cold, own = blocks.cold, blocks.owned
        width = cold[self.quantity].shape[1]
        before = self._content()
        was = cold[self.quantity].copy()
        self.t, weight = (np.zeros((len(blocks.number), width)) for _ in range(2))
        self.t[own], weight[own] = cold[self.quantity], cold[self.capacities]
        halo.fill(self.t)
        halo.fill(weight)
        each = self._capacities()[self.row[blocks.number]]
        self._corner_capacity = each[:, None] * blocks.local.true_mass[:, :width]
        changed = not np.array_equal(cold[self.capacities], self._corner_capacity[own])
        cold[self.capacities] = self._corner_capacity[own].copy()
        cold[self.quantity] = self.t[own]  # one place for both
        self._make_conductances()
        self._bind_others()
        self._make_nodes()
        kernels.unite(self._begin, self._corner, weight.reshape(-1), self.t.reshape(-1))
        united = blocks.comm.any(not np.array_equal(was, cold[self.quantity]))
        if united:
            halo.fill(self.t)
            blocks.local.follow_heat()
        if blocks.comm.any(changed) or united:
            self.accounts["commands"] += self._content() - before
        self._bound()
        self._checked = False
        self._find_step()
        if not blocks.options.mechanical and self._sets_pace():
            blocks.clock.dt = self.sub_steps * self.dt

    def _bind_others(self) -> None:
        """Conductances are known, nodes not yet."""

    def _bound(self) -> None:
        """All tables of this rank are there but the length of sub-steps."""

    def _sets_pace(self) -> bool:
        """The clock of the model is that of this field where blocks stand still."""
        pace = (one for one in self.blocks.surface_loads if one.keeps_time)
        return next(pace, self) is self

    def _make_conductances(self) -> None:
        blocks, number = self.blocks, self.blocks.number
        self._g = np.empty((len(number), 6 if self.t.shape[1] == 4 else 3))
        mesh = blocks.reference
        make = kernels_space.conductances if blocks.dim == 3 else kernels.conductances
        make(number, mesh.points, mesh.cells, self._conductivities(number), self._g)
        self._q = np.zeros_like(self.t)
        self.hexes: Hexes | None = None
        if len(hexes := blocks.the_mesh().hexes):
            self.hexes = Hexes(blocks, self._conductivities(hexes[:, 8]))
            self._g[self.hexes.rows] = 0.0

    def _tell_obtuse(self) -> None:
        """Where flat angles make it flow from low to high: values of explicit steps may leave the range of those around
        them. Rank 0 alone."""
        blocks = self.blocks
        if self._told_obtuse or blocks.log is None or blocks.dim == 2:
            return
        self._told_obtuse = True
        mesh = blocks.the_mesh()
        heated = blocks.alive & (self.row > 0)
        every = np.flatnonzero(heated & (mesh.macro_of() < 0))
        g = np.empty((len(every), 6))
        kernels_space.conductances(every, mesh.points, mesh.cells, self._conductivities(every), g)
        hexes = mesh.hexes[heated[mesh.hexes[:, 8]]]
        of_hexes = conductances(mesh.points, hexes, self._conductivities(hexes[:, 8]))
        corners = 4 * hexes[:, 8:] + hexahedra.places(mesh.cells, hexes)[0]
        ends = np.concatenate([
            self.node[every][:, kernels.PAIRS].reshape(-1, 2),
            self.node.reshape(-1)[corners][:, kernels_space.HEX_PAIRS].reshape(-1, 2),
        ])  # fmt: skip
        ends.sort(axis=1)
        key, at = np.unique(ends[:, 0] * len(self.leads) + ends[:, 1], return_inverse=True)
        along = np.append(g, of_hexes)
        total = np.bincount(at.reshape(-1), along, len(key))
        size = np.bincount(at.reshape(-1), np.abs(along), len(key))
        against = total < -1e-12 * size
        if against.any():
            blocks.log.warn_once(
                f"obtuse tetrahedra {self.name}",
                f"along {int(against.sum())} of {len(key)} edges {self.name} is conducted from the {self.low_to_high} "
                f"end, as angles between faces are obtuse (in {int((g < 0.0).any(axis=1).sum())} of {len(every)} "
                "tetrahedra"
                + (f" and {int((of_hexes < 0.0).any(axis=1).sum())} of {len(hexes)} hexahedra" if len(hexes) else "")
                + "): near steep fronts "
                + self.several
                + " may leave the range of those around them",
            )

    def _make_nodes(self) -> None:
        """Nodes of the field that this rank's elements have, and exposed faces, as faces hang together now."""
        blocks, mesh, own = self.blocks, self.blocks.the_mesh(), self.blocks.owned
        dead = np.repeat(~blocks.alive, 4)
        node, lead = mesh.corner_clusters(blocks.partner, blocks.open | dead)
        node[~blocks.alive] = -1
        node = node.astype(np.int32, copy=False)
        self.node, self.leads = node, lead
        self._tell_obtuse()
        sizes = np.bincount(node[node >= 0], minlength=len(lead))
        member_begin = np.zeros(len(lead) + 1, np.int32)
        member = np.empty(int(sizes[sizes > 1].sum()), np.int32)
        build.cluster_members(node, sizes, member_begin, member)
        real = node[blocks.number[own]] >= 0
        nothing, scratch = np.empty(0, np.int64), np.full(len(lead), -1, np.int64)
        args = blocks.number, blocks.n_left, blocks.n_own, real, node, member_begin, scratch
        n = build.special_nodes(*args, nothing, nothing, nothing)
        first, start, one = (np.empty(n, np.int64) for _ in range(3))
        build.special_nodes(*args, first, start, one)
        width, total = self.t.shape[1], int(one.sum())
        begin = np.zeros(n + 1, np.int64)
        corner, place, again = (np.empty(total, np.int64) for _ in range(3))
        lost = build.place_nodes(
            first, start, one, member, blocks.where, mesh.cells, blocks.v.shape[1], FORCE, 2, blocks.local.true_mass,
            begin, corner, place, again, np.empty(n),
        )  # fmt: skip
        lost = int(blocks.comm.max_into(np.array([lost], np.int64))[0])
        if lost >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the node of {self.name} at corner {lost} spans more than a column of "
                f"{blocks.rebuild_state.side:g} m: joints that are not broken have opened too far"
            )
        self._begin, self._corner = begin, corner // 8 * width + corner % 8 // 2
        self.node_ids = node[first // 4, first % 4]
        self.capacity = np.empty(n)
        kernels.sums(begin, self._corner, self._corner_capacity.reshape(-1), self.capacity)
        lead_point = mesh.cells[first // 4, first % 4]
        self._held = self.held[lead_point].astype(np.int64) - 1
        self._make_faces()
        self._find_limit()
        self._stale = False
        self.find_contacts()

    def renew_nodes(self) -> None:
        """Nodes are those of the joints that hold now; the model is closed."""
        if self._stale:
            self._make_nodes()

    @property
    def nodes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """begin, corner and held of kernels.warm, of the nodes that this rank's elements have; `node_ids`: their
        numbers among those of the model, whose lowest corners are `leads`. Not to be changed. Not collective."""
        return self._begin, self._corner, self._held

    @property
    def conductances(self) -> np.ndarray:
        """Of the elements held here, see `kernels.conductances`; parts of hexahedra have none, see `hexes`. Not to be
        changed. Not collective."""
        return self._g

    def transfers(self, everywhere: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Exposed faces (m,), their corners (m, 2 or 3), element * 4 + k, and what each passes on to one of them per
        degree [W/(m K)]: of this rank's elements, or of all. Not collective."""
        at, ends, half = self._exposed()
        if not everywhere:
            row = self.blocks.where[at // 4]
            mine = (row >= self.blocks.owned.start) & (row < self.blocks.owned.stop)
            at, ends, half = at[mine], ends[mine], half[mine]
        h = self._transfers[at // 4]
        own = np.array([math.nan if one.transfer is None else one.transfer for one in self.faces])[self.face[at]]
        there = np.array([one.environment is not None for one in self.faces])[self.face[at]]
        transfer = half * np.where(there, np.where(np.isnan(own), h, own), 0.0)
        return at, ends, transfer

    def _exposed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Free faces with a condition, of all ranks: numbers (m,), their corners (m, 2), in space (m, 3), element * 4 +
        k, and the part of the face of each: half the length [m], in space a third of the area [m2]. Those of hexahedra
        come twice, as both ways to cut their sides have it."""
        blocks = self.blocks
        at = np.flatnonzero((self.face > 0) & blocks.face_exists() & ~blocks.closed_faces())
        return self._parts_of(at)

    def _parts_of(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of any faces."""
        mesh = self.blocks.the_mesh()
        if len(mesh.hexes):
            ends, area, of = with_other_cuts(mesh, faces)
            return faces[of], ends, area / 3.0
        ends = mesh.face_corners(faces)
        return faces, ends, sizes_of(self.blocks.reference.points[mesh.face_points(faces)]) / ends.shape[1]

    def _make_faces(self) -> None:
        """Exposed faces of the elements held here, by their numbers."""
        blocks = self.blocks
        at, ends, half = self._exposed()
        held = blocks.where[at // 4] >= 0
        at, ends, self._half = at[held], ends[held], half[held]
        e = at // 4
        self._face_corner = blocks.where[ends // 4] * self.t.shape[1] + ends % 4
        # One row for each condition and coefficient of the element.
        h = self._transfers[e]
        pairs, which = np.unique(np.column_stack([self.face[at].astype(float), h]), axis=0, return_inverse=True)
        self._face_row, self._face_pairs = which.reshape(-1).astype(np.int64), pairs

    def _faces_at(self, time: float) -> np.ndarray:
        """The table of conditions (rows, 3) at a time of heat."""
        table = np.zeros((len(self._face_pairs), 3))
        for row, (condition, h) in enumerate(self._face_pairs):
            one = self.faces[int(condition)]
            table[row, kernels.FLUX] = assigned.now(self.blocks.tables, one.flux, time)
            if one.environment is not None:
                table[row, kernels.TRANSFER] = h if one.transfer is None else one.transfer
                table[row, kernels.ENVIRONMENT] = assigned.now(self.blocks.tables, one.environment, time)
        return table

    def held_at(self, time: float) -> np.ndarray:
        """Prescribed temperatures (rows,) at a time of heat."""
        return np.array([assigned.now(self.blocks.tables, one, time) for one in self.prescribed[1:]], np.float64)

    def _find_limit(self) -> None:
        """Longest stable sub-step of nodes that are not held [s], by Gershgorin's circles: C over half the sum of
        conductances and of their sizes, and of the transfer at faces; infinite where there is none."""
        g, width = self._g, self.t.shape[1]
        each = 0.5 * (g + np.abs(g))
        corner = np.zeros((len(g), width))
        for pair, (a, b) in enumerate(kernels.PAIRS[: g.shape[1]]):
            corner[:, a] += each[:, pair]
            corner[:, b] += each[:, pair]
        if self.hexes is not None:
            self.hexes.add_sizes(corner.reshape(-1))
        h = self._faces_at(self.time)[:, kernels.TRANSFER][self._face_row]
        np.add.at(
            corner.reshape(-1), self._face_corner.reshape(-1), np.repeat(self._half * h, self._face_corner.shape[1])
        )
        self._add_to_limit(corner)
        total = np.empty(len(self.capacity))
        kernels.sums(self._begin, self._corner, corner.reshape(-1), total)
        free = (self._held < 0) & (total > 0.0)
        least = float((self.capacity[free] / total[free]).min(initial=math.inf))
        self._limit = float(self.blocks.comm.min_into(np.array([least]))[0])

    def limit(self) -> float:
        """The stability limit of a sub-step [s]."""
        return self._limit

    def _add_to_limit(self, corner: np.ndarray) -> None:
        """Add what else passes to corners (n, w), per degree."""

    def _given_clock(self) -> tuple[int, float]:
        """Sub-steps of a cycle, 0: as many as are needed, and their length [s], 0: that of the blocks."""
        return self.own_steps, self.own_dt

    def _cycle_time(self) -> float:
        """Of a cycle by the clock of others [s], 0: it has one of its own."""
        o = self.blocks.options
        if o.mechanical:
            return self._period() if o.dynamic else 0.0
        return 0.0 if self._sets_pace() else self.blocks.clock.dt

    def _period(self) -> float:
        """Time of blocks in motion that a cycle stands for [s]."""
        return self._every() * self.blocks.clock.dt

    def _every(self) -> int:
        """Steps of the blocks between two cycles."""
        return 1

    def _given(self) -> tuple[float, ...]:
        """What the length of a sub-step follows from, beside the limit."""
        return (*map(float, self._given_clock()), self._cycle_time(), self._limit)

    def _find_step(self) -> None:
        """Sub-steps of a cycle and their length, from what was given and what is stable."""
        o = self.blocks.options
        self._found_for = self._given()
        if not self.on:
            return
        limit, period, (steps, dt) = SAFETY * self._limit, self._cycle_time(), self._given_clock()
        if dt > 0.0:
            self.sub_steps, self.dt = max(1, steps), dt
        elif period == 0.0:
            if not math.isfinite(limit) and not o.mechanical:
                raise CommandError(f"no {self.name} can flow: all nodes are held; {self.set_step} gives it a clock")
            self.sub_steps, self.dt = max(1, steps), limit
        else:
            self.sub_steps = steps or max(1, math.ceil(period / limit))
            self.dt = period / self.sub_steps
        if not steps and self.sub_steps > MANY:
            raise CommandError(
                f"{self.name} would need {self.sub_steps} sub-steps of {limit:.3g} s in a cycle of {period:.3g} s; "
                f"{self.set_step} gives it a clock of its own"
            )
        self._tell_step()

    def _tell_step(self) -> None:
        log = self.blocks.log
        if log is None or not math.isfinite(self.dt) or abs(self.dt - self._told) <= 0.1 * self._told:
            return
        self._told, said = self.dt, partial(with_prefix, unit="s")
        log.info(
            f"{self.name}: {counted(self.sub_steps, 'sub-step')} of {said(self.dt)} in each cycle; the stability limit "
            f"is {said(self._limit)}"
        )
        if self.dt > self._limit:
            log.warn_once(
                f"{self.name} step",
                f"the {self.word} time step {self.dt:g} s is {self.dt / self._limit:.2f} of the stability limit "
                f"{self._limit:.4g} s; a run that blows up should be repeated with a smaller one{self.otherwise}",
            )

    def check_complete(self) -> None:
        blocks = self.blocks
        bare = np.flatnonzero((self.row == 0) & blocks.alive & self.on)
        if len(bare):
            at = ", ".join(f"{c:g}" for c in blocks.the_mesh().centroids(bare[:1])[0])
            raise CommandError(
                f"element {bare[0]} at ({at}) has no {self.kind_of_model} model ({len(bare)} in all), but others have: "
                f"{self.command} for all"
            )

    def check_elements(self) -> None:
        """CommandError if an element lacks a model. Not collective."""
        self.check_complete()
        blocks = self.blocks
        if blocks.dim == 2 and self.expands and user_laws.in_use(blocks):
            raise CommandError(
                f"{user_laws.some(blocks)} has a law of the user, which in two dimensions knows no strain e33 of "
                f"{self.name}: {self.expansion.replace('_', '-')} must be 0 with it"
            )

    def check_start(self) -> None:
        if not self.rows or self._checked:
            return
        self.check_elements()
        o = self.blocks.options
        if self.on and o.mechanical and not o.dynamic and self._given_clock()[1] == 0.0 == self._cycle_time():
            raise CommandError(
                f"in static runs time of {self.name} passes by {self.set_step}, which comes first; or "
                f"{self.switch_off} leaves {self.several} as they are"
            )
        self._checked = True

    def joints_opened(self) -> None:
        """Joints broke: nothing is conducted across them any more."""
        self._stale = True

    def elements_removed(self, elements: np.ndarray) -> None:
        """What is in them is gone with them."""
        blocks = self.blocks
        self._expands = None
        if self.quantity not in blocks.cold:
            return
        mine = np.isin(blocks.number, elements)
        t, c, given = (blocks.cold[name][mine].reshape(-1) for name in (self.quantity, self.capacities, self.given))
        self.accounts["removed"] += exact_sum(t * c, blocks.comm)
        self.accounts["given"] += exact_sum(given, blocks.comm)

    def mesh_replaced(self) -> None:
        """There is another mesh: `of_mesh` says that this is gone with the one before."""

    def follow(self) -> None:
        """It flows for as long as the step that the elements have moved by."""
        blocks = self.blocks
        if not self.on:
            return
        self.waited += 1
        self._step_done()
        if self._waits():
            return
        self.waited = 0
        with blocks.timers(self.name):
            self.renew_nodes()
            self._begin_cycle()
            if self._found_for != self._given():
                self._find_step()
            if blocks.budget is not None and blocks.options.dynamic and (self.expands or blocks.local.warms):
                blocks.budget.pause(blocks, by_heat=True)
            self._sub_steps()
            self.cycles += 1
            self._cycle_done()
            blocks.local.follow_heat()
        if self.cycles % LOOK == 0:
            self._check_finite()

    def _step_done(self) -> None:
        """The blocks have moved by a step."""

    def _waits(self) -> bool:
        """More steps of the blocks come before the next cycle."""
        return self.blocks.options.mechanical and self.waited < self._every()

    def _begin_cycle(self) -> None:
        """Nodes are those of the joints that hold now; the length of sub-steps is that of the last cycle."""

    def _sub_steps(self) -> None:
        for _ in range(self.sub_steps):
            self._sub_step()

    def _cycle_done(self) -> None:
        """Sub-steps are done."""

    def _own_corners(self) -> tuple[int, int]:
        """From where to where this rank's corners lie in t, flat."""
        width, own = self.t.shape[1], self.blocks.owned
        return width * own.start, width * own.stop

    def inflow(self, time: float, dt: float) -> np.ndarray:
        """What flows (n, w) to the corners of the elements held here, per second, with the conditions of faces of a
        time of the field; what these bring in dt [s] is booked. Collective where it comes from elsewhere too."""
        threads = self.blocks.threads
        (kernels.conduct if threads == 1 else kernels.conduct_threaded)(threads, self.t, self._g, self._q)
        if self.hexes is not None:
            self.hexes.conduct(self.t.reshape(-1), self._q.reshape(-1))
        if len(self._face_row):
            t, q, given = (part.reshape(-1) for part in (self.t, self._q, self.blocks.cold[self.given]))
            kernels.through_faces(
                self._face_corner, self._half, self._face_row, self._faces_at(time), *self._own_corners(), t, q, dt,
                given,
            )  # fmt: skip
        if self._add_inflow(self._q):
            self.blocks.halo.fill(self._q)  # elements of other ranks touch more than is held here
        return self._q

    def _add_inflow(self, q: np.ndarray) -> bool:
        """Add what flows to corners (n, w) otherwise; whether it must be known of other ranks' elements."""
        return False

    def _sub_step(self) -> None:
        blocks, threads = self.blocks, self.blocks.threads
        q = self.inflow(self.time, self.dt).reshape(-1)
        self.time += self.dt
        first, last = self._own_corners()
        t, given = self.t.reshape(-1), blocks.cold[self.given].reshape(-1)
        (kernels.warm if threads == 1 else kernels.warm_threaded)(
            threads, self._begin, self._corner, self.capacity, self._held, self.held_at(self.time), first, last,
            self.dt, q, t, given,
        )  # fmt: skip
        blocks.halo.fill(self.t)

    def _check_finite(self) -> None:
        """Stop on all ranks if it has blown up."""
        blocks = self.blocks
        first = self._lowest(blocks.number[blocks.owned][~np.isfinite(blocks.cold[self.quantity]).all(axis=1)])
        if first >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the {self.quantity} of element {first} is not finite; the {self.word} time "
                f"step {self.dt:g} s is probably too large (stable: {self._limit:g} s)"
            )

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """All but the columns, as JSON values; those of elements are saved with these."""
        own = {name: getattr(self, name) for name in ("prescribed", "accounts", *self.kept)}
        return {"rows": self._saved_properties(), "faces": [asdict(one) for one in self.faces], "time": self.time,
                "cycles": self.cycles, "waited": self.waited, **own}  # fmt: skip

    def saved_tables(self) -> Tables:
        """Elements with their properties, prescribed nodes and faces, of all ranks."""
        rows = {"elements": self.row, "points": self.held, "faces": self.face}
        return {f"{self.name}_{name}": assigned.numbered(row) for name, row in rows.items()}

    @classmethod
    def restored(cls, blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> Self:
        """Inverse of these: the blocks have this field."""
        made = cls.of(blocks)
        made._restore_properties(state["rows"])
        made._restore_clock(state)
        made.faces = [FaceCondition(**one) for one in state["faces"]]
        for name in ("prescribed", "accounts", *made.kept):
            setattr(made, name, state.get(name, getattr(made, name)))
        for name, row in (("elements", made.row), ("points", made.held), ("faces", made.face)):
            assigned.put_back(row, tables[f"{made.name}_{name}"])
        return made
