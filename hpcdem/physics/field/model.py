"""Base of every field on blocks: properties and conditions by numbers of the mesh, a clock, a budget, nodes that move
between ranks.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.halo.copies import Copies, moved
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem.properties import ELEMENT, Model
from hpcdem.physics.fdem.surface_loads import SurfaceLoad
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

MANY = 100_000
"""Number of sub-steps in a cycle above which the input is taken for a mistake."""
CHECK_EVERY = 100
"""Cycles after which a field is checked: whether it has blown up, and how long its sub-steps may be."""
Tables = dict[str, dict[str, np.ndarray]]


class Assigned:
    """Properties of the elements or joints of a model. row (n,): of the table `rows`, by number, 0: none."""

    blocks: Blocks
    of_objects: ClassVar[str] = ELEMENT
    model: ClassVar[Model]
    kind_of_model: ClassVar[str]
    """Name of the model in messages."""
    alike: ClassVar[tuple[str, ...]] = ()
    why_alike: ClassVar[str] = "all channels have the same fluid"
    """Reason, in messages, why a property must be the same in all objects."""
    stiffens: ClassVar[bool] = False
    """Whether assignments change masses or time steps of the blocks."""

    def __init__(self, blocks: Blocks) -> None:
        self.blocks = blocks
        cells = blocks.the_mesh().cells
        self.row = np.zeros(len(cells) if self.of_objects == ELEMENT else cells.size, np.int32)
        self.rows: list[tuple[float, ...]] = []

    @contextmanager
    def changing(self, stiffness: bool = False) -> Iterator[None]:
        """The model is open meanwhile."""
        self.blocks.before_change()
        yield
        self.blocks.changed(stiffness=stiffness)

    def _numbers(self, asked: np.ndarray | None) -> np.ndarray:
        of = self.blocks.numbers_of_elements if self.of_objects == ELEMENT else self.blocks.numbers_of_joints
        return of(asked)

    def _have_it(self) -> np.ndarray:
        """Numbers of all that have the model."""
        return np.flatnonzero(self.row)

    def assign(self, numbers: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Assign the model with these properties to objects (None: all)."""
        at = self._numbers(numbers)
        self._put(at, self.blocks.complete(self.of_objects, at, self.model, {}, given))

    def adjust(self, numbers: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Change some properties of objects that have the model; None: of all that have it."""
        at = self._have_it() if numbers is None else self._numbers(numbers)
        bare = at[self.row[at] == 0]
        if len(bare):
            raise CommandError(
                f"{self.of_objects} {bare[0]} has no {self.kind_of_model} model whose properties could be changed"
            )
        old = dict(zip(self._names, np.array(self.rows)[self.row[at] - 1].T))
        self._put(at, self.blocks.complete(self.of_objects, at, self.model, old, given))

    @property
    def _names(self) -> list[str]:
        return [one.name for one in self.model.properties]

    def _put(self, at: np.ndarray, complete: np.ndarray) -> None:
        """Objects (n,) have these complete properties, (n, k) or (1, k) for all."""
        rows, row = assigned.with_rows(self.rows, self.row, at, complete)
        assigned.refuse_different(rows, row, self._names, self.alike, self.why_alike)
        with self.changing(self.stiffens):
            self.rows, self.row = rows, row
            self._assigned()

    def _assigned(self) -> None:
        """Properties are others; the model is open."""

    def column(self, name: str) -> np.ndarray:
        """A property by rows (rows + 1,), 0 where there is no model. Not collective."""
        k = self._names.index(name)
        return np.array([0.0, *(row[k] for row in self.rows)])

    def constant(self, name: str) -> float:
        """Return the value of a property that all objects have in common. Not collective."""
        return self.rows[self.row[np.argmax(self.row > 0)] - 1][self._names.index(name)]

    def _saved_properties(self) -> list[list[float | None]]:
        return [[v if math.isfinite(v) else None for v in row] for row in self.rows]

    def _restore_properties(self, rows: Sequence[Sequence[float | None]]) -> None:
        """Inverse, also of files that do not know the last ones yet."""
        later = [one.default or 0.0 for one in self.model.properties]
        self.rows = [(*(math.inf if v is None else v for v in row), *later[len(row) :]) for row in rows]


class Travelling(ABC):
    """Nodes of a field that go to the rank that owns the first element around them; those of other ranks beside its
    elements are copies. number (n,): own ones, ascending; state (n + copies, k).

    of_nodes: table of checkpoints with what own nodes hold, its columns by name: the attribute, and its column or -1;
    widths: columns of these attributes, 0: of one dimension.
    """

    of_nodes: ClassVar[str]
    columns: ClassVar[Mapping[str, tuple[str, int]]]
    widths: ClassVar[Mapping[str, int]]
    blocks: Blocks
    state: np.ndarray
    _copies: Copies | None

    def __init__(self) -> None:
        self.number = np.empty(0, np.int64)
        self._copies = None
        self._empty(0, 0)

    def _empty(self, n: int, copies: int) -> None:
        """Room for n own nodes and so many copies, all zero."""
        for name, width in self.widths.items():
            rows = n + copies if name == "state" else n
            setattr(self, name, np.zeros((rows, width) if width else rows))

    def _column(self, name: str) -> np.ndarray:
        attribute, k = self.columns[name]
        values: np.ndarray = getattr(self, attribute)[: len(self.number)]
        return values if k < 0 else values[:, k]

    def _fetch(self, mine: np.ndarray, wanted: np.ndarray, more: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """`mine` are the own nodes from now on, with what all ranks know of them, and copies of those that are wanted,
        and so many more rows of the state. Which of `mine` are new, and those wanted, in the order of their owners.
        Collective."""
        comm, n = self.blocks.comm, len(self.number)
        had = np.column_stack([*(self._column(name) for name in self.columns), np.ones(n)])
        rows, owner = moved(comm, len(self.blocks.the_mesh().points), self.number, had, mine, wanted)
        order = np.lexsort((wanted, owner))
        wanted, owner = wanted[order], owner[order]
        self.close()
        self.number = mine.copy()
        self._empty(len(mine), len(wanted) + more)
        for name, values in zip(self.columns, rows.T):
            self._column(name)[:] = values
        self._copies = Copies(comm, mine, wanted, owner, self.state)
        return rows[:, -1] == 0.0, wanted

    def _forget(self, gone: np.ndarray) -> None:
        """Nodes (n,) bool are no longer there. Collective."""
        if not self.blocks.comm.any(bool(gone.any())):
            return
        self._book_gone(gone)
        self.number = self.number[~gone]
        for name in self.widths:
            setattr(self, name, getattr(self, name)[: len(gone)][~gone])

    @abstractmethod
    def _book_gone(self, gone: np.ndarray) -> None:
        """Book the content of removed nodes (n,) bool. Collective."""

    def _refresh(self) -> None:
        if self._copies is not None:
            self._copies.refresh()

    def close(self) -> None:
        """Give the requests back to MPI."""
        if self._copies is not None:
            self._copies.close()
            self._copies = None

    def saved_rows(self) -> Tables:
        """State of this rank's nodes."""
        held = {name: np.ascontiguousarray(self._column(name)) for name in self.columns}
        return {self.of_nodes: {"number": self.number, **held}}

    def _restore_rows(self, tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse; nodes go to their owners with the first storage."""
        held = tables[self.of_nodes]
        self.number = held["number"].astype(np.int64)
        self._empty(len(self.number), 0)
        for name in self.columns:
            self._column(name)[:] = held[name]


class Field(SurfaceLoad):
    """A field of a model of blocks. Methods are collective unless they say otherwise; CommandError, alike on all ranks,
    for what makes no sense. time: what its clock shows [s]; cycles: done so far, each of sub_steps of dt [s]; waited:
    steps of the blocks since the last."""

    of_mesh: ClassVar[bool] = True
    own_clock: ClassVar[bool] = True
    label: ClassVar[str] = ""
    """Name in messages, if it differs from the name of the field."""
    word: ClassVar[str]
    """Word of commands for its part of the calculation."""
    blocks: Blocks

    def _start_clock(self, time: float) -> None:
        self.time, self.dt = time, 0.0
        self.cycles = self.waited = self.sub_steps = 0

    def set_clock(self, time: float) -> None:
        """The clock shows this time [s]."""
        self.blocks.before_change()
        self.time = time
        self.blocks.changed(stiffness=False)

    def _saved_clock(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("time", "cycles", "waited", "sub_steps", "dt")}

    def _restore_clock(self, state: Mapping[str, Any]) -> None:
        for name in ("time", "cycles", "waited", "sub_steps", "dt"):
            if name in state:
                setattr(self, name, state[name])

    def _divide(self, steps: int, dt: float, period: float, alone: float, within: float, instead: str) -> None:
        """Sub-steps of a cycle and their length by what was given (steps, 0: as many as are needed; dt, 0: by clocks),
        the time of a cycle by the clock of others, 0: none, and the longest sub-steps [s] without and with
        such a clock. CommandError if they are too many, which says how many of which, and what to do `instead`."""
        if dt > 0.0:
            self.sub_steps, self.dt = max(1, steps), dt
        elif period == 0.0:
            self.sub_steps, self.dt = max(1, steps), alone
        else:
            need = period / within if within > 0.0 else math.inf
            self.sub_steps = steps or max(1, math.ceil(min(need, 1e15)))
            self.dt = period / self.sub_steps
        if not steps and self.sub_steps > MANY:
            raise CommandError(
                f"{self.label or self.name} would need {self.sub_steps} sub-steps of {within:.3g} s in {instead}"
            )

    def _unset(self, conditions: np.ndarray, numbers: np.ndarray | None) -> None:
        """Rows of conditions of these numbers (None: all) become 0."""
        self.blocks.before_change()
        conditions[slice(None) if numbers is None else numbers] = 0
        self.blocks.changed(stiffness=False)

    def _sum(self, column: np.ndarray, gone: float = 0.0) -> float:
        """Sum the contents of all ranks and the removed amount."""
        comm = self.blocks.comm
        return exact_sum(np.append(column, gone if comm.rank == 0 else 0.0), comm)

    def _blown_up(self, what: str, stable: float) -> PhysicsError:
        """Return the error for `what` that is not finite; stable: the longest sub-step [s]."""
        return PhysicsError(
            f"step {self.blocks.clock.step}: {what} is not finite; the {self.word} time step {self.dt:g} s is probably "
            f"too large (stable: {stable:g} s)"
        )

    def _lowest(self, numbers: np.ndarray) -> int:
        """Return the lowest of the numbers (n,) of all ranks; -1: none."""
        most = np.iinfo(np.int64).max
        found = int(self.blocks.comm.min_into(np.array([numbers.min(initial=most)], np.int64))[0])
        return found if found < most else -1

    def _gravity(self) -> list[float]:
        """Components of gravity [m/s2]."""
        o = self.blocks.options
        return [o.gx, o.gy, o.gz][: self.blocks.dim]
