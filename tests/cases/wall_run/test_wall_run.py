"""V24: runs along the way of a wall: numbers of steps, files and their names, and a ball in free flight meanwhile.

A wall of speed 2 m/s with dt = 0.05 s goes 0.1 m per step: 3000 m are 30 000 steps, output every 1000 m is every 10
000 steps, counted from the start of IMPLE. Free flight: x = x0 + v n dt. Files (ZDEM manual 6.3.2): the step in ten
digits; `_ini` at the start of each CYC and IMPLE; one at the end of IMPLE; CYC writes at steps that are multiples
of the interval, counted from 0.
"""

from __future__ import annotations

import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings, walls
from hpcdem.core.errors import CommandError
from hpcdem.io.frames import list_frames, read_frame
from tests.support import model, position, value


def flight(folder):
    """A ball that flies through the plane and a wall that moves to the right."""
    sim = model(folder / "data", dt=0.05)
    particles.ball(sim, 7, 100.0, 5000.0, 60.0)
    properties.prop(sim, density=2500.0, xv=3.0, yv=-1.25)
    walls.wall(sim, 4, ((0.0, 0.0), (0.0, 100.0)), xv=2.0)
    return sim


def names(folder, suffix: str) -> list[str]:
    """Files with this suffix in the output folder."""
    return sorted(p.name for p in (folder / "data").iterdir() if p.name.endswith(suffix))


def stems(*steps: int, ini: tuple[int, ...] = (), suffix: str = ".dat") -> list[str]:
    """Expected names of frames."""
    return sorted([f"all_{s:010d}{suffix}" for s in steps] + [f"all_{s:010d}_ini{suffix}" for s in ini])


def test_v24_a_wall_moves_3000_m(tmp_path):
    sim = flight(tmp_path)
    cycles.imple(sim, 4, xmove=3000.0, print=1000.0)
    assert sim.clock.step == 30000 and sim.clock.time == pytest.approx(1500.0, rel=1e-12)
    for suffix in (".dat", ".vtkhdf"):
        assert names(tmp_path, suffix) == stems(10000, 20000, 30000, ini=(0,), suffix=suffix)
    assert not names(tmp_path, ".tmp") and not names(tmp_path, ".sav") and not names(tmp_path, ".vtk")
    assert sim.walls.p1[0] == pytest.approx([3000.0, 0.0], abs=1e-8)
    assert position(sim, 7) == pytest.approx([100.0 + 3.0 * 1500.0, 5000.0 - 1.25 * 1500.0], abs=1e-8)
    assert (value(sim, "vx", 7), value(sim, "vy", 7)) == (3.0, -1.25)
    for file in list_frames(tmp_path / "data"):
        for path in (file.path, file.path.with_suffix(".dat")):
            frame = read_frame(path)
            t = 0.05 * file.step
            assert frame.step == file.step and frame.time == pytest.approx(t, abs=1e-8)
            assert frame.tables["particles"].columns["x"] == pytest.approx([100.0 + 3.0 * t], rel=1e-11)
            assert frame.walls["p1"][0] == pytest.approx([2.0 * t, 0.0], abs=1e-6)


def test_displacement_of_a_wall_counts_from_the_start_of_the_command(tmp_path):
    """CYC 7 printing every 5 steps, then IMPLE over 3 m (30 steps) printing and saving every metre."""
    sim = flight(tmp_path)
    settings.set_option(sim, "print", 5)
    cycles.cycle(sim, 7)
    cycles.imple(sim, 4, xmove=3.0, print=1.0, save=1.5, vtk=3.0, ps=2.0)
    cycles.cycle(sim, 8)
    assert names(tmp_path, ".dat") == stems(5, 17, 27, 37, 40, 45, ini=(0, 7, 37))
    assert names(tmp_path, ".sav") == ["0000000022.sav", "0000000037.sav"]
    assert names(tmp_path, ".vtk") == ["all_0000000037.vtk", "wall_0000000037.vtk"]
    assert names(tmp_path, ".ps") == ["all_0000000027.ps"]


def test_v24_the_manuals_list_of_ini_files(tmp_path):
    """Six commands of the lengths in the manual's example, a thousandth of it."""
    sim = flight(tmp_path)
    cycles.cycle(sim, 0)
    cycles.imple(sim, 4, xmove=0.5)
    cycles.cycle(sim, 1)
    cycles.imple(sim, 4, xmove=3.0)
    cycles.cycle(sim, 20)
    cycles.imple(sim, 4, xmove=0.2)
    assert names(tmp_path, "_ini.dat") == stems(ini=(0, 5, 6, 36, 56))
    assert names(tmp_path, ".dat") == stems(5, 36, 58, ini=(0, 5, 6, 36, 56))


def test_frames_of_a_step_are_written_anew_when_the_model_was_changed(tmp_path):
    """By the next command, if the one before has made no step."""
    sim = flight(tmp_path)
    cycles.imple(sim, 4, xmove=0.0)
    properties.prop(sim, xv=-7.0)
    cycles.imple(sim, 4, xmove=0.0)
    assert names(tmp_path, ".dat") == stems(0, ini=(0,))
    for path in (tmp_path / "data").glob("all_*"):
        assert read_frame(path).tables["particles"].columns["vx"] == [-7.0]


@pytest.mark.parametrize(("way", "steps"), [(0.1, 1), (0.14, 1), (0.16, 2), (0.7, 7), (0.04, 0), (1e-9, 0)])
def test_the_number_of_steps_is_the_nearest_one(tmp_path, way, steps):
    sim = flight(tmp_path)
    cycles.imple(sim, 4, xmove=way)
    assert sim.clock.step == steps


def test_the_displacement_is_taken_as_positive(tmp_path):
    """Also up and down, and against the sign of the velocity."""
    sim = flight(tmp_path)
    cycles.imple(sim, 4, xmove=-1.0)
    assert sim.clock.step == 10 and sim.walls.p1[0] == pytest.approx([1.0, 0.0])
    walls.wall(sim, 4, xv=0.0, yv=-4.0)
    cycles.imple(sim, 4, ymove=2.0)
    assert sim.clock.step == 20 and sim.walls.p2[0] == pytest.approx([1.0, 98.0])


def test_a_wall_at_rest_is_an_error(tmp_path):
    sim = flight(tmp_path)
    with pytest.raises(CommandError, match="wall 4 does not move"):
        cycles.imple(sim, 4, ymove=1.0)
    with pytest.raises(CommandError, match="no wall with id 5"):
        cycles.imple(sim, 5, xmove=1.0)
