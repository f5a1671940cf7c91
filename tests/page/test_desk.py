"""`hpcdem view --run`: commands that are typed on the page, and scripts that are edited, checked and run there."""

from __future__ import annotations

import os
import time
import urllib.error
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.page.desk import Desk, check, complete, whole
from tests.conftest import BIN, run, until
from tests.page.viewing import Tab, Viewing

SCRIPT = """\
pcdc mesh structured (0,0) (2,1) cells 2 1
pcdc element c-model mech-iso-e property density 2500 young 1e9 poisson-ratio 0.25
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.01 0.01
pcdc element-face boundary mech-stress-b-c stress-yy -1e6 range y 0.99 1.01
pcdc model step 60
pcdc output vtk 'own'
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scripts, and files that are none."""
    path = tmp_path_factory.mktemp("scripts")
    (path / "block.sc").write_text(SCRIPT)
    (path / "fall.py").write_text("START\nBOX left 0 right 100 bottom 0 height 100 kn 1e8 ks 1e8\n")
    (path / "notes.txt").write_text("no script")
    (path / ".hidden.py").write_text("START\n")
    return path


@pytest.fixture(scope="module")
def viewing(folder: Path) -> Iterator[Viewing]:
    one = Viewing("--run", folder / "block.sc")
    yield one
    one.close()


def until_ready(viewing: Viewing, since: int = 0) -> list[str]:
    """Wait until nothing is carried out; what was said after a line."""
    told: dict[str, Any] = {}

    def ready() -> bool:
        told.update(viewing.ask("console", {"since": since}))
        return not told["busy"]

    until(ready, "the console, which is still at work")
    return [text for text, kind in told["lines"] if kind != "asked"]


def talk(viewing: Viewing, text: str, **more: Any) -> list[str]:
    """Have something carried out; what was said."""
    until_ready(viewing)
    since = viewing.ask("console", {})["last"]
    viewing.ask("say", {"text": text, **more})
    return until_ready(viewing, since)


def refused(call: Callable[[], Any]) -> tuple[int, str]:
    with pytest.raises(urllib.error.HTTPError) as caught:
        call()
    return caught.value.code, caught.value.read().decode()


# ---- the console ----------------------------------------------------------------------------------------------------


def test_python_and_commands(viewing: Viewing):
    assert talk(viewing, "1 + 1", language="pcdc")[-1] == "2"  # kernels may be compiled before
    assert talk(viewing, "a = 3\nb = 4") == [] and talk(viewing, "a * b") == ["12"]
    assert talk(viewing, "pcdc modle new")[0].startswith("console 4:1: pcdc modle new: read 'modle'")
    assert "ZeroDivisionError" in talk(viewing, "1 / 0")[-1]
    assert talk(viewing, "a") == ["3"]


@pytest.mark.slow
def test_a_script_runs_as_it_does_by_itself(viewing: Viewing, folder: Path):
    """The same frame, and the present state beside it; errors name the line of the script."""
    talk(viewing, SCRIPT, name="block.sc")
    done = run(
        [str(BIN / "hpcdem"), str(folder / "block.sc"), "--outdir", str(folder / "alone"), "--no-figure"], folder
    )
    assert done.returncode == 0, done.stderr
    with (
        h5py.File(folder / "data/own_0000000060.vtkhdf") as one,
        h5py.File(folder / "alone/own_0000000060.vtkhdf") as two,
    ):
        assert np.array_equal(one["VTKHDF/Points"], two["VTKHDF/Points"])
    assert [path.name for path in (folder / "data/now").iterdir()] == ["now_0000000060.vtkhdf"]
    said = talk(viewing, "pcdc model step 40")
    assert "step 100" in said[-1]
    assert [path.name for path in (folder / "data/now").iterdir()] == ["now_0000000100.vtkhdf"]
    sources = {source["name"]: source["frames"] for source in viewing.ask("state", {})["sources"]}
    assert sources == {"data: own": [[60, False]], "now: now": [[100, False]]}
    said = talk(viewing, SCRIPT.replace("young", "yuong"), name="block.sc")
    assert said[0].startswith("block.sc:2: ")


