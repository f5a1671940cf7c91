"""An elastic plate on a fluid, D w'''' + k w = q, by Hermite beam elements on a foundation.

w: deflection, downwards [m]; q: load, downwards [Pa]; D: flexural rigidity [N m]; k: restoring pressure per deflection,
density contrast times gravity [Pa/m]; all per metre of the third dimension. Turcotte & Schubert, Geodynamics, ch. 3;
Hetenyi, Beams on elastic foundation (1946), for the end of an infinite plate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FREE, CLAMPED, INFINITE = "free", "clamped", "infinite"
ENDS = {FREE: FREE, "broken": FREE, CLAMPED: CLAMPED, "fixed": CLAMPED, INFINITE: INFINITE}
"""Conditions of an end by the words of the command. At the end of a broken plate there is neither moment nor shear
force."""
_BEAM = ((12.0, 6.0, -12.0, 6.0), (6.0, 4.0, -6.0, 2.0), (-12.0, -6.0, 12.0, -6.0), (6.0, 2.0, -6.0, 4.0))
_BED = ((156.0, 22.0, 54.0, -13.0), (22.0, 4.0, 13.0, -3.0), (54.0, 13.0, 156.0, -22.0), (-13.0, -3.0, -22.0, 4.0))
_POWER = np.array([[0, 1, 0, 1], [1, 2, 1, 2], [0, 1, 0, 1], [1, 2, 1, 2]])
"""Powers of the length in the rows and columns of slopes."""
_ABOVE = 3
"""Number of diagonals above the main diagonal."""


def rigidity_of(young: float, poisson: float, thickness: float) -> float:
    """Return D = E Te^3 / (12 (1 - nu^2)) [N m]."""
    return young * thickness**3 / (12.0 * (1.0 - poisson**2))


def parameter(rigidity: float, restoring: float) -> float:
    """Return the flexural parameter alpha = (4 D / k)^(1/4) [m]."""
    return float((4.0 * rigidity / restoring) ** 0.25)


@dataclass(frozen=True)
class Plate:
    """x (n + 1,): nodes, ascending [m]; rigidity [N m]; restoring [Pa/m]; left, right: FREE, CLAMPED or INFINITE, the
    latter continuing without load.

    Shapes are (n + 1, 2): deflection [m] and slope at the nodes. Loads are (n, 4): what acts on each element, as forces
    [N/m] and moments [N] at its two nodes.
    """

    x: np.ndarray
    rigidity: float
    restoring: float
    left: str = FREE
    right: str = FREE

    @property
    def alpha(self) -> float:
        """Flexural parameter [m]."""
        return parameter(self.rigidity, self.restoring)

    def loads(self, x: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the loads of line loads (m,) [N/m] at x (m,); those beyond an end act on it. They are summed in the
        order in which they are given."""
        element, shapes = self._at(x)
        total = np.zeros((len(self.x) - 1, 4))
        np.add.at(total, element, shapes * force[:, None])
        return total

    def uniform(self, first: float, last: float, pressure: float) -> np.ndarray:
        """Return the loads of a uniform pressure [Pa] from first to last [m], by Gauss points in each element."""
        points, weights = np.polynomial.legendre.leggauss(2)
        a, b = np.clip(self.x[:-1], first, last), np.clip(self.x[1:], first, last)
        half = 0.5 * (b - a)
        x = 0.5 * (a + b)[:, None] + half[:, None] * points
        return self.loads(x.ravel(), (pressure * half[:, None] * weights).ravel())

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return the shape in equilibrium with the loads."""
        from scipy.linalg import solveh_banded  # slow to import, and seldom needed

        n = len(self.x)
        right = np.zeros((n, 2))
        right[:-1] += loads[:, :2]
        right[1:] += loads[:, 2:]
        matrix = self._banded()
        first, last = 2 * (self.left == CLAMPED), 2 * n - 2 * (self.right == CLAMPED)
        shape = np.zeros(2 * n)
        shape[first:last] = solveh_banded(matrix[:, first:last], right.ravel()[first:last], check_finite=False)
        return shape.reshape(n, 2)

    def deflection(self, shape: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the deflection (m,) [m] of a shape at x (m,), beyond the ends that of the end."""
        element, shapes = self._at(x)
        return (shapes * np.hstack([shape[:-1], shape[1:]])[element]).sum(axis=1)

    def moment(self, shape: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return the bending moment -D w'' at the nodes (n + 1,) [N], from the equilibrium of each element."""
        ends = np.einsum("nij,nj->ni", self._elements(), np.hstack([shape[:-1], shape[1:]])) - loads
        moment = np.append(ends[:, 1], -ends[-1, 3])
        moment[1:-1] = 0.5 * (ends[1:, 1] - ends[:-1, 3])
        return moment

    def buoyancy(self, shape: np.ndarray) -> float:
        """Return the restoring force of the fluid on the whole plate, infinite ends included [N/m]."""
        h, w, slope = np.diff(self.x), shape[:, 0], shape[:, 1]
        total = float(np.sum(0.5 * h * (w[:-1] + w[1:]) + h * h / 12.0 * (slope[:-1] - slope[1:])))
        for end, at, sign in ((self.left, 0, -1.0), (self.right, -1, 1.0)):
            if end == INFINITE:
                total += 0.5 * self.alpha * (2.0 * w[at] + sign * self.alpha * slope[at])
        return self.restoring * total

    def pressure(self, loads: np.ndarray) -> np.ndarray:
        """Return the load at the nodes (n + 1,) [Pa]: the mean over the halves of the elements at each."""
        h = np.diff(self.x)
        total, width = np.zeros(len(self.x)), np.zeros(len(self.x))
        for part, force in ((slice(0, -1), loads[:, 0]), (slice(1, None), loads[:, 2])):
            total[part] += force
            width[part] += 0.5 * h
        return total / width

    def _at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Element (m,) and Hermite functions (m, 4) at x (m,)."""
        x = np.clip(x, self.x[0], self.x[-1])
        element = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        h = np.diff(self.x)[element]
        s = (x - self.x[element]) / h
        t = s - 1.0
        return element, np.stack(
            [(1.0 + 2.0 * s) * t * t, h * s * t * t, s * s * (1.0 - 2.0 * t), h * s * s * t], axis=1
        )

    def _elements(self) -> np.ndarray:
        """Stiffness of each element, (n, 4, 4)."""
        h = np.diff(self.x)[:, None, None]
        return h**_POWER * (self.rigidity / h**3 * np.array(_BEAM) + self.restoring * h / 420.0 * np.array(_BED))

    def _banded(self) -> np.ndarray:
        """Stiffness of the plate as solveh_banded takes it."""
        elements, n = self._elements(), len(self.x)
        matrix = np.zeros((_ABOVE + 1, 2 * n))
        for i in range(4):
            for j in range(i, 4):
                matrix[_ABOVE + i - j, j : j + 2 * n - 2 : 2] += elements[:, i, j]
        lam = 1.0 / self.alpha
        for end, first, sign in ((self.left, 0, -1.0), (self.right, 2 * n - 2, 1.0)):
            if end == INFINITE:
                matrix[_ABOVE, first] += 4.0 * self.rigidity * lam**3
                matrix[_ABOVE, first + 1] += 2.0 * self.rigidity * lam
                matrix[_ABOVE - 1, first + 1] += sign * 2.0 * self.rigidity * lam**2
        return matrix
