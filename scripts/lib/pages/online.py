"""The commands of PCDC's online help, path by path, and what becomes of each here.

``online.txt`` is the tree of their keywords: a row is a word in the notation of `keywords`, its depth in blanks, then
between tabs the kinds of its values, the dimensions (2, 3) in which it is there, its state in each of them, and what a
line with it needs besides: words that follow; after ``+`` pairs of a word and a value that lines with words below it
need, too (or, between ``|``, words with their values, ``{3}`` before those of three dimensions only); after ``=`` the
whole line. ``scripts/pages`` writes the states as they are, and docs/pcdc_online.md.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from hpcdem.lang.pcdc.keywords import Keyword
from hpcdem.lang.pcdc.parser import Refused, trace
from hpcdem.lang.pcdc.table import PCDC
from scripts.lib.pages.markdown import escaped

FILE = Path(__file__).with_name("online.txt")
ACTS, ALIAS, IDLE, REFUSED, MISSING = "a", "=", "-", "x", "?"
STATES = {
    ACTS: "acts", ALIAS: "alias", IDLE: "no effect", REFUSED: "refused", MISSING: "missing",
}  # fmt: skip

_SAMPLES = {
    "int": "3", "float": "0.25", "bool": "on", "string": "'a'", "vector": "(1,2)", "float,float": "0 1",
    "vector,vector": "(0,0) (1,1)", "vector,vector,vector": "(0,0) (2,0) (1,2)", "int,int": "4 2",
    "int,int,int": "4 2 3", "string,string,string": "'a' 'b'",
    "string,string,string,float,bool": "'a' 'b'", "float,float,float": "0 1, 2 3",
}  # fmt: skip
_IN_SPACE = {"(1,2)": "(1,2,3)", "(0,0) (1,1)": "(0,0,0) (1,1,1)", "(0,0) (2,0) (1,2)": "(0,0,0) (2,0,0) (1,2,0)"}
_TABLE = "|table"
_VECTOR = re.compile(r"\(([^,()]+,[^,()]+)\)")

_HEAD = "| command | values | dimensions | state | tested line |"
_TOP = """\
# PCDC's online commands

This page is generated from `scripts/lib/pages/online.txt` by `./scripts/pages`; do not edit it.

The online help of PCDC lists its commands word by word. The tables give the state of each command and keyword in
hpcdem:

- **acts**: it has the effect that PCDC describes;
- **alias**: it has the effect of another command or keyword, which is named;
- **no effect**: it is accepted, and the log reports once that it does nothing;
- **refused**: it is rejected by name before the run, with the command to use instead.

Letters in braces are optional; omit them from the end of a word.

