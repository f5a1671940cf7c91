"""The simulation of blocks: one step, and the rebuild of the lists. The page on which the method can be read.

An element owns its corners: their positions, velocities, and what the joints on its edges and its contacts remember.
Corners that move as one node (nothing lies between their elements) carry equal copies. So all there is to a model is
rows of elements; they are shared out among the ranks in strips, as particles are, and travel with what they remember.

State (state.py) is either *closed* (sorted, ghosts in place, tables of the kernels made: ready to step) or *open*
(owned elements and their histories only). Assignments open it; the next step closes it again.

Every sum over elements that share something is taken in the order of their numbers in the mesh. So the bits depend
neither on ranks and threads nor on when the lists were rebuilt.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from hpcdem.core.cells import columns, keys
from hpcdem.core.errors import CommandError, EquilibriumError, PhysicsError
from hpcdem.core.heap import give_back
from hpcdem.core.memory import aligned
from hpcdem.decomp import strips
from hpcdem.engine.rebuild import LONGEST_WAIT
from hpcdem.halo.exchange import connect
from hpcdem.halo.migrate import Migration
from hpcdem.halo.ownership import Ownership
from hpcdem.physics.fdem import (
    apart,
    build,
    by_temperature,
    connectivity,
    overlaps,
    tetrahedra,
    user_functions,
    user_laws,
)
from hpcdem.physics.fdem.definition import AGAIN, COMPONENTS, DISTANCE, Numbers
from hpcdem.physics.fdem.histories import Histories
from hpcdem.physics.fdem.kernels import elements, joint_law, joints_space, space, tets
from hpcdem.physics.fdem.kernels.creep_tets import IN_KELVIN
from hpcdem.physics.fdem.kernels.joint_law import MODE
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.kernels.strength import HISTORY as STRENGTH_HISTORY
from hpcdem.physics.fdem.local import Evaluation, Local
from hpcdem.physics.fdem.local_space import LocalSpace
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.pairs import cut_corner
from hpcdem.physics.fdem.properties import KELVIN_STRAIN, MECH_BURGERS, temperature_table
from hpcdem.physics.fdem.state import NARROW, WIDE, Crack, ListState, State
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.fields import kinds

ROOM = 0.6
"""How far elements may go, both together, before storage and ghosts are made again; over the mean edge."""
SHORT_LIVED, LONG_LIVED = 60, 400
"""Lists that lasted fewer steps call for the wide buffer, more steps for the narrow one."""
OLDEST = 2000
"""Storage is made again at this age even if nobody moved, so that borders can follow the load."""
OUTSIDE, MUCH = 1e-6, 1e-3
"""Part of its largest component by which a stress must be beyond the strength to be spoken of: one that was given, one
that relaxation begins with."""
LOCKS = 0.45
"""Poisson's ratio above which tetrahedra are said to lock."""


