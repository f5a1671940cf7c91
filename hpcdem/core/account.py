"""Accounts of what comes, goes and is stored: whether they add up."""

from __future__ import annotations

from collections.abc import Iterable


def closed(entries: dict[str, float], closing: float, flows: Iterable[float] | None = None) -> dict[str, float]:
    """The entries of an account with closing: what does not add up, and relative: its size over the largest of the
    flows (None: of the entries)."""
    largest = max(map(abs, entries.values() if flows is None else flows))
    return {**entries, "closing": closing, "relative": abs(closing) / largest if largest > 0.0 else 0.0}
