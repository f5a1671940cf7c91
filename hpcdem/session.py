"""State that one process shares among all its simulations: ranks, threads, log, signals, compiled kernels.

The program `hpcdem` opens a session for the script it runs. A Python program that was started by itself
(``python study.py``, ``mpiexec -n 4 python study.py``) gets one when it makes its first simulation; the session then
also sees to it that an error on one rank ends all of them, with its message and its exit code.
"""

from __future__ import annotations

import atexit
import importlib
import math
import sys
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from hpcdem.core.comm import Comm
from hpcdem.core.errors import StoppedWithCheckpoint, UsageError
from hpcdem.physics.particle_physics import PHYSICS
from hpcdem.runtime import doctor, launch, run_folder, shutdown, speed
from hpcdem.runtime.pace import Pace

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project
    from hpcdem.physics.dem.simulation import Simulation
    from hpcdem.runtime.progress import Log
    from hpcdem.runtime.reproducibility import Reproduction
    from hpcdem.runtime.stop_requests import StopRequests


@dataclass
class Session:
    """comm: all ranks; threads: per rank; outdir: where results go if the script does not say; directory: that of the
    script, where its relative file names begin; figure: draw the last state of each simulation; draws: DRAW makes
    pictures; text: of the script; job: the same in a few words, for run.json; keep: which numbered checkpoints
    stay; ends_with_frame: write the last state of each simulation, too, if no command has; reproduction: of
    --check-reproducible; interpreter: what carries out the PCDC commands of this process, if it has any; adapts: nobody
    has said how many threads, so that a model may take fewer.
    """

    comm: Comm
    log: Log
    stop: StopRequests
    threads: int = 1
    directory: Path = field(default_factory=Path)
    outdir: Path | None = None
    figure: bool = True
    balance: bool = True
    draws: bool = False
    text: str = ""
    job: run_folder.Job = field(default_factory=run_folder.Job)
    keep: run_folder.Retention = field(default_factory=run_folder.Retention)
    ends_with_frame: bool = False
    reproduction: Reproduction | None = None
    ready: set[str] = field(default_factory=set)
    made: int = 0
    unfinished: list[Simulation] = field(default_factory=list)
    projects: list[Project] = field(default_factory=list)
    interpreter: Any = None
    adapts: bool = False

    def __post_init__(self) -> None:
        self.comm.warns_by(self.log.warn)

    def simulation(self, outdir: Path | None = None, log: Log | None = None) -> Simulation:
        """Collective: an empty model; the first one waits for the kernels."""
        self.prepare("")
        from hpcdem.physics.dem.simulation import Simulation  # brings the kernels with it

        outdir = Path(self.outdir or self.directory / "data") if outdir is None else outdir
        sim = Simulation(self.comm, self.threads, outdir, log, self.stop, balance_on=self.balance)
        sim.script, sim.draws, sim.job, sim.keep = self.text, self.draws, self.job, self.keep
        sim.number, self.made = self.made, self.made + 1
        sim.prepare_kernels = self.prepare
        if self.adapts and self.threads > 1:
            sim.pace = Pace(self.threads, log)
        run_folder.claim(Path(outdir), self.comm, self.job)
        if self.reproduction is not None:
            watch_states(sim, self.reproduction)
        self.unfinished.append(sim)
        return sim

    def project(self, outdir: Path | None = None, quiet: bool = False) -> Project:
        """Collective: an empty model of blocks; the first one waits for the kernels. quiet: without a log."""
        self.prepare("blocks")
        from hpcdem.commands.fdem import Project
        from hpcdem.physics.fdem.simulation import Blocks

        outdir = Path(self.outdir or self.directory / "data") if outdir is None else outdir
        run_folder.claim(outdir, self.comm, self.job)
        log = None if quiet else self.log
        blocks = Blocks(self.comm, self.threads, outdir, log, self.stop, balance_on=self.balance)
        blocks.prepare_kernels = self.prepare
        project = Project(blocks, self.directory, outdir)
        project.job, project.keep = self.job, self.keep
        self.projects.append(project)
        return project

    def prepare(self, kind: str) -> None:
        """Collective: wait for the kernels of a kind, see KINDS, once."""
        if kind not in self.ready:
            with self._counted():
                prepare(self.comm, self.log, [kind], self.threads, ready=self.ready)
            self.ready.update(needed([kind]))
            if kind in ("", "blocks"):
                self.stop.install(self.comm.rank)

    def newest(self, folder: Path, before: float = math.inf) -> str | None:
        """The newest checkpoint of a folder, or the last one at or before this time [s]; searched for by rank 0."""
        from hpcdem.runtime.checkpoints import newest_first  # brings h5py

        found = newest_first([folder], before)[0] if self.comm.rank == 0 else []
        return self.comm.bcast(str(found[0]) if found else None)

    def _counted(self) -> AbstractContextManager[None]:
        """Time the loading of kernels in the table of stages of the last blocks, if there are any."""
        return self.projects[-1].blocks.timers.around("kernels") if self.projects else nullcontext()

    def finish(self, sim: Simulation) -> None:
        """Collective: the table of stages, the figure of the last frame; MPI forgets the simulation. Particles that are
        stepped with blocks wait for the end of these, which is that of the program."""
        if any(project.coupled is not None and project.coupled.particles is sim for project in self.projects):
            return
        if sim in self.unfinished:
            self.unfinished.remove(sim)
        if sim.plots and self.job.language != "zdem":  # a script of that says STOP
            from hpcdem.commands.dem import output

            output.finish(sim)
        if self.ends_with_frame and sim.timers.steps and (sim.last_frame or (-1,))[0] != sim.clock.step:
            from hpcdem.commands.dem import output

            sim.close_model()
            output.Snapshot(sim).write_print()
        if sim.timers.steps:
            report_end(sim)
        if sim.log is not None and sim.timers.steps and not sim.coupled:  # else the table of the blocks has both
            summary = sim.log.stages(sim.timers, self.comm)
            if self.comm.rank == 0:
                law = "hertz" if sim.materials.rows["hertz"].any() else "linear"
                speed.remember_run(summary.particle_steps, summary.wall, self.comm.size * self.threads, law)
        if self.figure and sim.log is not None:
            from hpcdem.commands.dem import output

            output.draw_last_state(sim)
            if sim.folder_made and not sim.coupled:
                sim.log.results(Path(sim.outdir))
        self._note(sim, "done")
        sim.release()

    def close(self, failure: BaseException | None = None) -> None:
        """The end of the program: simulations that were not finished are, unless it is the end by a failure."""
        for project in [project for project in self.projects if project.coupled is not None]:
            self.projects.remove(project)
            self._leave(project, failure)  # while its particles are there
        for sim in list(self.unfinished):
            if failure is None:
                self.finish(sim)
            else:
                self._note(sim, "stopped" if isinstance(failure, StoppedWithCheckpoint) else "failed")
                sim.release()
        self.unfinished.clear()
        for project in self.projects:
            self._leave(project, failure)
        self.projects.clear()
        self.interpreter = None
        self.stop.uninstall()
        self.log.close()
        if self.reproduction is not None and failure is None:
            self.reproduction.close()
        run_folder.release_all()

    def leave(self, project: Project) -> None:
        """Collective: the good end of a model of blocks before that of the program."""
        self.projects.remove(project)
        self._leave(project, None)

    def _leave(self, project: Project, failure: BaseException | None) -> None:
        """A model of blocks at the end of the program. Collective, unless it is the end by a failure."""
        stopped = isinstance(failure, StoppedWithCheckpoint)  # on all ranks at the same step
        if failure is None or stopped:
            from hpcdem.commands.fdem import summary

            summary.close(project, self.figure and not stopped)
            if project.log is not None and project.folder_made and self.figure and not stopped:
                project.log.results(project.outdir)
        if project.folder_made:
            state = "done" if failure is None else "stopped" if stopped else "failed"
            run_folder.leave(project.outdir, self.comm, state, project.step)
        project.blocks.release()

    def _note(self, sim: Simulation, state: str) -> None:
        """Write into run.json how it ended."""
        if sim.folder_made:
            run_folder.leave(Path(sim.outdir), self.comm, state, sim.clock.step)


