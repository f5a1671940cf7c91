"""docs/wishes.md: each wish of the survey has a row, and the tests and pages that it names are there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.tables import each

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "wishes.md"
ROWS = [
    [cell.strip() for cell in line.strip("|").split(" | ")]
    for line in PAGE.read_text().splitlines()
    if re.match(r"\| (\d+|[a-z]) \|", line)
]
OF_LATER = 23
"""The one wish of the survey that is for later versions (graphics processors)."""


def names_of(path: Path) -> set[str]:
    """Functions of a module."""
    return {node.name for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)}


def anchors_of(path: Path) -> set[str]:
    """What headings of a page are linked by."""
    heads = re.findall(r"^#+ (.*)", path.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_each_wish_has_a_row():
    numbers = [row[0] for row in ROWS]
    assert sorted(int(n) for n in numbers if n.isdigit()) == [n for n in range(1, 41) if n != OF_LATER]
    assert [n for n in sorted(numbers) if not n.isdigit()] == list("abcdefghij")


@each("row", ROWS, ids=lambda row: row[0])
def test_tests_of_a_row_are_there(row):
    _, _, what, tests = row
    named = re.findall(r"`(tests/[\w/]+\.py)::(test_\w+)`", tests.rstrip(" |"))
    assert named and len(named) == tests.count("`") // 2, "tests, and nothing else"
    for path, name in named:
        assert (ROOT / path).is_file() and name in names_of(ROOT / path), f"{path}::{name}"
    assert ("partly" in what) <= ("not yet" in what), "what is partly there says what is not"


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([^)]+)\)", PAGE.read_text()))))
def test_links_of_the_page(link):
    name, _, anchor = link.partition("#")
    target = (PAGE.parent / name) if name else PAGE
    assert target.is_file()
    assert not anchor or anchor in anchors_of(target)
