"""The static solve: equilibrium of elastic blocks at once, by Newton's method with the tangent of the forces.

The unbalanced forces are those of the kernels that step, so the answer is a state of the explicit code at rest; only
the tangent is of its own (physics/fdem/kernels/stiffness.py). Positions of all nodes are known to every rank meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import connectivity
from hpcdem.physics.fdem.convergence import Solving
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import stiffness
from hpcdem.physics.fdem.kernels.joints import BROKEN, YIELDED
from hpcdem.physics.fdem.linear import MANY, Direct, Petsc, Pieces, Unknowns, petsc_there
from hpcdem.physics.fdem.local import Evaluation
from hpcdem.physics.fdem.properties import MECH_MOHR_COULOMB

AIM = 1e-12
"""Balance that is aimed at; rounding ends the iteration where coordinates are large."""
ENOUGH = 1e-8
"""Balance that must be reached, unless something else is asked for."""
MOST = 60
"""Iterations after which there is no hope."""
RENEW = 0.1
"""The matrix is made again when an iteration leaves more than this part of the unbalanced forces."""
TOUCH = 1e-9
"""Contact forces over all forces above which surfaces count as touching."""
WORST = 1e-3
"""Worst balance that is put down to rounding."""
HALVINGS = 8
"""Of an iteration's way before it is given up."""
SOLVERS = ("auto", "direct", "petsc")


@dataclass(frozen=True)
class Balanced:
    """How `Blocks.solve_elastic` ended. ratio: unbalanced over contributing forces; iterations, factors: of Newton's
    method; unknowns: components that could move; solver: who solved the linear systems."""

    ratio: float
    iterations: int
    factors: int
    unknowns: int
    solver: str


@dataclass
class _Nodes:
    """Of all nodes, on all ranks: the lowest corner (nn,), its point and rank; position and velocity (nn, 2). Nodes of
    which nothing is left have corner -1."""

    lead: np.ndarray
    point: np.ndarray
    owner: np.ndarray
    x: np.ndarray
    v: np.ndarray


