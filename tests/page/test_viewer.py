"""`hpcdem view` in a real browser: what is moved, chosen and asked for is what is drawn and told."""

from __future__ import annotations

import json
import os
import re
import socket
import time
import urllib.error
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.core.picture_words import COLOURS, OBJECTS
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.lang import chinese
from hpcdem.page import exports
from hpcdem.page.sources import Sources
from hpcdem.post import movie
from hpcdem.post.view.model import read_view
from hpcdem.post.view.moment import read_moment
from hpcdem.runtime import kept, kernels, run_folder
from tests.conftest import PATIENCE, Launcher, until
from tests.page.viewing import Tab, Viewing
from tests.view import frames
from tests.view.test_default import moment_of, unmoved

STEPS = (0, 10, 20, 30)
BOX = "li[data-layer=elements] input"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four frames of blocks, and a history."""
    path = tmp_path_factory.mktemp("run")
    for step in STEPS:
        frames.write_blocks(path, step, grown=0.01 * step)
    rows = "".join(f"{s},{1e-3 * s},{2.0 * s}\n" for s in STEPS)
    (path / "history_load.csv").write_text(f"step,time [s],reaction_y [N/m]\n{rows}")
    return path


@pytest.fixture(scope="module")
def viewing(folder: Path) -> Iterator[Viewing]:
    one = Viewing(folder)
    yield one
    one.close()


@pytest.fixture
def page(browser: Any, viewing: Viewing) -> Iterator[Tab]:
    tab = Tab(browser, viewing.url, locale="en-GB", color_scheme="light")
    yield tab
    tab.context.close()
    assert tab.errors == []


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and bool(np.array_equal(a, b))


def test_it_opens_on_the_last_frame_and_stays_as_it_is(page: Tab):
    """A click, and a key without a meaning, change nothing."""
    before = page.pixels()
    assert page.text("#moment") == "step 30, 30 ms"
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 4
    page.tab.mouse.click(*page.place(0.5, 0.5))
    page.tab.keyboard.press("z")
    page.tab.wait_for_timeout(500)
    assert same(before, page.pixels())


@pytest.mark.slow
def test_moving_and_zooming(page: Tab):
    before = page.pixels()

    def drag() -> None:
        page.tab.mouse.move(*page.place(0.5, 0.5))
        page.tab.mouse.down()
        page.tab.mouse.move(*page.place(0.6, 0.5), steps=4)
        page.tab.mouse.up()

    moved = page.after(drag)
    assert not same(before, moved)
    page.tab.mouse.move(*page.place(0.3, 0.3))
    assert not same(moved, page.after(lambda: page.tab.mouse.wheel(0, -240)))
    assert same(before, page.after(lambda: page.tab.click("#fit")))
    for key in ("+", "ArrowLeft", "ArrowUp"):
        page.tab.locator("#windows canvas").first.focus()
        now = page.pixels()
        assert not same(now, page.after(lambda: page.tab.keyboard.press(key))), key  # noqa: B023
    assert same(before, page.after(lambda: page.tab.keyboard.press("0")))


def test_a_query_shows_the_element_and_its_values(page: Tab, folder: Path):
    """Element 9 has the stress -10 MPa; its place on the page follows from the camera."""
    page.tab.keyboard.press("q")
    box = page.tab.locator("#windows canvas").first.bounding_box()
    seen = page_box(page)
    x, y = 2.5 + 0.9, 2.5 + 0.3
    u, v = (x - seen[0]) / (seen[1] - seen[0]), (seen[3] - y) / (seen[3] - seen[2])
    page.tab.mouse.click(box["x"] + u * box["width"], box["y"] + v * box["height"])
    page.tab.wait_for_selector("#answer:not([hidden])")
    assert page.text("#answer-title") == "elements 9"
    rows = dict(line.split("\t") for line in page.text("#values").splitlines())
    assert rows["stress_yy"] == "-10 MPa" and rows["group_rock"] == "roof"
    assert rows["displacement"] == "948.683 mm (900, 300)"
    page.tab.mouse.click(*page.place(0.02, 0.98))
    page.tab.wait_for_selector("#answer[hidden]", state="attached")
    assert page.text("#message") == "No object here"


def page_box(page: Tab) -> list[float]:
    """Left, right, bottom, top of the first window, from what is told under the mouse."""
    told = []
    for u, v in ((0.1, 0.1), (0.9, 0.9)):
        page.tab.mouse.move(*page.place(u, v))
        words = page.text("#place").split()
        told.append((float(words[1]), float(words[3])))
    (x0, y0), (x1, y1) = told
    w, h = (x1 - x0) / 0.8, (y0 - y1) / 0.8
    return [x0 - 0.1 * w, x0 + 0.9 * w, y0 - 0.9 * h, y0 + 0.1 * h]


def test_a_distance(page: Tab):
    seen = page_box(page)
    page.tab.keyboard.press("d")
    for u in (0.25, 0.75):
        page.tab.mouse.click(*page.place(u, 0.5))
    told = page.text("#message").split()
    assert float(told[0]) == pytest.approx(0.5 * (seen[1] - seen[0]), rel=0.01)


@pytest.mark.slow
def test_properties_of_objects(page: Tab):
    """Each control changes the picture, and back again it is as it was."""
    page.tab.click("li[data-layer=elements]")
    first = page.pixels()
    by_field = page.after(lambda: page.tab.select_option("#field", "stress_yy"))
    assert not same(first, by_field) and "stress yy (MPa)" in page.text(".legend")
    for change, back in (
        (lambda: page.tab.select_option("#colours", "plasma"), lambda: page.tab.select_option("#colours", "viridis")),
        (lambda: page.tab.check("#edges"), lambda: page.tab.uncheck("#edges")),
        (lambda: page.tab.select_option("#vectors", "velocity"), lambda: page.tab.select_option("#vectors", "")),
        (lambda: page.tab.uncheck(BOX), lambda: page.tab.check(BOX)),
        (lambda: enter(page, "#filter", "group(roof)"), lambda: enter(page, "#filter", "")),
        (lambda: enter(page, "#low", "-20"), lambda: enter(page, "#low", "")),
        (lambda: enter(page, "#deformed", "0"), lambda: enter(page, "#deformed", "1")),
        (lambda: page.tab.fill("#opacity", "0.3"), lambda: page.tab.fill("#opacity", "1")),
    ):  # fmt: skip
        assert not same(by_field, page.after(change))
        assert same(by_field, page.after(back))
    page.after(lambda: enter(page, "#title", "at {step}"))
    assert page.text(".caption") == "at 30"


def enter(page: Tab, where: str, text: str) -> None:
    page.tab.fill(where, text)
    page.tab.press(where, "Enter")
    page.tab.locator(where).blur()


@pytest.mark.slow
def test_objects_are_added_named_ordered_and_deleted(page: Tab):
    tree = lambda: page.tab.locator("#tree li").evaluate_all("all => all.map(one => one.dataset.layer)")  # noqa: E731
    assert tree() == ["liners", "bolts", "joints", "channels", "elements"]
    page.after(lambda: page.tab.select_option("#add", "joints"))
    assert tree()[0] == "joints 2"
    page.tab.once("dialog", lambda dialog: dialog.accept("all joints"))
    page.after(lambda: page.tab.click("#rename"))
    page.after(lambda: page.tab.select_option("#field", "state"))
    page.after(lambda: page.tab.click("#up"))
    assert tree()[:2] == ["liners", "all joints"] and "3" in page.text("li[data-layer='all joints']")
    page.after(lambda: page.tab.click("#remove"))
    assert tree() == ["liners", "bolts", "joints", "channels", "elements"]


@pytest.mark.parametrize("text", ["__import__('os').system('x') > 1"])
def test_a_wrong_filter_is_reported_and_nothing_else_happens(browser: Any, viewing: Viewing, text: str):
    page = Tab(browser, viewing.url, locale="en-GB")
    page.tab.click("li[data-layer=elements]")
    before = page.pixels()
    enter(page, "#filter", text)
    page.tab.wait_for_selector("#message.bad")
    assert page.text("#message").startswith("filter '")
    assert same(before, page.pixels())
    enter(page, "#filter", "x > -100")
    page.tab.wait_for_selector("#message:not(.bad)")
    page.context.close()


@pytest.mark.slow
def test_windows_are_linked(page: Tab):
    page.after(lambda: page.tab.select_option("#split", "4"))
    assert page.tab.locator(".window").count() == 4
    before = [page.pixels(k) for k in range(4)]
    page.tab.mouse.move(*page.place(0.5, 0.5))
    page.after(lambda: page.tab.mouse.wheel(0, -240))
    page.until(lambda: not any(same(before[k], page.pixels(k)) for k in range(4)))
    page.tab.uncheck("#linked")
    page.tab.wait_for_timeout(800)
    before = [page.pixels(k) for k in range(4)]
    page.tab.mouse.move(*page.place(0.5, 0.5))
    page.after(lambda: page.tab.mouse.wheel(0, -240))
    page.until(lambda: [same(before[k], page.pixels(k)) for k in range(4)] == [False, True, True, True])
    page.after(lambda: page.tab.select_option("#split", "1"))
    assert page.tab.locator(".window").count() == 1


def test_time_continues(page: Tab):
    """Slider, keys and play; the history has a cursor at the present time."""
    last = page.pixels()
    first = page.after(lambda: page.tab.click("#first"))
    assert not same(first, last) and page.text("#moment") == "step 0, 0 s"
    page.after(lambda: page.tab.click("#next"))
    assert page.text("#moment") == "step 10, 10 ms"
    page.tab.select_option("#history", "history load")
    page.tab.wait_for_selector("#chart:not([hidden])")
    page.tab.wait_for_timeout(300)
    box, side = (page.tab.locator(name).bounding_box() for name in ("#chart", "#side"))
    assert side["x"] <= box["x"] and box["x"] + box["width"] <= side["x"] + side["width"] and 100 < box["height"] < 200
    chart = page.tab.locator("#chart").screenshot()
    page.tab.select_option("#speed", "20")
    page.tab.click("#play")
    page.until(lambda: page.text("#moment") == "step 30, 30 ms")
    assert page.tab.locator("#chart").screenshot() != chart


@pytest.mark.slow
def test_files(page: Tab, tmp_path: Path, browser: Any):
    page.tab.click("li[data-layer=elements]")
    page.after(lambda: page.tab.select_option("#field", "stress_yy"))
    files = {kind: page.saved(kind, tmp_path) for kind in ("png", "svg", "pdf", "csv", "html", "gif", "mv")}
    image = pytest.importorskip("PIL.Image")
    with image.open(files["png"]) as picture:
        assert abs(picture.size[0] - 17.0 / 2.54 * 200) < 2 and picture.format == "PNG"
    with image.open(files["gif"]) as film:
        assert film.n_frames == len(STEPS)
    assert files["svg"].read_text().count("<image") == 1  # the bar of colours
    assert files["pdf"].read_bytes().startswith(b"%PDF")
    table = files["csv"].read_text().splitlines()
    assert len(table) == 11 and table[10].split(",")[table[0].split(",").index("stress_yy")] == "-10000000.0"
    view = read_view(files["mv"])
    layer = view.layer("elements")
    assert layer is not None and layer.field == "stress_yy" and view.camera is not None
    tab = browser.new_page(java_script_enabled=True, offline=True)
    tab.goto(files["html"].as_uri())
    assert tab.locator("svg").count() >= 1 and "step 30" in tab.title()
    before = tab.screenshot()
    tab.mouse.wheel(0, -300)
    until(lambda: tab.screenshot() != before, pause=lambda seconds: tab.wait_for_timeout(1e3 * seconds))
    tab.close()


def test_a_drawing_is_read_by_ezdxf(page: Tab, tmp_path: Path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.readfile(page.saved("dxf", tmp_path)).modelspace()
    colours = [ezdxf.colors.aci2rgb(k) for k in range(1, 256)]
    near = (np.abs(255.0 * exports._dxf_colours() - colours) <= 1.0).all(axis=1)
    assert near[:99].all() and near.mean() > 0.9  # in the darkest blues the table of ezdxf breaks the rule
    faces = [entity for entity in drawing if entity.dxftype() == "3DFACE"]
    assert len(faces) == 10 and {face.dxf.layer for face in faces} == {"ELEMENTS"}
    assert tuple(faces[9].dxf.vtx2)[:2] == pytest.approx((3.9, 3.3))
    assert len([entity for entity in drawing if entity.dxf.layer == "BOLTS"]) == 2


def test_a_view_is_opened(page: Tab, tmp_path: Path):
    path = tmp_path / "mine.mv"
    path.write_text('{"view": 1, "layers": [{"object": "elements", "field": "number"}], "camera": [0, 2, 0, 1]}')
    before = page.pixels()
    assert not same(before, page.after(lambda: page.tab.set_input_files("#file", path)))
    assert page.tab.locator("#tree li").count() == 1
    path.write_text('{"view": 1, "layers": [{"object": "elephants"}]}')
    page.tab.set_input_files("#file", path)
    page.tab.wait_for_selector("#message.bad")
    assert "layer 1 (elephants), object: expected elements" in page.text("#message")


def test_what_stands_around_the_model(page: Tab):
    """Axes, the legend and histories are there or not; numbers at the edge are those of the place."""

    def edge() -> int:
        return page.tab.evaluate(
            """() => { const c = document.querySelector('canvas.over');
            return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.filter((v) => v).length; }"""
        )

    page.tab.click("li[data-layer=elements]")
    page.after(lambda: page.tab.select_option("#field", "stress_yy"))
    assert edge() > 100 and "stress yy (MPa)" in page.text(".legend")
    page.tab.uncheck("#show-axes")
    assert edge() == 0
    page.tab.uncheck("#show-legend")
    assert page.text(".legend") == ""
    page.tab.uncheck("#show-histories")
    assert not page.tab.is_visible("#history")
    for name in ("axes", "legend", "histories"):
        page.tab.check(f"#show-{name}")
    assert edge() > 100 and page.text(".legend") and page.tab.is_visible("#history")


def test_a_range_of_the_language_is_a_filter(page: Tab):
    page.tab.click("li[data-layer=elements]")
    page.tab.fill("#filter", "range x 0 1.5 group 'base' and stress_yy < 0")
    page.after(lambda: page.tab.click("#apply"))
    count = page.text("li[data-layer=elements] small")
    assert count.endswith(" of 10") and 0 < int(count.split()[0]) < 10


def test_language_and_theme(page: Tab):
    light = page.pixels()
    page.tab.click("#language")
    assert page.text("#fit") == "全图" and page.text("li[data-layer=elements]").startswith("单元")
    page.tab.click("#theme")
    assert not same(light, page.after(lambda: page.tab.click("#theme")))
    page.tab.click("#language")
    assert page.text("#fit") == "Fit"


def test_the_window_that_is_chosen_is_seen(page: Tab):
    page.after(lambda: page.tab.select_option("#split", "2"))
    for chosen in (0, 1):
        page.tab.locator(".window canvas:first-child").nth(chosen).click()
        colours = [
            page.tab.evaluate(f"getComputedStyle(document.querySelectorAll('.window')[{n}], '::after').content")
            for n in (0, 1)
        ]
        assert [colour != "none" for colour in colours] == [chosen == 0, chosen == 1]


def test_the_whole_model_stays_whole_when_the_window_changes(page: Tab):
    """Fitted, it is fitted again; what was zoomed to stays."""

    def width() -> float:
        left, right, *_ = page_box(page)
        return right - left

    before = width()
    page.after(lambda: page.tab.set_viewport_size({"width": 1280, "height": 420}))
    page.until(lambda: width() > 1.5 * before)
    page.after(lambda: page.tab.set_viewport_size({"width": 1280, "height": 720}))
    page.until(lambda: abs(width() / before - 1.0) < 0.02)
    page.tab.locator("#windows canvas").first.focus()
    page.after(lambda: page.tab.keyboard.press("+"))
    page.after(lambda: page.tab.set_viewport_size({"width": 1280, "height": 420}))
    assert abs(width() / (0.8 * before) - 1.0) < 0.02


def test_the_words_of_the_page_stand_in_both_languages(page: Tab):
    words = page.tab.evaluate("import('./words.js').then((module) => module.WORDS)")
    assert set(words["en"]) - set(words["zh"]) == set()
    assert set(words["zh"]) - set(words["en"]) <= set(OBJECTS), "what objects are called in English is their name"
    for name in set(words["en"]) & set(words["zh"]):
        assert sorted(re.findall(r"\{\w+\}", words["en"][name])) == sorted(re.findall(r"\{\w+\}", words["zh"][name])), (
            name
        )


def test_films_are_offered_where_they_can_be_made(page: Tab, viewing: Viewing, monkeypatch: pytest.MonkeyPatch):
    offered = page.tab.locator("#save option").evaluate_all("all => all.map((one) => one.value)")
    assert ("mp4" in offered) == (movie.ffmpeg() is not None) and "gif" in offered and "mv" in offered
    for there in (None, "/usr/bin/ffmpeg"):
        monkeypatch.setattr(movie, "ffmpeg", lambda: there)  # noqa: B023
        assert ("mp4" in exports.kinds()) == (there is not None)


@pytest.mark.parametrize("width", [1920, 1280, 900, 390])
@pytest.mark.parametrize("locale", ["en-GB", "zh-CN"])
def test_nothing_sticks_out_at_any_width(browser: Any, viewing: Viewing, width: int, locale: str):
    """One line of tools, nothing wider than the page, a picture that is worth its place; the panel folds away."""
    tab = Tab(browser, viewing.url, locale=locale, viewport={"width": width, "height": 800})
    page = tab.tab
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    header = page.locator("header").bounding_box()
    assert header["height"] < 56
    for box in (one.bounding_box() for one in page.locator("header :is(button, select, label):visible").all()):
        assert box["x"] >= 0 and box["x"] + box["width"] <= width
        assert header["y"] <= box["y"] and box["y"] + box["height"] <= header["y"] + header["height"]
    assert page.is_visible("#side") == (width > 700)
    wide = page.locator("#windows").bounding_box()
    assert wide["height"] > 400 and wide["width"] > (0.6 if width > 700 else 0.95) * width
    page.click("#fold")
    assert page.is_visible("#side") != (width > 700)
    if width > 700:
        tab.until(lambda: page.locator("#windows").bounding_box()["width"] > 0.98 * width)
    else:
        page.click("#fold")
    if width < 1181:
        assert page.is_hidden("#split")
        page.click("#menu")
        assert page.is_visible("#split") and page.locator("#toolbar").bounding_box()["x"] >= 0
    tab.context.close()
    assert tab.errors == []


def test_a_long_message_is_read_whole(page: Tab):
    page.tab.click("li[data-layer=elements]")
    page.tab.fill("#filter", f"abs({'x + ' * 12}x, y, {'x + ' * 10}nothing_of_this_name) > 1")
    page.tab.click("#apply")
    page.tab.wait_for_selector("#message.bad")
    told = page.tab.locator("#message").evaluate(
        "e => [e.scrollWidth - e.clientWidth, e.scrollHeight - e.clientHeight]"
    )
    assert told[0] <= 0 and told[1] <= 0


def test_the_picture_has_a_light_ground_in_both_themes(browser: Any, viewing: Viewing):
    """Black beds and blue walls are seen: the ground is far from both."""
    for scheme in ("light", "dark"):
        tab = Tab(browser, viewing.url, color_scheme=scheme, locale="en-GB")
        corner = tab.pixels()[-3, 3].astype(float)
        assert corner.mean() > 200, scheme
        tab.context.close()


def test_chinese_names_of_fields_and_colours(page: Tab):
    page.tab.click("#language")
    page.tab.click("li[data-layer=elements]")
    page.until(lambda: "应力 yy stress_yy (Pa)" in page.tab.locator("#field option").all_text_contents())
    assert "彩虹" in page.tab.locator("#colours option").all_text_contents()
    page.until(lambda: "拉裂" in page.text(".legend"))
    page.tab.click("#language")
    page.until(lambda: "stress_yy (Pa)" in page.tab.locator("#field option").all_text_contents())


def test_fields_of_all_frames_are_known_in_chinese(tmp_path: Path):
    made = (frames.write_blocks(tmp_path), frames.write_discs(tmp_path), frames.write_body(tmp_path))
    for moment in map(read_moment, made):
        for kind, objects in moment.objects.items():
            for name in (*objects.fields, *objects.vectors):
                assert re.search("[一-鿿]", chinese.field_name(name)), (kind, name)
    assert set(chinese.COLOURS) == set(COLOURS)


# ---- before there is a picture ---------------------------------------------------------------------------------------


def test_an_empty_stage_says_why(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Compiling, waiting for the first frame, nothing that runs; then the picture comes by itself."""
    place = tmp_path / "store"
    place.mkdir()
    building = place / f"building-{socket.gethostname()}"
    building.write_text(f"process {os.getpid()} of here")
    data = tmp_path / "data"
    sources = Sources([data], empty=True)
    monkeypatch.setattr(kept, "store", lambda: (place, True))
    assert sources.waiting() == {"kind": "compiling", "who": f"process {os.getpid()} of here", "folder": str(data)}
    late = Sources([tmp_path / "comes later"])  # the page may be opened before the run makes its folder
    assert late.waiting()["kind"] == "compiling" and not late.found
    for name in ("typed_wrong.vtkhdf", "store"):  # no folder, and one with something else in it
        with pytest.raises(HpcdemError):
            Sources([tmp_path / name])
    building.write_text("process 999999999 of here")  # was killed
    with pytest.raises(HpcdemError, match="no such file"):
        Sources([tmp_path / "comes later"])
    assert sources.waiting()["kind"] == "empty" and kernels.builder() == ""
    data.mkdir()
    monkeypatch.setattr(run_folder, "running", lambda folder: {"pid": 1})
    assert sources.waiting()["kind"] == "first"
    frames.write_blocks(data)
    sources.refresh()
    assert sources.found

    empty = Viewing("--run", "--", tmp_path / "none")
    try:
        context = browser.new_context(locale="en-GB")
        page = context.new_page()
        page.goto(empty.url)
        page.wait_for_selector("#waiting[data-kind=wait_desk]")
        assert "press Run all" in page.inner_text("#waiting")
        (tmp_path / "none").mkdir()
        frames.write_blocks(tmp_path / "none")
        page.wait_for_selector("#waiting", state="hidden")
        page.wait_for_selector("body[data-fine=true]")
        context.close()
    finally:
        empty.close()


