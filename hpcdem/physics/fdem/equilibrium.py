"""The static solve: equilibrium of blocks at once, by Newton's method with the tangent of the forces.

The unbalanced forces are those of the kernels that step, so the answer is a state of the explicit code at rest; only
the tangent is of its own (physics/fdem/elements/tangent.py, kernels/joint_points.py).
Positions of all nodes are known to every rank meanwhile. Below dim is 2, in space 3; forces are in N/m, in space in N.

What elements that yield remember is that of the last balance while Newton's method looks for the next one, whatever it
tries on the way: `Local.evaluation` puts everything back. They flow where balance was found, never before: what has
changed since the last one (temperatures, moduli, strengths, stresses that were set, loads) is borne by the strain of
the whole increment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import (
    apart,
    changes,
    connectivity,
    diagnostics,
    floors,
    user_functions,
    user_laws,
)
from hpcdem.physics.fdem.by_temperature import TEMPERATURE
from hpcdem.physics.fdem.elements import tangent as tangent_kernels
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.histories import Histories
from hpcdem.physics.fdem.kernels import joint_points, space
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels.joints import BROKEN, YIELDED
from hpcdem.physics.fdem.kernels.plasticity import STRENGTH
from hpcdem.physics.fdem.linear import (
    MANY,
    MANY_IN_SPACE,
    Direct,
    Petsc,
    Pieces,
    Unknowns,
    petsc_there,
    rigid_movements,
)
from hpcdem.physics.fdem.local import Evaluation
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.simulation import Blocks

AIM = 1e-12
"""Target of the ratio of unbalanced forces; rounding ends the iteration earlier where coordinates are large."""
ENOUGH = 1e-8
"""Ratio of unbalanced forces that must be reached, unless another one is requested."""
MOST = 60
"""Number of iterations after which the increment is given up."""
RENEW = 0.1
"""Fraction of the unbalanced forces: the matrix is assembled again when an iteration leaves more than this."""
TOUCH = 1e-9
"""Contact forces over all forces above which surfaces count as being in contact."""
WORST = 1e-3
"""Largest ratio of unbalanced forces that is attributed to rounding."""
HALVINGS = 8
"""Largest number of halvings of the increment of an iteration before it is given up."""
CUTS, FINE = 6, 10
"""Largest number of halvings of a load increment without equilibrium, and the same where joints soften."""
TRIES = 3
"""Number of elastic iterations of an increment that need not reduce the unbalanced forces."""
STILL = 1e-6
"""Change of stress by plastic flow, over the largest stress, that is neglected where one return makes another one
necessary: strengths that follow tables, quads."""
MUCH = 1e-3
"""Change of stress at the beginning, from which on elements are outside by what was set since they last flowed: then
they flow at the whole load only, however many increments lead there."""
BEFORE, AFTER = "temperature before", "temperature after"
"""Columns of elements during a solve: temperatures of the last balance, and those of this one."""
PASSES = 100
"""Largest number of equilibria at one load; each follows the plastic flow after the one before."""
TANGENT = {2: "tangent", 3: "tangent-space"}
SOLVERS = ("auto", "direct", "petsc")


@dataclass(frozen=True)
class Balanced:
    """Outcome of `solve_elastic`. ratio: unbalanced over contributing forces; iterations, factors: of Newton's method;
    unknowns: components free to move; solver: solver of the linear systems; increments of the loads."""

    ratio: float
    iterations: int
    factors: int
    unknowns: int
    solver: str
    increments: int = 1


@dataclass
class _Balance:
    """Outcome of Newton's method: positions (nn, dim), unbalanced over all forces, iterations, factors, joints past
    their peak; error: why there is no equilibrium, "" if there is; ratios: during the iterations; total: sum of forces
    [N/m]."""

    x: np.ndarray
    ratio: float
    iterations: int
    factors: int
    past: int
    error: str
    ratios: list[float]
    total: float


@dataclass
class Nodes:
    """All nodes, on all ranks: the lowest corner (nn,), its point and rank; position and velocity (nn, dim). Nodes
    without elements have corner -1."""

    lead: np.ndarray
    point: np.ndarray
    owner: np.ndarray
    x: np.ndarray
    v: np.ndarray
    least: float = 0.0
    """Smallest sum of forces [N/m] to which the unbalanced forces are compared: joints that break may leave none, nor
    does heat in a body that is free to expand."""
    nothing: float = 0.0
    """Sum of forces below which the model is unloaded, see floors.py."""


def solve_elastic(
    sim: Blocks, cycles: int = 1, ratio: float = ENOUGH, solver: str = "auto", steps: int = 1, softening: bool = False,
    before: np.ndarray | None = None,
) -> Balanced:  # fmt: skip
    """Put the model into static equilibrium with the loads of this moment, at once.

    Elements are elastic or yield after Mohr-Coulomb. Joints must stay before their peak, or, with `softening`, may
    pass it and break, one after the other. Without either of these the answer does not depend on the way, and is the
    one to which relaxation goes. Prescribed velocities act for `cycles` units of time (static mode), what elements that
    were removed left behind has died down, velocities are zero afterwards. Counts as `cycles` steps.

    ratio: unbalanced over contributing forces that must be reached; what rounding allows is aimed at. solver:
    "direct" (SciPy on rank 0: the same bits on any number of ranks), "petsc", "auto": PETSc, if it is there, from
    400 000 unknowns on, else direct. steps: what is out of balance, and prescribed movement, is brought on in so many
    equal increments, in each of which elements flow once; one that finds no balance, or in which more than one joint
    would pass its peak, is halved, up to `CUTS` times (`FINE` with softening). A smallest increment may take several
    joints past their peak, as where there is symmetry. before (n_own, 3 or 4) [K]: temperatures at the last balance, if
    they have changed since; they are brought on in the same increments where elements yield.

    CommandError, with the model as it was: a body that can move freely, conditions without equilibrium, surfaces
    that touch (before or in the answer), user laws, joints past their peak (before or in the answer), no
    convergence.
    """
    for load in sim.surface_loads:
        load.check_complete()
    if cycles < 1 or not ratio > 0.0 or solver not in SOLVERS:
        raise CommandError(f"cycles and ratio must be positive, solver one of {', '.join(SOLVERS)}")
    if steps < 1:
        raise CommandError(f"steps must be positive, got {steps}")
    for load in [load for load in sim.surface_loads if not load.stays]:
        raise CommandError(f"the static solve does not support {load.name}: use model solve")
    if laws := user_laws.in_use(sim):
        raise CommandError(
            f"{user_laws.some(sim)} has the law {laws[0].title}, whose tangent is not known to the static solve: use "
            "model solve"
        )
    sim.close_model()
    if sim.comm.any(bool((sim.local.slot_state == BROKEN).any())):
        sim._renew_lists()
    if not softening:
        _refuse_yielded(sim, int((_lower_states(sim) == YIELDED).sum()), "are past their peak already")
    nodes = all_nodes(sim)
    nodes.least = forces_of_heat(sim)
    unknowns = unknowns_of(sim, nodes, cycles)
    refuse_loose_bodies(sim, nodes, unknowns)
    if softening or sim.slides().any() or sim.yielding().any():
        if before is not None and sim.yielding().any():
            sim.cold[BEFORE], sim.cold[AFTER] = before, sim.cold[TEMPERATURE].copy()
        sim.before_change()  # what flows and breaks is the doing of a command
        sim.close_model()
    relaxations, remembered = sim.relaxations, Memory.of(sim)
    sim.ahead = cycles  # loads are those at the end
    try:
        with at_rest(sim, nodes):
            x, balanced = _follow(
                sim, nodes, unknowns, ratio, linear_solver(sim, solver, unknowns, nodes), steps, cycles, softening
            )
        sim.relaxations = []
        settle(sim, nodes, x, unknowns.given / cycles)
        refuse_touching(sim, touching(sim), "are in contact in the equilibrium")
        if sim.comm.any(inverted(sim)):
            raise CommandError("an element is inverted in the equilibrium: loads are too large")
        apart.check(sim, sim.local, CommandError)
    except CommandError:
        sim.relaxations = relaxations
        sim.before_change()
        remembered.put_back(sim)
        settle(sim, nodes, nodes.x, nodes.v)
        raise
    finally:
        sim.ahead = 0
    for load in sim.surface_loads:
        load.balanced()
    sim.clock.step += cycles
    return balanced


@dataclass
class Memory:
    """Histories of elements and joints, and which joints are broken: numbers of the owned elements, their columns, the
    rows of their joints and contacts with their owners; open faces, broken joints, number of cracks in the log."""

    number: np.ndarray
    cold: dict[str, np.ndarray]
    owner: np.ndarray
    rows: np.ndarray
    open: np.ndarray
    broken: np.ndarray
    cracks: int

    @staticmethod
    def of(sim: Blocks) -> Memory:
        """Collect the nodes of a closed model. Not collective."""
        cold = {name: values.copy() for name, values in sim.cold.items() if name in ("plastic", "softening")}
        number, histories = sim.number[sim.owned].copy(), sim.local.histories(transfer=False)
        owner = number[histories.owners()]
        return Memory(
            number, cold, owner, histories.rows.copy(), sim.open.copy(), sim.broken.copy(), len(sim.event_rows)
        )

    def put_back(self, sim: Blocks) -> None:
        """Elements and joints remember this again, whoever owns them now; the model is open. Collective."""
        mine = self.number, self.cold, self.owner, self.rows
        parts = sim.comm.allgather(mine) if sim.comm.size > 1 else [mine]
        every = np.concatenate([part[0] for part in parts])
        place = np.argsort(every)[np.searchsorted(np.sort(every), sim.number)]
        for name in self.cold:
            sim.cold[name][:] = np.concatenate([part[1][name] for part in parts])[place]
        row_of = np.full(int(every.max(initial=0)) + 1, -1, np.int64)
        row_of[sim.number] = np.arange(len(sim.number))
        owner, rows = (np.concatenate([part[k] for part in parts]) for k in (2, 3))
        here = row_of[owner] >= 0
        sim.histories = Histories.of(len(sim.number), row_of[owner[here]], rows[here])
        if not np.array_equal(sim.open, self.open):
            sim.open[:], sim.broken[:] = self.open, self.broken
            del sim.event_rows[self.cracks :]
            sim.changed(topology=True)


# ---- who can move --------------------------------------------------------------------------------------------


def all_nodes(sim: Blocks) -> Nodes:
    cells = sim.the_mesh().cells
    node = sim.node.reshape(-1)
    corner = np.flatnonzero(node >= 0)[::-1]
    lead = np.full(len(sim.member_begin) - 1, -1, np.int64)
    lead[node[corner]] = corner
    row = np.where(lead >= 0, sim.where[lead // 4], -1)
    mine = np.flatnonzero((row >= sim.owned.start) & (row < sim.owned.stop))
    row, k = row[mine], lead[mine] % 4
    at = sim.stride * k[:, None] + np.arange(sim.dim)
    columns = sim.x[row[:, None], at], sim.v[row[:, None], at]
    found = np.zeros((len(lead), 2 * sim.dim))
    owner = np.zeros(len(lead), np.int64)
    for rank, (numbers, values) in enumerate(sim.comm.allgather((mine, np.column_stack(columns)))):
        found[numbers], owner[numbers] = values, rank
    x, v = found[:, : sim.dim].copy(), found[:, sim.dim :].copy()
    return Nodes(lead, cells.reshape(-1)[lead], owner, x, v, nothing=floors.nothing(sim))


def forces_of_heat(sim: Blocks) -> float:
    """Size of the forces that thermal stress would take to be held. Collective."""
    heat = sim.surface_loads.eigenstress(sim)
    if heat is None:
        return 0.0
    size = sim.areas[sim.number[sim.owned]] ** ((sim.dim - 1) / sim.dim)
    return exact_sum(np.abs(heat) * size, sim.comm)


def unknowns_of(sim: Blocks, nodes: Nodes, cycles: int) -> Unknowns:
    """CommandError for conditions that have no equilibrium."""
    for row in np.unique(sim.corner_row).tolist():
        for function in user_functions.used(sim.conditions[row]).values():
            raise CommandError(
                f"a condition of nodes follows the function {function.title}: the static solve supports numbers and "
                "tables only"
            )
    there = nodes.lead >= 0
    of_nodes = np.zeros(len(nodes.lead), np.int64)
    of_nodes[there] = sim.rows_of_nodes(nodes.lead[there], sim.node)[0]
    table, dim = _mean_conditions(sim, cycles), sim.dim
    free, basis, step = (np.empty((len(table), *shape)) for shape in ((dim,), (dim, dim), (dim,)))
    for row, one in enumerate(table):
        points = nodes.point[there & (of_nodes == row)]
        free[row], basis[row], step[row] = 1.0, np.eye(dim), 0.0
        if row and len(points):
            free[row], basis[row], step[row] = _freedom(sim, one, int(points.min()))
    free, basis, step = free[of_nodes], basis[of_nodes], step[of_nodes]
    free[nodes.lead < 0] = step[nodes.lead < 0] = 0.0
    number = np.full(free.shape, -1, np.int64)
    number[free > 0.0] = np.arange(int((free > 0.0).sum()))
    return Unknowns(number, basis, step * cycles, ~(basis == np.eye(dim)).all(axis=(1, 2)))


def _mean_conditions(sim: Blocks, cycles: int) -> np.ndarray:
    """The table of conditions, movement per unit of time as it is in the mean of these static steps."""
    now, at = sim.time_now(), slice(moving.AT_X, moving.AT_Y + 1, moving.AT_Y - moving.AT_X)
    if sim.dim == 3:
        at = slice(space.AT, space.AT + 3)
    table = sim.conditions_at(now, now, 1.0)
    if cycles > 1 and not sim.options.dynamic and not sim.creep.on and sim.conditions_vary():
        each = [sim.conditions_at(now + k, now + k, 1.0)[:, at] for k in range(cycles)]
        table[:, at] = np.mean(each, axis=0)
    return table


def refuse_changing_tables(sim: Blocks, what: str) -> None:
    """CommandError if conditions of the blocks continue to change while implicit steps count no static ones."""
    for name in sim.changing_tables():
        raise CommandError(
            f"table '{name}' of a condition still changes with static steps, which {what} do not count. Reach its end "
            "with model step or model solve, or give a number"
        )


def _freedom(sim: Blocks, one: np.ndarray, point: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Degrees of freedom of a row of conditions: free directions (1) and others (0), the directions as columns,
    movement per unit of time. point: one to which they apply, for messages."""
    if sim.dim == 2:
        does, at, kind = one[[moving.DOES_X, moving.DOES_Y]], one[[moving.AT_X, moving.AT_Y]], one[moving.CONSTRAINT]
        along = one[[moving.DIRECTION_X, moving.DIRECTION_Y]]
    else:
        does, at, along = (one[first : first + 3] for first in (space.DOES, space.AT, space.WAY))
        kind = one[space.CONSTRAINT]
    held = does != moving.FREE
    if ((does == moving.ACCELERATION) & (at != 0.0)).any():
        raise CommandError(f"node {point} has a prescribed acceleration: there is no equilibrium")
    at = np.where(does == moving.VELOCITY, at, 0.0)
    if kind == moving.FIXED:
        free, basis, step = np.zeros(sim.dim), np.eye(sim.dim), np.zeros(sim.dim)
    elif kind in (moving.ALONG, space.ACROSS):
        touched, oblique = held & (along != 0.0), np.abs(along).max() < 1.0
        if oblique and held.any() and not held.all() and (kind == space.ACROSS or touched.any()):
            raise CommandError(
                f"node {point} moves {'along' if kind == moving.ALONG else 'across'} an oblique line and has some "
                "components prescribed: the static solve supports a move constraint alone, or with all components"
            )
        basis, first = _basis(along)
        free = np.zeros(sim.dim)
        step = float(at @ along) * along
        if kind == space.ACROSS:
            free, step = (np.ones(sim.dim) if oblique and not held.all() else (~held).astype(float)), at - step
        free[first] = float(kind == moving.ALONG and not touched.any())
    else:
        free, basis, step = (~held).astype(float), np.eye(sim.dim), at
    if sim.options.dynamic and step.any():
        raise CommandError(
            f"node {point} moves at a prescribed velocity: there is no equilibrium in dynamic mode; in static mode "
            "(model option dynamic off) it moves that far per unit of time"
        )
    return free, basis, step


