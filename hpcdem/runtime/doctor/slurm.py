"""Traps of Slurm. Nothing is said outside a job."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime

from hpcdem.runtime import launch
from hpcdem.runtime.doctor.findings import Finding, ok, warning
from hpcdem.runtime.doctor.scene import Scene
from hpcdem.runtime.stopping import slurm_end_time

TOPIC = "Slurm"
_SIGNAL = re.compile(r"^#SBATCH\s+--signal[=\s]\s*(\S+)", re.MULTILINE)


def end_of_job(scene: Scene) -> Iterator[Finding]:
    """Whether the run can save itself before the job is ended."""
    job = scene.environ.get("SLURM_JOB_ID")
    if job is None:
        return
    end = slurm_end_time(scene.environ, scene.ask)
    code, script, _ = scene.run(["scontrol", "write", "batch_script", job, "-"])
    signal = _SIGNAL.search(script) if code == 0 else None
    asked = f"; the job's script asks for the signal {signal[1]}" if signal else ""
    if end is not None:
        shown = datetime.fromtimestamp(end).strftime("%Y-%m-%d %H:%M")
        yield ok(TOPIC, f"job {job} ends at {shown}, hpcdem saves and stops before{asked}")
    elif signal:
        yield ok(TOPIC, f"the end of job {job} is not known{asked}")
    else:
        yield warning(
            TOPIC,
            f"the end of job {job} cannot be found out (no SLURM_JOB_END_TIME, squeue gives no answer), and no "
            "--signal was asked for: the last steps would be lost",
            "#SBATCH --signal=USR1@300, or hpcdem --time-limit HH:MM:SS",
        )


def cores_of_srun(scene: Scene) -> Iterator[Finding]:
    """In a batch script: what srun will not take from sbatch."""
    asked = scene.environ.get("SLURM_CPUS_PER_TASK", "")
    if "SLURM_STEP_ID" in scene.environ or not asked.isdigit() or int(asked) < 2:
        return
    if "SRUN_CPUS_PER_TASK" not in scene.environ:
        yield warning(
            TOPIC,
            f"the job asked for {asked} cores per task; srun (since Slurm 22.05) will not take that from sbatch",
            "export SRUN_CPUS_PER_TASK=$SLURM_CPUS_PER_TASK",
        )


def mpi_type(scene: Scene) -> Iterator[Finding]:
    """How srun will tell the ranks about each other, against what the MPI library understands."""
    if "SLURM_JOB_ID" not in scene.environ or len(scene.places) > 1 or scene.refusal:
        return  # ranks that see each other need no advice
    library, error = scene.mpi_library
    if error:
        return
    wanted, chosen = launch.slurm_mpi_type(library), scene.environ.get("SLURM_MPI_TYPE", "")
    if chosen and not chosen.startswith(wanted):
        yield warning(
            TOPIC, f"SLURM_MPI_TYPE={chosen}, and {library} wants {wanted}", f"export SLURM_MPI_TYPE={wanted}"
        )
        return
    _, out, err = scene.run(["srun", "--mpi=list"])
    offered = set((out + err).replace(",", " ").split())
    if offered and not any(word.startswith(wanted) for word in offered):
        yield warning(
            TOPIC,
            f"this Slurm has no --mpi={wanted}, which {library} wants",
            f"Start with {launch.launcher_of(library, {})}, inside the job",
        )
    elif not chosen:
        yield ok(TOPIC, f"srun --mpi={wanted} suits {library}", f"srun --mpi={wanted} hpcdem ...")
