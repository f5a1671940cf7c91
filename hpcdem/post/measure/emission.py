"""Statistics of the joints that broke, as of acoustic emission: magnitudes, b-value, rates.

Magnitude: M = 2/3 (log10 E - 4.8), E [J] (Gutenberg 1956, The energy of earthquakes, Q. J. Geol. Soc. 112, 1-14), as
used for broken joints of combined finite-discrete elements by Lisjak, Liu, Zhao, Mahabadi & Grasselli 2013 (Geophys. J.
Int. 195, 423-443).

b-value of log10 N(>= M) = a - b M by maximum likelihood (Aki 1965, Bull. Earthq. Res. Inst. 43, 237-239), from the
magnitudes M >= Mc themselves, so without a correction for bins:

    b = log10(e) / (mean(M) - Mc),   standard error b / sqrt(N)

Mc, the magnitude from which the catalogue is complete: the lower end of the bin of 0.1 that has most events (maximum
curvature: Wiemer & Wyss 2000, Bull. Seismol. Soc. Am. 90, 859-869), unless it is given.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcdem.core.deprecated import present_history
from hpcdem.core.errors import HpcdemError
from hpcdem.io.disk import explain

TABLE = "cracks.csv"
BIN = 0.1
"""Width of the bins of magnitude."""
FEWEST = 10
"""Smallest number of events at or above Mc for which a b-value is given."""
MODES = ("tension", "mixed", "shear")
LIMITS = 4.0 / 3.0, 5.0 / 3.0
"""Modes (1 opened, 2 slid) from which a joint counts as mixed and as shear."""
_COLUMNS = {
    "step": "step", "time [s]": "time", "joint": "joint", "x [m]": "x", "y [m]": "y", "mode": "mode",
}  # fmt: skip
COLUMNS = {
    2: {**_COLUMNS, "length [m]": "size", "kinetic_energy [J/m]": "kinetic",
        "peak_kinetic_energy [J/m]": "peak_kinetic"},
    3: {**_COLUMNS, "z [m]": "z", "joint_area [m2]": "size", "kinetic_energy [J]": "kinetic",
        "peak_kinetic_energy [J]": "peak_kinetic"},
}  # fmt: skip
"""Columns of `cracks.csv` by dimensions of space, and what they are called here."""


@dataclass(frozen=True)
class Events:
    """Joints that broke, in the order of steps; (n,) each: step, time [s], joint, x, y [m], mode (1 opened, 2 slid),
    size: length [m], in space area [m2], kinetic: energy of the two elements then, peak_kinetic: when the joint had
    passed its strength [J/m], in space [J]; z [m], in the plane empty."""

    step: np.ndarray
    time: np.ndarray
    joint: np.ndarray
    x: np.ndarray
    y: np.ndarray
    mode: np.ndarray
    size: np.ndarray
    kinetic: np.ndarray
    peak_kinetic: np.ndarray
    z: np.ndarray

    def __len__(self) -> int:
        return len(self.step)

    def take(self, keep: np.ndarray) -> Events:
        """Select events by a mask or by rows."""
        return Events(**{name: values[keep] if len(values) else values for name, values in vars(self).items()})

    @property
    def places(self) -> dict[str, np.ndarray]:
        """Return the coordinates (n,) [m] by axis."""
        return {"x": self.x, "y": self.y} | ({"z": self.z} if len(self.z) else {})

    def kinds(self) -> np.ndarray:
        """(n,) row of MODES."""
        return np.searchsorted(LIMITS, self.mode, side="right")

    def released(self) -> np.ndarray:
        """(n,) what the kinetic energy grew by from peak to breaking [J/m]; NaN where the peak is not known."""
        return self.kinetic - self.peak_kinetic


def read_events(path: Path) -> Events:
    """The table that a run writes. Raises HpcdemError if it is none, or damaged."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            lines = list(csv.reader(file))
    except OSError as failure:
        raise HpcdemError(explain(path, failure, "read")) from None
    head = lines[0] if lines else []
    columns = COLUMNS[3 if "z [m]" in head else 2]
    missing = [name for name in columns if name not in head]
    if missing:
        raise HpcdemError(f"{path} is not a table of broken joints: column '{missing[0]}' is missing")
    place = [head.index(name) for name in columns]
    table = np.empty((len(lines) - 1, len(place)))
    for k, row in enumerate(lines[1:]):
        try:
            if len(row) != len(head):
                raise ValueError
            table[k] = [float(row[p]) for p in place]
        except ValueError:
            raise HpcdemError(f"{path}:{k + 2}: expected {len(head)} numbers, not '{','.join(row)}'") from None
    found = {"z": np.zeros(0)} | dict(zip(columns.values(), table.T.copy()))
    for name in ("step", "joint"):
        found[name] = found[name].astype(np.int64)
    return Events(**found)


