"""The figures of docs/meshes.md are made by the script that claims to, and show what the page says."""

from __future__ import annotations

import importlib.util
import re

import numpy as np
import pytest

from hpcdem.pre.mesh.quality import quality
from tests.conftest import ROOT


@pytest.mark.figures
@pytest.mark.usefixtures("gmsh")
def test_figures(tmp_path):
    place = importlib.util.spec_from_file_location("mesh_figures", ROOT / "scripts" / "lib" / "mesh_figures.py")
    script = importlib.util.module_from_spec(place)
    place.loader.exec_module(script)
    made = script.draw_all(tmp_path)
    page = (ROOT / "docs" / "meshes.md").read_text(encoding="utf-8")
    assert sorted(set(re.findall(r"figures/(\w+\.png)", page))) == sorted(made)
    from matplotlib.image import imread

    for name, meshes in made.items():
        picture = imread(tmp_path / name)
        assert picture.shape[0] > 400 and np.ptp(picture) > 0.5  # something is drawn
        assert (ROOT / "docs" / "figures" / name).is_file()
        for mesh in meshes:
            assert quality(mesh).angle_least > 15.0
    assert len(made["mesh_kirsch.png"][0].layers["hole"]) == 96
    assert set(made["mesh_slope.png"][0].crack_sets) == {0, 1}
    tri, quad = made["mesh_tunnel.png"]
    assert quality(quad).quads > 4 * quality(quad).triangles and quality(tri).quads == 0
