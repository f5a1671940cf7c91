"""Tables of words as one test: hundreds of cases that take microseconds each are not worth a test of pytest each."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pytest

SHOWN = 20
"""Rows that failed and are told whole."""


def each(
    names: str | Sequence[str], rows: Iterable[Any], ids: Iterable[str] | Callable[[Any], Any] | None = None
) -> Callable[..., Any]:
    """As `pytest.mark.parametrize`, but all rows are one test; every row that fails is named in its message."""
    words = [word.strip() for word in names.split(",")] if isinstance(names, str) else list(names)
    table = [row if len(words) > 1 else (row,) for row in rows]
    name = ids if callable(ids) else repr
    titles = None if ids is None or callable(ids) else list(ids)
    assert table and (titles is None or len(titles) == len(table)), f"{titles} for {len(table)} rows"

    def title(k: int) -> str:
        return titles[k] if titles else ", ".join(f"{name(value)!s:.60}" for value in table[k])

    def of_all(test: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(test)
        given = [one for name, one in signature.parameters.items() if name not in words]

        @functools.wraps(test)
        def rows_in_turn(*args: Any, **fixtures: Any) -> None:
            failed = []
            for k, row in enumerate(table):
                try:
                    test(*args, **fixtures, **dict(zip(words, row, strict=True)))
                except (Exception, pytest.fail.Exception) as error:
                    failed.append(f"{title(k)}: {type(error).__name__}: {error}")
            if failed:
                more = [f"... {len(failed) - SHOWN} more"] * (len(failed) > SHOWN)
                pytest.fail("\n".join([f"{len(failed)} of {len(table)}", *failed[:SHOWN], *more]), pytrace=False)

        rows_in_turn.__signature__ = signature.replace(parameters=given)  # type: ignore[attr-defined]
        return rows_in_turn

    return of_all
