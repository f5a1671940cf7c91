"""Groups, models, conditions and initial states of elements, nodes, faces and joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hpcdem.commands.fdem.choices import chosen, everything
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import quoted
from hpcdem.numerics.random_field import RandomField
from hpcdem.physics.fdem import changes, node_conditions, sides, user_functions, user_laws
from hpcdem.physics.fdem.free_field import FreeField
from hpcdem.physics.fdem.groups import DEFAULT, ELEMENT, FACE, JOINT, NODE, Around, Groups, OnBoundary, Range
from hpcdem.physics.fdem.properties import COHESIVE
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.fdem.user_laws import UserLaw
from hpcdem.physics.fdem.water import Water
from hpcdem.pre.mesh import geometry, solids

ARC_STEPS = 360
"""Number of sides that replace an arc of a water line."""
Number = float | str
"""A number, or the name of a table of time."""


def group(project: Project, kind: str, group: str, set_name: str = DEFAULT, where: Range | None = None) -> None:
    """Add objects of a kind (model.blocks.groups) to a group, including removed elements, which may be reinstated. Each
    object leaves its previous group of the set.
    """
    found = everything(project, kind, where, null_too=True)
    project.groups[kind] = project.comm.per_node(lambda: _grouped(project, kind, group, set_name, found))


def _grouped(project: Project, kind: str, name: str, set_name: str, found: np.ndarray) -> Groups:
    groups = project.groups[kind]
    known = groups.sets.get(set_name, {})
    if kind == NODE and any(map(sides.are_there, (found, *known.values()))):  # sides of a point that others have
        mesh = project.whole_mesh()
        every = np.ones(len(mesh.cells), bool)
        new = sides.corners(mesh.cells, found, len(mesh.points))
        for other, members in known.items():
            old = sides.corners(mesh.cells, members, len(mesh.points))
            known[other] = sides.numbers(mesh.cells, old | new if other == name else old & ~new, every)
        found = known.get(name, found)
    groups.assign(found, name, set_name)
    return groups


def element_model(project: Project, name: str, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Assign a constitutive model with its properties (model.blocks.properties) to elements. Removed elements in the
    range are reinstated free of stress at their present position; without a range they stay removed.
    """
    blocks = project.ready()
    elements = chosen(project, ELEMENT, where, null_too=True)
    if elements is not None and "heat" in blocks.surface_loads and not blocks.alive[elements].all():
        raise CommandError("removed elements cannot be reinstated in a model with heat")
    changes.element_model(blocks, elements, name, properties)
    if elements is not None:
        project.alive[elements] = True


def around(project: Project, where: Range | None) -> Range | None:
    """Return a range of the joints next to the selected elements; None: all."""
    return None if where is None else (Around(tuple(everything(project, ELEMENT, where).tolist())),)


def load_law(project: Project, law: str) -> UserLaw:
    """Read, check and compile a user law 'file.py:function'. Collective."""
    return user_laws.load(project.blocks, project.to_read(law.rpartition(":")[0]), law)


def load_function(project: Project, function: str) -> str:
    """Read, check and compile a user function 'file.py:function' of position and time. Return its name, which
    conditions accept as a value. Collective.
    """
    return user_functions.load(project.blocks, project.to_read(function.rpartition(":")[0]), function)


