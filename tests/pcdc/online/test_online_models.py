"""Whole models in the words of PCDC's online help come to the same bits as their twins in hpcdem's words."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.fdem import diagnostics
from tests.pcdc.test_excavation import Desk

SCRIPTS = Path(__file__).with_name("scripts")


def run(folder: Path, name: str) -> Desk:
    folder.mkdir(exist_ok=True)
    for file in SCRIPTS.glob("*.inp"):
        shutil.copy(file, folder)
    return Desk(folder)((SCRIPTS / f"{name}.sc").read_text("utf-8"))


def both(folder: Path, name: str) -> Desk:
    """The model in the vendor's words, after a look at its twin."""
    one, other = run(folder / "one", name), run(folder / "other", f"{name}_own")
    assert one.project.step == other.project.step > 0 or "thermal" in (SCRIPTS / f"{name}.sc").read_text("utf-8")
    assert one.blocks.clock.time == other.blocks.clock.time
    assert (one.project.mesh.points == other.project.mesh.points).all()
    assert (one.project.mesh.cells == other.project.mesh.cells).all()
    axes = "xyz"[: one.project.dim]
    for kind, names in (("node", [f"{what}-{axis}" for what in ("position", "velocity") for axis in axes]),
                        ("element", [f"stress-{a}{b}" for a in axes for b in axes if a <= b])):  # fmt: skip
        for quantity in names:
            found, wanted = (np.array(desk.pcdc.values(kind, quantity)) for desk in (one, other))
            assert (found == wanted).all(), quantity
    assert diagnostics.joint_counts(one.blocks) == diagnostics.joint_counts(other.blocks)
    return one


def test_uniaxial(tmp_path):
    desk = both(tmp_path, "uniaxial")
    assert diagnostics.joint_counts(desk.blocks)[2] > 5


def test_brazilian(tmp_path):
    desk = both(tmp_path, "brazilian")
    x, state = (np.array(desk.pcdc.values("joint", name)) for name in ("opening", "state"))
    assert diagnostics.joint_counts(desk.blocks)[2] > 0 and np.nanmax(x) > 0.0 and len(state)


def test_slope_with_a_lake(tmp_path):
    desk = both(tmp_path, "slope")
    weight = 2000 * 9.8 * (30 * 4 + 0.5 * 10 * 10 + 12 * 10)
    below = desk.pcdc.total("node", "reaction-y", y=(0, 0))
    water = 1000 * 9.8 * (8 * 5 + 0.5 * 5 * 5)  # over the flat part and the slope below the lake
    assert below == pytest.approx(weight + water, rel=2e-3)


def test_tunnel_with_bolts(tmp_path):
    desk = both(tmp_path, "tunnel")
    force = np.array(desk.pcdc.values("bolt-element", "axial-force"))
    assert len(force) == 15 and np.abs(force).max() > 1e3


def test_seepage_through_a_dam(tmp_path):
    desk = both(tmp_path, "seepage")
    pressure = np.array(desk.pcdc.values("flow-node", "pressure"))
    at = desk.project.mesh.points[desk.pcdc.numbers("flow-node")]
    x, y = at.T
    for face, level in ((np.abs(8 * x - 6 * y) < 1e-6, 6.0), (np.abs(8 * (20 - x) - 6 * y) < 1e-6, 1.0)):
        assert face.sum() > 2
        assert pressure[face & (y < level)] == pytest.approx(9800.0 * (level - y[face & (y < level)]))
    assert ((pressure > -1.0) & (pressure < 80e3)).all()


def test_hydraulic_fracture(tmp_path):
    desk = both(tmp_path, "fracture")
    assert diagnostics.joint_counts(desk.blocks)[2] > 0
    assert np.nanmax(desk.pcdc.values("flow-node", "pressure")) > 2e5


def test_heated_ring(tmp_path):
    """T = T1 + (T0 - T1) ln(r2 / r) / ln(r2 / r1)."""
    desk = both(tmp_path, "ring")
    r = np.hypot(*desk.project.mesh.points.T)
    exact = 10.0 + 100.0 * np.log(2.0 / r) / math.log(2.0)
    found = np.array(desk.pcdc.values("node", "temperature"))
    assert np.abs(found - exact).max() < 1.0


def test_blast(tmp_path):
    desk = both(tmp_path, "blast")
    v = np.hypot(*(np.array(desk.pcdc.values("node", f"velocity-{axis}")) for axis in "xy"))
    assert 0.0 < v.max() < 0.7  # most of it has left: without quiet faces it is 1.08


def test_imported_mesh(tmp_path):
    desk = both(tmp_path, "imported")
    x = desk.project.mesh.points[:, 0]
    assert np.array(desk.pcdc.values("node", "displacement-x")) == pytest.approx(5e5 / 1e9 * x, rel=1e-3, abs=1e-12)


def test_chamber_in_space(tmp_path):
    desk = both(tmp_path, "chamber")
    z = np.array(desk.pcdc.values("node", "displacement-z"))
    points = desk.project.mesh.points[desk.pcdc.numbers("node")]
    roof = np.all(np.abs(points - (2.0, 2.0, 3.0)) < 1e-9, axis=1)
    assert len(points) == 124 and -1e-4 < z[roof].item() < -1e-6  # it comes down


SAMPLE = """
pcdc model new
pcdc element create brick p0 (0,0) p1 (3,0) p2 (0,2) n 30 20 tri false
pcdc element c-model mech-iso-e prop den 2300 y 4e9 p-r 0.2
pcdc node boundary apply mech-vel-b-c v-y 0 range y 0
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0
pcdc element-face boundary apply m-s-b-c s-n -2e6 range y 2
pcdc model option dynamic off
pcdc model solve cycle 20000 ratio 1e-6
"""


def test_sag_in_plane_strain(tmp_path):
    """p h (1 - nu^2) / E = 9.6e-4 m."""
    desk = Desk(tmp_path)(SAMPLE)
    top = desk.project.mesh.points[:, 1] == 2.0
    assert -np.array(desk.pcdc.values("node", "displacement-y"))[top] == pytest.approx(9.6e-4, rel=1e-3)
