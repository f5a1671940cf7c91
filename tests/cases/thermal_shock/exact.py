"""When equally spaced cracks in a half plane that is chilled at its surface leave each other behind. Imports nothing of
hpcdem.

The surface of a half plane is colder by D from t = 0 on: T = -D erfc(y / b), b = 2 (kappa t)^0.5, stress along it
s erfc(y / b) with s = E alpha D / (1 - nu) in plane strain. Cracks of equal depth a and spacing p follow the cold with
G(a, b) = G_c. They go on together as long as one of them, its neighbours held where they are, would be stopped by its
own growth, dG_1/da_1 < 0; when that is zero every second one stops, and the spacing of those that grow doubles
(Nemat-Nasser, Keer & Parihar 1978, Int. J. Solids Struct. 14, 409; Bazant, Ohtsubo & Aoh 1979, Int. J. Fracture 15,
443; Nemat-Nasser & Oranratnachai 1979, J. Energy Resour. Technol. 101, 34). So the spacing of growing cracks stays
between the critical one and twice that.

With the Griffith length l = G_c E' / s^2, E' = E / (1 - nu^2), all follows from g(a / p, b / p) = G E' / (s^2 p). It is
computed here by bilinear finite elements of the strip between two cracks, one on each side, of the depths a_1 and a_2:
G_1 = -2 dU/da_1 (each side has half a crack) by releasing one node after the other.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.special import erfc

POISSON = 1.0 / 3.0
"""In the plane; nothing depends on it, as tractions on cracks are in balance."""
GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


class Strip:
    """Between two cracks at a distance of 1, `across` elements wide; lines (n,): grid lines along the depth, the first
    ones as far apart as those across."""

    def __init__(self, across: int = 24, deep: float = 2.5) -> None:
        h = 1.0 / across
        even = np.arange(0.0, deep + 0.5 * h, h)
        grow = deep + np.cumsum(h * 1.12 ** np.arange(1, 44))
        self.h, self.lines, self.across = h, np.concatenate([even, grow]), across
        ny, nx = len(self.lines), across + 1
        self.number = np.arange(nx * ny).reshape(nx, ny)
        n = self.number
        self.cells = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
        x, y = np.meshgrid(np.arange(nx) * h, self.lines, indexing="ij")
        self.points = np.column_stack([x.ravel(), y.ravel()])
        elastic = np.array([[1.0, POISSON, 0.0], [POISSON, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - POISSON)]])
        elastic /= 1.0 - POISSON**2
        self.parts = []
        corners = self.points[self.cells]
        stiffness = np.zeros((len(self.cells), 8, 8))
        for s in GAUSS:
            for t in GAUSS:
                slopes = 0.25 * np.array([[-(1 - t), 1 - t, 1 + t, -(1 + t)], [-(1 - s), -(1 + s), 1 + s, 1 - s]])
                jacobian = np.einsum("ik,ekj->eij", slopes, corners)
                gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (len(corners), 2, 4)))
                b = np.zeros((len(corners), 3, 8))
                b[:, 0, ::2], b[:, 1, 1::2] = gradient[:, 0], gradient[:, 1]
                b[:, 2, ::2], b[:, 2, 1::2] = gradient[:, 1], gradient[:, 0]
                weight = np.linalg.det(jacobian)
                stiffness += np.einsum("eki,kl,elj,e->eij", b, elastic, b, weight)
                shape = 0.25 * np.array([(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t), (1 - s) * (1 + t)])
                self.parts.append(
                    (corners[:, :, 1] @ shape, np.einsum("eki,kl,l,e->ei", b, elastic, [1, 1, 0], weight))
                )
        self.dofs = np.stack([2 * self.cells, 2 * self.cells + 1], axis=-1).reshape(-1, 8)
        rows, columns = np.repeat(self.dofs, 8, axis=1).ravel(), np.tile(self.dofs, (1, 8)).ravel()
        self.matrix = sparse.csc_matrix((stiffness.ravel(), (rows, columns)), shape=2 * [2 * len(self.points)])

    def energies(self, one: int, other: int, lengths: np.ndarray) -> np.ndarray:
        """Potential energies with cracks that are so many elements deep, one on each side, for thermal lengths b."""
        held = np.zeros(2 * len(self.points), bool)
        held[2 * self.number[0, one:]] = held[2 * self.number[-1, other:]] = True
        held[2 * self.number[:, -1] + 1] = True
        free = np.flatnonzero(~held)
        force = np.zeros((len(held), len(lengths)))
        for k, b in enumerate(lengths):
            each = sum(-erfc(depth / b)[:, None] * load for depth, load in self.parts)
            np.add.at(force[:, k], self.dofs, each)
        way = splu(self.matrix[free][:, free]).solve(force[free])
        return -0.5 * (force[free] * way).sum(axis=0)


def critical_spacings(lengths: np.ndarray, depths: range = range(4, 80, 3), across: int = 24) -> np.ndarray:
    """(n, 3) for thermal lengths over the spacing (n,): b / l, p / l and a / p when cracks that have gone on together
    leave each other behind. Shallower ones do (dG_1/da_1 > 0), deeper ones, of a smaller l, do not."""
    strip = Strip(across, 4.0)
    g, slope = np.zeros((2, len(depths), len(lengths)))
    for i, k in enumerate(depths):
        same, more, less = (strip.energies(one, k, lengths) for one in (k, k + 1, k - 1))
        g[i] = (less - more) / strip.h
        slope[i] = 2.0 * (2.0 * same - more - less) / strip.h**2
    a, found = np.array(depths) * strip.h, np.full((len(lengths), 3), np.nan)
    for k, b in enumerate(lengths):
        at = np.flatnonzero((slope[:-1, k] >= 0.0) & (slope[1:, k] < 0.0))
        if len(at):
            i = at[0]
            part = slope[i, k] / (slope[i, k] - slope[i + 1, k])
            level = np.exp((1.0 - part) * np.log(g[i, k]) + part * np.log(g[i + 1, k]))
            found[k] = b / level, 1.0 / level, a[i] + part * (a[i + 1] - a[i])
    return found
