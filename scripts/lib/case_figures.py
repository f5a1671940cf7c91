"""Figures of docs/cases.md and docs/validation.md: beam, tunnel and slopes as their scripts make them.

`python scripts/lib/case_figures.py [FOLDER]` runs the three scripts (some minutes) and draws into docs/figures.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy as np

from hpcdem.cases import Slope, ThreePointBend, Tunnel
from hpcdem.cases.base import Case
from hpcdem.io.vtkhdf_mesh import MeshState, read_mesh_frame
from hpcdem.post import blocks

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the studies are those of the tests

CM = 1.0 / 2.54
FONT = 8.0
STYLE = {"font.size": FONT, "axes.linewidth": 0.6, "lines.linewidth": 1.1}


def frames(folder: Path, case: Case) -> list[MeshState]:
    """Run the script of a case in a folder; its frames in the order of steps."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{case.name}.sc").write_text(case.script())
    subprocess.run([sys.executable, "-m", "hpcdem", "--no-figure", f"{case.name}.sc"], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip
    return [read_mesh_frame(path) for path in sorted((folder / "data").glob(f"{case.name}_*.vtkhdf"))]


def _seen(axes: Any, x: tuple[float, float], y: tuple[float, float], size: float, unit: str) -> None:
    """The part of the plane from ... to ... [m], ticks in `unit`, which is `size` metres."""
    axes.set(xlim=x, ylim=y, aspect="equal", xlabel=f"x ({unit})", ylabel=f"y ({unit})")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value / size:g}")


def bend(folder: Path, case: ThreePointBend) -> Any:
    """The cracked middle of the beam at the end, and the load over the deflection."""
    state = frames(folder, case)[-1]
    curve = np.loadtxt(folder / "data" / "bend.csv", delimiter=",", skiprows=1, usecols=(1, 2))
    figure, (left, right) = plt.subplots(1, 2, figsize=(17 * CM, 7 * CM), layout="constrained")
    wide = 0.8 * case.height
    blocks.cracks(left, state, FONT, 7.0 / (2 * wide))
    left.plot([0, 0], [0, case.notch], color="black", linewidth=1.4)
    _seen(left, (-wide, wide), (-0.04 * case.height, 1.12 * case.height), 1e-3, "mm")
    left.annotate("", (0, case.height), (0, 1.11 * case.height), arrowprops={"arrowstyle": "-|>", "color": "black"})
    left.set_title(f"(a) t = {1e3 * state.time:.1f} ms", loc="left", fontsize=FONT)
    right.plot(*curve.T, color="#1e3cb4")
    times = np.loadtxt(folder / "data" / "history_way.csv", delimiter=",", skiprows=1)
    here = -1e3 * np.interp(state.time, times[:, 1], times[:, 2])
    right.plot(here, np.interp(here, *curve.T), "o", color="#c81e1e", markersize=4, label="as in (a)")
    right.set(xlabel="deflection (mm)", ylabel="load (kN/m)", xlim=(0, None))
    right.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    right.legend(frameon=False)
    right.set_title("(b)", loc="left", fontsize=FONT)
    return figure


def tunnel(folder: Path, case: Tunnel) -> Any:
    """Cracks around the tunnel at the end, and the stress."""
    state = frames(folder, case)[-1]
    figure, (left, right) = plt.subplots(1, 2, figsize=(17 * CM, 7.8 * CM), layout="constrained")
    wide = case.zone * case.radius * 1.05
    blocks.cracks(left, state, FONT, 7.0 / (2 * wide))
    filled = blocks.contours(
        right, state, blocks.CONTOURS["stress"], (0.0, 2.0 * max(-case.stress_xx, -case.stress_yy))
    )
    bar = figure.colorbar(filled, ax=right, shrink=0.8)
    bar.set_label("larger compressive stress (MPa)")
    for axes, label in ((left, "(a)"), (right, "(b)")):
        _seen(axes, (-wide, wide), (-wide, wide), 1.0, "m")
        axes.set_title(label, loc="left", fontsize=FONT)
    return figure


