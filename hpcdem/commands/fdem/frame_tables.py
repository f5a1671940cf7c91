"""Tables of frames of blocks besides elements and joints: contacts of elements, conditions of nodes and faces, flow
nodes; one row per object.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.io.frame import Table
from hpcdem.io.slabs import to_slabs
from hpcdem.io.vtkhdf_mesh import CONTACTS, CORNERS, FACE_CONDITIONS, FLOW_NODES, NODE_CONDITIONS
from hpcdem.physics.fdem import diagnostics, sides
from hpcdem.physics.fdem.conditions import TRACTIONS
from hpcdem.physics.fdem.groups import FLOW_NODE
from hpcdem.physics.fdem.kernels import nodes, space
from hpcdem.physics.fdem.loads import tractions_now
from hpcdem.physics.fdem.node_set import conditions_now
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.user_functions import Placed
from hpcdem.physics.field import assigned
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat


def tables(blocks: Blocks) -> dict[str, Table]:
    """Return the tables by name, in ascending order of numbers, without empty ones. Collective."""
    made = {
        CONTACTS: _slabs(blocks, ("element_1", "element_2"), _contacts(blocks)),
        NODE_CONDITIONS: _slabs(
            blocks, ("number", "element") if blocks.sided else ("number",), _on_root(blocks, _node_conditions(blocks))
        ),
        FACE_CONDITIONS: _slabs(blocks, ("number",), _on_root(blocks, _face_conditions(blocks))),
        FLOW_NODES: _slabs(blocks, ("number",), _flow_nodes(blocks)),
    }
    return {name: table for name, table in made.items() if table is not None and table.total}


Columns = dict[str, np.ndarray]


def _slabs(blocks: Blocks, keys: Sequence[str], columns: Columns | None) -> Table | None:
    return None if columns is None else to_slabs(blocks.comm, keys, columns)


def _on_root(blocks: Blocks, columns: Columns | None) -> Columns | None:
    """Columns that all ranks know, to be handed in once."""
    if columns is None or blocks.comm.rank == 0:
        return columns
    return {name: values[:0] for name, values in columns.items()}


def _contacts(blocks: Blocks) -> Columns | None:
    """Return one row per pair of touching elements, whatever the number of touching faces and parts: force on the first
    [N/m, in space N], and mean position. The order of sums does not depend on the ranks."""
    if not blocks.options.collision:
        return None
    found = diagnostics.contacts(blocks)
    axes = "xyz"[: blocks.dim]
    finer = [found[name] for name in ("face", "body_2", "body_1") if name in found]
    pair = found["element_1"], found["element_2"]
    order = np.lexsort((*(found[axis] for axis in axes), *finer, *pair[::-1]))
    one, other = (np.asarray(values, np.int64)[order] for values in pair)
    first = np.flatnonzero(np.append(True, (one[1:] != one[:-1]) | (other[1:] != other[:-1]))[: len(one)])
    columns = {"element_1": one[first], "element_2": other[first]}
    count = np.diff(np.append(first, len(one)))
    for axis in axes:
        for name, column, by in ((f"position_{axis}", axis, count), (f"contact_force_{axis}", f"force_{axis}", 1)):
            values = found[column][order]
            columns[name] = (np.add.reduceat(values, first) if len(first) else np.empty(0)) / by
    return columns


def _places(blocks: Blocks, numbers: np.ndarray, lead: np.ndarray | None = None) -> Columns:
    """Return the present positions of points [m], on all ranks; NaN for points without an element. lead (n,): the
    corner if the position of one side is requested, else -1. Collective."""
    names = [f"position_{axis}" for axis in "xyz"[: blocks.dim]]
    columns = {name: np.empty(len(numbers)) for name in names}
    sided = numbers if lead is None else np.where(lead >= 0, sides.SIDE + lead, numbers)
    again = np.arange(len(numbers)) - np.searchsorted(numbers, numbers)  # a point is requested once at a time
    for k in range(int(again.max(initial=-1)) + 1):
        for name in names:
            columns[name][again == k] = diagnostics.values(blocks, name, sided[again == k])
    return columns


def _nodes_with_conditions(blocks: Blocks, held: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points with conditions, ascending; where its sides have different ones each with its lowest corner, else -1; and
    the row of conditions (n,)."""
    mesh = blocks.the_mesh()
    cells, node = mesh.cells.reshape(-1), blocks.node.reshape(-1)
    corner = np.flatnonzero((blocks.corner_row > 0) & (node >= 0))
    if blocks.sided:
        corner = np.flatnonzero((node >= 0) & np.isin(cells, cells[corner]))
    corner = corner[np.unique(node[corner], return_index=True)[1]]
    row = blocks.rows_of_nodes(corner, blocks.node)[0]
    table = np.column_stack([cells[corner], row])
    table, first = np.unique(table, axis=0, return_index=True)
    corner = corner[first]
    point = table[:, 0]
    alone = np.bincount(point, minlength=len(mesh.points))[point] == 1
    some = alone | (table[:, 1] > 0)
    warm = np.flatnonzero(held > 0)
    warm = warm[~np.isin(warm, point[some])]
    number = np.concatenate([point[some], warm])
    order = np.argsort(number, kind="stable")
    lead = np.concatenate([np.where(alone, -1, corner)[some], np.full(len(warm), -1)])
    return number[order], lead[order], np.concatenate([table[:, 1][some], np.zeros(len(warm), np.int64)])[order]


