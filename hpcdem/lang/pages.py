"""What the reference pages of both languages share."""

from __future__ import annotations

from collections.abc import Iterable

WIDTH = 100
"""Letters in a line of syntax."""


def wrapped(words: Iterable[str]) -> list[str]:
    """Words put into lines; those after the first are moved in."""
    lines, line = [], ""
    for word in words:
        if line and len(line) + len(word) > WIDTH:
            lines.append(line)
            line = "   "
        line = f"{line} {word}" if line else word
    return [*lines, line]


def escaped(text: str) -> str:
    """A text in a table of Markdown."""
    return text.replace("|", "\\|")
