"""The page in a real browser: what is moved changes what is drawn, and what is drawn is the specimen."""

from __future__ import annotations

import io
import json
import re
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hpcdem.page.maker import request_of
from hpcdem.post.specimen import class_colours
from hpcdem.pre.specimen import make_specimen
from tests.conftest import BIN, PATIENCE
from tests.page.conftest import REQUEST, command_line


def slow(*cases):
    """Cases for --slow: the others show the same."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow) for case in cases]


MARGIN = 34
"""Pixels between the box and the edge of the canvas, `fit` in packing.js."""
LINE, EDGE, OPACITY = 1.5, 1.1, 0.75
"""Pixels of the lines around box and grains, and how much of what is behind the latter they hide (light theme)."""


def scale_of(page) -> float:
    """Pixels per mm when the box is fitted."""
    h, w = page.pixels().shape[:2]
    wide, high = page.numbers("fact_box")
    return min((w - 2 * MARGIN) / wide, (h - 2 * MARGIN) / high)


def covered(page) -> float:
    """Share of the pixels inside the box that belong to grains; half transparent ones count as their part."""
    pixels = page.pixels()
    h, w = pixels.shape[:2]
    scale = scale_of(page)
    wide, high = page.numbers("fact_box")
    y, x = np.mgrid[0:h, 0:w] + 0.5
    inside = (abs(x - w / 2) < scale * wide / 2 - LINE) & (abs(y - h / 2) < scale * high / 2 - LINE)
    return float((pixels[..., 3] / 255.0)[inside].mean())


def test_the_page_shows_the_specimen_of_the_command_line(open_page):
    page = open_page()
    assert page.fact("fact_number") == "300"
    assert sum(int(n) for n in page.counts() if n.isdigit()) == 300
    assert page.numbers("fact_void")[1] == 0.5
    wide, high = page.numbers("fact_box")
    assert high / wide == pytest.approx(2.0, rel=1e-3)
    assert "300 grains, Triangle" in page.tab.get_attribute("#canvas", "aria-label")
    assert page.errors == []


def test_nothing_is_loaded_from_elsewhere(open_page, served):
    page = open_page()
    assert len(page.asked) >= 9
    assert [url for url in page.asked if not url.startswith((served.url, "data:"))] == []


def differing(a, b) -> float:
    """Share of the pixels that differ by more than the rounding of smoothed edges."""
    assert a.shape == b.shape
    return float((abs(a.astype(int) - b) > 60).any(-1).mean())


ALIKE, UNLIKE = 2e-4, 5e-3
"""Shares of pixels that may differ in the same picture, and must in another."""


def edges(made, scale: float) -> float:
    """Share of the box that the lines around the grains add: half a line's width along every outline."""
    o = made.outlines
    following = np.arange(1, len(o.x) + 1)
    following[o.start[1:] - 1] = o.start[:-1]
    chord = np.hypot(o.x[following] - o.x, o.y[following] - o.y)
    half = np.maximum(o.theta / 2, 1e-9)
    width = np.minimum(EDGE / scale, 0.22e3 * made.reach) * 1e-3  # m; packing.js
    area = 0.5 * OPACITY * width[o.owner] * chord * half / np.sin(half)
    return float(area.sum() / (made.width * made.height))


@pytest.mark.parametrize("shape", ["circle", "triangle", *slow("ellipse", "quadrilateral", "pentagon")])
def test_grains_cover_their_share_of_the_box(open_page, wanted, shape):
    """Solid area over area of the box is 1 / (1 + e)."""
    page = open_page(device_scale_factor=1)
    if shape != "triangle":
        page.change(lambda: page.tab.check(f"#shape-{shape}"))
    made = make_specimen(request_of(wanted(shape=shape)))
    share = covered(page) - edges(made, scale_of(page))
    assert share == pytest.approx(1.0 / (1.0 + page.numbers("fact_void")[0]), rel=0.015)


