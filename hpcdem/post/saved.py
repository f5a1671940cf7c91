"""Save figures of matplotlib as files: equal figures give equal bytes."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from hpcdem.core.errors import HpcdemError
from hpcdem.io.agreed import atomic_path
from hpcdem.post.lettering import lettered

FORMATS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".pdf", ".svg")
SAVED: Any = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "hpcdem"}
"""Settings of matplotlib while a file is written: texts stay texts, and the ids of an SVG are the same every time."""

LONGEST_SIDE = 65535
"""Largest number of pixels along a side of a picture, which is the limit of JPEG."""
MOST_PIXELS = 250e6
"""Largest number of pixels of a picture: a gigabyte while it is drawn; a sheet A0 at 300 dots per inch has 140
million."""


def write(make: Callable[[], Any], path: str | os.PathLike, dpi: float) -> Path:
    """Write the figure that `make` gives: JPG, PNG, TIFF, PDF or SVG by the suffix of `path`. Serial. HpcdemError."""
    import matplotlib

    path = Path(path)
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise HpcdemError(f"cannot draw {path}: pictures end in {', '.join(FORMATS)}")
    kind = {".jpeg": "jpg", ".tif": "tiff"}.get(kind, kind[1:])
    with matplotlib.rc_context(SAVED):
        figure = make()
        with atomic_path(path) as temporary:
            save(figure, temporary, kind, dpi, path)
    return path


def save(figure: Any, target: str | IO[bytes], kind: str, dpi: float, picture: object = "the picture") -> None:
    """Write a matplotlib figure as jpg, png, tiff, pdf, svg or eps. picture: its name in messages. HpcdemError for too
    many pixels.
    """
    import matplotlib

    width, height = (float(side) * dpi for side in figure.get_size_inches())
    if kind in ("jpg", "png", "tiff") and (max(width, height) > LONGEST_SIDE or width * height > MOST_PIXELS):
        raise HpcdemError(
            f"cannot draw {picture}: {width:.0f} x {height:.0f} pixels, at most {LONGEST_SIDE} along a side and "
            f"{MOST_PIXELS / 1000000.0:.0f} million in total: use a smaller page or fewer dots per inch"
        )
    lettered(figure, kind)
    with matplotlib.rc_context(SAVED), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")  # it was reported, once
        figure.savefig(target, format=kind, dpi=dpi, **_saving(kind))


def _saving(kind: str) -> dict[str, Any]:
    """Options of `savefig` for jpg, png, tiff, pdf, svg or eps: the same figure gives the same file."""
    if kind == "jpg":
        return {"pil_kwargs": {"quality": 92, "subsampling": 0}}  # thin coloured layers need their full colour
    if kind == "tiff":
        return {"pil_kwargs": {"compression": "tiff_lzw"}}
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    return {"metadata": metadata[kind]} if kind in metadata else {}
