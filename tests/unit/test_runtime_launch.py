"""From a process to a rank: what the environment says, what is refused, what is reported."""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path

import pytest

from hpcdem.cli.run import speaks_zdem
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.runtime import doctor
from hpcdem.runtime import launch as launching
from hpcdem.runtime.launch import Launcher, Place

VARIABLES = {v for pair in launching.LAUNCHERS.values() for v in pair} | {"PMIX_RANK"}


@pytest.fixture(autouse=True)
def started_by_hand(monkeypatch):
    """Tests that run under a launcher themselves must not see it."""
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)


def by(monkeypatch, **variables: object) -> Launcher | None:
    for name, value in variables.items():
        monkeypatch.setenv(name, str(value))
    return launching.launcher()


# -- who started this process --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("variables", "size", "rank"),
    [
        ({}, None, None),
        ({"OMPI_COMM_WORLD_SIZE": 4, "OMPI_COMM_WORLD_RANK": 3}, 4, 3),
        ({"PMI_SIZE": 2, "PMI_RANK": 1}, 2, 1),
        ({"SLURM_STEP_NUM_TASKS": 8, "SLURM_PROCID": 5}, 8, 5),
        ({"PMIX_RANK": 2}, None, 2),
        # mpiexec inside a job step: mpiexec is nearer
        ({"PMI_SIZE": 2, "PMI_RANK": 1, "SLURM_STEP_NUM_TASKS": 1, "SLURM_PROCID": 0}, 2, 1),
    ],
)
def test_the_launcher_is_recognised(monkeypatch, variables, size, rank):
    found = by(monkeypatch, **variables)
    assert (found and found.size, found and found.rank) == (size, rank)


def test_a_batch_script_is_one_process_whatever_the_job_has(monkeypatch):
    assert by(monkeypatch, SLURM_NTASKS=12, SLURM_JOB_ID=7, SLURM_PROCID=0) is None


def test_one_process_starts_no_mpi(monkeypatch):
    monkeypatch.setitem(sys.modules, "mpi4py", None)  # an import would fail
    assert type(launching.start_mpi()) is SerialComm
    by(monkeypatch, PMI_SIZE=1, PMI_RANK=0)
    assert type(launching.start_mpi()) is SerialComm


def test_no_mpi_library_under_a_launcher_is_an_error_of_its_own(monkeypatch):
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    by(monkeypatch, PMI_SIZE=2, PMI_RANK=1)
    with pytest.raises(HpcdemError, match="no MPI library") as caught:
        launching.start_mpi()
    assert not isinstance(caught.value, UsageError)


COPIES = """
import sys
from hpcdem.core.errors import HpcdemError
from hpcdem.runtime import launch
with launch.one_voice():
    try:
        launch.start_mpi()
    except HpcdemError as error:
        print(error)
        sys.exit(error.exit_code)
"""


@pytest.mark.mpi
@pytest.mark.parametrize(("rank", "code"), [(0, 2), (3, 0)])
def test_copies_of_rank_0_are_refused_by_one_of_them(launch, rank, code):
    """A launcher of another MPI says 4, MPI says 1. Only the first copy speaks."""
    strange = {"MV2_COMM_WORLD_SIZE": "4", "MV2_COMM_WORLD_RANK": str(rank)}
    done = launch.python(1, "-c", COPIES, env=strange)
    assert done.returncode == code, done.stderr
    assert ("MVAPICH started 4 processes" in done.stdout and "rank 0 of 1" in done.stdout) is (rank == 0)


def test_the_remedy_is_named(monkeypatch):
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    text = launching.copies_of_rank_0(Launcher("Slurm", 4, 0), "Open MPI v4.1.4")
    assert "4 processes" in text and "Open MPI v4.1.4" in text and "mpiexec" in text
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    assert "srun --mpi=pmix" in launching.copies_of_rank_0(Launcher("Slurm", 4, 0), "Open MPI v4.1.4")
    assert "srun --mpi=pmi2" in launching.copies_of_rank_0(Launcher("Slurm", 4, 0), "MPICH Version: 4.2")


# -- environment ---------------------------------------------------------------------------------------------------


@pytest.fixture
def clean(monkeypatch):
    for name in list(os.environ):
        if name.startswith(("NUMBA_", "OMP_", "HDF5_", "OPENBLAS_", "MKL_")):
            monkeypatch.delenv(name)
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "7")  # restored afterwards
    for name in ("NUMBA_THREADING_LAYER", "NUMBA_DISABLE_INTEL_SVML", "HDF5_USE_FILE_LOCKING"):
        monkeypatch.setenv(name, "x")
        monkeypatch.delenv(name)
    monkeypatch.setattr(launching, "started_threads", lambda: None)  # other tests of this process may have


def test_threads_that_no_machine_has_are_refused(clean):
    with pytest.raises(UsageError, match="1025 threads per rank requested, at most 1024"):
        launching.prepare_environment(1025)
    assert os.environ["OMP_NUM_THREADS"] == "7"


