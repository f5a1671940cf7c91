"""The pictures of docs/meshes.md: one of each kind of mesh. `python scripts/lib/mesh_figures.py [FOLDER]`"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hpcdem.physics.fdem.connectivity import corner_counts
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import geometry, structured
from hpcdem.pre.mesh.cracks import follow
from hpcdem.pre.mesh.fracture_sets import FractureSet, Length, Orientation
from hpcdem.pre.mesh.fractures import network, of_curves
from hpcdem.pre.mesh.quality import quality
from hpcdem.pre.mesh.regions import polygon_of
from hpcdem.pre.mesh.sizes import Refinement, spaced
from hpcdem.pre.mesh.triangulate import MeshSettings, Region, triangulate

GROUP_COLOURS = ("#dfe6e9", "#f6d7a7", "#c7ddb5", "#b8d4e8", "#e3c6dc", "#d9cfc1", "#f2e3a0", "#c9c9e3")
EDGE_COLOUR = "#5f6b73"
CRACK_COLOURS = ("#b2182b", "#2166ac", "#1b7837", "#762a83", "#b35806", "#01665e")


def draw(
    axes: Any,
    mesh: Mesh,
    set_name: str | None = None,
    edge_width: float | None = None,
    crack_width: float = 1.6,
    set_names: dict[int, str] | None = None,
    legend: bool = True,
) -> None:
    """Draw a mesh into axes of matplotlib, to scale.

    Elements are coloured by the groups of `set_name` (None: the first set); the width of edges [pt] follows from how
    large elements come out on paper; `set_names` names fracture sets in the legend.
    """
    if set_name is None:
        set_name = next(iter(mesh.groups), None)
    groups = mesh.groups.get(set_name, {}) if set_name is not None else {}
    colour = np.full(len(mesh.cells), GROUP_COLOURS[0], object)
    for k, rows in enumerate(groups.values()):
        colour[rows] = GROUP_COLOURS[k % len(GROUP_COLOURS)]
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    if edge_width is None:
        box = axes.get_position().transformed(axes.figure.transFigure)
        points_per_metre = 72.0 / axes.figure.dpi * min(box.width, box.height) / max(float((high - low).max()), 1e-300)
        edge_width = float(np.clip(0.05 * np.sqrt(np.median(mesh.areas())) * points_per_metre, 0.1, 0.7))
    counts = corner_counts(mesh.cells)
    for n in (3, 4):
        rows = np.flatnonzero(counts == n)
        axes.add_collection(
            PolyCollection(
                mesh.points[mesh.cells[rows, :n]],
                facecolors=list(colour[rows]),
                edgecolors="face",  # else the background shines through between neighbours
                linewidths=0.3,
            )
        )
    # Each edge once: drawn by both elements it would look doubled.
    lines = mesh.points[mesh.edges().points]
    axes.add_collection(LineCollection(list(lines), colors=EDGE_COLOUR, linewidths=edge_width, snap=False))
    handles: list[Any] = [
        Patch(facecolor=GROUP_COLOURS[k % len(GROUP_COLOURS)], edgecolor=EDGE_COLOUR, label=name)
        for k, name in enumerate(groups)
    ]
    for k, number in enumerate(np.unique(mesh.crack_sets)):
        lines = mesh.points[mesh.cracks[mesh.crack_sets == number]]
        tint = CRACK_COLOURS[k % len(CRACK_COLOURS)]
        axes.add_collection(LineCollection(list(lines), colors=tint, linewidths=crack_width, capstyle="round"))
        name = (set_names or {}).get(int(number), f"fracture set {number}")
        handles.append(Line2D([], [], color=tint, linewidth=crack_width, label=name))
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    if legend and handles:
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, borderaxespad=0.0)


def structured_kinds() -> list[tuple[str, Mesh]]:
    """Rectangles cut in all ways, a graded one, and the equilateral lattice."""
    xs, ys = spaced(0.0, 8.0, 8), spaced(0.0, 6.0, 6)
    made = [("quads", structured.rectangle(xs, ys))]
    for name in structured.DIAGONALS:
        made.append((f"triangles, diagonal {name}", structured.rectangle(xs, ys, "tri", name)))
    made.append(("equilateral", structured.equilateral((0.0, 0.0), 8.0, 6.0, 1.0)))
    fine = np.concatenate([spaced(0.0, 4.0, 7, 0.75)[:-1], spaced(4.0, 8.0, 7, 1.0 / 0.75)])
    made.append(("graded", structured.rectangle(fine, spaced(0.0, 6.0, 8, 0.8))))
    inclined = of_curves([geometry.polyline([(1.0, 1.0), (4.0, 3.5), (7.0, 5.0)])], 0, 1.0)
    made.append(("crack along edges", follow(structured.rectangle(xs, ys, "tri", "both"), inclined)))
    return made


def tunnel(kind: str) -> Mesh:
    """A horseshoe tunnel in rock with a clay bed and a fault."""
    layers = geometry.Layers()
    layers.add("outline", geometry.rectangle((-20.0, -15.0), (20.0, 15.0)))
    arch = geometry.Curve(
        np.array([(-3.0, -3.0), (3.0, -3.0), (3.0, 0.0), (-3.0, 0.0)]), np.array([0.0, 0, 1.0, 0]), True
    )
    layers.add("tunnel", arch)
    layers.add("bed", geometry.polygon([(-20.0, 5.0), (20.0, 7.5), (20.0, 10.5), (-20.0, 8.5)]))
    layers.add("fault", geometry.polyline([(-16.0, -15.0), (-2.0, 15.0)]))
    settings = MeshSettings(
        regions=[Region("outline", "sandstone"), Region("bed", "clay", size=1.2)],
        size=2.4,
        kind=kind,
        holes=["tunnel"],
        cracks=[("fault", 0)],
        refine=[Refinement("tunnel", 0.4, growth=0.15)],
    )
    return triangulate(layers, settings).mesh


def kirsch() -> Mesh:
    """The disc with a hole of the Kirsch problem, 96 edges on the hole."""
    layers = geometry.Layers()
    layers.add("far", geometry.circle((0.0, 0.0), 8.0))
    layers.add("hole", geometry.circle((0.0, 0.0), 1.0))
    refine = [Refinement("hole", 2.0 * math.pi / 96, growth=0.12)]
    return triangulate(layers, MeshSettings([Region("far", "rock")], 0.8, holes=["hole"], refine=refine)).mesh


def specimen() -> Mesh:
    """Uniaxial compression: specimen and platens, which may part."""
    layers = geometry.Layers()
    layers.add("specimen", geometry.rectangle((-26.0, 0.0), (26.0, 108.0)))
    layers.add(
        "platens", geometry.rectangle((-28.0, -10.0), (28.0, 0.0)), geometry.rectangle((-28.0, 108.0), (28.0, 118.0))
    )
    regions = [Region("specimen", "rock"), Region("platens", "steel")]
    layers.add(
        "ends", geometry.polyline([(-26.0, 0.0), (26.0, 0.0)]), geometry.polyline([(-26.0, 108.0), (26.0, 108.0)])
    )
    return triangulate(layers, MeshSettings(regions, 4.0, cracks=[("ends", 0)])).mesh


def slope() -> Mesh:
    """A slope with benches, in jointed rock: two sets, the second ends at the first."""
    layers = geometry.Layers()
    benches = [(60.0, 0.0), (60.0, 40.0), (38.0, 40.0)]
    for k in range(1, 4):
        benches += [(38.0 - 8.0 * k + 4.0, 40.0 - 8.0 * k), (38.0 - 8.0 * k, 40.0 - 8.0 * k)]
    layers.add("slope", geometry.polygon([(0.0, 0.0), *benches, (0.0, 16.0)]))
    region = polygon_of(layers, ["slope"], 1.0)
    bedding = FractureSet(
        Orientation("fisher", 35.0, 150.0), Length("lognormal", 9.0, 4.0, least=2.0, greatest=30.0), "p21", 0.2
    )
    cross = FractureSet(
        Orientation("normal", 115.0, 8.0), Length("power", 2.2, least=2.5, greatest=20.0), "p21", 0.14, ends_at=0.7
    )
    traces = network([bedding, cross], region, seed=12, least=0.8)
    return triangulate(layers, MeshSettings([Region("slope", "rock")], 0.8, fractures=traces)).mesh


def _panels(
    figure_path: Path, panels: list[tuple[str, Mesh]], shape: tuple[int, int], size: tuple[float, float]
) -> None:
    figure, axes = plt.subplots(*shape, figsize=size, dpi=150, squeeze=False, layout="constrained")
    for ax, (title, mesh) in zip(axes.ravel(), panels):
        draw(ax, mesh, legend=False)
        ax.set_title(title, fontsize=9)
        ax.set_axis_off()
    figure.savefig(figure_path, bbox_inches="tight")
    plt.close(figure)


def _one(path: Path, mesh: Mesh, size: tuple[float, float], names: dict[int, str], unit: str = "m") -> None:
    figure, ax = plt.subplots(figsize=size, dpi=150)
    draw(ax, mesh, set_names=names)
    ax.set_xlabel(f"x [{unit}]")
    ax.set_ylabel(f"y [{unit}]")
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)


def draw_all(folder: Path) -> dict[str, list[Mesh]]:
    """Draw every figure into a folder; returns the meshes by file name."""
    folder.mkdir(parents=True, exist_ok=True)
    made: dict[str, list[Mesh]] = {}

    def keep(name: str, meshes: list[Mesh], draw_it: Callable[[Path], None]) -> None:
        for mesh in meshes:
            check(mesh, name)
        draw_it(folder / name)
        made[name] = meshes

    kinds = structured_kinds()
    keep("mesh_structured.png", [m for _, m in kinds], lambda p: _panels(p, kinds, (2, 4), (10.0, 4.2)))
    both = [("triangles", tunnel("tri")), ("quads", tunnel("quad"))]
    keep("mesh_tunnel.png", [m for _, m in both], lambda p: _panels(p, both, (1, 2), (11.0, 4.3)))
    ring = kirsch()
    keep("mesh_kirsch.png", [ring], lambda p: _one(p, ring, (6.0, 6.0), {}))
    core = specimen()
    keep("mesh_specimen.png", [core], lambda p: _one(p, core, (3.2, 6.2), {0: "contact"}, "mm"))
    benches = slope()
    names = {0: "bedding", 1: "cross joints"}
    keep("mesh_slope.png", [benches], lambda p: _one(p, benches, (8.5, 6.0), names))
    return made


if __name__ == "__main__":
    for file_name, meshes in draw_all(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures")).items():
        for one in meshes:
            found = quality(one)
            print(f"{file_name}: {len(one.cells)} elements, smallest angle {found.angle_least:.1f} degrees")
