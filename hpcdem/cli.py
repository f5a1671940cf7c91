"""The programs hpcdem (also called zdem), zdemss and zdem2jpg.

`hpcdem script.py` runs a script, on one process or under mpiexec or srun; `run` below is the whole way from the
script to the figure. Imports stand where they are needed: the environment must be settled before numpy, numba, MPI
and HDF5 are loaded, and thousands of processes should not load what only the last picture needs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hpcdem.errors import EXIT_OK, EXIT_USAGE, CommandError, HpcdemError, StoppedWithCheckpoint, UsageError
from hpcdem.runtime import ending, launch

if TYPE_CHECKING:
    from hpcdem.halo.comm import SerialComm
    from hpcdem.lang.zdem.parser import Script
    from hpcdem.runtime.progress import Log
    from hpcdem.simulation import Simulation


# -- one run -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Options:
    """The command line of hpcdem."""

    script: Path
    threads: int | None = None
    time_limit: float | None = None
    resume: bool = False
    check: bool = False
    outdir: Path | None = None
    figure: bool = True
    balance: bool = True


def run(comm: SerialComm, options: Options, log: Log) -> None:
    """Collective: read, check and run a script, then draw its last state. The same text on any number of ranks."""
    from hpcdem.lang import detect
    from hpcdem.lang.zdem import check, execute, parser, plan
    from hpcdem.runtime.stopping import StopRequests, slurm_end_time
    from hpcdem.runtime.warmup import prepare_kernels

    stop = StopRequests(options.time_limit, comm.bcast(slurm_end_time() if comm.rank == 0 else None))
    name, source = str(options.script), read_script(comm, options.script)
    refuse_other_languages(detect.kind(source, name), name)
    script = parser.parse_text(source, name)
    if options.check:
        log.info(check.summary(script))
        return
    execute.refuse_unexecuted(script.statements)

    threads = options.threads or 1
    prepare_kernels(comm, log, lambda: rehearse(threads))
    from hpcdem.simulation import Simulation  # brings the kernels with it

    outdir = options.outdir or options.script.parent / "data"
    sim = Simulation(comm, threads, outdir, log, stop.install(), balance_on=options.balance)
    try:
        if not (options.resume and go_on(sim, script, log)):
            log.script_started(name, plan.expected_steps(script.statements) or 0)
            execute.Interpreter(script).run(sim)
    except StoppedWithCheckpoint:  # on all ranks at the same step
        log.stages(sim.timers, comm)
        raise
    finally:
        stop.uninstall()
        sim.release()
    log.stages(sim.timers, comm)
    if options.figure and comm.rank == 0:
        draw_last_state(sim, log)


def rehearse(*threads: int) -> None:
    """Call every kernel once for each number of threads. Imports them: the cache must be settled before."""
    from hpcdem.commands import rehearsal
    from hpcdem.io import textnum

    for n in threads:
        rehearsal.rehearse(n)
    textnum.warm_up()


def go_on(sim: Simulation, script: Script, log: Log) -> bool:
    """Collective: finish a script from its newest checkpoint that is whole; False if there is none."""
    from hpcdem import saving
    from hpcdem.lang.zdem import execute

    named = {index: script.directory / s.get("outdir") for index, s in enumerate(script.statements) if s.get("outdir")}
    for path in checkpoints(sim.comm, [sim.outdir, *named.values()]):
        try:
            found = saving.restore(sim, path)
        except CommandError as error:
            log.warn(f"{error}; trying the checkpoint before it")
            continue
        log.info(f"going on from {path}, step {sim.clock.step}")
        sim.progress = found["progress"]
        for index, folder in named.items():
            if index <= found["position"]:
                sim.outdir = folder
        log.script_started(script.file, *planned_steps(script, found["position"], sim))
        execute.Interpreter(script).run(sim, resume=found["position"], saved_script=found["script"])
        return True
    log.info(f"no checkpoint in {' or '.join(map(str, [sim.outdir, *named.values()]))}: starting at the beginning")
    return False


def planned_steps(script: Script, position: int, sim: Simulation) -> tuple[int, int]:
    """Steps of the whole script, and how many of them were done before the checkpoint; 0, 0 if it does not tell."""
    from hpcdem.lang.zdem import plan

    runs = plan.follow(script.statements)
    if any(run.steps is None for run in runs):
        return 0, 0
    before = sum(run.steps or 0 for run in runs if run.index < position)
    inside = sim.clock.step - sim.progress["first"] if sim.progress is not None else 0
    return sum(run.steps or 0 for run in runs), before + inside


def checkpoints(comm: SerialComm, folders: list[Path]) -> list[Path]:
    """Collective: the .sav files of some folders, the one written last first."""
    found = []
    if comm.rank == 0:
        found = sorted(
            {path for folder in folders for path in folder.glob("*.sav")}, key=lambda p: -p.stat().st_mtime_ns
        )
    return comm.bcast(found)


def read_script(comm: SerialComm, path: Path) -> bytes:
    """Collective: the script, read once. UsageError on all ranks if rank 0 cannot read it."""
    source, error = b"", None
    if comm.rank == 0:
        try:
            source = path.read_bytes()
        except FileNotFoundError:
            error = f"{path}: no such script"
        except OSError as problem:
            error = f"{path}: cannot read the script: {problem.strerror}"
    source, error = comm.bcast((source, error))
    if error is not None:
        raise UsageError(error)
    return source


def refuse_other_languages(kind: str, file: str) -> None:
    """UsageError, by name, for the kinds of script that this version cannot run."""
    if kind == "zdem":
        return
    name = {"pcdc": "a PCDC script", "python": "a plain Python program"}.get(kind, f"of an unknown kind ({kind})")
    raise UsageError(f"{file}: this is {name}; this version runs ZDEM command scripts only, others come later")


def draw_last_state(sim: Simulation, log: Log) -> None:
    """The figure of the newest frame of this run, if there is one. Serial."""
    from hpcdem.io.frames import frame_name, read_frame
    from hpcdem.post import plots

    if sim.last_frame is not None:
        last = sim.outdir / frame_name(sim.last_frame[0], ".vtkhdf", sim.last_frame[1])
        log.info(f"figure: {plots.plot_frame(read_frame(last, ('particles',)), last.with_suffix('.jpg'))}")


# -- the command line --------------------------------------------------------------------------------------------

HELP = {"help_option_names": ["-h", "--help", "--hlep"], "max_content_width": 110}

STRESS_AND_STRAIN = (
    (("-s", "--strain-stress", "--strin-stres"), "DIR"),
    (("-g", "--grid"), "SIZE"),
    (("--leftwallid",), "ID"),
    (("--rightwallid",), "ID"),
    (("--xmove",), "X"),
    (("--ymove",), "Y"),
    (("--addball",), None),
    (("--delball",), None),
)
"""Options of zdem that belong to stress and strain, with the name of their value; the misspelt form is the manual's."""


