"""Scenes as pixels, fast enough to be moved about: discs, polygons and lines painted in sequence, faces in
space by their depth, and beside the colours a buffer of what each pixel shows, in which a click is looked up.
`tests/view/plain.py` paints the same plainly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from hpcdem.io.axes import View
from hpcdem.post.view.moment import DISCS, FACES, POLYGONS
from hpcdem.post.view.scene import Painted, Scene

GROUND, DARK_GROUND = (255, 255, 255), (240, 241, 239)
DOT = 96.0 / 72.0
"""Pixels of a point, at one pixel per pixel of the page."""
NOTHING = -1
LIGHT = np.array([-0.35, 0.45, 0.82]) / np.linalg.norm([-0.35, 0.45, 0.82])
"""Where light comes from in space: right, up, towards the eye."""
IN_SHADE = 0.7
"""Part of their colour that faces have which light only grazes; a section has all of it."""
SHARP = 0.8
"""Faces whose normals have a smaller product meet in an edge, which is drawn."""
STEP = 6.0
"""So many pixels of depth between neighbours, too."""
NEARER = 2.0
"""So many pixels nearer than they are lie faces of joints, which lie on those of elements."""


@dataclass
class Picture:
    """colours (h, w, 3) bytes, row 0 at the top; layer (h, w) i1: place of the layer in the scene that a pixel shows,
    -1 for none; row (h, w) i4: which of its objects; near (h, w): in space how near to the eye it is [pixels], -inf
    where nothing is, or only what lets light through; None of a picture that is a mean."""

    colours: np.ndarray
    layer: np.ndarray
    row: np.ndarray
    near: np.ndarray | None = None


def paint(
    scene: Scene, width: int, height: int, fine: int = 1, dark: bool = False, pen: float = 1.0
) -> Picture:  # fmt: skip
    """The picture of a scene of this width and height in pixels. fine: each pixel is the mean of this number squared;
    pen: width of edges in space [pixels]."""
    w, h = width * fine, height * fine
    colours = np.empty((h, w, 3), np.uint8)
    colours[:] = DARK_GROUND if dark else GROUND
    layer, row = np.full((h, w), NOTHING, np.int8), np.full((h, w), NOTHING, np.int32)
    place = transform(scene.seen, w, h)
    near = None
    if scene.turn is not None:
        near = _in_space(scene, scene.turn, place, (colours, layer, row), fine, max(1, round(pen * fine)))
    else:
        for number, painted in enumerate(scene.layers):
            _layer(painted, number, place, colours, layer, row, fine)
    if fine > 1:
        mean = np.zeros((height, width, 3), np.uint16)
        for i in range(fine):
            for j in range(fine):
                mean += colours[i::fine, j::fine]
        colours = (mean // fine**2).astype(np.uint8)
        middle = slice(fine // 2, None, fine)
        layer, row = np.ascontiguousarray(layer[middle, middle]), np.ascontiguousarray(row[middle, middle])
        near = None
    return Picture(colours, layer, row, near)


def transform(seen: View, width: int, height: int) -> tuple[float, float, float, float]:
    """Column = a x + b, row = c y + d of a place [m]."""
    a, c = width / seen.width, -height / seen.height
    return a, -a * seen.left, c, -c * seen.top


def _in_space(scene: Scene, turn: np.ndarray, place: tuple, target: tuple, fine: int, pen: int) -> np.ndarray:
    """Faces by their depth: first those that nothing shines through, then the others from the far to the near. How near
    each pixel is."""
    from hpcdem.post.view import space

    a, b, c, d = place
    near, face = np.full(target[1].shape, -np.inf), np.full(target[1].shape, NOTHING, np.int32)
    every: list[np.ndarray] = []
    outlined: list[np.ndarray] = []
    count = 0
    for number, painted in sorted(enumerate(scene.layers), key=lambda one: one[1].layer.opacity < 1.0):
        points, cells, of, cut = painted.shape
        seen = points @ turn.T
        normals = space.normals(points, cells) @ turn.T
        normals[normals[:, 2] < 0.0] *= -1.0
        light = IN_SHADE + (1.0 - IN_SHADE) * np.maximum(normals @ LIGHT, 0.0)
        light[cut] = 1.0
        x, y, z = a * seen[:, 0] + b, c * seen[:, 1] + d, a * seen[:, 2]
        order = np.arange(len(cells))
        if painted.layer.opacity < 1.0:
            order = np.argsort(space.middles(seen, cells)[:, 2], kind="stable")
        shades = np.clip(np.rint(255.0 * painted.shades), 0, 255)
        faces(
            x, y, z + NEARER * (painted.kind_of_shape == FACES), np.ascontiguousarray(cells), order,
            painted.kind.astype(np.int64)[of], painted.rows.astype(np.int64)[of], shades, light, near, face, count,
            target, np.int8(number), float(painted.layer.opacity),
        )  # fmt: skip
        every.append(normals)
        outlined.append(np.full(len(cells), painted.layer.edges))
        count += len(cells)
    if count:
        edges(target[0], near, face, np.concatenate(every), np.concatenate(outlined), pen)
    for painted in scene.layers:
        if painted.arrows is None:
            continue
        at, far = (one @ turn.T for one in painted.arrows)
        i, j = np.floor(c * at[:, 1] + d).astype(int), np.floor(a * at[:, 0] + b).astype(int)
        there = (i >= 0) & (i < near.shape[0]) & (j >= 0) & (j < near.shape[1])
        at, far, i, j = at[there], far[there], i[there], j[there]
        free = a * at[:, 2] > near[i, j] - STEP
        _arrows(at[free, :2], far[free, :2], place, fine, target)
    return near


def _layer(painted: Painted, number: int, place: tuple, colours: np.ndarray, layer: np.ndarray, row: np.ndarray,
           fine: int) -> None:  # fmt: skip
    shades = np.clip(np.rint(255.0 * painted.shades), 0, 255).astype(np.uint8)
    kind, rows = (np.ascontiguousarray(one, np.int64) for one in (painted.kind, painted.rows))
    shown_layer = painted.layer
    target, which, opacity = (colours, layer, row), np.int8(number), float(shown_layer.opacity)
    if painted.kind_of_shape == DISCS:
        centres, radius = map(np.ascontiguousarray, painted.shape)
        discs(centres, radius, kind, rows, shades, place, shown_layer.edges, target, which, opacity)
    elif painted.kind_of_shape == POLYGONS:
        points, cells = map(np.ascontiguousarray, painted.shape)
        polygons(points, cells, kind, rows, shades, place, shown_layer.edges, target, which, opacity)
    else:
        ends = np.ascontiguousarray(painted.shape[0])
        lines(ends, kind, rows, shades, place, max(1, round(painted.width * DOT * fine)), target, which, opacity)
    if painted.arrows is not None:
        _arrows(*painted.arrows, place, fine, target)


def _arrows(at: np.ndarray, far: np.ndarray, place: tuple, fine: int, target: tuple) -> None:
    """Shafts, and two strokes for each head; they cannot be picked."""
    tip = at + far
    strokes = [np.stack([at, tip], axis=1)]
    for turn in (0.85 * math.pi, -0.85 * math.pi):
        c, s = math.cos(turn), math.sin(turn)
        back = 0.3 * np.column_stack([c * far[:, 0] - s * far[:, 1], s * far[:, 0] + c * far[:, 1]])
        strokes.append(np.stack([tip, tip + back], axis=1))
    ends = np.ascontiguousarray(np.concatenate(strokes))
    nobody = np.full(len(ends), NOTHING, np.int64)
    shades = np.array([[32, 32, 32]], np.uint8)
    lines(ends, np.zeros(len(ends), np.int64), nobody, shades, place, fine, target, np.int8(NOTHING), 1.0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _put(colours, layer, row, i, j, red, green, blue, opacity, number, which):
    if opacity >= 1.0:
        colours[i, j, 0], colours[i, j, 1], colours[i, j, 2] = red, green, blue
    else:
        colours[i, j, 0] = np.uint8(colours[i, j, 0] + opacity * (float(red) - colours[i, j, 0]) + 0.5)
        colours[i, j, 1] = np.uint8(colours[i, j, 1] + opacity * (float(green) - colours[i, j, 1]) + 0.5)
        colours[i, j, 2] = np.uint8(colours[i, j, 2] + opacity * (float(blue) - colours[i, j, 2]) + 0.5)
    if which >= 0:
        layer[i, j], row[i, j] = number, which


@njit(cache=True, nogil=True, error_model="numpy")
def discs(centres, radius, kind, rows, shades, place, edges, target, number, opacity):
    """Each pixel whose middle lies in a disc gets its colour; of a disc that holds none, the pixel of its centre."""
    a, b, c, d = place
    colours, layer, row = target
    h, w = layer.shape
    for k in range(len(radius)):
        x, y, r = a * centres[k, 0] + b, c * centres[k, 1] + d, a * radius[k]
        if not (x + r > 0.0 and x - r < w and y + r > 0.0 and y - r < h and r > 0.0):
            continue
        s = shades[kind[k]]
        red, green, blue = s[0], s[1], s[2]
        if r < 0.75:
            i, j = math.floor(y), math.floor(x)
            if 0 <= i < h and 0 <= j < w:
                _put(colours, layer, row, i, j, red, green, blue, opacity, number, rows[k])
            continue
        inner = max(r - max(1.0, 0.08 * r), 0.0) if edges and r > 2.0 else r + 1.0
        for i in range(max(0, math.ceil(y - r - 0.5)), min(h - 1, math.floor(y + r - 0.5)) + 1):
            dy = i + 0.5 - y
            half = math.sqrt(max(r * r - dy * dy, 0.0))
            for j in range(max(0, math.ceil(x - half - 0.5)), min(w - 1, math.floor(x + half - 0.5)) + 1):
                dx = j + 0.5 - x
                if dx * dx + dy * dy > inner * inner:
                    _put(colours, layer, row, i, j, np.uint8(60), np.uint8(60), np.uint8(60), opacity, number, rows[k])
                else:
                    _put(colours, layer, row, i, j, red, green, blue, opacity, number, rows[k])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _side(ax, ay, bx, by, px, py):
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _owns(ax, ay, bx, by):
    """Return whether a pixel on the edge from a to b belongs to the triangle on its positive side, one of two
    neighbours."""
    return by - ay > 0.0 or (by == ay and bx - ax < 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _triangle(x0, y0, x1, y1, x2, y2, red, green, blue, which, colours, layer, row, number, opacity):
    """Pixels whose middles lie in the triangle; returns how many there are, -1 off the picture."""
    h, w = layer.shape
    low_x, high_x = min(x0, x1, x2), max(x0, x1, x2)
    low_y, high_y = min(y0, y1, y2), max(y0, y1, y2)
    if not (high_x > 0.0 and low_x < w and high_y > 0.0 and low_y < h):
        return -1
    if _side(x0, y0, x1, y1, x2, y2) < 0.0:
        x1, y1, x2, y2 = x2, y2, x1, y1
    first, second, third = _owns(x0, y0, x1, y1), _owns(x1, y1, x2, y2), _owns(x2, y2, x0, y0)
    count = 0
    for i in range(max(0, math.ceil(low_y - 0.5)), min(h - 1, math.floor(high_y - 0.5)) + 1):
        py = i + 0.5
        for j in range(max(0, math.ceil(low_x - 0.5)), min(w - 1, math.floor(high_x - 0.5)) + 1):
            px = j + 0.5
            e0, e1, e2 = (
                _side(x0, y0, x1, y1, px, py), _side(x1, y1, x2, y2, px, py), _side(x2, y2, x0, y0, px, py)
            )  # fmt: skip
            if (
                (e0 > 0.0 or (e0 == 0.0 and first))
                and (e1 > 0.0 or (e1 == 0.0 and second))
                and (e2 > 0.0 or (e2 == 0.0 and third))
            ):
                _put(colours, layer, row, i, j, red, green, blue, opacity, number, which)
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _facet(x, y, z, p, q, r, red, green, blue, which, tri, near, face, colours, layer, row, number, opacity):
    """Pixels whose middles lie in a triangle of the points p, q, r, where nothing is nearer: x, y [pixels], z towards
    the eye. One that lets light through hides nothing, and is reported for a pixel only where there is nothing else."""
    h, w = layer.shape
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = x[p], y[p], z[p], x[q], y[q], z[q], x[r], y[r], z[r]
    low_x, high_x = min(x0, x1, x2), max(x0, x1, x2)
    low_y, high_y = min(y0, y1, y2), max(y0, y1, y2)
    if not (high_x > 0.0 and low_x < w and high_y > 0.0 and low_y < h):
        return
    area = _side(x0, y0, x1, y1, x2, y2)
    if area == 0.0:
        return
    if area < 0.0:
        x1, y1, z1, x2, y2, z2, area = x2, y2, z2, x1, y1, z1, -area
    along = ((z1 - z0) * (y2 - y0) - (z2 - z0) * (y1 - y0)) / area
    down = ((z2 - z0) * (x1 - x0) - (z1 - z0) * (x2 - x0)) / area
    first, second, third = _owns(x0, y0, x1, y1), _owns(x1, y1, x2, y2), _owns(x2, y2, x0, y0)
    for i in range(max(0, math.ceil(low_y - 0.5)), min(h - 1, math.floor(high_y - 0.5)) + 1):
        py = i + 0.5
        for j in range(max(0, math.ceil(low_x - 0.5)), min(w - 1, math.floor(high_x - 0.5)) + 1):
            px = j + 0.5
            e0, e1, e2 = (
                _side(x0, y0, x1, y1, px, py), _side(x1, y1, x2, y2, px, py), _side(x2, y2, x0, y0, px, py)
            )  # fmt: skip
            if (
                (e0 > 0.0 or (e0 == 0.0 and first))
                and (e1 > 0.0 or (e1 == 0.0 and second))
                and (e2 > 0.0 or (e2 == 0.0 and third))
            ):
                depth = z0 + along * (px - x0) + down * (py - y0)
                if depth > near[i, j]:
                    chosen = which if opacity >= 1.0 or layer[i, j] < 0 else NOTHING
                    _put(colours, layer, row, i, j, red, green, blue, opacity, number, chosen)
                    if opacity >= 1.0:
                        near[i, j], face[i, j] = depth, tri


@njit(cache=True, nogil=True, error_model="numpy")
def faces(x, y, z, cells, order, kind, rows, shades, light, near, face, first, target, number, opacity):
    """Triangles and quads (m, 4) of points x, y [pixels], z towards the eye, in this order (m,); kind (m,) of shades
    (c, 3), made darker by light (m,); rows (m,): what is reported of them; near, face (h, w): depth and number, from
    `first` on, of what each pixel shows."""
    colours, layer, row = target
    for n in range(len(order)):
        k = order[n]
        s = shades[kind[k]]
        red, green, blue = np.uint8(light[k] * s[0]), np.uint8(light[k] * s[1]), np.uint8(light[k] * s[2])
        tri = first + k
        _facet(x, y, z, cells[k, 0], cells[k, 1], cells[k, 2], red, green, blue, rows[k], tri, near, face, colours,
               layer, row, number, opacity)  # fmt: skip
        if cells[k, 3] >= 0:
            _facet(x, y, z, cells[k, 0], cells[k, 2], cells[k, 3], red, green, blue, rows[k], tri, near, face, colours,
                   layer, row, number, opacity)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def edges(colours, near, face, normals, outlined, pen):
    """Darken pixels beside the outline of a body, a step in depth, or an edge between faces, of normals (m, 3) towards
    the eye; lighter the outlines of faces that are `outlined` (m,)."""
    h, w = face.shape
    for i in range(h):
        for j in range(w):
            f = face[i, j]
            dark = 0.0
            for shift in range(2):
                m, n = (i, j + pen) if shift == 0 else (i + pen, j)
                if m >= h or n >= w:
                    continue
                g = face[m, n]
                if f == g:
                    continue
                if f < 0 or g < 0:
                    dark = max(dark, 0.65)
                    continue
                a, b = normals[f], normals[g]
                if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < SHARP:
                    dark = max(dark, 0.65)
                    continue
                rise = near[m, n] - near[i, j]
                across, down = n - j, m - i
                of_a = (-a[0] * across + a[1] * down) / max(a[2], 0.05)
                of_b = (-b[0] * across + b[1] * down) / max(b[2], 0.05)
                if min(abs(rise - of_a), abs(rise - of_b)) > STEP * pen:
                    dark = max(dark, 0.65)
                elif outlined[f] or outlined[g]:
                    dark = max(dark, 0.4)
            if dark > 0.0:
                for c in range(3):
                    colours[i, j, c] = np.uint8((1.0 - dark) * colours[i, j, c])


@njit(cache=True, nogil=True, error_model="numpy")
def polygons(points, cells, kind, rows, shades, place, edges, target, number, opacity):
    """Triangles and quads; of one that holds the middle of no pixel, the pixel of its middle. Outlines over them where
    they are wanted and the cells are larger than some pixels."""
    a, b, c, d = place
    colours, layer, row = target
    h, w = layer.shape
    for k in range(len(cells)):
        s = shades[kind[k]]
        red, green, blue = s[0], s[1], s[2]
        p, q, r = cells[k, 0], cells[k, 1], cells[k, 2]
        x0, y0 = a * points[p, 0] + b, c * points[p, 1] + d
        x1, y1 = a * points[q, 0] + b, c * points[q, 1] + d
        x2, y2 = a * points[r, 0] + b, c * points[r, 1] + d
        count = _triangle(x0, y0, x1, y1, x2, y2, red, green, blue, rows[k], colours, layer, row, number, opacity)
        if cells[k, 3] >= 0:
            x3, y3 = a * points[cells[k, 3], 0] + b, c * points[cells[k, 3], 1] + d
            more = _triangle(x0, y0, x2, y2, x3, y3, red, green, blue, rows[k], colours, layer, row, number, opacity)
            count = max(count, more)
        if count == 0:
            i, j = math.floor((y0 + y1 + y2) / 3.0), math.floor((x0 + x1 + x2) / 3.0)
            if 0 <= i < h and 0 <= j < w:
                _put(colours, layer, row, i, j, red, green, blue, opacity, number, rows[k])
    if not edges:
        return
    for k in range(len(cells)):
        n = 4 if cells[k, 3] >= 0 else 3
        for m in range(n):
            p, q = cells[k, m], cells[k, (m + 1) % n]
            x0, y0 = a * points[p, 0] + b, c * points[p, 1] + d
            x1, y1 = a * points[q, 0] + b, c * points[q, 1] + d
            if abs(x1 - x0) + abs(y1 - y0) > 3.0:
                _line(x0, y0, x1, y1, 1, np.uint8(60), np.uint8(60), np.uint8(60), NOTHING, colours, layer, row, number,
                      0.6 * opacity)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _line(x0, y0, x1, y1, width, red, green, blue, which, colours, layer, row, number, opacity):
    """A line as squares of `width` pixels, one per column or row of its longer side, as far as it is in the picture."""
    h, w = layer.shape
    # The part of it that may be on the picture (Liang and Barsky 1984).
    begin, end = 0.0, 1.0
    dx, dy = x1 - x0, y1 - y0
    for shift, extent in ((-dx, x0 + width), (dx, w + width - x0), (-dy, y0 + width), (dy, h + width - y0)):
        if shift == 0.0:
            if extent < 0.0:
                return
        elif shift < 0.0:
            begin = max(begin, extent / shift)
        else:
            end = min(end, extent / shift)
    if not begin <= end:
        return
    x0, y0, x1, y1 = x0 + begin * dx, y0 + begin * dy, x0 + end * dx, y0 + end * dy
    steps = math.ceil(max(abs(x1 - x0), abs(y1 - y0))) + 1
    flat = abs(x1 - x0) >= abs(y1 - y0)
    for m in range(steps):
        part = m / (steps - 1) if steps > 1 else 0.0
        x, y = x0 + part * (x1 - x0), y0 + part * (y1 - y0)
        for n in range(width):
            off = n - 0.5 * (width - 1)
            i, j = (
                math.floor(y + off) if flat else math.floor(y),
                (math.floor(x) if flat else math.floor(x + off)),
            )
            if 0 <= i < h and 0 <= j < w:
                _put(colours, layer, row, i, j, red, green, blue, opacity, number, which)


@njit(cache=True, nogil=True, error_model="numpy")
def lines(ends, kind, rows, shades, place, width, target, number, opacity):
    """Lines of this width in pixels."""
    a, b, c, d = place
    colours, layer, row = target
    for k in range(len(ends)):
        s = shades[kind[k]]
        _line(a * ends[k, 0, 0] + b, c * ends[k, 0, 1] + d, a * ends[k, 1, 0] + b, c * ends[k, 1, 1] + d, width, s[0],
              s[1], s[2], rows[k], colours, layer, row, number, opacity)  # fmt: skip
