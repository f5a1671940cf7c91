"""The process behind the page: requests in at stdin, specimens and files out at stdout (worker.py is the other end)."""

from __future__ import annotations

import io
import json
import math
import os
import struct
import sys
import tempfile
import time
import traceback
import zipfile
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import HpcdemError, ScriptError, UsageError
from hpcdem.page.limits import LIMITS, MOST_ROWS
from hpcdem.page.worker import BROKEN, FRAME, MADE, READY, REFUSED

if TYPE_CHECKING:
    from hpcdem.pre.specimen import Request, Specimen

TABLE = "table"
"""Name of the table of the page in messages, instead of a file name."""
MM = 1e3
FIGURES = ("png", "svg")
ARCHIVE = "specimen.zip"


def main() -> None:
    """Answer until stdin ends."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints must not get between the answers
    warm_up()
    _write(answers, READY, b"")
    while True:
        head = requests.read(FRAME.size)
        if len(head) < FRAME.size:
            return  # the server has ended
        task, request = json.loads(requests.read(FRAME.unpack(head)[1]))
        try:
            code, answer = MADE, TASKS[task](request)
        except HpcdemError as error:
            code, answer = REFUSED, str(error).encode()
        except Exception as error:
            traceback.print_exc()
            code, answer = BROKEN, f"{type(error).__name__}: {error}".encode()
        try:
            _write(answers, code, answer)
        except BrokenPipeError:
            return


def warm_up() -> None:
    """Compile or load every kernel, and import every module, that a specimen of the page needs."""
    from hpcdem.runtime import kept

    kept.install()
    from hpcdem.pre.specimen import PLACEMENTS, SHAPES, Request, make_specimen

    for shape in SHAPES:
        for placement in PLACEMENTS:
            made = make_specimen(Request((2.0, 1.0), (100.0, 50.0), shape, 20, void_ratio=1.0, placement=placement))
            contents(made, {})


def _write(pipe: IO[bytes], code: int, answer: bytes) -> None:
    pipe.write(FRAME.pack(code, len(answer)) + answer)
    pipe.flush()


# -- what the page asks for ------------------------------------------------------------------------------------


def request_of(wanted: dict[str, Any]) -> Request:
    """The library's request. Raises HpcdemError that begins with `table:ROW:` or with the name of a field."""
    from hpcdem.pre.specimen import PLACEMENTS, SHAPES, Request, parse_grading
    from hpcdem.pre.specimen.shapes import APPLIES

    grading = parse_grading(_text(wanted.get("rows")), TABLE)
    values: dict[str, Any] = {}
    for name, (low, high) in LIMITS.items():
        value: Any = wanted.get(name)
        whole = name in ("number", "seed")
        right = isinstance(value, (int, float)) and not isinstance(value, bool) and low <= value <= high
        if not right or (whole and value != int(value)):
            kind = "a whole number" if whole else "a number"
            read = "nothing" if value is None else str(value)[:20]
            raise HpcdemError(f"{name}: read {read}, expected {kind} from {low:.16g} to {high:.16g}")
        values[name] = int(value) if whole else float(value)
    for name, words in (("shape", SHAPES), ("placement", PLACEMENTS)):
        if wanted.get(name) not in words:
            raise HpcdemError(f"{name}: expected one of {', '.join(words)}")
        values[name] = wanted[name]
    # Of the command line alone; the library has an opinion about their values.
    kinds: dict[str, Any] = {"size_rule": str, "mass_exponent": int, "cell": (int, float)}
    for name, kind in kinds.items():
        if name in wanted:
            if not isinstance(wanted[name], kind) or isinstance(wanted[name], bool):
                raise HpcdemError(f"{name}: read {str(wanted[name])[:20]}, which is not allowed")
            values[name] = wanted[name]
    values = {name: value for name, value in values.items() if values["shape"] in APPLIES.get(name, SHAPES)}
    return Request(sizes=tuple(grading.sizes), percents=tuple(grading.percent), **values)


