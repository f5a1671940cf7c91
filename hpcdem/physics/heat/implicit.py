"""Implicit steps of heat, backward Euler, and the steady state: all nodes at once.

(C / dt + K) (T' - T) = Q(T') with the conductances, capacities and conditions of the explicit steps, at the end of the
step; fluid in channels, and surfaces that touch, are in the same system. Temperatures that are prescribed are put in
first; what the others then lack is the right-hand side, so the answer is exact to rounding whatever the linear solver
leaves: it is solved for twice. What advection of second order has beyond that of first order stands on the right-hand
side, turn by turn, until it changes no more.

Nodes of heat are known to all ranks meanwhile, as those of the blocks are in the static solve.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import connectivity, equilibrium
from hpcdem.physics.fdem.linear import Direct, Petsc, Pieces, Unknowns
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.field.elements import matrices
from hpcdem.physics.heat.implicit_fluid import Fluid
from hpcdem.physics.heat.model import Heat

MOST, PLENTY, CHANGE = 100, 40, 1e-7
"""Solutions of the linear system in a step with second-order advection: the largest number, the number from which on
changes count half, and the change of temperatures, over their differences, after which only one more is made."""


class Implicit:
    """Heat of a model by implicit steps; with mechanics the blocks are in static equilibrium at the end of each.
    Methods are collective."""

    def __init__(self, sim: Blocks, solver: str = "auto") -> None:
        """CommandError for what implicit steps cannot do."""
        heat = Heat.there(sim)
        if heat is None or not heat.rows:
            raise CommandError("no heat yet: assign element c-model thermal-iso-heat first")
        if solver not in equilibrium.SOLVERS:
            raise CommandError(f"solver is one of {', '.join(equilibrium.SOLVERS)}, got {solver}")
        if not sim.options.thermal:
            raise CommandError("the thermal part is switched off: use model option thermal on first")
        self.sim, self.heat, self.wanted = sim, heat, solver
        self.moves = bool(sim.options.mechanical)
        if self.moves and sim.options.dynamic:
            raise CommandError(
                "implicit steps of heat keep blocks in static equilibrium: use model option dynamic off first, or "
                "mechanical off for heat alone"
            )
        for load in sim.surface_loads:
            if self.moves and not load.stays:
                raise CommandError(f"implicit steps of heat do not support {load.name}: use model step or model solve")
        sim.close_model()
        if self.moves:
            equilibrium.refuse_changing_tables(sim, "implicit steps of heat")
        heat.check_elements()
        self.steps = self.factors = self.unknowns = 0
        self.solver: Direct | Petsc | None = None
        self._made_for: tuple[Any, ...] = ()

    def close(self) -> None:
        """Give back what the solver holds."""
        if self.solver is not None:
            self.solver.close()
            self.solver = None

    def advance(self, dt: float) -> None:
        """Take one step of dt [s]."""
        before = self._solve(dt)
        self.heat.time += dt
        self._settle(before)

    def steady(self) -> None:
        """Compute the steady state under the present conditions; no time passes."""
        self._refuse_loose()
        self._settle(self._solve(math.inf))

    def _settle(self, before: np.ndarray) -> None:
        """Blocks come into equilibrium with their new thermal stress; before: temperatures of owned elements then."""
        sim = self.sim
        self.steps += 1
        sim.local.follow_heat()
        if self.moves:
            joints = bool((sim.joint_row[sim.joint_exists()] > 0).any())
            try:
                equilibrium.solve_elastic(sim, solver=self.wanted, softening=joints, before=before)
            except CommandError as error:
                raise CommandError(
                    f"heat time {self.heat.time:.6g} s: {error}; temperatures are those of that time, positions of "
                    "blocks those before the step"
                ) from None
        else:
            sim.clock.step += 1

    # ---- the step --------------------------------------------------------------------------------------------------

    def _solve(self, dt: float) -> np.ndarray:
        """Temperatures after dt [s]; returns those of owned elements before."""
        sim, heat = self.sim, self.heat
        sim.close_model()
        heat.renew_nodes()
        if self.moves:
            heat.find_contacts()
        after = heat.time + dt if math.isfinite(dt) else heat.time
        fluid = Fluid.there(heat)
        self._prepare(dt, fluid)
        assert self.solver is not None
        at, held, before = heat.at, heat.at.held, sim.cold[heat.quantity].copy()
        old = heat.t.reshape(-1)[at.first()].copy()
        new = np.where(held >= 0, np.append(heat.held_at(after), 0.0)[held], old)
        inertia = at.capacity / dt
        count = len(at.leads)
        of_fluid = np.empty(0)
        if fluid is not None:
            of_fluid = np.where(fluid.held >= 0, np.append(heat.held_at(after), 0.0)[fluid.held], fluid.t)
        beyond = np.zeros(0 if fluid is None else len(fluid.q))
        settled = fluid is None or not fluid.second
        for turn in range(MOST):
            if fluid is not None and not settled:
                before, beyond = beyond, fluid.beyond(of_fluid)
                if turn >= PLENTY:  # it goes back and forth
                    beyond = 0.5 * (before + beyond)
            self._spread(new)
            force = np.zeros((count + len(of_fluid), 2))
            lack = np.where(held >= 0, 0.0, self._inflow(after) - inertia * (new - old))
            force[:count, 0] = self._everywhere(lack)
            if fluid is not None:
                rock = self._everywhere(new)
                got, walls = fluid.inflow(of_fluid, rock, beyond)
                force[:count, 0] += walls
                force[count:, 0] = got - fluid.capacity / dt * (of_fluid - fluid.t)
            change = self.solver.solve(force, 0.0)[:, 0]
            new, of_fluid = new + change[at.ids], of_fluid + change[count:]
            if turn and settled:
                break
            if turn and fluid is not None:
                there = np.concatenate([fluid.t, of_fluid, rock])
                differences = max(np.ptp(there), 1e-5 * np.abs(there).max())
                settled = bool(np.abs(change[count:]).max() <= CHANGE * differences)
        else:
            self._spread(old)
            raise CommandError(
                f"heat time {heat.time:.6g} s: advection of second order did not converge in {MOST} iterations. Use a "
                "shorter dt, or second-order off"
            )
        self._spread(new)
        walls = np.zeros(count)
        if fluid is not None:
            got, walls = fluid.inflow(of_fluid, self._everywhere(new), beyond)
            fluid.take(dt, of_fluid, got)
        self._book(dt, after, old, new, walls[at.ids])
        return before

    def _everywhere(self, mine: np.ndarray) -> np.ndarray:
        """Values of all nodes of the rock from those (n,) of the nodes that this rank's elements have."""
        out = np.zeros(len(self.heat.at.leads))
        for ids, values in self.sim.comm.allgather((self._ids, mine[self._mine])):
            out[ids] = values
        return out

    def _spread(self, values: np.ndarray) -> None:
        """Nodes (n,) have these temperatures."""
        self.heat.at.put(values, self.heat.t)
        self.sim.halo.fill(self.heat.t)

    def _inflow(self, time: float, dt: float = 0.0) -> np.ndarray:
        """Heat (n,) [W/m] that flows to the nodes; what faces bring in dt [s] is booked."""
        return self.heat.at.sums(self.heat.inflow(time, dt))

    def _book(self, dt: float, time: float, old: np.ndarray, new: np.ndarray, walls: np.ndarray) -> None:
        """Book the amounts supplied by conditions, beside heat (n,) [W/m] from fluid: in a step to the steady state,
        all inflow."""
        sim, heat = self.sim, self.heat
        at = heat.at
        brought = at.capacity * (new - old)
        if math.isfinite(dt):
            brought = np.where(at.held >= 0, brought - dt * (self._inflow(time, dt) + walls), 0.0)
        lead = at.first()[self._mine] - sim.owned.start * heat.t.shape[1]
        sim.cold[heat.given].reshape(-1)[lead] += brought[self._mine]

    # ---- the matrix ------------------------------------------------------------------------------------------------

    def _prepare(self, dt: float, fluid: Fluid | None) -> None:
        """Determine the unknowns, and factorize the matrix if it has changed."""
        sim, heat = self.sim, self.heat
        at = heat.at
        row = at.first() // heat.t.shape[1]
        lowest = at.leads[at.ids] // 4
        self._mine = (row >= sim.owned.start) & (row < sim.owned.stop) & (sim.number[row] == lowest)
        self._ids = at.ids[self._mine]
        parts = (part.tobytes() for part in (at.leads, heat.held, heat.exposed.row, heat.row))
        made_for = dt, sim.alive.tobytes(), *parts, *(part.tobytes() for part in heat.contacts)
        if fluid is not None:
            made_for = *made_for, *fluid.made_for()
        if not sim.comm.any(self.solver is None or made_for != self._made_for):
            return
        self.close()
        owner = np.zeros(len(at.leads), np.int64)
        for rank, ids in enumerate(sim.comm.allgather(self._ids)):
            owner[ids] = rank
        there = at.leads >= 0
        point = sim.the_mesh().cells.reshape(-1)[np.maximum(at.leads, 0)]
        free = there & sim.alive[np.maximum(at.leads, 0) // 4] & (heat.held[point] == 0)
        count = len(there)
        number = np.full((count, 2), -1, np.int64)
        number[free, 0] = np.arange(int(free.sum()))
        pieces = self._pieces(dt)
        if fluid is not None:
            of_fluid = np.full((len(fluid.t), 2), -1, np.int64)
            flowing = fluid.free(dt)
            of_fluid[flowing, 0] = int(free.sum()) + np.arange(int(flowing.sum()))
            number = np.concatenate([number, of_fluid])
            pieces += fluid.pieces(dt, count)
            beside = np.zeros(len(fluid.t), np.int64)
            beside[fluid.ends.reshape(-1)] = fluid.walls[:, [0, 2]].reshape(-1)
            owner = np.concatenate([owner, owner[beside]])
        total = len(number)
        unknowns = Unknowns(number, np.tile(np.eye(2), (total, 1, 1)), np.zeros((total, 2)), np.zeros(total, bool))
        nodes = equilibrium.Nodes(at.leads, point, owner, np.empty(0), np.empty(0))
        self.solver = equilibrium.linear_solver(sim, self.wanted, unknowns, nodes)
        self.solver.flows = fluid is not None
        self.solver.factor(pieces)
        self.factors += 1
        self.unknowns = unknowns.count
        self._made_for = made_for

    def _pieces(self, dt: float) -> list[Pieces]:
        """Matrix entries of the elements and faces of this rank."""
        sim, heat = self.sim, self.heat
        capacity, found = sim.cold[heat.capacities].reshape(-1), []
        for kind, number, corners, g in heat.conduction.by_kind():
            row = sim.where[number]
            mine = np.flatnonzero((row >= sim.owned.start) & (row < sim.owned.stop))
            mine = mine[np.argsort(number[mine])]
            corner = corners[mine]
            stiffness = np.zeros((len(mine), *2 * [2 * kind.corners]))
            stiffness[:, ::2, ::2] = matrices(kind, g[mine])
            own = capacity[(sim.where[corner // 4] - sim.owned.start) * heat.t.shape[1] + corner % 4]
            each = 2 * np.arange(kind.corners)
            stiffness[:, each, each] += own / dt
            found.append(Pieces(number[mine], heat.at.number[corner], stiffness))
        at, ends, transfer = heat.exposed.transfers()
        key = np.repeat(at, ends.shape[1])
        faces = np.zeros((len(key), 2, 2))
        faces[:, 0, 0] = np.repeat(transfer, ends.shape[1])
        found.append(Pieces(key, heat.at.number[ends.reshape(-1)][:, None], faces))
        found.append(self._contact_pieces())
        return found

    def _contact_pieces(self) -> Pieces:
        """Make the pieces of touching faces, by the numbers of elements, if the first face belongs to this rank."""
        sim, heat = self.sim, self.heat
        corner, weight, pass_on = heat.contacts
        width = heat.t.shape[1]
        row = corner // width
        mine = (row[:, 0] >= sim.owned.start) & (row[:, 0] < sim.owned.stop)
        corner, weight, row = corner[mine] % width, weight[mine], row[mine]
        stiffness = np.zeros((len(corner), *2 * [2 * corner.shape[1]]))
        stiffness[:, ::2, ::2] = pass_on[mine, None, None] * weight[:, :, None] * weight[:, None, :]
        return Pieces(sim.number[row[:, 0]], heat.at.number[4 * sim.number[row] + corner], stiffness)

    def _refuse_loose(self) -> None:
        """CommandError naming a body whose heat nothing holds."""
        sim, heat, cells = self.sim, self.heat, self.sim.the_mesh().cells
        heat.renew_nodes()
        body = connectivity.bodies(np.where(sim.closed_faces() & np.repeat(sim.alive, 4), sim.partner, -1))
        holds = np.append(heat.held > 0, False)[cells].any(axis=1) & sim.alive
        bound = np.zeros(int(body.max()) + 1, bool)
        bound[body[holds]] = True
        at, _, transfer = heat.exposed.transfers(everywhere=True)
        bound[body[at[transfer > 0.0] // 4]] = True
        if (fluid := heat.flowing) is not None and fluid.held.any():  # fluid comes past these
            lower = fluid.flow.network.channels
            bound[body[np.append(lower, sim.partner[lower]) // 4]] = True
        row = heat.contacts[0] // heat.t.shape[1]
        touch = np.unique(np.concatenate(sim.comm.allgather(body[sim.number[row[:, [0, row.shape[1] // 2]]]])), axis=0)
        while True:  # what touches a body that something holds
            reached = touch[bound[touch].any(axis=1)]
            if bound[reached].all():
                break
            bound[reached] = True
        loose = np.flatnonzero(sim.alive & ~bound[body])
        if len(loose):
            raise CommandError(
                f"heat has no steady state: in the body of element {loose[0]} no temperature is prescribed, and no "
                "environment"
            )
