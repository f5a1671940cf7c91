"""The property of liners: in the plane of a metre of its thickness, in space of a shell."""

from __future__ import annotations

import math
from typing import Any

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import LINER_ELEMENT
from hpcdem.physics.fdem.properties import Model, Property


def _section(values: dict[str, Any]) -> None:
    """Area and second moment from the thickness, the plastic moment of the rectangle from its strengths."""
    thick = values.get("thickness")
    if thick is None and not {"area", "inertia"} <= values.keys():
        raise CommandError(
            "a liner needs its thickness, in the plane or area and inertia of its section (of steel sets)"
        )
    values.setdefault("area", thick)
    values.setdefault("inertia", thick * thick * thick / 12.0 if thick is not None else None)
    values.setdefault("thickness", math.sqrt(12.0 * values["inertia"] / values["area"]))
    tension, pressure = values["tensile_strength"], values["compressive_strength"]
    if math.isinf(tension) != math.isinf(pressure):
        raise CommandError(
            "tensile_strength and compressive_strength of a liner are both required: its moment depends on both"
        )
    if tension == 0.0 and pressure == 0.0:
        raise CommandError("tensile_strength and compressive_strength of a liner are both 0: it would carry nothing")
    if "plastic_moment" in values and math.isinf(tension):
        raise CommandError("plastic_moment needs tensile_strength and compressive_strength, which limit the force")
    whole = "area" in values and thick is not None and values["area"] == thick
    if "plastic_moment" not in values and math.isfinite(tension) and not whole:
        raise CommandError("the strengths of a section with area and inertia need its plastic_moment")
    values.setdefault("plastic_moment", (tension + pressure) * values["thickness"] ** 2 / 8.0)


LINER = Model(
    "beam",
    LINER_ELEMENT,
    "beam, in space flat shell, elastic and perfectly plastic in force and moment, on a bond that breaks and slips",
    (
        Property("density", "kg/m3", "density", low_itself=False),
        Property("young", "Pa", "Young's modulus E", low_itself=False),
        Property("poisson_ratio", "1", "Poisson's ratio: plane strain uses E / (1 - nu^2); 0 for steel sets", 0.0,
                 high=0.4999),
        Property("thickness", "m", "thickness of the shell; defines area and inertia if they are "
                                   "omitted", optional=True,
                 otherwise="thickness of a rectangle of this area and inertia", low_itself=False),
        Property("area", "m2/m", "area of the section over the spacing of steel sets", optional=True,
                 otherwise="the thickness", low_itself=False, dims=(2,)),
        Property("inertia", "m4/m", "second moment of the section over the spacing of steel sets", optional=True,
                 otherwise="thickness^3 / 12", low_itself=False, dims=(2,)),
        Property("tensile_strength", "Pa", "strength in tension; requires compressive_strength", math.inf,
                 otherwise="never"),
        Property("compressive_strength", "Pa", "strength in compression; requires tensile_strength", math.inf,
                 otherwise="never"),
        Property("plastic_moment", "N m/m", "largest moment at the axial force that allows most", optional=True,
                 otherwise="plastic moment of a rectangle", low_itself=False),
        Property("normal_stiffness", "Pa/m", "stiffness of the bond across the face", low_itself=False),
        Property("shear_stiffness", "Pa/m", "stiffness of the bond along the face; 0: it slips freely"),
        Property("bond_tensile_strength", "Pa", "tension at which the bond breaks", math.inf,
                 otherwise="never"),
        Property("bond_cohesion", "Pa", "cohesion of the bond, until it breaks", math.inf, otherwise="never slips"),
        Property("bond_friction", "degrees", "friction angle of the bond, intact or broken", 0.0,
                 high=89.0),
    ),
    _section,
)  # fmt: skip
