"""Small bodies of each kind of element."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, QUAD, TETRAHEDRON, TRIANGLE, Kind
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.reference import deformation
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import rectangle, shaken
from tests.space.support import box, hexes

MESHES: dict[Kind, Callable[[], Mesh]] = {
    TRIANGLE: lambda: shaken(rectangle(2, 2, 1.0, 1.0), 0.2),
    QUAD: lambda: shaken(rectangle(2, 2, 1.0, 1.0, kind="quad"), 0.2),
    TETRAHEDRON: lambda: box((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2),
    HEXAHEDRON: lambda: hexes((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2),
}
SLOW = TRIANGLE, TETRAHEDRON
"""What holds of the kinds of several parts holds of those of one."""
every_kind = pytest.mark.parametrize(
    "kind", [pytest.param(one, id=one.name, marks=[pytest.mark.slow] * (one in SLOW)) for one in MESHES]
)


def block(sim: Blocks, kind: Kind) -> ElementBlock:
    """The elements of this kind; the model is closed."""
    return next(of for of in sim.local.solids.blocks if of.kind is kind)


def move(sim: Blocks, places: np.ndarray) -> None:
    """Nodes go to these places (n, dim)."""
    sim.close_model()
    sim.open_model()
    cells, step = sim.the_mesh().cells[sim.number], 2 if sim.dim == 2 else 4
    for corner in range(4):
        has = cells[:, corner] >= 0
        sim.x[has, step * corner : step * corner + sim.dim] = places[cells[has, corner]]
    if sim.dim == 2:
        from hpcdem.physics.fdem import changes

        changes.repeat(sim, sim.x)
    sim.close_model()


def corners(sim: Blocks, of: ElementBlock, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (k, dim) of an element: in the mesh, and now."""
    tables, kind = of.tables, of.kind
    mesh, x = sim.the_mesh(), tables.x
    if kind is HEXAHEDRON:
        at = tables.place[i].astype(np.int64)
    else:
        at = int(tables.rows[i]) * tables.width + kind.stride * np.arange(kind.corners)
    row, corner = np.divmod(at, tables.width)
    points = mesh.points[mesh.cells[sim.number[row], corner // kind.stride]]
    return points, x[at[:, None] + np.arange(kind.dim)]


def strains(sim: Blocks, of: ElementBlock, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Strains (parts, 3, 3) of an element, plainly: each part's, with the trace of its overlay the mean by volume; and
    the volumes (parts,) of parts."""
    kind, small = of.kind, not sim.options.large_strain
    points, now = corners(sim, of, i)
    found: list[Any] = [deformation(points[list(p)], now[list(p)], np.zeros((kind.dim + 1, kind.dim)), small)
                        for p in kind.parts]  # fmt: skip
    factor = 2.0 if kind.dim == 2 else 6.0
    volumes = np.array([np.linalg.det(points[list(p)][1:] - points[p[0]]) / factor for p in kind.parts])
    out = np.zeros((len(found), 3, 3))
    for first in range(0, len(found), kind.each):
        some = range(first, first + kind.each)
        mean = np.average([np.trace(found[p].strain) for p in some], weights=volumes[list(some)])
        for p in some:
            e = found[p].strain
            out[p, : kind.dim, : kind.dim] = e + (mean - np.trace(e)) / kind.dim * np.eye(kind.dim)
    return out, volumes


def tensor(kind: Kind, components: np.ndarray) -> np.ndarray:
    """(3, 3) of the components 11, 22, 12, 33, in space 13, 23."""
    s11, s22, s12, s33, s13, s23 = [*components[: len(kind.components)], 0.0, 0.0][:6]
    return np.array([[s11, s12, s13], [s12, s22, s23], [s13, s23, s33]])


def components(kind: Kind, matrix: np.ndarray) -> np.ndarray:
    """The inverse, in a row of stresses of a part."""
    row = np.zeros(kind.stresses)
    row[:4] = matrix[0, 0], matrix[1, 1], matrix[0, 1], matrix[2, 2]
    if kind.dim == 3:
        row[4:6] = matrix[0, 2], matrix[1, 2]
    return row


def shared(kind: Kind, stress: np.ndarray, volumes: np.ndarray) -> None:
    """The parts of each overlay get the mean of their pressures by volume."""
    normal = list(kind.normal)
    for first in range(0, len(kind.parts), kind.each):
        some = slice(first, first + kind.each)
        pressure = stress[some][:, normal].mean(axis=1)
        stress[some][:, normal] += (np.average(pressure, weights=volumes[some]) - pressure)[:, None]