def refuse_stress_and_strain(context: click.Context, option: click.Parameter, value: Any) -> None:
    """UsageError for an option that is known but not carried out yet."""
    if value:
        names = "/".join(option.opts[:2])
        raise click.UsageError(f"{names}: stress and strain from finished runs come later; this version runs scripts")


def later_options(command: click.Command) -> click.Command:
    """Add the options of stress and strain: understood, hidden, refused by name."""
    for names, value in STRESS_AND_STRAIN:
        kind = {"is_flag": True} if value is None else {"metavar": value}
        command.params.append(
            click.Option(
                names, **kind, hidden=True, is_eager=True, expose_value=False, callback=refuse_stress_and_strain
            )  # type: ignore[arg-type]
        )
    return command


def time_limit(context: click.Context, option: click.Parameter, value: str | None) -> float | None:
    """Seconds of HH:MM:SS."""
    from hpcdem.runtime.stopping import parse_limit

    try:
        return None if value is None else parse_limit(value)
    except UsageError as error:
        raise click.UsageError(str(error)) from None


@later_options
@click.command(
    context_settings=HELP,
    no_args_is_help=True,
    epilog="`hpcdem warmup` compiles all kernels for later runs. Exit codes: 0 done, 1 the run failed, 2 command line "
    "or script not understood, 85 stopped on request with a checkpoint (go on with --resume).",
)
@click.argument("script", type=click.Path(path_type=Path))
@click.option(
    "-j", "threads", type=click.IntRange(1), metavar="N", help="Threads per rank [what srun -c gives, else 1]."
)
@click.option(
    "--time-limit", callback=time_limit, metavar="HH:MM:SS", help="Save and stop before this much time is up."
)
@click.option("--resume", is_flag=True, help="Go on from the newest checkpoint of this script.")
@click.option("--check", is_flag=True, help="Read the whole script, say what it would do, run nothing.")
@click.option("--outdir", type=click.Path(path_type=Path), metavar="DIR", help="Results [data beside the script].")
@click.option("--figure/--no-figure", default=True, help="Draw the last state at the end [yes].")
@click.option("--balance/--no-balance", default=True, help="Move strip borders with the measured load [yes].")
@click.version_option(launch.version(), "-v", "--version", prog_name="hpcdem", message="%(prog)s %(version)s")
def hpcdem(**options: Any) -> None:
    """Run a discrete-element SCRIPT (ZDEM commands), alone or under mpiexec or srun."""


