"""What elements of a body in space did to the others dies down when they are taken out with `relax`."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import body, box, hexes, nodes_on

CELLS, SIZE = (4, 3, 4), (0.8, 0.6, 0.8)
MESHES = {
    "tetrahedra": box(CELLS, SIZE, shaken=0.15),
    "joints": box(CELLS, SIZE, shaken=0.15),
    "hexahedra": hexes(CELLS, SIZE, shaken=0.15),
    "joints of hexahedra": hexes(CELLS, SIZE, shaken=0.15),
}
JOINTS = {"friction": 30.0, "cohesion": 8e6, "tensile_strength": 2e6, "gf1": 50.0, "gf2": 200.0}


def standing(mesh: Mesh, joints: bool) -> Blocks:
    """On its bottom, under its weight and a pull."""
    sim = body(mesh, dynamic=False)
    if joints:
        sim.joint_model(None, "classic_intrinsic_cohesive_interface", {**JOINTS, "penalty_normal": 5e11})
    sim.gravity(2.0, 1.0, -9.81)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    return sim


def hole(mesh: Mesh) -> np.ndarray:
    """The elements of four cells at its side, whole hexahedra."""
    cell = np.arange(len(mesh.cells)) // 6
    x, y, z = cell % CELLS[0], cell // CELLS[0] % CELLS[1], cell // (CELLS[0] * CELLS[1])
    return np.flatnonzero((x > 1) & (y == 0) & (z > 0) & (z < 3))


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.slow) if k.startswith("joints") else k for k in MESHES]
)
def test_balance_is_kept_at_first_and_lost_bit_by_bit(kind: str) -> None:
    """What is left behind stands for the elements; in the end it is gone, as if they had never been there."""
    mesh = MESHES[kind]
    sim, gone = (standing(mesh, "joints" in kind) for _ in range(2))
    convergence.solve(sim, ratio=1e-8, cycles=50000)
    out = hole(mesh)
    assert len(out) == 24
    rest = np.setdiff1d(np.arange(len(mesh.cells)), out)
    before = diagnostics.values(sim, "stress_zz")[rest]
    changes.null(sim, out, relax=500)
    assert diagnostics.unbalanced_ratio(sim) < 1e-6
    convergence.advance(sim, 1)
    assert np.abs(diagnostics.values(sim, "stress_zz")[rest] - before).max() < 3e-3 * np.abs(before).max()
    convergence.advance(sim, 500)
    assert convergence.solve(sim, ratio=1e-7, cycles=50000).reason == "ratio"
    changes.null(gone, out)
    convergence.solve(gone, ratio=1e-7, cycles=50000)
    for name in ("stress_zz", "stress_xx", "stress_xz"):
        expected = diagnostics.values(gone, name)[rest]
        assert diagnostics.values(sim, name)[rest] == pytest.approx(expected, abs=1e-4 * np.abs(before).max())
    assert np.abs(expected - before).max() > 0.05 * np.abs(before).max()


def test_it_takes_its_time_in_motion() -> None:
    """A bar under weight whose lower half goes: the upper one begins to fall as the force that bore it dies down."""
    mesh = box((1, 1, 4), (0.1, 0.1, 0.4))
    sim = standing(mesh, False)
    sim.gravity(0.0, 0.0, -9.81)
    convergence.solve(sim, ratio=1e-9, cycles=50000)
    sim.option(dynamic=True)
    span = 0.02
    changes.null(sim, np.flatnonzero(mesh.centroids()[:, 2] < 0.2), relax=span)
    begin, free = sim.clock.time, np.flatnonzero(mesh.points[:, 2] > 0.19)
    for part in (0.5, 1.0, 1.5):
        while sim.clock.time < begin + part * span:
            sim.step()
        t = sim.clock.time - begin
        fallen = 9.81 * (0.5 * min(t, span) ** 2 / span + max(0.0, t - span))
        assert -diagnostics.values(sim, "velocity_z")[free].mean() == pytest.approx(fallen, rel=0.02)


def test_a_time_below_zero_is_refused() -> None:
    with pytest.raises(CommandError, match="relax must not be negative"):
        changes.null(standing(MESHES["tetrahedra"], False), [0], relax=-1.0)
