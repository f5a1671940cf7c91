"""Letters that the usual font of figures lacks, Chinese above all: another font of this machine that has them, else a
line in the picture that says which package brings one."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from typing import Any

PREFERRED = (
    "Noto Sans CJK SC", "Noto Sans SC", "Source Han Sans SC", "Source Han Sans CN", "WenQuanYi Zen Hei",
    "WenQuanYi Micro Hei", "Microsoft YaHei", "SimHei", "PingFang SC", "Hiragino Sans GB", "Heiti SC", "SimSun",
    "Noto Sans CJK JP", "Droid Sans Fallback", "Arial Unicode MS",
)  # fmt: skip
"""Fonts in the order of preference."""
WIDE = "\u2e80"
"""First of the letters that are Chinese, Japanese or Korean."""
PACKAGES = "fonts-noto-cjk or fonts-wqy-zenhei (Debian, Ubuntu), google-noto-sans-cjk-fonts (Fedora)"
_warned: set[str] = set()


def lettered(figure: Any, kind: str = "png") -> str:
    """Give the texts of a matplotlib figure fonts that have all their letters. Return a message about letters that no
    font has, "" if all are available. The message is also written once per process to standard error, and into the
    figure except for SVG, whose viewer chooses fonts.
    """
    from matplotlib.font_manager import findfont
    from matplotlib.patheffects import Normal
    from matplotlib.text import Text

    lost: set[str] = set()
    for text in figure.findobj(Text):
        letters = "".join(text.get_text().split())
        if letters.isascii():
            continue
        some = frozenset(letters) - _letters(findfont(text.get_fontproperties()))
        if not some:
            continue
        found = font_of(some)
        if found:
            name, path = found
            text.set_fontfamily([*text.get_fontfamily(), name])
            if kind in ("pdf", "eps") and _cubic(path):
                text.set_path_effects([Normal()])  # matplotlib draws such texts as lines
        else:
            lost |= some
    if not lost:
        return ""
    advice = f": install {PACKAGES}" if max(lost) >= WIDE else ""
    line = f"no installed font has the letters {''.join(sorted(lost)[:8])}{advice}"
    if advice not in _warned:
        _warned.add(advice)
        sys.stderr.write(f"warning: {line}\n")
    if kind != "svg":  # in letters that can be read
        figure.text(
            0.004, 0.004, f"no installed font has some of these letters{advice}", fontsize=6.0, color="#c81e1e",
            va="bottom", parse_math=False,
        )  # fmt: skip
    return line


@cache
def font_of(letters: frozenset[str]) -> tuple[str, str] | None:
    """Name and file of a font that has all of these letters, or None."""
    return next(((name, path) for name, path in _fonts() if letters <= _letters(path)), None)


@cache
def _cubic(path: str) -> bool:
    """Return whether the letters of a font are not those of TrueType: files of matplotlib that hold such fonts are read
    by nobody."""
    with open(path, "rb") as file:
        head = file.read(16)
        if head[:4] == b"ttcf":  # several in one file
            file.seek(int.from_bytes(head[12:16], "big"))
            head = file.read(4)
    return head[:4] == b"OTTO"


def _fonts() -> Iterator[tuple[str, str]]:
    """Names and files of all fonts, those that are likely to have many letters first."""
    from matplotlib import font_manager

    known = font_manager.fontManager.ttflist
    place = {name: k for k, name in enumerate(PREFERRED)}
    for entry in sorted(known, key=lambda entry: (place.get(entry.name, len(place)), str(entry.weight) != "400")):
        yield entry.name, entry.fname
    # Matplotlib keeps its list of fonts in a file, and does not know those that were installed since.
    for path in sorted({*font_manager.findSystemFonts()} - {entry.fname for entry in known}):
        try:
            font_manager.fontManager.addfont(path)
        except Exception:  # a file that is no font, or is damaged
            continue
        yield font_manager.fontManager.ttflist[-1].name, path


@cache
def _letters(path: str) -> frozenset[str]:
    """Return the characters of a font."""
    from matplotlib.font_manager import get_font

    try:
        return frozenset(map(chr, get_font(path).get_charmap()))
    except (OSError, RuntimeError):
        return frozenset()
