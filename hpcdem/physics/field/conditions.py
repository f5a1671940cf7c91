"""Assignments of a field that diffuses in elements: its properties, values at nodes, conditions of nodes and faces, and
the budget. All of it is known to all ranks by the numbers of the mesh.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import reduce
from operator import sub
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import by_temperature, hexahedra
from hpcdem.physics.fdem.conditions import change_rows
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.faces import Exposed
from hpcdem.physics.field.model import Assigned, Field

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks


class Conditions(Assigned, Field):
    """row (ne,): of the table of properties, by element, 0: none; held (np,): row of the prescribed values, 0: none;
    exposed: conditions of faces."""

    quantity: ClassVar[str]
    """Quantity of the field, which is also the name of the column of elements with its values at their corners."""
    unstressed: ClassVar[str]
    """Column of elements: the mean value at which one is free of the stress that the field brings."""
    several: ClassVar[str] = "values"
    low_to_high: ClassVar[str] = "lower to the higher"
    otherwise: ClassVar[str] = ""
    """Further advice in messages about a time step that is too long."""
    expansion: ClassVar[str] = ""
    """Name of the property that is the linear expansion with the field; empty: the field causes no stress."""

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self.given, self.capacities = f"{self.name}_given", f"{self.name}_capacity"
        """Columns of elements, of corners: what conditions gave, and capacity."""
        self.held = np.zeros(len(blocks.the_mesh().points), np.int32)
        self.prescribed: list[Number] = [0.0]
        self.exposed = Exposed(blocks, lambda: self._transfers)
        self.accounts = dict.fromkeys(("given", "commands", "removed"), 0.0)
        """Amounts that conditions gave to removed elements, that commands brought, and that removed elements
        contained."""
        self._expands: bool | None = None

    @property
    def set_step(self) -> str:
        """The command that sets the length of its sub-steps."""
        return f"model field {self.name} time-step"

    @property
    def switch_off(self) -> str:
        """The command by which it stays as it is."""
        return f"model field {self.name} flows off"

    # ---- what a field says of itself -----------------------------------------------------------------------------

    @abstractmethod
    def _capacities(self) -> np.ndarray:
        """Capacities by rows (rows + 1,), per mass of the elements."""

    @abstractmethod
    def _conductivities(self, elements: np.ndarray) -> np.ndarray:
        """Conductivities of elements (n,): xx, yy, xy (n, 3), in space also zz, xz, yz (n, 6)."""

    @property
    def _transfers(self) -> np.ndarray:
        """Transfer coefficients (ne,) of the elements."""
        return np.zeros(len(self.row))

    @property
    def expands(self) -> bool:
        """Elements get stress from it. Not collective."""
        if not self.expansion:
            return False
        if self._expands is None:
            self._expands = bool(self.column(self.expansion)[self.row[self.blocks.alive]].any())
        return self._expands

    # ---- what is assigned and prescribed -------------------------------------------------------------------------

    def assign(self, numbers: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Elements (None: all) have this model; at the values that they have now they are free of the stress that it
        brings."""
        at = self._numbers(numbers)
        super().assign(at, given)
        self._take_unstressed(at)

    def _assigned(self) -> None:
        self._expands = None
        self._make_columns()

    def _make_columns(self) -> None:
        """The columns of elements; the model is open."""
        cold, n = self.blocks.cold, len(self.blocks.number)
        if self.quantity not in cold:
            for name in (self.quantity, self.given, self.capacities):
                cold[name] = np.zeros((n, self.blocks.corners))
            cold[self.unstressed] = np.zeros((n, 1))

    def _take_unstressed(self, elements: np.ndarray) -> None:
        """Make the present temperature of these elements, and of hexahedra that they are parts of, free of thermal
        stress; the model is open. Collective."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        number, t = blocks.number, blocks.cold[self.quantity]
        found = by_temperature.of_corners(mesh, number, t)
        chosen = np.isin(number, elements)
        if len(mesh.hexes):
            of = mesh.macro_of()
            some = np.zeros(len(mesh.hexes) + 1, bool)  # the last one: of no hexahedron
            some[of[elements]] = True
            some[-1] = False
            mine = np.flatnonzero(some[of[number]])
            found[mine] = self._means_of_parts(number[mine], t[mine])
            chosen[mine] = True
        blocks.cold[self.unstressed][chosen, 0] = found[chosen]

    def _means_of_parts(self, number: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Means (n,) of the hexahedra that these elements are parts of, which may be shared out among ranks, as
        `hexahedra.Rows` has them; t (n, 4): temperatures of their corners. Collective."""
        mesh, comm = self.blocks.the_mesh(), self.blocks.comm
        which, at = np.unique(mesh.macro_of()[number], return_inverse=True)
        hexes = mesh.hexes[which]
        _, parts = hexahedra.corner_parts(mesh.points, mesh.cells, hexes)
        own = (parts[at, number - hexes[at, 8]] * t).sum(axis=1)
        pieces = [(number, own)] if comm.size == 1 else comm.allgather((number, own))
        every, first = np.unique(np.concatenate([piece[0] for piece in pieces]), return_index=True)
        means = np.concatenate([piece[1] for piece in pieces])[first].reshape(-1, hexahedra.PARTS).sum(axis=1)
        return means[np.searchsorted(every[:: hexahedra.PARTS], hexes[at, 8])]

    def initial(self, nodes: np.ndarray | None, value: float) -> None:
        """Nodes (None: all) have this value now; elements around them are free of the stress that the field brings."""
        blocks = self.blocks
        self._check_values(np.array([value]), f"a {self.quantity}")
        at = blocks.numbers_of_nodes(nodes)
        self._need_model()
        blocks.before_change()
        before = self._content()
        chosen = np.zeros(len(blocks.the_mesh().points) + 1, bool)  # the last one is for the fourth corner of triangles
        chosen[at] = True
        t, cells = blocks.cold[self.quantity], blocks.the_mesh().cells
        corners = chosen[cells[blocks.number, : t.shape[1]]]
        t[corners] = value
        self.accounts["commands"] += self._content() - before
        self._take_unstressed(np.flatnonzero(chosen[cells].any(axis=1)))
        blocks.changed(stiffness=False)

    def _check_values(self, values: np.ndarray, what: str) -> None:
        """CommandError for values (n,) that it cannot have."""
        if not np.isfinite(values).all():
            raise CommandError(f"{what} must be finite, got {values[~np.isfinite(values)][0]}")

    def prescribe(self, nodes: np.ndarray | None, value: Number) -> None:
        """Nodes (None: all) have this value from now on, a number or a table over the time of the field."""
        at = self.blocks.numbers_of_nodes(nodes)
        self._need_model()
        row = self._row_of(value)
        with self.changing():
            self.held[at] = row

    def _row_of(self, value: Number) -> int:
        """Return the row of this prescribed value; append it if it is new."""
        what = f"the {self.quantity} of a node"
        self._check_values(assigned.checked(self.blocks.tables, value, what), what)
        return assigned.row_of(self.prescribed, value, 1)

    def remove_conditions(self, nodes: np.ndarray | None) -> None:
        """Nodes (None: all) are no longer held."""
        self._unset(self.held, nodes)

    def expose(self, faces: np.ndarray | None, **changes: Any) -> None:
        """Faces (None: all) have these conditions, fields of `FaceCondition`; the others of theirs stay."""
        at, exposed = self.blocks.numbers_of_faces(faces), self.exposed
        self._need_model()
        for name, value in changes.items():
            if value is not None:
                assigned.checked(self.blocks.tables, value, f"{name} of a face")
        if changes.get("transfer") is not None and changes["transfer"] < 0.0:
            raise CommandError(f"a transfer coefficient must not be negative, got {changes['transfer']:g}")
        for row in np.unique(exposed.row[at]).tolist():
            wanted = replace(exposed.conditions[row], **changes)
            if wanted.transfer is not None and wanted.environment is None:
                raise CommandError(f"a transfer coefficient of faces needs environment-{self.quantity}")
            if wanted.environment is not None and wanted.transfer is None:
                mine = at[exposed.row[at] == row]
                h = self._transfers[mine // 4]
                if (h == 0.0).any():
                    raise CommandError(
                        f"environment-{self.quantity} needs a transfer coefficient: face {mine[h == 0.0][0]} and its "
                        "element have none"
                    )
        with self.changing():
            change_rows(exposed.conditions, exposed.row, at, changes)

    def remove_face_conditions(self, faces: np.ndarray | None) -> None:
        """Remove the conditions of faces (None: all)."""
        self._unset(self.exposed.row, faces)

    def _need_model(self) -> None:
        if not self.rows:
            raise CommandError(f"no {self.name} yet: assign {self.command} first")

    @property
    def command(self) -> str:
        """The one that gives elements the model."""
        return f"element c-model {self.model.name.replace('_', '-')}"

    def uses_table(self, name: str) -> bool:
        """Return whether a node or a face follows this table. Not collective."""
        of_faces = (asdict(one).values() for one in assigned.in_use(self.exposed.conditions, self.exposed.row))
        held = assigned.in_use(self.prescribed, self._all_held(), 1)
        return name in held or any(name in of_face for of_face in of_faces)

    def _all_held(self) -> np.ndarray:
        """Rows of all that is prescribed."""
        return self.held

    def _content(self) -> float:
        """Content of all elements, above the zero of the scale, by the capacities of their columns."""
        cold = self.blocks.cold
        return exact_sum((cold[self.capacities] * cold[self.quantity]).reshape(-1), self.blocks.comm)

    def account(self) -> dict[str, float]:
        """Budget since the model was made: given by conditions, added by commands (initial values, changes of
        capacity), stored in elements above the zero of the scale, removed with elements; closing: the error; relative:
        the error over the largest entry."""
        self.blocks.close_model()
        found = {"given": self._sum(self._booked(), self.accounts["given"]), "commands": self.accounts["commands"],
                 "stored": self._content(), **self._stored_besides(), "removed": self.accounts["removed"]}  # fmt: skip
        less = reduce(sub, list(found.values())[2:], found["given"] + found["commands"])
        return closed(found, less)

    def _booked(self) -> np.ndarray:
        """Return the amounts supplied by conditions, on this rank."""
        return self.blocks.cold[self.given].reshape(-1)

    def _stored_besides(self) -> dict[str, float]:
        """Return amounts that are stored elsewhere, by name."""
        return {}

    def elements_removed(self, elements: np.ndarray) -> None:
        """Discard the contents of removed elements."""
        blocks = self.blocks
        self._expands = None
        if self.quantity not in blocks.cold:
            return
        mine = np.isin(blocks.number, elements)
        t, c, given = (blocks.cold[name][mine].reshape(-1) for name in (self.quantity, self.capacities, self.given))
        self.accounts["removed"] += exact_sum(t * c, blocks.comm)
        self.accounts["given"] += exact_sum(given, blocks.comm)
