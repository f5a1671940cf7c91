"""Parameters of scripts of each kind: what declares one, what its value changes, what is refused."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import ScriptError, UsageError
from hpcdem.lang.parameters import Adjustable, read
from hpcdem.lang.zdem.parser import parse_text

ZDEM = """\
friction = 0.3  # 摩擦 friction = 9
Depth = -300
START
SET dt 0.1, seed 20
PROP fric {friction} RANGE y ({bottom}, {top}{depth})
CYC 10
"""
PYTHON = (
    "import hpcdem\n\ncohesion: float = 1e6; name = 'a'\nn, old = -3, True\nplatens = True\nprint(cohesion, name, n)\n"
)


def test_a_parameter_is_the_number_wherever_its_name_stands():
    plain = ZDEM.split("START")[1].replace("{friction}", "0.3").replace("{depth}", "-300")
    with_names, without = parse_text(ZDEM).statements, parse_text(f"START{plain}").statements
    assert all(a.same_as(b) for a, b in zip(with_names, without, strict=True))


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        ("h = 3\nSTART\nSET dt 1", 1, "parameter h is never used"),
        ("h = 3\nh = 4\nSTART\nSET dt {h}", 2, "the parameter h is set a second time, after line 1"),
        ("top = 3\nSTART\nSET dt {top}", 1, "'top' is an extent of the model"),
        ("h = much\nSTART", 1, "'h'"),
        ("START\nSET dt {h}\nh = 3", 2, "{h}"),
        ("h = -3\nSTART\nSET dt {h}", 3, "read '-3'"),
    ],
)
def test_what_can_be_no_parameter_is_refused_with_its_line(text, line, what):
    with pytest.raises(ScriptError) as refused:
        parse_text(text, "push.py")
    assert refused.value.line == line and what in str(refused.value)


def test_a_line_that_was_a_command_stays_one():
    assert [s.command for s in parse_text("START\nSET dt 1\nCYC = 10").statements] == ["START", "SET", "CYC"]


def adjustable(text: str, file: str = "push.py") -> Adjustable:
    return read(text.encode(), file)


def test_other_values_change_their_place_and_nothing_else():
    script = adjustable(ZDEM)
    assert {n: p.value for n, p in script.parameters.items()} == {
        "friction": 0.3, "depth": -300, "seed": 20, "twin": 0,
    }  # fmt: skip
    text = script.with_values({"friction": 0.25, "seed": 7}).decode()
    assert text == ZDEM.replace("friction = 0.3 ", "friction = 0.25 ").replace("seed 20", "seed 7")
    assert parse_text(text).statements[1].get("seed") == 7


@pytest.mark.parametrize(
    ("head", "seed"), [("SET see = 4", "SET see = 5"), ("SET dt 0.1 seed(4)", "SET dt 0.1 seed(5)")]
)
def test_the_seed_of_zdem_is_a_parameter_however_it_is_written(head, seed):
    assert adjustable(f"START\n{head}\n").with_values({"seed": 5}).decode() == f"START\n{seed}\n"


def test_literals_of_python_are_parameters():
    script = adjustable(PYTHON)
    assert {n: p.value for n, p in script.parameters.items()} == {"cohesion": 1e6, "name": "a"}
    text = script.with_values({"cohesion": 2.5e6, "name": "it's"}).decode()
    assert text == PYTHON.replace("1e6", "2500000.0").replace("'a'", '"it\'s"')
    named = {}
    exec(text.replace("import hpcdem\n", ""), named)
    assert (named["cohesion"], named["name"]) == (2.5e6, "it's")


@pytest.mark.parametrize(
    ("text", "name", "why"),
    [
        (PYTHON, "platens", "push.py:5 sets it but never uses it"),
        (PYTHON, "n", "has no such parameter"),
        (PYTHON, "cohesio", "did you mean 'cohesion'?"),
        ("import a\nx = 1\nfor x in y:\n  print(x)", "x", "more than once, first in line 2"),
        ("import a\nx = 1\nx += 1\nprint(x)", "x", "more than once"),
        ("import a\nx = 1\ndef f():\n  global x\n  x = 2\nprint(x)", "x", "more than once"),
        ("import a\nx = 2 * 3\nprint(x)", "x", "push.py:2 does not set it to a number, a word, True or False"),
        ("START\nSET dt 1\n", "seed", "available: none. Add a line seed = NUMBER to create one"),
        ("START\nSET seed 1\nSET seed 2\n", "seed", "no such parameter"),
    ],
)
def test_a_name_whose_value_might_not_act_is_refused(text, name, why):
    with pytest.raises(UsageError) as refused:
        adjustable(text).value(name, "1")
    assert why in str(refused.value)


def test_a_name_of_a_function_of_its_own_does_not_count():
    script = adjustable("import a\nx = 1\ndef f(x):\n  x = 2\n  return [x for x in y]\nprint(x)")
    assert script.with_values({"x": 5}).startswith(b"import a\nx = 5\n")


def test_pcdc_commands_read_parameters():
    script = adjustable("young = 10e9\npcdc element property young [young]\n", "a.sc")
    assert script.with_values({"young": 2e9}).decode().splitlines()[0] == "young = 2000000000.0"


@pytest.mark.parametrize(
    ("name", "word", "value"),
    [("cohesion", "2", 2), ("cohesion", "2.0", 2.0), ("cohesion", "2.5", 2.5), ("name", "2", "2")],
)
def test_words_become_values_of_the_kind_that_is_there(name, word, value):
    found = adjustable(PYTHON).value(name, word)
    assert found == value and isinstance(found, type(value))


@pytest.mark.parametrize(("name", "word"), [("cohesion", "much"), ("cohesion", "nan"), ("on", "2")])
def test_values_of_another_kind_are_refused(name, word):
    with pytest.raises(UsageError, match="expected"):
        adjustable("import a\ncohesion = 1.0\non = True\nprint(cohesion, on)").value(name, word)


def test_a_value_that_makes_a_wrong_script_is_refused_before_anything_runs():
    with pytest.raises(ScriptError, match=r"push\.py:5: PROP"):
        adjustable(ZDEM).with_values({"friction": -1.0})
