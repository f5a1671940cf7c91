"""Models said in two ways that mean the same come to the same end, bit by bit (two_ways.py): dozens of fixed seeds,
a hundred others with --slow."""

from __future__ import annotations

import json
import os
import random
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT, mpi_command, mpi_environment
from tests.conftest import run as start
from tests.property import two_ways
from tests.property.two_ways import BLOCKS, COUPLED, KINDS, PARTICLES, WAYS, Units, Writer

QUICK = {BLOCKS: (3, 5, 8, 16, 19, 20, 29), PARTICLES: (1, 3, 7, 8, 11), COUPLED: (1, 3, 4, 11, 12, 14, 15)}
"""Seeds that have all ways and all that may happen between them, among the first of MANY."""
MANY = {BLOCKS: 30, PARTICLES: 12, COUPLED: 16}
SLOW = int(os.environ.get("HPCDEM_PROPERTY_EXAMPLES", "100"))
REGRESSIONS = [
    # A material that is new between two searches for contacts between discs and faces.
    (COUPLED, 3, ("functions", "again")),
    # solve time after a static run.
    (BLOCKS, 19, ("time",)),
    # A static run with fluid that goes on from a file: masses.
    (BLOCKS, 18, ("restore",)),
]


def compare(kind: str, seed: int, ways: list[str] | tuple[str, ...], folder: Path) -> dict[str, np.ndarray]:
    """AssertionError unless both scripts end alike, or fail alike; the end."""
    plain, one, why = two_ways.run(kind, seed, (), folder / f"{kind}{seed}a")
    other_text, other, other_why = two_ways.run(kind, seed, ways, folder / f"{kind}{seed}b")
    odd = f"{why} | {other_why}" if why != other_why else two_ways.difference(one, other)
    assert not odd, f"{kind} {seed} {ways}: {odd}\n\n{plain}\nand\n\n{other_text}"
    return one


@pytest.mark.parametrize("many", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_two_ways_have_one_end(kind: str, many: bool, tmp_path: Path) -> None:
    """And much happens in these models."""
    ends = []
    used = set()
    for seed in range(MANY[kind]) if many else QUICK[kind]:
        ways = two_ways.chosen_ways(kind, seed)
        used |= set(ways)
        ends.append(compare(kind, seed, ways, tmp_path))
    assert used >= {way for way in two_ways.OF[kind] if kind == BLOCKS} and len(used) > 8
    done = [end for end in ends if end]
    assert len(done) > 0.8 * len(ends)
    if kind != PARTICLES:
        assert any(end["joints"][1:].any() for end in done) and any("history v" in end for end in done)
    if kind == BLOCKS:
        for what in ("creep", "plastic", "axial force", "slip", "pressure", "injected", "temperature", "quiet", "side"):
            assert sum(bool(np.nansum(np.abs(end.get(what, 0.0)))) for end in done) > (3 if many else 1), what
    if kind != BLOCKS:
        assert sum(np.abs(end["disc vy"]).max() > 0.01 for end in done) > 0.7 * len(done)
        assert any("hist_8.csv" in end for end in done)
    if kind == PARTICLES:
        assert any(end["bonds"][0] > 0 for end in done)
    if kind == COUPLED:
        assert sum(bool(len(end["contact fs"])) for end in done) > len(done) / 3


@pytest.mark.parametrize("kind, seed, ways", REGRESSIONS)
def test_models_that_once_differed(kind: str, seed: int, ways: tuple[str, ...], tmp_path: Path) -> None:
    compare(kind, seed, ways, tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_each_way_changes_the_script(kind: str) -> None:
    """A way that says the same in the same words would compare nothing; one that is not there would be forgotten."""
    for way in two_ways.OF[kind]:
        texts = [[Writer(kind, seed, ways).text() for ways in (frozenset(), frozenset({way}))] for seed in range(30)]
        assert sum(one != other for one, other in texts) > 4, way
    assert set().union(*two_ways.OF.values()) == set(WAYS)


def test_a_difference_is_found(tmp_path: Path) -> None:
    """The comparison can fail: another friction, one more step, numbers in other units."""
    text = Writer(BLOCKS, 0, frozenset()).text()
    ends = []
    for k, change in enumerate((("", ""), ("gf1 0.05", "gf1 0.0501"), ("young ", "young 1.0000001e8 damp-factor 0 #"))):
        one, why = two_ways.carry_out(
            text.replace(*change) if k < 2 else text + "pcdc model step 1\n", tmp_path / str(k)
        )
        assert not why
        ends.append(two_ways.end(one, Units()))
        two_ways.leave(one)
    assert not two_ways.difference(ends[0], ends[0])
    assert "block steps" in two_ways.difference(ends[0], ends[2])
    assert two_ways.difference(ends[0], {**ends[0], "damage": np.zeros(3)})


@pytest.mark.slow
def test_many_others(tmp_path: Path) -> None:
    """Others every time; the number printed brings them back (HPCDEM_PROPERTY_SEED)."""
    number = int(os.environ.get("HPCDEM_PROPERTY_SEED") or random.SystemRandom().randrange(2**32))
    print("HPCDEM_PROPERTY_SEED", number)
    for k in range(SLOW):
        kind = KINDS[k % 3]
        try:
            compare(kind, number + k, two_ways.chosen_ways(kind, number + k), tmp_path / str(k))
        except BaseException as error:
            error.add_note(f"HPCDEM_PROPERTY_SEED={number}")
            raise


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize("kind", KINDS)
def test_on_several_ranks(kind: str, tmp_path: Path) -> None:
    """The same ends on any number of ranks, or the models are too narrow for so many."""
    (tmp_path / "one").mkdir()
    alone = two_ways.digests(kind, 0, 30, tmp_path / "one")
    folder = tmp_path / "several"
    folder.mkdir()
    command = [
        *mpi_command(3),
        sys.executable,
        str(ROOT / "tests" / "property" / "two_ways.py"),
        kind,
        "0",
        "30",
        folder,
    ]
    done = start(list(map(str, command)), tmp_path, env={**mpi_environment(), "PYTHONPATH": str(ROOT)}, timeout=600)
    assert done.returncode == 0, done.stderr
    found = json.loads((folder / "digests.json").read_text())
    several = {seed: found[str(seed)] for seed in alone if "ranks" not in found[str(seed)][0]}
    assert len(several) > 20
    assert several == {seed: alone[seed] for seed in several}
