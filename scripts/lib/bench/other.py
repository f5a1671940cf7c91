"""Whole runs and starts: the push of examples/push.py with and without output, the second start, memory."""

from __future__ import annotations

import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench import bed, launch
from bench.launch import Layout
from bench.tables import Lines, Row, Spread, say
from bench.workloads import Bed

SCRIPT = launch.ROOT / "examples" / "push.py"
FIRST_STEP = """\
import time
import hpcdem

sim = hpcdem.Simulation()
sim.gen_grid([1.0], (0.0, 200.0), (0.0, 4.0))
sim.prop(density=2500.0, kn=1e6, ks=1e6)
sim.set(dt=1e-3, gravity=(0.0, -9.8))
sim.engine.last_frame = (sim.steps, True)  # no frame before the first step
sim.every(1, lambda sim: print("first step", time.time(), flush=True) if sim.rank == 0 else None)
sim.cycle(1)
"""


def hpcdem_command(layout: Layout, *words: str) -> list[str]:
    """`hpcdem` on so many ranks and threads."""
    bind = ["--bind-to", "none"] if layout.threads > 1 and launch.is_open_mpi() else []
    start = [launch.mpiexec(), *bind, "-n", str(layout.ranks)] if layout.ranks > 1 else []
    return [*start, sys.executable, "-m", "hpcdem", "-j", str(layout.threads), *words]


def push_script(text: str, every: int, way: float | None) -> str:
    """examples/push.py with a frame every so many steps of the push (0: only the one at its end); way [m]: a shorter
    push."""
    dt = float(re.search(r"^SET dt (\S+)", text, re.M)[1])  # type: ignore[index]
    found = re.search(r"^IMPLE wall id (\d+) xmove (\S+).*$", text, re.M)
    assert found is not None, "examples/push.py has no IMPLE ... xmove"
    speed = float(re.search(rf"^WALL id {found[1]} .*xv (\S+)", text, re.M)[1])  # type: ignore[index]
    output = f" print {every * dt * speed:.12g}" if every else ""
    return text.replace(found[0], f"IMPLE wall id {found[1]} xmove {way or float(found[2]):g}{output}")


def push(layouts: list[Layout], repeats: int, every: int, way: float | None, lines: Lines) -> None:
    """Wall time of the whole script, without and with output, in turn."""
    from rich.table import Table

    from bench.tables import console

    text = SCRIPT.read_text(encoding="utf-8")
    table = Table(title=f"{SCRIPT.name}, wall time in s, median (smallest..largest)", title_justify="left")
    for name in ("ranks x threads", "no frames", f"a frame every {every} steps", "cost of output", "frames"):
        table.add_column(name)
    for layout in layouts:
        rows: dict[int, list[Row]] = {0: [], every: []}
        for repeat in range(repeats):
            for interval in (0, every):
                rows[interval].append(lines.add(_push_once(layout, push_script(text, interval, way), interval, repeat)))
        bare, full = (Spread.of(r["wall_s"] for r in rows[k]) for k in (0, every))
        cost = f"{100.0 * (full.median / bare.median - 1.0):.1f} %"
        frames = str(rows[every][-1]["frames"])
        table.add_row(f"{layout.ranks} x {layout.threads}", bare.text(), full.text(), cost, frames)
    console().print(table)


def _push_once(layout: Layout, script: str, every: int, repeat: int) -> Row:
    with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as name:
        folder = Path(name)
        (folder / "push.py").write_text(script, encoding="utf-8")
        _, wall = launch.call(hpcdem_command(layout, "--no-figure", "push.py"), folder)
        frames = len(list((folder / "data").glob("all_*.vtkhdf")))
        size = sum(f.stat().st_size for f in (folder / "data").iterdir())
    row = {
        "code": "hpcdem", "workload": "push", "ranks": layout.ranks, "threads": layout.threads, "cores": layout.cores,
        "repeat": repeat, "every": every, "wall_s": wall, "frames": frames, "bytes": size,
    }  # fmt: skip
    say(f"push {layout} #{repeat}, {f'a frame every {every} steps' if every else 'no frames'}: {wall:.1f} s")
    return row


