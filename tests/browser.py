"""A browser without windows, for tests of pages: one in a process of pytest, as playwright starts only once."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from tests.conftest import PATIENCE, absent

# Root in a container has no sandbox, and the page under test is ours; a canvas that is read often changes over from the
# graphics card to the processor, which rounds differently.
BROWSER_OPTIONS = ["--no-sandbox", "--force-color-profile=srgb", "--disable-accelerated-2d-canvas"]
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def executable() -> str | None:
    """A browser of the Chromium family on this machine; HPCDEM_TEST_BROWSER names another."""
    named = os.environ.get("HPCDEM_TEST_BROWSER")
    return named or next(filter(None, map(shutil.which, BROWSERS)), None)


class Patient:
    """A browser whose tabs wait as long as all tests do."""

    def __init__(self, browser: Any) -> None:
        self._browser = browser

    def new_context(self, **options: Any) -> Any:
        context = self._browser.new_context(**options)
        context.set_default_timeout(1e3 * PATIENCE)
        return context

    def new_page(self, **options: Any) -> Any:
        page = self._browser.new_page(**options)
        page.set_default_timeout(1e3 * PATIENCE)
        return page


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless browser, or the reason to skip."""
    try:
        from playwright import sync_api
    except ImportError:
        absent("browser", "no playwright here: pip install playwright")
    program = executable()
    if program is None:
        absent("browser", f"no browser here: apt-get install {BROWSERS[0]}, or set HPCDEM_TEST_BROWSER")
    with sync_api.sync_playwright() as play:
        found = play.chromium.launch(executable_path=program, args=BROWSER_OPTIONS)
        yield Patient(found)
        found.close()
