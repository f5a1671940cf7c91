"""Frames as .dat text: what public readers rely on, reading back, and files as ZDEM writes them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.dat import read_dat, write_dat
from hpcdem.io.frame import Frame
from tests.unit.io_synthetic import GROUPS, assert_same, make_frame

ROOT = Path(__file__).resolve().parents[2]


def written(tmp_path: Path, frame: Frame) -> Path:
    path = tmp_path / "all_0000046000.dat"
    write_dat(path, frame, SerialComm())
    return path


def test_headers_and_section_lines(tmp_path: Path) -> None:
    lines = written(tmp_path, make_frame(30)).read_text().split("\n")
    starts = {
        "wall": "     index         id      P1[0]",
        "wall force": "     index         id         xF",
        "ball": "     index         id                    x",
        "ball data": "     index         id            m",
        "wall contact": "   wall_id    ball_id",
        "contact and bond": "       id1        id2",
    }
    for name, start in starts.items():
        assert sum(line.startswith(start) for line in lines) == (2 if name == "contact and bond" else 1), name
    sections = [line for line in lines if line.endswith("data ...")]
    assert sections == [f"{s} data ..." for s in ("parameter", "wall", "wall contact", "ball", "contact", "bond")]
    top = [line.partition(":") for line in lines[: lines.index("wall data ...")]]
    head = {key.strip(): value.split() for key, _, value in top}
    assert lines[0].startswith("version    : 2.2") and head["filename"] == ["all_0000046000.dat"]
    assert head["current_step"] == ["46000"] and "ball_num: 30" in lines and head["left"] == ["0.000000000000e+00"]
    assert head["disk"] == ["off=ball"] and head["frac"] == ["nan"] and len(head["gravity"]) == 2
    assert "wall num : 7" in lines and "ball num : 30" in lines
    # Every table ends with exactly one blank line, the last one at the end of the file.
    assert lines[-2:] == ["", ""] and lines[-3]
    assert "" in lines and not any(a == b == "" for a, b in pairwise(lines[:-1]))
    # BOX walls come first.
    at = next(i for i, line in enumerate(lines) if line.startswith(starts["wall"]))
    assert [int(line.split()[1]) for line in lines[at + 1 : at + 8]] == [100, 101, 102, 103, 0, 1, 2]


ZDEM = (Path(__file__).parent / "io_zdem_2.2.dat").read_text()
"""Laid out like the public file of ZDEM 2.2 that io/dat.py names; the numbers are ours."""


def tables(text: str) -> list[tuple[str, list[str]]]:
    """(section, words of the header) of every table of a frame, in order."""
    found: list[tuple[str, list[str]]] = []
    section = ""
    for line in text.splitlines():
        words = line.split()
        if line.endswith(" data ..."):
            section = line
        elif words[:1] in (["index"], ["id1"], ["wall_id"]):
            found.append((section, words))
    return found


def test_tables_and_columns_are_those_of_zdem(tmp_path: Path) -> None:
    """The same tables in the same order, each with ZDEM's columns first; those of hpcdem follow. A wall contact of the
    sample is shortened, in the public file it has the columns of a contact, without Un."""
    ours = tables(written(tmp_path, make_frame(30)).read_text())
    theirs = tables(ZDEM)
    assert [section for section, _ in ours] == [section for section, _ in theirs]
    own = {k: words[len(w) :] for k, ((_, words), (_, w)) in enumerate(zip(ours, theirs))}
    for (section, words), (_, wanted) in zip(ours, theirs):
        if section != "wall contact data ...":
            assert words[: len(wanted)] == wanted, section
    contact = "Fn Fs globalFx globalFy kn ks n_bond s_bond frci slip realkn realks".split()
    assert ours[2][1] == ["wall_id", "ball_id", *contact, "x", "y", "Un"]
    assert [own[k] for k in (0, 1, 3, 4, 5, 6)] == [[], [], [], [], ["angle"], ["x", "y"]]
    assert own[7] == ["x", "y", "kind", "ebmod", "gbmod", "tstr", "sstr"]


def public_reader(path: Path) -> dict[str, Any]:
    """Line by line, by the rules that readers of ZDEM files in public repositories follow: switches set by pieces of
    header lines, and in each list the last line taken away because it is the blank one."""
    lists: dict[str, list[list[str]]] = {name: [] for name in ("wall", "ball", "contact", "bond", "group")}
    state, after_contact, after_bond = None, False, False
    for line in path.read_text().splitlines():
        words = line.split()
        if "     index         id      P1[0]" in line:
            state = "wall"
        elif "     index         id                    x" in line:
            state = "ball"
        elif "     index         id            m" in line:
            state = "group"
        elif "contact data ..." in line:
            after_contact = True
        elif "id1" in line and after_contact:
            state = "contact"
        elif "bond data ..." in line:
            state, after_contact, after_bond = "bond", False, True
        elif "       id1" in line and after_bond:
            state = "bond"
        elif "     index         id         xF" in line:
            state = None
        elif state == "group":
            if len(words) > 10:
                lists["group"].append([words[1], words[10]])
            elif words:
                state = None
        elif state:
            lists[state].append(words)
    return {name: rows if name == "group" else rows[:-1] for name, rows in lists.items()}


def test_public_readers_find_what_they_expect(tmp_path: Path) -> None:
    frame = make_frame(60)
    found = public_reader(written(tmp_path, frame))
    particles, contacts, bonds = (frame.tables[k].columns for k in ("particles", "contacts", "bonds"))
    assert [int(row[1]) for row in found["wall"]] == frame.walls["id"].tolist()
    places = np.array([row[2:4] for row in found["wall"]], float)
    np.testing.assert_allclose(places, frame.walls["p1"], rtol=1e-12)
    balls = np.array(found["ball"], float)
    np.testing.assert_array_equal(balls[:, 1], particles["gid"])
    for k, name in ((2, "x"), (3, "y"), (4, "radius"), (5, "color")):
        np.testing.assert_allclose(balls[:, k], particles[name], rtol=1e-8)
    expected = [[str(g), GROUPS[k]] for g, k in zip(particles["gid"], particles["group"])]
    assert found["group"][:60] == expected  # rows of the third table follow, as in ZDEM's own frames
    for name, table in (("contact", contacts), ("bond", bonds)):
        rows = np.array(found[name], float)
        np.testing.assert_array_equal(rows[:, 0], table["id1"])
        np.testing.assert_array_equal(rows[:, 1], table["id2"])
        np.testing.assert_allclose(rows[:, 2], table["fn"], rtol=1e-8)
        # The force of id1 on id2, as in ZDEM; a Frame holds the force on id1.
        np.testing.assert_allclose(rows[:, 4], -table["fx"], rtol=1e-8)


def test_what_was_written_is_read(tmp_path: Path) -> None:
    frame = make_frame(300)
    back = read_dat(written(tmp_path, frame))
    assert (back.step, back.time, back.dt) == (frame.step, frame.time, frame.dt)
    for name, value in frame.settings.items():
        assert back.settings[name] == value or np.isnan(value)
    assert back.walls.keys() == frame.walls.keys()
    for name, values in frame.walls.items():
        np.testing.assert_allclose(back.walls[name], values, rtol=6e-9)
        assert back.walls[name].dtype == values.dtype
    for name, table in frame.tables.items():
        other = back.tables[name]
        assert other.columns.keys() == table.columns.keys()
        assert (other.offset, other.total) == (0, table.total)
        for column, values in table.columns.items():
            got = other.columns[column]
            assert got.dtype == values.dtype, column
            if column == "group":
                assert [back.group_names[k] for k in got] == [GROUPS[k] for k in values]
            elif values.dtype.kind == "f":
                digits = 13 if name == "particles" and column in "xy" else 9
                np.testing.assert_allclose(got, values, rtol=0.51 * 10.0 ** (1 - digits), err_msg=f"{name} {column}")
            else:
                np.testing.assert_array_equal(got, values)


def test_only_the_tables_asked_for_are_read(tmp_path: Path) -> None:
    back = read_dat(written(tmp_path, make_frame(40)), ("particles",))
    assert len(back.tables["particles"]) == 40 and len(back.walls["id"]) == 7
    assert [len(back.tables[k]) for k in ("contacts", "bonds", "wall_contacts")] == [0, 0, 0]
    assert len(read_dat(written(tmp_path, make_frame(40)), ()).tables["particles"]) == 0


def test_tables_are_read_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever they are cut; with line ends of both kinds, and where files cannot be mapped."""
    path = written(tmp_path, make_frame(200))
    whole = read_dat(path)
    text = path.read_bytes()
    for size in (400, 777, 5000):
        monkeypatch.setattr("hpcdem.io.dat._PIECE", size)
        assert_same(read_dat(path), whole)
    path.write_bytes(text.replace(b"\n", b"\r\n"))
    assert_same(read_dat(path), whole)
    path.write_bytes(text)

    def refuse(*_: Any, **__: Any) -> None:
        raise OSError("no maps here")

    monkeypatch.setattr("hpcdem.io.dat.mmap.mmap", refuse)
    assert_same(read_dat(path), whole)


