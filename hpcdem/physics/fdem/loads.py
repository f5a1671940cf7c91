"""Forces from outside on corners of the elements that a rank owns: tractions on faces, dashpots of quiet faces, what
elements left behind that were removed, and what other physics push with (surface_loads.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.conditions import TRACTIONS
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.hexes import Hexes
    from hpcdem.physics.fdem.state import State


def impedances(sim: State, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """rho c_p and rho c_s of elements (n,) [Pa s/m]."""
    row, of = sim.element_row[number], moduli(sim.element_rows, sim.options.plane_stress)
    rho = np.array(sim.element_rows.column("density"))[row]
    return np.sqrt(rho * of.wave[row]), np.sqrt(rho * of.shear[row])


def tractions_now(sim: State, placed: Placed, time: float) -> np.ndarray:
    """The table of tractions (rows, 7), in space (rows, 10), with a row of its own for each face whose traction is a
    function."""
    columns = TRACTIONS[sim.dim]
    return placed.filled(sim.loads_at(time), lambda one, field: (columns.index(field), time, 1.0))


class Loads:
    """special (n_own, 4) bool: corners that may get such a force; some: there are any, on some rank; applied (n or 1,
    w): the forces in rows of storage [N/m], in space [N], w words a row, of at_corners, see `NodeSet.table`.

    element, corner: of the m loaded faces the how-manieth owned element, and where their corners begin in `applied`
    (m, dim); functions, of: rows of the table of tractions; quiet: which of these faces act as quiet ones.
    relaxing_corner: where forces that die down begin in `applied`."""

    at_corners: np.ndarray
    applied: np.ndarray

    def __init__(self, sim: State, width: int, stride: int) -> None:
        self.sim, self.width = sim, width
        mesh, own = sim.the_mesh(), sim.owned
        number = sim.number[own]
        faces = 4 * number[:, None] + np.arange(4)
        self.element, k = np.nonzero((sim.load_row[faces] > 0) & (mesh.cells[number] >= 0))
        faces = faces[self.element, k]
        self.ends = mesh.face_corners(faces) % 4
        self.special = np.zeros((sim.n_own, 4), bool)
        self.special[self.element[:, None], self.ends] = True
        self.corner = width * (self.element + own.start)[:, None] + stride * self.ends
        places = mesh.points[mesh.face_points(faces)].mean(axis=1)
        self.functions = Placed(sim.loads, sim.load_row[faces].astype(np.int64), places)
        self.of = self.functions.of
        self.quiet = self._acting(np.flatnonzero(sim.quiet_faces()[faces]))
        self.quiet_of, of_quiet = self.of[self.quiet], sim.number[own][self.element[self.quiet]]
        self.quiet_p, self.quiet_s = impedances(sim, of_quiet)
        self._place()
        dies_down = self._make_relaxations(stride)
        sim.surface_loads.corners(sim, self.special)
        self.some = bool(sim.surface_loads) or sim.comm.any(len(self.element) > 0 or dies_down)

    def _acting(self, quiet: np.ndarray) -> np.ndarray:
        """Return the quiet faces that act: all, or none in static runs, which is reported."""
        sim = self.sim
        if sim.options.dynamic:
            return quiet
        if sim.log is not None and sim.quiet_faces().any():
            sim.log.warn_once(
                "quiet",
                "quiet faces act in dynamic runs only: in this static stage they only apply their stress",
            )
        return quiet[:0]

    def _place(self) -> None:
        """Find the start of edges in x, and their corners in v."""
        sim, row = self.sim, self.element + self.sim.owned.start
        self._edge = row * sim.x.shape[1] + 2 * self.ends[:, 0]
        self._a, self._b = self.corner.T.copy()
        self._quiet_edge, self._quiet_corner = self._edge[self.quiet], self.corner[self.quiet]
        self._quiet_place = row[self.quiet, None] * sim.v.shape[1] + 2 * self.ends[self.quiet]

    def _make_relaxations(self, stride: int) -> bool:
        """Collect the forces that removed elements left at owned corners; return whether there are any."""
        sim, own = self.sim, self.sim.owned
        parts = [one for one in sim.relaxations if not sim.has_ended(one)]
        corner = np.concatenate([one.corner for one in parts] or [np.empty(0, np.int64)])
        force = np.concatenate([one.force for one in parts] or [np.empty((0, sim.dim))])
        each = [len(one.corner) for one in parts]
        at_row = sim.where[corner // 4]
        at = np.flatnonzero((at_row >= own.start) & (at_row < own.stop))
        self.special[at_row[at] - own.start, corner[at] % 4] = True
        self.relaxing_corner = self.width * at_row[at] + stride * (corner[at] % 4)
        self._force = force[at].copy()
        self._begin = np.repeat(np.array([one.begin for one in parts]), each)[at]
        self._span = np.repeat(np.array([one.span for one in parts]), each)[at]
        self._in_steps = np.repeat(np.array([one.in_steps for one in parts], bool), each)[at]
        return len(at) > 0

    def find(self) -> None:
        """Evaluate all loads at present, into `applied`; those at corners of other ranks are missing."""
        if not self.some:
            return
        sim, applied = self.sim, self.applied
        self.at_corners[:] = 0.0
        self._push(tractions_now(sim, self.functions, sim.time_now()))
        if len(self.relaxing_corner):
            now = np.where(self._in_steps, float(sim.clock.step), sim.clock.time)
            left = np.clip(1.0 - (now - self._begin) / self._span, 0.0, 1.0)
            moving.relax(self.relaxing_corner, self._force, left, applied)
        sim.surface_loads.add_to(applied)

    def _push(self, table: np.ndarray) -> None:
        """Tractions, see `tractions_now`, and dashpots."""
        sim = self.sim
        moving.tractions(self._edge, self._a, self._b, self.of, table, sim.x, self.applied)
        if len(self._quiet_edge):
            moving.dashpots(
                self._quiet_edge, self._quiet_corner, self._quiet_place, self.quiet_p, self.quiet_s, self.quiet_of,
                table, sim.x, sim.v, self.applied,
            )  # fmt: skip


class LoadsSpace(Loads):
    """share (m,): part of the traction that each of the triangles takes; a load on a side of a hexahedron is that of
    both ways to cut it into two, half each."""

    def __init__(self, sim: State, width: int, stride: int, hexes: Hexes | None) -> None:
        self._hexes, self._stride = hexes, stride
        super().__init__(sim, width, stride)

    def _place(self) -> None:
        self._quiet_corner, self.share = self.corner[self.quiet], np.ones(len(self.element))
        if self._hexes is None:
            return
        of, corners = self._hexes.other_cuts(self.corner, self.element)
        self.share[of] = 0.5
        i, k = np.divmod(corners - self.width * self.sim.n_left, self.width)
        self.special[i, k // self._stride] = True
        self.corner = np.concatenate([self.corner, corners])
        self.of = np.concatenate([self.of, self.of[of]])
        self.share = np.concatenate([self.share, np.full(len(of), 0.5)])

    def _push(self, table: np.ndarray) -> None:
        sim = self.sim
        space.tractions(self.corner, self.of, self.share, table, sim.x, self.applied)
        if len(self._quiet_corner):
            space.dashpots(
                self._quiet_corner, self.quiet_p, self.quiet_s, self.quiet_of, table, sim.x, sim.v, self.applied
            )