def values_of(request: Request) -> dict[str, Any]:
    """The opposite of `request_of`. Raises HpcdemError for what the page cannot show."""
    if request.number is None:
        raise UsageError("the page needs the number of grains: give --number, not --width")
    values = {field.name: getattr(request, field.name) for field in fields(request)}
    rows = [[f"{size:.12g}", f"{percent:.12g}"] for size, percent in zip(values.pop("sizes"), values.pop("percents"))]
    del values["width"]
    request_of(values | {"rows": rows})
    return values | {"rows": rows}


def _text(rows: Any) -> str:
    """The table as the text of a grading file, row k in line k."""
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == 2 for row in rows):
        raise HpcdemError(f"{TABLE}: expected rows of two values")
    if len(rows) > MOST_ROWS:
        raise HpcdemError(f"{TABLE}: {len(rows)} rows, at most {MOST_ROWS} can be drawn")
    lines = []
    for k, row in enumerate(rows, 1):
        cells = [str(cell).strip() for cell in row]
        one_word = [len(cell.split()) == 1 and "#" not in cell for cell in cells]
        if any(cells) and not all(one_word):
            raise ScriptError(
                TABLE, k, f"read '{' '.join(cells).strip()[:60]}', expected a size in mm and the per cent finer"
            )
        lines.append(" ".join(cells))
    return "\n".join(lines)


def specimen(wanted: dict[str, Any]) -> bytes:
    """Make a specimen and pack it for the page: 4 bytes with the length of a header, the header, arrays (see
    static/server.js)."""
    from hpcdem.pre.specimen import make_specimen

    request = request_of(wanted)
    began = time.perf_counter()
    made = make_specimen(request)
    header, arrays = contents(made, wanted.get("style", {}))
    return packed(header | {"command": command(wanted), "seconds": time.perf_counter() - began}, arrays)


