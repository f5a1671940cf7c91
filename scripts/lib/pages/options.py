"""The page of all programs and their options, made from them."""

from __future__ import annotations

import inspect

import click

from hpcdem.cli import warmup
from hpcdem.cli.calibrate import calibrate
from hpcdem.cli.case import listing
from hpcdem.cli.console import console
from hpcdem.cli.doctor import doctor
from hpcdem.cli.draw import draw
from hpcdem.cli.examples import examples
from hpcdem.cli.grade_page import grade
from hpcdem.cli.info import info
from hpcdem.cli.measure import measure
from hpcdem.cli.movie import movie
from hpcdem.cli.resume import resume
from hpcdem.cli.run import hpcdem
from hpcdem.cli.section import section
from hpcdem.cli.strain_stress import strain_stress
from hpcdem.cli.sweep import report, sweep
from hpcdem.cli.view import view
from hpcdem.cli.zdem2jpg import zdem2jpg
from hpcdem.cli.zdemss import zdemss
from scripts.lib.pages.markdown import escaped

PROGRAMS: dict[str, click.Command] = {
    "hpcdem": hpcdem, "hpcdem resume": resume, "hpcdem info": info, "hpcdem -s": strain_stress,
    "hpcdem measure": measure, "hpcdem draw": draw, "hpcdem movie": movie, "hpcdem view": view, "hpcdem sweep": sweep,
    "hpcdem sweep report": report,
    "hpcdem calibrate": calibrate,
    "hpcdem section": section, "hpcdem grade": grade, "hpcdem case": listing([]), "hpcdem examples": examples,
    "hpcdem console": console,
    "hpcdem warmup": warmup, "hpcdem doctor": doctor, "zdem2jpg": zdem2jpg, "zdemss": zdemss,
}  # fmt: skip

_TOP = """\
# Programs and options

This page is generated from the programs by `./scripts/pages`; do not edit it. `--help` shows the same text, in part in
Chinese ([languages](running.md#language-of-messages)). `zdem` is another name of `hpcdem`. Defaults are in brackets.

## Exit codes

| code | |
|---|---|
| 0 | done |
| 1 | the run failed: physics, files, launch |
| 2 | command line or script not understood; nothing was run |
| 3 | no equilibrium (`model solve`) |
| 85 | stopped on request, checkpoint written; resume with `--resume` |
"""


def page() -> str:
    """The whole page, in Markdown."""
    return "\n".join([_TOP, *(_program(name, command) for name, command in PROGRAMS.items())]).rstrip("\n") + "\n"


def _program(program: str, command: click.Command) -> str:
    context = click.Context(command, info_name=program)
    usage = " ".join([program, *command.collect_usage_pieces(context)])
    text = inspect.cleandoc(command.help or "").replace("\b\n", "").replace("\f", "")
    lines = [f"## {program}", "", "```", usage, "```", "", text, ""]
    rows = [_row(parameter, context) for parameter in command.params if isinstance(parameter, click.Option)]
    shown = [row for row in rows if row]
    if shown:
        lines += ["| option | |", "|---|---|", *shown, ""]
    if command.epilog:
        lines += [command.epilog.replace("\b\n", ""), ""]
    return "\n".join(lines)


def _row(option: click.Option, context: click.Context) -> str:
    record = option.get_help_record(context)
    if record is None:
        return ""
    return f"| `{escaped(record[0])}` | {escaped(record[1])} |"
