"""Particles beside the blocks of a script: hpcdem.couple, and what `model step` and `model solve` then do.

Modules about particles are imported where there are particles: a script of blocks alone does without their kernels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.outputs import OUTPUTS
from hpcdem.core.units import CHOICES
from hpcdem.physics.fdem import convergence
from hpcdem.physics.fdem import saved_state as of_blocks

if TYPE_CHECKING:
    from hpcdem.physics.coupling.model import Coupled
    from hpcdem.physics.dem.simulation import Simulation


def couple(project: Project, particles: Simulation, friction: float | None = None, dt: float = 0.0) -> Coupled:
    """Couple particles and blocks, which are then stepped together. friction: largest coefficient between discs and
    faces; dt: time step of both [s]; 0: the time step assigned to either, else the smaller stable one. Collective.
    """
    from hpcdem.commands.dem import cycles
    from hpcdem.physics.coupling.model import Coupled

    if project.dim == 3:
        raise CommandError("discs move in a plane and cannot be coupled to blocks in three dimensions")
    if project.coupled is not None:
        raise CommandError("the blocks of this script are coupled to particles already")
    if Path(particles.outdir).resolve() == Path(project.outdir).resolve():
        raise CommandError(
            f"particles and blocks would both write into {project.outdir}: give the particles another folder, "
            'hpcdem.Simulation(outdir="...")'
        )
    if project.units != particles.settings.units and project.units and particles.settings.units:
        raise CommandError(
            f"the units of the blocks are {CHOICES[project.units]}, those of the particles "
            f"{CHOICES[particles.settings.units]}"
        )
    if dt < 0.0:
        raise CommandError(f"the time step must be positive, got {dt:g}")
    project.refuse_inside("couple")
    blocks = project.ready()
    if blocks.creep.on:
        raise CommandError("coupled blocks cannot creep: use model creep off")
    if project.continues is not None and particles.number == project.asleep:
        project.coupled = Coupled(particles, blocks, friction)  # both come out of the checkpoint, see take_up
        return project.coupled
    cycles.prepare(particles, dt_known=particles.settings.dt == 0.0)
    both = Coupled(particles, blocks, friction)
    try:
        both.settle_time_step(dt or _by_frac(both))
        if project.continues is None:
            both.prepare()
    except CommandError:
        both.release()
        raise
    project.coupled = both
    return both


def _by_frac(both: Coupled) -> float:
    """The time step [s] that SET frac of the particles asks for, if that is stable for all; 0 without SET frac."""
    from hpcdem.commands.dem import cycles

    particles, assigned = both.particles, both.blocks.options.dt
    if particles.settings.frac <= 0.0:
        return 0.0
    wanted = cycles.time_step(particles)
    if assigned > wanted:
        raise CommandError(
            f"the time steps differ: SET frac {particles.settings.frac:g} gives {wanted:g} s for the particles, model "
            f"time-step is {assigned:g} s; set only one of them"
        )
    return assigned or min(wanted, both.stable_time_step())


def _warn(both: Coupled) -> None:
    """Warn once about each setting that is made for one of the two models and may be meant for both."""
    sim, options = both.particles, both.blocks.options
    if sim.log is None:
        return
    of_particles, of_blocks = (sim.settings.gx, sim.settings.gy), (options.gx, options.gy)
    if of_particles != of_blocks:
        sim.log.warn_once(
            f"gravity {of_particles} {of_blocks}",
            f"gravity differs: SET gravity {of_particles[0]:g} {of_particles[1]:g} acts on the particles, model "
            f"gravity ({of_blocks[0]:g},{of_blocks[1]:g}) on the blocks; set both",
        )
    if not options.collision:
        sim.log.warn_once(
            "collision off",
            "model option collision off: blocks do not interact with each other, only with particles",
        )


def _warn_of_walls(both: Coupled) -> None:
    """Warn once per wall about a block that is in or behind a wall, which holds particles only. Collective."""
    from hpcdem.physics.coupling.beyond import beyond

    log = both.particles.log
    for wall, element, x, y in beyond(both):
        if log is not None:
            walls = both.particles.walls
            side = walls.side_of(walls.find(wall) or 0)
            name = f"the {side} side of the BOX" if side else f"wall {wall}"
            log.warn_once(
                f"beyond {wall}",
                f"step {both.blocks.clock.step}: element {element} at ({x:g}, {y:g}) is in or beyond {name}, and walls "
                "and BOX stop particles only. Fix blocks by conditions of their nodes, or replace the wall by a fixed "
                "body",
            )


# ---- while both are stepped ----------------------------------------------------------------------------------------


@contextmanager
def stepping(project: Project, name: str, steps: int | None) -> Iterator[None]:
    """Wrap a command that steps: write and log what a run of particles writes and logs at its beginning and end. steps:
    None if their number is unknown. Does nothing without particles. Collective.
    """
    both = project.coupled
    if both is None:
        yield
        return
    from hpcdem.commands.dem import cycles, output

    sim = both.particles
    both.heed_time_step(partial(_by_frac, both))
    both.prepare()
    if sim.progress is None:  # else the command resumes from a checkpoint
        intervals = {kind: int(getattr(sim.settings, kind)) for kind in OUTPUTS}
        cycles.start(sim, f"model {name}", steps, 0, intervals, initial_frame=sim.edited)
        sim.edited = False
    elif sim.energy is not None and not sim.energy.running:
        sim.energy.begin(sim)
    progress = sim.progress
    assert progress is not None
    project.due = cycles.Due(sim, None, partial(_warn_of_walls, both))
    late = both.late
    _warn(both)
    _warn_of_walls(both)
    if sim.log is not None:
        total = 0 if progress["last"] is None else progress["last"] - sim.clock.step
        sim.log.command_started(progress["name"], project.line, total, sim.clock.step, beside=True)
    try:
        yield
        project.due.finish()
    except PhysicsError:
        output.write_crash_frame(sim)
        raise
    finally:
        output.wait_for_disk()
        sim.progress = project.due = None
        sim.edited = False  # frames show what functions did in the middle of the command
        if sim.log is not None:
            sim.log.command_finished()
    if sim.energy is not None:
        sim.energy.pause(sim)
    if both.late > late and sim.log is not None:
        sim.log.warn(
            f"{both.late - late} times particles or faces moved too fast for the contact search, so a contact may have "
            "started a few steps late. Reduce the time step"
        )


def advance(project: Project, steps: int) -> int:
    """Take up to `steps` steps of the blocks and their particles. Return the external request. Due output of the
    particles is written; if one of their functions ends the command, project.progress["done"] is set. Collective.
    """
    both, due = project.coupled, project.due
    if both is None or due is None:
        return convergence.advance(project.blocks, steps)
    sim = both.particles
    assert project.progress is not None and sim.progress is not None
    last, request = sim.clock.step + steps, 0
    while sim.clock.step < last and not request and not project.progress.get("done"):
        request = both.advance(min(last, due.next()) - sim.clock.step)
        due.serve()
        if sim.progress["last"] == sim.clock.step:
            project.progress["done"] = True
    return request


def next_checkpoint(project: Project) -> float:
    """Return the step of the blocks at which SET save of the particles requires the next checkpoint of both."""
    every = _save_interval(project)
    if not every:
        return math.inf
    assert project.coupled is not None
    return project.step + every - project.coupled.particles.clock.step % every


def checkpoint_is_due(project: Project) -> bool:
    """Return whether SET save of the particles requires a checkpoint at this step."""
    every = _save_interval(project)
    return bool(every) and project.coupled is not None and project.coupled.particles.clock.step % every == 0


def _save_interval(project: Project) -> int:
    both = project.coupled
    return both.particles.progress["intervals"]["save"] if both is not None and both.particles.progress else 0


def refuse(project: Project, what: str) -> None:
    """Raise CommandError for a command that blocks coupled to particles do not support."""
    if project.coupled is not None:
        raise CommandError(
            f"{what} would step these blocks without the particles coupled to them: use model step or model solve"
        )


def take_up(project: Project) -> None:
    """Restore particles and blocks from the checkpoint of the run that is resumed, inside the interrupted command."""
    both = project.coupled
    if both is not None and project.continues is not None:
        from hpcdem.physics.coupling import saved_state

        run = saved_state.restore(both, project.continues).get("run", {})
        # Between two commands they may have been edited; files of versions before do not tell.
        both.particles.edited, both.particles.resumed = bool(run.get("edited")), True
        project.continues = None


def release(project: Project) -> None:
    """Decouple particles and blocks."""
    project.refuse_inside("end")
    if project.coupled is not None:
        project.coupled.release()
    project.coupled = None


def save(project: Project, path: Path, extra: dict[str, Any]) -> None:
    """Write the state of blocks and of the particles coupled to them. Collective."""
    if project.coupled is not None:
        from hpcdem.commands.dem import output
        from hpcdem.physics.coupling import saved_state

        take_up(project)
        output.secure_series(project.coupled.particles)
        saved_state.save(project.coupled, path, extra)
    else:
        of_blocks.save(project.blocks, path, extra)


def restore(project: Project, path: Path, begins: bool) -> dict[str, Any]:
    """Load the state of a file. begins: the script still has to run; particles are restored at its first step after
    hpcdem.couple. Collective.
    """
    if project.coupled is not None:
        from hpcdem.physics.coupling import saved_state

        of_both = saved_state.restore(project.coupled, path)
        sim = project.coupled.particles
        sim.progress = None  # the command in which it was written is not taken up
        if sim.energy is not None and sim.energy.running:
            sim.energy.pause(sim)
        return of_both
    if not begins:
        return of_blocks.restore(project.blocks, path)
    found = of_blocks.restore_part(project.blocks, path)
    if found is None:
        return of_blocks.restore(project.blocks, path)
    project.continues = path
    return found
