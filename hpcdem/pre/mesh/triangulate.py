"""Meshes of arbitrary outlines by gmsh: regions, holes, inner layers and cracks, with sizes that vary.

Lines are cut into edges here (`planar`), each of which becomes one edge of the mesh; gmsh fills the areas between.
So an edge of the mesh that lies on a layer or carries a crack is known by its end points, whatever gmsh does. Input,
scaled to edges of length 1 about the origin, goes to gmsh in one fixed order, on one thread. Its algorithm for quads
decides ties, as in a circle, by addresses in memory: it runs in a process of its own, whose memory does not depend on
what this one did before. So the same input makes the same mesh.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import apart, optional
from hpcdem.pre.mesh.fractures import Fractures, clipped, joined
from hpcdem.pre.mesh.geometry import Layers, sampled
from hpcdem.pre.mesh.planar import Plane
from hpcdem.pre.mesh.quality import quality
from hpcdem.pre.mesh.regions import GRID, edges_of_curve, faces, noded, polygon_of
from hpcdem.pre.mesh.sizes import GROWTH, Refinement, SizeField, not_too_many
from hpcdem.pre.mesh.smooth import smoothed

MOST_EDGES = 1_000_000
"""Largest number of elements, or of edges on lines; more are refused at once, as the size is a mistake of units."""
DELAUNAY, FRONTAL_DELAUNAY, FRONTAL_QUADS = 5, 6, 8
"""Numbers of gmsh's algorithms: triangles in no pattern; near equilateral; those that pair up to quads."""
BLOSSOM = 1
"""Number of gmsh's recombination: a perfect matching of triangles, as far as there is one."""
SHARP = 10.0
"""Angle [degrees] below which an element is reported."""
FLATTEST = 165.0
"""Angle [degrees] of a quad above which it stays two triangles."""


_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.ElementOrder": 1,
    "Mesh.SubdivisionAlgorithm": 0,
    "Mesh.RecombinationAlgorithm": BLOSSOM,
    "Mesh.Algorithm": FRONTAL_DELAUNAY,
    "Mesh.RecombineAll": 0,
}


@dataclass(frozen=True)
class Region:
    """The area inside the closed curves of a layer; where regions lie in each other the later one counts."""

    layer: str
    group: str | None = None
    set_name: str = "default"
    size: float | None = None
    """Mesh size inside the region [m]; None: the mesh size of the model."""


@dataclass(frozen=True)
class MeshSettings:
    """Input of the triangulation: layers by name, sizes in metres."""

    regions: Sequence[Region]
    size: float
    kind: str = "tri"
    """"tri" or "quad" (a few triangles remain where quads do not fit)."""
    holes: Sequence[str] = ()
    inside: Sequence[str] = ()
    """Lines and points that edges and points of the mesh are to lie on."""
    cracks: Sequence[tuple[str, int]] = ()
    """Layers whose lines carry a crack from the beginning, with the number of the fracture set. An edge of several sets
    belongs to the lowest."""
    fractures: Fractures = field(default_factory=Fractures)
    refine: Sequence[Refinement] = ()
    irregular: bool = False
    """Whether triangles are placed without a pattern: rows of them would guide cracks."""
    smooth: bool = False
    """Whether inner points are moved to the middle of their neighbours (`smoothing`); points on lines stay."""


@dataclass(frozen=True)
class Meshed:
    """A mesh, and what the user should know about how it came about."""

    mesh: Mesh
    notes: list[str]


def triangulate(layers: Layers, settings: MeshSettings) -> Meshed:
    """Make the mesh. CommandError for invalid settings, HpcdemError where gmsh fails."""
    optional.gmsh(), optional.shapely()
    if settings.kind not in ("tri", "quad"):
        raise CommandError(f"a mesh consists of 'tri' or 'quad', not '{settings.kind}'")
    if settings.irregular and settings.kind != "tri":
        raise CommandError("irregular supports triangles only")
    if settings.smooth and settings.kind != "tri":
        raise CommandError("smooth supports triangles only")
    if not settings.regions:
        raise CommandError("a mesh needs at least one layer as outline")
    sizes = _size_field(layers, settings)
    _not_too_many(layers, settings, sizes)
    plane = Plane(sizes)
    areas = _outlines(plane, layers, settings)
    for area in areas:
        if area.size is not None:
            optional.shapely().prepare(area.polygon)
            sizes.areas.append((area.polygon, area.size))
    points, traces, notes = _lines_inside(plane, layers, settings, areas)
    plane.divide()
    xy = np.column_stack([plane.x, plane.y])
    notes += _moved(plane, xy, traces)
    surfaces = _surfaces(plane, xy, areas)
    fill = _filled if settings.kind == "tri" else _filled_apart
    mesh = fill(plane, xy, surfaces, points, settings, sizes, notes)
    check(mesh, "mesh made by gmsh")
    found = quality(mesh)
    if found.angle_least < SHARP:
        x, y = found.angle_least_at
        notes.append(
            f"the smallest angle is {found.angle_least:.1f} degrees, in element {found.angle_least_element} at "
            f"({x:g}, {y:g}): lines are close to each other, which makes the time step small"
        )
    return Meshed(mesh, notes)


