"""scripts/bench fracture, and the price of a sub-step of flow: lines are whole."""

from __future__ import annotations

import json
import math
import sys

import pytest

from tests.conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from bench import blocks, fracture
from bench.launch import Layout
from bench.tables import Lines


@pytest.mark.slow
@pytest.mark.mpi
def test_a_small_fracture_and_its_stages(tmp_path):
    file = tmp_path / "lines.json"
    lines = Lines(str(file))
    fracture.fracture([Layout(1, 1)], 2e-3, lines, reach=1.0, far=6.0, size=0.04)
    lines.close()
    (row,) = (json.loads(line) for line in file.read_text().splitlines())
    assert row["elements"] > 2000 and row["channels"] == 25 and row["steps"] >= 10 and row["account"] < 1e-12
    assert all(row["stages"][name] > 0.0 for name in ("flow", "balance", "matrix", "factors", "solve", "output"))
    assert sum(row["stages"].values()) == pytest.approx(row["wall_s"], rel=1e-6)


def test_a_sub_step_of_flow():
    spent = {"intact-20k": 2.0, "wet-20k": 5.0, "soaked-20k": 11.0}
    rows = [
        {"workload": f"blocks-{name}", "ranks": 1, "threads": 1, "cpu_use": 0.5, "wall_s": 2.0 * seconds, "steps": 1}
        for name, seconds in spent.items()
    ]
    assert blocks.sub_step(rows, Layout(1, 1)) == pytest.approx(0.3)
    assert math.isnan(blocks.sub_step(rows[:2], Layout(1, 1))) and math.isnan(blocks.sub_step(rows, Layout(2, 1)))
