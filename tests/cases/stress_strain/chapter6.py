"""Chapter 6 of the ZDEM manual on its short scripts: job scripts as printed, frames picked by hand in between."""

from __future__ import annotations

import os
import re
import shutil
from functools import cache, cached_property
from pathlib import Path

from tests.conftest import BIN, run

PICKED = [
    "0000002000_ini", "0000004000", "0000005000_ini", "0000007000", "0000007600_ini", "0000009600", "0000012600",
]  # fmt: skip
"""Frames of the short push_add_del.py by the rule of 6.3.1: settled and coloured, cut off, deposits at rest, each
before the push, and some of the pushes."""

SIGMA1 = (
    "zdemss --dir ./datass --strainvol OFF --strainshear ON --sigma1 ON --scale 1.0 --gridsize 600.0 --stressmean OFF "
    "--stressshear OFF --addball ON --delball ON --xmax 40.0 --ymax 10.0"
)
"""The command of 6.4."""

PATH = f"{BIN}{os.pathsep}{os.environ['PATH']}"


def job(text: str, launcher: str) -> str:
    """A job script without what belongs to the manual's cluster, with `launcher` in the place of `srun -n 1`."""
    lines = [line for line in text.splitlines() if not re.match(r"source |module |export PATH=", line)]
    text, found = re.subn(r"\bsrun -n 1 ", launcher, "\n".join(lines) + "\n")
    assert found
    return text


class Chapter:
    """The two chains of the chapter in folders of their own, each run once and kept for all tests of a session."""

    def __init__(self, scripts: Path, folder: Path) -> None:
        self.scripts, self.folder = scripts, folder

    def text(self, name: str, launcher: str = "") -> str:
        """A job script of the manual, to be run here."""
        return job((self.scripts / name).read_text(), launcher)

    @cached_property
    def detachment(self) -> Path:
        """6.2: no sediments, no erosion."""
        folder = self.folder / "detachment"
        start_detachment(folder, self.scripts)
        bash(self.text("job_detachment.sh"), folder)
        return folder

    @cached_property
    def push(self) -> Path:
        """6.3 and 6.4: sediments and erosion, and the largest principal stress."""
        folder = self.folder / "push"
        start_push(folder, self.scripts)
        bash(self.text("job1.sh"), folder)
        pick(folder)
        bash(self.text("job2.sh"), folder)
        bash(SIGMA1, folder)
        return folder


def start_detachment(folder: Path, scripts: Path) -> None:
    """What section 6.2 begins with; init_xyr.dat is made by the short pre_struct.py, cut where it has written it."""
    folder.mkdir(parents=True)
    shutil.copy(scripts / "short" / "detachment.py", folder)
    make = folder.with_name(f"{folder.name}_init")
    make.mkdir()
    text, _, _ = (scripts / "short" / "pre_struct.py").read_text().partition("EXP init_xyr.dat")
    (make / "init.py").write_text(f"{text}EXP init_xyr.dat\nSTOP\n")
    bash("zdem --no-figure init.py", make)
    shutil.copy(make / "init_xyr.dat", folder)


def start_push(folder: Path, scripts: Path) -> None:
    """What section 6.3 begins with."""
    folder.mkdir(parents=True)
    shutil.copy(scripts / "short" / "push_add_del.py", folder)


def pick(folder: Path) -> None:
    """Copy the frames that stress and strain are wanted of."""
    (folder / "datass").mkdir()
    for name in PICKED:
        shutil.copy(folder / "data" / f"all_{name}.dat", folder / "datass")


def bash(text: str, folder: Path) -> str:
    """Run the text of a job script in a folder, without any queue; what it has printed. The first failure ends it."""
    done = run(["bash", "-e", "-c", text], cwd=folder, timeout=900, env={"PATH": PATH})
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def tree(ss: Path) -> dict[str, set[str]]:
    """Names of the files in ss and in its folders, by folder; "." is ss itself."""
    found: dict[str, set[str]] = {}
    for path in ss.rglob("*"):
        if path.is_file():
            found.setdefault(str(path.parent.relative_to(ss)), set()).add(path.name)
    return found


@cache
def chapter(scripts: Path, folder: Path) -> Chapter:
    """The chapter on one rank; `folder` is that of the session."""
    return Chapter(scripts, folder / "chapter6")
