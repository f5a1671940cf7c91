"""Moisture in the elements of soil: properties, and what it is called."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.properties import ELEMENT, Model, Property
from hpcdem.physics.fields import Kind


def _order(values: dict[str, Any]) -> None:
    residual, saturated = (np.asarray(values[name]) for name in ("moisture_residual", "moisture_saturated"))
    if np.any(residual >= saturated):
        raise CommandError("moisture_residual must be below moisture_saturated")


DIFFUSION = Model(
    "moisture_diffusion",
    ELEMENT,
    "diffusion of moisture from wet to dry: mass flow is proportional to its gradient",
    (
        Property("diffusivity", "m2/s", "diffusivity of moisture", low_itself=False),
        Property("shrinkage", "1", "linear shrinkage, strain over loss of moisture", 0.0),
        Property("evaporation", "kg/(m2 s)", "mass flow through faces over the difference of moisture to a prescribed "
                 "environment without its own coefficient", 0.0),
        Property("moisture_saturated", "1", "moisture at which all pores are full", 0.4, low_itself=False),
        Property("moisture_residual", "1", "residual moisture, which suction cannot remove", 0.0),
        Property("air_entry", "Pa", "suction at which pores begin to drain, 1 / alpha of van Genuchten", 1e4,
                 low_itself=False),
        Property("pore_index", "1", "exponent n of van Genuchten", 1.5, low=1.0, low_itself=False),
    ),
    _order,
)  # fmt: skip
KIND = Kind(
    name="moisture", unit="1", doc="moisture, mass of water over dry mass", amount="kg/m", flux="kg/(m2 s)",
    transfer="kg/(m2 s)", model=DIFFUSION, load="Moisture",
    derived={"suction": ("Pa", "suction at its mean moisture, after van Genuchten")},
)  # fmt: skip
