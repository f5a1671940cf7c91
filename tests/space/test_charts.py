"""Diagrams beside a body in space, and ranges along its surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.fdem.simulation import Blocks
from tests.pcdc.fake import Bench

CUBE = """\
pcdc model new dim 3
pcdc mesh structured (0,0,0) (2,1,1) cells 4 2 2
"""
BODY = CUBE + """\
pcdc element c-model mech-m-c property density 2000 bulk 3e9 shear 2e9 friction 20 cohesion 1e5 tensile 1e9
pcdc element c-model thermal-iso-heat property conductivity 2 capacity 900
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 t-s 2e4 gf1 1e-3 gf2 1 p-n 1e11 range x 1 1
pcdc node initial temperature 300
pcdc node boundary therm-s-b-c temperature 350 range x 2 2
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 1 velocity-z 0.5 range x 2 2
pcdc history create 'top' node id 3 value displacement-x every 10
pcdc model step 150
pcdc chart create 'c'
pcdc chart add 'c' y 'top'
"""  # fmt: skip


def test_a_body_is_drawn_beside_a_diagram(tmp_path: Path) -> None:
    """Coloured by each panel on its own: elements, or joints that are seen through them."""
    from matplotlib.image import imread

    bench = Bench(tmp_path, blocks=Blocks(outdir=tmp_path / "data"))
    words = ("", "cracks", "plastic", "temperature")
    bench(BODY + "".join(f"pcdc chart export 'c' 'c{word}.png' {word}\n" for word in words))
    assert bench.blocks.broken.any()
    pictures = {word: imread(tmp_path / "data" / f"c{word}.png")[..., :3] for word in words}
    for word in words[1:]:
        found = pictures[word]
        assert found.shape[1] > 1.2 * pictures[""].shape[1]
        left = found[:, : found.shape[1] // 3]
        assert (left.max(axis=2) - left.min(axis=2) > 0.08).mean() > 0.1, word
    assert len({picture.tobytes() for picture in pictures.values()}) == len(words)
    curves = [(tmp_path / "data" / f"c{word}.csv").read_bytes() for word in words]
    assert len(set(curves)) == 1 and curves[0].count(b"\n") > 10


def test_ranges_along_surfaces(tmp_path: Path) -> None:
    """Faces within a distance of a plane and at an angle to it at most; nodes and elements by the distance."""
    bench = Bench(tmp_path)
    bench(CUBE + """\
pcdc geometry create polygon (1,-1,-1) (1,2,-1) (1,2,2) (1,-1,2) as-layer 'cut'
pcdc geometry create sphere (1,0.5,0.5) 0.3 as-layer 'ball'
pcdc face-joint group 'flat' set 'flat' range geometry-along 'cut'
flat = pcdc.numbers('joint', group='flat', set='flat')
pcdc face-joint group 'near' set 'near' range geometry-along 'cut' distance-offset 0.6
near = pcdc.numbers('joint', group='near', set='near')
pcdc face-joint group 'lean' set 'lean' range geometry-along 'cut' distance-offset 0.6 angle-offset 60
lean = pcdc.numbers('joint', group='lean', set='lean')
pcdc node group 'nodes' set 'nodes' range geometry-along 'cut' distance-offset 0.1
nodes = pcdc.numbers('node', group='nodes', set='nodes')
pcdc element-face group 'round' set 'round' range geometry-along 'ball' distance-offset 0.9 angle-offset 90
round = pcdc.numbers('face', group='round', set='round')
pcdc element-face group 'every' set 'every' range geometry-distance 'ball' within 0.9
every = pcdc.numbers('face', group='every', set='every')
""")  # fmt: skip
    mesh = bench.project.whole_mesh()

    def about(name: str) -> tuple[np.ndarray, np.ndarray]:
        corner = mesh.points[mesh.face_points(bench[name])]
        across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        return corner[:, :, 0], np.abs(across[:, 0]) / np.linalg.norm(across, axis=1)

    x, lies = about("flat")
    assert len(x) == 8 and (x == 1.0).all()
    x, lies = about("near")
    assert lies == pytest.approx(1.0) and set(np.unique(x)) == {0.5, 1.0, 1.5}
    x, lies = about("lean")
    assert len(x) > 24 and lies.min() > 0.5 - 1e-6 and np.abs(x - 1.0).max() <= 0.6
    assert (mesh.points[bench["nodes"], 0] == 1.0).all() and len(bench["nodes"]) == 9
    assert bench["round"].tolist() == bench["every"].tolist() != []
