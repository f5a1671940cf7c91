"""One sub-step of flow in plain form: the reference for tests of the kernels."""

from __future__ import annotations

import numpy as np


def straight(aperture: np.ndarray, length: np.ndarray, viscosity: float) -> tuple[np.ndarray, np.ndarray]:
    """Conductance and half of the volume of channels in the plane."""
    return aperture**3 / (12.0 * viscosity) / length, 0.5 * aperture * length


def out_of_triangle(at: np.ndarray, aperture: float, viscosity: float, head: np.ndarray) -> np.ndarray:
    """(3,) what leaves the corners at (3, 3) [m] of a full triangular channel for its middle [m3/s], with these heads
    [Pa]: q . n s / 2, with the flux q of the uniform gradient, n outward on the side opposite the corner, s its
    length."""
    normal = np.cross(at[1] - at[0], at[2] - at[0])
    area = 0.5 * np.linalg.norm(normal)
    normal /= 2.0 * area
    edges = [np.cross(at[(k + 2) % 3] - at[(k + 1) % 3], normal) for k in range(3)]
    gradient = -sum(p * edge for p, edge in zip(head, edges)) / (2.0 * area)
    flux = -(aperture**3) / (12.0 * viscosity) * gradient
    return np.array([0.5 * float(flux @ edge) for edge in edges])


def sub_step(
    ends: np.ndarray, conduct: np.ndarray, half: np.ndarray, bulk: float, energy: np.ndarray, w: np.ndarray, dt: float,
    prescribed: dict[int, float] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Fluid [m2, in space m3], pressure [Pa] and saturation (n,) after dt [s] of links with these ends (m, 2),
    conductances and volumes of each half; energy (n,): rho g z [Pa]; w (n,): fluid before; prescribed: pressure of
    nodes [Pa]."""
    volume = np.zeros(len(w))
    np.add.at(volume, ends, half[:, None])
    s = np.minimum(w / volume, 1.0)
    p = bulk * np.maximum(w / volume - 1.0, 0.0)
    after = w.copy()
    for (a, b), each in zip(ends, conduct):
        head = p[a] + energy[a] - p[b] - energy[b]
        wet = min(0.5 * (s[a] + s[b]), s[a] if head * each > 0 else s[b])
        flow = each * wet**2 * (3.0 - 2.0 * wet) * head
        after[a] -= dt * flow
        after[b] += dt * flow
    for node, value in (prescribed or {}).items():
        after[node] = volume[node] * (1.0 + value / bulk)
    return after, bulk * np.maximum(after / volume - 1.0, 0.0), np.minimum(after / volume, 1.0)
