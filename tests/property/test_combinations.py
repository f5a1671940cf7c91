"""Every kind of element with every measure of strain, motion and physics: a checkpoint in the middle changes nothing,
and an account that is kept closes (combinations.py). A few of them; all with --slow."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import pytest

from tests.property import two_ways
from tests.property.combinations import ALL, ELEMENTS, MIDDLES, MOTIONS, PHYSICS, Combination, run, sample

QUICK = sample(6)
FAR = {False: 1e-11, True: 1e-3}
"""Of the account, part of what went through it: with small strain rounding, with large what a step leaves."""


def test_the_quick_ones_have_some_of_each() -> None:
    assert [set(column) for column in zip(*map(astuple, QUICK))] == [
        set(ELEMENTS), {True, False}, {True, False}, set(MOTIONS), set(PHYSICS)
    ]  # fmt: skip
    assert len(ALL) == 5 * 2 * (2 + 1 + 1) * 3


@pytest.mark.parametrize(
    ("of", "middles"),
    [
        *((of, MIDDLES[k % 2 : k % 2 + 1]) for k, of in enumerate(QUICK)),
        *(pytest.param(of, MIDDLES, marks=pytest.mark.slow) for of in ALL),
    ],
    ids=str,
)
def test_a_checkpoint_in_the_middle_changes_nothing(of: Combination, middles: tuple[str, ...], tmp_path: Path) -> None:
    plain, why = run(of, tmp_path / "plain")
    assert not why, f"{of}: {why}\n\n{of.script()}"
    for middle in middles:
        other, why = run(of, tmp_path / middle, middle)
        odd = why or two_ways.difference(plain, other)
        assert not odd, f"{of}, {middle}: {odd}\n\n{of.script(middle)}"
        if middle == "restore" or "solve elastic" not in of.script():  # which has no middle
            assert list((tmp_path / middle).rglob("*.sav")), "there was no checkpoint"
    if of.account:
        assert abs(plain["energy relative"][0]) < FAR[of.large], f"{of}: {plain['energy relative']}\n\n{of.script()}"
