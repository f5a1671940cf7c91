"""Macro-elements: elements that the mesh stores as several simplices with numbers one after the other, which go
everywhere together: a hexahedron as six tetrahedra, a six-node triangle as four triangles. Joints and contact act on
the sides of these simplices, forces inside are those of the whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Macro:
    """A kind of macro-element: its parts in the mesh, its nodes, and how many of these, the first ones, are corners of
    its shape."""

    name: str
    plural: str
    parts: int
    nodes: int
    corners: int

    def elements(self, table: np.ndarray) -> np.ndarray:
        """(n, parts) numbers of the elements that store these (n, nodes + 1)."""
        found: np.ndarray = table[:, -1, None] + np.arange(self.parts)
        return found

    def places(self, cells: np.ndarray, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the nodes of these (n, nodes + 1) are: (n, nodes) the first corner (corners of cells * part + k) at
        each of them, and (n, corners of all parts) which node each corner of the parts is."""
        width = self.parts * cells.shape[1]
        own = cells[self.elements(table)].reshape(len(table), width)
        same = own[:, None, :] == table[:, : self.nodes, None]
        return np.argmax(same, axis=2), np.argmax(same, axis=1)


HEXAHEDRON = Macro("hexahedron", "hexahedra", 6, 8, 8)
SIX_NODE_TRIANGLE = Macro("six-node triangle", "six-node triangles", 4, 6, 3)
OF_DIMENSION = {2: SIX_NODE_TRIANGLE, 3: HEXAHEDRON}

SIX_NODES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Nodes of the four triangles of a six-node triangle, whose nodes 3, 4, 5 are between 0 and 1, 1 and 2, 2 and 0."""
SIX_INSIDE = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [1, 1, 1, 0]], bool)
"""Which of the faces of these four are inside it."""
