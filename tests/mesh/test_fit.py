"""Meshes whose faces lie on each other and do not hang together: what is told, and what `mesh glue` makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.fdem.project import joined
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh import fit, structured, structured_space


def lines(*ends: tuple[float, float, int]) -> tuple[np.ndarray, ...]:
    return tuple(np.linspace(a, b, n + 1) for a, b, n in ends)


def block(z0: float, z1: float, nx: int, ny: int, kind: int | str = 6, nz: int = 1, name: str = "a") -> Mesh:
    """A block of the unit square from z0 to z1: hexahedra, or tetrahedra that split boxes into so many."""
    grid = lines((0, 1, nx), (0, 1, ny), (z0, z1, nz))
    return structured_space.hexes(grid, ("s", name)) if kind == "hex" else structured_space.box(grid, kind, ("s", name))


def plate(y0: float, y1: float, nx: int, kind: str = "tri", x0: float = 0.0, x1: float = 1.0, name: str = "a") -> Mesh:
    """The same in the plane."""
    return structured.rectangle(*lines((x0, x1, nx), (y0, y1, 1)), kind, "right", ("s", name))


def one_numbering(mesh: Mesh) -> Mesh:
    """The same mesh in which points in one place are one, as a file may have it."""
    _, first, number = np.unique(np.round(mesh.points, 9), axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    if mesh.dim == 2:
        return Mesh.of(mesh.points[first], np.where(mesh.cells >= 0, number[mesh.cells], -1))
    n = len(mesh.hexes)
    return Mesh.of_hexes(mesh.points[first], number[mesh.hexes[:, :8]], more=number[mesh.cells[6 * n :]])


HALVES = {
    "whole": (block(0, 1, 2, 2), block(1, 2, 2, 2), (0, 0, 0)),
    "halves of the plane": (plate(0, 1, 3), plate(1 + 1e-7, 2, 3, "quad"), (3, 0, 0)),
    "halves": (block(0, 1, 2, 2), block(1 + 1e-7, 2, 2, 2), (8, 0, 0)),
    "hanging, in the plane": (plate(0, 1, 3, "quad"), plate(1, 2, 2), (0, 0, 4)),
    "hanging": (block(0, 1, 1, 1), block(1, 2, 2, 2), (0, 0, 8)),
    "a hexahedron on tetrahedra": (block(0, 1, 2, 2, "hex"), block(1, 2, 2, 2, 5), (4, 4 / 2, 0)),
}


@pytest.mark.parametrize("name", HALVES)
def test_what_does_not_fit_is_counted_with_places(name: str) -> None:
    one, other, (own, cut, parts) = HALVES[name]
    both = joined(one, other)
    found = fit.fit(one_numbering(both) if name == "whole" else both)
    assert found.bodies == (1 if name == "whole" else 2)
    assert (len(found.own), len(found.cut), len(found.parts)) == (own, cut, parts)
    assert all(np.allclose(at[:, -1], 1.0, atol=1e-6) for at in (found.own, found.cut, found.parts))
    assert ("mesh glue" in found.said()) == (name != "whole")
