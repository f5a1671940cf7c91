"""The hydraulic model of joints, table 10 of the manual, whose spelling of apertures is kept."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.properties import JOINT, Model, Property

FLUID = ("fluid_density", "fluid_bulk", "viscosity", "turbulence")
"""Properties of the fluid, the same in all channels."""
MATRIX = ("matrix_permeability", "matrix_porosity_compressibility", "matrix_porosity")
"""Properties that leak-off requires."""
COMPRESSED = "matrix_porosity_compressibility"
NEEDED = ("matrix_permeability", "matrix_porosity")
"""Properties of leak-off that must not be zero, since nothing would leak."""


def _apertures(values: dict[str, Any]) -> None:
    least, most = values["aperature_minumum"], values["aperature_maximum"]
    if np.any(least > most):
        raise CommandError(
            f"aperature_minumum must not be above aperature_maximum ({np.max(most):g} m), got {np.max(least):g}"
        )
    on = np.asarray(values["leak_off"]) > 0.0
    front = np.asarray(values["matrix_saturation"]) < 1.0
    if np.any(front & ~on):
        raise CommandError("matrix_saturation needs leak_off, which is off")
    if np.any(front & (np.asarray(values.get(COMPRESSED, 0.0)) != 0.0)):
        raise CommandError(
            f"{COMPRESSED} has no effect if leak-off fills empty pores: set it to 0, or matrix_saturation to 1"
        )
    if np.all(front):
        values.setdefault(COMPRESSED, np.zeros_like(front, dtype=np.float64))
    for name in (*MATRIX, "matrix_pore_pressure"):
        there = np.asarray(values.get(name, 0.0)) != 0.0
        if np.any(there & ~on):
            raise CommandError(f"{name} needs leak_off, which is off")
        if np.any(on) and ((name in MATRIX and name not in values) or (name in NEEDED and np.any(on & ~there))):
            raise CommandError(f"leak_off needs {name}")
        values.setdefault(name, np.zeros_like(least, dtype=np.float64))
    limited = np.isfinite(values["shear_dilation_limit"])
    if np.any(limited & (np.asarray(values["shear_dilation"]) == 0.0)):
        raise CommandError("shear_dilation_limit needs shear_dilation, which is 0")


POROUS = Model(
    "hydraulic_porous_medium",
    JOINT,
    "channel of a fluid between two plates, whose aperture follows the opening of the joint",
    (
        Property("fluid_density", "kg/m3", "density of the fluid", low_itself=False),
        Property("fluid_bulk", "Pa", "bulk modulus of the fluid", low_itself=False),
        Property("viscosity", "m2/s", "kinematic viscosity of the fluid: the dynamic one over the density",
                 low_itself=False),
        Property("aperature_initial", "m", "hydraulic aperture of a closed joint; in intact joints a virtual aperture, "
                 "which represents the permeability of the rock"),
        Property("aperature_minumum", "m", "smallest hydraulic aperture, of joints in compression",
                 low_itself=False),
        Property("aperature_maximum", "m", "largest hydraulic aperture", math.inf, low_itself=False,
                 otherwise="no limit"),
        Property("leak_off", "1", "broken joints lose fluid to the rock (Carter leak-off)", 0.0, high=1.0),
        Property("matrix_pore_pressure", "Pa", "leak-off: pore pressure of the rock; negative: suction of unsaturated "
                 "rock", low=-math.inf, optional=True, otherwise="0"),
        Property("matrix_permeability", "m2", "leak-off: permeability of the rock", optional=True,
                 otherwise="needed by leak-off"),
        Property("matrix_porosity_compressibility", "1/Pa", "leak-off: compressibility of the pores", optional=True,
                 otherwise="needed by leak-off"),
        Property("matrix_porosity", "1", "leak-off: porosity of the rock", high=1.0, optional=True,
                 otherwise="needed by leak-off"),
        Property("shear_dilation", "degrees", "the aperture grows by the tangent of this angle times the mean slip of "
                 "the joint", 0.0, high=80.0),
        Property("shear_dilation_limit", "m", "largest increase of the aperture by slip", math.inf, low_itself=False,
                 otherwise="no limit"),
        Property("matrix_saturation", "1", "leak-off: initial saturation of the pores; below 1 a sharp front fills the "
                 "rest", 1.0, high=1.0),
        Property("turbulence", "1", "on: fast flow is turbulent, with friction of smooth walls after Blasius; off: "
                 "laminar at any Reynolds number", 0.0, high=1.0),
    ),
    _apertures,
)  # fmt: skip
