"""zdemss: pages of stress and strain from sections."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.zdemss import _ends, work, zdemss
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.axes import View
from hpcdem.post.cpt import INVAR2, VOLUME, parse_cpt, stress_table
from hpcdem.post.section import Section, read_section
from hpcdem.post.sections import draw, panels, survey
from hpcdem.post.sections.pages import MINUS, Style, bar_ticks, bars_of, section_page, series_page, thinned
from hpcdem.runtime.progress import Log
from tests.unit.section_synthetic import wedge, write_wedges

pytestmark = pytest.mark.figures
SEEN = View(0.0, 40000.0, 0.0, 10000.0)
STRESS = stress_table(250.0)
STYLE = Style({"volumetric": VOLUME, "distortional": INVAR2, "mean": STRESS, "shear": STRESS})


def options(line: str) -> dict[str, Any]:
    return read_command_line(zdemss, "zdemss", line.split())


def run(line: str) -> str:
    """zdemss on one rank; its log."""
    stream = io.StringIO()
    work(SerialComm(), Log(0, stream), options(line))
    return stream.getvalue()


def pixels(figure: Any, dpi: int = 100) -> np.ndarray:
    """The picture, row 0 at the bottom, fractions (rows, columns, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255.0


def shade(picture: np.ndarray, ax: Any, x: float, y: float) -> np.ndarray:
    """The colour at a place of the model."""
    column, row = ax.transData.transform((x, y))
    return picture[int(row), int(column)]


# -- the command line ---------------------------------------------------------------------------------------------


def test_the_options_of_the_manual_are_read() -> None:
    o = options("--dir ./datass --xmax 40.0 --ymax 10.0 --maxstress 250.0 --addball ON --delball ON")
    assert (o["folder"], o["xmax"], o["ymax"], o["maxstress"]) == (Path("datass"), 40.0, 10.0, 250.0)
    assert o["addball"] and o["delball"] and not o["sigma1"] and o["showcolorbar"]
    o = options(
        "-d x --strainvol OFF --strainshear ON --sigma1 ON --scale 1.5 --gridsize=1000 "
        "--stressmean OFF --stressshear off"
    )
    assert not (o["strainvol"] or o["stressmean"] or o["stressshear"]) and o["strainshear"] and o["sigma1"]
    assert (o["scale"], o["gridsize"], o["width"], o["labels"]) == (1.5, 1000.0, 14.0, True)
    assert options("-d x --gridsize 700 --sigma1 on")["gridsize"] == 700.0  # in any order


def test_limits_of_both_ends() -> None:
    o = options("-d x --xlim=-2,40 -ylim 0,10.5")
    assert (o["xlim"], o["ylim"]) == ((-2.0, 40.0), (0.0, 10.5))
    assert (_ends(o, "x"), _ends(o, "y")) == ((-2000.0, 40000.0), (0.0, 10500.0))
    assert _ends(options("-d x --xmax 40"), "x") == (None, 40000.0)
    with pytest.raises(UsageError, match="give either --xlim or --xmax"):
        _ends(options("-d x --xlim 0,3 --xmax 40"), "x")


@pytest.mark.parametrize("name", ["showlable", "showable"])
@pytest.mark.parametrize(("word", "value"), [("ON", True), ("off", False), ("abc", "abc"), ("ABC", "abc")])
def test_labels_have_two_names_and_three_values(name: str, word: str, value: object) -> None:
    assert options(f"-d x --{name}={word}")["labels"] == value


def test_formats_are_a_list() -> None:
    assert options("-d x")["formats"] == ("jpg", "ps")
    assert options("-d x --format PDF,eps,jpeg,pdf,tif")["formats"] == ("pdf", "ps", "jpg", "tiff")


def test_the_spellings_of_zdem2jpg_are_read() -> None:
    """`--dir= DIR`, one dash, a lone `--` where a line breaks, true and false."""
    o = options("--dir= ./datass -sigma1=true --scale= 1.5 -- --strainvol false --showlable=false -xmax=40.0")
    assert (o["folder"], o["scale"], o["xmax"]) == (Path("datass"), 1.5, 40.0)
    assert o["sigma1"] is True and o["strainvol"] is False and o["labels"] is False


def test_ours_comes_by_option(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_wedges(tmp_path, [wedge(10, 4000.0, radius=300.0)])
    seen: list[Any] = []
    monkeypatch.setattr(draw, "section_page", lambda section, view, kinds, *_: seen.append(kinds))
    monkeypatch.setattr(draw, "save", lambda *_: None)
    for line in ("", "--stressshear half", "--strainshear root", "--stressshear HALF --strainshear Root"):
        run(f"-d {tmp_path} {line}")
    plain, half, root, both = seen
    assert plain == panels.KINDS and half == (*panels.KINDS[:4], panels.HALF_SHEAR)
    assert root == (*panels.KINDS[:2], panels.ROOT, *panels.KINDS[3:]) and both == OURS
    assert len({kind.title for kind in (*panels.KINDS, panels.HALF_SHEAR, panels.ROOT)}) == 7


@pytest.mark.slow
def test_pages_are_drawn_by_several_processes_with_a_word_meanwhile(tmp_path: Path) -> None:
    """The same bytes as by one."""
    sections = [wedge(step, 1000.0 * step, radius=300.0) for step in range(2)]
    line = "--width 8 --format png --strainvol OFF --stressmean OFF --stressshear OFF"
    for name, workers in (("one", 1), ("two", 2)):
        write_wedges(tmp_path / name, sections)
        log = run(f"-d {tmp_path / name} {line} --max_workers {workers}")
        assert "2 sections" in log and "4 of 4" in log
    files = {p.relative_to(tmp_path / "one"): p.read_bytes() for p in (tmp_path / "one").rglob("*") if p.is_file()}
    for path, data in files.items():
        assert (tmp_path / "two" / path).read_bytes() == data, path


def test_nobody_measures_the_boxes_of_numbers_for_a_title(monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib.axis import Axis

    asked: list[Any] = []
    monkeypatch.setattr(Axis, "get_tightbbox", lambda self, *_, **__: asked.append(self))
    pixels(section_page(wedge(3, radius=300.0), SEEN, panels.KINDS, replace(STYLE, bars=False)))
    assert not asked


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "Usage:"),
        ("--addball ON", "Missing option"),
        ("-d x --addball maybe", "'maybe' is none of ON, OFF"),
        ("-d x --showlable abcd", "'abcd' is none of ON, OFF, abc"),
        ("-d x --format gif", "'gif' is not a picture format"),
        ("-d x --xmax -3", "--xmax"),
        ("-d x --scale big", "--scale"),
        ("-d x --width 1", "--width"),
        ("-d x --colour red", "No such option"),
    ],
)
def test_what_is_not_understood_is_reported(line: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        options(line)
    shown = capsys.readouterr()
    assert said in shown.err + shown.out


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    for word in ("-v", "--version", "-h", "--help"):
        with pytest.raises(SystemExit) as left:
            options(word)
        assert left.value.code == 0
        assert "zdemss" in capsys.readouterr().out


def test_without_stress_and_strain_the_first_step_is_named(tmp_path: Path) -> None:
    for folder in (tmp_path / "none", tmp_path):
        with pytest.raises(HpcdemError, match=f"run `hpcdem -s {folder}` first"):
            run(f"-d {folder}")
        (tmp_path / "ss" / "data").mkdir(parents=True, exist_ok=True)  # and when it is empty


def test_what_is_not_a_section_is_named(tmp_path: Path) -> None:
    write_wedges(tmp_path, [wedge(5)])
    (tmp_path / "ss" / "data" / "all_0000000007.npz").write_bytes(b"hello")
    with pytest.raises(HpcdemError, match=r"all_0000000007\.npz is not a section"):
        run(f"-d {tmp_path}")


def test_bars_need_the_panel_they_lie_on(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--strainshear OFF"):
        run(f"-d {tmp_path} --sigma1 ON --strainshear OFF")


SOME = "--xmax 40.0 --ymax 10.0 --width 9 --strainvol OFF --stressshear OFF"


# -- files --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Section], str]:
    """Three small sections and everything drawn of them: folder, sections, log."""
    folder = tmp_path_factory.mktemp("zdemss") / "datass"
    sections = write_wedges(folder, [wedge(6000, 0.0, True, 400.0), wedge(26000, 4000.0, False, 400.0, missing=3)])
    return folder, sections, run(f"-d {folder} --format jpg,png,pdf,svg,ps {SOME}")


def test_the_tree_of_the_manual(drawn: tuple[Path, list[Section], str]) -> None:
    ss = drawn[0] / "ss"
    names = ["all_0000006000_ini", "all_0000026000"]
    panels_with_grids = ["difference", "distortional", "invariant", "mean", "shear", "volumetric"]  # whatever is drawn
    kinds = ["deformation", "distortional", "mean"]
    pages = [f"{n}_strain_stress" for n in names] + [f"series_{k}" for k in kinds]
    files = sorted(str(p.relative_to(ss)) for p in ss.rglob("*") if p.is_file())
    expected = [f"data/{n}.npz" for n in names] + [f"data2ps/{k}_{n}.out" for n in names for k in ("strain", "stress")]
    expected += [f"Tmp/{n}_{k}.grd" for n in names for k in panels_with_grids]
    expected += [f"{p}.{s}" for p in pages for s in ("jpg", "png")]
    expected += [f"ps/{p}.{s}" for p in pages for s in ("pdf", "ps", "svg")]
    assert files == sorted(expected)
    heads = {".jpg": b"\xff\xd8", ".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml", ".ps": b"%!PS"}
    for path in ss.rglob("*"):
        if path.suffix in heads:
            assert path.read_bytes().startswith(heads[path.suffix])


def test_the_tables_hold_true_values(drawn: tuple[Path, list[Section], str]) -> None:
    folder, sections, _ = drawn
    section = sections[1]
    for kind, head, names in (
        ("strain", "# x[m] y[m] volumetric[%] distortional[1] invariant[1]", ("volumetric", "distortional")),
        ("stress", "# x[m] y[m] mean[Pa] shear[Pa] s1[Pa] s2[Pa] direction[rad] difference[Pa]", ("mean", "shear")),
    ):
        path = folder / "ss" / "data2ps" / f"{kind}_{section.name}.out"
        assert path.read_text().splitlines()[0] == head
        assert "NaN" in path.read_text() and "nan" not in path.read_text()
        rows = np.loadtxt(path)
        x, y = np.meshgrid(section.x, section.y)
        np.testing.assert_allclose(rows[:, 0], x.reshape(-1))
        np.testing.assert_allclose(rows[:, 1], y.reshape(-1))
        for k, name in enumerate(names):
            np.testing.assert_allclose(rows[:, 2 + k], section.fields[name].reshape(-1), rtol=1e-9)
    f = section.fields
    tensor = np.moveaxis(np.array([[f["sxx"], f["sxy"]], [f["sxy"], f["syy"]]]), (0, 1), (2, 3)).reshape(-1, 2, 2)
    solid = np.isfinite(tensor).all(axis=(1, 2))
    values, vectors = np.linalg.eigh(tensor[solid])
    np.testing.assert_allclose(rows[solid, 4], values[:, 1], rtol=1e-8)
    np.testing.assert_allclose(rows[solid, 5], values[:, 0], rtol=1e-8)
    np.testing.assert_allclose(rows[solid, 7], values[:, 1] - values[:, 0], rtol=1e-7)
    along = np.stack([np.cos(rows[solid, 6]), np.sin(rows[solid, 6])], axis=1)
    assert np.all(np.abs(np.sum(along * vectors[:, :, 1], axis=1)) > 1.0 - 1e-9)


def test_the_grids_are_netcdf(drawn: tuple[Path, list[Section], str]) -> None:
    from scipy.io import netcdf_file

    folder, sections, _ = drawn
    with netcdf_file(folder / "ss" / "Tmp" / f"{sections[1].name}_mean.grd", mmap=False) as file:
        assert (file.Conventions, file.variables["z"].units) == (b"COARDS", b"Pa")
        assert file.variables["z"].dimensions == ("y", "x")
        np.testing.assert_array_equal(file.variables["x"][:], sections[1].x)
        np.testing.assert_array_equal(file.variables["z"][:], sections[1].fields["mean"])


def test_particles_that_came_or_went_are_named_unless_meant(drawn: tuple[Path, list[Section], str]) -> None:
    folder, sections, log = drawn
    fewer = len(sections[0].particles["gid"]) - len(sections[1].particles["gid"])
    word, option = ("removed", "--delball") if fewer > 0 else ("added", "--addball")
    assert f"{abs(fewer)} particles were {word} between all_0000006000_ini and all_0000026000: add {option} ON" in log
    o = survey.outline(sections[1], sections[0])
    assert (o.came, o.went) == (max(-fewer, 0), max(fewer, 0))


@pytest.mark.slow
def test_the_same_section_gives_the_same_files(drawn: tuple[Path, list[Section], str], tmp_path: Path) -> None:
    folder, sections, _ = drawn
    write_wedges(tmp_path, sections)
    run(f"-d {tmp_path} --format jpg,png,pdf,svg,ps {SOME} --addball ON --delball ON")
    for path in (folder / "ss").rglob("*"):
        if path.is_file() and path.parent.name != "data":
            assert path.read_bytes() == (tmp_path / path.relative_to(folder)).read_bytes(), path.name


# -- pages --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "keys"),
    [
        ("", ["deformation", "volumetric", "distortional", "mean", "shear"]),
        ("--strainvol OFF --stressmean off", ["deformation", "distortional", "shear"]),
        ("--strainvol OFF --strainshear OFF --stressmean OFF --stressshear OFF", ["deformation"]),
    ],
)
def test_options_switch_panels(line: str, keys: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_wedges(tmp_path, [wedge(10, 4000.0, radius=300.0)])
    seen: list[Any] = []
    monkeypatch.setattr(draw, "save", lambda figure, ss, name, formats: seen.append((figure, name)))
    run(f"-d {tmp_path} {line}")
    ((figure, name),) = seen  # one section makes no series
    bars = bars_of([k for k in panels.KINDS if k.key in keys], STYLE)
    assert len(figure.axes) == len(keys) + len(bars)
    assert name == "all_0000000010_strain_stress"


def test_a_page_is_as_wide_as_asked_and_all_of_it_is_on_the_paper() -> None:
    """And no number lies on another."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    for width in (8.0, 14.0):
        figure = section_page(
            wedge(3, 4000.0, radius=300.0), SEEN, panels.KINDS, replace(STYLE, width=width, labels="on")
        )
        FigureCanvasAgg(figure).draw()
        for ax in figure.axes:
            boxes = [t.get_window_extent() for t in ax.get_xticklabels() if t.get_text() and t.get_visible()]
            boxes.sort(key=lambda box: box.x0)
            assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))
        assert figure.get_size_inches()[0] * 2.54 == pytest.approx(width)
        assert figure.get_size_inches()[1] * 2.54 < max(1.8 * width, 24.0)
        for collection in figure.axes[0].collections:  # what is cut off by the axes does not count
            collection.set_in_layout(False)
        everything = figure.get_tightbbox()
        assert everything.x0 >= 0.0 and everything.y0 >= 0.0
        assert everything.x1 <= width / 2.54 and everything.y1 <= figure.get_size_inches()[1]
        assert min(t.get_fontsize() for ax in figure.axes for t in ax.get_xticklabels()) >= 5.0


def test_high_panels_go_side_by_side() -> None:
    tall = View(0.0, 10000.0, 0.0, 10000.0)
    figure = section_page(wedge(3, radius=300.0), tall, panels.KINDS, STYLE)
    places = {round(ax.get_position().x0, 3) for ax in figure.axes[:5]}
    assert len(places) > 1


OURS = (*panels.KINDS[:2], panels.ROOT, panels.MEAN, panels.HALF_SHEAR)


@pytest.mark.parametrize(("kinds", "invariant", "shear"), [(panels.KINDS, 0.04, 80.0), (OURS, 0.2, 40.0)])
def test_known_values_have_their_colours(kinds: tuple[panels.Kind, ...], invariant: float, shear: float) -> None:
    """The manual's pages show the second invariant and sigma1 - sigma3; the root and half of it by option."""
    section = wedge(3, radius=100.0)
    values = {"volumetric": -2.0, "distortional": 0.2, "mean": 180e6, "shear": 40e6}
    for name, value in values.items():
        section.fields[name] = np.where(np.isfinite(section.fields[name]), value, np.nan)
    figure = section_page(section, SEEN, kinds, STYLE)
    picture = pixels(figure)
    expected = {
        "volumetric": (VOLUME, -2.0),
        "distortional": (INVAR2, invariant),
        "mean": (STRESS, 180.0),
        "shear": (STRESS, shear),
    }
    for ax, kind in zip(figure.axes[1:5], kinds[1:]):
        table, value = expected[kind.key]
        for x, y in ((1500.0, 500.0), (20000.0, 2100.0), (38500.0, 3500.0)):
            np.testing.assert_allclose(shade(picture, ax, x, y), table.colours(np.array(value)), atol=0.006)
        assert shade(picture, ax, 20000.0, 6000.0).min() == 1.0  # no material, no colour


def test_a_field_is_linear_between_its_nodes_and_ends_with_the_particles() -> None:
    section = wedge(3, radius=100.0)
    x, y = np.meshgrid(section.x, section.y)
    solid = np.isfinite(section.fields["mean"])
    section.fields["mean"] = np.where(solid, 3e3 * x + 1e3 * y, np.nan)
    grid = panels.Pixels.over(section, 40000.0)
    assert grid is not None
    values = grid.values(section.fields["mean"])
    px, py = section.x[0] + section.size * grid.columns, section.y[0] + section.size * grid.rows
    inner_x, inner_y = (px > 500) & (px < 39500), (py > 500) & (py < 3300)
    plane = 3e3 * px[None, :] + 1e3 * py[:, None]
    np.testing.assert_allclose(values[inner_y][:, inner_x], plane[inner_y][:, inner_x], rtol=1e-12)
    assert grid.material[inner_y][:, inner_x].all()  # pores are closed
    assert not grid.material[:, px < -section.size].any()
    top = section.particles["y"].max() + 100.0
    assert not grid.material[py > top + 100.0].any()
    assert grid.material[py < top - 250.0][:, inner_x][5:].any(axis=0).all()


def test_strained_bands_lie_dark_over_the_stress() -> None:
    section = wedge(3, radius=100.0)
    x, _ = np.meshgrid(section.x, section.y)
    solid = np.isfinite(section.fields["mean"])
    section.fields["mean"] = np.where(solid, 125e6, np.nan)
    strain = np.select([x < 10000, x < 20000, x < 30000], [3.0, -3.0, 0.5], 0.0)
    section.fields["distortional"] = np.where(solid, strain, np.nan)
    figure = section_page(section, SEEN, [panels.MEAN], STYLE)
    picture, ax = pixels(figure), figure.axes[0]
    plain = STRESS.colours(np.array(125.0))
    for place, part in ((5000.0, panels.SHADE), (15000.0, panels.SHADE), (25000.0, 1.0), (35000.0, 1.0)):
        np.testing.assert_allclose(shade(picture, ax, place, 2000.0), part * plain, atol=0.006)


def test_the_deformation_is_drawn_in_the_colours_of_the_particles() -> None:
    from hpcdem.io import colours

    section = wedge(3, 4000.0, radius=300.0)
    figure = section_page(section, SEEN, [panels.DEFORMATION], STYLE)
    picture, p = pixels(figure), section.particles
    for k in range(0, len(p["x"]), 37):
        expected = colours.RGB[p["color"][k]]
        np.testing.assert_allclose(shade(picture, figure.axes[0], p["x"][k], p["y"][k]), expected, atol=0.006)


def test_many_particles_are_a_bitmap_in_a_vector_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ps").mkdir()
    section = wedge(3, 4000.0, radius=100.0)
    texts, pictures = {}, {}
    for name, limit in (("discs", 10**6), ("bitmap", 10)):
        monkeypatch.setattr(panels, "VECTOR_DISCS", limit)
        figure = section_page(section, SEEN, [panels.DEFORMATION], STYLE)
        draw.save(figure, tmp_path, name, ("svg",))
        texts[name] = (tmp_path / "ps" / f"{name}.svg").read_text()
        pictures[name] = pixels(figure, 200)
    assert "<image" in texts["bitmap"] and "<image" not in texts["discs"]
    assert len(texts["bitmap"]) < len(texts["discs"])
    ax, p = figure.axes[0], section.particles
    for k in range(0, len(p["x"]), 97):  # either way the same colours at the same places
        place = (p["x"][k], p["y"][k])
        np.testing.assert_allclose(
            shade(pictures["bitmap"], ax, *place), shade(pictures["discs"], ax, *place), atol=0.02
        )


@pytest.mark.parametrize(
    ("labels", "texts"),
    [("off", ["", "", ""]), ("abc", ["", "a", "b"]), ("on", ["step 3", "a  Deformation", "b  Mean stress"])],
)
def test_labels(labels: str, texts: list[str]) -> None:
    kinds = [panels.DEFORMATION, panels.MEAN]
    figure = section_page(wedge(3, radius=300.0), SEEN, kinds, replace(STYLE, labels=labels), "step 3")
    assert [" ".join(t.get_text() for t in part.texts) for part in (figure, *figure.axes[:2])] == texts


@pytest.mark.parametrize("width", [8.0, pytest.param(14.0, marks=pytest.mark.slow)])
def test_captions_lie_between_the_panels(width: float) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    style = replace(STYLE, stress_bars=(1000.0, 1.0), width=width)
    pairs = [(wedge(k, 1000.0 * k, radius=300.0), f"step {k}, initial: shortening {k} km") for k in range(3)]
    figure = series_page(iter(pairs), 3, SEEN, panels.DISTORTIONAL, style)
    FigureCanvasAgg(figure).draw()
    for k, ax in enumerate(figure.axes[:3]):
        below = figure.axes[k - 1].get_window_extent().y0 if k else figure.bbox.y1
        for text in ax.texts:
            assert ax.get_window_extent().y1 < text.get_window_extent().y0 < text.get_window_extent().y1 < below
        first, second = (t.get_window_extent() for t in ax.texts)
        assert first.x1 < second.x0


def test_a_series_shows_every_section_with_its_caption() -> None:
    pairs = [(wedge(k, 1000.0 * k, radius=300.0), f"step {k}") for k in range(3)]
    figure = series_page(iter(pairs), 3, SEEN, panels.SHEAR, STYLE)
    assert [ax.texts[0].get_text() for ax in figure.axes[:3]] == ["step 0", "step 1", "step 2"]
    assert len(figure.axes) == 4  # and one colour bar


def test_captions_show_how_far_the_walls_have_come() -> None:
    outlines = [survey.outline(wedge(k, push, k == 0)) for k, push in ((0, 0.0), (5, 2000.0))]
    captions = survey.progress(outlines, (1000.0, "km"))
    assert captions["all_0000000000_ini"] == "step 0, initial"
    length = outlines[0].extent[1] - outlines[0].extent[0]
    assert captions["all_0000000005"] == f"step 5: shortening 2 km ({100 * 2000.0 / length:.3g} %)"
    backwards = survey.progress([replace(outlines[1], name="a"), replace(outlines[0], name="b")], (1000.0, "km"))
    assert "extension 2 km" in backwards["b"]


def test_the_view_holds_all_sections_unless_it_is_given() -> None:
    outlines = [survey.outline(wedge(k, push)) for k, push in ((0, 0.0), (5, 6000.0))]
    seen = survey.common_view(outlines)
    assert (seen.left, seen.bottom, seen.right) == (0.0, 0.0, 40000.0)
    assert outlines[1].extent[3] < seen.top < outlines[1].extent[3] + 6000.0
    assert survey.common_view(outlines, (None, 35000.0), (None, 9000.0)) == View(0.0, 35000.0, 0.0, 9000.0)
    assert survey.common_view(outlines, (-2e3, 3e4), (1e3, None)) == View(-2e3, 3e4, 1e3, seen.top)
    far = replace(outlines[0], extent=(90000.0, 130000.0, -3000.0, 2000.0), reach=(90000.0, 130000.0))
    seen = survey.common_view([far])
    assert (seen.left, seen.right, seen.bottom) == (90000.0, 130000.0, -3000.0)
    with pytest.raises(UsageError, match="nothing to draw between x = 90 km and x = 1 km"):
        survey.common_view([far], x=(None, 1000.0))


def test_sections_without_particles_are_drawn_empty(tmp_path: Path) -> None:
    empty = wedge(3)
    empty.particles = {name: values[:0] for name, values in empty.particles.items()}
    empty.fields = {name: np.full_like(values, np.nan) for name, values in empty.fields.items()}
    empty.surface, empty.walls = np.zeros((0, 2)), {}
    write_wedges(tmp_path, [empty])
    run(f"-d {tmp_path} --sigma1 ON --format png")
    assert (tmp_path / "ss" / "all_0000000003_sigma1.png").exists()


# -- bars of the largest principal stress -------------------------------------------------------------------------


def uniform(s1: float, s2: float, angle: float) -> Section:
    """A section with the same stress everywhere."""
    section = wedge(3, radius=200.0)
    c, s = np.cos(angle), np.sin(angle)
    stress = {"sxx": s1 * c * c + s2 * s * s, "sxy": (s1 - s2) * s * c, "syy": s1 * s * s + s2 * c * c}
    solid = np.isfinite(section.fields["sxx"])
    section.fields |= {name: np.where(solid, value, np.nan) for name, value in stress.items()}
    return section


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2, -0.7])
@pytest.mark.parametrize(("square", "scale"), [(600.0, 1.0), (1000.0, 2.0), (200.0, 0.5)])
def test_bars_of_a_uniform_stress(angle: float, square: float, scale: float) -> None:
    section = uniform(90e6, 30e6, angle)
    begin, end, most = panels.stress_bars(section, square, scale)
    assert most == pytest.approx(90e6)
    way = end - begin
    np.testing.assert_allclose(np.hypot(*way.T), scale * square, rtol=1e-9)
    np.testing.assert_allclose(np.tan(np.arctan2(way[:, 1], way[:, 0]) - angle), 0.0, atol=1e-9)
    middle = 0.5 * (begin + end)
    np.testing.assert_allclose(np.diff(np.unique(np.round(middle[:, 0], 3))), square)
    # Each bar stands in the middle of the nodes it is the mean of.
    solid = np.isfinite(section.fields["sxx"])
    x, y = (v[solid] for v in np.meshgrid(section.x, section.y))
    for at in middle[:: max(1, len(middle) // 20)]:
        own = (np.abs(x - at[0]) < 0.5 * square) & (np.abs(y - at[1]) < 0.5 * square)
        assert own.sum() >= 0.5 * (square / section.size) ** 2
        if own.sum() == round(square / section.size) ** 2:
            np.testing.assert_allclose([x[own].mean(), y[own].mean()], at, rtol=1e-9)


def test_bars_are_as_long_as_the_stress_is_large() -> None:
    section = uniform(90e6, 30e6, 0.0)
    x, _ = np.meshgrid(section.x, section.y)
    for name in ("sxx", "sxy", "syy"):
        section.fields[name] = section.fields[name] * np.where(x < 20000.0, 1.0, np.where(x < 30000.0, 0.5, -1.0))
    begin, end, most = panels.stress_bars(section, 1000.0, 1.0)
    assert most == pytest.approx(90e6)
    lengths, middle = np.hypot(*(end - begin).T), 0.5 * (begin + end)[:, 0]
    np.testing.assert_allclose(lengths[middle < 19000.0], 1000.0)
    np.testing.assert_allclose(lengths[(middle > 21000.0) & (middle < 29000.0)], 500.0)
    assert not (middle > 31000.0).any()  # tension has none


def test_bars_are_drawn_over_the_distortional_strain_with_the_largest_stress_said(tmp_path: Path) -> None:
    style = replace(STYLE, stress_bars=(1000.0, 1.0))
    section = uniform(90e6, 30e6, 0.2)
    kinds = [panels.DEFORMATION, panels.DISTORTIONAL]
    with_bars, without = (section_page(section, SEEN, kinds, s) for s in (style, STYLE))
    more = [len(a.collections) - len(b.collections) for a, b in zip(with_bars.axes[:2], without.axes[:2])]
    assert more == [0, 1]
    assert len(with_bars.axes[1].collections[-1].get_segments()) == len(panels.stress_bars(section, 1000.0, 1.0)[0])
    assert "= 90 MPa" in with_bars.axes[1].texts[0].get_text()
    with pytest.raises(HpcdemError, match="--gridsize 100: smaller than the grid"):
        panels.stress_bars(section, 100.0, 1.0)


# -- colour bars --------------------------------------------------------------------------------------------------


def test_open_ends_of_a_bar_are_labelled_as_more() -> None:
    texts = [text.replace(MINUS, "-") for _, text in bar_ticks(INVAR2)]
    assert texts == ["<-800", "-800", "-80", "-4.8", "-0.16", "0", "0.16", "4.8", "80", "800", ">800"]
    assert [text for _, text in bar_ticks(parse_cpt("0 red 1 blue\n1 blue 3 red"))] == ["0", "1", "3"]


def test_a_table_says_itself_what_is_labelled() -> None:
    assert bar_ticks(parse_cpt("0 red 1 blue L\n1 blue 2 red\n2 red 3 blue U")) == [(0.0, "0"), (3.0, "3")]
    assert bar_ticks(parse_cpt("0 red 1 blue\n1 blue 2 red B\n")) == [(1.0, "1"), (2.0, "2")]
    assert bar_ticks(parse_cpt("1 red ;salt\n2 blue")) == [(0.5, "salt"), (1.5, "2")]


def test_kinds_of_the_same_colours_share_a_bar() -> None:
    headings = [bar.heading for bar in bars_of(panels.KINDS, STYLE)]
    assert headings == [
        "Volumetric strain (%)",
        "Distortional strain J₂",
        f"Mean stress,\nShear stress σ₁ {MINUS} σ₃ (MPa)",
    ]
    both = replace(STYLE, tables={**STYLE.tables, "volumetric": INVAR2})
    assert next(bar.heading for bar in bars_of(panels.KINDS, both)) == "Volumetric strain (%),\nDistortional strain J₂"
    assert bars_of(panels.KINDS, replace(STYLE, bars=False)) == []


def test_labels_of_a_bar_are_thinned_about_the_middle() -> None:
    ticks = bar_ticks(INVAR2)
    assert thinned(ticks, 2.0, 8.0) == ticks
    assert thinned(ticks, 0.8, 8.0) == ticks[1:-1]  # without "more than" at the ends
    fewer = thinned(ticks, 0.4, 8.0)
    assert len(fewer) < len(ticks) and (5.0, "0") in fewer


def test_the_colours_of_a_bar_are_those_of_the_table() -> None:
    figure = section_page(wedge(3, radius=300.0), SEEN, [panels.VOLUMETRIC, panels.MEAN], STYLE)
    picture = pixels(figure, 300)
    strain, stress = figure.axes[2:]
    for value in (-40.0, -3.0, 0.1, 3.0, 40.0, 10000.0):
        at = float(VOLUME.position(np.array(value)))
        np.testing.assert_allclose(shade(picture, strain, at, 0.5), VOLUME.colours(np.array(value)), atol=0.04)
    for value in (20.0, 125.0, 230.0):
        np.testing.assert_allclose(shade(picture, stress, value, 0.5), STRESS.colours(np.array(value)), atol=0.04)


def test_a_colour_table_of_ones_own_is_used_for_both_strains(tmp_path: Path) -> None:
    (tmp_path / "own.cpt").write_text("# HINGE = 0\n-100 yellow 0 white\n0 white 100 blue\n")
    request = draw.Request(tmp_path, colormap=tmp_path / "own.cpt")
    tables = draw.colour_tables(request)
    assert tables["volumetric"] is tables["distortional"]
    assert tables["volumetric"].colours(np.array(100.0)).tolist() == [0.0, 0.0, 1.0]
    assert draw.colour_tables(replace(request, colormap=Path("invar2")))["distortional"] is INVAR2
    default = draw.colour_tables(replace(request, colormap=None))
    assert (default["distortional"], default["volumetric"]) == (INVAR2, VOLUME)
    write_wedges(tmp_path / "d", [wedge(3, radius=300.0)])
    log = run(f"-d {tmp_path / 'd'} --straincolormap {tmp_path / 'own.cpt'} --format png")
    assert "HINGE is ignored" in log
    (tmp_path / "own.cpt").write_text("0 yellow 0 white\n")
    with pytest.raises(UsageError, match=r"own\.cpt:1: z1 = 0 must be larger"):
        run(f"-d {tmp_path / 'd'} --straincolormap {tmp_path / 'own.cpt'}")


def test_sections_are_taken_in_the_order_of_time(tmp_path: Path) -> None:
    write_wedges(tmp_path, [wedge(k, 0.0, ini, 300.0) for k, ini in ((20, False), (20, True), (3, False))])
    (tmp_path / "ss" / "data" / "notes.npz").write_bytes(b"")
    files = draw.section_files(tmp_path / "ss" / "data")
    assert [p.stem for p in files] == ["all_0000000003", "all_0000000020", "all_0000000020_ini"]
    assert [read_section(p).step for p in files] == [3, 20, 20]
