"""Meshes from files: Gmsh .msh and Abaqus .inp by readers of this package, VTK and whatever else by meshio."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.numerics.clusters import spots
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.connectivity import areas, corner_counts
from hpcdem.physics.fdem.mesh import Mesh, Names, check
from hpcdem.physics.fdem.tetrahedra import volumes
from hpcdem.pre.mesh import abaqus, gmsh_file, optional
from hpcdem.pre.mesh.file_mesh import CORNERS, DIMENSIONS, IN_WORDS, Block, FileMesh, listed

SET = "physical"
"""Set in which the groups of the file are put."""
INSTANCES = "instance"
"""Set of the instances of an assembly."""
FLATNESS = 1e-9
"""Largest distance of points from a plane z = constant, over the size of the model."""
OWN = dict(zip(optional.OWN_READERS, (gmsh_file.read, abaqus.read), strict=True))
FROM_0 = frozenset((".vtk", ".vtu", ".vtp", ".xdmf", ".xmf", ".off", ".ply", ".h5m"))
"""Files whose points and elements are counted from 0."""

Sets = dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True)
class Imported:
    """An imported mesh, with its groups of elements; groups of nodes and faces: set -> group -> numbers; notes: ignored
    or changed contents; files: files read.
    """

    mesh: Mesh
    nodes: Sets = field(default_factory=dict)
    faces: Sets = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)


def import_mesh(path: str | Path, merge: float = 0.0, scale: float = 1.0, dim: int = 2) -> Mesh:
    """Return the mesh of `read`."""
    return read(path, merge, scale, dim).mesh


def read(path: str | Path, merge: float = 0.0, scale: float = 1.0, dim: int = 2) -> Imported:
    """Read a mesh of triangles and quads in the x-y plane; dim 3: of tetrahedra and hexahedra (hexahedra precede).

    Physical groups (Gmsh) and sets (Abaqus) of elements and of points become groups of the set SET; one that overlaps
    an earlier one gets its own set, of the same name. Physical lines, in space surfaces, and surfaces of Abaqus become
    layers and groups of faces; physical points, in space lines, groups of nodes. Elements with clockwise or inverted
    orientation are reversed; elements of second order get straight edges; unused points are removed. merge: points
    nearer than this are merged [m, after scaling]; scale: metres per unit of the file.

    HpcdemError, with the numbers of the file, for unsupported contents.
    """
    path = Path(path)
    if not scale > 0.0 or not merge >= 0.0:
        raise CommandError(f"a scale must be positive and a merging distance not negative, not {scale:g} and {merge:g}")
    data = _read(path)
    bad = np.flatnonzero(~np.isfinite(data.points).all(axis=1))
    if len(bad):
        raise data.refuse(f"point {data.point(bad[0])} is not finite: {data.points[bad[0]].tolist()}")
    notes = list(data.notes)
    between = _straightened(data, notes, dim)
    _refuse_kinds(data, dim)
    points = (data.points if dim == 3 else _plane(data)) * scale
    number = spots(points, merge) if merge > 0.0 else np.arange(len(points))
    own, place = (_in_space if dim == 3 else _in_plane)(data, points, number, merge)
    return _with_names(data, own, place, between, notes)


@dataclass(frozen=True)
class _Own:
    """mesh: still without names; elements (n file elements,): first element of the mesh, -1 none; parts: how many it
    has; names: of elements and points, in the file."""

    mesh: Mesh
    elements: np.ndarray
    parts: np.ndarray
    names: Names


def _in_plane(data: FileMesh, points: np.ndarray, number: np.ndarray, merge: float) -> tuple[_Own, np.ndarray]:
    """Triangles and quads, in the order of the file, and the row of each point of the file in the mesh, -1 none."""
    of_mesh = np.concatenate([np.full(len(b.rows), DIMENSIONS[b.kind] == 2) for b in data.blocks])
    file = np.flatnonzero(of_mesh)
    rows = [b.rows for b in data.blocks if DIMENSIONS[b.kind] == 2]
    cells = np.concatenate([np.pad(r, ((0, 0), (0, 4 - r.shape[1])), constant_values=-1) for r in rows])
    _corners(data, points, cells, file)
    cells = np.where(cells >= 0, number[cells], -1)
    counts = corner_counts(cells)
    for n in (3, 4):
        at = np.flatnonzero(counts == n)
        _collapsed(data, cells[at, :n], file[at], merge)
        at = at[areas(points, cells[at]) < 0.0]
        cells[at, :n] = cells[at, :n][:, ::-1]
    used, place = _used(len(points), cells[cells >= 0])
    mesh = Mesh.of(points[used], np.where(cells >= 0, place[cells], -1))
    elements = np.where(of_mesh, np.cumsum(of_mesh) - 1, -1)
    names = Names(lambda p: data.point(used[p]), lambda e: data.element(file[e]))
    return _Own(mesh, elements, np.ones(len(elements), np.int64), names), place[number]


def _in_space(data: FileMesh, points: np.ndarray, number: np.ndarray, merge: float) -> tuple[_Own, np.ndarray]:
    """Hexahedra and tetrahedra, and the row of each point of the file in the mesh, -1 none."""
    firsts = data.firsts
    of: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for kind in ("tetra", "hexahedron"):
        at = [k for k, b in enumerate(data.blocks) if b.kind == kind]
        rows = np.concatenate([np.empty((0, CORNERS[kind]), np.int64), *(data.blocks[k].rows for k in at)])
        file = np.concatenate([np.empty(0, np.int64), *(np.arange(firsts[k], firsts[k + 1]) for k in at)])
        _collapsed(data, rows, file, 0.0)
        _collapsed(data, number[rows], file, merge)
        of[kind] = number[rows], file
    tets, hexes = of["tetra"][0], of["hexahedron"][0]
    turned = volumes(points, tets) < 0.0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    turned = hexahedra.volumes(points, hexes).sum(axis=1) < 0.0
    hexes[turned] = hexes[turned][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    used, place = _used(len(points), np.concatenate([tets.ravel(), hexes.ravel()]))
    mesh = Mesh.of_hexes(points[used], place[hexes], more=place[tets])
    n, elements, parts = len(hexes), np.full(firsts[-1], -1), np.ones(firsts[-1], np.int64)
    elements[of["hexahedron"][1]] = hexahedra.PARTS * np.arange(n)
    parts[of["hexahedron"][1]] = hexahedra.PARTS
    elements[of["tetra"][1]] = hexahedra.PARTS * n + np.arange(len(tets))
    file = np.concatenate([np.repeat(of["hexahedron"][1], hexahedra.PARTS), of["tetra"][1]])
    names = Names(lambda p: data.point(used[p]), lambda e: data.element(file[e]))
    return _Own(mesh, elements, parts, names), place[number]


def _used(n: int, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that elements use, and the place of each (n,) among them, -1: none."""
    used, place = np.unique(corners), np.full(n, -1, np.int64)
    place[used] = np.arange(len(used))
    return used, place


