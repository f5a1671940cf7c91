"""Charts of the page: histories over each other, what is computed of them, charts of scripts, files."""

from __future__ import annotations

import base64
import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.page.curves import POINTS, Curves, as_csv
from tests.page.viewing import Tab, Viewing
from tests.view import frames


def write(folder: Path, name: str, title: str, rows: dict[int, float], prefix: str = "history") -> None:
    lines = "".join(f"{step},{1e-3 * step},{value!r}\n" for step, value in rows.items())
    (folder / f"{prefix}_{name}.csv").write_text(f"step,time [s],{title}\n{lines}")


def pressed(folder: Path, steps: range = range(0, 50, 10)) -> None:
    """Two ends that approach each other, as `hpcdem case ucs` records them."""
    write(folder, "force above", "reaction_y [N/m]", {s: -3e4 * s for s in steps})
    write(folder, "force below", "reaction_y [N/m]", {s: 5e4 * s for s in steps})
    write(folder, "displacement bottom", "displacement_y [m]", {s: 1e-6 * s for s in steps})
    write(folder, "displacement top", "displacement_y [m]", {s: -2e-6 * s for s in steps})


def test_any_history_over_any_other_where_both_have_steps(tmp_path: Path):
    write(tmp_path, "a", "stress_yy [Pa]", {0: 1.0, 10: 2.0, 20: 3.0, 30: 4e6})
    write(tmp_path, "b", "displacement_y [m]", {10: 0.1, 30: 0.3, 50: 0.5})
    told = Curves(tmp_path).drawn("'b'", ["'a'"])
    assert told["curves"][0]["x"] == [0.1, 0.3] and told["curves"][0]["y"] == [2.0, 4e6]
    assert told["curves"][0]["step"] == [10, 30]
    assert (told["curves"][0]["size"], told["curves"][0]["shown"]) == (1e6, "MPa")
    assert Curves(tmp_path).drawn("step", ["a", "b"])["curves"][1]["x"] == [10.0, 30.0, 50.0]


def test_what_is_computed_has_a_title_and_a_unit(tmp_path: Path):
    pressed(tmp_path)
    told = Curves(tmp_path).drawn(
        "strain [%] = 100 * ('displacement bottom' - 'displacement top') / 0.1", ["'force below' / 0.05"]
    )
    assert (told["x"]["title"], told["x"]["unit"], told["x"]["size"]) == ("strain", "%", 1.0)
    np.testing.assert_allclose(told["curves"][0]["x"], 100 * 3e-6 * np.arange(0, 50, 10) / 0.1)
    np.testing.assert_allclose(told["curves"][0]["y"], 5e4 * np.arange(0, 50, 10) / 0.05)


def test_an_earlier_name_of_a_history_is_the_present_one(tmp_path: Path):
    """Ready-made models called displacements `way`; a history that has that name itself is meant first."""
    pressed(tmp_path)
    curves = Curves(tmp_path)
    new, old = (curves.drawn("step", [f"2 * '{name} top'", f'"{name} top"']) for name in ("displacement", "way"))
    assert [one["y"] for one in old["curves"]] == [one["y"] for one in new["curves"]]
    write(tmp_path, "way top", "displacement_y [m]", {0: 7.0})
    assert Curves(tmp_path).drawn("step", ["'way top'"])["curves"][0]["y"] == [7.0]


@pytest.mark.parametrize(
    ("x", "y", "said"),
    [
        ("time", ["'none'"], "there is no history 'none'; known: 'displacement bottom', 'displacement top'"),
        ("time", ["2 *"], "expected a history, such as 'displacement bottom'"),
        ("time", ["__import__('displacement top')"], "unknown function __import__"),
        ("'displacement top' < 1", ["'displacement top'"], "expected"),
        ("time", ["'displacement top'" + " " * 10**6], "at most 500 characters"),
        ("time", [], "1 to 12 curves"), ("time", "a", "a list of y"), (3, ["a"], "an x"),
    ],
)  # fmt: skip
def test_what_is_no_chart_is_reported(tmp_path: Path, x: Any, y: Any, said: str):
    pressed(tmp_path)
    with pytest.raises(HpcdemError, match=re.escape(said)):
        Curves(tmp_path).drawn(x, y)


