"""The tangent of tetrahedra and of the joints between them, as `equilibrium` asks for it."""

from __future__ import annotations

from typing import cast

import numpy as np

from hpcdem.physics.fdem.joints_hexes import Faces
from hpcdem.physics.fdem.kernels import plastic_hexes, tet_stiffness, tets
from hpcdem.physics.fdem.kernels.joints import BROKEN, YIELDED
from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.fdem.local_space import LocalSpace
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.simulation import Blocks


def of_joints(sim: Blocks, slots: np.ndarray, softening: bool) -> tuple[list[Pieces], int]:
    """See `equilibrium.of_joints`; slots: of the owned joints, each once."""
    sim.prepare_kernels("tangent-space")
    local = cast(LocalSpace, sim.local)
    found: list[Pieces] = []
    past = 0
    for which, joints in local.triangles(slots):
        made, behind = _stiffness(local, joints, softening)
        past += behind
        corners = sim.the_mesh().face_corners
        face = local.slot_face[slots[which]]
        ends = np.column_stack([corners(faces) for faces in (face, sim.partner[face])])
        if len(found) == 1:
            assert local.sides is not None
            of = np.searchsorted(local.sides.slot, slots[which])
            way, ends = local.sides.ways(of), local.sides.corners(of)
            made = np.einsum("nai,nab,nbj->nij", way, made, way, optimize=True)
        found.append(Pieces(face, sim.node.reshape(-1)[ends], made))
    return found, past


def _stiffness(local: LocalSpace, joints: Faces, softening: bool) -> tuple[np.ndarray, int]:
    """K (n, 18, 18) of joints of triangles, and how many of them are behind their peak, see `of_joints`."""
    slots, face, link, size, kind, state, history, where, x = joints
    found, left = np.empty((len(slots), 18, 18)), np.empty(len(slots))
    of = face, link, size, kind
    tet_stiffness.intact_joints(slots, *of, state, where, x, local.joint_table, found, left)
    behind = left < 0.0
    slides = state[slots] > BROKEN
    past = int((behind & ~slides & ~(softening & (state[slots] >= YIELDED))).sum())
    behind &= softening | slides
    if behind.any():
        soft = np.empty((int(behind.sum()), 18, 18))
        tet_stiffness.yielded_joints(slots[behind], *of, history, where, x, local.joint_table, local.joint_beyond, soft)
        found[behind] = soft
    return found, past


def of_elements(sim: Blocks, flows: bool) -> list[Pieces]:
    """See `equilibrium.of_elements`."""
    sim.prepare_kernels("tangent-space")
    local, small = cast(LocalSpace, sim.local), not sim.options.large_strain
    rows = local.rows[: local.count]
    found = np.empty((len(rows), 12, 12))
    (c, s0), (h, quad_s0) = local.linear()
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
    of_hexes = hexes.stiffness(h, quad_s0)
    if local.yields and flows and local.hexes_yield.any():
        which = np.flatnonzero(local.hexes_yield)
        stress, turn = np.empty((len(which), 10, 3, 3)), np.empty((len(which), 10, 3, 3))
        of = which, hexes.place, sim.x, hexes.parts, hexes.h
        plastic_hexes.trials(*of, local.quad_s0, small, stress, turn)
        values, axes = principal(stress.reshape(-1, 3, 3))
        axes = _product(turn.reshape(-1, 3, 3), axes).reshape(-1, 10, 3, 3)
        part = of_hexes[which]
        plastic_hexes.soften(
            *of, values.reshape(-1, 10, 3), axes, local.quad_law, local.yield_table, small, part
        )  # fmt: skip
        of_hexes[which] = part
    return [
        Pieces(number[alone], sim.node[number[alone]], found[alone]),
        Pieces(hexes.number, nodes, of_hexes),
    ]  # fmt: skip


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (n, 3, 3) of matrices, with the same bits wherever they stand."""
    return a[:, :, 0, None] * b[:, 0, None] + (a[:, :, 1, None] * b[:, 1, None] + a[:, :, 2, None] * b[:, 2, None])
