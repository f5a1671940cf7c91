"""Tetrahedra in solids by Gmsh, which runs in a process of its own: its optimisers can crash on difficult input, and
the crash of a library would take the whole run with it.

`python -m hpcdem.pre.mesh.fill` reads a description as JSON and writes the mesh as .npz. Coordinates go to Gmsh about
the middle and in units of the edge length, on one thread: the same input makes the same mesh.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.mesh import optional
from hpcdem.pre.mesh.sizes import GROWTH, not_too_many
from hpcdem.pre.mesh.solids import Box, Solid, Sphere, restored, state

HXT = 10
"""Number of the algorithm."""


@dataclass(frozen=True)
class Wishes:
    """outline, holes: solids; size: of edges [m]; regions: (group, solids) of parts with a group of their own; refine:
    (solids, size there [m], distance over which it grows to that of the rest [m] or None)."""

    outline: Sequence[Solid]
    size: float
    holes: Sequence[Solid] = ()
    regions: Sequence[tuple[str, Sequence[Solid]]] = ()
    refine: Sequence[tuple[Sequence[Solid], float, float | None]] = field(default_factory=tuple)


def filled(wishes: Wishes, group: str) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Points (np, 3) [m], tetrahedra (ne, 4) and element numbers by group; `group`: of what is in no region.
    HpcdemError where Gmsh fails, or the size makes too many elements."""
    optional.gmsh()
    bounds = np.array([one.bounds() for one in wishes.outline])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    not_too_many(float(np.prod((high - low) / wishes.size)) * 6.0 * np.sqrt(2.0), f"size {wishes.size:g}")
    for _, size, _ in wishes.refine:
        if size > wishes.size:
            raise CommandError(f"refine-layer makes elements smaller: size {size:g} is above that of the rest")
    said = {
        "outline": state(list(wishes.outline)), "holes": state(list(wishes.holes)), "size": wishes.size,
        "regions": [state(list(of)) for _, of in wishes.regions], "middle": (0.5 * (low + high)).tolist(),
        "refine": [
            [state(list(of)), size, distance or (wishes.size - size) / GROWTH or wishes.size]
            for of, size, distance in wishes.refine
        ],
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        into = Path(folder) / "mesh.npz"
        done = subprocess.run(
            [sys.executable, "-m", "hpcdem.pre.mesh.fill", str(into)], input=json.dumps(said), text=True,
            capture_output=True, check=False,
        )  # fmt: skip
        if done.returncode or not into.is_file():
            told = [line for line in done.stderr.splitlines() if line.strip()]
            why = told[-1] if told else f"it ended with {done.returncode}"
            raise HpcdemError(f"Gmsh could not make the mesh: {why}")
        with np.load(into, allow_pickle=False) as found:
            points, cells, region = found["points"], found["cells"], found["region"]
    names = [group, *(name for name, _ in wishes.regions)]
    groups: dict[str, list[np.ndarray]] = {}
    for k, name in enumerate(names):
        if (region == k).any():
            groups.setdefault(name, []).append(np.flatnonzero(region == k))
        elif k:
            raise CommandError(f"region '{name}' holds no element: it lies outside of the body, or is too small")
    return points, cells, {name: np.concatenate(rows) for name, rows in groups.items()}


def _solid(occ: Any, one: Solid, middle: np.ndarray, unit: float) -> tuple[int, int]:
    if isinstance(one, Box):
        low, high = (one.bounds() - middle) / unit
        return 3, occ.addBox(*low, *(high - low))
    if isinstance(one, Sphere):
        return 3, occ.addSphere(*((np.array(one.centre) - middle) / unit), one.radius / unit)
    a, b = ((np.array(end) - middle) / unit for end in (one.first, one.second))
    return 3, occ.addCylinder(*a, *(b - a), one.radius / unit)


def _refined(gmsh: Any, said: dict[str, Any], middle: np.ndarray, unit: float) -> None:
    """Edges have their size inside of the solids, and grow in proportion to the distance from them."""
    rest = said["size"]
    near = [(one, size, distance) for of, size, distance in said["refine"] for one in restored(of)]

    def edges(_dim: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:
        at = np.array([[x, y, z]]) * unit + middle
        ways = [(size, one.distance(at)[0] / distance) for one, size, distance in near]
        return min(size + (rest - size) * min(max(way, 0.0), 1.0) for size, way in ways) / unit

    if near:
        gmsh.model.mesh.setSizeCallback(edges)


def _main(into: str) -> None:
    said = json.load(sys.stdin)
    gmsh = optional.gmsh()
    gmsh.initialize(["hpcdem"], readConfigFiles=False, interruptible=False)
    middle, unit = np.array(said["middle"]), float(said["size"])
    for name, value in (
        ("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.MaxNumThreads3D", 1), ("Mesh.Algorithm3D", HXT),
        ("Mesh.MeshSizeMax", 1.0), ("Mesh.MeshSizeFromPoints", 0), ("Mesh.MeshSizeExtendFromBoundary", 0),
    ):  # fmt: skip
        gmsh.option.setNumber(name, value)
    occ = gmsh.model.occ
    body = [_solid(occ, one, middle, unit) for one in restored(said["outline"])]
    if len(body) > 1:
        body, _ = occ.fuse(body[:1], body[1:])
    holes = [_solid(occ, one, middle, unit) for one in restored(said["holes"])]
    if holes:
        body, _ = occ.cut(body, holes)
    number = {tag: 0 for _, tag in body}
    for k, solids in enumerate(said["regions"]):
        tools = [_solid(occ, one, middle, unit) for one in restored(solids)]
        pieces = [(3, tag) for tag in number]
        _, parents = occ.fragment(pieces, tools)
        inside = {tag for of in parents[len(pieces) :] for _, tag in of}
        was = {tag: number[old] for (_, old), of in zip(pieces, parents) for _, tag in of}
        occ.remove([(3, tag) for tag in inside - was.keys()], recursive=True)
        number = {tag: k + 1 if tag in inside else old for tag, old in was.items()}
    occ.synchronize()
    if not number:
        raise SystemExit("nothing is left of the body")
    _refined(gmsh, said, middle, unit)
    gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    parts = []
    for tag, region in sorted(number.items()):
        kinds, _, nodes = gmsh.model.mesh.getElements(3, tag)
        for kind, of in zip(kinds, nodes):
            if kind == 4:
                cells = place[of.astype(np.int64)].reshape(-1, 4)
                parts.append((cells, np.full(len(cells), region)))
    cells = np.concatenate([cells for cells, _ in parts])
    used, cells = np.unique(cells, return_inverse=True)
    points = xyz.reshape(-1, 3)[used] * unit + middle
    np.savez(into, points=points, cells=cells.reshape(-1, 4), region=np.concatenate([region for _, region in parts]))


if __name__ == "__main__":
    _main(sys.argv[1])