def prepare(comm: Comm, log: Log, kinds: Sequence[str], *threads: int, ready: Collection[str] = frozenset()) -> Path:
    """Collective: have the kernels of kinds, see KINDS, and of those that they need compiled, for each number of
    threads; but not those that are `ready`. Returns the folder in which they are kept."""
    from hpcdem.runtime.kernels import prepare_kernels

    names = [name for name in needed(kinds) if name not in ready]
    return prepare_kernels(comm, log, {name: partial(warm_up, name, *threads) for name in names})


def needed(kinds: Sequence[str]) -> list[str]:
    """Return these kinds, after those that they need and those that all share."""
    found = dict.fromkeys(["shared"])
    for kind in kinds:
        found |= dict.fromkeys([*(KINDS[kind].after if kind in KINDS else ()), kind])
    return list(found)


class Kernels(NamedTuple):
    """Kernels that are compiled together. module, function: what calls each of them once; after: kinds that this
    function needs too."""

    module: str
    function: str = "warm_up"
    after: tuple[str, ...] = ()


_TANGENT_SPACE = ("tangent", "plastic-tangent", "yielding-space", "tangent-space")
KINDS = {
    "shared": Kernels("runtime.warm_up"),
    "": Kernels("commands.dem.warm_up"),
    "energy": Kernels("commands.dem.warm_up", "with_energy", after=("",)),
    "clumps": Kernels("commands.dem.warm_up", "with_clumps", after=("",)),
    "restitution": Kernels("commands.dem.warm_up", "with_restitution", after=("",)),
    "rolling": Kernels("commands.dem.warm_up", "with_rolling", after=("",)),
    "blocks": Kernels("commands.fdem.warm_up"),
    "coupled": Kernels("physics.coupling.warm_up", after=("energy",)),
    "bolts": Kernels("physics.bolts.warm_up"),
    "liners": Kernels("physics.liners.warm_up"),
    "liners-space": Kernels("physics.liners.warm_up", "in_space", after=("space",)),
    "flow": Kernels("physics.flow.warm_up"),
    "flow-space": Kernels("physics.flow.warm_up", "in_space", after=("space", "flow")),
    "proppant": Kernels("physics.proppant.warm_up", after=("flow",)),
    "proppant-space": Kernels("physics.proppant.warm_up", "in_space", after=("proppant", "flow-space")),
    "heat": Kernels("physics.heat.warm_up"),
    "heat-space": Kernels("physics.heat.warm_up", "in_space", after=("space", "heat")),
    "six-nodes": Kernels("physics.fdem.warm_up", "six_nodes"),
    "yielding": Kernels("physics.fdem.warm_up", "yielding"),
    "creep": Kernels("physics.fdem.warm_up", "creeping"),
    "tangent": Kernels("physics.fdem.warm_up", "tangent"),
    "plastic-tangent": Kernels("physics.fdem.warm_up", "plastic_tangent", after=("yielding", "tangent")),
    "space": Kernels("physics.fdem.warm_up", "in_space"),
    "yielding-space": Kernels("physics.fdem.warm_up", "yielding_in_space", after=("space",)),
    "creep-space": Kernels("physics.fdem.warm_up", "creeping_in_space", after=("space",)),
    "tangent-space": Kernels(
        "physics.fdem.warm_up", "tangent_in_space", after=("tangent", "plastic-tangent", "yielding-space")
    ),
    "hexes": Kernels("physics.fdem.warm_up", "hexahedra", after=_TANGENT_SPACE),
    "yielding-hexes": Kernels("physics.fdem.warm_up", "yielding_hexahedra", after=(*_TANGENT_SPACE, "hexes")),
    "creep-hexes": Kernels(
        "physics.fdem.warm_up", "creeping_hexahedra", after=(*_TANGENT_SPACE, "hexes", "creep-space")
    ),
    "joints-hexes": Kernels("physics.fdem.warm_up", "jointed_hexahedra", after=(*_TANGENT_SPACE, "hexes")),
    "pictures": Kernels("post.view.warm_up", "in_space"),
}
"""Kinds of kernels: "" of all particles, "blocks" of all blocks, "coupled" what both need besides, "shared" by all; the
others are loaded, or compiled, by the first model that needs them."""
OF_PARTICLES = ("energy", "clumps", "restitution")
"""Kinds loaded when a model of particles needs them."""
OF_BLOCKS = tuple(kind for kind in KINDS if kind not in ("shared", "", "blocks", "coupled", *OF_PARTICLES))
"""Kinds loaded when a model of blocks needs them."""