def contents(made: Specimen, style: dict[str, Any]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the header (description and names of files) and the arrays that the page draws."""
    return described(made) | {"files": list(written(made, style))}, drawn(made)


def described(made: Specimen) -> dict[str, Any]:
    """Describe a specimen for the page; lengths in mm."""
    from hpcdem.post.specimen import class_colours

    rows, reached, asked = made.rows, made.achieved, made.request
    left, right, bottom, top = made.outlines.boxes().T
    return {
        "shape": asked.shape,
        "number": asked.number,
        "placed": len(made),
        "classes": [
            {
                "size": row.size,
                "target": row.target,
                "reached": row.by_area,
                "count": row.count,
                "needed": _whole(row.needed),
                "colour": colour,
            }
            for row, colour in zip(rows, class_colours(len(rows)))
        ],
        "needed": max((_whole(row.needed) or 0 for row in rows), default=0),
        "box": {"width": made.width * MM, "height": made.height * MM},
        "solid_area": float(made.area.sum()) * MM**2,
        "void_ratio": {"target": asked.void_ratio, "reached": made.density.void_ratio},
        "cu": {"target": _number(made.grading.uniformity), "reached": _number(reached.uniformity)},
        "cc": {"target": _number(made.grading.curvature), "reached": _number(reached.curvature)},
        "extent": [left.min() * MM, bottom.min() * MM, right.max() * MM, top.max() * MM],
        "notes": list(made.notes),
    }


def drawn(made: Specimen) -> dict[str, np.ndarray]:
    """Arrays of the grains [mm]: class, centre, reach, and unless all are circles the arcs of the outlines."""
    arrays: dict[str, np.ndarray] = {"cx": made.x * MM, "cy": made.y * MM, "reach": made.reach * MM}
    if made.request.shape != "circle":
        outlines = made.outlines
        arrays |= {"vx": outlines.x * MM, "vy": outlines.y * MM, "theta": outlines.theta}
    arrays = {name: values.astype("<f4") for name, values in arrays.items()}
    if made.request.shape != "circle":
        arrays["start"] = made.outlines.start.astype("<i4")
    return arrays | {"kind": made.class_of.astype("u1")}


def packed(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> bytes:
    """Length of the header (u4), the header with the places of the arrays behind it, the arrays; all at multiples of
    four bytes, as the browser's views of arrays want it."""
    table, pieces, offset = [], [], 0
    for name, values in arrays.items():
        kind = f"{values.dtype.kind}{values.dtype.itemsize}"
        table.append({"name": name, "type": kind, "count": len(values), "offset": offset})
        pieces.append(_padded(values.tobytes(), b"\0"))
        offset += len(pieces[-1])
    text = _padded(json.dumps(header | {"arrays": table}, allow_nan=False).encode(), b" ")
    return b"".join([struct.pack("<I", len(text)), text, *pieces])


def _padded(content: bytes, filling: bytes) -> bytes:
    return content + filling * (-len(content) % 4)


# -- files -----------------------------------------------------------------------------------------------------


def written(made: Specimen, style: dict[str, Any]) -> dict[str, Callable[[Path], object]]:
    """Name of each file of a specimen, and the function that writes it: those of the command line, and the PPDEM file
    in the layout of the other reading where there is one."""
    from hpcdem.commands.specimens import Outputs, Style
    from hpcdem.pre.specimen.shapes import SIDES

    style = {**style, "formats": tuple(style.get("formats", FIGURES))}
    files = Outputs(made, Style(**style)).files
    other = {"circle": "plain", **dict.fromkeys(SIDES, "full")}.get(made.request.shape)
    if other is None:
        return dict(files)
    second = Outputs(made, Style(**{**style, "layout": other})).files["specimen.dat"]
    return {"specimen.dat": files["specimen.dat"], f"specimen_{other}.dat": second} | files


def file(wanted: dict[str, Any]) -> bytes:
    """Make one file of a specimen, or all of them in a ZIP archive."""
    from hpcdem.pre.specimen import make_specimen

    files = written(make_specimen(request_of(wanted)), wanted.get("style", {}))
    name = wanted.get("file")
    chosen = files if name == ARCHIVE else {n: write for n, write in files.items() if n == name}
    if not chosen:
        raise HpcdemError(f"file: read {str(name)[:40]}, expected one of {', '.join([*files, ARCHIVE])}")
    content = {}
    with tempfile.TemporaryDirectory(prefix="hpcdem_page_") as folder:
        for k, (own, write) in enumerate(chosen.items()):
            path = Path(folder) / f"{k}{Path(own).suffix}"
            write(path)
            content[own] = path.read_bytes()
    return _zipped(content) if name == ARCHIVE else content[own]


def _zipped(content: dict[str, bytes]) -> bytes:
    """A ZIP archive of the files; equal files give equal bytes, because entries carry no time."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        for name, part in content.items():
            archive.writestr(zipfile.ZipInfo(f"specimen/{name}"), part, zipfile.ZIP_DEFLATED)
    return whole.getvalue()


def command(wanted: dict[str, Any]) -> str:
    """The command line that makes the same files; the table is in grading.txt, which the page offers too."""
    from hpcdem.pre.specimen.shapes import APPLIES

    request = request_of(wanted)
    shape = [name for name, shapes in APPLIES.items() if request.shape in shapes]
    names = ["shape", "number", "slenderness", "void_ratio", *shape, "mass_exponent", "placement", "seed"]
    if request.placement == "cells":
        names.append("cell")
    usual = {field.name: field.default for field in fields(request)}
    words = ["hpcdem grade grading.txt"]
    for name in names:
        value = getattr(request, name)
        if name in ("shape", "number", "seed") or value != usual[name]:
            words.append(f"--{name.replace('_', '-')} {value:.16g}" if isinstance(value, float) else
                         f"--{name.replace('_', '-')} {value}")  # fmt: skip
    style = wanted.get("style", {})
    words += [f"--{name.replace('_', '-')} {style[name]:.16g}" for name in ("angle_factor", "gap") if name in style]
    return " ".join([*words, f"--format {','.join(style.get('formats', FIGURES)) or 'none'}"])


# -- small things ----------------------------------------------------------------------------------------------


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _whole(needed: float) -> int | None:
    """Grains in all for one of a class, as a whole number; None without a share, or beyond any specimen."""
    return math.ceil(needed * (1.0 - 1e-12)) if needed < 1e15 else None


TASKS: dict[str, Callable[[dict[str, Any]], bytes]] = {"specimen": specimen, "file": file}


if __name__ == "__main__":
    main()
