"""All that the checks may look at, in one place, so that a test can show them another machine."""

from __future__ import annotations

import fcntl
import importlib
import importlib.metadata
import importlib.util
import os
import resource
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from hpcdem.runtime import launch
from hpcdem.runtime.launch import LAUNCHERS, Launcher, Place

PATIENCE = 10.0
"""Seconds that another program has for its answer."""
LIBRARY = """
import mpi4py
mpi4py.rc.initialize = False
from mpi4py import MPI
print(MPI.Get_library_version())
"""


@dataclass(frozen=True)
class Disk:
    """What is asked of a file system."""

    fsync: Callable[[int], None] = os.fsync
    replace: Callable[[Any, Any], None] = os.replace
    flock: Callable[[Any, int], Any] = fcntl.flock
    lockf: Callable[[Any, int], Any] = fcntl.lockf
    statvfs: Callable[[Any], Any] = os.statvfs


def declared() -> tuple[str, list[str]]:
    """The versions of Python that hpcdem can do with, and the packages it needs, as pyproject.toml has them."""
    try:
        about = importlib.metadata.metadata("hpcdem")
        return about["Requires-Python"], about.get_all("Requires-Dist") or []
    except (importlib.metadata.PackageNotFoundError, KeyError):
        project = Path(__file__).parents[3] / "pyproject.toml"  # a source tree that is not installed
        about = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
        return about["requires-python"], about["dependencies"]


@dataclass(frozen=True)
class Software:
    """How packages are asked for: version and needs by their metadata, and their import."""

    declared: Callable[[], tuple[str, list[str]]] = declared
    version: Callable[[str], str] = importlib.metadata.version
    requires: Callable[[str], list[str] | None] = importlib.metadata.requires
    load: Callable[[str], Any] = importlib.import_module
    find: Callable[[str], Any] = importlib.util.find_spec
    python: tuple[int, ...] = field(default_factory=lambda: tuple(sys.version_info[:3]))


def encodings() -> dict[str, str]:
    """In which encoding this process writes its log, and names of files."""
    return {"output": getattr(sys.stdout, "encoding", None) or "utf-8", "file names": sys.getfilesystemencoding()}


@dataclass
class Scene:
    """places: of all ranks. rank: of the process that looks. launcher: who started it. library: the MPI of the run,
    None for one process without. refusal: why MPI could not begin. directory: where results will go. root: where proc
    and sys are. clocks: time of day of each rank at one moment [s].
    """

    places: list[Place]
    rank: int = 0
    launcher: Launcher | None = None
    library: str | None = None
    refusal: str = ""
    directory: Path = field(default_factory=Path)
    temporary: Path | None = None
    clocks: list[float] = field(default_factory=list)
    environ: Mapping[str, str] = field(default_factory=lambda: os.environ)
    root: Path = field(default_factory=lambda: Path("/"))
    limits: Callable[[int], tuple[int, int]] = resource.getrlimit
    ask: Callable[..., Any] = subprocess.run
    which: Callable[[str], str | None] = shutil.which
    ffmpeg: Callable[[], str | None] = lambda: shutil.which("ffmpeg")
    now: Callable[[], float] = time.time
    encodings: Callable[[], Mapping[str, str]] = encodings
    disk: Disk = field(default_factory=Disk)
    software: Software = field(default_factory=Software)

    @property
    def here(self) -> list[Place]:
        """The places of the ranks on this host."""
        return [p for p in self.places if p.host == self.places[self.rank].host]

    @property
    def hosts(self) -> list[str]:
        """The hosts, each once."""
        return list(dict.fromkeys(p.host for p in self.places))

    @property
    def first_of_host(self) -> bool:
        """Whether this rank is the one that looks at its host."""
        return all(p.host != self.places[self.rank].host for p in self.places[: self.rank])

    def read(self, *parts: str) -> str:
        """The text of a file under the root; empty where there is none."""
        try:
            return self.root.joinpath(*(part.lstrip("/") for part in parts)).read_text(errors="replace")
        except OSError:
            return ""

    @cached_property
    def mpi_library(self) -> tuple[str, str]:
        """Name and version of the MPI library that mpi4py loads, or why it loads none.

        Where the run has not begun MPI another process looks: a library may end the process that cannot use it.
        """
        if self.library is not None:
            return self.library, ""
        code, out, err = self.run([sys.executable, "-c", LIBRARY], 60.0)
        if code == 0 and out.strip():
            return launch.first_line(out), ""
        return "", launch.last_line(err) or f"exit code {code}"

    @cached_property
    def mountinfo(self) -> str:
        """The table of mounted file systems; see proc(5)."""
        return self.read("proc/self/mountinfo")

    def run(self, command: list[str], patience: float = PATIENCE) -> tuple[int, str, str]:
        """Exit code and texts of a program; 127 where it cannot be started, 124 where it takes too long.

        It sees no launcher: one that starts MPI must not be taken for a rank of this job.
        """
        names = {name for pair in LAUNCHERS.values() for name in pair}
        of_launchers = ("PMI_", "PMIX_", "OMPI_COMM_", "MPI_LOCAL", "HYDI_", "PRTE_LAUNCHED")
        environ = {k: v for k, v in self.environ.items() if k not in names and not k.startswith(of_launchers)}
        try:
            done = self.ask(
                command, capture_output=True, text=True, errors="replace", timeout=patience, check=False, env=environ,
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return 124, "", f"no answer in {patience:g} s"
        except (OSError, ValueError) as failure:
            return 127, "", str(failure)
        return done.returncode, done.stdout, done.stderr
