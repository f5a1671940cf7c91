"""Damping of nodes, stress along faces, contact by stiffness, fluid said of elements."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from tests.pcdc.test_excavation import Desk


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


BAR = """
pcdc element create brick p0 (0,0) p1 (4,0) p2 (0,1) n 8 2 triangle [tri]
pcdc element c-model mech-iso-e property den 2000 y 1e8 p-r 0.2
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc node initial velocity-x 0.01 range x 0.1 4
"""
CUBE = """
pcdc model new dim 3
pcdc element create brick p0 (0,0,0) p1 (4,0,0) p2 (0,1,0) p3 (0,0,1) n 8 2 2 triangle [tri]
pcdc element c-model mech-iso-e property den 2000 y 1e8 p-r 0.2
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc node initial velocity-x 0.01 range x 0.1 4
"""


def speed(desk: Desk) -> float:
    return float(np.abs(desk.pcdc.values("node", "velocity-x")).max())


@pytest.mark.parametrize("tri", [True, False])
@pytest.mark.parametrize("text", [BAR, CUBE])
def test_damping_of_nodes_takes_motion(tmp_path, text, tri):
    found = {}
    for words in ("", "local 0", "local 0.3", "local 0.3 range x 3.4 4"):
        line = f"pcdc node mechanical-damp {words}\n" if words else ""
        desk = Desk(tmp_path)(f"tri = {tri}\n" + text + line + "pcdc model time-step value 2e-4\npcdc model step 600\n")
        found[words] = np.array(desk.pcdc.values("node", "velocity-x")), speed(desk)
    assert (found[""][0] == found["local 0"][0]).all()  # without it there is none
    assert found["local 0.3"][1] < 0.5 * found[""][1]
    assert found["local 0.3"][1] < 0.8 * found["local 0.3 range x 3.4 4"][1]
    assert found["local 0.3 range x 3.4 4"][1] < 0.9 * found[""][1]


def test_one_step_is_the_formula(desk):
    """v + dt/m (F - a |F| sgn v): a falling node under gravity, up and down."""
    desk("""
pcdc element create brick p0 (0,0) p1 (1,0) p2 (0,1) n 1 1 triangle off
pcdc element c-model mech-iso-e property den 2000 y 1e8 p-r 0.2
pcdc model gravity (0,-10)
pcdc node initial velocity (0,-3)
pcdc node mechanical-damp local 0.25
pcdc model time-step value 1e-4
pcdc model step 1
""")
    assert np.array(desk.pcdc.values("node", "velocity-y")) == pytest.approx(np.full(4, -3.0 - 0.75e-3), rel=1e-12)
    desk("pcdc node initial velocity (0,3)\npcdc model step 1\n")
    assert np.array(desk.pcdc.values("node", "velocity-y")) == pytest.approx(np.full(4, 3.0 - 1.25e-3), rel=1e-12)


def test_the_time_step_goes_by_it(desk):
    desk("tri = True\n" + BAR + "pcdc model step 1\n")
    before = desk.blocks.clock.dt
    desk("pcdc node mechanical-damp local 0.69 range x 3 4\npcdc model step 1\n")
    assert desk.blocks.clock.dt == pytest.approx(before / 1.3, rel=1e-12)


@pytest.mark.parametrize("text", [BAR, CUBE])
def test_damping_of_nodes_is_saved(tmp_path, text):
    start = "tri = True\n" + text + "pcdc node mechanical-damp local 0.1 range x 2 4\npcdc model step 30\n"
    whole = Desk(tmp_path)(start + "pcdc model step 30\n")
    Desk(tmp_path)(start + "pcdc model save 'a.sav'\n")
    after = Desk(tmp_path)("pcdc model restore 'a.sav'\npcdc model step 30\n")
    assert (whole.pcdc.values("node", "velocity-x") == after.pcdc.values("node", "velocity-x")).all()


def test_conditions_go_and_damping_stays(desk):
    desk("tri = True\n" + BAR + "pcdc node mechanical-damp local 0.3 range x 0 1\npcdc node boundary remove\n"
         "pcdc node boundary apply mech-f-b-c force-x 1 range x 1 1\n")  # fmt: skip
    assert desk.blocks.most_damped() == 0.3


def test_the_budget_does_not_know_it(desk):
    desk("tri = True\n" + BAR + "pcdc node mechanical-damp local 0.3\n")
    with pytest.raises(HpcdemError, match="does not support local damping of nodes"):
        desk("pcdc model option energy on\n")
    desk("pcdc node mechanical-damp local 0\npcdc model option energy on\n")
    with pytest.raises(HpcdemError, match="does not support local damping of nodes"):
        desk("pcdc node mechanical-damp local 0.3\n")


BLOCK = """
pcdc element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 4 2 triangle [tri]
pcdc element c-model mech-iso-e property den 2500 y 2e9 p-r 0.25
pcdc model option dynamic off
"""


@pytest.mark.parametrize("tri", [True, False])
def test_pure_shear_by_stresses_along_faces(desk, tri):
    """Alternately with and against the outline: sigma_xy everywhere."""
    desk(
        f"tri = {tri}\n"
        + BLOCK
        + """
