"""A simulation in a Python program: particles here, blocks in `blocks`, and both together."""

from __future__ import annotations

import math
from collections.abc import Callable, ItemsView, Iterator, Mapping, ValuesView
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, Generic, ParamSpec, TypeVar

import numpy as np

from hpcdem import session
from hpcdem.api.blocks import BlockCommands
from hpcdem.api.frames import Frame, shown
from hpcdem.api.functions import command as _command
from hpcdem.api.functions import query as _query
from hpcdem.api.particles import ParticleCommands
from hpcdem.api.program import carried_out
from hpcdem.commands import dem, fdem
from hpcdem.core.errors import CommandError, HpcdemError, ScriptError, UnknownNameError, UsageError, WrongValueError
from hpcdem.core.fields import FIELDS
from hpcdem.core.nearest import hint
from hpcdem.core.place import place as _place
from hpcdem.io import checkpoint
from hpcdem.lang.zdem.execute import Interpreter, find, report_warnings
from hpcdem.lang.zdem.lexer import read_lines
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem.materials import MATERIAL

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project
    from hpcdem.physics.dem.simulation import Simulation as Engine
    from hpcdem.post.view.moment import Moment

SETTABLE = ("x", "y", "vx", "vy", "spin", "radius", "angle", "fix", "color", "group")
"""Fields that a program may write."""
MATERIAL_FIELDS = MATERIAL.names or ()
Point = tuple[float, float]
Given = ParamSpec("Given")
Returned = TypeVar("Returned")


@dataclass(frozen=True)
class Wall:
    """The present state of a wall: end points, velocity [m/s], stiffnesses [N/m] (linear particles), friction."""

    p1: Point
    p2: Point
    v: Point
    kn: float
    ks: float
    fric: float


class Call:
    """A function that is called at an interval of steps; `cancel` ends the calls."""

    def __init__(self, sim: Simulation, watcher: Any) -> None:
        self._sim, self._watcher = sim, watcher

    def cancel(self) -> None:
        """End the calls of the function."""

        def remove() -> None:
            if self._watcher in self._sim.engine.watchers:
                self._sim.engine.watchers.remove(self._watcher)

        self._sim._asked(("cancel", self._watcher.every), remove, again=True)


