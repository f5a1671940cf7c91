"""What a run writes: frames, pictures, histories, wall forces, checkpoints, progress.

All functions are collective and need a closed model. The folder is made when the first file is written, so a script
that fails before leaves nothing behind.

While a CYC or IMPLE runs, frames are written behind its back (io/behind.py): the model is copied, all ranks make their
part of the files, and a thread of rank 0 brings them to the disk while the ranks step on. One moment at most is under
way: the next frame, a checkpoint, a function of a Python program and the end of the command wait for it. Errors of the
disk stop all ranks at the next report or at one of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from hpcdem import observe, saving
from hpcdem.errors import CommandError, HpcdemError
from hpcdem.io.behind import Deliveries
from hpcdem.io.columns import append_rows
from hpcdem.io.dat import write_dat
from hpcdem.io.files import make_folder, write_sections
from hpcdem.io.frame import Frame, whole
from hpcdem.io.frames import frame_name
from hpcdem.io.ps import write_ps
from hpcdem.io.vtk import write_vtk
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.runtime.progress import StepStatus
from hpcdem.simulation import Simulation

WALL_COLUMNS = "step,time,wall,x1,y1,x2,y2,fx,fy"


_under_way = Deliveries()


class Snapshot:
    """The model at one moment, gathered once for all files that are due.

    waits: files have their names when a method returns; otherwise when `settle` does.
    """

    def __init__(self, sim: Simulation, initial: bool = False, waits: bool = True) -> None:
        self.sim, self.initial = sim, initial
        self._later = None if waits else _under_way
        self._frame: Frame | None = None

    @property
    def frame(self) -> Frame:
        """The frame, made when first asked for; what was under way is settled then."""
        if self._frame is None:
            settle(self.sim)
            self._frame = observe.frame(self.sim)
        return self._frame

    def _path(self, suffix: str, stem: str = "all") -> str:
        return str(folder(self.sim) / frame_name(self.sim.clock.step, suffix, self.initial, stem))

    def _write(self, write: Callable[..., None], suffix: str) -> None:
        path, frame, comm = self._path(suffix), self.frame, self.sim.comm
        if self._later is not None and comm.size == 1:
            self._later.entrust(lambda: write(path, frame, comm))
        else:
            write(path, frame, comm, self._later)

    def write_print(self) -> None:
        """`all_<step>[_ini].vtkhdf` and `.dat`."""
        key = (self.sim.clock.step, self.initial)
        if self.sim.last_frame == key:
            return
        with self.sim.timers("output"):
            self._write(write_vtkhdf, ".vtkhdf")
            self._write(write_dat, ".dat")
            _under_way.go()
        self.sim.last_frame = key

    def write_vtk(self) -> None:
        """`all_<step>.vtk` and `wall_<step>.vtk`."""
        with self.sim.timers("output"):
            self._write(write_vtk, ".vtk")
            _under_way.go()

    def write_ps(self) -> None:
        """`all_<step>.ps`."""
        with self.sim.timers("output"):
            self._write(write_ps, ".ps")
            _under_way.go()

    def write_drawing(self, what: tuple[str, ...]) -> None:
        """`draw_<step>.jpg`, by rank 0: the words of DRAW."""
        with self.sim.timers("figure"):
            path, error = self._path(".jpg", "draw"), None
            all_rows = whole(self.frame, self.sim.comm)
            if all_rows is not None:
                from hpcdem.post import plots

                try:
                    plots.plot_frame(all_rows, path, 200.0, what)
                except HpcdemError as problem:
                    error = str(problem)
            self.sim.comm.agree(error)


def settle(sim: Simulation) -> None:
    """Wait until all files have their names. Raises HpcdemError on all ranks if one could not be written."""
    _under_way.settle(sim.comm)


def wait_for_disk() -> None:
    """Wait for the disk on this rank alone, whatever it says: the way out after an error. Not collective."""
    _under_way.wait()


def folder(sim: Simulation) -> Path:
    """The output folder, made on the first call."""
    path = Path(sim.outdir)
    if not sim.folder_made:
        make_folder(path, sim.comm)
        sim.folder_made = True
    return path


def write_checkpoint(sim: Simulation, _: Snapshot | None = None) -> Path:
    """`<step>.sav`, once everything else is written; returns its path."""
    with sim.timers("output"):
        settle(sim)
    path = folder(sim) / f"{sim.clock.step:010d}.sav"
    saving.save(sim, path)
    return path


def write_last_words(sim: Simulation) -> None:
    """A frame of a state that makes no sense any more, for the user to look at."""
    with np.errstate(all="ignore"):
        sim.refresh_tables()
        Snapshot(sim).write_print()


# ---- time series -------------------------------------------------------------------------------------------------


def unbalanced(sim: Simulation) -> float:
    """Largest unbalanced force of a free particle over the mean normal contact force; 0 without contacts.
    Collective."""
    return observe.survey(sim).unbalanced


HISTORIES = {
    "kinetic": ("J", observe.kinetic_energy),
    "step": ("1", lambda sim: float(sim.clock.step)),
    "time": ("s", lambda sim: sim.clock.time),
    "unbalanced": ("1", unbalanced),
    "contacts": ("1", lambda sim: float(observe.survey(sim).contacts)),
    "bonds": ("1", lambda sim: float(sim.bonds_left())),
}
"""What HIST can follow: unit and function of the simulation."""


def write_history(sim: Simulation, ident: int, _: Snapshot | None = None) -> None:
    """Append (step, time, value) to `hist_<id>.dat`."""
    what = sim.history_wishes[ident][1]
    unit, measure = HISTORIES[what]
    with sim.timers("output"):
        value = measure(sim)
        header = f"# step time[s] {what}[{unit}]"
        row = f"{sim.clock.step} {sim.clock.time!r} {value!r}"
        _append(sim, f"hist_{ident}.dat", header, [row])


def report(sim: Simulation, _: Snapshot | None = None) -> None:
    """A row per wall in `walls.csv`, and the progress line where one is due."""
    with sim.timers("output"):
        _under_way.look(sim.comm)
        force = observe.wall_forces(sim)
        w, clock = sim.walls, sim.clock
        rows = []
        for k in w.in_output_order():
            numbers = (clock.time, *w.p1[k], *w.p2[k], *force[k])
            time, *rest = (repr(float(v)) for v in numbers)
            rows.append(",".join([str(clock.step), time, str(w.id[k]), *rest]))
        if rows:
            _append(sim, "walls.csv", WALL_COLUMNS, rows)
        wanted = sim.log is not None and sim.log.wants(clock.step)
        if sim.comm.bcast(wanted):
            walls = [(int(i), float(fx), float(fy)) for i, (fx, fy) in zip(w.id, force, strict=True) if i >= 0]
            sim.log.step(status(sim, walls))


def status(sim: Simulation, walls: list[tuple[int, float, float]]) -> StepStatus:
    """What a progress line tells. Collective."""
    clock, seen = sim.clock, observe.survey(sim)
    tension, shear = sim.broken()
    return StepStatus(
        step=clock.step, time=clock.time, dt=clock.dt,
        dt_critical=seen.critical_dt if math.isfinite(seen.critical_dt) else 0.0,
        kinetic=seen.kinetic, unbalanced_ratio=seen.unbalanced, particles=seen.particles, contacts=seen.contacts,
        bonds=sim.bonds_left(), broken_tension=tension, broken_shear=shear, walls=walls,
    )  # fmt: skip


def _append(sim: Simulation, name: str, header: str, rows: list[str]) -> None:
    """Add rows to a text file whose rows begin with the step. The first time in a run, a new model starts a new file, a
    restarted one cuts what lies after its step."""
    path = folder(sim) / name
    since = None if name in sim.series_open else sim.restart_step
    append_rows(path, header, rows, since, sim.comm)
    sim.series_open.add(name)


def finish(sim: Simulation) -> None:
    """At STOP: the curves asked for by PLOT, `hist_<y>_vs_<x>.txt`."""
    for y, x in sim.plots:
        missing = [i for i in (y, x) if i not in sim.history_wishes]
        if missing:
            raise CommandError(f"PLOT {y} {x}: there is no HIST {missing[0]}")
        text = ""
        if sim.comm.rank == 0:
            columns = []
            for ident in (x, y):
                path = Path(sim.outdir) / f"hist_{ident}.dat"
                lines = path.read_text().splitlines()[1:] if path.exists() else []
                columns.append({line.split()[0]: line.split()[2] for line in lines})
            names = [sim.history_wishes[i][1] for i in (x, y)]
            rows = [f"{columns[0][s]} {columns[1][s]}" for s in columns[0] if s in columns[1]]
            text = "\n".join([f"# {names[0]} {names[1]}", *rows]) + "\n"
        write_sections(folder(sim) / f"hist_{y}_vs_{x}.txt", sim.comm, partial(_sections, text))


def _sections(text: str) -> list[bytes]:
    return [text.encode()]
