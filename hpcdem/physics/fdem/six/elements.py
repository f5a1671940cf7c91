"""The tables for the six-node triangles that a rank owns, and the calls of the kernels; part of `Local`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.elements import tangent
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import SIX_NODE_TRIANGLE
from hpcdem.physics.fdem.kernels import elements, limits
from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.fdem.six import kernels

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def check(sim: State) -> None:
    """CommandError where six-node triangles cannot have what was assigned, all of it taken together."""
    mesh = sim.the_mesh()
    if mesh.dim == 3 or not len(mesh.macros):
        return
    parts = mesh.macro.elements(mesh.macros)
    parts = parts[sim.alive[parts[:, 0]]]
    row = sim.element_row[parts]
    for wrong, what in (
        (row != row[:, :1], "has several materials: give all its parts the same"),
        ((row >= 0) & ("free_field" in sim.surface_loads), "cannot be next to free-field sides"),
    ):
        bad = np.flatnonzero(wrong.any(axis=1))
        if len(bad):
            raise CommandError(f"the {mesh.macro.name} of elements {parts[bad[0], 0]} to {parts[bad[0], -1]} {what}")


class SixNodes:
    """Six-node triangles of a `Local`. rows (n, 4): storage rows of their parts; parts (n, 4): of these in the table of
    triangles; from_v, to (n, 6): where the velocity of each node is, and its forces go, of the first corner at it;
    block: themselves; c (n, 23), s0 (n, 3, 4): constants and stress without strain [Pa], see kernels.py."""

    def __init__(self, local: Any, triangles: ElementBlock) -> None:
        self.local, self.sim, self.triangles = local, local.sim, triangles
        sim, mesh, own = self.sim, self.sim.reference, self.sim.owned
        sim.prepare_kernels("six-nodes")
        start = sim.where[mesh.macros[:, -1]]
        mine = np.flatnonzero((start >= own.start) & (start < own.stop))
        table = mesh.macros[mine[np.argsort(start[mine])]]
        self.number = table[:, -1]
        element = mesh.macro.elements(table)
        self.rows = sim.where[element]
        self.parts = local.triangle_of_row[self.rows - sim.n_left]
        first, self._node = mesh.macro.places(mesh.cells, table)
        row, corner = np.take_along_axis(self.rows, first // 4, axis=1), 2 * (first % 4)
        self.from_v, self.to = (width * row + corner for width in (sim.v.shape[1], elements.FORCE))
        self.nodes = sim.node[np.take_along_axis(element, first // 4, axis=1), first % 4]
        self.s0 = np.zeros((len(table), kernels.GAUSS, 4))
        self._make_constants(mesh.points[table[:, :-1]])
        self.block = ElementBlock(
            sim, SIX_NODE_TRIANGLE, self.rows[:, 0], self.c, self.s0, self.rows - sim.n_left,
            np.full(self.rows.shape, 1.0 / kernels.PARTS), (sim.x.shape[1] * row + corner).astype(np.int32),
        )  # fmt: skip
        self._take_over()

    def _make_constants(self, points: np.ndarray) -> None:
        """points (n, 6, 2): their nodes in the mesh."""
        self.c = np.zeros((len(points), kernels.CONSTANTS))
        for p, slopes in enumerate(kernels.SLOPES):
            j = sum(points[:, a, :, None] * slopes[a] for a in range(6))
            self.c[:, 4 * p : 4 * p + 4] = np.linalg.inv(j).reshape(-1, 4)
            if p < kernels.GAUSS:
                self.c[:, kernels.AREA + p] = np.linalg.det(j) / 2.0
        of_part = self.triangles.c[self.parts[:, 0]]
        self.c[:, kernels.LAMBDA :] = of_part[:, [elements.LAMBDA, elements.TWO_MU, elements.ETA, elements.FREE]]

    def _take_over(self) -> None:
        """The parts have no moduli in the table of forces. In that of time steps and of masses of the static mode they
        have those with which triangles would vibrate as fast: omega^2 of a corner is no more than the largest
        eigenvalue of M^-1 K of the element with its share of the masses."""
        local, of, o, at = self.local, self.triangles, self.sim.options, self.parts.reshape(-1)
        of.set_apart()
        stiff = of.stiff[at]
        if o.dynamic and o.mechanical:
            shape = self.c.copy()
            shape[:, kernels.LAMBDA], shape[:, kernels.TWO_MU] = 0.0, self.c[:, kernels.ETA]
            omega2, fade = (np.repeat(self._fastest(local.true_mass, c), 4) for c in (self.c, shape))
            modulus, of_triangle = stiff[:, elements.LAMBDA] + stiff[:, elements.TWO_MU], limits.omegas2(stiff)
            ratio, stiff[:, elements.ETA] = omega2 / of_triangle, fade / of_triangle * modulus
        else:
            mass, none = np.zeros_like(local.true_mass), np.zeros((self.sim.n_own, 4))
            rows = self.rows.reshape(-1).astype(np.int32)
            limits.static_masses(stiff, local.q[:0], rows, local.quad_rows[:0], self.sim.owned.start, none, 0.0, mass)
            ratio = np.repeat(self._fastest(mass / (0.25 * 1.25), self.c), 4)
        stiff[:, of.moduli] *= ratio[:, None]
        of.stiff[at], of.c[at, elements.ETA] = stiff, 0.0
        of.take_moduli(at)

    def _fastest(self, mass: np.ndarray, c: np.ndarray) -> np.ndarray:
        """Largest eigenvalue (n,) of M^-1 K in the mesh, with these masses of corners (rows, 4) and constants."""
        if not c[:, kernels.TWO_MU].any():  # without viscosity
            return np.zeros(len(c))
        at_nodes = np.zeros(self.to.shape)
        np.add.at(at_nodes, (np.arange(len(at_nodes))[:, None], self._node), mass[self.rows].reshape(-1, 16))
        scale = 1.0 / np.sqrt(np.repeat(at_nodes, 2, axis=1))
        return np.asarray(np.linalg.eigvalsh(self._stiffness(c, True) * scale[:, :, None] * scale[:, None, :])[:, -1])

    def pieces(self) -> Pieces:
        """Stiffness at the present positions."""
        return Pieces(self.number, self.nodes, self._stiffness(self.c, not self.sim.options.large_strain))

    def _stiffness(self, c: np.ndarray, small: bool) -> np.ndarray:
        out = np.empty((len(self.to), 12, 12))
        tangent.elastic(self.block.tables._replace(c=c), self.block.alone, self.s0, small, out)
        return out

    def take_stress(self, s0: np.ndarray) -> None:
        """Stress without strain at their Gauss points, the centroids of the first three parts; the parts have none left
        in s0 (count + 3, 4) [Pa]."""
        self.s0[:] = s0[self.parts[:, : kernels.GAUSS]]
        s0[self.parts] = 0.0

    def gather(self, energy: np.ndarray) -> None:
        """Share the energy stored by heat (n_own,) [J/m], given at the Gauss points with a third of the area each,
        among the parts, a quarter each."""
        at = self.rows - self.sim.n_left
        energy[at] = (energy[at[:, : kernels.GAUSS]].sum(axis=1) / kernels.GAUSS)[:, None]

    def add_forces(self, v: np.ndarray, elastic: float, force: np.ndarray) -> None:
        """Add to the rows of the parts (n, 8) [N/m], with these velocities; elastic: see `kernels.forces`."""
        sim, o = self.sim, self.sim.options
        kernels.forces(
            sim.threads, self.block.tables, self.from_v, self.to, v, self.s0, elastic, not o.large_strain,
            o.stiffness_damping, force,
        )  # fmt: skip

    def book(self, before: np.ndarray, v: np.ndarray, dt: float, lost: np.ndarray) -> None:
        """Add the work of viscous forces with the velocities `before` to that of elements (n_own,) [J/m]; v: mean
        velocities in the step."""
        force = np.zeros((len(self.sim.number), elements.FORCE))
        self.add_forces(before, 0.0, force)
        rows = self.rows.reshape(-1)
        lost[rows - self.sim.n_left] += (force[rows, :6] * v[rows, :6]).sum(axis=1) * dt

    def put_stresses(self, at: np.ndarray | None, stress: np.ndarray, energy: np.ndarray) -> None:
        """Stress [Pa] of the parts among these owned elements, all if None, and a quarter of the energy each [J/m]."""
        small, which = not self.sim.options.large_strain, np.full(self.sim.n_own, -1)
        found, whole = np.empty((len(self.to), 4, 4)), np.empty(len(self.to))
        kernels.stresses(self.block.tables, self.s0, small, found, whole)
        which[self.rows.reshape(-1) - self.sim.n_left] = np.arange(self.rows.size)
        which = which if at is None else which[at]
        here = which >= 0
        stress[here] = found.reshape(-1, 4)[which[here]]
        if len(energy):
            energy[here] = 0.25 * whole[which[here] // 4]
