"""What the tests of the page share: a request, and the page served by the program."""

from __future__ import annotations

import base64
import copy
import io
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import BIN, end, popen, run, until

REQUEST: dict[str, Any] = {
    "number": 300,
    "slenderness": 2.0,
    "void_ratio": 0.5,
    "shape": "triangle",
    "l_over_d": 1.5,
    "deviation": 10.0,
    "roundness": 0.3,
    "seed": 1,
    "placement": "dense",
    "rows": [["3", "100"], ["2", "80"], ["1", "65"], ["0.5", "60"], ["0.3", "40"]],
}


@pytest.fixture
def wanted():
    """A request as the page sends it, with some values replaced."""

    def make(**values: Any) -> dict[str, Any]:
        return copy.deepcopy(REQUEST) | values

    return make


class Served:
    """`hpcdem grade FILE --serve` in the background."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.match(r"Page: (http://127\.0\.0\.1:\d+/[\w-]+/)$", line)
        if not found:
            end(process)
            pytest.fail(f"no address in {line!r}\n{process.stderr.read() if process.stderr else ''}", pytrace=False)
        self.url = found[1]

    @property
    def makers(self) -> list[int]:
        """Process ids of what it has started and is there."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(pid) for pid in children.read_text().split()]


@pytest.fixture(scope="session")
def grading_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The grading of REQUEST."""
    path = tmp_path_factory.mktemp("grading") / "grading.txt"
    path.write_text("# size [mm], finer [%]\n" + "".join(f"{d} {p}\n" for d, p in REQUEST["rows"]))
    return path


def command_line(grading: Path, **values: Any) -> list[str]:
    """`hpcdem grade FILE ...` for a request."""
    wanted = REQUEST | values
    words = ["hpcdem", "grade", str(grading)]
    for name, value in wanted.items():
        if name != "rows":
            words += [f"--{name.replace('_', '-')}", str(value)]
    return [str(BIN / words[0]), *words[1:]]


@pytest.fixture(scope="session")
def launch_once() -> Callable[..., str]:
    """Run a command to its end, which must be a good one; what it printed."""

    def launch(words: list[str], cwd: Path | None = None) -> str:
        done = run(words, cwd)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return launch


@pytest.fixture(scope="session")
def serve_page() -> Iterator[Callable[..., Served]]:
    """`serve_page(grading_file, number=...)`."""
    started: list[Served] = []

    def serve(grading: Path, *more: str, browser_opens: bool = False, **values: Any) -> Served:
        words = [sys.executable, *command_line(grading, **values), "--serve", *more]
        words += [] if browser_opens else ["--no-browser"]
        started.append(Served(popen(words)))
        return started[-1]

    yield serve
    for served in started:
        end(served.process)
        served.process.communicate()


@pytest.fixture(scope="session")
def served(serve_page: Callable[..., Served], grading_file: Path) -> Served:
    """One server for the tests that do not end it."""
    return serve_page(grading_file)


class Page:
    """The page in a tab, and what tests ask of it."""

    def __init__(self, tab: Any, url: str) -> None:
        self.tab, self.errors = tab, []
        self.asked: list[str] = []
        tab.on("pageerror", lambda error: self.errors.append(str(error)))
        tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        tab.on("request", lambda request: self.asked.append(request.url))
        tab.goto(url)
        self.wait(0)

    def until(self, holds: Callable[[], object], what: object = None) -> None:
        """Wait; the policy of the page forbids what Playwright would put in for that."""
        until(holds, what or (lambda: self.text("#error")), lambda seconds: self.tab.wait_for_timeout(1e3 * seconds))

    def wait(self, after: int) -> int:
        """Wait for a drawing later than number `after`; its number."""
        self.until(lambda: self.drawn() > after, lambda: f"a drawing after number {after}: {self.text('#error')}")
        self.rest()
        return self.drawn()

    def rest(self) -> None:
        """Wait until nothing is being computed."""
        self.tab.wait_for_selector("#packing[aria-busy=false]")
        self.tab.wait_for_timeout(60)

    def drawn(self) -> int:
        return int(self.tab.evaluate("document.documentElement.dataset.drawn || 0"))

    def change(self, action: Callable[[], Any]) -> int:
        """Do something and wait for the drawing that follows."""
        before = self.drawn()
        action()
        return self.wait(before)

    def text(self, selector: str) -> str:
        return self.tab.inner_text(selector)

    def fact(self, name: str) -> str:
        return self.text(f"[data-fact={name}] dd")

    def numbers(self, name: str) -> list[float]:
        """The numbers of a fact."""
        return [float(word) for word in re.findall(r"[\d.]+", self.fact(name).replace(",", ""))]

    def counts(self) -> list[str]:
        """Grains of each row of the table."""
        return self.tab.locator("#rows td.grains").all_inner_texts()

    def fill(self, selector: str, value: object) -> None:
        self.tab.fill(selector, str(value))

    def pixels(self) -> np.ndarray:
        """(h, w, 4) u1: what is on the canvas."""
        script = """() => {
            const c = document.querySelector('canvas');
            const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let text = '';
            for (let k = 0; k < d.length; k += 32768) text += String.fromCharCode(...d.subarray(k, k + 32768));
            return [c.width, c.height, btoa(text)]; }"""
        w, h, data = self.tab.evaluate(script)
        return np.frombuffer(base64.b64decode(data), np.uint8).reshape(h, w, 4)

    def screenshot(self, **options: Any) -> np.ndarray:
        """(h, w, 3) u1"""
        from PIL import Image

        return np.asarray(Image.open(io.BytesIO(self.tab.screenshot(**options))).convert("RGB"))


@pytest.fixture
def open_page(browser: Any, served: Served) -> Iterator[Callable[..., Page]]:
    """`open_page(color_scheme="dark", locale="zh-CN", width=...)`: the page in a tab of its own."""
    contexts = []

    def open_(width: int = 1440, height: int = 900, url: str = served.url, **options: Any) -> Page:
        options = {"locale": "en-US", "color_scheme": "light", "accept_downloads": True} | options
        contexts.append(browser.new_context(viewport={"width": width, "height": height}, **options))
        return Page(contexts[-1].new_page(), url)

    yield open_
    for context in contexts:
        context.close()
