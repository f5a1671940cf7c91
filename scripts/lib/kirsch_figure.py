"""Stress around a hole: the model of docs/validation.md and its figure. `python scripts/lib/kirsch_figure.py [FILE]`"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.tri import Triangulation

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from hpcdem.physics.fdem import changes, diagnostics, equilibrium  # noqa: E402
from hpcdem.physics.fdem.mesh import Mesh  # noqa: E402
from hpcdem.physics.fdem.simulation import Blocks  # noqa: E402
from tests.cases.kirsch import exact  # noqa: E402

EDGES = 96
ROCK = {"density": 2500.0, "young": 50e9, "poisson_ratio": 0.25, "damp_factor": 1.0}
NAMES = ("radial", "tangential", "shear")
SYMBOLS = ("$\\sigma_r$", "$\\sigma_\\theta$", "$\\tau_{r\\theta}$")
COLOURS = ("#1e3cb4", "#c81e1e", "#2f7d32")
MPA = 1e-6


def disk(kind: str, edges: int = EDGES) -> Mesh:
    """Rings of quads ("quad") or of triangles with diagonals in turn ("tri") from the hole to R, as wide as long: each
    is 1 + 2 pi / edges times the one before (1.065 with 96)."""
    rings = round(math.log(exact.R / exact.A) / math.log1p(2.0 * math.pi / edges))
    r = exact.A * (exact.R / exact.A) ** (np.arange(rings + 1) / rings)
    t = 2.0 * math.pi * np.arange(edges) / edges
    points = np.column_stack([np.outer(r, np.cos(t)).ravel(), np.outer(r, np.sin(t)).ravel()])
    cells = []
    for i in range(rings):
        for j in range(edges):
            a, b = i * edges + j, (i + 1) * edges + j
            c, d = (i + 1) * edges + (j + 1) % edges, i * edges + (j + 1) % edges
            if kind == "quad":
                cells.append((a, b, c, d))
            elif (i + j) % 2:
                cells += [(a, b, c, -1), (a, c, d, -1)]
            else:
                cells += [(a, b, d, -1), (b, c, d, -1)]
    return Mesh.of(points, cells)


def plate(kind: str, edges: int = EDGES, uniform: bool = False, rise: float = 0.0) -> Blocks:
    """The disk, held against rigid movement, with the tractions of Kirsch's solution on its rim; or with those of the
    uniform far stress, which rises smoothly during the first `rise` seconds."""
    mesh = disk(kind, edges)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    found = mesh.edges()
    middle = mesh.points[found.points].mean(axis=1)
    rim = np.flatnonzero(~found.inner & (np.hypot(*middle.T) > 0.5 * exact.R))
    if uniform:
        values: tuple[float | str, float | str] = exact.P1, exact.P2
        if rise > 0.0:
            part = np.linspace(0.0, 1.0, 41)
            for name, value in (("xx", exact.P1), ("yy", exact.P2)):
                steps = value * 0.5 * (1.0 - np.cos(np.pi * part))
                sim.table(name, list(zip((rise * part).tolist(), steps.tolist())))
            values = "xx", "yy"
        sim.stress_condition(found.faces[rim, 0], xx=values[0], yy=values[1])
    else:
        for face, (x, y) in zip(found.faces[rim, 0], middle[rim]):
            t = np.array(math.atan2(y, x))
            xx, yy, xy = exact.turned(*exact.polar(np.array(exact.R), t), -t)
            sim.stress_condition([face], xx=float(xx), yy=float(yy), xy=float(xy))
    first = len(mesh.points) - edges
    sim.velocity_condition([first, first + edges // 2], vy=0.0)
    sim.velocity_condition([first + edges // 4], vx=0.0)
    sim.option(collision=False)
    return sim


def polar(sim: Blocks) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """r [m], t [rad] of the centroids, and s_r, s_t, s_rt [Pa] of the model and exact, there."""
    x, y = sim.the_mesh().centroids().T
    r, t = np.hypot(x, y), np.arctan2(y, x)
    stress = (diagnostics.values(sim, name) for name in ("stress_xx", "stress_yy", "stress_xy"))
    return r, t, exact.turned(*stress, t), exact.polar(r, t)


def errors(sim: Blocks) -> dict[str, float]:
    """Mean square over the area between 1.05 a and 5 a, over the larger far stress, by component."""
    r, _, found, expected = polar(sim)
    near = (r > 1.05 * exact.A) & (r < 5.0 * exact.A)
    area = sim.the_mesh().areas()[near]
    return {
        name: float(np.sqrt(np.average((a - b)[near] ** 2, weights=area)) / abs(exact.P1))
        for name, a, b in zip(NAMES, found, expected)
    }


def draw(path: Path) -> Blocks:
    """The figure: tangential and radial stress around the hole, and both along two lines with the exact curves."""
    sim = plate("quad")
    sim.option(dynamic=False)
    equilibrium.solve_elastic(sim)
    r, t, found, _ = polar(sim)
    mesh = sim.the_mesh()
    # Corners share the mean of their elements, quads are cut in two: contours without steps.
    corner = mesh.cells.reshape(-1)
    halves = np.concatenate([mesh.cells[:, [0, 1, 2]], mesh.cells[:, [0, 2, 3]]])
    triangles = Triangulation(*mesh.points.T, halves)
    with plt.rc_context({"font.size": 8, "axes.linewidth": 0.6}):
        figure = plt.figure(figsize=(7.2, 5.6), dpi=130, layout="constrained")
        axes = figure.subplot_mosaic([["map0", "map1"], ["line0", "line1"]], height_ratios=[1.25, 1.0])
        for k, (panel, levels) in enumerate((("map0", (0, 20, 2)), ("map1", (5, 50, 5)))):
            ax = axes[panel]
            steps = np.arange(levels[0], levels[1] + 1e-9, levels[2])
            field = np.bincount(corner, -MPA * np.repeat(found[k], 4)) / np.bincount(corner)
            cells = ax.tricontourf(triangles, field, steps, cmap="viridis_r", extend="both")
            ax.tricontour(triangles, field, steps, colors="white", linewidths=0.3)
            ax.set(xlim=(-4, 4), ylim=(-3, 3), aspect="equal", xlabel="x / a", ylabel="y / a")
            figure.colorbar(cells, ax=ax, shrink=0.72, aspect=16, pad=0.02, label=f"$-${SYMBOLS[k]}, MPa")
            ax.set_title(("radial", "tangential")[k] + " pressure", fontsize=8)
        line = np.linspace(1.0, 5.0, 400)
        for panel, angle, axis in (("line0", 0.0, "x"), ("line1", 90.0, "y")):
            ax = axes[panel]
            half = math.radians(angle) + math.pi / EDGES  # elements lie between two rays; these are exact there
            on = np.flatnonzero((np.abs(t - half) < 1e-6) & (r < 5.0))
            curves = exact.polar(line, np.full(len(line), half))
            for k in range(2):
                ax.plot(line, -MPA * curves[k], color=COLOURS[k], lw=1.0)
                ax.plot(
                    r[on],
                    -MPA * found[k][on],
                    "o",
                    ms=3.2,
                    mfc="none",
                    mew=0.8,
                    color=COLOURS[k],
                    label=f"$-${SYMBOLS[k]}",
                )
            ax.set(xlim=(1, 5), xlabel=f"{axis} / a", ylabel="pressure, MPa")
            ax.set_ylim(bottom=0.0)
            ax.set_title(f"along {axis}", fontsize=8)
            ax.legend(frameon=False, title="points: model, lines: Kirsch", title_fontsize=7)
        figure.savefig(path)
        plt.close(figure)
    return sim


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "figures" / "kirsch_static.png")
