"""The simulation of particles: its state, and the phases of the step and of a rebuild, whose order is in
`engine/model.py`: particles move with the forces of the step before, then forces are those at the new positions.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.deprecated import renamed
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.fields import CLUMP, FIELDS, FX, TORQUE, WIDTH
from hpcdem.core.memory import aligned, take_rows
from hpcdem.engine.model import FRESH, STORAGE, Model
from hpcdem.halo.migrate import Trail
from hpcdem.physics.dem import guards, loops, missed, periodic, reach, rolling
from hpcdem.physics.dem.clumps import Clumps
from hpcdem.physics.dem.kernels import contacts, fast, motion, neighbours
from hpcdem.physics.dem.kernels.fast import Fast
from hpcdem.physics.dem.kernels.neighbours import NO_ROWS, Histories
from hpcdem.physics.dem.land import Land
from hpcdem.physics.dem.materials import BOND_TYPE, MATERIAL, PropertyTable
from hpcdem.physics.dem.particles import Particles
from hpcdem.physics.dem.reach import ListState
from hpcdem.physics.dem.settings import Settings
from hpcdem.physics.dem.user_laws import ModelLaws
from hpcdem.physics.dem.walls import Walls
from hpcdem.runtime.run_folder import Retention


@dataclass
class Watcher:
    """Observer of the model, which may also act on it, at the steps that are multiples of `every`.

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
        """Parameters of the constructor, for checkpoints."""

    def diagnostics(self) -> Mapping[str, tuple[str, Callable[[Simulation], float]]]:
        """Quantities that HIST can record: unit and function of the simulation (collective) by name."""

    def prepare(self, sim: Simulation) -> None:
        """Lists, masses or settings are others. Collective."""

    def stable_time_step(self, sim: Simulation) -> float:
        """The largest time step [s] it can bear with the present contacts. The model is closed. Collective."""

    def advance(self, sim: Simulation) -> None:
        """Advance one step, after the forces at the new positions; ghosts have the values at its beginning. Not
        collective."""

    @staticmethod
    def warm_up(threads: int) -> None:
        """Call every kernel once."""


