"""The kind of a script is known by its content."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.lang.detect import kind

PYTHON = (
    "import hpcdem\n\nsim = hpcdem.Simulation()  # START\nsim.gen(1000, radii=(60.0, 80.0), x=(0, 1e4), y=(0, 1e4))\n"
)
PCDC = """import math
# a new model
pcdc model new
for i in range(1, 10):
    pcdc geometry create polyline ([i],0) (0,[i]) as-layer ['line'+ str(i)]
"""


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (b"START\nSTOP\n", "zdem"),
        (b"\xef\xbb\xbf# title\r\n\r\nstart\r\nSET disk off\r\n", "zdem"),
        ("# 生成\nRES 0000046000.sav".encode("gbk"), "zdem"),
        (b"LOAD(init_xyr.dat)", "zdem"),
        (b"STRAT\nSET disk off\nCYC 10\n", "zdem"),  # the parser will say what is wrong with the first line
        (b"START\nfor i in range(3):\n", "zdem"),
        (PYTHON, "python"),
        (PYTHON.replace("\n", "\r\n"), "python"),
        ('"""pcdc model new\n\nSTART\n"""\nimport hpcdem\n', "python"),
        ("def f():\n    from hpcdem import Simulation\nf()\n", "python"),
        ("# -*- coding: gbk -*-\nimport hpcdem # 生成\n".encode("gbk"), "python"),
        (PCDC, "pcdc"),
        (b"pcdc model save 'test.sav'", "pcdc"),
        ("# 恢复\n\tpcdc model restore 'a'\n".encode("gbk"), "pcdc"),
    ],
)
def test_kinds(source, expected):
    assert kind(source) == expected


@pytest.mark.parametrize(
    ("source", "line", "message"),
    [
        (b"", 1, "there is no command in the script"),
        (b"# nothing but a title\n", 1, "there is no command in the script"),
        (b"print('hello')\n", 1, "this Python script imports nothing; it must import hpcdem"),
        (b"# a\nx = 3\ny = x + 1\n", 2, "this Python script imports nothing"),
        (b"import hpcdem\nsim = hpcdem.Simulation(\n", 2, "this is not correct Python"),
        (b"import hpcdem\nx ==== 3\n", 2, "this is not correct Python: invalid syntax"),
        (b"\nSTRAT\n", 2, "'strat' is not the beginning of a script: neither a ZDEM command; did you mean 'START'?"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", 1, "is not the beginning of a script"),
        (b"Lorem ipsum dolor\nsit amet\n", 1, "nor a pcdc command, nor Python"),
    ],
)
def test_what_is_none_of_them(source, line, message):
    with pytest.raises(ScriptError) as caught:
        kind(source, "a.py")
    assert message in str(caught.value)
    assert caught.value.line == line


def test_nothing_is_executed(tmp_path):
    trap = tmp_path / "trap"
    assert kind(f"import os\nos.mkdir({str(trap)!r})\n") == "python"
    assert not trap.exists()


def test_deeply_nested_text_is_refused_like_any_other():
    with pytest.raises(ScriptError):
        kind(b"(" * 50_000)