@dataclass(frozen=True)
class _Area:
    """A part of the plane with one list of regions: polygon of shapely, and group by set."""

    polygon: Any
    groups: dict[str, str]
    size: float | None


def _size_field(layers: Layers, settings: MeshSettings) -> SizeField:
    own = [Refinement(r.layer, r.size) for r in settings.regions if r.size is not None and r.size < settings.size]
    coarser = [r for r in settings.regions if r.size is not None and r.size > settings.size]
    if coarser:
        raise CommandError(
            f"region '{coarser[0].layer}' has the mesh size {coarser[0].size:g}, larger than {settings.size:g}: use "
            "the largest size for the mesh"
        )
    return SizeField(settings.size, [(r, layers[r.layer]) for r in [*settings.refine, *own]])


# --- outlines ----------------------------------------------------------------------------------------------------


def _outlines(plane: Plane, layers: Layers, settings: MeshSettings) -> list[_Area]:
    """Put the outlines of regions and holes into the plane; returns the areas between them that are to be filled."""
    shapely = optional.shapely()
    names = list(dict.fromkeys([*(r.layer for r in settings.regions), *settings.holes]))
    segments = {n: _segments(layers, n, plane.sizes) for n in names}
    polygons = {n: shapely.union_all(faces(segments[n], n, plane.sizes.smallest)) for n in names}
    pieces = noded(np.concatenate(list(segments.values())), GRID * plane.sizes.smallest)
    middle = shapely.points(pieces.mean(axis=1))
    hair = 4.0 * GRID * plane.sizes.smallest
    on = {n: shapely.dwithin(shapely.multilinestrings(shapely.linestrings(segments[n])), middle, hair) for n in names}
    for i in np.lexsort(pieces.reshape(-1, 4).T[::-1]):
        a, b = (plane.put(x, y) for x, y in pieces[i].tolist())
        plane.join(a, b, frozenset(n for n in names if on[n][i]), fixed=True)
    areas = []
    for polygon in shapely.get_parts(shapely.polygonize(_lines_of(plane))):
        inside = polygon.representative_point()
        if any(polygons[h].contains(inside) for h in settings.holes):
            continue
        regions = [r for r in settings.regions if polygons[r.layer].contains(inside)]
        if regions:
            groups = {r.set_name: r.group for r in regions if r.group is not None}
            areas.append(_Area(polygon, groups, next((r.size for r in reversed(regions) if r.size is not None), None)))
    if not areas:
        raise CommandError("the holes cover the regions completely")
    return areas


def _lines_of(plane: Plane) -> Any:
    xy = np.column_stack([plane.x, plane.y])
    return optional.shapely().linestrings(xy[np.array(sorted(plane.fixed))])


def _segments(layers: Layers, name: str, sizes: SizeField) -> np.ndarray:
    return np.concatenate([np.empty((0, 2, 2)), *(edges_of_curve(c, sizes, sizes.on(name)) for c in layers[name])])


def _not_too_many(layers: Layers, settings: MeshSettings, sizes: SizeField) -> None:
    """Estimate, from a sample of places, before anything is cut: an equilateral triangle of edge h has 0.433 h2."""
    shapely = optional.shapely()
    edges = 0.0
    every = dict.fromkeys([*(r.layer for r in settings.regions), *settings.holes, *settings.inside])
    for name in [*every, *(n for n, _ in settings.cracks)]:
        for curve in layers[name]:
            if curve.segments:
                length = curve.length()
                edges += length * float((1.0 / sizes(sampled(curve, length / 256.0))).mean())
    if edges > MOST_EDGES:
        raise CommandError(
            f"mesh size {sizes.base:g} would cut lines into about {edges:.2g} edges, at most {MOST_EDGES:.0g} allowed"
        )
    elements = 0.0
    for region in settings.regions:
        rough = max(c.length() for c in layers[region.layer]) / 64.0 if layers[region.layer] else 1.0
        polygon = polygon_of(layers, [region.layer], rough or 1.0)
        x0, y0, x1, y1 = polygon.bounds
        at = np.array(np.meshgrid(np.linspace(x0, x1, 66)[1:-1], np.linspace(y0, y1, 66)[1:-1])).reshape(2, -1).T
        at = at[shapely.contains_xy(polygon, at[:, 0], at[:, 1])]
        h = np.minimum(sizes(at), region.size or math.inf)
        elements += polygon.area * float((1.0 / (0.433 * h * h)).mean()) if len(at) else 0.0
    not_too_many(elements, f"mesh size {sizes.base:g}")


