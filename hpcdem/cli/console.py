"""`hpcdem console`: PCDC commands and Python, or ZDEM commands, line by line."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import IO, Any, NoReturn, Protocol

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import HpcdemError, StoppedWithCheckpoint, UsageError
from hpcdem.lang.completion import completion
from hpcdem.page.pipe import DONE, MARK, READY
from hpcdem.runtime import launch, shutdown
from hpcdem.session import Session, enter


class Talk(Protocol):
    """Executes texts of either language."""

    def carry_out(self, text: str, name: str = "") -> bool:
        """Carry out a text, or the script `name`; whether there was a command in it. HpcdemError."""

    def show(self) -> Path | None:
        """Write the present state as a frame."""


@click.command(context_settings=HELP)
@click.option("--zdem", is_flag=True, help="ZDEM commands instead of PCDC commands and Python.")
@click.option("-j", "threads", type=click.IntRange(1), metavar="N", help="Threads [value of srun -c, else 1].")
@click.option("--outdir", type=PATH, metavar="DIR", help="Folder of the results [data in the current folder].")
@click.option("--pipe", is_flag=True, hidden=True)
def console(**options: Any) -> None:
    """Enter PCDC commands and Python line by line, on one rank. Tab completes; exit() or Ctrl-D ends."""


def start(words: list[str]) -> NoReturn:
    """The program, to its end."""
    with messages_only(), launch.one_voice():
        options = read_command_line(console, "hpcdem console", words)
        threads, warnings = launch.prepare_environment(options["threads"] or launch.threads_by_default())
        comm = launch.start_mpi()

    def work() -> None:
        from hpcdem.runtime.progress import Log
        from hpcdem.runtime.run_folder import Job
        from hpcdem.runtime.stop_requests import StopRequests

        if comm.size > 1:
            raise UsageError(f"hpcdem console supports one rank, started on {comm.size}: use a script for more")
        log = Log(comm.rank)
        log.folds = False
        for warning in warnings:
            log.warn(warning)
        session = Session(comm, log, StopRequests(), threads, Path(), options["outdir"], figure=False)
        session.job = Job("", "zdem" if options["zdem"] else "pcdc", (), threads)
        enter(session)
        try:
            (_zdem if options["zdem"] else _pcdc)(session, options["pipe"])
        except BaseException as error:
            session.close(error)
            raise
        session.close()

    shutdown.leave(shutdown.run_together(comm, work))


def _pcdc(session: Session, piped: bool) -> None:
    from hpcdem.lang.pcdc.console import Console
    from hpcdem.lang.pcdc.execute import Interpreter
    from hpcdem.runtime.stop_requests import StopRequests

    project = session.project()
    session.interpreter = Interpreter(project)
    enter(session)

    def begin() -> None:
        """Ctrl-C stops a run, and is forgotten then."""
        session.stop.uninstall()
        session.stop = project.blocks.stop = StopRequests().install()

    talk = Console(session.interpreter, begin=begin)
    if piped:
        serve(talk, begin, sys.stdin, sys.stdout)
    else:
        talk.run()


def _zdem(session: Session, piped: bool) -> None:
    from hpcdem.lang.zdem.complete import candidates
    from hpcdem.lang.zdem.console import PROMPT, WELCOME, Conversation
    from hpcdem.runtime.stop_requests import StopRequests

    session.prepare("")
    talk = Conversation(lambda: session.simulation(log=session.log), session.finish)

    def begin() -> None:
        """Ctrl-C stops a run, and is forgotten then."""
        session.stop.uninstall()
        session.stop = StopRequests().install()
        if talk.sim is not None:
            talk.sim.stop = session.stop

    if piped:
        serve(talk, begin, sys.stdin, sys.stdout)
        return
    print(WELCOME)
    with completion(candidates):
        while True:
            try:
                text = input(PROMPT)
                begin()
                talk.carry_out(text)
            except EOFError:
                print()
                return
            except (HpcdemError, StoppedWithCheckpoint) as error:
                print(error)
            except KeyboardInterrupt:
                print("\n(interrupted; Ctrl-D ends)")


def serve(talk: Talk, begin: Any, requests: IO[str], answers: IO[str]) -> None:
    """Serve a program at the other end of a pipe (page/console.py): each line of requests is {"text": ..., "name":
    ...}. Output is text; lines that begin with MARK report readiness and how a request ended."""

    def mark(**content: Any) -> None:
        answers.write(f"\n{MARK}{json.dumps(content)}\n")
        answers.flush()

    def failed(problem: BaseException) -> bool:
        answers.write("interrupted\n" if isinstance(problem, KeyboardInterrupt) else f"{problem}\n")
        return False

    mark(what=READY)
    for line in requests:
        wanted = json.loads(line)
        begin()
        good, accepted, shown = True, True, None  # what fails, or is interrupted, may have changed the model too
        try:
            accepted = talk.carry_out(wanted["text"], wanted.get("name", ""))
        except SystemExit:
            answers.flush()
            return
        except (HpcdemError, StoppedWithCheckpoint, KeyboardInterrupt) as problem:
            good = failed(problem)
        answers.flush()
        try:
            shown = talk.show() if accepted else None
        except (HpcdemError, KeyboardInterrupt) as problem:
            good = failed(problem)
        mark(what=DONE, good=good, frame=None if shown is None else str(shown))
