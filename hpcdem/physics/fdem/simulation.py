"""The simulation of blocks: the phases of the step and of a rebuild, whose order is in `engine/model.py`: forces are
those at the present positions, and elements move with them at once.

An element owns its corners: their positions, velocities, and what the joints on its edges and its contacts remember.
Corners that move as one node (nothing lies between their elements) carry equal copies. So all there is to a model is
rows of elements; they are shared out among the ranks in strips, as particles are, and travel with what they remember.

Every sum over elements that share something is taken in the order of their numbers in the mesh. So the bits depend
neither on ranks and threads nor on when the lists were rebuilt.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from hpcdem.core.errors import PhysicsError
from hpcdem.core.heap import give_back
from hpcdem.core.memory import aligned
from hpcdem.decomp.curve import Grid
from hpcdem.engine.model import FRESH, LISTS, STORAGE
from hpcdem.engine.rebuild import LONGEST_WAIT
from hpcdem.halo.beyond import Beyond
from hpcdem.halo.ownership import Curve, Ownership
from hpcdem.physics.fdem import (
    apart,
    breaks,
    build,
    ghosts,
    guards,
    notices,
    overlaps,
    readiness,
    tetrahedra,
    user_laws,
)
from hpcdem.physics.fdem.edited import Edited
from hpcdem.physics.fdem.histories import Histories
from hpcdem.physics.fdem.kernels import elements, space, tets
from hpcdem.physics.fdem.kernels.strength import HISTORY as STRENGTH_HISTORY
from hpcdem.physics.fdem.local import Evaluation, Local
from hpcdem.physics.fdem.local_space import LocalSpace
from hpcdem.physics.fdem.mesh import Mesh, pieces
from hpcdem.physics.fdem.middles import middles
from hpcdem.physics.fdem.pairs import cut_corner
from hpcdem.physics.fdem.state import NARROW, WIDE, ListState

MARGIN = 0.6
"""Largest sum of displacements of two elements before storage and ghosts are renewed; over the mean edge."""
SHORT_LIVED, LONG_LIVED = 60, 400
"""Lists that lasted fewer steps call for the wide buffer, more steps for the narrow one."""
OLDEST = 2000
"""Age in steps at which storage is renewed even if nothing has moved, so that the borders of the ranks can follow the
load."""
LARGE = 10_000
"""Number of elements of a rank from which the memory of the tables of the last storage is returned to the system."""
OUTSIDE, MUCH = 1e-6, 1e-3
"""Part of its largest component by which a stress must be beyond the strength to be spoken of: one that was given, one
that relaxation begins with."""
LOCKS = 0.45
"""Poisson's ratio above which a notice says that tetrahedra lock."""


