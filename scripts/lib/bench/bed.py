"""Settled beds, made by our own solver and kept in the cache as a checkpoint and as arrays x, y, r [m] by id."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.workloads import MATERIAL, Bed, cache_folder

if TYPE_CHECKING:
    import hpcdem
    from bench.launch import Layout

FLOOR, LEFT, RIGHT = 0, 1, 2
"""Ids of the walls."""
QUIET = 0.02
"""Largest unbalanced force over the mean contact force at which a bed has settled."""


# ---- asked for by the driver ---------------------------------------------------------------------------------------


def files(bed: Bed) -> tuple[Path, Path]:
    """Checkpoint and arrays of a bed in the cache."""
    return cache_folder() / f"{bed.name}.sav", cache_folder() / f"{bed.name}.npz"


def ready(bed: Bed, layout: Layout) -> tuple[Path, Path]:
    """The files of a bed, made if they are not there: first the bed it comes from."""
    from bench import launch

    sav, npz = files(bed)
    if sav.exists() and npz.exists():
        return sav, npz
    parent = ready(bed.parent, layout) if bed.parent else (Path(), Path())
    sav.parent.mkdir(parents=True, exist_ok=True)
    print(f"making the bed {bed.name} ...", file=sys.stderr, flush=True)
    began = time.perf_counter()
    found = launch.ours(
        "bed", layout, unit=bed.unit, copies=bed.copies, law=bed.law, parent=[str(p) for p in parent],
        files=[str(sav), str(npz)],
    )  # fmt: skip
    print(
        f"  {found['particles']} particles, {found['contacts_per_particle']:.2f} contacts per particle, "
        f"{found['steps']} steps, {time.perf_counter() - began:.0f} s",
        file=sys.stderr,
        flush=True,
    )
    return sav, npz


# ---- on our ranks --------------------------------------------------------------------------------------------------


def make(job: dict[str, Any]) -> dict[str, Any]:
    """Make one bed and write its files; collective."""
    import hpcdem
    from bench.measured import contacts

    bed = Bed(job["unit"], job["copies"], job["law"])
    sim = hpcdem.Simulation(job["folder"])
    if bed.law == "linear":
        sim.restore(job["parent"][0])
        sim.prop(kn=MATERIAL.kn, ks=MATERIAL.ks)
        for wall in (FLOOR, LEFT, RIGHT):
            sim.wall(wall, kn=MATERIAL.kn, ks=MATERIAL.ks)
        settle(sim, 200, 3000, damp=0.7)
    elif bed.law == "bonded":
        sim.restore(job["parent"][0])
        sim.bond(ebmod=2e8, gbmod=2e8, tstrength=1e8, sstrength=2e8)
        settle(sim, 100, 300)
    elif bed.copies > 1:
        lay_copies(sim, bed, job["parent"][1])
        settle(sim, 250, 1500, damp=0.7)
    else:
        loose(sim, bed)
        sim.cycle(2500)
        settle(sim, 500, 20000, damp=0.7)
        sim.prop(fric=MATERIAL.fric)
        for wall in (FLOOR, LEFT, RIGHT):
            sim.wall(wall, fric=MATERIAL.fric)
        settle(sim, 500, 5000)
    x, y, r = sim.gather("x", "y", "radius")
    sav, npz = (Path(p) for p in job["files"])
    part = sav.with_name(f"{sav.stem}.{os.getpid()}.part.sav") if sim.rank == 0 else None
    part = sim.engine.comm.bcast(part)
    sim.save(part)
    found = {"particles": sim.count, "contacts_per_particle": contacts(sim) / sim.count, "steps": sim.steps}
    if sim.rank == 0:
        with open(part.with_suffix(".npz"), "wb") as file:
            np.savez(file, x=x, y=y, r=r)
        part.with_suffix(".npz").replace(npz)
        part.replace(sav)
    return found


def settle(sim: hpcdem.Simulation, chunk: int, most: int, damp: float = MATERIAL.damp) -> None:
    """Step with this local damping until the bed is quiet, at most so many steps; damping is then the material's."""
    sim.prop(damp=damp)
    for _ in range(0, most, chunk):
        sim.engine.last_frame = (sim.steps, True)  # no frame at the beginning of each cycle
        sim.cycle(chunk)
        if sim.unbalanced() < QUIET:
            break
    sim.prop(damp=MATERIAL.damp)


def common(sim: hpcdem.Simulation, bed: Bed, fric: float) -> None:
    """Walls, settings and properties; particles must be there."""
    length, height = bed.length, bed.height
    ends = {
        FLOOR: ((0.0, 0.0), (length, 0.0)),
        LEFT: ((0.0, height), (0.0, 0.0)),
        RIGHT: ((length, 0.0), (length, height)),
    }
    for wall, nodes in ends.items():
        sim.wall(wall, nodes, fric=fric)
    sim.set(disk="off", gravity=(0.0, -MATERIAL.gravity), dt=MATERIAL.dt)
    sim.prop(density=MATERIAL.density, shear=MATERIAL.shear, poiss=MATERIAL.poiss, hertz=True, fric=fric)
    sim.prop(damp=MATERIAL.damp)
    sim.engine.last_frame = (sim.steps, True)


def loose(sim: hpcdem.Simulation, bed: Bed) -> None:
    """The unit before it settles: a grid with room around each particle, radii at random, ids in no order of place."""
    rng = np.random.default_rng(1)
    n = bed.unit
    r = MATERIAL.radius * rng.uniform(1.0 - MATERIAL.spread, 1.0 + MATERIAL.spread, n)
    largest = MATERIAL.radius * (1.0 + MATERIAL.spread)
    columns = int(bed.length / (2.02 * largest))
    cell = bed.length / columns
    k = np.arange(n)
    free = 0.5 * cell - r
    x = (k % columns + 0.5) * cell + free * rng.uniform(-1.0, 1.0, n)
    y = (k // columns + 0.5) * cell + free * rng.uniform(-1.0, 1.0, n)
    _load(sim, np.column_stack([x, y, r])[rng.permutation(n)])
    common(sim, bed, fric=0.0)
    sim.prop(damp=0.7)


def lay_copies(sim: hpcdem.Simulation, bed: Bed, unit: str) -> None:
    """Copies of the settled unit side by side, ids in no order of place. Pairs of two copies may overlap a little."""
    with np.load(unit) as arrays:
        one = np.column_stack([arrays["x"], arrays["y"], arrays["r"]])
    rows = np.tile(one, (bed.copies, 1))
    rows[:, 0] += np.repeat(np.arange(bed.copies) * bed.unit_length, len(one))
    _load(sim, rows[np.random.default_rng(2).permutation(len(rows))])
    common(sim, bed, MATERIAL.fric)


def _load(sim: hpcdem.Simulation, rows: np.ndarray) -> None:
    """LOAD rows x y r, the same on all ranks."""
    path = sim.outdir / "rows.txt"
    if sim.rank == 0:
        with open(path, "w") as file:
            for begin in range(0, len(rows), 100000):
                part = rows[begin : begin + 100000].tolist()
                file.write("".join(f"{x!r} {y!r} {r!r}\n" for x, y, r in part))
    sim.engine.comm.allgather(0)
    sim.load(path)
    if sim.rank == 0:
        path.unlink()
