"""The program under a real Slurm, and the job templates of slurm/."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import BIN, ROOT, Launcher, is_open_mpi
from tests.short_push import assert_same_end, write_push
from tests.slurm.cluster import Cluster

pytestmark = pytest.mark.slurm

TEMPLATES = ROOT / "slurm"
RANKS = 2
"""Of the jobs: as many as the smallest machine has cores."""


def log_of(folder: Path, number: int) -> str:
    """What a job has printed so far."""
    files = list(folder.glob(f"*-{number}.out"))
    return files[0].read_text() if files else ""


@pytest.fixture
def submit(slurm: Cluster) -> Callable[..., int]:
    """`submit(template, folder, words..., options=(...))`: a template of ours as a job on this small node."""

    def submit_template(name: str, folder: Path, *words: object, options: tuple[str, ...] = ()) -> int:
        small = (f"--ntasks={RANKS}", "--time=10", *options)
        return slurm.sbatch(*small, TEMPLATES / name, *words, cwd=folder, HPCDEM_BIN=str(BIN), SLURM_MPI_TYPE=slurm.mpi)

    return submit_template


# -- srun ------------------------------------------------------------------------------------------------------


def test_ranks_of_a_step_see_each_other(slurm: Cluster, tmp_path: Path) -> None:
    program = "from mpi4py import MPI; c = MPI.COMM_WORLD; s = c.allreduce(c.rank); c.rank or print(c.size, s)"
    done = slurm.srun(4, sys.executable, "-c", program, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["4", "6"]


def test_srun_ends_in_the_same_state_as_one_rank(slurm: Cluster, launch: Launcher, tmp_path: Path) -> None:
    alone, under_slurm = tmp_path / "alone", tmp_path / "slurm"
    one = launch(1, write_push(alone, steps=300), "--no-figure")
    assert one.returncode == 0, one.stderr
    more = slurm.srun(3, BIN / "hpcdem", write_push(under_slurm, steps=300), "--no-figure", cwd=tmp_path)
    assert more.returncode == 0, more.stderr
    assert "3 ranks" in more.stdout + more.stderr
    assert_same_end(alone, under_slurm)


def test_copies_that_do_not_know_each_other_are_refused(slurm: Cluster, tmp_path: Path) -> None:
    script = write_push(tmp_path / "copies", steps=300)
    done = slurm.srun(2, BIN / "hpcdem", script, cwd=tmp_path, SLURM_MPI_TYPE="none")
    assert done.returncode != 0
    assert not (script.parent / "data").exists()
    if not is_open_mpi():  # Open MPI itself refuses to start
        assert "rank 0 of 1" in done.stderr


def test_an_error_ends_the_step_with_its_code(slurm: Cluster, tmp_path: Path) -> None:
    script = write_push(tmp_path / "wrong", steps=300)
    script.write_text(script.read_text().replace("density", "weight"))
    done = slurm.srun(RANKS, BIN / "hpcdem", script, cwd=tmp_path)
    assert done.returncode == 2
    assert "push.py:9" in done.stderr


# -- job templates ---------------------------------------------------------------------------------------------


def test_job_on_one_node(submit: Callable[..., int], slurm: Cluster, tmp_path: Path) -> None:
    folder = tmp_path / "job"
    number = submit("one_node.sh", folder, write_push(folder, steps=300).name)
    job = slurm.wait(number)
    assert (job.state, job.exit_code) == ("COMPLETED", 0), log_of(folder, number)

    number = submit("post.sh", folder, "data", options=("--ntasks=1", f"--dependency=afterok:{number}"))
    job = slurm.wait(number)
    assert (job.state, job.exit_code) == ("COMPLETED", 0), log_of(folder, number)
    assert list((folder / "data").glob("*.jpg"))


def test_job_on_many_nodes(submit: Callable[..., int], slurm: Cluster, tmp_path: Path) -> None:
    folder = tmp_path / "job"
    script = write_push(folder, steps=300).name
    kernels = os.environ.get("NUMBA_CACHE_DIR") or Path.home() / ".cache" / "hpcdem"  # those of all other tests
    options = ("--nodes=1", f"--ntasks-per-node={RANKS}", f"--export=ALL,NUMBA_CACHE_DIR={kernels}")
    number = submit("many_nodes.sh", folder, script, "--no-figure", options=options)
    job = slurm.wait(number)
    assert (job.state, job.exit_code) == ("COMPLETED", 0), log_of(folder, number)


def test_chain_of_jobs_equals_one_run(
    submit: Callable[..., int],
    slurm: Cluster,
    launch: Launcher,
    wait_until: Callable[..., None],
    tmp_path: Path,
) -> None:
    steps = 8_000
    whole, chain = tmp_path / "whole", tmp_path / "chain"
    number = submit("restart_chain.sh", chain, write_push(chain, steps).name, "--no-figure")
    wait_until(lambda: list((chain / "data").glob("all_0000000400_ini.*")), "the second command to begin")
    slurm.signal(number, "USR1")
    wait_until(lambda: slurm.job(number).restarts == 1, "the job to be put back into the queue")
    assert list((chain / "data").glob("*.sav")), log_of(chain, number)
    assert not list((chain / "data").glob(f"*{steps}.vtkhdf")), "the run was over before the signal came"
    slurm.start_again(number)
    job = slurm.wait(number)
    assert (job.state, job.exit_code, job.restarts) == ("COMPLETED", 0, 1), log_of(chain, number)

    straight = launch(2, write_push(whole, steps), "--no-figure")
    assert straight.returncode == 0, straight.stderr
    assert_same_end(whole, chain)


@pytest.mark.slow
def test_the_end_of_the_job_is_seen_coming(submit: Callable[..., int], slurm: Cluster, tmp_path: Path) -> None:
    """Slurm's limit of one minute stops the run with a checkpoint, without a signal that means anything."""
    folder = tmp_path / "job"
    script = write_push(folder, steps=100_000_000).name
    number = submit("one_node.sh", folder, script, "--no-figure", options=("--time=1", "--signal=URG@1"))
    job = slurm.wait(number)
    assert (job.state, job.exit_code) == ("FAILED", 85), log_of(folder, number)
    assert list((folder / "data").glob("*.sav"))


@pytest.mark.parametrize("template", sorted(TEMPLATES.glob("*.sh")), ids=lambda path: path.name)
def test_template_is_clean(template: Path) -> None:
    """Slurm refuses scripts with DOS line ends; a typing error would show only after hours in the queue."""
    text = template.read_bytes()
    assert b"\r" not in text and text.startswith(b"#!/bin/bash\n")
    assert b"\nsrun " in text
    subprocess.run(["bash", "-n", template], check=True)