# ---- names of parts ------------------------------------------------------------------------------------------------


def _with_names(data: FileMesh, own: _Own, place: np.ndarray, between: np.ndarray, notes: list[str]) -> Imported:
    """The mesh with groups and layers; place (points of the file,): their rows in the mesh, -1: none; between: points
    that straight elements have lost."""
    mesh, dim = own.mesh, own.mesh.dim
    check(mesh, str(data.path), own.names)
    kinds = np.concatenate([np.full(len(b.rows), DIMENSIONS[b.kind]) for b in data.blocks])
    elements: dict[str, np.ndarray] = {}
    nodes: dict[str, list[np.ndarray]] = {}
    sides: dict[str, list[np.ndarray]] = {name: list(of) for name, of in data.face_sets.items()}
    for name, numbers in data.element_sets.items():
        mine = numbers[kinds[numbers] == dim]
        if len(mine):
            elements[name] = _parts(own, mine)
        for block, at in _by_block(data, numbers[kinds[numbers] == dim - 1]):
            sides.setdefault(name, []).append(block.rows[at])
        for block, at in _by_block(data, numbers[kinds[numbers] < dim - 1]):
            nodes.setdefault(name, []).append(block.rows[at].ravel())
    empty = [f"'{name}'" for name, numbers in data.element_sets.items() if not len(numbers)]
    if empty:
        notes.append(f"sets without an element that is read: {listed(empty)}")
    for name, rows in data.node_sets.items():
        nodes.setdefault(name, []).append(rows[~np.isin(rows, between)])
    layers, faces = _on_sides(data, mesh, sides, place, notes)
    at_nodes = {name: place[np.unique(np.concatenate(rows))] for name, rows in nodes.items()}
    for name, rows in at_nodes.items():
        if (rows < 0).any():
            notes.append(f"{int((rows < 0).sum())} points of the set '{name}' that belong to no element")
    at_nodes = {name: np.unique(rows[rows >= 0]) for name, rows in at_nodes.items() if (rows >= 0).any()}
    groups = _in_sets(elements, len(mesh.cells))
    whole = {name: _parts(own, numbers[kinds[numbers] == dim]) for name, numbers in data.instances.items()}
    if whole:
        groups[INSTANCES] = {**groups.get(INSTANCES, {}), **{name: rows for name, rows in whole.items() if len(rows)}}
    return Imported(
        Mesh.of(mesh.points, mesh.cells, groups, layers, macros=mesh.macros),
        _in_sets(at_nodes, len(mesh.points)),
        _in_sets(faces, 4 * len(mesh.cells)),
        notes,
        data.files,
    )


