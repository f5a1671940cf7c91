"""Figures of frames."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.io import colours
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
    with pytest.raises(HpcdemError, match=r"\d+ x \d+ pixels, at most 65535 along a side and 250 million in total"):
        plot_frame(make_frame(1), tmp_path / "a.jpg", dpi=20000)


# --- the surface -------------------------------------------------------------------------------------------------


def surface_of(frame) -> np.ndarray:
    """The line (m, 2) that the layer draws."""
    (line,) = frame_figure(frame, ("surface",)).axes[0].collections
    return line.get_segments()[0]


def test_the_surface_lies_on_the_discs_and_not_on_what_flies() -> None:
    frame = make_frame(1200)
    c = frame.tables["particles"].columns
    c["fix"][:] = 0  # fixed ones would stand for walls
    line = surface_of(frame)
    top = (c["y"] + c["radius"]).max()
    assert (np.interp(c["x"], *line.T) >= c["y"] + c["radius"] - 0.02 * c["radius"]).all()
    assert line[:, 1].max() == pytest.approx(top, abs=1.0) and line[:, 1].min() > top - 4.0 * c["radius"].max()
    c["y"][600] += 6000.0  # one particle thrown up
    assert surface_of(frame)[:, 1].max() < top + 1.0
    c["y"][600] -= 6000.0
    high = c["y"] > top - 500.0
    c["fix"][high] = 3  # a row that stands for a wall
    assert surface_of(frame)[:, 1].max() < top - 300.0


def test_every_layer_is_known_to_the_style() -> None:
    figure = frame_figure(make_frame(40), tuple(LAYERS), Style(title="$ {step}"))
    assert len(figure.axes[0].collections) >= len(LAYERS) - 1 and figure.axes[0].texts[-1].get_text() == "$ 46000"


def test_matplotlib_is_not_imported_before_it_is_used() -> None:
    program = "import sys, hpcdem.post.plots; raise SystemExit('matplotlib' in sys.modules)"
    root = Path(__file__).resolve().parents[2]
    assert subprocess.run([sys.executable, "-c", program], cwd=root, timeout=60, check=False).returncode == 0