class Simulation(ParticleCommands, BlockCommands):
    """A model and its run: particles, blocks, or both. A new model is empty, as after START.

    The methods of this class make particles; those of `mesh`, `elements`, `faces`, `joints`, `nodes`, `geometry`,
    `tables`, `fields`, `histories`, `charts` and `output` make blocks, which `step` and `solve` advance. `couple`
    couples the two. The one made second writes into a subfolder of the output folder, `particles` or `blocks`.

    outdir: output folder (default: ``data`` in the folder of the program); threads: per rank (default: from ``-j`` or
    ``srun -c``, else 1); log: print progress and the table of stages. Relative file names, here and in all methods, are
    relative to `directory`: the folder of the program, or in an interactive session the working directory.

    where: particles to which a method applies, as the text of a RANGE (``"y 0 1000 and group rock"``, ``"y {top}-500
    {top}"``) or an object of `hpcdem.core.selection` (default: all). color: a name or number of the table of the manual
    (lg green yellow red white black mg blue gb violet). Units are SI.
    """

    def __init__(self, outdir: str | Path | None = None, threads: int | None = None, log: bool = True) -> None:
        self._session = session.current(threads)
        self.directory = self._session.directory.resolve()
        usual = Path(self._session.outdir or self.directory / "data") if outdir is None else self.directory / outdir
        self._folder = usual.resolve()
        self._log = self._session.log if log else None
        self._engine: Engine | None = None
        self._project: Project | None = None
        self.coupling: Coupling | None = None
        self._begin_blocks(self._made_project, self._before_steps)
        self._seen_alone = ""
        if self._session.interpreter is not None:  # its journal knows particles by their numbers
            self._asked(("Simulation", outdir, log), lambda: None, again=True)

    @property
    def engine(self) -> Engine:
        """The particle model, of `hpcdem.physics.dem`; made on first use."""
        if self._engine is None:
            folder = self._folder if self._project is None else self._folder / "particles"
            self._engine = self._session.simulation(folder, self._log)
            self._engine.resume_advice = "Simulation.resume()"
            self._engine.line = _place()[1]
        return self._engine

    def _made_project(self) -> Project:
        """The blocks, made when they are first used."""
        if self._project is None:
            running = self._session.interpreter
            if running is not None and running.journal is not None:
                raise CommandError("in a PCDC script create the blocks with pcdc lines")
            if self._session.reproduction is not None:
                raise CommandError(
                    "--check-reproducible is for models of particles; for blocks compare the files of save"
                )
            folder = self._folder
            if self._engine is not None and self._engine.outdir == folder:
                if self._untouched(self._engine):  # as after every(...)
                    self._engine.outdir = folder / "particles"
                else:
                    folder = folder / "blocks"
            self._project = self._session.project(folder, quiet=self._log is None)
            self._project.resume_advice = "Simulation.resume()"
        return self._project

    @staticmethod
    def _untouched(engine: Engine) -> bool:
        """Return whether the model has no particles, walls or settings of particles yet. Collective."""
        return engine.clock.step == 0 and len(engine.walls) == 0 and engine.count(len(engine.particles)) == 0

    @property
    def _only_blocks(self) -> bool:
        """Return whether the model has blocks and no particles. Collective."""
        return self._project is not None and (self._engine is None or self._untouched(self._engine))

    @property
    def _clock(self) -> Any:
        """The clock of the particles, or of the blocks in a model without particles. Collective."""
        return self._project.blocks.clock if self._project is not None and self._only_blocks else self.engine.clock

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: Any, *rest: Any) -> None:
        if kind is None:
            self.finish()

    # ---- who is there ----------------------------------------------------------------------------------------------

    @_command
    def start(self, dim: int = 2) -> None:
        """START, model new: discard the model and begin a new, empty one; dim 3: blocks in three dimensions."""
        self._refuse_coupled("start")
        if dim != 2:
            self._made_project()
        if self._project is not None:
            fdem.settings.new(self._project, dim)
        if self._project is None or self._engine is not None:
            engine = self.engine
            dem.particles.start(engine)

    # ---- what it is made of ----------------------------------------------------------------------------------------

    @_command
    def set(
        self,
        *,
        units: str | None = None,
        outdir: str | Path | None = None,
        disk: str | None = None,
        dt: float | None = None,
        frac: float | None = None,
        gravity: tuple[float, float] | None = None,
        lsm: float | None = None,
        restitution: float | None = None,
        rolling: str | None = None,
        seed: int | None = None,
        gentry: float | None = None,
        thickness: float | None = None,
        wallside: str | None = None,
        print: int | None = None,
        save: int | None = None,
        ps: int | None = None,
        vtk: int | None = None,
        stepbar: int | None = None,
        energy: int | None = None,
        **others: int,
    ) -> None:
        """SET: change settings of the model. Omitted settings keep their values.

        Parameters
        ----------
        units, outdir : system of units of the input; output folder.
        disk : "on" (discs of unit thickness), "off" (spheres) or "hex".
        dt, frac : time step [s]; or instead a fraction of the critical time step.
        gravity : (gx, gy) [m/s2].
        lsm, restitution : damping as in the old manual; coefficient of restitution of contacts, 0 to 1.
        rolling : type of rolling resistance: "a" constant torque, "c" elastic-plastic spring and dashpot.
        seed, gentry : seed of the random positions; attempts of GEN per particle.
        thickness : thickness of the model across the plane, for stresses [m].
        wallside : "left" or "both": the active sides of walls.
        print, save, ps, vtk, stepbar, energy : intervals in steps of frames, checkpoints, vector pictures, .vtk files,
            progress lines and rows of the energy budget; 0 turns one off.
        others : intervals of outputs of added kinds.
        """
        given = {name: value for name, value in locals().items() if name not in ("self", "others")} | others
        for name, value in given.items():
            if value is None:
                continue
            if name == "outdir":
                self._write_into(value)
            else:
                dem.settings.set_option(self.engine, name, value)

    # ---- running ---------------------------------------------------------------------------------------------------

    @_command
    def cycle(self, n: int) -> None:
        """CYC: step the model; output is written at the intervals of `set`.

        Parameters
        ----------
        n : number of steps.
        """
        self._refuse_only_blocks()
        engine = self.engine
        dem.cycles.cycle(engine, int(n))

    @_command
    def imple(
        self,
        wall: int,
        xmove: float | None = None,
        ymove: float | None = None,
        *,
        print: float | None = None,
        save: float | None = None,
        ps: float | None = None,
        vtk: float | None = None,
        **others: float,
    ) -> None:
        """IMPLE: step until the wall has reached a displacement.

        Parameters
        ----------
        wall : id of the wall.
        xmove, ymove : displacement along x or along y [m]; give one of the two.
        print, save, ps, vtk : displacement of the wall between two frames, checkpoints, vector pictures, .vtk files [m]
            (default: only at the end).
        others : displacement between two outputs of an added kind [m].
        """
        self._refuse_only_blocks()
        engine = self.engine
        every = {"print": print, "save": save, "ps": ps, "vtk": vtk}
        every = {name: distance for name, distance in every.items() if distance is not None}
        dem.cycles.imple(engine, wall, xmove, ymove, **every, **others)

    def every(self, steps: int, function: Callable[[Simulation], object]) -> Call:
        """Call ``function(sim)`` after each step whose number is a multiple of `steps`, before output is written.

        The function may use all methods except those that step. If it returns True (on any rank), the present cycle
        ends with this step. A function that only reads the model does not change the results.
        """
        engine = self.engine
        from hpcdem.physics.dem.simulation import Watcher

        if int(steps) != steps or steps < 1:
            raise WrongValueError(*_place(), f"every: expected a number of steps of 1 or more, got {steps}")
        running = self._session.interpreter

        def call() -> object:
            return function(self)

        self._asked(("every", int(steps), function), lambda: None, again=True)
        watcher = Watcher(int(steps), call if running is None else running.function(call))
        engine.watchers.append(watcher)
        return Call(self, watcher)

    @_query
    def save(self, file: str | Path) -> None:
        """SAV, model save: write the complete state to a checkpoint: particles, blocks, or both if they are coupled."""
        if self._project is None:
            engine = self.engine
            dem.checkpoints.save(engine, self.directory / file)
            return
        if self._project.coupled is None and not self._only_blocks:
            raise CommandError(
                "particles and blocks that are not coupled cannot be saved in one file; call couple() first"
            )
        fdem.checkpoints.save(self._project, str(file))

    @_command
    def restore(self, file: str | Path) -> None:
        """RES, model restore: load the state of a checkpoint, written on any number of ranks: particles or blocks,
        which replace the present ones; both for coupled particles and blocks.
        """
        path = self._existing(file)
        kind = self._kind(path)
        if not kind:
            self._refuse_coupled("restore")
            engine = self.engine
            dem.checkpoints.restore(engine, path)
            return
        if kind == checkpoint.BOTH and (self._project is None or self._project.coupled is None):
            raise CommandError(f"{file} contains coupled particles and blocks: call couple() first, or use resume()")
        names = fdem.checkpoints.restore(self._made_project(), path)
        if names and self._log is not None:
            self._log.info(f"{file} contains names of a script, which programs cannot restore: {', '.join(names)}")

    @_command
    def resume(self, before: float | None = None) -> bool:
        """Load the newest complete checkpoint of `outdir` and finish the command that it interrupted: `cycle`, `imple`,
        `step` or `solve`. Return False without a checkpoint.

        before: load the last checkpoint at or before this model time [s]; UsageError if missing. Functions of `every`
        must be registered before. Particles that were coupled to blocks made before them are restored with these, and
        `coupling` is then available.
        """
        self._refuse_coupled("resume")
        latest = math.inf if before is None else before
        found = self._session.newest(self._folder, latest)
        if found is None or not self._kind(found):
            beside = self._session.newest(self._folder / "blocks")
            if beside is not None:
                raise CommandError(
                    f"{beside}: the blocks were created after the particles, so resume cannot decide which checkpoint "
                    "is newer. Create the blocks first, or rebuild both, couple() and restore(...)"
                )
            return self._resume_particles(latest)
        project = self._made_project()
        if not fdem.checkpoints.restore_newest(project, latest):
            return False
        if project.continues is not None:
            project.asleep = self.engine.number
            self._couple(project, None, 0.0)
        fdem.steps.resume(project)
        return True

    def _resume_particles(self, before: float) -> bool:
        from hpcdem.physics.dem import saved_state

        found = saved_state.restore_newest(self.engine, [self.engine.outdir], before)
        if found is None:
            return False
        self.engine.progress = found["progress"]
        engine = self.engine
        dem.cycles.resume(engine)
        return True

    def _kind(self, path: str) -> str:
        """Return the kind of a checkpoint, read by rank 0: "" for particles and for files that are no checkpoint."""
        comm, kind = self._session.comm, ""
        if comm.rank == 0:
            try:
                kind = str(checkpoint.read_state(path).get("kind", ""))
            except HpcdemError:  # the command that reads it says what is wrong
                pass
        return comm.bcast(kind)

    @_command
    def command(self, text: str) -> None:
        """Execute lines of the ZDEM language on this model."""
        name, line = _place()
        try:
            first = next(read_lines(text.encode("utf-8", errors="surrogatepass"), "command"), None)
            begins = first is not None and first.tokens[0].word[:3] in ("sta", "res", "loa")
            script = parse_text(text if begins else "RES model\n" + text, str(self.directory / "command"))
            interpreter = Interpreter(script)
            report_warnings(script, self.engine)
            for index in range(0 if begins else 1, len(script.statements)):
                interpreter.carry_out(self.engine, index)
        except ScriptError as error:
            raise ScriptError(name, line, f"command: {error.message}") from error
        finally:
            self.engine.script, self.engine.position = self._session.text, 0

    @_query
    def finish(self) -> None:
        """End the run: close histories, print the table of stages and draw the last frame. Without this call, the end
        of the program does it.
        """
        if self._project is not None and self._project in self._session.projects:
            self._session.leave(self._project)
        if self._engine is not None:
            dem.cycles.stop(self._engine)
            self._session.finish(self._engine)

    # ---- output of one moment --------------------------------------------------------------------------------------

    @_query
    def write_frame(self) -> None:
        """Write ``all_<step>.vtkhdf`` and ``.dat`` of the present state."""
        from hpcdem.commands.dem import output

        self._ready()
        output.Snapshot(self.engine).write_print()

    # ---- looking ---------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        """Particles of this rank."""
        return self._of_this_rank("len(...)", lambda: len(self.engine.particles))

    def __getitem__(self, name: str) -> np.ndarray:
        """A field of this rank's own particles (n,), read-only; valid until the next method that changes or steps.

        The names are those of `hpcdem.core.fields` (x y vx vy spin radius gid angle fx fy torque fix color group
        birth), of materials (density fric shear poiss damp kn ks hertz), mass, inertia, and clump: the id of the clump,
        which is that of its first member, -1 for particles of none. A member has a share of the mass of its clump.
        Physics bring more (`add_physics`).
        """
        return self._of_this_rank(f"['{name}']", lambda: self._field(name))

    def _field(self, name: str) -> np.ndarray:
        p, engine = self.engine.particles, self.engine
        if name == "group":
            values = np.array(engine.groups)[p["group"]]
        elif name in ("fx", "fy", "torque") and engine.closed:
            values = engine.lists.owned_forces()[:, ("fx", "fy", "torque").index(name)]
        elif name == "clump":
            values = p.clump.view()
        elif name in FIELDS or name in p.extra:
            values = p[name].view()
        elif name in MATERIAL_FIELDS:
            values = engine.materials.rows[name][p["material"]]
        elif name in ("mass", "inertia"):
            self._ready()
            values = engine.body[:, ("mass", "inertia").index(name)].view()
        else:
            fields = tuple(self._ipython_key_completions_())
            near = hint(name, fields)
            raise UnknownNameError(*_place(), f"there is no field '{name}'{near}; fields are {', '.join(fields)}")
        values.flags.writeable = False
        return values

    def _ipython_key_completions_(self) -> list[str]:
        return [*FIELDS, *MATERIAL_FIELDS, "mass", "inertia", "clump", *self.engine.particles.extra]

    def __setitem__(self, name: str, values: Any) -> None:
        """Set a field of this rank's own particles: ``sim["vx"] = 0.0``. Collective.

        A clump takes the velocity, spin and fixed directions that are given to its first member; the places, radii and
        angles of members cannot be set.
        """
        settable = (*SETTABLE, *self.engine.particles.extra)
        if name not in settable:
            near = hint(name, settable) if name not in self._ipython_key_completions_() else ""
            raise UnknownNameError(*_place(), f"field '{name}' cannot be set{near}; these can: {', '.join(settable)}")
        self._asked(("set field", name, values), lambda: self._set_field(name, values))
        self.engine.edited = True

    def _set_field(self, name: str, values: Any) -> None:
        engine = self.engine
        if name in ("x", "y", "radius"):
            engine.open_model()
        values = np.asarray(values)
        if name == "group":
            names = np.unique(np.concatenate([np.unique(v) for v in engine.comm.allgather(values.astype(str))]))
            number = {group: engine.group_number(str(group)) for group in names}
            values = np.array([number[group] for group in np.atleast_1d(values.astype(str))])
        elif name == "radius" and engine.comm.any(bool((values <= 0.0).any())):
            raise WrongValueError(*_place(), "radius must be positive")
        if engine.comm.any(values.dtype.kind == "f" and not bool(np.isfinite(values).all())):
            raise WrongValueError(*_place(), f"field '{name}' must be finite")
        p = engine.particles
        before = p[name].copy()
        try:
            p[name][:] = values
        except ValueError as error:
            raise WrongValueError(*_place(), f"field '{name}' has {len(p)} values on this rank: {error}") from error
        if engine.clumps and name in ("x", "y", "radius", "angle"):
            changed = bool((p[name] != before)[p.clump >= 0].any())
            if engine.comm.any(changed):
                p[name][:] = before
                raise ScriptError(*_place(), f"field '{name}' of members of a clump cannot be set")
        elif engine.clumps:
            p[name][:] = engine.clumps.of_first_members(p, p[name], engine.comm)
            if name in ("vx", "vy", "spin"):
                engine.clumps.set_motion(p, np.ones(len(p), bool), **{name: p[name].copy()})
        engine.check_soon()
        if name in ("radius", "fix"):
            engine.tables_changed()

    def gather(self, *names: str) -> Any:
        """Return fields of all particles, on every rank, in the order of ids: one array, or a tuple of arrays."""

        def gathered() -> Any:
            columns = [np.concatenate(self.engine.comm.allgather(np.array(self._field(name)))) for name in names]
            order = np.argsort(np.concatenate(self.engine.comm.allgather(np.array(self._field("gid")))))
            return columns[0][order] if len(columns) == 1 else tuple(c[order] for c in columns)

        return self._asked(("gather", names), gathered)

    @property
    def count(self) -> int:
        """Number of particles on all ranks."""
        return self._asked(("count",), lambda: int(self.engine.count(len(self.engine.particles))))

    @property
    def steps(self) -> int:
        """Present step of the particles; without particles, of the blocks."""
        return self._asked(("steps",), lambda: int(self._clock.step))

    @property
    def time(self) -> float:
        """Model time of the particles [s]; without particles, of the blocks."""
        return self._asked(("time",), lambda: float(self._clock.time))

    @property
    def dt(self) -> float:
        """Time step of the particles [s]; without particles, of the blocks; 0 before the first step."""
        return self._asked(("dt",), lambda: float(self._clock.dt))

    @property
    def rank(self) -> int:
        """Number of this rank, from 0."""
        return self._session.comm.rank

    @property
    def ranks(self) -> int:
        """Number of ranks."""
        return self._session.comm.size

    @property
    def outdir(self) -> Path:
        """Output folder of the particles; without particles, of the blocks."""
        first = self._engine or self._project
        return self._folder if first is None else first.outdir

    @property
    def particles(self) -> Particles:
        """Methods of discs."""
        return Particles(self)

    @property
    def walls(self) -> Walls:
        """Walls by id, and their methods; those of BOX have the ids 100 to 103 (bottom, right, top, left)."""
        return Walls(self)

    @property
    def bonds(self) -> Bonds:
        """Methods of bonds; ``sim.bonds()`` returns the table of all bonds."""
        return Bonds(self)

    def _walls(self) -> dict[int, Wall]:
        def rows() -> dict[int, tuple[Any, ...]]:
            w = self.engine.walls
            return {
                int(w.id[k]): (
                    _point(w.p1[k]), _point(w.p2[k]), _point(w.v[k]), float(w.kn[k]), float(w.ks[k]), float(w.fric[k])
                )
                for k in range(len(w))
            }  # fmt: skip

        return {name: Wall(*row) for name, row in self._asked(("walls",), rows).items()}

    @_query
    def energy(self) -> dict[str, float]:
        """Return the energy budget since the first cycle after ``set(energy=n)`` [J], by the names of the columns of
        energy.csv.
        """
        import dataclasses

        if self._only_blocks:
            raise CommandError("there are no particles; energies is the budget of blocks")
        if self.engine.energy is None or self.engine.energy.start is None:
            raise CommandError("no energy budget yet: call set(energy=n), then cycle(n)")
        return dataclasses.asdict(self.engine.energy.evaluate(self.engine))

    def contacts(self) -> dict[str, np.ndarray]:
        """Return the pairs in contact of the whole model, on every rank, in the order of ids: id1 id2, normal force fn
        and shear force fs [N], fx fy on id1 [N], contact point x y [m], overlap [m].
        """
        return self._table("contacts")

    def _bonds(self) -> dict[str, np.ndarray]:
        """Bonds of the whole model, as `contacts`, with kind, ebmod, gbmod, tstrength, sstrength."""
        return self._table("bonds")

    def wall_contacts(self) -> dict[str, np.ndarray]:
        """Return the contacts with walls: id1, wall (its id), fn fs [N], fx fy on the particle [N], x y [m], overlap
        [m].
        """
        return self._table("wall_contacts")

    @property
    def bonds_left(self) -> int:
        """Number of intact bonds."""
        return self._asked(("bonds_left",), lambda: int(self.engine.bonds_left()))

    @property
    def bonds_broken(self) -> tuple[int, int]:
        """Number of bonds broken so far, in tension and in shear."""
        return self._asked(("bonds_broken",), self.engine.broken)

    # ---- with blocks -----------------------------------------------------------------------------------------------

    def couple(self, friction: float | None = None, dt: float = 0.0) -> Coupling:
        """Couple the particles to the blocks, see `hpcdem.couple`: `step` and `solve` then step both."""

        def coupled() -> Coupling:
            if self._project is None:
                raise CommandError("no blocks yet: call mesh.create(...) and elements.model(...) first")
            return self._couple(self._project, friction, dt)

        made: Coupling = carried_out(_place(), "couple", coupled)
        return made

    def _couple(self, project: Project, friction: float | None, dt: float) -> Coupling:
        from hpcdem.commands.fdem import coupling

        self._session.prepare("coupled")
        self.coupling = Coupling(project, coupling.couple(project, self.engine, friction, dt))
        return self.coupling

    # ---- ours ------------------------------------------------------------------------------------------------------

    def _asked(self, key: tuple[Any, ...], make: Callable[[], Any], again: bool = False) -> Any:
        """Return the result of `make`. In a PCDC script the journal stores it, with a checksum of `key`, so that a
        resumed run can replay the script: until the checkpoint, restored particles do nothing and receive the recorded
        values. again: call `make` in any case.
        """
        running = self._session.interpreter
        if running is None:
            return make()
        if not running.keeps_calls:
            return running.query(make) if self.engine.coupled and not again else make()
        asleep = self._asleep and not again
        value = running.ask((self.engine.number, *key), make, None if asleep else make)
        if asleep and key[0] == "set" and "outdir" in key[2]:
            self._write_into(key[2]["outdir"])  # not part of the checkpoint
        return value

    @property
    def _asleep(self) -> bool:
        """Return whether these particles come from a checkpoint whose script is still being replayed."""
        running = self._session.interpreter
        return running is not None and running.replays and running.project.asleep == self.engine.number

    def _of_this_rank(self, what: str, make: Callable[[], Any]) -> Any:
        """Return the result of `make`, which depends on the number of ranks. Raises UsageError if a resumed run needs
        the result of the run before and cannot compute it again."""
        running = self._session.interpreter
        if running is None:
            return make()
        place = f"{_place()[0]}:{_place()[1]}: {what}"
        try:
            if not running.keeps_calls:
                if running.replays and self.engine.coupled:
                    raise UsageError("no answer")
                value = make()
            else:
                value = running.ask_alone((self.engine.number, what), make, not self._asleep)
        except UsageError as error:
            if not str(error).endswith("no answer"):
                raise
            raise UsageError(
                f"{place}: the checkpoint does not record the particles of a single rank, so --resume cannot execute "
                "this line. Use gather(...) or count, or start another script with pcdc model restore"
            ) from None
        self._seen_alone = self._seen_alone or place
        if self.engine.coupled:
            self._warn_of_answers()
        return value

    def _warn_of_answers(self) -> None:
        """Warn once that --resume may not reproduce values that this script requested."""
        running, log = self._session.interpreter, self.engine.log
        if self._seen_alone and self.ranks > 1 and log is not None and running.keeps and not running.replays:
            log.warn_once(
                "of this rank",
                f"{self._seen_alone} of particles coupled to blocks: --resume cannot execute this line; use "
                "gather(...) or count",
            )

    def _write_into(self, folder: str | Path) -> None:
        dem.settings.set_option(self.engine, "outdir", self.directory / folder)

    def _refuse_coupled(self, what: str) -> None:
        if self._engine is not None and self._engine.coupled:
            raise CommandError(f"{what} would replace particles that are coupled to blocks: call Coupling.end() first")

    def _refuse_only_blocks(self) -> None:
        if self._only_blocks:
            raise CommandError("no particles: step blocks with step and solve")

    def frame(self, of: str | None = None) -> Frame:
        """Return the present state of the model, on one rank: tables for pandas and xarray, pictures; a notebook shows
        it as a picture. of: "particles" or "blocks" (default: the existing kind; particles if both exist).
        """
        place, running = _place(), self._session.interpreter

        def make() -> Frame:
            if self.ranks > 1:
                raise CommandError(
                    "only available on one rank; on several ranks write frames and read them with hpcdem.frames()"
                )
            if running is not None and running.keeps_calls:
                raise CommandError("in a PCDC script use pcdc output image")
            kind = of or ("blocks" if self._only_blocks else "particles")
            if kind not in ("particles", "blocks"):
                raise CommandError(f"of: expected 'particles' or 'blocks', got {of!r}")
            if kind == "blocks" and self._project is None:
                raise CommandError("there are no blocks")
            return Frame(self._blocks_now() if kind == "blocks" else self._particles_now(), kind)

        return carried_out(place, "frame", make)

    def _particles_now(self) -> Moment:
        from hpcdem.physics.dem import diagnostics
        from hpcdem.post.view.moment import of_particles

        self._ready()
        return of_particles(diagnostics.frame(self.engine))

    def _blocks_now(self) -> Moment:
        from hpcdem.commands.fdem import frames
        from hpcdem.post.view.moment import of_blocks

        assert self._project is not None
        self._project.ready(use=False)
        state = frames.whole(self._project)
        assert state is not None  # on one rank
        return of_blocks(state)

    def __repr__(self) -> str:
        if self._engine is None and self._project is None:
            return "<Simulation: nothing yet>"
        clock = self._clock
        bodies = [] if self._engine is None else [f"{self._engine.count(len(self._engine.particles))} particles"]
        if self._project is not None and self._project.mesh is not None:
            bodies.append(f"{len(self._project.mesh.cells)} elements")
        return f"<Simulation: step {clock.step}, {clock.time:.6g} s, {', '.join(bodies)}>"

    def _repr_html_(self) -> str:
        """Return the line of `repr` and a picture of the model, for notebooks."""
        try:
            picture = self.frame().picture()
        except HpcdemError:  # nothing there yet, or several ranks
            picture = None
        return shown(repr(self)[1:-1], picture)

    def _repr_png_(self) -> bytes | None:
        try:
            return self.frame().picture()
        except HpcdemError:
            return None

    def _before_steps(self) -> None:
        if self._engine is not None and self._engine.watchers and self._only_blocks:
            raise CommandError("functions of every(...) need particles, and this model has none: cancel them")

    def _table(self, name: str) -> dict[str, np.ndarray]:
        from hpcdem.physics.dem import diagnostics

        def table() -> dict[str, np.ndarray]:
            self._ready()
            slab = diagnostics.frame(self.engine).tables[name].columns
            parts = self.engine.comm.allgather({key: np.asarray(values) for key, values in slab.items()})
            whole = {key: np.concatenate([part[key] for part in parts]) for key in slab}
            if name == "wall_contacts":
                w = self.engine.walls
                whole["wall"] = w.id[w.in_output_order()][whole["wall"]]
            return whole

        return self._asked((name,), table)

    def _ready(self) -> None:
        """Prepare lists, ghosts and masses for kernels that read contacts."""
        self.engine.close_model()

    def _existing(self, file: str | Path) -> str:
        """A file to read: in `directory`, then in data below it; searched for by rank 0."""
        comm = self._session.comm
        found = comm.bcast(find(self.directory, str(file)) if comm.rank == 0 else None)
        if found is None:
            raise CommandError(f"there is no file {self.directory / file}")
        return found