Of {total} entries (two and three dimensions counted separately): {told}. `tests/pcdc/test_online.py` parses a line with
each entry, in full and in its shortest form, and checks its state; `tests/pcdc/test_online_acts.py` executes lines and
checks their effects.
"""


@dataclass(frozen=True)
class Row:
    """path: words in their notation, from the first on; dims: where it is there; states: one for each of them; needs:
    as in the file."""

    path: tuple[str, ...]
    values: tuple[str, ...]
    dims: tuple[int, ...]
    states: str
    needs: str
    inherited: str

    words: tuple[str, ...]
    """The path in full."""
    shortest: tuple[str, ...]
    """As short as the tree allows without a word that means two."""

    def lines(self, dim: int) -> list[str]:
        """Lines in which the path stands, whole and as short as may be, and with a table where one may stand."""
        if self.needs.startswith("="):
            return [self.needs[1:]]
        return [self._line(words, dim, table) for words in (self.words, self.shortest)
                for table in ((False, True) if self.values[-1].endswith(_TABLE) else (False,))]  # fmt: skip

    def _line(self, words: tuple[str, ...], dim: int, table: bool) -> str:
        parts = ["element group 'g'"] if words[0] == "range" else []
        for k, (word, values) in enumerate(zip(words, self.values)):
            sample = _SAMPLES.get(values.removesuffix(_TABLE), values)
            last = k == len(words) - 1
            parts += [word, "table 'a'" if table and last else _IN_SPACE.get(sample, sample) if dim == 3 else sample]
        if self.needs and not self.needs.startswith("+"):
            parts += _segments(self.needs, dim) if "|" in self.needs else [self.needs]
        else:
            needs = _segments(self.needs[1:] or self.inherited, dim)
            parts += [one for one in needs if one.split()[0] not in self.words[1:]]
        return " ".join(filter(None, parts))


def _segments(needs: str, dim: int) -> list[str]:
    """Words with their values."""
    if "|" not in needs:
        words = needs.split()
        return [" ".join(pair) for pair in zip(words[::2], words[1::2])]
    found = [one.removeprefix(f"{{{dim}}}") for one in needs.split("|")]
    found = [one for one in found if one and not one.startswith("{")]
    return [_VECTOR.sub(r"(\1,0)", one) for one in found] if dim == 3 else found


@cache
def rows() -> tuple[Row, ...]:
    """The tree, from its first row on."""
    read: list[tuple[tuple[str, ...], tuple[str, ...], str, str, str, str]] = []
    above: list[tuple[str, str, str]] = []
    beside: dict[tuple[str, ...], set[str]] = {}
    for text in FILE.read_text("utf-8").splitlines():
        depth = len(text) - len(text.lstrip(" "))
        word, values, dims, states, needs = (text[depth:].split("\t") + [""] * 5)[:5]
        del above[depth:]
        inherited = above[-1][2] if above else ""
        above.append((word, values, needs[1:] if needs.startswith("+") else inherited))
        path, kinds = tuple(one[0] for one in above), tuple(one[1] for one in above)
        beside.setdefault(path[:-1], set()).add(word)
        read.append((path, kinds, dims, states, needs, inherited))
    found = []
    for path, kinds, dims, states, needs, inherited in read:
        words = tuple(map(_full, path))
        shortest = tuple(_short(path[k], beside[path[:k]]) for k in range(len(path)))
        found.append(Row(path, kinds, tuple(map(int, dims)), states, needs, inherited, words, shortest))
    return tuple(found)


_keyword = cache(Keyword)


def _full(word: str) -> str:
    return _keyword(word).name if word.isascii() else word


def _short(word: str, beside: set[str]) -> str:
    """The compulsory letters of a word, or all where they may mean another word of the same place."""
    if not word.isascii():
        return word
    short = _keyword(word).shortest()
    others = (_keyword(one) for one in beside if one.isascii() and _full(one) != _full(word))
    return _full(word) if any(one.accepts(short) for one in others) else short


def page() -> str:
    """docs/pcdc_online.md."""
    counts, total = counted(), sum(counted().values())
    told = ", ".join(f"{counts[name]} {name}" for name in STATES.values() if counts[name])
    parts = [_TOP.format(total=total, told=told)]
    before = ""
    for row in rows():
        if row.path[0] != before:
            before = row.path[0]
            parts += ["", f"## {_full(before)}", "", _HEAD, "|---|---|---|---|---|"]
        states = {dim: state(row, dim) for dim in row.dims}
        names = dict.fromkeys(STATES[one[0]] for one in states.values())
        whys = dict.fromkeys(one[1] for one in states.values() if one[1] and one[0] != MISSING)
        dims = ", ".join(f"{dim}D" for dim in row.dims)
        line = escaped(row.lines(row.dims[0])[0])
        why = f" ({escaped('; '.join(whys))})" if whys else ""
        path, values = escaped(" ".join(row.path)), escaped(row.values[-1])
        parts.append(f"| `{path}` | {values} | {dims} | {' / '.join(names)}{why} | `{line}` |")
    return "\n".join(parts) + "\n"


def state(row: Row, dim: int) -> tuple[str, str]:
    """The state of a path in so many dimensions as lines with it are read, and what it is an alias of or why it is
    refused."""
    found = dict.fromkeys(_state(row, line, dim) for line in row.lines(dim))
    return max(found, key=lambda one: list(STATES).index(one[0]))


def _state(row: Row, line: str, dim: int) -> tuple[str, str]:
    try:
        command, way, words = trace(line, PCDC, dim)
    except Refused as error:
        return REFUSED, str(error)
    except ValueError as error:
        return MISSING, str(error)
    if command.idle:
        return IDLE, command.idle
    if row.needs.startswith("="):
        return ACTS, ""
    meant = words[words.index("range") :] if row.words[0] == "range" else words
    count = len(row.words)
    if len(meant) < count:
        return MISSING, f"{row.words[-1]} is not read as a word"
    mine = tuple(meant[:count])
    named = 0 if row.words[0] == "range" else len(way.words)
    if mine[-1] != row.words[-1] or (count <= named and not way.own):
        return ALIAS, " ".join([command.name, *mine[named:]] if named else mine)
    return ACTS, ""


def counted() -> Counter[str]:
    """How many paths are in which state, as the file says."""
    return Counter(STATES[one] for row in rows() for one in row.states)


def with_states() -> str:
    """The file, with the states as they are."""
    lines = []
    for row, text in zip(rows(), FILE.read_text("utf-8").splitlines()):
        word, values, dims = text.split("\t")[:3]
        states = "".join(state(row, dim)[0] for dim in row.dims)
        lines.append("\t".join([word, values, dims, states, row.needs]).rstrip("\t"))
    return "\n".join(lines) + "\n"
