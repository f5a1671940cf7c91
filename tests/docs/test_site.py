"""The site: it builds without a warning, loads nothing from elsewhere, and its search finds words of both languages."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.nightly]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run([ROOT / "scripts" / "docs", folder], capture_output=True, text=True, check=False)
    if not (ROOT / ".venv-docs").is_dir():
        pytest.skip(f"the packages of [docs] cannot be installed here: {done.stderr[-200:]}")
    assert done.returncode == 0, done.stderr
    return folder


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    """Scripts, styles, pictures, fonts; links that a reader clicks may lead out."""
    loaded = re.compile(
        r"""(?:<(?:script|img|iframe|source|link)\b[^>]*(?:src|href)=["']|url\(["']?|@import ["'])(?:https?:)?//"""
    )
    for path in [*site.glob("**/*.html"), *site.glob("**/*.css")]:
        assert not loaded.search(path.read_text(encoding="utf-8")), path
    assert (site / "index.html").is_file() and (site / "docs" / "index.zh.html").is_file()


def test_formulas_are_written_out(site: Path) -> None:
    text = (site / "docs" / "tutorials" / "cracked_specimen.html").read_text(encoding="utf-8")
    assert "<math" in text and "\\sigma" not in text


def test_chinese_pages_say_so_and_lead_to_their_twins(site: Path) -> None:
    text = (site / "docs" / "tutorials" / "water.zh.html").read_text(encoding="utf-8")
    assert '<html class="no-js" lang="zh-CN"' in text and 'href="water.html">English' in text
    assert 'href="water.zh.html">中文' in (site / "docs" / "tutorials" / "water.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("words", "page"), [("proppant", "PCDC commands"), ("断裂能", "十分钟"), ("推覆", "推覆构造")])
def test_search_without_a_server(site: Path, browser: Any, words: str, page: str) -> None:
    tab = browser.new_page()
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(f"file://{site}/search.html?q={words}")
    tab.wait_for_selector("#search-results li")
    tab.wait_for_timeout(1500)
    assert any(page in title for title in tab.locator("#search-results li a").all_inner_texts())
    assert all(url.startswith(("file:", "data:")) for url in asked)
    tab.close()
