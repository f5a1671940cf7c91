"""`zdem2jpg --dir DIR`: a picture of every frame of a folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import HELP, PATH, POSITIVE
from hpcdem.cli.pictures import Formats, ManualCommand, Numbers, appearance, number, processes, style_of
from hpcdem.core.comm import Comm
from hpcdem.runtime import launch

if TYPE_CHECKING:
    from hpcdem.post.view.model import Layer
    from hpcdem.runtime.progress import Log


FORMATS = ("jpg", "png", "tiff", "pdf", "svg")


@click.command(cls=ManualCommand, context_settings=HELP, no_args_is_help=True)
@click.option("-d", "--dir", "folder", type=PATH, required=True, metavar="DIR", help="Folder of the frames.")
@appearance
@number("dpi", 600.0, "Dots per inch [600].", POSITIVE)
@number("pagesize", 14.0, "Width of the picture, cm [14].", POSITIVE)
@click.option(
    "--format", "formats", type=Formats(FORMATS), default="jpg", metavar="LIST",
    help=f"One or more of {', '.join(FORMATS)}, separated by commas [jpg].",
)  # fmt: skip
@click.option("--field", metavar="NAME", help="Colour particles by a field: vx, rotation, stress, ... (see `hpcdem "
              "draw --list`) [their own colours].")  # fmt: skip
@click.option("--range", "limits", type=Numbers(2, "full"), metavar="A,B|full", help="--field: values of the first and "
              "the last colour; full: minimum and maximum [the 1 % and 99 % quantiles].")  # fmt: skip
@click.option("--colours", metavar="NAME", help="--field: viridis, cividis, blue-red, ... [viridis].")
@number("max_workers", None, "Number of drawing processes [one per core].", POSITIVE)
@click.version_option(launch.version(), "-v", "--version", prog_name="zdem2jpg", message="%(prog)s %(version)s")
def zdem2jpg(**options: Any) -> None:
    """Draw every frame all_*.vtkhdf or all_*.dat in DIR as a picture of the same name beside it.

    Under mpiexec or srun the ranks share the frames.
    """


def of_field(options: dict[str, Any], files: list[Path]) -> Layer | None:
    """Choose the field that colours the particles, with one range for all frames. Raises HpcdemError for an unknown
    field."""
    from hpcdem.core.errors import UsageError
    from hpcdem.post.view.model import ModelView, view_of
    from hpcdem.post.view.moment import read_moment
    from hpcdem.post.view.scene import shared

    field_style = {name: options[name] for name in ("limits", "colours") if options[name] is not None}
    if options["field"] is None:
        if field_style:
            raise UsageError("--range and --colours require --field")
        return None
    if not options["ballplot"]:
        raise UsageError("--field colours particles, which --ballplot=false hides")
    view: ModelView = view_of(
        {"layers": [{"object": "particles", "field": options["field"], **field_style}]}, "--field"
    )
    return shared(view, (read_moment(file) for file in files)).layers[0]


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: draw all frames of the folder. Raises HpcdemError on all ranks."""
    from hpcdem.core.errors import HpcdemError
    from hpcdem.io.agreed import on_first
    from hpcdem.io.frames import left_out, list_frames
    from hpcdem.post.series import Job, draw_all

    def plan() -> list[Job]:
        folder: Path = options["folder"]
        style = style_of(options, folder, options["pagesize"], options["dpi"])
        files = [file.path for file in list_frames(folder)]
        if others := left_out(folder):
            log.warn(others)
        if not files:
            raise HpcdemError(f"no frame all_*.vtkhdf or all_*.dat in {folder}")
        style = replace(style, appearance=replace(style.appearance, of_field=of_field(options, files)))
        return [Job(file, file.with_suffix(f".{kind}"), style) for file in files for kind in options["formats"]]

    jobs = on_first(comm, plan)
    draw_all(jobs, comm, processes(options), log.info)
