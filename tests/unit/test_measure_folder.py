"""`hpcdem measure DIR`: from a folder of frames to tables and figures; what it refuses; on any number of ranks."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.measure import measure, request, work
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.dat import write_dat
from hpcdem.io.frames import read_frame
from hpcdem.post.section import write_section
from tests.unit import section_synthetic
from tests.unit.measured import DEPTH, DIP, FOOT, LENGTH, SLIP, R, chain, frame, lattice, thrust, write

HEAVE = SLIP * np.cos(np.radians(DIP))
NUMBERS = ["--format", "none"]


class Log:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)

    warn = info


def run(folder: Path, *words: object, figures: bool = False) -> list[str]:
    """`hpcdem measure` in this process; its lines."""
    log = Log()
    given = [str(folder), *map(str, words), *([] if figures else NUMBERS)]
    work(SerialComm(), log, read_command_line(measure, "hpcdem measure", given))  # type: ignore[arg-type]
    return log.lines


def table(folder: Path, name: str) -> list[dict[str, str]]:
    with open(folder / f"{name}.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name] or "nan") for row in rows])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The thrust of `measured.py` and all its measures."""
    folder = thrust(tmp_path_factory.mktemp("measured") / "data")
    run(folder)
    return folder


# --- what is measured --------------------------------------------------------------------------------------------


def test_frames_begin_where_the_wall_begins_to_move(folder: Path, tmp_path: Path) -> None:
    """... in the order in which they were written; and --from 0 takes all."""
    rows = table(folder / "measure", "wedge")
    assert [(row["step"], row["ini"]) for row in rows] == [("2000", "1"), ("3000", "0"), ("3000", "1"), ("4000", "0")]
    assert column(rows, "shortening[m]") == pytest.approx([0.0, HEAVE, HEAVE, 2 * HEAVE])
    assert column(rows, "time[s]") == pytest.approx([100.0, 150.0, 150.0, 200.0])
    lines = run(folder, "wedge", "--from", 0, "--to", 3000, "-o", tmp_path)
    assert any(
        "no wedge yet in 2 frames, steps 1000 to 2000; at step 1000: the surface is flat" in one for one in lines
    )
    assert len(table(tmp_path, "wedge")) == 4 and "all_0000001000 to all_0000003000_ini; wall 1 moves" in lines[0]
    assert "--from 0" not in lines[0]


def test_surface_is_the_top_of_the_grains(folder: Path, tmp_path: Path) -> None:
    run(folder, "surface", "--width", 100, "--xmove", 1000, "--ymove", -50, "-o", tmp_path)
    rows = [row for row in table(tmp_path, "surface") if row["step"] == "4000"]
    x, y = column(rows, "x[m]") - 1000.0, column(rows, "height[m]") + 50.0
    top = FOOT + DEPTH / np.tan(np.radians(DIP))
    level = np.median(y[x > top + 500.0])
    assert level == pytest.approx(DEPTH, abs=2.0 * R)
    lifted = y[(x > 2.0 * HEAVE + 200.0) & (x < top)]
    assert np.median(lifted) - level == pytest.approx(2.0 * SLIP * np.sin(np.radians(DIP)), abs=10.0)
    assert np.diff(x).min() > 0.0


