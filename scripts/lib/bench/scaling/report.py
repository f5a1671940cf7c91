"""What comes out: tables and figures, written into docs/scaling.md between its markers."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import median
from typing import Any

from bench.launch import ROOT, Failed
from bench.scaling import fit
from bench.scaling.fit import Check
from bench.scaling.model import (
    ETHERNET,
    FABRIC,
    HERE,
    PARTS,
    Machine,
    Model,
    Parts,
    Step,
    TooMany,
    blocks,
    fastest,
    powers,
    strips,
)

PAGE = ROOT / "docs" / "scaling.md"
FIGURES = ROOT / "docs" / "figures"
BEGIN, END = "<!-- figures: begin -->", "<!-- figures: end -->"
SIZES = (1e5, 1e6, 1e7, 1e8, 1e9)
RANKS = (1, 16, 64, 256, 1024, 4096)
ASPECTS = (5, 20)
MOST = 4096
GAIN = 1.1
"""Blocks pay where they are so much faster than strips."""
Row = dict[str, Any]


def read(path: Path) -> list[Row]:
    """The lines of a measurement."""
    try:
        return [json.loads(line) for line in path.read_text().splitlines()]
    except FileNotFoundError:
        raise Failed(f"scaling: {path} is not there; run scripts/bench scaling --measure first") from None


def report(file: Path, page: Path = PAGE, figures: Path = FIGURES) -> list[Check]:
    """Fit, check, foretell; into the page and its figures. Returns the checks."""
    rows = read(file)
    parts = fit.fitted(rows)
    found = fit.checks(parts, rows)
    text = "\n\n".join([measured_parts(parts, rows), check_table(found), forecast(parts), limits(parts), spent(parts),
                        networks(parts), output_table(parts)])  # fmt: skip
    into(page, text)
    draw(parts, figures)
    return found


def into(page: Path, text: str) -> None:
    """Put a text between the markers of a page."""
    old = page.read_text(encoding="utf-8")
    if old.count(BEGIN) != 1 or old.count(END) != 1 or old.index(BEGIN) > old.index(END):
        raise Failed(f"scaling: {page.name} needs the lines {BEGIN} and {END}, once each")
    head, tail = old.split(BEGIN)[0], old.split(END)[1]
    page.write_text(f"{head}{BEGIN}\n\n{text}\n\n{END}{tail}", encoding="utf-8")


# ---- words and numbers -----------------------------------------------------------------------------------------------


def table(names: list[str], rows: list[list[str]]) -> str:
    """As the other pages write it."""
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join("|" + "|".join(f" {v} " if v != "---" else v for v in line) + "|" for line in lines)


def three(value: float) -> str:
    """Three digits, thousands apart."""
    if value >= 1000.0:
        digits = len(str(int(value))) - 3
        return f"{round(value / 10**digits) * 10**digits:,}".replace(",", " ")
    return f"{value:.3g}"


def count(value: float) -> str:
    """10⁷, or the number itself."""
    power = len(str(int(value))) - 1
    if value == 10**power and power > 3:
        return "10" + str(power).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{value:,.0f}".replace(",", " ")


def took(seconds: float) -> str:
    """With a unit that suits it."""
    if seconds >= 300.0:
        return lasts(seconds)
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{three(seconds / size)} {unit}"
    return f"{three(seconds / 1e-9)} ns"


def lasts(seconds: float) -> str:
    """Of a run."""
    units = (("years", 3.156e7), ("d", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 0.0))
    unit, size = next((unit, size) for unit, size in units if seconds >= size)
    value = seconds / (size or 1.0)
    return f"{value:.0f} {unit}" if value >= 10.0 else f"{value:.2g} {unit}"


def pushed(parts: Parts, model: Model, ranks: int, machine: Machine, cut: Any = strips) -> Step:
    """With the looks and rebuilds of the pushed bed."""
    step: Step = cut(parts, model, ranks, machine, parts.looks_pushed, parts.rebuilds_pushed)
    return step


# ---- tables ----------------------------------------------------------------------------------------------------------


def measured_parts(parts: Parts, rows: list[Row]) -> str:
    """The parameters."""
    start, message, byte = parts.exchange
    own = ", ".join(f"{1e9 * s:.1f} ns at {count(n)}" for n, s in zip(parts.sizes, parts.particle, strict=True))
    tall = ", ".join(
        f"{f:.2f} at {count(round(h, -2))} a column" for h, f in zip(parts.heights[1:], parts.tall[1:], strict=True)
    )
    disturbed = [r for r in rows if r["kind"] == "bed" and r["ranks"] <= 2 and r["median_s"] > 1.2 * r["step_s"]]
    busy = [r["busy"] for r in rows if r["kind"] == "bed" and r["ranks"] == 2]
    lines = [
        ["own particles, per particle and step", own],
        ["slowdown in tall columns (factor)", tall],
        ["slowdown beside a second busy rank (factor)", f"{parts.company:.2f}"],
        ["share of the forces in it", f"{100 * parts.force:.0f} %"],
        ["pairs in the list, per particle and per left ghost", f"{parts.slots:.2f}, {parts.ghost_slots:.2f}"],
        ["fixed, per step", took(parts.fixed)],
        ["exchange with a neighbour", f"{took(start)} + {took(message)} per message + {1e-9 / byte:.1f} GB/s"
         if byte else f"{took(start)} + {took(message)} per message"],
        ["reduction over two ranks", took(parts.reduce)],
        ["look", f"{took(parts.look[0])} + {took(parts.look[1])} per particle; "
         f"every {three(1 / parts.looks)} steps at rest, {three(1 / parts.looks_pushed)} pushed"],
        ["rebuild", f"{took(parts.rebuild[0])} + {took(parts.rebuild[1])} per particle, waits {parts.waits:.1f} times"
         + (f"; every {three(1 / parts.rebuilds_pushed)} steps pushed" if parts.rebuilds_pushed else "; none pushed")],
        ["rebuild, per rank of the job", took(parts.per_rank)],
        ["packing of scattered rows, each", took(parts.pack)],
        ["busiest rank over the mean, two ranks", f"{median(busy):.2f} ({min(busy):.2f}..{max(busy):.2f})"],
        ["a frame, both files", f"{took(parts.frame)} and {parts.frame_b:.0f} B per particle"],
        ["arrays, per particle", f"{parts.arrays_b:.0f} B"],
        ["column, in mean diameters", f"{parts.width:.2f}"],
    ]  # fmt: skip
    cpu = rows[0].get("cpu", "unknown")
    note = f"Measured on {cpu}, Python {rows[0].get('python')}, {str(rows[0].get('mpi')).splitlines()[0].strip()}."
    if disturbed:
        note += (
            f" In {len(disturbed)} of {sum(r['kind'] == 'bed' and r['ranks'] <= 2 for r in rows)} runs the middle "
            "window was more than 20 % slower than the best: the machine was not quiet."
        )
    if parts.sizes[-1] < 5e5:
        note += " A trial without the large beds (`--small`): do not rely on the forecast."
    return f"### Parts\n\n{table(['part', 'measured'], lines)}\n\n{note}"


def check_table(found: list[Check]) -> str:
    """Tables of predicted and measured values, and of errors by kind."""
    lines = []
    for c in found:
        if c.what in ("step", "rebuild", "processor time"):
            lines.append([f"`{c.name}`", str(c.ranks), c.what, took(c.measured), took(c.predicted), f"{_percent(c)}"])
    kinds = []
    for what, ranks in (
        ("step", (1,)), ("step", (2,)), ("rebuild", (1,)), ("rebuild", (2,)), ("processor time", (3, 4)),
        ("ghosts", (2, 3, 4)), ("slots", (2, 3, 4)), ("largest share", (2, 3, 4)),
    ):  # fmt: skip
        errors = [c.error for c in found if c.what == what and c.ranks in ranks]
        if errors:
            where = ", ".join(map(str, sorted({c.ranks for c in found if c.what == what and c.ranks in ranks})))
            worst = max(errors, key=abs)
            middle = median(abs(e) for e in errors)
            kinds.append([what, where, str(len(errors)), f"{100 * middle:.0f} %", f"{100 * worst:+.0f} %"])
    head = "### Checks\n\nRuns that were not used for the fit; predicted over measured, minus one.\n\n"
    head += table(["what", "ranks", "runs", "median error", "largest"], kinds) + "\n\n"
    return head + table(["bed", "ranks", "what", "measured", "predicted", "error"], lines)


def _percent(check: Check) -> str:
    return f"{100 * check.error:+.0f} %"


def forecast(parts: Parts) -> str:
    """Particles x ranks on the fabric."""
    names = ["particles", *(f"{count(p)} rank{'s' if p > 1 else ''}" for p in RANKS)]
    text = "### Forecast\n\nA pushed bed on nodes with a 100 Gb/s fabric: million particle-steps/s, efficiency, time "
    text += "for 10⁶ steps.\n"
    for aspect in ASPECTS:
        lines = []
        for n in SIZES:
            model = Model.bed(n, aspect, parts.width)
            line = [count(n)]
            for ranks in RANKS:
                if ranks > model.columns:
                    line.append(f"refused: {model.columns} columns")
                    continue
                step = pushed(parts, model, ranks, FABRIC)
                line.append(f"{three(step.speed / 1e6)}, {100 * step.efficiency:.0f} %, {lasts(1e6 * step.seconds)}")
            lines.append(line)
        text += f"\n{aspect} times as long as high:\n\n{table(names, lines)}\n"
    text += "\n![Speed of strips over ranks, by size](figures/scaling_strong.jpg)\n"
    text += "\n![Efficiency with the same particles on every rank](figures/scaling_weak.jpg)"
    return text


def limits(parts: Parts) -> str:
    """Where strips stop paying, and blocks begin to."""
    lines = []
    for aspect in ASPECTS:
        for n in SIZES:
            model = Model.bed(n, aspect, parts.width)
            ranks = [p for p in powers(model.columns) if p <= MOST]
            half = [p for p in ranks if pushed(parts, model, p, FABRIC).at_work >= 0.5]
            top = fastest(parts, model, FABRIC, parts.rebuilds_pushed, parts.looks_pushed)
            lines.append([
                f"{aspect} : 1", count(n), count(model.columns), three(model.height), count(max(half, default=1)),
                f"{count(top.ranks)} ({three(top.speed / 1e6)})", crossover(parts, model), best_blocks(parts, model),
            ])  # fmt: skip
    names = [
        "bed", "particles", "columns", "particles a column", f"half of the step at work up to (of {MOST})",
        "fastest (million/s)", "blocks 10 % faster from", f"blocks over strips on {MOST} or all columns",
    ]  # fmt: skip
    text = "### Where strips end\n\nThe same nodes and pushed beds, ranks in powers of two. Columns are the most ranks "
    text += "that are accepted. At work: part of the step in which an even share of the particles is computed, full "
    return text + "nodes or not.\n\n" + table(names, lines)


def crossover(parts: Parts, model: Model) -> str:
    """First number of ranks on which blocks are faster by more than a tenth."""
    for ranks in powers(MOST):
        if ranks > model.columns:
            return f"{count(ranks)} (too many for strips)"
        if pushed(parts, model, ranks, FABRIC, blocks).speed > GAIN * pushed(parts, model, ranks, FABRIC).speed:
            return count(ranks)
    return "not here"


def best_blocks(parts: Parts, model: Model) -> str:
    """Blocks on MOST ranks over the best that strips do on as many or fewer."""
    try:
        block = max(pushed(parts, model, p, FABRIC, blocks).speed for p in powers(MOST))
    except TooMany:
        return "too small"
    strip = max(pushed(parts, model, p, FABRIC).speed for p in powers(min(MOST, model.columns)))
    return f"{block / strip:.2f}"


def spent(parts: Parts) -> str:
    """Where the time of a step goes."""
    lines = []
    for n, ranks in ((1e5, 64), (1e6, 256), (1e7, 1024), (1e8, 4096), (1e9, 4096)):
        model = Model.bed(n, 5, parts.width)
        step = pushed(parts, model, ranks, FABRIC)
        lines.append([count(n), count(ranks), took(step.seconds)])
        lines[-1] += [f"{100 * getattr(step, name) / step.seconds:.0f} %" for name in PARTS]
        whole = strips(parts, model, ranks, FABRIC, parts.looks_pushed, parts.rebuilds_pushed).rebuild
        lines[-1].append(f"{100 * min(1.0, parts.rebuilds_pushed * parts.per_rank * ranks / whole):.0f} %"
                         if whole else "")  # fmt: skip
    names = ["particles", "ranks", "step", *PARTS, "of the rebuild: per rank of the job"]
    return "### Where the time goes\n\nBeds 5 : 1, pushed, the same nodes.\n\n" + table(names, lines)


def networks(parts: Parts) -> str:
    """The same on other networks."""
    lines = []
    for n, ranks in ((1e5, 64), (1e6, 256), (1e7, 256), (1e8, 1024), (1e9, 4096)):
        model = Model.bed(n, 5, parts.width)
        line = [count(n), count(ranks)]
        for machine in (HERE, FABRIC, ETHERNET):
            step = pushed(parts, model, ranks, machine)
            line.append(f"{three(step.speed / 1e6)}, {100 * step.efficiency:.0f} %")
        lines.append(line)
    names = ["particles", "ranks", "every rank as here", FABRIC.name, ETHERNET.name]
    text = "### Networks\n\nBeds 5 : 1, pushed: million particle-steps/s, efficiency. The first column has no network "
    return text + "and no limit of memory; no machine is like that beyond a node.\n\n" + table(names, lines)


def output_table(parts: Parts) -> str:
    """Frames as they are written now, through rank 0, and memory."""
    lines = []
    for n, ranks in ((1e5, 16), (1e6, 64), (1e7, 256), (1e8, 1024), (1e9, 4096)):
        step = pushed(parts, Model.bed(n, 5, parts.width), ranks, FABRIC)
        frame = parts.frame * n
        share = [f"{100 * frame / (frame + every * step.seconds):.0f} %" for every in (1000, 10000)]
        memory = f"{parts.arrays_b * n / ranks / 1e6:.3g} MB"
        lines.append([count(n), count(ranks), took(frame), f"{three(parts.frame_b * n / 1e9)} GB", *share, memory])
    names = [
        "particles", "ranks", "a frame", "its size", "share, every 1000 steps", "every 10 000", "arrays of a rank"
    ]  # fmt: skip
    text = "### Output and memory\n\nFrames as one rank here writes them, as if no rank helped.\n\n"
    return text + table(names, lines)


# ---- figures ---------------------------------------------------------------------------------------------------------


def draw(parts: Parts, folder: Path) -> None:
    """scaling_strong.jpg and scaling_weak.jpg."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(1, len(ASPECTS), figsize=(11, 4.6), sharey=True, layout="constrained")
    for axis, aspect in zip(axes, ASPECTS, strict=True):
        for k, n in enumerate(SIZES):
            model = Model.bed(n, aspect, parts.width)
            for cut, most, style in ((strips, model.columns, "-"), (blocks, MOST, ":")):
                ranks = powers(min(MOST, most)) + ([most] if most < MOST else [])
                axis.loglog(ranks, _speeds(parts, model, ranks, cut), style, color=f"C{k}",
                            label=f"{n:.0e}".replace("e+0", "e") if cut is strips else None)  # fmt: skip
            if model.columns <= MOST:
                end = pushed(parts, model, model.columns, FABRIC).speed / 1e6
                axis.plot(model.columns, end, "x", color=f"C{k}", markersize=9, markeredgewidth=2)
        one = pushed(parts, Model.bed(1e6, aspect, parts.width), 1, FABRIC).speed / 1e6
        axis.loglog([1, MOST], [one, MOST * one], color="0.8", zorder=0)
        axis.set(title=f"{aspect} : 1, pushed", xlabel="ranks", xlim=(1, MOST))
    axes[0].set_ylabel("million particle-steps/s")
    axes[0].legend(title="particles; dotted: blocks\ncross: one column a rank", fontsize=8, title_fontsize=8)
    figure.savefig(folder / "scaling_strong.jpg", dpi=130)
    plt.close(figure)

    figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
    for k, each in enumerate((1e4, 1e5, 1e6)):
        for aspect, style in zip(ASPECTS, ("-", "--"), strict=True):
            points = []
            for p in powers(MOST):
                model = Model.bed(each * p, aspect, parts.width)
                if p <= model.columns:
                    points.append((p, pushed(parts, model, p, FABRIC).efficiency))
            axis.semilogx(*zip(*points, strict=True), style, color=f"C{k}",
                          label=f"{each:.0e} a rank, {aspect} : 1".replace("e+0", "e"))  # fmt: skip
    axis.set(xlabel="ranks", ylabel="efficiency", ylim=(0, 1.02), xlim=(1, MOST))
    axis.legend(fontsize=8)
    figure.savefig(folder / "scaling_weak.jpg", dpi=130)
    plt.close(figure)


def _speeds(parts: Parts, model: Model, ranks: list[int], cut: Any) -> list[float]:
    found = []
    for p in ranks:
        try:
            found.append(pushed(parts, model, p, FABRIC, cut).speed / 1e6)
        except TooMany:
            found.append(float("nan"))
    return found
