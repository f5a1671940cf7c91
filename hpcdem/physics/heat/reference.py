"""One sub-step of heat in plain form: the reference for tests of the kernels."""

from __future__ import annotations

import math

import numpy as np


def sub_step(
    points: np.ndarray, triangles: np.ndarray, k: np.ndarray, capacity: np.ndarray, t: np.ndarray, dt: float,
    held: dict[int, float] | None = None,
) -> np.ndarray:  # fmt: skip
    """Temperatures (np,) after dt [s] of triangles (n, 3), in space tetrahedra (n, 4), with conductivities k (n, 2, 2)
    or (n, 3, 3) [W/(m K)] and heat capacities (n,) [J/(m3 K)]; held: temperature of points."""
    q, mass = np.zeros(len(points)), np.zeros(len(points))
    for corners, tensor, c in zip(triangles, k, capacity):
        matrix = np.column_stack([np.ones(len(corners)), points[corners]])
        area = np.linalg.det(matrix) / math.factorial(len(corners) - 1)
        slopes = np.linalg.inv(matrix)[1:]  # gradients of the shape functions
        q[corners] -= area * slopes.T @ tensor @ (slopes @ t[corners])
        mass[corners] += c * area / len(corners)
    after = t + dt * q / mass
    for point, value in (held or {}).items():
        after[point] = value
    return after


def through_contacts(
    points: np.ndarray, faces: np.ndarray, t: np.ndarray, h: float, near: float, deep: float, samples: int = 4000
) -> np.ndarray:  # fmt: skip
    """Heat (np,) [W/m] that points get from faces (n, 2) that touch, of free surfaces, material on their left: summed
    over samples of each first face, of lower number, that see a second one."""
    q = np.zeros(len(points))
    for i, (a, b) in enumerate(faces.tolist()):
        edge = points[b] - points[a]
        length = np.hypot(*edge)
        out = np.array([edge[1], -edge[0]]) / length
        for c, d in faces[i + 1 :].tolist():
            other = points[d] - points[c]
            if 2.0 * edge @ other > -length * np.hypot(*other):
                continue
            places = []  # along the first and the second face
            for s in (np.arange(samples) + 0.5) / samples:
                u = ((points[a] + s * edge - points[c]) @ edge) / (other @ edge)
                gap = (points[c] + u * other - points[a] - s * edge) @ out
                if 0.0 <= u <= 1.0 and -deep <= gap <= near:
                    places.append((s, u))
            if len(places) < 2:
                continue
            for s, u in (min(places), max(places)):  # half of the length at each of its ends
                heat = (
                    0.5
                    * h
                    * length
                    * len(places)
                    / samples
                    * ((1.0 - u) * t[c] + u * t[d] - (1.0 - s) * t[a] - s * t[b])
                )
                q[[a, b, c, d]] += heat * np.array([1.0 - s, s, u - 1.0, -u])
    return q


