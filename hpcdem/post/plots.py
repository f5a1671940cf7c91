"""Pictures of frames: the figure at the end of a run, and the program zdem2jpg.

matplotlib is imported where it is used, and only its file-writing parts: no window system, no global state.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hpcdem.errors import HpcdemError, UsageError
from hpcdem.io.axes import View, view
from hpcdem.io.files import atomic_path
from hpcdem.io.frame import Frame
from hpcdem.io.frames import list_frames, read_frame
from hpcdem.post.layers import LAYERS

CM = 1.0 / 2.54
PAGE_WIDTH, PAGE_HEIGHT = 17.0 * CM, 22.0 * CM
"""Largest size of a figure [inches]: the width of a printed page."""
FONT = 9.0
_MARGINS = 0.9 * CM, 0.45 * CM, 1.15 * CM, 0.35 * CM  # left (without numbers), right, bottom, top of the axes
_DIGIT = 0.2 * CM
FORMATS = (".jpg", ".jpeg", ".png", ".pdf", ".svg")


MODEL = ("bfill", "wall")
"""The usual picture: filled particles and walls."""


def draw_frame(frame: Frame, ax: Any, seen: View | None = None, what: Sequence[str] = MODEL) -> None:
    """Draw a whole frame into matplotlib axes; what: words of `layers.LAYERS`, in any order.

    The axes get limits, ticks and labels in km (m, cm or mm for small models); their data unit stays the metre, so
    that more can be drawn on top. seen: the part of the plane to show (by default BOX and walls, see `axes.view`).
    """
    seen = view(frame) if seen is None else seen
    ax.set(xlim=(seen.left, seen.right), ylim=(seen.bottom, seen.top), aspect="equal")
    for word, draw in LAYERS.items():
        if word in what:
            draw(frame, ax)
    _draw_axes(ax, seen)


def _draw_axes(ax: Any, seen: View) -> None:
    size, unit = seen.unit
    for axis, ticks in zip((ax.xaxis, ax.yaxis), seen.ticks()):
        axis.set_ticks([v * size for v in ticks.major], labels=ticks.labels, fontsize=FONT)
        axis.set_ticks([v * size for v in ticks.minor], minor=True)
    ax.tick_params(which="major", length=4.0, width=0.6)
    ax.tick_params(which="minor", length=2.0, width=0.6)
    ax.set_xlabel(f"x ({unit})", fontsize=FONT)
    ax.set_ylabel(f"y ({unit})", fontsize=FONT)
    for spine in ax.spines.values():
        spine.set_linewidth(0.6)


def frame_figure(frame: Frame, what: Sequence[str] = MODEL) -> Any:
    """A matplotlib Figure of the frame, as wide as a page; as high as it must be, or narrower if too high."""
    from matplotlib.figure import Figure

    seen = view(frame)
    left, right, bottom, top = _MARGINS
    left += _DIGIT * max(map(len, seen.ticks()[1].labels), default=0)
    scale = min((PAGE_WIDTH - left - right) / seen.width, (PAGE_HEIGHT - bottom - top) / seen.height)
    width, height = scale * seen.width, scale * seen.height
    page = left + width + right, bottom + height + top
    figure = Figure(figsize=page)
    ax = figure.add_axes((left / page[0], bottom / page[1], width / page[0], height / page[1]))
    draw_frame(frame, ax, seen, what)
    return figure


def plot_frame(frame: Frame, path: str | os.PathLike, dpi: float = 300.0, what: Sequence[str] = MODEL) -> Path:
    """Write the picture of a whole frame: JPG, PNG, PDF or SVG by the suffix of `path`.

    what: words of `layers.LAYERS`; dpi: dots per inch of JPG and PNG; the figure is 17 cm wide. Serial. Raises
    HpcdemError.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise HpcdemError(f"cannot draw {path}: pictures end in {', '.join(FORMATS)}")
    try:
        import matplotlib
    except ImportError:
        raise HpcdemError(f"cannot draw {path}: matplotlib is not installed") from None
    figure = frame_figure(frame, what)
    kind = path.suffix.lower().removeprefix(".")
    options: dict[str, Any] = {}
    if kind in ("jpg", "jpeg"):
        options["pil_kwargs"] = {"quality": 92, "subsampling": 0}  # thin coloured layers need their full colour
    elif kind in ("pdf", "svg"):
        options["metadata"] = {"CreationDate": None} if kind == "pdf" else {"Date": None}  # same frame, same file
    # A text in a PDF or SVG stays text; the salt makes an SVG's ids the same every time.
    with matplotlib.rc_context({"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "hpcdem"}):
        with atomic_path(path) as temporary:
            figure.savefig(temporary, format=kind, dpi=dpi, **options)
    return path


# --- zdem2jpg --------------------------------------------------------------------------------------------------

# Options of zdem2jpg in the manual and in its help text that are still to come.
LATER = (
    "xmin xmax ymin ymax xmove ymove major_locator minor_locator fontsize max_workers dpi linewidth pagesize leftshow "
    "rightshow bottomshow topshow wallshow surfaceshow bondplot ballplot colormap showlable showable"
).split()

USAGE = """\
usage: zdem2jpg --dir DIR
Draws every frame all_*.vtkhdf or all_*.dat in DIR as DIR/all_*.jpg."""


def zdem2jpg(folder: str | os.PathLike, report: Callable[[Path], None] | None = None) -> list[Path]:
    """Draw every frame of a folder as a JPG of the same name beside it; returns the paths of the pictures.

    report: called with each path once it is written. Raises HpcdemError, also when there is no frame.
    """
    frames = list_frames(folder)
    if not frames:
        raise HpcdemError(f"no frame all_*.vtkhdf or all_*.dat in {os.fspath(folder)}")
    pictures = []
    for file in frames:
        pictures.append(plot_frame(read_frame(file.path, ("particles",)), file.path.with_suffix(".jpg")))
        if report:
            report(pictures[-1])
    return pictures


def zdem2jpg_folder(words: list[str]) -> str | None:
    """The folder named by the command line of zdem2jpg (without the program's name); None if help is asked for.

    Raises UsageError on anything else, naming options of the manual that are not there yet.
    """
    folder = None
    rest = list(words)
    while rest:
        word = rest.pop(0)
        name, joined, value = word.partition("=")
        if word in ("-h", "--help"):
            return None
        if name == "--dir":
            if not joined and not rest:
                raise UsageError("zdem2jpg: --dir needs a folder")
            folder = value if joined else rest.pop(0)
        elif name.startswith("--") and name[2:] in LATER:
            raise UsageError(f"zdem2jpg: {name} is not supported yet; only --dir DIR is")
        else:
            raise UsageError(f"zdem2jpg: unknown option {word}\n{USAGE}")
    if not folder:
        raise UsageError(f"zdem2jpg: --dir is missing\n{USAGE}")
    return folder