# ---- a run that goes on ----------------------------------------------------------------------------------------------

MODEL = (
    "pcdc mesh structured (0,0) (4,2) cells 8 4 diagonal both\n"
    "pcdc element c-model mech-iso-elastic property density 2500 young 20e9 p-r 0.2\n"
    "pcdc model option collision off\npcdc element initial stress-yy -2e6\n"
    "pcdc history create 'moved' node nearest (0,0) value displacement-y every 50\n"
    "pcdc output vtk 'rock' every 2000\npcdc model step 100000000\n"
)


@pytest.mark.slow
def test_a_run_is_followed_told_to_save_and_to_stop(browser: Any, launch: Launcher, tmp_path: Path):
    """New frames appear by themselves; the buttons do what the signals do: a checkpoint, and exit code 85 with one."""
    (tmp_path / "a.sc").write_text(MODEL)
    run = launch.start(1, "a.sc", "--no-figure", cwd=tmp_path)
    data = tmp_path / "data"
    until(lambda: len(list(data.glob("rock_*.vtkhdf"))) > 1)
    viewing = Viewing(data)
    try:
        page = Tab(browser, viewing.url, locale="en-GB")
        assert "running on" in page.text("#run-state") and page.text("#run-state").startswith("a.sc")
        until(lambda: page.text("#far"))  # how far it is, of what, how long it takes, and the last line of the log
        assert re.fullmatch(r"step \d+, step 100000000 · \d\.\d % · left [\d:]+", page.text("#far"))
        assert "step 100000000" in page.text("#log-line") or "steps/s" in page.text("#log-line")
        first = page.text("#moment")
        until(lambda: page.text("#moment") != first)
        page.tab.click("#checkpoint")
        until(lambda: list(data.glob("*.sav")))
        saved = len(list(data.glob("*.sav")))
        assert run.poll() is None and "SIGUSR2" in page.text("#message")
        time.sleep(2.5)  # a second request so soon after the first counts as the same
        page.tab.on("dialog", lambda dialog: dialog.accept())
        page.tab.click("#stop")
        assert run.wait(PATIENCE) == 85
        assert len(list(data.glob("*.sav"))) >= saved
        until(lambda: "stopped at step" in page.text("#run-state"))
        assert page.tab.locator("#stop").is_disabled() and page.errors == [] and not page.tab.is_visible("#far")
        assert not (data / "progress.json").exists()
    finally:
        viewing.close()


