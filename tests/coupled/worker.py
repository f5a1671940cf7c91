"""Drops a weak, jointed block into a bed of discs, on any number of ranks and threads, and writes what became of both.

python worker.py KIND THREADS STEPS OUT [SAVE_AT SAVE_PATH | resume SAVE_PATH]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hpcdem.commands.dem import clumps, cycles, particles, properties, settings, walls
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.coupling import saved_state
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem import diagnostics as of_blocks
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, ROCK, joined, rectangle, shaken
from tests.blocks.worker import communicator
from tests.clumped import write_lattice

WEAK = {**JOINT, "gf1": 0.05, "gf2": 0.2, "tensile_strength": 2e4, "cohesion": 6e4, "penalty_normal": 1e9}
WIDTH, RADIUS = 2.4, 0.03
G = 9.81


def make(kind: str, threads: int) -> Coupled:
    """Both models. "drop": the block holds; "shatter": it falls apart; "yield": it flows besides, as weak soil does;
    "flight": it also goes through many strips;
    "clumps": it is hit by rigid bodies of discs; there is no account of energy for them."""
    comm = communicator()
    sim = Simulation(comm, threads, outdir=Path("."), balance_on=kind != "flight")
    particles.start(sim)
    for name, value in (("disk", "on"), ("gravity", (0.0, -G)), ("dt", 2e-5), ("seed", 3)):
        settings.set_option(sim, name, value)
    walls.box(sim, 0.0, WIDTH, 0.0, 2.0, kn=2e6, ks=1e6, fric=0.3)
    particles.gen_grid(sim, [RADIUS], (0.0, WIDTH), (0.0, 0.54))
    particles.gen(sim, 60, [0.02, 0.03], (0.0, WIDTH), (0.56, 0.7))
    properties.prop(sim, density=2000.0, kn=2e6, ks=1e6, fric=0.4)
    if kind == "clumps":
        if comm.rank == 0:
            write_lattice(Path(f"bodies{comm.size}.txt"), 0.02, 4, 1)
        comm.allgather(0)
        clumps.clump(sim, f"bodies{comm.size}.txt", 0.7, 1.15, group="bodies")
        fallen = parse_text("RES model\nDEL RANGE group bodies", "bodies").statements[1].selection
        properties.prop(sim, fallen, density=2000.0, kn=2e6, ks=1e6, fric=0.4, yv=-12.0)
    cycles.prepare(sim)
    blocks = Blocks(comm, threads, balance_on=kind != "flight")
    blocks.take_mesh(joined(shaken(rectangle(8, 4, 0.8, 0.4, x0=0.7, y0=0.73, kind="mixed"), 0.15),
                            rectangle(2, 2, 0.2, 0.2, x0=1.9, y0=0.72)))  # fmt: skip
    changes.element_model(
        blocks, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "friction": 25.0, "damp_factor": 0.05}
    )
    if kind == "yield":
        soil = {"friction": 25.0, "cohesion": 2e4, "tensile": 1e4, "dilation": 5.0}
        changes.element_model(blocks, None, "mech_mohr_coulomb", {**ROCK, "young": 1e8, "damp_factor": 0.05, **soil})
    if kind != "drop":
        blocks.joint_model(None, "classic_intrinsic_cohesive_interface", WEAK)
    changes.set_velocity(blocks, None, vx=6.0 if kind == "flight" else 0.5, vy=-5.0)
    blocks.gravity(0.0, -G)
    if kind != "clumps":
        of_blocks.account_energy(blocks)
    return Coupled(sim, blocks)


def empty(kind: str, threads: int) -> Coupled:
    comm = communicator()
    one = Simulation(comm, threads, outdir=Path("."), balance_on=kind != "flight")
    return Coupled(one, Blocks(comm, threads, balance_on=kind != "flight"))


def state(both: Coupled) -> dict[str, np.ndarray]:
    """All that may not depend on ranks, on all of them."""
    sim, blocks = both.particles, both.blocks
    found = {
        name: of_blocks.values(blocks, name)
        for name in ("position_x", "position_y", "velocity_x", "velocity_y", "stress_yy", "plastic_shear_strain")
    }
    found["broken"] = np.array(of_blocks.joint_counts(blocks))
    p = sim.particles
    names = ("gid", "x", "y", "vx", "vy", "spin", "angle")
    rows = np.column_stack([p[name] for name in names] + [sim.lists.owned_forces()])
    rows = np.concatenate(sim.comm.allgather(rows))
    found["discs"] = rows[np.argsort(rows[:, 0])]
    found.update({f"clump_{name}": values for name, values in diagnostics.clumps(sim).items()})
    found.update({f"contact_{name}": values for name, values in both.contacts().items()})
    found.update({f"energy_{name}": np.array(value) for name, value in both.energies().items()})
    if blocks.budget is not None:
        found.update({f"blocks_{name}": np.array(value) for name, value in of_blocks.energies(blocks).items()})
    found["force"] = np.array(both.force_on_blocks())
    return found


def main() -> None:
    kind, threads, steps, out, *more = sys.argv[1:]
    if more[:1] == ["resume"]:
        both = empty(kind, int(threads))
        assert saved_state.restore(both, more[1]) == {"kind": kind}
        both.prepare()
    else:
        both = make(kind, int(threads))
        both.settle_time_step()
        if kind != "clumps":
            both.particles.energy = Budget()
            both.particles.energy.begin(both.particles)
    most, searches, where = 0, set(), set()
    while both.blocks.clock.step < int(steps):
        if len(more) == 2 and more[0] != "resume" and both.blocks.clock.step == int(more[0]):
            saved_state.save(both, more[1], {"kind": kind})
        both.advance(1)
        most = max(most, int(both.link.slot_on.sum()))
        searches.add(id(both.link))
        where.update(both.link._back.keys() - {both.comm.rank})
    found = state(both)
    most = int(both.comm.max_into(np.array([most]))[0])
    others = both.comm.allgather(sorted(where))
    found["about"] = np.array([most, both.late, both.particles.rebuild_state.late, both.blocks.rebuild_state.late,
                               sum(map(len, others))])  # fmt: skip
    if both.comm.rank == 0:
        np.savez(out, **found)
        print(found["about"], found["broken"], {k: float(v) for k, v in found.items() if k.startswith("energy")})
    print(both.comm.rank, both.particles.rebuilds, both.blocks.rebuilds, others,
          {n: round(w.seconds, 2) for n, w in both.particles.timers.watches.items()},
          {n: round(w.seconds, 2) for n, w in both.blocks.timers.watches.items()}, flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
