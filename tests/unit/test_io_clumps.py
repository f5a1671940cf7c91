"""Clump files: round trip, and everything that is refused, with its line; the command on good and bad ones."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.io.clumps import read_clumps, write_clumps
from tests.clumped import write_lattice
from tests.property.workers import Resident
from tests.tables import each

GOOD = """\
hpcdem clumps 1
# two bodies
clump 0.5 -1.25e-1 0.3 2.0 1.5 2   # a pair

-0.5 0 0.6
0.5 0 0.6
clump 4 0 0 3.0 3.0 1
0 0 1
"""


def test_round_trip_bit_for_bit(tmp_path):
    made = write_lattice(tmp_path / "a.clumps", 0.123456789, 6, 4)
    read = read_clumps(tmp_path / "a.clumps")
    for name, values in vars(made).items():
        assert vars(read)[name].dtype == values.dtype and (vars(read)[name] == values).all(), name
    write_clumps(tmp_path / "b.clumps", read)
    assert (tmp_path / "a.clumps").read_bytes() == (tmp_path / "b.clumps").read_bytes()
    assert len(read) == 24 and read.start[-1] == len(read.r)


def test_comments_blank_lines_and_windows_ends(tmp_path):
    for k, text in enumerate((GOOD, GOOD.replace("\n", "\r\n"), "\ufeff" + GOOD, "# first a note\n\n" + GOOD)):
        path = tmp_path / f"{k}.clumps"
        path.write_text(text, encoding="utf-8", newline="")
        c = read_clumps(path)
        assert c.x.tolist() == [0.5, 4.0] and c.y.tolist() == [-0.125, 0.0] and c.angle.tolist() == [0.3, 0.0]
        assert c.area.tolist() == [2.0, 3.0] and c.inertia.tolist() == [1.5, 3.0] and c.start.tolist() == [0, 2, 3]
        assert np.column_stack([c.dx, c.dy, c.r]).tolist() == [[-0.5, 0.0, 0.6], [0.5, 0.0, 0.6], [0.0, 0.0, 1.0]]


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new)


HOSTILE = {
    "empty": ("", ": is empty, expected a first line 'hpcdem clumps 1'"),
    "only comments": ("# nothing\n\n", ": is empty"),
    "another file": ("1.0 2.0 3.0\n", ":1: read '1.0 2.0 3.0', expected 'hpcdem clumps 1'"),
    "another version": (changed("clumps 1", "clumps 2"), ":1: read 'hpcdem clumps 2', expected 'hpcdem clumps 1'"),
    "no bodies": ("hpcdem clumps 1\n", ": contains no clumps"),
    "n = 0": (changed("3.0 3.0 1\n", "3.0 3.0 0\n"), ":7: read 'clump 4 0 0 3.0 3.0 0', expected a number"),
    "n not whole": (changed("3.0 3.0 1\n", "3.0 3.0 1.5\n"), ":7: .*expected a number of discs"),
    "n negative": (changed("3.0 3.0 1\n", "3.0 3.0 -1\n"), ":7: .*expected a number of discs"),
    "n huge": (changed("3.0 3.0 1\n", "3.0 3.0 1e12\n"), ":7: .*expected a number of discs from 1 to 1000000"),
    "negative radius": (changed("0 0 1\n", "0 0 -1\n"), ":8: read '0 0 -1', expected a radius above 0"),
    "no radius": (changed("0 0 1\n", "0 0 0\n"), ":8: .*expected a radius above 0"),
    "no area": (changed("3.0 3.0 1\n", "0 3.0 1\n"), ":7: .*expected an area above 0"),
    "no inertia": (changed("3.0 3.0 1\n", "3.0 -3.0 1\n"), ":7: .*expected an inertia above 0"),
    "inertia in other units": (changed("3.0 3.0 1\n", "3.0 3e6 1\n"), ":7: .*a radius of gyration of 1000 m"),
    "disc far away": (changed("0 0 1\n", "3e5 0 1\n"), ":8: read '3e5 0 1', expected a disc within 100 radii"),
    "disc twice": (changed("0.5 0 0.6\nclump", "-0.5 0 0.6\nclump"), ":6: .*expected a disc that this clump does not"),
    "body twice": (changed("clump 4 0", "clump 0.5 -0.125"), ":7: .*a position different from that of the clump"),
    "a disc is missing": (changed("0.5 0 0.6\nclump", "clump"), ":6: read 'clump 4 .*' after 1 discs, expected the 2"),
    "the end is missing": (changed("0 0 1\n", ""), ":7: the file ends after 0 discs, expected the 1 discs of the"),
    "a disc too many": (GOOD + "1 1 1\n", ":9: read '1 1 1', expected 'clump x y angle area inertia n', because the"),
    "words": (changed("0 0 1\n", "0 zero 1\n"), ":8: read '0 zero 1', expected 'dx dy r' of a disc, 3 numbers"),
    "a number is missing": (changed("0 0 1\n", "0 0\n"), ":8: .*'dx dy r' of a disc, 3 numbers"),
    "a number too many": (changed("4 0 0", "4 0 0 0"), ":7: .*expected 'clump x y angle area inertia n', 6 numbers"),
    "nan": (changed("4 0 0", "nan 0 0"), ":7: .*6 numbers"),
    "inf": (changed("0 0 1\n", "inf 0 1\n"), ":8: .*3 numbers"),
    "1_000": (changed("0 0 1\n", "0 0 1_0\n"), ":8: .*3 numbers"),
    "control characters": (changed("0 0 1\n", "0 \x1b[2J 1\n"), ":8: read '0  \\[2J 1'"),
}  # fmt: skip


@each("name", HOSTILE)
def test_bad_files_are_refused_with_their_line(tmp_path, name):
    text, message = HOSTILE[name]
    path = tmp_path / "bad.clumps"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(HpcdemError, match="bad.clumps" + message) as caught:
        read_clumps(path)
    assert "\n" not in str(caught.value) and "\x1b" not in str(caught.value)


def test_no_text_at_all(tmp_path):
    (tmp_path / "b.clumps").write_bytes(bytes(range(256)) * 20)
    with pytest.raises(HpcdemError, match=r"b\.clumps:\d+: read"):
        read_clumps(tmp_path / "b.clumps")
    with pytest.raises(HpcdemError, match=r"cannot read .*none\.clumps"):
        read_clumps(tmp_path / "none.clumps")
    with pytest.raises(HpcdemError, match="a folder with this name exists"):
        read_clumps(tmp_path)


def script(folder, line: str, text: str = GOOD):
    (folder / "a.clumps").write_text(text)
    (folder / "run.py").write_text(f"START\nSET dt 1e-3\n{line}\nPROP density 2 kn 10\nCYC 2\nSTOP\n")
    return folder / "run.py"


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_a_bad_file_stops_the_script_on_all_ranks(resident: Resident, tmp_path, ranks):
    """One message with both lines, exit code 2, nothing written."""
    done = resident(ranks, script(tmp_path, "CLUMP file a.clumps", changed("0 0 1\n", "0 0 -1\n")), cwd=tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == 2 and said.count("expected a radius above 0") == 1
    assert "run.py:3: CLUMP: " in said and "a.clumps:8: read '0 0 -1'" in said and "Traceback" not in said
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("CLUMP file none.clumps", "there is no file"),
        ("SET disk off\nCLUMP file a.clumps", "need SET disk on; it is off"),
        ("CLUMP file a.clumps\nSET disk hex", "SET disk is hex"),
        ("CLUMP file a.clumps x 1e15", "too far from the origin for its size"),
        ("CLUMP file a.clumps scale 1e-40", "out of range"),
        ("CLUMP RANGE id 0 1", "two particles or more, RANGE has 0"),
        ("CLUMP file a.clumps\nCLUMP RANGE id 0 2", "belongs to a clump already"),
    ],
)
def test_lines_that_cannot_be_carried_out(resident: Resident, tmp_path, line, message):
    done = resident(1, script(tmp_path, line), cwd=tmp_path)
    assert done.returncode == 2 and message in done.stdout + done.stderr
    assert not list(tmp_path.rglob("*.vtkhdf"))


def test_check_reports_the_file(resident: Resident, tmp_path):
    """--check counts the discs, and says when the file is not there."""
    done = resident(1, "--check", script(tmp_path, "CLUMP file a.clumps x 3"), cwd=tmp_path)
    assert done.returncode == 0 and "CLUMP file a.clumps x 3" in done.stdout
    assert any(row.split()[-1] == "3" for row in done.stdout.splitlines() if "CLUMP file" in row)
    done = resident(1, "--check", script(tmp_path, "CLUMP file b.clumps"), cwd=tmp_path)
    assert "line 3: file b.clumps not found in the folder of the script" in done.stdout
