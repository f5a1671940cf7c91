"""Flow by implicit steps, with blocks in static equilibrium at the end of each: fluid and rock by one Newton method.

Joints may pass their peak and break on the way; time steps are cut where none of them finds balance, or where more than
one joint would pass its peak, in space more than are along the rim of a fracture. No step without balance is ever kept.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import equilibrium, pressed, user_laws
from hpcdem.physics.fdem.linear import Condensed
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import energy
from hpcdem.physics.flow.costs import Cost, implicit
from hpcdem.physics.flow.implicit import Fluid, reference_pressure
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.system import Found, System

CUTS = 1e-9
"""Smallest time step over the longest one."""
EASY, HARD = 6, 12
"""Numbers of iterations of a step: up to the first the next step may be longer, from the second on it must be
shorter."""
GROWTH, MOST_GROWTH = 1.4, 4.0
"""Growth factor of the time step from one step to the next where growth is due, and the largest power of it."""
FEW, PLENTY = 6, 10
"""Numbers of time steps between the peak of a joint and that of the next: fewer make time steps shorter, more make them
longer."""
TOGETHER = 1e-3
"""Fraction of the longest time step below which several joints may pass their peak in one step, as they do where there
is symmetry."""
MOST_STEADY = 100
"""Largest number of time steps towards steady flow."""
STEADY = 1e-9
"""Storage over the flow, below which a flow counts as steady."""
ROUNDING = 1e-14
"""Change of pressures and saturations in a step, over the largest of them, that counts as none."""
KEPT = 1e-6
"""Change of the mass of fluid in such a step, over the total mass, that is attributed to the rounding of flow rates."""
QUIET = 8
"""Number of steps without a change, each longer than the one before, after which the flow counts as steady because
nothing flows."""


class Coupled(System):
    """Blocks and their fluid, or fluid alone, while time passes by implicit steps. A context: the model is settled when
    it is left. A checkpoint that was written inside resumes inside: nothing is settled in between that would not have
    been without it. Methods are collective; CommandError with the model as it was after the last step that found
    balance.

    longest: time step [s]. The next one that is tried is `Flow.implicit_dt`.
    """

    def __init__(self, sim: Blocks, longest: float, solver: str = "auto") -> None:
        flow = Flow.there(sim)
        if flow is None or not len(flow.network.channels):
            raise CommandError("no channels yet: assign face-joint c-model hydraulic-porous-medium first")
        if not longest > 0.0 or solver not in equilibrium.SOLVERS:
            raise CommandError(
                f"the time step must be positive, solver one of {', '.join(equilibrium.SOLVERS)}, got {longest:g}, "
                f"{solver}"
            )
        super().__init__(sim, flow, solver)
        self.longest = longest
        if self.moves and (slides := np.flatnonzero(sim.slides())).size:
            raise CommandError(
                f"face-joint {slides[0]} ({len(slides)} in all) has the model "
                f"{sim.joint_rows.name(sim.joint_row[slides[0]]).replace('_', '-')}: implicit steps of blocks with "
                "fluid do not support sliding joints; use explicit steps (model step, model solve time)"
            )
        self.front = 1
        """Joints that may pass their peak in one step: in space about those along the rim of a fracture in so many."""
        if sim.dim == 3:
            self.front = max(1, round(math.sqrt(int(((sim.joint_row > 0) & sim.joint_exists()).sum()))))
        self._refuse()

    def _refuse(self) -> None:
        """CommandError for what implicit steps cannot do."""
        sim = self.sim
        for load in sim.surface_loads:
            if load.name not in ("fluid", "proppant") and self.moves:
                raise CommandError(f"implicit steps of flow do not support {load.name}: use model step or model solve")
        if not sim.options.hydraulic:
            raise CommandError("the hydraulic part is switched off: use model option hydraulic on first")
        if not self.moves:
            return
        if sim.options.dynamic:
            raise CommandError(
                "implicit steps keep blocks in static equilibrium: use model option dynamic off first, or mechanical "
                "off for flow alone"
            )
        if laws := user_laws.in_use(sim):
            raise CommandError(
                f"{user_laws.some(sim)} has the law {laws[0].title}, whose tangent is not known to implicit steps"
            )
        if sim.yielding().any():
            raise CommandError(
                "implicit steps of flow support elastic elements only: use explicit steps for yielding elements"
            )

    def __enter__(self) -> Coupled:
        sim, flow = self.sim, self.flow
        inside = flow.implicit  # says the checkpoint
        flow.check_wells()
        sim.close_model()
        if self.moves:
            equilibrium.refuse_changing_tables(sim, "implicit steps of flow")
        if self.moves and not inside and sim.comm.any(bool((sim.local.slot_state == equilibrium.BROKEN).any())):
            sim._renew_lists()
        if flow.slurry is not None:
            flow.slurry.check_start()
        self._take_nodes()
        if self.moves and not inside:
            equilibrium.refuse_loose_bodies(sim, self.nodes, self.of_blocks)
            sim.before_change()
            sim.close_model()
            if len(pressed.join(sim, self.nodes)):
                self._take_nodes()
        try:
            self._begin(inside)
        except CommandError:
            flow.p0 = 0.0
            if self.moves:
                pressed.part(sim)
            raise
        return self

    def _begin(self, inside: bool) -> None:
        sim, flow = self.sim, self.flow
        if not inside:
            flow.p0 = reference_pressure(flow, self._stress())
        self.fluid = Fluid(flow, flow.p0)
        self.fluid.volume = self.fluid.volumes(self.fluid.table_at(self.x))
        self.solver = self._solver()
        self._stored = (0.0, 0.0)
        if not self.moves:
            return
        self._rest = equilibrium.at_rest(sim, self.nodes, refuse_contact=not inside)
        try:
            self._rest.__enter__()
        except CommandError:
            self.solver.close()
            raise
        self._stored = energy.stored(sim)
        if isinstance(self.solver, Condensed) and flow.condensed is not None:
            self._eliminate(self.solver, flow.condensed)
            equilibrium.place_corners(sim, self.x)

    def __exit__(self, *error: Any) -> None:
        self.flow.p0, self.flow.condensed = 0.0, None
        if self.moves:
            sim = self.sim
            pressed.part(sim)
            self._rest.__exit__(None, None, None)
            equilibrium.place_corners(sim, self.x)  # the next reach is measured there
            equilibrium.settle(sim, self.nodes, self.x, np.zeros_like(self.x))
            held = pressed.beside(sim, pressed.opposite(sim, self.x))
            pairs = [pair for pair in equilibrium.touching(sim) if not held[list(pair)].all()]
            if pairs and sim.log is not None:
                one, other = pairs[0]
                sim.log.warn(
                    f"{len(pairs)} pairs of surfaces are in contact outside a joint or have slipped by more than "
                    f"{pressed.APART:g} of its length, first elements {one} and {other}. Explicit steps can continue; "
                    "implicit steps cannot"
                )
        self.solver.close()

    def cost(self, time: float) -> Cost:
        """Estimate the cost of so much flow time [s]. CommandError for conditions that implicit steps do not support.
        Collective."""
        self.sim.close_model()
        self._take_nodes()
        kept = self._of_joints()
        condensed = self.moves and Condensed.suits(self.unknowns, kept) and self.wanted != "petsc"
        left = int((self.unknowns.number[np.unique(kept)] >= 0).sum()) if condensed else 0
        return implicit(time, self.longest, self.unknowns.count, left)

    # ---- time steps ----------------------------------------------------------------------------------------------

    def advance(self, end: float) -> None:
        """Take one time step, at most to this flow time [s]."""
        flow = self.flow
        change = min((well.next_change(flow.time) for well in flow.wells), default=math.inf)
        left = min(end, change) - flow.time
        dt = min(flow.implicit_dt or self.longest, self.longest)
        while True:
            parts = max(1, math.ceil(left / dt - 1e-9))
            now = left / parts if parts < 3 else dt
            found = self._tried(now)
            if not found.error:
                break
            self.count.cut += 1
            dt = 0.5 * now
            if dt < CUTS * self.longest:
                raise CommandError(f"flow time {flow.time:.6g} s: {found.error}")
        self.count.steps += 1
        # What is left of a stage says nothing of the step after it.
        flow.implicit_dt = min(self._next(dt if change < end else now, found), self.longest)
        self.sim.clock.step += 1
        if flow.slurry is not None:
            flow.slurry.flowed()

    def _next(self, dt: float, found: Found) -> float:
        """The time step after one of dt [s]: joints pass their peak every few steps, and Newton's method is quick."""
        flow = self.flow
        flow.since_peak += 1
        flow.passed += found.past
        since = flow.since_peak
        longer = dt * GROWTH ** min(since / PLENTY, MOST_GROWTH)
        if flow.passed >= self.front:
            flow.since_peak = flow.passed = 0
            return dt / GROWTH if since < FEW else longer if since > PLENTY else dt
        if found.iterations > HARD:
            return dt / GROWTH
        return longer if found.iterations <= EASY and since > PLENTY else dt

    def steady(self) -> None:
        """Flow alone until as much comes as goes; flow time does not pass."""
        flow = self.flow
        if self.moves:
            raise CommandError("steady flow needs fixed blocks: use model option mechanical off")
        if bool(np.isfinite(flow.since).any()):
            raise CommandError("steady flow does not exist with leak-off")
        time, dt, growth, quiet = flow.time, self.longest, 10.0, 0
        for _ in range(MOST_STEADY):
            found = self._tried(dt, passes=False)
            flow.time = time
            if found.error:
                self.count.cut += 1
                dt, growth = 0.3 * dt, 1.5
                if dt < CUTS * self.longest:
                    raise CommandError(f"steady flow: {found.error}")
                continue
            self.count.steps += 1
            quiet = quiet + 1 if found.still else 0
            if found.storing <= STEADY or quiet == QUIET:
                return
            dt, growth = growth * dt, min(1.5 * growth, 10.0)
        raise CommandError(
            "no steady flow found: prescribe a pressure or a level at some node, or rates with a sum of 0"
        )

    def _tried(self, dt: float, passes: bool = True) -> Found:
        """Try a time step of dt [s], which is taken if equilibrium is found. passes: use the conditions at its end,
        otherwise the present ones."""
        sim, (step, u) = self.sim, self.fluid.begin(dt, self.x, passes)
        found = self._newton(step, self.x, u)
        if not found.error and found.past > self.front and dt > TOGETHER * self.longest:
            found.error = f"more than {self.front} joints would pass their peak"
        work, before = np.zeros(3), self.fluid.state_of(self.fluid.u, self.x)
        if not found.error and self.moves:
            memory, past = equilibrium.Memory.of(sim), found.past
            work += energy.of_blocks(sim, self.fluid, self.x, found.x, before, found.fluid.state)
            while self._open_joints(found.x):
                # Strength of all its points is gone, of those that had some left too.
                last, found = found, self._newton(step, found.x, found.u)
                if not found.error:
                    states = last.fluid.state, found.fluid.state
                    work += energy.of_blocks(sim, self.fluid, last.x, found.x, *states)
                else:
                    sim.before_change()
                    memory.put_back(sim)
                    sim.close_model()
                    equilibrium.hold_still(sim)
                    break
            found.past = past
        if found.error:
            equilibrium.place_corners(sim, self.x)
            self.fluid.conditions = None
            self.fluid.show(self.fluid.state_of(self.fluid.u, self.x))
            return found
        total = float(found.fluid.sizes.sum())
        change, held = (float(np.abs(one).sum()) for one in (found.fluid.fluid - step.fluid, step.fluid))
        found.storing = change / total if total > 0.0 else 0.0
        still = np.abs(found.u - self.fluid.u).max(initial=0.0) <= ROUNDING * np.abs(found.u).max(initial=0.0)
        found.still = bool(still) and change <= KEPT * held
        volume = self.fluid.volume
        self.x = found.x
        given = self.fluid.take(step, found.fluid, found.u)
        if self.fluid.packs is not None:
            self.flow.energy = None  # what packs of grains take is not known
        if passes:
            self._book(energy.of_fluid(self.fluid, step, before, volume, found.fluid, given), *work)
        return found

    def _book(self, of_fluid: dict[str, float], joints: float, pushed: float, outside: float) -> None:
        """A step was taken, in which joints, the fluid and what else acts on the blocks did so much work."""
        entries = self.flow.energy
        if entries is None:
            return
        had, self._stored = self._stored, energy.stored(self.sim) if self.moves else (0.0, 0.0)
        strain, given_back = (now - then for now, then in zip(self._stored, had))
        of_blocks = {"strain": strain, "joints": given_back, "fracture": -joints - given_back}
        of_blocks |= {"pushed": pushed, "outside": outside}
        for name, value in (of_fluid | of_blocks).items():
            entries[name] += value

    def _open_joints(self, x: np.ndarray) -> bool:
        """Joints remember these positions (nn, dim) of the nodes; whether some broke. Until the run is over they stay
        joints that have no strength: pressed together, their penalty carries them. Leak-off begins."""
        sim, local = self.sim, self.sim.local
        equilibrium.place_corners(sim, x)
        before = local.slot_state == equilibrium.BROKEN
        local.open_joints()
        mine = local.slot_face[(local.slot_state == equilibrium.BROKEN) & ~before]
        faces = np.concatenate(sim.comm.allgather(mine)) if sim.comm.size > 1 else mine
        self.flow.note_leaks(np.unique(np.minimum(faces, sim.partner[faces])))
        return len(faces) > 0


def leave(sim: Blocks) -> None:
    """The model of a checkpoint that was written inside a `Coupled` is as it is after one: no run resumes there.
    Collective."""
    flow = Flow.there(sim)
    if flow is None or not flow.implicit:
        return
    flow.p0, flow.condensed = 0.0, None
    if sim.options.mechanical:
        nodes = equilibrium.all_nodes(sim)
        pressed.part(sim)
        equilibrium.settle(sim, nodes, nodes.x, np.zeros_like(nodes.x))
