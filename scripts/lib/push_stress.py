"""Shear stress in the manual's push.py after 10 km: several seeds compared with the published page, region by region.

    python scripts/lib/push_stress.py ../shared --seeds 1:10 --out runs     # repeat to continue
    python scripts/lib/push_stress.py ../shared                             # the published page alone

The published values are read from the colours of its lowest panel (bar: 0 to 200 MPa, the difference of the principal
stresses); pixels under the shaded bands of strain, lines and letters are not colours of the bar and are left out. The
table (Markdown) has the median of each region on the page, and the mean and standard deviation of those of our runs.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import click
import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.image import imread

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from hpcdem.post.section import read_section  # noqa: E402
from hpcdem.sweep import Sweep  # noqa: E402

X = ((10.5, 15.0), (15.0, 20.0), (20.0, 25.0), (25.0, 30.0), (30.0, 39.0))
Y = ((0.3, 1.0), (1.0, 2.0), (2.0, 3.5))
"""Regions [km], without the cells along walls and surface."""
LEFT, TEN, BOTTOM, TOP = 71.0, 278.0, 740.0, 533.0
"""Columns of x = 0 and 10 km and rows of y = 0 and 10 km in the picture [pixels]."""
BAR = 200.0
"""Value at the end of the bar [MPa]."""
NEAR = 0.12
"""Largest distance of a pixel from a colour of the bar, in fractions of red, green and blue."""


def published(picture: Path) -> np.ndarray:
    """(n, 3): x, y [km] and value [MPa] of the pixels of the lowest panel that have a colour of the bar."""
    pixels = imread(picture)[:, :, :3]
    rows, columns = np.mgrid[int(TOP) + 2 : int(BOTTOM) - 1, int(LEFT) + 2 : pixels.shape[1] - 20]
    shades = colormaps["jet"](np.linspace(0.0, 1.0, 256))[:, :3]
    seen = pixels[rows, columns].reshape(-1, 3)
    value, off = np.empty(len(seen)), np.empty(len(seen))
    for first in range(0, len(seen), 20_000):
        some = slice(first, first + 20_000)
        far = np.linalg.norm(seen[some, None] - shades, axis=2)
        value[some], off[some] = BAR * far.argmin(axis=1) / 255.0, far.min(axis=1)
    scale = 10.0 / (TEN - LEFT), 10.0 / (BOTTOM - TOP)
    x, y = (columns.ravel() - LEFT) * scale[0], (BOTTOM - rows.ravel()) * scale[1]
    return np.column_stack([x, y, value])[off < NEAR]


def medians(points: np.ndarray) -> np.ndarray:
    """(3, 5): the median of the values in each region."""
    x, y, value = points[np.isfinite(points[:, 2])].T
    inside = [[(x > a) & (x < b) & (y > low) & (y < high) for a, b in X] for low, high in Y]
    return np.array([[np.median(value[some]) for some in row] for row in inside])


def made(script: Path, seeds: str, out: Path) -> np.ndarray:
    """(runs, 3, 5): medians of the runs with these seeds."""
    lines = script.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line.upper().startswith("GEN"))
    text = "\n".join([*lines[:first], "SET seed 5", *lines[first:], ""])
    text = text.replace("save 2000.0 print 1000.0 ps 1000.0 vtk 1000.0", "print 5000.0")
    for word in ("vtk", "ps", "print"):
        text = text.replace(f"SET {word} 1000", f"SET {word} 0")
    out.mkdir(parents=True, exist_ok=True)
    (out / "push.py").write_text(text, encoding="utf-8")
    sweep = Sweep(out / "push.py", seed=seeds, folder=out / "seeds")
    states = sweep.run()
    return np.array([measured(m.folder) for m in sweep.members if states[m.name] == "done"])


def measured(folder: Path) -> np.ndarray:
    """(3, 5): medians of the last frame of a run."""
    sections = folder / "data/ss/data"
    if not sections.exists():
        program = [sys.executable, "-m", "hpcdem", "-s", "data", "--delball"]
        subprocess.run(program, cwd=folder, stdout=subprocess.DEVNULL, check=True)
    section = read_section(max(sections.glob("all_*.npz")))
    x, y = (axis.ravel() / 1e3 for axis in np.meshgrid(section.x, section.y))
    shear = section.fields["shear"].ravel()
    return medians(np.column_stack([x, y, shear / 0.5e6]))


def draw(runs: np.ndarray, theirs: np.ndarray, path: Path) -> None:
    """Medians along x at each depth, deepest last: each run, mean, band of two standard deviations; the page as
    points."""
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    middles = [sum(ends) / 2.0 for ends in X]
    axes = figure.subplots(1, len(Y), sharey=True)
    for ax, j in zip(axes, reversed(range(len(Y)))):
        mean, spread = runs[:, j].mean(axis=0), runs[:, j].std(axis=0, ddof=1)
        ax.fill_between(middles, mean - 2.0 * spread, mean + 2.0 * spread, color="#c8d6e8", label="mean ± 2 s")
        ax.plot(middles, runs[:, j].T, color="#4477aa", lw=0.6)
        ax.plot(middles, mean, color="#1e3c6e", lw=2.0, label=f"mean of {len(runs)} seeds")
        ax.plot(middles, theirs[j], "o", color="#c81e1e", label="published")
        ax.set(xlabel="x (km)", title=f"{Y[j][0]:g} to {Y[j][1]:g} km above the floor")
        ax.title.set_size("medium")
    axes[0].set_ylabel("σ1 − σ3 (MPa)")
    axes[0].set_ylim(bottom=0.0)
    axes[0].legend(frameon=False)
    figure.savefig(path, dpi=130)


@click.command()
@click.argument("shared", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--seeds", help="As 1:10; default: the published page alone.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("push_seeds"), show_default=True)
@click.option("--figure", type=click.Path(dir_okay=False, path_type=Path), help="Also draw the runs into FILE.")
def main(shared: Path, seeds: str | None, out: Path, figure: Path | None) -> None:
    """Compare stresses with the page in SHARED/reference_figures; the script is SHARED/manual_scripts/push.py."""
    theirs = medians(published(shared / "reference_figures/push_10km.png"))
    runs = made(shared / "manual_scripts/push.py", seeds, out) if seeds else np.empty((0, *theirs.shape))
    print("| y, km | x, km | published, MPa |" + f" {len(runs)} seeds, MPa |" * (len(runs) > 1))
    print("|---" * (3 + (len(runs) > 1)) + "|")
    for j, i in np.ndindex(theirs.shape):
        values = runs[:, j, i]
        ours = f" {values.mean():.0f} ± {values.std(ddof=1):.0f} |" if len(runs) > 1 else ""
        print(f"| {Y[j][0]:g} to {Y[j][1]:g} | {X[i][0]:g} to {X[i][1]:g} | {theirs[j, i]:.0f} |{ours}")
    if figure is not None and len(runs) > 1:
        draw(runs, theirs, figure)


if __name__ == "__main__":
    main()
