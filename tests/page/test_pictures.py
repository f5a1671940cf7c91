"""The page looks as its documentation shows it: in blocks of 20 pixels, which fonts and smoothing hardly change."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from tests.page import pictures

BLOCK = 20


def blocks(picture: Image.Image) -> np.ndarray:
    """(rows, columns, 3): mean colours."""
    a = np.asarray(picture.convert("RGB"), float)
    h, w = (n // BLOCK * BLOCK for n in a.shape[:2])
    return a[:h, :w].reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean((1, 3))


@pytest.mark.figures
@pytest.mark.parametrize("name", pictures.PICTURES)
def test_the_picture_of_the_page_is_the_documented_one(browser, serve_page, name):
    served = serve_page(pictures.GRADING, **pictures.VALUES)
    now = blocks(pictures.take(browser, served.url, name))
    documented = blocks(Image.open(pictures.FOLDER / name))
    assert now.shape == documented.shape
    off = abs(now - documented).max(2)
    assert off.mean() < 4.0
    assert (off > 40.0).mean() < 0.02


def test_the_comparison_sees_another_seed_and_another_theme():
    light, dark = (blocks(Image.open(pictures.FOLDER / name)) for name in pictures.PICTURES)
    assert abs(light - dark).max(2).mean() > 100.0
    # Other grains in the same places of the page: the right third turned upside down.
    other = light.copy()
    other[5:45, 48:66] = other[5:45, 48:66][::-1]
    off = abs(other - light).max(2)
    assert (off > 40.0).mean() > 0.02
