"""`hpcdem grade FILE`: a specimen from a grading curve."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import FINITE, HELP, PATH
from hpcdem.cli.measure import FORMATS
from hpcdem.cli.pictures import Formats
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.pre.specimen import Grading, Request, Specimen
    from hpcdem.pre.specimen.classes import Grains
    from hpcdem.runtime.progress import Log

SHAPES = ("circle", "ellipse", "triangle", "quadrilateral", "pentagon")
MM = 1e-3


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="Each line of FILE gives a size in mm and the percentage of mass finer than it. Terms: docs/specimens.md.",
)  # fmt: skip
@click.argument("file", type=PATH, metavar="[FILE]", required=False)
@click.option("--shape", type=click.Choice(SHAPES), default="circle", help="Shape of the grains [circle].")
@click.option("-n", "--number", type=int, metavar="N", help="Number of grains [200, unless --width].")
@click.option("--width", type=FINITE, metavar="MM", help="Width of the box in mm; the number of grains follows.")
@click.option("--slenderness", type=FINITE, default=2.0, metavar="L", help="Height over width of the box [2].")
@click.option("--void-ratio", type=FINITE, default=0.5, metavar="E", help="Voids over grains, by area [0.5].")
@click.option("--l-over-d", type=FINITE, default=1.5, metavar="R", help="ellipse: long over short axis [1.5].")
@click.option("--size-rule", type=click.Choice(("major", "minor", "area")), default="major",
              help="ellipse: definition of its size: an axis, or the diameter of a circle of equal area "
                  "[major].")  # fmt: skip
@click.option("--deviation", type=FINITE, default=0.0, metavar="DEG", help="Polygons: largest deviation of vertices, "
              "in degrees [0].")  # fmt: skip
@click.option("--roundness", type=FINITE, default=0.0, metavar="R", help="Polygons: 0 straight edges, 1 a circle [0].")
@click.option("--mass-exponent", type=click.Choice(("2", "3")), default="2", help="Exponent of size in the mass of a "
              "grain: 2, or 3 for the grain numbers of a real sieve curve [2].")  # fmt: skip
@click.option("--placement", type=click.Choice(("dense", "cells")), default="dense", help="dense: in the box at the "
              "void ratio; cells: loose, one grain per cell of a column [dense].")  # fmt: skip
@click.option("--cell", type=FINITE, default=2.0, metavar="F", help="cells: cell over largest grain [2].")
@click.option("--seed", type=int, default=0, metavar="N", help="Random seed [0].")
@click.option("-o", "--out", type=PATH, metavar="DIR", help="Folder for the files [specimen].")
@click.option("--layout", type=click.Choice(("sample", "full", "plain")), help="PPDEM file: arcs; with a column of "
              "roundness; circles without the leading 1 [sample; with --read the one that fits].")  # fmt: skip
@click.option("--angle-factor", type=FINITE, default=1.0, metavar="F", help="PPDEM file: numbers per degree of central "
              "angle [1].")  # fmt: skip
@click.option("--gap", type=FINITE, default=0.03, metavar="G", help="Largest gap between outlines and the discs of "
              "clumps, over the size [0.03].")  # fmt: skip
@click.option("--format", "formats", type=Formats(FORMATS, none=True), default="png", metavar="LIST",
              help="Figures: png, jpg, pdf, svg, separated by commas, or none [png].")  # fmt: skip
@click.option("--falling", is_flag=True, help="Plot the grading curve with sizes decreasing to the right.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option("--read", "read", type=PATH, metavar="FILE.dat", help="Inspect a PPDEM file instead; FILE, if given, is "
              "the grading for comparison.")  # fmt: skip
def grade(**options: Any) -> None:
    """Make a specimen with the grading curve in FILE: grains of one shape, in their positions.

    \b
    specimen.dat            the outlines, for PPDEM
    specimen.xyr, .clumps   circles for LOAD, other shapes as clumps of discs for CLUMP
    deposit.py, biaxial.py  scripts that use them
    grading.csv, specimen.json, figures of grading, packing and sizes
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: rank 0 does it. HpcdemError on all ranks."""
    from hpcdem.io.agreed import on_first

    on_first(comm, lambda: show_file(options) if options["read"] else make(options))


def request(options: dict[str, Any], curve: Grading) -> Request:
    """Convert the options to a request. Raises CommandError."""
    from hpcdem.pre.specimen import Request

    number = options["number"]
    if number is None and options["width"] is None:
        number = 200
    return Request(
        sizes=tuple(curve.sizes.tolist()), percents=tuple(curve.percent.tolist()), shape=options["shape"],
        number=number, width=None if options["width"] is None else options["width"] * MM,
        slenderness=options["slenderness"], void_ratio=options["void_ratio"], l_over_d=options["l_over_d"],
        size_rule=options["size_rule"], deviation=options["deviation"], roundness=options["roundness"],
        mass_exponent=int(options["mass_exponent"]), placement=options["placement"], cell=options["cell"],
        seed=options["seed"],
    )  # fmt: skip


def make(options: dict[str, Any]) -> None:
    """Read the grading, make the specimen, write its files, say what came of it."""
    from hpcdem.commands.specimens import Outputs, Style
    from hpcdem.core.errors import UsageError
    from hpcdem.pre.specimen import make_specimen, read_grading

    if options["file"] is None:
        raise UsageError("the grading file is missing: hpcdem grade FILE ...")
    style = Style(_layout(options), _factor(options), options["gap"], tuple(options["formats"]), options["falling"])
    if style.layout == "plain" and options["shape"] != "circle":
        raise UsageError("--layout plain supports circles only")
    wanted = request(options, read_grading(options["file"]))
    began = time.perf_counter()
    outputs = Outputs(make_specimen(wanted), style)
    made = time.perf_counter()
    facts = outputs.summary()
    paths = outputs.write(options["out"] or Path("specimen"))
    if options["as_json"]:
        click.echo(json.dumps(facts | {"files": [str(path) for path in paths]}))
    else:
        show(outputs.specimen, facts)
        click.echo(f"placed in {made - began:.2f} s, files in {time.perf_counter() - made:.2f} s")
        click.echo(f"{paths[0].parent}: {', '.join(path.name for path in paths)}")


def _layout(options: dict[str, Any]) -> str:
    return options["layout"] or "sample"


def _factor(options: dict[str, Any]) -> float:
    from hpcdem.core.errors import UsageError

    factor = options["angle_factor"]
    if not (math.isfinite(factor) and 1e-6 <= factor <= 1e6):
        raise UsageError(f"--angle-factor {factor:g}: expected a number from 1e-6 to 1e6")
    return factor


def show(made: Specimen, facts: dict[str, Any]) -> None:
    """The table of the classes, and a few lines."""
    head = ("size (mm)", "finer (%)", "by number (%)", "by area (%)", "exact", "grains", "one grain from N =")
    rows = [
        (f"{r.size:g}", f"{r.target:.4g}", f"{r.by_number:.2f}", f"{r.by_area:.2f}", f"{r.exact:.4f}", str(r.count),
         f"{math.ceil(r.needed * (1 - 1e-12))}" if math.isfinite(r.needed) else "-")
        for r in made.rows
    ]  # fmt: skip
    _table(head, rows)
    box, space, voids = facts["box"], facts["room"], facts["void_ratio"]
    click.echo(f"box {box['width']:.4g} x {box['height']:.4g} mm at a void ratio of {voids['target']:g}")
    placed = (
        f"{made.request.placement}: {space['width']:.4g} x {space['height']:.4g} mm, void ratio {voids['reached']:.4g}"
    )
    if made.request.placement == "dense":
        placed += f"; {facts['added']} placed freely, {facts['moved']} separated in {facts['sweeps']} rounds"
        if made.density.raised > 1.0:
            placed += f"; the box was made {100.0 * (made.density.raised - 1.0):.2g} % higher"
    click.echo(placed)
    click.echo(_numbers(facts["Cu"], facts["Cc"]))
    missing = [f"{r.size:g} mm" for r in made.rows if not r.count and math.isfinite(r.needed)]
    if missing:
        click.echo(
            f"no grain of {', '.join(missing)}: the last column gives the number of grains that would include one"
        )
    if "clumps" in facts:
        c = facts["clumps"]
        click.echo(
            f"clumps: {c['discs']} discs, {c['discs_per_grain']:.3g} per grain, over {100.0 * c['coverage']:.1f} % of "
            f"the area (least {100.0 * c['least_coverage']:.1f} %); largest gap "
            f"{100.0 * c['largest_gap_over_size']:.2g} % of the size"
        )


def _numbers(cu: dict[str, Any], cc: dict[str, Any]) -> str:
    def text(value: float | None) -> str:
        return "-" if value is None else f"{value:.4g}"

    both = (("Cu", cu), ("Cc", cc))
    return ", ".join(f"{name} {text(c['reached'])} (target {text(c['target'])})" for name, c in both)


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in head:
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 110
    console.print(table)


# --- looking into a file -----------------------------------------------------------------------------------------


def show_file(options: dict[str, Any]) -> None:
    """Read a PPDEM file, sort its grains into classes, print and draw them."""
    from hpcdem.core.errors import UsageError
    from hpcdem.io.ppdem import read_ppdem
    from hpcdem.pre.specimen import read_grading
    from hpcdem.pre.specimen.classes import classified

    curve = None if options["file"] is None else read_grading(options["file"])
    file = read_ppdem(options["read"], options["layout"], _factor(options))
    found = classified(file, None if curve is None else curve.sizes)
    if len(found.sizes) > 200:
        raise UsageError(
            f"{options['read']}: {len(found.sizes)} sizes; give a grading FILE whose sizes are the classes"
        )
    facts = described(found, curve)
    paths = [] if options["out"] is None else draw(found, curve, options)
    if options["as_json"]:
        click.echo(json.dumps(facts | {"files": [str(path) for path in paths]}))
        return
    head = ("size (mm)", *(() if curve is None else ("target (%)",)), "finer by area (%)", "grains")
    rows = [
        (f"{c['size']:.6g}", *(() if curve is None else (f"{c['finer_target']:.4g}",)), f"{c['finer_by_area']:.2f}",
         str(c["grains"]))
        for c in facts["classes"]
    ]  # fmt: skip
    kinds = ", ".join(f"{number} {kind}" for kind, number in facts["kinds"].items())
    click.echo(f"{options['read']}: {len(found)} grains: {kinds}")
    _table(head, rows)
    if facts["roundness"] is not None:
        click.echo(f"roundness {facts['roundness'][0]:.6g} to {facts['roundness'][1]:.6g}")
    click.echo(_numbers(facts["Cu"], facts["Cc"]))
    if paths:
        click.echo(f"{paths[0].parent}: {', '.join(path.name for path in paths)}")


def described(found: Grains, curve: Grading | None) -> dict[str, Any]:
    """Facts about the grains of a file, as JSON takes them; lengths in mm."""
    import numpy as np

    kinds, number = np.unique(found.kind, return_counts=True)
    reached = found.grading
    left, right, bottom, top = found.outlines.boxes().T
    known = found.roundness[np.isfinite(found.roundness)]

    def of(name: str) -> dict[str, float | None]:
        values = {"target": math.nan if curve is None else getattr(curve, name), "reached": getattr(reached, name)}
        return {key: value if math.isfinite(value) else None for key, value in values.items()}

    target = [None] * len(found.sizes) if curve is None else curve.percent.tolist()
    return {
        "grains": len(found),
        "kinds": {str(kind): int(n) for kind, n in zip(kinds, number)},
        "solid_area": float(found.area.sum()) / MM**2,
        "extent": [float(v) / MM for v in (left.min(), right.max(), bottom.min(), top.max())],
        "roundness": [float(known.min()), float(known.max())] if len(known) else None,
        "Cu": of("uniformity"),
        "Cc": of("curvature"),
        "classes": [
            {"size": size, "finer_target": wanted, "finer_by_area": percent, "grains": count}
            for size, wanted, percent, count in zip(
                found.sizes.tolist(), target, reached.percent.tolist(), found.counts.tolist()
            )
        ],
    }


def draw(found: Grains, curve: Grading | None, options: dict[str, Any]) -> list[Path]:
    """The figures of the grains of a file."""
    from hpcdem.core.comm import SerialComm
    from hpcdem.io.agreed import make_folder
    from hpcdem.post import specimen as figures
    from hpcdem.post.measure.figures import save

    left, right, bottom, top = found.outlines.boxes().T
    x, y = float(left.min()), float(bottom.min())
    space = float(right.max()) - x, float(top.max()) - y
    o = found.outlines
    moved = replace(o, x=o.x - x, y=o.y - y)
    reached = found.grading
    numbers = [
        (name, math.nan if curve is None else getattr(curve, key), getattr(reached, key))
        for name, key in (("Cu", "uniformity"), ("Cc", "curvature"))
    ]
    target = None if curve is None else curve.percent
    drawn = {
        "grading": figures.grading_curve(found.sizes, reached.percent, target, numbers, options["falling"]),
        "packing": figures.packing(moved, found.class_of, found.sizes, space, space),
        "sizes": figures.histogram(found.sizes, found.counts),
    }
    folder = options["out"]
    make_folder(folder, SerialComm())
    return [save(figure, folder / f"{name}.{kind}") for name, figure in drawn.items() for kind in options["formats"]]
