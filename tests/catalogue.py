"""The catalogues of other languages as they are written: *.po (gettext)."""

from __future__ import annotations

import ast
import re
from pathlib import Path

PATH = Path(__file__).resolve().parent.parent / "hpcdem" / "locale" / "zh" / "LC_MESSAGES" / "hpcdem.po"
_TEXT = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
_ENTRY = re.compile(rf"^msgctxt {_TEXT}msgid {_TEXT}msgstr {_TEXT}", re.MULTILINE)


def entries(path: Path = PATH) -> list[tuple[str, str, str]]:
    """Context, text and translation of all entries, in the order of the file."""
    found = _ENTRY.findall(path.read_text(encoding="utf-8"))
    return [tuple("".join(map(ast.literal_eval, part.strip().split("\n"))) for part in parts) for parts in found]  # type: ignore[misc]


def of(*contexts: str) -> dict[str, str]:
    """The translations of these contexts, by their text."""
    return {text: meant for context, text, meant in entries() if context in contexts}
