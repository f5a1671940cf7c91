"""Meshes from files, read by meshio: gmsh .msh, Abaqus .inp, VTK, and whatever else it knows."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.connectivity import areas, corner_counts, find_edges
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.physics.fdem.tetrahedra import volumes
from hpcdem.pre.mesh import optional

CORNERS = {"triangle": 3, "quad": 4}
SOLIDS = {"tetra": 4, "hexahedron": 8}
SURFACES = frozenset("triangle6 triangle7 quad8 quad9 triangle10 quad16 polygon".split())
"""Plane elements that cannot be taken."""
SET = "physical"
"""Groups of the file come into this set."""
FLATNESS = 1e-9
"""How far points may lie from a plane z = constant, in parts of the model's size."""


def import_mesh(path: str | Path, merge: float = 0.0, scale: float = 1.0, dim: int = 2) -> Mesh:
    """Read a mesh of triangles and quads in the x-y plane; dim 3: of tetrahedra and
    hexahedra.

    Physical groups (gmsh) and element sets (Abaqus) become groups of the set SET; one that overlaps an earlier one gets
    a set of its own, of the same name. Physical lines become layers. Elements that run clockwise are turned over, and
    points that no element uses are left out. merge: points nearer than that [m, after scaling] are made one; scale:
    metres per unit of the file.

    HpcdemError `file: element n ...` for what cannot be used, n counted from 1 over the plane elements of the file.
    """
    path = Path(path)
    if not scale > 0.0 or not merge >= 0.0:
        raise CommandError(f"a scale must be positive and a merging distance not negative, not {scale:g} and {merge:g}")
    data = _read(path)
    if dim == 3:
        return _in_space(path, data, merge, scale)
    points = _plane(path, np.asarray(data.points, np.float64)) * scale
    cells, blocks, lines = _cells(path, data, len(points))
    _corners(path, points, cells)
    if merge > 0.0:
        number = _merged(points, merge)
        cells = np.where(cells >= 0, number[cells], -1)
        lines = {name: number[pairs] for name, pairs in lines.items()}
        _collapsed(path, cells, merge)
    turn = areas(points, cells) < 0.0
    counts = corner_counts(cells)
    for n in (3, 4):
        rows = np.flatnonzero(turn & (counts == n))
        cells[rows, :n] = cells[rows, :n][:, ::-1]
    used = np.zeros(len(points), bool)
    used[cells[cells >= 0]] = True
    number = np.where(used, np.cumsum(used) - 1, -1)
    cells = np.where(cells >= 0, number[cells], -1)
    mesh = Mesh.of(points[used], cells, blocks)
    check(mesh, f"{path} (elements and points counted from 0)")
    edges = mesh.edges()
    layers = {name: number[pairs] for name, pairs in lines.items()}
    for name, pairs in layers.items():
        if (pairs < 0).any() or (find_edges(edges, pairs, len(mesh.points)) < 0).any():
            raise HpcdemError(f"{path}: lines of the group '{name}' are not edges of the elements")
    return Mesh.of(mesh.points, mesh.cells, mesh.groups, layers)


