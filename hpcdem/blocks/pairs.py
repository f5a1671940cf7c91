"""The contact list of a rank: bodies that may touch, what they remember, and where their forces go.

A body is a triangle, or half of a quad, cut along the diagonal that is shorter in the mesh; its number is element * 2 +
half. Of a quad's half the third edge lies inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from hpcdem.blocks.memories import FIRST, KEY, WORDS
from hpcdem.model.blocks import connectivity
from hpcdem.model.blocks.mesh import Mesh
from hpcdem.physics.fdem import contact, detect, elements

if TYPE_CHECKING:
    from hpcdem.blocks.local import Local
    from hpcdem.blocks.simulation import Core


def cut_corner(mesh: Mesh) -> np.ndarray:
    """(ne,) 0 where a quad is cut from its first corner to its third, 1 from the second to the fourth."""
    out = np.zeros(len(mesh.cells), np.int64)
    quads = np.flatnonzero(mesh.cells[:, 3] >= 0)
    a, b, c, d = (mesh.points[mesh.cells[quads, k]] for k in range(4))
    out[quads] = ((b - d) ** 2).sum(axis=1) < ((a - c) ** 2).sum(axis=1)
    return out


class Surfaces:
    """What contact needs to know of some elements: `numbers` (n,).

    normal, shear: penalties [Pa], NaN where they follow from the joints; tan_phi; most [Pa], exponent: normal damping;
    overlay: smallest overlay penalty of the element's joints [Pa], NaN without joints; young [Pa]; length (n, 4) of the
    edges [m]; double_area: twice the area of a body [m2]; slender: mean edge squared over that.
    """

    def __init__(self, sim: Core, numbers: np.ndarray) -> None:
        mesh = sim.mesh
        assert mesh is not None
        rows = sim.element_row[numbers]
        column = {n: np.array(sim.element_rows.column(n)) for n in ("young", "penalty", "friction")}
        self.young = column["young"][rows]
        faces = 4 * numbers[:, None] + np.arange(4)
        joint = sim.joint_row[faces]
        overlay = np.array(sim.joint_rows.column("penalty_overlay"))
        overlay[0] = np.inf
        self.overlay = overlay[joint].min(axis=1)
        friction = np.array(sim.joint_rows.column("friction"))
        friction[0] = np.inf
        of_joints = friction[joint].min(axis=1)
        jointed = np.isfinite(self.overlay)
        self.overlay[~jointed] = np.nan
        angle = np.where(jointed, of_joints, column["friction"][rows])
        self.normal = np.where(column["penalty"][rows] > 0.0, column["penalty"][rows], np.nan)
        self.shear = self.normal.copy()
        model = sim.face_row[faces]
        given = (model > 0).any(axis=1)
        for name, target in (("penalty_normal", self.normal), ("penalty_shear", self.shear), ("friction", angle)):
            values = np.array(sim.face_rows.column(name))
            values[0] = np.inf
            target[given] = values[model].min(axis=1)[given]
        self.tan_phi = np.tan(np.radians(angle))
        most, exponent = np.array(sim.face_rows.column("damping_t")), np.array(sim.face_rows.column("damping_b"))
        most[0], exponent[0] = np.inf, 1.0
        self.most, self.exponent = most[model].min(axis=1), exponent[model].max(axis=1)
        cells = mesh.cells[numbers]
        n = np.where(cells[:, 3] >= 0, 4, 3)
        xy = mesh.points[cells]
        self.length = np.zeros((len(cells), 4))
        for k in range(4):
            after = np.where(k + 1 < n, k + 1, 0)
            way = xy[np.arange(len(cells)), after] - xy[:, k]
            self.length[:, k] = np.where(k < n, np.hypot(way[:, 0], way[:, 1]), 0.0)
        edges = self.length.sum(axis=1)
        area = sim.areas[numbers]
        # A quad takes part as two triangles of half its area.
        self.double_area = 2.0 * area / (n - 2)
        self.slender = (edges / n) ** 2 / self.double_area

    def most_penalty(self, among: bool) -> np.ndarray:
        """Largest normal penalty (n,) [Pa] that any pair of an element can have; among: all elements of the model have
        joints and leave their contact to them."""
        usual = 10.0 * self.young
        tied = self.overlay / (3.0 * (self.slender + 1.0))  # no element is less slender than a square
        silent = np.where(np.isnan(tied), usual, tied if among else np.fmax(usual, tied))
        return np.where(np.isnan(self.normal), silent, self.normal)

    def of_pairs(
        self, other: Surfaces, i: np.ndarray, j: np.ndarray, shared: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal and shear penalty [Pa] and tan(phi) of pairs (element i of these, element j of the others).

        The smaller of both. Where neither says anything: the normal stress of two jointed elements goes on when the
        joint between them breaks closed, P = P_overlay / (3 h (1 / h_i + 1 / h_j)), h_i, h_j: altitudes on the joint of
        length h; otherwise 10 E. shared (m,) [m2]: length squared of the face between i and j in the mesh, 0: there is
        none (the mean edges then take its place).
        """
        both = np.minimum(self.overlay[i], other.overlay[j])
        slender = self.slender[i] + other.slender[j]
        if shared is not None:
            exact = shared / self.double_area[i] + shared / other.double_area[j]
            slender = np.where(shared > 0.0, exact, slender)
        tied = both / (3.0 * slender)
        usual_i, usual_j = 10.0 * self.young[i], 10.0 * other.young[j]
        silent = np.isnan(self.normal[i]) & np.isnan(other.normal[j])
        normal = np.fmin(np.where(np.isnan(self.normal[i]), usual_i, self.normal[i]),
                         np.where(np.isnan(other.normal[j]), usual_j, other.normal[j]))  # fmt: skip
        normal = np.where(silent & np.isfinite(tied), tied, normal)
        if shared is not None:
            # The two sides of a joint: never stiffer than that was, or they would jump apart when it breaks closed.
            normal = np.where((shared > 0.0) & (tied < normal), tied, normal)
        shear = np.fmin(np.where(np.isnan(self.shear[i]), np.inf, self.shear[i]),
                        np.where(np.isnan(other.shear[j]), np.inf, other.shear[j]))  # fmt: skip
        shear = np.where(np.isfinite(shear), shear, normal)
        return normal, shear, np.minimum(self.tan_phi[i], other.tan_phi[j])


