"""Elements, open faces, joints and nodes of a model of blocks that are present, and their connections; by the numbers
of the mesh, equal on all ranks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.memory import sparse_zeros
from hpcdem.physics.fdem import sides
from hpcdem.physics.fdem.mesh import Mesh

T = TypeVar("T")
Numbers = np.ndarray | Sequence[int] | None
"""Numbers of elements, nodes, faces or joints; None: all."""
AGAIN, CRACK = 2, 3
"""Values of `broken`: a joint that broke before, or was never intact, and is a joint again temporarily (pressed.py); a
crack."""


class Topology:
    """Mesh, and what of it is there and is connected. Methods raise CommandError, alike on all ranks."""

    mesh: Mesh | None
    partner: np.ndarray
    """(4 ne,) the face on the other side of each face, -1: none."""
    alive: np.ndarray
    """(ne,) bool: elements that are present (not excavated)."""
    touches: np.ndarray
    """(ne,) bool: elements that take part in contact."""
    joint_row: np.ndarray
    """(4 ne,) row of the joint models, of both faces of a joint; 0: none."""
    open: np.ndarray
    """(4 ne,) bool: faces that are not joined to their partner (any more): broken, cracked, or the partner was
    removed."""
    broken: np.ndarray
    """(4 ne,) by the lower face: 1 if the joint broke; more, while it is a joint again, see pressed.py."""
    slid: dict[int, tuple[float, ...]]
    """History of the slip of broken joints by face, at three points [m], see pressed.py."""
    born: np.ndarray
    """Elements that were filled in again after they had been removed, ascending."""
    birthplace: np.ndarray
    """Positions of their corners at that time (n, 4, dim) [m]."""

    def clear_topology(self) -> None:
        """Remove the mesh."""
        self.mesh = None
        self.born, self.birthplace = np.empty(0, np.int64), np.empty((0, 4, 2))
        self._reference: Mesh | None = None
        self._closed: np.ndarray | None = None
        self._make_topology(0)

    def _make_topology(self, elements: int) -> None:
        self.partner = np.full(4 * elements, -1, np.int64)
        self.alive, self.touches = np.ones((2, elements), bool)
        self.joint_row = sparse_zeros(4 * elements, np.int32)
        self.open = sparse_zeros(4 * elements, bool)
        self.broken = sparse_zeros(4 * elements, np.uint8)
        self.slid = {}

    # What the simulation does when something has changed.

    def before_change(self) -> None:
        """Assignments are about to change."""

    def changed(self, topology: bool = False, stiffness: bool = True) -> None:
        """Assignments have changed; topology: also who is connected with whom; stiffness: perhaps the stable time
        step too."""

    def note(self, text: str) -> None:
        """A line for the log."""

    def per_node(self, make: Callable[[], T]) -> T:
        """The result of `make()`, which does not depend on the rank, see `Comm.per_node`."""
        return make()

    @property
    def dim(self) -> int:
        """Dimensions of space; without a mesh 2."""
        return 2 if self.mesh is None else self.mesh.dim

    def refuse_in_space(self, what: str) -> None:
        """CommandError for what is there in the plane only."""
        if self.dim == 3:
            raise CommandError(f"{what}: available in two dimensions only")

    def _mesh(self) -> Mesh:
        if self.mesh is None:
            raise CommandError("no mesh yet")
        return self.mesh

    def _vector(self, what: str, given: Sequence[float]) -> np.ndarray:
        """Check one number for each dimension of space. Raises CommandError."""
        if len(given) != self.dim:
            raise CommandError(f"{what}: a vector of {self.dim} numbers is needed, got {len(given)}")
        return finite(what, list(given))

    def _only_in_space(self, what: str, *values: Any) -> None:
        if self.dim == 2 and any(value is not None for value in values):
            raise CommandError(f"{what} is for three dimensions")

    def numbers_of_elements(self, elements: Any) -> np.ndarray:
        """Checked element numbers, ascending; None: all that are there. CommandError for others."""
        return self.per_node(lambda: self._elements(elements))

    def _elements(self, elements: Any) -> np.ndarray:
        at = self.existing(elements, self.alive, "element")
        if elements is not None:
            self.refuse_parts(at)
        return at

    def refuse_parts(self, at: np.ndarray) -> None:
        """CommandError if these elements (n,) are some parts of a macro-element, and not the others."""
        mesh = self._mesh()
        if len(mesh.macros):
            of, macro = mesh.macro_of()[at], mesh.macro
            count = np.bincount(of[of >= 0], minlength=len(mesh.macros))
            part = np.flatnonzero((count > 0) & (count < macro.stored))
            if len(part):
                first = mesh.macros[part[0], -1]
                raise CommandError(
                    f"elements {first} to {first + macro.stored - 1} are one {macro.name}, of which only "
                    f"{count[part[0]]} were given: give all of them"
                )

    def numbers_of_nodes(self, nodes: Any) -> np.ndarray:
        """Checked numbers of points of the mesh with an element that is there; None: all of them. Of sides (sides.py)
        their points."""
        return self.per_node(lambda: self._nodes(nodes))

    def _nodes(self, nodes: Any) -> np.ndarray:
        asked = None if nodes is None else np.asarray(nodes)
        if asked is not None and np.issubdtype(asked.dtype, np.integer):
            asked = sides.points(self._mesh().cells, asked.reshape(-1))
        return self.existing(asked, self.node_exists(), "node")

    def corners_of_nodes(self, nodes: Any, whole: bool = False) -> np.ndarray:
        """(4 ne,) bool: corners at these nodes (sides.py), those of elements that were removed too; None: all. whole:
        and those that are one node with them."""
        return self.per_node(lambda: self._corners_of_nodes(nodes, whole))

    def _corners_of_nodes(self, nodes: Any, whole: bool) -> np.ndarray:
        mesh = self._mesh()
        self._nodes(nodes)
        if nodes is None:
            return mesh.cells.reshape(-1) >= 0
        given = np.asarray(nodes, np.int64).reshape(-1)
        found = sides.corners(mesh.cells, given, len(mesh.points))
        if whole and sides.are_there(given):
            found = self.with_nodes(found, self.clusters()[0].reshape(-1))
        return found

    @staticmethod
    def with_nodes(corners: np.ndarray, node: np.ndarray) -> np.ndarray:
        """Corners (4 ne,) bool, and those that are one of the nodes (4 ne,) with them."""
        of = np.zeros(int(node.max(initial=-1)) + 2, bool)  # the last one: of none
        of[node[corners]] = True
        of[-1] = False
        return corners | of[node]

    def clusters(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes of corners (ne, 4), as faces are connected now, -1 of elements that were removed, and their lowest
        corners."""
        return self.per_node(self._clusters)

    def _clusters(self) -> tuple[np.ndarray, np.ndarray]:
        mesh = self._mesh()
        apart = (self.joint_row > 0) | self.open
        apart |= np.repeat(~self.alive, 4)
        node, lead = mesh.corner_clusters(self.partner, apart)
        node[~self.alive] = -1
        return node, lead

    def node_exists(self) -> np.ndarray:
        """(np,) bool."""
        corners = self._mesh().cells[self.alive]
        exists = np.zeros(len(self._mesh().points), bool)
        exists[corners[corners >= 0]] = True
        return exists

    def numbers_of_faces(self, faces: Any) -> np.ndarray:
        """Checked face numbers; None: all faces of elements that are there."""
        return self.per_node(lambda: self.existing(faces, self.face_exists(), "face"))

    def numbers_of_joints(self, joints: Any) -> np.ndarray:
        """Checked numbers of inner edges (lower faces); None: all between elements that are there."""
        what = "joint (the lower face of an inner edge)"
        return self.per_node(lambda: self.existing(joints, self.joint_exists(), what))

    def joint_exists(self) -> np.ndarray:
        """(4 ne,) bool: lower faces of edges between elements that are there."""
        face = np.arange(len(self.partner))
        inner = (self.partner > face) & self.alive[face // 4]
        inner[inner] &= self.alive[self.partner[inner] // 4]
        inner[inner] = ~self._mesh().inside_macros(face[inner])
        return inner

    def face_exists(self) -> np.ndarray:
        """(4 ne,) bool."""
        exists = np.repeat(self.alive, 4)
        exists[3::4] &= self._mesh().cells[:, 3] >= 0
        return exists

    def existing(self, given: Any, there: np.ndarray, what: str) -> np.ndarray:
        self._mesh()
        if given is None:
            return np.flatnonzero(there)
        asked = np.asarray(given)
        if asked.dtype == bool or (asked.size and not np.issubdtype(asked.dtype, np.integer)):
            raise CommandError(f"numbers of {what}s must be integers, got {asked.dtype}")
        asked = np.unique(asked.astype(np.int64).reshape(-1))
        bad = asked[(asked < 0) | (asked >= len(there))]
        gone = ""
        if not len(bad):
            bad = asked[~there[asked]]
            gone = "" if self.alive.all() else "; elements were removed"
        if len(bad):
            raise CommandError(f"there is no {what} {bad[0]}{gone}")
        return asked

    def open_faces(self, lower: np.ndarray) -> None:
        for faces in (lower, self.partner[lower]):
            self.open[faces] = True
            if self._closed is not None:
                self._closed[faces] = False

    def closed_faces(self) -> np.ndarray:
        """(4 ne,) bool: faces that are connected with their partner, by a joint or as one body. Not to be changed."""
        if self._closed is None:
            self._closed = (self.partner >= 0) & ~self.open
        return self._closed

    @property
    def reference(self) -> Mesh:
        """Return the mesh in which elements are free of strain: the original one, with points of their own for elements
        that were filled back (macro-elements share those of their parts)."""
        mesh = self._mesh()
        if self._reference is None:
            self._reference = mesh.with_own_points(self.born, self.birthplace) if len(self.born) else mesh
        return self._reference

    def take_births(self, born: np.ndarray, places: np.ndarray) -> None:
        """Elements (n,) have come back, their corners at places (n, 4, dim) [m]."""
        stay = ~np.isin(self.born, born)
        number = np.concatenate([self.born[stay], born])
        order = np.argsort(number, kind="stable")
        self.born = number[order]
        known = self.birthplace[stay].reshape(-1, 4, self.dim)
        self.birthplace = np.concatenate([known, places])[order]
        self._reference = None


def place(at: np.ndarray) -> str:
    """A position in words for messages."""
    return f"({', '.join(f'{c:g}' for c in at)})"


def finite(what: str, values: list) -> np.ndarray:
    try:
        numbers = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise CommandError(f"{what} must be a number, got {values}") from None
    if not np.isfinite(numbers).all():
        raise CommandError(f"{what} must be finite, got {', '.join(f'{v:g}' for v in numbers)}")
    return numbers