def test_wedge_of_the_last_frame(folder: Path) -> None:
    row = table(folder / "measure", "wedge")[-1]
    assert float(row["base_slope[deg]"]) == 0.0 and row["taper[deg]"] == row["surface_slope[deg]"]
    assert float(row["height[m]"]) == pytest.approx(DEPTH + 2.0 * SLIP * np.sin(np.radians(DIP)), abs=3.0 * R)
    assert float(row["width[m]"]) == pytest.approx(float(row["toe_x[m]"]) - 2.0 * HEAVE)
    flat = table(folder / "measure", "wedge")[0]
    assert flat["height[m]"] == "" and flat["note"].startswith("no wedge yet: the surface is flat") and not row["note"]


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", ["vtkhdf", "dat"])
@pytest.mark.parametrize(("fix", "counts"), [(3, False), (7, False), (1, True), (0, True)])
def test_rows_that_represent_walls_are_no_surface(
    folder: Path, tmp_path: Path, kind: str, fix: int, counts: bool
) -> None:
    """A column of particles 17 km high at the left end, fixed along x and y: the crest is that of the bed. Fixed along
    x only, or not at all, it is a part of the bed."""
    f = read_frame(folder / "all_0000004000.vtkhdf")
    p = f.tables["particles"].columns
    column_y = np.arange(R, 17_000.0, 2.0 * R)
    n, wall = len(column_y), float(f.walls["p1"][1, 0])
    new = {"gid": 10**6 + np.arange(n), "x": np.full(n, wall - 2.0 * R), "y": column_y, "radius": np.full(n, R)}
    p["fix"] = np.zeros(len(p["gid"]), np.uint8)
    new["fix"] = np.full(n, fix, np.uint8)
    for name, values in p.items():
        p[name] = np.concatenate([values, new.get(name, np.zeros(n))]).astype(values.dtype)
    f.tables["particles"].total = len(p["gid"])
    if kind == "dat":
        write_dat(tmp_path / "all_0000004000.dat", f, SerialComm())
    else:
        write(tmp_path, f)
    lines = run(tmp_path, "wedge", "surface", "--from", 0)
    high = max(column(table(tmp_path / "measure", "surface"), "height[m]"))
    crest = float(table(tmp_path / "measure", "wedge")[-1]["crest_y[m]"])
    assert (high > 16_900.0, crest > 16_900.0) == (counts, counts)
    assert any(f"{n} particles fixed along x and y" in line for line in lines) == (not counts)
    assert counts or crest == pytest.approx(float(table(folder / "measure", "wedge")[-1]["crest_y[m]"]), abs=1.0)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_row_of_particles_that_pushes_counts_as_the_wall(folder: Path, tmp_path: Path, mirror: float) -> None:
    """Wall 1 replaced by a row of fixed particles with its face where the wall was, over a base of fixed particles that
    moves as far: the same shortening, width and frames; also from the right."""
    up = np.arange(R, 9000.0, 2.0 * R)
    for path in folder.glob("all_*.vtkhdf"):
        f = read_frame(path)
        p, n = f.tables["particles"].columns, len(up) + 8
        wall = float(f.walls["p1"][1, 0])
        x = np.append(np.full(len(up), wall - R), wall - R - 2.0 * R * np.arange(8))
        new = {"gid": 10**6 + np.arange(n), "x": x, "y": np.append(up, np.full(8, -R)), "radius": np.full(n, R)}
        p["fix"] = np.zeros(len(p["gid"]), np.uint8)
        new["fix"] = np.full(n, 3, np.uint8)
        for name, values in p.items():
            p[name] = np.concatenate([values, new.get(name, np.zeros(n))]).astype(values.dtype)
        p["x"] *= mirror
        f.walls["p1"][:, 0] *= mirror
        f.walls["p2"][:, 0] *= mirror
        f.tables["particles"].total = len(p["gid"])
        for name in f.walls:
            f.walls[name] = f.walls[name][:1]
        write(tmp_path, f, path.stem.endswith("_ini"))
    lines = run(tmp_path, "wedge")
    assert f"{len(up) + 8} particles fixed along x and y push" in lines[0]
    here, there = table(tmp_path / "measure", "wedge"), table(folder / "measure", "wedge")
    for name in ("step", "shortening[m]", "width[m]", "height[m]"):
        assert column(here, name) == pytest.approx(column(there, name), nan_ok=True, abs=200.0 if mirror < 0 else 1e-6)
    assert column(here, "shortening[m]") == pytest.approx(column(there, "shortening[m]"), abs=1e-6)


