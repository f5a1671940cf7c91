"""A tiny script of blocks that calls every kernel once, so that they are compiled before anyone waits for them."""

from __future__ import annotations

from hpcdem.commands.fdem import assignments, frames, meshes, settings, steps
from hpcdem.commands.fdem.project import Project
from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import saved_state
from hpcdem.physics.fdem import warm_up as physics
from hpcdem.physics.fdem.groups import OnLayer
from hpcdem.physics.fdem.simulation import Blocks


def warm_up(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    physics.warm_up(threads)
    project = Project(Blocks(SerialComm(), threads))
    project.cracks_filed = 0  # no file is begun for them
    meshes.grid(project, (0.0, 0.0), (2.0, 1.0), (2, 1))
    assignments.element_model(project, "mech_iso_elastic", physics.ROCK)
    steps.step(project, 2)
    assignments.joint_model(project, "classic_intrinsic_cohesive_interface", physics.JOINT)
    settings.option(project, energy=True)
    assignments.velocity(project, 0.0, 0.0, where=(OnLayer("left"),))
    steps.step(project, 2)
    frames.whole(project)
    saved_state.tables(project.blocks)