class Equilibrium(Solving):
    """Commands of `Blocks` that find equilibrium without steps. All collective."""

    def solve_elastic(self, cycles: int = 1, ratio: float = ENOUGH, solver: str = "auto") -> Balanced:
        """Put the model into static equilibrium with the loads of this moment, at once.

        Elements are elastic and joints must stay before their peak, so the answer does not depend on the way; it is the
        one to which relaxation goes. Prescribed velocities act for `cycles` units of time (static mode), what elements
        that were taken out left behind has died down, velocities are zero afterwards. Counts as `cycles` steps.

        ratio: unbalanced over contributing forces that must be reached; what rounding allows is aimed at. solver:
        "direct" (SciPy on rank 0: the same bits on any number of ranks), "petsc", "auto": PETSc, if it is there, from
        400 000 unknowns on, else direct.

        CommandError, with the model as it was: a body that can move freely, conditions without equilibrium, surfaces
        that touch (before or in the answer), elements that can yield, joints behind their peak (before or in the
        answer), no convergence.
        """
        if cycles < 1 or not ratio > 0.0 or solver not in SOLVERS:
            raise CommandError(f"cycles and ratio must be positive, solver one of {', '.join(SOLVERS)}")
        yielding = np.flatnonzero(self.yielding())
        if len(yielding):
            raise CommandError(
                f"element {yielding[0]} can yield ({len(yielding)} have the model {MECH_MOHR_COULOMB.name}): the "
                "static solve takes elastic elements; model solve relaxes others to equilibrium"
            )
        self.close_model()
        if self.comm.any(bool((self.local.slot_state == BROKEN).any())):
            self._renew_lists()
        self._refuse_yielded(int((self._lower_states() == YIELDED).sum()), "are behind their peak already")
        nodes = self._all_nodes()
        unknowns = self._unknowns(nodes, cycles)
        self._refuse_loose_bodies(nodes, unknowns)
        with self._at_rest(nodes):
            x, balanced = self._newton(nodes, unknowns, ratio, self._linear_solver(solver, unknowns, nodes))
        relaxations, self.relaxations = self.relaxations, []
        self._settle(nodes, x, unknowns.given / cycles)
        touching = self._touching()
        inverted = float(self._inverted())
        if touching or self.comm.max_into(np.array([inverted]))[0]:
            self.relaxations = relaxations
            self._settle(nodes, nodes.x, nodes.v)
            if touching:
                self._refuse_touching(touching, "touch in the equilibrium that was found")
            raise CommandError("an element is turned inside out in the equilibrium that was found: loads are too large")
        self.clock.step += cycles
        return balanced

    # ---- who can move --------------------------------------------------------------------------------------------

    def _all_nodes(self) -> _Nodes:
        cells = self.the_mesh().cells
        node = self.node.reshape(-1)
        corner = np.flatnonzero(node >= 0)[::-1]
        lead = np.full(len(self.member_begin) - 1, -1, np.int64)
        lead[node[corner]] = corner
        row = np.where(lead >= 0, self.where[lead // 4], -1)
        mine = np.flatnonzero((row >= self.owned.start) & (row < self.owned.stop))
        row, k = row[mine], lead[mine] % 4
        columns = (self.x[row, 2 * k], self.x[row, 2 * k + 1], self.v[row, 2 * k], self.v[row, 2 * k + 1])
        found = np.zeros((len(lead), 4))
        owner = np.zeros(len(lead), np.int64)
        for rank, (numbers, values) in enumerate(self.comm.allgather((mine, np.column_stack(columns)))):
            found[numbers], owner[numbers] = values, rank
        return _Nodes(lead, cells.reshape(-1)[lead], owner, found[:, :2].copy(), found[:, 2:].copy())

    def _unknowns(self, nodes: _Nodes, cycles: int) -> Unknowns:
        """CommandError for conditions that have no equilibrium."""
        table = self.conditions_at(self.clock.time, self.clock.time, 1.0)
        free, way, step = (np.empty((len(table), *shape)) for shape in ((2,), (2, 2), (2,)))
        for row, one in enumerate(table):
            points = np.flatnonzero(self.point_row == row)
            free[row], way[row], step[row] = 1.0, np.eye(2), 0.0
            if row and len(points):
                free[row], way[row], step[row] = self._freedom(one, int(points[0]))
        row = self.point_row[nodes.point]
        free, way, step = free[row], way[row], step[row]
        free[nodes.lead < 0] = step[nodes.lead < 0] = 0.0
        number = np.full(free.shape, -1, np.int64)
        number[free > 0.0] = np.arange(int((free > 0.0).sum()))
        return Unknowns(number, way, step * cycles, ~(way == np.eye(2)).all(axis=(1, 2)))

    def _freedom(self, one: np.ndarray, point: int) -> tuple[list[float], np.ndarray, np.ndarray]:
        """Of a row of conditions: free ways (1) and others (0), the two ways as columns, movement per unit of time.
        point: one to which they apply, for messages."""
        does = one[[moving.DOES_X, moving.DOES_Y]]
        at = np.where(does == moving.VELOCITY, one[[moving.AT_X, moving.AT_Y]], 0.0)
        held = does != moving.FREE
        pushed = (does == moving.ACCELERATION) & (one[[moving.AT_X, moving.AT_Y]] != 0.0)
        if pushed.any():
            raise CommandError(f"node {point} has a prescribed acceleration: there is no equilibrium")
        if one[moving.CONSTRAINT] == moving.FIXED:
            free, way, step = [0.0, 0.0], np.eye(2), np.zeros(2)
        elif one[moving.CONSTRAINT] == moving.ALONG:
            along = one[[moving.WAY_X, moving.WAY_Y]]
            way = np.column_stack([along, [-along[1], along[0]]])
            if held.any() and not held.all() and along.all():
                raise CommandError(
                    f"node {point} moves along an oblique line and has one component prescribed: the static solve "
                    "takes a move constraint along a vector alone, or with both components"
                )
            bound = held.all() or bool((held & (along != 0.0)).any())
            free, step = [0.0 if bound else 1.0, 0.0], float(np.where(held, at, 0.0) @ along) * along
        else:
            free, way, step = [float(not h) for h in held], np.eye(2), np.where(held, at, 0.0)
        if self.options.dynamic and step.any():
            raise CommandError(
                f"node {point} moves at a prescribed velocity: there is no equilibrium in dynamic mode; in static mode "
                "(model option dynamic off) it moves that far per unit of time"
            )
        return free, way, step

    def _refuse_loose_bodies(self, nodes: _Nodes, unknowns: Unknowns) -> None:
        """CommandError naming a body that can move as a whole: its three rigid movements are looked at where nodes are
        held (the smallest eigenvalue of the sum of squares of the movements there)."""
        hold = np.where((self.closed_faces() & np.repeat(self.alive, 4)), self.partner, -1)
        of_elements = connectivity.bodies(hold)
        use = nodes.lead >= 0
        body, x = of_elements[nodes.lead[use] // 4], nodes.x[use]
        count = np.maximum(np.bincount(body), 1)
        centre = np.column_stack([np.bincount(body, x[:, c]) / count for c in range(2)])
        arm = x - centre[body]
        size = np.zeros(len(count))
        np.maximum.at(size, body, np.abs(arm).max(axis=1))
        arm /= size[body][:, None]
        rigid = np.zeros((len(arm), 2, 3))
        rigid[:, 0, 0] = rigid[:, 1, 1] = 1.0
        rigid[:, 0, 2], rigid[:, 1, 2] = -arm[:, 1], arm[:, 0]
        bound = unknowns.number[use] < 0
        along = np.einsum("nck,ncm->nkm", unknowns.way[use], rigid) * bound[:, :, None]
        squares = np.einsum("nkm,nkl->nml", along, along)
        gram = np.zeros((len(count), 3, 3))
        some = bound.any(axis=1)
        np.add.at(gram, body[some], squares[some])
        there = np.unique(body)
        values, vectors = np.linalg.eigh(gram[there])
        loose = values < 1e-12 * np.maximum(values[:, 2:], 1e-12)
        bad = np.flatnonzero(loose.any(axis=1))
        if not len(bad):
            return
        at = there[bad[0]]
        members = np.flatnonzero((of_elements == at) & self.alive)
        held = gram[at]
        ways = [f"in {axis}" for c, axis in enumerate("xy") if held[c, c] <= 1e-12]
        modes = vectors[bad[0]][:, loose[bad[0]]]
        if (np.abs(modes[2]) > 1e-6).any():
            ways.append("about some point" if not ways else "and turn")
        words = " ".join(ways) or "along a line"
        others = f" (and {len(bad) - 1} more bodies)" if len(bad) > 1 else ""
        raise CommandError(
            f"the body of {len(members)} elements around ({centre[at, 0]:g}, {centre[at, 1]:g}), with element "
            f"{members[0]}, can move {words}{others}: hold it by conditions of nodes, or use relaxation (model solve)"
        )

    # ---- refusals ------------------------------------------------------------------------------------------------

    def _lower_states(self) -> np.ndarray:
        """States of the joints of this rank, each joint once."""
        slot = self._lower_slots()
        return self.local.slot_state[slot]

    def _lower_slots(self) -> np.ndarray:
        local = self.local
        face = local.slot_face[: local.slots]
        return np.flatnonzero((local.slot_state[: local.slots] > 0) & (face < self.partner[face]))

    def _refuse_yielded(self, mine: int, what: str) -> None:
        count = int(self.comm.sum_into(np.array([mine], np.int64))[0])
        if count:
            raise CommandError(
                f"{count} joints {what}: the static solve follows joints up to their peak only; use relaxation (model "
                "solve), or face-joint reset state if they shall be whole"
            )

    def _touching(self) -> list[tuple[int, int]]:
        """Pairs of elements whose surfaces press on each other, on all ranks. Collective."""
        seen = self.evaluate()
        pairs = self.local.pairs
        force = np.hypot(seen.pair_force[:, 0:6:2].sum(axis=1), seen.pair_force[:, 1:6:2].sum(axis=1))
        total = exact_sum(self.contributing(seen), self.comm)
        at = np.flatnonzero((seen.touching > 0) & (force > TOUCH * total))
        mine = list(zip(pairs.element[pairs.first[at]].tolist(), pairs.element[pairs.second[at]].tolist()))
        return sorted({pair for part in self.comm.allgather(mine) for pair in part})

    def _refuse_touching(self, pairs: list[tuple[int, int]], what: str) -> None:
        if pairs:
            a, b = pairs[0]
            raise CommandError(
                f"{len(pairs)} pairs of surfaces {what}, the first of elements {a} and {b}: the static solve does not "
                "follow contact; use relaxation (model solve), or model option collision off if they may overlap"
            )

    def _inverted(self) -> bool:
        x = self.x[self.owned]
        cells = self.the_mesh().cells[self.number[self.owned]]

        def turn(a: int, b: int) -> np.ndarray:
            return (x[:, a] - x[:, 0]) * (x[:, b + 1] - x[:, 1]) - (x[:, a + 1] - x[:, 1]) * (x[:, b] - x[:, 0])

        bad = ~(turn(2, 4) > 0.0)
        if self.wide:
            bad |= (cells[:, 3] >= 0) & ~(turn(4, 6) > 0.0)
        return bool(bad.any())

    # ---- Newton's method -----------------------------------------------------------------------------------------

    @contextmanager
    def _at_rest(self, nodes: _Nodes) -> Iterator[None]:
        """Velocities are zero and nothing dies down; afterwards everything is as it was."""
        local = self.local
        relaxations = local.relaxing_corner
        v = self.v.copy()
        try:
            self.v[:] = 0.0
            local.relaxing_corner = relaxations[:0]
            self._refuse_touching(self._touching(), "touch")
            yield
        finally:
            self._place_corners(nodes.x)
            self.v[:] = v
            local.relaxing_corner = relaxations

    def _place_corners(self, x: np.ndarray) -> None:
        """Place all corners held here, ghosts too, by the positions of their nodes (nn, 2)."""
        node = self.node[self.number]
        real = node >= 0
        columns = 4 if self.wide else 3
        for k in range(columns):
            rows = np.flatnonzero(real[:, k])
            self.x[rows, 2 * k : 2 * k + 2] = x[node[rows, k]]
        self._repeat(self.x)

    def _settle(self, nodes: _Nodes, x: np.ndarray, v: np.ndarray) -> None:
        """Positions and velocities (nn, 2) of all nodes, as a command sets them; the model is closed again."""
        self._before_change()
        node = self.node[self.number]
        for k in range(4 if self.wide else 3):
            rows = np.flatnonzero(node[:, k] >= 0)
            self.x[rows, 2 * k : 2 * k + 2] = x[node[rows, k]]
            self.v[rows, 2 * k : 2 * k + 2] = v[node[rows, k]]
        self._repeat(self.x)
        self._repeat(self.v)
        self._changed(stiffness=False)
        self.close_model()

    def _linear_solver(self, wanted: str, unknowns: Unknowns, nodes: _Nodes) -> Direct | Petsc:
        many = unknowns.count >= MANY
        there = False
        if wanted == "petsc" or (wanted == "auto" and many):
            there = not self.comm.any(not petsc_there())
            if wanted == "petsc" and not there:
                raise CommandError("petsc4py is not installed, or PETSc cannot be loaded: use solver direct")
            if not there and self.log is not None:
                self.log.warn_once(
                    "static solve",
                    f"{unknowns.count} unknowns are solved on one rank, as petsc4py is not there: this may need "
                    "minutes and many GB of history",
                )
        return (Petsc if there else Direct)(self.comm, unknowns, nodes.owner)

    def _newton(
        self, nodes: _Nodes, unknowns: Unknowns, enough: float, solver: Direct | Petsc
    ) -> tuple[np.ndarray, Balanced]:
        """Positions of the nodes in equilibrium (nn, 2)."""
        x, left, renew = nodes.x, 1.0 if unknowns.given.any() else 0.0, True
        iterations = factors = past = 0
        rounding = noise = 0.0
        force, ratio, total = self._unbalanced(nodes, unknowns, x)
        try:
            while iterations < MOST and (left > 0.0 or ratio > max(AIM, 0.05 * noise)):
                if renew:
                    self._place_corners(x)
                    pieces, past = self.tangent()
                    rounding = self._rounding(pieces, x)
                    solver.factor(pieces)
                    factors += 1
                way = solver.solve(force, left)
                iterations += 1
                found = self._along(nodes, unknowns, x, way, ratio, left, enough)
                if found is None:
                    if renew or ratio <= enough:
                        break  # as near as rounding allows, or never
                    renew = True
                    continue
                part, x, force, after, total = found
                left = max(left * (1.0 - part), 0.0)
                noise = rounding / total if total > 0.0 else 0.0
                slow = after > 0.5 * ratio
                done = left == 0.0 and slow and (after <= noise or (renew and after <= enough))
                renew, ratio = left > 0.0 or after > max(RENEW * ratio, noise), after
                if done:
                    break
            self._place_corners(x)
            _, past = self.tangent(matrices=False)
        finally:
            solver.close()
        self._refuse_yielded(past, "would pass their peak")
        if left > 0.0 or not ratio <= max(enough, min(noise, WORST)):
            noise = rounding / total if 0.0 < total < math.inf else noise
            why = (
                f"positions are rounded to the last bit, which alone makes about {noise:.1g}: coordinates are too "
                "large, or properties differ by too many powers of ten"
                if noise > enough
                else "the loads may be more than the model can bear: use relaxation (model solve)"
            )
            raise CommandError(
                f"the static solve does not converge: unbalanced over all forces is {ratio:.3g} after {iterations} "
                f"iterations, {enough:g} is asked for; {why}"
            )
        if ratio > enough and self.log is not None:
            self.log.info(
                f"unbalanced over all forces is {ratio:.3g} instead of {enough:g}: strains are so small that positions "
                "are rounded more coarsely than that"
            )
        return x, Balanced(ratio, iterations, factors, unknowns.count, solver.name)

    def _along(
        self,
        nodes: _Nodes,
        unknowns: Unknowns,
        x: np.ndarray,
        way: np.ndarray,
        ratio: float,
        left: float,
        enough: float,
    ) -> tuple[float, np.ndarray, np.ndarray, float, float] | None:
        """The largest of the parts 1, 1/2, 1/4 ... of the way that brings forces nearer to balance, and what is there:
        position, forces, ratio, sum of forces. While prescribed movements are made they may be out of balance."""
        part = 1.0
        for _ in range(HALVINGS):
            trial = x + part * way
            force, after, total = self._unbalanced(nodes, unknowns, trial)
            if after < ratio or (left > 0.0 and after < 1.0):
                return part, trial, force, after, total
            if ratio <= enough and left == 0.0:
                return None
            part *= 0.5
        return None

    def _rounding(self, pieces: list[Pieces], x: np.ndarray) -> float:
        """Sum of the forces that positions rounded to the last bit make [N/m]: K_ii |x_i| epsilon. Collective."""
        parts = [np.empty(0)]
        for one in pieces:
            at = np.abs(x[one.node]).reshape(one.stiffness.shape[:2])
            parts.append((np.einsum("mii->mi", one.stiffness) * at).reshape(-1))
        return exact_sum(np.concatenate(parts), self.comm) * float(np.finfo(np.float64).eps)

    def _unbalanced(self, nodes: _Nodes, unknowns: Unknowns, x: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Forces (nn, 2) on nodes at these positions, conditions left out, the ratio, and the sum of the sizes of all
        forces [N/m]; equal on all ranks. The ratio is infinite where forces are no numbers."""
        with np.errstate(invalid="ignore", over="ignore"):
            self._place_corners(x)
            seen = self.local.evaluation(contact=False)
        force, sizes = self._node_forces(seen), self.contributing(seen)
        if self.comm.any(not np.isfinite(sizes).all()) or not np.isfinite(force).all():
            return force, math.inf, math.inf
        total = exact_sum(sizes, self.comm)
        unbalanced = float(np.abs(unknowns.reduced(force)).sum())
        return force, unbalanced / total if total != 0.0 else 0.0, total

    def _node_forces(self, seen: Evaluation) -> np.ndarray:
        """Sum of the forces on every node (nn, 2) [N/m], on all ranks."""
        local, own = self.local, self.owned
        lead = local.first_corners()
        row = self.where[lead // 4]
        mine = (row >= own.start) & (row < own.stop)
        i, k = np.nonzero(local.alone())
        corner = np.concatenate([lead[mine], 4 * self.number[own][i] + k])
        flat = seen.force[own]
        values = np.concatenate([seen.felt[mine, :2], np.column_stack([flat[i, 2 * k], flat[i, 2 * k + 1]])])
        out = np.zeros((len(self.member_begin) - 1, 2))
        node = self.node.reshape(-1)
        for corners, forces in self.comm.allgather((corner, values)) if self.comm.size > 1 else [(corner, values)]:
            out[node[corners]] = forces
        return out

    def tangent(self, matrices: bool = True) -> tuple[list[Pieces], int]:
        """Stiffness of the owned elements and joints at the present positions, and joints behind their peak."""
        local, small = self.local, not self.options.large_strain
        slots = self._lower_slots()
        joints, left = np.empty((len(slots), 8, 8)), np.empty(len(slots))
        cells, number = self.the_mesh().cells, self.number
        stiffness.intact_joints(
            slots, local.slot_face, local.slot_at, local.slot_kind, local.slot_state, self.where, cells, self.x,
            local.joint_table, joints, left,
        )  # fmt: skip
        past = int((left < 0.0).sum())
        if not matrices:
            return [], past
        rows = local.triangle_rows[: local.count]
        triangles, quads = np.empty((len(rows), 6, 6)), np.empty((len(local.quad_rows), 8, 8))
        stiffness.triangles(rows, self.x, local.c, local.s0, small, triangles)
        stiffness.quads(local.quad_rows, self.x, local.q, local.quad_s0, small, quads)
        of_triangles, of_quads = number[rows], number[local.quad_rows]
        face = local.slot_face[slots]
        ends = []
        for f in (face, self.partner[face]):
            e, k = f // 4, f % 4
            after = np.where(k + 1 < np.where(cells[e, 3] >= 0, 4, 3), k + 1, 0)
            ends += [self.node[e, k], self.node[e, after]]
        return [
            Pieces(of_triangles, self.node[of_triangles, :3], triangles),
            Pieces(of_quads, self.node[of_quads], quads),
            Pieces(face, np.column_stack(ends), joints),
        ], past
