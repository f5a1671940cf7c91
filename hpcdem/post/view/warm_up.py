"""Calls the kernels of pictures once, so that the first picture does not wait for them."""

from __future__ import annotations

import numpy as np

from hpcdem.io.axes import View
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import DISCS, FACES, LINES, POLYGONS, SOLIDS, Moment, Objects
from hpcdem.post.view.scene import scene
from hpcdem.post.view.screen import paint


def in_plane() -> None:
    """A picture with a disc, a triangle, a quad and a line."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    cells = np.array([[0, 1, 2, -1], [0, 1, 2, 3]], np.int64)
    objects = {
        "particles": Objects(DISCS, 1, lambda: (points[:1], np.ones(1)), {}),
        "elements": Objects(POLYGONS, 2, lambda: (points, cells), {}),
        "contacts": Objects(LINES, 1, lambda: (points[None, :2],), {}),
    }
    layers = tuple(Layer(object=name, colour="#000000", edges=True) for name in objects)
    paint(scene(Moment(0, 0.0, objects), ModelView(layers=layers), View(0.0, 1.0, 0.0, 1.0)), 8, 8)


def in_space(threads: int = 1) -> None:
    """A picture with a tetrahedron that is cut, arrows on it, and a face."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    cells = np.array([[0, 1, 2, 3]], np.int64)
    objects = {
        "elements": Objects(
            SOLIDS, 1, lambda: (points, cells, np.full(4, -1)), {}, {"velocity": np.array([[0.0, 0.0, 1.0]])}
        ),
        "joints": Objects(FACES, 1, lambda: (points, np.array([[0, 1, 2, -1]])), {}),
    }  # fmt: skip
    layers = (Layer(object="elements", colour="#000000", vectors="velocity"), Layer(object="joints", colour="#000000"))
    view = ModelView(layers=layers, section="x<0.5")
    paint(scene(Moment(0, 0.0, objects, dim=3), view, View(-1.0, 1.0, -1.0, 1.0)), 8, 8)