def test_a_run_is_interrupted_and_the_model_stays(viewing: Viewing):
    talk(viewing, SCRIPT, name="block.sc")
    viewing.ask("say", {"text": "pcdc model step 100000000"})
    assert "busy" in refused(lambda: viewing.ask("say", {"text": "1"}))[1]
    time.sleep(1.0)
    viewing.ask("interrupt", {})
    said = until_ready(viewing)
    assert any("Ctrl-C" in line for line in said)
    before = int(talk(viewing, "pcdc.cycle")[-1])
    now = viewing.ask("state", {})["sources"][-1]["frames"]
    assert now == [[before, False]], "the picture is that of the model as it is"
    talk(viewing, "pcdc model step 7")
    assert int(talk(viewing, "pcdc.cycle")[-1]) == before + 7 > 60
    assert refused(lambda: viewing.ask("interrupt", {}))[0] == 422


@pytest.mark.slow
def test_zdem_line_by_line(viewing: Viewing, folder: Path):
    """A command at a time; a wrong line is told and does not count, a new model begins after STOP."""
    assert talk(viewing, "START", language="zdem")[:1] != ["2"]
    talk(viewing, "mu = 0.3\nSET disk on\nBOX left 0 right 100 bottom 0 height 100 kn=1e8 ks=1e8 fric 0.3")
    talk(viewing, "BALL id 1 rad 5 x 50 y 20\nPROP density 2500 kn 1e8 ks 1e8 fric {mu}\nSET DT 1e-3 gravity 0 -9.8")
    assert talk(viewing, "CYX 100") == ["console:8: read 'CYX' at column 1, expected a command; did you mean 'CYC'?"]
    assert talk(viewing, "CYC 100")[-1].startswith("step 100 |")
    assert [path.name for path in (folder / "data/now").iterdir()] == ["all_0000000100.vtkhdf"]
    talk(viewing, "STOP")
    assert "must be START" in talk(viewing, "CYC 1")[0]
    assert viewing.ask("console", {})["language"] == "zdem"
    assert talk(viewing, "7", language="pcdc")[-1] == "7", "the other language is another process"


@pytest.mark.slow
def test_it_can_be_started_anew(viewing: Viewing):
    talk(viewing, "x = 1", language="pcdc")
    viewing.ask("restart", {"language": "pcdc"})
    assert "NameError" in talk(viewing, "x")[-1]
    assert "exit code" in talk(viewing, "exit()")[-1]
    assert talk(viewing, "2")[-1] == "2", "the next command starts another process"


# ---- who may --------------------------------------------------------------------------------------------------------


@pytest.fixture
def without(tmp_path: Path) -> Iterator[Viewing]:
    from tests.view import frames

    frames.write_blocks(tmp_path, 0)
    one = Viewing(tmp_path)
    yield one
    one.close()


def test_nothing_runs_unless_it_was_asked_for(without: Viewing):
    for name in ("say", "write", "read", "console", "restart", "interrupt", "check", "complete", "scripts"):
        assert refused(lambda: without.ask(name, {"text": "1"}))[0] == 404, name  # noqa: B023


def test_other_origins_and_keys_are_refused(viewing: Viewing):
    assert refused(lambda: viewing.ask("say", {"text": "1"}, Origin="http://example.org"))[0] == 403
    viewing.url, url = viewing.url.replace("/", "/x", 3).replace("http:/x/x", "http://"), viewing.url
    try:
        assert refused(lambda: viewing.ask("say", {"text": "1"}))[0] == 403
    finally:
        viewing.url = url


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--run", "no.sc"], "--run no.sc: expected an existing script"),
        (["-j", "2", "."], "-j requires --run"),
        ([], "expected a folder or file with frames, or --run"),
    ],
)
def test_wrong_command_lines(tmp_path: Path, words: list[str], message: str):
    done = run([str(BIN / "hpcdem"), "view", "--no-browser", *words], tmp_path)
    assert message in done.stderr and done.returncode == 2


# ---- scripts --------------------------------------------------------------------------------------------------------


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    (tmp_path / "a.sc").write_text("pcdc model new\n")
    return Desk(tmp_path, tmp_path / "data")


def test_scripts_of_the_folder(viewing: Viewing):
    assert viewing.ask("scripts", {}) == {"names": ["block.sc", "fall.py"], "first": "block.sc"}


