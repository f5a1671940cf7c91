"""Turn a process into a rank: environment, MPI, refusals and the start report.

Nothing here imports numpy, numba or mpi4py before it must: several of their settings are read only once, at
their import.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import socket
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.runtime import cgroups

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm

LAUNCHERS = {
    # who: (size of the job, rank in it)
    "Open MPI": ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
    "PMI (MPICH, Intel MPI)": ("PMI_SIZE", "PMI_RANK"),
    "MVAPICH": ("MV2_COMM_WORLD_SIZE", "MV2_COMM_WORLD_RANK"),
    "PALS": ("PALS_NRANKS", "PALS_RANKID"),
    "Slurm": ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
}
"""The variables by which a launcher tells its processes who they are; the first launcher found wins.

SLURM_NTASKS is not asked: sbatch sets it too, for a batch script that is one process. PMIx has no variable for
the size, so its processes start MPI and ask.
"""
MOST_THREADS = 1024
"""Of a rank: as many processors as Linux counts in a mask."""


def version() -> str:
    """The version of hpcdem, of the source tree if it carries one."""
    import hpcdem

    own = getattr(hpcdem, "__version__", None)
    if own is not None:
        return own
    try:
        return importlib.metadata.version("hpcdem")
    except importlib.metadata.PackageNotFoundError:
        return "0 (source tree, not installed)"


# -- environment ---------------------------------------------------------------------------------------------


def prepare_environment(threads: int) -> tuple[int, list[str]]:
    """Set what numba, HDF5 and the BLAS read at their import; a user's own setting stays.

    Returns the number of threads per rank that can be had, and warnings. The number of threads is taken from -j
    alone: it overrides what a job script left in OMP_NUM_THREADS.
    """
    if threads > MOST_THREADS:  # libgomp ends the process where it cannot start them
        raise UsageError(f"{threads} threads per rank requested, at most {MOST_THREADS} allowed (-j)")
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")
    os.environ.setdefault("NUMBA_DISABLE_INTEL_SVML", "1")
    set_thread_variables(threads)
    let_waiting_threads_sleep(threads)
    started = started_threads()
    if started is not None and threads > started:
        return started, [
            f"{threads} threads per rank requested, but this process has already started numba with {started}: using "
            "those. Open the first simulation before other code runs in parallel, or set NUMBA_NUM_THREADS"
        ]
    if "NUMBA_THREADING_LAYER" in os.environ:
        return threads, []
    # Fork and join cost 2 us with OpenMP, 24 with workqueue and up to 3000 with TBB, which numba would take first.
    if openmp_runtime_found():
        os.environ["NUMBA_THREADING_LAYER"] = "omp"
        return threads, []
    os.environ["NUMBA_THREADING_LAYER"] = "workqueue"
    if threads == 1:
        return 1, []
    set_thread_variables(1)
    return 1, [
        "libgomp.so.1 (OpenMP) not found: using 1 thread per rank. Install libgomp (part of gcc), or use more ranks"
    ]


def threads_by_default(as_zdem: bool = False) -> int:
    """Threads per rank without -j: what `srun -c` or `sbatch -c` gives each task and this process may use, else 1.

    as_zdem: of a ZDEM script that one process runs alone, as the ZDEM manual has it: OMP_NUM_THREADS, else all physical
    cores this process may use.
    """
    given = os.environ.get("SLURM_CPUS_PER_TASK", "")
    who = launcher()
    if as_zdem and (who is None or who.size == 1):
        wanted = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
        if wanted.isdigit() and int(wanted) > 0:
            return int(wanted)
        if not given.isdigit() and "SLURM_JOB_ID" in os.environ:  # a share of a node that has no masks
            given = os.environ.get("SLURM_CPUS_ON_NODE", "")
        return max(1, min(int(given), physical_cores())) if given.isdigit() else physical_cores()
    return max(1, min(int(given), cores())) if given.isdigit() else 1


def physical_cores(root: str = "/") -> int:
    """The physical cores that this process may use: of its mask, two threads of a core being one, and no more than a
    control group allows it time for. root: where proc and sys are."""
    found = set()
    for cpu in mask():
        siblings = cgroups.read(Path(root, f"sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list"))
        found.add(siblings.strip() or str(cpu))
    quota = cgroups.cpu_quota(Path(root))
    return max(1, len(found) if quota is None else min(len(found), round(quota)))


def let_waiting_threads_sleep(threads: int) -> None:
    """Let waiting threads sleep where a host has more threads than cores: a spinning thread takes a core from one that
    works."""
    counts = (os.environ.get(name, "") for name in LOCAL_RANKS)
    ranks = next((int(count) for count in counts if count.isdigit()), 1)
    if threads > 1 and ranks * threads > (os.cpu_count() or 1):
        os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    # For some ten microseconds, a fork and join takes two; by default it is milliseconds, in which other programs wait.
    os.environ.setdefault("GOMP_SPINCOUNT", "10000")


LOCAL_RANKS = ("OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE")
"""Where Open MPI, MPICH and Slurm say how many ranks share this host."""


def set_thread_variables(threads: int) -> None:
    """One number for numba, OpenMP and the BLAS libraries."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = str(threads)
    os.environ["NUMBA_NUM_THREADS"] = str(started_threads() or threads)


