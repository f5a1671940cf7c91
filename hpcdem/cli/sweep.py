"""`hpcdem sweep SCRIPT`: many runs of one script; `hpcdem sweep report`: what they say together."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line, run_program
from hpcdem.cli.measure import WHAT, Words, measure, request
from hpcdem.core.comm import Comm
from hpcdem.core.errors import EXIT_CHECKPOINT, EXIT_ERROR, EXIT_OK, UsageError
from hpcdem.runtime import launch

if TYPE_CHECKING:
    from hpcdem.runtime.progress import Log
    from hpcdem.sweep import Sweep

PROGRAM = "hpcdem sweep"
WHAT_OF_SWEEPS = tuple(word for word in WHAT if word != "tracks")


class Jobs(click.ParamType):
    """A number, or auto."""

    name = "n"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "auto" or value is None:
            return None
        if not str(value).isdigit() or int(value) < 1:
            self.fail(f"'{value}': expected auto or a number above 0", param, ctx)
        return int(value)


class Setting(click.ParamType):
    """NAME=VALUES"""

    name = "setting"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        name, equals, words = str(value).partition("=")
        if not (name.isidentifier() and equals and words):
            self.fail(f"'{value}': expected NAME=VALUES, such as friction=0.2,0.3", param, ctx)
        return name, words


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="VALUES: 0.2,0.3 (list), 1:10 (whole numbers), 0.1:0.5:5 (five equidistant values); with --latin or "
    "--sobol, 0.1:0.5 and 1e5:1e8:log are sampled ranges. A parameter is a line such as friction = 0.3 at the top "
    "level of the script (in ZDEM used as {friction}). Repeat the command to continue with unfinished members. More in "
    "docs/sweep.md; `hpcdem sweep report --help`.",
)  # fmt: skip
@click.argument("script", type=PATH, metavar="SCRIPT|SETTINGS.toml|DIR")
@click.option("--set", "values", type=Setting(), multiple=True, metavar="NAME=VALUES", help="Values of a parameter of "
              "the script; repeatable: all values are combined.")  # fmt: skip
@click.option("--seed", metavar="VALUES", help="Short for --set seed=VALUES; in ZDEM, values of SET seed.")
@click.option("--twins", type=click.IntRange(1), metavar="N", help="N runs that differ in the position of one "
              "particle, by 1e-5 of its radius; the first is the script unchanged.")  # fmt: skip
@click.option("--latin", type=click.IntRange(1), metavar="N", help="N samples of the ranges: a Latin hypercube.")
@click.option("--sobol", type=click.IntRange(1), metavar="N", help="N samples of the ranges: a Sobol sequence.")
@click.option("--sampling-seed", type=click.IntRange(0), metavar="S", help="Seed of the sampling itself [0].")
@click.option("--ranks", type=click.IntRange(1), metavar="N", help="Ranks of each member [1].")
@click.option("-j", "--threads", type=click.IntRange(1), metavar="N", help="Threads of each rank [1].")
@click.option(
    "--jobs", type=Jobs(), metavar="N", help="Number of simultaneous members [auto: as many as the cores allow]."
)
@click.option("--tries", type=click.IntRange(1), metavar="N", help="Number of starts of a member that fails or is "
              "killed; it resumes from its last checkpoint [2].")  # fmt: skip
@click.option("--with", "links", type=PATH, multiple=True, metavar="FILE", help="A file or folder that the script "
              "reads from its own folder; repeatable.")  # fmt: skip
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Folder of the sweep [SCRIPT_sweep beside the script].")
@click.option("--plan", is_flag=True, help="Write and list the members; run nothing.")
@click.option("--slurm", is_flag=True, help="Submit a Slurm job array with one task per unfinished member.")
@click.option("--sbatch", multiple=True, metavar="NAME=VALUE", help="Option of sbatch, such as time=04:00:00; "
              "repeatable.")  # fmt: skip
@click.option("--member", type=click.IntRange(0), hidden=True)
def sweep(**options: Any) -> None:
    """Run SCRIPT once for each combination of parameter values, each in its own folder and several at a time; or
    continue the sweep in DIR."""


def _report_command() -> click.Command:
    """Options of `hpcdem measure`, as far as they can hold for many runs."""
    apart = ("folder", "what", "output", "ids", "points", "number", "log")
    own: list[click.Parameter] = [
        click.Argument(["folder"], type=PATH, metavar="DIR"),
        click.Argument(["what"], type=click.Choice(WHAT_OF_SWEEPS), nargs=-1, metavar="[WHAT]..."),
        click.Option(["-o", "--output"], type=PATH, metavar="DIR", help="Folder for the report [DIR/report]."),
        click.Option(["--tables"], type=Words(), default="csv", metavar="LIST", help="csv, parquet (needs pyarrow), "
                     "separated by commas [csv]."),
    ]  # fmt: skip
    return click.Command(
        "report", context_settings=HELP, no_args_is_help=True,
        params=[*own, *(p for p in measure.params if p.name not in apart)],
        help="Measure all finished members of the sweep in DIR and compute mean, spread, quantiles, bands over time "
            "and dependence on the parameters. Without WHAT: everything the runs allow; histories always.",
        epilog=f"WHAT: {', '.join(WHAT_OF_SWEEPS)}, as for hpcdem measure. Also under mpiexec: ranks share the frames.",
    )  # fmt: skip


report = _report_command()


def start(words: list[str]) -> NoReturn:
    """The program, to its end."""
    if words[:1] == ["report"]:
        run_program(report, f"{PROGRAM} report", words[1:], work)
    with messages_only():
        sys.exit(carry_out(read_command_line(sweep, PROGRAM, words)))


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: `hpcdem sweep report`."""
    from hpcdem.sweep import plan, report

    asked = request({"ids": (), "points": (), "number": 1, "log": None} | options)
    made = plan.load(Path(options["folder"]))
    report.run(comm, log, made, replace(asked, folder=made.folder), tuple(options["tables"]))