def start(layouts: list[Layout], repeats: int, lines: Lines) -> None:
    """From the command to the end of the first step; the first start, which may compile, does not count."""
    from rich.table import Table

    from bench.tables import console

    table = Table(title="second start: seconds from the command to the first step done", title_justify="left")
    for name in ("ranks x threads", "seconds, median (smallest..largest)"):
        table.add_column(name)
    with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as name:
        program = Path(name) / "first_step.py"
        program.write_text(FIRST_STEP)
        for layout in layouts:
            seconds = []
            for repeat in range(-1, repeats):
                began = time.time()
                output, _ = launch.call(hpcdem_command(layout, "--no-figure", str(program)), Path(name))
                found = re.search(r"first step (\S+)", output)
                if found is None:
                    raise launch.Failed(f"start: no first step\n{output[-1000:]}")
                if repeat >= 0:
                    seconds.append(float(found[1]) - began)
                    head = {"code": "hpcdem", "workload": "start", "ranks": layout.ranks, "threads": layout.threads}
                    lines.add(head | {"cores": layout.cores, "repeat": repeat, "wall_s": seconds[-1]})
            table.add_row(f"{layout.ranks} x {layout.threads}", Spread.of(seconds).text())
    console().print(table)


def memory(
    particles: int, unit: int, layouts: list[Layout], steps: int, keep: bool, lines: Lines, maker: Layout
) -> None:
    """Bytes per particle of a bed laid out of copies of the settled unit."""
    from rich.table import Table

    from bench.tables import console

    copies = max(1, round(particles / unit))
    _, npz = bed.ready(Bed(unit), maker)
    names = (
        "ranks x threads",
        "particles",
        "made from",
        "peak, loading",
        "peak, stepping",
        "arrays",
        f"CYC {steps}, s",
    )
    table = Table(title="bytes per particle, all ranks together, without what an empty run takes", title_justify="left")
    for name in names:
        table.add_column(name)
    with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as name:
        sav = str(Path(name) / "bed.sav")
        for layout in layouts:
            job: dict[str, Any] = {"unit": unit, "copies": copies, "parent": str(npz), "steps": steps}
            empty = launch.ours("memory", layout, file="", save="", **(job | {"copies": 0, "steps": 0}))
            for source, file, save in (("rows", "", sav if keep else ""), ("checkpoint", sav, "")):
                if source == "checkpoint" and not keep:
                    continue
                row = memory_row(launch.ours("memory", layout, file=file, save=save, **job), empty, layout, source)
                lines.add(row | {"steps": steps})
                per = [f"{row[k]:.0f}" for k in ("loading_b", "stepping_b", "arrays_b")]
                each = f"{row['wall_s']:.2g}"
                table.add_row(f"{layout.ranks} x {layout.threads}", str(row["particles"]), source, *per, each)
    console().print(table)


def memory_row(found: dict[str, Any], empty: dict[str, Any], layout: Layout, source: str) -> Row:
    """A line: bytes per particle; sum over ranks of the peak of each, less that of a rank of an empty run."""
    n, ranks = found["particles"], layout.ranks
    floor = max(empty["loading"] + empty["stepping"])
    mine = {name: sum(found[name]) for name in ("loading", "stepping", "arrays")}
    return {
        "code": "hpcdem", "workload": "memory", "ranks": ranks, "threads": layout.threads, "cores": layout.cores,
        "particles": n, "from": source, "loading_b": (mine["loading"] - ranks * floor) / n,
        "stepping_b": (mine["stepping"] - ranks * floor) / n, "arrays_b": mine["arrays"] / n,
        "peak_of_a_rank": max(found["loading"] + found["stepping"]), "empty": floor, "wall_s": found["seconds"],
    }  # fmt: skip
