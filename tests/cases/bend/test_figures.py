"""The figures of the beam, the tunnel and the slope are made by the script that claims to."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from hpcdem.cases import Slope, ThreePointBend, Tunnel
from tests.conftest import ROOT, absent


@pytest.mark.slow
@pytest.mark.figures
def test_figures(tmp_path):
    """From coarse models."""
    if importlib.util.find_spec("gmsh") is None:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    place = importlib.util.spec_from_file_location("case_figures", ROOT / "scripts" / "lib" / "case_figures.py")
    script = importlib.util.module_from_spec(place)
    place.loader.exec_module(script)
    beam = ThreePointBend(size=0.006, coarse=0.012, periods=2, stop=0.5)
    tunnel = Tunnel(joints=True, size=0.4, relax=5, rest=5)
    slope = Slope(size=1.2, coarse=2.5, benches=2)
    made = script.draw_all(tmp_path, tmp_path / "work", bend=beam, tunnel=tunnel, slope=slope)
    from matplotlib.image import imread

    for name in made:
        picture = imread(tmp_path / name)
        assert picture.shape[0] > 300 and np.ptp(picture) > 0.5  # something is drawn
        assert (ROOT / "docs" / "figures" / name).is_file()
        pages = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in ("cases.md", "validation.md"))
        assert f"figures/{name}" in pages
