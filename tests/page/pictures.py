"""The pictures of the page in docs/specimens_page.md: `python -m tests.page.pictures` draws them again.

test_pictures.py takes them again and compares."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from PIL import Image

from tests.browser import BROWSER_OPTIONS, executable
from tests.conftest import ROOT, end, popen
from tests.page.conftest import Page, Served, command_line

GRADING = ROOT / "examples" / "grading.txt"
FOLDER = ROOT / "docs" / "figures"
VALUES = {"number": 2000, "shape": "pentagon", "deviation": 12.0, "roundness": 0.4, "void_ratio": 0.4, "seed": 3}
PICTURES: dict[str, dict[str, Any]] = {
    "grade_page.jpg": {"color_scheme": "light", "locale": "en-US"},
    "grade_page_dark.jpg": {"color_scheme": "dark", "locale": "zh-CN"},
}
SIZE = {"width": 1440, "height": 1010}


def take(browser: Any, url: str, name: str) -> Image.Image:
    """One of PICTURES."""
    context = browser.new_context(viewport=SIZE, **PICTURES[name])
    page = Page(context.new_page(), url)
    if "dark" in name:
        page.change(lambda: page.tab.check("#shape-ellipse"))
        page.change(lambda: page.fill("#l_over_d-exact", 1.8))
    page.tab.mouse.move(5, 5)
    page.tab.evaluate("document.activeElement.blur()")
    picture = Image.open(io.BytesIO(page.tab.screenshot())).convert("RGB")
    context.close()
    return picture


def words() -> list[str]:
    """The command line that serves them."""
    return [*command_line(GRADING, **VALUES), "--serve", "--no-browser"]


def main(folder: Path = FOLDER) -> None:
    """Write all of PICTURES."""
    import sys

    from playwright.sync_api import sync_playwright

    served = Served(popen([sys.executable, *words()]))
    try:
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=executable(), args=BROWSER_OPTIONS)
            for name in PICTURES:
                take(browser, served.url, name).save(folder / name, quality=80)
            browser.close()
    finally:
        end(served.process)


if __name__ == "__main__":
    main()
