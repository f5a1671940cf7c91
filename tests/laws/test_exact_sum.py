"""Exact sums: correctly rounded, whatever the order and however the values are shared out."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.core.comm import SerialComm
from hpcdem.numerics.exact_sum import exact_sum, partial_bins, rounded, rounded_sums

finite = st.floats(allow_nan=False, allow_infinity=False)
quick = settings(max_examples=150, deadline=None, derandomize=True)


def total(values) -> float:
    return exact_sum(np.array(values, dtype=float), SerialComm())


def by_fractions(values) -> float:
    """The exact rational sum, rounded once."""
    exact = sum(map(Fraction, values), Fraction(0))
    try:
        return float(exact)
    except OverflowError:
        return math.inf if exact > 0 else -math.inf


@quick
@given(st.lists(finite, max_size=60))
def test_any_doubles(values):
    assert total(values) == by_fractions(values)


@quick
@given(st.lists(st.floats(-1e100, 1e100), max_size=200))
def test_against_fsum(values):
    assert total(values) == math.fsum(values)


@quick
@given(st.lists(st.floats(-1e-300, 1e-300), max_size=40))
def test_denormal_numbers(values):
    assert total(values) == math.fsum(values)


@quick
@given(st.lists(finite, min_size=1, max_size=60), st.randoms(use_true_random=False), st.integers(1, 7))
def test_order_and_ranks_do_not_matter(values, random, ranks):
    """The integer bins of any shares, added up, give the same bits."""
    shuffled = values.copy()
    random.shuffle(shuffled)
    bins = sum(partial_bins(np.array(shuffled[k::ranks], dtype=float)) for k in range(ranks))
    assert rounded(bins) == total(values)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([], 0.0),
        ([0.0, -0.0], 0.0),
        ([1e16, 1.0, -1e16], 1.0),
        ([1e308, 1e308, -1e308], 1e308),
        ([1e308, 1e308], math.inf),
        ([-1e308, -1e308], -math.inf),
        ([1.0, 1e308, 1e308], math.inf),
        ([-1.0, -1e308, -1e308], -math.inf),
        ([5e-324, 5e-324], 1e-323),
        ([1e300, 1.0, -1e300, -1.0, 3.0], 3.0),
        ([1.0, 2.0**-53], 1.0),
        ([1.0, 2.0**-53, 2.0**-106], 1.0 + 2.0**-52),
        ([0.1] * 10, 1.0),
    ],
)
def test_examples(values, expected):
    assert total(values) == expected


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_gives_nan(bad):
    assert math.isnan(total([1.0, bad, 2.0]))


def test_many_values():
    """A sum over a million forces of random sign and size."""
    random = np.random.default_rng(3)
    values = random.normal(size=1_000_000) * 10.0 ** random.uniform(-12, 12, 1_000_000)
    assert total(values) == math.fsum(values)
    assert total(values.reshape(1000, 1000).T) == math.fsum(values), "any shape"


def test_several_sums_at_once():
    """Each is what it would be alone, whatever exponents the others need; one that is not finite spoils no other."""
    parts = [[1e300, 1.0, -1e300], [], [5e-324, -1.0], [math.nan], [0.1] * 10]
    sums = rounded_sums(np.array([partial_bins(np.array(p, dtype=float)) for p in parts]), SerialComm())
    assert sums.tolist()[:3] == [1.0, 0.0, -1.0] and math.isnan(sums[3]) and sums[4] == 1.0
