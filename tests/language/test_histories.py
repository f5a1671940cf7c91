"""What HIST records, each word by itself."""

from __future__ import annotations

import pytest

from hpcdem.commands import dem
from hpcdem.core.errors import CommandError

TOUCHING = ("BALL id 0 rad 1.0 x 0.0 y 0.0", "BALL id 1 rad 1.0 x 1.9 y 0.0", "BALL id 2 rad 1.0 x 3.8 y 0.0",
            "PROP density 1e3 kn 1e6 ks 1e6", "FIX x y RANGE id 0",
            "PROP ebmod 1e6 gbmod 1e6 tstrength 1e9 sstrength 1e9 RANGE id 0 1")  # fmt: skip


@pytest.mark.parametrize(
    ("word", "unit", "value"), [("time", "s", 2e-3), ("contacts", "1", 2.0), ("bonds", "1", 1.0), ("step", "1", 2.0)]
)
def test_a_word_of_hist(play, word, unit, value):
    sim, _ = play(*TOUCHING, f"HIST id 4 interval 1 {word}", "CYC 2")
    head, *rows = (sim.outdir / "hist_4.csv").read_text().splitlines()
    assert head == f"step,time [s],{word} [{unit}]"
    assert float(rows[-1].split(",")[-1]) == pytest.approx(value, rel=1e-12)


def test_the_unbalanced_force(play):
    """Of discs 1 and 2, pressed by one spring each: the mean contact force on disc 2; disc 1 is in balance."""
    sim, _ = play(*TOUCHING, "HIST id 4 interval 1 unbalanced", "CYC 1")
    last = (sim.outdir / "hist_4.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[-1]) == pytest.approx(1.0, rel=1e-9)


def test_an_output_of_imple_that_does_not_exist(play):
    sim, _ = play("WALL id 0 nodes (0.0, 0.0) (0.0, 1.0)", "WALL id 0 xv 1.0")
    with pytest.raises(CommandError, match="IMPLE has no option prnt; expected save, print, ps, vtk"):
        dem.cycles.imple(sim, 0, xmove=1.0, prnt=0.5)
