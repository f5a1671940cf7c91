"""Results of a calibration: tables, a page and a figure."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from hpcdem.io.agreed import atomic_path
from hpcdem.sweep.calibration import Result
from hpcdem.sweep.forward import Settings


def write(result: Result, settings: Settings, folder: Path) -> list[Path]:
    """calibration.md, runs.csv, posterior.csv, calibration.png, and calibrated.txt with the lines of [write]."""
    logs = [one.log for test in settings.tests for one in test.measured]
    files = {
        "calibration.md": page(result, logs),
        "runs.csv": _runs(result, logs),
        "posterior.csv": _table(result.names, result.parameters),
    }
    if settings.lines:
        files["calibrated.txt"] = "".join(line.format(**result.best) + "\n" for line in settings.lines)
    paths = []
    for name, text in files.items():
        with atomic_path(folder / name) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")
        paths.append(folder / name)
    draw(result, folder / "calibration.png")
    return [*paths, folder / "calibration.png"]


def _unit(value: np.ndarray | float, log: bool) -> np.ndarray | float:
    return np.exp(value) if log else value


def page(result: Result, logs: list[bool]) -> str:
    """Posterior, targets beside predictions, sensitivity, cautions, in Markdown."""
    quantiles = np.quantile(result.parameters, (0.05, 0.5, 0.95), axis=0).T
    lines = [
        "# Calibration", "", f"{len(result.points)} points, {result.values.shape[1]} seeds each.", "",
        "| parameter | 5 % | median | 95 % | range |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for name, (low, middle, high), r in zip(result.names, quantiles, result.ranges):
        lines.append(f"| {name} | {low:.4g} | {middle:.4g} | {high:.4g} | {r.low:.4g} to {r.high:.4g} |")
    lines += ["", "| target | value | tolerance | predicted | spread | seeds |", "|---|---|---|---|---|---|"]
    for k, (target, log) in enumerate(zip(result.targets, logs)):
        predicted = _unit(result.predicted[:, k], log)
        value = float(_unit(target.value, log))
        tolerance = target.tolerance * value if log else target.tolerance
        noise = result.emulators[k].noise * (value if log else 1.0)
        lines.append(
            f"| {target.name} | {value:.4g} | {tolerance:.3g} | {np.mean(predicted):.4g} | {np.std(predicted):.3g} "
            f"| {noise:.3g} |"
        )
    lines += [
        "", "Change of each target, in tolerances, from one standard deviation below the mean of a parameter to one "
        "above:", "", "| target | " + " | ".join(result.names) + " |", "|---" * (len(result.names) + 1) + "|",
    ]  # fmt: skip
    for target, row in zip(result.targets, result.sensitivity()):
        lines.append(f"| {target.name} | " + " | ".join(f"{one:.2f}" for one in row) + " |")
    cautions = result.cautions() or ["the targets determine all parameters"]
    return "\n".join([*lines, "", "What the targets determine:", "", *(f"- {one}" for one in cautions), ""])


def _table(names: tuple[str, ...], rows: np.ndarray) -> str:
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(names)
    table.writerows([f"{value:.8g}" for value in row] for row in rows.tolist())
    return out.getvalue()


def _runs(result: Result, logs: list[bool]) -> str:
    seeds = result.values.shape[1]
    at = np.array([[r.at(min(float(u), 1.0 - 1e-12)) for r, u in zip(result.ranges, row)] for row in result.points])
    values = result.values.reshape(-1, len(result.targets)).copy()
    values[:, logs] = np.exp(values[:, logs])
    names = (*result.names, "seed_number", *(target.name for target in result.targets))
    number = np.tile(np.arange(seeds), len(at))[:, None]
    return _table(names, np.hstack([np.repeat(at, seeds, axis=0), number, values]))


def draw(result: Result, path: Path) -> None:
    """Posterior of each parameter, and of each pair, with the runs."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    d = len(result.names)
    figure = Figure(figsize=(2.4 * d + 0.6, 2.4 * d + 0.4), layout="constrained")
    axes = figure.subplots(d, d, squeeze=False)
    samples = result.parameters
    runs = np.array([[r.at(min(float(u), 1.0 - 1e-12)) for r, u in zip(result.ranges, row)] for row in result.points])
    for i in range(d):
        for j in range(d):
            ax = axes[i][j]
            if j > i:
                ax.set_axis_off()
                continue
            r = result.ranges[j]
            edges = np.geomspace(r.low, r.high, 31) if r.log else np.linspace(r.low, r.high, 31)
            ax.set_xscale("log" if r.log else "linear")
            if i == j:
                ax.hist(samples[:, i], edges, color="#3c78b4")
                ax.set_yticks([])
            else:
                ax.set_yscale("log" if result.ranges[i].log else "linear")
                ax.plot(samples[:, j], samples[:, i], ".", ms=1.5, alpha=0.25, color="#3c78b4", rasterized=True)
                ax.plot(runs[:, j], runs[:, i], "+", ms=5, mew=0.8, color="#202020")
                ax.set_ylim(result.ranges[i].low, result.ranges[i].high)
            ax.set_xlim(r.low, r.high)
            ax.xaxis.set_minor_formatter(NullFormatter())
            ax.yaxis.set_minor_formatter(NullFormatter())
            if i == d - 1:
                ax.set_xlabel(result.names[j])
            if j == 0 and i:
                ax.set_ylabel(result.names[i])
    figure.savefig(path, dpi=130)
