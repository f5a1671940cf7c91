"""Faults of a frame for a view: the lines that ``hpcdem measure DIR faults --over-time`` found in it."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from hpcdem.core.errors import HpcdemError

TABLE = "measure/faults.csv"
ENDS = ("x1[m]", "y1[m]", "x2[m]", "y2[m]")
FIELDS = (
    "length[m]", "dip[deg]", "slip[m]", "mean_slip[m]", "throw[m]", "heave[m]", "opening[m]", "slip_rate[m/s]",
)  # fmt: skip


def faults(path: Path, step: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the faults of the frame in a file: ends (n, 2, 2) [m] and fields, from the table beside the file; none
    without a table. HpcdemError if it is damaged."""
    table, ini = path.parent / TABLE, path.stem.endswith("_ini")
    try:
        with open(table, encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if "fault" in row]
        rows = [row for row in rows if (int(row["step"]), int(row["ini"])) == (step, ini)]
        found = {name: np.array([float(row[name] or "nan") for row in rows]) for name in (*ENDS, *FIELDS)}
        fault = np.array([int(row["fault"]) for row in rows], np.int64)
        active = np.array([row["state"] == "active" for row in rows], np.int64)
    except FileNotFoundError:
        return np.zeros((0, 2, 2)), {}
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise HpcdemError(f"{table} is damaged ({problem}): measure the folder again, or delete the table") from None
    ends = np.stack([found[name] for name in ENDS], axis=1).reshape(-1, 2, 2)
    return ends, {"fault": fault, "active": active} | {name.partition("[")[0]: found[name] for name in FIELDS}
