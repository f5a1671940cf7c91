"""A small run to be disturbed: about 250 particles, two seconds, a checkpoint every 400 steps."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.property.workers import Resident

PILE = """\
# A small bed settles and is then squeezed from the left
START
SET disk off
BOX left -500.0 right 5500.0 bottom -500.0 height 5500.0
WALL id 0 nodes (0.0, 0.0) (5000.0, 0.0) fric 0.2
WALL id 1 nodes (0.0, 3000.0) (0.0, 0.0) fric 0.2
WALL id 2 nodes (5000.0, 0.0) (5000.0, 3000.0) fric 0.2
GEN num 1000 rad discrete 70.0 90.0, x (0.0, 5000.0), y (0.0, 2400.0) group bed
PROP density 2400.0 fric 0.1 shear 2.0e9 poiss 0.25 damp 0.5 hertz
SET dt 0.04 gravity 0.0 -9.8
SET print 2000 save 400

CYC 2000

PROP ebmod 1e8 gbmod 1e8 tstrength 1e7 sstrength 2e7
WALL id 1 xv 0.5
IMPLE wall id 1 xmove 80.0 print 40.0 save 8.0
STOP
"""
LAST_STEP = 6000
LAST_FRAME = f"all_{LAST_STEP:010d}.dat"


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """pile.py in a folder of its own."""
    path = tmp_path / "pile.py"
    path.write_text(PILE)
    return path


@pytest.fixture(scope="session")
def undisturbed(resident: Resident, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The last frame of the run when nothing happens to it."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "pile.py").write_text(PILE)
    done = resident(1, "pile.py", "--no-figure", cwd=folder)
    assert done.returncode == 0, done.stderr
    return (folder / "data" / LAST_FRAME).read_bytes()


@pytest.fixture(scope="session")
def stopped_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of a run that a signal ended after three checkpoints."""
    folder = tmp_path_factory.mktemp("stopped")
    (folder / "pile.py").write_text(PILE)
    command = [sys.executable, "-m", "hpcdem", "pile.py", "--no-figure"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as job:
        while len(list(folder.glob("data/*.sav"))) < 3 and job.poll() is None:
            time.sleep(0.02)
        job.terminate()
        _, err = job.communicate(timeout=60)
    assert job.returncode == 85, err
    return folder / "data"


@pytest.fixture
def rank_process() -> Callable[[Path, int], int]:
    """`rank_process(cwd, rank)`: process id of a rank of the job that runs in this folder."""

    def find(cwd: Path, rank: int) -> int:
        names = [f"{name}={rank}\0".encode() for name in ("PMI_RANK", "OMPI_COMM_WORLD_RANK")]
        for process in Path("/proc").glob("[0-9]*"):
            try:
                if process.joinpath("cwd").resolve() != cwd.resolve():
                    continue
                environment, words = process.joinpath("environ").read_bytes(), process.joinpath("cmdline").read_bytes()
            except OSError:
                continue
            if b"hpcdem" in words and b"mpiexec" not in words and any(name in environment for name in names):
                return int(process.name)
        raise AssertionError(f"no rank {rank} runs in {cwd}")

    return find


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """`small_disk("2m")`: an empty file system of this size; called again it changes the size."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = False

    def mount(size: str) -> Path:
        nonlocal mounted
        options = f"size={size}" if not mounted else f"remount,size={size}"
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            pytest.skip(f"no small disk here: {error}")
        if done.returncode:
            pytest.skip(f"no small disk here: {done.stderr.strip() or os.strerror(done.returncode)}")
        mounted = True
        return folder

    yield mount
    if mounted:
        subprocess.run(["umount", str(folder)], check=False)
