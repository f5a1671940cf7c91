"""The tables of the kernels for the elements that a rank holds, made at each rebuild, and the calls of the kernels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import build, by_temperature, connectivity, user_laws
from hpcdem.physics.fdem.conditions import TRACTIONS
from hpcdem.physics.fdem.elements import flow as plastic_flow
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import QUAD, TETRAHEDRON, TRIANGLE
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS, Histories
from hpcdem.physics.fdem.joints import JointTables, laws_of
from hpcdem.physics.fdem.kernels import (
    creep,
    elements,
    energy,
    joint_law,
    limits,
    plastic_quads,
    plasticity,
    strength,
)
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.pairs import ContactPairs, Kinds, Shapes, Surfaces
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.properties import (
    MECH_MOHR_COULOMB,
    SOFTENS,
    Rows,
    softening_rows,
    softening_table,
)
from hpcdem.physics.fdem.six.elements import SixNodes
from hpcdem.physics.fdem.tables import Table
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.node_conditions import NodeCondition
    from hpcdem.physics.fdem.state import State

ALPHA = 0.8
"""Local damping of the static mode."""


def element_table(sim: State) -> np.ndarray:
    """The table of element models (rows, 5) of build.py."""
    of = moduli(sim.element_rows, sim.options.plane_stress)
    density, young, damp = map(sim.element_rows.column, ("density", "young", "damp_factor"))
    return np.column_stack([density, of.lame, 2.0 * of.shear, young, damp])


def yield_table(rows: Rows) -> np.ndarray:
    """The table of yield surfaces (rows, 4) of plasticity.py; models that do not yield have infinite strength."""
    yields = np.array([rows.name(row) == MECH_MOHR_COULOMB.name for row in range(len(rows))])
    friction, dilation = (np.radians(rows.column(name)) for name in ("friction", "dilation"))
    cohesion = np.where(yields, rows.column("cohesion"), math.inf)
    table = np.empty((len(rows), plasticity.YIELD))
    table[:, plasticity.N_PHI] = np.tan(0.25 * math.pi + 0.5 * friction) ** 2
    table[:, plasticity.N_PSI] = np.tan(0.25 * math.pi + 0.5 * dilation) ** 2
    table[:, plasticity.STRENGTH] = 2.0 * cohesion * np.sqrt(table[:, plasticity.N_PHI])
    apex = np.divide(cohesion, np.tan(friction), out=np.full(len(rows), math.inf), where=friction > 0.0)
    table[:, plasticity.TENSILE] = np.where(yields, np.minimum(rows.column("tensile"), apex), math.inf)
    return table


def creep_table(rows: Rows) -> np.ndarray:
    """The table of creep laws (rows, 3) of kernels/creep.py; models that do not creep have zeros."""
    shear, kelvin, maxwell = (rows.column(n) for n in ("kelvin_shear", "kelvin_viscosity", "maxwell_viscosity"))
    table = np.zeros((len(rows), creep.LAW))
    unit = (shear > 0.0) & (kelvin > 0.0)
    table[unit, creep.KELVIN], table[unit, creep.PER_KELVIN] = shear[unit], 1.0 / kelvin[unit]
    table[maxwell > 0.0, creep.PER_MAXWELL] = 1.0 / maxwell[maxwell > 0.0]
    return table


def strength_tables(rows: Rows, of: np.ndarray, tables: list[Table], history: np.ndarray) -> strength.Strength:
    """The arrays of strength.py; of (own rows,): the row of the model of each. Strengths are the largest that tables
    over temperature have."""
    pieces = [np.column_stack([one.times, one.values]) for one in tables]
    return strength.Strength(
        len(rows),
        of.astype(np.int64),
        np.column_stack([rows.column(name)[of] for name in SOFTENS]),
        np.column_stack([rows.column(softening_table(name)) for name in SOFTENS]).astype(np.int64),
        np.cumsum([0, *map(len, pieces)]),
        np.concatenate([np.empty((0, 2)), *pieces]),
        history,
    )


@dataclass
class Evaluation:
    """Forces at the present positions, as the next step will see them [N/m].

    force (n, 8): on the corners of the owned elements, in storage order (ghosts too, where nodes are shared); of_joints
    (n, 8): those of them from joints; pushed: those from contact, by `pairs.rows`; touching (m,), pair_force (m, 12):
    by pairs; outside, felt: of special nodes, see nodes.py.
    """

    force: np.ndarray
    of_joints: np.ndarray
    pushed: np.ndarray
    touching: np.ndarray
    pair_force: np.ndarray
    outside: np.ndarray
    felt: np.ndarray
    v_next: np.ndarray
    """Velocities after this moment's kick (n, w) [m/s]."""


