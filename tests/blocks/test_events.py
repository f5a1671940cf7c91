"""Joints whose breaking is known: when, how, and with what kinetic energy."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import breaks, changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.kernels.joint_law import MODE
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import rectangle

DENSITY, LENGTH, DT = 2300.0, 0.4, 1e-6
T, C, PENALTY, GF1, GF2 = 3e6, 7e6, 2e11, 37.0, 410.0
AREA = 0.3863073
"""Integral of the softening function from 0 to 1, see the specification."""
O_P, S_P = 2.0 * LENGTH * T / PENALTY, 2.0 * LENGTH * C / PENALTY
O_T, S_T = GF1 / (AREA * T), GF2 / (AREA * C)
TILTED = math.radians(30.0)


def test_a_joint_that_breaks_in_creep_breaks_at_the_time_that_has_crept():
    """2 s at the last creep step, and 0.5 s of this one; both sides of the joint tell it."""
    local = SimpleNamespace(
        slot_state=np.full(2, BROKEN), slot_face=np.array([1, 6]), slot_history=np.full((2, MODE + 5), 3.0)
    )
    sim = SimpleNamespace(
        local=local, clock=SimpleNamespace(dt=7.0), rebuild_state=SimpleNamespace(time=9.0, step=3), comm=SerialComm(),
        broken=np.zeros(8, int), partner=np.array([0, 6, 0, 0, 0, 0, 1, 0]), options=SimpleNamespace(dynamic=False),
        reported_time=lambda: 2.0, creep=SimpleNamespace(passed=0.5),
    )  # fmt: skip
    (found,) = breaks.waiting(sim)
    assert (found.joint, found.mode, found.step, found.kinetic, found.time) == (1, 3.0, 3, 6.0, 2.5)


def pair(kind: str, turned: float = 0.0) -> Mesh:
    """Two quads (or two triangles) of edge LENGTH beside each other, the joint between them across x, all turned."""
    x = LENGTH
    if kind == "quad":
        points = np.array([(0, 0), (x, 0), (2 * x, 0), (0, x), (x, x), (2 * x, x)], float)
        cells = [(0, 1, 4, 3), (1, 2, 5, 4)]
    else:
        points = np.array([(0, 0), (x, 0), (x, x), (2 * x, x)], float)
        cells = [(0, 1, 2, -1), (1, 3, 2, -1)]
    c, s = math.cos(turned), math.sin(turned)
    return Mesh.of(points @ np.array([[c, s], [-s, c]]), cells)


def pulled(kind: str, speed: float, angle: float, turned: float = 0.0) -> Blocks:
    """Both elements are moved as rigid bodies: the right one away from the left one, which rests, at this angle to the
    normal of the joint."""
    sim = Blocks()
    sim.take_mesh(pair(kind, turned))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": DENSITY, "young": 50e9, "poisson_ratio": 0.2})
    law = {"tensile_strength": T, "cohesion": C, "friction": 20.0, "gf1": GF1, "gf2": GF2, "penalty_normal": PENALTY}
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", law)
    sim.time_step(value=DT)
    return sim


def run(sim: Blocks, speed: float, angle: float, turned: float, steps: int) -> None:
    """Corners of one node at the joint belong to both elements, so velocities are set before every step."""
    way = speed * math.cos(angle + turned), speed * math.sin(angle + turned)
    for _ in range(steps):
        sim.close_model()
        for row, number in enumerate(sim.number):
            v = np.tile(way if number == 1 else (0.0, 0.0), sim.v.shape[1] // 2)
            sim.v[row] = v
        # The forces of this step change velocities by far less than the rounding of what is compared.
        sim.step()


def expected(speed: float, angle: float) -> tuple[int, float]:
    """First step at which D = 1 and the mode there, of the closed forms: o = v t cos, s = v t sin."""
    step = 0
    while True:
        o, s = speed * DT * step * math.cos(angle), abs(speed * DT * step * math.sin(angle))
        d1, d2 = max(o - O_P, 0.0) / O_T, max(s - S_P, 0.0) / S_T
        if d1 * d1 + d2 * d2 >= 1.0:
            return step, 1.0 + d2 * d2 / (d1 * d1 + d2 * d2)
        step += 1


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize(
    "angle, turned", [(0.0, 0.0), (90.0, 0.0), (math.degrees(math.atan2(S_T, O_T)), 0.0), (55.0, 25.0)]
)
def test_one_joint(kind, angle, turned):
    """Opened: mode 1; slid: mode 2; both: between. The kinetic energy is that of the element that moves."""
    speed, angle, turned = 3.0, math.radians(angle), math.radians(turned)
    step, mode = expected(speed, angle)
    sim = pulled(kind, speed, angle, turned)
    run(sim, speed, angle, turned, step + 2)
    (found,) = zip(*(values.tolist() for values in diagnostics.events(sim).values()))
    seen = dict(zip(diagnostics.events(sim), found))
    assert abs(seen["step"] - step) <= 1  # rounding of 0.3863073 and of the positions
    assert seen["time"] == pytest.approx(seen["step"] * DT, rel=1e-12)
    assert seen["mode"] == pytest.approx(mode, abs=0.01)
    area = LENGTH**2 * (1.0 if kind == "quad" else 0.5)
    assert seen["kinetic"] == pytest.approx(0.5 * DENSITY * area * speed**2, rel=0.01)
    assert seen["length"] == pytest.approx(LENGTH)
    middle = pair(kind, turned).points[[1, 4 if kind == "quad" else 2]].mean(axis=0)
    assert (seen["x"], seen["y"]) == pytest.approx(middle.tolist())
    assert 0 < seen["peak_step"] < seen["step"]
    assert seen["peak_kinetic"] == pytest.approx(seen["kinetic"], rel=0.01)
    for name in ("mode", "break_time", "break_energy"):
        known = {"mode": seen["mode"], "break_time": seen["time"], "break_energy": seen["kinetic"]}[name]
        assert diagnostics.values(sim, name, [seen["joint"]])[0] == known


def torn(collision: bool = True) -> Blocks:
    """A strip that is pulled apart at speed: many joints break."""
    sim = Blocks()
    sim.take_mesh(rectangle(8, 3, 0.8, 0.3))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": DENSITY, "young": 20e9, "poisson_ratio": 0.2})
    law = {"tensile_strength": 1e6, "cohesion": 2e6, "friction": 20.0, "gf1": 1.0, "gf2": 3.0, "penalty_normal": 1e11}
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", law)
    sim.option(collision=collision)
    x = sim.the_mesh().points[:, 0]
    changes.set_velocity(sim, np.flatnonzero(x < 0.4), -0.5, 0.1)
    changes.set_velocity(sim, np.flatnonzero(x > 0.4), 0.5, -0.1)
    return sim


def test_events_do_not_depend_on_the_moment_of_queries(tmp_path):
    """Times are those of the clock at the step of breaking, also where the time step changes; looking at every step
    changes nothing, nor does a checkpoint between breaking and the next list."""
    quiet, looked = torn(), torn()
    clock = {0: 0.0}
    told: list = []
    for k in range(500):
        if k == 50:
            for sim in (quiet, looked):
                sim.time_step(safety=0.5)
        quiet.step()
        looked.step()
        clock[quiet.clock.step] = quiet.clock.time
        now = diagnostics.crack_rows(looked)
        assert now[: len(told)] == told  # what was told once stays as it was
        told = now
        if breaks.waiting(looked) and len(told) > 5 and not (tmp_path / "a.sav").exists():
            saved_state.save(looked, tmp_path / "a.sav")
            looked = Blocks()
            saved_state.restore(looked, tmp_path / "a.sav")
    assert (tmp_path / "a.sav").exists() and len(told) > 10
    assert diagnostics.crack_rows(quiet) == told
    for row in told:
        assert row.time == pytest.approx(clock[row.step], rel=1e-12)
        assert 0 < row.peak_step <= row.step and row.peak_kinetic >= 0.0
    assert {row.step > 50 for row in told} == {True, False}


def test_what_broken_joints_say_is_not_forgotten():
    """reset_joint_state is for joints that hold; those say nothing of breaking."""
    sim = torn()
    convergence.advance(sim, 400)
    rows = diagnostics.crack_rows(sim)
    joints = np.unique([row.joint for row in rows])
    names = "break_time", "break_energy", "mode"
    before = [diagnostics.values(sim, name, joints) for name in names]
    changes.reset_joint_state(sim)
    assert all((diagnostics.values(sim, name, joints) == known).all() for name, known in zip(names, before))
    assert diagnostics.crack_rows(sim) == rows
    whole = np.setdiff1d(sim.numbers_of_joints(None), joints)
    assert (
        np.isnan(diagnostics.values(sim, "break_time", whole)).all()
        and np.isnan(diagnostics.values(sim, "break_energy", whole)).all()
    )
    assert (diagnostics.values(sim, "mode", whole) == 0.0).all()
