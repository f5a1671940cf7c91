"""Laws of users in tetrahedra and hexahedra: like the built-in ones, with heat, what they remember, what is refused."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state, user_laws
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import model, rectangle
from tests.heat.support import GRANITE
from tests.pcdc.test_plastic import run
from tests.pcdc.test_whole import history, tables
from tests.space.support import ROCK, body, box, hexes, nodes_on
from tests.space.test_yielding import COMPONENTS, SOIL, deform

LAWS = Path(__file__).with_name("laws") / "rock.py"
BOTH = pytest.mark.parametrize("of", [box, hexes])


def law(sim: Blocks, name: str, path: Path = LAWS) -> str:
    """A law of the file, by the name of its model."""
    return user_laws.load(sim, path, f"{path.name}:{name}").name


def stresses(sim: Blocks) -> np.ndarray:
    return np.array([diagnostics.values(sim, f"stress_{c}") for c in COMPONENTS])


def everything(sim: Blocks) -> np.ndarray:
    moves = [diagnostics.values(sim, f"velocity_{axis}") * 1e7 for axis in "xyz"]
    return np.concatenate([*moves, *stresses(sim)])


@pytest.mark.some_of_each
@pytest.mark.parametrize("dynamic", [True, False], ids=["motion", "relaxation"])
@pytest.mark.parametrize("part", [1.0, 0.4], ids=["all", "some"])
@BOTH
def test_a_law_like_the_built_in_one(of: Any, part: float, dynamic: bool) -> None:
    """A bar with an initial stress that swings, or comes to rest under a load, warmed at one end: time steps and masses
    too."""
    ends = []
    for own in (False, True):
        mesh = of((4, 3, 3), (1.0, 0.8, 0.9), shaken=0.2)
        sim = body(mesh, dynamic=dynamic, damp_factor=0.1)
        if own:
            some = np.arange(6 * int(part * len(mesh.cells) / 6))
            changes.element_model(sim, some, law(sim, "mises"), {**ROCK, "damp_factor": 0.1})
        sim.initial_stress(None, xx=-1e5, yz=2e5)
        sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
        heat = Heat.of(sim)
        heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5})
        heat.initial(nodes_on(mesh, "right"), 30.0)
        heat.prescribe(nodes_on(mesh, "right"), 60.0)
        sim.heat_clock(dt=500.0)
        if dynamic:
            changes.set_velocity(sim, nodes_on(mesh, "right"), 5.0, 1.0, 2.0)
            sim.gravity(0.0, 0.0, -9.81)
            convergence.advance(sim, 150)
        else:
            sim.force_condition(nodes_on(mesh, "right"), fx=1e4, fz=-3e4)
            sim.parts(mechanical=False)
            sim.option(dynamic=True)
            convergence.advance(sim, 5)
            sim.option(dynamic=False)
            sim.parts(mechanical=True, thermal=False)
            assert convergence.solve(sim, ratio=1e-9).reason == "ratio"
        ends.append([everything(sim), np.array(sim.clock.dt)])
    (one, dt), (other, same) = ends
    within = 1e-10 if dynamic else 1e-7
    assert other == pytest.approx(one, abs=within * np.abs(one).max()) and dt == same
    assert np.abs(one).max() > 1e5


@BOTH
def test_others_may_follow_temperatures(of: Any) -> None:
    """Elements with a law beside some whose modulus follows a table: heat changes nothing of their stress."""
    mesh = of((4, 2, 2), (1.0, 0.5, 0.5), shaken=0.2)
    sim = body(mesh)
    sim.table("softer", [(0.0, 50e9), (100.0, 20e9)])
    sim.element_property(None, {"young": Over("softer", TEMPERATURE)})
    mine = np.arange(len(mesh.cells) // 2)
    changes.element_model(sim, mine, law(sim, "mises"), ROCK)
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.open_model()
    x = sim.x.reshape(-1, 4, 4)
    x[:, :, :3] += 1e-4 * x[:, :, [1, 2, 0]]
    sim.close_model()
    before = stresses(sim)
    assert before == pytest.approx(np.repeat(before[:, -1:], len(mesh.cells), axis=1), rel=1e-9, abs=1.0)
    heat.prescribe(None, 80.0)
    sim.heat_clock(dt=1.0)
    sim.step()
    after, others = stresses(sim), np.setdiff1d(np.arange(len(mesh.cells)), mine)
    assert np.array_equal(after[:, mine], before[:, mine]) and np.abs(before).max() > 1e6
    assert after[:, others] == pytest.approx(before[:, others] * 26.0 / 50.0, rel=1e-9, abs=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("of, dilation", [(box, 10.0), (hexes, 0.0)])
def test_soil_that_yields_as_the_built_in_one_does(of: Any, dilation: float) -> None:
    """Three deformations, one after the other, of any directions. In hexahedra the built-in law shares the volume of
    its flow out in each overlay, a law of the user does not know of the others: without dilation it is the same."""
    rock = {**SOIL, "dilation": dilation, "tensile": 1e6 if of is box else 1e12, "friction": 30.0}
    ends = []
    for own in (False, True):
        sim = Blocks()
        sim.take_mesh(of((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2))
        changes.element_model(sim, None, law(sim, "mohr_coulomb") if own else "mech_mohr_coulomb", rock)
        sim.option(dynamic=False, collision=False)
        sim.initial_stress(None, xx=-3e6, xz=1e6)
        rng = np.random.default_rng(5)
        found = []
        for _ in range(3):
            deform(sim, np.eye(3) + rng.uniform(-2e-3, 2e-3, (3, 3)) - (0.5e-3 if of is box else 1e-3) * np.eye(3))
            shake = rng.uniform(-1e-4, 1e-4, sim.x.reshape(-1, 4, 4)[:, :, :3].shape)
            sim.open_model()
            points = np.zeros((len(sim.mesh.points), 3))
            points[sim.mesh.cells[sim.number]] = shake
            sim.x.reshape(-1, 4, 4)[:, :, :3] += points[sim.mesh.cells[sim.number]]
            sim.step()
            found.append(stresses(sim))
        ends.append(found)
    for one, other in zip(*ends):
        assert other == pytest.approx(one, abs=1e-10 * np.abs(one).max())
    assert diagnostics.values(sim, "law_work").max() > 1.0


@BOTH
def test_states_follow_the_law(of: Any) -> None:
    """Simple shear up to twice the strain at the limit L / (2 G), with half of the stress there from the beginning, and
    half of the way back, which is elastic."""
    limit, shear = 1e6, ROCK["young"] / 2.5
    e = 0.5 * limit / shear
    sim = body(of((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2), dynamic=False)
    changes.element_model(sim, None, law(sim, "mises"), {**ROCK, "limit": limit})
    sim.option(large_strain=False)
    sim.initial_stress(None, xz=0.5 * limit)
    for way, slip, stress in ((2.0, 1.5, 1.0), (1.5, 1.5, 0.5)):
        deform(sim, np.array([[1.0, 0.0, 2.0 * way * e], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
        assert diagnostics.values(sim, "law_p13") == pytest.approx(slip * e, rel=1e-9)
        assert diagnostics.values(sim, "stress_xz") == pytest.approx(stress * limit, rel=1e-9)
        assert diagnostics.values(sim, "law_work") == pytest.approx(2.0 * slip * e * limit, rel=1e-9)
    changes.reset_state(sim, np.arange(6))
    assert diagnostics.values(sim, "law_p13")[6:] == pytest.approx(1.5 * e, rel=1e-9)
    assert diagnostics.values(sim, "law_p13")[:6] == pytest.approx(e, rel=1e-9)


def test_a_hexahedron_shows_the_mean_of_its_tetrahedra_and_has_one_pressure_in_an_overlay() -> None:
    """Bent without volume strain, so that some of its tetrahedra flow: its forces are those of the mean stress."""
    sim = body(hexes((1, 1, 1), (1.0, 1.0, 1.0)), dynamic=False)
    changes.element_model(sim, None, law(sim, "mises"), {**ROCK, "limit": 1e6})
    sim.close_model()
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.open_model()
    x, y, z = np.moveaxis(sim.x.reshape(-1, 4, 4)[:, :, :3], 2, 0)
    sim.x.reshape(-1, 4, 4)[:, :, 0] = x + 3e-4 * (y - 0.5) * z
    sim.step()
    own = sim.local.hexes
    memory = sim.cold[user_laws.COLUMN][:, 1:]
    of = sim.local.solids.blocks[1]
    found = of.histories(memory, memory.shape[1] // of.kind.in_row)[0]
    assert np.ptp(found[:, 6]) > 1.0 and (found[:, 6] >= 0.0).all()
    assert diagnostics.values(sim, "law_work") == pytest.approx(float(own.shares()[0] @ found[:, 6]), rel=1e-12)
    pressure = sim.local.solids.blocks[1].s0[0][:, [0, 1, 3]].sum(axis=1).reshape(2, 5)
    assert np.ptp(pressure, axis=1).max() < 1e-9 * np.abs(sim.local.solids.blocks[1].s0[0]).max()


@BOTH
def test_a_restart_knows_what_a_law_remembers(of: Any, tmp_path: Path) -> None:
    sim = Blocks()
    mesh = of((4, 2, 2), (1.0, 0.5, 0.5), shaken=0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, law(sim, "mises"), {**ROCK, "limit": 1e5})
    sim.option(collision=False)
    sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
    changes.set_velocity(sim, nodes_on(mesh, "right"), 1.0, 0.5, -1.0)
    convergence.advance(sim, 60)
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    for k in range(40):
        sim.step()
        if k == 10:
            sim.rebuild()
        other.step()
    for name in ("stress_xx", "velocity_z", "law_p12", "law_work"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name)), name
    assert diagnostics.values(sim, "law_work").max() > 0.0
    assert np.isnan(diagnostics.values(sim, "strain_energy")).all()


def test_states_are_in_frames_and_histories(tmp_path: Path) -> None:
    """Of a script with warm hexahedra."""
    shutil.copy(LAWS, tmp_path)
    text = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (1,1,1) cells 2 2 2 type hex
pcdc element c-model user 'rock.py:mises' property den 2000 young 1e9 poisson-ratio 0.2 parameter 'limit' 1e4
pcdc element property parameter 'limit' 2e4 range x 0 0.5
pcdc element c-model therm-iso-h property conductivity 3 capacity 1000 expansion-coeficient 1e-5
pcdc node initial temperature 20
pcdc node boundary therm-s-b-c temperature 40 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 5 range z 1 1
pcdc history create 'most' element value law-state variable 'work' maximum every 20
pcdc model step 100
pcdc output vtk 'f'
"""
    pcdc = run(tmp_path, text).namespace["pcdc"]
    frame = tables(tmp_path / "data" / "f_0000000100.vtkhdf")
    for name in ("law_p13", "law_work", "mean_temperature"):
        values = np.frombuffer(frame[f"VTKHDF/CellData/{name}"])[:48]
        assert np.array_equal(values, pcdc.values("element", name)) and values.any(), name
    most = history(tmp_path, "most")[:, 2]
    assert most[-1] == pcdc.values("element", "law_work").max() > 0.0 and (np.diff(most) >= 0.0).all()


