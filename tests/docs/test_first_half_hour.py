"""A stranger's first half hour: the commands of README, mistakes that are made, Ctrl-C and going on in a real terminal,
the window in a browser, a notebook. What is on the screen is looked at, not what the program believes it printed."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import BIN, PATIENCE, absent, until
from tests.docs.pages import ROOT
from tests.page.viewing import Tab, Viewing
from tests.short_push import SHORT_PUSH

WIDTH, HEIGHT = 110, 34
LONG, SHORT = SHORT_PUSH.format(steps=200000), SHORT_PUSH.format(steps=300)
ENVIRONMENT = os.environ | {
    "PYTHONPATH": str(ROOT), "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}", "LANG": "C.UTF-8", "HPCDEM_LANG": "en",
    "OMP_NUM_THREADS": "1",
}  # fmt: skip
FAILURES = ("Traceback", "Error:", "nan", "None", "object at 0x")
"""What a newcomer should not read, where nothing of that kind was asked for."""


class Terminal:
    """A shell in a terminal of tmux, and what stands on its screen."""

    def __init__(self, folder: Path) -> None:
        self.socket, self.count = folder / "tmux", 0
        start = shlex.join(["env", f"PATH={ENVIRONMENT['PATH']}", "PS1=$ ", "bash", "--norc", "-i"])
        self("new-session", "-d", "-s", "w", "-x", str(WIDTH), "-y", str(HEIGHT), "-c", str(folder), start)
        until(lambda: "$" in self.screen(), "a prompt")

    def __call__(self, *words: str) -> str:
        command = ["tmux", "-S", str(self.socket), "-f", "/dev/null", *words]
        done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE, check=True)
        return done.stdout

    def screen(self) -> str:
        """Its rows, without empty ones at the end."""
        return self("capture-pane", "-p", "-t", "w").rstrip("\n")

    def scrolled(self) -> str:
        """The same with the rows that have left it at the top."""
        return self("capture-pane", "-p", "-S", "-2000", "-t", "w").rstrip("\n")

    def keys(self, *keys: str) -> None:
        self("send-keys", "-t", "w", *keys)

    def types(self, line: str) -> None:
        """A command on an empty screen."""
        self.count += 1
        self.keys(f"clear; {line}; echo DONE{self.count}=$?", "Enter")

    def waits(self, words: str, scrolled: bool = False, search: Any = None) -> str:
        """The screen once it shows these words, or has shown them."""
        seen = [""]

        def there() -> object:
            seen[0] = self.scrolled() if scrolled else self.screen()
            return (search or shown)(words, seen[0])

        until(there, lambda: f"{words!r} on\n{seen[0]}")
        return seen[0]

    def end(self, code: int = 0) -> str:
        """The screen after the command."""
        return self.waits(rf"(?m)^DONE{self.count}={code}$", search=re.search)


def shown(words: str, screen: str) -> object:
    """Whether these words (an expression) stand on a screen, on which lines are broken between words, and in long names
    of files anywhere."""
    return re.search(words.replace(" ", ""), re.sub(r"\s", "", screen), re.DOTALL)


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    if shutil.which("tmux") is None:
        absent("terminal", "no tmux here: apt-get install tmux")
    one = Terminal(tmp_path)
    yield one
    one("kill-server")


def test_the_first_commands_in_a_terminal(terminal: Terminal, tmp_path: Path) -> None:
    """Nothing scrolls away, mistakes are met with what was meant, a run that is stopped goes on to its end."""
    (tmp_path / "push.py").write_text(LONG)
    terminal.types("hpcdem")
    said = terminal.end(2)
    assert said.startswith("hpcdem: discrete elements") and "hpcdem view data" in said and "hpcdem examples" in said
    terminal.types("hpcdem psh.py")
    assert "psh.py: no such script; did you mean 'push.py'?" in terminal.end(2)
    terminal.types("hpcdem viw data")
    assert "did you mean hpcdem view?" in terminal.end(2)
    terminal.types("hpcdem push.py")
    terminal.waits(r"script .*\d+/200400")  # the bar
    terminal.waits("unbalanced force .* of the mean")
    terminal.keys("C-c")
    said = terminal.end(85)
    assert shown(r"stopped at step \d+ by Ctrl-C; checkpoint .*\.sav written, resume with --resume", said), said
    script = (tmp_path / "push.py").read_text()
    assert script == LONG
    terminal.types("hpcdem push.py --resume")
    terminal.waits(r"resuming from .*\.sav, step \d+", scrolled=True)
    said = terminal.waits(r"steps, \d+ left")
    terminal.keys("C-c")
    terminal.end(85)
    terminal.types("hpcdem data")
    assert "data is a folder: hpcdem view data shows its results" in terminal.end(2)


@pytest.mark.slow
def test_the_end_of_a_run_says_what_comes_next(terminal: Terminal, tmp_path: Path) -> None:
    (tmp_path / "push.py").write_text(SHORT)
    terminal.types("hpcdem push.py --outdir out")
    said = terminal.end()
    assert re.search(r"figure: out/all_0000000700\.jpg", said), said
    assert "results: out; `hpcdem view out` shows them" in " ".join(said.split()), said
    rows = said.splitlines()
    assert not any(len(row) >= WIDTH for row in rows), "lines are broken between words, not by the terminal"
    assert not any(word in said for word in FAILURES), said
    assert "━" not in said.partition("results")[2], "the bar has gone"


SCRIPT = """\
pcdc model new
pcdc mesh structured (0,0) (1,1) cells 2 2
pcdc element c-model mech-iso-e property density 2700 young 30e9 poisson-ratio 0.25
pcdc model step 3
"""


@pytest.mark.parametrize(
    ("change", "words", "code", "said"),
    [
        ({}, "u.sc --resum", 2, "Did you mean '--resume'?"),
        ({}, "nowhere.sc", 2, "nowhere.sc: no such script; hpcdem examples lists the examples"),
        ({}, "draw nowhere --field stress_yy", 1, "folder or file not found: nowhere"),
        ({"model step": "model stpe"}, "u.sc", 2, r"u\.sc:4: .*did you mean 'step'"),
        ({"30e9": "30 GPa"}, "u.sc", 2, r"u\.sc:3: .*GPa"),
        ({"young 30e9": "young -30e9"}, "--check u.sc", 2, r"u\.sc:3: .*expected a number above 0"),
        pytest.param({"model new": "model new\npcdc model units SI", "30e9": "30"}, "u.sc --no-figure", 0,
                     "young 30 Pa is an unlikely modulus: looks like GPa", marks=pytest.mark.slow),
        ({"mesh structured (0,0) (1,1) cells 2 2": "mesh import 'rock.msh'"}, "u.sc", 2, r"u\.sc:2: .*rock\.msh"),
    ],
)  # fmt: skip
def test_mistakes_are_met_with_a_sentence(tmp_path: Path, change: dict[str, str], words: str, code: int, said: str):
    text = SCRIPT
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "u.sc").write_text(text)
    command = [sys.executable, "-m", "hpcdem", *words.split()]
    done = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    whole = done.stdout + done.stderr
    assert done.returncode == code and re.search(said, whole), whole
    assert "Traceback" not in whole and "Input should" not in whole, whole


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a run of the short script leaves."""
    folder = tmp_path_factory.mktemp("first")
    (folder / "push.py").write_text(SHORT)
    command = [sys.executable, "-m", "hpcdem", "push.py"]
    done = subprocess.run(
        command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "data"


@pytest.fixture(scope="module")
def viewing(results: Path) -> Iterator[Viewing]:
    one = Viewing(results)
    yield one
    one.close()


def looked_at(browser: Any, viewing: Viewing, size: tuple[int, int], theme: str, language: str) -> None:
    tab = Tab(browser, viewing.url, locale=language, color_scheme=theme)
    try:
        tab.tab.set_viewport_size({"width": size[0], "height": size[1]})
        tab.rest()
        assert not re.search(r"\b(undefined|NaN|\[object)\b", tab.text("body")), tab.text("body")
        wider = tab.tab.evaluate("document.scrollingElement.scrollWidth - innerWidth")
        assert wider <= 0, f"{wider} px wider than the window"
        assert len({tuple(colour) for colour in tab.pixels()[::7, ::7].reshape(-1, 3).tolist()}) > 3, "an empty stage"
        assert tab.errors == []
    finally:
        tab.context.close()


def test_the_window_shows_what_the_run_left(browser: Any, viewing: Viewing) -> None:
    looked_at(browser, viewing, (1280, 720), "light", "en-GB")


@pytest.mark.slow
@pytest.mark.parametrize("language", ["en-GB", "zh-CN"])
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1920, 1080), (1280, 720), (900, 700), (390, 800)], ids=lambda size: str(size[0]))
def test_the_window_at_every_width(
    browser: Any, viewing: Viewing, size: tuple[int, int], theme: str, language: str
) -> None:
    looked_at(browser, viewing, size, theme, language)


