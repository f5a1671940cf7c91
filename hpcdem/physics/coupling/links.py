"""Pairs of discs and nearby free faces, and the messages between their owners, from one search to the next.

The strips of the particles and those of the blocks stay what they are. At a search all ranks learn the boxes around
each one's discs, the free faces in a box go there, and the owners of discs answer which faces have a disc near. Every
step the ends of these faces travel to the owners of the discs, who compute the contacts, and their forces travel back;
the owner of a face adds them up in the order of gids. The sums do not depend on the ranks, and only ranks that share a
contact exchange messages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.cells import keys
from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.fields import GID, RADIUS, X, Y
from hpcdem.physics.coupling.kernels import disc_faces
from hpcdem.physics.coupling.kernels.disc_faces import ENDS, SCRATCH
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.kernels.elements import FORCE
from hpcdem.physics.fdem.simulation import Blocks

TO_DISCS, TO_FACES = 41, 42
"""MPI tags of the messages to discs and to faces."""


@dataclass
class Touching:
    """Memory of contacts: of the disc gid (n,) i8 with the face (n,) i8, the friction force (n,) [N]."""

    gid: np.ndarray
    face: np.ndarray
    friction: np.ndarray

    @staticmethod
    def nothing() -> Touching:
        """Return an empty set of contacts."""
        return Touching(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))


def face_frictions(blocks: Blocks) -> np.ndarray:
    """Coefficients of friction of the kinds of faces (see `kinds`): inf, those of the contact models, of the joints."""
    of = (np.tan(np.radians(rows.column("friction")[1:])) for rows in (blocks.face_rows, blocks.joint_rows))
    return np.concatenate([[math.inf], *of])


def kinds(blocks: Blocks, faces: np.ndarray) -> np.ndarray:
    """Row of the table of laws for each face: that of the element model, plus the number of these for each kind of
    face: without friction of its own, with a contact model, of what was a joint."""
    model, joint = blocks.face_row[faces], blocks.joint_row[faces]
    kind = np.where(model > 0, model, np.where(joint > 0, len(blocks.face_rows) - 1 + joint, 0))
    return blocks.element_row[faces // 4] + len(blocks.element_rows) * kind


class Link:
    """The contacts that can come about while discs and faces have not approached each other by more than `margin` [m].
    Collective.

    Arrays of discs and slots are those of physics/coupling/kernels/disc_faces.py; face_row, face_k, face_k2,
    face_force: of owned faces with discs near, in ascending order.
    """

    def __init__(self, particles: Simulation, blocks: Blocks, margin: float, known: Touching) -> None:
        self.comm = particles.comm
        self.particles, self.blocks = particles, blocks
        self.margin = margin
        self.made_for = particles.rebuilds, blocks.rebuilds, particles.closed
        p = particles.particles
        self._rows = np.arange(p.owned.start, p.owned.stop)
        self.origin, self.corners = p.positions(), blocks.x[blocks.owned].copy()
        faces, sources = self._faces_near()
        pairs = self._pairs(faces)
        self._make_slots(faces, pairs)
        self._make_messages(faces, sources)
        self._remember(known)

    def stop_on_breakthrough(self, gid: int) -> None:
        """PhysicsError: the centre of this disc, on some rank, has gone into an element."""
        p = self.particles.particles
        rows = np.flatnonzero(p.ihot[p.owned, GID] == gid) + p.owned.start
        mine = [(float(p.hot[i, X]), float(p.hot[i, Y])) for i in rows]
        ((x, y),) = [place for part in self.comm.allgather(mine) for place in part]
        raise PhysicsError(
            f"step {self.blocks.clock.step}: the centre of particle {gid}, now at ({x:g}, {y:g}), passed through the "
            "surface of an element; its stiffness is too small for this load, or the time step too large"
        )

    # ---- search ------------------------------------------------------------------------------------------------------

    def _reached(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the rectangles from `low` to `high` (n, 2) [m] that overlap the box of a rank's discs and the margin
        around them: rows (m,) and ranks (m,) i8, row by row. Collective.

        Ranks own strips from left to right: to the left of those that can be meant all boxes end before the rectangle,
        to their right all begin behind it.
        """
        comm, hot = self.comm, self.particles.particles.hot[self._rows]
        box = np.full((comm.size, 4), -math.inf)  # -left, right, -bottom, top
        if len(hot):
            x, y, r = hot[:, X], hot[:, Y], hot[:, RADIUS] + self.margin
            box[comm.rank] = -(x - r).min(), (x + r).max(), -(y - r).min(), (y + r).max()
        comm.max_into(box)
        left, right, bottom, top = box.T * np.array([[-1.0], [1.0], [-1.0], [1.0]])
        first = np.searchsorted(np.maximum.accumulate(right), low[:, 0], side="right")
        end = np.searchsorted(np.minimum.accumulate(left[::-1])[::-1], high[:, 0])
        number = np.maximum(end - first, 0)
        row = np.repeat(np.arange(len(low)), number)
        rank = np.arange(len(row)) + np.repeat(first - (np.cumsum(number) - number), number)
        meets = (high[row, 0] > left[rank]) & (low[row, 0] < right[rank])
        meets &= (high[row, 1] > bottom[rank]) & (low[row, 1] < top[rank])
        return row[meets], rank[meets]

    def _faces_near(self) -> tuple[np.ndarray, np.ndarray]:
        """Free faces of all ranks in the box of this one: (n, 6) number, row of the table of laws, ends; and the rank
        (n,) of each."""
        blocks = self.blocks
        own = blocks.owned
        number = blocks.number[own]
        cells = blocks.the_mesh().cells[number]
        there = (
            ~blocks.closed_faces()[4 * number[:, None] + np.arange(4)] & (cells >= 0) & blocks.alive[number][:, None]
        )
        i, k = np.nonzero(there)
        k2 = (k + 1) % corner_counts(cells)[i]
        x = blocks.x[own]
        ends = np.column_stack([x[i, 2 * k], x[i, 2 * k + 1], x[i, 2 * k2], x[i, 2 * k2 + 1]]).reshape(-1, 4)
        table = np.column_stack([4 * number[i] + k, kinds(blocks, 4 * number[i] + k), ends]).reshape(-1, 6)
        low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
        row, rank = self._reached(low, high)
        sources, arrived = self.comm.to_ranks(rank, table[row])
        return arrived, sources

    def _discs_by_cells(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Discs near the rectangle around places (n, 2): rows in the order of cells, keys of these, side of a cell."""
        hot = self.particles.particles.hot
        rows = self._rows
        side = (float(hot[rows, RADIUS].max()) if len(rows) else 1.0) + self.margin
        if not len(places) or not len(rows):
            return rows[:0], np.empty(0, np.int64), side
        low, high = places.min(axis=0) - side, places.max(axis=0) + side
        x, y = hot[rows, X], hot[rows, Y]
        rows = rows[(x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])]
        key = keys(hot[rows], side)
        order = np.argsort(key, kind="stable")
        return rows[order], key[order], side

    def _pairs(self, faces: np.ndarray) -> np.ndarray:
        """(n, 2) row of the disc and of the face."""
        rows, key, side = self._discs_by_cells(faces[:, 2:].reshape(-1, 2))
        hot, places = self.particles.particles.hot, np.ascontiguousarray(faces[:, 2:])
        pairs = np.empty((4 * len(rows) + 16, 2), np.int64)
        n = int(disc_faces.near(hot, rows, key, side, places, self.margin, pairs))
        if n > len(pairs):
            pairs = np.empty((n, 2), np.int64)
            disc_faces.near(hot, rows, key, side, places, self.margin, pairs)
        return pairs[:n]

    def _make_slots(self, faces: np.ndarray, pairs: np.ndarray) -> None:
        """Discs with a face near, and their slots by the number of the face."""
        blocks = self.blocks
        self._used, face = np.unique(pairs[:, 1], return_inverse=True)
        number = faces[self._used, 0].astype(np.int64)
        self.face_model = faces[self._used, 1].astype(np.int64)
        self.ends = np.zeros((len(number), ENDS))
        self.ends[:, :4] = faces[self._used, 2:]
        order = np.lexsort((number[face], pairs[:, 0]))
        self.slot_face = face[order].astype(np.int64)
        self.slot_number = number[self.slot_face]
        self.disc_row, each = np.unique(pairs[order, 0], return_counts=True)
        self.disc_begin = np.concatenate([[0], np.cumsum(each)]).astype(np.int64)
        gid = self.particles.particles.ihot[self.disc_row, GID].copy()
        self.slot_gid = np.repeat(gid, each)
        n = len(self.slot_face)
        before, after = np.empty(len(number), np.int64), np.empty(len(number), np.int64)
        disc_faces.neighbours_along(
            number, blocks.the_mesh().cells, blocks.partner, blocks.closed_faces(), before, after
        )  # fmt: skip
        self.slot_before, self.slot_after = np.empty(n, np.int64), np.empty(n, np.int64)
        disc_faces.link(
            self.disc_begin, self.slot_number, before[self.slot_face], after[self.slot_face], self.slot_before,
            self.slot_after,
        )  # fmt: skip
        self.slot_on, self.slot_fs = np.zeros(n, bool), np.zeros(n)
        self.disc_force, self.slot_force = np.zeros((len(self.disc_row), 3)), np.zeros((n, 4))
        self.seen = np.zeros((int(each.max(initial=1)), SCRATCH))

    def _remember(self, known: Touching) -> None:
        """Friction of contacts that touched before the search. Collective."""
        gids = self.particles.particles.ihot[self._rows, GID]
        trail = self.particles.trail
        mine = Touching(*trail.follow(self.comm, gids, known.gid, known.face, known.friction))
        trail.begin()
        at = np.flatnonzero(np.isin(self.slot_gid, mine.gid))
        slots = dict(zip(zip(self.slot_gid[at].tolist(), self.slot_number[at].tolist()), at.tolist()))
        for gid, face, friction in zip(mine.gid.tolist(), mine.face.tolist(), mine.friction.tolist()):
            slot = slots.get((gid, face), -1)
            if slot >= 0:
                self.slot_on[slot], self.slot_fs[slot] = True, friction

    def touching(self) -> Touching:
        """Memory of the contacts of discs of this rank."""
        on = self.slot_on
        return Touching(self.slot_gid[on], self.slot_number[on], self.slot_fs[on])

    def refuse_discs_inside(self) -> None:
        """CommandError if the centre of a disc is inside an element. Collective."""
        blocks = self.blocks
        own = blocks.owned
        number = blocks.number[own]
        x = blocks.x[own][:, :8]
        table = np.column_stack([number, x])[blocks.alive[number]]
        low, high = (
            np.column_stack([how(table[:, axis::2], axis=1, initial=far) for axis in (1, 2)])
            for how, far in ((np.min, math.inf), (np.max, -math.inf))
        )
        row, rank = self._reached(low, high)
        _, arrived = self.comm.to_ranks(rank, table[row])
        corners = np.ascontiguousarray(arrived[:, 1:])
        p = self.particles.particles
        rows, key, side = self._discs_by_cells(corners.reshape(-1, 2))
        found = disc_faces.centres_inside(p.hot, p.ihot, rows, key, side, corners, arrived[:, 0].astype(np.int64))
        every = [pair for pair in self.comm.allgather((int(found[0]), int(found[1]))) if pair[0] >= 0]
        if every:
            gid, element = min(every)
            raise CommandError(f"the centre of particle {gid} lies inside element {element}: move the particle outside")

    # ---- messages ----------------------------------------------------------------------------------------------------

    def _make_messages(self, faces: np.ndarray, sources: np.ndarray) -> None:
        """Agree with the others on what travels in each step."""
        blocks, comm = self.blocks, self.comm
        owner = sources[self._used]
        askers, wanted = comm.to_ranks(owner, faces[self._used, 0].astype(np.int64))
        cells = blocks.the_mesh().cells

        def corners(of: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            e, k = np.divmod(of, 4)
            return blocks.where[e], k, (k + 1) % corner_counts(cells[e])

        self._asked = {rank: corners(wanted[of]) for rank, of in _runs(askers).items()}
        self._outgoing = {rank: np.empty((len(rows), ENDS)) for rank, (rows, *_) in self._asked.items()}
        self._ends = {rank: self.ends[of] for rank, of in _runs(owner).items()}
        # The way back: slots by the owner of their face.
        to = owner[self.slot_face]
        by_owner = np.argsort(to, kind="stable")
        self._slots = {rank: by_owner[of] for rank, of in _runs(to[by_owner]).items()}
        self._back = {rank: np.zeros((len(slots), 4)) for rank, slots in self._slots.items()}
        senders, gid, face = comm.to_ranks(to, self.slot_gid, self.slot_number)
        self._arrived = np.zeros((len(gid), 4))
        self._pieces = {rank: self._arrived[of] for rank, of in _runs(senders).items()}
        self._order = np.lexsort((gid, face))
        self.face_number, self._of_face = np.unique(face, return_inverse=True)
        self.face_row, self.face_k, self.face_k2 = corners(self.face_number)
        self.face_force = np.zeros((len(self.face_number), 4))
        self._to_discs: list[Any] = []
        self._to_faces: list[Any] = []
        if comm.mpi is None:
            return
        for into, outof, incoming, tag in (
            (self._to_discs, self._outgoing, self._ends, TO_DISCS),
            (self._to_faces, self._back, self._pieces, TO_FACES),
        ):  # fmt: skip
            others = (incoming.keys() | outof.keys()) - {comm.rank}
            for rank in sorted(others):
                if rank in incoming:
                    into.append(comm.mpi.Recv_init(_bytes(incoming[rank]), rank, tag))
                if rank in outof:
                    into.append(comm.mpi.Send_init(_bytes(outof[rank]), rank, tag))

    def _travel(self, requests: list[Any], outof: dict[int, np.ndarray], into: dict[int, np.ndarray]) -> None:
        comm: Comm = self.comm
        if requests:
            comm.start_all(requests)
        if comm.rank in into:
            into[comm.rank][:] = outof[comm.rank]
        if requests:
            comm.wait_all(requests)

    def fetch(self) -> None:
        """The ends of faces, where they are now, to the owners of the discs. Collective."""
        x, v = self.blocks.x, self.blocks.v
        timers = self.blocks.timers
        with timers("couple"):
            for rank, (rows, k, k2) in self._asked.items():
                disc_faces.pack(rows, k, k2, x, v, self._outgoing[rank])
        with timers("exchange"):
            self._travel(self._to_discs, self._outgoing, self._ends)

    def deliver(self) -> None:
        """Forces of contacts to the owners of the faces, added up there by faces. Collective."""
        timers = self.blocks.timers
        with timers("couple"):
            for rank, slots in self._slots.items():
                np.take(self.slot_force, slots, axis=0, out=self._back[rank])
        with timers("exchange"):
            self._travel(self._to_faces, self._back, self._pieces)
        with timers("couple"):
            disc_faces.gather(self._order, self._of_face, self._arrived, self.face_force)

    def apply(self, applied: np.ndarray) -> None:
        """Add the forces of faces to those applied to corners (n, 8) [N]."""
        assert applied.shape[1] == FORCE
        disc_faces.apply(self.face_force, self.face_row, self.face_k, self.face_k2, applied)

    def close(self) -> None:
        """Give the requests back to MPI."""
        for request in self._to_discs + self._to_faces:
            request.Free()
        self._to_discs, self._to_faces = [], []


def _runs(ranks: np.ndarray) -> dict[int, slice]:
    """Begin of each rank in an ascending list."""
    found, first, number = np.unique(ranks, return_index=True, return_counts=True)
    return {rank: slice(a, a + n) for rank, a, n in zip(found.tolist(), first.tolist(), number.tolist())}


def _bytes(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(-1).view(np.uint8)
