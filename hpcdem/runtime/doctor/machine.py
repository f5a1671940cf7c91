"""Subject of the checks (the machine) and their results (findings)."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property, partial
from pathlib import Path
from typing import NamedTuple

from hpcdem.runtime import launch
from hpcdem.runtime.launch import LAUNCHERS, Launcher, Place

MIB = 1 << 20
CLOCK_SKEW = 5.0
"""Seconds by which two clocks may differ."""


class Level(IntEnum):
    """A problem keeps a run from working, a warning makes it slow or puts it at risk."""

    OK = 0
    WARNING = 1
    PROBLEM = 2


class Finding(NamedTuple):
    """topic: one or two words; text: what was found; cure: a command to type, or a sentence that holds one."""

    level: Level
    topic: str
    text: str
    cure: str = ""

    def line(self) -> str:
        """The finding as one line of a log."""
        cure = self.cure if self.cure[:1].isupper() else f"Cure: {self.cure}"
        return f"{self.text}. {cure}" if self.cure else self.text


Findings = Iterator[Finding]
ok, warning, problem = (partial(Finding, level) for level in Level)


def size(count: float) -> str:
    """A number of bytes for people: `512 B`, `4 MiB`, `23.4 GiB`."""
    power = min((max(int(count), 1).bit_length() - 1) // 10, 4)
    return f"{count / 1024**power:.3g} {('B', 'KiB', 'MiB', 'GiB', 'TiB')[power]}"


@dataclass
class Machine:
    """places: of all ranks. rank: of this process. launcher: what started it. library: the MPI of the run, None for one
    process without. refusal: why MPI could not begin. directory: where results will go. clocks: time of day of each
    rank at one moment [s]. token: a file that rank 0 has made among the results. root: where proc and sys are.
    """

    places: Sequence[Place]
    rank: int = 0
    launcher: Launcher | None = None
    library: str | None = None
    refusal: str = ""
    directory: Path = Path()
    clocks: Sequence[float] = (0.0,)
    token: Path = Path()
    environ: Mapping[str, str] = field(default_factory=lambda: os.environ)
    root: Path = Path("/")

    def __post_init__(self) -> None:
        host = self.places[self.rank].host
        self.hosts = list(dict.fromkeys(p.host for p in self.places))
        self.here = [p for p in self.places if p.host == host]
        self.first_of_host = all(p.host != host for p in self.places[: self.rank])
        self.in_job, self.in_step = "SLURM_JOB_ID" in self.environ, "SLURM_STEP_ID" in self.environ

    def slurm(self, name: str) -> int:
        """The number in a variable SLURM_..., 0 if unset."""
        word = self.environ.get(f"SLURM_{name}", "")
        return int(word) if word.isdigit() else 0

    @cached_property
    def mpi_library(self) -> tuple[str, str]:
        """Name and version of the MPI library that mpi4py loads, or why it loads none.

        Where the run has not begun MPI another process looks: a library may end the process that cannot use it.
        """
        if self.library is not None:
            return self.library, ""
        ask = "import mpi4py; mpi4py.rc.initialize = False; from mpi4py import MPI; print(MPI.Get_library_version())"
        code, out, err = self.run([sys.executable, "-c", ask], 60.0)
        if code == 0 and out.strip():
            return launch.first_line(out), ""
        return "", launch.last_line(err) or f"exit code {code}"

    def run(self, command: list[str], timeout: float = 10.0) -> tuple[int, str, str]:
        """Exit code, output and errors of a program; 127 where it cannot be started, 124 after timeout [s].

        It sees no launcher: one that starts MPI must not be taken for a rank of this job.
        """
        hidden = tuple(name for pair in LAUNCHERS.values() for name in pair)
        hidden += ("PMI_", "PMIX_", "OMPI_COMM_", "MPI_LOCAL", "HYDI_", "PRTE_LAUNCHED")
        environ = {name: value for name, value in self.environ.items() if not name.startswith(hidden)}
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, errors="replace", timeout=timeout, env=environ,
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return 124, "", f"no answer in {timeout:g} s"
        except (OSError, ValueError) as failure:
            return 127, "", str(failure)
        return done.returncode, done.stdout, done.stderr