pcdc element-face boundary apply m-s-b-c dip 2e5 range boundary x 2 2
pcdc element-face boundary apply m-s-b-c dip -2e5 range boundary y 1 1
pcdc element-face boundary apply m-s-b-c dip 2e5 range boundary x 0 0
pcdc element-face boundary apply m-s-b-c dip -2e5 range boundary y 0 0
pcdc node boundary apply mech-m-b-c type 1 range x 0 0 y 0 0
pcdc node boundary apply mech-vel-b-c v-y 0 range x 2 2 y 0 0
pcdc model solve elastic
"""
    )
    values = desk.pcdc.values
    assert np.array(values("element", "stress-xy")) == pytest.approx(2e5, rel=1e-6)
    assert (
        np.abs(values("element", "stress-xx")).max() < 2e2 and np.abs(values("element", "stress-yy")).max() < 2e2
    )  # 2e5^2 / E by rotation


def test_a_shear_wave_through_a_quiet_face(tmp_path):
    """Half of the stress that is given enters: the velocity is tau / 2 over rho c_s... of what comes in, twice half."""
    desk = Desk(tmp_path)("""
pcdc element create brick p0 (0,0) p1 (20,0) p2 (0,0.5) n 80 1 triangle off
pcdc element c-model mech-iso-e property den 2000 y 5e7 p-r 0.25
pcdc node boundary apply mech-vel-b-c v-x 0
pcdc table 'on' data 0 0, 0.01 1e4, 1e9 1e4
pcdc element-face apply mech-abs-b-c dip table 'on' range x 20 20
pcdc model solve time 0.13
""")
    shear = 5e7 / 2.5
    c = math.sqrt(shear / 2000.0)
    at = desk.project.mesh.points[:, 0]
    v = np.array(desk.pcdc.values("node", "velocity-y"))
    passed = at > 20.0 - 0.5 * c * 0.13
    assert np.median(v[passed]) == pytest.approx(0.5 * 1e4 / (2000.0 * c), rel=0.02)


def test_contact_by_stiffness_is_contact_by_penalty(tmp_path):
    found = []
    for words in ("pen-n 2e9 pen-s 1e9", "normal-stiffness 2e9 shear-stiffness 1e9"):
        desk = Desk(tmp_path)(f"""
pcdc element create brick p0 (0,0) p1 (3,0) p2 (0,1) n 3 1
pcdc element create brick p0 (1,1.001) p1 (2,1.001) p2 (1,2.001) n 1 1
pcdc element c-model mech-iso-e property den 2500 y 1e9 p-r 0.25
pcdc element-face c-model c-m-c property friction 30 {words}
pcdc node boundary apply mech-m-b-c type 1 range y 0 0
pcdc node initial velocity (0.2,-2) range y 1.001 3
pcdc model step 60
""")
        found.append(np.array(desk.pcdc.values("node", "velocity-y")))
    assert (found[0] == found[1]).all() and np.abs(found[0]).max() > 0.0


HOSTILE = [
    ("element-face c-model c-m-c property friction 30 cohesion 1e5", "contacts have friction but no cohesion"),
    ("node mechanical-damp local 1.5", "from 0 to 1"),
    ("node mechanical-damp", "lacks l{ocal}"),
    ("element-face boundary m-s-b-c dip table 'no'", "there is no table 'no'"),
]


@pytest.mark.parametrize(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk("tri = True\n" + BLOCK + f"pcdc {line}\n")


def test_stress_along_faces_is_for_the_plane(desk):
    with pytest.raises(HpcdemError, match="two dimensions"):
        desk("tri = True\n" + CUBE + "pcdc element-face boundary m-s-b-c dip 1e5\n")
