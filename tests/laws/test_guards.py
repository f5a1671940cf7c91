"""What is said of contacts that overlap too far and of particles that leave the BOX."""

from __future__ import annotations

import io

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings, walls
from hpcdem.core.errors import PhysicsError
from hpcdem.engine import rebuild
from hpcdem.physics.dem import diagnostics, reach
from hpcdem.runtime.progress import Log
from hpcdem.session import report_end
from tests.support import model, only


def crowd(folder, depths, dt: float = 1e-6):
    """Pairs of discs of radius 1 and 2 far apart, pushed into each other by these depths [m]; ids 2 k and 2 k + 1."""
    sim = model(folder, dt)
    said = io.StringIO()
    sim.log = Log(stream=said)
    for k, depth in enumerate(depths):
        particles.ball(sim, 2 * k, 10.0 * k, 5.0, 1.0)
        particles.ball(sim, 2 * k + 1, 10.0 * k, 8.0 - depth, 2.0)
    properties.prop(sim, density=1000.0, kn=2.0, damp=0.1)
    settings.set_option(sim, "stepbar", 5)
    return sim, said


def test_deep_overlaps_are_named_once_per_command(tmp_path):
    sim, said = crowd(tmp_path, [0.4, 0.6, 0.9])
    sim.open_model()
    assert sim.remove(np.zeros(6, bool)) == 0
    walls.wall(sim, 7, ((-0.3, -9.0), (-0.3, 19.0)), kn=2.0)
    cycles.cycle(sim, 20)
    text = said.getvalue()
    assert text.count("overlap by more than half") == 1 and "step 5: 4 contacts" in text
    assert "particles 4 and 5 at (20, 5.55) by 0.90 of it (0.9 m; density 1000, damp 0.1, kn 2)" in text
    worst, number = diagnostics.overlaps_beyond(sim, 0.5, 10)
    assert number == 4 and [(o.id1, o.id2, o.wall) for o in worst] == [
        (4, 5, False), (1, 7, True), (0, 7, True), (2, 3, False),
    ]  # fmt: skip
    cycles.cycle(sim, 20)
    assert said.getvalue().count("overlap by more than half") == 2
    assert diagnostics.survey(sim).deepest == pytest.approx(0.9, abs=1e-6)


def test_one_line_names_the_deepest_and_counts_all(tmp_path):
    sim, said = crowd(tmp_path, [0.6 + 0.01 * k for k in range(13)])
    cycles.cycle(sim, 5)
    lines = [line for line in said.getvalue().splitlines() if "overlap" in line]
    assert len(lines) == 1 and "13 contacts overlap" in lines[0] and "particles 24 and 25" in lines[0]


def test_nothing_is_reported_of_usual_overlaps(tmp_path):
    sim, said = crowd(tmp_path, [0.01, 0.49])
    cycles.cycle(sim, 20)
    assert "overlap" not in said.getvalue()


def test_who_left_the_box(tmp_path):
    """Id, place, velocity; ten names, the number of all; and all of them again at the end."""
    sim, said = crowd(tmp_path, [], dt=1e-3)
    walls.box(sim, -10.0, 10.0, -5.0, 100.0)
    for gid in range(14):
        particles.ball(sim, gid, 9.0, 5.0 * gid, 1.0)
    properties.prop(sim, density=1000.0)
    for gid in range(13):
        properties.prop(sim, only(gid), xv=100.0, yv=1.0)
    cycles.cycle(sim, 100)
    text = said.getvalue()
    assert "13 particles left the BOX and were deleted: 0 at (1" in text and "velocity (100, 1)" in text
    assert "; 9 at (" in text and "; 10 at (" not in text and "and 3 more" in text
    report_end(sim)
    assert "13 particles in total left the BOX and were deleted" in said.getvalue() and sim.lost == 13


@pytest.mark.parametrize("speed", [400.0, 600.0])
def test_who_runs_away_through_the_box_between_two_checks_stops_the_run(tmp_path, speed):
    """Five steps of 0.4 and of 0.6 of the radius, then a command opens the model."""
    sim, said = crowd(tmp_path, [], dt=1e-3)
    walls.box(sim, -10.0, 10.0, -5.0, 100.0)
    particles.ball(sim, 0, 9.0, 0.0, 1.0)
    particles.ball(sim, 1, 0.0, 0.0, 1.0)
    properties.prop(sim, density=1000.0)
    cycles.cycle(sim, 1)
    sim.particles["vx"][sim.particles["gid"] == 0], sim.rebuild_state.countdown = (
        speed,
        rebuild.GLANCE - 1,
    )  # nobody has told it to look, or to glance
    for _ in range(5):
        sim.step()
    sim.open_model()
    if speed < 500.0:
        cycles.cycle(sim, 1)
        assert "1 particles left the BOX" in said.getvalue() and len(sim.particles) == 1
    else:
        with pytest.raises(PhysicsError, match=r"over half its radius per step .*\n  particle 0 at \(12, 0\)"):
            cycles.cycle(sim, 1)


def test_who_is_nowhere_is_not_thought_to_have_left(tmp_path):
    sim, _ = crowd(tmp_path, [], dt=1e-3)
    walls.box(sim, -10.0, 10.0, -5.0, 100.0)
    particles.ball(sim, 0, 9.0, 0.0, 1.0)
    properties.prop(sim, density=1000.0)
    sim.particles["x"][0] = np.nan
    with pytest.raises(PhysicsError, match="a number is not finite"):
        cycles.cycle(sim, 1)


def meeting(folder, monkeypatch, glance: int, speed: float, walled: bool = False):
    """Two discs 0.9 skins apart, or one and a wall as far away; they are set in motion between two looks, unseen."""
    monkeypatch.setattr(rebuild, "GLANCE", glance)
    sim, _ = crowd(folder, [], dt=1e-3)
    gap = 0.9 * reach.NARROW
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    if walled:
        walls.wall(sim, 3, ((1.0 + 1.5 * gap, -9.0), (1.0 + 1.5 * gap, 9.0)), kn=2.0)
    else:
        particles.ball(sim, 1, 3.2 + gap, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=2.0)
    cycles.prepare(sim)
    for _ in range(200):  # lists and looks as they are in a bed at rest
        sim.step()
    sim.particles["vx"][:] = np.where(sim.particles["gid"] == 0, speed, -speed)
    return sim


def test_who_speeds_up_between_two_checks_is_seen(tmp_path, monkeypatch):
    """The lists are there before the contact is, as somebody glances every few steps; nothing is late."""
    for walled in (False, True):
        sim = meeting(tmp_path, monkeypatch, rebuild.GLANCE, 25.0, walled)
        for _ in range(64):
            sim.step()
        assert sim.rebuilds > 1 and diagnostics.survey(sim).deepest > 0.1


@pytest.mark.parametrize("walled", [False, True])
def test_a_contact_that_began_unseen_stops_the_run(tmp_path, monkeypatch, walled):
    """Without glances: the message names who met; a motion that meets nobody goes on."""
    whom = "particle 0 and wall 3" if walled else "particles 0 and 1"
    with pytest.raises(PhysicsError, match=f"contacts were missed, .*: {whom}. The time step 0.001 s is too large"):
        sim = meeting(tmp_path, monkeypatch, 10**9, 25.0, walled)
        for _ in range(64):
            sim.step()
    sim = meeting(tmp_path, monkeypatch, 10**9, -25.0, walled)
    for _ in range(64):
        sim.step()
