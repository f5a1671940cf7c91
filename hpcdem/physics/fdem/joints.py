"""The joints of the elements that a rank holds, in the plane and in space: which law each has, what it remembers, and
what is queried of them between steps. `Local` and `LocalSpace` say where their faces lie and have the loops of a step.

A joint has a *slot* for each of its sides, the face of an owned element; both sides compute it, each by its own slot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hpcdem.core.errors import PhysicsError
from hpcdem.physics.fdem import build, by_temperature
from hpcdem.physics.fdem.histories import FIRST, KEY, STATE, WORDS
from hpcdem.physics.fdem.kernels import elements, joint_law, joint_points, joints_space
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN, INTACT, NONE
from hpcdem.physics.fdem.properties import BARTON_BANDIS, COHESIVE, COULOMB_JOINT, Rows, temperature_table
from hpcdem.physics.fdem.tetrahedra import FACES, STRIDE

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State

LAWS = {COULOMB_JOINT.name: joint_law.COULOMB, BARTON_BANDIS.name: joint_law.BARTON_BANDIS}
_BY_TEMPERATURE = tuple(one.name for one in COHESIVE.properties if one.temperature_dependent)
NOW: dict[int, tuple[Any, int]] = {2: (build.edges_now, 14), 3: (joints_space.faces_now, 22)}
"""Kernel of the present state of a joint by dimension, and into how many columns: means of opening, slip [m], normal
and shear stress [Pa]; these stresses at its three points; forces on the corners of this side [N/m], in space [N]."""
MEANS, POINTS, FORCES = 0, 4, 10
CORNERS = {2: 2 * (np.arange(4)[:, None] + np.arange(2)), 3: STRIDE * FACES}
"""By dimension, the offsets where the corners of the faces of an element begin in its row of x; in the plane the first
ones stand once more behind the last."""


def tables(rows: Rows, warm: Mapping[str, np.ndarray] | None = None, row: Any = slice(None)) -> tuple[
    np.ndarray, np.ndarray
]:  # fmt: skip
    """The tables of joint laws (n, 8) and (n, 4) of joint_law.py; row 0 is no joint. warm: properties (n,) that take
    the place of those of these rows (n,)."""
    return joint_law.tables(
        lambda name: warm[name] if warm and name in warm else rows.column(name)[row], laws_of(rows)[row]
    )


def laws_of(rows: Rows) -> np.ndarray:
    """(rows,) Numbers of their laws in joint_law.py."""
    return np.array([LAWS.get(rows.name(row), 0) for row in range(len(rows))])


class Joints(NamedTuple):
    """Tables of joints (n,) for kernels: slots; own, over (n, dim) i8: offsets in x, flat, of the corners of this side
    and of the other in its own order; per_h (n,) [1/m], in space: one over the length; by slots: row of the law, state,
    history."""

    slots: np.ndarray
    own: np.ndarray
    over: np.ndarray
    per_h: np.ndarray
    kind: np.ndarray
    state: np.ndarray
    history: np.ndarray
    x: np.ndarray


class JointTables:
    """slots: how many there are; by slots face, law (0: loops of elements leave it out), kind, state and history, see
    joint_law.py; head, follow: lists of those past their peak, `lists` of them for each `listed` slots, of the first
    `in_lists` slots; link: where the other side begins in x, in space each of its corners; size (slots,) [1/m], in
    space: one over the length; first_slot: of owned elements, None: four each; sides: joints of hexahedra."""

    sim: State
    temperature_dependent: bool
    slots: int
    in_lists: int
    listed: int
    lists: int = 1
    slot_face: np.ndarray
    slot_law: np.ndarray
    slot_kind: np.ndarray
    slot_state: np.ndarray
    slot_history: np.ndarray
    slot_link: np.ndarray
    slot_size = np.zeros(0)
    first_slot: np.ndarray | None = None
    head: np.ndarray
    follow: np.ndarray
    tally: np.ndarray
    sides: Any = None

    # ---- made at a rebuild ---------------------------------------------------------------------------------------

    def _make_joint_laws(self) -> None:
        """Make the tables of joint laws. Joints whose properties follow temperature have their own row on each side,
        after the rows of the properties."""
        rows = self.sim.joint_rows
        warm = [rows.column(temperature_table(name)) > 0.0 for name in _BY_TEMPERATURE]
        self.slots_by_temperature = np.flatnonzero(np.any(warm, axis=0)[self.slot_kind])
        self.law_by_temperature = self.slot_kind[self.slots_by_temperature].astype(np.int64)
        own = len(rows) + np.arange(len(self.slots_by_temperature))
        self.slot_law[self.slots_by_temperature] = self.slot_kind[self.slots_by_temperature] = own
        every = np.concatenate([np.arange(len(rows)), self.law_by_temperature])
        self.joint_table, self.joint_beyond = tables(rows, row=every)
        if (law := laws_of(rows)).any():
            slides = np.flatnonzero(law[self.slot_kind[: self.slots]])
            self.slot_law[slides], self.slot_state[slides] = 0, BROKEN + law[self.slot_kind[slides]]
            self._relink()
        if self.temperature_dependent:
            self._follow_joints()

    def _follow_joints(self) -> None:
        """The laws of joints at their temperatures."""
        sim, slots = self.sim, self.slots_by_temperature
        face = self.slot_face[slots]
        own, corners = sim.where[face // 4] - sim.n_left, (sim.the_mesh().face_corners(face) % 4).T

        @cache
        def mean(name: str) -> np.ndarray:
            first, *others = (sim.cold[name][own, k] for k in corners)
            # Both sides of a face in space begin at one corner and go round it the other way.
            return 0.5 * (first + others[0]) if len(others) == 1 else (first + (others[0] + others[1])) / 3.0

        rows, of = sim.joint_rows, self.law_by_temperature
        warm = {name: by_temperature.values(sim, rows, name, of, mean) for name in _BY_TEMPERATURE}
        self.joint_table[len(rows) :], self.joint_beyond[len(rows) :] = tables(rows, warm, of)

    def _agree_on_lost(self, lost: int, what: str) -> None:
        sim = self.sim
        found = int(sim.comm.max_into(np.array([lost], np.int64))[0])
        if found >= 0:
            raise PhysicsError(
                f"step {sim.clock.step}: {what} {found} spans more than a column of {sim.rebuild_state.side:g} m; "
                "elements move too far in a step: the time step is probably too large"
            )

    def _put_histories(self) -> None:
        """Joints past their peak take their places; histories are in storage order."""
        histories = self.sim.histories
        at = np.flatnonzero(histories.keys() < 0)
        slot, was = self._first_slot(histories.owners()[at]) - 1 - histories.keys()[at], histories.rows[at, STATE]
        now = self.slot_state[slot]
        there = now != NONE  # else opened meanwhile, or its partner was removed
        there &= (now == was) | (np.maximum(now, was) <= BROKEN)  # else it has another law now
        slot, rows = slot[there], histories.rows[at[there]]
        self.slot_law[slot], self.slot_state[slot] = 0, rows[:, STATE]
        self.slot_history[slot] = rows[:, FIRST : FIRST + HISTORY]
        self._relink()

    def _relink(self) -> None:
        build.relink(self._in_loops(), self.in_lists, self.listed, self.lists, self.head, self.follow)

    def _in_loops(self) -> np.ndarray:
        """State of slots, as loops over elements see them."""
        return self.slot_state

    def _forget_opened(self) -> None:
        """Joints on faces that have been opened are gone."""
        self.tally[:, elements.NEW_BROKEN] = 0
        opened = np.flatnonzero((self.slot_state != NONE) & ~self.sim.closed_faces()[self.slot_face])
        if len(opened):
            self.slot_state[opened] = NONE
            self.slot_law[opened] = self.slot_kind[opened] = 0
            self._relink()

    # ---- where they are --------------------------------------------------------------------------------------------

    def _first_slot(self, owned: np.ndarray) -> np.ndarray:
        """Slots of the first faces of owned elements (0 ..)."""
        return 4 * owned if self.first_slot is None else self.first_slot[owned]

    @cached_property
    def edges(self) -> np.ndarray:
        """Lower faces of all edges between two elements that are there, of all ranks."""
        return np.flatnonzero(self.sim.joint_exists())

    @cached_property
    def lower_faces(self) -> np.ndarray:
        """Lower faces of the owned elements that have a joint model."""
        sim = self.sim
        faces = (4 * sim.number[sim.owned][:, None] + np.arange(4)).reshape(-1)
        return faces[sim.joint_exists()[faces] & (sim.joint_row[faces] > 0)]

    @cached_property
    def lower_slots(self) -> np.ndarray:
        """Return the slots of the lower faces."""
        return self.slot_of(self.lower_faces)

    def slot_of(self, faces: np.ndarray) -> np.ndarray:
        """Slots of faces of owned elements."""
        return self._first_slot(self.sim.where[faces // 4] - self.sim.n_left) + faces % 4

    def slot_element(self, slots: np.ndarray) -> np.ndarray:
        """Owned element (0 ..) of slots."""
        return self.sim.where[self.slot_face[slots] // 4] - self.sim.n_left

    def joints(self, slots: np.ndarray) -> list[tuple[np.ndarray, Joints]]:
        """Joints (n,) by their shape: which of them, and what they are; last those on sides of hexahedra."""
        which, on_side = np.arange(len(slots)), np.zeros(len(slots), bool)
        if self.sides is not None:
            on_side = np.isin(slots, self.sides.slot)
        sim, alone, corners = self.sim, slots[~on_side], CORNERS[self.sim.dim]
        element, k = np.divmod(self.slot_face[alone], 4)
        own = sim.x.shape[1] * sim.where[element][:, None] + corners[k]
        over = self.slot_link[alone].astype(np.int64)
        if over.ndim == 1:
            over = over[:, None] + corners[0]
        size = self.slot_size[alone] if len(self.slot_size) else np.zeros(len(alone))
        of = Joints(alone, own, over, size, self.slot_kind, self.slot_state, self.slot_history, sim.x.reshape(-1))
        if self.sides is None:
            return [(which, of)]
        found = self.sides.moved(np.searchsorted(self.sides.slot, slots[on_side]))
        return [(which[~on_side], of), (which[on_side], found)]

    def joint_ends(self, slots: np.ndarray, of_sides: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Corners (n, k), element * 4 + k, that the stiffness of these joints is of, and how their movements become
        those that its kernel knows, if they are not the same. of_sides: they are the second of `joints`."""
        if of_sides and self.sides is not None:
            of = np.searchsorted(self.sides.slot, slots)
            return self.sides.corners(of), self.sides.motions(of)
        face, corners = self.slot_face[slots], self.sim.the_mesh().face_corners
        return np.column_stack([corners(faces) for faces in (face, self.sim.partner[face])]), None

    # ---- looking ---------------------------------------------------------------------------------------------------

    def _joints_now(self, slots: np.ndarray) -> np.ndarray:
        """See `NOW`."""
        kernel, width = NOW[self.sim.dim]
        out = np.zeros((len(slots), width))
        for which, joints in self.joints(slots):
            found = np.zeros((len(which), width))
            kernel(*joints, self.joint_table, self.joint_beyond, found)
            out[which] = found
        return out

    def joint_means(self, slots: np.ndarray) -> np.ndarray:
        """Mean opening, slip [m], normal and shear stress [Pa] of joints (n, 4), in space the size of the mean slip and
        of the mean shear stress."""
        return self._joints_now(slots)[:, MEANS:POINTS]

    def joint_points(self, slots: np.ndarray) -> np.ndarray:
        """Normal (3) and shear (3) stress [Pa] at the points of joints (n, 6): from the first corner of the slot's face
        to the last, in space, where the shear stress is its size, near these corners."""
        return self._joints_now(slots)[:, POINTS:FORCES]

    def corner_forces(self, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners (element * 4 + k) of the faces of slots (n, dim), and the joint forces on them (n, dim, dim) [N/m],
        in space [N]; beside hexahedra of four corners, -1 for the fourth of a triangle."""
        dim = self.sim.dim
        force = self._joints_now(slots)[:, FORCES : FORCES + dim * dim].reshape(-1, dim, dim)
        corner = self.sim.the_mesh().face_corners(self.slot_face[slots])
        return (corner, force) if self.sides is None else self.sides.shared(slots, corner, force)

    def stored_in_joints(self) -> np.ndarray:
        """Energy that the joints of owned elements would release on unloading, half to each side (n_own,) [J/m], in
        space [J]."""
        out, slots = np.zeros(self.sim.n_own), np.flatnonzero(self.slot_state[: self.slots] != NONE)
        for which, joints in self.joints(slots):
            found = np.zeros(len(which))
            joint_points.stored(*joints, self.joint_table, self.joint_beyond, found)
            np.add.at(out, self.slot_element(slots[which]), 0.5 * found)
        return out

    @contextmanager
    def joints_kept(self) -> Iterator[None]:
        """Restore the histories of joints afterwards."""
        columns = self.slot_law, self.slot_state, self.head, self.follow, self.tally
        kept = [column.copy() for column in columns]
        behind = np.flatnonzero(self.slot_state > INTACT)  # the others remember nothing
        remembered = self.slot_history[behind]
        yield
        self.slot_history[self.slot_state > INTACT] = 0.0
        self.slot_history[behind] = remembered
        for column, values in zip(columns, kept):
            column[...] = values

    # ---- what is extracted from the tables ---------------------------------------------------------------------------

    def _joint_histories(self, transfer: bool) -> tuple[np.ndarray, np.ndarray]:
        """Owned element (0 ..) and row (histories.py) of each joint past its peak; with `transfer` without those that
        are broken."""
        state = self.slot_state
        slots = np.flatnonzero((state > INTACT) & ((state != BROKEN) | (not transfer)))
        rows = np.zeros((len(slots), WORDS))
        rows.view(np.int64)[:, KEY] = -1 - self.slot_face[slots] % 4
        rows[:, STATE] = state[slots]
        rows[:, FIRST : FIRST + HISTORY] = self.slot_history[slots]
        return self.slot_element(slots), rows