def test_one_knob_sets_all_threads(clean, monkeypatch):
    monkeypatch.setattr(launching, "openmp_runtime_found", lambda: True)
    assert launching.prepare_environment(3) == (3, [])
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        assert os.environ[name] == "3"
    assert os.environ["NUMBA_THREADING_LAYER"] == "omp"
    assert os.environ["NUMBA_DISABLE_INTEL_SVML"] == "1"
    assert os.environ["HDF5_USE_FILE_LOCKING"] == "FALSE"


def test_threads_that_numba_has_started_keep_their_number(monkeypatch):
    """It compiles nothing any more where its variable says another number: a notebook may have used it before."""
    from numba import config, get_num_threads, njit

    get_num_threads()
    started = config.NUMBA_NUM_THREADS
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "7")
    if "NUMBA_NUM_THREADS" not in os.environ:
        monkeypatch.setenv("NUMBA_NUM_THREADS", str(started))
    threads, warnings = launching.prepare_environment(started + 1)
    assert threads == started and f"already started numba with {started}" in warnings[0]
    assert launching.prepare_environment(1)[0] == 1
    assert njit(lambda x: x + 1)(1) == 2


@pytest.mark.parametrize(
    ("variables", "alone", "as_zdem"),
    [
        ({}, 1, 3),
        ({"OMP_NUM_THREADS": "5"}, 1, 5),
        ({"OMP_NUM_THREADS": "4,2"}, 1, 4),
        ({"OMP_NUM_THREADS": "0"}, 1, 3),
        ({"OMP_NUM_THREADS": "many"}, 1, 3),
        ({"SLURM_CPUS_PER_TASK": "2", "SLURM_JOB_ID": "1", "SLURM_CPUS_ON_NODE": "3"}, 2, 2),
        ({"SLURM_CPUS_PER_TASK": "64", "SLURM_JOB_ID": "1"}, 6, 3),
        ({"SLURM_JOB_ID": "1", "SLURM_CPUS_ON_NODE": "2", "SLURM_STEP_NUM_TASKS": "1"}, 1, 2),
        ({"SLURM_CPUS_ON_NODE": "2"}, 1, 3),  # no job: left over in the shell
        # several ranks, or perhaps several
        ({"OMPI_COMM_WORLD_SIZE": "4", "OMP_NUM_THREADS": "5"}, 1, 1),
        ({"PMI_SIZE": "2", "SLURM_CPUS_PER_TASK": "2"}, 2, 2),
        ({"PMIX_RANK": "0", "OMP_NUM_THREADS": "5"}, 1, 1),
        ({"OMPI_COMM_WORLD_SIZE": "1", "OMP_NUM_THREADS": "2"}, 1, 2),
    ],
)
def test_threads_by_default(monkeypatch, variables, alone, as_zdem):
    """Six hyperthreads on three cores. OMP_NUM_THREADS, else all cores, only for a ZDEM script in one process."""
    for name in ("OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "SLURM_JOB_ID"):
        monkeypatch.delenv(name, raising=False)
    for name, text in variables.items():
        monkeypatch.setenv(name, text)
    monkeypatch.setattr(launching, "cores", lambda: 6)
    monkeypatch.setattr(launching, "physical_cores", lambda: 3)
    assert (launching.threads_by_default(), launching.threads_by_default(as_zdem=True)) == (alone, as_zdem)


@pytest.mark.parametrize(
    ("mask", "quota", "expected"),
    [
        ({0, 1, 4, 5}, "max 100000", 2),
        ({0, 2, 4}, "", 2),
        ({0, 1, 2, 3}, "150000 100000", 2),
        ({0, 1, 2, 3}, "50000 100000", 1),
        ({7}, "", 1),
    ],
)
def test_physical_cores(monkeypatch, tmp_path, mask, quota, expected):
    """Cores 0-3 with hyperthreads 4-7; of cpu 7 nothing is known."""
    for cpu in range(7):
        place = tmp_path / f"sys/devices/system/cpu/cpu{cpu}/topology"
        place.mkdir(parents=True)
        (place / "thread_siblings_list").write_text(f"{cpu % 4},{cpu % 4 + 4}\n")
    for name, text in {
        "proc/self/cgroup": "0::/job\n",
        "proc/self/mountinfo": "30 23 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n",
        "sys/fs/cgroup/job/cpu.max": quota,
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: mask, raising=False)
    assert launching.physical_cores(str(tmp_path)) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("START\n", True), ("# a\n\n  res 0000046000.sav # b\r\n", True), ("load a.dat scale 2\n", True),
        ("\ufeffstart", True), ("load = 3\n", False), ("restart=1\n", False), ("import hpcdem\n", False),
        ("pcdc model new\nSTART\n", False), ("", False),
    ],
)  # fmt: skip
def test_zdem_scripts_are_recognised_before_anything_is_loaded(tmp_path, text, expected):
    (tmp_path / "a.py").write_text(text, encoding="utf-8")
    assert speaks_zdem(tmp_path / "a.py") is expected
    assert not speaks_zdem(tmp_path / "none.py") and not speaks_zdem(tmp_path)


