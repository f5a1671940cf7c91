"""`hpcdem SCRIPT`: from the command line to the figure of the last state."""

from __future__ import annotations

import math
import re
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.chinese import in_chinese, translated
from hpcdem.cli.common import HELP, PATH, POSITIVE, Finite
from hpcdem.cli.programs import GROUPS, suggestion
from hpcdem.core import chinese
from hpcdem.core.comm import Comm
from hpcdem.core.errors import EXIT_OK, HpcdemError, StoppedWithCheckpoint, UsageError
from hpcdem.runtime import launch, run_folder
from hpcdem.runtime.cgroups import free_memory
from hpcdem.runtime.run_folder import Job, Retention, claim
from hpcdem.runtime.stop_requests import AUTOSAVE
from hpcdem.session import Session
from hpcdem.session import enter as enter_session

if TYPE_CHECKING:
    from hpcdem.lang.zdem.parser import Script
    from hpcdem.physics.dem.simulation import Simulation
    from hpcdem.runtime.progress import Log
    from hpcdem.runtime.reproducibility import Reproduction


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
    draw: bool = False
    before: float | None = None
    keep: int = 0
    keep_steps: int | None = None
    keep_every: float | None = None
    keep_at: tuple[float, ...] = ()
    autosave: float | None = AUTOSAVE
    check_reproducible: int | None = None
    against: Path | None = None
    arguments: tuple[str, ...] = ()
    saved_in: Path | None = None
    """Folder whose newest checkpoint contains the script (cli/resume.py)."""

    @property
    def since(self) -> float:
        """The time of the model [s] from which no checkpoint is taken up any more."""
        return math.inf if self.before is None else self.before

    @property
    def retention(self) -> Retention:
        """Return the rules for checkpoints to keep."""
        return Retention(self.keep, self.keep_steps or 0, self.keep_every or 0.0, self.keep_at)


def run(session: Session, options: Options) -> None:
    """Collective: read and carry out a script, then draw its last state. The same text on any number of ranks."""
    from hpcdem.lang import detect

    name = str(options.script)
    refuse_idle(options)
    if options.outdir is not None or options.check:
        run_folder.refuse_file(options.outdir or options.script.parent / "data", session.comm)
    if options.saved_in is None:
        source = read_script(session.comm, options.script)
    else:
        source = saved_script(session.comm, options.saved_in, options.since)
    session.reproduction = reproduction(session, options)
    kind = detect.kind(source, name)
    if kind == "python":
        run_python(session, options, source)
    elif kind == "zdem":
        run_zdem(session, options, source)
    else:
        run_pcdc(session, options, source)


def run_zdem(session: Session, options: Options, source: bytes) -> None:
    """Collective: check a script of ZDEM commands and run it, from its beginning or from its newest checkpoint."""
    from hpcdem.lang.zdem import check, execute, parser, plan

    name, log = str(options.script), session.log
    if options.arguments:
        raise UsageError(f"{options.arguments[0]}: a ZDEM script does not accept arguments (only Python programs do)")
    script = parser.parse_text(source, name)
    if options.check:
        log.info(check.summary(script, options.outdir))
        return
    execute.refuse_unexecuted(script.statements)
    if options.saved_in is not None:
        execute.refuse_escapes(script, options.saved_in)
    session.job = Job(name, "zdem", (), session.threads)
    for statement in script.statements:
        if statement.get("outdir"):
            claim(script.directory / statement.get("outdir"), session.comm, session.job)
    sim = session.simulation(log=log)
    try:
        if not (options.resume and go_on(sim, script, log, options.since)):
            log.script_started(name, plan.expected_steps(script.statements) or 0)
            execute.Interpreter(script).run(sim)
    except BaseException as error:
        if isinstance(error, StoppedWithCheckpoint):  # on all ranks at the same step
            log.stages(sim.timers, session.comm)
        session.close(error)
        raise
    session.close()


def run_python(session: Session, options: Options, source: bytes) -> None:
    """Collective: run a Python program on every rank; the simulations it makes belong to this session."""
    name = str(options.script)
    for given, option in ((options.check, "--check"), (options.resume, "--resume")):
        if given:
            raise UsageError(
                f"{name}: {option} is for ZDEM and PCDC scripts; a Python program uses Simulation.resume() itself"
            )
    session.text = source.decode("utf-8", errors="replace")
    session.job = Job(name, "python", options.arguments, session.threads)
    session.ends_with_frame = True
    enter_session(session)
    session.log.script_started(name, 0)
    sys.argv = [name, *options.arguments]
    sys.path.insert(0, str(options.script.resolve().parent))
    try:
        exec(compile(source, name, "exec"), {"__name__": "__main__", "__file__": name, "__builtins__": __builtins__})
        session.stop.refuse()
    except SystemExit as leaving:
        end_by_itself(session, leaving)
    except BaseException as error:
        session.close(error)
        if isinstance(error, (HpcdemError, KeyboardInterrupt, StoppedWithCheckpoint)):
            raise
        raise HpcdemError(f"{name} ended with an error\n{own_traceback(error, name)}") from None
    session.close()