def fluid_step(
    points: np.ndarray, ends: np.ndarray, q: np.ndarray, aperture: np.ndarray, s: np.ndarray, w: np.ndarray,
    t: np.ndarray, rock: np.ndarray, dt: float, rho_c: float, k: float, h: float, held: dict[int, float], second: bool,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """Temperatures (n,) after dt [s] of flow nodes at points (n, 2) with fluid w (n,) [m2], through channels with these
    ends (m, 2) and flows q (m,) [m2/s], between rock of these temperatures (n,); and what the rock gets [W/m]."""
    length = np.hypot(*(points[ends[:, 1]] - points[ends[:, 0]]).T)
    inflow: list[list[tuple[float, int, float]]] = [[] for _ in points]
    for (a, b), rate, edge in zip(ends.tolist(), q.tolist(), length.tolist()):
        if rate > 0.0:
            inflow[b].append((rate, a, edge))
        elif rate < 0.0:
            inflow[a].append((-rate, b, edge))
    heat, passes, rise = (np.zeros(len(points)) for _ in range(3))
    for (a, b), edge, delta in zip(ends.tolist(), length.tolist(), aperture.tolist()):
        for node, other in ((a, b), (b, a)):
            passes[node] += 2.0 * h * 0.5 * edge * s[node] ** 2 * (3.0 - 2.0 * s[node])
            rise[node] += k * delta * min(s[a], s[b]) / edge * (t[other] - t[node])
    rise = (rise + passes * (rock - t)) / (rho_c * w)
    rise[list(held)] = 0.0
    for (a, b), rate, edge, delta in zip(ends.tolist(), q.tolist(), length.tolist(), aperture.tolist()):
        up, down = (a, b) if rate > 0.0 else (b, a)
        value = t[up]
        if second and up in held and not inflow[up]:
            later = t[down] + 0.5 * dt * (rise[down] + abs(rate) / w[down] * (t[up] - t[down]))
            value = np.clip(0.5 * (t[up] + later), *sorted((t[up], t[down])))
        elif second and inflow[up] and t[down] != t[up]:
            total = sum(one for one, _, _ in inflow[up])
            before = sum(one * t[node] for one, node, _ in inflow[up]) / total
            distance = sum(one * far for one, _, far in inflow[up]) / total
            r = (t[up] - before) / distance / ((t[down] - t[up]) / edge)
            limiter = (r + abs(r)) / (1.0 + abs(r))
            most = 0.5 * limiter * (t[down] - t[up])
            value += np.clip(most * (1.0 - dt * abs(rate) / w[up]) + 0.5 * dt * rise[up], *sorted((0.0, most)))
        heat[down] += rho_c * abs(rate) * (value - t[down])
        heat[up] -= rho_c * abs(rate) * (value - t[up])
        along = k * delta * min(s[a], s[b]) / edge * (t[a] - t[b])
        heat[b] += along
        heat[a] -= along
    after = t + dt * (heat + passes * (rock - t)) / (rho_c * w + dt * passes)
    for node, value in held.items():
        after[node] = value
    return after, float((passes * (after - rock)).sum())


def fluid_step_in_space(
    points: np.ndarray, corners: np.ndarray, p: np.ndarray, aperture: np.ndarray, viscosity: float, w: np.ndarray,
    t: np.ndarray, rock: np.ndarray, dt: float, rho_c: float, k: float, h: float, held: dict[int, float],
) -> tuple[np.ndarray, float]:  # fmt: skip
    """A step of first order of full triangles with these corners (m, 3), rows of the nodes at points (n, 3), of
    pressure p (n,) [Pa] and fluid w (n,) [m3]: what crosses the median between each two of them; [W] for [W/m]."""
    heat, passes = np.zeros(len(points)), np.zeros(len(points))
    for at, delta in zip(corners, aperture.tolist()):
        x = points[at]
        normal = np.cross(x[1] - x[0], x[2] - x[0])
        double = np.linalg.norm(normal)
        normal /= double
        slopes = np.array([np.cross(normal, x[(i + 2) % 3] - x[(i + 1) % 3]) / double for i in range(3)])
        velocity, warmer = -(delta**2) / (12.0 * viscosity) * (p[at] @ slopes), t[at] @ slopes
        for i in range(3):
            heat[at[i]] -= k * delta * 0.5 * double * slopes[i] @ warmer
            passes[at[i]] += 2.0 * h * double / 6.0
            j = (i + 1) % 3
            median = x.mean(axis=0) - 0.5 * (x[i] + x[j])
            across = np.cross(median, normal)
            rate = delta * velocity @ across * np.sign(across @ (x[j] - x[i]))
            up, down = (at[i], at[j]) if rate > 0.0 else (at[j], at[i])
            heat[down] += rho_c * abs(rate) * (t[up] - t[down])
    after = t + dt * (heat + passes * (rock - t)) / (rho_c * w + dt * passes)
    for node, value in held.items():
        after[node] = value
    return after, float((passes * (after - rock)).sum())