@pytest.mark.parametrize("name", ["../a.sc", "/etc/passwd", ".a.sc", "a.txt", "b/a.sc", "", None, 7, "a.sc\n"])
def test_names_that_are_none(desk: Desk, name: Any):
    with pytest.raises(HpcdemError, match="a script needs a name such as"):
        desk.read(name)
    with pytest.raises(HpcdemError, match="a script needs a name such as"):
        desk.write(name, "x", None)


def test_a_link_is_not_followed(desk: Desk, tmp_path: Path):
    (tmp_path / "outside").write_text("secret")
    (tmp_path / "link.sc").symlink_to(tmp_path / "outside")
    for call in (lambda: desk.read("link.sc"), lambda: desk.write("link.sc", "x", None)):
        with pytest.raises(HpcdemError, match="not a regular file"):
            call()
    assert (tmp_path / "outside").read_text() == "secret"


def test_saving(desk: Desk, tmp_path: Path):
    """What others have written meanwhile is not lost; the file keeps who may read it."""
    os.chmod(tmp_path / "a.sc", 0o640)
    found = desk.read("a.sc")
    saved = desk.write("a.sc", found["text"] + "# ü\n", found["stamp"])
    assert (tmp_path / "a.sc").read_text() == "pcdc model new\n# ü\n"
    assert (tmp_path / "a.sc").stat().st_mode & 0o777 == 0o640
    with pytest.raises(HpcdemError, match="changed by another program"):
        desk.write("a.sc", "x", found["stamp"])
    with pytest.raises(HpcdemError, match="changed by another program"):
        desk.write("a.sc", "x", None)
    desk.write("a.sc", "", saved["stamp"])
    desk.write("new.py", "START\n", None)
    assert desk.names() == ["a.sc", "new.py"] and (tmp_path / "a.sc").read_text() == ""
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("text", "name", "language", "line", "words"),
    [
        (SCRIPT, "a.sc", "pcdc", None, "6 commands read"),
        (SCRIPT.replace("cells", "cels"), "a.sc", "pcdc", 1, "read 'cels'"),
        ("pcdc model new\nfor\n", "a.sc", "pcdc", 2, "not correct Python"),
        ("START\nBOX left 0 right 1 bottom 0 height 1\nCYX 5\n", "a.py", "zdem", 3, "did you mean 'CYC'"),
        ("import hpcdem\n", "a.py", "python", None, ""),
        ("hello\n", "a.py", None, 1, "is not the beginning of a script"),
    ],
)
def test_checks(text: str, name: str, language: str | None, line: int | None, words: str):
    told = check(text, name)
    assert (told["language"], told["line"]) == (language, line)
    assert words in (told["problem"] if line else told["summary"])


def test_a_script_is_renamed(desk: Desk, tmp_path: Path):
    """The old file is gone; a name that is taken, and a file that others have changed, are refused."""
    found = desk.read("a.sc")
    (tmp_path / "b.sc").write_text("other")
    for name, stamp, said in (
        ("b.sc", found["stamp"], r"script b\.sc exists"),
        ("c.sc", "0 0", "changed by another program"),
        ("../c.sc", found["stamp"], "a script needs a name such as"),
    ):
        with pytest.raises(HpcdemError, match=said):
            desk.rename("a.sc", name, stamp)
    told = desk.rename("a.sc", "c.sc", found["stamp"])
    assert desk.names() == ["b.sc", "c.sc"] and (tmp_path / "b.sc").read_text() == "other"
    desk.write("c.sc", "pcdc model new\n# more\n", told["stamp"])
    with pytest.raises(HpcdemError, match=r"cannot rename a\.sc"):
        desk.rename("a.sc", "d.sc", None)


@pytest.mark.parametrize(
    ("text", "language", "ends"),
    [
        ("1 + 1", "pcdc", True), ("for i in range(3):", "pcdc", False),
        ("for i in range(3):\n    print(i)", "pcdc", False),
        ("for i in range(3):\n    print(i)\n    ", "pcdc", True), ("f(1,", "pcdc", False), ("f(1,\n2)", "pcdc", True),
        ("pcdc model new", "pcdc", True), ("pcdc model step \\", "pcdc", False),
        ("if a:\n    pcdc model new", "pcdc", False), ("for i in", "pcdc", True),
        ("a = 1\nb = 2", "pcdc", True), ("BALL id 1", "zdem", True),
    ],
)  # fmt: skip
def test_what_continues_in_another_line(text: str, language: str, ends: bool):
    assert whole(text, language) == ends


