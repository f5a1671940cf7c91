"""A published run compared with twins of it: does it lie within what chance alone makes of our model?

    python scripts/lib/published_wedge.py ../shared/li2022 --twins 20 --out runs      # runs 10 km (repeat to continue)
    python scripts/lib/published_wedge.py ../shared/li2022                            # runs recorded in its README

Prints a table (Markdown) by km of shortening: mean and standard deviation of our runs, the published value, its
distance in standard deviations, the probability of a distance at least as large for one more run of ours (Student's t
with n - 1 degrees of freedom), and how many of our runs lie below it. The last line compares the means over 5 to 10 km
of height and slope together (Hotelling's T2). ``--figure FILE`` draws both.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import click
import numpy as np
from matplotlib.figure import Figure
from scipy import stats

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from hpcdem.io.frames import list_frames, read_frame  # noqa: E402
from hpcdem.post.measure.surface import surface  # noqa: E402
from hpcdem.post.measure.wedge import wedge  # noqa: E402
from hpcdem.sweep import Sweep  # noqa: E402

NAMES = "height [km]", "toe [km]", "slope [°]"
KM = np.arange(1, 11)
LATE = KM >= 5
"""Means are taken over these: before, the wedge is hardly wider than it is high."""
BASE, COLUMN, STEPS = 1000.0, 200.0, 10_000
"""Height of the floor and width of a column [m]; steps per km of shortening."""


def numbers(text: str) -> list[float]:
    """The numbers of a cell."""
    return [float(word) for word in text.split()]


def published(readme: str) -> np.ndarray:
    """(10, 3): values of NAMES at each km, from the first table of the README."""
    rows = re.findall(r"^\| (\d+) \| (\S+) \| (\S+) \| (\S+) \|$", readme, re.MULTILINE)
    found = {int(row[0]): [float(word) for word in row[1:]] for row in rows}
    return np.array([found[k] for k in KM])


def recorded(readme: str) -> np.ndarray:
    """(runs, 10, 3): our runs in the second table of the README; NaN where it has no value."""
    rows = re.findall(r"^\| (\d+) \| ([\d. ]+) \| \S+ \| ([\d. ]+) \| \S+ \|$", readme, re.MULTILINE)
    runs = np.full((len(numbers(rows[0][1])), len(KM), 3), np.nan)
    for km, heights, slopes in rows:
        runs[:, int(km) - 1, 0], runs[:, int(km) - 1, 2] = numbers(heights), numbers(slopes)
    return runs


def made(source: Path, twins: int, out: Path) -> np.ndarray:
    """(runs, 10, 3) of twins that are run here, each to 10 km with a frame per km."""
    text = (source / "push.py").read_text(encoding="utf-8")
    text = re.sub(r"(?im)^set +(print|ps) .*$", "", text)
    text = re.sub(r"(?i)xmove 20000 .*", "xmove 10000 print 1000.0", text)
    out.mkdir(parents=True, exist_ok=True)
    (out / "push.py").write_text(text, encoding="utf-8")
    sweep = Sweep(out / "push.py", twins=twins, folder=out / "twins", links=[source / "init5km_xyr.dat"])
    states = sweep.run()
    return np.array([measured(m.folder / "data") for m in sweep.members if states[m.name] == "done"])


def measured(folder: Path) -> np.ndarray:
    """(10, 3): values of NAMES in the frames of a run, of the particles above the floor and in front of the right wall:
    without the rows of particles that are walls, and without a few that have slipped through them."""
    found = np.full((len(KM), 3), np.nan)
    for file in list_frames(folder):
        km = file.step // STEPS
        if file.ini or file.step % STEPS or not 1 <= km <= len(KM):
            continue
        frame = read_frame(file.path)
        p = frame.tables["particles"].columns
        x, y, group = (np.asarray(p[name]) for name in ("x", "y", "group"))
        rows = {name.lower(): k for k, name in enumerate(frame.group_names) if name.lower().endswith("_wall")}
        rock = ~np.isin(group, list(rows.values())) & (y >= BASE)
        if "rig_wall" in rows:
            rock &= x < x[group == rows["rig_wall"]].min()
        shape = wedge(*surface(x[rock], y[rock], COLUMN))
        found[km - 1] = (shape.crest[1] - BASE) / 1e3, shape.toe[0] / 1e3, shape.slope
    return found


def beyond(runs: np.ndarray, other: float) -> tuple[float, float, float, float, int]:
    """Mean and standard deviation of runs (n,), the distance of another value from them in standard deviations, the
    probability of a distance at least as large, and how many runs are below it."""
    n, mean, spread = len(runs), float(runs.mean()), float(runs.std(ddof=1))
    z = (other - mean) / spread
    return mean, spread, z, float(2.0 * stats.t.sf(abs(z) / np.sqrt(1.0 + 1.0 / n), n - 1)), int((runs < other).sum())


def together(runs: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Mahalanobis distance of a run (k,) from others (n, k), and the probability of one at least as large (by
    Hotelling)."""
    n, k = runs.shape
    off = other - runs.mean(axis=0)
    squared = float(off @ np.linalg.solve(np.cov(runs.T), off))
    return float(np.sqrt(squared)), float(stats.f.sf(squared * n * (n - k) / (k * (n * n - 1.0)), k, n - k))


