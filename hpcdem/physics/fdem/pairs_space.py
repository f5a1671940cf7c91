"""The contact list of a rank in space: faces and tetrahedra that may touch, what they remember, and where their forces
go. What pairs.py is in the plane: a pair is a free face, the contactor, and an element with a corner on the surface,
the target.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hpcdem.physics.fdem import connectivity, tetrahedra
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS
from hpcdem.physics.fdem.kernels import contact_space as contact
from hpcdem.physics.fdem.kernels import detect_space as detect
from hpcdem.physics.fdem.kernels.tets import ROW, STRIDE
from hpcdem.physics.fdem.pairs import Kinds, Surfaces, smallest_overlay
from hpcdem.physics.fdem.settings import MUNJIZA
from hpcdem.physics.fdem.tetrahedra import FACES, face_areas

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


OF_CONTACTOR = [0, 1, 2, 3, 5, 6]
"""Columns of `Surfaces.of_pairs` that a pair has: of T the part of the face, which is the contactor."""


class Surface(NamedTuple):
    """The surface of a whole model, one copy per node of the machine. mesh, closed, closed_faces: of which it is;
    clusters (ne, 4): numbers of the corners, those that are connected have one; free (4 ne,) bool: free faces;
    first (ne,): of each element with a corner on the surface its lowest free face, else the lowest of those that hang
    on its corners, -1: of others; begin, around: faces by cluster; length (ne,) [m]: median altitude of the elements of
    its body in the mesh.
    """

    mesh: object
    closed: np.ndarray
    closed_faces: int
    clusters: np.ndarray
    free: np.ndarray
    first: np.ndarray
    begin: np.ndarray
    around: np.ndarray
    length: np.ndarray

    @staticmethod
    def of(sim: State) -> Surface:
        """The present one; it is found again only if faces have opened, or the mesh is another: collective then."""
        mesh, closed, known = sim.the_mesh(), sim.closed_faces(), sim.surface
        count = int(closed.sum())
        if known is not None and known.mesh is mesh and known.closed is closed and known.closed_faces == count:
            return known
        same = known is not None and known.mesh is mesh
        length = known.length if same else sim.per_node(lambda: lengths(sim))
        clusters, free, first, begin, around = sim.per_node(lambda: Surface._found(sim))
        sim.surface = Surface(mesh, closed, count, clusters, free, first, begin, around, length)
        return sim.surface

    @staticmethod
    def _found(sim: State) -> tuple[np.ndarray, ...]:
        """clusters, free, first, begin, around."""
        mesh, closed = sim.the_mesh(), sim.closed_faces()
        clusters, lead = mesh.corner_clusters(sim.partner, ~closed)
        free = sim.face_exists() & ~closed
        faces = np.flatnonzero(free)
        element = faces // 4
        of_faces = clusters[element[:, None], FACES[faces % 4]]
        at, face = of_faces.reshape(-1), np.repeat(faces, 3)
        order = np.lexsort((face, at))
        begin = np.concatenate(([0], np.cumsum(np.bincount(at, minlength=len(lead))))).astype(np.int64)
        around = face[order]
        nobody = len(sim.partner)
        lowest = np.full(len(lead), nobody)
        some = np.flatnonzero(np.diff(begin))
        lowest[some] = around[begin[some]]
        first, own = lowest[clusters].min(axis=1), np.full(len(mesh.cells), nobody)
        np.minimum.at(own, element, faces)
        first = np.where(own < nobody, own, first)
        first[(first == nobody) | ~sim.alive] = -1
        return clusters, free, first, begin, around

    def faces_of(self, elements: np.ndarray) -> np.ndarray:
        """Return the free faces (k,) of elements (n,), ascending."""
        faces = (4 * np.sort(elements)[:, None] + np.arange(4)).reshape(-1)
        return faces[self.free[faces]]

    def near(self, elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Faces that hang on the corners of elements (n,), each once: which element (k,), ascending, and face (k,)."""
        clusters = self.clusters[elements].reshape(-1)
        counts = self.begin[clusters + 1] - self.begin[clusters]
        ends = np.cumsum(counts)
        at = np.repeat(self.begin[clusters] - (ends - counts), counts) + np.arange(int(counts.sum()))
        both = np.column_stack([np.repeat(np.repeat(np.arange(len(elements)), 4), counts), self.around[at]])
        which, face = np.unique(both, axis=0).T
        return which, face

    def several(self, kinds: Kinds) -> np.ndarray:
        """(ne,) bool: elements that can be touched at faces with different properties."""
        own = kinds.model[self.around] == 0
        keys = np.column_stack([
            kinds.model[self.around], own * kinds.joint[kinds.joint_row[self.around]],
            own * (1 + kinds.body[kinds.element_row[self.around // 4]]),
        ])  # fmt: skip
        kind = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
        some = np.flatnonzero(np.diff(self.begin))
        low, high = np.full(len(self.begin) - 1, len(kind)), np.full(len(self.begin) - 1, -1)
        low[some], high[some] = np.minimum.reduceat(kind, self.begin[some]), np.maximum.reduceat(kind, self.begin[some])
        return high[self.clusters].max(axis=1) > low[self.clusters].min(axis=1)


def lengths(sim: State) -> np.ndarray:
    """(ne,) [m] median altitude of the elements of each element's body in the mesh."""
    altitudes = face_areas(sim.reference.points, sim.reference.cells)
    np.divide(3.0 * sim.areas[:, None], altitudes, out=altitudes)
    body = connectivity.bodies(sim.partner)
    order = np.argsort(body, kind="stable")
    parts = np.split(altitudes[order], np.flatnonzero(np.diff(body[order])) + 1)
    return np.array([np.median(part) for part in parts])[body]


class ShapesSpace:
    """`pairs.Measures` of tetrahedra: pressure is slope P d / h. Munjiza's potential has h the mean altitude of an
    element, and slope 4."""

    nodes, least = 4.0, 0.0

    def __init__(self, sim: State, numbers: np.ndarray) -> None:
        munjiza = sim.options.potential == MUNJIZA
        self.slope = 4.0 if munjiza else 1.0
        self.area = face_areas(sim.reference.points, sim.reference.cells[numbers])
        self.double_area = Surface.of(sim).length[numbers]
        if munjiza:
            self.double_area = (3.0 * sim.areas[numbers][:, None] / self.area).mean(axis=1)
        self.edge = np.ones(len(numbers))
        self.slender = np.sqrt(self.area.mean(axis=1)) / self.double_area
        self.overlay = smallest_overlay(sim, numbers)


class ContactSpace:
    """Pairs near each other, in ascending order of (face, element); none without collision.

    rows (k,): storage rows of the owned elements of pairs; pushed (k, 16) [N]: sums of their forces; touching (m,), out
    (m, 21) [N], history (m, 5): by pairs, see contact_space.py.
    """

    def __init__(self, sim: State, face: np.ndarray, target: np.ndarray, values: np.ndarray) -> None:
        """face, target (k,), values (k, 5): what pairs remember."""
        self.threads = sim.threads
        self.face, rows = np.empty(0, np.int64), np.empty(0, np.int64)
        if sim.options.collision:
            surface = Surface.of(sim)
            self.face = surface.faces_of(sim.number)
            rows = np.flatnonzero(surface.first[sim.number] >= 0)
        self._place(sim.number, sim.where[self.face // 4], rows)
        self._make_list(sim)
        self._put_histories(len(sim.alive), face, target, values)
        self._make_entries(sim)

    def _place(self, number: np.ndarray, face_row: np.ndarray, rows: np.ndarray) -> None:
        """Contactors and targets, in these rows of `number`."""
        self.face_row, self.row = face_row, rows
        self.corner = ROW * self.face_row[:, None] + STRIDE * FACES[self.face % 4]
        self.element, self.place = number[rows], ROW * rows
        self.box = np.zeros((len(rows), 6))

    def _near(self, sim: State, x: np.ndarray, own: slice, skin: float) -> tuple[np.ndarray, np.ndarray]:
        if not len(self.face) or not len(self.row):
            return np.empty(0, np.int64), np.empty(0, np.int64)
        owned = [(row >= own.start) & (row < own.stop) for row in (self.face_row, self.row)]
        first, second = detect.find(
            self.corner, self.face, owned[0], self.place[:, None] + STRIDE * np.arange(4), self.element, owned[1],
            x, skin, Surface.of(sim).clusters, sim.partner, sim.closed_faces(),
        )  # fmt: skip
        if not sim.touches.all():
            keep = sim.touches[self.face[first] // 4] & sim.touches[self.element[second]]
            first, second = first[keep], second[keep]
        return first, second

    def _make_list(self, sim: State) -> None:
        """Pairs that may touch, and their properties."""
        self.first, self.second = first, second = self._near(sim, sim.x, sim.owned, sim.rebuild_state.skin)
        m, several = len(first), self._several(sim)
        self.law, self.length = np.zeros((m, contact.LAW)), np.zeros(len(self.row))
        self.chosen, self.choice_begin = np.zeros(0, np.int64), np.zeros(1, np.int64)
        self.choices = np.zeros((0, contact.CHOICE))
        self.history, self.touching = np.zeros((m, contact.MEMORY)), np.zeros(m, np.uint8)
        self.out = np.zeros((m, contact.FORCES))
        if not m:
            return
        surface = Surface.of(sim)
        if sim.options.potential != MUNJIZA:
            self.length = surface.length[self.element]
        dynamic = sim.options.dynamic
        shapes = ShapesSpace(sim, self.element)  # an element with a free face is a target too
        faces = Surfaces(sim, shapes, self.face, np.searchsorted(self.row, self.face_row))
        targets = Surfaces(sim, shapes, surface.first[self.element], np.arange(len(self.row)))
        shared, overlay = shared_faces(sim, self.face[first] // 4, self.element[second])
        self.law = faces.of_pairs(first, targets, second, shared, overlay)[:, OF_CONTACTOR]
        varied = np.flatnonzero(several[self.element[second]]) if several is not None else second[:0]
        if len(varied):
            self._vary(sim, surface, shapes, faces, varied, shared, overlay)
        if not dynamic:
            self.law[:, contact.DASHPOT] = self.choices[:, 9 + contact.DASHPOT] = 0.0

    @staticmethod
    def _several(sim: State) -> np.ndarray | None:
        """See `Surface.several`; None: no element can. Collective."""
        if not sim.options.collision:
            return None
        kinds, surface = Kinds.of(sim), Surface.of(sim)
        return None if kinds.alike else sim.per_node(lambda: surface.several(kinds))

    def _vary(
        self, sim: State, surface: Surface, shapes: ShapesSpace, faces: Surfaces, varied: np.ndarray,
        shared: np.ndarray, overlay: np.ndarray,
    ) -> None:  # fmt: skip
        """Choices of the pairs `varied`, whose target can be touched at faces of several kinds."""
        mesh = sim.the_mesh()
        known, of_pair = np.unique(self.second[varied], return_inverse=True)
        which, face = surface.near(self.element[known])
        begin = np.searchsorted(which, np.arange(len(known) + 1))
        corners = mesh.points[mesh.face_points(face)]
        cells = mesh.cells[self.element[known[which]]]
        sides = np.swapaxes(tetrahedra.sides(mesh.points, cells), 1, 2)
        edges = corners - mesh.points[cells[:, :1]]
        parts = np.swapaxes(np.linalg.solve(sides, np.swapaxes(edges, 1, 2)), 1, 2).reshape(len(face), 9)
        # Every pair with every face of its target.
        counts = np.diff(begin)[of_pair]
        ends = np.cumsum(counts)
        at = np.repeat(begin[:-1][of_pair] - (ends - counts), counts) + np.arange(int(counts.sum()))
        pair = np.repeat(varied, counts)
        touched = Surfaces(sim, shapes, face[at], known[which[at]])
        found = faces.of_pairs(self.first[pair], touched, np.arange(len(at)), shared[pair], overlay[pair])
        self.choices = np.hstack([parts[at], found[:, OF_CONTACTOR]])
        self.choice_begin = np.append(0, ends)
        self.chosen = np.full(len(self.first), -1)
        self.chosen[varied] = np.arange(len(varied))

    def __len__(self) -> int:
        return len(self.first)

    def _put_histories(self, elements: int, face: np.ndarray, target: np.ndarray, values: np.ndarray) -> None:
        if not len(self) or not len(face):
            return
        key = self.face[self.first] * elements + self.element[self.second]
        wanted = face * elements + target
        at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        there = key[at] == wanted
        self.history[at[there]] = values[there, : contact.MEMORY]
        self.touching[at[there]] = 1

    def _make_entries(self, sim: State) -> None:
        """Owned elements of the pairs, and which pairs act on each of them, in their order."""
        own, pair = sim.owned, np.arange(len(self))
        row = np.concatenate([self.face_row[self.first], self.row[self.second]])
        entry = np.concatenate([8 * pair + self.face[self.first] % 4, 8 * pair + 4])
        keep = (row >= own.start) & (row < own.stop)
        row, entry = row[keep], entry[keep]
        order = np.lexsort((entry, row))
        self.entry = entry[order]
        self.rows, counts = np.unique(row, return_counts=True)
        self.begin = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        self.pushed = np.zeros((len(self.rows), ROW))

    def forces(self, x: np.ndarray, v: np.ndarray, dt: float) -> None:
        """Contact forces at the present positions; histories move on by dt."""
        contact.forces(
            self.threads, self.place, self.box, self.first, self.second, self.corner, self.length, x, v, self.law,
            self.chosen, self.choice_begin, self.choices, self.history, self.touching, self.out, dt, self.begin,
            self.entry, self.pushed,
        )  # fmt: skip

    def parts(self, x: np.ndarray) -> np.ndarray:
        """Present depth of overlap of pairs over an altitude (m,)."""
        part = np.zeros(len(self))
        contact.parts(self.threads, self.first, self.second, self.corner, self.place, x, self.touching, part)
        return part

    def depths_of(self, at: np.ndarray, x: np.ndarray, depth: np.ndarray) -> None:
        """Write depth [m] and position of the overlap of the pairs `at` into depth (n, 4)."""
        contact.depths(self.first[at], self.second[at], self.corner, self.place, x, depth)

    def add_to(self, force: np.ndarray) -> None:
        """Add them to the forces (n, 16) [N] of the elements."""
        if len(self.rows):
            contact.add(self.rows, self.pushed, force)

    def changed_by_forces(self) -> tuple[np.ndarray, ...]:
        """The part of the memory of contacts that the computation of forces changes."""
        return self.history, self.touching

    def known(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces and targets of pairs that remember something, and what."""
        used = np.flatnonzero(self.history.any(axis=1))
        return self.face[self.first[used]], self.element[self.second[used]], self.history[used]

    @staticmethod
    def named(element: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces, targets and memory of pairs from rows of histories.py of the elements `element` (k,)."""
        key = rows.view(np.int64)[:, KEY]
        other, is_target = key >> 3, key & 4 > 0
        face = 4 * np.where(is_target, other, element) + (key & 3)
        return face, np.where(is_target, element, other), rows[:, FIRST : FIRST + contact.MEMORY]

    @staticmethod
    def remembered(sim: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces, targets and memory of pairs from the histories of the owned elements."""
        at = np.flatnonzero(sim.histories.keys() >= 0)
        return ContactSpace.named(sim.number[sim.owned][sim.histories.owners()[at]], sim.histories.rows[at])

    def histories(self, sim: State) -> tuple[np.ndarray, np.ndarray]:
        """Owned element (0 ..) and row (histories.py) of each pair that remembers something, for both its elements."""
        face, target, values = self.known()
        owners, parts = [], []
        for mine, key in ((face // 4, 8 * target + face % 4), (target, 8 * (face // 4) + 4 + face % 4)):
            row = sim.where[mine] - sim.n_left
            at = np.flatnonzero((row >= 0) & (row < sim.n_own))
            rows = np.zeros((len(at), WORDS))
            rows.view(np.int64)[:, KEY] = key[at]
            rows[:, FIRST : FIRST + contact.MEMORY] = values[at]
            owners.append(row[at])
            parts.append(rows)
        return np.concatenate(owners), np.concatenate(parts)


class AllPairs(ContactSpace):
    """Faces and elements of which the boxes overlap now, of all elements, those inside too. What they remember and do
    is not requested."""

    def __init__(
        self, sim: State, number: np.ndarray, x: np.ndarray, face: np.ndarray, face_row: np.ndarray, own: slice
    ) -> None:
        """number (n,), x (n, 16): of elements, of which `own` are owned; face, face_row (k,): free faces of some of
        them, ascending, and their rows."""
        self.x, self.face, self.own = x, face, own
        self._place(number, face_row, np.arange(len(number)))
        self.first, self.second = self._near(sim, x, own, 0.0)

    @staticmethod
    def of(sim: State) -> list[AllPairs]:
        """Find those of elements held here, then those of owned faces with elements beyond. Collective."""
        surface, beyond = Surface.of(sim), sim.beyond
        face = surface.faces_of(sim.number)
        found = [AllPairs(sim, sim.number, sim.x, face, sim.where[face // 4], sim.owned)]
        places = beyond.fetched(sim.x[sim.owned])
        if len(beyond.number):
            face = surface.faces_of(sim.number[sim.owned])
            mine = np.unique(face // 4)
            x = np.concatenate([sim.x[sim.where[mine]], *places.values()])
            number, row = np.concatenate([mine, beyond.number]), np.searchsorted(mine, face // 4)
            found.append(AllPairs(sim, number, x, face, row, slice(0, len(mine))))
        return found

    def depths(self) -> np.ndarray:
        """(m, 4) how deep each contactor is in its target [m], and where."""
        depth = np.zeros((len(self), 4))
        self.depths_of(np.arange(len(self)), self.x, depth)
        return depth


def shared_faces(sim: State, e: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length (m,) [m] of a joint on the face that elements e and f have in common in the mesh, 0 without one, and the
    overlay penalty [Pa] of the joint that was there, NaN without one."""
    mesh = sim.the_mesh()
    out, penalty = np.zeros(len(e)), np.full(len(e), np.nan)
    overlay = np.array(sim.joint_rows.column("penalty_overlay", np.nan))
    overlay[0] = np.nan
    for k in range(4):
        over = sim.partner[4 * e + k]
        at = np.flatnonzero((over >= 0) & (over // 4 == f))
        out[at] = mesh.joint_lengths(4 * e[at] + k, sim.partner)
        penalty[at] = overlay[sim.joint_row[4 * e[at] + k]]
    return out, penalty
