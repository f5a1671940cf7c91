"""What runs on the ranks: `mpiexec -n R python -m soak.worker job.json`. Rank 0 prints the lines.

The run is one CYC per line; in between, a function called at every period turns wall and tilt, lets it rain and takes
the oldest away. Checkpoints are written with every line, and every tenth one is brought in.
"""

from __future__ import annotations

import gc
import json
import math
import os
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hpcdem
from hpcdem import session
from hpcdem.engine import model as engine
from hpcdem.physics.dem import diagnostics
from soak import model

PERIOD, WINDOW = 2500, 200
"""Steps between turns, and steps of a line over which momentum is added up."""
RESTORE = 10
"""Lines from one restart to the next."""
KEPT = 4
"""Newest files that stay."""


@dataclass
class Tally:
    """What happened so far on all ranks."""

    generated: int = 0
    deleted: int = 0
    bonds_made: int = 0
    broken_by_command: int = 0
    wall_turns: int = 0
    restored: int = 0
    border_moves: int = 0
    migrations: int = 0


def main() -> None:
    """The whole run."""
    job = json.loads(Path(sys.argv[1]).read_text())
    shared = session.current()
    shared.figure = shared.ends_with_frame = False
    Soak(hpcdem.Simulation(Path(job["folder"]) / "data", log=False), job).run()


