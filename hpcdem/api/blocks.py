"""Blocks in a Python program: the commands of the PCDC language as methods, what is there as arrays.

A method has the words of the command: `Row` says which one it is, and the order of its arguments. Their names, kinds,
units and texts are those of the table of the language. Editors see them in blocks.pyi, which is made from this file:
``scripts/pages``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from hpcdem.api.methods import Models, Row, commands, refer
from hpcdem.api.objects import (
    Clocks,
    Conditioned,
    Fluxed,
    GroupedElsewhere,
    Moved,
    Named,
    Objects,
    Orders,
    Random,
    Recorded,
    Stressed,
    Tabled,
    Words,
)
from hpcdem.core.deprecated import renamed
from hpcdem.physics.fdem import groups as g

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project

PROPERTIES = "Change properties of the model; the others stay."
REPORT = "Report their number by model and group in the log."
GROUP = "Assign them to a group; each is in at most one group of a set."


@commands
class Geometry(Words):
    """Shapes in layers, of which meshes are made; lengths in metres, angles in degrees counter-clockwise."""

    _word = "geometry"

    polyline = Row("geometry create polyline", "points as_layer")
    polygon = Row("geometry create polygon", "points as_layer")
    rectangle = Row("geometry create rectangle", "first second as_layer")
    circle = Row("geometry create circle", "centre radius as_layer", without="center")
    arc = Row("geometry create arc", "centre radius begin end as_layer")
    point = Row("geometry create point", "points as_layer")
    box = Row("geometry create box", "first second as_layer")
    sphere = Row("geometry create sphere", "centre radius as_layer")
    cylinder = Row("geometry create cylinder", "first second radius as_layer")
    cone = Row("geometry create cone", "first second radius other as_layer")
    disc = Row("geometry create disc", "centre normal radius as_layer")
    plane = Row("geometry create plane", "point normal as_layer")
    extrude = Row("geometry create extrude", "layer along as_layer")
    revolve = Row("geometry create revolve", "layer axis as_layer about? angle?")
    fractures = Row(
        "geometry create fractures",
        "as_layer inside",
        names={
            "orientation.spread": "orientation_spread", "orientation.towards": "orientation_towards",
            **{f"{law}.{word}": f"{law}_{word}" for law in ("length", "radius")
               for word in ("spread", "least", "greatest")},
        },
    )  # fmt: skip
    import_file = Row("geometry import", "file as_layer dxf_layer? scale?")
    transform = Row("geometry transform", "layer")
    scale = Row("geometry scale", "factors layer?")
    translate = Row("geometry translate", "vector layer?", earlier={"way": "vector"})
    export = Row("geometry export", "layers file")
    delete = Row("geometry delete", "*layers", doc="Delete layers; meshes created from them keep their edges.")


@commands
class Mesh(Words):
    """Meshes: each call adds a body to the model. Its elements belong to a group of a set."""

    _word = "mesh"

    create = Row("mesh create", "from_layer size type?")
    structured = Row("mesh structured", "first second cells type? diagonal?")
    brick = Row("element create brick", "p0 p1 p2 p3?")
    geometry = Row("element create geometry")
    patch = Row(
        "element create geometry-patch",
        "boundary",
        names={"boundary-close-polyline": "boundary", "constrain-polyline": "polyline", "constrain-point": "point"},
        types=dict.fromkeys(("boundary", "polyline", "point"), "Iterable[Piece]"),
    )
    boundary = Row("element create geometry-boundary", "boundary mesh_size?", names={"inner-boundary": "inner"})
    hollow_circle = Row(
        "element create hollow-circle",
        "center radius inner_radius mesh_size? inner_mesh_size?",
        names={"inner-radius.mesh-size": "inner_mesh_size"},
    )
    equilateral = Row("mesh equilateral", "first second size")
    import_file = Row("mesh import", "file")
    intersect = Row("mesh intersect", "layer follow?")
    glue = Row("mesh glue", "tolerance? between?", where=g.ELEMENT)
    densify = Row("element densify", "maximum_length pattern?", where=g.ELEMENT)
    delete = Row("element delete", where=g.ELEMENT)
    add_nodes = Row("model add node", "points")
    add_element = Row("model add element", "*corners")
    scale = Row("model scale", "factors")
    translate = Row("model translate", "vector", earlier={"way": "vector"})
    quadratic = Row("mesh quadratic")
    quality = Row("mesh quality", doc="Report the quality of the mesh in the log: angles, sizes.")


@commands
class Elements(Stressed):
    """Elements: `sim.elements["stress-xx"]`, see `Objects`."""

    _word, kind = "elements", g.ELEMENT

    group = Row("element group", "group set?", doc=GROUP)
    model = Models(
        "element c-model",
        "Assign a constitutive model and its properties, listed here by model (explained in docs/pcdc_reference.md). "
        'Fluid models apply to the joints around the elements. For a user law: "user", law="file.py:law", '
        'parameter=[("limit", 2e5)], see docs/user_laws.md.',
    )
    property = Row("element property", doc=PROPERTIES, loose=True)
    report = Row("element list summary", doc=REPORT)
    law = Row("element law", "law", doc="Read, check and compile a law of a Python file before `sim.restore`.")
    null = Row("element c-model", model="null")
    hide = Row("element hide", "hidden=True")
    collision = Row("element collision", "on")
    water = Row("element water", "surface density")
    reset_state = Row("element reset state")
    reset_kelvin_strain = Row("element reset kelvin-strain")


@commands
class Faces(Fluxed):
    """Faces of elements: contact, and stress on surfaces; see `Objects`."""

    _word, kind = "faces", g.FACE

    group = Row("element-face group", "group set?", doc=GROUP)
    model = Models("element-face c-model", "Assign the contact model and its properties.")
    property = Row("element-face property", doc=PROPERTIES, loose=True)
    report = Row("element-face list summary", doc=REPORT)
    stress = Row("element-face boundary", model="mechanical-stress-boundary-condition")
    heat = Row("element-face boundary", model="thermal-const-heat")
    free_field = Row("element-face boundary", model="free-field")


@commands
class Joints(Objects):
    """Joints between elements; see `Objects`."""

    _word, kind = "joints", g.JOINT

    group = Row("face-joint group", "group set?", doc=GROUP)
    model = Models("face-joint c-model", "Assign a model of joints, or of the fluid in them, and its properties.")
    property = Row("face-joint property", doc=PROPERTIES, loose=True)
    report = Row("face-joint list summary", doc=REPORT)
    reset_state = Row("face-joint reset state")


@commands
class Nodes(Moved):
    """Nodes; see `Objects`. Conditions are numbers or names of tables of time."""

    _word, kind = "nodes", g.NODE

    group = Row("node group", "group set?", doc=GROUP)
    velocity = Row("node boundary", model="mechanical-velocity-boundary-condition")
    force = Row("node boundary", model="mechanical-force-boundary-condition")
    damp = Row("node mechanical-damp", "local")
    fluid = Row("node boundary", model="hydraulic-constant-flow-boundary")
    proppant = Row("node boundary", model="hydraulic-proppant-boundary")
    temperature = Row("node boundary", "temperature", model="thermal-solid-boundary-condition")
    fluid_temperature = Row("node boundary", "temperature", model="thermal-flow-boundary-condition")
    initial_velocity = Row(
        "node initial",
        "velocity?",
        only="velocity velocity-x velocity-y velocity-z",
        doc="Set the present velocity of nodes, or some components of it.",
    )
    initial_temperature = Row(
        "node initial", "temperature", only="temperature", doc="Set the present temperature of nodes."
    )
    reset_velocity = Row("node reset velocity")
    reset_displacement = Row("node reset displacement")


@commands
class Bolts(Objects):
    """Rock bolts: `sim.bolts["axial-force"]` returns that of their elements, see `Objects`."""

    _word, kind = "bolts", g.BOLT_ELEMENT

    group = Row("bolt-element group", "group set?", doc=GROUP)
    create = Row("bolt create polyline", "points")
    between = Row("bolt-element create", "first second mesh_size?", where=g.ELEMENT)
    model = Models("bolt c-model", "Assign properties to elements of bolts, from now on; values are those of one bolt.")
    delete = Row("bolt delete")


@commands
class BoltNodes(Conditioned):
    """Nodes of rock bolts: `sim.bolt_nodes["slip"]`, see `Objects`."""

    _word, kind = "bolt_nodes", g.BOLT_NODE

    group = Row("bolt-node group", "group set?", doc=GROUP)
    velocity = Row("bolt-node boundary", model="bolt-node-constrain")
    force = Row("bolt-node boundary", model="bolt-node-force-boundary-condition")


@commands
class FlowNodes(GroupedElsewhere):
    """Nodes at the ends of channels, with numbers and groups of nodes: `sim.flow_nodes["pressure"]`, see `Objects`."""

    _word, kind, grouped = "flow_nodes", g.FLOW_NODE, "nodes"

    initial = Row("flow-node initial", where=g.NODE)
    initial_temperature = Row(
        "node hydraulic-initialize",
        "temperature",
        where=g.NODE,
        only="flow-node-temperature",
        names={"flow-node-temperature": "temperature"},
        doc="Set the present temperature of the fluid at them.",
    )


@commands
class Channels(GroupedElsewhere):
    """Joints with a hydraulic model, with numbers and groups of joints: `sim.channels["aperture"]`, see `Objects`."""

    _word, kind, grouped = "channels", g.CHANNEL, "joints"


@commands
class Wells(Named):
    """Wells: `sim.wells["injection"]` returns the present pressure [Pa], rate [m2/s], injected [m2] and stage
    of one.
    """

    create = Row("well create", "name", where=g.NODE)
    stage = Row("well stage", "name")


@commands
class Liners(Objects):
    """Liners: `sim.liners["axial-force"]` returns that of their elements, see `Objects`."""

    _word, kind = "liners", g.LINER_ELEMENT

    group = Row("liner-element group", "group set?", doc=GROUP)
    create = Row("liner create", where=g.FACE)
    model = Models("liner c-model", "Assign properties to elements of liners, from now on.")
    delete = Row("liner delete")


@commands
class LinerNodes(Objects):
    """Nodes of liners: `sim.liner_nodes["rotation"]`, see `Objects`."""

    _word, kind = "liner_nodes", g.LINER_NODE

    group = Row("liner-node group", "group set?", doc=GROUP)
    velocity = Row("liner-node boundary", model="liner-node-constrain")
    force = Row("liner-node boundary", model="liner-node-force-boundary-condition")
    remove_boundary = Row("liner-node boundary remove", doc="Remove prescribed conditions.")


@commands
class Tables(Tabled):
    """Functions of time for conditions, or of a coordinate for properties; piecewise linear."""

    delete = Row("table delete", "name")


@commands
class Fields(Random):
    """Random fields: properties that differ from object to object."""

    create = Row("field create", "name")
    delete = Row("field delete", "name")


@commands
class Histories(Recorded):
    """Quantities recorded during the run: `sim.histories["load"]` is (n, 3): step, time [s] and value so far."""

    delete = Row("history delete", "name")
    export = Row("history export", "file names?")


@commands
class Charts(Words):
    """Diagrams of histories or points."""

    _word = "charts"

    create = Row("chart create", "name")
    add = Row("chart add", "name", where=g.JOINT)
    export = Row("chart export", "name file cracks? plastic? fluid? temperature?")


@commands
class Output(Words):
    """Frames for ParaView."""

    _word = "output"

    vtk = Row("output vtk", "file every?")
    image = Row("output image", "file", where=lambda given: g.SHOWN.get(given.get("object") or "", g.ELEMENT))


@commands
class BlockCommands(Clocks):
    """The methods of a `Simulation` for blocks. The model of blocks is made on first use."""

    geometry: Geometry
    mesh: Mesh
    elements: Elements
    faces: Faces
    joints: Joints
    nodes: Nodes
    bolts: Bolts
    bolt_nodes: BoltNodes
    flow_nodes: FlowNodes
    channels: Channels
    wells: Wells
    liners: Liners
    liner_nodes: LinerNodes
    tables: Tables
    fields: Fields
    histories: Histories
    charts: Charts
    output: Output

    def _begin_blocks(self, project: Callable[[], Project], before: Callable[[], None] = lambda: None) -> None:
        self._do = Orders(project, before)
        for kind in GROUPS:
            setattr(self, kind._word, kind(self._do))

    gravity = Row(
        "model gravity", "gravity", doc="Set gravity of the blocks from now on; for particles use ``set(gravity=...)``."
    )
    units = Row(
        "model units",
        "system",
        doc="Declare the units of following values of blocks: unlikely values give a warning, histories and charts "
        "show the units; no value changes. For particles use ``set(units=...)``.",
    )
    option = Row("model option", without="creep ecda", doc="Set switches of the calculation of blocks.")
    time_step = Row("model time-step")
    sub_step = Row("model sub-step")
    field_clock = Row("model field", "field")
    run_time = Row("model run-time", "time")
    solve_check = Row("model solve-check", "steps")
    rayleigh = Row("model rayleigh", "ratio")
    creep = Row("model creep", "on=True")
    plane_stress = Row("model plane-stress")
    plane_strain = Row("model plane-strain")
    report_devices = Row("device list")
    step = Row(
        "model step",
        "n",
        names={"steps": "n"},
        doc="Execute a number of steps of the blocks and of the particles coupled to them.",
    )
    solve = Row("model solve")


GROUPS: tuple[type[Words], ...] = (
    Geometry, Mesh, Elements, Faces, Joints, Nodes, Bolts, BoltNodes, FlowNodes, Channels, Wells, Liners, LinerNodes,
    Tables, Fields, Histories, Charts, Output,
)  # fmt: skip
"""Classes whose instances are attributes of a simulation, with the commands of blocks; the attribute is named
`_word`."""
refer((BlockCommands, *GROUPS))


def _keep_earlier_names() -> None:
    for of, old, new in (
        (Elements, "tell", "report"), (Faces, "tell", "report"), (Joints, "tell", "report"),
        (BlockCommands, "tell_devices", "report_devices"), (BlockCommands, "tell_time", "report_time"),
    ):  # fmt: skip
        setattr(of, old, renamed(old, new, of))


_keep_earlier_names()
