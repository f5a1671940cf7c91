"""The dashpot of contact models: its ratio, the energy that it takes, the time step that it needs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import joined, model, rectangle

RHO, P = 2700.0, 2e7


def block_on_plate(ratio: float) -> Blocks:
    """A square of two triangles on a fixed plate, so soft a contact that both are rigid beside it."""
    sim = model(joined(rectangle(1, 1, 0.1, 0.1, x0=0.112, y0=1e-9), rectangle(3, 1, 0.3, 0.1, y0=-0.1)))
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": P, "damping_ratio": ratio})
    sim.velocity_condition(np.arange(4, len(sim.mesh.points)), vx=0.0, vy=0.0)
    sim.velocity_condition(np.arange(4), vx=0.0)
    sim.gravity(0.0, -3000.0)
    return sim


def test_a_block_on_a_spring_swings_with_the_ratio_that_was_asked_for():
    """k = 3 P (1/h + 1/h) per area, c = 2 xi sqrt(k' m), 1/h here: mean edge over twice the area, m = rho h / 6: two
    free elements would have xi, a body of mass M per area has c / (2 sqrt(k M)). Measured by the logarithmic decrement
    of the way about rest, after the first touch and without losing touch."""
    ratio = 0.6
    sim = block_on_plate(ratio)
    per = (0.2 + 0.1 * math.sqrt(2.0)) / 3.0 / 0.01  # 1/h of both
    c = 2.0 * ratio * math.sqrt(3.0 * P * 2.0 * per * RHO / (6.0 * per))
    k, mass = 3.0 * P * 20.0, RHO * 0.1
    expected = c / (2.0 * math.sqrt(k * mass))
    omega = math.sqrt(k / mass * (1.0 - expected**2))
    sim.step()
    dt = sim.clock.dt
    y = []
    while sim.clock.time < 4.0 * 2.0 * math.pi / omega:
        convergence.advance(sim, 20)
        y.append(diagnostics.values(sim, "displacement_y", np.arange(4)).mean())
    about = np.array(y) + mass * 3000.0 / k
    turns = [abs(about[i]) for i in range(1, len(y) - 1) if (y[i] - y[i - 1]) * (y[i + 1] - y[i]) <= 0.0][:4]
    assert len(turns) >= 3 and dt > 0.0
    decrement = math.log(turns[0] / turns[2]) / 2.0  # per half a turn
    assert decrement / math.hypot(math.pi, decrement) == pytest.approx(expected, rel=0.08)
    without = block_on_plate(0.0)
    convergence.advance(without, 2000)
    assert without.clock.dt > dt  # a dashpot needs smaller steps


def test_what_it_takes_is_in_the_account(tmp_path):
    """A block that falls on a plate comes back slower, contact has lost the difference, the account closes; with a
    restart on the way the same bits."""
    speeds = []
    for ratio in (0.0, 0.5):
        sim = block_on_plate(ratio)
        sim.gravity(0.0, 0.0)
        changes.set_velocity(sim, np.arange(4), vy=-0.2)
        diagnostics.account_energy(sim)
        sim.step()
        start = diagnostics.energies(sim)["kinetic"] + diagnostics.energies(sim)["contact"]
        for part in range(60):
            convergence.advance(sim, 25)
            if part == 7:
                saved_state.save(sim, tmp_path / "mid.sav")
                middle = sim.clock.step
            if not len(diagnostics.contacts(sim)["x"]) and sim.clock.step > 200:
                break
        found = diagnostics.energies(sim)
        assert found["relative"] < 1e-6
        speeds.append(diagnostics.values(sim, "velocity_y", np.arange(4)).mean())
        assert found["contact"] == pytest.approx(start - found["kinetic"] - found["strain"], abs=1e-3 * start)
        again = Blocks()
        saved_state.restore(again, tmp_path / "mid.sav")
        convergence.advance(again, sim.clock.step - middle)
        assert np.array_equal(diagnostics.values(again, "velocity_y"), diagnostics.values(sim, "velocity_y"))
    assert speeds[0] == pytest.approx(0.2, rel=0.01)
    assert 0.02 < speeds[1] < 0.16


def test_it_has_no_part_in_static_runs():
    ends = []
    for ratio in (0.0, 0.5):
        sim = block_on_plate(ratio)
        sim.option(dynamic=False)
        convergence.advance(sim, 300)
        ends.append(diagnostics.values(sim, "position_y"))
    assert np.array_equal(*ends)


@pytest.mark.slow
def test_a_sliding_block_on_soft_contacts_stops_trembling():
    """31 degrees, friction 30: without a dashpot friction keeps the block in vibration, with one it dies down."""
    late = {}
    for ratio in (0.0, 1.0):
        block, plate = rectangle(4, 2, 0.4, 0.2, x0=0.513, y0=0.0), rectangle(20, 1, 2.0, 0.1, y0=-0.1)
        sim = model(joined(block, plate))
        sim.element_property(None, {"young": 1e9, "damp_factor": 0.2})
        sim.face_model(None, "contact_mohr_coulomb", {"friction": 30.0, "penalty_normal": 2e8, "damping_ratio": ratio})
        n, slope = len(block.points), math.radians(31.0)
        sim.velocity_condition(np.arange(n, len(sim.mesh.points)), vx=0.0, vy=0.0)
        sim.gravity(9.81 * math.sin(slope), -9.81 * math.cos(slope))
        convergence.solve(sim, time=0.3)
        late[ratio] = np.abs(diagnostics.values(sim, "velocity_y", np.arange(n))).max()
    assert late[0.0] > 3e-4 and late[1.0] < 0.05 * late[0.0]