def started_threads() -> int | None:
    """The number of threads that numba has started in this process: from then on it compiles nothing while its variable
    says another number. None before."""
    pool, config = sys.modules.get("numba.np.ufunc.parallel"), sys.modules.get("numba.core.config")
    return config.NUMBA_NUM_THREADS if pool is not None and config is not None and pool._is_initialized else None


def openmp_runtime_found() -> bool:
    """Return whether numba's OpenMP layer finds the library it is linked against."""
    if sys.platform != "linux":
        return True
    try:
        ctypes.CDLL("libgomp.so.1")
    except OSError:
        return False
    return True


def cores() -> int:
    """The number of cores this process may run on."""
    return len(mask())


def mask() -> frozenset[int]:
    """The cores this process may run on."""
    return frozenset(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))


# -- MPI -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Launcher:
    """Launcher of a process: its name, the number of processes (None: it does not say) and which one this is."""

    name: str
    size: int | None
    rank: int


def launcher() -> Launcher | None:
    """The launcher this process was started by; None when it was started by hand."""
    for name, (size, rank) in LAUNCHERS.items():
        if size in os.environ:
            return Launcher(name, int(os.environ[size]), int(os.environ.get(rank, "0")))
    if "PMIX_RANK" in os.environ:
        return Launcher("PMIx", None, int(os.environ["PMIX_RANK"]))
    return None


def speaks_for_all() -> bool:
    """Return whether this process is the one that prints before MPI runs (the launcher's rank 0)."""
    who = launcher()
    return who is None or who.rank == 0


@contextmanager
def one_voice() -> Iterator[None]:
    """Before MPI has begun: one process shows what all of them find wrong.

    The others are silent and leave with 0; with an error code the launcher might end the first before it has
    printed. Faults that may be one process's own (anything but a UsageError or an exit) pass through.
    """
    if speaks_for_all():
        yield
        return
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
        try:
            yield
        except (UsageError, SystemExit):
            raise SystemExit(0) from None


