"""Random numbers: a pure function of (seed, stream, counter)."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.numerics.rng import uniform

MASK = (1 << 64) - 1
number = st.integers(0, (1 << 62))


def splitmix(z: int) -> int:
    """Finaliser of SplitMix64 (Steele, Lea & Flood 2014) in whole numbers."""
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(number, number, number)
def test_range_and_arithmetic(seed, stream, counter):
    golden = 0x9E3779B97F4A7C15
    z = splitmix((seed * golden + stream) & MASK)
    z = splitmix((z + (counter + 1) * golden) & MASK)
    value = uniform(seed, stream, counter)
    assert 0.0 <= value < 1.0
    assert value == (z >> 11) * 2.0**-53


def test_the_mixer_is_the_published_one():
    """First outputs of SplitMix64 seeded with 1234567, as listed with the reference code."""
    state, seen = 1234567, []
    for _ in range(3):
        state = (state + 0x9E3779B97F4A7C15) & MASK
        seen.append(splitmix(state))
    assert seen == [6457827717110365317, 3203168211198807973, 9817491932198370423]


def draw(n: int, seed: int = 1, stream: int = 0) -> np.ndarray:
    return np.array([uniform(seed, stream, k) for k in range(n)])


def test_it_is_uniform():
    """20 bins of 1000: chi squared with 19 degrees of freedom lies below 43.8 in 99.9 % of cases."""
    counts = np.histogram(draw(20000), bins=20, range=(0.0, 1.0))[0]
    assert ((counts - 1000.0) ** 2 / 1000.0).sum() < 43.8


def test_streams_seeds_and_neighbours_are_unrelated():
    """Correlations of 20 000 numbers stay below 4 / sqrt(n)."""
    first = draw(20000)
    for other in (draw(20000, stream=1), draw(20000, seed=2), np.roll(first, 1), np.roll(first, 3)):
        assert abs(np.corrcoef(first, other)[0, 1]) < 4.0 / np.sqrt(20000)
    assert len(np.unique(first)) == 20000
