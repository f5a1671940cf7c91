"""Words, numbers and expressions."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.lang.zdem.lexer import Token, expression, number, read_lines, whole

EXTENTS = {"left": 1.0, "right": 100.0, "bottom": 10.0, "top": 4000.0}


def words(source: bytes) -> list[list[str]]:
    return [[token.text for token in line.tokens] for line in read_lines(source, "s.py")]


def test_separators_and_comments():
    source = b"WALL ID 0, NODES( 0.0 ,10.0 )(4e4, 10.0)kn=0e10 # floor\n\n  ! nothing\n;\nCYC 5000;5 thousand\n"
    assert words(source) == [["WALL", "ID", "0", "NODES", "0.0", "10.0", "4e4", "10.0", "kn", "0e10"], ["CYC", "5000"]]


@pytest.mark.parametrize("mark", [b"#", b"!", b";"])
def test_a_comment_needs_no_blank_before_it(mark):
    assert words(b"SET print 100" + mark + b"print every 100") == [["SET", "print", "100"]]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_line_ends_of_all_systems(end):
    lines = list(read_lines(end.join([b"START", b"", b"CYC 1"]), "s.py"))
    assert [line.number for line in lines] == [1, 3]


def test_lines_and_columns_count_from_one():
    tokens = [token for line in read_lines(b"\n  SET DT=5e-2", "s.py") for token in line.tokens]
    assert tokens == [Token("SET", 2, 3), Token("DT", 2, 7), Token("5e-2", 2, 10)]


def test_columns_are_characters_not_bytes():
    (line,) = read_lines("SAV 盐.sav x".encode(), "s.py")
    assert line.tokens[2] == Token("x", 1, 11)


def test_byte_order_mark():
    assert words(b"\xef\xbb\xbfSTART") == [["START"]]


@pytest.mark.parametrize("encoding", ["utf-8", "gbk", "big5", "shift_jis", "utf-7"])
def test_comments_in_any_encoding(encoding):
    comment = "# 生成".encode(encoding)
    assert words(b"START " + comment + b"\r\nCYC 1 " + comment) == [["START"], ["CYC", "1"]]


def test_blanks_of_documents():
    assert words("SET\u00a0DT\u30005e-2\t1".encode()) == [["SET", "DT", "5e-2", "1"]]


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (b"START\nSAV \xc9\xfa.sav", "s.py:2: byte 0xC9 at column 5 is not UTF-8"),
        (b"\xff\xfeS\x00T\x00", "s.py:1: the file is UTF-16"),
        ("SET DT，5e-2".encode(), "s.py:1: read a wide '，' at column 7; type an ordinary ','"),
        ("x （1 2)".encode(), "type an ordinary '('"),
        ("xv −2.0".encode(), "type an ordinary '-'"),
        (b"STA\x00RT", "s.py:1: read the control character U+0000 at column 4"),
        ("STA\u200bRT".encode(), "control character U+200B"),
        (b'SAV "my.sav"', "without quotes"),
    ],
)
def test_characters_that_no_word_may_hold(source, message):
    with pytest.raises(ScriptError) as caught:
        words(source)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        ("-9.8", -9.8),
        ("+2", 2.0),
        ("2.5e3", 2500.0),
        (".5", 0.5),
        ("1.", 1.0),
        ("0e7", 0.0),
        ("2e100", 2e100),
        ("1E+05", 1e5),
        ("1e400", float("inf")),
    ],
)
def test_numbers(text, value):
    assert number(Token(text, 1, 1)) == value


@pytest.mark.parametrize("text", ["", "1e", "e5", "1_000", "0x10", "inf", "nan", "1.2.3", "--1", "1d3", "٣", "1-", "."])
def test_words_that_are_no_numbers(text):
    assert number(Token(text, 1, 1)) is None


def test_whole_numbers():
    assert whole(100000.0) == 100000
    assert whole(3.0 + 1e-10) == 3
    assert whole(3.1) is None
    assert whole(1e300) is None
    assert whole(float("inf")) is None


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("{top}", 4000.0),
        ("{top}-1000.0", 3000.0),
        ("{TOP}-1e3", 3000.0),
        ("2*{top}+{left}", 8001.0),
        ("{left}+2*{bottom}", 21.0),
        ("{top}-{bottom}-{bottom}", 3980.0),
        ("{top}/2/2", 1000.0),
        ("-{left}", -1.0),
        ("{top}*-1", -4000.0),
        ("{top}+-1", 3999.0),
        ("-2*-{left}", 2.0),
        ("{top}-1e-3", 3999.999),
        ("1e+3+{left}", 1001.0),
    ],
)
def test_expressions(text, value):
    assert expression(Token(text, 1, 1), "s.py").value(EXTENTS) == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{tpo}-1", "did you mean 'top'"),
        ("{}", "{} is unknown"),
        ("{top", "no part of an expression"),
        ("top}", "no part of an expression"),
        ("{top}-", "missing at the end"),
        ("{top}**2", "missing before '*'"),
        ("*{top}", "missing before '*'"),
        ("--{top}", "missing before '-'"),
        ("{top}{left}", "operator"),
        ("2{top}", "operator"),
        ("{top}1", "operator"),
        ("{top}^2", "'^2' is no part"),
        ("{top}-1e999", "too large"),
        ("{__import__}", "unknown"),
        ("{{top}}", "no part"),
    ],
)
def test_expressions_that_are_none(text, message):
    with pytest.raises(ScriptError) as caught:
        expression(Token(text, 7, 3), "s.py")
    assert str(caught.value).startswith(f"s.py:7: read '{text}' at column 3")
    assert message in str(caught.value)


def test_a_very_long_expression_does_not_recurse():
    assert expression(Token("{left}" + "+1" * 100_000, 1, 1), "s.py").value(EXTENTS) == 100_001.0
