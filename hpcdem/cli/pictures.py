"""Options that zdem2jpg and `hpcdem movie` share, read as the manual writes them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import FINITE, POSITIVE, Finite
from hpcdem.runtime import launch

if TYPE_CHECKING:
    from hpcdem.io.axes import View
    from hpcdem.post.plots import Style

_NUMBER = re.compile(r"-\.?\d")


class ManualCommand(click.Command):
    """A command that also reads `--dir= ./data` (a blank after the sign), `-bondplot=true` (one dash) and a lone `--`
    where a line of the manual breaks."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        names = {name for parameter in self.params for name in parameter.opts if name.startswith("--")}
        return super().parse_args(ctx, as_usual(args, names))


class Formats(click.ParamType):
    """Words of `known` with commas between them, or `none` if that can be; eps is ps, jpeg is jpg, tif is tiff."""

    name = "formats"

    def __init__(self, known: Sequence[str], none: bool = False) -> None:
        self.known, self.none = tuple(known), none

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        words = str(value).lower().replace(" ", "").replace(".", "").split(",")
        words = [{"eps": "ps", "jpeg": "jpg", "tif": "tiff"}.get(word, word) for word in words]
        if self.none and words == ["none"]:
            return ()
        for word in words:
            if word not in self.known:
                known = ", ".join(self.known) + ", or none" * self.none
                self.fail(f"{word!r} is not a picture format; expected one or more of {known}", param, ctx)
        return tuple(dict.fromkeys(words))


class Numbers(click.ParamType):
    """A fixed number of numbers separated by commas, or one of `words`."""

    name = "numbers"

    def __init__(self, count: int, *words: str) -> None:
        self.count, self.words = count, words

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple) or value in self.words:
            return value
        try:
            found = tuple(FINITE.convert(word, param, ctx) for word in str(value).split(","))
        except click.BadParameter:
            found = ()
        if len(found) != self.count:
            also = "".join(f", or {word}" for word in self.words)
            self.fail(f"{value!r}: expected {self.count} numbers separated by commas{also}", param, ctx)
        return found


def as_usual(words: Sequence[str], names: set[str]) -> list[str]:
    """The words of a command line, with the manual's ways of writing options turned into the usual ones."""
    result: list[str] = []
    rest = [word for word in words if word != "--"]
    while rest:
        word = rest.pop(0)
        if word.startswith("-") and not word.startswith("--") and f"-{word.partition('=')[0]}" in names:
            word = f"-{word}"
        if word.startswith("--") and word.endswith("=") and rest:
            if not rest[0].startswith("-") or _NUMBER.match(rest[0]):
                word += rest.pop(0)
        result.append(word)
    return result


def number(name: str, default: float | None, text: str, kind: Finite = FINITE) -> Callable[..., Any]:
    """An option that takes a number."""
    return click.option(f"--{name}", name, type=kind, default=default, metavar="N", help=text)


def yes_no(name: str, default: bool, text: str) -> Callable[..., Any]:
    """An option that takes true or false."""
    word = "true" if default else "false"
    return click.option(f"--{name}", name, type=bool, default=default, metavar="BOOL", help=f"{text} [{word}].")


OPTIONS = (
    number("xmin", None, "Left end of the picture, m [0]."),
    number("xmax", None, "Right end, m [the model's]."),
    number("ymin", None, "Lower end, m [0]."),
    number("ymax", None, "Upper end, m [the model's]."),
    number("xmove", 0.0, "Move the model along x, m [0]."),
    number("ymove", 0.0, "Move the model along y, m [0]."),
    number("major_locator", None, "Step of ticks with numbers, m [10000, or suited to the model].", POSITIVE),
    number("minor_locator", None, "Step of ticks without numbers, m [1000, or suited to the model].", POSITIVE),
    number("fontsize", 9.0, "Size of the numbers, points [9].", POSITIVE),
    number("linewidth", 0.8, "Width of lines, points [0.8].", POSITIVE),
    yes_no("leftshow", True, "Left line of the frame"),
    yes_no("rightshow", True, "Right line of the frame"),
    yes_no("bottomshow", True, "Lower line of the frame"),
    yes_no("topshow", True, "Upper line of the frame"),
    yes_no("wallshow", True, "Walls"),
    yes_no("surfaceshow", True, "Line along the surface of the model"),
    yes_no("ballplot", True, "Particles"),
    yes_no("bondplot", False, "Contacts: black not bonded, red bonded in tension, blue bonded in compression"),
    click.option("--colormap", metavar="FILE", help="File with ten lines of red, green, blue; searched in this folder, "
    "in DIR and in the home folder."),
    click.option(
        "--showlable", "--showlabel", "--showable", "showlable", default="false", metavar="BOOL|TEXT",
        help="Show the step, or this text, in the corner [false].",
    ),
)  # fmt: skip
"""Options for the appearance of pictures."""


def appearance(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of a picture."""
    for option in reversed(OPTIONS):
        function = option(function)
    return function


def processes(options: dict[str, Any]) -> int:
    """Number of drawing processes."""
    return launch.cores() if options["max_workers"] is None else max(1, int(options["max_workers"]))


def style_of(options: dict[str, Any], folder: Path, page: float, dpi: float) -> Style:
    """The style that the options ask for. Raises HpcdemError for a colour file that is not there or not right."""
    from hpcdem.core.errors import UsageError
    from hpcdem.io import colours
    from hpcdem.post.layers import Appearance
    from hpcdem.post.plots import SIDES, Style

    layers = {"ballplot": "bfill", "bondplot": "bondplot", "surfaceshow": "surface", "wallshow": "wall"}
    limits = dict(zip(SIDES, (options[name] for name in ("xmin", "xmax", "ymin", "ymax"))))
    for axis in "xy":
        low, high = options[f"{axis}min"], options[f"{axis}max"]
        if low is not None and high is not None and high <= low:
            raise UsageError(f"--{axis}max={high:g} is not above --{axis}min={low:g}")
    major, minor = options["major_locator"], options["minor_locator"]
    if major is not None and minor is not None and minor > major:
        raise UsageError(f"--minor_locator={minor:g} is larger than --major_locator={major:g}")
    palette = colours.RGB
    if options["colormap"]:
        palette = colours.read_palette(colours.find_palette(options["colormap"].strip(), folder))
    label = {"false": None, "off": None, "no": None, "true": "step {step}", "on": "step {step}", "yes": "step {step}"}
    return Style(
        what=tuple(word for name, word in layers.items() if options[name]),
        page=page,
        font=options["fontsize"],
        dpi=dpi,
        frame_line=options["linewidth"],
        appearance=Appearance(palette, options["linewidth"]),
        sides=frozenset(side for side in SIDES if options[f"{side}show"]),
        move=(options["xmove"], options["ymove"]),
        limits={side: value for side, value in limits.items() if value is not None},
        from_zero=True,
        major=major,
        minor=minor,
        usual_ticks=True,
        title=label.get(options["showlable"].lower(), options["showlable"]),
    )


def common_view(files: Sequence[Path], style: Style) -> View:
    """Return one view that contains the views of all these frames."""
    from hpcdem.io.axes import View
    from hpcdem.io.frames import read_frame
    from hpcdem.post.plots import seen_of

    seen = [seen_of(read_frame(file, ("particles",)), style) for file in files]
    return View(
        min(v.left for v in seen), max(v.right for v in seen), min(v.bottom for v in seen), max(v.top for v in seen)
    )
