"""The rasteriser against the plain one: which object each pixel shows, and in which colour."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.io.axes import View
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import DISCS, LINES, POLYGONS, Moment, Objects
from hpcdem.post.view.scene import scene
from hpcdem.post.view.screen import DARK_GROUND, Picture, paint
from tests.view import plain

WIDTH, HEIGHT = 120, 80
SEEN = View(0.0, 12.0, 0.0, 8.0)  # ten pixels per metre, y upwards


def picture(kind: str, shape: tuple[np.ndarray, ...], fine: int = 1, dark: bool = False, **looks: object) -> Picture:
    count = len(shape[1]) if kind == POLYGONS else len(shape[0])
    name = {DISCS: "particles", POLYGONS: "elements", LINES: "contacts"}[kind]
    objects = Objects(kind, count, lambda: shape, {"k": np.arange(count), "x": np.zeros(count)})
    layer = Layer(object=name, **({"colour": "#ff8000"} | looks))  # type: ignore[arg-type]
    return paint(scene(Moment(0, 0.0, {name: objects}), ModelView(layers=(layer,)), SEEN), WIDTH, HEIGHT, fine, dark)


def places(seed: int, n: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-1.0, -1.0), (13.0, 9.0), (n, 2))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_discs(seed: int):
    at = places(seed, 60)
    radius = np.random.default_rng(seed).uniform(0.08, 1.5, 60)  # all hold the middle of a pixel, or are seen by none
    found = picture(DISCS, (at, radius))
    wanted = plain.discs(10.0 * at[:, 0], 10.0 * (8.0 - at[:, 1]), 10.0 * radius, WIDTH, HEIGHT)
    np.testing.assert_array_equal(found.row, wanted)
    np.testing.assert_array_equal(found.layer == 0, wanted >= 0)
    assert (found.colours[wanted >= 0] == (255, 128, 0)).all() and (found.colours[wanted < 0] == 255).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_triangles_and_quads(seed: int):
    corners = places(seed, 90).reshape(30, 3, 2)
    found = picture(POLYGONS, (corners.reshape(-1, 2), cells(30)))
    pixels = np.stack([10.0 * corners[:, :, 0], 10.0 * (8.0 - corners[:, :, 1])], axis=2)
    wanted = plain.triangles(pixels, WIDTH, HEIGHT)
    sure = wanted > -2
    np.testing.assert_array_equal(found.row[sure], wanted[sure])
    square = np.array([[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]])
    quad = picture(POLYGONS, (square, np.array([[0, 1, 2, 3]])))
    assert (quad.row == 0).sum() == 30 * 20 and (quad.row[50:70, 10:40] == 0).all()


def cells(n: int) -> np.ndarray:
    return np.column_stack([np.arange(3 * n).reshape(n, 3), np.full(n, -1)])


def test_neighbours_share_no_pixel_and_leave_none_out():
    """Half transparent triangles of a mesh: no seam is darker or lighter."""
    x, y = np.meshgrid(np.arange(0.0, 12.5, 0.5), np.arange(0.0, 8.5, 0.5))
    points = np.column_stack([x.ravel(), y.ravel()])
    n = x.shape[1]
    first = (np.arange(len(y) - 1)[:, None] * n + np.arange(n - 1)).ravel()
    rows = np.concatenate(
        [np.stack([first, first + 1, first + n + 1], 1), np.stack([first, first + n + 1, first + n], 1)]
    )
    quads = np.stack([first, first + 1, first + n + 1, first + n], 1)
    for mesh in (np.column_stack([rows, np.full(len(rows), -1)]), quads):
        found = picture(POLYGONS, (points, mesh), opacity=0.5)
        assert len(np.unique(found.colours.reshape(-1, 3), axis=0)) == 1
        assert found.colours[0, 0].tolist() == [255, 192, 128]


def test_what_is_smaller_than_a_pixel_is_a_pixel():
    at = np.array([[3.03, 2.02], [7.0, 3.0]])
    assert (picture(DISCS, (at, np.full(2, 1e-3))).row >= 0).sum() == 2
    tiny = at[:, None] + 1e-3 * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert (picture(POLYGONS, (tiny.reshape(-1, 2), cells(2))).row >= 0).sum() == 2


def test_lines_are_as_wide_as_they_say():
    ends = np.array([[[2.0, 2.05], [8.0, 2.05]]])
    thin = picture(LINES, (ends,))
    wide = picture(LINES, (ends,), size=10.0)  # 0.4 points: 5 pixels
    assert set(np.flatnonzero((thin.row == 0).any(axis=1))) == {59}
    assert (wide.row == 0).any(axis=1).sum() == 5 and (thin.row == 0).sum() == 61
    far = picture(LINES, (np.array([[[-1e9, 4.05], [1e9, 4.05]]]),))
    assert (far.row[39] == 0).all() and (far.row >= 0).sum() == WIDTH
    nowhere = picture(LINES, (np.array([[[np.nan, 0.0], [1.0, 1.0]]]),))
    assert (nowhere.row == -1).all()


def test_outlines_size_arrows_and_ground():
    square = np.array([[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]]), np.array([[0, 1, 2, 3]])
    plain, edged = picture(POLYGONS, square), picture(POLYGONS, square, edges=True)
    assert not np.array_equal(plain.colours, edged.colours)
    disc = np.array([[5.0, 4.0]]), np.array([2.0])
    assert not np.array_equal(picture(DISCS, disc).colours, picture(DISCS, disc, edges=True).colours)
    assert (picture(DISCS, disc, size=0.5).row == 0).sum() < (picture(DISCS, disc).row == 0).sum()
    assert (picture(DISCS, disc, dark=True).colours[0, 0] == DARK_GROUND).all()
    fine = picture(DISCS, disc, fine=2)
    assert fine.row.shape == (HEIGHT, WIDTH) and len(np.unique(fine.colours.reshape(-1, 3), axis=0)) > 2
