"""The thermal models of elements and of fluid in joints, tables 12 and 13 of the manual, whose spelling of coefficients
is kept."""

from __future__ import annotations

import math

from hpcdem.physics.fdem.properties import ELEMENT, JOINT, Model, Property

ISO_HEAT = Model(
    "thermal_iso_heat",
    ELEMENT,
    "conduction after Fourier, and thermal expansion",
    (
        Property("conductivity", "W/(m K)", "thermal conductivity", low_itself=False),
        Property("capacity", "J/(kg K)", "specific heat", low_itself=False),
        Property("transfer_coeficient", "W/(m2 K)", "heat transfer at faces: to a prescribed environment without its "
                 "own coefficient, and between surfaces in contact, with the harmonic mean of both", 0.0),
        Property("expansion_coeficient", "1/K", "linear thermal expansion", 0.0, low=-math.inf),
        Property("conductivity_across", "W/(m K)", "conductivity across the direction of conductivity-angle",
                 optional=True, follows="conductivity", otherwise="conductivity", low_itself=False),
        Property("conductivity_angle", "degrees", "direction of conductivity from x, counter-clockwise, in space the "
                 "strike of its planes; it rotates with the element", 0.0, low=-math.inf),
        Property("friction_heat", "1", "part of the friction work that becomes heat when faces slide: each of the two "
                 "elements absorbs this part of half of the work", 0.0, high=1.0),
        Property("conductivity_dip", "degrees", "dip of the planes of conductivity", 90.0, low=-math.inf, dims=(3,)),
    ),
)  # fmt: skip
FLUID_HEAT = Model(
    "thermal_fluid",
    JOINT,
    "heat in fluid: conduction and advection along channels, exchange with the rock on both sides",
    (
        Property("conductivity", "W/(m K)", "thermal conductivity of the fluid"),
        Property("capacity", "J/(kg K)", "specific heat of the fluid", low_itself=False),
        Property("transfer_coeficient", "W/(m2 K)", "heat transfer between fluid and each of the two sides", 0.0),
        Property(
            "second_order", "1", "advection of second order with a flux limiter: fronts stay sharper", 0.0, high=1.0
        ),
    ),
)
