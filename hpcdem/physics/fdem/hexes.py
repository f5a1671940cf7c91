"""The tables of the kernels for the hexahedra that a rank owns, and the calls of the kernels; part of `LocalSpace`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.hexahedra import OVERLAYS, PARTS
from hpcdem.physics.fdem.kernels import hexes, space, tets
from hpcdem.physics.fdem.local import element_table

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def place_masses(sim: State, mass: np.ndarray) -> None:
    """True masses (n, 4) [kg] of the corners of all hexahedra held here, ghosts too: at the first corner of each point,
    nothing at the others."""
    mesh = sim.the_mesh()
    of = mesh.hex_of()
    held = np.unique(of[sim.number[of[sim.number] >= 0]])
    if not len(held):
        return
    rows = mesh.hexes[held]
    density = np.array(sim.element_rows.column("density"))[sim.element_row[rows[:, 8]]]
    parts = hexahedra.corner_volumes(mesh.points, rows) * density[:, None]
    first, _ = hexahedra.places(mesh.cells, rows)
    storage = sim.where[rows[:, 8, None] + np.arange(PARTS)]
    mass[storage.reshape(-1)] = 0.0
    mass[np.take_along_axis(storage, first // 4, axis=1), first % 4] = parts


class Hexes:
    """count: hexahedra of this rank; rows (count, 6): storage rows of their tetrahedra; begin, place: see
    `hexes.forces`; of (count, 24): corner of the hexahedron at each corner of these."""

    def __init__(self, sim: State, true_mass: np.ndarray) -> None:
        self.sim = sim
        mesh, own = sim.the_mesh(), sim.owned
        start = sim.where[mesh.hexes[:, 8]]
        mine = np.flatnonzero((start >= own.start) & (start < own.stop))
        mine = mine[np.argsort(start[mine])]
        of = mesh.hexes[mine]
        self.count = n = len(mine)
        self.number = of[:, 8]
        self.nodes = of[:, :8]
        self.rows = sim.where[of[:, 8, None] + np.arange(PARTS)]
        if not (np.diff(self.rows, axis=1) == 1).all():
            raise AssertionError("the rows of a hexahedron do not lie one after the other")
        models = sim.element_row[of[:, 8, None] + np.arange(PARTS)]
        apart = np.flatnonzero((models != models[:, :1]).any(axis=1))
        if len(apart):
            raise CommandError(
                f"elements {self.number[apart[0]]} and following are one hexahedron of several materials"
            )
        first, self.of = hexahedra.places(mesh.cells, of)
        self.begin = (tets.ROW * self.rows[:, 0]).astype(np.int32)
        self.place = np.zeros((n + 3, 8), np.int32)
        self.place[:n] = self.begin[:, None] + tets.ROW * (first // 4) + tets.STRIDE * (first % 4)
        self.mass = np.zeros((n + 3, 8))
        self.mass[:n] = true_mass[self.place[:n] // tets.ROW, self.place[:n] % tets.ROW // tets.STRIDE]
        self.s0 = np.zeros((n + 3, tets.STRESSES))
        if sim.stress0 is not None and n:
            self.s0[:n, :6] = sim.initial_stresses(self.number)
        self._make_constants(models[:, 0])

    def _make_constants(self, model: np.ndarray) -> None:
        sim, mesh, n = self.sim, self.sim.the_mesh(), self.count
        models = element_table(sim.element_rows)
        self.c = np.zeros((10 * n + 3, tets.TET))
        self.c[:, [0, 4, 8]] = 1.0
        volume = hexahedra.volumes(mesh.points, np.column_stack([self.nodes, self.number]))
        every = np.arange(n)
        for j in range(10):
            corners = self.nodes[:, OVERLAYS[j]]
            quarter = np.repeat((models[model, space.RHO] * volume[:, j] / 4.0)[:, None], 4, axis=1)
            rows = self.c[j * n : (j + 1) * n]
            space.constants(
                every, mesh.points, np.ascontiguousarray(corners), model, models, sim.options.dynamic, every, quarter,
                rows,
            )  # fmt: skip
            rows[:, hexes.VOLUME] = volume[:, j]
        self.modulus = models[model, space.LAME] + models[model, space.MU2]
        self.eta = self.c[: 10 * n, tets.ETA].reshape(10, n).max(axis=0) if n else np.zeros(0)
        self.omega2 = np.zeros(n)
        if n:
            self.omega2 = space.omegas2(self.c[: 10 * n]).reshape(10, n).max(axis=0)

    def forces(self, force: np.ndarray) -> None:
        """Into the rows (n, 16) [N] of these tetrahedra."""
        sim, o = self.sim, self.sim.options
        kernel: Any = hexes.forces if sim.threads == 1 else hexes.forces_threaded
        kernel(
            sim.threads, self.count, self.begin, self.place, sim.x, sim.v, self.c, self.mass, self.s0,
            not o.large_strain, force, o.gx, o.gy, o.gz, o.mass_damping, o.stiffness_damping,
        )  # fmt: skip

    def stresses(self, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n, 6) [Pa] and elastic energy (n,) [J] of some of them."""
        stress, energy = np.empty((len(which), 6)), np.empty(len(which))
        small = not self.sim.options.large_strain
        hexes.stresses(which, self.count, self.place, self.sim.x, self.c, self.s0, small, stress, energy)
        return stress, energy

    def spread(self, stress: np.ndarray, energy: np.ndarray, at: np.ndarray) -> None:
        """Put them into those of owned elements: the how-manieth `at` (n,), ascending or not; energies by volume."""
        hex_of = np.full(self.sim.n_own, -1, np.int64)
        hex_of[self.rows - self.sim.n_left] = np.arange(self.count)[:, None]
        here = np.flatnonzero(hex_of[at] >= 0)
        if not len(here):
            return
        which, back = np.unique(hex_of[at[here]], return_inverse=True)
        found, stored = self.stresses(which)
        stress[here] = found[back]
        if len(energy):
            volume = self.sim.areas[self.sim.number[at[here] + self.sim.n_left]]
            whole = self.sim.areas[self.number[which, None] + np.arange(PARTS)].sum(axis=1)
            energy[here] = stored[back] * volume / whole[back]

    def stiffness(self) -> np.ndarray:
        """K (count, 24, 24) [N/m]."""
        found = np.empty((self.count, 24, 24))
        small = not self.sim.options.large_strain
        hexes.stiffness(self.count, self.place, self.sim.x, self.c, self.s0, small, found)
        return found

    def at_corners(self, of_rows: np.ndarray) -> np.ndarray:
        """(count, 8) sums at the corners of what owned elements (n_own, 4) have."""
        out = np.zeros((self.count, 8))
        values = of_rows[self.rows - self.sim.n_left].reshape(self.count, 4 * PARTS)
        np.add.at(out, (np.arange(self.count)[:, None], self.of), values)
        return out

    def time_step(self, springs: np.ndarray, dashpots: np.ndarray, target: float, mass: np.ndarray) -> float:
        """Largest stable one [s]; springs, dashpots (n_own, 4); see `space.time_step`."""
        o = self.sim.options
        return hexes.time_step(
            self.omega2, self.eta, self.modulus, self.place, self.at_corners(springs), self.at_corners(dashpots),
            o.mass_damping, o.stiffness_damping, o.safety, target, mass,
        )  # fmt: skip

    def static_masses(self, springs: np.ndarray, alpha: float, mass: np.ndarray) -> None:
        """Fictitious masses by the largest row of the stiffness in the mesh, see `space.static_masses`."""
        x = np.zeros_like(self.sim.x)
        flat = x.reshape(-1)
        for axis in range(3):
            flat[self.place[: self.count] + axis] = self.sim.the_mesh().points[self.nodes, axis]
        k = np.empty((self.count, 24, 24))
        hexes.stiffness(self.count, self.place, x, self.c, np.zeros_like(self.s0), True, k)
        rows = np.abs(k).sum(axis=2).reshape(self.count, 8, 3).max(axis=2)
        place = self.place[: self.count]
        mass[self.rows.reshape(-1)] = 0.0
        mass[place // tets.ROW, place % tets.ROW // tets.STRIDE] = (
            0.25 * 1.25 * (1.0 + alpha) * (rows + 2.0 * self.at_corners(springs))
        )

    def other_cuts(self, corner: np.ndarray, element: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of loaded triangles: which of them (k,) are half a side of a hexahedron, and where the corners of a half of
        the same side begin that is cut the other way (k, 3); both halves have another one each. corner (m, 3): where
        theirs begin in x; element (m,): of owned elements, the how-manieth."""
        hex_of = np.full(self.sim.n_own, -1, np.int64)
        hex_of[self.rows - self.sim.n_left] = np.arange(self.count)[:, None]
        of = np.flatnonzero(hex_of[element] >= 0)
        which = hex_of[element[of]]
        inside = (corner[of] - self.begin[which, None]) // tets.STRIDE
        a, b, c = np.take_along_axis(self.of[which], inside, axis=1).T
        return of, np.take_along_axis(self.place[which], hexahedra.OTHER_CUT[a, b, c], axis=1)