def carry_out(options: dict[str, Any]) -> int:
    """`hpcdem sweep`; returns the exit code."""
    launch.prepare_environment(1)
    from hpcdem.runtime.progress import Log
    from hpcdem.sweep import array, driver, member, plan

    path: Path = options["script"]
    if options["member"] is not None:
        made = plan.load(path)
        return member.run(made, made.member(options["member"]))
    if path.suffix == ".toml":
        options = from_file(path, options)
    log = Log()
    if options["sbatch"] and not options["slurm"]:
        raise UsageError("--sbatch requires --slurm")
    if options["slurm"] and options["tries"] is not None:
        raise UsageError("--tries cannot be used with --slurm: repeat the command to restart failed members")
    ensemble = _opened(options)
    if ensemble.new:
        log.info(f"{ensemble.folder}: {ensemble.new} new members, {len(ensemble.members)} in all")
    if options["plan"]:
        for one in ensemble.members:
            click.echo(f"{one.label()}: {one.state}")
        return EXIT_OK
    if options["slurm"]:
        written = array.write(ensemble.plan, options["sbatch"], options["jobs"])
        job = "" if written is None else array.submit(written)
        log.info(f"{ensemble.folder}: job array {job}" if job else f"{ensemble.folder}: all members are done")
        return EXIT_OK
    states = driver.run(ensemble.plan, log, options["jobs"], options["tries"] or 2)
    counts = {state: list(states.values()).count(state) for state in dict.fromkeys(states.values())}
    log.info(f"{ensemble.folder}: {', '.join(f'{n} {state}' for state, n in counts.items())}")
    if set(states.values()) == {plan.DONE}:
        return EXIT_OK
    return EXIT_ERROR if plan.FAILED in states.values() else EXIT_CHECKPOINT


