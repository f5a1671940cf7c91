"""The tables of the kernels for the elements that a rank holds, made at each rebuild, and the calls of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.physics.fdem import build, connectivity
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import QUAD, TRIANGLE
from hpcdem.physics.fdem.elements.solids import Solids
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS, Histories
from hpcdem.physics.fdem.joints import JointTables
from hpcdem.physics.fdem.kernels import (
    elements,
    energy,
    plastic_quads,
)
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.loads import Loads
from hpcdem.physics.fdem.masses import Masses
from hpcdem.physics.fdem.moduli import element_table
from hpcdem.physics.fdem.node_set import ALPHA, NodeSet
from hpcdem.physics.fdem.pairs import ContactPairs, Kinds, Shapes
from hpcdem.physics.fdem.six.elements import SixNodes

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


@dataclass
class Evaluation:
    """Forces at the present positions, as the next step will see them [N/m].

    force (n, 8): on the corners of the owned elements, in storage order; at_corners: these, then those of other ranks'
    elements at common nodes, see `NodeSet.table`; of_joints (n, 8): those of them from joints; pushed: those from
    contact, by `pairs.rows`; touching (m,), pair_force (m, 12): by pairs; outside, felt: of special nodes, see
    nodes.py.
    """

    force: np.ndarray
    at_corners: np.ndarray
    of_joints: np.ndarray
    pushed: np.ndarray
    touching: np.ndarray
    pair_force: np.ndarray
    outside: np.ndarray
    felt: np.ndarray
    v_next: np.ndarray
    """Velocities after this moment's kick (n, w) [m/s]."""


