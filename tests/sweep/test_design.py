"""Values of the members: grids, samples, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import UsageError
from hpcdem.lang.parameters import read
from hpcdem.sweep.array import ranges
from hpcdem.sweep.design import Sampling, members

SCRIPT = read(b"import a\nfriction = 0.3\nn = 5\nlaw = 'hertz'\nseed = 1\nprint(friction, n, law, seed)\n", "a.py")


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("0.2,0.3", [0.2, 0.3]),
        ("1:3", [1, 2, 3]),
        ("0.1:0.3:3", [0.1, 0.2, 0.3]),
        ("0.1:0.7:4", [0.1, 0.3, 0.5, 0.7]),
        ([0.5, 1], [0.5, 1]),
    ],
)
def test_values(words, values):
    assert [one["friction"] for one in members(SCRIPT, {"friction": words})] == values


def test_a_grid_crosses_all_and_the_last_changes_fastest():
    found = members(SCRIPT, {"friction": "0.2,0.3", "law": "hertz,linear", "seed": "1:2"})
    assert [tuple(one.values()) for one in found] == [
        (f, law, seed) for f in (0.2, 0.3) for law in ("hertz", "linear") for seed in (1, 2)
    ]


def test_a_latin_hypercube_has_one_member_in_each_slice_of_each_parameter():
    found = members(SCRIPT, {"friction": "0.1:0.5", "n": "1:10"}, Sampling("latin", 20))
    slices = [math.floor((one["friction"] - 0.1) / 0.4 * 20) for one in found]
    assert sorted(slices) == list(range(20))
    assert sorted(one["n"] for one in found) == sorted([*range(1, 11)] * 2), "whole numbers, each as often"
    assert all(isinstance(one["n"], int) for one in found)


def test_a_sobol_sequence_is_even_in_each_quarter_of_a_plane():
    found = members(SCRIPT, {"friction": "0:1", "n": "1.0:3.0:log"}, Sampling("sobol", 16))
    places = [(one["friction"] >= 0.5, math.log(one["n"]) >= 0.5 * math.log(3.0)) for one in found]
    assert [places.count((a, b)) for a in (False, True) for b in (False, True)] == [4, 4, 4, 4]


def test_samples_follow_from_their_seed_and_are_crossed_with_lists():
    def made(seed):
        return members(SCRIPT, {"friction": "0.1:0.5", "seed": "1:2"}, Sampling("latin", 4, seed))

    assert made(1) == made(1) != made(2)
    assert len(made(1)) == 8
    assert len({one["friction"] for one in made(1)}) == 4 and {one["seed"] for one in made(1)} == {1, 2}


def test_log_ranges_are_even_in_the_logarithm():
    found = members(SCRIPT, {"friction": "1e2:1e6:log"}, Sampling("latin", 4))
    assert sorted(math.floor(math.log10(one["friction"])) for one in found) == [2, 3, 4, 5]
    even = members(SCRIPT, {"friction": "1e2:1e6"}, Sampling("latin", 4))
    assert np.mean([one["friction"] > 1e5 for one in even]) > 0.7


@pytest.mark.parametrize(
    ("wanted", "sampling", "why"),
    [
        ({}, None, "no parameter is varied"),
        ({"fiction": "1"}, None, "did you mean 'friction'?"),
        ({"friction": "0.2,0.2"}, None, "0.2 is given twice"),
        ({"friction": "0.3:0.1"}, None, "0.3 is not below 0.1"),
        ({"friction": "0.1:0.3"}, None, "Give the number of values"),
        ({"friction": "0.1:0.3:log"}, None, "log requires"),
        ({"friction": "0.1:0.3:1"}, None, "at least 2"),
        ({"friction": "1:2:3:4"}, None, "LOW:HIGH or LOW:HIGH:N"),
        ({"friction": "0.1,0.2"}, Sampling("latin", 4), "no parameter has a range"),
        ({"friction": "0:1:log"}, Sampling("latin", 4), "above 0"),
        ({"friction": "0:1"}, Sampling("sobol", 12), "as 16"),
        ({"friction": ","}, None, "no value"),
        ({"friction": "1:90000", "n": "1:90000"}, None, "at most"),
        ({"n": "1:900000000000"}, None, "more than"),
        ({"n": "1:9"}, Sampling("sobol", 2**40), "at most"),
    ],
)
def test_what_cannot_be_is_refused(wanted, sampling, why):
    with pytest.raises(UsageError) as refused:
        members(SCRIPT, wanted, sampling)
    assert why in str(refused.value)


def test_ranges_of_an_array():
    assert ranges([7, 0, 1, 2, 9, 8]) == "0-2,7-9" and ranges([3]) == "3"