def test_what_the_user_has_set_stays(clean, monkeypatch):
    monkeypatch.setenv("HDF5_USE_FILE_LOCKING", "TRUE")
    monkeypatch.setenv("NUMBA_THREADING_LAYER", "tbb")
    launching.prepare_environment(2)
    assert os.environ["HDF5_USE_FILE_LOCKING"] == "TRUE"
    assert os.environ["NUMBA_THREADING_LAYER"] == "tbb"


def test_without_openmp_one_thread_and_a_word_about_it(clean, monkeypatch):
    monkeypatch.setattr(launching, "openmp_runtime_found", lambda: False)
    threads, warnings = launching.prepare_environment(4)
    assert threads == 1 and os.environ["NUMBA_NUM_THREADS"] == "1"
    assert "libgomp" in warnings[0]


def test_without_openmp_one_thread_needs_no_warning(clean, monkeypatch):
    monkeypatch.setattr(launching, "openmp_runtime_found", lambda: False)
    assert launching.prepare_environment(1) == (1, [])
    assert os.environ["NUMBA_THREADING_LAYER"] == "workqueue"


# -- start report --------------------------------------------------------------------------------------------------


def places(n: int, cores: int = 4, threads: int = 1, host: str = "a", before: int | None = None) -> list[Place]:
    return [Place(host, before or cores, frozenset(range(cores)), threads) for _ in range(n)]


def test_the_report_is_one_line():
    line = launching.start_report(places(4), "MPICH 4.2")
    assert "\n" not in line
    assert "4 ranks x 1 thread on a" in line and "4 cores" in line and "MPICH 4.2" in line
    assert "1 rank x 2 threads on a | 1 core" in launching.start_report(places(1, 1, 2), None)
    assert "2 hosts (a, b)" in launching.start_report(places(1) + places(1, host="b"), "MPICH 4.2")
    assert "1 to 4 cores" in launching.start_report(places(1) + places(1, cores=1), "MPICH 4.2")


def start_warnings(places: list[Place], environ: dict[str, str]) -> list[str]:
    """What the log says on a machine where nothing else is wrong (for that see test_doctor)."""
    nowhere = Path("/nowhere")
    machine = doctor.Machine(places, environ={"NUMBA_CACHE_DIR": "/nowhere", **environ}, root=nowhere)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(resource, "getrlimit", lambda number: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        return doctor.start_warnings(machine, SerialComm())


def test_a_good_launch_has_no_warnings():
    assert start_warnings(places(4), {}) == []
    assert start_warnings(places(4, host="a") + places(4, host="b"), {}) == []


def test_threads_on_one_core():
    (text,) = start_warnings(places(2, cores=1, threads=4), {})
    assert "4 threads per rank" in text and "srun -c 4" in text


def test_more_ranks_than_cores():
    (text,) = start_warnings(places(4, cores=2), {})
    assert "4 ranks" in text and "2 cores" in text


def test_a_mask_narrowed_by_mpi():
    (text,) = start_warnings(places(1, cores=1, before=8), {})
    assert "from 8 to 1" in text


SRUN = {"SLURM_STEP_ID": "0", "SLURM_CPUS_PER_TASK": "12"}


def test_srun_that_forgets_the_cores_per_task():
    (text,) = start_warnings(places(1, cores=1), SRUN)
    assert "srun -c $SLURM_CPUS_PER_TASK" in text


def test_a_job_of_twelve_cores_that_uses_one():
    (text,) = start_warnings(places(1, cores=12), SRUN)
    assert "1 of the 12 cores" in text and "-j 12" in text
    assert start_warnings(places(1, cores=12, threads=12), SRUN) == []


def test_a_batch_script_without_srun_is_left_alone():
    assert start_warnings(places(1, cores=4), {"SLURM_CPUS_PER_TASK": "12"}) == []


@pytest.mark.mpi
def test_all_ranks_see_each_other(launch):
    program = (
        "from hpcdem.runtime import launch, shutdown\n"
        "comm = launch.start_mpi()\n"
        "places = comm.allgather(launch.place(launch.cores(), 1))\n"
        "launch.patient_barrier(comm)\n"
        "comm.rank or print(launch.start_report(places, launch.mpi_library()))\n"
        "shutdown.leave(shutdown.ExitStatus())\n"
    )
    done = launch.python(3, "-c", program)
    assert done.returncode == 0, done.stderr
    assert "3 ranks x 1 thread" in done.stdout


def test_a_zdem_script_alone_takes_the_threads_of_omp_num_threads(launch, tmp_path):
    (tmp_path / "s.py").write_text("START\nSET dt 1e-3\nBALL id 0 x 0 y 0 rad 1\nPROP density 1\nCYC 3\n")
    done = launch(1, "s.py", "--no-figure", cwd=tmp_path, env={**os.environ, "OMP_NUM_THREADS": "2"})
    assert done.returncode == 0 and "1 rank x 2 thread" in done.stdout, done.stdout + done.stderr
