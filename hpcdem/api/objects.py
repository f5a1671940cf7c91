"""Base classes of methods for blocks: how a method calls a command, objects with their quantities, and methods that do
more than pass arguments to a command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from hpcdem.api.arguments import arguments, chosen_by, model_arguments
from hpcdem.api.methods import commands
from hpcdem.api.types import Number, Point, Solved, Where
from hpcdem.commands import fdem
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import quoted
from hpcdem.core.place import place
from hpcdem.lang.pcdc.bindings import Call, carry_out
from hpcdem.lang.pcdc.keywords import matching
from hpcdem.lang.pcdc.kinds import FunctionName
from hpcdem.lang.pcdc.table import PCDC, RECORDED
from hpcdem.lang.pcdc.views import Accounts
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.tables import AXES, Drawn, Over

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project

OBJECTS = {"node": g.NODE, "element": g.ELEMENT, "joint": g.JOINT, **{k: k for k in (*g.SUPPORTS, *g.FLOW)}}
"""Names of objects in histories."""
HOW = ("sum", "mean", "minimum", "maximum")
"""Reductions of several numbers to one value of a history."""


class Orders:
    """Path from a method to the function of its command. project: returns the blocks, made on the first call; before:
    called before their steps.
    """

    def __init__(self, project: Callable[[], Project], before: Callable[[], None] = lambda: None) -> None:
        self.project, self.before = project, before

    def __call__(
        self, command: str, given: Mapping[str, Any], where: Where = None, kind: str = "", model: str | None = None
    ) -> None:
        """Carry out a command. kind: of the objects that `where` chooses; model: the constitutive model, or the
        condition, whose properties are given."""
        if command in ("model step", "model solve"):
            self.before()
        project = self.project()  # first: kernels are settled before modules that have some are imported
        row = PCDC.command(command)
        chosen = chosen_by(where, kind)
        if model is None:
            found = arguments(row, given, chosen is not None, project.dim)
        else:
            found = model_arguments(row, model, given, project.dim)
        project.line = place()[1]
        carry_out(Call(project, row, found, chosen))


class Words:
    """Methods for one kind of object. _word: name in a program, ``sim.<word>``."""

    _word = ""

    def __init__(self, do: Orders) -> None:
        self._do = do


@commands
class Objects(Words):
    """Elements, faces, joints or nodes: `sim.elements["stress-xx"]` returns a quantity of all of them.

    where: text of a RANGE (``"group 'platen' set 'bc'"``, ``"x 0 1 present"``) or terms of `hpcdem.physics.fdem.groups`
    (default: all).
    """

    kind: str

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity of all of them (n,), in the order of numbers, on every rank; names as in histories. Collective."""
        return self.values(name)

    def _ipython_key_completions_(self) -> list[str]:
        return quantities(self.kind)

    def numbers(self, where: Where = None) -> np.ndarray:
        """Return the ascending numbers of the existing objects. Collective."""
        return fdem.queries.numbers(self._do.project(), self.kind, chosen_by(where, self.kind))

    def values(self, name: str, where: Where = None) -> np.ndarray:
        """Return a quantity by name, in the order of `numbers`; NaN where undefined. Collective."""
        chosen = chosen_by(where, self.kind)
        return fdem.queries.values(self._do.project(), self.kind, _quantity(name), chosen)

    def total(self, name: str, where: Where = None) -> float:
        """Return the exact sum of a quantity. Collective."""
        chosen = chosen_by(where, self.kind)
        return fdem.queries.total(self._do.project(), self.kind, _quantity(name), chosen)

    def _take_back(self, conditions: Sequence[str], where: Where) -> None:
        """Conditions by their names, short or in full; all, if none is named."""
        command = f"{self.kind} boundary remove"
        rows = PCDC.command(command).options
        names = [next((row.name for row in matching(one.replace("_", "-"), rows)), one) for one in conditions]
        self._do(command, dict.fromkeys(names, True), where, self.kind)


@commands
class Conditioned(Objects):
    """Objects with conditions that can be removed."""

    def remove_boundary(self, *conditions: str, where: Where = None) -> None:
        """Remove boundary conditions. conditions: only these, by the names of the command ... boundary of PCDC
        (default: all).
        """
        self._take_back(conditions, where)


