"""The program as it is installed, on the quickest of runs: also executed on the stack of plain wheels."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tests.conftest import BIN, Launcher
from tests.short_push import assert_same_end, write_push

pytestmark = pytest.mark.smoke


@pytest.mark.parametrize("program", ["hpcdem", "zdem", "zdemss", "zdem2jpg"])
def test_programs_are_installed(program: str) -> None:
    assert (BIN / program).exists()


@pytest.mark.parametrize("program", ["hpcdem", "zdem", "zdem2jpg"])
def test_programs_explain_themselves(program: str) -> None:
    done = subprocess.run([BIN / program, "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "usage:" in done.stdout.lower(), done.stderr


def test_script_to_figure(launch: Launcher, tmp_path: Path) -> None:
    done = launch(1, write_push(tmp_path / "run", steps=200))
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "run" / "data").glob("*.jpg"))


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_ranks_do_not_change_the_result(launch: Launcher, tmp_path: Path, ranks: int) -> None:
    for n in (1, ranks):
        done = launch(n, write_push(tmp_path / str(n), steps=200), "--no-figure")
        assert done.returncode == 0, done.stderr
    assert_same_end(tmp_path / "1", tmp_path / str(ranks))
