"""The example in PCDC, a jointed specimen under load: shortened it runs to its figure; whole, it breaks as described."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.frames import list_mesh_frames
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from tests.conftest import ROOT, absent
from tests.property.workers import Resident

YOUNG, POISSON, COHESION, FRICTION = 30e9, 0.25, 12e6, 35.0
TEXT = (ROOT / "examples" / "jointed_specimen.sc").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def gmsh() -> None:
    """The example is meshed by Gmsh."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")


def test_shortened_example_runs_to_its_figure(resident: Resident, tmp_path: Path) -> None:
    """A coarse mesh, and the first 2 % of the way."""
    text = TEXT.replace("0.10, 0.0022", "0.10, 0.006").replace("pcdc.time < 3e-3", "pcdc.time < 6e-5")
    assert text.count("0.006") == text.count("6e-5") == 1
    (tmp_path / "short.sc").write_text(text)
    done = resident(1, "short.sc", cwd=tmp_path, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    (figure,) = re.findall(r"^figure: (\S+)$", done.stdout, flags=re.MULTILINE)
    assert (tmp_path / figure).stat().st_size > 10_000 and (tmp_path / "data" / "curve.png").stat().st_size > 5000
    assert re.search(r"^strength \d+\.\d MPa, 0 joints broken$", done.stdout, flags=re.MULTILINE)


@pytest.mark.slow
@pytest.mark.nightly
def test_whole(resident: Resident, tmp_path: Path) -> None:
    (tmp_path / "specimen.sc").write_text(TEXT)
    done = resident(1, "specimen.sc", cwd=tmp_path, timeout=3600)
    assert done.returncode == 0, done.stdout + done.stderr
    with open(tmp_path / "data" / "curve.csv", newline="", encoding="utf-8") as file:
        curve = np.array([[float(cell) for cell in row[1:]] for row in list(csv.reader(file))[1:]])
    strain, stress = 0.01 * curve[:, 0], 1e6 * curve[:, 1]
    # Elastic joints between elements, and the three open ones, make it softer than the rock, E / (1 - nu2).
    first = (stress > 5e6) & (stress < 15e6)
    assert 0.75 < np.polyfit(strain[first], stress[first], 1)[0] / (YOUNG / (1 - POISSON**2)) < 0.95
    # Weaker than rock without joints: 2 c tan(45 + phi / 2) after Mohr and Coulomb.
    intact = 2 * COHESION * math.tan(math.radians(45 + FRICTION / 2))
    assert 0.5 * intact < stress.max() < intact and stress[-1] < 0.5 * stress.max()
    frames = [read_mesh_frame(file.path) for file in list_mesh_frames(tmp_path / "data", "specimen")]
    broken = [frame.of_joints["state"] == 3.0 for frame in frames]
    start = next(k for k, some in enumerate(broken) if some.any())
    middle = frames[start].points[frames[start].joints[broken[start]]].mean(axis=1)
    half = 0.007 * math.sqrt(0.5)
    tips = np.array([(0.025 + s * half, y + s * half) for y in (0.035, 0.05, 0.065) for s in (-1, 1)])
    away = np.hypot(*(middle[:, None] - tips).transpose(2, 0, 1)).min(axis=1)
    assert away.max() < 0.005  # the first cracks: wings at the tips of the joints,
    assert (frames[start].of_joints["mode"][broken[start]] < 4 / 3).all()  # in tension
    assert 60 < broken[-1].sum() < 0.2 * len(broken[-1])