@pytest.mark.parametrize(
    ("roundness", "factor"), [(0.5, 0.67301), *slow((0.0, 3 * np.sqrt(3) / (4 * np.pi)), (0.2, 0.51409), (1.0, 1.0))]
)
def test_edges_of_triangles_are_true_arcs(open_page, wanted, roundness, factor):
    """Area of a regular triangle with rounded edges over that of its circle: 0.75 sqrt(3) / pi for straight edges, and
    three circular segments of angle R 120 degrees more for the others."""
    page = open_page()
    page.change(lambda: page.fill("#deviation-exact", 0))
    page.change(lambda: page.fill("#roundness-exact", roundness))
    while page.tab.locator("#rows tr").count() > 1:
        page.change(lambda: page.tab.locator("#rows .remove").last.click())
    page.change(lambda: page.fill("#number-exact", 30))
    page.change(lambda: page.fill("#void_ratio-exact", 1.0))
    request = wanted(deviation=0, roundness=roundness, rows=[["3", "100"]], number=30, void_ratio=1.0)
    share = covered(page) - edges(make_specimen(request_of(request)), scale_of(page))
    wide, high = (v - 2 * LINE / scale_of(page) for v in page.numbers("fact_box"))
    assert share * wide * high / 30 / (0.25 * np.pi * 3.0**2) == pytest.approx(factor, rel=0.01)


def test_colours_on_the_canvas_are_those_of_the_table(open_page):
    page = open_page()
    pixels = page.pixels().reshape(-1, 4)
    for colour in class_colours(5):
        rgb = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        assert (pixels == [*rgb, 255]).all(1).sum() > 200, colour
    swatches = page.tab.eval_on_selector_all(".swatch", "all => all.map((e) => e.style.backgroundColor)")
    shown = ["#" + "".join(f"{int(n):02x}" for n in re.findall(r"\d+", swatch)) for swatch in swatches]
    assert shown == class_colours(5)


@pytest.mark.parametrize(
    ("field", "fact"),
    [("number", "fact_number"), ("roundness", "fact_solid"),
     *slow(("slenderness", "fact_box"), ("void_ratio", "fact_void"), ("deviation", "fact_solid"))],
)  # fmt: skip
def test_a_slider_under_the_mouse_changes_numbers_and_picture(open_page, field, fact):
    page = open_page()
    before, picture = page.fact(fact), page.pixels()
    box = page.tab.locator(f"#{field}").bounding_box()
    y = box["y"] + box["height"] / 2
    at = float(page.tab.evaluate(f"(e => (e.value - e.min) / (e.max - e.min))(document.querySelector('#{field}'))"))
    page.tab.mouse.move(box["x"] + box["width"] * at, y)
    page.tab.mouse.down()

    def drag() -> None:
        for k in range(1, 9):
            page.tab.mouse.move(box["x"] + box["width"] * (at + 0.02 * k), y)
        page.tab.mouse.up()

    page.change(drag)
    assert page.fact(fact) != before
    assert differing(page.pixels(), picture) > UNLIKE
    assert page.errors == []


def test_keys_move_sliders_choices_and_the_exact_values_follow(open_page):
    page = open_page()
    page.tab.focus("#void_ratio")
    page.change(lambda: page.tab.keyboard.press("ArrowRight"))
    assert page.tab.input_value("#void_ratio-exact") == "0.51"
    assert page.numbers("fact_void")[1] == 0.51
    page.tab.focus("#shape-triangle")
    page.change(lambda: page.tab.keyboard.press("ArrowRight"))
    assert page.tab.is_checked("#shape-quadrilateral")
    page.change(lambda: page.fill("#seed", 7))
    page.change(lambda: page.tab.click("#dice"))
    assert page.tab.input_value("#seed") != "7"


