"""Meshes of bodies, and the cracks in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hpcdem.commands.fdem import assignments, values
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.geometry import shape
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.connectivity import areas
from hpcdem.physics.fdem.connectivity import bodies as bodies_of
from hpcdem.physics.fdem.groups import DEFAULT, ELEMENT, FACE, NODE, Range
from hpcdem.physics.fdem.mesh import Mesh, check, crack_rows
from hpcdem.physics.fdem.tetrahedra import volumes
from hpcdem.pre.mesh import cracks as cracks_of
from hpcdem.pre.mesh import (
    fill,
    fit,
    fracture_discs,
    fractures,
    geometry,
    imported,
    quadratic,
    quadtree,
    quality,
    remade,
    structured,
    structured_space,
)
from hpcdem.pre.mesh import glue as glue_of
from hpcdem.pre.mesh import patch as patches
from hpcdem.pre.mesh.pieces import Piece
from hpcdem.pre.mesh.regions import polygon_of
from hpcdem.pre.mesh.sizes import Refinement
from hpcdem.pre.mesh.triangulate import Meshed, MeshSettings, Region, triangulate

ARC_STEPS = 360
"""Number of sides per size of the outline of a fracture network that replace its arcs."""


def create(
    project: Project,
    from_layer: str,
    size: float,
    type: str = "tri",
    group: str = DEFAULT,
    set_name: str = DEFAULT,
    refine_layer: Sequence[tuple[str, float, float | None]] = (),
    hole: Sequence[str] = (),
    region: Sequence[tuple[str, str | None]] = (),
    embed: Sequence[str] = (),
    crack: Sequence[str] = (),
    irregular: bool = False,
    smooth: bool = False,
    bodies: bool = False,
) -> None:
    """Mesh the inside of a layer with Gmsh. type: "tri" or "quad"; irregular: unstructured triangles; smooth: place
    inner points at the mean of their neighbours. Collective.

    refine_layer: (layer, element size there [m], distance over which it grows [m] or None); hole: layers whose inside
    is not meshed; region: (layer, group, default its name) of parts with their own group; embed: layers that become
    edges; crack: layers that become edges with a crack. In space embed and crack are layers of surfaces, which become
    faces; bodies: each body of the outline is a group, named as in its file, otherwise by the layer and its number.
    """
    regions = [(layer, name or layer) for layer, name in region]
    named = (*(one[0] for one in refine_layer), *(one[0] for one in regions))
    for layer in (from_layer, *named, *hole, *embed, *crack):
        _ = project.layers[layer]
    if project.dim == 3:
        others = {"type": type != "tri", "irregular": irregular, "smooth": smooth}
        lost = [word for word, given in others.items() if given]
        if lost:
            raise CommandError(f"{lost[0]} of mesh create is for two dimensions")
        _fill(project, from_layer, size, group, set_name, refine_layer, hole, regions, embed, crack, bodies)
        return
    if bodies:
        raise CommandError("bodies of mesh create is for three dimensions")
    first = 0 if project.mesh is None else int(project.mesh.crack_sets.max(initial=-1)) + 1
    settings = MeshSettings(
        [Region(layer, name, set_name) for layer, name in ((from_layer, group), *regions)],
        size,
        type,
        hole,
        embed,
        [(layer, first + k) for k, layer in enumerate(crack)],
        refine=[Refinement(layer, fine, distance=distance) for layer, fine, distance in refine_layer],
        irregular=irregular,
        smooth=smooth,
    )
    made: Meshed = project.comm.per_node(lambda: triangulate(project.layers, settings), once=True)
    for note in made.notes:
        _log(project, note)
    _add(project, lambda: made.mesh)


def _fill(
    project: Project,
    outline: str,
    size: float,
    group: str,
    set_name: str,
    refine: Sequence[tuple[str, float, float | None]],
    holes: Sequence[str],
    regions: Sequence[tuple[str, str]],
    embedded: Sequence[str],
    cracks: Sequence[str],
    bodies: bool,
) -> None:
    layers = project.layers
    own = [(getattr(one, "name", "") or f"{outline} {k + 1}", [one]) for k, one in enumerate(layers[outline])]
    settings = fill.MeshSettings(
        layers[outline],
        size,
        [one for layer in holes for one in layers[layer]],
        [*(own if bodies else ()), *((name, layers[layer]) for layer, name in regions)],
        [(layers[layer], fine, distance) for layer, fine, distance in refine],
        [(layer, layers[layer]) for layer in (*embedded, *cracks)],
    )
    made: fill.Filled = project.comm.per_node(lambda: fill.filled(settings, group), once=True)
    for note in made.notes:
        _log(project, note)
    first = 0 if project.mesh is None else int(project.mesh.crack_sets.max(initial=-1)) + 1

    def make() -> Mesh:
        mesh = Mesh.of(made.points, made.cells, {set_name: made.groups}, made.faces)
        for k, layer in enumerate(cracks):
            mesh = cracks_of.with_cracks(mesh, made.faces[layer], first + k)
        return mesh

    _add(project, make)


def brick(
    project: Project,
    p0: tuple[float, ...],
    p1: tuple[float, ...],
    p2: tuple[float, ...],
    n: tuple[int, ...],
    p3: tuple[float, ...] | None = None,
    ratio: tuple[float, ...] | None = None,
    triangle: bool = True,
    group: str = DEFAULT,
    set_name: str = DEFAULT,
) -> None:
    """Make a regular mesh of a parallelogram, in space a parallelepiped, with edges from the corner p0 to the other
    points [m]. n: cells along each edge; ratio: size of each cell over that of the previous one; triangle: make
    triangles or tetrahedra, else quads or hexahedra. Its sides are the layers of `grid`.
    """
    name = (set_name, group)

    def make() -> Mesh:
        grid = values.brick(p0, [p1, p2, *([] if p3 is None else [p3])], n, ratio)
        if grid.shape[-1] == 2:
            return structured.of_grid(grid, "tri" if triangle else "quad", group=name)
        return structured_space.of_grid(grid, group=name) if triangle else structured_space.hexes_of_grid(grid, name)

    _add(project, make)


def patch(
    project: Project,
    pieces: Sequence[Piece],
    size: float | None = None,
    tolerance: float = 0.0,
    group: str = DEFAULT,
    set_name: str = DEFAULT,
) -> None:
    """Mesh the inside of closed lines with triangles by Gmsh; each piece may have its own size. Collective.

    pieces: lines and points; size [m]: element size of pieces without their own (default: the largest size of the
    pieces); tolerance [m]: an end or point nearer than this to an earlier one coincides with it.
    """
    if project.dim == 3:
        raise CommandError("lines bound a mesh in two dimensions only")
    shaped = [(piece, shape(*piece.shape) if piece.shape else []) for piece in pieces]
    layers, settings = patches.settings(project.layers, shaped, size, tolerance, (set_name, group))
    made: Meshed = project.comm.per_node(lambda: triangulate(layers, settings), once=True)
    for note in made.notes:
        _log(project, note)
    mesh = made.mesh
    named = {name: rows for name, rows in mesh.layers.items() if name in project.layers}
    _add(project, lambda: Mesh.of(mesh.points, mesh.cells, mesh.groups, named, mesh.cracks, mesh.crack_sets))


def grid(
    project: Project,
    first: tuple[float, ...],
    second: tuple[float, ...],
    cells: tuple[int, ...],
    type: str | None = None,
    diagonal: str = "alternate",
    split: int = 6,
    group: str = DEFAULT,
    set_name: str = DEFAULT,
    ratio: tuple[float, ...] | None = None,
) -> None:
    """Make a regular mesh of the rectangle, in space the box, between two corners [m]. cells: along x and y (and z);
    type: "tri" or "quad", in space "tet" (split: tetrahedra per cell) or "hex"; ratio: size of each cell over that of
    the previous one. Its sides are the layers left, right, bottom and top, in space also front and back.
    """
    lines = values.grid_lines(first, second, cells, ratio or (1.0,) * len(first))
    name = (set_name, group)

    def make() -> Mesh:
        if len(lines) == 2:
            return structured.rectangle(*lines, type or "tri", diagonal, name)
        return structured_space.hexes(lines, name) if type == "hex" else structured_space.box(lines, split, name)

    _add(project, make)


def equilateral(
    project: Project,
    first: tuple[float, float],
    second: tuple[float, float],
    size: float,
    group: str = DEFAULT,
    set_name: str = DEFAULT,
) -> None:
    """Mesh the rectangle between two corners [m] with nearly equilateral triangles with edges of about `size` [m]."""
    corner = min(first[0], second[0]), min(first[1], second[1])
    width, height = abs(second[0] - first[0]), abs(second[1] - first[1])
    _add(project, lambda: structured.equilateral(corner, width, height, size, (set_name, group)))


def import_file(
    project: Project,
    file: str,
    group: str | None = None,
    set_name: str = DEFAULT,
    merge: float = 0.0,
    scale: float = 1.0,
) -> None:
    """Import a mesh file of another program. group: of all elements; merge: merge points nearer than this [m]; scale:
    metres per unit of the file. Collective.
    """
    path = project.to_read(file)
    found = project.comm.per_node(lambda: imported.read(path, merge, scale, project.dim), once=True)
    for included in found.files:
        project.to_read(str(included.absolute()))
    project.take_added()  # the file's come after them
    cells, points = (0, 0) if project.mesh is None else (len(project.mesh.cells), len(project.mesh.points))
    mesh = _add(project, lambda: found.mesh)
    for kind, sets, first in ((NODE, found.nodes, points), (FACE, found.faces, 4 * cells)):
        for of_set, groups in sets.items():
            for name, numbers in groups.items():
                project.groups[kind].assign(numbers + first, name, of_set)
    if group is not None:
        project.groups[ELEMENT].assign(range(cells, cells + len(mesh.cells)), group, set_name)
    low, high = (", ".join(f"{c:g}" for c in at) for at in (mesh.points.min(axis=0), mesh.points.max(axis=0)))
    apart = project.comm.per_node(lambda: int(bodies_of(mesh.face_partners()).max()) + 1)
    note = f"{apart} bodies, which interact by contact" if apart > 1 else "one body"
    _log(project, f"{path.name}: from ({low}) to ({high}) m, {note}")
    for kind, sets in ((ELEMENT, mesh.groups), (NODE, found.nodes), (FACE, found.faces)):
        names = [f"set '{name}': " + ", ".join(f"'{group}'" for group in of) for name, of in sets.items()]
        if names:
            _log(project, f"{path.name}: groups of {kind}s, {'; '.join(names)}")
    if found.notes:
        _log(project, f"{path.name}: left out: " + "; ".join(found.notes))
    whole = project.whole_mesh()
    unfit = project.comm.per_node(lambda: fit.fit(whole, cells).description())
    if unfit and project.log is not None:
        project.log.warn(f"{path.name}: {unfit}")


def intersect(project: Project, layer: str, follow: bool = False) -> None:
    """Turn the joints on a layer into cracks. follow: the lines of the layer are not edges of the mesh, and the edges
    that follow them best are used; in space, the faces between elements on opposite sides of a surface.
    """
    mesh = project.whole_mesh()
    cracked = project.comm.per_node(lambda: _cracked(project, mesh, layer, follow))
    if len(cracked.cracks) == len(mesh.cracks):
        advice = "" if follow else "; follow uses the nearest edges"
        raise CommandError(f"no joint lies on layer '{layer}'{advice}")
    if project.in_use:

        def new() -> np.ndarray:
            edges = mesh.edges()
            rows = crack_rows(cracked, edges)
            joints = edges.faces[rows[~np.isin(rows, crack_rows(mesh, edges))]]
            return joints[project.alive[joints // 4].all(axis=1), 0]  # others are, once they are back

        changes.crack(project.blocks, project.comm.per_node(new))
        project.mesh = cracked
    else:
        project.replace_mesh(cracked)


def _cracked(project: Project, mesh: Mesh, layer: str, follow: bool) -> Mesh:
    """The mesh with cracks on a layer, see `intersect`."""
    number = int(mesh.crack_sets.max(initial=-1)) + 1
    if mesh.dim == 3:
        if layer in mesh.layers and not follow:
            faces = mesh.layers[layer]
        else:
            faces = (cracks_of.between_sides if follow else cracks_of.faces_on)(mesh, project.layers[layer])
        return cracks_of.with_layer(cracks_of.with_cracks(mesh, faces, number), layer, faces)
    if follow:
        size = float(np.sqrt(mesh.areas().mean()))
        return cracks_of.follow(mesh, fractures.of_curves(project.layers[layer], number, size))
    pairs = mesh.layers[layer] if layer in mesh.layers else cracks_of.edges_on(mesh, project.layers[layer])
    return cracks_of.with_cracks(mesh, pairs, number)


def glue(
    project: Project,
    tolerance: float | None = None,
    between: tuple[str, str] | None = None,
    set_name: str = DEFAULT,
    where: Range | None = None,
) -> None:
    """Connect bodies that were meshed separately where their faces coincide; these become joints. Elements whose faces
    differ are cut. tolerance: merge points nearer than this [m]; between: only faces between the elements of two
    groups; where: only faces between elements of a range and any others. Collective.
    """
    mesh = project.whole_mesh()
    project.refuse_in_use("bodies are glued")
    sides = None
    if between is not None:
        one, other = (project.groups[ELEMENT].members(name, set_name) for name in between)
        numbers = np.arange(len(mesh.cells))
        sides = np.isin(numbers, one), np.isin(numbers, other)
    elif where is not None:
        some = np.isin(np.arange(len(mesh.cells)), everything(project, ELEMENT, where))
        sides = some, np.ones(len(some), bool)
    made: glue_of.Glued = project.comm.per_node(lambda: glue_of.glued(mesh, tolerance, sides), once=True)
    if not made.faces:
        _log(project, "glue: the mesh is already one body")
        return
    project.refit(made)
    merged = len(mesh.points) - len(np.unique(made.points))
    _log(
        project,
        f"glue: {made.faces} faces of different bodies are joints now, {merged} points were merged (within "
        f"{made.tolerance:g} m)",
    )
    if made.cut:
        before, after = (quality.altitudes(one).min() for one in (mesh, made.mesh))
        _log(
            project,
            f"glue: {made.cut} elements were cut at hanging nodes, which adds "
            f"{len(made.mesh.cells) - len(mesh.cells)} elements; the smallest altitude was {before:.3g} m and is now "
            f"{after:.3g} m",
        )


def delete(project: Project, where: Range | None = None) -> None:
    """Delete elements. Before the first model or condition they are deleted from the mesh and the others are
    renumbered; later they are removed as by `null`. Collective.
    """
    elements = everything(project, ELEMENT, where)
    if project.in_use:
        assignments.null(project, where=where)
        return
    made = project.comm.per_node(lambda: remade.without(project.whole_mesh(), elements), once=True)
    lost = len(project.whole_mesh().cells) - len(made.parent)
    project.refit(made)
    _log(project, f"element delete: {lost} elements deleted, {len(made.parent)} left")


def densify(
    project: Project, maximum_length: Sequence[float], pattern: tuple[int, int] = (1, 1), where: Range | None = None
) -> None:
    """Halve quads along x, along y or both (pattern, 0 or 1) until they are no longer than maximum_length [m], one
    number or one per direction. Neighbours are refined so that no side has more than one hanging point; quads with
    hanging points become triangles. Collective.
    """
    project.refuse_in_use("elements are densified")
    mesh = project.whole_mesh()
    elements, most = everything(project, ELEMENT, where), (maximum_length[0], maximum_length[-1])
    made = project.comm.per_node(lambda: quadtree.densified(mesh, elements, pattern, most), once=True)
    project.refit(made)
    _log(project, f"element densify: {len(made.parent) - len(mesh.cells)} more elements, {len(made.parent)} in all")


def six_nodes(project: Project) -> None:
    """Turn each triangle into a six-node triangle: four elements with quadratic displacements. A new node between two
    nodes of a group joins this group. Collective.
    """
    project.refuse_in_use("elements get more nodes")
    mesh = project.whole_mesh()
    made = project.comm.per_node(lambda: quadratic.quadratic(mesh), once=True)
    project.refit(made)
    ends = mesh.edges().points
    for sets in project.groups[NODE].sets.values():
        for name, members in sets.items():
            between = len(mesh.points) + np.flatnonzero(np.isin(ends, members).all(axis=1))
            sets[name] = np.unique(np.concatenate([members, between]))
    count, points = len(made.mesh.macros), len(made.mesh.points)
    _log(project, f"mesh quadratic: {count} six-node triangles of 4 elements each, {points} points")


def add_nodes(project: Project, points: Sequence[tuple[float, ...]]) -> None:
    """Add nodes [m] for elements to be added next; their numbers follow those of the mesh."""
    project.refuse_in_use("nodes are added")
    if any(len(at) != project.dim for at in points):
        raise CommandError(f"a node needs {project.dim} coordinates")
    project.added[0].extend(points)


def add_element(project: Project, corners: Sequence[int]) -> None:
    """Add an element by the numbers of its nodes, in either orientation: a triangle or quad, in space a tetrahedron."""
    project.refuse_in_use("elements are added")
    known = np.empty((0, project.dim)) if project.mesh is None else project.mesh.points
    points = np.concatenate([known, np.array(project.added[0], np.float64).reshape(-1, project.dim)])
    lost = [number for number in corners if number >= len(points)]
    if lost:
        raise CommandError(f"there is no node {lost[0]}; available: {len(points)}, numbered from 0")
    if len(corners) not in ((3, 4) if project.dim == 2 else (4,)):
        raise CommandError(f"an element has {'3 or 4' if project.dim == 2 else '4'} nodes, not {len(corners)}")
    cells = np.array([[*corners, -1][:4]])
    turned = (areas(points, cells) if project.dim == 2 else volumes(points, cells))[0] < 0.0
    project.added[1].append(tuple(corners[:1]) + tuple(reversed(corners[1:])) if turned else tuple(corners))


def scale(project: Project, factors: tuple[float, ...]) -> None:
    """Multiply the coordinates x and y (and z) of all points of the mesh by factors."""
    if len(factors) != project.dim or not all(factor > 0.0 for factor in factors):
        raise CommandError(f"scale needs {project.dim} factors above 0, not {factors}")
    _move(project, np.array(factors), 0.0, "scaled")


def translate(project: Project, vector: tuple[float, ...]) -> None:
    """Translate all points of the mesh by a vector [m]."""
    _move(project, 1.0, np.array(vector), "moved")


def _move(project: Project, factor: Any, shift: Any, what: str) -> None:
    mesh = project.whole_mesh()
    project.refuse_in_use(f"the mesh is {what}")

    def make() -> Mesh:
        moved = replace(mesh, points=mesh.points * factor + shift)
        check(moved)
        return moved

    project.replace_mesh(project.comm.per_node(make))


def report_quality(project: Project) -> None:
    """Log sizes and angles of the mesh."""
    mesh = project.whole_mesh()
    for line in project.comm.per_node(lambda: quality.quality(mesh).lines()):
        _log(project, line)


def fracture_network(
    project: Project,
    layer: str,
    inside: str,
    orientation: tuple[str, float, float],
    length: tuple[str, float, float, float, float | None],
    density: tuple[str, float],
    seed: int,
    holes: Sequence[str] = (),
    scanline: float = 0.0,
    ends_at: float = 0.0,
    reached: bool = False,
    least: float = 0.0,
) -> None:
    """Generate a set of fractures with given statistics (see `values.fracture_set`) inside one layer and add them as
    lines to another. least: discard shorter pieces at the boundary [m]. Collective.
    """
    outline = project.layers[inside]
    for hole in holes:
        _ = project.layers[hole]
    size = max(curve.length() for curve in outline) / ARC_STEPS
    if size <= 0.0:
        raise CommandError(f"layer '{inside}' has no closed line")
    one = values.fracture_set(orientation, length, density, scanline, ends_at, reached)
    number, project.networks = project.networks, project.networks + 1

    def make() -> fractures.Fractures:
        return fractures.network([one], polygon_of(project.layers, [inside], size, holes), seed, least, number)

    found = project.comm.per_node(make, once=True)
    project.layers.add(layer, *(geometry.polyline(ends.tolist()) for ends in found.ends))
    _log(project, f"layer '{layer}': {len(found)} fractures of together {found.lengths().sum():g} m")


def disc_network(project: Project, layer: str, inside: str, *, seed: int, **statistics: Any) -> None:
    """Generate a set of discs with given statistics (see `values.disc_set`) around the bodies of one layer and add them
    as surfaces to another. Collective.
    """
    bodies, one = project.layers[inside], values.disc_set(**statistics)
    number, project.networks = project.networks, project.networks + 1
    found = project.comm.per_node(lambda: fracture_discs.discs(one, bodies, seed, number), once=True)
    project.layers.add(layer, *found)
    _log(project, f"layer '{layer}': {len(found)} discs of together {fracture_discs.area(found):g} m2")


def _add(project: Project, make: Callable[[], Mesh]) -> Mesh:
    """The mesh that this makes, the same on all ranks, is one more body."""

    def checked() -> tuple[Mesh, str]:
        mesh = make()
        check(mesh)
        macro = mesh.macro
        kinds = {f"{macro.plural} of {macro.stored} elements each": len(mesh.macros)}
        alone = mesh.cells[mesh.macro_of() < 0]
        if mesh.dim == 3:
            kinds["tetrahedra"] = len(alone)
        else:
            triangles = int((alone[:, 3] < 0).sum())
            kinds |= {"triangles": triangles, "quads": len(alone) - triangles}
        parts = [f"{count} {kind}" for kind, count in kinds.items() if count]
        return mesh, f"mesh: {', '.join([*parts, f'{len(mesh.points)} points'])}"

    mesh, text = project.comm.per_node(checked)
    project.add_mesh(mesh)
    _log(project, text)
    return mesh


def _log(project: Project, text: str) -> None:
    if project.log is not None:
        project.log.info(text)
