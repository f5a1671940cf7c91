"""`hpcdem view DIR|FILE ...`: frames on a page in the browser, during a run and afterwards."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import EXIT_OK, UsageError
from hpcdem.runtime import kept, launch, run_folder

if TYPE_CHECKING:
    from hpcdem.page.desk import Desk


@click.command(context_settings=HELP, no_args_is_help=True)
@click.argument("paths", type=PATH, nargs=-1, metavar="DIR|FILE...")
@click.option("--run", "script", is_flag=False, flag_value="", metavar="[SCRIPT]", help="Open a console for commands "
              "and an editor for the scripts of a folder. Anyone who can open the page can run programs.")  # fmt: skip
@click.option("-j", "threads", type=click.IntRange(1), default=1, metavar="N", help="Threads of the console [1].")
@click.option("--view", "view_file", type=PATH, metavar="FILE", help="Start with this view *.mv [everything].")
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="[a free one].")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def view(**options: Any) -> None:
    """Open frames of particles or blocks in the browser: pan and zoom, select and colour objects, query values, play,
    export.

    The page follows a running simulation. Only this machine can open it; on a cluster use ssh: `ssh -L
    PORT:127.0.0.1:PORT host`, with --port PORT here.
    """


def desk_of(options: dict[str, Any]) -> Desk | None:
    """Find what --run opens: scripts of the folder of SCRIPT, else of the current folder; results go to DIR, else to
    data there."""
    if options["script"] is None:
        if options["threads"] != 1:
            raise UsageError("-j requires --run (threads of its console)")
        return None
    from hpcdem.page.desk import SCRIPT, Desk

    script = Path(options["script"])
    folder = script.parent if options["script"] else Path()
    if options["script"] and (not script.is_file() or SCRIPT.fullmatch(script.name) is None):
        raise UsageError(f"--run {script}: expected an existing script *.py or *.sc")
    outdir = options["paths"][0] if options["paths"] else folder / "data"
    if outdir.exists() and not outdir.is_dir():
        raise UsageError(f"{outdir}: expected a folder for the results")
    return Desk(folder.resolve(), outdir.resolve(), script.name, options["threads"])


def start(words: list[str]) -> NoReturn:
    """The program `hpcdem view`."""
    with messages_only(), launch.one_voice():
        options = read_command_line(view, "hpcdem view", [*words])
    with messages_only():
        if launch.speaks_for_all():
            launch.prepare_environment(1)
            kept.install()
            from hpcdem.page.viewer import serve

            paths, desk = [*options["paths"]], desk_of(options)
            if desk is not None:
                paths = [desk.console.outdir, desk.console.outdir / run_folder.PRESENT, *paths[1:]]
            elif not paths:
                raise UsageError("expected a folder or file with frames, or --run [SCRIPT]")
            serve(paths, options["view_file"], options["port"], not options["no_browser"], click.echo, desk)
    sys.exit(EXIT_OK)
