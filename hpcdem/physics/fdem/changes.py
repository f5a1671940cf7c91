"""Changes of a model between steps: elements taken out and brought back, cracks made, velocities set."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import backfill, build, connectivity
from hpcdem.physics.fdem import mesh as meshes
from hpcdem.physics.fdem.definition import Numbers, Relaxation, _finite
from hpcdem.physics.fdem.diagnostics import Looking
from hpcdem.physics.fdem.kernels.plasticity import IN_SHEAR, IN_TENSION, SHEAR, VOLUME
from hpcdem.physics.fdem.local import element_table
from hpcdem.physics.fdem.properties import ELEMENT, MECH_MOHR_COULOMB, model
from hpcdem.physics.fdem.tables import Value

TORN = 0.1
"""Where the corners that meet in a point are farther apart than this much of the mean edge, the body is torn there:
elements that come back do not hang together with it. Others may reach into them by as much."""


class Changing(Looking):
    """Commands of `Blocks` that act on what moves. All collective."""

    def option(
        self,
        dynamic: bool | None = None,
        collision: bool | None = None,
        large_strain: bool | None = None,
        overlap: str | None = None,
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. Velocities become zero when it is
        changed, as those of the static mode are ways per step. collision (on): contact. large_strain (on): rotations of
        any size; off: geometry of the mesh. overlap ("refuse"): of bodies that overlap before the first step: refuse
        it; "relax": a static stage moves them apart; "keep": they start as they are."""
        before = self.options.dynamic
        super().option(dynamic, collision, large_strain, overlap)
        if self.options.dynamic != before:
            self.v[:] = 0.0

    def crack(self, joints: Numbers) -> None:
        """Open inner edges without an event: a crack that is there from the beginning. Faces meet by contact."""
        at = self.numbers_of_joints(joints)
        self._before_change()
        self._open_faces(at)
        self._changed(topology=True)

    def null(self, elements: Numbers, relax: float = 0.0) -> None:
        """Take elements out: no mass, no force, no contact; faces beside them become free.

        relax: what they did to the elements that stay dies down linearly over this model time [s] (in static mode:
        over so many steps) instead of at once.
        """
        at = self.numbers_of_elements(elements)
        span = float(_finite("relax", [relax])[0])
        if span < 0.0:
            raise CommandError(f"relax must not be negative, got {relax:g}")
        if len(at) == int(self.alive.sum()):
            raise CommandError("all elements that are left would be taken out")
        dying = np.zeros(len(self.alive), bool)
        dying[at] = True
        left = self._forces_left_behind(dying) if span > 0.0 and len(at) else None
        self._before_change()
        self.alive[at] = False
        faces = (4 * at[:, None] + np.arange(4)).reshape(-1)
        beside = self.partner[faces]
        self.open[faces[beside >= 0]] = True
        self.open[beside[beside >= 0]] = True
        stay = np.flatnonzero(~dying[self.number])
        self.number, self.x, self.v = self.number[stay], self.x[stay], self.v[stay]
        self.cold = {name: values[stay] for name, values in self.cold.items()}
        self.histories = self.histories.take(stay).without_partners(dying)
        if left is not None:
            begin = self.clock.time if self.options.dynamic else float(self.clock.step)
            self.relaxations.append(Relaxation(*left, begin, span, not self.options.dynamic))
        self.ownership.wanted = True
        self._changed(topology=True)

    def element_model(self, elements: Numbers, name: str, given: Mapping[str, Value]) -> None:
        """Assign a model (model.blocks.properties) with all its properties to elements; None: to all that are there.
        Elements among these numbers that were taken out come back (see `_bring_back`)."""
        asked = np.flatnonzero(self.alive)
        if elements is not None:
            asked = self._numbers(elements, np.ones(len(self.alive), bool), "element")
        if name == MECH_MOHR_COULOMB.name and len(quads := asked[self.the_mesh().cells[asked, 3] >= 0]):
            raise CommandError(f"element {quads[0]} is a quad: {name} is for triangles")
        if elements is not None:
            self._complete(ELEMENT, asked, model(name, ELEMENT), {}, given)  # refused before anything is done
            back = asked[~self.alive[asked]]
            if len(back):
                self._bring_back(back)
        super().element_model(elements, name, given)

    def _bring_back(self, back: np.ndarray) -> None:
        """Elements (n,) that were taken out are there again, of new material: free of strain and initial stress where
        the void is now (backfill.py), moving with it. Faces between them, and to elements around them, hang together
        without joints and loads, unless they are cracks of the mesh or the body is torn there."""
        mesh, allowed = self.the_mesh(), TORN * self._mean_edge
        cells, n_points = mesh.cells, len(mesh.points)
        own = cells[back]
        on_void = np.zeros(n_points + 1, bool)  # the last one is for the fourth corner of triangles
        on_void[own[own >= 0]] = True
        beside = np.flatnonzero(self.alive & on_void[cells].any(axis=1))
        use = on_void[cells[beside]]
        corner, point = (4 * beside[:, None] + np.arange(4))[use], cells[beside][use]
        x, u, v = (self.corner_values(name, corner)[corner] for name in ("position", "displacement", "velocity"))
        mass = np.zeros((len(beside), 4))
        build.masses(
            beside,
            self.reference.points,
            self.reference.cells,
            self.element_row,
            element_table(self.element_rows),
            mass,
        )
        one = np.ones(len(corner))
        rim = _weighted(x, one, point, n_points)
        apart = np.zeros(n_points)
        np.maximum.at(apart, point, np.hypot(*(x - rim[point]).T))
        known = (np.bincount(point, minlength=n_points) > 0) & (apart <= allowed)
        given = np.hstack(
            [rim - mesh.points, _weighted(u, one, point, n_points), _weighted(v, mass[use], point, n_points)]
        )
        found = backfill.extended(mesh.points, own, known, given) if self.comm.rank == 0 else None
        way, shown, speed = np.split(self.comm.bcast(found), 3, axis=1)
        real = own >= 0
        places = np.where(real[:, :, None], (mesh.points + way)[own], 0.0)
        self._refuse_overlap(back, places, allowed)

        self._before_change()
        self.alive[back] = True
        faces = (4 * back[:, None] + np.arange(4))[real]
        over = self.partner[faces]
        faces, over = faces[over >= 0], over[over >= 0]
        faces, over = faces[self.alive[over // 4]], over[self.alive[over // 4]]
        cracked = np.zeros(len(self.partner), bool)
        rows = meshes.crack_rows(mesh, mesh.edges())
        cracked[mesh.edges().faces[rows, 0]] = True
        cracked |= np.where(self.partner >= 0, cracked[self.partner], False)
        ends = connectivity.face_points(cells, faces)
        hold = ~cracked[faces] & (known[ends].all(axis=1) | np.isin(over // 4, back))
        for side, other in ((faces, over), (over, faces)):
            self.open[side] = ~hold
            self.joint_row[side] = 0
            self.broken[np.minimum(side, other)] = 0
        self.load_row[(4 * back[:, None] + np.arange(4)).reshape(-1)] = 0
        if self.stress0 is not None:
            self.stress0[back] = 0.0
            self.stress0_row[back] = 0
        self.take_births(back, places)
        if self.comm.rank == 0:
            self._append(back, places, shown[own], speed[own], real)
        self._changed(topology=True)
        self._renew_topology()
        self._move_as_one(back, corner, v, mass[use])
        self.ownership.wanted = True
        if self.log is not None:
            self.log.info(
                f"{len(back)} elements are there again, where their place is now and free of stress; they hang "
                f"together with their neighbours by {int((hold & ~np.isin(over // 4, back)).sum())} faces, without "
                "joints"
            )

    def _refuse_overlap(self, back: np.ndarray, places: np.ndarray, allowed: float) -> None:
        """CommandError if elements (n,) cannot be at places (n, 4, 2): turned inside out, over others. Collective."""
        cells = self.the_mesh().cells
        numbers = np.where(cells[back] >= 0, np.arange(4 * len(back)).reshape(-1, 4), -1)
        flat = np.flatnonzero(connectivity.areas(places.reshape(-1, 2), numbers) <= 0.0)
        if len(flat):
            raise CommandError(
                f"element {back[flat[0]]} cannot come back: its place has closed, an element there would be turned "
                "inside out"
            )
        everyone = self.corner_values("position").reshape(-1, 4, 2)
        everyone[back] = places
        problem = backfill.deepest(cells, everyone, back, np.flatnonzero(self.alive), allowed)
        if problem is not None:
            e, f, deep = problem
            raise CommandError(
                f"element {e} cannot come back: element {f} reaches {deep:.3g} m into its place; what lies there is "
                f"taken out first: element c-model null range id {f}"
            )

    def _append(
        self, back: np.ndarray, places: np.ndarray, shown: np.ndarray, speed: np.ndarray, real: np.ndarray
    ) -> None:
        """Rows of elements (n,) that this rank owns from now on: corners (n, 4, 2) at places [m], displacements shown
        there [m] and velocities [m/s]; real (n, 4): which are corners."""

        def rows(values: np.ndarray, width: int) -> np.ndarray:
            out = np.zeros((len(back), width))
            count = min(4, width // 2)
            out[:, : 2 * count] = np.where(real[:, :, None], values, 0.0)[:, :count].reshape(len(back), -1)
            return out

        self.number = np.concatenate([self.number, back])
        self.x = np.concatenate([self.x, rows(places, self.x.shape[1])])
        self.v = np.concatenate([self.v, rows(speed, self.v.shape[1])])
        self._repeat(self.x)
        for name, values in self.cold.items():
            new = rows(places - shown, 8) if name == "home" else np.zeros((len(back), values.shape[1]))
            self.cold[name] = np.concatenate([values, new])
        self.histories = self.histories.joined(np.zeros(len(back), np.int64), self.histories.rows[:0])

    def _move_as_one(self, back: np.ndarray, corner: np.ndarray, v: np.ndarray, mass: np.ndarray) -> None:
        """Corners that have become one node by elements that came back get one velocity: that of those that were there
        (m,) together keeps their momentum, v (m, 2) [m/s], mass (m,) [kg/m]."""
        node = self.node.reshape(-1)
        shared = np.zeros(len(self.node_sizes), bool)
        shared[self.node[back][self.node[back] >= 0]] = True
        use = shared[node[corner]]
        total = np.bincount(node[corner][use], mass[use], minlength=len(shared))
        mean = _weighted(v[use], mass[use], node[corner][use], len(shared))
        mine = self.node[self.number][:, : 4 if self.wide else 3]
        i, k = np.nonzero(mine >= 0)
        j = mine[i, k]
        one = shared[j] & (total[j] > 0.0)
        i, k, j = i[one], k[one], j[one]
        self.v[i, 2 * k], self.v[i, 2 * k + 1] = mean[j, 0], mean[j, 1]
        self._repeat(self.v)

    def _forces_left_behind(self, dying: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners that stay, and what dying elements do to them through common nodes and joints (n, 2) [N/m]."""
        seen = self.evaluate()
        local, mesh = self.local, self.the_mesh()
        parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        # Common nodes: the forces of the dying corners fall to the lowest corner that stays. Every node is looked at by
        # the owner of that corner.
        begin, corner_at = local.node_begin, local.node_corner
        if len(corner_at):
            node = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
            row, k = corner_at // 8, corner_at % 8 // 2
            number = self.number[row]
            dies = dying[number]
            heir = np.full(len(begin) - 1, np.iinfo(np.int64).max)
            np.minimum.at(heir, node[~dies], 4 * number[~dies] + k[~dies])
            mine = np.zeros(len(heir), bool)
            known = heir < np.iinfo(np.int64).max
            at = self.where[heir[known] // 4]
            mine[known] = (at >= self.owned.start) & (at < self.owned.stop)
            use = dies & mine[node]
            flat = seen.force.reshape(-1)
            force = np.column_stack([flat[corner_at[use]], flat[corner_at[use] + 1]])
            parts.append((heir[node[use]], 4 * number[use] + k[use], force))
        # Joints: the forces on this side.
        slot = np.flatnonzero(local.slot_state[: local.slots] > 0)
        face = local.slot_face[slot]
        slot = slot[dying[self.partner[face] // 4] & ~dying[face // 4]]
        face = local.slot_face[slot]
        forces = local.edge_forces(slot)
        e, k = face // 4, face % 4
        n = np.where(mesh.cells[e, 3] >= 0, 4, 3)
        parts.append((face, face, forces[:, :2]))
        parts.append((4 * e + (k + 1) % n, face, forces[:, 2:]))
        table = np.column_stack(
            [np.concatenate([c for c, _, _ in parts]), np.concatenate([f for _, f, _ in parts])]
        ).astype(float)
        rows = np.concatenate(self.comm.allgather(np.hstack([table, np.concatenate([f for *_, f in parts])])))
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        corners, first = np.unique(rows[:, 0].astype(np.int64), return_index=True)
        sums = np.add.reduceat(rows[:, 2:], first, axis=0) if len(first) else np.empty((0, 2))
        return corners, sums

    def set_velocity(self, nodes: Numbers, vx: float | None = None, vy: float | None = None) -> None:
        """Velocities [m/s] as they are now; not a condition."""
        values = [(c, float(_finite("velocity", [v])[0])) for c, v in enumerate((vx, vy)) if v is not None]
        chosen = self._chosen_corners(nodes)
        for c, value in values:
            for k in range(chosen.shape[1]):
                self.v[chosen[:, k], 2 * k + c] = value
        self._repeat(self.v)
        self._changed(stiffness=False)

    def reset_velocity(self, nodes: Numbers = None) -> None:
        """Velocities become zero."""
        self.set_velocity(nodes, 0.0, 0.0)

    def reset_displacement(self, nodes: Numbers = None) -> None:
        """Displacements are counted from here on; stresses stay."""
        chosen = self._chosen_corners(nodes)
        if "home" not in self.cold:
            self.cold["home"] = self.homes()
        for k in range(chosen.shape[1]):
            at = chosen[:, k]
            self.cold["home"][at, 2 * k : 2 * k + 2] = self.x[at, 2 * k : 2 * k + 2]
        self._changed(stiffness=False)

    def reset_state(self, elements: Numbers = None) -> None:
        """That elements have yielded is forgotten: their state bits, and plastic strain is counted from here on.
        Stresses stay, and so does the plastic strain that they depend on. Where no element has a model that yields
        the log says that nothing was changed."""
        at = self.numbers_of_elements(elements)
        if "plastic" in self.cold:
            self._before_change()
            mine = np.isin(self.number, at)
            for column in (SHEAR, VOLUME, IN_SHEAR, IN_TENSION):
                self.cold["plastic"][mine, column] = 0.0
            self._changed(stiffness=False)
        if self.log is not None and not self.yielding()[at].any():
            names = sorted({self.element_rows.name(row) for row in np.unique(self.element_row[at]).tolist() if row})
            self.log.warn_once(
                f"reset state {names}",
                f"element reset state changes nothing: no element has a law with a state of its own "
                f"({', '.join(names) or 'there is no law yet'}); joints have one: face-joint reset state",
            )

    def reset_joint_state(self, joints: Numbers = None) -> None:
        """Damage of joints that hold is forgotten, and their largest opening and slip. Broken ones stay broken."""
        at = self.numbers_of_joints(joints)
        self._before_change()  # those that broke just now are known from here on
        at = at[(self.joint_row[at] > 0) & ~self.open[at]]
        forget = np.zeros(len(self.partner), bool)
        forget[at] = forget[self.partner[at]] = True
        self.histories = self.histories.without_joints(self.number, forget)
        self._changed()

    def _chosen_corners(self, nodes: Numbers) -> np.ndarray:
        """(n_own, 3 or 4) bool: corners of the owned elements at these nodes, as they are when the model is open."""
        self._before_change()
        mesh = self.the_mesh()
        flags = np.zeros(len(mesh.points) + 1, bool)  # the last one is for the fourth corner of triangles
        flags[self.numbers_of_nodes(nodes)] = True
        return flags[mesh.cells[self.number, : 4 if self.wide else 3]]

    def _repeat(self, rows: np.ndarray) -> None:
        """Put the first corners of an open model's rows a second time behind the last one."""
        if not self.wide:
            if rows.shape[1] == 8:
                rows[:, 6:8] = rows[:, 0:2]
            return
        quad = self.the_mesh().cells[self.number, 3] >= 0
        rows[~quad, 6:10] = rows[~quad, 0:4]
        rows[quad, 8:12] = rows[quad, 0:4]


def _weighted(values: np.ndarray, weight: np.ndarray, at: np.ndarray, n: int) -> np.ndarray:
    """Weighted means (n, c) of values (m, c) by place `at` (m,), added in their order; zero where there is none."""
    total, out = np.bincount(at, weight, minlength=n), np.zeros((n, values.shape[1]))
    np.add.at(out, at, values * weight[:, None])
    return np.divide(out, total[:, None], out=out, where=total[:, None] > 0.0)
