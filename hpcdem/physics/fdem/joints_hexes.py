"""The tables of the joints on sides of hexahedra that a rank holds, part of `LocalSpace`."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.joints import Joints
from hpcdem.physics.fdem.kernels import joints_hexes
from hpcdem.physics.fdem.kernels.joints import NONE
from hpcdem.physics.fdem.tetrahedra import FACES, ROW, STRIDE

OPPOSITE = np.array([0, 2, 1])
"""Corners p, q, r of the other side that lie opposite a, b, c."""


class HexJoints:
    """slot (m,): joints on sides of hexahedra, the two halves of a side by themselves, in the order of storage; begin,
    at, weights: see `joints_hexes.forces`; quad (m,) bool: there is one hexahedron on the other side, and the other
    half of the side is a joint too. Others are joints as those of tetrahedra."""

    def __init__(self, local: Any) -> None:
        assert local.hexes is not None
        self.local = local
        sim, mesh, hexes = local.sim, local.sim.the_mesh(), local.hexes
        of = hexes.numbers()
        slot = np.flatnonzero(local.slot_state[: local.slots] != NONE)
        self.slot = slot = slot[of[slot // 4] >= 0]
        face, m = local.slot_face[slot], len(slot)
        self.hexahedron = of[slot // 4]
        self.begin = np.concatenate([[0], np.cumsum(np.bincount(self.hexahedron, minlength=hexes.count))])
        self.at = np.zeros((m + 3, joints_hexes.CORNERS), np.int32)
        self.weights = np.zeros((m + 3, joints_hexes.WEIGHTS))
        corner = hexes.corner_of[slot // 4 + sim.n_left]
        self.at[:m, :3] = np.take_along_axis(corner, FACES[slot % 4], axis=1)
        self.at[:m, 4:7] = local.slot_link[slot][:, OPPOSITE]
        self.at[:m, [3, 7]] = self.at[:m, [0, 4]]
        pair = mesh.quads(face, sim.partner)
        self.quad = (pair[:, 0] >= 0) & (sim.joint_row[pair[:, 0]] > 0)
        q = np.flatnonzero(self.quad)
        _, near, g, e = mesh.on_sides(face[q])
        _, over, *_ = mesh.on_sides(sim.partner[face[q]])
        self.weights[q, :4], self.weights[q, 4:7] = g, e
        self.at[q, 3] = hexes.corner_of[sim.where[near // 4], near % 4]
        row = sim.where[over // 4]
        self.lost = int(face[q][row < 0].max(initial=-1))
        self.at[q, 7] = ROW * row + STRIDE * (over % 4)
        local.slot_size[slot] = 1.0 / mesh.joint_lengths(face, sim.partner)
        self.weights[:m, joints_hexes.PER_LENGTH] = local.slot_size[slot]

    def shares(self) -> np.ndarray:
        """(k, 3): of the joints `quad` the part of the stiffness P h / 3 that corners a, b, c have: what a uniform
        traction gives to them."""
        g = self.weights[: len(self.slot)][self.quad, :3]
        return np.where(g < 0.0, (2.0 + 0.5 * g) / 2.0, (2.0 - 0.5 * g) / 4.0)

    def forces(self, force: np.ndarray, v: np.ndarray, keep: bool, of_joints: np.ndarray) -> None:
        """Add those on the corners (n, 16) [N], with keep to of_joints (n, 16) too; histories move on."""
        local, sim, hexes = self.local, self.local.sim, self.local.hexes
        assert hexes is not None
        joints_hexes.forces(
            sim.threads, self.begin, self.slot, self.hexahedron, self.at, self.weights, hexes.place, hexes.h, sim.x, v,
            local.slot_kind, local.slot_state, local.slot_history, local.joint_table, local.joint_beyond, keep,
            of_joints, force, sim.clock.step, local.tally,
        )  # fmt: skip

    def moved(self, which: np.ndarray) -> Joints:
        """Return the joints `which` (n,) as joints of triangles, with corners shifted according to the bilinear
        opening."""
        local, n = self.local, len(which)
        at = local.sim.x.reshape(-1)[self.at[which][:, :, None] + np.arange(3)]
        near, far = at[:, :4], at[:, 4:]
        g, e = self.weights[which, :4, None], self.weights[which, 4:7, None]
        u = g * (far - near)
        shift = e * (0.5 * ((u[:, 0] + (u[:, 1] + u[:, 2])) + u[:, 3]))[:, None]
        x = np.concatenate([near[:, :3] + shift, (far[:, :3] - shift)[:, OPPOSITE]], axis=1)
        corner = np.arange(18 * n).reshape(n, 6, 3)[:, :, 0]
        slots = self.slot[which]
        return Joints(
            np.arange(n), corner[:, :3].copy(), corner[:, 3:].copy(), local.slot_size[slots], local.slot_kind[slots],
            local.slot_state[slots], local.slot_history[slots], x.reshape(-1),
        )  # fmt: skip

    def motions(self, which: np.ndarray) -> np.ndarray:
        """(n, 18, 24): how the corners a, b, c, p, q, r of `moved` move with a, b, c, d of the side and the four
        opposite to them."""
        g, e = self.weights[which, :4], self.weights[which, 4:7]
        shift = 0.5 * e[:, :, None] * g[:, None, :]
        one = np.eye(3, 4) - shift
        near, far = np.concatenate([one, shift], axis=2), np.concatenate([shift, one], axis=2)
        both = np.concatenate([near, far[:, OPPOSITE]], axis=1)
        return np.einsum("nij,kl->nikjl", both, np.eye(3)).reshape(len(which), 18, 24)

    def shared(self, slots: np.ndarray, corner: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners (n, 4) and forces on them (n, 4, 3) [N] of joints (n,), from those of triangles (n, 3) and (n, 3, 3):
        on sides of hexahedra the force on the corners of `moved` goes to all four, see `joints_hexes`."""
        corner, force = np.pad(corner, ((0, 0), (0, 1)), constant_values=-1), np.pad(force, ((0, 0), (0, 1), (0, 0)))
        at = np.flatnonzero(np.isin(slots, self.slot))
        which = np.searchsorted(self.slot, slots[at])
        g, e = self.weights[which, :4], self.weights[which, 4:7]
        force[at] -= g[:, :, None] * (e[:, :, None] * force[at, :3]).sum(axis=1)[:, None]
        corner[at] = self.corners(which)[:, :4]
        return corner, force

    def corners(self, which: np.ndarray) -> np.ndarray:
        """(n, 8): of the same the corners, element * 4 + k."""
        row, word = np.divmod(self.at[which], ROW)
        return 4 * self.local.sim.number[row] + word // STRIDE
