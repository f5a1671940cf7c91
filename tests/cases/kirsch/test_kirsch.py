"""The language from the mesh to the stress: a hole in a stressed disk against Kirsch's solution."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.cases.kirsch import exact
from tests.conftest import absent

SCRIPT = Path(__file__).with_name("script.sc")


@pytest.fixture(autouse=True)
def needs_gmsh():
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")


def run(resident, folder: Path, ranks: int) -> np.ndarray:
    """(n, 6) stresses xx yy xy [Pa], area [m2], x, y [m] of the elements at the end."""
    folder.mkdir(exist_ok=True)
    shutil.copy(SCRIPT, folder)
    done = resident(ranks, "script.sc", cwd=folder, timeout=1200)
    assert done.returncode == 0, done.stderr
    return np.loadtxt(folder / "stress.txt")


def test_formulas_at_places_worked_out_by_hand():
    for r, t, of, value in [(1, 0, 1, -10e6), (1, 90, 1, -50e6), (2, 0, 1, -12.8125e6), (2, 0, 0, -12.1875e6),
                            (1.5, 45, 2, 6.4814815e6), (2, 45, 2, 6.5625e6), (5, 0, 0, -18.624e6)]:  # fmt: skip
        assert exact.polar(np.array(float(r)), np.radians(t))[of] == pytest.approx(value, rel=1e-6)


@pytest.mark.slow
def test_stress_around_the_hole(resident, tmp_path):
    xx, yy, xy, area, x, y = run(resident, tmp_path / "one", 1).T
    r, t = np.hypot(x, y), np.arctan2(y, x)
    near = (r > 1.05) & (r < 5.0)
    assert near.sum() > 1000
    found, expected = exact.turned(xx, yy, xy, t), exact.polar(r, t)
    for name, a, b in zip(("radial", "tangential", "shear"), found, expected, strict=True):
        # Constant stress in an element, 100 edges on the hole: 2 % of 20 MPa in the mean square over the area.
        error = np.sqrt(np.average((a - b)[near] ** 2, weights=area[near])) / 20e6
        assert error < 0.02, name
    top = near & (np.abs(np.degrees(t)) > 85) & (np.abs(np.degrees(t)) < 95) & (r < 1.1)
    assert found[1][top].min() < -44e6


@pytest.mark.slow
@pytest.mark.mpi
def test_two_ranks_give_the_same_bits(resident, tmp_path):
    one, two = (run(resident, tmp_path / str(n), n) for n in (1, 2))
    assert (one == two).all()
