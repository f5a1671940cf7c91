"""hpcdem.couple and what the commands of a script then do."""

from __future__ import annotations

import io
import itertools

import numpy as np
import pytest

from hpcdem.cli import info
from hpcdem.commands.dem import cycles, output, properties, settings, walls
from hpcdem.commands.fdem import assignments, checkpoints, coupling, meshes
from hpcdem.commands.fdem import settings as settings_
from hpcdem.commands.fdem import steps as stepping
from hpcdem.commands.fdem import summary as summary_
from hpcdem.commands.fdem.project import Project
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.core.timers import Timers
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.post import inventory
from hpcdem.runtime.progress import BETWEEN, Log
from tests.coupled.support import ROCK, discs


def scene(folder) -> tuple[Project, object]:
    """A block beside a disc that falls on it, not yet coupled."""
    project = Project(Blocks(outdir=folder / "data"), folder, folder / "data")
    meshes.grid(project, (0.0, 0.0), (1.2, 0.6), (6, 3))
    assignments.element_model(project, "mech_iso_elastic", ROCK)
    sim = discs([(0.5, 0.6995, 0.1), (0.5, 0.8998, 0.1)], folder / "sand", dt=5e-6)
    properties.prop(sim, yv=-1.0, xv=0.3)
    settings.set_option(sim, "print", 100)
    settings.set_option(sim, "energy", 50)
    return project, sim


def state(project):
    both = project.coupled
    p = both.particles.particles
    height = diagnostics.values(project.blocks, "position_y")
    return np.concatenate([height, p["x"], p["y"], p["spin"], both.contacts()["fs"],
                           [both.energies()["lost"]]])  # fmt: skip


def test_both_are_stepped_saved_and_restored(tmp_path):
    project, sim = scene(tmp_path)
    coupling.couple(project, sim)
    stepping.step(project, 130)
    assert sim.clock.step == project.step == 130
    checkpoints.save(project, "middle.sav")
    stepping.step(project, 170)
    whole = state(project)
    names = sorted(path.name for path in (tmp_path / "sand").glob("*.vtkhdf"))
    assert [name[-10:-7] for name in names][-2:] == ["200", "300"]
    rows = np.genfromtxt(tmp_path / "sand" / "energy.csv", delimiter=",", names=True)
    assert rows["step"][-1] == 300 and rows["work_blocks"][-1] != 0.0 and abs(rows["relative"][-1]) < 1e-2

    checkpoints.restore(project, str(tmp_path / "middle.sav"))
    assert sim.clock.step == project.step == 130
    stepping.step(project, 170)
    assert np.array_equal(state(project), whole)

    # As a run does that goes on: blocks first, particles when the script has coupled them again.
    again, other = scene(tmp_path)
    checkpoints._restored(again, tmp_path / "middle.sav", begins=True)
    coupling.couple(again, other)
    stepping.step(again, 170)
    assert other.clock.step == again.step == 300 and np.array_equal(state(again), whole)


def test_refusals(tmp_path):
    project, sim = scene(tmp_path)
    with pytest.raises(CommandError, match="would both write into"):
        coupling.couple(project, discs([(0.5, 0.9, 0.1)], tmp_path / "data", dt=5e-6))
    with pytest.raises(CommandError, match="time step must be positive"):
        coupling.couple(project, sim, dt=-1.0)
    inside = discs([(0.5, 0.31, 0.1)], tmp_path / "sand", dt=5e-6)
    with pytest.raises(CommandError, match="inside element"):
        coupling.couple(project, inside)
    coupling.couple(project, sim)  # nothing is left of the failed ones
    with pytest.raises(CommandError, match="coupled to particles already"):
        coupling.couple(project, sim)
    with pytest.raises(CommandError, match="CYC would step these particles without the blocks"):
        cycles.cycle(sim, 1)
    project.clear()
    cycles.cycle(sim, 1)


def test_scaled_masses_are_refused(tmp_path):
    """Before anything is stepped, whichever comes first."""
    project, sim = scene(tmp_path)
    settings_.time_step(project, mass_scaling=1e-4)
    with pytest.raises(CommandError, match="use time-step mass-scaling 0"):
        coupling.couple(project, sim)
    settings_.time_step(project, mass_scaling=0.0)
    coupling.couple(project, sim)
    stepping.step(project, 2)
    settings_.time_step(project, mass_scaling=1e-4)
    with pytest.raises(CommandError, match="use time-step mass-scaling 0"):
        stepping.step(project, 2)
    assert project.step == sim.clock.step == 2


def test_equilibrium_at_once_is_refused(tmp_path):
    project, sim = scene(tmp_path)
    coupling.couple(project, sim)
    with pytest.raises(CommandError, match="model solve elastic would step these blocks without the particles"):
        stepping.solve_elastic(project)


