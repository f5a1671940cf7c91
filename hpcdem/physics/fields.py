"""Fields that diffuse in the elements of blocks beside heat: which there are.

A field is a folder physics/NAME with `KIND` in properties.py, which says what commands, both languages, frames and
histories need, and a subclass of `field.diffusing.Diffusing` in model.py, which says how it flows. physics/moisture is
the worked example.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hpcdem.physics.fdem.properties import Model

FIELDS = ("moisture",)
"""Their folders."""


@dataclass(frozen=True)
class Kind:
    """Names of a field: name of its quantity at nodes, of mean_NAME of elements, of its conditions in scripts; unit and
    doc of these. amount, flux, transfer: units of its content per metre of thickness, of what passes through faces, and
    of that per difference. load: name of its class in model.py; derived: unit and doc of quantities of elements that
    its methods of these names give."""

    name: str
    unit: str
    doc: str
    amount: str
    flux: str
    transfer: str
    model: Model
    load: str
    derived: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def word(self) -> str:
        """Name of its model in scripts."""
        return self.model.name.replace("_", "-")

    @property
    def on_nodes(self) -> str:
        """The condition of nodes in scripts."""
        return f"{self.name}-boundary-condition"

    @property
    def on_faces(self) -> str:
        """The condition of faces in scripts."""
        return f"{self.name}-flux-boundary-condition"

    def load_type(self) -> type[Any]:
        """Import its class, with numba and kernels."""
        return getattr(importlib.import_module(f"hpcdem.physics.{self.name}.model"), self.load)


@functools.cache
def kinds() -> dict[str, Kind]:
    """Return all kinds of fields, by name."""
    found = (importlib.import_module(f"hpcdem.physics.{name}.properties").KIND for name in FIELDS)
    return {kind.name: kind for kind in found}