def _on_sides(
    data: FileMesh, mesh: Mesh, sides: dict[str, list[np.ndarray]], place: np.ndarray, notes: list[str]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Lines, in space surfaces, of the file as layers, and the faces of elements on them, by their names."""
    edges, dim = mesh.edges(), mesh.dim
    layers: dict[str, np.ndarray] = {}
    faces: dict[str, np.ndarray] = {}
    for name, of in sides.items():
        given = _cut([place[rows] for rows in of if len(rows)], dim)
        rows = mesh.find_edges(edges, given)
        lost = (given < 0).any(axis=1) | (rows < 0)
        if len(mesh.hexes):  # a surface through a hexahedron is none of its sides
            lost |= mesh.inside_macros(edges.faces[rows, 0])
        if lost.any():
            what = "lines" if dim == 2 else "surfaces"
            text = f"{what} of the group '{name}' are not {'edges' if dim == 2 else 'faces'} of the elements"
            if data.strict:
                raise data.refuse(text)
            notes.append(f"{int(lost.sum())} {text}")
        if (~lost).any():
            layers[name] = given[~lost]
            both = edges.faces[rows[~lost]].ravel()
            faces[name] = np.unique(both[both >= 0])
    return layers, faces


def _parts(own: _Own, numbers: np.ndarray) -> np.ndarray:
    """Elements of the mesh of these of the file."""
    first, parts = own.elements[numbers], own.parts[numbers]
    return np.repeat(first, parts) + np.concatenate([np.arange(n) for n in parts] or [np.empty(0, np.int64)])


def _by_block(data: FileMesh, numbers: np.ndarray) -> list[tuple[Block, np.ndarray]]:
    firsts = data.firsts
    of = np.searchsorted(firsts, numbers, side="right") - 1
    return [(data.blocks[k], numbers[of == k] - firsts[k]) for k in np.unique(of).tolist()]


def _cut(sides: list[np.ndarray], dim: int) -> np.ndarray:
    """Lines, in space triangles: sides of hexahedra as their elements are cut."""
    return np.concatenate([np.empty((0, 2), np.int64), *sides]) if dim == 2 else hexahedra.triangles(sides)


def _in_sets(groups: dict[str, np.ndarray], n: int) -> Sets:
    """Set -> group -> numbers: all in SET, but for those that name one that another group has already."""
    taken = np.zeros(n, bool)
    out: Sets = {}
    for name, rows in groups.items():
        rows = np.unique(rows)
        set_name = name if taken[rows].any() else SET
        if set_name == SET:
            taken[rows] = True
        out.setdefault(set_name, {})[name] = rows
    return out


# ---- what a file holds ---------------------------------------------------------------------------------------------


def _read(path: Path) -> FileMesh:
    if not path.is_file():
        raise CommandError(f"{path}: there is no such file")
    kind = path.suffix.lower()
    fluent = kind == ".msh" and path.read_bytes()[:1] == b"("  # meshes of another program have the same ending
    return _by_meshio(path) if kind not in OWN or fluent else OWN[kind](path)


def _by_meshio(path: Path) -> FileMesh:
    meshio = optional.meshio()
    known = sorted(meshio.extension_to_filetypes)
    if path.suffix.lower() not in known:
        raise HpcdemError(f"{path}: files *{path.suffix} are not supported; known: {', '.join(known)}")
    text = io.StringIO()
    try:
        # meshio prints what it cannot read and then ends the program.
        with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
            found = meshio.read(path)
    except (Exception, SystemExit):
        raise HpcdemError(f"{path}: not a readable mesh: damaged, or not a *{path.suffix} file") from None
    points = np.asarray(found.points, np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise HpcdemError(f"{path}: expected points with two or three coordinates, found {points.shape}")
    start = 0 if path.suffix.lower() in FROM_0 else 1
    made = FileMesh(path, np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), np.arange(len(points)) + start, [])
    count = 0
    for block in found.cells:
        rows = (
            np.asarray(block.data, np.int64)
            if not isinstance(block.data, list)
            else np.empty((len(block.data), 0), int)
        )
        ids = np.arange(count, count + len(rows)) + start
        out: Any = np.flatnonzero(((rows < 0) | (rows >= len(points))).any(axis=1)) if rows.size else []
        if len(out):
            raise HpcdemError(f"{path}: element {ids[out[0]]} names a point that is not in the file")
        made.blocks.append(Block(block.type.rstrip("0123456789"), rows, ids, block.type))
        count += len(rows)
    firsts = made.firsts
    for name, parts in found.cell_sets.items():
        at = [firsts[k] + np.asarray(r, np.int64) for k, r in enumerate(parts) if r is not None and len(r)]
        if at:
            made.element_sets[str(name)] = np.concatenate(at)
    for name, rows in found.point_sets.items():
        made.node_sets[str(name)] = np.asarray(rows, np.int64)
    lost = [*found.point_data, *found.cell_data, *found.field_data]
    made.notes += [f"data of points and elements ({listed(lost)})"] if lost else []
    return made


def _straightened(data: FileMesh, notes: list[str], dim: int) -> np.ndarray:
    """Elements of second order keep their corners. The points (rows) that only they had between them."""
    count: dict[str, int] = {}
    between, corners = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for k, block in enumerate(data.blocks):
        n = CORNERS.get(block.kind, block.rows.shape[1])
        corners.append(block.rows[:, :n].ravel())
        if block.rows.shape[1] > n:
            between.append(block.rows[:, n:].ravel())
            data.blocks[k] = Block(block.kind, block.rows[:, :n], block.ids, block.label)
            if DIMENSIONS[block.kind] > 1:
                count[block.label] = count.get(block.label, 0) + len(block.ids)
    notes += [
        f"points between the corners of {n} elements ({kind}): their edges are straight" for kind, n in count.items()
    ]
    if dim == 2 and any(block.label in count and block.kind == "triangle" for block in data.blocks):
        notes[-1] += "; mesh quadratic makes six-node triangles of a mesh of triangles"
    return np.setdiff1d(np.concatenate(between), np.concatenate(corners))


def _refuse_kinds(data: FileMesh, dim: int) -> None:
    """HpcdemError for what is no element of a model of this dimension."""
    kinds: dict[str, int] = {}
    for block in data.blocks:
        kinds[block.label] = kinds.get(block.label, 0) + len(block.rows)
        if DIMENSIONS.get(block.kind, 4) > dim:
            can = ("triangles and quads can be used in two dimensions" if dim == 2 else
                   "tetrahedra and hexahedra can be used in three dimensions")  # fmt: skip
            three = "; model new dim 3 makes a model for it" if dim == 2 and DIMENSIONS.get(block.kind) == 3 else ""
            name = IN_WORDS.get(block.kind, f"elements of type '{block.label}'")
            raise data.refuse(
                f"{len(block.rows)} {name} ({block.label}), the first of them element {block.ids[0]}: only {can}{three}"
            )
    if not any(DIMENSIONS[block.kind] == dim for block in data.blocks):
        lacks = "no triangles and no quads" if dim == 2 else "no tetrahedra and no hexahedra"
        held = ", ".join(f"{n} of {label}" for label, n in kinds.items()) or "none at all"
        plane = dim == 3 and any(DIMENSIONS[block.kind] == 2 for block in data.blocks)
        advice = "; model new dim 2 makes a model for these" * plane
        raise data.refuse(f"there are {lacks} (elements: {held}){advice}")


def _plane(data: FileMesh) -> np.ndarray:
    points = data.points
    if not len(points):
        raise data.refuse("the file has no points")
    used = np.unique(np.concatenate([b.rows.ravel() for b in data.blocks if DIMENSIONS[b.kind] == 2]))
    z = points[used, 2]
    off = np.abs(z - z[0])
    if off.max() > FLATNESS * float(np.ptp(points[used, :2], axis=0).max()):
        i = int(off.argmax())
        raise data.refuse(
            f"point {data.point(used[i])} lies at z = {z[i]:g}, point {data.point(used[0])} at z = {z[0]:g}: only "
            "meshes in the x-y plane can be used in two dimensions"
        )
    return points[:, :2].copy()


def _corners(data: FileMesh, points: np.ndarray, cells: np.ndarray, file: np.ndarray) -> None:
    """Refuse elements of the plane that are flat, folded or concave; file: their numbers in it, over all blocks."""
    for n in (3, 4):
        rows = np.flatnonzero(corner_counts(cells) == n)
        _collapsed(data, cells[rows, :n], file[rows], 0.0)
        xy = points[cells[rows, :n]]
        side = np.roll(xy, -1, axis=1) - xy
        before = np.roll(side, 1, axis=1)
        turn = before[..., 0] * side[..., 1] - before[..., 1] * side[..., 0]
        least = 1e-9 * (side * side).sum(axis=2).max(axis=1)[:, None]
        bad = np.flatnonzero(~((turn > least).all(axis=1) | (turn < -least).all(axis=1)))
        if len(bad):
            e = rows[bad[0]]
            (x, y), what = points[cells[e, 0]], "is flat" if n == 3 else "is flat, folded or concave"
            kind, of = ("triangle" if n == 3 else "quad"), ", ".join(data.point(p) for p in cells[e, :n])
            raise data.refuse(f"element {data.element(file[e])} ({kind} of points {of}, at ({x:g}, {y:g})) {what}")


def _collapsed(data: FileMesh, rows: np.ndarray, file: np.ndarray, merge: float) -> None:
    """HpcdemError if an element has a point twice: in the file, or once points are merged."""
    corners = np.sort(rows, axis=1)
    bad = np.flatnonzero((corners[:, 1:] == corners[:, :-1]).any(axis=1))
    if not len(bad):
        return
    name = data.element(file[bad[0]])
    if merge > 0.0:
        raise data.refuse(f"merging points nearer than {merge:g} m collapses an edge of element {name}")
    raise data.refuse(f"element {name} has the same point twice: {', '.join(data.point(p) for p in rows[bad[0]])}")
