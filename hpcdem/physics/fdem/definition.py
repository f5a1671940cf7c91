"""Definition of a model of blocks: mesh (topology.py), options (settings.py), models of elements, faces and joints
(assignments.py), boundary conditions (conditions.py).

All of it is known to every rank, by the numbers of the mesh: what is given once is the same everywhere, whoever owns an
element. What moves is in `simulation.py`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.numerics.random_field import RandomField
from hpcdem.physics.fdem import mesh as meshes
from hpcdem.physics.fdem import node_conditions
from hpcdem.physics.fdem.conditions import Conditions, Relaxation, Traction
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.properties import Rows
from hpcdem.physics.fdem.settings import Options
from hpcdem.physics.fdem.tables import Table


class ModelDefinition(Conditions):
    """Mesh and assignments. Methods that assign raise CommandError, alike on all ranks, and change nothing then."""

    def __init__(self) -> None:
        self.clear_definition()

    def clear_definition(self) -> None:
        """Remove the mesh and all assignments."""
        self.options = Options()
        self.clear_topology()
        self.clear_assignments()
        self.clear_conditions()

    def _take(self, mesh: Mesh) -> None:
        """The model begins again with this mesh. CommandError if a simulation cannot take it."""
        try:
            meshes.check(mesh)
        except HpcdemError as error:
            raise CommandError(str(error)) from None
        self._put(mesh)

    def _put(self, mesh: Mesh) -> None:
        kept = self.options, self.tables, self.fields
        self.clear_definition()
        self.options, self.tables, self.fields = kept
        self.mesh = mesh
        for make in (self._make_topology, self._make_assignments, self._make_conditions):
            make(len(mesh.cells))
        mesh.share(self.per_node)
        self.partner = self.per_node(mesh.face_partners)
        if len(mesh.cracks):
            self.open_faces(self.per_node(lambda: mesh.edges().faces[meshes.crack_rows(mesh, mesh.edges()), 0]))

    def definition_state(self) -> dict[str, Any]:
        """Return everything but the arrays, as JSON values."""
        return {
            "options": asdict(self.options),
            "slid": [[face, *values] for face, values in sorted(self.slid.items())],
            "tables": {name: table.pairs() for name, table in self.tables.items()},
            "fields": {name: _plain(asdict(field)) for name, field in self.fields.items()},
            "varied": self.varied,
            "softening": [table.pairs() for table in self.followed],
            "softening_over": [table.over for table in self.followed],
            "element_rows": self.element_rows.state(),
            "face_rows": self.face_rows.state(),
            "joint_rows": self.joint_rows.state(),
            "conditions": [asdict(one) for one in self.conditions],
            "sided": self.sided,
            "loads": [asdict(one) for one in self.loads],
            "fading": [
                {**asdict(one), "corner": one.corner.tolist(), "force": one.force.tolist()} for one in self.relaxations
            ],
        }

    def take_definition_state(self, state: dict[str, Any]) -> None:
        """Inverse of `definition_state`."""
        self._closed = None
        self.options = Options(**state["options"])
        self.slid = {int(row[0]): tuple(row[1:]) for row in state.get("slid", [])}
        self.tables = {name: Table.of(pairs, name) for name, pairs in state["tables"].items()}
        self.fields = {name: RandomField(**_bounds(field)) for name, field in state.get("fields", {}).items()}
        self.varied = [list(one) for one in state.get("varied", [])]
        followed = [Table.of(pairs) for pairs in state.get("softening", [])]
        over = state.get("softening_over", [""] * len(followed))
        self.followed = [replace(table, over=name) for table, name in zip(followed, over, strict=True)]
        self.element_rows = Rows.restored(state["element_rows"])
        self.face_rows = Rows.restored(state["face_rows"])
        self.joint_rows = Rows.restored(state["joint_rows"])
        self.conditions = [node_conditions.restored(one) for one in state["conditions"]]
        if "sided" not in state:
            self.conditions = [node_conditions.as_before(one, self.dim) for one in self.conditions]
        self.sided, self._acting = state.get("sided", False), None
        self.loads = [Traction(**one) for one in state["loads"]]
        self.relaxations = [
            Relaxation(
                np.array(one["corner"], np.int64), np.array(one["force"]).reshape(len(one["corner"]), -1),
                one["begin"], one["span"], one["in_steps"],
            )
            for one in state["fading"]
        ]  # fmt: skip


_OPEN = {"least": -math.inf, "greatest": math.inf}
"""Infinite default values, which are stored as null because JSON has no infinity."""


def _plain(field: dict[str, Any]) -> dict[str, Any]:
    return {name: None if value == _OPEN.get(name, 0) and name in _OPEN else value for name, value in field.items()}


def _bounds(field: dict[str, Any]) -> dict[str, Any]:
    return {name: _OPEN[name] if value is None else value for name, value in field.items()}
