"""The measurements behind the model: beds stepped on 1 to 4 ranks, and the exchange, reduction, migration alone.

A bed gives one line (`kind` "bed") per number of ranks: particles, columns, steps of a window, and
step_s: wall time of a step, of the slowest rank, in the best of several windows; median_s: in the middle one; cpu_s:
processor time of a step, all ranks together, in the best window; force_s, move_s: mean over the ranks in the best
window; busy: largest over mean of their sum; looks, rebuilds_all: per step; rebuilds: per step of the best window;
look_s: time of a look; rebuild_s: of a rebuild, the best; owned, ghosts, left (those of them that come first), slots:
of each rank; waits: MPI calls that wait, per step without a look, per look and per rebuild; arrays_b: bytes of the
arrays per particle; frame_s, frame_b: seconds and bytes of one frame (.vtkhdf and .dat).

Parts measured alone: "exchange" (rows of ghosts, messages, s), "reduce" (s), "migrate" (of, s: one rank's own work in
an exchange of particles between `of` ranks in which nothing moves), "pack" (rows, s: rows taken from all over a table).
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench import launch
from bench.tables import Lines
from bench.workloads import MATERIAL, Bed

if TYPE_CHECKING:
    import hpcdem

Row = dict[str, Any]
WINDOW = 3e6
"""Particle-steps of a window of measurement, about a tenth of a second."""
WINDOWS = 8
STEPS = 3000
"""Most steps of a window: so many of a tiny bed are enough."""
ROWS = (8, 64, 512, 4096, 32768)
"""Ghost rows of the exchange alone."""
MESSAGES = (1, 2, 4, 8)
RANKS = (64, 1024)
"""Ranks of the pretended job in which one rank's share of a migration is timed."""


@dataclass(frozen=True)
class Case:
    """One bed to be stepped. settled: the checkpoint of the bed, else copies laid side by side as they are.

    tall: turned by a right angle, gravity too: the same bed with columns as long as the bed. fit: the model is made
    from it; otherwise it is predicted.
    """

    bed: Bed
    settled: bool = True
    tall: bool = False
    pushed: bool = False
    fit: bool = False

    @property
    def name(self) -> str:
        """As tables call it."""
        n = self.bed.particles
        size = f"{n / 1e6:g}m" if n >= 1e6 else f"{n / 1e3:g}k" if n >= 1e4 else str(n)
        return ("push-" if self.pushed else "tall-" if self.tall else "bed-") + size


def cases(ranks: int, unit: int, small: bool) -> list[Case]:
    """What is run on so many ranks. small: without what takes long."""
    tiny, low, one, four, eight = Bed(150), Bed(600), Bed(unit), Bed(unit, 4), Bed(unit, 8)
    many, most = Bed(unit, 32), Bed(unit, 80)
    if ranks > 2:
        return [Case(one), Case(one, pushed=True)] + ([] if small else [Case(eight)])
    found = [Case(low, fit=True), Case(Bed(2500)), Case(one, fit=True), Case(four, settled=False)]
    found += [Case(eight, fit=True), Case(one, pushed=True)]
    found.append(Case(eight, settled=False, tall=True, fit=ranks == 1))
    if ranks == 1:
        found.insert(0, Case(tiny, fit=True))
    if not small:
        found += [Case(eight, pushed=True), Case(many, settled=False)]
        if ranks == 1:
            found += [Case(most, settled=False, fit=True), Case(most, settled=False, tall=True, fit=True)]
    return found


# ---- asked for by the driver ---------------------------------------------------------------------------------------


def measure(unit: int, most_ranks: int, repeats: int, small: bool, lines: Lines) -> None:
    """Everything on 1, 2, ... ranks; how a launch falls differs, so `repeats` launches on one and two ranks."""
    from bench import bed
    from bench.tables import say

    maker = launch.Layout(min(2, most_ranks), 1)
    for repeat in range(repeats):
        for ranks in range(1, most_ranks + 1):
            if ranks > 2 and repeat:
                continue
            jobs = []
            for case in cases(ranks, unit, small):
                sav, _ = bed.ready(case.bed, maker) if case.settled else (Path(), None)
                _, npz = bed.ready(Bed(case.bed.unit), maker)
                if case.bed.copies > 8 and repeat:
                    continue  # they take longest to lay
                jobs.append(asdict(case) | {"name": case.name, "file": str(sav), "parent": str(npz)})
            began = time.perf_counter()
            found = launch.ours("scaling", launch.Layout(ranks, 1), cases=jobs, repeat=repeat)["lines"]
            for row in found:
                lines.add(row)
            say(f"{ranks} rank(s), launch {repeat}: {len(found)} lines in {time.perf_counter() - began:.0f} s")


