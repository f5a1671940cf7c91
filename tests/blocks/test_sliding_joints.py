"""Joints that slide, after Coulomb or Barton and Bandis: closed forms, the same in the plane and in space."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, PhysicsError, ScriptError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.joints import tables as joint_tables
from hpcdem.physics.fdem.kernels import joint_law, joint_points
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.properties import BARTON_BANDIS, COULOMB_JOINT, Model, Rows
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.kernels import PRESSURE
from hpcdem.physics.flow.model import Flow
from tests.blocks.support import ROCK, near, rectangle
from tests.flow.support import WATER
from tests.pcdc.fake import Bench
from tests.space.support import box, hexes

EDGE = 0.1
KINDS = ("cross", "quad", "box", "hexes")
SOME = [pytest.param(kind, marks=[pytest.mark.slow] * (kind in ("cross", "box"))) for kind in KINDS]
COULOMB = {
    "normal_stiffness": 1e10, "shear_stiffness": 4e9, "friction": 30.0, "cohesion": 1e5, "tensile_strength": 2e4,
    "dilation": 5.0, "dilation_limit": 2e-4,
}  # fmt: skip
ROUGH = {
    "normal_stiffness": 1e10, "shear_stiffness": 4e10, "closure_maximum": 2e-4, "residual_friction": 28.0, "jrc": 10.0,
    "jcs": 5e7,
}  # fmt: skip
PEAK = 0.1 / 500.0 * (10.0 / 0.1) ** 0.33
"""Path at the peak of ROUGH [m], Barton et al. 1985."""
SEEN = ("opening", "slip", "normal_stress", "shear_stress")


class Log(list[str]):
    """What is said once."""

    def warn_once(self, key: str, text: str) -> None:
        if not self:
            self.append(text)

    def info(self, text: str) -> None:
        pass


def law_of(model: Model, **values: float) -> tuple[np.ndarray, np.ndarray]:
    """Its rows of the tables."""
    rows = Rows()
    row = rows.row(model, model.complete(values))
    table, beyond = joint_tables(rows)
    return table[row], beyond[row]


def stack(kind: str, name: str, values: dict[str, float], young: float = 1e15, dynamic: bool = False) -> Blocks:
    """Two blocks with a joint between them, the lower one held from below; rigid beside the joint, if not said."""
    if kind in ("cross", "quad"):
        mesh = rectangle(1, 2, EDGE, 2.0 * EDGE, kind=kind)
    else:
        mesh = (box if kind == "box" else hexes)((1, 1, 2), (EDGE, EDGE, 2.0 * EDGE))
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": young, "poisson_ratio": 0.0})
    joints = sim.numbers_of_joints(None)
    between = (np.abs(mesh.points[mesh.face_points(joints)][:, :, -1] - EDGE) < 1e-9).all(axis=1)
    sim.joint_model(joints[between], name, values)
    sim.option(dynamic=dynamic, collision=False)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, -1] < 1e-9), **{f"v{axis}": 0.0 for axis in "xyz"[: sim.dim]})
    return sim


def of_joints(sim: Blocks, name: str) -> np.ndarray:
    """A quantity of the joints that have a model."""
    found = diagnostics.values(sim, name)
    return found[~np.isnan(diagnostics.values(sim, "state"))]


def move_top(sim: Blocks, along: float, across: float) -> np.ndarray:
    """Balance when the top has moved by these ways [m]; what `SEEN` is of the joint, slip and shear as sizes."""
    mesh = sim.the_mesh()
    ways = {"vx": along, "vy": across} if sim.dim == 2 else {"vx": along, "vy": 0.0, "vz": across}
    sim.velocity_condition(np.flatnonzero(mesh.points[:, -1] > 2.0 * EDGE - 1e-9), **ways)
    equilibrium.solve_elastic(sim)
    found = np.array([of_joints(sim, name) for name in SEEN])
    found[[1, 3]] = np.abs(found[[1, 3]])
    assert np.ptp(found, axis=1) == pytest.approx(0.0, abs=1e-3 * np.abs(found).max())
    return found.mean(axis=1)


@pytest.mark.parametrize("kind", SOME)
def test_closure(kind):
    """sigma_n = k_ni v / (1 - v / V_m), loading and unloading: 666 667 Pa at a quarter of V_m, 2 MPa at half of it."""
    sim = stack(kind, BARTON_BANDIS.name, ROUGH)
    for step, expected in ((-5e-5, -666666.67), (-5e-5, -2e6), (5e-5, -666666.67), (6e-5, 0.0), (-6e-5, -666666.67)):
        assert move_top(sim, 0.0, step)[2] == pytest.approx(expected, rel=1e-4, abs=1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_shear_with_friction_and_dilation(kind):
    """Held across at k_n 8e-5 m = 0.8 MPa: sticks up to c + sigma tan(phi), then sliding by dp lifts it by
    tan(psi) dp up to the limit, and back it sticks again. Torn open it has neither strength nor cohesion."""
    sim = stack(kind, COULOMB_JOINT.name, COULOMB)
    assert move_top(sim, 0.0, -8e-5)[2] == pytest.approx(-8e5, rel=1e-4)
    assert move_top(sim, 1e-4, 0.0)[2:] == pytest.approx([-8e5, 4e5], rel=1e-4)
    tan, rise = math.tan(math.radians(30.0)), 1e10 * math.tan(math.radians(5.0))
    path = (4e9 * 2e-4 - 1e5 - 8e5 * tan) / (4e9 + rise * tan)
    pressure = 8e5 + rise * path
    assert move_top(sim, 1e-4, 0.0)[2:] == pytest.approx([-pressure, 1e5 + pressure * tan], rel=1e-4)
    pressure = 8e5 + rise * 2e-4
    assert move_top(sim, 4e-4, 0.0)[2:] == pytest.approx([-pressure, 1e5 + pressure * tan], rel=1e-4)
    assert set(of_joints(sim, "state")) == {2.0}
    assert move_top(sim, -5e-5, 0.0)[3] == pytest.approx(1e5 + pressure * tan - 2e5, rel=1e-4)
    assert move_top(sim, 0.0, 1e-3)[2:] == pytest.approx([0.0, 0.0], abs=1.0)
    assert of_joints(sim, "damage").min() == 1.0
    closed = move_top(sim, 0.0, -1e-3)
    assert closed[2:] == pytest.approx([-pressure, 0.0], rel=1e-4, abs=20.0)
    assert move_top(sim, 1e-3, 0.0)[3] == pytest.approx(pressure * tan, rel=1e-4)


@pytest.mark.parametrize("kind", ["quad", "hexes"])
def test_a_rough_joint_sheared(kind):
    """On every point of the way tau = sigma_n tan(phi_r + m JRC log10(JCS / sigma_n)) at the path, slip - tau / k_s."""
    sim = stack(kind, BARTON_BANDIS.name, ROUGH)
    move_top(sim, 0.0, -5e-5)
    before = -5e-5
    for _ in range(12):
        opening, slip, sigma, tau = move_top(sim, 2e-4, 0.0)
        way = (slip - tau / 4e10) / PEAK
        rough = 10.0 * math.log10(5e7 / -sigma)
        m = np.interp(way, [0.3, 0.6, 1.0, 2.0, 4.0], [0.0, 0.75, 1.0, 0.85, 0.7])
        angle = 28.0 + m * rough if way > 0.3 else 28.0 * way / 0.3
        assert tau == pytest.approx(-sigma * math.tan(math.radians(angle)), rel=1e-3)
        assert opening == pytest.approx(before, abs=1e-8)  # held across: dilation shows in the pressure
    assert way > 2.0 and -sigma > 2.0 * 666667.0


@pytest.mark.parametrize("kind", ["quad", pytest.param("box", marks=pytest.mark.slow)])
def test_a_rough_joint_sheared_at_once(kind):
    """Of 3 mm, in one increment of the static solve as in forty: dilation follows the path within it, up to 38.5 MPa
    (forty thousand steps of the law alone). With the dilation of its beginning there was none: 0.667 MPa."""
    law, beyond = law_of(BARTON_BANDIS, **ROUGH)
    stays = own = path = 0.0
    for slip in np.linspace(0.0, 3e-3, 40001):
        sigma, tau, more, own, path = joint_law.slide(-5e-5, slip - stays, law, beyond, own, path)
        stays += more
    for parts in (1, 40):
        sim = stack(kind, BARTON_BANDIS.name, ROUGH)
        move_top(sim, 0.0, -5e-5)
        for _ in range(parts):
            found = move_top(sim, 3e-3 / parts, 0.0)
        assert found[2:] == pytest.approx([sigma, tau], rel=0.02)
    assert sigma == pytest.approx(-38.5e6, rel=0.01)


def driven(law: np.ndarray, beyond: np.ndarray, pressure: float, slips: np.ndarray) -> np.ndarray:
    """Shear stress and opening by dilation (n, 2) under a constant pressure, the opening found for each slip."""
    stays = own = path = 0.0
    out = []
    for slip in slips:
        low, high = -2e-4, 1e-3
        for _ in range(60):
            o = 0.5 * (low + high)
            sigma, tau, more, new, way = joint_law.slide(o, slip - stays, law, beyond, own, path)
            low, high = (o, high) if -sigma > pressure else (low, o)
        stays, own, path = stays + more, new, way
        out.append((tau, own))
    return np.array(out)


def test_peak_and_dilation():
    """Under 1 MPa the peak is tan(28 + 10 log10(50)) = 1.026 at the path of the peak, 0.914 mm; dilation adds
    tan(m i / 2) over the path. Numbers from the formulas by hand."""
    law, beyond = law_of(BARTON_BANDIS, **ROUGH)
    slips = np.linspace(0.0, 4e-3, 1601)
    tau, opened = driven(law, beyond, 1e6, slips).T
    peak = int(tau.argmax())
    assert tau[peak] == pytest.approx(1e6 * math.tan(math.radians(28.0 + 10.0 * math.log10(50.0))), rel=2e-3)
    assert slips[peak] - tau[peak] / 4e10 == pytest.approx(PEAK, rel=0.01)
    assert PEAK == pytest.approx(9.14e-4, rel=1e-3)
    path = np.linspace(0.0, slips[-1] - tau[-1] / 4e10, 20001)
    m = np.interp(path / PEAK, [0.3, 0.6, 1.0, 2.0, 4.0, 10.0], [0.0, 0.75, 1.0, 0.85, 0.7, 0.5])
    slope = np.tan(np.radians(0.5 * m * 10.0 * math.log10(50.0)))
    expected = float((0.5 * (slope[1:] + slope[:-1]) * np.diff(path)).sum())
    assert opened[-1] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("model, values", [(COULOMB_JOINT, COULOMB), (BARTON_BANDIS, ROUGH)], ids=["coulomb", "rough"])
def test_slopes_and_energy(model, values):
    """Slopes against differences; what is stored is the work of an elastic way."""
    law, beyond = law_of(model, **values)
    rng = np.random.default_rng(3)
    for _ in range(200):
        o, s, path = rng.uniform(-1.5e-4, 0.0), rng.uniform(0.0, 3e-4), float(rng.choice([0.0, 4e-4, 9e-4, 3e-3]))
        own = float(rng.choice([0.0, 1.0])) if model is COULOMB_JOINT else rng.uniform(0.0, 2e-5)
        found = np.array(joint_law.slide_slopes(o, s, law, beyond, own, path)[:4])
        found[3] -= joint_law.LEAST * law[joint_law.K_S]
        ends = [
            np.array(joint_law.slide(o + a, s + b, law, beyond, own, path)[:2])
            for a, b in ((1e-10, 0.0), (-1e-10, 0.0), (0.0, 1e-10), (0.0, -1e-10))
        ]
        by_o, by_s = (ends[0] - ends[1]) / 2e-10, (ends[2] - ends[3]) / 2e-10
        assert found == pytest.approx([by_o[0], by_s[0], by_o[1], by_s[1]], rel=1e-3, abs=2e-5 * law[joint_law.K_S])
    closing = np.linspace(0.0, -1.2e-4, 4001)
    sigma = np.array([joint_law.slide(o, 0.0, law, beyond, 0.0, 0.0)[0] for o in closing])
    done = float((0.5 * (sigma[1:] + sigma[:-1]) * np.diff(closing)).sum())
    assert joint_law.slide_stored(closing[-1], 0.0, law, beyond, 0.0, 0.0) == pytest.approx(done, rel=1e-5)


def test_past_the_strength_of_its_walls_the_closure_is_a_line():
    """Also far beyond the largest closure the stress is finite; its slope is the one the time step is found by."""
    law, beyond = law_of(BARTON_BANDIS, **ROUGH)
    slope = 1e10 * (1.0 + 5e7 / (1e10 * 2e-4)) ** 2
    at = 5e7 * 2e-4 / (1e10 * 2e-4 + 5e7)
    for v in (at, 1.5 * at, 1e-3):
        sigma = joint_law.slide(-v, 0.0, law, beyond, 0.0, 0.0)[0]
        assert -sigma == pytest.approx(5e7 + slope * (v - at), rel=1e-9)


@pytest.mark.parametrize("kind", ["quad", pytest.param("hexes", marks=pytest.mark.slow)])
def test_a_block_on_an_incline(kind):
    """It rests below the friction angle; above it slides down with g (sin - cos tan(phi)), and the energy closes."""
    values = {**COULOMB, "cohesion": 0.0, "tensile_strength": 0.0, "dilation": 0.0}
    speeds = []
    for angle in (29.0, 35.0):
        sim = stack(kind, COULOMB_JOINT.name, values, young=1e8, dynamic=True)
        pull = 9.81 * math.sin(math.radians(angle)), -9.81 * math.cos(math.radians(angle))
        sim.gravity(*(pull if sim.dim == 2 else (pull[0], 0.0, pull[1])))
        sim.element_property(None, {"damp_factor": 1.0})
        diagnostics.account_energy(sim)
        sim.close_model()
        top = sim.the_mesh().points[:, -1] > EDGE + 1e-9
        found = []
        for _ in range(2):
            convergence.advance(sim, 3000)
            found.append(diagnostics.values(sim, "velocity_x")[top].mean())
        speeds.append((found[1] - found[0]) / (3000.0 * sim.clock.dt))
        assert diagnostics.energies(sim)["relative"] < 1e-3
    assert abs(speeds[0]) < 0.05
    expected = 9.81 * (math.sin(math.radians(35.0)) - math.cos(math.radians(35.0)) * math.tan(math.radians(30.0)))
    assert speeds[1] == pytest.approx(expected, rel=0.02)
    assert diagnostics.energies(sim)["joints_lost"] > 0.0


@pytest.mark.parametrize("kind", ["cross", "box"])
def test_a_run_that_continues_in_mid_slip(kind, tmp_path):
    """The same bits, with dilation under way; and static solves go on from what a dynamic run has left."""

    def begin() -> Blocks:
        sim = stack(kind, BARTON_BANDIS.name, ROUGH, young=1e9, dynamic=True)
        points = sim.the_mesh().points
        sim.velocity_condition(np.flatnonzero(points[:, -1] > 2.0 * EDGE - 1e-9), vx=2.0)
        sim.gravity(*((0.0, -1e4) if sim.dim == 2 else (0.0, 0.0, -1e4)))
        sim.close_model()
        convergence.advance(sim, 300)
        return sim

    straight, other = begin(), Blocks()
    saved_state.save(straight, tmp_path / "middle.sav")
    saved_state.restore(other, tmp_path / "middle.sav")
    for sim in (straight, other):
        convergence.advance(sim, 200)
    assert of_joints(straight, "state").max() == 2.0 and of_joints(straight, "slip").any()
    for name in (*SEEN, "velocity_x", "displacement_x"):
        assert np.array_equal(diagnostics.values(straight, name), diagnostics.values(other, name), equal_nan=True), name


def test_another_law_forgets_what_the_first_remembered():
    """What stays of the slip belongs to the law."""
    sim = stack("quad", COULOMB_JOINT.name, COULOMB)
    move_top(sim, 0.0, -8e-5)
    move_top(sim, 4e-4, 0.0)
    joints = np.flatnonzero(sim.slides())
    sim.joint_model(joints[:1], BARTON_BANDIS.name, ROUGH)
    move_top(sim, 0.0, 0.0)
    assert diagnostics.values(sim, "state").tolist() == [2.0]
    expected = joint_law.slide(-8e-5, 4e-4, *law_of(BARTON_BANDIS, **ROUGH), 0.0, 0.0)[0]  # from its own beginning
    assert diagnostics.values(sim, "normal_stress")[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("kind", SOME)
def test_forgetting_damage_leaves_stress_as_it_is(kind):
    """What has slid stays so, without a jump of the shear stress; what was torn holds again."""
    for name, values in ((COULOMB_JOINT.name, COULOMB), (BARTON_BANDIS.name, ROUGH)):
        sim = stack(kind, name, values)
        move_top(sim, 0.0, -8e-5)
        tau = move_top(sim, 8e-4, 0.0)[3]
        before = move_top(sim, -0.9 * tau / values["shear_stiffness"], 0.0)
        assert before[3] == pytest.approx(0.1 * tau, rel=0.05)
        changes.reset_joint_state(sim)
        assert move_top(sim, 0.0, 0.0) == pytest.approx(before, rel=1e-6)
    sim = stack(kind, COULOMB_JOINT.name, COULOMB)
    move_top(sim, 0.0, 1e-4)
    assert of_joints(sim, "damage").max() == 1.0
    changes.reset_joint_state(sim)
    assert of_joints(sim, "damage").max() == 0.0
    assert move_top(sim, 0.0, -1e-4 + 1e-6)[2] == pytest.approx(1e4, rel=1e-3)  # k_n 1e-6 m, below 2e4


def wedge(name: str, values: dict[str, float]) -> Blocks:
    """A triangle of a square metre in a notch of 45 degrees, pressed into it by its weight."""
    points = [(-1, 0), (0, -1), (0, 0), (1, 0), (-1, -1.5), (0, -1.5), (1, -1.5)]
    mesh = Mesh.of(np.array(points, float), [(0, 1, 2, -1), (2, 1, 3, -1), (4, 5, 1, 0), (5, 6, 3, 1)])
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e13, "poisson_ratio": 0.0})
    joints = sim.numbers_of_joints(None)
    x, y = np.moveaxis(mesh.points[mesh.face_points(joints)], -1, 0)
    sim.joint_model(joints[(np.abs(np.abs(x) - (y + 1.0)) < 1e-9).all(axis=1)], name, values)
    sim.option(dynamic=False, collision=False)
    sim.velocity_condition([4, 5, 6], vx=0.0, vy=0.0)
    sim.gravity(0.0, -1000.0)
    return sim


@pytest.mark.parametrize("friction", [15.0, 25.0])
def test_a_wedge_on_two_joints(friction):
    """W = 2 (N + T) cos(45): T = N tan(phi) where it slides, else N k_s / k_n, as it goes straight down."""
    values = {**COULOMB, "friction": friction, "cohesion": 0.0, "tensile_strength": 0.0, "dilation": 0.0}
    weight, tan = 1000.0 * ROCK["density"], math.tan(math.radians(friction))
    normal = weight / math.sqrt(2.0) / (1.0 + min(tan, 0.4))
    for at_rest in (True, False):
        sim = wedge(COULOMB_JOINT.name, values)
        if at_rest:
            equilibrium.solve_elastic(sim)
        else:
            assert convergence.solve(sim, ratio=1e-7, cycles=20000).reason == "ratio"
        sigma, tau = of_joints(sim, "normal_stress"), np.abs(of_joints(sim, "shear_stress"))
        # relaxation comes to rest from below, where it has slid too far
        assert -math.sqrt(2.0) * sigma == pytest.approx([normal] * 2, rel=1e-3 if at_rest else 5e-3)
        assert (tau - sigma).sum() == pytest.approx(weight, rel=1e-5)


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_fluid_takes_from_the_strength(kind):
    """Explicit steps: tau = (sigma - p) tan(phi) under a load of 1 MPa and 0.4 MPa in the channel, whose aperture is
    what the joint is opened, beside the initial one."""
    values = {**COULOMB, "friction": 15.0, "cohesion": 0.0, "tensile_strength": 0.0, "dilation": 3.0}
    sim = stack(kind, COULOMB_JOINT.name, values, young=1e9, dynamic=True)
    mesh, flow = sim.the_mesh(), Flow.of(sim)
    flow.assign(np.flatnonzero(sim.slides()), {**WATER, "fluid_bulk": 1e6, "aperature_initial": 1e-4})
    flow.prescribe(np.flatnonzero(np.abs(mesh.points[:, 1] - EDGE) < 1e-9), PRESSURE, 4e5)
    sim.stress_condition(near(mesh, 1, 2.0 * EDGE), yy=-1e6)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] > 2.0 * EDGE - 1e-9), vx=0.05)
    sim.element_property(None, {"damp_factor": 0.8})
    convergence.advance(sim, 3000)
    tau, sigma = np.abs(of_joints(sim, "shear_stress")).mean(), -of_joints(sim, "normal_stress").mean()
    assert tau == pytest.approx(6e5 * math.tan(math.radians(15.0)), rel=5e-3)
    assert sigma == pytest.approx(6e5, rel=5e-3)
    opening = of_joints(sim, "opening")
    assert opening[0] > -sigma / 1e10 + 1e-5  # it has dilated
    assert flow.apertures() == pytest.approx(1e-4 + opening, rel=1e-6)


def test_words_of_scripts(tmp_path):
    """Under 1 MPa closure is sigma / k_n = 0.1 mm, then, as a rough joint, sigma / (k_n + sigma / V_m) = 0.0667 mm."""
    bench = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))
    bench("""\
