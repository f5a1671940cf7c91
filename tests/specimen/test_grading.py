"""Grading files, and how many grains of each size they make."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.specimen import counts as number_of
from hpcdem.pre.specimen.grading import grading, parse_grading, read_grading
from tests.specimen.shapes import EXAMPLE, WINDOW
from tests.tables import each


def test_counts_of_the_manuals_example() -> None:
    """f = 5, 20, 15, 60 %; sum f/d^2 = 0.0005 + 0.008 + 0.15 + 2.4 = 2.5585, so N_k = N f_k / d_k^2 / 2.5585."""
    g = grading(*EXAMPLE)
    assert g.fractions == pytest.approx([0.05, 0.20, 0.15, 0.60])
    assert number_of.exact_counts(g, 200) == pytest.approx([0.0391, 0.6254, 11.7256, 187.6099], abs=5e-5)
    assert number_of.counts(g, 200).tolist() == [0, 1, 12, 187]
    assert number_of.exact_counts(g, 4000) == pytest.approx([0.7817, 12.5073, 234.5124, 3752.1986], abs=5e-5)
    assert number_of.counts(g, 4000).tolist() == [1, 12, 235, 3752]
    assert number_of.exact_counts(g, 200, 3) == pytest.approx([0.0020, 0.0646, 6.0586, 193.8748], abs=5e-5)
    assert number_of.counts(g, 200, 3).tolist() == [0, 0, 6, 194]
    assert number_of.needed(g)[0] == pytest.approx(5117)


def test_counts_of_the_manuals_window() -> None:
    g = grading(*WINDOW)
    assert number_of.exact_counts(g, 200) == pytest.approx([0.8301, 1.4008, 1.8677, 29.8833, 166.0182], abs=5e-5)
    assert number_of.counts(g, 200).tolist() == [1, 1, 2, 30, 166]
    assert number_of.counts(g, 4000).tolist() == [17, 28, 37, 598, 3320]


def test_counts_solve_the_equations() -> None:
    """N_k d_k^q / f_k is the same for all classes, and they add up to N, for any N and rounding included."""
    g = grading((20.0, 7.0, 3.0, 1.1, 0.4), (100.0, 83.0, 41.0, 30.0, 5.0))
    for q in (2, 3):
        ratio = number_of.exact_counts(g, 1000, q) * g.sizes**q / g.fractions
        assert ratio == pytest.approx(ratio[0])
    for n in (1, 2, 3, 10, 999, 123457):
        whole, exact = number_of.counts(g, n), number_of.exact_counts(g, n)
        assert whole.sum() == n and (np.abs(whole - exact) < 1.0).all()


def test_classes_without_a_share_have_no_grains() -> None:
    g = grading((4.0, 2.0, 1.0), (100.0, 100.0, 0.0))
    assert number_of.counts(g, 50).tolist() == [0, 50, 0]
    assert number_of.needed(g).tolist() == [math.inf, 1.0, math.inf]


def test_realised_grading() -> None:
    """N = 200: masses 0, 25, 12, 46.75 of 83.75: finer than 1 mm 58.75 / 83.75 = 70.15 %, than 0.5 mm 55.82 %."""
    g = grading(*EXAMPLE)
    finer = number_of.percent_finer(number_of.counts(g, 200) * g.sizes**2)
    assert finer == pytest.approx([100, 100, 70.15, 55.82], abs=5e-3)
    finer = number_of.percent_finer(number_of.counts(g, 4000) * g.sizes**2)
    assert finer == pytest.approx([100, 93.64, 74.57, 59.63], abs=5e-3)


@pytest.mark.parametrize("q", [2, 3])
def test_rounding_is_within_one_per_cent_from_this_number_on(q: int) -> None:
    """Rounding moves a class by less than one grain, so from max over k of 100 (m - 1) d_k^q / sum(...) on, that is
    N >= 100 (m - 1) max(d^q) sum(f / d^q), the curve is right within 1 % everywhere."""
    g = grading(*WINDOW)
    enough = math.ceil(100 * (len(g.sizes) - 1) * (g.sizes[0] ** q) * (g.fractions / g.sizes**q).sum())
    for n in range(enough, enough + 50):
        finer = number_of.percent_finer(number_of.counts(g, n, q) * g.sizes**q)
        assert np.abs(finer - g.percent).max() < 1.0


@pytest.mark.parametrize("curve, first", [(WINDOW, 2569), (EXAMPLE, 13710)])
def test_number_from_which_on_the_curve_is_within_one_per_cent(curve: tuple, first: int) -> None:
    """The numbers in docs/specimens.md, found by trying all."""
    g = grading(*curve)

    def worst(n: int) -> float:
        return float(np.abs(number_of.percent_finer(number_of.counts(g, n) * g.sizes**2) - g.percent).max())

    assert worst(first - 1) >= 1.0 and all(worst(n) < 1.0 for n in range(first, first + 2000, 7))


def test_uniformity_and_curvature() -> None:
    """A straight line in log size from 1 mm (0 %) to 16 mm (100 %): d_p = 16^(p / 100), so Cu = 16^0.5 = 4 and
    Cc = 16^(0.6 - 0.1 - 0.6) = 16^-0.1."""
    g = grading((16.0, 4.0, 1.0), (100.0, 50.0, 0.0))
    assert g.uniformity == pytest.approx(4.0) and g.curvature == pytest.approx(16**-0.1)
    assert math.isnan(grading(*WINDOW).uniformity)


def test_file(tmp_path: Path) -> None:
    """Comments, empty lines, tabs, DOS line ends, a byte order mark, either order."""
    path = tmp_path / "curve.txt"
    path.write_bytes(b"\xef\xbb\xbf#example#\r\n\r\n0.5\t60 # finest\r\n1 75\r\n5  95\r\n10 100\r\n#example#\r\n")
    g = read_grading(path)
    assert (g.sizes.tolist(), g.percent.tolist()) == ([10, 5, 1, 0.5], [100, 95, 75, 60])
    with pytest.raises(HpcdemError, match=r"cannot read .*nothing"):
        read_grading(tmp_path / "nothing")


@each(
    "text, line, message",
    [
        ("", 1, "contains no rows"),
        ("# 1 2\n\n", 2, "contains no rows"),
        ("10 100\n5\n", 2, "read '5', expected a size in mm and the per cent finer"),
        ("10 100\n5 95 3\n", 2, "expected a size"),
        ("10 100\nfive 95\n", 2, "read 'five 95'"),
        ("10,100\n", 1, "read '10,100'"),
        ("1_0 100\n", 1, "read '1_0 100'"),
        ("10 100\n\n-5 95\n", 3, "size -5 mm, expected a number above 0"),
        ("10 100\n0 95\n", 2, "size 0 mm"),
        ("nan 100\n", 1, "size nan mm"),
        ("inf 100\n", 1, "size inf mm"),
        ("1e30 100\n", 1, "expected 1e-06 to 1e+09"),
        ("10 100\n5 101\n", 2, "101 % finer, expected 0 to 100"),
        ("10 100\n5 nan\n", 2, "nan % finer"),
        ("10 100\n5 95\n5 90\n", 3, "size 5 mm after 5 mm, expected falling sizes"),
        ("10 100\n5 95\n7 90\n", 3, "expected falling sizes"),
        ("1 10\n5 95\n3 100\n", 3, "expected rising sizes"),
        ("10 100\n5 50\n1 60\n", 3, "60 % finer than 1 mm, but 50 % finer than 5 mm"),
        ("10 99\n5 50\n", 1, "99 % finer than the largest size 10 mm, expected 100"),
        ("1 10\n5 50\n", 2, "50 % finer than the largest size 5 mm, expected 100"),
        ("\x00\x01 2\n", 1, "expected a size"),
        ("".join(f"{2000 - k} 100\n" for k in range(1500)), 1001, "more than 1000 rows"),
    ],
)
def test_what_is_no_grading(text: str, line: int, message: str) -> None:
    with pytest.raises(HpcdemError) as error:
        parse_grading(text, "curve.txt")
    assert str(error.value).startswith(f"curve.txt:{line}: ") and message in str(error.value)


def test_numbers_that_are_no_grading() -> None:
    with pytest.raises(CommandError, match="2 sizes and 1 percentages"):
        grading((2.0, 1.0), (100.0,))
    with pytest.raises(CommandError, match="grading, row 2: size 3 mm after 3 mm"):
        grading((3.0, 3.0), (100.0, 50.0))
