"""Masses of the corners of elements that a rank holds, and the time step that they allow."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import build, connectivity
from hpcdem.physics.fdem.elements import tangent
from hpcdem.physics.fdem.hexes import place_masses
from hpcdem.physics.fdem.joints import laws_of
from hpcdem.physics.fdem.kernels import joint_law, limits, space
from hpcdem.physics.fdem.loads import impedances
from hpcdem.physics.fdem.mesh import pieces
from hpcdem.physics.fdem.moduli import element_table
from hpcdem.physics.fdem.node_set import ALPHA
from hpcdem.physics.fdem.pairs import Surfaces
from hpcdem.physics.fdem.pairs_space import ShapesSpace
from hpcdem.physics.fdem.tetrahedra import FACES, face_areas

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def quarters(sim: State, number: np.ndarray) -> np.ndarray:
    """Quarter of the mass of each of these tetrahedra (n, 4) [kg], also where six of them store a hexahedron."""
    mesh, mass = sim.reference, np.zeros((len(number), 4))
    space.masses(number, mesh.points, mesh.cells, sim.element_row, element_table(sim), mass)
    return mass


def _faces(number: np.ndarray) -> np.ndarray:
    """(4 n,) faces of elements (n,)."""
    faces: np.ndarray = (4 * number[:, None] + np.arange(4)).reshape(-1)
    return faces


class Masses:
    """Masses of the `Local` that makes them. true (n, 4) [kg/m], in space [kg]; of_motion (n, 4): masses in the
    equation of motion."""

    def __init__(self, local: Any) -> None:
        self.local, self.sim = local, local.sim
        self._true = self._of_motion = self.of_corners(self.sim, self.sim.number)

    @staticmethod
    def of_corners(sim: State, number: np.ndarray) -> np.ndarray:
        """True masses (n, 4) [kg/m], in space [kg], of the corners of these elements."""
        mesh, mass = sim.reference, np.zeros((len(number), 4))
        build.masses(number, mesh.points, mesh.cells, sim.element_row, element_table(sim), mass)
        return mass

    @property
    def true(self) -> np.ndarray:
        return self._true

    @property
    def of_motion(self) -> np.ndarray:
        return self._of_motion

    def forget(self) -> None:
        """Free the masses that are not needed before they are set again."""

    def alike(self) -> bool:
        """Share one table while nothing is added to the masses: only static runs and mass scaling add to them."""
        o = self.sim.options
        return o.dynamic and o.mechanical and o.mass_scaling == 0.0

    def set(self) -> None:
        """Masses that the motion sees, and the time step. Collective."""
        sim, o = self.sim, self.sim.options
        self._of_motion = mass = self.true if self.alike() else self.true.copy()
        if not o.dynamic or not o.mechanical:
            self._make_static(mass)
            sim.clock.dt = 1.0
        else:
            wanted = sim.rebuild_state.dt == 0.0
            if wanted or o.mass_scaling > 0.0:
                critical = self.critical_time_step(o.mass_scaling, mass)
                if wanted:
                    sim.rebuild_state.dt = o.dt or o.mass_scaling or critical
                    sim.rebuild_state.estimated = sim.clock.step
                    sim.report_time_step(sim.rebuild_state.dt, critical, self.added() if o.mass_scaling > 0.0 else 0.0)
            sim.clock.dt = sim.rebuild_state.dt

    def added(self) -> float:
        """Mass that mass scaling has added, over the true mass. Collective."""
        comm, own = self.sim.comm, self.sim.owned
        true = exact_sum(self.true[own], comm)
        return exact_sum(self.of_motion[own] - self.true[own], comm) / true

    def critical_time_step(self, target: float = 0.0, mass: np.ndarray | None = None) -> float:
        """Stability limit times the safety factor [s]; infinite in static mode. target: raise `mass` (n, 4) until this
        time step is stable. Collective."""
        sim, o = self.sim, self.sim.options
        if not o.dynamic:
            return math.inf
        least = self._stable_time_step(target, self.true.copy() if mass is None else mass)
        return sim.safety() * float(sim.comm.min_into(np.array([least]))[0])

    def row_sums(self) -> np.ndarray:
        """Sums of |K_ij| over a row of the stiffness at each corner (n, 4) [N/m per m], in space [N/m]. Collective."""
        masses = np.zeros_like(self.true)
        self._make_static(masses)
        return masses / (0.25 * 1.25 * (1.0 + ALPHA))

    def _stable_time_step(self, target: float, mass: np.ndarray) -> float:
        """Stable time step of the elements of this rank, see `limits.time_step`."""
        o, local = self.sim.options, self.local
        triangles, quads = local.solids.blocks
        return limits.time_step(
            triangles.stiff, quads.stiff, local.triangle_rows[: local.count], local.quad_rows, self.sim.owned.start,
            *self.springs(), o.mass_damping, o.stiffness_damping, self.sim.safety(), target, mass,
        )  # fmt: skip

    def _make_static(self, mass: np.ndarray) -> None:
        local, (triangles, quads) = self.local, self.local.solids.blocks
        limits.static_masses(
            triangles.stiff, quads.stiff, local.triangle_rows[: local.count], local.quad_rows, self.sim.owned.start,
            self.springs()[0], ALPHA, mass,
        )  # fmt: skip

    def springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n_own, 4) [N/m per m], in space [N/m], at each corner: of its joints, of what the contact of its
        free faces can have, and of surface loads. And the dashpots (n_own, 4) [N s/m per m], in space [N s/m], of these
        contacts and of quiet faces. Collective.

        Other elements appear in it only by the largest 1 / altitude of the model. Where elements are of one size the
        contact of two faces is about that stiff; elsewhere the smallest elements limit the time step by themselves. (It
        must not follow from who is near: a restart makes new lists.)
        """
        sim, n = self.sim, self.sim.n_own
        springs, dashpots = np.zeros((n, 4)), np.zeros((n, 4))
        highest, some, ratio = self._of_contact() if sim.options.collision else (0.0, 0.0, 0.0)
        heavy = self.true[sim.owned].max(axis=1, initial=0.0)
        for at in pieces(n):
            self._add_springs(at, highest, some == 0.0, ratio, heavy[at], springs[at], dashpots[at])
        sim.surface_loads.springs(sim, springs)
        sim.surface_loads.dashpots(sim, dashpots)
        return springs, dashpots

    def _of_contact(self) -> list[float]:
        """Largest 1 / h [1/m], 1 if a face does not leave its contact to joints, largest damping ratio. Collective."""
        found, cells = np.zeros(3), self.sim.reference.cells
        for at in pieces(self.sim.n_own):
            shapes, surfaces = self._surfaces(at)
            silent = np.isnan(surfaces.overlay) | ~np.isnan(surfaces.normal)
            real = cells[self.sim.number[self.sim.owned][at]].reshape(-1) >= 0
            steep = self._inverse_altitudes(shapes, at).max()
            np.maximum(found, [steep, float(silent[real].any()), surfaces.ratio.max()], out=found)
        most: list[float] = self.sim.comm.max_into(found).tolist()
        return most

    def _surfaces(self, at: slice) -> tuple[Any, Surfaces]:
        """Shapes, of which some of the owned elements are a part, and properties of the faces of these."""
        own, shapes = self.sim.owned, self.local.shapes
        rows = np.arange(own.start, own.stop)[at]
        return shapes, Surfaces(self.sim, shapes, _faces(self.sim.number[own][at]), np.repeat(rows, 4))

    def _inverse_altitudes(self, shapes: Any, at: slice) -> np.ndarray:
        """The largest 1 / altitude (m,) [1/m] of some of the owned elements."""
        own = self.sim.owned
        inverse: np.ndarray = shapes.length[own][at].max(axis=1) / shapes.double_area[own][at]
        return inverse

    def _add_springs(
        self, at: slice, highest: float, among: bool, ratio: float, heavy: np.ndarray, springs: np.ndarray,
        dashpots: np.ndarray,
    ) -> None:  # fmt: skip
        """Add those of some of the owned elements; heavy: their heaviest corner [kg/m]; the others see `_of_contact`
        and `Surfaces.most_penalty`. Joint: half the largest penalty. Contact on a face of length L: P (3/2) (L / h + L
        / h_other), h: altitude on the face, h_other: the smallest altitude of all elements."""
        sim, shapes, own = self.sim, self.local.shapes, self.sim.owned
        number = sim.number[own][at]
        cells = sim.the_mesh().cells[number]
        corners = connectivity.corner_counts(cells)
        faces = _faces(number).reshape(-1, 4)
        real, length = cells >= 0, shapes.length[own][at]
        penalty = joint_law.stiffest(
            sim.joint_rows.column, laws_of(sim.joint_rows), sim.joint_row[faces], lambda: length
        )
        closed = sim.closed_faces()[faces] & real
        tied = closed & (sim.joint_row[faces] > 0)
        each, drag = np.where(tied, 0.5 * penalty, 0.0), np.zeros(faces.shape)
        if sim.options.collision:
            most = self._surfaces(at)[1].most_penalty(among).reshape(-1, 4)
            contact = 1.5 * most * (length * length / shapes.double_area[own][at][:, None] + length * highest)
            may_touch = real & ~closed
            if sim.options.dynamic:
                may_touch |= tied  # once they break
            each = np.maximum(each, np.where(may_touch, contact, 0.0))
            # Half of 2 xi sqrt(k m) L, with k L = 2 `contact` and m L no more than two corners of the element have.
            drag = np.where(may_touch, ratio * np.sqrt(2.0 * contact * (2.0 * heavy[:, None])), 0.0)
        quiet = sim.quiet_faces()[faces] & real
        if quiet.any():
            drag = drag + np.where(quiet, 0.5 * impedances(sim, number)[0][:, None] * length, 0.0)
        before = np.where(np.arange(4) > 0, np.arange(4) - 1, corners[:, None] - 1)
        for part, corner in ((each, springs), (drag, dashpots)):
            corner[real] = (part + np.take_along_axis(part, before, axis=1))[real]