def user_model(project: Project, law: str, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Assign a user law with its properties to elements. Collective."""
    project.ready()
    element_model(project, load_law(project, law).name, properties, where)


def null(project: Project, relax: float = 0.0, where: Range | None = None) -> None:
    """Remove elements. relax: time [s], or steps of a static run, over which their forces on the remaining elements
    decay to zero.
    """
    blocks = project.ready()
    elements = everything(project, ELEMENT, where)
    left = project.alive.copy()
    left[elements] = False
    if not left.any():
        raise CommandError("this would remove all elements")
    changes.null(blocks, elements, relax)
    project.alive = left


def element_property(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Change properties of elements."""
    project.ready().element_property(chosen(project, ELEMENT, where), properties)


def face_model(project: Project, name: str, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Assign a contact model to faces. Default of penalty_normal: 10 E of the element."""
    blocks = project.ready()
    faces = chosen(project, FACE, where)
    if "penalty_normal" not in properties:
        faces = everything(project, FACE, where)
        properties = {**properties, "penalty_normal": project.comm.per_node(
            lambda: _usual_penalty(project, faces, faces[:, None])
        )}  # fmt: skip
    blocks.face_model(faces, name, properties)


def face_property(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Change properties of contact models."""
    project.ready().face_property(chosen(project, FACE, where), properties)


def joint_property(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Change properties of joint models."""
    project.ready().joint_property(chosen(project, JOINT, where), properties)


def joint_model(project: Project, name: str, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Assign a model to joints. Default of penalty_normal of a cohesive model: 10 E of the softer of the two
    elements.
    """
    blocks = project.ready()
    joints = chosen(project, JOINT, where)
    if "penalty_normal" not in properties and name == COHESIVE.name:
        joints = everything(project, JOINT, where)
        properties = {**properties, "penalty_normal": project.comm.per_node(
            lambda: _usual_penalty(project, joints, np.column_stack([joints, blocks.partner[joints]]))
        )}  # fmt: skip
    blocks.joint_model(joints, name, properties)


def _usual_penalty(project: Project, numbers: np.ndarray, faces: np.ndarray) -> Value:
    """10 E of the softest element beside each object (n,), or one number if it is the same for all; faces (n, k):
    theirs. For elements that have no model yet CommandError."""
    blocks = project.blocks
    young = blocks.element_rows.column("young")[blocks.element_row[faces // 4]].min(axis=1)
    if (young <= 0.0).any():
        lost = int(numbers[young <= 0.0][0])
        raise CommandError(
            f"penalty-normal defaults to 10 E, but an element next to {lost} has no model yet: assign element c-model "
            "first"
        )
    return 10.0 * float(young[0]) if (young == young[0]).all() else 10.0 * young


def initial_stress(
    project: Project,
    stress: Mapping[str, float],
    gradient: Mapping[str, tuple[float, ...]] | None = None,
    where: Range | None = None,
) -> None:
    """Set the initial stress [Pa] by component xx, yy, xy, zz, in space xz and yz too. gradient: by component, per
    metre [Pa/m]. In the plane, zz defaults to the value of plane strain.
    """
    project.ready().initial_stress(chosen(project, ELEMENT, where), **stress, gradient=gradient or None)


def initial_velocity(project: Project, velocity: tuple[float | None, ...], where: Range | None = None) -> None:
    """Set the present velocity of nodes (2,), in space (3,), [m/s]; None keeps a component."""
    if len(velocity) != project.dim:
        raise CommandError(f"velocity: a vector of {project.dim} numbers is needed, got {len(velocity)}")
    changes.set_velocity(project.ready(), chosen(project, NODE, where), *velocity)


# ---- conditions ----------------------------------------------------------------------------------------------------


def velocity(
    project: Project,
    vx: Number | None = None,
    vy: Number | None = None,
    ax: Number | None = None,
    ay: Number | None = None,
    where: Range | None = None,
    vz: Number | None = None,
    az: Number | None = None,
) -> None:
    """Prescribe velocity [m/s] or acceleration [m/s2] of nodes; a string is the name of a table of time."""
    _known(project, vx, vy, ax, ay, vz, az)
    blocks, given = project.ready(), {"vx": vx, "vy": vy, "ax": ax, "ay": ay, "vz": vz, "az": az}
    nodes = chosen(project, NODE, where)
    blocks.velocity_condition(nodes, *from_now(project, blocks.time_now(), given).values())


def force(
    project: Project,
    fx: Number | None = None,
    fy: Number | None = None,
    where: Range | None = None,
    fz: Number | None = None,
) -> None:
    """Prescribe a force on each node [N per m of thickness, in space N]."""
    _known(project, fx, fy, fz)
    blocks, nodes = project.ready(), chosen(project, NODE, where)
    blocks.force_condition(nodes, *from_now(project, blocks.time_now(), {"fx": fx, "fy": fy, "fz": fz}).values())


def damp(project: Project, local: float, where: Range | None = None) -> None:
    """Set local damping of nodes, 0 to 1, in place of that of the model."""
    blocks = project.ready()
    if local > 0.0 and blocks.budget is not None:
        raise CommandError("the energy budget does not support local damping of nodes: use model option energy off")
    blocks.damp_nodes(chosen(project, NODE, where), local)


def move(project: Project, type: Sequence[Any], where: Range | None = None) -> None:
    """Constrain nodes: 0 free, 1 fixed, 2 free only along the direction that follows the number, 3 (in space) free only
    across it.
    """
    kind, direction = type if len(type) == 2 else (type[0], (0.0,) * project.dim)
    if kind not in (0, 1, 2) and (kind != 3 or project.dim == 2):
        raise CommandError(
            f"type {kind} is unknown: expected 0 free, 1 fixed, 2 along a vector"
            + " (3 is for three dimensions)" * (kind == 3)
        )
    if kind in (2, 3) and not any(direction):
        raise CommandError("type 2 needs the vector along which the nodes may move, for example type 2 (1,0)")
    project.ready().move_constraint(chosen(project, NODE, where), kind, direction)


def stress(
    project: Project,
    xx: Number | None = None,
    yy: Number | None = None,
    normal: Number | None = None,
    quiet: bool | None = None,
    incoming_x: Number | None = None,
    incoming_y: Number | None = None,
    where: Range | None = None,
    zz: Number | None = None,
    incoming_z: Number | None = None,
    dip: Number | None = None,
    xy: Number | None = None,
    xz: Number | None = None,
    yz: Number | None = None,
) -> None:
    """Prescribe the traction of faces [Pa]; dip: component along them. quiet: absorb outgoing waves; incoming_x, _y,
    _z: velocity of an incoming wave [m/s]. Without a range: all faces on the surface of the model.
    """
    given = {
        "xx": xx, "yy": yy, "zz": zz, "xy": xy, "xz": xz, "yz": yz, "normal": normal, "incoming_x": incoming_x,
        "incoming_y": incoming_y, "incoming_z": incoming_z, "dip": dip,
    }  # fmt: skip
    _known(project, *given.values())
    faces = chosen(project, FACE, (OnBoundary(),) if where is None else where)
    blocks = project.ready()
    blocks.stress_condition(faces, quiet=quiet, **from_now(project, blocks.time_now(), given))


def water(project: Project, surface: str, density: float, where: Range | None = None) -> None:
    """Apply water pressure to faces of elements below the water lines (in space planes and polygons) of a layer.
    density: of the water [kg/m3]; 0 removes it.
    """
    levels = [_level(one, surface) for one in project.layers[surface]]
    blocks = project.ready()
    faces = Water.create(blocks, chosen(project, ELEMENT, where), levels, density)
    if project.log is not None:
        project.log.info(f"element water: {faces} faces lie below '{surface}'; water pressure loads the free ones")


def _level(shape: Any, layer: str) -> tuple[tuple[float, ...], ...]:
    """A water line, see physics/fdem/water.py."""
    if isinstance(shape, (solids.Polygon, solids.Plane)):
        at, normal = (vector.tolist() for vector in shape.plane())
        if not abs(normal[2]) > 1e-6 * float(np.hypot(*normal[:2])):
            raise CommandError(f"layer '{layer}': a vertical water surface has no height")
        corners = () if isinstance(shape, solids.Plane) else tuple((x, y) for x, y, _ in shape.corners)
        return (tuple(at), tuple(normal), *corners)
    if not isinstance(shape, geometry.Curve):
        raise CommandError(f"layer '{layer}': a water surface consists of planes and polygons")
    points = shape.points if not shape.bulges.any() else geometry.sampled(shape, shape.length() / ARC_STEPS)
    points = points if points[0, 0] < points[-1, 0] else points[::-1]
    if len(points) < 2 or shape.closed or not (np.diff(points[:, 0]) > 0.0).all():
        raise CommandError(f"layer '{layer}': a water line must run from left to right, with one height at each x")
    return tuple(map(tuple, points.tolist()))


def free_field(project: Project, where: Range | None = None) -> None:
    """Make faces free-field boundaries (in the plane), see free_field.py. Without a range: all faces on the surface of
    the model.
    """
    project.ready().refuse_in_space("free-field")
    FreeField.create(project.ready(), chosen(project, FACE, (OnBoundary(),) if where is None else where))


def remove_node_conditions(
    project: Project, where: Range | None = None, kinds: Sequence[str] = node_conditions.KINDS
) -> None:
    """Remove conditions of these kinds from nodes."""
    project.ready().remove_conditions(chosen(project, NODE, where), kinds)


def remove_face_conditions(project: Project, where: Range | None = None) -> None:
    """Remove tractions and free-field boundaries from faces."""
    faces = chosen(project, FACE, where)
    FreeField.remove(project.ready(), faces)
    project.ready().remove_stress_conditions(faces)


def _known(project: Project, *values: Number | None) -> None:
    for value in values:
        if isinstance(value, str) and value not in project.blocks.tables and value not in user_functions.FUNCTIONS:
            raise CommandError(f"there is no table '{value}'; available: {quoted(project.blocks.tables)}")


# ---- tables --------------------------------------------------------------------------------------------------------


def table(
    project: Project, name: str, values: list[tuple[float, float]] | None = None, relative: bool | None = None
) -> None:
    """Create or change a piecewise linear function of time. relative: its times count from the moment at which a
    condition begins to use it. Omitted arguments keep their values.
    """
    if values is not None:
        project.blocks.table(name, values)
    elif name not in project.blocks.tables:
        raise CommandError(f"no table '{name}' yet: create it with data")
    if relative is not None:
        (project.relative.add if relative else project.relative.discard)(name)


def from_now(project: Project, now: float, given: Mapping[str, Any]) -> dict[str, Any]:
    """Replace relative tables of conditions by tables that begin at this time [s]."""
    return {name: _begun(project, now, value) for name, value in given.items()}


def _begun(project: Project, now: float, value: Any) -> Any:
    if not isinstance(value, str) or value not in project.relative or value not in project.blocks.tables:
        return value
    name, of = f"{value} from {now!r}", project.blocks.tables[value]
    pairs = [(time + now, one) for time, one in zip(of.times.tolist(), of.values.tolist())]
    if name not in project.blocks.tables or project.blocks.tables[name].pairs() != [list(pair) for pair in pairs]:
        project.blocks.table(name, pairs)
    return name


def random_field(project: Project, name: str, **about: Any) -> None:
    """Create a random field, see physics.random_field.RandomField."""
    project.blocks.random_field(name, RandomField.of(**about))


def remove_field(project: Project, name: str) -> None:
    """Remove a random field; properties drawn from it keep their values."""
    project.blocks.remove_field(name)


def remove_table(project: Project, name: str) -> None:
    """Remove a table."""
    if name not in project.blocks.tables:
        _known(project, name)
    if name == project.step_table:
        raise CommandError(f"the time step uses table '{name}': release it with model time-step value 0")
    project.blocks.remove_table(name)
    project.relative.discard(name)
