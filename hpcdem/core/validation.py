"""Messages about wrong values in a table of named values, in our words instead of those of the validator."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

_EXPECTED = {
    "greater_than": "more than {gt:g}", "greater_than_equal": "at least {ge:g}", "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}", "finite_number": "a finite number", "string_too_long": "at most {max_length} "
    "characters", "too_long": "at most {max_length}", "too_short": "at least {min_length}", "missing": "a value",
}  # fmt: skip
"""By the validator's type of an error, with its context."""
_KINDS = {
    "float": "a number", "int": "a whole number", "bool": "true or false", "string": "text", "tuple": "a list",
    "list": "a list", "dict": "names and values", "model": "names and values", "mapping": "names and values",
}  # fmt: skip
"""By the first word of its type: `float_parsing`, `int_from_float`, `string_type` ..."""
_PATTERNS = {"#": "a colour such as #d0562a"}
"""Of texts with a pattern, by a character of it."""


def expected(error: Mapping[str, Any]) -> str:
    """Describe the expected value of an entry of pydantic's `ValidationError.errors()`: "a number", "at most 1"."""
    kind, context = str(error["type"]), error.get("ctx", {})
    if kind in _EXPECTED:
        return _EXPECTED[kind].format(**context)
    if kind == "literal_error":
        words = [a or b for a, b in re.findall(r"'([^']*)'|(\S+)(?:,| or |$)", str(context["expected"]))]
        return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
    if kind == "string_pattern_mismatch":
        return next((message for sign, message in _PATTERNS.items() if sign in context["pattern"]), "another text")
    return _KINDS.get(kind.partition("_")[0], "another value")


def message(error: Mapping[str, Any]) -> str:
    """Return the sentence of a rule of ours ("limits: 1 is not below 1"), "" for what the validator itself rejected."""
    return str(error["msg"]).removeprefix("Value error, ") if error["type"] == "value_error" else ""


def kind_of(value: Any) -> str:
    """Describe the kind of a value for messages: "a list", "names and values"."""
    names = {str: "text", bool: "true or false", int: "a whole number", float: "a number", type(None): "nothing"}
    return "names and values" if isinstance(value, Mapping) else names.get(type(value), "a list")