pcdc mesh structured (0,0) (1,1) cells 2 2
pcdc element c-model mech-iso-e property density 2650 young 30e9 poisson-r 0
pcdc face-joint c-model j-m-c property normal-stiffness 1e10 s-s 4e9 friction 30 range y 0.5 0.5
pcdc face-joint property dilation 5 dilation-limit 1e-3 cohesion 1e5 tensile-strength 1e4 range y 0.5 0.5
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y 0 0
pcdc element-face boundary mech-stress-b-c stress-yy -1e6 range y 1 1
pcdc history create 'closed' joint value opening mean every 1 range y 0.5 0.5
pcdc model option dynamic off large-strain off
pcdc model solve elastic
first = pcdc.values('joint', 'opening', y=(0.5, 0.5))
pcdc face-joint c-model j-b-b property n-s 1e10 s-s 4e9 closure-maximum 2e-4 r-f 28 jrc 10 jcs 5e7 range y 0.5 0.5
pcdc face-joint property jrc 8 joint-size 0.5 dilation-part 0.4 range y 0.5 0.5
pcdc model solve elastic
second = pcdc.values('joint', 'opening', y=(0.5, 0.5))
jrc = pcdc.values('joint', 'jrc', y=(0.5, 0.5))
""")
    assert bench["first"] == pytest.approx(np.full(2, -1e-4), rel=1e-4)
    assert bench["second"] == pytest.approx(np.full(2, -1e6 / 1.5e10), rel=1e-4)
    assert bench["jrc"].tolist() == [8.0, 8.0]
    for words, why in (
        ("gf1 10", "joint-barton-bandis has no property gf1"),
        ("jrc 25", "a number from 0 to 20 for 'jrc'"),
        ("jcs table 't' over temperature", "read 'temperature', expected one of x, y"),
    ):
        with pytest.raises(ScriptError, match=why):
            bench(f"pcdc table create 't' values (0,1) (1,1)\npcdc face-joint property {words} range y 0.5 0.5\n")


@pytest.mark.parametrize("kind", ["quad", "hexes"])
def test_sides_that_have_left_each_other(kind):
    """From a tenth of the edge the log says it, where and how far; beyond the whole of it there is no balance and no
    step any more, and the model of the static solve is as it was."""
    sim, said = stack(kind, COULOMB_JOINT.name, {**COULOMB, "dilation": 0.0}), Log()
    sim.log = said
    move_top(sim, 0.0, -8e-5)
    move_top(sim, 9e-3, 0.0)
    assert not said
    move_top(sim, 2e-3, 0.0)
    place = r"\(0.05, 0.1\)" if kind == "quad" else r"\(0.0\d+, 0.0\d+, 0.1\)"
    assert len(said) == 1
    assert re.search(
        rf"face-joint \d+ \(joint-mohr-coulomb\) at {place} has slipped or opened by 0.011 m, 0.11 of its size", said[0]
    )
    with pytest.raises(CommandError, match=r"0\.111 m, 1\.1 of its size.*the run stops"):
        move_top(sim, 0.1, 0.0)
    assert of_joints(sim, "slip") == pytest.approx(np.copysign(0.011, of_joints(sim, "slip")), rel=1e-3)
    other = stack(kind, COULOMB_JOINT.name, COULOMB, young=1e9, dynamic=True)
    top = np.flatnonzero(other.the_mesh().points[:, -1] > EDGE + 1e-9)
    other.velocity_condition(top, **{f"v{'xyz'[other.dim - 1]}": 100.0})
    with pytest.raises(PhysicsError, match=r"face-joint .* has slipped or opened by .* m, "):
        convergence.advance(other, 20000)


@pytest.mark.parametrize("model, values", [(COULOMB_JOINT, COULOMB), (BARTON_BANDIS, ROUGH)], ids=["coulomb", "rough"])
def test_cracks_cannot_slide_by_such_a_law(model, values):
    """Their sides are free: the law would be silent. Nor do such joints become cracks."""
    sim = Blocks()
    sim.take_mesh(rectangle(1, 2, EDGE, 2.0 * EDGE, kind="quad"))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    joint = sim.numbers_of_joints(None)
    sim.joint_model(None, model.name, values)
    with pytest.raises(CommandError, match=rf"face-joint {joint[0]} \(1 in all\) has the model joint-.*never break"):
        changes.crack(sim, joint)
    sim.open_faces(joint)
    with pytest.raises(CommandError, match=rf"face-joint {joint[0]} at \(0.05, 0.1\) is a crack \(1 in all\).*embed"):
        sim.joint_model(None, model.name, values)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", SOME)
def test_one_side_is_removed_and_put_back(kind):
    """The joint is gone with it, without a word of NumPy, and what comes back hangs together without it."""
    sim = stack(kind, COULOMB_JOINT.name, COULOMB, young=1e9, dynamic=True)
    convergence.advance(sim, 20)
    top = np.flatnonzero(sim.the_mesh().centroids()[:, -1] > EDGE)
    for change in (lambda: changes.null(sim, top), lambda: changes.element_model(sim, top, "mech_iso_elastic", ROCK)):
        change()
        convergence.advance(sim, 20)
        assert not sim.slides().any() and np.isnan(diagnostics.values(sim, "normal_stress")).all()


def test_what_makes_no_sense_is_refused():
    with pytest.raises(CommandError, match="dilation must not be above friction"):
        COULOMB_JOINT.complete({**COULOMB, "dilation": 31.0})
    with pytest.raises(CommandError, match="joint_barton_bandis needs jcs"):
        BARTON_BANDIS.complete({name: value for name, value in ROUGH.items() if name != "jcs"})


def test_implicit_steps_with_fluid_are_refused():
    sim = stack("quad", COULOMB_JOINT.name, COULOMB, young=1e9, dynamic=True)
    Flow.of(sim).assign(np.flatnonzero(sim.slides()), {**WATER, "aperature_initial": 1e-4})
    with pytest.raises(CommandError, match=r"\(1 in all\) has the model joint-mohr-coulomb: implicit steps of blocks"):
        Coupled(sim, 1.0)


@pytest.mark.parametrize(("o", "s"), [(-1e-6, 0.0), (-1e-6, 2e-6), (1e-6, 0.0), (1e-3, 1e-3)])
def test_what_a_point_after_coulomb_gives_back(o: float, s: float):
    """The energy of two springs as long as it sticks, none where it has torn off."""
    law, beyond = law_of(COULOMB_JOINT, **COULOMB)
    torn = o > 1e-4
    expected = 0.0 if torn else 0.5 * 1e10 * o * o + 0.5 * 4e9 * s * s
    assert joint_law.slide_stored(o, s, law, beyond, 0.0, 0.0) == pytest.approx(expected, rel=1e-12)


def test_what_a_bent_joint_gives_back():
    """Closed by e at its ends: L k (e_a^2 + e_a e_b + e_b^2) / 6 in the plane."""
    law, beyond = law_of(COULOMB_JOINT, **COULOMB)
    a, b = 1e-6, 3e-6
    x = np.array([0.0, 0.0, 2.0, 0.0, 0.0, a, 2.0, b])
    history, out, row = np.zeros((1, 14)), np.zeros(1), np.zeros(1, int)
    args = row, np.array([[0, 2]]), np.array([[6, 4]]), np.array([0.5]), row, row, history
    joint_points.stored(*args, x, law[None, :], beyond[None, :], out)
    assert out[0] == pytest.approx(2.0 * 1e10 * (a * a + a * b + b * b) / 6.0, rel=1e-5)
