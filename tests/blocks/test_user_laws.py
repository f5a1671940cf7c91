"""Laws of elements that users write: the same bits as the built-in law, what is refused and where, states."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state, user_laws
from hpcdem.physics.fdem.kernels.elements import PARTS
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.properties import MODELS
from hpcdem.physics.fdem.reference import deformation
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.laws import rock
from tests.blocks.support import ROCK, jointed, model, near, rectangle, shaken
from tests.blocks.test_yielding import deform
from tests.pcdc.test_plastic import run
from tests.tables import each

LAWS = Path(__file__).with_name("laws") / "rock.py"
STRESSES = ("stress_xx", "stress_yy", "stress_xy", "stress_zz")


def law(sim: Blocks, name: str) -> str:
    """A law of the file, by the name of its model."""
    return user_laws.load(sim, LAWS, f"rock.py:{name}").name


def clay(limit: float = 1e6, **options) -> Blocks:
    """A square metre of elements with a limit of shear stress, at rest."""
    sim = Blocks(**options)
    sim.take_mesh(shaken(rectangle(3, 3, 1.0, 1.0), 0.2))
    changes.element_model(sim, None, law(sim, "tresca"), {**ROCK, "limit": limit})
    sim.option(dynamic=False, collision=False)
    return sim


@pytest.mark.some_of_each
@pytest.mark.parametrize(
    "kind, part",
    [
        pytest.param("cross", 1.0, id="all-cross"),
        pytest.param("mixed", 1.0, id="all-mixed"),
        pytest.param("cross", 0.4, id="some-cross", marks=pytest.mark.slow),
        pytest.param("mixed", 0.4, id="some-mixed"),
    ],
)
@pytest.mark.parametrize("dynamic", [True, False], ids=["motion", "relaxation"])
def test_a_law_like_the_built_in_one_gives_its_bits(part, dynamic, kind):
    """In motion with joints that break and contact, and towards equilibrium; time step and masses too."""
    ends = []
    for own in (False, True):
        sim = model(shaken(rectangle(8, 5, 0.6, 0.4, kind=kind), 0.2))
        rock = {**ROCK, "damp_factor": 0.1, "friction": 20.0}
        changes.element_model(sim, None, "mech_iso_elastic", rock)
        if own:
            some = np.arange(int(part * len(sim.alive)))
            changes.element_model(sim, None if part == 1.0 else some, law(sim, "tresca"), {**rock, "limit": 1e20})
        jointed(sim, tensile_strength=5e5, gf1=5.0)
        sim.initial_stress(None, xx=-1e5, yy=2e5)
        sim.option(dynamic=dynamic)
        if dynamic:
            changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] < 0.3), 5.0, 1.0)
        else:
            sim.stress_condition(near(sim.mesh, 0, 0.6), xx=3e5)
        convergence.advance(sim, 400)
        ends.append([sim.x, sim.v, np.array(sim.clock.dt), *(diagnostics.values(sim, name) for name in STRESSES)])
        if dynamic:
            assert diagnostics.joint_counts(sim)[2] > 3
    for one, other in zip(*ends):
        assert np.array_equal(one, other)


def test_states_follow_the_law():
    """Simple shear up to twice the strain at the limit L / (2 G): slip is what is beyond it. Half of the way back is
    elastic. Frames, histories and fingerprints see the state that the stress of this moment belongs to."""
    shear = ROCK["young"] / 2.5
    sim, e = clay(), 1e6 / (2.0 * shear)
    sim.option(large_strain=False)
    deform(sim, [[1.0, 2.0 * 2.0 * e], [0.0, 1.0]])
    assert diagnostics.values(sim, "law_slip") == pytest.approx(np.full(18, e), rel=1e-6)
    assert diagnostics.values(sim, "stress_xy") == pytest.approx(np.full(18, 1e6), rel=1e-9)
    deform(sim, [[1.0, 2.0 * 1.5 * e], [0.0, 1.0]])
    assert diagnostics.values(sim, "law_slip") == pytest.approx(np.full(18, e), rel=1e-6)
    assert diagnostics.values(sim, "stress_xy") == pytest.approx(np.full(18, 0.5e6), rel=1e-6)
    assert np.isnan(diagnostics.values(sim, "strain_energy")).all()
    changes.reset_state(sim, np.arange(9))
    assert diagnostics.values(sim, "law_g12")[:9].tolist() != diagnostics.values(sim, "law_g12")[9:].tolist()


@pytest.mark.slow
def test_two_laws_give_the_bits_of_one():
    """Of two laws one runs in the loop over forces, of the other stress is found before it; which is which follows the
    number of elements. Beside them some that yield."""
    ends = []
    for some in (0, 5, 25):
        sim = model(shaken(rectangle(8, 5, 0.6, 0.4, kind="cross"), 0.2))
        weak = {**ROCK, "damp_factor": 0.1, "cohesion": 1e5, "tensile": 1e5}
        changes.element_model(sim, None, law(sim, "tresca"), {**ROCK, "limit": 2e5, "damp_factor": 0.1})
        changes.element_model(sim, np.arange(10), "mech_mohr_coulomb", weak)
        if some:
            again = {**ROCK, "limit": 2e5, "damp_factor": 0.1}
            changes.element_model(sim, np.arange(20, 20 + some), law(sim, "tresca_again"), again)
        sim.initial_stress(None, xx=-1e5, yy=1e5)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] < 0.3), 1.0, 0.5)
        convergence.advance(sim, 200)
        slip = diagnostics.values(sim, "law_slip")
        ends.append([sim.x, sim.v, slip, *(diagnostics.values(sim, name) for name in STRESSES)])
        assert (slip[10:] > 0.0).sum() > 10 and diagnostics.values(sim, "plastic_work").max() > 0.0
    for one, *others in zip(*ends):
        assert all(np.array_equal(one, other, equal_nan=True) for other in others)


def test_stress_found_within_the_loop_over_forces_is_that_found_before_it():
    """Of triangles and quads, bit by bit, some of them at the limit."""
    sim = model(shaken(rectangle(3, 2, 0.6, 0.4, kind="mixed"), 0.2))
    changes.element_model(sim, None, law(sim, "tresca"), {**ROCK, "limit": 2e5, "damp_factor": 0.1})
    sim.initial_stress(None, xx=-1e5, yy=1e5)
    sim.close_model()
    sim.open_model()
    sim.x[:, :8] += 1e-5 * np.sin(9.0 * sim.x[:, :8])
    changes.repeat(sim, sim.x)
    sim.close_model()
    local = sim.local
    assert all(local.laws.with_forces) and np.ptp(diagnostics.values(sim, "law_slip")) > 0.0
    within = sim.evaluate().force
    local.laws.with_forces = [None, None]
    local._bind()  # loops that read the stress before
    assert local.laws.before(0) and local.laws.before(1) and np.array_equal(sim.evaluate().force, within)


def test_a_quad_follows_the_law_in_each_of_its_triangles():
    """A bent quad, beside a plain computation: strain of each triangle with the volume of its overlay, the law, the
    mean pressure of the overlay, forces of both overlays by half."""
    sim = Blocks()
    sim.take_mesh(Mesh.of([(0.0, 0.0), (1.1, 0.1), (1.0, 0.9), (-0.1, 1.0)], [[0, 1, 2, 3]]))
    changes.element_model(sim, None, law(sim, "tresca"), {**ROCK, "limit": 1e6})
    sim.option(large_strain=False, collision=False)
    sim.initial_stress(None, xx=2e5, xy=-1e5)
    way = 1e-4 * np.array([(0.0, 0.3), (-1.0, 0.5), (0.4, -0.6), (0.2, 0.1)])
    sim.close_model()
    sim.open_model()
    sim.x[:, :8] += way.reshape(1, 8)
    changes.repeat(sim, sim.x)
    found = sim.evaluate().force[0].reshape(4, 2)
    mesh, two_mu = sim.mesh.points, ROCK["young"] / 1.25
    lame = ROCK["young"] * 0.25 / (1.25 * 0.5)
    force = np.zeros((4, 2))
    slips = []
    for overlay in (PARTS[:2], PARTS[2:]):
        parts = [deformation(mesh[k], mesh[k] + way[k], np.zeros((3, 2)), True) for k in overlay]
        areas = [0.5 * float(np.linalg.det(mesh[k][1:] - mesh[k][0])) for k in overlay]
        volume = np.average([np.trace(d.strain) for d in parts], weights=areas)
        stresses = []
        for d in parts:
            e = d.strain + 0.5 * (volume - np.trace(d.strain)) * np.eye(2)
            values = (e[0, 0], e[1, 1], e[0, 1], np.trace(e), 0.0, 0.0, 0.0, 2e5, 0.0, -1e5)
            s11, s22, s12, _, _, _, slip = rock.tresca.function(*values, lame + two_mu / 3.0, 0.5 * two_mu, 1e6)
            stresses.append(np.array([[s11, s12], [s12, s22]]))
            slips.append(slip)
        pressure = np.average([0.5 * np.trace(s) for s in stresses], weights=areas)
        for k, d, s in zip(overlay, parts, stresses):
            s = s + (pressure - 0.5 * np.trace(s)) * np.eye(2) + np.array([[2e5, -1e5], [-1e5, 0.0]])
            force[k] += -0.5 * d.area * d.gradients @ s
    assert found == pytest.approx(force, abs=1e-6 * np.abs(force).max())
    assert max(slips) > 0.0 and np.ptp(slips) > 0.0


def test_states_are_in_frames(tmp_path):
    shutil.copy(LAWS, tmp_path)
    text = """
