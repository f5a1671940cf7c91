"""Excavation in elastic rock by an ordinary finite element program of its own: constant-strain triangles, plane strain,
small strains, the textbook form K = A B^T D B (Zienkiewicz & Taylor, The Finite Element Method, chapter on plane
stress and strain). Imports nothing of hpcdem.

What is taken out leaves the rest elastic and from the same unstressed state, so the displacement by an excavation is
the difference of two solutions under the weight of what is there.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve


def displacement(
    points: np.ndarray, triangles: np.ndarray, young: float, nu: float, rho: float, g: float, held: np.ndarray
) -> np.ndarray:
    """(np, 2) [m] under the weight of the triangles (m, 3); held (np, 2) bool: components that do not move. Points that
    no triangle uses stay."""
    d = young / ((1.0 + nu) * (1.0 - 2.0 * nu)) * np.array(
        [[1.0 - nu, nu, 0.0], [nu, 1.0 - nu, 0.0], [0.0, 0.0, 0.5 - nu]]
    )  # fmt: skip
    p = points[triangles]
    x, y = p[:, :, 0], p[:, :, 1]
    b = np.stack([y[:, 1] - y[:, 2], y[:, 2] - y[:, 0], y[:, 0] - y[:, 1]], axis=1)
    c = np.stack([x[:, 2] - x[:, 1], x[:, 0] - x[:, 2], x[:, 1] - x[:, 0]], axis=1)
    twice = (b * x).sum(axis=1)
    strain = np.zeros((len(triangles), 3, 6))
    strain[:, 0, 0::2], strain[:, 1, 1::2] = b, c
    strain[:, 2, 0::2], strain[:, 2, 1::2] = c, b
    strain /= twice[:, None, None]
    stiffness = 0.5 * twice[:, None, None] * np.einsum("mai,ab,mbj->mij", strain, d, strain)
    dof = (2 * triangles[:, :, None] + np.arange(2)).reshape(len(triangles), 6)
    n = 2 * len(points)
    whole = coo_matrix(
        (stiffness.ravel(), (np.repeat(dof, 6, axis=1).ravel(), np.tile(dof, (1, 6)).ravel())), (n, n)
    ).tocsr()
    load = np.zeros(n)
    np.add.at(load, dof[:, 1::2], np.repeat(-rho * g * twice[:, None] / 6.0, 3, axis=1))
    used = np.zeros(n, bool)
    used[dof] = True
    free = np.flatnonzero(used & ~held.ravel())
    out = np.zeros(n)
    out[free] = spsolve(whole[free][:, free].tocsc(), load[free])
    return out.reshape(-1, 2)
