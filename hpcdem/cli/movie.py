"""`hpcdem movie DIR`: the frames of a folder, or the pages of zdemss, as a film."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import HELP, PATH, POSITIVE
from hpcdem.cli.pictures import ManualCommand, appearance, common_view, number, processes, style_of
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.post.series import Job, ViewJob
    from hpcdem.runtime.progress import Log

FLUID = ("pressure", "saturation", "aperture", "velocity", "concentration")
PANELS_SHOWN = {name: (name,) for name in ("cracks", "stress", "plastic", "temperature", *FLUID)} | {
    "both": ("cracks", "stress")
}
"""Panels by words of --show."""
PAGE = 17.0
"""Width of a page on which fonts and lines have their nominal sizes [cm]; a film shows this page with --size pixels."""


@click.command(cls=ManualCommand, context_settings=HELP, no_args_is_help=True)
@click.argument("folder", type=PATH, metavar="DIR")
@click.option("--from", "source", type=click.Choice(["frames", "ss"]), default="frames", help="Frames of DIR, or the "
              "pictures *.jpg that zdemss made in DIR/ss [frames].")  # fmt: skip
@click.option("--fps", type=POSITIVE, default=10.0, metavar="N", help="Frames per second [10].")
@click.option("--size", type=click.IntRange(64, 16384), default=1200, metavar="PX", help="Width in pixels [1200].")
@click.option(
    "--format", "kind", type=click.Choice(["gif", "mp4", "both"]), help="[gif, and mp4 if ffmpeg is installed]."
)
@click.option("-o", "--output", type=PATH, metavar="FILE", help="The film [DIR/movie.gif, .mp4].")
@click.option("--name", metavar="NAME", help="Frames of blocks NAME_<step>.vtkhdf [the most frequent name].")
@click.option("--show", type=click.Choice(list(PANELS_SHOWN)), help="For blocks: cracks (by mode), stress "
              "(compressive), plastic strain, temperature; for fluid in joints pressure, saturation, aperture, "
              "velocity, proppant concentration; both: cracks and stress [all available].")  # fmt: skip
@number("max_workers", None, "Number of drawing processes [one per core].", POSITIVE)
@appearance
def movie(**options: Any) -> None:
    """Make a film of all frames in DIR, of particles or of blocks, drawn with the same limits.

    An animated GIF, and MP4 where ffmpeg is found (in the PATH or in the package imageio-ffmpeg). --showlable=true
    writes the step into each frame; in your own text, {step} and {time} (s) are replaced.
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: make the film. Raises HpcdemError on all ranks."""
    from hpcdem.io.agreed import on_first

    options["lines"] = False

    def begin() -> tuple[list[tuple[str, Path]], list[Path]]:
        goals = targets(options)
        if options["source"] == "ss":
            return goals, _pages(options["folder"], log)
        return goals, []

    goals, pictures = on_first(comm, begin)
    scratch: Path | None = None
    try:
        if options["source"] == "frames":
            # Beside the film, where every rank can write.
            scratch = on_first(comm, lambda: Path(tempfile.mkdtemp(prefix=".movie_", dir=goals[0][1].parent)))
            pictures = draw(comm, log, options, scratch)
        for kind, path in goals:
            on_first(comm, lambda: write(kind, pictures, path, options))  # noqa: B023
            seconds = len(pictures) / options["fps"]
            log.info(f"{path}: {len(pictures)} frames, {seconds:.3g} s")
    finally:
        if scratch is not None and comm.rank == 0:
            shutil.rmtree(scratch, ignore_errors=True)


def _pages(folder: Path, log: Log) -> list[Path]:
    """The pages of zdemss, without those of frames that an earlier run has left in the folder."""
    from hpcdem.io.frames import earlier_stems, left_out
    from hpcdem.post import movie as films

    earlier = earlier_stems(folder)
    pages = films.pages(folder / "ss", earlier)
    if earlier:
        log.warn(left_out(folder))
    return pages


def write(kind: str, pictures: list[Path], path: Path, options: dict[str, Any]) -> None:
    """The film of pictures. Raises HpcdemError."""
    from hpcdem.post import blocks
    from hpcdem.post import movie as films

    if kind == "gif":
        films.write_gif(pictures, path, options["fps"], options["size"], blocks.LINES if options["lines"] else ())
    else:
        films.write_mp4(pictures, path, options["fps"], options["size"])


def targets(options: dict[str, Any]) -> list[tuple[str, Path]]:
    """Kind and path of each film to be made. Raises HpcdemError."""
    from hpcdem.core.errors import HpcdemError, UsageError
    from hpcdem.post import movie as films

    kind, output = options["kind"], options["output"] or options["folder"] / "movie"
    if not options["folder"].is_dir():
        raise HpcdemError(f"folder not found: {options['folder']}")
    if not output.parent.is_dir():
        raise HpcdemError(f"cannot make {output}: the folder does not exist")
    suffix = output.suffix.lower().removeprefix(".")
    if options["output"] and suffix in ("gif", "mp4"):
        if kind not in (None, "both", suffix):
            raise UsageError(f"--format {kind} does not make {output}")
        kind, output = kind or suffix, output.with_suffix("")
    if kind is None:
        kind = "both" if films.ffmpeg() is not None else "gif"
    if kind != "gif" and films.ffmpeg() is None:
        raise HpcdemError(
            "MP4 needs ffmpeg, which was not found: install it, or `pip install imageio-ffmpeg`, or use --format gif"
        )
    return [(k, output.with_name(f"{output.name}.{k}")) for k in ("gif", "mp4") if kind in (k, "both")]


def draw(comm: Comm, log: Log, options: dict[str, Any], scratch: Path) -> list[Path]:
    """Collective: the pictures of all frames, at one view."""
    from hpcdem.core.errors import HpcdemError
    from hpcdem.io.agreed import on_first
    from hpcdem.io.frames import left_out, list_frames, list_mesh_frames
    from hpcdem.post.series import Job, draw_all

    def plan() -> Sequence[Job | ViewJob]:
        folder: Path = options["folder"]
        files = [] if options["name"] else [file.path for file in list_frames(folder)]
        if others := left_out(folder):
            log.warn(others)
        if not files:
            of_blocks = [file.path for file in list_mesh_frames(folder, options["name"])]
            if of_blocks:
                options["lines"] = True  # thin, and coloured
                return jobs_of_blocks(of_blocks, options, scratch)
            raise HpcdemError(f"no frame all_*.vtkhdf, all_*.dat or <name>_*.vtkhdf in {folder}")
        # Twice the size, made small afterwards: smooth lines at the few pixels of a film.
        style = style_of(options, folder, PAGE, 2.0 * options["size"] * 2.54 / PAGE)
        seen = common_view(files, style)
        style = replace(style, from_zero=False)
        return [Job(file, scratch / f"{k:06d}.png", style, seen) for k, file in enumerate(files)]

    jobs = on_first(comm, plan)
    draw_all(jobs, comm, processes(options), log.info)
    return [job.picture for job in jobs]


IN_PLANE = ("show", "xmin", "xmax", "ymin", "ymax")
"""Options of films of blocks for two dimensions only."""


def jobs_in_space(files: list[Path], options: dict[str, Any], scratch: Path) -> list[ViewJob]:
    """Pictures of bodies in space: displacement, cracks and strain, as at the end of a run."""
    from hpcdem.cli.draw import common
    from hpcdem.core.errors import UsageError
    from hpcdem.post.series import ViewJob
    from hpcdem.post.view.moment import read_moment
    from hpcdem.post.view.paper import Paper
    from hpcdem.post.view.scene import default_view

    for name in IN_PLANE:
        if options[name] is not None:
            raise UsageError(f"--{name} is for two dimensions; hpcdem draw DIR --field NAME -o FILE.gif draws three")
    title = style_of(options, options["folder"], PAGE, 1.0).title or ""
    view = default_view(read_moment(files[-1])).changed(title=title)
    seen, view = common(files, view)
    paper = Paper(PAGE, options["fontsize"], 2.0 * options["size"] * 2.54 / PAGE)
    return [ViewJob(file, scratch / f"{k:06d}.png", view, paper, seen) for k, file in enumerate(files)]


def jobs_of_blocks(files: list[Path], options: dict[str, Any], scratch: Path) -> Sequence[Job | ViewJob]:
    """Pictures of blocks: one view and one range of stress and of strain for all."""
    from hpcdem.io.axes import View
    from hpcdem.io.vtkhdf_mesh import read_mesh_frame
    from hpcdem.post import blocks
    from hpcdem.post.series import Job

    views = []
    spans: dict[str, list[tuple[float, float]]] = {name: [] for name in blocks.COLOURED}
    panels: set[str] = set()
    if read_mesh_frame(files[-1], lazily=True, solid=True).points.shape[1] == 3:
        return jobs_in_space(files, options, scratch)
    for file in files:
        state = read_mesh_frame(file)
        views.append(blocks.view(state))
        panels.update(blocks.panels_of(state))
        for name, shown in blocks.COLOURED.items():
            spans[name].append(shown.range(state))
    limits = [
        bound if options[name] is None else options[name]
        for name, bound in (
            ("xmin", min(v.left for v in views)), ("xmax", max(v.right for v in views)),
            ("ymin", min(v.bottom for v in views)), ("ymax", max(v.top for v in views)),
        )
    ]  # fmt: skip
    appearance = blocks.Appearance(
        PANELS_SHOWN.get(options["show"]) or tuple(name for name in blocks.PANELS if name in panels), PAGE,
        options["fontsize"],
        2.0 * options["size"] * 2.54 / PAGE, style_of(options, options["folder"], PAGE, 1.0).title,
        {name: (min(low for low, _ in them), max(high for _, high in them)) for name, them in spans.items()},
    )  # fmt: skip
    return [Job(file, scratch / f"{k:06d}.png", appearance, View(*limits)) for k, file in enumerate(files)]