def test_what_is_no_run_is_refused(tmp_path: Path, launch: Launcher):
    """A folder of another program, half a frame, a file that is not there."""
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mesh_0000000001.vtkhdf").write_bytes(b"something else")
    for path, message in ((tmp_path / "other", "no frame all_*.vtkhdf"), (tmp_path / "none.vtkhdf", "no such file")):
        done = launch(1, "view", path, "--no-browser")
        assert done.returncode != 0 and message in done.stderr and "Traceback" not in done.stderr
    half = frames.write_blocks(tmp_path)
    half.write_bytes(half.read_bytes()[:4000])
    done = launch(1, "view", half, "--no-browser")
    assert done.returncode != 0 and half.name in done.stderr and "Traceback" not in done.stderr


# ---- without a browser -----------------------------------------------------------------------------------------------


def refused(viewing: Viewing, name: str, content: dict[str, Any], url: str = "", **headers: str) -> tuple[int, str]:
    one = Viewing.__new__(Viewing)
    one.url = url or viewing.url
    with pytest.raises(urllib.error.HTTPError) as caught:
        one.ask(name, content, **headers)
    return caught.value.code, json.loads(caught.value.read())["error"]


def test_who_may_ask(viewing: Viewing):
    wrong = viewing.url.rstrip("/")[:-1] + ("x" if viewing.url[-2] != "x" else "y") + "/"
    assert refused(viewing, "state", {}, wrong)[0] == 403
    assert refused(viewing, "state", {}, Origin="http://example.org")[0] == 403
    assert refused(viewing, "state", {}, Host="example.org")[0] == 403


