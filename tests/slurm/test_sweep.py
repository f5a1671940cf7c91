"""A sweep as a job array: tasks that Slurm runs, kills and puts back, and the report of all."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import hpcdem
from hpcdem.sweep.plan import DONE, FAILED, STOPPED
from tests.short_push import parametrised_push, ranks_of
from tests.slurm.cluster import Cluster

pytestmark = pytest.mark.slurm
STEPS = 8_000


def sweep(slurm: Cluster, folder: Path, *words: str) -> str:
    """`hpcdem sweep WORDS` where Slurm's commands find the cluster of the tests; what it prints."""
    done = subprocess.run(
        [sys.executable, "-m", "hpcdem", "sweep", *words],
        cwd=folder, env=slurm.env(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_an_array_that_is_killed_and_put_back_has_the_report_of_a_sweep_on_this_machine(
    slurm: Cluster, wait_until: Callable[..., None], tmp_path: Path
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "push.py").write_text(parametrised_push(STEPS))
    words = ("push.py", "--seed", "1:3", "--set", "friction=0.1")
    sweep(slurm, here, *words)
    said = sweep(slurm, there, *words, "--ranks", "2", "--slurm", "--jobs", "2", "--sbatch", "time=10")
    number = int(said.split("job array ")[1].split()[0])
    text = (there / "push_sweep" / "array.sh").read_text()
    assert "--array=0-2%2\n" in text and "--ntasks=2\n" in text and "--time=10\n" in text
    members = hpcdem.Sweep.open(there / "push_sweep").members

    def saved(k: int) -> bool:
        return any((members[k].folder / "data").glob("*.sav"))

    wait_until(lambda: saved(0) and saved(1), "two tasks to write checkpoints")
    for rank in ranks_of(members[0].folder):
        os.kill(rank, signal.SIGKILL)
    slurm.signal(f"{number}_1", "USR1")  # as when time is nearly up: it saves and goes back into the queue
    wait_until(lambda: members[0].state == FAILED, "the member to end")
    wait_until(lambda: members[1].state == STOPPED, "the member to stop")
    wait_until(lambda: slurm.job(f"{number}_1").restarts == 1, "the task to be put back into the queue")
    slurm.start_again(f"{number}_1")
    assert [slurm.wait(f"{number}_{k}").state for k in (1, 2)] == ["COMPLETED"] * 2
    assert [one.state for one in members] == [FAILED, DONE, DONE]

    again = sweep(slurm, there, "push_sweep", "--slurm", "--sbatch", "time=10")
    assert "--array=0\n" in (there / "push_sweep" / "array.sh").read_text(), "only what is not done"
    assert slurm.wait(int(again.split("job array ")[1].split()[0])).state == "COMPLETED"
    assert "all members are done" in sweep(slurm, there, "push_sweep", "--slurm")
    assert "2 ranks" in (members[0].folder / "out.log").read_text()
    for folder in (here, there):
        sweep(slurm, folder, "report", "push_sweep", "--format", "none")
    for table in ("members", "bands", "parameters"):
        one, other = (folder / "push_sweep" / "report" / f"{table}.csv" for folder in (here, there))
        assert one.read_bytes() == other.read_bytes(), table


def test_members_run_side_by_side_within_one_job(slurm: Cluster, tmp_path: Path) -> None:
    """The driver in an allocation: each member is a step of its own cores."""
    text = "import time\nn = 0\nbegan = time.time()\ntime.sleep(2 + 0 * n)\n"
    (tmp_path / "wait.py").write_text(text + "open('when', 'w').write(f'{began} {time.time()}')\n")
    done = subprocess.run(
        ["salloc", "-n", "2", "--time=5", sys.executable, "-m", "hpcdem", "sweep", "wait.py", "--set", "n=1:2",
         "--jobs", "2"],
        cwd=tmp_path, env=slurm.env(), capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (a, b), (c, d) = (map(float, path.read_text().split()) for path in sorted(tmp_path.glob("wait_sweep/*/when")))
    assert max(a, c) < min(b, d), "they overlap"
