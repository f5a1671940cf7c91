"""The contact list of a rank: bodies that may touch, what they remember, and where their forces go.

A body is a triangle, or half of a quad, cut along the diagonal that is shorter in the mesh; its number is element * 2 +
half. Of a quad's half the third edge lies inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numba import njit

from hpcdem.numerics.lanes import as_bits
from hpcdem.physics.fdem import connectivity
from hpcdem.physics.fdem.histories import FIRST, KEY, WORDS
from hpcdem.physics.fdem.kernels import contact, detect, elements
from hpcdem.physics.fdem.mesh import Mesh, pieces
from hpcdem.physics.fdem.properties import Rows

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


def cut_corner(mesh: Mesh) -> np.ndarray:
    """(ne,) 0 where a quad is cut from its first corner to its third, 1 from the second to the fourth."""
    out = np.zeros(len(mesh.cells), np.int64)
    quads = np.flatnonzero(mesh.cells[:, 3] >= 0)
    a, b, c, d = (mesh.points[mesh.cells[quads, k]] for k in range(4))
    out[quads] = ((b - d) ** 2).sum(axis=1) < ((a - c) ** 2).sum(axis=1)
    return out


class Measures(Protocol):
    """Shapes of elements for contact (n,), in the plane and in space.

    double_area: twice the area of a body [m2], in space the length h of the potential [m]; edge: mean edge [m], in
    space 1; slender: mean edge squared over double_area, in space the root of a face's area over it; overlay: smallest
    overlay penalty of the element's joints [Pa], NaN without joints. Where surfaces lie flat on each other pressure is
    slope P d (1 / h_1 + 1 / h_2); an element has nodes corners; no element is less slender than `least`.
    """

    slope: float
    nodes: float
    least: float
    double_area: np.ndarray
    edge: np.ndarray
    slender: np.ndarray
    overlay: np.ndarray


class Shapes:
    """`Measures` of the elements `numbers` (n,), as they are in the mesh; length (n, 4) of their edges [m]."""

    slope, nodes, least = 3.0, 3.0, 1.0

    def __init__(self, sim: State, numbers: np.ndarray) -> None:
        mesh = sim.mesh
        assert mesh is not None
        cells = mesh.cells[numbers]
        n = np.where(cells[:, 3] >= 0, 4, 3)
        xy = sim.reference.points[sim.reference.cells[numbers]]
        self.length = np.zeros((len(cells), 4))
        for k in range(4):
            after = np.where(k + 1 < n, k + 1, 0)
            way = xy[np.arange(len(cells)), after] - xy[:, k]
            self.length[:, k] = np.where(k < n, np.hypot(way[:, 0], way[:, 1]), 0.0)
        # A quad takes part as two triangles of half its area.
        self.double_area = 2.0 * sim.areas[numbers] / (n - 2)
        self.edge = self.length.sum(axis=1) / n
        self.slender = self.edge**2 / self.double_area
        self.overlay = smallest_overlay(sim, numbers)


def smallest_overlay(sim: State, numbers: np.ndarray) -> np.ndarray:
    """(n,) smallest overlay penalty of the joints of elements [Pa], NaN without joints."""
    overlay = sim.joint_rows.column("penalty_overlay", np.inf)
    out = overlay[sim.joint_row[4 * numbers[:, None] + np.arange(4)]].min(axis=1)
    out[np.isinf(out)] = np.nan
    return out


class Kinds(NamedTuple):
    """Rows that determine the properties of faces in contact: by face the rows of its contact model and of its joint,
    by element that of its model, and the kinds of rows; alike: all faces of the model are of one kind."""

    model: np.ndarray
    joint_row: np.ndarray
    joint: np.ndarray
    element_row: np.ndarray
    body: np.ndarray
    alike: bool

    @staticmethod
    def of(sim: State) -> Kinds:
        """Collect the tables of a model. Collective."""

        def kind(rows: Rows, *names: str) -> np.ndarray:
            return np.unique(np.column_stack([rows.column(n) for n in names]), axis=0, return_inverse=True)[1].reshape(
                -1
            )

        joint = kind(sim.joint_rows, "friction", "penalty_overlay") + 1
        joint[0] = 0
        body = kind(sim.element_rows, "friction", "penalty", "damp_b")

        def alike() -> bool:
            exists, ends = sim.face_exists(), list[np.ndarray]()
            for at in pieces(len(exists)):
                faces = at.start + np.flatnonzero(exists[at])
                if len(faces):
                    of = sim.face_row[faces], joint[sim.joint_row[faces]], body[sim.element_row[faces // 4]]
                    ends.append(np.array([(one.min(), one.max()) for one in of]))
            if not ends:
                return True
            every = np.array(ends)
            low, high = every.min(axis=(0, 2)), every.max(axis=(0, 2))
            same = low == high
            return bool(same[0] and (low[0] > 0 or same.all()))

        return Kinds(sim.face_row, sim.joint_row, joint, sim.element_row, body, sim.per_node(alike))


class Surfaces:
    """Properties of some faces (n,), each of a body of the element in row `rows` (n,) of `shapes`: its own, or one that
    touches with a corner where the face ends.

    normal, shear: penalties [Pa], NaN where they follow from the joints; tan_phi; most [Pa], exponent, ratio: normal
    damping; overlay: overlay penalty of the joint that the face was, else the smallest of the element's joints [Pa],
    NaN without joints; young [Pa], density [kg/m3].
    """

    def __init__(self, sim: State, shapes: Measures, faces: np.ndarray, rows: np.ndarray) -> None:
        model, joint, element = sim.face_row[faces], sim.joint_row[faces], sim.element_row[faces // 4]

        def of_elements(name: str) -> np.ndarray:
            return sim.element_rows.column(name)[element]

        def of_model(name: str, otherwise: np.ndarray | float) -> np.ndarray:
            return np.where(model > 0, sim.face_rows.column(name)[model], otherwise)

        self.young, self.density = of_elements("young"), of_elements("density")
        overlay = sim.joint_rows.column("penalty_overlay", np.nan)
        self.overlay = np.where(joint > 0, overlay[joint], shapes.overlay[rows])
        penalty = of_elements("penalty")
        penalty = np.where(penalty > 0.0, penalty, np.nan)
        self.normal, self.shear = of_model("penalty_normal", penalty), of_model("penalty_shear", penalty)
        tan_e, tan_j, tan_f = (
            np.tan(np.radians(of.column("friction"))) for of in (sim.element_rows, sim.joint_rows, sim.face_rows)
        )
        self.tan_phi = np.where(model > 0, tan_f[model], np.where(joint > 0, tan_j[joint], tan_e[element]))
        self.most = of_model("damping_t", np.inf)
        self.exponent = of_model("damping_b", np.maximum(of_elements("damp_b"), 1.0))
        self.ratio = of_model("damping_ratio", 0.0)
        self.slope, self.nodes, self.least = shapes.slope, shapes.nodes, shapes.least
        self.slender, self.double_area, self.edge = shapes.slender[rows], shapes.double_area[rows], shapes.edge[rows]

    def most_penalty(self, among: bool) -> np.ndarray:
        """Largest normal penalty (n,) [Pa] that any pair of a face can have; among: all elements of the model have
        joints and leave their contact to them."""
        usual = 10.0 * self.young
        tied = self.overlay / (self.slope * (self.slender + self.least))
        silent = np.where(np.isnan(tied), usual, tied if among else np.fmax(usual, tied))
        return np.where(np.isnan(self.normal), silent, self.normal)

    def of_pairs(
        self, i: np.ndarray, other: Surfaces, j: np.ndarray, shared: np.ndarray, overlay: np.ndarray
    ) -> np.ndarray:
        """Properties (m, 3 + contact.DAMPER) of pairs (face i of these, face j of the others): normal and shear penalty
        [Pa], tan(phi), and the columns of the table of dampers, face i on the first side.

        The smaller of both (damping: what damps more). Where neither says anything: the normal stress of two jointed
        elements continues when the joint between them breaks closed, P = P_overlay / (3 h (1 / h_i + 1 / h_j)), h_i,
        h_j: altitudes on the joint of length h; otherwise 10 E. shared (m,) [m2]: length squared of the face that both
        elements have in common in the mesh, 0 for none (the mean edges then replace it); overlay (m,) [Pa]: of the
        joint that was there, else NaN.

        T is shared out between the two contactors as their stress is, 3 P d over the altitude of the other one, so that
        both reach their part at the same overlap and bear T together.

        Dashpot: xi sqrt(k m) for each of the two contactors, k = 3 P (1 / h_i + 1 / h_j) per area, m = m_i m_j / (m_i +
        m_j), m_i = rho h_i / 3 the mass of the surface nodes per area: the damping ratio of two lone elements is xi.
        """
        both = np.fmin(overlay, np.minimum(self.overlay[i], other.overlay[j]))
        exact = shared / self.double_area[i] + shared / other.double_area[j]
        tied = both / (self.slope * np.where(shared > 0.0, exact, self.slender[i] + other.slender[j]))
        usual_i, usual_j = 10.0 * self.young[i], 10.0 * other.young[j]
        silent = np.isnan(self.normal[i]) & np.isnan(other.normal[j])
        normal = np.fmin(np.where(np.isnan(self.normal[i]), usual_i, self.normal[i]),
                         np.where(np.isnan(other.normal[j]), usual_j, other.normal[j]))  # fmt: skip
        normal = np.where(silent & np.isfinite(tied), tied, normal)
        # The two sides of a joint: never stiffer than that was, or they would jump apart when it breaks closed.
        normal = np.where((shared > 0.0) & (tied < normal), tied, normal)
        shear = np.fmin(self.shear[i], other.shear[j])
        out = np.empty((len(i), 3 + contact.DAMPER))
        out[:, 0], out[:, 1] = normal, np.where(np.isnan(shear), normal, shear)
        out[:, 2] = np.minimum(self.tan_phi[i], other.tan_phi[j])
        per_i, per_j = self.edge[i] / self.double_area[i], other.edge[j] / other.double_area[j]
        alone_i, alone_j = (
            np.where(shared > 0.0, 1.0 / area, per)
            for area, per in ((self.double_area[i], per_i), (other.double_area[j], per_j))
        )
        most = np.minimum(self.most[i], other.most[j])
        for side, alone in enumerate((alone_j, alone_i)):
            out[:, 3 + contact.LARGEST_STRESS + side] = most * (alone / (alone_i + alone_j))
        out[:, 3 + contact.EXPONENT] = np.maximum(self.exponent[i], other.exponent[j])
        out[:, 3 + contact.DASHPOT] = 0.0
        if not self.ratio.any() and not other.ratio.any():
            return out
        mass = 1.0 / (self.nodes * (per_i / self.density[i] + per_j / other.density[j]))
        damped = np.maximum(self.ratio[i], other.ratio[j])
        out[:, 3 + contact.DASHPOT] = damped * np.sqrt(self.slope * normal * (per_i + per_j) * mass)
        return out


class ElementTables(Protocol):
    """Tables of elements that contact uses (local.py). triangle_of_row (n_own,): place of an owned element among the
    triangles, -1: none; quad_rows: storage rows of the quads; head: one word per block of triangles."""

    triangle_of_row: np.ndarray
    quad_rows: np.ndarray
    head: np.ndarray

    @property
    def shapes(self) -> Shapes:
        """Shapes of the elements held here, by storage row."""

    @property
    def kinds(self) -> Kinds:
        """Return the rows that determine the properties of faces in contact."""


class Bodies:
    """Triangles, or halves of quads, of the elements in storage rows `rows` that have a corner on the surface; inner:
    of all of them.

    element (n,), row: its storage row, half, quad (bool), number; start: its first corner; x_place, v_place: where its
    corners begin in x and v (flat); free: bits of the edges that are free faces; face: the one whose properties count,
    -1: none; several: 1 if it can be touched at faces of several kinds.
    """

    def __init__(self, sim: State, tables: ElementTables, rows: np.ndarray, inner: bool = False) -> None:
        mesh = sim.mesh
        assert mesh is not None
        e = sim.number[rows]
        quad = mesh.cells[e, 3] >= 0
        halves = np.where(quad, 2, 1)
        of_row = np.repeat(np.arange(len(rows)), halves)
        half = np.arange(len(of_row)) - np.repeat(np.cumsum(halves) - halves, halves)
        element = e[of_row]
        start = np.where(quad[of_row], sim.cut[element] + 2 * half, 0)
        free, face, several = (np.empty(len(element), np.int64) for _ in range(3))
        if len(element):
            args = *_topology(sim, tables, element, start), free, face, several, np.empty((0, 5))
            touched_faces(*args)
        keep = (face >= 0) | inner  # the half of a quad may be away from the surface
        self.element, self.row, self.half, self.quad = (a[keep] for a in (element, rows[of_row], half, quad[of_row]))
        self.number = 2 * self.element + self.half
        self.start, self.free, self.face, self.several = (a[keep] for a in (start, free, face, several))
        width_x, width_v = sim.x.shape[1], sim.v.shape[1]
        self.x_place, self.v_place = self.row * width_x + 2 * self.start, self.row * width_v + 2 * self.start


def _topology(sim: State, tables: ElementTables, element: np.ndarray, start: np.ndarray) -> Any:
    """The first arguments of `touched_faces`."""
    mesh = sim.mesh
    assert mesh is not None
    return (
        element, start, mesh.points, mesh.cells, sim.partner, sim.closed_faces(), *tables.kinds,
    )  # fmt: skip


class ContactPairs(Bodies):
    """Rows of pairs of bodies near each other, in ascending order of their numbers; empty without collision."""

    def __init__(
        self, sim: State, tables: ElementTables, low: np.ndarray, high: np.ndarray, values: np.ndarray
    ) -> None:
        """low, high (k,), values (k, 18): numbers of two bodies and what the pair remembers."""
        self.threads = sim.threads
        mesh = sim.mesh
        assert mesh is not None
        rows = np.empty(0, np.int64)
        if sim.options.collision:
            _, flags = tables.kinds, np.empty(len(sim.number), bool)  # collective: not only where there is contact
            touched_rows(sim.number, mesh.cells, sim.per_node(lambda: points_of_surface(sim)), flags)
            rows = np.flatnonzero(flags)
        super().__init__(sim, tables, rows)
        own = sim.owned
        owned = (self.row >= own.start) & (self.row < own.stop)
        self._make_list(sim, tables, owned)
        self._put_histories(low, high, values)
        self._make_entries(sim, tables, owned)

    def _make_list(self, sim: State, tables: ElementTables, owned: np.ndarray) -> None:
        """Pairs that may touch, and their properties."""
        mesh = sim.mesh
        assert mesh is not None
        box, around = np.empty((len(self.row), 4)), np.empty((len(self.row), 4))
        closed = np.empty(0, bool)
        if len(box):
            detect.boxes(self.x_place, self.free, sim.x, sim.rebuild_state.skin, box, around)
            closed = sim.closed_faces()
        first, second = detect.find(
            box, around, self.element, self.number, owned, mesh.cells, sim.partner, closed
        )  # fmt: skip
        if not sim.touches.all():
            keep = sim.touches[self.element[first]] & sim.touches[self.element[second]]
            first, second = first[keep], second[keep]
        code = self.quad[first] + 2 * self.quad[second] + 4 * self.free[first] + 32 * self.free[second]
        bodies = Surfaces(sim, tables.shapes, self.face, self.row)
        shared, overlay = self._shared_faces(sim, self.element[first], self.element[second])
        laws = bodies.of_pairs(first, bodies, second, shared, overlay)
        self.chosen, self.choice_begin = np.zeros(0, np.int64), np.zeros(1, np.int64)
        self.choices = np.zeros((0, contact.CHOICE))
        varied = (self.several[first] | self.several[second]) > 0
        if varied.any():
            pair, code, laws = self._vary(sim, tables, first, second, code, laws, shared, overlay, varied)
            first, second = first[pair], second[pair]
        self.first, self.second = first, second
        m = len(first)
        self.table = np.zeros((m + 4, contact.PAIR))
        self.table[:m, :3], self.table.view(np.int64)[:m, contact.CODE] = laws[:, :3], code
        self.history = np.zeros((m + 4, contact.EDGES))
        self.dampers, self.largest = np.zeros((0, contact.DAMPER)), np.zeros((0, 2 * contact.EDGES))
        if not sim.options.dynamic:
            laws[:, 3 + contact.DASHPOT] = self.choices[:, contact.PROPERTIES + 3 + contact.DASHPOT] = 0.0
        every = np.concatenate([laws[:, 3:], self.choices[:, contact.PROPERTIES + 3 :]])
        most, exponent, dashpot = every[:, [contact.LARGEST_STRESS, contact.EXPONENT, contact.DASHPOT]].T
        if (np.isfinite(most) | (exponent != 1.0) | (dashpot > 0.0)).any():
            self.dampers = np.zeros((m + 4, contact.DAMPER))
            self.dampers[:m] = laws[:, 3:]
            self.largest = np.zeros((m + 4, 2 * contact.EDGES))
        self.touching = np.zeros(m, np.uint8)
        self.out = np.zeros((m, 12))

    def _vary(
        self, sim: State, tables: ElementTables, first: np.ndarray, second: np.ndarray, code: np.ndarray,
        laws: np.ndarray, shared: np.ndarray, overlay: np.ndarray, varied: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """Rows of the list where faces of a pair differ: pair (m,), code and properties. Edges of a pair that meet the
        same properties stay together; one that meets a body with faces of several kinds has choices."""
        mesh, shapes = sim.mesh, tables.shapes
        assert mesh is not None
        at = np.flatnonzero(varied)
        which, edge = np.nonzero(code[at][:, None] >> np.arange(2, 8) & 1)
        pair = at[which]
        own, other = np.where(edge < 3, first[pair], second[pair]), np.where(edge < 3, second[pair], first[pair])
        corners = connectivity.corner_counts(mesh.cells[self.element[own]])
        face = 4 * self.element[own] + (self.start[own] + edge % 3) % corners
        of_edges = Surfaces(sim, shapes, face, self.row[own])
        # Every edge with every face at which its target can be touched.
        targets, place = np.unique(other, return_inverse=True)
        scratch = [np.empty(len(targets), np.int64) for _ in range(3)]
        known = np.empty((MOST_FACES * len(targets), 1 + contact.PROPERTIES))
        args = *_topology(sim, tables, self.element[targets], self.start[targets]), *scratch, known
        touched_faces(*args)
        known = known.reshape(len(targets), MOST_FACES, -1)[place]
        each, k = np.nonzero(known[:, :, 0] >= 0.0)
        known = known[each, k]
        of_targets = Surfaces(sim, shapes, known[:, 0].astype(np.int64), self.row[other[each]])
        found = of_edges.of_pairs(each, of_targets, np.arange(len(each)), shared[pair[each]], overlay[pair[each]])
        turned = np.flatnonzero(edge[each] >= 3)  # their own body is the second of the pair
        sides = slice(3 + contact.LARGEST_STRESS, 5 + contact.LARGEST_STRESS)
        found[turned, sides] = found[turned, sides][:, ::-1]
        begin = np.searchsorted(each, np.arange(len(pair)))
        differs = np.zeros(len(pair), bool)
        np.logical_or.at(differs, each, (found != found[begin[each]]).any(axis=1))
        # Edges that are alike in one row; those with choices, and pairs that are not varied, by themselves.
        kind = np.where(differs, 1.0 + edge, 0.0)
        keys = np.column_stack([pair, kind, found[begin]])
        rows, row = np.unique(keys, axis=0, return_inverse=True)
        bits = np.zeros(len(rows), np.int64)
        np.bitwise_or.at(bits, row.reshape(-1), 4 << edge)
        plain = np.flatnonzero(~varied)
        pairs = np.concatenate([plain, rows[:, 0].astype(np.int64)])
        codes = np.concatenate([code[plain], code[rows[:, 0].astype(np.int64)] % 4 + bits])
        made = np.concatenate([laws[plain], rows[:, 2:]])
        order = np.lexsort((codes, pairs))
        # Choices, in the order of the rows.
        of_row = np.empty(len(rows), np.int64)
        of_row[row.reshape(-1)] = np.arange(len(pair))
        chooses = np.append(np.zeros(len(plain)), rows[:, 1])[order].astype(bool)
        if chooses.any():
            q = of_row[order[chooses] - len(plain)]
            count = np.append(begin[1:], len(each))[q] - begin[q]
            self.chosen = np.where(chooses, np.cumsum(chooses) - 1, -1)
            self.choice_begin = np.concatenate([[0], np.cumsum(count)])
            taken = np.repeat(begin[q] - self.choice_begin[:-1], count) + np.arange(int(count.sum()))
            self.choices = np.hstack([known[taken, 1:], found[taken]])
        return pairs[order], codes[order], made[order]

    @staticmethod
    def _shared_faces(sim: State, e: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Length squared (m,) [m2] of the face that elements e and f have in common in the mesh, 0 without one, and the
        overlay penalty [Pa] of the joint that was there, NaN without one."""
        mesh = sim.mesh
        assert mesh is not None
        out, penalty = np.zeros(len(e)), np.full(len(e), np.nan)
        overlay = np.array(sim.joint_rows.column("penalty_overlay", np.nan))
        overlay[0] = np.nan
        for k in range(4):
            over = sim.partner[4 * e + k]
            at = np.flatnonzero((over >= 0) & (over // 4 == f))
            ends = connectivity.face_points(mesh.cells, 4 * e[at] + k)
            way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
            out[at] = (way * way).sum(axis=1)
            penalty[at] = overlay[sim.joint_row[4 * e[at] + k]]
        return out, penalty

    def __len__(self) -> int:
        return len(self.first)

    def _put_histories(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> None:
        if len(low) and len(self):
            put_histories(
                self.number[self.first], self.number[self.second], self.table, low, high, values, self.history,
                self.largest, self.touching,
            )  # fmt: skip

    def changed_by_forces(self) -> tuple[np.ndarray, ...]:
        """The part of the memory of contacts that the computation of forces changes."""
        return self.history, self.largest, self.touching

    def known(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers of the bodies of pairs that remember something, and what."""
        m = len(self)
        some = self.history[:m].any(axis=1)
        if len(self.largest):
            some |= self.largest[:m].any(axis=1)
        used = np.flatnonzero(some)
        values = np.zeros((len(used), 3 * contact.EDGES))
        values[:, : contact.EDGES] = self.history[used]
        if len(self.largest):
            values[:, contact.EDGES :] = self.largest[used]
        used, values = self.by_pairs(used, values)
        return self.number[self.first[used]], self.number[self.second[used]], values

    def by_pairs(self, at: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reduce rows `at` (ascending) with values (n, c) to pairs: the first row of each pair, and sums over its
        rows."""
        first, second = self.first[at], self.second[at]
        new = np.flatnonzero(np.diff(first, prepend=-1) | np.diff(second, prepend=-1))
        return (at, values) if len(new) == len(at) else (at[new], np.add.reduceat(values, new))

    @staticmethod
    def named(element: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Name pairs from rows of histories.py of the elements `element` (k,)."""
        key = rows.view(np.int64)[:, KEY]
        own, other = 2 * element + key % 2, key // 2
        return np.minimum(own, other), np.maximum(own, other), rows[:, FIRST:]

    @staticmethod
    def remembered(sim: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pairs from the histories of the owned elements."""
        at = np.flatnonzero(sim.histories.keys() >= 0)
        return ContactPairs.named(sim.number[sim.owned][sim.histories.owners()[at]], sim.histories.rows[at])

    def _make_entries(self, sim: State, tables: ElementTables, owned: np.ndarray) -> None:
        """Owned elements of the pairs, and which pairs act on each of them, in the order of partners."""
        m = len(self)
        pair = np.repeat(np.arange(m), 2)
        side = np.tile([0, 1], m)
        body = np.column_stack([self.first, self.second]).reshape(-1)
        keep = owned[body] if m else np.empty(0, bool)
        pair, side, body = pair[keep], side[keep], body[keep]
        rows, slot = np.unique(self.row[body], return_inverse=True)
        order = np.argsort(slot, kind="stable")
        self.entry = (2 * pair + side)[order]
        self.entry_start = self.start[body][order]
        self.begin = np.concatenate(([0], np.cumsum(np.bincount(slot, minlength=len(rows))))).astype(np.int64)
        self.rows = rows
        mesh = sim.mesh
        assert mesh is not None
        self.corners = np.where(mesh.cells[sim.number[rows], 3] >= 0, 4, 3)
        self.pushed = np.zeros((max(len(rows), 1), elements.FORCE))
        # Which lane of which block of triangles, and which quads, take them.
        of_triangle = tables.triangle_of_row[rows - sim.n_left] if len(rows) else rows
        at = np.flatnonzero(of_triangle >= 0)
        block, lane = of_triangle[at] // elements.BLOCK, of_triangle[at] % elements.BLOCK
        self.lane, self.slot = lane, at
        self.block_begin = np.concatenate(([0], np.cumsum(np.bincount(block, minlength=len(tables.head))))).astype(
            np.int64
        )
        self.quad_slot = np.full(len(tables.quad_rows), -1, np.int64)
        if len(rows):
            others = np.flatnonzero(of_triangle < 0)
            self.quad_slot[np.searchsorted(tables.quad_rows, rows[others])] = others

    def forces(self, x: np.ndarray, v: np.ndarray, dt: float) -> None:
        """Contact forces at the present positions; histories move on by dt."""
        contact.forces(
            self.threads, self.first, self.second, self.x_place, self.v_place, x, v, self.table, self.history,
            self.dampers, self.largest, self.chosen, self.choice_begin, self.choices, self.touching, self.out, dt,
        )  # fmt: skip
        contact.collect(
            self.threads, self.begin, self.entry, self.entry_start, self.corners, self.touching, self.out, self.pushed
        )

    def parts(self, x: np.ndarray) -> np.ndarray:
        """Present depth of overlap of pairs over an altitude (m,)."""
        part = np.zeros(len(self))
        contact.parts(self.threads, self.first, self.second, self.x_place, x, self.table, self.touching, part)
        return part

    def depths_of(self, at: np.ndarray, x: np.ndarray, depth: np.ndarray) -> None:
        """Write depth [m] and position of the overlap of the pairs `at` into depth (n, 3)."""
        contact.depths(self.first[at], self.second[at], self.free, self.x_place, x, depth)

    def histories(self, sim: State) -> tuple[np.ndarray, np.ndarray]:
        """Owned element (0 ..) and row (histories.py) of each pair that remembers something, for both its elements."""
        low, high, values = self.known()
        owners, parts = [], []
        for mine, other in ((low, high), (high, low)):
            row = sim.where[mine // 2] - sim.n_left
            at = np.flatnonzero((row >= 0) & (row < sim.n_own))
            rows = np.zeros((len(at), WORDS))
            rows.view(np.int64)[:, KEY] = 2 * other[at] + mine[at] % 2
            rows[:, FIRST:] = values[at]
            owners.append(row[at])
            parts.append(rows)
        return np.concatenate(owners), np.concatenate(parts)


def points_of_surface(sim: State) -> np.ndarray:
    """(np,) bool: points of the mesh at which a free face ends."""
    mesh = sim.the_mesh()
    out = np.zeros(len(mesh.points), bool)
    surface_points(mesh.cells, sim.alive, sim.closed_faces(), out)
    return out


MOST_FACES = 9
"""At which a body can be touched: its own edges, and two at each of its corners."""


@njit(cache=True, nogil=True, error_model="numpy")
def surface_points(cells, alive, closed, out):
    """Flag the points of the mesh at which a free face ends."""
    for e in range(len(cells)):
        if alive[e]:
            n = 4 if cells[e, 3] >= 0 else 3
            for k in range(n):
                if not closed[4 * e + k]:
                    out[cells[e, k]] = out[cells[e, (k + 1) % n]] = True


@njit(cache=True, nogil=True, error_model="numpy")
def touched_rows(number, cells, on_surface, out):
    """Flags of the elements with a corner on the surface."""
    for i in range(len(number)):
        out[i] = False
        for k in range(4 if cells[number[i], 3] >= 0 else 3):
            out[i] |= on_surface[cells[number[i], k]]


@njit(cache=True, nogil=True, error_model="numpy")
def _like(f, g, model, joint_row, joint, element_row, body):
    """Return whether two faces have the same properties: see `Kinds`."""
    if model[f] != model[g]:
        return False
    return model[f] > 0 or (
        joint[joint_row[f]] == joint[joint_row[g]] and body[element_row[f >> 2]] == body[element_row[g >> 2]]
    )


@njit(cache=True, error_model="numpy")
def _wrapped(k, n):
    """k modulo n, for k below 2 n (a division would take as long as the rest)."""
    return k - n if k >= n else k


@njit(cache=True, nogil=True, error_model="numpy")
def touched_faces(
    element, start, points, cells, partner, closed, model, joint_row, joint, element_row, body, alike, free, face,
    several, found
):  # fmt: skip
    """Return the faces at which bodies can be touched: their own free edges, and the free faces that end, or begin,
    where a corner of theirs is on the surface (found from element to element through closed faces). model ... alike:
    see `Kinds`.

    free (n,): bits of the free edges; face (n,): the first of the faces, -1: none; several (n,): 1 if others have other
    properties. found (n * MOST_FACES, 5), or without rows: number of each face, then CORNER ... ALONG_3 of contact.py;
    the number is -1 where there is no more.
    """
    for i in range(len(element)):
        e = element[i]
        n = 4 if cells[e, 3] >= 0 else 3
        free[i], face[i], several[i] = 0, -1, 0
        at = i * MOST_FACES
        for a in range(at, min(at + MOST_FACES, len(found))):
            found[a, 0] = -1.0
        for turn in range(9):
            if alike and turn >= 3 and face[i] >= 0:
                break
            # Own edges first, then around the corners: faces that begin there, faces that end there.
            corner = turn if turn < 3 else (turn - 3) >> 1
            end = 1.0 if turn < 3 or turn & 1 == 1 else -1.0
            b, k = e, _wrapped(start[i] + corner, n)
            f = 4 * b + (k if end > 0.0 else _wrapped(k + n - 1, n))
            if turn < 3:
                if closed[f] or (n == 4 and turn == 2):
                    continue
                free[i] |= 1 << turn
            else:
                for _ in range(1000):
                    if not closed[f]:
                        break
                    b, k = partner[f] >> 2, partner[f] & 3
                    nb = 4 if cells[b, 3] >= 0 else 3
                    if end > 0.0:
                        k = _wrapped(k + 1, nb)
                        f = 4 * b + k
                    else:
                        f = 4 * b + _wrapped(k + nb - 1, nb)
                    if b == e:
                        break
                if closed[f]:
                    continue
            if face[i] < 0:
                face[i] = f
            elif not _like(face[i], f, model, joint_row, joint, element_row, body):
                several[i] = 1
            if len(found) > 0:
                p = points[cells[e, start[i] % n]]
                two, three = points[cells[e, (start[i] + 1) % n]] - p, points[cells[e, (start[i] + 2) % n]] - p
                det = two[0] * three[1] - two[1] * three[0]
                nb = 4 if cells[f // 4, 3] >= 0 else 3
                way = points[cells[f // 4, (f % 4 + 1) % nb]] - points[cells[f // 4, f % 4]]
                found[at, 0], found[at, 1], found[at, 2] = f, corner, end
                found[at, 3] = (way[0] * three[1] - way[1] * three[0]) / det
                found[at, 4] = (two[0] * way[1] - two[1] * way[0]) / det
                at += 1


@njit(cache=True, nogil=True, error_model="numpy")
def put_histories(first, second, table, low, high, values, history, largest, touching):
    """Give the rows of the list, of which first and second ascend, what the pairs (low, high) remember: to each edge
    what is there for it."""
    for i in range(len(low)):
        a, b = 0, len(first)
        while a < b:
            middle = (a + b) // 2
            if first[middle] < low[i] or (first[middle] == low[i] and second[middle] < high[i]):
                a = middle + 1
            else:
                b = middle
        while a < len(first) and first[a] == low[i] and second[a] == high[i]:
            code = as_bits(table[a, contact.CODE]) >> 2
            for k in range(contact.EDGES):
                if code >> k & 1:
                    history[a, k] = values[i, k]
                    if len(largest) > 0:
                        largest[a, k] = values[i, contact.EDGES + k]
                        largest[a, contact.EDGES + k] = values[i, 2 * contact.EDGES + k]
            touching[a] = 1
            a += 1
