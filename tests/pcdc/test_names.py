"""model save and restore: the state of the project, m_ variables and functions."""

from __future__ import annotations

import json
import math

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc.vector import Vector
from tests.pcdc.fake import Bench
from tests.tables import each

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right group 'rock' set 'domain'\n"


def reopened(bench: Bench, file: str = "test.sav") -> Bench:
    """A new session that restores the file."""
    return Bench(bench.project.directory)(f"pcdc model restore '{file}'\n")


def test_the_variables_of_the_manual(bench):
    bench("m_height=20.0\nm_count=10\npcdc model save 'test.sav'\n")
    again = reopened(bench)
    again("new_height = (m_height-10.0)*float(m_count)\n")
    assert again["new_height"] == 100.0 and type(again["m_count"]) is int


def test_the_function_of_the_manual(bench):
    bench("def m_mag(x,y):\n    mag=math.sqrt(x*x+y*y)\n    return mag\npcdc model save 'test.sav'\n")
    assert reopened(bench)("m = m_mag(20.0,10.0)\n")["m"] == math.hypot(20, 10)


@pytest.mark.parametrize(
    "value",
    ["3", "-2**70", "2.5", "float('inf')", "-0.0", "True", "'text \\'岩\\n'", "Vector(1, 2)", "Vector(1.5, -2, 1e300)"],
)
def test_values_come_back_as_they_were(bench, value):
    bench(f"m_x = {value}\nother = 1\npcdc model save 'test.sav'\n")
    again = reopened(bench)
    assert again["m_x"] == bench["m_x"] and type(again["m_x"]) is type(bench["m_x"])
    assert math.copysign(1, again["m_x"]) == math.copysign(1, bench["m_x"]) if value == "-0.0" else True
    assert "other" not in again.interpreter.namespace


def test_numbers_of_numpy_are_numbers_and_nan_stays_nan(bench):
    bench("import numpy as np\nm_i, m_f, m_b, m_n = np.int32(3), np.float64(.5), np.bool_(True), float('nan')\n"
          "pcdc model save 'test.sav'\n")  # fmt: skip
    again = reopened(bench)
    assert [again[name] for name in ("m_i", "m_f", "m_b")] == [3, 0.5, True] and again["m_b"] is True
    assert math.isnan(again["m_n"])


def test_other_variables_are_left_out_with_a_warning(bench):
    bench("m_list = [1]\nm_none = None\nm_a = 1\npcdc model save 'test.sav'\n")
    told = [line for line in bench.blocks.log.lines if line.startswith("warning")]
    assert len(told) == 2 and "m_list is not saved: it is a list" in told[0]
    assert "m_list" not in reopened(bench).interpreter.namespace


def test_functions_keep_their_commands_and_defaults(bench):
    bench(
        "if True:\n"
        "    def m_line(x, y=2, *, name='l'):  # a line\n"
        "        '''pcdc model new'''\n"
        "        for i in range(2):\n"
        "            pcdc geometry create polyline ([x],[i]) \\\n"
        "                ([y],[i]) as-layer [name + str(i)]\n"
        "        return m_other(x)\n"
        "def m_other(x):\n    return x + m_a\n"
        "m_a = 5\npcdc model save 'test.sav'\n"
    )
    again = reopened(bench)("m_r = m_line(1)\nm_line(7, name='k')\n")
    assert again["m_r"] == 6 and set(again.project.layers) == {"l0", "l1", "k0", "k1"}
    assert again.project.layers["l1"][0].points.tolist() == [[1, 1], [2, 1]]
    again("pcdc model save 'again.sav'\n")
    assert reopened(again, "again.sav")("m_r = m_line(3)\n")["m_r"] == 8
    with pytest.raises(HpcdemError) as caught:
        again("m_line(None)\n")
    assert "test.sav:m_line:4: pcdc geometry create polyline" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("m_f = lambda x: x\n", "m_f cannot be saved: it is not a function defined by a def of the script"),
        ("def f(x):\n    return x\nm_f = f\n", "m_f cannot be saved: it is an alias of the function f"),
        ("def make(a):\n    def m_f(x):\n        return a + x\n    return m_f\nm_f = make(1)\n",
         "m_f cannot be saved: it uses a of the function around it"),
        ("import functools\n@functools.cache\ndef m_f(x):\n    return x\nm_f = m_f.__wrapped__\n", "has a decorator"),
        ("m_a = [1]\ndef m_f(x=m_a):\n    return x\n", "m_f has the default value m_a"),
        ("def m_f(x=print('no')):\n    return x\n", "m_f has the default value print('no')"),
        ("def m_f(x: int):\n    return x\n", "m_f has annotations"),
        ("from math import sqrt\nimport os.path\nm_f = os.path.join\n", "m_f cannot be saved"),
    ],
)  # fmt: skip
def test_functions_that_cannot_be_restored_are_not_saved(bench, text, message):
    with pytest.raises(HpcdemError) as caught:
        bench(text + "pcdc model save 'test.sav'\n")
    assert message in str(caught.value) and not (bench.project.directory / "test.sav").exists()


