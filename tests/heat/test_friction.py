"""Heat of friction: a block slides on another, the work of friction becomes heat in both."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import EVERY_KIND, ROCK, joined, rectangle

MU, PRESSURE, SPEED = 0.5, 1e6, 2.0
UPPER = {"conductivity": 2.5, "capacity": 1000.0}
LOWER = {"conductivity": 10.0, "capacity": 1000.0}
"""Twice the effusivity."""


def sliding(upper: float = 1.0, lower: float = 1.0, kind: str = "cross", cells: tuple[int, int] = (4, 2),
            edge: float = 0.1, speed: float = SPEED, conducts: float = 1.0) -> Blocks:  # fmt: skip
    """A block, pressed from above, slides at constant speed on another one that is held; parts of the work of friction
    that both take as heat."""
    sim = Blocks()
    width, height = edge * cells[0], edge * cells[1]
    block = rectangle(*cells, width, height, kind=kind)
    sim.take_mesh(joined(block, rectangle(*cells, width, height, y0=-height - 1e-8, kind=kind)))
    changes.element_model(sim, None, "mech_iso_elastic",
                          {**ROCK, "friction": math.degrees(math.atan(MU)), "damp_factor": 0.2})  # fmt: skip
    n, points = len(block.cells), len(block.points)
    heat = Heat.of(sim)
    for at, wall, part in ((np.arange(n), UPPER, upper), (np.arange(n, len(sim.mesh.cells)), LOWER, lower)):
        heat.assign(at, {**wall, "conductivity": conducts * wall["conductivity"], "friction_heat": part})
    sim.velocity_condition(np.arange(points), vx=speed)
    sim.velocity_condition(np.arange(points, len(sim.mesh.points)), vx=0.0, vy=0.0)
    sim.stress_condition(faces(sim, height), normal=-PRESSURE)
    changes.set_velocity(sim, np.arange(points), vx=speed)
    return sim


def slide(sim: Blocks, time: float) -> float:
    """For about this time [s]; how long it was."""
    sim.close_model()
    before = sim.clock.time
    while sim.clock.time - before < time:
        sim.step()
    return float(sim.clock.time - before)


def faces(sim: Blocks, y: float) -> np.ndarray:
    edges = sim.mesh.edges()
    on = ~edges.inner & (np.abs(sim.mesh.points[edges.points][:, :, 1] - y) < 1e-9).all(axis=1)
    return edges.faces[on, 0]


def stored(sim: Blocks) -> tuple[float, float]:
    """Heat in the upper and in the lower block [J/m]."""
    mesh, t = sim.mesh, diagnostics.values(sim, "mean_temperature")
    of = np.where(mesh.centroids()[:, 1] > 0.0, UPPER["capacity"], LOWER["capacity"]) * ROCK["density"]
    each = of * mesh.areas() * t
    upper = mesh.centroids()[:, 1] > 0.0
    return float(each[upper].sum()), float(each[~upper].sum())


@EVERY_KIND
def test_the_work_of_friction_becomes_heat(kind: str) -> None:
    """mu p L v t, in the ratio of the effusivities, 1 to 2; what contact takes of the energy is that and what its
    springs store."""
    sim = sliding(kind=kind)
    diagnostics.account_energy(sim)
    time = slide(sim, 2e-3)
    work = MU * PRESSURE * 0.4 * SPEED * time
    upper, lower = stored(sim)
    assert upper + lower == pytest.approx(work, rel=1e-3)
    assert lower == pytest.approx(2.0 * upper, rel=1e-9)
    account = Heat.of(sim).account()
    assert account["given"] == pytest.approx(upper + lower, rel=1e-12) and account["relative"] < 1e-12
    assert diagnostics.energies(sim)["contact"] == pytest.approx(work, rel=1e-3)


def test_each_wall_takes_the_part_of_its_share_that_was_said() -> None:
    """It alone changes the temperature, and nothing of the motion."""
    found = {parts: sliding(*parts) for parts in ((1.0, 1.0), (0.0, 0.0), (0.5, 0.0), (0.0, 0.25))}
    for sim in found.values():
        slide(sim, 2e-4)
    upper, lower = stored(found[1.0, 1.0])
    assert upper > 1.0
    for (one, two), sim in found.items():
        assert stored(sim) == pytest.approx((one * upper, two * lower), rel=1e-12)
        assert np.array_equal(diagnostics.values(sim, "velocity_y"), diagnostics.values(found[1.0, 1.0], "velocity_y"))


def test_walls_get_warmer_with_the_root_of_time() -> None:
    """2 q sqrt(t / pi) / e of half spaces with a constant flux q into each (Carslaw & Jaeger 1959, 2.9), the same on
    both walls: q_i / e_i = mu p v / (e_1 + e_2). (Rock that conducts so well that 2 ms suffice.)"""
    more = 1.2e6
    sim = sliding(cells=(3, 24), edge=0.0125, speed=0.2, conducts=more)
    sim.initial_stress(None, yy=-PRESSURE)  # no waves at the beginning
    effusivity = sum(math.sqrt(more * k["conductivity"] * ROCK["density"] * k["capacity"]) for k in (UPPER, LOWER))
    y, time = sim.mesh.points[:, 1], 0.0
    for until in (1e-3, 2e-3):
        time += slide(sim, until - time)
        expected = 2.0 * MU * PRESSURE * 0.2 * math.sqrt(time / math.pi) / effusivity
        t = diagnostics.values(sim, "temperature")
        for wall in (y == 0.0, np.abs(y + 1e-8) < 1e-12):
            assert t[wall].mean() == pytest.approx(expected, rel=0.01)


def test_a_restart_knows_the_heat_that_waits(tmp_path) -> None:
    """Heat flows every seventh step."""
    sim = sliding()
    sim.flow_clock(every=7)
    for _ in range(24):
        sim.step()
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for k in range(20):
        sim.step()
        if k == 9:
            sim.rebuild()
        other.step()
    one, two = (diagnostics.values(each, "temperature") for each in (sim, other))
    assert np.array_equal(one, two) and one.max() > 0.0


def test_friction_that_cannot_warm_is_refused() -> None:
    sim = sliding()
    sim.option(collision=False)
    with pytest.raises(CommandError, match="element 0 has friction-heat, but contact is off"):
        sim.step()
    sim.option(dynamic=False, collision=True)
    sim.heat_clock(dt=1.0)
    with pytest.raises(CommandError, match="element 0 has friction-heat, but static runs have no sliding velocity"):
        sim.step()
    sim.remove_conditions()
    sim.parts(thermal=False)
    sim.step()
    with pytest.raises(CommandError, match="friction_heat must be >= 0 and <= 1"):
        Heat.of(sim).adjust(None, {"friction_heat": 1.5})