@pytest.mark.parametrize(
    ("line", "language", "words", "last"),
    [
        ("pcdc mod", "pcdc", ["model"], 3),
        ("pc", "pcdc", ["pcdc"], 2),
        ("x = 1", "pcdc", [], 1),
        ("CY", "zdem", ["CYC"], 2),
        ("FREE ", "zdem", ["x", "y", "spin", "RANGE"], 0),
        ("DEL RANGE gr", "zdem", ["group"], 2),
    ],
)
def test_completion(line: str, language: str, words: list[str], last: int):
    told = complete(line, language)
    assert told["last"] == last and told["words"][: len(words)] == words and bool(told["words"]) == bool(words)


# ---- in a browser ---------------------------------------------------------------------------------------------------


class Bench:
    """The page, as a user sees it."""

    def __init__(self, browser: Any, viewing: Viewing) -> None:
        self.context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-GB")
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(viewing.url)
        self.page.wait_for_selector("#desk-toggle:not([hidden])")

    def wait(self, state: str = "ready") -> None:
        self.page.wait_for_selector(f"body[data-desk={state}]")

    def type(self, line: str) -> None:
        self.wait()
        self.page.fill("#input", line)
        self.page.press("#input", "Enter")

    def until(self, holds: Callable[[], bool]) -> None:
        """Wait; the policy of the page forbids what Playwright would put in for that."""
        until(
            holds,
            lambda: f"{self.page.inner_text('#output')}\n{self.page.inner_text('#message')}",
            lambda seconds: self.page.wait_for_timeout(1e3 * seconds),
        )

    def says(self, text: str) -> None:
        self.until(lambda: text in self.page.inner_text("#output"))

    def at(self, step: int) -> None:
        """Wait until the picture is that of a step."""
        self.until(lambda: self.page.inner_text("#moment").startswith(f"step {step},"))


@pytest.fixture
def bench(browser: Any, viewing: Viewing) -> Iterator[Bench]:
    viewing.ask("restart", {"language": "pcdc"})
    until_ready(viewing)
    one = Bench(browser, viewing)
    yield one
    one.context.close()
    assert one.errors == []


def test_a_session_at_the_page(bench: Bench, folder: Path):
    """A script is changed, found wrong, mended, run, and gone on with; the picture is that of the model as it is."""
    page = bench.page
    page.click("#tab-editor")
    bench.until(lambda: page.input_value("#text").startswith("pcdc mesh"))
    page.fill("#text", SCRIPT.replace("young", "yuong"))
    page.click("#script-check")
    page.wait_for_selector("body[data-wrong='2']")
    assert "read 'yuong'" in page.inner_text("#check-result")
    assert page.inner_text("#numbers-of-lines .bad") == "2"
    page.click("#more-toggle")
    page.fill("#find", "yuong")
    page.fill("#replace", "young")
    page.click("#replace-all")
    page.click("#script-run")
    bench.says("> run block.sc")
    bench.wait()
    assert (folder / "block.sc").read_text() == SCRIPT
    bench.at(60)
    assert page.locator(".window").count() == 1
    page.click("#tab-console")
    before = page.locator("#windows canvas").first.evaluate("canvas => canvas.toDataURL()")
    page.fill("#input", "pcdc mod")
    page.press("#input", "Tab")
    bench.until(lambda: page.input_value("#input") == "pcdc model ")
    page.keyboard.type("step 20")
    page.keyboard.press("Enter")
    bench.at(80)
    bench.until(lambda: page.locator("#windows canvas").first.evaluate("canvas => canvas.toDataURL()") != before)
    bench.wait()
    page.press("#input", "ArrowUp")
    assert page.input_value("#input") == "pcdc model step 20"
    page.click("#clear")
    assert page.inner_text("#output") == ""


