"""Deprecated names, which work and warn."""

from __future__ import annotations

import functools
import re
import warnings
from collections.abc import Callable, Collection, Mapping
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


def renamed_arguments(method: str, names: Mapping[str, str], given: dict[str, Any]) -> dict[str, Any]:
    """Return keyword arguments by their present names, and warn the caller of the calling function of earlier ones.

    Parameters
    ----------
    method : name of the method, for the warning.
    names : present name by earlier name.
    given : arguments of the call; if one has both names, it keeps both, and the method rejects the earlier one.
    """
    earlier = {old: new for old, new in names.items() if old in given and new not in given}
    for old, new in earlier.items():
        warnings.warn(f"{old} of {method} is deprecated: use {new}", DeprecationWarning, stacklevel=3)
    return {earlier.get(name, name): value for name, value in given.items()}


def present_history(name: str, known: Collection[str]) -> str:
    """Return the present name of a history of a ready-made model: `displacement top` was `way top`.

    Parameters
    ----------
    name : name given by the user; it is kept if a history has it.
    known : names of the histories that exist.
    """
    present = re.sub(r"^way\b", "displacement", name)
    return present if name not in known and present in known else name