def test_a_time_step_that_is_assigned_later_counts(tmp_path):
    """Of either side, or by SET frac; different ones for both are refused."""
    project, sim = scene(tmp_path)
    coupling.couple(project, sim)
    clocks = sim.clock, project.blocks.clock
    for say, dt in (
        (lambda: settings.set_option(sim, "dt", 4e-6), 4e-6),
        (lambda: settings_.time_step(project, value=3e-6), 3e-6),
        (lambda: None, 3e-6),
    ):
        before = sim.clock.time
        say()
        stepping.step(project, 3)
        assert [clock.dt for clock in clocks] == [dt, dt] and sim.clock.time == pytest.approx(before + 3 * dt)
    settings.set_option(sim, "dt", 2e-6)
    settings_.time_step(project, value=1e-6)
    with pytest.raises(CommandError, match="SET dt 2e-06 s of the particles, model time-step 1e-06 s"):
        stepping.step(project, 3)
    settings_.time_step(project, value=2e-6)
    settings.set_option(sim, "frac", 0.003)
    settings_.time_step(project, value=0.0)
    stepping.step(project, 3)
    assert [clock.dt for clock in clocks] == pytest.approx([0.003 * np.sqrt(2.0 * 2500.0 * np.pi * 0.1**2 / 1e7)] * 2)


def test_frac_is_what_the_particles_ask_for(tmp_path):
    """sqrt(m / k) of the disc times it; a model time-step beyond is refused."""
    project, sim = scene(tmp_path)
    settings.set_option(sim, "frac", 0.003)
    settings_.time_step(project, value=5e-5)
    with pytest.raises(CommandError, match=r"SET frac 0\.003 gives"):
        coupling.couple(project, sim)
    settings_.time_step(project, value=0.0)
    coupling.couple(project, sim)
    assert (
        sim.clock.dt == project.blocks.clock.dt == pytest.approx(0.003 * np.sqrt(2.0 * 2500.0 * np.pi * 0.1**2 / 1e7))
    )


def test_settings_of_one_only_are_named(tmp_path):
    """Gravity of one side, collision off, and walls of which blocks know nothing: once each."""
    project, sim = scene(tmp_path)
    said = io.StringIO()
    sim.log = project.blocks.log = Log(stream=said)
    settings.set_option(sim, "gravity", (0.0, -9.81))
    settings_.option(project, collision=False)
    walls.box(sim, -1.0, 2.0, 0.3, 3.0)
    walls.wall(sim, 7, nodes=((1.1, -1.0), (1.1, 2.0)))
    walls.wall(sim, 8, nodes=((1.25, -1.0), (1.25, 2.0)))
    assignments.initial_velocity(project, (50.0, 0.0))
    both = coupling.couple(project, sim)
    stepping.step(project, 3)
    told = said.getvalue()
    assert (
        told.count("gravity differs: SET gravity 0 -9.81 acts on the particles, model gravity (0,0) on the blocks") == 1
    )
    assert told.count("blocks do not interact with each other, only with particles") == 1
    assert told.count("is in or beyond wall 7, and walls and BOX stop particles only") == 1
    assert told.count("is in or beyond the bottom side of the BOX") == 1 and "wall 8" not in told
    stepping.step(project, 1500)
    told = said.getvalue()
    assert told.count("wall 7") == told.count("bottom side") == told.count("is in or beyond wall 8") == 1
    assert len(both.contacts()["id"]) > 0 or diagnostics.values(project.blocks, "velocity_x").mean() < 50.0

    settings_.gravity(project, (0.0, -9.81))
    settings_.option(project, collision=True)
    stepping.step(project, 3)
    assert said.getvalue().count("gravity differs") == 1


def test_a_property_counts_from_the_next_step_on(tmp_path):
    """Also between two searches for contacts, and for a material that is new: as if the search had come then."""
    ends = []
    for searches in (False, True):
        project, sim = scene(tmp_path / str(searches))
        both = coupling.couple(project, sim)
        stepping.step(project, 60)
        link = both.link
        properties.prop(sim, kn=3e7, fric=0.01)
        if searches:
            both._connect()
            both._replay()
        stepping.step(project, 2)
        assert (both.link is link) is not searches
        stepping.step(project, 60)
        ends.append(state(project))
        assert both.contacts()["fn"].max() == pytest.approx(3e7 * both.contacts()["overlap"].max())
    assert np.array_equal(*ends)