class Shared(Generic[Given, Returned]):
    """A method of the simulation under its name in a group."""

    def __init__(self, method: Callable[Concatenate[Simulation, Given], Returned]) -> None:
        self.method = method

    def __get__(self, group: Group | None, owner: type) -> Callable[Given, Returned]:
        """The method, bound to the simulation of the group."""
        method: Any = self.method
        return method if group is None else method.__get__(group._sim)


class Group:
    """Methods of a simulation that form a group."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim

    def __repr__(self) -> str:
        return f"<{type(self).__name__.lower()} of {self._sim!r}>"


class Particles(Group):
    """Discs, with methods named as those of blocks; `sim.ball` is `sim.particles.ball`."""

    ball = Shared(Simulation.ball)
    generate = Shared(Simulation.gen)
    grid = Shared(Simulation.gen_grid)
    row = Shared(Simulation.gline)
    load = Shared(Simulation.load)
    export = Shared(Simulation.export)
    delete = Shared(Simulation.delete)
    properties = Shared(Simulation.prop)
    fix = Shared(Simulation.fix)
    free = Shared(Simulation.free)
    clump = Shared(Simulation.clump)
    join = Shared(Simulation.join)
    clumps = Shared(Simulation.clumps)
    contacts = Shared(Simulation.contacts)
    gather = Shared(Simulation.gather)
    extents = Shared(Simulation.extents)
    history = Shared(Simulation.hist)

    @property
    def count(self) -> int:
        """Number of particles on all ranks."""
        return self._sim.count

    def __len__(self) -> int:
        return len(self._sim)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._sim[name]

    def __setitem__(self, name: str, values: Any) -> None:
        self._sim[name] = values

    def _ipython_key_completions_(self) -> list[str]:
        return self._sim._ipython_key_completions_()


class Bonds(Group):
    """Bonds between discs; calling it, `sim.bonds()`, returns their table."""

    create = Shared(Simulation.bond)
    cut = Shared(Simulation.break_bonds)
    table = Shared(Simulation._bonds)
    __call__ = Shared(Simulation._bonds)

    @property
    def left(self) -> int:
        """Number of intact bonds."""
        return self._sim.bonds_left

    @property
    def broken(self) -> tuple[int, int]:
        """Number of bonds broken so far, in tension and in shear."""
        return self._sim.bonds_broken


class Walls(Group, Mapping[int, Wall]):
    """The present walls by id; those of BOX have the ids 100 to 103 (bottom, right, top, left)."""

    create = Shared(Simulation.wall)
    box = Shared(Simulation.box)
    force = Shared(Simulation.wall_force)
    forces = Shared(Simulation.wall_forces)
    contacts = Shared(Simulation.wall_contacts)
    drive = Shared(Simulation.imple)

    def __getitem__(self, id: int) -> Wall:
        return self._sim._walls()[id]

    def __iter__(self) -> Iterator[int]:
        return iter(self._sim._walls())

    def __len__(self) -> int:
        return len(self._sim._walls())

    def items(self) -> ItemsView[int, Wall]:
        """Ids and walls, checked once."""
        return self._sim._walls().items()

    def values(self) -> ValuesView[Wall]:
        """The walls, checked once."""
        return self._sim._walls().values()

    def __repr__(self) -> str:
        return repr(self._sim._walls())


class Coupling:
    """Particles and the blocks of a PCDC script that are stepped together, see `couple`."""

    def __init__(self, project: Any, engine: Any) -> None:
        self._project, self.engine = project, engine

    @property
    def dt(self) -> float:
        """Time step of both [s]."""
        return self._asked("dt", lambda: float(self.engine.particles.clock.dt))

    def contacts(self) -> dict[str, np.ndarray]:
        """Return the contacts of particles with faces of elements, on every rank, in the order of ids and faces: id,
        face (element * 4 + edge), fn, fs [N], x, y [m], overlap [m], energy [J].
        """
        return self._asked("contacts", self.engine.contacts)

    def force(self) -> tuple[float, float]:
        """Return the sum of the forces of all particles on the blocks [N]."""
        return self._asked("force", self.engine.force_on_blocks)

    def energies(self) -> dict[str, float]:
        """Return the energy exchanged between particles and blocks [J], see docs/blocks.md; it accumulates while either
        has an energy budget.
        """
        return self._asked("energies", self.engine.energies)

    def end(self) -> None:
        """Decouple them: each may continue alone."""
        from hpcdem.commands.fdem import coupling

        if self._project.continues is not None:
            raise _parted("end")
        try:
            self._asked("end", lambda: coupling.release(self._project))
        except CommandError as error:
            raise ScriptError(*_place(), f"end: {error}") from error

    def _asked(self, key: str, make: Callable[[], Any]) -> Any:
        running = session.current().interpreter
        if running is None:
            return make()
        return running.ask(("coupling", key), make) if running.keeps_calls else running.query(make)


def _parted(what: str) -> UsageError:
    file, line = _place()
    return UsageError(
        f"{file}:{line}: {what}: the checkpoint does not contain particles that were decoupled before it, so --resume "
        "cannot execute this line. Start another script with pcdc model restore"
    )


def couple(particles: Simulation, friction: float | None = None, dt: float = 0.0) -> Coupling:
    """Couple these particles to the blocks of a PCDC script. `pcdc model step` and `pcdc model solve` then step both
    with one time step, `pcdc model save` writes both into one file, and `cycle` of the particles is rejected.

    The blocks must have their mesh and element models. friction: upper limit of the friction coefficient of contacts
    between the two; that of the particle applies if it is smaller. dt: time step [s] (default: that of `set(dt=...)` or
    `pcdc model time-step`, else the smaller stable one).
    """
    place = _place()
    try:
        if not isinstance(particles, Simulation):
            raise CommandError(f"expected an hpcdem.Simulation, got {particles!r}")
        running, projects = session.current().interpreter, session.current().projects
        if not projects:
            raise CommandError("no blocks: couple is for PCDC scripts; programs use Simulation.couple")

        def both() -> Coupling:
            return particles._couple(projects[-1], friction, dt)

        if running is None or not running.keeps_calls:
            return both()
        made: list[Coupling] = []

        def again() -> None:
            if projects[-1].continues is None or projects[-1].asleep != particles.engine.number:
                raise _parted("couple")
            made.append(both())

        key = "couple", particles.engine.number, friction, dt
        running.ask(key, lambda: made.append(both()), again, fails_again=True)
        particles._warn_of_answers()
        return made[0]
    except CommandError as error:
        raise ScriptError(*place, f"couple: {error}") from error
    except TypeError as error:
        raise ScriptError(*place, f"couple: {error}; see help(hpcdem.couple)") from error


def _point(values: Any) -> Point:
    return float(values[0]), float(values[1])