def _opened(options: Mapping[str, Any]) -> Sweep:
    """The sweep that is meant, made or taken up."""
    from hpcdem.sweep import Sweep

    path: Path = options["script"]
    of_members = ("values", "seed", "twins", "latin", "sobol", "sampling_seed", "ranks", "threads", "links", "output")
    if path.is_dir():
        for name in of_members:
            if options[name]:
                raise UsageError(
                    f"{path} is an existing sweep, whose members are fixed: give options of members with a SCRIPT"
                )
        return Sweep.open(path)
    values: dict[str, Any] = {}
    for name, words in options["values"]:
        if name in values:
            raise UsageError(f"--set {name} is given twice")
        values[name] = words
    if options["latin"] and options["sobol"]:
        raise UsageError("give either --latin or --sobol")
    if options["sampling_seed"] is not None and not (options["latin"] or options["sobol"]):
        raise UsageError("--sampling-seed requires --latin or --sobol")
    return Sweep(
        path, values, seed=options["seed"], twins=options["twins"], latin=options["latin"], sobol=options["sobol"],
        sampling_seed=options["sampling_seed"] or 0, ranks=options["ranks"] or 1, threads=options["threads"] or 1,
        folder=options["output"], links=options["links"],
    )  # fmt: skip


_FILE = {
    "script": "script", "seed": "seed", "twins": "twins", "latin": "latin", "sobol": "sobol",
    "sampling-seed": "sampling_seed", "ranks": "ranks", "threads": "threads", "jobs": "jobs", "tries": "tries",
    "with": "links", "output": "output", "sbatch": "sbatch",
}  # fmt: skip
"""Keys of a settings file, besides [set]."""


def from_file(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a file of settings, under those of the command line. Paths are relative to the file. UsageError
    for a key or a value that does not belong there."""
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise UsageError(f"{path}: {problem.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise UsageError(f"{path}: {problem}") from None
    for key in given:
        if key not in _FILE and key != "set":
            raise UsageError(f"{path}: unknown key '{key}'; known: {', '.join(_FILE)} and the table [set]")
    if "script" not in given:
        raise UsageError(f"{path}: script = FILE is missing")
    if not isinstance(given.get("set", {}), dict):
        raise UsageError(f"{path}: set is a table: [set], then NAME = VALUES")
    words = [word for key, value in given.items() if key != "set" for word in _as_typed(path, key, value)]
    read = read_command_line(sweep, str(path), words)
    if "seed" in given:
        read["seed"] = _values(path, "seed", given["seed"])
    read["values"] = tuple((name, _values(path, name, value)) for name, value in given.get("set", {}).items())
    over = {name: value for name, value in options.items() if value not in (None, (), False) and name != "script"}
    if "values" in over:
        names = {name for name, _ in over["values"]}
        over["values"] = (*(pair for pair in read["values"] if pair[0] not in names), *over["values"])
    return read | over


def _as_typed(path: Path, key: str, value: Any) -> Iterator[str]:
    """A key of a file as words of the command line; a seed, of which there may be several, as none."""
    for one in value if key in ("with", "sbatch") and isinstance(value, list) else [value]:
        if isinstance(one, (dict, bool)) or (isinstance(one, list) and key != "seed"):
            raise UsageError(f"{path}: {key} = {one!r}: expected a number or a word")
        text = str(path.parent / one) if key in ("with", "output", "script") else str(one)
        if key != "seed":
            yield from [text] if key == "script" else [f"--{key}", text]


def _values(path: Path, name: str, value: Any) -> str | Sequence[Any]:
    """Values of a parameter in a file: a word as on the command line, a number, or a list."""
    if isinstance(value, (str, list)):
        if isinstance(value, list) and any(isinstance(one, (dict, list)) for one in value):
            raise UsageError(f"{path}: {name}: expected a list of numbers or words")
        return value
    if isinstance(value, (int, float)):
        return [value]
    raise UsageError(f"{path}: {name} = {value!r}: expected a number, a word or a list of them")
