"""The program that makes a paper's figures: shortened it makes all of them; whole, they show what the gallery says."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from hpcdem.io.frames import list_frames, read_frame
from tests.conftest import ROOT, Launcher

PAGES = ("sections", "slip", "flexure", "strain")


def figures(folder: Path, printed: str) -> None:
    """All of them, as PNG and PDF."""
    named = {Path(name).name for name in re.findall(r"^figure: (\S*paper_\S+)$", printed, flags=re.MULTILINE)}
    assert named == {f"paper_{page}.{kind}" for page in PAGES for kind in ("png", "pdf")}
    assert all((folder / name).stat().st_size > 10_000 for name in named)


def test_a_short_run_makes_all_figures(launch: Launcher, tmp_path: Path) -> None:
    """A quarter of the length, six frames, no fault yet."""
    text = (ROOT / "examples" / "paper.py").read_text()
    for old, new in (
        ("32000.0", "8000.0"), ("32200.0", "8200.0"), ("CYC 4000", "CYC 600"), ("CYC 1500", "CYC 200"),
        ("PUSH, EVERY = 7000.0, 250.0", "PUSH, EVERY = 120.0, 20.0"),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "paper.py").write_text(text)
    done = launch(1, tmp_path / "paper.py", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    figures(tmp_path / "data", done.stdout)


@pytest.mark.slow
def test_the_figures_show_what_the_gallery_says(launch: Launcher, tmp_path: Path) -> None:
    """Faults on which most of the shortening is taken up, a basin that tilts towards the belt, three growth strata."""
    done = launch(1, ROOT / "examples" / "paper.py", "--outdir", tmp_path, "-j", "2", timeout=3600.0)
    assert done.returncode == 0, done.stdout + done.stderr
    figures(tmp_path, done.stdout)
    with open(tmp_path / "measure" / "faults_summary.csv", encoding="utf-8") as file:
        slips = [abs(float(row["slip[m]"])) for row in csv.DictReader(file)]
    assert len(slips) >= 4 and sum(slip > 500.0 for slip in slips) >= 3
    with open(tmp_path / "flexure.csv", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["step"]]
    edge = [float(row["deflection"]) for row in rows if float(row["x"]) < 0.0]
    assert max(edge) > 800.0
    frame = read_frame(list_frames(tmp_path)[-1].path, ["particles"])
    assert {"growth1", "growth2", "growth3"} <= set(frame.group_names)