def test_a_model_pushed_from_the_right_is_the_mirror_image(folder: Path, tmp_path: Path) -> None:
    for path in folder.glob("all_*.vtkhdf"):
        f = read_frame(path)
        p = f.tables["particles"].columns
        p["x"], f.walls["p1"][:, 0], f.walls["p2"][:, 0] = -p["x"], -f.walls["p1"][:, 0], -f.walls["p2"][:, 0]
        write(tmp_path, f, path.stem.endswith("_ini"))
    run(tmp_path, "wedge", "faults")
    here, there = table(tmp_path / "measure", "wedge"), table(folder / "measure", "wedge")
    assert column(here, "shortening[m]") == pytest.approx(column(there, "shortening[m]"))
    assert float(here[-1]["toe_x[m]"]) == pytest.approx(-float(there[-1]["toe_x[m]"]), abs=200.0)
    assert float(here[-1]["height[m]"]) == pytest.approx(float(there[-1]["height[m]"]))
    assert {row["vergence"] for row in table(tmp_path / "measure", "faults")} == {"left"}
    assert {row["dips_to"] for row in table(tmp_path / "measure", "faults")} == {"right"}


def test_the_thrust_is_found_from_frame_to_frame(folder: Path) -> None:
    rows = table(folder / "measure", "faults")
    assert [row["step"] for row in rows] == ["3000", "4000"]  # nothing moves while grains are deleted
    for row in rows:
        assert float(row["dip[deg]"]) == pytest.approx(DIP, abs=4.0)
        assert (row["dips_to"], row["vergence"], row["sense"]) == ("left", "right", "reverse")
        assert row["strain_since"] == "frame before" and float(row["mean_strain"]) > 0.2
        assert float(row["length[m]"]) == pytest.approx(DEPTH / np.sin(np.radians(DIP)), rel=0.25)


def test_sections_are_taken_where_there_are_some(tmp_path: Path) -> None:
    """The three thrusts and the backthrust of the synthetic sections, by their slope in `bands`."""
    x, y = lattice(4000.0, 1000.0)
    for step, push in ((6000, 0.0), (46000, 8000.0)):
        write(tmp_path, frame(step, x, y, push), ini=step == 6000)
    first, last = section_synthetic.wedge(6000, initial=True), section_synthetic.wedge(46000, 8000.0)
    (tmp_path / "ss" / "data").mkdir(parents=True)
    for section in (first, last):
        write_section(section, tmp_path / "ss" / "data" / f"{section.name}.npz")
    lines = run(tmp_path, "faults", "--strain", 1.5, "--xmove", 500.0, figures=True)
    assert any("faults.csv, faults.png" in line for line in lines)
    rows = table(tmp_path / "measure", "faults")
    assert {row["step"] for row in rows} == {"46000"} and {row["strain_since"] for row in rows} == {"first section"}
    slope = np.degrees(np.arctan(0.55))
    longest = sorted(rows, key=lambda row: -float(row["length[m]"]))[:3]
    for row in longest:
        assert float(row["dip[deg]"]) == pytest.approx(slope, abs=5.0)
        assert row["sense"] == "reverse"
    assert {row["vergence"] for row in rows} == {"left", "right"}
    # y = 0.55 (x - root) for the foremost one, which has its root 3.5 km per fault from the wall
    root = float(longest[0]["x[m]"]) - 500.0 - float(longest[0]["y[m]"]) / 0.55
    assert min(abs(root - r) for r in (8000.0, 11500.0, 15000.0, 14500.0)) < 700.0


