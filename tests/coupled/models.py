"""A weak, jointed block is dropped into a bed of discs: models for tests/parallel/test_models.py."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

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
from tests.clumped import write_lattice
from tests.parallel.model import Found, Model, communicator

WEAK = {**JOINT, "gf1": 0.05, "gf2": 0.2, "tensile_strength": 2e4, "cohesion": 6e4, "penalty_normal": 1e9}
WIDTH, RADIUS = 2.4, 0.03
G = 9.81


@dataclass(frozen=True)
class Both(Model):
    """Discs and blocks; make puts them into both simulations. energy: with an account of it."""

    energy: bool = True

    def empty(self, threads: int) -> Coupled:
        return Coupled(*self._parts(threads))

    def begin(self, threads: int) -> Coupled:
        parts = self._parts(threads)
        self.make(parts)
        both = Coupled(*parts)
        both.settle_time_step()
        if self.energy:
            both.particles.energy = Budget()
            both.particles.energy.begin(both.particles)
        return both

    def save(self, sim: Coupled, path: Path) -> None:
        saved_state.save(sim, path, {})

    def resume(self, threads: int, path: Path) -> Coupled:
        both = self.empty(threads)
        saved_state.restore(both, path)
        both.prepare()
        return both

    def step(self, sim: Coupled) -> int:
        return sim.blocks.clock.step

    def advance(self, sim: Coupled, notes: dict[str, Any]) -> None:
        sim.advance(1)
        notes["most"] = max(notes.get("most", 0), int(sim.link.slot_on.sum()))
        notes.setdefault("others", set()).update(sim.link._back.keys() - {sim.particles.comm.rank})

    def release(self, sim: Coupled) -> None:
        for part in (sim, sim.blocks, sim.particles):
            part.release()

    def _parts(self, threads: int) -> tuple[Simulation, Blocks]:
        comm = communicator()
        sim = Simulation(comm, threads, outdir=Path("."), balance_on=self.balance)
        return sim, Blocks(comm, threads, balance_on=self.balance)


def drop(parts: tuple[Simulation, Blocks], clumped: bool = False, yields: bool = False, speed: float = 0.5) -> None:
    """The block falls apart. clumped: it is hit by rigid bodies of discs; yields: it flows besides, as weak soil does;
    speed: to the right [m/s]; a high one takes it through many strips."""
    sim, blocks = parts
    particles.start(sim)
    for name, value in (("disk", "on"), ("gravity", (0.0, -G)), ("dt", 2e-5), ("seed", 3)):
        settings.set_option(sim, name, value)
    walls.box(sim, 0.0, WIDTH, 0.0, 2.0, kn=2e6, ks=1e6, fric=0.3)
    particles.gen_grid(sim, [RADIUS], (0.0, WIDTH), (0.0, 0.54))
    particles.gen(sim, 60, [0.02, 0.03], (0.0, WIDTH), (0.56, 0.7))
    properties.prop(sim, density=2000.0, kn=2e6, ks=1e6, fric=0.4)
    if clumped:
        with TemporaryDirectory() as folder:  # each rank has a copy of its own
            file = Path(folder) / "bodies.clumps"
            write_lattice(file, 0.02, 4, 1)
            clumps.clump(sim, str(file), 0.7, 1.15, group="bodies")
        fallen = parse_text("RES model\nDEL RANGE group bodies", "bodies").statements[1].selection
        properties.prop(sim, fallen, density=2000.0, kn=2e6, ks=1e6, fric=0.4, yv=-12.0)
    cycles.prepare(sim)
    blocks.take_mesh(joined(shaken(rectangle(8, 4, 0.8, 0.4, x0=0.7, y0=0.73, kind="mixed"), 0.15),
                            rectangle(2, 2, 0.2, 0.2, x0=1.9, y0=0.72)))  # fmt: skip
    changes.element_model(
        blocks, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "friction": 25.0, "damp_factor": 0.05}
    )
    if yields:
        soil = {"friction": 25.0, "cohesion": 2e4, "tensile": 1e4, "dilation": 5.0}
        changes.element_model(blocks, None, "mech_mohr_coulomb", {**ROCK, "young": 1e8, "damp_factor": 0.05, **soil})
    blocks.joint_model(None, "classic_intrinsic_cohesive_interface", WEAK)
    changes.set_velocity(blocks, None, vx=speed, vy=-5.0)
    blocks.gravity(0.0, -G)
    if not clumped:  # there is no account of energy for them
        of_blocks.account_energy(blocks)


def result(both: Coupled, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks, and in `about` discs in contact with blocks, late ones, ranks that sent forces
    to others."""
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
    most = int(sim.comm.max_into(np.array([notes["most"]]))[0])
    others = sim.comm.allgather(sorted(notes["others"]))
    late = sim.rebuild_state.late, blocks.rebuild_state.late
    found["about"] = np.array([most, both.late, *late, sum(map(len, others))])
    return found


# ---- what must have happened -----------------------------------------------------------------------------------------


def much_shatters(found: Found) -> None:
    assert found["broken"][2] > 40
    most, late, *_ = found["about"]
    assert most > 10 and late == 0
    assert np.abs(found["contact_fs"]).max() > 1.0
    assert found["energy_lost"] > 10.0 and found["energy_relative"] < 1e-4


def blocks_flow_and_fall_apart(found: Found) -> None:
    flowed = found["plastic_shear_strain"]
    assert (flowed > 1e-3).sum() > 10 and found["about"][0] > 10 and found["broken"][2] > 0
    assert found["blocks_plastic_lost"] > 0.0 and found["energy_relative"] < 1e-3


def clumps_are_braked(found: Found) -> None:
    of_clumps = np.flatnonzero(found["discs"][:, 0] >= found["clump_id"].min())
    assert len(found["clump_id"]) == 4 and len(of_clumps) > 8
    assert np.ptp(found["clump_spin"]) > 1.0 and found["clump_vy"].max() > -8.0  # they were braked, and turned
    assert found["about"][1] == 0


MODELS = {
    "shattering on discs": Both(drop, result, much_shatters, steps=1200, slow=True),
    "flying over discs": Both(partial(drop, speed=6.0), result, much_shatters, balance=False, steps=1200, slow=True),
    "yielding on discs": Both(partial(drop, yields=True), result, blocks_flow_and_fall_apart, steps=1200, slow=True),
    "hit by clumps": Both(partial(drop, clumped=True), result, clumps_are_braked, steps=720, middle=501, energy=False),
}
