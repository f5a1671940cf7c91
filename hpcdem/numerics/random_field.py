"""Random fields: Weibull, normal and lognormal values, independent from object to object or correlated over a length.

Values are pure functions of (seed, kind of object, its number) or, correlated, of (seed, place): neither ranks nor
storage nor the other requested objects matter, and a correlated field is the same on a finer mesh.

Correlated: the spectral representation of a Gaussian field with covariance C(r) (Shinozuka & Deodatis 1991),

    Z(x) = sqrt(2 / N) sum_i cos(k_i . x + phi_i),    phi_i uniform in [0, 2 pi),

wave vectors k_i drawn from the spectral density of C, one in each of N strata of equal probability of its size, so that
the covariance of one field is near that of all:

    exponential  C = exp(-r / L)       P(|k| < q) = 1 - I(1/2, d/2; 1 / (1 + q^2 L^2)), d = 2: 1 - (1 + q^2 L^2)^(-1/2)
    gaussian     C = exp(-(r / L)^2)   P(|k| < q) = P(d/2; q^2 L^2 / 4), d = 2: 1 - exp(-q^2 L^2 / 4)

(the Fourier transforms of C in d dimensions, integrated over directions; I, P: the regularized incomplete beta and
gamma functions). Values with the wanted distribution are its quantiles at u = Phi(Z), Phi: normal distribution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv, gammaincinv, ndtr, ndtri

from hpcdem.core.errors import CommandError
from hpcdem.numerics.rng import uniforms

WAVES = 1024
"""Number N of waves of a field. Extreme values of Z reach sqrt(2 N); its kurtosis is 3 - 3 / (2 N)."""
BLOCK = 4096
"""Number of positions at which the waves are summed at once."""
WEIBULL, NORMAL, LOGNORMAL = "weibull", "normal", "lognormal"
EXPONENTIAL, GAUSSIAN = "exponential", "gaussian"
_STREAMS = {"element": 1, "element-face": 2, "face-joint": 3}
_DIRECTION, _SIZE, _PHASE, _HEIGHT = 4, 5, 6, 7
_SQUARES = {
    (EXPONENTIAL, 2): lambda p: (1.0 - p) ** -2 - 1.0,
    (EXPONENTIAL, 3): lambda p: 1.0 / betaincinv(0.5, 1.5, 1.0 - p) - 1.0,
    (GAUSSIAN, 2): lambda p: -4.0 * np.log1p(-p),
    (GAUSSIAN, 3): lambda p: 4.0 * gammaincinv(1.5, p),
}  # fmt: skip
"""Squares of the sizes |k| L that are not exceeded with the probability p, by covariance and dimensions."""


@dataclass(frozen=True)
class RandomField:
    """distribution: WEIBULL (first: scale, value that 63 % do not exceed; second: shape), NORMAL or LOGNORMAL (mean and
    standard deviation of the values themselves). correlation [m]: length L, 0: independent; covariance: its form.
    least, greatest: the distribution is cut there and scaled to be one again."""

    distribution: str
    first: float
    second: float
    seed: int
    correlation: float = 0.0
    covariance: str = EXPONENTIAL
    least: float = -math.inf
    greatest: float = math.inf

    @staticmethod
    def of(
        distribution: str, first: float, second: float, seed: int, correlation: float = 0.0,
        covariance: str = EXPONENTIAL, least: float = -math.inf, greatest: float = math.inf,
    ) -> RandomField:  # fmt: skip
        """A checked one. CommandError for what is no distribution."""
        made = RandomField(distribution, float(first), float(second), seed, correlation, covariance, least, greatest)
        numbers = (made.first, made.second, correlation)
        if not all(map(math.isfinite, numbers)) or correlation < 0.0 or seed < 0:
            raise CommandError(
                f"a random field needs finite numbers, a length and a seed that are not negative: {made}"
            )
        if distribution not in (WEIBULL, NORMAL, LOGNORMAL) or covariance not in (EXPONENTIAL, GAUSSIAN):
            raise CommandError(f"unknown random field {distribution} {covariance}")
        positive = distribution == WEIBULL or (distribution == LOGNORMAL and made.second == 0.0)
        if (positive and not (made.first > 0.0 and made.second >= 0.0)) or made.second < 0.0:
            raise CommandError(f"{distribution} {first:g} {second:g}: scale, shape and deviation must be positive")
        if distribution == WEIBULL and made.second == 0.0:
            raise CommandError("the shape of a Weibull distribution must be above 0")
        if distribution == LOGNORMAL and made.first <= 0.0:
            raise CommandError(f"the mean of a lognormal distribution must be above 0, got {first:g}")
        low, high = made.probability(least), made.probability(greatest)
        if not (least < greatest and high - low > 1e-12):
            raise CommandError(
                f"no value of {distribution} {first:g} {second:g} lies between {least:g} and {greatest:g}"
            )
        return made

    def values(self, kind: str, numbers: np.ndarray, places: np.ndarray) -> np.ndarray:
        """(n,) values of objects of a kind ("element", "element-face", "face-joint") with these numbers at these places
        (n, 2), in space (n, 3) [m]."""
        if self.correlation > 0.0:
            u = ndtr(self.gaussian(places))
        else:
            u = uniforms(self.seed, _STREAMS[kind], numbers) + 2.0**-54  # in the open interval
        low, high = self.probability(self.least), self.probability(self.greatest)
        out = self.quantile(low + u * (high - low))
        return np.clip(out, self.least, self.greatest)

    def gaussian(self, places: np.ndarray) -> np.ndarray:
        """(n,) of mean 0, variance 1 and the wanted covariance."""
        i = np.arange(WAVES)
        part = (i + uniforms(self.seed, _SIZE, i)) / WAVES
        dim = places.shape[1]
        size = np.sqrt(_SQUARES[self.covariance, dim](part)) / self.correlation
        angle = 2.0 * math.pi * uniforms(self.seed, _DIRECTION, i)
        waves = [size * np.cos(angle), size * np.sin(angle)]
        if dim > len(waves):  # directions on the sphere: the height is uniform
            height = 2.0 * uniforms(self.seed, _HEIGHT, i) - 1.0
            waves = [np.sqrt(1.0 - height * height) * k for k in waves] + [size * height]
        phase = 2.0 * math.pi * uniforms(self.seed, _PHASE, i)
        out = np.empty(len(places))
        for at in range(0, len(places), BLOCK):
            along = sum(x[:, None] * k for x, k in zip(places[at : at + BLOCK].T, waves))
            out[at : at + BLOCK] = np.cos(along + phase).sum(axis=1)
        return math.sqrt(2.0 / WAVES) * out

    def probability(self, value: float) -> float:
        """P(X <= value)."""
        if self.distribution == WEIBULL:
            return 0.0 if value <= 0.0 else -math.expm1(-((value / self.first) ** self.second))
        if self.distribution == LOGNORMAL:
            if value <= 0.0:
                return 0.0
            mean, spread = self._logarithmic()
            value = math.log(value) if value < math.inf else value
        else:
            mean, spread = self.first, self.second
        if spread == 0.0:
            return float(value >= mean)
        return float(ndtr((value - mean) / spread))

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """The values that are not exceeded with the probabilities u, in (0, 1)."""
        if self.distribution == WEIBULL:
            return self.first * (-np.log1p(-np.minimum(u, 1.0 - 2.0**-53))) ** (1.0 / self.second)
        mean, spread = self._logarithmic() if self.distribution == LOGNORMAL else (self.first, self.second)
        z = mean + spread * (ndtri(np.clip(u, 2.0**-54, 1.0 - 2.0**-53)) if spread > 0.0 else np.zeros(len(u)))
        return np.exp(z) if self.distribution == LOGNORMAL else z

    def _logarithmic(self) -> tuple[float, float]:
        """Mean and standard deviation of the logarithm."""
        variance = math.log1p((self.second / self.first) ** 2)
        return math.log(self.first) - 0.5 * variance, math.sqrt(variance)
