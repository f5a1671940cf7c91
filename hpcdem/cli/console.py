"""`hpcdem console`: PCDC commands and Python, line by line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import UsageError
from hpcdem.runtime import launch, shutdown
from hpcdem.session import Session, enter


@click.command(context_settings=HELP)
@click.option("-j", "threads", type=click.IntRange(1), metavar="N", help="Threads [what srun -c gives, else 1].")
@click.option("--outdir", type=PATH, metavar="DIR", help="Results [data in this folder].")
def console(**options: Any) -> None:
    """Take PCDC commands and Python line by line, on one rank. Tab completes; exit() or Ctrl-D ends."""


def start(words: list[str]) -> NoReturn:
    """The program, to its end."""
    with messages_only(), launch.one_voice():
        options = read_command_line(console, "hpcdem console", words)
        threads, warnings = launch.prepare_environment(options["threads"] or launch.threads_by_default())
        comm = launch.start_mpi()

    def work() -> None:
        from hpcdem.lang.pcdc.console import Console
        from hpcdem.lang.pcdc.execute import Interpreter
        from hpcdem.runtime.progress import Log
        from hpcdem.runtime.run_folder import Job
        from hpcdem.runtime.stop_requests import StopRequests

        if comm.size > 1:
            raise UsageError(f"hpcdem console is for one rank, this are {comm.size}; a script runs on many")
        log = Log(comm.rank)
        for warning in warnings:
            log.warn(warning)
        session = Session(comm, log, StopRequests(), threads, Path(), options["outdir"], figure=False)
        session.job = Job("", "pcdc", (), threads)
        project = session.project()
        session.interpreter = Interpreter(project)
        enter(session)

        def begin() -> None:
            """Ctrl-C stops a run, and is forgotten then."""
            session.stop.uninstall()
            session.stop = project.blocks.stop = StopRequests().install()

        try:
            Console(session.interpreter, begin=begin).run()
        except BaseException as error:
            session.close(error)
            raise
        session.close()

    shutdown.leave(shutdown.run_together(comm, work))