class Blocks(State):
    """One model of blocks on one communicator. Every method is collective unless it says otherwise.

    Numbers are those of the mesh, from 0, and know no ranks: elements are rows of `mesh.cells`, nodes are rows of
    `mesh.points`, faces are element * 4 + local edge, joints have the number of their lower face. Arguments called
    elements, nodes, faces, joints take an array of numbers, or None for all. What is said of a node holds for all
    corners of elements at that point, and stays with them when joints break. Step and rebuild are here; what acts on a
    model are functions: diagnostics, changes between steps, many steps (convergence), equilibrium at once, saved_state.

    CommandError for values that make no sense, equal on all ranks.
    """

    local: Local
    _known: dict[str, Any] | None = None
    _state_given = False
    """A stress, or what must bear it, was said before anything moved, and is still to be looked at."""

    # ---- mesh ----------------------------------------------------------------------------------------------------

    def take_mesh(self, mesh: Mesh) -> None:
        """Take a mesh (checked here; equal on all ranks). Elements have no model yet, edges no joints: bodies hang
        together as ordinary finite elements. Edges in `mesh.cracks` are open from the beginning."""
        self._take(mesh)
        self._start_with(mesh)

    def take_births(self, born: np.ndarray, places: np.ndarray) -> None:
        """Elements (n,) have come back, their corners at places (n, 4, dim) [m]."""
        super().take_births(born, places)
        self.areas = self.reference.areas()

    def _tables(self) -> type[Local]:
        return LocalSpace if self.dim == 3 else Local

    def corner_masses(self, number: np.ndarray) -> np.ndarray:
        """(n, 4) true masses [kg/m], in space [kg], of the corners of these elements. Not collective."""
        return self._tables().corner_masses(self, number)

    def place_mesh(self, mesh: Mesh) -> None:
        """The same for a mesh that is known to be good."""
        self._put(mesh)
        self._start_with(mesh)

    def _start_with(self, mesh: Mesh) -> None:
        self.release()
        self.surface_loads.mesh_replaced()
        self.closed = False
        self.rebuild_state = ListState()
        self.ownership = Ownership(self.comm, self.balance_on)
        self.event_rows = []
        self._topology_stale = True
        self._longest = 0.0
        self.untouched = True
        self.budget = None
        if mesh.dim == 3:
            self.prepare_kernels("space")
        self.areas, self.mean_edge = mesh.areas(), mesh.mean_edge()
        self.cut = cut_corner(mesh) if mesh.dim == 2 else np.empty(0, np.int64)
        n, size, rank = len(mesh.cells), self.comm.size, self.comm.rank
        self.number = np.arange(n * rank // size, n * (rank + 1) // size)
        if mesh.dim == 3:
            self.x, self.v = (np.zeros((len(self.number), tets.ROW)) for _ in range(2))
            space.corners(mesh.points, mesh.cells, self.number, self.x)
        else:
            wide = bool((mesh.cells[:, 3] >= 0).any())
            self.x = np.zeros((len(self.number), 12 if wide else 8))
            self.v = np.zeros((len(self.number), 12 if wide else 6))
            build.corners(mesh.points, mesh.cells, self.number, self.x)
        self.cold = {}
        self.histories = Histories.empty(len(self.number))

    def note(self, text: str) -> None:
        if self.log is not None:
            self.log.info(text)

    def before_change(self) -> None:
        if self.budget is not None and (self.closed or self.budget.running):
            self.close_model()  # the last step may have scheduled a rebuild
            if self.comm.any(bool(self.local.tally[:, elements.NEW_BROKEN].any())):
                self._renew_lists()  # what broken joints lose is not the doing of commands
            self.budget.pause(self)
        if self.creep.passed > 0.0:
            self._settle_creep()
        self.open_model()

    def _settle_creep(self) -> None:
        """A command is about to change a model in motion: elements creep for the time that has passed. Collective."""
        if self.options.dynamic:
            self.close_model()
            if self.local.creeps:
                self.local.creep(self.cold["creep"], self.local.s0, self.local.quad_s0, keep=True)
            self.creep.passed = 0.0

    def drop_creep_step(self) -> None:
        """Forget a creep step of a static run that did not come into balance: elements have not crept in it."""
        if self.creep.passed > 0.0 and not self.options.dynamic:
            self.creep.passed = 0.0
            self.open_model()

    def changed(self, topology: bool = False, stiffness: bool = True) -> None:
        self._topology_stale |= topology
        if topology:
            self._closed = None
        self.rebuild_state.soon()
        if stiffness:
            self.rebuild_state.dt = 0.0

    def set_element_model(self, elements: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        before = self.element_row.copy()
        super().set_element_model(elements, name, properties)
        self._state_given |= self.clock.step == 0
        if name == MECH_BURGERS.name:
            self._take_kelvin_strain(elements, KELVIN_STRAIN[self.dim])
        if self.log is None or self.stress0 is None:
            return
        at = np.flatnonzero((before != self.element_row) & (before > 0))
        other = at[(self.initial_stresses(at) != self.stress0[at]).any(axis=1)]
        if len(other):
            self.log.warn_once(
                "initial stress follows",
                f"{len(other)} elements have other moduli than when their initial stress was said: it follows them, "
                f"element {other[0]} has {_pascals(self.initial_stresses(other[:1])[0])} in place of "
                f"{_pascals(self.stress0[other[0]])}; element initial after the models sets it for the present ones",
            )

    def element_property(self, elements: Numbers, properties: Mapping[str, Value]) -> None:
        super().element_property(elements, properties)
        self._state_given |= self.clock.step == 0
        self._take_kelvin_strain(elements, [name for name in KELVIN_STRAIN[self.dim] if name in properties])

    def initial_stress(self, *args: Any, **given: Any) -> None:
        super().initial_stress(*args, **given)
        self._state_given = True

    def _take_kelvin_strain(self, elements: Numbers, names: Sequence[str]) -> None:
        """The strain of the Kelvin units becomes what their properties say, in these components; the model is open."""
        at = self.numbers_of_elements(elements)
        for name in names:
            value = self.element_rows.column(name)[self.element_row]
            if "creep" not in self.cold:
                if not value[at].any():
                    continue
                self.cold["creep"] = np.zeros((len(self.number), self.memory("creep") * self.element_parts))
            mine, memory = np.isin(self.number, at), self.cold["creep"]
            first = IN_KELVIN[KELVIN_STRAIN[self.dim].index(name)]
            for column in range(first, memory.shape[1], self.memory("creep")):
                memory[mine, column] = value[self.number[mine]]

    def remove_table(self, name: str) -> None:
        if any(load.uses_table(name) for load in self.surface_loads):
            raise CommandError(f"table '{name}' is used by a boundary condition")
        super().remove_table(name)

    def option(
        self,
        dynamic: bool | None = None,
        collision: bool | None = None,
        large_strain: bool | None = None,
        overlap: str | None = None,
        potential: str | None = None,
        deep_overlap: str | None = None,
        plane_stress: bool | None = None,
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. Velocities become zero when it is
        changed, as those of the static mode are ways per step. collision (on): contact. large_strain (on): rotations of
        any size; off: geometry of the mesh. overlap ("refuse"): of bodies that overlap before the first step: refuse
        it; "relax": a static stage moves them apart; "keep": they start as they are. deep_overlap ("warn"): of bodies
        that come to overlap by more than a tenth of an altitude: say where; "stop": end the run. potential
        ("distance"): of contact in space, see `definition.POTENTIAL`. plane_stress (off): a model of the plane is a
        plate whose faces bear nothing; off: in plane strain. Said before stress and steps are."""
        before = self.options.dynamic
        if plane_stress not in (None, self.options.plane_stress) and self.clock.step > 0:
            raise CommandError(f"model plane-{'stress' if plane_stress else 'strain'} comes before the first step")
        if dynamic is not None and dynamic != before:
            self.drop_creep_step()
            if dynamic:
                self._tell_of_tables()
        super().option(dynamic, collision, large_strain, overlap, potential, deep_overlap, plane_stress)
        if self.options.dynamic != before:
            self.v[:] = 0.0
            if before:
                self._set(static_since=self.clock.step)

    def tables_over_time(self) -> list[str]:
        """Tables that conditions of blocks, bolts and liners follow; fluid and heat have clocks of their own."""
        others = [load for load in self.surface_loads if not load.own_clock]
        said = self.followed_tables()
        return [name for name in self.tables if name in said or any(load.uses_table(name) for load in others)]

    def changing_tables(self) -> list[str]:
        """Those of which later values are others than that of now."""
        now = self.time_now()
        return [name for name in self.tables_over_time() if self.tables[name].changes_after(now)]

    def _tell_of_tables(self) -> None:
        """Static mode ends: a line in the log about tables that have another value at the model time."""
        then, now = self.time_now(), self.clock.time
        for name in self.tables_over_time() if self.log is not None else ():
            table = self.tables[name]
            if table(then) != table(now):
                self.log.warn(
                    f"table '{name}' of a condition goes from {table(then):g} to {table(now):g}: static mode, where a "
                    f"step is one unit of time, had come to {then:g}, and the model time is {now:g} s. Say the "
                    "condition again, by a number or another table, if that is not what is wanted"
                )

    def _warn_of_quick_tables(self) -> None:
        """A line in the log about tables that are over within a static step."""
        if self.options.dynamic or self.creep.on or self.log is None:
            return
        now = self.time_now()
        for name in self.changing_tables():
            if self.tables[name].times[-1] - now < 1.0:
                self.log.warn_once(
                    f"table {name} in a static step",
                    f"table '{name}' of a condition goes from {self.tables[name](now):g} to "
                    f"{self.tables[name].values[-1]:g} within one static step, which is one unit of time: say the "
                    "condition after the static stage if it belongs to motion in time, or give the table in steps",
                )

    def _remember(self, name: str, columns: int) -> None:
        """Owned elements remember so much for each of their triangles. (In files from before quads could yield or
        creep it is that of one.)"""
        known, wanted = self.cold.get(name, np.empty((len(self.number), 0))), columns * self.element_parts
        if known.shape[1] < wanted:
            self.cold[name] = np.pad(known, ((0, 0), (0, wanted - known.shape[1])))

    # ---- one step ------------------------------------------------------------------------------------------------

    def step(self) -> int:
        """Advance everything by one dt. The same text on one rank and on a thousand.

        Returns what the outside asked for (0 nothing; else see runtime.stop_requests), agreed by all ranks.
        """
        self.close_model()
        self.check_start()
        if not self.options.mechanical:
            return self._standing_step()
        self.untouched = False
        timers, halo, rebuild_state, request = self.timers, self.halo, self.rebuild_state, 0
        budget = self.budget if self.options.dynamic else None
        if budget is not None:
            budget.before_forces(self)
        self.local.forces()
        if budget is not None:
            budget.after_forces(self)
        with timers("move"):
            for first, last in halo.border:
                self._drift(first, last)
            halo.start()
            self._drift(*halo.inside)
        self.clock.step += 1
        if self.options.dynamic:
            self.clock.time += self.clock.dt
            if self.creep.on:
                self.creep.passed = self.clock.dt
                self.creep.time += self.clock.dt
        rebuild_state.age += 1
        rebuild_state.stored += 1
        stale = outdated = False
        look = rebuild_state.passed()
        if look or (self.options.collision and rebuild_state.glances() and self._has_sped_up()):
            with timers("reduce"):
                try:
                    stale, outdated, request = self._check_rebuild()
                except (EquilibriumError, PhysicsError):
                    halo.finish()  # the script may go on
                    raise
        with timers("halo"):
            halo.finish()
        self.surface_loads.follow()
        if (
            self.options.auto
            and self.options.dynamic
            and self.clock.step - rebuild_state.estimated >= self.options.auto_every
        ):
            rebuild_state.dt, stale = 0.0, True
        if stale or outdated:
            if not outdated or (budget is not None and self.masses_change()):
                self._renew_lists()
            if outdated:
                self.open_model()
        return request

    def _standing_step(self) -> int:
        """A step of everything but the motion: time passes, blocks stand still."""
        self.clock.step += 1
        self.clock.time += self.clock.dt
        self.surface_loads.follow()
        if self.clock.step % LONGEST_WAIT or self.stop is None:
            return 0
        return int(self.comm.max_into(np.array([self.stop.local_request()], np.int64))[0])

    def check_start(self) -> None:
        """CommandError if a load lacks something, or nothing has moved yet and bodies overlap, unless that was asked
        for; the model is closed. Collective."""
        self._check_parts()
        self.surface_loads.check_start()
        if self.untouched and self.options.mechanical:
            overlaps.check(self, self.local)
            give_back()  # it looks at all elements, not only at those of the surface

    def _check_parts(self) -> None:
        """CommandError for what was said of parts of the calculation that are not there."""
        o = self.options
        if self.dim == 2 and o.potential != DISTANCE:
            raise CommandError("in two dimensions there is no choice of the potential of contact")
        if not o.mechanical:
            if not any(load.keeps_time for load in self.surface_loads):
                raise CommandError(
                    "nothing would happen: model option mechanical is off, and neither fluid nor heat flows"
                )
            if not o.dynamic:
                raise CommandError(
                    "without mechanics time passes by flow and heat: model option dynamic on comes first"
                )
            others = [load.name for load in self.surface_loads if not load.own_clock]
            if others:
                raise CommandError(f"{others[0].replace('_', '-')} move with the blocks: model option mechanical on")
            if self.creep.on:
                raise CommandError("elements creep while blocks move: model creep off, or model option mechanical on")
        every = o.flow_every != 1 and "heat" not in self.surface_loads
        said = {"one-way": o.one_way, "sub-step": every or o.flow_steps > 0, "time-step": o.flow_dt > 0.0}
        lost = [name for name, is_so in said.items() if is_so]
        if lost and "fluid" not in self.surface_loads:
            raise CommandError(
                f"{lost[0]} of flow was said, but no joint has a hydraulic model: face-joint c-model "
                "hydraulic-porous-medium"
            )
        if (o.heat_steps > 0 or o.heat_dt > 0.0) and "heat" not in self.surface_loads:
            name = "sub-step" if o.heat_steps > 0 else "time-step"
            raise CommandError(
                f"{name} of heat was said, but no element has a thermal model: element c-model thermal-iso-heat"
            )

    def _drift(self, first: int, last: int) -> None:
        """Move the owned elements first : last by dt."""
        of = tets if self.dim == 3 else elements
        kernel = of.drift if self.threads == 1 else of.drift_threaded
        kernel(self.threads, self.n_left + first, self.n_left + last, self.x, self.v, self.clock.dt)

    def _survey(self, places: np.ndarray, out: np.ndarray) -> None:
        """How far the elements of this rank have gone from these places, and how fast they are, into out."""
        if self.dim == 3:
            space.survey(self.x, self.v, places, self.n_left, self.n_own, out)
        else:
            cells = self.the_mesh().cells
            build.survey(self.x, self.v, places, self.n_left, self.n_own, cells, self.number, out)

    def _has_sped_up(self) -> bool:
        """A glance between two looks: whether the next one might come too late for the contact lists. Collective."""
        found = np.zeros(4)
        with self.timers("reduce"):
            self._survey(self.listed, found)
            self.comm.max_into(found)
        room = 0.5 * self.rebuild_state.skin - math.sqrt(found[0])
        return self.rebuild_state.is_too_late(room, math.sqrt(found[1]) * self.clock.dt)

    def _check_rebuild(self) -> tuple[bool, bool, int]:
        """How far has anyone gone since the lists were built? Sets the step of the next look.

        Returns whether contact lists, and whether the storage has to be made again now, and the outside's request. All
        ranks get the same answers.
        """
        rebuild_state = self.rebuild_state
        found, more = np.zeros(10), np.zeros(4)
        for places, out in ((self.listed, found), (self.origin, more)):
            self._survey(places, out)
        found[4] = float(self.local.tally[:, elements.NEW_BROKEN].sum())
        found[5] = float(self.local.tally[:, elements.NEW_YIELDED].sum())
        found[6] = self.stop.local_request() if self.stop is not None else 0
        found[7] = more[0]
        if due := self.options.collision and self.clock.step - rebuild_state.watched >= LONGEST_WAIT:
            rebuild_state.watched = self.clock.step
            found[8] = overlaps.part(self, self.local)
        found[9] = apart.part(self, self.local)
        self.comm.max_into(found)
        path2, speed2, broken, inverted, breaks, yields, request, way2, deep, slid = found.tolist()
        dt = self.clock.dt
        stride = math.sqrt(speed2) * dt
        if broken or inverted or stride > 0.5 * self.mean_edge:
            self._stop_on_runaway(bool(broken), bool(inverted))
        if due and deep > max(overlaps.DEEP, overlaps.AGAIN * rebuild_state.deep):
            rebuild_state.deep = deep
            overlaps.tell(self, self.local)
        if slid > apart.FAR:
            apart.check(self, self.local, PhysicsError)
        self.local.tally[:, elements.NEW_YIELDED] = 0
        stale, outdated = breaks > 0.0, rebuild_state.stored >= OLDEST
        wait = float(LONGEST_WAIT // 4 if yields > 0.0 else LONGEST_WAIT)  # a joint may be about to break
        if self.options.collision:
            room = 0.5 * rebuild_state.skin - math.sqrt(path2)
            rebuild_state.late += room < 0.0
            # Lists end where the ghosts do, so some of their room is left for the next ones.
            outdated |= 0.5 * (ROOM - WIDE) * self.mean_edge < math.sqrt(way2) + stride
            stale |= room < stride
            if stale or outdated:
                room = 0.5 * rebuild_state.skin
            if stride > 0.0:
                wait = min(wait, 0.5 * room / stride)
        rebuild_state.wait(wait)
        return bool(stale), bool(outdated), int(request)

    def _stop_on_runaway(self, broken: bool, inverted: bool) -> None:
        """Name the elements that cannot be right, and stop on all ranks: raises PhysicsError. Collective."""
        x, v, number = self.x[self.owned], self.v[self.owned], self.number[self.owned]
        with np.errstate(invalid="ignore", over="ignore"):
            bad = ~(self._whole_speed(v) * self.clock.dt <= 0.5 * self.mean_edge) | ~self._upright(x, number)
        rows = np.flatnonzero(bad)[np.argsort(number[bad])][:10]
        dim = self.dim
        mine = [(int(number[i]), x[i, :dim].tolist(), v[i, :dim].tolist()) for i in rows]
        named = sorted(row for part in self.comm.allgather(mine) for row in part)[:10]
        total = int(self.comm.sum_into(np.array([bad.sum()], np.int64))[0])
        what = "a number is not finite" if broken else (
            "an element is turned inside out" if inverted else "an element moves over half an edge per step"
        )  # fmt: skip
        text = "\n".join(f"  element {e} at {_vector(at)}, velocity {_vector(speed)}" for e, at, speed in named)
        if not self.options.dynamic and not broken and not inverted:
            e, at, speed = named[0]
            raise EquilibriumError(
                f"step {self.clock.step}: {total} elements move over half an edge per static step, such as element {e} "
                f"at {_vector(at)} by {_vector(speed)}"
            )
        guess = f"the time step {self.clock.dt:g} s is probably too large, or loads are"
        if broken and (titles := self._of_users()):
            guess += f"; or it comes from {', '.join(titles)}"
        raise PhysicsError(f"step {self.clock.step}: {what} ({total} elements); {guess}\n{text}")

    def _of_users(self) -> list[str]:
        """Laws and functions of the user that act. Not collective."""
        rows = [self.conditions[k] for k in np.unique(self.corner_row)] + [
            self.loads[k] for k in np.unique(self.load_row)
        ]
        functions = [one.title for row in rows for one in user_functions.used(row).values()]
        return sorted({*functions, *(law.title for law in user_laws.in_use(self))})

    def _whole_speed(self, v: np.ndarray) -> np.ndarray:
        """Largest speed of a corner of elements [m/s]; the fourth corner of quads is not asked for."""
        corners = v[:, :6].reshape(len(v), 3, 2) if self.dim == 2 else v.reshape(len(v), 4, 4)
        return np.sqrt((corners * corners).sum(axis=2)).max(axis=1)

    def _upright(self, x: np.ndarray, number: np.ndarray) -> np.ndarray:
        """(n,) bool: elements whose corners are finite and run the right way."""
        if self.dim == 3:
            return np.array([space.volume(row) > 0.0 for row in x], bool)
        good = np.isfinite(x[:, :6]).all(axis=1) & (_turn(x, 0, 2, 4) > 0.0)
        if self.wide:
            quads = connectivity.corner_counts(self.the_mesh().cells[number]) == 4
            good &= ~quads | (_turn(x, 0, 4, 6) > 0.0)
        return good

    # ---- forces without a step -------------------------------------------------------------------------------------

    def evaluate(self) -> Evaluation:
        """Forces at the present positions; leaves everything as it is. Collective."""
        self.close_model()
        return self._once("forces", self.local.evaluation)

    @contextmanager
    def one_moment(self) -> Iterator[None]:
        """As long as this lasts the model is only looked at: forces and the energy budget are computed once, however
        many ask for them."""
        self._known = {}
        try:
            yield
        finally:
            self._known = None

    def _once(self, what: str, make: Callable[[], Any]) -> Any:
        if self._known is None:
            return make()
        if what not in self._known:
            self._known[what] = make()
        return self._known[what]

    # ---- open and closed -----------------------------------------------------------------------------------------

    def open_model(self) -> None:
        """Make the model free to be changed: owned elements and their histories only. Joints that broke become free
        faces."""
        if not self.closed:
            return
        with self.timers("neighbour"):
            middle, _ = self._middles()
            local = self.local
            longest_link = joints_space.longest_link if self.dim == 3 else build.longest_link
            longest2 = longest_link(middle, local.slots, local.slot_face, self.partner, self.where, local.slot_state)
            self._longest = math.sqrt(float(self.comm.max_into(np.array([longest2]))[0]))
            self.histories = local.histories(transfer=True)
            self._collect_events()
            self.where[self.number] = -1
            self._leave_storage()

    def _leave_storage(self) -> None:
        self.halo.close()
        own = self.owned
        self.number, self.x, self.v = self.number[own].copy(), self.x[own].copy(), self.v[own].copy()
        self.closed = False

    def waiting_events(self) -> list[Crack]:
        """Joints that broke since the last rebuild, in order of steps, see `Crack`. Collective."""
        local, clock, rebuild_state = self.local, self.clock, self.rebuild_state
        slots = np.flatnonzero(local.slot_state == BROKEN)
        face = local.slot_face[slots]
        slots = slots[self.broken[np.minimum(face, self.partner[face])] <= 1]
        mine = np.column_stack([local.slot_face[slots].astype(float), local.slot_history[slots, MODE:]])
        rows = np.concatenate(self.comm.allgather(mine)) if self.comm.size > 1 else mine
        if not len(rows):
            return []
        faces = rows[:, 0].astype(np.int64)
        lower = np.minimum(faces, self.partner[faces])
        order = np.lexsort((faces, lower))  # both sides report, the lower face first
        rows, lower = rows[order], lower[order]
        assert (lower[0::2] == lower[1::2]).all(), "a joint broke on one side only"
        first, joints = rows[0::2], lower[0::2]
        both = rows[0::2] + rows[1::2]
        dt = clock.dt if self.options.dynamic else 0.0
        began = rebuild_state.time if dt else self.told_time() + self.creep.passed
        return [
            Crack(
                int(joints[k]), float(first[k, 1]), int(first[k, 2]), float(both[k, 3]),
                began + (int(first[k, 2]) - rebuild_state.step) * dt, int(first[k, 4]), float(both[k, 5]),
            )
            for k in np.lexsort((joints, first[:, 2])).tolist()
        ]  # fmt: skip

    def rebuild(self) -> None:
        """Storage and lists again at the present positions, as the step does from time to time."""
        self.open_model()
        self.close_model()

    def _renew_lists(self) -> None:
        """Contact lists at the present positions; joints that broke become free faces. Storage stays."""
        with self.timers("neighbour"):
            self.rebuild_state.skin = self._skin()
            handed_over = self.local.handed_over()
            self._collect_events()
            self.local.renew_contacts(handed_over)
            self.listed = self.places()
            self.rebuild_state.age = 0
            self._note_time()
            self.rebuilds += 1

    def places(self) -> np.ndarray:
        """Positions (n_own, w) [m] of the owned elements, in space (n_own, 12), without spare words."""
        places = self.x[self.owned]
        return tetrahedra.without_spares(places) if self.dim == 3 else places.copy()

    def _note_time(self) -> None:
        self.rebuild_state.step, self.rebuild_state.time = self.clock.step, self.clock.time

    def _skin(self) -> float:
        """Buffer of the next contact lists [m], from global values only."""
        rebuild_state = self.rebuild_state
        rebuild_state.adapt_skin(NARROW, WIDE, SHORT_LIVED, LONG_LIVED)
        return rebuild_state.skin_factor * self.mean_edge

    def _collect_events(self) -> None:
        """Joints that broke since the last rebuild become free faces, on all ranks. Collective."""
        rows, again = self.waiting_events(), np.flatnonzero(self.broken > 1)
        if rows or len(again):
            self.event_rows += rows
            joints = np.array([row[0] for row in rows], np.int64)
            self.broken[joints] = 1
            self.broken[again] = self.broken[again] == AGAIN
            self.open_faces(np.append(joints, again))
            self.surface_loads.joints_opened()

    def close_again(self) -> None:
        """Close a restored model: its rebuild_state stays as it was."""
        self._close(frozen=True)

    def close_model(self) -> None:
        """Make the model ready to step: storage, ghosts and tables at the present positions."""
        if not self.closed:
            self._close()

    def _close(self, frozen: bool = False) -> None:
        """From open to closed. frozen: keep the rebuild_state as it is (restart)."""
        self._check_ready()
        if self.yielding().any():
            self._remember("plastic", self.memory("plastic"))
            if self.softens():
                self._remember("softening", STRENGTH_HISTORY)
        creeps = self.creeping().any()
        if self.creep.on and not creeps and self.log is not None:
            self.log.warn_once("no creep", "creep is on, but no element can creep: element c-model mech-burgers can")
        if creeps or "creep" in self.cold:
            self._remember("creep", self.memory("creep"))
        for kind, needed in (("yielding", "plastic" in self.cold), ("creep", "creep" in self.cold)):
            if needed:
                self.prepare_kernels(f"{kind}-space" if self.dim == 3 else kind)
                if self.dim == 3 and len(self.the_mesh().hexes):
                    self.prepare_kernels(f"{kind}-hexes")
        for load in self.surface_loads:
            if load.kernel_kind:
                self.prepare_kernels(load.kernel_kind + ("-space" if self.dim == 3 and not load.of_both else ""))
        self._warn_of_quick_tables()
        user_laws.begin(self)
        user_laws.compile_for_quads(self)
        stale = self._topology_stale
        with self.timers("neighbour"):
            if stale:
                self.renew_topology()
            if self.rebuild_state.dt == 0.0:
                self._warn_of_snap_back()
                self._warn_of_locking()
            middle, radius = self._middles()
            self._choose_reach(radius, 0.0 if frozen else self.surface_loads.reach(self, middle), frozen)
        middle = self._share_out(middle)
        with self.timers("neighbour"):
            cell = self._keys(middle)
            order = strips.global_order(cell, self.number)
            cell = cell[order]
        with self.timers("halo"):
            self._store(order, cell)
        with self.timers("neighbour"):
            self.local = self._tables()(self)
            if not frozen:
                self.origin = self.places()
                self.listed = self.origin  # until lists are renewed without storage
                self.rebuild_state.age = self.rebuild_state.stored = 0
                self._note_time()
            self.rebuilds += 1
        self.surface_loads.storage_rebuilt()
        if self._state_given:
            self._state_given = False
            self._warn_of_given_stress()
        if stale:
            give_back()

    def bare(self) -> np.ndarray:
        """Elements that have no model yet. CommandError without a mesh."""
        self.the_mesh()
        return np.flatnonzero(self.alive & (self.element_row == 0))

    def _check_ready(self) -> None:
        """CommandError unless every element has a model."""
        bare = self.bare()
        if len(bare):
            raise CommandError(f"element {bare[0]} has no model ({len(bare)} elements in all)")
        if not self.alive.any():
            raise CommandError("there are no elements left")
        self._check_warmth()
        if self.options.plane_stress:
            user_laws.check_plane_stress(self)
        if self.options.stiffness_damping and user_laws.in_use(self):
            raise CommandError(
                f"the stiffness of {user_laws.some(self)}, which has a law of the user, is not known: Rayleigh damping "
                "can have its part mass only"
            )

    def _check_warmth(self) -> None:
        """CommandError where properties follow temperatures that are not there, or surroundings that cannot follow."""
        elements, joints = self.warms()
        for what, at, rows, row in (("element", elements, self.element_rows, self.element_row),
                                    ("joint", joints, self.joint_rows, self.joint_row)):  # fmt: skip
            for over, which in by_temperature.followed(self, rows, row, at):
                if over not in self.cold:
                    lacking = "heat" if over == by_temperature.TEMPERATURE else over
                    word = "thermal-iso-heat" if lacking == "heat" else kinds()[over].word
                    raise CommandError(
                        f"a property of {what} {which} follows a table over {over}, but there is no {lacking}: element "
                        f"c-model {word} for all"
                    )
        soft = elements & (self.element_rows.column(temperature_table("young"))[self.element_row] > 0.0)
        beside = np.flatnonzero(self.quiet_faces() & np.repeat(soft, 4))
        if len(beside) or (soft.any() and "free_field" in self.surface_loads):
            element = beside[0] // 4 if len(beside) else np.flatnonzero(soft)[0]
            raise CommandError(
                f"young of element {element} follows a table over temperature: quiet faces and free-field sides have "
                "dashpots of one modulus, a number"
            )

    def renew_topology(self) -> None:
        """Which corners are one node."""
        mesh = self.the_mesh()
        node, lead = self.clusters()
        self._acting = None
        self.node = node.astype(np.int32, copy=False)
        sizes = np.bincount(node[node >= 0], minlength=len(lead))
        self.shared_nodes = sizes > 1
        self.member_begin = np.zeros(len(lead) + 1, np.int32)
        self.member = np.empty(int(sizes[self.shared_nodes].sum()), np.int32)
        if len(self.member):  # else zeros that nobody has written to: nothing of them is in the memory
            build.cluster_members(self.node, sizes, self.member_begin, self.member)
        cells = mesh.cells[self.alive]
        self.point_corners = np.bincount(cells[cells >= 0], minlength=len(mesh.points))
        self.where = np.full(len(mesh.cells), -1, np.int64)
        self._topology_stale = False

    def _middles(self) -> tuple[np.ndarray, float]:
        """Means of the corners of the elements held here (n, 2), in space (n, 3) [m], and the largest distance of a
        corner from it."""
        middle = np.empty((len(self.number), self.dim))
        mesh = self.the_mesh()
        if self.dim == 3:
            radius = space.middles(self.x, middle)
        else:
            radius = build.middles(self.x, mesh.cells, self.number, middle)
        return middle, max(radius, self._gather_macros(middle)) if len(mesh.macros) else radius

    def _gather_macros(self, middle: np.ndarray) -> float:
        """Parts of a macro-element get one middle (n, dim), the mean of theirs, so that they go together. Returns the
        largest distance of their corners from it. Collective."""
        mesh = self.the_mesh()
        of, parts_of_one, dim = mesh.macro_of()[self.number], mesh.macro.parts, self.dim
        mine = np.flatnonzero(of >= 0)
        parts = [(self.number[mine], middle[mine])]
        if self.comm.size > 1:
            whole = np.bincount(of[mine], minlength=len(mesh.macros))[of[mine]] == parts_of_one
            if self.comm.any(not whole.all()):
                parts = self.comm.allgather((self.number[mine], middle[mine]))
        number, middles = (np.concatenate([part[k] for part in parts]) for k in range(2))
        number, first = np.unique(number, return_index=True)
        means = middles[first].reshape(-1, parts_of_one, dim).mean(axis=1)
        middle[mine] = means[np.searchsorted(number[::parts_of_one], mesh.macros[of[mine], -1])]
        corners = self.x[mine].reshape(-1, self.x.shape[1] // self.stride, self.stride)[:, : dim + 1, :dim]
        way = corners - middle[mine][:, None]
        return math.sqrt(float((way * way).sum(axis=2).max(initial=0.0)))

    def _keys(self, middle: np.ndarray) -> np.ndarray:
        """Cells of elements by their middles."""
        return (space.keys if self.dim == 3 else keys)(middle, self.rebuild_state.side)

    def _choose_reach(self, radius: float, of_loads: float, frozen: bool) -> None:
        """Buffer and cell side for the next lists, from global values only; of_loads: see `SurfaceLoad.reach`."""
        rebuild_state = self.rebuild_state
        radius = float(self.comm.max_into(np.array([radius]))[0])
        if frozen:
            return
        rebuild_state.skin = self._skin()
        room = ROOM * self.mean_edge if self.options.collision else 0.0
        needed = max(2.0 * radius, self._longest, of_loads) * (1.0 + 1e-9) + room
        if not needed <= rebuild_state.side <= 1.2 * needed:
            rebuild_state.side = 1.05 * needed

    def _share_out(self, middle: np.ndarray) -> np.ndarray:
        """Move borders if it pays, then send every element and its histories to the owner of its column.

        Returns the middles of the elements that are owned now (n, 2) [m].
        """
        side = self.rebuild_state.side
        cell = self._keys(middle)
        with self.timers("balance"):
            self.ownership.renew(columns(cell), side, self.clock.step, self.timers.seconds(), None, self._costs())
        with self.timers("migrate"):
            leave = strips.strays(cell, self.ownership.borders, self.comm.rank) if self.comm.size > 1 else cell[:0]
            migration = Migration(self.comm, len(cell), leave, self.ownership.owner_of(columns(cell[leave])))
            leave = migration.leave
            leaving = self.histories.take(leave)
            rows = [self.number.view(np.float64)[:, None], self.x, self.v, middle, *self.cold.values()]
            table = np.hstack([part[leave] for part in rows])
            arrived, counts, entries = migration.exchange(table, leaving.counts(), leaving.rows)
            if not len(leave) and not len(arrived):
                return middle
            stay = migration.stay()
            self.histories = self.histories.take(stay).joined(counts, entries)
            joined, at = [], 0
            for part in rows:
                joined.append(np.concatenate([part[stay], arrived[:, at : at + part.shape[1]]]))
                at += part.shape[1]
            self.number = np.ascontiguousarray(joined[0][:, 0]).view(np.int64)
            self.x, self.v, middle = joined[1], joined[2], np.ascontiguousarray(joined[3])
            self.cold = dict(zip(self.cold, joined[4:]))
        return middle

    def _costs(self) -> np.ndarray:
        """Relative cost of the owned elements: broken zones cost more."""
        cost = np.ones(len(self.number))
        cost += 0.5 * np.minimum(self.histories.counts(), 12)
        return cost

    def _store(self, order: np.ndarray, cell: np.ndarray) -> None:
        """Put the owned elements into storage order, with the ghosts around them."""
        self.histories = self.histories.take(order)
        self.cold = {name: values[order] for name, values in self.cold.items()}
        number, v = self.number[order], self.v[order]
        self.x, self.halo = connect(
            self.comm, np.ascontiguousarray(self.x), order, cell, self.ownership.borders, self.threads
        )
        halo = self.halo
        self.n_left, self.n_own = halo.n_left, len(order)
        n = len(self.x)
        self.number = np.empty(n, np.int64)
        room = aligned((n * v.shape[1] + 8,))  # kernels read four columns at a time
        room[-8:] = 0.0
        self.v = room[:-8].reshape(n, v.shape[1])
        self.closed = True
        self.number[self.owned], self.v[self.owned] = number, v
        halo.fill(self.number)
        halo.fill(self.v)
        if self.options.collision:
            halo.add_ghost_field(self.v)
        self.where[self.number] = np.arange(n)

    def _warn_of_given_stress(self) -> None:
        """A line in the log about elements that cannot bear the stress they were given. Collective."""
        if self.stress0 is not None:
            self._tell_beyond(OUTSIDE, self.stress0_row > 0, "have an initial stress beyond their strength")

    def warn_of_flow(self) -> None:
        """A line in the log about elements that relaxation lets flow before it finds balance, as something has changed
        since they were in balance. Collective."""
        self.close_model()
        if not self.options.dynamic and self.options.mechanical:
            self._tell_beyond(
                MUCH, self.alive, "are beyond their strength where they lie: they flow before balance is found, for "
                "good; model solve elastic before it, or the change in small parts, finds balance first",
            )  # fmt: skip

    def _tell_beyond(self, least: float, of: np.ndarray, what: str) -> None:
        """How many of these elements (ne,) bool are outside their strength by this part of their stress, and which one
        is farthest; once for one state. Collective."""
        if not self.local.yields:
            return
        beyond, stress = self.local.beyond()
        number = self.number[self.owned]
        bad = np.flatnonzero((beyond > least * np.abs(stress).max(axis=1)) & of[number])
        worst = bad[np.lexsort((number[bad], -beyond[bad]))[:1]]
        found = self.comm.allgather((len(bad), [(-beyond[i], int(number[i]), stress[i]) for i in worst]))
        count = sum(part[0] for part in found)
        if self.log is None or not count:
            return
        far, element, stress = min((one for part in found for one in part[1]), key=lambda one: one[:2])
        place = ", ".join(f"{c:.4g}" for c in self.the_mesh().centroids(np.array([element]))[0])
        self.log.warn_once(
            f"beyond strength {count} {element} {far}",
            f"{count} elements {what}; farthest beyond is element {element} at ({place}), by {-far:.4g} Pa: "
            f"{_pascals(stress)}",
        )

    def _warn_of_locking(self) -> None:
        """A line in the log about tetrahedra that hardly change their volume."""
        if self.log is None or self.dim == 2:
            return
        bulk, shear = (np.array(self.element_rows.column(name)) for name in ("bulk", "shear"))
        with np.errstate(divide="ignore", invalid="ignore"):
            nu = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
        of = np.where(self.alive & (self.the_mesh().macro_of() < 0), nu[self.element_row], 0.0)
        if (of > LOCKS).any():
            self.log.warn_once(
                "locking",
                f"{int((of > LOCKS).sum())} tetrahedra have a Poisson's ratio up to {of.max():.3g}: as they have one "
                "strain each they are much too stiff near 0.5 (they lock); hexahedra are not",
            )

    def _warn_of_snap_back(self) -> None:
        """A line in the log about joints so brittle that they are gone within a tenth of their elastic opening."""
        if self.log is None or not len(self.joint_rows) > 1:
            return
        mesh = self.the_mesh()
        faces = np.flatnonzero(self.closed_faces() & (self.joint_row > 0))
        longest = np.zeros(len(self.joint_rows))
        np.maximum.at(longest, self.joint_row[faces], mesh.joint_lengths(faces, self.partner))
        for strength, penalty, energy in (
            ("tensile_strength", "penalty_normal", "gf1"), ("cohesion", "penalty_shear", "gf2"),
        ):  # fmt: skip
            t, p, g = (self.joint_rows.column(name) for name in (strength, penalty, energy))
            rows = np.flatnonzero((longest > 0.0) & (t > 0.0) & (p > 0.0))
            elastic, softening = joint_law.ways(t[rows], p[rows], g[rows], longest[rows])
            brittle = softening < 0.1 * elastic
            if not brittle.any():
                continue
            worst = np.argmin(softening / elastic)
            row = rows[worst]
            where = "a face" if self.dim == 3 else "an edge"
            others = f", and {int(brittle.sum()) - 1} other sets of properties," if brittle.sum() > 1 else ""
            self.log.warn_once(
                f"snap back {row} {energy}",
                f"joints with {strength} {t[row]:g} Pa, {energy} {g[row]:g} N/m{others} break within a tenth of their "
                f"elastic way, {elastic[worst]:.3g} m at {where} of {longest[row]:.3g} m: what the body stores is set "
                "free at once; smaller elements or a higher penalty help",
            )


def _pascals(stress: np.ndarray) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in zip(COMPONENTS[3], stress)) + " Pa"


def _vector(given: Sequence[float]) -> str:
    return f"({', '.join(f'{c:g}' for c in given)})"


def _turn(x: np.ndarray, a: int, b: int, c: int) -> np.ndarray:
    """Twice the area (n,) of the triangles whose corners begin in these columns."""
    ux, uy, wx, wy = x[:, b] - x[:, a], x[:, b + 1] - x[:, a + 1], x[:, c] - x[:, a], x[:, c + 1] - x[:, a + 1]
    return ux * wy - uy * wx