def start_mpi() -> Comm:
    """The communicator of the run. MPI is started only when a launcher started several processes.

    UsageError when the launcher says n processes and MPI says one: n copies of the same run would overwrite each
    other's files. HpcdemError when no MPI library can be loaded.
    """
    from hpcdem.core.comm import SerialComm
    from hpcdem.halo.comm import MpiComm

    who = launcher()
    if who is None or who.size == 1:
        return SerialComm()
    try:
        import mpi4py

        # One thread calls MPI, so MPI can leave its locks out; the exit is ours (runtime.shutdown).
        mpi4py.rc.thread_level = "funneled"
        mpi4py.rc.finalize = False
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise HpcdemError(
            f"started as {who.size or 'several'} processes by {who.name}, but mpi4py finds no MPI library: {error}"
        ) from error
    # Debian's h5py uses its build without MPI by default; others ignore this.
    os.environ.setdefault("H5PY_ALWAYS_USE_MPI", "1")
    size = MPI.COMM_WORLD.Get_size()
    if size == 1 and (who.size is None and who.rank == 0):
        return SerialComm()
    if size == 1:
        raise UsageError(copies_of_rank_0(who, mpi_library()))
    return MpiComm(MPI.COMM_WORLD)


def mpi_library() -> str:
    """Name and version of the MPI library that mpi4py runs on."""
    from mpi4py import MPI

    return first_line(MPI.Get_library_version())


def first_line(text: str) -> str:
    """The first line with text, with single blanks; else empty."""
    return next((" ".join(line.split()) for line in text.replace("\0", "").splitlines() if line.strip()), "")


def last_line(text: str) -> str:
    """The last line with text, with single blanks; else empty."""
    return first_line("\n".join(reversed(text.splitlines())))


def copies_of_rank_0(who: Launcher, library: str) -> str:
    """The refusal when MPI and the launcher do not know each other, and the way out of it."""
    many = f"{who.size} processes" if who.size else "several processes"
    return (
        f"{who.name} started {many}, but in MPI each of them is rank 0 of 1: the launcher does not belong to the MPI "
        f"library that mpi4py uses, which is {library}. They would overwrite each other's files. Start with "
        f"{launcher_of(library)}"
    )


def launcher_of(library: str, environ: Mapping[str, str] = os.environ) -> str:
    """Return the launcher whose ranks this MPI library knows."""
    if "SLURM_JOB_ID" in environ:
        return f"srun --mpi={slurm_mpi_type(library)} (srun --mpi=list shows the choices)"
    if "Open MPI" in library:
        return "Open MPI's own mpiexec"
    return "the mpiexec of this library (a wheel has it in the bin folder of the venv)"


def slurm_mpi_type(library: str) -> str:
    """Return the PMI type with which srun connects ranks of this MPI library."""
    return "pmix" if "Open MPI" in library else "pmi2"


def patient_barrier(comm: Comm) -> None:
    """Wait for all ranks without keeping a core busy, for waits of seconds and more."""
    if comm.mpi is not None:
        request = comm.mpi.Ibarrier()
        while not request.Test():
            time.sleep(0.005)


# -- start report --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """Place of a rank: host and the cores in its mask before and after MPI began."""

    host: str
    cores_before: int
    mask: frozenset[int]
    threads: int


def place(cores_before: int, threads: int) -> Place:
    """The place of this rank."""
    return Place(socket.gethostname(), cores_before, mask(), threads)


def start_report(places: list[Place], library: str | None) -> str:
    """One line: version, ranks, threads, hosts, cores."""
    hosts = dict.fromkeys(p.host for p in places)
    ranks, threads = len(places), places[0].threads
    where = next(iter(hosts)) if len(hosts) == 1 else f"{len(hosts)} hosts ({', '.join(list(hosts)[:4])}"
    if len(hosts) > 1:
        where += ", ...)" if len(hosts) > 4 else ")"
    masks = sorted({len(p.mask) for p in places})
    each = f"{masks[0]}" if len(masks) == 1 else f"{masks[0]} to {masks[-1]}"
    parts = [
        f"hpcdem {version()}",
        f"{ranks} rank{'s' * (ranks > 1)} x {threads} thread{'s' * (threads > 1)} on {where}",
        f"{each} core{'s' * (masks[-1] > 1)} open to each rank" if ranks > 1 else f"{each} core{'s' * (masks[-1] > 1)}",
    ]
    return " | ".join(parts + [library] if library else parts)
