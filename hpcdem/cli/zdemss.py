"""`zdemss --dir DIR`: pictures of stress and strain from what `hpcdem -s DIR` has computed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import HELP, PATH, POSITIVE, Finite
from hpcdem.cli.pictures import Formats, ManualCommand, Numbers, number, processes
from hpcdem.core.comm import Comm
from hpcdem.core.errors import UsageError
from hpcdem.runtime import launch

if TYPE_CHECKING:
    from hpcdem.runtime.progress import Log

FORMATS = ("jpg", "png", "tiff", "pdf", "svg", "ps")
_MEANT = {word: True for word in ("ON", "TRUE", "YES", "1")} | {word: False for word in ("OFF", "FALSE", "NO", "0")}


class Switch(click.ParamType):
    """ON or OFF in any case, or true or false as zdem2jpg has them; and further words that an option takes."""

    name = "switch"

    def __init__(self, *others: str) -> None:
        self.words = ("ON", "OFF", *others)

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return "/".join(self.words)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, bool):
            return value
        word = str(value).strip().upper()
        if word in _MEANT:
            return _MEANT[word]
        for other in self.words[2:]:
            if word == other.upper():
                return other
        self.fail(f"{value!r} is none of {', '.join(self.words)}", param, ctx)


SWITCH = Switch()


def _switch(name: str, default: str, text: str, *more: str) -> Any:
    return click.option(name, *more, type=SWITCH, default=default, help=f"{text} [{default}].")


def _length(name: str, default: float | None, text: str, shown: str | None = None) -> Any:
    shown = f"{default:g}" if shown is None else shown
    return click.option(name, type=POSITIVE, default=default, metavar="VALUE", help=f"{text} [{shown}].")


def _limits(axis: str) -> Any:
    return click.option(
        f"--{axis}lim", type=Numbers(2), default=None, metavar="FROM,TO",
        help=f"Limits of the {axis} axis (km) [whole model].",
    )  # fmt: skip


def _ends(options: dict[str, Any], axis: str) -> tuple[float | None, float | None]:
    """Begin and end of an axis [m]. Raises UsageError where two options differ."""
    between, last = options[f"{axis}lim"], options[f"{axis}max"]
    if between is None:
        return None, None if last is None else 1000.0 * last
    if last is not None:
        raise UsageError(f"zdemss: give either --{axis}lim or --{axis}max")
    return 1000.0 * between[0], 1000.0 * between[1]


@click.command(
    cls=ManualCommand,
    context_settings=HELP,
    no_args_is_help=True,
    epilog="Run `hpcdem -s DIR` first: it computes the data.",
)
@click.option("-d", "--dir", "folder", type=PATH, required=True, metavar="DIR", help="Folder of the frames.")
@_switch("--addball", "OFF", "Particles were added between the frames")
@_switch("--delball", "OFF", "Particles were removed between the frames")
@_switch("--strainvol", "ON", "Draw volumetric strain")
@click.option(
    "--strainshear", type=Switch("root"), default="ON",
    help="Draw distortional strain as in the figures of the ZDEM manual, the second invariant J2; root: its square "
         "root [ON].",
)  # fmt: skip
@_switch("--stressmean", "ON", "Draw mean stress")
@click.option(
    "--stressshear", type=Switch("half"), default="ON",
    help="Draw shear stress as in the figures of the ZDEM manual, sigma1 - sigma3; half: (sigma1 - sigma3)/2 [ON].",
)  # fmt: skip
@_switch("--sigma1", "OFF", "Draw the largest principal stress as bars over the distortional strain")
@_length("--scale", 1.0, "Length of these bars: gridsize times this where the stress is largest")
@_length("--gridsize", 600.0, "Side of the squares over which they are averaged (m)")
@_switch("--showcolorbar", "ON", "Draw colour bars")
@click.option(
    "--showlable", "--showable", "--showlabel", "labels", type=Switch("abc"), default="ON",
    help="Name the panels; abc: by letters only [ON].",
)  # fmt: skip
@click.option(
    "--straincolormap",
    default="default",
    metavar="FILE",
    help="GMT colour table (CPT) for both strains, or invar, invar2 [default: invar2 for the distortional one].",
)
@_length("--maxstress", 300.0, "Stress at the end of the colour bar (MPa)")
@_length("--xmax", None, "End of the x axis (km)", "whole model")
@_length("--ymax", None, "End of the y axis (km)", "whole model")
@_limits("x")
@_limits("y")
@click.option(
    "--width", type=Finite(5.0, 100.0), default=14.0, metavar="VALUE", help="Width of the pictures (cm) [14]."
)
@click.option(
    "--format", "formats", type=Formats(FORMATS), default="jpg,ps", metavar="LIST",
    help=f"One or more of {', '.join(FORMATS)}, separated by commas [jpg,ps].",
)  # fmt: skip
@number("max_workers", None, "Number of drawing processes [one per core].", POSITIVE)
@click.version_option(launch.version(), "-v", "--version", prog_name="zdemss", message="%(prog)s %(version)s")
def zdemss(**options: object) -> None:
    """Draw stress and strain of the frames in DIR, after `hpcdem -s DIR`.

    Pages as DIR/ss/*.jpg and DIR/ss/ps/*.ps, numbers in DIR/ss/data2ps, grids in DIR/ss/Tmp.
    """


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Draw what the command line requests. Collective. Raises HpcdemError on all ranks."""
    from hpcdem.post.sections import draw, panels

    switches = {
        panels.VOLUMETRIC: "strainvol",
        panels.DISTORTIONAL: "strainshear",
        panels.MEAN: "stressmean",
        panels.SHEAR: "stressshear",
    }
    kinds = tuple(kind for kind in panels.KINDS if kind == panels.DEFORMATION or options[switches[kind]])
    others = {("stressshear", "half"): panels.HALF_SHEAR, ("strainshear", "root"): panels.ROOT}
    for (name, word), other in others.items():
        if options[name] == word:
            kinds = tuple(other if kind.key == other.key else kind for kind in kinds)
    colormap = options["straincolormap"]
    request = draw.Request(
        folder=options["folder"],
        kinds=kinds,
        formats=options["formats"],
        addball=options["addball"],
        delball=options["delball"],
        colorbar=options["showcolorbar"],
        labels={True: "on", False: "off"}.get(options["labels"], "abc"),
        colormap=None if colormap.lower() == "default" else Path(colormap),
        sigma1=(options["gridsize"], options["scale"]) if options["sigma1"] else None,
        width=options["width"],
        x=_ends(options, "x"),
        y=_ends(options, "y"),
        maxstress=options["maxstress"],
    )
    draw.refuse(request)
    draw.draw_folder(request, comm, log, processes(options))