@BOTH
def test_a_stiffer_law_has_shorter_steps(of: Any) -> None:
    steps = []
    for times in (1.0, 2.0):
        sim = body(of((2, 2, 2), (1.0, 1.0, 1.0)))
        changes.element_model(sim, None, law(sim, "mises"), {**ROCK, "times": times})
        sim.close_model()
        steps.append(sim.clock.dt)
    assert steps[1] == pytest.approx(steps[0] / np.sqrt(2.0), rel=1e-12)


def test_what_laws_cannot_do_in_space_is_refused(tmp_path: Path) -> None:
    plane = model(rectangle(1, 1, 1.0, 1.0))
    with pytest.raises(CommandError, match=r"rock.py:elastic is not for 2 dimensions: element_law\(dim=2\)"):
        changes.element_model(plane, None, law(plane, "elastic"), ROCK)
    sim = body(box((1, 1, 1), (1.0, 1.0, 1.0)))
    changes.element_model(sim, None, law(sim, "elastic"), ROCK)
    with pytest.raises(CommandError, match="the energy budget does not support the law"):
        diagnostics.account_energy(sim)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match="whose tangent is not known to the static solve"):
        equilibrium.solve_elastic(sim)
    for text, wrong in (
        ("@element_law(dim=4)\ndef odd(e11):", "dim of a law is 2 or 3, got 4"),
        ("@element_law(dim=3)\ndef odd(e11, e22, e12):", "does not accept e33, e13, e23"),
        ("@element_law()\ndef odd(e11, e22, e12, e33):", "'e33' is not an argument of a law"),
    ):
        (tmp_path / "odd.py").write_text(f"from hpcdem import element_law\n{text}\n    return e11\n")
        with pytest.raises(CommandError, match=wrong):
            law(sim, "odd", tmp_path / "odd.py")
