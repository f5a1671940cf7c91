"""A script of particles and blocks that was stopped goes on as if it had not been stopped, on any number of ranks,
though it asked the particles for its way."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.conftest import Launcher
from tests.pcdc.test_whole import tables

SCRIPT = Path(__file__).parent / "fall.sc"


def start(launch, folder: Path, ranks: int, *words: str):
    folder.mkdir(exist_ok=True)
    shutil.copy(SCRIPT, folder)
    return launch(ranks, SCRIPT.name, "--no-figure", *words, cwd=folder)


def said(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("turn")]


def stopped(launch, folder: Path, ranks: int) -> list[str]:
    """A run that is sent SIGTERM in the sixth of its eight turns; what its script said."""
    folder.mkdir()
    (folder / "stop").touch()
    done = start(launch, folder, ranks)
    assert done.returncode == 85 and "go on with --resume" in done.stderr, done.stderr
    (folder / "stop").unlink()
    return said(done.stdout)


@pytest.fixture(scope="module")
def straight(tmp_path_factory) -> tuple[Path, list[str]]:
    """The run that was not stopped, and what its script said."""
    folder = tmp_path_factory.mktemp("fall") / "one"
    done = start(Launcher(), folder, 1)
    assert done.returncode == 0, done.stderr
    lines = said(done.stdout)
    assert len(lines) == 9 and " 40 steps" in lines[0] and " 60 steps" in lines[-1] and "discs are gone" in lines[2]
    return folder, lines


@pytest.mark.mpi
@pytest.mark.parametrize(
    "before, after",
    [(1, 2), *(pytest.param(*ranks, marks=pytest.mark.slow) for ranks in ((1, 3), (3, 1), (2, 4)))],
)
def test_it_goes_on_on_other_ranks(launch, straight, tmp_path, before, after):
    folder, lines = straight
    first = stopped(launch, tmp_path / "a", before)
    assert 0 < len(first) < len(lines)
    again = start(launch, tmp_path / "a", after, "--resume")
    assert again.returncode == 0, again.stderr
    assert first + said(again.stdout) == lines
    assert tables(tmp_path / "a" / "end.sav") == tables(folder / "end.sav")
    names = sorted(path.name for path in (folder / "sand").glob("all_*.vtkhdf"))
    assert names == sorted(path.name for path in (tmp_path / "a" / "sand").glob("all_*.vtkhdf"))
    assert all(tables(tmp_path / "a" / "sand" / name) == tables(folder / "sand" / name) for name in names)


def test_what_one_rank_saw_cannot_be_asked_again(launch, tmp_path):
    """A clear end at that line, no wrong values; the first run says beforehand that it will be so."""
    folder = tmp_path / "a"
    folder.mkdir()
    (folder / "peep").touch()
    (folder / "stop").touch()
    done = start(launch, folder, 1)
    assert done.returncode == 85 and done.stdout.count("--resume will not be able to pass this line") == 1
    (folder / "stop").unlink()
    again = start(launch, folder, 1, "--resume")
    assert again.returncode == 2, again.stdout + again.stderr
    assert "fall.sc:33: ['x']: the particles of one rank" in again.stderr and "use gather(...)" in again.stderr
