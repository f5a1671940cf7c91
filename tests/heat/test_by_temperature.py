"""Moduli and strengths that follow tables over temperature: each changes what it should, at its temperature."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.heat.model import Heat
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, rectangle, shaken
from tests.flow.support import at, inner
from tests.heat.support import GRANITE

E, NU = ROCK["young"], ROCK["poisson_ratio"]
STRONG = {"density": 2700.0, "young": E, "poisson_ratio": NU, "friction": 0.0, "cohesion": 5e6, "tensile": 4e6}
FALLING = [(20.0, 1.0), (220.0, 0.5), (420.0, 0.25)]
"""Over temperature, the part that is left."""


def over(sim: Blocks, name: str, most: float) -> Over:
    """A property that falls from this value."""
    sim.table(f"{name} {most:g}", [(t, most * part) for t, part in FALLING])
    return Over(f"{name} {most:g}", TEMPERATURE)


def body(model: str, values: dict[str, Any], warm: tuple[str, ...], kind: str = "mixed", left: float = 20.0,
         right: float = 20.0, dynamic: bool = False) -> Blocks:  # fmt: skip
    """A block 1.2 m long, at these temperatures in its halves; warm: properties that follow a table; no expansion."""
    sim = Blocks()
    sim.take_mesh(rectangle(6, 4, 1.2, 0.8, kind=kind))
    changes.element_model(sim, None, model, values | {name: over(sim, name, values[name]) for name in warm})
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(None, left)
    heat.initial(np.flatnonzero(sim.mesh.points[:, 0] > 0.6 - 1e-9), right)
    sim.option(dynamic=dynamic, collision=False)
    sim.parts(thermal=False)
    return sim


def pulled(sim: Blocks, by: float) -> Blocks:
    """In equilibrium, its right end drawn so far, its ends on rollers."""
    sim.velocity_condition(at(sim, x=0.0), vx=0.0)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    sim.velocity_condition(at(sim, x=1.2), vx=by)
    equilibrium.solve_elastic(sim, cycles=1, steps=4)
    return sim


@pytest.mark.parametrize(("warmth", "part"), [(-50.0, 1.0), (20.0, 1.0), (120.0, 0.75), (320.0, 0.375), (900.0, 0.25)])
def test_stress_is_that_of_the_modulus_at_this_temperature(warmth: float, part: float) -> None:
    """Plane strain: E / (1 - nu^2) times the strain; the static solve and relaxation agree."""
    sim = pulled(body("mech_iso_elastic", ROCK, ("young",), left=warmth, right=warmth), 1.2e-6)
    expected = part * E / (1.0 - NU * NU) * 1e-6
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(expected, rel=1e-5)
    assert diagnostics.unbalanced_ratio(sim) < 1e-9


def test_each_element_has_the_modulus_of_its_own_temperature() -> None:
    """One half is warm: both carry the same stress, its strain is twice that of the other."""
    sim = body("mech_iso_elastic", ROCK, ("young",), left=20.0, right=220.0, kind="quad")
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "poisson_ratio": 0.0, "young": over(sim, "young", E)})
    pulled(sim, 1.2e-6)
    x, move = sim.mesh.points[:, 0], diagnostics.values(sim, "displacement_x")
    warm, cold = (move[np.isclose(x, b)].mean() - move[np.isclose(x, a)].mean() for a, b in ((0.8, 1.2), (0.0, 0.4)))
    assert warm == pytest.approx(2.0 * cold, rel=1e-6)


def torn(part: float, warm: tuple[str, ...], constant: bool, model: str = "mech_iso_elastic", warmth: float = 220.0,
         kind: str = "mixed") -> Blocks:  # fmt: skip
    """A jointed block that flies apart; warm: properties that follow a table, or, constant, that part of them."""
    sim = Blocks()
    sim.take_mesh(shaken(rectangle(8, 4, 0.8, 0.4, kind=kind), 0.2))
    values = ({**ROCK, "friction": 20.0} if model == "mech_iso_elastic" else
              {**STRONG, "friction": 20.0, "dilation": 5.0, "cohesion": 2e6, "tensile": 1e6})  # fmt: skip
    weak = {**WEAK, "penalty_overlay": 500e9, "penalty_shear": 500e9}
    for of in (values, weak):
        for name in warm:
            if name in of:
                of[name] = part * of[name] if constant else over(sim, name, of[name])
    values["damp_factor"] = 0.0
    changes.element_model(sim, None, model, values)
    if model == "mech_iso_elastic":
        sim.joint_model(inner(sim.mesh), COHESIVE, weak)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=6.0 * one, vy=4.0 * one)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(None, warmth)
    sim.time_step(value=2e-6)
    for _ in range(250):
        sim.step()
    return sim


@pytest.mark.parametrize(
    ("name", "model"),
    [("young", "mech_iso_elastic"), ("tensile_strength", "mech_iso_elastic"), ("cohesion", "mech_iso_elastic"),
     ("gf1", "mech_iso_elastic"), ("gf2", "mech_iso_elastic"), ("young", "mech_mohr_coulomb"),
     ("cohesion", "mech_mohr_coulomb"), ("tensile", "mech_mohr_coulomb")],
)  # fmt: skip
def test_each_alone_is_the_constant_of_that_temperature(name: str, model: str) -> None:
    """Bit by bit, while joints pass their peak and break or elements flow; it is another outcome than when cold."""
    warm, said, cold = (
        torn(0.5, (name,), False, model),
        torn(0.5, (name,), True, model),
        torn(1.0, (name,), True, model),
    )
    a, b, c = (diagnostics.values(sim, "velocity_x") for sim in (warm, said, cold))
    assert np.array_equal(a, b) and not np.array_equal(a, c)
    if model == "mech_iso_elastic":
        assert warm.broken.sum() > 0


def test_the_time_step_is_that_of_the_stiffest_value() -> None:
    """However warm it is; masses of static steps too."""
    plain = body("mech_iso_elastic", ROCK, (), dynamic=True)
    plain.close_model()
    for warmth in (20.0, 420.0):
        sim = body("mech_iso_elastic", ROCK, ("young",), left=warmth, right=warmth, dynamic=True)
        sim.close_model()
        assert sim.clock.dt == plain.clock.dt
    static = [body("mech_iso_elastic", ROCK, warm, left=420.0, right=420.0) for warm in ((), ("young",))]
    for sim in static:
        sim.close_model()
    assert np.array_equal(static[0].local.masses.of_motion, static[1].local.masses.of_motion)


def test_initial_stress_follows_the_modulus_from_where_it_was_said() -> None:
    """It is that at the temperature without thermal stress; the later one has the later modulus."""
    sim = body("mech_iso_elastic", ROCK, ("young",), left=120.0, right=120.0)
    sim.initial_stress(None, xx=-1e6, yy=-2e6, xy=3e5, zz=-5e5)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-2e6, rel=1e-10)
    Heat.of(sim).prescribe(None, 320.0)
    sim.option(dynamic=True)
    sim.parts(mechanical=False, thermal=True)
    sim.heat_clock(dt=1.0)
    sim.step()
    for name, value in (("xx", -1e6), ("yy", -2e6), ("xy", 3e5), ("zz", -5e5)):
        assert diagnostics.values(sim, f"stress_{name}") == pytest.approx(0.5 * value, rel=1e-10)


def test_energy_is_that_which_heat_gives_or_takes() -> None:
    """A strained block at rest becomes softer: its strain energy falls by as much as heat takes."""
    sim = body("mech_iso_elastic", ROCK, ("young",), dynamic=True)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.initial_stress(None, xx=-5e6, yy=-5e6)
    sim.parts(thermal=True)
    diagnostics.account_energy(sim)
    before = diagnostics.energies(sim)["strain"]
    Heat.of(sim).prescribe(None, 220.0)
    for _ in range(5):
        sim.step()
    found = diagnostics.energies(sim)
    assert found["joints_lost"] == 0.0 and found["strain"] == pytest.approx(0.5 * before, rel=1e-12)
    assert found["work_heat"] == pytest.approx(-0.5 * before, rel=1e-12) and found["relative"] < 1e-12


def test_energy_of_joints_that_get_weaker_adds_up() -> None:
    """A joint between blocks that are drawn apart and held there stores energy; what heat changes of it is no loss by
    cracks. What does not add up is of the order of the strain."""
    sim = Blocks()
    sim.take_mesh(rectangle(2, 1, 0.4, 0.2, kind="quad"))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    weak = {**WEAK, "tensile_strength": over(sim, "tensile_strength", 2e6)}
    sim.joint_model(inner(sim.mesh), COHESIVE, weak)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(None, 20.0)
    sim.option(collision=False)
    sim.velocity_condition(at(sim, x=0.0), vx=0.0)
    sim.velocity_condition(at(sim, x=0.4), vx=1.5e-3)
    sim.time_step(value=5e-6)
    diagnostics.account_energy(sim)
    for k in range(800):
        if k == 400:
            heat.prescribe(None, 220.0)
        sim.step()
    found = diagnostics.energies(sim)
    assert found["joints"] > 0.0 and abs(found["work_heat"]) > 5e-3 * found["joints"]
    assert abs(found["joints_lost"]) < 1e-2 * abs(found["work_heat"]) and found["relative"] < 1e-5


def test_a_stronger_property_takes_the_place_of_a_table() -> None:
    """A number that is said later counts; so do other moduli."""
    sim = body("mech_iso_elastic", ROCK, ("young",), left=220.0, right=220.0)
    sim.element_property(None, {"young": E})
    assert diagnostics.values(pulled(sim, 1.2e-6), "stress_xx") == pytest.approx(E / (1.0 - NU * NU) * 1e-6, rel=1e-5)
    other = body("mech_iso_elastic", ROCK, ("young",), left=220.0, right=220.0)
    other.element_property(None, {"shear": E / 2.0, "bulk": E / 3.0})  # Poisson's ratio 0
    assert diagnostics.values(pulled(other, 1.2e-6), "stress_xx") == pytest.approx(E * 1e-6, rel=1e-5)


def test_what_cannot_follow_is_refused() -> None:
    sim = body("mech_iso_elastic", ROCK, ("young",))
    sim.table("nothing", [(0.0, 20.0), (100.0, 0.0)])
    sim.table("cold", [(0.0, 1.0), (100.0, -1.0)])
    with pytest.raises(CommandError, match="gf1: table 'nothing' has a fracture energy of 0"):
        sim.joint_model(inner(sim.mesh), COHESIVE, {**WEAK, "gf1": Over("nothing", TEMPERATURE)})
    with pytest.raises(CommandError, match="tensile_strength must be >= 0"):
        sim.joint_model(inner(sim.mesh), COHESIVE, {**WEAK, "tensile_strength": Over("cold", TEMPERATURE)})
    with pytest.raises(CommandError, match=r"friction of .* cannot follow a table over temperature"):
        sim.joint_model(inner(sim.mesh), COHESIVE, {**WEAK, "friction": Over("nothing", TEMPERATURE)})
    with pytest.raises(CommandError, match="young of mech_burgers cannot follow a table over temperature"):
        changes.element_model(sim, None, "mech_burgers",
                              {"density": 2700.0, "young": over(sim, "young", E), "poisson_ratio": 0.2})  # fmt: skip
    sim.stress_condition(np.flatnonzero(sim.face_exists())[:1], quiet=True)
    with pytest.raises(CommandError, match="young of element 0 follows a table over temperature: quiet faces"):
        sim.step()
    bare = Blocks()
    bare.take_mesh(rectangle(2, 2, 1.0, 1.0))
    changes.element_model(bare, None, "mech_iso_elastic", {**ROCK, "young": over(bare, "young", E)})
    with pytest.raises(CommandError, match="element 0 follows a table over temperature, but there is no heat"):
        bare.step()


@pytest.mark.parametrize("model", ["mech_iso_elastic", "mech_mohr_coulomb"])
def test_a_restart_knows_the_tables(model: str, tmp_path) -> None:
    """Bit by bit, wherever lists are renewed, while it gets warmer."""
    warm = ("young", "tensile_strength", "cohesion", "gf1", "gf2", "tensile")
    sim = torn(1.0, warm, False, model)
    sim.table("oven", [(0.0, 220.0), (1e-3, 400.0)])
    Heat.of(sim).prescribe(np.flatnonzero(sim.mesh.points[:, 0] < 0.3), "oven")
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for k in range(60):
        sim.step()
        if k == 20:
            sim.rebuild()
        other.step()
    for name in ("stress_xx", "velocity_x", "temperature"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name)), name
