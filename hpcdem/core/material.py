"""Properties of discs, each declared once.

PROP and INI of the language, their Python forms, their checks, the table that kernels read, checkpoints and columns of
frames follow from this table.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, TypedDict, get_type_hints

from hpcdem.core.errors import CommandError
from hpcdem.core.limits import LARGEST

Value = float | None


class Property(NamedTuple):
    """unit: as shown; values lie in [low, high], with `above` not at low itself; longest: the longest form of the
    word; source: of the option, see `lang.zdem.table`; in_frames: whether it is a column of frames; noun: in errors."""

    text: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    default: str = ""
    longest: str = ""
    source: str = "R"
    in_frames: bool = True
    noun: str = "a number"

    @property
    def range(self) -> str:
        """Describe the range of values in words."""
        if self.low == -math.inf:
            return self.noun
        if self.high == math.inf:
            return f"{self.noun} {'above' if self.above else 'not below'} {self.low:g}"
        return f"{self.noun} {f'above {self.low:g}, at most' if self.above else f'from {self.low:g} to'} {self.high:g}"

    def allows(self, value: float) -> bool:
        """Return whether the property may have this value."""
        return self.low <= value <= self.high and not (self.above and value == self.low)


class Material(TypedDict, total=False):
    """Properties of discs, by their words."""

    density: Annotated[Value, Property(
        "density; per area unless SET disk off", "kg/m3 or kg/m2", low=0.0, above=True
    )]  # fmt: skip
    fric: Annotated[Value, Property("friction coefficient", low=0.0, default="0", longest="friction")]
    shear: Annotated[Value, Property("shear modulus G of the Hertz-Mindlin contact", "Pa", low=0.0, above=True)]
    poiss: Annotated[Value, Property(
        "Poisson ratio of the Hertz-Mindlin contact", low=-1.0, high=0.5, above=True, longest="poisson",
        noun="a Poisson ratio",
    )]  # fmt: skip
    damp: Annotated[Value, Property(
        "local damping: fraction of the force that acts against the motion", low=0.0, high=1.0, default="0"
    )]  # fmt: skip
    kn: Annotated[Value, Property("normal stiffness of the linear contact", "N/m", low=0.0)]
    ks: Annotated[Value, Property("shear stiffness of the linear contact", "N/m", low=0.0)]
    rfric: Annotated[Value, Property(
        "coefficient of rolling resistance: the torque is at most this times rolling radius and normal force", low=0.0,
        high=10.0, default="0", source="X", in_frames=False,
    )]  # fmt: skip
    rdamp: Annotated[Value, Property(
        "rolling dashpot over the critical one (SET rolling c)", low=0.0, default="0", source="X", in_frames=False,
    )]  # fmt: skip
    xp: Annotated[Value, Property(
        "pressure on each particle along x: force = pressure 2 R thickness (SET thickness), until "
        "changed", "Pa", default="0", source="P", in_frames=False,
    )]  # fmt: skip
    yp: Annotated[Value, Property("pressure on each particle along y", "Pa", default="0", source="P", in_frames=False)]


PROPERTIES: Mapping[str, Property] = {
    name: hint.__metadata__[0] for name, hint in get_type_hints(Material, include_extras=True).items()
}


def checked(given: Mapping[str, Any]) -> dict[str, float]:
    """Return the given properties after checking their ranges."""
    values = {name: value for name, value in given.items() if value is not None}
    for name, value in values.items():
        if name not in PROPERTIES:
            raise CommandError(f"unknown property {name!r}; known: {', '.join(PROPERTIES)}")
        if not PROPERTIES[name].allows(value):
            raise CommandError(f"{name} must be {PROPERTIES[name].range}, got {value:g}")
        if abs(value) > LARGEST:
            raise CommandError(f"{name} must be at most {LARGEST:g}, got {value:g}")
    return values
