"""Returns memory of freed tables to the system."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any


@cache
def _trim() -> Any:
    """malloc_trim of the GNU C library; None elsewhere."""
    if not sys.platform.startswith("linux"):
        return None
    return getattr(ctypes.CDLL(None), "malloc_trim", None)


def give_back() -> None:
    """Return free memory of this process to the system; takes some milliseconds. The GNU C library keeps freed memory
    once tables of megabytes were freed: up to half of what a model of blocks needs while it is made."""
    trim = _trim()
    if trim is not None:
        trim(0)