def run_pcdc(session: Session, options: Options, source: bytes) -> None:
    """Collective: read a script of PCDC commands and Python, and run it on every rank."""
    from hpcdem.commands import fdem
    from hpcdem.lang.pcdc import check
    from hpcdem.lang.pcdc.execute import Interpreter
    from hpcdem.lang.pcdc.source import decode

    name, log = str(options.script), session.log
    if options.saved_in is not None:
        raise UsageError(
            f"{name}: script not found. PCDC scripts are never executed from a checkpoint; give the script: hpcdem "
            "SCRIPT --resume"
        )
    if session.reproduction is not None:
        raise UsageError(
            f"{name}: --check-reproducible supports models of particles only. For a PCDC script, compare the files "
            "of model save"
        )
    text = decode(source, name)
    if options.check:
        log.info(check.summary(text, name))
        nodes = session.comm.allgather((session.comm.here, free_memory(Path("/"))))
        free = min((left for _, left in nodes if left is not None), default=None)
        if memory := check.memory(text, name, session.comm.size, max(here for here, _ in nodes), free):
            log.info(f"  {memory}")
        return
    read = check.read(text, name)
    if session.comm.rank == 0:  # which makes the meshes
        check.packages(read)
    session.text = text
    session.job = Job(name, "pcdc", options.arguments, session.threads)
    enter_session(session)  # particles that the script makes belong to it
    try:
        project = session.project()
        interpreter = session.interpreter = Interpreter(project)
        enter_session(session)
        script = interpreter.read(text, name)
        interpreter.load_laws(script)
        past = fdem.checkpoints.take_up(project, options.since) if options.resume else None
        log.script_started(name, 0)
        sys.argv = [name, *options.arguments]
        sys.path.insert(0, str(options.script.resolve().parent))
        interpreter.run(script, past or ())
        interpreter.at_the_end()
        session.stop.refuse()
    except SystemExit as leaving:
        end_by_itself(session, leaving)
    except BaseException as error:
        session.close(error)
        raise
    session.close()


def end_by_itself(session: Session, leaving: SystemExit) -> None:
    """A program has called sys.exit: an error unless the code is 0; nor is it a good end if it caught the stop of the
    run."""
    end = session.stop.ended or leaving
    if end is not leaving or leaving.code not in (None, EXIT_OK):
        session.close(end)
        raise end


def own_traceback(error: BaseException, file: str) -> str:
    """The traceback of a user's program without the frames that started it."""
    trace = error.__traceback__
    while trace is not None and trace.tb_frame.f_code.co_filename != file:
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace or error.__traceback__)).rstrip()


def refuse_idle(options: Options) -> None:
    """UsageError for options that have nothing to act on."""
    if options.before is not None and not options.resume:
        raise UsageError("--before T selects the checkpoint for --resume; add --resume")
    if not options.keep and options.autosave is None:
        given = {"--keep-steps": options.keep_steps, "--keep-every": options.keep_every, "--keep-at": options.keep_at}
        for option in (name for name, value in given.items() if value):
            raise UsageError(
                f"{option} has no effect: without --keep K and with --autosave off no checkpoint is removed"
            )


def go_on(sim: Simulation, script: Script, log: Log, before: float = math.inf) -> bool:
    """Collective: finish a script from its newest checkpoint that is whole, or the last one not after `before` [s];
    False without one."""
    from hpcdem.lang.zdem import execute
    from hpcdem.physics.dem import saved_state

    named = {index: script.directory / s.get("outdir") for index, s in enumerate(script.statements) if s.get("outdir")}
    execute.Interpreter(script).load_laws(sim)
    found = saved_state.restore_newest(sim, [sim.outdir, *named.values()], before)
    if found is None:
        return False
    sim.progress = found["progress"]
    for index, folder in named.items():
        if index <= found["position"]:
            sim.outdir = folder
    log.script_started(script.file, *planned_steps(script, found["position"], sim))
    execute.Interpreter(script).run(sim, resume=found["position"], saved_script=found["script"])
    return True


def planned_steps(script: Script, position: int, sim: Simulation) -> tuple[int, int]:
    """Steps of the whole script, and how many of them were done before the checkpoint; 0, 0 if unknown."""
    from hpcdem.lang.zdem import plan

    runs = plan.follow(script.statements)
    if any(run.steps is None for run in runs):
        return 0, 0
    before = sum(run.steps or 0 for run in runs if run.index < position)
    inside = sim.clock.step - sim.progress["first"] if sim.progress is not None else 0
    return sum(run.steps or 0 for run in runs), before + inside