def test_forces_and_work_of_walls(folder: Path, tmp_path: Path) -> None:
    rows = table(folder / "measure", "wallforce")
    assert sorted({row["wall"] for row in rows}) == ["0", "1"]
    mine = [row for row in rows if row["wall"] == "1"]
    assert [row["step"] for row in mine] == ["2000", "3000", "4000"]  # from where it begins to move
    assert column(mine, "path[m]") == pytest.approx([0.0, HEAVE, 2 * HEAVE])
    assert column(mine, "fx[N]") == pytest.approx([0.0, -2e5 * HEAVE, -4e5 * HEAVE])
    assert column(mine, "work[J]")[-1] == pytest.approx(2e5 * (2 * HEAVE) ** 2 / 2.0)
    run(folder, "wallforce", "--wall", 0, "--from", 0, "-o", tmp_path)
    rows = table(tmp_path, "wallforce")
    assert {row["wall"] for row in rows} == {"0"} and len(rows) == 4 and column(rows, "work[J]").max() == 0.0


def test_tracks_of_named_and_of_near_particles(folder: Path, tmp_path: Path) -> None:
    run(folder, "tracks", "--ids", "100,5", "-o", tmp_path)
    rows = table(tmp_path, "tracks")
    assert [row["id"] for row in rows if row["step"] == "4000"] == ["5"]  # 100 was deleted
    assert len([row for row in rows if row["id"] == "100"]) == 2
    x, y = lattice(LENGTH, DEPTH)
    moved = [(float(row["dx[m]"]), float(row["dy[m]"])) for row in rows if row["id"] == "5"]
    expected = [(k * HEAVE, k * SLIP * np.sin(np.radians(DIP))) for k in (0, 1, 1, 2)]
    assert np.array(moved) == pytest.approx(np.array(expected), abs=1e-5)
    run(folder, "tracks", "--near", "2000,1500", "--near", "15000,500", "--number", 3, "-o", tmp_path)
    rows = [row for row in table(tmp_path, "tracks") if row["step"] == "4000"]
    assert len(rows) == 6
    near = {int(k) for p in ((2000.0, 1500.0), (15000.0, 500.0)) for k in np.hypot(x - p[0], y - p[1]).argsort()[:3]}
    assert {int(row["id"]) for row in rows} == near
    run(folder, "tracks", "--groups", "high", "-o", tmp_path)
    rows = [row for row in table(tmp_path, "tracks") if row["step"] == "2000"]
    assert len(rows) == (y >= 1000.0).sum()
    assert len({row["id"] for row in table(folder / "measure", "tracks")}) == 24  # without a choice: some all over


def test_layers_keep_their_area_but_for_what_is_deleted(folder: Path, tmp_path: Path) -> None:
    rows = table(folder / "measure", "layers")
    _, y = lattice(LENGTH, DEPTH)
    n = int((y < 1000.0).sum())

    def of(kind: str, name: str, what: str) -> np.ndarray:
        return column([row for row in rows if (row["kind"], row["name"]) == (kind, name)], what)

    assert of("color", "lg", "particles").tolist() == [n, n, n - 2, n - 2]
    assert of("color", "lg", "particle_area[m2]")[0] == pytest.approx(n * np.pi * R**2)
    assert of("color", "lg", "particle_change") == pytest.approx([0.0, 0.0, -2.0 / n, -2.0 / n])
    for name in ("green", "yellow"):
        assert of("color", name, "particle_change").tolist() == [0.0] * 4
    # Sliding blocks keep the area of the section but for gaps and overlaps along the fault.
    assert np.abs(of("all", "", "envelope_change")).max() < 0.02
    assert of("group", "low", "particles").tolist() == of("color", "lg", "particles").tolist()
    run(folder, "layers", "--colors", "green,2", "-o", tmp_path)
    names = {row["name"] for row in table(tmp_path, "layers") if row["kind"] == "color"}
    assert names == {"green", "yellow"}


