"""Colour tables of GMT."""

from __future__ import annotations

import colorsys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import UsageError
from hpcdem.post.cpt import INVAR, INVAR2, VOLUME, parse_cpt, read_cpt, stress_table
from tests.tables import each


def colour(text: str, value: float) -> list[float]:
    """Red, green, blue (0..255) of a value."""
    return [float(c) for c in np.round(255.0 * parse_cpt(text).colours(np.array(value)), 6)]


def test_a_continuous_table_runs_linearly_within_its_slices() -> None:
    text = "# made by hand\n-10 0 0 100 0 50 0 200\n0\t50 0 200\t5 250 100 0\nB 1 2 3\nF 4 5 6\nN 128 128 128\n"
    assert colour(text, -10.0) == [0, 0, 100]
    assert colour(text, -5.0) == [25, 0, 150]
    assert colour(text, 0.0) == [50, 0, 200]
    assert colour(text, 1.0) == [90, 20, 160]
    assert colour(text, 5.0) == [250, 100, 0]
    assert colour(text, -10.001) == [1, 2, 3]
    assert colour(text, 5.001) == [4, 5, 6]


def test_outside_is_black_and_white_unless_the_table_says_otherwise_and_nan_is_never_painted() -> None:
    text = "0 10 20 30 1 40 50 60\n"
    assert colour(text, -1.0) == [0, 0, 0] and colour(text, 2.0) == [255, 255, 255]
    result = parse_cpt(text + "N 1 2 3\nB -\n").colours(np.array([[np.nan, -1.0], [0.5, 2.0]]))
    assert result.shape == (2, 2, 3)
    assert np.isnan(result[0]).all() and np.isfinite(result[1]).all()


def test_steps_take_the_colour_of_the_upper_slice_at_their_limit() -> None:
    text = "0 10 10 10 1 10 10 10\n1 20 20 20 2 20 20 20\n2 30 30 30 3 30 30 30\n"
    assert [colour(text, v)[0] for v in (0.0, 0.999, 1.0, 1.5, 2.0, 3.0)] == [10, 10, 20, 20, 30, 30]


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("255/128/0", [255, 128, 0]),
        ("100", [100, 100, 100]),
        ("#FF8000", [255, 128, 0]),
        ("red", [255, 0, 0]),
        ("DarkOrange", [255, 140, 0]),
        ("gray", [190, 190, 190]),  # X11's, as in GMT
        ("grey50", [127.5, 127.5, 127.5]),
        ("green", [0, 255, 0]),
        ("120-1-0.5", [0, 127.5, 0]),
        ("0/100/100/20", [204, 0, 0]),
    ],
)
def test_a_colour_may_be_one_word_of_any_form(word: str, expected: list[float]) -> None:
    for text in (f"0 {word} 1 {word}", f"3 black 4 white\nB {word}", f"3 black 4 white\nF {word}", f"0 {word}"):
        value = 5.0 if "F " in text else 0.0
        assert colour(text, value) == pytest.approx(expected, abs=0.01)


def test_hsv_is_interpolated_in_hsv() -> None:
    text = "0 0 1 1 10 240 0.5 0.8\n# COLOR_MODEL = HSV\n"  # the model may stand anywhere
    for part in (0.0, 0.25, 0.5, 0.8, 1.0):
        hsv = (240.0 * part / 360.0, 1.0 - 0.5 * part, 1.0 - 0.2 * part)
        assert colour(text, 10.0 * part) == pytest.approx([255.0 * c for c in colorsys.hsv_to_rgb(*hsv)], abs=1e-3)
    assert colour("# COLOR_MODEL = +HSV\n0 red 1 120/1/1\n", 1.0) == pytest.approx([0, 255, 0])


def test_cmyk_has_four_numbers_of_0_to_100() -> None:
    text = "#COLOR_MODEL=CMYK\n0 0 0 0 0 1 100 50 0 20\nB 0 0 0 100\n"
    assert colour(text, 0.0) == [255, 255, 255]
    assert colour(text, 1.0) == pytest.approx([0, 102, 204])
    assert colour(text, 0.5) == pytest.approx([0.5 * 0.9 * 255, 0.75 * 0.9 * 255, 0.9 * 255])
    assert colour(text, -1.0) == [0, 0, 0]


def test_a_categorical_table_colours_single_values_only() -> None:
    table = parse_cpt("1 red ;shale\n7 0/0/255 ;salt # comment of the label\n3 100\n")
    assert table.categorical and next(s.label for s in table.slices) == "shale"
    assert np.round(255 * table.colours(np.array([7.0, 1.0, 3.0]))).tolist() == [[0, 0, 255], [255, 0, 0], [100] * 3]
    assert np.isnan(table.colours(np.array([2.0, np.nan, 7.5]))).all()
    assert table.position(np.array([1.0, 7.0, 3.0])).tolist() == [0.5, 1.5, 2.5]


def test_annotations_and_labels_are_kept() -> None:
    table = parse_cpt("0 0 0 0 1 9 9 9 L\n1 9 9 9 2 8 8 8 u ;some text\n2 8 8 8 3 7 7 7 B # remark\n")
    assert [(s.annotated, s.label) for s in table.slices] == [("L", ""), ("U", "some text"), ("B", "")]


def test_a_dash_paints_nothing() -> None:
    table = parse_cpt("0 - 1 -\n1 red 2 -\n")
    assert np.isnan(table.colours(np.array(0.5))).all()
    assert table.colours(np.array(1.9)).tolist() == [1.0, 0.0, 0.0]


