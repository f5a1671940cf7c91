"""Plain form of elements.py, tets.py, hexes.py, plasticity.py, creep.py, joints.py, joints_space.py and nodes.py, for
one element, joint or node and in small matrices. Read it beside them; tests compare both."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import factorial
from typing import NamedTuple

import numpy as np

from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.kernels.elements import PARTS

ONE = np.eye(2)


class Solid(NamedTuple):
    """Lame's lambda, 2 mu [Pa], viscosity [Pa s], initial stress (2, 2) [Pa], whether strains are small, and the
    stiffness-proportional damping [s]."""

    lame: float
    two_mu: float
    eta: float
    stress0: np.ndarray
    small: bool
    beta: float = 0.0


class Deformation(NamedTuple):
    """Deformation of a triangle: strain U - 1 and its rate [1/s] in the turned frame, rotation R, all (2, 2), and
    gradients (3, 2) [1/m] of the shape functions and area [m2], both of the present triangle, or of the mesh if strains
    are small. For a tetrahedron (3, 3), (4, 3) and its volume [m3]."""

    strain: np.ndarray
    rate: np.ndarray
    rotation: np.ndarray
    gradients: np.ndarray
    area: float


def deformation(mesh: np.ndarray, x: np.ndarray, v: np.ndarray, small: bool) -> Deformation:
    """Compute the deformation from the corners (3, 2) of a triangle, (4, 3) of a tetrahedron, in the mesh and now [m]
    and their velocities [m/s]: F = R U."""
    one = np.eye(mesh.shape[1])
    per_mesh = np.linalg.inv((mesh[1:] - mesh[0]).T)
    f, df = (x[1:] - x[0]).T @ per_mesh, (v[1:] - v[0]).T @ per_mesh
    left, _, right = np.linalg.svd(f)
    r = one if small else left @ right
    strain, rate = r.T @ f - one, r.T @ df
    edges = ((mesh if small else x)[1:] - (mesh if small else x)[0]).T
    gradients = np.vstack([-np.ones(len(one)), one]) @ np.linalg.inv(edges)
    size = float(np.linalg.det(edges)) / factorial(len(one))
    return Deformation(0.5 * (strain + strain.T), 0.5 * (rate + rate.T), r, gradients, size)


def forces_of_strain(d: Deformation, strain: np.ndarray, rate: np.ndarray, solid: Solid) -> np.ndarray:
    """Forces (3, 2) [N/m] on the corners: f_l = -A sigma grad N_l, sigma = R (sigma_0 + lambda tr(e) + 2 mu e + eta
    de/dt) R^T, e the strain and beta times its rate."""
    strain = strain + solid.beta * rate
    sigma = solid.stress0 + solid.lame * np.trace(strain) * np.eye(len(strain))
    sigma = sigma + solid.two_mu * strain + solid.eta * rate
    return -d.area * d.gradients @ (d.rotation @ sigma @ d.rotation.T)


def triangle_forces(mesh: np.ndarray, x: np.ndarray, v: np.ndarray, solid: Solid) -> np.ndarray:
    """Forces (3, 2) [N/m] of the stress of a constant-strain triangle on its corners; mesh, x, v (3, 2)."""
    d = deformation(mesh, x, v, solid.small)
    return forces_of_strain(d, d.strain, d.rate, solid)


def tetrahedron_forces(mesh: np.ndarray, x: np.ndarray, v: np.ndarray, solid: Solid) -> np.ndarray:
    """Forces (4, 3) [N] of the stress of a tetrahedron on its corners; mesh, x, v (4, 3)."""
    return triangle_forces(mesh, x, v, solid)


def quad_forces(mesh: np.ndarray, x: np.ndarray, v: np.ndarray, solid: Solid) -> np.ndarray:
    """Forces (4, 2) [N/m] of a quad: the mean of two overlays of two triangles, in each of which the volume strain (and
    its rate) is the mean by area in the mesh (Marti & Cundall 1982)."""
    force = np.zeros((4, 2))
    for overlay in (PARTS[:2], PARTS[2:]):
        parts = [deformation(mesh[k], x[k], v[k], solid.small) for k in overlay]
        areas = [0.5 * float(np.linalg.det(mesh[k][1:] - mesh[k][0])) for k in overlay]
        volume = np.average([np.trace(d.strain) for d in parts], weights=areas)
        swell = np.average([np.trace(d.rate) for d in parts], weights=areas)
        for k, d in zip(overlay, parts):
            strain = d.strain + 0.5 * (volume - np.trace(d.strain)) * ONE
            rate = d.rate + 0.5 * (swell - np.trace(d.rate)) * ONE
            force[k] += 0.5 * forces_of_strain(d, strain, rate, solid)
    return force


def hexahedron_forces(mesh: np.ndarray, x: np.ndarray, v: np.ndarray, solid: Solid) -> np.ndarray:
    """Forces (8, 3) [N] of a hexahedron: two overlays of five tetrahedra, with means by volume."""
    force = np.zeros((8, 3))
    for overlay in (OVERLAYS[:5], OVERLAYS[5:]):
        parts = [deformation(mesh[k], x[k], v[k], solid.small) for k in overlay]
        volumes = [float(np.linalg.det(mesh[k][1:] - mesh[k][0])) / 6.0 for k in overlay]
        volume = np.average([np.trace(d.strain) for d in parts], weights=volumes)
        swell = np.average([np.trace(d.rate) for d in parts], weights=volumes)
        for k, d in zip(overlay, parts):
            strain = d.strain + (volume - np.trace(d.strain)) / 3.0 * np.eye(3)
            rate = d.rate + (swell - np.trace(d.rate)) / 3.0 * np.eye(3)
            force[k] += 0.5 * forces_of_strain(d, strain, rate, solid)
    return force


class MohrCoulomb(NamedTuple):
    """Bulk and shear modulus [Pa], friction and dilation angle [radians], cohesion and tensile strength [Pa]."""

    bulk: float
    shear: float
    friction: float
    dilation: float
    cohesion: float
    tensile: float


def yield_functions(s: np.ndarray, rock: MohrCoulomb) -> np.ndarray:
    """f (9,) [Pa] of the principal stresses s (3,), in any order: of the six ordered pairs i, j of them in shear,
    N s_j - s_i - 2 c sqrt(N), and of each in tension."""
    return _normals(rock.friction) @ s - _strengths(rock)


def _normals(angle: float) -> np.ndarray:
    n = np.tan(np.pi / 4.0 + 0.5 * angle) ** 2
    pairs = [n * np.eye(3)[j] - np.eye(3)[i] for i in range(3) for j in range(3) if i != j]
    return np.array([*pairs, *np.eye(3)])


def _strengths(rock: MohrCoulomb) -> np.ndarray:
    shear = 2.0 * rock.cohesion * np.tan(np.pi / 4.0 + 0.5 * rock.friction)
    apex = rock.cohesion / np.tan(rock.friction) if rock.friction > 0.0 else np.inf
    return np.array([shear] * 6 + [min(rock.tensile, apex)] * 3)


def returned_stress(trial: np.ndarray, rock: MohrCoulomb) -> np.ndarray:
    """Stress (3, 3) [Pa] at the end of a step with the elastic trial stress (3, 3): Koiter's rule with all nine planes.

    Every choice of at most three of them is tried: the stress lies on these, the plastic strain is a sum of their
    flow directions, and the answer is the one with multipliers >= 0 that lies outside none of the planes.
    """
    s, turn = np.linalg.eigh(trial)
    stiffness = (rock.bulk - 2.0 / 3.0 * rock.shear) * np.ones((3, 3)) + 2.0 * rock.shear * np.eye(3)
    normals, ways, strengths = _normals(rock.friction), _normals(rock.dilation), _strengths(rock)
    ways[6:] = normals[6:]
    size = float(np.abs(s).max()) + rock.cohesion
    best, least = s, np.inf
    for many in range(4):
        for active in map(list, combinations(range(9), many)):
            a, d = normals[active], stiffness @ ways[active].T
            if many and np.linalg.cond(a @ d) > 1e9:
                continue
            multipliers = np.linalg.solve(a @ d, a @ s - strengths[active]) if many else np.zeros(0)
            end = s - d @ multipliers if many else s
            wrong = max(
                float((normals @ end - strengths).max()) / size,
                -float(multipliers.min()) * rock.shear / size if many else 0.0,
            )
            if wrong < least - 1e-11:
                best, least = end, wrong
        if least < 1e-11:
            break
    return (turn * best) @ turn.T


def yielded_tetrahedron(
    mesh: np.ndarray, x: np.ndarray, solid: Solid, rock: MohrCoulomb
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Forces (4, 3) [N] and stress (3, 3) [Pa] of a tetrahedron that has not flowed before, after its flow, and whether
    it flowed; moduli are those of `rock`."""
    d = deformation(mesh, x, np.zeros((4, 3)), solid.small)
    lame = rock.bulk - 2.0 / 3.0 * rock.shear
    trial = solid.stress0 + lame * np.trace(d.strain) * np.eye(3) + 2.0 * rock.shear * d.strain
    stress = d.rotation @ returned_stress(trial, rock) @ d.rotation.T
    flows = bool(yield_functions(np.linalg.eigvalsh(trial), rock).max() > 0.0)
    return -d.area * d.gradients @ stress, stress, flows


