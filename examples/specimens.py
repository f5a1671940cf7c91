# Specimens from a grading curve: five shapes of grains
# -----------------------------------------------------------------------------
# shows     how a grading curve becomes a specimen (docs/specimens.md): its
#           grading, packings of five shapes at one void ratio, and the discs
#           that represent rounded polygons and ellipses in the solver
# model     examples/grading.txt, 500 grains of each shape; nothing moves
# run       ./scripts/run examples/specimens.py      (some seconds)
# results   examples/data: specimens.jpg, specimen_grading.jpg,
#           specimen_discs.jpg
# -----------------------------------------------------------------------------
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from mpi4py import MPI

from hpcdem.post.measure.figures import save
from hpcdem.post.specimen import class_key, draw_grains, grading_curve
from hpcdem.pre.specimen import Request, make_specimen, read_grading
from hpcdem.pre.specimen.discs import inscribed
from hpcdem.pre.specimen.shapes import bodies

GRAINS, VOID_RATIO = 500, 0.4
SHAPES = {
    "circle": {},
    "ellipse": {"l_over_d": 1.8},
    "triangle": {"deviation": 12.0, "roundness": 0.25},
    "quadrilateral": {"deviation": 12.0, "roundness": 0.25},
    "pentagon": {"deviation": 12.0, "roundness": 0.25},
}
MM = 1e-3


def packings(curve):
    """One panel for each shape, all at one scale; returns the last specimen."""
    made = {
        shape: make_specimen(Request(
            curve.sizes, curve.percent, shape, GRAINS, slenderness=2.0, void_ratio=VOID_RATIO, **words
        ))
        for shape, words in SHAPES.items()
    }
    widths = [s.width / MM for s in made.values()]
    tallest = max(s.density.room[1] for s in made.values()) / MM
    across, scale = 10.0, 8.2 / (sum(widths) * 1.08)  # inches, inches per mm
    tall = tallest * scale
    figure = Figure(figsize=(across, tall + 0.4))
    left = 0.1
    for (shape, s), width in zip(made.items(), widths):
        height = s.density.room[1] / MM
        ax = figure.add_axes(
            (left / across, 0.1 / (tall + 0.4), width * scale / across, tall / (tall + 0.4))
        )
        draw_grains(ax, s.outlines, s.class_of, len(curve.sizes), MM)
        ax.add_patch(Rectangle((0, 0), width, height, fill=False, lw=0.8))
        ax.set(xlim=(-0.2, width + 0.2), ylim=(-0.2, tallest + 0.2), aspect="equal")
        ax.axis("off")
        ax.text(width / 2, height + 1.0, f"{shape}s", ha="center", va="bottom", fontsize=9)
        left += width * scale * 1.08
    class_key(ax, curve.sizes, s.counts)
    return figure, s


def discs():
    """Outlines with the discs inside them, at two gaps."""
    shapes = [
        bodies("ellipse", np.ones(1), l_over_d=2.0)[0],
        bodies("triangle", np.ones(1), roundness=0.25)[0],
        bodies("quadrilateral", np.ones(1), deviation=10.0, roundness=0.1, seed=4)[0],
        bodies("pentagon", np.ones(1), deviation=10.0, roundness=0.25, seed=1)[0],
    ]
    figure = Figure(figsize=(6.7, 3.9), layout="constrained")
    for row, gap in zip(figure.subplots(2, len(shapes)), (0.03, 0.01)):
        for ax, outline in zip(row, shapes):
            found = inscribed(outline, np.ones(1), gap)
            draw_grains(ax, outline, np.zeros(1, int), 1)
            ax.collections[0].set_facecolor("#f3c9b0")
            for x, y, r in zip(found.x, found.y, found.r):
                ax.add_patch(Circle((x, y), r, fc="#3f7fb530", ec="#1b4f7a", lw=0.6))
            ax.set(xlim=(-0.53, 0.53), ylim=(-0.53, 0.53), aspect="equal")
            ax.axis("off")
            text = f"{len(found.r)} discs, {100 * found.coverage[0]:.1f} %\ngap {100 * found.gap[0]:.1f} %"
            ax.set_title(text, fontsize=7.5, y=-0.08, va="top")
    return figure


if MPI.COMM_WORLD.rank == 0:
    folder = Path(__file__).parent / "data"
    folder.mkdir(exist_ok=True)
    curve = read_grading(Path(__file__).parent / "grading.txt")
    figure, last = packings(curve)
    save(figure, folder / "specimens.jpg", 200)
    reached = last.achieved
    numbers = [("Cu", curve.uniformity, reached.uniformity), ("Cc", curve.curvature, reached.curvature)]
    save(grading_curve(curve.sizes, reached.percent, curve.percent, numbers), folder / "specimen_grading.jpg", 200)
    save(discs(), folder / "specimen_discs.jpg", 200)
    print(f"void ratio {last.density.void_ratio:.3f}, {len(last)} grains of each shape")
