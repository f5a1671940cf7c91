"""`hpcdem section FILE|DIR`: what is in a section, the section in other coordinates, horizons and faults of a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli import pictures
from hpcdem.cli.common import HELP, PATH, POSITIVE, Words
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.pre.section.shapes import Placement, Section, Shape
    from hpcdem.runtime.progress import Log


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="Model coordinates are (file - origin) x scale + to, in metres. With --line, x is the distance along the "
    "line and y the height (z). More in docs/sections.md.",
)  # fmt: skip
@click.argument("source", type=PATH, metavar="FILE|DIR")
@click.option("--scale", type=POSITIVE, metavar="M", help="Metres per unit of the file [as given in the file, else 1].")
@click.option("--origin", type=pictures.Numbers(2), default="0,0", metavar="X,Y", help="Point of the file, in its "
              "units, that is moved to --to [0,0].")  # fmt: skip
@click.option("--to", type=pictures.Numbers(2), default="0,0", metavar="X,Y", help="Position of the origin in the "
              "model, in m [0,0].")  # fmt: skip
@click.option("--line", type=pictures.Numbers(4), metavar="X,Y,X,Y", help="Trace of the section on a map with "
              "heights: two points in units of the file.")  # fmt: skip
@click.option("--legend", type=PATH, metavar="FILE", help="Of an image: lines colour, name.")
@click.option("--attribute", metavar="NAME", help="Attribute whose value is the name (GeoJSON, shapefiles) [name, "
              "layer, unit, formation, label or id].")  # fmt: skip
@click.option("--only", type=Words(), default="", metavar="A,B", help="Only polygons and lines of these names.")
@click.option("--simplify", type=POSITIVE, default=None, metavar="M", help="Omit points of boundaries where triangles "
              "of less than half the square of M metres disappear.")  # fmt: skip
@click.option("--step", type=click.IntRange(0), metavar="N", help="DIR: step of the frame [the last].")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="Write polygons and lines: .geojson, .dxf or .csv.")
@click.option("--map", "on_map", is_flag=True, help="Write coordinates of the file or map, not of the model.")
@click.option("--picture", type=PATH, metavar="FILE", help="Draw the section: .png, .jpg, .pdf or .svg.")
def section(**options: Any) -> None:
    """Report the polygons and lines of a section (GeoJSON, shapefile, SVG, DXF, or an image with a legend): areas,
    lengths, overlaps, gaps, ignored objects; or extract the horizons of a run in DIR (tops of groups, of colours
    without groups) and its faults (after `hpcdem measure DIR faults`)."""


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: rank 0 does it. HpcdemError on all ranks."""
    from hpcdem.io.agreed import on_first

    on_first(comm, lambda: _work(options))


def placement(options: dict[str, Any]) -> Placement:
    """The coordinates that the options mean."""
    from hpcdem.pre.section.shapes import Placement

    line = options["line"]
    trace = None if line is None else ((line[0], line[1]), (line[2], line[3]))
    return Placement(options["scale"], tuple(options["origin"]), tuple(options["to"]), trace)


def _work(options: dict[str, Any]) -> None:
    from hpcdem.core.errors import UsageError
    from hpcdem.pre.section.write import write

    source = options["source"]
    found = of_run(options) if source.is_dir() else _of_file(options)
    for note in found.notes:
        click.echo(note)
    for warning in found.warnings:
        click.echo(f"warning: {warning}", err=True)
    if options["on_map"] and options["output"] is None:
        raise UsageError("--map applies to the file of --output")
    if options["output"] is not None:
        write(options["output"], found.shapes, found.placement if options["on_map"] else None)
        click.echo(
            f"{options['output']}: in {'coordinates of the map' if options['on_map'] else 'metres of the model'}"
        )
    if options["picture"] is not None:
        draw(found, options["picture"])
        click.echo(str(options["picture"]))


def _of_file(options: dict[str, Any]) -> Section:
    from hpcdem.core.errors import UsageError
    from hpcdem.pre.section.read import read

    if options["step"] is not None:
        raise UsageError("--step is for the folder of a run")
    return read(
        options["source"], placement(options), options["legend"], options["attribute"], options["only"],
        options["simplify"] or 0.0,
    )  # fmt: skip


