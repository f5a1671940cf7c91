"""Hostile input for every path of PCDC's online help: one message of one line with what was read, or it is accepted;
on a model that has nothing commands refuse in words."""

from __future__ import annotations

import random

import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc.parser import parse
from hpcdem.lang.pcdc.table import PCDC
from scripts.lib.pages import online
from tests.pcdc.test_online_acts import contexts
from tests.pcdc.test_time import Rock

NONSENSE = (
    "", "nonsense", "-1", "1e400", "9" * 400, "nan", "inf", "1e-320", "''", "'", "(1,", "(1,2", "1,", ",", ",,",
    "1,,2", "(", "()", "(1,2,3,4)", "(a,b)", "[", "[]", "[1/0", "[__import__('os')]", "table", "table 't'", "table t",
    "'../../etc/passwd'", "'a\x00b'", "\u202e", "\uff08\uff11\uff09", "'" + "x" * 5000 + "'", "on", "range",
    "range not", "range x", "range x 2 1", "range not not x 1", "range in-circle", "range geometry-along 3",
    "range geometry-location 'a' count -1", "...", "\\",
    "#", "; rm -rf /", "0x10", "--", "1e", "+", "'a','b',", "0 1, 2",
)  # fmt: skip
LINES = sorted({(line, dim) for row in online.rows() for dim in row.dims for line in row.lines(dim)})


def read(line: str, dim: int) -> str:
    """The message of a line, "" if it is read."""
    try:
        parse(line, "a.sc", 7, f"pcdc {line}", PCDC, dim=dim)
    except ScriptError as error:
        assert (error.file, error.line) == ("a.sc", 7)
        return str(error)
    return ""


@pytest.mark.parametrize("first", dict.fromkeys(online.rows()[k].words[0] for k in range(len(online.rows()))))
def test_whatever_stands_in_a_line_is_read_or_refused_in_one_message(first):
    """Lines cut short, with a word spoiled, doubled or left out, and with nonsense in the place of a value."""
    draw = random.Random(first)
    tried = 0
    for line, dim in LINES:
        words = line.split()
        if words[0] != first:
            continue
        at = draw.randrange(1, len(words) + 1)
        nonsense = draw.choice(NONSENSE)
        for spoiled in (
            " ".join(words[:at]), " ".join([*words[: at - 1], *words[at:]]),
            " ".join([*words[:at], nonsense, *words[at:]]),
            " ".join([*words[: at - 1], nonsense, *words[at:]]), " ".join([*words[:at], *words[at - 1 :]]),
            f"{line} {nonsense}",
        ):  # fmt: skip
            told = read(spoiled, dim)
            assert "\n" not in told and len(told) < 900, spoiled[:80]
            assert "Traceback" not in told and "object at 0x" not in told, told
            tried += 1
    assert tried or first in ("range", "数据类型")  # the lines of these begin with a command


def test_words_that_are_not_there_are_answered_with_those_that_are():
    for line, dim in LINES[:: len(LINES) // 150]:
        words = line.split()
        told = read(" ".join([*words[:-1], "nonsence", words[-1]]) if len(words) > 2 else f"{line} nonsence", dim)
        refused = read(line, dim)
        assert refused or "nonsence" in told, (line, told)


@pytest.mark.parametrize("name", ["nothing", "a mesh without models"])
def test_lines_that_act_elsewhere_refuse_in_words_where_they_cannot(tmp_path, name):
    before = "" if name == "nothing" else "pcdc mesh structured (0,0) (3,2) cells 3 2 type quad\n"
    for k, line in enumerate(line for context in contexts().values() for line in (*context.moves, *context.says)):
        if "dim 3" in line or "solve" in line or "step" in line:
            continue
        rock = Rock(tmp_path / str(k), before)
        try:
            rock(line)
        except HpcdemError as error:
            assert str(error).startswith("script") and ": pcdc " in str(error), str(error)
