"""Borders between ranks follow the cost of elements, not their number."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest


@pytest.mark.mpi
def test_borders_follow_broken_zones(launch, tmp_path):
    """A long bed of which the left third is shattered: cut again, both ranks have equal cost, not number."""
    run = launch.python(2, __file__, cwd=tmp_path)
    assert run.returncode == 0, run.stderr[-2000:]
    rows = sorted(line.split() for line in run.stdout.splitlines() if line.startswith("borders"))
    (_, _, left, left_cost), (_, _, right, right_cost) = rows
    assert int(left) < 0.7 * int(right)
    assert abs(float(left_cost) / float(right_cost) - 1.0) < 0.25  # whole columns change hands


def main() -> None:
    """Says how many elements each rank has, and their cost."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from hpcdem.physics.fdem import changes, convergence
    from hpcdem.physics.fdem.simulation import Blocks
    from tests.blocks.models import COHESIVE, WEAK
    from tests.blocks.support import ROCK, rectangle
    from tests.parallel.model import communicator

    sim = Blocks(communicator())
    sim.take_mesh(rectangle(60, 4, 6.0, 0.4))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.1, "friction": 30.0})
    sim.joint_model(None, COHESIVE, WEAK)
    edges = sim.mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    changes.crack(sim, inner[sim.mesh.centroids()[inner // 4, 0] < 2.0])
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 0.4 - 1e-9), vy=-0.1)
    convergence.advance(sim, 200)  # everything touches now, and remembers it
    sim.open_model()
    sim.ownership.wanted = True
    sim.close_model()
    sim.open_model()
    # One write: ranks share a pipe, and pieces of lines would mix.
    print(f"borders {sim.comm.rank} {len(sim.number)} {float(sim._costs().sum())}\n", end="", flush=True)


if __name__ == "__main__":
    main()