# --- lines inside ------------------------------------------------------------------------------------------------


def _lines_inside(
    plane: Plane, layers: Layers, settings: MeshSettings, areas: list[_Area]
) -> tuple[list[int], np.ndarray, list[str]]:
    """Put inner layers, cracks and fractures into the plane.

    Returns single points to be met, the traces (n, 2, 2) as they were meant, and notes. Edges carry the names of their
    layers, the numbers of their sets, and ("trace", row).
    """
    shapely = optional.shapely()
    domain = shapely.union_all([a.polygon for a in areas])
    notes: list[str] = []
    points = []
    for name in settings.inside:
        single = [c.points[0] for c in layers[name] if not c.segments]
        points += [plane.add_point(float(x), float(y)) for x, y in single if domain.intersects(shapely.Point(x, y))]
    outlines = {*(r.layer for r in settings.regions), *settings.holes}
    layered = [(n, None) for n in settings.inside] + [(n, int(k)) for n, k in settings.cracks]
    traces: list[Fractures] = []
    labels: list[frozenset] = []
    for name, number in layered:
        if name in outlines:  # a crack between two regions: the edges are there
            for key, known in list(plane.edges.items()):
                if name in known and number is not None:
                    plane.join(*key, frozenset({number}), fixed=False)
            continue
        rows = _segments(layers, name, plane.sizes)
        if not len(rows) and not any(not c.segments for c in layers[name]):
            raise CommandError(f"layer '{name}' is empty")
        traces.append(Fractures(rows, np.zeros(len(rows), np.int64)))
        labels += [frozenset({name} if number is None else {name, number})] * len(rows)
    traces.append(settings.fractures)
    labels += [frozenset({int(k)}) for k in settings.fractures.sets]
    every = joined(*traces)
    if not np.isfinite(every.ends).all():
        raise CommandError("fracture traces must be finite")
    ends, origin = clipped(every.ends, domain)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    short = length < plane.ratio * plane.sizes(ends.mean(axis=1)) if len(ends) else np.zeros(0, bool)
    for i in np.flatnonzero(~short):
        (ax, ay), (bx, by) = ends[i].tolist()
        plane.add_line((ax, ay), (bx, by), labels[origin[i]] | {("trace", int(i))})
    outside = len(every) - len(np.unique(origin))
    if outside:
        notes.append(f"{outside} of {len(every)} traces lie outside the regions and are omitted")
    if short.any():
        notes.append(
            f"{int(short.sum())} traces shorter than {plane.ratio:g} of the mesh size are omitted (total length "
            f"{float(length[short].sum()):g} m)"
        )
    return points, ends, notes


def _moved(plane: Plane, xy: np.ndarray, traces: np.ndarray) -> list[str]:
    """Report how far the meshed traces deviate from their prescribed lines."""
    rows = [(*key, label[1]) for key, labels in plane.edges.items() for label in labels if isinstance(label, tuple)]
    if not rows:
        return []
    a, b, trace = np.array(rows).T
    point, trace = np.concatenate([a, b]), np.concatenate([trace, trace])
    start, along = traces[trace, 0], traces[trace, 1] - traces[trace, 0]
    t = np.clip(((xy[point] - start) * along).sum(axis=1) / (along * along).sum(axis=1), 0.0, 1.0)
    far = np.hypot(*(xy[point] - start - t[:, None] * along).T)
    if far.max() < 1e-3 * plane.sizes.smallest:
        return []
    i = int(far.argmax())
    h = float(plane.sizes(xy[point[i : i + 1]])[0])
    return [
        f"lines close to each other were merged, moved by at most {far[i]:g} m (near ({xy[point[i], 0]:g}, "
        f"{xy[point[i], 1]:g}), {far[i] / h:.2f} of the mesh size there)"
    ]


