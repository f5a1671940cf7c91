"""`hpcdem doctor`: what is wrong with this place, before a run finds out."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import EXIT_ERROR, EXIT_OK, HpcdemError
from hpcdem.runtime import launch, shutdown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hpcdem.core.comm import Comm
    from hpcdem.runtime.doctor import Finding

STYLES = {"OK": "green", "WARNING": "yellow", "PROBLEM": "bold red"}


@click.command(context_settings=HELP)
@click.option("--dir", "directory", type=PATH, default=Path(), metavar="DIR", help="Folder of the results [.].")
@click.option("-j", "threads", type=click.IntRange(1), metavar="N", help="Threads per rank [value of srun -c, else 1].")
def doctor(**options: Any) -> None:
    """Report what would make a run fail, slow it down or put it at risk, and the commands that fix it: packages, MPI
    and its launcher, cores and memory, file systems, the kernel cache, Slurm, limits of the shell.

    Also under mpiexec or srun, as the run would be started: then all ranks and hosts are checked. Exit codes: 0 no
    problems, 1 problems found (warnings do not count).
    """


def start(words: list[str], cores_before: int) -> NoReturn:
    """Check the machine, print the findings and exit. A launch that a run would reject is a finding too. Collective."""
    with messages_only(), launch.one_voice():
        options = read_command_line(doctor, "hpcdem doctor", words)
        threads, _ = launch.prepare_environment(options["threads"] or launch.threads_by_default())
        comm, refusal = communicator()

    def work() -> None:
        from hpcdem.runtime.doctor import Machine, examine

        places = comm.allgather(launch.place(cores_before, threads))
        library = launch.mpi_library() if comm.mpi is not None or "mpi4py.MPI" in sys.modules else None
        machine = Machine(places, comm.rank, launch.launcher(), library, refusal, options["directory"])
        code = report(examine(machine, comm), sys.stdout)
        if comm.bcast(code) != EXIT_OK:
            sys.exit(code)

    shutdown.leave(shutdown.run_together(comm, work))


def communicator() -> tuple[Comm, str]:
    """Return the communicator of all ranks, or of this process with the reason why MPI cannot start; other processes
    exit then."""
    try:
        return launch.start_mpi(), ""
    except HpcdemError as error:
        if not launch.speaks_for_all():
            sys.exit(EXIT_OK)
        from hpcdem.core.comm import SerialComm

        return SerialComm(), str(error)


def report(findings: Sequence[Finding], stream: TextIO) -> int:
    """Print the findings, one per line, those that matter last; returns the exit code."""
    if not findings:  # another rank speaks
        return EXIT_OK
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    # Cut into lines for people only: who reads a file or a pipe wants one line per finding. Open MPI gives its
    # processes a terminal, wherever their output goes in the end.
    terminal = stream.isatty() and "OMPI_COMM_WORLD_SIZE" not in os.environ
    console = Console(file=stream, highlight=False, force_terminal=terminal, width=None if terminal else 10_000)
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in ("", "what", "found", "what to do"):
        table.add_column(name, overflow="fold")
    for finding in sorted(findings, key=lambda finding: finding.level):
        name = finding.level.name
        row = (finding.topic, finding.text, finding.cure)
        table.add_row(f"[{STYLES[name]}]{name.lower()}[/]", *(escape(" ".join(text.split())) for text in row))
    console.print(table)
    counts = {name: sum(f.level.name == name for f in findings) for name in ("PROBLEM", "WARNING")}
    found = [f"{n} {name.lower()}{'s' * (n > 1)}" for name, n in counts.items() if n]
    console.print(", ".join(found) if found else "no problems", end="\n")
    return EXIT_ERROR if counts["PROBLEM"] else EXIT_OK
