"""Deprecated names, which work and warn."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any


def renamed(old: str, new: str, of: type | None = None) -> Callable[..., Any]:
    """Make a method `old` that warns and calls `new`; of: class of which the method has the signature and the text."""

    def method(self: Any, *args: Any, **options: Any) -> Any:
        warnings.warn(f"{old} of {type(self).__name__} is deprecated: use {new}", DeprecationWarning, stacklevel=2)
        return getattr(self, new)(*args, **options)

    text = ""
    if of is not None:
        text = functools.update_wrapper(method, getattr(of, new)).__doc__ or ""
    method.__name__, method.__doc__ = old, f"Deprecated name of `{new}`.\n\n{text}".rstrip()
    return method
