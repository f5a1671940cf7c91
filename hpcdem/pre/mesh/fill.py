"""Tetrahedra in solids by Gmsh, which runs in a process of its own: its optimisers can crash on difficult input, and
the crash of a library would take the whole run with it.

`python -m hpcdem.pre.mesh.fill` reads a description as JSON and writes the mesh as .npz. Coordinates go to Gmsh about
the middle and in units of the edge length, on one thread: the same input makes the same mesh.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import apart, optional, snap
from hpcdem.pre.mesh import occ as shapes
from hpcdem.pre.mesh.sizes import GROWTH, not_too_many
from hpcdem.pre.mesh.solids import restored, state

HXT, DELAUNAY = 10, 1
"""Numbers of algorithms: the first is five times as fast, and makes better elements about cracks."""


@dataclass(frozen=True)
class MeshSettings:
    """Input of a mesh in space. outline, holes: bodies; size: of edges [m]; regions: (group, bodies) of parts with
    their own group; refine: (bodies and surfaces, size there [m], distance over which it grows to the general size [m]
    or None); surfaces: (layer, surfaces) that become faces of the mesh.
    """

    outline: Sequence[Any]
    size: float
    holes: Sequence[Any] = ()
    regions: Sequence[tuple[str, Sequence[Any]]] = ()
    refine: Sequence[tuple[Sequence[Any], float, float | None]] = field(default_factory=tuple)
    surfaces: Sequence[tuple[str, Sequence[Any]]] = ()


@dataclass
class Filled:
    """A mesh in space: points (np, 3) [m], tetrahedra (ne, 4), element numbers by group, faces (k, 3) by layer of
    surfaces, and notes about moved geometry.
    """

    points: np.ndarray
    cells: np.ndarray
    groups: dict[str, np.ndarray]
    faces: dict[str, np.ndarray] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def filled(settings: MeshSettings, group: str) -> Filled:
    """Make the mesh. group: of elements in no region. HpcdemError if Gmsh fails or the size makes too many elements."""
    optional.gmsh()
    for what, of in (("the outline", settings.outline), ("a hole", settings.holes), *(
        (f"region '{name}'", one) for name, one in settings.regions
    )):  # fmt: skip
        flat = [one for one in of if one.surface]
        if flat:
            raise CommandError(f"{what} is a body, but the layer has a {type(flat[0]).__name__.lower()}, a surface")
    for name, of in settings.surfaces:
        if not of or not all(one.surface for one in of):
            raise CommandError(f"layer '{name}' has bodies; meshes are cut along polygons, discs and planes")
    cut, notes = snap.snapped(settings.surfaces, settings.outline, settings.size)
    bounds = np.array([one.bounds() for one in settings.outline])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    not_too_many(float(np.prod((high - low) / settings.size)) * 6.0 * np.sqrt(2.0), f"size {settings.size:g}")
    for _, size, _ in settings.refine:
        if size > settings.size:
            raise CommandError(
                f"refine-layer must make elements smaller, but size {size:g} is larger than that of the mesh"
            )
    request = {
        "outline": state(list(settings.outline)), "holes": state(list(settings.holes)), "size": settings.size,
        "regions": [state(list(of)) for _, of in settings.regions], "middle": (0.5 * (low + high)).tolist(),
        "refine": [
            [state(list(of)), size, distance or (settings.size - size) / GROWTH or settings.size]
            for of, size, distance in settings.refine
        ],
        "surfaces": [state(list(of)) for _, of in cut], "reach": float(np.linalg.norm(high - low)),
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        into = Path(folder) / "mesh.npz"
        apart.run("hpcdem.pre.mesh.fill", str(into), sent=json.dumps(request), failed="Gmsh could not make the mesh")
        with np.load(into, allow_pickle=False) as found:
            points, cells, region, of_layer = (found[name] for name in ("points", "cells", "region", "of_layer"))
            faces = found["faces"]
    names = [group, *(name for name, _ in settings.regions)]
    groups: dict[str, list[np.ndarray]] = {}
    for k, name in enumerate(names):
        if (region == k).any():
            groups.setdefault(name, []).append(np.flatnonzero(region == k))
        elif k:
            raise CommandError(f"region '{name}' contains no element: it lies outside the body, or is too small")
    on: dict[str, np.ndarray] = {}
    for k, (name, _) in enumerate(cut):
        on[name] = faces[of_layer == k]
        if not len(on[name]):
            raise CommandError(f"layer '{name}' does not cut the body")
    return Filled(points, cells, {name: np.concatenate(rows) for name, rows in groups.items()}, on, notes)


def _refined(gmsh: Any, request: dict[str, Any], middle: np.ndarray, unit: float) -> None:
    """Edges have their size inside of the solids, and grow in proportion to the distance from them."""
    rest = request["size"]
    near = [(one, size, distance) for of, size, distance in request["refine"] for one in restored(of)]

    def edges(_dim: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:
        at = np.array([[x, y, z]]) * unit + middle
        distances = [(size, one.distance(at)[0] / distance) for one, size, distance in near]
        return min(size + (rest - size) * min(max(part, 0.0), 1.0) for size, part in distances) / unit

    if near:
        gmsh.model.mesh.setSizeCallback(edges)


def _main(into: str) -> None:
    request = json.load(sys.stdin)
    gmsh = shapes.begun()
    middle, unit = np.array(request["middle"]), float(request["size"])
    for name, value in (
        ("Mesh.Algorithm3D", HXT), ("Mesh.MeshSizeMax", 1.0), ("Mesh.MeshSizeFromPoints", 0),
        ("Mesh.MeshSizeExtendFromBoundary", 0),
    ):  # fmt: skip
        gmsh.option.setNumber(name, value)
    occ = gmsh.model.occ
    number = _regions(occ, request, middle, unit)
    if not number:
        raise SystemExit("the body has no volume left")
    number, cuts = _cut(occ, request, number, middle, unit)
    occ.synchronize()
    _refined(gmsh, request, middle, unit)
    try:
        gmsh.model.mesh.generate(3)
    except Exception:  # HXT gives up at tips that are sharper than it likes
        gmsh.model.mesh.clear()
        gmsh.option.setNumber("Mesh.Algorithm3D", DELAUNAY)
        gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))

    def elements(of: list[tuple[int, int, int]], kind: int, corners: int) -> tuple[np.ndarray, np.ndarray]:
        parts = [(np.empty((0, corners), np.int64), np.empty(0, np.int64))]
        for dim, tag, mark in of:
            for found, nodes in zip(*(gmsh.model.mesh.getElements(dim, tag)[i] for i in (0, 2)), strict=True):
                if found == kind:
                    rows = place[nodes.astype(np.int64)].reshape(-1, corners)
                    parts.append((rows, np.full(len(rows), mark)))
        return np.concatenate([rows for rows, _ in parts]), np.concatenate([marks for _, marks in parts])

    cells, region = elements([(3, tag, mark) for tag, mark in sorted(number.items())], 4, 4)
    faces, of_layer = elements([(2, tag, mark) for tag, mark in sorted(cuts.items())], 2, 3)
    if not len(cells):
        raise SystemExit("Gmsh made no elements: use a smaller size")
    used, numbers = np.unique(cells, return_inverse=True)
    lost = ~np.isin(faces, used).all(axis=1)
    faces, of_layer = np.searchsorted(used, faces[~lost]), of_layer[~lost]
    points = xyz.reshape(-1, 3)[used] * unit + middle
    np.savez(into, points=points, cells=numbers.reshape(-1, 4), region=region, faces=faces, of_layer=of_layer)


def _regions(occ: Any, request: dict[str, Any], middle: np.ndarray, unit: float) -> dict[int, int]:
    """The volumes (tag: region, 0 where it is none) of the outline without its holes."""

    def bodies(given: list[Any]) -> shapes.Tags:
        return [tag for one in restored(given) for tag in shapes.body(occ, one, middle, unit)]

    body = bodies(request["outline"])
    if len(body) > 1:
        body, _ = occ.fuse(body[:1], body[1:])
    holes = bodies(request["holes"])
    if holes:
        body, _ = occ.cut(body, holes)
    number = {tag: 0 for _, tag in body}
    for k, given in enumerate(request["regions"]):
        tools = bodies(given)
        pieces = [(3, tag) for tag in number]
        _, parents = occ.fragment(pieces, tools)
        inside = {tag for of in parents[len(pieces) :] for _, tag in of}
        was = {tag: number[old] for (_, old), of in zip(pieces, parents) for _, tag in of}
        occ.remove([(3, tag) for tag in inside - was.keys()], recursive=True)
        number = {tag: k + 1 if tag in inside else old for tag, old in was.items()}
    return number


def _cut(
    occ: Any, request: dict[str, Any], number: dict[int, int], middle: np.ndarray, unit: float
) -> tuple[dict[int, int], dict[int, int]]:
    """The volumes (tag: region) cut along surfaces, and the faces (tag: layer) that these have become."""
    tools: shapes.Tags = []
    layer: list[int] = []
    for k, given in enumerate(request["surfaces"]):
        for one in restored(given):
            made = shapes.surface(occ, one, middle, unit, request["reach"])
            pieces, _ = occ.intersect(made, [(3, tag) for tag in number], removeTool=False)
            flat = [tag for tag in pieces if tag[0] == 2]
            tools += flat
            layer += [k] * len(flat)
    if not tools:
        return number, {}
    bodies = [(3, tag) for tag in number]
    _, parents = occ.fragment(bodies, tools)
    became = {tag: number[old] for (_, old), of in zip(bodies, parents) for dim, tag in of if dim == 3}
    cuts: dict[int, int] = {}
    for k, of in zip(layer, parents[len(bodies) :], strict=True):
        for dim, tag in of:
            if dim == 2:
                cuts.setdefault(tag, k)
    return became, cuts


if __name__ == "__main__":
    _main(sys.argv[1])