# ---- on our ranks --------------------------------------------------------------------------------------------------


def work(job: dict[str, Any]) -> dict[str, Any]:
    """All cases of a job one after the other; on two ranks also the parts alone. Collective."""
    import hpcdem
    from bench.measured import versions
    from hpcdem import session

    comm = session.current().comm
    head = {"ranks": comm.size, "repeat": job["repeat"]}
    lines: list[Row] = []
    for case in job["cases"]:
        sim = hpcdem.Simulation(job["folder"])
        lines.append({"kind": "bed"} | head | stepped(sim, case))
        sim.engine.clear()
        del sim
    if comm.size == 2:
        lines += [row | head for row in alone(comm)]
    return {"lines": [row | versions() for row in lines]}


def stepped(sim: hpcdem.Simulation, case: dict[str, Any]) -> Row:
    """One bed: its line."""
    from bench import bed as beds
    from bench.measured import no_first_frame, solver_arrays
    from hpcdem.physics.dem.reach import NARROW

    bed = Bed(**case["bed"])
    if case["settled"]:
        sim.restore(case["file"])
    elif case["tall"]:
        lay_tall(sim, bed, case["parent"])
    else:
        beds.lay_copies(sim, bed, case["parent"])
    if case["pushed"]:
        sim.wall(beds.LEFT, xv=MATERIAL.speed)
    no_first_frame(sim)
    sim.cycle(1)  # checks, closes the model
    engine, comm, n = sim.engine, sim.engine.comm, sim.count
    steps = int(min(STEPS, max(10, WINDOW / n)))
    few = comm.crowded
    for _ in range(min(300, steps)):
        engine.step()
    if not case["pushed"]:  # young lists would get the wide skin, and laid beds are always young
        engine.rebuild_state.age, engine.rebuild_state.skin_factor = 0, NARROW
        rebuild(engine)
    row = {
        "name": case["name"], "fit": case["fit"], "tall": case["tall"], "pushed": case["pushed"], "particles": n,
        "columns": columns(engine), "steps": steps,
    }  # fmt: skip
    row |= windows(engine, steps, 3 if few else WINDOWS)
    p = engine.particles
    mine = (len(p), p.n_left, len(p.hot) - p.n_left - p.n_own, int(engine.lists.n_pairs), solver_arrays(sim))
    owned, left, right, slots, arrays = zip(*comm.allgather(mine), strict=True)
    row |= {"owned": owned, "ghosts": [a + b for a, b in zip(left, right, strict=True)], "left": left, "slots": slots}
    row |= {"arrays_b": sum(arrays) / n, "waits": waits(engine)}
    engine.rebuild_state.age, engine.rebuild_state.skin_factor = 0, NARROW
    row["rebuild_s"] = best(comm, lambda: rebuild(engine), 1, 2 if few else 4)
    if bed.particles == 8 * bed.unit and case["settled"] and not case["pushed"]:
        row |= frame(sim)
    return row


def columns(engine: Any) -> int:
    """Columns between the outermost particles of the whole model."""
    from hpcdem.core import cells

    p = engine.particles
    cx = cells.columns(cells.keys(p.hot[p.owned], engine.rebuild_state.side))
    ends = engine.comm.max_into(np.array([-cx.min(), cx.max()]))
    return int(ends[0] + ends[1] + 1)


def rebuild(engine: Any) -> None:
    """New lists, and the forces that they begin without."""
    engine.rebuild()
    engine._forces()