class Blocks(Edited):
    """One model of blocks on one communicator. Every method is collective unless it says otherwise.

    Numbers are those of the mesh, from 0, and do not depend on ranks: elements are rows of `mesh.cells`, nodes are rows
    of `mesh.points`, faces are element * 4 + local edge, joints have the number of their lower face. Arguments called
    elements, nodes, faces, joints take an array of numbers, or None for all. What is assigned to a node holds for all
    corners of elements at that point, and stays with them when joints break. Step and rebuild are here; what acts on a
    model are functions: diagnostics, changes between steps, many steps (convergence), equilibrium at once, saved_state.

    CommandError for values that make no sense, equal on all ranks.
    """

    moves_ghosts = True
    _known: dict[str, Any] | None = None

    # ---- mesh ----------------------------------------------------------------------------------------------------

    def take_mesh(self, mesh: Mesh) -> None:
        """Take a mesh (checked here; equal on all ranks). Elements have no model yet, edges no joints: bodies are
        connected as ordinary finite elements. Edges in `mesh.cracks` are open from the beginning."""
        self._take(mesh)
        self._start_with(mesh)

    def take_births(self, born: np.ndarray, places: np.ndarray) -> None:
        """Elements (n,) have come back, their corners at places (n, 4, dim) [m]."""
        super().take_births(born, places)
        self.areas = self.per_node(self.reference.areas)

    def _tables(self) -> type[Local]:
        return LocalSpace if self.dim == 3 else Local

    def corner_masses(self, number: np.ndarray) -> np.ndarray:
        """(n, 4) true masses [kg/m], in space [kg], of the corners of these elements. Not collective."""
        return self._tables().corner_masses(self, number)

    def place_mesh(self, mesh: Mesh) -> None:
        """Set a mesh that was checked already."""
        self._put(mesh)
        self._start_with(mesh)

    def _start_with(self, mesh: Mesh) -> None:
        self.release()
        self.surface_loads.mesh_replaced()
        self.closed = False
        self.rebuild_state = ListState()
        self.ownership = (Curve if mesh.dim == 3 else Ownership)(self.comm, self.balance_on)
        self.event_rows = []
        self._topology_stale = True
        self._longest = 0.0
        self.untouched = True
        self.budget = None
        if mesh.dim == 3:
            self.prepare_kernels("space")
        self.areas, self.mean_edge, self.cut = self.per_node(
            lambda: (mesh.areas(), mesh.mean_edge(), cut_corner(mesh) if mesh.dim == 2 else np.empty(0, np.int64))
        )
        self.number = _first_share(self, mesh)
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

    # ---- one step ------------------------------------------------------------------------------------------------

    def step(self) -> int:
        """Take one step, see `Model.step`; an open model is closed before."""
        if not self.closed:
            self._close()
        self.check_start()
        return super().step() if self.options.mechanical else self._standing_step()

    def _begin_step(self) -> None:
        self.untouched = False
        budget = self.budget if self.options.dynamic else None
        if budget is not None:
            budget.before_forces(self)
        self.local.forces()
        if budget is not None:
            budget.after_forces(self)

    def _move_rows(self, first: int, last: int) -> None:
        drift = (tets if self.dim == 3 else elements).drift.on(self.threads)
        drift(self.threads, self.n_left + first, self.n_left + last, self.x, self.v, self.clock.dt)

    def _moved(self) -> None:
        clock = self.clock
        clock.step += 1
        self.rebuild_state.stored += 1
        if self.options.dynamic:
            clock.time += clock.dt
            if self.creep.on:
                self.creep.passed = clock.dt
                self.creep.time += clock.dt

    def _end_step(self, outdated: int) -> None:
        o, rebuild_state = self.options, self.rebuild_state
        self.surface_loads.follow()
        if o.auto and o.dynamic and self.clock.step - rebuild_state.estimated >= o.auto_every:
            rebuild_state.dt, outdated = 0.0, max(outdated, LISTS)
        accounted = self.budget is not None and o.dynamic
        if outdated == LISTS or (outdated and accounted and self.masses_change()):
            self._renew_lists()
        if outdated == STORAGE:
            self.open_model()

    def _standing_step(self) -> int:
        """A step of everything but the motion: time passes, blocks are at rest."""
        self.clock.step += 1
        self.clock.time += self.clock.dt
        self.surface_loads.follow()
        if self.clock.step % LONGEST_WAIT or self.stop is None:
            return 0
        return int(self.comm.max_into(np.array([self.stop.local_request()], np.int64))[0])

    def check_start(self) -> None:
        """CommandError if a load lacks something, or nothing has moved yet and bodies overlap, unless that was
        requested; the model is closed. Collective."""
        readiness.check_parts(self)
        self.surface_loads.check_start()
        if self.untouched and self.options.mechanical:
            overlaps.check(self, self.local)
            self.beyond = Beyond.nobody(self.comm)
            give_back()  # it looks at all elements, not only at those of the surface

    def _survey(self, places: np.ndarray, out: np.ndarray) -> None:
        """Measure the displacement of the elements of this rank from these positions, and their speed, into out."""
        if self.dim == 3:
            space.survey(self.x, self.v, places, self.n_left, self.n_own, out)
        else:
            cells = self.the_mesh().cells
            build.survey(self.x, self.v, places, self.n_left, self.n_own, cells, self.number, out)

    def _has_sped_up(self) -> bool:
        """A glance between two looks: whether the next one might come too late for the contact lists. Collective."""
        found = np.zeros(4)
        self._survey(self.listed, found)
        self.comm.max_into(found)
        margin = 0.5 * self.rebuild_state.skin - math.sqrt(found[0])
        return self.rebuild_state.is_too_late(margin, math.sqrt(found[1]) * self.clock.dt)

    def _check_rebuild(self, glance: bool = False) -> tuple[int, int]:
        if glance and not (self.options.collision and self._has_sped_up()):
            return FRESH, 0
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
            guards.stop_on_runaway(self, bool(broken), bool(inverted))
        if due and deep > max(overlaps.DEEP, overlaps.AGAIN * rebuild_state.deep):
            rebuild_state.deep = deep
            overlaps.report(self, self.local)
        if slid > apart.FAR:
            apart.check(self, self.local, PhysicsError)
        self.local.tally[:, elements.NEW_YIELDED] = 0
        stale, outdated = breaks > 0.0, rebuild_state.stored >= OLDEST
        wait = float(LONGEST_WAIT // 4 if yields > 0.0 else LONGEST_WAIT)  # a joint may be about to break
        if self.options.collision:
            margin = 0.5 * rebuild_state.skin - math.sqrt(path2)
            rebuild_state.late += margin < 0.0
            # Lists end where the ghosts do, so some of their room is left for the next ones.
            outdated |= 0.5 * (MARGIN - WIDE) * self.mean_edge < math.sqrt(way2) + stride
            stale |= margin < stride
            if stale or outdated:
                margin = 0.5 * rebuild_state.skin
            if stride > 0.0:
                wait = min(wait, 0.5 * margin / stride)
        rebuild_state.wait(wait)
        return STORAGE if outdated else LISTS if stale else FRESH, int(request)

    # ---- forces without a step -------------------------------------------------------------------------------------

    def evaluate(self) -> Evaluation:
        """Forces at the present positions; leaves everything as it is. Collective."""
        self.close_model()
        return self._once("forces", self.local.evaluation)

    @contextmanager
    def one_moment(self) -> Iterator[None]:
        """A context in which the model is only read: forces and the energy budget are computed once for all queries."""
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
            middle, _ = middles(self)
            local = self.local
            longest2 = build.longest_link(
                middle, local.slots, local.slot_face, self.partner, self.where, local.slot_state
            )
            self._longest = math.sqrt(float(self.comm.max_into(np.array([longest2]))[0]))
            self.histories = local.histories(transfer=True)
            breaks.collect(self)
            local.release()
            self.where[self.number] = -1
            self.halo.close()
            own = self.owned
            self.origin = self.listed = np.empty((0, 0))
            self.number, self.x, self.v = self.number[own].copy(), self.x[own].copy(), self.v[own].copy()
            self.closed = False

    def close_model(self) -> None:
        """Make the model ready to step: storage, ghosts and tables at the present positions."""
        if not self.closed:
            self._close()

    def rebuild(self) -> None:
        """Storage and lists again at the present positions, as the step does from time to time."""
        self.open_model()
        self.close_model()

    def _renew_lists(self) -> None:
        """Contact lists at the present positions; joints that broke become free faces. Storage stays."""
        with self.timers("neighbour"):
            self.rebuild_state.skin = self._skin()
            handed_over = self.local.handed_over()
            breaks.collect(self)
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

    def _close(self, frozen: bool = False) -> None:
        readiness.check(self)
        self._remember_all()
        for load in self.surface_loads:
            if load.kernel_kind:
                self.prepare_kernels(load.kernel_kind + ("-space" if self.dim == 3 and not load.of_both else ""))
        notices.warn_of_quick_tables(self)
        user_laws.begin(self)
        user_laws.compile_loops(self)
        stale = self._topology_stale
        super()._close(frozen)
        self.surface_loads.storage_rebuilt()
        if self._state_given:
            self._state_given = False
            notices.warn_of_given_stress(self)
        if stale or len(self.number) > LARGE:
            give_back()

    def _remember_all(self) -> None:
        """Columns of what elements remember, and kernels that work on them."""
        if self.yielding().any():
            self._remember("plastic", self.memory("plastic"))
            if self.softens():
                self._remember("softening", STRENGTH_HISTORY)
        creeps = self.creeping().any()
        if self.creep.on and not creeps and self.log is not None:
            self.log.warn_once("no creep", "creep is on, but no element can creep: assign element c-model mech-burgers")
        if creeps or "creep" in self.cold:
            self._remember("creep", self.memory("creep"))
        for kind, needed in (("yielding", "plastic" in self.cold), ("creep", "creep" in self.cold)):
            if needed:
                self.prepare_kernels(f"{kind}-space" if self.dim == 3 else kind)
                if self.dim == 3 and len(self.the_mesh().hexes):
                    self.prepare_kernels(f"{kind}-hexes")

    def _remember(self, name: str, columns: int) -> None:
        """Owned elements remember so much for each of their triangles. (In files from before quads could yield or
        creep it is that of one.)"""
        known, wanted = self.cold.get(name, np.empty((len(self.number), 0))), columns * self.element_parts
        if known.shape[1] < wanted:
            self.cold[name] = np.pad(known, ((0, 0), (0, wanted - known.shape[1])))

    def _choose_reach(self, frozen: bool) -> np.ndarray:
        rebuild_state = self.rebuild_state
        if self._topology_stale:
            self.renew_topology()
        if rebuild_state.dt == 0.0:
            notices.warn_of_snap_back(self)
            notices.warn_of_locking(self)
        middle, radius = middles(self)
        of_loads = 0.0 if frozen else self.surface_loads.reach(self, middle)
        radius = float(self.comm.max_into(np.array([radius]))[0])
        self.apart_within = self.linked_within = rebuild_state.side
        if not frozen:
            rebuild_state.skin = self._skin()
            margin = MARGIN * self.mean_edge if self.options.collision else 0.0
            self.linked_within = max(self._longest, of_loads, self.spread()) * (1.0 + 1e-9)
            self.apart_within = max(margin * (1.0 + 1e-9), self.linked_within)
            needed = max(2.0 * radius + self.spread(), self._longest, of_loads) * (1.0 + 1e-9) + margin
            if not needed <= rebuild_state.side <= 1.2 * needed:
                rebuild_state.side = 1.05 * needed
        return self.ownership.cells(middle, rebuild_state.side)

    def _share_out(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cell, self.histories, (number, self.x, self.v, *cold) = self._send_home(
            cell, self.histories, [self.number.view(np.float64)[:, None], self.x, self.v, *self.cold.values()],
            cost=self._costs(),
        )  # fmt: skip
        self.number, self.cold = number.view(np.int64)[:, 0], dict(zip(self.cold, cold))
        return cell, self.number

    def _store(self, order: np.ndarray, cell: np.ndarray) -> None:
        self.histories = self.histories.take(order)
        self.cold = {name: values[order] for name, values in self.cold.items()}
        number, v = self.number[order], self.v[order]
        inside = ghosts.inner(self, number)
        sends = self.ownership.sends(cell, 1, ghosts.boxes(self, order, inside))
        self.beyond, sends = ghosts.set_apart(self, number, inside, sends)
        self.x = self._connect(np.ascontiguousarray(self.x), order, sends)
        halo = self.halo
        self.n_left, self.n_own = halo.n_left, len(order)
        n = len(self.x)
        self.number = np.empty(n, np.int64)
        storage = aligned((n * v.shape[1] + 8,))  # kernels read four columns at a time
        storage[-8:] = 0.0
        self.v = storage[:-8].reshape(n, v.shape[1])
        self.closed = True
        self.number[self.owned], self.v[self.owned] = number, v
        halo.fill(self.number)
        halo.fill(self.v)
        halo.add_ghost_field(self.v)
        self.where[self.number] = np.arange(n)

    def _build_lists(self, order: np.ndarray, cell: np.ndarray, frozen: bool) -> None:
        self.local = self._tables()(self)
        if not self.untouched:
            self.beyond = Beyond.nobody(self.comm)  # the first step needs their positions
        if not frozen:
            self.origin = self.places()
            self.listed = self.origin  # until lists are renewed without storage
            self.rebuild_state.age = self.rebuild_state.stored = 0
            self._note_time()

    def renew_topology(self) -> None:
        """Determine again which corners are one node."""
        self._acting = None
        self.share_changes()
        self.node, self.shared_nodes, self.member_begin, self.member, self.point_corners, self.where = self.per_node(
            self._nodes_of_corners
        )
        self._topology_stale = False

    def share_changes(self) -> None:
        """Restore one copy per node of arrays that changed in place, alike on all ranks. Collective."""
        names = ("alive", "touches", "joint_row", "open", "broken", "_closed")
        self.closed_faces()
        for name, array in zip(names, self.per_node(lambda: [getattr(self, one) for one in names])):
            setattr(self, name, array)
        self.opened_apart = 0

    def _nodes_of_corners(self) -> tuple[np.ndarray, ...]:
        return _nodes_of_corners(self.the_mesh(), self.alive, *self._clusters())

    def _costs(self) -> np.ndarray:
        """Relative cost of the owned elements: broken zones cost more."""
        cost = np.ones(len(self.number))
        cost += 0.5 * np.minimum(self.histories.counts(), 12)
        return cost


def _nodes_of_corners(mesh: Mesh, alive: np.ndarray, node: np.ndarray, lead: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the node of each corner; whether each node has several corners, and which (`build.cluster_members`);
    elements at each point; and an empty table for the positions of elements."""
    sizes = np.bincount(node[node >= 0], minlength=len(lead))
    shared, node = sizes > 1, node.astype(np.int32, copy=False)
    begin = np.zeros(len(lead) + 1, np.int32)
    member = np.empty(int(sizes[shared].sum()), np.int32)
    if len(member):  # else zeros that nobody has written to: nothing of them is in the memory
        build.cluster_members(node, sizes, begin, member)
    cells = mesh.cells[alive]
    at_points = np.bincount(cells[cells >= 0], minlength=len(mesh.points))
    # A rank has pages of its own of the table only around the elements that it holds.
    return node, shared, begin, member, at_points, np.full(len(mesh.cells), -1, np.int64)


def _first_share(sim: Blocks, mesh: Mesh) -> np.ndarray:
    """Numbers of the elements that a rank holds at first, ascending; in space near what it will own, so that few change
    ranks when the model is closed. Collective."""
    n, size, rank = len(mesh.cells), sim.comm.size, sim.comm.rank
    first, last = n * rank // size, n * (rank + 1) // size
    if mesh.dim == 2 or size == 1:
        return np.arange(first, last)
    return np.sort(sim.per_node(lambda: _along_curve(mesh, sim.mean_edge))[first:last])


def _along_curve(mesh: Mesh, side: float) -> np.ndarray:
    """Elements (ne,) in the order of cells of this side [m] along a space-filling curve."""
    grid, keys = (
        Grid.around(mesh.points.min(axis=0), mesh.points.max(axis=0), side),
        np.empty(len(mesh.cells), np.int64),
    )
    for at in pieces(len(keys)):
        keys[at] = grid.keys(mesh.points[mesh.cells[at]].mean(axis=1))
    return np.argsort(keys, kind="stable")
