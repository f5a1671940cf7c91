"""The moisture of soil: the flow of its mass is proportional to its gradient (manual, 7.8), the faster the denser the
dry soil, as moisture is the mass of water over that of dry soil. Soil that dries shrinks; its suction is that of van
Genuchten (1980). Strengths and moduli follow it by tables over moisture."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.by_temperature import means
from hpcdem.physics.field.diffusing import Diffusing
from hpcdem.physics.moisture.properties import DIFFUSION


class Moisture(Diffusing):
    """The moisture of a model of blocks [1], its content [kg/m], in space [kg]."""

    name: ClassVar[str] = "moisture"
    quantity: ClassVar[str] = "moisture"
    kernel_kind: ClassVar[str] = "heat"
    unstressed: ClassVar[str] = "moisture_unstressed"
    word: ClassVar[str] = "moisture"
    model = DIFFUSION
    kind_of_model: ClassVar[str] = "moisture"
    expansion: ClassVar[str] = "shrinkage"

    def _capacities(self) -> np.ndarray:
        return np.array([0.0, *np.ones(len(self.rows))])

    def _conductivities(self, elements: np.ndarray) -> np.ndarray:
        blocks = self.blocks
        density = blocks.element_rows.column("density")[blocks.element_row[elements]]
        k = self.column("diffusivity")[self.row[elements]] * density
        nothing = np.zeros_like(k)
        return np.column_stack([k, k, nothing, k, nothing, nothing])

    @property
    def _transfers(self) -> np.ndarray:
        return self.column("evaporation")[self.row]

    def _check_values(self, values: np.ndarray, what: str) -> None:
        super()._check_values(values, what)
        if values.min() < 0.0:
            raise CommandError(f"{what} must not be negative, got {values.min():g}")

    def suction(self) -> np.ndarray:
        """Compute the suction of owned elements (n_own,) [Pa] at their mean moisture, 0 if saturated. The model is
        closed. Not collective."""
        row = self.row[self.blocks.number[self.blocks.owned]]
        names = ("moisture_residual", "moisture_saturated", "air_entry", "pore_index")
        least, most, entry, n = (self.column(name)[row] for name in names)
        part = np.clip((means(self.blocks, self.quantity) - least) / (most - least), 1e-12, 1.0)
        return np.asarray(entry * (part ** (n / (1.0 - n)) - 1.0) ** (1.0 / n))
