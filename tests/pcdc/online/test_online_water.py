"""Water before a block: closed forms, parts of faces, motion, three dimensions, restart."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem.water import _on_edges, _on_triangles
from tests.pcdc.test_excavation import Desk

BLOCK = """
pcdc element create brick p0 (0,0) p1 (9,0) p2 (0,9) n {n} triangle {tri}
pcdc element c-model mech-iso-e property den 2000 y 1e10 p-r 0.2
pcdc model gravity (0,-9.8)
pcdc model option dynamic off
pcdc geometry create polyline (-3,{level}) (0,{level}) as-layer 'lake'
pcdc element water surface 'lake' density 1000
pcdc node boundary apply mech-m-b-c type 1 range y 0 0
"""


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


def pushed(desk: Desk) -> tuple[np.ndarray, np.ndarray]:
    """Places and forces of the water at corners of elements [N/m]."""
    blocks = desk.project.blocks
    blocks.close_model()
    (water,) = (load for load in blocks.surface_loads if load.name == "water")
    applied = np.zeros_like(blocks.local.loads.applied)
    water.add_to(applied)
    dim, rows = blocks.dim, blocks.number[blocks.owned]
    stride = blocks.local.stride
    at, force = (of[blocks.owned, : 4 * stride].reshape(len(rows), 4, stride)[:, :, :dim].reshape(-1, dim)
                 for of in (blocks.x, applied))  # fmt: skip
    return at, force


@pytest.mark.some_of_each
@pytest.mark.parametrize("tri", [True, False])
@pytest.mark.parametrize("level", [4.0, 4.3, 9.0, 12.0])
@pytest.mark.parametrize("n", ["9 9", "2 7"])
def test_force_and_moment_on_a_side(desk, level, n, tri):
    desk(f"tri = {tri}\n" + BLOCK.format(level=level, n=n, tri="[tri]"))
    at, force = pushed(desk)
    wet = min(level, 9.0)  # rho g (level h - h2 / 2)
    total = 1000 * 9.8 * (level * wet - 0.5 * wet * wet)
    moment = 1000 * 9.8 * (0.5 * level * wet**2 - wet**3 / 3.0)
    assert force[:, 0].sum() == pytest.approx(total, rel=1e-12) and force[:, 1].sum() == 0.0
    assert (at[:, 1] * force[:, 0]).sum() == pytest.approx(moment, rel=1e-12)
    assert (np.abs(at[(force != 0).any(axis=1), 0]) < 1e-12).all()


def test_half_of_rho_g_h2_at_a_third_of_the_height(desk):
    """4 m of water: 78.4 kN/m at 1.333 m."""
    desk(BLOCK.format(level=4, n="5 9", tri="off"))
    at, force = pushed(desk)
    total = force[:, 0].sum()
    assert total == pytest.approx(78.4e3, rel=1e-12)
    assert (at[:, 1] * force[:, 0]).sum() / total == pytest.approx(4.0 / 3.0, rel=1e-12)


def test_the_ground_carries_it(desk):
    desk(BLOCK.format(level=4, n="5 9", tri="on") + "pcdc model solve elastic\n")
    assert desk.pcdc.total("node", "reaction-x", y=(0, 0)) == pytest.approx(-78.4e3, rel=1e-4)
    assert desk.pcdc.total("node", "reaction-y", y=(0, 0)) == pytest.approx(81 * 2000 * 9.8, rel=1e-4)


def test_an_inclined_line_over_the_top(desk):
    """Above a horizontal surface the weight of the water column."""
    text = BLOCK.format(level=4, n="5 9", tri="on").replace("(-3,4) (0,4)", "(0,10) (9,13)")
    desk(text.replace("'lake' density 1000", "'lake' density 1000 range y 8 9"))
    at, force = pushed(desk)
    top = np.abs(at[:, 1] - 9.0) < 1e-12
    assert force[top, 1].sum() == pytest.approx(-1000 * 9.8 * 9 * 2.5, rel=1e-12)


def test_said_again_it_takes_the_place_of_what_was(desk):
    desk(BLOCK.format(level=4, n="5 9", tri="on") + "pcdc element water surface 'lake' density 1200\n")
    assert pushed(desk)[1][:, 0].sum() == pytest.approx(1.2 * 78.4e3, rel=1e-12)
    desk("pcdc element water surface 'lake' density 0\n")
    assert "water" not in desk.project.blocks.surface_loads


def test_beside_an_excavation(desk):
    """Faces that become free are pushed on, those that go are not."""
    desk(BLOCK.format(level=4, n="9 9", tri="off").replace("(-3,4) (0,4)", "(-3,4) (3,4)")
         + "pcdc element c-model null range x 0 2 y 0 4\n")  # fmt: skip
    at, force = pushed(desk)
    right = np.abs(at[:, 0] - 2.0) < 1e-12
    assert force[right, 0].sum() == pytest.approx(78.4e3, rel=1e-12)
    assert force[np.abs(at[:, 0]) < 1e-12, 0].sum() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.some_of_each
@pytest.mark.parametrize("tri", [True, False])
@pytest.mark.parametrize("level", [3.0, 2.6])
def test_in_space(desk, level, tri):
    desk(f"""
