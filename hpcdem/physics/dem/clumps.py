"""The rigid clumps of a model, over its life: they travel as rows of their members while the model is open, and are
bodies of their own (physics/dem/kernels/rigid.py) while it is closed."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import CLUMP_SPIN, CLUMP_VX, CLUMP_VY, CLUMP_WIDTH, CLUMP_X, CLUMP_Y, FREE
from hpcdem.core.memory import aligned, take_rows
from hpcdem.physics.dem.kernels import motion, rigid
from hpcdem.physics.dem.kernels.rigid import Bodies
from hpcdem.physics.dem.particles import Particles, free_rows

_MOTION = {"vx": CLUMP_VX, "vy": CLUMP_VY, "spin": CLUMP_SPIN}


class Clumps:
    """number: of the whole model; reach [m]: largest distance between the centres of two members of one clump, ever.
    Both are the same on all ranks. bodies: those of this rank, while the model is closed."""

    def __init__(self, number: int = 0, reach: float = 0.0) -> None:
        self.number, self.reach = number, reach
        self._bodies: Bodies | None = None
        self._far = np.empty((0, 4))
        self._blocks: tuple = ()

    def __bool__(self) -> bool:
        return self.number > 0

    @property
    def bodies(self) -> Bodies:
        """The clumps of this rank in a closed model."""
        assert self._bodies is not None, "the model is open: there are no bodies"
        return self._bodies

    # ---- from open to closed and back --------------------------------------------------------------------------------

    def storage(self, p: Particles, order: np.ndarray, halo: Any, threads: int) -> np.ndarray | None:
        """Rows of clumps with ghosts, for the owned particles in this order. Collective."""
        if not self:
            return None
        assert p.rigid is not None
        rows = aligned((halo.n_left + len(order) + halo.n_right, CLUMP_WIDTH))
        take_rows(p.rigid, order, rows[halo.n_left : halo.n_left + len(order)], threads)
        halo.fill(rows)
        return rows

    def close(self, p: Particles, halo: Any, lists: Any, step: int, side: float) -> None:
        """Bodies for the storage of the lists that have just been built."""
        if not self:
            return
        b = lists.blocks
        assert p.rigid is not None
        self._bodies = rigid.gather(p.ihot, p.rigid, p.n_left, p.n_own, b.cut, b.lo, b.foff)
        if self._bodies is None:
            raise PhysicsError(
                f"step {step}: a clump lost members when the lists were rebuilt; they are up to {self.reach:g} m "
                f"apart, a column is {side:g} m"
            )
        self._blocks = self._bodies.blocks(lists.n_blocks)
        if halo.n_left + halo.n_right + len(halo.border):
            self._far = aligned((len(p.hot), 4))
            self._far[:] = 0.0
            halo.add_late_ghost_field(self._far)

    def rows(self, p: Particles) -> np.ndarray | None:
        """The rows of the owned particles (n_own, 12), with the present state; None without clumps."""
        if p.rigid is None:
            return None
        if self._bodies is not None:
            self._bodies.write_back(p.rigid, p.n_left, p.n_own)
        return p.rigid[p.owned]

    def open(self) -> None:
        """The bodies go; `rows` must have been taken."""
        self._bodies = None

    # ---- the step ----------------------------------------------------------------------------------------------------

    def sum_forces(self, p: Particles, halo: Any, lists: Any) -> None:
        """Forces on the clumps from those on their members. Collective."""
        b, bodies = lists.blocks, self.bodies
        for first, last in halo.border:
            for t in range(lists.n_blocks):
                i, j = max(b.cut[t], p.n_left + first), min(b.cut[t + 1], p.n_left + last)
                if i < j:
                    shift = b.foff[t] - b.lo[t]
                    self._far[i:j] = lists.force[i + shift : j + shift]
        halo.refresh_more()
        rigid.sum_forces(lists.n_blocks, bodies.start, bodies.source, bodies.arm, lists.force, self._far, bodies.force)

    def move(self, p: Particles, lists: Any, gx: float, gy: float, eta: float, dt: float) -> None:
        """Clumps by dt; their owned members follow."""
        bodies, parts = self.bodies, lists.n_blocks
        motion.move(
            parts, 0, bodies.n, bodies.hot, bodies.cold, 0, *self._blocks, bodies.force, bodies.body, gx, gy,
            eta, dt,
        )  # fmt: skip
        rigid.place(
            parts, bodies.hot, bodies.cold, bodies.start, bodies.row, bodies.offset, bodies.arm, p.hot, p.cold,
            p.n_left, p.n_own, dt,
        )  # fmt: skip

    def fill(self, p: Particles, density: np.ndarray, damp: np.ndarray, dt: float, body: np.ndarray) -> None:
        """Masses of the clumps, and the rows of their members in the body table of the particles."""
        b = self.bodies
        rigid.fill(
            p.hot, p.ihot, p.icold, p.n_left, p.n_own, density, damp, dt, b.start, b.row, b.speaker, b.area, b.moment,
            b.cold, b.body, body,
        )  # fmt: skip

    # ---- commands ----------------------------------------------------------------------------------------------------

    def whole(self, p: Particles, which: np.ndarray, comm: Comm) -> np.ndarray:
        """Flags (n_own,) with every clump chosen of which a member is. Collective."""
        clump = p.clump
        found = np.unique(np.concatenate(comm.allgather(np.unique(clump[which]))))
        return which | np.isin(clump, found[found != FREE])

    def centres(self, p: Particles) -> tuple[np.ndarray, np.ndarray]:
        """x, y (n_own,) [m]: of members the centre of their clump, of others their own."""
        rows = self.rows(p)
        if rows is None:
            return p["x"], p["y"]
        member = p.clump >= 0
        return np.where(member, rows[:, CLUMP_X], p["x"]), np.where(member, rows[:, CLUMP_Y], p["y"])

    def set_motion(self, p: Particles, which: np.ndarray, **values: Any) -> None:
        """Velocity vx, vy [m/s] and spin [rad/s] of the clumps whose members are chosen; members get the velocities
        that follow. Values are numbers, or arrays (n_own,) that are equal for the members of a clump."""
        rows = self.rows(p)
        member = np.flatnonzero(which & (p.clump >= 0))
        if rows is None or p.rigid is None:
            return
        for name, value in values.items():
            rows[member, _MOTION[name]] = np.broadcast_to(value, (len(rows),))[member]
        rigid.member_velocities(member, p.hot, p.rigid, p.n_left)
        if self._bodies is not None:
            self._bodies.read(p.rigid)

    def of_first_members(self, p: Particles, values: np.ndarray, comm: Comm) -> np.ndarray:
        """`values` (n_own,) with those of members replaced by that of the first member of their clump. Collective."""
        clump, gid = p.clump, p["gid"]
        first = clump == gid
        names, of = (np.concatenate(part) for part in zip(*comm.allgather((gid[first].copy(), values[first].copy()))))
        order = np.argsort(names)
        out, member = values.copy(), clump >= 0
        out[member] = of[order][np.searchsorted(names[order], clump[member])]
        return out

    def begin(self, p: Particles) -> np.ndarray:
        """The rows of clumps of the particles of an open model; made if there were no clumps before."""
        if p.rigid is None:
            p.rigid = free_rows(len(p.hot))
        return p.rigid

    def forget(self, number: int, p: Particles) -> None:
        """Remove so many clumps; the model is open."""
        self.number -= number
        if not self:
            self.reach, p.rigid = 0.0, None
