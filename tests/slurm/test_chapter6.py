"""The job scripts of the manual's chapter 6 as jobs: `srun -n 4` in the place of `srun -n 1`, to the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cases.stress_strain.chapter6 import PATH, SIGMA1, Chapter, chapter, pick, start_detachment, start_push
from tests.short_push import assert_same_files
from tests.slurm.cluster import CPUS, Cluster

pytestmark = [pytest.mark.slurm, pytest.mark.figures, pytest.mark.slow]
OURS = ("--partition=tests", f"--ntasks={CPUS}", "--cpus-per-task=1", "--time=20")
"""What the test cluster has, in place of what the scripts ask of the manual's."""


@pytest.fixture
def manual(manual_scripts: Path, tmp_path_factory: pytest.TempPathFactory) -> Chapter:
    """The chapter without a queue, on one rank."""
    return chapter(manual_scripts, tmp_path_factory.getbasetemp())


def submit(slurm: Cluster, name: str, text: str, folder: Path) -> None:
    """`sbatch NAME` in the folder, to the end of the job."""
    (folder / name).write_text(text)
    number = slurm.sbatch(*OURS, name, cwd=folder, PATH=PATH, SLURM_MPI_TYPE=slurm.mpi)
    job = slurm.wait(number, 900)
    said = "".join((folder / f"{number}.{kind}").read_text() for kind in ("out", "err"))
    assert (job.state, job.exit_code) == ("COMPLETED", 0), said
    assert said.count("real") == text.count("time srun"), said
    assert "hpcdem:" not in said and "Traceback" not in said, said


def test_job_detachment(slurm: Cluster, manual: Chapter, tmp_path: Path) -> None:
    folder = tmp_path / "detachment"
    start_detachment(folder, manual.scripts)
    submit(slurm, "job.sh", manual.text("job_detachment.sh", "srun -n 4 "), folder)
    assert_same_files(manual.detachment / "data", folder / "data")


def test_jobs_with_sediments_and_erosion(slurm: Cluster, manual: Chapter, tmp_path: Path) -> None:
    folder = tmp_path / "push"
    start_push(folder, manual.scripts)
    submit(slurm, "job1.sh", manual.text("job1.sh", "srun -n 4 "), folder)
    pick(folder)
    submit(slurm, "job2.sh", manual.text("job2.sh", "srun -n 4 ") + f"time srun -n 4 {SIGMA1}\n", folder)
    for name in ("data", "datass"):
        assert_same_files(manual.push / name, folder / name)