class MassesSpace(Masses):
    """The true ones are made when they are requested where steps have no need of them."""

    def __init__(self, local: Any) -> None:
        self.local, self.sim = local, local.sim
        self._of_motion = np.empty((0, 4))

    @staticmethod
    def of_corners(sim: State, number: np.ndarray) -> np.ndarray:
        mass = quarters(sim, number)
        if len(sim.the_mesh().hexes):
            place_masses(sim, number, mass)
        return mass

    @property
    def true(self) -> np.ndarray:
        if self.alike() and len(self._of_motion):
            return self._of_motion
        return self.of_corners(self.sim, self.sim.number)

    @property
    def of_motion(self) -> np.ndarray:
        return self._of_motion if len(self._of_motion) else self.true

    def forget(self) -> None:
        """Free the masses, which steps do not need, unless the energy budget does."""
        if self.alike() and self.sim.budget is None:
            self._of_motion = np.empty((0, 4))

    def _surfaces(self, at: slice) -> tuple[ShapesSpace, Surfaces]:
        number = self.sim.number[self.sim.owned][at]
        shapes = ShapesSpace(self.sim, number)
        return shapes, Surfaces(self.sim, shapes, _faces(number), np.repeat(np.arange(len(number)), 4))

    def _inverse_altitudes(self, shapes: ShapesSpace, at: slice) -> np.ndarray:
        inverse: np.ndarray = 1.0 / shapes.double_area
        return inverse

    def _add_springs(
        self, at: slice, highest: float, among: bool, ratio: float, heavy: np.ndarray, springs: np.ndarray,
        dashpots: np.ndarray,
    ) -> None:  # fmt: skip
        """Joint: k = P sqrt(A) / 3 with the largest P; contact: P A (1 / h + 1 / h_other) / 3 per face; quiet faces:
        rho c_p A / 3. heavy in kg."""
        sim = self.sim
        number = sim.number[sim.owned][at]
        faces, slots = _faces(number), slice(4 * at.start, 4 * at.stop)
        quiet = sim.quiet_faces()[faces].reshape(-1, 4)
        if quiet.any():
            impedance = impedances(sim, number)[0][:, None] / 3.0
            areas = face_areas(sim.reference.points, sim.reference.cells[number])
            each = np.where(quiet, impedance * areas, 0.0)
            for k in range(4):
                dashpots[:, FACES[k]] += each[:, k, None]
        size = self.local.slot_size[slots]
        penalty = joint_law.stiffest(
            sim.joint_rows.column, laws_of(sim.joint_rows), sim.joint_row[faces],
            lambda: np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0),
        )  # fmt: skip
        tied = sim.closed_faces()[faces] & (sim.joint_row[faces] > 0)
        each = np.zeros(len(faces))
        each[tied] = penalty[tied] / size[tied] / 3.0
        each = np.repeat(each.reshape(-1, 4, 1), 3, axis=2)
        if (sides := self.local.sides) is not None:
            slot = sides.slot[sides.quad]
            here = (slot >= slots.start) & (slot < slots.stop)
            each.reshape(-1, 3)[slot[here] - slots.start] *= sides.shares()[here]
        if not sim.options.collision:
            for k in range(4):
                springs[:, FACES[k]] += each[:, k]
            return
        shapes, surfaces = self._surfaces(at)
        most = surfaces.slope * surfaces.most_penalty(among).reshape(-1, 4)
        contact = most * shapes.area / 3.0 * (1.0 / shapes.double_area[:, None] + highest)
        may_touch = ~sim.closed_faces()[faces]
        if sim.options.dynamic:
            may_touch |= tied  # once they break
        contact = np.where(may_touch.reshape(-1, 4), contact, 0.0)
        # A third of 2 xi sqrt(k m) A, with k A = 3 `contact` and m A no more than three corners of the element have.
        drag = 2.0 * ratio * np.sqrt(contact * heavy[:, None])
        for k in range(4):
            springs[:, FACES[k]] += np.maximum(each[:, k], contact[:, k, None])
            dashpots[:, FACES[k]] += drag[:, k, None]

    def _stable_time_step(self, target: float, mass: np.ndarray) -> float:
        o = self.sim.options
        springs = self.springs()
        rows, c = self._tetrahedra()
        found = space.time_step(
            c, rows, self.sim.n_left, *springs, o.mass_damping, o.stiffness_damping, self.sim.safety(), target, mass
        )
        return found if self.local.hexes is None else min(found, self.local.hexes.time_step(*springs, target, mass))

    def _tetrahedra(self) -> tuple[np.ndarray, np.ndarray]:
        """Storage rows and constants, with the largest moduli, of the elements that are no parts of hexahedra."""
        rows = self.local.rows[: self.local.count]
        stiff = self.local.solids.blocks[0].stiff
        if self.local.hexes is None:
            return rows, stiff
        alone = np.ones(self.local.count, bool)
        alone[self.local.hexes.rows - self.sim.n_left] = False
        return rows[alone], stiff[: self.local.count][alone]

    def _make_static(self, mass: np.ndarray) -> None:
        springs = self.springs()[0]
        rows, c = self._tetrahedra()
        space.static_masses(c, rows, self.sim.n_left, springs, ALPHA, mass)
        if self.local.hexes is not None:
            of = self.local.solids.blocks[1]
            k = np.empty((of.count, 24, 24))
            tangent.elastic(of.tables._replace(c=of.stiff), of.alone, of.s0[:0], True, k)
            self.local.hexes.static_masses(k, springs, ALPHA, mass)
