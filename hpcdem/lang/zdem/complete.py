"""The words that a begun ZDEM line may continue with."""

from __future__ import annotations

from hpcdem.lang.zdem.table import ZDEM, Table


def candidates(line: str, table: Table = ZDEM) -> list[str]:
    """Words that begin as the last one of the line does (which may be empty), in the order of the table."""
    words = line.lower().split()
    last = words.pop() if words and not line[-1:].isspace() else ""
    if not words:
        found = [command.name for command in table.commands]
    elif "range" in words:
        found = [term.name for term in table.range_terms]
    else:
        command = table.command(words[0])
        found = [] if command is None else command.words
    return [word for word in dict.fromkeys(found) if word.lower().startswith(last)]
