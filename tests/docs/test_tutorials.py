"""Tutorials are done as they say: files are written, commands are run, and print what the page prints."""

from __future__ import annotations

import csv
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import BIN, absent, mpi_environment, mpiexec, why_no_mpi
from tests.docs.pages import DOCS, blocks

SHORTER = {
    "thrust_belt": {
        "shortening = 2500.0": "shortening = 60.0",
        "print 250": "print 30",
        "CYC 6000": "CYC 200",
        "CYC 2000": "CYC 100",
    },
    "cracked_specimen": {"size 0.003": "size 0.01", "speed = 0.08": "speed = 0.6"},
    "curve_to_test": {"STRAIN, RATE = 0.2, 1": "STRAIN, RATE = 0.002, 4"},
    "water": {},
    "heat": {},
}
"""What is changed in the files of a tutorial for a quick test: numbers only."""
CLUSTER = "cluster_job"


def done(page: str, folder: Path, shorter: dict[str, str], files: dict[str, str] | None = None) -> str:
    """Do what a tutorial says, in a folder; what its commands print. What it says that they print must be there,
    unless something was changed."""
    env = mpi_environment() | {"PYTHONPATH": str(DOCS.parent), "LANG": "C.UTF-8", "COLUMNS": "200"}
    env["PATH"] = f"{BIN}{os.pathsep}{env['PATH']}"
    left, here, said = set(shorter), folder, ""
    for name, text in (files or {}).items():
        (folder / name).write_text(text)
    for block in blocks(DOCS / "tutorials" / f"{page}.md"):
        if block.mark == "file":
            (folder / block.value).write_text(block.text)
        elif block.mark == "run":
            for line in block.text.splitlines():
                left -= shorten(here, shorter)
                words = shlex.split(line)
                if words[0] == "cd":
                    here = here / words[1]
                    continue
                if "hpcdem" in words:
                    at = words.index("hpcdem")
                    words = [*words[:at], sys.executable, "-m", *words[at:]]
                if words[0] == "mpiexec":
                    words[0] = mpiexec() or ""
                run = subprocess.run(
                    words, cwd=here, env=env, capture_output=True, text=True, timeout=1200, check=False
                )
                assert run.returncode == 0, f"{line}\n{run.stdout}{run.stderr}"
                said += run.stdout + run.stderr
        elif block.mark == "says" and not shorter:
            for line in block.text.splitlines():
                assert line in said, f"{line}\n{said}"
    assert not left, f"not in the files of {page}: {left}"
    return said


def shorten(folder: Path, shorter: dict[str, str]) -> set[str]:
    """Change the files of a folder; what was found."""
    found = set()
    for path in folder.iterdir():
        if path.suffix in (".py", ".sc"):
            text = path.read_text()
            for old, new in shorter.items():
                if old in text:
                    found.add(old)
                    text = text.replace(old, new)
            path.write_text(text)
    return found


def figures(folder: Path) -> set[str]:
    return {re.sub(r"_\d{10}", "", path.name) for path in folder.glob("**/*") if path.suffix in (".jpg", ".png")}


WANTED = {
    "thrust_belt": {"all.jpg", "wedge.png", "wallforce.png"}, "cracked_specimen": {"all.jpg", "curve.png"},
    "curve_to_test": {"grading.png", "packing.png", "sizes.png", "biaxial.png", "all.jpg"}, "water": {"pressure.png"},
    "heat": {"temperature.png"},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("page", list(SHORTER))
def test_tutorial(page: str, tmp_path: Path) -> None:
    """Quickly; those that are not changed print what they say."""
    done(page, tmp_path, SHORTER[page])
    later = {"wedge.png"} if SHORTER[page] else set()  # so soon there is none yet
    assert figures(tmp_path) >= WANTED[page] - later


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("page", [page for page, changes in SHORTER.items() if changes])
def test_whole_tutorial(page: str, tmp_path: Path) -> None:
    done(page, tmp_path, {})
    assert figures(tmp_path) >= WANTED[page]
    if page == "thrust_belt":  # what its text says of the wedge
        rows = list(csv.DictReader((tmp_path / "data" / "measure" / "wedge.csv").open()))
        assert float(rows[-1]["height[m]"]) == pytest.approx(2900.0, abs=60.0)
        assert (tmp_path / "data" / "all_0000049667.jpg").exists()


@pytest.mark.mpi
@pytest.mark.slow
def test_cluster_job_before_it_is_submitted(tmp_path: Path) -> None:
    """What is tried on a login node, and that the job script is one; it is submitted in tests/slurm."""
    if why_no_mpi():
        absent("mpi", why_no_mpi())
    belt = next(b.text for b in blocks(DOCS / "tutorials" / "thrust_belt.md") if b.value == "belt.py")
    done(CLUSTER, tmp_path, SHORTER["thrust_belt"], {"belt.py": belt})
    assert subprocess.run(["bash", "-n", "job.sh"], cwd=tmp_path, check=False).returncode == 0
    assert (tmp_path / "data" / "walls.csv").exists()
