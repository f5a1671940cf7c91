"""Rock that cracks: the parameters of its elements and joints, and the lines that several cases share."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from hpcdem.cases.base import Case, quantity

MOST = 5e6
"""Largest number of elements; more are probably a mistake."""


def _whole(given: Any) -> Any:
    """Words of a command line are texts."""
    return int(given) if isinstance(given, str) and given.isdigit() else given


Dimensions = Annotated[Literal[2, 3], BeforeValidator(_whole)]
"""Dimensions of space."""


class Rock(Case):
    """Parameters of an elastic rock with a cohesive joint on every inner edge."""

    size: float = quantity(0.002, "m", "edges of the elements", gt=0)
    density: float = quantity(2700.0, "kg/m3", "density", gt=0)
    young: float = quantity(30e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    damping: float = quantity(0.3, "1", "viscous damping of the elements, part of the critical", ge=0, le=1)
    friction: float = quantity(30.0, "degrees", "friction angle of joints and cracks", ge=0, lt=90)
    cohesion: float = quantity(10e6, "Pa", "cohesion of the joints", gt=0)
    tensile_strength: float = quantity(2e6, "Pa", "tensile strength of the joints", gt=0)
    gf1: float = quantity(20.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(200.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    penalty: float = quantity(10.0, "1", "penalty of opening and sliding joints, over young", gt=0)
    penalty_overlay: float = quantity(100.0, "1", "penalty of closed joints, over young", gt=0)

    def not_too_many(self, area: float, thickness: float | None = None) -> None:
        """Raise ValueError if `size` makes too many elements of an area [m2], in space of this thickness [m]."""
        if thickness is None:
            number = area / (math.sqrt(3.0) / 4.0 * self.size**2)
        else:
            number = area * thickness * 6.0 * math.sqrt(2.0) / self.size**3
        if number > MOST:
            raise ValueError(f"size is {self.size:g}, which makes {number:.2g} elements: expected at most {MOST:.0e}")


ELASTIC = """
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson] damp-factor [damping]
"""
"""The model of all elements."""

JOINTS = """\
pcdc face-joint c-model c-i-c-i property friction [friction] cohesion [cohesion] tensile-strength [tensile_strength] \\
    gf1 [gf1] gf2 [gf2] penalty-normal [penalty*young] penalty-shear [penalty*young] \\
    penalty-overlay [penalty_overlay*young] range face-of 'rock' set 'body'
"""
"""Joints between the elements of group 'rock' set 'body'."""

SURFACES = """\
# A low penalty lets the time step be large; broken joints keep their stiffness in any case.
pcdc element-face c-model contact-m-c property friction [friction] penalty-normal [2*young] penalty-shear [2*young]
"""
"""Contact of all surfaces."""

PROPERTIES = ELASTIC + JOINTS + SURFACES

WAVES = """
# Waves: how long one needs through the specimen says how fast it is loaded.
speed_of_waves = math.sqrt(young * (1 - poisson) / (density * (1 + poisson) * (1 - 2 * poisson)))
"""
"""Time scale of waves. speed_of_waves: of pressure waves [m/s]."""

CRACKS = """
state, mode = pcdc.values('joint', 'state'), pcdc.values('joint', 'mode')
broken = state == 3                              # mode: from 1, opened, to 2, slid
tension = int((broken & (mode < 4/3)).sum())
shear = int((broken & (mode >= 5/3)).sum())
mixed = int(broken.sum()) - tension - shear
energy_error = pcdc.energies['relative']         # of the energy budget, part of its largest flow
"""
"""tension, mixed, shear: broken joints by mode; energy_error."""


def in_space(text: str) -> str:
    """Return the text for three dimensions, where charts do not show the model."""
    return text.replace(".png' cracks\n", ".png'\n")
