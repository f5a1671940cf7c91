"""What is wrong with a place before a run finds out: `hpcdem doctor`, and the warnings at the start of a run.

One table of checks drives both. A check is a function of a `Scene` that yields findings; those that cost next to
nothing and write no file are made at every start, and what they find goes into the log. Checks of the job look at all
ranks and are made by rank 0; those of each host by its first rank.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

from hpcdem.runtime.doctor.findings import Finding, Found, Level, merged, problem, warning
from hpcdem.runtime.doctor.scene import Scene

if TYPE_CHECKING:
    from hpcdem.halo.comm import SerialComm

__all__ = ["CHECKS", "Check", "Finding", "Level", "Scene", "examine", "look", "start_warnings"]


@dataclass(frozen=True)
class Check:
    """name: `module.function` of this package, loaded when it is needed; at_start: also at the start of every run."""

    name: str
    each_host: bool = False
    at_start: bool = False

    def look(self, scene: Scene) -> Iterator[Finding]:
        """What it finds."""
        module, _, function = self.name.partition(".")
        look = getattr(importlib.import_module(f"hpcdem.runtime.doctor.{module}"), function)
        yield from cast(Callable[[Scene], Iterable[Finding]], look)(scene)


CHECKS = (
    Check("software.python", each_host=True),
    Check("software.packages", each_host=True),
    Check("software.imports", each_host=True),
    Check("mpi.library"),
    Check("mpi.trial"),
    Check("cores.crowded", at_start=True),
    Check("cores.narrowed", at_start=True),
    Check("cores.of_a_job_step", at_start=True),
    Check("cores.quota", each_host=True, at_start=True),
    Check("cores.mapping"),
    Check("host.memory", each_host=True, at_start=True),
    Check("host.memory_said", each_host=True),
    Check("slurm.end_of_job"),
    Check("slurm.cores_of_srun"),
    Check("slurm.mpi_type"),
    Check("software.hdf5"),
    Check("storage.locking_of_hdf5", at_start=True),
    Check("storage.kind"),
    Check("storage.free_space", at_start=True),
    Check("storage.results"),
    Check("storage.future_files"),
    Check("storage.temporary", each_host=True),
    Check("kernels.not_ours_alone", each_host=True, at_start=True),
    Check("kernels.cache", each_host=True),
    Check("kernels.threads", each_host=True),
    Check("host.shell_limits", each_host=True, at_start=True),
    Check("host.shell_limits_said", each_host=True),
    Check("host.clocks", at_start=True),
    Check("host.text", at_start=True),
    Check("software.figures"),
    Check("software.petsc"),
)


SOON = 5.0
"""Seconds until a new file is seen by all: network file systems remember for a while that it was not there."""


def look(scene: Scene, at_start: bool = False) -> Found:
    """What this rank finds: checks of the job if it is rank 0, those of the host if it is the first there.

    A check that fails is a finding of the doctor and nothing to a run.
    """
    found: Found = []
    for number, check in enumerate(CHECKS):
        if (at_start and not check.at_start) or not (scene.first_of_host if check.each_host else scene.rank == 0):
            continue
        try:
            found += [(number, check.each_host, finding) for finding in check.look(scene)]
        except Exception as error:
            if not at_start:
                failed = warning("doctor", f"the check {check.name} itself failed: {type(error).__name__}: {error}")
                found.append((number, check.each_host, failed))
    return found


def start_warnings(scene: Scene, comm: SerialComm) -> list[str]:
    """Collective: what the log of a run says at its start, on rank 0; empty elsewhere and where all is well."""
    of_ranks = comm.gather(look(scene, at_start=True))
    return [finding.line() for finding in merged(of_ranks or [], [p.host for p in scene.places])]


def examine(scene: Scene, comm: SerialComm) -> list[Finding]:
    """Collective: all findings, on rank 0; empty elsewhere. Takes some seconds and writes a few files, which it removes
    again."""
    from hpcdem.runtime.launch import patient_barrier

    patient_barrier(comm)
    scene.clocks = comm.allgather(scene.now())
    found = look(scene) + _one_file_system(scene, comm)
    patient_barrier(comm)
    of_ranks = comm.gather(found)
    return merged(of_ranks or [], [p.host for p in scene.places])


def _one_file_system(scene: Scene, comm: SerialComm) -> Found:
    """Collective: whether all hosts see what rank 0 writes among the results."""
    if len(scene.hosts) == 1:
        return []
    from hpcdem.runtime.doctor.mounts import existing

    token = comm.bcast(existing(scene.directory) / f".hpcdem-doctor-{time.time_ns()}" if comm.rank == 0 else None)
    if comm.rank == 0:
        with suppress(OSError):
            token.touch()
    comm.barrier()
    deadline = time.monotonic() + SOON
    while scene.first_of_host and not token.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    missing = scene.first_of_host and not token.exists()
    comm.barrier()
    if comm.rank == 0:
        with suppress(OSError):
            token.unlink()
    return [(len(CHECKS), True, _not_seen(token.parent))] if missing else []


def _not_seen(folder: Path) -> Finding:
    return problem(
        "results",
        f"a file that rank 0 made in {folder} is not seen: the hosts have different file systems there",
        "--outdir DIR on a file system that all hosts see",
    )
