"""Interface of the elements of liners: beams in the plane, flat shells in space."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hpcdem.physics.fdem.groups import LINER_ELEMENT
from hpcdem.physics.fdem.structures import Columns


@dataclass(frozen=True)
class Laid:
    """Layout of new elements. order: of the faces; ends (m, k): their nodes, new ones from len(liners) on; parted: how
    many points of the mesh, or edges, part them; about: what else their kind knows."""

    order: np.ndarray
    ends: np.ndarray
    parted: int
    about: Any


class Elements(ABC):
    """The elements of the liners of a model, one kind. Nothing is collective."""

    corners: ClassVar[int]
    parts: ClassVar[np.ndarray]
    """Components of conditions that nodes have, see kernels.DOES."""
    of_nodes: ClassVar[Columns]
    of_elements: ClassVar[Columns]
    quantities: ClassVar[Mapping[str, Mapping[str, tuple[str, str]]]]
    parted_at: ClassVar[str]
    """Part of the mesh that two joined elements share."""

    def __init__(self, liners: Any) -> None:
        self.liners = liners  # physics.liners.model.Liners, which imports this

    @abstractmethod
    def lay(self, faces: np.ndarray, points: np.ndarray, at: np.ndarray) -> Laid:
        """Elements for faces (m,) of points (m, k), at (m, k, d) [m]."""

    @abstractmethod
    def begin(self, laid: Laid, nodes: dict[str, np.ndarray], elements: dict[str, np.ndarray]) -> None:
        """Fill columns of new nodes and elements, whose places are known, without strain."""

    @abstractmethod
    def arrange(self) -> tuple[np.ndarray, ...]:
        """Tables of the kernels, from columns and properties. Returns the mass [kg] and rotational inertia that an
        element gives to each of its nodes (m,), and half of the largest row sums of its stiffness by Gershgorin there
        (m, k) [N/m, N m], with rotations measured as displacements."""

    @abstractmethod
    def frames(self, frame: np.ndarray) -> None:
        """Unit vectors at points, see `kernels`, at the present places."""

    @abstractmethod
    def turn(self, dt: float) -> None:
        """The nodes turn over a step."""

    @abstractmethod
    def bend(self, work: np.ndarray) -> None:
        """New forces in the elements from the new places and rotations."""

    @abstractmethod
    def push(self, frame: np.ndarray, total: np.ndarray, on_rock: np.ndarray) -> None:
        """Add what elements and their bond do on nodes and rock, in the order of elements."""

    @abstractmethod
    def stored(self) -> np.ndarray:
        """Elastic energy (m,) [J]."""

    @abstractmethod
    def areas(self, elements: np.ndarray) -> np.ndarray:
        """Return the area of rock that belongs to a point of these elements [m2, in the plane m]."""

    @abstractmethod
    def sizes(self) -> np.ndarray:
        """(m,) [m]."""

    @abstractmethod
    def contributing(self) -> list[np.ndarray]:
        """Forces [N] of elements that balance each other at nodes, for the unbalanced ratio."""

    @abstractmethod
    def node_value(self, name: str) -> np.ndarray:
        """A quantity of nodes that others do not have."""

    @abstractmethod
    def element_value(self, name: str) -> np.ndarray:
        """A quantity of elements that others do not have."""

    @abstractmethod
    def ends_by_name(self) -> dict[str, np.ndarray]:
        """Columns of frames with the nodes of elements."""

    def largest_at_nodes(self, values: np.ndarray) -> np.ndarray:
        """Largest of the values (m,) of elements at each node (n,)."""
        out = np.zeros(len(self.liners))
        np.maximum.at(out, self.liners.elements["ends"].reshape(-1), np.repeat(values, self.corners))
        return out

    def there(self) -> np.ndarray:
        """(m,) bool: not deleted."""
        return self.liners.alive(LINER_ELEMENT)


BOND: Mapping[str, tuple[str, str]] = {
    "liner_state": ("1", "yielding in tension 1, in compression 2, in bending 4; has yielded 8; deleted 32"),
    "bond_pressure": ("Pa", "pressure between rock and liner, tension negative"),
    "bond_shear": ("Pa", "shear stress of the bond on the liner, along it; in space its size"),
    "gap": ("m", "opening between rock and liner, the largest of its nodes; below 0: in compression"),
    "slip": ("m", "slip of the liner on the rock, the largest of its nodes; in space its size"),
    "bond_state": ("1", "state of a node: slipping 1, has slipped 2, bond broken 4, open 8"),
    "host": ("1", "element of its bond, -1: none"),
}
"""Quantities of elements of all kinds that can be queried: unit and meaning."""


def of_bond(dim: int) -> Columns:
    """Columns of elements that are the same for all kinds, but for their widths. row: of the properties, 0: none yet;
    face: it was put on; host: element of this face, -1: it is gone; point: where the rock is at its points [m]; the
    rest: the bond there, see kernels.bond."""
    k = dim  # as many points as dimensions: two of a beam, three of a triangle
    return {
        "row": (np.int64, 0), "state": (np.int64, 0), "ends": (np.int64, k), "face": (np.int64, 0),
        "host": (np.int64, 0), "point": (np.float64, k * dim), "gap": (np.float64, k),
        "slip": (np.float64, k * (dim - 1)), "pressure": (np.float64, k), "shear": (np.float64, k * (dim - 1)),
        "bond_state": (np.int64, k),
    }  # fmt: skip


def of_node(dim: int) -> Columns:
    """Columns of the nodes of liners. liner: which one; spin: rate of rotation."""
    turns = 0 if dim == 2 else 3
    return {
        "liner": (np.int64, 0), "condition": (np.int64, 0), "spin": (np.float64, turns), "x": (np.float64, dim),
        "v": (np.float64, dim), "origin": (np.float64, dim), "reaction": (np.float64, dim + max(turns, 1)),
    }  # fmt: skip


def of_places(axes: str, force: str) -> dict[str, tuple[str, str]]:
    """Quantities of nodes along these axes; force: unit."""
    found = {}
    for stem, unit, doc in (
        ("position", "m", "position in {}"), ("displacement", "m", "displacement in {} since it was installed"),
        ("velocity", "m/s", "velocity in {}"), ("reaction", force, "force of conditions in {}"),
    ):  # fmt: skip
        found.update({f"{stem}_{axis}": (unit, doc.format(axis)) for axis in axes})
    return found
