"""What runs on our ranks: `mpiexec -n R python -m bench.worker job.json`. Rank 0 leaves result.json.

The solver is driven through `hpcdem.Simulation`; only clocks and counters are taken from its inside.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hpcdem
from bench import bed as beds
from bench import block_memory, blocks, coupled, fracture, strain_stress
from bench.measured import contacts, digest, forget_peak, no_first_frame, peak, solver_arrays, versions
from bench.scaling import measure as scaling
from bench.workloads import MATERIAL, Bed
from hpcdem import session


def main() -> None:
    """Carry out the job; every rank calls the task, rank 0 writes what it returns."""
    job = json.loads(Path(sys.argv[1]).read_text())
    shared = session.current(job["threads"])
    # A program that ends writes its last state and draws it: not what is measured here.
    shared.figure = shared.ends_with_frame = False
    found = TASKS[job["task"]](job)
    if shared.comm.rank == 0:
        path = Path(job["folder"]) / "result.json"
        path.with_suffix(".tmp").write_text(json.dumps(found))
        path.with_suffix(".tmp").replace(path)


def restored(job: dict[str, Any], file: str | None = None) -> hpcdem.Simulation:
    """The bed of the job, ready to step."""
    sim = hpcdem.Simulation(job["folder"])
    sim.restore(file or job["file"])
    return sim


def run(job: dict[str, Any]) -> dict[str, Any]:
    """Step a bed: `warm` steps, then `steps` steps by the clock."""
    sim = restored(job)
    if job["pushed"]:
        sim.wall(beds.LEFT, xv=MATERIAL.speed)
    if job["strays"]:
        throw(sim)
    if job["own"]:
        sim.prop(law=f"{Path(__file__).with_name('linear.py')}:linear")
    window = measured(sim, job["warm"], job["steps"])
    return window | {"contacts_per_particle": contacts(sim) / sim.count, "digest": digest(sim)} | versions()


LOOSE, STRAY_SPEED = 20, 120.0
"""Particles that roll on the surface, at 10 to 20 m/s; speed of the one that falls below the floor [m/s]: 2.4 m per
step, a tenth of the skin."""


def throw(sim: hpcdem.Simulation) -> None:
    """A disc that has fallen through the floor, with a speed that stays, and others above the surface."""
    ends, first, radius = sim.extents(), int(sim.engine.next_gid), MATERIAL.radius
    for k in range(LOOSE + 1):
        x = ends["left"] + (k + 0.5) / (LOOSE + 1) * (ends["right"] - ends["left"])
        y = ends["bottom"] - 4.0 * radius if k == 0 else ends["top"] + 2.0 * radius
        sim.ball(x, y, radius, id=first + k)
    stray, loose = f"id {first} {first}", f"id {first + 1} {first + LOOSE}"
    sim.prop(
        f"id {first} {first + LOOSE}", density=MATERIAL.density, shear=MATERIAL.shear, poiss=MATERIAL.poiss,
        fric=MATERIAL.fric, damp=MATERIAL.damp, hertz=True,
    )  # fmt: skip
    sim.prop(loose, xv=15.0)
    sim.fix("x", "y", where=stray)
    sim.prop(stray, yv=-STRAY_SPEED)


def measured(sim: hpcdem.Simulation, warm: int, steps: int) -> dict[str, Any]:
    """One CYC, of which the last `steps` steps are measured; collective, the same on all ranks.

    A CYC of its own for the measurement would begin with checks of the whole model. The clock is therefore read by a
    function called in mid-run, after all ranks have met.
    """
    engine = sim.engine
    marks: list[tuple[float, float, dict[str, int], int]] = []
    first = sim.steps

    def mark() -> None:
        engine.comm.allgather(0)
        stages = {name: watch.ns for name, watch in engine.timers.watches.items()}
        marks.append((time.perf_counter(), time.process_time(), stages, engine.rebuilds))

    def look(_: hpcdem.Simulation) -> None:
        if not marks and sim.steps == first + max(warm, 1):
            mark()

    no_first_frame(sim)
    caller = sim.every(first + max(warm, 1), look)  # called once: the next multiple lies behind the end of the run
    # The last mark cannot be taken by `look`, as it would miss what is due at the last step.
    sim.cycle(max(warm, 1) + steps)
    mark()
    caller.cancel()
    (t0, c0, before, r0), (t1, c1, after, r1) = marks
    own = {name: (ns - before.get(name, 0)) * 1e-9 for name, ns in after.items()}
    ranks = engine.comm.allgather((t1 - t0, c1 - c0, own))
    names = dict.fromkeys(name for *_, stages in ranks for name in stages)
    stages = {}
    for name in names:
        seconds = [s.get(name, 0.0) for *_, s in ranks]
        if max(seconds) > 0.0:
            stages[name] = {"mean": sum(seconds) / len(seconds), "largest": max(seconds)}
    wall = max(w for w, *_ in ranks)
    n = sim.count
    return {
        "particles": n, "steps": steps, "wall_s": wall, "particle_steps_per_s": n * steps / wall, "stages": stages,
        "rebuilds": r1 - r0, "cpu_use": sum(c for _, c, _ in ranks) / (wall * len(ranks) * engine.threads),
    }  # fmt: skip


def memory(job: dict[str, Any]) -> dict[str, Any]:
    """Bring in a bed (or none), step it, and look at the memory of the ranks."""
    shared = session.current()
    sim = hpcdem.Simulation(job["folder"])
    if job["file"]:
        sim.restore(job["file"])
        no_first_frame(sim)
        sim.cycle(1)
    elif job["copies"]:
        beds.lay_copies(sim, Bed(job["unit"], job["copies"]), job["parent"])
        no_first_frame(sim)
        sim.cycle(1)
    loaded = peak()
    forget_peak()
    began = time.perf_counter()
    if job["steps"]:
        no_first_frame(sim)
        sim.cycle(job["steps"])
    seconds = time.perf_counter() - began
    if job["save"]:
        sim.save(job["save"])
    ranks = shared.comm.allgather((loaded, peak(), solver_arrays(sim)))
    each = {name: list(values) for name, values in zip(("loading", "stepping", "arrays"), zip(*ranks), strict=True)}
    return each | {"particles": sim.count, "seconds": seconds}


TASKS: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "run": run, "bed": beds.make, "memory": memory, "strain-stress": strain_stress.work, "scaling": scaling.work,
    "blocks": blocks.work, "block-memory": block_memory.work, "coupled": coupled.work, "fracture": fracture.work,
}  # fmt: skip

if __name__ == "__main__":
    main()
