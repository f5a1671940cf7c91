"""Links, figures, blocks and generated pages of the documentation; nothing is run."""

from __future__ import annotations

import ast
import re
import runpy
import shlex
import subprocess
import tomllib
from itertools import pairwise
from pathlib import Path

import click
import pytest

from hpcdem.core.chinese import known
from hpcdem.lang.pcdc.table import PCDC
from hpcdem.lang.zdem.table import ZDEM
from scripts.lib.pages import chinese
from scripts.lib.pages.__main__ import PAGES as MADE
from scripts.lib.pages.options import PROGRAMS
from tests import catalogue
from tests.docs.pages import DOCS, PAGES, ROOT, anchors, blocks, links, prose, without_blocks
from tests.tables import each

NAVIGATION = runpy.run_path(str(DOCS / "site" / "navigation.py"))["NAVIGATION"]
IDS = [str(page.relative_to(ROOT)) for page in PAGES]


@each("page", PAGES, ids=IDS)
def test_links_lead_somewhere(page: Path) -> None:
    for link in links(page):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target.resolve()), f"{link}: {sorted(anchors(target.resolve()))}"


@each("page", [*PAGES, ROOT / "CHANGELOG.md"], ids=[*IDS, "CHANGELOG.md"])
def test_headings_leave_no_level_out(page: Path) -> None:
    """The site refuses a page that does."""
    levels = [len(head) for head in re.findall(r"^(#+) ", without_blocks(page), re.MULTILINE)]
    assert levels[0] == 1 and all(after <= before + 1 for before, after in pairwise(levels))


@each("page", PAGES, ids=IDS)
def test_tests_that_pages_name_are_there(page: Path) -> None:
    """`tests/FILE.py::NAME`, and files and folders of tests by themselves."""
    for file, name in re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", page.read_text(encoding="utf-8")):
        assert (ROOT / file).is_file(), file
        assert not name or f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), f"{file}::{name}"


def test_every_figure_is_on_a_page() -> None:
    used = {Path(link).name for page in PAGES for link in links(page)}
    assert not {path.name for path in (DOCS / "figures").iterdir()} - used


def test_every_page_has_its_place() -> None:
    placed = [page for pages in NAVIGATION.values() for page in pages]
    assert len(placed) == len(set(placed))
    there = {str(page.relative_to(ROOT)).removesuffix(".md") for page in DOCS.glob("**/*.md")} - {"docs/index"}
    outside = {"ARCHITECTURE", "CONTRIBUTING", "CHANGELOG"}
    assert set(placed) == there | outside


@each("page", PAGES, ids=IDS)
def test_python_of_the_pages_is_python(page: Path) -> None:
    """Lines of PCDC in it are left out here."""
    for block in blocks(page):
        if block.language != "python" or "python_reference" in page.name:
            continue
        text = re.sub(r"^( *)pcdc (?:.*\\\n)*.*$", r"\1pass", block.text, flags=re.MULTILINE)
        if re.match(r'"\w+": ', text):  # a row of a table
            text = f"{{{text}}}"
        ast.parse(text.replace(", ...}", "}"))


COMMANDS = PROGRAMS
_GAPS = re.compile(r"\.\.\.|…|[<>|]|[^\x00-\x7f]|\[OPTIONS\]")


def command_lines(page: Path) -> list[str]:
    """Lines of programs of ours in the blocks of a page that are complete."""
    lines = []
    for block in blocks(page):
        if block.language in ("", "bash", "sh") and block.mark != "file":
            lines += [line.strip() for line in block.text.splitlines()]
    starts = re.compile(r"^(?:(?:mpiexec|srun)(?: -\w+ \S+)* )?(hpcdem|zdem2jpg|zdemss|zdem) ")
    found = [re.sub(r"^(?:mpiexec|srun)(?: -\w+ \S+)* ", "", line) for line in lines if starts.match(line)]
    return [line for line in (re.sub(r"\s#.*", "", line) for line in found) if not _GAPS.search(line)]


