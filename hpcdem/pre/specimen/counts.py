"""Numbers of grains of each size that fulfil a grading.

Class k has the share f_k of the mass, and a grain of it the mass c d_k^q with the same c in all classes (one shape):
q = 2 for grains of the plane, whose mass goes with their area, q = 3 to take over the numbers of a sieve curve of real
grains. So N_k = N (f_k / d_k^q) / sum_j (f_j / d_j^q).
"""

from __future__ import annotations

import numpy as np

from hpcdem.pre.specimen.grading import Grading


def weights(grading: Grading, q: int = 2) -> np.ndarray:
    """(m,) f8: share of each class in the number of grains, together 1."""
    # Relative to the smallest size: powers of sizes in mm leave the range of a double only with absurd ones.
    each = grading.fractions * (grading.sizes[-1] / grading.sizes) ** q
    return each / each.sum()


def exact_counts(grading: Grading, number: int, q: int = 2) -> np.ndarray:
    """(m,) f8: grains of each class before they are rounded to whole ones."""
    return number * weights(grading, q)


def counts(grading: Grading, number: int, q: int = 2) -> np.ndarray:
    """(m,) i8: grains of each class, together exactly `number` (largest remainder; of equal ones the larger size)."""
    wanted = exact_counts(grading, number, q)
    whole = np.floor(wanted).astype(np.int64)
    missing = number - int(whole.sum())
    whole[np.argsort(-(wanted - whole), kind="stable")[:missing]] += 1
    return whole


def needed(grading: Grading, q: int = 2) -> np.ndarray:
    """(m,) f8: number of grains in all at which the exact count of the class is one grain; infinite without a share."""
    share = weights(grading, q)
    with np.errstate(divide="ignore"):
        return 1.0 / share


def percent_finer(masses: np.ndarray) -> np.ndarray:
    """(m,) f8: per cent finer than each size, from the mass in each class, largest size first."""
    total = masses.sum()
    return 100.0 * np.cumsum(masses[::-1])[::-1] / total if total > 0.0 else np.zeros(len(masses))
