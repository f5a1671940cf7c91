"""How figures of matplotlib become files: the same figure gives the same bytes."""

from __future__ import annotations

from typing import Any

FORMATS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".pdf", ".svg")
SAVED: Any = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "hpcdem"}
"""Settings of matplotlib while a file is written: texts stay texts, and an SVG's ids are the same every time."""


def saving(kind: str) -> dict[str, Any]:
    """Options of `savefig` for jpg, png, tiff, pdf, svg or eps: the same figure gives the same file."""
    if kind == "jpg":
        return {"pil_kwargs": {"quality": 92, "subsampling": 0}}  # thin coloured layers need their full colour
    if kind == "tiff":
        return {"pil_kwargs": {"compression": "tiff_lzw"}}
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    return {"metadata": metadata[kind]} if kind in metadata else {}
