"""Values read from the colours of a picture, and their medians by region."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.image import imsave

SCRIPT = Path(__file__).parents[2] / "scripts/lib/push_stress.py"
spec = importlib.util.spec_from_file_location("push_stress", SCRIPT)
assert spec is not None and spec.loader is not None
stresses = importlib.util.module_from_spec(spec)
spec.loader.exec_module(stresses)


def test_a_known_field_is_read_from_its_colours(tmp_path):
    """Stress 180 - 4 x - 10 y MPa drawn with the bar of the page, a white margin above and a shaded band on it."""
    rows, columns = np.mgrid[0:801, 0:918]
    scale = 10.0 / (stresses.TEN - stresses.LEFT), 10.0 / (stresses.BOTTOM - stresses.TOP)
    x, y = (columns - stresses.LEFT) * scale[0], (stresses.BOTTOM - rows) * scale[1]
    value = 180.0 - 4.0 * x - 10.0 * y
    pixels = colormaps["jet"](np.clip(value / stresses.BAR, 0.0, 1.0))
    pixels[y > 8.0] = 1.0
    pixels[np.abs(y - 1.5) < 0.2, :3] *= 0.3
    imsave(tmp_path / "page.png", pixels)
    points = stresses.published(tmp_path / "page.png")
    true = np.clip(180.0 - 4.0 * points[:, 0] - 10.0 * points[:, 1], 0.0, None)
    assert points[:, 1].max() < 8.1 and np.abs(points[:, 2] - true).max() < 25.0
    found = stresses.medians(points)
    middle = np.array([[180.0 - 2.0 * sum(i) - 5.0 * sum(j) for i in stresses.X] for j in stresses.Y])
    assert found == pytest.approx(middle, abs=4.0)
