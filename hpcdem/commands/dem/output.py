"""Output of a run: frames, pictures, histories, wall forces, checkpoints, progress.

All functions are collective and need a closed model. The folder is made when the first file is written, so a script
that fails before leaves nothing behind.

While a CYC or IMPLE runs, frames are written behind its back (io/behind.py): the model is copied, all ranks make their
part of the files, and a thread of rank 0 brings them to the disk while the ranks step on. One moment at most is under
way: the next frame, a checkpoint, a function of a Python program and the end of the command wait for it. Errors of the
disk stop all ranks at the next report or at one of these.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.units import label, with_prefix
from hpcdem.io.agreed import atomic_path, on_first
from hpcdem.io.behind import under_way as _under_way
from hpcdem.io.columns import append_rows
from hpcdem.io.dat import write_dat
from hpcdem.io.disk import to_disk
from hpcdem.io.files import write_sections
from hpcdem.io.frame import Frame, whole
from hpcdem.io.frames import frame_name, read_frame
from hpcdem.io.ps import write_ps
from hpcdem.io.vtk import write_vtk
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.physics.dem import budget, diagnostics, mean_stress, saved_state
from hpcdem.physics.dem.platens import OF_PARTS
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import total
from hpcdem.runtime import launch, run_folder
from hpcdem.runtime.progress import StepStatus

WALL_COLUMNS = "step,time,wall,x1,y1,x2,y2,fx,fy"
OF_ROLLING = ("elastic_rolling", "loss_rolling")
"""Columns of energy.csv of models with rolling resistance only."""
ENERGY_COLUMNS = ",".join(["step", "time", *(name for name in budget.NAMES if name not in OF_ROLLING)])


class Snapshot:
    """The present state of the model, gathered once for all files that are due.

    waits: a method returns when its file is complete; otherwise files are complete after `settle`.
    """

    def __init__(self, sim: Simulation, initial: bool = False, waits: bool = True) -> None:
        self.sim, self.initial = sim, initial
        self._later = None if waits else _under_way
        self._frame: Frame | None = None

    @property
    def frame(self) -> Frame:
        """The frame, made on first use; files still being written are completed first."""
        if self._frame is None:
            settle(self.sim)
            self._frame = diagnostics.frame(self.sim)
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


def draw_last_state(sim: Simulation) -> None:
    """The figure of the present state, `all_<step>.jpg`, by rank 0. No steps, no figure."""
    from hpcdem.post import plots

    if not sim.timers.steps:
        return
    path, frame = sim.outdir / frame_name(sim.clock.step, ".jpg"), None
    if sim.last_frame is None or sim.last_frame[0] != sim.clock.step:
        sim.close_model()
        folder(sim)
        frame = diagnostics.frame(sim)
        frame.tables = {"particles": frame.tables["particles"]}
        frame = whole(frame, sim.comm)
    elif sim.comm.rank == 0:
        path = path.with_name(frame_name(sim.last_frame[0], ".jpg", sim.last_frame[1]))
        frame = read_frame(path.with_suffix(".vtkhdf"), ("particles",))
    if frame is not None and sim.log is not None:
        sim.log.info(f"figure: {plots.plot_frame(frame, path)}")


def settle(sim: Simulation) -> None:
    """Wait until all files are complete. Raises HpcdemError on all ranks if one could not be written."""
    _under_way.settle(sim.comm)


def wait_for_disk() -> None:
    """Wait for the files of this rank and ignore errors: the last action after another error. Not collective."""
    _under_way.wait()


def folder(sim: Simulation) -> Path:
    """The output folder, made and locked on the first call."""
    path = Path(sim.outdir)
    if not sim.folder_made:
        job = sim.job or run_folder.Job()
        locked = run_folder.enter(path, sim.comm, job, launch.version(), sim.resumed, sim.restored)
        sim.folder_made = True
        if sim.log is not None:
            sim.log.place = path
        if not locked and sim.log is not None:
            sim.log.warn_once(
                "lock",
                f"the file system of {path} has no locks: two runs that write there at the same time cannot be "
                "detected",
            )
    return path


def write_checkpoint(sim: Simulation, _: Snapshot | None = None, automatic: bool = False) -> Path:
    """Write `<step>.sav` after all other output and return its path. automatic: write `auto_<step>.sav` and keep the
    last two. Surplus checkpoints are removed when the new one is complete.
    """
    with sim.timers("output"):
        settle(sim)
        path = folder(sim) / run_folder.checkpoint_name(sim.clock.step, automatic)
        secure_series(sim)
    saved_state.save(sim, path)
    run_folder.retire(path.parent, sim.comm, sim.clock.step, sim.keep)
    return path


def write_crash_frame(sim: Simulation) -> None:
    """Write a frame of an invalid state for inspection."""
    with np.errstate(all="ignore"):
        sim.refresh_tables()
        Snapshot(sim).write_print()


# ---- time series -------------------------------------------------------------------------------------------------


def unbalanced(sim: Simulation) -> float:
    """Return the largest unbalanced force of a free particle over the mean normal contact force; 0 without contacts.
    Collective.
    """
    return diagnostics.survey(sim).unbalanced


def deflection(sim: Simulation) -> float:
    """Return the largest deflection of the bases of FLEXURE [m]; NaN after the last one has ended."""
    return max((float(base.now(sim.clock.step)[base.nodes, 0].max()) for base in sim.bases), default=math.nan)


HISTORIES: dict[str, tuple[str, Callable[[Simulation], float]]] = {
    "kinetic": ("J", diagnostics.kinetic_energy),
    "step": ("1", lambda sim: float(sim.clock.step)),
    "time": ("s", lambda sim: sim.clock.time),
    "unbalanced": ("1", unbalanced),
    "contacts": ("1", lambda sim: float(diagnostics.survey(sim).contacts)),
    "bonds": ("1", lambda sim: float(sim.bonds_left())),
    "energy": ("J", budget.stored_energy),
    "deflection": ("m", deflection),
    "period": ("m", lambda sim: sim.settings.period),
    **{name: ("Pa", partial(mean_stress.mean, name=name)) for name in mean_stress.COMPONENTS},
}
"""Quantities that HIST can record: unit and function of the simulation."""


def followed(sim: Simulation) -> dict[str, tuple[str, Callable[[Simulation], float]]]:
    """Return the quantities that HIST can record in this model: HISTORIES and the diagnostics of its physics."""
    return HISTORIES | {name: what for physics in sim.physics for name, what in physics.diagnostics().items()}


def unit_of(sim: Simulation, what: str) -> str:
    """Return the declared unit of a quantity that HIST records."""
    name = what.split()[0]
    unit = OF_PARTS[name].unit if name in OF_PARTS else followed(sim)[what][0]
    return label(sim.settings.units, unit)


def write_history(sim: Simulation, ident: int, _: Snapshot | None = None) -> None:
    """Append (step, time, value) to `hist_<id>.csv`, and (step, value) to `hist_id_<id>.dat`.

    The second file has the layout that public readers of ZDEM histories expect: a line with the word hist, two header
    lines, rows, and a last line that readers skip (written by `finish`).
    """
    what = sim.history_requests[ident][1]
    step, time = sim.clock.step, sim.clock.time
    with sim.timers("output"):
        name, unit = what.split()[0], unit_of(sim, what)
        value = OF_PARTS[name].value(sim, what, ident) if name in OF_PARTS else followed(sim)[what][1](sim)
        append(sim, f"hist_{ident}.csv", f"step,time [s],{what} [{unit}]", [f"{step},{time!r},{value!r}"])
        header = f"hpcdem\nhist id {ident}\n{what} [{unit}]\nstep value"
        append(sim, f"hist_id_{ident}.dat", header, [f"{step} {value!r}"])


def report(sim: Simulation, _: Snapshot | None = None) -> None:
    """Write a row per wall to `walls.csv`, and the progress line if one is due."""
    with sim.timers("output"):
        _under_way.poll(sim.comm)
        force = diagnostics.wall_forces(sim)
        w, clock = sim.walls, sim.clock
        rows, walls = [], []
        for id, parts in w.polylines().items():
            on_wall = total(force, parts)
            numbers = (clock.time, *w.ends(parts).ravel(), *on_wall)
            time, *rest = (repr(float(v)) for v in numbers)
            rows.append(",".join([str(clock.step), time, str(id), *rest]))
            if w.side[parts[0]] == 0:
                walls.append((id, float(on_wall[0]), float(on_wall[1])))
        if rows:
            append(sim, "walls.csv", WALL_COLUMNS, rows)
        wanted = sim.log is not None and sim.log.wants(clock.step)
        if sim.comm.bcast(wanted):
            sim.log.step(status(sim, walls))


DEEP = 0.5
"""Overlap over the smaller radius above which contacts are reported."""


def warn_of_overlaps(sim: Simulation) -> None:
    """Warn once per command about contacts with an overlap beyond half the smaller radius: their number and the
    deepest. Collective."""
    key = f"overlaps since step {sim.progress['first'] if sim.progress is not None else sim.clock.step}"
    if sim.comm.bcast(sim.log.has_warned(key)):
        return
    worst, number = diagnostics.overlaps_beyond(sim, DEEP, 1)
    for o in worst:
        who = f"particle {o.id1} and wall {o.id2}" if o.wall else f"particles {o.id1} and {o.id2}"
        made_of = " | ".join(sim.materials.describe(m) for m in dict.fromkeys(o.materials))
        sim.log.warn_once(
            key,
            f"step {sim.clock.step}: {number} contacts overlap by more than half the smaller radius, {who} at "
            f"({o.x:g}, {o.y:g}) by {o.ratio:.2f} of it ({o.u:g} m; {made_of}). Use a larger stiffness, or create "
            "particles without overlap",
        )


def write_energy(sim: Simulation, _: Snapshot | None = None) -> None:
    """Write a row of `energy.csv`: the present energy budget."""
    with sim.timers("output"):
        seen = dataclasses.asdict(sim.energy.evaluate(sim))
        of_rolling = {name: seen.pop(name) for name in OF_ROLLING}
        of_physics = physics_energies(sim) | (of_rolling if sim.rolling is not None else {})
        numbers = (repr(v) for v in (sim.clock.time, *seen.values(), *of_physics.values()))
        append(sim, "energy.csv", ",".join([ENERGY_COLUMNS, *of_physics]), [",".join([str(sim.clock.step), *numbers])])


def physics_energies(sim: Simulation) -> dict[str, float]:
    """Return the energies of the added physics [J] by name. Collective."""
    known = followed(sim)
    return {name: known[name][1](sim) for physics in sim.physics for name in physics.energies}


def report_energy(sim: Simulation) -> None:
    """Log the energy budget as a table at the end of a run; does nothing without SET energy. Collective."""
    if sim.energy is None or sim.energy.start is None:
        return
    seen, of_physics = sim.energy.evaluate(sim), physics_energies(sim)
    if sim.log is None:
        return
    values = {
        words: float(getattr(seen, name))
        for name, words in ENERGY_WORDS.items()
        if name not in ("work_blocks", "loss_laws", *OF_ROLLING) or getattr(seen, name)
    } | of_physics
    sim.log.account("energy budget", "energy", "J", values, sim.settings.units)
    closing = with_prefix(seen.closing, "J", system=sim.settings.units)
    sim.log.info(
        f"energy: closing error {closing}, {seen.relative:.2g} of the largest flow "
        "(docs/physics.md says which terms close to rounding and which with the time step)"
    )


ACROSS = "work across contacts of discs and faces"
"""Name of this entry in the tables of particles and blocks."""
ENERGY_WORDS = {
    "kinetic_translation": "stored: motion",
    "kinetic_rotation": "stored: rotation",
    "elastic_normal": "stored: contacts, normal",
    "elastic_shear": "stored: contacts, shear",
    "elastic_bonds": "stored: open bonds",
    "elastic_rolling": "stored: rolling springs",
    "work_gravity": "work of gravity",
    "work_walls": "work of moving walls",
    "work_driven": "work on fixed particles",
    "loss_friction": "lost by friction",
    "loss_local_damping": "lost by local damping",
    "loss_lattice_damping": "lost by lattice-solid damping",
    "loss_bonds": "lost when bonds broke",
    "loss_opened": "lost when contacts opened",
    "loss_stiffness": "lost by change of shear stiffness",
    "loss_laws": "lost in pairs with a user law",
    "loss_rolling": "lost by rolling resistance",
    "commands": "supplied by commands",
    "box": "removed with particles that left the BOX",
    "work_blocks": ACROSS,
    "closing": "closing error",
}
"""Names of the columns of energy.csv in the final table."""


def status(sim: Simulation, walls: list[tuple[int, float, float]]) -> StepStatus:
    """Return the quantities of a progress line. Collective."""
    clock, seen = sim.clock, diagnostics.survey(sim)
    tension, shear = sim.broken()
    if seen.deepest > DEEP and sim.log is not None:
        warn_of_overlaps(sim)
    return StepStatus(
        step=clock.step, time=clock.time, dt=clock.dt,
        dt_critical=seen.critical_dt if math.isfinite(seen.critical_dt) else 0.0,
        kinetic=seen.kinetic, unbalanced_ratio=seen.unbalanced, particles=seen.particles, contacts=seen.contacts,
        bonds=sim.bonds_left(), broken_tension=tension, broken_shear=shear, walls=walls,
        units=sim.settings.units,
    )  # fmt: skip


def append(sim: Simulation, name: str, header: str, rows: list[str]) -> None:
    """Append rows to a text file whose rows begin with the step. On the first call of a run, a new model starts a new
    file and a restarted one removes rows after its step. If the header has gained columns, these are 0 in earlier rows.
    """
    path = folder(sim) / name
    since, before = None, sim.series_open.get(name)
    if before is None:  # a row of this step, if there is one, was written after the checkpoint
        since = min(sim.restart_step, sim.clock.step - 0.5) if sim.restart_step else 0
    elif before != header and header.startswith(before):
        since = math.inf
    append_rows(path, header, rows, since, sim.comm)
    sim.series_open[name] = header


def secure_series(sim: Simulation) -> None:
    """Flush series to disk: a restart relies on all rows up to its step, so they must be as safe as the checkpoint.
    Collective.
    """

    def flush() -> None:
        for name in sorted(sim.series_open):
            with suppress(FileNotFoundError):
                to_disk(str(Path(sim.outdir) / name))

    on_first(sim.comm, flush)


def close_histories(sim: Simulation) -> None:
    """Write the last line of each `hist_id_<id>.dat`, which readers skip; once. Collective."""
    for ident in sim.history_requests:
        name = f"hist_id_{ident}.dat"
        if name in sim.series_open and name not in sim.series_closed:
            append_rows(folder(sim) / name, "", ["end"], None, sim.comm)
            sim.series_closed.add(name)


def finish(sim: Simulation) -> None:
    """Write at STOP the last line of histories, and the curves requested by PLOT, `hist_<y>_vs_<x>.txt` and `.png`."""
    close_histories(sim)
    for y, x in sim.plots:
        missing = [i for i in (y, x) if i not in sim.history_requests]
        if missing:
            raise CommandError(f"PLOT {y} {x}: there is no HIST {missing[0]}")
        text, names = "", [""]
        pairs: list[tuple[str, str]] = []
        if sim.comm.rank == 0:
            columns = []
            for ident in (x, y):
                path = Path(sim.outdir) / f"hist_{ident}.csv"
                lines = path.read_text().splitlines()[1:] if path.exists() else []
                columns.append({line.split(",")[0]: line.split(",")[2] for line in lines})
            names = [sim.history_requests[i][1] for i in (x, y)]
            pairs = [(columns[0][s], columns[1][s]) for s in columns[0] if s in columns[1]]
            text = "\n".join([f"# {names[0]} {names[1]}", *(f"{a} {b}" for a, b in pairs)]) + "\n"
        path = folder(sim) / f"hist_{y}_vs_{x}.txt"
        write_sections(path, sim.comm, partial(_sections, text))
        points = [(float(a), float(b)) for a, b in pairs]
        on_first(sim.comm, partial(_draw_curve, sim, path.with_suffix(".png"), names, points))


def _draw_curve(sim: Simulation, path: Path, names: list[str], points: list[tuple[float, float]]) -> None:
    """The picture of PLOT, on one rank."""
    from hpcdem.post import charts

    units = [unit_of(sim, name) for name in names]
    x, y = (name if unit == "1" else f"{name} ({unit})" for name, unit in zip(names, units))
    with atomic_path(path) as temporary:
        charts.draw(Path(temporary), "png", "", x, y, [("", "line" if len(points) > 1 else "points", points)])


def _sections(text: str) -> list[bytes]:
    return [text.encode()]
