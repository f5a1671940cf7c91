"""Implicit steps of heat: explicit ones and closed forms, steady states, blocks in equilibrium, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, diagnostics, equilibrium
from hpcdem.physics.fdem.groups import Span
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from tests.blocks.models import COHESIVE
from tests.blocks.support import JOINT, ROCK, model, rectangle, shaken
from tests.flow.support import at, inner
from tests.heat import exact
from tests.heat.support import DIFFUSIVITY, GRANITE, faces_at, standing, temperatures
from tests.space.support import box, hexes

DAY = 86400.0


def over(sim: Blocks, time: float, steps: int, solver: str = "auto") -> Implicit:
    """So much time [s] in so many equal steps."""
    run = Implicit(sim, solver)
    for _ in range(steps):
        run.advance(time / steps)
    run.close()
    return run


@pytest.mark.parametrize("kind", ["tri", "mixed"])
def test_a_step_is_backward_euler(kind: str) -> None:
    """(T' - T) C / dt is the inflow of the explicit kernels at T'; one factor for all steps; the account closes."""
    mesh = shaken(rectangle(6, 4, 1.2, 0.8, kind=kind), 0.2)
    sim, heat = standing(mesh, conductivity_across=1.0, conductivity_angle=30.0)
    sim.table("ramp", [(0.0, 10.0), (1e6, 90.0)])
    heat.prescribe(at(sim, x=0.0), "ramp")
    heat.expose(faces_at(mesh, 1.2), environment=40.0, transfer=7.0, flux=12.0)
    sim.close_model()
    run = Implicit(sim)
    for _ in range(3):
        before = temperatures(sim)
        run.advance(1e5)
        after = temperatures(sim)
    sim.heat_clock(dt=1e-3)  # an explicit step shows the inflow
    sim.step()
    rate = (temperatures(sim) - after) / 1e-3
    free = np.setdiff1d(np.arange(len(mesh.points)), at(sim, x=0.0))
    assert (after - before)[free] / 1e5 == pytest.approx(rate[free], rel=1e-4)
    assert after[at(sim, x=0.0)] == pytest.approx(34.0, rel=1e-14)
    assert run.factors == 1 and run.steps == 3 and heat.account()["relative"] < 1e-12
    assert heat.time == pytest.approx(3e5 + 1e-3) and run.unknowns == len(free)


def test_days_in_few_steps_follow_the_series_with_order_one() -> None:
    """A year in a slab of 10 m: two thousand times the stable explicit step."""
    errors = []
    for steps in (25, 50, 100):
        mesh = rectangle(64, 1, 10.0, 10.0 / 64)
        sim, heat = standing(mesh)
        heat.prescribe(at(sim, x=0.0), 100.0)
        over(sim, 365.0 * DAY, steps)
        wanted = 100.0 * exact.slab(mesh.points[:, 0], 365.0 * DAY, 10.0, DIFFUSIVITY)
        errors.append(float(np.abs(temperatures(sim) - wanted).max()))
        assert heat.account()["relative"] < 1e-12
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert errors[-1] < 0.5 and (np.abs(orders - 1.0) < 0.15).all(), (errors, orders)


def test_steady_states_are_found_at_once() -> None:
    """Between two temperatures, and between one and an environment; anisotropic rock carries heat to the side."""
    mesh = shaken(rectangle(10, 4, 2.0, 0.8), 0.2)
    sim, heat = standing(mesh)
    heat.prescribe(at(sim, x=0.0), 100.0)
    heat.prescribe(at(sim, x=2.0), 20.0)
    run = Implicit(sim)
    run.steady()
    assert temperatures(sim) == pytest.approx(100.0 - 40.0 * mesh.points[:, 0], abs=1e-10)
    assert heat.time == 0.0 and heat.account()["relative"] < 1e-13
    heat.remove_conditions(at(sim, x=2.0))
    heat.expose(faces_at(mesh, 2.0), environment=20.0, transfer=GRANITE["conductivity"])
    run.steady()  # half of the resistance of 2 m of rock is that of the transfer
    run.close()
    assert temperatures(sim)[at(sim, x=2.0)] == pytest.approx(20.0 + 80.0 / 3.0, rel=1e-9)
    heat.remove_face_conditions(None)
    heat.remove_conditions(None)
    with pytest.raises(CommandError, match="in the body of element 0 no temperature is prescribed"):
        Implicit(sim).steady()


def test_cracks_part_the_heat() -> None:
    mesh = rectangle(8, 2, 2.0, 0.5)
    sim, heat = standing(mesh)
    middle = [j for j in inner(mesh) if np.allclose(mesh.points[_ends(mesh, j)][:, 0], 1.0)]
    changes.crack(sim, np.array(middle))
    heat.initial(None, 7.0)
    heat.prescribe(at(sim, x=0.0), 100.0)
    with pytest.raises(CommandError, match="has no steady state"):
        Implicit(sim).steady()
    over(sim, 1e9, 10)
    assert temperatures(sim)[at(sim, x=2.0)] == pytest.approx(7.0, rel=1e-12)
    assert temperatures(sim)[at(sim, x=0.75)] == pytest.approx(100.0, rel=1e-6)


def _ends(mesh, joint: int) -> np.ndarray:
    e, k = joint // 4, joint % 4
    return mesh.cells[e, [k, (k + 1) % (4 if mesh.cells[e, 3] >= 0 else 3)]]


def test_blocks_are_in_equilibrium_at_the_end_of_each_step() -> None:
    """Between walls, in static mode: the stress follows the temperature."""
    sim = model(rectangle(6, 4, 1.2, 0.8))
    sim.option(dynamic=False, collision=False)
    for x in (0.0, 1.2):
        sim.velocity_condition(at(sim, x=x), vx=0.0)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5})
    sim.table("ramp", [(0.0, 0.0), (4e6, 40.0)])
    heat.prescribe(None, "ramp")
    for k in range(1, 5):
        over(sim, 1e6, 1)
        assert temperatures(sim) == pytest.approx(10.0 * k)
        wanted = -ROCK["young"] * 1e-5 * 10.0 * k / (1.0 - ROCK["poisson_ratio"])
        assert diagnostics.values(sim, "stress_xx") == pytest.approx(wanted, rel=2e-3)
        assert diagnostics.unbalanced_ratio(sim) < 1e-6
    assert sim.clock.step == 4


def test_joints_break_during_implicit_steps() -> None:
    """A bar between walls is cooled until its joints break, and is then free of stress, and insulated."""
    sim = model(rectangle(6, 1, 0.6, 0.1, kind="quad"))
    sim.option(dynamic=False, collision=False)
    for x in (0.0, 0.6):
        sim.velocity_condition(at(sim, x=x), vx=0.0)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    weak = [j for j in inner(sim.mesh) if np.allclose(sim.mesh.points[_ends(sim.mesh, j)][:, 0], 0.3)]
    sim.joint_model(np.array(weak), COHESIVE, {**JOINT, "tensile_strength": 1e6, "gf1": 5.0, "gf2": 5.0})
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5})
    sim.table("ramp", [(0.0, 0.0), (4e6, -40.0)])
    heat.prescribe(at(sim, x=0.0), "ramp")
    over(sim, 4e6, 20)
    assert diagnostics.joint_counts(sim)[2] == 1
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() < 1e4
    cold = temperatures(sim)
    assert cold[at(sim, x=0.0)] == pytest.approx(-40.0) and cold[at(sim, x=0.6)].min() > -35.0
    assert heat.account()["relative"] < 1e-12


def test_what_implicit_steps_cannot_do_is_refused() -> None:
    sim = model(rectangle(2, 2, 1.0, 1.0))
    with pytest.raises(CommandError, match="no heat yet"):
        Implicit(sim)
    heat = Heat.of(sim)
    heat.assign(np.arange(3), GRANITE)
    with pytest.raises(CommandError, match="dynamic off first, or mechanical"):
        Implicit(sim)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match=r"element 3 at .* has no thermal model"):
        Implicit(sim)
    heat.assign(None, GRANITE)
    with pytest.raises(CommandError, match="solver is one of auto, direct, petsc"):
        Implicit(sim, "fast")
    sim.parts(thermal=False)
    with pytest.raises(CommandError, match="use model option thermal on first"):
        Implicit(sim)
    sim.parts(thermal=True)
    bolts = Bolts.of(sim)
    bolts.create([(0.2, 0.2), (0.8, 0.8)])
    with pytest.raises(CommandError, match="do not support bolts"):
        Implicit(sim)


def test_the_command_says_how_it_ended(tmp_path) -> None:
    """Steps of equal length, a steady state, histories, what is refused."""
    project = fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "out")
    fdem.meshes.grid(project, (0.0, 0.0), (2.0, 1.0), (4, 2))
    fdem.assignments.element_model(project, "mech_iso_elastic", ROCK)
    fdem.heat.model(project, GRANITE)
    fdem.settings.option(project, mechanical=False)
    fdem.heat.condition(project, 50.0, (Span(0, 0.0, 0.0),))
    fdem.histories.create(project, "given", "model", "heat_given")
    fdem.steps.solve_thermal(project, time=10.0 * DAY, dt=3.0 * DAY)
    assert project.solved == {"reason": "time", "ratio": pytest.approx(np.nan, nan_ok=True), "steps": 4}
    assert fdem.queries.heat(project)["relative"] < 1e-12 and len(project.histories["given"].rows) == 4
    assert Heat.of(project.blocks).time == pytest.approx(10.0 * DAY)
    fdem.steps.solve_thermal(project, time=DAY)
    assert project.solved["steps"] == 100
    fdem.steps.solve_thermal(project, steady=True)
    assert project.solved["reason"] == "steady"
    assert fdem.queries.values(project, "node", "temperature") == pytest.approx(50.0)
    for given, text in (
        ({}, "give either time or steady"), ({"time": 1.0, "steady": True}, "give either time or steady"),
        ({"steady": True, "dt": 1.0}, "dt needs time"), ({"time": 1.0, "dt": -1.0}, "must be positive"),
    ):  # fmt: skip
        with pytest.raises(CommandError, match=text):
            fdem.steps.solve_thermal(project, **given)


def test_equilibrium_keeps_temperatures() -> None:
    """The static solve takes blocks with heat as they are."""
    sim = model(rectangle(4, 2, 1.0, 0.5))
    sim.option(dynamic=False, collision=False)
    sim.velocity_condition(at(sim, x=0.0), vx=0.0, vy=0.0)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(None, 30.0)
    sim.gravity(0.0, -9.81)
    equilibrium.solve_elastic(sim)
    assert (temperatures(sim) == 30.0).all() and heat.time == 0.0


# ---- rock that yields ----------------------------------------------------------------------------------------------

WEAK = {"density": 2400.0, "young": 20e9, "poisson_ratio": 0.24, "cohesion": 3e6, "friction": 30.0, "tensile": 1.2e6,
        "dilation": 10.0}  # fmt: skip
SHRINKS = 9e-6
KINDS = ("tri", "quad", "mixed", "tets", "hexes")


def weak_bar(kind: str, **properties: Any) -> tuple[Blocks, Heat]:
    """At 50 degrees, on rollers, in space between two walls across z."""
    sim = Blocks(SerialComm())
    in_space = kind in ("tets", "hexes")
    mesh = {"tets": box, "hexes": hexes}[kind]((4, 2, 2), (2.0, 0.5, 0.5)) if in_space else None
    sim.take_mesh(shaken(rectangle(6, 3, 2.0, 0.5, kind=kind), 0.2) if mesh is None else mesh)
    if "young" in properties:
        sim.table("young", properties["young"])
        properties["young"] = Over("young", TEMPERATURE)
    changes.element_model(sim, None, "mech_mohr_coulomb", {**WEAK, **properties})
    sim.option(dynamic=False, collision=False, large_strain=False)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 0.0 if properties else SHRINKS})
    heat.initial(None, 50.0)
    points = sim.mesh.points
    sim.velocity_condition(np.flatnonzero(points[:, 0] < 1e-9), vx=0.0)
    sim.velocity_condition(np.flatnonzero(points[:, 1] < 1e-9), vy=0.0)
    if in_space:
        sim.velocity_condition(np.flatnonzero(np.abs(points[:, 2] - 0.25) > 0.25 - 1e-9), vz=0.0)
    return sim, heat


def cooled_bar(kind: str, part: float, **properties: Any) -> tuple[Blocks, Heat]:
    """Held at both ends too, and cooled over 1e5 s to so much of what it bears: sxx = szz = T, the sides are free."""
    sim, heat = weak_bar(kind, **properties)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] > 2.0 - 1e-9), vx=0.0)
    drop = part * WEAK["tensile"] * (1.0 - WEAK["poisson_ratio"]) / (WEAK["young"] * SHRINKS)
    sim.table("ramp", [(0.0, 50.0), (1e5, 50.0 - drop)])
    heat.prescribe(None, "ramp")
    return sim, heat


def bears(sim: Blocks, stress: float) -> None:
    for name, wanted in (("stress_xx", stress), ("stress_zz", stress), ("stress_yy", 0.0)):
        assert diagnostics.values(sim, name) == pytest.approx(wanted, rel=1e-8, abs=1e-8 * stress), name


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("steps", [1, 4])
def test_a_bar_that_cools_flows_in_balance_only(kind: str, steps: int) -> None:
    """Beyond its tensile strength it bears just that, in however many steps; below it nothing has flowed."""
    sim, _ = cooled_bar(kind, 1.5)
    over(sim, 1e5, steps)
    bears(sim, WEAK["tensile"])
    sim, _ = cooled_bar(kind, 0.9)
    over(sim, 1e5, steps)
    bears(sim, 0.9 * WEAK["tensile"])
    assert not diagnostics.values(sim, "plastic_state").any() and not diagnostics.values(sim, "plastic_work").any()


@pytest.mark.parametrize("kind", ["mixed", pytest.param("hexes", marks=pytest.mark.slow)])
def test_temperatures_are_brought_on_in_the_same_increments(kind: str) -> None:
    """A balance by four: what flows is as in four steps of heat, and temperatures are those of the end."""
    both = []
    for increments in (4, 1):
        sim, heat = cooled_bar(kind, 2.0)
        sim.gravity(3e3, -2e4)
        run = Implicit(sim)
        for _ in range(4 // increments):
            before = run._solve(1e5 / (4 // increments))
            heat.time += 1e5 / (4 // increments)
            sim.local.follow_heat()
            sim.gravity(heat.time / 1e5 * 3e3, heat.time / 1e5 * -2e4)
            assert equilibrium.solve_elastic(sim, steps=increments, before=before).increments == increments
        run.close()
        assert temperatures(sim) == pytest.approx(heat.held_at(1e5)[0], rel=1e-14)
        both.append([diagnostics.values(sim, name) for name in ("stress_xx", "stress_xy", "plastic_shear_strain")])
    for a, b in zip(*both):
        assert a == pytest.approx(b, rel=1e-6, abs=1e-6 * np.abs(b).max())


@pytest.mark.parametrize("kind", KINDS)
def test_a_modulus_that_grows_as_it_cools_lets_nothing_flow(kind: str) -> None:
    """Under nine tenths of the load that it bears, E three times as large: the stress stays, but for the length of the
    loaded faces."""
    sim, heat = weak_bar(kind, young=[(0.0, 60e9), (50.0, 20e9)])
    load = 0.9 * 2.0 * WEAK["cohesion"] * 3.0**0.5
    edges = sim.mesh.edges()
    end = (np.abs(sim.mesh.points[edges.points][..., 0] - 2.0) < 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[end & ~edges.inner][:, 0], normal=-load)
    equilibrium.solve_elastic(sim)
    heat.prescribe(None, 0.0)
    over(sim, 1e5, 1)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(-load, rel=1e-3)
    assert not diagnostics.values(sim, "plastic_state").any()