class Local(JointTables):
    """Tables of one rank between two rebuilds, in the plane (in space: local_space.py). The model is in storage order,
    ghosts in place. Collective.

    passes: how often the forces of a step were computed. dim: of space; force_width: words of a row of forces; stride:
    from one corner of a row to the next.
    """

    dim, force_width, stride, listed = 2, elements.FORCE, 2, 3 * elements.BLOCK
    corner_masses = staticmethod(Masses.of_corners)
    whole: SixNodes | None = None
    """Macro-elements of the plane, whose forces replace those of their parts."""
    awaited = False  # whether a history reads their forces in the next step
    solids: Solids
    masses: Masses
    loads: Loads
    nodes: NodeSet

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
        self._make_solids()
        self._make_joints()
        self._put_histories()
        self.pairs = self._contact(*ContactPairs.remembered(sim))
        self._make_nodes()
        self._set_masses()
        self._bind()

    def _contact(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> Any:
        """Contact lists, with what is remembered of contacts."""
        return ContactPairs(self.sim, self, low, high, values)

    @cached_property
    def shapes(self) -> Shapes:
        """Shapes of the elements held here that contact needs, by storage row."""
        return Shapes(self.sim, self.sim.number)

    @cached_property
    def kinds(self) -> Kinds:
        """Rows that distinguish the contact properties of faces."""
        return Kinds.of(self.sim)

    # ---- tables --------------------------------------------------------------------------------------------------

    @property
    def true_mass(self) -> np.ndarray:
        """Masses of the corners (n, 4) [kg/m], in space [kg]."""
        return self.masses.true

    def _make_solids(self) -> None:
        """Reference geometry, moduli, true masses, and what makes stress."""
        sim, mesh, count = self.sim, self.sim.reference, self.count
        models = element_table(sim)
        self.masses = Masses(self)
        self.c = np.zeros((count + 3, elements.TRIANGLE))
        self.q = np.zeros((len(self.quad_rows), elements.QUAD))
        build.constants(
            sim.number, mesh.points, mesh.cells, sim.element_row, models, sim.options.dynamic,
            self.triangle_rows[:count], self.quad_rows, self.true_mass, self.c, self.q,
        )  # fmt: skip
        self.c[:count, elements.FREE] = self.q[:, elements.Q_FREE] = float(sim.options.plane_stress)
        self.c[count:] = self.c[count - 1] if count else 1.0
        blocks, quads = [], len(self.quad_rows)
        for kind, of, n, c, s0 in (
            (TRIANGLE, self.triangle_rows, count, self.c, np.zeros((count + 3, 4))),
            (QUAD, self.quad_rows, quads, self.q, np.zeros((quads, 16))),
        ):  # fmt: skip
            stored = of[:n, None].astype(np.int64) - sim.n_left
            blocks.append(ElementBlock(sim, kind, of, c, s0, stored, np.ones(stored.shape)))
        self.whole = SixNodes(self, blocks[0]) if len(mesh.macros) else None
        self._hold(blocks)

    def _hold(self, blocks: Sequence[ElementBlock]) -> None:
        """Set up the solids of these blocks of elements."""
        self.temperature_dependent = any(bool(one.any()) for one in self.sim.temperature_dependent())
        self.solids = Solids(self.sim, blocks, self.temperature_dependent, self.whole)
        self.yielding, self.creeping, self.laws = self.solids.yielding, self.solids.creeping, self.solids.laws

    def follow_heat(self) -> None:
        """Temperatures have changed: moduli, strengths and stress without strain are those of now."""
        if self.temperature_dependent:
            self._follow_joints()
        self.solids.follow_heat()

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

    def _make_nodes(self) -> None:
        """Loads, and nodes that do not move by themselves."""
        sim = self.sim
        self.loads = Loads(sim, self.force_width, self.stride)
        special = self.loads.special
        special[self.quad_rows - sim.n_left] = True
        if self.whole is not None:
            special[self.whole.rows - sim.n_left] = True
        self.nodes = NodeSet(sim, special, self.force_width, self.stride)
        self.outside, self.felt = self.nodes.outside, self.nodes.felt
        self._agree_on_lost(self.nodes.find_corners(), "the node of corner")
        self.moves_nodes = self.nodes.some or self.nodes.shared
        self.at_corners, self.force = self.nodes.tables(self.loads, self.moves_nodes)
        self.triangle_special = special[self.triangle_rows[: self.count] - sim.n_left].any(axis=1)
        self.block_special = self._per_block(self.triangle_special)

    def _per_block(self, flags: np.ndarray) -> np.ndarray:
        blocks = len(self.head)
        padded = np.zeros(blocks * elements.BLOCK, bool)
        padded[: self.count] = flags
        return padded.reshape(blocks, elements.BLOCK).any(axis=1)

    def _set_masses(self) -> None:
        """Masses of the corners that the motion sees, and the time step. Collective."""
        self.masses.set()
        dt = self.sim.clock.dt
        self.nodes.set_masses(self.masses.of_motion, dt)
        self._set_kicks(dt)
        self.masses.forget()

    def _set_kicks(self, dt: float) -> None:
        """Set the acceleration factors of corners that are nodes by themselves."""
        triangles = self.triangle_rows[: self.count]
        alone = ~self.nodes.special[triangles - self.sim.n_left][:, :3]
        with np.errstate(divide="ignore"):
            self.c[: self.count, elements.KICK : elements.KICK + 3] = np.where(
                alone, dt / self.masses.of_motion[triangles, :3], 0.0
            )

    # ---- calls ---------------------------------------------------------------------------------------------------

    def _bind(self) -> None:
        """Kernels for this number of threads, and their argument lists."""
        sim, pairs, o = self.sim, self.pairs, self.sim.options
        self.of_joints = np.zeros((len(sim.number) if sim.budget is not None else 1, elements.FORCE))
        small = not o.large_strain
        (s0, quad_s0), laws, stressed = (of.flat() for of in self.solids.blocks), self.laws, self.solids.stressed
        self._triangle_args = (
            sim.threads, self.count, self.triangle_rows, sim.wide, sim.x, sim.v, self.c, s0,
            stressed or laws.before(0), small, self.slot_link, self.slot_law,
            self.slot_kind, self.slot_state, self.slot_history, self.head, self.follow,
            self.joint_table, self.joint_beyond, pairs.block_begin, pairs.lane, pairs.slot, pairs.pushed,
        )  # fmt: skip
        self._quad_args = (
            sim.threads, len(self.quad_rows), self.quad_rows, sim.x, sim.v, self.q, quad_s0,
            stressed or laws.before(1), small, self.slots_of_triangles,
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
            self._in_step(sim.budget is not None)
        if sim.options.dynamic:
            sim.creep.passed = 0.0
        if self.moves_nodes:
            with timers("node"):
                self.move_nodes()

    def _in_step(self, keep: bool) -> None:
        """The forces of a step; those on corners that move by themselves are not stored."""
        self._elements(self.triangle_special, self.block_special, self.force, self.of_joints, keep)

    def _elements(
        self, special: np.ndarray, block_special: np.ndarray, force: np.ndarray, of_joints: np.ndarray, keep: bool
    ) -> None:
        sim, o = self.sim, self.sim.options
        alpha, step = 0.0 if o.dynamic else ALPHA, sim.clock.step
        self.solids.move_on(every=False)
        what = (keep, o.gx, o.gy, o.mass_damping, o.stiffness_damping)
        args: tuple[Any, ...] = *self._triangle_args, special, block_special, force, of_joints, *what, alpha, step
        self.laws.forces(0, elements.triangles.on(sim.threads), *args, self.tally)
        if self.whole is not None:
            self.whole.add_forces(sim.v, 1.0, force)
        if not len(self.quad_rows):
            return
        args = *self._quad_args, force, of_joints, *what, step, self.tally
        if self.yielding.on:
            of, yielding = self.solids.blocks[1], self.yielding
            plastic_quads.yielding(
                args[0], yielding.strength, *args[1:], sim.n_left, of.flat(of.initial), of.law, sim.cold["plastic"],
                yielding.table,
            )  # fmt: skip
        else:
            self.laws.forces(1, elements.quads.on(sim.threads), *args)

    def open_joints(self) -> None:
        """Joints remember the present positions: those beyond their peak pass it, or break. Elements do not flow."""
        scratch, of_joints = (np.zeros((len(self.sim.number), self.force_width)) for _ in range(2))
        self.pairs.pushed[:] = 0.0
        v = self.sim.v.copy()  # triangles kick their corners
        with self.yielding.off():
            self._fill(scratch, of_joints, True)
        self.sim.v[:] = v

    def move_nodes(self) -> None:
        """New velocities of the nodes from the forces on their corners. Collective."""
        self.nodes.move(self.at_corners, self.loads)

    # ---- looking ---------------------------------------------------------------------------------------------------

    def evaluation(self, contact: bool = True) -> Evaluation:
        """Forces at the present positions; everything is put back as it was. contact: with those of contact.
        Collective."""
        sim, pairs, total = self.sim, self.pairs, len(self.sim.number)
        changed = sim.v, self.outside, self.felt, *pairs.changed_by_forces(), *self.solids.changing()
        kept = [(table, table.copy()) for table in changed]
        with self.joints_kept():
            stored = self.at_corners, self.force
            (self.at_corners, self.force), of_joints = self.nodes.table(), np.zeros((total, self.force_width))
            if not contact:
                pairs.pushed[:] = 0.0
            elif len(pairs):
                pairs.forces(sim.x, sim.v, sim.clock.dt)
            self._fill(self.force, of_joints, True)
            self.move_nodes()
            found = Evaluation(
                self.force, self.at_corners, of_joints, pairs.pushed.copy(), pairs.touching.copy(), pairs.out.copy(),
                self.outside.copy(), self.felt.copy(), sim.v.copy(),
            )  # fmt: skip
            self.at_corners, self.force = stored
        for table, values in kept:
            table[...] = values
        return found

    def _fill(self, force: np.ndarray, of_joints: np.ndarray, keep: bool) -> None:
        """Compute all forces in the rows of all corners."""
        self._elements(np.ones(self.count, bool), np.ones(len(self.head), bool), force, of_joints, keep)

    @cached_property
    def leads(self) -> np.ndarray:
        """(np,) lowest corner (element * 4 + k) of elements that are there at each point of the mesh, -1: none."""
        sim, mesh = self.sim, self.sim.the_mesh()
        corner = np.arange(mesh.cells.size).reshape(mesh.cells.shape)
        use = (mesh.cells >= 0) & sim.alive[:, None]
        out = np.full(len(mesh.points), -1, np.int64)
        out[mesh.cells[use][::-1]] = corner[use][::-1]
        return out

    def stresses(
        self, at: np.ndarray | None = None, energies: bool = True, flow: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n_own, 4) xx, yy, xy, zz [Pa] and, unless they are not wanted, elastic energies (n_own,) [J/m] of the
        owned elements, or of some of them (at: the how-manieth). flow: after the flow of this moment, which the next
        forces will see; without it, which looks at all elements, after that of the last step."""
        sim = self.sim
        of_blocks, plastic, crept = self.solids.remembered(flow)
        s0, quad_s0 = (of.flat(one) for of, one in zip(self.solids.blocks, of_blocks))
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
        if energies and (plastic is not None or crept is not None):
            more = self.solids.remembered_energy(plastic, crept)
            energy += more if at is None else more[at]
        if self.whole is not None:
            self.whole.put_stresses(at, stress, energy)
        for more in self.solids.other_energies() if energies else ():
            energy += more if at is None else more[at]
        return stress, energy

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
            self.nodes.begin, self.nodes.place, felt, outside, before, after, a, b, dt, sim.n_left, sim.n_own,
            sim.v.shape[1], work,
        )  # fmt: skip

    def kinetic(self, before: np.ndarray, after: np.ndarray, out: np.ndarray) -> None:
        """Kinetic energy of the owned elements into out (n_own,), of velocities before and after the kick."""
        sim = self.sim
        energy.kinetic(
            sim.n_left, sim.n_own, sim.the_mesh().cells, sim.number, before, after, self.masses.of_motion, out
        )

    # ---- what is extracted from the tables ---------------------------------------------------------------------------

    def release(self) -> None:
        """Free all tables, unless they are awaited. They refer to each other: Python would only free them later."""
        if not self.awaited:
            vars(self).clear()

    def histories(self, transfer: bool) -> Histories:
        """Histories of joints and contacts of the owned elements.

        transfer: omit broken joints; their friction is transferred to the contacts that replace them.
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
        along = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
        shear = np.where(sigma < 0.0, tau * np.hypot(along[:, 0], along[:, 1]), 0.0)
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
