"""Common parts of supports of rock, which nodes and elements of their own make up: bolts, liners.

All ranks have all of them: per step they hand each other where the rock is at the nodes, one reduction of integers, and
then compute the same. So the bits depend on neither ranks nor threads.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numba import njit

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.node_set import ALPHA
from hpcdem.physics.fdem.properties import Model
from hpcdem.physics.fdem.surface_loads import SurfaceLoad

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

Number = float | str
"""A number, or the name of a table over model time."""
MARGIN = 1.25
"""Reserve of the fictitious masses of the static mode, as for elements."""
FREE, VELOCITY, ACCELERATION = 0, 1, 2
"""What a component of a node does."""
REMOVED = 32
"""Bit of the state of an element: it was deleted. Its number stays."""
Columns = Mapping[str, tuple[type, int]]
"""Type and width of columns by name, width 0: (n,)."""


class Prescribed(SurfaceLoad):
    """Conditions at the nodes of a structure. nodes: columns by name, among them the row of `conditions`."""

    blocks: Blocks
    nodes: dict[str, np.ndarray]
    conditions: list[Any]
    word: ClassVar[str]
    """What one of them is called."""
    condition_type: ClassVar[type]
    """Dataclass of what is prescribed at a node: does_*, at_* in the middle of a step; the rest at its time."""

    parts: ClassVar[tuple[str, str]]
    """The kinds of object (groups.py) that its elements and its nodes are."""

    @abstractmethod
    def alive(self, kind: str) -> np.ndarray:
        """(n,) bool: elements that were not deleted, or nodes of such. Not collective."""

    def condition(self, nodes: np.ndarray, **changes: Any) -> None:
        """Prescribe components of nodes (k,), see the class of conditions; the others stay as they are."""
        for value in changes.values():
            if isinstance(value, str) and value not in self.blocks.tables:
                known = ", ".join(f"'{name}'" for name in self.blocks.tables) or "none so far"
                raise CommandError(f"there is no table '{value}'; available: {known}")
            if not isinstance(value, str) and not math.isfinite(value):
                raise CommandError(f"a condition of a {self.word} must be finite, got {value:g}")
        self.blocks.before_change()
        column = self.nodes["condition"]
        for row in np.unique(column[nodes]).tolist():
            wanted = replace(self.conditions[row], **changes)
            if wanted not in self.conditions:
                self.conditions.append(wanted)
            column[nodes[column[nodes] == row]] = -1 - self.conditions.index(wanted)
        column[column < 0] = -1 - column[column < 0]
        self.blocks.changed(stiffness=False)

    def remove_conditions(self, nodes: np.ndarray) -> None:
        """Take back what was prescribed at nodes (k,)."""
        self.blocks.before_change()
        self.nodes["condition"][nodes] = 0
        self.blocks.changed(stiffness=False)

    def uses_table(self, name: str) -> bool:
        """Return whether a node follows this table. Not collective."""
        used = {self.conditions[row] for row in np.unique(self.nodes["condition"]).tolist()}
        return any(name in asdict(one).values() for one in used)

    def driven(self) -> int | None:
        """The first node that is made to move. Not collective."""
        for node in np.flatnonzero(self.alive(self.parts[1])).tolist():
            condition = asdict(self.conditions[self.nodes["condition"][node]])
            if any(name.startswith("does_") and does != FREE and condition[f"at_{name[5:]}"] != 0.0
                   for name, does in condition.items()):  # fmt: skip
                return node
        return None

    def _conditions_at(self, time: float, middle: float) -> np.ndarray:
        """Prescribed conditions (n, entries of a condition): forces at `time`, motion in the middle of a step."""
        tables = self.blocks.tables
        names = [one.name for one in fields(self.condition_type)]

        def now(condition: Any, name: str) -> float:
            value = getattr(condition, name)
            when = middle if name.startswith("at_") else time
            return tables[value](when) if isinstance(value, str) else value

        used, row = np.unique(self.nodes["condition"], return_inverse=True)
        rows = np.array([[now(self.conditions[k], name) for name in names] for k in used.tolist()], np.float64)
        return rows.reshape(-1, len(names))[row.reshape(-1)]

    def _does(self) -> np.ndarray:
        """(n, components of a condition) bool: motion that is prescribed."""
        names = [one.name for one in fields(self.condition_type) if one.name.startswith("does_")]
        rows = [[getattr(one, name) for name in names] for one in self.conditions]
        return (np.array(rows) != FREE)[self.nodes["condition"]]


class Structure(Prescribed):
    """All supports of a kind in a model of blocks. nodes, elements: columns by name, equal on all ranks. Methods are
    collective unless they say otherwise; CommandError, alike on all ranks, for what makes no sense."""

    of_mesh: ClassVar[bool] = True
    quantities: ClassVar[Mapping[str, Mapping[str, tuple[str, str]]]]
    """What can be asked of them, by kind of object: unit and meaning."""
    of_nodes: ClassVar[Columns]
    of_elements: ClassVar[Columns]
    model: ClassVar[Model]
    held: ClassVar[str]
    """Columns with the `host` in the rock: "nodes" or "elements"."""
    at_rest: ClassVar[Mapping[str, int]]
    """Columns of nodes whose elements were all deleted."""
    flows: ClassVar[tuple[str, ...]]
    """Entries of its work: on the rock first; those that begin with work_of bring energy in, the others take it."""
    _on_rock: np.ndarray
    """Forces (points, d) on the rock."""
    _rock: np.ndarray
    """Displacements (points, d) of the rock in a step [m]."""
    _true_mass: np.ndarray

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks
        self.nodes, self.elements = (empty(of(blocks.dim), 0) for of in (self.node_columns, self.element_columns))
        self.rows: list[tuple[float, ...]] = []
        self.conditions = [self.condition_type()]
        self.work = np.zeros(len(self.flows))
        self.commands = 0.0
        self._stored_at_start = 0.0
        self._account: Any = None
        self._dynamic = blocks.options.dynamic
        self._prepared_for: tuple[float, bool, float] | None = None
        self._reported = 0.0
        self._arrange()

    def __len__(self) -> int:
        return len(self.nodes["x"])

    @classmethod
    def node_columns(cls, dim: int) -> Columns:
        """Columns of the nodes in a model of so many dimensions."""
        return cls.of_nodes

    @classmethod
    def element_columns(cls, dim: int) -> Columns:
        """Columns of the elements in a model of this number of dimensions."""
        return cls.of_elements

    # ---- what each kind does its way -----------------------------------------------------------------------------

    @abstractmethod
    def _arrange(self) -> None:
        """Compute everything that follows from columns, properties and hosts."""

    @abstractmethod
    def _find_forces(self) -> None:
        """Forces on nodes and rock, of the present positions and moment."""

    @abstractmethod
    def _stored(self) -> float:
        """Energy [J/m]. Not collective."""

    @abstractmethod
    def _kinetic(self, dt: float) -> np.ndarray:
        """Energy (n,) of the motion of nodes [J/m], in steps of dt [s] with the present masses: m v- v+ / 2 of the
        velocities before and after this moment (energy.py); of nodes with a prescribed motion m v- v- / 2."""

    @abstractmethod
    def _half_step(self, dt: float) -> np.ndarray:
        """Work (flows,) in the half step before this moment [J/m]: a step books what the forces at its beginning do
        around it, and this moment has no step yet (energy.py). Zero in static runs."""

    @abstractmethod
    def _node_value(self, name: str) -> np.ndarray:
        """A quantity of all nodes, see also `_vector`."""

    @abstractmethod
    def _element_value(self, name: str) -> np.ndarray:
        """A quantity of all elements."""

    @abstractmethod
    def _hosts(self) -> np.ndarray:
        """Elements of the rock that hold its points, -1: none."""

    @abstractmethod
    def _unbind(self, lost: np.ndarray) -> None:
        """No rock holds these of `held` (n,) any more."""

    @abstractmethod
    def _weigh(self, factor: float, true: float) -> tuple[np.ndarray, str]:
        """Set the masses of nodes: `factor` times their stiffness, at least `true` times their own. Returns them, and
        more to tell of them."""

    @abstractmethod
    def _seen(self) -> np.ndarray:
        """Return what points see of the rock that holds them, where this rank owns it; zeros elsewhere."""

    @abstractmethod
    def _move(self, seen: np.ndarray, conditions: np.ndarray, alpha: float, work: np.ndarray) -> None:
        """Move nodes and stretch elements over a step, after rock of which points see `seen`."""

    @abstractmethod
    def ends(self) -> np.ndarray:
        """(m, k) nodes of each element. Not collective."""

    @abstractmethod
    def _let_go(self, elements: np.ndarray) -> None:
        """Elements (k,) are about to be deleted: they carry nothing and are bound to nothing any more."""

    @abstractmethod
    def assign(self, elements: np.ndarray, given: Mapping[str, float]) -> None:
        """Give elements (k,) properties; what they carry stays."""

    # ---- account of energy -------------------------------------------------------------------------------------------

    def energies(self) -> dict[str, float]:
        """Energy [J/m] since the account began: stored in elements and in grout or bond and as motion, and at_start;
        lost (yield, slip, opening, dashpots); work on the rock, of conditions and gravity; commands (pretension and
        other changes); closing: what does not add up, and relative: that over the largest. Not collective."""
        work = (self.work + self._half_step(self.blocks.clock.dt)).tolist()
        stored = self._stored()
        found = {"stored": stored, "at_start": self._stored_at_start, **dict(zip(self.flows, work, strict=True)),
                 "commands": self.commands}  # fmt: skip
        return closed(found, stored - self._stored_at_start - self.commands - self._brought(work))

    def _brought(self, work: Iterable[float]) -> float:
        """Work that the flows named in entries bring in, less the work they take [J/m]."""
        return math.fsum(w if name.startswith("work_of") else -w for name, w in zip(self.flows, work, strict=True))

    def _accounted(self) -> float:
        """The part of the account that commands may change [J/m]. Not collective."""
        return self._stored() - self._brought(self._half_step(self.blocks.clock.dt).tolist())

    def _moving(self, dt: float) -> float:
        """The part of it that depends on the time step and on masses."""
        return float(self._kinetic(dt).sum()) - self._brought(self._half_step(dt).tolist())

    @contextmanager
    def _booked(self) -> Iterator[None]:
        """Book the changes made here, and their consequences, as `commands` of the budget."""
        before = self._accounted() if self._account is not None else 0.0
        yield
        self._arrange()
        if self._account is not None:
            self.commands += self._accounted() - before

    # ---- what is given ----------------------------------------------------------------------------------------------

    def alive(self, kind: str) -> np.ndarray:
        there = self.elements["state"] & REMOVED == 0
        if kind == self.parts[0]:
            return there
        out = np.zeros(len(self), bool)
        out[self.ends()[there].reshape(-1)] = True
        return out

    def _add(self, nodes: Mapping[str, np.ndarray], elements: Mapping[str, np.ndarray]) -> tuple[Any, Any]:
        """More of them; the numbers of these nodes and elements."""
        n, m = len(self), len(self.elements["row"])
        self.blocks.before_change()
        self.nodes = {name: np.concatenate([old, nodes[name]]) for name, old in self.nodes.items()}
        self.elements = {name: np.concatenate([old, elements[name]]) for name, old in self.elements.items()}
        self._arrange()
        self.blocks.changed()
        return np.arange(n, len(self)), np.arange(m, len(self.elements["row"]))

    def delete(self, elements: np.ndarray) -> None:
        """Take elements (k,) out, at once. The numbers of the others stay."""
        blocks = self.blocks
        blocks.before_change()
        with self._booked():
            self._let_go(elements)
            self.elements["state"][elements] |= REMOVED
            lost = ~self.alive(self.parts[1])
            for name, nothing in self.at_rest.items():
                self.nodes[name][lost] = nothing
        blocks.changed()

    def stop(self) -> None:
        """Velocities become zero. Not collective."""
        self.nodes["v"][:] = 0.0

    def check_start(self) -> None:
        """CommandError if an element has no model yet. Not collective."""
        bare = np.flatnonzero((self.elements["row"] == 0) & self.alive(self.parts[0]))
        if len(bare):
            raise CommandError(
                f"{self.parts[0]} {bare[0]} has no model ({len(bare)} in all): assign {self.word} c-model first"
            )

    def _take_properties(self, elements: np.ndarray, values: Mapping[str, float]) -> None:
        """Elements have the row of these complete properties."""
        row = tuple(values.values())
        if row not in self.rows:
            self.rows.append(row)
        self.elements["row"][elements] = self.rows.index(row) + 1

    def _column(self, name: str, otherwise: float = 0.0) -> np.ndarray:
        """A property of all elements (m,), `otherwise` where there is no model yet."""
        k = [one.name for one in self.model.properties].index(name)
        return np.array([otherwise, *(row[k] for row in self.rows)])[self.elements["row"]]

    def _time_before(self) -> float:
        """Time at which tables were read before the last step of the blocks."""
        blocks = self.blocks
        if blocks.options.dynamic:
            return blocks.clock.time - blocks.clock.dt
        return blocks.time_now() - (0.0 if blocks.creep.on else 1.0)

    # ---- queries -----------------------------------------------------------------------------------------------------

    def values(self, kind: str, name: str, numbers: np.ndarray | None = None) -> np.ndarray:
        """A quantity of nodes or elements (None: all), on all ranks. Not collective."""
        self.check(kind, name)
        found = self._node_value(name) if kind == self.parts[1] else self._element_value(name)
        return np.asarray(found if numbers is None else found[numbers], np.float64)

    def _vector(self, name: str) -> np.ndarray | None:
        """A component of a vector of nodes; None for other quantities."""
        nodes, (stem, _, axis) = self.nodes, name.rpartition("_")
        c = "xyz".find(axis)
        if stem == "displacement":
            return nodes["x"][:, c] - nodes["origin"][:, c]
        column = {"position": "x", "velocity": "v", "reaction": "reaction"}.get(stem)
        return None if column is None else nodes[column][:, c].copy()

    def columns(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns of frames: all quantities of "elements" and "nodes". Not collective."""
        return {
            table: {name: self.values(kind, name) for name in self._known(kind)}
            for table, kind in zip(("elements", "nodes"), self.parts, strict=True)
        }

    def check(self, kind: str, name: str) -> None:
        """CommandError if there is no such quantity here. Not collective."""
        known = self._known(kind)
        if name not in known:
            raise CommandError(f"there is no quantity {name} of a {kind}; available: {', '.join(known)}")

    def _known(self, kind: str) -> list[str]:
        """Quantities that can be queried; none along z in two dimensions."""
        return [name for name in self.quantities[kind] if self.blocks.dim == 3 or not name.endswith("_z")]

    def work_done(self) -> float:
        """On the rock, since the account of energy began [J/m]. Not collective."""
        return float(self.work[0])

    # ---- called by the blocks ----------------------------------------------------------------------------------------

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners."""
        blocks = self.blocks
        if blocks.options.dynamic != self._dynamic:  # velocities of the static mode are ways per step
            self._dynamic = blocks.options.dynamic
            self.stop()
        self._mine, self._rows = self._held_here()
        self._find_forces()
        if self._account is not blocks.budget:
            self._account = blocks.budget
            self.commands, self._stored_at_start = 0.0, self._stored()  # sets the masses of this time step
            self.work[:] = -self._half_step(blocks.clock.dt) if self._account is not None else 0.0

    def _held_here(self) -> tuple[np.ndarray, np.ndarray]:
        """Return which of its points are held by an element that this rank owns, and the storage rows of these."""
        blocks, host = self.blocks, self._hosts()
        row = np.where(host >= 0, blocks.where[host], -1)
        at = np.flatnonzero((row >= blocks.owned.start) & (row < blocks.owned.stop))
        return at, row[at]

    def _set_masses(self) -> None:
        """Masses of nodes for this time step: 2 k / m bounds omega^2. In dynamic runs they are raised where the step
        would not be stable, in static ones fictitious."""
        o, dt = self.blocks.options, self.blocks.clock.dt
        if self._prepared_for == (dt, o.dynamic, o.safety):
            return
        was, self._prepared_for = self._prepared_for, (dt, o.dynamic, o.safety)
        before = self._moving(was[0]) if was is not None else 0.0
        if not o.dynamic:
            self._weigh(0.5 * MARGIN * (1.0 + ALPHA), 0.0)
            return
        mass, more = self._weigh(0.5 * (dt / o.safety) ** 2, 1.0)
        if was is not None and self._account is not None:
            self.commands += self._moving(dt) - before
        self._report_mass(mass, more)

    def follow(self) -> None:
        """The rock has moved: move the nodes over the same step, and find the new forces."""
        blocks, clock = self.blocks, self.blocks.clock
        if not len(self):
            return
        with blocks.timers("force"):
            self._set_masses()
            seen = self._seen()
        if blocks.comm.size > 1:
            with blocks.timers("reduce"):
                blocks.comm.sum_into(seen.view(np.int64))  # one rank has each row, the others zero: exact
        with blocks.timers("force"):
            static, time = not blocks.options.dynamic, self._time_before()
            conditions = self._conditions_at(time, time if static else clock.time - 0.5 * clock.dt)
            work = self.work if self._account is not None and not static else np.zeros(len(self.flows))
            before = self._on_rock.copy()
            self._move(seen, conditions, ALPHA if static else 0.0, work)
            self._find_forces()
            work_on_rock(before, self._on_rock, self._rock, work)

    def elements_removed(self, elements: np.ndarray) -> None:
        """Release the nodes that these elements of the rock held."""
        lost = np.isin(getattr(self, self.held)["host"], elements)
        if not lost.any():
            return
        with self._booked():
            self._unbind(lost)
        if self.blocks.log is not None:
            self.blocks.log.info(f"{int(lost.sum())} {self.word} {self.held} lost their rock, which was removed")

    def mesh_replaced(self) -> None:
        """Handle a replaced mesh: `of_mesh` says that these are gone with the one before."""

    def _report_mass(self, mass: np.ndarray, more: str) -> None:
        """Say once in a while how much mass the time step adds to the nodes."""
        log, dt, true = self.blocks.log, self.blocks.clock.dt, self._true_mass
        if log is None or not true.any():
            return
        added = float((mass - true).sum() / true.sum())
        if abs(added - self._reported) > 0.1 * self._reported:
            log.info(
                f"{self.name}: the time step {dt:.4g} s would be too large for {int((mass > true).sum())} of "
                f"{len(mass)} nodes; mass scaling adds {added:.3g} times the mass of the {self.name}{more}"
            )
            self._reported = added

    # ---- state on disk -----------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """Return the state without its columns, as JSON values."""
        return {
            "rows": [list(row) for row in self.rows], "conditions": [asdict(one) for one in self.conditions],
            "work": self.work.tolist(), "commands": self.commands, "start": self._stored_at_start,
            "dynamic": self._dynamic,
        }  # fmt: skip

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """The columns of nodes and elements, by the name of their table."""
        return {f"{self.word}_nodes": _flat(self.nodes), f"{self.word}_elements": _flat(self.elements)}

    @classmethod
    def restored(cls, blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]]) -> None:
        """Inverse of both: the blocks, whose budget is back already, have these."""
        made = cls.of(blocks)
        made.nodes = _wide(tables[f"{cls.word}_nodes"], cls.node_columns(blocks.dim))
        made.elements = _wide(tables[f"{cls.word}_elements"], cls.element_columns(blocks.dim))
        made.rows = [tuple(row) for row in state["rows"]]
        made.conditions = [cls.condition_type(**one) for one in state["conditions"]]
        made.work = np.array(state["work"])
        made.commands, made._stored_at_start = state["commands"], state["start"]
        made._dynamic, made._account = state["dynamic"], blocks.budget
        made._arrange()


@njit(cache=True, nogil=True, error_model="numpy")
def work_on_rock(before: np.ndarray, after: np.ndarray, rock: np.ndarray, work: np.ndarray) -> None:
    """Add what the mean of the forces (points, d) at both ends of a step did on the rock to the first flow."""
    for q in range(len(rock)):
        for c in range(rock.shape[1]):
            work[0] += 0.5 * (before[q, c] + after[q, c]) * rock[q, c]


def wide(k: int) -> tuple[int, ...]:
    """Further shape of a column of width k."""
    return (k,) if k else ()


def empty(kinds: Columns, n: int) -> dict[str, np.ndarray]:
    """Columns of n zeros."""
    return {name: np.zeros((n, *wide(k)), of) for name, (of, k) in kinds.items()}


def _flat(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    out: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        if values.ndim == 1:
            out[name] = values
        else:
            out.update({f"{name}_{c}": values[:, c].copy() for c in range(values.shape[1])})
    return out


def _wide(columns: Mapping[str, np.ndarray], kinds: Columns) -> dict[str, np.ndarray]:
    out: dict[str, np.ndarray] = {}
    for name, (of, width) in kinds.items():
        found = np.column_stack([columns[f"{name}_{c}"] for c in range(width)]) if width else columns[name]
        out[name] = np.ascontiguousarray(found.astype(of))
    return out
