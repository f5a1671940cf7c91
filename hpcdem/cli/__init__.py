"""The programs hpcdem (also called zdem), zdemss and zdem2jpg.

Imports stand where they are needed: the environment must be settled before numpy, numba, MPI and HDF5 are loaded, and
thousands of processes should not load what only the last picture needs.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
from functools import partial
from typing import TYPE_CHECKING, NoReturn

import click

from hpcdem.cli.common import HELP, messages_only, read_command_line, run_program
from hpcdem.cli.programs import BY_NAME, FIRST
from hpcdem.cli.resume import resume, resumed_options
from hpcdem.cli.run import Options, hpcdem, run, speaks_zdem
from hpcdem.core.chinese import known
from hpcdem.core.chinese import wanted as wants_chinese
from hpcdem.core.errors import EXIT_OK, EXIT_USAGE
from hpcdem.physics.particle_physics import PHYSICS
from hpcdem.runtime import launch, shutdown
from hpcdem.session import OF_BLOCKS, OF_PARTICLES, Session, greet, prepare

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm
    from hpcdem.runtime.progress import Log

__all__ = ["Options", "hpcdem", "main", "read_command_line", "start_zdem2jpg", "start_zdemss"]


STRESS_AND_STRAIN = ("-s", "--strain-stress", "--strin-stres")
"""Options of `hpcdem ... -s DIR`, as in ZDEM; the misspelt one is that of the manual."""


_BLOCKS = ("blocks", *OF_BLOCKS)
_PARTICLES = ("", *OF_PARTICLES)
KERNELS = {"particles": _PARTICLES, "blocks": _BLOCKS, "coupled": (*_PARTICLES, *_BLOCKS, "coupled")} | {
    name: ("", name) for name in PHYSICS
}
"""Kinds of kernels (`session.KINDS`) in the order in which runs load them."""


@click.command(context_settings=HELP)
@click.option("-j", "threads", type=click.IntRange(1), default=1, metavar="N", help="Threads of the later runs [1].")
@click.option("--of", "kind", type=click.Choice([*KERNELS, "all"]), default="all", help="Kernels [all].")
def warmup(**options: object) -> None:
    """Compile all kernels now, for example on a login node, so that no job waits for it."""


def main() -> NoReturn:
    """The programs hpcdem and zdem."""
    words, cores_before = sys.argv[1:], launch.cores()
    if not words:
        with launch.one_voice():
            in_chinese = wants_chinese(encoding=getattr(sys.stdout, "encoding", None))
            click.echo((in_chinese and known("help", FIRST)) or FIRST, err=True)
        sys.exit(EXIT_USAGE)
    program = BY_NAME.get(words[0]) if words else None
    if program is not None and program.reads_only:
        start(program.name, words[1:])
    if program is not None and program.module:
        more = (cores_before,) if program.name == "doctor" else ()
        importlib.import_module(f"hpcdem.cli.{program.module}").start(words[1:], *more)
    if any(word.split("=")[0] in STRESS_AND_STRAIN for word in words):
        start("strain_stress", words)
    with messages_only(), launch.one_voice():
        if words[:1] == ["warmup"]:
            run_warmup(words[1:])
        options = read_options(words)
        wanted = options.threads or launch.threads_by_default(as_zdem=speaks_zdem(options.script))
        threads, warnings = launch.prepare_environment(wanted)
        comm = launch.start_mpi()

    def work() -> None:
        from hpcdem.runtime.progress import Log

        log = Log(comm.rank)
        if not options.check:
            greet(comm, log, cores_before, threads, warnings, options.outdir or options.script.parent / "data")
        run(new_session(comm, log, options, threads), options)

    shutdown.leave(shutdown.run_together(comm, work))


def read_options(words: list[str]) -> Options:
    """Parse the options of `hpcdem SCRIPT ...` and `hpcdem resume ...`; print an error and exit if they are wrong."""
    if words[:1] == ["resume"]:
        return resumed_options(read_command_line(resume, "hpcdem resume", words[1:]))
    return Options(**read_command_line(hpcdem, "hpcdem", words))


def new_session(comm: Comm, log: Log, options: Options, threads: int) -> Session:
    """Collective: the session of a command line."""
    from hpcdem.runtime.stop_requests import StopRequests, slurm_end_time

    end = comm.bcast(slurm_end_time() if comm.rank == 0 else None)
    stop = StopRequests(options.time_limit, end, options.autosave)
    return Session(
        comm, log, stop, threads, options.script.parent, options.outdir, options.figure, options.balance, options.draw,
        keep=options.retention, adapts=options.threads is None,
    )  # fmt: skip


def run_warmup(words: list[str]) -> NoReturn:
    """`hpcdem warmup`: on the first process; others, if any, have nothing to do."""
    given = read_command_line(warmup, "hpcdem warmup", words)
    threads, kind = given["threads"], given["kind"]
    if launch.speaks_for_all():
        if kind == "all":  # each kind in a process of its own, see runtime/kernels.py
            again = [sys.executable, "-m", "hpcdem", "warmup", "-j", str(threads), "--of"]
            sys.exit(max(subprocess.run([*again, one], check=False).returncode for one in KERNELS))
        launch.prepare_environment(threads)
        from hpcdem.core.comm import SerialComm
        from hpcdem.runtime.kernels import warmup as compile_all
        from hpcdem.runtime.progress import Log

        compile_all(Log(), partial(prepare, SerialComm(), Log(), KERNELS[kind], *{1, threads}))
    sys.exit(EXIT_OK)


def start_zdem2jpg() -> NoReturn:
    """The program zdem2jpg: pictures of all frames of a folder."""
    start("zdem2jpg", sys.argv[1:])


def start_zdemss() -> NoReturn:
    """The program zdemss: pictures of stress and strain."""
    start("zdemss", sys.argv[1:])


def start(name: str, words: list[str]) -> NoReturn:
    """A program that looks at finished runs: its module holds a command of the same name, and a function `work`."""
    module = importlib.import_module(f"hpcdem.cli.{name}")
    shown = {"strain_stress": "hpcdem"} | {program.name: f"hpcdem {program.name}" for program in BY_NAME.values()}
    run_program(getattr(module, name), shown.get(name, name), words, module.work)
