"""Blocks that are heated, break and fly: models for tests/parallel/test_models.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem import changes, creep, diagnostics
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, rectangle, shaken
from tests.flow.models import bursting
from tests.flow.models import more as burst_on
from tests.flow.support import inner
from tests.heat.support import GRANITE
from tests.parallel.model import Found, Model
from tests.proppant.models import result as of_sand
from tests.proppant.models import sand_on_in_space, sandy, sandy_in_space

WATER = {"conductivity": 0.6, "capacity": 4200.0, "transfer_coeficient": 5e4, "second_order": 1.0}
HOT = {**GRANITE, "expansion_coeficient": 2e-5, "transfer_coeficient": 50.0}


def cracking(sim: Blocks) -> None:
    """A jointed block is heated from inside until it breaks, while it flies to the right through the strips of the
    ranks; heat has a clock that runs ahead."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2))
    sim.table("weaker", [(20.0, 1.5e6), (320.0, 1e6)])
    sim.table("softer", [(20.0, ROCK["young"]), (320.0, 0.8 * ROCK["young"])])
    warm = {"young": Over("softer", TEMPERATURE), "friction": 20.0, "damp_factor": 0.05}
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, **warm})
    sim.joint_model(inner(sim.mesh), COHESIVE, {**WEAK, "tensile_strength": Over("weaker", TEMPERATURE)})
    sim.gravity(3.0, -9.81)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=150.0 + 6.0 * one, vy=4.0 * one)
    heat = Heat.of(sim)
    heat.assign(None, {**HOT, "conductivity_across": 1.0, "conductivity_angle": 20.0, "friction_heat": 0.8})
    heat.initial(None, 20.0)
    sim.table("oven", [(0.0, 20.0), (3e4, 320.0), (1e5, 120.0)])
    heat.prescribe(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.15), "oven")
    sim.table("room", [(0.0, 20.0), (1e5, 60.0)])
    heat.expose(None, environment="room", transfer=20.0)
    heat.expose(np.flatnonzero(sim.face_exists())[::7], flux=400.0)
    sim.heat_clock(dt=100.0)


def more(sim: Blocks) -> None:
    """What happens to it."""
    heat = Heat.of(sim)
    if sim.clock.step == 300:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 1] < 0.1)[3:9])
    if sim.clock.step == 600:
        heat.adjust(np.flatnonzero(sim.alive)[:20], {"capacity": 700.0})
        heat.initial(np.flatnonzero(sim.node_exists())[5:9], 90.0)
        sim.heat_clock(steps=2)
        sim.flow_clock(every=3)


def warming(sim: Blocks) -> None:
    """Clay that creeps and yields is warmed at rest, then moves."""
    sim.take_mesh(shaken(rectangle(20, 6, 2.0, 0.6), 0.2))
    solid = {"density": 2000.0, "young": 1e9, "poisson_ratio": 0.3}
    sim.table("weaker", [(0.0, 2e5), (300.0, 1.5e5)])
    changes.element_model(sim, None, "mech_mohr_coulomb",
                          {**solid, "friction": 20.0, "cohesion": Over("weaker", TEMPERATURE),
                           "tensile": 1e5})  # fmt: skip
    right = np.flatnonzero(sim.mesh.centroids()[:, 0] > 1.0)
    changes.element_model(sim, right, "mech_burgers", {**solid, "maxwell_viscosity": 1e8})
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 2e-5})
    x = sim.mesh.points[:, 0]
    heat.prescribe(np.flatnonzero(x == 0.0), 300.0)
    heat.prescribe(np.flatnonzero(x == 2.0), 100.0)
    sim.parts(mechanical=False)


def move(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 400:
        sim.parts(mechanical=True)
        creep.switch(sim, True)
        sim.heat_clock(dt=300.0)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)


