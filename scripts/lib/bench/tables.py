"""From lines of results to tables: medians, spreads, ratios. A line is what is written as JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, TextIO

Row = dict[str, Any]
UNDISTURBED = 0.9
"""Share of the processor below which a run is said to have been disturbed."""


@dataclass(frozen=True)
class Spread:
    """Median, smallest and largest of repeated measurements."""

    median: float
    low: float
    high: float
    count: int

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """Of at least one value."""
        found = sorted(values)
        return cls(median(found), found[0], found[-1], len(found))

    def text(self, scale: float = 1.0) -> str:
        """ "12.3 (11.8..12.9)", three digits."""
        m, low, high = (f"{v / scale:.3g}" for v in (self.median, self.low, self.high))
        return m if self.count == 1 else f"{m} ({low}..{high})"


@dataclass(frozen=True)
class Ratio:
    """Our speed over a peer's on the same cores, in one run; pairs: of each repeat with the peer's run beside it."""

    workload: str
    cores: int
    layout: str
    peer: str
    ours: Spread
    theirs: Spread
    pairs: Spread
    our_contacts: float
    their_contacts: float

    @property
    def ratio(self) -> float:
        """Of the medians."""
        return self.ours.median / self.theirs.median


def ratios(rows: list[Row]) -> list[Ratio]:
    """All ratios that the lines hold, in their order.

    A peer's line has code, workload, cores, repeat; ours beside it the same workload and repeat, code hpcdem, and the
    peer's name as `beside`.
    """
    found = []
    cases = dict.fromkeys((r["workload"], r["cores"], r["code"]) for r in rows if r["code"] != "hpcdem")
    for workload, cores, peer in cases:
        theirs = {r["repeat"]: r for r in rows if (r["workload"], r["cores"], r["code"]) == (workload, cores, peer)}
        beside = [
            r
            for r in rows
            if r["code"] == "hpcdem" and r.get("beside") == peer and (r["workload"], r["cores"]) == (workload, cores)
        ]
        for layout in dict.fromkeys(f"{r['ranks']}x{r['threads']}" for r in beside):
            ours = {r["repeat"]: r for r in beside if f"{r['ranks']}x{r['threads']}" == layout}
            both = sorted(ours.keys() & theirs.keys())
            if not both:
                continue
            a, b = ([rows[k]["particle_steps_per_s"] for k in both] for rows in (ours, theirs))
            last = both[-1]
            contacts = (ours[last]["contacts_per_particle"], theirs[last]["contacts_per_particle"])
            pairs = Spread.of(x / y for x, y in zip(a, b, strict=True))
            name = str(theirs[last].get("version", peer))
            found.append(Ratio(workload, cores, layout, name, Spread.of(a), Spread.of(b), pairs, *contacts))
    return found


class Lines:
    """Results as they come: kept, and written to a file as JSON lines if there is one ("-": standard output)."""

    def __init__(self, path: str | None) -> None:
        self.rows: list[Row] = []
        self._file: TextIO | None = None
        self._own = path is not None and path != "-"
        if path == "-":
            import sys

            self._file = sys.stdout
        elif path is not None:
            self._file = Path(path).open("a")

    def add(self, row: Row) -> Row:
        """One more; on the disk at once."""
        self.rows.append(row)
        if self._file is not None:
            self._file.write(json.dumps(row) + "\n")
            self._file.flush()
        return row

    def close(self) -> None:
        """No more lines."""
        if self._file is not None and self._own:
            self._file.close()


def say(text: str) -> None:
    """What is being done, on standard error."""
    print(text, file=sys.stderr, flush=True)


def console() -> Any:
    """Where tables go: standard error, so that --json - stays clean; wide where nobody looks at a terminal."""
    import sys

    from rich.console import Console

    return Console(stderr=True, width=None if sys.stderr.isatty() else 160, highlight=False)


def show_ratios(rows: list[Row]) -> None:
    """The table of ratios."""
    from rich.table import Table

    table = Table(title="million particle-steps/s, median (smallest..largest)", title_justify="left")
    for name in ("workload", "cores", "hpcdem", "peer", "its speed", "our speed", "ratio", "contacts, ours / theirs"):
        table.add_column(name)
    for r in ratios(rows):
        ratio = f"{r.ratio:.2f} ({r.pairs.low:.2f}..{r.pairs.high:.2f})"
        table.add_row(
            r.workload, str(r.cores), r.layout, r.peer, r.theirs.text(1e6), r.ours.text(1e6), ratio,
            f"{r.our_contacts:.2f} / {r.their_contacts:.2f}",
        )  # fmt: skip
    console().print(table)


def show_runs(rows: list[Row]) -> None:
    """Our own runs: speed, and where the time goes."""
    from rich.table import Table

    table = Table(title="hpcdem: million particle-steps/s; stages in per cent of the wall time", title_justify="left")
    names = ("workload", "particles", "ranks x threads", "speed", "of one core", "stages", "rebuilds", "contacts")
    for name in names:
        table.add_column(name)
    ours = [r for r in rows if r["code"] == "hpcdem"]
    keys = dict.fromkeys((r["workload"], r["ranks"], r["threads"]) for r in ours)
    base: dict[str, float] = {}
    for workload, ranks, threads in keys:
        group = [r for r in ours if (r["workload"], r["ranks"], r["threads"]) == (workload, ranks, threads)]
        speed = Spread.of(r["particle_steps_per_s"] for r in group)
        if ranks * threads == 1:
            base[workload] = speed.median
        gain = f"{speed.median / base[workload]:.2f}" if workload in base else ""
        shares = stage_shares(group)
        stages = ", ".join(f"{name} {100.0 * share:.0f}" for name, share in shares.items() if share >= 0.005)
        last = group[-1]
        table.add_row(
            workload, str(last["particles"]), f"{ranks} x {threads}", speed.text(1e6), gain, stages,
            f"{last['rebuilds']} in {last['steps']}", f"{last['contacts_per_particle']:.2f}",
        )  # fmt: skip
    console().print(table)


def stage_shares(rows: list[Row]) -> dict[str, float]:
    """Mean over ranks of each stage over the wall time, median of the repeats, largest first."""
    names = dict.fromkeys(name for r in rows for name in r["stages"])
    shares = {n: median(r["stages"].get(n, {"mean": 0.0})["mean"] / r["wall_s"] for r in rows) for n in names}
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def disturbed(rows: list[Row]) -> str:
    """A warning if runs did not have their cores for themselves, as far as the codes say; empty otherwise."""
    known = [r["cpu_use"] for r in rows if r.get("cpu_use") is not None]
    poor = [use for use in known if use < UNDISTURBED]
    if not poor:
        return ""
    return (
        f"{len(poor)} of {len(known)} runs got less than {100 * UNDISTURBED:.0f} % of their cores (worst "
        f"{100 * min(poor):.0f} %): other programs were running, repeat it when the machine is quiet"
    )
