"""Tab at a terminal: words of a language, names of Python."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any


@contextlib.contextmanager
def completion(
    words: Callable[[str], list[str] | None], names: dict[str, Any] | None = None
) -> Iterator[None]:  # fmt: skip
    """Enable completion by Tab if the terminal supports it. words: those that a begun line may continue with, None if
    it is Python, of which names are known."""
    try:
        import readline
        import rlcompleter
    except ImportError:
        yield
        return
    python = rlcompleter.Completer(names)  # the mapping itself: names come while the conversation continues
    found: list[str] = []

    def complete(text: str, state: int) -> str | None:
        nonlocal found
        given = words(readline.get_line_buffer()[: readline.get_endidx()])
        if given is None:
            return python.complete(text, state)
        found = given if state == 0 else found
        return found[state] + " " if state < len(found) else None

    before: Any = readline.get_completer(), readline.get_completer_delims()
    readline.set_completer(complete)
    readline.set_completer_delims(" \t\n()[]{},=+*/'\"")
    readline.parse_and_bind("tab: complete")
    try:
        yield
    finally:
        readline.set_completer(before[0])
        readline.set_completer_delims(before[1])
