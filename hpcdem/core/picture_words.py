"""Words about pictures that the language, the command line and the viewer share."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

OBJECTS = (
    "elements", "particles", "clumps", "walls", "contacts", "bonds", "channels", "joints", "bolts", "liners",
    "face-conditions", "flow-nodes", "node-conditions", "faults",
)  # fmt: skip
"""Objects that can be shown, in drawing order."""
HIDDEN = ("clumps", "contacts", "bonds", "face-conditions", "flow-nodes", "node-conditions", "faults")
"""Objects shown only on request."""
COLOURS = {
    "viridis": "viridis",
    "cividis": "cividis",
    "plasma": "plasma",
    "yellow-brown": "YlOrBr",
    "yellow-blue": "YlGnBu",
    "yellow-green": "YlGn",
    "greys": "Greys",
    "blue-red": "RdBu_r",
    "blue-yellow-red": "RdYlBu_r",
    "orange-violet": "PuOr",
    "spectral": "Spectral_r",
    "rainbow": "turbo",
}
"""Colour maps and their names in matplotlib. blue-red and orange-violet, white in the middle, suit values of both
signs. All but yellow-green, spectral and rainbow suit colour-blind readers."""
NUMBERS = {
    "lg": 0, "green": 1, "yellow": 2, "red": 3, "white": 4, "black": 5, "mg": 6, "blue": 7, "gb": 8, "violet": 9,
}  # fmt: skip
"""Names and numbers of the colours of particles (ZDEM manual, chapter 9)."""
EYES = {
    "+x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "+y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0), "-z": (0.0, 0.0, -1.0), "iso": (1.0, -1.0, 1.0),
}  # fmt: skip
"""Named positions of the viewer, as directions from the model; iso: from the right, the front and above."""


class Section(NamedTuple):
    """A plane that cuts a body: a point on it [m], its normal, whether the part on the side of the normal is removed
    (else the part towards the viewer), and whether only the cut is shown."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    sided: bool
    alone: bool = False


def eye_of(text: str) -> tuple[float, float, float]:
    """Parse the direction from the model to the viewer: one of EYES, or three numbers. Raises ValueError."""
    if text in EYES:
        return EYES[text]
    found = _numbers(text)
    if len(found) != 3 or not any(found):
        raise ValueError(f"expected {', '.join(EYES)}, or a direction towards the eye, such as 1,-2,0.5")
    return found[0], found[1], found[2]


def section_of(text: str) -> Section:
    """Parse a plane: x=1.5 (also y, z) removes the part towards the viewer; x<1.5 or x>1.5 states which part remains;
    px,py,pz,nx,ny,nz gives a point and the normal into the removed part. After the word slice only the cut is shown.
    Raises ValueError."""
    before, _, after = text.strip().partition(" ")
    if before == "slice":
        return section_of(after)._replace(alone=True)
    if found := re.fullmatch(r"\s*([xyz])\s*([=<>])\s*(\S+)\s*", text):
        values = _numbers(found[3])
        if len(values) == 1:
            axis, sign = "xyz".index(found[1]), -1.0 if found[2] == ">" else 1.0
            point, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            point[axis], normal[axis] = values[0], sign
            return Section(tuple(point), tuple(normal), found[2] != "=")  # type: ignore[arg-type]
    values = _numbers(text)
    if len(values) != 6 or not any(values[3:]):
        raise ValueError(
            "expected x=1.5, x<1.5 or x>1.5 (y and z too), or a point and a normal, px,py,pz,nx,ny,nz; slice before it "
            "shows the cut alone"
        )
    return Section(tuple(values[:3]), tuple(values[3:]), True)  # type: ignore[arg-type]


def _numbers(text: str) -> list[float]:
    """Parse finite numbers separated by commas; empty if the text has anything else."""
    try:
        found = [float(word) for word in text.split(",")]
    except ValueError:
        return []
    return found if all(map(math.isfinite, found)) else []
