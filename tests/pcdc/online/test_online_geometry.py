"""Layers of geometry in the words of the online commands."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from tests.mesh.areas import enclosed_area
from tests.pcdc.test_excavation import Desk


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


def test_a_closed_polyline_is_a_polygon(desk):
    desk("pcdc geometry create polyline-close (0,0) (3,0) (3,2) as-layer 'a'\n"
         "pcdc geometry create polygon (0,0) (3,0) (3,2) as-layer 'b'\n")  # fmt: skip
    (one,), (other,) = desk.project.layers["a"], desk.project.layers["b"]
    assert one.closed and (one.points == other.points).all()


@pytest.mark.parametrize("length", [2.0, 0.5, 0.1, 100.0])
def test_a_circle_of_sides(desk, length):
    desk(f"pcdc geometry create circle c (1,2) rad 3 seg-l {length} as-layer 'a'\n")
    (curve,) = desk.project.layers["a"]
    sides = max(3, round(6.0 * np.pi / length))
    assert len(curve.points) == sides and curve.closed and not curve.bulges.any()
    assert np.hypot(*(curve.points - (1.0, 2.0)).T) == pytest.approx(np.full(sides, 3.0))
    assert enclosed_area(curve) == pytest.approx(0.5 * sides * 9.0 * np.sin(2 * np.pi / sides))


def test_a_true_circle_and_one_without_a_layer(desk):
    desk("pcdc geometry create circle c (1,2) r 3\npcdc geometry create circle (1,2) 3 as-layer 'b'\n")
    (one,), (other,) = desk.project.layers["default"], desk.project.layers["b"]
    assert (one.points == other.points).all() and (one.bulges == other.bulges).all()


def test_a_circle_in_space_is_a_disc(desk):
    desk("pcdc model new dim 3\npcdc geometry create circle c (1,2,0) rad 3 normal (1,0,1) as-layer 'a'\n"
         "pcdc geometry create disc (1,2,0) (1,0,1) 3 as-layer 'b'\n")  # fmt: skip
    assert desk.project.layers["a"] == desk.project.layers["b"]


SHAPES = ("pcdc geometry create circle c (0,0) rad 2 s-l 0.3 as-layer 'ring'\n"
          "pcdc geometry create polyline (0,0) (1,3) as-layer 'line'\n"
          "pcdc geometry create circle (5,5) 1 as-layer 'hole'\n")  # fmt: skip


def test_scaled_and_moved(desk):
    desk(SHAPES + "pcdc geometry scale (3,0.5) layer 'ring' 'line'\npcdc geometry translate (1,-1)\n")
    ring, line, hole = (desk.project.layers[name][0] for name in ("ring", "line", "hole"))
    assert ring.points.max(axis=0)[0] == pytest.approx(7.0) and ring.points[:, 1].max() <= 0.0
    assert line.points.tolist() == [[1.0, -1.0], [4.0, 0.5]]
    assert hole.points.tolist() == [[5.0, 4.0], [7.0, 4.0]] and (hole.bulges == 1.0).all()


def test_to_a_drawing_and_back(desk):
    pytest.importorskip("ezdxf")
    desk(SHAPES + "pcdc geometry create point (7,7) as-layer 'hole'\n"
         "pcdc geometry export 'ring' 'hole' file 'plan.dxf'\n"
         "pcdc geometry import 'data/plan.dxf' as-layer 'one' dxf-layer 'ring'\n"
         "pcdc geometry import 'data/plan.dxf' as-layer 'two' dxf-layer 'hole'\n")  # fmt: skip
    layers = desk.project.layers
    assert [c.points.tolist() for c in layers["one"]] == [c.points.tolist() for c in layers["ring"]]
    assert [(c.points.tolist(), c.bulges.tolist(), c.closed) for c in layers["two"]] == [
        (c.points.tolist(), c.bulges.tolist(), c.closed) for c in layers["hole"]
    ]


def test_several_layers_are_forgotten(desk):
    desk(SHAPES + "pcdc geometry delete 'ring' 'hole'\n")
    assert list(desk.project.layers) == ["line"]


HOSTILE = [
    ("geometry create circle c (0,0)", "needs a centre and a radius"),
    ("geometry create circle (0,0) 1 c (1,1)", "each once"),
    ("geometry create circle c (0,0) rad 1 s-l 1e-9", "at most 100000"),
    ("geometry create circle c (0,0) rad 1 s-l 0", "above 0"),
    ("geometry create polyline-close (0,0) (1,1)", "at least 3 needed"),
    ("geometry scale (0,1)", "not zero"),
    ("geometry scale (2,1)", "into ellipses"),
    ("geometry scale (2,2) layer 'no'", "there is no geometry layer 'no'"),
    ("geometry translate (1,1) layer", "expected texts in quotes|texts in quotes"),
    ("geometry export 'ring'", "lacks f{ile}"),
    ("geometry export 'ring' file 'a.svg'", "exported to files"),
    ("geometry export 'ring' file '../a.dxf'", "lies outside the folder of the results"),
    ("geometry export 'no' file 'a.dxf'", "there is no geometry layer 'no'"),
    ("geometry delete", "texts in quotes"),
]


@pytest.mark.parametrize(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(SHAPES + f"pcdc {line}\n")
    if "scale" in line:
        return
