"""Which function carries out a command: one binding per row of the table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from hpcdem.commands import fdem, units
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc import trial
from hpcdem.lang.pcdc.kinds import FunctionName, TableName
from hpcdem.lang.pcdc.table import (
    ABSORB,
    BOLT_FORCE,
    BOLT_VELOCITY,
    CONST_HEAT,
    FIELD_MODELS,
    FIELDS_AT_FACES,
    FIELDS_AT_NODES,
    FLOW_CONDITION,
    FLUID_HEAT,
    FLUID_TEMPERATURE,
    FORCE,
    ISO_HEAT,
    MOVE,
    POROUS,
    PROPPANT,
    PROPPANT_CONDITION,
    STRESS,
    TEMPERATURE,
    VELOCITY,
    Command,
    Model,
)
from hpcdem.lang.pcdc.trial import python
from hpcdem.physics.fdem import groups as g

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project

Terms = tuple[tuple[str, Any], ...]
DEFAULT_LAYER = "default"
"""Of shapes that name none."""
LAST = 2**53
"""Beyond all numbers of objects."""


class Call:
    """A command on its way to its function: arguments with all expressions evaluated, by name; where: its range;
    restore_names: puts the names and functions of a checkpoint (of this file) into the script."""

    def __init__(
        self, project: Project, arguments: Mapping[str, Any], terms: Terms | None,
        restore_names: Callable[[Mapping[str, Any], str], None],
    ) -> None:  # fmt: skip
        self.project, self.arguments = project, arguments
        self.restore_names = restore_names
        self.where: g.Range | None = where(terms)

    def __getitem__(self, name: str) -> Any:
        return self.arguments[name]

    def get(self, name: str, default: Any = None) -> Any:
        """An argument, or the default if it was not given."""
        return self.arguments.get(name, default)

    def given(self, *left_out: str) -> dict[str, Any]:
        """The arguments as keyword arguments of Python."""
        return {python(name): value for name, value in self.arguments.items() if name not in left_out}

    def given_only(self, *names: str) -> dict[str, Any]:
        """Those of these names that were given."""
        return {python(name): self.arguments[name] for name in names if name in self.arguments}

    def properties(self) -> dict[str, Any]:
        """Those of a model, tables and functions by their names."""
        given = {python(name): self._plain(value) for name, value in self.arguments["properties"].items()}
        return with_parameters(given)

    def _plain(self, value: Any) -> Any:
        if isinstance(value, FunctionName):
            return fdem.assignments.function(self.project, value.name)
        return value.name if isinstance(value, TableName) else value

    def group(self) -> dict[str, Any]:
        """`group 'g' set 's'` of a mesh."""
        given = self.arguments.get("group")
        if given is None:
            return {}
        return {"group": given["value"], "set_name": given.get("set", g.DEFAULT)}


def with_parameters(given: dict[str, Any]) -> dict[str, Any]:
    """Properties, with those that a law of the user declares under their names. CommandError if one is given twice."""
    found = {name: value for name, value in given.items() if name != "parameter"}
    for name, value in given.get("parameter", ()):
        if name in found:
            raise CommandError(f"'{name}' is given twice")
        found[name] = value
    return found


def where(terms: Terms | None) -> g.Range | None:
    """RANGE as the commands take it."""
    if terms is None:
        return None
    found: list[g.Term] = []
    negated = False
    for name, value in terms:
        if name == "not":
            negated = True
        else:
            term = _TERMS[name](value)
            found.append(g.Not(term) if negated else term)
            negated = False
    return tuple(found)


_TERMS: dict[str, Callable[[Any], g.Term]] = {
    "group": lambda v: g.InGroup(v["value"], v.get("set", g.DEFAULT)),
    "set": g.InSet,
    "id": lambda v: g.Ids(v[0], v[-1]),
    "x": lambda v: g.Span(0, v[0], v[-1]),
    "y": lambda v: g.Span(1, v[0], v[-1]),
    "z": lambda v: g.Span(2, v[0], v[-1]),
    "area": lambda v: g.Sized(*v),
    "in-circle": lambda v: g.InCircle(*(v["value"] or (v["center"], v["radius"]))),
    "geometry-along": lambda v: g.Along(v["value"], v.get("distance-offset", 0.0), v.get("angle-offset", 0.0)),
    "geometry-distance": lambda v: g.Near(v["value"], v.get("within", 0.0)),
    "geometry-location": lambda v: g.Crossed(v["value"], v.get("ray-direction", (1.0, 0.0)), v.get("count", 1)),
    "geometry": g.OnLayer,
    "boundary": lambda v: g.OnBoundary(),
    "face-of": lambda v: g.OfElements(v["value"], v.get("set", g.DEFAULT)),
    "element": lambda v: g.OfElement(*((v[0], v[-1]) if v else (0, LAST))),
    "between": lambda v: g.Between(v["value"][0], v["value"][1], v.get("set", g.DEFAULT)),
    "crack": lambda v: g.OnCrack(),
    "present": lambda v: g.Present(),
    "use-hidden": g.UseHidden,
}

# ---- model ---------------------------------------------------------------------------------------------------------


def _restore(call: Call) -> None:
    found = fdem.checkpoints.restore(call.project, call["file"])
    call.restore_names(found, call["file"])


# ---- geometry and mesh ---------------------------------------------------------------------------------------------


def _shape(kind: str, *names: str) -> Callable[[Call], None]:
    def carry_out(call: Call) -> None:
        fdem.geometry.create(call.project, kind, call.get("as-layer", DEFAULT_LAYER), *(call[name] for name in names))

    return carry_out


def _fractures(call: Call) -> None:
    if call.project.dim == 3:
        fdem.meshes.disc_network(
            call.project,
            call.get("as-layer", DEFAULT_LAYER),
            call["inside"],
            **trial.disc_words(call.arguments),
            seed=call["seed"],
        )
        return
    fdem.meshes.fracture_network(
        call.project, call.get("as-layer", DEFAULT_LAYER), call["inside"], **trial.fracture_words(call.arguments),
        seed=call["seed"], holes=call.get("hole", []), least=call.get("shortest", 0.0),
    )  # fmt: skip


def _mesh_create(call: Call) -> None:
    group = call.group()
    fdem.meshes.create(
        call.project, call["from-layer"], call["size"], call.get("type", "tri"), **group,
        refine=[(r["value"], r["size"], r.get("distance")) for r in call.get("refine-layer", [])],
        holes=call.get("hole", []),
        regions=[(r["value"], r.get("group", r["value"])) for r in call.get("region", [])],
        embedded=call.get("embed", []), cracks=call.get("crack", []), irregular=call.get("irregular", False),
        smooth=call.get("smooth", False), bodies=call.get("bodies", False),
    )  # fmt: skip


def _mesh_structured(call: Call) -> None:
    options = {"ratio": call["ratio"]} if "ratio" in call.arguments else {}
    if len(call["first"]) == 3:
        fdem.meshes.box(
            call.project,
            call["first"],
            call["second"],
            call["cells"],
            call.get("split", 6),
            hexes=call.get("type") == "hex",
            **call.group(),
            **options,
        )
        return
    fdem.meshes.rectangle(
        call.project, call["first"], call["second"], call["cells"], call.get("type", "tri"),
        call.get("diagonal", "alternate"), **call.group(), **options,
    )  # fmt: skip


def _brick(call: Call) -> None:
    fdem.meshes.brick(
        call.project, call["p0"], [call[name] for name in ("p1", "p2", "p3") if name in call.arguments], call["n"],
        split=call.get("triangle", True), **call.given_only("ratio"), **call.group(),
    )  # fmt: skip


def _patch(call: Call) -> None:
    pieces = trial.pieces(call.arguments)
    size = call.given_only("tolerance")
    fdem.meshes.patch(call.project, pieces, call.get("global-mesh-size"), **size, **call.group())


def _mesh_glue(call: Call) -> None:
    groups = call.get("between", {})
    fdem.meshes.glue(
        call.project, call.get("tolerance"), groups.get("value"), groups.get("set", g.DEFAULT), call.where
    )  # fmt: skip


def _densify(call: Call) -> None:
    most = call["maximum-length"]
    fdem.meshes.densify(call.project, call.get("pattern", (1, 1)), (most[0], most[-1]), call.where)


# ---- elements, faces, joints, nodes --------------------------------------------------------------------------------


def _group(kind: str) -> Callable[[Call], None]:
    def carry_out(call: Call) -> None:
        fdem.assignments.group(call.project, kind, call["group"], call.get("set", g.DEFAULT), call.where)

    return carry_out


def _of_field(call: Call, models: Mapping[str, Model]) -> str | None:
    """The field whose model or condition it is."""
    return next((name for name, one in models.items() if one.keyword.name == call["model"]), None)


def _element_model(call: Call) -> None:
    if call["model"] == "null":
        fdem.assignments.null(call.project, **call.properties(), where=call.where)
    elif call["model"] == "user":
        fdem.assignments.user_model(call.project, call["law"], call.properties(), call.where)
    elif trial.MODELS[call["model"]] is ISO_HEAT.of:
        fdem.heat.model(call.project, call.properties(), call.where)
    elif (field := _of_field(call, FIELD_MODELS)) is not None:
        fdem.fields.model(call.project, field, call.properties(), call.where)
    elif call["model"] in _FLUIDS:
        _FLUIDS[call["model"]](call, fdem.assignments.around(call.project, call.where))
    else:
        name = trial.MODELS[call["model"]].name
        fdem.assignments.element_model(call.project, name, call.properties(), call.where)


def _face_model(call: Call) -> None:
    fdem.assignments.face_model(call.project, trial.MODELS[call["model"]].name, call.properties(), call.where)


_FLUIDS: dict[str, Callable[[Call, g.Range | None], None]] = {
    POROUS.keyword.name: lambda c, where: fdem.flow.model(c.project, c.properties(), where),
    PROPPANT.keyword.name: lambda c, where: fdem.flow.with_proppant(c.project, c.properties(), where),
    FLUID_HEAT.keyword.name: lambda c, where: fdem.heat.fluid_model(c.project, c.properties(), where),
}
"""Models of what is in joints."""


def _joint_model(call: Call) -> None:
    if call["model"] in _FLUIDS:
        _FLUIDS[call["model"]](call, call.where)
        return
    properties = {name: value for name, value in call.properties().items() if name != "np"}
    fdem.assignments.joint_model(call.project, trial.MODELS[call["model"]].name, properties, call.where)


def _initial_stress(call: Call) -> None:
    stress = {name.removeprefix("stress-"): given["value"] for name, given in call.arguments.items()}
    gradient = {
        name.removeprefix("stress-"): given["gradient"] for name, given in call.arguments.items() if "gradient" in given
    }
    fdem.assignments.initial_stress(call.project, stress, gradient, call.where)


def _node_condition(call: Call) -> None:
    given, commands = call.properties(), fdem.assignments
    match call["model"]:
        case "mechanical-velocity-boundary-condition":
            commands.velocity(call.project, **_short(given), where=call.where)
        case "mechanical-force-boundary-condition":
            commands.force(call.project, **_short(given), where=call.where)
        case "mechanical-move-boundary-constraint":
            kind, *along = given["type"]
            commands.move(call.project, kind, along[0] if along else (0.0,) * call.project.dim, call.where)
        case FLOW_CONDITION.keyword.name:
            fdem.flow.condition(call.project, **given, where=call.where)
        case PROPPANT_CONDITION.keyword.name:
            fdem.flow.proppant_condition(call.project, **_over_time(call), where=call.where)
        case TEMPERATURE.keyword.name:
            fdem.heat.condition(call.project, **_over_time(call), where=call.where)
        case FLUID_TEMPERATURE.keyword.name:
            fdem.heat.fluid_condition(call.project, **_over_time(call), where=call.where)
        case _ if (field := _of_field(call, FIELDS_AT_NODES)) is not None:
            fdem.fields.condition(call.project, field, _over_time(call)[field], call.where)


_KINDS = {VELOCITY: "motion", FORCE: "force", MOVE: "constraint"}


def _removed(call: Call, *conditions: Model) -> list[bool]:
    """Which of these conditions are taken back: those that are named, or all."""
    return [one.keyword.name in call.arguments or not call.arguments for one in conditions]


def _free_nodes(call: Call) -> None:
    kinds = [kind for (one, kind) in _KINDS.items() if _removed(call, one) == [True]]
    if kinds:
        fdem.assignments.remove_node_conditions(call.project, call.where, kinds)
    if any(of_flow := _removed(call, FLOW_CONDITION, PROPPANT_CONDITION)):
        fdem.flow.remove_conditions(call.project, call.where, *of_flow)
    if any(of_heat := _removed(call, TEMPERATURE, FLUID_TEMPERATURE)):
        fdem.heat.remove_conditions(call.project, call.where, *of_heat)
    _free_of_fields(call, FIELDS_AT_NODES, g.NODE)


def _free_of_fields(call: Call, conditions: Mapping[str, Model], kind: str) -> None:
    for name, condition in conditions.items():
        if any(_removed(call, condition)):
            fdem.fields.remove(call.project, name, kind, call.where)


def _free_faces(call: Call) -> None:
    stress, heat = _removed(call, STRESS, CONST_HEAT)
    if stress:
        fdem.assignments.remove_face_conditions(call.project, call.where)
    if heat:
        fdem.heat.remove_face_conditions(call.project, call.where)
    _free_of_fields(call, FIELDS_AT_FACES, g.FACE)


def _free_bolt_nodes(call: Call) -> None:
    motion, force = _removed(call, BOLT_VELOCITY, BOLT_FORCE)
    stems = () if motion and force else ("does", "at") if motion else ("force",)
    fdem.supports.remove_conditions(call.project, g.BOLT_NODE, call.where, stems)


def _initial_nodes(call: Call) -> None:
    if "velocity" in call.arguments:
        fdem.assignments.initial_velocity(call.project, call["velocity"], call.where)
    axes = "xyz"[: call.project.dim]
    speeds = tuple(call.get(f"velocity-{axis}") for axis in axes)
    if any(speed is not None for speed in speeds):
        fdem.assignments.initial_velocity(call.project, speeds, call.where)
    forces = {f"f{axis}": call[f"force-{axis}"] for axis in axes if f"force-{axis}" in call.arguments}
    if forces:
        fdem.assignments.force(call.project, **forces, where=call.where)
    if "temperature" in call.arguments:
        fdem.heat.initial(call.project, call["temperature"], call.where)
    for field in FIELDS_AT_NODES:
        if field in call.arguments:
            fdem.fields.initial(call.project, field, call[field], call.where)


def _initial_fluid(call: Call) -> None:
    if "flow-node-saturation" in call.arguments:
        fdem.flow.initial(call.project, saturation=call["flow-node-saturation"], where=call.where)
    if "flow-node-temperature" in call.arguments:
        fdem.heat.initial_fluid(call.project, call["flow-node-temperature"], call.where)


def _node_history(call: Call) -> None:
    fdem.histories.create(call.project, call["name"], g.NODE, "temperature", how="mean", every=call.get("every", 1),
                          where=call.where)  # fmt: skip


def _short(given: Mapping[str, Any]) -> dict[str, Any]:
    """`velocity_x` becomes `vx`."""
    return {name[0] + name[-1]: value for name, value in given.items()}


def _face_condition(call: Call) -> None:
    if call["model"] == "free-field":
        fdem.assignments.free_field(call.project, call.where)
        return
    if call["model"] == CONST_HEAT.keyword.name:
        fdem.heat.face_condition(call.project, **_over_time(call), where=call.where)
        return
    if (field := _of_field(call, FIELDS_AT_FACES)) is not None:
        fdem.fields.face_condition(call.project, field, **_over_time(call), where=call.where)
        return
    given = {name.removeprefix("stress_"): value for name, value in call.properties().items()}
    if call["model"] == ABSORB.keyword.name:
        given["quiet"] = True
    fdem.assignments.stress(call.project, **given, where=call.where)


def _over_time(call: Call) -> dict[str, Any]:
    """Properties of a condition of heat or proppant."""
    for name, value in call.arguments["properties"].items():
        if isinstance(value, FunctionName):
            raise CommandError(f"{name} is a number or a table of time, no function of place")
    return call.properties()


def _stage(call: Call) -> None:
    given = call.given()
    for name, value in given.items():
        if isinstance(value, FunctionName):
            raise CommandError(f"{name} of a stage is a number or a table over the time of flow, no function of place")
        given[name] = value.name if isinstance(value, TableName) else value
    fdem.flow.stage(call.project, **{**given, "shut_in": "shut-in" in call.arguments})


# ---- bolts ---------------------------------------------------------------------------------------------------------


def _bolt(call: Call) -> None:
    words = {name: call.get(name) for name in ("segments", "length", "grout")}
    fdem.bolts.create(call.project, call["points"], **words, plate=call.get("plate", False), **call.group())


def _bar(call: Call) -> None:
    size = {"size": call["mesh-size"]} if "mesh-size" in call.arguments else {}
    fdem.bolts.between(call.project, call["first"], call["second"], **size, **call.group(), where=call.where)


def _bolt_node_condition(call: Call) -> None:
    given = _short(call.properties())
    if call["model"] == "bolt-node-constrain":
        fdem.bolts.velocity(call.project, **given, where=call.where)
    else:
        fdem.bolts.force(call.project, **given, where=call.where)


# ---- liners --------------------------------------------------------------------------------------------------------


def _liner_node_condition(call: Call) -> None:
    given = {{"velocity_x": "vx", "velocity_y": "vy", "force_x": "fx", "force_y": "fy"}.get(name, name): value
             for name, value in call.properties().items()}  # fmt: skip
    if call["model"] == "liner-node-constrain":
        fdem.liners.velocity(call.project, **given, where=call.where)
    else:
        fdem.liners.force(call.project, **given, where=call.where)


# ---- records -------------------------------------------------------------------------------------------------------


def _field(call: Call) -> None:
    distribution = next(name for name in ("weibull", "normal", "lognormal") if name in call.arguments)
    about = {name: call[name] for name in ("least", "greatest") if name in call.arguments}
    if "correlation" in call.arguments:
        about["correlation"] = call["correlation"]["value"]
        about["covariance"] = call["correlation"].get("covariance", "exponential")
    first, second = call[distribution]
    fdem.assignments.random_field(
        call.project, call["name"], distribution=distribution, first=first, second=second, seed=call["seed"], **about
    )


def _history(call: Call) -> None:
    how = next((word for word in ("sum", "mean", "minimum", "maximum") if word in call.arguments), "")
    kind = {"joint": g.JOINT}.get(call["object"], call["object"])
    fdem.histories.create(
        call.project, call["name"], kind, python(call["value"]), call.get("id"), call.get("nearest"), how,
        call.get("every", 1), call.where, **call.given_only("variable", "well"),
    )  # fmt: skip


def _option(call: Call) -> None:
    given = call.given("creep", "ecda")
    if call.get("ecda") is False:
        raise CommandError(
            "ecda off: faces of a joint that is whole are no contacts besides here, its penalty-overlay holds them "
            "apart; leave ecda on"
        )
    if given.get("collision") == ():  # the word before ecda
        del given["collision"]
    if given:
        fdem.settings.option(call.project, **given)
    if "creep" in call.arguments:
        fdem.settings.creep(call.project, call["creep"])


def _time_step(call: Call) -> None:
    given = call.given()
    if given.get("auto") == ():
        given["auto"] = True
    if isinstance(given.get("value"), TableName):
        given["value"] = given["value"].name
    fdem.settings.time_step(call.project, **given)


def _parts(call: Call) -> dict[str, dict[str, Any]]:
    """What is said of parts of a calculation, by the part."""
    return {python(part): {python(name): value for name, value in given.items() if name != "value"}
            for part, given in call.arguments.items()}  # fmt: skip


def _table(call: Call) -> None:
    numbers, said = call.get("data"), call.get("type", {})
    if numbers is not None and len(numbers) % 2:
        raise CommandError(f"data are pairs of numbers, time and value; there are {len(numbers)} numbers")
    kinds = {"relative-time": True, "absolute-time": False}
    given = [value for name, value in kinds.items() if name in said]
    if "type" in call.arguments and len(given) != 1:
        raise CommandError("type is relative-time or absolute-time")
    pairs = None if numbers is None else list(zip(numbers[::2], numbers[1::2]))
    fdem.assignments.table(call.project, call["name"], pairs, given[0] if given else None)


def _solve(call: Call) -> None:
    if "elastic" in call.arguments:
        fdem.steps.solve_elastic(call.project, **call.given("elastic"))
    elif "hydraulic" in call.arguments:
        fdem.steps.solve_hydraulic(call.project, **call.given("hydraulic"))
    elif "thermal" in call.arguments:
        fdem.steps.solve_thermal(call.project, **call.given("thermal"))
    else:
        fdem.steps.solve(call.project, **call.given())


def _curve(call: Call) -> None:
    given = call.given()
    if "profile" in given:
        given["profile"] = python(given["profile"])
    fdem.charts.add(call.project, **given, where=call.where)


def _output(call: Call) -> None:
    if "off" in call.arguments:
        fdem.frames.stop(call.project, call["file"])
    else:
        fdem.frames.vtk(call.project, call["file"], call.get("every"))


def _image(call: Call) -> None:
    given = call.given("file", "object", "camera", "log", "edges", "full")
    if "field" in given:
        given["field"] = python(given["field"])
    if "object" in call.arguments:
        given["kind"] = call["object"]
    if "camera" in call.arguments:
        given["corners"] = call["camera"]
    given |= {word: True for word in ("log", "edges") if word in call.arguments}
    given |= {"limits": "full"} if "full" in call.arguments else {}
    fdem.pictures.image(call.project, call["file"], where=call.where, **given)


BINDINGS: dict[str, Callable[[Call], None]] = {
    "model new": lambda c: fdem.settings.new(c.project, **c.given()),
    "model save": lambda c: fdem.checkpoints.save(c.project, c["file"]),
    "model restore": _restore,
    "model gravity": lambda c: fdem.settings.gravity(c.project, c["gravity"]),
    "model units": lambda c: fdem.settings.units(c.project, c["system"]),
    "model option": _option,
    "model time-step": _time_step,
    "model run-time": lambda c: fdem.clocks.run_time(c.project, c["time"]),
    "model solve-check": lambda c: fdem.clocks.solve_check(c.project, c["steps"]),
    "model cycle-option": lambda c: fdem.clocks.cycle_option(c.project, **_parts(c)),
    "model reset": lambda c: fdem.clocks.reset(c.project, **_parts(c)),
    "model plane-strain": lambda c: fdem.settings.option(c.project, plane_stress=False),
    "model plane-stress": lambda c: fdem.settings.option(c.project, plane_stress=True),
    "model query": lambda c: fdem.clocks.query(c.project, *_parts(c)),
    "device list": lambda c: fdem.clocks.devices(c.project),
    "node thermal-initialize": lambda c: fdem.heat.initial(c.project, c["temperature"], c.where),
    "node hydraulic-initialize": _initial_fluid,
    "node history": _node_history,
    "table": _table,
    "model field": lambda c: fdem.fields.clock(c.project, c["field"], **c.given("field")),
    "model sub-step": lambda c: fdem.flow.sub_step(c.project, **c.given()),
    "model rayleigh": lambda c: fdem.settings.rayleigh(c.project, **c.given()),
    "model creep": lambda c: fdem.settings.creep(c.project, **c.given()),
    "model step": lambda c: fdem.steps.step(c.project, c["steps"]),
    "model solve": _solve,
    "geometry create polyline": _shape("polyline", "points"),
    "geometry create polygon": _shape("polygon", "points"),
    "geometry create rectangle": _shape("rectangle", "first", "second"),
    "geometry create circle": lambda c: fdem.geometry.create(
        c.project, *trial.circle(c.arguments)[:1], c.get("as-layer", DEFAULT_LAYER), *trial.circle(c.arguments)[1:]
    ),
    "geometry create arc": _shape("arc", "centre", "radius", "begin", "end"),
    "geometry create point": _shape("point", "points"),
    "geometry create fractures": _fractures,
    "geometry create box": _shape("box", "first", "second"),
    "geometry create sphere": _shape("sphere", "centre", "radius"),
    "geometry create cylinder": _shape("cylinder", "first", "second", "radius"),
    "geometry create cone": _shape("cone", "first", "second", "radius", "other"),
    "geometry create disc": _shape("disc", "centre", "normal", "radius"),
    "geometry create plane": _shape("plane", "point", "normal"),
    "geometry create extrude": lambda c: fdem.geometry.extrude(
        c.project, c.get("as-layer", DEFAULT_LAYER), c["layer"], c["along"]
    ),
    "geometry create revolve": lambda c: fdem.geometry.revolve(
        c.project, c.get("as-layer", DEFAULT_LAYER), c["layer"], **c.given("as-layer", "layer")
    ),
    "geometry import": lambda c: fdem.geometry.import_file(
        c.project, c.get("as-layer", DEFAULT_LAYER), c["file"], c.get("dxf-layer"), c.get("scale")
    ),
    "geometry transform": lambda c: fdem.geometry.transform(c.project, **c.given()),
    "geometry scale": lambda c: fdem.geometry.moved(c.project, c.get("layer"), scale=c["factors"]),
    "geometry translate": lambda c: fdem.geometry.moved(c.project, c.get("layer"), translate=c["way"]),
    "geometry export": lambda c: fdem.geometry.export(c.project, c["layers"], c["file"]),
    "geometry delete": lambda c: fdem.geometry.delete(c.project, c["layers"]),
    "mesh create": _mesh_create,
    "mesh structured": _mesh_structured,
    "mesh equilateral": lambda c: fdem.meshes.equilateral(c.project, c["first"], c["second"], c["size"], **c.group()),
    "mesh import": lambda c: fdem.meshes.import_file(
        c.project, c["file"], **c.group(), **{n: c[n] for n in ("merge", "scale") if n in c.arguments}
    ),
    "mesh intersect": lambda c: fdem.meshes.intersect(c.project, c["layer"], c.get("follow", False)),
    "mesh glue": _mesh_glue,
    "mesh quadratic": lambda c: fdem.meshes.six_nodes(c.project),
    "mesh quality": lambda c: fdem.meshes.tell_quality(c.project),
    "element create brick": _brick,
    "element create geometry": _patch,
    "element create geometry-patch": _patch,
    "element create geometry-boundary": _patch,
    "element create hollow-circle": _patch,
    "model add node": lambda c: fdem.meshes.add_nodes(c.project, c["points"]),
    "model add element": lambda c: fdem.meshes.add_element(c.project, c["corners"]),
    "model scale": lambda c: fdem.meshes.scale(c.project, c["factors"]),
    "model translate": lambda c: fdem.meshes.translate(c.project, c["way"]),
    "element delete": lambda c: fdem.meshes.delete(c.project, c.where),
    "element densify": _densify,
    "element hide": lambda c: fdem.settings.hide(c.project, c.get("hidden", True), c.where),
    "element collision": lambda c: fdem.settings.collision(c.project, c["on"], c.where),
    "element water": lambda c: fdem.assignments.water(c.project, **c.given(), where=c.where),
    "element list summary": lambda c: fdem.summary.listed(c.project, g.ELEMENT, c.where),
    "element group": _group(g.ELEMENT),
    "element c-model": _element_model,
    "element law": lambda c: fdem.assignments.load_law(c.project, c["law"]),
    "element property": lambda c: fdem.heat.element_property(c.project, with_parameters(c.given()), c.where),
    "element initial": _initial_stress,
    "element reset state": lambda c: fdem.settings.reset_elements(c.project, c.where),
    "element reset kelvin-strain": lambda c: fdem.settings.reset_kelvin_strain(c.project, c.where),
    "element-face group": _group(g.FACE),
    "element-face list summary": lambda c: fdem.summary.listed(c.project, g.FACE, c.where),
    "face-joint list summary": lambda c: fdem.summary.listed(c.project, g.JOINT, c.where),
    "element-face c-model": _face_model,
    "element-face property": lambda c: fdem.assignments.face_property(c.project, c.given(), c.where),
    "element-face boundary": _face_condition,
    "element-face boundary remove": _free_faces,
    "face-joint group": _group(g.JOINT),
    "face-joint c-model": _joint_model,
    "face-joint property": lambda c: fdem.flow.joint_property(c.project, c.given(), c.where),
    "face-joint reset state": lambda c: fdem.settings.reset_joints(c.project, c.where),
    "node group": _group(g.NODE),
    "node boundary": _node_condition,
    "node mechanical-damp": lambda c: fdem.assignments.damp(c.project, c["local"], c.where),
    "node function": lambda c: fdem.assignments.load_function(c.project, c["function"]),
    "node boundary remove": _free_nodes,
    "node initial": _initial_nodes,
    "node reset velocity": lambda c: fdem.settings.reset_velocity(c.project),
    "node reset displacement": lambda c: fdem.settings.reset_displacement(c.project),
    "flow-node initial": lambda c: fdem.flow.initial(c.project, **c.given(), where=c.where),
    "well create": lambda c: fdem.flow.well(c.project, c["name"], c.where),
    "well stage": _stage,
    "bolt create polyline": _bolt,
    "bolt-element create": _bar,
    "bolt c-model": lambda c: fdem.supports.assign(c.project, g.BOLT_ELEMENT, c.properties(), c.where),
    "bolt delete": lambda c: fdem.supports.delete(c.project, g.BOLT_ELEMENT, c.where),
    "bolt-element group": _group(g.BOLT_ELEMENT),
    "bolt-node group": _group(g.BOLT_NODE),
    "bolt-node boundary": _bolt_node_condition,
    "bolt-node boundary remove": _free_bolt_nodes,
    "liner create": lambda c: fdem.liners.create(c.project, **c.group(), where=c.where),
    "liner c-model": lambda c: fdem.supports.assign(c.project, g.LINER_ELEMENT, c.properties(), c.where),
    "liner delete": lambda c: fdem.supports.delete(c.project, g.LINER_ELEMENT, c.where),
    "liner-element group": _group(g.LINER_ELEMENT),
    "liner-node group": _group(g.LINER_NODE),
    "liner-node boundary": _liner_node_condition,
    "liner-node boundary remove": lambda c: fdem.supports.remove_conditions(c.project, g.LINER_NODE, c.where),
    "table create": lambda c: fdem.assignments.table(c.project, c["name"], c["values"]),
    "field create": _field,
    "field delete": lambda c: fdem.assignments.remove_field(c.project, c["name"]),
    "table delete": lambda c: fdem.assignments.remove_table(c.project, c["name"]),
    "history create": _history,
    "history delete": lambda c: fdem.histories.delete(c.project, c["name"]),
    "history export": lambda c: fdem.histories.export(c.project, c["file"], c.get("names", ())),
    "chart create": lambda c: fdem.charts.create(c.project, **c.given()),
    "chart add": _curve,
    "chart export": lambda c: fdem.charts.export(
        c.project,
        c["name"],
        c["file"],
        "cracks" in c.arguments,
        "plastic" in c.arguments,
        c.get("fluid", ""),
        "temperature" in c.arguments,
    ),
    "output vtk": _output,
    "output image": _image,
}


def carry_out(command: Command, call: Call) -> None:
    """The function of a command, then a look at its values in the units declared. What has no effect is said once."""
    if command.idle:
        if call.project.log is not None:
            call.project.log.warn_once(command.name, f"{command.name} has no effect here: {command.idle}")
        return
    BINDINGS[command.name](call)
    if call.project.units:
        units.look(call.project.units, call.project.log, _measured(command, call.arguments))


def _measured(command: Command, arguments: Mapping[str, Any]) -> Iterator[units.Given]:
    """Values of a command and of its model that have a unit."""
    named = arguments.get("model")
    models = [model for model in command.models if model.keyword.name == named]
    options = [option for model in models for option in (*model.leading, *model.options)]
    given = {**arguments, **arguments.get("properties", {})}
    for option in (*command.leading, *command.options, *options):
        if option.unit and option.name in given:
            yield option.name, option.unit, given[option.name]


PASSED_OVER: dict[str, Callable[[Any, str], Any]] = {
    "model save": lambda project, file: project.to_write(project.path(fdem.checkpoints.named(file))),
    "model restore": lambda project, file: project.to_read(fdem.checkpoints.found(project, file)),
    "geometry import": lambda project, file: project.to_read(file),
    "geometry export": lambda project, file: project.to_write(project.result(file)),
    "mesh import": lambda project, file: project.to_read(file),
    "history export": lambda project, file: project.to_write(project.result(file)),
    "chart export": lambda project, file: project.to_write(project.result(file)),
}
"""What is still to be known of a command that was carried out before the checkpoint: which file it read or made."""
