"""What must not grow or drift, from the lines of a run.

The first quarter is not looked at: there the model settles, and libraries load what they need.
"""

from __future__ import annotations

from typing import Any

import numpy as np

MEMORY, NOISE = 1.0, 3.0
"""Most memory a rank may take on, MB per million steps; and least that is told from noise in a run that is judged over
less than a million, MB: libraries take half a megabyte at a time, and three times in the first 100 000 steps."""
OBJECTS, FILES = 200, 0.5
"""Objects of Python and open files by which a run may grow by chance: one table more, a cache that fills."""
NAMES = {"rss_mb": "megabytes", "objects": "objects", "files": "open files"}
MOMENTUM = 1e-13
"""Largest part of the impulse of gravity that may be missing from the balance: what rounding leaves is 1e-15 of it."""
KINETIC = (1e-3, 1e-2)
"""Mean kinetic energy of a line of at least LONG steps over what the fall can give: found were 0.0024 to 0.0033 in the
first 100 000 steps. In shorter lines turns follow each other quickly, and only the fall itself is a limit."""
LONG = 10_000
DRIFT = 1.5
"""Largest ratio of the mean kinetic energy of the last and the second third: the load repeats itself."""
FULL = 60
"""Lines from which on means of the kinetic energy are compared; a short run never comes to repeat itself."""

Row = dict[str, Any]


def faults(rows: list[Row], steps: int) -> list[str]:
    """What is wrong with a run of so many steps; empty if nothing."""
    if not rows or rows[-1]["step"] < steps:
        return [f"the run came to step {rows[-1]['step'] if rows else 0} of {steps}"]
    late = rows[len(rows) // 4 :]
    return [*growth(late), *balance(rows), *events(rows)]


def slopes(late: list[Row], name: str) -> list[float]:
    """Growth on each rank per million steps: the straight line through all lines (least squares)."""
    at = np.array([row["step"] for row in late]) * 1e-6
    values = np.array([row[name] for row in late], float)
    if len(late) < 2:
        return [0.0] * values.shape[1]
    return np.polyfit(at - at.mean(), values, 1)[0].tolist()


def growth(late: list[Row]) -> list[str]:
    """Memory, objects, open files."""
    found = []
    span = (late[-1]["step"] - late[0]["step"]) * 1e-6
    for name, unit, room in (
        ("rss_mb", "MB", MEMORY * span if span >= 1.0 else NOISE),
        ("objects", "", OBJECTS),
        ("files", "", FILES),
    ):
        for rank, slope in enumerate(slopes(late, name)):
            if slope * span > room:
                what, first, last = NAMES[name], late[0][name][rank], late[-1][name][rank]
                rate = " ".join(filter(None, (f"{slope:.2f}", unit, "per million steps")))
                found.append(f"rank {rank}: {what} grow by {rate}, from {first:.6g} to {last:.6g}")
    return found


def balance(rows: list[Row]) -> list[str]:
    """Momentum and kinetic energy."""
    found = []
    residuals = [row["momentum_residual"] for row in rows if row["momentum_residual"] is not None]
    if len(residuals) < 0.8 * len(rows):
        found.append(f"momentum was measured in {len(residuals)} of {len(rows)} lines only")
    worst = float(np.max(residuals, initial=0.0))
    if not worst <= MOMENTUM:
        found.append(f"{worst:.2g} of the impulse is missing from the balance of momentum, at most {MOMENTUM}")
    energy = np.array([row["kinetic"] / row["kinetic_limit"] for row in rows])
    least, most = KINETIC if rows[0]["step"] >= LONG else (0.0, 1.0)
    if not (np.all(energy > least) and np.all(energy <= most)):
        found.append(
            f"kinetic energy between {energy.min():.3g} and {energy.max():.3g} of what the fall can give, not between "
            f"{least:g} and {most:g}"
        )
    third = len(rows) // 3
    if len(rows) >= FULL:
        ratio = energy[-third:].mean() / energy[third : 2 * third].mean()
        if not 1.0 / DRIFT <= ratio <= DRIFT:
            found.append(f"mean kinetic energy of the last third is {ratio:.2f} times that of the second")
    return found


def events(rows: list[Row]) -> list[str]:
    """Everything that the run is for must have happened."""
    last = rows[-1]
    wanted = ["rebuilds", "generated", "deleted", "bonds_made", "broken", "restored", "wall_turns"]
    if len(last["rss_mb"]) > 1:
        wanted += ["migrations", "border_moves"]
    return [f"there were no {name.replace('_', ' ')}" for name in wanted if not last[name]]


def summary(rows: list[Row]) -> str:
    """The run in a few lines."""
    if not rows:
        return "no lines"
    late, last = rows[len(rows) // 4 :], rows[-1]
    residuals = [row["momentum_residual"] for row in rows if row["momentum_residual"] is not None]
    energy = [row["kinetic"] / row["kinetic_limit"] for row in late]
    growing = ", ".join(f"{slope:+.2f}" for slope in slopes(late, "rss_mb"))
    return (
        f"{last['step']} steps in {last['seconds']:.0f} s, {last['particle_steps_per_s'] / 1e6:.2f} M particle-steps/s "
        f"at the end\n"
        f"memory {[round(mb, 1) for mb in last['rss_mb']]} MB, {growing} MB per million steps; objects "
        f"{last['objects']}; files {last['files']}\n"
        f"momentum missing at most {np.max(residuals, initial=0.0):.1e}; kinetic energy {min(energy):.2g} to "
        f"{max(energy):.2g} of its limit\n"
        f"{last['rebuilds']} rebuilds, {last['migrations']} particles changed ranks, borders moved "
        f"{last['border_moves']} times; {last['generated']} particles came, {last['deleted']} went; "
        f"{last['bonds_made']} bonds made, {last['broken']} broke; {last['restored']} checkpoints brought in"
    )
