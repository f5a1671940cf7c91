"""`hpcdem grade`: files, figures, summary, round trip, what it refuses; and scripts that run."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.grade import grade, work
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import EXIT_USAGE, HpcdemError, UsageError
from hpcdem.io.clumps import read_clumps
from hpcdem.io.ppdem import read_ppdem
from hpcdem.lang.detect import kind
from hpcdem.post.specimen import class_colours, packing
from hpcdem.pre.specimen import Request, make_specimen
from tests.conftest import ROOT, Launcher
from tests.property.workers import Resident
from tests.specimen.shapes import WINDOW

CURVE = "".join(f"{d} {p}\n" for d, p in zip(*WINDOW))
ALWAYS = ["specimen.dat", "grading.csv", "deposit.py", "biaxial.py", "specimen.json"]
NAMES = "grading", "packing", "sizes"


def run(*words: object) -> None:
    """`hpcdem grade` in this process."""
    work(SerialComm(), None, read_command_line(grade, "hpcdem grade", [str(w) for w in words]))  # type: ignore[arg-type]


@pytest.fixture
def curve(tmp_path: Path) -> Path:
    (tmp_path / "curve.txt").write_text(CURVE)
    return tmp_path / "curve.txt"


def test_files(curve: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    out = tmp_path / "made"
    run(curve, "--shape", "triangle", "-n", 150, "--roundness", 0.3, "--deviation", 5, "-o", out, "--format", "png,svg")
    said = capsys.readouterr().out
    expected = {*ALWAYS, "specimen.clumps", *(f"{name}.{kind}" for name in NAMES for kind in ("png", "svg"))}
    assert {path.name for path in out.iterdir()} == expected
    assert "void ratio 0.5;" in said and "one grain from N =" in said and "clumps: " in said
    grains, clumps = read_ppdem(out / "specimen.dat"), read_clumps(out / "specimen.clumps")
    assert len(grains) == len(clumps) == 150 and (np.diff(grains.start) == 3).all()
    with open(out / "grading.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["grains"]) for row in rows] == [1, 1, 1, 22, 125]
    facts = json.loads((out / "specimen.json").read_text())
    assert facts["void_ratio"] == {"target": 0.5, "reached": pytest.approx(0.5)}
    assert facts["Cu"]["target"] is None and facts["clumps"]["largest_gap_over_size"] <= 0.03
    for name in NAMES:
        assert (out / f"{name}.png").stat().st_size > 10_000
        assert "<text" in (out / f"{name}.svg").read_text()


def test_circles_and_json(curve: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    out = tmp_path / "made"
    run(curve, "-n", 60, "-o", out, "--json", "--format", "none", "--layout", "plain", "--placement", "cells")
    facts = json.loads(capsys.readouterr().out)
    assert facts["grains"] == 60 and facts["placement"] == "cells"
    assert {Path(path).name for path in facts["files"]} == {*ALWAYS, "specimen.xyr"}
    assert len((out / "specimen.dat").read_text().splitlines()[1].split()) == 4
    assert (kind((out / "deposit.py").read_text()), kind((out / "biaxial.py").read_text())) == ("zdem", "python")


@pytest.mark.slow
def test_the_same_seed_makes_the_same_files(curve: Path, tmp_path: Path) -> None:
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        run(curve, "-n", 80, "--shape", "pentagon", "--deviation", 5, "--seed", seed, "-o", tmp_path / name)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name
    assert (tmp_path / "a" / "specimen.dat").read_bytes() != (tmp_path / "c" / "specimen.dat").read_bytes()


@pytest.mark.parametrize("layout, factor", [("sample", 1), ("full", 1), ("sample", 0.0872665)])
def test_round_trip(curve: Path, tmp_path: Path, capsys: pytest.CaptureFixture, layout: str, factor: float) -> None:
    more = "--layout", layout, "--angle-factor", factor
    run(
        curve,
        "-n",
        300,
        "--shape",
        "quadrilateral",
        "--roundness",
        0.4,
        "-o",
        tmp_path / "a",
        "--format",
        "none",
        *more,
    )
    made = json.loads((tmp_path / "a" / "specimen.json").read_text())
    capsys.readouterr()
    run(curve, "--read", tmp_path / "a" / "specimen.dat", "-o", tmp_path / "b", "--json", *more)
    found = json.loads(capsys.readouterr().out)
    assert found["kinds"] == {"quadrilateral": 300} and found["roundness"] == pytest.approx([0.4, 0.4])
    for a, b in zip(made["classes"], found["classes"]):
        assert a["grains"] == b["grains"] and a["finer_by_area"] == pytest.approx(b["finer_by_area"], abs=1e-7)
        assert a["finer_target"] == b["finer_target"]
    assert found["solid_area"] == pytest.approx(made["solid_area"])
    left, right, bottom, top = found["extent"]
    assert left >= 0 and bottom >= 0 and right <= made["room"]["width"] and top <= made["room"]["height"]
    assert {Path(path).name for path in found["files"]} == {f"{name}.png" for name in NAMES}
    run("--read", tmp_path / "a" / "specimen.dat", *more)
    said = capsys.readouterr().out
    assert "300 grains: 300 quadrilateral" in said and "roundness 0.4 to 0.4" in said


@pytest.mark.parametrize(
    "words, message",
    [
        (["curve.txt", "-n", "0"], "number of grains 0"),
        (["curve.txt", "--shape", "triangle", "--deviation", "60"], "expected 0 to below 55"),
        (["curve.txt", "-n", "5", "--width", "10"], "either the number of grains or the width"),
        (["curve.txt", "--angle-factor", "0"], "--angle-factor 0"),
        (["curve.txt", "--shape", "ellipse", "--layout", "plain"], "circles only"),
        (["curve.txt", "--shape", "ellipse", "--gap", "0.9"], "gap 0.9"),
        (["wrong.txt"], r"wrong\.txt:2: "),
        (["nothing.txt"], "cannot read nothing.txt"),
        ([], "the grading file is missing"),
        (["--read", "curve.txt"], r"curve\.txt:1: read 100, expected a whole number|curve\.txt:"),
    ],
)
def test_refused(curve: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], message: str) -> None:
    """One message, and what was in the folder is as it was."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.txt").write_text("10 100\n11 50\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "specimen.dat").write_text("mine")
    given = words or ["--json"]
    with pytest.raises(HpcdemError, match=message):
        run(*given, "-o", "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["specimen.dat"]
    assert (tmp_path / "out" / "specimen.dat").read_text() == "mine"


def test_full_layout_of_shapes_without_roundness(curve: Path, tmp_path: Path) -> None:
    run(curve, "-n", 60, "--shape", "ellipse", "--layout", "full", "--format", "none", "-o", tmp_path / "a")
    assert len((tmp_path / "a" / "specimen.dat").read_text().splitlines()[1].split()) == 13


def test_figures_of_many_classes() -> None:
    assert len(set(class_colours(30))) == 30 and class_colours(1) == ["#9c3708"]
    sizes = np.geomspace(10.0, 1.0, 30)
    made = make_specimen(Request(tuple(sizes), tuple(np.linspace(100, 10, 30)), number=2000, placement="cells"))
    figure = packing(made.outlines, made.class_of, made.grading.sizes, made.density.room, (made.width, made.height))
    assert len(figure.axes[0].get_legend().get_texts()) == 10


@pytest.mark.mpi
def test_program(launch: Launcher, tmp_path: Path) -> None:
    """Exit codes; the same files from two ranks."""
    (tmp_path / "curve.txt").write_text(CURVE)
    done = launch(1, "grade", tmp_path / "curve.txt", "-n", "50", "-o", tmp_path / "one")
    assert done.returncode == 0, done.stderr
    done = launch(2, "grade", tmp_path / "curve.txt", "-n", "50", "-o", tmp_path / "two")
    assert done.returncode == 0, done.stderr
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
    (tmp_path / "curve.txt").write_text("10 100\n20 30\n5 1\n")
    done = launch(1, "grade", tmp_path / "curve.txt")
    assert done.returncode == EXIT_USAGE
    assert done.stderr.strip().endswith(f"{tmp_path}/curve.txt:1: 100 % finer than 10 mm, expected no more") or (
        f"{tmp_path}/curve.txt:2: " in done.stderr and "Traceback" not in done.stderr
    )


def made_for_scripts(folder: Path) -> None:
    (folder / "curve.txt").write_text("3 100\n2 60\n1.5 20\n")
    run(folder / "curve.txt", "-n", 60, "--void-ratio", 0.4, "--format", "none", "-o", folder)


def test_deposit_runs(resident: Resident, tmp_path: Path) -> None:
    """A tenth of the steps: grains fall, none is lost, all groups come out again."""
    made_for_scripts(tmp_path)
    script = tmp_path / "deposit.py"
    text = script.read_text()
    steps = int(re.search(r"^CYC (\d+)$", text, re.MULTILINE)[1])  # type: ignore[index]
    script.write_text(text.replace(f"CYC {steps}\n", f"CYC {steps // 10}\n"))
    done = resident(1, script)
    assert done.returncode == 0, done.stdout + done.stderr
    before, after = ([line.split() for line in (tmp_path / f"{n}.xyr").read_text().splitlines()] for n in
                     ("specimen", "deposited"))  # fmt: skip
    assert [row[3] for row in before] == [row[3] for row in after]
    y = np.array([[float(row[1]) for row in rows] for rows in (before, after)])
    assert y[1].mean() < y[0].mean() and (y[1] > 0).all()


def test_biaxial_runs(resident: Resident, tmp_path: Path) -> None:
    """To one per cent of strain: the specimen hardens, at the side stress asked for."""
    made_for_scripts(tmp_path)
    script = tmp_path / "biaxial.py"
    text, found = re.subn(r"^STRAIN, RATE = 0\.2, \S+?\s", "STRAIN, RATE = 0.01, 20.0 ", script.read_text(), flags=re.M)
    assert found == 1
    script.write_text(text)
    done = resident(1, script)
    assert done.returncode == 0, done.stdout + done.stderr
    with open(tmp_path / "data" / "biaxial.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    assert rows[-1]["axial_strain"] == pytest.approx(0.01, rel=0.1)
    assert max(row["deviator_stress[Pa]"] for row in rows) > 30e3
    assert np.mean([row["side_stress[Pa]"] for row in rows]) == pytest.approx(100e3, rel=0.2)
    assert (tmp_path / "data" / "biaxial.png").stat().st_size > 10_000


@pytest.mark.parametrize("shape", ["triangle", "circle"])
def test_scripts_of_large_grains(tmp_path: Path, shape: str) -> None:
    """The numbers in the scripts go with the sizes: boulders as well as silt."""
    for size, name in ((1e3, "boulders"), (1e-2, "silt")):
        (tmp_path / "curve.txt").write_text(f"{size} 100\n")
        run(tmp_path / "curve.txt", "-n", 40, "--shape", shape, "--format", "none", "-o", tmp_path / name)
        text = (tmp_path / name / "deposit.py").read_text()
        dt, kn = (float(re.search(pattern, text)[1]) for pattern in (r"dt (\S+)", r"kn (\S+)"))  # type: ignore[index]
        mass = 2650.0 * (1.0 if shape == "circle" else 0.4135) * np.pi / 4 * (size / 1e3) ** 2
        assert dt == pytest.approx(0.15 * np.sqrt(mass / kn), rel=0.11)


def test_usage_error_is_one(curve: Path) -> None:
    with pytest.raises(UsageError):
        run("--json")


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.figures
def test_example(tmp_path: Path) -> None:
    """examples/specimens.py with fewer grains: the three figures of docs/specimens.md, and the void ratio it claims."""
    folder = ROOT / "examples"
    whole = (folder / "specimens.py").read_text()
    text, found = re.subn(r"^GRAINS, VOID_RATIO = \S+ ", "GRAINS, VOID_RATIO = 80, ", whole, flags=re.M)
    assert found == 1
    (tmp_path / "specimens.py").write_text(text)
    (tmp_path / "grading.txt").write_bytes((folder / "grading.txt").read_bytes())
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "specimens.py"], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "void ratio 0.400, 80 grains of each shape\n"
    for name in ("specimens", "specimen_grading", "specimen_discs"):
        assert (tmp_path / "data" / f"{name}.jpg").stat().st_size > 10_000
        assert (ROOT / "docs" / "figures" / f"{name}.jpg").stat().st_size > 10_000
