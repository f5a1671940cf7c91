"""Memory of models of blocks, by ranks: what is a rank's own, and what all ranks of a node share.

Own memory is what no other process has (RssAnon of the kernel), peaks of it are seen by a process beside the ranks, 200
times a second. Shared memory is that of files without a name (halo/shared.py), each counted once per node.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench import launch
from bench.launch import Layout
from bench.tables import Lines, say

LISTED = 1 << 16
"""Bytes from which on an array is listed."""
NAMELESS = re.compile(r"/#\d+ \(deleted\)$")
"""Of lines of /proc/self/maps: files that never had a name."""

WATCH = """\
import os, select, sys
page, pids = os.sysconf("SC_PAGE_SIZE"), [int(pid) for pid in sys.argv[1:]]
most, files = {pid: 0 for pid in pids}, {pid: os.open(f"/proc/{pid}/statm", os.O_RDONLY) for pid in pids}
while True:
    for pid, file in files.items():
        resident, shared = os.pread(file, 99, 0).split()[1:3]
        most[pid] = max(most[pid], (int(resident) - int(shared)) * page)
    if select.select([sys.stdin], [], [], 0.005)[0]:
        if not sys.stdin.readline():
            break
        print(*most.values(), flush=True)
        most = dict.fromkeys(most, 0)
"""


def triangles(project: Any, elements: int, long: int = 1) -> None:
    """Triangles with a joint on each inner edge, in a body so many times as long as high."""
    from hpcdem.commands import fdem

    side = max(1, round((elements / 2 / long) ** 0.5))
    fdem.meshes.grid(project, (0.0, 0.0), (float(long), 1.0), (long * side, side))
    fdem.assignments.element_model(
        project, "mech_iso_elastic", {"density": 2600.0, "young": 1e9, "poisson_ratio": 0.25}
    )
    fdem.assignments.joint_model(
        project, "classic_intrinsic_cohesive_interface",
        {"tensile_strength": 1e6, "cohesion": 3e6, "friction": 30.0, "gf1": 50.0, "gf2": 100.0, "penalty_normal": 1e10,
         "penalty_shear": 1e10},
    )  # fmt: skip
    _held(project, 1)


def tetrahedra(project: Any, elements: int, long: int = 1) -> None:
    """Tetrahedra as one body."""
    from hpcdem.commands import fdem

    side = max(1, round((elements / 6 / long) ** (1 / 3)))
    fdem.meshes.grid(project, (0.0, 0.0, 0.0), (float(long), 1.0, 1.0), (long * side, side, side))
    fdem.assignments.element_model(
        project, "mech_iso_elastic", {"density": 2600.0, "young": 1e9, "poisson_ratio": 0.25}
    )
    _held(project, 2)


def jointed_tetrahedra(project: Any, elements: int, long: int = 1) -> None:
    """Tetrahedra with a joint on each inner face."""
    from hpcdem.commands import fdem

    tetrahedra(project, elements, long)
    fdem.assignments.joint_model(
        project, "classic_intrinsic_cohesive_interface",
        {"tensile_strength": 1e6, "cohesion": 3e6, "friction": 30.0, "gf1": 50.0, "gf2": 100.0, "penalty_normal": 1e10,
         "penalty_shear": 1e10},
    )  # fmt: skip


def _held(project: Any, axis: int) -> None:
    from hpcdem.commands import fdem
    from hpcdem.physics.fdem.groups import Span

    still = {f"v{c}": 0.0 for c in "xyz"[: axis + 1]}
    fdem.assignments.velocity(project, **still, where=(Span(axis, -1.0, 0.0),))
    fdem.settings.gravity(project, (*[0.0] * axis, -9.8))


KINDS: dict[str, Callable[..., None]] = {
    "triangles": triangles, "tetrahedra": tetrahedra, "jointed-tetrahedra": jointed_tetrahedra,
}  # fmt: skip


# ---- on the ranks ------------------------------------------------------------------------------------------------


def work(job: dict[str, Any]) -> dict[str, Any]:
    """Build a model and step it; bytes of each rank. Collective."""
    from hpcdem import session

    shared = session.current(job["threads"])
    comm, project = shared.comm, shared.project(Path(job["folder"]) / "data")
    pids = comm.allgather(os.getpid())
    watch = None
    if comm.rank == 0:
        command = [sys.executable, "-c", WATCH, *map(str, pids)]
        watch = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def peaks() -> list[int]:
        comm.barrier()
        found = None
        if watch is not None and watch.stdin is not None and watch.stdout is not None:
            print(file=watch.stdin, flush=True)
            found = [int(text) for text in watch.stdout.readline().split()]
        return comm.bcast(found)

    _small(project, job["kind"])  # kernels and libraries are there, the memory of an empty model is what is left
    comm.barrier()
    base = comm.allgather(own())
    peaks()
    began = time.perf_counter()
    KINDS[job["kind"]](project, job["elements"])
    said = time.perf_counter()
    project.ready().close_model()
    closed = time.perf_counter()
    building = peaks()
    built = comm.allgather(own())
    for _ in range(job["steps"]):
        project.blocks.step()
    stepped = time.perf_counter()
    project.blocks.rebuild()
    rebuilt = time.perf_counter()
    running = peaks()
    if watch is not None and watch.stdin is not None:
        watch.stdin.close()
        watch.wait()
    after, files = comm.allgather(own()), comm.allgather(files_of())
    blocks = project.blocks
    return {
        "elements": len(project.whole_mesh().cells), "base": base, "built": built, "after": after, "building": building,
        "running": running, "node": sum({inode: size for of in files for inode, size in of.items()}.values()),
        "owned": comm.allgather(blocks.n_own), "pss": comm.allgather(pss()),
        "seconds": [said - began, closed - said, stepped - closed, rebuilt - stepped],
        "arrays": comm.gather([(name, array.nbytes, of_node) for name, array, of_node in listed(project)]),
    }  # fmt: skip


def _small(project: Any, kind: str) -> None:
    dim, ranks = (2, project.comm.size) if kind == "triangles" else (3, project.comm.size)
    project.clear(dim)
    KINDS[kind](project, 8 * 24 * ranks, 4 * ranks)
    project.ready().step()
    project.clear(dim)


def own() -> int:
    """Bytes of this process that no other one has."""
    resident, with_files = (int(text) for text in Path("/proc/self/statm").read_text().split()[1:3])
    return (resident - with_files) * os.sysconf("SC_PAGE_SIZE")


def pss() -> int:
    """Bytes of this process, of pages of several its part [B]."""
    found = re.search(r"^Pss:\s+(\d+)", Path("/proc/self/smaps_rollup").read_text(), re.MULTILINE)
    return 1024 * int(found[1]) if found else 0


def files_of() -> dict[str, int]:
    """Bytes by file of what the ranks of the node share."""
    out: dict[str, int] = {}
    for line in Path("/proc/self/maps").read_text().splitlines():
        if NAMELESS.search(line):
            first, last = (int(text, 16) for text in line.split()[0].split("-"))
            inode = line.split()[4]
            out[inode] = out.get(inode, 0) + last - first
    return out


def listed(project: Any) -> list[tuple[str, Any, bool]]:
    """Large arrays of this rank, with where they are found, and whether they are the node's; the largest first."""
    from bench.measured import arrays

    files = []
    for line in Path("/proc/self/maps").read_text().splitlines():
        if NAMELESS.search(line):
            files.append([int(text, 16) for text in line.split()[0].split("-")])
    out = []
    for name, array in arrays(project, "project"):
        if array.nbytes >= LISTED:
            at = array.ctypes.data
            out.append((name, array, any(first <= at < last for first, last in files)))
    return sorted(out, key=lambda row: -int(row[1].nbytes))