@commands
class Stressed(Objects):
    """Elements."""

    def initial_stress(
        self,
        *,
        xx: float | None = None,
        yy: float | None = None,
        xy: float | None = None,
        zz: float | None = None,
        xz: float | None = None,
        yz: float | None = None,
        gradient: Mapping[str, Point] | None = None,
        where: Where = None,
    ) -> None:
        """Set the initial stress [Pa], tension positive. Omitted components are 0, but in the plane zz is then that of
        plane strain, Poisson's ratio times xx + yy (in plane stress 0). gradient: by component, per metre in x and y
        (and z) [Pa/m], ``{"yy": (0.0, 25e3)}``.
        """
        stress = {"xx": xx, "yy": yy, "xy": xy, "zz": zz, "xz": xz, "yz": yz}
        slopes = dict(gradient or {})
        for name in slopes:
            if stress.get(name) is None:
                raise ValueError(f"gradient: there is no stress {name!r} that it could be added to")
        given = {
            f"stress_{name}": None if value is None else {"value": value, "gradient": slopes.get(name)}
            for name, value in stress.items()
        }
        self._do("element initial", given, where, self.kind)


@commands
class Fluxed(Conditioned):
    """Faces."""

    def field(
        self,
        name: str,
        *,
        flux: Number | None = None,
        transfer: float | None = None,
        environment: Number | None = None,
        where: Where = None,
    ) -> None:
        """Prescribe the inflow of a field of elements, for example "moisture", through faces, or exchange with an
        environment of this value; transfer: inflow over the difference to the environment (default: coefficient of the
        elements). Values are numbers or names of tables over the time of the field. Without a range: the whole surface
        of the model.
        """
        given = {"flux": flux, "transfer": transfer, "environment": environment}
        self._do("element-face boundary", given, where, self.kind, f"{name}-flux-boundary-condition")


@commands
class Moved(Conditioned):
    """Nodes."""

    def function(self, function: str) -> FunctionName:
        """Read, check and compile a user function of position and time in a Python file, "file.py:function"
        (docs/user_laws.md), as a value for conditions of nodes and faces. Before `sim.restore` it names the function.
        """
        self._do("node function", {"function": function})
        return FunctionName(function)

    def move(self, type: int, along: Point | None = None, *, where: Where = None) -> None:
        """Constrain nodes: 0 free, 1 fixed, 2 free only along a vector, 3 (in three dimensions) free only across it."""
        given = {"type": (type,) if along is None else (type, along)}
        self._do("node boundary", given, where, self.kind, "mechanical-move-boundary-constraint")

    def field(self, name: str, value: Number, *, where: Where = None) -> None:
        """Prescribe the value of a field of elements, for example "moisture": a number or the name of a table over the
        time of the field.
        """
        self._do("node boundary", {name: value}, where, self.kind, f"{name}-boundary-condition")

    def initial_field(self, name: str, value: float, *, where: Where = None) -> None:
        """Set the present value of a field of elements, for example "moisture"; the elements around the nodes are then
        free of stress caused by it.
        """
        self._do("node initial", {name: value}, where, self.kind)


@commands
class GroupedElsewhere(Objects):
    """Objects that use the groups of other objects. grouped: name of those objects."""

    grouped = ""

    def group(self, group: str, set: str | None = None, *, where: Where = None) -> None:
        """Raise CommandError: these objects belong to the groups of nodes or joints, see `sim.nodes.group`,
        `sim.joints.group`."""
        name = self._word.replace("_", " ")
        raise CommandError(f"{name} have the groups of {self.grouped}: sim.{self.grouped}.group")


@commands
class Named(Words):
    """Wells."""

    _word = "wells"

    def __getitem__(self, name: str) -> dict[str, float]:
        found = fdem.queries.wells(self._do.project())
        if name not in found:
            raise CommandError(f"there is no well '{name}'; available: {quoted(found)}")
        return found[name]


@commands
class Tabled(Words):
    """Tables."""

    _word = "tables"

    def create(self, name: str, values: Sequence[Point], *, relative: bool | None = None) -> None:
        """Create a table of (x, value), with x = time [s], coordinate [m] or plastic strain, ascending. relative: times
        count from the moment at which a condition begins to use the table.
        """
        if relative is None:
            self._do("table create", {"name": name, "values": values})
            return
        word = "relative-time" if relative else "absolute-time"
        numbers = [number for pair in values for number in pair]
        self._do("table", {"name": name, "data": numbers, "type": {"value": True, word: True}})

    def over(self, name: str, axis: str) -> Over:
        """Return the value of a property that follows a table over "x", "y" or in space "z" in the mesh, over
        "plastic-strain" (softening or hardening), or over "temperature" (moduli and strengths).
        """
        if axis not in AXES:
            raise ValueError(f"axis: expected {', '.join(map(repr, AXES))}, got {axis!r}")
        return Over(name, AXES.index(axis))