def test_only_the_fields_of_the_shape_are_there(open_page):
    page = open_page()
    fields = {"circle": [], "ellipse": ["l_over_d"], "pentagon": ["deviation", "roundness"]}
    for shape, own in fields.items():
        page.change(lambda shape=shape: page.tab.check(f"#shape-{shape}"))
        shown = [f for f in ("l_over_d", "deviation", "roundness") if page.tab.is_visible(f"[data-field={f}]")]
        assert shown == own
    assert float(page.tab.get_attribute("#deviation-exact", "max")) == 30.5  # 180 / 5 - 5, less half a degree


def test_the_same_seed_gives_the_same_picture_and_another_another(open_page):
    page = open_page()
    first = page.pixels()
    page.change(lambda: page.fill("#seed", 2))
    other = page.pixels()
    page.change(lambda: page.fill("#seed", 1))
    assert differing(page.pixels(), first) < ALIKE and differing(other, first) > UNLIKE


def test_a_wrong_table_says_so_and_keeps_the_last_drawing(open_page):
    page = open_page()
    picture, curve = page.pixels(), page.text("#facts")
    cell = "[data-cell='2-1']"
    page.fill(cell, "90")
    page.tab.wait_for_selector("#error:not([hidden])")
    assert (
        page.text("#error")
        == "Row 3: 90 % finer than 1 mm, but 80 % finer than 2 mm, expected no more below the smaller size"
    )
    assert page.tab.get_attribute(cell, "aria-invalid") == "true"
    assert page.tab.is_visible("#stale")
    assert differing(page.pixels(), picture) < ALIKE and page.text("#facts") == curve
    assert page.tab.evaluate("getComputedStyle(document.querySelector('#canvas')).opacity") != "1"
    page.tab.click("#output")
    assert page.tab.locator("#list button:enabled").count() == 0
    page.tab.keyboard.press("Escape")
    page.change(lambda: page.fill(cell, "70"))
    assert not page.tab.is_visible("#error") and not page.tab.is_visible("#stale")
    assert page.tab.get_attribute(cell, "aria-invalid") is None
    assert differing(page.pixels(), picture) > UNLIKE
    page.change(lambda: page.tab.click("#reset"))
    assert differing(page.pixels(), picture) < ALIKE


@pytest.mark.parametrize(("field", "value"), [("number", "5"), ("number", ""), ("void_ratio", "-1"), ("seed", "1.5")])
def test_a_wrong_number_says_so_at_its_field(open_page, field, value):
    page = open_page()
    place = "#seed" if field == "seed" else f"#{field}-exact"
    page.fill(place, value)
    page.tab.wait_for_selector("#error:not([hidden])")
    assert page.text("#error").startswith(f"{field}: read ")
    assert page.tab.get_attribute(place, "aria-invalid") == "true"


def test_rows_can_be_added_pasted_and_read_from_a_file(open_page, tmp_path):
    page = open_page()
    page.tab.click("#add")
    page.tab.keyboard.type("0.2")
    page.change(lambda: page.fill("[data-cell='5-1']", "10"))
    assert len(page.counts()) == 6 and page.fact("fact_classes") == "6 / 6"
    path = tmp_path / "other.txt"
    path.write_text("# sieves\n10 100\n5 95\n1 75\n0.5 60\n", encoding="utf-8")
    page.change(lambda: page.tab.check("#placement-cells"))
    page.change(lambda: page.fill("#slenderness-exact", 0.2))
    page.change(lambda: page.fill("#number-exact", 400))
    page.change(lambda: page.tab.set_input_files("#file", path))
    assert page.tab.input_value("[data-cell='0-0']") == "10" and len(page.counts()) == 4
    need = page.tab.locator(".need")
    assert need.all_inner_texts() == ["from 5,117"]  # the largest class has no grain among 400
    page.change(need.click)
    assert page.counts()[0] == "1" and page.tab.input_value("#number-exact") == "5117"
    path.write_bytes(b"x" * 70000)
    page.tab.set_input_files("#file", path)
    page.tab.wait_for_selector("#error:not([hidden])")
    assert "not a grading file" in page.text("#error")