def test_what_may_be_asked(viewing: Viewing):
    """Files of the machine cannot be named; what is no view, frame or size is told."""
    about = viewing.ask("about", {})
    good = {"view": about["view"], "width": 100, "height": 50}
    for wanted, message in (
        ({"frame": 99}, "no such frame"), ({"frame": "/etc/passwd"}, "frame: expected"), ({"source": 5}, "unknown fr"),
        ({"width": 10**9}, "width and height"), ({"width": 1.5}, "width: expected"), ({"view": 3}, "view: expected"),
        ({"view": {"layers": [{"object": "x"}]}}, "layer 1 (x), object: expected"),
    ):  # fmt: skip
        status, said = refused(viewing, "picture", good | wanted)
        assert status in (400, 422) and message in said, wanted
    assert refused(viewing, "curves", {"chart": "../../etc/passwd"})[1] == "there is no such chart"
    assert refused(viewing, "curves", {"x": "time", "y": ["'../passwd'"]})[1].startswith(
        "there is no history '../passwd'"
    )
    assert refused(viewing, "file", good | {"format": "exe"})[1].startswith("format: expected one of png")
    assert refused(viewing, "tell", {"what": "stop"})[1] == "no run is writing into this folder"
    assert refused(viewing, "tell", {"what": "rm"})[1] == "expected stop or checkpoint"
    picked = viewing.ask("pick", good | {"column": 0, "row": 0})
    assert picked == {"object": None}
    curve = viewing.ask("curves", {"x": "time", "y": ["'load'"]})["curves"][0]
    assert curve["y"] == [0.0, 20.0, 40.0, 60.0] and (curve["unit"], curve["step"]) == ("N/m", [0, 10, 20, 30])


