"""The page as a whole: what it consists of, and its life from the address in the terminal to Ctrl-C."""

from __future__ import annotations

import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping
from importlib import resources
from typing import TYPE_CHECKING, Any

from hpcdem.page.limits import LIMITS
from hpcdem.page.server import Answer, Call, PageServer, as_json
from hpcdem.page.worker import Worker

if TYPE_CHECKING:
    from hpcdem.pre.specimen import Request

KINDS = {
    "index.html": "text/html; charset=utf-8",
    "page.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "page.js": "text/javascript; charset=utf-8",
    "curve.js": "text/javascript; charset=utf-8",
    "packing.js": "text/javascript; charset=utf-8",
    "server.js": "text/javascript; charset=utf-8",
    "words.js": "text/javascript; charset=utf-8",
}
"""The files of the page, and their media types."""
LONGEST_FILE = 600.0
"""Longest time to make a file [s]; the first one waits for kernels to be compiled, once per machine."""
BINARY = "application/octet-stream"


def serve(
    request: Request,
    style: Mapping[str, Any] | None = None,
    port: int = 0,
    browser: bool = True,
    say: Callable[[str], None] = print,
) -> None:
    """Serve the page until Ctrl-C or SIGTERM.

    request: what the page begins with. style: fields of specimens.Style that the files shall have. port 0: a free one.
    say: takes the lines for the terminal. Raises HpcdemError if the request is beyond the page's limits, or the port
    cannot be had.
    """
    from hpcdem.page.maker import values_of

    values = values_of(request)
    drawing, files = Worker(newest_wins=True), Worker(newest_wins=False, longest=LONGEST_FILE)
    server = PageServer(texts(values, style or {}), calls(drawing, files, style or {}), port)
    try:
        drawing.start()
        live(server, browser, say)
    finally:
        drawing.close()
        files.close()


def live(server: PageServer, browser: bool, say: Callable[[str], None]) -> None:
    """Answer until Ctrl-C or SIGTERM. browser: open one where a window can be opened; say: takes the lines for the
    terminal."""
    before = signal.signal(signal.SIGTERM, _stop)
    try:
        say(f"Page: {server.url}")
        say("Only programs on this machine that know this address can open it. Ctrl-C ends it.")
        if browser and can_open():
            threading.Thread(target=webbrowser.open, args=[server.ticket()], daemon=True).start()
        server.serve_forever(poll_interval=0.2)
    except KeyboardInterrupt:
        say("Page closed.")
    finally:
        signal.signal(signal.SIGTERM, before)
        server.server_close()


def texts(values: dict[str, Any], style: Mapping[str, Any]) -> dict[str, Answer]:
    """Return the answers to GET requests by path: the files of the page and its initial values."""
    found = static(KINDS)
    return found | {
        "": found["index.html"],
        "start": as_json({"request": values, "limits": limits(), "falling": bool(style.get("falling"))}),
    }


def static(kinds: Mapping[str, str]) -> dict[str, Answer]:
    """Files of the page, by name, with their media types."""
    folder = resources.files("hpcdem.page") / "static"
    return {name: Answer((folder / name).read_bytes(), kind) for name, kind in kinds.items()}


def limits() -> dict[str, Any]:
    """Least and largest values, and the words there are."""
    from hpcdem.pre.specimen import PLACEMENTS, SHAPES
    from hpcdem.pre.specimen.shapes import SIDES, largest_deviation

    # The angle deviation must stay below its limit; half a degree is the step of the slider.
    deviations = {shape: [0.0, largest_deviation(sides) - 0.5] for shape, sides in SIDES.items()}
    return {**LIMITS, "shapes": SHAPES, "placements": PLACEMENTS, "deviations": deviations}


def calls(drawing: Worker, files: Worker, style: Mapping[str, Any]) -> dict[str, Call]:
    """Return the handlers of POST requests. The style comes from the command line; requests cannot change it."""
    own = {"style": dict(style)}
    return {
        "specimen": lambda wanted: Answer(drawing.ask("specimen", wanted | own), BINARY),
        "file": lambda wanted: Answer(files.ask("file", wanted | own), BINARY),
    }


def can_open() -> bool:
    """Return whether a browser would open in a window; without a display, webbrowser finds programs that occupy the
    terminal."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _stop(*_: object) -> None:
    raise KeyboardInterrupt
