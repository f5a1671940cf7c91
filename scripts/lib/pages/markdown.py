"""What the reference pages of both languages share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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


def first_sentence(text: str) -> str:
    """Of what a command does, without its end."""
    return text.split(". ")[0].rstrip(".")


def overview(title: str, head: str, texts: Mapping[str, str]) -> str:
    """A section with a table of all commands, each with a link to its own."""
    rows = [f"## {title}", "", head, "|---|---|"]
    rows += [f"| [{name}](#{name.lower().replace(' ', '-')}) | {escaped(text)} |" for name, text in texts.items()]
    return "\n".join([*rows, ""])
