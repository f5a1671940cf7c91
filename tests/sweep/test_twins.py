"""Twins: runs in which one particle is moved by 1e-5 of its radius."""

from __future__ import annotations

import numpy as np
import pytest

import hpcdem
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.lang.parameters import read
from hpcdem.sweep import Sweep

SCRIPT = "START\nSET dt 0.001\nBALL id 1 x 1 y 1 rad 1\nCYC 5\nCYC 6\nSTOP\n"


WALL = "WALL id 1 nodes (0 0) (0 9) xv 1\nIMPLE wall id 1 xmove 5"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (SCRIPT, SCRIPT.replace("CYC 5", "TWIN 3\nCYC 5")),
        (SCRIPT.replace("CYC 6", "TWIN 1 # one\nCYC 6"), SCRIPT.replace("CYC 6", "TWIN 3 # one\nCYC 6")),
        (SCRIPT.replace("CYC 5", WALL), SCRIPT.replace("CYC 5", WALL.replace("IMPLE", "TWIN 3\nIMPLE"))),
    ],
)
def test_the_line_of_a_twin(before, after):
    assert read(before.encode(), "s.py").with_values({"twin": 3}).decode() == after


@pytest.mark.parametrize("text", ["START\nSTOP\n", "START\nSET dt 1\nTWIN 1\nTWIN 2\nCYC 5\n"])
def test_scripts_without_a_twin(text):
    with pytest.raises(UsageError, match="no such parameter"):
        read(text.encode(), "s.py").parameter("twin")


def test_a_sweep_of_twins_keeps_the_script_in_its_first_member_but_for_the_line(tmp_path):
    (tmp_path / "s.py").write_text(SCRIPT)
    sweep = Sweep(tmp_path / "s.py", twins=3)
    assert [one.values for one in sweep.members] == [{"twin": k} for k in range(3)]
    assert (sweep.members[2].folder / "s.py").read_text() == SCRIPT.replace("CYC 5", "TWIN 2\nCYC 5")
    with pytest.raises(UsageError, match="twin is given twice"):
        Sweep(tmp_path / "s.py", {"twin": "1:2"}, twins=2)


def test_one_free_particle_moves_by_a_hundred_thousandth_of_its_radius():
    sim = hpcdem.Simulation(log=False)
    sim.box(0.0, 100.0, 0.0, 10.0)
    for k in range(9):
        sim.ball(10.0 * (k + 1), 5.0, 1.0 + 0.1 * k, group="fixed" if k < 3 else "free")
    sim.fix("x", where="group fixed")
    before = np.column_stack([sim["x"], sim["y"]])
    assert sim.twin(0) == -1 and (np.column_stack([sim["x"], sim["y"]]) == before).all()
    moved = set()
    for number in range(1, 30):
        gid = sim.twin(number)
        now = np.column_stack([sim["x"], sim["y"]])
        way = np.hypot(*(now - before).T)
        row = int(np.flatnonzero(sim["gid"] == gid)[0])
        assert np.flatnonzero(way).tolist() == [row]
        assert way[row] == pytest.approx(1e-5 * sim["radius"][row], rel=1e-6)
        moved.add(gid)
        before = now
    assert moved == set(sim["gid"][3:].tolist()), "each free particle is drawn by some number, none that is fixed"
    with pytest.raises(HpcdemError, match="none of the selected particles is free"):
        sim.twin(1, where="group fixed")