def windows(engine: Any, steps: int, count: int) -> Row:
    """Step `count` windows; the figures of the best one."""
    comm, watches = engine.comm, engine.timers.watches
    marks = []
    comm.barrier()
    for _ in range(count + 1):
        stages = {name: watches[name].ns * 1e-9 if name in watches else 0.0 for name in ("move", "force", "reduce")}
        looks = watches["reduce"].calls if "reduce" in watches else 0
        marks.append((time.perf_counter(), time.process_time(), engine.rebuilds, looks, stages))
        if len(marks) <= count:
            for _ in range(steps):
                engine.step()
    ranks = comm.allgather(marks)
    wall = np.diff([[m[0] for m in rank] for rank in ranks]).max(axis=0) / steps
    cpu = np.diff([[m[1] for m in rank] for rank in ranks]).sum(axis=0) / steps
    # A rank that got its core late in a window is found by the wall time; all figures are those of the best window.
    k = int(wall.argmin())
    move, force, reduce = (
        np.array([rank[k + 1][4][name] - rank[k][4][name] for rank in ranks]) / steps
        for name in ("move", "force", "reduce")
    )
    looks = marks[-1][3] - marks[0][3]
    of_looks = min((m[4]["reduce"] - m0[4]["reduce"]) / max(1, m[3] - m0[3]) for m0, m in pairwise(marks))
    return {
        "step_s": float(wall[k]), "median_s": float(np.median(wall)), "cpu_s": float(cpu.min()),
        "move_s": float(move.mean()), "force_s": float(force.mean()),
        "busy": float((move + force).max() / (move + force).mean()), "looks": looks / (steps * count),
        "look_s": float(of_looks), "rebuilds": (marks[k + 1][2] - marks[k][2]) / steps,
        "rebuilds_all": (marks[-1][2] - marks[0][2]) / (steps * count),
    }  # fmt: skip


def best(comm: Any, do: Any, inner: int, count: int) -> float:
    """Seconds of one call, of the slowest rank, in the best of `count` trials of `inner` calls after a meeting."""
    seconds = []
    for _ in range(count):
        comm.barrier()
        began = time.perf_counter()
        for _ in range(inner):
            do()
        seconds.append((time.perf_counter() - began) / inner)
    return float(np.max(comm.allgather(seconds), axis=0).min())


def waits(engine: Any) -> dict[str, int]:
    """MPI calls that wait for others: of a step without a look, of a look, of a rebuild."""
    comm = engine.comm
    if comm.size == 1:
        return {"step": 0, "look": 0, "rebuild": 0}
    count = [0]
    plain = comm.wait_all, comm._reduce_into

    def counted(function: Any) -> Any:
        def call(*values: Any) -> Any:
            count[0] += 1
            return function(*values)

        return call

    comm.wait_all = counted(plain[0])
    if not comm.crowded:  # there a reduction is a wait already
        comm._reduce_into = counted(plain[1])
    found = {}
    engine.rebuild_state.countdown = 2
    for name, do in (("step", engine.step), ("look", engine._check_rebuild), ("rebuild", engine.rebuild)):
        count[0] = 0
        do()
        found[name] = count[0]
    engine._forces()
    comm.wait_all, comm._reduce_into = plain
    return found


def frame(sim: hpcdem.Simulation) -> Row:
    """How long the steps stand still for a frame, and its bytes; files of both kinds."""
    before = {f.name for f in sim.outdir.glob("all_*")} if sim.outdir.exists() else set()
    began = time.perf_counter()
    sim.write_frame()
    seconds = time.perf_counter() - began
    new = [f for f in sim.outdir.glob("all_*") if f.name not in before]
    return {"frame_s": seconds, "frame_b": sum(f.stat().st_size for f in new)}