def test_the_loads_of_a_laboratory_are_ready_made(tmp_path: Path):
    """Whichever way the signs are, load and shortening end above 0; a stress over a strain comes before them."""
    pressed(tmp_path)
    curves = Curves(tmp_path)
    (preset,) = curves.presets()
    told = curves.drawn(preset["x"], preset["y"])
    assert told["curves"][0]["y"][-1] == pytest.approx(0.5 * (3e4 + 5e4) * 40) and told["curves"][0]["unit"] == "N/m"
    assert told["curves"][0]["x"][-1] == pytest.approx(3e-6 * 40) and told["x"]["title"] == "shortening"
    write(tmp_path, "1", "ystrain wall 0|3 [1]", {0: 0.0, 10: 1e-3}, "hist")
    write(tmp_path, "2", "ystress wall 3 [Pa]", {0: 0.0, 10: 2e6}, "hist")
    (tmp_path / "ucs.csv").write_text("curve,axial strain (%),axial stress (MPa)\nspecimen,0.0,1.0\n")
    (tmp_path / "any.csv").write_text("curve,x,y\na,0.0,1.0\n")
    first, *others = curves.presets()
    assert [(one["kind"], one.get("chart")) for one in others] == [
        ("stress_strain", "ucs.csv"), ("of_script", "any.csv"), ("load_displacement", None),
    ]  # fmt: skip
    assert first == {"kind": "stress_strain", "x": "'1'", "y": ["'2'"]}
    told = curves.drawn(first["x"], first["y"])
    assert told["curves"][0]["y"] == [0.0, 2e6] and told["curves"][0]["title"] == "ystress wall 3", "not its number"


def test_a_line_that_is_being_written_is_left_out(tmp_path: Path):
    pressed(tmp_path)
    path = tmp_path / "history_displacement top.csv"
    path.write_text(path.read_text() + "50,0.0")
    assert Curves(tmp_path).drawn("step", ["'displacement top'"])["curves"][0]["x"] == [0.0, 10.0, 20.0, 30.0, 40.0]


def test_a_history_that_grows_or_begins_anew_is_read_on(tmp_path: Path):
    """Only what is new is read; a file of the same name with something else in it is another."""
    pressed(tmp_path)
    curves, path = Curves(tmp_path), tmp_path / "history_displacement top.csv"

    def steps() -> list[float]:
        return curves.drawn("step", ["'displacement top'"])["curves"][0]["x"]

    assert steps() == [0.0, 10.0, 20.0, 30.0, 40.0]
    with path.open("a") as file:
        file.write("50,0.05,1.0\n60,")
    assert steps()[-2:] == [40.0, 50.0]
    with path.open("a") as file:
        file.write("0.06,2.0\n")
    assert steps()[-2:] == [50.0, 60.0]
    write(tmp_path, "displacement top", "velocity_y [m/s]", {s: 1.0 for s in range(0, 100, 5)})
    assert steps() == list(range(0, 100, 5))
    write(tmp_path, "displacement top", "velocity_y [m/s]", {7: 1.0})
    assert steps() == [7.0] and curves.drawn("step", ["'displacement top'"])["curves"][0]["unit"] == "m/s"


def test_a_long_history_keeps_its_peak(tmp_path: Path):
    values = {s: 0.0 for s in range(20_000)} | {7_777: 9e9, 15_001: -8e9}
    write(tmp_path, "long", "stress_yy [Pa]", values)
    told = Curves(tmp_path).drawn("step", ["'long'"])["curves"][0]
    assert len(told["y"]) <= POINTS and max(told["y"]) == 9e9 and min(told["y"]) == -8e9
    assert len(Curves(tmp_path).drawn("step", ["'long'"], whole=True)["curves"][0]["y"]) == 20_000


def test_a_chart_of_the_script(tmp_path: Path):
    """As `chart export` writes it; saved again it says the same."""
    (tmp_path / "ucs.csv").write_text('curve,axial strain (%),axial stress (MPa)\n"a, b",0.0,1.0\n"a, b",0.5,2.0\n')
    (tmp_path / "other.csv").write_text("x,y\n1,2\n")
    curves = Curves(tmp_path)
    assert curves.charts() == ["ucs.csv"]
    told = curves.chart("ucs.csv")
    assert (told["x"]["title"], told["x"]["shown"], told["x"]["size"]) == ("axial strain", "%", 1.0)
    assert (told["curves"][0]["title"], told["curves"][0]["unit"]) == ("axial stress", "MPa")
    rows = list(csv.reader(io.StringIO(as_csv(told))))
    assert rows == [
        ["curve", "axial strain [%]", "axial stress"], ["axial stress [MPa]", "0.0", "1.0"],
        ["axial stress [MPa]", "0.5", "2.0"],
    ]  # fmt: skip


