"""A tiny script of blocks that calls every kernel once, so that they are compiled before anyone waits for them."""

from __future__ import annotations

import numpy as np

from hpcdem.commands.fdem import assigning, frames, meshing, modelling, running
from hpcdem.commands.fdem.project import Project
from hpcdem.decomp import strips
from hpcdem.halo.comm import SerialComm
from hpcdem.physics.fdem import rehearsal, saving
from hpcdem.physics.fdem.groups import OnLayer
from hpcdem.physics.fdem.model import Blocks


def rehearse(threads: int = 1) -> None:
    """Call the kernels of a run with this many threads per rank. Writes nothing."""
    rehearsal.rehearse(threads)
    project = Project(Blocks(SerialComm(), threads))
    project.cracks_filed = 0  # no file is begun for them
    meshing.rectangle(project, (0.0, 0.0), (2.0, 1.0), (2, 1))
    assigning.element_model(project, "mech_iso_elastic", rehearsal.ROCK)
    running.step(project, 2)
    assigning.joint_model(project, "classic_intrinsic_cohesive_interface", rehearsal.JOINT)
    modelling.option(project, energy=True)
    assigning.velocity(project, 0.0, 0.0, where=(OnLayer("left"),))
    running.step(project, 2)
    frames.whole(project)
    saving.tables(project.blocks)
    strips.strays(np.zeros(2, np.int64), np.array([-1, 0, 1]), 0)  # with several ranks only
