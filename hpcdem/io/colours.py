"""The ten colours of the ZDEM manual (chapter 9, the values of its colour file), as fractions of red, green, blue."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from hpcdem.core.errors import HpcdemError, ScriptError

RGB = np.array(
    [
        [0.85, 0.85, 0.85],
        [0.00, 1.00, 0.00],
        [1.00, 1.00, 0.00],
        [1.00, 0.00, 0.00],
        [0.90, 0.90, 0.90],
        [0.15, 0.15, 0.15],
        [0.50, 0.50, 0.50],
        [0.00, 0.00, 1.00],
        [0.00, 1.00, 1.00],
        [1.00, 0.00, 1.00],
    ]
)


def numbers(color: np.ndarray) -> np.ndarray:
    """Colour numbers brought into 0..9, so that any file can be drawn."""
    return np.asarray(color).astype(np.int64) % len(RGB)


def find_palette(name: str, folder: str | os.PathLike) -> Path:
    """Return where a colour file is: a path is used unchanged; a bare name is searched for in the current folder, in
    `folder` and in the home folder. Raises HpcdemError without one."""
    given = Path(name).expanduser()
    bare = given.name == name
    places = [Path(), Path(folder), Path.home()] if bare else [Path()]
    for place in places:
        if (place / given).is_file():
            return place / given
    where = f"neither here, nor in {os.fspath(folder)}, nor in {Path.home()}" if bare else "file not found"
    raise HpcdemError(f"cannot read the colours {name}: {where}")


def read_palette(path: str | os.PathLike) -> np.ndarray:
    """The colours (10, 3) of a file: ten lines of red, green and blue between 0 and 1, by blanks or commas; empty
    lines and what follows # are skipped. Raises ScriptError with the line, HpcdemError if it cannot be read."""
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as failure:
        raise HpcdemError(f"cannot read the colours {os.fspath(path)}: {failure.strerror}") from None
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            raise ScriptError(os.fspath(path), number, f"expected red, green and blue, not '{line.strip()}'") from None
        if len(row) != 3:
            raise ScriptError(os.fspath(path), number, f"expected three numbers (red, green, blue), not {len(row)}")
        if not all(0.0 <= value <= 1.0 for value in row):
            raise ScriptError(
                os.fspath(path), number, f"expected red, green and blue from 0 to 1, not '{line.strip()}'"
            )
        if len(rows) == len(RGB):
            raise ScriptError(os.fspath(path), number, f"more than {len(RGB)} colours")
        rows.append(row)
    if len(rows) < len(RGB):
        last = len(text.splitlines())
        raise ScriptError(os.fspath(path), last, f"expected {len(RGB)} colours, the file ends after {len(rows)}")
    return np.array(rows)
