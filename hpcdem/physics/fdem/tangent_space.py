"""The tangent of tetrahedra and of the joints between them, as `equilibrium` asks for it."""

from __future__ import annotations

from typing import cast

import numpy as np

from hpcdem.physics.fdem.kernels import tet_stiffness, tets
from hpcdem.physics.fdem.kernels.joints import YIELDED
from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.fdem.local_space import LocalSpace
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.simulation import Blocks


def of_joints(sim: Blocks, slots: np.ndarray, softening: bool) -> tuple[Pieces, int]:
    """See `equilibrium.of_joints`; slots: of the owned joints, each once."""
    sim.prepare_kernels("tangent-space")
    local, mesh = cast(LocalSpace, sim.local), sim.the_mesh()
    joints, left = np.empty((len(slots), 18, 18)), np.empty(len(slots))
    of = local.slot_face, local.slot_link, local.slot_size, local.slot_kind
    tet_stiffness.intact_joints(slots, *of, local.slot_state, sim.where, sim.x, local.joint_table, joints, left)
    behind = left < 0.0
    past = int((behind & ~(softening & (local.slot_state[slots] >= YIELDED))).sum())
    if softening:
        soft = np.empty((int(behind.sum()), 18, 18))
        tet_stiffness.yielded_joints(
            slots[behind], *of, local.slot_history, sim.where, sim.x, local.joint_table, local.joint_beyond, soft
        )
        joints[behind] = soft
    face = local.slot_face[slots]
    node = sim.node.reshape(-1)
    ends = [node[mesh.face_corners(faces)] for faces in (face, sim.partner[face])]
    return Pieces(face, np.column_stack(ends), joints), past


def of_elements(sim: Blocks, flows: bool) -> list[Pieces]:
    """See `equilibrium.of_elements`."""
    sim.prepare_kernels("tangent-space")
    local, small = cast(LocalSpace, sim.local), not sim.options.large_strain
    rows = local.rows[: local.count]
    found = np.empty((len(rows), 12, 12))
    c, s0, _, _ = local.linear()
    if local.yields:
        _, flowed, _ = local.flowed()
        if local.creeps:
            flowed[local.creeping] = s0[local.creeping]
        s0 = flowed
    tet_stiffness.elastic(rows, sim.x, c, s0, small, found)
    if local.yields and flows:
        who = local.who_yields[: local.yielding]
        stress, turn = np.empty((len(who), 3, 3)), np.empty((len(who), 3, 3))
        tet_stiffness.trials(rows[who], sim.x, local.c[who], local.s0[who], small, stress, turn)
        values, axes = principal(stress)
        part = found[who]
        tet_stiffness.plastic(
            rows[who], sim.x, local.c[who], values, _product(turn, axes), local.law[who], local.yield_table, small, part
        )
        found[who] = part
    number = sim.number[rows]
    if local.hexes is None:
        return [Pieces(number, sim.node[number], found)]
    hexes, alone = local.hexes, np.ones(len(rows), bool)
    alone[hexes.rows - sim.n_left] = False
    corner = hexes.place[: hexes.count]
    nodes = sim.node[sim.number[corner // tets.ROW], corner % tets.ROW // tets.STRIDE]
    return [
        Pieces(number[alone], sim.node[number[alone]], found[alone]), Pieces(hexes.number, nodes, hexes.stiffness())
    ]  # fmt: skip


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (n, 3, 3) of matrices, with the same bits wherever they stand."""
    return a[:, :, 0, None] * b[:, 0, None] + (a[:, :, 1, None] * b[:, 1, None] + a[:, :, 2, None] * b[:, 2, None])
