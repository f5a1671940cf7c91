"""The figure of docs/sections.md: a section, discs that fill it and a mesh of it.

``python scripts/lib/section_figure.py [FILE]``
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection, PatchCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from hpcdem.commands.fdem import geometry, meshes  # noqa: E402
from hpcdem.commands.fdem.project import Project  # noqa: E402
from hpcdem.physics.fdem.groups import ELEMENT  # noqa: E402
from hpcdem.physics.fdem.simulation import Blocks  # noqa: E402
from hpcdem.pre.section import fill  # noqa: E402
from hpcdem.pre.section.read import read  # noqa: E402
from tests.section import made  # noqa: E402

NAMES = list(made.LAYERS)
SHADES = [made.COLOURS[name] for name in NAMES]


def draw(path: Path) -> None:
    """Three panels, one below the other."""
    figure = Figure(figsize=(8.0, 7.2), layout="constrained")
    axes = figure.subplots(3, sharex=True)
    with tempfile.TemporaryDirectory() as folder:
        file = made.geojson(Path(folder) / "normal_fault.geojson")
        section = read(file)
        rings = [(shape.name, shape.points(section.deviation)[0]) for shape in section.polygons]
        colours = [made.COLOURS[name] for name, _ in rings]
        axes[0].add_collection(PolyCollection([r for _, r in rings], facecolors=colours, edgecolors="#404040", lw=0.6))
        filled = fill.filled(section, np.array([15.0, 20.0]), fill.POROSITY, 5, 0, file.name)
        x, y, r = filled.rows.T
        shades = [colours[k] for k in filled.shape]
        discs = [Circle((a, b), c) for a, b, c in zip(x, y, r)]
        axes[1].add_collection(PatchCollection(discs, facecolors=shades, edgecolors="#404040", lw=0.2))
        project = Project(Blocks(), folder, folder)
        geometry.import_file(project, file.name, "outline", named=True)
        meshes.create(project, "outline", 60.0, region=[(name, None) for name in NAMES], crack=["F1"])
    mesh = project.whole_mesh()
    for name, shade in zip(NAMES, SHADES):
        cells = mesh.cells[project.groups[ELEMENT].sets["default"][name], :3]
        axes[2].add_collection(PolyCollection(mesh.points[cells], facecolors=shade, edgecolors="#404040", lw=0.3))
    for ax, title in zip(axes, ("section", "SECTION ... rad discrete 15 20", "geometry import ... named, mesh create")):
        ax.add_collection(LineCollection([made.FAULT], colors="#c81e1e", lw=1.8))
        ax.set(xlim=(-20, 4020), ylim=(-20, 1020), aspect="equal", ylabel="y (m)")
        ax.set_title(title, fontsize=10, loc="left")
    axes[2].set_xlabel("x (m)")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "figures" / "section.png")
