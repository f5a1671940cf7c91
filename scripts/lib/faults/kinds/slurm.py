"""The queue: the job template slurm/restart_chain.sh under a Slurm of our own (tests/slurm/cluster.py)."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from faults import judge, runs
from faults.case import Case, Skipped
from faults.kind import kind

SLOW = 0.02
"""Seconds that a row takes, so that the queue comes in time."""


def cluster(case: Case) -> Any:
    """The running Slurm, started when it is first asked for."""
    world = case.world
    if world.cluster is None:
        try:
            from tests.slurm.cluster import CannotStart, Cluster
        except ImportError as error:
            raise Skipped(f"no Slurm here: {error}") from None
        made = Cluster("pmix" if runs.is_open_mpi() else "pmi2")
        try:
            made.start()
            world.cluster = made
        except CannotStart as error:
            world.cluster = str(error).splitlines()[0]
    if isinstance(world.cluster, str):
        raise Skipped(world.cluster)
    return world.cluster


def _submit(case: Case) -> int:
    template = runs.ROOT / "slurm" / "restart_chain.sh"
    tools = Path(sys.executable).parent
    env = runs.environment({"slow": SLOW})
    return cluster(case).sbatch(
        "--ntasks=2", "--time=10", template, case.script.name, "--no-figure",
        cwd=case.folder, HPCDEM_BIN=str(tools), SLURM_MPI_TYPE=cluster(case).mpi, PYTHONPATH=env["PYTHONPATH"],
        FAULTS_PLAN=env["FAULTS_PLAN"],
    )  # fmt: skip


def _until_back(case: Case, number: int) -> None:
    """Until the job waits in the queue again."""
    slurm = cluster(case)
    deadline = time.monotonic() + runs.LONGEST
    while slurm.job(number).restarts < 1 and slurm.job(number).state not in ("COMPLETED", "FAILED", "CANCELLED"):
        if time.monotonic() > deadline:
            case.problem(f"the job was not put back into the queue: {slurm.job(number)}")
            return
        time.sleep(0.2)


def _chain(case: Case, *words: str) -> None:
    slurm = cluster(case)
    number = _submit(case)
    target = case.rng.randint(300, 6000)
    deadline = time.monotonic() + 2 * runs.LONGEST
    while case.reached() < target and slurm.job(number).state in ("PENDING", "CONFIGURING", "RUNNING"):
        if time.monotonic() > deadline:
            break
        time.sleep(0.02)
    case.moments.append(case.reached())
    before = judge.final_names(case.data)
    slurm._ask(words[0], *words[1:], str(number))
    _until_back(case, number)
    case._row, case._expected = case.reached(), judge.newest(case.data)
    slurm.start_again(number)
    job = slurm.wait(number, 180.0)
    said = "".join(path.read_text() for path in case.folder.glob(f"*-{number}.out"))
    if (job.state, job.exit_code) != ("COMPLETED", 0):
        case.problem(f"the job ended as {job}: {said[-300:]}")
    case._went_on(runs.End(0, said, "", 0.0))
    case.kept(before)


@kind("Slurm: --signal=USR1", "Slurm sends SIGUSR1 to the job template at a random moment: a checkpoint is "
      "written, exit code 85, and the job requeues itself and reaches the same result", rare=True)  # fmt: skip
def usr1(case: Case) -> None:
    _chain(case, "scancel", "--signal=USR1")


@kind(
    "Slurm: requeue",
    "scontrol requeue during the run: Slurm ends the ranks and starts the job again",
    rare=True,
)
def requeue(case: Case) -> None:
    _chain(case, "scontrol", "requeue")