# --- gmsh --------------------------------------------------------------------------------------------------------


@dataclass
class _Surface:
    """An area as gmsh wants it: rings of point numbers, outline first; edges and points inside."""

    rings: list[list[int]]
    area: _Area
    edges: list[tuple[int, int]] = field(default_factory=list)


def _surfaces(plane: Plane, xy: np.ndarray, areas: list[_Area]) -> list[_Surface]:
    """Areas with their rings as point numbers (outlines may have got more points from cracks that end on them)."""
    shapely = optional.shapely()
    number = {(x, y): i for i, (x, y) in enumerate(xy.tolist())}
    tree = shapely.STRtree([a.polygon for a in areas])
    found = []
    for polygon in shapely.get_parts(shapely.polygonize(_lines_of(plane))):
        of = tree.query(polygon.representative_point(), predicate="intersects")
        if not len(of):
            continue
        rings = []
        for k, ring in enumerate([polygon.exterior, *polygon.interiors]):
            loop = [number[p] for p in list(ring.coords)[:-1]]
            rings.append(loop if ring.is_ccw == (k == 0) else loop[::-1])
        found.append((polygon, _Surface(rings, areas[int(of[0])])))
    # gmsh numbers its nodes by surface: put these in an order that rests on geometry only.
    found.sort(key=lambda f: f[0].bounds + (f[0].area,))
    free = [key for key in plane.edges if key not in plane.fixed]
    if free:
        middle = shapely.points(0.5 * (xy[[a for a, _ in free]] + xy[[b for _, b in free]]))
        which, where = shapely.STRtree([p for p, _ in found]).query(middle, predicate="intersects")
        for i, k in dict(zip(which[::-1].tolist(), where[::-1].tolist())).items():
            found[k][1].edges.append(free[i])
    surfaces = [s for _, s in found]
    for surface in surfaces:
        surface.edges.sort()
    return surfaces


def _filled_apart(*request: Any) -> Mesh:
    """Run `_filled` in a process of its own."""
    mesh, request[-1][:] = apart.called(_with_notes, *request, failed="gmsh could not make the mesh")
    return mesh


def _with_notes(*request: Any) -> tuple[Mesh, list[str]]:
    return _filled(*request), request[-1]


def _filled(
    plane: Plane,
    xy: np.ndarray,
    surfaces: list[_Surface],
    points: list[int],
    settings: MeshSettings,
    sizes: SizeField,
    notes: list[str],
) -> Mesh:
    gmsh = optional.gmsh()
    ours = not gmsh.isInitialized()  # a Python program may be using gmsh itself
    if ours:
        optional.gmsh_started()
    before = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    theirs = gmsh.model.getCurrent()
    try:
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        gmsh.logger.start()
        gmsh.model.add("hpcdem")
        centre = 0.5 * (xy.min(axis=0) + xy.max(axis=0))
        try:
            nodes, tags = _described(gmsh, plane, (xy - centre) / sizes.base, surfaces, points, settings, sizes, centre)
            gmsh.model.mesh.generate(2)
            return _taken_out(gmsh, plane, xy, surfaces, nodes, tags, settings, sizes.base, centre, notes)
        except HpcdemError:
            raise
        except Exception as error:  # gmsh raises nothing more special
            messages = [line for line in gmsh.logger.get() if line.startswith(("Error", "Warning"))]
            raise HpcdemError(f"gmsh could not make the mesh: {'; '.join(messages[:3]) or error}") from error
        finally:
            gmsh.logger.stop()
            gmsh.model.remove()
    finally:
        if ours:
            gmsh.finalize()
        else:
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
            gmsh.model.setCurrent(theirs)