def test_every_pixel_picks_what_is_there(viewing: Viewing, folder: Path):
    """Clicks at the middles of all elements find their numbers."""
    about = viewing.ask("about", {})
    view = about["view"] | {"layers": [one for one in about["view"]["layers"] if one["object"] == "elements"]}
    view["camera"] = [0.0, 8.0, 0.0, 4.0]
    state = read_mesh_frame(folder / "rock_0000000030.vtkhdf")
    for number, cell in enumerate(state.cells):
        x, y = state.points[cell[cell >= 0]].mean(axis=0)
        wanted = {"view": view, "width": 800, "height": 400, "column": int(100 * x), "row": int(100 * (4 - y))}
        found = viewing.ask("pick", wanted)
        assert found["object"] == "elements" and found["number"] >= number, number  # later ones may lie over it
        assert found["number"] == number or number < 9


def test_fields_that_take_long_are_reported_once_they_were_chosen(tmp_path: Path):
    """The stress of particles is made from all contacts: a click shows it after it was the colour."""
    frames.write_discs(tmp_path)
    viewing = Viewing(tmp_path)
    try:
        view = viewing.ask("about", {})["view"] | {"camera": [-0.5, 4.5, -0.5, 4.5]}
        view["layers"] = [one for one in view["layers"] if one["object"] == "particles"]
        wanted = {"view": view, "width": 500, "height": 500, "column": 250, "row": 250}

        def told() -> dict[str, Any]:
            found = viewing.ask("pick", wanted)
            assert found["object"] == "particles" and found["number"] == 22
            return {name: value for name, value, *_ in found["values"]}

        names = [name for name, _ in viewing.ask("fields", {"object": "particles"})["fields"]]
        assert "stress_xx" in names and "stress_xx" not in told() and told()["vx"] == 12.0
        view["layers"][0]["field"] = "stress_xx"
        assert isinstance(told()["stress_xx"], float)
    finally:
        viewing.close()


