"""Whatever is in a script, reading it ends in statements or in one ScriptError.

The examples are the same in every run (derandomize): a failure is a failure of the program, not of luck.
"""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from hpcdem.core.errors import ScriptError
from hpcdem.lang import detect
from hpcdem.lang.zdem import check, plan
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.lexer import Token, expression, read_lines
from hpcdem.lang.zdem.parser import parse_text

OPTIONS = [option for command in t.COMMANDS for option in (*command.leading, *command.options)]
WORDS = sorted(
    {row.name for row in (*t.COMMANDS, *OPTIONS, *t.RANGE_TERMS)}
    | {"RANGE", "discrete", "lsm", "hex", "off", "on", "kinetic", *t.COLORS}
)
NUMBERS = ["0", "1", "2", "-1", "0.5", "1e3", "1e-9", "1e300", "1e-300", "1e999", "-0", "9" * 400, "nan", "0x1"]
EXPRESSIONS = ["{top}", "{top}-1000.0", "{left}/0", "{tpo}", "{", "}", "{}", "{top}-", "-{right}*2"]

MANUAL = (
    "push", "syn_erosion", "syn_sedimentaion", "pre_struct", "detachment", "palaeohigh", "extens_rigid",
    "ex8_dem_am_gen", "ex8_dem_am_push", "extens_ductile_patent", "push_add_del",
)  # fmt: skip

words = st.sampled_from(WORDS) | st.sampled_from(NUMBERS) | st.sampled_from(EXPRESSIONS) | st.text(max_size=6)
lines = st.lists(words, max_size=12).map(" ".join)
valid_lines = st.sampled_from([line for command in t.COMMANDS for line in command.example])
scripts = st.lists(lines | valid_lines, max_size=12).map(lambda found: "\n".join(["START", "SET DT 5e-2", *found]))


def read(source):
    """Parse, and do with the result everything that is done before a run."""
    try:
        script = parse_text(source, "s.py")
    except ScriptError as error:
        assert error.line >= 1 and error.message and "\n" not in str(error)
        return None
    assert script.statements[0].command in ("START", "RESTORE", "LOAD")
    plan.expected_steps(script.statements, dt=0.05)
    check.summary(script)
    return script


@given(st.binary(max_size=200))
@example(b"START\nSET DT 1e-300\nWALL id 1 nodes 0 0 1 1 xv 1e-300\nIMPLE wall id 1 xmove 1")
@example(b"START\nGEN num 5 rad discrete 1e-300 x 0 1 y 0 1\nGLINE p1 0 0 p2 1 1 rad 1e-300")
@example(b"START\nGEN grid rad discrete 1e-9 x -1e308 1e308 y -1e308 1e308\nSET DT 1\nCYC 9007199254740992")
@example(b"LOAD \xe4\xb8\x80.dat x {top} {top}/0")
@example(b"LOAD " + b"a" * 5000)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_bytes(source):
    read(source)


@given(scripts)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_any_words(source):
    read(source)


@given(st.data())
@settings(max_examples=150, deadline=None, derandomize=True)
def test_a_good_script_with_one_change(data):
    """Insert, drop or replace one character or word somewhere in correct lines."""
    good = "\n".join(["START", "SET DT 5e-2", *data.draw(st.lists(valid_lines, min_size=1, max_size=6))])
    at = data.draw(st.integers(0, len(good)))
    upto = min(len(good), at + data.draw(st.integers(0, 8)))
    read(good[:at] + data.draw(words) + good[upto:])


# What people do to a script, and what editors, mailers and disks do to it: (offset, length, what to put there).
changes = st.lists(
    st.tuples(
        st.integers(0, 10**6),
        st.integers(0, 60),
        st.sampled_from([w.encode() for w in (*WORDS, *NUMBERS, *EXPRESSIONS)])
        | st.binary(max_size=8)
        | st.sampled_from([b"", b"\n", b"\r", b" ", b",", b"#", b"(", b"\x00", b"\xef\xbc\x8c", b"RANGE"]),
    ),
    min_size=1,
    max_size=4,
)


@given(name=st.sampled_from(MANUAL), how=changes, cut=st.none() | st.integers(0, 10**6))
@settings(
    max_examples=200, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_scripts_of_the_manual_spoilt(manual_scripts, name, how, cut):
    """Up to four places overwritten, perhaps the end lost."""
    source = (manual_scripts / f"{name}.py").read_bytes()
    for at, length, put in how:
        at %= len(source) + 1
        source = source[:at] + put + source[at + length :]
    read(source if cut is None else source[: cut % (len(source) + 1)])


@given(name=st.sampled_from(MANUAL), order=st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_scripts_of_the_manual_in_another_order(manual_scripts, name, order):
    """Lines twice, not at all, or somewhere else."""
    lines = (manual_scripts / f"{name}.py").read_bytes().splitlines(keepends=True)
    read(b"".join([lines[0], *order.choices(lines, k=len(lines))]))


@given(st.text(alphabet="{}topleft+-*/0123456789.e", max_size=20))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_expression(text):
    try:
        found = expression(Token(text, 1, 1), "s.py")
    except ScriptError:
        return
    assert found.text == text


@given(st.binary(max_size=100) | st.text(max_size=100))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_the_kind_of_anything(source):
    try:
        assert detect.kind(source) in ("zdem", "pcdc", "python")
    except ScriptError as error:
        assert error.line >= 1


@given(st.binary(max_size=100))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_tokens_point_at_their_words(source):
    try:
        lines = list(read_lines(source, "s.py"))
    except ScriptError:
        return
    for line in lines:
        for token in line.tokens:
            assert token.text and token.column >= 1 and token.line == line.number


@pytest.mark.parametrize("n", [20_000])
def test_long_lines_are_read_in_time_and_without_recursion(n):
    text = "START\nDEL RANGE x 0 1" + " and x 0 1" * n
    (_, statement) = parse_text(text, "s.py").statements
    assert len(statement.selection.terms) == n + 1
    assert statement.selection.resolve({}) == statement.selection
