"""scripts/bench coupled: the workload is what it says, and its lines are whole."""

from __future__ import annotations

import json
import os
import sys

import pytest

from hpcdem.core.comm import SerialComm
from tests.conftest import ROOT, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from bench import coupled


def test_the_workload_is_what_it_says():
    both = coupled.make(SerialComm(), 1, across=12)
    both.advance(50)
    assert len(both.particles.particles) == 144 and len(both.blocks.the_mesh().cells) == 220
    found = both.contacts()
    assert len(set(found["id"])) == 12 and found["fn"].min() > 0.0


@pytest.mark.mpi
@pytest.mark.slow
def test_layouts_end_with_the_same_bits(tmp_path):
    paths = os.pathsep.join(filter(None, (str(ROOT / "scripts" / "lib"), os.environ.get("PYTHONPATH"))))
    done = run(
        [sys.executable, "-m", "bench", "coupled", "--layout", "1x1", "--layout", "2x1", "--repeats", "1", "--seconds",
         "0.001", "--json", "lines.json"],
        tmp_path, env={"PYTHONPATH": paths},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in (tmp_path / "lines.json").read_text().splitlines()]
    assert len(rows) == 2 and len({row["digest"] for row in rows}) == 1
    for row in rows:
        assert row["steps_per_s"] > 0.0 and row["stages"]["between: contact"] > 0.0
