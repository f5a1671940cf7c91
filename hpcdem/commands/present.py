"""The present state as a frame by itself, for pages that show a model while commands are typed.

It lies in a folder of its own within that of the results, and always is the only one there.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hpcdem.commands.dem import output
from hpcdem.commands.fdem import Project
from hpcdem.commands.fdem import frames as mesh_frames
from hpcdem.core.errors import CommandError
from hpcdem.io.frames import frame_name
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import write_mesh_frame
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.runtime import run_folder


def particles(sim: Simulation) -> Path | None:
    """Write `now/all_<step>.vtkhdf` of particles. Return its path, None without particles. Collective, for one rank."""
    if not len(sim.particles.hot[sim.particles.owned]):
        return None
    sim.close_model()
    output.settle(sim)
    path = output.folder(sim) / run_folder.PRESENT / frame_name(sim.clock.step, ".vtkhdf")
    return _alone(path, lambda: write_vtkhdf(path, diagnostics.frame(sim), sim.comm))


def blocks(project: Project) -> Path | None:
    """Write `now/now_<step>.vtkhdf` of blocks, also before they have models, and return its path; None without a mesh.
    Collective, for one rank.
    """
    try:
        project.ready(use=False)
    except CommandError:
        return None
    mesh_frames.settle(project)
    path = project.folder() / run_folder.PRESENT / f"{run_folder.PRESENT}_{project.step:010d}.vtkhdf"
    return _alone(path, lambda: write_mesh_frame(path, mesh_frames.frame(project), project.comm))


def _alone(path: Path, write: Callable[[], None]) -> Path:
    """Write a frame, and remove those of other steps."""
    path.parent.mkdir(exist_ok=True)
    write()
    for other in path.parent.glob("*.vtkhdf"):
        if other != path:
            other.unlink(missing_ok=True)
    return path