def _node_conditions(blocks: Blocks) -> Columns | None:
    """fixed: bits of the components of motion that are prescribed, 1 x, 2 y, 4 z; what of them, and forces."""
    heat = Heat.there(blocks)
    held = np.zeros(1, np.int32) if heat is None else heat.held
    blocks.close_model()
    numbers, lead, row = _nodes_with_conditions(blocks, held)
    if not len(numbers):
        return None
    columns = {"number": numbers, **_places(blocks, numbers, lead)}
    there = np.isfinite(columns["position_x"])
    columns = {name: values[there] for name, values in columns.items()}
    numbers, lead, row = numbers[there], lead[there], row[there]
    if blocks.sided:
        columns["element"] = np.where(lead >= 0, lead // 4, -1)
    points, time, plane = blocks.the_mesh().points[numbers], blocks.time_now(), blocks.dim == 2
    placed = Placed(blocks.acting(), row, points)
    table = conditions_now(blocks, placed, time, time, 1.0)[placed.of]
    does, at, force, constraint = (
        (nodes.DOES_X, nodes.AT_X, nodes.FORCE_X, nodes.CONSTRAINT) if plane
        else (space.DOES, space.AT, space.FORCE, space.CONSTRAINT)
    )  # fmt: skip
    step = (nodes.DOES_Y, nodes.AT_Y) if plane else (space.DOES + 1, space.AT + 1)
    kind = table[:, constraint].astype(np.int8)
    fixed = np.where(kind == nodes.FIXED, (1 << blocks.dim) - 1, 0).astype(np.int8)
    for k, axis in enumerate("xyz"[: blocks.dim]):
        how, value = table[:, does + k * (step[0] - does)], table[:, at + k * (step[1] - at)]
        fixed |= np.where(how != nodes.FREE, 1 << k, 0).astype(np.int8)
        for name, meant in (("velocity", nodes.VELOCITY), ("acceleration", nodes.ACCELERATION)):
            columns[f"{name}_{axis}"] = np.where(how == meant, value, 0.0)
        columns[f"nodal_force_{axis}"] = table[:, force + k].copy()
    columns |= {"fixed": fixed, "constraint": kind}
    if heat is not None:
        now = [assigned.now(blocks.tables, value, heat.time) for value in heat.prescribed]
        columns["temperature"] = np.where(heat.held[numbers] > 0, np.array(now)[heat.held[numbers]], np.nan)
    return columns


def _face_conditions(blocks: Blocks) -> Columns | None:
    """Stresses that act on faces, and heat; quiet: whether waves leave through them; water_pressure: of water before
    them, NaN where they are dry. Collective."""
    heat, flow = Heat.there(blocks), Flow.there(blocks)
    given = np.zeros(1, np.int32) if heat is None else heat.exposed.row
    wet = {"number": np.empty(0, np.int64)} if flow is None else flow.wet_faces()
    numbers = np.union1d(np.flatnonzero((blocks.load_row > 0) | (given > 0)), wet["number"])
    numbers = numbers[blocks.alive[numbers // 4]]
    if not len(numbers):
        return None
    mesh, time = blocks.the_mesh(), blocks.time_now()
    corners = mesh.face_corners(numbers)
    columns: Columns = {"number": numbers, **dict(zip(CORNERS[mesh.dim], corners.T.copy(), strict=True))}
    middle = mesh.points[mesh.cells[corners // 4, corners % 4]].mean(axis=1)
    placed = Placed(blocks.loads, blocks.load_row[numbers].astype(np.int64), middle)
    table = tractions_now(blocks, placed, time)[placed.of]
    for name, values in zip(TRACTIONS[blocks.dim], table.T, strict=True):
        word = name if name.startswith("incoming") else "normal_stress" if name == "normal" else f"stress_{name}"
        if name != "dip" or values.any():
            columns["shear_stress" if name == "dip" else word] = values.copy()
    columns["quiet"] = blocks.quiet_faces()[numbers].astype(np.int8)
    if flow is not None:
        columns["water_pressure"] = np.full(len(numbers), np.nan)
        columns["water_pressure"][np.searchsorted(numbers, wet["number"])] = wet["pressure"]
    if heat is not None:
        for name in ("flux", "transfer", "environment"):
            now = [
                assigned.now(blocks.tables, _or_nan(getattr(one, name)), heat.time) for one in heat.exposed.conditions
            ]
            columns[_OF_HEAT[name]] = np.array(now, float)[heat.exposed.row[numbers]]
    return columns


_OF_HEAT = {"flux": "heat_flux", "transfer": "transfer_coefficient", "environment": "environment_temperature"}


def _or_nan(value: Any) -> Any:
    return np.nan if value is None else value


_OF_FLUID = {
    "fluid_temperature": "temperature", "proppant_concentration": "concentration", "pack_pressure": "pack_pressure",
}  # fmt: skip
"""Columns with the names that channels have, and what other physics calls them."""


def _flow_nodes(blocks: Blocks) -> Columns | None:
    """condition: kernels.FREE, PRESSURE, SURFACE or RATE of the flow."""
    flow = Flow.there(blocks)
    if flow is None or not len(flow.network.channels):
        return None
    columns_of = {"number": "number"} | {column: name for column, name in _OF_FLUID.items() if name in flow.more}
    columns_of |= {"fluid_pressure": "pressure", "saturation": "saturation", "inflow": "inflow"}
    found = flow.owned_values(FLOW_NODE, [name for name in columns_of.values() if name != "number"])
    columns = {column: found[name] for column, name in columns_of.items()}
    at = np.searchsorted(flow.network.nodes, columns["number"])
    columns |= {name: values[at] for name, values in _places(blocks, flow.network.nodes).items()}
    does = np.array([one.does for one in flow.conditions], np.int8)
    columns["condition"] = does[flow.condition[columns["number"]]]
    return columns