@commands
class Random(Words):
    """Random fields."""

    _word = "fields"

    def drawn(self, name: str) -> Drawn:
        """Return the value of a property that is drawn from this field."""
        return Drawn(name)


@commands
class Recorded(Words):
    """Histories."""

    _word = "histories"

    def __getitem__(self, name: str) -> np.ndarray:
        rows = fdem.histories.find(self._do.project(), name).rows
        return np.array(rows, np.float64).reshape(-1, 3)

    def create(
        self,
        name: str,
        object: str,
        value: str,
        *,
        id: int | None = None,
        nearest: Point | None = None,
        how: str | None = None,
        every: int | None = None,
        variable: str | None = None,
        well: str | None = None,
        where: Where = None,
    ) -> None:
        """Record a value of a "node", "element", "joint", a part of bolts or liners ("bolt-node", "liner-element"), a
        "flow-node", a "flow-channel", a "well" (well: its name) or of the "model", at an interval of steps: of one
        object (id, or nearest to a point), or of those of a range or of all by how: "sum", "mean", "minimum",
        "maximum". variable: for the value "law-state", the state variable of user laws.
        """
        words = value.replace("_", "-") if isinstance(value, str) else value
        given = {"name": name, "object": object, "value": words, "id": id, "nearest": nearest, "every": every,
                 "variable": variable, "well": well}  # fmt: skip
        if how is not None and how not in HOW:
            raise ValueError(f"how: expected one of {', '.join(HOW)}, got {how!r}")
        if how is not None:
            given[how] = True
        self._do("history create", given, where, OBJECTS.get(object, g.NODE))


@commands
class Clocks(Words, Accounts):
    """The parts of a calculation, and the state of the blocks."""

    def _now(self, ask: Callable[[Any], Any]) -> Any:
        return ask(self._do.project())

    def cycle_option(self, part: str, *, time_step: float | None = None, cycle_number: int | None = None) -> None:
        """Set the time step [s] and the number of steps of a part ("mechanical", "thermal", "hydraulic",
        "proppant-transport") in a cycle of a coupled calculation.
        """
        self._of_part("model cycle-option", part, time_step=time_step, cycle_number=cycle_number)

    def reset_clock(
        self,
        part: str,
        *,
        current_time: float | None = None,
        start_time: float | None = None,
        time_step: float | None = None,
    ) -> None:
        """Set the clock of a part, the origin of `run_time`, and its time step [s]; parts: see `cycle_option`."""
        self._of_part("model reset", part, current_time=current_time, start_time=start_time, time_step=time_step)

    def report_time(self, part: str) -> None:
        """Log the present time of a part; parts: see `cycle_option`."""
        self._of_part("model query", part, time=True)

    def _of_part(self, command: str, part: str, **given: Any) -> None:
        self._do(command, {part: {"value": True, **{name: v for name, v in given.items() if v is not None}}})

    def field_account(self, name: str) -> dict[str, float]:
        """Return the budget of a field of elements, for example "moisture": given, commands, stored, removed; closing
        error. Collective.
        """
        return fdem.fields.account(self._do.project(), name)

    @property
    def solved(self) -> Solved:
        """Outcome of the last `solve`: reason, ratio (NaN if it was not computed), steps. Empty before the first."""
        return cast(Solved, dict(self._do.project().solved))

    @property
    def block_time(self) -> float:
        """Model time of the blocks [s]."""
        return float(self._do.project().blocks.clock.time)

    @property
    def block_steps(self) -> int:
        """Steps of the blocks."""
        return self._do.project().step


def quantities(kind: str) -> list[str]:
    """Return the names of the quantities of objects of a kind."""
    return list(RECORDED.get("joint" if kind == g.JOINT else kind, ()))


def _quantity(name: str) -> str:
    if not isinstance(name, str):
        raise TypeError(f"expected the name of a quantity, got {name!r}")
    return name.replace("-", "_")
