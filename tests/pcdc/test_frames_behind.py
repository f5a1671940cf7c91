"""Frames of blocks that are written while the run goes on are those of a run that waits for them."""

from __future__ import annotations

import threading

import pytest

from hpcdem.commands.fdem import assignments, checkpoints, frames, meshes, steps
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import HpcdemError
from hpcdem.io.behind import under_way
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import ROCK

EVERY, STEPS = 7, 63


def plate(folder) -> Project:
    """In motion, so that every frame is another one."""
    project = Project(Blocks(outdir=folder / "data"), folder, folder / "data")
    meshes.grid(project, (0.0, 0.0), (1.2, 0.6), (6, 3))
    assignments.element_model(project, "mech_iso_elastic", ROCK)
    changes.set_velocity(project.blocks, None, vx=1.0, vy=-2.0)
    return project


def test_the_bytes_are_those_of_frames_written_at_once(tmp_path):
    behind, waiting = plate(tmp_path / "behind"), plate(tmp_path / "waiting")
    gate = threading.Event()
    under_way.put(lambda: gate.wait(60))  # nothing reaches the disk before the next frame is due
    threading.Timer(0.5, gate.set).start()
    frames.vtk(behind, "a", EVERY)
    frames.vtk(behind, "b", 3 * EVERY)
    steps.step(behind, STEPS)
    for k in range(0, STEPS + 1, EVERY):
        frames.vtk(waiting, "a")
        if k % (3 * EVERY) == 0:
            frames.vtk(waiting, "b")
        if k < STEPS:
            steps.step(waiting, EVERY)
    files = sorted((tmp_path / "waiting" / "data").glob("*.vtkhdf"))
    assert len(files) == 10 + 4  # steps 0, 7, ... 63, and 0, 21, 42, 63
    assert [path.name for path in files] == sorted(p.name for p in (tmp_path / "behind" / "data").glob("*.vtkhdf"))
    for path in files:
        assert path.read_bytes() == (tmp_path / "behind" / "data" / path.name).read_bytes(), path.name


def test_a_frame_that_cannot_be_written_stops_the_run(tmp_path):
    project = plate(tmp_path)
    frames.vtk(project, "a", EVERY)
    (tmp_path / "data" / "a_0000000014.vtkhdf").mkdir(parents=True)
    with pytest.raises(HpcdemError, match=r"cannot write .*a_0000000014\.vtkhdf"):
        steps.step(project, STEPS)
    assert project.step == 21  # the next step with frames
    assert not list((tmp_path / "data").glob("*.tmp"))
    frames.vtk(project, "a", off=True)
    steps.step(project, 5)  # once told, it is over


def test_a_checkpoint_waits_for_frames(tmp_path):
    project = plate(tmp_path)
    frames.vtk(project, "a", EVERY)
    (tmp_path / "data" / "a_0000000063.vtkhdf").mkdir(parents=True)
    with pytest.raises(HpcdemError, match="cannot write"):
        steps.step(project, STEPS)
    under_way.entrust(lambda: (_ for _ in ()).throw(HpcdemError("cannot write it")))
    with pytest.raises(HpcdemError, match="cannot write it"):
        checkpoints.save(project, "middle.sav")
    assert not (tmp_path / "middle.sav").exists()