class Simulation(Model):
    """One model of particles on one communicator, see `Model`.

    watchers: see `Watcher`; resume_advice: what the user is advised to use after a stop with a checkpoint;
    draws: DRAW makes pictures; lost: particles that left the BOX so far; rows: first id of each row of GLINE and the
    one after its last; physics: on the particles, beside their motion, in the order in which they act; fast: particles
    with a reach of their own in the lists (physics/dem/kernels/fast.py); energy: the account of SET energy
    (budget.Budget), or None.
    """

    rebuild_state: ListState
    largest_radius: float
    body: np.ndarray
    """Masses and what goes with them, see kernels/motion.py; these and the laws are made with the lists (loops.py)."""
    pair_laws: np.ndarray
    wall_laws: np.ndarray
    bond_laws: np.ndarray
    _parts: int
    _walls_move: bool
    _mover: Any
    _pair_forces: Any
    _wall_forces: Any
    _move_args: tuple[Any, ...]
    _pair_args: tuple[Any, ...]
    _wall_args: tuple[Any, ...]

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
        self.resumed = False  # resumes from a checkpoint that lies where it writes
        self.restored: tuple[Path, int] | None = None  # the checkpoint that the script named, and its step
        self.keep = Retention()
        self.watchers: list[Watcher] = []
        self.number = 0  # of the simulations of a program, in the order in which they were made
        self.pace: Any = None  # runtime.pace.Pace: chooses the threads; None: nobody does
        self.coupled = False  # to blocks, which step them both (physics/coupling)
        self.resume_advice = "--resume"
        self.draws = False
        self.script, self.position, self.line = "", 0, 0
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
        self.bonds_checked: tuple[float, ...] = ()  # state of the last search for bonds of two shear stiffnesses
        self.step_limit = math.inf  # the lowest estimate of the critical time step that was reported
        self.reported_share = 0.0  # the largest part of the stability limit that was logged
        self.next_watch = 0  # the step from which on it is checked again
        self.lost = 0
        self.rows: list[tuple[int, int]] = []
        self._named: set[int] = set()
        self.energy: Any = None
        self.lands: dict[int, Land] = {}  # SURFACE
        self.dashpots: Any = None  # restitution.Dashpots, while SET restitution is below 1
        self.rolling: rolling.Rolling | None = None  # while PROP rfric is above 0
        self.own_laws = ModelLaws()  # of the user; materials say which discs have them
        self.own_table: np.ndarray | None = None
        self.stamp = 1  # evaluations of forces, for the memory of these laws
        self.history_requests: dict[int, tuple[int, str]] = {}
        self.history_origins: dict[int, tuple[int, float]] = {}  # axis and distance of strains
        self.plots: list[tuple[int, int]] = []
        self.drawing: tuple[int, tuple[str, ...]] | None = None
        self.bases: list[Any] = []  # flexing_base.Base: walls and rows that an elastic plate carries
        self.progress: dict | None = None
        self.last_frame: tuple[int, bool] | None = None
        self.edited = True  # by a command, since the last `_ini` frame of a coupled run
        self.series_open: dict[str, str] = {}  # header of each
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
        self.least_skin = 0.0  # of the next lists [m]
        self._tables_stale = True
        self._pushed, self._push = np.empty(0, np.int64), np.empty((0, 2))

    # ---- one step ------------------------------------------------------------------------------------------------

    def _begin_step(self) -> None:
        if self.energy is not None:
            self.energy.before_move(self)

    def _move_rows(self, first: int, last: int) -> None:
        self._mover(self._parts, first, last, *self._move_args)
        if self.moves_as_one:  # clumps overwrite what the loop makes of their members
            s = self.settings
            self.clumps.move(self.particles, self.lists, s.gx, s.gy, s.lsm, self.clock.dt)

    def _moved(self) -> None:
        if self._walls_move:
            self.walls.move(self.clock.dt)
        periodic.widen(self)

    def _end_step(self, outdated: int) -> None:
        energy, timers = self.energy, self.timers
        if outdated:
            if energy is not None:
                energy.before_rebuild(self)
            self.rebuild()
        if energy is not None:
            energy.before_forces(self)
        with timers("force"):
            self._forces()
        if energy is not None:
            energy.after_forces(self)
        for physics in self.physics:
            with timers(physics.name):
                physics.advance(self)
        self.clock.tick()

    def _forces(self) -> None:
        """Contact, bond and wall forces at the present positions."""
        lists = self.lists
        if self.own_table is None:
            self._pair_forces(self._parts, *self._pair_args)
        else:
            self.stamp += 1
            self._pair_forces(lists.n_blocks, *self._pair_args, float(self.stamp))
        if len(lists.slot_row):
            self.walls.put_ends(self._wall_table)
            self._wall_forces(lists.n_blocks, *self._wall_args)
        if self.dashpots is not None:
            self.dashpots.push(self)
        if self.rolling is not None:
            self.rolling.push()
        if len(self._pushed):
            lists.force[self._pushed, :2] += self._push
        if self.moves_as_one:
            self.clumps.sum_forces(self.particles, self.halo, lists)

    def _check_rebuild(self, glance: bool = False) -> tuple[int, int]:
        rebuild_state, p, dt = self.rebuild_state, self.particles, self.clock.dt
        found = np.zeros(9)
        # Half of the margin, in case things speed up; gravity counted twice; and never more than twice the last wait.
        fall = 2.0 * math.hypot(self.settings.gx, self.settings.gy) * dt * dt
        motion.survey(p.hot, p.n_left, p.n_own, self.origin, dt, self._fast_rows, found[:4])
        found[4] = self.stop.local_request() if self.stop is not None else 0
        reach.measure_fast(self, fall, found[5:])
        self.comm.max_into(found)
        broken = bool(found[motion.BROKEN] or found[5 + fast.FAST_BROKEN])
        if broken or max(found[motion.STRIDE], found[5 + fast.FAST_STRIDE]) > guards.LARGEST_STRIDE:
            alone, mixed = self._fast_rows[self.fast.alone[self._fast_at]], self.own_laws.mixed(self.materials.rows)
            guards.stop_on_runaway(p, self.origin, dt, self.clock.step, broken, mixed, self.comm, alone)
        sides = periodic.travel(self)
        path = max(math.sqrt(found[motion.PATH2]), self.walls.longest_travel()) + sides[0]
        stride = max(math.sqrt(found[motion.SPEED2]), self.walls.fastest()) * dt + sides[1]
        margin = 0.5 * rebuild_state.skin - path
        if glance and not rebuild_state.is_too_late(margin, stride) and found[5 + fast.DUE] == 0.0:
            hurry = found[5 + fast.HURRY]  # half the margin over the stride, of the fast ones
            if hurry == 0.0 or not rebuild_state.is_too_late(2.0 / hurry, 1.0):
                return FRESH, 0
        if (margin < 0.0 and self.largest_radius > 0.0) or found[5 + fast.DUE] == fast.LATE:
            with self.timers("neighbour"):
                missed.stop_on_missed(self)
        stale = margin < stride or found[5 + fast.DUE] > 0.0
        if stale:
            margin = 0.5 * rebuild_state.skin
        hurry = 0.0 if stale else found[5 + fast.HURRY]
        rebuild_state.wait(fast.wait(margin, stride, fall), 1.0 / hurry if hurry > 0.0 else math.inf)
        return STORAGE if stale else FRESH, int(found[4])

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
        self.open_model()
        self.particles.extend(physics.fields)
        self.physics.append(physics)
        self.tables_changed()

    # ---- open and closed -----------------------------------------------------------------------------------------

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

    def open_model(self) -> None:
        """Make the model free to be changed: owned particles, their histories and forces only."""
        if not self.closed:
            return
        self.particles.cold[:, FX : TORQUE + 1] = self.lists.owned_forces()
        self._open_lists()

    open, close = renamed("open", "open_model"), renamed("close", "close_model")

    def _open_lists(self) -> None:
        p = self.particles
        guards.name_slipped(self)
        self.breaks += self.uncollected_breaks()
        self.lists.tally[:, [contacts.TENSION_BREAKS, contacts.SHEAR_BREAKS]] = 0.0
        self._longest2 = self.lists.longest_bond2()
        self._hist = self.lists.histories(p.ihot, float(self.stamp))
        self.halo.close()
        p.set_owned(p.hot[p.owned], p.cold, self.clumps.rows(p), p.more[p.owned])
        self.clumps.open()
        self._lists, self.closed = None, False

    def close_model(self, least_skin: float = 0.0) -> None:
        """Make the model ready to step: lists and ghosts at the present positions, stored forces in place.

        least_skin [m]: pairs up to this gap will be in the lists, if the model was open.
        """
        if not self.closed:
            self.least_skin = least_skin
            self._close()
            self.least_skin = 0.0
            self.lists.set_owned_forces(self.particles.cold[:, FX : TORQUE + 1])
            if self.clumps:
                self.clumps.sum_forces(self.particles, self.halo, self.lists)
        self.refresh_tables()
        self.halo.refresh()

    def _choose_reach(self, frozen: bool) -> np.ndarray:
        box = self.walls.box()
        if reach.choose(self, frozen, box) and box is not None:
            guards.drop_outside(self, box)
        return periodic.cells(self, self.particles.hot)

    def _share_out(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        p, box = self.particles, self.walls.box()
        cell, self.hist, (hot, cold, more, *rigid) = self._send_home(
            cell, self.hist.resized(self.own_laws.memory or rolling.columns(self)),
            [p.hot, p.cold, p.more, *([] if p.rigid is None else [p.rigid])], None if box is None else box[:2],
            least=self.rebuild_state.columns, left=lambda leave, to: self.trail.note(p["gid"][leave], to),
        )  # fmt: skip
        p.set_owned(hot, cold, rigid[0] if rigid else None, more)
        if self.pace is not None and self.own_laws.loops is None:  # user laws are compiled for one number
            self.threads = self.pace.choose(p.n_own, self.timers, self.clock.step)
        return cell, p["gid"]

    def _store(self, order: np.ndarray, cell: np.ndarray) -> None:
        p = self.particles
        storage = self._connect(p.hot, order, self.ownership.sends(cell, self.rebuild_state.columns))
        rigid = self.clumps.storage(p, order, self.halo, self.threads)
        more = self.halo.storage(p.more[order]) if p.extra else np.empty((len(storage), 0))
        cold = take_rows(p.cold, order, aligned((len(order), WIDTH)), self.threads)
        p.place(storage, cold, self.halo.n_left, rigid, more)

    def _build_lists(self, order: np.ndarray, cell: np.ndarray, frozen: bool) -> None:
        p, hist, rebuild_state = self.particles, self.hist, self.rebuild_state
        side, skin = rebuild_state.side, rebuild_state.skin
        clump = None if p.rigid is None else p.rigid.view(np.int64)[:, CLUMP].copy()
        cell = periodic.with_ghosts(self, cell)
        self.origin = p.positions()
        self.walls.list_built()
        self._wall_table = self.walls.table()
        bond_reach = min(side, rebuild_state.bond_reach + skin) if self.bonds else 0.0
        self._lists = neighbours.build(
            p.hot, cell, p.n_left, p.n_own, hist, order, self._wall_table, side, self.largest_radius, skin, bond_reach,
            self.threads, clump, self.fast, rebuild_state.columns, self.settings.side,
        )  # fmt: skip
        self._fast_rows, self._fast_at = self.fast.among(p["gid"])
        self.clumps.close(p, self.halo, self._lists, self.clock.step, side)
        self._hist, self._parts, self.closed, self.moves_as_one = None, self._lists.n_blocks, True, bool(self.clumps)
        rebuild_state.age = 0
        self._tables_stale = True
        self.refresh_tables()
        guards.refuse_lost_bonds(self, hist)  # last: what is wrong is still written as a frame

    # ---- what there is -------------------------------------------------------------------------------------------

    def remove(self, which: np.ndarray) -> int:
        """Delete the flagged owned particles (n_own,) bool, clumps as a whole, and all memory of them. The model must
        be open. Returns the number over all ranks. Collective.
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
        broken = int(self.comm.sum_into(self.uncollected_breaks().sum(keepdims=True))[0]) if self.closed else 0
        return self.bonds - broken

    def used(self, column: np.ndarray, table: PropertyTable) -> np.ndarray:
        """Flag the rows of a property table that occur among row numbers, on any rank; (rows,) bool. Collective."""
        flags = np.zeros(len(table), np.int64)
        flags[column] = 1
        return self.comm.max_into(flags).astype(bool)

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
        return dict(zip(("left", "right", "bottom", "top"), (ends * (-1.0, 1.0, -1.0, 1.0)).tolist(), strict=True))

    def note_maker(self, first_gid: int) -> None:
        """The present line of the script makes the particles from this id on."""
        if not self.makers or self.makers[-1][1] != self.line or self.makers[-1][0] > first_gid:
            bisect.insort(self.makers, (first_gid, self.line))

    def group_number(self, name: str) -> int:
        """Row of a group name, made if need be (on all ranks alike)."""
        if name not in self.groups:
            self.groups.append(name)
        return self.groups.index(name)

    # ---- tables and parameters of the kernels --------------------------------------------------------------------

    def tables_changed(self) -> None:
        """Materials, bond types, walls or the mass rule were changed by a command."""
        self._tables_stale = True

    def refresh_tables(self) -> None:
        """Masses, law tables and argument lists of the kernels, from materials, walls and settings."""
        if self._tables_stale and self.closed:
            loops.refresh(self)
