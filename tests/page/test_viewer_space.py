"""`hpcdem view` of bodies in space, in a real browser: turned, cut, asked, saved."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.physics.fdem import tetrahedra
from hpcdem.post.view.model import read_view
from hpcdem.post.view.moment import read_moment
from tests.page.test_viewer import enter, same
from tests.page.viewing import Tab, Viewing
from tests.view import frames


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("body")
    for step, grown in ((0, 0.2), (10, 0.0)):
        frames.write_body(path, step, grown=grown)
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


def look_from(page: Tab, eye: str) -> np.ndarray:
    return page.after(lambda: page.tab.select_option("#eye", eye))


def test_it_is_turned_moved_cut_and_put_back(page: Tab):
    first = page.pixels()
    assert page.tab.input_value("#eye") == "iso" and len(np.unique(first.reshape(-1, 3), axis=0)) > 20

    def drag() -> None:
        page.tab.mouse.move(*page.place(0.5, 0.5))
        page.tab.mouse.down()
        page.tab.mouse.move(*page.place(0.6, 0.45), steps=4)
        page.tab.mouse.up()

    turned = page.after(drag)
    assert not same(first, turned) and page.tab.input_value("#eye").count(",") == 2
    page.tab.keyboard.down("Shift")
    moved = page.after(drag)
    page.tab.keyboard.up("Shift")
    assert not same(turned, moved)
    assert same(first, look_from(page, "iso"))
    page.tab.locator("#windows canvas").first.focus()
    for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowLeft", "Shift+ArrowDown"):
        before = page.pixels()
        assert not same(before, page.after(lambda: page.tab.keyboard.press(key))), key  # noqa: B023
    assert same(first, look_from(page, "iso"))
    cut = page.after(lambda: enter(page, "#section", "x<2.3"))
    assert not same(first, cut)
    assert same(first, page.after(lambda: enter(page, "#section", "")))
    enter(page, "#section", "q")
    page.tab.wait_for_selector("#message.bad")
    assert page.text("#message").startswith("view: section: expected x=1.5") and same(first, page.pixels())


def test_a_slice_and_the_slider_of_the_section(page: Tab):
    first = look_from(page, "-y")
    half = page.after(lambda: page.tab.select_option("#cut-axis", "x"))
    assert page.tab.input_value("#section") == "x=2" and not same(first, half)
    cut = look_from(page, "+x")
    alone = page.after(lambda: page.tab.check("#slice"))
    assert page.tab.input_value("#section") == "slice x=2" and same(cut, alone)  # from there the cut hides the rest
    thin = look_from(page, "-y")
    assert (thin != 255).any(axis=2).sum() < 0.02 * (first != 255).any(axis=2).sum()  # seen along its plane
    page.after(lambda: page.tab.locator("#cut").fill("3"))
    assert page.tab.input_value("#section") == "slice x=3"
    assert same(first, page.after(lambda: page.tab.select_option("#cut-axis", index=0)))
    assert page.tab.input_value("#section") == ""


def test_a_distance_in_space(page: Tab, folder: Path):
    """Between two places on the body, of which one is nearer to the eye; beside the body that in the picture."""
    page.tab.keyboard.press("d")
    places = []
    for u, v in ((0.45, 0.65), (0.6, 0.45)):
        with page.tab.expect_response("**/pick") as told:
            page.tab.mouse.click(*page.place(u, v))
        places.append(np.array(told.value.json()["point"]))
    page.tab.wait_for_function("() => document.querySelector('#message').textContent.includes('Δz')")
    assert float(page.text("#message").split()[0]) == pytest.approx(np.linalg.norm(places[1] - places[0]), rel=1e-4)
    points = read_moment(folder / "body_0000000010.vtkhdf").of("elements").read()[0]
    right, top = points[:, 0].max(), points[:, 2].max()
    for x, y, z in places:  # on the right, the front or the top
        assert min(abs(x - right), abs(y), abs(z - top)) < 0.02
    for u in (0.02, 0.03):
        page.tab.mouse.click(*page.place(u, 0.02))
    page.tab.wait_for_function("() => document.querySelector('#message').textContent.includes('plane')")


def test_a_query_shows_the_element_behind_the_pixel(page: Tab, folder: Path):
    """Cut at y = 1.6 and seen from the front, the place (x, z) of the plane is under the mouse."""
    look_from(page, "-y")
    page.after(lambda: enter(page, "#section", "y=1.6"))
    page.tab.keyboard.press("q")
    told = []
    for u, v in ((0.2, 0.2), (0.8, 0.8)):
        page.tab.mouse.move(*page.place(u, v))
        words = page.text("#place").split()
        told.append((float(words[1]), float(words[3])))
    (x0, z0), (x1, z1) = told
    points, cells, _ = read_moment(folder / "body_0000000010.vtkhdf").of("elements").read()
    for x, z in ((0.62, 0.37), (3.37, 1.21)):
        element = tetrahedra.nearest_element(points, cells, (x, 1.6001, z), np.arange(len(cells)))
        page.tab.mouse.click(*page.place(0.2 + 0.6 * (x - x0) / (x1 - x0), 0.2 + 0.6 * (z - z0) / (z1 - z0)))
        page.tab.wait_for_function(
            "n => document.querySelector('#answer-title').textContent === n", arg=f"elements {element}"
        )
        rows = dict(line.split("\t") for line in page.text("#values").splitlines())
        assert rows["stress_zz"] == f"{-(element + 1)} MPa"
        middle = points[cells[element]].mean(axis=0)
        assert [float(rows[axis].split()[0]) for axis in "xyz"] == pytest.approx(middle.tolist(), abs=1e-5)
    page.tab.mouse.click(*page.place(0.02, 0.02))
    page.tab.wait_for_selector("#answer[hidden]", state="attached")


def test_files_of_a_body(page: Tab, folder: Path, tmp_path: Path):
    from PIL import Image

    look_from(page, "+x")
    page.after(lambda: enter(page, "#section", "z<1.5"))
    page.tab.click("li[data-layer=elements]")
    files = {kind: page.saved(kind, tmp_path) for kind in ("png", "csv", "mv", "dxf")}
    with Image.open(files["png"]) as opened:
        assert opened.size[0] > 1000
    with open(files["csv"], encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 144 and {"x", "y", "z", "displacement_z", "stress_mises"} <= rows[0].keys()
    view = read_view(files["mv"])
    assert (view.eye, view.section) == ("+x", "z<1.5")
    text = files["dxf"].read_text()
    assert text.count("3DFACE") > 100 and "\n1.5\n" in text  # the plane in space


def test_what_is_typed_is_there_however_long_it_takes(page: Tab):
    """The page looks at the folder meanwhile, and shows anew what holds."""
    first = page.pixels()
    section = page.tab.locator("#section")
    section.press_sequentially("x<2.3", delay=400)
    assert page.tab.input_value("#section") == "x<2.3"
    assert not same(first, page.after(lambda: section.press("Enter")))


def test_frames_follow_each_other(page: Tab):
    before = page.pixels()
    assert page.text("#moment") == "step 10, 10 ms"
    assert not same(before, page.after(lambda: page.tab.keyboard.press(",")))
    assert page.text("#moment") == "step 0, 0 s"
