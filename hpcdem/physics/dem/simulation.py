"""The simulation: state, one step, and the rebuild of the contact lists. The page on which the method can be read.

State is either *closed* (sorted, ghosts in place, lists built: ready to step) or *open* (owned particles and their
contact histories only: free to be added to or thinned out). Commands that change who is there open it; the next cycle
closes it again. Everything that decides the order of arithmetic comes from global values and is part of the state:
see `ListState`.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.cells import columns, keys
from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.fields import CLUMP, FIELDS, FX, GID, RADIUS, TORQUE, WIDTH, X, Y
from hpcdem.core.memory import aligned, take_rows
from hpcdem.decomp import strips
from hpcdem.engine.model import Model
from hpcdem.engine.rebuild import LONGEST_WAIT, RebuildState
from hpcdem.halo.exchange import connect
from hpcdem.halo.migrate import Migration, Trail
from hpcdem.physics.dem import guards, missed
from hpcdem.physics.dem.clumps import Clumps
from hpcdem.physics.dem.kernels import contacts, fast, mass, motion, neighbours, pair_forces, slips
from hpcdem.physics.dem.kernels import walls as wall_kernels
from hpcdem.physics.dem.kernels.fast import Fast
from hpcdem.physics.dem.kernels.neighbours import NO_ROWS, Histories
from hpcdem.physics.dem.materials import BOND_TYPE, MATERIAL, PropertyTable
from hpcdem.physics.dem.particles import Particles
from hpcdem.physics.dem.settings import Settings
from hpcdem.physics.dem.user_laws import ModelLaws
from hpcdem.physics.dem.walls import Walls
from hpcdem.runtime.run_folder import Retention

NARROW, WIDE = 0.3, 0.6
"""Skin over the largest radius, at rest and in fast motion."""
SHORT_LIVED, LONG_LIVED = 60, 200
"""Lists that lasted fewer steps call for the wide skin, more steps for the narrow one."""
EVERYWHERE = (-math.inf, math.inf, -math.inf, math.inf)


@dataclass
class ListState(RebuildState):
    """Skin over the largest radius; longest bond [m] as last seen; columns that partners may lie apart."""

    skin_factor: float = NARROW
    bond_reach: float = 0.0
    columns: int = 1


@dataclass
class Watcher:
    """Somebody who wants to look at the model, and perhaps to act on it, at the steps that are multiples of `every`.

    call: returns True to end the running CYC or IMPLE.
    """

    every: int
    call: Callable[[], object]


class ParticlePhysics(Protocol):
    """Physics on particles beside their motion, as the step sees them (physics/particle_physics.py).

    fields: unit, meaning and initial value by name; energies: the diagnostics [J] that are columns of energy.csv.
    """

    name: ClassVar[str]
    fields: ClassVar[Mapping[str, tuple[str, str, float]]]
    energies: ClassVar[tuple[str, ...]]

    def parameters(self) -> dict[str, float]:
        """What it was made with, for checkpoints."""

    def diagnostics(self) -> Mapping[str, tuple[str, Callable[[Simulation], float]]]:
        """What HIST can follow: unit and function of the simulation (collective) by name."""

    def prepare(self, sim: Simulation) -> None:
        """Lists, masses or settings are others. Collective."""

    def stable_time_step(self, sim: Simulation) -> float:
        """The largest time step [s] it can bear with the present contacts. The model is closed. Collective."""

    def advance(self, sim: Simulation) -> None:
        """One step, after the forces at the new positions; ghosts have the values of its beginning. Not collective."""

    @staticmethod
    def warm_up(threads: int) -> None:
        """Call every kernel once."""


class Simulation(Model):
    """One model of particles on one communicator, see `Model`.

    watchers: see `Watcher`; resume_advice: what the user is told to use after a stop with a checkpoint;
    draws: DRAW makes pictures; lost: particles that left the BOX so far; rows: first id of each row of GLINE and the
    one after its last; physics: on the particles, beside their motion, in the order in which they act; fast: particles
    with a reach of their own in the lists (physics/dem/kernels/fast.py); energy: the account of SET energy
    (budget.Budget), or None.
    """

    def __init__(
        self,
        comm: Comm | None = None,
        threads: int = 1,
        outdir: Path | str = "data",
        log: Any = None,
        stop: Any = None,
        balance_on: bool = True,
    ) -> None:
        super().__init__(comm, threads, outdir, log, stop, balance_on)
        self.folder_made = False
        self.job: Any = None  # runtime.run_folder.Job: what was started
        self.resumed = False  # goes on from a checkpoint that lies where it writes
        self.restored: tuple[Path, int] | None = None  # the checkpoint that the script named, and its step
        self.keep = Retention()
        self.watchers: list[Watcher] = []
        self.number = 0  # of the simulations of a program, in the order in which they were made
        self.pace: Any = None  # runtime.pace.Pace: chooses the threads; None: nobody does
        self.coupled = False  # to blocks, which step them both (physics/coupling)
        self.resume_advice = "--resume"
        self.draws = False
        self.script = ""
        self.position = 0
        self.line = 0
        self.clear()

    def clear(self) -> None:
        """Start a new model: no particles, no walls, default settings, step 0."""
        self.restart()
        self.settings = Settings()
        self.particles = Particles()
        self.physics: list[ParticlePhysics] = []
        self.materials = PropertyTable(MATERIAL)
        self.bond_types = PropertyTable(BOND_TYPE)
        self.walls = Walls()
        self.clumps = Clumps()
        self.groups: list[str] = ["***"]
        self.next_gid = 0
        self.makers: list[tuple[int, int]] = []  # particles from this id on were made in this line of the script
        self.streams = 0
        self.breaks = np.zeros(2, np.int64)
        self.bonds = 0
        self.bonds_looked_at: tuple[float, ...] = ()  # state of the last look for bonds of two shear stiffnesses
        self.step_limit = math.inf  # the lowest estimate of the critical time step that was told
        self.told_share = 0.0  # the largest part of the stability limit that the log told of
        self.next_watch = 0  # the step from which on it is looked at again
        self.lost = 0
        self.rows: list[tuple[int, int]] = []
        self._named: set[int] = set()
        self.energy: Any = None
        self.dashpots: Any = None  # restitution.Dashpots, while SET restitution is below 1
        self.own_laws = ModelLaws()  # of the user; materials say which discs have them
        self.own_table: np.ndarray | None = None
        self.stamp = 1  # evaluations of forces, for the memory of these laws
        self.history_wishes: dict[int, tuple[int, str]] = {}
        self.history_origins: dict[int, tuple[int, float]] = {}  # axis and distance of strains
        self.plots: list[tuple[int, int]] = []
        self.drawing: tuple[int, tuple[str, ...]] | None = None
        self.progress: dict | None = None
        self.last_frame: tuple[int, bool] | None = None
        self.edited = True  # by a command, since the last `_ini` frame of a coupled run
        self.series_open: set[str] = set()
        self.series_closed: set[str] = set()
        self.restart_step = 0
        self.rebuild_state = ListState()
        self.fast = Fast.none()
        self._fast_rows, self._fast_at = self.fast.among(NO_ROWS)
        self._drift: np.ndarray | None = None
        self._hist: Histories | None = Histories.empty(0)
        self._lists: neighbours.ContactLists | None = None
        self.trail = Trail()
        self.origin = np.empty((0, 2))
        self._longest2 = 0.0
        self._tables_stale = True
        self._pushed, self._push = np.empty(0, np.int64), np.empty((0, 2))

    # ---- one step ------------------------------------------------------------------------------------------------

    def step(self) -> int:
        """Advance everything by one dt. The same text on one rank and on a thousand.

        Returns what the outside asked for (0 nothing, 1 save, 2 save and stop), agreed by all ranks.
        """
        timers, halo, request = self.timers, self.halo, 0
        if self.energy is not None:
            self.energy.before_move(self)
        with timers("move"):
            if self.clumps:
                self._move_with_clumps()
            else:
                for first, last in halo.border:
                    self._move(self.lists.n_blocks, first, last, *self._move_args)
                halo.start()
                self._move(self.lists.n_blocks, *halo.inside, *self._move_args)
            if self._walls_move:
                self.walls.move(self.clock.dt)
        self.rebuild_state.age += 1
        stale, look = False, self.rebuild_state.passed()
        if look or self.rebuild_state.glances():
            with timers("reduce"):
                stale, request = self._check_rebuild(glance=not look)
        with timers("halo"):
            halo.finish()
        if stale:
            if self.energy is not None:
                self.energy.before_rebuild(self)
            self.rebuild()
        if self.energy is not None:
            self.energy.before_forces(self)
        with timers("force"):
            self._forces()
        if self.energy is not None:
            self.energy.after_forces(self)
        for physics in self.physics:
            with timers(physics.name):
                physics.advance(self)
        self.clock.tick()
        return request

    def _move_with_clumps(self) -> None:
        """Particles, then clumps with their members: these overwrite what the loop made of members."""
        s = self.settings
        self._move(self.lists.n_blocks, 0, self.particles.n_own, *self._move_args)
        self.clumps.move(self.particles, self.lists, s.gx, s.gy, s.lsm, self.clock.dt)
        self.halo.start()

    def _forces(self) -> None:
        """Contact, bond and wall forces at the present positions."""
        lists = self.lists
        if not self.own_laws:
            self._pair_forces(lists.n_blocks, *self._pair_args)
        else:
            self.stamp += 1
            self._pair_forces(lists.n_blocks, *self._pair_args, float(self.stamp))
        if len(lists.slot_row):
            self._wall_table[:, 0:2], self._wall_table[:, 2:4] = self.walls.p1, self.walls.p2
            self._wall_forces(lists.n_blocks, *self._wall_args)
        if self.dashpots is not None:
            self.dashpots.push(self)
        if len(self._pushed):
            lists.force[self._pushed, :2] += self._push
        if self.clumps:
            self.clumps.sum_forces(self.particles, self.halo, lists)

    def _check_rebuild(self, glance: bool = False) -> tuple[bool, int]:
        """How far has anyone gone since the lists were built? Sets the step of the next look. glance: between two
        looks; it becomes one if somebody has sped up so much that the next might come too late, else nothing changes.

        Returns (lists must be rebuilt now, request from outside). One reduction; only global maxima enter.
        """
        rebuild_state, dt = self.rebuild_state, self.clock.dt
        found = np.zeros(9)
        p = self.particles
        # Half of the room, in case things speed up; gravity counted twice; and never more than twice the last wait.
        fall = 2.0 * math.hypot(self.settings.gx, self.settings.gy) * dt * dt
        motion.survey(p.hot, p.n_left, p.n_own, self.origin, dt, self._fast_rows, found[:4])
        found[4] = self.stop.local_request() if self.stop is not None else 0
        self._look_at_fast(fall, found[5:])
        self.comm.max_into(found)
        broken = bool(found[motion.BROKEN] or found[5 + fast.FAST_BROKEN])
        if broken or max(found[motion.STRIDE], found[5 + fast.FAST_STRIDE]) > guards.LARGEST_STRIDE:
            alone = self._fast_rows[self.fast.alone[self._fast_at]]
            guards.stop_on_runaway(p, self.origin, dt, self.clock.step, broken, self._mixed_laws(), self.comm, alone)
        path = max(math.sqrt(found[motion.PATH2]), self.walls.longest_travel())
        stride = max(math.sqrt(found[motion.SPEED2]), self._wall_speed()) * dt
        room = 0.5 * rebuild_state.skin - path
        if glance and not rebuild_state.is_too_late(room, stride) and found[5 + fast.DUE] == 0.0:
            hurry = found[5 + fast.HURRY]  # half the room over the stride, of the fast ones
            if hurry == 0.0 or not rebuild_state.is_too_late(2.0 / hurry, 1.0):
                return False, 0
        if (room < 0.0 and self.largest_radius > 0.0) or found[5 + fast.DUE] == fast.LATE:
            with self.timers("neighbour"):
                missed.stop_on_missed(self)
        stale = room < stride or found[5 + fast.DUE] > 0.0
        if stale:
            room = 0.5 * rebuild_state.skin
        hurry = 0.0 if stale else found[5 + fast.HURRY]
        rebuild_state.wait(fast.wait(room, stride, fall), 1.0 / hurry if hurry > 0.0 else math.inf)
        return stale, int(found[4])

    def _look_at_fast(self, fall: float, found: np.ndarray) -> None:
        """What fast.survey says of the owned ones into found (4,)."""
        if not len(self._fast_rows):
            return
        p, at = self.particles, self._fast_at
        fast.survey(
            p.hot, p.n_left, self.origin, self._fast_rows, self.fast.reach[at], self.fast.alone[at], self.clock.dt,
            fall, (None if self.clumps else self.walls.box()) or EVERYWHERE, found,
        )  # fmt: skip

    def _wall_speed(self) -> float:
        """Speed of the fastest wall [m/s]."""
        return float(np.hypot(self.walls.v[:, 0], self.walls.v[:, 1]).max()) if len(self.walls) else 0.0

    def check_soon(self) -> None:
        """Speeds or the time step were changed by a command: look at the motion at the next step."""
        self.rebuild_state.soon()

    def add_physics(self, physics: ParticlePhysics) -> None:
        """Take physics that act on the particles beside their motion. CommandError if the model has physics of this
        name, or fields of these names."""
        known = {*FIELDS, *self.particles.extra}
        taken = [name for name in physics.fields if name in known]
        if taken or any(physics.name == other.name for other in self.physics):
            raise CommandError(f"the model has {f'a field {taken[0]}' if taken else physics.name} already")
        self.open()
        self.particles.extend(physics.fields)
        self.physics.append(physics)
        self.tables_changed()

    # ---- open and closed -----------------------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        """Whether the lists are built and the ghosts in place."""
        return self._lists is not None

    @property
    def lists(self) -> neighbours.ContactLists:
        """The contact lists of a closed model."""
        assert self._lists is not None, "the model is open: there are no lists"
        return self._lists

    @property
    def hist(self) -> Histories:
        """The contact histories of an open model, one entry list per owned particle."""
        assert self._hist is not None, "the model is closed: histories are in the lists"
        return self._hist

    @hist.setter
    def hist(self, histories: Histories) -> None:
        self._hist = histories

    # ---- lists, ghosts, ownership --------------------------------------------------------------------------------

    def rebuild(self) -> None:
        """New ownership, order, ghosts and lists at the present positions. Forces are not kept."""
        with self.timers("neighbour"):
            p, age = self.particles, self.rebuild_state.age
            if 0 < age < fast.FLEETING or (age and len(self.fast)):
                self._drift = fast.drift(p.hot, p.n_left, p.n_own, self.origin, age)
            self._open_lists()
        self._close()
        for physics in self.physics:
            limit = physics.stable_time_step(self)
            if self.clock.dt > limit:
                raise PhysicsError(
                    f"step {self.clock.step}: the time step {self.clock.dt:g} s is beyond the stability limit of "
                    f"{physics.name}, {limit:g} s: particles touch more neighbours than at the start"
                )

    def open(self) -> None:
        """Make the model free to be changed: owned particles, their histories and forces only."""
        if not self.closed:
            return
        self.particles.cold[:, FX : TORQUE + 1] = self.lists.owned_forces()
        self._open_lists()

    def _open_lists(self) -> None:
        p = self.particles
        self._name_slipped()
        self._harvest()
        self._longest2 = self.lists.longest_bond2()
        self._hist = self.lists.histories(p.ihot, float(self.stamp))
        self.halo.close()
        p.set_owned(p.hot[p.owned], p.cold, self.clumps.rows(p), p.more[p.owned])
        self.clumps.open()
        self._lists = None

    def _name_slipped(self) -> None:
        """A line in the log for particles that have slipped through a row of GLINE or a wall, each once. Collective."""
        p, walls = self.particles, self.walls
        mine = walls.side == 0
        if not self.rows and not mine.any():
            return
        origin = np.empty((len(p.hot), 2))
        origin[p.owned] = self.origin
        chain = None
        if self.rows:
            self.halo.fill(origin)
            chain = slips.neighbours_in_rows(
                p.ihot[:, GID], p.hot[:, [X, Y]], origin, self.rows, self.rebuild_state.side
            )
            self.halo.fill(chain)
        ways = np.where(mine[:, None], walls.travel, np.nan)
        kinds = slips.found(self.lists, p.hot, origin, chain, np.hstack([walls.p1, walls.p2]), ways)
        if not self.comm.any(bool(kinds.any())):
            return
        for kind, what in ((slips.ROW, "a row of GLINE"), (slips.WALL, "a wall")):
            which = kinds == kind
            which[which] = ~np.isin(p["gid"][which], list(self._named))
            gids = np.concatenate(self.comm.allgather(p["gid"][which].copy())).tolist()
            if gids:
                self._named.update(gids)
                names = guards.places(p, which, self.comm)
                more = f"; and {len(gids) - guards.NAMED} more" if len(gids) > guards.NAMED else ""
                if self.log is not None:
                    self.log.warn(
                        f"step {self.clock.step}: {len(gids)} particles slipped through {what}: {names}{more}"
                    )

    def _harvest(self) -> None:
        """Take over what the force loops counted."""
        self.breaks += self.uncollected_breaks()
        self.lists.tally[:, [contacts.TENSION_BREAKS, contacts.SHEAR_BREAKS]] = 0.0

    def close(self, least_skin: float = 0.0) -> None:
        """Make the model ready to step: lists and ghosts at the present positions, stored forces in place.

        least_skin [m]: pairs up to this gap will be in the lists, if the model was open.
        """
        if not self.closed:
            self._close(least_skin=least_skin)
            self.lists.set_owned_forces(self.particles.cold[:, FX : TORQUE + 1])
            if self.clumps:
                self.clumps.sum_forces(self.particles, self.halo, self.lists)
        self.refresh_tables()
        self.halo.refresh()

    def _close(self, frozen: bool = False, least_skin: float = 0.0) -> None:
        """From open to closed. frozen: keep the rebuild_state as it is (restart); least_skin [m]: bond search."""
        with self.timers("neighbour"):
            box = self.walls.box()
            outside = self._choose_reach(frozen, least_skin, box)
            if outside and box is not None:
                self._drop_outside(box)
        self.hist = self.hist.resized(self.own_laws.memory)
        cell = self._share_out()
        p, rebuild_state, borders = self.particles, self.rebuild_state, self.ownership.borders
        if self.pace is not None and self.own_laws.loops is None:  # laws of users are compiled for one number
            self.threads = self.pace.choose(p.n_own, self.timers, self.clock.step)
        with self.timers("neighbour"):
            order = strips.global_order(cell, p["gid"])
            cell = cell[order]
        with self.timers("halo"):
            storage, self.halo = connect(self.comm, p.hot, order, cell, borders, self.threads, rebuild_state.columns)
            rigid = self.clumps.storage(p, order, self.halo, self.threads)
            clump = None if rigid is None else rigid.view(np.int64)[:, CLUMP].copy()
            more = self.halo.storage(p.more[order]) if p.extra else np.empty((len(storage), 0))
        with self.timers("neighbour"):
            halo, hist = self.halo, self.hist
            cold = take_rows(p.cold, order, aligned((len(order), WIDTH)), self.threads)
            p.place(storage, cold, halo.n_left, rigid, more)
            left, right = storage[: halo.n_left], storage[halo.n_left + p.n_own :]
            cell = np.concatenate([keys(left, rebuild_state.side), cell, keys(right, rebuild_state.side)])
            self.origin = p.positions()
            self.walls.travel[:] = 0.0
            self._wall_table = self.walls.table()
            bond_reach = min(rebuild_state.side, rebuild_state.bond_reach + rebuild_state.skin) if self.bonds else 0.0
            self._lists = neighbours.build(
                storage, cell, p.n_left, p.n_own, hist, order, self._wall_table, rebuild_state.side,
                self.largest_radius, rebuild_state.skin, bond_reach, self.threads, clump, self.fast,
                rebuild_state.columns,
            )  # fmt: skip
            self._fast_rows, self._fast_at = self.fast.among(p["gid"])
            self.clumps.close(p, halo, self._lists, self.clock.step, rebuild_state.side)
            self._hist = None
            rebuild_state.age = 0
            self.rebuilds += 1
            self._tables_stale = True
            self.refresh_tables()
            self._count_bonds(hist)  # last: what is wrong is still written as a frame

    def _count_bonds(self, hist: Histories) -> None:
        """Every bond must have found its place in the new lists (a bond is remembered by both its ends)."""
        if self.bonds == 0:
            return
        found = np.array([hist.bonded(), self.lists.bonds_placed], np.int64)
        self.comm.sum_into(found)
        if found[0] != 2 * found[1]:
            raise PhysicsError(
                f"step {self.clock.step}: {found[0] // 2 - found[1]} bonds were lost when the lists were rebuilt; "
                f"longest bond {self.rebuild_state.bond_reach:g} m, column {self.rebuild_state.side:g} m. Particles "
                "move too far in a step: the time step is probably too large"
            )
        self.bonds = int(found[1])

    def _choose_reach(self, frozen: bool, least_skin: float, box: tuple[float, float, float, float] | None) -> bool:
        """Skin and cell side for the next lists, from global values only.

        Returns whether a particle is outside the box (left, right, bottom, top) [m]: it rides on the same reduction.
        """
        rebuild_state, p = self.rebuild_state, self.particles
        seen = np.array([0.0, self._longest2, 0.0])
        seen[0], seen[2] = neighbours.gauge(p.hot, p.n_left, p.n_own, box if box is not None else EVERYWHERE)
        if self.clumps and box is not None:
            seen[2] = guards.outside(*self.clumps.centres(p), box).any()
        self.comm.max_into(seen)
        self.largest_radius, outside = float(seen[0]), bool(seen[2])
        if frozen:
            return outside
        rebuild_state.bond_reach = math.sqrt(seen[1])
        limit = 0.5 * NARROW * self.largest_radius / fast.LIFE
        first_class = self._first_fast_class(limit)
        if first_class is not None:
            rebuild_state.skin_factor = NARROW if fast.LIFE / 2**first_class >= SHORT_LIVED else WIDE
        else:
            rebuild_state.adapt_skin(NARROW, WIDE, SHORT_LIVED, LONG_LIVED)
        rebuild_state.skin = max(rebuild_state.skin_factor * self.largest_radius, least_skin)
        side = 2.0 * self.largest_radius + rebuild_state.skin
        while 0.0 < side < max(rebuild_state.bond_reach + rebuild_state.skin, 1.000001 * self.clumps.reach):
            side *= 1.05  # in steps, so that the rebuild_state seldom changes
        rebuild_state.side = side if side > 0.0 else 1.0
        self._choose_fast(first_class, limit)
        return outside

    def _first_fast_class(self, limit: float) -> int | None:
        """The class of speed (fast.classes) from which on particles get a reach of their own; None: nobody does.
        limit [m]: way per step from which on one is faster than lists of usual skin can bear."""
        if self._drift is None:
            return None
        p, dt = self.particles, self.clock.dt
        before, _ = self.fast.among(p["gid"])  # who was fast remains so till it is slow in both respects
        self._drift[before] = np.maximum(self._drift[before], fast.strides(p.hot[before], dt))
        _, classes = fast.classes(self._drift, limit)
        counts = np.append(np.bincount(classes, minlength=fast.CLASSES), len(p))
        self.comm.sum_into(counts)
        return fast.slowest_class(counts[:-1], int(counts[-1]), self._wall_speed() * dt, limit)

    def _choose_fast(self, first_class: int | None, limit: float) -> None:
        """Reach of the fast particles, and how many columns it spans; arguments as in `_first_fast_class`."""
        rebuild_state, p, dt = self.rebuild_state, self.particles, self.clock.dt
        before, drift = len(self.fast), self._drift
        self.fast, rebuild_state.columns, self._drift = Fast.none(), 1, None
        if drift is None or first_class is None:
            if before:
                self.check_soon()
            return
        which, classes = fast.classes(drift, limit)
        which = which[classes >= first_class]
        hot = p.hot[which]
        way = np.maximum(drift[which], fast.strides(hot, dt))
        rows = np.column_stack([hot[:, X], hot[:, Y], hot[:, RADIUS], way])
        parts = self.comm.allgather((p["gid"][which], p.clump[which], rows))
        gid, clump, rows = (np.concatenate([part[k] for part in parts]) for k in range(3))
        order = np.argsort(gid)
        gid, clump, rows = gid[order], clump[order], rows[order]
        half, gravity = 0.5 * rebuild_state.skin, math.hypot(self.settings.gx, self.settings.gy)
        most = fast.NEARLY * (0.5 * fast.MOST_COLUMNS * rebuild_state.side - self.largest_radius)
        wanted = fast.wanted_reach(rows[:, 3], gravity, dt)
        asked = np.argsort(-rows[:, 3], kind="stable")[: fast.ASKED]
        # Nothing is known here of the faces of blocks: beside them nobody is alone.
        asked = asked[(wanted[asked] > most) & (not self.coupled)]
        slow, gaps = np.ones(len(p), bool), np.empty(len(asked))
        slow[which] = False
        fast.nearest(p.hot, slow, rows[asked, :2], gaps)
        self.comm.min_into(gaps)
        walls = np.hstack([self.walls.p1, self.walls.p2])
        free = fast.free_way(asked, gaps, rows[:, :3], clump, walls, half)
        reach = np.clip(wanted, half, max(half, most))
        alone = free >= reach
        widest = float(reach[~alone].max(initial=half))
        rebuild_state.columns = max(1, math.ceil(2.0 * (self.largest_radius + widest) / rebuild_state.side))
        self.fast = Fast(gid, np.where(alone, free, reach), alone)
        room = np.append(self.fast.reach, half)
        pace = np.append(rows[:, 3], limit * 2.0**first_class)
        fall = 2.0 * gravity * dt * dt
        wait = min(fast.wait(float(r), float(s), fall) for r, s in zip(room, pace, strict=True))
        rebuild_state.pace = rebuild_state.countdown = max(
            1, min(rebuild_state.countdown, int(min(wait, LONGEST_WAIT)))
        )

    def _drop_outside(self, box: tuple[float, float, float, float]) -> None:
        """Particles whose centre, or that of their clump, has left the BOX are deleted, with a line in the log;
        PhysicsError if they ran away, which the next look would no longer see. Collective."""
        gone = guards.outside(*self.clumps.centres(self.particles), box)
        self._refuse_runaways(gone)
        names = guards.places(self.particles, gone, self.comm)
        number = self.remove(gone)
        self.lost += number
        if self.log is not None:
            more = f"; and {number - guards.NAMED} more" if number > guards.NAMED else ""
            self.log.info(f"step {self.clock.step}: {number} particles left the BOX and were deleted: {names}{more}")

    def _refuse_runaways(self, which: np.ndarray) -> None:
        """PhysicsError if one of the flagged owned particles (n_own,) bool of an open model is not finite, or goes too
        far in a step. Collective."""
        p, found = self.particles, np.zeros(4)
        places, hot = p.positions()[which], p.hot[p.owned][which]
        motion.survey(hot, 0, len(hot), places, self.clock.dt, NO_ROWS, found)
        self.comm.max_into(found)
        if found[motion.BROKEN] or found[motion.STRIDE] > guards.LARGEST_STRIDE:
            broken = bool(found[motion.BROKEN])
            guards.stop_on_runaway(
                p, p.positions(), self.clock.dt, self.clock.step, broken, self._mixed_laws(), self.comm, NO_ROWS
            )

    def _mixed_laws(self) -> bool:
        """Whether there are pairs of materials without a common law."""
        return bool(np.isnan(self.own_laws.which(self.materials.rows)).any())

    def remove(self, which: np.ndarray) -> int:
        """Delete the flagged owned particles (n_own,) bool, clumps as a whole, and all memory of them. The model must
        be open. Collective.

        Returns how many went, over all ranks.
        """
        gone = np.concatenate(self.comm.allgather(self.particles["gid"][which].copy()))
        if not len(gone):
            return 0
        first_members = which & (self.particles.clump == self.particles["gid"])
        clumps_gone = self.count(int(first_members.sum())) if self.clumps else 0
        self.hist = self.hist.take(np.flatnonzero(~which))
        self.hist = self.hist.keep(~np.isin(self.hist.partner, gone))
        self.particles.keep(~which)
        self.clumps.forget(clumps_gone, self.particles)
        self.ownership.wanted = True
        return len(gone)

    def _share_out(self) -> np.ndarray:
        """Move borders if it pays, then send every particle and its histories to the owner of its column.

        Returns the cells of the particles that are owned now (n_own,) i8.
        """
        p, side = self.particles, self.rebuild_state.side
        with self.timers("neighbour"):
            cell = keys(p.hot, side)
        with self.timers("balance"):
            box = self.walls.box()
            room = None if box is None else (box[0], box[1])
            self.ownership.renew(
                columns(cell), side, self.clock.step, self.timers.seconds(), room, least=self.rebuild_state.columns
            )
        with self.timers("migrate"):
            leave = strips.strays(cell, self.ownership.borders, self.comm.rank)
            migration = Migration(self.comm, len(p), leave, self.ownership.owner_of(columns(cell[leave])))
            leave = migration.leave
            self.trail.note(p["gid"][leave], migration.leave_to)
            hist = self.hist.take(leave)
            rows = [p.hot[leave], p.cold[leave], p.more[leave]] + ([p.rigid[leave]] if p.rigid is not None else [])
            arrived, counts, entries = migration.exchange(np.hstack(rows), hist.counts(), hist.rows)
            if not len(leave) and not len(arrived):
                return cell
            stay = migration.stay()
            self.hist = self.hist.take(stay).joined(counts, entries)
            hot, cold = (aligned((len(stay) + len(arrived), WIDTH)) for _ in range(2))
            take_rows(p.hot, stay, hot[: len(stay)], self.threads)
            take_rows(p.cold, stay, cold[: len(stay)], self.threads)
            hot[len(stay) :], cold[len(stay) :] = arrived[:, :WIDTH], arrived[:, WIDTH : 2 * WIDTH]
            end = 2 * WIDTH + len(p.extra)
            more = np.concatenate([p.more[stay], arrived[:, 2 * WIDTH : end]])
            rigid = None if p.rigid is None else np.concatenate([p.rigid[stay], arrived[:, end:]])
            p.set_owned(hot, cold, rigid, more)
            return np.concatenate([cell[stay], keys(arrived, side)])

    def broken(self) -> tuple[int, int]:
        """Bonds broken so far in tension and in shear. Collective."""
        total = self.breaks.copy()
        if self.closed:
            total += self.uncollected_breaks()
        self.comm.sum_into(total)
        return int(total[0]), int(total[1])

    def uncollected_breaks(self) -> np.ndarray:
        """Breaks counted by the force loops of this rank since the lists were built (tension, shear)."""
        return self.lists.tally[:, [contacts.TENSION_BREAKS, contacts.SHEAR_BREAKS]].sum(axis=0).astype(np.int64)

    def bonds_left(self) -> int:
        """Bonds that hold. Collective."""
        if not self.closed:
            return self.bonds
        return self.bonds - int(self.comm.sum_into(self.uncollected_breaks().sum(keepdims=True))[0])

    # ---- tables and parameters of the kernels --------------------------------------------------------------------

    def tables_changed(self) -> None:
        """Materials, bond types, walls or the mass rule were changed by a command."""
        self._tables_stale = True

    def refresh_tables(self) -> None:
        """Masses, law tables and argument lists of the kernels, from materials, walls and settings."""
        if not self._tables_stale or not self.closed:
            return
        p, s, lists = self.particles, self.settings, self.lists
        rows, n_mat = self.materials.rows, len(self.materials)
        dt, b = self.clock.dt, lists.blocks
        self.body = aligned((p.n_own, 8))
        motion.fill_body(
            p.hot, p.ihot, p.icold, p.n_left, rows["density"].copy(), rows["damp"].copy(), mass.shape(s.disk), dt,
            self.body,
        )  # fmt: skip
        if self.clumps:
            self.clumps.fill(p, rows["density"].copy(), rows["damp"].copy(), dt, self.body)
        self.own_table, bounds = self.own_laws.tables(rows) if self.own_laws else (None, None)
        self.pair_laws = contacts.pair_table(rows, self.own_laws.which(rows), bounds)
        self.wall_laws = wall_kernels.wall_table(rows, self.walls.kn, self.walls.ks, self.walls.fric)
        self.bond_laws = contacts.bond_laws(self.bond_types.rows)
        self._pushed, self._push = self._pressures()
        self._wall_table = self.walls.table()
        self._walls_move = bool(self.walls.v.any())
        threaded = lists.n_blocks > 1
        self._move: Any = motion.move_threaded if threaded else motion.move
        self._pair_forces: Any = pair_forces.forces_threaded if threaded else pair_forces.forces
        self._wall_forces = wall_kernels.forces_threaded if threaded else wall_kernels.forces
        self._move_args = (
            p.hot, p.cold, p.n_left, b.cut, b.lo, b.foff, lists.force, self.body, s.gx, s.gy, s.lsm, dt,
        )  # fmt: skip
        self._pair_args: tuple[Any, ...] = (
            p.hot, p.ihot, *b, lists.ptr, lists.row, lists.partner, lists.fs, lists.bond, lists.u_made, lists.force,
            self.pair_laws, contacts.bond_table(self.bond_laws), n_mat, dt, mass.SPHERES[s.disk], lists.tally,
        )  # fmt: skip
        if self.own_laws.loops is not None:
            self._pair_forces = self.own_laws.loops.several if threaded else self.own_laws.loops.one
            self._pair_args += self.own_table, lists.memory, self.own_laws.initial
        self._wall_args = (
            p.hot, p.ihot, b.lo, b.foff, lists.force, lists.wptr, self._wall_table, lists.slot_row, lists.slot_wall,
            lists.slot_fs, lists.slot_side, lists.new_side, self.wall_laws, n_mat, dt,
        )  # fmt: skip
        self._tables_stale = False
        self.dashpots = None
        if s.restitution < 1.0:
            self.prepare_kernels("restitution")
            from hpcdem.physics.dem.restitution import Dashpots  # brings kernels of their own

            self.dashpots = Dashpots(self)
        for physics in self.physics:
            physics.prepare(self)

    def pressed(self) -> np.ndarray:
        """Forces (n_own, 2) [N] of PROP xp, yp on the owned particles: pressure 2 R thickness."""
        p, rows = self.particles, self.materials.rows
        force = np.stack([rows["xp"], rows["yp"]], axis=1)[p["material"]]
        return force * (2.0 * p["radius"] * self.settings.thickness)[:, None]

    def _pressures(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the force table that PROP xp, yp push on, and their forces (n, 2) [N]. They are few, the particles of
        a side of the model, and usually none."""
        rows = self.materials.rows
        if not (rows["xp"].any() or rows["yp"].any()):
            return np.empty(0, np.int64), np.empty((0, 2))
        force = self.pressed()
        which = np.flatnonzero(force.any(axis=1))
        return self.lists.force_rows()[which], force[which]

    def used(self, column: np.ndarray, table: PropertyTable) -> np.ndarray:
        """Which rows of a property table occur among these owned row numbers, on any rank; (rows,) bool. Collective."""
        flags = np.zeros(len(table), np.int64)
        flags[column] = 1
        return self.comm.max_into(flags).astype(bool)

    def count(self, n: int) -> int:
        """Sum of an integer over the ranks. Collective."""
        return int(self.comm.sum_into(np.array([n], dtype=np.int64))[0])

    def extents(self) -> dict[str, float]:
        """{left} {right} {bottom} {top} of the particles that are not fixed in both x and y [m]. Collective."""
        p = self.particles
        free = (p["fix"] & 3) != 3
        x, y, r = p["x"][free], p["y"][free], p["radius"][free]
        ends = np.full(4, -np.inf)
        if len(x):
            ends[:] = -(x - r).min(), (x + r).max(), -(y - r).min(), (y + r).max()
        self.comm.max_into(ends)
        if not np.isfinite(ends).all():
            raise CommandError("{left}, {right}, {bottom}, {top} need at least one free particle")
        left, right, bottom, top = (float(v) for v in ends * (-1.0, 1.0, -1.0, 1.0))
        return {"left": left, "right": right, "bottom": bottom, "top": top}

    def note_maker(self, first_gid: int) -> None:
        """The present line of the script makes the particles from this id on."""
        if not self.makers or self.makers[-1][1] != self.line or self.makers[-1][0] > first_gid:
            bisect.insort(self.makers, (first_gid, self.line))

    def group_number(self, name: str) -> int:
        """Row of a group name, made if need be (on all ranks alike)."""
        if name not in self.groups:
            self.groups.append(name)
        return self.groups.index(name)
