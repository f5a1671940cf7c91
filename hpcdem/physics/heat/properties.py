"""The thermal model of elements, table 12 of the manual, whose spelling of coefficients is kept, and what is prescribed
on faces, table 16."""

from __future__ import annotations

import math

from hpcdem.physics.fdem.properties import ELEMENT, Model, Property

ISO_HEAT = Model(
    "thermal_iso_heat",
    ELEMENT,
    "conduction after Fourier, and thermal expansion",
    (
        Property("conductivity", "W/(m K)", "thermal conductivity", low_itself=False),
        Property("capacity", "J/(kg K)", "specific heat", low_itself=False),
        Property("transfer_coeficient", "W/(m2 K)", "heat transfer at faces: to an environment that is prescribed on "
                 "them without a coefficient of its own", 0.0),
        Property("expansion_coeficient", "1/K", "linear thermal expansion", 0.0, low=-math.inf),
        Property("conductivity_across", "W/(m K)", "conductivity across the direction of conductivity-angle",
                 optional=True, follows="conductivity", otherwise="conductivity", low_itself=False),
        Property("conductivity_angle", "degrees", "direction of conductivity from x, counter-clockwise; it turns with "
                 "the element", 0.0, low=-math.inf),
    ),
)  # fmt: skip