# ---- asked for by the driver ---------------------------------------------------------------------------------------


def measure(kinds: list[str], elements: int, layouts: list[Layout], steps: int, most: int, lines: Lines) -> None:
    """A line per kind and layout: MB of the busiest rank beyond those of an empty model, and of the node."""
    for kind in kinds:
        for layout in layouts:
            found = launch.ours("block-memory", layout, kind=kind, elements=elements, steps=steps)
            found.pop("output")
            listed_ = found.pop("arrays")
            lines.add({"code": "hpcdem", "workload": f"block-memory-{kind}", "ranks": layout.ranks} | found)
            base = found["base"]
            busiest = {
                name: max(bytes_ - floor for bytes_, floor in zip(found[name], base)) / 1e6
                for name in ("building", "built", "running", "after")
            }
            together = {name: (sum(found[name]) - sum(base)) / 1e6 for name in ("building", "after")}
            say(
                f"{kind} {found['elements']} {layout}: busiest rank {busiest['after']:.1f} MB own, built "
                f"{busiest['built']:.1f}, peak while building {busiest['building']:.1f}, while running "
                f"{busiest['running']:.1f}; shared per node {found['node'] / 1e6:.1f} MB; empty {max(base) / 1e6:.0f}; "
                f"all ranks {together['after']:.0f} MB own, peaks while building {together['building']:.0f}; "
                f"s: {' '.join(f'{one:.2f}' for one in found['seconds'])}"
            )
            for name, size, of_node in listed_[0][:most]:
                say(f"    {size / 1e6:9.2f} MB {'node' if of_node else 'rank'}  {name}")
