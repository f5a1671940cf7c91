"""`hpcdem resume [DIR]`: resume the run that wrote into a folder, whatever ended it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from hpcdem.cli.common import HELP, PATH, Finite
from hpcdem.cli.run import Options, keeping, running, time_limit
from hpcdem.core.errors import EXIT_OK, HpcdemError, UsageError
from hpcdem.runtime import run_folder


@click.command(
    context_settings=HELP,
    epilog="Any number of ranks and threads: mpiexec -n 4 hpcdem resume DIR. The script is that of the run; if its "
    "file no longer exists, the text in the newest checkpoint is used. Exit codes as for hpcdem SCRIPT; 0 also if the "
    "run is complete.",
)
@click.argument("folder", type=PATH, metavar="[DIR]", required=False)
@click.option("-j", "threads", type=click.IntRange(1), metavar="N", help="Threads per rank [as for hpcdem SCRIPT].")
@click.option(
    "--time-limit", callback=time_limit, metavar="HH:MM:SS", help="Save and stop before this much time is up."
)
@click.option(
    "--before", type=Finite(0.0), metavar="T", help="From the last checkpoint at or before T seconds of the model."
)
@keeping
@running
def resume(**options: Any) -> None:
    """Resume the run that wrote into DIR [data, or this folder] from its newest complete checkpoint."""


def resumed_options(given: dict[str, Any]) -> Options:
    """The command line of the run that wrote into the folder, with --resume. UsageError if there is nothing to resume;
    leaves with exit code 0 if the run is complete."""
    folder = _folder(given.pop("folder"))
    try:
        record = run_folder.read(folder)
    except HpcdemError as damaged:
        click.echo(f"warning: {damaged}; using the script in the newest checkpoint", err=True)
        record = None
    if record is not None and record.state == "done" and given["before"] is None:
        click.echo(f"{folder}: the run is complete (step {record.step}); nothing to resume")
        raise SystemExit(EXIT_OK)
    if record is not None and record.language == "python":
        words = " ".join(["hpcdem", record.script, *record.arguments])
        raise UsageError(f"{folder} was written by a Python program; it resumes with Simulation.resume(): {words}")
    given["arguments"] = tuple(record.arguments) if record is not None else ()
    recorded = Path(record.script) if record is not None and record.script else None
    for script in [recorded, folder.parent / recorded.name] if recorded is not None else []:
        if script is not None and script.is_file():
            return Options(script=script, resume=True, outdir=folder, **given)
    name = recorded.name if recorded is not None else "script"
    return Options(script=folder.parent / name, resume=True, outdir=folder, saved_in=folder, **given)


def _folder(named: Path | None) -> Path:
    """The folder meant: DIR itself, or the folder data in it."""
    start = Path() if named is None else named
    for folder in (start, start / "data"):
        if (folder / run_folder.RECORD).is_file() or any(folder.glob("*.sav")):
            return folder.resolve()
    if not start.is_dir():
        raise UsageError(f"folder not found: {start}")
    raise UsageError(f"{start.resolve()}: nothing to resume: found neither {run_folder.RECORD} nor a .sav file")
