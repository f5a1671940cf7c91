"""Particles and blocks in one run: steps per second, and where the time goes.

A bed of discs, row upon row, carries a jointed slab as wide as itself that is set down on it: 20 000 discs, 2 800
triangles, some 140 contacts between the two.
"""

from __future__ import annotations

import time
from typing import Any

from bench import launch
from bench.blocks import JOINT, ROCK, digest
from bench.launch import Layout
from bench.tables import Lines, Spread, say
from hpcdem.physics.fdem import changes

RATE = 500.0
"""Steps per second of one rank from which the number of steps follows."""
ACROSS, RADIUS = 141, 0.01
"""Discs in a row, and rows; their radius [m]."""


# ---- asked for by the driver ---------------------------------------------------------------------------------------


def coupled(layouts: list[Layout], repeats: int, seconds: float, lines: Lines) -> None:
    """Every layout, in turn; a table of medians at the end."""
    steps = max(20, round(seconds * RATE))
    for repeat in range(repeats):
        for layout in layouts:
            found = launch.ours("coupled", layout, steps=steps)
            found.pop("output")
            head = {
                "code": "hpcdem", "workload": "coupled-20k", "ranks": layout.ranks, "threads": layout.threads,
                "cores": layout.cores, "repeat": repeat,
            }  # fmt: skip
            row = lines.add(head | found)
            say(f"{layout} #{repeat}: {row['steps_per_s']:.4g} steps/s, {row['contacts']} contacts between them")
    if len({row["digest"] for row in lines.rows}) > 1:
        say("layouts do not agree on where the blocks are")
    for layout in layouts:
        rows = [r for r in lines.rows if (r["ranks"], r["threads"]) == (layout.ranks, layout.threads)]
        shares = {
            part: Spread.of(
                100.0 * sum(v for name, v in r["stages"].items() if name.startswith(part)) / r["wall_s"] for r in rows
            )
            for part in ("particles", "blocks", "between")
        }
        speed = Spread.of(r["steps_per_s"] for r in rows)
        say(f"{layout}: {speed.text(1.0)} steps/s; " + ", ".join(f"{p} {s.text(1.0)} %" for p, s in shares.items()))


# ---- on our ranks --------------------------------------------------------------------------------------------------


def work(job: dict[str, Any]) -> dict[str, Any]:
    """Make the model, step it by the clock; collective. stages: mean seconds of a rank."""
    from bench.measured import versions
    from hpcdem import session
    from hpcdem.core.timers import Timers
    from hpcdem.physics.coupling.warm_up import warm_up
    from hpcdem.runtime.progress import BETWEEN

    shared = session.current()
    shared.prepare("coupled")
    warm_up(job["threads"])
    both = make(shared.comm, job["threads"])
    both.advance(max(5, job["steps"] // 10))
    shared.comm.allgather(0)

    def stages() -> dict[str, float]:
        parts = {"particles": both.particles.timers, "blocks": both.blocks.timers}
        return {name: watch.seconds for name, watch in Timers.joined(parts, BETWEEN).watches.items()}

    before, began = stages(), time.perf_counter()
    both.advance(job["steps"])
    shared.comm.allgather(0)
    wall = time.perf_counter() - began
    own = {name: value - before.get(name, 0.0) for name, value in stages().items()}
    ranks = shared.comm.allgather((wall, own))
    wall = max(seconds for seconds, _ in ranks)
    names = dict.fromkeys(name for _, spent in ranks for name in spent)
    return {
        "discs": both.particles.count(len(both.particles.particles)), "elements": len(both.blocks.the_mesh().cells),
        "steps": job["steps"], "wall_s": wall, "steps_per_s": job["steps"] / wall,
        "contacts": len(both.contacts()["id"]),
        "stages": {name: sum(spent.get(name, 0.0) for _, spent in ranks) / len(ranks) for name in names},
        "digest": digest(both.blocks),
    } | versions()  # fmt: skip


def make(comm: Any, threads: int, across: int = ACROSS) -> Any:
    """Both models, coupled."""
    from hpcdem.commands.dem import cycles, particles, properties, settings, walls
    from hpcdem.physics.coupling.model import Coupled
    from hpcdem.physics.dem.simulation import Simulation
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.pre.mesh import sizes, structured

    width = 2.0 * RADIUS * across
    sim = Simulation(comm, threads)
    particles.start(sim)
    for name, value in (("disk", "on"), ("gravity", (0.0, -9.81)), ("dt", 2e-6)):
        settings.set_option(sim, name, value)
    walls.box(sim, 0.0, width, 0.0, width + 1.0, kn=1e7, ks=5e6, fric=0.3)
    particles.gen_grid(sim, [RADIUS], (0.0, width), (0.0, width))
    properties.prop(sim, density=2500.0, kn=1e7, ks=5e6, fric=0.3)
    cycles.prepare(sim)
    top = width - 1e-5
    blocks = Blocks(comm, threads)
    ends = (0.0, width, across - 1), (top, top + 20.0 * RADIUS, 10)
    blocks.take_mesh(structured.rectangle(*(sizes.spaced(*each) for each in ends), "tri"))
    changes.element_model(blocks, None, "mech_iso_elastic", {**ROCK, "young": 1e9})
    blocks.joint_model(None, "classic_intrinsic_cohesive_interface", {**JOINT, "penalty_normal": 1e10})
    blocks.gravity(0.0, -9.81)
    changes.set_velocity(blocks, None, vy=-0.2)
    both = Coupled(sim, blocks)
    both.settle_time_step()
    return both