@click.command(context_settings=HELP)
@click.option("-j", "threads", type=click.IntRange(1), default=1, metavar="N", help="Threads of the later runs [1].")
def warmup(**options: Any) -> None:
    """Compile all kernels now, for example on a login node, so that no job waits for it."""


def read_command_line(command: click.Command, program: str, words: list[str]) -> dict[str, Any]:
    """Values of the options; prints and leaves for --help, --version and for what is not understood."""
    try:
        return command.make_context(program, words).params
    except click.exceptions.Exit as done:
        raise SystemExit(done.exit_code) from None
    except click.ClickException as error:
        error.show()
        raise SystemExit(error.exit_code) from None


# -- entry points ------------------------------------------------------------------------------------------------


def main() -> NoReturn:
    """The programs hpcdem and zdem."""
    words, cores_before = sys.argv[1:], launch.cores()
    with messages_only(), launch.one_voice():
        if words[:1] == ["warmup"]:
            run_warmup(words[1:])
        options = Options(**read_command_line(hpcdem, "hpcdem", words))
        threads, warnings = launch.prepare_environment(options.threads or launch.threads_by_default())
        comm = launch.start_mpi()

    def work() -> None:
        from hpcdem.runtime.progress import Log

        log = Log(comm.rank)
        if not options.check:
            places = comm.allgather(launch.place(cores_before, threads))
            log.info(launch.start_report(places, launch.mpi_library() if comm.mpi is not None else None))
            for warning in warnings + launch.start_warnings(places):
                log.warn(warning)
        run(comm, replace(options, threads=threads), log)

    ending.leave(ending.run_together(comm, work))


def run_warmup(words: list[str]) -> NoReturn:
    """`hpcdem warmup`: on the first process; others, if any, have nothing to do."""
    threads = read_command_line(warmup, "hpcdem warmup", words)["threads"]
    if launch.speaks_for_all():
        launch.prepare_environment(threads)
        from hpcdem.runtime.progress import Log
        from hpcdem.runtime.warmup import warmup as compile_all

        compile_all(Log(), lambda: rehearse(*{1, threads}))
    sys.exit(EXIT_OK)


def zdem2jpg() -> NoReturn:
    """The program zdem2jpg: pictures of all frames of a folder, made by the first process."""
    with messages_only(), launch.one_voice():
        launch.prepare_environment(1)
        from hpcdem.post import plots

        folder = plots.zdem2jpg_folder(sys.argv[1:])
        if folder is None:
            click.echo(plots.USAGE)
        elif launch.speaks_for_all():
            plots.zdem2jpg(folder, report=click.echo)
    sys.exit(EXIT_OK)


def zdemss() -> NoReturn:
    """The program zdemss: known by name, its pictures of stress and strain come later."""
    with messages_only(), launch.one_voice():
        raise UsageError("zdemss: pictures of stress and strain come later; this version runs scripts and draws frames")
    sys.exit(EXIT_USAGE)  # the other processes never get here either


@contextmanager
def messages_only() -> Iterator[None]:
    """Before the ranks are together: a failure a user can act on is printed as its message, and the process leaves."""
    try:
        yield
    except HpcdemError as error:
        click.echo(ending.describe(error).text, err=True)
        sys.exit(error.exit_code)
