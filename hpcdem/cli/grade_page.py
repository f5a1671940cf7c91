"""`hpcdem grade --serve`: the specimen on a page in the browser, redrawn while its sliders are moved."""

from __future__ import annotations

import sys
from typing import Any, NoReturn

import click

from hpcdem.cli import grade as on_paper
from hpcdem.cli.common import HELP, messages_only, read_command_line, run_program
from hpcdem.core.errors import EXIT_OK, UsageError
from hpcdem.runtime import launch

NUMBER = 2000
"""Initial number of grains: enough for a wide grading curve, few enough to draw immediately."""
EXAMPLE = (10.0, 7.0, 5.0, 3.0, 2.0, 1.5), (100.0, 82.0, 64.0, 40.0, 22.0, 9.0)
"""Initial table if no file is given: sizes [mm], per cent finer."""
NOT_SERVED = ("read", "out", "layout", "width", "as_json")
"""Options without meaning for a page."""

grade = click.Command(
    "grade",
    params=[
        *on_paper.grade.params,
        click.Option(
            ["--serve"],
            is_flag=True,
            help="Open a page in the browser with sliders for the options, which also saves the files; FILE is the "
            "initial table. Only this machine can open it.",
        ),
        click.Option(["--port"], type=click.IntRange(0, 65535), metavar="N", help="--serve: port [a free one]."),
        click.Option(["--no-browser"], is_flag=True, help="--serve: only print the address."),
    ],
    help=on_paper.grade.help,
    epilog=on_paper.grade.epilog,
    context_settings=HELP,
    no_args_is_help=True,
)


def start(words: list[str]) -> NoReturn:
    """The program `hpcdem grade`, with a page or without."""
    with messages_only(), launch.one_voice():
        options = read_command_line(grade, "hpcdem grade", [*words])  # click empties its list
        if not options["serve"]:
            for name in ("port", "no_browser"):
                if options[name]:
                    raise UsageError(f"--{name.replace('_', '-')} requires --serve")
    if not options["serve"]:
        run_program(grade, "hpcdem grade", words, on_paper.work)
    with messages_only():
        if launch.speaks_for_all():
            serve(options)
    sys.exit(EXIT_OK)


def serve(options: dict[str, Any]) -> None:
    """Serve the page until Ctrl-C. Raises HpcdemError."""
    for name in NOT_SERVED:
        if options[name]:
            raise UsageError(f"--{name.removeprefix('as_')} cannot be used with --serve")
    launch.prepare_environment(1)

    from hpcdem.page.lifetime import serve as serve_page
    from hpcdem.pre.specimen import read_grading
    from hpcdem.pre.specimen.grading import grading

    curve = grading(*EXAMPLE) if options["file"] is None else read_grading(options["file"])
    if options["number"] is None:
        options["number"] = NUMBER
    usual = {param.name: param.default for param in on_paper.grade.params}
    style = {name: options[name] for name in ("angle_factor", "gap", "falling") if options[name] != usual[name]}
    if options["formats"] != ("png",):
        style["formats"] = options["formats"]
    on_paper._factor(options)
    serve_page(
        on_paper.request(options, curve), style, options["port"] or 0, not options["no_browser"],
        click.echo,
    )  # fmt: skip