def test_the_curve_has_target_and_reached_in_their_places(open_page):
    """Marks lie on a logarithmic axis: equal ratios of sizes are equally far apart, and the axis can be turned."""
    page = open_page()

    def marks():
        script = "(all, names) => all.map((e) => names.map((n) => Number(e.getAttribute(n))))"
        target = page.tab.eval_on_selector_all("#plot circle[r='4']:has(title)", script, ["cx", "cy"])
        return np.array(target)

    sizes, percent = np.array(REQUEST["rows"], float).T
    at = marks()
    per_decade, _ = np.polyfit(np.log10(sizes), at[:, 0], 1)
    assert per_decade > 0
    np.testing.assert_allclose(at[:, 0] - at[0, 0], per_decade * np.log10(sizes / sizes[0]), atol=1e-6)
    per_percent = (at[-1, 1] - at[0, 1]) / (percent[-1] - percent[0])
    np.testing.assert_allclose(at[:, 1] - at[0, 1], per_percent * (percent - percent[0]), atol=1e-6)
    page.tab.check("#soil")
    turned = marks()
    assert np.polyfit(np.log10(sizes), turned[:, 0], 1)[0] == pytest.approx(-per_decade)
    assert page.tab.locator("#plot rect.reached-mark:has(title)").count() == 5


def test_the_view_zooms_and_moves_by_wheel_mouse_and_keys(open_page):
    page = open_page()
    fitted = page.pixels()
    box = page.tab.locator("#canvas").bounding_box()
    page.tab.mouse.move(box["x"] + 200, box["y"] + 200)
    steps = (
        lambda: page.tab.mouse.wheel(0, -300),
        lambda: page.tab.click("#nearer"),
        lambda: page.tab.press("#canvas", "-"),
        lambda: page.tab.press("#canvas", "ArrowLeft"),
    )
    before = fitted
    for step in steps:
        step()
        page.until(lambda: differing(page.pixels(), before) > UNLIKE)  # noqa: B023
        before = page.pixels()
    page.change(lambda: page.fill("#seed", 2))  # a view that was chosen stays
    page.change(lambda: page.fill("#seed", 1))
    assert differing(page.pixels(), before) < ALIKE
    page.tab.press("#canvas", "0")
    page.until(lambda: differing(page.pixels(), fitted) < ALIKE)


def test_all_grains_of_a_loose_column_can_be_shown(open_page):
    page = open_page()
    page.change(lambda: page.tab.check("#placement-cells"))
    high, wide = page.numbers("fact_height")[0], page.numbers("fact_box")[0]
    assert high > 10 * wide
    page.tab.click("#fit-all")
    page.until(lambda: MARGIN - 2 <= np.flatnonzero((page.pixels()[..., 3] > 0).any(1))[0] < MARGIN + 40)


def test_a_grain_shows_its_size(open_page):
    page = open_page()
    pixels = page.pixels()
    rgb = [int(class_colours(5)[0][k : k + 2], 16) for k in (1, 3, 5)]
    y, x = (int(v.mean()) for v in np.nonzero((pixels == [*rgb, 255]).all(2)))
    # The mean of several grains may lie between them: the nearest pixel of the colour.
    places = np.argwhere((pixels == [*rgb, 255]).all(2))
    y, x = places[np.argmin(((places - [y, x]) ** 2).sum(1))]
    box = page.tab.locator("#canvas").bounding_box()
    page.tab.mouse.move(box["x"] + x + 0.5, box["y"] + y + 0.5)
    assert page.text("#tip").startswith("3 mm · grain ")