def _in_space(path: Path, data: Any, merge: float, scale: float) -> Mesh:
    """Hexahedra and tetrahedra, with physical volumes as groups and physical surfaces as layers. Those that are turned
    inside out are turned back. Hexahedra come first."""
    points = np.asarray(data.points, np.float64) * scale
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise HpcdemError(f"{path}: finite points with three coordinates were expected")
    names = {(int(v[1]), int(v[0])): str(k) for k, v in getattr(data, "field_data", {}).items() if len(v) == 2}
    physical = data.cell_data.get("gmsh:physical")
    solids = {kind: [np.empty((0, n), np.int64)] for kind, n in SOLIDS.items()}
    groups: dict[str, list] = {}
    layers: dict[str, list] = {}
    for k, block in enumerate(data.cells):
        rows = np.asarray(block.data, np.int64)
        tags = np.zeros(len(rows), np.int64) if physical is None else np.asarray(physical[k], np.int64)
        if block.type not in (*SOLIDS, "triangle", "quad", "line", "vertex"):
            raise HpcdemError(
                f"{path}: block {k + 1} holds {len(rows)} elements of type '{block.type}'; in three dimensions only "
                "tetrahedra of four points and hexahedra of eight can be used"
            )
        if ((rows < 0) | (rows >= len(points))).any():
            raise HpcdemError(f"{path}: block {k + 1} names a point that is not in the file")
        for tag in np.unique(tags[tags != 0]).tolist():
            if block.type in SOLIDS:
                here = sum(map(len, solids[block.type])) + np.flatnonzero(tags == tag)
                groups.setdefault(names.get((3, tag), str(tag)), []).append((block.type, here))
            elif block.type in ("triangle", "quad"):
                layers.setdefault(names.get((2, tag), str(tag)), []).append(rows[tags == tag])
        if block.type in SOLIDS:
            solids[block.type].append(rows)
    number = _merged(points, merge) if merge > 0.0 else np.arange(len(points))
    tets, hexes = (number[np.concatenate(solids[kind])] for kind in SOLIDS)
    if not len(tets) + len(hexes):
        raise HpcdemError(f"{path}: there are no tetrahedra and no hexahedra")
    turned = volumes(points, tets) < 0.0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    turned = hexahedra.volumes(points, hexes).sum(axis=1) < 0.0
    hexes[turned] = hexes[turned][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    used = np.unique(np.concatenate([tets.reshape(-1), hexes.reshape(-1)]))
    place = np.full(len(points), -1, np.int64)
    place[used] = np.arange(len(used))
    sides = {n: hexahedra.triangles([place[number[of]] for of in p]) for n, p in layers.items()}
    made, n = Mesh.of_hexes(points[used], place[hexes], sides, place[tets]), len(hexes)

    def elements(kind: str, at: np.ndarray) -> np.ndarray:
        parts = hexahedra.PARTS
        return parts * n + at if kind == "tetra" else (parts * at[:, None] + np.arange(parts)).reshape(-1)

    of_groups = {name: np.concatenate([elements(*part) for part in parts]) for name, parts in groups.items()}
    mesh = Mesh.of(made.points, made.cells, _in_sets(of_groups, len(made.cells)), made.layers, hexes=made.hexes)
    check(mesh, f"{path} (elements and points counted from 0)")
    return mesh


def _read(path: Path) -> Any:
    meshio = optional.meshio()
    if not path.is_file():
        raise CommandError(f"{path}: there is no such file")
    said = io.StringIO()
    _know_plane_strain()
    try:
        # meshio prints what it cannot read and then ends the program.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        reason = " ".join(said.getvalue().split()) or str(error)
        raise HpcdemError(f"{path}: this is not a mesh that can be read ({reason or type(error).__name__})") from None


def _know_plane_strain() -> None:
    """Names that Abaqus gives to triangles and quads in plane strain; meshio has those in plane stress only."""
    with contextlib.suppress(ImportError, AttributeError):
        from meshio.abaqus._abaqus import abaqus_to_meshio_type as kinds

        for name, kind in (("CPE3", "triangle"), ("CPE4", "quad"), ("CPE4R", "quad")):
            kinds.setdefault(name, kind)


def _plane(path: Path, points: np.ndarray) -> np.ndarray:
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise HpcdemError(f"{path}: points with two or three coordinates were expected, found {points.shape}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise HpcdemError(f"{path}: point {bad[0] + 1} is not finite: {points[bad[0]].tolist()}")
    if points.shape[1] == 3:
        z = points[:, 2]
        off = np.abs(z - z[0])
        if off.max() > FLATNESS * float(np.ptp(points[:, :2], axis=0).max()):
            i = int(off.argmax())
            raise HpcdemError(
                f"{path}: point {i + 1} lies at z = {z[i]:g}, point 1 at z = {z[0]:g}: only meshes in the x-y plane "
                "can be used"
            )
    return points[:, :2].copy()


def _cells(path: Path, data: Any, n_points: int) -> tuple[np.ndarray, dict[str, dict], dict[str, np.ndarray]]:
    """Elements, element numbers by set and group, and pairs of points by name of a group of lines."""
    names = {(int(v[1]), int(v[0])): str(k) for k, v in getattr(data, "field_data", {}).items() if len(v) == 2}
    physical = data.cell_data.get("gmsh:physical")
    cells, first_of_block, seen = [np.empty((0, 4), np.int64)], [], 0
    groups: dict[str, list[np.ndarray]] = {}
    lines: dict[str, list[np.ndarray]] = {}
    for k, block in enumerate(data.cells):
        kind, rows = block.type, np.asarray(block.data)
        first_of_block.append(seen)
        tags = None if physical is None else np.asarray(physical[k], np.int64)
        if kind in CORNERS:
            rows = rows.astype(np.int64)
            out = np.flatnonzero(((rows < 0) | (rows >= n_points)).any(axis=1))
            if len(out):
                raise HpcdemError(f"{path}: element {seen + out[0] + 1} names a point that is not in the file")
            cells.append(np.column_stack([rows, np.full((len(rows), 4 - CORNERS[kind]), -1, np.int64)]))
            for tag in np.unique(tags) if tags is not None else ():
                if tag != 0:
                    name = names.get((2, int(tag)), str(tag))
                    groups.setdefault(name, []).append(seen + np.flatnonzero(tags == tag))
            seen += len(rows)
        elif kind == "line":
            for tag in np.unique(tags) if tags is not None else ():
                if tag != 0:
                    pairs = rows[tags == tag].astype(np.int64)
                    lines.setdefault(names.get((1, int(tag)), str(tag)), []).append(pairs)
        elif kind in SURFACES or block.dim > 2:
            raise HpcdemError(
                f"{path}: block {k + 1} holds {len(rows)} elements of type '{kind}', the first after element {seen}; "
                "only triangles of three points and quads of four can be used"
            )
    for name, per_block in getattr(data, "cell_sets", {}).items():
        if name.startswith("gmsh:"):
            continue
        found = [
            first_of_block[k] + np.asarray(r, np.int64)
            for k, r in enumerate(per_block)
            if r is not None and len(r) and data.cells[k].type in CORNERS
        ]
        if found:
            groups.setdefault(str(name), []).extend(found)
    if not seen:
        kinds = ", ".join(dict.fromkeys(b.type for b in data.cells)) or "none at all"
        raise HpcdemError(f"{path}: there are no triangles and no quads (element types: {kinds})")
    return (
        np.concatenate(cells),
        _in_sets({n: np.unique(np.concatenate(r)) for n, r in groups.items()}, seen),
        {n: np.concatenate(p) for n, p in lines.items()},
    )


def _in_sets(groups: dict[str, np.ndarray], n: int) -> dict[str, dict[str, np.ndarray]]:
    """Set -> group -> elements: all in SET, but for those that name elements another group has already."""
    taken = np.zeros(n, bool)
    out: dict[str, dict[str, np.ndarray]] = {}
    for name, rows in groups.items():
        set_name = name if taken[rows].any() else SET
        if set_name == SET:
            taken[rows] = True
        out.setdefault(set_name, {})[name] = rows
    return out


def _corners(path: Path, points: np.ndarray, cells: np.ndarray) -> None:
    """Refuse elements by their number in the file, while it is still known."""
    for n in (3, 4):
        rows = np.flatnonzero(corner_counts(cells) == n)
        corners = np.sort(cells[rows, :n], axis=1)
        twice = np.flatnonzero((corners[:, 1:] == corners[:, :-1]).any(axis=1))
        if len(twice):
            e = rows[twice[0]]
            raise HpcdemError(f"{path}: element {e + 1} has the same point twice: {(cells[e, :n] + 1).tolist()}")
        xy = points[cells[rows, :n]]
        side = np.roll(xy, -1, axis=1) - xy
        before = np.roll(side, 1, axis=1)
        turn = before[..., 0] * side[..., 1] - before[..., 1] * side[..., 0]
        least = 1e-9 * (side * side).sum(axis=2).max(axis=1)[:, None]
        bad = np.flatnonzero(~((turn > least).all(axis=1) | (turn < -least).all(axis=1)))
        if len(bad):
            e = rows[bad[0]]
            (x, y), what = points[cells[e, 0]], "is flat" if n == 3 else "is flat, folded or concave"
            kind = "triangle" if n == 3 else "quad"
            raise HpcdemError(
                f"{path}: element {e + 1} ({kind} of points {(cells[e, :n] + 1).tolist()}, at ({x:g}, {y:g})) {what}"
            )


def _merged(points: np.ndarray, distance: float) -> np.ndarray:
    """(n,) number of the lowest point of each cluster of points nearer than `distance` to each other."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(points), len(points)))
    _, label = connected_components(graph, directed=False)
    _, lowest = np.unique(label, return_index=True)
    return lowest[label]


def _collapsed(path: Path, cells: np.ndarray, merge: float) -> None:
    for n in (3, 4):
        rows = np.flatnonzero(corner_counts(cells) == n)
        corners = np.sort(cells[rows, :n], axis=1)
        bad = np.flatnonzero((corners[:, 1:] == corners[:, :-1]).any(axis=1))
        if len(bad):
            raise HpcdemError(
                f"{path}: merging points nearer than {merge:g} makes a line of element {rows[bad[0]] + 1}"
            )