def test_cracks_count_what_broke_and_not_what_was_deleted(folder: Path) -> None:
    rows = table(folder / "measure", "cracks")
    x, y = lattice(LENGTH, DEPTH)
    total = len(chain(x, y))
    assert column(rows, "bonds").tolist() == [total, total - 2, total - 5, total - 5]
    assert column(rows, "broken").tolist() == [0, 2, 2, 2] and column(rows, "deleted").tolist() == [0, 0, 3, 3]
    assert column(rows, "parted").tolist() == [0, 1, 1, 1] and column(rows, "touching").tolist() == [0, 1, 1, 1]
    assert column(rows, "broken_share")[-1] == pytest.approx(2.0 / total)
    # grain 0 at the end of its row lost its only bond; 1, 10 and 11 one of two
    bonded = len(np.unique(chain(x, y)))
    assert column(rows, "particles_from_0.1")[1] == pytest.approx(4.0 / bonded)
    assert column(rows, "particles_from_0.5")[1] == pytest.approx(4.0 / bonded)
    broken = table(folder / "measure", "cracks_bonds")
    assert [(row["step"], row["id1"], row["id2"], row["parted"]) for row in broken] == [
        ("3000", "0", "1", "0"), ("3000", "10", "11", "1"),
    ]  # fmt: skip
    assert float(broken[0]["x[m]"]) == pytest.approx((x[0] + x[1]) / 2.0)
    damage = {row["id"]: float(row["damage"]) for row in table(folder / "measure", "cracks_particles")}
    assert damage["0"] == 1.0 and damage["1"] == damage["10"] == 0.5 and damage["7"] == 0.0 and "100" not in damage


def test_the_log_distinguishes_tension_from_shear(folder: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    log.write_text("hello\nstep 3000 | CYC | 9 particles, 8 contacts, 7 bonds (1 broken in tension, 2 in shear) | x\n")
    run(folder, "cracks", "--log", log, "-o", tmp_path, figures=True)
    assert table(tmp_path, "cracks_log") == [{"step": "3000", "tension": "1", "shear": "2"}]
    log.write_text("hello\n")
    with pytest.raises(HpcdemError, match="no line reports"):
        run(folder, "cracks", "--log", log, "-o", tmp_path)


# --- what it cannot do -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        (["--wall", "7"], UsageError, "unknown wall"),
        (["wallforce", "--wall", "7"], UsageError, "--wall 7: not in"),
        (["--groups", "nowhere"], UsageError, "groups: high, low; colours: lg, green, yellow"),
        (["--colors", "beige"], UsageError, "unknown colour"),
        (["--from", "5000"], HpcdemError, "contains no frames .* from step 5000"),
        (["--from", "50", "--to", "4"], UsageError, "--to 4 is before --from 50"),
        (["tracks", "--ids", "999999"], HpcdemError, "no frame has particle 999999"),
        (["cracks", "--from", "0", "--to", "1000"], HpcdemError, "no frame .* has bonds"),
        (["faults", "--from", "4000"], HpcdemError, "only one frame"),
        (["cracks", "--log", "nothing.log"], HpcdemError, "nothing.log"),
    ],
)
def test_messages(folder: Path, tmp_path: Path, words: list[str], error: type, message: str) -> None:
    with pytest.raises(error, match=message) as caught:
        run(folder, *words, "-o", tmp_path)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.glob("*.tmp"))


