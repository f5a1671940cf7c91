"""How fast `hpcdem -s` is: frames of so many particles are made up and gone through on so many ranks."""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from bench import launch
from bench.launch import Layout
from bench.tables import Lines

SPACES = 10.0
"""Length of the section over its height."""


def make_frames(folder: Path, n: int, count: int, suffix: str) -> int:
    """A close packing in random order of ids that is sheared more and more; contacts and bonds of all neighbours."""
    from hpcdem.core.comm import SerialComm
    from hpcdem.io.dat import write_dat
    from hpcdem.io.frame import Frame, Table
    from hpcdem.io.vtkhdf import write_vtkhdf

    rng = np.random.default_rng(1)
    rows = max(3, int(np.sqrt(n / SPACES)))
    columns = n // rows
    n = rows * columns
    site = np.arange(n).reshape(rows, columns)
    neighbours = [(site[:, :-1], site[:, 1:]), (site[:-1], site[1:])]
    for odd in (0, 1):
        low, high = site[odd:-1:2], site[odd + 1 :: 2]
        neighbours.append((low[:, 1:], high[:, :-1]) if odd == 0 else (low[:, :-1], high[:, 1:]))
    gid = rng.permutation(n)
    ends = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in neighbours])
    ends = np.sort(gid[ends], axis=1)
    ends = ends[np.lexsort((ends[:, 1], ends[:, 0]))]
    radius = 20000.0 / columns
    x0, y0 = np.empty(n), np.empty(n)
    x0[gid] = (2.0 * radius * (np.arange(columns) + 0.5 * (np.arange(rows)[:, None] % 2))).ravel()
    y0[gid] = np.repeat(np.sqrt(3.0) * radius * np.arange(rows), columns)
    walls: dict[str, np.ndarray] = {name: np.zeros(1) for name in ("kn", "ks", "fric")}
    walls |= {
        "id": np.array([0]),
        "color": np.array([5], np.int32),
        "p1": np.zeros((1, 2)),
        "p2": np.array([[4e4, 0.0]]),
    }
    walls |= {"v": np.zeros((1, 2)), "force": np.zeros((1, 2))}
    settings: dict[str, float | str] = dict.fromkeys(
        ("left", "right", "bottom", "height", "gx", "gy", "frac", "lsm"), 0.0
    )
    for k in range(count):
        x = x0 + 0.02 * k * y0 * np.sin(x0 / 5000.0) + rng.normal(0.0, 0.02 * radius, n)
        y = y0 + rng.normal(0.0, 0.02 * radius, n)
        particles: dict[str, np.ndarray] = {
            name: rng.normal(size=n) for name in "vx vy spin angle fx fy torque mass inertia density".split()
        }
        particles |= {name: rng.normal(size=n) for name in "fric shear poiss kn ks damp".split()}
        particles |= {"gid": np.arange(n), "x": x, "y": y, "radius": np.full(n, radius)}
        particles |= {"hertz": np.ones(n, np.int8), "fix": np.zeros(n, np.uint8), "group": np.zeros(n, np.int32)}
        particles |= {"color": (y0 // 500.0).astype(np.int32) % 10, "birth": np.zeros(n, np.int64)}
        a, b = ends.T
        dx, dy, fn = x[b] - x[a], y[b] - y[a], 1e9 * (y0.max() + radius - y0[a])
        d = np.hypot(dx, dy)
        contacts = {"id1": a, "id2": b, "fn": fn, "fs": 0.0 * fn, "fx": -fn * dx / d, "fy": -fn * dy / d}
        contacts |= {"x": x[a] + 0.5 * dx, "y": y[a] + 0.5 * dy, "overlap": 2.0 * radius - d}
        strengths = {name: np.ones(len(a)) for name in ("ebmod", "gbmod", "tstrength", "sstrength")}
        bonds = contacts | {"kind": np.ones(len(a), np.int8)} | strengths
        none = {name: values[:0] for name, values in contacts.items() if name != "id2"} | {
            "wall": np.zeros(0, np.int32)
        }
        whole = {"particles": particles, "contacts": contacts, "bonds": bonds, "wall_contacts": none}
        tables = {name: Table(t, 0, len(next(iter(t.values())))) for name, t in whole.items()}
        frame = Frame(1000 * k, 50.0 * k, 0.05, settings | {"disk": "off"}, walls, tables, ["***"])
        write = write_vtkhdf if suffix == "vtkhdf" else write_dat
        write(folder / f"all_{frame.step:010d}.{suffix}", frame, SerialComm())
    return n


def work(job: dict[str, Any]) -> dict[str, Any]:
    """On the ranks: go through the frames."""
    from hpcdem import session
    from hpcdem.cli.strain_stress import load_kernels
    from hpcdem.runtime.progress import Log

    comm = session.current().comm
    load_kernels(comm)
    from hpcdem.post.strain_stress import Options, run

    began, used = time.monotonic(), time.process_time()
    run(comm, Log(1), Options(Path(job["frames"])))
    seconds = time.monotonic() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    ranks = comm.allgather((time.process_time() - used, peak))
    return {"wall_s": seconds, "processor_s": sum(r[0] for r in ranks), "peak_gib": max(r[1] for r in ranks)}


def strain_stress(particles: list[int], ranks: list[int], frames: int, suffix: str, lines: Lines) -> None:
    """Frames per second by the clock, processor seconds per frame over all ranks, largest memory of a rank. The frames
    lie in a temporary folder (about 1.2 GB each for a million particles)."""
    from rich.table import Table

    from bench.tables import console

    table = Table(title=f"hpcdem -s, frames as .{suffix}", title_justify="left")
    for name in ("particles", "ranks", "frames/s", "processor s per frame", "memory of a rank"):
        table.add_column(name)
    for count in particles:
        with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as folder:
            n = make_frames(Path(folder), count, frames, suffix)
            for r in ranks:
                found = launch.ours("strain-stress", Layout(r, 1), frames=folder)
                found.pop("output")
                head = {"code": "hpcdem", "workload": "strain-stress", "particles": n, "ranks": r, "threads": 1}
                row = lines.add(head | {"frames": frames, "format": suffix} | found)
                speed, each = frames / row["wall_s"], row["processor_s"] / frames
                table.add_row(str(n), str(r), f"{speed:.3g}", f"{each:.3g}", f"{row['peak_gib']:.2f} GiB")
    console().print(table)
