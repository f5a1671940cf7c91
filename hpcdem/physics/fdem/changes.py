"""Changes of a model between steps: elements are excavated or restored, cracks made, velocities assigned."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import backfill, diagnostics, hexahedra, user_laws
from hpcdem.physics.fdem import mesh as meshes
from hpcdem.physics.fdem.conditions import Relaxation
from hpcdem.physics.fdem.kernels.creep import IN_KELVIN
from hpcdem.physics.fdem.kernels.plasticity import IN_SHEAR, IN_TENSION, SHEAR, VOLUME
from hpcdem.physics.fdem.properties import ELEMENT, KELVIN_STRAIN, MECH_BURGERS, model
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.fdem.topology import Numbers, finite
from hpcdem.physics.fdem.user_laws import MARK

VECTORS = "position", "displacement", "velocity"


def crack(sim: Blocks, joints: Numbers) -> None:
    """Open inner edges without an event: a crack that is there from the beginning. Faces meet by contact. CommandError
    for joints that slide, whose model says that they never part."""
    at = sim.numbers_of_joints(joints)
    if len(slides := at[sim.slides()[at]]):
        raise CommandError(
            f"face-joint {slides[0]} ({len(slides)} in all) has the model "
            f"{sim.joint_rows.name(sim.joint_row[slides[0]]).replace('_', '-')}, whose joints slide and never break, "
            "so it cannot become a crack. Exclude it, or assign a cohesive model first"
        )
    sim.before_change()
    sim.open_faces(at)
    sim.changed(topology=True)


def null(sim: Blocks, elements: Numbers, relax: float = 0.0) -> None:
    """Take elements out: no mass, no force, no contact; faces beside them become free.

    relax: what they did to the elements that stay dies down linearly over this model time [s] (in static mode:
    over so many steps) instead of at once.
    """
    at = sim.numbers_of_elements(elements)
    span = float(finite("relax", [relax])[0])
    if span < 0.0:
        raise CommandError(f"relax must not be negative, got {relax:g}")
    if len(at) == int(sim.alive.sum()):
        raise CommandError("this would remove all remaining elements")
    dying = np.zeros(len(sim.alive), bool)
    dying[at] = True
    left = _forces_left_behind(sim, dying) if span > 0.0 and len(at) else None
    sim.before_change()
    sim.alive[at] = False
    sim.surface_loads.elements_removed(at)
    faces = (4 * at[:, None] + np.arange(4)).reshape(-1)
    beside = sim.partner[faces]
    sim.open[faces[beside >= 0]] = True
    sim.open[beside[beside >= 0]] = True
    stay = np.flatnonzero(~dying[sim.number])
    sim.number, sim.x, sim.v = sim.number[stay], sim.x[stay], sim.v[stay]
    sim.cold = {name: values[stay] for name, values in sim.cold.items()}
    sim.histories = sim.histories.take(stay).without_partners(dying, sim.dim)
    if left is not None and len(left[0]):
        begin = sim.clock.time if sim.options.dynamic else float(sim.clock.step)
        sim.relaxations.append(Relaxation(*left, begin, span, not sim.options.dynamic))
    sim.ownership.wanted = True
    sim.changed(topology=True)


def element_model(sim: Blocks, elements: Numbers, name: str, given: Mapping[str, Value]) -> None:
    """Assign a model (model.blocks.properties) with all its properties to elements; None: to all that are there.
    Elements among these numbers that were removed come back (see `_bring_back`)."""
    asked = np.flatnonzero(sim.alive)
    if elements is not None:
        asked = sim.existing(elements, np.ones(len(sim.alive), bool), "element")
    if MARK in name and sim.budget is not None:
        raise CommandError(
            f"the energy budget does not support the law {name.partition(MARK)[0]}, whose stored and lost energy is "
            "not known: use model option energy off"
        )
    if elements is not None:
        sim.refuse_laws(asked, name, given)
        sim.complete(ELEMENT, asked, model(name, ELEMENT), {}, given)  # refused before anything is done
        back = asked[~sim.alive[asked]]
        if len(back):
            sim.refuse_parts(back)
            _bring_back(sim, back)
    sim.set_element_model(elements, name, given)


def _bring_back(sim: Blocks, back: np.ndarray) -> None:
    """Elements (n,) that were removed are there again, of new material: free of strain and initial stress where
    the void is now (backfill.py), moving with it. Faces between them, and to elements around them, are connected
    without joints and loads, unless they are cracks of the mesh or the body is torn there."""
    mesh, allowed = sim.the_mesh(), backfill.TORN * sim.mean_edge
    cells, n_points = mesh.cells, len(mesh.points)
    own = cells[back]
    on_void = np.zeros(n_points + 1, bool)  # the last one is for the fourth corner of triangles
    on_void[own[own >= 0]] = True
    beside = np.flatnonzero(sim.alive & on_void[cells].any(axis=1))
    use = on_void[cells[beside]]
    corner, point = (4 * beside[:, None] + np.arange(4))[use], cells[beside][use]
    x, u, v = (
        diagnostics.corner_values(sim, name, corner)[corner] for name in ("position", "displacement", "velocity")
    )
    mass = sim.corner_masses(beside)
    one = np.ones(len(corner))
    rim = _weighted(x, one, point, n_points)
    apart = np.zeros(n_points)
    np.maximum.at(apart, point, np.linalg.norm(x - rim[point], axis=1))
    known = (np.bincount(point, minlength=n_points) > 0) & (apart <= allowed)
    given = np.hstack([rim - mesh.points, _weighted(u, one, point, n_points), _weighted(v, mass[use], point, n_points)])
    found = backfill.extended(mesh.points, own, known, given) if sim.comm.rank == 0 else None
    offset, shown, speed = np.split(sim.comm.bcast(found), 3, axis=1)
    real = own >= 0
    places = np.where(real[:, :, None], (mesh.points + offset)[own], 0.0)
    _refuse_overlap(sim, back, places, allowed)

    sim.before_change()
    sim.alive[back] = True
    faces = (4 * back[:, None] + np.arange(4))[real]
    over = sim.partner[faces]
    faces, over = faces[over >= 0], over[over >= 0]
    faces, over = faces[sim.alive[over // 4]], over[sim.alive[over // 4]]
    cracked = np.zeros(len(sim.partner), bool)
    rows = meshes.crack_rows(mesh, mesh.edges())
    cracked[mesh.edges().faces[rows, 0]] = True
    cracked |= np.where(sim.partner >= 0, cracked[sim.partner], False)
    ends = mesh.face_points(faces)
    hold = ~cracked[faces] & (known[ends].all(axis=1) | np.isin(over // 4, back))
    for side, other in ((faces, over), (over, faces)):
        sim.open[side] = ~hold
        sim.joint_row[side] = 0
        sim.broken[np.minimum(side, other)] = 0
    sim.load_row[(4 * back[:, None] + np.arange(4)).reshape(-1)] = 0
    if sim.stress0 is not None:
        sim.stress0[back] = 0.0
        sim.stress0_row[back] = 0
    sim.take_births(back, places)
    if sim.comm.rank == 0:
        _append(sim, back, places, shown[own], speed[own], real)
    sim.changed(topology=True)
    sim.renew_topology()
    _move_as_one(sim, back, corner, v, mass[use])
    sim.ownership.wanted = True
    if sim.log is not None:
        sim.log.info(
            f"{len(back)} elements reinstated at their present position, free of stress; connected to neighbours by "
            f"{int((hold & ~np.isin(over // 4, back)).sum())} faces, without joints"
        )


def _refuse_overlap(sim: Blocks, back: np.ndarray, places: np.ndarray, allowed: float) -> None:
    """CommandError if elements (n,) cannot be at places (n, 4, dim): turned inside out, over others. Collective."""
    cells = sim.the_mesh().cells
    moved = sim.the_mesh().with_own_points(back, places)
    flat = back[moved.areas()[back] <= 0.0]
    if len(moved.hexes):
        bad = hexahedra.volumes(moved.points, moved.hexes).min(axis=1) <= 0.0
        flat = np.union1d(flat, moved.hexes[bad, 8])
    if len(flat):
        raise CommandError(
            f"element {flat[0]} cannot be reinstated: its void has closed, and the element would be inverted"
        )
    everyone = diagnostics.corner_values(sim, "position").reshape(-1, 4, sim.dim)
    everyone[back] = places
    problem = backfill.deepest(cells, everyone, back, np.flatnonzero(sim.alive), allowed)
    if problem is not None:
        e, f, deep = problem
        raise CommandError(
            f"element {e} cannot be reinstated: element {f} intrudes by {deep:.3g} m. Remove it first: element c-model "
            f"null range id {f}"
        )


def _append(
    sim: Blocks, back: np.ndarray, places: np.ndarray, shown: np.ndarray, speed: np.ndarray, real: np.ndarray
) -> None:
    """Rows of elements (n,) that this rank owns from now on: corners (n, 4, dim) at places [m], displacements shown
    there [m] and velocities [m/s]; real (n, 4): which are corners."""

    def rows(values: np.ndarray, width: int) -> np.ndarray:
        out, count = np.zeros((len(back), width)), min(4, width // sim.stride)
        own = np.pad(np.where(real[:, :, None], values, 0.0), ((0, 0), (0, 0), (0, sim.stride - sim.dim)))[:, :count]
        out[:, : sim.stride * count] = own.reshape(len(back), -1)
        return out

    sim.number = np.concatenate([sim.number, back])
    sim.x = np.concatenate([sim.x, rows(places, sim.x.shape[1])])
    sim.v = np.concatenate([sim.v, rows(speed, sim.v.shape[1])])
    repeat(sim, sim.x)
    for name, values in sim.cold.items():
        new = rows(places - shown, values.shape[1]) if name == "home" else np.zeros((len(back), values.shape[1]))
        sim.cold[name] = np.concatenate([values, new])
    sim.histories = sim.histories.joined(np.zeros(len(back), np.int64), sim.histories.rows[:0])


def _move_as_one(sim: Blocks, back: np.ndarray, corner: np.ndarray, v: np.ndarray, mass: np.ndarray) -> None:
    """Corners that have become one node by elements that came back get one velocity: that of those that were there
    (m,) together keeps their momentum, v (m, dim) [m/s], mass (m,) [kg/m], in space [kg]."""
    node = sim.node.reshape(-1)
    shared = np.zeros(len(sim.shared_nodes), bool)
    shared[sim.node[back][sim.node[back] >= 0]] = True
    use = shared[node[corner]]
    total = np.bincount(node[corner][use], mass[use], minlength=len(shared))
    mean = _weighted(v[use], mass[use], node[corner][use], len(shared))
    mine = sim.node[sim.number][:, : sim.corners]
    i, k = np.nonzero(mine >= 0)
    j = mine[i, k]
    one = shared[j] & (total[j] > 0.0)
    i, k, j = i[one], k[one], j[one]
    for axis in range(sim.dim):
        sim.v[i, sim.stride * k + axis] = mean[j, axis]
    repeat(sim, sim.v)


def _forces_left_behind(sim: Blocks, dying: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners that stay, and what dying elements do to them through common nodes and joints (n, dim) [N/m], in space
    [N]."""
    seen = sim.evaluate()
    local, dim = sim.local, sim.dim
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    # Common nodes: the forces of the dying corners fall to the lowest corner that stays. Every node is checked by
    # the owner of that corner.
    begin, corner_at = local.nodes.pulled
    if len(corner_at):
        node = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
        number, k = np.divmod(local.nodes.code_of(corner_at), 4)
        dies = dying[number]
        heir = np.full(len(begin) - 1, np.iinfo(np.int64).max)
        np.minimum.at(heir, node[~dies], 4 * number[~dies] + k[~dies])
        mine = np.zeros(len(heir), bool)
        known = heir < np.iinfo(np.int64).max
        at = sim.where[heir[known] // 4]
        mine[known] = (at >= sim.owned.start) & (at < sim.owned.stop)
        use = dies & mine[node]
        flat = seen.at_corners.reshape(-1)
        force = flat[corner_at[use][:, None] + np.arange(dim)]
        parts.append((heir[node[use]], 4 * number[use] + k[use], force))
    # Joints: the forces on this side.
    slot = np.flatnonzero(local.slot_state[: local.slots] > 0)
    face = local.slot_face[slot]
    slot = slot[dying[sim.partner[face] // 4] & ~dying[face // 4]]
    corner, force = local.corner_forces(slot)
    parts += [(of[of >= 0], local.slot_face[slot][of >= 0], force[of >= 0, k]) for k, of in enumerate(corner.T)]
    table = np.column_stack(
        [np.concatenate([c for c, _, _ in parts]), np.concatenate([f for _, f, _ in parts])]
    ).astype(float)
    rows = np.concatenate(sim.comm.allgather(np.hstack([table, np.concatenate([f for *_, f in parts])])))
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    corners, first = np.unique(rows[:, 0].astype(np.int64), return_index=True)
    sums = np.add.reduceat(rows[:, 2:], first, axis=0) if len(first) else np.empty((0, dim))
    return corners, sums


def set_velocity(
    sim: Blocks, nodes: Numbers, vx: float | None = None, vy: float | None = None, vz: float | None = None
) -> None:
    """Velocities [m/s] as they are now; not a condition."""
    if vz is not None and sim.dim == 2:
        raise CommandError("velocity in z is for three dimensions")
    values = [(c, float(finite("velocity", [v])[0])) for c, v in enumerate((vx, vy, vz)) if v is not None]
    chosen = _chosen_corners(sim, nodes)
    for c, value in values:
        for k in range(chosen.shape[1]):
            sim.v[chosen[:, k], sim.stride * k + c] = value
    repeat(sim, sim.v)
    sim.changed(stiffness=False)


def reset_velocity(sim: Blocks, nodes: Numbers = None) -> None:
    """Velocities become zero."""
    set_velocity(sim, nodes, *[0.0] * sim.dim)
    if nodes is None:
        for load in sim.surface_loads:
            load.stop()


def reset_displacement(sim: Blocks, nodes: Numbers = None) -> None:
    """Displacements are counted from here on; stresses stay."""
    chosen = _chosen_corners(sim, nodes)
    if "home" not in sim.cold:
        sim.cold["home"] = diagnostics.homes(sim)
    for k in range(chosen.shape[1]):
        at, columns = chosen[:, k], slice(sim.stride * k, sim.stride * k + sim.dim)
        sim.cold["home"][at, columns] = sim.x[at, columns]
    sim.changed(stiffness=False)


def reset_state(sim: Blocks, elements: Numbers = None) -> None:
    """Reset the yielding of elements: their state bits, and the zero of plastic strain. Stresses stay, and so does the
    plastic strain that they depend on. State variables of user laws take their initial values. If no element has a
    model with memory, the log reports that nothing was changed."""
    at = sim.numbers_of_elements(elements)
    if "plastic" in sim.cold:
        sim.before_change()
        mine = np.isin(sim.number, at)
        plastic = sim.cold["plastic"]
        for part in range(0, plastic.shape[1], sim.memory("plastic")):
            for column in (SHEAR, VOLUME, IN_SHEAR, IN_TENSION):
                plastic[mine, part + column] = 0.0
        sim.changed(stiffness=False)
    remember = [1 + k for k, law in enumerate(user_laws.of_rows(sim.element_rows)) if law.states]
    of_users = np.isin(user_laws.numbers(sim)[at], remember)
    if of_users.any():
        sim.before_change()
        user_laws.forget(sim, np.isin(sim.number, at[of_users]))
        sim.changed(stiffness=False)
    if sim.log is not None and not sim.yielding()[at].any() and not of_users.any():
        names = sorted({sim.element_rows.name(row) for row in np.unique(sim.element_row[at]).tolist() if row})
        sim.log.warn_once(
            f"reset state {names}",
            "element reset state has no effect: no element has yielded or has a user law with state variables "
            f"({', '.join(names) or 'there is no law yet'}). For joints: face-joint reset state, for creep: element "
            "reset kelvin-strain",
        )


def reset_kelvin_strain(sim: Blocks, elements: Numbers = None) -> None:
    """The Kelvin units of elements are without strain from here on. Stress and shape stay. CommandError if none of the
    elements can creep."""
    at = sim.numbers_of_elements(elements)
    if not sim.creeping()[at].any():
        raise CommandError(
            f"none of these {len(at)} elements has the model {MECH_BURGERS.name}: there is no Kelvin strain"
        )
    sim.before_change()
    if "creep" in sim.cold:
        mine, memory = np.isin(sim.number, at), sim.cold["creep"]
        for part in range(0, memory.shape[1], sim.memory("creep")):
            for column in IN_KELVIN[: len(KELVIN_STRAIN[sim.dim])]:
                memory[mine, part + column] = 0.0
    sim.changed(stiffness=False)


def reset_joint_state(sim: Blocks, joints: Numbers = None) -> None:
    """Damage of joints that hold is forgotten, and their largest opening and slip. Broken ones stay broken; those that
    slide keep what stays of their slip, path and dilation, and their stress with it."""
    at = sim.numbers_of_joints(joints)
    sim.before_change()  # those that broke just now are known from here on
    at = at[(sim.joint_row[at] > 0) & ~sim.open[at]]
    forget = np.zeros(len(sim.partner), bool)
    forget[at] = forget[sim.partner[at]] = True
    sim.histories = sim.histories.without_joints(sim.number, forget)
    sim.changed()


def _chosen_corners(sim: Blocks, nodes: Numbers) -> np.ndarray:
    """(n_own, 3 or 4) bool: corners of the owned elements at these nodes, as they are when the model is open."""
    sim.before_change()
    mesh = sim.the_mesh()
    chosen = sim.corners_of_nodes(nodes, whole=True).reshape(mesh.cells.shape)
    return chosen[sim.number, : sim.corners]


def repeat(sim: Blocks, rows: np.ndarray) -> None:
    """Put the first corners of an open model's rows a second time behind the last one."""
    if not sim.wide:
        if rows.shape[1] == 8:
            rows[:, 6:8] = rows[:, 0:2]
        return
    quad = sim.the_mesh().cells[sim.number, 3] >= 0
    rows[~quad, 6:10] = rows[~quad, 0:4]
    rows[quad, 8:12] = rows[quad, 0:4]


def _weighted(values: np.ndarray, weight: np.ndarray, at: np.ndarray, n: int) -> np.ndarray:
    """Weighted means (n, c) of values (m, c) by place `at` (m,), added in their order; zero where missing."""
    total, out = np.bincount(at, weight, minlength=n), np.zeros((n, values.shape[1]))
    np.add.at(out, at, values * weight[:, None])
    return np.divide(out, total[:, None], out=out, where=total[:, None] > 0.0)