CELLS = (
    "import hpcdem\nsim = hpcdem.Simulation()\nsim.box(0.0, 10.0, 0.0, 10.0, kn=1e7, ks=1e7)",
    "sim.gen(20, rad=[0.4, 0.5], x=(0.0, 10.0), y=(0.0, 10.0), colour='red')\n"
    "sim.particles.properties(density=2500.0, kn=1e7, ks=1e7, damp=0.3)\nsim.set(gravity=(0.0, -9.8), dt=1e-3)",
    "try:\n    sim.cycel(10)\nexcept AttributeError as error:\n    print(error)",
    "try:\n    sim['vxx']\nexcept KeyError as error:\n    print(error)",
    "sim.cycle(50)",
    "sim",
)


@pytest.mark.slow
def test_a_notebook(tmp_path: Path) -> None:
    """Cells as a newcomer types them; the last shows the model."""
    for name in ("nbclient", "ipykernel", "nbformat"):
        pytest.importorskip(name, reason="the extras [notebook] and [dev]")
    import nbformat
    from nbclient import NotebookClient

    kernel = tmp_path / "kernels" / "python3"
    kernel.mkdir(parents=True)
    (kernel / "kernel.json").write_text(
        f'{{"argv": ["{sys.executable}", "-m", "ipykernel_launcher", "-f", "{{connection_file}}"], '
        '"display_name": "Python 3", "language": "python"}'
    )
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
    client = NotebookClient(
        book, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    )
    client.execute(env=ENVIRONMENT | {"JUPYTER_PATH": str(tmp_path)})
    said = ["".join(o.get("text", "") for o in cell.outputs) for cell in book.cells]
    assert "has no attribute 'cycel'. Did you mean: 'cycle'?" in said[2] or "'cycel'" in said[2], said
    assert "there is no field 'vxx'; did you mean 'vx'?" in said[3]
    assert "image/png" in str(book.cells[-1].outputs[-1]["data"]) or "image/png" in book.cells[-1].outputs[-1]["data"]
