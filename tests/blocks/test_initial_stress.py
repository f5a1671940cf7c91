"""An initial stress is carried as strain: it changes with the moduli, on any way to equilibrium."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.groups import Span
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, ROCK, jointed, model, rectangle, shaken
from tests.space.support import box, hexes

COMPONENTS = ("xx", "yy", "xy", "zz")
STRESS = {"xx": -7e6, "yy": -3e6, "xy": 1.5e6, "zz": -4e6}


def held(kind: str) -> Blocks:
    """A square of which no node moves."""
    sim = model(shaken(rectangle(3, 3, 0.3, 0.3, kind=kind), 0.1))
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    return sim


def stresses(sim: Blocks) -> np.ndarray:
    """(4, ne)"""
    return np.array([diagnostics.values(sim, f"stress_{c}") for c in COMPONENTS])


@EVERY_KIND
def test_it_goes_down_with_the_modulus(kind):
    """Held everywhere: f times the stress for f times E, with its gradient; bit for bit the old one for the old E."""
    sim = held(kind)
    sim.initial_stress(None, **STRESS, gradient={"yy": (2e6, 25e3), "xy": (0.0, -1e6)})
    before = stresses(sim)
    sim.element_property(None, {"young": 0.3 * ROCK["young"]})
    assert stresses(sim) == pytest.approx(0.3 * before, rel=1e-12)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 0.02 * ROCK["young"], "density": 2000.0})
    assert stresses(sim) == pytest.approx(0.02 * before, rel=1e-12)
    sim.element_property(None, {"young": ROCK["young"], "density": 2650.0, "friction": 12.0})
    assert np.array_equal(stresses(sim), before)


def test_mean_follows_the_bulk_modulus_and_deviator_the_shear_modulus():
    """nu from 0.25 to 0.4 at the same E: K from E / 1.5 to E / 0.6, G from E / 2.5 to E / 2.8."""
    sim = held("mixed")
    sim.initial_stress(None, **STRESS)
    sim.element_property(None, {"poisson_ratio": 0.4})
    mean = (STRESS["xx"] + STRESS["yy"] + STRESS["zz"]) / 3.0
    k, g = 1.5 / 0.6, 2.5 / 2.8
    for c in COMPONENTS:
        normal = 0.0 if c == "xy" else mean
        assert diagnostics.values(sim, f"stress_{c}") == pytest.approx(k * normal + g * (STRESS[c] - normal), abs=1e-3)


def test_of_elements_without_a_model_it_belongs_to_the_first_one():
    sim = Blocks()
    sim.take_mesh(rectangle(2, 2, 0.2, 0.2))
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.initial_stress(None, yy=-1e6)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 3e9})
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-1e6, rel=1e-12)
    sim.element_property(None, {"young": 1e9})
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-1e6 / 3.0, rel=1e-12)


@pytest.mark.some_of_each
@pytest.mark.parametrize("way", ["relaxation", "at once", "motion", "joints"])
@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_a_softened_layer_between_rigid_ends(way, kind):
    """Layers a, b that cannot move aside, between rigid ends: with f M in a, La ea + Lb eb = 0 and
    f (s0 + M ea) = s0 + M eb, so both have s0 f (1 + r) / (f + r), r = La / Lb. Joints, thin springs of stiffness P per
    length h of their own, make M of a layer M / (1 + M / P) and are closed by it when the initial stress comes on."""
    f, r, s0 = 0.15, 0.5, -6e6
    mesh = rectangle(9, 2, 0.9, 0.2, kind=kind)
    sim = model(mesh)
    a = np.flatnonzero(mesh.centroids()[:, 0] < 0.3)
    x = mesh.points[:, 0]
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 0.9 - 1e-9)), vx=0.0)
    sim.velocity_condition(None, vy=0.0)
    sim.initial_stress(None, xx=s0, yy=s0 / 3.0, zz=s0 / 3.0)
    sim.option(dynamic=way in ("motion", "joints"), collision=False, large_strain=False)
    sim.element_property(None, {"damp_factor": 1.0})
    if way == "joints":
        jointed(sim, penalty_normal=1e3 * ROCK["young"], tensile_strength=1e12, cohesion=1e12, gf1=1e9, gf2=1e9)
    if way in ("motion", "joints"):
        convergence.solve(sim, time=2e-3)
    sim.element_property(a, {"young": f * ROCK["young"]})
    if way == "relaxation":
        assert convergence.solve(sim, ratio=1e-9, cycles=20000).reason == "ratio"
    elif way == "at once":
        equilibrium.solve_elastic(sim)
    else:
        diagnostics.account_energy(sim)
        convergence.solve(sim, time=8e-3)
        assert diagnostics.energies(sim)["relative"] < 1e-3
    expected = s0 * f * (1.0 + r) / (f + r)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(
        expected, rel=1e-6 if way in ("relaxation", "at once") else 5e-3
    )


@pytest.mark.parametrize("first", ["model", "stress"])
def test_across_the_plane_it_is_that_of_plane_strain(first):
    """Where nothing is said of zz it is nu (xx + yy), of each element by its own nu, with gradients, also where the
    model comes after the stress; said as 0, or by a gradient alone, it is what was said."""
    mesh = shaken(rectangle(3, 3, 0.3, 0.3, kind="mixed"), 0.1)
    sim, nu = Blocks(), {**dict.fromkeys(range(len(mesh.cells)), 0.25), 0: 0.4}
    sim.take_mesh(mesh)
    for what in (first, {"model": "stress", "stress": "model"}[first]):
        if what == "model":
            for at in (np.arange(1, len(mesh.cells)), [0]):
                changes.element_model(sim, at, "mech_iso_elastic", {**ROCK, "poisson_ratio": nu[at[0]]})
        else:
            sim.initial_stress(None, xx=-6e6, yy=-10e6, gradient={"yy": (0.0, 1e6)})
            sim.initial_stress([1], xx=-6e6, zz=0.0)
            sim.initial_stress([2], xx=-6e6, gradient={"zz": (0.0, 1e6)})
    wanted = np.array(list(nu.values())) * (-16e6 + 1e6 * mesh.centroids()[:, 1])
    wanted[[1, 2]] = 0.0, 1e6 * mesh.centroids()[2, 1]
    assert diagnostics.values(sim, "stress_zz") == pytest.approx(wanted, rel=1e-9)


WEAK = {"density": 2000.0, "young": 20e9, "poisson_ratio": 0.25, "friction": 30.0, "cohesion": 1e6, "tensile": 1e5}
BEARS = 2.0 * 1e6 * 3.0**0.5
"""[Pa] without confinement."""


class Log:
    def __init__(self) -> None:
        self.said: list[str] = []

    def warn_once(self, _: str, text: str) -> None:
        self.said.append(text)

    info = warn = at = lambda *_: None


@pytest.mark.parametrize("kind", ["cross", "quad", "mixed", "tets", "hexes"])
def test_a_stress_beyond_the_strength_is_reported(kind):
    """xx -6, yy -10 MPa: within the strength with zz of plane strain, and rock that is held stays as it is; with zz 0
    it is 10 - 2 c sqrt(N) beyond, and in tension by 1.9 MPa. Said once, with count, place and how far, also where the
    strength comes after the stress; not again in what follows from it."""
    if kind in ("tets", "hexes"):
        mesh = (box if kind == "tets" else hexes)((2, 2, 2), (1.0, 1.0, 1.0))
    else:
        mesh = rectangle(3, 3, 1.0, 1.0, kind=kind)
    sim = Blocks()
    sim.log = log = Log()
    sim.take_mesh(mesh)
    sim.option(dynamic=False, collision=False)
    sim.initial_stress(None, xx=-6e6, yy=-10e6, **({"zz": -4e6} if mesh.dim == 3 else {}))
    changes.element_model(sim, None, "mech_mohr_coulomb", WEAK)
    sim.velocity_condition(None, vx=0.0, vy=0.0, **({"vz": 0.0} if mesh.dim == 3 else {}))
    convergence.advance(sim, 20)
    assert not log.said and not diagnostics.values(sim, "plastic_state").any()
    each = 6 if kind == "hexes" else 1
    sim.initial_stress(np.arange(2 * each), xx=-6e6, yy=-10e6, zz=0.0)
    sim.initial_stress(2 * each + np.arange(each), xx=-6e6, yy=2e6, zz=-4e6)
    convergence.advance(sim, 20)
    assert len(log.said) == 1
    place = ", ".join(f"{c:.4g}" for c in mesh.centroids(np.array([2 * each]))[0])
    assert f"element {2 * each} at ({place})" in log.said[0] and f"{3 * each} elements have an initial" in log.said[0]
    assert f"excess is {3.0 * 2e6 + 6e6 - BEARS:.4g} Pa" in log.said[0] and "yy 2e+06" in log.said[0]
    assert (diagnostics.values(sim, "plastic_state") > 0.0).sum() >= 3


def test_it_is_saved_with_the_moduli_it_belongs_to(tmp_path):
    """Lowered, saved, and as before when the old moduli are back after loading."""
    sim = held("mixed")
    sim.initial_stress(None, **STRESS)
    before = stresses(sim)
    sim.element_property(np.arange(5), {"young": 0.5 * ROCK["young"]})
    lowered = stresses(sim)
    saved_state.save(sim, tmp_path / "now.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "now.sav")
    assert np.array_equal(stresses(again), lowered)
    again.element_property(None, {"young": ROCK["young"]})
    assert np.array_equal(stresses(again), before)


def test_a_file_without_the_column_is_read(tmp_path, monkeypatch):
    """The table of initial stresses as versions before wrote it: the stress stays, and follows what comes."""
    usual = saved_state._whole
    monkeypatch.setattr(saved_state, "_whole", lambda columns, root, *kind: usual(
        {name: values for name, values in columns.items() if name != "row"}, root, *kind))  # fmt: skip
    sim = held("cross")
    sim.initial_stress(None, **STRESS)
    saved_state.save(sim, tmp_path / "old.sav")
    with h5py.File(tmp_path / "old.sav") as file:
        assert sorted(file["stress0"]) == ["s0", "s1", "s2", "s3"]
    again = Blocks()
    saved_state.restore(again, tmp_path / "old.sav")
    assert np.array_equal(stresses(again), stresses(sim))
    again.element_property(None, {"young": 0.25 * ROCK["young"]})
    assert stresses(again) == pytest.approx(0.25 * stresses(sim), rel=1e-12)


def test_relaxation_says_what_it_lets_flow_meanwhile(tmp_path):
    """A column near its strength whose modulus grows to three times: said by model solve, which goes the way where it
    flows; not before, and not where the static solve has found balance, without flow, first."""
    for at_once in (False, True):
        plan = fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "out")
        plan.blocks.log = log = Log()
        fdem.meshes.grid(plan, (0.0, 0.0), (1.0, 1.0), (3, 3))
        fdem.assignments.element_model(plan, "mech_mohr_coulomb", WEAK)
        fdem.settings.option(plan, dynamic=False)
        fdem.assignments.velocity(plan, vy=0.0, where=(Span(1, 0.0, 0.0),))
        fdem.assignments.velocity(plan, vx=0.0, where=(Span(0, 0.0, 0.0),))
        fdem.assignments.stress(plan, normal=-3e6, where=(Span(1, 1.0, 1.0),))
        fdem.steps.solve_elastic(plan)  # relaxation swings beyond the load, and the strength
        fdem.steps.solve(plan, ratio=1e-6)
        assert not log.said
        fdem.assignments.element_property(plan, {"young": 3.0 * WEAK["young"]})
        if at_once:
            fdem.steps.solve_elastic(plan)
        fdem.steps.solve(plan, ratio=1e-6)
        flowed = diagnostics.values(plan.blocks, "plastic_work").any()
        if at_once:
            assert not log.said and not flowed
        else:
            assert len(log.said) == 1 and flowed
            assert f"{len(plan.alive)} elements exceed their strength in the present state" in log.said[0]
            assert f"excess is {9e6 - BEARS:.2g}"[:11] in log.said[0]
