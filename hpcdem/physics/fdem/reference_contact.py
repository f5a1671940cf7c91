"""Plain form of kernels/contact_space.py for one face and one tetrahedron, in points of space. Read it beside the
kernel; tests compare both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpcdem.physics.fdem.tetrahedra import FACES


class Touch(NamedTuple):
    """Action of a target on a face: normal force [N], centre of the force (3,) [m], area inside [m2], largest phi."""

    normal: float
    centre: np.ndarray
    area: float
    deepest: float


def clipped(polygon: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """The part of a convex polygon (n, 3) where normal . p + offset >= 0 (Sutherland & Hodgman 1974)."""
    out = []
    for one, other in zip(polygon, np.roll(polygon, -1, axis=0)):
        d, e = float(normal @ one) + offset, float(normal @ other) + offset
        if d >= 0.0:
            out.append(one)
        if d * e < 0.0:
            out.append(one + d / (d - e) * (other - one))
    return np.array(out).reshape(-1, 3)


def sides(target: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """phi = min(normals @ p + offsets) inside a target (4, 3): normals (4, 3) [1/m] and offsets (4,). length: h [m], 0:
    Munjiza's potential 4 min lambda_k; else the distance to the nearest side over h."""
    planes = np.linalg.inv(np.column_stack([target, np.ones(4)])).T  # lambda_k = planes[k] . (p, 1)
    if length == 0.0:
        return 4.0 * planes[:, :3], 4.0 * planes[:, 3]
    scale = length * np.linalg.norm(planes[:, :3], axis=1)
    return planes[:, :3] / scale[:, None], planes[:, 3] / scale


def touch(face: np.ndarray, target: np.ndarray, length: float, penalty: float) -> Touch | None:
    """Compute the contact of a face (3, 3), whose outward normal is counter-clockwise, and a target (4, 3); None: they
    do not touch."""
    normals, offsets = sides(target, length)
    force, moment, area, deepest = 0.0, np.zeros(3), 0.0, 0.0
    for k in range(4):
        part = clipped(face, normals[k], offsets[k])
        for j in range(4):
            if j != k and len(part):
                part = clipped(part, normals[j] - normals[k], offsets[j] - offsets[k])
        for i in range(2, len(part)):
            corners = part[[0, i - 1, i]]
            size = 0.5 * float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])))
            middles = 0.5 * (corners + np.roll(corners, -1, axis=0))  # exact for what is of second degree
            phi = middles @ normals[k] + offsets[k]
            force += size * float(phi.mean())
            moment += size * (phi[:, None] * middles).mean(axis=0)
            area += size
            deepest = max(deepest, float((corners @ normals[k] + offsets[k]).max()))
    return Touch(penalty * force, moment / force, area, deepest) if force > 0.0 else None


def shares(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Barycentric coordinates of a point in a triangle (3, 3) or tetrahedron (4, 3)."""
    both = np.vstack([corners.T, np.ones(len(corners))])
    return np.linalg.lstsq(both, np.append(point, 1.0), rcond=None)[0]


def pair_forces(
    face: np.ndarray, target: np.ndarray, speeds: tuple[np.ndarray, np.ndarray], length: float,
    law: tuple[float, float, float], before: np.ndarray, dt: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Forces (7, 3) [N] on the corners of a face (3, 3) and of its target (4, 3), and the friction force (3,) that the
    pair remembers; speeds: of both [m/s]; law: normal and shear penalty [Pa], tan(phi); before: the friction force
    until now [N]."""
    found = touch(face, target, length, law[0])
    if found is None:
        return np.zeros((7, 3)), np.zeros(3)
    n = np.cross(face[1] - face[0], face[2] - face[0])
    n /= np.linalg.norm(n)
    of_face, of_target = shares(face, found.centre), shares(target, found.centre)
    slide = of_face @ speeds[0] - of_target @ speeds[1]
    across = np.eye(3) - np.outer(n, n)
    friction = across @ before - law[1] * np.sqrt(found.area) * dt * (across @ slide)
    size, most = float(np.linalg.norm(friction)), law[2] * found.normal
    if size > most:
        friction *= most / size
    force = friction - found.normal * n
    return np.concatenate([of_face[:, None] * force, -of_target[:, None] * force]), friction


def tetrahedra_forces(one: np.ndarray, other: np.ndarray, length: float, penalty: float) -> np.ndarray:
    """Forces (8, 3) [N] on the corners of two tetrahedra (4, 3) of which all faces are contactors, without friction."""
    out, still = np.zeros((8, 3)), (np.zeros((3, 3)), np.zeros((4, 3)))
    for own, own_at, target, at in ((one, 0, other, 4), (other, 4, one, 0)):
        for corners in FACES:
            found, _ = pair_forces(
                own[corners], target, still, length, (penalty, 0.0, 0.0), np.zeros(3), 1.0
            )  # fmt: skip
            out[own_at + corners] += found[:3]
            out[at : at + 4] += found[3:]
    return out
