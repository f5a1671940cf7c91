"""Proppant of a network, written plainly: what kernels.py computes, node by node and channel by channel.

Read this first; tests hold the two against each other.
"""

from __future__ import annotations

import numpy as np


def sub_step(
    ends: np.ndarray, q: np.ndarray, delta: np.ndarray, along: np.ndarray, held: np.ndarray, n: np.ndarray,
    slurry: np.ndarray, packed: np.ndarray, wet: np.ndarray, limit: float, dt: float, sweeps: int,
) -> np.ndarray:  # fmt: skip
    """Proppant n (nodes,) [m2] after a sub-step dt [s]. ends (m, 2): nodes of channels; q (m,) [m2/s]: slurry that
    flows from the first to the last; delta (m,) [m]; along (m,) [m/s]: speed of a single grain in that direction; held
    (m,) bool: grains do not pass; slurry (nodes,) [m2]: of nodes, packed (nodes,) bool, wet (nodes,): saturation;
    limit: concentration of a pack; sweeps: number of sweeps over the nodes for the factors of their inflow."""
    c = np.divide(n, slurry, out=np.zeros_like(n), where=slurry > 0.0)
    moves = []  # from, to, volume
    for (a, b), flow, width, v, shut in zip(ends.tolist(), q, delta, along, held):
        if shut:
            continue
        flow = 0.0 if packed[a] or packed[b] else flow
        slip = v * width * min(wet[a], wet[b]) * max(1.0 - 0.5 * (c[a] + c[b]), 0.0) ** 5.65
        moves.append((a, b, c[a] * (max(flow, 0.0) + max(slip, 0.0)) * dt))
        moves.append((b, a, c[b] * (max(-flow, 0.0) + max(-slip, 0.0)) * dt))
    leaves = np.zeros_like(n)
    for a, _, volume in moves:
        leaves[a] += volume
    gives = np.array([min(1.0, n[i] / leaves[i]) if leaves[i] > 0.0 else 1.0 for i in range(len(n))])
    takes = np.zeros_like(n)
    for _ in range(sweeps):
        comes, goes = np.zeros_like(n), np.zeros_like(n)
        for a, b, volume in moves:
            comes[b] += gives[a] * volume
            goes[a] += gives[a] * volume * takes[b]
        free = np.maximum(limit * slurry - n + goes, 0.0)
        takes = np.array([min(free[i] / comes[i], 1.0) if comes[i] > 0.0 else 1.0 for i in range(len(n))])
    after = n.copy()
    for a, b, volume in moves:
        after[a] -= gives[a] * takes[b] * volume
        after[b] += gives[a] * takes[b] * volume
    return np.maximum(after, 0.0)
