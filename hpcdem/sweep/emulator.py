"""A Gaussian process that interpolates a measured number between the runs of a sweep.

Matern kernel of 5/2 with a length for each parameter, and the noise of the seeds, both by the largest marginal
likelihood (Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, eqs. 2.25, 2.26, 4.17, 5.8). SciPy does
the algebra and the search: a library with this class alone would be one more dependency of every installation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize


@dataclass(frozen=True)
class Emulator:
    """points (n, d) in the unit cube; lengths (d,); factor, weights: of the covariance of the points; mean, size: of
    the numbers; noise: standard deviation of a number about the process."""

    points: np.ndarray
    lengths: np.ndarray
    factor: np.ndarray
    weights: np.ndarray
    mean: float
    size: float
    noise: float

    def __call__(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance (m,) of the process, without the noise, at points (m, d)."""
        cross = _kernel(at, self.points, self.lengths)
        mean = self.mean + self.size * (cross @ self.weights)
        half = linalg.solve_triangular(self.factor, cross.T, lower=True)
        return mean, self.size**2 * np.maximum(1.0 - (half * half).sum(axis=0), 0.0)


def fit(points: np.ndarray, values: np.ndarray, starts: int = 4, seed: int = 0) -> Emulator:
    """The process through values (n,) at points (n, d); repeated points define its noise."""
    mean, scale = float(values.mean()), float(values.std()) or 1.0
    y = (values - mean) / scale
    d = points.shape[1]

    def misfit(theta: np.ndarray) -> float:
        try:
            factor, weights, size2 = _solved(points, y, np.exp(theta[:d]), np.exp(theta[d]))
        except linalg.LinAlgError:
            return 1e25
        return float(np.log(np.diag(factor)).sum() + 0.5 * len(y) * np.log(size2))

    random = np.random.default_rng(seed)
    bounds = [(np.log(0.05), np.log(20.0))] * d + [(np.log(1e-8), np.log(10.0))]
    best = None
    for k in range(starts):
        begin = (
            np.array([np.log(0.7)] * d + [np.log(1e-3)]) if k == 0 else np.array([random.uniform(*b) for b in bounds])
        )
        found = optimize.minimize(misfit, begin, method="L-BFGS-B", bounds=bounds)
        best = found if best is None or found.fun < best.fun else best
    assert best is not None
    lengths, ratio = np.exp(best.x[:d]), float(np.exp(best.x[d]))
    factor, weights, size2 = _solved(points, y, lengths, ratio)
    size = float(np.sqrt(size2))
    return Emulator(points, lengths, factor, weights / size, mean, size * scale, scale * size * np.sqrt(ratio))


def _solved(
    points: np.ndarray, y: np.ndarray, lengths: np.ndarray, ratio: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Factor of the covariance over the size squared, weights, and the best size squared; ratio: noise to size
    squared."""
    covariance = _kernel(points, points, lengths) + (ratio + 1e-10) * np.eye(len(points))
    factor = linalg.cholesky(covariance, lower=True)
    weights = linalg.cho_solve((factor, True), y)
    return factor, weights, max(float(y @ weights) / len(y), 1e-12)


def _kernel(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    far = np.sqrt(5.0 * (((a[:, None] - b[None]) / lengths) ** 2).sum(axis=2))
    return (1.0 + far + far * far / 3.0) * np.exp(-far)
