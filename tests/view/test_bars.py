"""Bars of colours: the unit that people use for the size of the values, at least five round numbers, and a range that a
single value does not stretch; the same in figures and on the page."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core import units
from hpcdem.io.axes import View, bar_ticks
from hpcdem.page.sources import Sources
from hpcdem.page.viewer import Viewer
from hpcdem.post import charts
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import POLYGONS, Moment, Objects, read_moment
from hpcdem.post.view.paper import figure_of
from hpcdem.post.view.scene import STEPS, Scale, scene, shared
from tests.tables import each
from tests.view import frames

SHOWN = {"camera": (0.0, 3.0, 0.0, 3.0)}


def scale(low: float, high: float, unit: str, log: bool = False) -> Scale:
    return Scale("a", unit, low, high, log, "viridis")


@pytest.mark.parametrize(
    ("low", "high", "unit", "title", "texts"),
    [
        (0.0, 200e6, "Pa", "a (MPa)", ["0", "50", "100", "150", "200"]),
        (-1e7, 0.0, "Pa", "a (MPa)", ["-10", "-8", "-6", "-4", "-2", "0"]),
        (-2.5e10, 1e9, "Pa", "a (GPa)", ["-25", "-20", "-15", "-10", "-5", "0"]),
        (0.0, 3.3e-6, "m", "a (µm)", ["0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]),
        (0.0, 1.2e4, "m", "a (km)", ["0", "2", "4", "6", "8", "10", "12"]),
        (100_001.0, 100_002.0, "Pa", "a (kPa)", [f"100.00{n}" for n in range(10, 21, 2)]),
        (20.0, 300.0, "K", "a (°C)", ["50", "100", "150", "200", "250", "300"]),
        (300.0, 310.0, "K", "a (K)", ["300", "302", "304", "306", "308", "310"]),
        (0.0, 4e-5, "", "a (10⁻⁶)", ["0", "10", "20", "30", "40"]),
        (0.0, 1.0, "", "a", ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
        (2600.0, 2700.0, "kg/m3", "a (kg/m³)", ["2600", "2620", "2640", "2660", "2680", "2700"]),
        (0.0, 2.5e-3, "m/s", "a (mm/s)", ["0", "0.5", "1.0", "1.5", "2.0", "2.5"]),
    ],
)  # fmt: skip
def test_numbers_of_a_bar(low: float, high: float, unit: str, title: str, texts: list[str]):
    bar = scale(low, high, unit)
    assert bar.title == title
    assert [text for _, text in bar.ticks()] == [text if float(text) else "0" for text in texts]
    size = bar.unit[0]
    for place, text in bar.ticks():
        assert low + place * (high - low) == pytest.approx(float(text) * size, abs=1e-6 * (high - low))


@each("seed", range(50))
def test_any_bar_has_five_numbers_at_least_and_a_dozen_at_most(seed: int):
    rng = np.random.default_rng(seed)
    low = float(rng.choice([-1.0, 0.0, 1.0]) * 10.0 ** rng.uniform(-9, 12))
    span = 10.0 ** rng.uniform(-3, 3) * (abs(low) or 1.0)
    for log in (False, True):
        ticks = bar_ticks(abs(low) + span * 1e-3 if log else low, abs(low) + span if log else low + span, log)
        assert 5 <= len(ticks) <= 24 and len({text for _, text in ticks}) == len(ticks)
        assert not log or all("e" not in text for _, text in ticks)


def test_logarithms_have_powers_of_ten():
    assert [text for _, text in scale(1e-5, 1e-1, "", True).ticks()] == ["10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1"]
    assert units.power_of_ten(2e8) == "2·10⁸"
    assert [place for place, _ in scale(1e3, 1e7, "Pa", True).ticks()] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])


def test_lengths_of_axes():
    names = [View(0.0, side, 0.0, 0.5 * side).unit for side in (2e4, 50.0, 0.3, 0.02, 4e-4)]
    assert names == [(1e3, "km"), (1.0, "m"), (0.01, "cm"), (1e-3, "mm"), (1e-6, "µm")]


# ---- ranges ----------------------------------------------------------------------------------------------------------


def strip(values: np.ndarray) -> Moment:
    """A row of triangles with these values."""
    k = np.arange(len(values))
    points = np.concatenate([np.column_stack([k, 0.0 * k]), np.column_stack([k + 0.5, 0.0 * k + 1.0])])
    cells = np.column_stack([k, (k + 1) % len(k), k + len(k), np.full(len(k), -1)])
    fields = {"stress": np.asarray(values)}
    return Moment(0, 0.0, {"elements": Objects(POLYGONS, len(k), lambda: (points, cells), fields)})


def bar_of(values: np.ndarray, **looks: Any) -> Scale:
    layer = scene(strip(values), ModelView(layers=(Layer(object="elements", field="stress", **looks),))).layers[0]
    assert layer.scale is not None
    return layer.scale


def test_one_value_does_not_take_all_colours():
    """Of 1001 values from -1 to 0 MPa the hundredths at both ends lie beyond; full: all of them are within."""
    values = -1e3 * np.arange(1001.0)
    values[7] = -1e12
    bar = bar_of(values)
    assert (bar.low, bar.high, bar.below, bar.above) == (-991e3, -11e3, True, True)
    assert bar.title == "stress (kPa)"
    assert not bar_of(values, log=True, limits=(1e3, 1e6)).below  # they are grey
    assert bar_of(-values, log=True, limits=(1e4, 1e6)).below
    full = bar_of(values, limits="full")
    assert (full.low, full.high, full.below, full.above) == (-1e12, 0.0, False, False)
    given = bar_of(values, limits=(-2e6, -5e5))
    assert (given.low, given.high, given.below, given.above) == (-2e6, -5e5, True, True)


def test_few_values_whole_numbers_and_what_most_have_not():
    few = bar_of(np.array([1.0, 2.0, 50.0]))
    assert (few.low, few.high, few.below, few.above) == (1.0, 50.0, False, False)
    counted = np.zeros(1000, int)
    counted[3] = 9
    assert (bar_of(counted).low, bar_of(counted).high) == (0.0, 9.0)
    strained = np.zeros(10_000)
    strained[:50] = np.linspace(0.01, 0.02, 50)
    assert (bar_of(strained).low, bar_of(strained).high) == (0.0, 0.02)
    classes = np.ones(10_000)
    classes[:5] = 3.0  # states of joints: 3 is broken
    assert (bar_of(classes).low, bar_of(classes).high) == (1.0, 3.0)


def test_one_value_everywhere_stands_in_the_middle():
    layer = scene(strip(np.full(9, -2e6)), ModelView(layers=(Layer(object="elements", field="stress"),))).layers[0]
    assert set(layer.kind.tolist()) == {STEPS // 2} and layer.scale is not None
    assert (0.5, -2.0) in [(round(place, 9), float(text)) for place, text in layer.scale.ticks()]


def test_many_frames_share_a_range():
    view = ModelView(layers=(Layer(object="elements", field="stress"),))
    moments = [strip(np.linspace(0.0, top, 1001)) for top in (1.0, 4.0)]
    assert shared(view, moments).layers[0].limits == (pytest.approx(0.01), pytest.approx(3.96))
    full = view.with_layer("elements", limits="full")
    assert shared(full, moments).layers[0].limits == (0.0, 4.0)
    assert shared(view, [strip(np.ones(9))] * 2).layers[0].limits is None


# ---- the same everywhere ---------------------------------------------------------------------------------------------


def test_the_page_and_a_figure_have_the_same_bar(tmp_path: Path):
    path = frames.write_blocks(tmp_path)
    view = ModelView(layers=(Layer(object="elements", field="stress_yy", limits=(-9e6, 0.0)),), **SHOWN)
    shown = scene(read_moment(path), view)
    figure = figure_of(shown)
    figure.canvas.draw()
    bar = figure.axes[1]
    assert [text.get_text() for text in bar.get_yticklabels()] == ["-8", "-6", "-4", "-2", "0"]
    assert bar.get_ylabel() == "stress yy (MPa)"
    assert not any(text.get_text() for text in (bar.yaxis.get_offset_text(), bar.xaxis.get_offset_text()))
    assert figure.axes[0].get_xlabel() == "x (m)" and figure.axes[0].get_ylabel() == "y (m)"
    viewer = Viewer(Sources([path]))
    wanted = {"view": view.model_dump(), "width": 60, "height": 60}
    legend = told(viewer, wanted)
    assert [text for _, text in legend["ticks"]] == ["-8", "-6", "-4", "-2", "0"]
    assert (legend["title"], legend["unit"], legend["below"], legend["above"]) == (
        "stress yy (MPa)", [1e6, "MPa"], True, False,
    )  # fmt: skip
    assert [row[2] for row in viewer.about({})["lengths"]] == ["km", "m", "cm", "mm", "µm"]


def told(viewer: Viewer, wanted: dict[str, Any]) -> dict[str, Any]:
    """The first part of the legend that comes with a picture."""
    import json

    content = viewer.picture(wanted).body
    size = int.from_bytes(content[:4], "little")
    return json.loads(content[4 : 4 + size])["legend"][0]


def test_ends_of_the_bar_are_pointed_where_values_lie_beyond():
    values = np.linspace(0.0, 1.0, 1001)
    pictures = {}
    for limits in (None, "full"):
        view = ModelView(layers=(Layer(object="elements", field="stress", limits=limits),), camera=(0.0, 3.0, 0.0, 3.0))
        figure = figure_of(replace(scene(strip(values), view)))
        pictures[limits] = len(figure.axes[1].patches) + sum(
            type(one).__name__ == "PathPatch" for one in figure.axes[1].get_children()
        )
    assert pictures[None] > pictures["full"]


@pytest.mark.parametrize(
    ("label", "values", "size", "said"),
    [
        ("stress [Pa]", (0.0, 3e7), 1e6, "stress [MPa]"), ("load (N/m)", (-2e5, 1e3), 1e3, "load (kN/m)"),
        ("time [s]", (0.0, 5e-4), 1e-6, "time [µs]"), ("strain", (0.0, 2e-6), 1e-6, "strain (10⁻⁶)"),
        ("strain (%)", (0.0, 0.4), 1.0, "strain (%)"), ("axial stress (MPa)", (0.0, 45.0), 1.0, "axial stress (MPa)"),
        ("pressure (bar)", (0.0, 3e8), 1e6, "pressure (10⁶ bar)"), ("", (0.0, 1.0), 1.0, ""),
    ],
)  # fmt: skip
def test_axes_of_charts_have_units_by_size_and_no_offset(label: str, values: Any, size: float, said: str):
    assert charts._axis(label, np.array(values)) == (pytest.approx(size), said)


def test_a_chart_is_drawn_without_powers_beside_its_axes(tmp_path: Path):
    charts.draw(tmp_path / "a.svg", "svg", "", "strain (%)", "stress [Pa]", [("a", "line", [(0.0, 0.0), (1.0, 4e8)])])
    text = (tmp_path / "a.svg").read_text()
    assert "stress [MPa]" in text and ">400<" in text and "1e" not in "".join(re.findall(r">([^<>]+)</text>", text))


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize(
    ("low", "high"),
    [(-1e308, 1e308), (0.0, 5e-324), (5e-324, 1e308), (1e308, 1.7e308), (1.0, 1.0 + 2.3e-16), (1e-300, 2e-300)],
)
def test_bars_of_any_numbers_that_can_be(low: float, high: float, log: bool):
    if log and low <= 0.0:
        return
    for unit in ("Pa", "m", "K", "", "W/(m K)"):
        bar = scale(low, high, unit, log)
        ticks = bar.ticks()
        assert len(ticks) >= 2 and all(0.0 <= place <= 1.0 for place, _ in ticks) and bar.title
