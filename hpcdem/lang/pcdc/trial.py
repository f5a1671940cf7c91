"""Values that no model could make right are refused when a line is read: what they go into is made, and dropped."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from hpcdem.commands.fdem import geometry, values
from hpcdem.commands.fdem.values import HOLE, LINE, OUTLINE, Piece
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc import table as t
from hpcdem.lang.pcdc.kinds import FunctionName, Pending, TableName
from hpcdem.physics.bolts import layout
from hpcdem.physics.fdem import properties
from hpcdem.physics.fdem.tables import Drawn, Over, Table
from hpcdem.physics.fields import kinds
from hpcdem.physics.flow.properties import POROUS as FLUID
from hpcdem.physics.heat.properties import FLUID_HEAT as HEAT_OF_FLUID
from hpcdem.physics.heat.properties import ISO_HEAT as HEAT
from hpcdem.physics.proppant.properties import PROPPANT as GRAINS

MODELS = {one.keyword.name: one.of for command in t.COMMANDS for one in command.models if one.of is not None}
"""Models of the language by their names in full."""
OF_FIELDS = tuple(one.model for one in kinds().values())
_COMPLETED = (
    t.BOLT.of, t.LINER.of, FLUID, GRAINS, HEAT, HEAT_OF_FLUID, *OF_FIELDS, t.COULOMB_JOINT.of, t.BARTON_BANDIS.of,
)  # fmt: skip
"""Models whose properties are checked together once all required ones are known."""
_OF_COMMAND = {
    "element property": properties.SOLID,
    "element-face property": properties.CONTACT_MOHR_COULOMB,
    "face-joint property": properties.OF_JOINTS,
}


def check(command: t.Command, arguments: Mapping[str, Any], terms: Sequence[tuple[str, Any]] | None) -> None:
    """ValueError if values of a line make no sense in any model; expressions are left to the commands, which refuse the
    same."""
    try:
        for name, value in terms or ():
            if name in ("id", "element", "x", "y", "z", "area") and known(value) and value:
                _ascending(name, value)
        if isinstance(arguments.get("law", arguments.get("function")), Pending):
            raise CommandError("the file of a law or function is plain text: it is read before the script runs")
        if "model" in arguments:
            _model(arguments["model"], arguments["properties"])
        elif command.name in _OF_COMMAND:
            given, model = _given(arguments), _OF_COMMAND[command.name]
            others = {
                properties.OF_JOINTS.name: (FLUID, HEAT_OF_FLUID, GRAINS),
                properties.SOLID.name: (HEAT, *OF_FIELDS),
            }
            for other in others.get(model.name, ()):
                _changes(other, {name: v for name, v in given.items() if other.has(name)})
                given = {name: v for name, v in given.items() if not other.has(name)}
            _changes(model, given)
        elif command.name in _TRIALS and known(list(arguments.values())):
            _TRIALS[command.name](arguments)
    except CommandError as error:
        raise ValueError(hyphened(str(error))) from None


def known(value: Any) -> bool:
    """Return whether a value is known without evaluating an expression."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        return all(known(item) for item in value)
    return not isinstance(value, Pending)


def python(name: str) -> str:
    """`poisson-ratio` as a name of Python."""
    return name.replace("-", "_")


@functools.cache
def _hyphens() -> dict[str, str]:
    """Words with hyphens by their names in Python."""
    models = [model for command in t.COMMANDS for model in command.models]
    rows: list[Any] = [*t.COMMANDS, *models]
    options = [option for row in rows for option in row.options]
    names = {row.name for row in options} | {model.keyword.name for model in models}
    return {python(name): name for name in names.union(*t.RECORDED.values()) if "-" in name}


def hyphened(text: str) -> str:
    """A message with the words of the language as they are written in it, but for what is quoted."""
    return re.sub(r"'[^']*'|\b[a-z]\w*_\w+\b", lambda found: _hyphens().get(found[0], found[0]), text)


