"""Python, the packages, the libraries under them, and the MPI launcher."""

from __future__ import annotations

import platform
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from importlib import import_module as load
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcdem.runtime import launch
from hpcdem.runtime.doctor.machine import Findings, Machine, ok, problem, warning

if TYPE_CHECKING:
    from packaging.requirements import Requirement  # 60 ms, which the start of a run does not need

PATIENT = 15.0
"""Seconds for all imports from which on the file system is to blame."""
MODULES = ("numpy", "scipy", "numba", "h5py", "matplotlib", "rich")
"""Packages loaded by a run, and by its last picture."""
TRIAL = "from mpi4py import MPI; print('hpcdem sees', MPI.COMM_WORLD.Get_size())"
PETSC = "import mpi4py; mpi4py.rc.initialize = False; import petsc4py.lib; petsc4py.lib.ImportPETSc()"


def packages(machine: Machine) -> Findings:
    """Installed versions against those that hpcdem needs, and those that its packages need of each other."""
    yield ok("Python", f"hpcdem {launch.version()}, Python {platform.python_version()}: {sys.executable}")
    needs = list(_needs("hpcdem"))
    if not needs:
        yield warning(
            "packages", "hpcdem is not installed: versions of its packages are not checked", "pip install -e DIR"
        )
    pairs = [("hpcdem", need) for need in needs]
    for who, need in pairs + [(own.name, need) for own in needs for need in _needs(own.name)]:
        version, wanted = _version(need.name), f"{need.name}{need.specifier}"
        if version is None and who == "hpcdem":
            yield problem("packages", f"{need.name} is not installed", f'pip install "{wanted}"')
        elif version is not None and not need.specifier.contains(version, prereleases=True):
            text = f"{who} needs {wanted}, and {need.name} {version} is installed"
            yield problem("packages", text, f'pip install "{wanted}"')
    yield ok("packages", ", ".join(f"{need.name} {_version(need.name)}" for need in needs if _version(need.name)))


def _needs(package: str) -> Iterator[Requirement]:
    """List the requirements of an installed package on this machine, without its extras; none if it has no metadata."""
    from packaging.requirements import InvalidRequirement, Requirement

    try:
        lines: Iterable[str] = metadata.requires(package) or []
    except metadata.PackageNotFoundError:
        return
    for line in lines:
        try:
            need = Requirement(line)
        except InvalidRequirement:  # some packages write what is none
            continue
        if need.marker is None or need.marker.evaluate({"extra": ""}):
            yield need


def _version(name: str) -> str | None:
    """Return a version from the package's metadata, or, if that has another name (Debian's h5py), from the module."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        try:
            return getattr(load(name), "__version__", None)
        except Exception:  # not there, or reported by `libraries`
            return None


def libraries(machine: Machine) -> Findings:
    """Check that the packages load and how long that takes, and list the files and films that they can write."""
    began, loaded = time.perf_counter(), dict[str, Any]()
    for name in MODULES:
        try:
            loaded[name] = load(name)
        except Exception as error:  # whatever a broken library makes of it
            backend = name == "matplotlib" and "MPLBACKEND" in machine.environ and "backend" in str(error)
            cure = "unset MPLBACKEND" if backend else f"pip install --force-reinstall {name}"
            yield problem("packages", f"{name} cannot be loaded: {launch.first_line(str(error))}", cure)
    seconds = time.perf_counter() - began
    if seconds > PATIENT:
        text = f"loading the packages took {seconds:.0f} s: many small files on a slow file system"
        cure = f"Put the environment on a disk of this host: python -m venv {tempfile.gettempdir()}/hpcdem"
        yield warning("packages", text, cure)
    elif len(loaded) == len(MODULES):
        yield ok("packages", f"loaded in {seconds:.1f} s")
    if "h5py" in loaded:
        h5py, locks = loaded["h5py"], machine.environ.get("HDF5_USE_FILE_LOCKING", "not set")
        text = f"h5py {h5py.version.version}, HDF5 {h5py.version.hdf5_version}, HDF5_USE_FILE_LOCKING {locks}"
        if h5py.get_config().mpi:
            yield ok("HDF5", f"{text}, with MPI: all ranks write a file together")
        else:
            yield ok("HDF5", f"{text}, without MPI: files go through rank 0", "See docs/running.md, Parallel HDF5")
    ffmpeg = shutil.which("ffmpeg") or (find_spec("imageio_ffmpeg") and "of imageio-ffmpeg")
    if ffmpeg:
        yield ok("films", f"ffmpeg: {ffmpeg}")
    else:
        yield ok("films", "ffmpeg not found: films are GIF only", "pip install imageio-ffmpeg")


def petsc(machine: Machine) -> Findings:
    """Check that the solver of large static problems loads, in a separate process, which it may end."""
    if find_spec("petsc4py") is None:
        yield ok("PETSc", "petsc4py is not installed: static problems are solved on one rank")
        return
    code, _, err = machine.run([sys.executable, "-c", PETSC], 60.0)
    if code:
        text = f"petsc4py is installed, but its library cannot be loaded: {launch.last_line(err) or code}"
        yield warning("PETSc", text, "export PETSC_DIR=DIR of PETSc")
    else:
        yield ok("PETSc", f"petsc4py {_version('petsc4py')} loads")


def threads(machine: Machine) -> Findings:
    """The library under numba's threads."""
    layer = machine.environ.get("NUMBA_THREADING_LAYER", "omp")
    if layer not in ("omp", "workqueue"):
        text = f"NUMBA_THREADING_LAYER={layer}: threads start much more slowly than with OpenMP"
        yield warning("threads", text, "unset NUMBA_THREADING_LAYER")
    elif launch.openmp_runtime_found():
        yield ok("threads", f"libgomp.so.1 found, {machine.here[0].threads} thread(s) per rank requested")
    else:
        text = "libgomp.so.1 (OpenMP) cannot be loaded: one thread per rank only"
        yield warning("threads", text, "apt-get install libgomp1")


