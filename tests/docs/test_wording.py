"""Wording: phrases that docs/writing.md replaces are absent from the pages and from the package."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from tests.conftest import sources
from tests.docs.pages import PAGES, ROOT, prose
from tests.tables import each

PHRASES = {
    r"(?:is|are|was|were|be|been) told": "reports, is reported",
    r"answered with the nearest": "suggests the nearest",
    r"asked for|(?:is|are|was|were) asked": "requested, required",
    r"bears? (?:\d|the load|load|nothing|more|less)": "carries, supports, fails at",
    r"behind (?:its|their|the) (?:peak|strength)": "past its peak",
    r"beside (?:the|its|their|a|that|those) (?:closed|published|exact|formula|theory)": "compared with",
    r"comes? first": "must precede",
    r"drawn apart": "pulled in tension",
    r"go(?:es|ing|ne)? on": "continues, resumes",
    r"hangs? together": "connected",
    r"(?:held|holds?) against": "compared with, checked against",
    r"in the place of": "instead of",
    r"knows? (?:of )?(?:nothing|no)": "does not support, ignores",
    r"laws? of (?:the |a )?users?": "user law",
    r"looked (?:at|for)": "checked, searched for",
    r"(?:may|can|was|were|is|are|be) said": "assigned, given, reported",
    r"Mohr and Coulomb": "Mohr-Coulomb",
    r"passed over": "skipped",
    r"rubs?|rubbed": "frictional contact",
    r"sags?": "deflection, settlement",
    r"stands? still|stood still": "is at rest, is fixed",
    r"swings?": "oscillates",
    r"taken out|takes? out": "excavated, removed",
    r"that there (?:is|are)|there is none|there are none": "available, none is given",
    r"the way (?:it|they) (?:broke|breaks?)": "mode",
    r"throws? (?:\w+ ){0,3}apart": "repels",
    r"warms|warmed": "heats, heated",
}
"""What is always wrong here, as an expression, and what to write."""

GENERATED = ("pcdc_reference", "zdem_reference", "pcdc_online", "python_reference", "options", "fields")
"""Pages made of strings of the package, which are counted there."""

_ANY = re.compile(rf"\b(?:{'|'.join(f'({phrase})' for phrase in PHRASES)})\b")


def found(text: str) -> Counter[str]:
    """Phrases in a text."""
    names = list(PHRASES)
    return Counter(names[match.lastindex - 1] for match in _ANY.finditer(" ".join(text.split())) if match.lastindex)


def written(page: Path) -> str:
    """The prose of a page, without tables that scripts write and the glossary of words to avoid."""
    text = re.sub(r"<!-- campaign: begin -->.*?<!-- campaign: end -->", "", prose(page), flags=re.DOTALL)
    return re.sub(r"^## Glossary\n.*?(?=^## )", "", text, flags=re.MULTILINE | re.DOTALL)


OURS = [p for p in PAGES if not p.name.endswith(".zh.md") and p.stem not in GENERATED]


@each("page", OURS, ids=[str(page.relative_to(ROOT)) for page in OURS])
def test_pages_use_the_words_of_the_field(page: Path) -> None:
    text = written(page)
    wrong = [f"{re.findall(rf'.*(?:{phrase}).*', text)[:1]}: write {PHRASES[phrase]}" for phrase in found(text)]
    assert not wrong, wrong


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
def test_a_reader_finishes_the_readme(name: str) -> None:
    assert len((ROOT / name).read_text(encoding="utf-8").splitlines()) <= 120


@each("path", sources("hpcdem", "**/*.py"))
def test_sources_use_the_words_of_the_field(path: Path) -> None:
    """Messages, docstrings, comments and names."""
    wrong = [f"{phrase}: write {PHRASES[phrase]}" for phrase in found(path.read_text(encoding="utf-8"))]
    assert not wrong, (path, wrong)


def test_what_the_expressions_find() -> None:
    assert found("a joint behind its peak is told; the way they broke") == Counter(
        {r"behind (?:its|their|the) (?:peak|strength)": 1, r"(?:is|are|was|were|be|been) told": 1,
         r"the way (?:it|they) (?:broke|breaks?)": 1}
    )  # fmt: skip
    assert not found("in this way the joint told us nothing; a ruby; a stand; go one by one")