@dataclass(frozen=True)
class LawHere:
    """A law of the user on this rank: its table of properties, which blocks of triangles have an element with it, how
    many triangles and quads have it."""

    law: user_laws.UserLaw
    table: np.ndarray
    some: np.ndarray
    triangles: int
    quads: int

    def obeying(self, local: Local, memory: np.ndarray, quads: bool) -> tuple:
        """What its kernels need, of triangles or of quads; memory: see `user_laws.begin`."""
        from hpcdem.physics.fdem.kernels.user_laws import Obeying

        sim = local.sim
        dt = sim.clock.dt if sim.options.dynamic else 0.0
        row = local.quad_law_row if quads else local.law_row
        return Obeying(self.some, row, self.table, dt, sim.n_left, memory, (memory.shape[1] - 1) // sim.element_parts)


class Local(JointTables):
    """Tables of one rank between two rebuilds, in the plane (in space: local_space.py). The model is in storage order,
    ghosts in place. Collective.

    passes: how often the forces of a step were computed. dim: of space; force_width: words of a row of forces; stride:
    from one corner of a row to the next.
    """

    dim, force_width, stride, listed = 2, elements.FORCE, 2, 3 * elements.BLOCK
    without_moduli: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]] = ()
    whole: SixNodes | None = None
    """Macro-elements of the plane, whose forces stand in place of those of their parts."""
    pulled: tuple[np.ndarray, np.ndarray] | None = None
    """In place of node_begin and node_corner: corners with forces, where some have none."""

    def __init__(self, sim: State) -> None:
        self.sim = sim
        mesh, own = sim.the_mesh(), sim.owned
        quad = mesh.cells[sim.number[own], 3] >= 0
        rows = np.arange(own.start, own.stop)
        triangles, self.quad_rows = rows[~quad], rows[quad].astype(np.int32)
        self.count = len(triangles)
        self.triangle_of_row = np.full(sim.n_own, -1, np.int64)
        self.triangle_of_row[~quad] = np.arange(self.count)
        fill = triangles[-1:] if self.count else np.zeros(1, np.int64)
        self.triangle_rows = np.concatenate([triangles, np.repeat(fill, 3)]).astype(np.int32)
        self.tally = np.zeros((sim.threads, elements.TALLY), np.int64)
        self.passes = 0
        self._make_constants()
        self._make_laws()
        self._make_joints()
        self._put_histories()
        self.pairs = self._contact(*ContactPairs.remembered(sim))
        self._make_loads()
        self._make_nodes()
        self._set_masses()
        self._bind()

    def _contact(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> Any:
        """Contact lists, with what is remembered of contacts."""
        return ContactPairs(self.sim, self, low, high, values)

    @cached_property
    def shapes(self) -> Shapes:
        """What contact needs to know of the elements held here, by storage row."""
        return Shapes(self.sim, self.sim.number)

    @cached_property
    def kinds(self) -> Kinds:
        """What tells properties of faces in contact apart."""
        return Kinds.of(self.sim)

    # ---- tables --------------------------------------------------------------------------------------------------

    @staticmethod
    def corner_masses(sim: State, number: np.ndarray) -> np.ndarray:
        """True masses (n, 4) [kg/m], in space [kg], of the corners of these elements."""
        mesh, mass = sim.reference, np.zeros((len(number), 4))
        build.masses(number, mesh.points, mesh.cells, sim.element_row, element_table(sim), mass)
        return mass

    def _make_constants(self) -> None:
        """Reference geometry, moduli, true masses, initial stress."""
        sim, mesh, count = self.sim, self.sim.reference, self.count
        models = element_table(sim)
        self._true_mass = self.corner_masses(sim, sim.number)
        self.c = np.zeros((count + 3, elements.TRIANGLE))
        self.q = np.zeros((len(self.quad_rows), elements.QUAD))
        build.constants(
            sim.number, mesh.points, mesh.cells, sim.element_row, models, sim.options.dynamic,
            self.triangle_rows[:count], self.quad_rows, self.true_mass, self.c, self.q,
        )  # fmt: skip
        self.c[:count, elements.FREE] = self.q[:, elements.Q_FREE] = float(sim.options.plane_stress)
        self.c[count:] = self.c[count - 1] if count else 1.0
        self.warms = any(bool(one.any()) for one in sim.warms())
        self.stiff, self.stiff_q = (self.c.copy(), self.q.copy()) if self.warms else (self.c, self.q)
        self.whole = SixNodes(self) if len(mesh.macros) else None
        self.plastic, self.creeps = "plastic" in sim.cold, "creep" in sim.cold
        self.yields = bool(sim.yielding().any())
        rows = self.triangle_rows[:count]
        quad_law = sim.element_row[sim.number[self.quad_rows]].astype(np.int32)
        if self.plastic or self.creeps:
            self.law = np.zeros(count + 3, np.int32)
            self.law[:count] = sim.element_row[sim.number[rows]]
        self.quad_law = np.repeat(quad_law[:, None], 4, axis=1)
        quads = len(self.quad_rows)
        self.s0, self.quad_s0 = np.zeros((count + 3, 4)), np.zeros((quads, 16))
        self.solids: list[ElementBlock] = []
        for kind, of, n, c, s0 in (
            (TRIANGLE, self.triangle_rows, count, self.c, self.s0), (QUAD, self.quad_rows, quads, self.q, self.quad_s0)
        ):  # fmt: skip
            stored = of[:n, None].astype(np.int64) - sim.n_left
            self.solids.append(ElementBlock(sim, kind, of, c, s0, stored, np.ones(stored.shape)))
        self._make_creep()
        if self.plastic:
            self._make_strength(rows, self.quad_rows)
        self._of_initial = np.zeros((count, 4)), np.zeros((quads, 4))
        if sim.stress0 is not None:
            self._of_initial = sim.initial_stresses(sim.number[rows]), sim.initial_stresses(sim.number[self.quad_rows])
        self.initial_part: np.ndarray | None = None
        self._said_initial = self._of_initial
        if self.warms:
            self._follow_elements()
        self.heated = self._find_stress_without_strain()

    def _make_creep(self) -> None:
        """What elements that creep, or yield, need to know besides."""
        sim = self.sim
        if not (self.plastic or self.creeps):
            return
        for of in self.solids:
            of.remember()
            number = sim.number[of.stored[:, 0] + sim.n_left]
            of.model, of.creeping = sim.element_row[number].astype(np.int32), np.flatnonzero(sim.creeping()[number])
        if self.creeps:
            self.creep_table = creep_table(sim.element_rows)

    def follow_heat(self) -> None:
        """Temperatures have changed: moduli, strengths and stress without strain are those of now."""
        if self.warms:
            self._follow_elements()
            self._follow_joints()
        if self.warms or self.heated:
            self._find_stress_without_strain()

    def _follow_elements(self) -> None:
        """Moduli, initial stress and strength of elements at their temperatures."""
        sim = self.sim
        part = by_temperature.part_of_young(sim)
        if part is not None:
            for table, full, columns, rows in self._moduli():
                table[: len(rows), columns] = full[: len(rows), columns] * part[rows, None]
            self._clear_moduli()
        if sim.stress0 is not None:
            said = sim.stress0_row[sim.number[sim.owned]]
            before = by_temperature.part_of_young(sim, said, by_temperature.unstressed(sim))
            if part is not None or before is not None:
                ratio = np.ones(sim.n_own) if part is None else part.copy()
                if before is not None:
                    ratio /= np.where(said > 0, before, 1.0)
                self.initial_part = ratio
                self._scale_initial(ratio)
        if self.plastic and len(self.strength.of):
            at, of = self.strength_element, self.strength.of
            t = cache(lambda name: by_temperature.means(sim, name)[at])
            for column, name in ((strength.COHESION, "cohesion"), (strength.TENSILE, "tensile")):
                self.strength.values[:, column] = by_temperature.values(sim, sim.element_rows, name, of, t)
            self._renew_strength()

    def _clear_moduli(self) -> None:
        """Elements with a law of the user have no moduli in the tables of forces."""
        for table, at, columns in self.without_moduli:
            table[np.ix_(at, columns)] = 0.0

    def _moduli(self) -> Iterable[tuple[np.ndarray, np.ndarray, list[int], np.ndarray]]:
        """Tables of elements: as they are, with their largest moduli, columns of these, and the how-manieth owned
        element each row is of."""
        triangles, quads = self.triangle_rows[: self.count] - self.sim.n_left, self.quad_rows - self.sim.n_left
        yield self.c, self.stiff, [elements.LAMBDA, elements.TWO_MU], triangles
        yield self.q, self.stiff_q, [elements.Q_LAMBDA, elements.Q_TWO_MU], quads

    def _scale_initial(self, ratio: np.ndarray) -> None:
        """The initial stress of owned elements is so much (n_own,) of what was said."""
        first, second = self._said_initial
        triangles, quads = self.triangle_rows[: self.count] - self.sim.n_left, self.quad_rows - self.sim.n_left
        self._of_initial = first * ratio[triangles, None], second * ratio[quads, None]

    def _find_stress_without_strain(self) -> bool:
        """Of all elements: what was said of it, and what heat brings, less the part of plastic and creep strain.
        Returns whether heat brings any."""
        sim, rows = self.sim, self.triangle_rows[: self.count]
        heat = sim.surface_loads.eigenstress(sim)
        build.stress_without_strain(
            rows, self.quad_rows, sim.n_left, *self._of_initial, np.zeros(0) if heat is None else heat, self.s0,
            self.quad_s0,
        )  # fmt: skip
        if sim.options.plane_stress:
            self.s0[:, 3] = self.quad_s0[:, 3::4] = 0.0
        if self.whole is not None:
            self.whole.take_stress(self.s0)
        self._relieve()
        return heat is not None

    def _relieve(self) -> None:
        """Stress without strain, with that of what elements remember."""
        if not (self.plastic or self.creeps):
            return
        for of in self.solids:
            of.said[:] = of.uncrept[:] = of.s0
        if self.creeps:
            self._relieve_crept([(of, np.arange(of.count), of.uncrept, of.s0) for of in self.solids])
        for of in self.solids:
            of.initial[:] = of.s0
        if self.plastic:
            self._relieve_flowed([(of.initial, of.s0) for of in self.solids])
        if self.plastic and self.creeps:  # some that creep may have yielded before, with another model
            self._relieve_flowed([(of.said, of.uncrept) for of in self.solids])
            self._relieve_crept([(of, of.creeping, of.uncrept, of.s0) for of in self.solids])

    def _relieve_crept(
        self, of: Iterable[tuple[ElementBlock, np.ndarray, np.ndarray, np.ndarray]], memory: np.ndarray | None = None
    ) -> None:
        """Stress without strain, the last of each, of some elements: that of their creep strain less than that before
        it. memory: what they remember of creep."""
        for one, who, base, s0 in of:
            if len(who):
                creep.relieve_all(who, one.tables, base, self.sim.cold["creep"] if memory is None else memory, s0)

    def _relieve_flowed(self, of: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
        """Stress without strain of `solids`: that of their plastic strain less than base, both (n, parts, k) [Pa]."""
        for one, (base, s0) in zip(self.solids, of):
            if one.count:
                plastic_flow.relieve_all(one.tables, one.count, base, self.sim.cold["plastic"], s0)

    def _make_strength(self, rows: np.ndarray, quad_rows: np.ndarray) -> None:
        """The table of yield surfaces; triangles whose strength follows tables have a row of their own. rows: storage
        rows of the triangles; quad_rows: of quads."""
        sim = self.sim
        of_models = yield_table(sim.element_rows)
        history = sim.cold.get("softening", np.zeros((0, strength.HISTORY)))
        softens = softening_rows(sim.element_rows) if len(history) else np.zeros(len(of_models), bool)
        law = self.law[: self.count, None]
        of, element, first = [], [], len(of_models)
        for laws_, at in ((law, rows), (self.quad_law[: len(quad_rows)], quad_rows)):
            own = softens[laws_]
            of.append(laws_[own])
            element.append(at[np.nonzero(own)[0]].astype(np.int64) - sim.n_left)
            laws_[own] = first + np.arange(int(own.sum()))
            first += int(own.sum())
        self.strength = strength_tables(sim.element_rows, np.concatenate(of), sim.followed, history)
        self.yield_table = np.concatenate([of_models, np.zeros((first - len(of_models), plasticity.YIELD))])
        self.strength_element = np.concatenate(element)
        self.solids[0].law, self.solids[1].law = self.law[:, None], self.quad_law
        self._renew_strength()
        for one in self.solids:
            can = np.isfinite(self.yield_table[one.law[one.alone], plasticity.STRENGTH]).any(axis=1)
            # Only tetrahedra are gathered from anywhere, the others in the order of storage.
            who = one.alone[can] if one.kind is TETRAHEDRON else one.alone[: one.count * bool(can.any())]
            one.flowing = np.concatenate([who, np.repeat(who[-1:], 3)])

    def _renew_strength(self) -> None:
        """The yield surfaces of parts of elements that have one of their own."""
        if len(self.strength.history):
            for of in self.solids:
                plastic_flow.renew_all(of.tables, of.count, of.law, self.strength, self.yield_table)

    def _make_laws(self) -> None:
        """Elements with a law of the user have no moduli in the tables of forces, see kernels/user_laws.py; stiff,
        stiff_q: the tables by which the time step is found, with moduli in the ratio of those of the element."""
        sim, rows = self.sim, self.sim.element_rows
        self.laws: list[LawHere] = []
        self.law_of_triangles: LawHere | None = None
        self.law_of_quads: LawHere | None = None
        if not user_laws.of_rows(rows):
            return
        owned = self.triangle_rows[: self.count], self.quad_rows
        numbers = [user_laws.numbers(sim)[sim.number[of]] for of in owned]
        self.law_row = np.zeros(self.count + 3, np.int32)
        self.law_row[: self.count] = sim.element_row[sim.number[owned[0]]]
        self.quad_law_row = np.zeros(len(self.quad_rows) + 3, np.int32)
        self.quad_law_row[: len(self.quad_rows)] = sim.element_row[sim.number[owned[1]]]
        self.law_base, self.quad_law_base = np.zeros((self.count + 3, 4)), np.zeros((len(self.quad_rows), 16))
        if sim.stress0 is not None:
            self.law_base[: self.count] = sim.initial_stresses(sim.number[owned[0]])
            self.quad_law_base[:] = np.tile(sim.initial_stresses(sim.number[owned[1]]), 4)
        self.stiff, self.stiff_q = self.stiff.copy(), self.stiff_q.copy()
        models, bound = element_table(sim), np.array(rows.column(user_laws.BOUND))
        modulus = models[:, build.LAME] + models[:, build.MU2]
        for table, stiff, number, row, columns, s0, base in (
            (
                self.c, self.stiff, numbers[0], self.law_row, np.array([elements.LAMBDA, elements.TWO_MU]), self.s0,
                self.law_base,
            ),
            (
                self.q, self.stiff_q, numbers[1], self.quad_law_row, np.array([elements.Q_LAMBDA, elements.Q_TWO_MU]),
                self.quad_s0, self.quad_law_base,
            ),
        ):  # fmt: skip
            at = np.flatnonzero(number)
            stiff[np.ix_(at, columns)] *= (bound[row[at]] / modulus[row[at]])[:, None]
            self.without_moduli = *self.without_moduli, (table, at, columns)
            s0[at] = base[at]  # what such an element has flowed or crept, with another model, is not of the law
        self._clear_moduli()
        blocks = np.arange(self.count) // elements.BLOCK
        for k, law in enumerate(user_laws.of_rows(rows)):
            triangles, quads = (number == 1 + k for number in numbers)
            some = np.zeros(-(-self.count // elements.BLOCK), bool)
            some[blocks[triangles]] = True
            if triangles.any() or quads.any():
                self.laws.append(LawHere(law, law.table(rows), some, int(triangles.sum()), int(quads.sum())))
        # One law runs in the loop over forces, that of most elements; of the others stress is found before it.
        for one in self.laws:
            if one.triangles > (self.law_of_triangles.triangles if self.law_of_triangles else 0):
                self.law_of_triangles = one
            if one.quads > (self.law_of_quads.quads if self.law_of_quads else 0) and not self.yields:
                self.law_of_quads = one

    def try_law(self, law: user_laws.UserLaw) -> None:
        """Call the kernels of a law as steps and looks will: those of quads where there are some, else those of
        triangles. No element has it."""
        sim, quads = self.sim, len(self.quad_rows) > 0
        self.law_row, self.quad_law_row = (np.zeros(n + 3, np.int32) for n in (self.count, len(self.quad_rows)))
        self.law_base, self.quad_law_base = self.s0, self.quad_s0
        one = LawHere(law, np.zeros(len(law.columns)), np.zeros(len(self.head), bool), int(not quads), int(quads))
        sim.cold[user_laws.COLUMN] = np.zeros((sim.n_own, 1 + sim.element_parts * len(law.states)))
        self.laws, self.law_of_triangles, self.law_of_quads = [one], None, None
        if quads:
            self.law_of_quads = one
        else:
            self.law_of_triangles = one
        self._elements(self.triangle_special, self.block_special, self.force, self.of_joints, False)
        self.obeyed(self.s0, self.quad_s0)

    def _make_joints(self) -> None:
        """Slots of the edges: three per triangle, then four per quad."""
        sim, count = self.sim, self.count
        self.slots_of_triangles = self.in_lists = 3 * count
        self.slots = 3 * count + 4 * len(self.quad_rows)
        padded = self.slots + 9  # lanes are filled four at a time
        self.slot_face = np.zeros(padded, np.int64)
        self.slot_link, self.slot_law, self.slot_kind = (np.zeros(padded, np.int32) for _ in range(3))
        self.slot_state = np.zeros(padded, np.uint8)
        closed = sim.closed_faces()
        lost = -1
        for rows, n, first in ((self.triangle_rows[:count], 3, 0), (self.quad_rows, 4, 3 * count)):
            found = build.links(
                sim.number, rows, n, first, sim.x.shape[1], sim.where, sim.partner, closed, sim.joint_row,
                self.slot_face, self.slot_link, self.slot_law, self.slot_kind, self.slot_state,
            )  # fmt: skip
            lost = max(lost, int(found))
        self._agree_on_lost(lost, "the joint of face")
        self.slot_history = np.zeros((padded, HISTORY))
        self.first_slot = np.empty(sim.n_own, np.int64)
        self.first_slot[self.triangle_rows[:count] - sim.n_left] = 3 * np.arange(count)
        self.first_slot[self.quad_rows - sim.n_left] = 3 * count + 4 * np.arange(len(self.quad_rows))
        blocks = -(-count // elements.BLOCK)
        self.head, self.follow = np.full(blocks, -1, np.int32), np.full(padded, -1, np.int32)
        self._make_joint_laws()

    def _make_loads(self) -> None:
        """Tractions on owned faces, and forces that die down."""
        sim, mesh, own = self.sim, self.sim.the_mesh(), self.sim.owned
        number = sim.number[own]
        cells = mesh.cells[number]
        faces = 4 * number[:, None] + np.arange(4)
        i, k = np.nonzero((sim.load_row[faces] > 0) & (cells >= 0))
        k2 = (k + 1) % connectivity.corner_counts(cells)[i]
        row = i + own.start
        self.special: np.ndarray = np.zeros((sim.n_own, 4), dtype=bool)
        self.special[i, k] = self.special[i, k2] = True
        self.load_edge = row * sim.x.shape[1] + 2 * k
        self.load_a, self.load_b = 8 * row + 2 * k, 8 * row + 2 * k2
        places = mesh.points[connectivity.face_points(mesh.cells, faces[i, k])].mean(axis=1)
        self.load_functions = Placed(sim.loads, sim.load_row[faces[i, k]].astype(np.int64), places)
        self.load_of = self.load_functions.of
        self._make_dashpots(np.flatnonzero(sim.quiet_faces()[faces[i, k]]), row, k, k2)
        dies_down = self._make_relaxations()
        sim.surface_loads.corners(sim, self.special)
        self.some_applied = bool(sim.surface_loads) or sim.comm.any(len(i) > 0 or dies_down)

    def _make_relaxations(self) -> bool:
        """What elements that were taken out left behind at corners that are owned; whether there is some."""
        sim, own = self.sim, self.sim.owned
        parts = [one for one in sim.relaxations if not sim.has_ended(one)]
        corner = np.concatenate([one.corner for one in parts] or [np.empty(0, np.int64)])
        force = np.concatenate([one.force for one in parts] or [np.empty((0, self.dim))])
        each = [len(one.corner) for one in parts]
        at_row = sim.where[corner // 4]
        at = np.flatnonzero((at_row >= own.start) & (at_row < own.stop))
        self.special[at_row[at] - own.start, corner[at] % 4] = True
        self.relaxing_corner = self.force_width * at_row[at] + self.stride * (corner[at] % 4)
        self.relaxing_force = force[at].copy()
        self.relaxing_begin = np.repeat(np.array([one.begin for one in parts]), each)[at]
        self.relaxing_span = np.repeat(np.array([one.span for one in parts]), each)[at]
        self.relaxing_steps = np.repeat(np.array([one.in_steps for one in parts], bool), each)[at]
        return len(at) > 0

    def _relax(self) -> None:
        """Add what is left of these forces now."""
        if len(self.relaxing_corner):
            now = np.where(self.relaxing_steps, float(self.sim.clock.step), self.sim.clock.time)
            left = np.clip(1.0 - (now - self.relaxing_begin) / self.relaxing_span, 0.0, 1.0)
            moving.relax(self.relaxing_corner, self.relaxing_force, left, self.applied)

    def _make_dashpots(self, quiet: np.ndarray, row: np.ndarray, k: np.ndarray, k2: np.ndarray) -> None:
        """Dashpots of the quiet ones among the loaded faces: row, corner k to k2."""
        sim, quiet = self.sim, self._acting(quiet)
        row, ends = row[quiet], np.column_stack([k[quiet], k2[quiet]])
        self.quiet_edge, self.quiet_of = self.load_edge[quiet], self.load_of[quiet]
        self.quiet_corner = 8 * row[:, None] + 2 * ends
        self.quiet_place = row[:, None] * sim.v.shape[1] + 2 * ends
        self.quiet_p, self.quiet_s = self._impedances(sim.number[row])

    def _acting(self, quiet: np.ndarray) -> np.ndarray:
        """These faces, none in static runs, where that is said."""
        sim = self.sim
        if sim.options.dynamic:
            return quiet
        if sim.log is not None and sim.quiet_faces().any():
            sim.log.warn_once(
                "quiet",
                "quiet faces act in dynamic runs only: in this static stage they carry no more than their stress",
            )
        return quiet[:0]

    def _impedances(self, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """rho c_p and rho c_s of elements (n,) [Pa s/m]."""
        row, of = self.sim.element_row[number], moduli(self.sim.element_rows, self.sim.options.plane_stress)
        rho = np.array(self.sim.element_rows.column("density"))[row]
        return np.sqrt(rho * of.wave[row]), np.sqrt(rho * of.shear[row])

    def _make_nodes(self) -> None:
        """Nodes that do not move by themselves: of several corners, with conditions or loads, of quads."""
        sim, mesh, own = self.sim, self.sim.the_mesh(), self.sim.owned
        number = sim.number[own]
        cells, node = mesh.cells[number], sim.node[number]
        real = node >= 0
        self.special[real] |= sim.shared_nodes[node[real]] | (sim.corner_row.reshape(-1, 4)[number][real] > 0)
        if self.dim == 2:  # quads
            self.special[cells[:, 3] >= 0] = True
            if self.whole is not None:
                self.special[self.whole.rows - sim.n_left] = True
        self.special &= real
        self.some_special = bool(self.special.any())
        nothing = np.empty(0, np.int64)
        mine = node[real]
        low = int(mine.min(initial=len(sim.shared_nodes)))
        scratch = np.full(max(int(mine.max(initial=-1)) + 1 - low, 0), -1, np.int32)
        args = sim.number, sim.n_left, sim.n_own, self.special, sim.node, sim.member_begin, low, scratch
        n = build.special_nodes(*args, nothing, nothing, nothing)
        self.node_lead, self._start, self._one = (np.empty(n, np.int64) for _ in range(3))
        if n:
            build.special_nodes(*args, self.node_lead, self._start, self._one)
        m = int(self._one.sum())
        self.node_begin = np.zeros(n + 1, np.int64)
        self.node_corner, self.node_place, self.node_again = (np.empty(m, np.int64) for _ in range(3))
        self.node_mass = np.empty(n)
        lost = self._place_nodes(self.true_mass)
        self._agree_on_lost(lost, "the node of corner")
        rows = self.node_corner // self.force_width
        self.shared = sim.comm.any(bool(((rows < own.start) | (rows >= own.stop)).any()))
        lead = mesh.cells[self.node_lead // 4, self.node_lead % 4]
        row, part = sim.rows_of_nodes(self.node_lead, sim.node)
        self.node_functions = Placed(sim.acting(), row, mesh.points[lead])
        self.node_condition = self.node_functions.of
        self.node_share = np.where(np.isnan(part), self._one / np.maximum(sim.point_corners[lead], 1), part)
        self.outside, self.felt = np.zeros((n, self.dim)), np.zeros((n, 2 * self.dim))
        total = len(sim.number)
        self.force = np.zeros((total if self.some_special or self.shared else 1, self.force_width))
        self.applied = np.zeros((total if self.some_applied else 1, self.force_width))
        self._mark_special()

    def _mark_special(self) -> None:
        """Elements with corners that nodes.py moves."""
        self.triangle_special = self.special[self.triangle_rows[: self.count] - self.sim.n_left].any(axis=1)
        self.block_special = self._per_block(self.triangle_special)

    def _per_block(self, flags: np.ndarray) -> np.ndarray:
        blocks = len(self.head)
        padded = np.zeros(blocks * elements.BLOCK, bool)
        padded[: self.count] = flags
        return padded.reshape(blocks, elements.BLOCK).any(axis=1)

    def _place_nodes(self, mass: np.ndarray) -> int:
        sim = self.sim
        return int(
            build.place_nodes(
                self.node_lead, self._start, self._one, sim.member, sim.where, sim.the_mesh().cells, sim.v.shape[1],
                self.force_width, self.stride, mass, self.node_begin, self.node_corner, self.node_place,
                self.node_again, self.node_mass,
            )
        )  # fmt: skip

    # ---- masses and time step ------------------------------------------------------------------------------------

    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n_own, 4) [N/m per m] at each corner: half the largest penalty of each of its joints, and what the
        contact of its free faces can have; and what surface loads bring. And the dashpots (n_own, 4) [N s/m per m] of
        these contacts, and of quiet faces.

        Contact on a face of length L: P (3/2) (L / h + L / h_other), h: altitude on the face, h_other: the smallest
        altitude of all elements. Where elements are of one size that is about what there is; elsewhere the smallest
        ones limit the time step by themselves. (It must not follow from who is near: a restart makes new lists.)
        """
        sim, mesh, own = self.sim, self.sim.the_mesh(), self.sim.owned
        number = sim.number[own]
        cells = mesh.cells[number]
        corners = connectivity.corner_counts(cells)
        faces = 4 * number[:, None] + np.arange(4)
        real = cells >= 0
        penalty = joint_law.stiffest(
            sim.joint_rows.column, laws_of(sim.joint_rows), sim.joint_row[faces], lambda: self.shapes.length[own]
        )
        closed = sim.closed_faces()[faces] & real
        tied = closed & (sim.joint_row[faces] > 0)
        each, drag = np.where(tied, 0.5 * penalty, 0.0), np.zeros(faces.shape)
        if sim.options.collision:
            length, double_area = self.shapes.length[own], self.shapes.double_area[own]
            surfaces = Surfaces(sim, self.shapes, faces.reshape(-1), np.repeat(np.arange(own.start, own.stop), 4))
            highest = float(np.max(length.max(axis=1) / double_area, initial=0.0))
            others = bool((np.isnan(surfaces.overlay) | ~np.isnan(surfaces.normal))[real.reshape(-1)].any())
            highest, some = sim.comm.max_into(np.array([highest, float(others)])).tolist()
            most = surfaces.most_penalty(some == 0.0).reshape(-1, 4)
            contact = 1.5 * most * (length * length / double_area[:, None] + length * highest)
            may_touch = real & ~closed
            if sim.options.dynamic:
                may_touch |= tied  # once they break
            each = np.maximum(each, np.where(may_touch, contact, 0.0))
            # Half of 2 xi sqrt(k m) L, with k L = 2 `contact` and m L no more than two corners of the element have.
            ratio = float(sim.comm.max_into(np.array([surfaces.ratio.max(initial=0.0)]))[0])
            heavy = 2.0 * self.true_mass[own].max(axis=1, initial=0.0)[:, None]
            drag = np.where(may_touch, ratio * np.sqrt(2.0 * contact * heavy), 0.0)
        quiet = sim.quiet_faces()[faces] & real
        if quiet.any():
            drag = drag + np.where(quiet, 0.5 * self._impedances(number)[0][:, None] * self.shapes.length[own], 0.0)
        before = np.where(np.arange(4) > 0, np.arange(4) - 1, corners[:, None] - 1)
        springs, dashpots = (part + np.take_along_axis(part, before, axis=1) for part in (each, drag))
        springs = np.where(real, springs, 0.0)
        sim.surface_loads.springs(sim, springs)
        dashpots = np.where(real, dashpots, 0.0)
        sim.surface_loads.dashpots(sim, dashpots)
        return springs, dashpots

    def critical_time_step(self, target: float = 0.0, mass: np.ndarray | None = None) -> float:
        """Stability limit times the safety factor [s]; infinite in static mode. target: raise `mass` (n, 4) until this
        time step is stable. Collective."""
        sim, o = self.sim, self.sim.options
        if not o.dynamic:
            return math.inf
        least = self._stable_time_step(target, self.true_mass.copy() if mass is None else mass)
        return sim.safety() * float(sim.comm.min_into(np.array([least]))[0])

    def _stable_time_step(self, target: float, mass: np.ndarray) -> float:
        """Of this rank's elements, see `limits.time_step`."""
        o = self.sim.options
        return limits.time_step(
            self.stiff, self.stiff_q, self.triangle_rows[: self.count], self.quad_rows, self.sim.owned.start,
            *self.springs(), o.mass_damping, o.stiffness_damping, self.sim.safety(), target, mass,
        )  # fmt: skip

    def row_sums(self) -> np.ndarray:
        """Sums of |K_ij| over a row of the stiffness at each corner (n, 4) [N/m per m], in space [N/m]. Collective."""
        masses = np.zeros_like(self.true_mass)
        self._make_static_masses(masses)
        return masses / (0.25 * 1.25 * (1.0 + ALPHA))

    def _make_static_masses(self, mass: np.ndarray) -> None:
        limits.static_masses(
            self.stiff, self.stiff_q, self.triangle_rows[: self.count], self.quad_rows, self.sim.owned.start,
            self.springs()[0], ALPHA, mass,
        )  # fmt: skip

    def added_mass(self) -> float:
        """Mass that mass scaling has added, over the true mass. Collective."""
        comm, own = self.sim.comm, self.sim.owned
        true = exact_sum(self.true_mass[own], comm)
        return exact_sum(self.mass[own] - self.true_mass[own], comm) / true

    @property
    def true_mass(self) -> np.ndarray:
        """Masses of the corners (n, 4) [kg/m], in space [kg]."""
        return self._true_mass

    @property
    def mass(self) -> np.ndarray:
        """Those that the motion sees."""
        return self._mass

    def true_masses(self) -> bool:
        """One table as long as nothing is added to the masses: only static runs and mass scaling do."""
        o = self.sim.options
        return o.dynamic and o.mechanical and o.mass_scaling == 0.0

    def _set_masses(self) -> None:
        """Masses of the corners that the motion sees, and the time step. Collective."""
        sim, o = self.sim, self.sim.options
        self._mass = self.true_mass if self.true_masses() else self.true_mass.copy()
        if not o.dynamic or not o.mechanical:
            self._make_static_masses(self.mass)
            sim.clock.dt = 1.0
        else:
            wanted = sim.rebuild_state.dt == 0.0
            if wanted or o.mass_scaling > 0.0:
                critical = self.critical_time_step(o.mass_scaling, self.mass)
                if wanted:
                    sim.rebuild_state.dt = o.dt or o.mass_scaling or critical
                    sim.rebuild_state.estimated = sim.clock.step
                    sim.tell_time_step(
                        sim.rebuild_state.dt, critical, self.added_mass() if o.mass_scaling > 0.0 else 0.0
                    )
            sim.clock.dt = sim.rebuild_state.dt
        if sim.comm.size > 1:
            sim.halo.fill(self.mass)
        self._place_nodes(self.mass)
        dt = sim.clock.dt
        self.node_kick = dt / self.node_mass
        self._conditions = None if sim.conditions_vary() else sim.conditions_at(0.0, 0.0, dt)
        self._set_kicks(dt)

    def _set_kicks(self, dt: float) -> None:
        """What moves corners that are alone."""
        triangles = self.triangle_rows[: self.count]
        alone = ~self.special[triangles - self.sim.n_left][:, :3]
        with np.errstate(divide="ignore"):
            self.c[: self.count, elements.KICK : elements.KICK + 3] = np.where(
                alone, dt / self.mass[triangles, :3], 0.0
            )

    # ---- calls ---------------------------------------------------------------------------------------------------

    def _bind(self) -> None:
        """Kernels for this number of threads, and their argument lists."""
        sim, pairs, o = self.sim, self.pairs, self.sim.options
        one = sim.threads == 1
        self._triangles: Any = elements.triangles if one else elements.triangles_threaded
        self._quads: Any = elements.quads if one else elements.quads_threaded
        self._yielding_quads: Any = plastic_quads.yielding if one else plastic_quads.yielding_threaded
        self._move: Any = moving.move if one else moving.move_threaded
        self.of_joints = np.zeros((len(sim.number) if sim.budget is not None else 1, elements.FORCE))
        small = not o.large_strain
        stressed = sim.stress0 is not None or self.plastic or self.creeps or self.heated
        self._triangle_args = (
            sim.threads, self.count, self.triangle_rows, sim.wide, sim.x, sim.v, self.c, self.s0,
            stressed or any(one is not self.law_of_triangles for one in self.laws), small, self.slot_link,
            self.slot_law, self.slot_kind, self.slot_state, self.slot_history, self.head, self.follow,
            self.joint_table, self.joint_beyond, pairs.block_begin, pairs.lane, pairs.slot, pairs.pushed,
        )  # fmt: skip
        self._quad_args = (
            sim.threads, len(self.quad_rows), self.quad_rows, sim.x, sim.v, self.q, self.quad_s0,
            stressed or any(one is not self.law_of_quads for one in self.laws), small, self.slots_of_triangles,
            self.slot_link, self.slot_law, self.slot_kind, self.slot_state, self.slot_history, self.joint_table,
            self.joint_beyond, pairs.quad_slot, pairs.pushed,
        )  # fmt: skip

    def forces(self) -> None:
        """Forces at the present positions, and the velocities that follow from them. Collective."""
        sim, timers = self.sim, self.sim.timers
        self.passes += 1
        if len(self.pairs):
            with timers("contact"):
                self.pairs.forces(sim.x, sim.v, sim.clock.dt)
        with timers("force"):
            keep = sim.budget is not None
            self._elements(self.triangle_special, self.block_special, self.force, self.of_joints, keep)
        if sim.options.dynamic:
            sim.creep.passed = 0.0
        if self.some_special or self.shared:
            with timers("node"):
                self.move_nodes()

    def _elements(
        self, special: np.ndarray, block_special: np.ndarray, force: np.ndarray, of_joints: np.ndarray, keep: bool
    ) -> None:
        sim, o = self.sim, self.sim.options
        alpha, step = 0.0 if o.dynamic else ALPHA, sim.clock.step
        if self.yields:
            self.flow(self.plastic_state(), step, quads=False)
        if self._creeps_now():
            self.creep(sim.cold["creep"], [of.s0 for of in self.solids], keep=o.dynamic)
        if self.laws:
            memory = sim.cold[user_laws.COLUMN]
            self._obey(memory, self.s0, self.quad_s0, every=False)
        what = (keep, o.gx, o.gy, o.mass_damping, o.stiffness_damping)
        args: tuple[Any, ...] = *self._triangle_args, special, block_special, force, of_joints, *what, alpha, step
        if (one := self.law_of_triangles) is not None:
            loop = one.law.loops.triangles if sim.threads == 1 else one.law.loops.triangles_threaded
            loop(args[0], one.obeying(self, memory, False), *args[1:], self.tally)
        else:
            self._triangles(*args, self.tally)
        if self.whole is not None:
            self.whole.add_forces(sim.v, 1.0, force)
        if not len(self.quad_rows):
            return
        args = *self._quad_args, force, of_joints, *what, step
        if (one := self.law_of_quads) is not None:
            loop = one.law.loops.quads if sim.threads == 1 else one.law.loops.quads_threaded
            loop(args[0], one.obeying(self, memory, True), *args[1:], self.tally)
        elif self.yields:
            self._yielding_quads(
                *args, self.tally, sim.n_left, self.quad_initial, self.quad_law, self.strength, sim.cold["plastic"],
                self.yield_table,
            )  # fmt: skip
        else:
            self._quads(*args, self.tally)

    def open_joints(self) -> None:
        """Joints remember the present positions: those beyond their peak pass it, or break. Elements do not flow."""
        scratch, of_joints = (np.zeros((len(self.sim.number), self.force_width)) for _ in range(2))
        self.pairs.pushed[:] = 0.0
        v = self.sim.v.copy()  # triangles kick their corners
        with self.without_flow():
            self._fill(scratch, of_joints, True)
        self.sim.v[:] = v

    @contextmanager
    def without_flow(self) -> Iterator[None]:
        """Elements are elastic meanwhile, with what they remember of flow."""
        yields, self.yields = self.yields, False
        try:
            yield
        finally:
            self.yields = yields

    def plastic_state(self) -> tuple[np.ndarray, ...]:
        """What flow changes: what elements remember of yielding (n_own, 9 or 36), stresses without strain of triangles
        (count + 3, 4) and of quads (quads, 16) [Pa], yield surfaces (rows, 4), strains that strength follows."""
        return self.sim.cold["plastic"], self.s0, self.quad_s0, self.yield_table, self.strength.history

    def flow(self, state: tuple[np.ndarray, ...], step: int, quads: bool = True) -> None:
        """Elements outside their yield surface at the present positions flow: the arrays of `plastic_state`, or copies
        of them, become those after it. step: in which they do; quads: these too, which within a step flow in the loop
        over their forces."""
        memory, *after, table, history = state
        sim, soft = self.sim, self.strength._replace(history=history)
        kernel = plastic_flow.flows if sim.threads == 1 else plastic_flow.flows_threaded
        for of, s0 in zip(self.solids if quads else self.solids[:1], after):
            if len(of.flowing):
                kernel(
                    sim.threads, of.tables, len(of.flowing) - 3, of.flowing, of.initial, of.law, soft,
                    not sim.options.large_strain, step, memory, s0.reshape(of.s0.shape), table,
                )  # fmt: skip

    def _obey(self, memory: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray, every: bool) -> None:
        """Laws of the user at the present positions: memory, see `user_laws.begin`, becomes that after it, s0
        (count + 3, 4) and quad_s0 (quads, 16) [Pa] the stress. every: those too that run in the loop over forces."""
        sim, small = self.sim, not self.sim.options.large_strain
        for one in self.laws:
            if one.triangles and (every or one is not self.law_of_triangles):
                one.law.loops.look(
                    one.obeying(self, memory, False), self.count, self.triangle_rows, sim.wide, sim.x, sim.v, self.c,
                    self.law_base, small, s0,
                )  # fmt: skip
            if one.quads and (every or one is not self.law_of_quads):
                one.law.loops.look_quads(
                    one.obeying(self, memory, True), len(self.quad_rows), self.quad_rows, sim.x, sim.v, self.q,
                    self.quad_law_base, small, quad_s0,
                )  # fmt: skip

    def obeyed(self, s0: np.ndarray, quad_s0: np.ndarray) -> np.ndarray:
        """State variables of laws of the user, see `user_laws.begin`, after this moment, which the next forces will
        see; s0 (count + 3, 4) and quad_s0 (quads, 16) [Pa] become their stress. The model stays as it is."""
        memory = self.sim.cold[user_laws.COLUMN].copy()
        self._obey(memory, s0, quad_s0, every=True)
        return memory

    def law_states(self) -> np.ndarray:
        """The same (n_own, 1 + states); of quads the mean of their triangles by area."""
        sim = self.sim
        memory = self.obeyed(self.s0.copy(), self.quad_s0.copy()) if self.laws else sim.cold[user_laws.COLUMN]
        found = memory[:, : 1 + (memory.shape[1] - 1) // sim.element_parts].copy()
        quads = self.quad_rows - sim.n_left
        if len(quads) and found.shape[1] > 1:
            found[quads, 1:] = self._mean_of_parts(memory[quads, 1:].reshape(len(quads), 4, -1))
        return found

    def _mean_of_parts(self, parts: np.ndarray) -> np.ndarray:
        """Mean by area of columns (quads, 4, n) of the triangles of quads."""
        areas = self.q[:, elements.Q_AREA : elements.Q_AREA + 4, None]
        return (areas * parts).sum(axis=1) / areas.sum(axis=1)

    def _creeps_now(self) -> bool:
        """The next forces are those after some creep, or begin it."""
        sim = self.sim
        return self.creeps and sim.creep.on and (sim.options.dynamic or sim.creep.passed > 0.0)

    def creep(self, memory: np.ndarray, s0: Sequence[np.ndarray], keep: bool) -> None:
        """Elements creep for the time that has passed, see `creep.creep`: memory, if they keep it, and stress without
        strain of `solids` [Pa] become those after it."""
        sim = self.sim
        kernel = creep.creep if sim.threads == 1 else creep.creep_threaded
        how = self.creep_table, not sim.options.large_strain, sim.creep.passed, keep, memory
        for of, stress in zip(self.solids, s0):
            if len(of.creeping):
                kernel(sim.threads, of.creeping, of.tables, of.uncrept, of.model, *how, stress)

    def keep_creep(self) -> None:
        """Elements have crept for the time that has passed, and remember it."""
        self.creep(self.sim.cold["creep"], [of.s0 for of in self.solids], keep=True)

    def crept(self, s0: Sequence[np.ndarray]) -> np.ndarray:
        """What elements remember of creep after that of this moment, which the next forces will see; the stress without
        strain of `solids` becomes that after it. The model stays as it is."""
        memory = self.sim.cold["creep"].copy()
        if self._creeps_now():
            self.creep(memory, s0, keep=True)
        return memory

    def lost_by_creep(self) -> np.ndarray:
        """What owned elements have lost by creep (n_own,) [J], in the plane [J/m]."""
        memory, found = self.crept([of.s0.copy() for of in self.solids]), np.zeros(self.sim.n_own)
        for of in self.solids:
            of.share_out(of.histories(memory, self.sim.memory("creep"))[:, :, creep.LOST].sum(axis=1), found)
        return found

    def creep_memory(self, memory: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """What the parts of elements that creep remember in memory (n, 10 or 16), and the rows (n,) of their models in
        the table."""
        found = []
        for of in self.solids:
            parts = of.histories(memory, self.sim.memory("creep"))[of.creeping]
            found.append((parts.reshape(-1, parts.shape[2]), np.repeat(of.model[of.creeping], parts.shape[1])))
        return found

    def linear(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Constants and stress without strain (n, parts, k) [Pa] of the elastic elements that those of `solids` are at
        this moment: those that creep within this creep step, others after the flow of this moment. Not to be
        changed."""
        sim = self.sim
        found = [(of.c, of.s0) for of in self.solids]
        if self.creeps and sim.creep.passed > 0.0:
            found = [(c.copy(), s0.copy()) for c, s0 in found]
            how = self.creep_table, sim.creep.passed, sim.cold["creep"]
            for of, like in zip(self.solids, found):
                if len(of.creeping):
                    creep.as_elastic(of.creeping, of.tables, of.uncrept, of.model, *how, *like)
        if self.yields:
            for k, (of, flowed) in enumerate(zip(self.solids, self.flowed()[1:])):
                (c, s0), flowed = found[k], flowed.reshape(of.s0.shape)
                flowed[of.creeping] = s0[of.creeping]
                found[k] = c, flowed
        return found

    def creep_strains(self) -> np.ndarray:
        """Creep strain and strain of the Kelvin unit, xx, yy, xy, in space zz, xz, yz besides, each (n_own, 6 or 12),
        along the axes of space; means over the parts of elements by volume."""
        sim = self.sim
        out = np.zeros((sim.n_own, 6 if self.dim == 2 else 12))
        memory = self.crept([of.s0.copy() for of in self.solids])
        for of in self.solids:
            found = np.zeros((of.count, out.shape[1]))
            if of.count:
                creep.strains(of.count, of.tables, not sim.options.large_strain, memory, found)
            of.spread(found, out)
        return out

    @property
    def quad_initial(self) -> np.ndarray:
        """Stress [Pa] of quads without plastic strain, a row each."""
        return self.solids[1].initial.reshape(-1, *self.quad_s0.shape[1:])

    def flowed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What elements remember of yielding (n_own, 9 or 36) and the stresses without strain of triangles
        (count + 3, 4) and of quads (quads, 16) [Pa], after the flow of this moment, which the next forces will see:
        copies."""
        after = tuple(part.copy() for part in self.plastic_state())
        if self.yields:
            self.flow(after, self.sim.clock.step)
        return after[0], after[1], after[2]

    def beyond(self) -> tuple[np.ndarray, np.ndarray]:
        """By how much [Pa] the stress of owned elements (n_own,) is outside their strength, before they flow from it,
        the larger of shear and tension, negative: inside; and that stress (n_own, 4), in space (n_own, 6)."""
        stress = self.stresses(energies=False, flow=False)[0]
        whole = np.zeros((len(stress), 6))
        whole[:, : stress.shape[1]] = stress
        low, _, high = principal(whole[:, [0, 2, 4, 2, 1, 5, 4, 5, 3]].reshape(-1, 3, 3))[0].T
        surface = self.yield_table[self._surfaces()]
        shear = surface[:, plasticity.N_PHI] * high - low - surface[:, plasticity.STRENGTH]
        return np.maximum(shear, high - surface[:, plasticity.TENSILE]), stress

    def _surfaces(self) -> np.ndarray:
        """(n_own,) rows of the table of yield surfaces, of elements of several parts that of the first one."""
        found = np.zeros(self.sim.n_own, np.int64)
        for of in self.solids:
            of.spread(of.law[: of.count, 0], found)
        return found

    def plastic_columns(self, at: slice | np.ndarray) -> np.ndarray:
        """Columns `plasticity.MEMORY` (n, 9) of what owned elements remember of yielding, after the flow of this
        moment: means over their parts by volume, the latest steps, the sum of the work."""
        sim, memory = self.sim, self.flowed()[0]
        found, latest = np.zeros((sim.n_own, plasticity.MEMORY)), [plasticity.IN_SHEAR, plasticity.IN_TENSION]
        for of in self.solids:
            if of.count:
                parts = of.histories(memory, sim.memory("plastic"))[:, :, : plasticity.MEMORY]
                mean = of.mean(parts)
                mean[:, latest] = parts[:, :, latest].max(axis=1)
                of.spread(mean, found)
                of.share_out(parts[:, :, plasticity.WORK].sum(axis=1), found[:, plasticity.WORK])
        return found[at]

    def move_nodes(self) -> None:
        """New velocities of the nodes from the forces on their corners. Collective."""
        sim, clock = self.sim, self.sim.clock
        if not (self.some_special or self.shared):
            return
        if self.some_applied:
            self.applied[:] = 0.0
            loads = self.loads_now(self.load_functions, sim.time_now())
            moving.tractions(self.load_edge, self.load_a, self.load_b, self.load_of, loads, sim.x, self.applied)
            if len(self.quiet_edge):
                moving.dashpots(
                    self.quiet_edge, self.quiet_corner, self.quiet_place, self.quiet_p, self.quiet_s, self.quiet_of,
                    loads, sim.x, sim.v, self.applied,
                )  # fmt: skip
            self._relax()
            sim.surface_loads.add_to(self.applied)
        if self.shared:
            sim.halo.fill(self.force)
            if self.some_applied:
                sim.halo.fill(self.applied)
        table = self._conditions
        if table is None:
            now, half = sim.time_now(), 0.5 * clock.dt if sim.options.dynamic else 0.0
            table = self.conditions_now(self.node_functions, now, now + half, clock.dt)
        self._move(
            sim.threads, self.node_begin, self.node_corner, self.node_place, self.node_again, self.node_kick,
            self.node_condition, self.node_share, table, self.some_applied, self.force, self.applied, sim.v,
            0.0 if sim.options.dynamic else ALPHA, self.outside, self.felt,
        )  # fmt: skip

    def loads_now(self, placed: Placed, time: float) -> np.ndarray:
        """The table of tractions (rows, 7), with a row of its own for each face whose traction is a function."""
        return placed.filled(self.sim.loads_at(time), lambda one, field: (TRACTIONS[2].index(field), time, 1.0))

    def conditions_now(self, placed: Placed, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of node conditions, with a row of its own for each node whose condition is a function."""

        def how(one: NodeCondition, field: str) -> tuple[int, float, float]:
            if field in ("force_x", "force_y"):
                return (
                    (moving.FORCE_X if field == "force_x" else moving.FORCE_Y),
                    time,
                    getattr(one, f"part_{field[-1]}"),
                )
            column, does = (moving.AT_X, one.does_x) if field == "at_x" else (moving.AT_Y, one.does_y)
            return (column, middle, 1.0) if does == moving.VELOCITY else (column, time, dt)

        return placed.filled(self.sim.conditions_at(time, middle, dt), how)

    # ---- looking ---------------------------------------------------------------------------------------------------

    def evaluation(self, contact: bool = True) -> Evaluation:
        """Forces at the present positions; everything is put back as it was. contact: with those of contact.
        Collective."""
        sim, pairs, total = self.sim, self.pairs, len(self.sim.number)
        changed = sim.v, self.outside, self.felt, *pairs.changed_by_forces(), *self.changed_by_forces()
        kept = [(table, table.copy()) for table in changed]
        with self.joints_kept():
            stored = self.force
            self.force, of_joints = np.zeros((total, self.force_width)), np.zeros((total, self.force_width))
            if not contact:
                pairs.pushed[:] = 0.0
            elif len(pairs):
                pairs.forces(sim.x, sim.v, sim.clock.dt)
            self._fill(self.force, of_joints, True)
            self.move_nodes()
            found = Evaluation(
                self.force, of_joints, pairs.pushed.copy(), pairs.touching.copy(), pairs.out.copy(),
                self.outside.copy(), self.felt.copy(), sim.v.copy(),
            )  # fmt: skip
            self.force = stored
        for table, values in kept:
            table[...] = values
        return found

    def changed_by_forces(self) -> list[np.ndarray]:
        """What elements remember, and their stress without strain, as far as computing forces changes them."""
        found = [*self.plastic_state()] if self.yields else []
        if self.laws:
            found.append(self.sim.cold[user_laws.COLUMN])
        if self._creeps_now():
            found.append(self.sim.cold["creep"])
        return found + ([self.s0, self.quad_s0] if self.laws or self._creeps_now() else [])

    def _fill(self, force: np.ndarray, of_joints: np.ndarray, keep: bool) -> None:
        """All forces into the rows of all corners."""
        self._elements(np.ones(self.count, bool), np.ones(len(self.head), bool), force, of_joints, keep)

    def first_corners(self) -> np.ndarray:
        """Lowest corner (element * 4 + k) of each special node. Not to be changed."""
        return self._first_corners

    @cached_property
    def _first_corners(self) -> np.ndarray:
        out = self.node_lead.copy()
        several = self._start >= 0
        out[several] = self.sim.member[self._start[several]]
        return out

    @cached_property
    def my_nodes(self) -> np.ndarray:
        """Special nodes whose lowest corner is on an element of this rank, bool."""
        row, own = self.sim.where[self._first_corners // 4], self.sim.owned
        return (row >= own.start) & (row < own.stop)

    @cached_property
    def leads(self) -> np.ndarray:
        """(np,) lowest corner (element * 4 + k) of elements that are there at each point of the mesh, -1: none."""
        sim, mesh = self.sim, self.sim.the_mesh()
        corner = np.arange(mesh.cells.size).reshape(mesh.cells.shape)
        use = (mesh.cells >= 0) & sim.alive[:, None]
        out = np.full(len(mesh.points), -1, np.int64)
        out[mesh.cells[use][::-1]] = corner[use][::-1]
        return out

    @cached_property
    def edges(self) -> np.ndarray:
        """Lower faces of all edges between two elements that are there, of all ranks."""
        return np.flatnonzero(self.sim.joint_exists())

    @cached_property
    def lower_faces(self) -> np.ndarray:
        """Lower faces of the owned elements that have a joint model."""
        sim = self.sim
        faces = (4 * sim.number[sim.owned][:, None] + np.arange(4)).reshape(-1)
        return faces[sim.joint_exists()[faces] & (sim.joint_row[faces] > 0)]

    @cached_property
    def lower_slots(self) -> np.ndarray:
        """Their slots."""
        return self.slot_of(self.lower_faces)

    def alone(self) -> np.ndarray:
        """(n_own, 4) bool: corners of owned elements that move by themselves. Not to be changed."""
        return self._alone

    @cached_property
    def _alone(self) -> np.ndarray:
        return ~self.special & (self.sim.the_mesh().cells[self.sim.number[self.sim.owned]] >= 0)

    def stresses(
        self, at: np.ndarray | None = None, energies: bool = True, flow: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n_own, 4) xx, yy, xy, zz [Pa] and, unless they are not wanted, elastic energies (n_own,) [J/m] of the
        owned elements, or of some of them (at: the how-manieth). flow: after the flow of this moment, which the next
        forces will see; without it, which looks at all elements, after that of the last step."""
        sim = self.sim
        s0, quad_s0, memory, crept = self.remembered(flow)
        if at is None:
            rows = sim.x, self.triangle_rows[: self.count], self.quad_rows, self.c, self.q, s0, quad_s0
            n, first = sim.n_own, sim.n_left
        else:
            triangle = self.triangle_of_row[at]
            three, n, first = triangle >= 0, len(at), 0
            triangle, quad = triangle[three], np.searchsorted(self.quad_rows, at[~three] + sim.n_left)
            places = np.flatnonzero(three).astype(np.int32), np.flatnonzero(~three).astype(np.int32)
            rows = (
                sim.x[at + sim.n_left], *places, self.c[triangle], self.q[quad], s0[triangle], quad_s0[quad],
            )  # fmt: skip
        stress, energy = np.zeros((n, 4)), np.zeros(n if energies else 0)
        build.stresses(*rows, not sim.options.large_strain, first, stress, energy)
        if energies and (memory is not None or crept is not None):
            more = self.remembered_energy(memory, crept)
            energy += more if at is None else more[at]
        if self.whole is not None:
            self.whole.put_stresses(at, stress, energy)
        if self.heated and energies:
            energy += self._energy_of_heat() if at is None else self._energy_of_heat()[at]
        if self.laws and energies:  # what such a law stores is not known
            of_users = user_laws.numbers(sim)[sim.number[sim.owned]] > 0
            energy[of_users if at is None else of_users[at]] = math.nan
        return stress, energy

    def remembered(self, flow: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Stress without strain [Pa] after this moment of both `solids`, and what is remembered then of yielding and of
        creep. flow: after the flow of this moment; else that of the last step."""
        plastic = crept = None
        s0, quad_s0 = self.s0, self.quad_s0
        if self.plastic and flow:
            plastic, s0, quad_s0 = self.flowed()
        if plastic is None and (self.creeps or self.laws):
            s0, quad_s0 = s0.copy(), quad_s0.copy()
        if self.creeps:
            crept = self.crept([one.reshape(of.s0.shape) for of, one in zip(self.solids, (s0, quad_s0))])
        if self.laws:
            self.obeyed(s0, quad_s0)
        return s0, quad_s0, plastic, crept

    def remembered_energy(self, plastic: np.ndarray | None, crept: np.ndarray | None) -> np.ndarray:
        """(n_own,) [J], in the plane [J/m], by which the elastic energy differs from that of elements with their stress
        without strain as initial stress; plastic, crept: what is remembered."""
        initial, more = [of.initial for of in self.solids], np.zeros(self.sim.n_own)
        found = [np.zeros(of.count) for of in self.solids]
        if crept is not None:
            for of, energy in zip(self.solids, found):
                if of.count:
                    every = np.arange(of.count)
                    creep.stored(every, of.tables, of.said, of.model, self.creep_table, crept, energy)
            if plastic is not None:
                initial = [of.said.copy() for of in self.solids]
                with_ = [(of, np.arange(of.count), of.said, s0) for of, s0 in zip(self.solids, initial)]
                self._relieve_crept(with_, crept)
        for of, energy in zip(self.solids, found):
            of.share_out(energy, more)
        if plastic is not None:
            self._add_locked_in(initial, plastic, more)
        return more

    def _add_locked_in(self, initial: Sequence[np.ndarray], plastic: np.ndarray, more: np.ndarray) -> None:
        """What plastic strain means for it, see elements/flow.py; initial: stress without it of `solids`."""
        found = np.zeros(self.sim.n_own)
        for of, base in zip(self.solids, initial):
            if of.count:
                energy = np.zeros(of.count)
                plastic_flow.locked_in(of.tables, np.arange(of.count), base, plastic, energy)
                of.share_out(energy, found)
        more += found

    def _energy_of_heat(self) -> np.ndarray:
        """Elastic energy (n_own,) [J/m] that thermal stress p means where there is no strain, beside the mean m of the
        initial stress: (p^2 + 2 p m) A / (2 K), see moduli.py."""
        sim, number = self.sim, self.sim.number[self.sim.owned]
        stress = np.asarray(sim.surface_loads.eigenstress(sim))
        of = moduli(sim.element_rows, sim.options.plane_stress)
        bulk = of.bulk[sim.element_row[number]]
        said = sim.initial_stresses(number) if sim.stress0 is not None else np.zeros((sim.n_own, 4))
        if (part := by_temperature.part_of_young(sim)) is not None:
            bulk = bulk * part
        if self.initial_part is not None:
            said = said * self.initial_part[:, None]
        mean = said[:, of.normal].sum(axis=1) / len(of.normal)
        energy = stress * (0.5 * stress + mean) / bulk * sim.areas[number]
        if self.whole is not None:
            self.whole.gather(energy)
        return energy

    def book(
        self, before: np.ndarray, after: np.ndarray, a: float, b: float, of_joints: np.ndarray, pushed: np.ndarray,
        felt: np.ndarray, outside: np.ndarray, work: np.ndarray,
    ) -> None:  # fmt: skip
        """Add to work (n_own, energy.WORK) what these forces, of one moment, do in a step with a times the velocities
        before their kick and b times those after it."""
        sim, o, pairs, dt = self.sim, self.sim.options, self.pairs, self.sim.clock.dt
        energy.book(
            sim.n_left, sim.n_own, self.triangle_rows[: self.count], self.quad_rows, self.c, self.q,
            not o.large_strain, sim.x, before, after, a, b, of_joints, self.true_mass, o.gx, o.gy, o.mass_damping,
            o.stiffness_damping, dt, work,
        )  # fmt: skip
        if self.whole is not None:
            self.whole.book(before, a * before + b * after, dt, work[:, energy.VISCOUS])
        energy.book_contact(pairs.rows, sim.n_left, pairs.corners, pushed, before, after, a, b, dt, work)
        energy.book_nodes(
            self.node_begin, self.node_place, felt, outside, before, after, a, b, dt, sim.n_left, sim.n_own,
            sim.v.shape[1], work,
        )  # fmt: skip

    def kinetic(self, before: np.ndarray, after: np.ndarray, out: np.ndarray) -> None:
        """Kinetic energy of the owned elements into out (n_own,), of velocities before and after the kick."""
        sim = self.sim
        energy.kinetic(sim.n_left, sim.n_own, sim.the_mesh().cells, sim.number, before, after, self.mass, out)

    # ---- what is taken out of the tables ---------------------------------------------------------------------------

    def histories(self, transfer: bool) -> Histories:
        """What joints and contacts of the owned elements remember.

        transfer: joints that are broken are left out; their friction is handed over to the contacts that follow them.
        """
        parts = [self._joint_histories(transfer), self.pairs.histories(self.sim)]
        if transfer:
            parts.append(self.handed_over())
        return Histories.of(
            self.sim.n_own, np.concatenate([owner for owner, _ in parts]), np.concatenate([rows for _, rows in parts])
        )

    def handed_over(self) -> tuple[np.ndarray, np.ndarray]:
        """Contact histories of joints that have just broken: the joint's shear force, half to each of the two edges.

        Owned element (0 ..) and row (histories.py) for each of their sides.
        """
        sim = self.sim
        slots = np.flatnonzero(self.slot_state == BROKEN)
        rows = np.zeros((len(slots), WORDS))
        if not len(slots):
            return np.empty(0, np.int64), rows
        _, _, sigma, tau = self.joint_means(slots).T
        mesh = sim.the_mesh()
        ends = connectivity.face_points(mesh.cells, self.slot_face[slots])
        way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
        shear = np.where(sigma < 0.0, tau * np.hypot(way[:, 0], way[:, 1]), 0.0)
        cut = sim.cut
        sides = []
        for face in (self.slot_face[slots], sim.partner[self.slot_face[slots]]):
            e, k = face // 4, face % 4
            quad = mesh.cells[e, 3] >= 0
            turn = (k - cut[e]) % 4
            half, edge = np.where(quad, turn // 2, 0), np.where(quad, turn % 2, k)
            sides.append((2 * e + half, half, edge))
        (mine, half, edge), (other, _, other_edge) = sides
        low = mine < other
        at = np.arange(len(slots))
        rows.view(np.int64)[:, KEY] = 2 * other + half
        rows[at, FIRST + np.where(low, edge, 3 + edge)] = 0.5 * shear
        rows[at, FIRST + np.where(low, 3 + other_edge, other_edge)] = 0.5 * shear
        return self.slot_element(slots), rows

    def renew_contacts(self, handed_over: tuple[np.ndarray, np.ndarray]) -> None:
        """New contact lists; joints on faces that have been opened are gone. Collective."""
        sim = self.sim
        self._forget_opened()
        known = self.pairs.known()
        owner, rows = handed_over
        if len(owner):
            more = self.pairs.named(sim.number[sim.owned][owner], rows)
            known = tuple(np.concatenate(parts) for parts in zip(known, more))
        self.pairs = self._contact(*known)
        self._bind()
        if sim.masses_change():
            if sim.budget is not None:
                sim.budget.pause(sim)
            self._set_masses()