def test_hinges_are_named_and_ignored() -> None:
    table = parse_cpt("# HINGE = 0\n#RANGE = -1/1\n-1 black 1 white\n")
    assert [note.split()[0] for note in table.notes] == ["HINGE", "RANGE"]
    assert not parse_cpt("# hinges of doors\n-1 black 1 white\n").notes


def test_dos_line_ends_and_a_byte_order_mark_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "a.cpt").write_bytes(b"\xef\xbb\xbf# x\r\n0 1 2 3 1 4 5 6\r\n\r\n")
    assert (255 * read_cpt(tmp_path / "a.cpt").colours(np.array(1.0))).tolist() == pytest.approx([4, 5, 6])


@each(
    ("text", "line", "said"),
    [
        ("0 1 2 3 1 4 5 6\n2 1 2 3 4 4 5 6", 2, "begins at 2, the one before ends at 1"),
        ("0 1 2 3 1 4 5 6\n0.5 1 2 3 4 4 5 6", 2, "begins at 0.5"),
        ("0 1 2 3 0 4 5 6", 1, "z1 = 0 must be larger than z0 = 0"),
        ("\n# c\n0 1 2 3 1 4 5", 3, "7 words"),
        ("0 1 2 3 1 4 5 256", 1, "256 is not a component of RGB"),
        ("0 1 2 3 1 4 5 -1", 1, "-1 is not a component"),
        ("0 1 2 3 1 4 x 6", 1, "x is not a number"),
        ("zero 1 2 3 1 4 5 6", 1, "zero is not a number; expected z0"),
        ("0 1 2 3 inf 4 5 6", 1, "inf is not a finite number"),
        ("0 reddish 1 blue", 1, "reddish is not a colour"),
        ("0 gray101 1 blue", 1, "gray101 is not a colour"),
        ("0 1/2 1 3/4", 1, "a colour of RGB has 3 numbers"),
        ("0 p300/7 1 -", 1, "patterns cannot be drawn"),
        ("0 1 2 3 4 1 5 6 7 8", 1, "COLOR_MODEL = CMYK"),
        ("# COLOR_MODEL = CMYK\n0 1 2 3 1 4 5 6", 2, "needs four numbers"),
        ("# COLOR_MODEL = HSV\n0 361 1 1 1 0 0 0", 2, "361 is not a component of HSV"),
        ("1 red\n1 blue", 2, "the value 1 already has a colour"),
        ("1 red\n1 red 2 blue", 2, "either slices or single values"),
        ("0 red 1 blue\nB 1 2", 2, "a colour of RGB has 3 numbers"),
        ("0 red 1 blue\nF", 2, "expected a colour"),
    ],
)
def test_a_broken_table_is_refused_with_its_line(text: str, line: int, said: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse_cpt(text, "my.cpt")
    assert str(refused.value).startswith(f"my.cpt:{line}: ") and said in str(refused.value)


def test_an_empty_or_missing_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no colours in this table"):
        parse_cpt("# nothing\nB 0 0 0\n")
    with pytest.raises(UsageError, match=r"no\.cpt: No such file"):
        read_cpt(tmp_path / "no.cpt")


@pytest.mark.parametrize("table", [INVAR, INVAR2, VOLUME], ids=lambda t: t.name)
def test_the_strain_tables_are_white_at_zero_and_black_outside(table) -> None:
    breaks = table.breaks
    shades = np.round(255 * table.colours(breaks)).astype(int).tolist()
    assert len(breaks) == 11 and breaks[5] == 0.0
    assert shades[:6] == [[0, 0, 136], [0, 20, 160], [0, 40, 204], [0, 100, 255], [153, 255, 255], [255, 255, 255]]
    assert shades[6:] == [[255, 255, 153], [255, 100, 0], [204, 40, 0], [160, 20, 0], [136, 0, 0]]
    assert not table.colours(np.array([1.01, -1.01]) * breaks[-1]).any()
    assert table.position(breaks).tolist() == list(range(11))  # every slice equally long
    assert table.position(0.5 * (breaks[1:] + breaks[:-1])).tolist() == pytest.approx(np.arange(10) + 0.5)


def test_the_breaks_of_the_strain_tables() -> None:
    assert INVAR.breaks.tolist() == [-10000, -20, -1, -0.1, -0.03, 0, 0.02, 0.3, 1, 20, 10000]
    assert INVAR2.breaks.tolist() == [-16000, -800, -80, -4.8, -0.16, 0, 0.16, 4.8, 80, 800, 16000]
    np.testing.assert_allclose(VOLUME.breaks[3:], 100.0 * INVAR.breaks[3:], rtol=1e-15)
    assert VOLUME.breaks.min() == -100.0  # nothing shrinks by more


def test_the_stress_table_goes_from_dark_blue_to_dark_red_and_stays_there() -> None:
    table = stress_table(250.0)
    expected = {-1.0: (0, 0, 0.5), 0.0: (0, 0, 0.5), 31.25: (0, 0, 1), 93.75: (0, 1, 1), 125.0: (0.5, 1, 0.5),
                156.25: (1, 1, 0), 218.75: (1, 0, 0), 250.0: (0.5, 0, 0), 400.0: (0.5, 0, 0)}  # fmt: skip
    for value, shade in expected.items():
        assert table.colours(np.array(value)).tolist() == pytest.approx(shade)
