"""`hpcdem draw FRAME|DIR ...`: pictures of views, of any field that a frame holds."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import FINITE, HELP, PATH, POSITIVE
from hpcdem.cli.pictures import Formats, Numbers, number, processes
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.io.axes import View
    from hpcdem.post.series import ViewJob
    from hpcdem.post.view.model import ModelView
    from hpcdem.post.view.moment import Moment
    from hpcdem.post.view.paper import Paper
    from hpcdem.runtime.progress import Log

FORMATS = ("png", "jpg", "tiff", "pdf", "svg")
FILMS = (".gif", ".mp4")
LAYER_OPTIONS = {
    "limits": "limits", "log": "log", "colours": "colours", "opacity": "opacity", "edges": "edges", "size": "size",
    "vectors": "vectors", "arrows": "arrows", "filter": "filter", "colour": "colour",
}  # fmt: skip
"""Options for one kind of object, and their names in a view."""


@click.command(context_settings=HELP, no_args_is_help=True)
@click.argument("paths", type=PATH, nargs=-1, required=True, metavar="FRAME|DIR...")
@click.option("--view", "view_file", type=PATH, metavar="FILE", help="View *.mv that defines what is shown; the "
              "options below change it [everything].")  # fmt: skip
@click.option("--field", metavar="NAME", help="Colour objects by this field; --list shows the fields.")
@click.option("--object", "on", metavar="WORD", help="Objects to which --field and the options below apply: elements, "
              "particles, joints, ... [the first that have the field].")  # fmt: skip
@click.option("--range", "limits", type=Numbers(2, "full"), metavar="A,B|full", help="Values of the first and the last "
              "colour; full: minimum and maximum [the 1 % and 99 % quantiles].")  # fmt: skip
@click.option("--log", is_flag=True, default=None, help="Logarithmic colour scale.")
@click.option(
    "--colours", metavar="NAME", help="viridis, cividis, yellow-brown, blue-red, ... (docs/view.md) [viridis]."
)
@click.option("--colour", metavar="#RRGGBB", help="One colour for all.")
@click.option("--opacity", type=FINITE, metavar="N", help="From 0 to 1 [1].")
@click.option("--edges/--no-edges", default=None, help="Outlines of elements and particles [of small meshes].")
@click.option("--size", type=FINITE, metavar="N", help="Factor on radii of particles and widths of lines [1].")
@click.option("--vectors", metavar="NAME", help="Arrows of this field: displacement, velocity, force.")
@click.option("--arrows", type=FINITE, metavar="N", help="Factor on the length of arrows [1].")
@click.option(
    "--filter", metavar="TEXT", help="Only objects that satisfy this condition: 'stress_yy < -1e6 and x > 2'."
)
@click.option("--hide", multiple=True, metavar="WORD", help="Hide these objects; repeatable.")
@click.option("--show", multiple=True, metavar="WORD", help="Show these objects (contacts and bonds are hidden).")
@click.option("--deformed", type=FINITE, metavar="N", help="Factor on displacements of blocks [1].")
@click.option("--camera", type=Numbers(4), metavar="L,R,B,T", help="Left, right, bottom, top of the picture, m; in "
              "three dimensions in the plane of the picture [all].")  # fmt: skip
@click.option("--eye", metavar="WORD|X,Y,Z", help="In three dimensions: view from +x, -x, +y, -y, +z, -z, iso (right, "
              "front, above), or from this direction [iso].")  # fmt: skip
@click.option("--section", metavar="PLANE", help="In three dimensions: section at x=1.5 (the part towards the viewer "
              "is removed), x<1.5 or x>1.5 (the part that remains), or PX,PY,PZ,NX,NY,NZ (a point and the normal into "
              "the removed part).")  # fmt: skip
@click.option("--title", metavar="TEXT", help="Title above the picture; {step} and {time} are replaced.")
@click.option("--no-axes", is_flag=True, help="Without axes.")
@click.option("--no-legend", is_flag=True, help="Omit legend and colour bars.")
@click.option("--step", type=click.IntRange(0), metavar="N", help="For a folder: only the frame of this step.")
@click.option("--name", metavar="NAME", help="For a folder: frames of blocks NAME_<step>.vtkhdf.")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="The picture, or a film *.gif or *.mp4 "
              "[beside each frame].")  # fmt: skip
@click.option("--format", "formats", type=Formats(FORMATS), metavar="LIST", help="One or more of png, jpg, tiff, pdf, "
              "svg [png].")  # fmt: skip
@number("dpi", 300.0, "Dots per inch [300].", POSITIVE)
@number("page", 17.0, "Width of the picture, cm [17].", POSITIVE)
@number("font", 9.0, "Size of letters, points [9].", POSITIVE)
@number("fps", None, "Frames per second of a film [10].", POSITIVE)
@number("max_workers", None, "Number of drawing processes [one per core].", POSITIVE)
@click.option("--save-view", type=PATH, metavar="FILE", help="Write the view as *.mv.")
@click.option("--list", "only_list", is_flag=True, help="List the available objects and fields; draw nothing.")
def draw(**options: Any) -> None:
    """Draw frames of particles or of blocks: PNG, JPG, TIFF, and true vectors in PDF and SVG.

    All frames of a folder are drawn with the same limits and range of colours. Under mpiexec or srun the ranks share
    them.
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: draw. Raises HpcdemError on all ranks."""
    from hpcdem.io.agreed import on_first
    from hpcdem.post.series import draw_all

    if options["only_list"]:
        on_first(comm, lambda: _list(frames_of(options, log)))
        return
    film: Path | None = options["output"]
    film = film if film is not None and film.suffix.lower() in FILMS else None
    scratch: Path | None = None
    try:
        if film is not None:
            scratch = on_first(comm, lambda: Path(tempfile.mkdtemp(prefix=".draw_", dir=film.parent)))
        jobs = on_first(comm, lambda: plan(options, log, scratch))
        draw_all(jobs, comm, processes(options), log.info)
        if film is not None:
            on_first(comm, lambda: _film([job.picture for job in jobs], film, options["fps"] or 10.0))
            log.info(f"{film}: {len(jobs)} frames")
    finally:
        if scratch is not None and comm.rank == 0:
            shutil.rmtree(scratch, ignore_errors=True)


def _film(pictures: list[Path], film: Path, fps: float) -> None:
    from hpcdem.post import movie

    (movie.write_gif if film.suffix.lower() == ".gif" else movie.write_mp4)(pictures, film, fps)


def frames_of(options: dict[str, Any], log: Log) -> list[Path]:
    """The files to be drawn. Raises HpcdemError if none exists."""
    from hpcdem.core.errors import HpcdemError, UsageError
    from hpcdem.io.frames import left_out, list_frames, list_mesh_frames

    found: list[Path] = []
    for path in options["paths"]:
        if not path.is_dir():
            if not path.exists():
                raise HpcdemError(f"folder or file not found: {path}")
            for name in ("step", "name"):
                if options[name] is not None:
                    raise UsageError(f"--{name} selects frames of a folder, but {path} is a file")
            found.append(path)
            continue
        files = [] if options["name"] else list_frames(path)
        files = files or list_mesh_frames(path, options["name"])
        if others := left_out(path):
            log.warn(others)
        some = [file.path for file in files if options["step"] in (None, file.step)]
        if not some:
            which = "" if options["step"] is None else f" of step {options['step']}"
            raise HpcdemError(f"no frame all_*.vtkhdf, all_*.dat or <name>_*.vtkhdf{which} in {path}")
        found += some
    return found


def plan(options: dict[str, Any], log: Log, scratch: Path | None = None) -> list[ViewJob]:
    """Plan the pictures: one view, one folder and one range of colours for all. Raises HpcdemError."""
    from hpcdem.core.errors import UsageError
    from hpcdem.post.series import ViewJob
    from hpcdem.post.view.model import save_view
    from hpcdem.post.view.moment import read_moment
    from hpcdem.post.view.paper import Paper

    files, output = frames_of(options, log), options["output"]
    if options["fps"] is not None and scratch is None:
        raise UsageError("--fps requires a film: -o FILE.gif or FILE.mp4")
    if output is not None and options["formats"]:
        raise UsageError("--format cannot be used with --output, whose name determines the format")
    if output is not None and scratch is None and len(files) > 1:
        raise UsageError(
            f"{len(files)} frames do not fit into one picture: select one with --step, or make a film with -o FILE.gif"
        )
    first = read_moment(files[-1])
    view = view_of(options, first)
    seen, view = common(files, view)
    if options["save_view"] is not None:
        save_view(options["save_view"], view)
    paper = Paper(options["page"], options["font"], options["dpi"])
    if scratch is not None:
        return [ViewJob(file, scratch / f"{k:06d}.png", view, _for_film(paper), seen) for k, file in enumerate(files)]
    kinds = options["formats"] or ("png",)
    return [
        ViewJob(file, picture, view, paper, seen)
        for file in files for picture in ([output] if output else [file.with_suffix(f".{kind}") for kind in kinds])
    ]  # fmt: skip


def _for_film(paper: Paper) -> Paper:
    """Limit the width to 1920 pixels."""
    from dataclasses import replace

    return replace(paper, dpi=min(paper.dpi, 1920.0 * 2.54 / paper.page))


def view_of(options: dict[str, Any], moment: Moment) -> ModelView:
    """The view that the options ask for. Raises HpcdemError for what the frame does not have."""
    from hpcdem.post.view.model import read_view
    from hpcdem.post.view.scene import adjusted, default_view

    view = default_view(moment) if options["view_file"] is None else read_view(options["view_file"])
    layer_options = {LAYER_OPTIONS[name]: options[name] for name in LAYER_OPTIONS if options[name] is not None}
    more = {
        name: options[name] for name in ("deformed", "camera", "eye", "section", "title") if options[name] is not None
    }
    more |= {name: False for name in ("axes", "legend") if options[f"no_{name}"]}
    view = adjusted(view, moment, options["field"], options["on"], layer_options, **more)
    for visible, words in ((True, options["show"]), (False, options["hide"])):
        for word in words:
            moment.of(word)
            for layer in view.layers:
                if layer.object == word:
                    view = view.with_layer(layer.label, visible=visible)
    return view


def common(files: Sequence[Path], view: ModelView) -> tuple[View, ModelView]:
    """The part of the plane that holds every one of these frames, and the view with ranges for all of them."""
    from hpcdem.io.axes import View
    from hpcdem.post.view.moment import read_moment
    from hpcdem.post.view.scene import seen_of, shared

    seen: list[View] = []

    def moments() -> Iterator[Moment]:
        for file in files:
            moment = read_moment(file)
            seen.append(seen_of(moment, view))
            yield moment

    view = shared(view, moments())
    whole = View(min(s.left for s in seen), max(s.right for s in seen), min(s.bottom for s in seen),
                 max(s.top for s in seen))  # fmt: skip
    return whole, view


def _list(files: Sequence[Path]) -> None:
    from hpcdem.post.view.moment import read_moment

    moment = read_moment(files[-1])
    click.echo(f"{files[-1]}: step {moment.step}, time {moment.time:.6g} s")
    for name, objects in moment.objects.items():
        click.echo(f"{name} ({objects.count})")
        for field in objects.known():
            kind = "length of the vector" if field in objects.vectors else ", ".join(objects.names.get(field, ()))
            click.echo(f"  {field:<24} {moment.unit_of(field):<6} {kind}".rstrip())
