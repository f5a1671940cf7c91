"""Python, the packages, and the libraries under them."""

from __future__ import annotations

import importlib.metadata
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from hpcdem.runtime import launch
from hpcdem.runtime.doctor.findings import Finding, ok, problem, warning
from hpcdem.runtime.doctor.scene import Scene

PATIENT = 15.0
"""Seconds for all imports from which on the file system is to blame."""
WHAT = ("numpy", "scipy", "numba", "h5py", "matplotlib", "rich")
"""Modules that a run loads, and its last picture."""
PETSC = "import mpi4py; mpi4py.rc.initialize = False; import petsc4py.lib; petsc4py.lib.ImportPETSc()"


def python(scene: Scene) -> Iterator[Finding]:
    """The interpreter."""
    version = ".".join(str(n) for n in scene.software.python)
    wanted, _ = scene.software.declared()
    if version in SpecifierSet(wanted, prereleases=True):
        yield ok("Python", f"hpcdem {launch.version()}, Python {version}: {sys.executable}")
    else:
        said = f"Python {version}, and hpcdem needs {wanted}"
        yield problem("Python", said, "PYTHON=/path/to/python3 ./scripts/run ...")


def packages(scene: Scene) -> Iterator[Finding]:
    """Installed versions against those that hpcdem needs, and against those that the packages need of each other."""
    good = []
    for wanted in _needs(scene.software.declared()[1]):
        version = _version(scene, wanted.name)
        if version is None:
            yield problem("packages", f"{wanted.name} is not installed", f'pip install "{_as_written(wanted)}"')
        elif not wanted.specifier.contains(version, prereleases=True):
            yield problem(
                "packages",
                f"{wanted.name} {version} is installed, {wanted.name}{wanted.specifier} is needed",
                f'pip install --upgrade "{_as_written(wanted)}"',
            )
        else:
            good.append(f"{wanted.name} {version}")
            yield from _quarrels(scene, wanted.name)
    if good:
        yield ok("packages", ", ".join(good))


def _quarrels(scene: Scene, name: str) -> Iterator[Finding]:
    """What an installed package needs of others and does not get."""
    try:
        lines = scene.software.requires(name) or []
    except importlib.metadata.PackageNotFoundError:  # it has no description, see _version
        return
    for wanted in _needs(lines):
        version = _version(scene, wanted.name)
        if version is not None and not wanted.specifier.contains(version, prereleases=True):
            yield problem(
                "packages",
                f"{name} needs {wanted.name}{wanted.specifier}, and {wanted.name} {version} is installed",
                f'pip install "{_as_written(wanted)}"',
            )


def _needs(lines: list[str]) -> Iterator[Requirement]:
    """Requirements that hold here, without those of extras."""
    for line in lines:
        try:
            wanted = Requirement(line)
        except InvalidRequirement:  # some packages write what is none
            continue
        if wanted.marker is None or wanted.marker.evaluate({"extra": ""}):
            yield wanted


def _as_written(wanted: Requirement) -> str:
    return f"{wanted.name}{wanted.specifier}"


def _version(scene: Scene, name: str) -> str | None:
    """By the package's description, or, as for Debian's h5py, which has two under other names, as it says itself."""
    try:
        return scene.software.version(canonicalize_name(name))
    except importlib.metadata.PackageNotFoundError:
        pass
    try:
        return getattr(scene.software.load(name), "__version__", None)
    except Exception:  # not there, or said by `imports`
        return None


def imports(scene: Scene) -> Iterator[Finding]:
    """Whether the packages can be loaded, and how long it takes."""
    began = time.perf_counter()
    whole = True
    for name in WHAT:
        try:
            scene.software.load(name)
        except Exception as error:  # whatever a broken library makes of it
            whole = False
            cure = f"pip install --force-reinstall {name}"
            if name == "matplotlib" and "MPLBACKEND" in scene.environ and "backend" in str(error):
                cure = "unset MPLBACKEND"
            yield problem("packages", f"{name} cannot be loaded: {launch.first_line(str(error))}", cure)
    seconds = time.perf_counter() - began
    if seconds > PATIENT:
        yield warning(
            "packages",
            f"loading the packages took {seconds:.0f} s: many small files on a slow file system",
            f"Put the environment on a disk of this host: python -m venv {tempfile.gettempdir()}/hpcdem",
        )
    elif whole:
        yield ok("packages", f"loaded in {seconds:.1f} s")


def hdf5(scene: Scene) -> Iterator[Finding]:
    """The library under h5py."""
    try:
        h5py = scene.software.load("h5py")
    except Exception:  # said already
        return
    locks = scene.environ.get("HDF5_USE_FILE_LOCKING", "not set")
    head = f"h5py {h5py.version.version}, HDF5 {h5py.version.hdf5_version}, HDF5_USE_FILE_LOCKING {locks}"
    if h5py.get_config().mpi:
        yield ok("HDF5", f"{head}, with MPI: all ranks write a file together")
    else:
        yield ok("HDF5", f"{head}, without MPI: files go through rank 0", "See docs/running.md, Parallel HDF5")


def figures(scene: Scene) -> Iterator[Finding]:
    """What pictures and films need."""
    try:
        matplotlib = scene.software.load("matplotlib")
    except Exception:  # said already
        return
    chosen = scene.environ.get("MPLBACKEND")
    extra = f"; MPLBACKEND={chosen} is for your own programs" if chosen else ""
    folder = Path(matplotlib.get_cachedir())
    if folder.is_relative_to(tempfile.gettempdir()) and "MPLCONFIGDIR" not in scene.environ:
        said = "matplotlib cannot write its own folder and searches all fonts anew each time"
        yield warning("figures", said, "export MPLCONFIGDIR=DIR")
    yield ok("figures", f"matplotlib {matplotlib.__version__}, drawn by Agg without a screen{extra}")
    program = scene.ffmpeg()
    if program is None:
        yield ok("films", "no ffmpeg: films are GIF only", "pip install imageio-ffmpeg")
    else:
        yield ok("films", f"ffmpeg: {program}")


def petsc(scene: Scene) -> Iterator[Finding]:
    """Only whether it can be loaded: nothing depends on it yet."""
    if scene.software.find("petsc4py") is None:
        yield ok("PETSc", "petsc4py is not installed, and not needed")
        return
    code, _, said = scene.run([sys.executable, "-c", PETSC], 60.0)
    if code == 0:
        yield ok("PETSc", f"petsc4py {_version(scene, 'petsc4py') or ''} loads".replace("  ", " "))
    else:
        yield warning(
            "PETSc",
            f"petsc4py is there and its library cannot be loaded: {launch.last_line(said) or code}",
            "export PETSC_DIR=DIR of PETSc",
        )
