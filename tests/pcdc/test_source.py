"""Python with commands in it becomes Python."""

from __future__ import annotations

import ast

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc.source import decode, read


def test_a_command_becomes_a_call_with_its_expressions():
    script = read("for i in range(3):\n\tpcdc geom create p ([i],0) (0,[i+1]) as-layer ['l'+str(i)] # three\nx = 1\n")
    assert script.python.split("\n")[1] == "\t__pcdc__(0, (i), (i+1), ('l'+str(i)), )"
    assert script.python.split("\n")[2] == "x = 1" and len(script.statements) == 1


def test_lines_keep_their_numbers():
    text = "a = 1\npcdc model new\n\npcdc geometry create polyline (0,0) \\\n    (1,1) \\\n  as-layer 'x'\nb = 2\n"
    script = read(text)
    assert [s.line for s in script.statements] == [2, 4] and script.statements[1].last_line == 6
    assert script.python.count("\n") == text.count("\n") + 1 and script.python.split("\n")[6] == "b = 2"
    assert script.statements[1].arguments["points"] == [(0.0, 0.0), (1.0, 1.0)]
    assert script.statement_at(5) is script.statements[1] and script.statement_at(3) is None
    assert script.statements[1].text == "pcdc geometry create polyline (0,0) (1,1) as-layer 'x'"


@pytest.mark.parametrize(
    "text",
    [
        'x = """\npcdc model new\n"""\n',
        "x = '''a\n  pcdc nonsense ((\n'''\n",
        "x = (1,\npcdc,\n)\n",
        "x = 'a\\\npcdc model new'\n",
        "x = 1 + \\\npcdc.time\n",
        "# pcdc nonsense\n",
        "pcdc.time\npcdc[0]\npcdc_new = 3\npcdcs = 4\n",
        "def f(pcdc_x):\n    '''pcdc model new'''\n    return pcdc.cycle\n",
        'x = f"{a["b"]}"  # pcdc model\n',
        "x = '\\'' # '''\n",
    ],
)
def test_what_is_no_command_stays_as_it_is(text):
    lines = text.split("\n")
    try:
        ast.parse(text)
    except SyntaxError:  # quotes inside of quotes of an f-string are new in Python 3.12
        with pytest.raises(ScriptError):
            read(text)
        return
    script = read(text)
    assert script.statements == [] and script.python.split("\n")[: len(lines)] == lines


def test_quotes_and_comments_in_python_do_not_hide_commands():
    text = "x = 'it''s'  # don't\ny = \"#\"\nz = '''a''' + \"\"\"b\"\"\"\nif x:\n    pcdc model new\n"
    assert [s.line for s in read(text).statements] == [5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pcdc = 3\n", "a.sc:1: pcdc = 3: 'pcdc' is reserved and cannot name a variable"),
        ("x = 1\nif x\n    pcdc model new\n", "a.sc:2: if x: this is not correct Python: expected ':'"),
        ("if x:\npcdc model new\n", "a.sc:2: pcdc model new: this is not correct Python: expected an indented block"),
        ("if True: pcdc model new\n", "a.sc:1: if True: pcdc model new: a command needs its own line"),
        ("print 'x'\n", "Missing parentheses in call to 'print'"),
        ("x = (1,\n", "a.sc:1: x = (1,: this is not correct Python: '(' was never closed"),
        ("pcdc model step [n] (\n", "a.sc:1: pcdc model step [n] (: "),
        ("x = 1\npcdc model new\n  y = 2\n", "a.sc:3: y = 2: this is not correct Python: unexpected indent"),
        ("pcdc model new\npcdc\n", "a.sc:2: pcdc: the line ends where a command"),
        ("pcdc model restore 'a\\\nb'\n", "does not end: ' is missing"),
    ],
)
def test_errors_name_the_line_and_show_it(text, message):
    with pytest.raises(ScriptError) as caught:
        read(text, "a.sc")
    assert message in str(caught.value)


def test_the_first_error_of_a_command_is_reported_before_python_is_inspected():
    with pytest.raises(ScriptError, match=r"a\.sc:2: pcdc model nwe"):
        read("x = 1\npcdc model nwe\nif (\n", "a.sc")


def test_encodings_of_editors():
    text = "m_name = '岩石'  # 注释\r\npcdc element group [m_name]\r\n"
    expected = text.replace("\r\n", "\n")
    for encoding in ("utf-8", "utf-8-sig", "gb18030", "gbk"):
        assert decode(text.encode(encoding), "a.sc") == expected
    assert decode(b"a = 1\rb = 2\r", "a.sc") == "a = 1\nb = 2\n"
    for bad, line in ((b"a = 1\nb = '\xff\xff'\n", 2), (b"a\n\n\0b", 3), ("a".encode("utf-16"), 1)):
        with pytest.raises(ScriptError) as caught:
            decode(bad, "a.sc")
        assert str(caught.value).startswith(f"a.sc:{line}: ")


def test_a_backslash_in_a_text_or_comment_does_not_continue():
    script = read("pcdc model restore 'a\\b.sav'\npcdc model new # x \\\nx = 1\n")
    assert [s.line for s in script.statements] == [1, 2] and script.statements[0].arguments["file"] == "a/b.sav"


@pytest.mark.parametrize(
    "words",
    ["[" * 5000, "'" + "[" * 5000, "(" * 5000, "[(" + "(" * 5000 + ")" * 5000 + ")]", "[" + "-" * 100_000 + "1]",
     "9" * 100_000, "[1" + "+1" * 100_000 + "]", "'" + "a" * 1_000_000 + "'", "x" * 1_000_000],
    ids=range(9),
)  # fmt: skip
def test_hostile_lines_are_refused_in_a_short_line(words):
    with pytest.raises(ScriptError) as caught:
        read(f"pcdc model restore {words}", "a.sc")
    assert len(caught.value.message) < 1000