@each("page", PAGES, ids=IDS)
def test_command_lines_of_the_pages_can_be_read(page: Path) -> None:
    """By the parsers of the programs: every option is one that they have, and takes such a value."""
    for line in command_lines(page):
        program, *words = shlex.split(line)
        if re.match(r"\d+\.\d+", words[0]) or words[0].endswith(":"):
            continue  # the first line of a log
        program = "hpcdem" if program == "zdem" else program
        name = f"{program} {words[0]}"
        if words[:2] == ["sweep", "report"]:
            name, words = "hpcdem sweep report", words[2:]
        elif "-s" in words and program == "hpcdem":
            name = "hpcdem -s"
        elif name in COMMANDS:
            words = words[1:]
        else:
            name = program
        if name == "hpcdem case" and words:
            continue  # parameters of cases: tests/unit/test_cases.py
        try:
            COMMANDS[name].make_context(name, [*words])
        except click.exceptions.Exit as done:
            assert done.exit_code == 0, line
        except click.ClickException as error:
            pytest.fail(f"{line}: {error.format_message()}")


@pytest.mark.parametrize("name", MADE)
def test_generated_pages_are_current(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == MADE[name](), "renew it: ./scripts/pages"


def test_commands_have_their_line_in_chinese() -> None:
    """Of commands that are there; a new one may wait for its line, and is told in English on the page."""
    models = {model.keyword.name for command in PCDC.commands for model in command.models}
    assert set(catalogue.of("zdem command")) == {command.name for command in ZDEM.commands}
    options = {o.doc for c in ZDEM.commands for o in (*c.leading, *c.options)} | {o.doc for o in ZDEM.range_terms}
    shown = [*PCDC.range_terms]
    for command in PCDC.commands:
        shown += [*command.leading, *command.options, *(option for model in command.models for option in model.options)]
    shown += [inner for option in shown for inner in option.more]
    expected = {
        "pcdc command": {command.name for command in PCDC.commands}, "pcdc model": models, "zdem keyword": options,
        "pcdc keyword": {option.doc for option in shown},
    }  # fmt: skip
    for context, there in expected.items():
        texts = catalogue.of(context)
        assert set(texts) <= there and len(texts) >= 0.9 * len(there), context
        assert all(re.search("[\u4e00-\u9fff]", text) for text in texts.values())
    assert set(catalogue.of("pcdc default")) <= {option.default for option in shown}


def test_a_meaning_that_nobody_wrote_in_chinese_is_reported_in_english(monkeypatch: pytest.MonkeyPatch) -> None:
    english = "tensile strength; 0: none"
    assert english not in chinese.pcdc_page()
    monkeypatch.setattr(chinese, "known", lambda *of: None if of[1] == english else known(*of))
    assert chinese.pcdc_page().count(english) == 2  # of joints, by c-model and property


def test_pages_of_both_languages_say_the_same_code() -> None:
    """Tutorials: the same blocks."""
    english = sorted(p for p in (DOCS / "tutorials").glob("*.md") if not p.name.endswith(".zh.md"))
    assert len(english) == 6
    for page in english:
        twin = page.with_suffix("").with_suffix(".zh.md")
        ours, theirs = blocks(page), blocks(twin)
        assert [b.mark for b in ours] == [b.mark for b in theirs]
        for one, other in zip(ours, theirs):
            if one.mark:
                assert one == other
        assert re.search("[\u4e00-\u9fff]", prose(twin))


def test_needs_of_the_site_are_words_of_a_shell() -> None:
    """scripts/docs hands them to pip one by one."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needs = project["optional-dependencies"]["docs"]
    assert needs and not [need for need in needs if re.search(r"[\s;]", need)]
    shown = subprocess.run([ROOT / "scripts" / "docs", "--help"], capture_output=True, text=True, check=True)
    assert "build/docs" in shown.stdout
