"""From lines to the parts of the model, and the checks of the model on lines that it was not made from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

import numpy as np

from bench.launch import Failed
from bench.scaling.model import ROW, Model, Parts, strips

Row = dict[str, Any]
LARGE = 5000
"""Particles of a rank from which on a step is long enough to show what a busy neighbour costs."""


def best(rows: list[Row]) -> list[Row]:
    """Of repeats of the same, the one that was disturbed least."""
    found: dict[tuple, Row] = {}
    for row in rows:
        key = tuple(row.get(k) for k in ("kind", "name", "ranks", "rows", "messages", "of"))
        measure = "step_s" if row["kind"] == "bed" else "s"
        if key not in found or row[measure] < found[key][measure]:
            found[key] = row
    return list(found.values())


def model_of(row: Row, width: float) -> Model:
    """The bed of a line."""
    return Model(row["particles"], row["columns"], max(1, round(row["particles"] / row["columns"] / width**2)))


def fitted(rows: list[Row]) -> Parts:
    """The parts, from the lines that are meant for it. Failed names what is missing."""
    rows = best(rows)
    beds = [r for r in rows if r["kind"] == "bed"]
    made_from = [r for r in beds if r["fit"]]
    flat = sorted((r for r in made_from if r["ranks"] == 1 and not r["tall"]), key=lambda r: r["particles"])
    tall = sorted((r for r in made_from if r["ranks"] == 1 and r["tall"]), key=lambda r: r["particles"])
    pairs = [(r, s) for r in made_from for s in flat if r["ranks"] == 2 and r["name"] == s["name"]]
    pushed = [r for r in beds if r["pushed"]]
    alone = {kind: [r for r in rows if r["kind"] == kind] for kind in ("exchange", "reduce", "migrate", "pack")}
    framed = [r for r in beds if r["ranks"] == 1 and "frame_s" in r]
    for what, there in (
        ("three beds on one rank", len(flat) > 2), ("a tall bed", tall), ("a bed on two ranks", pairs),
        ("a pushed bed", pushed), ("the parts alone", all(alone.values())), ("a frame", framed),
    ):  # fmt: skip
        if not there:
            raise Failed(f"scaling: the lines lack {what}; run scripts/bench scaling --measure")
    bare = [r["step_s"] - r["looks"] * r["look_s"] - r["rebuilds"] * r["rebuild_s"] for r in flat]
    n = [r["particles"] for r in flat]
    slope = (bare[1] - bare[0]) / (n[1] - n[0])
    fixed = max(0.0, bare[0] - slope * n[0])
    particle = [(seconds - fixed) / many for seconds, many in zip(bare, n, strict=True)]
    last, large = flat[-1], [r for r in flat if r["particles"] >= LARGE] or flat[-1:]
    heights, factors = [last["particles"] / last["columns"]], [1.0]
    curve = dict(zip(n, particle, strict=True))
    for row in tall:
        own = (row["step_s"] - row["looks"] * row["look_s"] - fixed) / row["particles"]
        near = min(curve, key=lambda k: abs(np.log(k / row["particles"])))
        heights.append(row["particles"] / row["columns"])
        factors.append(own / curve[near])
    slots = fmean(sum(r["slots"]) / r["particles"] for r in large)
    borders = [((sum(r["slots"]) - sum(s["slots"])) / sum(r["left"])) for r, s in pairs if sum(r["left"])]
    middle, longest = flat[len(flat) // 2], max(pushed, key=lambda r: r["steps"])
    parts = Parts(
        fixed=fixed, sizes=tuple(n[1:]), particle=tuple(particle[1:]), heights=tuple(heights), tall=tuple(factors),
        force=fmean(r["force_s"] / (r["force_s"] + r["move_s"]) for r in large), slots=slots,
        ghost_slots=max(0.0, fmean(borders)), look=_line(flat, "look_s"), rebuild=_line(flat, "rebuild_s"),
        exchange=exchange_line(alone["exchange"]), reduce=min(r["s"] for r in alone["reduce"]),
        waits=fmean(r["waits"]["rebuild"] for r in beds if r["ranks"] > 1), per_rank=_per_rank(alone["migrate"]),
        pack=min(r["s"] / r["rows"] for r in alone["pack"]), company=1.0,
        frame=min(r["frame_s"] / r["particles"] for r in framed), frame_b=framed[0]["frame_b"] / framed[0]["particles"],
        arrays_b=fmean(r["arrays_b"] for r in large), width=_width(flat), looks=middle["looks"],
        looks_pushed=longest["looks"], rebuilds_pushed=longest["rebuilds_all"],
    )  # fmt: skip
    return with_company(parts, [r for r, _ in pairs])


def with_company(parts: Parts, rows: list[Row]) -> Parts:
    """The factor that explains beds on two ranks best; at least 1."""
    ratios = []
    for row in rows:
        if row["particles"] < 2 * LARGE:
            continue
        step = predicted(parts, row)
        own = step.own + step.imbalance + step.ghosts
        ratios.append(1.0 + (row["step_s"] - step.seconds) / own)
    return replace(parts, company=max(1.0, float(np.exp(np.mean(np.log(ratios)))))) if ratios else parts


def _line(rows: list[Row], name: str) -> tuple[float, float]:
    """(fixed, per particle) of a time that grows with the particles; relative errors count."""
    n, s = (np.array([float(r[k]) for r in rows]) for k in ("particles", name))
    a, b = _least(np.column_stack([np.ones_like(n), n]), s)
    return a, b


def _least(table: np.ndarray, seconds: np.ndarray) -> list[float]:
    """Coefficients >= 0 with the smallest relative errors."""
    from scipy.optimize import nnls

    scale = np.abs(table / seconds[:, None]).max(axis=0)
    found, _ = nnls(table / seconds[:, None] / scale, np.ones(len(seconds)))
    return [float(v) for v in found / scale]


def exchange_line(rows: list[Row]) -> tuple[float, float, float]:
    """(start, per message, per byte) of the exchange with one neighbour."""
    table = np.array([[1.0, r["messages"], ROW * r["rows"]] for r in rows])
    start, message, byte = _least(table, np.array([r["s"] for r in rows]))
    return start, message, byte


def _per_rank(rows: list[Row]) -> float:
    """Growth of a migration with the ranks of the job [s]."""
    first, last = (pick(rows, key=lambda r: r["of"]) for pick in (min, max))
    return max(0.0, (last["s"] - first["s"]) / (last["of"] - first["of"]))


def _width(rows: list[Row]) -> float:
    """Of a column in mean diameters, from the largest bed. Beds are laid out as bench.workloads says."""
    from bench.workloads import Bed

    row = rows[-1]
    high = Bed(min(row["particles"], 12500)).rows
    return row["particles"] / high / row["columns"]


def predicted(parts: Parts, row: Row) -> Any:
    """The step of a line. How often lists are looked at and rebuilt follows from the motion: taken from the line."""
    return strips(parts, model_of(row, parts.width), row["ranks"], looks=row["looks"], rebuilds=row["rebuilds"])


@dataclass(frozen=True)
class Check:
    """One number that the model was not made from."""

    name: str
    ranks: int
    what: str
    measured: float
    predicted: float

    @property
    def error(self) -> float:
        """Relative."""
        return self.predicted / self.measured - 1.0 if self.measured else 0.0


def checks(parts: Parts, rows: list[Row]) -> list[Check]:
    """Wall time of steps and rebuilds where each rank has a core; counts, and processor time, everywhere."""
    found = []
    for row in best([r for r in rows if r["kind"] == "bed" and not r["fit"]]):
        step, model, p = predicted(parts, row), model_of(row, parts.width), row["ranks"]

        def add(what: str, measured: float, value: float, row: Row = row) -> None:
            found.append(Check(row["name"], row["ranks"], what, measured, value))

        if p <= 2:
            add("step", row["step_s"], step.seconds)
            add("rebuild", row["rebuild_s"], _rebuild(parts, row))
        else:
            # What one rank alone needs for the model and all its ghosts, whoever computes it.
            own = p * (step.own + (step.ghosts * (p - 1) / p + step.rebuild) / parts.company + step.fixed)
            add("processor time", row["cpu_s"], own)
        if p > 1:
            add("ghosts", sum(row["ghosts"]), 2 * (p - 1) * model.height)
            add("slots", sum(row["slots"]), parts.slots * row["particles"] + (p - 1) * model.height * parts.ghost_slots)
            if not row["pushed"]:  # there borders follow measured times
                add("largest share", max(row["owned"]), -(-row["columns"] // p) * model.height)
    return found


def _rebuild(parts: Parts, row: Row) -> float:
    """Seconds of one rebuild of the bed of a line."""
    model = model_of(row, parts.width)
    with_one, without = (strips(parts, model, row["ranks"], looks=0.0, rebuilds=v).seconds for v in (1.0, 0.0))
    return with_one - without
