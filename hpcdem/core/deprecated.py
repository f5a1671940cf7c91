"""Deprecated names, which work and warn."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any


def renamed(old: str, new: str) -> Callable[..., Any]:
    """Make a method `old` that warns and calls the method `new`."""

    def method(self: Any, *args: Any, **options: Any) -> Any:
        warnings.warn(f"{old} of {type(self).__name__} is deprecated: use {new}", DeprecationWarning, stacklevel=2)
        return getattr(self, new)(*args, **options)

    method.__name__, method.__doc__ = old, f"Deprecated name of `{new}`."
    return method