@pytest.mark.parametrize("words", [["--near", "3"], ["--ids", "a"], ["--format", "gif"], ["walk"], ["--width", "-1"]])
def test_wrong_words(folder: Path, words: list[str], capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as left:
        read_command_line(measure, "hpcdem measure", [str(folder), *words])
    assert left.value.code == 2 and words[-1] in capsys.readouterr().err


def test_request_of_a_command_line() -> None:
    words = ["d", "faults", "--colors", "lg, 9", "--groups", "a,b c", "--format", "pdf,png,pdf", "--near", "1,-2.5"]
    asked = request(read_command_line(measure, "hpcdem measure", words))
    assert (asked.colors, asked.groups, asked.formats) == ((0, 9), ("a", "b c"), ("pdf", "png"))
    assert asked.points == ((1.0, -2.5),) and asked.target == Path("d/measure") and asked.first is None


def test_what_the_folder_does_not_hold_is_left_out(tmp_path: Path) -> None:
    """A .dat without bonds and without walls.csv, a frame without particles, one frame only: what can be measured is,
    and a line says what is not."""
    x, y = lattice(3000.0, 1000.0)
    (tmp_path / "data").mkdir()
    write_dat(tmp_path / "data" / "all_0000000100.dat", frame(100, x, y, 0.0), SerialComm())
    lines = run(tmp_path / "data", figures=True)
    left = [line.split(": ")[1] for line in lines if line.startswith("skipped")]
    assert left == ["faults", "wallforce", "cracks"]  # that there is no wedge yet is an answer
    made = sorted(path.name for path in (tmp_path / "data" / "measure").iterdir())
    assert made == ["layers.csv", "layers.png", "surface.csv", "surface.png", "tracks.csv", "tracks.png", "wedge.csv"]
    write(tmp_path / "data", frame(50, x[:0], y[:0], 0.0))
    write(tmp_path / "data", frame(200, x[:0], y[:0], 0.0))
    run(tmp_path / "data", figures=True)
    steps = [row["step"] for row in table(tmp_path / "data" / "measure", "layers") if row["kind"] == "all"]
    assert steps == ["50", "100", "200"]
    (tmp_path / "data" / "all_0000000100.dat").unlink()
    with pytest.raises(HpcdemError, match=r"no frame in .* has particles"):
        run(tmp_path / "data")
    with pytest.raises(HpcdemError, match="contains no frames"):
        run(tmp_path)


def test_a_broken_frame_leaves_nothing_behind(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "data", ignore=shutil.ignore_patterns("measure"))
    (tmp_path / "data" / "all_0000003000.vtkhdf").write_bytes(b"no frame")
    with pytest.raises(HpcdemError, match=r"all_0000003000\.vtkhdf"):
        run(tmp_path / "data", "surface")
    assert not (tmp_path / "data" / "measure").exists()


def test_a_row_of_walls_csv_that_is_being_written_does_not_count(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    text = (folder / "walls.csv").read_text()
    (tmp_path / "data" / "walls.csv").write_text(text + "5000,250.0,1,70")
    run(tmp_path / "data", "wallforce")
    assert table(tmp_path / "data" / "measure", "wallforce") == table(folder / "measure", "wallforce")
    (tmp_path / "data" / "walls.csv").write_text(text + "5000,250.0,1,70\n")
    with pytest.raises(HpcdemError, match="nine numbers"):
        run(tmp_path / "data", "wallforce")
    (tmp_path / "data" / "walls.csv").write_text("a,b\n1,2\n")
    with pytest.raises(HpcdemError, match=r"is not a walls\.csv"):
        run(tmp_path / "data", "wallforce")


# --- figures, ranks, a true run ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.figures
def test_figures_of_all_measures_in_all_formats(folder: Path, tmp_path: Path) -> None:
    run(folder, "--format", "png,svg", "-o", tmp_path / "a", figures=True)
    run(folder, "wedge", "tracks", "--format", "svg,png", "-o", tmp_path / "b", figures=True)
    run(folder, "wedge", "--format", "pdf,jpg", "-o", tmp_path / "c", figures=True)
    assert {path.name for path in (tmp_path / "c").iterdir()} == {"wedge.csv", "wedge.pdf", "wedge.jpg"}
    names = {path.stem for path in (tmp_path / "a").glob("*.png")}
    assert names == {"surface", "wedge", "faults", "wallforce", "tracks", "layers", "cracks"}
    for path in (tmp_path / "b").iterdir():
        assert path.read_bytes() == (tmp_path / "a" / path.name).read_bytes(), path.name
    text = (tmp_path / "a" / "wedge.svg").read_text()
    for word in ("shortening", "height (km)", "slope (°)", "surface slope α"):
        assert word in text, word
    assert "x (km)" in (tmp_path / "a" / "faults.svg").read_text()
    assert "displacement of wall 1 (m)" in (tmp_path / "a" / "wallforce.svg").read_text()
    assert "on the wall (MN)" in (tmp_path / "a" / "wallforce.svg").read_text()


PROGRAM = """\
import sys
from hpcdem.cli import common
from hpcdem.cli.measure import measure, work
common.run_program(measure, "hpcdem measure", sys.argv[1:], work)
"""


@pytest.mark.mpi
def test_three_ranks_write_the_same_files(folder: Path, tmp_path: Path, needs_mpi: None, launch: Any) -> None:
    program = tmp_path / "measure.py"
    program.write_text(PROGRAM)
    ended = launch.python(3, program, folder, *NUMBERS, "-o", tmp_path / "3")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    written = sorted((tmp_path / "3").iterdir())
    assert len(written) == 9
    for path in written:
        assert path.read_bytes() == (folder / "measure" / path.name).read_bytes(), path.name


@pytest.mark.slow
@pytest.mark.mpi
def test_three_ranks_refuse_with_one_message(folder: Path, tmp_path: Path, needs_mpi: None, launch: Any) -> None:
    (tmp_path / "measure.py").write_text(PROGRAM)
    shutil.copytree(folder, tmp_path / "data")
    (tmp_path / "data" / "all_0000003000_ini.vtkhdf").write_bytes(b"no frame")
    ended = launch.python(3, tmp_path / "measure.py", tmp_path / "data", "layers")
    assert ended.returncode == 1 and (ended.stdout + ended.stderr).count("all_0000003000_ini.vtkhdf") == 1


RUN = """\
START
SET disk off, dt 0.05, gravity 0.0 -10.0, print 500, stepbar 100
BOX left -50.0 right 6050.0 bottom -50.0 height 6000.0
WALL id 0 nodes (0.0, 0.0) (6000.0, 0.0) fric 0.3
WALL id 1 nodes (0.0, 5000.0) (0.0, 0.0)
WALL id 2 nodes (6000.0, 0.0) (6000.0, 5000.0)
GEN num 5000 rad discrete 60.0 80.0 x (0.0, 6000.0) y (0.0, 3000.0) group rock color green
PROP density 2500.0 shear 2.9e9 poiss 0.2 fric 0.0 damp 0.4 hertz
CYC 1500
DEL range y 1600.0 99999.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3
WALL id 1 xv 2.0
IMPLE wall id 1 xmove 400.0 print 200.0
STOP
"""


@pytest.mark.slow
def test_a_run_of_the_program(tmp_path: Path, launch: Any) -> None:
    """A small push: what is measured agrees with what the run itself says."""
    (tmp_path / "run.zdem").write_text(RUN)
    ended = launch(1, "--no-figure", tmp_path / "run.zdem", cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (tmp_path / "run.log").write_text(ended.stdout)
    run(tmp_path / "data", "--log", tmp_path / "run.log", figures=True)
    folder = tmp_path / "data" / "measure"
    assert len(list(folder.glob("*.png"))) >= 6
    rows = table(folder, "layers")
    all_rows = [row for row in rows if row["kind"] == "all"]
    assert set(column(all_rows, "particle_change")) == {0.0}
    log, broken = table(folder, "cracks_log")[-1], table(folder, "cracks")[-1]
    assert int(broken["broken"]) == int(log["tension"]) + int(log["shear"]) > 0
    push = [row for row in table(folder, "wallforce") if row["wall"] == "1"]
    assert float(push[-1]["path[m]"]) == pytest.approx(400.0)
    assert column(push, "fx[N]").max() < 0.0 and np.diff(column(push, "work[J]")).min() > 0.0
    shortening = column([row for row in all_rows], "step")
    assert shortening[0] == 1500.0 and shortening[-1] > 1500.0
    near = column([row for row in table(folder, "tracks") if row["step"] == all_rows[-1]["step"]], "dx[m]")
    assert 0.0 < near.mean() < 400.0
