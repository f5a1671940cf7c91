"""Layouts of ranks and threads, all of which give the same bits."""

from __future__ import annotations

from collections.abc import Collection

import pytest

LAYOUTS: dict[str, tuple[int, list[str]]] = {
    "2 ranks": (2, []),
    "3 ranks": (3, []),
    "4 ranks": (4, []),
    "3 ranks, borders stay": (3, ["--no-balance"]),
    "3 threads": (1, ["-j", "3"]),
    "2 ranks x 2 threads": (2, ["-j", "2"]),
}
"""Number of ranks, and options, by name."""
SLOW = ("4 ranks", "3 threads", "2 ranks x 2 threads")


def layouts(quick: Collection[str]) -> list:
    """Parameters of a test: the names of quick layouts, and of those that slow tests add."""
    return [*quick, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW if name not in quick)]
