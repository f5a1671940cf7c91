"""Files that `hpcdem view` makes of what it shows: pictures, vectors, drawings, tables, pages, films."""

from __future__ import annotations

import base64
import colorsys
import html
import io
import tempfile
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.frames import FrameFile
from hpcdem.page.limits import LONGEST_FILM
from hpcdem.page.server import BusyError
from hpcdem.post import movie
from hpcdem.post.view.model import ModelView
from hpcdem.post.view.moment import DISCS, FACES, POLYGONS, RODS, SOLIDS, Moment, read_moment
from hpcdem.post.view.paper import Paper, draw
from hpcdem.post.view.scene import Painted, scene, seen_of, shared

FILMS = ("gif", "mp4")
FORMATS = {
    "png": "image/png", "svg": "image/svg+xml", "pdf": "application/pdf", "dxf": "image/vnd.dxf", "csv": "text/csv",
    "html": "text/html", "gif": "image/gif", "mp4": "video/mp4",
}  # fmt: skip
"""Media types of the formats."""
PAPER = Paper(dpi=200.0)
MOST_VECTORS = 20_000
"""Largest number of objects drawn as vectors; pages with more contain a picture of pixels."""
_drawing = threading.Lock()
"""Lock of the settings of matplotlib, which the process shares."""
_filming = threading.Lock()
"""Lock that admits one film at a time; pictures are drawn between its frames."""


def kinds() -> list[str]:
    """List the formats in which a picture can be saved; MP4 only where ffmpeg is installed."""
    return [kind for kind in (*FORMATS, "mv") if kind != "mp4" or movie.ffmpeg() is not None]


def file(moment: Moment, view: ModelView, kind: str, wanted: dict[str, Any]) -> bytes:
    """A file of this kind of one frame. wanted: "label" of the layer of a table. Raises HpcdemError."""
    if kind == "csv":
        return table(moment, view, wanted.get("label"))
    if kind == "dxf":
        return drawing(moment, view)
    if kind == "html":
        return page(moment, view)
    return _drawn(moment, view, kind)


def _drawn(moment: Moment, view: ModelView, kind: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder, _drawing:
        return draw(moment, Path(folder) / f"a.{kind}", view, PAPER).read_bytes()


def table(moment: Moment, view: ModelView, label: Any) -> bytes:
    """The objects that a layer shows, one per line: number, place, all fields and components of vectors."""
    layer = view.layer(str(label)) if label else next((one for one in view.layers if one.visible), None)
    if layer is None:
        raise HpcdemError("no layer is chosen")
    shown = scene(moment, view.changed(layers=[layer.model_dump() | {"visible": True}])).layers[0]
    objects = moment.of(layer.object)
    axes = "xyz"[: objects.dim]
    names = [name for name in objects.known() if name in objects.fields and name not in tuple(axes)]
    columns = [np.asarray(objects.fields[name])[shown.rows] for name in names]
    middle = objects.centres()[shown.rows]
    titles = [*axes, *names]
    columns = [*middle.T, *columns]
    for name, values in objects.vectors.items():
        titles += [f"{name}_{axis}" for axis in axes]
        columns += list(np.asarray(values)[shown.rows].T)
    text = io.StringIO()
    text.write(",".join(titles) + "\n")
    for row in zip(*(column.tolist() for column in columns), strict=True):
        text.write(",".join("" if value != value else repr(value) for value in row) + "\n")
    return text.getvalue().encode()


def drawing(moment: Moment, view: ModelView) -> bytes:
    """DXF (R12) with a layer per layer: circles, filled polygons, lines, in the nearest of its 255 colours. Not by
    ezdxf: the page does without packages that are extras."""
    known = _dxf_colours()
    lines = ["0", "SECTION", "2", "ENTITIES"]
    for painted in scene(moment, view).layers:
        near = 1 + np.array([((known - shade) ** 2).sum(axis=1).argmin() for shade in painted.shades], int)
        lines += _dxf_layer(painted, near)
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""]).encode()


def _dxf_colours() -> np.ndarray:
    """(255, 3) fractions of red, green and blue of the colours 1 to 255: six pure ones, white and greys, then 24 hues
    in five depths, each pure and pale, and greys."""
    pure = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1), (1, 1, 1)]
    hues = []
    for hue in range(24):
        full = np.array(colorsys.hsv_to_rgb(hue / 24.0, 1.0, 1.0))
        for depth in (1.0, 165.0 / 255.0, 0.5, 0.3, 0.15):
            hues += [depth * full, depth * 0.5 * (full + 1.0)]
    greys = [np.full(3, v / 255.0) for v in (128, 192, 0, 101, 102, 153, 204, 255)]
    return np.array([*pure, *greys[:2], *hues, *greys[2:]])


