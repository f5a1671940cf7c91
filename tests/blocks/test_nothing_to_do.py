"""A model without loads is in balance: its forces are rounding, and no solve calls that an error. All kinds of solves,
in the plane and in space."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, floors
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import JOINT, near, rectangle
from tests.flow.support import WATER, at, hold, inner, line
from tests.space import support as space

ROCK = {"density": 2400.0, "young": 2e10, "poisson_ratio": 0.25}
PLASTIC = {**ROCK, "friction": 30.0, "cohesion": 0.0, "tensile": 0.0}
KINDS = ("cross", "quad", "tet", "hex")


def resting(kind: str, law: str = "mech_iso_elastic", dynamic: bool = False, **properties: float) -> Blocks:
    """A body that nobody loads, on a base that is held, at places that are no round numbers."""
    if kind in ("cross", "quad"):
        mesh = rectangle(4, 3, 1.1, 1.3, x0=0.1, y0=0.3, kind=kind)
    else:
        mesh = {"tet": space.box, "hex": space.hexes}[kind]((2, 2, 2), (1.1, 0.9, 1.3))
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, law, {**(ROCK if law == "mech_iso_elastic" else PLASTIC), **properties})
    base = np.flatnonzero(mesh.points[:, -1] == mesh.points[:, -1].min())
    sim.velocity_condition(base, vx=0.0, vy=0.0, vz=0.0 if mesh.dim == 3 else None)
    sim.option(collision=False, dynamic=dynamic)
    return sim


def top(sim: Blocks) -> np.ndarray:
    """Its upper faces."""
    mesh = sim.the_mesh()
    return space.faces_on(mesh, "top") if mesh.dim == 3 else near(mesh, 1, float(mesh.points[:, 1].max()))


def solves(sim: Blocks) -> None:
    """Relaxation and the solve at once both find balance."""
    assert convergence.solve(sim, ratio=1e-5, limit=3000).reason == "ratio"
    found = equilibrium.solve_elastic(sim)
    assert found.ratio <= 1e-8
    assert convergence.solve(sim, ratio=1e-5, limit=3000).reason == "ratio"


@pytest.mark.some_of_each
@pytest.mark.parametrize("law", ["mech_iso_elastic", "mech_mohr_coulomb"])
@pytest.mark.parametrize("kind", KINDS)
def test_without_loads_and_after_unloading(kind, law):
    """Never loaded; loaded and unloaded, which leaves rounding. (What yields has no cohesion; it is not loaded.)"""
    sim = resting(kind, law)
    solves(sim)
    if law == "mech_iso_elastic":
        sim.stress_condition(top(sim), normal=-1e6)
        equilibrium.solve_elastic(sim)
        assert diagnostics.unbalanced_ratio(sim) < 1e-7
        sim.stress_condition(top(sim), normal=0.0)
        solves(sim)
        assert np.abs(diagnostics.values(sim, "stress_yy")).max() < 1e-3


@pytest.mark.parametrize("load", [1e-3, 1e-1, 1e2])
def test_small_loads_are_balanced_as_well_as_rounding_lets_them(load):
    """Down to a strain of 5e-14 there is no error; what is found is right but for what positions can hold."""
    sim = resting("quad")
    sim.stress_condition(top(sim), normal=-load)
    equilibrium.solve_elastic(sim)
    stress = diagnostics.values(sim, "stress_yy").mean()
    assert stress == pytest.approx(-load, rel=0.05, abs=20.0 * 2e10 * 2.2e-16)


def test_a_load_on_few_of_many_elements_is_not_lost():
    """Less than nothing in the mean of the model, but far more than rounding: it is not called balance."""
    sim = resting("cross")
    sim.force_condition(np.array([len(sim.the_mesh().points) - 1]), fx=1.0)
    sim.close_model()
    seen = sim.evaluate()
    total = diagnostics.contributing(sim, seen).sum()
    assert total < floors.nothing(sim) and total > 100.0 * floors.rounding(sim)
    assert diagnostics.unbalanced_ratio(sim) > 0.1
    equilibrium.solve_elastic(sim)
    assert diagnostics.total(sim, "reaction_x") == pytest.approx(-1.0, rel=1e-5)


@pytest.mark.parametrize("kind", ["quad", "tet"])
def test_all_nodes_held(kind):
    """Nothing can move: no unknowns, no error; heat, too, where all temperatures are prescribed."""
    sim = resting(kind)
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0 if kind == "tet" else None)
    solves(sim)


@pytest.mark.parametrize("kind, joint", [("quad", False), ("quad", True), ("cross", True), ("tet", False)])
def test_heat_without_a_change_of_temperature(kind, joint):
    """Uniform temperatures; then prescribed ones that are on a plateau of their table; then a change by 1e-9 K."""
    sim = resting(kind, **({"young": 2e10}))
    if joint:
        strong = {**JOINT, "cohesion": 0.0, "tensile_strength": 0.0}
        sim.joint_model(None, "classic_intrinsic_cohesive_interface", strong)
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 3.0, "capacity": 800.0, "expansion_coeficient": 1e-5})
    heat.initial(None, 20.0)
    sim.table("plateau", [(0.0, 20.0), (1e6, 20.0), (2e6, 20.0 + 1e-9), (3e6, 20.0 + 1e-9)])
    heat.prescribe(np.arange(len(sim.the_mesh().points)), "plateau")
    run = Implicit(sim)
    for _ in range(6):
        run.advance(5e5)
    run.close()
    assert heat.time == 3e6 and np.abs(diagnostics.values(sim, "stress_yy")).max() < 1.0


@pytest.mark.parametrize("load", [0.0, 1e6])
def test_joints_without_strength(load):
    """Without cohesion and tensile strength, unloaded or pressed: at once, and by relaxation."""
    sim = resting("quad")
    mesh = sim.the_mesh()
    sim.joint_model(inner(mesh), "classic_intrinsic_cohesive_interface",
                    {**JOINT, "cohesion": 0.0, "tensile_strength": 0.0, "penalty_normal": 2e11})  # fmt: skip
    base = np.flatnonzero(mesh.points[:, 1] == mesh.points[:, 1].min())
    sim.velocity_condition(base, vy=0.0)
    if load:
        sim.stress_condition(top(sim), normal=-load)
        sides = [np.flatnonzero(np.abs(mesh.points[:, 0] - x) < 1e-9) for x in (0.1, 1.2)]
        sim.velocity_condition(np.concatenate(sides), vx=0.0)
        sim.velocity_condition(np.intersect1d(base, np.concatenate(sides)), vx=0.0, vy=0.0)
    equilibrium.solve_elastic(sim)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-load, rel=1e-3, abs=1.0)


def test_flow_in_rock_without_loads():
    """Dry channels, then full ones without pressure, in rock that nothing presses."""
    sim = resting("cross")
    joints = inner(sim.the_mesh())
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface",
                    {**JOINT, "cohesion": 1e9, "tensile_strength": 1e9, "penalty_normal": 2e11})  # fmt: skip
    flow = Flow.of(sim)
    flow.assign(joints, WATER)
    for saturation in (0.0, 1.0):
        flow.fill(None, saturation=saturation)
        end = flow.time + 10.0
        with Coupled(sim, 5.0) as run:
            while flow.time < end:
                run.advance(end)


def test_steady_flow_between_equal_pressures():
    """Nothing flows between them; a rate without a pressure anywhere has no steady flow."""
    for ends in ((2e4, 2e4), (2e4, 2e4 - 1e-6), (0.0, 0.0)):
        sim, flow = line(4, 2.0)
        flow.fill(None, saturation=1.0)
        for x, pressure in zip((0.0, 2.0), ends, strict=True):
            hold(flow, at(sim, x, 0.0), pressure)
        with Coupled(sim, 1.0) as run:
            run.steady()
        assert flow.values("flow-node", "pressure") == pytest.approx(ends[0], rel=1e-9)
        assert flow.account()["stored"] == pytest.approx(2e-5, rel=1e-4)
    sim, flow = line(4, 2.0)
    flow.fill(None, saturation=1.0)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-6)
    with Coupled(sim, 1.0) as run, pytest.raises(CommandError, match="steady flow"):
        run.steady()


def test_what_is_no_balance_is_still_reported():
    """Coordinates so large that positions hold no strain of the loads: the message stands."""
    sim = Blocks()
    mesh = rectangle(3, 3, 1.0, 1.0, x0=1e9, y0=1e9, kind="quad")
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.option(collision=False, dynamic=False)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] == 1e9), vx=0.0, vy=0.0)
    sim.gravity(0.0, -9.81)
    with pytest.raises(CommandError, match="rounding of positions alone causes"):
        equilibrium.solve_elastic(sim)
