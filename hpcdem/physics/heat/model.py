"""Heat in the elements of blocks: what is said of it, its clock and its step.

What is said (properties, conditions) is known to all ranks by the numbers of the mesh. Temperatures belong to corners
of elements and travel with them, as positions do (columns of `State.cold`); corners that hang together through faces
that are not broken are one node of heat and carry equal copies. Where joints break corners part with the temperature
that they have: each side of a crack has its own. Every holder of a node adds the heat of all its corners in the
order of elements, so the bits depend on neither ranks nor threads.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.units import counted, with_prefix
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import build, by_temperature, hexahedra, said, user_laws
from hpcdem.physics.fdem.kernels.elements import FORCE
from hpcdem.physics.fdem.mesh import sizes as sizes_of
from hpcdem.physics.fdem.pairs_space import Surface
from hpcdem.physics.fdem.properties import ELEMENT
from hpcdem.physics.fdem.said import Number
from hpcdem.physics.fdem.surface_loads import SurfaceLoad
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat import friction, kernels, kernels_space
from hpcdem.physics.heat.fluid import FluidHeat
from hpcdem.physics.heat.hexes import Hexes, conductances, facing, with_other_cuts
from hpcdem.physics.heat.properties import ISO_HEAT

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

SAFETY = 0.9
"""Part of the stability limit that an estimated sub-step may be."""
LOOK = 100
"""Cycles of heat after which it is looked whether it has blown up."""
RARELY, MOST = 1e-2, 10
"""Part of the stability limit for which heat by itself waits while blocks move, and steps of these, at most."""
MANY = 100_000
"""Sub-steps in a cycle that are too many to be meant."""
NEAR, DEEP = 1e-3, 0.2
"""How far apart, and how deep in each other, faces may be that touch for heat, over the mean edge."""
SPREAD = 0.1
"""By how much of the mean edge corners of one node may be apart, in joints that open."""
TEMPERATURE, GIVEN, CAPACITY, UNSTRESSED = "temperature", "heat_given", "heat_capacity", "unstressed"
RUBBED = "heat_of_friction"
"""Columns of elements: of corners temperature [K], heat that conditions gave [J/m], heat capacity [J/(m K)]; mean
temperature at which the element is free of thermal stress [K]; of corners heat of friction that waits for the next
cycle [J/m]."""
_NAMES = tuple(one.name for one in ISO_HEAT.properties)


@dataclass(frozen=True)
class FaceCondition:
    """Of faces: flux into the element [W/m2]; environment: temperature around it [K], None: none; transfer: heat
    transfer coefficient to it [W/(m2 K)], None: that of the element."""

    flux: Number = 0.0
    transfer: float | None = None
    environment: Number | None = None


class Heat(SurfaceLoad):
    """The heat of a model of blocks. Methods are collective unless they say otherwise; CommandError, alike on all
    ranks, for what makes no sense.

    row (ne,): of the table of properties, by element, 0: none; held (np,): row of the prescribed temperatures, 0: none;
    face (4 ne,): row of the conditions of faces. t (n, w): temperatures at the corners of all elements held here.
    """

    name: ClassVar[str] = "heat"
    kernel_kind: ClassVar[str] = "heat"
    of_mesh: ClassVar[bool] = True

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks
        mesh = blocks.the_mesh()
        self.row = np.zeros(len(mesh.cells), np.int32)
        self.held = np.zeros(len(mesh.points), np.int32)
        self.face = np.zeros(mesh.cells.size, np.int32)
        self.rows: list[tuple[float, ...]] = []
        self.prescribed: list[Number] = [0.0]
        self.faces: list[FaceCondition] = [FaceCondition()]
        self.accounts = dict.fromkeys(("given", "commands", "removed"), 0.0)
        """Heat [J/m]: that conditions gave to elements that are gone, that commands brought, that is gone with
        elements."""
        self.time = blocks.clock.time
        self.cycles = self.waited = self.sub_steps = 0
        self.every, self.owed = 1, 0.0
        """Steps of blocks in motion before the next cycle, and the time [s] that has passed in those since the last."""
        self.dt = 0.0
        self.t = np.empty((0, 3))
        self._stale = True
        self._checked = False
        self._expands: bool | None = None
        self._stiffness_of: np.ndarray | None = None
        self._stiffness, self._quad = np.empty(0), np.empty(0, bool)
        self.fluid: FluidHeat | None = None
        self._found_for: tuple[float, ...] = ()
        self._passes = False
        self._pairs_of: Any = None
        self._facing = np.empty((2, 0, 3), np.int64), np.empty(0)
        self._touch = np.empty((0, 4), np.int64), np.empty((0, 4)), np.empty(0)
        self._rubs = False
        self._power: np.ndarray | None = None
        self._told = 0.0
        self._told_obtuse = False
        self._limit = math.inf

    @property
    def stays(self) -> bool:
        return True

    @staticmethod
    def there(blocks: Blocks) -> Heat | None:
        """That of a model, None if it has none. Not collective."""
        return next((load for load in blocks.surface_loads if isinstance(load, Heat)), None)

    @staticmethod
    def of(blocks: Blocks) -> Heat:
        """That of a model, made on the first call. Not collective."""
        found = Heat.there(blocks)
        if found is None:
            found = Heat(blocks)
            blocks.surface_loads.add(found)
        return found

    # ---- what is said --------------------------------------------------------------------------------------------

    def assign(self, elements: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Elements (None: all) have this thermal model; at the temperature that they have now they are free of thermal
        stress."""
        at = self.blocks.numbers_of_elements(elements)
        self._put(at, self.blocks.complete(ELEMENT, at, ISO_HEAT, {}, given))
        self._take_unstressed(at)

    def adjust(self, elements: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Change some properties of elements that have the model; None: of all that have it."""
        at = np.flatnonzero(self.row) if elements is None else self.blocks.numbers_of_elements(elements)
        bare = at[self.row[at] == 0]
        if len(bare):
            raise CommandError(f"{ELEMENT} {bare[0]} has no thermal model whose properties could be changed")
        old = np.array(self.rows)[self.row[at] - 1]
        self._put(at, self.blocks.complete(ELEMENT, at, ISO_HEAT, dict(zip(_NAMES, old.T)), given))

    def of_fluid(self) -> FluidHeat:
        """The heat of the fluid, made on the first call. Not collective."""
        if self.fluid is None:
            flow = Flow.there(self.blocks)
            if flow is None:
                raise CommandError("there are no channels yet: face-joint c-model hydraulic-porous-medium comes first")
            self._need_model()
            self.fluid = FluidHeat(self, flow)
        return self.fluid

    @property
    def flowing(self) -> FluidHeat | None:
        """The heat of the fluid, None without channels that have it. Not collective."""
        return self.fluid if self.fluid is not None and self.fluid.on else None

    def _put(self, at: np.ndarray, values: np.ndarray) -> None:
        """Elements (n,) have these complete properties, (n, k) or (1, k) for all."""
        blocks = self.blocks
        rows, row = said.with_rows(self.rows, self.row, at, values)
        blocks.before_change()
        self.rows, self.row, self._expands = rows, row, None
        self._make_columns()
        blocks.changed(stiffness=False)

    def _make_columns(self) -> None:
        """The columns of elements; the model is open."""
        cold, n = self.blocks.cold, len(self.blocks.number)
        if TEMPERATURE not in cold:
            for name in (TEMPERATURE, GIVEN, CAPACITY):
                cold[name] = np.zeros((n, self.blocks.corners))
            cold[UNSTRESSED] = np.zeros((n, 1))

    def _take_unstressed(self, elements: np.ndarray) -> None:
        """These elements, and hexahedra that they are parts of, are free of thermal stress as they are; the model is
        open. Collective."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        number, t = blocks.number, blocks.cold[TEMPERATURE]
        found = by_temperature.of_corners(mesh, number, t)
        chosen = np.isin(number, elements)
        if len(mesh.hexes):
            of = mesh.hex_of()
            some = np.zeros(len(mesh.hexes) + 1, bool)  # the last one: of no hexahedron
            some[of[elements]] = True
            some[-1] = False
            mine = np.flatnonzero(some[of[number]])
            found[mine] = self._means_of_parts(number[mine], t[mine])
            chosen[mine] = True
        blocks.cold[UNSTRESSED][chosen, 0] = found[chosen]

    def _means_of_parts(self, number: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Means (n,) of the hexahedra that these elements are parts of, which may be shared out among ranks, as
        `hexahedra.Rows` has them; t (n, 4): temperatures of their corners. Collective."""
        mesh, comm = self.blocks.the_mesh(), self.blocks.comm
        which, at = np.unique(mesh.hex_of()[number], return_inverse=True)
        hexes = mesh.hexes[which]
        _, parts = hexahedra.corner_parts(mesh.points, mesh.cells, hexes)
        own = (parts[at, number - hexes[at, 8]] * t).sum(axis=1)
        pieces = [(number, own)] if comm.size == 1 else comm.allgather((number, own))
        every, first = np.unique(np.concatenate([piece[0] for piece in pieces]), return_index=True)
        means = np.concatenate([piece[1] for piece in pieces])[first].reshape(-1, hexahedra.PARTS).sum(axis=1)
        return means[np.searchsorted(every[:: hexahedra.PARTS], hexes[at, 8])]

    def initial(self, nodes: np.ndarray | None, temperature: float) -> None:
        """Nodes (None: all) have this temperature now, and the fluid at them; elements around them are free of thermal
        stress."""
        blocks = self.blocks
        if not math.isfinite(temperature):
            raise CommandError(f"a temperature must be finite, got {temperature}")
        at = blocks.numbers_of_nodes(nodes)
        self._need_model()
        blocks.before_change()
        before = self._content()
        chosen = np.zeros(len(blocks.the_mesh().points) + 1, bool)  # the last one is for the fourth corner of triangles
        chosen[at] = True
        t, cells = blocks.cold[TEMPERATURE], blocks.the_mesh().cells
        corners = chosen[cells[blocks.number, : t.shape[1]]]
        t[corners] = temperature
        self.accounts["commands"] += self._content() - before
        self._take_unstressed(np.flatnonzero(chosen[cells].any(axis=1)))
        blocks.changed(stiffness=False)
        if (fluid := self.flowing) is not None:
            fluid.initial(at, temperature)

    def prescribe(self, nodes: np.ndarray | None, temperature: Number) -> None:
        """Nodes (None: all) have this temperature from now on, a number or a table over the time of heat."""
        at = self.blocks.numbers_of_nodes(nodes)
        self._need_model()
        row = self._row_of(temperature)
        self.blocks.before_change()
        self.held[at] = row
        self.blocks.changed(stiffness=False)

    def _row_of(self, temperature: Number) -> int:
        """Of this prescribed temperature."""
        said.checked(self.blocks.tables, temperature, "the temperature of a node")
        if temperature not in self.prescribed[1:]:
            self.prescribed.append(temperature)
        return 1 + self.prescribed[1:].index(temperature)

    def prescribe_fluid(self, nodes: np.ndarray | None, temperature: Number) -> None:
        """The same of the fluid at flow nodes among these."""
        if (fluid := self.flowing) is None:
            raise CommandError("the fluid has no heat yet: face-joint c-model thermal-fluid comes first")
        fluid.prescribe(nodes, self._row_of(temperature))

    def expose(self, faces: np.ndarray | None, **changes: Any) -> None:
        """Faces (None: all) have these conditions, fields of `FaceCondition`; the others of theirs stay."""
        at = self.blocks.numbers_of_faces(faces)
        self._need_model()
        for name, value in changes.items():
            if value is not None:
                said.checked(self.blocks.tables, value, f"{name} of a face")
        if changes.get("transfer") is not None and changes["transfer"] < 0.0:
            raise CommandError(f"a transfer coefficient must not be negative, got {changes['transfer']:g}")
        for row in np.unique(self.face[at]).tolist():
            wanted = replace(self.faces[row], **changes)
            if wanted.transfer is not None and wanted.environment is None:
                raise CommandError("a transfer coefficient of faces goes with environment-temperature")
            if wanted.environment is not None and wanted.transfer is None:
                mine = at[self.face[at] == row]
                h = self.column("transfer_coeficient")[self.row[mine // 4]]
                if (h == 0.0).any():
                    raise CommandError(
                        f"environment-temperature needs a transfer coefficient: face {mine[h == 0.0][0]} has none, nor "
                        "has its element"
                    )
        self.blocks.before_change()
        self.blocks._change_rows(self.faces, self.face, at, changes)
        self.blocks.changed(stiffness=False)

    def set_clock(self, time: float) -> None:
        """The clock of heat shows this time [s]."""
        self.blocks.before_change()
        self.time = time
        self.blocks.changed(stiffness=False)

    def remove_conditions(self, nodes: np.ndarray | None, rock: bool = True, fluid: bool = True) -> None:
        """Nodes (None: all) are no longer held, nor is the fluid at them."""
        self.blocks.before_change()
        if rock:
            self.held[slice(None) if nodes is None else nodes] = 0
        if fluid and self.fluid is not None:
            self.fluid.held[slice(None) if nodes is None else nodes] = 0
        self.blocks.changed(stiffness=False)

    def remove_face_conditions(self, faces: np.ndarray | None) -> None:
        """Faces (None: all) are adiabatic."""
        self.blocks.before_change()
        self.face[slice(None) if faces is None else faces] = 0
        self.blocks.changed(stiffness=False)

    def _need_model(self) -> None:
        if not self.rows:
            raise CommandError("there is no heat yet: element c-model thermal-iso-heat comes first")

    def uses_table(self, name: str) -> bool:
        """Whether a node or a face follows this table. Not collective."""
        of_faces = (asdict(self.faces[row]).values() for row in np.unique(self.face).tolist())
        held = self.held if self.fluid is None else np.append(self.held, self.fluid.held)
        return any(self.prescribed[row] == name for row in np.unique(held).tolist() if row) or any(
            name in values for values in of_faces
        )

    def column(self, name: str) -> np.ndarray:
        """A property by rows (rows + 1,), 0 where there is no model. Not collective."""
        k = _NAMES.index(name)
        return np.array([0.0, *(row[k] for row in self.rows)])

    # ---- what is asked -------------------------------------------------------------------------------------------

    def _content(self) -> float:
        """Heat in all elements [J/m], above the zero of the scale, by the capacities of their columns."""
        cold = self.blocks.cold
        return exact_sum((cold[CAPACITY] * cold[TEMPERATURE]).reshape(-1), self.blocks.comm)

    def account(self) -> dict[str, float]:
        """Heat since there is a thermal model [J/m]: given by conditions and with fluid that came and went, brought by
        commands (initial temperatures, changes of capacity), stored in elements, above the zero of the scale, in the
        fluid, removed with elements and channels; closing: what does not add up, relative: that over the largest."""
        self.blocks.close_model()
        comm = self.blocks.comm
        booked = [self.blocks.cold[GIVEN].reshape(-1)]
        if comm.rank == 0:
            booked.append(np.array([self.accounts["given"]]))
        if self.fluid is not None:
            booked.append(self.fluid.given)
        found = {
            "given": exact_sum(np.concatenate(booked), comm), "commands": self.accounts["commands"],
            "stored": self._content(), "fluid": self.fluid.content() if self.fluid is not None else 0.0,
            "removed": self.accounts["removed"],
        }  # fmt: skip
        largest = max(map(abs, found.values()))
        found["closing"] = (
            found["given"] + found["commands"] - found["stored"] - found["fluid"] - found["removed"]
        )  # fmt: skip
        found["relative"] = abs(found["closing"]) / largest if largest > 0.0 else 0.0
        return found

    def element_temperatures(self) -> np.ndarray:
        """(n_own,) means of the corners [K]; the model is closed. Not collective."""
        return by_temperature.means(self.blocks)

    # ---- thermal stress ------------------------------------------------------------------------------------------

    def eigenstress(self, blocks: Any) -> np.ndarray | None:
        if not self.expands or TEMPERATURE not in blocks.cold:
            return None
        if self._stiffness_of is not blocks.number:  # whatever changes it makes storage of its own
            number = blocks.number[blocks.owned]
            bulk = np.array(blocks.element_rows.column("bulk"))[blocks.element_row[number]]
            self._stiffness = 3.0 * bulk * self.column("expansion_coeficient")[self.row[number]]
            self._quad, self._stiffness_of = blocks.the_mesh().cells[number, 3] >= 0, blocks.number
        out = np.empty(blocks.n_own)
        kernels.thermal_stress(
            self._quad, blocks.cold[TEMPERATURE], self._stiffness, blocks.cold[UNSTRESSED].reshape(-1), out
        )  # fmt: skip
        if len(blocks.the_mesh().hexes):
            hexes = blocks.hex_rows()
            at, mean = hexes.rows, hexes.means(blocks.cold[TEMPERATURE])
            out[at] = self._stiffness[at] * (blocks.cold[UNSTRESSED][at, 0] - mean[:, None])
        part = by_temperature.part_of_young(blocks)
        return out if part is None else out * part

    @property
    def expands(self) -> bool:
        """Elements have thermal stress. Not collective."""
        if self._expands is None:
            self._expands = bool(self.column("expansion_coeficient")[self.row[self.blocks.alive]].any())
        return self._expands

    # ---- tables of this rank -------------------------------------------------------------------------------------

    @property
    def on(self) -> bool:
        """Heat flows. Not collective."""
        return self.blocks.options.thermal and bool(self.rows)

    def corners(self, blocks: Any) -> np.ndarray:
        return np.zeros((blocks.n_own, 4), bool)

    def add_to(self, applied: np.ndarray) -> None:
        """Thermal stress is in the elements."""

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Elements around a node of heat."""
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
        width = cold[TEMPERATURE].shape[1]
        before = self._content()
        was = cold[TEMPERATURE].copy()
        self.t, weight = (np.zeros((len(blocks.number), width)) for _ in range(2))
        self.t[own], weight[own] = cold[TEMPERATURE], cold[CAPACITY]
        halo.fill(self.t)
        halo.fill(weight)
        heat = self.column("capacity")[self.row[blocks.number]]
        self._corner_capacity = heat[:, None] * blocks.local.true_mass[:, :width]
        changed = not np.array_equal(cold[CAPACITY], self._corner_capacity[own])
        cold[CAPACITY] = self._corner_capacity[own].copy()
        cold[TEMPERATURE] = self.t[own]  # one place for both
        self._make_conductances()
        parts = self.column("friction_heat")[self.row]
        self._rubs = bool((parts[blocks.alive] > 0.0).any())
        if self._rubs and RUBBED not in cold:
            cold[RUBBED] = np.zeros_like(cold[GIVEN])
        if self.fluid is not None:
            self.fluid.bind()
        self._make_nodes()
        kernels.unite(self._begin, self._corner, weight.reshape(-1), self.t.reshape(-1))
        united = blocks.comm.any(not np.array_equal(was, cold[TEMPERATURE]))
        if united:
            halo.fill(self.t)
            blocks.local.follow_heat()
        if blocks.comm.any(changed) or united:
            self.accounts["commands"] += self._content() - before
        if (fluid := self.flowing) is not None:
            fluid.take_new()
        self._checked = False
        self._find_step()
        if not blocks.options.mechanical and not self._beside_flow():
            blocks.clock.dt = self.sub_steps * self.dt

    def _make_conductances(self) -> None:
        blocks, number = self.blocks, self.blocks.number
        row = self.row[number]
        along, across = (self.column(name)[row] for name in ("conductivity", "conductivity_across"))
        heat = (
            self.column("capacity")[self.row[number]]
            * blocks.element_rows.column("density")[blocks.element_row[number]]
        )
        self._effusivity = np.sqrt(np.sqrt(along * across) * heat)
        self._g = np.empty((len(number), 6 if self.t.shape[1] == 4 else 3))
        mesh = blocks.reference
        make = kernels_space.conductances if blocks.dim == 3 else kernels.conductances
        make(number, mesh.points, mesh.cells, self._conductivities(row), self._g)
        self._q = np.zeros_like(self.t)
        self.hexes: Hexes | None = None
        if len(hexes := blocks.the_mesh().hexes):
            self.hexes = Hexes(blocks, self._conductivities(self.row[hexes[:, 8]]))
            self._g[self.hexes.rows] = 0.0

    def _conductivities(self, row: np.ndarray) -> np.ndarray:
        """Of elements with these rows (n,), [W/(m K)]: xx, yy, xy (n, 3), in space xx, yy, xy, zz, xz, yz (n, 6)."""
        along, across, angle, dip = (
            self.column(name)[row]
            for name in ("conductivity", "conductivity_across", "conductivity_angle", "conductivity_dip")
        )
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        same = along == across  # no rounding where the angle has no meaning
        c, s = np.where(same, 1.0, c), np.where(same, 0.0, s)
        if self.blocks.dim == 2:
            return np.column_stack([
                along * c * c + across * s * s, along * s * s + across * c * c, (along - across) * c * s,
            ])  # fmt: skip
        normal = np.sin(np.radians(dip))[:, None] * np.column_stack([-s, c, np.zeros(len(s))])
        normal[:, 2] = np.cos(np.radians(dip))
        less = np.where(same, 0.0, across - along)
        x, y, z = normal.T
        one = [along + less * x * x, along + less * y * y, less * x * y]
        return np.column_stack([*one, along + less * z * z, less * x * z, less * y * z])

    def _tell_obtuse(self) -> None:
        """Where flat angles make heat flow from cold to warm: the temperatures of explicit steps may leave the range of
        those around them. Rank 0 alone."""
        blocks = self.blocks
        if self._told_obtuse or blocks.log is None or blocks.dim == 2:
            return
        self._told_obtuse = True
        mesh = blocks.the_mesh()
        heated = blocks.alive & (self.row > 0)
        every = np.flatnonzero(heated & (mesh.hex_of() < 0))
        g = np.empty((len(every), 6))
        kernels_space.conductances(every, mesh.points, mesh.cells, self._conductivities(self.row[every]), g)
        hexes = mesh.hexes[heated[mesh.hexes[:, 8]]]
        of_hexes = conductances(mesh.points, hexes, self._conductivities(self.row[hexes[:, 8]]))
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
                "obtuse tetrahedra",
                f"along {int(against.sum())} of {len(key)} edges heat is conducted from the colder to the warmer end, "
                f"as angles between faces are obtuse (in {int((g < 0.0).any(axis=1).sum())} of {len(every)} tetrahedra"
                + (f" and {int((of_hexes < 0.0).any(axis=1).sum())} of {len(hexes)} hexahedra" if len(hexes) else "")
                + "): near steep fronts temperatures may leave the range of those around them",
            )

    def _make_nodes(self) -> None:
        """Nodes of heat that this rank's elements have, and the faces that are exposed, as faces hang together now."""
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
        begin, corner, place, again = np.zeros(n + 1, np.int64), *(np.empty(total, np.int64) for _ in range(3))
        lost = build.place_nodes(
            first, start, one, member, blocks.where, mesh.cells, blocks.v.shape[1], FORCE, 2, blocks.local.true_mass,
            begin, corner, place, again, np.empty(n),
        )  # fmt: skip
        lost = int(blocks.comm.max_into(np.array([lost], np.int64))[0])
        if lost >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the node of heat at corner {lost} spans more than a column of "
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
        h = self.column("transfer_coeficient")[self.row[at // 4]]
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
        h = self.column("transfer_coeficient")[self.row[e]]
        pairs, which = np.unique(np.column_stack([self.face[at].astype(float), h]), axis=0, return_inverse=True)
        self._face_row, self._face_pairs = which.reshape(-1).astype(np.int64), pairs

    @property
    def passes(self) -> bool:
        """Heat crosses where surfaces touch. Not collective."""
        some = self.blocks.options.collision and bool((self.column("transfer_coeficient") > 0.0).any())
        return some and bool((self._transfers[self.blocks.alive] > 0.0).any())

    @property
    def _transfers(self) -> np.ndarray:
        """Transfer coefficients (ne,) of the elements."""
        return self.column("transfer_coeficient")[self.row]

    def find_contacts(self) -> None:
        """Where faces touch now, of pairs with an element of this rank; the model is closed. Not collective."""
        self._passes, room = self.passes, 0
        while True:
            ends = 2 * self.blocks.dim
            self._touch = np.empty((room, ends), np.int64), np.empty((room, ends)), np.empty(room)
            if not self._passes or not len(self.blocks.local.pairs):
                return
            found = (self._touching_in_space if self.blocks.dim == 3 else self._touching)()
            if found == room:
                return
            room = found

    def _touching(self) -> int:
        """Fill what there is room for of places where faces touch; how many there are."""
        blocks, pairs = self.blocks, self.blocks.local.pairs
        new = (np.diff(pairs.first, prepend=-1) != 0) | (np.diff(pairs.second, prepend=-1) != 0)
        edge, h = float(blocks.mean_edge), self._transfers[blocks.number]
        return kernels.touching(
            pairs.first[new], pairs.second[new], pairs.start, pairs.free, pairs.element, blocks.the_mesh().cells,
            blocks.where, blocks.x, h, NEAR * edge, DEEP * edge, self.t.shape[1], *self._touch,
        )  # fmt: skip

    def _touching_in_space(self) -> int:
        """The same in space: every free face with those of its targets, each pair of faces once."""
        blocks, pairs = self.blocks, self.blocks.local.pairs
        if self._pairs_of is not pairs:
            self._pairs_of = pairs
            faces = Surface.of(blocks).faces
            free = np.zeros(self.face.size, bool)
            free[faces] = True
            face = np.repeat(pairs.face[pairs.first], 4)
            other = (4 * pairs.element[pairs.second][:, None] + np.arange(4)).reshape(-1)
            both = np.column_stack([face, other])[free[other]]
            corners, share = facing(blocks.the_mesh(), faces, both)
            self._facing = 4 * blocks.where[corners // 4] + corners % 4, share
        edge, h = float(blocks.mean_edge), self._transfers[blocks.number]
        (first, second), share = self._facing
        return kernels_space.touching(first, second, share, blocks.x, h, NEAR * edge, DEEP * edge, *self._touch)

    @property
    def contacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """corner, weight and pass_on of kernels.touching. Not to be changed. Not collective."""
        return self._touch

    def _faces_at(self, time: float) -> np.ndarray:
        """The table of conditions (rows, 3) at a time of heat."""
        table = np.zeros((len(self._face_pairs), 3))
        for row, (condition, h) in enumerate(self._face_pairs):
            one = self.faces[int(condition)]
            table[row, kernels.FLUX] = said.now(self.blocks.tables, one.flux, time)
            if one.environment is not None:
                table[row, kernels.TRANSFER] = h if one.transfer is None else one.transfer
                table[row, kernels.ENVIRONMENT] = said.now(self.blocks.tables, one.environment, time)
        return table

    def held_at(self, time: float) -> np.ndarray:
        """Prescribed temperatures (rows,) at a time of heat."""
        return np.array([said.now(self.blocks.tables, one, time) for one in self.prescribed[1:]], np.float64)

    # ---- the clock -----------------------------------------------------------------------------------------------

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
        if self.passes:
            self._add_most_of_contacts(corner)
        if (fluid := self.flowing) is not None:
            fluid.add_to_limit(corner.reshape(-1))
        total = np.empty(len(self.capacity))
        kernels.sums(self._begin, self._corner, corner.reshape(-1), total)
        free = (self._held < 0) & (total > 0.0)
        least = float((self.capacity[free] / total[free]).min(initial=math.inf))
        self._limit = float(self.blocks.comm.min_into(np.array([least]))[0])

    def _add_most_of_contacts(self, corner: np.ndarray) -> None:
        """What free faces pass on to corners (n, w) where they touch all along, whatever they touch."""
        blocks, h = self.blocks, self._transfers
        most = h[blocks.alive].max()
        at = np.flatnonzero(blocks.face_exists() & ~blocks.closed_faces() & np.repeat(h > 0.0, 4))
        at = at[blocks.where[at // 4] >= 0]
        at, ends, part = self._parts_of(at)
        each = 2.0 * part * h[at // 4] * most / (h[at // 4] + most)
        for end in ends.T:
            np.add.at(corner, (blocks.where[end // 4], end % 4), each)

    def limit(self) -> float:
        """The stability limit of a sub-step [s]."""
        return self._limit

    def _beside_flow(self) -> bool:
        """Without motion of blocks it is fluid that sets the pace."""
        return self.blocks.options.hydraulic and "fluid" in self.blocks.surface_loads

    def _given(self) -> tuple[float, ...]:
        """What the length of a sub-step follows from, beside the limit."""
        o, clock = self.blocks.options, self.blocks.clock
        period = o.mechanical or self._beside_flow()
        return (
            float(o.mechanical), float(o.dynamic), self._period(), float(o.heat_steps), o.heat_dt,
            clock.dt if period else 0.0, self._limit, self._of_fluid(),
        )  # fmt: skip

    def _of_fluid(self) -> float:
        """Time of a cycle of flow that heat goes with [s], 0: it does not."""
        fluid = self.flowing if self.blocks.options.hydraulic else None
        return fluid.flow.sub_steps * fluid.flow.dt if fluid is not None else 0.0

    def _period(self) -> float:
        """Time of blocks in motion that a cycle stands for [s]."""
        dt = self.blocks.clock.dt
        if not self._may_wait:
            return self.blocks.options.flow_every * dt
        return self.owed if self.owed and not self.waited else self.every * dt

    def _find_step(self) -> None:
        """Sub-steps of a cycle and their length, from what was said and what is stable."""
        blocks, o = self.blocks, self.blocks.options
        self._found_for = self._given()
        if not self.on:
            return
        limit = SAFETY * self._limit
        if o.mechanical:
            period = self._period() if o.dynamic else 0.0
        else:
            period = blocks.clock.dt if self._beside_flow() else 0.0
        period = self._of_fluid() or period
        if o.heat_dt > 0.0:
            self.sub_steps, self.dt = max(1, o.heat_steps), o.heat_dt
        elif period == 0.0:
            if not math.isfinite(limit) and not o.mechanical:
                raise CommandError("no heat can flow: all nodes are held; model time-step thermal gives it a clock")
            self.sub_steps, self.dt = max(1, o.heat_steps), limit
        else:
            self.sub_steps = o.heat_steps or max(1, math.ceil(period / limit))
            self.dt = period / self.sub_steps
        if not o.heat_steps and self.sub_steps > MANY:
            raise CommandError(
                f"heat would need {self.sub_steps} sub-steps of {limit:.3g} s in a cycle of {period:.3g} s; model "
                "time-step thermal gives it a clock of its own"
            )
        self._tell_step()

    def _tell_step(self) -> None:
        log = self.blocks.log
        if log is None or not math.isfinite(self.dt) or abs(self.dt - self._told) <= 0.1 * self._told:
            return
        self._told, said = self.dt, partial(with_prefix, unit="s")
        log.info(
            f"heat: {counted(self.sub_steps, 'sub-step')} of {said(self.dt)} in each cycle; the stability limit is "
            f"{said(self._limit)}"
        )
        if self.dt > self._limit:
            log.warn_once(
                "heat step",
                f"the thermal time step {self.dt:g} s is {self.dt / self._limit:.2f} of the stability limit "
                f"{self._limit:.4g} s; a run that blows up should be repeated with a smaller one, or with model solve "
                "thermal",
            )

    def check_complete(self) -> None:
        blocks = self.blocks
        bare = np.flatnonzero((self.row == 0) & blocks.alive & bool(self.rows and blocks.options.thermal))
        if len(bare):
            at = ", ".join(f"{c:g}" for c in blocks.the_mesh().centroids(bare[:1])[0])
            raise CommandError(
                f"element {bare[0]} at ({at}) has no thermal model ({len(bare)} in all), but others have: element "
                "c-model thermal-iso-heat for all"
            )

    def check_elements(self) -> None:
        """CommandError if an element lacks a thermal model, or has a law that knows no temperature, or a transfer
        coefficient that nothing takes. Not collective."""
        blocks = self.blocks
        self.check_complete()
        passes = np.flatnonzero((self._transfers > 0.0) & blocks.alive)
        if len(passes) and not blocks.options.collision and all(one.environment is None for one in self.faces):
            raise CommandError(
                f"element {passes[0]} has a transfer-coeficient, but no face ever had an environment-temperature, and "
                "surfaces do not touch: model option collision on"
            )
        if self.fluid is not None:
            self.fluid.check()
        self._check_friction()
        if blocks.dim == 2 and self.expands and user_laws.in_use(blocks):
            raise CommandError(
                f"{user_laws.some(blocks)} has a law of the user, which in two dimensions knows no strain e33 of heat: "
                "expansion-coeficient must be 0 with it"
            )

    def _check_friction(self) -> None:
        """CommandError if heat of friction is wanted where nothing can slide in time. Not collective."""
        blocks, o = self.blocks, self.blocks.options
        warm = np.flatnonzero((self.column("friction_heat")[self.row] > 0.0) & blocks.alive)
        if len(warm) and self.on and o.mechanical and not (o.dynamic and o.collision):
            raise CommandError(
                f"element {warm[0]} has friction-heat, but "
                + ("surfaces do not touch: model option collision on" if o.dynamic else
                   "nothing slides in time in static runs: model option thermal off, or dynamic on")
            )  # fmt: skip

    def check_start(self) -> None:
        o = self.blocks.options
        if not self.rows or self._checked:
            return
        self.check_elements()
        if self.on and o.heat_dt > 0.0 and self._of_fluid() > 0.0:
            raise CommandError(
                "heat in fluid goes with the time of flow: model time-step thermal 0, or model option hydraulic off "
                "for water that flows on as it does now"
            )
        if self.on and o.mechanical and not o.dynamic and o.heat_dt == 0.0 == self._of_fluid():
            raise CommandError(
                "in static runs time of heat passes by model time-step thermal, which comes first; or model option "
                "thermal off leaves temperatures as they are"
            )
        self._checked = True

    def joints_opened(self) -> None:
        """Joints broke: no heat is conducted across them any more."""
        self._stale = True

    def elements_removed(self, elements: np.ndarray) -> None:
        """Their heat is gone with them."""
        blocks = self.blocks
        self._expands = None
        if TEMPERATURE not in blocks.cold:
            return
        mine = np.isin(blocks.number, elements)
        t, c, given = (blocks.cold[name][mine].reshape(-1) for name in (TEMPERATURE, CAPACITY, GIVEN))
        self.accounts["removed"] += exact_sum(t * c, blocks.comm)
        self.accounts["given"] += exact_sum(given, blocks.comm)

    def mesh_replaced(self) -> None:
        """There is another mesh: `of_mesh` says that this is gone with the one before."""
        if self.fluid is not None:
            self.fluid.close()

    def follow(self) -> None:
        """Heat flows for as long as the step that the elements have moved by."""
        blocks, o = self.blocks, self.blocks.options
        if not self.on:
            return
        self.waited += 1
        if self._may_wait:
            self.owed += blocks.clock.dt
        if self._rubs and o.mechanical:
            self._rub()
        fluid = self.flowing
        if fluid is not None and o.hydraulic:
            if fluid.flow.waited > 0:  # heat goes with the fluid
                return
        elif o.mechanical and self.waited < (self.every if self._may_wait else o.flow_every):
            return
        self.waited = 0
        with blocks.timers("heat"):
            self.renew_nodes()
            if o.mechanical:
                self.find_contacts()
            if self.owed and not self._may_wait:
                self._catch_up()
            if self._found_for != self._given():
                self._find_step()
            if blocks.budget is not None and o.dynamic and (self.expands or blocks.local.warms):
                blocks.budget.pause(blocks, by_heat=True)
            self._take_friction()
            if fluid is not None:
                fluid.begin_cycle(self.sub_steps * self.dt)
            for _ in range(self.sub_steps):
                self._sub_step(fluid)
            self._power, self.owed = None, 0.0
            self.cycles += 1
            self.every = max(1, int(min(RARELY * self._limit / blocks.clock.dt, MOST))) if self._may_wait else 1
            blocks.local.follow_heat()
        if self.cycles % LOOK == 0:
            self._check_finite()

    def _catch_up(self) -> None:
        """Heat in rock flows for the time that it waited for, before something else set its pace."""
        count = max(1, math.ceil(self.owed / (SAFETY * self._limit)))
        self.dt, self._found_for = self.owed / count, ()
        for _ in range(count):
            self._sub_step()
        self.owed = 0.0

    @property
    def _may_wait(self) -> bool:
        """Heat alone, without friction, by the clock of blocks in motion, with sub-steps of which nothing is said."""
        o = self.blocks.options
        by_itself = o.mechanical and o.dynamic and self.flowing is None and not self._rubs
        return by_itself and o.flow_every == 1 and o.heat_steps == 0 and o.heat_dt == 0.0

    def _rub(self) -> None:
        """Surfaces have slid for a step."""
        blocks = self.blocks
        pairs: Any = blocks.local.pairs
        if len(pairs):
            out = np.zeros(self.t.shape)
            how = self._effusivity, self.column("friction_heat")[self.row[blocks.number]], blocks.clock.dt, out
            if blocks.dim == 3:
                kernels_space.rub(
                    pairs.first, pairs.second, pairs.face, pairs.face_row, pairs.row, pairs.touching, blocks.v,
                    pairs.out, pairs.history, *how,
                )  # fmt: skip
            else:
                friction.rub(
                    pairs.first, pairs.second, pairs.start, pairs.row, pairs.quad, blocks.x, blocks.v, pairs.history,
                    *how,
                )  # fmt: skip
            blocks.cold[RUBBED] += out[blocks.owned]

    def _take_friction(self) -> None:
        """What has come from friction flows in during this cycle, evenly."""
        if self._rubs:
            rubbed = self.blocks.cold[RUBBED]
            self.blocks.cold[GIVEN] += rubbed
            self._power = rubbed / (self.sub_steps * self.dt)
            rubbed[:] = 0.0

    def _own_corners(self) -> tuple[int, int]:
        """From where to where this rank's corners lie in t, flat."""
        width, own = self.t.shape[1], self.blocks.owned
        return width * own.start, width * own.stop

    def inflow(self, time: float, dt: float, fluid: FluidHeat | None = None) -> np.ndarray:
        """Heat (n, w) [W/m] that flows to the corners of the elements held here, with the conditions of faces of a time
        of heat; what these bring in dt [s] is booked. fluid: what brought heat in the last sub-step besides. Collective
        where heat comes from surfaces or fluid."""
        threads = self.blocks.threads
        (kernels.conduct if threads == 1 else kernels.conduct_threaded)(threads, self.t, self._g, self._q)
        if self.hexes is not None:
            self.hexes.conduct(self.t.reshape(-1), self._q.reshape(-1))
        if len(self._face_row):
            t, q, given = (part.reshape(-1) for part in (self.t, self._q, self.blocks.cold[GIVEN]))
            kernels.through_faces(
                self._face_corner, self._half, self._face_row, self._faces_at(time), *self._own_corners(), t, q, dt,
                given,
            )  # fmt: skip
        if self._passes:
            kernels.through_contacts(*self._touch, self.t.reshape(-1), self._q.reshape(-1))
        if fluid is not None:
            fluid.add_wall_heat(self._q.reshape(-1))
        if self._power is not None:
            self._q[self.blocks.owned] += self._power
        if self._passes or fluid is not None or self._rubs:
            self.blocks.halo.fill(self._q)  # elements of other ranks touch more than is held here
        return self._q

    def _sub_step(self, fluid: FluidHeat | None = None) -> None:
        blocks, threads = self.blocks, self.blocks.threads
        if fluid is not None:
            fluid.advance(self.dt, self.held_at(self.time + self.dt))
        q = self.inflow(self.time, self.dt, fluid).reshape(-1)
        self.time += self.dt
        first, last = self._own_corners()
        t, given = self.t.reshape(-1), blocks.cold[GIVEN].reshape(-1)
        (kernels.warm if threads == 1 else kernels.warm_threaded)(
            threads, self._begin, self._corner, self.capacity, self._held, self.held_at(self.time), first, last,
            self.dt, q, t, given,
        )  # fmt: skip
        blocks.halo.fill(self.t)

    def _check_finite(self) -> None:
        """Stop on all ranks if the heat has blown up."""
        blocks = self.blocks
        bad = ~np.isfinite(blocks.cold[TEMPERATURE]).all(axis=1)
        n = len(self.row)
        first = int(blocks.comm.min_into(np.array([blocks.number[blocks.owned][bad].min(initial=n)], np.int64))[0])
        if first < n:
            raise PhysicsError(
                f"step {blocks.clock.step}: the temperature of element {first} is not finite; the thermal time step "
                f"{self.dt:g} s is probably too large (stable: {self._limit:g} s)"
            )

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """All but the columns, as JSON values; those of elements are saved with these."""
        return {
            "rows": [list(row) for row in self.rows], "prescribed": self.prescribed,
            "faces": [asdict(one) for one in self.faces], "accounts": self.accounts, "time": self.time,
            "cycles": self.cycles, "waited": self.waited, "every": self.every,
            "owed": self.owed,
            "fluid": self.fluid.saved_state() if self.fluid is not None else None,
        }  # fmt: skip

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Elements with their properties, prescribed nodes and faces, of all ranks."""
        found = {}
        for name, rows in (("elements", self.row), ("points", self.held), ("faces", self.face)):
            at = np.flatnonzero(rows)
            found[f"heat_{name}"] = {"number": at, "row": rows[at].astype(np.int64)}
        return found | (self.fluid.saved_tables() if self.fluid is not None else {})

    def saved_rows(self) -> dict[str, dict[str, np.ndarray]]:
        return self.fluid.saved_rows() if self.fluid is not None else {}

    @staticmethod
    def restored(blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of these: the blocks have this heat."""
        made = Heat.of(blocks)
        new = tuple(one.default or 0.0 for one in ISO_HEAT.properties)
        made.rows = [(*row, *new[len(row) :]) for row in state["rows"]]
        made.prescribed = list(state["prescribed"])
        made.faces = [FaceCondition(**one) for one in state["faces"]]
        made.accounts, made.time = dict(state["accounts"]), state["time"]
        made.cycles, made.waited = state["cycles"], state["waited"]
        made.every, made.owed = state.get("every", 1), state.get("owed", 0.0)
        for name, rows in (("elements", made.row), ("points", made.held), ("faces", made.face)):
            table = tables[f"heat_{name}"]
            rows[table["number"]] = table["row"]
        if state.get("fluid") is not None:
            made.of_fluid().restore(state["fluid"], tables)
