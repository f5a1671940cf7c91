"""The table itself: names are unique, abbreviations clear, every row complete."""

from __future__ import annotations

import itertools

import pytest

from hpcdem.lang.zdem import execute, parser
from hpcdem.lang.zdem import table as t
from tests.tables import each

ROWS = {command.name: command.options for command in t.COMMANDS} | {"RANGE": t.RANGE_TERMS}


def test_no_word_stands_for_two_commands():
    for a, b in itertools.combinations(t.COMMANDS, 2):
        for word in (a.stem, a.full, *a.also):
            assert not b.accepts(word), (a.name, b.name, word)


@each("command", ROWS)
def test_no_word_stands_for_two_keywords(command):
    for row in ROWS[command]:
        for word in (row.name.lower(), row.full, *row.also):
            assert t.find(word, ROWS[command]) == (row, False), (row.name, word)
    for a, b in itertools.combinations(ROWS[command], 2):
        if a.stem == b.stem:  # the stem stands for neither
            assert t.find(a.stem, ROWS[command])[0] is None


@pytest.mark.parametrize("command", [c.name for c in t.COMMANDS if c.ranged])
def test_no_keyword_is_taken_for_range(command):
    assert not any(t.ZDEM.range_row.accepts(option.full) or option.accepts("range") for option in ROWS[command])


@each(
    ("word", "name"),
    [
        *[(stem, name) for stem, name in [
            ("bal", "BALL"), ("bon", "BOND"), ("clu", "CLUMP"), ("cyc", "CYC"), ("del", "DEL"), ("exp", "EXP"),
            ("fix", "FIX"), ("fre", "FREE"), ("gen", "GEN"), ("gli", "GLINE"), ("imp", "IMPLE"),
            ("ini", "INIT"), ("loa", "LOAD"),
            ("pro", "PROP"), ("res", "RESTORE"), ("set", "SET"), ("sta", "START"), ("sto", "STOP"), ("wal", "WALL"),
            ("his", "HIST"), ("plo", "PLOT"), ("dra", "DRAW"), ("sav", "SAV"), ("box", "BOX")]],
        ("impl", "IMPLE"), ("imple", "IMPLE"), ("implie", "IMPLE"),
        ("resto", "RESTORE"), ("save", "SAV"), ("init", "INIT"), ("cycle", "CYC"), ("delete", "DEL"),
    ],
)  # fmt: skip
def test_commands_by_their_documented_stems_and_longer(word, name):
    assert t.ZDEM.command(word).name == name


@pytest.mark.parametrize("word", ["st", "s", "", "imples", "startt", "boxx", "wallx", "range", "x", "genr"])
def test_words_that_are_no_commands(word):
    assert t.ZDEM.command(word) is None


@each(
    ("command", "word", "name"),
    [
        ("PROP", "den", "density"), ("PROP", "dens", "density"), ("PROP", "poisson", "poiss"),
        ("PROP", "gbmmod", "gbmod"), ("PROP", "gbm", "gbmod"), ("PROP", "coloe", "color"), ("PROP", "n_b", "n_bond"),
        ("SET", "sav", "save"), ("SET", "save", "save"), ("IMPLE", "sav", "save"), ("SET", "dt", "dt"),
        ("GLINE", "r", "rad"), ("GLINE", "rad", "rad"), ("WALL", "xv", "xv"), ("IMPLE", "xm", "xmove"),
        ("PROP", "de", "density"), ("GEN", "nu", "num"), ("HIST", "gstr", None), ("HIST", "gstre", "gstress"),
        # by the first three letters, with a warning
        ("SET", "gravtiy", "gravity"), ("PROP", "densities", "density"), ("PROP", "damping", "damp"),
    ],
)  # fmt: skip
def test_keywords_and_their_abbreviations(command, word, name):
    found = t.ZDEM.command(command.lower()).option(word)
    assert (found and found.name) == name


@pytest.mark.parametrize(
    ("command", "word"),
    [("PROP", "d"), ("PROP", "k"), ("PROP", "knn"), ("WALL", "i"), ("SET", "d"), ("PROP", "s"), ("HIST", "gst"),
     ("HIST", "ys"), ("SET", "gr_vity")],
)  # fmt: skip
def test_words_that_are_no_keywords(command, word):
    assert t.ZDEM.command(command.lower()).option(word) is None


def test_every_row_says_what_it_is():
    for row in [*t.COMMANDS, *(option for options in ROWS.values() for option in options)]:
        assert row.doc and row.source in t.SOURCES, row.name


def test_every_kind_is_read_and_every_command_is_bound():
    kinds = {type(option.kind) for options in ROWS.values() for option in options}
    assert kinds <= set(parser._READERS)
    own = {command.same_as or command.name for command in t.COMMANDS if not command.does}
    assert set(execute._CONVERTERS) == own


@each("line", [line for command in t.COMMANDS for line in command.example])
def test_every_example_parses(line):
    statement = parser._LineParser(next(parser.lexer.read_lines(line.encode(), "s.py")), "s.py", t.ZDEM).statement()
    parser.rules.check_statement(statement)


def test_colours():
    assert list(t.COLORS.values()) == list(range(10))
