"""The example of a boulder that falls into sand: shortened, and whole with its figure."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from hpcdem.io.frames import list_frames, list_mesh_frames, read_frame
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "rock_into_sand.sc"


@pytest.mark.slow
def test_shortened(resident, tmp_path):
    """Less time to settle, a tenth of the fall: frames of both, the boulder has moved down."""
    text = EXAMPLE.read_text()
    for long, short in (("cycle(40000)", "cycle(4000)"), ("step 8000", "step 400"), ("every 8000", "every 400"),
                        ("print=8000", "print=400")):  # fmt: skip
        assert text.count(long) == 1
        text = text.replace(long, short)
    (tmp_path / EXAMPLE.name).write_text(text)
    done = resident(1, EXAMPLE.name, "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("force of the sand") == 4
    rocks = [read_mesh_frame(frame.path) for frame in list_mesh_frames(tmp_path / "data", "boulder")]
    assert len(rocks) == 5 and rocks[-1].step == 1600
    fall = rocks[0].points[:, 1].mean() - rocks[-1].points[:, 1].mean()
    assert fall == pytest.approx(6.0 * 1600 * 6e-6, rel=0.05)  # 6 m/s
    beds = [frame for frame in list_frames(tmp_path / "sand") if not frame.ini]
    assert beds[-1].step == 4000 + 1600


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.figures
def test_the_figure(tmp_path):
    """Whole: the boulder comes to lie in the sand, in pieces; the figure of the gallery is drawn of it."""
    place = importlib.util.spec_from_file_location("coupled_figure", ROOT / "scripts" / "lib" / "coupled_figure.py")
    script = importlib.util.module_from_spec(place)
    place.loader.exec_module(script)
    script.run(tmp_path, EXAMPLE.read_text())
    last = read_mesh_frame(list_mesh_frames(tmp_path / "data", "boulder")[-1].path)
    bed = read_frame(list_frames(tmp_path / "sand")[-1].path).tables["particles"].columns
    assert last.points[:, 1].min() < np.percentile(bed["y"], 75)
    figure = script.draw(tmp_path)
    figure.savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 20_000