class Soak:
    """A model under way, and the books that are kept of it."""

    def __init__(self, sim: hpcdem.Simulation, job: dict[str, Any]) -> None:
        self.sim, self.job, self.tally = sim, job, Tally()
        self.checkpoint = Path(job["folder"]) / "soak.sav"
        self.period = min(PERIOD, job["every"] // 2)
        self.momentum = Momentum(sim)
        self.particles = self.turns = 0
        self.own_work = 0.0
        self.kinetic: list[float] = []
        self.leaked: list[np.ndarray] = []
        self._count_migrations()

    def run(self) -> None:
        """Lines until all steps are done."""
        sim, every, steps = self.sim, self.job["every"], self.job["steps"]
        model.build(sim)
        sim.set(stepbar=every)
        self.particles = sim.count
        sim.every(self.period, lambda _: self.turn())
        sim.every(max(every // 10, 1), lambda _: self.kinetic.append(sim.kinetic_energy()))
        self.watch_borders()
        window = min(WINDOW, self.period // 2)
        lines, began = -(-steps // every), time.perf_counter()
        for line in range(1, lines + 1):
            start = time.perf_counter()
            self.momentum.begin(sim.steps + self.period + self.period // 4, window)
            now = min(every, steps - sim.steps)
            sim.cycle(now)
            seconds = time.perf_counter() - start
            sim.save(self.checkpoint)
            if line % RESTORE == 0 or line == (lines + 1) // 2:
                self.restore()
            self.forget_old_files()
            row = self.look(seconds, now)
            if sim.rank == 0:
                print(json.dumps({"step": sim.steps, "seconds": time.perf_counter() - began} | row), flush=True)

    # ---- what happens ------------------------------------------------------------------------------------------------

    def turn(self) -> None:
        """The end of a period."""
        sim, tally, k = self.sim, self.tally, self.turns
        self.turns += 1
        tally.wall_turns += 1
        model.turn(sim, k)
        if k % 4 == 1:
            model.right(sim)
        made, bonds = model.rain(sim, k)
        tally.generated += made
        tally.bonds_made += bonds
        tally.deleted += self.take_the_oldest()
        if k % 5 == 4:
            tally.broken_by_command += sim.break_bonds(f"x 0 {model.WIDTH / 2}")
        self.pretend_to_be_slow(k)

    def take_the_oldest(self) -> int:
        """Delete particles of the lowest ids until there are as many as in the beginning."""
        ids = np.sort(self.sim.gather("gid"))
        excess = len(ids) - self.particles
        return self.sim.delete(f"id {ids[0]} {ids[excess - 1]}") if excess > 0 else 0

    def pretend_to_be_slow(self, k: int) -> None:
        """Half as much again on the stopwatches of one rank, in turn: borders follow them, and nobody has to wait."""
        timers = self.sim.engine.timers
        if k % self.sim.ranks == self.sim.rank:
            timers("ballast").ns += int(5e8 * (timers.seconds() - self.own_work))
        self.own_work = timers.seconds()

    def restore(self) -> None:
        """Go on from the checkpoint, as after an interruption."""
        self.sim.restore(self.checkpoint)
        self.tally.restored += 1
        self.watch_borders()

    def forget_old_files(self) -> None:
        """Rank 0: frames that nobody will look at."""
        if self.sim.rank == 0:
            for suffix in ("vtkhdf", "dat"):
                for path in sorted(self.sim.outdir.glob(f"all_*.{suffix}"))[:-KEPT]:
                    path.unlink()

    # ---- what is seen ------------------------------------------------------------------------------------------------

    def watch_borders(self) -> None:
        """Count their moves. A restored model has new ones."""
        ownership, tally = self.sim.engine.ownership, self.tally
        renew = ownership.renew

        def counted(*values: Any, **options: Any) -> None:
            before = ownership.borders[1:-1].copy()
            renew(*values, **options)
            after = ownership.borders[1:-1]
            tally.border_moves += bool(len(before) and len(before) == len(after) and (before != after).any())

        ownership.renew = counted

    def _count_migrations(self) -> None:
        tally, usual = self.tally, engine.Migration

        class Counted(usual):  # type: ignore[valid-type, misc]
            def __init__(self, comm: Any, n: int, leave: np.ndarray, owner: np.ndarray) -> None:
                super().__init__(comm, n, leave, owner)
                tally.migrations += len(leave)

        engine.Migration = Counted  # type: ignore[misc]

    def look(self, seconds: float, steps: int) -> dict[str, Any]:
        """A line; collective."""
        sim, engine = self.sim, self.sim.engine
        if self.job["leak"] and sim.rank == 0:
            self.leaked.append(np.ones(int(self.job["leak"] * 131072)))
        gc.collect()
        mine = resident(), len(gc.get_objects()), len(os.listdir("/proc/self/fd")), self.tally.migrations
        memory, objects, files, moved = (list(values) for values in zip(*engine.comm.allgather(mine)))
        n = sim.count
        kinetic, self.kinetic[:] = list(self.kinetic), []
        counts = asdict(self.tally) | {"migrations": sum(moved), "rebuilds": engine.rebuilds}
        return {
            "rss_mb": memory, "objects": objects, "files": files, "particles": n, "bonds": engine.bonds_left(),
            "broken": sum(engine.broken()), "momentum_residual": self.momentum.residual(),
            "kinetic": float(np.mean(kinetic or [sim.kinetic_energy()])),
            "kinetic_limit": model.tallest(sim), "particle_steps_per_s": n * steps / seconds,
        } | counts  # fmt: skip


class Momentum:
    """The balance of momentum over some steps between two turns.

    The velocities of step n + 1 are those of step n and the kick dt F / m (docs/physics.md), so the momentum P =
    sum m v changes by dt sum F, and contact forces and bonds cancel in the sum, across ranks too:

        P(n + 1) - P(n) = dt [F_walls + M g - eta sum v - D],   D: local damping, alpha |F_k| sgn(v_k) of each particle

    F_walls is what the walls are said to feel, with the other sign. residual: what is missing, over M |g| T.
    """

    def __init__(self, sim: hpcdem.Simulation) -> None:
        self.sim = sim
        self._call: Any = None
        self._first = self._last = 0

    def begin(self, first: int, steps: int) -> None:
        """Add up from step `first` on; nothing may act on the model meanwhile."""
        self._first, self._last = first, first + steps
        self._start: tuple[np.ndarray, int] | None = None
        self._end: tuple[np.ndarray, int] | None = None
        self._impulse: list[np.ndarray] = []
        self._call = self.sim.every(first, lambda _: self._open())  # the next multiple comes after the end of the line

    def _open(self) -> None:
        self._call.cancel()
        self._start, self._impulse = self._present(), [self._kick()]
        self._call = self.sim.every(1, lambda _: self._step())

    def _step(self) -> None:
        if self.sim.steps < self._last:
            self._impulse.append(self._kick())
            return
        self._end = self._present()
        self._call.cancel()

    def _present(self) -> tuple[np.ndarray, int]:
        """Momentum and number of the particles of this rank."""
        return (self.sim["mass"] * self._velocity()).sum(axis=1), len(self.sim)

    def _velocity(self) -> np.ndarray:
        return np.stack([self.sim["vx"], self.sim["vy"]])

    def _kick(self) -> np.ndarray:
        """What will be added in the next step, of this rank's particles, from outside [N s]."""
        engine = self.sim.engine
        s, v, mass = engine.settings, self._velocity(), self.sim["mass"]
        pull = mass * np.array([[s.gx], [s.gy]]) - s.lsm * v
        force = engine.lists.owned_forces()[:, :2].T + pull
        damping = self.sim["damp"] * np.abs(force) * np.where(v < 0.0, -1.0, 1.0)
        on_particles, _ = diagnostics.wall_rows(engine)
        walls = on_particles[:, [diagnostics.FORCE_X, diagnostics.FORCE_Y]].sum(axis=0)
        return engine.clock.dt * (walls + (pull - damping).sum(axis=1))

    def residual(self) -> float | None:
        """Collective: part of the impulse that is missing; None if the number of particles changed meanwhile."""
        if self._call is not None:
            self._call.cancel()
        comm, engine = self.sim.engine.comm, self.sim.engine
        mine = None
        if self._start is not None and self._end is not None:
            change = self._end[0] - self._start[0] - np.sum(self._impulse, axis=0)
            mine = change, self._start[1], self._end[1], float(self.sim["mass"].sum())
        all_ranks = comm.allgather(mine)
        if any(part is None for part in all_ranks):
            return None
        change = sum(part[0] for part in all_ranks)
        if sum(part[1] for part in all_ranks) != sum(part[2] for part in all_ranks):
            return None
        gravity = math.hypot(engine.settings.gx, engine.settings.gy)
        scale = sum(part[3] for part in all_ranks) * gravity * engine.clock.dt * (self._last - self._first)
        return float(np.hypot(*change) / scale)


def resident() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


if __name__ == "__main__":
    main()
