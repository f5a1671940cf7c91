"""Filters: what they choose, and that nothing in them is executed."""

from __future__ import annotations

import time

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.post.view.filter import chosen
from tests.tables import each

X = np.array([-2.0, -1.0, 0.0, 1.0, np.nan])
Y = np.array([1.0, 5.0, 3.0, 4.0, 2.0])
FIELDS = {"x": X, "y": Y, "state": np.array([0, 1, 2, 3, 3]), "id": np.arange(6, 11),
          "group_rock": np.array([0, -1, 1, -1, -1])}  # fmt: skip


def groups(name: str, of: str) -> np.ndarray:
    if name != "roof" or of not in ("", "rock"):
        raise HpcdemError(f"no group {name} {of}")
    return np.array([True, True, False, False, False])


@each(
    ("text", "rows"),
    [
        ("x < 0", [0, 1]), ("x >= 0 and y > 3", [3]), ("x < 0 or y == 3", [0, 1, 2]), ("not x < 0", [2, 3, 4]),
        ("-1 <= x <= 0", [1, 2]), ("x * x - 1 > 0.5", [0]), ("x / 2 + y != 4.5", [0, 2, 4]),
        ("abs(x) > 1.5", [0]), ("sqrt(y) >= 2", [1, 3]), ("hypot(x, y) < 3.1", [0, 2]), ("isnan(x)", [4]),
        ("min(x, y) == x", [0, 1, 2, 3]), ("max(x, 3) < y", [1, 3]), ("log10(y) <= 0", [0]), ("state == 3", [3, 4]),
        ("group(roof)", [0, 1]), ("group(roof, rock) and x > -2", [1]),
        ("group('roof')", [0, 1]), ("range x -1 1", [1, 2, 3]), ("RANGE y (3.0, 4.0)", [2, 3]), ("range id 7", [1]),
        ("range id 7 8 x -9 9", [1, 2]), ("range group 'roof' set 'rock' x -1.5 9", [1]), ("range set 'rock'", [0, 2]),
        ("range group roof and x < -1 or y == 4", [0]), ("range x -9 9 and (x > 0 or y == 5)", [1, 3]),
        ("1 < 2", [0, 1, 2, 3, 4]), ("2 < 1", []),
    ],
)  # fmt: skip
def test_what_is_chosen(text, rows):
    assert np.flatnonzero(chosen(text, 5, FIELDS, groups)).tolist() == rows


@each(
    "text",
    [
        "__import__('os').system('touch /tmp/x')", "().__class__", "x.__class__", "open('/etc/passwd')", "'a' < 'b'",
        "9**9**9 > x", "x << 3 > 1", "[x for x in (1,)]", "(lambda: x)() > 0", "x[0] > 1", "f'{x}' > 1",
        "x if x else y",
        "exec('1') > 0", "globals() > x", "(y := 3) > x", "x > 1; y", "import os", "1e400 < x", f"{'9' * 399} < x",
        "(" * 150 + "x" + ")" * 150, "x > 1" + " or x > 1" * 100, "-" * 200 + "x > 0", "not " * 60 + "x > 0",
        "abs(" * 60 + "x" + ")" * 60 + " > 1", "", "x", "x + 1", "(x > 1) + 1 > 0", "x and y", "True", "x > True",
        "nix > 1", "abs(x, y) > 1", "sin(x) > 0", "abs(x=1) > 0", "group('floor')", "group('roof' + 'x')",
        "group(floor)",
        "range", "range x", "range x __import__('os') 2", "range group", "range geometry 'a'", "range x 0 1 and",
        "range x a.b 1", "range set 'a b'", "range x 0 1 0 1", "group()",
        "x is y", "x in y", "~x > 0", "x // 2 > 1", "x > 1j", "x > ...", "x > None", "*x > 1", "x\x00 > 1",
    ],
)  # fmt: skip
def test_what_is_no_filter_is_refused_at_once(text):
    began = time.process_time()
    with pytest.raises(HpcdemError):
        chosen(text, 5, FIELDS, groups)
    assert time.process_time() - began < 1.0


def test_what_is_reported():
    with pytest.raises(HpcdemError, match=r"filter 'nix > 1': unknown field nix; known: x, y, state, id, group_rock"):
        chosen("nix > 1", 5, FIELDS, groups)
    with pytest.raises(HpcdemError, match=r"'x.real' is not allowed in a filter"):
        chosen("x.real > 1", 5, FIELDS, groups)
    with pytest.raises(HpcdemError, match="expected a comparison"):
        chosen("x + 1", 5, FIELDS, groups)


def test_lines_before_the_comparison_give_names():
    """A script in place of an expression: names of numbers and of comparisons, in their order."""
    fields = {"x": np.array([0.0, 3.0, 6.0]), "y": np.array([0.0, 4.0, 8.0])}
    text = "r = hypot(x, y)\nfar = r > 1\n\nfar and\n r < 7"
    assert chosen(text, 3, fields, lambda *_: np.zeros(3, bool)).tolist() == [False, True, False]
    for wrong, said in (
        ("r = hypot(x, y)", "expected names first"), ("r > 1\nr = 2", "expected names first"),
        ("q = w\nq > 1", "unknown field w"),
        ("__import__ = x\n__import__('os') > 1", "unknown function"), ("r = x\nr", "expected a comparison"),
    ):  # fmt: skip
        with pytest.raises(HpcdemError, match=said):
            chosen(wrong, 3, fields, lambda *_: np.zeros(3, bool))


def test_words_of_a_range_that_came_from_pcdc():
    x, y = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0, 5.0])
    fields = {"x": x, "y": y}

    def found(text):
        return np.flatnonzero(chosen(text, 4, fields, lambda *_: x > 1.5)).tolist()

    assert found("range x 1") == [1] and found("range x 1 2 y 0") == [1]
    assert found("range not x 1 2") == [0, 3] and found("range not group 'a' y 0") == [0, 1]
    assert found("range in-circle (1,0) 1.5") == [0, 1, 2] and found("range not in-circle (1,0) 1.5 and y > 2") == [3]
    for text, why in (
        ("range not", "expected a term after not"), ("range geometry-along 'a'", "frames have no layers"),
        ("range in-circle (1,0)", "expected a centre and a radius"),
    ):  # fmt: skip
        with pytest.raises(HpcdemError, match=why):
            found(text)
