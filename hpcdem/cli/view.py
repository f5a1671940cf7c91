"""`hpcdem view DIR|FILE ...`: frames on a page in the browser, while a run goes on and afterwards."""

from __future__ import annotations

import sys
from typing import Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import EXIT_OK
from hpcdem.runtime import launch


@click.command(context_settings=HELP, no_args_is_help=True)
@click.argument("paths", type=PATH, nargs=-1, required=True, metavar="DIR|FILE...")
@click.option("--view", "view_file", type=PATH, metavar="FILE", help="Begin with this view *.mv [everything].")
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="[a free one].")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def view(**options: Any) -> None:
    """Show frames of particles or of blocks on a page in the browser: move, choose, colour, ask, play, save.

    The folder of a run that goes on is followed. The page is open to this machine only; from a cluster take it through
    ssh: `ssh -L PORT:127.0.0.1:PORT host`, with --port PORT here.
    """


def start(words: list[str]) -> NoReturn:
    """The program `hpcdem view`."""
    with messages_only(), launch.one_voice():
        options = read_command_line(view, "hpcdem view", [*words])
    with messages_only():
        if launch.speaks_for_all():
            launch.prepare_environment(1)
            from hpcdem.page.viewer import serve

            serve(
                [*options["paths"]], options["view_file"], options["port"], not options["no_browser"], click.echo
            )  # fmt: skip
    sys.exit(EXIT_OK)
