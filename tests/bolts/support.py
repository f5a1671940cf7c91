"""Bolts in rock that cannot move, or in a block."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import model, rectangle

STEEL = {
    "density": 7850.0, "young": 200e9, "diameter": 0.025, "tensile_yield_force": 250e3,
    "shear_stiffness_rock_bolt": 1e9, "grout_thickness": 0.0125, "cohesion_rock_grout": 1.5e6,
    "cohesion_grout_bolt": 2e6,
}  # fmt: skip


def in_fixed_rock(length: float = 1.0, segments: int = 40, **changes: float) -> tuple[Blocks, Bolts]:
    """A bolt along x from (0, 0.2) in rock that is held everywhere, static mode; changes of STEEL."""
    sim = model(rectangle(6, 2, length, 0.4))
    sim.option(dynamic=False, collision=False)
    sim.move_constraint(None, 1)
    bolts = Bolts.of(sim)
    _, elements = bolts.create([(0.0, 0.2), (length, 0.2)], segments=segments)
    bolts.assign(elements, {**STEEL, **changes})
    return sim, bolts


def head(bolts: Bolts, name: str) -> float:
    """A quantity of the first node."""
    return float(bolts.values("bolt-node", name)[0])


def state(bolts: Bolts) -> dict[str, np.ndarray]:
    """All that there is to know of bolts, to be compared bit by bit."""
    return {
        **{f"node_{name}": values for name, values in bolts.nodes.items()},
        **{f"element_{name}": values for name, values in bolts.elements.items()},
        "work": bolts.work.copy(), "on_rock": bolts._on_rock.copy(),
    }  # fmt: skip
