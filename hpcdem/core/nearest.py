"""Suggestions: the known word that is most similar to an unknown one."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LONGEST = 40
"""Longest word that is compared with known words; longer ones are unlikely to be typing mistakes."""


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The most similar known word, or None if none is similar."""
    if len(word) > LONGEST:
        return None
    by_lower = {name.lower(): name for name in known}
    found = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[found[0]] if found else None


def quoted(names: Iterable[str], none: str = "none so far") -> str:
    """List the available words for a message: ``'a', 'b'``."""
    return ", ".join(f"'{name}'" for name in names) or none


def hint(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean 'xmove'?`` for a message, or nothing."""
    best = nearest(word, known)
    return f"; did you mean '{best}'?" if best else ""