def of_run(options: dict[str, Any]) -> Section:
    """Horizons and faults of a frame of a run. HpcdemError without frames of particles."""
    from hpcdem.core.errors import HpcdemError, UsageError
    from hpcdem.post.horizons import horizons
    from hpcdem.post.measure.grains import grains, in_time
    from hpcdem.pre.section.read import summary
    from hpcdem.pre.section.shapes import Section, Shape, made_curve

    lost = [word for word in ("legend", "attribute", "simplify") if options[word]]
    if lost:
        raise UsageError(f"--{lost[0]} is for the file of a section, not for the folder of a run")
    folder, step = options["source"], options["step"]
    frames = [f for f in in_time(folder) if step is None or f.step == step]
    if not frames:
        there = "no frames of particles" if step is None else f"no frame of step {step}"
        raise HpcdemError(f"{folder}: {there}. Lines of blocks are written by pcdc geometry export")
    g = grains(frames[-1].path)
    shapes = [
        Shape(name, (made_curve(line, False, name),), False, {"kind": "horizon", "step": g.step}, f"top of {name}")
        for name, lines in horizons(g).items() for line in lines
    ]  # fmt: skip
    faults, short = _faults(folder, g.step)
    warnings = () if faults or short else (
        f"no faults at step {g.step}: run `hpcdem measure {folder} faults` first",
    )  # fmt: skip
    if short:
        warnings = (f"ignored: {', '.join(short)} (only one measured point each)",)
    shapes += faults
    if not shapes:
        raise HpcdemError(f"{folder}: the frame of step {g.step} has no particles")
    place = placement(options)
    found = Section(tuple(shapes), replace(place, unit=place.unit or 1.0)).only(options["only"])
    return replace(found, notes=(f"{frames[-1].path.name}, step {g.step}", *summary(found)), warnings=warnings)


def _faults(folder: Path, step: int) -> tuple[list[Shape], list[str]]:
    """Straight bands of measure/faults.csv at a step, and the names of faults of one point."""
    import csv

    import numpy as np

    from hpcdem.core.errors import HpcdemError
    from hpcdem.pre.section.shapes import Shape, made_curve

    path = folder / "measure" / "faults.csv"
    if not path.is_file():
        return [], []
    found: dict[str, Shape] = {}  # of two frames of one step the later one counts
    short: dict[str, None] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            try:
                if int(row["step"]) != step:
                    continue
                ends = np.array([[float(row[f"{c}{k}[m]"]) for c in "xy"] for k in (1, 2)])
            except (KeyError, TypeError, ValueError):
                raise HpcdemError(f"{path}: not a table of faults; repeat hpcdem measure {folder} faults") from None
            name = f"fault {row.get('fault', len(found) + 1)}"
            if (ends[0] == ends[1]).all():
                short[name] = None
                continue
            about: dict[str, Any] = {k: row[k] for k in ("sense", "dip[deg]", "mean_strain") if row.get(k)}
            about |= {"kind": "fault", "step": step}
            found[name] = Shape(name, (made_curve(ends, False, name),), False, about, name)
    return [*found.values()], [*short]


def draw(found: Section, path: Path) -> None:
    """A picture of polygons with their names, and lines."""
    import numpy as np
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    figure = Figure(figsize=(9.0, 6.0))
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    names = list(dict.fromkeys(shape.name for shape in found.polygons))
    deviation = found.deviation
    labelled = set()
    for shape in found.polygons:
        rings = [np.concatenate([ring, ring[:1]]) for ring in shape.points(deviation)]
        codes = np.concatenate([[1] + [2] * (len(ring) - 2) + [79] for ring in rings])
        colour = f"C{names.index(shape.name) % 10}"
        label = None if shape.name in labelled else shape.name
        labelled.add(shape.name)
        outline = Outline(np.concatenate(rings), codes)
        ax.add_patch(PathPatch(outline, facecolor=colour, alpha=0.55, edgecolor="#202020", lw=0.6, label=label))
    lines = list(dict.fromkeys(shape.name for shape in found.lines))
    for shape in found.lines:
        x, y = shape.points(deviation)[0].T
        label = None if shape.name in labelled else shape.name
        labelled.add(shape.name)
        black = bool(found.polygons) or shape.attributes.get("kind") == "fault"
        ax.plot(x, y, color="#c81e1e" if black else f"C{lines.index(shape.name) % 10}", lw=1.6, label=label)
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=6, frameon=False, borderaxespad=0.2)
    figure.savefig(path, dpi=150, bbox_inches="tight")
