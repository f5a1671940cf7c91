"""Letters that the usual font lacks: another font that has them, else a line that says which package brings one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.post import lettering, saved
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.paper import Paper, draw
from tests.view import frames

pytestmark = pytest.mark.figures
image = pytest.importorskip("PIL.Image")
LETTER = "\u76d0"
NAME = "Hpcdem Test"


def font(path: Path, letter: str) -> Path:
    """A font with one letter besides its box: two bars."""
    from fontTools.fontBuilder import FontBuilder
    from fontTools.pens.ttGlyphPen import TTGlyphPen

    pen = TTGlyphPen(None)
    for x in (100, 600):
        pen.moveTo((x, 0))
        for place in ((x, 800), (x + 200, 800), (x + 200, 0)):
            pen.lineTo(place)
        pen.closePath()
    bars, nothing = pen.glyph(), TTGlyphPen(None).glyph()
    made = FontBuilder(1000, isTTF=True)
    made.setupGlyphOrder([".notdef", "bars"])
    made.setupCharacterMap({ord(letter): "bars"})
    made.setupGlyf({".notdef": nothing, "bars": bars})
    made.setupHorizontalMetrics({".notdef": (1000, 0), "bars": (1000, 100)})
    made.setupHorizontalHeader(ascent=900, descent=-200)
    made.setupNameTable({"familyName": NAME, "styleName": "Regular"})
    made.setupOS2()
    made.setupPost()
    made.save(path)
    return path


@pytest.fixture
def no_fonts(monkeypatch: pytest.MonkeyPatch):
    """A machine whose only fonts are those of matplotlib."""
    from matplotlib import font_manager

    own = [one for one in font_manager.fontManager.ttflist if "mpl-data" in one.fname]
    monkeypatch.setattr(font_manager.fontManager, "ttflist", own)
    monkeypatch.setattr(font_manager, "findSystemFonts", lambda: [])
    monkeypatch.setattr(lettering, "_warned", set())
    lettering.font_of.cache_clear()
    yield
    lettering.font_of.cache_clear()


def test_letters_of_a_font_of_curves_are_lines_in_a_pdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Noto's are such; PDF of matplotlib would hold them in a way in which they stay white."""
    from matplotlib import font_manager
    from matplotlib.figure import Figure

    path = font(tmp_path / "a.ttf", LETTER)
    monkeypatch.setattr(lettering, "font_of", lambda letters: (NAME, str(path)))
    font_manager.fontManager.addfont(path)
    for cubic in (False, True):
        monkeypatch.setattr(lettering, "_cubic", lambda path: cubic)  # noqa: B023
        figure = Figure()
        text = figure.text(0.5, 0.5, LETTER)
        saved.save(figure, str(tmp_path / f"{cubic}.pdf"), "pdf", 100.0)
        assert (b"/FontFile2" in (tmp_path / f"{cubic}.pdf").read_bytes()) == (not cubic)
        assert bool(text.get_path_effects()) == cubic
    monkeypatch.undo()
    (tmp_path / "c.otf").write_bytes(b"OTTO" + bytes(12))
    (tmp_path / "c.ttc").write_bytes(
        b"ttcf" + bytes(4) + (1).to_bytes(4, "big") + (20).to_bytes(4, "big") + bytes(4) + b"OTTO"
    )
    assert [lettering._cubic(str(one)) for one in (path, tmp_path / "c.otf", tmp_path / "c.ttc")] == [False, True, True]


def titled(folder: Path, kind: str = "png", title: str = LETTER) -> Path:
    moment = read_moment(frames.write_blocks(folder))
    view = ModelView(layers=(Layer(object="elements"),), title=title)
    return draw(moment, folder / f"a.{kind}", view, Paper(dpi=100.0))


def red(path: Path) -> int:
    """Pixels of the line at the foot."""
    with image.open(path) as opened:
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    return int(((pixels[..., 0] - pixels[..., 1]) > 80)[-20:].sum())


def test_a_font_that_has_the_letters_is_found(no_fonts: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                              capsys: pytest.CaptureFixture):  # fmt: skip
    """Also one that was installed after matplotlib made its list."""
    from matplotlib import font_manager
    from matplotlib.figure import Figure

    path = font(tmp_path / "a.ttf", LETTER)
    monkeypatch.setattr(font_manager, "findSystemFonts", lambda: [str(path)])
    figure = Figure()
    text = figure.text(0.5, 0.5, f"a {LETTER}", fontsize=60.0)
    assert lettering.lettered(figure) == "" and text.get_fontfamily()[-1] == NAME
    for kind in ("png", "pdf", "svg"):
        saved.save(figure, str(tmp_path / f"b.{kind}"), kind, 100.0)
    with image.open(tmp_path / "b.png") as opened:
        dark = (np.asarray(opened.convert("L")) < 128).any(axis=0)
    columns = np.flatnonzero(np.diff(dark.astype(int)) == 1)
    assert len(columns) == 3  # the letter a, and two bars
    assert NAME.encode() in (tmp_path / "b.svg").read_bytes()
    assert capsys.readouterr().err == "" and red(titled(tmp_path)) == 0


def test_without_one_a_line_says_which_package_brings_it(
    no_fonts: None, tmp_path: Path, capsys: pytest.CaptureFixture
):  # fmt: skip
    assert red(titled(tmp_path)) > 50
    said = capsys.readouterr().err
    assert said.startswith(f"warning: no installed font has the letters {LETTER}: install fonts-noto-cjk or ")
    assert said.count("\n") == 1
    titled(tmp_path)
    assert capsys.readouterr().err == ""  # once in a process
    assert "no font" not in titled(tmp_path, "svg").read_text()  # who reads it has fonts of their own


def test_letters_of_the_usual_font_change_nothing(no_fonts: None, tmp_path: Path, capsys: pytest.CaptureFixture):
    plain = titled(tmp_path, title="µ · ² ⁻⁶ °C").read_bytes()
    assert capsys.readouterr().err == "" and plain == titled(tmp_path, title="µ · ² ⁻⁶ °C").read_bytes()
