"""The hydraulic model of joints, table 10 of the manual, whose spelling of apertures is kept."""

from __future__ import annotations

import math
from typing import Any

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.properties import JOINT, Model, Property

FLUID = ("fluid_density", "fluid_bulk", "viscosity")
"""Properties of the fluid: the same in all channels."""
MATRIX = ("matrix_permeability", "matrix_porosity_compressibility", "matrix_porosity")
"""What leak-off needs."""


def _apertures(values: dict[str, Any]) -> None:
    least, most = values["aperature_minumum"], values["aperature_maximum"]
    if least > most:
        raise CommandError(f"aperature_minumum must not be above aperature_maximum ({most:g} m), got {least:g}")
    given = [name for name in (*MATRIX, "matrix_pore_pressure") if name in values]
    if values["leak_off"]:
        missing = [name for name in MATRIX if name not in values]
        if missing:
            raise CommandError(f"leak_off needs {missing[0]}")
    elif given:
        raise CommandError(f"{given[0]} goes with leak_off, which is off")
    for name in (*MATRIX, "matrix_pore_pressure"):
        values.setdefault(name, 0.0)


POROUS = Model(
    "hydraulic_porous_medium",
    JOINT,
    "channel of a fluid between two plates, laminar, of an aperture that follows the opening of the joint",
    (
        Property("fluid_density", "kg/m3", "density of the fluid", low_itself=False),
        Property("fluid_bulk", "Pa", "bulk modulus of the fluid", low_itself=False),
        Property("viscosity", "m2/s", "kinematic viscosity of the fluid: the dynamic one over the density",
                 low_itself=False),
        Property("aperature_initial", "m", "hydraulic aperture of a joint that is not opened; of joints that are not "
                 "broken a virtual one, which stands for the permeability of the rock"),
        Property("aperature_minumum", "m", "smallest hydraulic aperture, of joints that are pressed together",
                 low_itself=False),
        Property("aperature_maximum", "m", "largest hydraulic aperture", math.inf, low_itself=False,
                 otherwise="no limit"),
        Property("leak_off", "1", "broken joints lose fluid to the rock after Carter", 0.0, high=1.0),
        Property("matrix_pore_pressure", "Pa", "leak-off: pressure in the pores of the rock", optional=True,
                 otherwise="0"),
        Property("matrix_permeability", "m2", "leak-off: permeability of the rock", optional=True,
                 otherwise="needed by leak-off"),
        Property("matrix_porosity_compressibility", "1/Pa", "leak-off: compressibility of the pores", optional=True,
                 otherwise="needed by leak-off"),
        Property("matrix_porosity", "1", "leak-off: porosity of the rock", high=1.0, optional=True,
                 otherwise="needed by leak-off"),
    ),
    _apertures,
)  # fmt: skip