def test_comments_and_selected_lines(bench: Bench):
    page = bench.page
    page.click("#tab-editor")
    page.click("#script-new")
    page.fill("#text", "a = 20\nb = 3\na + b\n")
    page.evaluate("document.getElementById('text').setSelectionRange(0, 12)")
    page.press("#text", "Control+Enter")
    page.evaluate("document.getElementById('text').setSelectionRange(14, 14)")
    bench.wait()
    page.press("#text", "Control+Enter")
    bench.until(lambda: page.text_content("#output > :last-child") == "23")
    page.evaluate("document.getElementById('text').setSelectionRange(0, 12)")
    page.press("#text", "Control+/")
    assert page.input_value("#text") == "# a = 20\n# b = 3\na + b\n"
    page.press("#text", "Control+/")
    assert page.input_value("#text") == "a = 20\nb = 3\na + b\n"
    page.evaluate("document.getElementById('text').setSelectionRange(0, 12)")
    page.click("#more-toggle")
    for _ in range(2):  # unlike the key, a button does one of both
        page.click("#comment-on")
    assert page.input_value("#text") == "# # a = 20\n# # b = 3\na + b\n"
    page.press("#text", "Control+z")
    assert page.input_value("#text") == "# a = 20\n# b = 3\na + b\n", "undone as what is typed"
    page.evaluate("document.getElementById('text').setSelectionRange(0, 16)")
    page.click("#comment-out")
    assert page.input_value("#text") == "a = 20\nb = 3\na + b\n"


def test_blocks_of_python_are_typed_as_at_its_prompt(bench: Bench):
    """Enter goes on with a block, indented, until an empty line; lines that were pasted are carried out together;
    arrows stay within several lines."""
    page = bench.page
    page.click("#tab-console")
    bench.wait()
    page.focus("#input")
    for line in ("for i in range(3):", "if i != 1:"):
        page.keyboard.type(line)
        page.keyboard.press("Enter")
        bench.until(lambda: page.input_value("#input").endswith(f"{line}\n{'    ' if line[0] == 'f' else '        '}"))  # noqa: B023
    page.keyboard.type("print('item', 10 * i)")
    page.keyboard.press("ArrowUp")
    assert page.input_value("#input").startswith("for i in"), "a line farther up, not what was typed before"
    page.keyboard.press("ArrowDown")
    page.keyboard.press("End")
    for _ in range(2):
        page.keyboard.press("Enter")
    bench.says("item 20")
    assert "item 10" not in page.inner_text("#output") and page.input_value("#input") == ""
    bench.wait()
    page.keyboard.press("ArrowUp")
    assert page.input_value("#input").count("\n") == 3
    page.fill("#input", "a = 5")
    page.keyboard.press("Shift+Enter")
    page.keyboard.type("print('sum', a + 1)")
    page.keyboard.press("Enter")
    bench.says("sum 6")


def test_a_tab_that_was_chosen_stays(browser: Any, viewing: Viewing):
    """A script that comes late is shown to who has chosen nothing yet."""
    context = browser.new_context()
    page = context.new_page()
    waiting: list[Any] = []
    page.route("**/scripts", lambda route: waiting.append(route), times=1)
    page.goto(viewing.url)
    page.click("#tab-console")
    until(lambda: waiting, pause=lambda seconds: page.wait_for_timeout(1e3 * seconds))
    waiting[0].continue_()
    page.wait_for_selector("body[data-desk]")
    assert page.is_visible("#input") and page.evaluate("document.activeElement.id") == "input"
    context.close()


def test_who_types_faster_than_the_server_answers_loses_nothing(bench: Bench):
    """The next line is there at once, and takes what is typed and entered before the first one is judged."""
    page = bench.page
    page.click("#tab-console")
    bench.wait()
    waiting: list[Any] = []
    page.route("**/whole", lambda route: waiting.append(route))
    page.focus("#input")
    page.keyboard.type("for i in range(3):\nprint('item', 10 * i)\n\nb = 7")
    assert page.input_value("#input") == "for i in range(3):\n    print('item', 10 * i)\n    \n    b = 7"
    for k in range(3):
        bench.until(lambda: len(waiting) > k)  # noqa: B023
        waiting[k].continue_()
    bench.says("item 20")
    bench.wait()
    assert page.input_value("#input") == "b = 7", "what was typed ahead"
    assert [route.request.post_data_json["text"].count("\n") for route in waiting] == [0, 1, 2]
    page.unroute("**/whole")
    page.keyboard.type("; print('next', b + 1)\n")
    bench.says("next 8")


