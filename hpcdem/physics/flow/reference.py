"""One sub-step of flow, written plainly: the oracle of the kernels."""

from __future__ import annotations

import numpy as np


def sub_step(
    ends: np.ndarray, aperture: np.ndarray, length: np.ndarray, viscosity: float, bulk: float, energy: np.ndarray,
    w: np.ndarray, dt: float, prescribed: dict[int, float] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Fluid [m2], pressure [Pa] and saturation (n,) after dt [s] of channels with these ends (m, 2), apertures and
    lengths [m]; energy (n,): rho g z [Pa]; w (n,): fluid before; prescribed: pressure of nodes [Pa]."""
    volume = np.zeros(len(w))
    np.add.at(volume, ends, (0.5 * aperture * length)[:, None])
    s = np.minimum(w / volume, 1.0)
    p = bulk * np.maximum(w / volume - 1.0, 0.0)
    after = w.copy()
    for (a, b), delta, along in zip(ends, aperture, length):
        head = p[a] + energy[a] - p[b] - energy[b]
        wet = min(0.5 * (s[a] + s[b]), s[a] if head > 0 else s[b])
        flow = delta**3 / (12.0 * viscosity) * wet**2 * (3.0 - 2.0 * wet) * head / along
        after[a] -= dt * flow
        after[b] += dt * flow
    for node, value in (prescribed or {}).items():
        after[node] = volume[node] * (1.0 + value / bulk)
    return after, bulk * np.maximum(after / volume - 1.0, 0.0), np.minimum(after / volume, 1.0)
