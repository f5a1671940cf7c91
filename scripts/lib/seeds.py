"""One ZDEM script with many seeds, measured at its end: what a single run of a chaotic model is worth.

    python scripts/lib/seeds.py push.py --seeds 1-10 --ranks 2 --out runs

Each seed gets a folder of its own; runs that are done are not repeated. Prints a table (Markdown) of height, toe and
surface slope of the wedge and of the thrusts in the strain since the wall began to move, with mean and standard
deviation over the seeds.
"""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import click
import numpy as np

COLUMNS = (
    "height [km]", "toe [km]", "slope [°]", "forethrusts", "backthrusts", "rearmost forethrust [km]",
    "foremost forethrust [km]",
)  # fmt: skip


def seeds_of(text: str) -> list[int]:
    """1-3,7 -> [1, 2, 3, 7]."""
    parts = [part.split("-") for part in text.split(",")]
    return [seed for part in parts for seed in range(int(part[0]), int(part[-1]) + 1)]


def with_seed(script: str, seed: int) -> str:
    """The script with SET seed in front of the first line that makes random particles."""
    lines = script.splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if line.split()[:1] and line.split()[0].upper().startswith("GEN"))
    return "".join([*lines[:first], f"SET seed {seed}\n", *lines[first:]])


def run(script: Path, seed: int, ranks: int, folder: Path) -> None:
    """The run and its measurements, as far as they are not there."""
    done = folder / "done"
    if done.exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    copy = folder / script.name
    copy.write_text(with_seed(script.read_text(), seed))
    program = [sys.executable, "-m", "hpcdem"]
    launch = ["mpiexec", "-n", str(ranks)] if ranks > 1 else []
    with open(folder / "log.txt", "w") as log:
        subprocess.run([*launch, *program, copy.name, "--no-figure"], cwd=folder, stdout=log, check=True)
    done.touch()


def measured(folder: Path, delball: bool) -> list[float]:
    """Values of COLUMNS at the end of a finished run."""
    table = folder / "data/measure/faults.csv"
    if not table.exists():
        program = [sys.executable, "-m", "hpcdem"]
        flags = ["--delball"] if delball else []
        subprocess.run([*program, "-s", "data", *flags], cwd=folder, stdout=subprocess.DEVNULL, check=True)
        subprocess.run(
            [*program, "measure", "data", "wedge", "faults", "--format", "none"],
            cwd=folder, stdout=subprocess.DEVNULL, check=True,
        )  # fmt: skip
    wedge = rows(folder / "data/measure/wedge.csv")[-1]
    bands = [row for row in rows(table) if row["step"] == wedge["step"] and row["sense"] == "reverse"]
    fore = [float(row["x[m]"]) / 1e3 for row in bands if row["vergence"] == "right"]
    shape = float(wedge["height[m]"]) / 1e3, float(wedge["toe_x[m]"]) / 1e3, float(wedge["surface_slope[deg]"])
    return [*shape, len(fore), len(bands) - len(fore), min(fore, default=np.nan), max(fore, default=np.nan)]


def rows(path: Path) -> list[dict[str, str]]:
    """A CSV table."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@click.command()
@click.argument("script", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--seeds", "numbers", default="1-10", show_default=True, help="As 1-3,7.")
@click.option("--ranks", default=1, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("seeds"), show_default=True)
@click.option("--delball", is_flag=True, help="The script deletes particles (as of hpcdem -s).")
def main(script: Path, numbers: str, ranks: int, out: Path, delball: bool) -> None:
    """Run SCRIPT with many seeds and print what comes out."""
    table = []
    print("| seed | " + " | ".join(COLUMNS) + " |\n|---" * 1 + "|---" * len(COLUMNS) + "|")
    for seed in seeds_of(numbers):
        run(script, seed, ranks, out / str(seed))
        table.append(measured(out / str(seed), delball))
        print(f"| {seed} | " + " | ".join(f"{value:.3g}" for value in table[-1]) + " |", flush=True)
    values = np.array(table)
    mean, spread = np.nanmean(values, axis=0), np.nanstd(values, axis=0, ddof=1)
    print("| mean ± spread | " + " | ".join(f"{m:.3g} ± {s:.2g}" for m, s in zip(mean, spread, strict=True)) + " |")


if __name__ == "__main__":
    main()
