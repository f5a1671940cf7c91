"""The whole state of a model of blocks to a file and back, bit for bit, on any number of ranks and threads."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.clock import Clock
from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.engine import checkpoint as engine
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.io.slabs import holders, to_slabs
from hpcdem.physics.block_physics import PHYSICS
from hpcdem.physics.fdem import groups, tetrahedra, user_functions, user_laws
from hpcdem.physics.fdem.budget import Budget
from hpcdem.physics.fdem.histories import WORDS, Histories
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.state import Crack, Creep
from hpcdem.physics.fdem.surface_loads import SHARED_OUT

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm
    from hpcdem.physics.fdem.simulation import Blocks

KIND = checkpoint.BLOCKS
ARRAYS = {
    "elements": ("alive", "element_row", "touches"),
    "faces": ("partner", "joint_row", "open", "broken", "face_row", "load_row", "corner_row"),
}
"""Assignments, known to all ranks; rank 0 writes them."""


def save(sim: Blocks, path: Path | str, extra: Mapping[str, Any] | None = None) -> None:
    """Write the state, and `extra` (JSON values) with it. Reads only: a run that saves resumes exactly like one that
    does not. Collective."""
    engine.save(sim, path, lambda: (state_of(sim, extra or {}), tables(sim)))


def state_of(sim: Blocks, extra: Mapping[str, Any]) -> dict[str, Any]:
    """Return everything that is not a table, as JSON values. Collective."""
    mesh = sim.mesh
    tally = sim.comm.sum_into(sim.local.tally.sum(axis=0)) if sim.closed else np.zeros(1, np.int64)
    return {
        "kind": KIND,
        "clock": dataclasses.asdict(sim.clock),
        "lattice": dataclasses.asdict(sim.rebuild_state),
        "scene": sim.definition_state(),
        "creep": dataclasses.asdict(sim.creep),
        "events": [list(row) for row in sim.event_rows],
        "closed": sim.closed,
        "longest": sim._longest,
        "tally": tally.tolist(),
        "rebuilds": sim.rebuilds,
        "budget": sim.budget.state(sim) if sim.budget is not None else None,
        "loads": sim.surface_loads.saved_state(),
        "columns": {name: values.shape[1] for name, values in sim.cold.items()},
        "mesh": None if mesh is None else {
            "group_runs": {s: {g: groups.runs(rows) for g, rows in of.items()} for s, of in mesh.groups.items()},
            "layers": {name: pairs.tolist() for name, pairs in mesh.layers.items()},
            "cracks": mesh.cracks.tolist(),
            "crack_sets": mesh.crack_sets.tolist(),
        },
        "extra": dict(extra),
    }  # fmt: skip


def tables(sim: Blocks) -> dict[str, Table]:
    """The arrays of the state, as slabs. Collective."""
    if sim.mesh is None:
        return {}
    root = sim.comm.rank == 0
    tables = {
        "mesh_points": _whole(dict(zip("xyz", sim.mesh.points.T)), root),
        "mesh_cells": _whole({f"corner_{k}": sim.mesh.cells[:, k] for k in range(4)}, root),
    }
    if len(sim.mesh.macros):
        tables["mesh_hexes"] = _whole({f"p{k}": rows for k, rows in enumerate(sim.mesh.macros.T)}, root)
    for kind, names in ARRAYS.items():
        tables[kind] = _whole({name: getattr(sim, name) for name in names}, root, np.int64)
    if sim.stress0 is not None:
        stress0 = {f"s{k}": sim.stress0[:, k] for k in range(sim.stress0.shape[1])}
        row = sim.stress0_row if root else sim.stress0_row[:0]
        tables["stress0"] = _whole({**stress0, "row": row.astype(np.int64)}, root)
    if len(sim.born):
        born_at = sim.birthplace.reshape(len(sim.born), -1)
        tables["born"] = _whole({"number": sim.born, **{f"p{k}": of for k, of in enumerate(born_at.T)}}, root)
    tables |= {name: _whole(of, root) for name, of in sim.surface_loads.saved_tables().items()}
    tables |= {name: to_slabs(sim.comm, ("number",), of) for name, of in sim.surface_loads.saved_rows().items()}
    own = sim.owned
    number, x, v = sim.number[own], sim.x[own], sim.v[own]
    columns: dict[str, np.ndarray] = {"number": number.copy()}
    places = (sim.origin, sim.listed) if sim.closed else (sim.places(), sim.places())
    for name, rows in (("x", x), ("v", v), *zip(("origin", "listed"), places), *sim.cold.items()):
        for c in range(rows.shape[1]):
            columns[f"{name}_{c}"] = rows[:, c].copy()
    tables["state"] = to_slabs(sim.comm, ("number",), columns)
    histories = sim.local.histories(transfer=False) if sim.closed else sim.histories
    keys = histories.keys()
    order = {"number": number[histories.owners()], "key": keys.copy()}
    order.update({f"m{c}": histories.rows[:, c].copy() for c in range(1, histories.rows.shape[1])})
    tables["memories"] = to_slabs(sim.comm, ("number", "key"), order)
    return tables


def _whole(columns: dict[str, np.ndarray], root: bool, dtype: Any = None) -> Table:
    """A table that all ranks have, written by rank 0."""
    n = len(next(iter(columns.values())))
    made = {name: np.ascontiguousarray(values if root else values[:0], dtype) for name, values in columns.items()}
    return Table(made, offset=0 if root else n, total=n)


def restore(sim: Blocks, path: Path | str) -> dict[str, Any]:
    """Take the state of a file written by `save`. Collective. Returns `extra`. CommandError if the file is missing,
    foreign or damaged; the simulation is then as it was."""
    state, found = read(sim.comm, path, KIND, "a model of blocks")
    put(sim, state, found)
    return state["extra"]


def restore_part(sim: Blocks, path: Path | str) -> dict[str, Any] | None:
    """Take the blocks of a checkpoint that holds particles as well (physics/coupling/saved_state.py), without the
    kernels of these; returns `extra`, or None if the file is not one of both. Collective."""
    try:
        state, tables = checkpoint.read(path, sim.comm, _replicated)
    except HpcdemError:
        return None
    if state.get("kind") != checkpoint.BOTH:
        return None
    put(sim, state, without_particles(tables))
    return state["extra"]


def _replicated(table: str) -> bool:
    """Return whether all ranks have all of this table: it is assigned to the model, see definition.py."""
    return table not in ("state", "memories", checkpoint.LINKS, *SHARED_OUT) and not table.startswith(
        checkpoint.OF_PARTICLES
    )


def without_particles(tables: checkpoint.Tables) -> checkpoint.Tables:
    """Tables of the blocks in a checkpoint of particles and blocks."""
    others = checkpoint.OF_PARTICLES
    return {name: table for name, table in tables.items() if not name.startswith(others) and name != checkpoint.LINKS}


def read(comm: Comm, path: Path | str, kind: str, what: str) -> tuple[dict[str, Any], checkpoint.Tables]:
    """The state in a checkpoint of this kind, and its tables: slabs of those of elements, contacts and particles, all
    rows of the others. Collective. what: its name in messages. CommandError if the file is missing, foreign or damaged.
    """
    return engine.read(comm, path, kind, what, _replicated)


def put(sim: Blocks, state: dict[str, Any], tables: checkpoint.Tables) -> None:
    """Take a state and tables that were read. Collective. CommandError, with the model as it was, without the user
    laws that it has."""
    user_laws.check_restored(state["scene"])
    user_functions.check_restored(state["scene"])
    sim.clear()
    if state["mesh"] is not None:
        mesh = sim.per_node(lambda: _mesh(state["mesh"], tables))
        sim.place_mesh(mesh)
        for name, array in sim.per_node(lambda: _arrays(sim, tables)).items():
            setattr(sim, name, array)
        if "born" in tables:
            born_at = np.column_stack([tables["born"][f"p{k}"] for k in range(4 * sim.dim)])
            sim.take_births(tables["born"]["number"].astype(np.int64), born_at.reshape(-1, 4, sim.dim))
    sim.take_definition_state(state["scene"])
    sim.clock = Clock(**state["clock"])
    sim.untouched = sim.clock.step == 0
    sim.rebuild_state = type(sim.rebuild_state)(**{"step": sim.clock.step, "time": sim.clock.time, **state["lattice"]})
    sim.creep = Creep(**state.get("creep", {}))
    sim.event_rows = [Crack(*row) for row in state["events"]]
    sim._longest = state["longest"]
    if state["mesh"] is None:
        return
    places = _take_rows(sim, state, tables)
    if state["budget"] is not None:
        sim.budget = Budget.restored(state["budget"], sim.comm.rank == 0)
    for name, about in state.get("loads", {}).items():
        PHYSICS[name]().restored(sim, about, tables)
    if state["closed"]:
        _close_as_it_was(sim, state, places)
    sim.rebuilds = state["rebuilds"]


def _mesh(about: dict[str, Any], tables: checkpoint.Tables) -> Mesh:
    points = np.column_stack([tables["mesh_points"][c] for c in "xyz" if c in tables["mesh_points"]])
    cells = np.column_stack([tables["mesh_cells"][f"corner_{k}"] for k in range(4)])
    macros = np.empty(0, np.int64)
    if "mesh_hexes" in tables:
        of = tables["mesh_hexes"]
        macros = np.column_stack([of[f"p{k}"] for k in range(len(of))]).astype(np.int64)
    if "groups" in about:  # of versions that named each element
        named = {s: {g: np.array(rows, np.int64) for g, rows in of.items()} for s, of in about["groups"].items()}
    else:
        named = {s: {g: groups.of_runs(rows) for g, rows in of.items()} for s, of in about["group_runs"].items()}
    return Mesh(
        points,
        cells,
        named,
        {name: np.array(rows, np.int64).reshape(-1, points.shape[1]) for name, rows in about["layers"].items()},
        np.array(about["cracks"], np.int64).reshape(-1, points.shape[1]),
        np.array(about["crack_sets"], np.int64),
        macros,
    )


def _arrays(sim: Blocks, tables: checkpoint.Tables) -> dict[str, np.ndarray]:
    """Assignments by name."""
    out: dict[str, np.ndarray] = {}
    for kind, names in ARRAYS.items():
        for name in names:
            if name == "corner_row" and "points" in tables:  # of versions that had conditions by points
                found = np.append(tables["points"]["point_row"], 0)[sim.the_mesh().cells.reshape(-1)]
            elif name not in tables[kind] and name == "touches":  # of versions in which all elements did
                continue
            else:
                found = tables[kind][name]
            before = getattr(sim, name)
            if before.any() or found.any():  # zeros that nobody has written to take no memory
                out[name] = found.astype(before.dtype)
    if "stress0" in tables:
        of = tables["stress0"]
        out["stress0"] = np.column_stack([of[f"s{k}"] for k in range(6) if f"s{k}" in of])
        # In files without this column an initial stress did not follow the moduli: it is that of the present ones.
        out["stress0_row"] = of.get("row", out.get("element_row", sim.element_row)).astype(sim.stress0_row.dtype)
    return out


def _take_rows(sim: Blocks, state: dict[str, Any], tables: checkpoint.Tables) -> dict[str, np.ndarray]:
    """Slabs of rows; the first close sends them to their owners. Returns positions when storage and lists were made.
    Collective."""
    width, speed = sim.x.shape[1], sim.v.shape[1]
    rows, kept = tables["state"], tables["memories"]

    def table(name: str, n: int) -> np.ndarray:
        return np.ascontiguousarray(np.column_stack([rows[f"{name}_{c}"] for c in range(n)]))

    sim.number, sim.x, sim.v = rows["number"].copy(), table("x", width), table("v", speed)
    sim.cold = {name: table(name, n) for name, n in state["columns"].items()}
    words = np.zeros((len(kept["key"]), WORDS))
    words.view(np.int64)[:, 0] = kept["key"]
    for c in range(1, words.shape[1]):
        words[:, c] = kept[f"m{c}"]
    _, number, words = sim.comm.to_ranks(holders(sim.comm, sim.number, kept["number"]), kept["number"], words)
    sim.histories = Histories.of(len(sim.number), np.searchsorted(sim.number, number), words)
    n = sum(name.startswith("origin_") for name in rows)
    places = {name: table(name, n) for name in ("origin", "listed")}
    if n == tetrahedra.ROW:  # of versions that kept spare words
        return {name: tetrahedra.without_spares(of) for name, of in places.items()}
    return places


def _close_as_it_was(sim: Blocks, state: dict[str, Any], places: dict[str, np.ndarray]) -> None:
    """Storage and lists again at the present positions: no sum depends on them. When they are due to be made again does
    depend on the positions at which they were, which are put back."""
    sim.cold.update(places)
    sim.close_as_saved()
    sim.origin, sim.listed = sim.cold.pop("origin"), sim.cold.pop("listed")
    sim.local.tally[0, : len(state["tally"])] = state["tally"] if sim.comm.rank == 0 else 0