def warm_up(kind: str, *threads: int) -> None:
    """Call every kernel of a kind once for each number of threads. kind: one of KINDS, or a physics of particles."""
    if kind in PHYSICS:
        call: Callable[[int], None] = PHYSICS[kind]().warm_up
    else:
        call = getattr(importlib.import_module(f"hpcdem.{KINDS[kind].module}"), KINDS[kind].function)
    for n in threads:
        call(n)


def watch_states(sim: Simulation, reproduction: Reproduction) -> None:
    """Log the states of this simulation without changing them."""
    from hpcdem.physics.dem import diagnostics
    from hpcdem.physics.dem.simulation import Watcher

    model = reproduction.new_model()

    def inspect() -> None:
        reproduction.see(model, sim.clock.step, diagnostics.fingerprint(sim))

    sim.watchers.append(Watcher(reproduction.every, inspect))


def report_end(sim: Simulation) -> None:
    """Collective: what became of the energy, and of particles that got lost; the last line of histories, as a program
    need not say STOP."""
    from hpcdem.commands.dem import output

    output.close_histories(sim)
    output.report_energy(sim)
    if sim.log is not None and sim.lost:
        sim.log.info(f"{sim.lost} particles in total left the BOX and were deleted; see the lines above")


def greet(
    comm: Comm, log: Log, cores_before: int, threads: int, warnings: list[str], outdir: Path | None = None
) -> None:
    """Collective: the first line of the log, and what is wrong with the launch and with where results will go."""
    places = comm.allgather(launch.place(cores_before, threads))
    library = launch.mpi_library() if comm.mpi is not None else None
    log.info(launch.start_report(places, library))
    machine = doctor.Machine(places, comm.rank, launch.launcher(), library, directory=outdir or Path())
    for warning in warnings + doctor.start_warnings(machine, comm):
        log.warn(warning)


