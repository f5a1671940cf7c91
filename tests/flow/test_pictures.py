"""Fluid in pictures and tables: what is coloured, profiles along a line, what `hpcdem measure fluid` says."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames, summary
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.io.axes import View
from hpcdem.physics.fdem.groups import Span
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.network import path
from hpcdem.post import blocks, charts, fluid
from hpcdem.post.measure import report
from hpcdem.post.measure.scene import Request
from tests.flow.support import WATER
from tests.pcdc.fake import Bench

ROCK = {"density": 2500.0, "young": 50e9, "poisson_ratio": 0.25}
MIDDLE = (Span(1, 1.0, 1.0),)


class Quiet:
    """A log that keeps lines."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    info = warn = lambda self, line: self.lines.append(line)


def strip(tmp_path: Path) -> fdem.Project:
    """8 x 2 m with a channel along the middle: water comes in on the left and has filled half of it."""
    model = fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "out")
    fdem.meshes.grid(model, (0.0, 0.0), (8.0, 2.0), (8, 2))
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)
    fdem.flow.model(model, {**WATER, "aperature_initial": 1e-4}, where=MIDDLE)
    fdem.settings.option(model, mechanical=False)
    fdem.flow.initial(model, pressure=1e6, where=(Span(0, 0.0, 0.0), *MIDDLE))
    fdem.flow.initial(model, pressure=5e5, where=(Span(0, 1.0, 4.0), *MIDDLE))
    return model


def coloured(figure: Any) -> list[np.ndarray]:
    """The arrays of the coloured lines of a figure with one panel."""
    return [c.get_array() for c in figure.axes[0].collections if c.get_array() is not None]


def test_channels_are_coloured_by_what_is_in_them(tmp_path: Path) -> None:
    state = frames.whole(strip(tmp_path))
    assert fluid.there(state) and blocks.panels_of(state) == ("cracks", "stress", "pressure")
    joints = state.of_joints
    wet = np.isfinite(joints["aperture"]) & (joints["saturation"] >= 0.5)
    assert np.isfinite(joints["aperture"]).sum() == 8 and wet.sum() == 5  # one is filled by half
    for word, column, unit in (("pressure", "fluid_pressure", 1e3), ("aperture", "aperture", 1e-6),
                               ("saturation", "saturation", 1.0), ("velocity", "fluid_velocity", None)):  # fmt: skip
        (found,) = coloured(blocks.draw(state, blocks.Appearance((word,))))
        shown = fluid.PICTURES[word]
        expected = np.abs(joints[column][wet if not shown.dry else np.isfinite(joints["aperture"])])
        unit = blocks.unit_of(shown, shown.range(state), state)[0] if unit is None else unit
        assert np.sort(np.asarray(found)) == pytest.approx(np.sort(expected / unit)), word
    assert (
        len(set(np.round(coloured(blocks.draw(state, blocks.Appearance(("pressure",))))[0]))) == 3
    )  # 750, 500, 250 kPa
    dry = frames.whole(_without(tmp_path))
    assert not fluid.there(dry) and blocks.panels_of(dry) == ("cracks", "stress")
    assert not coloured(blocks.draw(dry, blocks.Appearance(("pressure",))))


def _without(tmp_path: Path) -> fdem.Project:
    model = fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "dry")
    fdem.meshes.grid(model, (0.0, 0.0), (8.0, 2.0), (8, 2))
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)
    return model


def test_wide_channels_are_wide_lines(tmp_path: Path) -> None:
    model = strip(tmp_path)
    state = frames.whole(model)
    rows = np.flatnonzero(np.isfinite(state.of_joints["aperture"]))
    state.of_joints["aperture"][rows[:4]] = 2e-4
    figure = blocks.draw(state, blocks.Appearance(("aperture",)))
    (lines,) = [c for c in figure.axes[0].collections if c.get_array() is not None]
    wide = np.asarray(lines.get_linewidths())[np.argsort(lines.get_array(), kind="stable")]
    assert wide[-1] == pytest.approx(2.0 * wide[0]) and len(wide) == 8


def test_the_last_figure_shows_the_pressure(tmp_path: Path) -> None:
    from PIL import Image

    wet, dry = (np.asarray(Image.open(summary.last_figure(make(tmp_path)))).shape for make in (strip, _without))
    assert wet[0] > 1.3 * dry[0]  # one more panel below


def test_a_line_of_channels_has_an_order() -> None:
    order, points = path(np.array([[5, 7], [2, 5], [7, 3]]))
    assert order.tolist() == [1, 0, 2] and points.tolist() == [2, 5, 7, 3]
    assert path(np.array([[0, 1], [1, 2], [1, 3]])) is None  # branches
    assert path(np.array([[0, 1], [1, 2], [2, 0]])) is None  # closed
    assert path(np.array([[0, 1], [2, 3]])) is None  # two
    assert path(np.array([[0, 1], [2, 3], [3, 4], [4, 2]])) is None  # a line and a ring


