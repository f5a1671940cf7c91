"""What differs from place to place in space: random fields, tables over z, functions of place and time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.numerics.random_field import _SQUARES, EXPONENTIAL, GAUSSIAN, LOGNORMAL, NORMAL, RandomField
from hpcdem.physics.fdem import convergence, diagnostics, equilibrium, saved_state, user_functions
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import Drawn, Over
from tests.pcdc.test_plastic import run
from tests.space.support import ROCK, body, box, faces_on, hexes, nodes_on

FILE = Path(__file__).with_name("laws") / "rock.py"
KINDS = pytest.mark.parametrize("made", [box, hexes], ids=["tetrahedra", "hexahedra"])


def test_sizes_of_waves_have_the_spectrum_of_the_covariance():
    """P(q) of both Fourier transforms in three dimensions, integrated in closed form; in two those of `RandomField`."""
    q = np.linspace(0.05, 8.0, 50)
    exact = 2.0 / math.pi * (np.arctan(q) - q / (1.0 + q * q))
    assert np.sqrt(_SQUARES[EXPONENTIAL, 3](exact)) == pytest.approx(q, rel=1e-10)
    exact = np.array([math.erf(v / 2.0) for v in q]) - q / math.sqrt(math.pi) * np.exp(-q * q / 4.0)
    assert np.sqrt(_SQUARES[GAUSSIAN, 3](exact)) == pytest.approx(q, rel=1e-7)


@pytest.mark.parametrize("covariance", [EXPONENTIAL, pytest.param(GAUSSIAN, marks=pytest.mark.slow)])
def test_the_variogram_of_a_correlated_field(covariance):
    """gamma(h) = 1 - C(h), over many seeds; along the axes and across."""
    length = 0.4
    form = {EXPONENTIAL: lambda h: math.exp(-h / length), GAUSSIAN: lambda h: math.exp(-((h / length) ** 2))}
    at, lags = np.random.default_rng(0).uniform(0, 10, (120, 3)), (0.1, 0.4, 0.8)
    for way in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.48, 0.6, 0.64)):
        found = np.zeros(len(lags))
        for seed in range(30):
            f = RandomField.of(NORMAL, 0.0, 1.0, seed, length, covariance)
            here = f.gaussian(at)
            found += [0.5 * ((f.gaussian(at + h * np.array(way)) - here) ** 2).mean() for h in lags]
        assert found / 30 == pytest.approx([1 - form[covariance](h) for h in lags], abs=0.06)


@KINDS
def test_elements_and_joints_get_the_values_of_their_places(made):
    """A hexahedron is one object with one value, and so is a side between two."""
    mesh = made((3, 2, 2), (3.0, 2.0, 2.0), shaken=0.1)
    sim = body(mesh)
    joints = sim.numbers_of_joints(None)
    sim.joint_model(
        joints,
        "classic_intrinsic_cohesive_interface",
        {"cohesion": 1e6, "tensile_strength": 1e6, "gf1": 20.0, "gf2": 90.0, "penalty_normal": 1e11},
    )
    sim.random_field("far", RandomField.of(LOGNORMAL, 2e6, 4e5, 8, 0.7, GAUSSIAN))
    sim.random_field("each", RandomField.of(LOGNORMAL, 2500.0, 200.0, 3))
    sim.table("t", [(0.0, 10e9), (2.0, 50e9)])
    sim.element_property(None, {"young": Over("t", 2), "density": Drawn("each")})
    sim.joint_property(joints, {"tensile_strength": Drawn("far"), "cohesion": Over("t", 2)})
    young, density = (sim.element_rows.column(name)[sim.element_row] for name in ("young", "density"))
    assert np.array_equal(young, np.interp(mesh.centroids()[:, 2], [0, 2], [10e9, 50e9]))
    assert len(np.unique(density)) == (12 if len(mesh.hexes) else len(mesh.cells))
    strength, cohesion = (
        sim.joint_rows.column(name)[sim.joint_row[joints]] for name in ("tensile_strength", "cohesion")
    )
    middle = mesh.side_middles(joints)
    assert np.array_equal(strength, sim.fields["far"].values("face-joint", joints, middle))
    assert np.array_equal(cohesion, np.interp(middle[:, 2], [0, 2], [10e9, 50e9]))
    if len(mesh.hexes):
        assert len(joints) == 2 * 20 and len(np.unique(strength)) == 20
    sim.step()


@KINDS
def test_stiffness_over_z(made):
    """Young's modulus linear over z without lateral strain, pressed: 1/E is added up layer by layer of hexahedra;
    tetrahedra of a layer have other places, their mean stress is that of their own moduli within 2 %."""
    sim = body(made((1, 1, 8), (0.5, 0.5, 4.0)), dynamic=False, poisson_ratio=0.0)
    sim.table("E", [(0.0, 10e9), (4.0, 40e9)])
    sim.element_property(None, {"young": Over("E", 2)})
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.velocity_condition(nodes_on(sim.mesh, "bottom"), vz=0.0)
    sim.velocity_condition(nodes_on(sim.mesh, "top"), vz=-1e-4)
    equilibrium.solve_elastic(sim)
    layers = np.interp(0.25 + 0.5 * np.arange(8), [0, 4], [10e9, 40e9])
    found = diagnostics.values(sim, "stress_zz")
    exact = -1e-4 / (0.5 / layers).sum()
    if len(sim.mesh.hexes):
        assert found == pytest.approx(exact, rel=1e-4)
    assert found.mean() == pytest.approx(exact, rel=0.02)


def function(sim: Blocks, name: str) -> str:
    return user_functions.load(sim, FILE, f"rock.py:{name}")


@KINDS
def test_velocity_by_place_and_time(made):
    """v_z = 0.1 z + 1e3 x y t at every node, at the middle of the step; one rank's restart goes on."""
    sim = body(made((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2))
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=function(sim, "pump"))
    sim.time_step(value=1e-6)
    convergence.advance(sim, 7)
    x, y, z = sim.mesh.points.T
    assert diagnostics.values(sim, "velocity_z") == pytest.approx(0.1 * z + 1e3 * x * y * 6.5e-6, rel=1e-12)


