"""scripts/bench blocks: the workloads are what they say, and all layouts end with the same bits."""

from __future__ import annotations

import json
import os
import sys

import numpy as np
import pytest

from hpcdem.physics.fdem.simulation import Blocks
from tests.conftest import ROOT, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from bench import blocks

from hpcdem.physics.fdem import convergence, diagnostics, user_laws


def made(kind: str, side: int = 8) -> Blocks:
    sim = Blocks()
    blocks.MAKERS[kind](sim, side)
    convergence.advance(sim, 20)
    return sim


def test_workloads_are_what_they_say():
    inner = 8 * 8 + 2 * 8 * 7
    assert diagnostics.joint_counts(made("intact")) == (inner, 0, 0)
    intact, yielded, broken = diagnostics.joint_counts(made("yielded"))
    assert yielded > 0.9 * inner and broken == 0
    pairs = made("pairs")
    assert int(pairs.local.pairs.touching.sum()) == 64 and len(diagnostics.contacts(pairs)["x"]) == 64
    shattered = made("shattered")
    assert diagnostics.joint_counts(shattered) == (0, 0, 0)
    assert int(shattered.local.pairs.touching.sum()) > inner / 2
    quads = made("quads")
    assert len(quads.mesh.cells) == 64 and (quads.mesh.cells[:, 3] >= 0).all()
    assert np.abs(diagnostics.values(quads, "stress_xx")).max() > 1e3
    for work in blocks.WORKLOADS.values():
        assert work.kind in blocks.RATES and work.kind in blocks.MAKERS


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "own"), [("intact", "own"), ("quads", "own-quads")])
def test_workloads_with_a_law_of_the_user_do_the_same(kind, own):
    obeys = made(own)
    assert blocks.digest(obeys) == blocks.digest(made(kind)) and user_laws.in_use(obeys)


@pytest.mark.mpi
@pytest.mark.slow
def test_layouts_end_with_the_same_bits(tmp_path):
    paths = os.pathsep.join(filter(None, (str(ROOT / "scripts" / "lib"), os.environ.get("PYTHONPATH"))))
    layouts = ("--layout", "1x1", "--layout", "2x1", "--layout", "1x2")
    names = ("--workload", "shattered-20k", "--workload", "yielded-20k")
    done = run(
        [sys.executable, "-m", "bench", "blocks", *names, *layouts, "--repeats", "1", "--seconds", "0.001", "--json",
         "lines.json"],
        tmp_path, env={"PYTHONPATH": paths},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in (tmp_path / "lines.json").read_text().splitlines()]
    assert len(rows) == 6 and all(row["element_steps_per_s"] > 0.0 for row in rows)
    for name in ("blocks-shattered-20k", "blocks-yielded-20k"):
        assert len({row["digest"] for row in rows if row["workload"] == name}) == 1
