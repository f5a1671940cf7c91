#!/usr/bin/env python3
"""How fast `hpcdem -s` is: frames of so many particles are made up and gone through on so many ranks.

    python scripts/bench_strain_stress.py --particles 1e4 1e5 1e6 --ranks 1 2 [--frames 8] [--format vtkhdf|dat]

Prints a row of a table per size and number of ranks: frames per second by the clock, processor seconds per frame over
all ranks, largest memory of a rank. The frames lie in a temporary folder (about 1.2 GB each for a million particles).
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SPACES = 10.0
"""Length of the section over its height."""


def make_frames(folder: Path, n: int, count: int, suffix: str) -> int:
    """A close packing in random order of ids that is sheared more and more; contacts and bonds of all neighbours."""
    from hpcdem.halo.comm import SerialComm
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
    walls = {name: np.zeros(1) for name in ("kn", "ks", "fric")}
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
        particles = {name: rng.normal(size=n) for name in "vx vy spin angle fx fy torque mass inertia density".split()}
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


def work(folder: Path) -> None:
    """One rank."""
    from mpi4py import MPI

    from hpcdem.cli.strain_stress import load_kernels
    from hpcdem.halo.comm import MpiComm
    from hpcdem.runtime.progress import Log

    comm = MpiComm(MPI.COMM_WORLD)
    load_kernels(comm)
    from hpcdem.post.strain_stress import Options, run

    began, used = time.monotonic(), time.process_time()
    run(comm, Log(1), Options(folder))
    seconds = time.monotonic() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    ranks = comm.allgather((time.process_time() - used, peak))
    if comm.rank == 0:
        print(seconds, sum(r[0] for r in ranks), max(r[1] for r in ranks))


def main() -> None:
    """Make the frames, start the ranks, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=float, nargs="+", default=[1e4, 1e5])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--format", choices=("vtkhdf", "dat"), default="vtkhdf")
    parser.add_argument("--mpiexec", default="mpiexec")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        return work(options.worker)
    print("| particles | ranks | frames/s | processor s per frame | memory of a rank |\n|---|---|---|---|---|")
    for particles in options.particles:
        with tempfile.TemporaryDirectory() as folder:
            n = make_frames(Path(folder), int(particles), options.frames, options.format)
            for ranks in options.ranks:
                command = [options.mpiexec, "-n", str(ranks), sys.executable, __file__, "--worker", folder]
                done = subprocess.run(command, capture_output=True, text=True, check=True)
                seconds, used, peak = map(float, done.stdout.split())
                speed, each = options.frames / seconds, used / options.frames
                print(f"| {n} | {ranks} | {speed:.3g} | {each:.3g} | {peak:.2f} GiB |", flush=True)


if __name__ == "__main__":
    main()