def test_a_late_completion_touches_nothing(bench: Bench):
    """The answer to a line that has changed meanwhile is dropped, in the console and in a script."""
    page = bench.page
    bench.wait()

    def slow(route: Any) -> None:
        waiting.append(route)

    for tab, field in (("#tab-console", "#input"), ("#tab-editor", "#text")):
        waiting: list[Any] = []
        page.click(tab)
        if field == "#text":
            page.click("#script-new")
        page.route("**/complete", slow)
        page.fill(field, "pcdc mod")
        page.press(field, "Tab" if field == "#input" else "Control+Space")
        bench.until(lambda: bool(waiting))  # noqa: B023
        page.keyboard.type("x")
        waiting[0].continue_()
        page.wait_for_timeout(400)
        assert page.input_value(field) == "pcdc modx" and page.is_hidden("#words")
        page.unroute("**/complete")
        page.fill(field, "pcdc mod")
        page.press(field, "Tab" if field == "#input" else "Control+Space")
        bench.until(lambda: page.input_value(field) == "pcdc model ")  # noqa: B023


def test_several_scripts_are_open_saved_renamed_and_closed(bench: Bench, folder: Path):
    """Each keeps its text, its marks and its undo; two can be seen at a time."""
    page = bench.page
    (folder / "one.sc").write_text("a = 1\n")
    (folder / "two.sc").write_text("b = 2\n")
    page.click("#tab-editor")
    page.click("#more-toggle")
    for name in ("one.sc", "two.sc"):
        page.click("#script-new")  # the list is that of now
        bench.until(lambda: name in page.locator("#script option").all_text_contents())  # noqa: B023
        page.select_option("#script", name)
        bench.until(lambda: page.input_value("#text") == (folder / name).read_text())  # noqa: B023
        page.focus("#text")
        page.keyboard.press("Control+End")
        page.keyboard.type("# more")
    tabs = page.locator("#papers-open button")
    assert [text for text in tabs.all_text_contents() if "●" in text] == ["● one.sc", "● two.sc"]
    tabs.filter(has_text="one.sc").click()
    assert page.input_value("#text") == "a = 1\n# more"
    page.keyboard.press("Control+z")
    assert page.input_value("#text") != "a = 1\n# more"
    page.keyboard.press("Control+y")
    for kind, along in (("2", "x"), ("2v", "y")):
        page.select_option("#panes", kind)
        boxes = [one.bounding_box() for one in page.locator(".paper:visible").all()]
        assert len(boxes) == 2 and abs(boxes[0][along] - boxes[1][along]) > 20
    page.select_option("#panes", "1")
    page.click("#script-save-all")
    bench.until(
        lambda: (
            (folder / "two.sc").read_text() == "b = 2\n# more" and (folder / "one.sc").read_text() == "a = 1\n# more"
        )
    )
    bench.until(lambda: "●" not in "".join(tabs.all_text_contents()) and page.is_disabled("#script-save-all"))
    page.once("dialog", lambda dialog: dialog.accept("uno.sc"))
    page.click("#script-rename")
    bench.until(lambda: (folder / "uno.sc").exists() and not (folder / "one.sc").exists())
    bench.until(lambda: page.input_value("#script") == "uno.sc")
    page.focus("#text")
    page.keyboard.type("# last\n")
    page.click("#script-close")
    page.click("#question [data-answer=cancel]")
    assert tabs.filter(has_text="uno.sc").count() == 1
    page.click("#script-close")
    page.click("#question [data-answer=save_and_close]")
    bench.until(lambda: tabs.filter(has_text="uno.sc").count() == 0)
    assert "# last" in (folder / "uno.sc").read_text()
    for name in ("uno.sc", "two.sc"):
        (folder / name).unlink()


def test_without_run_there_is_no_console(browser: Any, without: Viewing):
    tab = Tab(browser, without.url)
    assert tab.tab.is_hidden("#desk") and tab.tab.is_hidden("#desk-toggle")
    tab.context.close()
    assert tab.errors == []
