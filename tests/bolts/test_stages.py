"""Bolts that are installed in mid-run, tensioned, excavated; what they do to the rock; how much energy they hold."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts import kernels, layout
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.structures import REMOVED
from tests.blocks.support import model, near, rectangle
from tests.bolts.support import STEEL, state


def block(dynamic: bool = False, young: float = 1e9) -> Blocks:
    """1 m x 1 m that stands on its base."""
    sim = model(rectangle(8, 8, 1.0, 1.0))
    sim.element_property(None, {"young": young})
    sim.option(dynamic=dynamic, collision=False)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)
    return sim


def bolt(sim: Blocks, *points: tuple[float, float], **more: object) -> Bolts:
    bolts = Bolts.of(sim)
    of_bolt = {name: more.pop(name) for name in ("segments", "length", "grout", "plate") if name in more}
    _, elements = bolts.create(points, **of_bolt)
    bolts.assign(elements, {**STEEL, **more})
    return bolts


@pytest.mark.slow
def test_a_soft_block_hangs_on_a_bolt_and_a_plate() -> None:
    """A block under a void hangs on one bolt: all of its weight is in the bar where it crosses the void. Per metre of
    thickness; one bolt has the spacing times as much."""
    sim = model(rectangle(4, 12, 0.4, 1.2))
    y = sim.mesh.points[:, 1]
    sim.option(dynamic=False, collision=False)
    sim.gravity(0.0, -9.81)
    sim.velocity_condition(np.flatnonzero(y == 1.2), vx=0.0, vy=0.0)
    sim.velocity_condition(None, vx=0.0)
    bolts = bolt(sim, (0.2, 0.0), (0.2, 1.1), plate=True, spacing=1.7, segments=22, grout=(0.6, 1.1))
    middle = sim.mesh.centroids()[:, 1]
    changes.null(sim, np.flatnonzero((middle > 0.4) & (middle < 0.6)))
    assert convergence.solve(sim, ratio=1e-7, cycles=200_000).reason == "ratio"
    weight = 2700.0 * 9.81 * 0.4 * 0.4
    free = slice(1, 12)  # from the plate to the grout
    assert bolts.values("bolt-element", "axial_force")[free] == pytest.approx(1.7 * weight, rel=1e-4)
    assert bolts.nodes["bond"].sum() == pytest.approx(weight, rel=1e-4)
    reaction = diagnostics.total(sim, "reaction_y")
    assert reaction == pytest.approx(2700.0 * 9.81 * 0.4 * 1.0, rel=1e-4)


def test_bolts_bring_no_force_or_moment_from_nowhere() -> None:
    """A tensioned bolt in a body without supports: what it does to the rock adds up to nothing, also where it has a
    kink."""
    sim = block(True)
    sim.remove_conditions()
    bolts = bolt(sim, (0.13, 0.97), (0.31, 0.41), (0.83, 0.22), plate=True, pretension_force=50e3, grout=(0.4, 2.0))
    convergence.advance(sim, 300)
    force = bolts._on_rock
    assert np.abs(force).max() > 1e4
    # Inertia along the bar is all that is missing; it is small beside the forces once it has come to rest.
    bar = (bolts._total * bolts._tangent).sum(axis=1) + bolts.nodes["bond"]
    free = bolts.nodes["plate"] == 0
    missing = (bar[free, None] * bolts._tangent[free]).sum(axis=0)
    assert np.allclose(force.sum(axis=0) + missing, 0.0, atol=1e-9 * np.abs(force).sum())


def test_pretension_presses_the_rock_and_is_given_again_by_difference() -> None:
    sim = block(young=50e9)
    bolts = bolt(sim, (0.5, 1.0), (0.5, 0.1), plate=True, pretension_force=40e3, segments=18, grout=(0.6, 0.9))
    assert bolts.values("bolt-element", "axial_force") == pytest.approx(40e3)
    convergence.solve(sim, ratio=1e-7)
    first = bolts.values("bolt-element", "axial_force")
    assert 25e3 < first[0] < 35e3 and first[:11] == pytest.approx(first[0], rel=1e-3)
    assert diagnostics.values(sim, "stress_yy").min() < -1e5
    bolts.assign(np.arange(18), {**STEEL, "pretension_force": 45e3})
    assert bolts.values("bolt-element", "axial_force") == pytest.approx(first + 5e3)
    bolts.assign(np.arange(18), {**STEEL, "pretension_force": 45e3})  # nothing new is said
    assert bolts.values("bolt-element", "axial_force") == pytest.approx(first + 5e3)


@pytest.mark.slow
def test_what_creeps_hangs_on_its_bolt_more_and_more() -> None:
    """A column of a Maxwell rock (K, G, eta) that cannot give way aside, and a bolt that is tied to all of it, share a
    stress P. With k = E A over spacing and width, S the deviator along the column and T = 4 G / 3:

        P = (K + k) e + S,  S' = T e' - S G / eta:  S = T P / (K + k + T) exp(-r t),  r = G / eta / (1 + T / (K + k))
    """
    width, load, bulk, shear, viscosity, spacing = 0.1, 2e6, 2e9, 1e9, 1e14, 1.5
    sim = model(rectangle(1, 5, width, 1.0, kind="quad"))
    rock = {"density": 2500.0, "bulk": bulk, "maxwell_shear": shear, "maxwell_viscosity": viscosity}
    changes.element_model(sim, None, "mech_burgers", rock)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.velocity_condition(None, vx=0.0)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vy=0.0)
    sim.stress_condition(near(sim.mesh, 1, 1.0), yy=load)
    tied = {"shear_stiffness_rock_bolt": 1e12, "cohesion_rock_grout": 1e12, "cohesion_grout_bolt": 1e12}
    bolts = bolt(sim, (width / 2, 1.0), (width / 2, 0.0), segments=10, spacing=spacing, **tied)
    bar = STEEL["young"] * np.pi / 4.0 * STEEL["diameter"] ** 2
    both, t = bulk + bar / spacing / width, 4.0 / 3.0 * shear
    creep.switch(sim, True, dt=2e4)
    convergence.solve(sim, ratio=1e-5)
    for _ in range(6):
        rest = t * load / (both + t) * np.exp(-sim.creep.time * shear / viscosity / (1.0 + t / both))
        assert bolts.values("bolt-element", "axial_force")[2:-2] == pytest.approx(bar * (load - rest) / both, rel=2e-3)
        creep.begin(sim, 1e6)
        assert convergence.solve(sim, ratio=1e-5, window=0, limit=20_000).reason == "ratio"
        creep.finish(sim, 1e6)
    assert rest < 0.7 * t * load / (both + t)  # creep has done something
    creep.check(sim, 1e6)
    for does in (kernels.VELOCITY, kernels.ACCELERATION):
        bolts.condition(np.array([3]), does_y=does, at_y=1e-9)
        with pytest.raises(CommandError, match="bolt-node 3 has a prescribed motion, which in static runs"):
            creep.check(sim, 1e6)
    bolts.condition(np.array([3]), at_y=0.0)
    creep.check(sim, 1e6)


def test_excavated_hosts_release_supports() -> None:
    """The rock around the head is taken out: its nodes are free of grout, the plate is gone, the rest still holds."""
    sim = block()
    sim.gravity(0.0, -9.81)
    bolts = bolt(sim, (0.5, 1.0), (0.5, 0.2), plate=True, pretension_force=20e3, segments=16)
    convergence.solve(sim, ratio=1e-6)
    assert bolts.hosted.all() and bolts.nodes["plate"][0]
    changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 1] > 0.75))
    convergence.solve(sim, ratio=1e-6)
    gone = bolts.nodes["origin"][:, 1] > 0.75 + 1e-9
    assert np.array_equal(~bolts.hosted, gone) and not bolts.nodes["plate"].any()
    assert not bolts.nodes["bond"][gone].any() and bolts.nodes["bond"][~gone].any()
    force = bolts.values("bolt-element", "axial_force")
    assert np.abs(force[:5]).max() < 1e-2 * np.abs(force).max()  # nothing holds its head any more
    # All of it out, one after the other: it floats, without force.
    changes.null(sim, np.flatnonzero((sim.mesh.centroids()[:, 1] > 0.15) & sim.alive))
    convergence.advance(sim, 200)
    assert not bolts.hosted.any() and np.isfinite(bolts.nodes["x"]).all()


def test_a_bolt_stiffens_what_is_cracked() -> None:
    """Installed in the middle of a run, it holds from then on: its elements begin without force."""
    opened = []
    for bolted in (False, True):
        sim = model(rectangle(8, 2, 0.8, 0.2))
        sim.option(dynamic=False, collision=False)
        x = sim.mesh.points[:, 0]
        sim.velocity_condition(np.flatnonzero(x == 0.0), vx=0.0, vy=0.0)
        edges = sim.mesh.edges()
        across = edges.inner & (np.abs(sim.mesh.points[edges.points][:, :, 0] - 0.4) < 1e-9).all(axis=1)
        joint = {"friction": 0.0, "cohesion": 1e6, "tensile_strength": 1e6, "gf1": 50.0, "gf2": 50.0,
                 "penalty_normal": 2e7}  # fmt: skip
        sim.joint_model(edges.faces[across][:, 0], "classic_intrinsic_cohesive_interface", joint)
        convergence.advance(sim, 100)
        if bolted:
            bolts = bolt(sim, (0.1, 0.1), (0.7, 0.1))
            assert not bolts.elements["force"].any()
        sim.force_condition(np.flatnonzero(x == 0.8), fx=5e3)
        assert convergence.solve(sim, ratio=1e-7, cycles=200_000).reason == "ratio"
        opened.append(float(np.nanmax(diagnostics.values(sim, "opening"))))
    assert opened[1] < 0.5 * opened[0]


@pytest.mark.parametrize("steps", [1, 1500])
def test_the_account_of_energy_closes(steps) -> None:
    """Pulled and accelerated until bars yield and grout slips: at any moment what goes in is stored or lost."""
    sim = block(True, 5e9)
    bolts = bolt(sim, (0.5, 1.0), (0.5, 0.2), segments=20, tensile_yield_force=8e3, cohesion_grout_bolt=2e5,
                 cohesion_rock_grout=2e5, damp_factor=0.1, pretension_force=3e3)  # fmt: skip
    bolts.condition(np.array([0]), does_y=kernels.VELOCITY, at_y=0.3)
    bolts.condition(np.array([20]), does_y=kernels.VELOCITY, at_y=0.1)
    bolts.condition(np.array([10]), does_y=kernels.ACCELERATION, at_y=50.0)
    bolts.condition(np.array([5]), force_y=2e3)
    diagnostics.account_energy(sim)
    convergence.advance(sim, steps)
    found, rock = bolts.energies(), diagnostics.energies(sim)
    assert found["relative"] < 1e-11
    if steps == 1:
        return
    assert min(found["lost_in_bars"], found["lost_in_grout"], found["lost_by_dashpots"]) > 0.1
    assert found["work_of_conditions"] > 1.0
    assert rock["work_bolts"] == found["work_on_rock"] != 0.0 and rock["relative"] < 1e-6
    assert abs(rock["work_outside"]) < 1e-6 * abs(rock["work_bolts"])  # bolts alone drive it


@pytest.mark.parametrize("at", [150, *(pytest.param(n, marks=pytest.mark.slow) for n in (0, 400))])
def test_a_saved_model_continues(at, tmp_path) -> None:
    """Before the first step, in mid-run, after rupture: with commands given just before, too."""
    sim = block(True, 5e9)
    bolts = bolt(sim, (0.5, 1.0), (0.42, 0.2), segments=20, tensile_yield_force=8e3, tension_failure_strain=0.1,
                 friction_rock_grout=30.0, cohesion_grout_bolt=2e5)  # fmt: skip
    sim.table("pull", [(0.0, 0.0), (1e-4, 0.5)])
    bolts.condition(np.array([0]), does_y=kernels.VELOCITY, at_y="pull")
    convergence.advance(sim, at)
    assert (bolts.elements["state"] & kernels.RUPTURED > 0).any() == (at == 400)
    if at == 150:
        changes.null(sim, np.array([int(bolts.nodes["host"][2])]))
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 120)
    there = Bolts.of(again)
    for name, values in state(bolts).items():
        assert np.array_equal(values, state(there)[name]), name
    assert np.array_equal(
        diagnostics.values(sim, "position_y"), diagnostics.values(again, "position_y"), equal_nan=True
    )


def test_mass_is_added_where_the_time_step_needs_it_and_reported() -> None:
    from tests.pcdc.fake import Noted

    sim = block(True, 1e8)
    sim.log = Noted()
    bolts = bolt(sim, (0.5, 1.0), (0.5, 0.2), segments=200)
    convergence.advance(sim, 50)
    said = [line for line in sim.log.lines if "mass scaling adds" in line]
    assert len(said) == 1 and "201 of 201 nodes" in said[0]
    assert np.isfinite(bolts.nodes["x"]).all() and np.abs(bolts.nodes["v"]).max() < 1.0


def test_what_makes_no_sense_is_refused_and_changes_nothing() -> None:
    sim = block()
    bolts = Bolts.of(sim)
    for points, more, message in (
        ([(0.5, 0.5)], {}, "at least two points"),
        ([(0.5, 0.5), (0.5, 0.5)], {}, "coincide"),
        ([(0.5, 0.5), (0.5, np.nan)], {}, "must be finite"),
        ([(2.0, 2.0), (3.0, 3.0)], {}, "no node of the bolt lies in an element"),
        ([(0.5, 0.5), (0.5, 0.9)], {"grout": (0.5, 0.6)}, "grout must start"),
        ([(0.5, 0.5), (0.5, 0.9)], {"grout": (0.3, 0.2)}, "grout must start"),
        ([(0.5, 0.5), (0.5, 0.9)], {"segments": 0}, "at least one segment"),
        ([(0.5, 0.5), (0.5, 0.9)], {"segments": 2, "length": 0.1}, "cannot be combined"),
        (
            [(0.5, 0.5), (0.5, 0.9)],
            {"length": 1e-9},
            "length 1e-09 would make 4e.08 segments of 0.4 m of bolt, more than",
        ),
        ([(0.5, 0.5), (0.5, 0.9)], {"length": 1e-320}, "would make inf segments"),
        ([(0.5, 0.5), (0.5, 0.9)], {"segments": 10**12}, "segments 1000000000000 would make 1e.12 segments"),
    ):
        with pytest.raises(CommandError, match=message):
            bolts.create(points, **more)
    assert len(bolts) == 0
    _, elements = bolts.create([(0.5, 0.5), (0.5, 0.9)])
    with pytest.raises(CommandError, match="bolt-element 0 has no model"):
        sim.step()
    for given, message in (
        ({"tensile_yield_force": 1e3, "pretension_force": 2e3}, "pretension_force must not be above"),
        ({"young": -1.0}, "young must be > 0"), ({"youth": 1.0}, "has no property youth"),
        ({"friction_rock_grout": 90.0}, "friction_rock_grout must be"),
    ):  # fmt: skip
        with pytest.raises(CommandError, match=message):
            bolts.assign(elements, {**STEEL, **given})
    bolts.assign(elements, {**STEEL, "spacing": 2.0})
    with pytest.raises(CommandError, match=r"bolt-element 0 has the spacing 2 m: the spacing of a bolt is uniform"):
        bolts.assign(elements[1:], STEEL)
    with pytest.raises(CommandError, match="there is no table 'v'"):
        bolts.condition(np.array([0]), force_x="v")
    sim.table("v", [(0.0, 0.0), (1.0, 1.0)])
    bolts.condition(np.array([0]), force_x="v")
    with pytest.raises(CommandError, match="is used by a boundary condition"):
        sim.remove_table("v")
    bolts.remove_conditions(np.array([0]))
    sim.remove_table("v")
    with pytest.raises(CommandError, match="the static solve does not support bolts"):
        equilibrium.solve_elastic(sim)
    sim.step()
    sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
    assert Bolts.there(sim) is None


def test_deleted_elements_carry_nothing_and_the_rest_continues() -> None:
    """The middle of a tensioned bolt is taken out: each half is held by its own grout; numbers stay."""
    sim = block(young=50e9)
    sim.gravity(0.0, -9.81)
    bolts = bolt(sim, (0.5, 1.0), (0.5, 0.2), plate=True, pretension_force=20e3, segments=16, tensile_yield_force=1e9)
    convergence.solve(sim, ratio=1e-7)
    grout, bond = bolts.nodes["grout"].copy(), bolts.nodes["bond"].copy()
    bolts.delete(np.array([7, 8]))
    assert (bolts.elements["state"] & REMOVED > 0).tolist() == 7 * [False] + 2 * [True] + 7 * [False]
    assert bolts.alive("bolt-node").tolist() == 8 * [True] + [False] + 8 * [True]  # node 8 had no other element
    assert bolts.nodes["grout"].sum() == pytest.approx(grout.sum() - 2 * 0.05)
    assert bolts.nodes["bond"][[7, 9]] == pytest.approx(0.5 * bond[[7, 9]]) and bolts.nodes["bond"][8] == 0.0
    assert not bolts.hosted[8] and bolts.hosted[[7, 9]].all()
    assert convergence.solve(sim, ratio=1e-6, cycles=50_000).reason == "ratio"
    force = bolts.values("bolt-element", "axial_force")
    assert not force[[7, 8]].any() and abs(force[6]) < 0.2 * force[0] and abs(force[9]) < 0.2 * force[0]
    # What is left over of each half is in balance with its grout; the plate takes the rest of the first.
    assert bolts.nodes["bond"][9:].sum() == pytest.approx(0.0, abs=1e-3 * np.abs(bolts.nodes["bond"]).max())
    bolts.delete(np.flatnonzero(bolts.alive("bolt-element")))
    convergence.advance(sim, 100)
    assert not bolts._on_rock.any() and np.isfinite(bolts.nodes["x"]).all()
    with pytest.raises(CommandError, match="bolt-element 16 has no model"):  # deleted ones need none, new ones do
        bolts.create([(0.2, 0.9), (0.2, 0.5)])
        sim.step()


def test_edges_that_a_bar_crosses() -> None:
    """Also at a common end of several edges; none beyond the ends of the bar, none of an edge along it."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    cells = np.array([[0, 1, 2, -1], [0, 2, 3, -1]])
    corners = points[np.where(cells >= 0, cells, 0)]

    def crossings(a: tuple[float, float], b: tuple[float, float]) -> list[float]:
        return layout._crossings(np.array(a), np.array(b), corners, cells).tolist()

    assert crossings((-1.0, 0.25), (3.0, 0.25)) == pytest.approx([0.25, 1.25 / 4.0, 1.25 / 4.0, 0.5])
    assert crossings((0.5, -1.0), (0.5, 0.25)) == pytest.approx([0.8])
    assert set(crossings((-1.0, 1.0), (1.0, -1.0))) == {0.5}, "through a corner of both elements"
    assert set(crossings((2.0, 0.0), (0.0, 2.0))) == {0.5} and crossings((0.25, 0.125), (0.75, 0.25)) == []