def steaming(sim: Blocks) -> None:
    """Hot water is pumped into a cold block that flies through the strips of the ranks, and tears it apart; the rock
    expands, cracks pass heat on."""
    bursting(sim)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-4, "transfer_coeficient": 300.0})
    heat.initial(None, 20.0)
    fluid = heat.of_fluid()
    fluid.assign(None, WATER)
    sim.table("boiler", [(0.0, 20.0), (1e-4, 320.0), (1e-2, 220.0)])
    heat.prescribe_fluid(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.12), "boiler")


def steaming_on(sim: Blocks) -> None:
    """What happens to it."""
    burst_on(sim)
    fluid = Heat.of(sim).of_fluid()
    if sim.clock.step == 600:
        fluid.assign(None, WATER)
        Heat.of(sim).initial(np.flatnonzero(sim.node_exists())[5:30], 90.0)
    if sim.clock.step == 800:
        fluid.adjust(None, {"capacity": 4000.0})
        sim.parts(hydraulic=False)
        sim.heat_clock(dt=1e-3)
    if sim.clock.step == 900:
        assert fluid.sub_steps > 2
        fluid.adjust(None, {"second_order": 0.0})
        sim.parts(hydraulic=True)
        sim.heat_clock(dt=0.0)


def hot_slurry(sim: Blocks) -> None:
    """Everything at once: hot slurry tears a cold block apart, whose rock expands and gets softer and weaker, whose
    cracks rub and fill with sand; all that is kept has an account."""
    sandy(sim)
    sim.table("weaker", [(20.0, 1.5e6), (320.0, 1e6)])
    sim.table("softer", [(20.0, ROCK["young"]), (320.0, 0.8 * ROCK["young"])])
    sim.element_property(None, {"young": Over("softer", TEMPERATURE)})
    sim.joint_property(None, {"tensile_strength": Over("weaker", TEMPERATURE)})
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5, "transfer_coeficient": 300.0, "friction_heat": 1.0})
    heat.initial(None, 20.0)
    fluid = heat.of_fluid()
    fluid.assign(None, WATER)
    heat.prescribe_fluid(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.12), 220.0)
    diagnostics.account_energy(sim)


def slurry_on(sim: Blocks) -> None:
    """What happens to it."""
    burst_on(sim)
    if sim.clock.step == 600:
        Heat.of(sim).of_fluid().assign(None, WATER)


def hot_slurry_in_space(sim: Blocks) -> None:
    """The same of a bar of tetrahedra, wells and rates too."""
    sandy_in_space(sim)
    sim.table("weaker", [(20.0, 1.5e6), (320.0, 1e6)])
    sim.joint_property(None, {"tensile_strength": Over("weaker", TEMPERATURE)})
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5, "transfer_coeficient": 300.0})
    heat.initial(None, 20.0)
    fluid = heat.of_fluid()
    fluid.assign(None, WATER)
    x, y, z = sim.mesh.points.T
    sim.table("boiler", [(0.0, 20.0), (1e-4, 320.0), (1e-2, 220.0)])
    heat.prescribe_fluid(np.flatnonzero((x > 0.75) & (x < 0.95) & (z < 0.15)), "boiler")
    heat.prescribe_fluid(np.flatnonzero((np.abs(y - 0.1) < 0.03) & (np.abs(x - 0.4) < 0.35) & (x > 0.06)), 120.0)


def slurry_on_in_space(sim: Blocks) -> None:
    """What happens to it."""
    sand_on_in_space(sim)
    heat = Heat.of(sim)
    if sim.clock.step == 250:
        heat.of_fluid().assign(None, WATER)
    if sim.clock.step == 300:
        heat.initial(np.flatnonzero(sim.node_exists())[5:30], 90.0)
        heat.of_fluid().adjust(None, {"second_order": 0.0})


