"""Free faces of elements through which a field passes: a flux, and transfer to an environment. Sides of hexahedra,
whose conduction is the mean of two overlays, are cut both ways (sides.py)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.mesh import sizes
from hpcdem.physics.field import assigned, kernels
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.sides import with_other_cuts

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks


@dataclass(frozen=True)
class FaceCondition:
    """Condition of faces: flux into the element [W/m2]; environment: temperature around it [K], None: none; transfer:
    heat transfer coefficient to it [W/(m2 K)], None: that of the element. Other fields use the corresponding
    quantities."""

    flux: Number = 0.0
    transfer: float | None = None
    environment: Number | None = None


class Exposed:
    """Conditions of the faces of a model. row (4 ne,): of `conditions`, 0: nothing passes; coefficients: by element
    (ne,), for faces whose condition gives none."""

    def __init__(self, blocks: Blocks, coefficients: Callable[[], np.ndarray]) -> None:
        self.blocks, self.coefficients = blocks, coefficients
        self.row = np.zeros(blocks.the_mesh().cells.size, np.int32)
        self.conditions: list[FaceCondition] = [FaceCondition()]
        self._part, self._rows = np.empty(0), np.empty(0, np.int64)
        self._corner = np.empty((0, 2), np.int64)
        self._kinds: list[tuple[int, float]] = []

    def parts_of(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Split faces (n,) into parts: numbers (m,), their corners (m, 2), in space (m, 3), element * 4 + k, and the
        share of each: half the length [m], in space a third of the area [m2]. Sides of hexahedra occur twice, once for
        each way to cut them."""
        mesh = self.blocks.the_mesh()
        if len(mesh.hexes):
            ends, area, of = with_other_cuts(mesh, faces)
            return faces[of], ends, area / 3.0
        ends = mesh.face_corners(faces)
        return faces, ends, sizes(self.blocks.reference.points[mesh.face_points(faces)]) / ends.shape[1]

    def _all(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Free faces with a condition, of all ranks."""
        blocks = self.blocks
        return self.parts_of(np.flatnonzero((self.row > 0) & blocks.face_exists() & ~blocks.closed_faces()))

    def transfers(self, everywhere: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Exposed faces (m,), their corners (m, 2 or 3), element * 4 + k, and what each passes on to one of them per
        degree [W/(m K)]: of this rank's elements, or of all. Not collective."""
        at, ends, part = self._all()
        if not everywhere:
            row = self.blocks.where[at // 4]
            mine = (row >= self.blocks.owned.start) & (row < self.blocks.owned.stop)
            at, ends, part = at[mine], ends[mine], part[mine]
        h, row = self.coefficients()[at // 4], self.row[at]
        own = np.array([math.nan if one.transfer is None else one.transfer for one in self.conditions])[row]
        there = np.array([one.environment is not None for one in self.conditions])[row]
        return at, ends, part * np.where(there, np.where(np.isnan(own), h, own), 0.0)

    def bind(self, width: int) -> None:
        """Find those of the elements held here, by their numbers; width: of the table of values. Not collective."""
        at, ends, part = self._all()
        held = self.blocks.where[at // 4] >= 0
        at, ends, self._part = at[held], ends[held], part[held]
        self._corner = self.blocks.where[ends // 4] * width + ends % 4
        # One row for each condition and coefficient of the element.
        pairs, which = np.unique(
            np.column_stack([self.row[at].astype(float), self.coefficients()[at // 4]]), axis=0, return_inverse=True
        )
        self._rows = which.reshape(-1).astype(np.int64)
        self._kinds = [(int(condition), h) for condition, h in pairs.tolist()]

    def _table_at(self, time: float) -> np.ndarray:
        """Evaluate the conditions, (rows, 3), at a time of the field."""
        table, tables = np.zeros((len(self._kinds), 3)), self.blocks.tables
        for row, (condition, h) in enumerate(self._kinds):
            one = self.conditions[condition]
            table[row, kernels.FLUX] = assigned.now(tables, one.flux, time)
            if one.environment is not None:
                table[row, kernels.TRANSFER] = h if one.transfer is None else one.transfer
                table[row, kernels.ENVIRONMENT] = assigned.now(tables, one.environment, time)
        return table

    def add_sizes(self, time: float, out: np.ndarray) -> None:
        """Add to corners out (flat) what passes to them per degree."""
        h = self._table_at(time)[:, kernels.TRANSFER][self._rows]
        np.add.at(out, self._corner.reshape(-1), np.repeat(self._part * h, self._corner.shape[1]))

    def add_inflow(
        self, time: float, dt: float, first: int, last: int, t: np.ndarray, q: np.ndarray, given: np.ndarray
    ) -> None:
        """Add to q (flat) what passes at a time of the field; what comes to the corners first : last in dt [s] is
        booked in given."""
        if len(self._rows):
            kernels.through_faces(
                self._corner, self._part, self._rows, self._table_at(time), first, last, t, q, dt, given
            )
