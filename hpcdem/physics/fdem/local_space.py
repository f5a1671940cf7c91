"""The tables of the kernels for the tetrahedra that a rank holds: `Local` of a model in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.memory import sparse_zeros
from hpcdem.physics.fdem import user_laws
from hpcdem.physics.fdem.conditions import TRACTIONS
from hpcdem.physics.fdem.elements import tangent
from hpcdem.physics.fdem.hexes import Hexes, place_masses
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS
from hpcdem.physics.fdem.joints_hexes import HexJoints
from hpcdem.physics.fdem.kernels import elements, energy_space, joint_law, joints_space, space, tets
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN, NONE
from hpcdem.physics.fdem.laws_space import LawsSpace
from hpcdem.physics.fdem.local import ALPHA, element_table, laws_of
from hpcdem.physics.fdem.pairs import Surfaces
from hpcdem.physics.fdem.pairs_space import ContactSpace, ShapesSpace, face_areas
from hpcdem.physics.fdem.tetrahedra import FACES
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.node_conditions import NodeCondition
    from hpcdem.physics.fdem.state import State


class LocalSpace(LawsSpace):
    """See `Local`; count, rows: tetrahedra and their storage rows, with three more at the end."""

    dim, force_width, stride, listed, lists = 3, tets.ROW, tets.STRIDE, 4 * tets.BLOCK, 4

    def __init__(self, sim: State) -> None:
        self.sim = sim
        self.count = sim.n_own
        rows = np.arange(sim.n_left, sim.n_left + sim.n_own)
        self.rows = np.concatenate([rows, np.repeat(rows[-1:], 3)]).astype(np.int32)
        self.tally = np.zeros((sim.threads, elements.TALLY), np.int64)
        self.passes = 0
        self._mass = np.empty((0, 4))
        self._make_constants()
        self._make_memories()
        self._make_joints()
        self._put_histories()
        self.pairs: Any = self._contact(*ContactSpace.remembered(sim))
        self._make_loads()
        self._make_nodes()
        self._set_masses()
        self._bind()

    def _contact(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> Any:
        return ContactSpace(self.sim, low, high, values)

    @property
    def true_mass(self) -> np.ndarray:
        """Made when they are asked for: steps have no need of them."""
        if self.true_masses() and len(self._mass):
            return self._mass
        mass = self.corner_masses(self.sim, self.sim.number)
        return mass

    @property
    def mass(self) -> np.ndarray:
        return self._mass if len(self._mass) else self.true_mass

    @staticmethod
    def corner_masses(sim: State, number: np.ndarray) -> np.ndarray:
        mass = _quarters(sim, number)
        if len(sim.the_mesh().hexes):
            place_masses(sim, number, mass)
        return mass

    def _set_masses(self) -> None:
        super()._set_masses()
        if self.true_masses() and self.sim.budget is None:  # which needs them in each step
            self._mass = np.empty((0, 4))

    def _make_constants(self) -> None:
        sim, mesh = self.sim, self.sim.reference
        models = element_table(sim)
        self.c = np.zeros((self.count + 3, tets.TET))
        space.constants(
            sim.number, mesh.points, mesh.cells, sim.element_row, models, sim.options.dynamic, self.rows[: self.count],
            _quarters(sim, sim.number), self.c,
        )  # fmt: skip
        self.hexes: Hexes | None = None
        if len(mesh.hexes):
            sim.prepare_kernels("hexes")
            self.hexes = Hexes(sim, self.true_mass)
        self.c[self.count :] = self.c[self.count - 1] if self.count else 1.0
        self.s0 = sparse_zeros((self.count + 3, tets.STRESSES))
        self._stress = sparse_zeros((self.count, 6))
        if sim.stress0 is not None:
            self._stress = sim.initial_stresses(sim.number[sim.owned])
        self._make_warm()

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
        """Those on sides of hexahedra are left out."""
        if self.sides is None:
            return self.slot_state
        out = self.slot_state.copy()
        out[self.sides.slot] = NONE
        return out

    def _make_loads(self) -> None:
        sim, mesh, own = self.sim, self.sim.the_mesh(), self.sim.owned
        faces = 4 * sim.number[own][:, None] + np.arange(4)
        i, k = np.nonzero(sim.load_row[faces] > 0)
        corner = mesh.face_corners(faces[i, k]) % 4
        self.special = np.zeros((sim.n_own, 4), bool)
        self.special[i[:, None], corner] = True
        self.load_corner = tets.ROW * (i + own.start)[:, None] + tets.STRIDE * corner
        places = mesh.points[mesh.face_points(faces[i, k])].mean(axis=1)
        self.load_functions = Placed(sim.loads, sim.load_row[faces[i, k]].astype(np.int64), places)
        self.load_of, self.load_share = self.load_functions.of, np.ones(len(i))
        quiet = self._acting(np.flatnonzero(sim.quiet_faces()[faces[i, k]]))
        self.quiet_corner, self.quiet_of = self.load_corner[quiet], self.load_of[quiet]
        self.quiet_p, self.quiet_s = self._impedances(sim.number[own][i[quiet]])
        if self.hexes is not None:
            self._share_loads(i)
        dies_down = self._make_relaxations()
        sim.surface_loads.corners(sim, self.special)
        self.some_applied = bool(sim.surface_loads) or sim.comm.any(len(i) > 0 or dies_down)

    def _share_loads(self, element: np.ndarray) -> None:
        """A side of a hexahedron is two triangles, and a load on it that of both ways to cut it, half each. element
        (m,): of the loaded faces, the how-manieth."""
        assert self.hexes is not None
        of, corners = self.hexes.other_cuts(self.load_corner, element)
        self.load_share[of] = 0.5
        i, k = np.divmod(corners - tets.ROW * self.sim.n_left, tets.ROW)
        self.special[i, k // tets.STRIDE] = True
        self.load_corner = np.concatenate([self.load_corner, corners])
        self.load_of = np.concatenate([self.load_of, self.load_of[of]])
        self.load_share = np.concatenate([self.load_share, np.full(len(of), 0.5)])

    def _mark_special(self) -> None:
        """All forces are stored. Of hexahedra only one corner at each of their points has some."""
        self.pulled = None
        if self.hexes is not None:
            some = self.true_mass.reshape(-1)[self.node_corner // tets.STRIDE] > 0.0
            before = np.concatenate([[0], np.cumsum(some)])
            self.pulled = before[self.node_begin], self.node_corner[some]
        if len(self.force) < len(self.sim.number):
            self.force = np.zeros((len(self.sim.number), self.force_width))

    def _place_nodes(self, mass: np.ndarray) -> int:
        """Only the corners of nodes are kept."""
        self.node_corner, self.node_place, self.node_again = (
            np.empty(len(self.node_corner), np.int64) for _ in range(3)
        )
        lost = super()._place_nodes(mass)
        self.node_corner = self.node_corner.astype(np.int32)
        self.node_place = self.node_again = np.empty(0, np.int64)
        return lost

    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n_own, 4) [N/m] and dashpots (n_own, 4) [N s/m] at each corner, as in the plane: of its joints,
        k = P sqrt(A) / 3 with the largest P, and what the contact of its free faces can have, k = P A (1 / h + 1 /
        h_other) / 3 per face, h_other: the smallest of all; rho c_p A / 3 of quiet faces."""
        sim, own = self.sim, self.sim.owned
        springs, dashpots = np.zeros((sim.n_own, 4)), np.zeros((sim.n_own, 4))
        faces = (4 * sim.number[own][:, None] + np.arange(4)).reshape(-1)
        quiet = sim.quiet_faces()[faces].reshape(-1, 4)
        if quiet.any():
            impedance = self._impedances(sim.number[own])[0][:, None] / 3.0
            each = np.where(quiet, impedance * face_areas(sim.reference, sim.number[own]), 0.0)
            for k in range(4):
                dashpots[:, FACES[k]] += each[:, k, None]
        size = self.slot_size[: self.slots]
        penalty = joint_law.stiffest(
            sim.joint_rows.column, laws_of(sim.joint_rows), sim.joint_row[faces],
            lambda: np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0),
        )  # fmt: skip
        tied = sim.closed_faces()[faces] & (sim.joint_row[faces] > 0)
        each = np.zeros(len(faces))
        each[tied] = penalty[tied] / size[tied] / 3.0
        each = np.repeat(each.reshape(-1, 4, 1), 3, axis=2)
        if self.sides is not None:
            each.reshape(-1, 3)[self.sides.slot[self.sides.quad]] *= self.sides.shares()
        if not sim.options.collision:
            for k in range(4):
                springs[:, FACES[k]] += each[:, k]
            sim.surface_loads.springs(sim, springs)
            sim.surface_loads.dashpots(sim, dashpots)
            return springs, dashpots
        shapes = ShapesSpace(sim, sim.number[own])
        length = shapes.double_area
        surfaces = Surfaces(sim, shapes, faces, np.repeat(np.arange(sim.n_own), 4))
        silent = np.isnan(surfaces.overlay) | ~np.isnan(surfaces.normal)
        ratio = surfaces.ratio.max(initial=0.0)
        found = np.array([float(np.max(1.0 / length, initial=0.0)), float(silent.any()), ratio])
        highest, some, ratio = sim.comm.max_into(found).tolist()
        most = surfaces.slope * surfaces.most_penalty(some == 0.0).reshape(-1, 4)
        contact = most * shapes.area / 3.0 * (1.0 / length[:, None] + highest)
        may_touch = ~sim.closed_faces()[faces]
        if sim.options.dynamic:
            may_touch |= tied  # once they break
        contact = np.where(may_touch.reshape(-1, 4), contact, 0.0)
        # A third of 2 xi sqrt(k m) A, with k A = 3 `contact` and m A no more than three corners of the element have.
        drag = 2.0 * ratio * np.sqrt(contact * self.true_mass[own].max(axis=1, initial=0.0)[:, None])
        for k in range(4):
            springs[:, FACES[k]] += np.maximum(each[:, k], contact[:, k, None])
            dashpots[:, FACES[k]] += drag[:, k, None]
        sim.surface_loads.springs(sim, springs)
        sim.surface_loads.dashpots(sim, dashpots)
        return springs, dashpots

    def _stable_time_step(self, target: float, mass: np.ndarray) -> float:
        o = self.sim.options
        springs = self.springs()
        rows, c = self._tetrahedra()
        found = space.time_step(
            c, rows, self.sim.n_left, *springs, o.mass_damping, o.stiffness_damping, self.sim.safety(), target, mass
        )
        return found if self.hexes is None else min(found, self.hexes.time_step(*springs, target, mass))

    def _tetrahedra(self) -> tuple[np.ndarray, np.ndarray]:
        """Storage rows and constants, with the largest moduli, of the elements that are no parts of hexahedra."""
        rows = self.rows[: self.count]
        if self.hexes is None:
            return rows, self.stiff
        alone = np.ones(self.count, bool)
        alone[self.hexes.rows - self.sim.n_left] = False
        return rows[alone], self.stiff[: self.count][alone]

    def _make_static_masses(self, mass: np.ndarray) -> None:
        springs = self.springs()[0]
        rows, c = self._tetrahedra()
        space.static_masses(c, rows, self.sim.n_left, springs, ALPHA, mass)
        if self.hexes is not None:
            of = self.solids[1]
            k = np.empty((of.count, 24, 24))
            tangent.elastic(of.tables._replace(c=self.stiff_hexes), of.alone, of.s0[:0], True, k)
            self.hexes.static_masses(k, springs, ALPHA, mass)

    def _set_kicks(self, dt: float) -> None:
        mass = self.mass[self.sim.owned]
        self.kick = np.divide(dt, mass, out=np.zeros(mass.shape), where=self.alone())
        self.some_alone = bool(self.alone().any())

    def _bind(self) -> None:
        one = self.sim.threads == 1
        self._forces: Any = tets.forces if one else tets.forces_threaded
        self._kick: Any = space.kick if one else space.kick_threaded
        self._move: Any = space.move if one else space.move_threaded
        self.of_joints = np.zeros((len(self.sim.number) if self.sim.budget is not None else 1, tets.ROW))

    def forces(self) -> None:
        """Forces at the present positions, and the velocities that follow from them. Collective."""
        sim, timers = self.sim, self.sim.timers
        self.passes += 1
        if len(self.pairs):
            with timers("contact"):
                self.pairs.forces(sim.x, sim.v, sim.clock.dt)
        with timers("force"):
            self._fill(self.force, self.of_joints, sim.budget is not None)
        if sim.options.dynamic:
            sim.creep.passed = 0.0
        with timers("node"):
            self.move_nodes()

    def _fill(self, force: np.ndarray, of_joints: np.ndarray, keep: bool) -> None:
        o = self.sim.options
        self.obey()
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
        stressed = sim.stress0 is not None or self.plastic or self.creeps or self.heated or self.lawful
        hexes = self.hexes
        some = 0 if hexes is not None and 6 * hexes.count == self.count else self.count
        self._forces(
            sim.threads, some, self.rows, sim.x, v, self.c, self.s0, stressed, not o.large_strain, force,
            *gravity, o.mass_damping, o.stiffness_damping, joints and self.jointed, self.slot_size, self.slot_link,
            self.slot_law, self.slot_kind, self.slot_state, self.slot_history, self.head, self.follow,
            self.joint_table, self.joint_beyond, keep, of_joints, sim.clock.step, self.tally,
        )  # fmt: skip
        if hexes is not None:
            if some:
                force[hexes.rows.reshape(-1)] = 0.0  # the forces of their tetrahedra
            hexes.forces(force, v, gravity, self.quad_s0)
            if self.sides is not None and joints:
                if keep:
                    of_joints[hexes.rows.reshape(-1)] = 0.0
                self.sides.forces(force, v, keep, of_joints)

    def move_nodes(self) -> None:
        """New velocities of the nodes from the forces on their corners. Collective."""
        sim, clock = self.sim, self.sim.clock
        alpha = 0.0 if sim.options.dynamic else ALPHA
        if self.some_alone:
            self._kick(sim.threads, sim.n_left, self.kick, self.force, sim.v, alpha)
        if not (self.some_special or self.shared):
            return
        if self.some_applied:
            self.applied[:] = 0.0
            loads = self.loads_now(self.load_functions, sim.time_now())
            space.tractions(self.load_corner, self.load_of, self.load_share, loads, sim.x, self.applied)
            if len(self.quiet_corner):
                space.dashpots(
                    self.quiet_corner, self.quiet_p, self.quiet_s, self.quiet_of, loads, sim.x, sim.v, self.applied
                )
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
        pulled = (self.node_begin, self.node_corner) if self.pulled is None else self.pulled
        self._move(
            sim.threads, self.node_begin, self.node_corner, *pulled, self.node_kick, self.node_condition,
            self.node_share, table, self.some_applied, self.force, self.applied, sim.v, alpha, self.outside, self.felt,
        )  # fmt: skip

    def loads_now(self, placed: Placed, time: float) -> np.ndarray:
        """The table of tractions (rows, 10)."""
        return placed.filled(self.sim.loads_at(time), lambda one, field: (TRACTIONS[3].index(field), time, 1.0))

    def conditions_now(self, placed: Placed, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of node conditions (rows, 14)."""

        def how(one: NodeCondition, field: str) -> tuple[int, float, float]:
            kind, _, axis = field.partition("_")
            k = "xyz".index(axis)
            if kind == "force":
                return space.FORCE + k, time, getattr(one, f"part_{axis}")
            velocity = getattr(one, f"does_{axis}") == moving.VELOCITY
            return (space.AT + k, middle, 1.0) if velocity else (space.AT + k, time, dt)

        return placed.filled(self.sim.conditions_at(time, middle, dt), how)

    def stresses(
        self, at: np.ndarray | None = None, energies: bool = True, flow: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n_own, 6) [Pa] and, unless they are not wanted, elastic energies (n_own,) [J] of the owned elements,
        or of some of them (at: the how-manieth)."""
        sim = self.sim
        s0, quad_s0, plastic, crept = self.remembered(flow)
        at = np.arange(sim.n_own) if at is None else at
        n = len(at)
        stress, energy = np.zeros((n, 6)), np.zeros(n if energies else 0)
        small = not sim.options.large_strain
        x = sim.x[at + sim.n_left]
        tets.stresses(x, np.arange(n, dtype=np.int32), self.c[at], s0[at], small, 0, stress, energy)
        if self.hexes is not None:
            self.hexes.spread(stress, energy, at, quad_s0)
        if energies:
            energy += self.remembered_energy(plastic, crept)[at]
        if energies and self.heated:
            energy += self._energy_of_heat()[at]
        if energies and self.lawful:  # what such a law stores is not known
            energy[user_laws.numbers(sim)[sim.number[at + sim.n_left]] > 0] = np.nan
        return stress, energy

    def _energy_of_heat(self) -> np.ndarray:
        """As in the plane; the volume of a hexahedron is the mean of its overlays."""
        energy = super()._energy_of_heat()
        if (own := self.hexes) is not None:
            energy[own.rows - self.sim.n_left] *= own.volumes_over_parts()[:, None]
        return energy

    def book(
        self, before: np.ndarray, after: np.ndarray, a: float, b: float, of_joints: np.ndarray, pushed: np.ndarray,
        felt: np.ndarray, outside: np.ndarray, work: np.ndarray,
    ) -> None:  # fmt: skip
        """As in the plane. Forces of elements are linear in the velocities: damping is what they are more than at
        rest."""
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
            self.node_begin, self.node_corner, felt, outside, before, after, a, b, dt, sim.n_left, sim.n_own, work
        )

    def kinetic(self, before: np.ndarray, after: np.ndarray, out: np.ndarray) -> None:
        """As in the plane."""
        energy_space.kinetic(self.sim.n_left, self.sim.n_own, before, after, self.mass, out)

    def handed_over(self) -> tuple[np.ndarray, np.ndarray]:
        """As in the plane: the shear force on this side, half to each of the two faces."""
        slots = np.flatnonzero(self.slot_state == BROKEN)
        found = self._joints_now(slots)
        slots, shear = slots[found[:, 2] < 0.0], found[found[:, 2] < 0.0, joints_space.SHEAR :]
        mine, other = self.slot_face[slots], self.sim.partner[self.slot_face[slots]]
        rows = np.zeros((2, len(slots), WORDS))
        rows.view(np.int64)[0, :, KEY] = 8 * (other // 4) + mine % 4
        rows.view(np.int64)[1, :, KEY] = 8 * (other // 4) + 4 + other % 4
        rows[0, :, FIRST : FIRST + 3], rows[1, :, FIRST : FIRST + 3] = 0.5 * shear, -0.5 * shear
        return np.tile(self.slot_element(slots), 2), rows.reshape(-1, WORDS)


def _quarters(sim: State, number: np.ndarray) -> np.ndarray:
    """Of the mass of each of these tetrahedra (n, 4) [kg], also where six of them store a hexahedron."""
    mesh, mass = sim.reference, np.zeros((len(number), 4))
    space.masses(number, mesh.points, mesh.cells, sim.element_row, element_table(sim), mass)
    return mass
