"""The words that a begun line may continue with."""

from __future__ import annotations

from hpcdem.lang.pcdc.keywords import beginning
from hpcdem.lang.pcdc.parser import expected
from hpcdem.lang.pcdc.table import PCDC, Table


def candidates(line: str, table: Table = PCDC) -> list[str]:
    """Words in full, in the order of the table, that fit the last word of a line (which may be empty)."""
    words = line.lstrip().removeprefix("pcdc")
    at = len(words) - len(words.rstrip())
    last = "" if at or not words else words.split()[-1]
    before = words[: len(words) - len(last)]
    rows = expected(before, table)
    return list(dict.fromkeys(row.keyword.name for row in (beginning(last, rows) if last else rows)))
