"""A sweep as a job array of Slurm: a task for each member that is not done."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path
from hpcdem.sweep.plan import DONE, RUNNING, Plan

SCRIPT = "array.sh"
OURS = ("array", "ntasks", "cpus-per-task", "output", "open-mode", "requeue")
"""Options of sbatch that the sweep sets itself."""

_TEXT = """\
#!/bin/bash
# Written by hpcdem sweep: a task of this array is a member of the sweep. Submit it again unchanged, or by
#   hpcdem sweep {folder} --slurm
#SBATCH --array={array}
#SBATCH --ntasks={ranks}
#SBATCH --cpus-per-task={threads}
#SBATCH --output={folder}/slurm-%A_%a.out
#SBATCH --open-mode=append
#SBATCH --requeue
{options}
set -uo pipefail
{environment}
{python} -m hpcdem sweep {folder} --member "$SLURM_ARRAY_TASK_ID"
code=$?
if ((code == 85)); then          # time was nearly up: stopped with a checkpoint, resumes from there
    scontrol requeue "$SLURM_JOB_ID"
    sleep 60                     # the queue ends this script meanwhile
fi
exit "$code"
"""

_ENVIRONMENT = """\
# As in slurm/one_node.sh: pmi2 for MPICH and its wheel, pmix for Open MPI; srun does not inherit --cpus-per-task.
export SLURM_MPI_TYPE="${SLURM_MPI_TYPE:-MPI}"
export SRUN_CPUS_PER_TASK="${SLURM_CPUS_PER_TASK:-1}"
"""


def write(plan: Plan, options: Sequence[str] = (), at_once: int | None = None) -> Path | None:
    """The job script of all members that are neither done nor running; None without any. options: NAME=VALUE
    or NAME of sbatch. UsageError for one that the sweep settles itself."""
    for option in options:
        name = option.split("=")[0].lstrip("-")
        if name in OURS:
            raise UsageError(f"--sbatch {option}: the sweep sets --{name} automatically")
        if not name or any(char.isspace() for char in option):
            raise UsageError(f"--sbatch '{option}': expected NAME=VALUE, such as time=04:00:00")
    waiting = [k for k, member in enumerate(plan.members) if member.state not in (DONE, RUNNING)]
    if not waiting:
        return None
    array = ranges(waiting) + (f"%{at_once}" if at_once else "")
    from hpcdem.runtime.launch import mpi_library, slurm_mpi_type

    path = plan.folder.resolve() / SCRIPT
    mpi = slurm_mpi_type(mpi_library()) if plan.ranks > 1 else "none"
    text = _TEXT.format(
        folder=shlex.quote(str(path.parent)), array=array, ranks=plan.ranks, threads=plan.threads,
        options="".join(f"#SBATCH --{option.lstrip('-')}\n" for option in options),
        environment=_ENVIRONMENT.replace("MPI}", f"{mpi}}}"), python=shlex.quote(sys.executable),
    )  # fmt: skip
    with atomic_path(path) as temporary:
        Path(temporary).write_text(text, encoding="utf-8", newline="\n")
    return path


def submit(path: Path) -> str:
    """Hand it to Slurm; returns the number of the job. HpcdemError if Slurm refuses it."""
    program = shutil.which("sbatch")
    if program is None:
        raise UsageError(f"--slurm: sbatch not found. Submit {path} (already written) on a host with Slurm")
    done = subprocess.run(
        [program, "--parsable", str(path)], env=dict(os.environ), capture_output=True, text=True, check=False
    )  # the environment as it was: Open MPI, once loaded here, has put words into it that confuse its ranks there
    if done.returncode:
        raise HpcdemError(f"sbatch {path}: {done.stderr.strip()}")
    return done.stdout.strip().split(";")[0]


def ranges(numbers: Iterable[int]) -> str:
    """0,1,2,5 -> 0-2,5"""
    parts: list[list[int]] = []
    for number in sorted(numbers):
        if parts and parts[-1][1] == number - 1:
            parts[-1][1] = number
        else:
            parts.append([number, number])
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)