pcdc mesh structured (0,0) (1,1) cells 3 3
pcdc element c-model user 'rock.py:tresca' property den 2000 young 1e9 poisson-ratio 0.2 parameter 'limit' 1e4
pcdc node boundary mech-vel-b-c velocity-x 5 range y 1 1
pcdc model step 100
pcdc output vtk 'f'
"""
    pcdc = run(tmp_path, text).namespace["pcdc"]
    frame = read_mesh_frame(tmp_path / "data" / "f_0000000100.vtkhdf")
    for name in ("law_g11", "law_g12", "law_slip"):
        assert np.array_equal(frame.of_elements[name], pcdc.values("element", name)) and frame.of_elements[name].any()


def test_initial_stress_reaches_the_law():
    """Half of the limit is there already."""
    shear = ROCK["young"] / 2.5
    sim, e = clay(), 1e6 / (2.0 * shear)
    sim.option(large_strain=False)
    sim.initial_stress(None, xy=0.5e6)
    deform(sim, [[1.0, 2.0 * e], [0.0, 1.0]])
    assert diagnostics.values(sim, "law_slip") == pytest.approx(np.full(18, 0.5 * e), rel=1e-6)
    assert diagnostics.values(sim, "stress_xy") == pytest.approx(np.full(18, 1e6), rel=1e-9)


def test_another_law_begins_with_its_initial_states():
    sim = clay()
    deform(sim, [[1.0, 0.01], [0.0, 1.0]])
    before = diagnostics.values(sim, "law_slip")
    assert (before > 0.0).all()
    sim.element_property(np.arange(4), {"limit": 2e6})  # the same law: it goes on
    assert (diagnostics.values(sim, "law_slip")[:4] > 0.0).all()
    changes.element_model(sim, np.arange(4, 8), law(sim, "flat"), ROCK)
    assert np.isnan(diagnostics.values(sim, "law_slip")[4:8]).all()
    sim.close_model()
    changes.element_model(sim, np.arange(4, 8), law(sim, "tresca"), {**ROCK, "limit": 1e12})
    assert (diagnostics.values(sim, "law_slip")[4:8] == 0.0).all()


def test_properties_of_a_law_alone_change_the_outcome():
    ends = []
    for limit in (1e6, 2e6):
        sim = clay(limit)
        deform(sim, [[1.0, 0.01], [0.0, 1.0]])
        ends.append(np.abs(diagnostics.values(sim, "stress_xy")).max())
    assert ends == pytest.approx([1e6, 2e6], rel=1e-3)


HEAD = "import math\nfrom hpcdem import Property, StateVariable, element_law\n\n"


def written(folder: Path, text: str) -> Path:
    (folder / "clay.py").write_text(HEAD + text)
    return folder / "clay.py"


@pytest.mark.slow
def test_the_time_step_follows_the_stiffness(tmp_path):
    """A bound that is four times that of the built-in law halves the time step; a number stands for a function."""
    plain = model(rectangle(4, 4, 1.0, 1.0))
    plain.option(collision=False)
    found = [diagnostics.critical_time_step(plain)]
    for stiffness in ("lambda bulk, shear: 4.0 * (bulk + 4.0 / 3.0 * shear)", "24e10"):
        text = (
            f"@element_law(stiffness={stiffness})\ndef law(e11, e22, e12, young):\n"
            "    return young * e11, young * e22, young * e12, 0.0\n"
        )
        sim = model(rectangle(4, 4, 1.0, 1.0))
        name = user_laws.load(sim, written(tmp_path, text), "clay.py:law").name
        changes.element_model(sim, None, name, ROCK)
        sim.option(collision=False)
        found.append(diagnostics.critical_time_step(sim))
    assert found[1] == pytest.approx(0.5 * found[0], rel=1e-12) == found[2]


def test_a_law_knows_the_time_step():
    """A clock as state variable: dt is added in motion, nothing at rest."""
    sim = model(rectangle(2, 2, 1.0, 1.0))
    changes.element_model(sim, None, law(sim, "flat"), ROCK)
    sim.option(dynamic=False)
    convergence.advance(sim, 5)
    assert (diagnostics.values(sim, "law_age") == 3.0).all()
    sim.option(dynamic=True)
    convergence.advance(sim, 5)
    assert diagnostics.values(sim, "law_age") == pytest.approx(np.full(8, 3.0 + 6.0 * sim.clock.dt), rel=1e-12)


LAW = "@element_law()\ndef law(e11, e22, e12, young):\n    "
WRONG = {
    "syntax": ("@element_law()\ndef law(e11, e22, e12:\n    return 0.0\n", "clay.py:5: '(' was never closed"),
    "a missing name": (LAW + "a = young\n    return a, yuong * e22, a, a\n", "clay.py:7: numba: NameError: name"),
    "text that fails": ("x = 1 / 0\n", "clay.py:4: ZeroDivisionError: division by zero"),
    "text that ends the program": ("import sys\nsys.exit(3)\n", "clay.py:5: sys.exit(3) would end the whole run"),
    "no such law": ("@element_law()\ndef other(e11, e22, e12):\n    return e11, e22, e12, e11\n",
                    "clay.py: there is no law 'law' in it; available: other"),
    "not declared": ("def law(e11, e22, e12):\n    return e11, e22, e12, e11\n", "clay.py:4: 'law' is not declared"),
    "no brackets": ("@element_law\ndef law(e11, e22, e12):\n    return e11, e22, e12, e11\n",
                    "clay.py: 'law' is not declared as a law"),
    "an unknown argument": (LAW.replace("young", "yuong") + "return e11, e22, e12, e11\n", "clay.py:4: 'yuong'"),
    "without a strain": (LAW.replace(" e12,", "") + "return e11, e22, e11, e11\n", "the law does not accept"),
    "a default": (LAW.replace("young", "young=1.0") + "return e11, e22, e11, e11\n", "clay.py:4: 'young=1.0': "),
    "wrong type": (LAW + "return young * e11, e22, e12, 0\n", "clay.py:4: the law must return s33 as a float"),
    "too few": (LAW + "return young * e11, e22, e12\n", "clay.py:4: the law must return 4 numbers (s11, s22, s12"),
    "one number": (LAW + "return young * e11\n", "clay.py:4: the law must return 4 numbers"),
    "typing": (LAW + "a = 1.0\n    b = 'x' + young\n    return a, a, a, a\n", "clay.py:7: numba: No implementation of"),
    "a plain function": ("def half(x):\n    return 0.5 * x\n\n" + LAW + "a = half(e11)\n    return a, a, a, a\n",
                         "clay.py:9: numba: Untyped global name 'half'"),
    "nan": (LAW + "a = young * e11 / math.sqrt(e11 * e11)\n    return a, 0.0, 0.0, 0.0\n",
            "clay.py:4: law 'law': s11 is nan at zero strain with young 5e+10"),
    "too steep": (LAW + "return 9.0 * young * e11, 0.0, 0.0, 0.0\n",
                  "clay.py:4: law 'law': ds11/de11 is 4.5e+11 Pa at zero strain, above its stiffness 6e+10 Pa"),
    "negative stiffness": (LAW.replace("()", "(stiffness=-1.0)", 1) + "return e11, e22, e12, 0.0\n",
                           "its stiffness must be a number above 0 (Pa), got -1"),
    "stiffness that fails": (LAW.replace("()", "(stiffness=lambda young: [][3])", 1) + "return e11, e22, e12, 0.0\n",
                             "its stiffness fails: IndexError"),
    "stiffness that ends it": (LAW.replace("()", "(stiffness=lambda young: exit())", 1) + "return e11, e22, e12, 0.0\n",
                               "its stiffness fails: sys.exit() would end the whole run"),
    "stiffness of nothing": (LAW.replace("()", "(stiffness=lambda limit: 1.0)", 1) + "return e11, e22, e12, 0.0\n",
                             "clay.py:4: stiffness accepts properties only, and 'limit' is not a property"),
    "an idle property": (LAW.replace("()", "([Property('limit', 'Pa', '')])", 1) + "return e11, e22, e12, 0.0\n",
                         "clay.py:4: property 'limit' is declared, but neither the law nor its stiffness uses it"),
    "a name of all solids": (LAW.replace("()", "([Property('young', 'Pa', '')])", 1) + "return e11, e22, e12, 0.0\n",
                             "clay.py:4: 'young' is reserved or declared twice"),
    "a state that is not taken": (LAW.replace("()", "(state=[StateVariable('a', '1')])", 1)
                                  + "return e11, e22, e12, 0.0, e11\n", "clay.py:4: the law does not accept a"),
    "an infinite state": (LAW.replace("()", "(state=[StateVariable('a', '1', '', math.inf)])", 1)
                          + "return e11, e22, e12, 0.0, e11\n", "its initial value inf is not finite"),
    "no property": (LAW.replace("()", "(['limit'])", 1) + "return e11, e22, e12, 0.0\n",
                    "clay.py:4: a property is declared by Property(...), got 'limit'"),
}  # fmt: skip


@each("case", WRONG)
def test_what_is_wrong_with_a_law_is_reported_by_file_and_line(case, tmp_path):
    text, message = WRONG[case]
    sim = model(rectangle(2, 2, 1.0, 1.0))
    with pytest.raises(CommandError) as caught:
        changes.element_model(sim, None, user_laws.load(sim, written(tmp_path, text), "clay.py:law").name, ROCK)
    assert message in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 300
    sim.step()  # the model is as it was


@pytest.mark.parametrize(
    "name, message",
    [("none.py:law", "none.py cannot be read: No such file"), ("clay.py", "a law is named 'file.py:function'"),
     ("clay.txt:law", "a law is named"), ("clay.py:a b", "a law is named")],
)  # fmt: skip
def test_names_of_laws(name, message, tmp_path):
    with pytest.raises(CommandError, match=message):
        user_laws.load(Blocks(), tmp_path / name.rpartition(":")[0], name)


def test_what_a_law_cannot_do_is_refused():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    diagnostics.account_energy(sim)
    with pytest.raises(CommandError, match=r"law rock\.py:elastic, whose stored and lost energy is not known"):
        changes.element_model(sim, None, law(sim, "elastic"), ROCK)
    diagnostics.account_energy(sim, False)
    changes.element_model(sim, [3], law(sim, "elastic"), ROCK)
    with pytest.raises(CommandError, match=r"law rock\.py:elastic of element 3, whose stored and lost energy"):
        diagnostics.account_energy(sim)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match=r"element 3 has the law rock\.py:elastic, whose tangent is not known"):
        equilibrium.solve_elastic(sim)
    for given, message in (
        ({}, "needs limit"),
        ({"limit": 0.0}, "limit must be > 0"),
        ({"limits": 1.0}, "no property"),
    ):
        with pytest.raises(CommandError, match=message):
            changes.element_model(sim, [3], law(sim, "tresca"), {**ROCK, **given})


SAND = """@element_law([Property('gain', '1', '')], [StateVariable('most', '1', 'largest volume strain', -1.0)])
def law(e11, e22, e12, evol, most, bulk, shear, gain):
    lame, two_mu = gain * (bulk - 2.0 / 3.0 * shear), gain * (2.0 * shear)
    p = lame * evol
    return p + two_mu * e11, p + two_mu * e22, two_mu * e12, p, max(most, evol)