def _given(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments that are known when the line is read, under their Python names."""
    return {
        python(name): value
        for name, value in arguments.items()
        if known(value) and not isinstance(value, (TableName, FunctionName, Over, Drawn))
    }


def _ascending(name: str, bounds: tuple[Any, ...]) -> None:
    if bounds[0] > bounds[-1]:
        raise CommandError(f"{name} {bounds[0]:g} {bounds[-1]:g}: the first is above the second")


def _model(name: str, arguments: Mapping[str, Any]) -> None:
    given = _given(arguments)
    if name in MODELS:
        _changes(MODELS[name], given)
    elif name == "mechanical-move-boundary-constraint" and "type" in given:
        kind, *rest = given["type"]
        if kind in (2, 3) and not (rest and any(rest[0])):
            raise CommandError("type 2 needs the vector along which the nodes may move, for example type 2 (1,0)")
    elif name in ("mechanical-velocity-boundary-condition", t.BOLT_VELOCITY.keyword.name):
        for axis in "xyz":
            if f"velocity-{axis}" in arguments and f"acceleration-{axis}" in arguments:
                raise CommandError(f"velocity-{axis} and acceleration-{axis} cannot be combined")
    elif name in (t.FLOW_CONDITION.keyword.name, t.PROPPANT_CONDITION.keyword.name) and len(arguments) > 1:
        raise CommandError(f"{' and '.join(arguments)} cannot be combined at a flow node")


def _changes(model: properties.Model, given: dict[str, Any]) -> None:
    """Properties of a model, some of them perhaps left out or not known yet."""
    given = {name: value for name, value in given.items() if name not in ("np", "parameter")}
    for name, value in given.items():
        model.property(name).check(value)
    solid = properties.MECH_BURGERS if "maxwell_shear" in given or model is properties.MECH_BURGERS else None
    solid = solid or properties.MECH_ISO_ELASTIC
    moduli = {name: value for name, value in given.items() if name in (*properties.MODULI, "maxwell_shear")}
    if len(moduli) > 1:
        solid.complete({"density": 1.0, **moduli})
    if model is properties.MECH_MOHR_COULOMB and {"friction", "dilation"} <= given.keys():
        rock = {"density": 1.0, "young": 1.0, "poisson_ratio": 0.0, "cohesion": 0.0, "tensile": 0.0}
        model.complete({**rock, "friction": given["friction"], "dilation": given["dilation"]})
    required = {p.name for p in model.properties if p.default is None and not p.optional}
    if model in _COMPLETED and required <= given.keys():
        model.complete(given)
    if model in (properties.COHESIVE, properties.OF_JOINTS):
        for strength, energy in (("tensile_strength", "gf1"), ("cohesion", "gf2")):
            pair = {name: given.get(name, 0.0) for name in (strength, energy)}
            if strength in given and energy in given:
                others = {"tensile_strength": 0.0, "cohesion": 0.0, "gf1": 0.0, "gf2": 0.0, "penalty_normal": 1.0}
                properties.COHESIVE.complete({**others, **pair})


# ---- commands that make something of their values alone --------------------------------------------------------------


def shape(command: str, arguments: Mapping[str, Any]) -> tuple[Any, ...]:
    """Kind and values of the shape of `geometry create ...`, see `geometry.shape`."""
    kind = command.rpartition(" ")[2]
    if kind == "circle":
        return _circle(arguments)
    return kind, *(value for name, value in arguments.items() if name != "as-layer")


def _shape(kind: str, arguments: Mapping[str, Any]) -> None:
    geometry.shape(*shape(kind, arguments))


def _circle(arguments: Mapping[str, Any]) -> tuple[Any, ...]:
    centre, radius = arguments.get("centre", arguments.get("center")), arguments.get("radius")
    if centre is None or radius is None or {"centre", "center"} <= arguments.keys():
        raise CommandError("a circle needs a centre and a radius, each once")
    if len(centre) == 3:
        return "disc", centre, arguments.get("normal", (0.0, 0.0, 1.0)), radius
    if "segment-length" in arguments:
        return "segmented-circle", centre, radius, arguments["segment-length"]
    return "circle", centre, radius


def _brick(arguments: Mapping[str, Any]) -> None:
    ends = [arguments[name] for name in ("p1", "p2", "p3") if name in arguments]
    values.brick(arguments["p0"], ends, (1,) * len(ends), (1.0,) * len(ends))


_ROLES = {
    "boundary-close-polyline": OUTLINE, "constrain-polyline": LINE, "constrain-point": LINE, "boundary": OUTLINE,
    "inner-boundary": LINE, "layer": LINE, "circle": LINE, "arc": LINE, "radius": OUTLINE, "inner-radius": HOLE,
}  # fmt: skip


def pieces(arguments: Mapping[str, Any]) -> list[Piece]:
    """The pieces of a mesh that the words of `element create` name, in their order."""
    found = [
        _piece(word, one, arguments)
        for word, given in arguments.items()
        if word in _ROLES
        for one in (given if isinstance(given, list) else [given])
    ]
    if "radius" in arguments and not arguments["inner-radius"]["value"] < arguments["radius"]["value"]:
        raise CommandError("inner-radius is below radius: the ring lies between them")
    if not any(piece.role == OUTLINE for piece in found):
        first = next((k for k, piece in enumerate(found) if piece.what != "arc"), 0)
        found[first] = replace(found[first], role=OUTLINE)
    if all(piece.size is None for piece in found) and "global-mesh-size" not in arguments:
        raise CommandError("mesh-size is missing: give it for at least one piece")
    return found


def _piece(word: str, one: Mapping[str, Any], arguments: Mapping[str, Any]) -> Piece:
    """Make one piece. arguments: of the whole command."""
    role = OUTLINE if one.get("is-boundary") else _ROLES[word]
    if word == "inner-boundary" and not one.get("filled", False):
        role = HOLE
    layers = one["value"] if word == "layer" else one.get("layer", [])
    shape = _shape_of(word, one, arguments)
    if not shape and not layers:
        raise CommandError(f"{word} needs array, points, or layer, names of layers")
    return Piece(role, word, layers, shape, one.get("mesh-size"))


def _shape_of(word: str, one: Mapping[str, Any], arguments: Mapping[str, Any]) -> tuple[Any, ...]:
    """The shape that a piece is itself; none if it names layers."""
    match word:
        case "circle":
            return "circle", one["center"], one["radius"]
        case "arc":
            return "arc-between", one["center"], one["start-point"], one["end-point"]
        case "radius" | "inner-radius":
            return "circle", arguments["center"], one["value"]
        case "boundary" | "inner-boundary":
            return "polygon", one["value"]
    if "array" not in one:
        return ()
    return {"constrain-point": "point", "constrain-polyline": "polyline"}.get(word, "polygon"), one["array"]


def _pieces(arguments: Mapping[str, Any]) -> None:
    for piece in pieces(arguments):
        if piece.shape:
            geometry.shape(*piece.shape)


def _bolt(arguments: Mapping[str, Any]) -> None:
    points = arguments["points"]
    line = layout.checked(points, len(points[0]) if points else 2)
    for span in layout.lengths(line[1:] - line[:-1]).tolist():
        layout.parts(span, arguments.get("segments"), arguments.get("length"))


def _bar(arguments: Mapping[str, Any]) -> None:
    line = layout.checked([arguments["first"], arguments["second"]], len(arguments["first"]))
    layout.parts(float(layout.lengths(line[1:] - line[:-1])[0]), None, arguments.get("mesh-size"))


def _fractures(arguments: Mapping[str, Any]) -> None:
    if "radius" in arguments:
        values.disc_set(**disc_words(arguments)).check("fractures")
        return
    values.fracture_set(**fracture_words(arguments)).check("fractures")


def disc_words(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The statistics of `geometry create fractures` in three dimensions, as `values.disc_set` takes them."""
    orientation = arguments["orientation"]
    return {
        **_statistics(arguments, "radius", "p10", "p30", "p32"),
        "orientation": (*orientation["value"], orientation.get("towards", 0.0), orientation.get("spread", 0.0)),
        "along": arguments.get("scan-direction", (0.0, 0.0, 1.0)),
    }


def fracture_words(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The statistics of `geometry create fractures` as `values.fracture_set` takes them."""
    orientation = arguments["orientation"]
    return {
        **_statistics(arguments, "length", "p10", "p20", "p21"),
        "orientation": (*orientation["value"], orientation.get("spread", 0.0)),
        "scanline": arguments.get("scan-line", 0.0),
        "ends_at": arguments.get("ends-at", 0.0),
    }


def _statistics(arguments: Mapping[str, Any], size: str, *densities: str) -> dict[str, Any]:
    """Density and size, under the word for it, of fractures of any dimension."""
    given = [name for name in densities if name in arguments]
    if len(given) != 1:
        raise CommandError(f"fractures need one density: {', '.join(densities[:-1])} or {densities[-1]}")
    if size not in arguments:  # it was not known yet how many dimensions there are
        raise CommandError(f"fractures in {'three' if size == 'radius' else 'two'} dimensions need a {size}")
    of = arguments[size]
    return {
        size: (*of["value"], of.get("spread", 0.0), of.get("least", 0.0), of.get("greatest")),
        "density": (given[0], arguments[given[0]]),
        "reached": arguments.get("reached", False),
    }


_TRIALS: dict[str, Callable[[Mapping[str, Any]], object]] = {
    **{f"geometry create {name}": functools.partial(_shape, name) for name in
       ("polyline", "polygon", "rectangle", "circle", "arc", "point", "box", "sphere", "cylinder", "cone", "disc",
        "plane")},
    "geometry create fractures": _fractures,
    "geometry export": lambda given: values.result_name(given["file"]),
    "bolt create polyline": _bolt,
    "bolt-element create": _bar,
    "mesh structured": lambda given: values.grid_lines(
        given["first"], given["second"], given["cells"], given.get("ratio", (1.0,) * len(given["first"]))
    ),
    "element create brick": _brick,
    **{f"element create {name}": _pieces for name in
       ("geometry", "geometry-patch", "geometry-boundary", "hollow-circle")},
    "mesh equilateral": lambda given: values.grid_lines(given["first"], given["second"], (1, 1), (1.0, 1.0)),
    "table create": lambda given: Table.of(given["values"], given["name"]),
    "history create": lambda given: values.history_name(given["name"]),
    "history export": lambda given: values.result_name(given["file"]),
    "chart export": lambda given: values.figure_name(given["file"]),
    "output vtk": lambda given: values.frames_name(given["file"]),
}  # fmt: skip
