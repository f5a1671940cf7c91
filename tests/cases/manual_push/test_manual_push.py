"""The manual's push.py, whole: 106 000 steps on two ranks, against the published state and figure.

Bands: settled bed as in settled_bed; wedge 8.4 km high at the wall and its toe near x = 23 km after 10 km of shortening
are read off the published figure (grains diverge in detail, so 10 %).
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.frames import frame_name, read_frame
from tests.cases.settled_bed.test_settled_bed import cover
from tests.conftest import Launcher


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.mpi
def test_whole_push_of_the_manual(launch: Launcher, manual_scripts: Path, tmp_path: Path) -> None:
    shutil.copy(manual_scripts / "push.py", tmp_path)
    done = launch(2, tmp_path / "push.py", timeout=1200)
    assert done.returncode == 0, done.stdout + done.stderr

    bed = read_frame(tmp_path / "data" / frame_name(6000, ".vtkhdf")).tables["particles"].columns
    r = bed["radius"]
    assert len(r) == pytest.approx(10700, rel=0.02)
    assert (r == 60.0).sum() / (r == 80.0).sum() == pytest.approx(2.0, abs=0.1)
    assert cover(bed["y"], r, 500.0, 3500.0, 39990.0) == pytest.approx(0.943, abs=0.005)

    end = read_frame(tmp_path / "data" / frame_name(106000, ".vtkhdf"))
    x, y = (end.tables["particles"].columns[name] for name in ("x", "y"))
    assert end.walls["p1"][end.walls["id"] == 1][0, 0] == pytest.approx(10010.0, abs=1e-6)
    assert y[x < 12000.0].max() == pytest.approx(8400.0, rel=0.1)
    assert toe(x, y) == pytest.approx(23000.0, rel=0.1)


def toe(x: np.ndarray, y: np.ndarray) -> float:
    """Where the surface, in bins of 500 m from the front, first rises 250 m over the undeformed bed [m]."""
    edges = np.arange(10000.0, 40001.0, 500.0)
    top = np.array([y[(x >= a) & (x < a + 500.0)].max(initial=0.0) for a in edges[:-1]])
    level = np.median(top[edges[:-1] > 32000.0])
    raised = np.flatnonzero(top > level + 250.0)
    return float(edges[raised[-1] + 1])