"""


@pytest.mark.slow
def test_groups_with_laws_of_two_files(tmp_path, monkeypatch):
    """Each group has the law, properties and states of its file, in triangles and quads, across a checkpoint; one with
    the arithmetic of the built-in one gives its bits. What is missing or wrong is named by its file."""
    ends = []
    for own in (False, True):
        sim = model(shaken(rectangle(8, 5, 0.6, 0.4, kind="mixed"), 0.2))
        half = np.flatnonzero(sim.mesh.centroids()[:, 1] > 0.2)
        changes.element_model(sim, None, law(sim, "tresca"), {**ROCK, "limit": 2e5})
        if own:
            sand = user_laws.load(sim, written(tmp_path, SAND).rename(tmp_path / "sand.py"), "sand.py:law").name
            changes.element_model(sim, half, sand, {**ROCK, "gain": 1.0})
        else:
            changes.element_model(sim, half, "mech_iso_elastic", ROCK)
        sim.option(collision=False)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] < 0.3), 1.0, 0.5)
        convergence.advance(sim, 60)
        ends.append([sim.x.copy(), sim.v.copy()])
    assert all(np.array_equal(*both) for both in zip(*ends))
    slip, most = (diagnostics.values(sim, name) for name in ("law_slip", "law_most"))
    rest = np.setdiff1d(np.arange(len(slip)), half)
    assert np.isnan(slip[half]).all() and np.isnan(most[rest]).all()
    assert slip[rest].max() > 0.0 and (most[half] > -1.0).all() and np.ptp(most[half]) > 0.0
    sim.element_property(half, {"gain": 0.5})  # of one law alone
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 40)
    for name in ("law_slip", "law_most", "position_x", *STRESSES):
        found = [diagnostics.values(one, name) for one in (sim, again)]
        assert np.array_equal(*found, equal_nan=True), name
    monkeypatch.delitem(MODELS, sand)
    with pytest.raises(CommandError, match=r"the law sand\.py:law, which this script does not use"):
        saved_state.restore(Blocks(), tmp_path / "a.sav")
    (tmp_path / "sand.py").write_text(HEAD + SAND.replace("two_mu * e12, p,", "two_nu * e12, p,"))
    with pytest.raises(CommandError, match=r"sand\.py:8: numba: NameError: name 'two_nu'"):
        user_laws.load(sim, tmp_path / "sand.py", "sand.py:law")


def test_a_checkpoint_needs_the_law_with_the_same_text(tmp_path, monkeypatch):
    sim = clay()
    deform(sim, [[1.0, 0.01], [0.0, 1.0]])
    saved_state.save(sim, tmp_path / "a.sav")
    name = law(sim, "tresca")
    monkeypatch.delitem(MODELS, name)
    other = clay()  # the law is there again, and the state goes on
    saved_state.restore(other, tmp_path / "a.sav")
    for quantity in ("law_slip", "law_g11", *STRESSES):
        assert np.array_equal(diagnostics.values(sim, quantity), diagnostics.values(other, quantity)), quantity
    found = MODELS.pop(name)
    empty = Blocks()
    with pytest.raises(CommandError, match=r"the law rock\.py:tresca, which this script does not use"):
        saved_state.restore(empty, tmp_path / "a.sav")
    assert empty.mesh is None
    monkeypatch.setitem(MODELS, name[:-1] + "x", found)
    with pytest.raises(CommandError, match=r"but rock\.py has changed"):
        saved_state.restore(empty, tmp_path / "a.sav")
    monkeypatch.setitem(MODELS, name, found)
    assert math.isfinite(diagnostics.values(other, "law_slip").max())
