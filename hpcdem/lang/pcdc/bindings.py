"""Calls of the functions of `hpcdem.commands.fdem` by commands of a script: the row of the table names the function
(`does`), which receives the arguments under their names. This module contains the further conversions."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from hpcdem.commands import fdem, units
from hpcdem.commands.fdem.values import DEFAULT_LAYER
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc import table as t
from hpcdem.lang.pcdc import trial
from hpcdem.lang.pcdc.kinds import FunctionName, TableName
from hpcdem.lang.pcdc.table import Command, Model, Option
from hpcdem.lang.pcdc.trial import python
from hpcdem.physics.fdem import groups as g

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project

LAST = 2**53
"""Number larger than that of any object."""


class Call:
    """A command to be passed to its function: its row, arguments with all expressions evaluated, by name; where: its
    range; restore_names: puts the names and functions of a checkpoint (of this file) into the script.
    """

    def __init__(
        self, project: Project, command: Command, arguments: Mapping[str, Any], where: g.Range | None,
        restore_names: Callable[[Mapping[str, Any], str], None] = lambda names, file: None,
    ) -> None:  # fmt: skip
        self.project, self.command, self.arguments = project, command, arguments
        self.restore_names = restore_names
        self.where = where

    def __getitem__(self, name: str) -> Any:
        return self.arguments[name]

    def get(self, name: str, default: Any = None) -> Any:
        """An argument, or the default if it was not given."""
        return self.arguments.get(name, default)

    @functools.cached_property
    def model(self) -> Model | None:
        """The model or condition that is named."""
        return next((one for one in self.command.models if one.keyword.name == self.arguments.get("model")), None)

    def given(self, *left_out: str) -> dict[str, Any]:
        """The arguments as keyword arguments of Python."""
        found: dict[str, Any] = {}
        for option in (*self.command.leading, *self.command.options):
            if option.name in self.arguments and option.name not in left_out:
                found |= self._spread(option, self.arguments[option.name])
        return found

    def _spread(self, option: Option, value: Any) -> dict[str, Any]:
        """A value, and those of words that follow it, each by its name."""
        if option.repeated and option.more:
            return {argument(option.name): [_in_order(option, one) for one in value]}
        if isinstance(value, Mapping):
            own = {argument(option.name): self._plain(value["value"])} if option.values else {}
            more = {argument(name): self._plain(one) for name, one in value.items() if name != "value"}
            return {**own, **more} if option.values else {argument(option.name): more}
        left_out = isinstance(value, tuple) and not value
        return {argument(option.name): True if left_out else self._plain(value)}

    def properties(self) -> dict[str, Any]:
        """Convert the properties of a model, tables and functions by their names."""
        given = {argument(name): self._plain(value) for name, value in self["properties"].items() if name != "np"}
        return with_parameters(given)

    def _plain(self, value: Any) -> Any:
        if isinstance(value, FunctionName):
            return fdem.assignments.load_function(self.project, value.name)
        return value.name if isinstance(value, TableName) else value

    def group(self) -> dict[str, Any]:
        """`group 'g' set 's'` of a mesh."""
        given = self.arguments.get("group")
        return {} if given is None else {"group": given["value"], "set_name": given.get("set", g.DEFAULT)}


def argument(name: str) -> str:
    """Name of the argument of functions for a word of the language."""
    return "set_name" if name == "set" else t.SHORT.get(name) or python(name)


def _in_order(option: Option, given: Mapping[str, Any]) -> tuple[Any, ...]:
    """A value and those of the words that may follow it; None for one that does not."""
    return tuple(given.get(name) for name in ("value", *(word.name for word in option.more)))


def with_parameters(given: dict[str, Any]) -> dict[str, Any]:
    """Properties, with those that a user law declares under their names. CommandError if one is given twice."""
    found = {name: value for name, value in given.items() if name != "parameter"}
    for name, value in given.get("parameter", ()):
        if name in found:
            raise CommandError(f"'{name}' is given twice")
        found[name] = value
    return found


@functools.cache
def takes(does: str) -> Mapping[str, inspect.Parameter]:
    """The arguments of a function of `hpcdem.commands.fdem`, but for the project."""
    module, _, name = does.partition(".")
    function = getattr(import_module(f"hpcdem.commands.fdem.{module}"), name)
    return dict(list(inspect.signature(function).parameters.items())[1:])


def by_name(call: Call) -> None:
    """Call the function that the row of a command, or of its model, names. What no word says comes from the row: the
    `kind` of objects, the `name` of a model."""
    row = call.model or call.command
    wanted, given, where = takes(row.does), dict(row.fixed), call.where
    if call.model is None:
        given |= {"properties": with_parameters(call.given())} if "properties" in wanted else call.given()
    else:
        if call.model.by_time:
            _refuse_functions(call["properties"])
        given |= {argument(option.name): call[option.name] for option in call.model.leading}
        given |= {"properties": call.properties()} if "properties" in wanted else call.properties()
        if "name" in wanted:
            given["name"] = call.model.of_field or (call.model.of and call.model.of.name)
        if call.model.ranged not in ("", call.command.ranged):
            where = fdem.assignments.around(call.project, where)
    if "kind" in wanted:
        given["kind"] = call.command.ranged
    if "where" in wanted:
        given["where"] = where
    module, _, name = row.does.partition(".")
    getattr(getattr(fdem, module), name)(call.project, **given)


def _refuse_functions(given: Mapping[str, Any]) -> None:
    for name, value in given.items():
        if isinstance(value, FunctionName):
            raise CommandError(f"{name} must be a number or a table of time, not a function of position")


# ---- ranges ----------------------------------------------------------------------------------------------------------


def where(terms: Sequence[tuple[str, Any]] | None) -> g.Range | None:
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


# ---- what more there is to convert -----------------------------------------------------------------------------------

CONVERTERS: dict[str, Callable[[Call], None]] = {}
"""Converters by their names in the rows of the table."""


def converter(function: Callable[[Call], None]) -> Callable[[Call], None]:
    """Register a conversion under its name."""
    CONVERTERS[function.__name__] = function
    return function


@converter
def restore(call: Call) -> None:
    """The names that were saved with the state go into the script."""
    call.restore_names(fdem.checkpoints.restore(call.project, call["file"]), call["file"])


@converter
def shape(call: Call) -> None:
    """Kind and values of a shape."""
    kind, *values = trial.shape(call.command.name, call.arguments)
    fdem.geometry.create(call.project, kind, call.get("as-layer", DEFAULT_LAYER), *values)


@converter
def fractures(call: Call) -> None:
    """Lines or discs."""
    layer, inside, seed = call.get("as-layer", DEFAULT_LAYER), call["inside"], call["seed"]
    if call.project.dim == 3:
        fdem.meshes.disc_network(call.project, layer, inside, **trial.disc_words(call.arguments), seed=seed)
        return
    fdem.meshes.fracture_network(
        call.project, layer, inside, **trial.fracture_words(call.arguments), seed=seed, holes=call.get("hole", []),
        least=call.get("shortest", 0.0),
    )  # fmt: skip


@converter
def patch(call: Call) -> None:
    """Pieces in the order of the line."""
    size = {"tolerance": call["tolerance"]} if "tolerance" in call.arguments else {}
    pieces = trial.pieces(call.arguments)
    fdem.meshes.patch(call.project, pieces, call.get("global-mesh-size"), **size, **call.group())


@converter
def initial_stress(call: Call) -> None:
    """Convert initial stress by component."""
    given = {name.removeprefix("stress-"): one for name, one in call.arguments.items()}
    stress, gradient = (
        {name: one[word] for name, one in given.items() if word in one} for word in ("value", "gradient")
    )
    fdem.assignments.initial_stress(call.project, stress, gradient, call.where)


@converter
def node_field(call: Call) -> None:
    """The condition of a field is called as the field."""
    _refuse_functions(call["properties"])
    ((name, value),) = call.properties().items()
    fdem.fields.condition(call.project, name, value, call.where)


def _removed(call: Call, *conditions: Model) -> list[bool]:
    """Flag the conditions to remove: the named ones, or all if none is named."""
    return [one.keyword.name in call.arguments or not call.arguments for one in conditions]


@converter
def free_nodes(call: Call) -> None:
    """Release conditions of nodes of the physics to which they belong."""
    of_blocks = zip(("motion", "force", "constraint"), _removed(call, t.VELOCITY, t.FORCE, t.MOVE))
    if kinds := [kind for kind, removed in of_blocks if removed]:
        fdem.assignments.remove_node_conditions(call.project, call.where, kinds)
    if any(of_flow := _removed(call, t.FLOW_CONDITION, t.PROPPANT_CONDITION)):
        fdem.flow.remove_conditions(call.project, call.where, *of_flow)
    if any(of_heat := _removed(call, t.TEMPERATURE, t.FLUID_TEMPERATURE)):
        fdem.heat.remove_conditions(call.project, call.where, *of_heat)
    _free_of_fields(call, t.FIELDS_AT_NODES)


def _free_of_fields(call: Call, conditions: Mapping[str, Model]) -> None:
    for name, condition in conditions.items():
        if any(_removed(call, condition)):
            fdem.fields.remove(call.project, name, call.command.ranged, call.where)


@converter
def free_faces(call: Call) -> None:
    """Release conditions of faces of the physics to which they belong."""
    stress, heat = _removed(call, t.STRESS, t.CONST_HEAT)
    if stress:
        fdem.assignments.remove_face_conditions(call.project, call.where)
    if heat:
        fdem.heat.remove_face_conditions(call.project, call.where)
    _free_of_fields(call, t.FIELDS_AT_FACES)


@converter
def free_bolt_nodes(call: Call) -> None:
    """Release the components that the conditions prescribe."""
    motion, force = _removed(call, t.BOLT_VELOCITY, t.BOLT_FORCE)
    stems = () if motion and force else ("does", "at") if motion else ("force",)
    fdem.supports.remove_conditions(call.project, g.BOLT_NODE, call.where, stems)


@converter
def initial_nodes(call: Call) -> None:
    """Assign initial values of nodes of the physics to which they belong."""
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
    for field in t.FIELDS_AT_NODES:
        if field in call.arguments:
            fdem.fields.initial(call.project, field, call[field], call.where)


@converter
def initial_fluid(call: Call) -> None:
    """Assign initial pressure or saturation, and temperature."""
    if "flow-node-saturation" in call.arguments:
        fdem.flow.initial(call.project, saturation=call["flow-node-saturation"], where=call.where)
    if "flow-node-temperature" in call.arguments:
        fdem.heat.initial_fluid(call.project, call["flow-node-temperature"], call.where)


@converter
def node_history(call: Call) -> None:
    """Record the temperature of a node."""
    fdem.histories.create(call.project, call["name"], g.NODE, "temperature", how="mean", every=call.get("every", 1),
                          where=call.where)  # fmt: skip


@converter
def stage(call: Call) -> None:
    """Tables, and no functions of place."""
    for name, value in call.arguments.items():
        if isinstance(value, FunctionName):
            raise CommandError(
                f"{name} of a stage must be a number or a table over the time of flow, not a function of position"
            )
    fdem.flow.stage(call.project, **call.given())


@converter
def random_field(call: Call) -> None:
    """The word that is there names the distribution."""
    given = call.given()
    distribution = next(name for name in ("weibull", "normal", "lognormal") if name in given)
    first, second = given.pop(distribution)
    if "correlation" in given:
        given.setdefault("covariance", "exponential")
    fdem.assignments.random_field(call.project, **given, distribution=distribution, first=first, second=second)


@converter
def history(call: Call) -> None:
    """Create a history; one of several words reduces several numbers to one value."""
    given = call.given("object")
    how = next((word for word in ("sum", "mean", "minimum", "maximum") if given.pop(word, False)), "")
    kind = {"joint": g.JOINT}.get(call["object"], call["object"])
    given["value"] = python(given["value"])
    fdem.histories.create(call.project, kind=kind, how=how, where=call.where, **given)


@converter
def option(call: Call) -> None:
    """Creep is a command of its own."""
    if call.get("ecda") is False:
        raise CommandError(
            "ecda off is not available: the faces of an intact joint are not contacts, its penalty-overlay separates "
            "them. Use ecda on"
        )
    bare = ["collision"] if call.get("collision") == () else []  # the word before ecda
    if given := call.given("creep", "ecda", *bare):
        fdem.settings.option(call.project, **given)
    if "creep" in call.arguments:
        fdem.settings.creep(call.project, call["creep"])


@converter
def table(call: Call) -> None:
    """Pairs of numbers, and from when times count."""
    given = call.given()
    numbers, kind = given.get("data"), given.get("type", {})
    if numbers is not None and len(numbers) % 2:
        raise CommandError(f"data are pairs of numbers, time and value; got {len(numbers)} numbers")
    if "type" in given and len(kind) != 1:
        raise CommandError("type is relative-time or absolute-time")
    pairs = None if numbers is None else list(zip(numbers[::2], numbers[1::2]))
    fdem.assignments.table(call.project, given["name"], pairs, "relative_time" in kind if kind else None)


@converter
def solve(call: Call) -> None:
    """Solve by steps, or one of the physics with implicit steps."""
    part = next((word for word in ("elastic", "hydraulic", "thermal") if word in call.arguments), "")
    getattr(fdem.steps, f"solve_{part}" if part else "solve")(call.project, **call.given(part))


# ---- the way to the function -----------------------------------------------------------------------------------------


def carry_out(call: Call) -> None:
    """Call the function of a command, then check its values against the declared units. A word without effect is
    reported once."""
    command = call.command
    if command.idle:
        if call.project.log is not None:
            call.project.log.warn_once(command.name, f"{command.name} has no effect here: {command.idle}")
        return
    CONVERTERS.get((call.model or command).does, by_name)(call)
    if call.project.units:
        units.check(call.project.units, call.project.log, _measured(call))


def _measured(call: Call) -> Iterator[units.Given]:
    """Values of a command and of its model that have a unit."""
    given = {**call.arguments, **call.arguments.get("properties", {})}
    options = [*call.command.leading, *call.command.options]
    if call.model is not None:
        options += (*call.model.leading, *call.model.options)
    for option in options:
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
"""Information required of commands that were executed before the checkpoint: the files that they read or wrote."""