def magnitudes(energy: np.ndarray) -> np.ndarray:
    """(n,) magnitude of events of these energies [J]; NaN for those without energy."""
    energy = np.asarray(energy, float)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(energy > 0.0, 2.0 / 3.0 * (np.log10(energy) - 4.8), np.nan)


@dataclass(frozen=True)
class Fit:
    """log10 N(>= M) = a - b M from the completeness Mc on; error: standard error of b; number: events from Mc on. b is
    NaN where there are fewer than FEWEST, or all are equal."""

    b: float
    error: float
    a: float
    completeness: float
    number: int


def fit(magnitude: np.ndarray, completeness: float | None = None) -> Fit:
    """The b-value of these magnitudes (n,), NaN left out."""
    m = np.sort(magnitude[np.isfinite(magnitude)])
    if not len(m):
        return Fit(math.nan, math.nan, math.nan, math.nan, 0)
    if completeness is None:
        edges, counts, _ = frequencies(m)
        completeness = float(edges[np.argmax(counts)])
    m = m[m >= completeness]
    above = float(m.mean()) - completeness if len(m) else 0.0
    if len(m) < FEWEST or not above > 1e-9:
        return Fit(math.nan, math.nan, math.nan, completeness, len(m))
    b = math.log10(math.e) / above
    return Fit(b, b / math.sqrt(len(m)), math.log10(len(m)) + b * completeness, completeness, len(m))


def frequencies(magnitude: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower ends of bins of magnitude (m,), events in each, and events from each on."""
    m = magnitude[np.isfinite(magnitude)]
    if not len(m):
        return np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64)
    bins = np.floor(m / BIN + 1e-9).astype(np.int64)
    first = int(bins.min())
    counts = np.bincount(bins - first)
    edges = np.round(BIN * (first + np.arange(len(counts))), 10)
    return edges, counts, counts[::-1].cumsum()[::-1]


def rates(at: np.ndarray, kinds: np.ndarray, energy: np.ndarray, span: tuple[float, float], bins: int) -> np.ndarray:
    """Rows of equal parts of a span of time (bins, 7): begin, end, events in tension, mixed, in shear, and energies of
    the events in it and up to its end."""
    edges = np.linspace(*span, bins + 1)
    part = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, bins - 1)
    counts = [np.bincount(part[kinds == k], minlength=bins) for k in range(len(MODES))]
    sums = np.bincount(part, np.nan_to_num(energy), minlength=bins)
    return np.column_stack([edges[:-1], edges[1:], *counts, sums, np.cumsum(sums)])


@dataclass(frozen=True)
class Curve:
    """Record of one history: name, value, unit; step, time [s], values (n,)."""

    name: str
    value: str
    unit: str
    step: np.ndarray
    time: np.ndarray
    values: np.ndarray


def read_history(path: Path) -> Curve:
    """A file `history_<name>.csv`. Raises HpcdemError if it is none, or damaged."""
    try:
        with open(path, encoding="utf-8") as file:
            head = file.readline().rstrip("\n").split(",", 2)
            rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except OSError as failure:
        raise HpcdemError(explain(path, failure, "read")) from None
    except ValueError as problem:
        raise HpcdemError(f"{path} is not a history, or is damaged: {problem}") from None
    value, _, unit = head[-1].rpartition(" [")
    if head[:2] != ["step", "time [s]"] or not value or (rows.size and rows.shape[1] != 3):
        raise HpcdemError(f"{path} is not a history: its first line is not 'step,time [s],<value> [<unit>]'")
    step, time, values = rows.reshape(-1, 3).T
    return Curve(path.stem.removeprefix("history_"), value, unit.rstrip("]"), step.astype(np.int64), time, values)


def load_history(folder: Path, name: str | None) -> Curve | None:
    """The history that is drawn beside the events: of this name; None: the first of a force of supports, else of a
    stress of elements. HpcdemError for an unknown name."""
    if name is not None:
        names = sorted(p.stem.removeprefix("history_") for p in folder.glob("history_*.csv"))
        path = folder / f"history_{present_history(name, names)}.csv"
        if not path.is_file():
            known = ", ".join(names) or "none"
            raise HpcdemError(f"{path} not found; histories in {folder}: {known}")
        return read_history(path)
    found = [read_history(path) for path in sorted(folder.glob("history_*.csv"))]
    for begins in ("reaction", "stress"):
        for curve in found:
            if curve.value.startswith(begins) and len(curve.step) > 1:
                return curve
    return None