def test_info_of_a_checkpoint_of_both(tmp_path, capsys):
    """Both stand in it, each with its own step; damage is found wherever it is."""
    project, sim = scene(tmp_path)
    walls.wall(sim, 1, nodes=((-1.0, -0.5), (2.0, -0.5)))
    cycles.cycle(sim, 7)
    both = coupling.couple(project, sim)
    stepping.step(project, 130)
    checkpoints.save(project, "middle.sav")
    path = tmp_path / "middle.sav"
    facts = inventory.of_file(path)
    assert facts["whole"] and (facts["kind"], facts["version"]) == ("checkpoint", checkpoint.VERSION)
    assert (facts["step"], facts["dt"], facts["elements"], facts["nodes"]) == (130, 5e-6, 36, 28)
    assert facts["time"] == project.blocks.clock.time
    assert facts["particles_at"] == {"step": 137, "time": sim.clock.time, "dt": 5e-6}
    assert (facts["particles"], facts["bonds"], facts["walls"]) == (2, 0, 1)
    assert facts["disc_face_contacts"] == len(both.contacts()["id"]) > 0
    info.show(path, facts)
    shown = capsys.readouterr().out
    assert f"{path}: checkpoint, complete" in shown and "\n  particles    2\n" in shown
    assert "\n  particles at step 137, time 0.000685, dt 5e-06\n" in shown

    content = path.read_bytes()
    tables = checkpoint.read(path)[1]
    broken = tmp_path / "broken.sav"
    for name in ("discs_particles", "disc_contacts", "state"):
        rows = next(iter(column for column in tables[name].values() if column.any()))
        at = content.index(rows.tobytes())
        broken.write_bytes(content[: at + 1] + bytes([content[at + 1] ^ 1]) + content[at + 2 :])
        assert not inventory.of_file(broken)["whole"]
    broken.write_bytes(content[:-100])
    assert "seal" in inventory.of_file(broken)["why"]

    state = checkpoint.read_state(path)
    hostile = ({"kind": "plasma"}, {"particles": None}, {"particles": {**state["particles"], "walls": 3}},
               {"particles": {}}, {"extra": []})  # fmt: skip
    for change in hostile:
        slabs = {name: Table(columns, 0, len(next(iter(columns.values())))) for name, columns in tables.items()}
        checkpoint.write(broken, {**state, **change}, slabs, SerialComm())
        facts = inventory.of_file(broken)
        assert not facts["whole"] and ("unknown kind 'plasma'" in facts["why"] or "is damaged" in facts["why"])


def rows_of(text, title):
    """The table with this title, by its first column."""
    lines = text.split(f"{title}\n", 1)[1].splitlines()
    cells = [line.rsplit(maxsplit=1) for line in lines[1:]]
    return {name.strip(): float(value) for name, value in itertools.takewhile(lambda row: row[1][-1].isdigit(), cells)}


def test_the_tables_of_energy_close_together(tmp_path):
    """Both list what went across the contacts by one name; with the energy of the falling discs in, theirs and what the
    contacts kept add up as `energies` does, to the digits that are shown."""
    project, sim = scene(tmp_path)
    said = io.StringIO()
    project.blocks.log = sim.log = Log(stream=said)
    diagnostics.account_energy(project.blocks)
    both = coupling.couple(project, sim)
    falling = 2 * 0.5 * 2500.0 * np.pi * 0.1**2 * (1.0**2 + 0.3**2)
    stepping.step(project, 250)
    checkpoints.save(project, "middle.sav")
    stepping.step(project, 3000)
    whole = diagnostics.energies(project.blocks)
    checkpoints.restore(project, str(tmp_path / "middle.sav"))
    stepping.step(project, 3000)
    assert diagnostics.energies(project.blocks) == whole  # a restart forgets nothing of it
    found = both.energies()
    assert whole["work_discs"] == pytest.approx(found["work_on_blocks"], rel=1e-9) and whole["work_discs"] > 1.0
    assert abs(whole["work_outside"]) < 1e-9 * whole["work_discs"]

    output.report_energy(sim)
    told = said.getvalue()
    discs = rows_of(told, "energy budget")
    said.truncate(0)
    summary_.close(project, figure=False)
    told = said.getvalue()
    blocks, between = rows_of(told, "energy budget"), rows_of(told, output.ACROSS)
    assert discs[output.ACROSS] == between["work on particles"] and blocks[output.ACROSS] == between["work on blocks"]
    assert sum(between.values()) == pytest.approx(0.0, abs=1e-4)
    of_discs = sum(v for name, v in discs.items() if name.startswith(("stored", "lost"))) - falling
    of_blocks = sum(v for name, v in blocks.items() if name.startswith(("stored", "lost")))
    left = of_discs + of_blocks + between["lost by friction, minus initial overlaps"]
    left += between["stored in the contacts since the beginning"]
    assert abs(left) < 1e-4 * falling and found["relative"] < 1e-6
    assert found["lost"] == pytest.approx(-0.5 * 1e7 * 0.0005**2, rel=0.02)  # sticks; begins with an overlap of 0.5 mm
    assert "energy of both: closing error" in told


def test_the_table_of_stages_names_both(tmp_path):
    """One table: stages of either, what is between them, nothing twice: they add up to the wall time at most."""
    project, sim = scene(tmp_path)
    said = io.StringIO()
    project.blocks.log = Log(stream=said)
    coupling.couple(project, sim)
    stepping.step(project, 300)
    summary_.close(project, figure=False)
    cells = [line.split("  ") for line in said.getvalue().splitlines()]
    names = {row[0] for row in cells}
    assert {"particles: force", "blocks: force", "between: contact", "between: search", "between: exchange",
            "particles: output", "blocks: node", "other"} <= names  # fmt: skip
    assert "300 steps of particles and 300 of blocks in" in said.getvalue()
    summary = Timers.joined({"a": sim.timers, "b": project.blocks.timers}, BETWEEN).merge(SerialComm())
    assert sum(stage.mean for stage in summary.stages) < summary.wall and summary.imbalance == 1.0