HOSTILE = [
    ("functions", {"m_f": "import os\nos.system('touch hacked')"}, "is not one def, but 2 statements"),
    ("functions", {"m_f": "def m_f(): pass\nopen('hacked', 'w')"}, "is not one def, but 2 statements"),
    ("functions", {"m_f": "@open\ndef m_f(): pass"}, "has a decorator"),
    ("functions", {"m_f": "def m_f(x=open('hacked', 'w')): pass"}, "has the default value open('hacked', 'w')"),
    ("functions", {"m_f": "def m_f(*, x=open('hacked', 'w')): pass"}, "has the default value"),
    ("functions", {"m_f": "def m_f(x: open('hacked', 'w')): pass"}, "has annotations"),
    ("functions", {"m_f": "def m_f() -> open('hacked', 'w'): pass"}, "has annotations"),
    ("functions", {"m_f": "def m_g(): pass"}, "m_f is not a plain def of that name"),
    ("functions", {"m_f": "async def m_f(): pass"}, "m_f is not a plain def"),
    ("functions", {"m_f": "class m_f:\n    open('hacked', 'w')"}, "m_f is not a plain def"),
    ("functions", {"m_f": "pcdc model new"}, "m_f is not a plain def"),
    ("functions", {"m_f": "def m_f(:"}, "this is not correct Python"),
    ("functions", {"m_f": 7}, "is not the text of a function"),
    ("functions", {"print": "def print(): pass"}, "is no name that can be restored"),
    ("functions", {"m_f); open('hacked', 'w'); (": "def m_f(): pass"}, "is no name that can be restored"),
    ("functions", [], "its functions are not a table"),
    ("variables", {"__builtins__": ["int", "1"]}, "is no name that can be restored"),
    ("variables", {"m_x": ["eval", "open('hacked', 'w')"]}, "variable m_x"),
    ("variables", {"m_x": ["int", "1 + 1"]}, "variable m_x"),
    ("variables", {"m_x": ["int", [1]]}, "variable m_x"),
    ("variables", {"m_x": ["Vector", [1, 2, 3, 4]]}, "variable m_x"),
    ("variables", {"m_x": ["float", "one"]}, "variable m_x"),
    ("variables", {"m_x": ["bool", 1]}, "variable m_x"),
    ("variables", {"m_x": 3}, "variable m_x"),
]


@each(("what", "given", "message"), HOSTILE, ids=[str(given)[:40] for _, given, _ in HOSTILE])
def test_what_a_file_says_is_not_executed(bench, monkeypatch, what, given, message):
    monkeypatch.chdir(bench.project.directory)
    bench("m_a = 1\npcdc model save 'test.sav'\n")
    path = bench.project.directory / "test.sav"
    state = json.loads(path.read_text())
    state["extra"]["names"][what] = given
    path.write_text(json.dumps(state))
    again = Bench(bench.project.directory)
    with pytest.raises(HpcdemError) as caught:
        again("m_before = 2\npcdc model restore 'test.sav'\n")
    assert message in str(caught.value)
    assert not (bench.project.directory / "hacked").exists() and again["m_before"] == 2
    assert again["print"] is not None and "m_a" not in again.interpreter.namespace