@KINDS
@pytest.mark.parametrize("dynamic", [True, False])
def test_a_function_that_is_a_number_gives_its_bits(made, dynamic, tmp_path):
    """Velocity, acceleration, force and traction; in between a file."""
    (tmp_path / "f.py").write_text("def f(z, t, x):\n    return 2e4 + 0.0 * z * t\n")
    ends = []
    for own in (False, True):
        sim = body(made((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2), dynamic)
        mesh = sim.mesh
        value = user_functions.load(sim, tmp_path / "f.py", "f.py:f") if own else 2e4
        sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
        if dynamic:
            sim.velocity_condition([13], az=value)
        sim.force_condition([7, 17], fz=value)
        sim.stress_condition(faces_on(mesh, "top"), zz=value, xz=value)
        convergence.advance(sim, 20)
        saved_state.save(sim, tmp_path / "a.sav")
        sim = Blocks()
        saved_state.restore(sim, tmp_path / "a.sav")
        convergence.advance(sim, 20)
        ends.append((sim.x, sim.v))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])
    assert np.abs(ends[0][1]).max() > 0.0


@KINDS
def test_shear_traction_by_place(made):
    """A shear linear over y on the top, p(y) = 1e6 y: its force is the integral, 1/2 of it per metre, exactly, as the
    value at the middle of a triangle is its mean."""
    sim = body(made((2, 3, 1), (1.0, 1.0, 0.5)))
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(sim.mesh, "top"), xz=function(sim, "drag"))
    sim.step()
    assert -diagnostics.values(sim, "reaction_x").sum() == pytest.approx(0.5e6, rel=1e-12)


def test_what_has_no_z_is_refused(tmp_path):
    plane = Blocks()
    plane.take_mesh(Mesh.of([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [[0, 1, 2, -1]]))
    plane.set_element_model(None, "mech_iso_elastic", ROCK)
    with pytest.raises(
        CommandError, match=r"rock\.py:pump is a function of z, and a model in two dimensions has x and"
    ):
        plane.velocity_condition(None, vx=function(plane, "pump"))
    plane.table("t", [(0.0, 1e9)])
    with pytest.raises(CommandError, match="young: a table over z"):
        plane.element_property(None, {"young": Over("t", 2)})
    with pytest.raises(HpcdemError, match="read 'z', expected one of x, y, temperature, moisture for 'over'"):
        run(tmp_path, "pcdc model new dim 2\npcdc mesh structured (0,0) (1,2) cells 1 1\n"
                      "pcdc element c-model mech-iso-e property den 2000 young table 'E' over z p-r 0.2\n")  # fmt: skip


def test_in_a_script(tmp_path):
    (tmp_path / "rock.py").write_text(FILE.read_text())
    text = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (1,1,2) cells 2 2 4 type hex
pcdc table create 'E' values (0,1e9) (2,3e9)
pcdc field create 'rho' lognormal 2000 100 seed 3 correlation 0.5
pcdc node function 'rock.py:pump'
pcdc element c-model mech-iso-e property den field 'rho' young table 'E' over z poisson-ratio 0.2
pcdc node boundary mech-vel-b-c velocity-z function 'rock.py:pump' range z 1.99 2.01
pcdc element-face boundary m-s-b-c stress-xz function 'rock.py:drag' range z 0 0
pcdc model step 3
"""
    pcdc = run(tmp_path, text).namespace["pcdc"]
    assert len(np.unique(pcdc.values("element", "young"))) == 4
    assert len(np.unique(pcdc.values("element", "density"))) == 16