def report(runs: np.ndarray, theirs: np.ndarray) -> str:
    """The table."""
    lines = [f"{len(runs)} runs", "", "| | km | ours | published | z | p | below |", "|---|---|---|---|---|---|---|"]
    for j, name in enumerate(NAMES):
        for k, km in enumerate(KM):
            if np.isfinite(runs[:, k, j]).all():
                m, s, z, p, below = beyond(runs[:, k, j], theirs[k, j])
                lines.append(
                    f"| {name} | {km} | {m:.2f} ± {s:.2f} | {theirs[k, j]:.2f} | {z:.1f} | {p:.2f} | {below} |"
                )
    means, other = runs[:, LATE].mean(axis=1)[:, [0, 2]], theirs[LATE].mean(axis=0)[[0, 2]]
    for j, name in enumerate((NAMES[0], NAMES[2])):
        m, s, z, p, below = beyond(means[:, j], other[j])
        lines.append(f"| {name} | mean of 5 to 10 | {m:.2f} ± {s:.2f} | {other[j]:.2f} | {z:.1f} | {p:.2f} | {below} |")
    distance, p = together(means, other)
    return "\n".join([*lines, "", f"Both means together: Mahalanobis distance {distance:.2f}, p = {p:.2f}"])


def draw(runs: np.ndarray, theirs: np.ndarray, path: Path) -> None:
    """Height and slope over shortening: each run, mean, band of two standard deviations; published as points."""
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    for ax, j in zip(figure.subplots(1, 2), (0, 2)):
        known = np.isfinite(runs[:, :, j]).all(axis=0)
        x, y = KM[known], runs[:, known, j]
        mean, spread = y.mean(axis=0), y.std(axis=0, ddof=1)
        ax.fill_between(x, mean - 2.0 * spread, mean + 2.0 * spread, color="#c8d6e8", label="mean ± 2 s")
        ax.plot(x, y.T, color="#4477aa", lw=0.6)
        ax.plot(x, mean, color="#1e3c6e", lw=2.0, label=f"mean of {len(runs)} twins")
        ax.plot(KM, theirs[:, j], "o", color="#c81e1e", label="published")
        ax.set(xlabel="shortening (km)", ylabel=NAMES[j].replace("[", "(").replace("]", ")"), xlim=(0.5, 10.5))
    figure.axes[0].legend(frameon=False)
    figure.savefig(path, dpi=130)


@click.command()
@click.argument("source", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--twins", type=click.IntRange(3), help="Run so many twins; default: the runs recorded in README.md.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("wedge_twins"), show_default=True)
@click.option("--figure", type=click.Path(dir_okay=False, path_type=Path))
def main(source: Path, twins: int | None, out: Path, figure: Path | None) -> None:
    """Compare the published run in SOURCE (initial state, script, README with its values) with twins of it."""
    readme = (source / "README.md").read_text(encoding="utf-8")
    theirs, runs = published(readme), recorded(readme) if twins is None else made(source, twins, out)
    print(report(runs, theirs))
    if figure is not None:
        draw(runs, theirs, figure)


if __name__ == "__main__":
    main()