class ContactPairs:
    """Pairs of bodies near each other, in ascending order of their numbers; empty without collision."""

    def __init__(self, sim: Core, local: Local, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> None:
        """low, high (k,), values (k, 18): numbers of two bodies and what the pair remembers."""
        self.threads = sim.threads
        rows = np.empty(0, np.int64)
        if sim.options.collision:
            exists, closed = sim.face_exists(), sim.closed_faces()
            flags = np.empty(len(sim.number), bool)
            build_rows(sim.number, exists, closed, flags)
            rows = np.flatnonzero(flags)
        mesh = sim.mesh
        assert mesh is not None
        e = sim.number[rows]
        quad = mesh.cells[e, 3] >= 0
        halves = np.where(quad, 2, 1)
        of_row = np.repeat(np.arange(len(rows)), halves)
        half = np.arange(len(of_row)) - np.repeat(np.cumsum(halves) - halves, halves)
        self.element, self.row, self.half = e[of_row], rows[of_row], half
        self.number = 2 * self.element + half
        self.start = np.where(quad[of_row], sim.cut[self.element] + 2 * half, 0)
        width_x, width_v = sim.x.shape[1], sim.v.shape[1]
        self.x_place, self.v_place = self.row * width_x + 2 * self.start, self.row * width_v + 2 * self.start
        own = sim.owned
        owned = (self.row >= own.start) & (self.row < own.stop)
        box = np.empty((len(self.row), 4))
        if len(box):
            detect.boxes(self.x_place, sim.x, sim.lattice.skin, box)
        closed = sim.closed_faces() if len(box) else np.empty(0, bool)
        first, second = detect.find(box, self.element, self.number, owned, mesh.cells, sim.partner, closed)
        self.first, self.second = first, second
        m = len(first)
        self.table = np.zeros((m + 4, contact.PAIR))
        self.memory = np.zeros((m + 4, contact.EDGES))
        self.dampers, self.largest = np.zeros((0, contact.DAMPER)), np.zeros((0, 2 * contact.EDGES))
        if m:
            surfaces, i, j = local.surfaces, self.row[first], self.row[second]
            shared = self._shared_faces(sim, self.element[first], self.element[second])
            normal, shear, tan_phi = surfaces.of_pairs(surfaces, i, j, shared)
            self.table[:m, 0], self.table[:m, 1], self.table[:m, 2] = normal, shear, tan_phi
            self.table[:m, 3] = quad[of_row[first]] + 2.0 * quad[of_row[second]]
            self._make_dampers(surfaces, i, j)
        self.touching = np.zeros(m, np.uint8)
        self.out = np.zeros((m, 12))
        self._put_memories(low, high, values)
        self._make_entries(sim, local, owned)

    def _make_dampers(self, surfaces: Surfaces, i: np.ndarray, j: np.ndarray) -> None:
        """Normal damping of the pairs (elements i, j), if any face asks for it: the smaller T, the larger exponent."""
        most = np.minimum(surfaces.most[i], surfaces.most[j])
        exponent = np.maximum(surfaces.exponent[i], surfaces.exponent[j])
        if np.isinf(surfaces.most).all() and (surfaces.exponent == 1.0).all():
            return
        self.dampers = np.zeros((len(i) + 4, contact.DAMPER))
        self.dampers[: len(i), contact.LARGEST_STRESS], self.dampers[: len(i), contact.EXPONENT] = most, exponent
        self.largest = np.zeros((len(i) + 4, 2 * contact.EDGES))

    @staticmethod
    def _shared_faces(sim: Core, e: np.ndarray, f: np.ndarray) -> np.ndarray:
        """Length squared (m,) [m2] of the face that elements e and f have in common in the mesh, 0 without one."""
        mesh = sim.mesh
        assert mesh is not None
        out = np.zeros(len(e))
        for k in range(4):
            over = sim.partner[4 * e + k]
            at = np.flatnonzero((over >= 0) & (over // 4 == f))
            ends = connectivity.face_points(mesh.cells, 4 * e[at] + k)
            way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
            out[at] = (way * way).sum(axis=1)
        return out

    def __len__(self) -> int:
        return len(self.first)

    def _put_memories(self, low: np.ndarray, high: np.ndarray, values: np.ndarray) -> None:
        if not len(low) or not len(self):
            return
        place = find_pairs(self.number[self.first], self.number[self.second], low, high)
        good = place >= 0
        self.memory[place[good]] = values[good, : contact.EDGES]
        if len(self.largest):
            self.largest[place[good]] = values[good, contact.EDGES :]
        self.touching[place[good]] = 1

    def known(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers of the bodies of pairs that remember something, and what."""
        m = len(self)
        some = self.memory[:m].any(axis=1)
        if len(self.largest):
            some |= self.largest[:m].any(axis=1)
        used = np.flatnonzero(some)
        values = np.zeros((len(used), 3 * contact.EDGES))
        values[:, : contact.EDGES] = self.memory[used]
        if len(self.largest):
            values[:, contact.EDGES :] = self.largest[used]
        return self.number[self.first[used]], self.number[self.second[used]], values

    @staticmethod
    def named(element: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same from rows of memories.py of the elements `element` (k,)."""
        key = rows.view(np.int64)[:, KEY]
        own, other = 2 * element + key % 2, key // 2
        return np.minimum(own, other), np.maximum(own, other), rows[:, FIRST:]

    @staticmethod
    def remembered(sim: Core) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same from the memories of the owned elements."""
        at = np.flatnonzero(sim.memories.keys() >= 0)
        return ContactPairs.named(sim.number[sim.owned][sim.memories.owners()[at]], sim.memories.rows[at])

    def _make_entries(self, sim: Core, local: Local, owned: np.ndarray) -> None:
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
        of_triangle = local.triangle_of_row[rows - sim.n_left] if len(rows) else rows
        at = np.flatnonzero(of_triangle >= 0)
        block, lane = of_triangle[at] // elements.BLOCK, of_triangle[at] % elements.BLOCK
        self.lane, self.slot = lane, at
        self.block_begin = np.concatenate(([0], np.cumsum(np.bincount(block, minlength=len(local.head))))).astype(
            np.int64
        )
        self.quad_slot = np.full(len(local.quad_rows), -1, np.int64)
        if len(rows):
            others = np.flatnonzero(of_triangle < 0)
            self.quad_slot[np.searchsorted(local.quad_rows, rows[others])] = others

    def forces(self, x: np.ndarray, v: np.ndarray, dt: float) -> None:
        """Contact forces at the present positions; histories move on by dt."""
        act, collect = (
            (contact.forces, contact.collect)
            if self.threads == 1
            else (contact.forces_threaded, contact.collect_threaded)
        )
        act(
            self.threads, self.first, self.second, self.x_place, self.v_place, x, v, self.table, self.memory,
            self.dampers, self.largest, self.touching, self.out, dt,
        )  # fmt: skip
        collect(
            self.threads, self.begin, self.entry, self.entry_start, self.corners, self.touching, self.out, self.pushed
        )

    def memories(self, sim: Core) -> tuple[np.ndarray, np.ndarray]:
        """Owned element (0 ..) and row (memories.py) of each pair that remembers something, for both its elements."""
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


@njit(cache=True, nogil=True, error_model="numpy")
def build_rows(number, exists, closed, out):
    """Flags of the elements with a free face."""
    for i in range(len(number)):
        out[i] = False
        for k in range(4):
            f = 4 * number[i] + k
            if exists[f] and not closed[f]:
                out[i] = True
                break


@njit(cache=True, nogil=True, error_model="numpy")
def find_pairs(first, second, low, high):
    """Places (n,) of the pairs (low, high) among (first, second), which ascend; -1 where there is none."""
    out = np.empty(len(low), np.int64)
    for i in range(len(low)):
        a, b = 0, len(first)
        while a < b:
            middle = (a + b) // 2
            if first[middle] < low[i] or (first[middle] == low[i] and second[middle] < high[i]):
                a = middle + 1
            else:
                b = middle
        out[i] = a if a < len(first) and first[a] == low[i] and second[a] == high[i] else -1
    return out
