"""Words about pictures that the language, the command line and the viewer share."""

from __future__ import annotations

OBJECTS = (
    "elements", "particles", "walls", "contacts", "bonds", "channels", "joints", "bolts", "liners",
)  # fmt: skip
"""What can be shown, in the order in which it lies over one another."""
COLOURS = {
    "viridis": "viridis",
    "cividis": "cividis",
    "plasma": "plasma",
    "yellow-brown": "YlOrBr",
    "yellow-blue": "YlGnBu",
    "yellow-green": "YlGn",
    "greys": "Greys",
    "blue-red": "RdBu_r",
    "blue-yellow-red": "RdYlBu_r",
    "orange-violet": "PuOr",
    "spectral": "Spectral_r",
    "rainbow": "turbo",
}
"""Colours of fields, and their names in matplotlib. blue-red and orange-violet, white in their middle, are for values
of both signs. The colour-blind can read all but yellow-green, spectral and rainbow."""
