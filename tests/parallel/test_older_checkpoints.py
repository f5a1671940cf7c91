"""Checkpoints that earlier versions of the program have written are gone on with, to the end those versions came to.

`checkpoints/version<n>.sav` was written by the last program of that version of the layout, 150 steps before the end of
a script of twelve spheres with walls, bonds and a history; `version<n>_end.dat` is what it exported at the end.
A new version of the layout adds a pair of files here; none is ever removed (docs/files.md).
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hpcdem.io import checkpoint

FILES = Path(__file__).with_name("checkpoints")


@pytest.mark.some_of_each
@pytest.mark.parametrize("version", range(1, checkpoint.VERSION))
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_an_older_checkpoint_comes_to_the_same_end(resident, tmp_path, version, ranks):
    saved = FILES / f"version{version}.sav"
    assert checkpoint.version_of(saved) == version
    (tmp_path / "data").mkdir()
    shutil.copyfile(saved, tmp_path / "data/0000001350.sav")
    done = resident(ranks, "resume", "data", "--no-figure", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "step 1350" in done.stdout
    assert (tmp_path / "end.dat").read_bytes() == (FILES / f"version{version}_end.dat").read_bytes()
