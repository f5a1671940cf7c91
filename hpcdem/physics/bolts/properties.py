"""The property of rock bolts, table 19 of the manual. Strengths, forces, stiffness and mass are those of one bolt; the
model divides them by the spacing."""

from __future__ import annotations

import math
from typing import Any

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import BOLT_ELEMENT
from hpcdem.physics.fdem.properties import Model, Property


def _strengths(values: dict[str, Any]) -> None:
    tension, pre = values["tensile_yield_force"], values["pretension_force"]
    if pre > tension:
        raise CommandError(f"pretension_force must not be above tensile_yield_force ({tension:g} N), got {pre:g}")


BOLT = Model(
    "mech_elastic_plastic",
    BOLT_ELEMENT,
    "bar, elastic and perfectly plastic along it, in grout with a frictional limit",
    (
        Property("density", "kg/m3", "density", low_itself=False),
        Property("young", "Pa", "Young's modulus E", low_itself=False),
        Property("diameter", "m", "diameter of the bar", low_itself=False),
        Property("tensile_yield_force", "N", "axial yield force in tension", math.inf, low_itself=False,
                 otherwise="never"),
        Property("compressive_yield_force", "N", "axial yield force in compression, without sign",
                 optional=True, follows="tensile_yield_force", otherwise="the yield force in tension",
                 low_itself=False),
        Property("tension_failure_strain", "1", "elongation of an element since its installation, over its length, at "
                 "which it breaks", math.inf, low_itself=False, otherwise="never"),
        Property("shear_stiffness_rock_bolt", "N/m/m", "force of the grout per length of bolt and displacement"),
        Property("grout_thickness", "m", "thickness of the grout around the bar"),
        Property("cohesion_rock_grout", "Pa", "cohesion between rock and grout"),
        Property("cohesion_grout_bolt", "Pa", "cohesion between grout and bolt"),
        Property("friction_rock_grout", "degrees", "friction angle between rock and grout", 0.0, high=89.0),
        Property("friction_grout_bolt", "degrees", "friction angle between grout and bolt", 0.0, high=89.0),
        Property("spacing", "m", "spacing of bolts across the plane", 1.0, low_itself=False),
        Property("pretension_force", "N", "tension at installation", 0.0),
        Property("damp_factor", "1", "viscous damping of the motion along the bar, part of 2 A sqrt(rho E); without "
                 "effect in static runs", 0.0),
    ),
    _strengths,
)  # fmt: skip
