"""The figure of docs/flexure.md: the end of examples/foreland.py above deflection, load and moment along the plate.

``python scripts/lib/flexure_figure.py DATA FILE``, DATA being the folder of the results.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection

from hpcdem.api import frames
from hpcdem.core.picture_words import NUMBERS

NAMES = {number: name for name, number in NUMBERS.items()}


def draw(data: Path, target: Path) -> None:
    """Draw the last frame and the last rows of flexure.csv."""
    p = frames(data)[-1].table("particles")
    rows = np.genfromtxt(data / "flexure.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    last = rows[rows["step"] == rows["step"][-1]]
    ratios = (2.2, 1.3, 1.0)
    figure, axes = plt.subplots(3, 1, figsize=(9.0, 6.4), sharex=True, height_ratios=ratios, layout="constrained")
    top, middle, low = axes
    colours = {"yellow": "#e8c95a", "green": "#6aa84f", "red": "#b5533c"}
    faces = [colours.get(NAMES.get(int(number), ""), "#999999") for number in p["color"]]
    size = 2.0 * p["radius"] / 1e3
    places = np.column_stack([p["x"], p["y"]]) / 1e3
    top.add_collection(EllipseCollection(size, size, np.zeros(len(size)), units="xy", facecolors=faces, linewidths=0.0,
                                         offsets=places, offset_transform=top.transData))  # fmt: skip
    x = last["x"] / 1e3
    top.fill_between(x, -last["deflection"] / 1e3, -6.0, color="#c9c4d6", lw=0.0)
    top.plot(x, -last["deflection"] / 1e3, color="black", lw=1.2)
    top.set(ylim=(-2.0, 5.0), xlim=(x[0], x[-1]), ylabel="y (km), exaggerated", title="examples/foreland.py")
    middle.plot(x, -last["deflection"], label="base", color="#3b6ea5")
    middle.plot(x, -last["equilibrium"], "--", label="in equilibrium with the last load", color="#c07000")
    middle.axhline(0.0, color="#888888", lw=0.6)
    middle.set(ylabel="height (m)")
    middle.legend(frameon=False)
    low.fill_between(x, last["load"] / 1e6, step="mid", color="#bfd3e6", label="load of the discs")
    low.set(ylabel="load (MPa)", xlabel="x (km)")
    figure.savefig(target, dpi=130)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
