"""Heat of friction in space: a block slides on another, the work of friction becomes heat in both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from hpcdem.commands.fdem.project import joined
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.heat.model import Heat
from tests.heat.test_friction import LOWER, MU, PRESSURE, SPEED, UPPER, slide
from tests.space.support import ROCK, box, hexes

BOTH = pytest.mark.parametrize("of", [box, hexes])
SIZE = (0.4, 0.3, 0.2)


def sliding(of: Any, upper: float = 1.0, lower: float = 1.0) -> Blocks:
    """A block, pressed from above, slides at constant speed on another one that is held; parts of the work of friction
    that both take as heat."""
    block, base = of((4, 3, 2), SIZE), of((5, 4, 2), (0.5, 0.4, 0.2))
    mesh = joined(block, Mesh.of(base.points - (0.05, 0.05, 0.2 + 1e-8), base.cells, macros=base.hexes))
    sim = Blocks()
    sim.take_mesh(mesh)
    rock = {**ROCK, "young": 1e9, "friction": math.degrees(math.atan(MU)), "damp_factor": 0.2}
    changes.element_model(sim, None, "mech_iso_elastic", rock)
    n, points = len(block.cells), np.arange(len(mesh.points)) < len(block.points)
    heat = Heat.of(sim)
    for at, wall, part in ((np.arange(n), UPPER, upper), (np.arange(n, len(mesh.cells)), LOWER, lower)):
        heat.assign(at, {**wall, "friction_heat": part})
    sim.velocity_condition(np.flatnonzero(points), vx=0.8 * SPEED, vy=0.6 * SPEED)
    sim.velocity_condition(np.flatnonzero(~points), vx=0.0, vy=0.0, vz=0.0)
    edges = mesh.edges()
    top = ~edges.inner & (np.abs(mesh.points[edges.points][:, :, 2] - SIZE[2]) < 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[top, 0], normal=-PRESSURE)
    sim.initial_stress(None, zz=-PRESSURE)
    changes.set_velocity(sim, np.flatnonzero(points), vx=0.8 * SPEED, vy=0.6 * SPEED)
    return sim


def stored(sim: Blocks) -> tuple[float, float]:
    """Heat in the upper and in the lower block [J]."""
    z = sim.mesh.centroids()[:, 2]
    volume = sim.areas * diagnostics.values(sim, "mean_temperature") * ROCK["density"]
    return float(volume[z > 0.0].sum() * UPPER["capacity"]), float(volume[z < 0.0].sum() * LOWER["capacity"])


@BOTH
def test_the_work_of_friction_becomes_heat(of: Any) -> None:
    """mu p A v t, in the ratio of the effusivities, 1 to 2; what contact takes of the energy is that and what its
    springs store."""
    sim = sliding(of)
    diagnostics.account_energy(sim)
    time = slide(sim, 4e-3)
    work = MU * PRESSURE * SIZE[0] * SIZE[1] * SPEED * time
    upper, lower = stored(sim)
    account = Heat.of(sim).account()
    contact = diagnostics.energies(sim)["contact"]
    assert account["given"] == pytest.approx(upper + lower, rel=1e-12) and account["relative"] < 1e-12
    assert lower == pytest.approx(2.0 * upper, rel=1e-9)
    assert upper + lower == pytest.approx(work, rel=1e-3)
    assert contact == pytest.approx(upper + lower, rel=5e-3)


@BOTH
def test_each_wall_takes_the_part_of_its_share_that_was_said(of: Any) -> None:
    """It alone changes the temperature, and nothing of the motion."""
    found = {parts: sliding(of, *parts) for parts in ((1.0, 1.0), (0.0, 0.0), (0.5, 0.0), (0.0, 0.25))}
    for sim in found.values():
        slide(sim, 2e-4)
    upper, lower = stored(found[1.0, 1.0])
    assert upper > 0.1
    for (one, two), sim in found.items():
        assert stored(sim) == pytest.approx((one * upper, two * lower), rel=1e-12)
        assert np.array_equal(diagnostics.values(sim, "velocity_z"), diagnostics.values(found[1.0, 1.0], "velocity_z"))
