"""The tables of the kernels for the tetrahedra that a rank holds: `Local` of a model in space."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.physics.fdem.definition import TRACTIONS
from hpcdem.physics.fdem.histories import WORDS, Histories
from hpcdem.physics.fdem.kernels import elements, space, tets
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels.joints import HISTORY
from hpcdem.physics.fdem.laws_space import LawsSpace
from hpcdem.physics.fdem.local import ALPHA, Evaluation, element_table
from hpcdem.physics.fdem.pairs import Surfaces
from hpcdem.physics.fdem.pairs_space import ContactSpace, ShapesSpace
from hpcdem.physics.fdem.tetrahedra import FACES
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.definition import NodeCondition
    from hpcdem.physics.fdem.state import State


class LocalSpace(LawsSpace):
    """See `Local`; count, rows: tetrahedra and their storage rows, with three more at the end."""

    dim, force_width, stride = 3, tets.ROW, tets.STRIDE
    warms = False

    def __init__(self, sim: State) -> None:
        self.sim = sim
        self.count = sim.n_own
        rows = np.arange(sim.n_left, sim.n_left + sim.n_own)
        self.rows = np.concatenate([rows, np.repeat(rows[-1:], 3)]).astype(np.int32)
        self.tally = np.zeros((sim.threads, elements.TALLY), np.int64)
        self.passes = 0
        self.laws: list = []
        self._make_constants()
        self._make_memories()
        self._make_joints()
        self.pairs: Any = ContactSpace(sim, self.shapes, self.kinds, *ContactSpace.remembered(sim))
        self._make_loads()
        self._make_nodes()
        self._set_masses()
        self._bind()

    @cached_property
    def shapes(self) -> Any:
        """What contact needs to know of the elements held here, by storage row."""
        return ShapesSpace(self.sim, self.sim.number)

    def _make_constants(self) -> None:
        sim, mesh = self.sim, self.sim.the_mesh()
        models = element_table(sim.element_rows)
        self.true_mass = np.zeros((len(sim.number), 4))
        space.masses(sim.number, mesh.points, mesh.cells, sim.element_row, models, self.true_mass)
        self.c = np.zeros((self.count + 3, tets.TET))
        space.constants(
            sim.number, mesh.points, mesh.cells, sim.element_row, models, sim.options.dynamic, self.rows[: self.count],
            self.true_mass, self.c,
        )  # fmt: skip
        self.c[self.count :] = self.c[self.count - 1] if self.count else 1.0
        self.s0 = np.zeros((self.count + 3, tets.STRESSES))
        if sim.stress0 is not None:
            self.s0[: self.count, :6] = sim.initial_stresses(sim.number[sim.owned])
        self.heated = False

    def _make_joints(self) -> None:
        self.slots = 0
        self.first_slot = 4 * np.arange(self.sim.n_own)
        self.slot_face = np.empty(0, np.int64)
        self.slot_state, self.slot_history = np.empty(0, np.uint8), np.empty((0, HISTORY))

    def _make_loads(self) -> None:
        sim, mesh, own = self.sim, self.sim.the_mesh(), self.sim.owned
        faces = 4 * sim.number[own][:, None] + np.arange(4)
        i, k = np.nonzero(sim.load_row[faces] > 0)
        corner = mesh.face_corners(faces[i, k]) % 4
        self.special = np.ones((sim.n_own, 4), bool)
        self.load_corner = tets.ROW * (i + own.start)[:, None] + tets.STRIDE * corner
        places = mesh.points[mesh.face_points(faces[i, k])].mean(axis=1)
        self.load_functions = Placed(sim.loads, sim.load_row[faces[i, k]].astype(np.int64), places)
        self.load_of = self.load_functions.of
        self.some_applied = sim.comm.any(len(i) > 0)

    def _mark_special(self) -> None:
        pass

    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n_own, 4) [N/m] and dashpots (n_own, 4) [N s/m] at each corner, as in the plane: what the contact
        of its free faces can have, k = P A (1 / h + 1 / h_other) / 3 per face, h_other: the smallest of all."""
        sim, own = self.sim, self.sim.owned
        springs, dashpots = np.zeros((sim.n_own, 4)), np.zeros((sim.n_own, 4))
        if not sim.options.collision:
            return springs, dashpots
        faces = (4 * sim.number[own][:, None] + np.arange(4)).reshape(-1)
        length = self.shapes.double_area[own]
        surfaces = Surfaces(sim, self.shapes, faces, np.repeat(np.arange(own.start, own.stop), 4))
        silent = np.isnan(surfaces.overlay) | ~np.isnan(surfaces.normal)
        ratio = surfaces.ratio.max(initial=0.0)
        found = np.array([float(np.max(1.0 / length, initial=0.0)), float(silent.any()), ratio])
        highest, some, ratio = sim.comm.max_into(found).tolist()
        most = surfaces.slope * surfaces.most_penalty(some == 0.0).reshape(-1, 4)
        contact = most * self.shapes.area[own] / 3.0 * (1.0 / length[:, None] + highest)
        may_touch = ~sim.closed_faces()[faces]
        if sim.options.dynamic:
            may_touch |= sim.joint_row[faces] > 0  # once they break
        contact = np.where(may_touch.reshape(-1, 4), contact, 0.0)
        # A third of 2 xi sqrt(k m) A, with k A = 3 `contact` and m A no more than three corners of the element have.
        drag = 2.0 * ratio * np.sqrt(contact * self.true_mass[own].max(axis=1, initial=0.0)[:, None])
        for k in range(4):
            for c in FACES[k]:
                springs[:, c] += contact[:, k]
                dashpots[:, c] += drag[:, k]
        return springs, dashpots

    def _stable_time_step(self, target: float, mass: np.ndarray) -> float:
        o = self.sim.options
        rows = self.rows[: self.count]
        return space.time_step(
            self.c, rows, self.sim.n_left, *self.springs(), o.mass_damping, o.stiffness_damping, o.safety, target, mass
        )

    def _make_static_masses(self) -> None:
        space.static_masses(self.c, self.rows[: self.count], self.sim.n_left, self.springs()[0], ALPHA, self.mass)

    def _set_kicks(self, dt: float) -> None:
        pass

    def _bind(self) -> None:
        one = self.sim.threads == 1
        self._forces: Any = tets.forces if one else tets.forces_threaded
        self._move: Any = space.move if one else space.move_threaded
        self.of_joints = np.zeros((1, tets.ROW))

    def forces(self) -> None:
        """Forces at the present positions, and the velocities that follow from them. Collective."""
        sim, timers = self.sim, self.sim.timers
        self.passes += 1
        if len(self.pairs):
            with timers("contact"):
                self.pairs.forces(sim.x, sim.v, sim.clock.dt)
        with timers("force"):
            self._fill(self.force)
        if sim.options.dynamic:
            sim.creep.passed = 0.0
        with timers("node"):
            self.move_nodes()

    def _fill(self, force: np.ndarray) -> None:
        sim, o = self.sim, self.sim.options
        self.obey()
        stressed = sim.stress0 is not None or self.plastic or self.creeps
        self._forces(
            sim.threads, self.count, self.rows, sim.x, sim.v, self.c, self.s0, stressed, not o.large_strain, force,
            o.gx, o.gy, o.gz, o.mass_damping, o.stiffness_damping,
        )  # fmt: skip
        self.pairs.add_to(force)

    def move_nodes(self) -> None:
        """New velocities of the nodes from the forces on their corners. Collective."""
        sim, clock = self.sim, self.sim.clock
        if self.some_applied:
            self.applied[:] = 0.0
            loads = self.loads_now(self.load_functions, clock.time)
            space.tractions(self.load_corner, self.load_of, loads, sim.x, self.applied)
        if self.shared:
            sim.halo.fill(self.force)
            if self.some_applied:
                sim.halo.fill(self.applied)
        table = self._conditions
        if table is None:
            half = 0.5 * clock.dt if sim.options.dynamic else 0.0
            table = self.conditions_now(self.node_functions, clock.time, clock.time + half, clock.dt)
        self._move(
            sim.threads, self.node_begin, self.node_corner, self.node_kick, self.node_condition, self.node_share, table,
            self.some_applied, self.force, self.applied, sim.v, 0.0 if sim.options.dynamic else ALPHA, self.outside,
            self.felt,
        )  # fmt: skip

    def loads_now(self, placed: Placed, time: float) -> np.ndarray:
        """The table of tractions (rows, 7)."""
        return placed.filled(self.sim.loads_at(time), lambda one, field: (TRACTIONS[3].index(field), time, 1.0))

    def conditions_now(self, placed: Placed, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of node conditions (rows, 13)."""

        def how(one: NodeCondition, field: str) -> tuple[int, float, float]:
            kind, _, axis = field.partition("_")
            k = "xyz".index(axis)
            if kind == "force":
                return space.FORCE + k, time, 1.0
            velocity = getattr(one, f"does_{axis}") == moving.VELOCITY
            return (space.AT + k, middle, 1.0) if velocity else (space.AT + k, time, dt)

        return placed.filled(self.sim.conditions_at(time, middle, dt), how)

    def evaluation(self, contact: bool = True) -> Evaluation:
        """Forces at the present positions; everything is put back as it was. Collective."""
        sim, pairs = self.sim, self.pairs
        kept = [
            (table, table.copy())
            for table in (sim.v, self.outside, self.felt, pairs.history, pairs.touching, *self.obeyed_state())
        ]  # fmt: skip
        stored, self.force = self.force, np.zeros((len(sim.number), tets.ROW))
        if not contact:
            pairs.pushed[:] = 0.0
        elif len(pairs):
            pairs.forces(sim.x, sim.v, sim.clock.dt)
        self._fill(self.force)
        self.move_nodes()
        found = Evaluation(
            self.force, np.zeros_like(self.force), pairs.pushed.copy(), pairs.touching.copy(), pairs.out.copy(),
            self.outside.copy(), self.felt.copy(), sim.v.copy(),
        )  # fmt: skip
        self.force = stored
        for table, values in kept:
            table[...] = values
        return found

    def stresses(
        self, at: np.ndarray | None = None, energies: bool = True, flow: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n_own, 6) [Pa] and, unless they are not wanted, elastic energies (n_own,) [J] of the owned elements,
        or of some of them (at: the how-manieth)."""
        sim = self.sim
        s0, plastic, crept = self.remembered(flow)
        at = np.arange(sim.n_own) if at is None else at
        n = len(at)
        stress, energy = np.zeros((n, 6)), np.zeros(n if energies else 0)
        small = not sim.options.large_strain
        x = sim.x[at + sim.n_left]
        tets.stresses(x, np.arange(n, dtype=np.int32), self.c[at], s0[at], small, 0, stress, energy)
        if energies:
            energy += self.remembered_energy(plastic, crept)[at]
        return stress, energy

    def stored_in_joints(self) -> np.ndarray:
        """Nothing (n_own,) [J]."""
        return np.zeros(self.sim.n_own)

    def histories(self, transfer: bool) -> Histories:
        """What contacts of the owned elements remember."""
        return Histories.of(self.sim.n_own, *self.pairs.histories(self.sim))

    def handed_over(self) -> tuple[np.ndarray, np.ndarray]:
        """Contact histories of joints that have just broken: there are none."""
        return np.empty(0, np.int64), np.zeros((0, WORDS))

    def renew_contacts(self, handed_over: tuple[np.ndarray, np.ndarray]) -> None:
        """New contact lists. Collective."""
        self.pairs = ContactSpace(self.sim, self.shapes, self.kinds, *self.pairs.known())
        if self.sim.masses_change():
            self._set_masses()
