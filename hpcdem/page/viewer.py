"""The answers of `hpcdem view`: pictures of a view from a camera, what a pixel shows, histories, files.

Requests say all of it (frame, view, size), so that two windows, or two tabs, do not get into each other's way; what was
put together for the last pictures is kept, since most requests change the camera only.
"""

from __future__ import annotations

import io
import json
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core import units
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.picture_words import COLOURS, EYES, OBJECTS
from hpcdem.io.axes import UNITS as AXES
from hpcdem.lang import chinese
from hpcdem.page import exports
from hpcdem.page.curves import as_csv
from hpcdem.page.desk import Desk
from hpcdem.page.lifetime import live, static
from hpcdem.page.limits import KINDS as KINDS_OF_VALUES
from hpcdem.page.limits import LONGEST_SIDE, MOST_PIXELS, PICTURES
from hpcdem.page.maker import packed
from hpcdem.page.server import Answer, BusyError, Call, PageServer, as_json
from hpcdem.page.sources import Sources
from hpcdem.post.view.model import Layer, ModelView, read_view, view_of, written
from hpcdem.post.view.moment import BALLS, RODS, SPOTS, Moment, read_moment
from hpcdem.post.view.scene import (
    Painted,
    Scene,
    default_view,
    painted,
    plane_of,
    seen_of,
    shades_of,
    shift_of,
    sliced,
    turn_of,
)

if TYPE_CHECKING:
    from hpcdem.post.view.screen import Picture

KINDS = {
    "viewer.html": "text/html; charset=utf-8",
    "page.css": "text/css; charset=utf-8",
    "viewer.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "viewer.js": "text/javascript; charset=utf-8",
    "viewer_words.js": "text/javascript; charset=utf-8",
    "charts.js": "text/javascript; charset=utf-8",
    "desk.js": "text/javascript; charset=utf-8",
    "words.js": "text/javascript; charset=utf-8",
    "server.js": "text/javascript; charset=utf-8",
}
KEPT = 24
"""Number of assembled layers that are kept."""
BYTES = 20e6
"""Largest size of stored layers of other frames [bytes]."""
MOVED = ("elements", "joints")
"""Objects drawn deformed; joints in space lie on faces of elements."""
FINE = 2
"""Square root of the number of samples averaged for each pixel of a still picture."""
FINEST = 2560 * 1600
"""Number of pixels beyond which still pictures are not refined, as it would take ten seconds."""


def serve(
    paths: list[Path], view: Path | None = None, port: int = 0, browser: bool = True,
    say: Callable[[str], None] = print, desk: Desk | None = None,
) -> None:  # fmt: skip
    """Serve the page until Ctrl-C or SIGTERM. view: a file *.mv to begin with; desk: what runs scripts, if it may.
    HpcdemError if there is nothing to show, or the port cannot be had."""
    viewer = Viewer(Sources(paths, empty=desk is not None), read_view(view) if view is not None else None, desk)
    page = static(KINDS)
    calls = viewer.calls() | ({} if desk is None else desk.calls())
    server = PageServer(
        page | {"": page["viewer.html"], "desk": as_json({"run": desk is not None})}, calls, port, KINDS_OF_VALUES
    )
    threading.Thread(target=viewer.warm_up, daemon=True).start()
    try:
        live(server, browser, say)
    finally:
        if desk is not None:
            desk.console.end()