def yielded_quad(
    mesh: np.ndarray, x: np.ndarray, stress0: np.ndarray, zz: float, rock: MohrCoulomb, small: bool
) -> list[tuple[Deformation, np.ndarray, bool]]:
    """Compute the plastic flow of the four triangles of a quad that has not flowed before: for each the deformation,
    the stress (3, 3) [Pa] after its flow, and whether it flowed; stress0 (2, 2), zz: initial stress [Pa].

    The pressure in the plane is the mean of the two triangles of an overlay, by volumes that change against each other.
    """
    found = []
    lame = rock.bulk - 2.0 / 3.0 * rock.shear
    for overlay in (PARTS[:2], PARTS[2:]):
        parts = [deformation(mesh[k], x[k], np.zeros((3, 2)), small) for k in overlay]
        areas = [0.5 * float(np.linalg.det(mesh[k][1:] - mesh[k][0])) for k in overlay]
        volume = np.average([np.trace(d.strain) for d in parts], weights=areas)
        ends, flowed = [], []
        for d in parts:
            trial = np.zeros((3, 3))
            strain = d.strain + 0.5 * (volume - np.trace(d.strain)) * ONE
            trial[:2, :2] = stress0 + lame * volume * ONE + 2.0 * rock.shear * strain
            trial[2, 2] = zz + lame * volume
            ends.append(returned_stress(trial, rock))
            flowed.append(bool(yield_functions(np.linalg.eigvalsh(trial), rock).max() > 0.0))
        pressures = [0.5 * np.trace(s[:2, :2]) for s in ends]
        for d, s, p, yes in zip(parts, ends, pressures, flowed):
            more = np.average(pressures, weights=areas) - p
            s = s + more * np.diag([1.0, 1.0, lame / (lame + rock.shear)])
            found.append((d, s, yes))
    return found


