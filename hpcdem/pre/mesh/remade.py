"""A mesh that was changed before its first step, and where all parts of the one before are in it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh


@dataclass(frozen=True)
class Remade:
    """mesh; points (np,): the number in it of each point before, -1 where it is gone; parent (ne,): element before of
    which each is a piece."""

    mesh: Mesh
    points: np.ndarray
    parent: np.ndarray
    moved: Moved


@dataclass(frozen=True)
class Moved:
    """Map from faces before a change of the mesh to faces after it, by their points, see `faces`."""

    points: np.ndarray
    """(np,) present number of each point of the old mesh, -1 where it was removed."""
    quads: dict[tuple[int, ...], list[tuple[int, ...]]] = field(default_factory=dict)
    """Halves of sides of hexahedra that are now cut along the other diagonal."""
    pieces: dict[tuple[int, ...], list[tuple[int, ...]]] = field(default_factory=dict)
    """Pieces of faces that were cut."""

    def faces(self, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (m, dim) of the pieces of these faces (n, dim), and the row of the face each comes from; none of faces
        with a point that is gone."""
        out: list[tuple[int, ...]] = []
        rows: list[int] = []
        for k, face in enumerate(np.sort(self.points[before], axis=1).tolist()):
            if face[0] < 0:
                continue
            for half in self.quads.get(tuple(face), [tuple(face)]):
                found = self.pieces.get(half, [half])
                out += found
                rows += [k] * len(found)
        dim = before.shape[1]
        return np.array(out, np.int64).reshape(-1, dim), np.array(rows, np.int64)


def named(
    mesh: Mesh,
    points: np.ndarray,
    cells: np.ndarray,
    parent: np.ndarray,
    moved: Moved,
    macros: np.ndarray | None = None,
) -> Mesh:
    """Points and elements with the groups, layers and cracks of the mesh before, as far as they are still there."""
    bare = Mesh.of(points, cells, macros=macros)
    edges = bare.edges()

    def there(rows: np.ndarray, inner: bool) -> tuple[np.ndarray, np.ndarray]:
        faces, of = moved.faces(rows)
        at = bare.find_edges(edges, faces)
        good = (at >= 0) & (edges.inner[at] | ~np.bool_(inner))
        return faces[good], of[good]

    cracks, of = there(mesh.cracks, inner=True)
    return Mesh.of(
        points, cells,
        {name: {group: np.flatnonzero(np.isin(parent, rows)) for group, rows in groups.items()}
         for name, groups in mesh.groups.items()},
        {name: there(rows, inner=False)[0] for name, rows in mesh.layers.items()}, cracks, mesh.crack_sets[of],
        macros=macros,
    )  # fmt: skip


def without(mesh: Mesh, elements: np.ndarray) -> Remade:
    """The mesh without these elements, and without macro-elements of which one is a part. CommandError if nothing is
    left."""
    gone = np.zeros(len(mesh.cells), bool)
    gone[elements] = True
    table = mesh.macros
    if len(table):
        parts = mesh.macro.elements(table)
        lost = gone[parts].any(axis=1)
        gone[parts[lost]] = True
        table = table[~lost]
    parent = np.flatnonzero(~gone)
    if not len(parent):
        raise CommandError("this would remove all elements")
    used = np.zeros(len(mesh.points), bool)
    left = mesh.cells[parent]
    used[left[left >= 0]] = True
    number = np.where(used, np.cumsum(used) - 1, -1)
    cells = np.where(left >= 0, number[left], -1)
    row = np.cumsum(~gone) - 1
    macros = np.column_stack([number[table[:, :-1]], row[table[:, -1]]]) if len(table) else None
    moved = Moved(number)
    return Remade(named(mesh, mesh.points[used], cells, parent, moved, macros), number, parent, moved)