class Viewer:
    """first: the view that the page begins with, else all that the frame has; desk: what runs scripts, if it may."""

    def __init__(self, sources: Sources, first: ModelView | None = None, desk: Desk | None = None) -> None:
        self.sources, self.first, self.desk = sources, first, desk
        self.warm = False
        self.layers: OrderedDict[tuple, Painted] = OrderedDict()
        self.turn = threading.Lock()
        self.places = threading.BoundedSemaphore(PICTURES)
        self.last: tuple[str, Any, Scene] | None = None
        """The last request, its picture and scene: a click is looked up there."""

    def calls(self) -> dict[str, Call]:
        """Return the handlers of POST requests by name."""
        return {
            "state": lambda wanted: as_json(self.state()),
            "about": self._in_turn(self.about),
            "fields": self._in_turn(self.fields),
            "picture": self._one_of_few(self.picture),
            "pick": self._in_turn(self.pick),
            "curves": self.curves,
            "presets": lambda wanted: as_json({"presets": self.sources.curves().presets()}),
            "tell": lambda wanted: as_json({"said": self.sources.send_signal(wanted.get("what"))}),
            "view": lambda wanted: as_json(self._view(wanted).model_dump()),
            "file": self._one_of_few(self.file),
        }

    def _one_of_few(self, answer: Call) -> Call:
        """Limit the pictures made at once, to leave threads for other requests. Raises BusyError if too many wait."""

        def call(wanted: dict[str, Any]) -> Answer:
            if not self.places.acquire(blocking=False):
                raise BusyError(f"{PICTURES} pictures are being made; try again in a moment")
            try:
                return answer(wanted)
            finally:
                self.places.release()

        return call

    def _in_turn(self, answer: Callable[[dict[str, Any]], dict[str, Any]]) -> Call:
        """Serialize requests: the stored data of a frame serve one request at a time."""

        def call(wanted: dict[str, Any]) -> Answer:
            with self.turn:
                return as_json(answer(wanted))

        return self._one_of_few(call)

    def warm_up(self) -> None:
        """Compile or load the kernels before the first picture is requested."""
        from hpcdem.post.view import warm_up

        with self.turn:
            warm_up.in_plane()
            self.warm = True
            warm_up.in_space()

    # ---- what there is ---------------------------------------------------------------------------------------------

    def about(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Objects of a frame, the view to begin with, colours, and the part of the plane that holds everything; in
        space the corners of the box that does."""
        moment = self._moment(wanted)[1]
        view = default_view(moment) if self.first is None else self.first
        left, right, bottom, top = (lambda seen: (seen.left, seen.right, seen.bottom, seen.top))(
            seen_of(moment, ModelView())
        )
        return {
            "step": moment.step, "time": moment.time, "view": view.model_dump(), "whole": [left, right, bottom, top],
            "objects": {name: objects.count for name, objects in moment.objects.items()},
            "lengths": [(0.0, 1.0, units.label(moment.units, "m"))] if moment.units else AXES,
            "unit": units.label(moment.units, "m"), "order": list(OBJECTS),
            "displaced": moment.displacement is not None,
            "colours": {name: _stops(name) for name in COLOURS}, "box": _box(moment), "eyes": EYES,
            "files": exports.kinds(), "chinese": _in_chinese(moment),
            "most": {"pixels": MOST_PIXELS, "side": LONGEST_SIDE},
        }  # fmt: skip

    def state(self) -> dict[str, Any]:
        """Frames, the run, histories; where there is no picture yet, why."""
        answer = self.sources.state()
        waiting: dict[str, Any] = {"drawing": not self.warm}
        if not answer["sources"]:
            waiting |= self.sources.waiting()
            if self.desk is not None and (waiting["kind"] == "empty" or self.desk.console.alive):
                waiting["kind"] = "first" if self.desk.console.busy else "desk"
        return answer | {"waiting": waiting}

    def curves(self, wanted: dict[str, Any]) -> Answer:
        """Histories over each other, or a chart of the script; as CSV all of their points."""
        curves, whole = self.sources.curves(), wanted.get("format") == "csv"
        if wanted.get("chart") is not None:
            answer = curves.chart(wanted["chart"], whole)
        else:
            answer = curves.drawn(wanted.get("x"), wanted.get("y"), whole)
        return Answer(as_csv(answer).encode(), "text/csv") if whole else as_json(answer)

    def fields(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Fields and vectors of a kind of object, with their units."""
        moment = self._moment(wanted)[1]
        objects = moment.of(str(wanted.get("object")))
        waiting = objects.waiting()
        return {
            "fields": [
                [name, moment.unit_of(name)]
                for name in (*objects.fields, *objects.of_vectors())
                if name in waiting or objects.filled(name)
            ],
            "vectors": list(objects.vectors),
        }

    # ---- pictures --------------------------------------------------------------------------------------------------

    def picture(self, wanted: dict[str, Any]) -> Answer:
        """A picture with what the legend says: a header in JSON and the bytes, see maker.packed."""
        began = time.perf_counter()
        with self.turn:
            shown, picture = self._painted(wanted)
        content = io.BytesIO()
        from PIL import Image

        image = Image.fromarray(picture.colours)
        if wanted.get("fine"):
            image.save(content, "PNG", compress_level=1)
        else:
            image.save(content, "JPEG", quality=85)
        header = {
            "step": shown.moment.step, "time": shown.moment.time, "title": shown.title(), "legend": _legend(shown),
            "when": units.with_prefix(shown.moment.time, "s", 6),
            "shown": {layer.layer.label: len(layer.rows) for layer in shown.layers},
            "seconds": time.perf_counter() - began, "number": wanted.get("number"),
            "kind": "image/png" if wanted.get("fine") else "image/jpeg",
        }  # fmt: skip
        bytes_ = np.frombuffer(content.getvalue(), np.uint8)
        return Answer(packed(header, {"image": bytes_}), "application/octet-stream")

    def pick(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Identify the object at a pixel (column, row): its layer, number, and all values."""
        shown, picture = self._painted(wanted | {"fine": False})
        column, row = (wanted.get(name) for name in ("column", "row"))
        h, w = picture.layer.shape
        if not (isinstance(column, int) and isinstance(row, int) and 0 <= column < w and 0 <= row < h):
            raise HpcdemError("there is no such pixel")
        place, which = int(picture.layer[row, column]), int(picture.row[row, column])
        if place < 0:
            return {"object": None}
        layer = shown.layers[place].layer
        objects = shown.moment.of(layer.object)
        values: list[list[Any]] = []
        waiting = objects.waiting()
        for name in (*objects.fields, *objects.vectors):
            if name in waiting or not objects.filled(name):
                continue
            value = objects.value(name, which)
            names = objects.names.get(name)
            if names:
                entry: Any = names[int(value)] if 0 <= int(value) < len(names) else None
            elif np.ndim(value):
                entry = f"({', '.join(f'{part:.6g}' for part in value)})"
            else:
                entry = int(value) if np.asarray(value).dtype.kind in "iub" else _number(float(value))
            unit = shown.moment.unit_of(name)
            values.append([name, entry, unit, _printed(entry if names else value, unit)])
        found_at = {"point": None if picture.near is None else self._hit(shown, picture, int(column), int(row))}
        number = objects.value(objects.number, which) if objects.number in objects.fields else which
        place_of = {axis: float(v) for axis, v in zip("xyz", objects.centre(which))}
        return {
            "object": layer.object, "label": layer.label, "number": int(number), **place_of, **found_at,
            "values": values,
        }  # fmt: skip

    @staticmethod
    def _hit(shown: Scene, picture: Picture, column: int, row: int) -> list[float] | None:
        """The place in space that a pixel shows [m]; None where light goes through."""
        from hpcdem.post.view.screen import transform

        assert shown.turn is not None and picture.near is not None
        if not np.isfinite(picture.near[row, column]):
            return None
        h, w = picture.layer.shape
        a, b, c, d = transform(shown.seen, w, h)
        place = (column + 0.5 - b) / a, (row + 0.5 - d) / c, picture.near[row, column] / a
        return (np.array(place) @ shown.turn).tolist()

    def file(self, wanted: dict[str, Any]) -> Answer:
        """A file of what is shown: picture, vectors, table, drawing, page, film, or the view itself."""
        kind = wanted.get("format")
        view = self._view(wanted)
        if kind == "mv":
            return Answer(written(view).encode(), "application/json")
        if kind not in exports.FORMATS:
            raise HpcdemError(f"format: expected one of {', '.join((*exports.FORMATS, 'mv'))}, read {kind}")
        if kind in exports.FILMS:
            source = self.sources.source(wanted.get("source", 0))
            return Answer(exports.film(source.frames, view, kind, wanted), exports.FORMATS[kind])
        moment = read_moment(self.sources.frame(wanted.get("source", 0), wanted.get("frame", -1)).path)
        return Answer(exports.file(moment, view, kind, wanted), exports.FORMATS[kind])

    # ---- putting together ------------------------------------------------------------------------------------------

    def _view(self, wanted: dict[str, Any]) -> ModelView:
        given = wanted.get("view")
        if not isinstance(given, dict):
            raise HpcdemError("view: expected names and values")
        given = {name: value for name, value in given.items() if (name, value) != ("view", 1)}
        return view_of(given, "view")

    def _moment(self, wanted: dict[str, Any]) -> tuple[tuple[str, int, int], Moment]:
        file = self.sources.frame(wanted.get("source", 0), wanted.get("frame", -1))
        if not self.sources.kept(file) and _size(self.layers) > BYTES:
            self.last = None  # large frames take turns in memory
            self.layers.clear()
        return self.sources.moment(file)

    def _painted(self, wanted: dict[str, Any]) -> tuple[Scene, Any]:
        """Scene and picture of a request; those of the one before if it was the same."""
        from hpcdem.post.view.screen import paint

        key, moment = self._moment(wanted)
        view = self._view(wanted)
        width, height = (wanted.get(name) for name in ("width", "height"))
        if not all(isinstance(v, int) and 1 <= v <= LONGEST_SIDE for v in (width, height)):
            raise UsageError(
                f"width and height: expected whole numbers from 1 to {LONGEST_SIDE}, read {width}, {height}"
            )
        if width * height > MOST_PIXELS:  # type: ignore[operator]
            raise UsageError(f"width and height: {width} x {height} pixels; a picture has at most {MOST_PIXELS:.3g}")
        fine, dark = bool(wanted.get("fine")), bool(wanted.get("dark"))
        asked = json.dumps([key, view.model_dump(), width, height, fine, dark])
        if self.last is not None and self.last[0] == asked:
            return self.last[2], self.last[1]
        shown = self._scene(key, moment, view)
        finely = fine and width * height <= FINEST  # type: ignore[operator]
        picture = paint(shown, int(width), int(height), FINE if finely else 1, dark)  # type: ignore[arg-type]
        self.last = asked, picture, shown
        return shown, picture

    def _scene(self, key: tuple, moment: Moment, view: ModelView) -> Scene:
        """Build the scene like `scene.scene`, but reuse layers that were assembled before."""
        seen = seen_of(moment, view)
        shifted, plane = None, plane_of(moment, view)
        cut, alone = None if plane is None else tuple(np.concatenate(plane).tolist()), sliced(view)
        layers = []
        for layer in view.layers:
            if not layer.visible or layer.object not in moment.objects:
                continue
            # Arrows, rods and points are as large as the picture is wide; all else does not know the camera.
            on_paper = layer.vectors or moment.of(layer.object).kind in (SPOTS, RODS, BALLS)
            about = (
                key,
                layer.model_dump_json(exclude={"name"}),
                view.deformed,
                cut,
                alone,
                seen if on_paper else None,
            )
            if about not in self.layers:
                while self.layers and (len(self.layers) >= KEPT or _older(self.layers, key)):
                    self.layers.popitem(last=False)
                if shifted is None and layer.object in MOVED:
                    shifted = shift_of(moment, view.deformed)
                moved = shifted if layer.object in MOVED else None
                self.layers[about] = painted(moment, layer, seen, moved, plane=plane, alone=alone)
            self.layers.move_to_end(about)
            found = self.layers[about]
            if found.layer.label != layer.label:
                found.layer = layer
            layers.append(found)
        return Scene(moment, view, seen, layers, turn_of(moment, view))


def _box(moment: Moment) -> list[list[float]] | None:
    """The corner with the least x, y and z of all that is there in space, and that with the greatest."""
    if moment.dim != 3:
        return None
    points = moment.of("elements").read()[0]
    points = points[np.isfinite(points).all(axis=1)]
    return [points.min(axis=0).tolist(), points.max(axis=0).tolist()] if len(points) else [[0.0] * 3, [1.0] * 3]


def _in_chinese(moment: Moment) -> dict[str, dict[str, str]]:
    """Translate the names of fields, colours and legend entries into Chinese."""
    names = {name for objects in moment.objects.values() for name in (*objects.fields, *objects.of_vectors())}
    return {
        "fields": {name: chinese.field_name(name) for name in sorted(names)}, "colours": chinese.COLOURS,
        "legend": chinese.LEGEND,
    }  # fmt: skip


def _older(layers: OrderedDict[tuple, Painted], key: tuple) -> bool:
    """Return whether the layers exceed BYTES and the oldest belongs to another frame than `key`."""
    return _size(layers) > BYTES and next(iter(layers))[0] != key


def _size(layers: OrderedDict[tuple, Painted]) -> int:
    return sum(part.nbytes for layer in layers.values() for part in (*layer.shape, layer.kind, layer.rows))


def _legend(shown: Scene) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = []
    for layer in shown.layers:
        if layer.scale is not None:
            entries.append({
                "label": layer.layer.label, "field": layer.layer.field, "title": layer.scale.title,
                "low": layer.scale.low,
                "high": layer.scale.high, "log": layer.scale.log, "colours": layer.scale.colours,
                "unit": layer.scale.unit, "ticks": layer.scale.ticks(), "below": layer.scale.below,
                "above": layer.scale.above,
            })  # fmt: skip
        elif layer.legend:
            entries.append({"label": layer.layer.label, "classes": layer.legend})
        if layer.reference is not None:
            part = layer.reference.length / shown.seen.width
            entries.append({"label": layer.layer.label, "arrow": layer.reference.text, "part": part,
                         "vectors": layer.layer.vectors})  # fmt: skip
    return entries


def _stops(name: str) -> list[str]:
    """Return some colours of a field for the bar on the page."""
    shades = np.rint(255.0 * shades_of(name)[:: 256 // 16]).astype(int)
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in [*shades, np.rint(255.0 * shades_of(name)[-1]).astype(int)]]


def _printed(value: Any, unit: str) -> str:
    """A value as text, with the prefix of its size; for a vector its length and components."""
    if value is None or isinstance(value, str):
        return value or "–"
    if np.ndim(value):
        length = float(np.sqrt((np.asarray(value) ** 2).sum()))
        size, name = units.scale(length, unit)
        parts = ", ".join(f"{part / size:.6g}" for part in value)
        return f"{length / size:.6g} {units.printed(name)} ({parts})"
    if np.asarray(value).dtype.kind in "iub":
        return str(int(value))
    return units.printed(units.with_prefix(float(value), unit, 6)) if np.isfinite(value) else "–"


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


__all__ = ["Layer", "Viewer", "serve"]
