"""A class is as long as a reader takes in at once; those that are longer are named here, and why."""

import re
from itertools import pairwise

from tests.conftest import ROOT

LINES = 400
LONGER = {"hpcdem.api.simulation.Simulation": "the methods of a program, one beside the other"}
"""Take a line away when you have split the class."""


def long_classes(text: str) -> list[str]:
    """Classes of a module that have more than LINES lines."""
    starts = [match.start() for match in re.finditer(r"^[^\s)\]}#]", text, re.M)] + [len(text)]
    parts = [text[begin:end].rstrip() for begin, end in pairwise(starts)]
    return [part[6 : re.search(r"\W", part[6:]).start() + 6] for part in parts
            if part.startswith("class ") and part.count("\n") >= LINES]  # fmt: skip


def test_no_other_class_is_longer():
    found = {
        f"{'.'.join(path.relative_to(ROOT).with_suffix('').parts)}.{name}"
        for path in (ROOT / "hpcdem").rglob("*.py")
        if (text := path.read_text(encoding="utf-8")).count("\n") > LINES
        for name in long_classes(text)
    }
    assert found - LONGER.keys() == set()


def test_a_long_class_is_found():
    body = "    x = 0\n"
    assert long_classes("class A:\n" + body * LINES) == ["A"]
    assert long_classes("class A:\n" + body * (LINES - 1) + "class B:\n    pass\n") == []