# -- the session of this process -------------------------------------------------------------------------------------

_current: Session | None = None


def enter(session: Session | None) -> None:
    """Make it the session of simulations made by Python code; None: end it."""
    global _current
    _current = session


def refuse_after_stop() -> None:
    """Raise what has ended the run, if it has: the program has caught it."""
    if _current is not None:
        _current.stop.refuse()


def current(threads: int | None = None) -> Session:
    """The session of this process, opened by the first call. UsageError if it has another number of threads."""
    if _current is None:
        enter(_open(threads))
    assert _current is not None
    if threads is not None and threads != _current.threads:
        raise UsageError(
            f"this run already uses {_current.threads} thread(s) per rank, {threads} requested: all simulations of a "
            "program share them (set them with hpcdem -j)"
        )
    return _current


def _open(threads: int | None) -> Session:
    """Collective: start what a Python program that was not started by `hpcdem` needs, and watch over its end."""
    cores_before = launch.cores()
    with launch.one_voice():
        count, warnings = launch.prepare_environment(threads or launch.threads_by_default())
        comm = launch.start_mpi()
    from hpcdem.runtime.progress import Log
    from hpcdem.runtime.stop_requests import AUTOSAVE, StopRequests, slurm_end_time

    log = Log(comm.rank)
    greet(comm, log, cores_before, count, warnings)
    stop = StopRequests(None, comm.bcast(slurm_end_time() if comm.rank == 0 else None), AUTOSAVE)
    program = getattr(sys.modules["__main__"], "__file__", None)
    directory = Path(program).parent if program else Path()
    session = Session(comm, log, stop, count, directory, ends_with_frame=True, adapts=threads is None)
    session.job = run_folder.Job(program or "", "python", tuple(sys.argv[1:]), count)
    _watch_the_end(session)
    return session


def _watch_the_end(session: Session) -> None:
    """An uncaught error ends all ranks as it does in the program hpcdem; at a good end, simulations are finished."""
    channel = shutdown.private_channel(session.comm)
    usual = sys.excepthook
    done: list[bool] = []

    def end(failure: shutdown.Failure | None) -> int:
        done.append(True)
        code = shutdown.end_mpi(shutdown.come_together(session.comm, channel, failure))
        enter(None)
        return code

    def on_error(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        if hasattr(sys, "ps1"):  # a console continues after an error
            usual(kind, error, trace)
            return
        session.close(error)
        sys.exit(end(shutdown.describe(error)))

    def at_exit() -> None:
        if done:
            return
        try:
            session.close()
        except Exception as error:  # a full disk, a missing matplotlib: the code of the process is settled already
            end(shutdown.describe(error))
        else:
            end(None)

    sys.excepthook = on_error
    atexit.register(at_exit)
