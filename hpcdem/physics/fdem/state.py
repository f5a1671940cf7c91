"""The state of a model of blocks as a rank holds it: elements with their corners and histories, clock, ownership.

Its parts say what is in it; the step that moves it, and the rebuild of lists and ghosts, are in `simulation.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.units import with_prefix
from hpcdem.engine.model import Model
from hpcdem.engine.rebuild import RebuildState
from hpcdem.halo.beyond import Beyond
from hpcdem.physics.fdem import backfill, hexahedra
from hpcdem.physics.fdem.conditions import Relaxation
from hpcdem.physics.fdem.definition import ModelDefinition
from hpcdem.physics.fdem.histories import Histories
from hpcdem.physics.fdem.kernels import creep, plasticity
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.surface_loads import SurfaceLoads
from hpcdem.physics.fdem.topology import T

NARROW, WIDE = 0.1, 0.3
"""Buffer of the contact search over the mean edge, at rest and in fast motion."""


@dataclass
class ListState(RebuildState):
    """Skin over the mean edge; stored: age of the storage in steps (`age`: of the contact lists); dt: time step of the
    dynamic mode [s], 0 if it must be estimated, and the step at which it was. step, time: when the contact lists were
    made; dt is the same since then. watched: step of the last look at how deep bodies overlap; deep: the deepest
    overlap that was reported, over an altitude.
    """

    skin_factor: float = NARROW
    stored: int = 0
    dt: float = 0.0
    estimated: int = 0
    step: int = 0
    time: float = 0.0
    watched: int = 0
    deep: float = 0.0


class Crack(NamedTuple):
    """A joint that broke. joint: its number; mode: from 1 (opened) to 2 (slid); step, time [s]: of the positions at
    which it broke; kinetic: energy of the two elements then [J/m]; peak_step, peak_kinetic: when it had passed its
    strength (-1 and NaN in checkpoints of earlier versions)."""

    joint: int
    mode: float
    step: int
    kinetic: float
    time: float
    peak_step: int = -1
    peak_kinetic: float = math.nan


@dataclass
class Creep:
    """The clock of creep. on: elements creep; dt: the next creep step of static runs [s], 0: none was given; change:
    largest change of stress in a creep step that is aimed at, 0: dt stays; least, greatest: bounds of dt then [s];
    time that has passed with creep on [s]; steps: creep steps that are done; passed: part of the time that elements
    have not crept for yet [s]: in static runs the creep step that is under way."""

    on: bool = False
    dt: float = 0.0
    change: float = 0.0
    least: float = 0.0
    greatest: float = 0.0
    time: float = 0.0
    steps: int = 0
    passed: float = 0.0


class State(ModelDefinition, Model):
    """ModelDefinition, positions, velocities and histories of the elements that a rank holds."""

    rebuild_state: ListState
    number: np.ndarray
    """Number of each element held here; when the model is closed [ghosts of the left | owned | ghosts of the right]."""
    x: np.ndarray
    """Corners [m], see elements.py."""
    v: np.ndarray
    """Velocities of the corners at the last half step [m/s]."""
    cold: dict[str, np.ndarray]
    """Further columns of the owned elements, which migrate with them: "home" (where displacement is zero), "work",
    "plastic" (what is remembered of yielding, see plasticity.py), "creep" (of creep, see kernels/creep.py), "law"
    (state variables, see user_laws.py)."""
    histories: Histories
    surface_loads: SurfaceLoads
    n_left: int
    n_own: int
    linked_within: float
    """Distance within which elements are held that share joints, fluid or heat with owned ones [m]."""
    apart_within: float
    """That of elements which may touch them."""
    beyond: Beyond
    """Elements of other ranks of which no rows are held, until the first step of a new model is checked."""
    where: np.ndarray
    """(ne,) storage row of each element of the model, -1: not held here."""
    areas: np.ndarray
    """Areas of the elements of the model [m2]."""
    cut: np.ndarray
    """Diagonal along which each quad is cut for contact, see `pairs.cut_corner`."""
    node: np.ndarray
    """(4 ne,) number of the node to which each corner belongs; -1: none."""
    shared_nodes: np.ndarray
    """Flags of nodes with several corners, bool."""
    member_begin: np.ndarray
    """Offsets of the corners of each node with several in `member`."""
    member: np.ndarray
    point_corners: np.ndarray
    """(np,) number of corners of present elements at each point of the mesh."""
    opened_apart: int = 0
    """Joints opened in place since `share_changes`: each rank has pages of its own for them."""
    origin: np.ndarray
    """Positions of the owned elements when the storage was made."""
    listed: np.ndarray
    """Positions of the owned elements when the contact lists were made."""

    def __init__(
        self,
        comm: Comm | None = None,
        threads: int = 1,
        outdir: Path | str = "data",
        log: Any = None,
        stop: Any = None,
        balance_on: bool = True,
    ) -> None:
        Model.__init__(self, comm, threads, outdir, log, stop, balance_on)
        self.surface_loads = SurfaceLoads()
        self.clear()

    def clear(self) -> None:
        """Start a new model: no mesh, step 0, default options."""
        self.restart()
        self.surface_loads.mesh_replaced()
        self.clear_definition()
        self.rebuild_state = ListState()
        self.creep = Creep()
        self.event_rows: list[Crack] = []
        self.closed = False
        self.budget: Any = None
        self._topology_stale = True
        self._longest = 0.0
        self.mean_edge = 0.0
        self.surface: Any = None
        """Tables of the surface for contact, in space, see `pairs_space.Surface`."""
        self.untouched = True
        """Whether nothing has moved since the mesh was made."""
        self._reported_step = 0.0
        self._hex_rows: tuple[np.ndarray, hexahedra.Rows] | None = None
        self._empty()

    def _empty(self) -> None:
        self.number = np.empty(0, np.int64)
        self.x, self.v = np.empty((0, 8)), np.empty((0, 6))
        self.cold = {}
        self.histories = Histories.empty(0)

    @property
    def wide(self) -> bool:
        """Return whether there are quads: rows of positions and velocities then have twelve columns."""
        return self.x.shape[1] == 12

    @property
    def corners(self) -> int:
        """Corners for which rows of elements have places."""
        return 4 if self.wide or self.dim == 3 else 3

    @property
    def stride(self) -> int:
        """Words from one corner of a row of positions or velocities to the next."""
        return 4 if self.dim == 3 else 2

    @property
    def element_parts(self) -> int:
        """Triangles for which a row of what elements remember has columns: quads have four. In space tetrahedra: the
        six that store a hexahedron remember what its ten do, see elements/kind.py."""
        if self.dim == 3:
            return 2 if self.mesh is not None and len(self.mesh.hexes) else 1
        return 4 if self.wide else 1

    def memory(self, name: str) -> int:
        """Columns of what an element, of a quad each triangle, remembers of yielding ("plastic") or of "creep"."""
        if name == "creep":
            return creep.MEMORY[self.dim]
        return plasticity.MEMORY if self.dim == 2 else plasticity.MEMORY_IN_SPACE

    def the_mesh(self) -> Mesh:
        """The mesh; CommandError if missing."""
        return self._mesh()

    def per_node(self, make: Callable[[], T]) -> T:
        return self.comm.per_node(make)

    ahead: int = 0
    """Number of static steps that will be done without an evaluation between them."""

    def time_now(self) -> float:
        """Return the argument of tables and functions of conditions of blocks, bolts and liners: model time [s]; in
        static mode, where it is at rest, the static steps since the mode was switched on besides, each a unit of time,
        or with creep the creep time at the end of the creep step."""
        if self.options.dynamic:
            return self.clock.time
        if self.creep.on:
            return self.creep.time + self.creep.passed
        return self.clock.time + (self.clock.step - self.options.static_since + self.ahead)

    @property
    def owned(self) -> slice:
        """Storage rows of the owned elements."""
        return slice(self.n_left, self.n_left + self.n_own) if self.closed else slice(0, len(self.number))

    def hex_rows(self) -> hexahedra.Rows:
        """The hexahedra of this rank, by rows of owned elements; the model is closed. Not to be changed."""
        if self._hex_rows is None or self._hex_rows[0] is not self.number:  # new storage has a new one
            mesh = self.the_mesh()
            start = self.where[mesh.hexes[:, 8]] - self.n_left
            mine = mesh.hexes[(start >= 0) & (start < self.n_own)]
            rows = self.where[mine[:, 8, None] + np.arange(hexahedra.PARTS)] - self.n_left
            self._hex_rows = self.number, hexahedra.Rows(mesh.points, mesh.cells, mine, rows)
        return self._hex_rows[1]

    def spread(self) -> float:
        """Largest distance of corners of one node [m]: elements that are filled in again connect corners apart."""
        return 2.0 * backfill.TORN * self.mean_edge if len(self.born) else 0.0

    def masses_change(self) -> bool:
        """Masses or the time step will be others with the next lists."""
        return self.rebuild_state.dt == 0.0 or not self.options.dynamic or self.options.mass_scaling > 0.0

    def reported_time(self) -> float:
        """Model time [s]; in static mode with creep the time that elements have crept."""
        return self.creep.time if self.creep.on and not self.options.dynamic else self.clock.time

    def has_ended(self, one: Relaxation) -> bool:
        """Forces left behind are gone, or belong to the other mode."""
        now = float(self.clock.step) if one.in_steps else self.clock.time
        return now >= one.begin + one.span or one.in_steps == self.options.dynamic

    def report_time_step(self, dt: float, critical: float, added: float) -> None:
        """A line in the log about the time step [s]; critical: stability limit times safety factor [s]; added: mass
        that mass scaling adds, over the true mass. A step that is followed (auto) is reported again when it has changed
        by a tenth."""
        o = self.options
        if self.log is None or (o.auto and abs(dt - self._reported_step) < 0.1 * self._reported_step):
            return
        self._reported_step = dt
        limit = critical / o.safety
        scaled = f"by mass scaling, which adds {added:.3g} times the mass"
        how = "given" if o.dt else scaled if o.mass_scaling else "estimated"
        shown = partial(with_prefix, unit="s")
        allowed = f"; the safety factor {o.safety:g} allows {shown(critical)}" if dt != critical else (
            f", as the safety factor {o.safety:g} allows"
        )  # fmt: skip
        self.log.info(
            f"time step {shown(dt)} ({how}): {dt / limit:.2f} of the stability limit of {shown(limit)}{allowed}"
        )
        if dt > critical * (1.0 + 1e-9):
            self.log.warn_once(
                f"critical time step {dt > limit}",
                f"the time step {shown(dt)} is {dt / limit:.2f} of the stability limit of {shown(limit)}; the safety "
                f"factor {o.safety:g} allows {shown(critical)}. Reduce it if the run becomes unstable",
            )