def test_profiles_along_a_fracture(tmp_path: Path) -> None:
    model = strip(tmp_path)
    fdem.charts.create(model, "p")
    fdem.charts.add(model, "p", profile="pressure", where=MIDDLE, scale_y=1e-6)
    fdem.charts.add(model, "p", profile="aperture", where=MIDDLE, scale_y=1e6, label="open")
    first, second = model.charts["p"].curves
    assert np.array(first.points) == pytest.approx(
        np.column_stack([np.arange(9.0), [1.0, 0.5, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0]])
    )
    assert np.array(second.points) == pytest.approx(np.column_stack([np.arange(8) + 0.5, np.full(8, 100.0)]))
    assert (first.label, second.label) == ("pressure", "open")
    fdem.charts.export(model, "p", "p.png", fluid="pressure")
    rows = list(csv.reader((tmp_path / "out" / "p.csv").open()))
    assert len(rows) == 1 + 9 + 8 and rows[1][:2] == ["pressure", "0.0"]
    assert float(rows[1][2]) == pytest.approx(1.0)
    with pytest.raises(CommandError, match=r"needs one line with two ends; the \d+ channels"):
        fdem.flow.model(model, {**WATER, "aperature_initial": 1e-4})
        fdem.charts.add(model, "p", profile="pressure")
    with pytest.raises(CommandError, match="give only one of cracks"):
        fdem.charts.export(model, "p", "p.png", cracks=True, fluid="pressure")


def test_a_diagram_beside_the_fluid_is_another_picture(tmp_path: Path) -> None:
    from PIL import Image

    model = strip(tmp_path)
    state, curve = frames.whole(model), [("a", "line", [(0.0, 0.0), (1.0, 1.0)])]
    pictures = []
    for beside in ("cracks", "pressure", "aperture"):
        charts.draw(tmp_path / f"{beside}.png", "png", "", "x", "y", curve, state, beside)
        pictures.append(np.asarray(Image.open(tmp_path / f"{beside}.png")))
    assert not any(np.array_equal(one, other) for one, other in pairwise(pictures))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("chart add 'c' profile pressure values (0,0)", "either y, the name of a history, or values or profile"),
        ("chart add 'c' profile pressure x 'a'", "x applies to histories, not to profile"),
        ("chart add 'c' values (0,0) range x 0 1", "range applies to profile"),
        ("chart add 'c' profile colour", "expected one of pressure, saturation, aperture"),
        ("chart export 'c' 'c.png' fluid colour", "expected one of pressure, saturation, aperture, velocity"),
    ],
)
def test_what_no_curve_is(tmp_path: Path, line: str, said: str) -> None:
    with pytest.raises(HpcdemError, match=said):
        Bench(tmp_path)(f"pcdc model new\npcdc {line}\n")


def test_measured_fluid(tmp_path: Path) -> None:
    model = strip(tmp_path)
    frames.vtk(model, "flow")
    frames.settle(model)
    fdem.flow.condition(model, pressure=1e6, where=(Span(0, 0.0, 0.0), *MIDDLE))
    fdem.steps.step(model, 40)
    frames.vtk(model, "flow")
    frames.settle(model)
    report.run(SerialComm(), Quiet(), Request(tmp_path / "out", ("fluid",)))
    target = tmp_path / "out" / "measure"
    first, last = csv.DictReader((target / "fluid.csv").open())
    assert first["channels"] == "8" and first["wet"] == "5" and float(first["wet_length[m]"]) == pytest.approx(5.0)
    # 4 m are full, and half of the metre before the water.
    assert float(first["volume[m3/m]"]) == pytest.approx(4.5e-4) and float(first["open_wet_length[m]"]) == 0.0
    assert float(first["pressure[Pa]"]) == pytest.approx(7.5e5) and float(first["aperture[m]"]) == pytest.approx(1e-4)
    assert float(last["volume[m3/m]"]) > 4.5e-4 and float(last["velocity[m/s]"]) > 0.0
    each = list(csv.DictReader((target / "fluid_last.csv").open()))
    assert len(each) == 8 and [float(row["x[m]"]) for row in each] == sorted(float(row["x[m]"]) for row in each)
    assert (target / "fluid.png").stat().st_size > 1000
    frames.vtk(_without(tmp_path), "flow")
    frames.settle(_without(tmp_path))
    with pytest.raises(HpcdemError, match="have no channels"):
        report.run(SerialComm(), Quiet(), Request(tmp_path / "dry", ("fluid",)))


def test_a_film_has_one_range_of_pressure(tmp_path: Path) -> None:
    from hpcdem.cli.movie import PANELS_SHOWN

    state = frames.whole(strip(tmp_path))
    appearance = blocks.Appearance(("pressure",), ranges={"pressure": (0.0, 3e6)})
    figure = blocks.draw(state, appearance, View(0.0, 8.0, 0.0, 2.0))
    (lines,) = [c for c in figure.axes[0].collections if c.get_array() is not None]
    assert lines.norm.vmax == pytest.approx(3.0)
    assert set(fluid.PICTURES) <= set(PANELS_SHOWN)
