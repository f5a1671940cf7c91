"""`hpcdem calibrate SETTINGS.toml`: parameters of a model from measured properties of a rock."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import EXIT_OK
from hpcdem.runtime import launch


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="Repeat the command to continue after an interruption: runs that are done are only read. The form of the "
    "settings: docs/sweep.md.",
)  # fmt: skip
@click.argument("settings", type=PATH, metavar="SETTINGS.toml")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Folder of the runs and results [SETTINGS_calibration].")
@click.option("-j", "--jobs", type=click.IntRange(1), metavar="N", help="Runs at once [as many as cores allow].")
@click.option("--tries", type=click.IntRange(1), default=2, metavar="N", help="Number of starts of a run that fails or "
              "is killed; it resumes from its last checkpoint [2].")  # fmt: skip
def calibrate(**options: Any) -> None:
    """Find the parameters of bonds, contacts or joints with which specimen tests reproduce measured properties: runs
    of the scripts in SETTINGS, emulators of their results, the posterior of the parameters, its sensitivity, and what
    the targets cannot determine."""


def start(words: list[str]) -> NoReturn:
    """The program, to its end."""
    with messages_only():
        sys.exit(carry_out(read_command_line(calibrate, "hpcdem calibrate", words)))


def carry_out(options: dict[str, Any]) -> int:
    """`hpcdem calibrate`; returns the exit code."""
    launch.prepare_environment(1)
    from hpcdem.runtime.progress import Log
    from hpcdem.sweep import calibration, calibration_report, forward

    log = Log()
    path: Path = options["settings"]
    settings = forward.read_settings(path)
    folder: Path = options["output"] or path.parent / f"{path.stem}_calibration"
    model = forward.Forward(settings, folder, log, options["jobs"], options["tries"])
    result = calibration.calibrate(model, settings.ranges, settings.targets, **settings.search)
    for written in calibration_report.write(result, settings, folder):
        log.info(f"written: {written}")
    for name, value in result.best.items():
        log.info(f"{name} = {value:.4g}")
    for caution in result.cautions():
        log.warn(caution)
    return EXIT_OK