def _basis(along: np.ndarray) -> tuple[np.ndarray, int]:
    """Orthogonal basis, as columns, one of them the unit vector `along` (dim,), and its index: the axes, if it is one
    of them, else those that a reflection makes of them (Householder).
    """
    dim, first = len(along), int(np.argmax(np.abs(along)))
    if abs(along[first]) == 1.0:
        return np.eye(dim), first
    normal = along - np.eye(dim)[0]
    basis = np.eye(dim) - 2.0 * np.outer(normal, normal) / (normal @ normal)
    basis[:, 0] = along
    return basis, 0


def refuse_loose_bodies(sim: Blocks, nodes: Nodes, unknowns: Unknowns) -> None:
    """CommandError naming a body that can move as a whole: its three rigid movements, in space six, are checked where
    nodes are held (the smallest eigenvalue of the sum of squares of the movements there)."""
    hold = np.where((sim.closed_faces() & np.repeat(sim.alive, 4)), sim.partner, -1)
    of_elements, dim = connectivity.bodies(hold), sim.dim
    use = nodes.lead >= 0
    body, x = of_elements[nodes.lead[use] // 4], nodes.x[use]
    count = np.maximum(np.bincount(body), 1)
    centre = np.column_stack([np.bincount(body, x[:, c]) / count for c in range(dim)])
    arm = x - centre[body]
    size = np.zeros(len(count))
    np.maximum.at(size, body, np.abs(arm).max(axis=1))
    rigid = rigid_movements(arm / size[body][:, None])
    modes = rigid.shape[2]
    bound = unknowns.number[use] < 0
    along = np.einsum("nck,ncm->nkm", unknowns.basis[use], rigid) * bound[:, :, None]
    squares = np.einsum("nkm,nkl->nml", along, along)
    gram = np.zeros((len(count), modes, modes))
    some = bound.any(axis=1)
    np.add.at(gram, body[some], squares[some])
    there = np.unique(body)
    values, vectors = np.linalg.eigh(gram[there])
    loose = values < 1e-12 * np.maximum(values[:, -1:], 1e-12)
    bad = np.flatnonzero(loose.any(axis=1))
    if not len(bad):
        return
    at = there[bad[0]]
    members = np.flatnonzero((of_elements == at) & sim.alive)
    held = gram[at]
    motions = [f"in {axis}" for c, axis in enumerate("xyz"[:dim]) if held[c, c] <= 1e-12]
    movements = vectors[bad[0]][:, loose[bad[0]]]
    if (np.abs(movements[dim:]) > 1e-6).any():
        motions.append(f"about some {'point' if dim == 2 else 'axis'}" if not motions else "and turn")
    words = " ".join(motions) or "along a line"
    others = f" (and {len(bad) - 1} more bodies)" if len(bad) > 1 else ""
    place = ", ".join(f"{c:g}" for c in centre[at])
    raise CommandError(
        f"the body of {len(members)} elements around ({place}), with element {members[0]}, can move {words}{others}: "
        "fix it by conditions of nodes, or use relaxation (model solve)"
    )


# ---- refusals ------------------------------------------------------------------------------------------------


def _lower_states(sim: Blocks) -> np.ndarray:
    """States of the joints of this rank, each joint once."""
    slot = _lower_slots(sim)
    return sim.local.slot_state[slot]


def _lower_slots(sim: Blocks) -> np.ndarray:
    local = sim.local
    face = local.slot_face[: local.slots]
    return np.flatnonzero((local.slot_state[: local.slots] > 0) & (face < sim.partner[face]))


def _refuse_yielded(sim: Blocks, mine: int, what: str) -> None:
    count = int(sim.comm.sum_into(np.array([mine], np.int64))[0])
    if count:
        raise CommandError(
            f"{count} joints {what}: the static solve supports joints up to their peak only. Use relaxation (model "
            "solve), or face-joint reset state to make them intact"
        )


def touching(sim: Blocks) -> list[tuple[int, int]]:
    """Pairs of elements whose surfaces press on each other, on all ranks. Collective."""
    seen = sim.evaluate()
    pairs = sim.local.pairs
    on_face = seen.pair_force[:, : 3 * sim.dim].reshape(-1, 3, sim.dim).sum(axis=1)
    force = np.sqrt((on_face * on_face).sum(axis=1))
    total = exact_sum(diagnostics.contributing(sim, seen), sim.comm)
    at = np.flatnonzero((seen.touching > 0) & (force > TOUCH * total))
    first, second = pairs.first[at], pairs.element[pairs.second[at]]
    first = pairs.face[first] // 4 if sim.dim == 3 else pairs.element[first]
    mine = list(zip(first.tolist(), second.tolist()))
    return sorted({pair for part in sim.comm.allgather(mine) for pair in part})


def refuse_touching(sim: Blocks, pairs: list[tuple[int, int]], what: str) -> None:
    if pairs:
        a, b = pairs[0]
        raise CommandError(
            f"{len(pairs)} pairs of surfaces {what}, the first of elements {a} and {b}: the static solve does not "
            "support contact. Use relaxation (model solve), or model option collision off if they may overlap"
        )


def inverted(sim: Blocks) -> bool:
    x = sim.x[sim.owned]
    if sim.dim == 3:
        return any(not space.volume(row) > 0.0 for row in x)
    cells = sim.the_mesh().cells[sim.number[sim.owned]]

    def turn(a: int, b: int) -> np.ndarray:
        return (x[:, a] - x[:, 0]) * (x[:, b + 1] - x[:, 1]) - (x[:, a + 1] - x[:, 1]) * (x[:, b] - x[:, 0])

    bad = ~(turn(2, 4) > 0.0)
    if sim.wide:
        bad |= (cells[:, 3] >= 0) & ~(turn(4, 6) > 0.0)
    return bool(bad.any())


# ---- Newton's method -----------------------------------------------------------------------------------------


@contextmanager
def at_rest(sim: Blocks, nodes: Nodes, refuse_contact: bool = True) -> Iterator[None]:
    """Velocities are zero and nothing dies down; afterwards everything is as it was. refuse_contact: surfaces must not
    touch."""
    local = sim.local
    relaxations = local.loads.relaxing_corner
    v = sim.v.copy()
    try:
        hold_still(sim)
        if refuse_contact:
            refuse_touching(sim, touching(sim), "are in contact")
        yield
    finally:
        place_corners(sim, nodes.x)
        if sim.local is local:  # else rows have other places now
            sim.v[:] = v
            local.loads.relaxing_corner = relaxations


def hold_still(sim: Blocks) -> None:
    sim.v[:] = 0.0
    sim.local.loads.relaxing_corner = sim.local.loads.relaxing_corner[:0]


def place_corners(sim: Blocks, x: np.ndarray) -> None:
    """Place all corners held here, ghosts too, by the positions of their nodes (nn, dim)."""
    _put(sim, sim.x, x)


def _put(sim: Blocks, rows: np.ndarray, values: np.ndarray) -> None:
    """Values of the nodes (nn, dim) into the corners of rows (n, w) of positions or velocities."""
    node, stride = sim.node[sim.number], sim.stride
    for k in range(sim.corners):
        at = np.flatnonzero(node[:, k] >= 0)
        rows[at, stride * k : stride * k + sim.dim] = values[node[at, k]]
    if sim.dim == 2:
        changes.repeat(sim, rows)


def settle(sim: Blocks, nodes: Nodes, x: np.ndarray, v: np.ndarray) -> None:
    """Positions and velocities (nn, dim) of all nodes, as a command sets them; the model is closed again."""
    sim.before_change()
    _put(sim, sim.x, x)
    _put(sim, sim.v, v)
    sim.changed(stiffness=False)
    sim.close_model()


def linear_solver(sim: Blocks, wanted: str, unknowns: Unknowns, nodes: Nodes) -> Direct | Petsc:
    many = unknowns.count >= (MANY if sim.dim == 2 else MANY_IN_SPACE)
    there = False
    if wanted == "petsc" or (wanted == "auto" and many):
        there = not sim.comm.any(not petsc_there())
        if wanted == "petsc" and not there:
            raise CommandError("petsc4py is not installed, or PETSc cannot be loaded: use solver direct")
        if not there and sim.log is not None:
            sim.log.warn_once(
                "static solve",
                f"{unknowns.count} unknowns are solved on one rank, as petsc4py is missing: this may need minutes and "
                "many GB of memory",
            )
    if there:
        return Petsc(sim.comm, unknowns, nodes.owner, nodes.x if nodes.x.shape[-1] == 3 else None)
    return Direct(sim.comm, unknowns, nodes.owner)


def _follow(
    sim: Blocks, nodes: Nodes, unknowns: Unknowns, enough: float, solver: Direct | Petsc, steps: int, cycles: int,
    softening: bool,
) -> tuple[np.ndarray, Balanced]:  # fmt: skip
    """Positions of the nodes in equilibrium (nn, dim), by increments: what is out of balance at the beginning grows
    smaller, prescribed movement greater, by equal parts. CommandError if the last ones find no balance."""
    yields, step, slides = sim.local.yielding.on, sim.clock.step + cycles - 1, bool(sim.slides().any())
    solver.flows = yields or softening or slides
    x, iterations, factors, increments = nodes.x, 0, 0, 0
    unit, done = 1 << FINE if softening else 1 << CUTS if yields or slides else 1, 0
    whole, size = steps * unit, unit
    missing, outside = np.zeros(x.shape), False
    try:
        _apply_heating(sim, 0.0)
        if whole > 1:
            missing, _, total = unbalanced(sim, nodes, unknowns, x)
            nodes.least = max(total, nodes.least) if softening else nodes.least
            outside = yields and _still_to_flow(sim) > MUCH
        while done < whole:
            size = min(size, whole - done)
            left = 1.0 - (done + size) / whole
            _apply_heating(sim, 1.0 - left)
            found = _balance(
                sim, nodes, unknowns, enough, solver, x, left * missing, size / whole, step, softening or slides,
                size == 1, yields and (left == 0.0 or not outside),
            )  # fmt: skip
            iterations, factors = iterations + found.iterations, factors + found.factors
            if found.error and size > 1:
                size //= 2
                continue
            if not softening:
                _refuse_yielded(sim, found.past, "would pass their peak")
            if found.error:
                raise CommandError(found.error + (_reached(done / whole) if unit > 1 else ""))
            x, done, increments = found.x, done + size, increments + 1
            nodes.least = max(nodes.least, found.total) if softening else nodes.least
            size = min(2 * size if done % (2 * size) == 0 else size, unit)
    finally:
        solver.close()
        if BEFORE in sim.cold:
            sim.cold[TEMPERATURE][:] = sim.cold[AFTER]
            del sim.cold[BEFORE], sim.cold[AFTER]
    if found.ratio > enough and sim.log is not None:
        sim.log.info(
            f"unbalanced force ratio {found.ratio:.3g} instead of {enough:g}: strains are smaller than the rounding of "
            "positions"
        )
    return x, Balanced(found.ratio, iterations, factors, unknowns.count, solver.name, increments)


def _apply_heating(sim: Blocks, part: float) -> None:
    """Apply this part of the change of temperature since the last solution to the elements, if it is known."""
    if BEFORE in sim.cold:
        before, after = sim.cold[BEFORE], sim.cold[AFTER]
        sim.cold[TEMPERATURE][:] = after if part == 1.0 else before + part * (after - before)
        sim.local.follow_heat()


def _reached(part: float) -> str:
    return f"; it converged with {100.0 * part:.3g} % of the load increment"


def _balance(
    sim: Blocks, nodes: Nodes, unknowns: Unknowns, enough: float, solver: Direct | Petsc, x: np.ndarray,
    missing: np.ndarray, given: float, step: int, softening: bool, smallest: bool, flows: bool,
) -> _Balance:  # fmt: skip
    """Balance of an increment, see `_newton`, where elements that can yield have flowed, if `flows`, and joints have
    opened; as it was, if missing. smallest: more than one joint may pass its peak in it.

    One balance makes the next one necessary, as in steps, where strength follows tables and falls by the flow, in
    quads, where the two triangles of an overlay share their pressure after the flow and one may then flow on, and where
    a joint broke: the third of its points may have held."""
    found = _newton(sim, nodes, unknowns, enough, solver, x, missing, given, softening, fresh=True)
    if found.error or not (flows or softening):
        return found
    if softening and not smallest and int(sim.comm.sum_into(np.array([found.past], np.int64))[0]) > 1:
        found.error = "more than one joint would pass its peak"
        return found
    before, again = Memory.of(sim), flows and (sim.wide or "softening" in sim.cold)
    for _ in range(PASSES):
        broke = commit(sim, nodes, unknowns, found.x, step, softening, flows)
        if not (again or broke):
            return found
        found.ratio = unbalanced(sim, nodes, unknowns, found.x, missing)[1]
        if found.ratio <= enough and (not again or _still_to_flow(sim) <= STILL):
            return found
        after = _newton(sim, nodes, unknowns, enough, solver, found.x, missing, 0.0, softening)
        after.iterations, after.factors = after.iterations + found.iterations, after.factors + found.factors
        found = after
        if found.error:
            break
    sim.before_change()
    before.put_back(sim)
    sim.close_model()
    hold_still(sim)
    found.error = found.error or f"the static solve did not converge: elements still yield after {PASSES} passes"
    return found


def commit(
    sim: Blocks, nodes: Nodes, unknowns: Unknowns, x: np.ndarray, step: int, softening: bool, flows: bool
) -> bool:
    """Elements flow, if `flows`, and joints open at these positions of the nodes (nn, dim), for good. True if some
    joint broke: then it is a free face. CommandError if a body came loose, or its surfaces touch."""
    place_corners(sim, x)
    if flows:
        sim.local.yielding.flow(step)
    if not softening:
        return False
    sim.local.open_joints()
    broke = sim.comm.any(bool((sim.local.slot_state == BROKEN).any()))
    if broke:
        sim._renew_lists()
        refuse_loose_bodies(sim, nodes, unknowns)
        refuse_touching(sim, touching(sim), "are in contact after joints broke")
    return broke


def _still_to_flow(sim: Blocks) -> float:
    """Largest change of a stress by the flow of this moment over the largest stress. Collective."""
    local = sim.local
    after = local.yielding.flowed()[1]
    largest = np.abs(local.stresses(energies=False)[0]).max(initial=0.0)
    parts = [np.abs(new - old).max(initial=0.0) for new, old in zip(after, [of.s0 for of in local.solids.blocks])]
    change, largest = sim.comm.max_into(np.array([max(parts), largest])).tolist()
    return change / largest if largest > 0.0 else 0.0


def _newton(
    sim: Blocks, nodes: Nodes, unknowns: Unknowns, enough: float, solver: Direct | Petsc, x: np.ndarray,
    missing: np.ndarray, given: float, softening: bool, fresh: bool = False,
) -> _Balance:  # fmt: skip
    """Balance of all forces but `missing` (nn, dim) [N/m], from the positions x (nn, dim) and this part of what is
    prescribed on. fresh: an increment begins, with the elastic answer to what is new in it."""
    left, renew, yields = given if unknowns.given.any() else 0.0, True, sim.local.yielding.on
    # Which elements on the yield surface will flow on is not known at the beginning: rounding would say. The first way
    # is elastic, and so is one where those with flow lead nowhere. As the stress that cannot be borne goes to many
    # neighbours such a way may well bring more unbalanced forces.
    elastic, tries = True, TRIES if yields or softening else 0
    iterations = factors = past = 0
    rounding = noise = 0.0
    force, ratio, total = unbalanced(sim, nodes, unknowns, x, missing)
    if fresh and yields:
        with sim.local.yielding.off():
            force = unbalanced(sim, nodes, unknowns, x, missing)[0]
    ratios, error = [ratio], ""
    while iterations < MOST and (left > 0.0 or ratio > max(AIM, 0.05 * noise)):
        if renew:
            place_corners(sim, x)
            pieces, past = tangent(sim, flows=not elastic, softening=softening)
            rounding = _rounding(sim, pieces, x)
            try:
                solver.factor(pieces)
            except CommandError as singular:
                error = str(singular)
                break
            factors += 1
        try:
            increment = solver.solve(force, left)
        except CommandError as singular:
            error = str(singular)
            break
        iterations += 1
        bold = elastic and tries > 0 and ratio > enough
        tries -= bold
        found = _along(sim, nodes, unknowns, x, increment, ratio, left > 0.0 or bold, enough, missing)
        if found is None:
            if ratio <= enough or (renew and (elastic or not tries)):
                break  # as near as rounding allows, or never
            renew, elastic = True, renew or not yields
            continue
        part, x, force, after, total = found
        left = max(left * (1.0 - part), 0.0)
        noise = rounding / total if total > 0.0 else 0.0
        slow = after > 0.5 * ratio and not bold
        done = left == 0.0 and slow and (after <= noise or (renew and after <= enough))
        elastic = not yields
        renew = left > 0.0 or after > max(0.0 if yields or softening else RENEW * ratio, noise)
        ratio = after
        ratios.append(ratio)
        if done:
            break
    place_corners(sim, x)
    _, past = tangent(sim, matrices=False, softening=softening)
    if not error and (left > 0.0 or not ratio <= max(enough, min(noise, WORST))):
        noise = rounding / total if 0.0 < total < math.inf else noise
        why = (
            f"rounding of positions alone causes about {noise:.1g}: coordinates are too large, or properties differ by "
            "too many orders of magnitude"
            if noise > enough
            else "the loads may exceed the capacity of the model: use relaxation (model solve)"
        )
        error = (
            f"the static solve did not converge: ratio {ratio:.3g} after {iterations} iterations, required {enough:g}; "
            f"{why}"
        )
    return _Balance(x, ratio, iterations, factors, past, error, ratios, total)


def _along(
    sim: Blocks,
    nodes: Nodes,
    unknowns: Unknowns,
    x: np.ndarray,
    increment: np.ndarray,
    ratio: float,
    bold: bool,
    enough: float,
    missing: np.ndarray,
) -> tuple[float, np.ndarray, np.ndarray, float, float] | None:
    """Return the largest of the fractions 1, 1/2, 1/4 ... of the increment that reduces the unbalanced forces, and what
    is there: position, forces, ratio, sum of forces. bold: they may as well be farther from it, as while prescribed
    movements are made.
    """
    part = 1.0
    for _ in range(HALVINGS):
        trial = x + part * increment
        force, after, total = unbalanced(sim, nodes, unknowns, trial, missing)
        if after < ratio or (bold and after < 1.0):
            return part, trial, force, after, total
        if ratio <= enough and not bold:
            return None
        part *= 0.5
    return None


def _rounding(sim: Blocks, pieces: list[Pieces], x: np.ndarray) -> float:
    """Sum of the forces that positions rounded to the last bit make [N/m]: K_ii |x_i| epsilon. Collective."""
    parts = [np.empty(0)]
    for one in pieces:
        at = np.abs(x[one.node]).reshape(one.stiffness.shape[:2])
        parts.append((np.einsum("mii->mi", one.stiffness) * at).reshape(-1))
    return exact_sum(np.concatenate(parts), sim.comm) * float(np.finfo(np.float64).eps)


def unbalanced(
    sim: Blocks, nodes: Nodes, unknowns: Unknowns, x: np.ndarray, missing: np.ndarray | float = 0.0
) -> tuple[np.ndarray, float, float]:
    """Forces (nn, dim) on nodes at these positions, conditions and `missing` left out, the ratio, and the sum of the
    sizes of all forces [N/m]; equal on all ranks. The ratio is infinite where forces are no numbers."""
    with np.errstate(invalid="ignore", over="ignore"):
        place_corners(sim, x)
        seen = sim.local.evaluation(contact=False)
    force, sizes = _node_forces(sim, seen) - missing, diagnostics.contributing(sim, seen)
    if sim.comm.any(not np.isfinite(sizes).all()) or not np.isfinite(force).all():
        return force, math.inf, math.inf
    total = max(exact_sum(sizes, sim.comm), nodes.least)
    if total < nodes.nothing:
        total = max(total, floors.rounding(sim) / ENOUGH)
    unbalanced = float(np.abs(unknowns.reduced(force)).sum())
    return force, unbalanced / total if total != 0.0 else 0.0, total


def _node_forces(sim: Blocks, seen: Evaluation) -> np.ndarray:
    """Sum of the forces on every node (nn, dim) [N/m], on all ranks."""
    local, own = sim.local, sim.owned
    lead = local.nodes.first_corners
    row = sim.where[lead // 4]
    mine = (row >= own.start) & (row < own.stop)
    i, k = np.nonzero(local.nodes.alone)
    corner = np.concatenate([lead[mine], 4 * sim.number[own][i] + k])
    flat = seen.force[own]
    at = sim.stride * k[:, None] + np.arange(sim.dim)
    values = np.concatenate([seen.felt[mine, : sim.dim], flat[i[:, None], at]])
    out = np.zeros((len(sim.member_begin) - 1, sim.dim))
    node = sim.node.reshape(-1)
    for corners, forces in sim.comm.allgather((corner, values)) if sim.comm.size > 1 else [(corner, values)]:
        out[node[corners]] = forces
    return out


def tangent(
    sim: Blocks, matrices: bool = True, flows: bool = True, softening: bool = False
) -> tuple[list[Pieces], int]:
    """Stiffness of the owned elements and joints at the present positions, and how many joints are past their peak,
    see `of_joints`. flows: less what the flow of elements takes from it. Collective, as its parts are."""
    sim.close_model()
    joints, past = of_joints(sim, softening)
    return ([*of_elements(sim, flows), *joints] if matrices else []), past


def of_joints(sim: Blocks, softening: bool = False) -> tuple[list[Pieces], int]:
    """Stiffness of the owned joints at the present positions, and how many are past their peak; with softening, those
    that pass it now."""
    sim.prepare_kernels(TANGENT[sim.dim])
    local, slots, size = sim.local, _lower_slots(sim), 2 * sim.dim * sim.dim
    found: list[Pieces] = []
    past = 0
    for which, joints in local.joints(slots):
        made, left = np.empty((len(which), size, size)), np.empty(len(which))
        joint_points.stiffness(*joints, local.joint_table, local.joint_beyond, softening, made, left)
        state = joints.state[joints.slots]
        past += int(((left < 0.0) & (state <= BROKEN) & ~(softening & (state >= YIELDED))).sum())
        ends, basis = local.joint_ends(slots[which], of_sides=len(found) > 0)
        if basis is not None:
            made = np.einsum("nai,nab,nbj->nij", basis, made, basis, optimize=True)
        found.append(Pieces(local.slot_face[slots[which]], sim.node.reshape(-1)[ends], made))
    return found, past


def of_elements(sim: Blocks, flows: bool = True) -> list[Pieces]:
    """Stiffness of the owned elements at the present positions. flows: less what flow takes from it."""
    sim.prepare_kernels(TANGENT[sim.dim])
    if sim.local.yielding.on:
        sim.prepare_kernels("plastic-tangent")
    local, small = sim.local, not sim.options.large_strain
    found: list[Pieces] = []
    for of, (c, s0) in zip(local.solids.blocks, local.solids.linear()):
        kind, who, (row, at) = of.kind, of.alone, np.divmod(of.places()[of.alone], sim.x.shape[1])
        made = np.empty((len(who), kind.dim * kind.corners, kind.dim * kind.corners))
        tangent_kernels.elastic(of.tables._replace(c=c), who, of.of_parts(s0, c), small, made)
        if local.yielding.on and flows:
            _soften(sim, of, made)
        found.append(Pieces(sim.number[of.rows[who]], sim.node[sim.number[row], at // sim.stride], made))
    return found if local.whole is None else [*found, local.whole.pieces()]


def _soften(sim: Blocks, of: ElementBlock, out: np.ndarray) -> None:
    """Take from the stiffness out (n, m, m) of elements what their flow, from the stress before it, takes from it."""
    table, small, count = sim.local.yielding.table, not sim.options.large_strain, len(of.kind.parts)
    can = np.flatnonzero(np.isfinite(table[of.law[of.alone], STRENGTH]).any(axis=1))
    if not len(can):
        return
    who, part = of.alone[can], out[can]
    stress, turn = np.empty((len(who), count, 3, 3)), np.empty((len(who), count, 3, 3))
    tangent_kernels.trials(of.tables, who, of.s0, small, stress, turn)
    values, axes = principal(stress.reshape(-1, 3, 3))
    if sim.options.plane_stress:  # the stress across the plane stands between the other two
        across = np.argmax(np.abs(axes[:, 2]), axis=1)
        order = np.array([[1, 0, 2], [0, 1, 2], [0, 2, 1]])[across]
        values, axes = np.take_along_axis(values, order, axis=1), np.take_along_axis(axes, order[:, None], axis=2)
    axes = _product(turn.reshape(-1, 3, 3), axes).reshape(turn.shape)
    tangent_kernels.soften(of.tables, who, values.reshape(-1, count, 3), axes, of.law, table, small, part)
    out[can] = part


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (n, 3, 3) of matrices, with the same bits wherever they stand."""
    return a[:, :, 0, None] * b[:, 0, None] + (a[:, :, 1, None] * b[:, 1, None] + a[:, :, 2, None] * b[:, 2, None])
