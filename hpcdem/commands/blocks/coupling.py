"""Particles beside the blocks of a script: hpcdem.couple, and what `model step` and `model solve` then do.

Whatever is about particles is imported where they are there: a script of blocks alone does without their kernels, and
numba keeps a kernel in the folder of those with which it was imported (see runtime/warmup.py).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcdem.blocks import saving
from hpcdem.commands.blocks.project import Project
from hpcdem.errors import CommandError

if TYPE_CHECKING:
    from hpcdem.coupled import Coupled
    from hpcdem.simulation import Simulation


def couple(project: Project, particles: Simulation, friction: float | None = None, dt: float = 0.0) -> Coupled:
    """From now on both are stepped together. friction: largest one between discs and faces; dt [s]: time step of both,
    0: as said for one of them, else the smaller of the stable ones. Collective."""
    from hpcdem.commands import running
    from hpcdem.coupled import Coupled

    if project.coupled is not None:
        raise CommandError("the blocks of this script are coupled to particles already")
    if Path(particles.outdir).resolve() == Path(project.outdir).resolve():
        raise CommandError(
            f"particles and blocks would both write into {project.outdir}: give the particles a folder of their own, "
            'hpcdem.Simulation(outdir="...")'
        )
    if dt < 0.0:
        raise CommandError(f"the time step must be positive, got {dt:g}")
    if particles.watchers:
        raise CommandError(
            f"{len(particles.watchers)} function(s) wait for steps of the particles (every): they are not called while "
            "both are stepped; cancel them, and look between two 'pcdc model step'"
        )
    blocks = project.ready()
    running.prepare(particles, dt_known=particles.settings.dt == 0.0)
    both = Coupled(particles, blocks, friction)
    try:
        both.settle_time_step(dt)
        if project.continues is None:
            both.prepare()
    except CommandError:
        both.release()
        raise
    project.coupled = both
    return both


def advance(project: Project, steps: int) -> int:
    """Up to `steps` steps of the blocks, and of the particles with them; what the outside asked for. Collective."""
    both = project.coupled
    if both is None:
        return project.blocks.advance(steps)
    from hpcdem.budget import Budget

    take_up(project)
    sim, settings = both.particles, both.particles.settings
    intervals = [every for every in (settings.print, settings.energy) if every > 0]
    if settings.energy > 0 and sim.energy is None:
        sim.energy = Budget()
    both.prepare()
    if sim.energy is not None and not sim.energy.running:
        sim.energy.begin(sim)
    last, request = sim.clock.step + steps, 0
    while sim.clock.step < last and not request:
        due = min([last, *(every * (sim.clock.step // every + 1) for every in intervals)])
        request = both.advance(due - sim.clock.step)
        _write(sim)
    if sim.energy is not None:
        sim.energy.pause(sim)
    return request


def _write(sim: Simulation) -> None:
    """What is due of the particles at this step; frames behind the back of the run, see frames.py."""
    from hpcdem import output

    step, settings = sim.clock.step, sim.settings
    if settings.print > 0 and step % settings.print == 0:
        output.Snapshot(sim, waits=False).write_print()
    if settings.energy > 0 and step % settings.energy == 0:
        output.write_energy(sim)


def take_up(project: Project) -> None:
    """A run that goes on from a checkpoint: both as they were when it was written."""
    if project.coupled is not None and project.continues is not None:
        project.coupled.restore(project.continues)
        project.continues = None


def release(project: Project) -> None:
    """Part them."""
    if project.coupled is not None:
        project.coupled.release()
    project.coupled = None


def save(project: Project, path: Path, extra: dict[str, Any]) -> None:
    """Write all that is stepped together. Collective."""
    if project.coupled is not None:
        take_up(project)
        project.coupled.save(path, extra)
    else:
        project.blocks.save(path, extra)


def restore(project: Project, path: Path, begins: bool) -> dict[str, Any]:
    """Take the state of a file; begins: the script has still to run, particles are taken when it steps first after
    hpcdem.couple. Collective."""
    if project.coupled is not None:
        return project.coupled.restore(path)
    if not begins:
        return project.blocks.restore(path)
    found = saving.restore_part(project.blocks, path)
    if found is None:
        return project.blocks.restore(path)
    project.continues = path
    return found
