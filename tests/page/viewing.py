"""`hpcdem view` in the background, and its page in a browser."""

from __future__ import annotations

import base64
import io
import json
import re
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import BIN, PATIENCE, end, popen, until


class Viewing:
    """`hpcdem view PATHS` in the background."""

    def __init__(self, *words: object) -> None:
        self.process = popen([sys.executable, str(BIN / "hpcdem"), "view", "--no-browser", *map(str, words)])
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.match(r"Page: (http://127\.0\.0\.1:\d+/[\w-]+/)$", line)
        if not found:
            end(self.process)
            pytest.fail(f"no address in {line!r}\n{self.process.stderr.read()}", pytrace=False)  # type: ignore[union-attr]
        self.url = found[1]

    def ask(self, name: str, content: dict[str, Any], **headers: str) -> Any:
        """The answer to a POST as JSON."""
        request = urllib.request.Request(
            self.url + name, json.dumps(content).encode(), {"Content-Type": "application/json", **headers}
        )
        with urllib.request.urlopen(request, timeout=PATIENCE) as response:
            return json.load(response)

    def close(self) -> None:
        end(self.process)


class Tab:
    """The page in a browser."""

    def __init__(self, browser: Any, url: str, **options: Any) -> None:
        self.context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}} | options)
        self.tab = self.context.new_page()
        self.errors: list[str] = []
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        # What the server refuses is told on the page; the browser notes the number 422 besides.
        self.tab.on(
            "console",
            lambda said: self.errors.append(said.text) if said.type == "error" and "422" not in said.text else None,
        )
        self.tab.goto(url)
        self.rest()

    def rest(self) -> None:
        """Wait until the fine picture of what was asked for last is there."""
        self.tab.wait_for_selector("body[data-fine=true]")

    def until(self, holds: Callable[[], object]) -> None:
        """Wait; the policy of the page forbids what Playwright would put in for that."""
        until(holds, lambda: self.text("#message"), lambda seconds: self.tab.wait_for_timeout(1e3 * seconds))

    def after(self, action: Any) -> np.ndarray:
        """Do something; the picture when it rests again."""
        before = int(self.tab.locator("body").get_attribute("data-pictures"))
        action()
        self.tab.wait_for_selector(f"body:not([data-pictures='{before}'])")
        self.rest()
        return self.pixels()

    def pixels(self, number: int = 0) -> np.ndarray:
        """What a window shows, (h, w, 3)."""
        from PIL import Image

        url = self.tab.locator(".window canvas:first-child").nth(number).evaluate("canvas => canvas.toDataURL()")
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB"))

    def place(self, u: float, v: float) -> tuple[float, float]:
        """A place on the first window, as parts of its width and height."""
        box = self.tab.locator("#windows canvas").first.bounding_box()
        return box["x"] + u * box["width"], box["y"] + v * box["height"]

    def text(self, selector: str) -> str:
        return self.tab.locator(selector).inner_text()

    def saved(self, kind: str, folder: Path) -> Path:
        """A file of the menu."""
        with self.tab.expect_download() as waiting:
            self.tab.select_option("#save", kind)
        path = folder / waiting.value.suggested_filename
        waiting.value.save_as(path)
        return path
