"""A drift in stages: excavated, half of the stress let go, bolts and a liner put in, the rest let go, filled again."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.liners.model import Liners
from tests.blocks.support import ROCK, model, rectangle
from tests.bolts.support import STEEL
from tests.liners.support import SHOTCRETE

SPAN = 400.0


def drift(supported: bool = True) -> tuple[Blocks, np.ndarray]:
    """A drift of 2 m x 2 m in 10 m x 10 m under 4 MPa, elastic, sides held; its elements are out, and half of what
    they did is let go when the support comes; all of it at the end."""
    mesh = rectangle(20, 20, 10.0, 10.0, kind="quad")
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9})
    sim.option(dynamic=False, collision=False)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((x == 0.0) | (x == 10.0)), vx=0.0)
    sim.velocity_condition(np.flatnonzero((y == 0.0) | (y == 10.0)), vy=0.0)
    sim.initial_stress(None, xx=-4e6, yy=-4e6, xy=0.0)
    core = np.flatnonzero((np.abs(mesh.centroids() - 5.0) < 1.0).all(axis=1))
    changes.null(sim, core, relax=SPAN)
    convergence.advance(sim, int(SPAN) // 2)
    if supported:
        faces = sim.mesh.edges().faces
        wall = faces[np.isin(faces // 4, core).sum(axis=1) == 1]
        liners = Liners.of(sim)
        _, elements = liners.create(wall[~np.isin(wall // 4, core)])
        liners.assign(elements, {**SHOTCRETE, "thickness": 0.2, "normal_stiffness": 2e10, "shear_stiffness": 2e10})
        bolts = Bolts.of(sim)
        for top in (4.3, 5.7):
            _, bars = bolts.create([(top, 6.0), (top, 8.5)], plate=True, segments=10)
            bolts.assign(bars, STEEL)
    convergence.advance(sim, int(SPAN) // 2)
    assert convergence.solve(sim, ratio=1e-6, cycles=60_000).reason == "ratio"
    return sim, core


def closure(sim: Blocks) -> float:
    """How far roof and floor have come together [m]."""
    x, y = sim.mesh.points.T
    roof, floor = (int(np.flatnonzero((x == 5.0) & (y == at))[0]) for at in (6.0, 4.0))
    moved = diagnostics.values(sim, "displacement_y")
    return float(moved[floor] - moved[roof])


@pytest.mark.slow
def test_support_takes_what_comes_after_it_and_fill_what_comes_after_that() -> None:
    bare, _ = drift(False)
    sim, core = drift()
    liners, bolts = Liners.of(sim), Bolts.of(sim)
    assert len(liners) == len(liners.elements["row"]) == 16  # a closed ring
    assert 0.5 * closure(bare) < closure(sim) < 0.9 * closure(bare)  # half had come before
    thrust, tension = (one.elements["force"].copy() for one in (liners, bolts))
    assert thrust[:, 0].min() < -2e5 and tension.max() > 1e3
    # The fill comes without stress, where the drift is now: nothing moves.
    changes.element_model(sim, core, "mech_iso_elastic", {**ROCK, "young": 0.5e9})
    assert np.array_equal(liners.elements["force"], thrust) and np.array_equal(bolts.elements["force"], tension)
    assert convergence.solve(sim, ratio=1e-6, cycles=20_000).reason == "ratio"
    assert liners.elements["force"][:, 0] == pytest.approx(thrust[:, 0], rel=0.01)
    assert (liners.elements["host"] >= 0).all() and bolts.hosted.all()
    # Pressed together from above, the filled one gives way less, and its liner gets less more.
    more = []
    open_, _ = drift()
    for one in (sim, open_):
        before, held = closure(one), Liners.of(one).elements["force"][:, 0].min()
        top = np.flatnonzero(one.mesh.points[:, 1] == 10.0)
        one.velocity_condition(top, vy=-5e-6)
        convergence.advance(one, 1000)
        one.velocity_condition(top, vy=0.0)
        assert convergence.solve(one, ratio=1e-6, cycles=60_000).reason == "ratio"
        more.append((closure(one) - before, held - Liners.of(one).elements["force"][:, 0].min()))
    assert more[0][0] < 0.8 * more[1][0] and more[0][1] < more[1][1]


def test_the_ring_can_be_removed_before_the_fill() -> None:
    """Without it the drift closes further, as much as one that never had it, but for the bolts."""
    sim, _ = drift()
    bare, _ = drift(False)
    before = closure(sim)
    liners = Liners.of(sim)
    liners.delete(np.arange(16))
    Bolts.of(sim).delete(np.arange(20))
    assert convergence.solve(sim, ratio=1e-7, cycles=60_000).reason == "ratio"
    assert closure(sim) > before and closure(sim) == pytest.approx(closure(bare), rel=0.002)