# ---- in a browser ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def viewing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewing]:
    folder = tmp_path_factory.mktemp("charts")
    for step in (0, 20, 40):
        frames.write_blocks(folder, step)
    pressed(folder)
    write(folder, "cracks", "broken_joints [1]", {s: float(s // 10) for s in range(0, 50, 10)})
    one = Viewing(folder)
    yield one
    one.close()


@pytest.fixture
def page(browser: Any, viewing: Viewing) -> Iterator[Tab]:
    tab = Tab(browser, viewing.url, locale="en-GB", accept_downloads=True)
    yield tab
    tab.context.close()
    assert tab.errors == []


def words(page: Tab, kind: str, where: str = "#chart") -> list[str]:
    return page.tab.locator(f"{where} text[data-{kind}]").all_text_contents()


def test_a_ready_made_chart_is_one_click(page: Tab):
    """Units that people use, ticks on both axes, and a mark at the step of the picture, which moves with it."""
    page.until(lambda: page.tab.is_visible("#chart-ready"))
    assert page.text("#chart-ready") == "load–displacement"
    page.tab.click("#chart-ready")
    page.until(lambda: words(page, "axis") == ["shortening (µm)", "load (MN/m)"])
    assert min(len(words(page, "tick=x")), len(words(page, "tick=y"))) >= 4
    mark = page.tab.locator("#chart circle[data-now]")
    before = float(mark.get_attribute("cx"))
    page.after(lambda: page.tab.click("#first"))
    page.until(lambda: float(mark.get_attribute("cx")) < before)


def test_columns_are_chosen_and_several_curves_have_names(page: Tab):
    page.tab.select_option("#history", "history force above")
    page.tab.click("#chart-columns summary")
    page.tab.check("[data-column=\"'force below'\"]")
    page.until(lambda: words(page, "name") == ["force above", "force below"])
    page.tab.select_option("#chart-x", "'displacement top'")
    page.until(lambda: words(page, "axis")[0] == "displacement top (µm)")
    page.tab.check("[data-column=\"'cracks'\"]")  # another unit has an axis on the right
    page.until(lambda: len(words(page, "axis")) == 3 and words(page, "axis")[2] == "cracks")
    assert page.tab.input_value("#history") == "own"


def test_a_large_chart_its_expressions_and_files(page: Tab, tmp_path: Path):
    page.tab.select_option("#history", "history force below")
    page.until(lambda: page.tab.is_visible("#chart"))
    page.tab.click("#chart")
    assert page.tab.locator("#chart-figure svg").bounding_box()["width"] > 700
    page.tab.fill("#chart-x-text", "strain [%] = 100 * ('displacement bottom' - 'displacement top') / 0.1")
    page.tab.fill("#chart-y-text", "stress [Pa] = 'force below' / 0.05")
    page.tab.press("#chart-x-text", "Enter")
    page.until(lambda: words(page, "axis", "#chart-figure") == ["strain (%)", "stress (MPa)"])
    found = {}
    for kind in ("csv", "png", "svg"):
        with page.tab.expect_download() as waiting:
            page.tab.click(f"#chart-{kind}")
        found[kind] = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(found[kind])
    rows = list(csv.reader(found["csv"].open()))
    assert rows[0] == ["curve", "strain [%]", "y"] and float(rows[-1][2]) == pytest.approx(5e4 * 40 / 0.05)
    assert "stress (MPa)" in found["svg"].read_text() and "var(" not in found["svg"].read_text()
    from PIL import Image

    pixels = np.asarray(Image.open(found["png"]).convert("RGB"))
    assert pixels.shape == (1200, 1920, 3) and (pixels[5, 5] == 255).all() and (pixels != 255).any(-1).mean() > 0.01
    page.tab.fill("#chart-y-text", "'forc'")
    page.tab.press("#chart-x-text", "Enter")
    page.until(lambda: page.text("#chart-said").startswith("there is no history 'forc'"))
    page.tab.click("#chart-close")
    assert not page.tab.is_visible("#chart-dialog")


def test_the_picture_for_the_clipboard_is_the_one_that_is_saved(page: Tab, tmp_path: Path):
    """With axes, bar and title, not only the pixels of the model."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.tab.select_option("#save", "clip")
    page.until(lambda: page.text("#message") == "Copied")
    read = """async () => {
        const [item] = await navigator.clipboard.read(), blob = await item.getType('image/png');
        const bytes = new Uint8Array(await blob.arrayBuffer());
        let text = ''; for (const one of bytes) text += String.fromCharCode(one); return btoa(text); }"""
    from PIL import Image

    copied = np.asarray(Image.open(io.BytesIO(base64.b64decode(page.tab.evaluate(read)))).convert("RGB"))
    saved = np.asarray(Image.open(page.saved("png", tmp_path)).convert("RGB"))
    assert copied.shape == saved.shape and np.array_equal(copied, saved)