def test_large_numbers_keep_their_places_apart(tmp_path: Path) -> None:
    frame = make_frame(3)
    columns = frame.tables["particles"].columns
    columns["gid"] = np.array([1, 2, 10**15])
    columns["x"] = np.array([-1.2345678901234e-200, np.nan, -np.inf])
    for name in ("contacts", "bonds", "wall_contacts"):
        frame.tables[name].columns = {k: v[:0] for k, v in frame.tables[name].columns.items()}
    back = read_dat(written(tmp_path, frame)).tables["particles"].columns
    np.testing.assert_array_equal(back["gid"], columns["gid"])
    np.testing.assert_allclose(back["x"], columns["x"], rtol=1e-12)


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_a_file_as_zdem_writes_it(tmp_path: Path, line_end: str) -> None:
    path = tmp_path / "all_0000000100.dat"
    path.write_bytes(ZDEM.replace("\n", line_end).encode())
    frame = read_dat(path)
    assert (frame.step, frame.dt, frame.time) == (100, 0.02, 2.0)
    box = {"left": 0.0, "right": 1200.0, "bottom": 0.0, "height": 900.0}
    assert frame.settings == box | {"gx": 0.0, "gy": -9.81, "disk": "off", "frac": 0.7, "lsm": 0.25}
    walls = frame.walls
    assert walls["id"].tolist() == [100, 0] and walls["color"].tolist() == [5, 3]
    np.testing.assert_array_equal(walls["p2"], [[1200.0, 0.0], [1200.0, 10.0]])
    np.testing.assert_array_equal(walls["v"], [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(walls["force"][:, 1], [0.0, -250.5])

    p = frame.tables["particles"].columns
    assert p["gid"].tolist() == [0, 4, 7]
    assert p["x"].tolist() == [100.5, 61.0, 190.125] and p["radius"].tolist() == [50.0, 50.0, 60.0]
    assert p["fix"].tolist() == [0, 2, 5] and p["hertz"].tolist() == [1, 1, 0]
    assert [frame.group_names[k] for k in p["group"]] == ["ball_rand", "ball_rand", "sed"]
    np.testing.assert_allclose(p["inertia"], 0.4 * p["mass"] * p["radius"] ** 2, rtol=1e-4)
    assert p["vx"].tolist() == [0.25, -0.25, 1.75] and p["spin"].tolist() == [0.0, 0.01, 0.0]
    assert p["density"].tolist() == [2500.0] * 3
    assert "angle" not in p  # not in the file, so not made up

    c = frame.tables["contacts"].columns
    assert list(zip(c["id1"], c["id2"])) == [(0, 4), (0, 7), (4, 7)]
    assert c["overlap"].tolist() == [2.75, 1.25, 3.5]
    # ZDEM lists what id1 does to id2: particle 0 pushes 7, on its right, to the right, and is itself pushed left.
    assert c["fx"].tolist() == [4e9, -8e9, -3e9]
    assert len(frame.tables["bonds"]) == 0
    w = frame.tables["wall_contacts"].columns
    assert (w["id1"].tolist(), w["wall"].tolist(), w["fy"].tolist()) == ([4], [1], [250.5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no line current_step"),
        (ZDEM[: ZDEM.index("         2          4 ")], "3 balls announced, 2 found. The file may be truncated"),
        (ZDEM[: ZDEM.index("8.0000000000")], "rows of unequal length"),
        (ZDEM.replace("         2          4  -2.50e-01", "         2          5  -2.50e-01"), "not list the same ids"),
    ],
)
def test_damaged_files_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.dat"
    path.write_text(text)
    with pytest.raises(HpcdemError, match=rf"cannot read .*bad\.dat: .*{message}"):
        read_dat(path)
    with pytest.raises(HpcdemError, match="there is no such file"):
        read_dat(tmp_path / "none.dat")


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from mpi4py import MPI
from hpcdem.halo.comm import MpiComm
from hpcdem.io.dat import write_dat
from hpcdem.io.ps import write_ps
from hpcdem.io.vtk import write_vtk
from tests.unit.io_synthetic import make_frame

comm = MpiComm(MPI.COMM_WORLD)
for n in (1, 400):
    frame = make_frame(n, comm)
    write_dat(f"{n}.dat", frame, comm)
    write_ps(f"{n}.ps", frame, comm)
    write_vtk(f"{n}.vtk", frame, comm)
"""


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_any_number_of_ranks_writes_the_same_bytes(launch: Any, tmp_path: Path, ranks: int) -> None:
    from hpcdem.io.ps import write_ps
    from hpcdem.io.vtk import write_vtk, write_wall_vtk

    (tmp_path / "program.py").write_text(PROGRAM)
    done = launch.python(ranks, "program.py", ROOT, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    for n in (1, 400):
        for name, write in (("{}.dat", write_dat), ("{}.ps", write_ps), ("{}.vtk", write_vtk)):
            serial = tmp_path / "serial" / name.format(n)  # a .dat holds its name
            serial.parent.mkdir(exist_ok=True)
            write(serial, make_frame(n), SerialComm())
            assert (tmp_path / name.format(n)).read_bytes() == serial.read_bytes(), (name, n)
        write_wall_vtk(tmp_path / "walls", make_frame(n), SerialComm())
        assert (tmp_path / f"wall_{n}.vtk").read_bytes() == (tmp_path / "walls").read_bytes()