def test_two_languages_have_the_same_words_and_one_button_changes_all(open_page):
    page = open_page()
    words = page.tab.evaluate("import('./words.js').then((m) => m.WORDS)")
    assert set(words["en"]) == set(words["zh"])
    for name, text in words["en"].items():
        assert sorted(re.findall(r"\{\w+\}", text)) == sorted(re.findall(r"\{\w+\}", words["zh"][name])), name
    page.tab.click("#language")
    assert page.tab.title() == words["zh"]["title"]
    assert page.tab.get_attribute("html", "lang") == "zh-Hans"
    shown = page.tab.inner_text("body")
    latin = set(re.findall(r"[A-Za-z]{3,}", shown)) - {"hpcdem", "English"}
    assert latin == set(), "not translated"
    assert page.text("[data-field=roundness] label").startswith("浑圆度")
    page.tab.reload()
    page.wait(0)
    assert page.text("#output") == "输出"  # remembered
    page.tab.click("#language")
    assert page.text("#output") == "Output" and not re.search(r"[一-鿿]", page.text("main"))
    assert "{" not in page.tab.inner_text("body")


def test_a_chinese_browser_begins_in_chinese(open_page):
    assert open_page(locale="zh-CN").text("#output") == "输出"


CONTRAST = """() => {
    const lum = (c) => { const [r, g, b] = c.match(/[\\d.]+/g).map(Number).map((v) => v / 255)
        .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
    const behind = (e) => { for (; e; e = e.parentElement) {
        const c = getComputedStyle(e).backgroundColor; if (!/, 0\\)$/.test(c)) return c; }
        return 'rgb(255, 255, 255)'; };
    const found = [];
    for (const e of document.querySelectorAll('body *')) {
        const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
        if (!own || !e.checkVisibility() || e.closest('svg, .unseen, .skip, :disabled')) continue;
        const [a, b] = [lum(getComputedStyle(e).color), lum(behind(e))].sort((p, q) => q - p);
        found.push([(a + 0.05) / (b + 0.05), e.tagName + ' ' + e.textContent.trim().slice(0, 30)]);
    }
    return found; }"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast_in_both_themes(open_page, scheme):
    """4.5 to 1 for text, WCAG 2.1, 1.4.3."""
    page = open_page(color_scheme=scheme)
    page.fill("[data-cell='2-1']", "90")
    page.tab.wait_for_selector("#error:not([hidden])")
    found = page.tab.evaluate(CONTRAST)
    assert len(found) > 50
    assert [entry for entry in found if entry[0] < 4.5] == []


def test_the_theme_follows_the_system_until_it_is_chosen(open_page):
    page = open_page(color_scheme="dark")
    ground = "getComputedStyle(document.documentElement).backgroundColor"
    assert page.tab.evaluate(ground) == "rgb(17, 22, 24)"
    page.tab.emulate_media(color_scheme="light")
    page.until(lambda: page.tab.evaluate(ground) == "rgb(244, 242, 236)")
    page.tab.click("#theme")  # light
    page.tab.click("#theme")  # dark
    assert page.tab.evaluate(ground) == "rgb(17, 22, 24)"
    page.tab.reload()
    page.wait(0)
    assert page.tab.evaluate(ground) == "rgb(17, 22, 24)"


@pytest.mark.parametrize("locale", ["en-US", "zh-CN"])
def test_nothing_sticks_out_at_any_width(open_page, locale):
    page = open_page(locale=locale)
    for width in (360, 800, 1100, 1440, 2200):
        page.tab.set_viewport_size({"width": width, "height": 900})
        page.tab.wait_for_timeout(150)
        nothing_sticks_out(page, width)


def nothing_sticks_out(page, width):
    assert page.tab.evaluate("document.documentElement.scrollWidth") <= width
    over = page.tab.eval_on_selector_all(
        "main *", "all => all.filter((e) => e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 20"
        " && getComputedStyle(e).display !== 'inline' && !e.closest('svg, .unseen, canvas') && e.tagName !== 'INPUT')"
        ".map((e) => e.tagName + ' ' + e.id + ' ' + e.className)",
    )  # fmt: skip
    assert over == []


def test_everything_that_can_be_used_has_a_name_and_is_reached_by_tab(open_page):
    page = open_page()
    nameless = page.tab.eval_on_selector_all(
        "button, input:not([hidden]), canvas",
        "all => all.filter((e) => !(e.getAttribute('aria-label') || e.labels?.[0]?.textContent.trim() || "
        "e.textContent.trim())).map((e) => e.outerHTML)",
    )
    assert nameless == []
    seen = []
    for _ in range(60):
        page.tab.keyboard.press("Tab")
        seen.append(page.tab.evaluate("document.activeElement.id || document.activeElement.dataset.cell || ''"))
    for name in ("language", "theme", "output", "open", "0-0", "4-1", "add", "shape-triangle", "number", "number-exact",
                 "roundness", "seed", "placement-dense", "soil", "fit-box", "canvas"):  # fmt: skip
        assert name in seen, name


def test_only_the_last_of_many_quick_moves_counts(open_page):
    page = open_page()
    posts = []
    page.tab.on("request", lambda request: posts.append(request) if request.method == "POST" else None)
    script = """() => { const e = document.querySelector('#number-exact');
        for (let n = 300; n < 400; n++) { e.value = n; e.dispatchEvent(new Event('input')); } }"""
    page.change(lambda: page.tab.evaluate(script))
    assert page.fact("fact_number") == "399"
    assert len(posts) <= 3
    assert json.loads(posts[-1].post_data)["number"] == 399


@pytest.mark.slow
def test_slow_specimens_are_drawn_with_fewer_grains_while_a_slider_moves(open_page):
    page = open_page()
    page.change(lambda: page.fill("#number-exact", 8000))
    box = page.tab.locator("#roundness").bounding_box()
    x, y = box["x"] + 0.3 * box["width"], box["y"] + box["height"] / 2
    page.tab.mouse.move(x, y)
    page.tab.mouse.down()
    page.change(lambda: page.tab.mouse.move(x + 15, y))
    assert page.tab.is_visible("#coarse") and "Preview with" in page.text("#coarse")
    assert page.numbers("fact_number")[0] < 8000
    page.change(page.tab.mouse.up)
    assert not page.tab.is_visible("#coarse") and page.fact("fact_number") == "8,000"


# -- files ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def of_command_line(launch_once, grading_file, tmp_path_factory):
    """`files("triangle", "--layout", "full")`: what the command line writes, by name."""

    def files(shape: str, *more: str) -> dict[str, bytes]:
        folder = tmp_path_factory.mktemp("files")
        words = command_line(grading_file, shape=shape)
        launch_once([sys.executable, *words, "--out", str(folder), "--format", "png,svg", *more])
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    return files


def saved(page, name: str) -> bytes:
    """Press Save beside a file, and what the browser then has."""
    with page.tab.expect_download() as download:
        page.tab.click(f"[data-file='{name}']")
    assert download.value.suggested_filename == name
    return Path(download.value.path()).read_bytes()


@pytest.mark.parametrize(
    ("shape", "bodies", "layout"), [("circle", "xyr", "plain"), *slow(("triangle", "clumps", "full"))]
)
def test_saved_files_are_those_of_the_command_line(open_page, of_command_line, shape, bodies, layout):
    page = open_page()
    if shape != "triangle":
        page.change(lambda: page.tab.check(f"#shape-{shape}"))
    page.tab.click("#output")
    names = page.tab.eval_on_selector_all("#list [data-file]", "all => all.map((e) => e.dataset.file)")
    wanted = of_command_line(shape)
    assert set(wanted) | {f"specimen_{layout}.dat", "specimen.zip", "grading.txt"} == set(names)
    for name in ("specimen.dat", f"specimen.{bodies}", "grading.csv", "deposit.py"):
        assert saved(page, name) == wanted[name], name
    other = of_command_line(shape, "--layout", layout)
    assert saved(page, f"specimen_{layout}.dat") == other["specimen.dat"] != wanted["specimen.dat"]
    assert saved(page, "grading.png").startswith(b"\x89PNG") and b"<svg" in saved(page, "packing.svg")
    assert "specimen" in page.text("#said") or "packing" in page.text("#said")
    assert page.errors == []


@pytest.mark.slow
def test_the_archive_holds_all_files(open_page, of_command_line):
    page = open_page()
    page.tab.click("#output")
    with zipfile.ZipFile(io.BytesIO(saved(page, "specimen.zip"))) as archive:
        assert archive.testzip() is None
        content = {name.removeprefix("specimen/"): archive.read(name) for name in archive.namelist()}
    wanted = of_command_line("triangle")
    assert set(content) == set(wanted) | {"specimen_full.dat"}
    for name in wanted:
        if not name.endswith((".svg", ".json")):
            assert content[name] == wanted[name], name
    assert json.loads(content["specimen.json"]) == json.loads(wanted["specimen.json"])


@pytest.mark.slow
def test_the_command_line_on_the_page_makes_the_same_files(open_page, launch_once, tmp_path):
    page = open_page()
    page.change(lambda: page.tab.check("#shape-ellipse"))
    page.change(lambda: page.fill("#l_over_d-exact", 1.85))
    page.change(lambda: page.fill("[data-cell='3-1']", "55.5"))
    page.tab.click("#output")
    (tmp_path / "grading.txt").write_bytes(saved(page, "grading.txt"))
    words = page.text("#command").split()
    assert words[:3] == ["hpcdem", "grade", "grading.txt"]
    launch_once([sys.executable, str(BIN / words[0]), *words[1:]], cwd=tmp_path)
    for name in ("specimen.dat", "specimen.clumps", "grading.csv", "biaxial.py"):
        assert saved(page, name) == (tmp_path / "specimen" / name).read_bytes(), name


def test_the_dialog_closes_by_key_and_button_and_gives_the_focus_back(open_page):
    page = open_page()
    for close in (lambda: page.tab.keyboard.press("Escape"), lambda: page.tab.click("#close")):
        page.tab.focus("#output")
        page.tab.keyboard.press("Enter")
        assert page.tab.is_visible("#files")
        close()
        assert not page.tab.is_visible("#files")
        assert page.tab.evaluate("document.activeElement.id") == "output"


# -- the end, and time --------------------------------------------------------------------------------------------


def test_a_server_that_has_ended_is_reported(open_page, serve_page, grading_file):
    served = serve_page(grading_file)
    page = open_page(url=served.url)
    picture = page.pixels()
    served.process.terminate()
    served.process.wait(PATIENCE)
    page.fill("#seed", 2)
    page.tab.wait_for_selector("#error:not([hidden])")
    assert page.text("#error").startswith("The server does not respond. Has hpcdem ended?")
    assert page.tab.is_visible("#stale") and differing(page.pixels(), picture) < ALIKE


@pytest.mark.alone
@pytest.mark.parametrize("shape", ["circle", "pentagon"])
def test_four_thousand_grains_are_redrawn_in_a_moment(open_page, shape, record_property):
    """Well under a second on a machine of two cores that does nothing else; on any machine not much longer for a grain
    than with a tenth of them, which work that grows with their square would be."""
    page = open_page()
    page.change(lambda: page.tab.check(f"#shape-{shape}"))
    took = {}
    for number in (400, 4000):
        page.change(lambda: page.fill("#number-exact", number))  # noqa: B023
        took[number] = []
        for seed in range(2, 7):
            took[number].append(page.tab.evaluate(REDRAW, seed))
            page.rest()
    record_property("milliseconds", took)
    print(f"{shape}: redrawn after {took} ms")
    assert min(took[4000]) < 30 * min(took[400])


REDRAW = """(seed) => new Promise((done) => {
    const began = performance.now(), root = document.documentElement, before = root.dataset.drawn;
    new MutationObserver((_, watch) => {
        if (root.dataset.drawn === before) return;
        watch.disconnect();
        done(Math.round(performance.now() - began));
    }).observe(root, { attributes: true });
    const field = document.querySelector('#seed');
    field.value = seed;
    field.dispatchEvent(new Event('input'));
})"""
"""Milliseconds from a change of the seed to the end of the drawing."""