def reproduction(session: Session, options: Options) -> Reproduction | None:
    """Collective: what --check-reproducible and --against ask for."""
    from hpcdem.runtime.reproducibility import Reproduction, read

    if options.check_reproducible is None:
        if options.against is not None:
            raise UsageError("--against LOG needs --check-reproducible N")
        return None
    expected, error = None, None
    if options.against is not None and session.comm.rank == 0:
        try:
            expected = read(options.against)
        except UsageError as problem:
            error = str(problem)
    expected, error = session.comm.bcast((expected, error))
    if error is not None:
        raise UsageError(error)
    return Reproduction(options.check_reproducible, session.log, expected, str(options.against or ""))


_BEGINS_ZDEM = re.compile(rb"(star?t?|res(t(o(r(e)?)?)?)?\b[^=]*|load?\b[^=]*)\s*([#!;].*)?", re.IGNORECASE)
_SETS = re.compile(rb"\w+\s*=\s*[-+.\d]")
"""Line that sets a parameter; such lines may precede the first command."""


def speaks_zdem(path: Path) -> bool:
    """Return whether a script begins as a ZDEM script must, with START, RESTORE or LOAD: a quick check before anything
    is loaded (lang/detect.py decides later). False if it cannot be read."""
    try:
        with open(path, "rb") as file:
            lines = (line.strip().removeprefix(b"\xef\xbb\xbf").strip() for line in file)
            first = next((line for line in lines if line and line[:1] not in b"#!;" and not _SETS.match(line)), b"")
    except OSError:
        return False
    return _BEGINS_ZDEM.fullmatch(first) is not None


def read_script(comm: Comm, path: Path) -> bytes:
    """Collective: the script, read once. UsageError on all ranks if rank 0 cannot read it."""
    source, error = b"", None
    if comm.rank == 0:
        try:
            source = path.read_bytes()
        except FileNotFoundError:
            error = f"{path}: no such script{suggestion(str(path))}"
        except IsADirectoryError:
            error = f"{path} is a folder: hpcdem view {path} shows its results, hpcdem resume {path} resumes its run"
        except OSError as problem:
            error = f"{path}: cannot read the script: {problem.strerror}"
    source, error = comm.bcast((source, error))
    if error is not None:
        raise UsageError(error)
    return source


# -- the command line ---------------------------------------------------------------------------------------------


STRESS_AND_STRAIN = (
    (("-g", "--grid"), "SIZE"),
    (("--leftwallid",), "ID"),
    (("--rightwallid",), "ID"),
    (("--xmove",), "X"),
    (("--ymove",), "Y"),
    (("--addball",), None),
    (("--delball",), None),
    (("--increment",), None),
    (("--smooth",), None),
)
"""Options of -s DIR (cli/strain_stress.py), with the names of their values."""


def only_with_s(context: click.Context, option: click.Parameter, value: Any) -> None:
    """UsageError for an option that makes no sense with a script."""
    if value:
        raise click.UsageError(f"{'/'.join(option.opts[:2])} requires -s DIR (stress and strain of a finished run)")


def other_options(command: click.Command) -> click.Command:
    """Add the options of -s: understood, hidden, refused by name."""
    for names, value in STRESS_AND_STRAIN:
        kind = {"is_flag": True} if value is None else {"metavar": value}
        command.params.append(
            click.Option(names, **kind, hidden=True, is_eager=True, expose_value=False, callback=only_with_s)
        )
    return command


def saved_script(comm: Comm, folder: Path, before: float = math.inf) -> bytes:
    """Collective: the text of the script that the newest checkpoint of a folder holds."""
    from hpcdem.io import checkpoint
    from hpcdem.io.agreed import on_first
    from hpcdem.runtime.checkpoints import newest_first, none_before

    def text() -> bytes:
        found, damaged = newest_first([folder], before)
        if not found and before < math.inf:
            raise none_before(before, [folder])
        if not found:
            raise UsageError("; ".join([f"{folder}: no checkpoint to resume from", *damaged]))
        state = checkpoint.read_state(found[0])
        return str(state["script"] if "script" in state else state["extra"]["run"]["script"]).encode()

    return on_first(comm, text)


def time_limit(context: click.Context, option: click.Parameter, value: str | None) -> float | None:
    """Seconds of HH:MM:SS; of `--autosave off` none."""
    from hpcdem.runtime.stop_requests import parse_limit

    if option.name == "autosave" and value == "off":
        return None
    try:
        return None if value is None else parse_limit(value, option.opts[0])
    except UsageError as error:
        raise click.UsageError(str(error)) from None


