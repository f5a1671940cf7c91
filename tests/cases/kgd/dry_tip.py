"""A plane hydraulic fracture with a dry tip, computed in another way than by hpcdem: displacement discontinuities
(Crouch and Starfield 1983), K = K_Ic at the tip, which goes on by one element per step; what is found is the time that
it takes. One variable for pressure and saturation, lubrication with upstream saturation, backward Euler.
"""

from __future__ import annotations

import math

import numpy as np

P0 = 1e7
"""Unit of the pressure [Pa]."""
AIM, MOST, HALVINGS = 1e-8, 100, 8


def grown(
    young: float, energy: float, viscosity: float, rate: float, confinement: float, size: float, last: int
) -> np.ndarray:
    """Rows (time [s], half length, front of the fluid [m], opening in the middle [m], net pressure there [Pa]), one per
    element of this size [m], from 4 to `last` of them. young: E' [Pa]; rate: of both wings [m2/s]."""

    def elastic(n: int) -> np.ndarray:
        """Net pressure by openings, of both wings."""
        x = size * (np.arange(n) + 0.5)
        return sum(young * size / (4.0 * math.pi) / (0.25 * size**2 - (x[:, None] + s * x) ** 2) for s in (-1.0, 1.0))

    toughness = math.sqrt(young * energy)
    # K over the opening of the last element, of a crack under one pressure.
    of_tip = math.sqrt(math.pi * 60 * size) / np.linalg.solve(elastic(60), np.ones(60))[-1]
    net = toughness / math.sqrt(math.pi * 3 * size)
    w = np.linalg.solve(elastic(3), np.full(3, net))
    fluid, u, rows = w * size, np.full(3, (net + confinement) / P0), []
    time = 2.0 * fluid.sum() / rate
    dt = 0.2 * time

    def lacking(y: np.ndarray, unit: np.ndarray, matrix: np.ndarray, before: np.ndarray) -> np.ndarray:
        """What elasticity, the fluid of the elements and the tip lack, by variables over their units."""
        n = len(before)
        w, u, dt = np.split(y * unit, [n, 2 * n])
        p, s = P0 * np.maximum(u, 0.0), np.clip(1.0 + u, 0.0, 1.0)
        up = np.where(p[:-1] >= p[1:], s[:-1], s[1:])
        wet = np.minimum(0.5 * (s[1:] + s[:-1]), up)
        q = wet**2 * (3.0 - 2.0 * wet) * (0.5 * (w[1:] + w[:-1])) ** 3 / (12.0 * viscosity) * -np.diff(p) / size
        more = w * size * np.minimum(1.0 + u, 1.0) - before
        more -= dt * (np.append([0.5 * rate], q) - np.append(q, [0.0]))
        tip = of_tip * w[-1] / toughness - 1.0
        return np.concatenate([(matrix @ w - p + confinement) / P0, more / (rate * unit[-1]), [tip]])

    for n in range(4, last + 1):
        unit = np.concatenate([np.full(n, w.max()), np.ones(n), [dt]])
        known = unit, elastic(n), np.append(fluid, 0.0)
        y = np.concatenate([np.append(w, 0.5 * w[-1]), np.append(u, -1.0 + 1e-9), [dt]]) / unit
        for _ in range(MOST):
            now = lacking(y, *known)
            if np.abs(now).max() < AIM:
                break
            slopes = np.column_stack([(lacking(y + 1e-7 * e, *known) - now) / 1e-7 for e in np.eye(2 * n + 1)])
            way = np.linalg.solve(slopes, -now)
            for part in 0.5 ** np.arange(HALVINGS):
                trial = y + part * way
                if trial[-1] > 1e-3 and np.abs(lacking(trial, *known)).sum() < np.abs(now).sum():
                    break
            y = trial
        assert np.abs(lacking(y, *known)).max() < AIM, f"no balance with {n} elements"
        w, u, (dt,) = np.split(y * unit, [n, 2 * n])
        time, fluid = time + dt, w * size * np.minimum(1.0 + u, 1.0)
        rows.append((time, n * size, size * float((u > -0.5).sum()), w[0], P0 * u[0] - confinement))
    return np.array(rows)