def mpi_library(machine: Machine) -> Findings:
    """The library, who started these ranks, how many there are and where."""
    if machine.refusal:
        cure = launch.launcher_of(machine.library, machine.environ) if machine.library else "pip install mpich"
        yield problem("MPI", machine.refusal, cure)
        return
    library, error = machine.mpi_library
    if error:
        yield warning("MPI", f"mpi4py finds no MPI library, so only one rank is possible: {error}", "pip install mpich")
        return
    n, hosts = len(machine.places), machine.hosts
    who = f"started by {machine.launcher.name}" if machine.launcher else "started without a launcher"
    where = hosts[0] if len(hosts) == 1 else f"{len(hosts)} hosts"
    yield ok("MPI", f"{library}; {n} rank{'s' * (n > 1)} on {where}, {who}")


def mpi_launcher(machine: Machine) -> Findings:
    """Without a running launcher: check that the launcher in PATH starts ranks that find each other."""
    library, error = ("", "refused") if machine.refusal else machine.mpi_library
    if error or machine.launcher or machine.in_job or len(machine.here[0].mask) < 2:  # some start no more than cores
        return
    own = Path(sys.executable).parent / "mpiexec"
    path = shutil.which("mpiexec")
    program = path or (str(own) if own.exists() else None)
    if program is None:
        yield warning("MPI", "mpiexec is not in the PATH", "pip install mpich, or load the cluster's MPI module")
        return
    code, out, err = machine.run([program, "-n", "2", sys.executable, "-c", TRIAL], 30.0)
    if "hpcdem sees 2" in out:
        yield ok("MPI", f"{program} -n 2 starts two ranks", "" if path else f"export PATH={own.parent}:$PATH")
    elif "hpcdem sees 1" in out:
        text = f"{program} does not belong to the MPI library of mpi4py ({library}): each process is rank 0 of 1"
        if own.exists() and str(own) != program:
            yield warning("MPI", text, f"{own} -n 2 hpcdem ...")
        else:
            yield problem("MPI", text, launch.launcher_of(library, {}))
    else:
        text = " ".join(line.strip() for line in err.splitlines() if line.strip(" -\t"))
        cure = "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1" if "run as root" in text else ""
        yield warning("MPI", f"{program} -n 2 does not start: {text[:200] or f'exit code {code}'}", cure)


def slurm_mpi_type(machine: Machine) -> Findings:
    """Compare the process manager interface that srun will use with the one that the MPI library supports."""
    if not machine.in_job or len(machine.places) > 1 or machine.refusal or machine.mpi_library[1]:
        return  # ranks that see each other need no advice
    library, chosen = machine.mpi_library[0], machine.environ.get("SLURM_MPI_TYPE", "")
    wanted = launch.slurm_mpi_type(library)
    if chosen and not chosen.startswith(wanted):
        text = f"SLURM_MPI_TYPE={chosen}, but {library} requires {wanted}"
        yield warning("Slurm", text, f"export SLURM_MPI_TYPE={wanted}")
        return
    _, out, err = machine.run(["srun", "--mpi=list"])
    offered = (out + err).replace(",", " ").split()
    if offered and not any(word.startswith(wanted) for word in offered):
        text = f"this Slurm has no --mpi={wanted}, which {library} requires"
        yield warning("Slurm", text, f"Start with {launch.launcher_of(library, {})}, inside the job")
    elif not chosen:
        yield ok("Slurm", f"srun --mpi={wanted} suits {library}", f"srun --mpi={wanted} hpcdem ...")
