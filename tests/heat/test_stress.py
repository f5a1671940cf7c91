"""Thermal stress in each law of elements, in equilibrium and in motion."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, creep, diagnostics, equilibrium, saved_state, user_laws
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.heat.model import Heat
from hpcdem.pre.mesh.quadratic import quadratic
from tests.blocks.support import ROCK, rectangle, shaken
from tests.blocks.test_user_laws import LAWS as USERS
from tests.flow.support import at
from tests.heat.support import GRANITE, temperatures

E, NU, ALPHA = ROCK["young"], ROCK["poisson_ratio"], 1e-5
HARD = {**ROCK, "limit": 1e20}
STRONG = {**{k: v for k, v in ROCK.items() if k in ("density", "young", "poisson_ratio")}, "friction": 30.0,
          "cohesion": 1e12, "tensile": 1e12}  # fmt: skip
SOFT = {**STRONG, "friction": 0.0, "cohesion": 5e6}
SLOW = {**{k: v for k, v in ROCK.items() if k in ("density", "young", "poisson_ratio")}, "maxwell_viscosity": 1e15}
LAWS = {
    "elastic": ("mech_iso_elastic", ROCK, "mixed"), "strong": ("mech_mohr_coulomb", STRONG, "mixed"),
    "creeping": ("mech_burgers", SLOW, "tri"),
}  # fmt: skip


def heated(law: str, held_x: bool, warmer: float = 50.0, dynamic: bool = False, plate: bool = False) -> Blocks:
    """A block on rollers, all of it warmed; held_x: at both ends."""
    name, values, kind = LAWS[law]
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(6, 4, 1.2, 0.8, kind=kind), 0.2))
    changes.element_model(sim, None, name, values)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    heat.initial(None, 15.0)
    sim.option(dynamic=dynamic, collision=False, plane_stress=plate)
    sim.velocity_condition(at(sim, x=0.0), vx=0.0)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    if held_x:
        sim.velocity_condition(at(sim, x=1.2), vx=0.0)
    heat.prescribe(None, 15.0 + warmer)
    sim.heat_clock(dt=1.0)
    return sim


def warm(sim: Blocks) -> None:
    """The heat goes in while blocks stand still."""
    dynamic = sim.options.dynamic
    sim.option(dynamic=True)
    sim.parts(mechanical=False)
    sim.step()
    sim.parts(mechanical=True, thermal=False)
    sim.option(dynamic=dynamic)


@pytest.mark.parametrize("law", LAWS)
def test_a_free_block_expands_without_stress_in_its_plane(law: str) -> None:
    """Plane strain: alpha (1 + nu) T in the plane, -E alpha T along the third axis."""
    sim = heated(law, held_x=False)
    warm(sim)
    assert equilibrium.solve_elastic(sim).ratio < 1e-9
    wide = ALPHA * 50.0 * (1.0 + NU)
    move = diagnostics.values(sim, "displacement_x")[at(sim, x=1.2)]
    assert move == pytest.approx(1.2 * wide, rel=2e-3)  # of second order in the strain
    for name in ("stress_xx", "stress_yy", "stress_xy"):
        assert np.abs(diagnostics.values(sim, name)).max() < 1e-6 * E * ALPHA * 50.0
    assert diagnostics.values(sim, "stress_zz") == pytest.approx(-E * ALPHA * 50.0, rel=2e-3)


def test_six_node_triangles_bend_without_stress_where_temperature_is_linear() -> None:
    """They bear it at their Gauss points; what is stored is that of the stress -E alpha T along the third axis."""
    sim = Blocks()
    sim.take_mesh(quadratic(rectangle(3, 2, 1.2, 0.8)).mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    heat.initial(None, 0.0)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.velocity_condition(at(sim, x=0.0, y=0.0), vx=0.0, vy=0.0)
    sim.velocity_condition(at(sim, x=1.2, y=0.0), vy=0.0)
    for y in np.unique(sim.mesh.points[:, 1]).tolist():
        heat.prescribe(at(sim, y=y), 100.0 * y)
    sim.heat_clock(dt=1.0)
    warm(sim)
    equilibrium.solve_elastic(sim)
    for name in ("stress_xx", "stress_yy", "stress_xy"):
        assert np.abs(diagnostics.values(sim, name)).max() < 1e-9 * E * ALPHA * 80.0
    whole = 0.5 * E * (ALPHA * 100.0) ** 2 * 1.2 * 0.8**3 / 3.0
    assert sim.local.stresses()[1].sum() == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_a_block_between_walls_is_pressed(law: str) -> None:
    """-E alpha T / (1 - nu) along x and z, none along y; relaxation and the static solve agree."""
    sim, other = heated(law, held_x=True), heated(law, held_x=True)
    for one in (sim, other):
        warm(one)
    equilibrium.solve_elastic(sim)
    for _ in range(1500):
        other.step()
    assert diagnostics.unbalanced_ratio(other) < 1e-6
    for one in (sim, other):
        for name, share in (("xx", 1.0), ("yy", 0.0), ("zz", 1.0)):
            found = diagnostics.values(one, f"stress_{name}")
            assert found == pytest.approx(-share * E * ALPHA * 50.0 / (1.0 - NU), rel=3e-3, abs=1e-3 * E * ALPHA * 50.0)


@pytest.mark.some_of_each
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("held", [0, 1, 2], ids=["free", "held along x", "held"])
def test_a_plate_in_plane_stress(law: str, held: int) -> None:
    """Free: alpha T each way, without any stress. Held along x: -E alpha T there alone; held along y too
    -E alpha T / (1 - nu) in both. What is stored is that of these stresses."""
    sim, t = heated(law, held_x=held > 0, plate=True), ALPHA * 50.0
    sim.option(large_strain=False)
    if held == 2:
        sim.velocity_condition(at(sim, y=0.8), vy=0.0)
    warm(sim)
    equilibrium.solve_elastic(sim)
    stress = (0.0, E * t, E * t / (1.0 - NU))[held]
    for name, pressed in (("xx", held > 0), ("yy", held == 2), ("zz", False)):
        found = diagnostics.values(sim, f"stress_{name}")
        assert found == pytest.approx(np.full(len(found), -stress * pressed), rel=1e-6, abs=1e-6 * E * t)
    if held < 2:
        move = diagnostics.values(sim, "displacement_y")[at(sim, y=0.8)]
        assert move == pytest.approx(np.full(len(move), 0.8 * t * (1.0 + NU * held)), rel=1e-6)
    density = (0.0, 0.5 * stress**2 / E, stress**2 / E * (1.0 - NU))[held]
    assert diagnostics.total(sim, "strain_energy") == pytest.approx(1.2 * 0.8 * density, rel=1e-6, abs=1e-6 * E * t * t)


def test_a_block_between_walls_yields() -> None:
    """Tresca: the largest difference of principal stresses is twice the cohesion."""
    LAWS["soft"] = "mech_mohr_coulomb", SOFT, "mixed"
    try:
        sim = heated("soft", held_x=True)
    finally:
        del LAWS["soft"]
    warm(sim)
    equilibrium.solve_elastic(sim, steps=20)
    high, low = diagnostics.values(sim, "stress_max"), diagnostics.values(sim, "stress_min")
    low = np.minimum(low, diagnostics.values(sim, "stress_zz"))
    assert high - low == pytest.approx(2.0 * SOFT["cohesion"], rel=1e-3)
    assert E * ALPHA * 50.0 / (1.0 - NU) > 2.0 * SOFT["cohesion"]


def test_stress_is_counted_from_the_initial_temperature() -> None:
    """Of the model, of initial, of the moment; the expansion alone changes it."""
    sim = heated("elastic", held_x=True)
    warm(sim)
    heat = Heat.of(sim)
    hot = diagnostics.values(sim, "stress_xx")
    bulk = E / (3.0 * (1.0 - 2.0 * NU))
    assert hot == pytest.approx(-3.0 * bulk * ALPHA * 50.0, rel=1e-12)
    heat.adjust(None, {"expansion_coeficient": 2.0 * ALPHA})
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(2.0 * hot, rel=1e-12)
    heat.initial(at(sim, x=0.0), 65.0)
    corner = sim.mesh.cells
    beside = np.isin(corner, at(sim, x=0.0)).any(axis=1)
    found = diagnostics.values(sim, "stress_xx")
    assert np.abs(found[beside]).max() < 1e-4 and found[~beside] == pytest.approx(2.0 * hot[~beside], rel=1e-12)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() < 1e-4


def test_a_bar_is_thrown_by_heat_and_its_energy_adds_up() -> None:
    """In motion: what heat brings becomes motion and strain. What does not add up is of the order of the strain,
    as forces are those of the present shape."""
    errors = []
    for warmer in (200.0, 20.0):
        sim = heated("elastic", held_x=False, dynamic=True)
        sim.heat_clock(dt=0.0)
        sim.table("pulse", [(0.0, 15.0), (4e-4, 15.0 + warmer), (1.0, 15.0 + warmer)])
        Heat.of(sim).prescribe(None, "pulse")
        sim.time_step(value=5e-6)
        diagnostics.account_energy(sim)
        for _ in range(120):
            sim.step()
        found = diagnostics.energies(sim)
        errors.append(found["relative"])
        assert temperatures(sim) == pytest.approx(15.0 + warmer)
        assert found["work_heat"] > found["kinetic"] > 0.01 * found["work_heat"] and found["strain"] > 0.0
    assert errors[0] < 5e-4 and errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize("law", ["elastic", "creeping", "soft"])
def test_a_restart_knows_thermal_stress(law: str, tmp_path) -> None:
    """Heat, stress, flow and creep go on bit by bit, wherever lists are renewed."""
    LAWS["soft"] = "mech_mohr_coulomb", SOFT, "mixed"
    try:
        sim = heated(law, held_x=True, dynamic=True)
    finally:
        del LAWS["soft"]
    sim.table("pulse", [(0.0, 15.0), (2e-5, 215.0), (1.0, 215.0)])
    sim.heat_clock(dt=0.0)
    Heat.of(sim).prescribe(at(sim, x=0.0), "pulse")
    Heat.of(sim).prescribe(at(sim, x=0.2), 60.0)
    if law == "creeping":
        creep.switch(sim, True)
    for _ in range(20):
        sim.step()
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for k in range(30):
        sim.step()
        if k == 10:
            sim.rebuild()
        other.step()
    for name in ("stress_xx", "stress_zz", "velocity_x", "temperature"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name)), name
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() > 1e5


def test_laws_of_users_know_no_temperature() -> None:
    sim = Blocks()
    sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
    changes.element_model(sim, None, user_laws.load(sim, USERS, "rock.py:tresca").name, HARD)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": ALPHA})
    with pytest.raises(CommandError, match="does not support the out-of-plane strain of heat"):
        sim.step()
    heat.adjust(None, {"expansion_coeficient": 0.0})
    sim.step()


def test_beside_laws_of_users_moduli_may_follow_temperatures() -> None:
    """A cycle of heat changes nothing of the stress that elements with a law are told to have."""
    sim = Blocks()
    sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
    sim.table("softer", [(0.0, ROCK["young"]), (100.0, 0.5 * ROCK["young"])])
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": Over("softer", TEMPERATURE)})
    changes.element_model(sim, np.arange(4), user_laws.load(sim, USERS, "rock.py:tresca").name, HARD)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.open_model()
    sim.x[:, ::2] += 1e-4 * sim.x[:, 1::2]
    sim.close_model()
    before = diagnostics.values(sim, "stress_xy")
    heat.prescribe(None, 100.0)
    sim.heat_clock(dt=1.0)
    sim.step()
    after = diagnostics.values(sim, "stress_xy")
    assert np.array_equal(after[:4], before[:4]) and before.min() > 1e5
    assert after[4:] == pytest.approx(0.5 * before[4:], rel=1e-9)


@pytest.mark.parametrize("capacity", [800.0, 1e-4])
def test_slow_heat_waits_for_ten_steps(tmp_path, capacity: float) -> None:
    """Without a word on sub-steps: rock is warm and under stress as by cycles in each step, quick heat has one in each;
    a run that goes on from a file between two cycles comes to the same bits."""
    found = {}
    for steps in (0, 1):  # as many as are stable, one
        sim = Blocks()
        sim.take_mesh(shaken(rectangle(6, 4, 1.2, 0.8), 0.2))
        changes.element_model(sim, None, "mech_iso_elastic", ROCK)
        heat = Heat.of(sim)
        heat.assign(None, {**GRANITE, "capacity": capacity, "expansion_coeficient": ALPHA})
        heat.prescribe(at(sim, x=0.0), 100.0)
        sim.option(collision=False)
        sim.heat_clock(steps=steps)
        for _ in range(47):
            sim.step()
        saved_state.save(sim, tmp_path / "a.sav")
        other = Blocks()
        saved_state.restore(other, tmp_path / "a.sav")
        for one in (sim, other):
            for _ in range(54):
                one.step()
        assert np.array_equal(temperatures(sim), temperatures(other))
        assert np.array_equal(diagnostics.values(sim, "stress_xx"), diagnostics.values(other, "stress_xx"))
        found[steps] = heat.cycles, heat.time, temperatures(sim), sim.clock.time
    cycles, time, t, now = found[0]
    assert cycles == (11 if capacity > 1.0 else 101) and found[1][0] == 101
    assert time == pytest.approx(now, rel=1e-9) and found[1][1] == pytest.approx(now, rel=1e-9)
    assert t == pytest.approx(found[1][2], abs=1e-3 * np.ptp(found[1][2])) and np.ptp(t) > 0.0


@pytest.mark.parametrize("change", ["time step", "sub-steps", "static"])
def test_heat_that_waits_loses_no_time(change: str) -> None:
    """Four steps after a cycle something else sets the pace: the time of these steps is not forgotten, and the account
    closes."""
    sim = Blocks()
    sim.take_mesh(rectangle(4, 4, 1.0, 1.0))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "capacity": 800.0})
    heat.prescribe(at(sim, x=0.0), 100.0)
    sim.option(collision=False)
    sim.time_step(value=1e-6)
    for _ in range(15):
        sim.step()
    assert heat.time == pytest.approx(11e-6, rel=1e-9)
    own = 0.0
    if change == "time step":
        sim.time_step(value=2e-6)
    elif change == "sub-steps":
        sim.heat_clock(steps=1)
    else:
        sim.option(dynamic=False)
        sim.heat_clock(dt=1e-3)
        own = 6e-3
    for _ in range(6):
        sim.step()
    assert heat.time == pytest.approx(sim.clock.time + own, rel=1e-9)
    assert heat.account()["relative"] < 1e-12