def slope(folder: Path, case: Slope) -> Any:
    """Larger compressive stress before the excavation and after every second bench."""
    states = frames(folder, case)
    chosen = [0, *range(2, len(states), 2)] if len(states) > 3 else list(range(len(states)))
    figure, panels = plt.subplots(len(chosen), 1, figsize=(12 * CM, 4.6 * CM * len(chosen)), layout="constrained",
                                  sharex=True)  # fmt: skip
    depth = case.benches * case.bench_height + case.below
    shown = blocks.CONTOURS["stress"]
    span = (0.0, case.density * case.gravity * depth)
    for axes, k, letter in zip(np.atleast_1d(panels), chosen, "abcdefgh", strict=False):
        state = states[k]
        filled = blocks.contours(axes, state, shown, span)
        low, high = state.points.min(axis=0), state.points.max(axis=0)
        x, y = (float(low[0]), float(high[0])), (-case.below, case.benches * case.bench_height + 1.0)
        _seen(axes, x, y, 1.0, "m")
        axes.set_xlabel("x (m)" if k == chosen[-1] else "")
        told = "before the excavation" if k == 0 else f"bench {k} taken out"
        axes.set_title(f"({letter}) {told}", loc="left", fontsize=FONT)
    bar = figure.colorbar(filled, ax=list(np.atleast_1d(panels)), shrink=0.6)
    bar.set_label(f"larger compressive stress ({blocks.unit_of(shown, span)[1]})")
    return figure


def studies(times: tuple[float, ...] = (1, 2, 5, 10, 20, 50), sizes: tuple[int, ...] = (8, 16, 32)) -> Any:
    """Stiffness of jointed lattices over the penalty, and errors of a ring over the size of its elements."""
    from tests.cases.mesh_size import test_mesh_size as mesh_size
    from tests.cases.penalty import exact
    from tests.cases.penalty import test_penalty as penalty

    figure, (left, right) = plt.subplots(1, 2, figsize=(17 * CM, 7 * CM), layout="constrained")
    fine = np.logspace(0.0, 2.0, 60)
    plane = penalty.E / (1.0 - penalty.NU**2)
    marks = {"squares": ("s", "#1e3cb4"), "both": ("D", "#d98c00"), "equilateral": ("^", "#c81e1e")}
    words = {"squares": "squares", "both": "squares with both diagonals", "equilateral": "equilateral triangles"}
    for kind, (mark, colour) in marks.items():
        closed = [exact.stiffness(penalty.E, penalty.NU, p * penalty.E, kind) / plane for p in fine]
        left.plot(fine, closed, color=colour, linewidth=0.9)
        sims = [penalty.pulled(penalty.lattice(kind), p * penalty.E) for p in times]
        found = [penalty.STRESS / penalty.strains(sim)[0] / plane for sim in sims]
        left.plot(times, found, mark, color=colour, markersize=4, label=words[kind])
    left.set(xscale="log", xlabel="penalty over Young's modulus", ylabel="stiffness over that without joints",
             ylim=(0, 1.02))  # fmt: skip
    left.legend(frameon=False, loc="lower right")
    left.set_title("(a)", loc="left", fontsize=FONT)
    for kind, word, colour in (("cross", "triangles", "#c81e1e"), ("quad", "quads", "#1e3cb4")):
        found = np.array([mesh_size.errors(n, kind) for n in sizes])
        size = 90.0 / np.array(sizes)
        right.plot(size, found[:, 0], "o-", color=colour, markersize=4, label=f"{word}: displacement")
        right.plot(size, found[:, 1], "s--", color=colour, markersize=4, label=f"{word}: stress")
    ends = np.array([90.0 / sizes[-1], 90.0 / sizes[0]])
    for order in (1, 2):
        right.plot(ends, 0.05 * (ends / ends[1]) ** order, color="0.6", linewidth=0.7)
        right.annotate(f"order {order}", (ends[0], 0.05 * (ends[0] / ends[1]) ** order), fontsize=0.9 * FONT,
                       xytext=(0, 4), textcoords="offset points", color="0.4")  # fmt: skip
    right.set(xscale="log", yscale="log", xlabel="elements, degrees of the ring", ylabel="relative error")
    right.set_xticks(90.0 / np.array(sizes), labels=[f"{90.0 / n:g}" for n in sizes])
    right.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    right.set_ylim(3e-6, 0.08)
    right.legend(frameon=False, fontsize=0.9 * FONT, loc="lower right")
    right.set_title("(b)", loc="left", fontsize=FONT)
    return figure


def draw_all(folder: Path, work: Path, **cases: Case) -> list[str]:
    """Write the figures; cases: others than the usual ones, by the name of the figure. Names of the files."""
    usual: dict[str, Case] = {"bend": ThreePointBend(), "tunnel": Tunnel(joints=True), "slope": Slope(), **cases}
    made = []
    with matplotlib.rc_context(STYLE):
        for name, drawn in (("bend", bend), ("tunnel", tunnel), ("slope", slope)):
            figure = drawn(work / name, usual[name])  # type: ignore[operator]
            made.append(f"case_{name}.png")
            figure.savefig(folder / made[-1], dpi=150)
            plt.close(figure)
        studies().savefig(folder / "case_studies.png", dpi=150)
    return [*made, "case_studies.png"]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        print(*draw_all(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/figures"), Path(place)))