def yielded_hexahedron(
    mesh: np.ndarray, x: np.ndarray, solid: Solid, rock: MohrCoulomb
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Forces (8, 3) [N] and mean stress (3, 3) [Pa] of a hexahedron that has not flowed before, after its flow, and
    whether some of it flowed; the pressure of an overlay is the mean by volume of those of its tetrahedra."""
    force, mean, whole, some = np.zeros((8, 3)), np.zeros((3, 3)), 0.0, False
    lame, one = rock.bulk - 2.0 / 3.0 * rock.shear, np.eye(3)
    for overlay in (OVERLAYS[:5], OVERLAYS[5:]):
        parts = [deformation(mesh[k], x[k], np.zeros((4, 3)), solid.small) for k in overlay]
        volumes = [float(np.linalg.det(mesh[k][1:] - mesh[k][0])) / 6.0 for k in overlay]
        volume = np.average([np.trace(d.strain) for d in parts], weights=volumes)
        ends = []
        for d in parts:
            strain = d.strain + (volume - np.trace(d.strain)) / 3.0 * one
            trial = solid.stress0 + lame * volume * one + 2.0 * rock.shear * strain
            some |= bool(yield_functions(np.linalg.eigvalsh(trial), rock).max() > 0.0)
            ends.append(returned_stress(trial, rock))
        pressure = np.average([np.trace(s) / 3.0 for s in ends], weights=volumes)
        for k, d, s, v in zip(overlay, parts, ends, volumes):
            stress = d.rotation @ (s + (pressure - np.trace(s) / 3.0) * one) @ d.rotation.T
            force[k] -= 0.5 * d.area * d.gradients @ stress
            mean, whole = mean + v * stress, whole + v
    return force, mean / whole, some


def burgers_step(
    strain: np.ndarray,
    stress0: np.ndarray,
    crept: np.ndarray,
    kelvin: np.ndarray,
    before: np.ndarray,
    dt: float,
    two_mu: float,
    kelvin_shear: float,
    per_kelvin: float,
    per_maxwell: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Deviator of the stress [Pa], creep strain and strain of the Kelvin unit (3, 3) at the end of a creep step dt [s],
    and what was lost [J/m3]: both rates with the mean of the ends of the step, see kernels/creep.py.

    strain, stress0: at the end, and at zero strain; crept, kelvin, before: creep strain, strain of the Kelvin unit and
    deviator of the stress at the beginning; two_mu: 2 G_M [Pa]; G_K [Pa], 1 / eta_K, 1 / eta_M [1/(Pa s)].
    """
    one = np.eye(3)
    e, s0 = (a - np.trace(a) / 3.0 * one for a in (strain, stress0))
    # S+ = s0 + 2 G_M (e - crept+), crept+ = crept + (kelvin+ - kelvin) + dt (S + S+) / (4 eta_M),
    # kelvin+ (1 + h) = kelvin (1 - h) + dt (S + S+) / (4 eta_K), h = dt G_K / (2 eta_K): linear in (S+, kelvin+).
    h, k, m = 0.5 * dt * kelvin_shear * per_kelvin, 0.25 * dt * per_kelvin, 0.25 * dt * per_maxwell
    matrix = np.array([[1.0 / two_mu + m, 1.0], [-k, 1.0 + h]])
    right = np.array([s0 / two_mu + e - crept + kelvin - m * before, (1.0 - h) * kelvin + k * before])
    then, kelvin_then = np.linalg.solve(matrix, right.reshape(2, -1)).reshape(2, 3, 3)
    rate = kelvin_then - kelvin
    lost = 0.5 * m * ((before + then) ** 2).sum() + (2.0 / (per_kelvin * dt) * (rate**2).sum() if per_kelvin else 0.0)
    return then, crept + rate + m * (before + then), kelvin_then, lost


def joint_forces(
    a: np.ndarray, b: np.ndarray, p: np.ndarray, q: np.ndarray, stresses: Callable[[int, float, float, float], tuple]
) -> np.ndarray:
    """Forces (2, 2) [N/m] on the ends a and b of this side of a joint; p is opposite b, q opposite a (2,) [m].

    stresses: (sigma, tau) [Pa] at Gauss point 0, 1, 2 from its opening and slip and the length of the joint [m]:
    joint_law.intact_point or, past the peak, joint_law.yielded_point.
    """
    along = 0.5 * ((b + p) - (a + q))
    length = float(np.linalg.norm(along))
    t = along / length
    n = np.array([t[1], -t[0]])
    force = np.zeros((2, 2))
    for point, (xi, weight) in enumerate(zip(*np.polynomial.legendre.leggauss(3))):
        shape = 0.5 * np.array([1.0 - xi, 1.0 + xi])
        jump = shape[0] * (q - a) + shape[1] * (p - b)
        sigma, tau = stresses(point, float(jump @ n), float(jump @ t), length)
        force += 0.5 * weight * length * np.outer(shape, sigma * n + tau * t)
    return force


def face_joint_forces(
    corners: np.ndarray, opposite: np.ndarray, stresses: Callable[[int, float, float], tuple]
) -> np.ndarray:
    """Forces (3, 3) [N] on the corners (3, 3) [m] of this side of a joint in space, counter-clockwise from outside;
    `opposite` (3, 3): the corners of the other side, in the same order. stresses: (sigma, tau) [Pa] at Gauss point 0,
    1, 2, near the corner of that number, from its opening and the size of its slip [m]; tau acts along the slip."""
    middle = 0.5 * (corners + opposite)
    twice = np.cross(middle[1] - middle[0], middle[2] - middle[0])
    n, area = twice / np.linalg.norm(twice), 0.5 * float(np.linalg.norm(twice))
    force = np.zeros((3, 3))
    for point in range(3):
        shape = np.full(3, 1.0 / 6.0)
        shape[point] = 2.0 / 3.0
        jump = shape @ (opposite - corners)
        slip = jump - (jump @ n) * n
        size = float(np.linalg.norm(slip))
        sigma, tau = stresses(point, float(jump @ n), size)
        force += area / 3.0 * np.outer(shape, sigma * n + (tau / size * slip if size > 0.0 else 0.0))
    return force


def node_velocity(v: np.ndarray, force: np.ndarray, mass: float, alpha: float, dt: float) -> np.ndarray:
    """Velocity (2,) [m/s] of a node after the kick of the forces (k, 2) [N/m] of its corners, with local damping."""
    total = force.sum(axis=0)
    return v + dt / mass * (total - alpha * np.abs(total) * np.sign(v))
