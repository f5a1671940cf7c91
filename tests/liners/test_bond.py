"""The bond between liner and rock, stages of a run, and the account of energy."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.structures import REMOVED, VELOCITY
from hpcdem.physics.liners import kernels
from hpcdem.physics.liners.model import Liners
from tests.blocks.support import model, near, rectangle
from tests.liners.support import SHOTCRETE, state

BOND = {**SHOTCRETE, "bond_tensile_strength": 0.5e6, "bond_cohesion": 0.2e6, "bond_friction": 30.0}


def slab(dynamic: bool = False, young: float = 50e9, **bond: float) -> tuple[Blocks, Liners]:
    """A block of 1 m x 0.5 m on a fixed base, with a liner on its top of five elements."""
    mesh = rectangle(5, 2, 1.0, 0.5)
    sim = model(mesh)
    sim.element_property(None, {"young": young})
    sim.option(dynamic=dynamic, collision=False)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)
    liners = Liners.of(sim)
    _, elements = liners.create(near(mesh, 1, 0.5))
    liners.assign(elements, {**BOND, **bond})
    return sim, liners


def drawn(sim: Blocks, liners: Liners, steps: int, **velocity: float) -> None:
    """All nodes of a liner moved with these ways per step."""
    every = np.arange(len(liners))
    changes_ = {"does_x": VELOCITY, "does_y": VELOCITY, "does_turn": VELOCITY}
    liners.condition(every, **changes_, **velocity)
    convergence.advance(sim, steps)


def test_it_parts_at_its_tensile_strength_and_is_pressed_again() -> None:
    """0.5 MPa of 1 m: 0.5 MN/m; half of that at the ends of elements, so all of them part at the same pull."""
    sim, liners = slab(young=1e15, bond_cohesion=1e6)
    drawn(sim, liners, 490, at_y=1e-7)
    assert liners.values("liner-element", "bond_pressure") == pytest.approx(-0.49e6, rel=1e-3)
    drawn(sim, liners, 20)
    both = kernels.PARTED | kernels.OPEN
    assert (liners.elements["bond_state"] & both == both).all()
    assert not liners.elements["pressure"].any()
    assert liners.values("liner-element", "gap") == pytest.approx(5.1e-5, rel=1e-3)
    drawn(sim, liners, 710, at_y=-1e-7)  # 2e-5 m into the rock
    assert liners.values("liner-element", "bond_pressure") == pytest.approx(0.2e6, rel=1e-3)
    assert (liners.elements["bond_state"] & both == kernels.PARTED).all()


def test_it_slips_at_cohesion_and_friction() -> None:
    """tau = 0.2 MPa + p tan 30 under p = 1 MPa; without the cohesion once it has parted."""
    sim, liners = slab(young=1e15)
    drawn(sim, liners, 100, at_y=-1e-6)
    drawn(sim, liners, 300, at_y=0.0, at_x=1e-6)
    limit = 0.2e6 + 1e6 * np.tan(np.pi / 6.0)
    assert np.abs(liners.values("liner-element", "bond_shear")) == pytest.approx(limit, rel=1e-3)
    assert (liners.elements["bond_state"] == kernels.SLIPS | kernels.SLIPPED).all()
    assert np.abs(liners.values("liner-element", "slip")) == pytest.approx(3e-4 - limit / 1e10, rel=1e-3)
    drawn(sim, liners, 200, at_x=0.0, at_y=1e-6)  # off the rock, and back
    assert (liners.elements["bond_state"] & kernels.PARTED).all() and not liners.elements["shear"].any()
    drawn(sim, liners, 200, at_y=-1e-6)
    drawn(sim, liners, 300, at_y=0.0, at_x=1e-6)
    assert np.abs(liners.values("liner-element", "bond_shear")) == pytest.approx(1e6 * np.tan(np.pi / 6.0), rel=1e-3)


def test_a_liner_is_put_on_without_force() -> None:
    """On rock that is strained already it feels what comes after only, and joins liners of before."""
    mesh = rectangle(6, 3, 1.2, 0.6)
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9})
    sim.option(dynamic=False, collision=False)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y == 0.0), vy=0.0)
    sim.velocity_condition(np.flatnonzero(x == 0.0), vx=0.0)
    right = np.flatnonzero(x == x.max())
    sim.force_condition(right, fx=-2e5)
    convergence.solve(sim, ratio=1e-8)
    liners, top = Liners.of(sim), near(mesh, 1, 0.6)
    middle = mesh.points[mesh.edges().points].mean(axis=1)[np.isin(mesh.edges().faces[:, 0], top), 0]
    _, first = liners.create(top[middle < 0.6])
    nodes, second = liners.create(top[middle > 0.6])
    assert (len(first), len(second), len(nodes), len(liners)) == (3, 3, 3, 7)  # one node is that of the first
    liners.assign(np.arange(6), SHOTCRETE)
    convergence.solve(sim, ratio=1e-8)
    assert np.abs(liners.values("liner-element", "axial_force")).max() < 1.0
    sim.force_condition(right, fx=-4e5)
    convergence.solve(sim, ratio=1e-8)
    force = liners.values("liner-element", "axial_force")
    assert (force < -1e4).all()
    # Two shells on one another are as stiff as one of both; what they carry stays when they set further.
    liners.assign(np.arange(6), {**SHOTCRETE, "young": 40e9})
    assert np.array_equal(liners.values("liner-element", "axial_force"), force)


@pytest.mark.slow
def test_rock_and_liner_together_are_as_stiff_as_both() -> None:
    """A strip of 0.1 m pulled along x with a liner of 0.1 m on each side: E A in plane strain adds up."""
    mesh = rectangle(20, 2, 2.0, 0.1)
    sim = model(mesh)
    sim.element_property(None, {"young": 5e9, "poisson_ratio": 0.2})
    sim.option(dynamic=False, collision=False)
    x = mesh.points[:, 0]
    sim.velocity_condition(np.flatnonzero(x == 0.0), vx=0.0)
    sim.velocity_condition(np.array([0]), vy=0.0)
    liners = Liners.of(sim)
    _, elements = liners.create(np.concatenate([near(mesh, 1, 0.0), near(mesh, 1, 0.1)]))
    liners.assign(elements, {**SHOTCRETE, "normal_stiffness": 1e12, "shear_stiffness": 1e12})
    for at in liners.nodes["origin"]:
        assert at[1] in (0.0, 0.1)
    ends = np.flatnonzero(liners.nodes["origin"][:, 0] == 0.0)
    liners.condition(ends, does_x=VELOCITY)
    pull = np.flatnonzero(x == 2.0)
    far = np.flatnonzero(liners.nodes["origin"][:, 0] == 2.0)
    sim.velocity_condition(pull, vx=1e-7)
    liners.condition(far, does_x=VELOCITY, at_x=1e-7)
    convergence.advance(sim, 1000)
    sim.velocity_condition(pull, vx=0.0)
    liners.condition(far, at_x=0.0)
    assert convergence.solve(sim, ratio=1e-7, cycles=50_000).reason == "ratio"
    strain = 1e-4 / 2.0
    rock = diagnostics.values(sim, "reaction_x")[pull].sum()
    shell = liners.values("liner-node", "reaction_x")[far].sum()
    assert rock == pytest.approx(5e9 / 0.96 * 0.1 * strain, rel=0.01)
    assert shell == pytest.approx(2.0 * 20e9 / 0.96 * 0.1 * strain, rel=0.001)


def test_excavated_hosts_release_supports_and_deleted_elements_too() -> None:
    sim, liners = slab(young=1e9)
    drawn(sim, liners, 50, at_y=-1e-6)
    liners.remove_conditions(np.arange(len(liners)))
    assert liners.elements["pressure"].all()
    host = liners.elements["host"]
    changes.null(sim, host[[0, 1]])
    assert (host[[0, 1]] == -1).all() and not liners.elements["pressure"][:2].any()
    assert liners.elements["pressure"][2:].all()
    liners.delete(np.array([1, 4]))
    assert (liners.elements["state"] & REMOVED > 0).tolist() == [False, True, False, False, True]
    assert not liners.elements["force"][[1, 4]].any() and liners.alive("liner-node").tolist() == [True] * 5 + [False]
    convergence.advance(sim, 500)
    assert np.isfinite(liners.nodes["x"]).all() and not liners.elements["force"][[1, 4]].any()
    face = int(liners.elements["face"][4])
    assert liners.create(np.array([face]))[1].tolist() == [5]  # there is room for another one


def test_it_holds_a_loose_block() -> None:
    """A block hangs under rock on the liner alone: its weight is in the bond of the rock beside it."""
    mesh = rectangle(9, 3, 0.9, 0.3)
    sim = model(mesh)
    sim.element_property(None, {"young": 1e9})
    sim.option(dynamic=False, collision=False)
    sim.gravity(0.0, -9.81)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((y == 0.3) & ((x < 0.25) | (x > 0.65))), vx=0.0, vy=0.0)
    liners = Liners.of(sim)
    _, elements = liners.create(near(mesh, 1, 0.0))
    liners.assign(elements, {**SHOTCRETE, "density": 1e-3})
    edges = mesh.edges()
    middles = mesh.points[edges.points].mean(axis=1)
    upright = np.abs(np.diff(mesh.points[edges.points][:, :, 0], axis=1)[:, 0]) < 1e-9
    cut = edges.inner & upright & ((np.abs(middles[:, 0] - 0.3) < 1e-9) | (np.abs(middles[:, 0] - 0.6) < 1e-9))
    changes.crack(sim, edges.faces[cut, 0])
    assert convergence.solve(sim, ratio=1e-6, cycles=100_000).reason == "ratio"
    pressure = liners.elements["pressure"].sum(axis=1)
    loose = (liners.nodes["origin"][liners.elements["ends"]].mean(axis=1)[:, 0] > 0.3) & (
        liners.nodes["origin"][liners.elements["ends"]].mean(axis=1)[:, 0] < 0.6
    )
    assert pressure[loose].sum() == pytest.approx(2700.0 * 9.81 * 0.09, rel=0.01)
    assert pressure.sum() == pytest.approx(0.0, abs=5.0)


def test_the_account_of_energy_closes() -> None:
    """Drawn off with yield, slip and parting, in motion, under gravity."""
    sim, liners = slab(True, 5e9, tensile_strength=0.3e6, compressive_strength=1e6, bond_tensile_strength=1e5,
                       bond_cohesion=5e4)  # fmt: skip
    sim.gravity(0.0, -9.81)
    liners.condition(np.array([0]), does_y=VELOCITY, at_y=0.6, does_x=VELOCITY, at_x=0.5)
    liners.condition(np.array([3]), force_x=-3e4, moment=200.0)
    convergence.advance(sim, 20)
    diagnostics.account_energy(sim)  # in motion
    convergence.advance(sim, 1480)
    found, rock = liners.energies(), diagnostics.energies(sim)
    assert min(found["lost_in_beams"], found["lost_in_bond"]) > 0.01
    assert (liners.elements["bond_state"] & kernels.PARTED).any()
    assert found["work_of_conditions"] > 1.0 and found["relative"] < 1e-5
    assert rock["work_liners"] == found["work_on_rock"] != 0.0 and rock["relative"] < 1e-6


@pytest.mark.parametrize("at", [150, *(pytest.param(n, marks=pytest.mark.slow) for n in (0, 400))])
def test_a_saved_model_continues(at, tmp_path) -> None:
    sim, liners = slab(True, 5e9, tensile_strength=0.3e6, compressive_strength=1e6, bond_tensile_strength=1e5)
    sim.table("pull", [(0.0, 0.0), (1e-3, 0.5)])
    liners.condition(np.array([0]), does_y=VELOCITY, at_y="pull")
    convergence.advance(sim, at)
    if at == 150:
        changes.null(sim, liners.elements["host"][[2]])
        liners.delete(np.array([3]))
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 120)
    for name, values in state(liners).items():
        assert np.array_equal(values, state(Liners.of(again))[name]), name
    position = [diagnostics.values(one, "position_y") for one in (sim, again)]
    assert np.array_equal(*position, equal_nan=True)


def test_a_model_may_step_before_its_liner_has_elements() -> None:
    sim = model(rectangle(2, 2, 1.0, 1.0))
    liners = Liners.of(sim)
    convergence.advance(sim, 2)
    assert sim.clock.step == 2 and len(liners) == 0


def test_mass_is_added_where_the_time_step_needs_it_and_reported() -> None:
    from tests.pcdc.fake import Noted

    sim, liners = slab(True, 1e8)
    sim.log = Noted()
    convergence.advance(sim, 20)
    said = [line for line in sim.log.lines if "mass scaling adds" in line]
    assert len(said) == 1 and "6 of 6 nodes" in said[0] and "rotational inertia of 6" in said[0]
    assert np.isfinite(liners.nodes["x"]).all() and np.abs(liners.nodes["v"]).max() < 1.0


def test_creep_asks_for_nodes_that_are_not_driven() -> None:
    sim, liners = slab()
    rock = {"density": 2700.0, "young": 5e9, "poisson_ratio": 0.25, "maxwell_viscosity": 1e15}
    changes.element_model(sim, None, "mech_burgers", rock)
    creep.switch(sim, True, dt=1.0)
    liners.condition(np.array([2]), does_x=VELOCITY, at_x=0.0, does_turn=VELOCITY, at_turn=0.1)
    with pytest.raises(CommandError, match="liner-node 2 has a prescribed motion, which in static runs acts per step"):
        creep.check(sim, 1.0)
    liners.delete(np.array([1, 2]))  # both that end there
    creep.check(sim, 1.0)


def test_what_makes_no_sense_is_refused_and_changes_nothing() -> None:
    sim, liners = slab()
    with pytest.raises(CommandError, match="is not free"):
        liners.create(near(sim.mesh, 1, 0.25, inner=True))
    with pytest.raises(CommandError, match="has a liner already"):
        liners.create(near(sim.mesh, 1, 0.5))
    for given, message in (
        ({"thickness": None}, "needs its thickness"),
        ({"tensile_strength": 1e6}, "are both required"),
        ({"tensile_strength": 0.0, "compressive_strength": 0.0}, "carry nothing"),
        ({"plastic_moment": 1e3}, "needs tensile_strength and compressive_strength"),
        ({"area": 0.01, "inertia": 1e-5, "tensile_strength": 1e6, "compressive_strength": 1e6}, "its plastic_moment"),
        ({"young": 0.0}, "young"),
    ):
        wanted = {name: value for name, value in {**SHOTCRETE, **given}.items() if value is not None}
        with pytest.raises(CommandError, match=message):
            liners.assign(np.arange(5), wanted)
    with pytest.raises(CommandError, match="there is no table 'q'"):
        liners.condition(np.array([0]), force_x="q")
    with pytest.raises(CommandError, match="must be finite"):
        liners.condition(np.array([0]), moment=float("inf"))
    with pytest.raises(CommandError, match="there is no quantity thickness of a liner-node"):
        liners.values("liner-node", "thickness")
    assert len(liners) == 6 and len(liners.rows) == 1
    other = model(rectangle(2, 2, 1.0, 1.0))
    _, elements = Liners.of(other).create(near(other.mesh, 1, 1.0))
    with pytest.raises(CommandError, match=r"liner-element 0 has no model \(2 in all\): assign liner c-model first"):
        other.step()


def test_a_hole_in_a_liner_is_filled_with_the_nodes_around_it() -> None:
    _, liners = slab()
    face = int(liners.elements["face"][2])
    liners.delete(np.array([2]))
    nodes, elements = liners.create(np.array([face]))
    assert len(nodes) == 0 and elements.tolist() == [5]
    assert liners.elements["ends"][5].tolist() == liners.elements["ends"][2].tolist()
