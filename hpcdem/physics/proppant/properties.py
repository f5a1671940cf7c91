"""The proppant of channels, table 17 of the manual beside the properties of the fluid (flow/properties.py)."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.properties import JOINT, Model, Property
from hpcdem.physics.flow.properties import POROUS


def _limits(values: dict[str, Any]) -> None:
    power = np.asarray(values["viscosity_power"])
    if np.any((power < -3.0) | (power > -1.0)):
        raise CommandError(f"viscosity_power must lie between -3 and -1, got {power.flat[0]:g}")


PROPPANT = Model(
    "hydraulic_porous_proppant_medium",
    JOINT,
    "grains in the fluid of channels, the same in all channels",
    (
        Property("proppant_density", "kg/m3", "density of the grains", low_itself=False),
        Property("proppant_size", "m", "diameter of the grains", low_itself=False),
        Property("proppant_size_factor", "1", "smallest aperture, in diameters of grains: grains bridge in narrower "
                                              "channels", 3.0),
        Property("aperature_factor", "1", "hydraulic aperture of a pack over that of the channel; 0: Kozeny–Carman "
                 "permeability of the pack", 0.0, high=1.0),
        Property("proppant_concentration_limit", "1", "concentration of a pack", low_itself=False, high=0.74),
        Property("proppant_modulus", "Pa", "modulus of a pack in compression; 0: it carries no load", 0.0),
        Property("viscosity_power", "1", "beta of the slurry, whose viscosity is that of the fluid times "
                 "(1 - C / limit)^beta", -2.5, low=-3.0),
        Property("proppant_stokes", "1", "on: settling after Stokes; off: after Schiller and Naumann, for any Reynolds "
                 "number", 0.0, high=1.0),
    ),
    _limits,
)  # fmt: skip


def _both(values: dict[str, Any]) -> None:
    POROUS.derive(values)
    PROPPANT.derive(values)


MEDIUM = Model(
    PROPPANT.name, JOINT, "channel of a fluid with grains in it", (*POROUS.properties, *PROPPANT.properties), _both
)
"""Both models, with the words of the language."""
NAMES = tuple(one.name for one in PROPPANT.properties)


def split(given: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Properties of the fluid, and those of the proppant."""
    return (
        {name: value for name, value in given.items() if POROUS.has(name)},
        {name: value for name, value in given.items() if PROPPANT.has(name)},
    )
