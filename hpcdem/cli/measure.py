"""`hpcdem measure DIR [WHAT ...]`: numbers and figures of a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli import pictures
from hpcdem.cli.common import FINITE, HELP, PATH, POSITIVE, Words
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.runtime.progress import Log

WHAT = ("surface", "wedge", "faults", "wallforce", "tracks", "layers", "cracks", "fragments", "emission", "fluid",
        "regions", "displacement")  # fmt: skip
FORMATS = ("png", "jpg", "pdf", "svg")


class Numbers(Words):
    """Whole numbers with commas between them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        words = super().convert(value, param, ctx)
        try:
            return [int(word) for word in words]
        except ValueError:
            self.fail(f"'{value}': expected whole numbers separated by commas", param, ctx)


def _length(name: str, metavar: str, text: str, more: str | None = None) -> Any:
    names = (name, more) if more else (name,)
    return click.option(*names, type=POSITIVE, metavar=metavar, help=text)


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="Without WHAT: everything the folder allows. Also under mpiexec or srun: ranks share the frames.",
)  # fmt: skip
@click.argument("folder", type=PATH, metavar="DIR")
@click.argument("what", type=click.Choice(WHAT), nargs=-1, metavar="[WHAT]...")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Folder for the results [DIR/measure].")
@click.option("--wall", "walls", type=int, multiple=True, metavar="ID", help="Pushing wall (wedge, shortening); walls "
              "of wallforce; repeatable [the wall with the largest displacement; all walls].")  # fmt: skip
@click.option("--groups", type=Words(), default="", metavar="A,B", help="Only particles, or elements, of these groups.")
@click.option("--colors", "--colours", type=Words(), default="", metavar="A,B", help="Only particles of these colours, "
              "by name or number.")  # fmt: skip
@click.option("--from", "first", type=click.IntRange(0), metavar="STEP", help="First step [when the pushing wall "
              "starts to move].")  # fmt: skip
@click.option("--to", "last", type=click.IntRange(0), metavar="STEP", help="Last step [the last].")
@click.option("--xmove", type=FINITE, default=0.0, metavar="X", help="Add X [m] to all x [0].")
@click.option("--ymove", type=FINITE, default=0.0, metavar="Y", help="Add Y [m] to all y [0].")
@_length("--width", "W", "Width of the columns of the surface, and of cells for strain, in m [about three radii].")
@click.option("--format", "formats", type=pictures.Formats(FORMATS, none=True), default="png", metavar="LIST",
              help=f"Figures: {', '.join(FORMATS)}, separated by commas, or none [png].")  # fmt: skip
@_length("--strain", "E", "faults: threshold of |strain| [0.5 in sections, 0.2 from frame to frame].")
@_length("--length", "L", "faults: shortest band in m [6 cells].")
@click.option("--skin", type=FINITE, metavar="H", help="faults: ignore the zone within H m of the base and of the "
              "pushing wall [2 cells].")  # fmt: skip
@click.option("--increment", is_flag=True, help="faults: strain from frame to frame even if sections exist.")
@click.option("--over-time", is_flag=True, help="faults: follow each fault through the frames: birth, growth, merging, "
              "slip, throw, heave, offset of horizons.")  # fmt: skip
@click.option("--ids", type=Numbers(), default="", metavar="I,J", help="tracks: particles with these ids.")
@click.option("--near", "points", type=pictures.Numbers(2), multiple=True, metavar="X,Y", help=
    "tracks: the particles nearest to this point (m) in the first frame; repeatable.")  # fmt: skip
@click.option(
    "--number", type=click.IntRange(1), default=1, metavar="N", help="tracks: number of particles per point [1]."
)
@click.option("--log", type=PATH, metavar="FILE", help="cracks: log of the run, which counts tensile and shear "
              "failures.")  # fmt: skip
@click.option("--history", metavar="NAME", help="emission: history plotted with the events, or none [the first "
              "reaction, else the first stress].")  # fmt: skip
@click.option("--bins", type=click.IntRange(1), default=100, metavar="N", help="emission: number of time intervals in "
              "which events are counted [100].")  # fmt: skip
@click.option("--completeness", type=FINITE, metavar="M", help="emission: smallest magnitude used for the b-value [the "
              "most frequent one].")  # fmt: skip
@click.option("--energy", type=click.Choice(("kinetic", "released")), default="kinetic", help="emission: kinetic "
              "energy when a joint breaks, or its growth since the joint's peak [kinetic].")  # fmt: skip
@click.option("--joule", type=POSITIVE, default=1.0, metavar="F", help="emission: J per unit of energy "
              "in the files, thickness of the model included [1].")  # fmt: skip
@click.option("--box", type=pictures.Numbers(6), metavar="X,Y,Z,X,Y,Z", help="regions: elements with their centre in "
              "this box of the mesh, m: minimum x, y, z, maximum x, y, z.")  # fmt: skip
def measure(**options: Any) -> None:
    """Measure the frames in DIR: tables (CSV) and figures of

    \b
    surface    profiles of the surface
    wedge      crest, toe, height, width, slopes and taper
    faults     bands of strain: position, length, dip, vergence
    wallforce  forces on walls against their displacement, and work
    tracks     paths of particles: --ids, --near, all of --groups or --colors, or a sample across the bed
    layers     areas of colours and groups
    cracks     broken bonds or joints, by mode and time, and damage
    fragments  blocks: number, areas, distribution of sizes
    emission   blocks: broken joints as acoustic events: rate, magnitudes, b-value
    fluid      blocks: wet length or area, volume, largest pressure, aperture and velocity; each channel of the last
    regions    blocks in three dimensions: volume, extent, mean stress and strain of groups and of a --box
    displacement  blocks in three dimensions: displacement of their surface
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: what the command does once the ranks are together."""
    from hpcdem.post.measure import report

    report.run(comm, log, request(options))


def request(options: dict[str, Any]) -> Any:
    """Convert the options to a request. Raises UsageError."""
    from hpcdem.core.errors import UsageError
    from hpcdem.lang.zdem.table import COLORS
    from hpcdem.post.measure.scene import Request

    colors = []
    for word in options["colors"]:
        number = COLORS.get(word.lower(), int(word) if word.isdigit() else -1)
        if not 0 <= number <= 9:
            raise UsageError(f"--colors {word}: unknown colour; known: {', '.join(COLORS)}, or 0 to 9")
        colors.append(number)
    if options["last"] is not None and options["last"] < (options["first"] or 0):
        raise UsageError(f"--to {options['last']} is before --from {options['first']}")
    box = options["box"]
    if box is not None and not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
        raise UsageError("--box: give the minimum x, y, z, then the maximum")
    return Request(
        folder=Path(options["folder"]), what=tuple(dict.fromkeys(options["what"])), output=options["output"],
        walls=tuple(dict.fromkeys(options["walls"])), groups=tuple(options["groups"]), colors=tuple(colors),
        first=options["first"], last=options["last"], xmove=options["xmove"], ymove=options["ymove"],
        width=options["width"], formats=tuple(options["formats"]), strain=options["strain"], length=options["length"],
        skin=options["skin"], increment=options["increment"], over_time=options["over_time"],
        ids=tuple(options["ids"]), points=options["points"],
        number=options["number"], log=options["log"], history=options["history"], bins=options["bins"],
        completeness=options["completeness"], released=options["energy"] == "released", joule=options["joule"],
        box=box,
        color_names={number: name for name, number in COLORS.items()},
    )  # fmt: skip
