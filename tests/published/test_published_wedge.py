"""The comparison of a published run with twins: tables read, statistics against known answers."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from hpcdem.core.comm import SerialComm
from hpcdem.io.vtkhdf import write_vtkhdf
from tests.unit.measured import frame

SCRIPT = Path(__file__).parents[2] / "scripts/lib/published_wedge.py"
spec = importlib.util.spec_from_file_location("published_wedge", SCRIPT)
assert spec is not None and spec.loader is not None
wedges = importlib.util.module_from_spec(spec)
spec.loader.exec_module(wedges)

README = (
    """| shortening km | height km | toe km | slope deg |
|---|---|---|---|
"""
    + "".join(f"| {k} | {5 + k}.5 | {10 + k} | {k}.25 |\n" for k in range(1, 14))
    + """
| km | height, two runs | theirs | slope, two runs | theirs |
|---|---|---|---|---|
| 4 | 7.31 7.42 | 7.39 | 22.0 24.3 | 15.0 |
"""
)


def test_tables_of_the_readme():
    theirs, runs = wedges.published(README), wedges.recorded(README)
    assert theirs.shape == (10, 3) and theirs[3].tolist() == [9.5, 14.0, 4.25]
    assert (
        runs.shape == (2, 10, 3) and runs[:, 3, 0].tolist() == [7.31, 7.42] and runs[:, 3, 2].tolist() == [22.0, 24.3]
    )
    assert np.isfinite(runs).sum() == 4


def test_probability_of_one_more_run():
    """The published run is drawn like ours: p is uniform, for one number and for two together."""
    random = np.random.default_rng(5)
    runs, other = random.normal(3.0, 2.0, (4000, 7)), random.normal(3.0, 2.0, 4000)
    p = [wedges.beyond(r, o)[3] for r, o in zip(runs, other, strict=True)]
    assert stats.kstest(p, "uniform").pvalue > 0.01
    mixed = np.array([[1.0, 0.6], [0.0, 2.0]])
    pairs = [wedges.together(random.normal(size=(6, 2)) @ mixed, random.normal(size=2) @ mixed)[1] for _ in range(4000)]
    assert stats.kstest(pairs, "uniform").pvalue > 0.01
    mean, spread, z, p, below = wedges.beyond(np.array([1.0, 2.0, 3.0]), 5.0)
    assert (mean, spread, z, below) == (2.0, 1.0, 3.0, 3) and p == pytest.approx(0.12169, abs=1e-5)


def test_frames_without_their_walls(tmp_path):
    """A bed that falls by 15 degrees from 2 km at x = 0, rows of particles that are walls, one far above it, and a
    particle that has slipped through the right one."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(0.0, 12_000.0, 50.0), np.arange(1000.0, 3100.0, 50.0)))
    rock = y <= 1000.0 + np.maximum(2000.0 - x * np.tan(np.radians(15.0)), 200.0)
    x = np.concatenate([x[rock], [14_000.0], np.full(9, 20.0), np.full(9, 12_000.0)])
    y = np.concatenate([y[rock], [300.0], np.linspace(6000.0, 7000.0, 9), np.linspace(1000.0, 1400.0, 9)])
    made = frame(20_000, x, y, 0.0)
    made.tables["particles"].columns["group"] = np.repeat([0, 1, 2], [len(x) - 18, 9, 9]).astype(np.int32)
    made.group_names[:] = ["rock", "lef_wall", "rig_wall"]
    write_vtkhdf(tmp_path / "all_0000020000.vtkhdf", made, SerialComm())
    found = wedges.measured(tmp_path)
    assert np.isnan(found[0]).all() and np.isfinite(found).sum() == 3
    height, toe, slope = found[1]
    assert height == pytest.approx(2.0, abs=0.05) and slope == pytest.approx(15.0, abs=0.5)
    assert toe == pytest.approx(1.8 / np.tan(np.radians(15.0)), abs=0.3)