def _described(
    gmsh: Any,
    plane: Plane,
    scaled: np.ndarray,
    surfaces: list[_Surface],
    points: list[int],
    settings: MeshSettings,
    sizes: SizeField,
    centre: np.ndarray,
) -> tuple[dict[int, int], list[int]]:
    """Tell gmsh the geometry; returns its tag of each point used, and of each surface."""
    of_triangles = DELAUNAY if settings.irregular else FRONTAL_DELAUNAY
    gmsh.option.setNumber("Mesh.Algorithm", of_triangles if settings.kind == "tri" else FRONTAL_QUADS)
    gmsh.option.setNumber("Mesh.RecombineAll", 0 if settings.kind == "tri" else 1)
    geo = gmsh.model.geo
    nodes: dict[int, int] = {}
    lines: dict[tuple[int, int], int] = {}

    def node(i: int) -> int:
        if i not in nodes:
            nodes[i] = geo.addPoint(float(scaled[i, 0]), float(scaled[i, 1]), 0.0)
        return nodes[i]

    def line(i: int, j: int) -> int:
        """The tag, negative if the line runs from j to i."""
        key = (min(i, j), max(i, j))
        if key not in lines:
            lines[key] = geo.addLine(node(key[0]), node(key[1]))
        return lines[key] if i < j else -lines[key]

    tags = []
    for surface in surfaces:
        loops = [geo.addCurveLoop([line(i, j) for i, j in zip(r, r[1:] + r[:1])]) for r in surface.rings]
        tags.append(geo.addPlaneSurface(loops))
    embedded = [[line(i, j) for i, j in s.edges] for s in surfaces]
    single = [(node(i), _surface_at(surfaces, plane, i)) for i in points if i not in nodes]
    fields = _fields(gmsh, surfaces, tags, sizes, centre)
    geo.synchronize()
    for tag in lines.values():
        gmsh.model.mesh.setTransfiniteCurve(tag, 2)
    for tag, inner in zip(tags, embedded):
        if inner:
            gmsh.model.mesh.embed(1, inner, 2, tag)
    for tag, k in single:
        if k >= 0:
            gmsh.model.mesh.embed(0, [tag], 2, tags[k])
    gmsh.model.mesh.field.setAsBackgroundMesh(fields)
    return nodes, tags


def _surface_at(surfaces: list[_Surface], plane: Plane, i: int) -> int:
    """Return the index of the surface that contains point i; -1 if none does."""
    shapely = optional.shapely()
    at = shapely.Point(plane.x[i], plane.y[i])
    return next((k for k, s in enumerate(surfaces) if s.area.polygon.contains(at)), -1)


def _fields(gmsh: Any, surfaces: list[_Surface], tags: list[int], sizes: SizeField, centre: np.ndarray) -> int:
    """The size field of `sizes` in gmsh's words, in units of the base size; returns its tag."""
    f = gmsh.model.mesh.field
    parts = []

    def add(kind: str, numbers: dict[str, float], lists: dict[str, Any] | None = None) -> int:
        tag = f.add(kind)
        for name, value in numbers.items():
            f.setNumber(tag, name, value)
        for name, values in (lists or {}).items():
            f.setNumbers(tag, name, values)
        return tag

    parts.append(add("MathEval", {}))
    f.setString(parts[0], "F", "1")
    for points, _, size, growth in sizes.parts:
        near = [gmsh.model.geo.addPoint(float(x), float(y), 0.0) for x, y in (points - centre) / sizes.base]
        distance = add("Distance", {}, {"PointsList": near})
        least = size / sizes.base
        parts.append(
            add(
                "Threshold",
                {
                    "InField": distance,
                    "SizeMin": least,
                    "SizeMax": 1.0,
                    "DistMin": 0.0,
                    "DistMax": (1.0 - least) / growth,
                },
            )
        )
    for surface, tag in zip(surfaces, tags):
        if surface.area.size is not None:
            parts.append(add("Constant", {"VIn": surface.area.size / sizes.base, "VOut": 1.0}, {"SurfacesList": [tag]}))
    return add("Min", {}, {"FieldsList": parts})


