"""Figures of frames."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.io import colours
from hpcdem.post import raster
from hpcdem.post.layers import LAYERS
from hpcdem.post.plots import Style, frame_figure, plot_frame
from tests.unit.io_synthetic import make_frame

pytestmark = pytest.mark.figures


def test_particles_are_drawn_where_they_are_in_true_size_and_colour(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    frame = make_frame(80)
    frame.tables["particles"].columns["radius"] *= 0.5  # apart from each other
    plot_frame(frame, tmp_path / "a.png", dpi=300)
    picture = np.asarray(image.open(tmp_path / "a.png").convert("RGB")) / 255.0
    figure = frame_figure(frame)
    figure.set_dpi(300)
    columns = frame.tables["particles"].columns
    places = figure.axes[0].transData.transform(np.stack([columns["x"], columns["y"]], axis=1))
    scale = figure.axes[0].transData.transform([[1.0, 0.0], [0.0, 0.0]])
    for (u, v), radius, color in zip(places, columns["radius"] * (scale[0] - scale[1])[0], columns["color"]):
        shade = colours.RGB[color]
        row = picture[picture.shape[0] - 1 - int(v)]
        assert np.abs(row[int(u)] - shade).max() < 0.01
        inside = np.abs(row - shade).max(axis=-1) < 0.01
        width = 1 + next(k for k in range(99) if not inside[int(u) + k + 1])
        assert abs(width - radius) < 2.0  # pixels from the centre to the edge


@pytest.mark.parametrize("suffix", ["jpg", "png", "pdf", "svg"])
def test_the_same_frame_gives_the_same_file(tmp_path: Path, suffix: str) -> None:
    frame = make_frame(30)
    a, b = (plot_frame(frame, tmp_path / f"{k}.{suffix}") for k in "ab")
    assert a.read_bytes() == b.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == [a.name, b.name]


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "km"), (0.01, "m"), (1e-5, "cm"), (1e-6, "mm")])
def test_axes_are_labelled_in_the_unit_that_fits(scale: float, unit: str) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = frame_figure(make_frame(30, scale=scale))
    ax = figure.axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (f"x ({unit})", f"y ({unit})")
    # Everything is on the page and legible: labels of nine points, none cut off.
    FigureCanvasAgg(figure).draw()
    page = figure.bbox
    for text in (*ax.get_xticklabels(), *ax.get_yticklabels(), ax.xaxis.label, ax.yaxis.label):
        box = text.get_window_extent()
        assert text.get_fontsize() == 9.0
        assert page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1, text
    width, height = figure.get_size_inches()
    assert width == pytest.approx(17.0 / 2.54)
    assert height < 0.4 * width  # a wide model makes a wide figure


def test_a_tall_model_stays_on_the_page() -> None:
    frame = make_frame(30)
    frame.settings["height"] = 200000.0
    width, height = frame_figure(frame).get_size_inches()
    assert height == pytest.approx(22.0 / 2.54) and width < height


def test_a_frame_of_nothing_can_be_drawn(tmp_path: Path) -> None:
    frame = make_frame(1)
    table = frame.tables["particles"]
    table.columns = {k: v[:0] for k, v in table.columns.items()}
    frame.walls = {k: v[:0] for k, v in frame.walls.items()}
    frame.settings = {}
    plot_frame(frame, tmp_path / "a.png", dpi=50)


def test_errors_are_explained(tmp_path: Path) -> None:
    with pytest.raises(HpcdemError, match=r"pictures end in \.jpg"):
        plot_frame(make_frame(1), tmp_path / "a.bmp")
    with pytest.raises(HpcdemError, match="the folder does not exist"):
        plot_frame(make_frame(1), tmp_path / "none" / "a.png")


def test_a_picture_too_large_for_its_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(HpcdemError, match=r"\d+ x \d+ pixels, at most 65535 along a side and 250 million in all"):
        plot_frame(make_frame(1), tmp_path / "a.jpg", dpi=20000)


# --- discs as pixels ---------------------------------------------------------------------------------------------


def painted(x, y, radius, kind=None, width: int = 60, height: int = 40, line: float = 0.0) -> np.ndarray:
    """Red and blue discs as fractions (height, width, 4), row 0 at the bottom."""
    x, y, radius = (np.atleast_1d(np.asarray(v, float)) for v in (x, y, radius))
    kind = np.zeros(len(x), int) if kind is None else np.asarray(kind)
    shades = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return raster.discs(x, y, radius, shades, kind, width, height, line) / 255.0


@pytest.mark.parametrize("radius", [0.3, 0.5, 0.7, 1.0, 1.7, 4.0, 15.0])
def test_a_disc_covers_its_area_about_its_centre(radius: float) -> None:
    random = np.random.default_rng(1)
    parts = []
    for x, y in zip(29.0 + random.random(50), 20.0 + random.random(50)):
        cover = painted(x, y, radius)[..., 3]
        parts.append(cover.sum() / (np.pi * radius**2))
        middle = np.array([(cover.sum(0) * (np.arange(60) + 0.5)).sum(), (cover.sum(1) * (np.arange(40) + 0.5)).sum()])
        np.testing.assert_allclose(middle / cover.sum(), [x, y], atol=0.1)
    assert np.mean(parts) == pytest.approx(1.0, abs=0.02)
    assert np.std(parts) < 0.08


def test_a_disc_is_sharp_and_round() -> None:
    picture = painted(30.2, 20.4, 12.0)
    v, u = np.mgrid[:40, :60] + 0.5
    distance = np.hypot(u - 30.2, v - 20.4)
    assert (picture[distance < 11.2] == [1.0, 0.0, 0.0, 1.0]).all()
    assert (picture[distance > 12.8, 3] == 0.0).all()
    edge = (distance > 11.9) & (distance < 12.1)
    assert np.abs(picture[edge, 3] - 0.5).max() < 0.15


def test_discs_that_touch_leave_no_seam_and_overlap_in_equal_parts() -> None:
    picture = painted([20.5, 40.5], [20.0, 20.0], [10.0, 10.0], [0, 1])
    row = picture[19:21].mean(axis=0)
    assert row[28:33, 3].min() > 0.96  # where they touch, in the middle of a pixel
    both = painted([30.0, 30.0], [20.0, 20.0], [10.0, 10.0], [0, 1])[20, 30]
    np.testing.assert_allclose(both, [0.5, 0.0, 0.5, 1.0], atol=0.01)


def test_what_is_off_the_picture_changes_nothing_inside() -> None:
    inside = painted(30.0, 20.0, 5.0)
    around = np.linspace(0.0, 2.0 * np.pi, 12)
    x, y = 30.0 + 90.0 * np.cos(around), 20.0 + 90.0 * np.sin(around)
    np.testing.assert_array_equal(painted([30.0, *x], [20.0, *y], [5.0] + 12 * [8.0]), inside)
    cut = painted([0.0, 30.0], [20.0, 40.0], [6.0, 6.0])[..., 3]
    assert cut.sum() == pytest.approx(np.pi * 36.0, rel=0.02)  # two halves
    huge = painted(30.0, -1000.0, 1020.0)[..., 3]
    assert huge[:19, 25:35].min() == 1.0 and huge[21:, 25:35].max() == 0.0


def test_circles_have_their_line_and_are_empty() -> None:
    picture = painted(30.0, 20.0, 10.0, line=2.0)[..., 3]
    assert picture[20, 30] == 0.0 and picture[20, 39:41].mean() > 0.9
    assert picture.sum() == pytest.approx(2.0 * np.pi * 10.0 * 2.0, rel=0.03)


def test_bitmaps_and_curves_look_alike(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    from hpcdem.post import discs

    frame = make_frame(400)
    plot_frame(frame, tmp_path / "a.png", dpi=200)
    monkeypatch.setattr(discs, "RendererAgg", type(None))  # nothing is a bitmap: draw curves
    plot_frame(frame, tmp_path / "b.png", dpi=200)
    a, b = (np.asarray(image.open(tmp_path / f"{k}.png").convert("RGB")) / 255.0 for k in "ab")
    assert a.shape == b.shape
    assert np.abs(a - b).mean() < 0.01 and 0.0 < np.abs(a - b).max()
    assert abs(a.mean() - b.mean()) < 0.002


# --- the surface -------------------------------------------------------------------------------------------------


def surface_of(frame) -> np.ndarray:
    """The line (m, 2) that the layer draws."""
    (line,) = frame_figure(frame, ("surface",)).axes[0].collections
    return line.get_segments()[0]


def test_the_surface_lies_on_the_discs_and_not_on_what_flies() -> None:
    frame = make_frame(1200)
    c = frame.tables["particles"].columns
    line = surface_of(frame)
    top = (c["y"] + c["radius"]).max()
    assert (np.interp(c["x"], *line.T) >= c["y"] + c["radius"] - 0.02 * c["radius"]).all()
    assert line[:, 1].max() == pytest.approx(top, abs=1.0) and line[:, 1].min() > top - 4.0 * c["radius"].max()
    c["y"][600] += 6000.0  # one particle thrown up
    assert surface_of(frame)[:, 1].max() < top + 1.0


def test_every_layer_is_known_to_the_style() -> None:
    figure = frame_figure(make_frame(40), tuple(LAYERS), Style(title="$ {step}"))
    assert len(figure.axes[0].collections) >= len(LAYERS) - 1 and figure.axes[0].texts[-1].get_text() == "$ 46000"


def test_matplotlib_is_not_imported_before_it_is_used() -> None:
    program = "import sys, hpcdem.post.plots; raise SystemExit('matplotlib' in sys.modules)"
    root = Path(__file__).resolve().parents[2]
    assert subprocess.run([sys.executable, "-c", program], cwd=root, timeout=60, check=False).returncode == 0