level, tri = {level}, {tri}
pcdc model new dim 3
pcdc element create brick p0 (0,0,0) p1 (4,0,0) p2 (0,2,0) p3 (0,0,4) n 3 2 4 triangle [tri]
pcdc element c-model mech-iso-e property den 2000 y 1e10 p-r 0.2
pcdc model gravity (0,0,-9.8)
pcdc geometry create polygon (-1,0,[level]) (0,0,[level]) (0,2,[level]) (-1,2,[level]) as-layer 'lake'
pcdc element water surface 'lake' density 1000
""")
    at, force = pushed(desk)
    total = 0.5 * 1000 * 9.8 * level**2 * 2.0
    assert force[:, 0].sum() == pytest.approx(total, rel=1e-12)
    assert (at[:, 2] * force[:, 0]).sum() == pytest.approx(total * level / 3.0, rel=1e-12)
    assert np.abs(force[:, 1:]).max() == 0.0


def test_shares_of_parts_are_integrals():
    """Against sums over a fine raster."""
    t = (np.arange(20000) + 0.5) / 20000
    for a, b in ((3.0, 1.0), (2.0, -1.0), (-0.5, 1.5), (-1.0, -2.0)):
        p = np.maximum(a + (b - a) * t, 0.0)
        assert _on_edges(np.array([[a, b]]))[0] == pytest.approx([(p * (1 - t)).mean(), (p * t).mean()], abs=1e-7)
    u, v = np.meshgrid((np.arange(800) + 0.5) / 800, (np.arange(800) + 0.5) / 800)
    u, v = u.ravel(), v.ravel()
    inside = u + v < 1.0
    shape = np.stack([1 - u - v, u, v])[:, inside]
    for depth in ((3.0, 1.0, 2.0), (2.0, -1.0, -0.5), (-0.5, 1.5, 1.0), (1.0, -2.0, 0.5), (-1.0, -1.0, -2.0)):
        p = np.maximum(np.array(depth) @ shape, 0.0)
        expected = (p * shape).sum(axis=1) / inside.sum()
        assert _on_triangles(np.array([depth]))[0] == pytest.approx(expected, abs=2e-3)


def test_saved_and_taken_up_again(tmp_path):
    whole = Desk(tmp_path)(BLOCK.format(level=4.3, n="4 5", tri="on") + "pcdc model step 40\n")
    half = Desk(tmp_path)(BLOCK.format(level=4.3, n="4 5", tri="on") + "pcdc model step 20\npcdc model save 'a.sav'\n")
    after = Desk(tmp_path)("pcdc model restore 'a.sav'\npcdc model step 20\n")
    assert half.project.step == 20
    for name in ("displacement-x", "displacement-y"):
        one, other = (d.pcdc.values("node", name) for d in (whole, after))
        assert (one == other).all() and np.abs(one).max() > 0.0


HOSTILE = [
    ("element water surface 'sea' density 1000", "there is no geometry layer 'sea'"),
    ("element water surface 'lake'", "lacks d{ensity}"),
    ("element water surface 'lake' density -1", "not negative"),
    ("element water surface 'ring' density 1000", "must run from left to right"),
    ("element water surface 'far' density 1000", "no face of these elements lies below"),
]


@pytest.mark.parametrize(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(BLOCK.format(level=4, n="2 2", tri="on") + "pcdc geometry create circle (0,0) 3 as-layer 'ring'\n"
             f"pcdc geometry create polyline (20,3) (30,3) as-layer 'far'\npcdc {line}\n")  # fmt: skip


def test_gravity_comes_first(desk):
    text = BLOCK.format(level=4, n="2 2", tri="on").replace("pcdc model gravity (0,-9.8)\n", "")
    with pytest.raises(HpcdemError, match="needs gravity along the last axis"):
        desk(text)
