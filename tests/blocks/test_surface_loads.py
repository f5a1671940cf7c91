"""Surface loads of other physics: a list, added in one order whoever came first."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.surface_loads import ORDER, SurfaceLoad, SurfaceLoads
from tests.blocks.support import model, rectangle


class Push(SurfaceLoad):
    """A force [N/m] on each corner of some elements, from the left end of the model."""

    def __init__(self, blocks: Blocks, name: str, elements: np.ndarray, force: float) -> None:
        self.blocks, self.name, self.elements, self.force = blocks, name, elements, force
        self.calls: list[str] = []

    def corners(self, blocks: Any) -> np.ndarray:
        number = blocks.number[blocks.owned]
        return np.isin(number, self.elements)[:, None] & (blocks.the_mesh().cells[number] >= 0)

    def add_to(self, applied: np.ndarray) -> None:
        rows = self.blocks.where[self.elements]
        applied[rows[:, None], [0, 2, 4]] += self.force

    def storage_rebuilt(self) -> None:
        self.calls.append("storage")

    def mesh_replaced(self) -> None:
        self.calls.append("mesh")


MESH = rectangle(6, 2, 3.0, 1.0)
SOME = np.array([2, 5, 9])


def pushed(*loads: tuple[str, np.ndarray, float], steps: int = 40) -> tuple[np.ndarray, list[Push]]:
    """Velocities after some steps, and the loads."""
    blocks = model(MESH)
    blocks.time_step(value=1e-5)
    made = [Push(blocks, *load) for load in loads]
    for load in made:
        blocks.surface_loads.add(load)
    for _ in range(steps):
        blocks.step()
    return blocks.v[blocks.owned].copy(), made


def test_forces_act_and_add_up_in_one_order() -> None:
    """Momentum is the impulse of all forces; who came first changes no bit, and each load changes the outcome."""
    discs, fluid, heat = ("discs", SOME, 1e5), ("fluid", SOME + 4, 0.1e5 / 3.0), ("heat", SOME, 0.7e5)
    one, _ = pushed(discs, fluid, heat)
    other, _ = pushed(heat, discs, fluid)
    assert np.array_equal(one, other)
    for fewer in ((discs, fluid), (discs, heat), (fluid, heat)):
        assert not np.array_equal(pushed(*fewer)[0], one)
    blocks = model(MESH)
    blocks.time_step(value=1e-5)
    blocks.surface_loads.add(Push(blocks, *discs))
    for _ in range(40):
        blocks.step()
    mass = 2700.0 * MESH.areas() / 3.0
    number, v = blocks.number[blocks.owned], blocks.v[blocks.owned]
    momentum = (mass[number, None] * v[:, [0, 2, 4]]).sum()
    assert momentum == pytest.approx(9 * 1e5 * 40 * 1e-5, rel=1e-9)


def test_loads_hear_of_new_storage_and_new_meshes() -> None:
    blocks = model(MESH)
    load = Push(blocks, "fluid", SOME, 0.0)
    blocks.surface_loads.add(load)
    blocks.step()
    assert load.calls == ["storage"]
    blocks.rebuild()
    assert load.calls == ["storage", "storage"]
    blocks.take_mesh(rectangle(1, 1, 1.0, 1.0))
    assert load.calls[-1] == "mesh"
    blocks.surface_loads.remove(load)
    assert not blocks.surface_loads and "fluid" not in blocks.surface_loads


def test_one_of_each_kind() -> None:
    loads = SurfaceLoads()
    blocks = model(MESH)
    for name in reversed(ORDER):
        loads.add(Push(blocks, name, SOME, 1.0))
    with pytest.raises(CommandError, match="these blocks have a surface load of fluid already"):
        loads.add(Push(blocks, "fluid", SOME, 1.0))
