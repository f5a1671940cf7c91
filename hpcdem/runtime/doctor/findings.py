"""What a check says: how bad it is, what was found, what to type."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum


class Level(IntEnum):
    """How bad it is: a problem keeps a run from working, a warning makes it slow or puts it at risk."""

    OK = 0
    WARNING = 1
    PROBLEM = 2


@dataclass(frozen=True)
class Finding:
    """topic: one or two words; text: what was found; cure: a command to type, or a sentence that holds one."""

    level: Level
    topic: str
    text: str
    cure: str = ""

    def line(self) -> str:
        """The finding as one line of a log."""
        if not self.cure:
            return self.text
        return f"{self.text}. {self.cure if self.cure[0].isupper() else f'Cure: {self.cure}'}"


def ok(topic: str, text: str, cure: str = "") -> Finding:
    """All is well; a cure, if any, says how to have more."""
    return Finding(Level.OK, topic, text, cure)


def warning(topic: str, text: str, cure: str = "") -> Finding:
    """A run will work, slowly or at risk."""
    return Finding(Level.WARNING, topic, text, cure)


def problem(topic: str, text: str, cure: str = "") -> Finding:
    """A run will not work."""
    return Finding(Level.PROBLEM, topic, text, cure)


Found = list[tuple[int, bool, Finding]]
"""What one rank found: the number of the check, which orders them, and whether every host was looked at by it."""


def merged(of_ranks: Sequence[Found], hosts: Sequence[str]) -> list[Finding]:
    """The findings of all ranks in the order of the checks, equal ones once.

    hosts: that of each rank. A finding of a check of every host that is true of some of them names them.
    """
    seen: dict[tuple[int, bool, Finding], list[str]] = {}
    for found, host in zip(of_ranks, hosts):
        for item in found:
            seen.setdefault(item, []).append(host)
    result = []
    for (_, each_host, finding), where in sorted(seen.items(), key=lambda item: item[0][0]):
        if each_host and set(where) != set(hosts):
            finding = replace(finding, text=f"{named(where)}: {finding.text}")
        result.append(finding)
    return result


def named(hosts: Iterable[str], most: int = 4) -> str:
    """`a`, `a, b`, or `a, b, c, d and 12 more`."""
    names = list(dict.fromkeys(hosts))
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def size(count: float) -> str:
    """A number of bytes as people write it: `512 B`, `4 MiB`, `23.4 GiB`."""
    for unit in ("B", "KiB", "MiB", "GiB", "TiB"):
        if count < 1023.5 or unit == "TiB":
            break
        count /= 1024.0
    return f"{count:.3g} {unit}"
