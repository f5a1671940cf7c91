"""Changes of a model between steps: elements taken out, cracks made, velocities and displacements set anew."""

from __future__ import annotations

import numpy as np

from hpcdem.blocks.looking import Looking
from hpcdem.blocks.scene import Fading, Numbers, _finite
from hpcdem.errors import CommandError


class Changing(Looking):
    """Verbs of `Blocks` that act on what moves. All collective."""

    def option(
        self, dynamic: bool | None = None, collision: bool | None = None, large_strain: bool | None = None
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. Velocities become zero when it is
        changed, as those of the static mode are ways per step. collision (on): contact. large_strain (on): rotations of
        any size; off: geometry of the mesh."""
        before = self.options.dynamic
        super().option(dynamic, collision, large_strain)
        if self.options.dynamic != before:
            self.v[:] = 0.0

    def crack(self, joints: Numbers) -> None:
        """Open inner edges without an event: a crack that is there from the beginning. Faces meet by contact."""
        at = self.numbers_of_joints(joints)
        self._before_change()
        self._open_faces(at)
        self._changed(topology=True)

    def null(self, elements: Numbers, relax: float = 0.0) -> None:
        """Take elements out for good: no mass, no force, no contact; faces beside them become free.

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
        self.memories = self.memories.take(stay).without_partners(dying)
        if left is not None:
            begin = self.clock.time if self.options.dynamic else float(self.clock.step)
            self.fading.append(Fading(*left, begin, span, not self.options.dynamic))
        self.ownership.wanted = True
        self._changed(topology=True)

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
        """Forget what elements remember of yielding: nothing, in elastic models."""
        self.numbers_of_elements(elements)

    def reset_joint_state(self, joints: Numbers = None) -> None:
        """Joints are whole again, without history; those that were broken hold again where they are."""
        at = self.numbers_of_joints(joints)
        at = at[self.joint_row[at] > 0]
        self._before_change()
        again = at[self.broken[at] > 0]
        self.broken[again] = 0
        self.open[again] = self.open[self.partner[again]] = False
        forget = np.zeros(len(self.partner), bool)
        forget[at] = forget[self.partner[at]] = True
        self.memories = self.memories.without_joints(self.number, forget)
        self._changed(topology=True)

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