def seconds(context: click.Context, option: click.Parameter, value: str | None) -> tuple[float, ...]:
    """Times of T[,T...], in order."""
    try:
        times = tuple(sorted(float(word) for word in value.split(","))) if value else ()
    except ValueError:
        times = (math.nan,)
    if not all(0.0 <= time < math.inf for time in times):
        raise click.BadParameter(f"{value!r}: expected seconds separated by commas, such as 10,25.5", context, option)
    return times


def keeping(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options that say when checkpoints are written and which stay."""
    of_old = "Keep also the last checkpoint at or before "
    options = [
        click.option(
            "--keep", type=click.IntRange(0), default=0, metavar="K", help="Keep the last K checkpoints [all]."
        ),
        click.option("--keep-steps", type=click.IntRange(1), metavar="N", help=f"{of_old}each multiple of N steps."),
        click.option(
            "--keep-every", type=POSITIVE, metavar="T",
            help=f"{of_old}each multiple of T seconds of the model.",
        ),
        click.option("--keep-at", callback=seconds, metavar="T,...", help=f"{of_old}these times of the model, in s."),
        click.option(
            "--autosave", callback=time_limit, default="30:00", metavar="MM:SS",
            help="Time between automatic checkpoints, or off [30:00].",
        ),
    ]  # fmt: skip
    return _with(options, command)


def running(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of a run that begins and of one that resumes."""
    options = [
        click.option("--figure/--no-figure", default=True, help="Draw the final state [yes]."),
        click.option(
            "--balance/--no-balance", default=True,
            help="Balance the load: move strip boundaries with the measured times [yes].",
        ),
        click.option("--draw", is_flag=True, help="Let DRAW commands write pictures, draw_<step>.jpg."),
    ]  # fmt: skip
    return _with(options, command)


def _with(options: list[Any], command: Callable[..., Any]) -> Callable[..., Any]:
    for option in reversed(options):
        command = option(command)
    return command


class RunCommand(click.Command):
    """`hpcdem SCRIPT`; its help lists the other commands, and the options of `hpcdem -s DIR` as the manual's `zdem -h`
    does."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from hpcdem.cli.strain_stress import strain_stress

        translate: Callable[[str], str] = str
        if chinese.wanted(encoding=getattr(sys.stdout, "encoding", None)):
            translated(strain_stress)
            translate = in_chinese
        for group, programs in GROUPS.items():
            with formatter.section(translate(group)):
                formatter.write_dl([(f"hpcdem {one.name} {one.use}".rstrip(), translate(one.line)) for one in programs])
        super().format_options(ctx, formatter)
        hidden = [parameter for parameter in self.get_params(ctx) if getattr(parameter, "hidden", False)]
        shown = {option for parameter in self.get_params(ctx) if parameter not in hidden for option in parameter.opts}
        rows = [
            row for parameter in strain_stress.params
            if not shown & {*parameter.opts} and (row := parameter.get_help_record(ctx)) is not None
        ]  # fmt: skip
        with formatter.section("Stress and strain of a finished run"):
            formatter.write_dl(rows)


@other_options
@click.command(
    cls=RunCommand,
    context_settings=HELP,
    no_args_is_help=True,
    epilog="Each command has its own help: hpcdem NAME --help. Exit codes: 0 done, 1 the run failed, 2 command line or "
    "script not understood, 3 no equilibrium (model solve), 85 stopped on request, checkpoint written (resume with "
    "--resume).",
)
@click.argument("script", type=PATH)
@click.argument("arguments", nargs=-1, metavar="[-- ARGUMENTS]")
@click.option(
    "-j",
    "threads",
    type=click.IntRange(1),
    metavar="N",
    help="Threads per rank [value of srun -c, else 1; for a ZDEM script on one rank OMP_NUM_THREADS, else all cores].",
)
@click.option(
    "--time-limit", callback=time_limit, metavar="HH:MM:SS", help="Save and stop before this much time is up."
)
@click.option("--resume", is_flag=True, help="Resume from the newest checkpoint of this script.")
@click.option(
    "--before", type=Finite(0.0), metavar="T", help="With --resume: from the last checkpoint at or before T "
    "seconds of the model."
)  # fmt: skip
@keeping
@click.option("--check", is_flag=True, help="Check the script and print what it would do; run nothing.")
@click.option("--outdir", type=PATH, metavar="DIR", help="Folder of the results [data, next to the script].")
@running
@click.option(
    "--check-reproducible", type=click.IntRange(1), metavar="N", help="Log a fingerprint of the state every N steps."
)
@click.option("--against", type=PATH, metavar="LOG", help="Compare the fingerprints with those of an earlier log.")
@click.version_option(launch.version(), "-v", "--version", prog_name="hpcdem", message="%(prog)s %(version)s")
def hpcdem(**options: Any) -> None:
    """Run a SCRIPT (ZDEM commands, PCDC commands, or Python that uses hpcdem), alone or under mpiexec or srun.

    ARGUMENTS are for Python, in sys.argv.
    """