def of_slurry(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks, with the budgets."""
    found = of_water(sim, notes) | of_sand(sim, notes)
    if sim.budget is not None:
        found.update({f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()})
    for of, account in (("heat", Heat.of(sim).account()), ("fluid", Flow.of(sim).account())):
        found.update({f"{of}_{name}": np.array(value) for name, value in account.items()})
    return found


def it_bursts(found: Found) -> None:
    for of in ("heat", "fluid", "sand"):
        assert found[f"{of}_relative"] < 1e-12, of
    assert found["energy_relative"] < 1e-9 and found["energy_contact"] > 0.0
    assert found["energy_commands"] < -1e5  # of motion, with the elements that were taken out
    assert 0.0 < abs(found["energy_work_heat"]) < found["energy_joints_lost"]
    assert found["counts"][2] > 20 and found["water"].max() > 150.0 and np.nanmax(found["temperature"]) > 20.1
    assert found["sand_stored"] > 0.0 and found["concentration"].max() > 0.2


def it_bursts_in_space(found: Found) -> None:
    for of in ("heat", "fluid", "sand"):
        assert found[f"{of}_relative"] < 1e-12, of
    assert found["counts"][2] > 50 and found["water"].max() > 150.0 and np.nanmax(found["temperature"]) > 20.1
    assert found["heat_removed"] > 0.0 and found["fluid_leaked"] > 0.0 and found["concentration"].max() > 0.2


def of_water(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks, with the water."""
    flow = Flow.of(sim)
    found = result(sim, notes)
    found["water"] = flow.values(FLOW_NODE, "temperature")
    found["along"] = flow.values(CHANNEL, "temperature")
    found["pressure"] = flow.values(FLOW_NODE, "pressure")
    found["sub_steps"] = np.array([Heat.of(sim).of_fluid().sub_steps])
    return found


def it_steams(found: Found) -> None:
    assert found["account_relative"] < 1e-12 and found["account_fluid"] > 0.0
    assert found["water"].max() > 150.0 and 25.0 < np.nanmax(found["temperature"]) < 321.0
    assert found["counts"][2] > 20 and found["water"].min() > 10.0


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    names = ("position_x", "velocity_y", "stress_xx", "stress_zz", "temperature", "mean_temperature",
             "plastic_shear_strain", "creep_strain_xx")  # fmt: skip
    found = {name: diagnostics.values(sim, name) for name in names}
    heat = Heat.of(sim)
    found.update({f"account_{name}": np.array(value) for name, value in heat.account().items()})
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["clock"] = np.array([heat.time, heat.dt, heat.sub_steps, heat.cycles, sim.clock.time])
    return found


def it_is_hot(found: Found) -> None:
    assert (
        np.nanmax(found["temperature"]) > 100.0
        and np.nanmax(found["temperature"]) - np.nanmin(found["temperature"]) > 40.0
    )
    assert found["account_relative"] < 1e-12 and found["account_given"] > 0.0


def it_cracks(found: Found) -> None:
    it_is_hot(found)
    assert found["counts"][2] > 20 and found["account_removed"] > 0.0


def it_flows(found: Found) -> None:
    assert np.nanmax(found["temperature"]) > 100.0 and found["account_relative"] < 1e-12
    assert np.nanmax(found["plastic_shear_strain"]) > 1e-5 and np.nanmax(np.abs(found["creep_strain_xx"])) > 1e-6


# Checkpoints after excavation, and after the blocks have begun to move.
MODELS = {
    "cracking by heat": Model(cracking, result, it_cracks, more, steps=1100, middle=703, slow=True),
    "steaming": Model(steaming, of_water, it_steams, steaming_on, steps=1100, middle=703, slow=True),
    "hot slurry": Model(hot_slurry, of_slurry, it_bursts, slurry_on, steps=880, middle=503, slow=True),
    "hot slurry in space": Model(
        hot_slurry_in_space, of_slurry, it_bursts_in_space, slurry_on_in_space, steps=360, middle=303
    ),
    "warm clay": Model(warming, result, it_flows, move, steps=900, middle=503, slow=True),
}