def test_a_default_that_is_plain_comes_back(bench):
    bench("def m_f(a=-1, b='x', c=None, d=True, *, e=2.5):\n    return (a, b, c, d, e)\npcdc model save 'test.sav'\n")
    assert reopened(bench)("m_r = None\nresult = m_f()\n")["result"] == (-1, "x", None, True, 2.5)


def test_the_project_comes_back(bench):
    bench(
        BOX + "pcdc geometry create arc (0,0) 1 0 90 as-layer 'arch'\n"
        "pcdc geometry create point (1,1) (2,2) as-layer 'gauges'\n"
        "pcdc node group 'top' set 'bc' range y 2 2\npcdc face-joint group 'all'\n"
        "pcdc element c-model null range id 0 1\n"
        "pcdc table create 't' values (0,0) (1,5)\n"
        "pcdc history create 'load' node value reaction-y sum every 10 range group 'top' set 'bc'\n"
        "pcdc chart create 'c' title 'T' x-label 'x'\npcdc chart add 'c' y 'load' scale-y 2\n"
        "pcdc model option dynamic off\npcdc model step 25\npcdc model save 'test.sav'\n"
    )
    again = reopened(bench)
    one, two = bench.project, again.project
    assert list(two.layers) == list(one.layers)
    for name in one.layers:
        for a, b in zip(one.layers[name], two.layers[name], strict=True):
            assert a.points.tolist() == b.points.tolist() and a.bulges.tolist() == b.bulges.tolist()
            assert a.closed == b.closed
    assert {k: v.state() for k, v in one.groups.items()} == {k: v.state() for k, v in two.groups.items()}
    assert two.alive.tolist() == one.alive.tolist() == [False] * 2 + [True] * 14
    assert two.histories["load"].rows == one.histories["load"].rows and len(two.histories["load"].rows) == 2
    assert two.charts == one.charts and two.dynamic is False and two.step == 25
    again("pcdc model step 5\npcdc history export 'h.csv'\n")
    assert [row[0] for row in two.histories["load"].rows] == [10, 20, 30]
    lines = (bench.project.directory / "data" / "history_load.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines] == ["step", "10", "20", "30"]


def test_a_damaged_state_is_refused(bench):
    bench(BOX + "pcdc model save 'test.sav'\n")
    path = bench.project.directory / "test.sav"
    state = json.loads(path.read_text())
    for change in ({"groups": 3}, {"null": [99]}, {"layers": {}}, {"format": 99}, {"histories": {"h": {"kind": "x"}}}):
        path.write_text(
            json.dumps({**state, "extra": {**state["extra"], "project": {**state["extra"]["project"], **change}}})
        )
        with pytest.raises(HpcdemError, match=r"test\.sav (is damaged|was not saved by this language)"):
            reopened(bench)


def test_vectors():
    v = Vector(1, 2)
    assert (v.X, v.Y, len(v), list(v), v[1]) == (1.0, 2.0, 2, [1.0, 2.0], 2.0) and str(v) == "(1.0, 2.0)"
    assert v + Vector(1, 1) == Vector(2, 3) and v - v == Vector(0, 0) and -v == Vector(-1, -2)
    assert 2 * v == v * 2 == Vector(2, 4) and v / 2 == Vector(0.5, 1) and Vector(1, 2, 3).Z == 3.0
    assert repr(v) == "Vector(1.0, 2.0)" and hash(v) == hash(Vector(1.0, 2.0)) and v != (1.0, 2.0)
    with pytest.raises(AttributeError, match="two components"):
        _ = v.Z
    for wrong in (
        lambda: v + 1,
        lambda: v + Vector(1, 2, 3),
        lambda: v * v,
        lambda: Vector(1),
        lambda: Vector(1, 2, 3, 4),
    ):
        with pytest.raises(TypeError):
            wrong()
