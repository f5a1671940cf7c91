"""The tables of the kernels for the tetrahedra that a rank holds: `Local` of a model in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.memory import sparse_zeros
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, TETRAHEDRON
from hpcdem.physics.fdem.hexahedra import PARTS
from hpcdem.physics.fdem.hexes import Hexes
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS
from hpcdem.physics.fdem.joints_hexes import HexJoints
from hpcdem.physics.fdem.kernels import elements, energy_space, hexes, joints_space, space, tets
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN, NONE
from hpcdem.physics.fdem.loads import LoadsSpace
from hpcdem.physics.fdem.local import Local
from hpcdem.physics.fdem.masses import MassesSpace, quarters
from hpcdem.physics.fdem.moduli import element_table
from hpcdem.physics.fdem.node_set import ALPHA, NodeSetSpace
from hpcdem.physics.fdem.pairs_space import ContactSpace

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


class LocalSpace(Local):
    """See `Local`; count, rows: tetrahedra and their storage rows, with three more at the end."""

    corner_masses = staticmethod(MassesSpace.of_corners)
    dim, force_width, stride, listed, lists = 3, tets.ROW, tets.STRIDE, 4 * tets.BLOCK, 4

    def __init__(self, sim: State) -> None:
        self.sim = sim
        self.count = sim.n_own
        rows = np.arange(sim.n_left, sim.n_left + sim.n_own)
        self.rows = np.concatenate([rows, np.repeat(rows[-1:], 3)]).astype(np.int32)
        self.tally = np.zeros((sim.threads, elements.TALLY), np.int64)
        self.passes = 0
        self._make_solids()
        self._make_joints()
        self._put_histories()
        self.pairs: Any = self._contact(*ContactSpace.remembered(sim))
        self._make_nodes()
        self._set_masses()
        self._bind()

    def _contact(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> Any:
        return ContactSpace(self.sim, low, high, values)

    def _make_solids(self) -> None:
        sim, mesh, count = self.sim, self.sim.reference, self.count
        models, self.masses = element_table(sim), MassesSpace(self)
        self.c = np.zeros((count + 3, tets.TET))
        space.constants(
            sim.number, mesh.points, mesh.cells, sim.element_row, models, sim.options.dynamic, self.rows[:count],
            quarters(sim, sim.number), self.c,
        )  # fmt: skip
        self.hexes: Hexes | None = None
        if len(mesh.hexes):
            sim.prepare_kernels("hexes")
            self.hexes = Hexes(sim, self.true_mass)
        self.c[count:] = self.c[count - 1] if count else 1.0
        own, every = self.hexes, np.arange(count)[:, None]
        s0 = sparse_zeros((count + 3, tets.STRESSES))
        tetrahedra = ElementBlock(sim, TETRAHEDRON, self.rows, self.c, s0, every, np.ones(every.shape))
        nobody = np.empty((0, PARTS), np.int64)
        hexahedra = ElementBlock(
            sim, HEXAHEDRON, nobody[:, 0], np.empty((0, hexes.HEX)), np.zeros((0, hexes.PARTS, tets.STRESSES)), nobody,
            np.empty(nobody.shape),
        )  # fmt: skip
        if own is not None:
            stored, many = own.rows - sim.n_left, own.count + 3 if own.remember else 0
            hexahedra = ElementBlock(
                sim, HEXAHEDRON, own.rows[:, 0], own.h, np.zeros((many, hexes.PARTS, tets.STRESSES)), stored,
                own.part_of_volume(), own.place, own.parts,
            )  # fmt: skip
            hexahedra.over_parts = own.volumes_over_parts
            alone = np.ones(count, bool)
            alone[stored] = False
            tetrahedra.alone = np.flatnonzero(alone)
        self._hold([tetrahedra, hexahedra])
        if own is not None and hexahedra.stiffer is not None:
            own.stiffen(hexahedra.stiffer)

    def _make_joints(self) -> None:
        """Slots of the faces, four per tetrahedron."""
        sim, mesh = self.sim, self.sim.the_mesh()
        self.slots = self.in_lists = 4 * self.count
        padded = self.slots + 12  # lanes are filled four tetrahedra at a time
        self.slot_face, self.slot_link = sparse_zeros(padded, np.int32), sparse_zeros((padded, 3), np.int32)
        some = bool((sim.joint_row > 0).any())
        self.slot_size, self.slot_state = sparse_zeros(padded), sparse_zeros(padded, np.uint8)
        self.slot_law, self.slot_kind, self.follow = (sparse_zeros(padded, np.int32) for _ in range(3))
        if some:
            self.slot_size[self.slots :], self.follow[:] = 1.0, -1
        self.head = np.full(4 * -(-self.count // tets.BLOCK), -1, np.int32)
        self.slot_history = sparse_zeros((padded, HISTORY))
        lost = -1
        if some:
            lost = joints_space.links(
                sim.number, self.rows[: self.count], mesh.points, mesh.cells, sim.where, sim.partner,
                sim.closed_faces(), sim.joint_row, self.slot_face, self.slot_link, self.slot_size, self.slot_law,
                self.slot_kind, self.slot_state,
            )  # fmt: skip
        self.sides: HexJoints | None = None
        if self.hexes is not None and some:
            sim.prepare_kernels("joints-hexes")
            self.sides = HexJoints(self)
            lost = max(int(lost), self.sides.lost)
        self._agree_on_lost(int(lost), "the joint of face")
        self.jointed = bool(self._in_loops().any())
        self._make_joint_laws()
        if self.sides is not None:
            self.slot_law[self.sides.slot] = 0

    def _in_loops(self) -> np.ndarray:
        """Return the states of slots, with NONE for slots on sides of hexahedra."""
        if self.sides is None:
            return self.slot_state
        out = self.slot_state.copy()
        out[self.sides.slot] = NONE
        return out

    def _make_nodes(self) -> None:
        """Make the set of nodes; all forces are stored. For hexahedra only one corner at each of their points has
        forces."""
        sim = self.sim
        self.loads = LoadsSpace(sim, self.force_width, self.stride, self.hexes)
        self.nodes = nodes = NodeSetSpace(sim, self.loads.special, self.force_width, self.stride)
        self.outside, self.felt = nodes.outside, nodes.felt
        self._agree_on_lost(nodes.find_corners(), "the node of corner")
        if self.hexes is not None:
            nodes.pull(self.true_mass)
        self.moves_nodes = True
        self.at_corners, self.force = self.nodes.tables(self.loads, True)

    def _set_kicks(self, dt: float) -> None:
        mass, alone = self.masses.of_motion[self.sim.owned], self.nodes.alone
        self.kick = np.divide(dt, mass, out=np.zeros(mass.shape), where=alone)
        self.some_alone = bool(alone.any())

    def _bind(self) -> None:
        self.of_joints = np.zeros((len(self.sim.number) if self.sim.budget is not None else 1, tets.ROW))

    def _in_step(self, keep: bool) -> None:
        self._fill(self.force, self.of_joints, keep)

    def _fill(self, force: np.ndarray, of_joints: np.ndarray, keep: bool) -> None:
        o = self.sim.options
        self.solids.move_on(every=True)
        self._element_forces(force, self.sim.v, (o.gx, o.gy, o.gz), True, of_joints, keep)
        if self.hexes is None:
            self.pairs.add_to(force)
        else:
            self.hexes.add_contact(self.pairs, force)

    def _element_forces(
        self, force: np.ndarray, v: np.ndarray, gravity: tuple[float, float, float], joints: bool,
        of_joints: np.ndarray, keep: bool,
    ) -> None:  # fmt: skip
        """Forces of elements and, if they are wanted, of their joints with the velocities v (n, 16)."""
        sim, o = self.sim, self.sim.options
        (tetrahedra, hexahedra), hexes = self.solids.blocks, self.hexes
        stressed = self.solids.stressed or self.laws.some
        some = 0 if hexes is not None and 6 * hexes.count == self.count else self.count
        tets.forces.on(sim.threads)(
            sim.threads, some, self.rows, sim.x, v, self.c, tetrahedra.flat(), stressed, not o.large_strain, force,
            *gravity, o.mass_damping, o.stiffness_damping, joints and self.jointed, self.slot_size, self.slot_link,
            self.slot_law, self.slot_kind, self.slot_state, self.slot_history, self.head, self.follow,
            self.joint_table, self.joint_beyond, keep, of_joints, sim.clock.step, self.tally,
        )  # fmt: skip
        if hexes is not None:
            if some:
                force[hexes.rows.reshape(-1)] = 0.0  # the forces of their tetrahedra
            hexes.forces(force, v, gravity, hexahedra.s0)
            if self.sides is not None and joints:
                if keep:
                    of_joints[hexes.rows.reshape(-1)] = 0.0
                self.sides.forces(force, v, keep, of_joints)

    def move_nodes(self) -> None:
        """New velocities from the forces on corners. Collective."""
        sim = self.sim
        if self.some_alone:
            alpha = 0.0 if sim.options.dynamic else ALPHA
            space.kick.on(sim.threads)(sim.threads, sim.n_left, self.kick, self.force, sim.v, alpha)
        self.nodes.move(self.at_corners, self.loads)

    def stresses(
        self, at: np.ndarray | None = None, energies: bool = True, flow: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n_own, 6) [Pa] and, unless they are not wanted, elastic energies (n_own,) [J] of the owned elements,
        or of some of them (at: the how-manieth)."""
        sim = self.sim
        (s0, of_hexes), plastic, crept = self.solids.remembered(flow)
        at = np.arange(sim.n_own) if at is None else at
        n = len(at)
        stress, energy = np.zeros((n, 6)), np.zeros(n if energies else 0)
        small = not sim.options.large_strain
        x = sim.x[at + sim.n_left]
        tets.stresses(x, np.arange(n, dtype=np.int32), self.c[at], s0[at, 0], small, 0, stress, energy)
        if self.hexes is not None:
            self.hexes.spread(stress, energy, at, of_hexes)
        if energies:
            for more in (self.solids.remembered_energy(plastic, crept), *self.solids.other_energies()):
                energy += more[at]
        return stress, energy

    def book(
        self, before: np.ndarray, after: np.ndarray, a: float, b: float, of_joints: np.ndarray, pushed: np.ndarray,
        felt: np.ndarray, outside: np.ndarray, work: np.ndarray,
    ) -> None:  # fmt: skip
        """Book damping, dissipation and work of a step as in the plane. Forces of elements are linear in the
        velocities: the damping force is their difference from the forces at rest."""
        sim, o, pairs, dt = self.sim, self.sim.options, self.pairs, self.sim.clock.dt
        damping, at_rest = (np.zeros((len(sim.number), tets.ROW)) for _ in range(2))
        for force, v in ((damping, before), (at_rest, np.zeros_like(before))):
            self._element_forces(force, v, (0.0, 0.0, 0.0), False, self.of_joints, False)
        damping -= at_rest
        energy_space.book(
            sim.n_left, sim.n_own, before, after, a, b, of_joints, damping, self.true_mass, o.gx, o.gy, o.gz, dt, work
        )
        energy_space.book_contact(pairs.rows, sim.n_left, pushed, before, after, a, b, dt, work)
        energy_space.book_nodes(
            self.nodes.begin, self.nodes.corner, felt, outside, before, after, a, b, dt, sim.n_left, sim.n_own, work
        )

    def kinetic(self, before: np.ndarray, after: np.ndarray, out: np.ndarray) -> None:
        """Sum the kinetic energy as in the plane."""
        energy_space.kinetic(self.sim.n_left, self.sim.n_own, before, after, self.masses.of_motion, out)

    def handed_over(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the shear forces handed over by broken joints as in the plane: the force on this side, half to each of
        the two faces."""
        slots = np.flatnonzero(self.slot_state == BROKEN)
        found = self._joints_now(slots)
        slots, shear = slots[found[:, 2] < 0.0], found[found[:, 2] < 0.0, joints_space.SHEAR :]
        mine, other = self.slot_face[slots], self.sim.partner[self.slot_face[slots]]
        rows = np.zeros((2, len(slots), WORDS))
        rows.view(np.int64)[0, :, KEY] = 8 * (other // 4) + mine % 4
        rows.view(np.int64)[1, :, KEY] = 8 * (other // 4) + 4 + other % 4
        rows[0, :, FIRST : FIRST + 3], rows[1, :, FIRST : FIRST + 3] = 0.5 * shear, -0.5 * shear
        return np.tile(self.slot_element(slots), 2), rows.reshape(-1, WORDS)
