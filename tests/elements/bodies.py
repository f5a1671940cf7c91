"""Bodies of one kind of element each, in which the same can be asked of all kinds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.elements import kind as kinds
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from tests.blocks.support import rectangle, shaken
from tests.space.support import box, hexes

NAMES = tuple(kind.name for kind in kinds.KINDS if kind is not kinds.SIX_NODE_TRIANGLE)  # those are elastic
QUICK = ("triangle", "hexahedron")
KINDS = [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in NAMES]
"""Two of them, which have nothing in common, in each run, all of them in the slow one."""
MOHR_COULOMB = "mech_mohr_coulomb"
SOIL = {
    "density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "dilation": 10.0, "cohesion": 3.45e6,
    "tensile": 1e6,
}  # fmt: skip


def mesh_of(name: str) -> Mesh:
    """A unit square or cube of elements of all shapes."""
    return {
        "triangle": lambda: shaken(rectangle(3, 3, 1.0, 1.0, kind="cross"), 0.2),
        "quad": lambda: shaken(rectangle(3, 3, 1.0, 1.0, kind="quad"), 0.2),
        "tetrahedron": lambda: box((2, 2, 2), (1.0, 1.0, 1.0), 5, shaken=0.2),
        "hexahedron": lambda: hexes((2, 2, 2), (1.0, 1.0, 1.0), 0.2),
    }[name]()


def body(name: str, law: str = MOHR_COULOMB, **properties: object) -> Blocks:
    """At rest, in static mode, without contact; properties that are lists are tables over plastic strain."""
    sim = Blocks(SerialComm())
    sim.take_mesh(mesh_of(name))
    for key, value in properties.items():
        if isinstance(value, list):
            sim.table(key, value)
            properties[key] = Over(key, PLASTIC_STRAIN)
    changes.element_model(sim, None, law, {**SOIL, **properties} if law == MOHR_COULOMB else properties)
    sim.option(dynamic=False, collision=False)
    return sim


def place(sim: Blocks, points: np.ndarray) -> None:
    """All corners of a closed model go where these points (np, dim) are."""
    cells, stride = sim.mesh.cells[sim.number], sim.stride
    for k in range(sim.corners):
        at = cells[:, k] >= 0
        sim.x[at, stride * k : stride * k + sim.dim] = points[cells[at, k]]
    if sim.dim == 2:
        changes.repeat(sim, sim.x)


def deform(sim: Blocks, gradient: np.ndarray) -> None:
    """All nodes go to their places in the mesh times this deformation gradient (3, 3), and elements flow there once."""
    sim.velocity_condition(None, **{f"v{axis}": 0.0 for axis in "xyz"[: sim.dim]})
    sim.open_model()
    place(sim, sim.mesh.points @ np.asarray(gradient)[: sim.dim, : sim.dim].T)
    sim.step()


def matrices(sim: Blocks) -> np.ndarray:
    """Stresses (ne, 3, 3) [Pa]."""
    of = {c: diagnostics.values(sim, f"stress_{c}") for c in ("xx", "yy", "xy", "zz")}
    none = np.zeros_like(of["xx"])
    xz, yz = (diagnostics.values(sim, f"stress_{c}") if sim.dim == 3 else none for c in ("xz", "yz"))
    rows = [of["xx"], of["xy"], xz, of["xy"], of["yy"], yz, xz, yz, of["zz"]]
    return np.array(rows).T.reshape(-1, 3, 3)


def steepness(degrees: float) -> float:
    """N of an angle."""
    return math.tan(math.pi / 4.0 + 0.5 * math.radians(degrees)) ** 2
