"""PPDEM files: written, read back, sorted into kinds and sizes; what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.io.clumps import read_clumps, write_clumps
from hpcdem.io.ppdem import PpdemGrains, circles, read_ppdem, write_ppdem
from hpcdem.pre.specimen import Request, make_specimen
from hpcdem.pre.specimen.classes import classified
from hpcdem.pre.specimen.files import to_clumps, to_ppdem, xyr
from tests.specimen.shapes import KINDS, WINDOW
from tests.tables import each

ROWS = Path(__file__).parent / "ppdem_rows.txt"
"""Twelve triangles of the one sample file there is, a lost zero in the third put back."""


def test_sample() -> None:
    """Diameters 0.3 and 0.5 mm, anticlockwise, and angles that are 5 times the edges' angles about the centre in
    radians: read as degrees, 5 pi / 180 = 0.0872665 of them, all alike."""
    found = classified(read_ppdem(ROWS))
    assert (found.kind == "triangle").all() and len(found) == 12
    expected = np.full(12, 0.3)
    expected[[2, 5]] = 0.5
    assert 1e3 * found.size == pytest.approx(expected, rel=1e-9)
    assert found.sizes == pytest.approx([0.5, 0.3]) and found.counts.tolist() == [2, 10]
    assert found.roundness == pytest.approx(np.full(12, 5 * math.pi / 180), rel=1e-6)
    grains = read_ppdem(ROWS)
    assert np.degrees(grains.theta).reshape(-1, 3).sum(1) == pytest.approx(np.full(12, 10 * math.pi), rel=1e-9)
    # With the factor the angles are those of the edges: the outlines become circles.
    round_ = classified(read_ppdem(ROWS, angle_factor=5 * math.pi / 180))
    assert round_.area == pytest.approx(math.pi / 4 * round_.size**2, rel=1e-6)


@pytest.mark.some_of_each
@pytest.mark.parametrize("layout", ["sample", "full"])
@pytest.mark.parametrize("shape", KINDS)
def test_written_and_read_back(tmp_path: Path, shape: str, layout: str) -> None:
    """All numbers to 12 digits; written again the same bytes; kinds, sizes, roundness and grading are those made."""
    made = make_specimen(Request(*WINDOW, shape, 600, seed=4, **KINDS[shape]))
    layout = "sample" if shape == "ellipse" else layout
    grains = to_ppdem(made)
    write_ppdem(tmp_path / "a.dat", grains, layout)
    back = read_ppdem(tmp_path / "a.dat")
    write_ppdem(tmp_path / "b.dat", back, layout)
    assert (tmp_path / "a.dat").read_bytes() == (tmp_path / "b.dat").read_bytes()
    for name in ("start", "x", "y", "theta", "diameter"):
        assert getattr(back, name) == pytest.approx(getattr(grains, name), rel=1e-11, abs=0)
    found = classified(back)
    assert (found.kind == shape).all()
    assert found.size == pytest.approx(made.size, rel=1e-8)
    # Sizes are those with grains.
    assert found.sizes == pytest.approx([row.size for row in made.rows if row.count], rel=1e-8)
    assert found.counts.tolist() == [row.count for row in made.rows if row.count]
    assert found.grading.percent == pytest.approx([row.by_area for row in made.rows if row.count], rel=1e-8)
    if shape != "ellipse":
        assert found.roundness == pytest.approx(np.full(600, KINDS[shape].get("roundness", 1.0)), rel=1e-8)
    if shape in ("triangle", "quadrilateral", "pentagon") and layout == "full":
        assert (back.roundness == KINDS[shape]["roundness"]).all()
    classes = classified(back, made.grading.sizes)
    assert (classes.class_of == made.class_of).all()


def test_layouts(tmp_path: Path) -> None:
    """The lines of a square of roundness 1/4 and of a circle, as they should be."""
    square = PpdemGrains(
        np.array([0, 4]), np.array([1.0, 0.0, -1.0, 0.0]), np.array([0.0, 1.0, 0.0, -1.0]),
        np.full(4, math.radians(22.5)), np.zeros(1), np.full(4, 0.25),
    )  # fmt: skip
    path = tmp_path / "a.dat"
    for layout, factor, line in (
        ("sample", 1.0, "4 1 0 0 1 -1 0 0 -1 22.5 22.5 22.5 22.5"),
        ("full", 1.0, "4 1 0 0 1 -1 0 0 -1 0.25 0.25 0.25 0.25 22.5 22.5 22.5 22.5"),
        ("sample", 0.1, "4 1 0 0 1 -1 0 0 -1 2.25 2.25 2.25 2.25"),
    ):
        write_ppdem(path, square, layout, factor)
        assert path.read_bytes().decode() == f"1 1\n{line}\n"
        assert read_ppdem(path, angle_factor=factor).theta == pytest.approx(square.theta)
    disc = circles(np.array([0.001]), np.array([2.5]), np.array([0.3]))
    for layout, line in (("sample", "1 0.001 2.5 0.3 0.3"), ("plain", "0.001 2.5 0.3 0.3")):
        write_ppdem(path, disc, layout)
        assert path.read_text() == f"1 1\n{line}\n"
        assert (read_ppdem(path).x[0], read_ppdem(path).diameter[0]) == (0.001, 0.3)
    with pytest.raises(HpcdemError, match="'plain' supports circles only"):
        write_ppdem(path, square, "plain")
    with pytest.raises(HpcdemError, match="needs the roundness"):
        write_ppdem(path, read_ppdem(ROWS), "full")
    assert path.read_text().endswith("0.3\n"), "what was there has been overwritten"


@pytest.mark.parametrize("words_per_line", [1, 3, 1000])
def test_line_ends_mean_nothing(tmp_path: Path, words_per_line: int) -> None:
    words = ROWS.read_text().split()
    lines = [" ".join(words[k : k + words_per_line]) for k in range(0, len(words), words_per_line)]
    (tmp_path / "a.dat").write_bytes("\r\n".join(lines).encode())
    assert (read_ppdem(tmp_path / "a.dat").x == read_ppdem(ROWS).x).all()


def test_mixed_kinds(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_text("3 1\n1 0 0 2 2\n3 5 0 4 1 3 0 10 10 10\n6 2 0 1 2 -1 2 -2 0 -1 -2 1 -2 0 0 0 0 0 0\n")
    found = classified(read_ppdem(path))
    assert found.kind.tolist() == ["circle", "triangle", "polyarc"]
    assert found.size[:2] == pytest.approx([2.0, 2.0])
    assert found.area[2] == pytest.approx(12.0)


@each(
    "text, line, message",
    [
        ("", 1, "contains no grains"),
        ("4000\n", 1, "contains no grains"),
        ("x 1\n", 1, "read 'x', expected a number"),
        ("1 1\n3 0 0 1 0 0 1 1_0 1 1\n", 2, "read '1_0', expected a number"),
        ("-1 1\n0 0 1 1\n", 1, "read -1, expected the number of grains"),
        ("1.5 1\n0 0 1 1\n", 1, "read 1.5, expected the number of grains"),
        ("1 1.5\n0 0 1 1\n", 1, "read 1.5, expected a whole number"),
        ("1000000000 1\n0 0 1 1\n", 1, "1000000000 grains announced, but only 4 numbers follow"),
        ("1 1\n3 0 0 1 0\n0 1 5 5\n", 3, "ends within grain 1"),
        ("1 1\n3 0 0 1 0\n0 1 5 5 5\n7\n", 4, "continues after 1 grains, expected the end"),
        ("2 1\n3 0 0 1 0 0 1 5 5 5\n2 0 0 1 0 5 5\n", 3, "grain 2: read 2, expected its number of arcs"),
        ("1 1\n99 0 0 1 0 0 1 5 5 5\n", 2, "grain 1: read 99"),
        ("1 1\n3.5 0 0 1 0 0 1 5 5 5\n", 2, "grain 1: read 3.5"),
        ("1 1\n3 0 0 nan 0 0 1 5 5 5\n", 2, "read nan, expected a number"),
        ("1 1\n3 0 0 1e300 0 0 1 5 5 5\n", 2, "expected a number of ordinary size"),
        ("1 1\n3 0 0 1 0 0 1\n5 -5 5\n", 3, "read -5, expected the central angle"),
        ("1 1\n3 0 0 1 0 0 1\n5 5 360\n", 3, "read 360, expected the central angle of an arc, 0 to below 360"),
        ("1 1\n3 0 0 0 1 1 0 5 5 5\n", 2, "not in anticlockwise order"),
        ("1 1\n3 0 0 0 0 0 0 5 5 5\n", 2, "not in anticlockwise order"),
        ("1 1\n1 0 0 1 2\n", 2, "read 1 and 2, expected the diameter of a circle, above 0, twice"),
        ("1 1\n0 0 -1 -1\n", 2, "expected the diameter of a circle"),
        ("2 1\n0 0 1 1\n0 5 0 0\n", 3, "expected the diameter of a circle"),
    ],
)
def test_what_is_no_file_of_grains(tmp_path: Path, text: str, line: int, message: str) -> None:
    path = tmp_path / "a.dat"
    path.write_text(text)
    with pytest.raises(HpcdemError) as error:
        read_ppdem(path)
    assert str(error.value).startswith(f"{path}:{line}: ") and message in str(error.value)


def test_printed_sample_is_refused_where_a_zero_is_lost(tmp_path: Path) -> None:
    (tmp_path / "a.dat").write_text(ROWS.read_text().replace("0.000262679314715", "0.00262679314715"))
    with pytest.raises(HpcdemError, match=r"a\.dat:6: grain 3: its end points are not in anticlockwise"):
        read_ppdem(tmp_path / "a.dat")


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(HpcdemError, match=r"cannot read .*does not exist"):
        read_ppdem(tmp_path / "nothing.dat")
    (tmp_path / "binary.dat").write_bytes(bytes(range(256)) * 10)
    with pytest.raises(HpcdemError, match=r"binary\.dat:\d+: read '.*', expected a number"):
        read_ppdem(tmp_path / "binary.dat")


def test_xyr_and_clumps(tmp_path: Path) -> None:
    made = make_specimen(Request(*WINDOW, number=100))
    rows = [line.split() for line in xyr(made).splitlines()]
    assert np.array([row[:3] for row in rows], float).T == pytest.approx(np.stack([made.x, made.y, made.size / 2]))
    assert {row[3] for row in rows} == {f"d{row.size:g}mm" for row in made.rows if row.count}
    clumps, _ = to_clumps(make_specimen(Request(*WINDOW, "pentagon", 50, **KINDS["pentagon"])))
    write_clumps(tmp_path / "a.clumps", clumps)
    back = read_clumps(tmp_path / "a.clumps")
    assert all((getattr(back, name) == getattr(clumps, name)).all() for name in vars(clumps))
