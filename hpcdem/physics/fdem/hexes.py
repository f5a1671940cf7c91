"""The tables of the kernels for the hexahedra that a rank owns, and the calls of the kernels; part of `LocalSpace`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import hexahedra, user_laws
from hpcdem.physics.fdem.hexahedra import OVERLAYS, PARTS
from hpcdem.physics.fdem.kernels import hexes, space, tets
from hpcdem.physics.fdem.moduli import element_table

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def place_masses(sim: State, number: np.ndarray, mass: np.ndarray) -> None:
    """True masses (n, 4) [kg] of the corners of all hexahedra among these elements (n,): at the first corner of each
    point, nothing at the others."""
    mesh = sim.reference
    of = mesh.macro_of()
    held = np.unique(of[number[of[number] >= 0]])
    if not len(held):
        return
    rows = mesh.hexes[held]
    density = np.array(sim.element_rows.column("density"))[sim.element_row[rows[:, 8]]]
    parts = hexahedra.corner_volumes(mesh.points, rows) * density[:, None]
    first, _ = hexahedra.places(mesh.cells, rows)
    where = np.zeros(len(mesh.cells), np.int64)
    where[number] = np.arange(len(number))
    storage = where[rows[:, 8, None] + np.arange(PARTS)]
    mass[storage.reshape(-1)] = 0.0
    mass[np.take_along_axis(storage, first // 4, axis=1), first % 4] = parts


class Hexes:
    """count: hexahedra of this rank; rows (count, 6): storage rows of their tetrahedra; begin (count,): which owned
    element the first of these is; of (count, 24): corner of the hexahedron at each corner of these; place: see
    `hexes.forces`; corner_of (n, 4): of all rows of storage, the place in x and force of the corner that has the forces
    of each corner; model (count,): row of their models; remember: some may yield, creep or have a user
    law, each tetrahedron has a stress without strain of its own."""

    def __init__(self, sim: State, true_mass: np.ndarray) -> None:
        self.sim = sim
        mesh, own = sim.reference, sim.owned
        start = sim.where[mesh.hexes[:, 8]]
        mine = np.flatnonzero((start >= own.start) & (start < own.stop))
        mine = mine[np.argsort(start[mine])]
        of = mesh.hexes[mine]
        self.count = n = len(mine)
        self.number = of[:, 8]
        self.nodes = of[:, :8]
        self.rows = sim.where[of[:, 8, None] + np.arange(PARTS)]
        if not (np.diff(self.rows, axis=1) == 1).all():
            raise AssertionError("the rows of a hexahedron are not consecutive")
        models = sim.element_row[of[:, 8, None] + np.arange(PARTS)]
        apart = np.flatnonzero((models != models[:, :1]).any(axis=1))
        if len(apart):
            raise CommandError(
                f"elements {self.number[apart[0]]} and following are one hexahedron of several materials"
            )
        first, self.of = hexahedra.places(mesh.cells, of)
        self.begin = self.rows[:, 0] - own.start
        self.place = np.zeros((n + 3, 8), np.int32)
        self.place[:n] = tets.ROW * self.rows[:, :1] + tets.ROW * (first // 4) + tets.STRIDE * (first % 4)
        self.corner_of = np.arange(0, sim.x.size, tets.STRIDE, dtype=np.int32).reshape(-1, 4)
        self.corner_of[self.rows] = np.take_along_axis(self.place[:n], self.of, axis=1).reshape(n, PARTS, 4)
        mass = true_mass[self.place[:n] // tets.ROW, self.place[:n] % tets.ROW // tets.STRIDE]
        self._make_constants(models[:, 0], mass)
        self.model = models[:, 0]
        self.remember = not {"plastic", "creep", user_laws.COLUMN}.isdisjoint(sim.cold)

    def _make_constants(self, model: np.ndarray, mass: np.ndarray) -> None:
        """parts (blocks, 10, 10, 32), h (count + 3, 20): see `hexes.forces`."""
        sim, mesh, n = self.sim, self.sim.reference, self.count
        models = element_table(sim)
        volume = hexahedra.volumes(mesh.points, np.column_stack([self.nodes, self.number]))
        blocks, every = -(-n // hexes.BLOCK), np.arange(n)
        found = np.zeros((blocks * hexes.BLOCK, hexes.PARTS, hexes.WORDS))
        self.h, self.omega2, eta = np.zeros((n + 3, hexes.HEX)), np.zeros(n), np.zeros(n)
        c = np.zeros((n, tets.TET))
        for j in range(hexes.PARTS):
            whole = volume[:, 5 * (j // 5) : 5 * (j // 5) + 5].sum(axis=1)
            quarter = np.repeat((models[model, space.RHO] * volume[:, j] / 4.0)[:, None], 4, axis=1)
            space.constants(
                every, mesh.points, np.ascontiguousarray(self.nodes[:, OVERLAYS[j]]), model, models,
                sim.options.dynamic, every, quarter, c,
            )  # fmt: skip
            found[:n, j, :9], found[:n, j, hexes.SHARE] = c[:, :9], volume[:, j] / whole
            self.omega2 = np.maximum(self.omega2, space.omegas2(c))
            eta += 0.5 * found[:n, j, hexes.SHARE] * c[:, tets.ETA]
            self.h[:n, hexes.H_VOLUME + j // 5] = whole
        of = found.reshape(blocks, hexes.BLOCK, hexes.PARTS, hexes.WORDS)
        self.parts = np.ascontiguousarray(np.moveaxis(of, 1, 3))
        self.h[:n, hexes.H_MASS : hexes.H_MASS + 8] = mass
        self.h[:n, hexes.H_LAMBDA], self.h[:n, hexes.H_TWO_MU] = models[model, space.LAME], models[model, space.MU2]
        self.h[:n, hexes.H_ETA] = eta
        self.modulus = models[model, space.LAME] + models[model, space.MU2]

    def stiffen(self, ratio: np.ndarray) -> None:
        """Multiply the stiffness that determines the time step by `ratio` (count,)."""
        self.omega2 *= ratio
        self.modulus *= ratio

    def forces(self, force: np.ndarray, v: np.ndarray, gravity: tuple[float, float, float], s0: np.ndarray) -> None:
        """Add forces to the rows (n, 16) [N] of these tetrahedra, with the velocities v (n, 16); s0: see
        `hexes.forces`."""
        sim, o = self.sim, self.sim.options
        hexes.forces(
            sim.threads, self.count, self.place, sim.x, v, self.parts, self.h, self.remember, s0,
            not o.large_strain, force, *gravity, o.mass_damping, o.stiffness_damping,
        )  # fmt: skip

    def add_contact(self, pairs: Any, force: np.ndarray) -> None:
        """`ContactSpace.add_to`; what pushes on hexahedra goes to the corners that have their forces."""
        if not len(pairs.rows):
            return
        hexes.add(pairs.rows, self.corner_of, pairs.pushed, force)

    def stresses(self, which: np.ndarray, s0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stress (n, 6) [Pa] and elastic energy (n,) [J] of some of them with this stress without strain."""
        stress, energy = np.empty((len(which), 6)), np.empty(len(which))
        small = not self.sim.options.large_strain
        hexes.stresses(which, self.place, self.sim.x, self.parts, self.h, self.remember, s0, small, stress, energy)
        return stress, energy

    def shares(self) -> np.ndarray:
        """Part of the volume that each of their tetrahedra has (count, 10)."""
        of = np.moveaxis(self.parts[:, :, hexes.SHARE], 1, 2).reshape(-1, hexes.PARTS)[: self.count]
        volume = np.repeat(self.h[: self.count, hexes.H_VOLUME : hexes.H_VOLUME + 2], hexes.PARTS // 2, axis=1) * of
        return volume / volume.sum(axis=1, keepdims=True)

    def volumes_over_parts(self) -> np.ndarray:
        """Volume (count,) of each, the mean of its overlays, over that of the six elements that store it."""
        volume = self.h[: self.count, hexes.H_VOLUME : hexes.H_VOLUME + 2].mean(axis=1)
        return volume / self.sim.areas[self.number[:, None] + np.arange(PARTS)].sum(axis=1)

    def part_of_volume(self) -> np.ndarray:
        """Part of the volume that each of the six elements has that store one (count, 6)."""
        volume = self.sim.areas[self.number[:, None] + np.arange(PARTS)]
        return volume / volume.sum(axis=1, keepdims=True)

    def numbers(self) -> np.ndarray:
        """(n_own,) which of them each owned element is a part of, -1: of none."""
        found = np.full(self.sim.n_own, -1, np.int64)
        found[self.rows - self.sim.n_left] = np.arange(self.count)[:, None]
        return found

    def spread(self, stress: np.ndarray, energy: np.ndarray, at: np.ndarray, s0: np.ndarray) -> None:
        """Put them into those of owned elements, `at` (n,) their indices among these, in any order; energies by
        volume."""
        hex_of = self.numbers()
        here = np.flatnonzero(hex_of[at] >= 0)
        if not len(here):
            return
        which, back = np.unique(hex_of[at[here]], return_inverse=True)
        found, stored = self.stresses(which, s0)
        stress[here] = found[back]
        if len(energy):
            volume = self.sim.areas[self.sim.number[at[here] + self.sim.n_left]]
            whole = self.sim.areas[self.number[which, None] + np.arange(PARTS)].sum(axis=1)
            energy[here] = stored[back] * volume / whole[back]

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
            self.omega2, self.h[: self.count, hexes.H_ETA], self.modulus, self.place, self.at_corners(springs),
            self.at_corners(dashpots), o.mass_damping, o.stiffness_damping, self.sim.safety(), target, mass,
        )  # fmt: skip

    def static_masses(self, k: np.ndarray, springs: np.ndarray, alpha: float, mass: np.ndarray) -> None:
        """Fictitious masses by the largest row of the stiffness k (count, 24, 24) [N/m] in the mesh, see
        `space.static_masses`."""
        rows = np.abs(k).sum(axis=2).reshape(self.count, 8, 3).max(axis=2)
        place = self.place[: self.count]
        mass[self.rows.reshape(-1)] = 0.0
        mass[place // tets.ROW, place % tets.ROW // tets.STRIDE] = (
            0.25 * 1.25 * (1.0 + alpha) * (rows + 2.0 * self.at_corners(springs))
        )

    def other_cuts(self, corner: np.ndarray, element: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the loaded triangles (k,) that are halves of sides of hexahedra, and for each the first words in x (k,
        3) of the corners of a half of the same side that is cut the other way; both halves have another one each.
        corner (m, 3): where theirs begin in x; element (m,): indices among the owned elements."""
        hex_of = self.numbers()
        of = np.flatnonzero(hex_of[element] >= 0)
        which = hex_of[element[of]]
        inside = (corner[of] - tets.ROW * self.rows[which, :1]) // tets.STRIDE
        a, b, c = np.take_along_axis(self.of[which], inside, axis=1).T
        return of, np.take_along_axis(self.place[which], hexahedra.OTHER_CUT[a, b, c], axis=1)