def test_a_run_that_has_begun_shows_what_happens_as_soon_as_something_does(browser: Any, tmp_path: Path):
    """The page was opened on a mesh with its groups; a view that somebody has changed stays as it is."""
    moment_of(unmoved(frames.blocks()), tmp_path, 0)
    viewing = Viewing(tmp_path)
    try:
        tabs = [Tab(browser, viewing.url, locale="en-GB", color_scheme="light") for _ in range(2)]
        for tab in tabs:
            assert "base" in tab.text(".legend") and "displacement" not in tab.text(".legend")
        tabs[1].tab.click("li[data-layer=elements]")
        tabs[1].after(lambda: tabs[1].tab.uncheck("#edges"))
        moment_of(frames.blocks(), tmp_path, 10)
        for tab in tabs:
            tab.until(lambda: tab.text("#moment").startswith("step 10"))  # noqa: B023
        tabs[0].until(lambda: "displacement (mm)" in tabs[0].text(".legend"))
        assert "base" in tabs[1].text(".legend")
        for tab in tabs:
            tab.context.close()
    finally:
        viewing.close()


def test_the_range_of_colours_is_reported_in_the_unit_of_the_bar(page: Tab):
    page.tab.click("li[data-layer=elements]")
    page.after(lambda: page.tab.select_option("#field", "stress_yy"))
    page.until(lambda: page.text("#range-unit") == "MPa")
    assert page.tab.locator("#low").get_attribute("placeholder") == "-10"
    page.after(lambda: enter(page, "#low", "-5"))
    assert page.text(".legend .bar").split() == ["-1", "-2", "-3", "-4", "-5"][::-1]
    page.after(lambda: page.tab.check("#full"))
    assert page.text(".legend .bar").split() == ["-10", "-8", "-6", "-4", "-2"]
