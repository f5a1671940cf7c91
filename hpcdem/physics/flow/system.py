"""Blocks in static equilibrium and their fluid at the end of a time step, as one system of equations: who is unknown,
what is lacking, and Newton's method."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import equilibrium
from hpcdem.physics.fdem.linear import MANY, MANY_IN_SPACE, Condensed, Direct, Petsc, Pieces, Unknowns, petsc_there
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.implicit import Balance, Fluid, Step
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.tangent import Tangent

AIM, ENOUGH = 1e-10, 1e-7
"""Residual of forces and fluid over their contributions: target, and limit if rounding allows no less."""
MOST, HALVINGS = 25, 6
"""Largest number of iterations of a step, and of halvings of the increment of one iteration."""


@dataclass
class Found:
    """Result of Newton's method: positions (nn, dim), variables (nf,), the balance of the fluid, the residual,
    iterations, joints that pass their peak; error: why this is no balance, "" if it is; storing: fluid that is stored
    over what flows; still: nothing has changed."""

    x: np.ndarray
    u: np.ndarray
    fluid: Balance
    lack: float
    iterations: int
    past: int
    error: str
    storing: float = 0.0
    still: bool = False


@dataclass
class Count:
    """Counts of a run: time steps, repeated steps, iterations, factorisations."""

    steps: int = 0
    cut: int = 0
    iterations: int = 0
    factors: int = 0
    unknowns: int = 0
    solver: str = ""


class System:
    """Equations of the blocks, if they move, and of their fluid. Methods are collective."""

    fluid: Fluid
    solver: Direct | Petsc | Condensed

    def __init__(self, sim: Blocks, flow: Flow, solver: str) -> None:
        self.sim, self.flow, self.wanted = sim, flow, solver
        self.moves = bool(sim.options.mechanical)
        self.count = Count()

    def _take_nodes(self) -> None:
        """Nodes, where they are, and what is unknown, of a closed model."""
        self.nodes = equilibrium.all_nodes(self.sim)
        self.x = self.nodes.x
        self.of_blocks = self._of_blocks()
        self.unknowns = self._unknowns()

    def _stress(self) -> float:
        """Mean size of the stress of elements [Pa], 0 if they are at rest."""
        if not self.moves:
            return 0.0
        stress = np.abs(self.sim.local.stresses(energies=False)[0])
        return exact_sum(stress.mean(axis=1), self.sim.comm) / len(self.sim.the_mesh().cells)

    def _of_blocks(self) -> Unknowns:
        sim, count = self.sim, len(self.x)
        if not self.moves:
            dim = sim.dim
            return Unknowns(
                np.full((count, dim), -1), np.tile(np.eye(dim), (count, 1, 1)), np.zeros((count, dim)),
                np.zeros(count, bool),
            )  # fmt: skip
        found = equilibrium.unknowns_of(sim, self.nodes, 1)
        if found.given.any():
            raise CommandError(
                "implicit steps of flow support fixed and free nodes only: use explicit steps for other velocities"
            )
        return found

    def _of_fluid(self) -> int:
        """Unknowns of the fluid: one of each flow node, and one of its pack if some bear."""
        slurry, n = self.flow.slurry, len(self.flow.network.nodes)
        return n * (2 if self.moves and slurry is not None and slurry.packs(lambda mine: mine) is not None else 1)

    def _unknowns(self) -> Unknowns:
        """Unknowns of the blocks, then the variable of each flow node and of its pack."""
        of, n, blocks, dim = self.of_blocks, self._of_fluid(), len(self.x), self.sim.dim
        number = np.full((blocks + n, dim), -1, np.int64)
        number[:blocks] = of.number
        number[blocks:, 0] = of.count + np.arange(n)
        basis = np.concatenate([of.basis, np.tile(np.eye(dim), (n, 1, 1))])
        found = Unknowns(number, basis, np.zeros((blocks + n, dim)), np.concatenate([of.oblique, np.zeros(n, bool)]))
        self.count.unknowns = found.count
        return found

    def _solver(self) -> Direct | Petsc | Condensed:
        sim, unknowns = self.sim, self.unknowns
        made: Direct | Petsc | Condensed
        many = MANY if sim.dim == 2 or not self.moves else MANY_IN_SPACE
        if self.wanted == "petsc" or (self.wanted == "auto" and unknowns.count >= many and not self._condenses()):
            there = not sim.comm.any(not petsc_there())
            if self.wanted == "petsc" and not there:
                raise CommandError("petsc4py is not installed, or PETSc cannot be loaded: use solver direct")
        else:
            there = False
        if there:
            made = Petsc(
                sim.comm,
                unknowns,
                np.concatenate([self.nodes.owner, np.tile(self.nodes.owner[self.fluid.lead], self.fluid.layers)]),
            )
        elif self._condenses():
            made = Condensed(sim.comm, unknowns, self._of_joints())
        else:
            made = Direct(sim.comm, unknowns, self.nodes.owner)
            made.flows = True
        self.count.solver = made.name
        return made

    def _condenses(self) -> bool:
        """Return whether most unknowns are those of elements."""
        return self.moves and Condensed.suits(self.unknowns, self._of_joints())

    def _of_joints(self) -> np.ndarray:
        """Nodes of joints, of wet faces, and of the fluid."""
        sim, mesh, network = self.sim, self.sim.the_mesh(), self.flow.network
        lower = np.union1d(np.flatnonzero(sim.joint_exists() & (sim.joint_row > 0)), network.channels)
        faces = np.concatenate([lower, sim.partner[lower], self.flow.wet_faces()["number"]])
        corners = np.concatenate([mesh.face_corners(faces).reshape(-1), mesh.on_sides(faces)[1]])
        ends = sim.node.reshape(-1)[corners]
        return np.concatenate([ends, len(self.nodes.lead) + np.arange(self._of_fluid())])

    def _newton(self, step: Step, x: np.ndarray, u: np.ndarray) -> Found:
        timers = self.sim.timers
        lack, force, fluid = self._lacking(step, x, u)
        iterations, error, past = 0, "", 0
        while lack > AIM and iterations < MOST:
            with timers.around("matrix"):
                pieces = self._pieces(step, fluid, u, x)
            try:
                with timers.around("factors"):
                    self.solver.factor(pieces)
                with timers.around("solve"):
                    increment = self.solver.solve(force, 0.0)
            except CommandError as singular:
                error = str(singular)
                break
            self.count.factors += 1
            iterations += 1
            part, best = 1.0, (math.inf, 1.0)
            to_x, to_u = increment[: len(x)], increment[len(x) : len(x) + len(u), 0]
            for _ in range(HALVINGS):
                trial = self._lacking(step, x + part * to_x, u + part * to_u)
                if trial[0] < lack or (iterations == 1 and lack > ENOUGH and trial[0] < math.inf):
                    break
                best = min(best, (trial[0], part))
                part *= 0.5
            else:
                if lack <= ENOUGH:
                    break
                part = best[1]
                trial = self._lacking(step, x + part * to_x, u + part * to_u)
                if not trial[0] < math.inf:
                    break
            x, u = x + part * to_x, u + part * to_u
            stalled = lack <= ENOUGH and trial[0] > 0.5 * lack
            lack, force, fluid = trial
            if stalled:
                break
        self.count.iterations += iterations
        if not error and lack > ENOUGH:
            error = (
                f"flow and equilibrium did not converge: relative residual {lack:.3g} after {iterations} iterations, "
                f"required {ENOUGH:g}"
            )
        if self.moves:
            equilibrium.place_corners(self.sim, x)
            past = int(self.sim.comm.sum_into(np.array([equilibrium.of_joints(self.sim, True)[1]], np.int64))[0])
        return Found(x, u, fluid, lack, iterations, past, error)

    def _pieces(self, step: Step, fluid: Balance, u: np.ndarray, x: np.ndarray) -> list[Pieces]:
        first = len(x)
        of_fluid = Tangent(self.fluid).pieces(step, fluid, u, x, first)
        if not self.moves:
            return of_fluid
        equilibrium.place_corners(self.sim, x)
        joints, _ = equilibrium.of_joints(self.sim, True)
        if isinstance(self.solver, Condensed):
            if not self.solver.ready:
                self._eliminate(self.solver, x)
            return [*joints, *of_fluid]
        return [*equilibrium.of_elements(self.sim), *joints, *of_fluid]

    def _eliminate(self, solver: Condensed, x: np.ndarray) -> None:
        """Condense the elements with their nodes at x (nn, dim), where their corners are then."""
        equilibrium.place_corners(self.sim, x)
        solver.eliminate(equilibrium.of_elements(self.sim))
        self.flow.condensed = x.copy()

    def _lacking(self, step: Step, x: np.ndarray, u: np.ndarray) -> tuple[float, np.ndarray, Balance]:
        """Evaluate the residual of forces and fluid, relative to the contributions; the right-hand side (nn + nf, dim);
        the fluid."""
        with self.sim.timers.around("balance"):
            return self._evaluated(step, x, u)

    def _evaluated(self, step: Step, x: np.ndarray, u: np.ndarray) -> tuple[float, np.ndarray, Balance]:
        if len(self.flow.shore):
            equilibrium.place_corners(self.sim, x)  # heads at the shore are those there
        with self.sim.timers.around("flow"):
            now = self.fluid.balance(step, u, x)
        right = np.zeros((len(x) + self.fluid.layers * self.fluid.n, self.sim.dim))
        right[len(x) : len(x) + self.fluid.n, 0] = -now.residual
        sizes = float((now.sizes + now.rounding).sum())
        lack = float(np.abs(now.residual).sum()) / sizes if sizes > 0.0 else 0.0
        if not math.isfinite(lack):
            return math.inf, right, now
        if self.moves:
            self.fluid.show(now.state, now.volume)
            force, ratio, _ = equilibrium.unbalanced(self.sim, self.nodes, self.of_blocks, x)
            right[: len(x)] = force
            lack += ratio
        return lack, right, now