def _taken_out(
    gmsh: Any,
    plane: Plane,
    xy: np.ndarray,
    surfaces: list[_Surface],
    nodes: dict[int, int],
    tags: list[int],
    settings: MeshSettings,
    scale: float,
    centre: np.ndarray,
    notes: list[str],
) -> Mesh:
    """The mesh with our numbers: points in gmsh's order, elements by surface."""
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(node_tags, kind="stable")
    node_tags = node_tags[order].astype(np.int64)
    points = coordinates.reshape(-1, 3)[order, :2] * scale + centre
    row = np.full(int(node_tags[-1]) + 1, -1, np.int64)
    row[node_tags] = np.arange(len(node_tags))
    mine = {i: row[int(gmsh.model.mesh.getNodes(0, tag)[0][0])] for i, tag in nodes.items()}
    numbers = np.fromiter(mine.keys(), np.int64, len(mine))
    points[np.fromiter(mine.values(), np.int64, len(mine))] = xy[numbers]  # exact, not through the scaling
    cells, start = [], 0
    # Groups come in the order of the regions, not of the areas.
    groups: dict[str, dict[str, list[np.ndarray]]] = {}
    for region in settings.regions:
        if region.group is not None:
            groups.setdefault(region.set_name, {})[region.group] = []
    for surface, tag in zip(surfaces, tags):
        some = []
        for kind, n in ((2, 3), (3, 4)):
            corners = gmsh.model.mesh.getElementsByType(kind, tag)[1].astype(np.int64).reshape(-1, n)
            some.append(np.column_stack([row[corners], np.full((len(corners), 4 - n), -1, np.int64)]))
        here = _halved_where_flat(points, np.concatenate(some))
        if not len(here):
            x, y = surface.area.polygon.representative_point().coords[0]
            raise HpcdemError(f"gmsh made no element in the area about ({x:g}, {y:g})")
        for set_name, group in surface.area.groups.items():
            groups[set_name][group].append(np.arange(start, start + len(here)))
        cells.append(here)
        start += len(here)
    triangles = np.concatenate(cells)
    if settings.smooth:
        held = np.zeros(len(points), bool)
        held[list(mine.values())] = True
        points, stayed = smoothed(points, triangles, held)
        if stayed:
            notes.append(f"smooth did not move {stayed} points, because triangles would become sharp")
    return _compact(
        points,
        triangles,
        {s: {g: np.concatenate(rows) for g, rows in of.items() if rows} for s, of in groups.items()},
        mine,
        plane,
        settings,
    )


def _halved_where_flat(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Quads with an angle above FLATTEST (or concave) become two triangles, cut at their greatest angle."""
    quads = np.flatnonzero(cells[:, 3] >= 0)
    xy = points[cells[quads]]
    ahead, back = np.roll(xy, -1, axis=1) - xy, np.roll(xy, 1, axis=1) - xy
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    angle = np.degrees(np.arctan2(cross, (ahead * back).sum(axis=2))) % 360.0
    bad = np.flatnonzero((angle > FLATTEST).any(axis=1))
    if not len(bad):
        return cells
    turned = np.stack([np.roll(cells[quads[i]], -int(angle[i].argmax())) for i in bad])
    none = np.full((len(bad), 1), -1, np.int64)
    halves = [np.column_stack([turned[:, c], none]) for c in ([0, 1, 2], [0, 2, 3])]
    return np.concatenate([np.delete(cells, quads[bad], axis=0), *halves])


def _compact(
    points: np.ndarray,
    cells: np.ndarray,
    groups: dict[str, dict[str, np.ndarray]],
    mine: dict[int, int],
    plane: Plane,
    settings: MeshSettings,
) -> Mesh:
    """Leave points out that no element uses, and name the edges on layers and cracks."""
    used = np.zeros(len(points), bool)
    used[cells[cells >= 0]] = True
    number = np.cumsum(used) - 1
    cells = np.where(cells >= 0, number[cells], -1)
    layers: dict[str, list] = {n: [] for n in [*(r.layer for r in settings.regions), *settings.holes, *settings.inside]}
    layers |= {n: [] for n, _ in settings.cracks}
    cracks, crack_sets = [], []
    for key, labels in plane.edges.items():
        a, b = (mine.get(i, -1) for i in key)
        if min(a, b) < 0 or not (used[a] and used[b]):
            continue
        pair = (int(number[a]), int(number[b]))
        for label in labels:
            if isinstance(label, str):
                layers[label].append(pair)
        sets = [label for label in labels if isinstance(label, int)]
        if sets:
            cracks.append(pair)
            crack_sets.append(min(sets))
    edges = Mesh.of(points[used], cells).edges()
    return _only_existing(Mesh.of(points[used], cells, groups, layers, cracks, crack_sets), edges)


def _only_existing(mesh: Mesh, edges: Any) -> Mesh:
    """Cracks that were moved onto the rim are no cracks; a line inside that gmsh has not kept is its failure."""
    from hpcdem.physics.fdem.connectivity import find_edges
    from hpcdem.physics.fdem.mesh import crack_rows

    for name, pairs in mesh.layers.items():
        if (find_edges(edges, pairs, len(mesh.points)) < 0).any():
            raise HpcdemError(f"gmsh did not keep a line of layer '{name}' as edges of the mesh")
    rows = crack_rows(mesh, edges)
    if (rows < 0).any():
        raise HpcdemError("gmsh did not keep a crack as edges of the mesh")
    inner = edges.inner[rows]
    return Mesh.of(mesh.points, mesh.cells, mesh.groups, mesh.layers, mesh.cracks[inner], mesh.crack_sets[inner])


__all__ = ["GROWTH", "MeshSettings", "Meshed", "Refinement", "Region", "triangulate"]