def lay_tall(sim: hpcdem.Simulation, bed: Bed, unit: str) -> None:
    """Copies of the settled unit side by side, everything turned by a right angle: the floor is on the left."""
    from bench import bed as beds

    with np.load(unit) as arrays:
        one = np.column_stack([arrays["y"], arrays["x"], arrays["r"]])
    rows = np.tile(one, (bed.copies, 1))
    rows[:, 1] += np.repeat(np.arange(bed.copies) * bed.unit_length, len(one))
    beds._load(sim, rows[np.random.default_rng(2).permutation(len(rows))])
    length, height, m = bed.length, bed.height, MATERIAL
    sim.wall(beds.FLOOR, ((0.0, 0.0), (0.0, length)), fric=m.fric)
    sim.wall(beds.LEFT, ((height, 0.0), (0.0, 0.0)), fric=m.fric)
    sim.wall(beds.RIGHT, ((0.0, length), (height, length)), fric=m.fric)
    sim.set(disk="off", gravity=(-m.gravity, 0.0), dt=m.dt)
    sim.prop(density=m.density, shear=m.shear, poiss=m.poiss, hertz=True, fric=m.fric, damp=m.damp)


# ---- parts alone ---------------------------------------------------------------------------------------------------


def alone(comm: Any) -> list[Row]:
    """Exchange, reduction, migration, packing: without particles. On two ranks; collective."""
    from hpcdem.core.memory import take_rows

    lines = []
    for rows in ROWS:
        seconds = best(comm, exchange(comm, rows), 50, 20)
        lines.append({"kind": "exchange", "rows": rows, "messages": 1, "s": seconds})
    for messages in MESSAGES[1:]:
        seconds = best(comm, many_messages(comm, messages), 50, 20)
        lines.append({"kind": "exchange", "rows": 8 * messages, "messages": messages, "s": seconds})
    five = np.zeros(5)
    lines.append({"kind": "reduce", "s": best(comm, lambda: comm.max_into(five), 50, 20)})
    for ranks in RANKS:
        lines.append({"kind": "migrate", "of": ranks, "s": best(comm, migration(ranks), 3, 5)})
    rng = np.random.default_rng(1)
    table, out = np.zeros((1 << 18, 8)), np.zeros((1 << 14, 8))
    order = np.sort(rng.choice(len(table), len(out), replace=False))
    take_rows(table, order, out)
    lines.append({"kind": "pack", "rows": len(out), "s": best(comm, lambda: take_rows(table, order, out), 3, 10)})
    return lines


def exchange(comm: Any, rows: int) -> Any:
    """The halo of the program with so many rows for the neighbour, as one function."""
    from hpcdem.core.memory import aligned
    from hpcdem.halo.exchange import Halo

    pieces = {comm.rank - 1: slice(0, rows), comm.rank + 1: slice(rows, 2 * rows)}
    halo = Halo(comm, 2 * rows, {rank: piece for rank, piece in pieces.items() if 0 <= rank < comm.size})
    table = aligned((halo.n_left + 2 * rows + halo.n_right, 8))
    table[:] = 0.0
    halo.add_ghost_field(table)
    return halo.refresh


def many_messages(comm: Any, messages: int) -> Any:
    """As many messages of 8 rows each way between two ranks, all started and waited for at once."""
    from mpi4py import MPI

    other = 1 - comm.rank
    table = np.zeros((2, messages, 512), np.uint8)
    requests = [comm.mpi.Recv_init(table[0, k], other, 100 + k) for k in range(messages)]
    requests += [comm.mpi.Send_init(table[1, k], other, 100 + k) for k in range(messages)]

    def swap() -> None:
        MPI.Prequest.Startall(requests)
        comm.wait_all(requests)

    return swap


def migration(ranks: int) -> Any:
    """What one rank of `ranks` does when nobody leaves: the program's own code, with an MPI that only answers."""
    from mpi4py import MPI

    from hpcdem.halo.comm import MpiComm
    from hpcdem.halo.migrate import Migration

    class Nobody:
        """Others send nothing, and are there already."""

        def Improbe(self, *_: Any) -> None:
            return None

        def Ibarrier(self) -> Any:
            return MPI.REQUEST_NULL

    comm = MpiComm.__new__(MpiComm)
    comm.mpi, comm.rank, comm.size, comm.crowded, comm._exchanges = Nobody(), 0, ranks, False, 0
    comm._test_all = MPI.Request.Testall
    none = np.zeros(0, np.int64)

    def once() -> None:
        Migration(comm, 0, none, none).exchange(np.zeros((0, 16)), none, np.zeros((0, 4)))

    return once