def _dxf_layer(painted: Painted, near: np.ndarray) -> list[str]:
    """Write the entities of a layer as lines of codes and values."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in painted.layer.label).upper() or "LAYER"
    lines: list[str] = []

    def entity(kind: str, colour: int, places: Iterable[np.ndarray], *more: str) -> None:
        lines.extend(("0", kind, "8", name, "62", str(colour)))
        for n, place in enumerate(places):
            for axis, value in enumerate((*place, 0.0)[:3]):
                lines.extend((f"{axis + 1}{n}", f"{value:.12g}"))
        lines.extend(more)

    def face(corners: np.ndarray, colour: int) -> None:
        entity("3DFACE", colour, [*corners, corners[-1]][:4])

    if painted.kind_of_shape in (SOLIDS, FACES, RODS):  # what is seen, where it is in space
        points, cells, of, _ = painted.shape
        for corners, kind in zip(cells, painted.kind[of]):
            face(points[corners[corners >= 0]], near[kind])
        return lines
    for k, kind in enumerate(painted.kind):
        if painted.kind_of_shape == DISCS:
            entity("CIRCLE", near[kind], painted.shape[0][k : k + 1], "40", f"{painted.shape[1][k]:.12g}")
        elif painted.kind_of_shape == POLYGONS:
            points, cells = painted.shape
            face(points[cells[k][cells[k] >= 0]], near[kind])
        else:
            entity("LINE", near[kind], painted.shape[0][k])
    return lines


def page(moment: Moment, view: ModelView) -> bytes:
    """Write a self-contained page: the figure, which the wheel enlarges and the mouse moves."""
    count = sum(len(layer.rows) for layer in scene(moment, view).layers)
    if count <= MOST_VECTORS:
        text = _drawn(moment, view, "svg").decode()
        figure = text[text.index("<svg") :]
    else:
        figure = f'<img alt="" src="data:image/png;base64,{base64.b64encode(_drawn(moment, view, "png")).decode()}">'
    title = html.escape(f"hpcdem, step {moment.step}, {moment.time:.6g} s")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
        "<style>body{margin:0;overflow:hidden;background:#fff}#f{transform-origin:0 0;cursor:grab;width:100vw}"
        "#f>*{width:100vw;height:100vh;object-fit:contain}</style></head>\n"
        f'<body><div id="f">{figure}</div>\n<script>\n{_MOVED}</script></body></html>\n'
    ).encode()


_MOVED = """const f = document.getElementById("f"); let s = 1, x = 0, y = 0, at = null;
const put = () => { f.style.transform = `translate(${x}px,${y}px) scale(${s})`; };
addEventListener("wheel", e => { e.preventDefault(); const k = Math.exp(-e.deltaY / 500);
  x = e.clientX - k * (e.clientX - x); y = e.clientY - k * (e.clientY - y); s *= k; put(); }, { passive: false });
addEventListener("pointerdown", e => { e.preventDefault(); at = [e.clientX - x, e.clientY - y]; });
addEventListener("pointermove", e => { if (at) { x = e.clientX - at[0]; y = e.clientY - at[1]; put(); } });
addEventListener("pointerup", () => { at = null; });
addEventListener("dblclick", () => { s = 1; x = y = 0; put(); });
"""


def film(files: Sequence[FrameFile], view: ModelView, kind: str, wanted: dict[str, Any]) -> bytes:
    """Make a film of all frames with a fixed view and one range of colours. Raises HpcdemError."""
    fps = wanted.get("fps", 10)
    if not isinstance(fps, (int, float)) or not 0.1 <= fps <= 60.0:
        raise HpcdemError(f"fps: expected a number from 0.1 to 60, read {fps}")
    if len(files) > LONGEST_FILM:
        raise HpcdemError(
            f"{len(files)} frames: a film of the page has at most {LONGEST_FILM}; "
            f"`hpcdem draw DIR -o film.{kind}` makes longer ones"
        )
    if not _filming.acquire(blocking=False):
        raise BusyError("another film is being made; try again when it is done")
    try:
        return _filmed(files, view, kind, float(fps))
    finally:
        _filming.release()


def _filmed(files: Sequence[FrameFile], view: ModelView, kind: str, fps: float) -> bytes:
    view = shared(view, (read_moment(file.path) for file in files))
    if view.camera is None and files:
        seen = seen_of(read_moment(files[-1].path), view)
        view = view.changed(camera=(seen.left, seen.right, seen.bottom, seen.top))
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for k, one in enumerate(files):
            with _drawing:
                pictures.append(draw(one.path, Path(folder) / f"{k:06d}.png", view, Paper(dpi=150.0)))
        path = Path(folder) / f"film.{kind}"
        (movie.write_gif if kind == "gif" else movie.write_mp4)(pictures, path, fps)
        return path.read_bytes()
