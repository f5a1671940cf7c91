"""Checks of host, job and folders before a run meets their faults: `hpcdem doctor` and the warnings at the start.

One table of checks drives both. A check is a function of a `Machine` that yields findings; those that cost next to
nothing and write no file are made at every start, and problems are logged. Checks of the job cover all ranks and are
made by rank 0; those of each host by its first rank.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from hpcdem.runtime.doctor import host, software, storage
from hpcdem.runtime.doctor.machine import Finding, Findings, Level, Machine, warning
from hpcdem.runtime.launch import patient_barrier

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm

__all__ = ["CHECKS", "Check", "Finding", "Level", "Machine", "examine", "start_warnings"]


class Check(NamedTuple):
    """each_host: by the first rank of every host, not only by rank 0; at_start: also when a run starts."""

    function: Callable[[Machine], Findings]
    each_host: bool = False
    at_start: bool = False


CHECKS = (
    Check(software.packages, each_host=True),
    Check(software.libraries, each_host=True),
    Check(software.mpi_library),
    Check(software.mpi_launcher),
    Check(host.oversubscribed, each_host=True, at_start=True),
    Check(host.narrowed, at_start=True),
    Check(host.cpu_quota, each_host=True, at_start=True),
    Check(host.mapping),
    Check(host.memory, each_host=True, at_start=True),
    Check(host.srun_cores, at_start=True),
    Check(host.sbatch_cores),
    Check(host.slurm_end),
    Check(software.slurm_mpi_type),
    Check(storage.hdf5_locks, at_start=True),
    Check(storage.in_memory),
    Check(storage.free_space, at_start=True),
    Check(storage.results),
    Check(storage.shared, each_host=True),
    Check(storage.quota),
    Check(storage.temporary, each_host=True),
    Check(storage.cache_owner, each_host=True, at_start=True),
    Check(storage.cache, each_host=True),
    Check(software.threads, each_host=True),
    Check(host.shell_limits, each_host=True, at_start=True),
    Check(host.clocks),
    Check(host.text, at_start=True),
    Check(software.petsc),
)

Found = list[tuple[int, bool, Finding]]
"""Findings of one rank: the number of the check, which orders them, whether it is made on each host, and the
finding."""


def inspect(machine: Machine, at_start: bool = False) -> Found:
    """Run the checks of this rank. A check that fails is a finding of the doctor and is ignored at the start of a
    run."""
    found: Found = []
    for number, check in enumerate(CHECKS):
        if (at_start and not check.at_start) or not (machine.first_of_host if check.each_host else machine.rank == 0):
            continue
        try:
            findings = list(check.function(machine))
        except Exception as error:
            text = f"the check {check.function.__name__} itself failed: {type(error).__name__}: {error}"
            findings = [] if at_start else [warning("doctor", text)]
        found += [(number, check.each_host, finding) for finding in findings if finding.level or not at_start]
    return found


def merged(of_ranks: Sequence[Found], hosts: Sequence[str]) -> list[Finding]:
    """The findings of all ranks in the order of the checks, equal ones once. hosts: that of each rank.

    A finding of a check of every host that is true of some of them names them.
    """
    seen: dict[tuple[int, bool, Finding], list[str]] = {}
    for found, name in zip(of_ranks, hosts):
        for item in found:
            seen.setdefault(item, []).append(name)
    result = []
    for (_, each_host, finding), where in sorted(seen.items(), key=lambda item: item[0][0]):
        if each_host and set(where) != set(hosts):
            some = ", ".join(where[:4]) + (f" and {len(where) - 4} more" if len(where) > 4 else "")
            finding = finding._replace(text=f"{some}: {finding.text}")
        result.append(finding)
    return result


def start_warnings(machine: Machine, comm: Comm) -> list[str]:
    """Collective: what the log of a run says at its start, on rank 0; empty elsewhere and where all is well."""
    of_ranks = comm.gather(inspect(machine, at_start=True))
    return [finding.line() for finding in merged(of_ranks or [], [p.host for p in machine.places])]


def examine(machine: Machine, comm: Comm) -> list[Finding]:
    """Collective: all findings, on rank 0; empty elsewhere. Takes some seconds, writes a few files and removes them."""
    machine.token = comm.bcast(storage.existing(machine.directory) / f".hpcdem-doctor-{time.time_ns()}")
    with suppress(OSError):
        if comm.rank == 0:
            machine.token.touch()
    patient_barrier(comm)
    machine.clocks = comm.allgather(time.time())
    found = inspect(machine)
    patient_barrier(comm)
    with suppress(OSError):
        if comm.rank == 0:
            machine.token.unlink()
    return merged(comm.gather(found) or [], [p.host for p in machine.places])
