"""`SET ps`: frames as encapsulated PostScript, one short line per particle.

True-size discs in the manual's colours, walls in theirs, a box of axes with ticks in km (m, cm or mm for small
models). Written directly, so that the solver needs no plotting library and the cost is that of writing a table.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.io import colours
from hpcdem.io.axes import View, particle_extent, view
from hpcdem.io.behind import Deliveries
from hpcdem.io.files import write_sections
from hpcdem.io.frame import Frame
from hpcdem.io.textnum import FIXED, INT, WORD, Column, TextTable
from hpcdem.io.transport import Section

_POINTS_PER_CM = 72.0 / 2.54
PAGE_WIDTH = 17.0 * _POINTS_PER_CM
PAGE_HEIGHT = 24.0 * _POINTS_PER_CM
FONT = 9.0
_LEFT, _RIGHT, _BOTTOM, _TOP = 24.0, 12.0, 32.0, 10.0  # margins; the left one without the numbers
_DIGIT = 5.2
_MAJOR, _MINOR = 5.0, 2.5  # lengths of ticks, outwards

# Operators of the picture: `x y radius colour b` is a ball, `x1 y1 x2 y2 colour w` a wall, `x1 y1 x2 y2 l` a line,
# `(text) x y c` centred, `r` right-aligned text. Sizes and positions in points.
_PROLOGUE = """\
/palette [{palette}] def
/k {{ palette exch get aload pop setrgbcolor }} bind def
/b {{ k newpath 0 360 arc fill }} bind def
/l {{ newpath moveto lineto stroke }} bind def
/w {{ k l }} bind def
/c {{ moveto dup stringwidth pop -2 div 0 rmoveto show }} bind def
/r {{ moveto dup stringwidth pop neg 0 rmoveto show }} bind def
/Helvetica findfont {font:g} scalefont setfont
gsave {left:.3f} {bottom:.3f} {width:.3f} {height:.3f} rectclip
"""


def write_ps(path: str | os.PathLike, frame: Frame, comm: Comm, later: Deliveries | None = None) -> None:
    """Collective: the picture of the frame, the same bytes for any number of ranks. Raises HpcdemError on all ranks."""
    write_sections(path, comm, lambda: _sections(frame, comm), later)


@dataclass(frozen=True)
class _Page:
    """Position of the view on the page: points per metre, and the axes' box in points."""

    seen: View
    scale: float
    left: float
    width: float
    height: float

    def place(self, x: np.ndarray | float, y: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Positions in points; what is far off the page is drawn nowhere, so it may as well be just outside."""
        u = self.left + self.scale * (np.asarray(x) - self.seen.left)
        v = _BOTTOM + self.scale * (np.asarray(y) - self.seen.bottom)
        return np.clip(u, -9999.0, 9999.0), np.clip(v, -9999.0, 9999.0)


def _page(seen: View) -> _Page:
    left = _LEFT + _DIGIT * max(map(len, seen.ticks()[1].labels), default=0)
    scale = min((PAGE_WIDTH - left - _RIGHT) / seen.width, (PAGE_HEIGHT - _BOTTOM - _TOP) / seen.height)
    return _Page(seen, scale, left, scale * seen.width, scale * seen.height)


def _sections(frame: Frame, comm: Comm) -> list[Section]:
    left, right, bottom, top = particle_extent(frame)
    lows = comm.min_into(np.array([left, bottom]))
    highs = comm.max_into(np.array([right, top]))
    page = _page(view(frame, (lows[0], highs[0], lows[1], highs[1])))

    columns = frame.tables["particles"].columns
    place = page.place(columns["x"], columns["y"])
    balls = [(Column(name, FIXED, 10, 3), v) for name, v in zip("xyr", (*place, page.scale * columns["radius"]))]
    kind = Column("color", INT, 2), colours.numbers(columns["color"])
    operator = Column("b", WORD, 2), np.zeros(len(place[0]), dtype=np.int64)

    width, height = page.left + page.width + _RIGHT, _BOTTOM + page.height + _TOP
    head = [
        "%!PS-Adobe-3.0 EPSF-3.0",
        f"%%BoundingBox: 0 0 {math.ceil(width)} {math.ceil(height)}",
        f"%%HiResBoundingBox: 0 0 {width:.3f} {height:.3f}",
        "%%Creator: hpcdem",
        f"%%Title: step {frame.step}",
        "%%EndComments\n",
    ]
    palette = " ".join(f"[{r:g} {g:g} {b:g}]" for r, g, b in colours.RGB)
    prologue = _PROLOGUE.format(
        palette=palette, font=FONT, left=page.left, bottom=_BOTTOM, width=page.width, height=page.height
    )
    return [
        ("\n".join(head) + prologue).encode(),
        TextTable([*balls, kind, operator], ["b"]),
        _walls(frame, page).encode(),
        _axes(page).encode(),
        b"showpage\n%%EOF\n",
    ]


def _walls(frame: Frame, page: _Page) -> str:
    lines = ["1 setlinewidth 1 setlinecap"]
    ends = [page.place(*np.asarray(frame.walls[p], dtype=float).reshape(-1, 2).T) for p in ("p1", "p2")]
    for x1, y1, x2, y2, color in zip(*ends[0], *ends[1], colours.numbers(frame.walls["color"])):
        lines.append(f"{x1:.3f} {y1:.3f} {x2:.3f} {y2:.3f} {color} w")
    return "\n".join([*lines, "grestore\n"])


def _axes(page: _Page) -> str:
    """The box, ticks outside of it, numbers, and the names of the axes with their unit."""
    size, unit = page.seen.unit
    left, right, top = page.left, page.left + page.width, _BOTTOM + page.height
    lines = ["0 setgray 0.6 setlinewidth 0 setlinecap"]
    lines += [f"{left:.3f} {_BOTTOM:.3f} {page.width:.3f} {page.height:.3f} rectstroke"]
    along_x, along_y = page.seen.ticks()
    for length, xs, ys in ((_MINOR, along_x.minor, along_y.minor), (_MAJOR, along_x.major, along_y.major)):
        for x in page.place(size * np.array(xs), np.zeros(len(xs)))[0]:
            lines.append(f"{x:.3f} {_BOTTOM:.3f} {x:.3f} {_BOTTOM - length:.3f} l")
        for y in page.place(np.zeros(len(ys)), size * np.array(ys))[1]:
            lines.append(f"{left:.3f} {y:.3f} {left - length:.3f} {y:.3f} l")
    for x, text in zip(page.place(size * np.array(along_x.major), 0.0)[0], along_x.labels):
        lines.append(f"({text}) {x:.3f} {_BOTTOM - _MAJOR - FONT:.3f} c")
    for y, text in zip(page.place(0.0, size * np.array(along_y.major))[1], along_y.labels):
        lines.append(f"({text}) {left - _MAJOR - 2:.3f} {y - 0.35 * FONT:.3f} r")
    lines.append(f"(x \\({unit}\\)) {(left + right) / 2:.3f} {_BOTTOM - _MAJOR - 2.3 * FONT:.3f} c")
    lines.append(f"gsave {FONT:g} {(_BOTTOM + top) / 2:.3f} translate 90 rotate (y \\({unit}\\)) 0 0 c grestore")
    return "\n".join(lines) + "\n"
